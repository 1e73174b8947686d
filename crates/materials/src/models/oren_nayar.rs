//! Oren–Nayar: diffuse reflection of a rough surface made of Lambertian facets, in its four usual forms.
//!
//! With α the larger and β the smaller of the two polar angles, φ the difference of azimuths, `s = ω_i·ω_o − cos θ_i cos θ_o`,
//! and `t = max(cos θ_i, cos θ_o)` where s > 0, else 1:
//!
//! | variant | f | roughness | source |
//! |---|---|---|---|
//! | `qualitative` | `ρ/π (A + B max(0, cos φ) sin α tan β)` | `sigma` | Oren & Nayar 1994, qualitative model |
//! | `full` | `ρ/π (C₁ + cos φ C₂ tan β + (1 − |cos φ|) C₃ tan((α + β)/2))`, and a second bounce | `sigma` | the same, functional approximation |
//! | `fujii` | `ρ (1 + r s/t)/(π + (π/2 − 2/3) r)` | `roughness` | Fujii, *A tiny improvement of Oren–Nayar* |
//! | `eon` | the same with light of all further bounces | `roughness` | Portsmouth *et al.* 2025, *EON* |
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the facets, ρ | 0.5 |
//! | `sigma` | standard deviation of the facets' angles, radians; read by `qualitative` and `full` | 0.35 (20°) |
//! | `roughness` | r, 0 to 1; read by `fujii` and `eon` | 0.5 |
//! | `variant` | the form | qualitative |
//!
//! Both are Lambert's at 0. `qualitative` is the default because renderers mean it by this name; `eon` is the one to prefer
//! where energy matters: a white surface reflects all light at every roughness.
//!
//! Deviations: `full` is not let below 0, which it reaches at opposite grazing angles from σ = 0.67 on. Directional albedos of
//! `eon` are the exact ones, not their polynomial approximation.
//!
//! Known defects: `qualitative` and `full` darken with σ (at normal incidence to 0.70 and 0.84 of ρ = 1 for σ = 0.7) and exceed an
//! albedo of 1 at grazing angles, by 1 % and 4 % at most; `qualitative` has an edge where cos φ changes its sign.

use std::f64::consts::FRAC_PI_2;

use crate::conformance::Parameters;
use crate::model::Model;
use crate::models::shared::DIFFUSE;
use crate::oren_nayar::{Eon, Fujii, Full, Qualitative};
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};
use crate::sampling::Technique;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "oren-nayar",
    title: "Oren–Nayar",
    summary: "Diffuse reflection of rough surfaces: plaster, clay, cloth, the moon.",
    reference: "Oren & Nayar 1994; Fujii; Portsmouth et al. 2025",
    has_fresnel: false,
    largest_albedo: 1.05,
    parameters: &[
        Parameter { role: Role::BaseColour, summary: "Albedo of the facets, linear RGB.", ..DIFFUSE },
        Parameter {
            name: "sigma",
            symbol: "σ",
            role: Role::DiffuseRoughness,
            unit: "rad",
            summary: "Standard deviation of the facets' angles, for the variants qualitative and full.",
            kind: Kind::Number {
                range: Range {
                    valid: Interval::closed(0.0, FRAC_PI_2),
                    plausible: Interval::closed(0.0, 0.8),
                    scale: Scale::Linear,
                    search: Levels::new(0.0, 1.0, 0.02),
                    survey: Levels::new(0.0, 0.8, 0.05),
                },
                default: 0.35,
            },
        },
        Parameter {
            name: "roughness",
            symbol: "r",
            role: Role::DiffuseRoughness,
            unit: "1",
            summary: "Roughness from 0 to 1, for the variants fujii and eon.",
            kind: Kind::Number {
                range: Range {
                    valid: Interval::closed(0.0, 1.0),
                    plausible: Interval::closed(0.0, 1.0),
                    scale: Scale::Linear,
                    search: Levels::new(0.0, 1.0, 0.02),
                    survey: Levels::new(0.0, 1.0, 0.05),
                },
                default: 0.5,
            },
        },
        Parameter {
            name: "variant",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "Form: qualitative and full (read sigma), fujii and eon (read roughness).",
            kind: Kind::Choice { options: &["qualitative", "full", "fujii", "eon"] },
        },
    ],
    surveyed: &["diffuse", "sigma"],
    searched: &["diffuse", "sigma"],
    linear: &["diffuse"],
    build: |v| {
        let variant = variant(v.choice("variant")).unwrap_or(Variant::Qualitative);
        let roughness = v.number(if variant.reads_sigma() { "sigma" } else { "roughness" });
        Box::new(OrenNayar::new(v.colour("diffuse"), variant, roughness))
    },
    vectors: Some(("oren_nayar", vector)),
    ..Model::BLANK
};

/// Which form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// The article's simplified form.
    Qualitative,
    /// The article's functional approximation, with interreflection.
    Full,
    /// Fujii's reformulation.
    Fujii,
    /// The energy-preserving form.
    Eon,
}

impl Variant {
    fn reads_sigma(self) -> bool {
        matches!(self, Self::Qualitative | Self::Full)
    }
}

fn variant(name: &str) -> Option<Variant> {
    match name {
        "qualitative" => Some(Variant::Qualitative),
        "full" => Some(Variant::Full),
        "fujii" => Some(Variant::Fujii),
        "eon" => Some(Variant::Eon),
        _ => None,
    }
}

/// A rough surface of Lambertian facets.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    /// Albedo of the facets per channel.
    colour: [f64; 3],
    form: Form,
}

#[derive(Clone, Copy, Debug)]
enum Form {
    Qualitative(Qualitative),
    Full(Full),
    Fujii(Fujii),
    Eon(Eon),
}

impl OrenNayar {
    /// A surface of a colour, with σ in radians or r, as the form has it.
    pub fn new(colour: [f64; 3], variant: Variant, roughness: f64) -> Self {
        let form = match variant {
            Variant::Qualitative => Form::Qualitative(Qualitative::new(roughness)),
            Variant::Full => Form::Full(Full::new(roughness)),
            Variant::Fujii => Form::Fujii(Fujii::new(roughness)),
            Variant::Eon => Form::Eon(Eon::new(1.0, colour, roughness)),
        };
        Self { colour, form }
    }
}

impl Lobe for OrenNayar {
    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let coloured = |white: T| self.colour.map(|c| T::of(c) * white);
        match self.form {
            Form::Qualitative(form) => coloured(form.at(g)),
            Form::Full(form) => form.at(g, self.colour),
            Form::Fujii(form) => coloured(form.at(g)),
            Form::Eon(form) => form.at(g),
        }
    }

    fn sampling(&self) -> Option<Sampling> {
        Sampling::mixture([(self.colour.into_iter().sum(), Technique::Cosine)])
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let variant = variant(p.text("variant")?)?;
    let roughness = p.number(if variant.reads_sigma() { "sigma" } else { "r" })?;
    Some(Box::new(OrenNayar::new([p.number("kd")?; 3], variant, roughness)))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_1_PI;

    use super::*;

    fn lobe(variant: Variant, roughness: f64) -> OrenNayar {
        OrenNayar::new([1.0; 3], variant, roughness)
    }

    #[test]
    fn a_smooth_surface_is_lamberts() {
        for variant in [Variant::Qualitative, Variant::Full, Variant::Fujii, Variant::Eon] {
            let f = lobe(variant, 0.0).evaluate([0.6, 0.0, 0.8], [-0.5, 0.1, 0.74f64.sqrt()]);
            assert!((f[0] - FRAC_1_PI).abs() < 1e-12, "{variant:?}: {f:?}");
        }
    }
}
