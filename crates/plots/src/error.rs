//! What can go wrong with a picture of numbers.

use std::path::PathBuf;

use lookmatch_materials::MaterialError;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// A file of another kind.
    #[error("cannot draw '{}': a plot ends in .png or .svg", path.display())]
    Ending {
        /// The file.
        path: PathBuf,
    },
    /// Nothing to draw over.
    #[error("cannot draw the probe: its source is a single material")]
    NoAxis,
    /// The drawing failed.
    #[error("cannot draw '{}': {reason}", path.display())]
    Drawing {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The file cannot be written.
    #[error("cannot write '{}': {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// An axis that its model does not have.
    #[error(transparent)]
    Material(#[from] MaterialError),
}

impl PlotError {
    /// True where another request would succeed.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Ending { .. } | Self::NoAxis)
    }
}
