//! Principal components of pictures.

use lookmatch_imaging::inner_product;
use nalgebra::{DMatrix, SymmetricEigen};

/// Pictures that the components are made from, at most; more are told by what they add.
const SAMPLES: usize = 96;
/// Most components.
const MOST: usize = 96;

/// A mean picture and orthonormal directions from it (Jolliffe 2002): pictures are sums of a few of them.
pub(crate) struct Components {
    mean: Vec<f32>,
    directions: Vec<Vec<f32>>,
}

/// A picture beside the components.
#[derive(Clone, Debug, Default)]
pub(crate) struct Loadings {
    /// One number for each component that there was.
    pub(crate) values: Vec<f64>,
    /// Squared length of what none of them holds.
    pub(crate) rest: f64,
}

impl Components {
    /// As many components as leave no more than `tolerance` of the samples' lengths, as root mean square.
    pub(crate) fn of(samples: &[&[f32]], tolerance: f64) -> Self {
        let stride = samples.len().div_ceil(SAMPLES);
        let samples: Vec<&[f32]> = samples.iter().step_by(stride.max(1)).copied().collect();
        let mean = mean(&samples);
        let centred: Vec<Vec<f32>> = samples.iter().map(|sample| less(sample, &mean)).collect();
        let count = centred.len();
        let gram = DMatrix::from_fn(count, count, |i, k| inner_product(&centred[i], &centred[k]));
        let eigen = SymmetricEigen::new(gram);
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let total: f64 = eigen.eigenvalues.iter().map(|v| v.max(0.0)).sum();
        let mut rest = total;
        let mut directions = Vec::new();
        for k in order {
            let value = eigen.eigenvalues[k];
            // Below a share of 1e-12 there is nothing but rounding.
            if rest <= tolerance * tolerance * count as f64
                || value <= 1e-12 * total
                || directions.len() == MOST
            {
                break;
            }
            let scale = value.sqrt();
            let mut direction = vec![0.0f32; mean.len()];
            for (i, sample) in centred.iter().enumerate() {
                add(&mut direction, sample, (eigen.eigenvectors[(i, k)] / scale) as f32);
            }
            directions.push(direction);
            rest -= value;
        }
        Self { mean, directions }
    }

    /// The strongest of them alone.
    pub(crate) fn first(mut self, count: usize) -> Self {
        self.directions.truncate(count);
        self
    }

    /// The picture with some loadings of the first components.
    pub(crate) fn picture(&self, loadings: &[f64]) -> Vec<f32> {
        let mut picture = self.mean.clone();
        let parts = self.directions.iter().zip(loadings);
        parts.for_each(|(direction, value)| add(&mut picture, direction, *value as f32));
        picture
    }

    /// Number of components.
    pub(crate) fn len(&self) -> usize {
        self.directions.len()
    }

    /// A picture as a sum of components.
    pub(crate) fn loadings(&self, picture: &[f32]) -> Loadings {
        self.parted(picture).0
    }

    /// The loadings of a picture, and what is left of it.
    fn parted(&self, picture: &[f32]) -> (Loadings, Vec<f32>) {
        let mut rest = less(picture, &self.mean);
        let values: Vec<f64> = self.directions.iter().map(|d| inner_product(d, &rest)).collect();
        let parts = self.directions.iter().zip(&values);
        parts.for_each(|(direction, value)| add(&mut rest, direction, -value as f32));
        // A difference of squares would be lost in rounding where little is left.
        (Loadings { rest: inner_product(&rest, &rest), values }, rest)
    }

    /// [`Components::loadings`] of a picture of which no more than `tolerance` may be left: what is left beyond becomes a
    /// component of its own.
    pub(crate) fn extended(&mut self, picture: &[f32], tolerance: f64) -> Loadings {
        let (mut loadings, mut rest) = self.parted(picture);
        if loadings.rest <= tolerance * tolerance || self.directions.len() == MOST {
            return loadings;
        }
        let length = loadings.rest.sqrt();
        rest.iter_mut().for_each(|v| *v /= length as f32);
        self.directions.push(rest);
        loadings.values.push(length);
        loadings.rest = 0.0;
        loadings
    }
}

fn mean(samples: &[&[f32]]) -> Vec<f32> {
    let mut mean = vec![0.0; samples.first().map_or(0, |sample| sample.len())];
    samples.iter().for_each(|sample| add(&mut mean, sample, 1.0 / samples.len() as f32));
    mean
}

fn less(a: &[f32], b: &[f32]) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// `sum += share · picture`.
fn add(sum: &mut [f32], picture: &[f32], share: f32) {
    sum.iter_mut().zip(picture).for_each(|(sum, v)| *sum += share * v);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(k: usize) -> Vec<f32> {
        let (a, b) = ((k as f32 * 0.618).fract(), (k as f32 * 0.414).fract());
        (0..600).map(|i| 50.0 * a * (-(i as f32 / 600.0 - b).powi(2) / 0.1).exp()).collect()
    }

    #[test]
    fn sums_of_components_are_as_close_as_was_asked_for() {
        let samples: Vec<Vec<f32>> = (0..40).map(picture).collect();
        let slices: Vec<&[f32]> = samples.iter().map(Vec::as_slice).collect();
        let mut last = usize::MAX;
        for tolerance in [0.01, 1.0, 30.0] {
            let components = Components::of(&slices, tolerance);
            let rest: f64 = slices.iter().map(|s| components.loadings(s).rest).sum();
            assert!((rest / 40.0).sqrt() <= tolerance * 1.01, "{rest}");
            assert!(components.len() < last);
            last = components.len();
        }
    }

    #[test]
    fn what_components_do_not_hold_becomes_one() {
        let samples: Vec<Vec<f32>> = (0..10).map(picture).collect();
        let slices: Vec<&[f32]> = samples.iter().map(Vec::as_slice).collect();
        let mut components = Components::of(&slices, 0.1);
        let odd: Vec<f32> = (0..600).map(|i| (i % 7) as f32).collect();
        let (before, count) = (components.loadings(&odd), components.len());
        let loadings = components.extended(&odd, 0.1);
        assert_eq!((loadings.values.len(), components.len()), (count + 1, count + 1));
        assert!((loadings.values[count].powi(2) - before.rest).abs() < 1e-3 * before.rest);
        assert!(components.loadings(&odd).rest < 1e-4 * before.rest);
    }
}
