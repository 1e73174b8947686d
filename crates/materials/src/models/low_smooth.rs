//! The smooth-surface ABC model of Löw *et al.* (2012), eq. 10-14: Rayleigh–Rice scattering of a nearly flat surface, beside a
//! Lambert term.
//!
//! `f = k_d/π + F S` with `S = A/(1 + B |H_xy|²)^C`, where `H = ω_i + ω_o` is not normalised, and the exact dielectric Fresnel
//! reflectance at `cos θ = √(1 − |ω_i,xy − ω_o,xy|²/4)`, which is not the angle to the half vector.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the Lambert term, k_d | 0.5 |
//! | `a` | height of the lobe, A, per channel; not normalised | 50 |
//! | `b` | narrowness of its core, B, about `1/(4α²)` | 2000 |
//! | `c` | fall of its tail, C | 1.5 |
//! | `ior` | index of refraction | 1.5 |
//!
//! Presets: Löw's fits of all 100 MERL materials (logarithmic metric E2), by the materials' names.
//!
//! Known defects: A is not tied to B and C, so that parameters can reflect more light than arrives.

use crate::conformance::Parameters;
use crate::fresnel::Fresnel;
use crate::model::Model;
use crate::models::low_abc::{A, B, C, abc, rings};
use crate::models::shared::{DIFFUSE, IOR};
use crate::presets;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "low-smooth",
    title: "Löw ABC (smooth surface)",
    summary: "Scattering of a nearly flat surface with a freely falling tail; has fits of all MERL materials.",
    reference: "Löw et al. 2012, eq. 10-14",
    largest_albedo: 1e4,
    parameters: &[DIFFUSE, A, B, C, IOR],
    surveyed: &["ior", "b"],
    searched: &["a", "b"],
    linear: &["diffuse", "a"],
    presets: presets::low_smooth,
    build: |v| {
        Box::new(LowSmooth {
            diffuse: v.colour("diffuse"),
            height: v.colour("a"),
            core: v.number("b"),
            tail: v.number("c"),
            fresnel: Fresnel::Dielectric { eta: v.number("ior") },
        })
    },
    vectors: Some(("low_smooth", vector)),
    ..Model::BLANK
};

/// Löw's lobe of a smooth surface with a Lambert term.
#[derive(Clone, Copy, Debug)]
pub struct LowSmooth {
    /// Albedo of the Lambert term per channel.
    pub diffuse: [f64; 3],
    /// A per channel.
    pub height: [f64; 3],
    /// B, above 0.
    pub core: f64,
    /// C, above 0.
    pub tail: f64,
    /// Fresnel reflectance.
    pub fresnel: Fresnel,
}

impl Lobe for LowSmooth {
    fn diffuse(&self) -> [f64; 3] {
        self.diffuse
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        // |H_xy| = 2 cos_d cos_h tan θ_h.
        let across = g.cos_d * g.cos_h;
        let sum2 = T::of(4.0) * across * across * (g.tan2_h[0] + g.tan2_h[1]);
        let difference2 = (g.wi[0] - g.wo[0]).powi(2) + (g.wi[1] - g.wo[1]).powi(2);
        let cos = (T::one() - T::of(0.25) * difference2).max(T::zero()).sqrt();
        let lobe = self.fresnel.reflectance(cos) * abc(sum2, self.core, self.tail);
        self.height.map(|a| T::of(a) * lobe)
    }

    fn sampling(&self) -> Option<Sampling> {
        // At normal incidence |H_xy|² is about 8 (1 − cos θ_h).
        if self.height == [0.0; 3] { None } else { rings(8.0 * self.core, self.tail) }
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    Some(Box::new(LowSmooth {
        diffuse: [p.number_or("kd", 0.0)?; 3],
        height: [p.number("A")?; 3],
        core: p.number("B")?,
        tail: p.number("C")?,
        fresnel: Fresnel::Dielectric { eta: p.number("eta")? },
    }))
}
