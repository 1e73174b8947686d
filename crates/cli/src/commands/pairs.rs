//! `lookmatch pairs`: every ordered pair of models in one run, as a table and a picture.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::Context;
use lookmatch_imaging::write_atomically;
use lookmatch_materials::{Model, by_name, registry};
use lookmatch_remap::{Options, PairScore, Plan, RemapError, Stage, score_pair};
use maud::{Markup, PreEscaped, html};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Usage;
use crate::args::PairsArgs;
use crate::commands::{create_folder, interruption};
use crate::output::{bar, print, print_json, table};
use crate::renderers::only_ours;
use crate::transport::{Preparation, cache};

/// All that is known of a run: what decides its outcome, and the pairs that are done.
#[derive(Serialize, Deserialize, PartialEq)]
struct Run {
    program: String,
    size: usize,
    seed: u64,
    mask: bool,
    seconds: f64,
    pairs: Vec<PairScore>,
}

pub(crate) fn run(args: &PairsArgs) -> anyhow::Result<()> {
    let models = models(&args.models)?;
    create_folder(&args.output)?;
    let mut run = resumed(args);
    let wanted = pairs(&models);
    run.pairs.retain(|score| wanted.iter().any(|(from, to)| is_of(score, from, to)));
    search(args, &wanted, &mut run)?;
    let order = |score: &PairScore| wanted.iter().position(|(from, to)| is_of(score, from, to));
    run.pairs.sort_by_key(order);
    save(&args.output, &run)?;
    let text = markdown(&models, &run);
    write(&args.output.join("pairs.md"), &text)?;
    write(&args.output.join("pairs.svg"), &picture(&models, &run).into_string())?;
    if args.json.json { print_json(&run) } else { print(&summary(&models, &run)) }
}

/// The models to pair: those named, or all that need no file.
fn models(names: &[String]) -> anyhow::Result<Vec<&'static Model>> {
    if names.is_empty() {
        return Ok(registry().iter().copied().filter(|m| m.load.is_none()).collect());
    }
    names.iter().try_for_each(|name| only_ours("pairs", name))?;
    let models = names.iter().map(|name| by_name(name)).collect::<Result<Vec<_>, _>>()?;
    match models.iter().find(|m| m.load.is_some()) {
        Some(model) => Err(Usage(format!("model '{}' needs a file; leave it out", model.name)).into()),
        None => Ok(models),
    }
}

/// Ordered pairs of different models whose second can be searched. Targets are the slow index: their pictures are kept.
fn pairs(models: &[&'static Model]) -> Vec<(&'static Model, &'static Model)> {
    let targets = models.iter().filter(|to| !to.searched.is_empty());
    targets
        .flat_map(|to| models.iter().filter(move |from| from.name != to.name).map(|from| (*from, *to)))
        .collect()
}

fn is_of(score: &PairScore, from: &Model, to: &Model) -> bool {
    score.from == from.name && score.to == to.name
}

fn search(
    args: &PairsArgs,
    wanted: &[(&'static Model, &'static Model)],
    run: &mut Run,
) -> anyhow::Result<()> {
    let options = Options {
        quick: true,
        size: Some(args.size),
        seed: args.seed,
        mask: args.mask,
        ..Options::default()
    };
    let stopped = interruption()?;
    let Some((from, to)) = wanted.first() else {
        return Err(Usage("none of the models can be a target; add one more".into()).into());
    };
    let preparation = Preparation::of("the reference scene");
    let plan = Plan::new(from, to, &options)?;
    let stage = Stage::cached(&plan, &cache(), &|progress| preparation.observe(progress))?;
    preparation.finish();
    let progress = bar(wanted.len(), "pairs");
    progress.set_position(run.pairs.len() as u64);
    let missing: Vec<_> =
        wanted.iter().filter(|(from, to)| !run.pairs.iter().any(|score| is_of(score, from, to))).collect();
    let (started, before) = (Instant::now(), run.seconds);
    let stop = || stopped.load(Ordering::Relaxed);
    let run = Mutex::new(run);
    // One pair keeps few cores busy: its searches follow each other. Neighbouring pairs share the pictures of targets.
    missing.par_iter().try_for_each(|(from, to)| -> anyhow::Result<()> {
        progress.set_message(format!("{} to {}", from.name, to.name));
        let score = score_pair(&stage, from, to, &options, &stop);
        let mut run = run.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(RemapError::Interrupted { .. }) = score {
            let done = run.pairs.len();
            anyhow::bail!("stopped after {done} of {} pairs; the same command goes on", wanted.len());
        }
        run.pairs.push(score.with_context(|| format!("{} to {}", from.name, to.name))?);
        run.seconds = before + started.elapsed().as_secs_f64();
        save(&args.output, &run)?;
        progress.inc(1);
        Ok(())
    })?;
    progress.finish_and_clear();
    Ok(())
}

/// What an earlier run with the same options left.
fn resumed(args: &PairsArgs) -> Run {
    let program = concat!("lookmatch ", env!("CARGO_PKG_VERSION")).to_owned();
    let new =
        Run { program, size: args.size, seed: args.seed, mask: args.mask, seconds: 0.0, pairs: Vec::new() };
    let text = std::fs::read_to_string(args.output.join("pairs.json")).unwrap_or_default();
    match serde_json::from_str::<Run>(&text) {
        Ok(old)
            if (&old.program, old.size, old.seed, old.mask)
                == (&new.program, new.size, new.seed, new.mask) =>
        {
            old
        }
        _ => new,
    }
}

fn save(folder: &Path, run: &Run) -> anyhow::Result<()> {
    write(&folder.join("pairs.json"), &(serde_json::to_string_pretty(run)? + "\n"))
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(write_atomically(path, |out| out.write_all(text.as_bytes()))?)
}

/// Targets in the order of the models.
fn targets<'a>(models: &'a [&'static Model]) -> impl Iterator<Item = &'static Model> + 'a {
    models.iter().copied().filter(|m| !m.searched.is_empty())
}

fn score<'a>(run: &'a Run, from: &Model, to: &Model) -> Option<&'a PairScore> {
    run.pairs.iter().find(|score| is_of(score, from, to))
}

/// In thousandths, as probe / copy; a star where every source point is on the edge of a range.
fn cell(score: &PairScore) -> String {
    let edge = if score.saturated == score.points { "\\*" } else { "" };
    format!("{:.1} / {:.1}{edge}", 1e3 * score.probe, 1e3 * score.copy)
}

/// How many pairs the probe wins, for the whole image and with the mask, and the medians.
fn verdict(run: &Run) -> String {
    let total = run.pairs.len();
    let wins = |probe: fn(&PairScore) -> [f64; 2]| {
        run.pairs.iter().map(probe).filter(|[probe, copy]| probe <= copy).count()
    };
    let median = |value: fn(&PairScore) -> f64| {
        let mut values: Vec<f64> = run.pairs.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values.get(total / 2).copied().unwrap_or(0.0)
    };
    let saturated = run.pairs.iter().filter(|s| s.saturated > 0).count();
    let wholly = run.pairs.iter().filter(|s| s.saturated == s.points).count();
    format!(
        "{total} ordered pairs in {:.0} s at {} px. Mean NRMSD of the probe is at most that of copied parameters in {} pairs \
         ({} with the radial mask); medians {:.4} against {:.4} (masked {:.4} against {:.4}). In {saturated} pairs some \
         source point has a target parameter on the edge of its range, in {wholly} all of them.",
        run.seconds,
        run.size,
        wins(|s| [s.probe, s.copy]),
        wins(|s| [s.probe_masked, s.copy_masked]),
        median(|s| s.probe),
        median(|s| s.copy),
        median(|s| s.probe_masked),
        median(|s| s.copy_masked),
    )
}

fn markdown(models: &[&'static Model], run: &Run) -> String {
    let mut text = String::from("# Every model to every other\n\n");
    text += &format!(
        "Written by `lookmatch pairs` ({}, seed {}{}). {}\n\n",
        run.program,
        run.seed,
        if run.mask { ", masked search" } else { "" },
        verdict(run)
    );
    text += "Each cell: mean NRMSD over the source points, whole image, in thousandths, of the probe / of copied parameters \
             (same α, same reflectance at normal incidence, same body colour). A star: all source points have a target \
             parameter on the edge of its range.\n\n![Mean NRMSD of probe and copy](pairs.svg)\n\n| source \\ target |";
    targets(models).for_each(|to| text += &format!(" {} |", to.name));
    text += "\n|---|";
    targets(models).for_each(|_| text += "---|");
    for from in models {
        text += &format!("\n| **{}** |", from.name);
        for to in targets(models) {
            text += &format!(" {} |", score(run, from, to).map_or_else(|| "–".to_owned(), cell));
        }
    }
    text += "\n\n## What targets cannot show\n\nSource parameters that vary or show, and have nothing in the target that could stand in for them.\n\n";
    for score in run.pairs.iter().filter(|score| !score.lost.is_empty()) {
        text += &format!("- {} to {}: {}\n", score.from, score.to, score.lost.join(", "));
    }
    text
}

fn summary(models: &[&'static Model], run: &Run) -> String {
    let mut rows = vec![
        std::iter::once("probe/copy, 1e-3".to_owned())
            .chain(targets(models).map(|to| to.name.to_owned()))
            .collect(),
    ];
    for from in models {
        let cells = targets(models).map(|to| {
            score(run, from, to)
                .map_or_else(|| "-".to_owned(), |s| cell(s).replace("\\*", "*").replace(" / ", "/"))
        });
        rows.push(std::iter::once(from.name.to_owned()).chain(cells).collect());
    }
    format!("{}\n{}\n", table(&rows), verdict(run))
}

/// Side of a cell of the picture, room for the names, and gap between the panels, in pixels.
const CELL: usize = 26;
const NAMES: usize = 150;
const GAP: usize = 40;
/// The range of colours: NRMSD from 1e-4 to 1e-1, by its logarithm.
const DECADES: [f64; 2] = [-4.0, -1.0];

/// Two panels with one scale: the probes, and copied parameters.
fn picture(models: &[&'static Model], run: &Run) -> Markup {
    let columns = targets(models).count();
    let panel = NAMES + columns * CELL;
    let (width, height) = (2 * panel + 3 * GAP, NAMES + models.len() * CELL + 3 * GAP);
    html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox=(format!("0 0 {width} {height}")) width=(width) height=(height)
            font-family="sans-serif" font-size="12" {
            rect width="100%" height="100%" fill="white" {}
            (panel_of(models, run, "probe", GAP, |s| s.probe))
            (panel_of(models, run, "copied parameters", 2 * GAP + panel, |s| s.copy))
            (scale(GAP + NAMES, height - GAP - 14))
        }
    }
}

fn panel_of(
    models: &[&'static Model],
    run: &Run,
    title: &str,
    left: usize,
    value: fn(&PairScore) -> f64,
) -> Markup {
    let (x, y) = (|k: usize| left + NAMES + k * CELL, |k: usize| NAMES + GAP / 2 + k * CELL);
    html! {
        text x=(left) y=(GAP / 2) font-size="16" { "Mean NRMSD, " (title) }
        @for (k, to) in targets(models).enumerate() {
            text transform=(format!("translate({},{}) rotate(-60)", x(k) + CELL / 2, y(0) - 6)) { (to.name) }
        }
        @for (row, from) in models.iter().enumerate() {
            text x=(x(0) - 6) y=(y(row) + CELL - 9) text-anchor="end" { (from.name) }
            @for (k, to) in targets(models).enumerate() {
                @if let Some(score) = score(run, from, to) {
                    rect x=(x(k)) y=(y(row)) width=(CELL - 1) height=(CELL - 1) fill=(colour(value(score))) {
                        title { (from.name) " to " (to.name) ": " (format!("{:.4}", value(score))) }
                    }
                    @if score.saturated == score.points {
                        circle cx=(x(k) + CELL / 2) cy=(y(row) + CELL / 2) r="2.5" fill="white" stroke="black" stroke-width="0.5" {}
                    }
                }
            }
        }
    }
}

fn scale(left: usize, top: usize) -> Markup {
    const STEPS: usize = 60;
    let exponent = |k: usize| DECADES[0] + (DECADES[1] - DECADES[0]) * k as f64 / STEPS as f64;
    html! {
        @for k in 0..STEPS {
            rect x=(left + 5 * k) y=(top) width="5" height="12" fill=(colour(10f64.powf(exponent(k)))) {}
        }
        @for decade in 0..=3 {
            text x=(left + 100 * decade) y=(top + 28) text-anchor="middle" { (PreEscaped(format!("10<tspan dy=\"-4\" font-size=\"9\">{}</tspan>", decade as i32 - 4))) }
        }
        text x=(left + 340) y=(top + 11) { "a dot: every source point is on the edge of a target's range" }
    }
}

fn colour(value: f64) -> String {
    let position = (value.max(1e-12).log10() - DECADES[0]) / (DECADES[1] - DECADES[0]);
    let colour = colorous::VIRIDIS.eval_continuous(position.clamp(0.0, 1.0));
    format!("#{:02x}{:02x}{:02x}", colour.r, colour.g, colour.b)
}
