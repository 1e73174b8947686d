//! What can go wrong between a texture and the maps made of it.

use std::io;
use std::path::{Path, PathBuf};

use lookmatch_remap::RemapError;

/// A texture that cannot be read, mapped or written; the message says what would be accepted.
#[derive(Debug, thiserror::Error)]
pub enum TextureError {
    /// The operating system refused: no such file, no permission, disk full.
    #[error("cannot {action} '{}': {}", path.display(), explained(source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// `read`, `write`, `create`.
        action: &'static str,
        /// What the operating system said.
        source: io::Error,
    },
    /// A file that is truncated, damaged, or of a kind that is not supported.
    #[error("cannot read texture '{}': {reason}", path.display())]
    Undecodable {
        /// The file.
        path: PathBuf,
        /// What was found and what is accepted.
        reason: String,
    },
    /// A request that does not fit the probe, the files or their format.
    #[error("{0}")]
    Request(String),
    /// Texels that the probe cannot map.
    #[error("{0}")]
    Domain(String),
    /// A material or parameter that does not exist, is out of range or does not fit the probe.
    #[error(transparent)]
    Remap(#[from] RemapError),
    /// The user stopped the work.
    #[error("interrupted; nothing was written to '{}'", folder.display())]
    Interrupted {
        /// The folder that was to be filled.
        folder: PathBuf,
    },
}

impl TextureError {
    /// True where the request itself is wrong, as opposed to its execution.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Remap(error) => error.is_usage(),
            other => matches!(other, Self::Request(_)),
        }
    }

    /// True for a map that was given up because of another one.
    pub(crate) fn is_given_up(&self) -> bool {
        matches!(self, Self::Io { source, .. } if source.kind() == io::ErrorKind::Interrupted)
    }

    /// An end by the user; the folder is named by the one who knows it.
    pub(crate) fn interrupted() -> Self {
        Self::Interrupted { folder: PathBuf::new() }
    }

    pub(crate) fn undecodable(path: &Path, reason: impl ToString) -> Self {
        Self::Undecodable { path: path.into(), reason: reason.to_string() }
    }

    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { path: path.into(), action, source }
    }
}

/// The system's own words, and what to do about a full disk.
fn explained(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            format!("{error}; the disk is full, nothing was written")
        }
        _ => error.to_string(),
    }
}
