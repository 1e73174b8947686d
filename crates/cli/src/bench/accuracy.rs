//! How far pictures are from converged ones.

use indicatif::ProgressBar;
use lookmatch_imaging::{delta_e76, lab_from_linear_srgb};
use lookmatch_materials::Material;
use lookmatch_rendering::{Illumination, Part, PathTracer, Renderer};
use serde::Serialize;

use super::materials::{Named, surveyed};
use super::{Effort, Stage};
use crate::output::bar;

type Pixels = Vec<[f32; 3]>;

/// Differences from converged pictures over a list of materials under both lights.
#[derive(Debug, Serialize)]
pub(crate) struct Accuracy {
    /// Mean ΔE*76 over all materials, lights and pixels; the noise of the converged pictures is part of it.
    pub(crate) mean_delta_e: f64,
    /// The mean over pixels and lights of the worst material.
    pub(crate) worst_delta_e: f64,
    /// Root mean square of ΔE*76, free of the converged pictures' noise.
    pub(crate) rms_delta_e: f64,
    /// Mean ΔE*76 that the noise of the converged pictures alone gives.
    pub(crate) noise_delta_e: f64,
    pub(crate) materials: Vec<MaterialError>,
}

/// The differences of one material.
#[derive(Debug, Serialize)]
pub(crate) struct MaterialError {
    pub(crate) name: String,
    pub(crate) material: Material,
    pub(crate) point: Difference,
    pub(crate) environment: Difference,
}

/// Differences of a picture from a converged one, the mean of two with independent noise.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Difference {
    pub(crate) mean_delta_e: f64,
    pub(crate) largest_delta_e: f64,
    /// Free of noise: the two converged pictures' differences from ours are multiplied, not squared, and their
    /// independent errors cancel.
    pub(crate) rms_delta_e: f64,
    pub(crate) noise_delta_e: f64,
    /// Root of the mean squared difference of linear RGB, over that of the values.
    pub(crate) relative_rmse: f64,
    /// The same for the noise alone.
    pub(crate) relative_noise: f64,
    /// Mean of our values over the converged ones, less 1.
    pub(crate) brightness: f64,
}

impl Accuracy {
    /// Measures the surveyed materials under both lights.
    pub(crate) fn measure(stage: &Stage, effort: &Effort) -> anyhow::Result<Self> {
        let surveyed = surveyed()?;
        let progress = bar(2 * surveyed.len(), "tracing paths");
        let under = |light| differences(stage, light, &surveyed, effort, &progress);
        let (point, environment) = (under(Illumination::Point)?, under(Illumination::Environment)?);
        progress.finish_and_clear();
        let errors = surveyed.into_iter().zip(point).zip(environment);
        let materials: Vec<MaterialError> = errors
            .map(|((Named { name, material }, point), environment)| MaterialError {
                name,
                material,
                point,
                environment,
            })
            .collect();
        let mean = |value: fn(&Difference) -> f64| {
            materials.iter().map(|m| m.mean(value)).sum::<f64>() / materials.len() as f64
        };
        Ok(Self {
            mean_delta_e: mean(|d| d.mean_delta_e),
            worst_delta_e: materials.iter().map(|m| m.mean(|d| d.mean_delta_e)).fold(0.0, f64::max),
            rms_delta_e: mean(|d| d.rms_delta_e * d.rms_delta_e).sqrt(),
            noise_delta_e: mean(|d| d.noise_delta_e),
            materials,
        })
    }
}

impl MaterialError {
    /// Mean over both lights.
    pub(crate) fn mean(&self, value: impl Fn(&Difference) -> f64) -> f64 {
        (value(&self.point) + value(&self.environment)) / 2.0
    }
}

/// The differences of materials under a light.
pub(crate) fn differences(
    stage: &Stage,
    light: Illumination,
    materials: &[Named],
    effort: &Effort,
    progress: &ProgressBar,
) -> anyhow::Result<Vec<Difference>> {
    let pixels = stage.pixels(effort.pixels);
    let truth = Truth::prepare(stage, light, effort.samples)?;
    let difference = |Named { material, .. }: &Named| {
        let truth = truth.halves(material, &pixels);
        progress.inc(1);
        let ours = ours(stage.renderer(light), material, &pixels);
        Difference::between([&ours, &ours], &truth)
    };
    Ok(materials.iter().map(difference).collect())
}

/// Some pixels of our picture.
pub(crate) fn ours(renderer: &Renderer, material: &Material, pixels: &[u32]) -> Pixels {
    let image = renderer.render(material, Part::Full);
    pixels.iter().map(|p| image.pixels()[*p as usize]).collect()
}

impl Difference {
    /// Compares pixels with converged ones. Of both there are two versions with independent noise, which may be the same
    /// where there is no noise.
    pub(crate) fn between(ours: [&Pixels; 2], truth: &[Pixels; 2]) -> Self {
        let mut sums = Sums::default();
        for k in 0..ours[0].len() {
            let exact = |pixels: &Pixels| pixels[k].map(f64::from);
            sums.add(ours.map(exact), truth.each_ref().map(exact));
        }
        sums.difference(ours[0].len() as f64)
    }
}

/// What [`Difference`] sums up over pixels.
#[derive(Default)]
struct Sums {
    delta_e: f64,
    largest: f64,
    product: f64,
    noise: f64,
    squares: f64,
    noise_squares: f64,
    power: f64,
    ours: f64,
    truth: f64,
}

impl Sums {
    fn add(&mut self, ours: [[f64; 3]; 2], truth: [[f64; 3]; 2]) {
        let mean = |[a, b]: [[f64; 3]; 2]| -> [f64; 3] { std::array::from_fn(|c| (a[c] + b[c]) / 2.0) };
        let (our_mean, true_mean) = (mean(ours), mean(truth));
        let delta_e = delta_e76(lab_from_linear_srgb(our_mean), lab_from_linear_srgb(true_mean));
        self.delta_e += delta_e;
        self.largest = self.largest.max(delta_e);
        let (lab_ours, lab_truth) = (ours.map(lab_from_linear_srgb), truth.map(lab_from_linear_srgb));
        let off = |version: usize, c: usize| lab_ours[version][c] - lab_truth[version][c];
        self.product += (0..3).map(|c| off(0, c) * off(1, c)).sum::<f64>();
        self.noise += delta_e76(lab_truth[0], lab_truth[1]) / 2.0;
        for c in 0..3 {
            self.squares += (our_mean[c] - true_mean[c]).powi(2);
            self.noise_squares += (truth[0][c] - truth[1][c]).powi(2) / 4.0;
            self.power += true_mean[c] * true_mean[c];
            self.ours += our_mean[c];
            self.truth += true_mean[c];
        }
    }

    fn difference(&self, count: f64) -> Difference {
        Difference {
            mean_delta_e: self.delta_e / count,
            largest_delta_e: self.largest,
            // Noise can take the product of small differences below zero.
            rms_delta_e: (self.product.max(0.0) / count).sqrt(),
            noise_delta_e: self.noise / count,
            relative_rmse: (self.squares / self.power).sqrt(),
            relative_noise: (self.noise_squares / self.power).sqrt(),
            brightness: self.ours / self.truth - 1.0,
        }
    }
}

/// Two path tracers that differ in nothing but their random numbers.
pub(crate) struct Truth([PathTracer; 2]);

impl Truth {
    /// Prepares both for some number of paths per pixel.
    pub(crate) fn prepare(stage: &Stage, light: Illumination, samples: u32) -> anyhow::Result<Self> {
        let size = stage.renderer(light).size();
        let prepare = |seed| PathTracer::prepare(&stage.scene, light, size, samples, seed);
        Ok(Self([prepare(1)?, prepare(2)?]))
    }

    /// Two independent pictures of a material at some pixels.
    pub(crate) fn halves(&self, material: &Material, pixels: &[u32]) -> [Pixels; 2] {
        self.0.each_ref().map(|tracer| tracer.radiance(material, Part::Full, pixels))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_does_not_count_as_error() {
        // Our picture is exact; the converged ones are off by independent steps.
        let ours = vec![[0.5; 3]; 4];
        let off = |steps: [f32; 4]| steps.map(|s| [0.5 + 0.01 * s; 3]).to_vec();
        let truth = [off([1.0, 1.0, -1.0, -1.0]), off([1.0, -1.0, 1.0, -1.0])];
        let exact = Difference::between([&ours, &ours], &truth);
        assert!(exact.rms_delta_e < 0.1 * exact.mean_delta_e && exact.noise_delta_e > 0.1, "{exact:?}");
        let biased = Difference::between([&ours, &ours], &[off([2.0; 4]), off([2.0; 4])]);
        assert!((biased.rms_delta_e - biased.mean_delta_e).abs() < 1e-9 && biased.noise_delta_e == 0.0);
        assert!((biased.relative_rmse - 0.02 / 0.52).abs() < 1e-6, "{biased:?}");
    }
}
