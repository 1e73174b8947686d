//! Beckmann plastic: as the [GGX plastic](super::ggx) with the Gaussian-slope distribution of Beckmann.
//!
//! `f = k_d/π + k_s F D G/(4 cos θ_i cos θ_o)` with `D = exp(−tan² θ_h/α²)/(π α² cos⁴ θ_h)` (Walter *et al.* 2007, eq. 20, 25-27).
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the Lambert term, k_d | 0.5 |
//! | `specular` | scale of the lobe; 1 is physical | 1 |
//! | `ior` | index of refraction, inside over outside | 1.5 |
//! | `roughness_u`, `roughness_v` (`roughness` sets both) | α along tangent and bitangent (not squared) | 0.2 |
//! | `masking` | `separable-rational` (Walter's fit), `separable`, `correlated`, `correlated-rational` or `v-groove` | separable-rational |
//! | `fresnel` | `dielectric`, or `none`: a constant reflectance `specular` | dielectric |
//!
//! The masking `separable-rational` is Walter's rational fit of Beckmann's G1, as Mitsuba 0.6 (the paper's renderer)
//! evaluates it; `separable` and `correlated` use the exact one.
//!
//! Known defects: those of the GGX plastic.

use crate::distribution::Shape;
use crate::model::Model;
use crate::models::ggx::{FRESNEL, plastic};
use crate::models::shared::*;

/// The masking functions of a Beckmann-like distribution.
pub(super) const MASKINGS: &[&str] =
    &["separable-rational", "separable", "correlated", "correlated-rational", "v-groove"];

/// The description of the model.
pub static MODEL: Model = Model {
    name: "beckmann",
    title: "Beckmann plastic",
    summary: "Rough dielectric with Gaussian slopes (Cook-Torrance) above a Lambert term.",
    reference: "Beckmann & Spizzichino 1963; Cook & Torrance 1982; Walter et al. 2007, eq. 20, 25-27",
    has_fresnel: true,
    is_reciprocal: true,
    // The interface alone stays below 1; an uncoupled Lambert term of albedo near 1 is added to it.
    largest_albedo: 2.0,
    parameters: &[DIFFUSE, SPECULAR_SWITCH, IOR, ROUGHNESS_U, ROUGHNESS_V, masking(MASKINGS), FRESNEL],
    aliases: &[ROUGHNESS],
    surveyed: &["ior", "roughness"],
    searched: &["specular", "ior", "roughness"],
    linear: &["diffuse", "specular"],
    build: |v| Box::new(plastic(Shape::Beckmann, v)),
    ..Model::BLANK
};
