//! Every model to every other: how good the probe of a pair is beside copying parameters.

use lookmatch_materials::Model;
use serde::{Deserialize, Serialize};

use crate::losses::{LossClass, losses};
use crate::{Baseline, Event, Options, Plan, RemapError, Stage, remap};

/// The outcome for one ordered pair of models. NRMSDs are those of the reference scene under its environment, averaged
/// over source points and channels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairScore {
    /// Source model.
    pub from: String,
    /// Target model.
    pub to: String,
    /// Source points.
    pub points: usize,
    /// Of them, those with a target parameter on the edge of its range.
    pub saturated: usize,
    /// Source parameters that the target cannot show.
    pub lost: Vec<String>,
    /// Whole image, of the probe.
    pub probe: f64,
    /// Whole image, of copied parameters.
    pub copy: f64,
    /// With the radial mask, of the probe.
    pub probe_masked: f64,
    /// With the radial mask, of copied parameters.
    pub copy_masked: f64,
}

/// Remaps one model to another on a stage that is shared with other pairs, and scores the result.
///
/// # Errors
/// As [`remap`].
pub fn score_pair(
    stage: &Stage,
    from: &'static Model,
    to: &'static Model,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<PairScore, RemapError> {
    let plan = Plan::new(from, to, options)?;
    let probe = remap(&plan, stage, None, &mut |_: Event| (), stop)?;
    let mean = |values: &[[f64; 3]]| values.as_flattened().iter().sum::<f64>() / (3 * values.len()) as f64;
    let (mut copy, mut copy_masked) = (Vec::new(), Vec::new());
    for entry in &probe.entries {
        let source = plan.source_material(&entry.source)?;
        let Some(target) = Baseline::Copy.apply(&source, &plan.to)? else { continue };
        let [whole, masked] = stage.nrmsd(&source, &target)?;
        copy.push(whole);
        copy_masked.push(masked);
    }
    let lost = losses(&probe)?.into_iter().filter(|loss| loss.class == LossClass::Lost);
    Ok(PairScore {
        from: from.name.into(),
        to: to.name.into(),
        points: probe.entries.len(),
        saturated: probe.entries.iter().filter(|e| !e.saturated.is_empty()).count(),
        lost: lost.map(|loss| loss.parameter.into()).collect(),
        probe: mean(&probe.entries.iter().map(|e| e.nrmsd).collect::<Vec<_>>()),
        copy: mean(&copy),
        probe_masked: mean(&probe.entries.iter().map(|e| e.nrmsd_masked).collect::<Vec<_>>()),
        copy_masked: mean(&copy_masked),
    })
}
