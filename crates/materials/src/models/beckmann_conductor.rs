//! Beckmann conductor: the paper's "Cook–Torrance", a rough metal with Gaussian slopes (Walter *et al.* 2007, eq. 20,
//! 25-27), as Mitsuba 0.6's `roughconductor` evaluates it by default. No diffuse term.
//!
//! `f = k_s F D G/(4 cos θ_i cos θ_o)` with `D = exp(−tan² θ_h/α²)/(π α² cos⁴ θ_h)` and the exact Fresnel reflectance of a complex
//! index per channel.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `specular` | scale of the lobe; 1 is physical | 1 |
//! | `eta`, `k` (`conductor` sets both) | complex index of refraction, per channel | iridium |
//! | `roughness_u`, `roughness_v` (`roughness` sets both) | α along tangent and bitangent (not squared) | 0.2 |
//! | `masking` | `separable-rational` (Walter's fit), `separable`, `correlated`, `correlated-rational` or `v-groove` | separable-rational |
//!
//! Known defect: light that bounces between microfacets is lost.

use crate::distribution::Shape;
use crate::model::Model;
use crate::models::beckmann::MASKINGS;
use crate::models::ggx_conductor::metal;
use crate::models::shared::*;

/// The description of the model.
pub static MODEL: Model = Model {
    name: "beckmann-conductor",
    title: "Beckmann conductor",
    summary: "Rough metal with Gaussian slopes: the modern Cook-Torrance.",
    reference: "Cook & Torrance 1982; Walter et al. 2007, eq. 20, 25-27",
    has_fresnel: true,
    is_reciprocal: true,
    parameters: &[SPECULAR_SWITCH, CONDUCTOR_ETA, CONDUCTOR_K, ROUGHNESS_U, ROUGHNESS_V, masking(MASKINGS)],
    aliases: &[ROUGHNESS],
    named: &[CONDUCTOR],
    surveyed: &["roughness"],
    searched: &["roughness"],
    linear: &["specular"],
    build: |v| Box::new(metal(Shape::Beckmann, v)),
    ..Model::BLANK
};
