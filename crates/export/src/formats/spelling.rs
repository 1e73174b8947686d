//! Formulas as expressions: the same in all languages but for a few words.

use crate::function::{Function, Scale};
use crate::mapping::{Factor, Formula, Mapping, Output, identifier};

/// The words in which languages differ.
pub(crate) struct Spelling {
    pub(crate) number: fn(f64) -> String,
    /// A value that is moved into the range between two others.
    pub(crate) clamp: fn(&str, &str, &str) -> String,
    /// The natural logarithm.
    pub(crate) log: &'static str,
    pub(crate) exp: &'static str,
    /// The name of a function of a mapping.
    pub(crate) function: fn(&Mapping, &Function) -> String,
    /// The hue of an input.
    pub(crate) hue: fn(&str) -> String,
}

impl Spelling {
    /// The expressions of an output's channels, within its range.
    pub(crate) fn expressions(&self, mapping: &Mapping, output: &Output) -> Vec<String> {
        let channel = |(c, formula): (usize, &Formula)| {
            let value = self.expression(mapping, formula, c);
            match formula.factor {
                // Only what is read from the source can lead out of the range.
                Factor::Constant(_) => value,
                _ => self.within(&value, output.range),
            }
        };
        output.channels.iter().enumerate().map(channel).collect()
    }

    fn expression(&self, mapping: &Mapping, formula: &Formula, channel: usize) -> String {
        let name = |i: usize| identifier(&mapping.inputs[i].name);
        let read = |i: usize| {
            if mapping.inputs[i].is_colour { format!("{}[{channel}]", name(i)) } else { name(i) }
        };
        let call = formula.function.map(|f| {
            let function = &mapping.functions[f];
            let arguments: Vec<String> = function.arguments.iter().map(|a| read(a.input)).collect();
            format!("{}({})", (self.function)(mapping, function), arguments.join(", "))
        });
        let factor = match formula.factor {
            Factor::Constant(1.0) if call.is_some() => None,
            Factor::Constant(value) => Some((self.number)(value)),
            Factor::Input(i) => Some(read(i)),
            Factor::Hue(i) => Some(format!("{}[{channel}]", (self.hue)(&name(i)))),
        };
        call.into_iter().chain(factor).collect::<Vec<_>>().join(" * ")
    }

    /// An argument as a function's shape reads it.
    pub(crate) fn normalised(&self, name: &str, scale: &Scale) -> String {
        let [factor, summand] = scale.line().map(self.number);
        let value = self.within(name, [scale.min, scale.max]);
        let value = if scale.logarithmic { format!("{}({value})", self.log) } else { value };
        format!("{factor} * {value} + {summand}")
    }

    /// What a function gives, from what its shape does.
    pub(crate) fn result(&self, function: &Function, shape: String) -> String {
        let value = if function.logarithmic { format!("{}({shape})", self.exp) } else { shape };
        match function.range {
            Some(range) => self.within(&value, range),
            None => value,
        }
    }

    fn within(&self, value: &str, range: [f64; 2]) -> String {
        let [min, max] = range.map(self.number);
        (self.clamp)(value, &min, &max)
    }
}
