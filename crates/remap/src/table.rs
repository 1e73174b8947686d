//! The table behind an exhaustive search: every target as a few coordinates, which prove most of them no match.
//!
//! Each look is rendered once and projected ([`crate::projection`]). A lower bound of its fitness to any source then costs a
//! hundred multiplications, and only targets whose bound lies below the best fitness found are compared in full. What
//! is found is what comparing all of them would have found, to the bit.

use std::collections::HashMap;

use lookmatch_imaging::Columns;
use lookmatch_materials::Material;
use lookmatch_search::{Bounds, Lattice, Outcome, Point, SearchError};
use rayon::prelude::*;

use crate::gallery::{Key, key, stopped};
use crate::projection::{Projection, Sketches};
use crate::stage::{Appearance, Stage};
use crate::{Event, Plan, RemapError};

/// Materials that are rendered at once: a multiple of the rows of a matrix product.
pub(crate) const BATCH: usize = 60;
/// Sources that are bounded by one thread without a break.
const ROWS: usize = 6;
/// Sources and targets each that the projections are made from.
const SAMPLES: usize = 80;
/// Fitness that a projection may leave out of a sample: far less than the best matches have, so that few others seem as
/// good.
const TOLERANCE: f64 = 0.002;

/// All targets of a plan, to be compared with sources.
pub(crate) struct FitnessTable<'a> {
    stage: &'a Stage,
    lattice: &'a Lattice,
    /// A material of each look that a target can have.
    looks: Vec<Material>,
    /// The look of each target point, in lexicographic order.
    look_of: Vec<u32>,
    projections: [Projection; 2],
    /// Coordinates of the looks by light.
    coordinates: [Columns; 2],
    /// Fitness by which rounding may have moved each look.
    slack: Vec<f64>,
    /// One of the looks, where all have the same diffuse images.
    diffuse: Option<Appearance>,
}

/// A source material and where to search its match.
pub(crate) struct Task {
    pub(crate) source: Material,
    pub(crate) bounds: Bounds,
}

/// The match of a source.
pub(crate) struct Found {
    pub(crate) outcome: Outcome,
    /// Targets that were compared in full.
    pub(crate) compared: usize,
}

/// A source on its way to its match.
struct Pursuit {
    seen: Appearance,
    /// Lower bounds of the fitness, by look.
    least: Vec<f64>,
    /// Target points within bounds.
    places: Vec<usize>,
    /// Fitness of the targets that were compared in full and their first places, by look.
    compared: HashMap<u32, (f64, usize)>,
}

/// A target to compare in full: its look, the source that asks for it, its first place within bounds.
type Pair = (u32, usize, usize);

impl<'a> FitnessTable<'a> {
    /// Renders all targets; `None` where targets depend on their source, so that they cannot be shared.
    pub(crate) fn fill(
        plan: &'a Plan,
        stage: &'a Stage,
        lattice: &'a Lattice,
        sources: &Lattice,
        observe: &mut dyn FnMut(Event),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self>, RemapError> {
        if !targets_are_shared(plan, lattice, sources)? {
            return Ok(None);
        }
        let any = plan.source_material(&sources.values(&vec![0; sources.axes.len()]))?;
        let (looks, look_of) = looks(plan, lattice, &any)?;
        let projections = projections(plan, stage, sources, &looks)?;
        let mut sketches = [Sketches::default(), Sketches::default()];
        let (mut first_key, mut is_diffuse_shared) = (None, true);
        for (k, batch) in looks.chunks(BATCH).enumerate() {
            if stop() {
                return Err(stopped());
            }
            let (new, keys) = stage.sketches(batch, &projections);
            first_key = first_key.or(keys.first().copied());
            is_diffuse_shared &= keys.iter().all(|key| Some(*key) == first_key);
            sketches.iter_mut().zip(new).for_each(|(sketches, new)| sketches.extend(new));
            observe(Event::Compared { done: k * BATCH + batch.len(), total: looks.len() });
        }
        let slack = slack(stage, &sketches);
        let columns = |light: usize| {
            let length = projections[light].len();
            Columns::new(length, &sketches[light].rows(length))
        };
        let coordinates = [columns(0), columns(1)];
        let diffuse = looks.first().filter(|_| is_diffuse_shared).map(|look| stage.appearance(look));
        Ok(Some(Self { stage, lattice, looks, look_of, projections, coordinates, slack, diffuse }))
    }

    /// Looks that were rendered.
    pub(crate) fn len(&self) -> usize {
        self.looks.len()
    }

    /// The best target of each source within its bounds, at a tie the first in lexicographic order.
    pub(crate) fn search(
        &self,
        tasks: &[Task],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<Found>, RemapError> {
        let mut pursuits = self.pursuits(tasks);
        // At first the most promising target of each source; then there is a fitness to beat.
        for _ in 0..2 {
            let wanted = |(k, pursuit): (usize, &Pursuit)| -> Vec<Pair> {
                pursuit.wanted(&self.look_of).into_iter().map(|(look, place)| (look, k, place)).collect()
            };
            let mut pairs: Vec<Pair> = pursuits.par_iter().enumerate().flat_map_iter(wanted).collect();
            pairs.sort_unstable();
            let by_look: Vec<&[Pair]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
            for batch in by_look.chunks(BATCH) {
                if stop() {
                    return Err(stopped());
                }
                self.compare(batch, &mut pursuits);
            }
        }
        pursuits.iter().map(|pursuit| self.found(pursuit)).collect()
    }

    /// Renders the sources, and bounds their fitness to every target from below.
    fn pursuits(&self, tasks: &[Task]) -> Vec<Pursuit> {
        let sources: Vec<Material> = tasks.iter().map(|task| task.source.clone()).collect();
        let seen = self.stage.appearances(&sources);
        let sketches = self.stage.sketches_of(&seen, &self.projections);
        let least = self.least_fitness(&sketches);
        let pursuit = |((task, seen), mut least): ((&Task, Appearance), Vec<f64>)| {
            let diffuse =
                self.diffuse.as_ref().map_or(0.0, |target| self.stage.diffuse_fitness(&seen, target));
            least.iter_mut().for_each(|least| *least += diffuse);
            let places = places(self.lattice, &task.bounds);
            Pursuit { seen, least, places, compared: HashMap::new() }
        };
        tasks.iter().zip(seen).zip(least).map(pursuit).collect()
    }

    /// Lower bounds of the specular fitness of all sources to all looks.
    fn least_fitness(&self, sketches: &[Sketches; 2]) -> Vec<Vec<f64>> {
        let mut least: Vec<Vec<f64>> =
            slack(self.stage, sketches).iter().map(|s| self.slack.iter().map(|t| -s - t).collect()).collect();
        for (light, share) in self.stage.shares().into_iter().enumerate() {
            let projection = &self.projections[light];
            let rows = sketches[light].rows(projection.len());
            least.par_chunks_mut(ROWS).zip(rows.par_chunks(ROWS)).for_each(|(least, rows)| {
                let squared = self.coordinates[light].squared_distances(rows);
                for (least, squared) in least.iter_mut().flatten().zip(squared) {
                    *least += share * projection.least_distance(squared);
                }
            });
        }
        least
    }

    /// Compares the looks of a batch in full, each with all sources that ask for it.
    fn compare(&self, batch: &[&[Pair]], pursuits: &mut [Pursuit]) {
        let looks: Vec<Material> =
            batch.iter().map(|pairs| self.looks[pairs[0].0 as usize].clone()).collect();
        let seen = self.stage.appearances(&looks);
        let with_look =
            |(pairs, seen): (&&'_ [Pair], _)| pairs.iter().map(move |pair| (*pair, seen)).collect::<Vec<_>>();
        let pairs: Vec<(Pair, &Appearance)> = batch.iter().zip(&seen).flat_map(with_look).collect();
        let fitness = |((_, pursuit, _), seen): &(Pair, &Appearance)| {
            self.stage.fitness(&pursuits[*pursuit].seen, seen)
        };
        let fitness: Vec<f64> = pairs.par_iter().map(fitness).collect();
        for (((look, pursuit, place), _), fitness) in pairs.into_iter().zip(fitness) {
            pursuits[pursuit].compared.insert(look, (fitness, place));
        }
    }

    fn found(&self, pursuit: &Pursuit) -> Result<Found, RemapError> {
        let (fitness, place) = pursuit.best().ok_or(RemapError::Search(SearchError::NothingEvaluated))?;
        let best = point(self.lattice, place);
        if !fitness.is_finite() {
            let parameters = self.lattice.describe(&best);
            return Err(RemapError::Search(SearchError::NotFinite { fitness, parameters, point: best }));
        }
        // Every target within bounds was considered.
        let evaluations = pursuit.places.len();
        let outcome = Outcome { best, fitness: fitness + 0.0, evaluations, generations: 0 };
        Ok(Found { outcome, compared: pursuit.compared.len() })
    }
}

impl Pursuit {
    /// The lowest fitness found and its first place; what is no number comes first, to be reported.
    fn best(&self) -> Option<(f64, usize)> {
        let order = |f: f64| if f.is_nan() { f64::NEG_INFINITY } else { f };
        let found = self.compared.values().copied();
        found.min_by(|a, b| order(a.0).total_cmp(&order(b.0)).then(a.1.cmp(&b.1)))
    }

    /// Looks to compare next, each with its first place: the most promising one at first, then all that may be as good
    /// as the best.
    fn wanted(&self, look_of: &[u32]) -> Vec<(u32, usize)> {
        let least = |place: &usize| self.least[look_of[*place] as usize];
        let limit = match self.best() {
            Some((fitness, _)) => fitness,
            None => self.places.iter().map(least).fold(f64::INFINITY, f64::min),
        };
        // A bound that is no number excludes nothing.
        let may_be_best = |place: &&usize| least(place) <= limit || least(place).is_nan();
        let mut wanted: Vec<(u32, usize)> =
            self.places.iter().filter(may_be_best).map(|place| (look_of[*place], *place)).collect();
        wanted.sort_unstable();
        wanted.dedup_by_key(|(look, _)| *look);
        wanted.retain(|(look, _)| !self.compared.contains_key(look));
        wanted
    }
}

/// The looks that targets can have, a material of each, and the look of each target point.
fn looks(plan: &Plan, lattice: &Lattice, source: &Material) -> Result<(Vec<Material>, Vec<u32>), RemapError> {
    let mut known: HashMap<Key, u32> = HashMap::new();
    let (mut looks, mut look_of) = (Vec::new(), Vec::with_capacity(lattice.len()));
    for point in lattice.points(&Bounds::full(lattice)) {
        let target = plan.target_material(source, &lattice.values(&point))?;
        let look = *known.entry(key(&target)).or_insert(looks.len() as u32);
        if look as usize == looks.len() {
            looks.push(target);
        }
        look_of.push(look);
    }
    Ok((looks, look_of))
}

/// Projections that suit sources and targets alike.
fn projections(
    plan: &Plan,
    stage: &Stage,
    sources: &Lattice,
    looks: &[Material],
) -> Result<[Projection; 2], RemapError> {
    let mut samples: Vec<Material> = spread(looks.len()).map(|k| looks[k].clone()).collect();
    for place in spread(sources.len()) {
        samples.push(plan.source_material(&sources.values(&point(sources, place)))?);
    }
    let samples: Vec<Appearance> = samples.chunks(BATCH).flat_map(|batch| stage.appearances(batch)).collect();
    Ok(stage.fit_projections(&samples, TOLERANCE))
}

/// At most [`SAMPLES`] of some places, spread over all of them: multiples of the golden ratio leave no gaps, neither among
/// the places nor among their remainders.
fn spread(count: usize) -> impl Iterator<Item = usize> {
    let place = move |k: usize| ((k as f64 * 0.618_033_988_749_895).fract() * count as f64) as usize;
    (0..SAMPLES.min(count)).map(place)
}

/// Fitness by which rounding may have moved each image.
fn slack(stage: &Stage, [point, environment]: &[Sketches; 2]) -> Vec<f64> {
    let shares = stage.shares();
    let slack = point.slack.iter().zip(&environment.slack);
    slack.map(|(point, environment)| shares[0] * point + shares[1] * environment).collect()
}

/// Places of the points within bounds, ascending.
fn places(lattice: &Lattice, bounds: &Bounds) -> Vec<usize> {
    lattice.axes.iter().enumerate().fold(vec![0], |places, (k, axis)| {
        let levels = bounds.low[k] as usize..=bounds.high[k] as usize;
        places.iter().flat_map(|place| levels.clone().map(move |i| place * axis.len() + i)).collect()
    })
}

/// The point at a place in lexicographic order.
fn point(lattice: &Lattice, mut place: usize) -> Point {
    let mut point: Point = lattice
        .axes
        .iter()
        .rev()
        .map(|axis| {
            let index = place % axis.len();
            place /= axis.len();
            index as u32
        })
        .collect();
    point.reverse();
    point
}

/// True where no source changes what its targets take over.
fn targets_are_shared(plan: &Plan, lattice: &Lattice, sources: &Lattice) -> Result<bool, RemapError> {
    let first = lattice.values(&vec![0; lattice.axes.len()]);
    let target = |point: Point| -> Result<Material, RemapError> {
        plan.target_material(&plan.source_material(&sources.values(&point))?, &first)
    };
    let mut targets = sources.points(&Bounds::full(sources)).map(target);
    let Some(one) = targets.next().transpose()? else { return Ok(true) };
    for other in targets {
        if other? != one {
            return Ok(false);
        }
    }
    Ok(true)
}
