//! `lookmatch apply`: one material through a probe.

use lookmatch_remap::{Probe, apply};
use serde_json::json;

use crate::Usage;
use crate::args::ApplyArgs;
use crate::output::{print, print_json};

pub(crate) fn run(args: &ApplyArgs) -> anyhow::Result<()> {
    if !args.textures.texture.is_empty() {
        return super::apply_textures::run(args);
    }
    let probe = Probe::read(&args.probe)?;
    let mut source = probe.from.clone();
    let mut named = Vec::new();
    for text in args.values.iter().chain(&args.textures.fix) {
        let (name, value) =
            text.split_once('=').ok_or_else(|| Usage(format!("'{text}' is not NAME=VALUE")))?;
        let indices = source.model().resolve(name.trim())?;
        if indices.iter().any(|i| named.contains(i)) {
            return Err(Usage(format!("'{}' is given twice", name.trim())).into());
        }
        source.set(name.trim(), value.trim())?;
        named.extend(indices);
    }
    for axis in &probe.source_axes {
        if source.model().resolve(&axis.name)?.iter().any(|i| !named.contains(i)) {
            let (min, max) = (axis.value(0), axis.value(axis.len() - 1));
            let missing = format!("give '{}' too: {}={min} to {max}", axis.name, axis.name);
            return Err(Usage(format!("the probe maps {}; {missing}", names(&probe))).into());
        }
    }
    let applied = apply(&probe, &source, args.clamp)?;
    for name in &applied.clamped {
        eprintln!("note: {name} was moved into the probe's range");
    }
    for name in &applied.saturated {
        eprintln!(
            "note: {name} sits on the edge of the range that was searched; a better match may lie beyond"
        );
    }
    if args.json.json {
        return print_json(&json!({
            "source": applied.source, "target": applied.target, "spec": applied.target.to_string(),
            "fitness": applied.fitness, "saturated": applied.saturated, "clamped": applied.clamped,
        }));
    }
    print(&format!("{}\n", applied.target))
}

fn names(probe: &Probe) -> String {
    let names: Vec<&str> = probe.source_axes.iter().map(|a| a.name.as_str()).collect();
    names.join(" and ")
}
