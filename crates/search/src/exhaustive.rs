//! Exhaustive search: evaluates every point within the bounds.
//!
//! Requirements: a lattice small enough to enumerate; memory grows with one batch, not with the lattice.
//! Parameters: `batch`, points handed to the objective at once (256).
//! Reference: none needed; this is the ground truth for the other searches.
//! Known defects: the cost is the product of the level counts.

use crate::{Objective, Outcome, Point, Problem, Search, SearchError, memo::Memo};

/// Evaluates every point within bounds and keeps the best; starting guesses and seed have no effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exhaustive {
    /// Points handed to the objective at once, 1 or more (0 is read as 1).
    pub batch: usize,
}

impl Default for Exhaustive {
    fn default() -> Exhaustive {
        Exhaustive { batch: 256 }
    }
}

impl Search for Exhaustive {
    fn name(&self) -> &'static str {
        "exhaustive"
    }

    fn run(&self, problem: &Problem, objective: &mut dyn Objective) -> Result<Outcome, SearchError> {
        problem.check()?;
        let mut best: Option<(f64, Point)> = None;
        let mut evaluations = 0;
        let mut points = problem.bounds.points().peekable();
        while points.peek().is_some() {
            let batch: Vec<Point> = points.by_ref().take(self.batch.max(1)).collect();
            // A memo per batch checks the values; one for all would hold the whole lattice in memory for
            // nothing.
            let mut memo = Memo::new(problem.lattice, objective);
            memo.evaluate(&batch)?;
            evaluations += memo.evaluations();
            best = lower(best, memo.best());
        }
        let (fitness, best) = best.ok_or(SearchError::NothingEvaluated)?;
        Ok(Outcome { best, fitness, evaluations, generations: 0 })
    }
}

/// The better of both; the first at a tie, which comes from an earlier, lexicographically smaller batch.
fn lower(best: Option<(f64, Point)>, new: Option<(f64, &Point)>) -> Option<(f64, Point)> {
    match (best, new) {
        (Some(best), Some((fitness, _))) if best.0 <= fitness => Some(best),
        (best, None) => best,
        (_, Some((fitness, point))) => Some((fitness, point.clone())),
    }
}
