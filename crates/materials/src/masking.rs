//! Masking and shadowing of microfacets, G(wi, wo).

use std::f64::consts::PI;

use crate::distribution::{Distribution, Shape};
use crate::{Geometry, Real};

/// How masking (towards the viewer) and shadowing (towards the light) are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Masking {
    /// `G1(wi) G1(wo)`: Walter *et al.* (2007), eq. 23.
    Separable,
    /// `1/(1 + Λ(wi) + Λ(wo))`: height-correlated Smith, Heitz (2014), eq. 99.
    Correlated,
    /// [`Masking::Separable`] with Walter's rational fit of Beckmann's G1 (eq. 27; at most 0.31 % off).
    SeparableRational,
    /// [`Masking::Correlated`] with the same rational fit.
    CorrelatedRational,
    /// The V-groove of Torrance & Sparrow (1967): `min(1, 2 h·n o·n / o·h, 2 h·n i·n / o·h)`.
    VGroove,
    /// No masking: 1.
    One,
}

impl Masking {
    /// The fraction of microfacets seen and lit, 0 to 1.
    #[inline(always)]
    pub fn visibility<T: Real>(self, distribution: &Distribution, g: &Geometry<T>) -> T {
        let one = T::one();
        let lambda = |w: &[T; 3], rational| smith_lambda(distribution, w, rational);
        match self {
            Self::Separable => one / ((one + lambda(&g.wi, false)) * (one + lambda(&g.wo, false))),
            Self::Correlated => one / (one + lambda(&g.wi, false) + lambda(&g.wo, false)),
            Self::SeparableRational => one / ((one + lambda(&g.wi, true)) * (one + lambda(&g.wo, true))),
            Self::CorrelatedRational => one / (one + lambda(&g.wi, true) + lambda(&g.wo, true)),
            Self::VGroove => v_groove(g),
            Self::One => one,
        }
    }
}

/// The V-groove of Torrance & Sparrow (1967), which knows no distribution.
#[inline(always)]
pub fn v_groove<T: Real>(g: &Geometry<T>) -> T {
    let twice = T::of(2.0) * g.cos_h / g.cos_d;
    T::one().min(twice * g.cos_i()).min(twice * g.cos_o())
}

/// Smith's auxiliary function Λ, with `G1 = 1/(1 + Λ)` (Heitz 2014, eq. 43). The Phong shape borrows
/// Beckmann's, GTR1 that of GGX.
#[inline(always)]
pub fn smith_lambda<T: Real>(distribution: &Distribution, w: &[T; 3], rational: bool) -> T {
    let [ax, ay] = distribution.alpha.map(T::of);
    let projected2 = ax * ax * w[0] * w[0] + ay * ay * w[1] * w[1];
    if projected2 <= T::zero() {
        return T::zero();
    }
    match distribution.shape {
        Shape::Ggx | Shape::Gtr1 => T::of(0.5) * ((T::one() + projected2 / (w[2] * w[2])).sqrt() - T::one()),
        Shape::Beckmann | Shape::Phong => {
            let a = w[2] / projected2.sqrt();
            if rational { beckmann_lambda_rational(a) } else { beckmann_lambda(a) }
        }
    }
}

/// Exact Λ of the Beckmann distribution at `a = 1/(α tan θ)`.
fn beckmann_lambda<T: Real>(a: T) -> T {
    // Beyond a = 6 both terms are below 1e-17 and their difference is rounding only.
    if a > T::of(6.0) {
        return T::zero();
    }
    let tail = (-a * a).exp() / (T::of(2.0 * PI.sqrt()) * a);
    (T::of(0.5) * (a.erf() - T::one()) + tail).max(T::zero())
}

/// Walter's rational approximation, stated for G1 and turned into Λ.
fn beckmann_lambda_rational<T: Real>(a: T) -> T {
    if a >= T::of(1.6) {
        return T::zero();
    }
    let g1 = (T::of(3.535) * a + T::of(2.181) * a * a) / (T::one() + T::of(2.276) * a + T::of(2.577) * a * a);
    g1.recip() - T::one()
}
