//! Materials that were rendered already: the paper's database of renderings, in memory and bounded.

use std::cell::OnceCell;
use std::collections::HashSet;
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};

use lookmatch_materials::{Material, Role, Value};
use lookmatch_search::{Lattice, Objective, ObjectiveError, Point, SearchError};
use lru::LruCache;
use rayon::prelude::*;

use crate::carry::{Body, SourceLook};
use crate::stage::{Appearance, Stage};
use crate::synthesis::{Rendered, Syntheses, Synthesis, is_linear};
use crate::{Plan, RemapError};

/// Memory for kept appearances, in bytes.
const CAPACITY: usize = 500 << 20;

/// What an appearance depends on: the model and the bits of every value, or those of the albedo where there is no more than
/// that.
pub(crate) type Key = Vec<u64>;

pub(crate) fn key(material: &Material) -> Key {
    let is_known = material.model().renderer.is_none();
    if is_known && material.by_role(Role::SpecularReflectance).is_some_and(|scale| scale.mean() == Some(0.0))
    {
        let bsdf = material.bsdf();
        if bsdf.sampling().is_none() {
            return bsdf.diffuse().map(f64::to_bits).to_vec();
        }
    }
    let model = material.model().name.bytes().map(u64::from);
    model.chain(material.values().iter().flat_map(Value::bits)).collect()
}

/// The most recently used appearances of a stage.
pub(crate) struct Gallery {
    kept: Mutex<LruCache<Key, Arc<Appearance>>>,
}

impl Gallery {
    /// Room for appearances of a size in bytes.
    pub(crate) fn new(appearance_bytes: usize) -> Self {
        let count = NonZeroUsize::new(CAPACITY / appearance_bytes.max(1)).unwrap_or(NonZeroUsize::MIN);
        Self { kept: Mutex::new(LruCache::new(count)) }
    }

    fn find(&self, key: &Key) -> Option<Arc<Appearance>> {
        // A panic elsewhere leaves nothing half-written in this map.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).get(key).cloned()
    }

    /// Materials as they are seen on a stage; what is not known yet is rendered.
    pub(crate) fn look(&self, stage: &Stage, materials: &[Material]) -> Vec<Arc<Appearance>> {
        let wanted: Vec<Key> = materials.iter().map(key).collect();
        // Everything is looked up before anything is stored: a large batch must not push out its own members.
        let known: Vec<Option<Arc<Appearance>>> = wanted.iter().map(|key| self.find(key)).collect();
        let mut missing: Vec<usize> = Vec::new();
        for k in (0..materials.len()).filter(|k| known[*k].is_none()) {
            if missing.iter().all(|other| wanted[*other] != wanted[k]) {
                missing.push(k);
            }
        }
        let new: Vec<Material> = missing.iter().map(|k| materials[*k].clone()).collect();
        let rendered: Vec<Arc<Appearance>> = stage.appearances(&new).into_iter().map(Arc::new).collect();
        let fresh = |key: &Key| missing.iter().position(|k| wanted[*k] == *key).map(|i| rendered[i].clone());
        let seen =
            known.into_iter().zip(&wanted).filter_map(|(known, key)| known.or_else(|| fresh(key))).collect();
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        missing.iter().zip(rendered).for_each(|(k, appearance)| {
            kept.put(wanted[*k].clone(), appearance);
        });
        seen
    }
}

/// The fitness of target points against one source material.
pub(crate) struct Match<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) stage: &'a Stage,
    pub(crate) lattice: &'a Lattice,
    pub(crate) source: SourceLook<'a>,
    pub(crate) appearance: &'a Appearance,
    /// Points that were compared so far, also by an earlier search of the same source.
    pub(crate) compared: HashSet<Point>,
    /// The family of its targets, where pictures are synthesised.
    pub(crate) family: Option<Key>,
    /// What is known of targets.
    pub(crate) syntheses: &'a Syntheses,
    /// Asked before each batch; true stops the search.
    pub(crate) stop: &'a (dyn Fn() -> bool + Sync),
}

/// The search was stopped from outside.
#[derive(Debug, thiserror::Error)]
#[error("stopped")]
pub(crate) struct Stopped;

impl Match<'_> {
    /// Hands rendered targets to the synthesis of their family.
    fn learn(&self, family: &Key, points: &[Point], targets: &[Material], seen: &[Arc<Appearance>]) {
        let mut families = self.syntheses.families();
        let synthesis = families.entry(family.clone()).or_insert_with(|| {
            Synthesis::new(self.plan.to.model(), self.lattice, self.stage.picture_shares())
        });
        let new: Vec<usize> = (0..points.len()).filter(|k| !synthesis.knows(&points[*k])).collect();
        let rendered = |k: &usize| {
            let pictures = self.stage.pictures(&seen[*k]);
            Rendered { point: points[*k].clone(), noise: vec![0.0; pictures.len()], pictures }
        };
        let rendered: Vec<Rendered> = new.iter().map(rendered).collect();
        // Only what lies between linear pictures needs them.
        let planes = OnceCell::new();
        let mix = |a: usize, b: usize, share: f64| {
            let planes = planes.get_or_init(|| {
                let targets: Vec<Material> = new.iter().map(|k| targets[*k].clone()).collect();
                self.stage.linear_planes(&targets)
            });
            self.stage.mixed_pictures([&planes[a], &planes[b]], share)
        };
        synthesis.learn(&rendered, &mix);
    }
}

impl Objective for Match<'_> {
    fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
        if (self.stop)() {
            return Err(Box::new(Stopped));
        }
        self.compared.extend(points.iter().cloned());
        let material = |p: &Point| self.plan.target_beside(&self.source, &self.lattice.values(p));
        let targets = points.iter().map(material).collect::<Result<Vec<_>, RemapError>>()?;
        self.syntheses.count(&targets);
        let seen = self.stage.known_appearances(&targets);
        if let Some(family) = &self.family {
            self.learn(family, points, &targets, &seen);
        }
        Ok(seen.par_iter().map(|seen| self.stage.fitness(self.appearance, seen)).collect())
    }

    fn forecast(&mut self, points: &[Point]) -> Option<Vec<f64>> {
        let mut families = self.syntheses.families();
        let synthesis = families.get_mut(self.family.as_ref()?)?;
        let seen = synthesis.seen(&self.stage.pictures(self.appearance));
        synthesis.distances(&seen, points)
    }

    fn is_linear(&self, axis: usize) -> bool {
        is_linear(self.plan.to.model(), &self.lattice.axes[axis])
    }
}

/// The error of work that was stopped from outside.
pub(crate) fn stopped() -> RemapError {
    RemapError::Search(SearchError::Objective(Box::new(Stopped)))
}

/// What targets of a source have in common: everything but what is searched.
pub(crate) fn family(plan: &Plan, source: &SourceLook, body: Body) -> Result<Option<Key>, RemapError> {
    let first: Vec<f64> = plan.target_axes.iter().map(|axis| axis.value(axis.len() - 1)).collect();
    let is_synthesised = plan.search.starts_with("synthesis");
    is_synthesised.then(|| Ok(key(&plan.target_with(source, &first, body)?))).transpose()
}
