//! `lookmatch renderers`: which other renderers there are, and their installation.

use std::sync::atomic::Ordering;

use anyhow::Context;
use lookmatch_renderers::{BUNDLED, Bundled, Installations, Recipe, State};
use serde_json::json;

use crate::args::{RenderersArgs, RenderersCommand};
use crate::output::{print, print_json, spinner, table};
use crate::renderers::interruption;

pub(crate) fn run(args: &RenderersArgs) -> anyhow::Result<()> {
    match &args.command {
        None => list(args.json.json),
        Some(RenderersCommand::Install { names }) => install(names),
        Some(RenderersCommand::Remove { names }) => remove(names),
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
