//! Target materials that were rendered already: the paper's database of renderings, in memory and bounded.

use std::collections::HashSet;
use std::num::NonZeroUsize;
use std::sync::Arc;

use lookmatch_materials::{Material, Role, Value};
use lookmatch_search::{Objective, ObjectiveError, Point};
use lru::LruCache;

use crate::stage::{Appearance, Stage};
use crate::{Plan, RemapError};

/// Memory for kept appearances, in bytes.
const CAPACITY: usize = 500 << 20;

/// What an appearance depends on: the bits of every value, or those of the albedo where there is no more than that.
pub(crate) type Key = Vec<u64>;

pub(crate) fn key(material: &Material) -> Key {
    if material.by_role(Role::SpecularReflectance).is_some_and(|scale| scale.mean() == Some(0.0)) {
        let bsdf = material.bsdf();
        if bsdf.sampling().is_none() {
            return bsdf.diffuse().map(f64::to_bits).to_vec();
        }
    }
    material.values().iter().flat_map(Value::bits).collect()
}

/// The most recently used target appearances.
pub(crate) struct Gallery<'a> {
    plan: &'a Plan,
    stage: &'a Stage,
    lattice: &'a lookmatch_search::Lattice,
    kept: LruCache<Key, Arc<Appearance>>,
}

impl<'a> Gallery<'a> {
    pub(crate) fn new(plan: &'a Plan, stage: &'a Stage, lattice: &'a lookmatch_search::Lattice) -> Self {
        let count =
            NonZeroUsize::new(CAPACITY / stage.appearance_bytes().max(1)).unwrap_or(NonZeroUsize::MIN);
        Self { plan, stage, lattice, kept: LruCache::new(count) }
    }

    /// A source material as it is seen.
    pub(crate) fn appearance(&self, source: &Material) -> Appearance {
        self.stage.appearance(source)
    }

    /// The appearances of target materials at some points beside a source.
    fn look(&mut self, source: &Material, points: &[Point]) -> Result<Vec<Arc<Appearance>>, RemapError> {
        let materials = points
            .iter()
            .map(|p| self.plan.target_material(source, &self.lattice.values(p)))
            .collect::<Result<Vec<_>, _>>()?;
        let wanted: Vec<Key> = materials.iter().map(key).collect();
        let mut missing: Vec<(Key, Material)> = Vec::new();
        for (key, material) in wanted.iter().zip(&materials) {
            if !self.kept.contains(key) && missing.iter().all(|(known, _)| known != key) {
                missing.push((key.clone(), material.clone()));
            }
        }
        let (keys, new): (Vec<_>, Vec<_>) = missing.into_iter().unzip();
        let rendered = self.stage.appearances(&new).into_iter().map(Arc::new);
        let fresh: Vec<(Key, Arc<Appearance>)> = keys.into_iter().zip(rendered).collect();
        // Everything is looked up before anything is stored: a large batch must not push out its own members.
        let mut seen = Vec::with_capacity(points.len());
        for (key, material) in wanted.iter().zip(materials) {
            let new = fresh.iter().find(|(k, _)| k == key).map(|(_, appearance)| appearance.clone());
            let appearance = new.or_else(|| self.kept.get(key).cloned());
            let appearance = appearance.unwrap_or_else(|| Arc::new(self.stage.appearance(&material)));
            seen.push(appearance);
        }
        for (key, appearance) in fresh {
            self.kept.put(key, appearance);
        }
        Ok(seen)
    }
}

/// The fitness of target points against one source material.
pub(crate) struct Match<'a, 'b> {
    pub(crate) gallery: &'a mut Gallery<'b>,
    pub(crate) source: &'a Material,
    pub(crate) appearance: &'a Appearance,
    /// Points that were compared so far, also by an earlier search of the same source.
    pub(crate) compared: HashSet<Point>,
    /// Asked before each batch; true stops the search.
    pub(crate) stop: &'a (dyn Fn() -> bool + Sync),
}

/// The search was stopped from outside.
#[derive(Debug, thiserror::Error)]
#[error("stopped")]
pub(crate) struct Stopped;

impl Objective for Match<'_, '_> {
    fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
        use rayon::prelude::*;
        if (self.stop)() {
            return Err(Box::new(Stopped));
        }
        self.compared.extend(points.iter().cloned());
        let targets = self.gallery.look(self.source, points)?;
        let stage = self.gallery.stage;
        let fitness = |appearance: &Arc<Appearance>| stage.fitness(self.appearance, appearance);
        Ok(targets.par_iter().map(fitness).collect())
    }
}
