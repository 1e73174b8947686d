//! Few renders: candidates that synthesised pictures propose, results between levels, constraints that the user pairs.

use std::collections::HashSet;
use std::sync::OnceLock;

use lookmatch_materials::{Levels, by_name};
use lookmatch_remap::{Options, Pair, Plan, Probe, Side, Stage, Strategy, Vary, remap};

fn vary(side: Side, name: &str, (min, max, step): (f64, f64, f64)) -> Vary {
    Vary { side: Some(side), name: name.into(), levels: Levels::new(min, max, step) }
}

/// Ward to GGX with 3 × 4 source points and 3,182 targets.
fn options(search: &str) -> Options {
    Options {
        size: Some(32),
        mask: true,
        strategy: Strategy::Unconstrained,
        search: search.into(),
        vary: vec![
            vary(Side::Source, "specular", (0.02, 0.10, 0.04)),
            vary(Side::Source, "roughness", (0.05, 0.50, 0.15)),
            vary(Side::Target, "ior", (1.1, 2.1, 0.025)),
            vary(Side::Target, "roughness", (0.02, 0.60, 0.015)),
        ],
        ..Options::default()
    }
}

fn between(from: &str, to: &str, options: &Options) -> Probe {
    let plan = Plan::new(by_name(from).unwrap(), by_name(to).unwrap(), options).unwrap();
    let stage = Stage::prepare(&plan).unwrap();
    remap(&plan, &stage, None, &mut |_| {}, &|| false).unwrap()
}

fn run(options: &Options) -> Probe {
    // All of these look at one scene.
    static STAGE: OnceLock<Stage> = OnceLock::new();
    let plan = Plan::new(by_name("ward").unwrap(), by_name("ggx").unwrap(), options).unwrap();
    remap(&plan, STAGE.get_or_init(|| Stage::prepare(&plan).unwrap()), None, &mut |_| {}, &|| false).unwrap()
}

fn truth(strategy: Strategy) -> &'static Probe {
    static TRUTH: [OnceLock<Probe>; 2] = [OnceLock::new(), OnceLock::new()];
    let place = usize::from(strategy == Strategy::Constrained);
    TRUTH[place].get_or_init(|| run(&Options { strategy, ..options("exhaustive") }))
}

/// Mean fitness over that of the best.
fn ratio(found: &Probe, truth: &Probe) -> f64 {
    let ratios = found.entries.iter().zip(&truth.entries).map(|(a, b)| {
        assert!(a.fitness >= b.fitness - 1e-9, "nothing is better than the best: {a:?} {b:?}");
        a.fitness / b.fitness
    });
    ratios.sum::<f64>() / found.entries.len() as f64
}

#[test]
fn synthesis_finds_the_optimum_with_few_renders_and_says_how_far_off_it_was() {
    let truth = truth(Strategy::Unconstrained);
    for (search, most) in [("synthesis", 60), ("synthesis-half-rate", 900)] {
        let found = run(&options(search));
        let rendered = found.totals.rendered.unwrap();
        assert!(ratio(&found, truth) < 1.01, "{search}: {}", ratio(&found, truth));
        assert!(rendered <= most, "{search}: {rendered} targets of {}", truth.totals.rendered.unwrap());
        let record = found.totals.synthesis.unwrap();
        assert!(record.held_out > 0 && record.mean > 0.0 && record.most > 0.0, "{record:?}");
        assert!(record.mean < 0.2, "{search}: {record:?}");
        // What was found was rendered: its fitness is that of the real picture.
        let same = found.entries.iter().zip(&truth.entries).filter(|(a, b)| a.target == b.target);
        same.for_each(|(a, b)| assert!((a.fitness - b.fitness).abs() < 1e-9, "{a:?} {b:?}"));
    }
}

#[test]
fn nothing_is_rendered_along_what_is_linear() {
    let options = Options { vary: Vec::new(), quick: true, size: Some(24), ..options("synthesis") };
    let found = between("lafortune", "ward", &options);
    let truth = &between("lafortune", "ward", &Options { search: "exhaustive".into(), ..options });
    assert!(ratio(&found, truth) < 1.01, "{}", ratio(&found, truth));
    let (rendered, sources) = (found.totals.rendered.unwrap(), found.entries.len());
    assert!(rendered < 30 + 4 * sources, "{rendered} for {sources} sources");
}

#[test]
fn synthesis_does_not_depend_on_threads_or_on_what_was_remapped_before() {
    let run = || run(&options("synthesis"));
    let with_threads = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(run);
    let first = with_threads(1);
    assert_eq!(first, with_threads(3));
}

#[test]
fn cma_es_finds_nearly_the_optimum() {
    let truth = truth(Strategy::Unconstrained);
    let found = run(&options("cma-es"));
    assert!(ratio(&found, truth) < 1.02, "{}", ratio(&found, truth));
    assert!(found.totals.evaluations < truth.totals.evaluations / 5);
}

#[test]
fn refined_results_are_never_worse_and_lie_between_levels() {
    for strategy in [Strategy::Unconstrained, Strategy::Constrained] {
        let lattice = Options { strategy, ..options("exhaustive") };
        let (coarse, fine) = (truth(strategy), run(&Options { refine: true, ..lattice }));
        assert!(fine.refined && !coarse.refined);
        let mean = |probe: &Probe| probe.entries.iter().map(|e| e.fitness).sum::<f64>();
        assert!(mean(&fine) < 0.999 * mean(coarse), "{} {}", mean(&fine), mean(coarse));
        let between = |e: &lookmatch_remap::Entry| fine.target_axes[2].index_of(e.target[2]).is_none();
        assert!(fine.entries.iter().any(between));
        if strategy == Strategy::Unconstrained {
            for (fine, coarse) in fine.entries.iter().zip(&coarse.entries) {
                assert!(fine.fitness <= coarse.fitness, "{fine:?} {coarse:?}");
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("probe.json");
        fine.write(&path).unwrap();
        assert_eq!(Probe::read(&path).unwrap(), fine);
    }
}

/// Whether target axis `k` never falls while source axis `axis` rises.
fn is_monotone(probe: &Probe, axis: usize, k: usize) -> bool {
    let counts: Vec<usize> = probe.source_axes.iter().map(|a| a.len()).collect();
    (0..counts[0]).all(|i| {
        (0..counts[1]).all(|j| {
            let before = if axis == 0 { [i.wrapping_sub(1), j] } else { [i, j.wrapping_sub(1)] };
            before.contains(&usize::MAX)
                || probe.entry(&[i, j]).target[k] >= probe.entry(&before).target[k] - 1e-12
        })
    })
}

#[test]
fn refined_results_keep_the_constraint() {
    let constrained = Options { strategy: Strategy::Constrained, refine: true, ..options("auto") };
    let probe = run(&constrained);
    assert!(is_monotone(&probe, 0, 1) && is_monotone(&probe, 1, 2));
}

#[test]
fn pairs_replace_what_roles_say() {
    let pair = |source: &str, targets: &[&str]| Pair {
        source: source.into(),
        targets: targets.iter().map(|t| (*t).into()).collect(),
    };
    let with =
        |pairs: Vec<Pair>| run(&Options { strategy: Strategy::Constrained, pairs, ..options("exhaustive") });
    // A constraint that makes no sense shows that it is heeded: the index may not grow with the specular reflectance.
    let odd = with(vec![pair("specular", &["-ior"])]);
    let indices: HashSet<u64> = odd.entries.iter().map(|e| e.target[1].to_bits()).collect();
    let falls = |j: usize| (1..3).all(|i| odd.entry(&[i, j]).target[1] <= odd.entry(&[i - 1, j]).target[1]);
    assert!((0..4).all(falls), "{indices:?}");
    assert_eq!(odd.pairs, [pair("specular", &["-ior"])]);
    // With nothing paired every point is on its own, but for the switch.
    let free = with(vec![pair("specular", &[]), pair("roughness", &[])]);
    let alone = truth(Strategy::Unconstrained);
    assert_eq!(
        free.entries.iter().map(|e| &e.target).collect::<Vec<_>>(),
        alone.entries.iter().map(|e| &e.target).collect::<Vec<_>>()
    );
    let wrong = Options { pairs: vec![pair("specular", &["gloss"])], ..options("auto") };
    let error = Plan::new(by_name("ward").unwrap(), by_name("ggx").unwrap(), &wrong).unwrap_err();
    assert!(error.is_usage() && error.to_string().contains("'gloss' in --pair"), "{error}");
}
