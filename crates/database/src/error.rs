//! What can go wrong with the database, in words for the person who sees it.

use std::io;
use std::path::PathBuf;

use rusqlite::ErrorCode;

/// Why a render database could not be used.
#[derive(Debug, thiserror::Error)]
pub enum DatabaseError {
    /// The operating system refused: no permission, no folder, disk full.
    #[error("render database '{}': {source}", path.display())]
    Io {
        /// The database, or the file beside it.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// SQLite refused: locked for too long, disk full, read-only.
    #[error("render database '{}': {source}", path.display())]
    Sqlite {
        /// The database.
        path: PathBuf,
        /// What SQLite said.
        source: rusqlite::Error,
    },
    /// The file was written by a newer program.
    #[error("render database '{}' has format {found}; this lookmatch reads format {known}", path.display())]
    Format {
        /// The database.
        path: PathBuf,
        /// The format that was found.
        found: i64,
        /// The format that is known.
        known: i64,
    },
    /// The file was damaged, and a new one is in its place.
    #[error(
        "render database '{}' was damaged ({reason}): {saved} intact pictures were saved into a new one; the old one is '{}'",
        path.display(), aside.display()
    )]
    Renewed {
        /// The database.
        path: PathBuf,
        /// Where the damaged one lies now.
        aside: PathBuf,
        /// What SQLite said.
        reason: String,
        /// Pictures that the new one has of the old one.
        saved: usize,
    },
    /// The file is damaged, and cannot be replaced while others use it.
    #[error(
        "render database '{}' is damaged ({reason}) and in use by another program; it is repaired when that has ended",
        path.display()
    )]
    Damaged {
        /// The database.
        path: PathBuf,
        /// What SQLite said.
        reason: String,
    },
}

/// True where SQLite found its file damaged, or none of its own.
pub(crate) fn is_damage(error: &rusqlite::Error) -> bool {
    let code = error.sqlite_error_code();
    matches!(code, Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase))
}
