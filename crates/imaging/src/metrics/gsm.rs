//! Gradient similarity (GSM): how much of the strongest gradient around each pixel is kept.
//!
//! Liu, Lin and Narwaria, "Image Quality Assessment Based on Gradient Similarity", IEEE Transactions on Image Processing 21(4), 2012;
//! what Guarnera et al. 2018 weigh their equation 3 with (section 4, "GM"). With gradients a and b of the two pictures, the strongest of
//! four directions each:
//!
//! ```text
//! m = max(a, b)    R = |a - b| / m    K' = K / m
//! g = (2 (1 - R) + K') / (1 + (1 - R)² + K')      contrast and structure
//! e = 1 - ((x - y) / 255)²                        luminance, at the middle of the block
//! q = (1 - p g) g + p g e,  score = mean q        K = 200, p = 0.1
//! ```
//!
//! The article is taken as documented elsewhere, so two things are readings: a gradient is the mean of the 25 products of a block and
//! a kernel ([`MEAN`]; K makes the score depend on it), and only blocks that lie within the picture count.

use super::luma::{WHITE, luma};
use super::{Plane, check_pair};
use crate::{Image, ImageError};

/// How GSM sees pictures, in words for tables.
pub const VIEWING: &str =
    super::luma::viewing!("gradients of 5 x 5 pixels at whatever distance makes them visible");

/// Divisor of a block's sum of products that makes it the mean, as MATLAB's `mean2` has it.
pub const MEAN: f64 = 25.0;

/// Pixels a side of a block.
const BLOCK: usize = 5;
/// Gradients that are small beside it are masked.
const K: f64 = 200.0;
/// Weight of the luminance.
const P: f64 = 0.1;

/// Horizontal edges, and edges along one diagonal (Chou and Li 1995); turned by 90° they are the other two.
const KERNELS: [[[f64; BLOCK]; BLOCK]; 2] = [
    [[0., 0., 0., 0., 0.], [1., 3., 8., 3., 1.], [0.; 5], [-1., -3., -8., -3., -1.], [0.; 5]],
    [
        [0., 0., 1., 0., 0.],
        [0., 8., 3., 0., 0.],
        [1., 3., 0., -3., -1.],
        [0., 0., -3., -8., 0.],
        [0., 0., -1., 0., 0.],
    ],
];

/// Gradient similarity of the block around every pixel of two linear images: 1 where they are equal, more than 0 elsewhere.
///
/// # Errors
/// Different sizes, less than 5 pixels a side, pixels that are not finite.
pub fn gsm_map(source: &Image, target: &Image) -> Result<Plane, ImageError> {
    check_pair(source, target, ("GSM", BLOCK))?;
    Ok(map(&luma(source), &luma(target), source.width(), MEAN))
}

/// Gradient similarity of two pictures of grey values 0 to 255, 0 to 1 (equal). A block's sum of products is divided by `divisor`:
/// [`MEAN`] for [`gsm_map`]'s reading.
///
/// # Errors
/// Lists of different length, or that are no rows of `width` values; less than 5 pixels a side.
pub fn gsm_of_greys(source: &[f64], target: &[f64], width: usize, divisor: f64) -> Result<f64, ImageError> {
    super::check_counts(source.len(), target.len())?;
    let height = source.len().checked_div(width).unwrap_or(0);
    if width * height != source.len() {
        return Err(ImageError::PixelCount { width, height, found: source.len() });
    }
    if width.min(height) < BLOCK {
        return Err(ImageError::TooSmall { metric: "GSM", least: BLOCK, width, height });
    }
    map(source, target, width, divisor).mean(None)
}

fn map(source: &[f64], target: &[f64], width: usize, divisor: f64) -> Plane {
    let (columns, margin) = (width + 1 - BLOCK, BLOCK / 2);
    let [a, b] = [source, target].map(|greys| gradients(greys, width, divisor));
    let values = a.iter().zip(&b).enumerate().map(|(i, (a, b))| {
        let middle = (i / columns + margin) * width + i % columns + margin;
        similarity(*a, *b, (source[middle] - target[middle]) / WHITE)
    });
    Plane::new(columns, margin, values.collect())
}

/// q of two gradients and a difference of grey values, as a share of white.
fn similarity(a: f64, b: f64, difference: f64) -> f64 {
    let strongest = a.max(b);
    // Where both are flat there is no structure to lose.
    let structure = if strongest > 0.0 {
        let (kept, masking) = (1.0 - (a - b).abs() / strongest, K / strongest);
        (2.0 * kept + masking) / (1.0 + kept * kept + masking)
    } else {
        1.0
    };
    let luminance = 1.0 - difference * difference;
    (1.0 - P * structure) * structure + P * structure * luminance
}

/// The strongest of the four directions around every pixel.
fn gradients(greys: &[f64], width: usize, divisor: f64) -> Vec<f64> {
    let (columns, rows) = (width + 1 - BLOCK, greys.len() / width + 1 - BLOCK);
    let mut strongest = vec![0.0_f64; columns * rows];
    let mut sums = vec![0.0; columns];
    for kernel in KERNELS.into_iter().flat_map(|kernel| [kernel, turned(kernel)]) {
        for (y, strongest) in strongest.chunks_exact_mut(columns).enumerate() {
            sums.fill(0.0);
            for (dy, dx) in (0..BLOCK * BLOCK).map(|k| (k / BLOCK, k % BLOCK)) {
                let weight = kernel[dy][dx];
                if weight != 0.0 {
                    let row = &greys[(y + dy) * width + dx..][..columns];
                    sums.iter_mut().zip(row).for_each(|(sum, grey)| *sum += weight * grey);
                }
            }
            strongest.iter_mut().zip(&sums).for_each(|(most, sum)| *most = most.max(sum.abs() / divisor));
        }
    }
    strongest
}

/// A kernel turned by 90°.
fn turned(kernel: [[f64; BLOCK]; BLOCK]) -> [[f64; BLOCK]; BLOCK] {
    std::array::from_fn(|y| std::array::from_fn(|x| kernel[x][BLOCK - 1 - y]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(a: &Image, b: &Image) -> f64 {
        gsm_map(a, b).unwrap().mean(None).unwrap()
    }

    fn stripes(gain: f32, turned: bool) -> Image {
        Image::from_fn(24, 24, |x, y| {
            [gain * if (if turned { y } else { x }) % 6 < 3 { 0.2 } else { 0.6 }; 3]
        })
    }

    #[test]
    fn equal_pictures_score_1_and_worse_ones_less() {
        let a = stripes(1.0, false);
        assert_eq!(mean(&a, &a), 1.0);
        let scores = [1.05, 1.2, 1.5].map(|gain| mean(&a, &stripes(gain, false)));
        assert!(
            1.0 > scores[0] && scores[0] > scores[1] && scores[1] > scores[2] && scores[2] > 0.0,
            "{scores:?}"
        );
        assert_eq!(mean(&a, &stripes(1.5, false)), mean(&stripes(1.5, false), &a));
    }

    #[test]
    fn turning_both_pictures_changes_nothing() {
        let upright = mean(&stripes(1.0, false), &stripes(1.3, false));
        let turned = mean(&stripes(1.0, true), &stripes(1.3, true));
        assert!((upright - turned).abs() < 1e-12);
    }

    #[test]
    fn flat_pictures_differ_by_their_luminance_alone() {
        let [black, white] = [0.0, 1.0].map(|v| Image::from_fn(6, 6, |_, _| [v; 3]));
        assert!((mean(&black, &white) - (1.0 - P)).abs() < 1e-9);
    }

    #[test]
    fn blocks_need_room() {
        let small = Image::new(4, 9);
        let error = gsm_map(&small, &small).unwrap_err().to_string();
        assert!(error.contains("GSM") && error.contains("5 x 5") && error.contains("4 x 9"), "{error}");
        assert!(gsm_of_greys(&[0.0; 30], &[0.0; 30], 7, MEAN).is_err());
        assert!(gsm_of_greys(&[0.0; 25], &[0.0; 30], 5, MEAN).is_err());
        assert!(gsm_of_greys(&[], &[], 0, MEAN).is_err());
    }
}
