//! Applying a probe to a material: interpolation between tabulated source points.

use lookmatch_materials::{Kind, Material, Value};
use lookmatch_search::Axis;
use serde::Serialize;

use crate::{Probe, RemapError};

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
}

/// The target material that looks like a material of the probe's source model.
///
/// Between tabulated points target values are interpolated linearly along each axis; switches of two levels take the
/// value of the nearest point. Parameters that the search left alone are carried over from the source.
///
/// # Errors
/// A parameter that the source model does not have, or a value outside the tabulated range unless `clamp`.
pub fn apply(probe: &Probe, source: &Material, clamp: bool) -> Result<Applied, RemapError> {
    let mut clamped = Vec::new();
    let mut places = Vec::new();
    for axis in &probe.source_axes {
        let value = axis_value(source, axis)?;
        let place = place(axis, value);
        if place.outside {
            if !clamp {
                let (min, max) = (axis.value(0), axis.value(axis.len() - 1));
                return Err(RemapError::OutsideProbe { name: axis.name.clone(), value, min, max });
            }
            clamped.push(axis.name.clone());
        }
        places.push(place);
    }
    check_fixed(probe, source)?;
    let mut values = vec![0.0; probe.target_axes.len()];
    let mut fitness = 0.0;
    let mut body: Option<[f64; 3]> = None;
    let mut saturated: Vec<String> = Vec::new();
    let mut heaviest = 0.0;
    for corner in 0..1usize << places.len() {
        let side = |k: usize| corner >> k & 1;
        let weight: f64 = places.iter().enumerate().map(|(k, p)| p.weights()[side(k)]).product();
        if weight == 0.0 {
            continue;
        }
        let indices: Vec<usize> = places.iter().enumerate().map(|(k, p)| p.index + side(k)).collect();
        let entry = probe.entry(&indices);
        if let Some(reason) = &entry.failed {
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
    // Sums of products leave noise in the last digits: 0.30000000000000004.
    let values: Vec<f64> = values.iter().map(|v| (v * 1e12).round() / 1e12).collect();
    let target = probe.target_material(source, &values, body)?;
    Ok(Applied { source: source.clone(), target, fitness, saturated, clamped })
}

/// The value of an axis in a material; all parameters behind an alias must agree.
fn axis_value(source: &Material, axis: &Axis) -> Result<f64, RemapError> {
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
fn check_fixed(probe: &Probe, source: &Material) -> Result<(), RemapError> {
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
