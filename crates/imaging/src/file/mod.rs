//! Image files: which formats there are, and what every one of them must satisfy.

mod exr;
mod hdr;
mod png;

use crate::{Image, ImageError, write_atomically};
use std::fs;
use std::path::Path;

/// The largest image that is read, in pixels: 16384 x 16384, 3 GiB once decoded.
pub const MAX_PIXELS: usize = 1 << 28;

/// Reads a linear RGB image: OpenEXR (`.exr`) or Radiance (`.hdr`), told apart by extension.
///
/// EXR: the first layer that has channels R, G and B, as half, float or 32-bit integers; further channels such as
/// alpha are ignored, of several resolutions the largest is taken, and the image is the data window (the
/// display window is ignored). Radiance: RGBE, run-length coded (new or old) or flat, any orientation; values are
/// divided by the `EXPOSURE` and `COLORCORR` of the header, which gives radiance as the format defines it.
/// Both are taken as Rec. 709 primaries, whatever the header says. Negative values are accepted.
///
/// # Errors
/// A missing file, another extension, no pixels, more than [`MAX_PIXELS`], damaged content, an EXR without R, G and
/// B, and a NaN or infinite value: each with one message that names the file.
pub fn read(path: &Path) -> Result<Image, ImageError> {
    decoder(path)?;
    let bytes =
        fs::read(path).map_err(|source| ImageError::Io { path: path.into(), action: "read", source })?;
    decode(path, &bytes)
}

/// Decodes the content of an image file; `path` gives its format and its name in messages.
///
/// # Errors
/// As [`read`], but for a missing file.
pub fn decode(path: &Path, bytes: &[u8]) -> Result<Image, ImageError> {
    let image = decoder(path)?(path, bytes)?;
    check_finite(path, &image)?;
    Ok(image)
}

/// Decodes the bytes of one format; the path is for messages.
type Decoder = fn(&Path, &[u8]) -> Result<Image, ImageError>;

fn decoder(path: &Path) -> Result<Decoder, ImageError> {
    match extension(path).as_deref() {
        Some("exr") => Ok(exr::decode),
        Some("hdr") => Ok(hdr::decode),
        found => Err(unknown_extension(path, "read", found, ".exr and .hdr")),
    }
}

/// Writes an image with notes (pairs of key and text, such as material parameters) by extension.
///
/// `.exr` keeps the values exactly (float, ZIP; notes become string attributes of the layer). `.png` is for looking
/// at: 8 bits, sRGB transfer function, clipped to 0..1 (notes become text chunks). The file appears whole or not at
/// all, see [`write_atomically`].
///
/// # Errors
/// Another extension (refused before anything is written), an image without pixels or with NaN or infinite values,
/// a note that the format cannot hold, and what the operating system refuses; the message names the file.
pub fn write(path: &Path, image: &Image, notes: &[(String, String)]) -> Result<(), ImageError> {
    let bytes = encode(path, image, notes)?;
    write_atomically(path, |out| out.write_all(&bytes)).map_err(|source| ImageError::Io {
        path: path.into(),
        action: "write",
        source,
    })
}

/// The content of the file that [`write()`] would write; `path` gives its format and its name in messages.
///
/// # Errors
/// As [`write()`], but for what the operating system refuses.
pub fn encode(path: &Path, image: &Image, notes: &[(String, String)]) -> Result<Vec<u8>, ImageError> {
    let encode = match extension(path).as_deref() {
        Some("exr") => exr::encode,
        Some("png") => png::encode,
        found => return Err(unknown_extension(path, "write", found, ".exr and .png")),
    };
    check_dimensions(path, image.width(), image.height(), usize::MAX)?;
    check_finite(path, image)?;
    encode(path, image, notes)
}

/// The extension in lower case.
fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_string_lossy().to_lowercase())
}

fn unknown_extension(
    path: &Path,
    action: &'static str,
    found: Option<&str>,
    accepted: &'static str,
) -> ImageError {
    let found = match found {
        Some(extension) => format!("files ending in .{extension} are not supported"),
        None => "the name has no extension".into(),
    };
    ImageError::Extension { path: path.into(), action, found, accepted }
}

fn undecodable(path: &Path, reason: impl ToString) -> ImageError {
    ImageError::Undecodable { path: path.into(), reason: reason.to_string() }
}

/// Judges the size that a header claims before memory is set aside for it. `plausible` is the largest number of
/// pixels that the bytes of the file can hold.
fn check_dimensions(path: &Path, width: usize, height: usize, plausible: usize) -> Result<(), ImageError> {
    let pixels = width.saturating_mul(height);
    let reason = if pixels == 0 {
        "at least 1 x 1 is needed".into()
    } else if pixels > MAX_PIXELS {
        format!("at most {MAX_PIXELS} pixels are accepted")
    } else if pixels > plausible {
        "the file is too short for that, so it is truncated or damaged".into()
    } else {
        return Ok(());
    };
    Err(ImageError::Dimensions { path: path.into(), width, height, reason })
}

fn check_finite(path: &Path, image: &Image) -> Result<(), ImageError> {
    for (index, pixel) in image.pixels().iter().enumerate() {
        for (channel, value) in ['R', 'G', 'B'].into_iter().zip(*pixel) {
            if !value.is_finite() {
                let (x, y) = (index % image.width(), index / image.width());
                return Err(ImageError::NotFinite { path: path.into(), x, y, channel, value });
            }
        }
    }
    Ok(())
}
