//! Two probes as one: A to B, then B to C.

use lookmatch_search::Axis;

use crate::apply::{axis_value, check_fixed, is_outside, read};
use crate::{Derived, DerivedKind, Entry, Noise, Probe, RemapError, Stage, Strategy, Totals, apply_smoothly};

/// The probe from the first one's source to the second one's target: each entry of the first goes through the second.
///
/// Its domain is what the second can take: levels of the source axes that lead nowhere else are left out, and single entries
/// that do have no result, unless `clamp` moves what they give to the nearest value that the second takes. Flags of both carry
/// over; a saturated parameter of B is called `NAME of B`. Fitness and NRMSD are sums until [`measure`] renders them.
///
/// # Errors
/// A second probe of another model than the first one leads to, or of other values of its fixed parameters, and one that can take
/// nothing of what the first gives.
pub fn compose(first: &Probe, second: &Probe, clamp: bool) -> Result<Probe, RemapError> {
    let (given, taken) = (first.to.model(), second.from.model());
    if !std::ptr::eq(given, taken) {
        return Err(RemapError::Option(format!(
            "cannot compose: the first probe leads to {}, the second one starts from {}; they must be the same model",
            given.name, taken.name
        )));
    }
    let mut entries = Vec::with_capacity(first.entries.len());
    for entry in &first.entries {
        entries.push(composed(first, second, entry, clamp)?);
    }
    let levels = reaching(first, &entries);
    if levels.iter().any(Vec::is_empty) || entries.iter().all(|entry| entry.failed.is_some()) {
        let reason = entries.iter().find_map(|entry| entry.failed.clone()).unwrap_or_default();
        return Err(RemapError::Option(format!(
            "cannot compose: the second probe can take nothing that the first one gives: {reason}; --clamp moves it to the nearest"
        )));
    }
    let is_kept = |place: &usize| first.indices(*place).iter().zip(&levels).all(|(i, kept)| kept.contains(i));
    let places: Vec<usize> = (0..entries.len()).filter(is_kept).collect();
    let axis = |(axis, kept): (&Axis, &Vec<usize>)| -> Result<Axis, RemapError> {
        Ok(Axis::listed(&axis.name, kept.iter().map(|i| axis.value(*i)).collect())?)
    };
    let was_unreachable = |place: &usize| first.derived.iter().any(|d| d.unreachable.contains(place));
    let unreachable = (0..places.len()).filter(|k| was_unreachable(&places[*k])).collect();
    let name = |probe: &Probe| format!("{} -> {}", probe.from.model().name, probe.to.model().name);
    let mut renderers = first.renderers.clone();
    renderers.extend(
        second.renderers.iter().filter(|r| !first.renderers.iter().any(|o| o.name == r.name)).cloned(),
    );
    let is_constrained = [first, second].iter().all(|probe| probe.strategy == Strategy::Constrained);
    let target_axes: Vec<Axis> = second.target_axes.clone();
    Ok(Probe {
        to: second.to.clone(),
        source_axes: first.source_axes.iter().zip(&levels).map(axis).collect::<Result<_, _>>()?,
        held: second.held.clone(),
        search: "composition".into(),
        strategy: if is_constrained { Strategy::Constrained } else { Strategy::Unconstrained },
        totals: Totals::derived(&target_axes),
        target_axes,
        renderers,
        entries: places.iter().map(|place| entries[*place].clone()).collect(),
        fit: None,
        verdicts: Vec::new(),
        derived: Some(Derived {
            kind: DerivedKind::Composition,
            of: vec![name(first), name(second)],
            measured: false,
            round_trip: Vec::new(),
            unreachable,
        }),
        ..first.clone()
    })
}

/// An entry of the first probe, carried on by the second.
fn composed(first: &Probe, second: &Probe, entry: &Entry, clamp: bool) -> Result<Entry, RemapError> {
    let failed = |reason: String| Ok(Entry::failed(entry.source.clone(), reason));
    if let Some(reason) = &entry.failed {
        return failed(reason.clone());
    }
    let source = first.source_material(&entry.source)?;
    let there = apply_smoothly(first, &source, true)?;
    check_fixed(second, &there.target)?;
    let point = (second.source_axes.iter())
        .map(|axis| axis_value(&there.target, axis))
        .collect::<Result<Vec<f64>, _>>()?;
    let outside = second.source_axes.iter().zip(&point).find(|(axis, value)| is_outside(axis, **value));
    if let Some((axis, value)) = outside.filter(|_| !clamp) {
        let (name, model) = (&axis.name, second.from.model().name);
        let (min, max) = (axis.value(0), axis.value(axis.len() - 1));
        return failed(format!("{name} = {value} of {model} lies outside [{min}, {max}]"));
    }
    let on = match read(second, second.fit.as_ref(), &point) {
        Err(RemapError::Option(reason)) => return failed(reason),
        on => on?,
    };
    let indices: Vec<usize> =
        second.source_axes.iter().zip(&point).map(|(axis, v)| axis.nearest(*v)).collect();
    let near = second.entry(&indices);
    let on_edge = there.saturated.iter().chain(outside.map(|(axis, _)| &axis.name));
    let mut saturated: Vec<String> =
        on_edge.map(|name| format!("{name} of {}", second.from.model().name)).collect();
    saturated.dedup();
    saturated.extend(on.saturated);
    let sum = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|c| a[c] + b[c]);
    let gain = |body: Option<[f64; 3]>| body.unwrap_or([1.0; 3]);
    let body = [entry.body, on.body].iter().any(Option::is_some);
    Ok(Entry {
        source: entry.source.clone(),
        target: on.values,
        fitness: there.fitness + on.fitness,
        nrmsd: sum(entry.nrmsd, near.nrmsd),
        nrmsd_masked: sum(entry.nrmsd_masked, near.nrmsd_masked),
        evaluations: 0,
        saturated,
        body: body.then(|| std::array::from_fn(|c| gain(entry.body)[c] * gain(on.body)[c])),
        noise: both(entry.noise, near.noise),
        failed: None,
    })
}

/// What is unknown of two matches, one after the other.
fn both(a: Option<Noise>, b: Option<Noise>) -> Option<Noise> {
    let (Some(a), Some(b)) = (a, b) else { return a.or(b) };
    Some(Noise {
        fitness: a.fitness.hypot(b.fitness),
        nrmsd: std::array::from_fn(|c| a.nrmsd[c].hypot(b.nrmsd[c])),
        is_decided: a.is_decided && b.is_decided,
    })
}

/// For each source axis the levels at which some entry has a result, at the levels of the other axes that are kept.
fn reaching(probe: &Probe, entries: &[Entry]) -> Vec<Vec<usize>> {
    let reached: Vec<Vec<usize>> =
        (0..entries.len()).filter(|k| entries[*k].failed.is_none()).map(|k| probe.indices(k)).collect();
    (0..probe.source_axes.len())
        .map(|axis| {
            let mut levels: Vec<usize> = reached.iter().map(|indices| indices[axis]).collect();
            levels.sort_unstable();
            levels.dedup();
            // A gap between levels would be interpolated over.
            match (levels.first(), levels.last()) {
                (Some(first), Some(last)) => (*first..=*last).collect(),
                _ => levels,
            }
        })
        .collect()
}

/// Renders the entries of a derived probe and writes how good they are; `observe` is told of each.
///
/// # Errors
/// Where a material cannot be made.
pub fn measure(probe: &mut Probe, stage: &Stage, observe: &mut dyn FnMut()) -> Result<(), RemapError> {
    for place in 0..probe.entries.len() {
        let entry = &probe.entries[place];
        if entry.failed.is_none() {
            let source = probe.source_material(&entry.source)?;
            let target = probe.target_material(&source, &entry.target, entry.body)?;
            let seen = stage.appearances(&[source.clone(), target.clone()]);
            let [nrmsd, nrmsd_masked] = stage.nrmsd(&source, &target)?;
            let entry = &mut probe.entries[place];
            entry.fitness = stage.fitness(&seen[0], &seen[1]);
            (entry.nrmsd, entry.nrmsd_masked) = (nrmsd, nrmsd_masked);
        }
        observe();
    }
    if let Some(derived) = &mut probe.derived {
        derived.measured = true;
    }
    Ok(())
}
