//! Interpolation between points that lie anywhere: radial functions.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Stretches of an axis that are tried.
const STRETCHES: [f64; 5] = [0.4, 0.65, 1.0, 1.6, 2.5];
/// Smoothing that is tried, for values with noise.
const SMOOTHING: [f64; 4] = [0.0, 1e-4, 1e-3, 1e-2];
/// Points beyond which stretches stay as they are.
const TUNED: usize = 100;

/// A smooth function of several variables through given values: a sum of cubed distances and a linear part (Wahba 1990; M. D.
/// Buhmann, "Radial Basis Functions", 2003). Along one axis it is the natural cubic spline.
pub(crate) struct Interpolation {
    /// What each axis is multiplied with.
    metric: Metric,
    centres: Vec<Vec<f64>>,
    /// A row of weights for each centre, then for 1 and for each axis.
    weights: Vec<Vec<f64>>,
}

/// How distances are measured, and how much noise is smoothed away.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Metric {
    stretch: Vec<f64>,
    smoothing: f64,
}

impl Metric {
    /// All axes alike.
    pub(crate) fn plain(axes: usize) -> Self {
        Self { stretch: vec![1.0; axes], smoothing: 0.0 }
    }

    fn stretched(&self, point: &[f64]) -> Vec<f64> {
        point.iter().zip(&self.stretch).map(|(v, s)| v * s).collect()
    }

    /// The metric with which each value is told best by all others (S. Rippa, "An algorithm for selecting a good value for the
    /// parameter c in radial basis function interpolation", 1999), axis by axis. Many points keep the metric that they have.
    pub(crate) fn tuned(self, points: &[Vec<f64>], values: &[Vec<f64>]) -> Self {
        if points.len() > TUNED {
            return self;
        }
        let mut best = (left_out(&self, points, values), self);
        let attempt = |metric: Metric, best: &mut (f64, Metric)| {
            let error = left_out(&metric, points, values);
            if error < 0.98 * best.0 {
                *best = (error, metric);
            }
        };
        for axis in (0..best.1.stretch.len()).chain(0..best.1.stretch.len()) {
            for stretch in STRETCHES {
                let mut metric = best.1.clone();
                metric.stretch[axis] = stretch;
                attempt(metric, &mut best);
            }
        }
        for smoothing in SMOOTHING {
            attempt(Metric { smoothing, ..best.1.clone() }, &mut best);
        }
        best.1
    }
}

impl Interpolation {
    /// Through `values` (a row for each point); `None` where the points do not tell a linear function.
    pub(crate) fn fit(metric: Metric, points: &[Vec<f64>], values: &[Vec<f64>]) -> Option<Self> {
        let centres: Vec<Vec<f64>> = points.iter().map(|point| metric.stretched(point)).collect();
        let system = system(&centres, metric.smoothing)?;
        let width = values.first()?.len();
        let right = DMatrix::from_fn(system.nrows(), width, |i, k| values.get(i).map_or(0.0, |row| row[k]));
        let solved = system.lu().solve(&right)?;
        let weights: Vec<Vec<f64>> = solved.row_iter().map(|row| row.iter().copied().collect()).collect();
        weights.iter().flatten().all(|w| w.is_finite()).then_some(Self { metric, centres, weights })
    }

    /// Its values at a point.
    pub(crate) fn at(&self, point: &[f64]) -> Vec<f64> {
        let point = self.metric.stretched(point);
        let (radial, linear) = self.weights.split_at(self.centres.len());
        let mut sum = linear[0].clone();
        let mut add = |factor: f64, row: &[f64]| {
            sum.iter_mut().zip(row).for_each(|(sum, w)| *sum += factor * w);
        };
        linear[1..].iter().zip(&point).for_each(|(row, v)| add(*v, row));
        self.centres.iter().zip(radial).for_each(|(centre, row)| add(kernel(centre, &point), row));
        sum
    }

    /// Its values at many points, on all cores.
    pub(crate) fn at_all(&self, points: &[Vec<f64>]) -> Vec<Vec<f64>> {
        points.par_iter().map(|point| self.at(point)).collect()
    }
}

/// The cubed distance.
fn kernel(a: &[f64], b: &[f64]) -> f64 {
    let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    square * square.sqrt()
}

/// The equations of the weights; `None` with too few points.
fn system(centres: &[Vec<f64>], smoothing: f64) -> Option<DMatrix<f64>> {
    let count = centres.len();
    let axes = centres.first()?.len();
    (count > axes).then(|| {
        DMatrix::from_fn(count + axes + 1, count + axes + 1, |i, k| {
            match (i.checked_sub(count), k.checked_sub(count)) {
                (None, None) if i == k => smoothing,
                (None, None) => kernel(&centres[i], &centres[k]),
                (Some(0), None) | (None, Some(0)) => 1.0,
                (Some(axis), None) => centres[k][axis - 1],
                (None, Some(axis)) => centres[i][axis - 1],
                (Some(_), Some(_)) => 0.0,
            }
        })
    })
}

/// Sum of squared errors where each value is left out in turn.
fn left_out(metric: &Metric, points: &[Vec<f64>], values: &[Vec<f64>]) -> f64 {
    let centres: Vec<Vec<f64>> = points.iter().map(|point| metric.stretched(point)).collect();
    let Some(inverse) = system(&centres, metric.smoothing).and_then(DMatrix::try_inverse) else {
        return f64::INFINITY;
    };
    let count = points.len();
    let width = values.first().map_or(0, Vec::len);
    let inner = inverse.view((0, 0), (count, count));
    let of_column = |k: usize| {
        let column = DVector::from_fn(count, |i, _| values[i][k]);
        let weights = inner * column;
        (0..count).map(|i| (weights[i] / inner[(i, i)]).powi(2)).sum::<f64>()
    };
    (0..width).map(of_column).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(count: usize) -> Vec<Vec<f64>> {
        (0..count).map(|k| vec![(k as f64 * 0.754_878).fract(), (k as f64 * 0.569_840).fract()]).collect()
    }

    #[test]
    fn values_are_met_and_lines_are_straight() {
        let points = points(20);
        let values: Vec<Vec<f64>> =
            points.iter().map(|p| vec![(4.0 * p[0]).sin() * p[1], 1.0 + 2.0 * p[0] - p[1]]).collect();
        let metric = Metric::plain(2).tuned(&points, &values);
        let function = Interpolation::fit(metric, &points, &values).expect("a function");
        for (point, value) in points.iter().zip(&values) {
            function.at(point).iter().zip(value).for_each(|(a, b)| assert!((a - b).abs() < 1e-6, "{a} {b}"));
        }
        let (between, outside) = (function.at(&[0.4, 0.6]), function.at(&[1.5, -0.5]));
        assert!((between[0] - 1.6f64.sin() * 0.6).abs() < 0.03, "{between:?}");
        assert!((outside[1] - 4.5).abs() < 1e-6, "{outside:?}");
    }

    #[test]
    fn an_axis_that_matters_more_is_stretched() {
        let points = points(40);
        let values: Vec<Vec<f64>> = points.iter().map(|p| vec![(9.0 * p[0]).sin() + 0.1 * p[1]]).collect();
        let metric = Metric::plain(2).tuned(&points, &values);
        assert!(metric.stretch[0] > metric.stretch[1], "{metric:?}");
        assert!(left_out(&metric, &points, &values) < left_out(&Metric::plain(2), &points, &values));
    }

    #[test]
    fn too_few_points_make_no_function() {
        assert!(Interpolation::fit(Metric::plain(2), &points(2), &[vec![1.0], vec![2.0]]).is_none());
        let same = vec![vec![0.5, 0.5]; 5];
        assert!(Interpolation::fit(Metric::plain(2), &same, &vec![vec![1.0]; 5]).is_none());
    }
}
