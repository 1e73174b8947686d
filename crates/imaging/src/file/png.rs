//! PNG for looking at: 8 bits a channel with the sRGB transfer function.

use crate::{Image, ImageError, srgb_encode};
use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};
use std::path::Path;

/// Encodes the image clipped to 0..1; notes become `tEXt` chunks (`iTXt` where the text is not Latin-1).
pub(super) fn encode(path: &Path, image: &Image, notes: &[(String, String)]) -> Result<Vec<u8>, ImageError> {
    for (key, value) in notes {
        check_note(path, key, value)?;
    }
    let bytes = image.pixels().iter().flat_map(|pixel| pixel.map(byte)).collect::<Vec<u8>>();
    encode_bytes(image, &bytes, notes).map_err(|error| ImageError::Io {
        path: path.into(),
        action: "write",
        source: error.into(),
    })
}

fn encode_bytes(image: &Image, bytes: &[u8], notes: &[(String, String)]) -> Result<Vec<u8>, EncodingError> {
    let mut file = Vec::new();
    // The caller has checked that the image has at most 2^28 pixels, so each side fits.
    let mut encoder = Encoder::new(&mut file, image.width() as u32, image.height() as u32);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    for (key, value) in notes {
        if is_latin1(value) {
            encoder.add_text_chunk(key.clone(), value.clone())?;
        } else {
            encoder.add_itxt_chunk(key.clone(), value.clone())?;
        }
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(file)
}

/// PNG specification, section 11.3.3: keywords have 1 to 79 Latin-1 characters, and zero ends a text.
fn check_note(path: &Path, key: &str, value: &str) -> Result<(), ImageError> {
    let reason = if !(1..=79).contains(&key.chars().count()) || !is_latin1(key) {
        "a PNG keyword has 1 to 79 Latin-1 characters, none of them zero"
    } else if value.contains('\0') {
        "a PNG text cannot contain the character zero"
    } else {
        return Ok(());
    };
    Err(ImageError::Note { path: path.into(), key: key.into(), reason: reason.into() })
}

fn is_latin1(text: &str) -> bool {
    text.chars().all(|c| c != '\0' && u32::from(c) < 256)
}

fn byte(linear: f32) -> u8 {
    (srgb_encode(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}
