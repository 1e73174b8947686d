//! Pieces that the layered materials of production renderers share.

use crate::albedo::{Albedo, Interface};
use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::masking::Masking;
use crate::{Geometry, Real};

/// Narrowest α: a narrower lobe counts as this wide.
pub(crate) const NARROWEST: f64 = 1e-3;

/// A GGX distribution, no narrower than [`NARROWEST`].
pub(crate) fn ggx(alpha: [f64; 2]) -> Distribution {
    Distribution { shape: Shape::Ggx, alpha: alpha.map(|a| a.max(NARROWEST)) }
}

/// A distribution as a BRDF without its Fresnel term: `D G/(4 cos θ_i cos θ_o)`.
#[inline(always)]
pub(crate) fn facets<T: Real>(distribution: &Distribution, masking: Masking, g: &Geometry<T>) -> T {
    distribution.density(g) * masking.visibility(distribution, g) / (T::of(4.0) * g.cos_i() * g.cos_o())
}

/// The directional albedo of a distribution with a Fresnel term.
pub(crate) fn albedo(distribution: &Distribution, fresnel: Fresnel) -> Albedo {
    Albedo::new(Interface { alpha: distribution.alpha, masking: Masking::Correlated, fresnel })
}

/// A rough dielectric interface with its albedo.
pub(crate) struct Gloss {
    pub(crate) distribution: Distribution,
    pub(crate) fresnel: Fresnel,
    pub(crate) albedo: Albedo,
}

impl Gloss {
    /// An interface of relative index `eta`; `None` where it does not reflect.
    pub(crate) fn new(distribution: Distribution, eta: f64) -> Option<Self> {
        let fresnel = Fresnel::Dielectric { eta };
        (eta != 1.0).then(|| Self { distribution, fresnel, albedo: albedo(&distribution, fresnel) })
    }

    /// Its BRDF, in 1/sr.
    #[inline(always)]
    pub(crate) fn at<T: Real>(&self, g: &Geometry<T>) -> T {
        self.fresnel.reflectance(g.cos_d) * facets(&self.distribution, Masking::Correlated, g)
    }
}

/// A metal's reflectance by F0 and a tint at 82°: `F0 + (1 − F0)(1 − c)⁵ − b c (1 − c)⁶` (Kutz, Hašan & Edmondson 2021).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct F82 {
    f0: f64,
    b: f64,
    least: f64,
}

impl F82 {
    /// The cosine at which the tint acts.
    const COS: f64 = 1.0 / 7.0;

    pub(crate) fn new(f0: f64, tint: f64) -> Self {
        let schlick = f0 + (1.0 - f0) * (1.0 - Self::COS).powi(5);
        Self { f0, b: schlick * (1.0 - tint) / (Self::COS * (1.0 - Self::COS).powi(6)), least: 0.0 }
    }

    /// The bare formula, which falls below 0 near 82° where the tint is black.
    pub(crate) fn unclamped(self) -> Self {
        Self { least: f64::NEG_INFINITY, ..self }
    }

    #[inline(always)]
    pub(crate) fn at<T: Real>(&self, cos: T) -> T {
        let rest = T::one() - cos;
        let fifth = rest * rest * rest * rest * rest;
        let f0 = T::of(self.f0);
        (f0 + (T::one() - f0) * fifth - T::of(self.b) * cos * fifth * rest).max(T::of(self.least))
    }

    /// `2 ∫ F c dc`.
    pub(crate) fn average(&self) -> f64 {
        self.f0 + (1.0 - self.f0) / 21.0 - self.b / 126.0
    }
}
