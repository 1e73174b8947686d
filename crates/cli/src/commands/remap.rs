//! `lookmatch remap`: from two models to a probe.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::Context;
use lookmatch_remap::{
    Assignment, Endpoint, Event, Options, Plan, Preset, Probe, Side, Stage, Strategy, journal_path, losses,
    remap,
};
use serde_json::json;

use crate::args::{PresetName, RemapArgs, StrategyName};
use crate::commands::{check_output, create_folder};
use crate::output::{bar, loss_table, print_json};
use crate::transport::{Preparation, cache};
use crate::{Usage, report};

pub(crate) fn run(args: &RemapArgs) -> anyhow::Result<()> {
    let (from, mut fix) = endpoint(&args.from, Side::Source)?;
    let (to, target_fix) = endpoint(&args.to, Side::Target)?;
    fix.extend(target_fix);
    fix.extend(args.fix.iter().cloned());
    let plan = Plan::between(from, to, &options(args, fix))?;
    check_output(&args.output)?;
    if let Some(folder) = &args.report {
        create_folder(folder)?;
    }
    if plan.from.model().has_fresnel != plan.to.model().has_fresnel && !args.mask {
        eprintln!(
            "note: only one of the models has a Fresnel effect; --mask keeps silhouettes from ruling the match"
        );
    }
    let started = Instant::now();
    let probe = search(&plan, args)?;
    probe.write(&args.output)?;
    let seconds = started.elapsed().as_secs_f64();
    let saturated = probe.entries.iter().filter(|e| !e.saturated.is_empty()).count();
    let mean = probe.entries.iter().map(|e| e.fitness).sum::<f64>() / probe.entries.len() as f64;
    eprintln!(
        "{}: {} source points in {seconds:.1} s, mean fitness {mean:.4}, {saturated} on the edge of a range",
        args.output.display(),
        probe.entries.len(),
    );
    let losses = losses(&probe)?;
    eprint!("{}", loss_table(&losses));
    let validation = match &args.report {
        Some(folder) => Some(report::write(&probe, folder)?),
        None => None,
    };
    if args.json.json {
        let summary = json!({
            "probe": args.output, "source_points": probe.entries.len(), "seconds": seconds,
            "evaluations": probe.totals.evaluations, "lattice_points": probe.totals.lattice_points,
            "mean_fitness": mean, "saturated": saturated, "losses": losses, "validation": validation,
        });
        return print_json(&summary);
    }
    Ok(())
}

fn search(plan: &Plan, args: &RemapArgs) -> anyhow::Result<Probe> {
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = stopped.clone();
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("cannot listen for Ctrl-C")?;
    let preparation = Preparation::of("the reference scene");
    let stage = Stage::cached(plan, &cache(), &|progress| preparation.observe(progress))?;
    preparation.finish();
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
    let probe = remap(plan, &stage, Some(&state), &mut observe, &stop)?;
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
    }
}

/// A model or a named material with values to hold: `ward`, `ward:variant=duer` or `low-abc@chrome`.
fn endpoint(text: &str, side: Side) -> anyhow::Result<(Endpoint, Vec<Assignment>)> {
    let (name, list) = text.split_once(':').unwrap_or((text, ""));
    let mut fix = Vec::new();
    for item in list.split(',').filter(|item| !item.is_empty()) {
        let (name, value) =
            item.split_once('=').ok_or_else(|| Usage(format!("'{item}' in '{text}' is not NAME=VALUE")))?;
        fix.push(Assignment { side: Some(side), name: name.trim().into(), value: value.trim().into() });
    }
    Ok((Endpoint::parse(name.trim())?, fix))
}
