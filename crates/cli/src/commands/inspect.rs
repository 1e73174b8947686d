//! `lookmatch inspect`: what is in a probe.

use lookmatch_plots::draw_probe;
use lookmatch_remap::{Axis, Entry, Flag, Probe, losses};
use serde_json::json;

use crate::args::InspectArgs;
use crate::commands::check_output;
use crate::commands::fit::fit_text;
use crate::commands::invert::derived_text;
use crate::judgement::{verdicts_json, verdicts_text};
use crate::output::{loss_table, noise_text, print, print_json, renders_text, score, table};

/// Worst points that are listed.
const WORST: usize = 5;

pub(crate) fn run(args: &InspectArgs) -> anyhow::Result<()> {
    let probe = Probe::read(&args.probe)?;
    let losses = losses(&probe)?;
    if let Some(path) = &args.plot {
        check_output(path)?;
        draw_probe(&probe, path)?;
    }
    if args.json.json {
        let mut summary = summary(&probe);
        summary["losses"] = json!(losses);
        summary["plot"] = json!(args.plot);
        return print_json(&summary);
    }
    let more = [sureness(&probe), verdicts_text(&probe), fit_text(&probe), derived_text(&probe)]
        .map(|t| if t.is_empty() { t } else { t + "\n" });
    print(&format!("{}\n{}parameters of the source:\n{}", text(&probe), more.concat(), loss_table(&losses)))
}

/// How many entries are less than sure, and why.
fn sureness(probe: &Probe) -> String {
    let count = |flag: Flag| (0..probe.entries.len()).filter(|p| probe.flags(*p).contains(&flag)).count();
    let all = [
        (Flag::Failed, "have no result"),
        (Flag::Saturated, "have a target parameter on the edge of its range"),
        (Flag::BelowNoise, "are below noise: another target is as good"),
        (Flag::OutsideFit, "carried no weight in the fit of some parameter"),
        (Flag::Unreachable, "have no target that shows their source"),
    ];
    let line = |(flag, what): (Flag, &str)| match count(flag) {
        0 => String::new(),
        count => format!("  {count} of {} entries {what}\n", probe.entries.len()),
    };
    let lines: String = all.into_iter().map(line).collect();
    if lines.is_empty() { lines } else { format!("how sure\n{lines}") }
}

/// The entries that are less than sure.
fn flagged(probe: &Probe) -> Vec<serde_json::Value> {
    let flagged = (0..probe.entries.len()).map(|place| (place, probe.flags(place)));
    let told =
        |(place, flags): (usize, Vec<Flag>)| json!({ "source": probe.entries[place].source, "flags": flags });
    flagged.filter(|(_, flags)| !flags.is_empty()).map(told).collect()
}

fn summary(probe: &Probe) -> serde_json::Value {
    let axis = |(k, axis): (usize, &Axis)| axis_summary(probe, k, axis);
    json!({
        "from": probe.from, "to": probe.to, "program": probe.program, "version": probe.version,
        "strategy": probe.strategy, "search": probe.search, "seed": probe.seed, "preset": probe.preset,
        "pairs": probe.pairs, "refined": probe.refined,
        "metric": probe.metric, "scene": probe.scene.name, "size": probe.size,
        "source_axes": probe.source_axes, "target_axes": probe.target_axes.iter().enumerate().map(axis).collect::<Vec<_>>(),
        "renderers": probe.renderers.iter().map(|r| json!({ "name": r.name, "version": r.version })).collect::<Vec<_>>(),
        "sampling": probe.sampling, "failed": probe.entries.len() - probe.found().count(),
        "entries": probe.entries.len(), "totals": probe.totals, "mean_fitness": mean(probe, |e| e.fitness),
        "mean_nrmsd": channel_means(probe, |e| e.nrmsd),
        "mean_nrmsd_masked": channel_means(probe, |e| e.nrmsd_masked),
        "saturated": probe.entries.iter().filter(|e| !e.saturated.is_empty()).count(),
        "fit": probe.fit, "derived": probe.derived, "flagged": flagged(probe),
        "verdicts": verdicts_json(probe),
        "worst": worst(probe).iter().map(|e| json!(e)).collect::<Vec<_>>(),
    })
}

fn axis_summary(probe: &Probe, k: usize, axis: &Axis) -> serde_json::Value {
    let found = || probe.found().map(move |e| e.target[k]);
    json!({
        "name": axis.name, "levels": axis.len(), "min": axis.value(0), "max": axis.value(axis.len() - 1),
        "found_min": found().fold(f64::INFINITY, f64::min), "found_max": found().fold(f64::NEG_INFINITY, f64::max),
        "saturated": probe.entries.iter().filter(|e| e.saturated.contains(&axis.name)).count(),
    })
}

fn text(probe: &Probe) -> String {
    let mut text = format!(
        "{} -> {}\n{}, {} search, seed {}, metric {}{}, scene {} at {} px\n\n",
        probe.from,
        probe.to,
        match probe.strategy {
            lookmatch_remap::Strategy::Constrained => "constrained",
            lookmatch_remap::Strategy::Unconstrained => "unconstrained",
        },
        probe.search,
        probe.seed,
        probe.metric.name,
        if probe.metric.mask { " with the radial mask" } else { "" },
        probe.scene.name,
        probe.size,
    );
    text += &renders_text(probe);
    for pair in &probe.pairs {
        let followers = if pair.targets.is_empty() { "nothing".into() } else { pair.targets.join(", ") };
        text += &format!("{followers} followed {}\n", pair.source);
    }
    if probe.refined {
        text += "targets lie between the levels of the lattice where that is better\n";
    }
    if let (Some(sampling), [_, ..]) = (probe.sampling, &probe.renderers[..]) {
        let names = probe.renderers.iter().map(|r| format!("{} {}", r.name, r.version));
        let names: Vec<String> = names.collect();
        text += &format!(
            "rendered with {}, {} to {} samples per pixel\n\n",
            names.join(" and "),
            sampling.samples,
            sampling.most
        );
    }
    let header = ["", "levels", "from", "to", "found", "on the edge"].map(str::to_owned).to_vec();
    let mut rows = vec![header];
    for axis in &probe.source_axes {
        rows.push(vec![
            format!("source {}", axis.name),
            axis.len().to_string(),
            axis.value(0).to_string(),
            axis.value(axis.len() - 1).to_string(),
        ]);
    }
    for (k, axis) in probe.target_axes.iter().enumerate() {
        let s = axis_summary(probe, k, axis);
        rows.push(vec![
            format!("target {}", axis.name),
            axis.len().to_string(),
            s["min"].to_string(),
            s["max"].to_string(),
            format!("{} to {}", s["found_min"], s["found_max"]),
            s["saturated"].to_string(),
        ]);
    }
    text += &table(&rows);
    text += &format!(
        "\n{} entries, {} comparisons ({:.1} % of the lattice each), mean fitness {}\n",
        probe.entries.len(),
        probe.totals.evaluations,
        100.0 * mean(probe, |e| e.evaluations as f64) / probe.totals.lattice_points as f64,
        score(mean(probe, |e| e.fitness)),
    );
    let channels = |value: fn(&Entry) -> [f64; 3]| channel_means(probe, value).map(score).join(" / ");
    text += &format!(
        "mean NRMSD {} (R/G/B), masked {}\n{}\nworst matches\n",
        channels(|e| e.nrmsd),
        channels(|e| e.nrmsd_masked),
        noise_text(probe)
    );
    for entry in worst(probe) {
        let pairs = |axes: &[Axis], values: &[f64]| -> String {
            let pair = |(axis, value): (&Axis, &f64)| format!("{}={value}", axis.name);
            axes.iter().zip(values).map(pair).collect::<Vec<_>>().join(",")
        };
        text += &format!(
            "  {} -> {}  fitness {}\n",
            pairs(&probe.source_axes, &entry.source),
            pairs(&probe.target_axes, &entry.target),
            score(entry.fitness)
        );
    }
    text
}

fn mean(probe: &Probe, value: impl Fn(&Entry) -> f64) -> f64 {
    probe.found().map(value).sum::<f64>() / probe.found().count() as f64
}

fn channel_means(probe: &Probe, value: impl Fn(&Entry) -> [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| mean(probe, |e| value(e)[c]))
}

fn worst(probe: &Probe) -> Vec<&Entry> {
    let mut entries: Vec<&Entry> = probe.found().collect();
    entries.sort_by(|a, b| b.fitness.total_cmp(&a.fitness));
    entries.truncate(WORST);
    entries
}
