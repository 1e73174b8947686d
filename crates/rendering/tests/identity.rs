//! The same material gives the same bits, and what is linear in a material is linear in its picture.

use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use lookmatch_rendering::{EnvironmentLight, Illumination, Part, Renderer, Scene};

const MATERIALS: [&str; 4] = [
    "ggx:roughness=0.1",
    "ward:diffuse=0.2/0.4/0.1,specular=0.1,roughness=0.05",
    "as:roughness=0.2",
    "ggx:roughness_u=0.05,roughness_v=0.2",
];

fn material(text: &str) -> Material {
    Material::parse(text).unwrap()
}

fn pictures(keeps: bool) -> Vec<Image> {
    let renderer = Renderer::prepare(&Scene::spheres(), Illumination::All, 32).unwrap();
    let renderer = if keeps { renderer.keep_transport() } else { renderer };
    MATERIALS.iter().map(|text| renderer.render(&material(text), Part::Full)).collect()
}

#[test]
fn pictures_do_not_depend_on_threads_or_on_kept_transport() {
    let with_threads = |n: usize, keeps: bool| {
        rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| pictures(keeps))
    };
    let one = with_threads(1, true);
    assert!(one == with_threads(2, true), "two threads");
    assert!(one == with_threads(5, false), "five threads, transport gathered for each picture");
}

#[test]
fn the_same_material_is_the_same_picture() {
    let renderer =
        Renderer::prepare(&Scene::reference(), Illumination::Environment, 32).unwrap().keep_transport();
    for text in MATERIALS {
        let [a, b] = [0, 1].map(|_| renderer.render(&material(text), Part::Full));
        assert!(a == b, "{text}");
        assert!(a.pixels().iter().flatten().all(|v| v.is_finite()), "{text}");
        let diffuse = renderer.render(&material(text), Part::DiffuseOnly);
        let [r, g, b] = material(text).bsdf().diffuse();
        let lambert = material(&format!("lambert:diffuse={r}/{g}/{b}"));
        assert!(diffuse == renderer.render(&lambert, Part::Full), "{text}");
    }
}

/// The largest difference between `b` and the middle of `a` and `c`.
fn bend(a: &Image, b: &Image, c: &Image) -> f32 {
    let pixels =
        a.pixels().iter().flatten().zip(b.pixels().iter().flatten()).zip(c.pixels().iter().flatten());
    pixels.map(|((a, b), c)| ((a + c) / 2.0 - b).abs() / (1.0 + b.abs())).fold(0.0, f32::max)
}

#[test]
fn without_interreflection_pictures_are_linear_in_diffuse_and_specular() {
    let mut scene = Scene::reference();
    scene.plane = None;
    for illumination in [Illumination::Point, Illumination::Environment] {
        let renderer = Renderer::prepare(&scene, illumination, 32).unwrap().keep_transport();
        for name in ["diffuse", "specular"] {
            let [a, b, c] = ["0", "0.4", "0.8"]
                .map(|v| renderer.render(&material(&format!("ward:roughness=0.1,{name}={v}")), Part::Full));
            assert!(a != c && bend(&a, &b, &c) < 1e-5, "{name}: {}", bend(&a, &b, &c));
        }
    }
}

/// A frontal sphere lit from the camera.
fn headlight() -> Scene {
    let mut scene = Scene::reference();
    (scene.plane, scene.environment) = (None, None);
    (scene.camera.eye, scene.camera.target) = ([0.0, 0.0, 6.0], [0.0; 3]);
    scene.point_lights[0].position = [0.0, 0.0, 6.0];
    scene
}

/// Second moments of a picture's brightness about its middle, in pixels²: across and upwards.
fn extent(image: &Image) -> [f64; 2] {
    let middle = (image.width() as f64 - 1.0) / 2.0;
    let mut sums = [0.0; 3];
    for (i, pixel) in image.pixels().iter().enumerate() {
        let (x, y) = ((i % image.width()) as f64 - middle, (i / image.width()) as f64 - middle);
        let value = f64::from(pixel[1]);
        (sums[0], sums[1], sums[2]) = (sums[0] + value * x * x, sums[1] + value * y * y, sums[2] + value);
    }
    [sums[0] / sums[2], sums[1] / sums[2]]
}

#[test]
fn swapped_widths_turn_the_highlight() {
    let renderer = Renderer::prepare(&headlight(), Illumination::Point, 64).unwrap();
    let extent = |u, v| {
        let text = format!("beckmann:diffuse=0,roughness_u={u},roughness_v={v}");
        extent(&renderer.render(&material(&text), Part::Full))
    };
    let ([wide, low], [narrow, high]) = (extent(0.2, 0.05), extent(0.05, 0.2));
    assert!(wide > 8.0 * low, "the tangent runs eastwards: {wide} {low}");
    assert!(
        (wide / high - 1.0).abs() < 0.1 && (low / narrow - 1.0).abs() < 0.1,
        "{wide} {high} {low} {narrow}"
    );
}

#[test]
fn a_hardly_anisotropic_lobe_is_an_isotropic_one() {
    let without_plane = Scene { plane: None, ..Scene::reference() };
    let cases = [
        (Scene::reference(), Illumination::Point),
        (Scene::reference(), Illumination::Environment),
        (without_plane, Illumination::Environment),
    ];
    for (scene, illumination) in cases {
        let renderer = Renderer::prepare(&scene, illumination, 64).unwrap();
        let [a, b] = ["ggx:roughness=0.2", "ggx:roughness_u=0.2,roughness_v=0.200001"]
            .map(|text| renderer.render(&material(text), Part::Full));
        let sum: f32 =
            a.pixels().iter().flatten().zip(b.pixels().iter().flatten()).map(|(a, b)| (a - b).abs()).sum();
        let total: f32 = a.pixels().iter().flatten().sum();
        assert!(sum / total < 2e-3, "{illumination:?}: {}", sum / total);
    }
}

#[test]
fn a_turned_map_turns_what_is_seen_of_it() {
    let mut scene = headlight();
    let mut at = |rotation: f64| {
        scene.environment = Some(EnvironmentLight { rotation, ..EnvironmentLight::of("designed") });
        let renderer = Renderer::prepare(&scene, Illumination::Environment, 32).unwrap();
        renderer.render(&material("lambert:diffuse=0"), Part::Full)
    };
    assert!(at(0.0) == at(360.0));
    assert!(at(0.0) != at(90.0));
}

#[test]
fn the_order_of_spheres_does_not_matter() {
    let mut scene = Scene::reference();
    // Behind the first, and partly hidden by it.
    let mut other = scene.spheres[0].clone();
    (other.centre, other.radius) = ([0.9, -0.2, -2.0], 0.8);
    scene.spheres.push(other);
    let picture = |scene: &Scene| {
        let renderer = Renderer::prepare(scene, Illumination::Environment, 48).unwrap();
        renderer.render(&material("lambert:diffuse=0.9"), Part::Full)
    };
    let ab = picture(&scene);
    scene.spheres.reverse();
    let ba = picture(&scene);
    let difference = bend(&ab, &ba, &ab);
    assert!(difference < 1e-4, "{difference}");
}

#[test]
fn sunken_spheres_give_finite_pictures() {
    // The middle of the checkerboard is a node of the grid of interreflection.
    for height in [-0.7, -1.0, -1.5] {
        let mut scene = Scene::reference();
        scene.spheres[0].centre[1] = height;
        let renderer = Renderer::prepare(&scene, Illumination::All, 16).unwrap();
        for text in ["ggx-conductor:roughness=0.1", "lambert:diffuse=0.8"] {
            let picture = renderer.render(&material(text), Part::Full);
            assert!(picture.pixels().iter().flatten().all(|v| v.is_finite()), "{height} {text}");
            let sum: f32 = picture.pixels().iter().flatten().sum();
            assert!(sum > 0.0, "{height} {text}");
        }
    }
}

/// Root of the mean square difference of two pictures over the range of the first, where neither shows a subject.
fn off_subject(scene: &Scene, a: &Image, b: &Image) -> f64 {
    let coverage = scene.coverage(a.width());
    let free = || coverage.iter().enumerate().filter(|(_, share)| **share == 0.0).map(|(pixel, _)| pixel);
    let greens = |image: &Image| free().map(|pixel| f64::from(image.pixels()[pixel][1])).collect::<Vec<_>>();
    let (a, b) = (greens(a), greens(b));
    let range = a.iter().copied().fold(f64::MIN, f64::max) - a.iter().copied().fold(f64::MAX, f64::min);
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / a.len() as f64).sqrt() / range
}

#[test]
fn a_small_picture_is_the_average_of_a_large_one() {
    const TIMES: usize = 4;
    let scene = Scene::spheres();
    let picture = |size| {
        let renderer = Renderer::prepare(&scene, Illumination::Point, size).unwrap();
        renderer.render(&material("lambert:diffuse=0"), Part::Full)
    };
    let (small, large) = (picture(48), picture(48 * TIMES));
    let average = Image::from_fn(48, 48, |x, y| {
        let parts = (0..TIMES * TIMES).map(|k| large.get(x * TIMES + k % TIMES, y * TIMES + k / TIMES));
        parts.fold([0.0; 3], |sum, part| std::array::from_fn(|c| sum[c] + part[c] / (TIMES * TIMES) as f32))
    });
    // The edges of squares and of shadows decide it: sixteen positions in their pixels would leave 0.009.
    let error = off_subject(&scene, &average, &small);
    assert!(error < 1.5e-3, "{error}");
}
