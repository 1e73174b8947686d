//! Look-up tables as colour tools read them: `.cube` of Adobe and IRIDAS, with source parameters for colours that go in and
//! target parameters, scaled to 0…1, for those that come out.

use std::fmt::Write;

use lookmatch_remap::Probe;

use super::code::comment;
use super::{Exported, File, Format, Options};
use crate::function::{Function, Shape};
use crate::mapping::{Factor, Mapping, identifier};
use crate::question::grid;
use crate::ExportError;

/// `cube-lut`.
pub(crate) struct CubeLut;

/// Largest difference from the mapping that is aimed at.
const TOLERANCE: f64 = 1e-3;
/// Points along each axis, after which the error stays as it is, and is told: a table of three axes is 60 MB then.
const MAX_SIZES: [usize; 2] = [4096, 129];
/// Points at which sizes are judged, beside those of the tables.
const CHECKS: usize = 500;
const MAX_NODES: usize = 5_000;

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
            let advice = if axes.is_empty() { String::new() } else { format!(" ({}); --fix some of them", names.join(", ")) };
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
            return Err(ExportError::Request("no target parameter varies with what the probe tabulates: there is nothing to look up".into()));
        }
        let mut files = Vec::new();
        let mut outputs = Vec::new();
        for (number, functions) in held.chunks(3).enumerate() {
            let table = Table::new(&mapping, &axes, functions);
            outputs.extend(functions.iter().zip(&table.errors).map(|(f, e)| (mapping.functions[*f].name.clone(), Some(*e))));
            for (function, error) in functions.iter().zip(&table.errors).filter(|(_, e)| **e > TOLERANCE) {
                mapping.notes.push(format!(
                    "'{}' is off by up to {error:.1e}: {} points along each axis are the most that are written",
                    mapping.functions[*function].name, MAX_SIZES[usize::from(axes.len() > 1)]
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
    axes: Vec<[f64; 2]>,
    /// The inputs that are its axes.
    inputs: &'a [usize],
    functions: &'a [usize],
    size: usize,
    /// Smallest and largest value of each function.
    ranges: Vec<[f64; 2]>,
    /// Largest differences that linear interpolation leaves.
    errors: Vec<f64>,
}

impl<'a> Table<'a> {
    fn new(mapping: &Mapping, inputs: &'a [usize], functions: &'a [usize]) -> Self {
        let axes: Vec<[f64; 2]> = inputs.iter().map(|i| mapping.inputs[*i].range).collect();
        let mut table = Self { axes, inputs, functions, size: 2, ranges: Vec::new(), errors: Vec::new() };
        let points = table.checks(mapping);
        let exact: Vec<Vec<f64>> = functions.iter().map(|f| points.iter().map(|p| table.exact(mapping, *f, p)).collect()).collect();
        let errors = |size: usize| -> Vec<f64> {
            let error = |(f, exact): (&usize, &Vec<f64>)| {
                let found = points.iter().map(|p| table.interpolated(mapping, *f, p, size));
                found.zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            functions.iter().zip(&exact).map(error).collect()
        };
        let worst = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
        let mut best = (f64::INFINITY, 2, Vec::new());
        for size in sizes(inputs.len()) {
            let errors = errors(size);
            if worst(&errors) < best.0 {
                best = (worst(&errors), size, errors);
            }
            if best.0 <= TOLERANCE {
                break;
            }
        }
        let nodes = table.nodes(best.1);
        let range = |f: &usize| {
            let values = nodes.iter().map(|p| table.exact(mapping, *f, p));
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(v), r[1].max(v)])
        };
        let ranges = functions.iter().map(range).collect();
        (table.size, table.errors, table.ranges) = (best.1, best.2, ranges);
        table
    }

    /// Where sizes are judged: the points of the functions' own tables, where linear interpolation bends, and others.
    fn checks(&self, mapping: &Mapping) -> Vec<Vec<f64>> {
        let mut points: Vec<Vec<f64>> = Vec::new();
        for function in self.functions.iter().map(|f| &mapping.functions[*f]) {
            let Shape::Table { levels, .. } = &function.shape else { continue };
            let own = |(axis, input): (&[f64; 2], &usize)| {
                let place = function.arguments.iter().position(|a| a.input == *input && a.scale.is_none());
                place.map_or(vec![0.5 * (axis[0] + axis[1])], |place| levels[place].clone())
            };
            let nodes = grid(&self.axes.iter().zip(self.inputs).map(own).collect::<Vec<_>>());
            let step = nodes.len().div_ceil(MAX_NODES);
            points.extend(nodes.into_iter().step_by(step));
        }
        let golden = [0.618_033_988_749_895, 0.754_877_666_246_693, 0.819_172_513_396_165];
        let spread = |n: usize| (self.axes.iter().zip(golden)).map(move |([min, max], g)| min + (max - min) * (n as f64 * g).fract()).collect();
        points.extend((0..CHECKS).map(spread));
        points
    }

    fn exact(&self, mapping: &Mapping, function: usize, point: &[f64]) -> f64 {
        let mut values: Vec<f64> = mapping.inputs.iter().map(|i| i.default[0]).collect();
        self.inputs.iter().zip(point).for_each(|(i, v)| values[*i] = *v);
        Function::evaluate(&mapping.functions[function], &values)
    }

    /// The levels of each axis in a grid of a size.
    fn levels(&self, size: usize) -> Vec<Vec<f64>> {
        let level = |[min, max]: [f64; 2], k: usize| min + (max - min) * k as f64 / (size - 1) as f64;
        self.axes.iter().map(|axis| (0..size).map(|k| level(*axis, k)).collect()).collect()
    }

    /// The points of the grid, the first axis the fastest.
    fn nodes(&self, size: usize) -> Vec<Vec<f64>> {
        let mut levels = self.levels(size);
        levels.reverse();
        let mut nodes = grid(&levels);
        nodes.iter_mut().for_each(|node| node.reverse());
        nodes
    }

    /// What a reader of the table gets at a point.
    fn interpolated(&self, mapping: &Mapping, function: usize, point: &[f64], size: usize) -> f64 {
        let places = self.axes.iter().zip(point).map(|([min, max], v)| {
            let x = (v - min) / (max - min) * (size - 1) as f64;
            let low = x.floor().min((size - 2) as f64);
            [low, x - low]
        });
        let places: Vec<[f64; 2]> = places.collect();
        let corner = |corner: usize| {
            let (mut weight, mut at) = (1.0, Vec::new());
            for (k, ([low, t], [min, max])) in places.iter().zip(&self.axes).enumerate() {
                let side = (corner >> k & 1) as f64;
                weight *= if side == 1.0 { *t } else { 1.0 - t };
                at.push(min + (max - min) * (low + side) / (size - 1) as f64);
            }
            if weight == 0.0 { 0.0 } else { weight * self.exact(mapping, function, &at) }
        };
        (0..1usize << places.len()).map(corner).sum()
    }

    fn text(&self, mapping: &Mapping) -> String {
        let mut text = comment(&mapping.header, "#");
        let names: Vec<&str> = self.functions.iter().map(|f| mapping.functions[*f].name.as_str()).collect();
        let channels = ["red", "green", "blue"];
        text += "#\n# What goes in\n";
        for (channel, input) in channels.iter().zip(self.inputs) {
            writeln!(text, "#   {channel}: {}", mapping.inputs[*input].name).ok();
        }
        match self.inputs.len() {
            1 => text += "#   the same in all channels\n",
            2 => text += "#   blue: ignored\n",
            _ => {}
        }
        text += "# What comes out, linear between entries\n";
        for (k, (name, [min, max])) in names.iter().zip(&self.ranges).enumerate() {
            let factor = factor(mapping, self.functions[k]);
            let (channel, span, error) = (channels[k], max - min, self.errors[k]);
            writeln!(text, "#   {channel}: {name} = ({min} + {span} * {channel}){factor}, to {error:.1e}").ok();
        }
        writeln!(text, "TITLE \"{} to {}: {}\"", mapping.from, mapping.to, names.join(", ")).ok();
        let is_3d = self.inputs.len() > 1;
        writeln!(text, "{} {}", if is_3d { "LUT_3D_SIZE" } else { "LUT_1D_SIZE" }, self.size).ok();
        let end = |k: usize, side: usize| match self.axes.get(if is_3d { k } else { 0 }) {
            Some(axis) => axis[side],
            None => side as f64,
        };
        for (side, name) in ["DOMAIN_MIN", "DOMAIN_MAX"].iter().enumerate() {
            writeln!(text, "{name} {} {} {}", end(0, side), end(1, side), end(2, side)).ok();
        }
        let scaled = |point: &Vec<f64>, k: usize| match (self.functions.get(k), self.ranges.get(k)) {
            (Some(f), Some([min, max])) if max > min => (self.exact(mapping, *f, point) - min) / (max - min),
            _ => 0.0,
        };
        let mut plane = String::new();
        for point in self.nodes(self.size) {
            writeln!(plane, "{:.8} {:.8} {:.8}", scaled(&point, 0), scaled(&point, 1), scaled(&point, 2)).ok();
        }
        let copies = if self.inputs.len() == 2 { self.size } else { 1 };
        text + &plane.repeat(copies)
    }
}

/// Sizes that are tried: all small ones, then every eighth.
fn sizes(axes: usize) -> impl Iterator<Item = usize> {
    let most = MAX_SIZES[usize::from(axes > 1)];
    (2..=65).chain((73..=most).step_by(8)).chain([most])
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
