//! The `lookmatch` program: a thin face over the libraries.
//!
//! Results go to standard output, messages and progress to standard error. Exit code 0 is success, 2 a request that makes
//! no sense, 1 a failure to carry it out.

mod args;
mod bench;
mod commands;
mod judgement;
mod output;
mod plot;
mod renderers;
mod report;
mod transport;

use std::process::ExitCode;

use mimalloc::MiMalloc;

use clap::Parser;

use args::{Arguments, Command};
use lookmatch_export::ExportError;
use lookmatch_materials::MaterialError;
use lookmatch_remap::RemapError;
use lookmatch_renderers::InstallationError;
use lookmatch_textures::TextureError;

/// Pictures come and go by the thousand. This allocator keeps their memory; the system's hands it back to the kernel, and
/// every page of the next picture costs a fault again.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(arguments.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", message(&error));
            ExitCode::from(exit_code(&error))
        }
    }
}

fn run(command: Command) -> anyhow::Result<()> {
    match command {
        Command::Models(args) => commands::models::run(&args),
        Command::Eval(args) => commands::eval::run(&args),
        Command::Render(args) => commands::render::run(&args),
        Command::Renderers(args) => commands::renderers::run(&args),
        Command::Remap(args) => commands::remap::run(&args),
        Command::Apply(args) => commands::apply::run(&args),
        Command::Pairs(args) => commands::pairs::run(&args),
        Command::Cross(args) => commands::cross::run(&args),
        Command::Inspect(args) => commands::inspect::run(&args),
        Command::Fit(args) => commands::fit::run(&args),
        Command::Invert(args) => commands::invert::run(&args),
        Command::Compose(args) => commands::compose::run(&args),
        Command::Export(args) => commands::export::run(&args),
        Command::Compare(args) => commands::compare::run(&args),
        Command::Validate(args) => commands::validate::run(&args),
        Command::Bench(args) => commands::bench::run(&args),
        Command::Scene(args) => commands::scene::run(&args),
        Command::Cache(args) => commands::cache::run(&args),
        Command::Lint(args) => commands::lint::run(&args),
        Command::Match(args) => commands::match_pictures::run(&args),
    }
}

/// An error with its causes, but for those that it quotes already.
fn message(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |text, cause| {
        let cause = cause.to_string();
        if text.contains(&cause) { text } else { format!("{text}: {cause}") }
    })
}

/// A request that makes no sense, as opposed to one that failed.
#[derive(Debug)]
struct Usage(String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

fn exit_code(error: &anyhow::Error) -> u8 {
    let usage = error.is::<Usage>()
        || error
            .downcast_ref::<InstallationError>()
            .is_some_and(|e| matches!(e, InstallationError::Unknown { .. }))
        || error.downcast_ref::<MaterialError>().is_some_and(MaterialError::is_usage)
        || error.downcast_ref::<RemapError>().is_some_and(RemapError::is_usage)
        || error.downcast_ref::<ExportError>().is_some_and(ExportError::is_usage)
        || error.downcast_ref::<TextureError>().is_some_and(TextureError::is_usage);
    if usage { 2 } else { 1 }
}
