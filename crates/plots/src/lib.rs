//! Pictures of numbers: probes as in Figure 11 of Guarnera *et al.* (2018), and curves.

mod curves;
mod error;
mod probe;
mod sheet;
mod verdicts;

pub use curves::{Chart, Series, draw_charts};
pub use error::PlotError;
pub use probe::draw_probe;
