//! Rules about colours.

use super::readings::{decoded, each, encoded, is_reflectance_colour};
use super::{Certainty, Given, Item, Suspicion};
use crate::Role;

/// Albedo that only fresh snow and pressed powders exceed.
const SNOW: f64 = 0.9;
/// Albedo that only soot and paints made for it fall below.
const COAL: f64 = 0.008;
/// Reflectance of a body under a lobe that is a metal's: its diffuse colour means little.
const SHINY: f64 = 0.2;

/// Colours that are reflectances.
fn colours(given: &Given) -> impl Iterator<Item = &Item> {
    given.items.iter().filter(|item| item.is_colour() && is_reflectance_colour(item.parameter.role))
}

/// Colours of bodies, which are no metals.
fn bodies(given: &Given) -> impl Iterator<Item = (&Item, f64)> {
    let is_metal = given.is_metal();
    colours(given)
        .filter(move |item| !is_metal && item.fits && item.parameter.role.is_body())
        .filter_map(|item| Some((item, luminance(item.colour()?))))
}

fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Codes from 0 to 255.
pub(super) fn eight_bit(given: &Given) -> Vec<Suspicion> {
    let is_code = |item: &Item| {
        let is_hexadecimal = item.text.starts_with('#');
        !item.fits
            && !item.is_percent
            && item.least() >= 0.0
            && (item.largest() > 2.0 || is_hexadecimal)
            && item.largest() <= 255.0
    };
    colours(given)
        .filter(|item| is_code(item))
        .map(|item| {
            let why = format!(
                "{} is linear RGB from 0 to 1; these are 8-bit codes, which are sRGB-encoded as a rule",
                item.name
            );
            let byte = each(item, "8-bit sRGB codes", |v| Some(decoded(v / 255.0)));
            let percent = (item.largest() <= 100.0 && !item.text.starts_with('#'))
                .then(|| each(item, "percent", |v| Some(v / 100.0)));
            let linear = each(item, "8-bit linear codes", |v| Some(v / 255.0));
            let fixes = byte.into_iter().chain(percent.flatten()).chain(linear).collect();
            Suspicion::of(item, Certainty::Certain, why, fixes)
        })
        .collect()
}

/// Numbers with the digits of k/255.
pub(super) fn byte_fractions(given: &Given) -> Vec<Suspicion> {
    colours(given)
        .filter(|item| item.fits && is_byte_fractions(item))
        .map(|item| {
            let codes: Vec<String> = item.numbers.iter().map(|v| (v * 255.0).round().to_string()).collect();
            let why = format!(
                "every channel is a whole number of 255ths ({}): 8-bit codes, which are sRGB-encoded as a rule, where linear RGB is wanted",
                codes.join("/")
            );
            let fixes = each(item, "sRGB-encoded", |v| Some(decoded(v))).into_iter().collect();
            Suspicion::of(item, Certainty::Likely, why, fixes)
        })
        .collect()
}

/// True where two channels or more, with four digits or more each, are 255ths to the last digit but one. By chance one
/// material in thousands is.
fn is_byte_fractions(item: &Item) -> bool {
    let mut told = Vec::new();
    for text in item.text.split('/').map(str::trim) {
        let Ok(value) = text.parse::<f64>() else { return false };
        let digits = text.split_once('.').map_or(0, |(_, digits)| digits.len());
        if value == 0.0 || value == 1.0 {
            continue;
        }
        let tolerance = 0.6 * 10f64.powi(-(digits as i32).min(6));
        if digits < 4 || ((value * 255.0).round() / 255.0 - value).abs() > tolerance {
            return false;
        }
        if !told.contains(&text) {
            told.push(text);
        }
    }
    told.len() >= 2
}

/// Bodies brighter than snow.
pub(super) fn too_bright(given: &Given) -> Vec<Suspicion> {
    bodies(given)
        .filter(|(item, luminance)| *luminance > SNOW && item.least() < 1.0)
        .map(|(item, luminance)| {
            let why = format!("an albedo of {luminance:.2} is above that of fresh snow ({SNOW}): is the colour sRGB-encoded?");
            let fixes = each(item, "sRGB-encoded", |v| Some(decoded(v))).into_iter().collect();
            Suspicion::of(item, Certainty::Possible, why, fixes)
        })
        .collect()
}

/// Bodies darker than coal that are not black.
pub(super) fn too_dark(given: &Given) -> Vec<Suspicion> {
    // The specular reflectance of models without a Fresnel term is its own scale; their fits of metals have dark bodies.
    let f0 = given.material.canonical().f0;
    let is_dull = f0.is_some_and(|f0| luminance(f0) < SHINY)
        && given.model().parameters.iter().any(|p| p.role == Role::Metalness);
    bodies(given)
        .filter(|(item, luminance)| is_dull && *luminance > 0.0 && *luminance < COAL && item.largest() > 0.0)
        .map(|(item, luminance)| {
            let why = format!("an albedo of {luminance:.4} is below that of coal ({COAL}): was the colour decoded from sRGB twice?");
            let fixes = each(item, "linear, decoded once too often", |v| Some(encoded(v))).into_iter().collect();
            Suspicion::of(item, Certainty::Possible, why, fixes)
        })
        .collect()
}
