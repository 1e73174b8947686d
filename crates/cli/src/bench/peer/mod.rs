//! Another renderer beside ours, at equal error: Mitsuba 3, path tracing the same scene with the same material.
//!
//! A path tracer's error falls with the square root of its samples, and as many as would reach our error take hours. So the
//! peer is timed at several numbers of samples, and its time for our error is extrapolated with that law. Stratified
//! samples do better while they are few; what the exponent measured between the last two runs would give, if it lasted
//! for ever, is reported too, as the least that can be said. Of the peer's error only its noise is counted, as seen between
//! two pictures; of ours all that separates it from converged pictures, their noise included.

mod installation;
mod worker;

use lookmatch_imaging::{Image, delta_e76, lab_from_linear_srgb};
use lookmatch_materials::Material;
use lookmatch_rendering::Illumination;
use serde::Serialize;

pub(crate) use installation::Installation;

use super::accuracy::{Difference, Truth, ours};
use super::materials::{self, Named};
use super::{Effort, Stage, Timing};
use crate::output::spinner;
use worker::{Cost, Picture, SAMPLER, Worker};

/// Width of the metal's lobe.
const ROUGHNESS: f64 = 0.1;
/// Our error is a single material's here, so that many more paths per pixel can be paid for.
const MORE_PATHS: u32 = 8;

/// The peer's speed and error beside ours, for a gold-like metal under the environment.
#[derive(Debug, Serialize)]
pub(crate) struct PeerReport {
    pub(crate) name: &'static str,
    pub(crate) version: String,
    pub(crate) sampler: &'static str,
    /// The LLVM library that the peer compiles with.
    pub(crate) llvm: Option<String>,
    pub(crate) material_name: String,
    pub(crate) material: Material,
    /// The variants that were tried, all with the same number of samples.
    pub(crate) variants: Vec<Variant>,
    /// The fastest of them, which all other figures belong to.
    pub(crate) variant: &'static str,
    /// In ascending order of samples.
    pub(crate) runs: Vec<Run>,
    /// The power of the number of samples that the peer's error follows between its last two runs.
    pub(crate) exponent: f64,
    /// The peer's two best pictures against the converged ones.
    pub(crate) bias: Difference,
    /// Root mean square ΔE*76 of a bias that noise alone could pretend.
    pub(crate) bias_threshold: f64,
    /// Our picture against the converged ones.
    pub(crate) ours: Difference,
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
    /// Pictures that the peer rendered, warming up included.
    pub(crate) images: usize,
}

/// A variant of the peer.
#[derive(Debug, Serialize)]
pub(crate) struct Variant {
    pub(crate) name: &'static str,
    pub(crate) samples: u32,
    /// CPU seconds of all threads, after a first picture that does not count.
    pub(crate) cpu_s: f64,
}

/// Pictures with some number of samples.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Run {
    /// Samples per pixel.
    pub(crate) samples: u32,
    /// CPU seconds of all threads for one picture, compilation left out.
    pub(crate) cpu_s: f64,
    pub(crate) wall_s: f64,
    /// Root mean square of the noise over that of the values, on the subject's pixels.
    pub(crate) relative_rmse: f64,
    /// Mean ΔE*76 of the noise.
    pub(crate) mean_delta_e: f64,
}

impl PeerReport {
    /// Measures the peer and our error for the same picture.
    pub(crate) fn measure(
        installation: &Installation,
        stage: &Stage,
        effort: &Effort,
        timing: &Timing,
    ) -> anyhow::Result<Self> {
        let Named { name: material_name, material } = materials::gold(ROUGHNESS)?;
        let progress = spinner("");
        let mut studio = Studio { worker: None, images: 0, stage };
        let names: &[&str] =
            if installation.llvm.is_some() { &["scalar_rgb", "llvm_ad_rgb"] } else { &["scalar_rgb"] };
        let mut variants = Vec::new();
        for name in names.iter().copied() {
            progress.set_message(format!("Mitsuba: timing {name}"));
            match studio.variant(installation, name, effort, &material) {
                Ok(variant) => variants.push(variant),
                // A library that cannot be used must not end the comparison.
                Err(error) if !variants.is_empty() => {
                    eprintln!("note: Mitsuba's {name} is left out: {error}")
                }
                Err(error) => return Err(error),
            }
        }
        let best = variants.iter().min_by(|a, b| a.cpu_s.total_cmp(&b.cpu_s)).map_or(names[0], |v| v.name);
        progress.set_message("Mitsuba: rendering");
        studio.start(installation, best, effort, &material)?;
        let [few, some, many] = effort.peer_samples;
        let mut runs = vec![studio.run(few)?, studio.run(some)?, studio.run(many)?];
        let converged = studio.pair(effort.peer_converged)?;
        runs.push(studio.measured(&converged));
        progress.set_message("tracing paths");
        let [bias, ours] = differences(stage, effort, &material, &converged)?;
        progress.finish_and_clear();
        let equal = Equal::new(&runs, &ours, timing);
        Ok(Self {
            name: "Mitsuba 3",
            version: studio.worker.map(|w| w.version.clone()).unwrap_or_default(),
            sampler: SAMPLER,
            llvm: installation.llvm.as_ref().map(|path| path.display().to_string()),
            material_name,
            material,
            variants,
            variant: best,
            exponent: equal.exponent,
            // Products of independent errors have a mean of 0; that of so many pixels is off by their root.
            bias_threshold: runs.last().map_or(f64::NAN, |r| r.mean_delta_e)
                / (effort.pixels as f64).powf(0.25),
            runs,
            bias,
            ours,
            equal_error_samples: equal.samples,
            equal_error_cpu_s: equal.cpu_s,
            equal_error_ratio: equal.ratio,
            equal_error_ratio_single: equal.ratio_single,
            equal_error_ratio_measured_exponent: equal.ratio_measured_exponent,
            equal_delta_e_ratio: equal.delta_e_ratio,
            images: studio.images,
        })
    }
}

/// The peer at work.
struct Studio<'a> {
    worker: Option<Worker>,
    images: usize,
    stage: &'a Stage,
}

impl Studio<'_> {
    fn start(
        &mut self,
        installation: &Installation,
        variant: &'static str,
        effort: &Effort,
        material: &Material,
    ) -> anyhow::Result<()> {
        let scene = (&self.stage.scene, effort.size);
        self.worker = Some(Worker::start(installation, variant, scene, material)?);
        Ok(())
    }

    fn render(&mut self, samples: u32, seed: u32) -> anyhow::Result<Picture> {
        self.images += 1;
        let worker = self.worker.as_mut().ok_or_else(|| anyhow::anyhow!("the peer was not started"))?;
        worker.render(samples, seed)
    }

    /// Times a variant.
    fn variant(
        &mut self,
        installation: &Installation,
        name: &'static str,
        effort: &Effort,
        material: &Material,
    ) -> anyhow::Result<Variant> {
        self.start(installation, name, effort, material)?;
        let Run { samples, cpu_s, .. } = self.run(effort.peer_samples[0])?;
        Ok(Variant { name, samples, cpu_s })
    }

    /// Two pictures that differ in their seeds.
    fn pair(&mut self, samples: u32) -> anyhow::Result<[Picture; 2]> {
        Ok([self.render(samples, 1)?, self.render(samples, 2)?])
    }

    /// Time and noise at some number of samples. A first picture, which may have to be compiled, does not count.
    fn run(&mut self, samples: u32) -> anyhow::Result<Run> {
        self.render(samples, 0)?;
        let pair = self.pair(samples)?;
        Ok(self.measured(&pair))
    }

    /// The lesser time and the noise of two pictures.
    fn measured(&self, [a, b]: &[Picture; 2]) -> Run {
        let Cost { samples, cpu_s, wall_s } = if a.cost.cpu_s < b.cost.cpu_s { a.cost } else { b.cost };
        let (relative_rmse, mean_delta_e) = noise(&a.image, &b.image, self.stage.environment.subjects());
        Run { samples, cpu_s, wall_s, relative_rmse, mean_delta_e }
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
struct Equal {
    exponent: f64,
    samples: f64,
    cpu_s: f64,
    ratio: f64,
    ratio_single: f64,
    ratio_measured_exponent: f64,
    delta_e_ratio: f64,
}

impl Equal {
    fn new(runs: &[Run], ours: &Difference, timing: &Timing) -> Self {
        let rmse = Law::new(runs, |run| run.relative_rmse);
        let delta_e = Law::new(runs, |run| run.mean_delta_e);
        // The run with the most samples has the least overhead.
        let cpu_s_per_sample = runs.last().map_or(f64::NAN, |run| run.cpu_s / f64::from(run.samples));
        let in_batch = timing.environment_image_cpu_ms;
        let over = |samples: f64, milliseconds: f64| 1e3 * samples * cpu_s_per_sample / milliseconds;
        let samples = rmse.samples(ours.relative_rmse, -0.5);
        Self {
            exponent: rmse.exponent(),
            samples,
            cpu_s: samples * cpu_s_per_sample,
            ratio: over(samples, in_batch),
            ratio_single: over(samples, timing.environment_single_cpu_ms),
            ratio_measured_exponent: over(rmse.samples(ours.relative_rmse, rmse.exponent()), in_batch),
            delta_e_ratio: over(delta_e.samples(ours.mean_delta_e, -0.5), in_batch),
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
        let timing =
            Timing { environment_image_cpu_ms: 2.0, environment_single_cpu_ms: 4.0, ..Timing::default() };
        let equal = Equal::new(&[run(64, 0.2), run(256, 0.1)], &difference, &timing);
        assert!((equal.exponent + 0.5).abs() < 1e-12);
        assert!((equal.samples / 25_600.0 - 1.0).abs() < 1e-9);
        assert!((equal.cpu_s / 2_560.0 - 1.0).abs() < 1e-9);
        assert!(
            (equal.ratio / 1.28e6 - 1.0).abs() < 1e-9 && (equal.ratio_single / 0.64e6 - 1.0).abs() < 1e-9
        );
        assert!((equal.ratio_measured_exponent / equal.ratio - 1.0).abs() < 1e-9);
        assert!((equal.delta_e_ratio / 3.2e5 - 1.0).abs() < 1e-9);
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
