//! Beckmann conductor: the paper's "Cook–Torrance", a rough metal with Gaussian slopes (Walter *et al.* 2007, eq. 20,
//! 25-27), as Mitsuba 0.6's `roughconductor` evaluates it by default. No diffuse term.

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
    build: |v| Box::new(metal(Shape::Beckmann, v)),
    ..Model::BLANK
};
