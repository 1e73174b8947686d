//! Rules about indices of refraction, reflectances at normal incidence and metals.

use super::readings::{decoded, each, encoded, swapped_index};
use super::{Certainty, Given, Item, Reading, Suspicion};
use crate::fresnel::{Fresnel, f0_from_ior, ior_from_f0};
use crate::{Preset, Role, metals, physically_based};

/// Channels of a colour differ by less from a metal's that it may be.
const SAME_COLOUR: f64 = 0.035;
/// Ratio of indices of a metal by two measurements.
const SAME_INDEX: f64 = 1.35;
/// No metal has an index so many times its extinction; semiconductors have.
const LESS_THAN_METALLIC: f64 = 2.5;
/// The darkest metal reflects more.
const DARK_METAL: f64 = 0.15;

fn with_role<'a>(given: &'a Given, roles: &'static [Role]) -> impl Iterator<Item = &'a Item> {
    given.items.iter().filter(|item| roles.contains(&item.parameter.role) && !item.numbers.is_empty())
}

/// Indices of 1 and less.
pub(super) fn reflectance_as_index(given: &Given) -> Vec<Suspicion> {
    with_role(given, &[Role::RefractiveIndex, Role::CoatIndex])
        .filter(|item| !item.is_percent && item.least() > 0.0 && item.largest() < 1.0)
        .map(|item| {
            let value = item.numbers[0];
            // Bubbles have such indices; hardly anything else.
            let certainty = if item.fits { Certainty::Likely } else { Certainty::Certain };
            let why = format!("{} is the index inside over outside, above 1; {value} is a reflectance (F0) or the index the other way round", item.name);
            let f0 = each(item, "the reflectance at normal incidence, F0", |v| Some(ior_from_f0(v)));
            let inverse = each(item, "the index the other way round", |v| Some(1.0 / v));
            // 0.4 is the F0 of no dielectric, and 1/0.4 that of no glass.
            let fixes = if value < 0.4 { [f0, inverse] } else { [inverse, f0] };
            Suspicion::of(item, certainty, why, fixes.into_iter().flatten().collect())
        })
        .collect()
}

/// Reflectances at normal incidence above 1.
pub(super) fn index_as_reflectance(given: &Given) -> Vec<Suspicion> {
    with_role(given, &[Role::NormalReflectance, Role::SpecularLevel, Role::SpecularReflectance])
        .filter(|item| !item.fits && !item.is_percent && item.least() > 1.0 && item.largest() <= 3.0)
        .map(|item| {
            let scale = if item.parameter.role == Role::SpecularLevel { 0.08 } else { 1.0 };
            let why = format!(
                "{} is a {}, at most 1; {} is an index of refraction",
                item.name,
                item.parameter.role.title(),
                item.text
            );
            let fixes =
                each(item, "an index of refraction", |v| Some(f0_from_ior(v) / scale)).into_iter().collect();
            Suspicion::of(item, Certainty::Certain, why, fixes)
        })
        .collect()
}

/// F0 where a level of 0 to 1 is wanted.
pub(super) fn reflectance_as_level(given: &Given) -> Vec<Suspicion> {
    with_role(given, &[Role::SpecularLevel])
        .filter(|item| item.fits && item.least() >= 0.02 && item.largest() <= 0.06)
        .map(|item| {
            let why = format!(
                "{} is a level: F0 is 0.08 times it, here {:.4}, less than any solid has; {} is an F0",
                item.name,
                0.08 * item.numbers[0],
                item.text
            );
            let fixes = each(item, "the reflectance at normal incidence, F0", |v| Some(v / 0.08))
                .into_iter()
                .collect();
            Suspicion::of(item, Certainty::Likely, why, fixes)
        })
        .collect()
}

/// A conductor's index that is a known metal's with its parts swapped.
pub(super) fn swapped(given: &Given) -> Vec<Suspicion> {
    let of = |role| with_role(given, role).next();
    let (Some(eta), Some(k)) = (of(&[Role::ConductorIndex]), of(&[Role::Extinction])) else {
        return Vec::new();
    };
    let (Some(n), Some(extinction)) = (eta.colour(), k.colour()) else { return Vec::new() };
    let [straight, crossed] = [nearest(n, extinction), nearest(extinction, n)];
    let (name, ratio) = crossed;
    let (certainty, why) = if ratio <= SAME_INDEX && ratio < straight.1 {
        (Certainty::Likely, format!("with eta and k swapped these are the index of {name}"))
    } else if (0..3).all(|c| n[c] > LESS_THAN_METALLIC * extinction[c]) {
        (Certainty::Possible, "metals have a k that is larger than eta or nearly so".to_owned())
    } else {
        return Vec::new();
    };
    let fixes: Vec<Reading> = swapped_index(given).into_iter().collect();
    vec![Suspicion::of(eta, certainty, why, fixes)]
}

/// The metal of the most similar index, and the mean ratio to it.
fn nearest(eta: [f64; 3], k: [f64; 3]) -> (&'static str, f64) {
    let mut best = ("", f64::INFINITY);
    for metal in metals::names().into_iter().filter_map(metals::by_name) {
        let pairs = eta.iter().chain(&k).zip(metal.eta.iter().chain(&metal.k));
        let ratio = (pairs.map(|(a, b)| (a / b).ln().abs()).sum::<f64>() / 6.0).exp();
        if ratio < best.1 {
            best = (&metal.name, ratio);
        }
    }
    best
}

/// A metal's colour that is a known metal's in sRGB, or decoded twice.
pub(super) fn metal_colour(given: &Given) -> Vec<Suspicion> {
    let is_metal = given.is_metal();
    with_role(given, &[Role::BaseColour, Role::NormalReflectance])
        .filter(|item| item.fits && item.is_colour())
        .filter(|item| is_metal || item.parameter.role == Role::NormalReflectance)
        .filter_map(|item| {
            let colour = item.colour()?;
            if metal_of(colour).is_some() {
                return None;
            }
            let encoded_name = metal_of(colour.map(decoded)).map(|name| (name, true));
            let (name, is_encoded) =
                encoded_name.or_else(|| metal_of(colour.map(encoded)).map(|name| (name, false)))?;
            let (how, fix) = if is_encoded {
                ("sRGB-encoded", each(item, "sRGB-encoded", |v| Some(decoded(v))))
            } else {
                let says = "linear, decoded once too often";
                ("decoded from sRGB once too often", each(item, says, |v| Some(encoded(v))))
            };
            let why = format!("this is the colour of {name}, {how}");
            Some(Suspicion::of(item, Certainty::Likely, why, fix.into_iter().collect()))
        })
        .collect()
}

/// The metal of a colour; greys say nothing, because any grey is some metal's.
fn metal_of(colour: [f64; 3]) -> Option<&'static str> {
    let is_grey = |c: [f64; 3]| c.iter().all(|v| (v - c[0]).abs() < 0.15);
    let is_same = |of: [f64; 3]| !is_grey(of) && (0..3).all(|c| (of[c] - colour[c]).abs() < SAME_COLOUR);
    known_metals().find(|(_, of)| is_same(*of)).map(|(name, _)| name)
}

/// Metals with their colours: those of complex indices, and the presets of OpenPBR.
fn known_metals() -> impl Iterator<Item = (&'static str, [f64; 3])> {
    let f0 = |metal: &metals::Metal, c: usize| {
        Fresnel::Conductor { eta: metal.eta[c], k: metal.k[c] }.reflectance(1.0)
    };
    let indices = metals::names().into_iter().filter_map(metals::by_name);
    let indices = indices.map(move |metal| (metal.name.as_str(), std::array::from_fn(|c| f0(metal, c))));
    let value =
        |preset: &'static Preset, name: &str| preset.values.iter().find(|(n, _)| *n == name).map(|(_, v)| v);
    let colour = move |preset: &'static Preset| {
        let is_metal = value(preset, "base_metalness").is_some_and(|v| v == "1");
        let channels: Vec<f64> =
            value(preset, "base_color")?.split('/').filter_map(|v| v.parse().ok()).collect();
        let colour: [f64; 3] = channels.try_into().ok()?;
        is_metal.then_some((preset.name.as_str(), colour))
    };
    indices.chain(physically_based::presets().iter().filter_map(colour))
}

/// A metal whose colour is the F0 of a dielectric.
pub(super) fn dark_metal(given: &Given) -> Vec<Suspicion> {
    let Some(metalness) = with_role(given, &[Role::Metalness]).next() else { return Vec::new() };
    let is_dark = |item: &&Item| item.fits && item.largest() < DARK_METAL;
    let colour = with_role(given, &[Role::BaseColour]).find(is_dark);
    let (true, Some(colour)) = (metalness.fits && metalness.least() > 0.9, colour) else { return Vec::new() };
    let why = format!(
        "the colour of a metal is its reflectance, {} = {}: no metal reflects less than about 0.4, dielectrics do",
        colour.name, colour.text
    );
    let fixes = each(metalness, "a dielectric", |_| Some(0.0)).into_iter().collect();
    vec![Suspicion::of(metalness, Certainty::Likely, why, fixes)]
}
