//! Pictures of other renderers: asked for in batches, noisy, dear, and kept.

use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use lookmatch_imaging::Image;
use lookmatch_materials::{Description, Material};
use lookmatch_rendering::{Illumination, Scene};
use lru::LruCache;
use serde::{Deserialize, Serialize};

use crate::RemapError;
use crate::gallery::{Key, key};

/// A renderer of its own, which knows nothing of ours.
pub trait Studio: Send + Sync {
    /// What it is called: the part of `RENDERER:MODEL` before the colon.
    fn name(&self) -> &str;

    /// Its version.
    fn version(&self) -> &str;

    /// How it describes its models.
    fn models(&self) -> &[Description];

    /// False where its pictures have no noise, and so need no more than one.
    fn has_noise(&self) -> bool;

    /// Gives a scene under a light a name.
    ///
    /// # Errors
    /// What the renderer cannot do.
    fn set_scene(&self, name: &str, scene: &Scene, light: Illumination, size: usize) -> Result<(), String>;

    /// Pictures in the order of the shots; a failed one says why, and does not hold up the others.
    fn render(&self, shots: &[Shot]) -> Vec<Result<Image, String>>;
}

/// One picture.
#[derive(Clone, Debug)]
pub struct Shot<'a> {
    /// Name of the scene.
    pub scene: &'static str,
    /// One of the renderer's own materials.
    pub material: &'a Material,
    /// Samples per pixel.
    pub samples: u32,
    /// Other seeds, other noise.
    pub seed: u32,
}

/// How many samples pictures of other renderers have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sampling {
    /// Samples per pixel of every picture.
    pub samples: u32,
    /// Samples per pixel up to which pictures are refined whose difference is lost in noise.
    pub most: u32,
}

impl Default for Sampling {
    fn default() -> Self {
        Self { samples: 16, most: 64 }
    }
}

/// What a probe says of a renderer that took part: enough to read the probe without it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RendererRecord {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// The models that the probe speaks of.
    pub models: Vec<Description>,
}

/// The pictures of one material in one scene: two with independent noise, so that what both show is no noise, or one where
/// there is none.
#[derive(Clone, Debug)]
pub(crate) struct Takes {
    pub(crate) halves: Vec<Image>,
    /// Samples per pixel of both together.
    pub(crate) samples: u32,
}

impl Takes {
    /// The mean of both.
    pub(crate) fn whole(&self) -> Image {
        match &self.halves[..] {
            [one] => one.clone(),
            halves => mixed(&halves[0], &halves[1], 0.5),
        }
    }
}

/// `a + share (b − a)`.
fn mixed(a: &Image, b: &Image, share: f32) -> Image {
    let mut image = a.clone();
    for (out, b) in image.pixels_mut().iter_mut().zip(b.pixels()) {
        (0..3).for_each(|c| out[c] += share * (b[c] - out[c]));
    }
    image
}

/// Memory for kept pictures, in bytes.
const CAPACITY: usize = 1 << 30;

/// A renderer with the pictures that it made.
pub(crate) struct Archive {
    pub(crate) studio: Arc<dyn Studio>,
    kept: Mutex<LruCache<(Key, &'static str), Arc<Takes>>>,
    /// Turns the noise of all pictures.
    seed: u64,
    counts: Mutex<Counts>,
}

/// What pictures have cost so far.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Counts {
    /// Renders that were asked for.
    pub renders: usize,
    /// Of them, those that failed.
    pub failed: usize,
    /// Time spent waiting for them.
    #[serde(skip)]
    pub waited: Duration,
    /// Why the first of them failed.
    pub reasons: Vec<String>,
}

/// Reasons that are kept.
const REASONS: usize = 5;

impl Archive {
    pub(crate) fn new(studio: Arc<dyn Studio>, size: usize, seed: u64) -> Self {
        let bytes = 2 * size * size * size_of::<[f32; 3]>();
        let room = NonZeroUsize::new(CAPACITY / bytes.max(1)).unwrap_or(NonZeroUsize::MIN);
        let kept = Mutex::new(LruCache::new(room));
        Self { studio, kept, seed, counts: Mutex::default() }
    }

    /// Costs so far.
    pub(crate) fn counts(&self) -> Counts {
        self.counts.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Pictures of materials in scenes, with at least so many samples: what is known is not rendered again, what is known
    /// with fewer is added to.
    pub(crate) fn takes(
        &self,
        wanted: &[(&Material, &'static str)],
        samples: u32,
    ) -> Vec<Result<Arc<Takes>, String>> {
        let mut tasks: Vec<Task> = Vec::new();
        let mut places = Vec::new();
        for (material, scene) in wanted {
            let identity = (key(material), *scene);
            let known = self.known().get(&identity).cloned();
            let place = tasks.iter().position(|task| task.identity == identity);
            places.push(place.unwrap_or(tasks.len()));
            if place.is_none() {
                tasks.push(Task { identity, material, known });
            }
        }
        self.fulfil(&tasks, samples);
        let taken = |place: &usize| {
            let task = &tasks[*place];
            let found = self.known().get(&task.identity).cloned();
            found.filter(|takes| self.is_enough(takes, samples)).ok_or_else(|| self.last_reason())
        };
        places.iter().map(taken).collect()
    }

    fn known(&self) -> std::sync::MutexGuard<'_, LruCache<(Key, &'static str), Arc<Takes>>> {
        // A panic elsewhere leaves nothing half-written in this map.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_enough(&self, takes: &Takes, samples: u32) -> bool {
        !self.studio.has_noise() || takes.samples >= samples
    }

    /// Renders what tasks lack.
    fn fulfil(&self, tasks: &[Task], samples: u32) {
        let halves = if self.studio.has_noise() { 2 } else { 1 };
        let lacking = |task: &&Task| !task.known.as_ref().is_some_and(|t| self.is_enough(t, samples));
        let tasks: Vec<&Task> = tasks.iter().filter(lacking).collect();
        let shots: Vec<Shot> = tasks.iter().flat_map(|task| task.shots(halves, samples, self.seed)).collect();
        if shots.is_empty() {
            return;
        }
        let begin = Instant::now();
        let mut images = self.studio.render(&shots).into_iter();
        let waited = begin.elapsed();
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        counts.waited += waited;
        for task in tasks {
            let halves: Vec<Result<Image, String>> = images.by_ref().take(halves as usize).collect();
            counts.renders += halves.len();
            counts.failed += halves.iter().filter(|half| half.is_err()).count();
            match halves.into_iter().collect::<Result<Vec<Image>, String>>() {
                Ok(halves) => {
                    self.known().put(task.identity.clone(), Arc::new(task.joined(halves, samples)));
                }
                Err(reason) if counts.reasons.len() < REASONS => counts.reasons.push(reason),
                Err(_) => {}
            }
        }
    }

    fn last_reason(&self) -> String {
        self.counts().reasons.last().cloned().unwrap_or_else(|| "a render was lost".into())
    }
}

/// Pictures that are wanted of a material in a scene.
struct Task<'a> {
    identity: (Key, &'static str),
    material: &'a Material,
    known: Option<Arc<Takes>>,
}

impl Task<'_> {
    fn known_samples(&self) -> u32 {
        self.known.as_ref().map_or(0, |known| known.samples)
    }

    /// Samples of each new half.
    fn missing(&self, halves: u32, samples: u32) -> u32 {
        samples.saturating_sub(self.known_samples()).div_ceil(halves).max(1)
    }

    /// Each lobe has noise of its own, which a fit through many averages out. Bodies of all colours under one lobe share theirs,
    /// which cancels in their differences.
    fn shots(&self, halves: u32, samples: u32, seed: u64) -> impl Iterator<Item = Shot<'_>> {
        let lobe = self.material.blackened().map_or_else(|| key(self.material), |body| key(&body.black));
        let mixed = lobe.iter().fold(seed, |mix, word| (mix ^ word).wrapping_mul(0x0000_0100_0000_01b3));
        let first = ((mixed >> 20) as u32).wrapping_add(2 * self.known_samples());
        let samples = self.missing(halves, samples);
        (0..halves).map(move |half| Shot {
            scene: self.identity.1,
            material: self.material,
            samples,
            seed: first.wrapping_add(half) & 0x7fff_ffff,
        })
    }

    /// New halves added to those that were known.
    fn joined(&self, halves: Vec<Image>, samples: u32) -> Takes {
        let count = halves.len() as u32;
        let added = self.missing(count, samples) * count;
        match &self.known {
            None => Takes { halves, samples: added },
            Some(known) => {
                let total = known.samples + added;
                let share = added as f32 / total as f32;
                let halves =
                    known.halves.iter().zip(&halves).map(|(old, new)| mixed(old, new, share)).collect();
                Takes { halves, samples: total }
            }
        }
    }
}

/// The studio that shows a model.
///
/// # Errors
/// Where none of them does.
pub(crate) fn studio_of(studios: &[Arc<dyn Studio>], renderer: &str) -> Result<Arc<dyn Studio>, RemapError> {
    let found = studios.iter().find(|studio| studio.name() == renderer);
    found
        .cloned()
        .ok_or_else(|| RemapError::Option(format!("the renderer '{renderer}' has not been started")))
}
