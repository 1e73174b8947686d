//! Parameters of Fresnel terms: reflectances, indices, metals.

use super::UNIT;
use crate::fresnel::Fresnel;
use crate::material::Value;
use crate::metals;
use crate::model::{Named, Values};
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};

/// Reflectance at normal incidence for Schlick's approximation.
pub(in crate::models) const F0: Parameter = Parameter {
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

/// Index of refraction of a dielectric against air.
pub(in crate::models) const IOR: Parameter = Parameter {
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

pub(in crate::models) const CONDUCTOR_ETA: Parameter = complex_index(
    ("eta", "η", Role::ConductorIndex),
    Interval::open_below(0.0, 100.0),
    [2.501, 2.114, 1.705],
    "Real part of the complex index of refraction, per channel; the default is iridium.",
);
pub(in crate::models) const CONDUCTOR_K: Parameter = complex_index(
    ("k", "k", Role::Extinction),
    Interval::closed(0.0, 100.0),
    [5.183, 4.670, 3.910],
    "Extinction coefficient (imaginary part of the index), per channel; the default is iridium.",
);

/// `conductor` sets the complex index to a metal's.
pub(in crate::models) const CONDUCTOR: Named = Named {
    name: "conductor",
    parameters: &["eta", "k"],
    summary: "Complex index of a metal by its name, from the measurements of refractiveindex.info.",
    words: metals::names,
    look_up: |name| metals::by_name(name).map(|m| vec![Value::Colour(m.eta), Value::Colour(m.k)]),
};

/// [`CONDUCTOR`] where the Fresnel term is a choice: a metal's name makes it.
pub(in crate::models) const CHOSEN_CONDUCTOR: Named = Named {
    parameters: &["eta", "k", "fresnel"],
    look_up: |name| {
        let metal = metals::by_name(name)?;
        Some(vec![Value::Colour(metal.eta), Value::Colour(metal.k), Value::Choice("conductor")])
    },
    ..CONDUCTOR
};

/// The Fresnel term of a model with `eta` and `k`.
pub(in crate::models) fn conductor(v: &Values) -> [Fresnel; 3] {
    let (eta, k) = (v.colour("eta"), v.colour("k"));
    std::array::from_fn(|c| Fresnel::Conductor { eta: eta[c], k: k[c] })
}

/// The Fresnel term of a model with the choice `fresnel` and a parameter for each.
pub(in crate::models) fn fresnel(v: &Values) -> [Fresnel; 3] {
    match v.choice("fresnel") {
        "dielectric" => [Fresnel::Dielectric { eta: v.number("ior") }; 3],
        "conductor" => conductor(v),
        "schlick" => v.colour("f0").map(|f0| Fresnel::Schlick { f0 }),
        _ => [Fresnel::None; 3],
    }
}
