//! GGX with the light that bounces between microfacets: Kulla & Conty 2017.
//!
//! `f = k_d/π + k_s (F D G/(4 cos θ_i cos θ_o) + (1 − E(θ_i)) (1 − E(θ_o))/(π (1 − Ē)) · F̄² Ē/(1 − F̄ (1 − Ē)))`
//!
//! with E the directional albedo of the lobe for F = 1, Ē its average, and F̄ the average Fresnel reflectance `2 ∫ F c dc`. E is integrated for
//! every width, not fitted (see `albedo.rs`).
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `specular` | scale of the lobe; 1 is physical | 1 |
//! | `fresnel` | `schlick` (with `f0`), `dielectric` (with `ior`) or `conductor` (with `eta` and `k`) | schlick |
//! | `f0` | reflectance at normal incidence, linear RGB | 0.04 |
//! | `ior` | index of refraction, inside over outside | 1.5 |
//! | `eta`, `k` | complex index of refraction per channel | iridium |
//! | `roughness` | α (not squared) | 0.2 |
//! | `masking` | `correlated` (Heitz 2014) or `separable` | correlated |
//!
//! Known defects: isotropic only; the Lambert term is not coupled to the interface; the colour of the repeated reflections is that of an average
//! angle.

use std::f64::consts::FRAC_1_PI;

use crate::albedo::{Albedo, Interface};
use crate::colour::mean;
use crate::conformance::Parameters;
use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::masking::Masking;
use crate::microfacet::Microfacet;
use crate::model::{Model, Values};
use crate::models::shared::*;
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};
use crate::quadrature::Gauss;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling, Technique};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "kulla-conty",
    title: "Kulla–Conty",
    summary: "Rough metal or plastic whose microfacets lose no light, above a Lambert term.",
    reference: "Kulla & Conty 2017, Revisiting Physically Based Shading at Imageworks",
    has_fresnel: true,
    is_reciprocal: true,
    // The lobe alone stays below 1; an uncoupled Lambert term of albedo near 1 is added to it.
    largest_albedo: 2.0,
    parameters: &[
        DIFFUSE,
        SPECULAR_SWITCH,
        Parameter {
            name: "f0",
            symbol: "F0",
            role: Role::NormalReflectance,
            unit: "1",
            summary: "Reflectance at normal incidence, linear RGB, for Schlick's Fresnel term.",
            kind: Kind::Colour {
                range: Range {
                    valid: Interval::closed(0.0, 1.0),
                    plausible: Interval::closed(0.02, 1.0),
                    scale: Scale::Linear,
                    search: Levels::new(0.01, 0.60, 0.01),
                    survey: Levels::new(0.05, 1.0, 0.05),
                },
                default: [0.04; 3],
            },
        },
        IOR,
        CONDUCTOR_ETA,
        CONDUCTOR_K,
        ALPHA,
        masking(&["correlated", "separable"]),
        Parameter {
            name: "fresnel",
            symbol: "F",
            role: Role::Variant,
            unit: "-",
            summary: "Fresnel term: schlick (f0), dielectric (ior) or conductor (eta, k).",
            kind: Kind::Choice { options: &["schlick", "dielectric", "conductor"] },
        },
    ],
    named: &[CHOSEN_CONDUCTOR],
    surveyed: &["f0", "roughness"],
    searched: &["f0", "roughness"],
    linear: &["diffuse", "specular"],
    build: |v: &Values| {
        let f0 = v.colour("f0");
        let fresnel = match v.choice("fresnel") {
            "dielectric" => [Fresnel::Dielectric { eta: v.number("ior") }; 3],
            "conductor" => conductor(v),
            _ => f0.map(|f0| Fresnel::Schlick { f0 }),
        };
        let alpha = v.number("roughness");
        let single = Microfacet {
            diffuse: v.colour("diffuse"),
            specular: v.colour("specular"),
            distribution: Distribution { shape: Shape::Ggx, alpha: [alpha; 2] },
            masking: masking_named(v.choice("masking")),
            fresnel,
        };
        Box::new(KullaConty::new(single))
    },
    vectors: Some(("kulla_conty", vector)),
    ..Model::BLANK
};

const ALPHA: Parameter = Parameter {
    name: "roughness",
    symbol: "α",
    summary: "Width of the lobe; the microfacet α, not squared.",
    ..ROUGHNESS_U
};

/// A lobe with what it loses given back.
struct KullaConty {
    single: Microfacet,
    albedo: Albedo,
    /// F̄ per channel.
    average: [f64; 3],
}

impl KullaConty {
    fn new(single: Microfacet) -> Self {
        let Microfacet { distribution, masking, .. } = single;
        let interface = Interface { alpha: distribution.alpha, masking, fresnel: Fresnel::None };
        let gauss = Gauss::new(32);
        let average = |fresnel: Fresnel| -> f64 {
            gauss.on(0.0, 1.0).map(|(c, weight)| 2.0 * c * weight * fresnel.reflectance(c)).sum()
        };
        Self { single, albedo: Albedo::new(interface), average: single.fresnel.map(average) }
    }
}

impl Lobe for KullaConty {
    fn diffuse(&self) -> [f64; 3] {
        self.single.diffuse
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let one = T::one();
        let mean = self.albedo.average::<T>();
        let lost = (one - self.albedo.at(&g.wi)) * (one - self.albedo.at(&g.wo));
        // A mirror loses nothing but rounding errors.
        let lost = T::of(FRAC_1_PI) * lost / (one - mean).max(T::of(1e-5));
        let single = Lobe::specular(&self.single, g);
        std::array::from_fn(|c| {
            let fresnel = T::of(self.average[c]);
            let colour = fresnel * fresnel * mean / (one - fresnel * (one - mean));
            single[c] + T::of(self.single.specular[c]) * lost * colour
        })
    }

    fn sampling(&self) -> Option<Sampling> {
        let kept: f64 = self.albedo.average::<f32>().into();
        let scale = mean(std::array::from_fn(|c| self.single.specular[c] * self.average[c]));
        Sampling::mixture([
            (scale * kept, Technique::HalfVector(self.single.distribution)),
            (scale * (1.0 - kept).max(0.0), Technique::Cosine),
        ])
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let single = Microfacet {
        diffuse: [p.number_or("kd", 0.0)?; 3],
        specular: [p.number_or("ks", 1.0)?; 3],
        distribution: Distribution { shape: Shape::Ggx, alpha: [p.number("alpha")?; 2] },
        masking: match p.text("g")? {
            "smith_sep" => Masking::Separable,
            "smith_hc" => Masking::Correlated,
            _ => return None,
        },
        fresnel: [p.fresnel()?; 3],
    };
    Some(Box::new(KullaConty::new(single)))
}
