//! Discrete search over a lattice of target parameters.
//!
//! A [`Problem`] is a [`Lattice`], the [`Bounds`] within it and perhaps starting points; an [`Objective`]
//! gives the fitness of whole populations, so that renders can be batched; a [`Search`] finds the point of
//! lowest fitness. Ties go to the lexicographically smallest point, so that searches agree. The outcome
//! depends on problem, objective and seed only, never on threads or time.
//!
//! ```
//! use lookmatch_search::{Axis, Bounds, Lattice, ObjectiveFn, Point, Problem, by_name};
//!
//! let axes = vec![Axis::regular("x", 0.0, 1.0, 0.01)?, Axis::regular("y", 0.0, 1.0, 0.01)?];
//! let lattice = Lattice { axes };
//! let problem = Problem { lattice: &lattice, bounds: Bounds::full(&lattice), guesses: vec![], seed: 1 };
//! let mut bowl = ObjectiveFn(|p: &Point| {
//!     let v = lattice.values(p);
//!     (v[0] - 0.3).powi(2) + (v[1] - 0.7).powi(2)
//! });
//! let outcome = by_name("genetic")?.run(&problem, &mut bowl)?;
//! assert_eq!(lattice.values(&outcome.best), [0.3, 0.7]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axis;
mod cma_es;
mod error;
mod exhaustive;
mod genetic;
mod individual;
mod lattice;
mod memo;
pub mod operators;
mod polish;
mod problem;
mod registry;
mod sampling;
mod settings;
mod survey;
mod synthesis;

pub use axis::Axis;
pub use cma_es::CmaEs;
pub use error::{ObjectiveError, SearchError};
pub use exhaustive::Exhaustive;
pub use genetic::Genetic;
pub use lattice::{Bounds, Lattice, LatticeError, Point, Points};
pub use memo::Memo;
pub use problem::{Objective, ObjectiveFn, Outcome, Problem, Search};
pub use registry::{Entry, by_name, registry};
pub use settings::{Breeding, Duplicates, GeneticSettings, OutOfBounds, StallDivisor, Start, Tournament};
pub use survey::{Survey, spread};
pub use synthesis::{First, Synthesis};
