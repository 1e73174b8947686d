//! The ring transport against the direct integral: two ways to the same picture that share nothing but the light.

use lookmatch_imaging::{delta_e76, lab_from_linear_srgb};

use super::*;

/// Side of the pictures. Large, because what differs is the light within a pixel; few of the pixels are evaluated.
const SIZE: usize = 200;
/// Share of the subject pixels that is evaluated.
const STEP: usize = 61;
/// Samples of the direct integral.
const SAMPLES: u32 = 8192;

/// Over the subject pixels: mean and maximum of ΔE*76, and the root of the mean squared difference over that of the mean
/// squared value in percent.
type Distance = [f64; 3];

fn distance(renderer: &Renderer, material: &Material, a: &[[f32; 3]], b: &[[f32; 3]]) -> Distance {
    let diffuse = renderer.diffuse_pixels(material);
    let (mut sum, mut max, mut squares, mut power) = (0.0, 0.0f64, 0.0, 0.0);
    for ((a, b), diffuse) in a.iter().zip(b).zip(&diffuse) {
        let total = |s: &[f32; 3]| -> [f64; 3] { std::array::from_fn(|c| f64::from(s[c] + diffuse[c])) };
        let (a, b) = (total(a), total(b));
        let delta_e = delta_e76(lab_from_linear_srgb(a), lab_from_linear_srgb(b));
        sum += delta_e;
        max = max.max(delta_e);
        squares += (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
        power += b.iter().map(|b| b * b).sum::<f64>();
    }
    [sum / diffuse.len() as f64, max, 100.0 * (squares / power).sqrt()]
}

/// A renderer with a share of its subject pixels.
fn thinned(scene: &Scene, illumination: Illumination) -> Renderer {
    let renderer = Renderer::prepare(scene, illumination, SIZE).unwrap();
    let Renderer { field, film, .. } = &renderer;
    let mut pixels = renderer.subjects.clone();
    pixels.sort();
    let rows = Rows::new(field, film, &pixels.into_iter().step_by(STEP).collect::<Vec<_>>());
    let subjects: Vec<u32> = rows.main.iter().map(|row| row.pixel).collect();
    let diffuse = subjects
        .iter()
        .map(|p| diffuse_light(scene, field, film, renderer.bounce.as_ref(), *p as usize))
        .collect();
    let highlights = Highlights::prepare(field, film, &subjects);
    Renderer { subjects, rows, diffuse, highlights, ..renderer }.keep_transport()
}

/// Prints and checks the distances of materials, each with the most that is accepted.
fn check(scene: &Scene, illumination: Illumination, accepted: &[(&str, Distance)]) {
    let renderer = thinned(scene, illumination);
    for (text, most) in accepted {
        let material = Material::parse(text).unwrap();
        let bsdf = material.bsdf();
        let (rings, direct) = (renderer.specular_pixels(&*bsdf), renderer.gathered_pixels(&*bsdf, SAMPLES));
        let found = distance(&renderer, &material, &rings, &direct);
        let [mean, max, rms] = found;
        println!("{} {illumination:?} {text}: ΔE mean {mean:.3}, max {max:.2}, rms {rms:.3} %", scene.name);
        assert!(found.iter().zip(most).all(|(f, m)| f <= m), "{text}: {found:?}, accepted {most:?}");
    }
}

#[test]
fn environment() {
    let accepted = [
        ("ggx:roughness=0.01", [0.08, 3.0, 0.5]),
        ("ggx:roughness=0.05", [0.07, 1.5, 0.3]),
        ("ggx:roughness=0.2", [0.08, 0.8, 0.25]),
        ("ggx:roughness=0.5", [0.07, 0.4, 0.15]),
        ("beckmann:roughness=0.1", [0.08, 2.5, 0.3]),
        ("ward:roughness=0.1", [0.07, 0.7, 0.2]),
        ("as:roughness=0.1", [0.45, 5.5, 0.8]),
        ("ggx-conductor:roughness=0.02", [0.55, 6.0, 0.9]),
        ("ggx-conductor:roughness=0.2", [0.5, 3.5, 0.9]),
    ];
    check(&Scene::reference(), Illumination::Environment, &accepted);
}

#[test]
fn point_light() {
    let accepted = [
        ("ggx:roughness=0.01", [0.01, 0.3, 0.03]),
        ("ggx:roughness=0.2", [0.01, 0.1, 0.05]),
        ("ward:roughness=0.1", [0.01, 0.1, 0.03]),
        ("ggx-conductor:roughness=0.1", [0.08, 0.6, 0.05]),
    ];
    check(&Scene::reference(), Illumination::Point, &accepted);
}

#[test]
fn lamps() {
    let accepted = [
        ("ggx:roughness=0.05", [0.04, 1.0, 0.2]),
        ("beckmann-conductor:roughness=0.02", [0.2, 3.0, 1.0]),
        ("ggx-conductor:roughness=0.1", [0.22, 1.6, 0.4]),
    ];
    check(&Scene::spheres(), Illumination::Environment, &accepted);
    // A narrow lobe must not ring about the lamps of the map: what it subtracts beside them is seen as black.
    let renderer = Renderer::prepare(&Scene::spheres(), Illumination::Environment, 64).unwrap();
    let bsdf = Material::parse("beckmann-conductor:roughness=0.02").unwrap().bsdf();
    let least = renderer.specular_pixels(&*bsdf).into_iter().flatten().fold(0.0, f32::min);
    assert!(least > -1e-3, "{least}");
}

#[test]
fn shipped_samples_of_anisotropic_lobes_suffice() {
    let renderer = thinned(&Scene::reference(), Illumination::Environment);
    for (text, most) in [
        ("ggx:roughness_u=0.05,roughness_v=0.3", [0.12, 1.1, 0.3]),
        ("ward:roughness_u=0.3,roughness_v=0.1", [0.13, 1.0, 0.3]),
    ] {
        let material = Material::parse(text).unwrap();
        let bsdf = material.bsdf();
        let (few, many) = (renderer.specular_pixels(&*bsdf), renderer.gathered_pixels(&*bsdf, 2 * SAMPLES));
        let found = distance(&renderer, &material, &few, &many);
        println!("{text}: {found:.3?}");
        assert!(found.iter().zip(most).all(|(f, m)| *f <= m), "{text}: {found:?}, accepted {most:?}");
    }
}

#[test]
fn dump() {
    let Ok(path) = std::env::var("DUMP") else { return };
    let renderer = thinned(&Scene::reference(), Illumination::Environment);
    let mut order: Vec<usize> = (0..renderer.subjects.len()).collect();
    order.sort_by_key(|k| renderer.subjects[*k]);
    let mut out = Vec::new();
    for text in MATS {
        let material = Material::parse(text).unwrap();
        let s = renderer.specular_pixels(&*material.bsdf());
        let d = renderer.diffuse_pixels(&material);
        for k in &order {
            for c in 0..3 {
                out.extend((s[*k][c] + d[*k][c]).to_le_bytes());
            }
        }
    }
    std::fs::write(path, out).unwrap();
}
const MATS: [&str; 9] = [
    "ggx:roughness=0.01",
    "ggx:roughness=0.05",
    "ggx:roughness=0.5",
    "ward:roughness=0.1",
    "as:roughness=0.1",
    "ggx-conductor:roughness=0.01",
    "ggx-conductor:roughness=0.05",
    "ggx-conductor:roughness=0.2",
    "ggx-conductor:roughness=0.6",
];

#[test]
fn truth() {
    let Ok(light) = std::env::var("TRUTH") else { return };
    let light = if light == "p" { Illumination::Point } else { Illumination::Environment };
    let renderer = Renderer::prepare(&Scene::reference(), light, 300).unwrap();
    let mut pixels = renderer.subjects.clone();
    pixels.sort();
    let pixels: Vec<u32> = pixels.into_iter().step_by(211).collect();
    let samples: u32 = std::env::var("SPP").unwrap().parse().unwrap();
    let tracer = crate::PathTracer::prepare(&Scene::reference(), light, 300, samples, 1).unwrap();
    for text in TRUE {
        let material = Material::parse(text).unwrap();
        let start = std::time::Instant::now();
        let truth = tracer.radiance(&material, Part::Full, &pixels);
        let name = format!("/tmp/truth_{light:?}_{}", text.replace(['/', ':', '='], "_"));
        let bytes: Vec<u8> = truth.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        std::fs::write(name, bytes).unwrap();
        println!("{text} {:.1}", start.elapsed().as_secs_f64());
    }
}

#[test]
fn against_truth() {
    if std::env::var("AGAINST").is_err() {
        return;
    }
    for light in [Illumination::Environment, Illumination::Point] {
        let renderer = Renderer::prepare(&Scene::reference(), light, 300).unwrap();
        let Renderer { field, film, .. } = &renderer;
        let mut pixels = renderer.subjects.clone();
        pixels.sort();
        let pixels: Vec<u32> = pixels.into_iter().step_by(211).collect();
        let start = std::time::Instant::now();
        let bounce = Bounce::prepare(&Scene::reference(), field);
        println!("bounce {:.1} s", start.elapsed().as_secs_f64());
        let rows = Rows::new(field, film, &pixels);
        let subjects: Vec<u32> = rows.main.iter().map(|row| row.pixel).collect();
        let diffuse = subjects
            .iter()
            .map(|p| diffuse_light(&Scene::reference(), field, film, bounce.as_ref(), *p as usize))
            .collect();
        let highlights = Highlights::prepare(field, film, &subjects);
        let renderer = Renderer { subjects, rows, diffuse, highlights, bounce, ..renderer }.keep_transport();
        for text in TRUE {
            let material = Material::parse(text).unwrap();
            let name = format!("/tmp/truth_{light:?}_{}", text.replace(['/', ':', '='], "_"));
            let Ok(bytes) = std::fs::read(name) else { continue };
            let truth: Vec<f32> =
                bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
            let image = renderer.render(&material, Part::Full);
            let (mut sum, mut max, mut worst) = (0.0, 0.0f64, 0);
            let mut bins = [[0.0; 2]; 6];
            for (pixel, t) in pixels.iter().zip(truth.chunks(3)) {
                let a = image.pixels()[*pixel as usize].map(f64::from);
                let d = delta_e76(
                    lab_from_linear_srgb(a),
                    lab_from_linear_srgb([t[0] as f64, t[1] as f64, t[2] as f64]),
                );
                sum += d;
                let k = renderer.subjects.iter().position(|s| s == pixel).unwrap();
                let bin = if renderer.diffuse[k].white_share < 1.0 {
                    5
                } else {
                    ((pixel / 300) as usize).saturating_sub(40) / 40
                };
                bins[bin.min(5)][0] += d;
                bins[bin.min(5)][1] += 1.0;
                if d > max {
                    max = d;
                    worst = *pixel;
                }
                let _ = k;
            }
            let bins: Vec<String> = bins.iter().map(|b| format!("{:.2}", b[0] / b[1])).collect();
            println!(
                "{light:?} {text}: mean {:.3} max {max:.2} at {},{} by rows {bins:?}",
                sum / pixels.len() as f64,
                worst % 300,
                worst / 300
            );
        }
    }
}
const TRUE: [&str; 6] = [
    "ggx:roughness=0.1",
    "lambert:diffuse=0.5",
    "ggx-conductor:roughness=0.01",
    "ggx-conductor:eta=0.143/0.375/1.442,k=3.983/2.386/1.603,roughness=0.1",
    "ggx-conductor:roughness=0.3",
    "ward:specular=0.4,roughness=0.2",
];
