//! The path tracer against closed forms, against itself, and against the precomputed renderer.

use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;

use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use lookmatch_rendering::{
    Camera, EnvironmentLight, Illumination, Mesh, Part, PathTracer, Plane, PointLight, RENDERERS, Render,
    Renderer, Scene, SceneError, Sphere, TransportCache,
};

const SIZE: usize = 32;

fn material(text: &str) -> Material {
    Material::parse(text).unwrap()
}

/// A frontal unit sphere with no light.
fn sphere() -> Scene {
    Scene {
        camera: Camera { eye: [0.0, 0.0, 6.0], target: [0.0; 3], up: [0.0, 1.0, 0.0], vertical_fov: 28.0 },
        plane: None,
        point_lights: Vec::new(),
        environment: None,
        ..Scene::reference()
    }
}

/// An environment of radiance 1, beside a file that the scene names.
fn white(folder: &Path) -> Option<EnvironmentLight> {
    let file = folder.join("white.exr");
    lookmatch_imaging::write(&file, &Image::from_fn(64, 32, |_, _| [1.0; 3]), &[]).unwrap();
    Some(EnvironmentLight::of(file.to_str().unwrap()))
}

fn plane(albedo: f64) -> Plane {
    Plane { height: -1.0, half_extent: 4.0, check_size: 0.5, light: [albedo; 3], dark: [albedo; 3] }
}

fn all_pixels(size: usize) -> Vec<u32> {
    (0..(size * size) as u32).collect()
}

/// All pixels of a small picture.
fn traced(scene: &Scene, light: Illumination, text: &str, samples: u32, seed: u64) -> Vec<[f32; 3]> {
    let tracer = PathTracer::prepare(scene, light, SIZE, samples, seed).unwrap();
    tracer.radiance(&material(text), Part::Full, &all_pixels(SIZE))
}

fn extremes(values: &[[f32; 3]]) -> (f32, f32) {
    let fold = |start, of: fn(f32, f32) -> f32| values.iter().flatten().copied().fold(start, of);
    (fold(f32::INFINITY, f32::min), fold(f32::NEG_INFINITY, f32::max))
}

/// Root of the mean squared difference over the root of the mean square of `b`.
fn relative_rms(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let sum = |value: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| value((*a).into(), (*b).into())).sum()
    };
    (sum(&|a, b| (a - b).powi(2)) / sum(&|_, b| b * b)).sqrt()
}

fn mean(values: &[[f32; 3]]) -> f64 {
    values.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * values.len()) as f64
}

#[test]
fn a_white_sphere_vanishes_in_a_white_furnace() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene { environment: white(folder.path()), ..sphere() };
    let (least, most) = extremes(&traced(&scene, Illumination::Environment, "lambert:diffuse=1", 4096, 1));
    assert!(least > 0.999 && most < 1.001, "{least} {most}");
}

/// Where nothing is absorbed, every path ends at radiance 1. The bodies do not touch: about a point of contact light
/// is trapped for hundreds of reflections.
#[test]
fn white_bodies_in_a_white_furnace_are_white_with_all_interreflection() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Scene { environment: white(folder.path()), plane: Some(plane(1.0)), ..sphere() };
    scene.plane = scene.plane.map(|p| Plane { height: -1.2, ..p });
    scene.spheres.push(Sphere { centre: [1.9, -0.1, -0.6], radius: 0.9, diffuse: None });
    let values = traced(&scene, Illumination::Environment, "lambert:diffuse=1", 64, 1);
    let (least, most) = extremes(&values);
    assert!((mean(&values) - 1.0).abs() < 1e-3, "{}", mean(&values));
    assert!(least > 0.7 && most < 1.4, "single pixels are noisy: {least} {most}");
}

#[test]
fn energy_never_appears() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene { environment: white(folder.path()), ..sphere() };
    for roughness in ["0.001", "0.05", "0.3", "1"] {
        // F0 above 0.999.
        let text = format!("ggx-conductor:eta=0.01,k=8,roughness={roughness}");
        let (least, most) = extremes(&traced(&scene, Illumination::Environment, &text, 1024, 1));
        assert!(most < 1.002, "{roughness}: {most}");
        assert!(roughness != "0.001" || least > 0.99, "nor does it vanish: {least}");
    }
}

#[test]
fn lambert_sphere_under_a_point_light() {
    let light = PointLight { position: [-3.0, 4.0, 4.0], intensity: [60.0, 30.0, 15.0] };
    let scene = Scene { point_lights: vec![light], ..sphere() };
    let values = traced(&scene, Illumination::Point, "lambert:diffuse=0.8/0.4/0.2", 256, 1);
    let (half, scale) = (14f64.to_radians().tan(), 2.0 / SIZE as f64);
    let mut checked = 0;
    for (i, value) in values.iter().enumerate() {
        let irradiance = |k: usize| {
            let at = |pixel: usize, k: usize| (pixel as f64 + (k as f64 + 0.5) / 16.0) * scale - 1.0;
            let w = [half * at(i % SIZE, k % 16), -half * at(i / SIZE, k / 16), -1.0];
            let length2 = w.iter().map(|x| x * x).sum::<f64>();
            // 6 m before the unit sphere.
            let discriminant = 36.0 - 35.0 * length2;
            let t = (6.0 - discriminant.max(0.0).sqrt()) / length2;
            let n = [w[0] * t, w[1] * t, 6.0 - t];
            let d = [-3.0 - n[0], 4.0 - n[1], 4.0 - n[2]];
            let distance2 = d.iter().map(|x| x * x).sum::<f64>();
            let cos = n.iter().zip(d).map(|(n, d)| n * d).sum::<f64>() / distance2.sqrt();
            (discriminant > 0.0).then_some(cos.max(0.0) / distance2)
        };
        let Some(sum) = (0..256).map(irradiance).sum::<Option<f64>>() else { continue };
        for (c, product) in [48.0, 12.0, 3.0].into_iter().enumerate() {
            let expected = product / PI * sum / 256.0;
            assert!((f64::from(value[c]) - expected).abs() < 1e-3, "{i} {c}: {} {expected}", value[c]);
        }
        checked += 1;
    }
    assert!(checked > 100, "{checked}");
}

/// A sphere of even radiance L gives a plane below it the irradiance `π L (R/d)²`. One that reflects half of the light in
/// a white furnace has L = 1/2, and hides as much of the sky.
#[test]
fn a_sphere_shades_the_plane_by_its_form_factor() {
    let folder = tempfile::tempdir().unwrap();
    // So small a plane that the sphere receives as much as without it.
    let tiny = Plane { half_extent: 0.05, ..plane(0.5) };
    let mut scene = Scene { environment: white(folder.path()), plane: Some(tiny), ..sphere() };
    scene.camera =
        Camera { eye: [6.0, 4.0, 0.0], target: [0.0, -1.0, 0.0], vertical_fov: 0.2, ..scene.camera };
    scene.spheres[0] = Sphere { centre: [0.0, 2.0, 0.0], radius: 1.5, diffuse: None };
    let values = traced(&scene, Illumination::Environment, "lambert:diffuse=0.5", 256, 1);
    let share = (1.5f64 / 3.0).powi(2);
    let expected = 0.5 * (1.0 - 0.5 * share);
    assert!((mean(&values) / expected - 1.0).abs() < 2e-3, "{} {expected}", mean(&values));
}

/// A UV sphere with or without its smooth normals.
fn write_sphere(file: &Path, columns: usize, rows: usize) {
    let (mut vertices, mut faces) = (String::new(), String::new());
    for i in 0..=rows {
        for j in 0..columns {
            let (theta, phi) = (PI * i as f64 / rows as f64, 2.0 * PI * j as f64 / columns as f64);
            let v = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()].map(|x| 2.0 * x);
            writeln!(vertices, "v {} {} {}\nvn {} {} {}", v[0], v[1], v[2], v[0], v[1], v[2]).unwrap();
            let index = |i: usize, j: usize| 1 + i * columns + j % columns;
            if i < rows {
                let corners = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
                writeln!(faces, "f {}", corners.map(|c| format!("{c}//{c}")).join(" ")).unwrap();
            }
        }
    }
    std::fs::write(file, vertices + &faces).unwrap();
}

#[test]
fn a_sphere_and_its_mesh_look_alike() {
    let folder = tempfile::tempdir().unwrap();
    write_sphere(&folder.path().join("ball.obj"), 256, 128);
    let mut mesh = Scene { spheres: Vec::new(), ..Scene::reference() };
    mesh.meshes = vec![Mesh {
        file: folder.path().join("ball.obj").to_str().unwrap().to_owned(),
        centre: [0.0; 3],
        scale: 0.5,
        rotation: 20.0,
        diffuse: None,
    }];
    for text in ["ggx:roughness=0.2,diffuse=0.4/0.5/0.6", "ggx-conductor:roughness=0.1"] {
        let [a, b] = [&mesh, &Scene::reference()].map(|s| traced(s, Illumination::All, text, 256, 1));
        let distance = relative_rms(&a, &b);
        assert!(distance < 0.02, "{text}: {distance}");
        assert!((mean(&a) / mean(&b) - 1.0).abs() < 2e-3, "{text}: {} {}", mean(&a), mean(&b));
    }
}

#[test]
fn seeds_decide_and_threads_do_not() {
    let trace = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| traced(&Scene::spheres(), Illumination::All, "ggx:roughness=0.1", 32, seed))
    };
    let one = trace(1, 1);
    assert!(one == trace(2, 1), "two threads");
    let other = trace(2, 2);
    assert!(
        one != other && (mean(&one) / mean(&other) - 1.0).abs() < 5e-3,
        "{} {}",
        mean(&one),
        mean(&other)
    );
    assert!(one.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
}

#[test]
fn chosen_pixels_are_those_of_the_picture() {
    let tracer = PathTracer::prepare(&Scene::reference(), Illumination::Point, 24, 8, 3).unwrap();
    let plastic = material("ggx:roughness=0.1");
    let picture = tracer.render(&plastic, Part::Full);
    let pixels = [5, 300, 301, 570];
    let expected = pixels.map(|p: u32| picture.pixels()[p as usize]);
    assert_eq!(tracer.radiance(&plastic, Part::Full, &pixels), expected);
    let diffuse = tracer.render(&plastic, Part::DiffuseOnly);
    assert!(diffuse == tracer.render(&material("lambert"), Part::Full) && diffuse != picture);
}

/// Without interreflection both renderers know all of the light.
#[test]
fn a_black_checkerboard_leaves_no_difference_between_the_renderers() {
    let scene = Scene { plane: Some(plane(0.0)), ..Scene::reference() };
    for (light, text, tolerance) in [
        (Illumination::Point, "ggx:roughness=0.02", 0.01),
        (Illumination::Point, "ward:roughness=0.3", 0.01),
        (Illumination::Environment, "ggx:roughness=0.1", 0.015),
        (Illumination::Environment, "ggx-conductor:roughness=0.3", 0.015),
    ] {
        let scene = scene.for_model(material(text).model());
        let precomputed = Renderer::prepare(&scene, light, 64).unwrap();
        let picture = precomputed.render(&material(text), Part::Full);
        let whole = |p: &&u32| {
            // Silhouettes differ by the number of sub-pixel points.
            let [x, y] = [**p % 64, **p / 64].map(|v| f64::from(v) - 31.5);
            (x * x + (y + 1.3).powi(2)).sqrt() < 19.0
        };
        let pixels: Vec<u32> = precomputed.subjects().iter().filter(whole).copied().step_by(7).collect();
        let expected: Vec<[f32; 3]> = pixels.iter().map(|p| picture.pixels()[*p as usize]).collect();
        let tracer = PathTracer::prepare(&scene, light, 64, 4096, 1).unwrap();
        let values = tracer.radiance(&material(text), Part::Full, &pixels);
        let distance = relative_rms(&values, &expected);
        assert!(distance < tolerance, "{light:?} {text}: {distance}");
    }
}

#[test]
fn more_samples_are_less_noise() {
    let noise = |samples: u32| {
        let pixels: Vec<u32> = (0..64).map(|k| 8 * 24 + 4 + k * 5).collect();
        let [a, b] = [1, 2].map(|seed| {
            let tracer =
                PathTracer::prepare(&Scene::reference(), Illumination::All, 24, samples, seed).unwrap();
            tracer.radiance(&material("ggx:roughness=0.3"), Part::Full, &pixels)
        });
        relative_rms(&a, &b)
    };
    // Independent samples would fall by 4.
    let (few, many) = (noise(64), noise(1024));
    assert!(many < few / 4.5, "{few} {many}");
}

/// A mirror-like sphere throws a point light into its own shadow: the caustic must be neither lost nor noisy.
#[test]
fn a_polished_sphere_lights_its_shadow() {
    let scene = Scene::reference();
    let pixels: Vec<u32> = (0..24).map(|k| 26 * 32 + 4 + k).collect();
    let trace = |text: &str, seed| {
        let tracer =
            PathTracer::prepare(&scene.for_model(material(text).model()), Illumination::Point, 32, 512, seed);
        tracer.unwrap().radiance(&material(text), Part::Full, &pixels)
    };
    let [a, b] = [1, 2].map(|seed| trace("ggx-conductor:roughness=0.002", seed));
    let black = trace("lambert:diffuse=0", 1);
    assert!(mean(&a) > 1.02 * mean(&black), "{} {}", mean(&a), mean(&black));
    assert!(relative_rms(&a, &b) < 0.01, "{}", relative_rms(&a, &b));
}

fn fault(result: Result<impl Sized, SceneError>) -> String {
    result.err().expect("a fault").to_string()
}

#[test]
fn faults_of_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let with = |name: &str, content: &str| {
        let file = folder.path().join(name);
        std::fs::write(&file, content).unwrap();
        let mesh = format!("[[mesh]]\nfile = '{name}'\ncentre = [0, 0, 0]\n");
        let camera = "[camera]\neye = [0, 0, 6]\ntarget = [0, 0, 0]\nvertical_fov = 28\n";
        let light = "[[point_light]]\nposition = [0, 4, 4]\nintensity = [9, 9, 9]\n";
        std::fs::write(folder.path().join("scene.toml"), format!("{camera}{mesh}{light}")).unwrap();
        Scene::load(folder.path().join("scene.toml").to_str().unwrap()).unwrap()
    };
    let refused = |scene: &Scene, parts: &[&str]| {
        let message = fault(PathTracer::prepare(scene, Illumination::Point, 8, 1, 1));
        assert!(parts.iter().all(|p| message.contains(p)), "{message}");
    };
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let good = with("good.obj", triangle);
    assert!(PathTracer::prepare(&good, Illumination::Point, 8, 1, 1).is_ok(), "found beside the scene file");
    let message = fault(Renderer::prepare(&good, Illumination::Point, 8));
    assert!(message.contains("has meshes") && message.contains("'path'"), "{message}");
    refused(&with("empty.obj", ""), &["empty.obj", "no faces"]);
    refused(&with("nan.obj", &triangle.replace("v 1", "v nan")), &["nan.obj", "vertex 1", "NaN", "finite"]);
    refused(&with("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), &["flat.obj", "area"]);
    refused(&with("far.obj", &triangle.replace("2 3", "2 9")), &["far.obj", "out of bounds"]);
    refused(&with("text.obj", "v one two three"), &["text.obj", "no OBJ file"]);
    refused(&with("text.ply", "no mesh"), &["text.ply", "no PLY file"]);
    refused(&with("ball.stl", "solid"), &["ball.stl", ".obj or .ply"]);
    let header =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    let ply = format!("{header}{faces}3 0 1 2\n");
    assert!(PathTracer::prepare(&with("good.ply", &ply), Illumination::Point, 8, 1, 1).is_ok());
    refused(&with("cut.ply", &ply[..ply.len() - 20]), &["cut.ply", "no PLY file"]);
    refused(&with("far.ply", &ply.replace("3 0 1 2", "3 0 1 7")), &["far.ply", "vertex 7", "3 vertices"]);
    refused(&with("minus.ply", &ply.replace("3 0 1 2", "3 0 1 -2")), &["minus.ply", "vertex_indices"]);
    refused(&with("short.ply", &ply.replace("property float z\n", "")), &["short.ply"]);
    let mut scene = good;
    scene.meshes[0].file = "/nowhere/ball.obj".into();
    refused(&scene, &["/nowhere/ball.obj", "No such file"]);
    scene.meshes[0].scale = 0.0;
    refused(&scene, &["mesh[0].scale is 0", "above 0"]);
    scene.meshes[0].scale = 1.0;
    scene.meshes[0].diffuse = Some([2.0; 3]);
    refused(&scene, &["mesh[0].diffuse", "[0, 1]"]);
    assert_eq!(scene.for_model(material("ggx-conductor").model()).meshes[0].diffuse, None);
}

#[test]
fn the_list_of_renderers() {
    for (entry, name) in RENDERERS.iter().zip(["transport", "path"]) {
        assert_eq!(entry.name, name);
        let renderer = (entry.prepare)(
            &Scene::reference(),
            Illumination::Point,
            8,
            4,
            1,
            &TransportCache::off(),
            &|_| (),
        )
        .unwrap();
        assert_eq!((renderer.size(), renderer.render(&material("ward"), Part::Full).width()), (8, 8));
    }
    for samples in [0, (1 << 20) + 1] {
        let message = fault(PathTracer::prepare(&Scene::reference(), Illumination::Point, 8, samples, 1));
        assert!(message.contains(&samples.to_string()) && message.contains("1 to 1048576"), "{message}");
    }
}
