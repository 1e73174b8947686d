//! One picture of the database: what is stored, and how damage shows.

use std::path::Path;

use blake3::{Hash, Hasher};
use lookmatch_imaging::{Image, decode, encode};
use lookmatch_renderers::Picture;
use rusqlite::{Connection, OptionalExtension, Params, Row, params};

/// What images are called in messages; the extension gives their format.
const NAME: &str = "picture.exr";

/// UTC, as a column has it: sorted as text, it is sorted by time.
pub(crate) const NOW: &str = "strftime('%Y-%m-%d %H:%M:%f', 'now')";

/// A row and its picture, as they are stored.
pub(crate) struct Entry {
    pub(crate) id: i64,
    pub(crate) key: Vec<u8>,
    pub(crate) description: String,
    /// Samples per pixel that it took.
    pub(crate) taken: u32,
    pub(crate) cpu_s: f64,
    pub(crate) wall_s: f64,
    pub(crate) noise: Option<f64>,
    pub(crate) created: String,
    pub(crate) last_used: String,
    pub(crate) checksum: Vec<u8>,
    pub(crate) exr: Vec<u8>,
}

/// The columns of an [`Entry`] in its order.
const COLUMNS: &str = "SELECT r.id, r.key, r.description, r.taken, r.cpu_s, r.wall_s, r.noise, r.created, r.last_used, \
     r.checksum, p.exr FROM renders AS r LEFT JOIN pictures AS p ON p.id = r.id";

/// The BLAKE3 of all that must not change.
fn checksum(key: &[u8], taken: u32, exr: &[u8]) -> Hash {
    let mut hasher = Hasher::new();
    hasher.update(key).update(&taken.to_le_bytes()).update(exr);
    hasher.finalize()
}

/// The key of a description.
pub(crate) fn key(description: &str) -> Hash {
    blake3::hash(description.as_bytes())
}

impl Entry {
    /// A new one; its number and its times are given by the database.
    pub(crate) fn new(description: String, picture: &Picture) -> Result<Self, String> {
        let exr = encode(Path::new(NAME), &picture.image, &[]).map_err(|error| error.to_string())?;
        let key = key(&description).as_bytes().to_vec();
        let checksum = checksum(&key, picture.samples, &exr).as_bytes().to_vec();
        let Picture { samples: taken, cpu_s, wall_s, noise, .. } = *picture;
        let (created, last_used) = (String::new(), String::new());
        Ok(Self { id: 0, key, description, taken, cpu_s, wall_s, noise, created, last_used, checksum, exr })
    }

    /// The entry of a key, if there is one; a row that makes no sense is an error that is no damage of the file.
    pub(crate) fn find(connection: &Connection, key: &[u8]) -> rusqlite::Result<Option<Self>> {
        Self::select(connection, "WHERE r.key = ?1", params![key])
    }

    /// The entry of a number.
    pub(crate) fn of(connection: &Connection, id: i64) -> rusqlite::Result<Option<Self>> {
        Self::select(connection, "WHERE r.id = ?1", params![id])
    }

    fn select(connection: &Connection, which: &str, values: impl Params) -> rusqlite::Result<Option<Self>> {
        let mut statement = connection.prepare_cached(&format!("{COLUMNS} {which}"))?;
        statement.query_row(values, Self::read).optional()
    }

    fn read(row: &Row) -> rusqlite::Result<Self> {
        Ok(Self {
            id: row.get(0)?,
            key: row.get(1)?,
            description: row.get(2)?,
            taken: row.get(3)?,
            cpu_s: row.get(4)?,
            wall_s: row.get(5)?,
            noise: row.get(6)?,
            created: row.get(7)?,
            last_used: row.get(8)?,
            checksum: row.get(9)?,
            exr: row.get(10)?,
        })
    }

    /// Stores it, unless its key is there already. Both tables, so within a transaction.
    pub(crate) fn store(&self, connection: &Connection) -> rusqlite::Result<()> {
        let Self { key, description, taken, cpu_s, wall_s, noise, created, last_used, checksum, exr, .. } =
            self;
        let sql = format!(
            "INSERT INTO renders (key, description, taken, cpu_s, wall_s, noise, bytes, checksum, created, last_used)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, coalesce(nullif(?9, ''), {NOW}), coalesce(nullif(?10, ''), {NOW}))
             ON CONFLICT (key) DO NOTHING"
        );
        let mut statement = connection.prepare_cached(&sql)?;
        let bytes = exr.len();
        let values =
            params![key, description, taken, cpu_s, wall_s, noise, bytes, checksum, created, last_used];
        if statement.execute(values)? == 0 {
            return Ok(());
        }
        let id = connection.last_insert_rowid();
        connection.prepare_cached("INSERT INTO pictures VALUES (?1, ?2)")?.execute(params![id, exr])?;
        Ok(())
    }

    /// What is wrong with it.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        if key(&self.description).as_bytes() != &*self.key {
            return Some("its description is not that of its key");
        }
        let expected = checksum(&self.key, self.taken, &self.exr);
        (expected.as_bytes() != &*self.checksum).then_some("its checksum is another")
    }

    /// The picture of an entry without fault.
    pub(crate) fn picture(&self) -> Result<Picture, String> {
        let image: Image = decode(Path::new(NAME), &self.exr).map_err(|error| error.to_string())?;
        let Self { taken: samples, cpu_s, wall_s, noise, .. } = *self;
        Ok(Picture { image, samples, cpu_s, wall_s, noise })
    }
}
