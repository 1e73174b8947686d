//! Separable filters, for metrics that look at neighbourhoods.

use multiversion::multiversion;
use num_traits::Float;

/// Values computed together: as many sums as hide the latency of an addition.
const LANES: usize = 64;

/// A plane filtered along its rows, then along its columns, where both kernels fit: `width + 1 - horizontal.len()` columns and
/// likewise rows. Kernels are not mirrored (a correlation).
pub(super) fn separable<T: Weigh>(plane: &[T], width: usize, horizontal: &[T], vertical: &[T]) -> Vec<T> {
    let height = plane.len() / width;
    let (columns, rows) = (width + 1 - horizontal.len(), height + 1 - vertical.len());
    let mut across = vec![T::zero(); columns * height];
    for (out, row) in across.chunks_exact_mut(columns).zip(plane.chunks_exact(width)) {
        T::weigh(out, row, 1, horizontal);
    }
    let mut filtered = vec![T::zero(); columns * rows];
    for (y, out) in filtered.chunks_exact_mut(columns).enumerate() {
        T::weigh(out, &across[y * columns..], columns, vertical);
    }
    filtered
}

/// A plane whose outermost values are repeated `margin` times beyond each edge.
pub(super) fn with_edges<T: Copy>(plane: &[T], width: usize, margin: usize) -> Vec<T> {
    let height = plane.len() / width;
    let inside = |place: usize, side: usize| place.saturating_sub(margin).min(side - 1);
    let rows = (0..height + 2 * margin).map(|y| &plane[inside(y, height) * width..][..width]);
    rows.flat_map(|row| (0..width + 2 * margin).map(move |x| row[inside(x, width)])).collect()
}

/// Numbers that are filtered with the best instructions of the processor; every one gives the same bits.
pub(super) trait Weigh: Float {
    /// `out[x] = Σ_k weights[k] * values[x + k * stride]`, added in this order.
    fn weigh(out: &mut [Self], values: &[Self], stride: usize, weights: &[Self]);
}

impl Weigh for f32 {
    fn weigh(out: &mut [f32], values: &[f32], stride: usize, weights: &[f32]) {
        single(out, values, stride, weights);
    }
}

impl Weigh for f64 {
    fn weigh(out: &mut [f64], values: &[f64], stride: usize, weights: &[f64]) {
        double(out, values, stride, weights);
    }
}

#[multiversion(targets = "simd")]
fn single(out: &mut [f32], values: &[f32], stride: usize, weights: &[f32]) {
    body(out, values, stride, weights);
}

#[multiversion(targets = "simd")]
fn double(out: &mut [f64], values: &[f64], stride: usize, weights: &[f64]) {
    body(out, values, stride, weights);
}

#[inline(always)]
fn body<T: Float>(out: &mut [T], values: &[T], stride: usize, weights: &[T]) {
    let Some(last) = out.len().checked_sub(LANES) else {
        for (x, out) in out.iter_mut().enumerate() {
            let terms = weights.iter().enumerate().map(|(k, weight)| *weight * values[x + k * stride]);
            *out = terms.fold(T::zero(), |sum, term| sum + term);
        }
        return;
    };
    // The last group overlaps the one before it, and finds the same sums.
    for start in (0..last).step_by(LANES).chain([last]) {
        let mut sums = [T::zero(); LANES];
        for (k, weight) in weights.iter().enumerate() {
            let values = &values[start + k * stride..][..LANES];
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum = *sum + *weight * *value;
            }
        }
        out[start..][..LANES].copy_from_slice(&sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_separable_filter_is_its_definition() {
        for width in [37, 67, 150] {
            check(width, 9);
        }
    }

    fn check(width: usize, height: usize) {
        let plane: Vec<f64> = (0..width * height).map(|i| ((i * 7919) % 101) as f64).collect();
        let (across, down) = ([1.0, -2.0, 0.5, 4.0], [0.25, 3.0, -1.0]);
        let found = separable(&plane, width, &across, &down);
        assert_eq!(found.len(), (width - 3) * (height - 2));
        let single: Vec<f32> = plane.iter().map(|v| *v as f32).collect();
        let single = separable(&single, width, &across.map(|w| w as f32), &down.map(|w| w as f32));
        for y in 0..height - 2 {
            for x in 0..width - 3 {
                let mut sum = 0.0;
                for (j, w) in down.iter().enumerate() {
                    for (i, v) in across.iter().enumerate() {
                        sum += w * v * plane[(y + j) * width + x + i];
                    }
                }
                let place = y * (width - 3) + x;
                assert!((found[place] - sum).abs() < 1e-9 && (f64::from(single[place]) - sum).abs() < 1e-2);
            }
        }
    }

    #[test]
    fn edges_are_repeated() {
        let padded = with_edges(&[1, 2, 3, 4], 2, 1);
        assert_eq!(padded, [1, 1, 2, 2, 1, 1, 2, 2, 3, 3, 4, 4, 3, 3, 4, 4]);
    }
}
