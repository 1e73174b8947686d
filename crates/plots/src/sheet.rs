//! Sheets of paper: what all figures share, whatever is drawn on them and into whichever file.

use std::path::Path;
use std::sync::Once;

use lookmatch_imaging::write_atomically;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use crate::PlotError;

/// Pixels of a PNG for one of the layout.
const DENSITY: u32 = 2;

pub(crate) type Area<'a, B> = DrawingArea<B, Shift>;
pub(crate) type Drawn = Result<(), String>;

/// Something that can be drawn.
pub(crate) trait Drawing {
    /// Draws it with so many pixels for one of the layout.
    fn draw<B: DrawingBackend>(&self, root: &Area<B>, scale: u32) -> Drawn;
}

/// Draws into a .png or .svg file.
pub(crate) fn write(path: &Path, size: (u32, u32), drawing: &impl Drawing) -> Result<(), PlotError> {
    register();
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let failed = |reason| PlotError::Drawing { path: path.to_owned(), reason };
    let bytes = match extension.as_str() {
        "svg" => {
            let mut text = String::new();
            let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
            drawing.draw(&root, 1).map_err(failed)?;
            drop(root);
            text.into_bytes()
        }
        "png" => {
            let size = (size.0 * DENSITY, size.1 * DENSITY);
            let mut pixels = vec![255; (size.0 * size.1 * 3) as usize];
            let root = BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area();
            drawing.draw(&root, DENSITY).map_err(failed)?;
            drop(root);
            png(&pixels, size).map_err(|error| failed(error.to_string()))?
        }
        _ => return Err(PlotError::Ending { path: path.to_owned() }),
    };
    write_atomically(path, |out| out.write_all(&bytes))
        .map_err(|source| PlotError::Write { path: path.to_owned(), source })
}

/// The font that comes with the program: systems differ in theirs, and some have none.
fn register() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // A font that cannot be read shows as missing text, and cannot happen to one that is built in.
        let _ = register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular());
    });
}

fn png(pixels: &[u8], (width, height): (u32, u32)) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(file)
}

/// Three digits, without zeros at the end.
pub(crate) fn short(value: f64) -> String {
    let digits = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
