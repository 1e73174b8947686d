//! What is searched, by what, with what result: the interfaces every search method shares.

use crate::{Axis, Bounds, Lattice, ObjectiveError, Point, SearchError};

/// What is minimised.
pub trait Objective {
    /// Fitness of each point, lower is better, finite, in the order of `points`. Whole populations come at
    /// once, so that renders can be batched and run in parallel; within one run no point comes twice. The
    /// same point must always have the same fitness.
    ///
    /// # Errors
    /// Whatever keeps a point from being evaluated; the search stops and hands it on.
    fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, ObjectiveError>;

    /// What the fitness of points is likely to be, in their order, at no cost: for objectives that learn from what they
    /// evaluated. `None` where nothing is known yet, and by default.
    fn forecast(&mut self, points: &[Point]) -> Option<Vec<f64>> {
        let _ = points;
        None
    }

    /// True where forecasts along an axis follow from what is evaluated at its two ends; never by default.
    fn is_linear(&self, axis: usize) -> bool {
        let _ = axis;
        false
    }
}

/// An [`Objective`] from a plain function of one point that cannot fail.
pub struct ObjectiveFn<F>(
    /// The function: a point's indices to its fitness.
    pub F,
);

impl<F: FnMut(&Point) -> f64> Objective for ObjectiveFn<F> {
    fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
        Ok(points.iter().map(&mut self.0).collect())
    }
}

/// One search to run.
#[derive(Clone, Debug)]
pub struct Problem<'a> {
    /// The lattice.
    pub lattice: &'a Lattice,
    /// The part of it that may be used.
    pub bounds: Bounds,
    /// Starting points, for example the results of neighbouring source parameters; those outside the bounds
    /// are moved to the nearest point within.
    pub guesses: Vec<Point>,
    /// Seed of all random draws: equal seeds give equal outcomes.
    pub seed: u64,
}

impl Problem<'_> {
    /// Whether axes, bounds and guesses fit together.
    ///
    /// # Errors
    /// [`SearchError::Lattice`], [`SearchError::Dimension`] or [`SearchError::Bounds`].
    pub fn check(&self) -> Result<(), SearchError> {
        let axes = &self.lattice.axes;
        same_axes("bounds", axes, &self.bounds.low)?;
        same_axes("bounds", axes, &self.bounds.high)?;
        for guess in &self.guesses {
            same_axes("guesses", axes, guess)?;
        }
        for (k, axis) in axes.iter().enumerate() {
            axis.check()?;
            let (low, high) = (self.bounds.low[k], self.bounds.high[k]);
            if low > high || high as usize >= axis.len() {
                return Err(SearchError::Bounds { axis: axis.name.clone(), low, high, levels: axis.len() });
            }
        }
        Ok(())
    }
}

fn same_axes(what: &'static str, axes: &[Axis], indices: &[u32]) -> Result<(), SearchError> {
    if axes.len() == indices.len() {
        return Ok(());
    }
    Err(SearchError::Dimension { what, expected: axes.len(), found: indices.len() })
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The best point evaluated; at a tie the lexicographically smallest.
    pub best: Point,
    /// Its fitness.
    pub fitness: f64,
    /// Number of distinct points evaluated.
    pub evaluations: usize,
    /// Generations bred after the initial population; 0 for searches without generations.
    pub generations: usize,
}

/// A search method.
pub trait Search: Send + Sync {
    /// The name under which the registry lists it.
    fn name(&self) -> &'static str;

    /// Searches for the point of lowest fitness within the problem's bounds.
    ///
    /// # Errors
    /// [`SearchError`] if the problem or the settings are unsound, or the objective fails or returns a value
    /// that is not finite.
    fn run(&self, problem: &Problem, objective: &mut dyn Objective) -> Result<Outcome, SearchError>;
}
