//! Pictures of differences, for people.

use crate::{Image, ImageError, Mask, srgb_decode};

/// Share of the pixels whose distances may lie beyond the scale of [`error_scale`].
const CLIPPED: f64 = 0.01;

/// The distance in linear RGB that all but a hundredth of the pixels within a mask stay below; 1 if they are equal.
///
/// A scale for [`error_map`]s of noisy pictures and of what lies before others: neither a firefly nor an edge of the background
/// decides it.
///
/// # Errors
/// Different sizes.
pub fn error_scale(a: &Image, b: &Image, within: &Mask) -> Result<f32, ImageError> {
    let distances = distances(a, b)?;
    a.check_size(within.width(), within.height())?;
    let inside = distances.into_iter().zip(within.weights()).filter(|(_, weight)| **weight > 0.0);
    let mut inside: Vec<f64> = inside.map(|(distance, _)| distance).collect();
    inside.sort_by(f64::total_cmp);
    let place = (inside.len() as f64 * (1.0 - CLIPPED)) as usize;
    Ok(inside.get(place).map_or(1.0, |distance| visible(*distance)))
}

/// Map of the per-pixel L2 distance in linear RGB, as in the paper's figures (Guarnera et al. 2018, figure 9).
///
/// 0 is black and `scale` (in the units of the pixels) bright yellow, by way of violet and orange (matplotlib's
/// "inferno", perceptually uniform); larger distances are clipped. Without a scale the largest distance is used,
/// or 1 if the images are equal. Returns the map as a linear image, and the scale; writing the map as PNG gives the
/// map's own colours.
///
/// # Errors
/// Different sizes; a scale that is not finite and positive.
pub fn error_map(a: &Image, b: &Image, scale: Option<f32>) -> Result<(Image, f32), ImageError> {
    let distances = distances(a, b)?;
    let scale = match scale {
        Some(value) if !(value.is_finite() && value > 0.0) => {
            return Err(ImageError::Scale { value });
        }
        Some(value) => value,
        None => visible(distances.iter().copied().fold(0.0, f64::max)),
    };
    let mut image = Image::new(a.width(), a.height());
    for (pixel, distance) in image.pixels_mut().iter_mut().zip(distances) {
        *pixel = colour((distance / f64::from(scale)).min(1.0));
    }
    Ok((image, scale))
}

/// Distances of pixels in linear RGB.
fn distances(a: &Image, b: &Image) -> Result<Vec<f64>, ImageError> {
    a.check_same_size(b)?;
    let distance =
        |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>().sqrt();
    Ok(a.pixels().iter().zip(b.pixels()).map(distance).collect())
}

/// A scale; where there is nothing to see, there must be nothing to divide by.
fn visible(distance: f64) -> f32 {
    if distance > 0.0 { distance as f32 } else { 1.0 }
}

/// Linear RGB of the colour map at 0 to 1.
pub(crate) fn colour(position: f64) -> [f32; 3] {
    let colour = colorous::INFERNO.eval_continuous(position);
    [colour.r, colour.g, colour.b].map(|byte| srgb_decode(f32::from(byte) / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::luminance;

    #[test]
    fn larger_differences_are_brighter_up_to_the_scale() {
        let a = Image::new(5, 1);
        let b = Image::from_fn(5, 1, |x, _| [x as f32, 0.0, 0.0]);
        let (own, scale) = error_map(&a, &b, None).unwrap();
        assert_eq!(scale, 4.0);
        let light: Vec<f32> = own.pixels().iter().map(|&pixel| luminance(pixel)).collect();
        assert!(light.windows(2).all(|pair| pair[0] < pair[1]), "{light:?}");
        let (clipped, scale) = error_map(&a, &b, Some(2.0)).unwrap();
        assert_eq!(scale, 2.0);
        assert_eq!(clipped.get(2, 0), clipped.get(4, 0));
    }

    #[test]
    fn equal_images_give_a_dark_map() {
        let a = Image::from_fn(2, 2, |x, y| [x as f32, y as f32, 1.0]);
        let (map, scale) = error_map(&a, &a, None).unwrap();
        assert_eq!(scale, 1.0);
        assert!(map.pixels().iter().all(|&pixel| luminance(pixel) < 1e-3));
    }

    #[test]
    fn senseless_scales_and_sizes_are_refused() {
        let a = Image::new(2, 2);
        for scale in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(error_map(&a, &a, Some(scale)).is_err());
        }
        assert!(error_map(&a, &Image::new(2, 3), None).is_err());
    }

    #[test]
    fn neither_one_bright_pixel_nor_the_background_decides_a_scale() {
        let black = Image::new(100, 100);
        let mask = Mask::disc(100, 100, 50.0, 50.0, 40.0);
        let other = Image::from_fn(100, 100, |x, y| match (x, y) {
            (50, 50) => [100.0, 0.0, 0.0],
            (_, 0..10) => [10.0, 0.0, 0.0],
            _ => [0.0, 0.3, 0.4],
        });
        assert_eq!(error_scale(&black, &other, &mask).unwrap(), 0.5);
        assert_eq!(error_scale(&black, &black, &mask).unwrap(), 1.0);
        assert!(error_scale(&black, &other, &Mask::uniform(99, 100)).is_err());
    }
}
