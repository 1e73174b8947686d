//! `lookmatch apply --texture`: maps of a source's parameters through a probe.

use std::path::{Path, PathBuf};

use lookmatch_remap::Probe;
use lookmatch_textures::{Channel, Encoding, Format, Progress, Report, Request, convert};

use super::apply::{pairs, source};
use super::interruption;
use crate::Usage;
use crate::args::ApplyArgs;
use crate::output::{bar, print, print_json, spinner, table};

pub(crate) fn run(args: &ApplyArgs) -> anyhow::Result<()> {
    let probe = Probe::read(&args.probe)?;
    let (mut textures, mut channels) = (Vec::new(), Vec::new());
    for (name, file) in pairs(&args.textures.texture, "NAME=FILE")? {
        let (path, channel) = packed(&file);
        channels.extend(channel.map(|channel| (name.clone(), channel)));
        textures.push((name, path));
    }
    let textured: Vec<&str> = textures.iter().map(|(name, _)| name.as_str()).collect();
    let base = source(&probe, args, &textured)?;
    let encodings = pairs(&args.textures.encoding, "NAME=linear or NAME=srgb")?;
    let encodings = encodings.into_iter().map(|(name, text)| match Encoding::parse(&text) {
        Some(encoding) => Ok((name, encoding)),
        None => Err(Usage(format!("--encoding {name}={text}: '{text}' is unknown; use linear or srgb"))),
    });
    let format = args.textures.format.as_deref().map(|name| {
        let known = Format::NAMES.join(", ");
        Format::parse(name).ok_or_else(|| Usage(format!("--format '{name}' is unknown; use one of {known}")))
    });
    let request = Request {
        probe: &probe,
        base,
        textures,
        channels,
        encodings: encodings.collect::<Result<_, _>>()?,
        format: format.transpose()?,
        clamp: args.clamp,
        folder: args.textures.output.clone().unwrap_or_default(),
        band_rows: None,
    };
    let stop = interruption()?;
    let (spinner, bar) = (spinner("reading the probe"), bar(0, "rows"));
    let progress = |at: Progress| match at {
        Progress::Table { parameter, points } => {
            spinner.set_message(format!("table of {parameter}: {points} points"));
        }
        Progress::Rows { done, total } => {
            spinner.finish_and_clear();
            bar.set_length(total as u64);
            bar.set_position(done as u64);
        }
    };
    let report = convert(&request, &progress, &stop);
    spinner.finish_and_clear();
    bar.finish_and_clear();
    let report = report?;
    for note in &report.notes {
        eprintln!("note: {note}");
    }
    if args.json.json {
        return print_json(&report);
    }
    print(&text(&report, &request))
}

/// A file, and the channel that follows it: `orm.png:g`. A file of that whole name is itself.
fn packed(file: &str) -> (PathBuf, Option<Channel>) {
    let channel = |(path, letter): (&str, &str)| Some((path.into(), Some(Channel::parse(letter)?)));
    let found = if Path::new(file).exists() { None } else { file.rsplit_once(':').and_then(channel) };
    found.unwrap_or((file.into(), None))
}

/// The target's parameters: maps, then numbers.
fn text(report: &Report, request: &Request) -> String {
    let mut rows = vec![vec!["parameter".to_owned(), "map or value".to_owned()]];
    for (map, name) in report.maps() {
        rows.push(vec![name.to_owned(), request.folder.join(map).display().to_string()]);
    }
    for (name, value) in report.constants() {
        rows.push(vec![name.to_owned(), format!("{value} (the same everywhere, no map)")]);
    }
    let size = report.size.first().map_or(String::new(), |[w, h]| format!(", {w} x {h} texels"));
    let tiles =
        if report.tiles.is_empty() { String::new() } else { format!(", {} tiles", report.tiles.len()) };
    format!(
        "{}: {}{size}{tiles}\n{}",
        request.folder.join("material.json").display(),
        report.model,
        table(&rows)
    )
}
