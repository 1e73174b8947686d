//! Rules about units: percent, 8-bit codes, and what no rule explains.

use super::readings::{byte, each, is_unit_number, percent as percent_reading};
use super::{Certainty, Given, Item, Suspicion};

/// Percentages, and weights above 1.
pub(super) fn percent(given: &Given) -> Vec<Suspicion> {
    let is_large = |item: &Item| {
        !item.fits && is_unit_number(item.parameter) && item.least() >= 2.0 && item.largest() <= 255.0
    };
    given
        .items
        .iter()
        .filter(|item| item.is_percent || is_large(item))
        .map(|item| {
            let unit = item.parameter.range().map(|range| range.valid.to_string()).unwrap_or_default();
            let why = format!("{} is a number in {unit}, not a percentage or an 8-bit code", item.name);
            let hundredth = if item.is_percent {
                each(item, "percent", |v| Some(v / 100.0))
            } else {
                percent_reading(item)
            };
            let fixes = hundredth.into_iter().chain(byte(item).filter(|_| !item.is_percent)).collect();
            Suspicion::of(item, Certainty::Certain, why, fixes)
        })
        .collect()
}

/// Values that the model refuses and no other rule explains.
pub(super) fn out_of_range(given: &Given) -> Vec<Suspicion> {
    given
        .items
        .iter()
        .filter(|item| !item.fits)
        .map(|item| {
            let range = item.parameter.range().map(|range| range.valid.to_string()).unwrap_or_default();
            let why = format!("{} is outside its range {range}, and no usual mistake explains it", item.name);
            Suspicion::of(item, Certainty::Certain, why, Vec::new())
        })
        .collect()
}
