//! Ashikhmin & Shirley (2000), *An Anisotropic Phong BRDF Model*, as they wrote it. (What the paper rendered under this name
//! is [`as`](super::ashikhmin_shirley).)
//!
//! Specular, eq. 4: `√((n_u + 1)(n_v + 1))/(8π) cos^e θ_h F(cos_d)/(cos_d max(cos θ_i, cos θ_o))` with
//! `e = n_u cos² φ_h + n_v sin² φ_h`.
//!
//! Diffuse, eq. 5, coupled to the lobe: `28 k_d/(23π) (1 − F_0)(1 − (1 − cos θ_i/2)⁵)(1 − (1 − cos θ_o/2)⁵)`.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo under the lobe, k_d | 0.5 |
//! | `coupling` | `coupled` (eq. 5), `lambert` (k_d/π whatever the lobe reflects) or `none` | coupled |
//! | `specular` | scale of the lobe, 1 in the article; fits need it | 1 |
//! | `fresnel` | `schlick` (the article's), `dielectric`, `conductor` or `none` (F = 1) | schlick |
//! | `f0`, `ior`, `eta` and `k` | what the Fresnel term needs: only the chosen one's are read | 0.04, 1.5, iridium |
//! | `exponent_u`, `exponent_v` | narrowness along tangent and bitangent; `exponent` sets both | 100 |
//!
//! Deviations: `coupling`, `specular` and three of the four Fresnel terms are additions. With them `1 − F_0` takes the
//! reflectance of the Fresnel term at normal incidence, and leaves `specular` aside: the diffuse reflection does not change
//! when the lobe is switched off.
//!
//! Presets: `ngan-NAME` (Ngan *et al.* 2005, `schlick`) and `low-NAME` (Löw *et al.* 2012, `dielectric`, logarithmic metric),
//! with `lambert` coupling.
//!
//! Known defects: without a lobe the coupled diffuse reflection has an albedo of 0.97 k_d at normal incidence and 0.23 k_d at
//! cos θ = 0.1; lobes of small exponents lose energy at grazing angles.

use std::f64::consts::PI;

use crate::conformance::Parameters;
use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::model::{Alias, Model};
use crate::models::shared::*;
use crate::parameter::{Kind, Parameter, Role};
use crate::presets;
use crate::sampling::Technique;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "ashikhmin-shirley",
    title: "Ashikhmin–Shirley (2000)",
    summary: "Anisotropic Phong-like lobe with Schlick's Fresnel term above a coupled diffuse reflection.",
    reference: "Ashikhmin & Shirley 2000, eq. 4, 5",
    // With its own coupling it stays below 1; an uncoupled Lambert term or a scale above 1 goes above.
    parameters: &[
        Parameter { role: Role::BaseColour, summary: "Albedo under the lobe, linear RGB.", ..DIFFUSE },
        Parameter {
            name: "coupling",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "Diffuse reflection: coupled to the lobe (2000), lambert or none.",
            kind: Kind::Choice { options: &["coupled", "lambert", "none"] },
        },
        SPECULAR_SCALE,
        Parameter {
            name: "fresnel",
            symbol: "F",
            role: Role::Variant,
            unit: "-",
            summary: "Fresnel term: schlick (reads f0), dielectric (ior), conductor (eta, k) or none.",
            kind: Kind::Choice { options: &["schlick", "dielectric", "conductor", "none"] },
        },
        F0,
        IOR,
        CONDUCTOR_ETA,
        CONDUCTOR_K,
        exponent(
            "exponent_u",
            "n_u",
            "Power of the cosine between half vector and normal along the tangent.",
        ),
        exponent(
            "exponent_v",
            "n_v",
            "Power of the cosine between half vector and normal along the bitangent.",
        ),
    ],
    aliases: &[Alias { name: "exponent", parameters: &["exponent_u", "exponent_v"] }],
    named: &[CHOSEN_CONDUCTOR],
    surveyed: &["f0", "exponent"],
    searched: &["f0", "exponent"],
    linear: &["diffuse", "specular", "f0"],
    presets: presets::ashikhmin_shirley,
    build: |v| {
        let coupling = coupling(v.choice("coupling")).unwrap_or(Coupling::Coupled);
        let exponents = [v.number("exponent_u"), v.number("exponent_v")];
        let (diffuse, specular) = (v.colour("diffuse"), v.colour("specular"));
        Box::new(AshikhminShirley::new((diffuse, coupling), specular, fresnel(v), exponents))
    },
    vectors: Some(("ashikhmin_shirley", vector)),
    ..Model::BLANK
};

/// What lies under the lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coupling {
    /// Only what the lobe leaves is reflected diffusely.
    Coupled,
    /// A Lambert term.
    Lambert,
    /// Nothing.
    None,
}

fn coupling(name: &str) -> Option<Coupling> {
    match name {
        "coupled" => Some(Coupling::Coupled),
        "lambert" => Some(Coupling::Lambert),
        "none" => Some(Coupling::None),
        _ => None,
    }
}

/// Ashikhmin and Shirley's BRDF.
#[derive(Clone, Copy, Debug)]
pub struct AshikhminShirley {
    /// Albedo of the Lambert term per channel.
    lambert: [f64; 3],
    /// The coupled diffuse reflection over its angular part, per channel.
    under: [f64; 3],
    /// Scale of the lobe per channel.
    specular: [f64; 3],
    fresnel: [Fresnel; 3],
    exponents: [f64; 2],
}

impl AshikhminShirley {
    /// A lobe of a scale, a Fresnel term and exponents of 0 or more, above a diffuse albedo.
    pub fn new(
        (diffuse, coupling): ([f64; 3], Coupling),
        specular: [f64; 3],
        fresnel: [Fresnel; 3],
        exponents: [f64; 2],
    ) -> Self {
        let left = |c: usize| diffuse[c] * (1.0 - fresnel[c].reflectance(1.0));
        let (lambert, under) = match coupling {
            Coupling::Coupled => ([0.0; 3], std::array::from_fn(|c| 28.0 / (23.0 * PI) * left(c))),
            Coupling::Lambert => (diffuse, [0.0; 3]),
            Coupling::None => ([0.0; 3], [0.0; 3]),
        };
        Self { lambert, under, specular, fresnel, exponents }
    }

    /// The distribution whose normals are where the lobe is.
    fn distribution(&self) -> Distribution {
        Distribution { shape: Shape::Phong, alpha: self.exponents.map(|n| (2.0 / (n + 2.0)).sqrt()) }
    }

    /// `√((n_u + 1)(n_v + 1))/(8π) cos^e θ_h`.
    #[inline(always)]
    fn power<T: Real>(&self, g: &Geometry<T>) -> T {
        let [nu, nv] = self.exponents;
        let tan2 = g.tan2_h[0] + g.tan2_h[1];
        let exponent = if tan2 > T::zero() {
            (T::of(nu) * g.tan2_h[0] + T::of(nv) * g.tan2_h[1]) / tan2
        } else {
            T::of(nu)
        };
        // cos^e θ = (1 + tan² θ)^(−e/2), which keeps its digits near θ = 0 where cos θ rounds to 1.
        T::of(((nu + 1.0) * (nv + 1.0)).sqrt() / (8.0 * PI)) * (-T::of(0.5) * exponent * tan2.ln_1p()).exp()
    }
}

impl Lobe for AshikhminShirley {
    fn diffuse(&self) -> [f64; 3] {
        self.lambert
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let lobe = self.power(g) / (g.cos_d * g.cos_i().max(g.cos_o()));
        let missing = |cos: T| T::one() - (T::one() - T::of(0.5) * cos).powi(5);
        let angular = missing(g.cos_i()) * missing(g.cos_o());
        std::array::from_fn(|c| {
            let reflectance = self.fresnel[c].reflectance(g.cos_d);
            T::of(self.specular[c]) * reflectance * lobe + T::of(self.under[c]) * angular
        })
    }

    fn sampling(&self) -> Option<Sampling> {
        // Even a black lobe reflects at grazing angles.
        let reflectance = |c: usize| self.fresnel[c].reflectance(1.0f64).max(0.04);
        let lobe: f64 = (0..3).map(|c| self.specular[c] * reflectance(c)).sum();
        let under = PI * self.under.into_iter().sum::<f64>();
        Sampling::mixture([(lobe, Technique::HalfVector(self.distribution())), (under, Technique::Cosine)])
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let under = ([p.number_or("kd", 0.0)?; 3], coupling(p.text("diffuse").unwrap_or("lambert"))?);
    let exponents = [p.number("nu")?, p.number("nv")?];
    Some(Box::new(AshikhminShirley::new(under, [p.number_or("ks", 1.0)?; 3], [p.fresnel()?; 3], exponents)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;

    #[test]
    fn the_diffuse_reflection_is_that_of_the_article() {
        let material = Material::parse("ashikhmin-shirley:diffuse=0.4,f0=0.3,exponent=50").unwrap();
        let mirror = ([0.6, 0.0, 0.8], [-0.6, 0.0, 0.8]);
        let rest = material.diffuse_bsdf().evaluate(mirror.0, mirror.1)[0];
        let angular = (1.0 - 0.6f64.powi(5)).powi(2);
        assert!((rest - 28.0 * 0.4 * 0.7 / (23.0 * PI) * angular).abs() < 1e-12);
    }
}
