//! `lookmatch remap`: from two models to a probe.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use lookmatch_materials::split_name;
use lookmatch_remap::{
    Assignment, Counts, CrossStage, Endpoint, Event, Options, Plan, Preset, Probe, RemapError, Sampling,
    Side, Stage, Strategy, journal_path, losses, remap, remap_across,
};
use serde::Serialize;
use serde_json::json;

use crate::args::{PresetName, RemapArgs, StrategyName};
use crate::commands::fit::{FIT_POINTS, fit_summary, fit_to};
use crate::commands::{check_output, create_folder, interruption};
use crate::output::{bar, loss_table, noise_text, print_json, renders_text, saved};
use crate::renderers::{Renderers, renderer_of};
use crate::transport::{Preparation, cache};
use crate::{Usage, report};

pub(crate) fn run(args: &RemapArgs) -> anyhow::Result<()> {
    check_output(&args.output)?;
    let stopped = interruption()?;
    let named: Vec<String> =
        [&args.from, &args.to].into_iter().filter_map(|text| renderer_of(text)).collect();
    let renderers = Renderers::start(&named, &args.renderers, &stopped)?;
    let (from, mut fix) = endpoint(&args.from, Side::Source)?;
    let (to, target_fix) = endpoint(&args.to, Side::Target)?;
    fix.extend(target_fix);
    fix.extend(args.fix.iter().cloned());
    let models = [from.model(), to.model()];
    let options = Options { renderers: renderers.records(&models), ..options(args, fix) };
    let plan = Plan::between(from, to, &options)?;
    if let Some(folder) = &args.report {
        create_folder(folder)?;
    }
    if plan.from.model().has_fresnel != plan.to.model().has_fresnel && !args.mask {
        eprintln!(
            "note: only one of the models has a Fresnel effect; --mask keeps silhouettes from ruling the match"
        );
    }
    if args.refine && !named.is_empty() {
        eprintln!(
            "note: --refine leaves matches with other renderers on the lattice: noise hides what lies between its levels"
        );
    }
    let started = Instant::now();
    let (mut probe, costs, stage) = match named.is_empty() {
        true => (search(&plan, args, &stopped)?, Vec::new(), None),
        false => {
            let stage = cross_stage(&plan, &renderers)?;
            let (probe, costs) = search_across(&plan, &stage, args, &renderers, &stopped)?;
            (probe, costs, Some(stage))
        }
    };
    probe.write(&args.output)?;
    let seconds = started.elapsed().as_secs_f64();
    let saturated = probe.found().filter(|e| !e.saturated.is_empty()).count();
    let mean = probe.found().map(|e| e.fitness).sum::<f64>() / probe.found().count() as f64;
    eprintln!(
        "{}: {} source points in {seconds:.1} s, mean fitness {mean:.4}, {saturated} on the edge of a range",
        args.output.display(),
        probe.entries.len(),
    );
    eprint!("{}", renders_text(&probe));
    costs.iter().for_each(|cost| eprintln!("{}", cost.text()));
    eprint!("{}{}", noise_text(&probe), fit_summary(&probe));
    let losses = losses(&probe)?;
    eprint!("{}", loss_table(&losses));
    let validation = match (&args.report, stage) {
        (Some(folder), None) => {
            let validation = report::write(&mut probe, folder, &|| stopped.load(Ordering::Relaxed))?;
            probe.write(&args.output)?;
            Some(validation)
        }
        (Some(folder), Some(stage)) => {
            report::write_across(&probe, &stage, options.sampling.most, folder)?;
            None
        }
        (None, _) => None,
    };
    if args.json.json {
        let summary = json!({
            "probe": args.output, "source_points": probe.entries.len(), "seconds": seconds,
            "evaluations": probe.totals.evaluations, "rendered": probe.totals.rendered,
            "synthesis": probe.totals.synthesis, "saved": saved(&probe).map(|(saved, _)| saved), "lattice_points": probe.totals.lattice_points,
            "mean_fitness": mean, "saturated": saturated, "losses": losses, "validation": validation,
            "renderers": costs, "failed": probe.entries.len() - probe.found().count(),
        });
        return print_json(&summary);
    }
    Ok(())
}

/// What pictures of a renderer have cost.
#[derive(Debug, Serialize)]
struct Cost {
    name: String,
    version: String,
    /// Renders that were made.
    renders: usize,
    /// Pictures that an earlier run had rendered.
    found: usize,
    failed: usize,
    /// Time that was spent waiting for it.
    renderer_s: f64,
    /// Time of the search in our own code, the same for all renderers of a remap.
    own_s: f64,
    cpu_s: f64,
    restarts: u64,
    reasons: Vec<String>,
}

impl Cost {
    fn text(&self) -> String {
        let Self { name, version, renders, found, renderer_s, cpu_s, .. } = self;
        let failed = match self.failed {
            0 => String::new(),
            failed => format!(", {failed} of them failed ({})", self.reasons.join("; ")),
        };
        let restarts =
            if self.restarts > 0 { format!(", {} restarts", self.restarts) } else { String::new() };
        format!(
            "{name} {version}: {renders} renders{failed}{restarts}, {found} found from earlier, {renderer_s:.1} s waited for it ({cpu_s:.1} CPU s)"
        )
    }
}

/// The reference scene in all renderers that a plan needs.
fn cross_stage(plan: &Plan, renderers: &Renderers) -> anyhow::Result<CrossStage> {
    let preparation = Preparation::of("the reference scene");
    let observe = |progress| preparation.observe(progress);
    let stage = CrossStage::cached(plan, &renderers.studios(), &cache(), &observe)?;
    preparation.finish();
    Ok(stage)
}

/// The search with other renderers, and what they cost.
fn search_across(
    plan: &Plan,
    stage: &CrossStage,
    args: &RemapArgs,
    renderers: &Renderers,
    stopped: &Arc<AtomicBool>,
) -> anyhow::Result<(Probe, Vec<Cost>)> {
    let begun = Instant::now();
    let mut probe = with_progress(plan, args, stopped, &mut |state, observe, stop| {
        remap_across(plan, stage, Some(state), observe, stop)
    })?;
    fit_to(&mut probe, None, 0)?;
    let all = begun.elapsed().as_secs_f64();
    let counts = stage.counts();
    let waited: f64 = counts.iter().map(|(_, counts)| counts.waited.as_secs_f64()).sum();
    let usage = renderers.usage();
    let cost = |(name, counts): (String, Counts)| {
        let usage = usage.iter().find(|(other, _)| *other == name).map(|(_, usage)| usage);
        let version = plan.renderers.iter().find(|record| record.name == name);
        Cost {
            version: version.map(|record| record.version.clone()).unwrap_or_default(),
            name,
            renders: counts.renders,
            found: counts.found,
            failed: counts.failed,
            renderer_s: counts.waited.as_secs_f64(),
            own_s: all - waited,
            cpu_s: usage.map_or(0.0, |usage| usage.cpu_s),
            restarts: usage.map_or(0, |usage| usage.restarts),
            reasons: counts.reasons,
        }
    };
    let costs: Vec<Cost> = counts.into_iter().map(cost).collect();
    eprintln!(
        "{:.1} s in renderers, {:.1} s in our own code ({:.1} %)",
        waited,
        all - waited,
        100.0 * (all - waited) / all
    );
    Ok((probe, costs))
}

fn search(plan: &Plan, args: &RemapArgs, stopped: &Arc<AtomicBool>) -> anyhow::Result<Probe> {
    let preparation = Preparation::of("the reference scene");
    let stage = Stage::cached(plan, &cache(), &|progress| preparation.observe(progress))?;
    preparation.finish();
    let mut probe = with_progress(plan, args, stopped, &mut |state, observe, stop| {
        remap(plan, &stage, Some(state), observe, stop)
    })?;
    fit_to(&mut probe, Some(&stage), FIT_POINTS)?;
    Ok(probe)
}

/// A search: its state file, what it tells, when it stops.
type Run<'a> =
    dyn FnMut(&Path, &mut dyn FnMut(Event), &(dyn Fn() -> bool + Sync)) -> Result<Probe, RemapError> + 'a;

fn with_progress(
    plan: &Plan,
    args: &RemapArgs,
    stopped: &Arc<AtomicBool>,
    run: &mut Run,
) -> anyhow::Result<Probe> {
    let total = plan.source_axes.iter().map(|axis| axis.len()).product();
    let progress = bar(total, "matching");
    let mut observe = |event: Event| match event {
        Event::Resumed { done } => {
            progress.set_position(done as u64);
            progress.suspend(|| eprintln!("going on after {done} source points of an earlier run"));
        }
        Event::Compared { done, total } => progress.set_message(format!("rendering {done}/{total} targets;")),
        Event::Point { done, .. } => {
            progress.set_message("matching");
            progress.set_position(done as u64);
        }
    };
    let state = journal_path(&args.output);
    let stop = || stopped.load(Ordering::Relaxed);
    let probe = run(&state, &mut observe, &stop)?;
    progress.finish_and_clear();
    Ok(probe)
}

fn options(args: &RemapArgs, fix: Vec<Assignment>) -> Options {
    Options {
        strategy: match args.strategy {
            StrategyName::Constrained => Strategy::Constrained,
            StrategyName::Unconstrained => Strategy::Unconstrained,
        },
        search: args.search.clone(),
        vary: args.vary.clone(),
        fix,
        preset: args.preset.map(|PresetName::Paper| Preset::Paper),
        seed: args.seed,
        mask: args.mask,
        quick: args.quick,
        size: args.size,
        pairs: args.pair.clone(),
        refine: args.refine,
        sampling: Sampling {
            samples: args.samples,
            most: args.max_samples.unwrap_or(args.samples * if args.quick { 1 } else { 4 }).max(args.samples),
        },
        renderers: Vec::new(),
    }
}

/// A model or a named material with values to hold: `ward`, `ward:variant=duer` or `low-abc@chrome`.
pub(crate) fn endpoint(text: &str, side: Side) -> anyhow::Result<(Endpoint, Vec<Assignment>)> {
    let (name, list) = split_name(text);
    let mut fix = Vec::new();
    for item in list.split(',').filter(|item| !item.is_empty()) {
        let (name, value) =
            item.split_once('=').ok_or_else(|| Usage(format!("'{item}' in '{text}' is not NAME=VALUE")))?;
        fix.push(Assignment { side: Some(side), name: name.trim().into(), value: value.trim().into() });
    }
    Ok((Endpoint::parse(name.trim())?, fix))
}
