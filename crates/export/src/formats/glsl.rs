//! GLSL: a function that returns the target's parameters, for OpenGL 3.3, OpenGL ES 3.0, WebGL 2, Vulkan and what follows them.

use std::fmt::Write;

use super::Language;
use super::code::{SPELLING, ascii_comment, code, hues, number, rows};
use crate::mapping::{Mapping, identifier};

/// `glsl`.
pub(crate) const GLSL: Language = Language {
    name: "glsl",
    summary: "a function for shaders (GLSL 3.30, GLSL ES 3.00 and later), to be included",
    text,
};

fn text(mapping: &Mapping) -> String {
    let name = mapping.name();
    let structure = format!("{}_parameters", identifier(&mapping.to));
    let mut text = ascii_comment(&mapping.header, "//");
    text += "// Values outside the range are moved to its nearest end.\n";
    text += "// Include it after #version 330, #version 300 es or later.\n";
    writeln!(text, "\nstruct {structure}\n{{").ok();
    for output in &mapping.outputs {
        writeln!(text, "    {} {};", kind(output.channels.len()), identifier(&output.name)).ok();
    }
    text += "};\n";
    for function in &mapping.functions {
        let code = code(mapping, function);
        text += "\n";
        for (array, values) in &code.arrays {
            let (n, values) = (values.len(), rows(values, number, "    "));
            writeln!(text, "const float {array}[{n}] = float[{n}]({values});").ok();
        }
        writeln!(text, "\n{}\n{{\n{}}}", code.signature, code.body).ok();
    }
    let hues = hues(mapping);
    if !hues.is_empty() {
        writeln!(
            text,
            "\n// A colour divided by its largest channel; white for black.\nvec3 {name}_hue(vec3 c)\n{{"
        )
        .ok();
        text += "    float largest = max(c[0], max(c[1], c[2]));\n";
        text += "    if (largest > 0.0) { return c / largest; }\n    return vec3(1.0, 1.0, 1.0);\n}\n";
    }
    let inputs = mapping
        .inputs
        .iter()
        .map(|i| format!("{} {}", kind(1 + 2 * usize::from(i.is_colour)), identifier(&i.name)));
    writeln!(text, "\n{structure} {name}({})\n{{", inputs.collect::<Vec<_>>().join(", ")).ok();
    writeln!(text, "    {structure} result;").ok();
    for hue in hues {
        writeln!(text, "    vec3 hue_{hue} = {name}_hue({hue});").ok();
    }
    for output in &mapping.outputs {
        let value = SPELLING.expressions(mapping, output).join(", ");
        let value = if output.channels.len() == 1 { value } else { format!("vec3({value})") };
        writeln!(text, "    result.{} = {value};", identifier(&output.name)).ok();
    }
    text + "    return result;\n}\n"
}

fn kind(channels: usize) -> &'static str {
    if channels == 3 { "vec3" } else { "float" }
}
