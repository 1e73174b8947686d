//! Remaps into, out of and between other renderers: all that is known of their materials is pictures.
//!
//! Their pictures are dear and noisy. So the search compares specular pictures alone, of black bodies: they serve every source,
//! whatever its colour. The body's colour is measured once the lobe is found. Each picture is two with independent noise,
//! whose differences to two others are multiplied instead of squared: noise adds nothing to that product on average, so
//! a noisy candidate is no worse than a clean one. What noise leaves undecided is rendered with more samples.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};

use lookmatch_imaging::{Estimate, Image, Neighbourhoods, NoisyLab, inner_product, nrmsd, nrmsd_of_noise};
use lookmatch_materials::{BlackBody, Material, Role};
use lookmatch_rendering::{Illumination, Observe, Part, Planes, TransportCache};
use lookmatch_search::Problem;
use lru::LruCache;
use rayon::prelude::*;

use crate::carry::{Body, SourceLook};
use crate::cross_match::{CrossMatch, Foresight, Settled};
use crate::from_pictures::Pictures;
use crate::gallery::{Key, family, key};
use crate::picture_checks::check_pictures;
use crate::probe::Noise;
use crate::stage::LIGHTS;
use crate::strategy::Matched;
use crate::studio::{Archive, Counts, Sampling, Studio, Takes, studio_of};
use crate::synthesis::{LabPictures, Syntheses};
use crate::{Entry, Plan, RemapError, Stage};

/// Names of the reference scene under its lights, point and environment.
const SCENES: [&str; 2] = ["reference-point", "reference-environment"];
/// Times as many samples as the finest candidates have for the source.
const SOURCE: u32 = 8;
/// Memory for looks, in bytes.
const CAPACITY: usize = 500 << 20;
/// Pictures with less noise, as a share of their brightness, have none.
const CLEAN: f64 = 0.005;
/// Share of a body's brightness that its measurement may be off by.
const BODY_TOLERANCE: f64 = 0.005;
/// Renders of a body that its measurement may take.
const BODY_STEPS: usize = 3;

/// The reference scene with materials of other renderers on it, and ours.
pub struct CrossStage {
    pub(crate) own: Stage,
    pub(crate) archives: Vec<Archive>,
    pub(crate) sampling: Sampling,
    /// Weights of the subject's pixels: those of the mask, and 0 at silhouettes, where what is behind is nothing but noise.
    pub(crate) weights: Vec<f32>,
    pub(crate) around: Neighbourhoods,
    looks: Mutex<LruCache<Key, Arc<Look>>>,
    /// True where looks keep their pictures.
    keeps_linear: bool,
}

/// What the metric knows of a material, by light.
pub(crate) struct Look {
    pub(crate) specular: [NoisyLab; 2],
    pub(crate) diffuse: Option<Diffuse>,
    /// The pictures themselves, where they are kept.
    pub(crate) linear: Option<Linear>,
    /// Samples of its pictures; as many as can be of ours, which have no noise.
    samples: u32,
}

/// Under the point light and under the environment.
pub(crate) type ByLight<T> = [T; 2];

/// Halves of linear pictures.
pub(crate) struct Linear {
    pub(crate) specular: ByLight<Vec<Planes>>,
    pub(crate) diffuse: Option<ByLight<Vec<Planes>>>,
}

/// Diffuse pictures under both lights.
pub(crate) struct Diffuse {
    pub(crate) images: ByLight<NoisyLab>,
    /// Mean radiance under the environment, per channel.
    pub(crate) level: [f64; 3],
}

/// A fitness and its standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Score {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

/// A sum of pictures: weights and materials.
type Sum = Vec<(f32, Material)>;

/// Pictures of a material that make its specular and its diffuse one.
struct Recipe {
    specular: Sum,
    diffuse: Sum,
}

impl Recipe {
    /// The materials whose pictures are needed.
    fn materials(&self, whole: bool) -> impl Iterator<Item = &Material> {
        self.specular.iter().chain(self.diffuse.iter().filter(move |_| whole)).map(|(_, material)| material)
    }

    /// The diffuse reflection is what a black body takes away ([`Material::blackened`]).
    fn of(material: &Material) -> Self {
        match material.blackened() {
            None => Self { specular: vec![(1.0, material.clone())], diffuse: Vec::new() },
            Some(BlackBody { coloured, black, share }) => {
                let share = share as f32;
                let diffuse = vec![(share, coloured.clone()), (-share, black.clone())];
                let mut specular = vec![(1.0, material.clone()), (-share, coloured), (share, black)];
                if specular[0].1 == specular[1].1 && share == 1.0 {
                    specular.drain(..2);
                }
                Self { specular, diffuse }
            }
        }
    }
}

impl CrossStage {
    /// Prepares the reference scene of a plan in every renderer that it names.
    ///
    /// # Errors
    /// As [`Stage::cached`]; a renderer that is not among the studios, or cannot show the scene.
    pub fn cached(
        plan: &Plan,
        studios: &[Arc<dyn Studio>],
        cache: &TransportCache,
        observe: Observe,
    ) -> Result<Self, RemapError> {
        let own = Stage::cached(plan, cache, observe)?;
        let sampling = plan.sampling.unwrap_or_default();
        let mut archives: Vec<Archive> = Vec::new();
        for renderer in plan.renderers_needed() {
            let studio = studio_of(studios, renderer)?;
            for (name, light) in SCENES.into_iter().zip(LIGHTS) {
                let set = studio.set_scene(name, &plan.scene, light, plan.size);
                set.map_err(|reason| RemapError::Render(format!("{renderer}: {reason}")))?;
            }
            archives.push(Archive::new(studio, plan.size, sampling.samples, plan.seed));
        }
        let coverage = plan.scene.coverage(plan.size);
        let subjects = own.views()[0].subjects().iter().enumerate();
        let mask = |k: usize| own.mask_weights().map_or(1.0, |mask| mask[k]);
        let weight = |(k, pixel): (usize, &u32)| if coverage[*pixel as usize] == 1.0 { mask(k) } else { 0.0 };
        let weights: Vec<f32> = subjects.map(weight).collect();
        let around = Neighbourhoods::new(own.views()[0].subjects(), plan.size);
        // Two pictures, one smooth one and what is made of it, of two parts under two lights.
        let bytes = 4 * 4 * 3 * weights.len() * size_of::<f32>();
        let room = NonZeroUsize::new(CAPACITY / bytes.max(1)).unwrap_or(NonZeroUsize::MIN);
        Ok(Self {
            own,
            archives,
            sampling,
            weights,
            around,
            looks: Mutex::new(LruCache::new(room)),
            keeps_linear: false,
        })
    }

    /// [`CrossStage::cached`] for [`crate::match_pictures`]: keeps the pictures of looks as well as what the metric makes of
    /// them. Nothing is smoothed where no noise is seen.
    ///
    /// # Errors
    /// As [`CrossStage::cached`].
    pub fn for_pictures(
        plan: &Plan,
        pictures: &Pictures,
        studios: &[Arc<dyn Studio>],
        cache: &TransportCache,
        observe: Observe,
    ) -> Result<Self, RemapError> {
        let mut stage = Self { keeps_linear: true, ..Self::cached(plan, studios, cache, observe)? };
        let checks = check_pictures(plan, &stage, pictures)?;
        let mut noises = checks.iter().filter(|check| check.part == "full").map(|check| check.noise);
        let is_clean = noises.all(|noise| noise.is_some_and(|noise| noise < CLEAN));
        if is_clean && plan.to.model().renderer.is_none() {
            stage.around = Neighbourhoods::none(stage.weights.len());
        }
        Ok(stage)
    }

    /// What each renderer has cost so far, by name.
    pub fn counts(&self) -> Vec<(String, Counts)> {
        self.archives.iter().map(|a| (a.studio.name().to_owned(), a.counts())).collect()
    }

    /// The picture of a material under a light, the point light or the environment, and what noise makes of each pixel, about.
    ///
    /// # Errors
    /// Where it cannot be rendered.
    pub fn picture(
        &self,
        material: &Material,
        light: Illumination,
        samples: u32,
    ) -> Result<(Image, Option<Image>), RemapError> {
        let place = if light == Illumination::Point { 0 } else { 1 };
        let Some(archive) = self.archive(material) else {
            return Ok((self.own.views()[place].render(material, Part::Full), None));
        };
        let takes = archive.takes(&[(material, SCENES[place])], samples).swap_remove(0);
        let takes = takes.map_err(RemapError::Render)?;
        Ok((takes.whole(), noise(&takes)))
    }

    /// NRMSD per channel of the full pictures under the environment, whole image: without and with the mask; and what noise
    /// alone makes of the first.
    ///
    /// # Errors
    /// Where one of them cannot be rendered.
    pub fn nrmsd(
        &self,
        source: &Material,
        target: &Material,
        samples: u32,
    ) -> Result<([[f64; 3]; 2], [f64; 3]), RemapError> {
        let (a, noise_a) = self.picture(source, Illumination::Environment, samples)?;
        let (b, noise_b) = self.picture(target, Illumination::Environment, samples)?;
        let mask = self.own.views()[1].mask();
        let mut floor = [0.0; 3];
        for noise in [noise_a, noise_b].into_iter().flatten() {
            let share = nrmsd_of_noise(&a, &noise, None)?;
            (0..3).for_each(|c| floor[c] += share[c] * share[c]);
        }
        Ok(([nrmsd(&a, &b, None)?, nrmsd(&a, &b, Some(mask))?], floor.map(f64::sqrt)))
    }

    fn archive(&self, material: &Material) -> Option<&Archive> {
        let renderer = material.model().renderer?;
        self.archives.iter().find(|archive| archive.studio.name() == renderer)
    }

    /// Materials of one model as they are seen, with their diffuse pictures if `whole`.
    pub(crate) fn looks(
        &self,
        materials: &[Material],
        whole: bool,
        samples: u32,
    ) -> Vec<Result<Arc<Look>, String>> {
        let known: Vec<Option<Arc<Look>>> = materials.iter().map(|m| self.known(m, whole, samples)).collect();
        let missing = materials.iter().zip(&known).filter(|(_, known)| known.is_none());
        let missing: Vec<Material> = missing.map(|(material, _)| material.clone()).collect();
        let mut new = match missing.first().and_then(|first| self.archive(first)) {
            Some(archive) => self.taken(archive, &missing, whole, samples),
            None => self.own_looks(&missing),
        }
        .into_iter();
        let mut look = |(material, known): (&Material, Option<Arc<Look>>)| {
            if let Some(known) = known {
                return Ok(known);
            }
            let look = Arc::new(new.next().unwrap_or_else(|| Err("a material was lost".into()))?);
            self.kept().put(key(material), look.clone());
            Ok(look)
        };
        materials.iter().zip(known).map(&mut look).collect()
    }

    /// Ours, without noise.
    fn own_looks(&self, materials: &[Material]) -> Vec<Result<Look, String>> {
        let planes = self.own.linear_planes(materials);
        let prepared = |planes: [Planes; 2]| planes.map(|planes| NoisyLab::new(&[planes], &self.around));
        let look = |[specular, diffuse]: [[Planes; 2]; 2]| {
            let level = self.level(std::slice::from_ref(&diffuse[1]));
            let halves = |planes: &[Planes; 2]| planes.clone().map(|planes| vec![planes]);
            let linear = || Linear { specular: halves(&specular), diffuse: Some(halves(&diffuse)) };
            let linear = self.keeps_linear.then(linear);
            let diffuse = Some(Diffuse { level, images: prepared(diffuse) });
            Ok(Look { specular: prepared(specular), diffuse, linear, samples: u32::MAX })
        };
        planes.into_par_iter().map(look).collect()
    }

    /// Those of another renderer.
    fn taken(
        &self,
        archive: &Archive,
        materials: &[Material],
        whole: bool,
        samples: u32,
    ) -> Vec<Result<Look, String>> {
        let recipes: Vec<Recipe> = materials.iter().map(Recipe::of).collect();
        let wanted: Vec<&Material> = recipes.iter().flat_map(|recipe| recipe.materials(whole)).collect();
        let shots: Vec<(&Material, &'static str)> =
            wanted.iter().flat_map(|material| SCENES.map(|scene| (*material, scene))).collect();
        let mut taken = archive.takes(&shots, samples).into_iter();
        let look = |recipe: &Recipe| {
            let takes = taken.by_ref().take(2 * recipe.materials(whole).count());
            let takes = takes.collect::<Vec<_>>().into_iter().collect::<Result<Vec<_>, String>>()?;
            Ok(self.developed(recipe, &takes, whole, samples))
        };
        recipes.iter().map(look).collect()
    }

    pub(crate) fn look(
        &self,
        material: &Material,
        whole: bool,
        samples: u32,
    ) -> Result<Arc<Look>, RemapError> {
        self.looks(std::slice::from_ref(material), whole, samples).swap_remove(0).map_err(RemapError::Render)
    }

    fn kept(&self) -> std::sync::MutexGuard<'_, LruCache<Key, Arc<Look>>> {
        // A panic elsewhere leaves nothing half-written in this map.
        self.looks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn known(&self, material: &Material, whole: bool, samples: u32) -> Option<Arc<Look>> {
        let known = self.kept().get(&key(material)).cloned()?;
        (known.samples >= samples && (known.diffuse.is_some() || !whole)).then_some(known)
    }

    /// Adds up pictures; `takes` has both lights of each material of the recipe.
    fn developed(&self, recipe: &Recipe, takes: &[Arc<Takes>], whole: bool, samples: u32) -> Look {
        let of_light = |sum: &Sum, first: usize, light: usize| -> Vec<Planes> {
            let pictures: Vec<(f32, &Takes)> =
                sum.iter().enumerate().map(|(k, (w, _))| (*w, &*takes[2 * (first + k) + light])).collect();
            let halves = pictures.iter().map(|(_, takes)| takes.halves.len()).max().unwrap_or(1);
            (0..halves).map(|half| self.summed(&pictures, half)).collect()
        };
        let halves = [0, 1].map(|light| of_light(&recipe.specular, 0, light));
        let specular = [0, 1].map(|light| NoisyLab::new(&halves[light], &self.around));
        let body = whole.then(|| [0, 1].map(|light| of_light(&recipe.diffuse, recipe.specular.len(), light)));
        let diffuse = body.as_ref().map(|body| Diffuse {
            level: self.level(&body[1]),
            images: [0, 1].map(|light| NoisyLab::new(&body[light], &self.around)),
        });
        let linear = self.keeps_linear.then_some(Linear { specular: halves, diffuse: body });
        Look { specular, diffuse, linear, samples }
    }

    /// A sum of pictures on the subject's pixels.
    fn summed(&self, pictures: &[(f32, &Takes)], half: usize) -> Planes {
        let subjects = self.own.views()[0].subjects();
        let mut planes: Planes = std::array::from_fn(|_| vec![0.0; subjects.len()]);
        for (weight, takes) in pictures {
            let image = &takes.halves[half.min(takes.halves.len() - 1)];
            for (k, pixel) in subjects.iter().enumerate() {
                let value = image.pixels()[*pixel as usize];
                (0..3).for_each(|c| planes[c][k] += weight * value[c]);
            }
        }
        planes
    }

    /// The pictures of a look, weighted per pixel: specular and perhaps diffuse ones under both lights.
    pub(crate) fn pictures(&self, look: &Look, with_diffuse: bool) -> LabPictures {
        shown(look, with_diffuse).map(|image| self.weighted(image.planes())).collect()
    }

    /// Squared length of the noise in each of the pictures of a look.
    pub(crate) fn noise(&self, look: &Look, with_diffuse: bool) -> Vec<f64> {
        let squared = |image: &NoisyLab| {
            let noise = self.weighted(image.noise(&self.around));
            inner_product(&noise, &noise)
        };
        shown(look, with_diffuse).map(squared).collect()
    }

    /// The pictures of a look between two others.
    pub(crate) fn mixed_pictures(&self, a: &Look, b: &Look, share: f64, with_diffuse: bool) -> LabPictures {
        let diffuse = a.diffuse.as_ref().zip(b.diffuse.as_ref()).filter(|_| with_diffuse);
        let diffuse = diffuse.map(|(a, b)| a.images.iter().zip(&b.images));
        let pairs = a.specular.iter().zip(&b.specular).chain(diffuse.into_iter().flatten());
        pairs.map(|(a, b)| self.weighted(a.planes_between(b, share as f32))).collect()
    }

    fn weighted(&self, mut lab: Vec<f32>) -> Vec<f32> {
        lab.iter_mut().zip(self.weights.iter().cycle()).for_each(|(v, w)| *v *= w);
        lab
    }

    /// Weighted mean of diffuse pictures under the environment.
    pub(crate) fn level(&self, halves: &[Planes]) -> [f64; 3] {
        let total = halves.len() as f64 * self.weights.iter().copied().map(f64::from).sum::<f64>();
        std::array::from_fn(|c| {
            let sum = |planes: &Planes| -> f64 {
                planes[c].iter().zip(&self.weights).map(|(value, weight)| f64::from(value * weight)).sum()
            };
            halves.iter().map(sum).sum::<f64>() / total
        })
    }

    /// Equation 3 between two looks.
    fn score(&self, a: &Look, b: &Look, with_diffuse: bool) -> Score {
        self.weighted_score(a, b, with_diffuse, self.own.part_weights())
    }

    /// [`CrossStage::score`] with weights by part and light; what has the weight 0 is not looked at.
    pub(crate) fn weighted_score(
        &self,
        a: &Look,
        b: &Look,
        with_diffuse: bool,
        weights: [ByLight<f64>; 2],
    ) -> Score {
        let diffuse = a.diffuse.as_ref().zip(b.diffuse.as_ref()).filter(|_| with_diffuse);
        let parts = [Some((&a.specular, &b.specular)), diffuse.map(|(a, b)| (&a.images, &b.images))];
        let pixels = (self.own.size() * self.own.size()) as f64;
        let (mut value, mut variance) = (0.0, 0.0);
        for (part, weights) in parts.into_iter().zip(weights) {
            let Some((a, b)) = part else { continue };
            for light in (0..2).filter(|light| weights[*light] > 0.0) {
                let Estimate { sum, error } = a[light].squared_difference(&b[light], &self.weights);
                value += weights[light] * (sum.abs() / pixels).sqrt().copysign(sum);
                // Of the root, near 0 as well, where noise alone decides its size.
                let slope = 0.5 / (sum.abs().max(error) / pixels).sqrt().max(1e-12);
                variance += (weights[light] * slope * error / pixels).powi(2);
            }
        }
        Score { value, error: variance.sqrt() }
    }
}

/// What is compared of a look: specular and perhaps diffuse pictures under both lights.
fn shown(look: &Look, with_diffuse: bool) -> impl Iterator<Item = &NoisyLab> {
    let diffuse = look.diffuse.as_ref().filter(|_| with_diffuse).map(|diffuse| &diffuse.images);
    look.specular.iter().chain(diffuse.into_iter().flatten())
}

impl Look {
    /// A look of given pictures: specular ones, or whole ones where the parts are not told apart.
    pub(crate) fn pictured(
        stage: &CrossStage,
        first: ByLight<Planes>,
        diffuse: Option<(ByLight<Planes>, [f64; 3])>,
    ) -> Self {
        let prepared = |planes: Planes| NoisyLab::new(&[planes], &stage.around);
        let diffuse = diffuse.map(|(images, level)| Diffuse { images: images.map(prepared), level });
        Self { specular: first.map(prepared), diffuse, linear: None, samples: u32::MAX }
    }

    /// A look that is compared as a whole, and once.
    pub(crate) fn compared(whole: ByLight<NoisyLab>) -> Self {
        Self { specular: whole, diffuse: None, linear: None, samples: 0 }
    }

    /// The brightness of the body.
    pub(crate) fn level(&self) -> [f64; 3] {
        self.diffuse.as_ref().map_or([0.0; 3], |diffuse| diffuse.level)
    }
}

/// What noise makes of a mean of two halves.
fn noise(takes: &Takes) -> Option<Image> {
    let [first, second] = &takes.halves[..] else { return None };
    Some(first.zipped(second, |a, b| (a - b) / 2.0))
}

impl CrossStage {
    /// Finds the target of a source point.
    ///
    /// # Errors
    /// [`RemapError::Render`] where the source, or every target, cannot be rendered.
    pub(crate) fn find(
        &self,
        plan: &Plan,
        values: &[f64],
        problem: &Problem,
        syntheses: &Syntheses,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Matched, RemapError> {
        let most = self.sampling.most;
        let source = plan.source_material(values)?;
        // It takes part in every comparison, so that no number of candidates averages its noise out; and is rendered but once.
        let is_noisy = self.archive(&source).is_some_and(|archive| archive.studio.has_noise());
        let seen = self.look(&source, true, if is_noisy { SOURCE * most } else { most })?;
        let level = seen.level();
        let rounded = self.carried(&source, level)?.rounded_albedo();
        let with_diffuse = plan.to.model().renderer.is_none();
        let body = if with_diffuse { Body::Matched } else { Body::Copied };
        let foresight =
            family(plan, &rounded, body)?.map(|family| Foresight { seen: &seen, with_diffuse, family });
        let mut objective = CrossMatch {
            plan,
            stage: self,
            lattice: problem.lattice,
            source: rounded,
            score: &|look| self.score(&seen, look, with_diffuse),
            foresight,
            syntheses,
            scores: HashMap::new(),
            stop,
        };
        let Settled { best, is_decided, samples } = objective.searched(problem, most)?;
        let compared = objective.scores.len();
        let target_values = problem.lattice.values(&best);
        let carried = self.carried(&source, level)?;
        let (target, body) = self.with_body(plan, &carried, &target_values, (level, samples))?;
        let score = self.score(&seen, &*self.look(&target, true, samples)?, true);
        let ([nrmsd, nrmsd_masked], floor) = self.nrmsd(&source, &target, samples)?;
        let fitness = score.value.max(0.0);
        let entry = Entry {
            source: values.to_vec(),
            target: target_values,
            fitness,
            nrmsd,
            nrmsd_masked,
            evaluations: compared,
            saturated: crate::strategy::on_edge(problem.lattice, &best),
            body: Some(body),
            noise: Some(Noise { fitness: score.error, nrmsd: floor, is_decided }),
            failed: None,
        };
        Ok(Matched { best, compared, entry })
    }

    /// A source with the albedo of its body as pictures show it, where formulas cannot tell it.
    fn carried<'a>(&self, source: &'a Material, level: [f64; 3]) -> Result<SourceLook<'a>, RemapError> {
        if source.model().renderer.is_none() {
            return Ok(SourceLook::new(source));
        }
        let grey = Material::parse("lambert:diffuse=0.5")?;
        let known = self.look(&grey, true, 0)?.level();
        let albedo = std::array::from_fn(|c| (0.5 * level[c] / known[c]).clamp(0.0, 1.0));
        Ok(SourceLook::measured(source, albedo))
    }

    /// The target with a body as bright as the source's, and what its colour is of the source's.
    pub(crate) fn with_body(
        &self,
        plan: &Plan,
        look: &SourceLook,
        values: &[f64],
        (level, samples): ([f64; 3], u32),
    ) -> Result<(Material, [f64; 3]), RemapError> {
        let source = look.material();
        if plan.to.model().renderer.is_none() {
            let target = plan.target_with(look, values, Body::Matched)?;
            let gain = ratio(body_colour(&target), body_colour(source));
            return Ok((target, gain));
        }
        let scaled = |gain| plan.target_with(look, values, Body::Scaled(gain));
        let mut gain = [1.0; 3];
        let mut target = scaled(gain)?;
        let is_same = std::ptr::eq(source.model(), target.model());
        let are_lambert = [source, &target].iter().all(|m| m.by_role(Role::DiffuseReflectance).is_some());
        if is_same || are_lambert || body_colour(&target) == [0.0; 3] {
            return Ok((target, gain));
        }
        for _ in 0..BODY_STEPS {
            let seen = self.look(&target, true, samples)?;
            let step = ratio(level, seen.level());
            if step.iter().all(|step| (step - 1.0).abs() < BODY_TOLERANCE) {
                break;
            }
            gain = std::array::from_fn(|c| gain[c] * step[c]);
            target = scaled(gain)?;
        }
        Ok((target, gain))
    }
}

/// The colour of the body, as its parameter has it.
fn body_colour(material: &Material) -> [f64; 3] {
    let role =
        [Role::DiffuseReflectance, Role::BaseColour].into_iter().find_map(|role| material.by_role(role));
    role.and_then(|value| value.colour()).unwrap_or([0.0; 3])
}

/// `a / b` where both are brighter than noise, else 1.
fn ratio(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| if a[c] > 1e-6 && b[c] > 1e-6 { a[c] / b[c] } else { 1.0 })
}
