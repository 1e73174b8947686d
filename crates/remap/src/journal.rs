//! The state of a remap on its way: the plan, then a line for each source point that is done.
//!
//! Lines are appended and flushed, so that a killed process loses the point in flight and nothing else.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use lookmatch_imaging::write_atomically;
use serde::{Deserialize, Serialize};

use crate::{Entry, Plan, RemapError};

/// Where the state of a remap into `probe` is kept: beside it, with `.partial` appended.
pub fn journal_path(probe: &Path) -> PathBuf {
    let mut name = probe.as_os_str().to_owned();
    name.push(".partial");
    PathBuf::from(name)
}

/// First line of the file.
#[derive(Serialize, Deserialize, PartialEq)]
struct Header {
    program: String,
    plan: Plan,
}

/// One line: the place of the source point in lexicographic order, the indices of its target, the entry, what was rendered.
#[derive(Serialize, Deserialize)]
struct Line {
    place: usize,
    point: Vec<u32>,
    entry: Entry,
    /// Targets that were rendered for it and for no point before.
    rendered: Vec<u64>,
}

/// A file of finished source points.
pub(crate) struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Opens the state beside a probe. Finished points of the same plan are handed to `found`; state of another plan or
    /// program version is replaced.
    pub(crate) fn open(
        path: &Path,
        plan: &Plan,
        mut found: impl FnMut(usize, Vec<u32>, Entry, &[u64]),
    ) -> Result<Self, RemapError> {
        let failed = |source| RemapError::Write { path: path.to_owned(), source };
        let header = Header { program: env!("CARGO_PKG_VERSION").into(), plan: plan.clone() };
        let mut kept = vec![serde_json::to_string(&header).map_err(|e| failed(e.into()))?];
        if let Ok(text) = std::fs::read_to_string(path) {
            let mut lines = text.lines();
            if lines.next() == Some(&kept[0]) {
                // A line cut short by a kill ends what can be trusted.
                for line in lines {
                    let Ok(parsed) = serde_json::from_str::<Line>(line) else { break };
                    kept.push(line.to_owned());
                    found(parsed.place, parsed.point, parsed.entry, &parsed.rendered);
                }
            }
        }
        // Rewritten whole or not at all: a kill here must not lose what earlier runs finished.
        write_atomically(path, |out| kept.iter().try_for_each(|line| writeln!(out, "{line}")))
            .map_err(failed)?;
        let file = File::options().append(true).open(path).map_err(failed)?;
        Ok(Self { path: path.to_owned(), file })
    }

    /// Adds a finished source point.
    pub(crate) fn append(
        &mut self,
        place: usize,
        point: &[u32],
        entry: &Entry,
        rendered: Vec<u64>,
    ) -> Result<(), RemapError> {
        let failed = |source| RemapError::Write { path: self.path.clone(), source };
        let line = Line { place, point: point.to_vec(), entry: entry.clone(), rendered };
        let text = serde_json::to_string(&line).map_err(|e| failed(e.into()))?;
        writeln!(self.file, "{text}").and_then(|()| self.file.flush()).map_err(failed)
    }

    /// Removes the file once its content is part of a probe.
    pub(crate) fn remove(self) {
        // A file that cannot be removed does no harm: the next run finds every point done.
        let _ = std::fs::remove_file(self.path);
    }
}
