//! `lookmatch renderers`: which other renderers there are, their installation, and what a worker gets wrong.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use anyhow::Context;
use lookmatch_renderers::{
    BUNDLED, Bundled, CHECK_NAMES, CheckOptions, CheckReport, Finding, Installations, Number, Outcome,
    Recipe, State, check,
};
use serde_json::json;

use super::{create_folder, interruption};
use crate::Usage;
use crate::args::{CheckArgs, RenderersArgs, RenderersCommand};
use crate::output::{print, print_json, spinner, table};
use crate::renderers::{launch, launch_command};

pub(crate) fn run(args: &RenderersArgs) -> anyhow::Result<()> {
    match &args.command {
        None => list(args.json.json),
        Some(RenderersCommand::Install { names }) => install(names),
        Some(RenderersCommand::Remove { names }) => remove(names),
        Some(RenderersCommand::Check(args)) => check_renderer(args),
    }
}

/// One line per renderer: what it is, and whether it can be used.
fn list(as_json: bool) -> anyhow::Result<()> {
    let installations = Installations::of_user()?;
    let mut rows = vec![["", "renderer", "licence", "state"].map(str::to_owned).to_vec()];
    let mut documents = Vec::new();
    for renderer in BUNDLED {
        let recipe = recipe(renderer)?;
        let details = recipe.details();
        let state = installations.state(renderer)?;
        let (word, how) = match &state {
            State::Installed { .. } => ("installed".to_owned(), None),
            State::Outdated => {
                ("outdated".to_owned(), Some(format!("lookmatch renderers install {}", renderer.name)))
            }
            State::Missing { what, how } => (what.clone(), Some(how.clone())),
        };
        documents.push(json!({
            "name": renderer.name, "title": details.title, "about": details.about, "licence": details.licence,
            "packages": recipe.dependencies, "state": word, "how": how,
            "folder": match &state { State::Installed { folder } => Some(folder), _ => None },
        }));
        let state = match how {
            Some(how) => format!("{word}; {how}"),
            None => format!("{word}, {}", recipe.dependencies.first().cloned().unwrap_or_default()),
        };
        rows.push(vec![renderer.name.into(), details.title.clone(), details.licence.clone(), state]);
    }
    match as_json {
        true => print_json(&documents),
        false => print(&aligned(&rows)),
    }
}

/// Columns aligned to the left.
fn aligned(rows: &[Vec<String>]) -> String {
    let width = |c: usize| rows.iter().map(|row| row[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    let padded = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
        vec![cells.collect::<Vec<_>>().join("  ")]
    };
    table(&rows.iter().map(padded).collect::<Vec<_>>())
}

fn recipe(renderer: &Bundled) -> anyhow::Result<Recipe> {
    Recipe::read(renderer.text).map_err(anyhow::Error::msg).with_context(|| renderer.file.to_owned())
}

fn install(names: &[String]) -> anyhow::Result<()> {
    let installations = Installations::of_user()?;
    let wanted = names.iter().map(|name| Bundled::find(name)).collect::<Result<Vec<_>, _>>()?;
    let stopped = interruption()?;
    for renderer in wanted {
        let progress = spinner(&format!("installing {}", renderer.name));
        let observe = |what: &str| progress.set_message(format!("{}: {what}", renderer.name));
        installations.install(renderer, &observe, &|| stopped.load(Ordering::Relaxed))?;
        progress.finish_and_clear();
        eprintln!("{} is installed", renderer.name);
    }
    Ok(())
}

fn remove(names: &[String]) -> anyhow::Result<()> {
    let installations = Installations::of_user()?;
    for name in names {
        let was_there = installations.remove(Bundled::find(name)?)?;
        eprintln!("{name} {}", if was_there { "is removed" } else { "was not installed" });
    }
    Ok(())
}

fn check_renderer(args: &CheckArgs) -> anyhow::Result<()> {
    if let Some(unknown) = args.only.iter().find(|name| !CHECK_NAMES.contains(&name.as_str())) {
        return Err(Usage(format!("check '{unknown}' is unknown; use {}", CHECK_NAMES.join(", "))).into());
    }
    let is_command = args.renderer.contains(|c: char| c.is_whitespace() || c == '/' || c == '\\');
    let launch = if is_command { launch_command(&args.renderer)? } else { launch(&args.renderer, &[])? };
    if let Some(folder) = &args.output {
        create_folder(folder)?;
    }
    let options = CheckOptions {
        samples: args.samples,
        size: args.size as usize,
        time_limit: Duration::from_secs(args.time_limit),
        log: args.log.clone(),
        only: args.only.clone(),
    };
    let stopped = interruption()?;
    let stop = Arc::new(move || stopped.load(Ordering::Relaxed));
    let progress = spinner(&format!("checking {}", args.renderer));
    let observe = |finding: &Finding| {
        if !args.json.json {
            progress.suspend(|| print(&described(finding)).ok());
        }
    };
    let report = check(&launch, &options, stop, &observe)?;
    progress.finish_and_clear();
    if args.json.json {
        print_json(&report)?;
    }
    if let Some(folder) = &args.output {
        write_check(&report, folder)?;
    }
    match (report.count(Outcome::Failed), report.findings.len()) {
        (0, _) => Ok(()),
        (failed, all) => anyhow::bail!("{}: {failed} of {all} checks failed", report.renderer),
    }
}

/// A line for a check, and what to know of one that found something. All numbers stand in the report.
fn described(finding: &Finding) -> String {
    let is_telling = |number: &&Number| !number.is_within() || finding.outcome != Outcome::Failed;
    let telling = finding.numbers.iter().filter(is_telling).take(3);
    let numbers: Vec<String> = telling.map(Number::to_string).collect();
    let head = format!("{:<11}  {:<11}  {}", finding.outcome.to_string(), finding.check, numbers.join("; "));
    let remarks = finding.remarks.iter().map(|remark| format!("\n             {remark}"));
    format!("{}{}\n", head.trim_end(), remarks.collect::<String>())
}

/// Everything that was found, as text, as JSON and as pictures.
fn write_check(report: &CheckReport, folder: &Path) -> anyhow::Result<()> {
    let mut text = format!("{}\n", report.renderer);
    for finding in &report.findings {
        text += &format!("\n{}: {} ({})\n", finding.check, finding.outcome, finding.about);
        for line in finding.numbers.iter().map(Number::to_string).chain(finding.remarks.iter().cloned()) {
            text += &format!("  {line}\n");
        }
        for picture in &finding.pictures {
            text += &format!("  {0}.png: what came, what was expected, the difference\n", picture.name);
            let path = folder.join(format!("{}.png", picture.name));
            lookmatch_imaging::write(&path, &picture.image, &[])?;
        }
    }
    let write = |name: &str, content: String| {
        let path = folder.join(name);
        std::fs::write(&path, content).with_context(|| format!("cannot write '{}'", path.display()))
    };
    write("report.txt", text)?;
    write("result.json", serde_json::to_string_pretty(report)? + "\n")
}
