//! Probes that experiments need: searched once, and kept in the run's folder.

use std::time::Instant;

use anyhow::Context;
use lookmatch_remap::{Event, Plan, Probe, Stage, journal_path, remap};

use crate::{Setting, Watch};

/// A probe and the time that its search took.
pub(crate) struct Found {
    pub(crate) probe: Probe,
    /// Seconds, without the preparation of the light; of the last part alone where the search was interrupted.
    pub(crate) seconds: f64,
}

/// The probe of a plan under a name: that of an earlier experiment if it is there.
///
/// # Errors
/// A failed search, a stop from outside, a file that cannot be written.
pub(crate) fn found(setting: &Setting, watch: &dyn Watch, name: &str, plan: &Plan) -> anyhow::Result<Found> {
    let folder = setting.folder.join("probes");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make '{}'", folder.display()))?;
    let (path, clock) = (folder.join(format!("{name}.json")), folder.join(format!("{name}.seconds")));
    let kept = || {
        let probe = Probe::read(&path).ok().filter(|probe| is_of(probe, plan))?;
        Some(Found { probe, seconds: std::fs::read_to_string(&clock).ok()?.trim().parse().ok()? })
    };
    if let Some(found) = kept() {
        return Ok(found);
    }
    watch.begin(&format!("light of {name}"), 0);
    let stage = Stage::cached(plan, &setting.cache, &|_| ())?;
    let total = plan.source_axes.iter().map(|axis| axis.len()).product();
    watch.begin(&format!("matching {name}"), total);
    let mut done = 0;
    let mut observe = |event: Event| {
        if let Event::Resumed { done: now } | Event::Point { done: now, .. } = event {
            watch.advance(now - done);
            done = now;
        }
    };
    let started = Instant::now();
    let probe = remap(plan, &stage, Some(&journal_path(&path)), &mut observe, &|| watch.is_stopped())?;
    let seconds = started.elapsed().as_secs_f64();
    probe.write(&path)?;
    lookmatch_imaging::write_atomically(&clock, |out| write!(out, "{seconds}"))?;
    Ok(Found { probe, seconds })
}

/// Whether a probe is what a plan would find.
fn is_of(probe: &Probe, plan: &Plan) -> bool {
    let program = concat!("lookmatch ", env!("CARGO_PKG_VERSION"));
    probe.program == program
        && (&probe.from, &probe.to) == (&plan.from, &plan.to)
        && (&probe.source_axes, &probe.target_axes) == (&plan.source_axes, &plan.target_axes)
        && (probe.strategy, &probe.search, probe.refined) == (plan.strategy, &plan.search, plan.refine)
        && probe.preset == plan.preset
        && (probe.seed, probe.size, probe.metric.mask) == (plan.seed, plan.size, plan.mask)
        && probe.metric.weights == plan.metric.weights
}
