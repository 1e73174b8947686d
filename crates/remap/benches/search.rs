//! The genetic search against the exhaustive truth: how often it finds the optimum, and how much of the lattice it looks at.
//!
//! `cargo bench -p lookmatch-remap` prints a table over five seeds: Ward to GGX, 20 source points, a target lattice of 3,010
//! points (a switch, 43 indices, 35 roughnesses), every source point on its own. The bars are 95 % and 15 %.

use lookmatch_materials::{Levels, by_name};
use lookmatch_remap::{Options, Plan, Preset, Probe, Side, Stage, Strategy, Vary, remap};

const SEEDS: u64 = 5;
const METHODS: [&str; 2] = ["genetic", "genetic-guarnera2018"];

fn plan(search: &str, seed: u64) -> Plan {
    let vary = |side, name: &str, min, max, step| Vary {
        side: Some(side),
        name: name.into(),
        levels: Levels::new(min, max, step),
    };
    let options = Options {
        strategy: Strategy::Unconstrained,
        search: search.into(),
        seed,
        preset: Some(Preset::Paper),
        mask: true,
        size: Some(128),
        vary: vec![
            vary(Side::Source, "specular", 0.02, 0.08, 0.02),
            vary(Side::Source, "roughness", 0.05, 0.65, 0.15),
            vary(Side::Target, "ior", 1.01, 1.85, 0.02),
            vary(Side::Target, "roughness", 0.01, 0.69, 0.02),
        ],
        ..Options::default()
    };
    let model = |name| by_name(name).expect("a model of the catalogue");
    Plan::new(model("ward"), model("ggx"), &options).expect("a sound plan")
}

fn run(search: &str, seed: u64, stage: &Stage) -> Probe {
    remap(&plan(search, seed), stage, None, &mut |_| {}, &|| false).expect("a probe")
}

fn main() {
    let stage = Stage::prepare(&plan("exhaustive", 1)).expect("the reference scene");
    let truth = run("exhaustive", 1, &stage);
    println!(
        "{:<24}{:>6}{:>18}{:>18}{:>22}",
        "search", "seed", "optimum found", "lattice seen", "worst fitness ratio"
    );
    for method in METHODS {
        for seed in 1..=SEEDS {
            let probe = run(method, seed, &stage);
            let pairs = || probe.entries.iter().zip(&truth.entries);
            let found = pairs().filter(|(a, b)| a.target == b.target).count();
            let worst = pairs().map(|(a, b)| a.fitness / b.fitness).fold(1.0, f64::max);
            let points = probe.entries.len();
            println!(
                "{method:<24}{seed:>6}{:>16.1} %{:>16.1} %{worst:>22.4}",
                100.0 * found as f64 / points as f64,
                100.0 * probe.totals.evaluations as f64 / (points * probe.totals.lattice_points) as f64,
            );
        }
    }
}
