//! Prepared light kept in a folder, shared between programs.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use blake3::Hash;
use lookmatch_imaging::write_atomically;

use crate::flat::{Reader, Writer};
use crate::source::Source;
use crate::{Renderer, SceneError};

/// Bytes that a folder may hold: some twenty lights of ordinary pictures.
const LIMIT: u64 = 2 << 30;
/// Side of the largest pictures whose light is kept: it grows with the number of pixels, to 0.5 GB at this size.
const LARGEST: usize = 512;
/// How a file of prepared light ends.
const KEPT: &str = "transport";
/// After this time, what other programs left half-written is taken for abandoned.
const ABANDONED: Duration = Duration::from_secs(3600);

/// A folder that keeps prepared light, so that each scene is prepared once.
///
/// A file belongs to one scene, illumination and picture size; a checksum tells damaged ones, which are built again. Of
/// several programs that want the same light, one prepares it and the others wait. When the folder grows beyond its limit,
/// the files that were not used for longest go first. A folder that cannot be used is no error: it is told as
/// [`Progress::Warning`], and the light is prepared as without.
#[derive(Clone, Debug)]
pub struct TransportCache {
    folder: Option<PathBuf>,
    limit: u64,
}

/// What a [`TransportCache`] is doing.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// Another program is preparing the same light.
    Waiting,
    /// The light is being prepared: the share of the work that is done, from 0 to 1.
    Preparing(f64),
    /// It was prepared.
    Prepared,
    /// It was read from the folder.
    Loaded,
    /// The folder or a file in it cannot be used: one line that says why.
    Warning(String),
}

/// Is told of progress, from any thread.
pub type Observe<'a> = &'a (dyn Fn(Progress) + Sync);

impl TransportCache {
    /// Keeps light in a folder, which is made when it is needed.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: Some(folder.into()), limit: LIMIT }
    }

    /// Keeps nothing.
    pub fn off() -> Self {
        Self { folder: None, limit: 0 }
    }

    /// The same with another limit, in bytes. The file that was used last stays, whatever its size.
    pub fn limited(self, limit: u64) -> Self {
        Self { limit, ..self }
    }

    /// True where the light of pictures of a size is kept: of larger ones than 512 × 512 pixels it is not.
    pub fn keeps(&self, size: usize) -> bool {
        self.folder.is_some() && size <= LARGEST
    }

    /// Reads a renderer, or builds and keeps it.
    pub(crate) fn renderer(&self, source: &Source, observe: Observe) -> Result<Renderer, SceneError> {
        let build = || {
            let renderer = Renderer::build(source, observe)?;
            observe(Progress::Prepared);
            Ok(renderer)
        };
        let Some(folder) = self.folder.as_ref().filter(|_| self.keeps(source.size)) else { return build() };
        let file = Kept { source, key: source.key(), folder };
        let loaded = |renderer| {
            observe(Progress::Loaded);
            Ok(renderer)
        };
        // What is wrong with a file is told, and the file removed, by the one who holds the lock.
        if let Ok(Some(renderer)) = file.read() {
            return loaded(renderer);
        }
        let warn = |error: &dyn std::fmt::Display| observe(Progress::Warning(error.to_string()));
        let lock = match file.lock(observe) {
            Ok(lock) => lock,
            Err(error) => {
                warn(&format_args!("prepared light is not kept: '{}': {error}", folder.display()));
                return build();
            }
        };
        match file.read() {
            Ok(Some(renderer)) => return loaded(renderer),
            Ok(None) => {}
            Err(error) => {
                let path = file.path(KEPT);
                warn(&format_args!("kept light is prepared anew: '{}': {error}", path.display()));
                // Where it cannot be removed, it will be replaced.
                let _ = fs::remove_file(path);
            }
        }
        let renderer = build()?;
        if let Err(error) = file.write(&renderer).and_then(|()| trim(folder, self.limit)) {
            warn(&format_args!("prepared light is not kept: '{}': {error}", folder.display()));
        }
        // Whoever waits for it finds the file; if one more comes meanwhile, it does too.
        let _ = fs::remove_file(file.path("lock"));
        drop(lock);
        Ok(renderer)
    }
}

/// A file of the folder.
struct Kept<'a> {
    source: &'a Source,
    key: Hash,
    folder: &'a Path,
}

impl Kept<'_> {
    fn path(&self, extension: &str) -> PathBuf {
        self.folder.join(format!("{}.{extension}", self.key.to_hex()))
    }

    /// Waits until nobody else prepares this light. The lock ends with the file that is returned, or with the program.
    fn lock(&self, observe: Observe) -> io::Result<File> {
        fs::create_dir_all(self.folder)?;
        let file = File::create(self.path("lock"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                observe(Progress::Waiting);
                file.lock()?;
            }
            Err(TryLockError::Error(error)) => return Err(error),
        }
        Ok(file)
    }

    /// `None` where there is no file.
    fn read(&self) -> io::Result<Option<Renderer>> {
        let file = match File::open(self.path(KEPT)) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        // The time of its last use; a file that belongs to someone else may keep its own.
        let _ = file.set_modified(SystemTime::now());
        let mut input = Reader::new(file, &self.key)?;
        let renderer = Renderer::read(self.source, &mut input)?;
        input.finish()?;
        Ok(Some(renderer))
    }

    fn write(&self, renderer: &Renderer) -> io::Result<()> {
        write_atomically(&self.path(KEPT), |out| {
            let mut out = Writer::new(out, &self.key)?;
            renderer.write(&mut out)?;
            out.finish()
        })
    }
}

/// Removes files until a folder is within a limit, and what was abandoned in it. Whoever has one of them open reads on.
fn trim(folder: &Path, limit: u64) -> io::Result<()> {
    let mut kept = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        // Another program may have removed it.
        let Ok(metadata) = fs::metadata(&path) else { continue };
        let used = metadata.modified()?;
        match path.extension().and_then(|e| e.to_str()) {
            Some(KEPT) => kept.push((used, metadata.len(), path)),
            Some("tmp") if used.elapsed().is_ok_and(|age| age > ABANDONED) => drop(fs::remove_file(path)),
            _ => {}
        }
    }
    kept.sort();
    let mut total: u64 = kept.iter().map(|(_, size, _)| size).sum();
    kept.pop();
    for (_, size, path) in kept {
        if total > limit && fs::remove_file(path).is_ok() {
            total -= size;
        }
    }
    Ok(())
}
