//! The verdict over the source parameters: would anybody see it, of the probe's targets and of those that people copy?

use std::path::Path;

use lookmatch_imaging::Verdict;
use lookmatch_remap::{MethodVerdicts, Probe, VerdictMap};
use plotters::prelude::*;

use crate::probe::{PANEL, Ruler, mesh};
use crate::sheet::{Area, short};

/// Width of the legend in pixels.
const LEGEND: u32 = 136;
/// Share of paper in the colour of what was not judged itself.
const PALE: f64 = 0.6;
/// Share of a strip's height that its cells have; its name has the rest.
const STRIP: f64 = 0.62;

/// Blue and yellow of Okabe and Ito (2008) and a darker vermilion: told apart by those who see no red, no green or no blue.
fn colour(verdict: Verdict) -> RGBColor {
    match verdict {
        Verdict::Indistinguishable => RGBColor(0, 114, 178),
        Verdict::SlightlyDifferent => RGBColor(240, 228, 66),
        Verdict::NoticeablyDifferent => RGBColor(190, 60, 0),
    }
}

/// A cell of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    verdict: Verdict,
    /// False where it is that of the nearest point that was judged.
    is_judged: bool,
}

impl Cell {
    fn colour(self) -> RGBColor {
        let full = colour(self.verdict);
        let channel = |c: u8| (f64::from(c) + (255.0 - f64::from(c)) * PALE).round() as u8;
        if self.is_judged { full } else { RGBColor(channel(full.0), channel(full.1), channel(full.2)) }
    }
}

/// Cells over one or two source parameters.
pub(crate) struct Map {
    title: String,
    axes: Vec<Ruler>,
    /// Name and cells by place, the last axis the fastest: of one method over two parameters, of all over one.
    methods: Vec<(String, Vec<Cell>)>,
    /// Points with each verdict; none where there are several methods.
    counts: Option<[usize; 3]>,
}

/// The maps of some entries: for each light a row of methods.
pub(crate) fn rows(probe: &Probe, axes: &[Ruler], places: &[usize], at: &str) -> Vec<Vec<Map>> {
    let row = |map: &VerdictMap| {
        let nearest: Vec<(usize, bool)> = places.iter().map(|place| nearest(probe, map, *place)).collect();
        let cells = |method: &MethodVerdicts| {
            let cell =
                |(k, is_judged): &(usize, bool)| Cell { verdict: method.verdict[*k], is_judged: *is_judged };
            (method.method.clone(), nearest.iter().map(cell).collect())
        };
        let light = Path::new(&map.environment).file_stem().unwrap_or_default().to_string_lossy();
        if let [axis] = axes {
            let title = format!("would anybody see it? ({light})");
            let methods = map.methods.iter().map(cells).collect();
            return vec![Map { title, axes: vec![axis.clone()], methods, counts: None }];
        }
        let panel = |method: &MethodVerdicts| Map {
            title: format!("seen? {} ({light}){at}", method.method),
            axes: axes.to_vec(),
            methods: vec![cells(method)],
            counts: Some(Verdict::ALL.map(|verdict| method.counts().count(verdict))),
        };
        map.methods.iter().map(panel).collect()
    };
    probe.verdicts.iter().map(row).collect()
}

/// The judged point that an entry lies nearest to, in shares of the axes' lengths, and whether it is that entry.
fn nearest(probe: &Probe, map: &VerdictMap, place: usize) -> (usize, bool) {
    let off = |other: usize| -> f64 {
        let pairs = probe.entries[place].source.iter().zip(&probe.entries[other].source);
        let share = |(axis, (a, b)): (&lookmatch_remap::Axis, (&f64, &f64))| {
            let steps = axis.nearest(*a).abs_diff(axis.nearest(*b)) as f64;
            (steps / (axis.len() - 1).max(1) as f64).powi(2)
        };
        probe.source_axes.iter().zip(pairs).map(share).sum()
    };
    let points = map.entries.iter().map(|other| off(*other)).enumerate();
    let k = points.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(k, _)| k);
    (k, map.entries[k] == place)
}

/// Draws a map with its legend.
pub(crate) fn draw<B: DrawingBackend>(
    map: &Map,
    area: &Area<B>,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let (left, right) = area.split_horizontally((PANEL.0 - LEGEND) * scale);
    match map.axes.len() {
        1 => strips(map, &left, scale)?,
        _ => plane(map, &left, scale)?,
    }
    legend(map, &right, scale)
}

fn plane<B: DrawingBackend>(
    map: &Map,
    area: &Area<B>,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let [x, y] = [0, 1].map(|k| map.axes[k].edges());
    let ends = |edges: &[f64]| edges[0]..edges[edges.len() - 1];
    let mut chart = ChartBuilder::on(area)
        .caption(&map.title, ("sans-serif", f64::from(13 * scale)))
        .margin(8 * scale)
        .x_label_area_size(40 * scale)
        .y_label_area_size(54 * scale)
        .build_cartesian_2d(ends(&x), ends(&y))?;
    let [across, up] = [0, 1].map(|k| &map.axes[k]);
    mesh(&mut chart, across, &up.label, &|t| short(up.value(t)), scale)?;
    let rows = up.centres.len();
    for (_, cells) in &map.methods {
        chart.draw_series(cells.iter().enumerate().map(|(place, cell)| {
            let (i, j) = (place / rows, place % rows);
            Rectangle::new([(x[i], y[j]), (x[i + 1], y[j + 1])], cell.colour().filled())
        }))?;
    }
    Ok(())
}

/// A strip for each method, the probe's on top.
fn strips<B: DrawingBackend>(
    map: &Map,
    area: &Area<B>,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let x = map.axes[0].edges();
    let count = map.methods.len();
    let mut chart = ChartBuilder::on(area)
        .caption(&map.title, ("sans-serif", f64::from(13 * scale)))
        .margin(8 * scale)
        .x_label_area_size(40 * scale)
        .build_cartesian_2d(x[0]..x[x.len() - 1], 0.0..count as f64)?;
    mesh(&mut chart, &map.axes[0], "", &|_| String::new(), scale)?;
    for (row, (name, cells)) in map.methods.iter().enumerate() {
        let bottom = (count - 1 - row) as f64;
        chart.draw_series(cells.iter().enumerate().map(|(i, cell)| {
            Rectangle::new([(x[i], bottom), (x[i + 1], bottom + STRIP)], cell.colour().filled())
        }))?;
        let font = ("sans-serif", f64::from(12 * scale)).into_font();
        chart.draw_series([Text::new(name.clone(), (x[0], bottom + 0.9), font)])?;
    }
    Ok(())
}

/// What the colours say, and at how many points.
fn legend<B: DrawingBackend>(
    map: &Map,
    area: &Area<B>,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let at = |x: u32, y: u32| ((x * scale) as i32, (y * scale) as i32);
    let font = || ("sans-serif", f64::from(11 * scale)).into_font();
    let mut y = 44;
    for (k, verdict) in Verdict::ALL.into_iter().enumerate() {
        area.draw(&Rectangle::new([at(0, y), at(14, y + 14)], colour(verdict).filled()))?;
        area.draw(&Text::new(verdict.title(), at(20, y + 1), font()))?;
        if let Some(counts) = map.counts {
            let count = format!("{} of {}", counts[k], counts.iter().sum::<usize>());
            area.draw(&Text::new(count, at(20, y + 15), font()))?;
        }
        y += 40;
    }
    if map.methods.iter().any(|(_, cells)| cells.iter().any(|cell| !cell.is_judged)) {
        for (line, k) in ["pale: not judged,", "shown like the", "nearest that was"].into_iter().zip(0..) {
            area.draw(&Text::new(line, at(0, y + 14 * k), font()))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use lookmatch_imaging::delta_e2000;

    use super::*;

    /// Machado, Oliveira and Fernandes (2009), severity 1: linear RGB without the cones for long, middle and short waves.
    const BLIND: [[[f64; 3]; 3]; 3] = [
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    ];

    #[test]
    fn colours_are_told_apart_by_the_colour_blind() {
        let linear = |c: u8| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        let lab = |rgb: [f64; 3]| {
            let to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];
            let white = [0.9505, 1.0, 1.089];
            let row =
                |k: usize| (0..3).map(|c| to_xyz[k][c] * rgb[c].clamp(0.0, 1.0)).sum::<f64>() / white[k];
            let f = [0, 1, 2].map(|k| row(k).max(1e-3).cbrt());
            [116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])]
        };
        for blind in BLIND {
            let seen = |verdict: Verdict| {
                let RGBColor(r, g, b) = colour(verdict);
                let rgb = [r, g, b].map(linear);
                lab(blind.map(|row| row.iter().zip(rgb).map(|(a, b)| a * b).sum()))
            };
            for [a, b] in [[0, 1], [0, 2], [1, 2]] {
                let [a, b] = [a, b].map(|k| Verdict::ALL[k]);
                let distance = delta_e2000(seen(a), seen(b));
                assert!(distance > 25.0, "{a:?}, {b:?}: {distance}");
            }
        }
    }

    #[test]
    fn what_was_not_judged_is_paler() {
        for verdict in Verdict::ALL {
            let [judged, other] = [true, false].map(|is_judged| Cell { verdict, is_judged }.colour());
            assert_eq!(judged, colour(verdict));
            let sum = |c: RGBColor| u32::from(c.0) + u32::from(c.1) + u32::from(c.2);
            assert!(sum(other) > sum(judged) + 100, "{other:?}");
        }
    }
}
