//! Phong's cosine lobe about the mirror direction, normalised: the "modified Phong" of Lafortune & Willems, beside a Lambert
//! term.
//!
//! `f = k_d/π + k_s (n + 2)/(2π) max(0, R·ω_o)ⁿ` with the light's mirror image `R = (−x_i, −y_i, z_i)`.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the Lambert term, k_d | 0.5 |
//! | `specular` | reflectance of the lobe at normal incidence, k_s | 0.1 |
//! | `exponent` | n: 1 is nearly diffuse, 10,000 nearly a mirror | 100 |
//!
//! Phong (1975) had neither the normalisation nor reciprocity; this is Lafortune & Willems (1994), *Using the Modified Phong
//! Reflectance Model for Physically Based Rendering*, and the plugin `phong` of Mitsuba 0.6.
//!
//! Known defects: no Fresnel effect; the albedo falls from k_s at normal incidence with the cosine of the angle (to 0.11 k_s at
//! cos θ = 0.1 for n = 100), because the lobe has no factor against it; highlights at grazing angles are round where real ones are
//! long.

use std::f64::consts::TAU;

use crate::conformance::Parameters;
use crate::model::Model;
use crate::models::shared::*;
use crate::sampling::Technique;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "phong",
    title: "Phong",
    summary: "Power of a cosine about the mirror direction, normalised, without Fresnel effect.",
    reference: "Phong 1975; Lafortune & Willems 1994; Mitsuba 0.6 phong",
    has_fresnel: false,
    // The lobe alone stays below 1; an uncoupled Lambert term of albedo near 1 is added to it.
    largest_albedo: 1.4,
    parameters: &[
        DIFFUSE,
        SPECULAR,
        exponent("exponent", "n", "Power of the cosine between the mirror direction and the view."),
    ],
    surveyed: &["specular", "exponent"],
    searched: &["specular", "exponent"],
    linear: &["diffuse", "specular"],
    build: |v| {
        Box::new(Phong {
            diffuse: v.colour("diffuse"),
            specular: v.colour("specular"),
            exponent: v.number("exponent"),
        })
    },
    vectors: Some(("phong", vector)),
    ..Model::BLANK
};

/// Phong's lobe with a Lambert term.
#[derive(Clone, Copy, Debug)]
pub struct Phong {
    /// Albedo of the Lambert term per channel.
    pub diffuse: [f64; 3],
    /// Reflectance of the lobe at normal incidence per channel.
    pub specular: [f64; 3],
    /// Power of the cosine, 0 or more.
    pub exponent: f64,
}

impl Lobe for Phong {
    fn diffuse(&self) -> [f64; 3] {
        self.diffuse
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let lobe = T::of((self.exponent + 2.0) / TAU) * power_of_cosine(g.versine_mirror(), self.exponent);
        self.specular.map(|s| T::of(s) * lobe)
    }

    fn sampling(&self) -> Option<Sampling> {
        let mirror = Technique::Power { scale: [-1.0, -1.0, 1.0], exponent: self.exponent };
        Sampling::mixture([(self.specular.into_iter().sum(), mirror)])
    }
}

/// `max(0, 1 − v)ⁿ` of a versine v: a power of a cosine that keeps its digits where the cosine rounds to 1.
#[inline(always)]
pub(super) fn power_of_cosine<T: Real>(versine: T, exponent: f64) -> T {
    if versine < T::one() { (T::of(exponent) * (-versine).ln_1p()).exp() } else { T::zero() }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    Some(Box::new(Phong {
        diffuse: [p.number_or("kd", 0.0)?; 3],
        specular: [p.number("ks")?; 3],
        exponent: p.number("n")?,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;

    /// Albedo of the lobe at normal incidence, where `R·ω_o = cos θ_i`.
    #[test]
    fn the_albedo_at_normal_incidence_is_the_specular_reflectance() {
        for n in [0.0, 1.0, 30.0, 20_000.0] {
            let bsdf = Material::parse(&format!("phong:diffuse=0,specular=0.7,exponent={n}")).unwrap().bsdf();
            // With u = 1 − t⁴ the nodes lie where narrow lobes are.
            let nodes = 4000;
            let albedo: f64 = (0..nodes)
                .map(|k| {
                    let t = (f64::from(k) + 0.5) / f64::from(nodes);
                    let cos = 1.0 - t.powi(4);
                    let f = bsdf.evaluate([(1.0 - cos * cos).sqrt(), 0.0, cos], [0.0, 0.0, 1.0]);
                    TAU * f[0] * cos * 4.0 * t.powi(3) / f64::from(nodes)
                })
                .sum();
            assert!((albedo - 0.7).abs() < 1e-5, "n = {n}: {albedo}");
        }
    }
}
