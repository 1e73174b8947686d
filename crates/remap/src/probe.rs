//! The probe file: JSON, versioned, documented in `docs/probe-format.md`.

use std::path::Path;

use lookmatch_imaging::{FitnessWeights, Reduce, Space, write_atomically};
use lookmatch_materials::Material;
use lookmatch_rendering::Scene;
use lookmatch_search::Axis;
use serde::{Deserialize, Serialize};

use crate::carry::{Body, SourceLook, carry_over};
use crate::fit::Fit;
use crate::options::{Pair, Preset, Strategy};
use crate::plan::Plan;
use crate::studio::{RendererRecord, Sampling};
use crate::synthesis::SynthesisRecord;
use crate::verdict_map::VerdictMap;
use crate::{RemapError, plan};

/// Version of the file format that is written; older ones are read, newer ones refused.
const VERSION: u32 = 1;
const FORMAT: &str = "lookmatch-probe";

/// A BRDF Difference Probe: for each tabulated source point, the target parameters that look most like it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Probe {
    /// `lookmatch-probe`.
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Program and version that wrote the file.
    pub program: String,
    /// Source model with the parameters that did not vary.
    pub from: Material,
    /// Target model with the parameters that were not searched.
    pub to: Material,
    /// Tabulated source parameters, the slowest first.
    pub source_axes: Vec<Axis>,
    /// Searched target parameters.
    pub target_axes: Vec<Axis>,
    /// Target parameters that took nothing over from the source, because the user fixed them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub held: Vec<String>,
    /// How neighbours were used.
    pub strategy: Strategy,
    /// Search method.
    pub search: String,
    /// Target ranges; null in the file where there is no preset, but never absent.
    #[serde(deserialize_with = "Option::deserialize")]
    pub preset: Option<Preset>,
    /// Seed.
    pub seed: u64,
    /// Which target parameters followed which source parameters, where roles did not decide.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<Pair>,
    /// True where targets may lie between the levels of the target axes.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub refined: bool,
    /// What was minimised.
    pub metric: Metric,
    /// The scene that was compared.
    pub scene: Scene,
    /// Side of its pictures in pixels.
    pub size: usize,
    /// Samples of the pictures of other renderers, where there are some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Sampling>,
    /// Those renderers, with all that is needed to read their materials.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub renderers: Vec<RendererRecord>,
    /// Sums over the whole remap.
    pub totals: Totals,
    /// How it came about, where no search found it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub derived: Option<Derived>,
    /// Its smooth form, where it was fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<Fit>,
    /// What people would say to its targets, where they were judged: a map for each light.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub verdicts: Vec<VerdictMap>,
    /// One entry per source point, in lexicographic order of the source axes.
    pub entries: Vec<Entry>,
}

/// How a probe came about that no search found. Its target values lie between the levels of its target axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Derived {
    /// From what.
    pub kind: DerivedKind,
    /// The probes that it was made of, as `MODEL -> MODEL`.
    pub of: Vec<String>,
    /// True where fitness and NRMSD were measured for its own entries; else they are sums of those of the probes, which they
    /// cannot exceed by much (the fitness cannot exceed them at all where both were found in one scene).
    pub measured: bool,
    /// Of an inverse: what is left of the original source parameters after there and back, over the original entries.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub round_trip: Vec<RoundTrip>,
    /// Places of entries whose source no target can show: theirs is the nearest.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unreachable: Vec<usize>,
}

/// What a probe is derived from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DerivedKind {
    /// One probe, backwards.
    Inverse,
    /// Two probes, one after the other.
    Composition,
}

/// Error of one parameter after there and back, in its unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoundTrip {
    /// The parameter.
    pub name: String,
    /// Mean absolute difference.
    pub mean: f64,
    /// Largest.
    pub max: f64,
    /// Entries that were sent there and back: those that have a result within the functions' domain.
    pub entries: usize,
}

/// What makes an entry less than sure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Flag {
    /// There is no result.
    Failed,
    /// A target parameter sits on the edge of its range.
    Saturated,
    /// Another target is as good within noise.
    BelowNoise,
    /// It carried no weight in the fit of some parameter.
    OutsideFit,
    /// No target shows its source: this is the nearest one (inverses only).
    Unreachable,
}

/// Identity of the metric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// `guarnera-2018-eq3`.
    pub name: String,
    /// Colour space of the differences.
    pub space: Space,
    /// How pixel differences become one number.
    pub reduce: Reduce,
    /// True where the sphere's middle weighed more than its silhouette.
    pub mask: bool,
    /// Weights of the four image pairs.
    pub weights: FitnessWeights,
}

/// Cost of a remap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// Distinct target points compared with a source, summed over sources.
    pub evaluations: usize,
    /// Points of the target lattice.
    pub lattice_points: usize,
    /// Distinct target materials that were rendered for these comparisons; absent in older files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rendered: Option<usize>,
    /// How far synthesised pictures could be trusted, where there were any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub synthesis: Option<SynthesisRecord>,
}

impl Totals {
    /// Of a probe that no search found.
    pub(crate) fn derived(target_axes: &[Axis]) -> Self {
        let lattice_points = target_axes.iter().map(Axis::len).product();
        Self { evaluations: 0, lattice_points, rendered: None, synthesis: None }
    }
}

/// The result for one source point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Values of the source axes.
    pub source: Vec<f64>,
    /// Values of the target axes.
    pub target: Vec<f64>,
    /// Eq. 3 between both, 0 for equal looks.
    pub fitness: f64,
    /// NRMSD per channel of the reference scene's environment picture, whole image.
    pub nrmsd: [f64; 3],
    /// The same with the radial mask.
    pub nrmsd_masked: [f64; 3],
    /// Distinct target points compared.
    pub evaluations: usize,
    /// Target parameters that sit on the edge of their range, so that a better match may lie beyond.
    pub saturated: Vec<String>,
    /// The colour of the target's body divided by that of the source's, where pictures told it and no formula.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<[f64; 3]>,
    /// What noise leaves unknown, where there was some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// Why there is no result: then `target` is empty, and nothing else counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

/// What noise leaves unknown of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Standard error of the fitness.
    pub fitness: f64,
    /// NRMSD that two pictures of one material would have, per channel.
    pub nrmsd: [f64; 3],
    /// True where the target is clearly better than all others that were compared.
    #[serde(rename = "decided")]
    pub is_decided: bool,
}

impl Entry {
    /// The entry of a source point that could not be rendered.
    pub(crate) fn failed(source: Vec<f64>, reason: String) -> Self {
        Self {
            source,
            target: Vec::new(),
            fitness: 0.0,
            nrmsd: [0.0; 3],
            nrmsd_masked: [0.0; 3],
            evaluations: 0,
            saturated: Vec::new(),
            body: None,
            noise: None,
            failed: Some(reason),
        }
    }
}

impl Probe {
    pub(crate) fn new(plan: &Plan, entries: Vec<Entry>, lattice_points: usize) -> Self {
        let evaluations = entries.iter().map(|e| e.evaluations).sum();
        Self {
            format: FORMAT.into(),
            version: VERSION,
            program: concat!("lookmatch ", env!("CARGO_PKG_VERSION")).into(),
            from: plan.from.clone(),
            to: plan.to.clone(),
            source_axes: plan.source_axes.clone(),
            target_axes: plan.target_axes.clone(),
            held: plan.held.clone(),
            strategy: plan.strategy,
            search: plan.search.clone(),
            preset: plan.preset,
            seed: plan.seed,
            pairs: plan.pairs.clone(),
            refined: plan.refine,
            metric: Metric {
                name: "guarnera-2018-eq3".into(),
                space: plan.metric.space,
                reduce: plan.metric.reduce,
                mask: plan.mask,
                weights: plan.metric.weights,
            },
            scene: plan.scene.clone(),
            size: plan.size,
            sampling: plan.sampling,
            renderers: plan.renderers.clone(),
            totals: Totals { evaluations, lattice_points, rendered: None, synthesis: None },
            derived: None,
            fit: None,
            verdicts: Vec::new(),
            entries,
        }
    }

    /// Reads a probe file and checks that it is whole.
    ///
    /// # Errors
    /// A file that is missing, no probe, of a newer version, lacks a field, or contradicts itself.
    pub fn read(path: &Path) -> Result<Self, RemapError> {
        let wrong = |reason: String| RemapError::Probe { path: path.to_owned(), reason };
        let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
        let json: serde_json::Value =
            serde_json::from_str(&text).map_err(|e| wrong(format!("it is not JSON: {e}")))?;
        if json.get("format").and_then(|f| f.as_str()) != Some(FORMAT) {
            return Err(wrong(format!("the field 'format' is not \"{FORMAT}\"")));
        }
        match json.get("version").and_then(serde_json::Value::as_u64) {
            Some(version) if (1..=u64::from(VERSION)).contains(&version) => {}
            Some(version) => {
                let known = format!("this program reads versions up to {VERSION}; update it");
                return Err(wrong(format!("its format version is {version}, {known}")));
            }
            None => return Err(wrong("the field 'version' is missing or no number".into())),
        }
        adopt_models(&json).map_err(wrong)?;
        let probe: Self = serde_path_to_error::deserialize(json).map_err(|e| wrong(e.to_string()))?;
        probe.check().map_err(wrong)?;
        Ok(probe)
    }

    /// Writes the file, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), RemapError> {
        let failed = |source| RemapError::Write { path: path.to_owned(), source };
        let text = serde_json::to_string_pretty(self).map_err(|e| failed(e.into()))?;
        write_atomically(path, |out| out.write_all(text.as_bytes())).map_err(failed)
    }

    /// The entry at indices of the source axes.
    pub fn entry(&self, indices: &[usize]) -> &Entry {
        &self.entries[self.place(indices)]
    }

    /// The place of the entry at indices of the source axes.
    pub(crate) fn place(&self, indices: &[usize]) -> usize {
        indices.iter().zip(&self.source_axes).fold(0, |sum, (i, axis)| sum * axis.len() + i)
    }

    /// What makes the entry at a place less than sure.
    pub fn flags(&self, place: usize) -> Vec<Flag> {
        let entry = &self.entries[place];
        let parameters = self.fit.iter().flat_map(|fit| &fit.parameters);
        let is_outside = parameters.into_iter().any(|p| p.outside.contains(&place));
        let is_unreachable = self.derived.as_ref().is_some_and(|d| d.unreachable.contains(&place));
        let is_noisy = entry.noise.is_some_and(|noise| !noise.is_decided);
        let flags = [
            (entry.failed.is_some(), Flag::Failed),
            (!entry.saturated.is_empty(), Flag::Saturated),
            (is_noisy, Flag::BelowNoise),
            (is_outside, Flag::OutsideFit),
            (is_unreachable, Flag::Unreachable),
        ];
        flags.into_iter().filter(|(is_set, _)| *is_set).map(|(_, flag)| flag).collect()
    }

    /// Indices of the source axes of the entry at a place.
    pub(crate) fn indices(&self, mut place: usize) -> Vec<usize> {
        let mut indices: Vec<usize> = (self.source_axes.iter().rev())
            .map(|axis| {
                let index = place % axis.len();
                place /= axis.len();
                index
            })
            .collect();
        indices.reverse();
        indices
    }

    /// The source material of an entry.
    pub fn source_material(&self, values: &[f64]) -> Result<Material, RemapError> {
        plan::material(&self.from, &self.source_axes, values)
    }

    /// The entries that have a result.
    pub fn found(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter().filter(|entry| entry.failed.is_none())
    }

    /// The target material for values of the target axes, beside a source material; `body` is what an entry says of it.
    pub fn target_material(
        &self,
        source: &Material,
        values: &[f64],
        body: Option<[f64; 3]>,
    ) -> Result<Material, RemapError> {
        let mut target = plan::material(&self.to, &self.target_axes, values)?;
        let source = SourceLook::new(source);
        let taken = (&self.target_axes[..], &self.held[..]);
        carry_over(&source, &mut target, taken, body.map_or(Body::Matched, Body::Scaled))?;
        Ok(target)
    }

    /// What must hold beyond the types: sizes agree, names exist, numbers are finite.
    fn check(&self) -> Result<(), String> {
        for (material, axes, side) in
            [(&self.from, &self.source_axes, "source"), (&self.to, &self.target_axes, "target")]
        {
            // A source without axes is one material.
            if axes.is_empty() && side == "target" {
                return Err(format!("the field '{side}_axes' is empty"));
            }
            for axis in axes {
                material.model().resolve(&axis.name).map_err(|e| format!("{side}_axes: {e}"))?;
            }
        }
        let expected: usize = self.source_axes.iter().map(Axis::len).product();
        if self.entries.len() != expected {
            return Err(format!(
                "it has {} entries where its axes have {expected} points",
                self.entries.len()
            ));
        }
        for (place, entry) in self.entries.iter().enumerate() {
            let finite = |v: &[f64], n: usize| v.len() == n && v.iter().all(|x| x.is_finite());
            let has_target = entry.failed.is_none();
            let targets = if has_target { self.target_axes.len() } else { 0 };
            let sound = finite(&entry.source, self.source_axes.len())
                && finite(&entry.target, targets)
                && entry.body.is_none_or(|body| finite(&body, 3))
                && entry.fitness.is_finite();
            if !sound {
                return Err(format!("entry {place} lacks a value or holds one that is not finite"));
            }
            if has_target {
                let target = self.target_material(&self.from, &entry.target, entry.body);
                target.map_err(|e| format!("entry {place}: {e}"))?;
            }
            if self
                .indices(place)
                .iter()
                .zip(&self.source_axes)
                .map(|(i, a)| a.value(*i))
                .ne(entry.source.iter().copied())
            {
                return Err(format!("entry {place} is of the source point {:?}, out of order", entry.source));
            }
            let is_on = |(axis, v): (&Axis, &f64)| match self.derived {
                None if !self.refined => axis.index_of(*v).is_some(),
                _ => (axis.value(0)..=axis.value(axis.len() - 1)).contains(v),
            };
            let on_lattice = self.target_axes.iter().zip(&entry.target).all(is_on);
            if !on_lattice {
                return Err(format!("entry {place}: the target {:?} is off the target axes", entry.target));
            }
        }
        if let Some(place) = self.derived.iter().flat_map(|d| &d.unreachable).find(|p| **p >= expected) {
            return Err(format!("the field 'derived' speaks of entry {place}, which is not there"));
        }
        for (k, map) in self.verdicts.iter().enumerate() {
            map.check(self).map_err(|e| format!("the field 'verdicts[{k}]': {e}"))?;
        }
        self.fit.as_ref().map_or(Ok(()), |fit| fit.check(self))
    }
}

/// Makes the models of other renderers known that a probe speaks of: it can be read without them.
fn adopt_models(probe: &serde_json::Value) -> Result<(), String> {
    let Some(records) = probe.get("renderers") else { return Ok(()) };
    let records: Vec<RendererRecord> =
        serde_json::from_value(records.clone()).map_err(|e| format!("renderers: {e}"))?;
    for record in records {
        for model in record.models {
            model.adopt(&record.name).map_err(|e| e.to_string())?;
        }
    }
    Ok(())
}
