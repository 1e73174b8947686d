//! CIELAB and squared differences in `f32`, for searches that compare thousands of images.
//!
//! Speed comes from plain loops over small arrays, compiled once per instruction set and chosen at run time. The
//! order of every addition is fixed and products are never fused with sums, so each instruction set gives the
//! same bits: a search takes the same path on every machine.

use crate::colour::{LINEAR_LIMIT, LINEAR_OFFSET, LINEAR_SLOPE, XYZ_FROM_SRGB};
use multiversion::multiversion;

/// Pixels converted together: one AVX-512 register, or a few of the narrower ones.
const PIXELS: usize = 16;
/// Independent partial sums, enough to hide the latency of an addition.
const LANES: usize = 32;
/// Values summed in `f32` before the sum moves to `f64`: 32 additions a lane, so rounding stays near 1e-6.
const BLOCK: usize = 32 * LANES;

/// XYZ_FROM_SRGB with every row divided by its sum (the white point).
const WHITE_RELATIVE: [[f32; 3]; 3] = {
    let mut rows = [[0.0; 3]; 3];
    let mut i = 0;
    while i < 3 {
        let [r, g, b] = XYZ_FROM_SRGB[i];
        let sum = r + g + b;
        rows[i] = [(r / sum) as f32, (g / sum) as f32, (b / sum) as f32];
        i += 1;
    }
    rows
};

/// Converts linear RGB pixels to CIELAB in `f32`.
///
/// `out` is planar, `[L.., a.., b..]`, and `3 * pixels.len()` long. Largest difference of any component from
/// [`crate::lab_from_linear_srgb`], measured over 30 million colours with some channels between -0.1 and 0:
/// 8.4e-5 for channel values up to 1, 2.9e-4 up to 100, 1.2e-3 up to 10⁴. The result is the same to the bit on every
/// processor.
///
/// # Panics
/// If `out` has another length.
pub fn lab_planes(pixels: &[[f32; 3]], out: &mut [f32]) {
    assert_eq!(out.len(), 3 * pixels.len(), "three planes of one value per pixel are needed");
    planes_dispatched(pixels, out);
}

/// [`lab_planes`] of pixels that are given as three planes, red, green and blue.
///
/// # Panics
/// If the planes have different lengths, or `out` is not three times as long.
pub fn lab_planes_of(planes: [&[f32]; 3], out: &mut [f32]) {
    let [red, green, blue] = planes;
    assert!(red.len() == green.len() && red.len() == blue.len(), "planes of one length are needed");
    assert_eq!(out.len(), 3 * red.len(), "three planes of one value per pixel are needed");
    planar_dispatched(planes, out);
}

/// Sum of squared differences of two slices of equal length.
///
/// Added in `f32` over blocks of 1024 values and in `f64` over the blocks, in a fixed order: the result is the same
/// to the bit on every processor, and within 1e-6 (relative) of the exact sum of the `f32` differences.
///
/// # Panics
/// If the lengths differ.
pub fn squared_distance(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len(), "two images of one size are needed");
    distance_dispatched(a, b)
}

/// Sum of `(w · difference)²` over three planes that share the per-pixel weights `w`.
///
/// Planes are laid out as [`lab_planes`] leaves them. Order and accuracy as in [`squared_distance`].
///
/// # Panics
/// Unless `a` and `b` have `3 * w.len()` values each.
pub fn weighted_squared_distance(a: &[f32], b: &[f32], w: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len(), "two images of one size are needed");
    assert_eq!(a.len(), 3 * w.len(), "one weight per pixel is needed");
    if w.is_empty() {
        return 0.0;
    }
    let planes = a.chunks_exact(w.len()).zip(b.chunks_exact(w.len()));
    planes.map(|(a, b)| weighted_dispatched(a, b, w)).sum()
}

#[multiversion(targets = "simd")]
fn planes_dispatched(pixels: &[[f32; 3]], out: &mut [f32]) {
    planes(pixels, out);
}

#[multiversion(targets = "simd")]
fn planar_dispatched(planes: [&[f32]; 3], out: &mut [f32]) {
    planar(planes, out);
}

#[multiversion(targets = "simd")]
fn distance_dispatched(a: &[f32], b: &[f32]) -> f64 {
    distance(a, b)
}

#[multiversion(targets = "simd")]
fn weighted_dispatched(a: &[f32], b: &[f32], w: &[f32]) -> f64 {
    weighted_distance(a, b, w)
}

#[inline(always)]
fn planes(pixels: &[[f32; 3]], out: &mut [f32]) {
    let (lightness, rest) = out.split_at_mut(pixels.len());
    let (a_star, b_star) = rest.split_at_mut(pixels.len());
    let (blocks, tail) = pixels.as_chunks::<PIXELS>();
    let (l_blocks, l_tail) = lightness.as_chunks_mut::<PIXELS>();
    let (a_blocks, a_tail) = a_star.as_chunks_mut::<PIXELS>();
    let (b_blocks, b_tail) = b_star.as_chunks_mut::<PIXELS>();
    for (((block, l), a), b) in blocks.iter().zip(l_blocks).zip(a_blocks).zip(b_blocks) {
        [*l, *a, *b] = convert(block);
    }
    let mut padded = [[0.0; 3]; PIXELS];
    padded[..tail.len()].copy_from_slice(tail);
    let [l, a, b] = convert(&padded);
    l_tail.copy_from_slice(&l[..tail.len()]);
    a_tail.copy_from_slice(&a[..tail.len()]);
    b_tail.copy_from_slice(&b[..tail.len()]);
}

#[inline(always)]
fn planar([red, green, blue]: [&[f32]; 3], out: &mut [f32]) {
    let (lightness, rest) = out.split_at_mut(red.len());
    let (a_star, b_star) = rest.split_at_mut(red.len());
    for start in (0..red.len()).step_by(PIXELS) {
        let block = start..(start + PIXELS).min(red.len());
        let mut rgb = [[0.0; PIXELS]; 3];
        rgb[0][..block.len()].copy_from_slice(&red[block.clone()]);
        rgb[1][..block.len()].copy_from_slice(&green[block.clone()]);
        rgb[2][..block.len()].copy_from_slice(&blue[block.clone()]);
        let [l, a, b] = convert_planes(&rgb);
        lightness[block.clone()].copy_from_slice(&l[..block.len()]);
        a_star[block.clone()].copy_from_slice(&a[..block.len()]);
        b_star[block.clone()].copy_from_slice(&b[..block.len()]);
    }
}

#[inline(always)]
fn convert(block: &[[f32; 3]; PIXELS]) -> [[f32; PIXELS]; 3] {
    let mut rgb = [[0.0; PIXELS]; 3];
    for i in 0..PIXELS {
        rgb[0][i] = block[i][0];
        rgb[1][i] = block[i][1];
        rgb[2][i] = block[i][2];
    }
    convert_planes(&rgb)
}

#[inline(always)]
fn convert_planes(rgb: &[[f32; PIXELS]; 3]) -> [[f32; PIXELS]; 3] {
    let mut lab = [[0.0; PIXELS]; 3];
    for i in 0..PIXELS {
        let relative = |row: [f32; 3]| row[0] * rgb[0][i] + row[1] * rgb[1][i] + row[2] * rgb[2][i];
        let [fx, dx] = compress(relative(WHITE_RELATIVE[0]));
        let [fy, dy] = compress(relative(WHITE_RELATIVE[1]));
        let [fz, dz] = compress(relative(WHITE_RELATIVE[2]));
        lab[0][i] = 116.0 * (fy + dy) - 16.0;
        lab[1][i] = 500.0 * ((fx - fy) + (dx - dy));
        lab[2][i] = 200.0 * ((fy - fz) + (dy - dz));
    }
    lab
}

/// CIELAB's f(t) as an unevaluated sum of a value and a small correction: a* is 500 times a difference of two such
/// values, so rounding them first would cost half the accuracy.
///
/// Both branches are computed and one is selected, which keeps the loop free of jumps.
#[inline(always)]
fn compress(t: f32) -> [f32; 2] {
    let line = LINEAR_SLOPE as f32 * t + LINEAR_OFFSET as f32;
    let [root, correction] = cube_root(t);
    if t > LINEAR_LIMIT as f32 { [root, correction] } else { [line, 0.0] }
}

/// Cube root of a positive normal number as an unevaluated sum; meaningless for others.
///
/// A guess of 1/∛x from the exponent bits (dividing the bits by -3; Warren, "Hacker's Delight", 2nd ed.,
/// section 11-2, for the division by shifts), one Householder step of fourth order, and one Newton step on the root
/// itself, whose small correction takes the rounding errors of the root with it. No divisions.
#[inline(always)]
pub(crate) fn cube_root(x: f32) -> [f32; 2] {
    let bits = x.to_bits();
    let mut third = (bits >> 2) + (bits >> 4);
    third += third >> 4;
    third += third >> 8;
    let guess = f32::from_bits(0x54a2_1d2a_u32.wrapping_sub(third));
    let h = 1.0 - x * (guess * guess * guess);
    let inverse = guess + guess * (h * (1.0 / 3.0 + h * (2.0 / 9.0 + h * (14.0 / 81.0))));
    let square = inverse * inverse;
    let root = x * square;
    [root, (x - root * root * root) * (square * (1.0 / 3.0))]
}

#[inline(always)]
fn distance(a: &[f32], b: &[f32]) -> f64 {
    let mut total = 0.0;
    for (a, b) in a.chunks(BLOCK).zip(b.chunks(BLOCK)) {
        let mut sums = [0.0; LANES];
        let (a_rows, a_tail) = a.as_chunks::<LANES>();
        let (b_rows, b_tail) = b.as_chunks::<LANES>();
        for (a, b) in a_rows.iter().zip(b_rows) {
            for i in 0..LANES {
                let d = a[i] - b[i];
                sums[i] += d * d;
            }
        }
        for (sum, (a, b)) in sums.iter_mut().zip(a_tail.iter().zip(b_tail)) {
            *sum += (a - b) * (a - b);
        }
        total += sum_lanes(sums);
    }
    total
}

#[inline(always)]
fn weighted_distance(a: &[f32], b: &[f32], w: &[f32]) -> f64 {
    let mut total = 0.0;
    for ((a, b), w) in a.chunks(BLOCK).zip(b.chunks(BLOCK)).zip(w.chunks(BLOCK)) {
        let mut sums = [0.0; LANES];
        let (a_rows, a_tail) = a.as_chunks::<LANES>();
        let (b_rows, b_tail) = b.as_chunks::<LANES>();
        let (w_rows, w_tail) = w.as_chunks::<LANES>();
        for ((a, b), w) in a_rows.iter().zip(b_rows).zip(w_rows) {
            for i in 0..LANES {
                let d = w[i] * (a[i] - b[i]);
                sums[i] += d * d;
            }
        }
        for (sum, ((a, b), w)) in sums.iter_mut().zip(a_tail.iter().zip(b_tail).zip(w_tail)) {
            let d = w * (a - b);
            *sum += d * d;
        }
        total += sum_lanes(sums);
    }
    total
}

/// Adds the lanes from first to last in `f64`.
#[inline(always)]
fn sum_lanes(lanes: [f32; LANES]) -> f64 {
    lanes.iter().fold(0.0, |sum, &lane| sum + f64::from(lane))
}

#[cfg(test)]
#[path = "lab_tests.rs"]
mod tests;
