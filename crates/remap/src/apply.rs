//! Applying a probe to a material: interpolation between tabulated source points.

use lookmatch_materials::{Kind, Material, Value};
use lookmatch_search::Axis;
use serde::Serialize;

use crate::fit::Fit;
use crate::{Entry, Probe, RemapError};

/// A target material for a source material.
#[derive(Clone, Debug, Serialize)]
pub struct Applied {
    /// The source material.
    pub source: Material,
    /// The target material.
    pub target: Material,
    /// Fitness of the match, interpolated between the tabulated ones.
    pub fitness: f64,
    /// Target parameters that sit on the edge of their range at one of the tabulated points used.
    pub saturated: Vec<String>,
    /// Source parameters that were moved into the probe's range.
    pub clamped: Vec<String>,
    /// What gave the value of each searched target parameter, in words: by name, then `table`, `local regression` or a
    /// closed form.
    pub forms: Vec<[String; 2]>,
    /// Searched target parameters whose function is used outside of what it was fitted to.
    pub outside_fit: Vec<String>,
}

/// The target material that looks like a material of the probe's source model.
///
/// Values come from the table, so that tabulated points get what was found for them: between those they are interpolated
/// linearly along each axis; switches of two levels take the value of the nearest point. Parameters that the search left alone are carried over from the source.
///
/// # Errors
/// A parameter that the source model does not have, or a value outside the tabulated range unless `clamp`.
pub fn apply(probe: &Probe, source: &Material, clamp: bool) -> Result<Applied, RemapError> {
    apply_with(probe, None, source, clamp)
}

/// [`apply`] with values from the probe's fit where it has one that is adequate: without the steps of the lattice and of the search.
///
/// # Errors
/// As [`apply`].
pub fn apply_smoothly(probe: &Probe, source: &Material, clamp: bool) -> Result<Applied, RemapError> {
    apply_with(probe, probe.fit.as_ref(), source, clamp)
}

fn apply_with(
    probe: &Probe,
    fit: Option<&Fit>,
    source: &Material,
    clamp: bool,
) -> Result<Applied, RemapError> {
    let (mut clamped, mut point) = (Vec::new(), Vec::new());
    for axis in &probe.source_axes {
        let value = axis_value(source, axis)?;
        if place(axis, value).outside {
            if !clamp {
                let (min, max) = (axis.value(0), axis.value(axis.len() - 1));
                return Err(RemapError::OutsideProbe { name: axis.name.clone(), value, min, max });
            }
            clamped.push(axis.name.clone());
        }
        point.push(value);
    }
    check_fixed(probe, source)?;
    let Reading { values, is_smooth, is_outside, fitness, body, saturated } = read(probe, fit, &point)?;
    let target = probe.target_material(source, &values, body)?;
    let forms = probe.target_axes.iter().enumerate().map(|(k, axis)| {
        let form = fit.filter(|_| is_smooth[k]).map(|fit| fit.parameters[k].describe());
        [axis.name.clone(), form.unwrap_or_else(|| "table".into())]
    });
    let outside = (0..values.len()).filter(|k| is_smooth[*k] && is_outside[*k]);
    let outside_fit = outside.map(|k| probe.target_axes[k].name.clone()).collect();
    Ok(Applied {
        source: source.clone(),
        target,
        fitness,
        saturated,
        clamped,
        forms: forms.collect(),
        outside_fit,
    })
}

/// What a probe says at a point of its source axes.
pub(crate) struct Reading {
    /// Values of the target axes.
    pub(crate) values: Vec<f64>,
    /// For each of them: whether a smooth function gave it,
    is_smooth: Vec<bool>,
    /// and whether that function was fitted to none of the entries around.
    is_outside: Vec<bool>,
    pub(crate) fitness: f64,
    pub(crate) body: Option<[f64; 3]>,
    pub(crate) saturated: Vec<String>,
}

/// Reads a probe at a point, which is moved into its range.
pub(crate) fn read(probe: &Probe, fit: Option<&Fit>, point: &[f64]) -> Result<Reading, RemapError> {
    let places: Vec<Place> = probe.source_axes.iter().zip(point).map(|(axis, v)| place(axis, *v)).collect();
    let axes = probe.target_axes.len();
    let smooth = fit.map_or_else(|| vec![None; axes], |fit| fit.evaluate(probe, point));
    let is_smooth: Vec<bool> = smooth.iter().map(Option::is_some).collect();
    let mut is_outside = vec![fit.is_some(); axes];
    let mut values = vec![0.0; axes];
    let (mut fitness, mut weights, mut heaviest) = (0.0, 0.0, 0.0);
    let mut body: Option<[f64; 3]> = None;
    let mut saturated: Vec<String> = Vec::new();
    for corner in 0..1usize << places.len() {
        let side = |k: usize| corner >> k & 1;
        let weight: f64 = places.iter().enumerate().map(|(k, p)| p.weights()[side(k)]).product();
        if weight == 0.0 {
            continue;
        }
        let indices: Vec<usize> = places.iter().enumerate().map(|(k, p)| p.index + side(k)).collect();
        let place = probe.place(&indices);
        let entry = &probe.entries[place];
        for (is_outside, parameter) in is_outside.iter_mut().zip(fit.iter().flat_map(|f| &f.parameters)) {
            *is_outside &= parameter.outside.binary_search(&place).is_ok();
        }
        if let Some(reason) = &entry.failed {
            // Smooth functions reach over what failed, and the others tell how good the match is.
            if is_smooth.iter().all(|is_smooth| *is_smooth) {
                continue;
            }
            return Err(RemapError::Option(format!(
                "the probe has no result at {:?}, which is needed here: {reason}",
                entry.source
            )));
        }
        if let Some(gain) = entry.body {
            let sum = body.get_or_insert([0.0; 3]);
            (0..3).for_each(|c| sum[c] += weight * gain[c]);
        }
        fitness += weight * entry.fitness;
        weights += weight;
        for (k, axis) in probe.target_axes.iter().enumerate() {
            if axis.len() > 2 {
                values[k] += weight * entry.target[k];
            } else if weight > heaviest {
                values[k] = entry.target[k];
            }
        }
        heaviest = weight.max(heaviest);
        saturated
            .extend(entry.saturated.iter().filter(|n| !saturated.contains(n)).cloned().collect::<Vec<_>>());
    }
    if weights == 0.0 {
        let near = nearest_found(probe, &places);
        let near = near.ok_or_else(|| RemapError::Option("the probe has no result at all".into()))?;
        (fitness, weights, body) = (near.fitness, 1.0, near.body);
    }
    // Sums of products leave noise in the last digits: 0.30000000000000004.
    let round = |v: f64| (v * 1e12).round() / 1e12;
    let values = values.iter().zip(&smooth).map(|(v, smooth)| round(smooth.unwrap_or(*v))).collect();
    let body = body.map(|gain| gain.map(|g| g / weights));
    Ok(Reading { values, is_smooth, is_outside, fitness: fitness / weights, body, saturated })
}

/// The nearest entry that has a result, by steps between levels.
fn nearest_found<'a>(probe: &'a Probe, places: &[Place]) -> Option<&'a Entry> {
    let steps = |place: &usize| -> usize {
        let indices = probe.indices(*place);
        indices.iter().zip(places).map(|(i, place)| i.abs_diff(place.index)).sum()
    };
    let found = (0..probe.entries.len()).filter(|place| probe.entries[*place].failed.is_none());
    found.min_by_key(steps).map(|place| &probe.entries[place])
}

/// The value of an axis in a material; all parameters behind an alias must agree.
pub(crate) fn axis_value(source: &Material, axis: &Axis) -> Result<f64, RemapError> {
    let model = source.model();
    let indices = model.resolve(&axis.name)?;
    let grey = |i: &usize| match &source.values()[*i] {
        Value::Number(v) => Some(*v),
        Value::Colour([r, g, b]) if r == g && g == b => Some(*r),
        Value::List(v) if v.len() == 1 => Some(v[0]),
        _ => None,
    };
    let values: Vec<Option<f64>> = indices.iter().map(grey).collect();
    match values[0] {
        Some(value) if values.iter().all(|v| *v == Some(value)) => Ok(value),
        _ => Err(RemapError::Option(format!(
            "the probe tabulates '{}' as one number; {source} has several",
            axis.name
        ))),
    }
}

/// Refuses values that the probe holds fixed at something else and that change the lobe.
pub(crate) fn check_fixed(probe: &Probe, source: &Material) -> Result<(), RemapError> {
    use lookmatch_materials::Role;
    let model = source.model();
    let free: Vec<usize> =
        probe.source_axes.iter().map(|a| model.resolve(&a.name)).collect::<Result<Vec<_>, _>>()?.concat();
    for (index, parameter) in model.parameters.iter().enumerate() {
        let (given, held) = (&source.values()[index], &probe.from.values()[index]);
        let carried = matches!(
            parameter.role,
            Role::DiffuseReflectance | Role::BaseColour | Role::ConductorIndex | Role::Extinction
        );
        if !free.contains(&index) && !carried && given != held {
            let varying = match parameter.kind {
                Kind::Choice { .. } => "found for another choice of".to_owned(),
                _ => format!("found with {} fixed; make one with --vary", parameter.name),
            };
            return Err(RemapError::Option(format!(
                "{source} does not fit the probe, which was {varying} '{}' ({})",
                parameter.name, probe.from
            )));
        }
    }
    Ok(())
}

/// A value between two levels of an axis.
struct Place {
    index: usize,
    /// Share of the upper level.
    fraction: f64,
    outside: bool,
}

impl Place {
    fn weights(&self) -> [f64; 2] {
        [1.0 - self.fraction, self.fraction]
    }
}

/// True where a value lies outside of an axis, by more than rounding.
pub(crate) fn is_outside(axis: &Axis, value: f64) -> bool {
    place(axis, value).outside
}

fn place(axis: &Axis, value: f64) -> Place {
    let last = axis.len() - 1;
    let (min, max) = (axis.value(0), axis.value(last));
    // A value computed elsewhere may miss the end of the range by rounding.
    let slack = 1e-9 * (max - min).max(min.abs());
    let outside = value < min - slack || value > max + slack;
    let value = value.clamp(min, max);
    let above = axis.levels.partition_point(|level| *level <= value);
    let index = above.clamp(1, last.max(1)) - 1;
    if last == 0 {
        return Place { index: 0, fraction: 0.0, outside };
    }
    let (low, high) = (axis.value(index), axis.value(index + 1));
    Place { index, fraction: (value - low) / (high - low), outside }
}
