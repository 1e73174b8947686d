//! Parameters of classic models: a Lambert term, and lobes with a scale and a width.

use super::UNIT;
use crate::distribution::{Distribution, Shape};
use crate::masking::Masking;
use crate::model::{Alias, Values};
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};

pub(in crate::models) const DIFFUSE: Parameter = Parameter {
    name: "diffuse",
    symbol: "D",
    role: Role::DiffuseReflectance,
    unit: "1",
    summary: "Albedo of the Lambert term, linear RGB.",
    kind: Kind::Colour {
        range: Range {
            valid: UNIT,
            plausible: UNIT,
            scale: Scale::Linear,
            search: Levels::new(0.0, 1.0, 0.05),
            survey: Levels::new(0.0, 1.0, 0.1),
        },
        default: [0.5; 3],
    },
};

/// Reflectance of a lobe without Fresnel effect.
pub(in crate::models) const SPECULAR: Parameter = Parameter {
    name: "specular",
    symbol: "S",
    role: Role::SpecularReflectance,
    unit: "1",
    summary: "Specular reflectance, linear RGB.",
    kind: Kind::Colour {
        range: Range {
            valid: UNIT,
            plausible: Interval::closed(0.0, 0.4),
            scale: Scale::Linear,
            search: Levels::new(0.0, 0.40, 0.01),
            survey: Levels::new(0.02, 0.40, 0.02),
        },
        default: [0.1; 3],
    },
};

/// A free scale of a lobe with a Fresnel term, as published fits have it.
pub(in crate::models) const SPECULAR_SCALE: Parameter = Parameter {
    name: "specular",
    symbol: "S",
    role: Role::SpecularReflectance,
    unit: "1",
    summary: "Scale of the specular lobe: 0 is diffuse only, 1 is physical; published fits go beyond.",
    kind: Kind::Colour {
        range: Range {
            valid: Interval::closed(0.0, 10.0),
            plausible: UNIT,
            scale: Scale::Linear,
            search: Levels::new(0.0, 1.0, 1.0),
            survey: Levels::new(1.0, 1.0, 1.0),
        },
        default: [1.0; 3],
    },
};

/// A scale of the specular lobe that is physically 0 (no lobe) or 1 (the Fresnel reflectance as it is).
pub(in crate::models) const SPECULAR_SWITCH: Parameter = Parameter {
    name: "specular",
    symbol: "S",
    role: Role::SpecularReflectance,
    unit: "1",
    summary: "Scale of the specular lobe: 0 is diffuse only, 1 is physical.",
    kind: Kind::Colour {
        range: Range {
            valid: UNIT,
            plausible: UNIT,
            scale: Scale::Linear,
            search: Levels::new(0.0, 1.0, 1.0),
            survey: Levels::new(1.0, 1.0, 1.0),
        },
        default: [1.0; 3],
    },
};

/// Width of the lobe, α itself (not squared), along one axis.
const fn roughness(name: &'static str, symbol: &'static str, summary: &'static str) -> Parameter {
    Parameter {
        name,
        symbol,
        role: Role::Roughness,
        unit: "1",
        summary,
        kind: Kind::Number {
            range: Range {
                valid: Interval::closed(0.001, 1.0),
                plausible: Interval::open_below(0.0, 0.7),
                scale: Scale::Linear,
                search: Levels::new(0.01, 0.70, 0.01),
                survey: Levels::new(0.01, 0.69, 0.02),
            },
            default: 0.2,
        },
    }
}

pub(in crate::models) const ROUGHNESS_U: Parameter =
    roughness("roughness_u", "R_u", "Width of the lobe along the tangent; the microfacet α, not squared.");
pub(in crate::models) const ROUGHNESS_V: Parameter =
    roughness("roughness_v", "R_v", "Width of the lobe along the bitangent; the microfacet α, not squared.");

/// `roughness` sets both widths.
pub(in crate::models) const ROUGHNESS: Alias =
    Alias { name: "roughness", parameters: &["roughness_u", "roughness_v"] };

/// Where the power of a cosine may lie.
pub(in crate::models) const EXPONENTS: Range = Range {
    valid: Interval::closed(0.0, 1e6),
    plausible: Interval::closed(1.0, 20_000.0),
    scale: Scale::Logarithmic,
    search: Levels::new(1.0, 20_000.0, 1.2),
    survey: Levels::new(1.0, 20_000.0, 1.4),
};

/// Narrowness of the lobe, the power of a cosine.
pub(in crate::models) const fn exponent(
    name: &'static str,
    symbol: &'static str,
    summary: &'static str,
) -> Parameter {
    Parameter {
        name,
        symbol,
        role: Role::Exponent,
        unit: "1",
        summary,
        kind: Kind::Number { range: EXPONENTS, default: 100.0 },
    }
}

/// The distribution of a model with `roughness_u` and `roughness_v`.
pub(in crate::models) fn distribution(shape: Shape, v: &Values) -> Distribution {
    Distribution { shape, alpha: [v.number("roughness_u"), v.number("roughness_v")] }
}

/// A choice of masking functions, the default first.
pub(in crate::models) const fn masking(options: &'static [&'static str]) -> Parameter {
    Parameter {
        name: "masking",
        symbol: "G",
        role: Role::Variant,
        unit: "-",
        summary: "Masking and shadowing: how G1 of light and view combine.",
        kind: Kind::Choice { options },
    }
}

/// The masking function behind its name.
pub(in crate::models) fn masking_named(name: &str) -> Masking {
    match name {
        "correlated" => Masking::Correlated,
        "separable-rational" => Masking::SeparableRational,
        "correlated-rational" => Masking::CorrelatedRational,
        "v-groove" => Masking::VGroove,
        _ => Masking::Separable,
    }
}
