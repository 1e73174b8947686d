//! What can go wrong between a plan and a probe.

use std::path::PathBuf;

use lookmatch_imaging::ImageError;
use lookmatch_materials::{Material, MaterialError};
use lookmatch_rendering::SceneError;
use lookmatch_search::{LatticeError, SearchError};
use thiserror::Error;

/// A remap, an application or a validation that cannot be done; the message says what would be accepted.
#[derive(Debug, Error)]
pub enum RemapError {
    /// A material or parameter that does not exist or is out of range.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// A scene that cannot be rendered.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A picture that cannot be compared, read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A lattice that makes no sense.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
    /// The search failed.
    #[error(transparent)]
    Search(SearchError),
    /// An option that does not fit the models.
    #[error("{0}")]
    Option(String),
    /// A picture that another renderer did not deliver.
    #[error("cannot render: {0}")]
    Render(String),
    /// A probe file that cannot be read.
    #[error("cannot read probe '{}': {reason}", path.display())]
    Probe {
        /// The file.
        path: PathBuf,
        /// What is wrong and what would be accepted.
        reason: String,
    },
    /// A file that cannot be written.
    #[error("cannot write '{}': {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A value outside of what the probe tabulates.
    #[error(
        "{name} = {value} lies outside the probe's range [{min}, {max}]; --clamp moves it to the nearest end"
    )]
    OutsideProbe {
        /// The source parameter.
        name: String,
        /// The value asked for.
        value: f64,
        /// First tabulated level.
        min: f64,
        /// Last tabulated level.
        max: f64,
    },
    /// The user stopped the work; what was done is kept.
    #[error("interrupted after {done} of {total} source points; the same command continues from there")]
    Interrupted {
        /// Source points that are done.
        done: usize,
        /// All source points.
        total: usize,
    },
    /// The user stopped work that leaves nothing behind.
    #[error("interrupted")]
    Stopped,
}

impl RemapError {
    /// Refuses a material of another renderer: our own would show it black.
    pub(crate) fn check_ours(material: &Material) -> Result<(), Self> {
        let model = material.model();
        match model.renderer {
            None => Ok(()),
            Some(renderer) => Err(Self::Option(format!("only {renderer} can render {}", model.name))),
        }
    }

    /// True where the request itself is wrong, as opposed to its execution.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Material(error) => error.is_usage(),
            other => matches!(other, Self::Option(_) | Self::Lattice(_) | Self::OutsideProbe { .. }),
        }
    }
}
