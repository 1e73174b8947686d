use super::*;
use std::io::{Cursor, SeekFrom};
use std::sync::Arc;

/// Values that every format can tell apart, beyond 0 to 1 for floats.
fn value(format: Format, channel: usize, x: usize, y: usize) -> f32 {
    let v = ((x * 31 + y * 17 + channel * 101) % 251) as f32 / 250.0;
    if format.depth.is_integer() { v } else { 3.0 * v - 0.5 }
}

fn band(sheet: &Sheet, rows: Range<usize>) -> Band {
    let plane = |c| {
        let row = |y: usize| (0..sheet.width).map(move |x| value(sheet.format, c, x, y));
        rows.clone().flat_map(row).collect()
    };
    (0..sheet.channels).map(plane).collect()
}

fn formats() -> Vec<Format> {
    Format::NAMES.iter().map(|name| Format::parse(name).unwrap()).collect()
}

fn sheet(format: Format, channels: usize, width: usize, height: usize) -> Sheet {
    let metadata = Metadata {
        text: vec![
            ("Description".into(), "oak, planed".into()),
            ("Author".into(), "A. Turner".into()),
            ("Software".into(), "a program".into()),
        ],
        resolution: Some([11811.0, 11811.0]),
        icc: (format.container != Container::Exr).then(|| b"a profile, of a kind".to_vec()),
        exr: None,
    };
    Sheet { width, height, channels, format, metadata, is_srgb: false }
}

fn bytes(sheet: &Sheet, step: usize) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let firsts = (0..sheet.height).step_by(step);
    let bands = firsts.map(|y| Arc::new(band(sheet, y..(y + step).min(sheet.height))));
    write(sheet, &mut out, &mut bands.into_iter()).unwrap();
    out.into_inner()
}

fn stored(folder: &Path, name: &str, format: Format, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.join(format!("{name}.{}", format.container.extension()));
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Reads all rows in bands of some height.
fn read_all(path: &Path, step: usize) -> Result<(Header, Band), TextureError> {
    let (header, mut bands) = open(path)?;
    let mut all = vec![Vec::new(); header.channels];
    for first in (0..header.height).step_by(step) {
        let mut planes = vec![Vec::new(); header.channels];
        bands.read(first..(first + step).min(header.height), &mut planes)?;
        all.iter_mut().zip(planes).for_each(|(all, part)| all.extend(part));
    }
    Ok((header, all))
}

#[test]
fn every_format_comes_back_with_its_notes_in_bands_of_any_height() {
    let folder = tempfile::tempdir().unwrap();
    for format in formats() {
        for channels in [1, 3] {
            let sheet = sheet(format, channels, 67, 75);
            let written = bytes(&sheet, 75);
            for step in [1, 7, 16, 32] {
                assert_eq!(bytes(&sheet, step), written, "{format:?} in bands of {step}");
            }
            let path = stored(folder.path(), "map", format, &written);
            for step in [1, 7, 75] {
                let (header, planes) = read_all(&path, step).unwrap();
                assert_eq!((header.width, header.height, header.channels), (67, 75, channels));
                assert_eq!(header.format, format);
                assert!(header.srgb.is_none() && !header.has_alpha);
                for (plane, expected) in planes.iter().zip(band(&sheet, 0..75)) {
                    for (found, expected) in plane.iter().zip(expected) {
                        let error = f64::from((found - expected).abs());
                        assert!(error <= format.depth.rounding(f64::from(expected)) + 1e-7, "{format:?}");
                    }
                }
                for note in &sheet.metadata.text {
                    assert!(header.metadata.text.contains(note), "{format:?}: {:?}", header.metadata.text);
                }
                assert_eq!(header.metadata.icc, sheet.metadata.icc);
                let [x, y] = header.metadata.resolution.unwrap();
                assert!((x - 11811.0).abs() < 1.0 && (y - 11811.0).abs() < 1.0, "{format:?}: {x} {y}");
            }
        }
    }
}

/// A disk that is full after some bytes.
struct Full {
    inner: Cursor<Vec<u8>>,
    room: u64,
}

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.inner.position() + bytes.len() as u64 > self.room {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        self.inner.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Full {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.inner.seek(to)
    }
}

#[test]
fn a_full_disk_and_an_early_end_are_errors_wherever_they_come() {
    for format in formats() {
        let sheet = sheet(format, 3, 64, 64);
        let length = bytes(&sheet, 16).len() as u64;
        for room in [0, 10, length / 3, length / 2, length - 1] {
            let mut out = Full { inner: Cursor::default(), room };
            let error =
                write(&sheet, &mut out, &mut std::iter::once(Arc::new(band(&sheet, 0..64)))).unwrap_err();
            assert_eq!(
                error.kind(),
                io::ErrorKind::StorageFull,
                "{format:?} with {room} of {length} bytes: {error}"
            );
        }
        let mut out = Cursor::new(Vec::new());
        let error = write(&sheet, &mut out, &mut std::iter::once(Arc::new(band(&sheet, 0..40)))).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::Interrupted, "{format:?}");
    }
}

#[test]
fn damaged_files_are_refused_by_name_and_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    for format in formats() {
        let whole = bytes(&sheet(format, 1, 64, 64), 16);
        for length in [0, 4, 20, whole.len() / 3, whole.len() / 2, whole.len() * 9 / 10] {
            let path = stored(folder.path(), "short", format, &whole[..length]);
            let error = read_all(&path, 16).unwrap_err().to_string();
            assert!(error.contains("short."), "{format:?} of {length} bytes: {error}");
            let words = ["truncated", "damaged"];
            assert!(words.iter().any(|w| error.contains(w)), "{format:?} of {length} bytes: {error}");
        }
        // Flipped bytes may go unnoticed where nothing checks them; they must not end the program.
        for place in (0..whole.len()).step_by(whole.len() / 97) {
            let mut damaged = whole.clone();
            damaged[place] ^= 0x55;
            let path = stored(folder.path(), "flipped", format, &damaged);
            let _ = read_all(&path, 16);
        }
    }
}

#[test]
fn tiles_lines_from_the_bottom_and_every_compression_of_exr_are_read() {
    use exr::compression::Compression::{PIZ, RLE, Uncompressed, ZIP1, ZIP16};
    use exr::image::write::WritableImage;
    use exr::image::{Blocks, Encoding, Image, Layer, SpecificChannels};
    use exr::math::Vec2;
    use exr::meta::attribute::LineOrder::{Decreasing, Increasing};
    use exr::meta::header::LayerAttributes;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.exr");
    let at = |x: usize, y: usize| (x * 3 + y * 1000) as f32;
    for compression in [PIZ, RLE, Uncompressed, ZIP1, ZIP16] {
        for (blocks, line_order) in [
            (Blocks::ScanLines, Increasing),
            (Blocks::ScanLines, Decreasing),
            (Blocks::Tiles(Vec2(32, 48)), Increasing),
        ] {
            let channels =
                SpecificChannels::build().with_channel("Y").with_pixel_fn(|Vec2(x, y)| (at(x, y),));
            let encoding = Encoding { compression, blocks, line_order };
            let layer = Layer::new((100, 130), LayerAttributes::default(), encoding, channels);
            Image::from_layer(layer).write().non_parallel().to_file(&path).unwrap();
            for step in [1, 33, 64, 130] {
                let (header, planes) = read_all(&path, step).unwrap();
                assert_eq!(header.format.name(), "exr-float");
                let right = (0..130 * 100).all(|i| planes[0][i] == at(i % 100, i / 100));
                assert!(right, "{compression:?} {blocks:?} {line_order:?} in bands of {step}");
            }
        }
    }
}

#[test]
fn attributes_of_exr_are_kept_whatever_their_type() {
    use exr::meta::attribute::AttributeValue;
    let folder = tempfile::tempdir().unwrap();
    let format = Format::parse("exr-half").unwrap();
    let mut sheet = sheet(format, 1, 8, 8);
    let path = stored(folder.path(), "a", format, &bytes(&sheet, 8));
    let mut kept = open(&path).unwrap().0.metadata;
    let exr = kept.exr.as_mut().unwrap();
    exr.1.other.insert("displacement".into(), AttributeValue::F32(0.25));
    exr.1.other.insert("corner".into(), AttributeValue::IntVec2(exr::math::Vec2(3, -4)));
    exr.1.wrap_mode_name = Some("periodic".into());
    exr.0.pixel_aspect = 1.5;
    kept.note("lookmatch", "a map");
    sheet.metadata = kept.clone();
    let path = stored(folder.path(), "b", format, &bytes(&sheet, 8));
    let found = open(&path).unwrap().0.metadata;
    assert_eq!(found.exr.unwrap().1, kept.exr.clone().unwrap().1);
    assert!(found.text.contains(&("lookmatch".into(), "a map".into())));
}

#[test]
fn interlaced_pngs_palettes_and_alpha() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let mut encoder = png::Encoder::new(File::create(&path).unwrap(), 4, 2);
    encoder.set_color(::png::ColorType::Rgba);
    let pixels: Vec<u8> = (0..32).map(|i| i * 8).collect();
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    let (header, planes) = read_all(&path, 1).unwrap();
    assert!(header.has_alpha && header.channels == 3);
    assert_eq!(planes[1][5], f32::from(pixels[21]) / 255.0);
    let mut encoder = png::Encoder::new(File::create(&path).unwrap(), 4, 1);
    encoder.set_color(::png::ColorType::Indexed);
    encoder.set_palette(vec![0, 0, 0, 10, 20, 30, 255, 0, 255]);
    encoder.write_header().unwrap().write_image_data(&[0, 1, 2, 1]).unwrap();
    let (header, planes) = read_all(&path, 1).unwrap();
    assert_eq!(header.channels, 3);
    assert_eq!(planes[2], [0.0, 30.0 / 255.0, 1.0, 30.0 / 255.0]);
}

use ::exr;
use ::png;

#[test]
fn tiled_tiffs_are_read() {
    use ::tiff::encoder::TiffEncoder;
    use ::tiff::tags::Tag;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.tif");
    let (width, height) = (20usize, 37usize);
    let at = |x: usize, y: usize| if x < width && y < height { (x * 11 + y * 3) as u8 } else { 255 };
    for tile in [16usize, 48] {
        let mut encoder = TiffEncoder::new(File::create(&path).unwrap()).unwrap();
        let mut directory = encoder.image_directory().unwrap();
        let (across, down) = (width.div_ceil(tile), height.div_ceil(tile));
        let mut offsets = Vec::new();
        for index in 0..across * down {
            let (left, top) = (index % across * tile, index / across * tile);
            let bytes: Vec<u8> = (0..tile * tile).map(|i| at(left + i % tile, top + i / tile)).collect();
            offsets.push(directory.write_data(&bytes[..]).unwrap() as u32);
        }
        directory.write_tag(Tag::ImageWidth, width as u32).unwrap();
        directory.write_tag(Tag::ImageLength, height as u32).unwrap();
        directory.write_tag(Tag::BitsPerSample, 8u16).unwrap();
        directory.write_tag(Tag::Compression, 1u16).unwrap();
        directory.write_tag(Tag::PhotometricInterpretation, 1u16).unwrap();
        directory.write_tag(Tag::TileWidth, tile as u32).unwrap();
        directory.write_tag(Tag::TileLength, tile as u32).unwrap();
        directory.write_tag(Tag::TileOffsets, &offsets[..]).unwrap();
        directory.write_tag(Tag::TileByteCounts, &vec![(tile * tile) as u32; offsets.len()][..]).unwrap();
        directory.finish().unwrap();
        for step in [1, 7, 16, 37] {
            let planes = read_all(&path, step).unwrap().1;
            let right =
                (0..width * height).all(|i| planes[0][i] == f32::from(at(i % width, i / width)) / 255.0);
            assert!(right, "tiles of {tile}, bands of {step}");
        }
    }
}
