//! From a probe to formulas: each target parameter by the simplest that agrees with `apply`.

use lookmatch_materials::{Kind, Material, Parameter, Role, Value};
use lookmatch_remap::{Probe, Shape as FitShape};

use crate::carried::Column;
use crate::function::{Argument, Function, Scale, Shape};
use crate::mapping::{Factor, Formula, Input, Mapping, Output, hue};
use crate::question::{Answer, Point, Question};
use crate::{ExportError, formats};

/// What a user may choose.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Functions of the probe's fit where it has some, as `apply --smooth` uses them.
    pub smooth: bool,
    /// Source parameters that are no inputs but have a value: name and value as on the command line.
    pub fix: Vec<(String, String)>,
    /// What the probe is called, for the head of the file.
    pub title: String,
}

/// Points at which formulas are told from each other, and at which the result is measured.
const SAMPLES: usize = 48;
const CHECKS: usize = 400;
/// Two numbers that are taken for the same: formulas that are right agree to rounding.
const SAME: f64 = 1e-7;
/// Where the albedo of a body is matched, `apply` is content with such differences.
const MATCHED: f64 = 5e-4;
/// What an export may be off.
const PROMISED: f64 = 1e-3;
/// Levels of a colour that is carried over, to begin with.
const COLOUR_LEVELS: u32 = 5;

impl Mapping {
    /// Finds the formulas of a probe, and measures them against `apply`.
    ///
    /// # Errors
    /// A fixed parameter that does not exist, or has a value that the probe refuses; a probe without any result; a smooth
    /// mapping with a fixed parameter that the probe tabulates.
    pub fn new(probe: &Probe, options: &Options) -> Result<Self, ExportError> {
        if probe.found().next().is_none() {
            return Err(ExportError::Request("the probe has no result at all; remap again".into()));
        }
        let base = base(probe, options)?;
        let (mut inputs, mut levels) = inputs(probe, &base, options)?;
        let mut notes = notes(probe, options);
        loop {
            let question = Question::new(probe, (&base, options.smooth), &inputs, &levels);
            match (Derivation { question: &question, functions: Vec::new() }).run()? {
                Outcome::Found(outputs, functions) => {
                    let mut mapping = Self {
                        from: probe.from.model().name.into(),
                        to: probe.to.model().name.into(),
                        header: Vec::new(),
                        inputs: inputs.clone(),
                        outputs,
                        choices: choices(probe),
                        functions,
                        notes,
                    };
                    mapping.drop_unused_functions();
                    mapping.measure(&question)?;
                    mapping.header = formats::head(probe, &mapping, &base, options);
                    return Ok(mapping);
                }
                Outcome::Inexpressible { parameter, input } => {
                    let Input { name, default: [r, g, b], .. } = inputs.remove(input);
                    levels.remove(input);
                    notes.push(format!(
                        "'{parameter}' depends on '{name}' in a way that no formula here has: '{name}' is fixed at \
                         {r}/{g}/{b}; choose another value with --fix {name}=VALUE"
                    ));
                }
                Outcome::Unused(unused) => {
                    for place in unused.into_iter().rev() {
                        inputs.remove(place);
                        levels.remove(place);
                    }
                }
            }
        }
    }

    fn measure(&mut self, question: &Question) -> Result<(), ExportError> {
        let points = question.spread(CHECKS);
        for (point, answer) in points.iter().zip(question.ask_all(&points)?) {
            let Some(answer) = answer else { continue };
            let expected = answer.iter().filter(|numbers| !numbers.is_empty());
            let found = self.evaluate(point);
            for ((output, found), expected) in self.outputs.iter_mut().zip(found).zip(expected) {
                let errors = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
                output.error = errors.fold(output.error, f64::max);
            }
        }
        for output in self.outputs.iter().filter(|o| o.error > PROMISED) {
            self.notes.push(format!(
                "'{}' is off by up to {:.1e} from what apply gives",
                output.name, output.error
            ));
        }
        Ok(())
    }
}

fn base(probe: &Probe, options: &Options) -> Result<Material, ExportError> {
    let mut base = probe.from.clone();
    let mut named = Vec::new();
    for (name, value) in &options.fix {
        let indices = base.model().resolve(name)?;
        if indices.iter().any(|i| named.contains(i)) {
            return Err(ExportError::Request(format!("'{name}' is given twice")));
        }
        base.set(name, value)?;
        named.extend(indices);
    }
    Ok(base)
}

/// The axes of the probe, then what else `apply` takes from any source.
fn inputs(
    probe: &Probe,
    base: &Material,
    options: &Options,
) -> Result<(Vec<Input>, Vec<Vec<f64>>), ExportError> {
    let model = base.model();
    let mut taken = Vec::new();
    for (name, _) in &options.fix {
        taken.extend(model.resolve(name)?);
    }
    let (mut inputs, mut levels) = (Vec::new(), Vec::new());
    for axis in &probe.source_axes {
        let indices = model.resolve(&axis.name)?;
        let fixed = indices.iter().filter(|i| taken.contains(i)).count();
        if fixed == indices.len() {
            if options.smooth {
                let why = "functions of the fit need all parameters that the probe tabulates";
                return Err(ExportError::Request(format!("--smooth with --fix {}: {why}", axis.name)));
            }
            continue;
        }
        if fixed > 0 {
            let what = format!("the probe tabulates '{}' as one number: fix all of it or nothing", axis.name);
            return Err(ExportError::Request(what));
        }
        let range = [axis.value(0), axis.value(axis.len() - 1)];
        inputs.push(Input {
            name: axis.name.clone(),
            title: title(&model.parameters[indices[0]]),
            is_colour: false,
            range,
            default: [axis.value(axis.len() / 2); 3],
            is_axis: true,
        });
        levels.push(axis.levels.clone());
        taken.extend(indices);
    }
    for (index, parameter) in model.parameters.iter().enumerate() {
        let is_free = matches!(
            parameter.role,
            Role::DiffuseReflectance | Role::BaseColour | Role::ConductorIndex | Role::Extinction
        );
        let (true, false, Kind::Colour { range, .. }, Value::Colour(default)) =
            (is_free, taken.contains(&index), &parameter.kind, &base.values()[index])
        else {
            continue;
        };
        let [min, max] = [range.valid.nearest(range.valid.min), range.valid.nearest(range.valid.max)];
        inputs.push(Input {
            name: parameter.name.into(),
            title: title(parameter),
            is_colour: true,
            range: [min, max],
            default: *default,
            is_axis: false,
        });
        let level = |k: u32| min + (max - min) * f64::from(k) / f64::from(COLOUR_LEVELS - 1);
        levels.push((0..COLOUR_LEVELS).map(level).collect());
    }
    Ok((inputs, levels))
}

fn title(parameter: &Parameter) -> String {
    match parameter.unit {
        "1" | "" => parameter.role.title().into(),
        unit => format!("{}, in {unit}", parameter.role.title()),
    }
}

fn notes(probe: &Probe, options: &Options) -> Vec<String> {
    let mut notes = Vec::new();
    let failed = probe.entries.len() - probe.found().count();
    if failed > 0 {
        let entries = if failed == 1 { "1 entry has".into() } else { format!("{failed} entries have") };
        notes.push(format!("{entries} no result: the nearest that has one is used, where apply refuses"));
    }
    if options.smooth && probe.fit.is_none() {
        notes.push("the probe has no fit, its table is used; make one with lookmatch fit".into());
    }
    notes
}

fn choices(probe: &Probe) -> Vec<[String; 2]> {
    let parameters = probe.to.model().parameters.iter().zip(probe.to.values());
    let chosen = parameters.filter_map(|(p, value)| match value {
        Value::Choice(option) => Some([p.name.to_owned(), (*option).to_owned()]),
        Value::File(file) => Some([p.name.to_owned(), file.path.to_string()]),
        _ => None,
    });
    chosen.collect()
}

enum Outcome {
    Found(Vec<Output>, Vec<Function>),
    /// A target parameter and the input that it cannot be had for.
    Inexpressible {
        parameter: String,
        input: usize,
    },
    /// Inputs that nothing depends on.
    Unused(Vec<usize>),
}

/// A target parameter in the making.
struct Wanted<'a> {
    name: &'a str,
    /// Its place among the target's parameters.
    index: usize,
    range: [f64; 2],
    /// Points, and what `apply` gives there for this parameter.
    samples: Vec<(&'a Point, &'a [f64])>,
    channels: usize,
}

struct Derivation<'a> {
    question: &'a Question<'a>,
    functions: Vec<Function>,
}

impl Derivation<'_> {
    fn run(mut self) -> Result<Outcome, ExportError> {
        let question = self.question;
        let points = question.spread(SAMPLES);
        let answers = question.ask_all(&points)?;
        let unused = self.unused(&points, &answers)?;
        if !unused.is_empty() {
            return Ok(Outcome::Unused(unused));
        }
        let known: Vec<(&Point, &Vec<Vec<f64>>)> =
            points.iter().zip(&answers).filter_map(|(p, a)| Some((p, a.as_ref()?))).collect();
        if known.is_empty() {
            return Err(ExportError::Request(
                "the probe has no result nearly everywhere; remap again".into(),
            ));
        }
        let mut outputs = Vec::new();
        for (index, parameter) in question.probe.to.model().parameters.iter().enumerate() {
            let Some(range) = parameter.range() else { continue };
            let wanted = Wanted {
                name: parameter.name,
                index,
                range: [range.valid.nearest(range.valid.min), range.valid.max],
                samples: known.iter().map(|(p, a)| (*p, &a[index][..])).collect(),
                channels: known[0].1[index].len(),
            };
            let Some(channels) = self.formulas(&wanted)? else {
                let carried = question.carried();
                let input = carried.into_iter().find(|i| self.depends(&wanted, *i).unwrap_or(true));
                let input = input.ok_or_else(|| {
                    let what = format!("no formula was found for '{}' of the target", parameter.name);
                    ExportError::Request(format!("{what}; please report this probe"))
                })?;
                return Ok(Outcome::Inexpressible { parameter: parameter.name.into(), input });
            };
            outputs.push(Output {
                name: parameter.name.into(),
                title: title(parameter),
                channels,
                range: wanted.range,
                error: 0.0,
            });
        }
        Ok(Outcome::Found(outputs, self.functions))
    }

    /// Inputs beside the probe's own that no target parameter depends on.
    fn unused(&self, points: &[Point], answers: &[Answer]) -> Result<Vec<usize>, ExportError> {
        let mut unused = Vec::new();
        for input in self.question.carried() {
            let others = points.iter().map(|point| with(point, input, self.question.inputs[input].default));
            let others: Vec<Point> = others.take(8).collect();
            if self.question.ask_all(&others)?[..] == answers[..others.len()] {
                unused.push(input);
            }
        }
        Ok(unused)
    }

    fn depends(&self, wanted: &Wanted, input: usize) -> Result<bool, ExportError> {
        let default = self.question.inputs[input].default;
        for (point, value) in wanted.samples.iter().take(8) {
            let other = self.question.ask(&with(point, input, default))?;
            if other.is_some_and(|other| other[wanted.index] != *value) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// A formula for each channel of a parameter, if there are some.
    fn formulas(&mut self, wanted: &Wanted) -> Result<Option<Vec<Formula>>, ExportError> {
        let model = self.question.probe.to.model();
        for (k, axis) in self.question.probe.target_axes.iter().enumerate() {
            if model.resolve(&axis.name)?.contains(&wanted.index) {
                return self.searched(wanted, k);
            }
        }
        let channels = 0..wanted.channels;
        let constant = |c: usize| {
            let value = wanted.samples[0].1[c];
            let formula = Formula { function: None, factor: Factor::Constant(value) };
            let is_same = wanted.samples.iter().all(|(_, v)| (v[c] - value).abs() < SAME);
            is_same.then_some(formula)
        };
        if let Some(constants) = channels.map(constant).collect() {
            return Ok(Some(constants));
        }
        for input in 0..self.question.inputs.len() {
            let formula = Formula { function: None, factor: Factor::Input(input) };
            let copies = vec![formula; wanted.channels];
            if self.agrees(wanted, &copies, SAME) {
                return Ok(Some(copies));
            }
        }
        self.carried(wanted)
    }

    /// A searched parameter: its table or function, perhaps with a hue.
    fn searched(&mut self, wanted: &Wanted, k: usize) -> Result<Option<Vec<Formula>>, ExportError> {
        let question = self.question;
        let fit = question.probe.fit.as_ref().filter(|_| question.is_smooth);
        let function = match fit.and_then(|fit| fit.parameters[k].function()) {
            Some(function) => smooth(wanted.name, function, question),
            None => {
                let (axes, rest) = (question.axes(), question.defaults());
                let number = |answer: &[Vec<f64>]| answer[wanted.index].iter().copied().fold(0.0, f64::max);
                let column = Column { question, name: wanted.name, inputs: &axes, rest: &rest, number };
                column.at_levels(question.probe.target_axes[k].len() <= 2)?
            }
        };
        let function = self.keep(function);
        let carried = question.carried();
        let hues = carried.into_iter().filter(|i| question.inputs[*i].is_colour);
        // The tint of a source that always has the same.
        let brightest = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
        let tinted = wanted.samples.iter().find(|(_, v)| brightest(v) > 0.0);
        let tint = |c: usize| tinted.map_or(1.0, |(_, v)| v[c] / brightest(v));
        let tints = (0..wanted.channels).map(|c| Formula { function, factor: Factor::Constant(tint(c)) });
        let plain = Formula { function, factor: Factor::Constant(1.0) };
        let mut candidates = vec![vec![plain; wanted.channels], tints.collect()];
        candidates.extend(hues.map(|i| vec![Formula { function, factor: Factor::Hue(i) }; wanted.channels]));
        let found = candidates.into_iter().find(|c| self.agrees(wanted, c, SAME));
        Ok(found.map(|formulas| formulas.into_iter().map(|f| self.folded(f)).collect()))
    }

    /// What is carried over from the source and no copy of it: proportional to one of its colours, or a function of it.
    fn carried(&mut self, wanted: &Wanted) -> Result<Option<Vec<Formula>>, ExportError> {
        let question = self.question;
        let mut needed = Vec::new();
        for input in question.carried() {
            if self.depends(wanted, input)? {
                needed.push(input);
            }
        }
        let axes = question.axes();
        let before = self.functions.len();
        let factors = match needed[..] {
            [] => vec![Factor::Constant(1.0)],
            [input] => vec![Factor::Input(input), Factor::Hue(input)],
            _ => return Ok(None),
        };
        for factor in factors {
            let mut rest = question.defaults();
            if let [input] = needed[..] {
                let [min, max] = question.inputs[input].range;
                rest[input] = [min + 0.25 * (max - min); 3];
            }
            if !self.is_product(wanted, factor, &rest)? {
                continue;
            }
            let mut formulas = Vec::new();
            for c in 0..wanted.channels {
                let scale = match factor {
                    Factor::Input(input) => rest[input][c],
                    _ => 1.0,
                };
                let number = |answer: &[Vec<f64>]| answer[wanted.index][c] / scale;
                let column = Column { question, name: wanted.name, inputs: &axes, rest: &rest, number };
                formulas.push(Formula { function: self.keep(column.refined()?), factor });
            }
            if self.agrees(wanted, &formulas, PROMISED) {
                return Ok(Some(formulas.into_iter().map(|f| self.folded(f)).collect()));
            }
            self.functions.truncate(before);
        }
        let [input] = needed[..] else { return Ok(None) };
        if !self.keeps_channels(wanted, input)? {
            return Ok(None);
        }
        let all: Vec<usize> = axes.into_iter().chain([input]).collect();
        let (rest, number) = (question.defaults(), |answer: &[Vec<f64>]| answer[wanted.index][0]);
        let column = Column { question, name: wanted.name, inputs: &all, rest: &rest, number };
        let function = self.keep(column.refined()?);
        Ok(Some(vec![Formula { function, factor: Factor::Constant(1.0) }; wanted.channels]))
    }

    /// Whether a parameter is a factor times what does not depend on it, which is had where `rest` says.
    fn is_product(&self, wanted: &Wanted, factor: Factor, rest: &Point) -> Result<bool, ExportError> {
        let (Factor::Input(input) | Factor::Hue(input)) = factor else { return Ok(true) };
        let read = |colour: [f64; 3]| if let Factor::Hue(_) = factor { hue(colour) } else { colour };
        for (point, value) in wanted.samples.iter().take(16) {
            let Some(other) = self.question.ask(&with(point, input, rest[input]))? else { continue };
            let (here, there) = (read(point[input]), read(rest[input]));
            for (c, value) in value.iter().enumerate() {
                let foretold = other[wanted.index][c] / there[c] * here[c];
                if (foretold.clamp(wanted.range[0], wanted.range[1]) - value).abs() > MATCHED {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// Whether each channel depends on the same channel of an input alone, and all in the same way.
    fn keeps_channels(&self, wanted: &Wanted, input: usize) -> Result<bool, ExportError> {
        for (point, value) in wanted.samples.iter().take(16) {
            for (c, value) in value.iter().enumerate() {
                let grey = self.question.ask(&with(point, input, [point[input][c]; 3]))?;
                if grey.is_some_and(|grey| (grey[wanted.index][0] - value).abs() > MATCHED) {
                    return Ok(false);
                }
            }
        }
        Ok(wanted.channels == 3 || !self.question.inputs[input].is_colour)
    }

    fn agrees(&self, wanted: &Wanted, formulas: &[Formula], tolerance: f64) -> bool {
        let mapping = Mapping {
            from: String::new(),
            to: String::new(),
            header: Vec::new(),
            inputs: self.question.inputs.to_vec(),
            outputs: vec![Output {
                name: String::new(),
                title: String::new(),
                channels: formulas.to_vec(),
                range: wanted.range,
                error: 0.0,
            }],
            choices: Vec::new(),
            functions: self.functions.clone(),
            notes: Vec::new(),
        };
        wanted.samples.iter().all(|(point, value)| {
            let found = &mapping.evaluate(point)[0];
            found.iter().zip(*value).all(|(a, b)| (a - b).abs() <= tolerance)
        })
    }

    /// The place of a function, which is kept once whatever its name.
    fn keep(&mut self, mut function: Function) -> Option<usize> {
        let same = |other: &Function| Function { name: other.name.clone(), ..function.clone() } == *other;
        if let Some(place) = self.functions.iter().position(same) {
            return Some(place);
        }
        let is_free = |name: &String| self.functions.iter().all(|f| f.name != *name);
        let numbered = (2..).map(|n| format!("{}_{n}", function.name));
        function.name = [function.name.clone()].into_iter().chain(numbered).find(is_free).unwrap_or_default();
        self.functions.push(function);
        Some(self.functions.len() - 1)
    }

    /// A formula whose function is the same everywhere, without it.
    fn folded(&self, formula: Formula) -> Formula {
        let constant = formula.function.and_then(|f| self.functions[f].constant());
        match (constant, formula.factor) {
            (Some(value), Factor::Constant(factor)) => {
                Formula { function: None, factor: Factor::Constant(value * factor) }
            }
            (Some(1.0), _) => Formula { function: None, ..formula },
            _ => formula,
        }
    }
}

fn with(point: &Point, input: usize, value: [f64; 3]) -> Point {
    let mut point = point.clone();
    point[input] = value;
    point
}

/// A function of a fit.
fn smooth(name: &str, function: &lookmatch_remap::Function, question: &Question) -> Function {
    let argument = |input: &lookmatch_remap::Input| Argument {
        input: question.inputs.iter().position(|i| i.name == input.name).unwrap_or_default(),
        scale: Some(Scale { min: input.min, max: input.max, logarithmic: input.logarithmic }),
    };
    let shape = match &function.shape {
        FitShape::Polynomial { terms, .. } => Shape::Polynomial { terms: terms.clone() },
        FitShape::Spline { knots, values, slopes } => {
            Shape::Spline { knots: knots.clone(), values: values.clone(), slopes: slopes.clone() }
        }
        FitShape::Grid { nodes, values } => {
            Shape::Table { levels: nodes.clone(), values: values.clone(), nearest: false }
        }
    };
    let arguments = function.inputs.iter().map(argument).collect();
    let (logarithmic, range) = (function.logarithmic, Some([function.min, function.max]));
    Function { name: name.into(), arguments, shape, logarithmic, range }.simplified()
}
