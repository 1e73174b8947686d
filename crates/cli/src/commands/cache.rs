//! `lookmatch cache`: what is in the render database, whether it is intact, and how to make it smaller.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::bail;
use bytesize::ByteSize;
use lookmatch_database::{Collected, Contents, Database, Verified};
use serde_json::json;

use crate::Usage;
use crate::args::{CacheArgs, CacheCommand, Json};
use crate::output::{bar, print, print_json, table};
use crate::transport::renders;

pub(crate) fn run(args: &CacheArgs) -> anyhow::Result<()> {
    let path = renders().ok_or_else(|| {
        Usage("there is no cache: LOOKMATCH_CACHE is off, or the system names no folder for it".into())
    })?;
    let is_damaged = Arc::new(AtomicBool::new(false));
    let flag = is_damaged.clone();
    let warn = move |text: &str| {
        eprintln!("warning: {text}");
        flag.store(true, Ordering::Relaxed);
    };
    // To look at what is not there must not make it.
    let database = if path.exists() { Some(Database::open(&path, Arc::new(warn))?) } else { None };
    match &args.command {
        CacheCommand::List { json } => list(&path, database.as_ref(), json),
        CacheCommand::Verify { json } => {
            verify(&path, database.as_ref(), json)?;
            if is_damaged.load(Ordering::Relaxed) { bail!("the database was damaged") } else { Ok(()) }
        }
        CacheCommand::Gc { max_size, json } => shrink(&path, database.as_ref(), *max_size, json),
    }
}

/// Bytes as people read them: `1.2 MiB`.
fn size(bytes: u64) -> String {
    ByteSize::b(bytes).display().iec().to_string()
}

fn list(path: &Path, database: Option<&Database>, json: &Json) -> anyhow::Result<()> {
    let contents = database.map(Database::list).transpose()?;
    let Contents { groups, pictures, bytes } = contents.unwrap_or_default();
    if json.json {
        return print_json(&json!({ "path": path, "pictures": pictures, "bytes": bytes, "groups": groups }));
    }
    let titles = ["renderer", "worker", "scene", "light", "px", "pictures", "size", "CPU s", "last used"];
    let mut rows = vec![titles.map(str::to_owned).to_vec()];
    for group in &groups {
        rows.push(vec![
            format!("{} {}", group.renderer, group.version),
            group.worker.clone(),
            group.scene.clone(),
            group.light.clone(),
            group.size.to_string(),
            group.pictures.to_string(),
            size(group.bytes),
            format!("{:.1}", group.cpu_s),
            group.last_used.chars().take("2026-01-01 00:00:00".len()).collect(),
        ]);
    }
    let rows = if groups.is_empty() { String::new() } else { table(&rows) + "\n" };
    print(&format!("{rows}{}: {pictures} pictures, {}\n", path.display(), size(bytes)))
}

/// Exit code 1 where anything was damaged.
fn verify(path: &Path, database: Option<&Database>, json: &Json) -> anyhow::Result<()> {
    let progress = bar(0, "verifying");
    let observe = |done, all| {
        progress.set_length(all);
        progress.set_position(done);
    };
    let verified = database.map(|database| database.verify(&observe)).transpose()?.unwrap_or_default();
    progress.finish_and_clear();
    let Verified { pictures, damaged, renewed } = &verified;
    if json.json {
        print_json(&json!({ "path": path, "pictures": pictures, "damaged": damaged, "renewed": renewed }))?;
    } else {
        print(&format!("{}: {pictures} pictures are intact\n", path.display()))?;
    }
    damaged.iter().for_each(|fault| eprintln!("damaged: {fault}"));
    match renewed {
        Some(renewed) => bail!("{renewed}"),
        None if !damaged.is_empty() => {
            bail!(
                "{} damaged pictures were removed; they are rendered again when they are needed",
                damaged.len()
            )
        }
        None => Ok(()),
    }
}

fn shrink(path: &Path, database: Option<&Database>, most: ByteSize, json: &Json) -> anyhow::Result<()> {
    let collected = database.map(|database| database.shrink(most.as_u64())).transpose()?;
    let Collected { removed, removed_bytes, pictures, bytes } = collected.unwrap_or_default();
    if json.json {
        return print_json(&json!({
            "path": path, "removed": removed, "removed_bytes": removed_bytes, "pictures": pictures, "bytes": bytes,
        }));
    }
    print(&format!(
        "{}: {removed} pictures removed ({}), {pictures} left, {}\n",
        path.display(),
        size(removed_bytes),
        size(bytes)
    ))
}
