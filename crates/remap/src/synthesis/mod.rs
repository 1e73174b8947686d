//! Pictures that nobody rendered: synthesised from those that were (Guarnera *et al.* 2018, section 4).
//!
//! Rendered pictures are written as sums of their principal components; what each component has to be multiplied with, its
//! loading, is a smooth function of the target's parameters, which is interpolated. Where the model declares that it is linear in
//! a parameter, pictures at the ends of that axis tell those between, and nothing is rendered along it. A synthesised
//! picture proposes candidates and no more: each is rendered before it wins, and tells how far off the synthesis was.

mod components;
mod interpolation;
mod study;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Mutex, MutexGuard, PoisonError};

use lookmatch_materials::fresnel::f0_from_ior;
use lookmatch_materials::{Material, Model, Role};
use lookmatch_search::{Axis, Lattice, Point};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::gallery::{Key, key};

use components::{Components, Loadings};
use interpolation::{Interpolation, Metric};
pub use study::{PictureError, SynthesisExample, SynthesisQuality, SynthesisStudy, study_synthesis};

/// Fitness that the components may leave out of the pictures that they are made of, as root mean square.
const LEFT_OUT: f64 = 0.01;
/// Length of noise, in multiples of its measured one, that is left out as well: a little more than there is on average.
const NOISES: f64 = 1.2;
/// Points with a switch of their own that need a function of their own, at least.
const FEWEST: usize = 6;
/// Levels between the ends of an axis in which the model is linear.
const BETWEEN: usize = 8;
/// Rendered pictures after which functions are no longer fitted for each new one ...
const MANY: usize = 120;
/// ... but for those that were further off than this, in fitness.
const OFF: f64 = 0.05;
/// Points beyond which a function of its own is put through those around each place ...
const WHOLE: usize = 400;
/// ... of which there are so many.
const AROUND: usize = 40;
/// Least α that is told from smaller ones, and least reflectance.
const LEAST: f64 = 1e-3;

/// How well synthesised pictures foresaw the rendered ones: measured on every candidate that was rendered after it had been
/// synthesised, and so on pictures that the synthesis did not know.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SynthesisRecord {
    /// Components under the point light and under the environment.
    pub components: [usize; 2],
    /// Rendered pictures that were held out: synthesised first.
    pub held_out: usize,
    /// Mean distance between the two, in fitness (Eq. 3).
    pub mean: f64,
    /// 95 % are no further apart than this.
    pub most: f64,
}

/// What is known of targets, by family; and how many were rendered.
#[derive(Default)]
pub(crate) struct Syntheses {
    families: Mutex<BTreeMap<Key, Synthesis>>,
    rendered: Mutex<RenderedTargets>,
}

/// Targets that were rendered, as numbers that tell them apart.
#[derive(Default)]
struct RenderedTargets {
    all: HashSet<u64>,
    /// Those that no journal knows yet.
    new: Vec<u64>,
}

/// A family that is being asked.
pub(crate) type Families<'a> = MutexGuard<'a, BTreeMap<Key, Synthesis>>;

impl Syntheses {
    /// All families. A panic elsewhere leaves none of them half-written that later work could not do without.
    pub(crate) fn families(&self) -> Families<'_> {
        self.families.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn targets(&self) -> MutexGuard<'_, RenderedTargets> {
        self.rendered.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts targets that a search asked for, each once.
    pub(crate) fn count(&self, materials: &[Material]) {
        let mut targets = self.targets();
        for material in materials {
            // Without a random key: a resumed remap compares with numbers that its journal kept.
            let mut hasher = DefaultHasher::new();
            key(material).hash(&mut hasher);
            let number = hasher.finish();
            if targets.all.insert(number) {
                targets.new.push(number);
            }
        }
    }

    /// Targets that were counted since this was last asked.
    pub(crate) fn counted(&self) -> Vec<u64> {
        std::mem::take(&mut self.targets().new)
    }

    /// Targets that an earlier run counted.
    pub(crate) fn recall(&self, numbers: &[u64]) {
        self.targets().all.extend(numbers);
    }

    /// Targets that were asked for.
    pub(crate) fn rendered(&self) -> usize {
        self.targets().all.len()
    }

    /// How well synthesis went, over all families: errors of all of them together, components of the one that has most.
    pub(crate) fn record(&self) -> Option<SynthesisRecord> {
        let families = self.families();
        if families.values().all(|family| family.learnt.is_empty()) {
            return None;
        }
        let components = |kind: usize| {
            families.values().filter_map(|family| family.components.get(kind)).map(Components::len).max()
        };
        let mut errors: Vec<f64> = families.values().flat_map(|family| &family.errors).copied().collect();
        errors.sort_by(f64::total_cmp);
        Some(SynthesisRecord {
            components: [0, 1].map(|kind| components(kind).unwrap_or(0)),
            held_out: errors.len(),
            mean: errors.iter().sum::<f64>() / errors.len().max(1) as f64,
            most: errors.get((0.95 * errors.len() as f64) as usize).copied().unwrap_or(0.0),
        })
    }
}

/// What is known of the targets of one family: they differ by their searched parameters alone.
pub(crate) struct Synthesis {
    axes: Vec<Coordinate>,
    /// What a unit of distance adds to the fitness, for each kind of picture.
    shares: Vec<f64>,
    /// Components of each kind of picture.
    components: Vec<Components>,
    /// By the indices of the switches.
    strata: HashMap<Point, Stratum>,
    learnt: HashSet<Point>,
    errors: Vec<f64>,
}

/// The pictures of a material, one of each kind: CIELAB planes, weighted per pixel.
pub(crate) type LabPictures = Vec<Vec<f32>>;

/// A rendered target.
pub(crate) struct Rendered {
    pub(crate) point: Point,
    pub(crate) pictures: LabPictures,
    /// Squared length of the noise in each: no component is to hold it.
    pub(crate) noise: Vec<f64>,
}

/// Makes the pictures of a material between two rendered ones: their places, and the share of the second.
pub(crate) type Mix<'a> = dyn Fn(usize, usize, f64) -> LabPictures + 'a;

/// How an axis of the lattice is measured.
struct Coordinate {
    /// For each level; appearance changes about evenly along it.
    values: Vec<f64>,
    is_switch: bool,
    is_linear: bool,
    levels: Vec<f64>,
}

/// Points that share their switches.
#[derive(Default)]
struct Stratum {
    points: Vec<Vec<f64>>,
    loadings: Vec<Vec<Vec<f64>>>,
    function: Option<Surface>,
    metric: Option<Metric>,
    is_stale: bool,
    /// Components of each kind of picture when the function was fitted.
    lengths: Vec<usize>,
    /// Forecast loadings.
    foreseen: HashMap<Point, Vec<f64>>,
}

/// Loadings over the parameters.
enum Surface {
    /// Too little is known: those of the nearest point.
    Nearest,
    /// Through all points.
    Smooth(Interpolation),
    /// Through those around a place: the points and their loadings.
    Local(Metric, Vec<Vec<f64>>),
}

impl Coordinate {
    fn of(model: &Model, axis: &Axis) -> Self {
        let role = model.parameter(&axis.name).map(|parameter| parameter.role);
        let value = |level: &f64| role.as_ref().map_or(*level, |role| even(*role, *level));
        let raw: Vec<f64> = axis.levels.iter().map(value).collect();
        let (min, max) =
            raw.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        let length = if max > min { max - min } else { 1.0 };
        Self {
            values: raw.iter().map(|v| (v - min) / length).collect(),
            is_switch: axis.len() <= 2,
            is_linear: axis.len() > 2 && model.linear.contains(&axis.name.as_str()),
            levels: axis.levels.clone(),
        }
    }
}

/// A value on a scale of about even change: the logarithm of a width, the cube root (as of CIELAB) of a reflectance.
fn even(role: Role, value: f64) -> f64 {
    if let Some(alpha) = role.alpha(value) {
        return alpha.max(LEAST).ln();
    }
    match role {
        Role::RefractiveIndex => f0_from_ior(value).cbrt(),
        role if role.is_reflectance() => value.cbrt(),
        _ => value,
    }
}

/// True where no picture needs to be rendered between the ends of an axis.
pub(crate) fn is_linear(model: &Model, axis: &Axis) -> bool {
    Coordinate::of(model, axis).is_linear
}

impl Synthesis {
    /// For targets of a model over a lattice, compared with the given shares of each kind of picture.
    pub(crate) fn new(model: &Model, lattice: &Lattice, shares: Vec<f64>) -> Self {
        Self {
            axes: lattice.axes.iter().map(|axis| Coordinate::of(model, axis)).collect(),
            shares,
            components: Vec::new(),
            strata: HashMap::new(),
            learnt: HashSet::new(),
            errors: Vec::new(),
        }
    }

    /// True for points that were rendered.
    pub(crate) fn knows(&self, point: &Point) -> bool {
        self.learnt.contains(point)
    }

    /// Learns from rendered pictures.
    pub(crate) fn learn(&mut self, rendered: &[Rendered], mix: &Mix) {
        if rendered.is_empty() {
            return;
        }
        let between = self.between(rendered);
        let mixed: Vec<LabPictures> = between.iter().map(|(a, b, share, _)| mix(*a, *b, *share)).collect();
        if self.components.is_empty() {
            let kind = |kind: usize| {
                let pictures = rendered.iter().map(|r| &r.pictures).chain(&mixed);
                let samples: Vec<&[f32]> = pictures.map(|pictures| &*pictures[kind]).collect();
                let noise = rendered.iter().map(|r| r.noise[kind]).sum::<f64>() / rendered.len() as f64;
                Components::of(&samples, self.tolerance(kind, noise))
            };
            self.components = (0..self.shares.len()).map(kind).collect();
        }
        // Whole batches are what a synthesis starts from; candidates come one by one, and were foreseen.
        let error = if let [one] = rendered { self.error(&one.point, &one.pictures) } else { None };
        self.errors.extend(error);
        for Rendered { point, pictures, noise } in rendered {
            self.learnt.insert(point.clone());
            self.add(point, (pictures, noise), error);
        }
        for ((a, b, _, point), pictures) in between.iter().zip(&mixed) {
            let ends = rendered[*a].noise.iter().zip(&rendered[*b].noise);
            let noise: Vec<f64> = ends.map(|(a, b)| a.max(*b)).collect();
            self.add(point, (pictures, &noise), None);
        }
    }

    /// Length that components may leave of a picture with noise of a squared length.
    fn tolerance(&self, kind: usize, noise: f64) -> f64 {
        (LEFT_OUT / self.shares[kind].max(1e-12)).hypot(NOISES * noise.sqrt())
    }

    /// Between which of some rendered pictures others follow: their places, the share of the second, and the point.
    fn between(&self, rendered: &[Rendered]) -> Vec<(usize, usize, f64, Point)> {
        let Some(axis) = self.axes.iter().position(|axis| axis.is_linear) else { return Vec::new() };
        let coordinate = &self.axes[axis];
        let last = coordinate.levels.len() - 1;
        let mut between = Vec::new();
        for (a, low) in rendered.iter().enumerate().filter(|(_, r)| r.point[axis] == 0) {
            let mut high = low.point.clone();
            high[axis] = last as u32;
            let Some(b) = rendered.iter().position(|r| r.point == high) else { continue };
            let mut before = 0;
            for step in 1..=BETWEEN {
                let place = step as f64 / (BETWEEN + 1) as f64;
                let level = coordinate.values.partition_point(|v| *v < place);
                if level == before || level >= last {
                    continue;
                }
                before = level;
                let levels = &coordinate.levels;
                let share = (levels[level] - levels[0]) / (levels[last] - levels[0]);
                let mut point = high.clone();
                point[axis] = level as u32;
                between.push((a, b, share, point));
            }
        }
        between
    }

    /// How far the synthesised picture of a point is from the rendered one, in fitness; `None` where there is none.
    fn error(&mut self, point: &Point, pictures: &LabPictures) -> Option<f64> {
        let seen = self.seen(pictures);
        self.distances(&seen, std::slice::from_ref(point)).map(|distances| distances[0])
    }

    fn add(&mut self, point: &Point, (pictures, noise): (&LabPictures, &[f64]), error: Option<f64>) {
        let tolerances: Vec<f64> =
            noise.iter().enumerate().map(|(kind, v)| self.tolerance(kind, *v)).collect();
        let kinds = self.components.iter_mut().zip(pictures).zip(tolerances);
        let loadings: Vec<Vec<f64>> = kinds.map(|((c, p), t)| c.extended(p, t).values).collect();
        let place = self.place(point);
        let stratum = self.strata.entry(self.switches(point)).or_default();
        if stratum.points.contains(&place) {
            return;
        }
        stratum.points.push(place);
        stratum.loadings.push(loadings);
        stratum.is_stale |= stratum.points.len() < MANY || error.is_none_or(|error| error > OFF);
    }

    fn switches(&self, point: &Point) -> Point {
        self.axes.iter().zip(point).filter(|(axis, _)| axis.is_switch).map(|(_, index)| *index).collect()
    }

    fn place(&self, point: &Point) -> Vec<f64> {
        let axes = self.axes.iter().zip(point).filter(|(axis, _)| !axis.is_switch);
        axes.map(|(axis, index)| axis.values[*index as usize]).collect()
    }

    /// A picture as the components show it.
    pub(crate) fn seen(&self, pictures: &LabPictures) -> Vec<Loadings> {
        self.components.iter().zip(pictures).map(|(c, picture)| c.loadings(picture)).collect()
    }

    /// Forecasts of the fitness of points to what is seen; `None` where nothing is known.
    pub(crate) fn distances(&mut self, seen: &[Loadings], points: &[Point]) -> Option<Vec<f64>> {
        let lengths: Vec<usize> = self.components.iter().map(Components::len).collect();
        let mut wanted: HashMap<Point, Vec<(usize, Vec<f64>)>> = HashMap::new();
        for (k, point) in points.iter().enumerate() {
            wanted.entry(self.switches(point)).or_default().push((k, self.place(point)));
        }
        let mut distances = vec![f64::MAX; points.len()];
        let mut is_known = false;
        for (switches, group) in wanted {
            let Some(stratum) = self.strata.get_mut(&switches) else { continue };
            stratum.prepare(&lengths);
            let new: Vec<&(usize, Vec<f64>)> =
                group.iter().filter(|(k, _)| !stratum.foreseen.contains_key(&points[*k])).collect();
            let places: Vec<Vec<f64>> = new.iter().map(|(_, place)| place.clone()).collect();
            for ((k, _), loadings) in new.iter().zip(stratum.loadings_at(&places)) {
                stratum.foreseen.insert(points[*k].clone(), loadings);
            }
            for (k, _) in &group {
                let foreseen = &stratum.foreseen[&points[*k]];
                let mut first = 0;
                distances[*k] = 0.0;
                for ((share, seen), length) in self.shares.iter().zip(seen).zip(&stratum.lengths) {
                    distances[*k] += share * distance(seen, &foreseen[first..first + length]);
                    first += length;
                }
            }
            is_known = true;
        }
        is_known.then_some(distances)
    }
}

impl Stratum {
    /// Fits the loadings to the parameters, if something new was learnt.
    fn prepare(&mut self, lengths: &[usize]) {
        if !self.is_stale && self.function.is_some() {
            return;
        }
        self.foreseen.clear();
        self.is_stale = false;
        self.lengths = lengths.to_vec();
        let values: Vec<Vec<f64>> = self.loadings.iter().map(|row| joined(row, lengths)).collect();
        let axes = self.points.first().map_or(0, Vec::len);
        let known = self.metric.take().unwrap_or_else(|| Metric::plain(axes));
        let metric = known.tuned(&self.points, &values);
        self.metric = Some(metric.clone());
        let smooth = |metric| Interpolation::fit(metric, &self.points, &values).map(Surface::Smooth);
        let function = match self.points.len() {
            0..FEWEST => None,
            FEWEST..WHOLE => smooth(metric),
            _ => Some(Surface::Local(metric, values)),
        };
        self.function = Some(function.unwrap_or(Surface::Nearest));
    }

    fn loadings_at(&self, places: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let lengths = &self.lengths;
        let nearest = |place: &Vec<f64>| {
            let around = self.around(place, 1, self.points.len());
            around.first().map_or_else(Vec::new, |k| joined(&self.loadings[*k], lengths))
        };
        match &self.function {
            Some(Surface::Smooth(function)) => function.at_all(places),
            Some(Surface::Local(metric, values)) => {
                let local = |place: &Vec<f64>| {
                    let around = self.around(place, AROUND, values.len());
                    let points: Vec<Vec<f64>> = around.iter().map(|k| self.points[*k].clone()).collect();
                    let values: Vec<Vec<f64>> = around.iter().map(|k| values[*k].clone()).collect();
                    let function = Interpolation::fit(metric.clone(), &points, &values);
                    function.map_or_else(|| nearest(place), |function| function.at(place))
                };
                places.par_iter().map(local).collect()
            }
            Some(Surface::Nearest) | None => places.iter().map(nearest).collect(),
        }
    }

    /// The places of those of the first points that are nearest to another point, nearest first.
    fn around(&self, place: &[f64], count: usize, first: usize) -> Vec<usize> {
        let squared = |k: usize| self.points[k].iter().zip(place).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let mut order: Vec<(f64, usize)> = (0..first).map(|k| (squared(k), k)).collect();
        let count = count.min(order.len());
        let by_distance = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if count < order.len() {
            order.select_nth_unstable_by(count, by_distance);
        }
        order.truncate(count);
        order.sort_by(by_distance);
        order.into_iter().map(|(_, k)| k).collect()
    }
}

/// Loadings of all kinds one after the other; 0 for components that were not known yet.
fn joined(row: &[Vec<f64>], lengths: &[usize]) -> Vec<f64> {
    let padded = |(values, length): (&Vec<f64>, &usize)| {
        let mut values = values.clone();
        values.resize(*length, 0.0);
        values
    };
    row.iter().zip(lengths).flat_map(padded).collect()
}

/// Distance between what is seen and a synthesised picture.
fn distance(seen: &Loadings, foreseen: &[f64]) -> f64 {
    let foreseen = foreseen.iter().copied().chain(std::iter::repeat(0.0));
    let squared: f64 = seen.values.iter().zip(foreseen).map(|(a, b)| (a - b).powi(2)).sum();
    (squared + seen.rest).sqrt()
}
