//! What a number may have been meant as, for every kind of parameter.
//!
//! Widths are read as if they were another spelling of the microfacet α, and written in the model's own: so "gloss", "α for
//! √α" and "exponent" need no case for each pair of models.

use std::f64::consts::PI;

use super::{Given, Item, Reading};
use crate::fresnel::{f0_from_ior, ior_from_f0};
use crate::{Kind, Parameter, Role};

/// Another way to spell the width of a lobe, as the microfacet α of a number; `None` where a number cannot be one.
type Spelling = (&'static str, fn(f64) -> Option<f64>);

#[rustfmt::skip] // one line per spelling
static SPELLINGS: &[Spelling] = &[
    ("gloss, one minus the roughness (√α)", |v| within_one(v).map(|v| (1.0 - v) * (1.0 - v))),
    ("gloss, one minus α", |v| within_one(v).map(|v| 1.0 - v)),
    ("the microfacet α itself", within_one),
    ("a roughness whose square is α", |v| within_one(v).map(|v| v * v)),
    ("α squared", |v| within_one(v).map(f64::sqrt)),
    ("a power of a cosine", |v| (v > 1.0).then(|| exponent_alpha(v))),
];

/// Another meaning of a colour, channel by channel; `None` where it cannot have it.
#[rustfmt::skip]
static COLOURS: &[Spelling] = &[
    ("8-bit sRGB codes", |v| (0.0..=255.0).contains(&v).then(|| decoded(v / 255.0))),
    ("8-bit linear codes", |v| (0.0..=255.0).contains(&v).then(|| v / 255.0)),
    ("percent", |v| (0.0..=100.0).contains(&v).then(|| v / 100.0)),
    ("sRGB-encoded", |v| within_one(v).map(decoded)),
    ("linear, decoded once too often", |v| within_one(v).map(encoded)),
    ("an albedo divided by π", |v| Some(v * PI)),
    ("an albedo times π", |v| Some(v / PI)),
];

/// Another meaning of a reflectance at normal incidence or an index: of which role, in words, and in the model's terms.
type FresnelReading = (Role, &'static str, fn(f64) -> Option<f64>);

#[rustfmt::skip]
static FRESNEL: &[FresnelReading] = &[
    (Role::RefractiveIndex, "the reflectance at normal incidence, F0", |v| (v > 0.0 && v < 1.0).then(|| ior_from_f0(v))),
    (Role::RefractiveIndex, "the index the other way round", |v| (v > 0.0 && v < 1.0).then(|| 1.0 / v)),
    (Role::CoatIndex, "the reflectance at normal incidence, F0", |v| (v > 0.0 && v < 1.0).then(|| ior_from_f0(v))),
    (Role::CoatIndex, "the index the other way round", |v| (v > 0.0 && v < 1.0).then(|| 1.0 / v)),
    (Role::NormalReflectance, "an index of refraction", |v| (v > 1.0 && v < 5.0).then(|| f0_from_ior(v))),
    (Role::NormalReflectance, "a specular level, F0 / 0.08", |v| within_one(v).map(|v| 0.08 * v)),
    (Role::SpecularReflectance, "an index of refraction", |v| (v > 1.0 && v < 5.0).then(|| f0_from_ior(v))),
    (Role::SpecularReflectance, "a specular level, F0 / 0.08", |v| within_one(v).map(|v| 0.08 * v)),
    (Role::SpecularLevel, "the reflectance at normal incidence, F0", |v| within_one(v).map(|v| v / 0.08)),
    (Role::SpecularLevel, "an index of refraction", |v| (v > 1.0 && v < 5.0).then(|| f0_from_ior(v) / 0.08)),
    (Role::Metalness, "a mask the other way round", |v| within_one(v).map(|v| 1.0 - v)),
];

/// Everything that any single value of a material may have been meant as, and that the model accepts.
pub fn readings(given: &Given) -> Vec<Reading> {
    let mut all: Vec<Reading> = given.items.iter().flat_map(of).collect();
    all.extend(swapped_index(given));
    all.retain(|reading| {
        let mut material = given.material.clone();
        reading.values.iter().all(|(name, value)| material.set(name, value).is_ok())
    });
    all
}

/// What one value may have been meant as.
fn of(item: &Item) -> Vec<Reading> {
    let role = item.parameter.role;
    let mut found = Vec::new();
    if let Some(own) = width_role(role) {
        found.extend(SPELLINGS.iter().filter_map(|spelling| width(item, own, spelling)));
    }
    let fresnel = FRESNEL.iter().filter(|(of, ..)| *of == role);
    found.extend(fresnel.filter_map(|(_, says, read)| each(item, says, read)));
    if item.is_colour() && is_reflectance_colour(role) {
        found.extend(COLOURS.iter().filter_map(|(says, read)| each(item, says, read)));
        found.extend(reversed(item));
    }
    if is_unit_number(item.parameter) {
        found.extend(percent(item));
        found.extend(byte(item));
    }
    found
}

/// The role in whose terms a width is written; that of a coat is a roughness like any other.
pub(super) fn width_role(role: Role) -> Option<Role> {
    match role {
        Role::CoatRoughness => Some(Role::PerceptualRoughness),
        role => role.is_width().then_some(role),
    }
}

/// A width read in another spelling.
pub(super) fn width(item: &Item, own: Role, (says, alpha): &Spelling) -> Option<Reading> {
    let read = |v: f64| own.from_alpha(alpha(v)?);
    each(item, says, read)
}

/// A power of a cosine as a width.
pub(super) fn exponent(item: &Item, own: Role) -> Option<Reading> {
    SPELLINGS.last().and_then(|spelling| width(item, own, spelling))
}

pub(super) fn percent(item: &Item) -> Option<Reading> {
    let whole = |v: f64| (v > 1.0 && v <= 100.0 || item.is_percent).then(|| v / 100.0);
    each(item, "percent", whole)
}

pub(super) fn byte(item: &Item) -> Option<Reading> {
    each(item, "an 8-bit code", |v| (v > 1.0 && v <= 255.0 && v.fract() == 0.0).then(|| v / 255.0))
}

/// The reading of every number of an item; `None` where one of them cannot be read so, or nothing changes.
pub(super) fn each(item: &Item, says: &str, read: impl Fn(f64) -> Option<f64>) -> Option<Reading> {
    let numbers: Vec<f64> = item.numbers.iter().map(|v| read(*v)).collect::<Option<_>>()?;
    reading(item, says, numbers)
}

fn reading(item: &Item, says: &str, numbers: Vec<f64>) -> Option<Reading> {
    let differs = item.numbers.iter().zip(&numbers).any(|(a, b)| (a - b).abs() > 1e-9 * a.abs());
    let values = vec![(item.name.clone(), written(&numbers))];
    (differs && !numbers.is_empty()).then(|| Reading { says: says.to_owned(), values })
}

/// A colour whose channels are in the order of some image libraries.
fn reversed(item: &Item) -> Option<Reading> {
    let [r, g, b] = item.numbers[..] else { return None };
    reading(item, "blue, green, red", vec![b, g, r])
}

/// A conductor's index with its two parts swapped.
pub(super) fn swapped_index(given: &Given) -> Option<Reading> {
    let by_role =
        |role| given.items.iter().find(|item| item.parameter.role == role && !item.numbers.is_empty());
    let (eta, k) = (by_role(Role::ConductorIndex)?, by_role(Role::Extinction)?);
    let values = vec![(eta.name.clone(), written(&k.numbers)), (k.name.clone(), written(&eta.numbers))];
    (eta.numbers != k.numbers).then(|| Reading { says: "eta and k the other way round".to_owned(), values })
}

/// Numbers as they are written, with four significant digits: nobody sees more.
fn written(numbers: &[f64]) -> String {
    let digits = |v: f64| {
        let places = if v == 0.0 { 0 } else { (3 - v.abs().log10().floor() as i32).clamp(0, 4) };
        let scale = 10f64.powi(places);
        ((v * scale).round() / scale).to_string()
    };
    let mut texts: Vec<String> = numbers.iter().map(|v| digits(*v)).collect();
    if texts.len() == 3 && texts.iter().all(|t| *t == texts[0]) {
        texts.truncate(1);
    }
    texts.join("/")
}

/// True for colours that are reflectances, and so between 0 and 1.
pub(super) fn is_reflectance_colour(role: Role) -> bool {
    matches!(
        role,
        Role::DiffuseReflectance
            | Role::BaseColour
            | Role::SpecularReflectance
            | Role::NormalReflectance
            | Role::SpecularColour
            | Role::CoatColour
            | Role::Sheen
            | Role::SheenColour
    )
}

/// True for numbers between 0 and 1 that are no colour.
pub(super) fn is_unit_number(parameter: &Parameter) -> bool {
    match parameter.kind {
        Kind::Number { range, .. } => range.valid.min >= 0.0 && range.valid.max == 1.0,
        _ => false,
    }
}

fn within_one(v: f64) -> Option<f64> {
    (0.0..=1.0).contains(&v).then_some(v)
}

fn exponent_alpha(n: f64) -> f64 {
    (2.0 / (n + 2.0)).sqrt()
}

/// The inverse of the sRGB transfer function (IEC 61966-2-1).
pub(super) fn decoded(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB transfer function.
pub(super) fn encoded(v: f64) -> f64 {
    if v <= 0.0031308 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        let given = Given::parse(text).unwrap();
        readings(&given).into_iter().map(|r| r.values[0].1.clone()).collect()
    }

    #[test]
    fn a_roughness_has_every_other_spelling() {
        assert_eq!(values("gltf:roughness=0.8"), ["0.2", "0.4472", "0.8944", "0.9457"]);
        assert_eq!(values("ggx:roughness=0.8"), ["0.04", "0.2", "0.64", "0.8944"]);
        assert_eq!(values("phong:exponent=64"), Vec::<String>::new());
        assert_eq!(values("gltf:roughness=64"), ["0.4172", "0.64", "0.251"]);
    }

    #[test]
    fn colours_have_codes_and_orders() {
        let found = values("lambert:diffuse=0.5/0.25/0.1");
        for expected in ["0.214/0.0509/0.01", "0.7354/0.5371/0.3492", "0.1/0.25/0.5"] {
            assert!(found.contains(&expected.to_owned()), "{expected} in {found:?}");
        }
    }

    #[test]
    fn the_transfer_function_is_inverted() {
        for k in 0..=100 {
            let v = f64::from(k) / 100.0;
            assert!((decoded(encoded(v)) - v).abs() < 1e-6);
        }
    }
}
