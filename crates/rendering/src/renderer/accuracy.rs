//! The prepared renderer against the path tracer: two ways to the same picture that share nothing but the scene.

use lookmatch_imaging::{delta_e76, lab_from_linear_srgb};

use super::*;
use crate::PathTracer;
use crate::lobes::SplitLobes;

/// Side of the pictures: the reference size, because what differs is the light within a pixel; few of the pixels are
/// evaluated.
const SIZE: usize = 300;
/// Share of the subject pixels that is evaluated.
const STEP: usize = 611;
/// Paths for each pixel. Their noise is part of what the tests accept.
const SAMPLES: u32 = 8192;

/// Some subject pixels, evenly spread, silhouettes among them.
fn some_pixels(renderer: &Renderer) -> Vec<u32> {
    let mut pixels = renderer.subjects.clone();
    pixels.sort();
    pixels.into_iter().step_by(STEP).collect()
}

/// A renderer of some of its subject pixels.
fn thinned(scene: &Scene, renderer: Renderer, pixels: &[u32]) -> Renderer {
    let Renderer { field, film, .. } = &renderer;
    let rows = Rows::new(field, film, pixels);
    let subjects: Vec<u32> = rows.main.iter().map(|row| row.pixel).collect();
    let light = |p: &u32| DiffuseLight::of_pixel(scene, field, film, renderer.bounce.as_ref(), *p as usize);
    let diffuse: Vec<DiffuseLight> = subjects.iter().map(light).collect();
    let highlights = Highlights::prepare(field, film, &subjects);
    Renderer { subjects, rows, returned: Returned::new(&diffuse), highlights, ..renderer }.keep_transport()
}

/// Prints and checks the mean ΔE*76 of materials, each with the most that is accepted.
fn check(scene: &Scene, illumination: Illumination, accepted: &[(&str, f64)]) {
    check_with(SAMPLES, scene, illumination, accepted);
}

/// [`check`] with a number of paths for each pixel.
fn check_with(samples: u32, scene: &Scene, illumination: Illumination, accepted: &[(&str, f64)]) {
    let renderer = Renderer::prepare(scene, illumination, SIZE).unwrap();
    let pixels = some_pixels(&renderer);
    let renderer = thinned(scene, renderer, &pixels);
    let tracer = PathTracer::prepare(scene, illumination, SIZE, samples, 1).unwrap();
    for (text, most) in accepted {
        let material = Material::parse(text).unwrap();
        let picture = renderer.render(&material, Part::Full);
        let truth = tracer.radiance(&material, Part::Full, &pixels);
        let mean = mean_delta_e(&picture, &pixels, &truth);
        println!("{} {illumination:?} {text}: mean ΔE {mean:.3}", scene.name);
        assert!(mean <= *most, "{text}: {mean}, accepted {most}");
    }
}

/// Mean ΔE*76 of some pixels of a picture.
fn mean_delta_e(picture: &Image, pixels: &[u32], truth: &[[f32; 3]]) -> f64 {
    let delta_e = |(pixel, truth): (&u32, &[f32; 3])| {
        let lab = |rgb: [f32; 3]| lab_from_linear_srgb(rgb.map(f64::from));
        delta_e76(lab(picture.pixels()[*pixel as usize]), lab(*truth))
    };
    pixels.iter().zip(truth).map(delta_e).sum::<f64>() / pixels.len() as f64
}

#[test]
fn environment() {
    let accepted = [
        ("lambert:diffuse=0.6/0.3/0.2", 0.2),
        ("ggx:roughness=0.01", 0.2),
        ("ward:specular=0.3,roughness=0.2", 0.2),
        ("ggx-conductor:eta=0.143/0.375/1.442,k=3.983/2.386/1.603,roughness=0.05", 0.25),
        ("ggx:roughness_u=0.05,roughness_v=0.3", 0.25),
    ];
    check(&Scene::reference(), Illumination::Environment, &accepted);
}

/// Every model as it is by default: those whose diffuse reflection is not Lambert's, too, which the rings must hold.
#[test]
fn every_model() {
    let names = lookmatch_materials::registry().iter().filter(|m| m.load.is_none()).map(|m| (m.name, 0.35));
    check_with(4096, &Scene::reference(), Illumination::Environment, &names.collect::<Vec<_>>());
}

#[test]
fn point_light() {
    let accepted = [
        ("lambert:diffuse=0.6/0.3/0.2", 0.06),
        ("ggx:roughness=0.01", 0.06),
        ("as:roughness=0.1", 0.08),
        ("ggx-conductor:roughness=0.3", 0.08),
    ];
    check(&Scene::reference(), Illumination::Point, &accepted);
}

/// Pixels that see nothing but the checkerboard, evenly spread.
fn board_pixels(renderer: &Renderer) -> Vec<u32> {
    let is_subject: std::collections::HashSet<&u32> = renderer.subjects.iter().collect();
    let board = renderer.board.iter().map(|(pixel, _)| *pixel).filter(|pixel| !is_subject.contains(pixel));
    board.step_by(STEP).collect()
}

#[test]
fn dressed_spheres() {
    let metals = [
        "eta=0.143/0.375/1.442,k=3.983/2.386/1.603",
        "eta=0.155/0.117/0.138,k=4.828/3.122/2.147",
        "eta=0.200/0.924/1.102,k=3.912/2.452/2.142",
    ];
    let material = |text: &str| Material::parse(text).unwrap();
    let scene = Scene::spheres().for_model(material("ggx-conductor").model());
    let renderer = Renderer::prepare(&scene, Illumination::All, SIZE).unwrap();
    let (pixels, board) = (some_pixels(&renderer), board_pixels(&renderer));
    let renderer = thinned(&scene, renderer, &pixels);
    // Few paths: what is compared has the same noise.
    let tracer = PathTracer::prepare(&scene, Illumination::All, SIZE, SAMPLES / 4, 1).unwrap();
    for roughness in [0.2, 0.05] {
        let materials = metals.map(|metal| material(&format!("ggx-conductor:{metal},roughness={roughness}")));
        let picture = renderer.render_dressed(&materials.each_ref(), Part::Full);
        let gold = renderer.render(&materials[0], Part::Full);
        for (place, pixels) in [("spheres", &pixels), ("board", &board)] {
            let truth = tracer.radiance_dressed(&materials, &|spot| spot.subject, Part::Full, pixels);
            let mean = mean_delta_e(&picture, pixels, &truth);
            // Highlights of one sphere in another are missing with one material, too: no more may be lost with three.
            let truth = tracer.radiance(&materials[0], Part::Full, pixels);
            let most = mean_delta_e(&gold, pixels, &truth);
            println!(
                "three metals of roughness {roughness}, {place}: mean ΔE {mean:.3}, gold alone {most:.3}"
            );
            assert!(mean <= 1.1 * most, "{roughness} {place}: {mean}, accepted {most}");
        }
    }
}

#[test]
fn narrow_lobes_do_not_ring_about_lamps() {
    // What a ringing basis subtracts beside the lamps of a map is seen as black.
    let renderer = Renderer::prepare(&Scene::spheres(), Illumination::Environment, 64).unwrap();
    let metal = Material::parse("beckmann-conductor:roughness=0.02").unwrap();
    let pictures = renderer.split_planes(&SplitLobes::new(&[metal]));
    let least = pictures.specular.into_iter().flatten().flatten().fold(0.0, f32::min);
    assert!(least > -1e-3, "{least}");
}
