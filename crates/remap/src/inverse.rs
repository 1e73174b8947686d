//! The inverse of a probe: from target parameters back to source parameters.

use lookmatch_materials::Scale;
use lookmatch_search::{Axis, Bounds, Lattice};
use rayon::prelude::*;

use crate::apply::{Reading, read};
use crate::{Derived, DerivedKind, Entry, Probe, RemapError, RoundTrip, Totals};

/// Entries of an inverse at most, about, and levels of an axis.
const ENTRIES: f64 = 2000.0;
const LEVELS: f64 = 65.0;
/// Source points that the search of a target starts from, about.
const STARTS: f64 = 2500.0;
/// A target is reached if the nearest one differs by no more than this share of the range of each parameter.
const REACHED: f64 = 0.01;
/// Halvings of the last step of a search: to a billionth of the range.
const HALVINGS: usize = 30;

/// The values of a target parameter that a probe's sources reach.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// The target axis.
    pub name: String,
    /// Smallest value.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

/// A probe as a function of its source axes' shares, 0 to 1.
struct Forward<'a> {
    probe: &'a Probe,
    /// Target axes that vary.
    varying: Vec<usize>,
    /// Where they lie.
    reach: Vec<Reach>,
}

/// The probe that leads back: its source axes are the target parameters that vary, over the range that is reached, and each of its
/// entries is the source point whose target is nearest. Where that is another target, the entry is marked as unreachable, and its
/// source parameters on the edge of their range as saturated.
///
/// # Errors
/// A probe of a single source, one whose targets are all the same, or one with fewer varying target parameters than source parameters.
pub fn invert(probe: &Probe) -> Result<Probe, RemapError> {
    let starts = starts(probe)?;
    let forward = Forward::new(probe, &starts)?;
    let from_axes = forward.axes()?;
    let images: Vec<Vec<f64>> =
        starts.par_iter().map(|s| Ok(forward.target(s)?.1)).collect::<Result<_, RemapError>>()?;
    let found: Vec<(Entry, bool)> = points(from_axes.clone())
        .par_iter()
        .map(|target| forward.entry(target, &starts, &images))
        .collect::<Result<_, RemapError>>()?;
    let unreachable =
        found.iter().enumerate().filter(|(_, (_, is_reached))| !is_reached).map(|(k, _)| k).collect();
    let mut from = probe.to.clone();
    for (k, axis) in probe.target_axes.iter().enumerate().filter(|(k, _)| !forward.varying.contains(k)) {
        let first = probe.found().next().map_or(axis.value(0), |entry| entry.target[k]);
        from.set_number(&axis.name, first)?;
    }
    let target_axes: Vec<Axis> = probe.source_axes.iter().map(numeric).collect();
    let mut inverse = Probe {
        from,
        to: probe.from.clone(),
        source_axes: from_axes,
        held: Vec::new(),
        search: "inverse".into(),
        totals: Totals::derived(&target_axes),
        target_axes,
        entries: found.into_iter().map(|(entry, _)| entry).collect(),
        fit: None,
        verdicts: Vec::new(),
        derived: Some(Derived {
            kind: DerivedKind::Inverse,
            of: vec![format!("{} -> {}", probe.from.model().name, probe.to.model().name)],
            measured: false,
            round_trip: Vec::new(),
            unreachable,
        }),
        ..probe.clone()
    };
    let round_trip = round_trip(probe, &forward, &inverse)?;
    if let Some(derived) = &mut inverse.derived {
        derived.round_trip = round_trip;
    }
    Ok(inverse)
}

/// An axis of at least three levels: two would make it a switch.
fn numeric(axis: &Axis) -> Axis {
    let mut axis = axis.clone();
    if let [low, high] = axis.levels[..] {
        axis.levels.insert(1, (low + high) / 2.0);
    }
    axis
}

/// Shares of the source axes, on a regular grid.
fn starts(probe: &Probe) -> Result<Vec<Vec<f64>>, RemapError> {
    let axes = probe.source_axes.len();
    let each = (STARTS.powf(1.0 / axes.max(1) as f64) as usize).clamp(3, 257);
    let shares = Axis::listed("share", (0..each).map(|k| k as f64 / (each - 1) as f64).collect())?;
    Ok(points(vec![shares; axes]))
}

/// All points of some axes, in lexicographic order.
fn points(axes: Vec<Axis>) -> Vec<Vec<f64>> {
    let lattice = Lattice { axes };
    lattice.points(&Bounds::full(&lattice)).map(|point| lattice.values(&point)).collect()
}

impl<'a> Forward<'a> {
    fn new(probe: &'a Probe, starts: &[Vec<f64>]) -> Result<Self, RemapError> {
        let refused = |why: String| Err(RemapError::Option(format!("cannot invert the probe: {why}")));
        if probe.source_axes.is_empty() {
            return refused("its source is a single material".into());
        }
        let all: Vec<usize> = (0..probe.target_axes.len()).collect();
        let reach =
            |k: &usize| Reach { name: probe.target_axes[*k].name.clone(), min: f64::MAX, max: f64::MIN };
        let mut forward = Self { probe, reach: all.iter().map(reach).collect(), varying: all };
        let readings = starts.iter().map(|start| forward.target(start).map(|(reading, _)| reading.values));
        let entries = probe.found().map(|entry| Ok(read(probe, probe.fit.as_ref(), &entry.source)?.values));
        let all: Vec<Vec<f64>> = readings.chain(entries).collect::<Result<_, RemapError>>()?;
        for values in all {
            for (reach, value) in forward.reach.iter_mut().zip(values) {
                (reach.min, reach.max) = (reach.min.min(value), reach.max.max(value));
            }
        }
        forward.varying.retain(|k| forward.reach[*k].max > forward.reach[*k].min);
        forward.reach.retain(|reach| reach.max > reach.min);
        let (varying, axes) = (forward.varying.len(), probe.source_axes.len());
        if varying < axes {
            let names: Vec<&str> = probe.source_axes.iter().map(|a| a.name.as_str()).collect();
            return refused(format!(
                "{varying} of the target's parameters vary, too few to tell {axes} of the source's ({}); make it with one of them \
                 held (--fix)",
                names.join(", ")
            ));
        }
        Ok(forward)
    }

    /// The source axes of the inverse, over the reached range.
    fn axes(&self) -> Result<Vec<Axis>, RemapError> {
        let each = ENTRIES.powf(1.0 / self.varying.len() as f64).clamp(3.0, LEVELS) as usize;
        let axis = |(k, reach): (&usize, &Reach)| -> Result<Axis, RemapError> {
            let axis = &self.probe.target_axes[*k];
            if axis.len() <= 2 {
                return Ok(axis.clone());
            }
            let range = self.probe.to.model().parameter(&axis.name)?.range();
            let is_log = reach.min > 0.0 && range.is_some_and(|r| r.scale == Scale::Logarithmic);
            let level = |k: usize| {
                let share = k as f64 / (each - 1) as f64;
                match k {
                    0 => reach.min,
                    k if k + 1 == each => reach.max,
                    _ if is_log => reach.min * (reach.max / reach.min).powf(share),
                    _ => reach.min + share * (reach.max - reach.min),
                }
            };
            Ok(Axis::listed(&axis.name, (0..each).map(level).collect())?)
        };
        self.varying.iter().zip(&self.reach).map(axis).collect()
    }

    /// The source point at shares of its axes.
    fn source(&self, shares: &[f64]) -> Vec<f64> {
        let value = |(axis, share): (&Axis, &f64)| {
            let (min, max) = (axis.value(0), axis.value(axis.len() - 1));
            if *share >= 1.0 { max } else { min + share * (max - min) }
        };
        self.probe.source_axes.iter().zip(shares).map(value).collect()
    }

    /// What the probe says at shares of its axes, and its varying target values as shares of their reach.
    fn target(&self, shares: &[f64]) -> Result<(Reading, Vec<f64>), RemapError> {
        let reading = read(self.probe, self.probe.fit.as_ref(), &self.source(shares))?;
        let varying: Vec<f64> = self.varying.iter().map(|k| reading.values[*k]).collect();
        let shares = self.shares(&varying);
        Ok((reading, shares))
    }

    fn shares(&self, varying: &[f64]) -> Vec<f64> {
        varying.iter().zip(&self.reach).map(|(v, r)| (v - r.min) / (r.max - r.min)).collect()
    }

    /// The entry of a target, and whether it is reached.
    fn entry(
        &self,
        target: &[f64],
        starts: &[Vec<f64>],
        images: &[Vec<f64>],
    ) -> Result<(Entry, bool), RemapError> {
        let wanted = self.shares(target);
        let distance = |image: &[f64]| image.iter().zip(&wanted).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let nearest =
            (0..starts.len()).min_by(|a, b| distance(&images[*a]).total_cmp(&distance(&images[*b])));
        let mut best = nearest.map(|k| starts[k].clone()).unwrap_or_default();
        let mut least = distance(&self.target(&best)?.1);
        let spacing = 1.0 / STARTS.powf(1.0 / best.len() as f64);
        let mut step = spacing;
        for _ in 0..HALVINGS {
            while let Some((shares, closer)) = self.closer(&best, least, step, &distance)? {
                (best, least) = (shares, closer);
            }
            step /= 2.0;
        }
        let (reading, image) = self.target(&best)?;
        let is_reached = image.iter().zip(&wanted).all(|(a, b)| (a - b).abs() <= REACHED);
        let source = self.source(&best);
        let on_edge = |k: &usize| best[*k] <= 1e-6 || best[*k] >= 1.0 - 1e-6;
        let edges = (0..best.len()).filter(|k| !is_reached && on_edge(k));
        let saturated = edges.map(|k| self.probe.source_axes[k].name.clone()).collect();
        let near = nearest_entry(self.probe, &source);
        let entry = Entry {
            source: target.to_vec(),
            target: source,
            fitness: reading.fitness,
            nrmsd: near.nrmsd,
            nrmsd_masked: near.nrmsd_masked,
            evaluations: 0,
            saturated,
            body: reading.body.map(|gain| gain.map(|g| if g > 0.0 { 1.0 / g } else { 1.0 })),
            noise: near.noise,
            failed: None,
        };
        Ok((entry, is_reached))
    }

    /// The best of the neighbours at a step along one or two axes, if it is closer.
    fn closer(
        &self,
        shares: &[f64],
        least: f64,
        step: f64,
        distance: &dyn Fn(&[f64]) -> f64,
    ) -> Result<Option<(Vec<f64>, f64)>, RemapError> {
        let n = shares.len();
        let mut moves: Vec<Vec<f64>> = Vec::new();
        for (i, a) in (0..n).flat_map(|i| [1.0, -1.0].map(|a| (i, a))) {
            let mut one = shares.to_vec();
            one[i] = (one[i] + a * step).clamp(0.0, 1.0);
            for (j, b) in (i + 1..n).flat_map(|j| [1.0, -1.0].map(|b| (j, b))) {
                let mut two = one.clone();
                two[j] = (two[j] + b * step).clamp(0.0, 1.0);
                moves.push(two);
            }
            moves.push(one);
        }
        let mut best = None;
        let mut least = least;
        for shares in moves {
            let there = distance(&self.target(&shares)?.1);
            // Steps that gain nothing but rounding would never end.
            if there < least * (1.0 - 1e-9) {
                (best, least) = (Some((shares, there)), there);
            }
        }
        Ok(best)
    }
}

/// The entry of the nearest source point that has a result.
fn nearest_entry<'a>(probe: &'a Probe, source: &[f64]) -> &'a Entry {
    let indices: Vec<usize> =
        probe.source_axes.iter().zip(source).map(|(axis, v)| axis.nearest(*v)).collect();
    let entry = probe.entry(&indices);
    if entry.failed.is_none() { entry } else { probe.found().next().unwrap_or(entry) }
}

/// What is left of each source parameter after there and back.
fn round_trip(probe: &Probe, forward: &Forward, inverse: &Probe) -> Result<Vec<RoundTrip>, RemapError> {
    let is_outside = |place: &usize| {
        let parameters = probe.fit.iter().flat_map(|fit| &fit.parameters);
        parameters.into_iter().any(|p| p.outside.binary_search(place).is_ok())
    };
    let mut trips: Vec<RoundTrip> = (probe.source_axes.iter())
        .map(|axis| RoundTrip { name: axis.name.clone(), mean: 0.0, max: 0.0, entries: 0 })
        .collect();
    for (place, entry) in probe.entries.iter().enumerate() {
        if entry.failed.is_some() || is_outside(&place) {
            continue;
        }
        let there = read(probe, probe.fit.as_ref(), &entry.source)?.values;
        let there: Vec<f64> = forward.varying.iter().map(|k| there[*k]).collect();
        let back = read(inverse, None, &there)?.values;
        for (trip, (back, own)) in trips.iter_mut().zip(back.iter().zip(&entry.source)) {
            let left = (back - own).abs();
            (trip.mean, trip.max, trip.entries) = (trip.mean + left, trip.max.max(left), trip.entries + 1);
        }
    }
    trips.iter_mut().for_each(|trip| trip.mean /= trip.entries.max(1) as f64);
    Ok(trips)
}
