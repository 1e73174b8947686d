//! Errors of a search.

use crate::{LatticeError, Point};

/// What an objective may fail with.
pub type ObjectiveError = Box<dyn std::error::Error + Send + Sync>;

/// Why a search cannot start or finish.
#[derive(Debug, thiserror::Error)]
pub enum SearchError {
    /// No search has this name.
    #[error("no search named {name:?}; did you mean {nearest:?}?")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The valid name most like it.
        nearest: &'static str,
    },
    /// An axis of the lattice is unusable.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
    /// Bounds or a starting point have another number of axes than the lattice.
    #[error("{what} have {found} axes, the lattice has {expected}")]
    Dimension {
        /// "bounds" or "guesses".
        what: &'static str,
        /// Axes of the lattice.
        expected: usize,
        /// Axes found.
        found: usize,
    },
    /// The bounds of an axis are crossed or pass its end.
    #[error("axis {axis}: bounds {low}..={high} must lie in order within 0..{levels}")]
    Bounds {
        /// Name of the axis.
        axis: String,
        /// Lower bound.
        low: u32,
        /// Upper bound.
        high: u32,
        /// Number of levels.
        levels: usize,
    },
    /// A setting of the genetic algorithm is out of its range.
    #[error("setting {setting} must be {allowed}")]
    Setting {
        /// Name of the field.
        setting: &'static str,
        /// The allowed range in words.
        allowed: &'static str,
    },
    /// The objective gave NaN or an infinity.
    #[error("fitness is {fitness} at point {point:?} ({parameters}); it must be finite")]
    NotFinite {
        /// The value.
        fitness: f64,
        /// The point.
        point: Point,
        /// The point in words.
        parameters: String,
    },
    /// The objective gave another number of values than points.
    #[error("the objective returned {found} values for {expected} points")]
    ResultCount {
        /// Points given.
        expected: usize,
        /// Values returned.
        found: usize,
    },
    /// The search ended without any point evaluated.
    #[error("no point was evaluated")]
    NothingEvaluated,
    /// The objective failed.
    #[error("a point could not be evaluated")]
    Objective(#[from] ObjectiveError),
}
