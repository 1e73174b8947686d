//! What pictures say of a fit: a sample of the entries, rendered with the values of each form.

use lookmatch_imaging::nrmsd;
use lookmatch_materials::Material;
use lookmatch_rendering::Observe;
use lookmatch_rendering::{Part, TransportCache};
use serde::{Deserialize, Serialize};

use super::{Fit, FitForm};
use crate::options::AUTO;
use crate::{Plan, Probe, RemapError, Stage, validation_points};

/// A form is given up if the mean NRMSD of its pictures exceeds the table's by this factor and this much.
const WORSE: f64 = 1.1;
const MORE: f64 = 5e-4;

/// Mean NRMSD between pictures of source and target in the reference scene under its environment, over entries and channels; masked
/// where the probe's metric was.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rerendered {
    /// Entries that were rendered.
    pub points: usize,
    /// Side of the pictures in pixels.
    pub size: usize,
    /// True where the radial mask weighed the differences.
    pub masked: bool,
    /// With the table's values.
    pub table: f64,
    /// With all values as [`crate::apply_smoothly()`] takes them.
    pub fit: f64,
    /// With closed forms wherever there are some; absent where there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closed: Option<f64>,
    /// With local regressions wherever there are some; absent where there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub local: Option<f64>,
}

impl Stage {
    /// Prepares the scene that a probe was found in.
    ///
    /// # Errors
    /// Models of other renderers, and a metric or a scene that cannot be.
    pub fn of_probe(probe: &Probe, cache: &TransportCache, observe: Observe) -> Result<Self, RemapError> {
        [&probe.from, &probe.to].into_iter().try_for_each(RemapError::check_ours)?;
        let metric = lookmatch_imaging::Fitness {
            space: probe.metric.space,
            reduce: probe.metric.reduce,
            weights: probe.metric.weights,
        };
        let plan = Plan {
            from: probe.from.clone(),
            to: probe.to.clone(),
            source_axes: probe.source_axes.clone(),
            target_axes: probe.target_axes.clone(),
            strategy: probe.strategy,
            search: AUTO.into(),
            held: probe.held.clone(),
            preset: probe.preset,
            seed: probe.seed,
            metric,
            pairs: Vec::new(),
            refine: false,
            mask: probe.metric.mask,
            scene: probe.scene.clone(),
            size: probe.size,
            sampling: None,
            renderers: Vec::new(),
        };
        Self::cached(&plan, cache, observe)
    }
}

/// An entry with its source picture's material and its values.
struct Sample<'a> {
    probe: &'a Probe,
    place: usize,
    source: Material,
}

impl Sample<'_> {
    /// The target with some values replaced.
    fn target(&self, replaced: &[Option<f64>]) -> Result<Material, RemapError> {
        let entry = &self.probe.entries[self.place];
        let values: Vec<f64> =
            entry.target.iter().zip(replaced).map(|(own, new)| new.unwrap_or(*own)).collect();
        self.probe.target_material(&self.source, &values, entry.body)
    }
}

impl Fit {
    /// Renders up to `count` entries, evenly spread, with the values of each form, writes what their pictures leave into the
    /// residuals, and gives up forms whose pictures are worse than the table's. `observe` is told of each entry.
    ///
    /// # Errors
    /// Where a material cannot be made.
    pub fn rerender(
        &mut self,
        probe: &Probe,
        stage: &Stage,
        count: usize,
        observe: &mut dyn FnMut(),
    ) -> Result<(), RemapError> {
        let places = validation_points(probe, Some(count));
        let samples = places.into_iter().filter(|place| probe.entries[*place].failed.is_none());
        let samples = samples
            .map(|place| {
                Ok(Sample { probe, place, source: probe.source_material(&probe.entries[place].source)? })
            })
            .collect::<Result<Vec<_>, RemapError>>()?;
        let n = self.parameters.len();
        if samples.is_empty() {
            return Ok(());
        }
        // The table, each parameter by each form, all closed forms, all local regressions.
        let mut sums = vec![0.0; 3 + 2 * n];
        for sample in &samples {
            let source = &probe.entries[sample.place].source;
            let of = |form: FitForm| -> Vec<Option<f64>> { self.values(form, probe, source) };
            let (closed, local) = (of(FitForm::Closed), of(FitForm::Local));
            let alone = |values: &Vec<Option<f64>>, k: usize| -> Vec<Option<f64>> {
                (0..n).map(|i| values[i].filter(|_| i == k)).collect()
            };
            let mut replaced = vec![vec![None; n]];
            replaced.extend((0..n).flat_map(|k| [alone(&closed, k), alone(&local, k)]));
            replaced.extend([closed, local]);
            let targets = replaced.iter().map(|r| sample.target(r)).collect::<Result<Vec<_>, _>>()?;
            for (sum, error) in sums.iter_mut().zip(errors(stage, probe, &sample.source, &targets)?) {
                *sum += error;
            }
            observe();
        }
        sums.iter_mut().for_each(|sum| *sum /= samples.len() as f64);
        self.judge(&sums);
        let mut rerendered = Rerendered {
            points: samples.len(),
            size: stage.size(),
            masked: probe.metric.mask,
            table: sums[0],
            fit: 0.0,
            closed: self.parameters.iter().any(|p| p.closed.is_some()).then_some(sums[2 * n + 1]),
            local: self.parameters.iter().any(|p| p.local.is_some()).then_some(sums[2 * n + 2]),
        };
        for sample in &samples {
            let values = self.evaluate(probe, &probe.entries[sample.place].source);
            rerendered.fit += errors(stage, probe, &sample.source, &[sample.target(&values)?])?[0];
        }
        rerendered.fit /= samples.len() as f64;
        self.rerendered = Some(rerendered);
        Ok(())
    }

    /// Values of one form, where it exists.
    fn values(&self, form: FitForm, probe: &Probe, source: &[f64]) -> Vec<Option<f64>> {
        let candidate = |p: &super::ParameterFit| match form {
            FitForm::Closed => p.closed.as_ref().map(|c| c.function.at(probe, source)),
            _ => p.local.as_ref().map(|c| c.function.at(probe, source)),
        };
        self.parameters.iter().map(candidate).collect()
    }

    /// Keeps the mean errors of each form, and gives up what is worse than the table.
    fn judge(&mut self, means: &[f64]) {
        let limit = WORSE * means[0] + MORE;
        for (k, parameter) in self.parameters.iter_mut().enumerate() {
            let [closed, local] = [1 + 2 * k, 2 + 2 * k].map(|i| means[i]);
            if let Some(candidate) = &mut parameter.closed {
                candidate.residual.nrmsd = Some(closed);
            }
            if let Some(candidate) = &mut parameter.local {
                candidate.residual.nrmsd = Some(local);
            }
            let told = |value: f64| {
                format!("rendered again, its mean NRMSD is {value:.4}, that of the table {:.4}", means[0])
            };
            if parameter.form == FitForm::Closed && closed > limit {
                parameter.form = if parameter.local.is_some() { FitForm::Local } else { FitForm::Table };
                parameter.why = format!("the closed form is worse than the table: {}", told(closed));
            }
            if parameter.form == FitForm::Local && local > limit {
                parameter.form = FitForm::Table;
                parameter.why = format!("no smooth relation is good enough: {}", told(local));
            }
        }
    }
}

/// Mean NRMSD of the channels between a source and each of some targets.
fn errors(
    stage: &Stage,
    probe: &Probe,
    source: &Material,
    targets: &[Material],
) -> Result<Vec<f64>, RemapError> {
    let view = stage.views()[1];
    let materials: Vec<&Material> = std::iter::once(source).chain(targets).collect();
    let images = view.render_batch(&materials, Part::Full);
    let mask = probe.metric.mask.then(|| view.mask());
    let error = |image| Ok(nrmsd(&images[0], image, mask)?.iter().sum::<f64>() / 3.0);
    images[1..].iter().map(error).collect()
}
