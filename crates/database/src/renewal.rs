//! An open file, how it is made, and how a damaged one is replaced.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rusqlite::{Connection, ErrorCode, OpenFlags, TransactionBehavior, params};

use crate::DatabaseError;
use crate::entry::Entry;
use crate::error::is_damage;

/// Format of the tables; `PRAGMA user_version`.
const FORMAT: i64 = 1;
/// How long to wait for others to finish writing, which takes them a fraction of a second.
const PATIENCE: Duration = Duration::from_secs(20);
/// Pictures that are saved in one transaction.
const BATCH: usize = 256;

/// An open file. Everybody who has it open holds a lock beside it, so that nobody replaces it under their hands.
pub(crate) struct Open {
    path: PathBuf,
    connection: Connection,
    lock: File,
}

impl Open {
    /// Opens a file, or makes it; the second is what is to be told of a damaged one that was replaced.
    pub(crate) fn new(path: &Path) -> Result<(Self, Option<DatabaseError>), DatabaseError> {
        let lock = shared_lock(path).map_err(|source| DatabaseError::Io { path: path.into(), source })?;
        match connect(path) {
            Ok(connection) => Ok((Self { path: path.into(), connection, lock }, None)),
            Err(DatabaseError::Sqlite { source, .. }) if is_damage(&source) => {
                let blank = Connection::open_in_memory()
                    .map_err(|source| DatabaseError::Sqlite { path: path.into(), source })?;
                let mut open = Self { path: path.into(), connection: blank, lock };
                match open.renew(&source) {
                    renewed @ DatabaseError::Renewed { .. } => Ok((open, Some(renewed))),
                    error => Err(error),
                }
            }
            Err(error) => Err(error),
        }
    }

    /// Does something with the connection. Where that shows that the file is damaged, it is replaced.
    pub(crate) fn run<T>(
        &mut self,
        work: impl FnOnce(&mut Connection) -> rusqlite::Result<T>,
    ) -> Result<T, DatabaseError> {
        work(&mut self.connection).map_err(|source| match is_damage(&source) {
            true => self.renew(&source),
            false => DatabaseError::Sqlite { path: self.path.clone(), source },
        })
    }

    /// Sets the file aside and saves what is intact into a new one; the answer says what was done.
    fn renew(&mut self, damage: &rusqlite::Error) -> DatabaseError {
        let reason = damage.to_string();
        let path = self.path.clone();
        // A lock that is held already cannot be asked for in another mode.
        self.lock.unlock().ok();
        if self.lock.try_lock().is_err() {
            self.lock.lock_shared().ok();
            return DatabaseError::Damaged { path, reason };
        }
        let renewed = self.replaced();
        self.lock.unlock().ok();
        self.lock.lock_shared().ok();
        match renewed {
            Ok((aside, saved)) => DatabaseError::Renewed { path, aside, reason, saved },
            Err(error) => error,
        }
    }

    fn replaced(&mut self) -> Result<(PathBuf, usize), DatabaseError> {
        let sqlite = |source| DatabaseError::Sqlite { path: self.path.clone(), source };
        // Closes the old one.
        self.connection = Connection::open_in_memory().map_err(sqlite)?;
        let aside = self.path.with_extension("damaged.sqlite");
        for ending in ["-wal", "-shm", ""] {
            let (from, to) = (with_ending(&self.path, ending), with_ending(&aside, ending));
            fs::remove_file(&to).ok();
            match fs::rename(&from, to) {
                Err(error) if ending.is_empty() || error.kind() != io::ErrorKind::NotFound => {
                    return Err(DatabaseError::Io { path: from, source: error });
                }
                _ => {}
            }
        }
        self.connection = connect(&self.path)?;
        let saved = saved(&aside, &mut self.connection).map_err(sqlite)?;
        Ok((aside, saved))
    }
}

fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// Waits while somebody replaces the file.
fn shared_lock(path: &Path) -> io::Result<File> {
    fs::create_dir_all(path.parent().unwrap_or(Path::new("")))?;
    let lock = File::options().create(true).truncate(false).write(true).open(path.with_extension("lock"))?;
    lock.lock_shared()?;
    Ok(lock)
}

fn connect(path: &Path) -> Result<Connection, DatabaseError> {
    let failed = |source| DatabaseError::Sqlite { path: path.into(), source };
    let flags =
        OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let mut connection = Connection::open_with_flags(path, flags).map_err(failed)?;
    let found = prepare(&mut connection).map_err(failed)?;
    if found > FORMAT {
        return Err(DatabaseError::Format { path: path.into(), found, known: FORMAT });
    }
    Ok(connection)
}

/// Makes the tables where there are none; the answer is their format.
fn prepare(connection: &mut Connection) -> rusqlite::Result<i64> {
    connection.busy_timeout(PATIENCE)?;
    let format = |connection: &Connection| {
        connection.pragma_query_value(None, "user_version", |row| row.get::<_, i64>(0))
    };
    let found = format(connection)?;
    if found > FORMAT {
        return Ok(found);
    }
    if found == 0 {
        // Must precede everything else: it is the first thing that is written into a new file.
        connection.pragma_update(None, "auto_vacuum", "INCREMENTAL")?;
    }
    write_ahead(connection)?;
    // In this mode a killed program loses nothing, and a power cut the last pictures at most.
    connection.pragma_update(None, "synchronous", "NORMAL")?;
    connection.pragma_update(None, "foreign_keys", true)?;
    connection.pragma_update(None, "cell_size_check", true)?;
    if found == 0 {
        let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        // Another program may have been faster.
        if format(&transaction)? == 0 {
            transaction.execute_batch(include_str!("schema.sql"))?;
            transaction.pragma_update(None, "user_version", FORMAT)?;
        }
        transaction.commit()?;
    }
    format(connection)
}

/// Readers and a writer do not wait for each other. Of several programs that want to change the mode of a new file at once, SQLite
/// turns some away without waiting.
fn write_ahead(connection: &Connection) -> rusqlite::Result<()> {
    let begin = Instant::now();
    loop {
        match connection.pragma_update(None, "journal_mode", "WAL") {
            Err(error)
                if error.sqlite_error_code() == Some(ErrorCode::DatabaseBusy)
                    && begin.elapsed() < PATIENCE =>
            {
                sleep(Duration::from_millis(20));
            }
            done => return done,
        }
    }
}

/// Copies what is intact; the answer is the number of pictures.
fn saved(from: &Path, to: &mut Connection) -> rusqlite::Result<usize> {
    let Ok(old) = Connection::open(from) else { return Ok(0) };
    let scenes = |row: &rusqlite::Row| Ok([row.get::<_, String>(0)?, row.get(1)?, row.get(2)?]);
    for [hash, name, content] in readable(&old, "SELECT hash, name, content FROM scenes", scenes) {
        to.execute(
            "INSERT INTO scenes VALUES (?1, ?2, ?3) ON CONFLICT DO NOTHING",
            params![hash, name, content],
        )?;
    }
    let ids: Vec<i64> = ids(&old).into_iter().collect();
    let mut count = 0;
    for batch in ids.chunks(BATCH) {
        let transaction = to.transaction()?;
        for id in batch {
            if let Ok(Some(entry)) = Entry::of(&old, *id)
                && entry.fault().is_none()
            {
                entry.store(&transaction)?;
                count += 1;
            }
        }
        transaction.commit()?;
    }
    Ok(count)
}

/// Numbers of all entries that can be reached, from either end of either table: a damaged page ends a walk.
fn ids(connection: &Connection) -> BTreeSet<i64> {
    let walks = [
        "renders ORDER BY id",
        "renders ORDER BY id DESC",
        "pictures ORDER BY id",
        "pictures ORDER BY id DESC",
    ];
    let walk = |order: &str| readable(connection, &format!("SELECT id FROM {order}"), |row| row.get(0));
    walks.into_iter().flat_map(walk).collect()
}

/// Rows up to the first that cannot be read.
fn readable<T>(
    connection: &Connection,
    sql: &str,
    read: impl Fn(&rusqlite::Row) -> rusqlite::Result<T>,
) -> Vec<T> {
    let Ok(mut statement) = connection.prepare(sql) else { return Vec::new() };
    let Ok(rows) = statement.query_map([], |row| read(row)) else { return Vec::new() };
    rows.map_while(Result::ok).collect()
}
