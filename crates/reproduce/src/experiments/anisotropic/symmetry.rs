//! A law: exchanging tangent and bitangent in the source exchanges them in the target.

use lookmatch_remap::{Entry, Probe, Stage};

use super::STEP;
use super::judge::pair;
use crate::tables::{bar, mean};
use crate::{Bar, Cell, Finding, Row, Table};

/// How far the probe's widths are off the law, in levels of the lattice.
pub(super) struct Symmetry {
    /// Of each isotropic source, between the target's widths.
    isotropic: Vec<Off>,
    /// Of each pair of sources that are each other's mirror images, between the one's widths and those of the other, exchanged.
    exchanged: Vec<Off>,
}

/// Two sources that are each other's mirror images, or one that is its own, and how far their targets are from that.
struct Off {
    places: [usize; 2],
    levels: f64,
}

impl Symmetry {
    pub(super) fn of(probe: &Probe) -> Self {
        let mut law = Self { isotropic: Vec::new(), exchanged: Vec::new() };
        for (one, entry) in probe.entries.iter().enumerate() {
            let source = mirrored(&entry.source);
            let Some(other) = probe.entries.iter().position(|other| other.source == source) else { continue };
            let off = Off { places: [one, other], levels: levels_off(entry, &probe.entries[other]) };
            match one.cmp(&other) {
                std::cmp::Ordering::Equal => law.isotropic.push(off),
                std::cmp::Ordering::Less => law.exchanged.push(off),
                std::cmp::Ordering::Greater => {}
            }
        }
        law
    }

    fn rows(&self) -> [(&'static str, &[Off]); 2] {
        [
            ("isotropic sources: between both widths of the target", &self.isotropic),
            ("mirrored sources: between one's widths and the other's, exchanged", &self.exchanged),
        ]
    }

    /// The shares of isotropic sources and of mirrored ones that keep the law.
    pub(super) fn shares(&self) -> [f64; 2] {
        self.rows().map(|(_, off)| share(off, 1.0))
    }

    pub(super) fn findings(&self, probe: &Probe, stage: &Stage) -> anyhow::Result<Vec<Finding>> {
        let names = [
            "isotropic sources have isotropic targets",
            "exchanged source directions are exchanged in the target",
        ];
        let finding = |((name, (_, off)), share): ((&str, (&str, &[Off])), f64)| {
            let name = format!("{name}: share within one level");
            Ok(bar(name, share, Bar::AtLeast(1.0), &cause(off, probe, stage)?))
        };
        names.into_iter().zip(self.rows()).zip(self.shares()).map(finding).collect()
    }

    pub(super) fn table(&self) -> Table {
        let row = |(name, off): (&str, &[Off])| {
            let percent = |most: f64| Cell::Text(format!("{:.0} %", 100.0 * share(off, most)));
            let largest = off.iter().map(|off| off.levels).fold(0.0, f64::max);
            let cells = vec![
                Cell::Text(off.len().to_string()),
                percent(0.5),
                percent(1.0),
                Cell::Text(format!("{largest:.1}")),
            ];
            Row { name: name.into(), cells, is_main: false }
        };
        Table {
            title: "Symmetry".into(),
            about: format!(
                "The scene of the search is not symmetric. Distances in levels of the lattice, which are ratios of {STEP}."
            ),
            columns: ["", "of them", "half a level apart at most", "one at most", "largest"]
                .map(str::to_owned)
                .into(),
            rows: self.rows().map(row).into(),
        }
    }
}

/// Allows for rounding where widths are just a level apart.
const ROUNDING: f64 = 1e-3;

fn share(off: &[Off], most: f64) -> f64 {
    off.iter().filter(|off| off.levels <= most + ROUNDING).count() as f64 / off.len().max(1) as f64
}

/// Source or target values with tangent and bitangent exchanged.
fn mirrored(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.swap(1, 2);
    values
}

/// How far one's widths are from those of the other, exchanged: the larger distance of both, in steps of the lattice.
fn levels_off(one: &Entry, other: &Entry) -> f64 {
    let exchanged = mirrored(&other.target);
    let apart = |k: usize| (one.target[k] / exchanged[k]).ln().abs() / STEP.ln();
    apart(1).max(apart(2))
}

/// Whether the search or its scene is the cause: how well each source's target suits it beside the other's, exchanged.
fn cause(off: &[Off], probe: &Probe, stage: &Stage) -> anyhow::Result<String> {
    let mut changes = Vec::new();
    for Off { places: [one, other], .. } in off.iter().filter(|off| off.levels > 1.0 + ROUNDING) {
        for (own, other) in [(one, other), (other, one)] {
            let (entry, other) = (&probe.entries[*own], &probe.entries[*other]);
            let (source, target) = pair(probe, entry)?;
            let exchanged = probe.target_material(&source, &mirrored(&other.target), entry.body)?;
            let seen = stage.appearance(&source);
            let fitness = |material| stage.fitness(&seen, &stage.appearance(material));
            changes.push(fitness(&exchanged) / fitness(&target) - 1.0);
        }
    }
    let worse = changes.iter().filter(|change| **change > 0.0).count();
    Ok(format!(
        "measured: the scene of the search is not symmetric; there, of {} targets that are further off, the exchanged one would suit its source \
         worse for {worse}, and its fitness is larger by {:.1} % in the mean",
        changes.len(),
        100.0 * mean(changes.iter().copied())
    ))
}
