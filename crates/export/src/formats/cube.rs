//! Look-up tables as colour tools read them: `.cube` of Adobe and IRIDAS, with source parameters for colours that go in and
//! target parameters, scaled to 0…1, for those that come out.

use std::fmt::Write;

use lookmatch_remap::Probe;

use super::code::ascii_comment;
use super::{Exported, File, Format, Options};
use crate::ExportError;
use crate::function::Shape;
use crate::mapping::{Factor, Mapping, identifier};
use crate::question::grid;

/// `cube-lut`.
pub(crate) struct CubeLut;

/// Largest difference from the mapping that is aimed at.
const TOLERANCE: f64 = 1e-3;
/// Points along each axis, after which the error stays as it is, and is told: a table of three axes is 60 MB then.
const MAX_SIZES: [usize; 2] = [4096, 129];
/// Points at which sizes are judged, beside those of the tables.
const CHECKS: usize = 500;
const MAX_NODES: usize = 5_000;
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

impl Format for CubeLut {
    fn name(&self) -> &'static str {
        "cube-lut"
    }

    fn summary(&self) -> &'static str {
        "a look-up table (.cube): 1D for one source parameter, 3D for two or three"
    }

    fn export(&self, probe: &Probe, options: &Options) -> Result<Exported, ExportError> {
        let mut mapping = Mapping::new(probe, options)?;
        let axes: Vec<usize> = (0..mapping.inputs.len()).filter(|i| mapping.inputs[*i].is_axis).collect();
        let names: Vec<&str> = axes.iter().map(|i| mapping.inputs[*i].name.as_str()).collect();
        if axes.is_empty() || axes.len() > 3 {
            let has = format!("a .cube file has one to three axes, this probe has {}", axes.len());
            let advice = if axes.is_empty() {
                String::new()
            } else {
                format!(" ({}); --fix some of them", names.join(", "))
            };
            return Err(ExportError::Request(has + &advice));
        }
        let (held, left_out): (Vec<usize>, Vec<usize>) =
            (0..mapping.functions.len()).partition(|f| !mapping.by_channel(&mapping.functions[*f]));
        for function in left_out {
            let name = &mapping.functions[function].name;
            let why = "it depends on each channel of a colour as well; --fix the colour";
            mapping.notes.push(format!("'{name}' is not in the table: {why}"));
        }
        if held.is_empty() {
            return Err(ExportError::Request(
                "no target parameter varies with what the probe tabulates: there is nothing to look up"
                    .into(),
            ));
        }
        let mut files = Vec::new();
        let mut outputs = Vec::new();
        for (number, functions) in held.chunks(3).enumerate() {
            let table = Table::new(&mapping, &axes, functions);
            outputs.extend(
                functions
                    .iter()
                    .zip(&table.errors)
                    .map(|(f, e)| (mapping.functions[*f].name.clone(), Some(*e))),
            );
            for (function, error) in functions.iter().zip(&table.errors).filter(|(_, e)| **e > TOLERANCE) {
                mapping.notes.push(format!(
                    "'{}' is off by up to {error:.1e} in the table, which has {} points along each axis; up to {} were tried",
                    mapping.functions[*function].name,
                    table.size,
                    MAX_SIZES[usize::from(axes.len() > 1)]
                ));
            }
            let suffix = if number == 0 { String::new() } else { format!("-{}", number + 1) };
            files.push(File { suffix, text: table.text(&mapping) });
        }
        let inputs = names.into_iter().map(identifier).collect();
        Ok(Exported { files, inputs, outputs, notes: mapping.notes })
    }
}

/// Up to three functions on a regular grid.
struct Table<'a> {
    axes: Vec<Axis>,
    /// The inputs that are its axes.
    inputs: &'a [usize],
    functions: &'a [usize],
    size: usize,
    /// Smallest and largest value of each function.
    ranges: Vec<[f64; 2]>,
    /// Largest differences that linear interpolation leaves.
    errors: Vec<f64>,
}

/// A source parameter as the table has it: by its value, or by its logarithm where that spans two decades.
struct Axis {
    min: f64,
    max: f64,
    is_logarithmic: bool,
    /// The fewest equal intervals whose ends have all levels of the functions among them; 1 where there are too many.
    intervals: usize,
}

impl Axis {
    fn new([min, max]: [f64; 2], levels: &[f64]) -> Self {
        let mut axis = Self { min, max, is_logarithmic: min > 0.0 && max > 100.0 * min, intervals: 1 };
        let is_on = |n: usize, level: f64| {
            let place = axis.place(level) * n as f64;
            (place - place.round()).abs() < 1e-6
        };
        let fits = |n: &usize| levels.iter().all(|level| is_on(*n, *level));
        axis.intervals = (1..MAX_SIZES[1]).find(fits).unwrap_or(1);
        axis
    }

    /// 0 to 1 over the range.
    fn place(&self, value: f64) -> f64 {
        let scaled = |v: f64| if self.is_logarithmic { v.ln() } else { v };
        (scaled(value) - scaled(self.min)) / (scaled(self.max) - scaled(self.min)).max(f64::MIN_POSITIVE)
    }

    fn value(&self, place: f64) -> f64 {
        let place = place.clamp(0.0, 1.0);
        if self.is_logarithmic {
            return self.min * (self.max / self.min).powf(place);
        }
        self.min + place * (self.max - self.min)
    }

    /// The place of the last of so many points: beyond 1, where values stay as they are at 1, so that levels come to lie on
    /// points.
    fn end(&self, size: usize) -> f64 {
        let last = size - 1;
        let used = if last < self.intervals { last } else { last - last % self.intervals };
        last as f64 / used as f64
    }

    /// Values at the ends of the grid, as the file has them.
    fn domain(&self, size: usize) -> [f64; 2] {
        if self.is_logarithmic {
            return [0.0, self.end(size)];
        }
        [self.min, self.min + self.end(size) * (self.max - self.min)]
    }
}

impl<'a> Table<'a> {
    fn new(mapping: &Mapping, inputs: &'a [usize], functions: &'a [usize]) -> Self {
        let axis = |i: &usize| Axis::new(mapping.inputs[*i].range, &levels(mapping, functions, *i));
        let axes = inputs.iter().map(axis).collect();
        let mut table = Self { axes, inputs, functions, size: 2, ranges: Vec::new(), errors: Vec::new() };
        let points = table.checks(mapping);
        let exact = |f: &usize| points.iter().map(|p| table.exact(mapping, *f, p)).collect();
        let exact: Vec<Vec<f64>> = functions.iter().map(exact).collect();
        let errors = |size: usize| -> Vec<f64> {
            let error = |(f, exact): (&usize, &Vec<f64>)| {
                let found = points.iter().map(|p| table.interpolated(mapping, *f, p, size));
                found.zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            functions.iter().zip(&exact).map(error).collect()
        };
        let (size, errors) = smallest(sizes(inputs.len()).map(|size| (size, errors(size))));
        let nodes = table.nodes(size);
        let range = |f: &usize| {
            let values = nodes.iter().map(|p| table.exact(mapping, *f, p));
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(v), r[1].max(v)])
        };
        let ranges = functions.iter().map(range).collect();
        (table.size, table.errors, table.ranges) = (size, errors, ranges);
        table
    }

    /// Where sizes are judged: at levels, where linear interpolation bends, and between them.
    fn checks(&self, mapping: &Mapping) -> Vec<Vec<f64>> {
        let own = |(axis, i): (&Axis, &usize)| {
            let levels = levels(mapping, self.functions, *i);
            if levels.is_empty() { vec![0.5 * (axis.min + axis.max)] } else { levels }
        };
        let nodes = grid(&self.axes.iter().zip(self.inputs).map(own).collect::<Vec<_>>());
        let step = nodes.len().div_ceil(MAX_NODES);
        let golden = [0.618_033_988_749_895, 0.754_877_666_246_693, 0.819_172_513_396_165];
        let spread = |n: usize| {
            let place = |(axis, g): (&Axis, f64)| axis.value((n as f64 * g).fract());
            self.axes.iter().zip(golden).map(place).collect()
        };
        nodes.into_iter().step_by(step).chain((0..CHECKS).map(spread)).collect()
    }

    fn exact(&self, mapping: &Mapping, function: usize, point: &[f64]) -> f64 {
        let mut values: Vec<f64> = mapping.inputs.iter().map(|i| i.default[0]).collect();
        self.inputs.iter().zip(point).for_each(|(i, v)| values[*i] = *v);
        mapping.functions[function].evaluate(&values)
    }

    /// The points of the grid, the first axis the fastest.
    fn nodes(&self, size: usize) -> Vec<Vec<f64>> {
        let level = |axis: &Axis, k: usize| axis.value(axis.end(size) * k as f64 / (size - 1) as f64);
        let levels: Vec<Vec<f64>> =
            self.axes.iter().rev().map(|axis| (0..size).map(|k| level(axis, k)).collect()).collect();
        let mut nodes = grid(&levels);
        nodes.iter_mut().for_each(|node| node.reverse());
        nodes
    }

    /// What a reader of the table gets at a point.
    fn interpolated(&self, mapping: &Mapping, function: usize, point: &[f64], size: usize) -> f64 {
        let step = |axis: &Axis| axis.end(size) / (size - 1) as f64;
        let place = |(axis, v): (&Axis, &f64)| {
            let x = axis.place(*v) / step(axis);
            let low = x.floor().clamp(0.0, (size - 2) as f64);
            [low, x - low]
        };
        let places: Vec<[f64; 2]> = self.axes.iter().zip(point).map(place).collect();
        let corner = |corner: usize| {
            let (mut weight, mut at) = (1.0, Vec::new());
            for (k, ([low, t], axis)) in places.iter().zip(&self.axes).enumerate() {
                let side = (corner >> k & 1) as f64;
                weight *= if side == 1.0 { *t } else { 1.0 - t };
                at.push(axis.value((low + side) * step(axis)));
            }
            if weight == 0.0 { 0.0 } else { weight * self.exact(mapping, function, &at) }
        };
        (0..1usize << places.len()).map(corner).sum()
    }

    /// What goes in and what comes out, as comments.
    fn legend(&self, mapping: &Mapping) -> String {
        let mut text = String::from("#\n# What goes in\n");
        for ((channel, input), axis) in CHANNELS.iter().zip(self.inputs).zip(&self.axes) {
            let (name, min) = (&mapping.inputs[*input].name, axis.min);
            let channel = if self.inputs.len() == 1 { "all channels" } else { channel };
            let scale = 1.0 / (axis.max / axis.min).ln();
            let value =
                if axis.is_logarithmic { format!("ln({name} / {min}) * {scale}") } else { name.clone() };
            writeln!(text, "#   {channel}: {value}").ok();
        }
        if self.inputs.len() == 2 {
            text += "#   blue: ignored\n";
        }
        text += "# What comes out, linear between entries\n";
        for (((channel, function), [min, max]), error) in
            CHANNELS.iter().zip(self.functions).zip(&self.ranges).zip(&self.errors)
        {
            let (name, factor) = (&mapping.functions[*function].name, factor(mapping, *function));
            writeln!(
                text,
                "#   {channel}: {name} = ({} + {} * {channel}){factor}, to {error:.1e}",
                tidy(*min),
                tidy(max - min)
            )
            .ok();
        }
        text
    }

    fn text(&self, mapping: &Mapping) -> String {
        let mut text = ascii_comment(&mapping.header, "#") + &self.legend(mapping);
        let names: Vec<&str> = self.functions.iter().map(|f| mapping.functions[*f].name.as_str()).collect();
        writeln!(text, "TITLE \"{} to {}: {}\"", mapping.from, mapping.to, names.join(", ")).ok();
        let is_3d = self.inputs.len() > 1;
        writeln!(text, "{} {}", if is_3d { "LUT_3D_SIZE" } else { "LUT_1D_SIZE" }, self.size).ok();
        let end = |k: usize, side: usize| {
            let axis = self.axes.get(if is_3d { k } else { 0 });
            axis.map_or(side as f64, |axis| axis.domain(self.size)[side])
        };
        for (side, name) in ["DOMAIN_MIN", "DOMAIN_MAX"].iter().enumerate() {
            writeln!(text, "{name} {} {} {}", tidy(end(0, side)), tidy(end(1, side)), tidy(end(2, side)))
                .ok();
        }
        let scaled = |point: &Vec<f64>, k: usize| match (self.functions.get(k), self.ranges.get(k)) {
            (Some(f), Some([min, max])) if max > min => (self.exact(mapping, *f, point) - min) / (max - min),
            _ => 0.0,
        };
        let mut plane = String::new();
        for point in self.nodes(self.size) {
            writeln!(plane, "{:.8} {:.8} {:.8}", scaled(&point, 0), scaled(&point, 1), scaled(&point, 2))
                .ok();
        }
        let copies = if self.inputs.len() == 2 { self.size } else { 1 };
        text + &plane.repeat(copies)
    }
}

/// The levels of an input in the tables of some functions: of the coarsest, since others bend little at theirs.
fn levels(mapping: &Mapping, functions: &[usize], input: usize) -> Vec<f64> {
    let of_function = |f: &usize| {
        let function = &mapping.functions[*f];
        let Shape::Table { levels, .. } = &function.shape else { return None };
        let place = function.arguments.iter().position(|a| a.input == input && a.scale.is_none())?;
        Some(levels[place].clone())
    };
    functions.iter().filter_map(of_function).min_by_key(Vec::len).unwrap_or_default()
}

/// Without the noise of the last digits.
fn tidy(value: f64) -> f64 {
    (value * 1e12).round() / 1e12
}

/// The first size that is good enough; where none is, the smallest that is nearly as good as the best.
fn smallest(tried: impl Iterator<Item = (usize, Vec<f64>)>) -> (usize, Vec<f64>) {
    let worst = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
    let mut all = Vec::new();
    for (size, errors) in tried {
        let is_enough = worst(&errors) <= TOLERANCE;
        all.push((size, errors));
        if is_enough {
            return all.pop().unwrap_or_default();
        }
    }
    let best = all.iter().map(|(_, errors)| worst(errors)).fold(f64::INFINITY, f64::min);
    all.into_iter().find(|(_, errors)| worst(errors) <= 1.25 * best).unwrap_or_default()
}

/// Sizes that are tried: all small ones, then every eighth.
fn sizes(axes: usize) -> impl Iterator<Item = usize> {
    let most = MAX_SIZES[usize::from(axes > 1)];
    (2..=129.min(most)).chain((161..=most).step_by(32)).chain([most])
}

/// What else the outputs of a function are multiplied with, in words.
fn factor(mapping: &Mapping, function: usize) -> String {
    let channels = mapping.outputs.iter().flat_map(|o| &o.channels).filter(|c| c.function == Some(function));
    let factors = channels.map(|c| match c.factor {
        Factor::Input(i) => format!(" * {}", mapping.inputs[i].name),
        Factor::Hue(i) => format!(" * the hue of {}", mapping.inputs[i].name),
        Factor::Constant(_) => String::new(),
    });
    factors.into_iter().next().unwrap_or_default()
}
