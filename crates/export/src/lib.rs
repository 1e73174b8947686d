//! Probes for other programs: a target's parameters as functions of its source's, in the language of a shader, a node graph, a
//! look-up table or a script.
//!
//! A [`Mapping`] says what `apply` does in formulas that every language has; it is made by asking `apply`, and measured against
//! it. A [`Format`] writes it down. Adding a format is a file in `formats/` and its line in [`formats()`].

mod carried;
mod derive;
mod error;
mod formats;
mod function;
mod mapping;
mod question;

pub use derive::Options;
pub use error::ExportError;
pub use formats::{Exported, File, Format, formats};
pub use function::{Argument, Function, Scale, Shape};
pub use mapping::{Factor, Formula, Input, Mapping, Output};
