//! `lookmatch invert`: a probe turned round.

use lookmatch_remap::{Probe, invert, measure};
use serde_json::json;

use crate::args::InvertArgs;
use crate::commands::check_output;
use crate::commands::fit::stage_of;
use crate::output::{bar, print, print_json, score, table};

pub(crate) fn run(args: &InvertArgs) -> anyhow::Result<()> {
    check_output(&args.output)?;
    let mut inverse = invert(&Probe::read(&args.probe)?)?;
    measured(&mut inverse)?;
    inverse.write(&args.output)?;
    if args.json.json {
        return print_json(&json!({
            "probe": args.output, "from": inverse.from, "to": inverse.to, "domain": domain(&inverse),
            "entries": inverse.entries.len(), "derived": inverse.derived,
        }));
    }
    print(&derived_text(&inverse))
}

/// Renders the entries of a derived probe, where both models are ours.
pub(crate) fn measured(probe: &mut Probe) -> anyhow::Result<()> {
    if [&probe.from, &probe.to].iter().any(|material| material.model().renderer.is_some()) {
        eprintln!(
            "note: not rendered, one of the models is another renderer's: errors are those of the probes it is made of"
        );
        return Ok(());
    }
    let stage = stage_of(probe)?;
    let progress = bar(probe.entries.len(), "measuring");
    measure(probe, &stage, &mut || progress.inc(1))?;
    progress.finish_and_clear();
    Ok(())
}

/// The range of each source axis.
pub(crate) fn domain(probe: &Probe) -> serde_json::Value {
    let axis =
        |a: &lookmatch_remap::Axis| json!({ "name": a.name, "min": a.value(0), "max": a.value(a.len() - 1) });
    probe.source_axes.iter().map(axis).collect()
}

/// Where a derived probe comes from, what it takes, and what is left after there and back; nothing for others.
pub(crate) fn derived_text(probe: &Probe) -> String {
    let Some(derived) = &probe.derived else { return String::new() };
    let kind = match derived.kind {
        lookmatch_remap::DerivedKind::Inverse => "inverse",
        lookmatch_remap::DerivedKind::Composition => "composition",
    };
    let mut text = format!("{kind} of {}: {} -> {}\n", derived.of.join(" and "), probe.from, probe.to);
    for axis in &probe.source_axes {
        let (min, max) = (axis.value(0), axis.value(axis.len() - 1));
        text += &format!("  takes {} from {min:.5} to {max:.5}\n", axis.name);
    }
    let failed = probe.entries.len() - probe.found().count();
    if failed > 0 {
        text += &format!(
            "  {failed} of {} entries lead out of what the second probe takes\n",
            probe.entries.len()
        );
    }
    if !derived.unreachable.is_empty() {
        text += &format!(
            "  {} of {} entries are looks that the source model cannot have: they give the nearest\n",
            derived.unreachable.len(),
            probe.entries.len()
        );
    }
    if let Some(first) = derived.round_trip.first() {
        text += &format!("there and back, over {} entries\n", first.entries);
        let mut rows = vec![["", "mean error", "max error"].map(str::to_owned).to_vec()];
        let row = |t: &lookmatch_remap::RoundTrip| {
            vec![format!("  {}", t.name), format!("{:.5}", t.mean), format!("{:.5}", t.max)]
        };
        rows.extend(derived.round_trip.iter().map(row));
        text += &table(&rows);
    }
    let mean = probe.found().map(|e| e.fitness).sum::<f64>() / probe.found().count().max(1) as f64;
    let how = if derived.measured { "measured" } else { "not measured: the sum of the probes'" };
    text + &format!("mean fitness {} ({how})\n", score(mean))
}
