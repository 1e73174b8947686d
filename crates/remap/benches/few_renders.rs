//! How few targets a remap has to render: each method beside the proven optimum.
//!
//! `cargo bench -p lookmatch-remap --bench few_renders [-- SIZE [SOURCE [METHOD]]]` prints, for Ward to GGX, Ashikhmin-Shirley to Beckmann and
//! Lafortune to Ward, on the built-in renderer, whose renders are counted as if they were dear:
//!
//! - alone: 56 source materials at random values, each remapped as if there were no others. Mean and worst ratio of the fitness
//!   to that of the exhaustive search, mean and largest number of distinct target materials rendered.
//! - together: a whole remap of 700 sources. The same ratios, and renders per source.
//!
//! A target material is rendered once under each of two lights. `genetic-guarnera2018` is the paper's algorithm as published.

use lookmatch_materials::by_name;
use lookmatch_remap::{Axis, Options, Plan, Probe, Stage, Strategy, SynthesisRecord, remap};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Methods that search a source of its own.
const METHODS: [&str; 5] = ["genetic-guarnera2018", "genetic", "cma-es", "survey", "synthesis"];
/// Methods of whole remaps.
const WHOLE: [&str; 4] = ["genetic-guarnera2018", "genetic", "synthesis", "synthesis-half-rate"];
/// Sources of a whole remap.
const SOURCES: usize = 700;

/// A pair of models.
struct Pair {
    from: &'static str,
    to: &'static str,
    /// Levels of each source axis: of those that are searched alone, and of the whole remap.
    counts: &'static [(usize, usize)],
}

const PAIRS: [Pair; 3] = [
    Pair { from: "ward", to: "ggx", counts: &[(7, 20), (8, 35)] },
    Pair { from: "as", to: "beckmann-conductor", counts: &[(56, SOURCES)] },
    Pair { from: "lafortune", to: "ward", counts: &[(7, 20), (8, 35)] },
];

/// The default plan of a pair with a search method.
fn plan(pair: &Pair, search: &str, size: usize, strategy: Strategy) -> Plan {
    let options =
        Options { strategy, search: search.into(), size: Some(size), mask: true, ..Options::default() };
    let model = |name| by_name(name).expect("a model of the catalogue");
    Plan::new(model(pair.from), model(pair.to), &options).expect("a sound plan")
}

/// A level at a share of an axis, along its ratios where they are wide.
fn level(axis: &Axis, share: f64) -> f64 {
    let (min, max) = (axis.value(0), axis.value(axis.len() - 1));
    if min > 0.0 && max / min > 12.0 { min * (max / min).powf(share) } else { min + share * (max - min) }
}

fn axes(
    plan: &Plan,
    counts: impl Iterator<Item = usize>,
    share: &mut dyn FnMut(usize, usize) -> f64,
) -> Vec<Axis> {
    let axis = |(axis, count): (&Axis, usize)| {
        let mut levels: Vec<f64> = (0..count).map(|k| level(axis, share(k, count))).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        Axis::listed(axis.name.clone(), levels).expect("sound levels")
    };
    plan.source_axes.iter().zip(counts).map(axis).collect()
}

fn run(plan: &Plan, stage: &Stage) -> Probe {
    remap(plan, stage, None, &mut |_| {}, &|| false).expect("a probe")
}

/// Ratios of fitness and renders of some sources.
#[derive(Default)]
struct Row {
    ratios: Vec<f64>,
    renders: Vec<f64>,
}

impl Row {
    fn add(&mut self, found: &Probe, truth: &[f64]) {
        self.ratios.extend(
            found.entries.iter().zip(truth).map(|(entry, truth)| (entry.fitness + 1e-9) / (truth + 1e-9)),
        );
        let rendered = found.totals.rendered.unwrap_or(0) as f64;
        self.renders.push(rendered / found.entries.len() as f64);
    }

    fn print(&self, what: &str, seconds: f64) {
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let most = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
        println!(
            "{what:<52}{:>10.4}{:>10.3}{:>10.1}{:>10.0}{seconds:>9.0}",
            mean(&self.ratios),
            most(&self.ratios),
            mean(&self.renders),
            most(&self.renders),
        );
    }
}

/// Each source of a plan on its own.
fn alone(pair: &Pair, size: usize, stage: &Stage, is_wanted: &dyn Fn(&str) -> bool) {
    let mut random = Pcg64::seed_from_u64(6);
    let mut truth = plan(pair, "exhaustive", size, Strategy::Unconstrained);
    let counts = pair.counts.iter().map(|(alone, _)| *alone);
    truth.source_axes = axes(&truth, counts, &mut |_, _| random.random());
    let begin = std::time::Instant::now();
    let best = run(&truth, stage);
    println!(
        "  exhaustive: {} renders, {:.0} s",
        best.totals.rendered.unwrap_or(0),
        begin.elapsed().as_secs_f64()
    );
    for method in METHODS.into_iter().filter(|method| is_wanted(method)) {
        let (mut row, begin) = (Row::default(), std::time::Instant::now());
        for entry in &best.entries {
            let mut one = Plan { search: method.into(), source_axes: Vec::new(), ..truth.clone() };
            for (axis, value) in truth.source_axes.iter().zip(&entry.source) {
                one.from.set_number(&axis.name, *value).expect("a value of the source");
            }
            row.add(&run(&one, stage), &[entry.fitness]);
        }
        row.print(&format!("  alone     {method}"), begin.elapsed().as_secs_f64());
    }
}

/// A whole remap.
fn together(pair: &Pair, size: usize, stage: &Stage, is_wanted: &dyn Fn(&str) -> bool) {
    for (strategy, name) in
        [(Strategy::Unconstrained, "unconstrained"), (Strategy::Constrained, "constrained")]
    {
        let mut truth = plan(pair, "exhaustive", size, strategy);
        let counts = pair.counts.iter().map(|(_, together)| *together);
        truth.source_axes = axes(&truth, counts, &mut |k, count| k as f64 / (count - 1) as f64);
        let best: Vec<f64> = run(&truth, stage).entries.iter().map(|entry| entry.fitness).collect();
        for method in WHOLE.into_iter().filter(|method| is_wanted(method)) {
            let begin = std::time::Instant::now();
            let found = run(&Plan { search: method.into(), ..truth.clone() }, stage);
            let mut row = Row::default();
            row.add(&found, &best);
            row.print(&format!("  {SOURCES} {name:<14}{method}"), begin.elapsed().as_secs_f64());
            if let Some(record) = found.totals.synthesis {
                let SynthesisRecord { components: [point, environment], held_out, mean, most } = record;
                println!(
                    "    {point} + {environment} components; {held_out} held out: off by {mean:.3} on average, 95 % by {most:.3}"
                );
            }
        }
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let size = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(128);
    let (only, method) = (arguments.next(), arguments.next());
    let is_wanted = |name: &str| method.as_ref().is_none_or(|method| method == name);
    println!(
        "{:<52}{:>10}{:>10}{:>10}{:>10}{:>9}",
        "fitness over optimum, renders per source", "mean", "worst", "renders", "most", "s"
    );
    for pair in PAIRS.iter().filter(|pair| only.as_ref().is_none_or(|only| only == pair.from)) {
        println!("{} -> {}, {size} px", pair.from, pair.to);
        let stage = Stage::prepare(&plan(pair, "genetic", size, Strategy::Unconstrained)).expect("the scene");
        alone(pair, size, &stage, &is_wanted);
        together(pair, size, &stage, &is_wanted);
    }
}
