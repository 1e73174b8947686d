//! GGX conductor: a rough metal, `f = k_s F D G / (4 cos θ_i cos θ_o)` with the exact Fresnel reflectance of a complex
//! index per channel (Walter *et al.* 2007; Heitz 2014). No diffuse term.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `specular` | scale of the lobe; 1 is physical | 1 |
//! | `eta`, `k` (`conductor` sets both) | complex index of refraction, per channel | iridium |
//! | `roughness_u`, `roughness_v` (`roughness` sets both) | α along tangent and bitangent (not squared) | 0.2 |
//! | `masking` | `separable` (Walter) or `correlated` (Heitz 2014) | separable |
//!
//! Known defect: light that bounces between microfacets is lost (up to a third at α = 1).

use crate::distribution::Shape;
use crate::microfacet::Microfacet;
use crate::model::{Model, Values};
use crate::models::shared::*;

/// The description of the model.
pub static MODEL: Model = Model {
    name: "ggx-conductor",
    title: "GGX conductor",
    summary: "Rough metal with the long-tailed GGX distribution.",
    reference: "Walter et al. 2007, eq. 20, 33, 34; Heitz 2014, eq. 85-87",
    has_fresnel: true,
    is_reciprocal: true,
    parameters: &[
        SPECULAR_SWITCH,
        CONDUCTOR_ETA,
        CONDUCTOR_K,
        ROUGHNESS_U,
        ROUGHNESS_V,
        masking(&["separable", "correlated"]),
    ],
    aliases: &[ROUGHNESS],
    named: &[CONDUCTOR],
    surveyed: &["roughness"],
    searched: &["roughness"],
    linear: &["specular"],
    build: |v| Box::new(metal(Shape::Ggx, v)),
    ..Model::BLANK
};

/// The lobe of a metal with any distribution.
pub(super) fn metal(shape: Shape, v: &Values) -> Microfacet {
    Microfacet {
        diffuse: [0.0; 3],
        specular: v.colour("specular"),
        distribution: distribution(shape, v),
        masking: masking_named(v.choice("masking")),
        fresnel: conductor(v),
    }
}
