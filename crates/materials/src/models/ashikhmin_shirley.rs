//! Ashikhmin–Shirley as the paper used it: Mitsuba 0.6's `roughconductor` with the distribution "as".
//!
//! `D = √((e_u + 2)(e_v + 2))/(2π) cos^e θ_h` with `e = 2/α² − 2` per axis, Smith masking borrowed from Beckmann (rational
//! fit), the exact Fresnel reflectance of a complex index, and the modern denominator `4 cos θ_i cos θ_o`. This is not the
//! BRDF of Ashikhmin & Shirley (2000), whose denominator is `cos_d · max(cos_i, cos_o)`.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `specular` | scale of the lobe; 1 is physical | 1 |
//! | `eta`, `k` (`conductor` sets both) | complex index of refraction, per channel | iridium |
//! | `roughness_u`, `roughness_v` (`roughness` sets both) | α along tangent and bitangent (not squared) | 0.2 |
//! | `masking` | `separable-rational` (Walter's fit), `separable`, `correlated`, `correlated-rational` or `v-groove` | separable-rational |
//!
//! Source: Mitsuba 0.6, `roughconductor`; Walter *et al.* 2007.
//!
//! Known defect: the borrowed masking does not belong to the distribution, so the directional albedo reaches 1.15 at
//! α = 0.8 and grazing angles.

use crate::distribution::Shape;
use crate::model::Model;
use crate::models::beckmann::MASKINGS;
use crate::models::ggx_conductor::metal;
use crate::models::shared::*;

/// The description of the model.
pub static MODEL: Model = Model {
    name: "as",
    title: "Ashikhmin–Shirley (as in the paper)",
    summary: "Rough metal with a power-of-cosine distribution, the paper's Ashikhmin-Shirley.",
    reference: "Ashikhmin & Shirley 2000 (distribution); Mitsuba 0.6 roughconductor; Guarnera et al. 2018, 5.1",
    has_fresnel: true,
    is_reciprocal: true,
    largest_albedo: 1.15,
    parameters: &[SPECULAR_SWITCH, CONDUCTOR_ETA, CONDUCTOR_K, ROUGHNESS_U, ROUGHNESS_V, masking(MASKINGS)],
    aliases: &[ROUGHNESS],
    named: &[CONDUCTOR],
    surveyed: &["roughness"],
    searched: &["roughness"],
    linear: &["specular"],
    build: |v| Box::new(metal(Shape::Phong, v)),
    ..Model::BLANK
};
