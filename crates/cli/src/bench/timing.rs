//! CPU time of pictures and of their comparison, on one thread.

use std::hint::black_box;

use anyhow::Context;
use cpu_time::ThreadTime;
use lookmatch_imaging::{FitnessWeights, lab_planes, squared_distance};
use lookmatch_materials::Material;
use lookmatch_rendering::{Lobes, Part, Renderer};
use serde::Serialize;

use super::materials::{batch, of_all_widths};
use super::{Effort, Stage};
use crate::output::spinner;

/// CPU milliseconds, one thread, the fastest of several runs.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Timing {
    /// A picture pair (point light and environment) of a new material, as one of a batch.
    pub(crate) image_pair_cpu_ms: f64,
    /// The same for a material on its own.
    pub(crate) single_pair_cpu_ms: f64,
    /// Equation 3 over four pairs of pictures, CIELAB of both sides included.
    pub(crate) metric_ms: f64,
    /// The same with the CIELAB of one side given.
    pub(crate) metric_cached_ms: f64,
}

/// CPU milliseconds of one picture, one thread, the fastest of several runs.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct PictureCost {
    /// As one of a batch.
    pub(crate) image_cpu_ms: f64,
    /// On its own.
    pub(crate) single_image_cpu_ms: f64,
}

impl Timing {
    /// Times pictures and comparisons.
    pub(crate) fn measure(stage: &Stage, effort: &Effort) -> anyhow::Result<Self> {
        let progress = spinner("timing pictures and comparisons");
        let batches = (0..effort.runs).map(|run| batch(effort.batch, run)).collect::<Result<Vec<_>, _>>()?;
        let pair = on_one_thread(|| cost(&[&stage.point, &stage.environment], &batches))?;
        let (source, target) = (views(stage, &batches[0][0]), views(stage, &batches[0][1]));
        let [metric_ms, metric_cached_ms] = on_one_thread(|| metric(&source, &target, effort.runs))?;
        progress.finish_and_clear();
        let PictureCost { image_cpu_ms: image_pair_cpu_ms, single_image_cpu_ms: single_pair_cpu_ms } = pair;
        Ok(Self { image_pair_cpu_ms, single_pair_cpu_ms, metric_ms, metric_cached_ms })
    }
}

impl PictureCost {
    /// Times pictures under the environment of materials like a given one.
    pub(crate) fn measure(stage: &Stage, effort: &Effort, material: &Material) -> anyhow::Result<Self> {
        let batch = of_all_widths(material, effort.batch)?;
        on_one_thread(|| cost(&[&stage.environment], &vec![batch; effort.runs]))
    }
}

/// CPU milliseconds of a picture pair of each of some materials, as one of a batch: the fastest of some runs.
pub(crate) fn pair_cpu_ms(stage: &Stage, batch: &[Material], runs: usize) -> anyhow::Result<f64> {
    let batches = vec![batch.to_vec(); runs];
    on_one_thread(|| each_in_batch(&[&stage.point, &stage.environment], &batches))
}

/// Works in a pool of one thread: its clock then counts all the work, and nothing but the work.
fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> anyhow::Result<T> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().context("cannot start a thread")?;
    Ok(pool.install(work))
}

/// The cost per material of pictures by all of some renderers; each run has a batch.
fn cost(renderers: &[&Renderer], batches: &[Vec<Material>]) -> PictureCost {
    let singles = |run: usize| batches[run].chunks(1).for_each(|material| render(renderers, material));
    PictureCost {
        image_cpu_ms: each_in_batch(renderers, batches),
        single_image_cpu_ms: fastest(batches.len(), singles) / batches[0].len() as f64,
    }
}

fn each_in_batch(renderers: &[&Renderer], batches: &[Vec<Material>]) -> f64 {
    fastest(batches.len(), |run| render(renderers, &batches[run])) / batches[0].len() as f64
}

/// From materials to everything that the subject's pixels hold, linear RGB.
fn render(renderers: &[&Renderer], materials: &[Material]) {
    let lobes = Lobes::new(materials.iter().map(Material::bsdf).collect());
    renderers.iter().for_each(|renderer| drop(black_box(renderer.subject_planes(&lobes))));
}

/// CPU milliseconds of the fastest of some runs, which are told their number.
fn fastest(runs: usize, mut work: impl FnMut(usize)) -> f64 {
    let milliseconds = (0..runs).map(|run| {
        let start = ThreadTime::now();
        work(run);
        1e3 * start.elapsed().as_secs_f64()
    });
    milliseconds.fold(f64::INFINITY, f64::min)
}

/// Diffuse and specular pictures under both lights, in the order of [`equation_3`]'s terms.
type Views = [Vec<[f32; 3]>; 4];

fn views(stage: &Stage, material: &Material) -> Views {
    let [point, environment] = [&stage.point, &stage.environment].map(|renderer| {
        let diffuse = renderer.render(material, Part::DiffuseOnly);
        let specular = renderer.render(material, Part::Full).zipped(&diffuse, |full, diffuse| full - diffuse);
        [diffuse, specular].map(|image| image.pixels().to_vec())
    });
    let ([diffuse_point, specular_point], [diffuse_environment, specular_environment]) = (point, environment);
    [diffuse_point, diffuse_environment, specular_point, specular_environment]
}

/// The fast path of equation 3 (Guarnera *et al.* 2018) from CIELAB planes: CIELAB, root mean square, no mask.
fn equation_3(a: &[Vec<f32>; 4], b: &[Vec<f32>; 4]) -> f64 {
    let w = FitnessWeights::default();
    let weights = [
        w.diffuse * w.diffuse_point,
        w.diffuse * w.diffuse_environment,
        w.specular * w.specular_point,
        w.specular * w.specular_environment,
    ];
    let rms = |a: &[f32], b: &[f32]| (squared_distance(a, b) / (a.len() / 3) as f64).sqrt();
    (0..4).map(|k| weights[k] * rms(&a[k], &b[k])).sum()
}

fn to_lab(views: &Views, planes: &mut [Vec<f32>; 4]) {
    views.iter().zip(planes).for_each(|(pixels, planes)| lab_planes(pixels, planes));
}

/// Milliseconds of equation 3 with the CIELAB of both sides, and of one.
fn metric(source: &Views, target: &Views, runs: usize) -> [f64; 2] {
    let empty = || source.each_ref().map(|view| vec![0.0; 3 * view.len()]);
    let (mut a, mut b) = (empty(), empty());
    // Runs of a millisecond are cheap, and the more there are, the less other load matters.
    let runs = 10 * runs;
    let whole = fastest(runs, |_| {
        to_lab(black_box(source), &mut a);
        to_lab(black_box(target), &mut b);
        black_box(equation_3(&a, &b));
    });
    let cached = fastest(runs, |_| {
        to_lab(black_box(target), &mut b);
        black_box(equation_3(black_box(&a), &b));
    });
    [whole, cached]
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookmatch_imaging::{Fitness, ProbePixels};
    use lookmatch_rendering::Scene;

    /// What is timed is the metric as it is written.
    #[test]
    fn the_timed_metric_is_equation_3() {
        let (stage, _) = Stage::prepare(&Scene::reference(), 24).unwrap();
        let materials = batch(4, 0).unwrap();
        let (a, b) = (views(&stage, &materials[0]), views(&stage, &materials[1]));
        let exact = |views: &Views| {
            let [diffuse_point, diffuse_environment, mut full_point, mut full_environment] =
                views.each_ref().map(|v| v.iter().map(|p| p.map(f64::from)).collect::<Vec<_>>());
            let add = |full: &mut Vec<[f64; 3]>, diffuse: &Vec<[f64; 3]>| {
                full.iter_mut().zip(diffuse).for_each(|(f, d)| (0..3).for_each(|c| f[c] += d[c]));
            };
            add(&mut full_point, &diffuse_point);
            add(&mut full_environment, &diffuse_environment);
            ProbePixels { diffuse_point, diffuse_environment, full_point, full_environment }
        };
        let exact = Fitness::default().evaluate_pixels(&exact(&a), &exact(&b), None).unwrap();
        let planes = |views: &Views| {
            let mut planes = views.each_ref().map(|view| vec![0.0; 3 * view.len()]);
            to_lab(views, &mut planes);
            planes
        };
        let fast = equation_3(&planes(&a), &planes(&b));
        assert!((fast - exact).abs() < 1e-4 * exact, "{fast} {exact}");
    }
}
