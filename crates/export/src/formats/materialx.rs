//! MaterialX 1.39: a node with source parameters for inputs and target parameters for outputs, made of nodes of the standard
//! library, and a material that uses it where the target is a shader that MaterialX has.
//!
//! A table is a sum over its points of their values times the weights of linear interpolation. Weights are had four at a time: the
//! share of each interval is a clamped line, a weight is the difference of two of them. So a table of 20 × 35 points takes some
//! 150 nodes, and no branches.

mod graph;
mod table;

use lookmatch_remap::Probe;

use self::graph::{Arg, Element, Graph};
use super::{Exported, Format, Options};
use crate::ExportError;
use crate::function::{Function, Scale, Shape, cubic};
use crate::mapping::{Factor, Formula, Input, Mapping, Output, identifier};

/// `materialx`.
pub(crate) struct MaterialX;

impl Format for MaterialX {
    fn name(&self) -> &'static str {
        "materialx"
    }

    fn summary(&self) -> &'static str {
        "a MaterialX document (.mtlx): a node of standard nodes, and a material where the target is a MaterialX shader"
    }

    fn export(&self, probe: &Probe, options: &Options) -> Result<Exported, ExportError> {
        let mapping = Mapping::new(probe, options)?;
        let shader = SHADERS.iter().find(|shader| shader.model == mapping.to);
        let text = document(&mapping, shader);
        let ports = mapping.ports();
        let mut exported = Exported::of(mapping, text);
        exported.outputs.iter_mut().zip(ports).for_each(|(output, port)| output.0 = port);
        Ok(exported)
    }
}

/// A shader of MaterialX, and how a model of ours calls its parameters.
struct Shader {
    model: &'static str,
    node: &'static str,
    /// Parameters that have another name there; others have the same.
    renamed: &'static [(&'static str, &'static str)],
    /// A choice of ours that is a number there: its name, the option that is 1 there, the shader's input.
    switch: Option<[&'static str; 3]>,
}

const SHADERS: [Shader; 4] = [
    Shader { model: "standard-surface", node: "standard_surface", renamed: &[], switch: None },
    Shader { model: "openpbr", node: "open_pbr_surface", renamed: &[], switch: None },
    Shader {
        model: "usd-preview-surface",
        node: "UsdPreviewSurface",
        renamed: &[
            ("diffuse_color", "diffuseColor"),
            ("specular_color", "specularColor"),
            ("clearcoat_roughness", "clearcoatRoughness"),
        ],
        switch: Some(["use_specular_workflow", "1", "useSpecularWorkflow"]),
    },
    Shader { model: "gltf", node: "gltf_pbr", renamed: &[], switch: None },
];

impl Shader {
    fn input<'a>(&self, parameter: &'a str) -> &'a str {
        self.renamed.iter().find(|(ours, _)| *ours == parameter).map_or(parameter, |(_, theirs)| theirs)
    }

    /// The shader with its inputs from the node `probe`, and a material that uses it.
    fn material(&self, mapping: &Mapping) -> [Element; 2] {
        let mut surface = Element::new(self.node, &[("name", "surface"), ("type", "surfaceshader")]);
        for (output, port) in mapping.outputs.iter().zip(mapping.ports()) {
            let (name, kind) = (self.input(&output.name), kind(output.channels.len() == 3));
            let attributes = [("name", name), ("type", kind), ("nodename", "probe"), ("output", &port)];
            surface.children.push(Element::new("input", &attributes));
        }
        if let Some([ours, on, theirs]) = self.switch {
            let is_on = mapping.choices.iter().any(|[name, value]| name == ours && value == on);
            let attributes =
                [("name", theirs), ("type", "integer"), ("value", if is_on { "1" } else { "0" })];
            surface.children.push(Element::new("input", &attributes));
        }
        let name = format!("{}_material", mapping.name());
        let mut material = Element::new("surfacematerial", &[("name", &name), ("type", "material")]);
        let attributes = [("name", "surfaceshader"), ("type", "surfaceshader"), ("nodename", "surface")];
        material.children.push(Element::new("input", &attributes));
        [surface, material]
    }
}

fn kind(is_colour: bool) -> &'static str {
    if is_colour { "color3" } else { "float" }
}

/// A number as MaterialX writes it.
fn number(value: f64) -> String {
    (value as f32).to_string()
}

fn document(mapping: &Mapping, shader: Option<&Shader>) -> String {
    let name = mapping.name();
    let mut root = Element::new("materialx", &[("version", "1.39")]);
    let definition =
        [("name", format!("ND_{name}")), ("node", name.clone()), ("nodegroup", "material".into())];
    let mut definition = Element::named("nodedef", &definition);
    for input in &mapping.inputs {
        definition.children.push(port(input));
    }
    for (output, port) in mapping.outputs.iter().zip(mapping.ports()) {
        let attributes = [
            ("name", port),
            ("type", kind(output.channels.len() == 3).into()),
            ("doc", output.title.clone()),
        ];
        definition.children.push(Element::named("output", &attributes));
    }
    root.children.push(definition);
    root.children.push(implementation(mapping, &name));
    let values = |input: &Input| {
        let value =
            if input.is_colour { input.default.map(number).join(", ") } else { number(input.default[0]) };
        let kind = kind(input.is_colour);
        Element::named("input", &[("name", identifier(&input.name)), ("type", kind.into()), ("value", value)])
    };
    if let Some(shader) = shader {
        // With a single output, a node has its type.
        let kind = match &mapping.outputs[..] {
            [only] => kind(only.channels.len() == 3),
            _ => "multioutput",
        };
        let mut instance = Element::new(&name, &[("name", "probe"), ("type", kind)]);
        instance.children = mapping.inputs.iter().map(values).collect();
        root.children.push(instance);
        root.children.extend(shader.material(mapping));
    }
    let mut head = mapping.header.clone();
    head.push("Values outside the range are moved to its nearest end.".into());
    root.document(&head)
}

/// An input of the node's definition.
fn port(input: &Input) -> Element {
    let [min, max] = input.range;
    let all = |v: f64| if input.is_colour { [v; 3].map(number).join(", ") } else { number(v) };
    let value = if input.is_colour { input.default.map(number).join(", ") } else { number(input.default[0]) };
    Element::named(
        "input",
        &[
            ("name", identifier(&input.name)),
            ("type", kind(input.is_colour).into()),
            ("value", value),
            ("uimin", all(min)),
            ("uimax", all(max)),
            ("doc", input.title.clone()),
        ],
    )
}

fn implementation(mapping: &Mapping, name: &str) -> Element {
    let mut writer = Writer { mapping, graph: Graph::default() };
    let ports = mapping.ports();
    let outputs: Vec<Element> = (mapping.outputs.iter().zip(ports))
        .map(|(output, port)| {
            let node = writer.output(output);
            let kind = kind(output.channels.len() == 3);
            Element::named("output", &[("name", port), ("type", kind.into()), ("nodename", node)])
        })
        .collect();
    let attributes = [("name", format!("NG_{name}")), ("nodedef", format!("ND_{name}"))];
    let mut element = Element::named("nodegraph", &attributes);
    element.children = writer.graph.nodes;
    element.children.extend(outputs);
    element
}

/// Writes the formulas of a mapping as nodes.
struct Writer<'a> {
    mapping: &'a Mapping,
    graph: Graph,
}

impl Writer<'_> {
    /// The node that gives an output.
    fn output(&mut self, output: &Output) -> String {
        let name = identifier(&output.name);
        if let Some(node) = self.constant(output, &name) {
            return node;
        }
        let first = output.channels[0];
        let is_grey = output.channels.iter().all(|c| *c == first) && !self.differs(&first);
        let count = if is_grey { 1 } else { output.channels.len() };
        let channels: Vec<String> = (0..count).map(|c| self.channel(output, c)).collect();
        if output.channels.len() == 1 {
            return channels[0].clone();
        }
        let node = |c: usize| Arg::node(&channels[c % count]);
        let inputs = [("in1", "float", node(0)), ("in2", "float", node(1)), ("in3", "float", node(2))];
        self.graph.add("combine3", "color3", &format!("{name}_channels"), &inputs)
    }

    fn constant(&mut self, output: &Output, name: &str) -> Option<String> {
        let value = |formula: &Formula| match (formula.function, formula.factor) {
            (None, Factor::Constant(value)) => Some(number(value)),
            _ => None,
        };
        let values: Vec<String> = output.channels.iter().map(value).collect::<Option<_>>()?;
        let kind = kind(output.channels.len() == 3);
        let inputs = [("value", kind, Arg::value(values.join(", ")))];
        Some(self.graph.push(Element::node("constant", kind, &inputs), &format!("{name}_constant")))
    }

    /// Whether a formula gives each channel another value.
    fn differs(&self, formula: &Formula) -> bool {
        let by_function =
            formula.function.is_some_and(|f| self.mapping.by_channel(&self.mapping.functions[f]));
        let by_factor = match formula.factor {
            Factor::Constant(_) => false,
            Factor::Input(i) | Factor::Hue(i) => self.mapping.inputs[i].is_colour,
        };
        by_function || by_factor
    }

    /// The node that gives a channel of an output.
    fn channel(&mut self, output: &Output, c: usize) -> String {
        let formula = output.channels[c];
        let name = if output.channels.len() == 3 {
            format!("{}_{}", output.name, ["r", "g", "b"][c])
        } else {
            output.name.clone()
        };
        let name = identifier(&name);
        let gain = formula.function.map(|f| self.function(&self.mapping.functions[f], c));
        let factor = match formula.factor {
            Factor::Constant(1.0) if gain.is_some() => None,
            Factor::Constant(value) => Some(Arg::value(number(value))),
            Factor::Input(i) => Some(Arg::node(&self.input(i, c))),
            Factor::Hue(i) => Some(Arg::node(&self.hue(i, c))),
        };
        let product = match (gain, factor) {
            (Some(gain), Some(factor)) => {
                let inputs = [("in1", "float", Arg::node(&gain)), ("in2", "float", factor)];
                Arg::node(&self.graph.add("multiply", "float", &format!("{name}_product"), &inputs))
            }
            (Some(gain), None) => return gain,
            (None, Some(factor)) => factor,
            (None, None) => Arg::value("1".into()),
        };
        self.clamp(product, output.range, &format!("{name}_in_range"))
    }

    fn clamp(&mut self, value: Arg, [low, high]: [f64; 2], name: &str) -> String {
        let limit = |v: f64| Arg::value(number(v));
        self.graph.add(
            "clamp",
            "float",
            name,
            &[("in", "float", value), ("low", "float", limit(low)), ("high", "float", limit(high))],
        )
    }

    /// A channel of an input, within its range.
    fn input(&mut self, i: usize, c: usize) -> String {
        let input = &self.mapping.inputs[i];
        let name = identifier(&input.name);
        let interface = Arg::Interface(name.clone());
        if !input.is_colour {
            return self.clamp(interface, input.range, &format!("{name}_in_range"));
        }
        let channels = format!("{name}_separated");
        let separate = self.graph.add("separate3", "multioutput", &channels, &[("in", "color3", interface)]);
        let (channel, suffix) = (["outr", "outg", "outb"][c], ["r", "g", "b"][c]);
        self.clamp(Arg::Node(separate, Some(channel)), input.range, &format!("{name}_{suffix}_in_range"))
    }

    /// A channel of a colour divided by the largest; 1 for black.
    fn hue(&mut self, i: usize, c: usize) -> String {
        let name = identifier(&self.mapping.inputs[i].name);
        let [r, g, b] = [0, 1, 2].map(|c| Arg::node(&self.input(i, c)));
        let channel = [&r, &g, &b][c].clone();
        let larger = self.graph.add(
            "max",
            "float",
            &format!("{name}_larger"),
            &[("in1", "float", r), ("in2", "float", g)],
        );
        let largest = [("in1", "float", Arg::node(&larger)), ("in2", "float", b)];
        let largest = self.graph.add("max", "float", &format!("{name}_largest"), &largest);
        // Both branches may be computed, and nothing be divided by zero.
        let least = [("in1", "float", Arg::node(&largest)), ("in2", "float", Arg::value("1e-30".into()))];
        let divisor = self.graph.add("max", "float", &format!("{name}_divisor"), &least);
        let suffix = ["r", "g", "b"][c];
        let share = [("in1", "float", channel), ("in2", "float", Arg::node(&divisor))];
        let share = self.graph.add("divide", "float", &format!("{name}_{suffix}_share"), &share);
        let zero = [
            ("value1", "float", Arg::node(&largest)),
            ("value2", "float", Arg::value("0".into())),
            ("in1", "float", Arg::node(&share)),
            ("in2", "float", Arg::value("1".into())),
        ];
        self.graph.add("ifgreater", "float", &format!("{name}_{suffix}_hue"), &zero)
    }

    /// The node that gives a function, for a channel of coloured inputs.
    fn function(&mut self, function: &Function, c: usize) -> String {
        let suffix = if self.mapping.by_channel(function) {
            format!("_{}", ["r", "g", "b"][c])
        } else {
            String::new()
        };
        let name = format!("{}_function{suffix}", identifier(&function.name));
        let mut places = Vec::new();
        for argument in &function.arguments {
            let value = self.input(argument.input, c);
            places.push(match argument.scale {
                None => value,
                Some(scale) => self.normalised(&value, scale),
            });
        }
        let value = match &function.shape {
            Shape::Table { levels, values, nearest } => {
                self.graph.table(&name, &places, levels, values, *nearest)
            }
            Shape::Polynomial { terms } => self.polynomial(&name, terms, &places),
            Shape::Spline { knots, values, slopes } => {
                self.spline(&name, (knots, values, slopes), &places[0])
            }
        };
        let value = if function.logarithmic {
            self.graph.add("exp", "float", &format!("{name}_exp"), &[("in", "float", Arg::node(&value))])
        } else {
            value
        };
        function
            .range
            .map_or(value.clone(), |range| self.clamp(Arg::node(&value), range, &format!("{name}_in_range")))
    }

    fn normalised(&mut self, value: &str, scale: Scale) -> String {
        let ends = [scale.min, scale.max].map(|v| if scale.logarithmic { v.ln() } else { v });
        let value = self.clamp(Arg::node(value), [scale.min, scale.max], &format!("{value}_clamped"));
        let value = if scale.logarithmic {
            self.graph.add("ln", "float", &format!("{value}_ln"), &[("in", "float", Arg::node(&value))])
        } else {
            value
        };
        let limit = |v: f64| Arg::value(number(v));
        let inputs = [
            ("in", "float", Arg::node(&value)),
            ("inlow", "float", limit(ends[0])),
            ("inhigh", "float", limit(ends[1])),
            ("outlow", "float", limit(-1.0)),
            ("outhigh", "float", limit(1.0)),
        ];
        self.graph.add("remap", "float", &format!("{value}_normalised"), &inputs)
    }

    fn multiply(&mut self, name: &str, a: Arg, b: Arg) -> String {
        self.graph.add("multiply", "float", name, &[("in1", "float", a), ("in2", "float", b)])
    }

    fn sum(&mut self, name: &str, a: Arg, b: Arg) -> String {
        self.graph.add("add", "float", name, &[("in1", "float", a), ("in2", "float", b)])
    }

    /// Powers first, then a product for each term.
    fn polynomial(&mut self, name: &str, terms: &[lookmatch_remap::Term], places: &[String]) -> String {
        let mut sum: Option<String> = None;
        for (t, term) in terms.iter().enumerate() {
            let mut product = Arg::value(number(term.coefficient));
            for (place, power) in places.iter().zip(&term.powers).filter(|(_, n)| **n > 0) {
                let power = (2..=*power).fold(place.clone(), |lower, n| {
                    self.multiply(&format!("{place}_power_{n}"), Arg::node(&lower), Arg::node(place))
                });
                product = Arg::node(&self.multiply(
                    &format!("{name}_term_{t}_{}", identifier(place)),
                    Arg::node(&power),
                    product,
                ));
            }
            sum = Some(match sum {
                Some(sum) => self.sum(&format!("{name}_sum_{t}"), Arg::node(&sum), product),
                None => self.sum(&format!("{name}_sum_{t}"), product, Arg::value("0".into())),
            });
        }
        sum.unwrap_or_default()
    }

    /// The value at the first knot, and for each interval the rise over as much of it as lies below the place.
    fn spline(
        &mut self,
        name: &str,
        (knots, values, slopes): (&[f64], &[f64], &[f64]),
        place: &str,
    ) -> String {
        let mut value = Arg::value(number(values[0]));
        let mut node = String::new();
        for k in 0..knots.len() - 1 {
            let [a, b, c] = cubic(knots, values, slopes, k).map(|v| Arg::value(number(v)));
            let limit = |v: f64| Arg::value(number(v));
            let line = [
                ("in", "float", Arg::node(place)),
                ("inlow", "float", limit(knots[k])),
                ("inhigh", "float", limit(knots[k + 1])),
            ];
            let line = self.graph.add("remap", "float", &format!("{name}_{k}_line"), &line);
            let t = self.clamp(Arg::node(&line), [0.0, 1.0], &format!("{name}_{k}_share"));
            let mut step = |prefix: &str, left: Arg, summand: Option<Arg>| {
                let product = self.multiply(&format!("{name}_{k}_{prefix}_product"), left, Arg::node(&t));
                let Some(summand) = summand else { return product };
                self.sum(&format!("{name}_{k}_{prefix}_sum"), Arg::node(&product), summand)
            };
            let inner = step("inner", c, Some(b));
            let middle = step("middle", Arg::node(&inner), Some(a));
            let rise = step("rise", Arg::node(&middle), None);
            node = self.sum(&format!("{name}_{k}_value"), Arg::node(&rise), value);
            value = Arg::node(&node);
        }
        node
    }
}
