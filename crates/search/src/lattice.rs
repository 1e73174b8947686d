//! The searched lattice: axes, points by index, and the box of indices that a search may use.

use serde::{Deserialize, Serialize};

use crate::Axis;

/// One lattice point: for each axis, in order, the index of its level, counted from 0.
pub type Point = Vec<u32>;

/// Why an axis or lattice cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LatticeError {
    /// The range of a regular axis is unusable.
    #[error(
        "axis {name}: no levels from {min} to {max} by {step}; give min <= max and a step > 0 that makes at most ten million levels"
    )]
    Range {
        /// Name of the axis.
        name: String,
        /// Lowest level asked for.
        min: f64,
        /// Highest level asked for.
        max: f64,
        /// Distance of levels asked for.
        step: f64,
    },
    /// The levels of an axis are empty, not finite or not strictly increasing.
    #[error("axis {name}: give at least one level, all finite and strictly increasing")]
    Levels {
        /// Name of the axis.
        name: String,
    },
}

/// The lattice spanned by some axes: every combination of their levels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// The axes, in the order in which points index them.
    pub axes: Vec<Axis>,
}

impl Lattice {
    /// Number of points, `usize::MAX` where there are more than that; 1 for no axes.
    pub fn len(&self) -> usize {
        self.axes.iter().fold(1, |product, axis| product.saturating_mul(axis.len()))
    }

    /// Whether there is no point, because some axis has no level.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The parameter values at `point`, one per axis; NaN where an index lies past its axis or is missing.
    pub fn values(&self, point: &Point) -> Vec<f64> {
        let index = |k: usize| point.get(k).map_or(usize::MAX, |&i| i as usize);
        let axes = self.axes.iter().enumerate();
        axes.map(|(k, axis)| axis.value(index(k))).collect()
    }

    /// The point whose levels are nearest to `values`, axis by axis; the first level where a value is
    /// missing.
    pub fn nearest(&self, values: &[f64]) -> Point {
        let value = |k: usize| values.get(k).copied().unwrap_or(f64::NAN);
        let axes = self.axes.iter().enumerate();
        axes.map(|(k, axis)| axis.nearest(value(k)) as u32).collect()
    }

    /// All points within `bounds` in lexicographic order (the last axis runs fastest).
    pub fn points(&self, bounds: &Bounds) -> Points {
        bounds.points()
    }

    /// `point` in words, `name = value` per axis, for messages.
    pub fn describe(&self, point: &Point) -> String {
        let values = self.values(point);
        let named = self.axes.iter().zip(values);
        let words: Vec<String> = named.map(|(axis, v)| format!("{} = {v}", axis.name)).collect();
        words.join(", ")
    }
}

/// The box of indices that a search may use: inclusive bounds per axis. A constrained strategy narrows it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bounds {
    /// Lowest index per axis.
    pub low: Vec<u32>,
    /// Highest index per axis, itself allowed.
    pub high: Vec<u32>,
}

impl Bounds {
    /// The whole of `lattice`.
    pub fn full(lattice: &Lattice) -> Bounds {
        let last = |axis: &Axis| axis.len().saturating_sub(1) as u32;
        Bounds { low: vec![0; lattice.axes.len()], high: lattice.axes.iter().map(last).collect() }
    }

    /// Whether `point` has one index per axis and all lie within.
    pub fn contains(&self, point: &Point) -> bool {
        let box_sides = self.low.iter().zip(&self.high);
        point.len() == self.low.len()
            && box_sides.zip(point).all(|((low, high), i)| (low..=high).contains(&i))
    }

    /// `point` moved to the nearest point within, axis by axis.
    pub fn clamp(&self, point: &Point) -> Point {
        let sides = self.low.iter().zip(&self.high);
        let moved = point.iter().zip(sides);
        moved.map(|(&i, (&low, &high))| i.min(high).max(low)).collect()
    }

    /// Number of points, `usize::MAX` where there are more; 0 if a low bound exceeds its high bound.
    pub fn len(&self) -> usize {
        self.low.iter().zip(&self.high).fold(1usize, |product, (&low, &high)| {
            product.saturating_mul((u64::from(high) + 1).saturating_sub(u64::from(low)) as usize)
        })
    }

    /// Whether no point lies within.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All points within, in lexicographic order (the last axis runs fastest).
    pub fn points(&self) -> Points {
        Points { next: (!self.is_empty()).then(|| self.low.clone()), bounds: self.clone() }
    }
}

/// Iterator over the points of a [`Bounds`] in lexicographic order.
#[derive(Clone, Debug)]
pub struct Points {
    bounds: Bounds,
    next: Option<Point>,
}

impl Iterator for Points {
    type Item = Point;

    fn next(&mut self) -> Option<Point> {
        let point = self.next.take()?;
        self.next = successor(&point, &self.bounds);
        Some(point)
    }
}

/// The point after `point`, counting like an odometer; `None` after the last.
fn successor(point: &Point, bounds: &Bounds) -> Option<Point> {
    let mut next = point.clone();
    for k in (0..next.len()).rev() {
        if next[k] < bounds.high[k] {
            next[k] += 1;
            return Some(next);
        }
        next[k] = bounds.low[k];
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice() -> Lattice {
        let switch = Axis::listed("specular", vec![0.0, 1.0]).expect("sound levels");
        let alpha = Axis::regular("alpha", 0.1, 0.4, 0.1).expect("a sound range");
        Lattice { axes: vec![switch, alpha] }
    }

    #[test]
    fn points_run_in_lexicographic_order() {
        let lattice = lattice();
        let points: Vec<Point> = lattice.points(&Bounds::full(&lattice)).collect();
        assert_eq!(points.len(), lattice.len());
        assert!(points.is_sorted());
        assert_eq!(lattice.values(&points[5]), [1.0, 0.2]);
        assert_eq!(lattice.describe(&points[5]), "specular = 1, alpha = 0.2");
        assert_eq!(lattice.nearest(&[0.9, 0.19]), points[5]);
    }

    #[test]
    fn narrowed_bounds() {
        let bounds = Bounds { low: vec![1, 2], high: vec![1, 3] };
        let points: Vec<Point> = bounds.points().collect();
        assert_eq!(points, [[1, 2], [1, 3]]);
        assert_eq!(bounds.len(), 2);
        assert!(!bounds.contains(&vec![1, 1]) && !bounds.contains(&vec![1]));
        assert_eq!(bounds.clamp(&vec![0, 9]), [1, 3]);
        let empty = Bounds { low: vec![1], high: vec![0] };
        assert_eq!((empty.len(), empty.points().count()), (0, 0));
    }

    #[test]
    fn counts_saturate() {
        let bounds = Bounds { low: vec![0; 9], high: vec![u32::MAX; 9] };
        assert_eq!(bounds.len(), usize::MAX);
    }
}
