//! The memo: no point is evaluated twice within a run, and the best point so far is known.

use std::collections::{HashMap, HashSet};

use crate::{Lattice, Objective, Point, SearchError};

/// An objective with a memory. Its cost, a render or more per point, is the number of *distinct* points.
pub struct Memo<'a> {
    lattice: &'a Lattice,
    objective: &'a mut dyn Objective,
    known: HashMap<Point, f64>,
    best: Option<(f64, Point)>,
}

impl<'a> Memo<'a> {
    /// An empty memo before `objective`; `lattice` only serves messages.
    pub fn new(lattice: &'a Lattice, objective: &'a mut dyn Objective) -> Memo<'a> {
        Memo { lattice, objective, known: HashMap::new(), best: None }
    }

    /// Fitness of each point in the order given. Points not seen before go to the objective in one batch, in
    /// order of first appearance.
    ///
    /// # Errors
    /// [`SearchError::Objective`] if the objective fails, [`SearchError::ResultCount`] if it returns too few
    /// or too many values, [`SearchError::NotFinite`] naming the first point whose fitness is NaN or
    /// infinite.
    pub fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, SearchError> {
        let fresh = self.unseen(points);
        if !fresh.is_empty() {
            let values = self.objective.evaluate(&fresh)?;
            self.remember(fresh, values)?;
        }
        Ok(points.iter().map(|point| self.known[point]).collect())
    }

    /// [`Objective::forecast`].
    pub fn forecast(&mut self, points: &[Point]) -> Option<Vec<f64>> {
        self.objective.forecast(points)
    }

    /// [`Objective::is_linear`].
    pub fn is_linear(&self, axis: usize) -> bool {
        self.objective.is_linear(axis)
    }

    /// Fitness of a point that has been evaluated.
    pub fn get(&self, point: &Point) -> Option<f64> {
        self.known.get(point).copied()
    }

    /// Number of distinct points evaluated.
    pub fn evaluations(&self) -> usize {
        self.known.len()
    }

    /// Lowest fitness so far and its point, the lexicographically smallest one of a tie.
    pub fn best(&self) -> Option<(f64, &Point)> {
        self.best.as_ref().map(|(fitness, point)| (*fitness, point))
    }

    /// The evaluated points with their fitness, best first.
    pub fn ranking(&self) -> Vec<(f64, Point)> {
        let mut all: Vec<(f64, Point)> = self.known.iter().map(|(p, &f)| (f, p.clone())).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
        all
    }

    fn unseen(&self, points: &[Point]) -> Vec<Point> {
        let mut fresh = HashSet::new();
        let new = points.iter().filter(|p| !self.known.contains_key(*p) && fresh.insert(*p));
        new.cloned().collect()
    }

    fn remember(&mut self, points: Vec<Point>, values: Vec<f64>) -> Result<(), SearchError> {
        if values.len() != points.len() {
            return Err(SearchError::ResultCount { expected: points.len(), found: values.len() });
        }
        for (point, value) in points.into_iter().zip(values) {
            if !value.is_finite() {
                return Err(SearchError::NotFinite {
                    fitness: value,
                    parameters: self.lattice.describe(&point),
                    point,
                });
            }
            // Adding 0 turns -0 into +0, which would otherwise rank as different.
            self.insert(point, value + 0.0);
        }
        Ok(())
    }

    fn insert(&mut self, point: Point, value: f64) {
        let better = match &self.best {
            None => true,
            Some((fitness, best)) => value < *fitness || (value == *fitness && point < *best),
        };
        if better {
            self.best = Some((value, point.clone()));
        }
        self.known.insert(point, value);
    }
}
