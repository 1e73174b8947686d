//! Cook & Torrance (1982), *A Reflectance Model for Computer Graphics*: Beckmann's distribution, V-groove masking, exact
//! Fresnel reflectance, beside a Lambert term.
//!
//! With `D = exp(−tan² θ_h/m²)/(π m² cos⁴ θ_h)` and `G = min(1, 2 cos θ_h cos θ_o/cos_d, 2 cos θ_h cos θ_i/cos_d)`:
//!
//! | variant | f | source |
//! |---|---|---|
//! | `modern` | `k_s F D G/(4 cos θ_i cos θ_o)` | Torrance & Sparrow 1967; Walter *et al.* 2007, eq. 20 |
//! | `1982` | `k_s F (π D) G/(π cos θ_i cos θ_o)` | Cook & Torrance 1982, whose D has no 1/π: 4 times `modern` |
//! | `pi` | `k_s F D G/(π cos θ_i cos θ_o)` | Ngan *et al.* 2005: 4/π times `modern` |
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the Lambert term | 0.5 |
//! | `specular` | scale of the lobe, k_s; 1 is physical in `modern` | 1 |
//! | `fresnel` | `dielectric`, `conductor` or `schlick` | dielectric |
//! | `ior`, `eta` and `k`, `f0` | what the Fresnel term needs: only the chosen one's are read | 1.5, iridium, 0.04 |
//! | `roughness` | m, root mean square of the facets' slopes: the microfacet α | 0.2 |
//! | `variant` | normalisation | modern |
//!
//! The catalogue's [`beckmann`](super::beckmann) has Smith's masking instead, and anisotropy.
//!
//! Presets: `ngan-NAME` (Ngan *et al.* 2005, `pi` with `schlick`) and `low-NAME` (Löw *et al.* 2012, `1982` with `dielectric`,
//! logarithmic metric).
//!
//! Known defects: `1982` reflects four times what arrives. The V-groove has edges that show as lines in highlights at grazing
//! angles. The Lambert term is not coupled to the interface.

use crate::Bsdf;
use crate::conformance::Parameters;
use crate::distribution::{Distribution, Shape};
use crate::masking::Masking;
use crate::microfacet::Microfacet;
use crate::model::Model;
use crate::models::shared::*;
use crate::parameter::{Interval, Kind, Parameter, Range, Role};
use crate::presets;

use std::f64::consts::PI;

/// The description of the model.
pub static MODEL: Model = Model {
    name: "cook-torrance",
    title: "Cook–Torrance",
    summary: "Rough dielectric or metal with Gaussian slopes in V-grooves above a Lambert term.",
    reference: "Cook & Torrance 1982; Torrance & Sparrow 1967",
    largest_albedo: 2.0,
    parameters: &[
        DIFFUSE,
        SPECULAR_SCALE,
        Parameter {
            name: "fresnel",
            symbol: "F",
            role: Role::Variant,
            unit: "-",
            summary: "Fresnel term: dielectric (reads ior), conductor (eta, k) or schlick (f0).",
            kind: Kind::Choice { options: &["dielectric", "conductor", "schlick"] },
        },
        IOR,
        CONDUCTOR_ETA,
        CONDUCTOR_K,
        F0,
        SLOPE,
        Parameter {
            name: "variant",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "Normalisation: modern, 1982 (literal, 4 times as bright) or pi (Ngan et al. 2005).",
            kind: Kind::Choice { options: &["modern", "1982", "pi"] },
        },
    ],
    named: &[CHOSEN_CONDUCTOR],
    surveyed: &["ior", "roughness"],
    searched: &["specular", "ior", "roughness"],
    linear: &["diffuse", "specular"],
    presets: presets::cook_torrance,
    build: |v| {
        let over_modern = match v.choice("variant") {
            "1982" => 4.0,
            "pi" => 4.0 / PI,
            _ => 1.0,
        };
        Box::new(Microfacet {
            diffuse: v.colour("diffuse"),
            specular: v.colour("specular").map(|s| s * over_modern),
            distribution: beckmann(v.number("roughness")),
            masking: Masking::VGroove,
            fresnel: fresnel(v),
        })
    },
    vectors: Some(("cook_torrance_1982", vector)),
    ..Model::BLANK
};

/// Width of the lobe; published fits go beyond 1.
const SLOPE: Parameter = Parameter {
    name: "roughness",
    symbol: "m",
    summary: "Root mean square of the facets' slopes; the microfacet α, not squared.",
    kind: match ROUGHNESS_U.kind {
        Kind::Number { range, default } => {
            Kind::Number { range: Range { valid: Interval::closed(0.001, 3.0), ..range }, default }
        }
        other => other,
    },
    ..ROUGHNESS_U
};

fn beckmann(m: f64) -> Distribution {
    Distribution { shape: Shape::Beckmann, alpha: [m; 2] }
}

/// The BSDF of a conformance vector: the variant `1982`.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    Some(Box::new(Microfacet {
        diffuse: [p.number_or("kd", 0.0)?; 3],
        specular: [4.0 * p.number_or("ks", 1.0)?; 3],
        distribution: beckmann(p.number("m")?),
        masking: Masking::VGroove,
        fresnel: [p.fresnel()?; 3],
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;

    fn value(variant: &str) -> f64 {
        let text = format!("cook-torrance:diffuse=0,roughness=0.3,variant={variant}");
        Material::parse(&text).unwrap().bsdf().evaluate([0.6, 0.0, 0.8], [-0.5, 0.1, 0.74f64.sqrt()])[0]
    }

    #[test]
    fn variants_differ_by_constants() {
        assert!((value("1982") / value("modern") - 4.0).abs() < 1e-12);
        assert!((value("pi") / value("modern") - 4.0 / PI).abs() < 1e-12);
    }

    #[test]
    fn the_modern_form_is_beckmann_in_v_grooves() {
        let text = "beckmann:diffuse=0,roughness=0.3,masking=v-groove";
        let other =
            Material::parse(text).unwrap().bsdf().evaluate([0.6, 0.0, 0.8], [-0.5, 0.1, 0.74f64.sqrt()]);
        assert_eq!(value("modern"), other[0]);
    }
}
