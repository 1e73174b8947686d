//! Pictures whose pixels can be worked out by hand.

use std::f64::consts::PI;
use std::path::Path;

use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use lookmatch_rendering::{EnvironmentLight, Illumination, Part, Renderer, Scene};

const SIZE: usize = 96;
const SPHERE: &str = "
    [camera]
    eye = [0.0, 0.0, 6.0]
    target = [0.0, 0.0, 0.0]
    vertical_fov = 28.0

    [[sphere]]
    centre = [0.0, 0.0, 0.0]
    radius = 1.0
";
const LIGHT: &str = "
    [[point_light]]
    position = [-3.0, 4.0, 4.0]
    intensity = [60.0, 30.0, 15.0]
";

type V = [f64; 3];

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn along(a: V, t: f64, b: V) -> V {
    std::array::from_fn(|k| a[k] + t * b[k])
}

fn unit(a: V) -> V {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

fn material(text: &str) -> Material {
    Material::parse(text).unwrap()
}

fn load(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, text).unwrap();
    Scene::load(file.to_str().unwrap()).unwrap()
}

fn picture(scene: &Scene, illumination: Illumination, text: &str) -> Image {
    Renderer::prepare(scene, illumination, SIZE).unwrap().render(&material(text), Part::Full)
}

/// The ray of the frontal camera above through a point of the film, in pixels.
fn ray(x: f64, y: f64) -> (V, V) {
    let (half, scale) = (14f64.to_radians().tan(), 2.0 / SIZE as f64);
    ([0.0, 0.0, 6.0], unit([half * (x * scale - 1.0), half * (1.0 - y * scale), -1.0]))
}

/// Distance along a ray to the unit sphere.
fn hit((eye, w): (V, V)) -> Option<f64> {
    let b = dot(eye, w);
    let discriminant = b * b - dot(eye, eye) + 1.0;
    (discriminant > 0.0).then(|| -b - discriminant.sqrt())
}

/// Mean of a function over a pixel; `None` unless all of the pixel satisfies it.
fn over_pixel(x: usize, y: usize, value: impl Fn((V, V)) -> Option<f64>) -> Option<f64> {
    let at =
        |i: usize| ray(x as f64 + (i % 8) as f64 / 8.0 + 0.0625, y as f64 + (i / 8) as f64 / 8.0 + 0.0625);
    (0..64).map(|i| value(at(i))).sum::<Option<f64>>().map(|sum| sum / 64.0)
}

fn is_within(value: f32, expected: f64, tolerance: f64) -> bool {
    (f64::from(value) - expected).abs() <= tolerance
}

#[test]
fn lambert_sphere_under_a_point_light() {
    let image =
        picture(&load(&format!("{SPHERE}{LIGHT}")), Illumination::Point, "lambert:diffuse=0.8/0.4/0.2");
    let mut checked = 0;
    for (x, y) in (0..SIZE * SIZE).map(|i| (i % SIZE, i / SIZE)) {
        let geometry = |ray: (V, V)| {
            let n = along(ray.0, hit(ray)?, ray.1);
            let to_light = along([-3.0, 4.0, 4.0], -1.0, n);
            let cos = dot(n, to_light) / dot(to_light, to_light).sqrt();
            Some(cos.max(0.0) / dot(to_light, to_light))
        };
        let Some(g) = over_pixel(x, y, geometry) else { continue };
        let pixel = image.get(x, y);
        for (c, (albedo, intensity)) in [(0.8, 60.0), (0.4, 30.0), (0.2, 15.0)].into_iter().enumerate() {
            assert!(is_within(pixel[c], albedo / PI * intensity * g, 1e-3), "{x} {y} {c}: {pixel:?}");
        }
        checked += 1;
    }
    assert!(checked > 1000);
}

#[test]
fn light_falls_with_the_square_of_the_distance() {
    let mut scene = load(SPHERE);
    let lit =
        |scene: &Scene| picture(scene, Illumination::Point, "lambert:diffuse=1").get(SIZE / 2, SIZE / 2)[0];
    let mut at = |distance: f64| {
        scene.point_lights = load(&format!("{SPHERE}{LIGHT}")).point_lights;
        scene.point_lights[0].position = [0.0, 0.0, distance + 1.0];
        lit(&scene)
    };
    // Close enough to the eye's axis that neither blocks the other: there is no body at the eye.
    let ratio = at(2.0) / at(4.0);
    assert!((ratio - 4.0).abs() < 0.02, "{ratio}");
}

#[test]
fn checkerboard_with_a_hard_shadow() {
    let plane = "
        [plane]
        height = -1.0
        half_extent = 4.0
        check_size = 0.5
        light = [0.6, 0.5, 0.4]
        dark = [0.15, 0.1, 0.05]
    ";
    let image = picture(&load(&format!("{SPHERE}{LIGHT}{plane}")), Illumination::Point, "lambert:diffuse=0");
    let (mut lit, mut dark) = (0, 0);
    for (x, y) in (0..SIZE * SIZE).map(|i| (i % SIZE, i / SIZE)) {
        let light = [-3.0, 4.0, 4.0];
        let seen = |corner: (f64, f64)| {
            let (eye, w) = ray(x as f64 + corner.0, y as f64 + corner.1);
            let t = (-1.0 - eye[1]) / w[1];
            let p = along(eye, t, w);
            let on_board = t > 0.0 && p[0].abs() < 4.0 && p[2].abs() < 4.0 && hit((eye, w)).is_none();
            let d = along(light, -1.0, p);
            let shadow = hit((p, unit(d))).is_some_and(|t| t > 0.0);
            let check = [p[0], p[2]].map(|v| (v / 0.5).floor() as i32);
            on_board.then_some((shadow, check, dot(d, d).sqrt(), d[1]))
        };
        // Pixels that lie within one check, and wholly in light or in shadow.
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(seen);
        let key = |c: Option<(bool, [i32; 2], f64, f64)>| c.map(|c| (c.0, c.1));
        let Some((shadow, check, ..)) =
            corners[0].filter(|_| corners.iter().all(|c| key(*c) == key(corners[0])))
        else {
            continue;
        };
        let irradiance: f64 =
            corners.iter().flatten().map(|(_, _, d, height)| height / d.powi(3)).sum::<f64>() / 4.0;
        let albedo = [[0.6, 0.5, 0.4], [0.15, 0.1, 0.05]][(check[0] + check[1]).rem_euclid(2) as usize];
        for (c, intensity) in [60.0, 30.0, 15.0].into_iter().enumerate() {
            let expected = if shadow { 0.0 } else { albedo[c] / PI * intensity * irradiance };
            assert!(
                is_within(image.get(x, y)[c], expected, 2e-3),
                "{x} {y} {:?} {expected}",
                image.get(x, y)
            );
        }
        *(if shadow { &mut dark } else { &mut lit }) += 1;
    }
    assert!(lit > 50 && dark > 5, "{lit} {dark}");
}

#[test]
fn a_polished_metal_mirrors_the_environment() {
    let mut scene = load(SPHERE);
    scene.environment = Some(EnvironmentLight::of("designed"));
    let map = lookmatch_rendering::designed_map();
    let renderer = Renderer::prepare(&scene, Illumination::Environment, SIZE).unwrap().keep_transport();
    // The share of a GGX lobe beyond tan θ_h = t is α²/(α² + t²): 2 % beyond 7 widths, of a band of radiance 2.5.
    for (roughness, tolerance) in [("0.001", 0.01), ("0.01", 0.06)] {
        let text = format!("ggx-conductor:eta=0.2,k=3,roughness={roughness}");
        let image = renderer.render(&material(&text), Part::Full);
        let reflectance = lookmatch_materials::fresnel::Fresnel::Conductor { eta: 0.2, k: 3.0 };
        let mut checked = 0;
        for (x, y) in (0..SIZE * SIZE).map(|i| (i % SIZE, i / SIZE)) {
            let Some(expected) = mirrored(&map, x, y) else { continue };
            let (eye, w) = ray(x as f64 + 0.5, y as f64 + 0.5);
            let n = along(eye, hit((eye, w)).unwrap(), w);
            let fresnel: f64 = reflectance.reflectance(-dot(n, w));
            for (c, radiance) in expected.iter().enumerate() {
                let value = image.get(x, y)[c];
                let expected = radiance * fresnel;
                assert!(is_within(value, expected, tolerance), "{roughness} {x} {y} {c}: {value} {expected}");
            }
            checked += 1;
        }
        assert!(checked > 60, "{checked}");
    }
}

/// The colour of the band of the designed map that all of a pixel mirrors, with some room around it.
fn mirrored(map: &Image, x: usize, y: usize) -> Option<V> {
    let mut colour = None;
    for i in 0..49 {
        let ray = ray(x as f64 + (i % 7) as f64 * 0.5 - 1.0, y as f64 + (i / 7) as f64 * 0.5 - 1.0);
        let n = along(ray.0, hit(ray)?, ray.1);
        let cos = -dot(n, ray.1);
        let r = along(ray.1, 2.0 * cos, n);
        if r[1] < 0.1 || cos < 0.25 {
            return None;
        }
        let u = r[0].atan2(-r[2]).rem_euclid(2.0 * PI) / (2.0 * PI);
        let seen = map.get((u * 1024.0) as usize % 1024, (r[1].acos() / PI * 512.0) as usize);
        if *colour.get_or_insert(seen) != seen {
            return None;
        }
    }
    colour.map(|c| c.map(f64::from))
}

/// A scene without a plane in an environment of radiance 1.
fn furnace(folder: &Path) -> Scene {
    let file = folder.join("white.exr");
    lookmatch_imaging::write(&file, &Image::from_fn(256, 128, |_, _| [1.0; 3]), &[]).unwrap();
    let scene = folder.join("furnace.toml");
    // Named relative to the scene file.
    std::fs::write(&scene, format!("{SPHERE}\n[environment]\nmap = \"white.exr\"\n")).unwrap();
    Scene::load(scene.to_str().unwrap()).unwrap()
}

#[test]
fn a_white_sphere_vanishes_in_a_white_furnace() {
    let folder = tempfile::tempdir().unwrap();
    let image = picture(&furnace(folder.path()), Illumination::Environment, "lambert:diffuse=1");
    let worst = image.pixels().iter().flatten().map(|v| (v - 1.0).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn energy_never_appears() {
    let folder = tempfile::tempdir().unwrap();
    let renderer = Renderer::prepare(&furnace(folder.path()), Illumination::Environment, 160).unwrap();
    let renderer = renderer.keep_transport();
    for roughness in ["0.01", "0.02", "0.05", "0.1", "0.2", "0.4", "0.7", "1"] {
        // F0 above 0.999.
        let text = format!("ggx-conductor:eta=0.01,k=8,roughness={roughness}");
        let image = renderer.render(&material(&text), Part::Full);
        let most = image.pixels().iter().flatten().copied().fold(0.0, f32::max);
        assert!(most <= 1.0 + 1e-3, "{roughness}: {most}");
    }
    let polished = renderer.render(&material("ggx-conductor:eta=0.01,k=8,roughness=0.01"), Part::Full);
    let least = polished.pixels().iter().flatten().copied().fold(9.0, f32::min);
    assert!(least > 0.98, "nor does it vanish: {least}");
}
