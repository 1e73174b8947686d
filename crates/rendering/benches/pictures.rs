//! What preparing a scene and rendering a picture of it cost: `cargo bench -p lookmatch-rendering`, one thread.
//!
//! The floor is a copy of the bytes of the prepared light, which every picture must read once.

use std::time::Instant;

use lookmatch_materials::Material;
use lookmatch_rendering::{Illumination, Lobes, Renderer, Scene};

const BATCH: usize = 64;

/// Seconds of the fastest of some runs.
fn fastest(runs: usize, mut work: impl FnMut()) -> f64 {
    let seconds = (0..runs).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    seconds.fold(f64::INFINITY, f64::min)
}

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("one thread");
    let material = |k: usize| {
        let roughness = 0.05 + 0.01 * k as f64;
        Material::parse(&format!("ggx:ior=1.5,roughness={roughness}")).expect("a material")
    };
    let materials: Vec<Material> = (0..BATCH).map(material).collect();
    let brushed = [Material::parse("ggx:roughness_u=0.05,roughness_v=0.3").expect("a material")];
    println!(
        "{:<24}{:>12}{:>12}{:>14}{:>18}{:>12}",
        "300 x 300 px", "prepare s", "single ms", "batch of 64 ms", "anisotropic ms", "floor ms"
    );
    let scenes = [
        (Scene::reference(), Illumination::Point),
        (Scene::reference(), Illumination::Environment),
        (Scene::spheres(), Illumination::All),
    ];
    for (scene, light) in scenes {
        let start = Instant::now();
        let renderer = Renderer::prepare(&scene, light, 300).expect("a built-in scene").keep_transport();
        let prepare = start.elapsed().as_secs_f64();
        let render = |materials: &[Material]| {
            let lobes = Lobes::new(materials.iter().map(Material::bsdf).collect());
            drop(renderer.subject_planes(&lobes));
        };
        let single = fastest(5, || render(&materials[..1]));
        let batch = fastest(3, || render(&materials)) / BATCH as f64;
        let anisotropic = fastest(1, || render(&brushed));
        let rows = vec![1.0f32; renderer.subjects().len() * 216];
        let floor = fastest(5, || drop(std::hint::black_box(rows.clone())));
        println!(
            "{:<24}{prepare:>12.1}{:>12.2}{:>14.2}{:>18.0}{:>12.2}",
            format!("{} {light:?}", scene.name),
            1e3 * single,
            1e3 * batch,
            1e3 * anisotropic,
            1e3 * floor
        );
    }
}
