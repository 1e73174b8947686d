//! The basis in which isotropic lobes and incident light meet: rings of half vectors about the normal.
//!
//! For a view at θ_o the specular integral over half vectors is
//!
//! ```text
//! L_o = ∫∫ L(ω_i) g(θ_h, φ_h) dφ_h dθ_h,   g = f cos θ_i · 4 (ω_o·h) sin θ_h
//! ```
//!
//! because `dω_i = 4 (ω_o·h) dω_h`. On a ring of constant θ_h an isotropic lobe depends on `ω_o·h` alone, which is linear
//! in `cos φ_h`. So g is expanded in hat functions of θ_h times Chebyshev polynomials of the position `x` on the ring,
//! and the light is reduced, once, to its moments in the same functions.

use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

/// Nodes of the hat functions.
pub(crate) const NODES: usize = 32;
/// Chebyshev polynomials on each ring.
pub(crate) const TERMS: usize = 4;
/// Coefficients per channel.
pub(crate) const ROW: usize = NODES * TERMS;

/// Node `j` of the hat functions in radians: dense near 0, where narrow lobes are, and π/2 at the last.
pub(crate) fn node(j: usize) -> f64 {
    static ALL: LazyLock<[f64; NODES]> =
        LazyLock::new(|| std::array::from_fn(|j| FRAC_PI_2 * (j as f64 / (NODES - 1) as f64).powf(2.5)));
    ALL[j]
}

/// The interval between nodes that an angle lies in, and the share of its right-hand hat function.
fn hat_position(theta: f64) -> (usize, f64) {
    let interval = (((theta / FRAC_PI_2).powf(0.4) * (NODES - 1) as f64) as usize).min(NODES - 2);
    let share = (theta - node(interval)) / (node(interval + 1) - node(interval));
    (interval, share.clamp(0.0, 1.0))
}

/// The part of a ring of half vectors from which light comes from above the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ring {
    /// Smallest and largest `cos_d = ω_o·h`.
    low: f64,
    high: f64,
    /// Half width of the range of φ_h about the plane of the view, in radians.
    pub(crate) half_angle: f64,
}

impl Ring {
    /// The ring at θ_h for a view at θ_o, each as cosine and sine; `None` where it lies below the horizon.
    pub(crate) fn new((cos_o, sin_o): (f64, f64), (cos_h, sin_h): (f64, f64)) -> Option<Self> {
        let (middle, swing) = (cos_o * cos_h, sin_o * sin_h);
        // cos θ_i = 2 cos_d cos_h − cos_o must be positive.
        let horizon = cos_o / (2.0 * cos_h);
        let (low, high) = (middle - swing, middle + swing);
        if high <= horizon {
            return None;
        }
        if low >= horizon {
            return Some(Self { low, high, half_angle: std::f64::consts::PI });
        }
        let half_angle = ((horizon - middle) / swing).clamp(-1.0, 1.0).acos();
        Some(Self { low: horizon, high, half_angle })
    }

    /// Position on the ring, in [−1, 1], of a `cos_d`.
    pub(crate) fn position(&self, cos_d: f64) -> f64 {
        let width = self.high - self.low;
        if width < 1e-12 { 0.0 } else { ((2.0 * cos_d - self.low - self.high) / width).clamp(-1.0, 1.0) }
    }

    /// The `cos_d` at a position on the ring.
    pub(crate) fn cos_d(&self, position: f64) -> f64 {
        0.5 * (self.low + self.high + position * (self.high - self.low))
    }
}

/// A single direction of light in the basis: what it adds to the moments of a view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RingPoint {
    /// `dω_i/(dθ_h dφ_h) = 4 cos_d sin θ_h`: irradiance over it, times a basis function, is that function's moment.
    pub(crate) density: f64,
    /// The nodes that θ_h lies between, with their hat functions.
    pub(crate) hats: [(usize, f64); 2],
    /// The Chebyshev polynomials at the position on the ring.
    pub(crate) polynomials: [f64; TERMS],
}

impl RingPoint {
    /// For a view at θ_o (as cosine and sine), and a half vector at θ_h with its `cos_d = ω_o·h`; `None` where the ring lies
    /// below the horizon.
    pub(crate) fn new(view: (f64, f64), cos_h: f64, cos_d: f64) -> Option<Self> {
        let cos_h = cos_h.min(1.0);
        // Above 0: a mirrored light would have no density.
        let sin_h = (1.0 - cos_h * cos_h).sqrt().max(1e-9);
        let ring = Ring::new(view, (cos_h, sin_h))?;
        let (interval, share) = hat_position(sin_h.atan2(cos_h));
        Some(Self {
            density: 4.0 * cos_d * sin_h,
            hats: [(interval, 1.0 - share), (interval + 1, share)],
            polynomials: chebyshev(ring.position(cos_d)),
        })
    }
}

/// Chebyshev polynomials T₀ … of the first kind at `x`.
pub(crate) fn chebyshev(x: f64) -> [f64; TERMS] {
    let mut t = [1.0; TERMS];
    if TERMS > 1 {
        t[1] = x;
    }
    for k in 2..TERMS {
        t[k] = 2.0 * x * t[k - 1] - t[k - 2];
    }
    t
}

/// The tridiagonal mass matrix of the hat functions, factorised: below the diagonal, above it, and one over the pivots.
static MASS: LazyLock<[[f64; 3]; NODES]> = LazyLock::new(|| {
    let width = |j: usize| node(j + 1) - node(j);
    let mut rows = [[0.0; 3]; NODES];
    let mut upper = 0.0;
    for (j, row) in rows.iter_mut().enumerate() {
        let left = if j > 0 { width(j - 1) } else { 0.0 };
        let right = if j + 1 < NODES { width(j) } else { 0.0 };
        let below = left / 6.0;
        let pivot = ((left + right) / 3.0 - below * upper).recip();
        upper = right / 6.0 * pivot;
        *row = [below, upper, pivot];
    }
    rows
});

/// Turns the products of functions with the hat functions into the coefficients of their best approximations by them
/// (L²), in place: `products[j]` holds one product for each of `N` functions.
pub(crate) fn project<const N: usize>(products: &mut [[f64; N]; NODES]) {
    for j in 0..NODES {
        let [below, _, pivot] = MASS[j];
        let previous = if j > 0 { products[j - 1] } else { [0.0; N] };
        for k in 0..N {
            products[j][k] = (products[j][k] - below * previous[k]) * pivot;
        }
    }
    for j in (0..NODES - 1).rev() {
        let next = products[j + 1];
        for k in 0..N {
            products[j][k] -= MASS[j][1] * next[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_reproduces_its_own_functions() {
        // A function that is a sum of hats has products M c, where M is the mass matrix.
        let coefficients: [[f64; 2]; NODES] =
            std::array::from_fn(|j| [(j as f64 * 0.7).sin(), (j as f64 * 0.3).cos()]);
        let mut products = [[0.0; 2]; NODES];
        for j in 0..NODES - 1 {
            let h = node(j + 1) - node(j);
            for k in 0..2 {
                let (a, b) = (coefficients[j][k], coefficients[j + 1][k]);
                products[j][k] += h * (a / 3.0 + b / 6.0);
                products[j + 1][k] += h * (a / 6.0 + b / 3.0);
            }
        }
        project(&mut products);
        let same = |(a, b): (&[f64; 2], &[f64; 2])| (0..2).all(|k| (a[k] - b[k]).abs() < 1e-9);
        assert!(products.iter().zip(&coefficients).all(same));
    }

    #[test]
    fn rings_end_at_the_horizon() {
        let angle = |a: f64| (a.cos(), a.sin());
        assert!(
            Ring::new(angle(0.3), angle(0.95)).is_none(),
            "h beyond (θ_o + π/2)/2 mirrors below the surface"
        );
        let whole = Ring::new(angle(0.3), angle(0.2)).unwrap();
        assert_eq!(whole.half_angle, std::f64::consts::PI);
        let cut = Ring::new(angle(1.2), angle(0.6)).unwrap();
        assert!(cut.half_angle < 3.0);
        let lowest = 2.0 * cut.cos_d(-1.0) * 0.6f64.cos() - 1.2f64.cos();
        assert!(lowest.abs() < 1e-12, "the end of a cut ring reflects along the surface");
    }
}
