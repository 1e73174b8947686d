//! Noise and speed of the path tracer: `cargo bench -p lookmatch-rendering --bench paths [-- MAX_SAMPLES]`.
//!
//! Noise is the mean ΔE*76 between two seeds over some 100 sphere pixels of the 300-pixel reference scene; the last column is
//! their mean difference from the precomputed renderer, which lacks part of the light. M/s are million camera samples, four paths each, per second.

use std::time::Instant;

use lookmatch_imaging::{delta_e76, lab_from_linear_srgb};
use lookmatch_materials::Material;
use lookmatch_rendering::{Illumination, Part, PathTracer, Renderer, Scene};

const SIZE: usize = 300;
/// Every so many of the subject pixels are rendered.
const STEP: usize = 307;
const MATERIALS: [&str; 6] = [
    "ggx:roughness=0.01",
    "ggx:roughness=0.1",
    "ggx-conductor:roughness=0.01",
    "ggx-conductor:roughness=0.1",
    "ggx-conductor:roughness=0.3",
    "ggx-conductor:roughness=0.8",
];

fn mean_difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> (f64, f64) {
    let lab = |p: &[f32; 3]| lab_from_linear_srgb(p.map(f64::from));
    let differences = a.iter().zip(b).map(|(a, b)| delta_e76(lab(a), lab(b)));
    (differences.clone().sum::<f64>() / a.len() as f64, differences.fold(0.0, f64::max))
}

fn main() {
    let most = std::env::args().filter_map(|a| a.parse().ok()).next().unwrap_or(4096);
    for illumination in [Illumination::Environment, Illumination::Point] {
        for text in MATERIALS {
            let material = Material::parse(text).expect("a material");
            let scene = Scene::reference().for_model(material.model());
            let precomputed = Renderer::prepare(&scene, illumination, SIZE).expect("a built-in scene");
            let pixels: Vec<u32> = precomputed.subjects().iter().copied().step_by(STEP).collect();
            let picture = precomputed.render(&material, Part::Full);
            let expected: Vec<[f32; 3]> = pixels.iter().map(|p| picture.pixels()[*p as usize]).collect();
            for samples in [256, 1024, 4096, 16384].into_iter().filter(|n| *n <= most) {
                let prepare = |seed| PathTracer::prepare(&scene, illumination, SIZE, samples, seed);
                let tracers = [1, 2].map(|seed| prepare(seed).expect("a built-in scene"));
                let start = Instant::now();
                let [a, b] = tracers.map(|t| t.radiance(&material, Part::Full, &pixels));
                let seconds = start.elapsed().as_secs_f64();
                let (noise, worst) = mean_difference(&a, &b);
                let (bias, largest) = mean_difference(&a, &expected);
                let rate = 2.0 * f64::from(samples) * pixels.len() as f64 / seconds / 1e6;
                print!("{:<40} {samples:>6} spp: ", format!("{illumination:?} {text}"));
                println!(
                    "noise {noise:.3}, at most {worst:.2}; to the precomputed {bias:.3}, at most {largest:.1}; {rate:.2} M/s"
                );
            }
        }
    }
}
