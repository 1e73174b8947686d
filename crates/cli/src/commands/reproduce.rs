//! `lookmatch reproduce`: the paper's experiments, and a report of them.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use indicatif::ProgressBar;
use lookmatch_reproduce::{
    Environment, Experiment, Run, Setting, Watch, by_name, experiments, keep, kept, text, write,
};

use crate::Usage;
use crate::args::ReproduceArgs;
use crate::bench::machine::Machine;
use crate::commands::{create_folder, interruption};
use crate::output::{bar, print, print_json, spinner};
use crate::transport::cache;

/// The name that stands for all experiments.
const ALL: &str = "all";

pub(crate) fn run(args: &ReproduceArgs) -> anyhow::Result<()> {
    let Some(name) = &args.name else { return print(&list()) };
    let wanted = wanted(name)?;
    let folder = &args.output;
    create_folder(folder)?;
    let stopped = interruption()?;
    let environment = environment(args, name);
    let setting = Setting { is_quick: args.quick, seed: args.seed, folder: folder.clone(), cache: cache() };
    let mut reports = Vec::new();
    for (k, experiment) in wanted.iter().enumerate() {
        let headline = format!("{} ({} of {})", experiment.name, k + 1, wanted.len());
        if let Some(report) = kept(experiment.name, &environment, folder, &|text| eprintln!("note: {text}")) {
            eprintln!("{headline}: found from an earlier run");
            reports.push(report);
            continue;
        }
        let shown = Shown::new(&headline, &stopped);
        let report = experiment.run(&setting, &shown);
        shown.finish();
        let report = report.with_context(|| experiment.name)?;
        eprintln!("{headline}: {:.1} s", report.seconds);
        keep(&report, &environment, folder)?;
        reports.push(report);
    }
    let run = Run { environment, reports };
    write(&run, folder)?;
    if args.json.json {
        return print_json(&run);
    }
    print(&text(&run))?;
    eprintln!("report in {}", folder.join("index.html").display());
    Ok(())
}

/// The experiments of a name.
fn wanted(name: &str) -> anyhow::Result<Vec<&'static Experiment>> {
    if name == ALL {
        return Ok(experiments().iter().collect());
    }
    let unknown = || {
        let names: Vec<&str> = experiments().iter().map(|e| e.name).collect();
        Usage(format!("there is no experiment '{name}'; there are {} and {ALL}", names.join(", ")))
    };
    Ok(vec![by_name(name).ok_or_else(unknown)?])
}

/// What there is to reproduce.
fn list() -> String {
    let width = experiments().iter().map(|e| e.name.len()).max().unwrap_or(0);
    let line = |e: &Experiment| format!("{:width$}  {}\n{:width$}  {}\n", e.name, e.about, "", e.reproduces);
    experiments().iter().map(line).collect::<String>() + &format!("{ALL:width$}  all of them\n")
}

fn environment(args: &ReproduceArgs, name: &str) -> Environment {
    let machine = Machine::this();
    let quick = if args.quick { " --quick" } else { "" };
    Environment {
        program: concat!("lookmatch ", env!("CARGO_PKG_VERSION")).into(),
        command: format!(
            "lookmatch reproduce {name}{quick} --seed {} -o {}",
            args.seed,
            args.output.display()
        ),
        seed: args.seed,
        is_quick: args.quick,
        machine: format!("{}, {} cores, {}", machine.cpu, machine.cores, machine.system),
    }
}

/// A bar for the part of an experiment that is being worked on.
struct Shown<'a> {
    headline: &'a str,
    stopped: &'a AtomicBool,
    bar: Mutex<ProgressBar>,
}

impl<'a> Shown<'a> {
    fn new(headline: &'a str, stopped: &'a AtomicBool) -> Self {
        Self { headline, stopped, bar: Mutex::new(spinner(headline)) }
    }

    fn bar(&self) -> std::sync::MutexGuard<'_, ProgressBar> {
        self.bar.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn finish(&self) {
        self.bar().finish_and_clear();
    }
}

impl Watch for Shown<'_> {
    fn begin(&self, what: &str, steps: usize) {
        let text = format!("{}: {what}", self.headline);
        let next = if steps == 0 { spinner(&text) } else { bar(steps, &text) };
        std::mem::replace(&mut *self.bar(), next).finish_and_clear();
    }

    fn advance(&self, steps: usize) {
        self.bar().inc(steps as u64);
    }

    fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}
