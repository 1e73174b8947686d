//! What of a probe is fitted: places, values and weights for each target parameter.

use lookmatch_materials::{Material, Role, Scale, Trend};
use lookmatch_search::Axis;

use super::form::Input;
use super::regression::Samples;
use crate::{Entry, Probe, RemapError, Strategy};

/// Weight of an entry whose value sits on the edge of its range: what was found is the nearest that was searched.
const SATURATED: f64 = 0.25;
/// Weight of an entry that another one equals within noise.
const BELOW_NOISE: f64 = 0.5;

/// One target parameter, ready to be fitted.
pub(crate) struct Data {
    pub(crate) name: String,
    /// All source axes.
    pub(crate) inputs: Vec<Input>,
    /// Places of all source axes in `u`.
    pub(crate) levels: Vec<Vec<f64>>,
    /// How the parameter must follow each source axis: 1 rising, −1 falling, 0 unknown.
    pub(crate) signs: Vec<f64>,
    pub(crate) samples: Samples,
    /// Places in the probe of the samples, of entries with less weight, and of those with none.
    pub(crate) places: Vec<usize>,
    pub(crate) light: Vec<usize>,
    pub(crate) outside: Vec<usize>,
    pub(crate) min: f64,
    pub(crate) max: f64,
    pub(crate) is_logarithmic: bool,
    /// Median distance of lattice levels, of their logarithms where these are fitted.
    pub(crate) step: f64,
    /// Levels of the target axis.
    pub(crate) target_levels: usize,
}

impl Data {
    /// What a probe says of the target axis `k`.
    pub(crate) fn new(probe: &Probe, k: usize) -> Result<Self, RemapError> {
        let roles = |material: &Material, axes: &[Axis]| -> Result<Vec<Role>, RemapError> {
            let role = |axis: &Axis| Ok(material.model().parameter(&axis.name)?.role);
            axes.iter().map(role).collect()
        };
        let (from, to) = (roles(&probe.from, &probe.source_axes)?, roles(&probe.to, &probe.target_axes)?);
        let sign = |role: &Role| match role.trend(to[k]) {
            Some(Trend::Rising) if probe.strategy == Strategy::Constrained => 1.0,
            Some(Trend::Falling) if probe.strategy == Strategy::Constrained => -1.0,
            _ => 0.0,
        };
        let input = |axis: &Axis| -> Result<Input, RemapError> {
            let (min, max) = (axis.value(0), axis.value(axis.len() - 1));
            let logarithmic = is_logarithmic(&probe.from, axis)?;
            Ok(Input { name: axis.name.clone(), min, max, logarithmic })
        };
        let inputs = probe.source_axes.iter().map(input).collect::<Result<Vec<Input>, _>>()?;
        let places_of =
            |(axis, input): (&Axis, &Input)| axis.levels.iter().map(|v| input.normalised(*v)).collect();
        let axis = &probe.target_axes[k];
        let is_logarithmic = is_logarithmic(&probe.to, axis)?;
        let mut data = Self {
            name: axis.name.clone(),
            levels: probe.source_axes.iter().zip(&inputs).map(places_of).collect(),
            signs: from.iter().map(sign).collect(),
            samples: Samples::default(),
            places: Vec::new(),
            light: Vec::new(),
            outside: Vec::new(),
            min: axis.value(0),
            max: axis.value(axis.len() - 1),
            step: step(axis, is_logarithmic),
            target_levels: axis.len(),
            is_logarithmic,
            inputs,
        };
        for (place, entry) in probe.entries.iter().enumerate() {
            data.take(place, entry, weight(probe, entry, &to, k), k);
        }
        Ok(data)
    }

    fn take(&mut self, place: usize, entry: &Entry, weight: f64, k: usize) {
        if weight == 0.0 {
            return self.outside.push(place);
        }
        if weight < 1.0 {
            self.light.push(place);
        }
        let value = entry.target[k];
        self.places.push(place);
        self.samples.u.push(self.inputs.iter().zip(&entry.source).map(|(i, v)| i.normalised(*v)).collect());
        self.samples.y.push(if self.is_logarithmic { value.ln() } else { value });
        self.samples.w.push(weight);
    }

    /// A fitted value in the parameter's own unit.
    pub(crate) fn in_units(&self, y: f64) -> f64 {
        (if self.is_logarithmic { y.exp() } else { y }).clamp(self.min, self.max)
    }
}

/// How much an entry says of the target axis `k`: nothing where it failed, or where the target's lobe is switched off, so that its
/// width shows nowhere.
fn weight(probe: &Probe, entry: &Entry, roles: &[Role], k: usize) -> f64 {
    if entry.failed.is_some() || is_lobe_off(&entry.target, roles) && !roles[k].is_reflectance() {
        return 0.0;
    }
    let edge = if entry.saturated.contains(&probe.target_axes[k].name) { SATURATED } else { 1.0 };
    edge * if is_below_noise(entry) { BELOW_NOISE } else { 1.0 }
}

/// True where the specular lobe of a target is black.
fn is_lobe_off(target: &[f64], roles: &[Role]) -> bool {
    target
        .iter()
        .zip(roles)
        .any(|(v, role)| *v == 0.0 && role.is_reflectance() && *role != Role::RefractiveIndex)
}

/// True where noise hides whether the target is the best.
pub(crate) fn is_below_noise(entry: &Entry) -> bool {
    entry.noise.is_some_and(|noise| !noise.is_decided)
}

fn is_logarithmic(material: &Material, axis: &Axis) -> Result<bool, RemapError> {
    let range = material.model().parameter(&axis.name)?.range();
    Ok(range.is_some_and(|range| range.scale == Scale::Logarithmic) && axis.value(0) > 0.0)
}

/// Median distance of levels.
fn step(axis: &Axis, is_logarithmic: bool) -> f64 {
    let scaled = |v: f64| if is_logarithmic { v.ln() } else { v };
    let mut steps: Vec<f64> = axis.levels.windows(2).map(|w| scaled(w[1]) - scaled(w[0])).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1.0)
}
