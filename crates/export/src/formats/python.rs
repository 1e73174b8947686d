//! Python: one module without dependencies, with a function and a command line.

use std::fmt::Write;

use super::Language;
use super::code::{comment, rows};
use super::spelling::Spelling;
use crate::function::{Function, Shape, cubic};
use crate::mapping::{Mapping, identifier};

/// `python`.
pub(crate) const PYTHON: Language = Language {
    name: "python",
    summary: "a Python 3 module without dependencies, with a function and a command line",
    text,
};

/// How Python spells expressions.
const SPELLING: Spelling = Spelling {
    number,
    clamp: |value, min, max| format!("min(max({value}, {min}), {max})"),
    log: "math.log",
    exp: "math.exp",
    function: |_, function| format!("_{}", identifier(&function.name)),
    hue: |name| format!("_hue({name})"),
};

fn number(value: f64) -> String {
    format!("{value:?}")
}

fn tuple(values: &[f64]) -> String {
    format!("({},)", values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", "))
}

fn text(mapping: &Mapping) -> String {
    let name = mapping.name();
    let mut text = comment(&mapping.header, "#") + "\n" + include_str!("python_runtime.py") + "\n\n";
    text += "# What the function takes: smallest and largest value, the probe's own, and whether it is a colour.\nINPUTS = {\n";
    for input in &mapping.inputs {
        let [min, max] = input.range.map(number);
        let default = if input.is_colour { tuple(&input.default) } else { "None".into() };
        writeln!(text, "    \"{}\": ({min}, {max}, {default}),", identifier(&input.name)).ok();
    }
    text += "}\n";
    for function in &mapping.functions {
        text += "\n\n";
        text += &definition(mapping, function);
    }
    let parameter = |i: &crate::Input| {
        let name = identifier(&i.name);
        if i.is_colour { format!("{name}={}", tuple(&i.default).replace(",)", ")")) } else { name }
    };
    let arguments: Vec<String> = mapping.inputs.iter().map(parameter).collect();
    let star = if arguments.is_empty() { "" } else { "*, " };
    let end = if arguments.is_empty() { "" } else { ", " };
    writeln!(text, "\n\ndef {name}({star}{}{end}clamp=False):", arguments.join(", ")).ok();
    writeln!(text, "    \"\"\"The parameters of {}, by name; colours are tuples.\n", mapping.to).ok();
    text += "    Raises ValueError for values outside the range of INPUTS; with clamp=True they are moved to its nearest end.\n    \"\"\"\n";
    for input in &mapping.inputs {
        let name = identifier(&input.name);
        writeln!(text, "    {name} = _checked(\"{name}\", {name}, clamp)").ok();
    }
    text += "    return {\n";
    for output in &mapping.outputs {
        let channels = SPELLING.expressions(mapping, output);
        let value = channels.join(", ");
        let value = if channels.len() == 1 { value } else { format!("({value})") };
        writeln!(text, "        \"{}\": {value},", output.name).ok();
    }
    for [parameter, value] in &mapping.choices {
        writeln!(text, "        \"{parameter}\": {value:?},").ok();
    }
    text += "    }\n\n\nif __name__ == \"__main__\":\n";
    writeln!(text, "    _main({name})").ok();
    text
}

/// A function, in full precision.
fn definition(mapping: &Mapping, function: &Function) -> String {
    let arguments = mapping.arguments(function);
    let name = identifier(&function.name);
    let constant = name.to_uppercase();
    let place = |(argument, name): (&crate::Argument, &String)| {
        argument.scale.map_or_else(|| name.clone(), |scale| SPELLING.normalised(name, &scale))
    };
    let places: Vec<String> = function.arguments.iter().zip(&arguments).map(place).collect();
    let places = places.iter().map(|p| format!("{p},")).collect::<Vec<_>>().join(" ");
    let array = |values: &[f64]| format!("({},\n)", rows(values, number, "    "));
    let mut text = String::new();
    let value = match &function.shape {
        Shape::Table { levels, values, nearest } => {
            let levels: Vec<String> = levels.iter().map(|l| format!("    {},", tuple(l))).collect();
            writeln!(text, "_{constant}_LEVELS = (\n{}\n)", levels.join("\n")).ok();
            writeln!(text, "_{constant}_VALUES = {}", array(values)).ok();
            let nearest = if *nearest { "True" } else { "False" };
            format!("_table(_{constant}_LEVELS, _{constant}_VALUES, ({places}), {nearest})")
        }
        Shape::Polynomial { terms } => {
            let terms: Vec<String> = (terms.iter())
                .map(|t| {
                    format!(
                        "    ({}, ({})),",
                        number(t.coefficient),
                        t.powers.iter().map(|n| format!("{n},")).collect::<String>()
                    )
                })
                .collect();
            writeln!(
                text,
                "# Coefficients, and the powers of the arguments.\n_{constant}_TERMS = (\n{}\n)",
                terms.join("\n")
            )
            .ok();
            format!("_polynomial(_{constant}_TERMS, ({places}))")
        }
        Shape::Spline { knots, values, slopes } => {
            let piece = |k: usize| {
                let [a, b, c] = cubic(knots, values, slopes, k);
                format!("    {},", tuple(&[values[k], a, b, c]))
            };
            let pieces: Vec<String> = (0..knots.len() - 1).map(piece).collect();
            writeln!(text, "_{constant}_KNOTS = {}", tuple(knots)).ok();
            writeln!(
                text,
                "# Between knots: powers 0 to 3 of the share of the interval.\n_{constant}_PIECES = (\n{}\n)",
                pieces.join("\n")
            )
            .ok();
            format!("_spline(_{constant}_KNOTS, _{constant}_PIECES, {})", places.trim_end_matches(','))
        }
    };
    let value = SPELLING.result(function, value);
    writeln!(text, "\n\ndef _{name}({}):\n    return {value}", arguments.join(", ")).ok();
    text
}
