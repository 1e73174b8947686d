//! CSV (RFC 4180): the table itself, a row for each entry, with its errors and flags.

use csv::Writer;
use lookmatch_remap::{Axis, Entry, Flag, Probe};

use super::{Exported, File, Format, Options};
use crate::ExportError;

/// `csv`.
pub(crate) struct Csv;

impl Format for Csv {
    fn name(&self) -> &'static str {
        "csv"
    }

    fn summary(&self) -> &'static str {
        "the table itself: a row for each entry, with fitness, errors and flags"
    }

    fn export(&self, probe: &Probe, options: &Options) -> Result<Exported, ExportError> {
        if options.smooth || !options.fix.is_empty() {
            let what = "csv holds the probe's entries as they are: --smooth and --fix do not apply";
            return Err(ExportError::Request(what.into()));
        }
        let mut writer = Writer::from_writer(Vec::new());
        let failed =
            |error: &dyn std::fmt::Display| ExportError::Request(format!("cannot write the table: {error}"));
        writer.write_record(header(probe)).map_err(|e| failed(&e))?;
        for (place, entry) in probe.entries.iter().enumerate() {
            writer.write_record(row(probe, place, entry)).map_err(|e| failed(&e))?;
        }
        let bytes = writer.into_inner().map_err(|e| failed(&e))?;
        let text = String::from_utf8(bytes).map_err(|e| failed(&e))?;
        let names = |axes: &[Axis]| axes.iter().map(|a| a.name.clone()).collect::<Vec<_>>();
        Ok(Exported {
            files: vec![File { suffix: String::new(), text }],
            inputs: names(&probe.source_axes),
            outputs: names(&probe.target_axes).into_iter().map(|name| (name, None)).collect(),
            notes: Vec::new(),
        })
    }
}

/// What is said of each entry beside its parameters.
const MEASURES: [&str; 8] = [
    "fitness",
    "nrmsd_r",
    "nrmsd_g",
    "nrmsd_b",
    "nrmsd_masked_r",
    "nrmsd_masked_g",
    "nrmsd_masked_b",
    "noise",
];

fn header(probe: &Probe) -> Vec<String> {
    let columns =
        |side: &str, axes: &[Axis]| axes.iter().map(|a| format!("{side}.{}", a.name)).collect::<Vec<_>>();
    let mut header = columns("source", &probe.source_axes);
    header.extend(columns("target", &probe.target_axes));
    header.extend(MEASURES.map(str::to_owned));
    header.extend(
        ["body_r", "body_g", "body_b", "evaluations", "saturated", "flags", "failed"].map(str::to_owned),
    );
    header
}

fn row(probe: &Probe, place: usize, entry: &Entry) -> Vec<String> {
    let has_result = entry.failed.is_none();
    // Of what failed nothing is known.
    let known = |v: f64| if has_result { v.to_string() } else { String::new() };
    let mut row: Vec<String> = entry.source.iter().map(f64::to_string).collect();
    row.extend(
        (0..probe.target_axes.len()).map(|k| entry.target.get(k).map_or(String::new(), f64::to_string)),
    );
    row.push(known(entry.fitness));
    row.extend(entry.nrmsd.iter().chain(&entry.nrmsd_masked).map(|v| known(*v)));
    row.push(entry.noise.map_or(String::new(), |noise| noise.fitness.to_string()));
    row.extend((0..3).map(|c| entry.body.map_or(String::new(), |body| body[c].to_string())));
    row.push(entry.evaluations.to_string());
    row.push(entry.saturated.join(" "));
    let flags = probe.flags(place);
    row.push(flags.into_iter().map(flag_name).collect::<Vec<_>>().join(" "));
    row.push(entry.failed.clone().unwrap_or_default());
    row
}

/// As the documentation of probes calls it.
fn flag_name(flag: Flag) -> &'static str {
    match flag {
        Flag::Failed => "failed",
        Flag::Saturated => "saturated",
        Flag::BelowNoise => "below-noise",
        Flag::OutsideFit => "outside-fit",
        Flag::Unreachable => "unreachable",
    }
}
