//! What every search promises: bounds, one evaluation per point, repeatability, guesses, sound errors.

mod common;

use std::collections::HashSet;

use common::{Scene, sources};
use lookmatch_search::{
    Axis, Bounds, Genetic, GeneticSettings, Lattice, Objective, ObjectiveError, ObjectiveFn, Point, Problem,
    Search, SearchError, by_name, registry,
};
use proptest::prelude::*;

/// Remembers every point it is asked for.
struct Recorder<F> {
    fitness: F,
    asked: Vec<Point>,
}

impl<F: Fn(&Point) -> f64> Objective for Recorder<F> {
    fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
        self.asked.extend_from_slice(points);
        Ok(points.iter().map(&self.fitness).collect())
    }
}

fn square(levels: u32, axes: usize) -> Lattice {
    let axis =
        |k: usize| Axis::regular(format!("x{k}"), 0.0, f64::from(levels - 1), 1.0).expect("a sound range");
    Lattice { axes: (0..axes).map(axis).collect() }
}

fn whole(lattice: &Lattice, seed: u64) -> Problem<'_> {
    Problem { lattice, bounds: Bounds::full(lattice), guesses: vec![], seed }
}

fn bowl(centre: &[f64]) -> impl Fn(&Point) -> f64 {
    move |p| p.iter().zip(centre).map(|(&i, c)| (f64::from(i) - c).powi(2)).sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn searches_stay_within_bounds_and_never_ask_twice(
        sides in proptest::collection::vec((0u32..30, 0u32..30), 1..4),
        centre in proptest::collection::vec(-5.0..35.0, 4),
        seed: u64,
    ) {
        let lattice = square(60, sides.len());
        let bounds = Bounds {
            low: sides.iter().map(|s| s.0).collect(),
            high: sides.iter().map(|s| s.0 + s.1).collect(),
        };
        let guesses = vec![vec![59; sides.len()], vec![0; sides.len()]];
        let problem = Problem { lattice: &lattice, bounds: bounds.clone(), guesses, seed };
        let continued: Box<dyn Search> = Box::new(Genetic::new(GeneticSettings::continued()));
        for search in registry().iter().map(|entry| (entry.make)()).chain([continued]) {
            let mut recorder = Recorder { fitness: bowl(&centre), asked: vec![] };
            let outcome = search.run(&problem, &mut recorder).expect("a sound problem");
            let distinct: HashSet<&Point> = recorder.asked.iter().collect();
            prop_assert!(recorder.asked.iter().all(|p| bounds.contains(p)));
            prop_assert_eq!(distinct.len(), recorder.asked.len());
            prop_assert_eq!(distinct.len(), outcome.evaluations);
            let lowest = recorder.asked.iter().map(|p| (recorder.fitness)(p)).fold(f64::INFINITY, f64::min);
            prop_assert_eq!(outcome.fitness, lowest);
            prop_assert_eq!((recorder.fitness)(&outcome.best), lowest);
        }
    }

    #[test]
    fn exhaustive_is_brute_force_and_the_default_agrees_on_bowls(
        centre in proptest::collection::vec(-3.0..20.0, 3),
        seed: u64,
    ) {
        let lattice = square(17, 3);
        let fitness = bowl(&centre);
        let all = lattice.points(&Bounds::full(&lattice)).map(|p| (fitness(&p), p));
        let truth = all.reduce(|a, b| if b.0 < a.0 { b } else { a }).expect("points");
        for name in ["exhaustive", "genetic"] {
            let search = by_name(name).expect("a registered name");
            let outcome = search.run(&whole(&lattice, seed), &mut ObjectiveFn(&fitness)).expect("a sound problem");
            prop_assert_eq!((outcome.fitness, outcome.best), truth.clone(), "{}", name);
        }
    }
}

#[test]
fn equal_seeds_give_equal_outcomes() {
    let scene = Scene::coarse();
    let mut matches = sources(&scene, 3, 0.01);
    for entry in registry() {
        let mut run =
            |seed| (entry.make)().run(&scene.problem(seed), &mut matches[2]).expect("a sound problem");
        assert_eq!(run(7), run(7), "{}", entry.name);
    }
}

/// A hole one point wide can only be found by being told.
#[test]
fn guesses_are_evaluated() {
    let lattice = square(200, 3);
    let hole = vec![123, 45, 67];
    for name in ["genetic", "genetic-guarnera2018", "genetic-deep2009", "survey"] {
        let problem = Problem { guesses: vec![hole.clone()], ..whole(&lattice, 5) };
        let mut flat = ObjectiveFn(|p: &Point| if *p == hole { 0.0 } else { 1.0 });
        let outcome = by_name(name).and_then(|s| s.run(&problem, &mut flat)).expect("a sound problem");
        assert_eq!(outcome.best, hole, "{name}");
    }
}

#[test]
fn lattices_of_one_point_or_no_axis_are_searched() {
    for lattice in [square(1, 2), square(1, 0)] {
        for entry in registry() {
            let outcome = (entry.make)()
                .run(&whole(&lattice, 0), &mut ObjectiveFn(|_: &Point| 3.0))
                .expect("a sound problem");
            assert_eq!((outcome.fitness, outcome.evaluations), (3.0, 1));
        }
    }
}

#[test]
fn unsound_input_is_named() {
    let lattice = square(9, 2);
    let mut flat = ObjectiveFn(|_: &Point| 1.0);
    let fails = |problem: Problem, flat: &mut dyn Objective| {
        Genetic::default().run(&problem, flat).expect_err("unsound").to_string()
    };
    let past = Bounds { low: vec![0, 0], high: vec![8, 9] };
    assert!(fails(Problem { bounds: past, ..whole(&lattice, 0) }, &mut flat).contains("axis x1"));
    let thin = Problem { guesses: vec![vec![1]], ..whole(&lattice, 0) };
    assert!(fails(thin, &mut flat).contains("guesses"));
    let mut nan = ObjectiveFn(|p: &Point| if p[0] == 3 { f64::NAN } else { 1.0 });
    assert!(fails(whole(&lattice, 0), &mut nan).contains("x0 = 3"));
}

#[test]
fn failures_of_the_objective_are_handed_on() {
    struct Short;
    impl Objective for Short {
        fn evaluate(&mut self, _: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
            Ok(vec![])
        }
    }
    struct Broken;
    impl Objective for Broken {
        fn evaluate(&mut self, _: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
            Err("the renderer is gone".into())
        }
    }
    let lattice = square(9, 2);
    for entry in registry() {
        let search = (entry.make)();
        let short = search.run(&whole(&lattice, 0), &mut Short);
        assert!(matches!(short, Err(SearchError::ResultCount { found: 0, .. })));
        let broken = search.run(&whole(&lattice, 0), &mut Broken).expect_err("broken");
        let source = std::error::Error::source(&broken).expect("the cause");
        assert_eq!(source.to_string(), "the renderer is gone");
    }
}

#[test]
fn settings_are_checked_and_read_from_files() {
    let partial: GeneticSettings = serde_json::from_str(r#"{"stall_generations": 9}"#).expect("known fields");
    assert_eq!(partial, GeneticSettings { stall_generations: 9, ..GeneticSettings::default() });
    assert!(serde_json::from_str::<GeneticSettings>(r#"{"stal": 9}"#).is_err());
    let wild = GeneticSettings { mutation_probability: 2.0, ..partial };
    let error = Genetic::new(wild).run(&whole(&square(9, 2), 0), &mut ObjectiveFn(|_: &Point| 1.0));
    assert!(error.expect_err("out of range").to_string().contains("mutation_probability"));
}
