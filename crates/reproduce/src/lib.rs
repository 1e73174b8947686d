//! The experiments of Guarnera *et al.* (2018), each as one command, and the report that sets their figures beside ours.
//!
//! An [`Experiment`] is run with a [`Setting`] and makes a [`Report`]: data without any layout, which [`page`] makes a file of
//! HTML of, and [`text`] a summary for terminals.

mod album;
mod experiment;
mod experiments;
mod methods;
mod nearest;
mod number;
mod page;
mod probes;
mod report;
mod tables;
mod text;
mod twins;
mod write;

pub use experiment::{Experiment, Setting, Watch};
pub use experiments::{by_name, experiments};
pub use page::page;
pub use report::{Bar, Cell, Comparison, Environment, Figure, Finding, Picture, Report, Row, Run, Table};
pub use text::text;
pub use write::{keep, kept, pictures, write};
