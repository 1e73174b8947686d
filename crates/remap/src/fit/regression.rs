//! Weighted least squares, local regression (LOESS), and monotone cubic interpolation.

use nalgebra::{DMatrix, DVector};

use super::form::{Shape, Term, monomial};

/// Eigenvalues of the normal equations below this share of the largest belong to directions that the data do not tell.
const RANK: f64 = 1e-12;
/// Columns whose squares add up to less than this share of the largest sum are zero but for rounding.
const EMPTY: f64 = 1e-18;
/// Distances that differ by less, in `u`, are the same.
const SAME: f64 = 1e-9;

/// Data of one target parameter: places in `u`, values and weights above 0.
#[derive(Clone, Debug, Default)]
pub(crate) struct Samples {
    pub(crate) u: Vec<Vec<f64>>,
    pub(crate) y: Vec<f64>,
    pub(crate) w: Vec<f64>,
}

impl Samples {
    pub(crate) fn len(&self) -> usize {
        self.y.len()
    }

    /// Those whose index satisfies a condition.
    pub(crate) fn subset(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut some = Self::default();
        for k in (0..self.len()).filter(|k| keep(*k)) {
            some.u.push(self.u[k].clone());
            some.y.push(self.y[k]);
            some.w.push(self.w[k]);
        }
        some
    }
}

/// The coefficients that minimise the weighted squares of `rows · c − y`; of several, the shortest.
///
/// The normal equations of normalised columns by their eigenvectors: some columns may depend on others, where samples lie on a few
/// levels (and nalgebra's own `svd` is not to be trusted).
pub(crate) fn least_squares(rows: &[Vec<f64>], y: &[f64], w: &[f64]) -> Vec<f64> {
    let n = rows.first().map_or(0, Vec::len);
    let (mut gram, mut right) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
    for ((row, y), w) in rows.iter().zip(y).zip(w) {
        for i in 0..n {
            right[i] += w * row[i] * y;
            for j in 0..=i {
                gram[(i, j)] += w * row[i] * row[j];
            }
        }
    }
    let largest = (0..n).map(|i| gram[(i, i)]).fold(0.0f64, f64::max);
    let inverse = |square: f64| if square > EMPTY * largest { 1.0 / square.sqrt() } else { 0.0 };
    let norm: Vec<f64> = (0..n).map(|i| inverse(gram[(i, i)])).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| gram[(i.max(j), i.min(j))] * norm[i] * norm[j]);
    let right = DVector::from_fn(n, |i, _| right[i] * norm[i]);
    let eigen = scaled.symmetric_eigen();
    let least = RANK * eigen.eigenvalues.iter().fold(0.0f64, |a, b| a.max(*b));
    let mut coordinates = eigen.eigenvectors.transpose() * right;
    for (coordinate, value) in coordinates.iter_mut().zip(eigen.eigenvalues.iter()) {
        *coordinate = if *value > least { *coordinate / value } else { 0.0 };
    }
    let solution = eigen.eigenvectors * coordinates;
    (0..n).map(|i| solution[i] * norm[i]).collect()
}

/// Powers of all terms of `axes` variables up to a total degree, none above `highest` of its variable; the constant first.
pub(crate) fn powers(axes: usize, degree: u32, highest: &[u32]) -> Vec<Vec<u32>> {
    let mut all = vec![Vec::new()];
    for k in 0..axes {
        let extended = |start: &Vec<u32>| {
            let left = degree - start.iter().sum::<u32>();
            let start = start.clone();
            (0..=left.min(highest[k])).map(move |p| [&start[..], &[p]].concat())
        };
        all = all.iter().flat_map(extended).collect();
    }
    all.sort_by_key(|p| (p.iter().sum::<u32>(), std::cmp::Reverse(p.clone())));
    all
}

/// The polynomial of some powers that fits best.
pub(crate) fn polynomial(samples: &Samples, powers: &[Vec<u32>], degree: u32) -> Shape {
    let rows: Vec<Vec<f64>> =
        samples.u.iter().map(|u| powers.iter().map(|p| monomial(p, u)).collect()).collect();
    let coefficients = least_squares(&rows, &samples.y, &samples.w);
    let term = |(powers, coefficient): (&Vec<u32>, f64)| Term { powers: powers.clone(), coefficient };
    Shape::Polynomial { degree, terms: powers.iter().zip(coefficients).map(term).collect() }
}

/// How a local regression looks at its neighbourhood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    /// Share of the samples in it.
    pub(crate) span: f64,
    /// Degree of the local polynomial, 1 or 2.
    pub(crate) degree: u32,
}

/// Local regression at a place (Cleveland and Devlin 1988): a polynomial through the nearest samples, weighted by the tricube of
/// their distance, read at the place itself.
pub(crate) fn loess(samples: &Samples, window: Window, at: &[f64]) -> f64 {
    let axes = at.len();
    let powers = powers(axes, window.degree, &vec![window.degree; axes]);
    let wanted = (window.span * samples.len() as f64).ceil() as usize;
    let count = wanted.max(powers.len() + 1).min(samples.len());
    let squared = |u: &Vec<f64>| u.iter().zip(at).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let distances: Vec<f64> = samples.u.iter().map(|u| squared(u).sqrt()).collect();
    let mut order = distances.clone();
    let (_, reach, _) = order.select_nth_unstable_by(count - 1, f64::total_cmp);
    let mut reach = *reach;
    // On a lattice the nearest may all have one place: a line needs two distances, a parabola three.
    while distinct(&distances, reach) <= window.degree as usize {
        let next = distances.iter().copied().filter(|d| *d > reach + SAME).fold(f64::INFINITY, f64::min);
        if next.is_infinite() {
            break;
        }
        reach = next;
    }
    // The farthest neighbour and all as far as it count a little.
    let reach = 1.1 * reach.max(SAME);
    let (mut rows, mut y, mut w) = (Vec::new(), Vec::new(), Vec::new());
    for k in (0..samples.len()).filter(|k| distances[*k] < reach) {
        let local: Vec<f64> = samples.u[k].iter().zip(at).map(|(a, b)| (a - b) / reach).collect();
        rows.push(powers.iter().map(|p| monomial(p, &local)).collect());
        y.push(samples.y[k]);
        w.push(samples.w[k] * (1.0 - (distances[k] / reach).powi(3)).powi(3));
    }
    // What is constant needs no solving, and rounding would only blur it.
    if y.iter().all(|v| *v == y[0]) {
        return y[0];
    }
    least_squares(&rows, &y, &w)[0]
}

/// Distances up to a reach that differ, at most three.
fn distinct(distances: &[f64], reach: f64) -> usize {
    let mut seen: Vec<f64> = Vec::new();
    for distance in distances.iter().filter(|d| **d <= reach + SAME) {
        if seen.len() < 3 && seen.iter().all(|other| (other - distance).abs() > SAME) {
            seen.push(*distance);
        }
    }
    seen.len()
}

/// Slopes of the cubic spline through some values that rises and falls only where they do (Fritsch and Butland 1984, as in PCHIP).
pub(crate) fn pchip_slopes(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let n = knots.len();
    let h: Vec<f64> = knots.windows(2).map(|w| w[1] - w[0]).collect();
    let d: Vec<f64> = values.windows(2).zip(&h).map(|(w, h)| (w[1] - w[0]) / h).collect();
    if n == 2 {
        return vec![d[0]; 2];
    }
    let inner = |k: usize| {
        let (a, b) = (2.0 * h[k] + h[k - 1], h[k] + 2.0 * h[k - 1]);
        if d[k - 1] * d[k] <= 0.0 { 0.0 } else { (a + b) / (a / d[k - 1] + b / d[k]) }
    };
    // One-sided three-point differences, held back where they would overshoot.
    let end = |h0: f64, h1: f64, d0: f64, d1: f64| {
        let slope = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
        match slope {
            s if s * d0 <= 0.0 => 0.0,
            s if d0 * d1 <= 0.0 && s.abs() > 3.0 * d0.abs() => 3.0 * d0,
            s => s,
        }
    };
    let mut slopes = vec![end(h[0], h[1], d[0], d[1])];
    slopes.extend((1..n - 1).map(inner));
    slopes.push(end(h[n - 2], h[n - 3], d[n - 2], d[n - 3]));
    slopes
}

/// Makes values on a grid rise (`sign` 1) or fall (−1) along one axis: the mean of the least function above them that does and of the
/// greatest one below. What rises along other axes still does.
pub(crate) fn make_monotone(values: &mut [f64], shape: &[usize], axis: usize, sign: f64) {
    let stride: usize = shape[axis + 1..].iter().product();
    let length = shape[axis];
    for start in (0..values.len()).filter(|k| (k / stride).is_multiple_of(length)) {
        let line: Vec<f64> = (0..length).map(|i| sign * values[start + i * stride]).collect();
        let mut above = line.clone();
        (1..length).for_each(|i| above[i] = above[i].max(above[i - 1]));
        let mut below = line;
        (0..length - 1).rev().for_each(|i| below[i] = below[i].min(below[i + 1]));
        (0..length).for_each(|i| values[start + i * stride] = sign * (above[i] + below[i]) / 2.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: usize, f: impl Fn(f64, f64) -> f64) -> Samples {
        let level = |k: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
        let mut samples = Samples::default();
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            samples.u.push(vec![level(i), level(j)]);
            samples.y.push(f(level(i), level(j)));
            samples.w.push(1.0);
        }
        samples
    }

    #[test]
    fn local_regression_reproduces_what_it_is_made_of() {
        let plane = grid(9, |a, b| 0.3 + 2.0 * a - 0.7 * b);
        let bowl = grid(9, |a, b| 1.0 + a * a - 0.5 * a * b + 0.2 * b);
        for at in [[0.0, 0.0], [-1.0, 1.0], [0.37, -0.81], [1.0, 1.0]] {
            for span in [0.1, 0.5, 1.0] {
                let linear = loess(&plane, Window { span, degree: 1 }, &at);
                assert!((linear - (0.3 + 2.0 * at[0] - 0.7 * at[1])).abs() < 1e-9, "{at:?} {span}: {linear}");
            }
            let quadratic = loess(&bowl, Window { span: 0.5, degree: 2 }, &at);
            let truth = 1.0 + at[0] * at[0] - 0.5 * at[0] * at[1] + 0.2 * at[1];
            assert!((quadratic - truth).abs() < 1e-9, "{at:?}: {quadratic} for {truth}");
        }
    }

    #[test]
    fn replicates_of_few_places_are_averaged() {
        let mut samples = Samples::default();
        for (u, y) in
            [-1.0, -1.0 + 1e-16, 0.0, 1e-16, 1.0, 1.0].into_iter().zip([0.0, 0.2, 1.0, 1.2, 2.0, 2.2])
        {
            samples.u.push(vec![u]);
            samples.y.push(y);
            samples.w.push(1.0);
        }
        for (at, truth) in [(-1.0, 0.1), (0.0, 1.1), (0.5, 1.6), (1.0, 2.1)] {
            for (span, degree) in [(0.01, 1), (0.5, 1), (0.01, 2), (1.0, 2)] {
                let value = loess(&samples, Window { span, degree }, &[at]);
                assert!((value - truth).abs() < 1e-6, "{at} {span} {degree}: {value}");
            }
        }
    }

    #[test]
    fn polynomials_come_back() {
        let samples = grid(7, |a, b| 0.1 - 0.2 * a + 0.3 * b * b * b - 0.4 * a * a * b);
        let powers = powers(2, 3, &[6, 6]);
        assert_eq!(powers.len(), 10);
        let Shape::Polynomial { terms, .. } = polynomial(&samples, &powers, 3) else {
            panic!("no polynomial")
        };
        for term in terms {
            let truth = match term.powers[..] {
                [0, 0] => 0.1,
                [1, 0] => -0.2,
                [0, 3] => 0.3,
                [2, 1] => -0.4,
                _ => 0.0,
            };
            assert!((term.coefficient - truth).abs() < 1e-9, "{term:?}");
        }
    }

    #[test]
    fn monotone_splines_do_not_overshoot() {
        // Fritsch and Carlson's RPN 14 data, made for this.
        let knots = [7.99, 8.09, 8.19, 8.7, 9.2, 10.0, 12.0, 15.0, 20.0];
        let values =
            [0.0, 2.76429e-5, 4.37498e-2, 0.169183, 0.469428, 0.943740, 0.998636, 0.999919, 0.999994];
        let slopes = pchip_slopes(&knots, &values);
        let shape = Shape::Spline { knots: knots.to_vec(), values: values.to_vec(), slopes };
        let mut last = -1e-15;
        for k in 0..=2000 {
            let value = shape.evaluate(&[7.99 + 12.01 * k as f64 / 2000.0]);
            assert!(value >= last - 1e-14 && value < 1.0, "{k}: {value} after {last}");
            last = value;
        }
        assert_eq!(shape.evaluate(&[8.19]), 4.37498e-2);
    }

    #[test]
    fn grids_become_monotone_and_stay_so_along_other_axes() {
        let mut values: Vec<f64> = (0..30).map(|k| f64::from(k * 7 % 13)).collect();
        make_monotone(&mut values, &[5, 6], 0, 1.0);
        make_monotone(&mut values, &[5, 6], 1, -1.0);
        for (i, j) in (0..5).flat_map(|i| (0..6).map(move |j| (i, j))) {
            assert!(i == 0 || values[i * 6 + j] >= values[(i - 1) * 6 + j]);
            assert!(j == 0 || values[i * 6 + j] <= values[i * 6 + j - 1]);
        }
        assert!(values.iter().any(|v| *v != values[0]));
    }
}
