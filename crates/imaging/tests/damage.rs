//! Truncated and altered files must give an image or an error: never a panic, never gigabytes of memory.

use lookmatch_imaging::{Image, read, write};
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::TempDir;

/// A small picture with both noise and flat parts, so that compression has something to do.
fn picture() -> Image {
    Image::from_fn(40, 37, |x, y| {
        if x < 20 { [0.25, 0.5, 2.0] } else { [x as f32 * 0.37, y as f32, (x * y % 11) as f32] }
    })
}

fn exr_bytes() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write(&path, &picture(), &[("model".into(), "ggx".into())]).unwrap();
    fs::read(path).unwrap()
}

/// The same picture in another compression, as tiles or lines of half floats.
fn foreign_bytes(compression: exr::prelude::Compression, tiles: bool) -> Vec<u8> {
    use exr::prelude::{
        Blocks, Encoding, Layer, LayerAttributes, LineOrder, SpecificChannels, Vec2, WritableImage, f16,
    };
    let blocks = if tiles { Blocks::Tiles(Vec2(16, 16)) } else { Blocks::ScanLines };
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let picture = picture();
    let colour = move |Vec2(x, y): Vec2<usize>| {
        let [r, g, b] = picture.get(x, y).map(f16::from_f32);
        (r, g, b)
    };
    let layer = Layer::new((40, 37), LayerAttributes::named("a"), encoding, SpecificChannels::rgb(colour));
    let mut bytes = std::io::Cursor::new(Vec::new());
    exr::prelude::Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// Three lines of each coding of the Radiance format.
fn hdr_bytes() -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1.5\n\n-Y 9 +X 30\n".to_vec();
    for _ in 0..3 {
        bytes.extend([2, 2, 0, 30]);
        for channel in 0..4 {
            bytes.extend([128 + 20, 100 + channel, 10, 1, 2, 3, 4, 5, 6, 7, 8, 9, 130]);
        }
        bytes.extend((0..30).flat_map(|x| [50 + x, 3, 200, 129]));
        bytes.extend([7, 9, 11, 130, 1, 1, 1, 29]);
    }
    bytes
}

/// One folder for all cases of a test process; every case writes a file of its own.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().unwrap());

fn store(name: &str, bytes: &[u8]) -> PathBuf {
    let path = FOLDER.path().join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// Reading gives a whole image or an error that names the file.
fn read_survives(path: &Path) {
    match read(path) {
        Ok(image) => assert_eq!(image.pixels().len(), image.width() * image.height()),
        Err(error) => assert!(error.to_string().contains(path.to_str().unwrap()), "{error}"),
    }
}

fn samples() -> Vec<(&'static str, Vec<u8>)> {
    use exr::prelude::Compression;
    vec![
        ("zip.exr", exr_bytes()),
        ("piz.exr", foreign_bytes(Compression::PIZ, false)),
        ("rle.exr", foreign_bytes(Compression::RLE, true)),
        ("pxr24.exr", foreign_bytes(Compression::PXR24, false)),
        ("b44.exr", foreign_bytes(Compression::B44, true)),
        ("plain.exr", foreign_bytes(Compression::Uncompressed, false)),
        ("radiance.hdr", hdr_bytes()),
    ]
}

static SAMPLES: LazyLock<Vec<(&'static str, Vec<u8>)>> = LazyLock::new(samples);

#[test]
fn whole_files_are_read() {
    for (name, bytes) in &*SAMPLES {
        read(&store(&format!("whole-{name}"), bytes)).unwrap();
    }
}

#[test]
fn truncated_files_are_errors() {
    for (name, bytes) in &*SAMPLES {
        for length in (0..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
            let path = store(&format!("truncated-{name}"), &bytes[..length]);
            let error = read(&path).expect_err(name).to_string();
            assert!(error.contains(name), "{error}");
        }
    }
}

#[test]
fn no_single_byte_of_a_header_brings_it_down() {
    // The other samples have the same header as one of these.
    let headers = ["zip.exr", "rle.exr", "radiance.hdr"];
    for (name, bytes) in SAMPLES.iter().filter(|(name, _)| headers.contains(name)) {
        for position in 0..bytes.len().min(420) {
            for value in [0, 0x7f, 0xff] {
                let mut damaged = bytes.clone();
                damaged[position] = value;
                read_survives(&store(&format!("header-{name}"), &damaged));
            }
        }
    }
}

/// An EXR header of 300 bytes that claims a huge picture.
#[test]
fn absurd_sizes_are_not_believed() {
    let bytes = exr_bytes();
    let key = b"dataWindow\0box2i\0";
    let start = bytes.windows(key.len()).position(|w| w == key).unwrap() + key.len() + 4;
    for (x_max, y_max) in [(16_383, 16_383), (1_000_000_000, 1_000_000_000), (i32::MAX, i32::MAX), (-5, 3)] {
        let mut damaged = bytes.clone();
        damaged[start + 8..start + 12].copy_from_slice(&i32::to_le_bytes(x_max));
        damaged[start + 12..start + 16].copy_from_slice(&i32::to_le_bytes(y_max));
        let error = read(&store("absurd.exr", &damaged)).unwrap_err().to_string();
        assert!(error.contains("absurd.exr"), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn altered_bytes_do_no_harm(
        sample in 0_usize..7,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (name, bytes) = &SAMPLES[sample];
        let mut damaged = bytes.clone();
        for (position, value) in changes {
            let position = position.index(damaged.len());
            damaged[position] = value;
        }
        read_survives(&store(&format!("altered-{name}"), &damaged));
    }

    #[test]
    fn noise_behind_a_good_start_does_no_harm(
        sample in 0_usize..7,
        kept in 0_usize..500,
        noise in prop::collection::vec(any::<u8>(), 0..300),
    ) {
        let (name, bytes) = &SAMPLES[sample];
        let start = &bytes[..kept.min(bytes.len())];
        read_survives(&store(&format!("noise-{name}"), &[start, &noise].concat()));
    }
}
