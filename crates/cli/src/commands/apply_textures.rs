//! `lookmatch apply --texture`: maps of a source's parameters through a probe.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use lookmatch_materials::Material;
use lookmatch_remap::Probe;
use lookmatch_textures::{Encoding, Format, Report, Request, convert};

use crate::Usage;
use crate::args::ApplyArgs;
use crate::output::{bar, print, print_json, table};

pub(crate) fn run(args: &ApplyArgs) -> anyhow::Result<()> {
    let probe = Probe::read(&args.probe)?;
    let textures: Vec<(String, PathBuf)> =
        pairs(&args.textures.texture, "NAME=FILE")?.into_iter().map(|(n, f)| (n, f.into())).collect();
    let base = base(args, &probe, &textures)?;
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
        encodings: encodings.collect::<Result<_, _>>()?,
        format: format.transpose()?,
        clamp: args.clamp,
        folder: args.textures.output.clone().unwrap_or_default(),
        band_rows: None,
    };
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("cannot listen for Ctrl-C")?;
    let bar = bar(0, "rows");
    let progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let report = convert(&request, &progress, &stop);
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

/// `NAME=VALUE`, each name once.
fn pairs(texts: &[String], form: &str) -> anyhow::Result<Vec<(String, String)>> {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for text in texts {
        let (name, value) = text.split_once('=').ok_or_else(|| Usage(format!("'{text}' is not {form}")))?;
        if pairs.iter().any(|(other, _)| other == name.trim()) {
            return Err(Usage(format!("'{}' is given twice", name.trim())).into());
        }
        pairs.push((name.trim().to_owned(), value.trim().to_owned()));
    }
    Ok(pairs)
}

/// The source material with what is fixed; every parameter that the probe tabulates must be, or have a texture.
fn base(args: &ApplyArgs, probe: &Probe, textures: &[(String, PathBuf)]) -> anyhow::Result<Material> {
    let mut base = probe.from.clone();
    let model = base.model();
    let mut textured = Vec::new();
    for (name, _) in textures {
        textured.extend(model.resolve(name)?);
    }
    let mut fixed = Vec::new();
    let values: Vec<String> = args.values.iter().chain(&args.textures.fix).cloned().collect();
    for (name, value) in pairs(&values, "NAME=VALUE")? {
        let indices = model.resolve(&name)?;
        if indices.iter().any(|i| fixed.contains(i)) {
            return Err(Usage(format!("'{name}' is given twice")).into());
        }
        if indices.iter().any(|i| textured.contains(i)) {
            return Err(Usage(format!("'{name}' has both a texture and a value")).into());
        }
        base.set(&name, &value)?;
        fixed.extend(indices);
    }
    for axis in &probe.source_axes {
        let indices = model.resolve(&axis.name)?;
        if indices.iter().any(|i| !fixed.contains(i) && !textured.contains(i)) {
            let (min, max) = (axis.value(0), axis.value(axis.len() - 1));
            return Err(Usage(format!(
                "the probe maps '{0}' too: give --texture {0}=FILE, or --fix {0}={min} to {max}",
                axis.name
            ))
            .into());
        }
    }
    Ok(base)
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
