//! The remap itself: a search for each source point, alone or led by its neighbours.

use std::collections::HashSet;
use std::path::Path;

use lookmatch_search::{
    Bounds, Genetic, GeneticSettings, Lattice, Objective, Outcome, Point, Problem, Search, SearchError,
    by_name,
};
use rayon::prelude::*;

use crate::carry::{Body, SourceLook};
use crate::gallery::{Match, Stopped, family, stopped};
use crate::journal::Journal;
use crate::pairing::Pairing;
use crate::refine::{self, Led};
use crate::synthesis::Syntheses;
use crate::table::{BATCH, FitnessTable, Found, Task};
use crate::{CrossStage, Entry, Plan, Probe, RemapError, Stage, Strategy};

/// Levels by which a result may differ from what its neighbours foresaw.
const FORESEEN: u32 = 3;

/// What happens during a remap, for progress displays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Some source points were finished by an earlier run.
    Resumed {
        /// How many.
        done: usize,
    },
    /// Before an exhaustive search: targets that were rendered, to be compared with all source points.
    Compared {
        /// Rendered targets.
        done: usize,
        /// All targets that look different.
        total: usize,
    },
    /// A source point is finished.
    Point {
        /// Finished points.
        done: usize,
        /// All points.
        total: usize,
        /// Targets that were compared with it in full.
        compared: usize,
    },
}

/// Finds the target of every source point of a plan.
///
/// `state` is a file that keeps finished points while the work goes on (see [`crate::journal_path`]) and is removed at
/// its end; `stop` is asked often and ends the work early.
///
/// # Errors
/// [`RemapError::Interrupted`] where `stop` said so; the failures of the search and of the state file.
pub fn remap(
    plan: &Plan,
    stage: &Stage,
    state: Option<&Path>,
    observe: &mut dyn FnMut(Event),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Probe, RemapError> {
    [&plan.from, &plan.to].into_iter().try_for_each(RemapError::check_ours)?;
    run(plan, Own { stage, is_certified: plan.search == "exhaustive" }.into(), state, observe, stop)
}

/// [`remap()`] where one of the models, or both, belong to other renderers.
///
/// # Errors
/// As [`remap()`]; [`RemapError::Render`] where no source point could be rendered. Single ones that could not be make entries that
/// say so.
pub fn remap_across(
    plan: &Plan,
    stage: &CrossStage,
    state: Option<&Path>,
    observe: &mut dyn FnMut(Event),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Probe, RemapError> {
    let probe = run(plan, Eye::Cross(stage), state, observe, stop)?;
    let first_failure = probe.entries.first().and_then(|entry| entry.failed.clone());
    match first_failure.filter(|_| probe.found().next().is_none()) {
        Some(reason) => Err(RemapError::Render(reason)),
        None => Ok(probe),
    }
}

/// Our own renderer as the judge; `is_certified` finds optima through a [`FitnessTable`], where targets can be shared.
struct Own<'a> {
    stage: &'a Stage,
    is_certified: bool,
}

/// The match of one source point.
pub(crate) struct Matched {
    pub(crate) best: Point,
    /// Targets that were compared with it in full.
    pub(crate) compared: usize,
    pub(crate) entry: Entry,
}

impl Matched {
    /// What is known of a source point that could not be rendered.
    fn failed(values: &[f64], reason: String) -> Self {
        Self { best: Point::new(), compared: 0, entry: Entry::failed(values.to_vec(), reason) }
    }
}

/// Who looks at the materials.
enum Eye<'a> {
    Own(Own<'a>),
    Cross(&'a CrossStage),
}

impl<'a> From<Own<'a>> for Eye<'a> {
    fn from(own: Own<'a>) -> Self {
        Self::Own(own)
    }
}

impl Eye<'_> {
    /// A match between the levels of the lattice, if the plan wants it.
    fn refined(
        &self,
        plan: &Plan,
        lattice: &Lattice,
        matched: Matched,
        (pairing, led): (&Pairing, &Led),
        (syntheses, stop): (&Syntheses, &(dyn Fn() -> bool + Sync)),
    ) -> Result<Matched, RemapError> {
        let Self::Own(Own { stage, .. }) = self else { return Ok(matched) };
        if !plan.refine || matched.entry.failed.is_some() {
            return Ok(matched);
        }
        let (fine, centre) = refine::around(lattice, &matched.best, led);
        let source = plan.source_material(&matched.entry.source)?;
        let appearance = &*stage.known_appearances(std::slice::from_ref(&source)).swap_remove(0);
        let (look, compared) = (SourceLook::new(&source), HashSet::new());
        let mut objective = Match {
            plan,
            stage,
            lattice: &fine,
            source: look,
            appearance,
            compared,
            family: None,
            syntheses,
            stop,
        };
        let (values, fitness) = refine::descend(&fine, centre, plan.seed, &mut objective)?;
        if fitness >= matched.entry.fitness {
            return Ok(matched);
        }
        let trends = pairing.trends(plan.strategy);
        let best = refine::standing(lattice, &values, &trends);
        let evaluations = matched.entry.evaluations + objective.compared();
        let outcome = Outcome { best: best.clone(), fitness, evaluations, generations: 0 };
        let mut entry = entry(plan, stage, lattice, matched.entry.source, &outcome, values)?;
        let is_between = |name: &String| {
            let axis = lattice.axes.iter().position(|axis| axis.name == *name);
            axis.is_some_and(|k| lattice.axes[k].index_of(entry.target[k]).is_none())
        };
        let saturated = entry.saturated.iter().filter(|name| !is_between(name)).cloned().collect();
        entry.saturated = saturated;
        Ok(Matched { best, compared: evaluations, entry })
    }

    /// The match of one source point.
    fn find(
        &self,
        plan: &Plan,
        values: &[f64],
        problem: &Problem,
        syntheses: &Syntheses,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Matched, RemapError> {
        match self {
            Self::Cross(stage) => match stage.find(plan, values, problem, syntheses, stop) {
                Err(_) if stop() => Err(stopped()),
                // The others may fare better.
                Err(RemapError::Render(reason)) => Ok(Matched::failed(values, reason)),
                found => found,
            },
            Self::Own(Own { stage, .. }) => {
                let outcome = search_one(plan, stage, values, problem, (syntheses, stop))?;
                let target = problem.lattice.values(&outcome.best);
                let entry = entry(plan, stage, problem.lattice, values.to_vec(), &outcome, target)?;
                Ok(Matched { best: outcome.best, compared: outcome.evaluations, entry })
            }
        }
    }
}

fn run(
    plan: &Plan,
    eye: Eye,
    state: Option<&Path>,
    observe: &mut dyn FnMut(Event),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Probe, RemapError> {
    let lattice = Lattice { axes: plan.target_axes.clone() };
    let sources = Lattice { axes: plan.source_axes.clone() };
    let syntheses = Syntheses::default();
    let total = sources.len();
    let mut found: Vec<Option<(Point, Entry)>> = vec![None; total];
    let mut journal = match state {
        Some(path) => Some(Journal::open(path, plan, |place, point, entry, rendered| {
            syntheses.recall(rendered);
            if let Some(slot) = found.get_mut(place) {
                *slot = Some((point, entry));
            }
        })?),
        None => None,
    };
    let resumed = found.iter().flatten().count();
    if resumed > 0 {
        observe(Event::Resumed { done: resumed });
    }
    let pairing = Pairing::new(plan)?;
    let table = match &eye {
        Eye::Own(Own { stage, is_certified: true }) if resumed < total => {
            let table = FitnessTable::fill(plan, stage, &lattice, &sources, observe, stop);
            let table = table.map_err(|e| interrupted(e, resumed, total))?;
            table.map(|table| (table, *stage))
        }
        _ => None,
    };
    let mut done = resumed;
    for wave in waves(plan, &sources, table.is_some()) {
        if stop() {
            return Err(RemapError::Interrupted { done, total });
        }
        let wave: Vec<(usize, Point)> =
            wave.into_iter().filter(|(place, _)| found[*place].is_none()).collect();
        let values: Vec<Vec<f64>> = wave.iter().map(|(_, indices)| sources.values(indices)).collect();
        let problem = |indices: &Point| match plan.strategy {
            Strategy::Unconstrained => pairing.alone(&lattice, plan.seed),
            Strategy::Constrained => pairing.led(&lattice, plan.seed, indices, &|p| {
                let result = found[place_of(&sources, p)].as_ref();
                result.filter(|(_, entry)| entry.failed.is_none()).map(|(point, _)| point)
            }),
        };
        let problems: Vec<Problem> = wave.iter().map(|(_, indices)| problem(indices)).collect();
        let led: Vec<Led> = match plan.strategy {
            Strategy::Unconstrained => vec![Led::new(); wave.len()],
            Strategy::Constrained => {
                let target =
                    |p: &[u32]| found[place_of(&sources, p)].as_ref().map(|(_, entry)| &entry.target);
                wave.iter().map(|(_, indices)| pairing.led_values(indices, &target)).collect()
            }
        };
        let searched = match &table {
            Some((table, stage)) => search_all(plan, (table, stage), &lattice, &values, problems, stop),
            None => {
                let points = values.iter().zip(&problems);
                points.map(|(values, problem)| eye.find(plan, values, problem, &syntheses, stop)).collect()
            }
        };
        let results: Vec<Matched> = searched.map_err(|e| interrupted(e, done, total))?;
        for (((place, _), matched), led) in wave.into_iter().zip(results).zip(led) {
            let matched = eye.refined(plan, &lattice, matched, (&pairing, &led), (&syntheses, stop));
            let Matched { best, compared, entry } = matched.map_err(|e| interrupted(e, done, total))?;
            if let Some(journal) = &mut journal {
                journal.append(place, &best, &entry, syntheses.counted())?;
            }
            found[place] = Some((best, entry));
            done += 1;
            observe(Event::Point { done, total, compared });
        }
    }
    if let Some(journal) = journal {
        journal.remove();
    }
    let mut probe =
        Probe::new(plan, found.into_iter().flatten().map(|(_, entry)| entry).collect(), lattice.len());
    let rendered = table.map_or_else(|| syntheses.rendered(), |(table, _)| table.len());
    probe.totals.rendered = Some(rendered).filter(|rendered| *rendered > 0);
    probe.totals.synthesis = syntheses.record();
    Ok(probe)
}

/// An error of a search, with what was done where it was stopped from outside.
fn interrupted(error: RemapError, done: usize, total: usize) -> RemapError {
    match error {
        RemapError::Search(SearchError::Objective(e)) if e.is::<Stopped>() => {
            RemapError::Interrupted { done, total }
        }
        other => other,
    }
}

/// Source points in groups that can be searched together, with their places; each only needs the results of earlier
/// groups.
fn waves(plan: &Plan, sources: &Lattice, together: bool) -> Vec<Vec<(usize, Point)>> {
    let mut points: Vec<(usize, Point)> = sources.points(&Bounds::full(sources)).enumerate().collect();
    // Neighbours that lead a point have a smaller sum of indices.
    let rank = |(_, point): &(usize, Point)| match plan.strategy {
        Strategy::Constrained => point.iter().sum::<u32>(),
        Strategy::Unconstrained => 0,
    };
    if !together {
        return points.into_iter().map(|point| vec![point]).collect();
    }
    points.sort_by_key(rank);
    let groups = points.chunk_by(|a, b| rank(a) == rank(b));
    groups.flat_map(|group| group.chunks(BATCH)).map(<[_]>::to_vec).collect()
}

/// Searches the targets of several source points that do not depend on each other.
fn search_all(
    plan: &Plan,
    (table, stage): (&FitnessTable, &Stage),
    lattice: &Lattice,
    values: &[Vec<f64>],
    problems: Vec<Problem>,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Matched>, RemapError> {
    let task = |(values, problem): (&Vec<f64>, Problem)| {
        Ok(Task { source: plan.source_material(values)?, bounds: problem.bounds })
    };
    let tasks = values.iter().zip(problems).map(task).collect::<Result<Vec<_>, RemapError>>()?;
    let results = table.search(&tasks, stop)?;
    let entry = |(values, Found { outcome, compared }): (&Vec<f64>, Found)| {
        let entry = entry(plan, stage, lattice, values.clone(), &outcome, lattice.values(&outcome.best))?;
        Ok(Matched { best: outcome.best, compared, entry })
    };
    values.par_iter().zip(results).map(entry).collect()
}

/// Searches the target of one source point.
fn search_one(
    plan: &Plan,
    stage: &Stage,
    values: &[f64],
    problem: &Problem,
    (syntheses, stop): (&Syntheses, &(dyn Fn() -> bool + Sync)),
) -> Result<Outcome, RemapError> {
    let source = plan.source_material(values)?;
    let appearance = &*stage.known_appearances(std::slice::from_ref(&source)).swap_remove(0);
    let (lattice, compared) = (problem.lattice, HashSet::new());
    let look = SourceLook::rounded(&source);
    let family = family(plan, &look, Body::Matched)?;
    let mut objective =
        Match { plan, stage, lattice, source: look, appearance, compared, family, syntheses, stop };
    let found = searched(plan, problem, &mut objective)?;
    let target = plan.target_material(&source, &lattice.values(&found.best))?;
    let seen = stage.known_appearances(&[target]).swap_remove(0);
    Ok(Outcome { fitness: stage.fitness(appearance, &seen), ..found })
}

/// An objective that knows how many points it compared.
pub(crate) trait Counting: Objective {
    /// Points that were compared so far, also by an earlier search of the same source.
    fn compared(&self) -> usize;
}

impl Counting for Match<'_> {
    fn compared(&self) -> usize {
        self.compared.len()
    }
}

/// Runs the search method of a plan.
pub(crate) fn searched<O: Counting>(
    plan: &Plan,
    problem: &Problem,
    objective: &mut O,
) -> Result<Outcome, RemapError> {
    let mut run = |method: &dyn Search| method.run(problem, objective).map_err(RemapError::Search);
    if plan.search != "genetic" || problem.guesses.is_empty() {
        return run(&*by_name(&plan.search).map_err(RemapError::Search)?);
    }
    // With neighbours to start from, a wide initial population would only cost renders ...
    let near = run(&Genetic::new(GeneticSettings::continued()))?;
    if problem.guesses.iter().any(|guess| is_near(guess, &near.best)) {
        return Ok(near);
    }
    // ... unless they did not foresee the result: then it may be any local optimum.
    let wide = run(&Genetic::default())?;
    let evaluations = objective.compared();
    let best = if (wide.fitness, &wide.best) < (near.fitness, &near.best) { wide } else { near };
    Ok(Outcome { evaluations, ..best })
}

/// True where two points differ by no more than [`FORESEEN`] levels along each axis.
fn is_near(a: &Point, b: &Point) -> bool {
    a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= FORESEEN)
}

fn entry(
    plan: &Plan,
    stage: &Stage,
    lattice: &Lattice,
    source: Vec<f64>,
    outcome: &Outcome,
    target: Vec<f64>,
) -> Result<Entry, RemapError> {
    let material = plan.source_material(&source)?;
    let [nrmsd, nrmsd_masked] = stage.nrmsd(&material, &plan.target_material(&material, &target)?)?;
    Ok(Entry {
        source,
        target,
        fitness: outcome.fitness,
        nrmsd,
        nrmsd_masked,
        evaluations: outcome.evaluations,
        saturated: on_edge(lattice, &outcome.best),
        body: None,
        noise: None,
        failed: None,
    })
}

/// Axes on whose edge a point lies.
pub(crate) fn on_edge(lattice: &Lattice, point: &Point) -> Vec<String> {
    let on_edge = |(axis, index): (&lookmatch_search::Axis, &u32)| {
        // Of two levels one is always an edge: a switch is not saturated.
        let edge = *index == 0 || *index as usize == axis.len() - 1;
        (axis.len() > 2 && edge).then(|| axis.name.clone())
    };
    lattice.axes.iter().zip(point).filter_map(on_edge).collect()
}

/// The place of indices in lexicographic order.
fn place_of(sources: &Lattice, indices: &[u32]) -> usize {
    indices.iter().zip(&sources.axes).fold(0, |sum, (i, axis)| sum * axis.len() + *i as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Assignment, Options, Preset, Side, Vary};
    use lookmatch_materials::Levels;

    fn vary(side: Side, name: &str, (min, max, step): (f64, f64, f64)) -> Vary {
        Vary { side: Some(side), name: name.into(), levels: Levels::new(min, max, step) }
    }

    /// Ward to GGX with 5 × 4 source points, dark ones among them, and 2 × 13 × 18 targets.
    fn options(strategy: Strategy, mask: bool) -> Options {
        Options {
            strategy,
            search: "exhaustive".into(),
            mask,
            preset: Some(Preset::Paper),
            size: Some(40),
            vary: vec![
                vary(Side::Source, "specular", (0.0, 0.2, 0.05)),
                vary(Side::Source, "roughness", (0.03, 0.63, 0.2)),
                vary(Side::Target, "ior", (1.1, 2.3, 0.1)),
                vary(Side::Target, "roughness", (0.02, 0.70, 0.04)),
            ],
            ..Options::default()
        }
    }

    fn plan(from: &str, options: &Options) -> Plan {
        let model = |name| lookmatch_materials::by_name(name).unwrap();
        Plan::new(model(from), model("ggx"), options).unwrap()
    }

    /// Entries, and the targets that were compared in full.
    fn entries(plan: &Plan, stage: &Stage, certified: bool) -> (Vec<Entry>, usize) {
        let mut sum = 0;
        let mut observe = |event: Event| {
            if let Event::Point { compared, .. } = event {
                sum += compared;
            }
        };
        let own = Own { stage, is_certified: certified };
        let probe = run(plan, own.into(), None, &mut observe, &|| false).unwrap();
        (probe.entries, sum)
    }

    #[test]
    fn certified_optima_are_those_of_brute_force_on_any_number_of_threads() {
        for mask in [false, true] {
            let stage = Stage::prepare(&plan("ward", &options(Strategy::Constrained, mask))).unwrap();
            for strategy in [Strategy::Constrained, Strategy::Unconstrained] {
                let plan = plan("ward", &options(strategy, mask));
                let (brute, all) = entries(&plan, &stage, false);
                for threads in [1, 3] {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                    let (certified, compared) = pool.install(|| entries(&plan, &stage, true));
                    assert_eq!(certified, brute);
                    assert!(compared < all / 20, "{compared} of {all} compared in full");
                }
            }
        }
    }

    /// A conductor has no diffuse reflectance to hand over: the target keeps its own.
    #[test]
    fn certified_optima_with_a_diffuse_term() {
        let mut options = options(Strategy::Unconstrained, false);
        options.vary.retain(|v| v.side == Some(Side::Target));
        let plan = plan("beckmann-conductor", &options);
        let stage = Stage::prepare(&plan).unwrap();
        assert_eq!(entries(&plan, &stage, true).0, entries(&plan, &stage, false).0);
    }

    #[test]
    fn the_first_of_all_ties_wins() {
        let dark = Assignment { side: Some(Side::Target), name: "specular".into(), value: "0".into() };
        let plan = plan("ward", &Options { fix: vec![dark], ..options(Strategy::Constrained, false) });
        let stage = Stage::prepare(&plan).unwrap();
        let (certified, _) = entries(&plan, &stage, true);
        assert_eq!(certified, entries(&plan, &stage, false).0);
        assert_eq!(certified[0].target, [1.1, 0.02]);
    }

    #[test]
    fn a_stopped_table_says_so() {
        let plan = plan("ward", &options(Strategy::Unconstrained, false));
        let stage = Stage::prepare(&plan).unwrap();
        let error = remap(&plan, &stage, None, &mut |_| {}, &|| true).unwrap_err();
        assert!(matches!(error, RemapError::Interrupted { done: 0, total: 20 }), "{error}");
    }
}
