//! Normalised root-mean-square deviation per colour channel.

use super::{check_counts, exact_pixels, exact_weights};
use crate::{Image, ImageError, Mask};

/// NRMSD of the channels R, G and B: `sqrt(mean((source - target)²)) / (max(source) - min(source))`.
///
/// The range is that of the source channel over the whole image, background included. With a mask each difference is
/// multiplied by its weight before squaring; the mean still divides by the number of all pixels, and the range does
/// not change. 0 = equal; good remappings of the
/// paper have 0.004 to 0.055 (Guarnera et al. 2018, tables 2 and 4).
///
/// # Errors
/// Different sizes; a source channel without range ([`ImageError::NoRange`]) unless the target equals it.
pub fn nrmsd(source: &Image, target: &Image, mask: Option<&Mask>) -> Result<[f64; 3], ImageError> {
    source.check_same_size(target).map_err(|error| error.in_image("source and target"))?;
    let weights = exact_weights(mask, source)?;
    nrmsd_pixels(&exact_pixels(source), &exact_pixels(target), weights.as_deref())
}

/// [`nrmsd`] of a picture and the same with noise added: what is left between pictures of equal materials.
///
/// # Errors
/// As [`nrmsd`].
pub fn nrmsd_of_noise(picture: &Image, noise: &Image, mask: Option<&Mask>) -> Result<[f64; 3], ImageError> {
    picture.check_same_size(noise).map_err(|error| error.in_image("picture and noise"))?;
    nrmsd(picture, &picture.zipped(noise, |value, noise| value + noise), mask)
}

/// [`nrmsd`] of pixels held in `f64`, with one weight per pixel or none.
///
/// # Errors
/// Lists of different length or without pixels; otherwise as [`nrmsd`].
pub fn nrmsd_pixels(
    source: &[[f64; 3]],
    target: &[[f64; 3]],
    weights: Option<&[f64]>,
) -> Result<[f64; 3], ImageError> {
    check_counts(source.len(), target.len())?;
    check_counts(source.len(), weights.map_or(source.len(), <[f64]>::len))?;
    let mut result = [0.0; 3];
    for (c, value) in result.iter_mut().enumerate() {
        let sum: f64 = (0..source.len())
            .map(|i| (weights.map_or(1.0, |w| w[i]) * (source[i][c] - target[i][c])).powi(2))
            .sum();
        *value = normalised(sum / source.len() as f64, source.iter().map(|pixel| pixel[c]), c)?;
    }
    Ok(result)
}

/// Root of the mean square over the range of the source values.
fn normalised(
    mean_square: f64,
    source: impl Iterator<Item = f64>,
    channel: usize,
) -> Result<f64, ImageError> {
    let (low, high) = source
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    match (mean_square, high - low) {
        (0.0, _) => Ok(0.0),
        (_, 0.0) => Err(ImageError::NoRange { channel: ['R', 'G', 'B'][channel], value: low }),
        (_, range) => Ok(mean_square.sqrt() / range),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_range_only_equal_images_have_a_value() {
        let flat = Image::from_fn(2, 2, |_, _| [0.5, 0.5, 0.5]);
        assert_eq!(nrmsd(&flat, &flat, None).unwrap(), [0.0; 3]);
        let error = nrmsd(&flat, &Image::new(2, 2), None).unwrap_err().to_string();
        assert!(error.contains("channel R") && error.contains("0.5"), "{error}");
        // The other way round there is a range nowhere either.
        assert!(nrmsd(&Image::new(2, 2), &flat, None).is_err());
    }

    #[test]
    fn a_mask_scales_differences_but_neither_count_nor_range() {
        let source = Image::from_fn(4, 1, |x, _| [x as f32; 3]);
        let target = Image::from_fn(4, 1, |x, _| [x as f32 + 0.3; 3]);
        let plain = nrmsd(&source, &target, None).unwrap();
        let uniform = nrmsd(&source, &target, Some(&Mask::uniform(4, 1))).unwrap();
        assert_eq!(plain, uniform);
        assert!((plain[0] - 0.1).abs() < 1e-6);
        // A disc so large that all but its middle weighs about 1 - sqrt(1.5 / r).
        let disc = Mask::disc(4, 1, 0.5, 0.5, 0.6);
        let masked = nrmsd(&source, &target, Some(&disc)).unwrap();
        assert!((masked[0] - 0.05).abs() < 1e-6, "one pixel of four counts: {masked:?}");
    }

    #[test]
    fn sizes_are_checked() {
        let image = Image::from_fn(4, 1, |x, _| [x as f32; 3]);
        assert!(nrmsd(&image, &Image::new(1, 4), None).is_err());
        let error = nrmsd(&image, &image, Some(&Mask::uniform(1, 4))).unwrap_err();
        assert!(error.to_string().contains("mask"), "{error}");
    }
}
