//! How experiments are run.

use std::path::PathBuf;

use lookmatch_rendering::TransportCache;

use crate::Report;

/// One of the paper's experiments.
pub struct Experiment {
    /// What it is called on the command line.
    pub name: &'static str,
    /// The paper's section, tables and figures.
    pub reproduces: &'static str,
    /// One line for a list.
    pub about: &'static str,
    /// Runs it.
    pub(crate) run: fn(&Setting, &dyn Watch) -> anyhow::Result<Report>,
}

impl Experiment {
    /// Runs it; the time is put into its report.
    ///
    /// # Errors
    /// What keeps it from its end: a folder that cannot be written, a stop from outside.
    pub fn run(&self, setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
        let start = std::time::Instant::now();
        let mut report = (self.run)(setting, watch)?;
        (report.name, report.reproduces) = (self.name.into(), self.reproduces.into());
        report.seconds = start.elapsed().as_secs_f64();
        Ok(report)
    }
}

/// What all experiments of a run share.
pub struct Setting {
    /// True where everything is small: fewer materials, smaller pictures.
    pub is_quick: bool,
    /// Seed of every random decision.
    pub seed: u64,
    /// Where pictures, probes and the state of remaps go.
    pub folder: PathBuf,
    /// Where prepared light is kept.
    pub cache: TransportCache,
}

impl Setting {
    /// Side of the pictures that judge, in pixels.
    pub(crate) fn size(&self) -> usize {
        if self.is_quick { 128 } else { 300 }
    }
}

/// Who is told how far an experiment is, and may stop it.
pub trait Watch: Sync {
    /// A part of the experiment begins: what, and in how many steps.
    fn begin(&self, what: &str, steps: usize);

    /// Further steps of it are done.
    fn advance(&self, steps: usize);

    /// True where the experiment is to end as soon as it can.
    fn is_stopped(&self) -> bool;
}
