//! The reference scene under its two lights, materials as seen in it, and the distance between two of them.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use lookmatch_imaging::{
    Fitness, FitnessTerms, Reduce, Space, lab_planes_of, squared_distance, weighted_squared_distance,
};
use lookmatch_materials::Material;
use lookmatch_rendering::{
    DiffuseKey, Illumination, Observe, Part, Planes, Progress, Renderer, Scene, SplitLobes, TransportCache,
};
use rayon::prelude::*;

use crate::gallery::Gallery;
use crate::projection::{Projection, Sketches};
use crate::synthesis::LabPictures;
use crate::{Plan, RemapError};

/// What the metric knows of a material: its specular and diffuse images under both lights in CIELAB, on the subject's
/// pixels only. Everywhere else two materials look the same, because nothing else in the scene changes.
#[derive(Clone, Debug)]
pub struct Appearance {
    specular: Images,
    /// Shared by all materials with the same diffuse reflection.
    diffuse: Arc<Images>,
}

/// Images under both lights: planes L*, a*, b*.
#[derive(Clone, Debug)]
struct Images {
    point: Vec<f32>,
    environment: Vec<f32>,
}

/// The lights of the reference scene, in the order of everything that is given for them.
pub(crate) const LIGHTS: [Illumination; 2] = [Illumination::Point, Illumination::Environment];

/// The reference scene, prepared under both lights.
pub struct Stage {
    point: Renderer,
    environment: Renderer,
    metric: Fitness,
    /// Mask weights on the subject's pixels.
    weights: Option<Vec<f32>>,
    /// Appearances that may be asked for again.
    gallery: Gallery,
    /// The diffuse images of appearances that still exist.
    diffuse: Mutex<HashMap<DiffuseKey, Weak<Images>>>,
}

impl Stage {
    /// Prepares the scene of a plan.
    ///
    /// # Errors
    /// Where the scene cannot be rendered, or the metric is not one that this fast path evaluates (CIELAB, root mean
    /// square).
    pub fn prepare(plan: &Plan) -> Result<Self, RemapError> {
        Self::cached(plan, &TransportCache::off(), &|_| ())
    }

    /// [`Stage::prepare`] with light that is kept in a cache; see [`Renderer::cached`].
    ///
    /// # Errors
    /// As [`Stage::prepare`].
    pub fn cached(plan: &Plan, cache: &TransportCache, observe: Observe) -> Result<Self, RemapError> {
        if plan.metric.space != Space::Lab || plan.metric.reduce != Reduce::Rms {
            return Err(RemapError::Option("a remap compares in CIELAB by the root mean square".into()));
        }
        Self::of(&plan.scene, plan.size, plan.metric, plan.mask, cache, observe)
    }

    /// Prepares the reference scene for comparisons of materials that no plan is about.
    ///
    /// # Errors
    /// A size that cannot be rendered.
    pub fn reference(size: usize, cache: &TransportCache, observe: Observe) -> Result<Self, RemapError> {
        Self::of(&Scene::reference(), size, Fitness::default(), false, cache, observe)
    }

    /// A scene under its two lights, with a metric in CIELAB.
    fn of(
        scene: &Scene,
        size: usize,
        metric: Fitness,
        mask: bool,
        cache: &TransportCache,
        observe: Observe,
    ) -> Result<Self, RemapError> {
        let prepare = |before: f64, light| {
            let of_both = |progress| match progress {
                Progress::Preparing(share) => observe(Progress::Preparing(before + share / 2.0)),
                other => observe(other),
            };
            Renderer::cached(scene, light, size, cache, &of_both)
        };
        let point = prepare(0.0, Illumination::Point)?;
        let environment = prepare(0.5, Illumination::Environment)?;
        let on_subject = |weights: &[f32]| point.subjects().iter().map(|i| weights[*i as usize]).collect();
        let weights = mask.then(|| on_subject(point.mask().weights()));
        let diffuse = Mutex::new(HashMap::new());
        let gallery = Gallery::new(appearance_bytes(&point));
        Ok(Self { metric, weights, gallery, diffuse, point, environment })
    }

    /// Renders materials, on all cores, in their order.
    pub fn appearances(&self, materials: &[Material]) -> Vec<Appearance> {
        let lobes = SplitLobes::new(materials);
        let (point, environment) = (self.point.split_planes(&lobes), self.environment.split_planes(&lobes));
        let images = |point: &Planes, environment: &Planes| Images {
            point: lab(point),
            environment: lab(environment),
        };
        let appearance = |k: usize| Appearance {
            specular: images(&point.specular[k], &environment.specular[k]),
            diffuse: self.diffuse_images(lobes.diffuse_key(k), &|| {
                let place = lobes.diffuse_place(k);
                images(&point.diffuse[place], &environment.diffuse[place])
            }),
        };
        (0..materials.len()).into_par_iter().map(appearance).collect()
    }

    /// [`Stage::appearances`] that keeps what it renders for the next time.
    pub(crate) fn known_appearances(&self, materials: &[Material]) -> Vec<Arc<Appearance>> {
        self.gallery.look(self, materials)
    }

    /// Renders one material.
    pub fn appearance(&self, material: &Material) -> Appearance {
        self.appearances(std::slice::from_ref(material)).swap_remove(0)
    }

    /// Eq. 3 of Guarnera *et al.* (2018) between two materials as they are seen.
    pub fn fitness(&self, a: &Appearance, b: &Appearance) -> f64 {
        self.metric.weights.sum(&self.terms(a, b))
    }

    /// The norms of Eq. 3, which any weights can be given to.
    pub fn terms(&self, a: &Appearance, b: &Appearance) -> FitnessTerms {
        FitnessTerms {
            specular_point: self.rms(&a.specular.point, &b.specular.point),
            specular_environment: self.rms(&a.specular.environment, &b.specular.environment),
            ..self.diffuse_terms(a, b)
        }
    }

    /// The part of Eq. 3 that the diffuse images make.
    pub(crate) fn diffuse_fitness(&self, a: &Appearance, b: &Appearance) -> f64 {
        self.metric.weights.sum(&self.diffuse_terms(a, b))
    }

    fn diffuse_terms(&self, a: &Appearance, b: &Appearance) -> FitnessTerms {
        let (a, b) = (&a.diffuse, &b.diffuse);
        if Arc::ptr_eq(a, b) {
            return FitnessTerms::default();
        }
        FitnessTerms {
            diffuse_point: self.rms(&a.point, &b.point),
            diffuse_environment: self.rms(&a.environment, &b.environment),
            ..FitnessTerms::default()
        }
    }

    /// Squared distances of specular pictures under both lights: of a material as it is seen, and of a lobe times a scale, given its
    /// linear planes.
    pub(crate) fn scaled_squares(&self, seen: &Appearance, planes: &[Planes; 2], scale: f32) -> [f64; 2] {
        let scaled =
            |planes: &Planes| planes.each_ref().map(|plane| plane.iter().map(|v| v * scale).collect());
        let squares = |seen: &[f32], planes| match &self.weights {
            Some(weights) => weighted_squared_distance(seen, &lab(&scaled(planes)), weights),
            None => squared_distance(seen, &lab(&scaled(planes))),
        };
        [squares(&seen.specular.point, &planes[0]), squares(&seen.specular.environment, &planes[1])]
    }

    /// The scene under the point light and under the environment.
    pub(crate) fn views(&self) -> [&Renderer; 2] {
        [&self.point, &self.environment]
    }

    /// Side of the pictures in pixels.
    pub fn size(&self) -> usize {
        self.point.size()
    }

    /// Weights of equation 3: of the specular and the diffuse part, for each of them by light.
    pub(crate) fn part_weights(&self) -> [[f64; 2]; 2] {
        let w = &self.metric.weights;
        [
            [w.specular_point, w.specular_environment].map(|light| w.specular * light),
            [w.diffuse_point, w.diffuse_environment].map(|light| w.diffuse * light),
        ]
    }

    /// Mask weights on the subject's pixels, where there is a mask.
    pub(crate) fn mask_weights(&self) -> Option<&[f32]> {
        self.weights.as_deref()
    }

    /// What a unit of distance between two pictures adds to the fitness, in the order of [`Stage::pictures`].
    pub(crate) fn picture_shares(&self) -> Vec<f64> {
        self.part_weights().as_flattened().iter().map(|weight| weight / self.point.size() as f64).collect()
    }

    /// The pictures of an appearance, weighted per pixel: specular and diffuse ones under both lights.
    pub(crate) fn pictures(&self, seen: &Appearance) -> LabPictures {
        let images = [&seen.specular, &*seen.diffuse];
        images
            .into_iter()
            .flat_map(|i| [&i.point, &i.environment])
            .map(|lab| self.weighted(lab.clone()))
            .collect()
    }

    /// The pictures of a material whose BSDF lies between two others, given their linear planes and the share of the second.
    pub(crate) fn mixed_pictures(&self, [a, b]: [&[[Planes; 2]; 2]; 2], share: f64) -> LabPictures {
        let share = share as f32;
        let mixed =
            |(a, b): (&Vec<f32>, &Vec<f32>)| a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect();
        let picture = |part: usize, light: usize| {
            let (a, b) = (&a[part][light], &b[part][light]);
            self.weighted(lab(&std::array::from_fn(|c| mixed((&a[c], &b[c])))))
        };
        vec![picture(0, 0), picture(0, 1), picture(1, 0), picture(1, 1)]
    }

    fn weighted(&self, mut lab: Vec<f32>) -> Vec<f32> {
        if let Some(weights) = &self.weights {
            lab.iter_mut().zip(weights.iter().cycle()).for_each(|(v, w)| *v *= w);
        }
        lab
    }

    /// Linear planes of materials: for each of them the specular (0) and the diffuse (1) picture, by light.
    pub(crate) fn linear_planes(&self, materials: &[Material]) -> Vec<[[Planes; 2]; 2]> {
        let lobes = SplitLobes::new(materials);
        let split = self.views().map(|view| view.split_planes(&lobes));
        let of = |k: usize| {
            let place = lobes.diffuse_place(k);
            [[0, 1].map(|l| split[l].specular[k].clone()), [0, 1].map(|l| split[l].diffuse[place].clone())]
        };
        (0..materials.len()).map(of).collect()
    }

    /// What a unit of distance between two specular images adds to the fitness, by light: point, environment.
    pub(crate) fn shares(&self) -> [f64; 2] {
        let w = &self.metric.weights;
        [w.specular_point, w.specular_environment].map(|light| w.specular * light / self.point.size() as f64)
    }

    /// Projections under both lights that leave differences between some appearances of at most about `tolerance` in
    /// fitness.
    pub(crate) fn fit_projections(&self, samples: &[Appearance], tolerance: f64) -> [Projection; 2] {
        let [point, environment] = self.shares().map(|share| tolerance / share);
        let fit = |planes: fn(&Appearance) -> &[f32], tolerance| {
            let samples: Vec<&[f32]> = samples.iter().map(planes).collect();
            Projection::fit(&samples, self.weights.as_deref(), tolerance)
        };
        [fit(|s| &s.specular.point, point), fit(|s| &s.specular.environment, environment)]
    }

    /// Renders materials and keeps no more of them than the coordinates of their specular images, and what tells their
    /// diffuse ones apart.
    pub(crate) fn sketches(
        &self,
        materials: &[Material],
        [point, environment]: &[Projection; 2],
    ) -> ([Sketches; 2], Vec<DiffuseKey>) {
        let lobes = SplitLobes::new(materials);
        let sketch = |renderer: &Renderer, projection: &Projection| {
            let images = renderer.split_planes(&lobes).specular;
            projection.project(images.len(), &|image, pixels, planes| {
                let [r, g, b] = &images[image];
                lab_planes_of([&r[pixels.clone()], &g[pixels.clone()], &b[pixels]], planes);
            })
        };
        let keys = (0..materials.len()).map(|k| lobes.diffuse_key(k)).collect();
        ([sketch(&self.point, point), sketch(&self.environment, environment)], keys)
    }

    /// The coordinates of appearances.
    pub(crate) fn sketches_of(
        &self,
        seen: &[Appearance],
        [point, environment]: &[Projection; 2],
    ) -> [Sketches; 2] {
        let sketch = |whole: fn(&Appearance) -> &[f32], projection: &Projection| {
            projection.project(seen.len(), &|image, pixels, planes| {
                let wholes = whole(&seen[image]).chunks_exact(self.point.subjects().len());
                let parts = planes.chunks_exact_mut(pixels.len()).zip(wholes);
                parts.for_each(|(part, whole)| part.copy_from_slice(&whole[pixels.clone()]));
            })
        };
        [sketch(|s| &s.specular.point, point), sketch(|s| &s.specular.environment, environment)]
    }

    /// NRMSD per channel of the full pictures under the environment, whole image: without and with the mask.
    pub fn nrmsd(&self, source: &Material, target: &Material) -> Result<[[f64; 3]; 2], RemapError> {
        let images = self.environment.render_batch(&[source, target], Part::Full);
        let nrmsd = |mask| lookmatch_imaging::nrmsd(&images[0], &images[1], mask);
        Ok([nrmsd(None)?, nrmsd(Some(self.environment.mask()))?])
    }

    /// Diffuse images that are known, or new ones.
    fn diffuse_images(&self, key: DiffuseKey, render: &dyn Fn() -> Images) -> Arc<Images> {
        // A panic elsewhere leaves nothing half-written in this map.
        let known = || self.diffuse.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(images) = known().get(&key).and_then(Weak::upgrade) {
            return images;
        }
        let images = Arc::new(render());
        let mut known = known();
        known.retain(|_, images| images.strong_count() > 0);
        // Another thread may have been faster: all must share one.
        if let Some(images) = known.get(&key).and_then(Weak::upgrade) {
            return images;
        }
        known.insert(key, Arc::downgrade(&images));
        images
    }

    /// Root mean square of ΔE76 over the whole image; pixels beside the subject add nothing.
    fn rms(&self, a: &[f32], b: &[f32]) -> f64 {
        let sum = match &self.weights {
            Some(weights) => weighted_squared_distance(a, b, weights),
            None => squared_distance(a, b),
        };
        (sum / (self.point.size() * self.point.size()) as f64).sqrt()
    }
}

/// Size of an [`Appearance`] with diffuse images of its own: three planes of two images under each of two lights.
fn appearance_bytes(renderer: &Renderer) -> usize {
    2 * 2 * 3 * renderer.subjects().len() * size_of::<f32>()
}

fn lab([r, g, b]: &Planes) -> Vec<f32> {
    let mut lab = vec![0.0; 3 * r.len()];
    lab_planes_of([r, g, b], &mut lab);
    lab
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Options;
    use lookmatch_imaging::{Image, ProbeImages};
    use lookmatch_materials::by_name;

    /// A picture without what the material throws onto the checkerboard: searches compare the subject's pixels.
    fn subject(renderer: &Renderer, material: &Material, part: Part) -> Image {
        let picture = renderer.render(material, part);
        let mut subject = Image::new(renderer.size(), renderer.size());
        for pixel in renderer.subjects() {
            subject.pixels_mut()[*pixel as usize] = picture.pixels()[*pixel as usize];
        }
        subject
    }

    /// The stage's fast path against the metric as it is written, on whole images.
    #[test]
    fn fitness_is_equation_three() {
        for mask in [false, true] {
            let options = Options { mask, quick: true, ..Options::default() };
            let mut plan = Plan::new(by_name("ward").unwrap(), by_name("ggx").unwrap(), &options).unwrap();
            plan.size = 48;
            let stage = Stage::prepare(&plan).unwrap();
            let images = |m: &Material| ProbeImages {
                diffuse_point: subject(&stage.point, m, Part::DiffuseOnly),
                diffuse_environment: subject(&stage.environment, m, Part::DiffuseOnly),
                full_point: subject(&stage.point, m, Part::Full),
                full_environment: subject(&stage.environment, m, Part::Full),
            };
            let a = Material::parse("ward:diffuse=0.4,specular=0.2,roughness=0.1").unwrap();
            let b = Material::parse("ggx:diffuse=0.5/0.4/0.3,ior=1.8,roughness=0.15").unwrap();
            let fast = stage.fitness(&stage.appearance(&a), &stage.appearance(&b));
            let mask = mask.then(|| stage.point.mask());
            let exact = plan.metric.evaluate(&images(&a), &images(&b), mask).unwrap();
            assert!((fast - exact).abs() < 1e-3 * exact, "{fast} {exact}");
        }
    }
}
