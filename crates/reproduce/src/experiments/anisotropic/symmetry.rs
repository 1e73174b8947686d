//! A law: exchanging tangent and bitangent in the source exchanges them in the target.

use lookmatch_remap::{Entry, Probe};

use super::STEP;
use crate::tables::bar;
use crate::{Bar, Cell, Finding, Row, Table};

/// How far the probe's widths are off the law, in levels of the lattice.
pub(super) struct Symmetry {
    /// Of each isotropic source, between the target's widths.
    isotropic: Vec<usize>,
    /// Of each pair of sources that are each other's mirror images, between the one's widths and those of the other, exchanged.
    exchanged: Vec<usize>,
}

impl Symmetry {
    pub(super) fn of(probe: &Probe) -> Self {
        let widths = |entry: &Entry| [1, 2].map(|k| probe.target_axes[k].nearest(entry.target[k]));
        let mut law = Self { isotropic: Vec::new(), exchanged: Vec::new() };
        for entry in &probe.entries {
            let [u, v] = widths(entry);
            if entry.source[1] == entry.source[2] {
                law.isotropic.push(u.abs_diff(v));
            } else if entry.source[1] < entry.source[2] {
                let mut mirrored = entry.source.clone();
                mirrored.swap(1, 2);
                let other = probe.entries.iter().find(|other| other.source == mirrored);
                law.exchanged.extend(other.map(widths).map(|[a, b]| u.abs_diff(b).max(v.abs_diff(a))));
            }
        }
        law
    }

    fn rows(&self) -> [(&'static str, &[usize]); 2] {
        [
            ("isotropic sources: between both widths of the target", &self.isotropic),
            ("mirrored sources: between one's widths and the other's, exchanged", &self.exchanged),
        ]
    }

    pub(super) fn findings(&self) -> Vec<Finding> {
        let names = [
            "isotropic sources have isotropic targets",
            "exchanged source directions are exchanged in the target",
        ];
        let finding = |(name, (_, off)): (&str, (&str, &[usize]))| {
            bar(format!("{name}: share within one level"), share(off, 1), Bar::AtLeast(1.0), CAUSE)
        };
        names.into_iter().zip(self.rows()).map(finding).collect()
    }

    pub(super) fn table(&self) -> Table {
        let row = |(name, off): (&str, &[usize])| {
            let percent = |most: usize| Cell::Text(format!("{:.0} %", 100.0 * share(off, most)));
            let largest = off.iter().max().copied().unwrap_or(0);
            let cells = vec![
                Cell::Text(off.len().to_string()),
                percent(0),
                percent(1),
                Cell::Text(largest.to_string()),
            ];
            Row { name: name.into(), cells, is_main: false }
        };
        Table {
            title: "Symmetry".into(),
            about: format!(
                "The scene of the search is not symmetric. Distances in levels of the lattice, which are ratios of {STEP}."
            ),
            columns: ["", "of them", "no level apart", "one at most", "largest"].map(str::to_owned).into(),
            rows: self.rows().map(row).into(),
        }
    }
}

const CAUSE: &str = "";

fn share(off: &[usize], most: usize) -> f64 {
    off.iter().filter(|off| **off <= most).count() as f64 / off.len().max(1) as f64
}
