//! The reference scene under its two lights, materials as seen in it, and the distance between two of them.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use lookmatch_imaging::{
    Fitness, Reduce, Space, lab_planes, lab_planes_of, squared_distance, weighted_squared_distance,
};
use lookmatch_materials::{Bsdf, Material};
use lookmatch_rendering::{Illumination, Lobes, Observe, Part, Planes, Progress, Renderer, TransportCache};
use rayon::prelude::*;

use crate::projection::{Projection, Sketches};
use crate::{Plan, RemapError};

/// What the metric knows of a material: the specular images under both lights in CIELAB, on the subject's pixels only.
/// Everywhere else two materials look the same, because nothing else in the scene changes.
#[derive(Clone, Debug)]
pub struct Appearance {
    /// Planes L*, a*, b* of the specular image under the point light.
    point: Vec<f32>,
    /// The same under the environment.
    environment: Vec<f32>,
}

/// The reference scene, prepared under both lights.
pub struct Stage {
    point: Renderer,
    environment: Renderer,
    metric: Fitness,
    /// Mask weights on the subject's pixels.
    weights: Option<Vec<f32>>,
    /// Diffuse-only images in CIELAB by albedo: few, because the albedo is seldom searched.
    diffuse: Mutex<HashMap<[u64; 3], Arc<Appearance>>>,
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
        let prepare = |before: f64, light| {
            let of_both = |progress| match progress {
                Progress::Preparing(share) => observe(Progress::Preparing(before + share / 2.0)),
                other => observe(other),
            };
            Renderer::cached(&plan.scene, light, plan.size, cache, &of_both)
        };
        let point = prepare(0.0, Illumination::Point)?;
        let environment = prepare(0.5, Illumination::Environment)?;
        let on_subject = |weights: &[f32]| point.subjects().iter().map(|i| weights[*i as usize]).collect();
        let weights = plan.mask.then(|| on_subject(point.mask().weights()));
        let diffuse = Mutex::new(HashMap::new());
        Ok(Self { metric: plan.metric, weights, diffuse, point, environment })
    }

    /// Size of an [`Appearance`]: three planes under each of two lights.
    pub(crate) fn appearance_bytes(&self) -> usize {
        2 * 3 * self.point.subjects().len() * size_of::<f32>()
    }

    /// Renders materials, on all cores, in their order.
    pub fn appearances(&self, materials: &[Material]) -> Vec<Appearance> {
        let bsdfs: Vec<Box<dyn Bsdf>> = materials.iter().map(Material::bsdf).collect();
        let bsdfs: Vec<&dyn Bsdf> = bsdfs.iter().map(|b| &**b).collect();
        let lobes = Lobes::new(&bsdfs);
        let lab = |renderer: &Renderer| -> Vec<Vec<f32>> {
            let lab = |[r, g, b]: &Planes| {
                let mut lab = vec![0.0; 3 * r.len()];
                lab_planes_of([r, g, b], &mut lab);
                lab
            };
            renderer.specular_planes(&lobes).par_iter().map(lab).collect()
        };
        let pairs = lab(&self.point).into_iter().zip(lab(&self.environment));
        pairs.map(|(point, environment)| Appearance { point, environment }).collect()
    }

    /// Renders one material.
    pub fn appearance(&self, material: &Material) -> Appearance {
        self.appearances(std::slice::from_ref(material)).swap_remove(0)
    }

    /// Eq. 3 of Guarnera *et al.* (2018) between two materials whose specular appearances are given.
    pub fn fitness(
        &self,
        (a, seen_a): (&Material, &Appearance),
        (b, seen_b): (&Material, &Appearance),
    ) -> f64 {
        let w = &self.metric.weights;
        let specular = w.specular
            * (w.specular_point * self.rms(&seen_a.point, &seen_b.point)
                + w.specular_environment * self.rms(&seen_a.environment, &seen_b.environment));
        let (albedo_a, albedo_b) = (a.bsdf().diffuse(), b.bsdf().diffuse());
        if albedo_a == albedo_b { specular } else { specular + self.diffuse_fitness(a, b) }
    }

    /// The part of Eq. 3 that the diffuse images make.
    pub(crate) fn diffuse_fitness(&self, a: &Material, b: &Material) -> f64 {
        let (albedo_a, albedo_b) = (a.bsdf().diffuse(), b.bsdf().diffuse());
        if albedo_a == albedo_b {
            return 0.0;
        }
        let w = &self.metric.weights;
        let (a, b) = (self.diffuse_appearance(a, albedo_a), self.diffuse_appearance(b, albedo_b));
        let diffuse = w.diffuse_point * self.rms(&a.point, &b.point)
            + w.diffuse_environment * self.rms(&a.environment, &b.environment);
        w.diffuse * diffuse
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
        [fit(|s| &s.point, point), fit(|s| &s.environment, environment)]
    }

    /// Renders materials and keeps no more of them than their coordinates.
    pub(crate) fn sketches(
        &self,
        materials: &[Material],
        [point, environment]: &[Projection; 2],
    ) -> [Sketches; 2] {
        let bsdfs: Vec<Box<dyn Bsdf>> = materials.iter().map(Material::bsdf).collect();
        let bsdfs: Vec<&dyn Bsdf> = bsdfs.iter().map(|b| &**b).collect();
        let lobes = Lobes::new(&bsdfs);
        let sketch = |renderer: &Renderer, projection: &Projection| {
            let images = renderer.specular_planes(&lobes);
            projection.project(images.len(), &|image, pixels, planes| {
                let [r, g, b] = &images[image];
                lab_planes_of([&r[pixels.clone()], &g[pixels.clone()], &b[pixels]], planes);
            })
        };
        [sketch(&self.point, point), sketch(&self.environment, environment)]
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
        [sketch(|s| &s.point, point), sketch(|s| &s.environment, environment)]
    }

    /// NRMSD per channel of the full pictures under the environment, whole image: without and with the mask.
    pub fn nrmsd(&self, source: &Material, target: &Material) -> Result<[[f64; 3]; 2], RemapError> {
        let images = self.environment.render_batch(&[source, target], Part::Full);
        let nrmsd = |mask| lookmatch_imaging::nrmsd(&images[0], &images[1], mask);
        Ok([nrmsd(None)?, nrmsd(Some(self.environment.mask()))?])
    }

    fn diffuse_appearance(&self, material: &Material, albedo: [f64; 3]) -> Arc<Appearance> {
        let key = albedo.map(f64::to_bits);
        // A panic elsewhere leaves nothing half-written in this map.
        let mut cache = self.diffuse.lock().unwrap_or_else(PoisonError::into_inner);
        let lab = |renderer: &Renderer| {
            let image = renderer.render(material, Part::DiffuseOnly);
            let pixels: Vec<_> = renderer.subjects().iter().map(|i| image.pixels()[*i as usize]).collect();
            planes(&pixels)
        };
        let render = || Appearance { point: lab(&self.point), environment: lab(&self.environment) };
        cache.entry(key).or_insert_with(|| Arc::new(render())).clone()
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

fn planes(pixels: &[[f32; 3]]) -> Vec<f32> {
    let mut planes = vec![0.0; 3 * pixels.len()];
    lab_planes(pixels, &mut planes);
    planes
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
            let fast = stage.fitness((&a, &stage.appearance(&a)), (&b, &stage.appearance(&b)));
            let mask = mask.then(|| stage.point.mask());
            let exact = plan.metric.evaluate(&images(&a), &images(&b), mask).unwrap();
            assert!((fast - exact).abs() < 1e-3 * exact, "{fast} {exact}");
        }
    }
}
