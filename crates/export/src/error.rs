//! What can go wrong with an export.

use lookmatch_remap::RemapError;

/// Why there is no export.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The request makes no sense for this probe.
    #[error("{0}")]
    Request(String),
    /// The probe does not say what is asked.
    #[error(transparent)]
    Remap(#[from] RemapError),
}

impl ExportError {
    /// True where another request would succeed.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Request(_) => true,
            Self::Remap(error) => error.is_usage(),
        }
    }
}

impl From<lookmatch_materials::MaterialError> for ExportError {
    fn from(error: lookmatch_materials::MaterialError) -> Self {
        Self::Remap(error.into())
    }
}
