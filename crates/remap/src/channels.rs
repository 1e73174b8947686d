//! Materials matched channel by channel (Guarnera *et al.* 2018, 5.3): lobes of one shape whose channels differ in height.
//!
//! Each channel of a source is a grey material of its own. Targets are grey lobes of a shape (all searched parameters but the
//! first) times a scale (the first), and pictures are linear in the scale: every shape is rendered once and compared with all
//! channels of all sources. Diffuse reflections are carried over, so that the metric's diffuse part is 0.

use std::ops::Range;

use lookmatch_imaging::{Columns, lab_planes_of};
use lookmatch_materials::{Material, Role, Value};
use lookmatch_rendering::Planes;
use lookmatch_search::{Bounds, Lattice, Point, SearchError};
use rayon::prelude::*;

use crate::gallery::stopped;
use crate::projection::Projection;
use crate::stage::{Appearance, Stage};
use crate::{Event, Plan, RemapError};

/// Shapes that are rendered at once.
const BATCH: usize = 24;
/// Scales at which a shape is compared: the cubes of the multiples of 1/LEVELS. In CIELAB a lobe's lightness grows with the cube
/// root of its scale, and squared distances are parabolas over that.
const LEVELS: usize = 16;
/// Steps of the cube root at which the best scale is found in full.
const FINE: f64 = 1.0 / 48.0;
/// Places on a parabola that are looked at, from its middle to an end.
const PLACES: i32 = 32;
/// Shapes that are compared in full: those that seem to suit best.
const CANDIDATES: usize = 16;
/// Sources and targets each that the projections are made from.
const SAMPLES: usize = 80;
/// Fitness that a projection may leave out of a sample.
const TOLERANCE: f64 = 0.002;

/// The fitness of all shapes to all channels of some sources.
pub struct ChannelTable<'a> {
    plan: &'a Plan,
    stage: &'a Stage,
    shapes: Lattice,
    /// Three grey materials for each source.
    greys: Vec<Material>,
    /// By grey material and shape: the least fitness over the scale, and the cube root of the scale that has it.
    least: Vec<Vec<[f32; 2]>>,
}

/// The shape that suits one channel best, or all of them.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelMatch {
    /// Values of the target's axes but the first.
    pub shape: Vec<f64>,
    /// The value of the first axis in each channel.
    pub scale: Vec<f64>,
    /// Eq. 3 of the paper in each channel.
    pub fitness: Vec<f64>,
}

impl<'a> ChannelTable<'a> {
    /// Renders all shapes of a plan, whose first target axis must be the scale of the lobe, and compares them with sources.
    ///
    /// # Errors
    /// A plan whose first target axis is no scale up to 1; a stop from outside.
    pub fn fill(
        plan: &'a Plan,
        stage: &'a Stage,
        sources: &[Material],
        observe: &mut dyn FnMut(Event),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, RemapError> {
        let is_scale = |name: &str| {
            let role = plan.to.model().parameter(name).map(|p| p.role);
            role.is_ok_and(|role| role == Role::SpecularReflectance) && plan.to.model().linear.contains(&name)
        };
        let Some((_, shapes)) = plan.target_axes.split_first().filter(|(first, _)| is_scale(&first.name))
        else {
            let model = plan.to.model().name;
            return Err(RemapError::Option(format!(
                "{model} has no scale of its lobe to search channel by channel"
            )));
        };
        let greys: Vec<Material> =
            sources.iter().flat_map(|source| (0..3).map(|c| grey(source, c))).collect::<Result<_, _>>()?;
        let shapes = Lattice { axes: shapes.to_vec() };
        let mut table = Self { plan, stage, shapes, greys, least: Vec::new() };
        table.compare(observe, stop)?;
        Ok(table)
    }

    /// The target of a shape at the full scale, without a body.
    fn target(&self, shape: &Point) -> Result<Material, RemapError> {
        let values: Vec<f64> = std::iter::once(1.0).chain(self.shapes.values(shape)).collect();
        self.plan.target_material(&self.greys[0], &values)
    }

    fn points(&self) -> Vec<Point> {
        self.shapes.points(&Bounds::full(&self.shapes)).collect()
    }

    fn compare(
        &mut self,
        observe: &mut dyn FnMut(Event),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), RemapError> {
        let points = self.points();
        let projections = self.projections(&points)?;
        let mut sketches: [Vec<f32>; 2] = Default::default();
        for batch in self.greys.chunks(BATCH) {
            let new = self.stage.sketches_of(&self.stage.appearances(batch), &projections);
            sketches.iter_mut().zip(new).for_each(|(all, new)| all.extend(new.coordinates));
        }
        self.least = vec![Vec::with_capacity(points.len()); self.greys.len()];
        for (k, batch) in points.chunks(BATCH).enumerate() {
            if stop() {
                return Err(stopped());
            }
            let targets = batch.iter().map(|point| self.target(point)).collect::<Result<Vec<_>, _>>()?;
            let planes: Vec<[Planes; 2]> =
                self.stage.linear_planes(&targets).into_iter().map(|[specular, _]| specular).collect();
            let squares = [0, 1].map(|light| {
                let projection = &projections[light];
                let scaled = scaled_sketches(projection, &planes, light);
                let columns = Columns::new(projection.len(), &scaled);
                let rows: Vec<&[f32]> = sketches[light].chunks_exact(projection.len()).collect();
                rows.par_chunks(6).flat_map_iter(|rows| columns.squared_distances(rows)).collect::<Vec<f64>>()
            });
            let shares = self.stage.shares();
            let per_grey = batch.len() * LEVELS;
            self.least.par_iter_mut().enumerate().for_each(|(grey, least)| {
                let of = |light: usize| squares[light][grey * per_grey..][..per_grey].chunks_exact(LEVELS);
                least.extend(of(0).zip(of(1)).map(|(point, environment)| {
                    let (root, fitness) = least_over_levels([point, environment], shares);
                    [fitness as f32, root as f32]
                }));
            });
            observe(Event::Compared { done: k * BATCH + batch.len(), total: points.len() });
        }
        Ok(())
    }

    /// Projections that suit sources and targets alike.
    fn projections(&self, points: &[Point]) -> Result<[Projection; 2], RemapError> {
        // Multiples of the golden ratio leave no gaps.
        let spread = |count: usize| {
            let place = move |k: usize| ((k as f64 * 0.618_033_988_749_895).fract() * count as f64) as usize;
            (0..SAMPLES.min(count)).map(place)
        };
        let mut samples: Vec<Material> = spread(self.greys.len()).map(|k| self.greys[k].clone()).collect();
        let scale = self.plan.to.model().resolve(&self.plan.target_axes[0].name)?[0];
        for (k, place) in spread(points.len()).enumerate() {
            let mut target = self.target(&points[place])?;
            target.set_value(scale, Value::Colour([level(k % LEVELS); 3]))?;
            samples.push(target);
        }
        let seen: Vec<Appearance> =
            samples.chunks(BATCH).flat_map(|batch| self.stage.appearances(batch)).collect();
        Ok(self.stage.fit_projections(&seen, TOLERANCE))
    }

    /// The best match of a source: of each channel on its own, and with one shape for all of them. Only shapes that are allowed
    /// take part, given the values of the target's axes but the first.
    ///
    /// # Errors
    /// Where no shape is allowed.
    pub fn best(
        &self,
        source: usize,
        is_allowed: &dyn Fn(&[f64]) -> bool,
    ) -> Result<([ChannelMatch; 3], ChannelMatch), RemapError> {
        let places: Vec<(usize, Point)> = self
            .points()
            .into_iter()
            .enumerate()
            .filter(|(_, p)| is_allowed(&self.shapes.values(p)))
            .collect();
        if places.is_empty() {
            return Err(RemapError::Option("no shape of the target is allowed".into()));
        }
        let seen = self.stage.appearances(&self.greys[3 * source..3 * source + 3]);
        let best = |channels: Range<usize>| -> Result<ChannelMatch, RemapError> {
            let ranked = self.ranked(&places, 3 * source + channels.start..3 * source + channels.end);
            let full = |place: &&(usize, Point)| self.full(place, (channels.clone(), 3 * source), &seen);
            let candidates: Vec<ChannelMatch> = ranked.iter().map(full).collect::<Result<_, _>>()?;
            let sum = |found: &ChannelMatch| found.fitness.iter().sum::<f64>();
            let best = candidates.into_iter().min_by(|a, b| sum(a).total_cmp(&sum(b)));
            best.ok_or(RemapError::Search(SearchError::NothingEvaluated))
        };
        Ok(([best(0..1)?, best(1..2)?, best(2..3)?], best(0..3)?))
    }

    /// Shapes by the sum of their fitness to some grey materials.
    fn ranked<'p>(&self, places: &'p [(usize, Point)], greys: Range<usize>) -> Vec<&'p (usize, Point)> {
        let sum =
            |place: usize| self.least[greys.clone()].iter().map(|all| f64::from(all[place][0])).sum::<f64>();
        let mut ranked: Vec<(f64, &(usize, Point))> = places.iter().map(|p| (sum(p.0), p)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.0.cmp(&b.1.0)));
        ranked.truncate(CANDIDATES);
        ranked.into_iter().map(|(_, place)| place).collect()
    }

    /// A shape compared in full with some channels, each at its best scale.
    fn full(
        &self,
        (place, shape): &(usize, Point),
        (channels, first): (Range<usize>, usize),
        seen: &[Appearance],
    ) -> Result<ChannelMatch, RemapError> {
        let planes = self.stage.linear_planes(&[self.target(shape)?]).swap_remove(0);
        let one = |c: usize| {
            let squares = |root: f64| self.stage.scaled_squares(&seen[c], &planes[0], root.powi(3) as f32);
            let middle = f64::from(self.least[first + c][*place][1]).clamp(2.0 * FINE, 1.0 - FINE);
            let around = [-1.0, 0.0, 1.0].map(|k| squares(middle + k * FINE));
            let shares = self.stage.shares();
            let (root, _) = least_on([0, 1].map(|light| around.map(|a| a[light])), (middle, FINE), shares);
            let fitness = |root: f64| weighted(squares(root), shares);
            (root.powi(3), fitness(root))
        };
        let (scale, fitness) = channels.into_par_iter().map(one).unzip();
        Ok(ChannelMatch { shape: self.shapes.values(shape), scale, fitness })
    }
}

/// A channel of a material as a grey material without a body.
fn grey(material: &Material, channel: usize) -> Result<Material, RemapError> {
    let mut grey = material.clone();
    for (k, value) in material.values().iter().enumerate() {
        if let Value::Colour(colour) = value {
            let is_body = material.model().parameters[k].role.is_body();
            grey.set_value(k, Value::Colour([if is_body { 0.0 } else { colour[channel] }; 3]))?;
        }
    }
    Ok(grey)
}

/// One of the scales at which shapes are compared.
fn level(k: usize) -> f64 {
    ((k + 1) as f64 / LEVELS as f64).powi(3)
}

/// The coordinates of shapes at every level of the scale, shape by shape.
fn scaled_sketches(projection: &Projection, planes: &[[Planes; 2]], light: usize) -> Vec<Vec<f32>> {
    let sketches = projection.project(planes.len() * LEVELS, &|image, pixels, out| {
        let scale = level(image % LEVELS) as f32;
        let scaled = |plane: &Vec<f32>| plane[pixels.clone()].iter().map(|v| v * scale).collect::<Vec<f32>>();
        let [r, g, b] = planes[image / LEVELS][light].each_ref().map(scaled);
        lab_planes_of([&r, &g, &b], out);
    });
    sketches.rows(projection.len()).into_iter().map(<[f32]>::to_vec).collect()
}

/// The fitness of squared distances under both lights.
fn weighted(squares: [f64; 2], shares: [f64; 2]) -> f64 {
    squares.iter().zip(shares).map(|(square, share)| share * square.max(0.0).sqrt()).sum()
}

/// The best cube root of the scale and its fitness, given squared distances at all levels by light.
fn least_over_levels(squares: [&[f64]; 2], shares: [f64; 2]) -> (f64, f64) {
    let at = |k: usize| weighted([squares[0][k], squares[1][k]], shares);
    let best = (0..LEVELS).min_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap_or_default();
    let middle = best.clamp(1, LEVELS - 2);
    let around = squares.map(|s| [s[middle - 1], s[middle], s[middle + 1]]);
    least_on(around, ((middle + 1) as f64 / LEVELS as f64, 1.0 / LEVELS as f64), shares)
}

/// The least fitness on the parabolas through squared distances at three places, by light: where it is, and its value.
fn least_on(squares: [[f64; 3]; 2], (middle, step): (f64, f64), shares: [f64; 2]) -> (f64, f64) {
    let parabola = |[below, at, above]: [f64; 3], x: f64| {
        at + x * (0.5 * (above - below) + x * (0.5 * (above + below) - at))
    };
    let places = (-PLACES..=PLACES).map(|k| f64::from(k) / f64::from(PLACES));
    let fitness = |x: f64| weighted(squares.map(|s| parabola(s, x)), shares);
    let least = places.map(|x| (x, fitness(x))).min_by(|a, b| a.1.total_cmp(&b.1));
    let (x, fitness) = least.unwrap_or_default();
    (middle + x * step, fitness)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Options, Preset, Side, Vary};
    use lookmatch_materials::{Levels, by_name};

    fn plan() -> Plan {
        let vary = |name: &str, min, max, step| Vary {
            side: Some(Side::Target),
            name: name.into(),
            levels: Levels::new(min, max, step),
        };
        let options = Options {
            preset: Some(Preset::Paper),
            size: Some(48),
            vary: vec![vary("ior", 1.1, 2.0, 0.1), vary("roughness", 0.05, 0.45, 0.05)],
            ..Options::default()
        };
        Plan::new(by_name("low-abc").unwrap(), by_name("ggx").unwrap(), &options).unwrap()
    }

    #[test]
    fn a_target_is_its_own_match_in_all_channels() {
        let (plan, source) = (plan(), "ggx:diffuse=0.2/0.4/0.1,specular=0.8/0.3/0.05,ior=1.6,roughness=0.15");
        let stage = Stage::prepare(&plan).unwrap();
        let sources = [Material::parse(source).unwrap()];
        let table = ChannelTable::fill(&plan, &stage, &sources, &mut |_| (), &|| false).unwrap();
        let (alone, together) = table.best(0, &|_| true).unwrap();
        assert_eq!(together.shape, [1.6, 0.15]);
        for (c, scale) in [0.8, 0.3, 0.05].into_iter().enumerate() {
            assert!((together.scale[c] / scale - 1.0).abs() < 0.01, "{together:?}");
            // A scale that is off by 1 % leaves .08.
            assert!(together.fitness[c] < 0.05 && alone[c].fitness[0] < 0.05, "{together:?} {alone:?}");
        }
        // Without that shape another is found, which is worse.
        let (_, other) = table.best(0, &|shape| shape[0] < 1.55).unwrap();
        assert!(other.shape[0] < 1.55 && other.fitness.iter().sum::<f64>() > together.fitness.iter().sum());
        assert!(table.best(0, &|_| false).is_err());
    }

    /// The table beside comparisons in full, at many scales.
    #[test]
    fn the_table_agrees_with_the_metric() {
        let plan = plan();
        let stage = Stage::prepare(&plan).unwrap();
        let sources =
            ["nickel", "red-plastic"].map(|name| Material::named(&format!("low-abc@{name}")).unwrap());
        let table = ChannelTable::fill(&plan, &stage, &sources, &mut |_| (), &|| false).unwrap();
        for (grey, place) in [(0, 20), (1, 50), (4, 80), (5, 3)] {
            let seen = stage.appearance(&table.greys[grey]);
            let target = table.target(&table.points()[place]).unwrap();
            let fitness = |root: f64| {
                let mut scaled = target.clone();
                scaled.set_number("specular", root.powi(3)).unwrap();
                stage.fitness(&seen, &stage.appearance(&scaled))
            };
            let brute = (1..=60).map(|k| fitness(f64::from(k) / 60.0)).fold(f64::INFINITY, f64::min);
            let told = f64::from(table.least[grey][place][0]);
            assert!((told - brute).abs() < 0.02 * brute + 0.005, "{told} {brute}");
        }
    }
}
