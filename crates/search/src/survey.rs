//! Survey: points spread evenly over the whole lattice, then a compass search from the best.
//!
//! For objectives whose every evaluation is dear and may be noisy: the surveyed points do not depend on the bounds or the seed, so
//! that many searches of one lattice share them, and the compass strides over what noise makes of single steps.
//!
//! Requirements: a fitness with one broad basin at the scale of the survey.
//! Parameters: `density`, points per pair of axes; `last_step`, levels of the compass' last step (1 where every point counts).
//! Reference: M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018); T. G. Kolda, R. M. Lewis and
//! V. Torczon, "Optimization by direct search", SIAM Review 45 (2003).
//! Known defects: misses basins narrower than the distance of the surveyed points.

use crate::{Bounds, Memo, Objective, Outcome, Point, Problem, Search, SearchError};

/// Evenly spread points, then the compass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Survey {
    /// Points per pair of axes: there are `density · (1 + axes · (axes + 1)/2)` of them.
    pub density: usize,
    /// Levels of the compass' last step, 1 or more.
    pub last_step: u32,
}

impl Default for Survey {
    fn default() -> Survey {
        Survey { density: 9, last_step: 1 }
    }
}

impl Search for Survey {
    fn name(&self) -> &'static str {
        "survey"
    }

    fn run(&self, problem: &Problem, objective: &mut dyn Objective) -> Result<Outcome, SearchError> {
        problem.check()?;
        let mut memo = Memo::new(problem.lattice, objective);
        let mut points: Vec<Point> = problem.guesses.iter().map(|g| problem.bounds.clamp(g)).collect();
        points.extend(self.spread(problem));
        memo.evaluate(&points)?;
        let widest = (0..problem.lattice.axes.len()).map(|axis| stride(problem, axis)).max().unwrap_or(0);
        let mut step = 1.0;
        while step * f64::from(widest) >= f64::from(self.last_step) {
            if !self.look_around(problem, &mut memo, step)? {
                step /= 2.0;
            }
        }
        let (fitness, best) = memo.best().ok_or(SearchError::NothingEvaluated)?;
        Ok(Outcome { best: best.clone(), fitness, evaluations: memo.evaluations(), generations: 0 })
    }
}

impl Survey {
    /// The surveyed points within bounds; at least one.
    fn spread(&self, problem: &Problem) -> Vec<Point> {
        let axes = problem.lattice.axes.len();
        let count = self.density * (1 + axes * (axes + 1) / 2);
        let whole = Bounds::full(problem.lattice);
        let mut points: Vec<Point> = (0..count as u32).map(|k| spread(&whole, k)).collect();
        points.retain(|point| problem.bounds.contains(point));
        // Narrow bounds may hold none of them.
        let narrow = (0..count as u32).map(|k| spread(&problem.bounds, k));
        points.extend(narrow.take(if points.len() < axes + 1 { 2 * axes + 1 } else { 0 }));
        points
    }

    /// Looks one stride along each axis from the best; true where something better was there.
    fn look_around(&self, problem: &Problem, memo: &mut Memo, step: f64) -> Result<bool, SearchError> {
        let Some((fitness, best)) = memo.best().map(|(fitness, best)| (fitness, best.clone())) else {
            return Ok(false);
        };
        let mut around = Vec::new();
        for axis in 0..best.len() {
            let stride = ((step * f64::from(stride(problem, axis))) as u32).max(self.last_step);
            for index in [best[axis].saturating_sub(stride), best[axis].saturating_add(stride)] {
                let mut point = best.clone();
                point[axis] = index;
                around.push(problem.bounds.clamp(&point));
            }
        }
        memo.evaluate(&around)?;
        Ok(memo.best().is_some_and(|(found, _)| found < fitness))
    }
}

/// Levels of the compass' first step along an axis: about half the distance of surveyed points.
fn stride(problem: &Problem, axis: usize) -> u32 {
    let levels = problem.bounds.high[axis] - problem.bounds.low[axis] + 1;
    (levels / 8).max(1)
}

/// The `k`-th of points that fill a box evenly, whatever its dimension: a Kronecker sequence of the powers of the root of
/// `x^(d+1) = x + 1` (Roberts 2018).
pub fn spread(bounds: &Bounds, k: u32) -> Point {
    let axes = bounds.low.len();
    let mut root = 2.0f64;
    (0..30).for_each(|_| root = (1.0 + root).powf(1.0 / (axes as f64 + 1.0)));
    let index = |axis: usize| {
        let share = (0.5 + f64::from(k) * root.powi(-(axis as i32 + 1))).fract();
        let (low, high) = (bounds.low[axis], bounds.high[axis]);
        low + (share * (f64::from(high) - f64::from(low) + 1.0)) as u32
    };
    (0..axes).map(index).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Lattice, ObjectiveFn};

    #[test]
    fn a_broad_basin_takes_few_evaluations_which_are_shared() {
        let axis = |name: &str| Axis::regular(name, 0.0, 150.0, 1.0).unwrap();
        let lattice = Lattice { axes: vec![axis("a"), axis("b")] };
        let mut asked = std::collections::HashSet::new();
        let mut evaluations = 0;
        for k in 0..20u32 {
            let centre = [20.0 + 5.0 * f64::from(k), 130.0 - 5.0 * f64::from(k)];
            let fitness =
                |p: &Point| (0..2).map(|i| (f64::from(p[i]) - centre[i]).powi(2)).sum::<f64>().sqrt();
            let mut objective = ObjectiveFn(|p: &Point| {
                asked.insert(p.clone());
                fitness(p)
            });
            let problem = Problem {
                lattice: &lattice,
                bounds: Bounds::full(&lattice),
                guesses: vec![],
                seed: u64::from(k),
            };
            let outcome = Survey::default().run(&problem, &mut objective).unwrap();
            assert_eq!(outcome.fitness, 0.0, "{:?}", outcome.best);
            evaluations += outcome.evaluations;
        }
        assert!(evaluations < 20 * 90, "{evaluations}");
        assert!(asked.len() < evaluations * 3 / 5, "{} of {evaluations}", asked.len());
    }
}
