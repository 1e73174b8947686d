//! What `apply` does, as formulas.

use crate::function::Function;

/// A source parameter that an export takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// The parameter.
    pub name: String,
    /// What it does, in words.
    pub title: String,
    /// Three channels; else one number.
    pub is_colour: bool,
    /// Smallest and largest value, of each channel.
    pub range: [f64; 2],
    /// The probe's own value; the middle of the range for parameters that it tabulates.
    pub default: [f64; 3],
    /// True for what the probe tabulates; else it is carried over.
    pub is_axis: bool,
}

/// What the value of a function is multiplied with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Factor {
    /// A number.
    Constant(f64),
    /// An input, or the channel of one.
    Input(usize),
    /// A coloured input divided by its largest channel; 1 for black.
    Hue(usize),
}

/// One channel of a target parameter: `function × factor`, moved into the parameter's range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Formula {
    /// Which function of the mapping; none stands for 1.
    pub function: Option<usize>,
    /// What it is multiplied with.
    pub factor: Factor,
}

/// A target parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// The parameter.
    pub name: String,
    /// What it does, in words.
    pub title: String,
    /// One for a number, three for a colour.
    pub channels: Vec<Formula>,
    /// What the model takes.
    pub range: [f64; 2],
    /// Largest difference from `apply` that was measured, in the parameter's unit.
    pub error: f64,
}

/// Target parameters as functions of source parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapping {
    /// Name of the source model.
    pub from: String,
    /// Name of the target model.
    pub to: String,
    /// What is said of it at the head of a file, by line.
    pub header: Vec<String>,
    /// What it takes.
    pub inputs: Vec<Input>,
    /// What it gives: all parameters of the target that are numbers or colours.
    pub outputs: Vec<Output>,
    /// Those that are neither: a choice between formulas, a file.
    pub choices: Vec<[String; 2]>,
    /// What the outputs are made of.
    pub functions: Vec<Function>,
    /// What differs from `apply`, in sentences.
    pub notes: Vec<String>,
}

impl Mapping {
    /// Values of the outputs for values of the inputs, of which numbers use the first channel.
    pub fn evaluate(&self, inputs: &[[f64; 3]]) -> Vec<Vec<f64>> {
        let channel = |output: &Output, c: usize| {
            let formula = &output.channels[c];
            let read = |i: usize| inputs[i][if self.inputs[i].is_colour { c } else { 0 }];
            let gain = formula.function.map_or(1.0, |f| {
                let values: Vec<f64> = (0..inputs.len()).map(read).collect();
                self.functions[f].evaluate(&values)
            });
            let factor = match formula.factor {
                Factor::Constant(value) => value,
                Factor::Input(i) => read(i),
                Factor::Hue(i) => hue(inputs[i])[c],
            };
            (gain * factor).clamp(output.range[0], output.range[1])
        };
        self.outputs.iter().map(|o| (0..o.channels.len()).map(|c| channel(o, c)).collect()).collect()
    }

    pub(crate) fn drop_unused_functions(&mut self) {
        let mut formulas: Vec<&mut Formula> = self.outputs.iter_mut().flat_map(|o| &mut o.channels).collect();
        let is_used = |f: &usize| formulas.iter().any(|formula| formula.function == Some(*f));
        let used: Vec<usize> = (0..self.functions.len()).filter(is_used).collect();
        for formula in &mut formulas {
            formula.function = formula.function.and_then(|f| used.iter().position(|u| *u == f));
        }
        self.functions = used.into_iter().map(|f| self.functions[f].clone()).collect();
    }

    /// `ward_to_ggx`.
    pub fn name(&self) -> String {
        identifier(&format!("{}_to_{}", self.from, self.to))
    }

    /// Names of the outputs where they share a name space with the inputs: with the target's before them if one of them would
    /// clash.
    pub(crate) fn ports(&self) -> Vec<String> {
        let clashes = self.outputs.iter().any(|o| self.inputs.iter().any(|i| i.name == o.name));
        let prefix = if clashes { format!("{}_", self.to) } else { String::new() };
        self.outputs.iter().map(|o| identifier(&format!("{prefix}{}", o.name))).collect()
    }

    /// The inputs that a function reads, as files call them.
    pub(crate) fn arguments(&self, function: &Function) -> Vec<String> {
        function.arguments.iter().map(|a| identifier(&self.inputs[a.input].name)).collect()
    }

    /// Whether a function reads a coloured input, so that it has a value for each channel.
    pub(crate) fn by_channel(&self, function: &Function) -> bool {
        function.arguments.iter().any(|a| self.inputs[a.input].is_colour)
    }
}

pub(crate) fn hue(colour: [f64; 3]) -> [f64; 3] {
    let largest = colour.into_iter().fold(0.0, f64::max);
    if largest > 0.0 { colour.map(|v| v / largest) } else { [1.0; 3] }
}

/// Words of the languages that are written, which no parameter may be called.
const RESERVED: [&str; 24] = [
    "and",
    "as",
    "class",
    "clamp",
    "color",
    "def",
    "displacement",
    "exp",
    "float",
    "in",
    "int",
    "is",
    "lambda",
    "log",
    "matrix",
    "mix",
    "normal",
    "or",
    "out",
    "output",
    "point",
    "result",
    "surface",
    "vector",
];

/// A name as all languages accept it.
pub(crate) fn identifier(name: &str) -> String {
    let mut text: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    // Two underscores in a row are reserved in GLSL.
    while text.contains("__") {
        text = text.replace("__", "_");
    }
    let text = text.trim_matches('_').to_owned();
    if RESERVED.contains(&text.as_str()) {
        return format!("{text}_value");
    }
    if text.starts_with(|c: char| c.is_ascii_digit()) || text.is_empty() { format!("p{text}") } else { text }
}
