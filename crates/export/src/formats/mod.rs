//! The formats, one file each, and what their files have in common.

mod code;
mod csv;
mod cube;
mod glsl;
mod materialx;
mod osl;
mod python;
mod spelling;

use lookmatch_materials::Material;
use lookmatch_remap::Probe;

use crate::derive::Options;
use crate::mapping::identifier;
use crate::{ExportError, Mapping};

/// A language that probes can be written in.
pub trait Format: Sync {
    /// Name on the command line.
    fn name(&self) -> &'static str;

    /// One sentence.
    fn summary(&self) -> &'static str;

    /// Writes a probe down.
    ///
    /// # Errors
    /// What [`Mapping::new`] refuses; a probe that the format cannot hold.
    fn export(&self, probe: &Probe, options: &Options) -> Result<Exported, ExportError>;
}

/// A format whose file is a text that a mapping alone determines.
struct Language {
    name: &'static str,
    summary: &'static str,
    text: fn(&Mapping) -> String,
}

impl Format for Language {
    fn name(&self) -> &'static str {
        self.name
    }

    fn summary(&self) -> &'static str {
        self.summary
    }

    fn export(&self, probe: &Probe, options: &Options) -> Result<Exported, ExportError> {
        let mapping = Mapping::new(probe, options)?;
        let text = (self.text)(&mapping);
        Ok(Exported::of(mapping, text))
    }
}

/// All formats.
pub fn formats() -> &'static [&'static dyn Format] {
    &[&materialx::MaterialX, &glsl::GLSL, &osl::OSL, &python::PYTHON, &csv::Csv, &cube::CubeLut]
}

/// One of the files of an export.
#[derive(Clone, Debug, PartialEq)]
pub struct File {
    /// What is put before the extension of the name that the user gave; nothing for the first.
    pub suffix: String,
    /// Its content.
    pub text: String,
}

/// What an export consists of.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// One file, or several where one cannot hold it all.
    pub files: Vec<File>,
    /// Inputs and outputs: names as the file has them.
    pub inputs: Vec<String>,
    /// Outputs with the largest difference from `apply` that was measured; `None` where nothing is computed.
    pub outputs: Vec<(String, Option<f64>)>,
    /// What a user should know, in sentences.
    pub notes: Vec<String>,
}

impl Exported {
    /// An export of a mapping in one file.
    fn of(mapping: Mapping, text: String) -> Self {
        Self {
            files: vec![File { suffix: String::new(), text }],
            inputs: mapping.inputs.iter().map(|i| identifier(&i.name)).collect(),
            outputs: mapping.outputs.iter().map(|o| (identifier(&o.name), Some(o.error))).collect(),
            notes: mapping.notes,
        }
    }
}

/// What the head of every file says: what it is, of what, what goes in and what comes out.
pub(crate) fn head(probe: &Probe, mapping: &Mapping, base: &Material, options: &Options) -> Vec<String> {
    let (from, to) = (probe.from.model(), probe.to.model());
    let form = if options.smooth { "the fit of" } else { "the table of" };
    let command = if options.smooth { "apply --smooth" } else { "apply" };
    let mut lines = vec![
        format!(
            "{}: the parameters of {} that look most like a material of {}.",
            mapping.name(),
            to.title,
            from.title
        ),
        String::new(),
        format!(
            "From {form} {} by lookmatch {}; gives what its '{command}' gives.",
            options.title,
            env!("CARGO_PKG_VERSION")
        ),
        format!("Source: {base}"),
        format!("Target: {}", probe.to),
        format!("Mean fitness of its {} entries: {:.3}", probe.entries.len(), mean_fitness(probe)),
        String::new(),
        "Takes".into(),
    ];
    for input in &mapping.inputs {
        let [min, max] = input.range;
        let kind = if input.is_colour { ", linear RGB" } else { "" };
        lines.push(format!("  {}: {}, {min} to {max}{kind}", identifier(&input.name), input.title));
    }
    if mapping.inputs.is_empty() {
        lines.push("  nothing: the source is a single material".into());
    }
    lines.push("Gives".into());
    for output in &mapping.outputs {
        let by = output.channels.iter().find_map(|c| c.function).map(|f| mapping.functions[f].describe());
        let by = by.map(|by| format!("; {by}")).unwrap_or_default();
        lines.push(format!("  {}: {}{by}", identifier(&output.name), output.title));
    }
    for [name, value] in &mapping.choices {
        lines.push(format!("  {name} is always {value}"));
    }
    lines.extend(mapping.notes.iter().map(|note| format!("Note: {note}")));
    lines
}

fn mean_fitness(probe: &Probe) -> f64 {
    probe.found().map(|e| e.fitness).sum::<f64>() / probe.found().count().max(1) as f64
}
