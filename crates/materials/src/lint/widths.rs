//! Rules about the widths of lobes.

use super::readings::{byte, exponent as exponent_reading, percent, width, width_role};
use super::{Certainty, Given, Item, Suspicion};
use crate::Role;

/// α that no metal but a blasted one reaches.
const WIDE: f64 = 0.64;
/// Below this, a roughness (√α) is a mirror's; an α of the same value is not.
const NARROW: f64 = 0.03;
/// Coats are poured or sprayed: rougher ones are hardly seen.
const ROUGH_COAT: f64 = 0.6;

/// Items that are widths, with the role in whose terms they are written.
fn widths(given: &Given) -> impl Iterator<Item = (&Item, Role)> {
    let own = |item: &'_ Item| width_role(item.parameter.role);
    given
        .items
        .iter()
        .filter(|item| !item.numbers.is_empty())
        .filter_map(move |item| Some((item, own(item)?)))
}

fn range(item: &Item) -> String {
    item.parameter.range().map(|range| range.valid.to_string()).unwrap_or_default()
}

/// Numbers far above 1 where a roughness or gloss is wanted.
pub(super) fn exponent(given: &Given) -> Vec<Suspicion> {
    let is_far = |item: &Item| !item.fits && !item.is_percent && item.least() >= 2.0;
    widths(given)
        .filter(|(item, own)| *own != Role::Exponent && is_far(item))
        .map(|(item, own)| {
            let why = format!(
                "{} is a {} in {}; a number like this is the power of a cosine (Phong, Blinn), a percentage or an 8-bit code",
                item.name,
                own.title(),
                range(item)
            );
            let fixes = [exponent_reading(item, own), percent(item), byte(item)];
            Suspicion::of(item, Certainty::Certain, why, fixes.into_iter().flatten().collect())
        })
        .collect()
}

/// A roughness where a power of a cosine is wanted.
pub(super) fn width_as_exponent(given: &Given) -> Vec<Suspicion> {
    // Two decimals at most: a number that somebody typed. Fits of fabrics do have such exponents, with more digits.
    let is_typed = |v: &f64| (v * 100.0 - (v * 100.0).round()).abs() < 1e-9;
    let is_width =
        |item: &Item| item.least() > 0.0 && item.largest() < 1.0 && item.numbers.iter().all(is_typed);
    widths(given)
        .filter(|(item, own)| *own == Role::Exponent && item.parameter.symbol.starts_with('n') && is_width(item))
        .map(|(item, own)| {
            let why = format!("{} is the power of a cosine, 1 to many thousands; below 1 the lobe is wider than a diffuse one", item.name);
            let alpha = width(item, own, &("the microfacet α", Some));
            let root = width(item, own, &("a roughness whose square is α", |v| Some(v * v)));
            Suspicion::of(item, Certainty::Possible, why, alpha.into_iter().chain(root).collect())
        })
        .collect()
}

/// Lobes so wide that the number may be a gloss, or not yet squared.
pub(super) fn wide(given: &Given) -> Vec<Suspicion> {
    let is_metal = given.is_metal();
    widths(given)
        .filter(|(item, _)| item.fits)
        .filter_map(|(item, own)| {
            let alpha = own.alpha(item.largest())?;
            let is_coat = item.parameter.role == Role::CoatRoughness;
            let why = if is_coat && item.largest() > ROUGH_COAT {
                "a clear coat is smooth: one this rough is hardly seen"
            } else if is_metal && !is_coat && alpha > WIDE && own != Role::Exponent {
                "a metal this rough has no highlight left"
            } else if own == Role::Roughness
                && is_bounded(item)
                && alpha > item.parameter.range()?.plausible.max
            {
                "a microfacet α this large lies outside of what real materials have"
            } else {
                return None;
            };
            let square = (own == Role::Roughness && !is_metal)
                .then(|| width(item, own, &("a roughness whose square is α", |v| Some(v * v))));
            let gloss = width(item, own, &gloss(own));
            let fixes = square.flatten().into_iter().chain(gloss).collect();
            let why = format!("{why} ({} α = {alpha:.2})", own.title());
            Some(Suspicion::of(item, Certainty::Possible, why, fixes))
        })
        .collect()
}

/// True where 1 is the widest lobe; slopes go beyond.
fn is_bounded(item: &Item) -> bool {
    item.parameter.range().is_some_and(|range| range.valid.max == 1.0)
}

/// One minus the number, in the parameter's own terms.
fn gloss(own: Role) -> (&'static str, fn(f64) -> Option<f64>) {
    let says = "gloss, one minus the roughness";
    match own {
        Role::Roughness => (says, |v| Some(1.0 - v)),
        // Either way round: g = 1 − r.
        Role::Glossiness => (says, |v| Some(v * v)),
        _ => (says, |v| Some((1.0 - v) * (1.0 - v))),
    }
}

/// A roughness so small that it may be an α already.
pub(super) fn narrow(given: &Given) -> Vec<Suspicion> {
    let is_small = |item: &Item| item.fits && item.least() > 0.0 && item.largest() < NARROW;
    widths(given)
        .filter(|(item, _)| item.parameter.role == Role::PerceptualRoughness && is_small(item))
        .map(|(item, own)| {
            let alpha = own.alpha(item.largest()).unwrap_or_default();
            let why = format!(
                "{} is squared by this model: α = {alpha:.2e}, a mirror's; if the number is an α, its root is wanted",
                item.name
            );
            let fixes = width(item, own, &("the microfacet α", Some)).into_iter().collect();
            Suspicion::of(item, Certainty::Possible, why, fixes)
        })
        .collect()
}
