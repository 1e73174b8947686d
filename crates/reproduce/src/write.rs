//! The folder of a report: `index.html` and `report.txt` for people, `report.json` for machines, and a file for each experiment that is
//! done, so that a run that was interrupted goes on with the next.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::Context;
use lookmatch_imaging::write_atomically;
use serde::{Deserialize, Serialize};

use crate::{Environment, Report, Run, page, text};

/// Where in the folder the pictures lie.
const PICTURES: &str = "pictures";

/// An experiment that is done, and what it was run with.
#[derive(Serialize, Deserialize)]
struct Done {
    environment: Environment,
    report: Report,
}

/// Writes `index.html`, `report.json` and `report.txt` into a folder that has the pictures already.
///
/// # Errors
/// A picture that cannot be read, a file that cannot be written; the message names it.
pub fn write(run: &Run, folder: &Path) -> anyhow::Result<()> {
    let page = page(run, folder)?;
    file(&folder.join("report.json"), &(serde_json::to_string_pretty(run)? + "\n"))?;
    file(&folder.join("report.txt"), &text(run))?;
    file(&folder.join("index.html"), &page)
}

/// The folder of a report's pictures, which is made if there is none. Reports name what lies in it relative to their own folder:
/// `pictures/ward-1-source.png`.
///
/// # Errors
/// A folder that cannot be made.
pub fn pictures(folder: &Path) -> anyhow::Result<PathBuf> {
    let pictures = folder.join(PICTURES);
    std::fs::create_dir_all(&pictures)
        .with_context(|| format!("cannot make folder '{}'", pictures.display()))?;
    Ok(pictures)
}

/// Keeps what an experiment found as `NAME.json`, for [`kept`].
///
/// # Errors
/// A file that cannot be written.
pub fn keep(report: &Report, environment: &Environment, folder: &Path) -> anyhow::Result<()> {
    let done = Done { environment: environment.clone(), report: report.clone() };
    file(&kept_path(folder, &report.name), &(serde_json::to_string_pretty(&done)? + "\n"))
}

/// What an experiment found in an earlier run of the same program with the same seed and size, if that was kept.
///
/// A file that is of no use is ignored, and `warn` is told why: it is damaged, was run otherwise, or its pictures are gone.
pub fn kept(name: &str, environment: &Environment, folder: &Path, warn: &dyn Fn(&str)) -> Option<Report> {
    let path = kept_path(folder, name);
    let text = match std::fs::read_to_string(&path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return None,
        text => text.map_err(|error| error.to_string()),
    };
    match text.and_then(|text| usable(&text, name, environment, folder)) {
        Ok(report) => Some(report),
        Err(why) => {
            warn(&format!("'{}' is ignored, and {name} is run again: {why}", path.display()));
            None
        }
    }
}

/// The report in a kept file, or why it is of no use.
fn usable(text: &str, name: &str, environment: &Environment, folder: &Path) -> Result<Report, String> {
    let Done { environment: earlier, report } =
        serde_json::from_str(text).map_err(|e| format!("it is damaged: {e}"))?;
    let way = |e: &Environment| {
        format!("{}, seed {}, {}", e.program, e.seed, if e.is_quick { "quick" } else { "full" })
    };
    if report.name != name {
        return Err(format!("it is of experiment '{}'", report.name));
    }
    if way(&earlier) != way(environment) {
        return Err(format!("it is of {}, not of {}", way(&earlier), way(environment)));
    }
    if let Some(file) = files(&report).find(|file| !folder.join(file).is_file()) {
        return Err(format!("picture '{}' is missing", folder.join(file).display()));
    }
    Ok(report)
}

/// All pictures and figures that a report names.
fn files(report: &Report) -> impl Iterator<Item = &str> {
    let comparisons = report.comparisons.iter();
    let pictures =
        comparisons.flat_map(|comparison| std::iter::once(&comparison.source).chain(&comparison.others));
    let pictures = pictures.flat_map(|picture| std::iter::once(&picture.file).chain(&picture.error_file));
    pictures.chain(report.figures.iter().map(|figure| &figure.file)).map(String::as_str)
}

fn kept_path(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.json"))
}

fn file(path: &Path, text: &str) -> anyhow::Result<()> {
    write_atomically(path, |out| out.write_all(text.as_bytes()))
        .with_context(|| format!("cannot write '{}'", path.display()))
}
