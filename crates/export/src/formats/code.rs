//! What languages like C have in common: GLSL and OSL differ in little more than how arrays are written.

use std::fmt::Write;

use super::spelling::Spelling;
use crate::function::{Function, Shape, cubic};
use crate::mapping::{Factor, Mapping, identifier};

/// How these languages spell expressions.
pub(crate) const SPELLING: Spelling = Spelling {
    number,
    clamp: |value, min, max| format!("clamp({value}, {min}, {max})"),
    log: "log",
    exp: "exp",
    function: |mapping, function| format!("{}_{}", mapping.name(), identifier(&function.name)),
    hue: |name| format!("hue_{name}"),
};

/// A number as these languages read it, in single precision.
pub(crate) fn number(value: f64) -> String {
    format!("{:?}", value as f32)
}

/// Numbers in rows.
pub(crate) fn rows(values: &[f64], number: fn(f64) -> String, indent: &str) -> String {
    let rows = values.chunks(10).map(|row| row.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", "));
    format!("\n{indent}{}", rows.collect::<Vec<_>>().join(&format!(",\n{indent}")))
}

/// Text for compilers that read nothing but ASCII.
pub(crate) fn ascii(text: &str) -> String {
    let spelled = text
        .replace('α', "alpha")
        .replace('√', "sqrt ")
        .replace('−', "-")
        .replace('η', "eta")
        .replace('–', "-");
    spelled.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect()
}

/// Comment lines.
pub(crate) fn comment(lines: &[String], mark: &str) -> String {
    lines.iter().map(|line| format!("{mark} {line}").trim_end().to_owned() + "\n").collect()
}

/// The same in ASCII.
pub(crate) fn ascii_comment(lines: &[String], mark: &str) -> String {
    ascii(&comment(lines, mark))
}

/// A function in C.
pub(crate) struct Code {
    /// `float ward_to_ggx_roughness(float specular, float roughness)`.
    pub(crate) signature: String,
    /// Its constants: name and values.
    pub(crate) arrays: Vec<(String, Vec<f64>)>,
    /// What is between its braces, but for the constants.
    pub(crate) body: String,
}

/// Writes a function of a mapping.
pub(crate) fn code(mapping: &Mapping, function: &Function) -> Code {
    let name = (SPELLING.function)(mapping, function);
    let arguments = mapping.arguments(function);
    let mut code = Code {
        signature: format!(
            "float {name}({})",
            arguments.iter().map(|a| format!("float {a}")).collect::<Vec<_>>().join(", ")
        ),
        arrays: Vec::new(),
        body: String::new(),
    };
    let mut places = Vec::new();
    for (argument, name) in function.arguments.iter().zip(&arguments) {
        match argument.scale {
            None => places.push(name.clone()),
            Some(scale) => {
                writeln!(code.body, "    float u_{name} = {};", SPELLING.normalised(name, &scale)).ok();
                places.push(format!("u_{name}"));
            }
        }
    }
    let prefix = name.to_uppercase();
    let value = match &function.shape {
        Shape::Table { levels, values, nearest } => {
            code.table(&prefix, (levels, values, *nearest), (&places, &arguments))
        }
        Shape::Polynomial { terms } => {
            let product = |t: &lookmatch_remap::Term| {
                let powers = t.powers.iter().zip(&places).flat_map(|(n, u)| vec![u.clone(); *n as usize]);
                [number(t.coefficient)].into_iter().chain(powers).collect::<Vec<_>>().join(" * ")
            };
            terms.iter().map(product).collect::<Vec<_>>().join("\n        + ")
        }
        Shape::Spline { knots, values, slopes } => code.spline(&prefix, (knots, values, slopes), &places[0]),
    };
    writeln!(code.body, "    return {};", SPELLING.result(function, value)).ok();
    code
}

impl Code {
    /// Finds the interval of a place among levels: its number `i_NAME`, and where in it `t_NAME`.
    fn place(&mut self, array: &str, levels: &[f64], (place, name): (&str, &str)) {
        self.arrays.push((array.to_owned(), levels.to_vec()));
        let last = levels.len() - 1;
        let lines = [
            format!("int i_{name} = 0;"),
            format!("for (int k = 1; k < {last}; k++) {{ if ({place} >= {array}[k]) {{ i_{name} = k; }} }}"),
            format!("float from_{name} = {array}[i_{name}];"),
            format!("float to_{name} = {array}[i_{name} + 1];"),
            format!("float t_{name} = clamp(({place} - from_{name}) / (to_{name} - from_{name}), 0.0, 1.0);"),
        ];
        lines.iter().for_each(|line| writeln!(self.body, "    {line}").unwrap_or_default());
    }

    fn table(
        &mut self,
        prefix: &str,
        (levels, values, nearest): (&[Vec<f64>], &[f64], bool),
        (places, names): (&[String], &[String]),
    ) -> String {
        let mut index = String::from("0");
        for ((levels, place), name) in levels.iter().zip(places).zip(names) {
            self.place(&format!("{prefix}_{}_LEVELS", name.to_uppercase()), levels, (place, name));
            if nearest {
                writeln!(
                    self.body,
                    "    if (t_{name} > 0.5) {{ t_{name} = 1.0; }} else {{ t_{name} = 0.0; }}"
                )
                .ok();
            }
            index = if index == "0" {
                format!("i_{name}")
            } else {
                format!("({index}) * {} + i_{name}", levels.len())
            };
        }
        writeln!(self.body, "    int first = {index};").ok();
        let table = format!("{prefix}_VALUES");
        self.arrays.push((table.clone(), values.to_vec()));
        // Mixed along the last argument first.
        let offset = |corner: usize| {
            (0..levels.len()).fold(0, |sum, k| sum * levels[k].len() + (corner >> (levels.len() - 1 - k) & 1))
        };
        let read = |corner: usize| match offset(corner) {
            0 => format!("{table}[first]"),
            offset => format!("{table}[first + {offset}]"),
        };
        let mut mixed: Vec<String> = (0..1usize << levels.len()).map(read).collect();
        for name in names.iter().rev() {
            mixed = mixed.chunks(2).map(|p| format!("mix({}, {}, t_{name})", p[0], p[1])).collect();
        }
        mixed.swap_remove(0)
    }

    /// The value at a knot and a cubic of the share of the interval.
    fn spline(
        &mut self,
        prefix: &str,
        (knots, values, slopes): (&[f64], &[f64], &[f64]),
        place: &str,
    ) -> String {
        self.place(&format!("{prefix}_KNOTS"), knots, (place, "knot"));
        let intervals = knots.len() - 1;
        let coefficient = |n: usize| (0..intervals).map(|k| cubic(knots, values, slopes, k)[n]).collect();
        self.arrays.push((format!("{prefix}_VALUES"), values[..intervals].to_vec()));
        ["A", "B", "C"]
            .iter()
            .enumerate()
            .for_each(|(n, c)| self.arrays.push((format!("{prefix}_{c}"), coefficient(n))));
        let read = |c: &str| format!("{prefix}_{c}[i_knot]");
        let [value, a, b, c] = ["VALUES", "A", "B", "C"].map(read);
        format!("{value} + t_knot * ({a} + t_knot * ({b} + t_knot * {c}))")
    }
}

/// The coloured inputs whose hue is needed, which expressions call `hue_NAME`.
pub(crate) fn hues(mapping: &Mapping) -> Vec<String> {
    let formulas = || mapping.outputs.iter().flat_map(|o| &o.channels);
    let is_used = |i: &usize| formulas().any(|f| f.factor == Factor::Hue(*i));
    (0..mapping.inputs.len()).filter(is_used).map(|i| identifier(&mapping.inputs[i].name)).collect()
}
