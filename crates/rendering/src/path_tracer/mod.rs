//! The reference renderer: a path tracer for any scene. Slow, noisy, and right.
//!
//! Every path of light is followed, with all interreflection. At each point, light from the environment is estimated in two
//! ways, by directions drawn from the map and by the path's own direction, weighted by the balance heuristic (Veach
//! 1997); point lights are evaluated directly. What a path's direction is drawn from is told in [`vertex`].
//!
//! What remains hard are caustics without a technique of their own: light that a mesh (not a sphere) with a narrow lobe
//! throws onto a diffuse surface, and that of further lamps of an environment with more than a few.

mod glint;
mod look;
mod sampler;
mod sky;
mod vertex;
mod wardrobe;
mod world;

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use rayon::prelude::*;

use crate::film::Film;
use crate::scene::{Illumination, Scene};
use crate::{EnvironmentMap, Part, Render, SceneError};
use sampler::{Points, Sampler};
use sky::Sky;
use vertex::{Targets, Vertex};
use wardrobe::Wardrobe;
use world::{Encounter, World};

pub use wardrobe::{Spot, Wears};

/// Most samples of a pixel: their table takes 16 bytes each.
const MOST_SAMPLES: u32 = 1 << 20;
/// Paths that go on from the first point that a pixel's sample sees.
const SPLITS: u32 = 4;
/// Reflections after which a path may end by chance.
const CERTAIN: u32 = 4;
/// Reflections after which it ends: so rare between albedos below 1 that nothing is missed.
const LONGEST: u32 = 128;

/// A scene prepared for one illumination, picture size and number of samples.
///
/// Each pixel is the mean over its area, estimated from its own random numbers: the same seed gives the same bits on any
/// number of threads, and errors of pixels are independent.
pub struct PathTracer {
    world: World,
    film: Film,
    sky: Option<Sky>,
    /// Position and intensity of the point lights.
    lights: Vec<(DVec3, DVec3)>,
    /// Places of the point lights and of the environment's lamps.
    spots: Vec<DVec3>,
    points: Points,
    samples: u32,
    seed: u64,
}

impl PathTracer {
    /// Prepares a scene for pictures of `size` × `size` pixels (1 to 8192) with `samples` paths per pixel (1 to 1048576;
    /// powers of two are the most accurate).
    ///
    /// Subjects keep their own diffuse colours; see [`Scene::for_model`] for materials that have none.
    ///
    /// # Errors
    /// Where the scene lacks the light that is asked for, or one of its files cannot be read.
    pub fn prepare(
        scene: &Scene,
        illumination: Illumination,
        size: usize,
        samples: u32,
        seed: u64,
    ) -> Result<Self, SceneError> {
        scene.check_picture(illumination, size)?;
        if !(1..=MOST_SAMPLES).contains(&samples) {
            return Err(SceneError::Samples { samples });
        }
        let map = scene.environment.as_ref().filter(|_| illumination.has_environment());
        let light = |l: &crate::PointLight| (l.position.into(), l.intensity.into());
        let lights = scene.point_lights.iter().filter(|_| illumination.has_points()).map(light);
        let lights: Vec<(DVec3, DVec3)> = lights.collect();
        let sky = map.map(EnvironmentMap::load).transpose()?.map(Sky::new);
        let lamps = sky.as_ref().map_or(Vec::new(), Sky::spots);
        Ok(Self {
            world: World::new(scene)?,
            film: Film::new(&scene.camera, size),
            spots: lights.iter().map(|l| l.0).chain(lamps).collect(),
            sky,
            lights,
            points: Points::new(samples),
            samples,
            seed,
        })
    }

    /// Estimates of chosen pixels (row by row from the top left), linear RGB, with all that is seen in them.
    pub fn radiance(&self, material: &Material, part: Part, pixels: &[u32]) -> Vec<[f32; 3]> {
        self.pixels(&self.uniform(material, part), pixels, &|_| ())
    }

    /// [`PathTracer::radiance`] with several materials: see [`PathTracer::render_dressed`].
    ///
    /// # Panics
    /// Where `wears` gives a number that no material has.
    pub fn radiance_dressed(
        &self,
        materials: &[Material],
        wears: Wears,
        part: Part,
        pixels: &[u32],
    ) -> Vec<[f32; 3]> {
        self.pixels(&Wardrobe::new(materials, wears, part, &self.world), pixels, &|_| ())
    }

    /// A picture with several materials, linear RGB, row 0 on top: `wears` says which of them is worn at a point. Subjects
    /// with a diffuse colour of their own keep it. One material gives the bits of [`Render::render`].
    ///
    /// # Panics
    /// Where `wears` gives a number that no material has.
    pub fn render_dressed(&self, materials: &[Material], wears: Wears, part: Part) -> Image {
        self.render_dressed_observed(materials, wears, part, &|_| ())
    }

    /// [`PathTracer::render_dressed`], with the number of pixels that are done told now and then, from any thread.
    ///
    /// # Panics
    /// Where `wears` gives a number that no material has.
    pub fn render_dressed_observed(
        &self,
        materials: &[Material],
        wears: Wears,
        part: Part,
        observe: &(dyn Fn(usize) + Sync),
    ) -> Image {
        self.picture(&Wardrobe::new(materials, wears, part, &self.world), observe)
    }

    /// One material all over.
    fn uniform(&self, material: &Material, part: Part) -> Wardrobe<'static> {
        Wardrobe::new(std::slice::from_ref(material), &|_| 0, part, &self.world)
    }

    fn picture(&self, wardrobe: &Wardrobe, observe: &(dyn Fn(usize) + Sync)) -> Image {
        let size = self.film.size;
        let pixels: Vec<u32> = (0..(size * size) as u32).collect();
        let values = self.pixels(wardrobe, &pixels, observe);
        Image::from_fn(size, size, |x, y| values[y * size + x])
    }

    /// Chosen pixels; how many are done is told now and then.
    fn pixels(&self, wardrobe: &Wardrobe, pixels: &[u32], observe: &(dyn Fn(usize) + Sync)) -> Vec<[f32; 3]> {
        let done = AtomicUsize::new(0);
        let pixel = |pixel: &u32| {
            let value = self.pixel(wardrobe, *pixel).as_vec3().to_array();
            observe(1 + done.fetch_add(1, Ordering::Relaxed));
            value
        };
        pixels.par_iter().map(pixel).collect()
    }

    fn pixel(&self, wardrobe: &Wardrobe, pixel: u32) -> DVec3 {
        let (x, y) = (pixel as usize % self.film.size, pixel as usize / self.film.size);
        let sample = |index| {
            let sampler = self.points.path(self.seed, pixel, index);
            let [dx, dy] = sampler.set(0).pair(0, 0);
            self.seen(wardrobe, self.film.direction(x as f64 + dx, y as f64 + dy), &sampler)
        };
        (0..self.samples).map(sample).sum::<DVec3>() / f64::from(self.samples)
    }

    /// Radiance that the eye receives from a direction.
    fn seen(&self, wardrobe: &Wardrobe, direction: DVec3, sampler: &Sampler) -> DVec3 {
        match self.world.first(self.film.eye, direction, None) {
            Some(at) => {
                let vertex = self.vertex(wardrobe, at, -direction);
                self.reflected(wardrobe, &vertex, sampler, Walk::START)
            }
            None => self.sky.as_ref().map_or(DVec3::ZERO, |sky| sky.radiance(direction)),
        }
    }

    fn vertex<'a>(&'a self, wardrobe: &'a Wardrobe, at: Encounter, to_viewer: DVec3) -> Vertex<'a> {
        let targets = Targets { spheres: &wardrobe.balls, lights: &self.spots };
        let coat = wardrobe.coat(&self.world, &at);
        let diffuse = self.world.diffuse(&at, coat.map_or(DVec3::ZERO, |coat| coat.diffuse));
        Vertex::new(at, to_viewer, diffuse, coat.and_then(|coat| coat.lobe.as_ref()), targets)
    }

    /// Radiance that a point reflects to where it is seen from.
    fn reflected(&self, wardrobe: &Wardrobe, vertex: &Vertex, sampler: &Sampler, walk: Walk) -> DVec3 {
        let splits = if walk.depth == 0 { SPLITS } else { 1 };
        let numbers = walk.numbers(sampler);
        let mut sum = self.lit_by_points(vertex);
        for k in 0..splits {
            sum += self.lit_by_sky(vertex, numbers(2 * k)) / f64::from(splits);
            let [u, v] = numbers(2 * k + 1);
            // One number chooses between the parts of the mixture: dealt out evenly over the paths.
            let u = (f64::from(k) + u) / f64::from(splits);
            let Some(direction) = vertex.sample([u, v]) else { continue };
            let Some(scattering) = vertex.scatter(direction) else { continue };
            let density = scattering.density * f64::from(splits);
            let Some(at) = self.world.first(vertex.at.position, direction, Some(vertex.at.surface)) else {
                if let Some(sky) = &self.sky {
                    sum += scattering.value * sky.radiance(direction)
                        / (scattering.density + sky.density(direction))
                        / f64::from(splits);
                }
                continue;
            };
            let branch = if walk.depth == 0 { k } else { walk.branch };
            let next_walk = Walk { depth: walk.depth + 1, branch, strength: walk.strength * vertex.albedo };
            let Some((walk, chance)) = next_walk.survive(sampler) else { continue };
            let next = self.vertex(wardrobe, at, -direction);
            sum += scattering.value * self.reflected(wardrobe, &next, sampler, walk) / (density * chance);
        }
        sum
    }

    /// What a point reflects of the point lights.
    fn lit_by_points(&self, vertex: &Vertex) -> DVec3 {
        let from = |(position, intensity): &(DVec3, DVec3)| {
            let to_light = *position - vertex.at.position;
            let distance = to_light.length();
            let direction = to_light / distance;
            let value = vertex.value(direction);
            if value == DVec3::ZERO || self.hides(vertex, direction, distance) {
                return DVec3::ZERO;
            }
            value * *intensity / (distance * distance)
        };
        self.lights.iter().map(from).sum()
    }

    /// What a point reflects of the environment, by a direction drawn from its map.
    fn lit_by_sky(&self, vertex: &Vertex, numbers: [f64; 2]) -> DVec3 {
        let Some(sky) = &self.sky else { return DVec3::ZERO };
        let (direction, density) = sky.sample(numbers);
        match vertex.scatter(direction) {
            Some(s) if !self.hides(vertex, direction, f64::INFINITY) => {
                s.value * sky.radiance(direction) / (density + s.density)
            }
            _ => DVec3::ZERO,
        }
    }

    fn hides(&self, vertex: &Vertex, direction: DVec3, distance: f64) -> bool {
        self.world.hides(vertex.at.position, direction, vertex.at.surface, distance)
    }
}

/// How far a path has gone.
#[derive(Clone, Copy)]
struct Walk {
    /// Reflections so far.
    depth: u32,
    /// Which of the paths from the first point this is.
    branch: u32,
    /// About the share of light that arrives at the eye: the product of the albedos. The weight of a path would not do,
    /// because one that is aimed at a bright spot weighs little until it meets it.
    strength: f64,
}

impl Walk {
    const START: Self = Self { depth: 0, branch: 0, strength: 1.0 };

    /// Pairs of numbers for what is decided at a point: even streams for the environment, odd ones for the path's own
    /// direction.
    fn numbers<'a>(self, sampler: &Sampler<'a>) -> impl Fn(u32) -> [f64; 2] + use<'a> {
        // The first points of all branches share one set with the pixel's area, deeper ones have sets of their own.
        let place = self.depth + 1;
        let number = if place < 4 { 0 } else { place / 4 * SPLITS + self.branch };
        let set = sampler.set(number);
        let stream = if self.depth == 0 { 0 } else { (1 + self.branch) * 2 * SPLITS };
        move |k| set.pair(place % 4, stream + k)
    }

    /// Ends weak paths by chance (Russian roulette); those that go on get the chance that they had.
    fn survive(self, sampler: &Sampler) -> Option<(Self, f64)> {
        if self.depth < CERTAIN {
            return Some((self, 1.0));
        }
        let chance = self.strength.min(0.95);
        let [u, _] = self.numbers(sampler)(2);
        let walk = Self { strength: self.strength / chance, ..self };
        (u < chance && self.depth < LONGEST).then_some((walk, chance))
    }
}

impl Render for PathTracer {
    fn size(&self) -> usize {
        self.film.size
    }

    fn render(&self, material: &Material, part: Part) -> Image {
        self.render_observed(material, part, &|_| ())
    }

    fn render_observed(&self, material: &Material, part: Part, observe: &(dyn Fn(usize) + Sync)) -> Image {
        self.picture(&self.uniform(material, part), observe)
    }
}
