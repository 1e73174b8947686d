//! The database as a run sees it: pictures are found or kept, and what goes wrong is told, but stops nobody.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lookmatch_renderers::Picture;
use rusqlite::{Connection, TransactionBehavior, params};

use crate::entry::{Entry, NOW, key};
use crate::renewal::Open;
use crate::{DatabaseError, Description, SceneIdentity};

/// Is told in one line what is wrong with the database or a picture in it, from any thread.
pub type Warn = Arc<dyn Fn(&str) + Send + Sync>;

/// Pictures in a file, shared between threads and programs.
///
/// Each picture is stored in a transaction of its own, with a checksum. A damaged one is told, removed, and as good as missing; a
/// damaged file is set aside, and a new one begun with what is intact. A database that cannot be used any longer, because the disk
/// is full or somebody else does not let go of it, is told once and then left alone.
pub struct Database {
    path: PathBuf,
    /// `None` once it is left alone.
    open: Mutex<Option<Open>>,
    warn: Warn,
}

impl Database {
    /// Opens a file, or makes it and its folder.
    ///
    /// # Errors
    /// Where the folder or the file cannot be used, or was written by a newer program.
    pub fn open(path: &Path, warn: Warn) -> Result<Self, DatabaseError> {
        let (open, renewed) = Open::new(path)?;
        renewed.iter().for_each(|renewed| warn(&renewed.to_string()));
        Ok(Self { path: path.to_owned(), open: Mutex::new(Some(open)), warn })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A picture that was rendered before; it counts as used now.
    pub fn find(&self, description: &Description) -> Option<Picture> {
        let key = key(&description.text());
        let found = self.attempt(|connection| match Entry::find(connection, key.as_bytes()) {
            // A column that holds something else, or no picture.
            Err(error) if error.sqlite_error_code().is_none() => Ok(Some(Err(error.to_string()))),
            found => Ok(found?.map(Ok)),
        })??;
        let intact = found.and_then(|entry| match entry.fault() {
            Some(fault) => Err(fault.to_owned()),
            None => Ok((entry.id, entry.picture()?)),
        });
        match intact {
            Ok((id, picture)) => {
                let sql = format!("UPDATE renders SET last_used = {NOW} WHERE id = ?1");
                self.attempt(|connection| connection.prepare_cached(&sql)?.execute([id]));
                Some(picture)
            }
            Err(fault) => {
                (self.warn)(&format!(
                    "render database '{}': a damaged picture is rendered again ({}): {fault}",
                    self.path.display(),
                    description.title()
                ));
                let sql = "DELETE FROM renders WHERE key = ?1";
                self.attempt(|connection| connection.execute(sql, [key.as_bytes()]));
                None
            }
        }
    }

    /// Keeps a picture, unless it is there already.
    pub fn keep(&self, scene: &SceneIdentity, description: &Description, picture: &Picture) {
        let entry = match Entry::new(description.text(), picture) {
            Ok(entry) => entry,
            Err(reason) => return (self.warn)(&format!("a picture is not kept: {reason}")),
        };
        self.attempt(|connection| {
            // A transaction that begins with reading could find itself unable to write.
            let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
            let sql = "INSERT INTO scenes VALUES (?1, ?2, ?3) ON CONFLICT DO NOTHING";
            let values = params![scene.hash, scene.name, scene.content];
            transaction.prepare_cached(sql)?.execute(values)?;
            entry.store(&transaction)?;
            transaction.commit()
        });
    }

    /// Does something with the connection.
    pub(crate) fn run<T>(
        &self,
        work: impl FnOnce(&mut Connection) -> rusqlite::Result<T>,
    ) -> Option<Result<T, DatabaseError>> {
        self.lock().as_mut().map(|open| open.run(work))
    }

    /// [`Database::run`]; what goes wrong is told.
    fn attempt<T>(&self, work: impl FnOnce(&mut Connection) -> rusqlite::Result<T>) -> Option<T> {
        match self.run(work)? {
            Ok(value) => Some(value),
            Err(error @ DatabaseError::Renewed { .. }) => {
                (self.warn)(&error.to_string());
                None
            }
            Err(error) => {
                // Of several threads, one tells it.
                if self.lock().take().is_some() {
                    (self.warn)(&format!("pictures are not kept: {error}"));
                }
                None
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Open>> {
        // A panic elsewhere leaves at worst a transaction behind, which SQLite takes back.
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
