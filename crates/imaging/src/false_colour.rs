//! Pictures of differences, for people.

use crate::{Image, ImageError, srgb_decode};

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
    a.check_same_size(b)?;
    let distance =
        |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>().sqrt();
    let distances: Vec<f64> = a.pixels().iter().zip(b.pixels()).map(distance).collect();
    let scale = match scale {
        Some(value) if !(value.is_finite() && value > 0.0) => {
            return Err(ImageError::Scale { value });
        }
        Some(value) => value,
        None => match distances.iter().copied().fold(0.0, f64::max) as f32 {
            // Nothing to see, and nothing to divide by.
            0.0 => 1.0,
            largest => largest,
        },
    };
    let mut image = Image::new(a.width(), a.height());
    for (pixel, distance) in image.pixels_mut().iter_mut().zip(distances) {
        *pixel = colour((distance / f64::from(scale)).min(1.0));
    }
    Ok((image, scale))
}

/// Linear RGB of the colour map at 0 to 1.
fn colour(position: f64) -> [f32; 3] {
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
}
