//! What a proven optimum costs, and how that grows with the lattices.
//!
//! `cargo bench -p lookmatch-remap --bench exhaustive [-- SIZE]` prints, for lattices with 1/4, 1/2, 1 and 2 times the points:
//! the processor time of each target and of each source, and its ratio to that of the lattice before; how many targets
//! had to be compared in full with a source (median, 90th percentile, maximum, mean); the most memory used so far.

use lookmatch_materials::{Levels, by_name};
use lookmatch_remap::{Event, Options, Plan, Preset, Side, Stage, Strategy, Vary, remap};

/// Numbers of points in units of the paper's.
const FINENESS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];

/// Ward to GGX on lattices with about `fineness` times the paper's 20 × 35 and 2 × 85 × 70 points.
fn plan(fineness: f64, size: usize) -> Plan {
    let vary = |side, name: &str, min: f64, max: f64, levels: f64| {
        let step = (max - min) / ((levels * fineness.sqrt()).round() - 1.0);
        Vary { side: Some(side), name: name.into(), levels: Levels::new(min, max, step) }
    };
    let options = Options {
        strategy: Strategy::Unconstrained,
        search: "exhaustive".into(),
        preset: Some(Preset::Paper),
        size: Some(size),
        vary: vec![
            vary(Side::Source, "specular", 0.02, 0.40, 20.0),
            vary(Side::Source, "roughness", 0.02, 0.70, 35.0),
            vary(Side::Target, "ior", 1.01, 1.85, 85.0),
            vary(Side::Target, "roughness", 0.01, 0.70, 70.0),
        ],
        ..Options::default()
    };
    let model = |name| by_name(name).expect("a model of the catalogue");
    Plan::new(model("ward"), model("ggx"), &options).expect("a sound plan")
}

/// Processor time of this process in seconds.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    fields.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Most memory used so far in MiB.
fn peak_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kib| kib.parse::<f64>().ok()).unwrap_or(f64::NAN) / 1024.0
}

fn main() {
    let size = std::env::args().filter_map(|a| a.parse().ok()).next().unwrap_or(300);
    let stage = Stage::prepare(&plan(1.0, size)).expect("the reference scene");
    println!("scene prepared: {:.1} CPU s, {:.0} MiB", processor_seconds(), peak_memory());
    println!(
        "{:>8}{:>9}{:>9}{:>12}{:>8}{:>12}{:>8}{:>20}{:>8}",
        "fineness", "targets", "sources", "ms/target", "ratio", "ms/source", "ratio", "compared", "MiB"
    );
    let mut last: Option<[f64; 2]> = None;
    for fineness in FINENESS {
        let plan = plan(fineness, size);
        let start = processor_seconds();
        let (mut filled, mut targets, mut counts) = (start, 0, Vec::new());
        let mut observe = |event: Event| match event {
            Event::Compared { total, .. } => (filled, targets) = (processor_seconds(), total),
            Event::Point { compared, .. } => counts.push(compared),
            Event::Resumed { .. } => {}
        };
        remap(&plan, &stage, None, &mut observe, &|| false).expect("a probe");
        let costs = [
            1e3 * (filled - start) / targets as f64,
            1e3 * (processor_seconds() - filled) / counts.len() as f64,
        ];
        let [target_ratio, source_ratio] =
            last.map_or([1.0; 2], |last| [costs[0] / last[0], costs[1] / last[1]]);
        last = Some(costs);
        counts.sort_unstable();
        let mean = counts.iter().sum::<usize>() as f64 / counts.len() as f64;
        let part = |share: f64| counts[((counts.len() - 1) as f64 * share).round() as usize];
        println!(
            "{fineness:>8}{targets:>9}{:>9}{:>12.3}{target_ratio:>8.2}{:>12.3}{source_ratio:>8.2}{:>20}{:>8.0}",
            counts.len(),
            costs[0],
            costs[1],
            format!("{}, {}, {}, {mean:.2}", part(0.5), part(0.9), part(1.0)),
            peak_memory(),
        );
    }
}
