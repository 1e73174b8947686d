//! A probe as a picture: each target parameter over the source parameters, as in Figure 11 of Guarnera *et al.* (2018), and a map of
//! what is left between source and target.

use lookmatch_materials::{Material, Scale};
use lookmatch_remap::{Axis, Entry, Flag, Probe};
use plotters::prelude::*;
use std::path::Path;

use crate::PlotError;
use crate::sheet::{self, Area, Drawing, Drawn, short};
use crate::verdicts;

/// Size of a panel, of the colour bar in it, and of the title above all, in pixels.
pub(crate) const PANEL: (u32, u32) = (430, 350);
const BAR: u32 = 100;
const TITLE: u32 = 64;
/// Samples along each axis of a smooth function.
const FINE: usize = 72;
/// Slices of a third source parameter.
const SLICES: usize = 3;

/// An axis of a panel: where its levels lie, and what they are called.
#[derive(Clone)]
pub(crate) struct Ruler {
    pub(crate) label: String,
    is_log: bool,
    /// Positions of the levels.
    pub(crate) centres: Vec<f64>,
}

/// Values over one or two axes, with the range of their colours.
struct Panel {
    title: String,
    axes: Vec<Ruler>,
    /// By place, the last axis the fastest; NaN where there is none.
    values: Vec<f64>,
    /// Lowest and highest value of the colour bar, and whether it is logarithmic.
    range: [f64; 2],
    is_log: bool,
    is_error: bool,
    /// A curve beside the points, for one axis.
    curve: Vec<(f64, f64)>,
    /// Marks on the cells.
    marks: Vec<(Vec<f64>, Flag)>,
}

impl Panel {
    /// Values of a parameter, with neither curve nor marks.
    fn new(title: String, axes: Vec<Ruler>, values: Vec<f64>, (range, is_log): ([f64; 2], bool)) -> Self {
        Self { title, axes, values, range, is_log, is_error: false, curve: vec![], marks: vec![] }
    }
}

/// What has a place of its own in a figure.
enum Tile {
    Values(Panel),
    Verdicts(verdicts::Map),
}

/// Draws a probe into a .png or .svg file.
///
/// # Errors
/// Another ending; a probe of a single material; a file that cannot be written.
pub fn draw_probe(probe: &Probe, path: &Path) -> Result<(), PlotError> {
    if probe.source_axes.is_empty() {
        return Err(PlotError::NoAxis);
    }
    let rows = rows(probe)?;
    let columns = rows.iter().map(Vec::len).max().unwrap_or(1) as u32;
    let size = (columns * PANEL.0, TITLE + rows.len() as u32 * PANEL.1);
    sheet::write(path, size, &Probed { probe, rows })
}

/// A probe with its panels.
struct Probed<'a> {
    probe: &'a Probe,
    rows: Vec<Vec<Tile>>,
}

impl Drawing for Probed<'_> {
    fn draw<B: DrawingBackend>(&self, root: &Area<B>, scale: u32) -> Drawn {
        figure(self.probe, root, &self.rows, scale)
    }
}

/// All that is drawn, by rows: the table and the fit, or slices of the table; then the verdicts, where there are some.
fn rows(probe: &Probe) -> Result<Vec<Vec<Tile>>, PlotError> {
    let axes = &probe.source_axes;
    // A plane of the two last axes; the others are cut.
    let shown = axes.len().saturating_sub(2)..axes.len();
    let scales: Vec<Ruler> = axes[shown].iter().map(|a| scale(&probe.from, a)).collect::<Result<_, _>>()?;
    let slices = slices(probe);
    let panels = if axes.len() > 2 { sliced(probe, &scales, &slices)? } else { whole(probe, &scales)? };
    let values = panels.into_iter().map(|row| row.into_iter().map(Tile::Values).collect());
    let seen = slices.iter().flat_map(|(at, places)| verdicts::rows(probe, &scales, places, at));
    Ok(values.chain(seen.map(|row| row.into_iter().map(Tile::Verdicts).collect())).collect())
}

/// The table over one or two axes, and the fit.
fn whole(probe: &Probe, scales: &[Ruler]) -> Result<Vec<Vec<Panel>>, PlotError> {
    let title = |k: usize, what: &str| format!("{} – {what}", label(&probe.to, &probe.target_axes[k].name));
    let mut first = Vec::new();
    for (k, axis) in probe.target_axes.iter().enumerate() {
        let mut panel =
            panel(probe, scales, &all(probe), title(k, "table"), target(probe, axis)?, &|e| e.target[k]);
        if scales.len() == 1 {
            (panel.title, panel.curve) = (title(k, &form(probe, k)), curve(probe, &scales[0], k));
        }
        first.push(panel);
    }
    first.push(errors(probe, scales, &all(probe), ""));
    let Some(fit) = probe.fit.as_ref().filter(|_| scales.len() == 2) else { return Ok(vec![first]) };
    let mut second = Vec::new();
    for (k, parameter) in fit.parameters.iter().enumerate() {
        let Some(function) = parameter.function() else { continue };
        let fine: Vec<Vec<f64>> = scales.iter().map(fine).collect();
        let at = |place: usize| -> Vec<f64> {
            [fine[0][place / FINE], fine[1][place % FINE]]
                .iter()
                .zip(scales)
                .map(|(t, s)| s.value(*t))
                .collect()
        };
        let values = (0..FINE * FINE).map(|place| function.at(probe, &at(place))).collect();
        let axes = scales.iter().zip(fine).map(|(s, centres)| Ruler { centres, ..s.clone() }).collect();
        let Panel { range, is_log, .. } = first[k];
        let title = title(k, &parameter.describe());
        second.push(Panel::new(title, axes, values, (range, is_log)));
    }
    Ok(if second.is_empty() { vec![first] } else { vec![first, second] })
}

/// Where the last two axes are shown: everywhere, or at some levels of the axis before them and the middle levels of all before it. In
/// words, and the places of the entries.
fn slices(probe: &Probe) -> Vec<(String, Vec<usize>)> {
    let cut = probe.source_axes.len().saturating_sub(2);
    let Some(last) = cut.checked_sub(1) else { return vec![(String::new(), all(probe))] };
    let count = probe.source_axes[last].len();
    let mut levels: Vec<usize> = (0..SLICES).map(|k| k * (count - 1) / (SLICES - 1)).collect();
    levels.dedup();
    let slice = |level: usize| {
        let mut at: Vec<f64> = probe.source_axes[..cut].iter().map(|a| a.value(a.len() / 2)).collect();
        at[last] = probe.source_axes[last].value(level);
        let places = (0..probe.entries.len()).filter(|p| probe.entries[*p].source[..cut] == at[..]);
        let names = probe.source_axes.iter().zip(&at).map(|(a, v)| format!("{} {}", a.name, short(*v)));
        (format!(" at {}", names.collect::<Vec<_>>().join(", ")), places.collect())
    };
    levels.into_iter().map(slice).collect()
}

/// The table at some slices, a row each.
fn sliced(
    probe: &Probe,
    scales: &[Ruler],
    slices: &[(String, Vec<usize>)],
) -> Result<Vec<Vec<Panel>>, PlotError> {
    let row = |(at, places): &(String, Vec<usize>)| -> Result<Vec<Panel>, PlotError> {
        let mut panels = Vec::new();
        for (k, axis) in probe.target_axes.iter().enumerate() {
            let title = format!("{}{at}", label(&probe.to, &axis.name));
            panels.push(panel(probe, scales, places, title, target(probe, axis)?, &|e| e.target[k]));
        }
        panels.push(errors(probe, scales, places, at));
        Ok(panels)
    };
    slices.iter().map(row).collect()
}

fn all(probe: &Probe) -> Vec<usize> {
    (0..probe.entries.len()).collect()
}

/// The range of a target parameter's values, and whether its scale is logarithmic.
fn target(probe: &Probe, axis: &Axis) -> Result<([f64; 2], bool), PlotError> {
    let k = probe.target_axes.iter().position(|a| a.name == axis.name).unwrap_or(0);
    let is_log = scale(&probe.to, axis)?.is_log;
    Ok((range(probe.found().map(|e| e.target[k])), is_log))
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [min, max] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    if max > min { [min, max] } else { [min - 0.5 * min.abs().max(0.1), max + 0.5 * max.abs().max(0.1)] }
}

/// The masked NRMSD of the entries, the whole picture's where the metric had no mask.
fn errors(probe: &Probe, scales: &[Ruler], places: &[usize], at: &str) -> Panel {
    let masked = probe.metric.mask;
    let error = |e: &Entry| (if masked { e.nrmsd_masked } else { e.nrmsd }).iter().sum::<f64>() / 3.0;
    let title = format!("NRMSD{}, mean of R, G, B{at}", if masked { " (masked)" } else { "" });
    let highest = probe.found().map(error).fold(1e-4, f64::max);
    let mut panel = panel(probe, scales, places, title, ([0.0, highest], false), &error);
    let cut = probe.source_axes.len() - scales.len();
    panel.is_error = true;
    for place in places {
        let at: Vec<f64> =
            probe.entries[*place].source[cut..].iter().zip(scales).map(|(v, s)| s.position(*v)).collect();
        panel.marks.extend(probe.flags(*place).into_iter().map(|flag| (at.clone(), flag)));
    }
    panel
}

/// A panel of what some entries say.
fn panel(
    probe: &Probe,
    scales: &[Ruler],
    places: &[usize],
    title: String,
    range: ([f64; 2], bool),
    value: &dyn Fn(&Entry) -> f64,
) -> Panel {
    let of = |place: &usize| {
        let entry = &probe.entries[*place];
        if entry.failed.is_some() { f64::NAN } else { value(entry) }
    };
    Panel::new(title, scales.to_vec(), places.iter().map(of).collect(), range)
}

/// A parameter with its unit.
fn label(material: &Material, name: &str) -> String {
    let model = material.model();
    let unit = model.parameter(name).map_or("1", |parameter| parameter.unit);
    format!("{} {name} [{unit}]", model.name)
}

fn scale(material: &Material, axis: &Axis) -> Result<Ruler, PlotError> {
    let range = material.model().parameter(&axis.name)?.range();
    let is_log = axis.value(0) > 0.0 && range.is_some_and(|r| r.scale == Scale::Logarithmic);
    let mut scale = Ruler { label: label(material, &axis.name), is_log, centres: Vec::new() };
    scale.centres = axis.levels.iter().map(|v| scale.position(*v)).collect();
    Ok(scale)
}

impl Ruler {
    fn position(&self, value: f64) -> f64 {
        if self.is_log { value.log10() } else { value }
    }

    pub(crate) fn value(&self, position: f64) -> f64 {
        if self.is_log { 10f64.powf(position) } else { position }
    }

    /// The ends of the levels' cells: halfway between them, and as far beyond the outer ones.
    pub(crate) fn edges(&self) -> Vec<f64> {
        let c = &self.centres;
        if c.len() == 1 {
            return vec![c[0] - 0.5, c[0] + 0.5];
        }
        let mut edges = vec![c[0] - (c[1] - c[0]) / 2.0];
        edges.extend(c.windows(2).map(|w| (w[0] + w[1]) / 2.0));
        edges.push(c[c.len() - 1] + (c[c.len() - 1] - c[c.len() - 2]) / 2.0);
        edges
    }
}

/// Places for a smooth function, from the first level to the last.
fn fine(scale: &Ruler) -> Vec<f64> {
    let (first, last) = (scale.centres[0], scale.centres[scale.centres.len() - 1]);
    (0..FINE).map(|k| first + (last - first) * k as f64 / (FINE - 1) as f64).collect()
}

/// What gives the values of a target parameter, in words.
fn form(probe: &Probe, k: usize) -> String {
    probe.fit.as_ref().map_or_else(|| "table".into(), |fit| fit.parameters[k].describe())
}

/// The smooth function of a target parameter, or straight lines through the entries.
fn curve(probe: &Probe, scale: &Ruler, k: usize) -> Vec<(f64, f64)> {
    match probe.fit.as_ref().and_then(|fit| fit.parameters[k].function()) {
        Some(function) => {
            fine(scale).into_iter().map(|t| (t, function.at(probe, &[scale.value(t)]))).collect()
        }
        None => probe.found().map(|e| (scale.position(e.source[0]), e.target[k])).collect(),
    }
}

fn figure<B: DrawingBackend>(probe: &Probe, root: &Area<B>, rows: &[Vec<Tile>], scale: u32) -> Drawn {
    let told = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
    root.fill(&WHITE).map_err(told)?;
    let font = |size: u32| ("sans-serif", (size * scale) as f64).into_font();
    let headline = format!("{} → {}", probe.from.model().name, probe.to.model().name);
    let (title, body) = root.split_vertically(TITLE * scale);
    let at = |x: u32, y: u32| ((x * scale) as i32, (y * scale) as i32);
    title.draw(&Text::new(headline, at(14, 8), font(20))).map_err(told)?;
    let flags = flags(probe);
    let held: Vec<String> = flags.iter().map(|(_, name, count)| format!("{name}: {count}")).collect();
    let details = format!(
        "{} entries{}{}",
        probe.entries.len(),
        if held.is_empty() { "" } else { "; " },
        held.join(", ")
    );
    title.draw(&Text::new(details, at(14, 38), font(13))).map_err(told)?;
    let legend = marks_legend(&flags);
    for (k, (flag, name)) in legend.iter().enumerate() {
        let x = 470 + 170 * k as u32;
        mark(&title, *flag, at(x, 46), scale).map_err(told)?;
        title.draw(&Text::new(name.clone(), at(x + 12, 38), font(13))).map_err(told)?;
    }
    let columns = rows.iter().map(Vec::len).max().unwrap_or(1);
    for (area, place) in body.split_evenly((rows.len(), columns)).iter().zip(0..) {
        match rows[place / columns].get(place % columns) {
            Some(Tile::Values(panel)) if panel.axes.len() == 1 => line(panel, area, scale),
            Some(Tile::Values(panel)) => plane(panel, area, scale),
            Some(Tile::Verdicts(map)) => verdicts::draw(map, area, scale),
            None => Ok(()),
        }
        .map_err(told)?;
    }
    root.present().map_err(told)
}

/// The flags that entries of a probe have, in words, with their number.
fn flags(probe: &Probe) -> Vec<(Flag, &'static str, usize)> {
    let all = [
        (Flag::Failed, "failed"),
        (Flag::Saturated, "on the edge of a range"),
        (Flag::BelowNoise, "below noise"),
        (Flag::OutsideFit, "outside the fit"),
        (Flag::Unreachable, "unreachable"),
    ];
    let count = |flag: Flag| (0..probe.entries.len()).filter(|p| probe.flags(*p).contains(&flag)).count();
    all.into_iter().map(|(flag, name)| (flag, name, count(flag))).filter(|(_, _, count)| *count > 0).collect()
}

fn marks_legend(flags: &[(Flag, &'static str, usize)]) -> Vec<(Flag, String)> {
    flags
        .iter()
        .filter(|(flag, ..)| *flag != Flag::Failed)
        .map(|(flag, name, _)| (*flag, (*name).into()))
        .collect()
}

/// A mark of a flag, around a pixel.
fn mark<B: DrawingBackend>(
    area: &Area<B>,
    flag: Flag,
    (x, y): (i32, i32),
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let r = 3 * scale as i32;
    let stroke = |colour: RGBColor| colour.stroke_width(scale);
    match flag {
        Flag::Failed => Ok(()),
        Flag::Saturated => {
            area.draw(&Circle::new((x, y), r / 2 + 1, WHITE.filled()))?;
            area.draw(&Circle::new((x, y), r / 2 + 1, stroke(BLACK)))
        }
        Flag::BelowNoise => area.draw(&Cross::new((x, y), r, stroke(RED))),
        Flag::OutsideFit => area.draw(&Circle::new((x, y), r + scale as i32, stroke(RED))),
        Flag::Unreachable => area.draw(&TriangleMarker::new((x, y), r, RED.filled())),
    }
}

fn colour(panel: &Panel, value: f64) -> RGBColor {
    if !value.is_finite() {
        return RGBColor(190, 190, 190);
    }
    let scaled = |v: f64| if panel.is_log { v.log10() } else { v };
    let [min, max] = panel.range.map(scaled);
    let share = ((scaled(value) - min) / (max - min)).clamp(0.0, 1.0);
    let gradient = if panel.is_error { colorous::INFERNO } else { colorous::VIRIDIS };
    let colour = gradient.eval_continuous(share);
    RGBColor(colour.r, colour.g, colour.b)
}

/// A map of the two axes with its colour bar.
fn plane<B: DrawingBackend>(
    panel: &Panel,
    area: &Area<B>,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let (map, bar) = area.split_horizontally((PANEL.0 - BAR) * scale);
    let [x, y] = [0, 1].map(|k| panel.axes[k].edges());
    let ends = |edges: &[f64]| edges[0]..edges[edges.len() - 1];
    let font = |size: u32| ("sans-serif", (size * scale) as f64);
    let mut chart = ChartBuilder::on(&map)
        .caption(&panel.title, font(13))
        .margin(8 * scale)
        .x_label_area_size(40 * scale)
        .y_label_area_size(54 * scale)
        .build_cartesian_2d(ends(&x), ends(&y))?;
    mesh(&mut chart, &panel.axes[0], &panel.axes[1].label, &|t| short(panel.axes[1].value(t)), scale)?;
    let rows = panel.axes[1].centres.len();
    chart.draw_series(panel.values.iter().enumerate().map(|(place, value)| {
        let (i, j) = (place / rows, place % rows);
        Rectangle::new([(x[i], y[j]), (x[i + 1], y[j + 1])], colour(panel, *value).filled())
    }))?;
    for (at, flag) in &panel.marks {
        let pixel = chart.plotting_area().map_coordinate(&(at[0], at[1]));
        let (left, top) = map.get_base_pixel();
        mark(&map, *flag, (pixel.0 - left, pixel.1 - top), scale)?;
    }
    colour_bar(panel, &bar, scale)
}

/// The values of colours, from bottom to top.
fn colour_bar<B: DrawingBackend>(
    panel: &Panel,
    area: &Area<B>,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    const STEPS: usize = 100;
    let scaled = |v: f64| if panel.is_log { v.log10() } else { v };
    let back = |t: f64| if panel.is_log { 10f64.powf(t) } else { t };
    let [min, max] = panel.range.map(scaled);
    let at = |k: usize| min + (max - min) * k as f64 / STEPS as f64;
    let mut chart = ChartBuilder::on(area)
        .margin_top(34 * scale)
        .margin_bottom(48 * scale)
        .margin_right(10 * scale)
        .y_label_area_size(60 * scale)
        .build_cartesian_2d(0.0..1.0, min..max)?;
    chart
        .configure_mesh()
        .disable_x_axis()
        .disable_mesh()
        .y_labels(6)
        .y_label_formatter(&|t| short(back(*t)))
        .label_style(("sans-serif", (11 * scale) as f64))
        .draw()?;
    chart.draw_series((0..STEPS).map(|k| {
        Rectangle::new(
            [(0.0, at(k)), (1.0, at(k + 1))],
            colour(panel, back((at(k) + at(k + 1)) / 2.0)).filled(),
        )
    }))?;
    Ok(())
}

/// The values of one axis as points, with a curve.
fn line<B: DrawingBackend>(
    panel: &Panel,
    area: &Area<B>,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let axis = &panel.axes[0];
    let scaled = |v: f64| if panel.is_log { v.log10() } else { v };
    let back = |t: f64| if panel.is_log { 10f64.powf(t) } else { t };
    let [min, max] = panel.range.map(scaled);
    let (room, edges) = (0.05 * (max - min), axis.edges());
    let least = if panel.is_error { min } else { min - room };
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", (13 * scale) as f64))
        .margin(8 * scale)
        .margin_right(20 * scale)
        .x_label_area_size(40 * scale)
        .y_label_area_size(64 * scale)
        .build_cartesian_2d(edges[0]..edges[edges.len() - 1], least..max + room)?;
    let what = panel.title.split([',', '–']).next().unwrap_or_default().trim().to_owned();
    mesh(&mut chart, axis, &what, &|t| short(back(t)), scale)?;
    let blue = RGBColor(49, 104, 142);
    let curve: Vec<(f64, f64)> = panel.curve.iter().map(|(t, v)| (*t, scaled(*v))).collect();
    chart.draw_series([PathElement::new(curve, blue.stroke_width(2 * scale))])?;
    let points = axis.centres.iter().zip(&panel.values).filter(|(_, v)| v.is_finite());
    let points: Vec<(f64, f64)> = points.map(|(t, v)| (*t, scaled(*v))).collect();
    chart.draw_series(points.iter().map(|at| Circle::new(*at, 3 * scale, BLACK.filled())))?;
    for (at, flag) in &panel.marks {
        let Some(point) = points.iter().find(|(t, _)| *t == at[0]) else { continue };
        let pixel = chart.plotting_area().map_coordinate(point);
        let (left, top) = area.get_base_pixel();
        mark(area, *flag, (pixel.0 - left, pixel.1 - top), scale)?;
    }
    Ok(())
}

pub(crate) type Chart<'a, B> = ChartContext<
    'a,
    B,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

/// Axes with their names and numbers.
pub(crate) fn mesh<B: DrawingBackend>(
    chart: &mut Chart<B>,
    x: &Ruler,
    y: &str,
    y_text: &dyn Fn(f64) -> String,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc(&x.label)
        .y_desc(y)
        .x_labels(6)
        .y_labels(6)
        .x_label_formatter(&|t| short(x.value(*t)))
        .y_label_formatter(&|t| y_text(*t))
        .label_style(("sans-serif", (11 * scale) as f64))
        .axis_desc_style(("sans-serif", (13 * scale) as f64))
        .draw()
}
