//! `lookmatch apply`: one material through a probe.

use lookmatch_materials::Material;
use lookmatch_remap::{Applied, Probe, apply, apply_smoothly};
use serde_json::json;

use crate::Usage;
use crate::args::ApplyArgs;
use crate::output::{print, print_json};

pub(crate) fn run(args: &ApplyArgs) -> anyhow::Result<()> {
    if !args.textures.texture.is_empty() {
        return super::apply_textures::run(args);
    }
    let probe = Probe::read(&args.probe)?;
    let source = source(&probe, args, &[])?;
    let mut applied = through(&probe, &source, args)?;
    for file in &args.then {
        let next = Probe::read(file)?;
        let (given, taken) = (applied.target.model().name, next.from.model().name);
        if given != taken {
            let wrong = format!("'{}' starts from {taken}, but what goes into it is {given}", file.display());
            return Err(Usage(wrong).into());
        }
        let on = through(&next, &applied.target, args)?;
        // Differences along a chain add up to no more than their sum.
        applied = Applied { source: applied.source, fitness: applied.fitness + on.fitness, ..on };
    }
    if args.json.json {
        return print_json(&json!({
            "source": applied.source, "target": applied.target, "spec": applied.target.to_string(),
            "fitness": applied.fitness, "saturated": applied.saturated, "clamped": applied.clamped,
            "forms": applied.forms.iter().map(|[name, form]| (name.clone(), json!(form))).collect::<serde_json::Map<_, _>>(),
            "outside_fit": applied.outside_fit,
        }));
    }
    print(&format!("{}\n", applied.target))
}

/// A material through a probe, with notes of what is less than sure.
fn through(probe: &Probe, source: &Material, args: &ApplyArgs) -> anyhow::Result<Applied> {
    let apply = if args.smooth { apply_smoothly } else { apply };
    let applied = apply(probe, source, args.clamp)?;
    for name in &applied.clamped {
        eprintln!("note: {name} was moved into the probe's range");
    }
    for name in &applied.saturated {
        eprintln!(
            "note: {name} sits on the edge of the range that was searched; a better match may lie beyond"
        );
    }
    for name in &applied.outside_fit {
        eprintln!("note: {name} is the fit's, which saw no entry around here");
    }
    for [name, form] in applied.forms.iter().filter(|_| args.smooth) {
        eprintln!("{name}: {form}");
    }
    Ok(applied)
}

/// The source with the values that are given for its parameters. Every parameter that the probe tabulates must have one, or be
/// `textured`.
pub(super) fn source(probe: &Probe, args: &ApplyArgs, textured: &[&str]) -> anyhow::Result<Material> {
    let mut source = probe.from.clone();
    let model = source.model();
    let resolved = textured.iter().map(|name| model.resolve(name)).collect::<Result<Vec<_>, _>>()?;
    let (textured, mut fixed) = (resolved.concat(), Vec::new());
    for (name, value) in pairs(args.values.iter().chain(&args.textures.fix), "NAME=VALUE")? {
        let indices = model.resolve(&name)?;
        if indices.iter().any(|i| fixed.contains(i)) {
            return Err(Usage(format!("'{name}' is given twice")).into());
        }
        if indices.iter().any(|i| textured.contains(i)) {
            return Err(Usage(format!("'{name}' has both a texture and a value")).into());
        }
        source.set(&name, &value)?;
        fixed.extend(indices);
    }
    for axis in &probe.source_axes {
        if model.resolve(&axis.name)?.iter().any(|i| !fixed.contains(i) && !textured.contains(i)) {
            let (name, min, max) = (&axis.name, axis.value(0), axis.value(axis.len() - 1));
            let names: Vec<&str> = probe.source_axes.iter().map(|a| a.name.as_str()).collect();
            return Err(Usage(format!(
                "the probe maps {}; give '{name}' too: {name}={min} to {max}, or --texture {name}=FILE",
                names.join(" and ")
            ))
            .into());
        }
    }
    Ok(source)
}

/// `NAME=VALUE`, each name once.
pub(super) fn pairs<'a>(
    texts: impl IntoIterator<Item = &'a String>,
    form: &str,
) -> anyhow::Result<Vec<(String, String)>> {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for text in texts {
        let (name, value) = text.split_once('=').ok_or_else(|| Usage(format!("'{text}' is not {form}")))?;
        if pairs.iter().any(|(other, _)| other == name.trim()) {
            return Err(Usage(format!("'{}' is given twice", name.trim())).into());
        }
        pairs.push((name.trim().to_owned(), value.trim().to_owned()));
    }
    Ok(pairs)
}
