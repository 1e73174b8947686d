//! Synthesis: few evaluations, chosen by forecasts.
//!
//! For objectives that learn from what they evaluate ([`Objective::forecast`]), as pictures can be synthesised from others: a few
//! spread points, then, again and again, the point with the best forecast is evaluated, until no forecast is better than what
//! was found. So only evaluated points win, however good forecasts may look.
//!
//! Requirements: forecasts that get better near evaluated points.
//! Parameters: `start`, which points are evaluated where nothing is known yet; `gain`, the least relative improvement worth an
//! evaluation; `bound`, the relative error of a forecast above which evaluations take its place.
//! References: D. R. Jones, M. Schonlau and W. J. Welch, "Efficient global optimization of expensive black-box functions",
//! J. Global Optimization 13 (1998), without its reward for exploration; Guarnera et al. 2018, section 4, for the half rate.
//! Known defects: a second basin that all forecasts miss stays unseen. An objective without forecasts gets a lattice descent from
//! the best spread point.

use crate::polish::descend;
use crate::{
    Axis, Bounds, Exhaustive, Genetic, Memo, Objective, Outcome, Point, Problem, Search, SearchError, spread,
};

/// Points that are evaluated after forecasts, at most.
const ROUNDS: usize = 40;
/// Forecasts up to this number are all made; of more the best is searched.
const ALL: usize = 50_000;
/// Points that are evaluated at once, at most.
const BATCH: usize = 64;
/// Levels that span more than this ratio are spread by their logarithm.
const WIDE_RATIO: f64 = 12.0;

/// What is evaluated where nothing is known yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum First {
    /// A few points that fill the lattice evenly, and its corners.
    Spread,
    /// Every second level of every axis (Guarnera et al. 2018, section 4).
    HalfRate,
}

/// Evaluations chosen by forecasts.
#[derive(Clone, Debug, PartialEq)]
pub struct Synthesis {
    /// What is evaluated first.
    pub first: First,
    /// Least relative improvement that is worth an evaluation.
    pub gain: f64,
    /// Largest relative error of the forecast of what was found; with a larger one, its neighbours are evaluated as well.
    pub bound: f64,
}

impl Default for Synthesis {
    fn default() -> Synthesis {
        Synthesis { first: First::Spread, gain: 1e-3, bound: 0.05 }
    }
}

impl Synthesis {
    /// The sampling of the paper: forecasts from a half rate.
    pub fn half_rate() -> Synthesis {
        Synthesis { first: First::HalfRate, ..Synthesis::default() }
    }

    /// The points within bounds that are evaluated where nothing is known; of the axes that are `linear`, the ends.
    fn first(&self, problem: &Problem, linear: &[bool]) -> Vec<Point> {
        let bounds = &problem.bounds;
        match self.first {
            First::HalfRate => {
                let half: Vec<Point> = bounds.points().filter(|point| is_half(bounds, point)).collect();
                // Batches that are spread over the lattice themselves.
                let stride = half.len().div_ceil(BATCH);
                (0..stride).flat_map(|first| half.iter().skip(first).step_by(stride).cloned()).collect()
            }
            First::Spread => first_points(&problem.lattice.axes, bounds, linear),
        }
    }
}

impl Search for Synthesis {
    fn name(&self) -> &'static str {
        match self.first {
            First::Spread => "synthesis",
            First::HalfRate => "synthesis-half-rate",
        }
    }

    fn run(&self, problem: &Problem, objective: &mut dyn Objective) -> Result<Outcome, SearchError> {
        problem.check()?;
        let mut memo = Memo::new(problem.lattice, objective);
        let centre = problem.bounds.points().next().ok_or(SearchError::NothingEvaluated)?;
        if memo.forecast(std::slice::from_ref(&centre)).is_none() {
            let linear: Vec<bool> =
                (0..problem.lattice.axes.len()).map(|axis| memo.is_linear(axis)).collect();
            for batch in self.first(problem, &linear).chunks(BATCH) {
                memo.evaluate(batch)?;
            }
        }
        let mut best: Option<(f64, Point)> = None;
        let mut last_error = f64::INFINITY;
        for _ in 0..ROUNDS {
            let Some((forecast, point)) = foreseen(problem, &mut memo)? else { break };
            if best.as_ref().is_some_and(|(fitness, _)| forecast >= fitness - self.gain * fitness.abs()) {
                break;
            }
            let fitness = memo.evaluate(std::slice::from_ref(&point))?[0];
            if best.as_ref().is_none_or(|(least, best)| (fitness, &point) < (*least, best)) {
                last_error = (forecast - fitness).abs() / fitness.abs().max(f64::MIN_POSITIVE);
                best = Some((fitness, point));
            }
        }
        let known = || memo.best().map(|(_, point)| point.clone());
        let start = best.map(|(_, point)| point).or_else(known).unwrap_or(centre);
        // Forecasts that are not to be trusted make room for evaluations.
        let point =
            if last_error > self.bound { descend(&mut memo, &problem.bounds, &start, 1)? } else { start };
        let fitness = memo.evaluate(std::slice::from_ref(&point))?[0];
        Ok(Outcome { best: point, fitness, evaluations: memo.evaluations(), generations: 0 })
    }
}

/// The point within bounds with the best forecast, where an evaluated point has its fitness for a forecast; `None` where there
/// are none.
fn foreseen(problem: &Problem, memo: &mut Memo) -> Result<Option<(f64, Point)>, SearchError> {
    let bounds = &problem.bounds;
    let corner = bounds.low.clone();
    if memo.forecast(std::slice::from_ref(&corner)).is_none() {
        return Ok(None);
    }
    let mut forecasts = Forecasts(memo);
    let inner = Problem { guesses: problem.guesses.clone(), bounds: bounds.clone(), ..problem.clone() };
    let outcome = match bounds.len() {
        0..=ALL => Exhaustive::default().run(&inner, &mut forecasts)?,
        _ => Genetic::default().run(&inner, &mut forecasts)?,
    };
    Ok(Some((outcome.fitness, outcome.best)))
}

/// Forecasts as an objective of their own.
struct Forecasts<'a, 'b>(&'a mut Memo<'b>);

impl Objective for Forecasts<'_, '_> {
    fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, crate::ObjectiveError> {
        let forecasts = self.0.forecast(points).ok_or("forecasts ended")?;
        Ok(points
            .iter()
            .zip(forecasts)
            .map(|(point, forecast)| self.0.get(point).unwrap_or(forecast))
            .collect())
    }
}

/// Bounds at half the rate in each direction, the last levels included; switches keep both.
fn is_half(bounds: &Bounds, point: &Point) -> bool {
    (0..point.len()).all(|axis| {
        let (low, high) = (bounds.low[axis], bounds.high[axis]);
        high - low < 2 || (point[axis] - low).is_multiple_of(2) || point[axis] == high
    })
}

/// Evenly spread points and the corners of the axes with more than two levels, switches on; and each switch off once. Points
/// lie at both ends of the axes that are linear.
fn first_points(axes: &[Axis], bounds: &Bounds, linear: &[bool]) -> Vec<Point> {
    let levels = |axis: usize| bounds.high[axis] - bounds.low[axis] + 1;
    let wide: Vec<usize> = (0..axes.len()).filter(|axis| levels(*axis) > 2 && !linear[*axis]).collect();
    let mut cube = bounds.clone();
    (0..axes.len()).filter(|axis| !wide.contains(axis)).for_each(|axis| cube.low[axis] = cube.high[axis]);
    let count = 2 * (wide.len() + 1) * (wide.len() + 2);
    let mut points: Vec<Point> = Vec::new();
    for corner in 0..1u32 << wide.len().min(3) {
        let mut point = cube.high.clone();
        let low = wide.iter().enumerate().filter(|(k, _)| corner >> k & 1 == 0);
        low.for_each(|(_, axis)| point[*axis] = cube.low[*axis]);
        points.push(point);
    }
    points.extend((0..count as u32).map(|k| warped(axes, &cube, &spread(&cube, k))));
    let ends = |point: Point| {
        let end = |axis: usize| if linear[axis] { bounds.low[axis] } else { point[axis] };
        let low: Point = (0..axes.len()).map(end).collect();
        [low, point]
    };
    let mut points: Vec<Point> = points.into_iter().flat_map(ends).collect();
    for axis in (0..axes.len()).filter(|axis| levels(*axis) == 2) {
        let mut point = points[points.len() / 2].clone();
        point[axis] = bounds.low[axis];
        points.push(point);
    }
    let mut seen = std::collections::HashSet::new();
    points.retain(|point| seen.insert(point.clone()));
    points
}

/// Moves the indices of axes whose levels span a wide ratio, so that the levels' logarithms are spread evenly.
fn warped(axes: &[Axis], bounds: &Bounds, point: &Point) -> Point {
    let warp = |(k, axis): (usize, &Axis)| {
        let (low, high) = (bounds.low[k], bounds.high[k]);
        let (first, last) = (axis.value(low as usize), axis.value(high as usize));
        if first <= 0.0 || last / first < WIDE_RATIO || low == high {
            return point[k];
        }
        let share = f64::from(point[k] - low) / f64::from(high - low);
        (axis.nearest(first * (last / first).powf(share)) as u32).clamp(low, high)
    };
    axes.iter().enumerate().map(warp).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lattice;

    /// A valley whose forecast is wrong by as much as the distance to what is known.
    struct Learner {
        known: Vec<(Point, f64)>,
        evaluated: usize,
        has_forecast: bool,
    }

    fn height(point: &Point) -> f64 {
        let (x, y) = (f64::from(point[0]) - 33.0, f64::from(point[1]) - 12.0);
        1.0 + (0.02 * x * x + 0.03 * (y - 0.3 * x).powi(2)).sqrt()
    }

    impl Objective for Learner {
        fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, crate::ObjectiveError> {
            self.evaluated += points.len();
            self.known.extend(points.iter().map(|point| (point.clone(), height(point))));
            Ok(points.iter().map(height).collect())
        }

        fn forecast(&mut self, points: &[Point]) -> Option<Vec<f64>> {
            if !self.has_forecast || self.known.is_empty() {
                return None;
            }
            let forecast = |point: &Point| {
                let distance = |(known, _): &(Point, f64)| {
                    known
                        .iter()
                        .zip(point)
                        .map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2))
                        .sum::<f64>()
                        .sqrt()
                };
                let nearest = self.known.iter().map(distance).fold(f64::INFINITY, f64::min);
                height(point) + (f64::from(point[0]) / 5.0).sin() * (nearest / 10.0).min(1.0)
            };
            Some(points.iter().map(forecast).collect())
        }
    }

    fn lattice() -> Lattice {
        let axis = |name| Axis::regular(name, 0.0, 59.0, 1.0).expect("a sound axis");
        Lattice { axes: vec![axis("x"), axis("y")] }
    }

    #[test]
    fn few_evaluations_find_what_forecasts_promise() {
        let lattice = lattice();
        for has_forecast in [true, false] {
            let problem =
                Problem { lattice: &lattice, bounds: Bounds::full(&lattice), guesses: vec![], seed: 1 };
            let mut learner = Learner { known: Vec::new(), evaluated: 0, has_forecast };
            let outcome = Synthesis::default().run(&problem, &mut learner).expect("an outcome");
            assert!(outcome.fitness <= 1.1, "{outcome:?}");
            assert_eq!(outcome.evaluations, learner.evaluated);
            assert!(learner.evaluated < 100, "{}", learner.evaluated);
        }
    }

    #[test]
    fn only_points_within_bounds_win() {
        let lattice = lattice();
        let bounds = Bounds { low: vec![40, 20], high: vec![50, 30] };
        let problem = Problem { lattice: &lattice, bounds: bounds.clone(), guesses: vec![], seed: 1 };
        let mut learner = Learner { known: Vec::new(), evaluated: 0, has_forecast: true };
        let outcome = Synthesis::default().run(&problem, &mut learner).expect("an outcome");
        assert!(bounds.contains(&outcome.best), "{outcome:?}");
        let best = bounds.points().map(|point| height(&point)).fold(f64::INFINITY, f64::min);
        assert!(outcome.fitness <= 1.1 * best, "{outcome:?} {best}");
    }

    #[test]
    fn the_half_rate_keeps_ends_and_switches() {
        let axes = vec![
            Axis::listed("switch", vec![0.0, 1.0]).expect("a switch"),
            Axis::regular("x", 0.0, 5.0, 1.0).expect("a sound axis"),
        ];
        let lattice = Lattice { axes };
        let problem = Problem { lattice: &lattice, bounds: Bounds::full(&lattice), guesses: vec![], seed: 1 };
        let points = Synthesis::half_rate().first(&problem, &[false; 2]);
        let expected = [0, 1].map(|s| [0, 2, 4, 5].map(|x| vec![s, x])).concat();
        assert_eq!(points, expected);
        let switch = first_points(&lattice.axes, &Bounds::full(&lattice), &[false, true]);
        assert_eq!(switch, [vec![1, 0], vec![1, 5], vec![0, 5]]);
    }

    #[test]
    fn wide_ranges_are_spread_by_ratios() {
        let axes = vec![Axis::regular("alpha", 0.01, 0.7, 0.01).expect("a sound axis")];
        let points = first_points(&axes, &Bounds::full(&Lattice { axes: axes.clone() }), &[false]);
        let below = points.iter().filter(|point| axes[0].value(point[0] as usize) < 0.1).count();
        assert!(2 * below >= points.len() - 1, "{points:?}");
    }
}
