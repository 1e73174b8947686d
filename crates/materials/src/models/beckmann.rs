//! Beckmann plastic: as the [GGX plastic](super::ggx) with the Gaussian-slope distribution of Beckmann.
//!
//! The masking `separable-rational` is Walter's rational fit of Beckmann's G1, as Mitsuba 0.6 (the paper's renderer)
//! evaluates it; `separable` and `correlated` use the exact one.

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
    // The interface alone does; an uncoupled Lambert term of albedo near 1 goes above.
    largest_albedo: 2.0,
    parameters: &[DIFFUSE, SPECULAR_SWITCH, IOR, ROUGHNESS_U, ROUGHNESS_V, masking(MASKINGS), FRESNEL],
    aliases: &[ROUGHNESS],
    surveyed: &["ior", "roughness"],
    searched: &["specular", "ior", "roughness"],
    build: |v| Box::new(plastic(Shape::Beckmann, v)),
    ..Model::BLANK
};
