//! Gauss–Legendre quadrature and Chebyshev interpolation.

use std::f64::consts::PI;

use crate::Real;

/// Nodes and weights of Gauss–Legendre quadrature on `[0, 1]`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Gauss {
    nodes: Vec<(f64, f64)>,
}

impl Gauss {
    /// The rule with `n` nodes: exact for polynomials of degree `2n − 1`.
    pub(crate) fn new(n: usize) -> Self {
        let node = |i: usize| {
            // Newton's method from an asymptotic guess (Abramowitz & Stegun, 22.16.6).
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            for _ in 0..4 {
                let (p, slope) = legendre(n, x);
                x -= p / slope;
            }
            let slope = legendre(n, x).1;
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        };
        Self { nodes: (0..n).map(node).collect() }
    }

    /// Nodes with weights on an interval.
    pub(crate) fn on(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.nodes.iter().map(move |(x, w)| (from + (to - from) * x, (to - from) * w))
    }

    /// The integral of a function over an interval.
    pub(crate) fn integrate(&self, from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
        self.on(from, to).map(|(x, weight)| weight * f(x)).sum()
    }
}

/// The Legendre polynomial of degree `n` and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut p) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
    }
    (p, n as f64 * (x * p - before) / (x * x - 1.0))
}

/// The Chebyshev points of the first kind on `[−1, 1]`.
pub(crate) fn chebyshev_points(n: usize) -> impl Iterator<Item = f64> {
    (0..n).map(move |i| (PI * (i as f64 + 0.5) / n as f64).cos())
}

/// Coefficients of the Chebyshev polynomials that take given values at [`chebyshev_points`].
pub(crate) fn chebyshev_coefficients(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    // cos(π k (i + ½)/n) takes only 4n different values.
    let cosines: Vec<f64> = (0..4 * n).map(|j| (PI * j as f64 / (2 * n) as f64).cos()).collect();
    let coefficient = |k: usize| {
        let sum: f64 = values.iter().enumerate().map(|(i, v)| v * cosines[k * (2 * i + 1) % (4 * n)]).sum();
        sum * if k == 0 { 1.0 } else { 2.0 } / n as f64
    };
    (0..n).map(coefficient).collect()
}

/// A sum of Chebyshev polynomials (Clenshaw 1955).
#[inline(always)]
pub(crate) fn clenshaw<T: Real, C: Copy + Into<f64>>(coefficients: &[C], u: T) -> T {
    let two_u = u + u;
    let (mut b, mut before) = (T::zero(), T::zero());
    for &c in coefficients[1..].iter().rev() {
        (b, before) = (T::of(c.into()) + two_u * b - before, b);
    }
    T::of(coefficients[0].into()) + u * b - before
}

/// How many arguments [`clenshaw_lanes`] takes: as many sums as registers hold.
pub(crate) const LANES: usize = 8;

/// [`clenshaw`] at many arguments, whose sums do not wait for each other.
pub(crate) fn clenshaw_lanes(coefficients: &[f64], u: [f64; LANES]) -> [f64; LANES] {
    let (mut b, mut before) = ([0.0; LANES], [0.0; LANES]);
    for &c in coefficients[1..].iter().rev() {
        for k in 0..LANES {
            (b[k], before[k]) = (c + 2.0 * u[k] * b[k] - before[k], b[k]);
        }
    }
    std::array::from_fn(|k| coefficients[0] + u[k] * b[k] - before[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly() {
        for n in [1, 4, 7, 16] {
            let gauss = Gauss::new(n);
            let degree = 2 * n as i32 - 1;
            let integral: f64 = gauss.on(0.0, 2.0).map(|(x, w)| w * x.powi(degree)).sum();
            let exact = 2f64.powi(degree + 1) / f64::from(degree + 1);
            assert!((integral - exact).abs() < 1e-13 * exact, "{n}: {integral} instead of {exact}");
        }
    }

    #[test]
    fn lanes_agree_with_single_sums() {
        let (coefficients, u) = ([0.3, -0.2, 0.05, 0.7], std::array::from_fn(|k| 0.25 * k as f64 - 1.0));
        assert_eq!(clenshaw_lanes(&coefficients, u), u.map(|u| clenshaw(&coefficients, u)));
    }

    #[test]
    fn a_polynomial_is_its_own_interpolant() {
        let values: Vec<f64> = chebyshev_points(5).map(|x| 3.0 + 2.0 * x + 4.0 * x.powi(3)).collect();
        // x³ = (3 T₁ + T₃)/4.
        for (found, expected) in chebyshev_coefficients(&values).iter().zip([3.0, 5.0, 0.0, 1.0, 0.0]) {
            assert!((found - expected).abs() < 1e-14);
        }
    }
}
