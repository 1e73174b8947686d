//! Parameters of principled and layered models.

use super::{UNIT, unit_colour, unit_number};
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};

/// Colour of the diffuse reflection of a dielectric and of the reflectance of a metal.
pub(in crate::models) const BASE_COLOR: Parameter = unit_colour(
    ("base_color", "C", Role::BaseColour),
    [0.5; 3],
    "Colour of the diffuse reflection and of the metal, linear RGB.",
);

/// Share of the metal.
pub(in crate::models) const METALLIC: Parameter =
    unit_number(("metallic", "M", Role::Metalness), 0.0, "0 for a dielectric, 1 for a metal.");

/// Roughness whose square is the microfacet α, from 0 to 1; search and survey reach from α = 0.01 to about 0.7.
pub(in crate::models) const fn perceptual_roughness(
    (name, symbol, role): (&'static str, &'static str, Role),
    default: f64,
    summary: &'static str,
) -> Parameter {
    let range = Range {
        valid: UNIT,
        plausible: Interval::closed(0.1, 0.84),
        scale: Scale::Linear,
        search: Levels::new(0.10, 0.84, 0.01),
        survey: Levels::new(0.10, 0.825, 0.025),
    };
    Parameter { name, symbol, role, unit: "1", summary, kind: Kind::Number { range, default } }
}

/// Roughness of the one lobe that a model has below its coat.
pub(in crate::models) const PERCEPTUAL_ROUGHNESS: Parameter = perceptual_roughness(
    ("roughness", "R", Role::PerceptualRoughness),
    0.5,
    "Roughness of the specular lobe; its square is the microfacet α.",
);

/// Where the index of refraction of a principled model may lie, in levels coarse enough for a search together with roughness.
pub(in crate::models) const INDICES: Range = Range {
    valid: Interval::closed(1.0, 100.0),
    plausible: Interval::open_below(1.0, 2.0),
    scale: Scale::Linear,
    search: Levels::new(1.02, 2.0, 0.02),
    survey: Levels::new(1.05, 2.0, 0.05),
};

/// The same for layered models, whose metals have no index: there, high ones stand for strong reflections.
pub(in crate::models) const LAYER_INDICES: Range = Range {
    plausible: Interval::closed(1.0, 2.5),
    search: Levels::new(1.04, 3.48, 0.04),
    survey: Levels::new(1.1, 2.0, 0.05),
    ..INDICES
};

/// Index of refraction of a dielectric or a layer, inside over outside.
pub(in crate::models) const fn index(
    (name, symbol, role): (&'static str, &'static str, Role),
    range: Range,
    default: f64,
    summary: &'static str,
) -> Parameter {
    Parameter { name, symbol, role, unit: "1", summary, kind: Kind::Number { range, default } }
}

/// Anisotropy of Burley's models.
pub(in crate::models) const ANISOTROPIC: Parameter = unit_number(
    ("anisotropic", "A", Role::Anisotropy),
    0.0,
    "How much longer the lobe is along the tangent: the aspect is √(1 − 0.9 anisotropic).",
);

/// Sheen of Burley's models.
pub(in crate::models) const SHEEN: Parameter = unit_number(
    ("sheen", "SH", Role::Sheen),
    0.0,
    "Reflection at grazing half angles that the diffuse reflection lacks, for cloth.",
);

pub(in crate::models) const SHEEN_TINT_SUMMARY: &str = "How far the sheen takes the base colour's hue.";

/// Clear coat of Burley's models.
pub(in crate::models) const CLEARCOAT: Parameter =
    unit_number(("clearcoat", "CC", Role::Coat), 0.0, "Second specular lobe, of a quarter of the weight.");

pub(in crate::models) const CLEARCOAT_GLOSS_SUMMARY: &str =
    "Gloss of the clear coat: its α goes from 0.1 to 0.001.";

pub(in crate::models) const COAT_ROUGHNESS_SUMMARY: &str =
    "Roughness of the clear coat; its square is the microfacet α.";
