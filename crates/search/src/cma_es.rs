//! CMA-ES: the covariance matrix adaptation evolution strategy, on a lattice.
//!
//! Candidates are drawn from a normal distribution in the space of indices, which adapts to the fitness; each is evaluated at the
//! nearest lattice point within bounds. A lattice descent follows, because the distribution may shrink below a step.
//!
//! Requirements: axes of many levels; a switch of two is a step function to it, and is tried both ways.
//! Parameters: `runs` that start at different places; `evaluations`, drawn candidates per run and wide axis.
//! References: N. Hansen, "The CMA evolution strategy: a tutorial" (2016); the implementation is the crate `cmaes`.
//! Known defects: one candidate is evaluated after the other, so that renders cannot be batched.

use cmaes::{CMAESOptions, DVector, objective_function::ObjectiveFunction};

use crate::polish::descend;
use crate::{Bounds, Memo, Objective, Outcome, Point, Problem, Search, SearchError, spread};

/// Restarted CMA-ES with a lattice descent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CmaEs {
    /// Runs; the first starts at the first guess or in the middle.
    pub runs: usize,
    /// Candidates drawn per run for each axis of more than two levels.
    pub evaluations: usize,
}

impl Default for CmaEs {
    fn default() -> CmaEs {
        CmaEs { runs: 2, evaluations: 60 }
    }
}

impl Search for CmaEs {
    fn name(&self) -> &'static str {
        "cma-es"
    }

    fn run(&self, problem: &Problem, objective: &mut dyn Objective) -> Result<Outcome, SearchError> {
        problem.check()?;
        let mut memo = Memo::new(problem.lattice, objective);
        for switches in switches(&problem.bounds) {
            for run in 0..self.runs.max(1) {
                self.run_once(problem, &mut memo, &switches, run as u32)?;
            }
        }
        let best = memo.best().map(|(_, best)| best.clone()).ok_or(SearchError::NothingEvaluated)?;
        descend(&mut memo, &problem.bounds, &best, 2)?;
        let (fitness, best) = memo.best().ok_or(SearchError::NothingEvaluated)?;
        Ok(Outcome { best: best.clone(), fitness, evaluations: memo.evaluations(), generations: 0 })
    }
}

impl CmaEs {
    /// One run over the axes that are not switches.
    fn run_once(
        &self,
        problem: &Problem,
        memo: &mut Memo,
        switches: &Bounds,
        run: u32,
    ) -> Result<(), SearchError> {
        let axes: Vec<usize> =
            (0..switches.low.len()).filter(|k| switches.high[*k] > switches.low[*k]).collect();
        let middle = switches.clamp(&match problem.guesses.get(run as usize) {
            Some(guess) => guess.clone(),
            None => spread(switches, run),
        });
        memo.evaluate(std::slice::from_ref(&middle))?;
        if axes.is_empty() {
            return Ok(());
        }
        let side = |k: usize| f64::from(switches.high[k] - switches.low[k]);
        // All axes as long as each other.
        let share = |k: usize| (f64::from(middle[k]) - f64::from(switches.low[k])) / side(k);
        let start: Vec<f64> = axes.iter().map(|k| share(*k)).collect();
        let mut drawn = Drawn { memo, bounds: switches, middle: &middle, axes: &axes, failure: None };
        let options = CMAESOptions::new(start, 0.3)
            .seed(problem.seed.wrapping_add(u64::from(run)))
            .max_function_evals(self.evaluations * axes.len())
            .tol_x(1e-3);
        if let Ok(mut state) = options.build(&mut drawn) {
            state.run();
        }
        drawn.failure.map_or(Ok(()), Err)
    }
}

/// Candidates on their way to the lattice.
struct Drawn<'a, 'b> {
    memo: &'a mut Memo<'b>,
    bounds: &'a Bounds,
    middle: &'a Point,
    axes: &'a [usize],
    /// What keeps candidates from being evaluated; all that follow are skipped.
    failure: Option<SearchError>,
}

impl ObjectiveFunction for &mut Drawn<'_, '_> {
    fn evaluate(&mut self, candidate: &DVector<f64>) -> f64 {
        let mut point = self.middle.clone();
        let mut outside = 0.0;
        for (k, share) in self.axes.iter().zip(candidate) {
            let (low, high) = (self.bounds.low[*k], self.bounds.high[*k]);
            let inside = share.clamp(0.0, 1.0);
            outside += (share - inside).abs();
            point[*k] = low + (inside * f64::from(high - low)).round() as u32;
        }
        if self.failure.is_some() {
            return f64::MAX;
        }
        match self.memo.evaluate(&[point]) {
            // Beyond a bound it is worse than on it.
            Ok(values) => values[0] + outside * (1.0 + values[0].abs()),
            Err(error) => {
                self.failure = Some(error);
                f64::MAX
            }
        }
    }
}

/// The bounds with every combination of the two levels of their switches.
fn switches(bounds: &Bounds) -> Vec<Bounds> {
    let mut all = vec![bounds.clone()];
    for k in (0..bounds.low.len()).filter(|k| bounds.high[*k] - bounds.low[*k] == 1) {
        let at = |level: u32| {
            all.iter().cloned().map(move |mut part| {
                (part.low[k], part.high[k]) = (level, level);
                part
            })
        };
        all = at(bounds.low[k]).chain(at(bounds.high[k])).collect();
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Lattice, ObjectiveFn};

    #[test]
    fn a_curved_valley_behind_a_switch_is_followed_to_its_end() {
        let axis = |name, max| Axis::regular(name, 0.0, max, 1.0).expect("a sound axis");
        let lattice = Lattice { axes: vec![axis("switch", 1.0), axis("x", 84.0), axis("y", 69.0)] };
        let fitness = |p: &Point| {
            let (x, y) = (f64::from(p[1]) / 84.0, f64::from(p[2]) / 69.0);
            if p[0] == 0 { 3.0 } else { 20.0 * (y - x * x).powi(2) + (x - 0.8).powi(2) }
        };
        let problem = Problem { lattice: &lattice, bounds: Bounds::full(&lattice), guesses: vec![], seed: 7 };
        let best = problem.bounds.points().map(|p| fitness(&p)).fold(f64::INFINITY, f64::min);
        let outcome = CmaEs::default().run(&problem, &mut ObjectiveFn(fitness)).expect("an outcome");
        assert_eq!(outcome.fitness, best);
        assert!(outcome.evaluations < lattice.len() / 10, "{}", outcome.evaluations);
        let again = CmaEs::default().run(&problem, &mut ObjectiveFn(fitness)).expect("an outcome");
        assert_eq!(outcome, again);
    }

    #[test]
    fn a_failure_is_handed_on() {
        let lattice = Lattice { axes: vec![Axis::regular("x", 0.0, 9.0, 1.0).expect("a sound axis")] };
        let problem = Problem { lattice: &lattice, bounds: Bounds::full(&lattice), guesses: vec![], seed: 1 };
        let outcome = CmaEs::default().run(&problem, &mut ObjectiveFn(|_: &Point| f64::NAN));
        assert!(matches!(outcome, Err(SearchError::NotFinite { .. })), "{outcome:?}");
    }
}
