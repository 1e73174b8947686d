//! Structural similarity (SSIM): luminance, contrast and structure of Gaussian windows.
//!
//! Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From Error Visibility to Structural Similarity", IEEE Transactions on
//! Image Processing 13(4), 2004, equation 13, with the paper's values: windows of 11 × 11 pixels, σ = 1.5, K1 = 0.01, K2 = 0.03, grey
//! values 0 to 255; only windows that lie within the picture count.

use super::filter::separable;
use super::luma::{WHITE, luma};
use super::{Plane, check_pair};
use crate::{Image, ImageError};

/// How SSIM sees pictures, in words for tables.
pub const VIEWING: &str =
    super::luma::viewing!("windows of 11 x 11 pixels at whatever distance makes them visible");

/// Pixels a side of a window.
const WINDOW: usize = 11;
/// Standard deviation of its weights, in pixels.
const SIGMA: f64 = 1.5;
/// (K1 L)²: keeps dark windows from deciding.
const C1: f64 = (0.01 * WHITE) * (0.01 * WHITE);
/// (K2 L)²: the same for flat ones.
const C2: f64 = (0.03 * WHITE) * (0.03 * WHITE);

/// SSIM of the window around every pixel of two linear images: 1 where they are equal, -1 at worst.
///
/// # Errors
/// Different sizes, less than 11 pixels a side, pixels that are not finite.
pub fn ssim_map(source: &Image, target: &Image) -> Result<Plane, ImageError> {
    check_pair(source, target, ("SSIM", WINDOW))?;
    let (x, y) = (luma(source), luma(target));
    let window = window();
    let mean = |values: &[f64]| separable(values, source.width(), &window, &window);
    let products = |a: &[f64], b: &[f64]| mean(&a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<_>>());
    let (mean_x, mean_y) = (mean(&x), mean(&y));
    let (xx, yy, xy) = (products(&x, &x), products(&y, &y), products(&x, &y));
    let values = (0..mean_x.len()).map(|i| {
        let (mx, my) = (mean_x[i], mean_y[i]);
        let (vx, vy, covariance) = (xx[i] - mx * mx, yy[i] - my * my, xy[i] - mx * my);
        ((2.0 * mx * my + C1) * (2.0 * covariance + C2)) / ((mx * mx + my * my + C1) * (vx + vy + C2))
    });
    Ok(Plane::new(source.width() + 1 - WINDOW, WINDOW / 2, values.collect()))
}

/// A Gaussian whose weights sum to 1.
fn window() -> [f64; WINDOW] {
    let weights: [f64; WINDOW] = std::array::from_fn(|i| {
        let distance = i as f64 - (WINDOW / 2) as f64;
        (-distance * distance / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(a: &Image, b: &Image) -> f64 {
        ssim_map(a, b).unwrap().mean(None).unwrap()
    }

    fn waves(gain: f32, shift: f32) -> Image {
        Image::from_fn(20, 16, |x, y| [0.4 + shift + gain * 0.3 * ((x + 2 * y) as f32 * 0.7).sin(); 3])
    }

    #[test]
    fn equal_pictures_score_1_opposite_ones_below_0() {
        let a = waves(1.0, 0.0);
        assert_eq!(mean(&a, &a), 1.0);
        let scores = [0.9, 0.5, 0.1, -1.0].map(|gain| mean(&a, &waves(gain, 0.0)));
        assert!(scores.windows(2).all(|pair| pair[0] > pair[1]) && scores[0] < 1.0, "{scores:?}");
        assert!((-1.0..0.0).contains(&scores[3]), "{scores:?}");
        assert_eq!(mean(&a, &waves(0.5, 0.1)), mean(&waves(0.5, 0.1), &a));
    }

    #[test]
    fn flat_pictures_have_luminance_alone() {
        let [a, b] = [0.2_f32, 0.4].map(|v| Image::from_fn(12, 11, |_, _| [v; 3]));
        let [x, y] = [&a, &b].map(|image| luma(image)[0]);
        let expected = (2.0 * x * y + C1) / (x * x + y * y + C1);
        assert!((mean(&a, &b) - expected).abs() < 1e-9);
    }

    #[test]
    fn windows_need_room() {
        let small = Image::new(10, 40);
        assert!(ssim_map(&small, &small).unwrap_err().to_string().contains("11 x 11"));
        assert!(ssim_map(&Image::new(12, 11), &Image::new(11, 12)).is_err());
    }
}
