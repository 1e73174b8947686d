//! What was judged, as tables and curves.

use std::ops::Range;

use lookmatch_plots::{Chart, Series, draw_charts, draw_probe};
use lookmatch_remap::{Probe, Statistics};

use super::judge::{Score, method_names};
use super::{Case, path};
use crate::album::Album;
use crate::tables::mean;
use crate::{Cell, Figure, Row, Table};

/// Places of the probe and of the baselines in a score.
fn methods<'s>(scores: impl Iterator<Item = &'s Score>) -> Range<usize> {
    0..scores.map(|score| score.methods.len()).min().unwrap_or(0)
}

/// The least mean NRMSD of the baselines.
pub(super) fn better_baseline(scores: &[&Score], masked: bool) -> f64 {
    let of = |method: usize| mean(scores.iter().map(|score| score.methods[method].nrmsd(masked)));
    methods(scores.iter().copied()).skip(1).map(of).fold(f64::INFINITY, f64::min)
}

/// Minimum, maximum, mean and standard deviation over all source points, beside the baselines.
pub(super) fn overall(case: &Case, scores: &[Score]) -> Table {
    let rows = method_names().zip(methods(scores.iter())).map(|(name, k)| {
        let of = |masked| Statistics::of(scores.iter().map(move |score| score.methods[k].nrmsd(masked)));
        let Statistics { min, max, mean: average, sd } = of(case.mask);
        let jod = mean(scores.iter().map(|score| score.methods[k].jod));
        let numbers = [min, max, average, sd, of(!case.mask).mean, jod];
        Row { name: name.into(), cells: numbers.map(Cell::Number).into(), is_main: k == 0 }
    });
    let other = if case.mask { "mean, whole pictures" } else { "mean, masked" };
    Table {
        title: format!("{} over {} source points", capitalised(case.measure()), scores.len()),
        about: "Mean of the channels. JOD: 10 where nothing is seen.".into(),
        columns: ["", "min", "max", "mean", "σ", other, "mean JOD"].map(str::to_owned).into(),
        rows: rows.collect(),
    }
}

/// The same by class of the source.
pub(super) fn by_class(case: &Case, probe: &Probe, scores: &[Score]) -> Table {
    let (names, class) = case.classes;
    let row = |(k, name): (usize, &&str)| {
        let judged = || probe.entries.iter().zip(scores).filter(|(entry, _)| class(&entry.source) == k);
        let nrmsd = Statistics::of(judged().map(|(_, score)| score.methods[0].nrmsd(case.mask)));
        let jods = Statistics::of(judged().map(|(_, score)| score.methods[0].jod));
        let copied = mean(judged().map(|(_, score)| score.methods[1].nrmsd(case.mask)));
        let numbers = [nrmsd.min, nrmsd.max, nrmsd.mean, nrmsd.sd, jods.mean, jods.min, copied];
        let count = Cell::Text(judged().count().to_string());
        (judged().count() > 0).then(|| Row {
            name: (*name).into(),
            cells: std::iter::once(count).chain(numbers.map(Cell::Number)).collect(),
            is_main: false,
        })
    };
    let columns = ["source", "points", "min", "max", "mean", "σ", "mean JOD", "lowest JOD", "mean of copy"];
    Table {
        title: format!("{} by source", capitalised(case.measure())),
        about: "Of the probe, but for the last column.".into(),
        columns: columns.map(str::to_owned).into(),
        rows: names.iter().enumerate().filter_map(row).collect(),
    }
}

/// The target's widths over the degree of anisotropy.
pub(super) fn figure(case: &Case, album: &Album, probe: &Probe) -> anyhow::Result<Figure> {
    let chart = |last: Option<usize>| {
        let places = path(case, probe, last);
        let series = |k: usize| {
            let point = |place: &usize| {
                let entry = &probe.entries[*place];
                ((case.degree.1)(entry.source[1], entry.source[2]), entry.target[k])
            };
            Series { name: probe.target_axes[k].name.clone(), points: places.iter().map(point).collect() }
        };
        let title = match (last, probe.source_axes.get(3)) {
            (Some(k), Some(axis)) => format!("{} {}", axis.name, axis.value(k)),
            _ => "widths of the target".into(),
        };
        Chart { title, x: case.degree.0.into(), y: "width".into(), series: vec![series(1), series(2)] }
    };
    let charts: Vec<Chart> = match probe.source_axes.get(3) {
        Some(axis) => (0..axis.len()).map(|k| chart(Some(k))).collect(),
        None => vec![chart(None)],
    };
    let (path, file) = album.figure("widths.svg");
    draw_charts(&charts, charts.len().min(3), (330, 260), &path)?;
    Ok(Figure {
        title: format!("Widths of {}'s lobe over the anisotropy", case.models[1]),
        about: "From the one direction through isotropic to the other.".into(),
        file,
    })
}

/// All target parameters over the last two of the source, which for three of them are both widths.
pub(super) fn maps(album: &Album, probe: &Probe) -> anyhow::Result<Figure> {
    let (path, file) = album.figure("maps.png");
    draw_probe(probe, &path)?;
    Ok(Figure {
        title: "The map".into(),
        about: "Target parameters over two of the source, at some levels of the others.".into(),
        file,
    })
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
