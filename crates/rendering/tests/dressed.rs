//! Several materials in one picture.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use lookmatch_imaging::{Image, luminance};
use lookmatch_materials::Material;
use lookmatch_rendering::{
    Camera, EnvironmentLight, Illumination, Mesh, Part, PathTracer, Plane, PointLight, Render, Renderer,
    Scene, Sphere, Spot,
};

const SIZE: usize = 32;

fn material(text: &str) -> Material {
    Material::parse(text).unwrap()
}

/// Seen from +Z, 4 m x 4 m in the plane of the origin, lit by an environment of radiance 1.
fn white(folder: &Path) -> Scene {
    let file = folder.join("white.exr");
    lookmatch_imaging::write(&file, &Image::from_fn(64, 32, |_, _| [1.0; 3]), &[]).unwrap();
    Scene {
        camera: Camera {
            eye: [0.0, 0.0, 20.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            vertical_fov: 2.0 * 0.1f64.atan().to_degrees(),
        },
        plane: None,
        point_lights: Vec::new(),
        spheres: Vec::new(),
        environment: Some(EnvironmentLight::of(file.to_str().unwrap())),
        ..Scene::reference()
    }
}

fn sphere(x: f64) -> Sphere {
    Sphere { centre: [x, 0.0, 0.0], radius: 0.9, diffuse: None }
}

fn by_subject(spot: Spot) -> usize {
    spot.subject
}

#[test]
fn one_material_is_the_plain_picture() {
    let tracer = PathTracer::prepare(&Scene::spheres(), Illumination::All, SIZE, 16, 3).unwrap();
    let plastic = material("ggx:roughness=0.1,diffuse=0.3");
    let plain = tracer.render(&plastic, Part::Full);
    assert!(tracer.render_dressed(std::slice::from_ref(&plastic), &|_| 0, Part::Full) == plain);
    let twins = [plastic.clone(), plastic];
    assert!(tracer.render_dressed(&twins, &|spot| spot.subject % 2, Part::Full) == plain);
}

#[test]
fn subjects_look_as_they_do_alone() {
    let folder = tempfile::tempdir().unwrap();
    let light = PointLight { position: [1.0, 4.0, 9.0], intensity: [90.0; 3] };
    let both =
        Scene { spheres: vec![sphere(-1.0), sphere(1.0)], point_lights: vec![light], ..white(folder.path()) };
    let alone = |k: usize| Scene { spheres: vec![both.spheres[k].clone()], ..both.clone() };
    let materials =
        [material("ggx-conductor:roughness=0.1"), material("ggx:roughness=0.3,diffuse=0.7/0.2/0.1")];
    let tracer = |scene: &Scene| PathTracer::prepare(scene, Illumination::All, SIZE, 64, 1).unwrap();
    let dressed = tracer(&both).render_dressed(&materials, &by_subject, Part::Full);
    let [left, right] = [0, 1].map(|k| tracer(&alone(k)).render(&materials[k], Part::Full));
    let mut mirrored = 0;
    for y in 0..SIZE {
        // On its outer half, nothing of a sphere faces the other one: the same paths see the same light.
        assert!((0..7).all(|x| dressed.get(x, y) == left.get(x, y)), "row {y}");
        assert!((25..SIZE).all(|x| dressed.get(x, y) == right.get(x, y)), "row {y}");
        mirrored += (10..16).filter(|x| dressed.get(*x, y) != left.get(*x, y)).count();
    }
    assert!(mirrored > 50, "what faces the other one shows it: {mirrored}");
}

#[test]
fn nothing_is_lost_between_two_white_materials() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene { spheres: vec![sphere(-0.95), sphere(0.95)], ..white(folder.path()) };
    // The metal reflects more than 0.999 of the light.
    let materials = [material("lambert:diffuse=1"), material("ggx-conductor:eta=0.01,k=8,roughness=0.001")];
    let tracer = PathTracer::prepare(&scene, Illumination::Environment, SIZE, 256, 1).unwrap();
    let picture = tracer.render_dressed(&materials, &by_subject, Part::Full);
    let mean =
        picture.pixels().iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * SIZE * SIZE) as f64;
    assert!((mean - 1.0).abs() < 2e-3, "{mean}");
    let extreme = picture.pixels().iter().flatten().map(|v| (v - 1.0).abs()).fold(0.0, f32::max);
    assert!(extreme < 0.2, "single pixels are noisy: {extreme}");
}

const COLOURS: [&str; 4] = ["0.9/0.1/0.1", "0.1/0.9/0.1", "0.1/0.1/0.9", "0.8/0.8/0.2"];

/// Checks a picture whose quarters wear four colours: red and green below, blue and yellow above.
#[track_caller]
fn has_quarters(scene: &Scene, subject: usize) {
    let materials = COLOURS.map(|colour| material(&format!("lambert:diffuse={colour}")));
    let wears = |spot: Spot| {
        assert!(spot.subject == subject && spot.texture.iter().all(|t| (0.0..1.0).contains(t)), "{spot:?}");
        let [right, up] = spot.texture.map(|t| usize::from(t >= 0.5));
        2 * up + right
    };
    let tracer = PathTracer::prepare(scene, Illumination::Environment, SIZE, 16, 1).unwrap();
    let picture = tracer.render_dressed(&materials, &wears, Part::Full);
    for (k, [x, y]) in [[12, 19], [19, 19], [12, 12], [19, 12]].into_iter().enumerate() {
        let expected: Vec<f32> = COLOURS[k].split('/').map(|v| v.parse().unwrap()).collect();
        let seen = picture.get(x, y);
        assert!((0..3).all(|c| (seen[c] - expected[c]).abs() < 0.06), "{k}: {seen:?}, expected {expected:?}");
    }
}

#[test]
fn textures_lie_where_they_should() {
    let folder = tempfile::tempdir().unwrap();
    let square =
        |scale| Mesh { file: "square".into(), centre: [0.0; 3], scale, rotation: 0.0, diffuse: None };
    has_quarters(&Scene { meshes: vec![square(3.0)], ..white(folder.path()) }, 0);
    // A sphere's u is 1/2 at +Z and grows towards +X, as seen from there; v grows upwards.
    has_quarters(&Scene { spheres: vec![sphere(0.0)], ..white(folder.path()) }, 0);
    let ball = Mesh { file: "blob:1".into(), ..square(1.0) };
    let scene = Scene { meshes: vec![ball], spheres: vec![sphere(50.0)], ..white(folder.path()) };
    has_quarters_of_mesh(&scene);
}

/// A blob's texture lies as that of a sphere; only its own light reaches its dents.
#[track_caller]
fn has_quarters_of_mesh(scene: &Scene) {
    let materials = ["lambert:diffuse=0", "lambert:diffuse=0.8"].map(material);
    let tracer = PathTracer::prepare(scene, Illumination::Environment, SIZE, 16, 1).unwrap();
    let wears =
        |spot: Spot| usize::from(spot.subject == 1 && spot.texture[0] >= 0.5 && spot.texture[1] < 0.5);
    let picture = tracer.render_dressed(&materials, &wears, Part::Full);
    assert!(picture.get(19, 19)[0] > 0.4, "{:?}", picture.get(19, 19));
    assert!([[12, 19], [12, 12], [19, 12]].iter().all(|[x, y]| picture.get(*x, *y)[0] < 0.2));
}

#[test]
fn faults_of_shapes() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |file: &str, parts: &[&str]| {
        let mesh = Mesh { file: file.into(), centre: [0.0; 3], scale: 1.0, rotation: 0.0, diffuse: None };
        let scene = Scene { meshes: vec![mesh], ..white(folder.path()) };
        let fault = PathTracer::prepare(&scene, Illumination::Environment, 8, 1, 1).err().expect(file);
        let message = fault.to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    };
    for seed in ["", "-1", "1.5", "seven", "18446744073709551616"] {
        let file = format!("blob:{seed}");
        refused(&file, &[&file, &format!("'{seed}'"), "whole number from 0 to 18446744073709551615"]);
    }
    refused("cube", &["cube", ".obj", "blob:SEED", "square", "shader-ball"]);
    let packed = folder.path().join("torn.obj.gz");
    std::fs::write(&packed, "no gzip").unwrap();
    refused(packed.to_str().unwrap(), &["torn.obj.gz", "no OBJ file"]);
}

/// Under every map, balanced, a white table is equally bright.
#[test]
fn balanced_maps_light_a_table_alike() {
    let mut radiance = Vec::new();
    for name in EnvironmentLight::names() {
        let folder = tempfile::tempdir().unwrap();
        let table = Plane { height: 0.0, half_extent: 3.0, check_size: 1.0, light: [0.9; 3], dark: [0.9; 3] };
        let scene = Scene {
            camera: Camera { eye: [0.0, 20.0, 0.0], up: [0.0, 0.0, -1.0], ..white(folder.path()).camera },
            plane: Some(table),
            // A scene has a subject: far below, it is neither seen nor shades the table.
            spheres: vec![Sphere { centre: [0.0, -900.0, 0.0], radius: 0.1, diffuse: None }],
            environment: Some(EnvironmentLight::balanced(name).unwrap()),
            ..white(folder.path())
        };
        let tracer = PathTracer::prepare(&scene, Illumination::Environment, 4, 4096, 1).unwrap();
        let picture = tracer.render(&material("lambert"), Part::Full);
        radiance.push((name, f64::from(luminance(picture.get(1, 1)))));
    }
    assert_eq!(radiance.len(), 7);
    let wanted = radiance[1].1;
    assert!(wanted > 0.5 && wanted < 1.5, "interior is just white: {wanted}");
    assert!(radiance.iter().all(|(_, seen)| (seen / wanted - 1.0).abs() < 0.02), "{radiance:?}");
}

/// Every built-in scene shows its subjects, and none in vain: a black material darkens the picture.
#[test]
fn built_in_scenes_show_their_subjects() {
    for name in ["blobs", "checker-wall", "spot", "shader-ball"] {
        let scene = Scene::load(name).unwrap();
        for light in [Illumination::Point, Illumination::Environment] {
            let tracer = PathTracer::prepare(&scene, light, SIZE, 8, 1).unwrap();
            let [black, white] =
                ["0", "0.9"].map(|d| tracer.render(&material(&format!("lambert:diffuse={d}")), Part::Full));
            let subject = |k: &usize| black.pixels()[*k] == [0.0; 3] && white.pixels()[*k][1] > 0.02;
            let share = (0..SIZE * SIZE).filter(subject).count() as f64 / (SIZE * SIZE) as f64;
            assert!((0.1..0.95).contains(&share), "{name} {light:?}: {share}");
            let brightest = white.pixels().iter().flatten().copied().fold(0.0, f32::max);
            assert!(brightest.is_finite() && brightest > 0.05, "{name} {light:?}: {brightest}");
        }
    }
}

#[test]
fn spheres_of_the_fast_renderer_wear_their_own() {
    let scene = Scene::spheres().for_model(material("ggx-conductor").model());
    let renderer = Renderer::prepare(&scene, Illumination::Point, 48).unwrap().keep_transport();
    let materials =
        ["ggx-conductor:roughness=0.1", "lambert:diffuse=0.5", "ward:roughness=0.3"].map(material);
    let refs = materials.each_ref();
    let alike = renderer.render_dressed(&[refs[0]; 3], Part::Full);
    let plain = renderer.render(refs[0], Part::Full);
    let largest = |a: &Image, b: &Image| {
        let pairs = a.pixels().iter().flatten().zip(b.pixels().iter().flatten());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert!(largest(&alike, &plain) < 1e-5, "{}", largest(&alike, &plain));
    let pictures = renderer.render_dressed_batch(&refs, &[vec![0, 1, 2], vec![2, 1, 0]], Part::Full);
    assert!(pictures[0] == renderer.render_dressed(&refs, Part::Full));
    // The middles of the three spheres.
    for (wears, picture) in [[0, 1, 2], [2, 1, 0]].iter().zip(&pictures) {
        for (number, x) in wears.iter().zip([8, 24, 39]) {
            let alone = renderer.render(refs[*number], Part::Full);
            assert!(picture.get(x, 23) == alone.get(x, 23), "{number} at {x}");
        }
    }
    let alone = catch_unwind(AssertUnwindSafe(|| renderer.render_dressed(&refs[..1], Part::Full)));
    assert!(alone.is_err(), "one material for three spheres");
    // What lies before a sphere is nearer to its own picture than to that of any other.
    let board = |picture: &Image, x: usize| f64::from(picture.get(x, 36)[1]);
    let [metal, matt] = [0, 1].map(|k| renderer.render(refs[k], Part::Full));
    assert!(
        (board(&pictures[0], 8) - board(&metal, 8)).abs() < (board(&pictures[0], 8) - board(&matt, 8)).abs()
    );
}
