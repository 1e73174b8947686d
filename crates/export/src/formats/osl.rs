//! OSL: a shader with an input for each source parameter and an output for each target parameter.

use std::fmt::Write;

use super::Language;
use super::code::{SPELLING, ascii, ascii_comment, code, hues, number, rows};
use crate::mapping::{Input, Mapping, identifier};

/// `osl`.
pub(crate) const OSL: Language = Language {
    name: "osl",
    summary: "a shader node (Open Shading Language) with source parameters in and target parameters out",
    text,
};

fn text(mapping: &Mapping) -> String {
    let name = mapping.name();
    let mut text = ascii_comment(&mapping.header, "//");
    text += "// Values outside the range are moved to its nearest end.\n";
    for function in &mapping.functions {
        let code = code(mapping, function);
        writeln!(text, "\n{}\n{{", code.signature).ok();
        for (array, values) in &code.arrays {
            writeln!(text, "    float {array}[{}] = {{{}}};", values.len(), rows(values, number, "        "))
                .ok();
        }
        text = text + &code.body + "}\n";
    }
    let hues = hues(mapping);
    if !hues.is_empty() {
        text += "\n// A colour divided by its largest channel; white for black.\n";
        writeln!(text, "color {name}_hue(color c)\n{{\n    float largest = max(c[0], max(c[1], c[2]));").ok();
        text += "    if (largest > 0) return c / largest;\n    return color(1);\n}\n";
    }
    writeln!(text, "\nshader {name}(").ok();
    let inputs = mapping.inputs.iter().map(parameter);
    let ports = mapping.ports();
    let outputs = mapping.outputs.iter().zip(&ports).map(|(o, port)| {
        let kind = if o.channels.len() == 3 { "color" } else { "float" };
        format!("    output {kind} {port} = 0 [[ string help = \"{}\" ]]", ascii(&o.title))
    });
    text += &inputs.chain(outputs).collect::<Vec<_>>().join(",\n");
    text += ")\n{\n";
    for hue in hues {
        writeln!(text, "    color hue_{hue} = {name}_hue({hue});").ok();
    }
    for (output, port) in mapping.outputs.iter().zip(ports) {
        let value = SPELLING.expressions(mapping, output).join(", ");
        let value = if output.channels.len() == 1 { value } else { format!("color({value})") };
        writeln!(text, "    {port} = {value};").ok();
    }
    text + "}\n"
}

fn parameter(input: &Input) -> String {
    let name = identifier(&input.name);
    let [min, max] = input.range.map(number);
    let help = format!("string help = \"{}\"", ascii(&input.title));
    if input.is_colour {
        let default = input.default.map(number).join(", ");
        return format!("    color {name} = color({default}) [[ {help} ]]");
    }
    let default = number(input.default[0]);
    format!("    float {name} = {default} [[ float min = {min}, float max = {max}, {help} ]]")
}
