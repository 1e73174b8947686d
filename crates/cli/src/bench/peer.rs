//! Another renderer beside ours, at equal error: Mitsuba 3, path tracing the same scene with the same material.
//!
//! A path tracer's error falls with the square root of its samples, and as many as would reach our error take hours. So the
//! peer is timed at several numbers of samples, and its time for our error is extrapolated with that law. Stratified
//! samples do better while they are few; what the exponent measured between the last two runs would give, if it lasted
//! for ever, is reported too, as the least that can be said. Of the peer's error only its noise is counted, as seen between
//! two pictures; of ours all that separates it from converged pictures, their noise included.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use indicatif::ProgressBar;
use lookmatch_imaging::{Image, delta_e76, lab_from_linear_srgb};
use lookmatch_materials::{Material, Role};
use lookmatch_renderers::{Job, Launch, Picture, Pool, PoolOptions};
use lookmatch_rendering::Illumination;
use serde::Serialize;
use serde_json::{Value as Json, json};
use tempfile::TempDir;

use super::accuracy::{Difference, Truth, ours};
use super::materials::{Named, shared};
use super::timing::PictureCost;
use super::{Effort, Stage};
use crate::output::spinner;

/// The renderer, by the name that it is installed by.
pub(crate) const PEER: &str = "mitsuba";
/// The sampler with the least error for its time, of those that Mitsuba has.
const SAMPLER: &str = "multijitter";
/// What it calls the scene.
const SCENE: &str = "benchmark";
/// What its log says before the path of the LLVM library.
const LLVM: &str = "compiles with ";
/// Our error is a single material's here, so that many more paths per pixel can be paid for.
const MORE_PATHS: u32 = 8;

/// The peer's speed and error beside ours, for pictures under the environment.
#[derive(Debug, Serialize)]
pub(crate) struct PeerReport {
    pub(crate) name: &'static str,
    pub(crate) version: String,
    pub(crate) sampler: &'static str,
    /// The LLVM library that the peer compiles with.
    pub(crate) llvm: Option<String>,
    /// The variants that were tried, all with the same number of samples.
    pub(crate) variants: Vec<Variant>,
    /// The fastest of them, which all other figures belong to.
    pub(crate) variant: &'static str,
    pub(crate) comparisons: Vec<Comparison>,
    /// Pictures that the peer rendered.
    pub(crate) images: usize,
}

/// Both renderers' pictures of one material.
#[derive(Debug, Serialize)]
pub(crate) struct Comparison {
    pub(crate) name: String,
    pub(crate) material: Material,
    /// The peer's pictures, in ascending order of samples.
    pub(crate) runs: Vec<Run>,
    /// The peer's two best pictures against the converged ones.
    pub(crate) bias: Difference,
    /// Root mean square ΔE*76 of a bias that noise alone could pretend.
    pub(crate) bias_threshold: f64,
    /// Our picture against the converged ones.
    pub(crate) ours: Difference,
    #[serde(flatten)]
    pub(crate) cost: PictureCost,
    #[serde(flatten)]
    pub(crate) equal: EqualError,
}

/// A variant of the peer.
#[derive(Debug, Serialize)]
pub(crate) struct Variant {
    pub(crate) name: &'static str,
    pub(crate) samples: u32,
    /// CPU seconds of all threads.
    pub(crate) cpu_s: f64,
}

/// Pictures with some number of samples.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Run {
    /// Samples per pixel.
    pub(crate) samples: u32,
    /// CPU seconds of all threads for the faster of two pictures; the other may have had to be compiled.
    pub(crate) cpu_s: f64,
    pub(crate) wall_s: f64,
    /// Root mean square of the noise over that of the values, on the subject's pixels.
    pub(crate) relative_rmse: f64,
    /// Mean ΔE*76 of the noise.
    pub(crate) mean_delta_e: f64,
}

impl PeerReport {
    /// Measures the peer and our errors for the same pictures.
    pub(crate) fn measure(launch: &Launch, stage: &Stage, effort: &Effort) -> anyhow::Result<Self> {
        let progress = spinner("Mitsuba: choosing a variant");
        let materials = shared()?;
        let folder = TempDir::with_prefix("lookmatch-peer-").context("cannot create a temporary folder")?;
        let log = folder.path().join("log");
        let mut studio = Studio { launch, stage, effort, log: &log, variant: SLOW };
        let (variants, version) = studio.variants(&materials[0].material, &progress)?;
        let fastest = variants.iter().min_by(|a, b| a.cpu_s.total_cmp(&b.cpu_s));
        studio.variant = fastest.map_or(SLOW, |v| v.name);
        let compare = |named: Named| {
            progress.set_message(format!("Mitsuba: {}", named.name));
            studio.compare(named)
        };
        let comparisons = materials.into_iter().map(compare).collect::<anyhow::Result<Vec<_>>>()?;
        progress.finish_and_clear();
        Ok(Self {
            name: "Mitsuba 3",
            version,
            sampler: SAMPLER,
            llvm: llvm(&log),
            // Each measurement takes two.
            images: 2 * (variants.len() + comparisons.iter().map(|c| c.runs.len()).sum::<usize>()),
            variants,
            variant: studio.variant,
            comparisons,
        })
    }

    /// The least ratio of the materials that were compared.
    pub(crate) fn equal_error_ratio(&self) -> f64 {
        self.comparisons.iter().map(|c| c.equal.equal_error_ratio).fold(f64::INFINITY, f64::min)
    }
}

/// The variant that always works, and the one that needs LLVM.
const SLOW: &str = "scalar_rgb";
const FAST: &str = "llvm_ad_rgb";

/// The peer at work.
struct Studio<'a> {
    launch: &'a Launch,
    stage: &'a Stage,
    effort: &'a Effort,
    /// What its workers say.
    log: &'a Path,
    variant: &'static str,
}

/// A variant of the peer with the scene under its environment, and a material in its terms.
struct Worker {
    pool: Pool,
    model: &'static str,
    values: Json,
}

impl Worker {
    /// Renders a picture with some number of samples per pixel.
    fn render(&self, samples: u32, seed: u32) -> anyhow::Result<Picture> {
        let values = self.values.as_object().cloned().unwrap_or_default();
        let job = Job { scene: SCENE.into(), model: self.model.into(), values, samples, seed };
        Ok(self.pool.render(&[job]).swap_remove(0)?)
    }
}

/// The same function in the peer's terms.
fn native(material: &Material) -> (&'static str, Json) {
    let ours = material.to_json();
    let (alpha, white) = (&ours["roughness_u"], [1.0; 3]);
    match material.by_role(Role::DiffuseReflectance) {
        Some(_) => (
            "plastic",
            json!({
                "distribution": "ggx", "diffuse": ours["diffuse"], "ior": ours["ior"], "alpha": alpha, "specular": white,
            }),
        ),
        None => (
            "roughconductor",
            json!({
                "distribution": "ggx", "alpha": alpha, "eta": ours["eta"], "k": ours["k"], "specular_reflectance": white,
            }),
        ),
    }
}

/// The LLVM library that a log names.
fn llvm(log: &Path) -> Option<String> {
    let text = std::fs::read(log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).ok()?;
    text.lines().find_map(|line| Some(line.split_once(LLVM)?.1.to_owned()))
}

impl Studio<'_> {
    fn worker(&self, variant: &str, material: &Material) -> anyhow::Result<Worker> {
        let mut launch = self.launch.clone();
        launch.args.extend(["--variant", variant, "--sampler", SAMPLER].map(Into::into));
        let options = PoolOptions { log: Some(self.log.to_owned()), ..PoolOptions::default() };
        // Where the user ends the benchmark, its workers end with it.
        let pool = Pool::start(launch, options, Arc::new(|| false))?;
        pool.scene(SCENE, &self.stage.scene, Illumination::Environment, self.effort.size)?;
        let (model, values) = native(material);
        Ok(Worker { pool, model, values })
    }

    /// Times the variants; also the peer's version.
    fn variants(
        &self,
        material: &Material,
        progress: &ProgressBar,
    ) -> anyhow::Result<(Vec<Variant>, String)> {
        let time = |name| {
            let worker = self.worker(name, material)?;
            let Run { samples, cpu_s, .. } = self.run(&worker, self.effort.peer_samples[0])?.1;
            anyhow::Ok((Variant { name, samples, cpu_s }, worker.pool.hello().version.clone()))
        };
        let (slow, version) = time(SLOW)?;
        let mut variants = vec![slow];
        match time(FAST) {
            Ok((fast, _)) => variants.push(fast),
            // A library that is missing or cannot be used must not end the comparison.
            Err(error) => progress.suspend(|| {
                eprintln!("note: Mitsuba's {FAST}, which is several times faster, is left out: {error}");
            }),
        }
        Ok((variants, version))
    }

    fn compare(&self, Named { name, material }: Named) -> anyhow::Result<Comparison> {
        let worker = self.worker(self.variant, &material)?;
        let mut runs = Vec::new();
        for samples in self.effort.peer_samples {
            runs.push(self.run(&worker, samples)?.1);
        }
        let (converged, last) = self.run(&worker, self.effort.peer_converged)?;
        runs.push(last);
        let [bias, ours] = differences(self.stage, self.effort, &material, &converged)?;
        let cost = PictureCost::measure(self.stage, self.effort, &material)?;
        let equal = EqualError::new(&runs, &ours, &cost);
        // Products of independent errors have a mean of 0; that of so many pixels is off by their root.
        let bias_threshold = last.mean_delta_e / (self.effort.pixels as f64).powf(0.25);
        Ok(Comparison { name, material, runs, bias, bias_threshold, ours, cost, equal })
    }

    /// Two pictures that differ in their seeds, the lesser time, and their noise.
    fn run(&self, worker: &Worker, samples: u32) -> anyhow::Result<([Picture; 2], Run)> {
        let [a, b] = [worker.render(samples, 1)?, worker.render(samples, 2)?];
        let Picture { samples, cpu_s, wall_s, .. } = *if a.cpu_s < b.cpu_s { &a } else { &b };
        let (relative_rmse, mean_delta_e) = noise(&a.image, &b.image, self.stage.environment.subjects());
        Ok(([a, b], Run { samples, cpu_s, wall_s, relative_rmse, mean_delta_e }))
    }
}

/// The noise of one of two pictures with independent noise, which together have √2 times as much.
fn noise(a: &Image, b: &Image, pixels: &[u32]) -> (f64, f64) {
    let (mut squares, mut power, mut delta_e) = (0.0, 0.0, 0.0);
    for pixel in pixels {
        let [a, b] = [a, b].map(|image| image.pixels()[*pixel as usize].map(f64::from));
        squares += (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>() / 2.0;
        power += (0..3).map(|c| a[c] * b[c]).sum::<f64>();
        delta_e += delta_e76(lab_from_linear_srgb(a), lab_from_linear_srgb(b)) / 2f64.sqrt();
    }
    ((squares / power).sqrt(), delta_e / pixels.len() as f64)
}

/// The peer's converged pictures, and ours, against the path tracer's.
fn differences(
    stage: &Stage,
    effort: &Effort,
    material: &Material,
    peer: &[Picture; 2],
) -> anyhow::Result<[Difference; 2]> {
    let pixels = stage.pixels(effort.pixels);
    let light = Illumination::Environment;
    let truth = Truth::prepare(stage, light, effort.samples.saturating_mul(MORE_PATHS))?;
    let truth = truth.halves(material, &pixels);
    let peer = peer.each_ref().map(|p| pixels.iter().map(|k| p.image.pixels()[*k as usize]).collect());
    let ours = ours(stage.renderer(light), material, &pixels);
    Ok([Difference::between([&peer[0], &peer[1]], &truth), Difference::between([&ours, &ours], &truth)])
}

/// What the peer needs for our error.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct EqualError {
    /// The power of the number of samples that the peer's error follows between its last two runs.
    pub(crate) exponent: f64,
    /// Samples per pixel that give the peer our relative error: extrapolated where no run has as little.
    pub(crate) equal_error_samples: f64,
    /// CPU seconds that they take.
    pub(crate) equal_error_cpu_s: f64,
    /// That over our CPU time for a picture, as one of a batch.
    pub(crate) equal_error_ratio: f64,
    /// The same, but for a picture on its own.
    pub(crate) equal_error_ratio_single: f64,
    /// The ratio for a picture of a batch if the error went on with the measured exponent instead of −1/2.
    pub(crate) equal_error_ratio_measured_exponent: f64,
    /// The ratio for a picture of a batch where equal mean ΔE*76 is asked for, instead of equal relative error.
    pub(crate) equal_delta_e_ratio: f64,
}

impl EqualError {
    fn new(runs: &[Run], ours: &Difference, cost: &PictureCost) -> Self {
        let rmse = Law::new(runs, |run| run.relative_rmse);
        let delta_e = Law::new(runs, |run| run.mean_delta_e);
        // The run with the most samples has the least overhead.
        let cpu_s_per_sample = runs.last().map_or(f64::NAN, |run| run.cpu_s / f64::from(run.samples));
        let over = |samples: f64, milliseconds: f64| 1e3 * samples * cpu_s_per_sample / milliseconds;
        let exponent = rmse.exponent();
        let samples = rmse.samples(ours.relative_rmse, -0.5);
        Self {
            exponent,
            equal_error_samples: samples,
            equal_error_cpu_s: samples * cpu_s_per_sample,
            equal_error_ratio: over(samples, cost.image_cpu_ms),
            equal_error_ratio_single: over(samples, cost.single_image_cpu_ms),
            equal_error_ratio_measured_exponent: over(
                rmse.samples(ours.relative_rmse, exponent),
                cost.image_cpu_ms,
            ),
            equal_delta_e_ratio: over(delta_e.samples(ours.mean_delta_e, -0.5), cost.image_cpu_ms),
        }
    }
}

/// Error over the number of samples, a line between any two runs where both are logarithms.
struct Law(Vec<[f64; 2]>);

impl Law {
    fn new(runs: &[Run], error: impl Fn(&Run) -> f64) -> Self {
        Self(runs.iter().map(|run| [f64::from(run.samples).ln(), error(run).ln()]).collect())
    }

    /// The slope between the last two runs.
    fn exponent(&self) -> f64 {
        self.0.windows(2).last().map_or(f64::NAN, slope)
    }

    /// Samples for an error: between the runs by the line, beyond the last one by a power of their number.
    fn samples(&self, error: f64, exponent: f64) -> f64 {
        let within = self.0.windows(2).find(|pair| pair[1][1] <= error.ln());
        let beyond = || self.0.last().map(|last| (*last, exponent));
        let Some(([samples, known], exponent)) = within.map(|p| (p[1], slope(p))).or_else(beyond) else {
            return f64::NAN;
        };
        (samples + (error.ln() - known) / exponent).exp()
    }
}

fn slope(pair: &[[f64; 2]]) -> f64 {
    (pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_error_follows_the_square_root_of_the_samples() {
        let run = |samples: u32, relative_rmse| Run {
            samples,
            cpu_s: f64::from(samples) / 10.0,
            wall_s: 0.0,
            relative_rmse,
            mean_delta_e: 10.0 * relative_rmse,
        };
        let difference = Difference { relative_rmse: 0.01, mean_delta_e: 0.2, ..Difference::default() };
        let cost = PictureCost { image_cpu_ms: 2.0, single_image_cpu_ms: 4.0 };
        let equal = EqualError::new(&[run(64, 0.2), run(256, 0.1)], &difference, &cost);
        let is =
            |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-9, "{value} {expected}");
        is(equal.exponent, -0.5);
        is(equal.equal_error_samples, 25_600.0);
        is(equal.equal_error_cpu_s, 2_560.0);
        is(equal.equal_error_ratio, 1.28e6);
        is(equal.equal_error_ratio_single, 0.64e6);
        is(equal.equal_error_ratio_measured_exponent, 1.28e6);
        is(equal.equal_delta_e_ratio, 3.2e5);
    }

    #[test]
    fn errors_that_were_measured_are_not_extrapolated() {
        let law = Law([[16.0, 0.8], [64.0, 0.2], [256.0, 0.1]].map(|run: [f64; 2]| run.map(f64::ln)).into());
        assert!((law.exponent() + 0.5).abs() < 1e-12);
        for (error, samples) in [(0.4, 32.0), (0.1, 256.0), (0.01, 25_600.0), (1.6, 8.0)] {
            assert!((law.samples(error, -0.5) / samples - 1.0).abs() < 1e-9, "{error}");
        }
    }
}
