//! Numbers for how far apart two renderings look. Exact, in `f64`; one metric a file.

pub mod delta_e;
pub mod distance_correlation;
mod filter;
pub mod fitness;
pub mod flip;
pub mod gsm;
pub mod jod;
pub mod luma;
pub mod mask;
pub mod nrmsd;
mod plane;
pub mod registry;
pub mod ssim;
pub mod verdict;

use crate::{Image, ImageError};
use mask::Mask;
pub use plane::Plane;

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

/// Checks that a metric, which needs some pixels a side, can judge two pictures.
fn check_pair(source: &Image, target: &Image, needs: (&'static str, usize)) -> Result<(), ImageError> {
    source.check_same_size(target).map_err(|error| error.in_image("source and target"))?;
    let (metric, least) = needs;
    let (width, height) = (source.width(), source.height());
    if width.min(height) < least {
        return Err(ImageError::TooSmall { metric, least, width, height });
    }
    check_finite(source).map_err(|error| error.in_image("source"))?;
    check_finite(target).map_err(|error| error.in_image("target"))
}

fn check_finite(image: &Image) -> Result<(), ImageError> {
    let Some(place) = image.pixels().as_flattened().iter().position(|value| !value.is_finite()) else {
        return Ok(());
    };
    let (pixel, c) = (place / 3, place % 3);
    Err(ImageError::Unjudgeable {
        x: pixel % image.width(),
        y: pixel / image.width(),
        channel: ['R', 'G', 'B'][c],
        value: image.pixels()[pixel][c],
    })
}
