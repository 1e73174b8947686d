//! Parameters that several models share, word for word.

use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::masking::Masking;
use crate::model::{Alias, Values};
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};

const UNIT: Interval = Interval::closed(0.0, 1.0);

pub(super) const DIFFUSE: Parameter = Parameter {
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

pub(super) const ROUGHNESS_U: Parameter =
    roughness("roughness_u", "R_u", "Width of the lobe along the tangent; the microfacet α, not squared.");
pub(super) const ROUGHNESS_V: Parameter =
    roughness("roughness_v", "R_v", "Width of the lobe along the bitangent; the microfacet α, not squared.");

/// `roughness` sets both widths.
pub(super) const ROUGHNESS: Alias = Alias { name: "roughness", parameters: &["roughness_u", "roughness_v"] };

/// A scale of the specular lobe that is physically 0 (no lobe) or 1 (the Fresnel reflectance as it is).
pub(super) const SPECULAR_SWITCH: Parameter = Parameter {
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

/// Index of refraction of a dielectric against air.
pub(super) const IOR: Parameter = Parameter {
    name: "ior",
    symbol: "I",
    role: Role::RefractiveIndex,
    unit: "1",
    summary: "Index of refraction, inside over outside.",
    kind: Kind::Number {
        range: Range {
            valid: Interval::open_below(1.0, 100.0),
            plausible: Interval::open_below(1.0, 1.85),
            scale: Scale::Linear,
            search: Levels::new(1.01, 1.85, 0.01),
            survey: Levels::new(1.05, 1.85, 0.05),
        },
        default: 1.5,
    },
};

/// A conductor's complex index, per channel. The default is iridium (Roberts), the metal of the paper's 5.1.
const fn complex_index(
    (name, symbol, role): (&'static str, &'static str, Role),
    valid: Interval,
    default: [f64; 3],
    summary: &'static str,
) -> Parameter {
    Parameter {
        name,
        symbol,
        role,
        unit: "1",
        summary,
        kind: Kind::Colour {
            range: Range {
                valid,
                plausible: Interval::closed(0.05, 8.0),
                scale: Scale::Linear,
                search: Levels::new(0.05, 8.0, 0.05),
                survey: Levels::new(0.5, 8.0, 0.5),
            },
            default,
        },
    }
}

pub(super) const CONDUCTOR_ETA: Parameter = complex_index(
    ("eta", "η", Role::ConductorIndex),
    Interval::open_below(0.0, 100.0),
    [2.501, 2.114, 1.705],
    "Real part of the complex index of refraction, per channel; the default is iridium.",
);
pub(super) const CONDUCTOR_K: Parameter = complex_index(
    ("k", "k", Role::Extinction),
    Interval::closed(0.0, 100.0),
    [5.183, 4.670, 3.910],
    "Extinction coefficient (imaginary part of the index), per channel; the default is iridium.",
);

/// A choice of masking functions, the default first.
pub(super) const fn masking(options: &'static [&'static str]) -> Parameter {
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
pub(super) fn masking_named(name: &str) -> Masking {
    match name {
        "correlated" => Masking::Correlated,
        "separable-rational" => Masking::SeparableRational,
        "correlated-rational" => Masking::CorrelatedRational,
        "v-groove" => Masking::VGroove,
        _ => Masking::Separable,
    }
}

/// The distribution of a model with `roughness_u` and `roughness_v`.
pub(super) fn distribution(shape: Shape, v: &Values) -> Distribution {
    Distribution { shape, alpha: [v.number("roughness_u"), v.number("roughness_v")] }
}

/// The Fresnel term of a model with `eta` and `k`.
pub(super) fn conductor(v: &Values) -> [Fresnel; 3] {
    let (eta, k) = (v.colour("eta"), v.colour("k"));
    std::array::from_fn(|c| Fresnel::Conductor { eta: eta[c], k: k[c] })
}

/// A number from 0 to 1.
pub(super) const fn share(
    (name, symbol, role): (&'static str, &'static str, Role),
    default: f64,
    summary: &'static str,
) -> Parameter {
    let range = Range {
        valid: UNIT,
        plausible: UNIT,
        scale: Scale::Linear,
        search: Levels::new(0.0, 1.0, 0.05),
        survey: Levels::new(0.0, 1.0, 0.1),
    };
    Parameter { name, symbol, role, unit: "1", summary, kind: Kind::Number { range, default } }
}

/// A linear RGB colour, 0 to 1 per channel.
pub(super) const fn tint(
    (name, symbol, role): (&'static str, &'static str, Role),
    default: [f64; 3],
    summary: &'static str,
) -> Parameter {
    let range = Range {
        valid: UNIT,
        plausible: UNIT,
        scale: Scale::Linear,
        search: Levels::new(0.0, 1.0, 0.05),
        survey: Levels::new(0.0, 1.0, 0.1),
    };
    Parameter { name, symbol, role, unit: "1", summary, kind: Kind::Colour { range, default } }
}

/// Roughness whose square is the microfacet α, from 0 to 1.
pub(super) const fn perceptual_roughness(
    (name, symbol, role): (&'static str, &'static str, Role),
    default: f64,
    summary: &'static str,
) -> Parameter {
    let range = Range {
        valid: UNIT,
        plausible: Interval::closed(0.1, 0.84),
        scale: Scale::Linear,
        search: Levels::new(0.10, 0.84, 0.01),
        survey: Levels::new(0.10, 0.82, 0.04),
    };
    Parameter { name, symbol, role, unit: "1", summary, kind: Kind::Number { range, default } }
}

/// Index of refraction of a layer, 1 or more.
pub(super) const fn layer_ior(
    (name, symbol, role): (&'static str, &'static str, Role),
    default: f64,
    summary: &'static str,
) -> Parameter {
    let range = Range {
        valid: Interval::closed(1.0, 100.0),
        plausible: Interval::closed(1.0, 2.5),
        scale: Scale::Linear,
        search: Levels::new(1.04, 3.48, 0.04),
        survey: Levels::new(1.1, 2.0, 0.05),
    };
    Parameter { name, symbol, role, unit: "1", summary, kind: Kind::Number { range, default } }
}
