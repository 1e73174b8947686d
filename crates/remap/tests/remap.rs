//! What a remap promises: monotone where constrained, optimal where it can be proven, the same on any number of threads.

use lookmatch_materials::{Levels, Material, by_name};
use lookmatch_remap::{Options, Plan, Probe, Side, Stage, Strategy, Vary, apply, remap, validation_points};

fn vary(side: Side, name: &str, (min, max, step): (f64, f64, f64)) -> Vary {
    Vary { side: Some(side), name: name.into(), levels: Levels::new(min, max, step) }
}

/// Ward to GGX with 3 × 4 source points and a target lattice that can be tried in full.
fn options() -> Options {
    Options {
        size: Some(32),
        mask: true,
        vary: vec![
            vary(Side::Source, "specular", (0.02, 0.10, 0.04)),
            vary(Side::Source, "roughness", (0.05, 0.50, 0.15)),
            vary(Side::Target, "ior", (1.1, 2.1, 0.05)),
            vary(Side::Target, "roughness", (0.02, 0.60, 0.02)),
        ],
        ..Options::default()
    }
}

fn run(options: &Options) -> Probe {
    let plan = Plan::new(by_name("ward").unwrap(), by_name("ggx").unwrap(), options).unwrap();
    let stage = Stage::prepare(&plan).unwrap();
    remap(&plan, &stage, None, &mut |_| {}, &|| false).unwrap()
}

#[test]
fn constrained_targets_grow_with_their_sources() {
    let probe = run(&options());
    let target = |i: usize, j: usize| &probe.entry(&[i, j]).target;
    for i in 0..3 {
        for j in 0..4 {
            assert_eq!(target(i, j)[0], 1.0, "a specular source has a specular target");
            if i > 0 {
                assert!(target(i, j)[1] >= target(i - 1, j)[1], "index along specular at {i}, {j}");
            }
            if j > 0 {
                assert!(target(i, j)[2] >= target(i, j - 1)[2], "roughness along roughness at {i}, {j}");
            }
        }
    }
}

#[test]
fn the_genetic_search_finds_the_exhaustive_optimum() {
    let unconstrained = Options { strategy: Strategy::Unconstrained, ..options() };
    let truth = run(&Options { search: "exhaustive".into(), ..unconstrained.clone() });
    let found = run(&unconstrained);
    assert!(found.totals.evaluations < truth.totals.evaluations / 2);
    let same = found.entries.iter().zip(&truth.entries).filter(|(a, b)| a.target == b.target).count();
    assert!(same >= 11, "{same} of 12 source points");
    for (found, truth) in found.entries.iter().zip(&truth.entries) {
        assert!(found.fitness >= truth.fitness, "nothing is better than the best: {found:?} {truth:?}");
    }
}

#[test]
fn probes_do_not_depend_on_the_number_of_threads() {
    let with_threads =
        |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| run(&options()));
    assert_eq!(with_threads(1), with_threads(3));
}

#[test]
fn application_reproduces_and_interpolates_the_table() {
    let probe = run(&options());
    let ward = |specular: f64, roughness: f64| {
        Material::parse(&format!("ward:specular={specular},roughness={roughness}")).unwrap()
    };
    for entry in &probe.entries {
        let applied = apply(&probe, &ward(entry.source[0], entry.source[1]), false).unwrap();
        assert_eq!(applied.target.number("ior").unwrap(), entry.target[1]);
        assert_eq!(applied.target.number("roughness").unwrap(), entry.target[2]);
        assert_eq!(applied.saturated, entry.saturated);
    }
    let between = apply(&probe, &ward(0.04, 0.05), false).unwrap().target.number("ior").unwrap();
    let (low, high) = (probe.entry(&[0, 0]).target[1], probe.entry(&[1, 0]).target[1]);
    assert!((between - (low + high) / 2.0).abs() < 1e-9, "halfway between {low} and {high}: {between}");
    assert!(apply(&probe, &ward(0.04, 0.7), false).is_err());
    assert_eq!(apply(&probe, &ward(0.04, 0.7), true).unwrap().clamped, ["roughness"]);
}

#[test]
fn validation_points_spread_over_the_table() {
    let probe = run(&options());
    assert_eq!(validation_points(&probe, None).len(), 12);
    let some = validation_points(&probe, Some(5));
    assert!(some.len() == 5 && some.windows(2).all(|w| w[0] < w[1]) && some[4] < 12, "{some:?}");
    assert_eq!(validation_points(&probe, Some(100)).len(), 12);
}
