//! The fitness of every target point against every source point: what an exhaustive search looks up.
//!
//! Each target is rendered once and compared with all sources, instead of once for every source.

use lookmatch_materials::{Material, Role};
use lookmatch_search::{Bounds, Lattice, Objective, ObjectiveFn, Point};
use rayon::prelude::*;

use crate::stage::{Appearance, Stage};
use crate::{Event, Plan, RemapError};

/// Targets that are rendered at once.
const BLOCK: usize = 64;

/// Fitness by source point and target point, both in lexicographic order.
pub(crate) struct FitnessTable<'a> {
    lattice: &'a Lattice,
    rows: Vec<Vec<f64>>,
}

impl<'a> FitnessTable<'a> {
    /// Fills the table; `None` where targets depend on their source beyond the diffuse reflectance, so that they cannot be
    /// shared, or where `stop` said so.
    pub(crate) fn fill(
        plan: &Plan,
        stage: &Stage,
        lattice: &'a Lattice,
        sources: &Lattice,
        observe: &mut dyn FnMut(Event),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self>, RemapError> {
        if !targets_are_shared(plan)? {
            return Ok(None);
        }
        let materials = sources
            .points(&Bounds::full(sources))
            .map(|p| plan.source_material(&sources.values(&p)))
            .collect::<Result<Vec<_>, _>>()?;
        let seen: Vec<Appearance> =
            materials.chunks(BLOCK).flat_map(|block| stage.appearances(block)).collect();
        let mut rows: Vec<Row> = materials.into_iter().zip(seen).map(Row::new).collect();
        let points: Vec<Point> = lattice.points(&Bounds::full(lattice)).collect();
        let mut done = 0;
        for block in points.chunks(BLOCK) {
            if stop() {
                return Ok(None);
            }
            let values: Vec<Vec<f64>> = block.iter().map(|p| lattice.values(p)).collect();
            let targets = values
                .iter()
                .map(|v| plan.target_material(&rows[0].source, v))
                .collect::<Result<Vec<_>, _>>()?;
            let targets: Vec<(Appearance, bool)> = stage
                .appearances(&targets)
                .into_iter()
                .zip(targets.iter().map(|t| t.bsdf().sampling().is_some()))
                .collect();
            rows.par_iter_mut().try_for_each(|row| row.extend(plan, stage, &values, &targets))?;
            done += block.len();
            observe(Event::Compared { done, total: points.len() });
        }
        Ok(Some(Self { lattice, rows: rows.into_iter().map(|row| row.fitness).collect() }))
    }

    /// The objective of the source point at a place.
    pub(crate) fn objective(&self, place: usize) -> impl Objective {
        let row = &self.rows[place];
        ObjectiveFn(move |point: &Point| {
            let levels = self.lattice.axes.iter().map(|axis| axis.len());
            row[point.iter().zip(levels).fold(0, |index, (i, n)| index * n + *i as usize)]
        })
    }
}

/// One source point on its way through all targets.
struct Row {
    source: Material,
    seen: Appearance,
    fitness: Vec<f64>,
    /// Fitness of a target without a lobe: all of them look alike.
    dark: Option<f64>,
}

impl Row {
    fn new((source, seen): (Material, Appearance)) -> Self {
        Self { source, seen, fitness: Vec::new(), dark: None }
    }

    /// Adds the fitness of a block of targets, each with its appearance and whether it has a lobe.
    fn extend(
        &mut self,
        plan: &Plan,
        stage: &Stage,
        values: &[Vec<f64>],
        targets: &[(Appearance, bool)],
    ) -> Result<(), RemapError> {
        for (values, (appearance, has_lobe)) in values.iter().zip(targets) {
            let fitness = match self.dark.filter(|_| !has_lobe) {
                Some(dark) => dark,
                None => {
                    let target = plan.target_material(&self.source, values)?;
                    stage.fitness((&self.source, &self.seen), (&target, appearance))
                }
            };
            if !has_lobe {
                self.dark = Some(fitness);
            }
            self.fitness.push(fitness);
        }
        Ok(())
    }
}

/// True where no source axis changes what a target takes over, but for the diffuse reflectance, which the specular
/// appearance does not depend on.
fn targets_are_shared(plan: &Plan) -> Result<bool, RemapError> {
    for axis in &plan.source_axes {
        let role = plan.from.model().parameter(&axis.name)?.role;
        if matches!(role, Role::ConductorIndex | Role::Extinction) {
            return Ok(false);
        }
    }
    // A searched diffuse reflectance differs between targets without a lobe.
    let searched = plan.target_axes.iter().map(|a| plan.to.model().parameter(&a.name).map(|p| p.role));
    Ok(!searched.collect::<Result<Vec<_>, _>>()?.contains(&Role::DiffuseReflectance))
}
