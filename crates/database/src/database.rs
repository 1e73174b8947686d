//! The database as a run sees it: pictures are found or kept, and what goes wrong is told, but stops nobody.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
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
/// damaged file is set aside, and a new one begun with what is intact. Where nothing can be written any longer, because the disk is
/// full or somebody else does not let go of the file, that is told once, and pictures are still found.
pub struct Database {
    path: PathBuf,
    open: Mutex<Open>,
    /// Whether reading, and whether writing, has failed for good.
    is_lost: [AtomicBool; 2],
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
        Ok(Self { path: path.to_owned(), open: Mutex::new(open), is_lost: Default::default(), warn })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A picture that was rendered before; it counts as used now.
    pub fn find(&self, description: &Description) -> Option<Picture> {
        let key = key(&description.text());
        let found = self.read(|connection| match Entry::find(connection, key.as_bytes()) {
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
                self.write(|connection| connection.prepare_cached(&sql)?.execute([id]));
                Some(picture)
            }
            Err(fault) => {
                (self.warn)(&format!(
                    "render database '{}': a damaged picture is rendered again ({}): {fault}",
                    self.path.display(),
                    description.title()
                ));
                let sql = "DELETE FROM renders WHERE key = ?1";
                self.write(|connection| connection.execute(sql, [key.as_bytes()]));
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
        self.write(|connection| {
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
    ) -> Result<T, DatabaseError> {
        self.lock().run(work)
    }

    /// [`Database::run`] for what changes nothing.
    fn read<T>(&self, work: impl FnOnce(&mut Connection) -> rusqlite::Result<T>) -> Option<T> {
        self.attempt(&self.is_lost[0], "pictures are not found", work)
    }

    /// [`Database::run`] for what changes the file.
    fn write<T>(&self, work: impl FnOnce(&mut Connection) -> rusqlite::Result<T>) {
        self.attempt(&self.is_lost[1], "pictures are not kept", work);
    }

    /// What goes wrong is told; where it will not get better, once, and nothing is tried again.
    fn attempt<T>(
        &self,
        is_lost: &AtomicBool,
        loss: &str,
        work: impl FnOnce(&mut Connection) -> rusqlite::Result<T>,
    ) -> Option<T> {
        let mut open = self.lock();
        // Who had the lock before may have waited in vain for other programs.
        if is_lost.load(Ordering::Relaxed) {
            return None;
        }
        let error = match open.run(work) {
            Ok(value) => return Some(value),
            Err(error) => error,
        };
        match error {
            DatabaseError::Renewed { .. } => (self.warn)(&error.to_string()),
            _ => {
                is_lost.store(true, Ordering::Relaxed);
                (self.warn)(&format!("{loss}: {error}"));
            }
        }
        None
    }

    fn lock(&self) -> MutexGuard<'_, Open> {
        // A panic elsewhere leaves at worst a transaction behind, which SQLite takes back.
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookmatch_imaging::Image;
    use serde_json::json;

    #[test]
    fn a_full_disk_is_told_once_and_spoils_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("renders.sqlite");
        let told = Arc::new(Mutex::new(Vec::new()));
        let listener = told.clone();
        let warn: Warn = Arc::new(move |text| listener.lock().unwrap().push(text.to_owned()));
        let scene = SceneIdentity::new("s", json!({}), &[]);
        let described = |seed: u32| -> Description {
            serde_json::from_value(json!({
                "renderer": "r", "version": "1", "worker": "w", "scene": scene.hash, "light": "point", "size": 32,
                "model": "m", "parameters": {}, "samples": 1, "seed": seed,
            }))
            .unwrap()
        };
        let image = Image::from_fn(32, 32, |x, y| [(x as f32).sin(), (y as f32).cos(), (x * y) as f32]);
        let picture = Picture { image, samples: 1, cpu_s: 0.0, wall_s: 0.0, noise: None };
        let database = Database::open(&path, warn.clone()).unwrap();
        database.run(|connection| connection.pragma_update(None, "max_page_count", 40)).unwrap();
        (0..100).for_each(|seed| database.keep(&scene, &described(seed), &picture));
        let messages = std::mem::take(&mut *told.lock().unwrap());
        assert!(messages.len() == 1 && messages[0].contains("full"), "{messages:?}");
        assert_eq!(database.find(&described(0)).as_ref(), Some(&picture), "it is still read");
        drop(database);
        let database = Database::open(&path, warn).unwrap();
        let verified = database.verify(&|_, _| ()).unwrap();
        assert!(verified.pictures > 3 && verified.damaged.is_empty() && verified.renewed.is_none());
        assert_eq!(database.find(&described(0)), Some(picture));
        assert!(told.lock().unwrap().is_empty());
    }
}
