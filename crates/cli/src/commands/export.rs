//! `lookmatch export`: a probe for other programs.

use std::path::{Path, PathBuf};

use anyhow::Context;
use lookmatch_export::{Exported, File, Options, formats};
use lookmatch_imaging::write_atomically;
use lookmatch_remap::Probe;
use serde_json::json;

use crate::Usage;
use crate::args::ExportArgs;
use crate::commands::check_output;
use crate::output::{print, print_json, table};

pub(crate) fn run(args: &ExportArgs) -> anyhow::Result<()> {
    check_output(&args.output)?;
    let probe = Probe::read(&args.probe)?;
    let format = formats().iter().find(|format| format.name() == args.to);
    let format = format.ok_or_else(|| Usage(format!("format '{}' is unknown", args.to)))?;
    let options = Options {
        smooth: args.smooth,
        fix: args.fix.iter().map(|text| assignment(text)).collect::<Result<_, _>>()?,
        title: args.probe.file_name().unwrap_or_default().to_string_lossy().into_owned(),
    };
    // Where the colour of a body is matched, each of thousands of points is some integrals over the hemisphere.
    let progress = indicatif::ProgressBar::new_spinner().with_message("asking the probe");
    progress.enable_steady_tick(std::time::Duration::from_millis(200));
    let exported = format.export(&probe, &options);
    progress.finish_and_clear();
    let exported = exported?;
    let files: Vec<(PathBuf, &File)> =
        exported.files.iter().map(|file| (suffixed(&args.output, &file.suffix), file)).collect();
    for (path, _) in &files {
        check_output(path)?;
    }
    for (path, file) in &files {
        write_atomically(path, |out| out.write_all(file.text.as_bytes()))
            .with_context(|| format!("cannot write '{}'", path.display()))?;
    }
    for note in &exported.notes {
        eprintln!("note: {note}");
    }
    let paths: Vec<&PathBuf> = files.iter().map(|(path, _)| path).collect();
    if args.json.json {
        return print_json(&json!({
            "format": args.to, "files": paths, "inputs": exported.inputs,
            "outputs": exported.outputs.iter().map(|(name, error)| json!({ "name": name, "error": error })).collect::<Vec<_>>(),
            "notes": exported.notes,
        }));
    }
    print(&text(&paths, &exported))
}

fn assignment(text: &str) -> Result<(String, String), Usage> {
    let (name, value) = text.split_once('=').ok_or_else(|| Usage(format!("'{text}' is not NAME=VALUE")))?;
    Ok((name.trim().to_owned(), value.trim().to_owned()))
}

/// `ggx-2.cube` for the suffix `-2`.
fn suffixed(path: &Path, suffix: &str) -> PathBuf {
    if suffix.is_empty() {
        return path.to_owned();
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    path.with_file_name(format!("{stem}{suffix}{extension}"))
}

fn text(paths: &[&PathBuf], exported: &Exported) -> String {
    let mut text: String = paths.iter().map(|path| format!("{}\n", path.display())).collect();
    text += &format!(
        "takes {}\n",
        if exported.inputs.is_empty() { "nothing".into() } else { exported.inputs.join(", ") }
    );
    let mut rows = vec![vec!["gives".to_owned(), "largest difference from apply".to_owned()]];
    let error = |error: &Option<f64>| {
        error.map_or("-".into(), |e| if e < 1e-9 { "none".into() } else { format!("{e:.1e}") })
    };
    rows.extend(exported.outputs.iter().map(|(name, e)| vec![name.clone(), error(e)]));
    text + &table(&rows)
}
