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

    /// False where its pictures have no noise, and so need no more than one.
    fn has_noise(&self) -> bool;

    /// Gives a scene under a light a name.
    ///
    /// # Errors
    /// What the renderer cannot do.
    fn set_scene(&self, name: &str, scene: &Scene, light: Illumination, size: usize) -> Result<(), String>;

    /// Pictures in the order of the shots; a failed one says why, and does not hold up the others.
    fn render(&self, shots: &[Shot]) -> Vec<Result<Image, String>>;

    /// [`Studio::render`], and true with pictures that were found: some studios keep what they rendered.
    fn take(&self, shots: &[Shot]) -> Vec<Result<(Image, bool), String>> {
        self.render(shots).into_iter().map(|result| result.map(|image| (image, false))).collect()
    }
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
    a.zipped(b, |a, b| a + share * (b - a))
}

/// Memory for kept pictures, in bytes.
const CAPACITY: usize = 1 << 30;

/// A renderer with the pictures that it made.
pub(crate) struct Archive {
    pub(crate) studio: Arc<dyn Studio>,
    kept: Mutex<LruCache<(Key, &'static str), Arc<Takes>>>,
    /// Samples of a picture at first.
    samples: u32,
    /// Turns the noise of all pictures.
    seed: u64,
    counts: Mutex<Counts>,
}

/// What pictures have cost so far.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Counts {
    /// Renders that were made.
    pub renders: usize,
    /// Pictures that were found instead, from an earlier run.
    pub found: usize,
    /// Of the renders, those that failed.
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
    pub(crate) fn new(studio: Arc<dyn Studio>, size: usize, samples: u32, seed: u64) -> Self {
        let bytes = 2 * size * size * size_of::<[f32; 3]>();
        let room = NonZeroUsize::new(CAPACITY / bytes.max(1)).unwrap_or(NonZeroUsize::MIN);
        let kept = Mutex::new(LruCache::new(room));
        Self { studio, kept, samples, seed, counts: Mutex::default() }
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
        let batches: Vec<Vec<Batch>> =
            tasks.iter().map(|task| task.batches(halves, self.samples, samples)).collect();
        let shots =
            tasks.iter().zip(&batches).flat_map(|(task, batches)| task.shots(halves, batches, self.seed));
        let shots: Vec<Shot> = shots.collect();
        if shots.is_empty() {
            return;
        }
        let begin = Instant::now();
        let mut images = self.studio.take(&shots).into_iter();
        let waited = begin.elapsed();
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        counts.waited += waited;
        for (task, batches) in tasks.into_iter().zip(batches) {
            let images: Vec<Result<(Image, bool), String>> =
                images.by_ref().take(halves as usize * batches.len()).collect();
            let found = images.iter().filter(|image| matches!(image, Ok((_, true)))).count();
            counts.found += found;
            counts.renders += images.len() - found;
            counts.failed += images.iter().filter(|image| image.is_err()).count();
            match images.into_iter().map(|image| Ok(image?.0)).collect::<Result<Vec<Image>, String>>() {
                Ok(images) => {
                    self.known().put(task.identity.clone(), Arc::new(task.joined(&batches, images)));
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

    /// What is to be added: the first pictures, then three times as many samples as there are already, and so on. All pictures
    /// that grow to the same number grow alike, and share their noise where they share seeds.
    fn batches(&self, halves: u32, first: u32, samples: u32) -> Vec<Batch> {
        let mut known = self.known_samples();
        let mut batches = Vec::new();
        while known < samples {
            let next = if known == 0 { first } else { 4 * known };
            let batch = Batch { after: known, samples: (next.min(samples) - known).div_ceil(halves).max(1) };
            known += batch.samples * halves;
            batches.push(batch);
        }
        batches
    }

    /// Each lobe has noise of its own, which a fit through many averages out. Bodies of all colours under one lobe share theirs,
    /// which cancels in their differences.
    fn shots<'b>(&'b self, halves: u32, batches: &'b [Batch], seed: u64) -> impl Iterator<Item = Shot<'b>> {
        let lobe = self.material.blackened().map_or_else(|| key(self.material), |body| key(&body.black));
        let mixed = lobe.iter().fold(seed, |mix, word| (mix ^ word).wrapping_mul(0x0000_0100_0000_01b3));
        let first = (mixed >> 20) as u32;
        let shot = move |(batch, half): (&Batch, u32)| Shot {
            scene: self.identity.1,
            material: self.material,
            samples: batch.samples,
            seed: first.wrapping_add(2 * batch.after + half) & 0x7fff_ffff,
        };
        batches.iter().flat_map(move |batch| (0..halves).map(move |half| (batch, half))).map(shot)
    }

    /// New pictures, batch by batch, added to those that were known.
    fn joined(&self, batches: &[Batch], images: Vec<Image>) -> Takes {
        let halves = images.len() / batches.len().max(1);
        let mut takes = self.known.as_deref().cloned().unwrap_or(Takes { halves: Vec::new(), samples: 0 });
        for (batch, new) in batches.iter().zip(images.chunks(halves.max(1))) {
            let added = batch.samples * halves as u32;
            takes.samples += added;
            let share = added as f32 / takes.samples as f32;
            takes.halves = match takes.halves.is_empty() {
                true => new.to_vec(),
                false => takes.halves.iter().zip(new).map(|(old, new)| mixed(old, new, share)).collect(),
            };
        }
        takes
    }
}

/// Samples to be added to both halves of a picture.
struct Batch {
    /// Samples of both together that there were before.
    after: u32,
    /// Samples of each half.
    samples: u32,
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
