//! Reading and writing as a user meets it: round trips, and clear words for what cannot be read.

use lookmatch_imaging::{Image, ImageError, read, write};
use std::fs;
use std::path::Path;

/// Values that only an exact round trip keeps, negative zero and a subnormal among them.
fn awkward() -> Image {
    let values = [0.0, -0.0, 1e-42, 0.1, -3.5, 1e4, 65_520.0, f32::MAX, f32::MIN_POSITIVE];
    Image::from_fn(23, 19, |x, y| [values[(x + y) % 9], values[(2 * x + y) % 9], x as f32 / (y as f32 + 0.7)])
}

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels().iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

fn notes(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
    pairs.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

fn message<T: std::fmt::Debug>(result: Result<T, ImageError>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn exr_keeps_every_bit_and_the_notes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let notes = notes(&[("model", "ggx"), ("alpha of the base", "0.25"), ("note", "süß α")]);
    write(&path, &awkward(), &notes).unwrap();
    let back = read(&path).unwrap();
    assert_eq!((back.width(), back.height()), (23, 19));
    assert_eq!(bits(&back), bits(&awkward()));

    let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
    let other = &meta.headers[0].own_attributes.other;
    assert_eq!(other.len(), 3);
    for (key, value) in &notes {
        let found = &other[&exr::meta::attribute::Text::from(key.as_str())];
        assert_eq!(found.to_text().unwrap().as_slice(), value.as_bytes());
    }
}

#[test]
fn png_holds_srgb_bytes_and_the_notes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.PNG");
    let image = Image::from_pixels(2, 1, vec![[0.0, 0.214, 1.0], [-1.0, 7.0, 0.5]]).unwrap();
    write(&path, &image, &notes(&[("model", "ggx"), ("alpha", "α")])).unwrap();

    let file = std::io::BufReader::new(fs::File::open(&path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = [0; 6];
    reader.next_frame(&mut bytes).unwrap();
    assert_eq!(bytes, [0, 127, 255, 0, 255, 188]);
    let info = reader.info();
    assert_eq!(info.uncompressed_latin1_text[0].keyword, "model");
    assert_eq!(info.uncompressed_latin1_text[0].text, "ggx");
    assert_eq!(info.utf8_text[0].get_text().unwrap(), "α");
    assert!(info.srgb.is_some());
}

#[test]
fn unknown_extensions_are_refused_before_anything_happens() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.jpg", "a", "a.hdr"] {
        let path = folder.path().join(name);
        let text = message(write(&path, &awkward(), &[]));
        assert!(text.contains(name) && text.contains(".exr and .png"), "{text}");
        assert!(!path.exists());
    }
    let text = message(read(Path::new("b.png")));
    assert!(text.contains("b.png") && text.contains(".exr and .hdr"), "{text}");
}

#[test]
fn missing_files_and_folders_are_named() {
    let text = message(read(Path::new("no such folder/b.exr")));
    assert!(text.contains("cannot read `no such folder/b.exr`"), "{text}");
    let text = message(write(Path::new("no such folder/b.exr"), &awkward(), &[]));
    assert!(text.contains("cannot write `no such folder/b.exr`"), "{text}");
}

#[test]
fn values_that_are_no_numbers_are_found() {
    use exr::prelude::write_rgb_file;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("nan.exr");
    let colour = |x, y| (1.0_f32, if (x, y) == (2, 3) { f32::NAN } else { 0.0 }, 1.0_f32);
    write_rgb_file(&path, 5, 5, colour).unwrap();
    let text = message(read(&path));
    assert!(text.contains("NaN in channel G of pixel x = 2, y = 3"), "{text}");

    let mut image = Image::new(2, 2);
    image.pixels_mut()[3][2] = f32::INFINITY;
    let path = folder.path().join("inf.exr");
    let text = message(write(&path, &image, &[]));
    assert!(text.contains("inf in channel B of pixel x = 1, y = 1"), "{text}");
    assert!(!path.exists());
}

#[test]
fn images_without_pixels_are_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let text = message(write(&folder.path().join("a.exr"), &Image::new(0, 4), &[]));
    assert!(text.contains("0 x 4"), "{text}");
}

#[test]
fn notes_that_do_not_fit_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (name, key) in [("a.exr", "compression"), ("a.exr", ""), ("a.png", "α"), ("a.png", "")] {
        let path = folder.path().join(name);
        let text = message(write(&path, &awkward(), &notes(&[(key, "1")])));
        assert!(text.contains(&format!("note `{key}`")) && text.contains(name), "{text}");
        assert!(!path.exists());
    }
}

/// Other programs write halves, integers, alpha, several layers and all kinds of compression.
mod foreign {
    use super::*;
    use exr::prelude::{
        AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image as ExrImage, Layer,
        LayerAttributes, Vec2, WritableImage, f16,
    };

    fn layer(
        name: &str,
        channels: &[&str],
        samples: impl Fn(f32) -> FlatSamples,
    ) -> Layer<AnyChannels<FlatSamples>> {
        let list = channels.iter().enumerate();
        let list = list.map(|(i, name)| AnyChannel::new(*name, samples(i as f32 + 1.0)));
        Layer::new(
            Vec2(4, 3),
            LayerAttributes::named(name),
            Encoding { compression: Compression::PIZ, ..Encoding::SMALL_LOSSLESS },
            AnyChannels::sort(list.collect()),
        )
    }

    fn half(value: f32) -> FlatSamples {
        FlatSamples::F16(vec![f16::from_f32(value); 12])
    }

    #[test]
    fn halves_with_alpha() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("half.exr");
        let layer = layer("main", &["R", "G", "B", "A"], half);
        ExrImage::from_layer(layer).write().to_file(&path).unwrap();
        assert_eq!(read(&path).unwrap().get(3, 2), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn integers_in_the_second_layer() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("layers.exr");
        let depth = layer("depth", &["Z"], half);
        let colour = layer("colour", &["R", "G", "B"], |v| FlatSamples::U32(vec![v as u32 * 10; 12]));
        let mut image = ExrImage::from_layer(depth.clone());
        image.attributes.display_window.size = Vec2(4, 3);
        let image = ExrImage::from_layers(image.attributes, vec![depth, colour]);
        image.write().to_file(&path).unwrap();
        assert_eq!(read(&path).unwrap().get(0, 0), [10.0, 20.0, 30.0]);
    }

    #[test]
    fn without_red_green_and_blue_the_channels_are_listed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("xyz.exr");
        let layer = layer("main", &["X", "Y", "Z"], half);
        ExrImage::from_layer(layer).write().to_file(&path).unwrap();
        let text = message(read(&path));
        assert!(text.contains("X, Y, Z") && text.contains("R, G and B are needed"), "{text}");
    }
}
