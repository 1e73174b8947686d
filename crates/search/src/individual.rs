//! One member of a genetic population, which unlike a [`Point`] may lie outside the bounds.

use std::cmp::Ordering;

use crate::{Bounds, Point, operators};

/// One candidate: whole-numbered genes, perhaps outside the bounds.
#[derive(Clone, Debug)]
pub struct Individual {
    /// Indices of levels, as many as there are axes.
    pub genes: Vec<f64>,
    /// Not read where `violation` is above 0.
    pub fitness: f64,
    /// Sum of the bound violations in lattice steps; 0 for feasible individuals.
    pub violation: f64,
}

impl Individual {
    /// Fitness and violation, as [`operators::beats`] compares them.
    pub fn score(&self) -> (f64, f64) {
        (self.fitness, self.violation)
    }

    /// Best first, by Deb's rules, then by genes.
    pub fn order(&self, other: &Individual) -> Ordering {
        let genes = || self.genes.partial_cmp(&other.genes).unwrap_or(Ordering::Equal);
        if operators::beats(self.score(), other.score()) {
            Ordering::Less
        } else if operators::beats(other.score(), self.score()) {
            Ordering::Greater
        } else {
            genes()
        }
    }
}

/// The genes of a point.
pub fn genes(point: &Point) -> Vec<f64> {
    point.iter().map(|&i| f64::from(i)).collect()
}

/// The point of whole-numbered genes, unless some lie outside the bounds.
pub fn feasible_point(genes: &[f64], bounds: &Bounds) -> Option<Point> {
    (violation(genes, bounds) <= 0.0).then(|| genes.iter().map(|&gene| gene as u32).collect())
}

/// Sum over the genes of the distance to the nearest bound, 0 within.
pub fn violation(genes: &[f64], bounds: &Bounds) -> f64 {
    let sides = bounds.low.iter().zip(&bounds.high);
    let outside = genes
        .iter()
        .zip(sides)
        .map(|(&gene, (&low, &high))| (f64::from(low) - gene).max(gene - f64::from(high)).max(0.0));
    outside.sum()
}
