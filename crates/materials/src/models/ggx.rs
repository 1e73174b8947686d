//! GGX plastic: a rough dielectric interface above a Lambert term.
//!
//! `f = k_d/π + k_s F D G / (4 cos θ_i cos θ_o)` with the GGX distribution of Walter *et al.* (2007), anisotropic as in
//! Heitz (2014), and the exact dielectric Fresnel reflectance.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the Lambert term, k_d | 0.5 |
//! | `specular` | scale of the lobe; 1 is physical | 1 |
//! | `ior` | index of refraction, inside over outside | 1.5 |
//! | `roughness_u`, `roughness_v` | α along tangent and bitangent (not squared) | 0.2 |
//! | `masking` | `separable` (Walter, Mitsuba 0.6, the paper) or `correlated` (Heitz 2014) | separable |
//! | `fresnel` | `dielectric`, or `none`: a constant reflectance `specular`, what material distillers write | dielectric |
//!
//! Known defects: the Lambert term is not coupled to the interface (light reflected there is not taken from it), and
//! light that bounces between microfacets is lost.

use crate::distribution::Shape;
use crate::fresnel::Fresnel;
use crate::microfacet::Microfacet;
use crate::model::{Model, Values};
use crate::models::shared::*;
use crate::parameter::{Kind, Parameter, Role};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "ggx",
    title: "GGX plastic",
    summary: "Rough dielectric with the long-tailed GGX distribution above a Lambert term.",
    reference: "Walter et al. 2007, eq. 20, 33, 34; Heitz 2014, eq. 85-87",
    has_fresnel: true,
    is_reciprocal: true,
    // The interface alone stays below 1; an uncoupled Lambert term of albedo near 1 is added to it.
    largest_albedo: 2.0,
    parameters: &[
        DIFFUSE,
        SPECULAR_SWITCH,
        IOR,
        ROUGHNESS_U,
        ROUGHNESS_V,
        masking(&["separable", "correlated"]),
        FRESNEL,
    ],
    aliases: &[ROUGHNESS],
    surveyed: &["ior", "roughness"],
    searched: &["specular", "ior", "roughness"],
    linear: &["diffuse", "specular"],
    build: |v| Box::new(plastic(Shape::Ggx, v)),
    ..Model::BLANK
};

/// The choice between a real interface and a constant reflectance.
pub(super) const FRESNEL: Parameter = Parameter {
    name: "fresnel",
    symbol: "F",
    role: Role::Variant,
    unit: "-",
    summary: "dielectric, or none: reflectance equal to `specular` at every angle.",
    kind: Kind::Choice { options: &["dielectric", "none"] },
};

/// The lobe of a plastic with any distribution.
pub(super) fn plastic(shape: Shape, v: &Values) -> Microfacet {
    let fresnel = match v.choice("fresnel") {
        "none" => Fresnel::None,
        _ => Fresnel::Dielectric { eta: v.number("ior") },
    };
    Microfacet {
        diffuse: v.colour("diffuse"),
        specular: v.colour("specular"),
        distribution: distribution(shape, v),
        masking: masking_named(v.choice("masking")),
        fresnel: [fresnel; 3],
    }
}
