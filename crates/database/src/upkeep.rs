//! What people do with the database: list what is in it, verify it, make it smaller.

use rusqlite::ffi::{self, SQLITE_CORRUPT};
use rusqlite::{Connection, TransactionBehavior};
use serde::Serialize;

use crate::entry::Entry;
use crate::{Database, DatabaseError};

/// Pictures that are removed, and pages that are given back, before others may write.
const BATCH: usize = 1000;
const PAGES: usize = 10_000;

/// What is in a database.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Contents {
    /// Pictures of one renderer and one scene each, the largest first.
    pub groups: Vec<Group>,
    /// All pictures.
    pub pictures: u64,
    /// Bytes of the database, without its log of what was written last.
    pub bytes: u64,
}

/// Pictures of one version of a renderer, of one scene and size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// The renderer's own name.
    pub renderer: String,
    /// Its version.
    pub version: String,
    /// Short for its command and its files: other workers may say the same of themselves.
    pub worker: String,
    /// What the scene was called first.
    pub scene: String,
    /// The lights that are on.
    pub light: String,
    /// Side of the pictures in pixels.
    pub size: u64,
    /// How many pictures.
    pub pictures: u64,
    /// Their bytes.
    pub bytes: u64,
    /// CPU seconds that they took.
    pub cpu_s: f64,
    /// When one of them was last used: UTC.
    pub last_used: String,
}

/// What a check of all pictures came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Verified {
    /// Intact pictures.
    pub pictures: u64,
    /// Damaged ones, which were removed: what they were of, and what was wrong.
    pub damaged: Vec<String>,
    /// What was done where the file itself was damaged.
    pub renewed: Option<String>,
}

/// What was given up to make a database smaller.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Collected {
    /// Pictures that were removed.
    pub removed: u64,
    /// Their bytes.
    pub removed_bytes: u64,
    /// Pictures that are left.
    pub pictures: u64,
    /// Bytes of the database.
    pub bytes: u64,
}

/// One who waits for [`Database::verify`] is told how many pictures of how many are done.
pub type Observe<'a> = &'a dyn Fn(u64, u64);

impl Database {
    /// What is in it.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn list(&self) -> Result<Contents, DatabaseError> {
        self.run(|connection| {
            let mut statement = connection.prepare(
                // A damaged description is for `verify`.
                "SELECT renderer, version, substr(worker, 1, 8), coalesce(s.name, r.scene), light, size, count(*), sum(bytes),
                 sum(cpu_s), max(last_used) FROM renders AS r LEFT JOIN scenes AS s ON s.hash = r.scene
                 WHERE json_valid(description) GROUP BY renderer, version, worker, r.scene, size ORDER BY 8 DESC, 1, 2, 3, 4, 6",
            )?;
            let group = |row: &rusqlite::Row| {
                Ok(Group {
                    renderer: row.get(0)?,
                    version: row.get(1)?,
                    worker: row.get(2)?,
                    scene: row.get(3)?,
                    light: row.get(4)?,
                    size: row.get(5)?,
                    pictures: row.get(6)?,
                    bytes: row.get(7)?,
                    cpu_s: row.get(8)?,
                    last_used: row.get(9)?,
                })
            };
            let groups = statement.query_map([], group)?.collect::<Result<_, _>>()?;
            Ok(Contents { groups, pictures: pictures(connection)?, bytes: used(connection)? })
        })
    }

    /// Checks the file and every picture in it. Damaged pictures are removed: they are rendered again when they are needed.
    ///
    /// # Errors
    /// Where the file cannot be used, or is damaged while others use it.
    pub fn verify(&self, observe: Observe) -> Result<Verified, DatabaseError> {
        let renewed = match self.run(|connection| check_file(connection)) {
            Ok(()) => None,
            Err(renewed @ DatabaseError::Renewed { .. }) => Some(renewed.to_string()),
            Err(error) => return Err(error),
        };
        let ids: Vec<i64> = self.run(|connection| {
            let mut statement = connection.prepare("SELECT id FROM renders ORDER BY id")?;
            statement.query_map([], |row| row.get(0))?.collect()
        })?;
        let mut verified = Verified { pictures: 0, damaged: Vec::new(), renewed };
        for (done, id) in ids.iter().enumerate() {
            observe(done as u64, ids.len() as u64);
            match self.run(|connection| check_entry(connection, *id))? {
                None => verified.pictures += 1,
                Some(fault) => verified.damaged.push(fault),
            }
        }
        Ok(verified)
    }

    /// Removes what was not used for longest until the database has no more than so many bytes.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn shrink(&self, most_bytes: u64) -> Result<Collected, DatabaseError> {
        self.run(|connection| {
            let (mut removed, mut removed_bytes) = (0, 0);
            loop {
                let surplus = used(connection)?.saturating_sub(most_bytes);
                let (count, bytes) = if surplus == 0 { (0, 0) } else { remove_oldest(connection, surplus)? };
                if count == 0 {
                    break;
                }
                (removed, removed_bytes) = (removed + count, removed_bytes + bytes);
            }
            let orphans = "DELETE FROM scenes WHERE hash NOT IN (SELECT scene FROM renders WHERE json_valid(description))";
            connection.execute(orphans, [])?;
            give_back(connection)?;
            let (pictures, bytes) = (pictures(connection)?, used(connection)?);
            Ok(Collected { removed, removed_bytes, pictures, bytes })
        })
    }
}

fn pictures(connection: &Connection) -> rusqlite::Result<u64> {
    connection.query_row("SELECT count(*) FROM renders", [], |row| row.get(0))
}

/// Bytes of all pages that hold something.
fn used(connection: &Connection) -> rusqlite::Result<u64> {
    let pragma = |name: &str| connection.pragma_query_value(None, name, |row| row.get::<_, u64>(0));
    Ok((pragma("page_count")? - pragma("freelist_count")?) * pragma("page_size")?)
}

/// Damage is an error, as it is where SQLite meets it by itself.
fn check_file(connection: &Connection) -> rusqlite::Result<()> {
    let said: String = connection.query_row("PRAGMA integrity_check(1)", [], |row| row.get(0))?;
    match said.as_str() {
        "ok" => Ok(()),
        _ => Err(rusqlite::Error::SqliteFailure(
            ffi::Error::new(SQLITE_CORRUPT),
            Some(said.replace('\n', " ")),
        )),
    }
}

/// What was wrong with an entry, which is then removed.
fn check_entry(connection: &Connection, id: i64) -> rusqlite::Result<Option<String>> {
    let fault = match Entry::of(connection, id) {
        // It was removed meanwhile.
        Ok(None) => None,
        Ok(Some(entry)) => entry.fault().map(|fault| format!("{}: {fault}", entry.description)),
        Err(error) if error.sqlite_error_code().is_none() => Some(format!("picture {id}: {error}")),
        Err(error) => return Err(error),
    };
    if fault.is_some() {
        connection.execute("DELETE FROM renders WHERE id = ?1", [id])?;
    }
    Ok(fault)
}

/// Removes the oldest, as many as have so many bytes together, or a batch; the answer is their number and their bytes.
fn remove_oldest(connection: &mut Connection, bytes: u64) -> rusqlite::Result<(u64, u64)> {
    let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    let (mut count, mut sum) = (0, 0);
    {
        let mut oldest =
            transaction.prepare("SELECT id, bytes FROM renders ORDER BY last_used, id LIMIT ?1")?;
        let row = |row: &rusqlite::Row| Ok((row.get::<_, i64>(0)?, row.get::<_, u64>(1)?));
        let oldest = oldest.query_map([BATCH], row)?.collect::<Result<Vec<_>, _>>()?;
        let mut remove = transaction.prepare("DELETE FROM renders WHERE id = ?1")?;
        for (id, size) in oldest {
            if sum < bytes {
                count += remove.execute([id])? as u64;
                sum += size;
            }
        }
    }
    transaction.commit()?;
    Ok((count, sum))
}

/// Returns empty pages to the file system, and empties the log where nobody reads it.
fn give_back(connection: &Connection) -> rusqlite::Result<()> {
    let free = || connection.pragma_query_value(None, "freelist_count", |row| row.get::<_, u64>(0));
    let mut statement = connection.prepare(&format!("PRAGMA incremental_vacuum({PAGES})"))?;
    let mut left = free()?;
    while left > 0 {
        // One step for each page.
        let mut rows = statement.query([])?;
        while rows.next()?.is_some() {}
        let before = std::mem::replace(&mut left, free()?);
        if left >= before {
            break;
        }
    }
    connection.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(()))
}
