//! Makes the environment maps that ship with the program: `cargo run --example pack_maps -- FOLDER`, where FOLDER holds
//! Blender's `city.exr`, `forest.exr`, `night.exr`, `studio.exr` and `sunset.exr` (1024 × 512, CC0). Each becomes 512 ×
//! 256, negative values 0, every texel the mean of four by solid angle, as half floats of 8
//! significant bits with PIZ compression.

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path;

use exr::compression::Compression;
use exr::image::write::WritableImage;
use exr::image::{Encoding, Image as ExrImage, Layer, SpecificChannels};
use exr::math::Vec2;
use exr::meta::header::LayerAttributes;
use exr::prelude::f16;
use lookmatch_imaging::Image;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("expected the folder of the maps")?;
    for name in ["city", "forest", "night", "studio", "sunset"] {
        let map = lookmatch_imaging::read(&Path::new(&folder).join(name).with_extension("exr"))?;
        let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(name).with_extension("exr");
        write(&target, &halved(&map))?;
        println!("{}: {} bytes", target.display(), std::fs::metadata(&target)?.len());
    }
    Ok(())
}

fn halved(map: &Image) -> Image {
    let height = map.height() as f64;
    let solid_angle = |y: usize| (PI * y as f64 / height).cos() - (PI * (y + 1) as f64 / height).cos();
    Image::from_fn(map.width() / 2, map.height() / 2, |x, y| {
        let rows = [2 * y, 2 * y + 1];
        let whole: f64 = rows.map(solid_angle).iter().sum();
        let texel = |x: usize, y: usize, c: usize| f64::from(map.get(x, y)[c].max(0.0)) * solid_angle(y);
        let row = |y: usize, c: usize| 0.5 * (texel(2 * x, y, c) + texel(2 * x + 1, y, c));
        std::array::from_fn(|c| (rows.map(|y| row(y, c)).iter().sum::<f64>() / whole) as f32)
    })
}

/// A half float without its last three bits, which pack badly: within 0.4 %, and even on the average.
fn rounded(value: f32) -> f16 {
    f16::from_bits((f16::from_f32(value).to_bits() + 4) & !7)
}

fn write(path: &Path, image: &Image) -> Result<(), Box<dyn Error>> {
    let colour = |Vec2(x, y): Vec2<usize>| {
        let [r, g, b] = image.get(x, y).map(rounded);
        (r, g, b)
    };
    let encoding = Encoding { compression: Compression::PIZ, ..Encoding::SMALL_LOSSLESS };
    let channels = SpecificChannels::rgb(colour);
    let layer = Layer::new((image.width(), image.height()), LayerAttributes::default(), encoding, channels);
    ExrImage::from_layer(layer).write().non_parallel().to_file(path)?;
    Ok(())
}
