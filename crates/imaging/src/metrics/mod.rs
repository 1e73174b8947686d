//! Numbers for how far apart two renderings look. Exact, in `f64`; one metric a file.

pub mod fitness;
pub mod jod;
pub mod mask;
pub mod nrmsd;

use crate::{Image, ImageError};
use mask::Mask;

/// Pixels of an image in `f64`.
fn exact_pixels(image: &Image) -> Vec<[f64; 3]> {
    image.pixels().iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// Weights of a mask in `f64`, after checking that it covers the image.
fn exact_weights(mask: Option<&Mask>, image: &Image) -> Result<Option<Vec<f64>>, ImageError> {
    let Some(mask) = mask else { return Ok(None) };
    image.check_size(mask.width(), mask.height()).map_err(|error| error.in_image("image and mask"))?;
    Ok(Some(mask.weights().iter().copied().map(f64::from).collect()))
}

/// Checks that two lists can be walked together and are not empty.
fn check_counts(count: usize, other_count: usize) -> Result<(), ImageError> {
    if count == other_count && count > 0 {
        Ok(())
    } else {
        Err(ImageError::CountMismatch { count, other_count })
    }
}
