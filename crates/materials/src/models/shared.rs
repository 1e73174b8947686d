//! Parameters that several models share, word for word.

use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::masking::Masking;
use crate::material::Value;
use crate::metals;
use crate::model::{Alias, Named, Values};
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

/// Reflectance of a lobe without Fresnel effect.
pub(super) const SPECULAR: Parameter = Parameter {
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
pub(super) const SPECULAR_SCALE: Parameter = Parameter {
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

/// Reflectance at normal incidence for Schlick's approximation.
pub(super) const F0: Parameter = Parameter {
    name: "f0",
    symbol: "F0",
    role: Role::NormalReflectance,
    unit: "1",
    summary: "Reflectance at normal incidence, linear RGB, for Schlick's Fresnel term.",
    kind: Kind::Colour {
        range: Range {
            valid: UNIT,
            plausible: UNIT,
            scale: Scale::Linear,
            search: Levels::new(0.0, 1.0, 0.02),
            survey: Levels::new(0.05, 0.95, 0.05),
        },
        default: [0.04; 3],
    },
};

/// Where the power of a cosine may lie.
pub(super) const EXPONENTS: Range = Range {
    valid: Interval::closed(0.0, 1e6),
    plausible: Interval::closed(1.0, 20_000.0),
    scale: Scale::Logarithmic,
    search: Levels::new(1.0, 20_000.0, 1.2),
    survey: Levels::new(1.0, 20_000.0, 1.4),
};

/// Narrowness of the lobe, the power of a cosine.
pub(super) const fn exponent(name: &'static str, symbol: &'static str, summary: &'static str) -> Parameter {
    Parameter {
        name,
        symbol,
        role: Role::Exponent,
        unit: "1",
        summary,
        kind: Kind::Number { range: EXPONENTS, default: 100.0 },
    }
}

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

/// `conductor` sets the complex index to a metal's.
pub(super) const CONDUCTOR: Named = Named {
    name: "conductor",
    parameters: &["eta", "k"],
    summary: "Complex index of a metal by its name, from the measurements of refractiveindex.info.",
    words: metals::names,
    look_up: |name| metals::by_name(name).map(|m| vec![Value::Colour(m.eta), Value::Colour(m.k)]),
};

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
pub(super) const fn unit_number(
    (name, symbol, role): (&'static str, &'static str, Role),
    default: f64,
    summary: &'static str,
) -> Parameter {
    Parameter {
        name,
        symbol,
        role,
        unit: "1",
        summary,
        kind: Kind::Number {
            range: Range {
                valid: UNIT,
                plausible: UNIT,
                scale: Scale::Linear,
                search: Levels::new(0.0, 1.0, 0.05),
                survey: Levels::new(0.05, 1.0, 0.05),
            },
            default,
        },
    }
}

/// A colour, each channel from 0 to 1.
pub(super) const fn unit_colour(
    (name, symbol, role): (&'static str, &'static str, Role),
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
                valid: UNIT,
                plausible: UNIT,
                scale: Scale::Linear,
                search: Levels::new(0.0, 1.0, 0.05),
                survey: Levels::new(0.1, 1.0, 0.1),
            },
            default,
        },
    }
}

/// Colour of the diffuse reflection of a dielectric and of the reflectance of a metal.
pub(super) const BASE_COLOR: Parameter = unit_colour(
    ("base_color", "C", Role::BaseColour),
    [0.5; 3],
    "Colour of the diffuse reflection and of the metal, linear RGB.",
);

/// Share of the metal.
pub(super) const METALLIC: Parameter =
    unit_number(("metallic", "M", Role::Metalness), 0.0, "0 for a dielectric, 1 for a metal.");

/// Square root of the microfacet α; search and survey reach from α = 0.01 to about 0.7.
pub(super) const PERCEPTUAL_ROUGHNESS: Parameter = Parameter {
    name: "roughness",
    symbol: "R",
    role: Role::PerceptualRoughness,
    unit: "1",
    summary: "Roughness of the specular lobe; its square is the microfacet α.",
    kind: Kind::Number {
        range: Range {
            valid: UNIT,
            plausible: Interval::closed(0.1, 0.84),
            scale: Scale::Linear,
            search: Levels::new(0.10, 0.84, 0.01),
            survey: Levels::new(0.10, 0.825, 0.025),
        },
        default: 0.5,
    },
};

/// Index of refraction of a principled model, in levels coarse enough for a search together with roughness.
pub(super) const fn principled_ior(name: &'static str, symbol: &'static str, valid: Interval) -> Parameter {
    Parameter {
        name,
        symbol,
        role: Role::RefractiveIndex,
        unit: "1",
        summary: "Index of refraction of the dielectric, inside over outside.",
        kind: Kind::Number {
            range: Range {
                valid,
                plausible: Interval::open_below(1.0, 2.0),
                scale: Scale::Linear,
                search: Levels::new(1.02, 2.0, 0.02),
                survey: Levels::new(1.05, 2.0, 0.05),
            },
            default: 1.5,
        },
    }
}

/// The mean of a colour's channels: what a part of a material reflects, roughly, for the shares of a sampling mixture.
pub(super) fn mean(colour: [f64; 3]) -> f64 {
    colour.iter().sum::<f64>() / 3.0
}

/// Anisotropy of Burley's models.
pub(super) const ANISOTROPIC: Parameter = unit_number(
    ("anisotropic", "A", Role::Anisotropy),
    0.0,
    "How much longer the lobe is along the tangent: the aspect is √(1 − 0.9 anisotropic).",
);

/// Sheen of Burley's models.
pub(super) const SHEEN: Parameter = unit_number(
    ("sheen", "SH", Role::Sheen),
    0.0,
    "Reflection at grazing half angles that the diffuse reflection lacks, for cloth.",
);

pub(super) const SHEEN_TINT_SUMMARY: &str = "How far the sheen takes the base colour's hue.";

/// Clear coat of Burley's models.
pub(super) const CLEARCOAT: Parameter =
    unit_number(("clearcoat", "CC", Role::Coat), 0.0, "Second specular lobe, of a quarter of the weight.");

pub(super) const CLEARCOAT_GLOSS_SUMMARY: &str = "Gloss of the clear coat: its α goes from 0.1 to 0.001.";

/// The Fresnel term of a model with the choice `fresnel` and a parameter for each.
pub(super) fn fresnel(v: &Values) -> [Fresnel; 3] {
    match v.choice("fresnel") {
        "dielectric" => [Fresnel::Dielectric { eta: v.number("ior") }; 3],
        "conductor" => conductor(v),
        "schlick" => v.colour("f0").map(|f0| Fresnel::Schlick { f0 }),
        _ => [Fresnel::None; 3],
    }
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
