//! Matches of pictures that our own renderer made of known materials.

use lookmatch_imaging::Image;
use lookmatch_materials::{Levels, Material, by_name};
use lookmatch_remap::{
    Assignment, CrossStage, Endpoint, Options, PictureMatch, Pictures, Plan, Side, Stage, Strategy, Vary,
    match_pictures, remap,
};
use lookmatch_rendering::{Illumination, Part, Renderer, Scene, TransportCache};

const SIZE: usize = 64;

/// The light takes seconds to prepare, and is the same in all tests.
fn cache() -> TransportCache {
    TransportCache::new(concat!(env!("CARGO_TARGET_TMPDIR"), "/transport"))
}

fn picture(material: &Material, light: Illumination, part: Part) -> Image {
    Renderer::cached(&Scene::reference(), light, SIZE, &cache(), &|_| ()).unwrap().render(material, part)
}

fn pictures(material: &str, with_diffuse: bool) -> Pictures {
    let material = Material::parse(material).unwrap();
    let lights = [Illumination::Point, Illumination::Environment];
    let of = |part| lights.map(|light| Some(picture(&material, light, part)));
    let diffuse = if with_diffuse { of(Part::DiffuseOnly) } else { [None, None] };
    Pictures { full: of(Part::Full), diffuse, albedo: None }
}

fn fix(name: &str, value: &str) -> Assignment {
    Assignment { side: Some(Side::Target), name: name.into(), value: value.into() }
}

fn matched(pictures: &Pictures, to: &str, fix: Vec<Assignment>) -> PictureMatch {
    let options = Options { size: Some(SIZE), fix, ..Options::default() };
    let to = Endpoint::parse(to).unwrap();
    let plan = Plan::from_pictures(to, Scene::reference(), &options).unwrap();
    let stage = CrossStage::for_pictures(&plan, pictures, &[], &cache(), &|_| ()).unwrap();
    match_pictures(&plan, &stage, pictures, &|| false).unwrap()
}

/// Largest difference of two colours.
fn off(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max)
}

#[test]
fn parameters_come_back_with_and_without_diffuse_pictures() {
    let text = "ggx:diffuse=0.6/0.3/0.1,ior=1.6,roughness=0.2";
    for (with_diffuse, tolerance) in [(true, 5e-4), (false, 5e-3)] {
        let found = matched(&pictures(text, with_diffuse), "ggx", Vec::new());
        assert!((found.target.number("ior").unwrap() - 1.6).abs() < 1e-9, "{}", found.target);
        assert!((found.target.number("roughness").unwrap() - 0.2).abs() < 1e-9, "{}", found.target);
        assert!(off(found.albedo.unwrap(), [0.6, 0.3, 0.1]) < tolerance, "{:?}", found.albedo);
        assert!(found.nrmsd[0].iter().all(|v| *v < 2e-3), "{:?}", found.nrmsd);
    }
}

#[test]
fn pictures_of_ward_become_what_a_remap_makes_of_it() {
    let values = [("specular", 0.12), ("roughness", 0.18)];
    let vary = values.map(|(name, value)| Vary {
        side: Some(Side::Source),
        name: name.into(),
        levels: Levels::new(value, value, 0.1),
    });
    let options = Options {
        vary: vary.into(),
        strategy: Strategy::Unconstrained,
        size: Some(SIZE),
        ..Options::default()
    };
    let plan = Plan::new(by_name("ward").unwrap(), by_name("ggx").unwrap(), &options).unwrap();
    let stage = Stage::cached(&plan, &cache(), &|_| ()).unwrap();
    let probe = remap(&plan, &stage, None, &mut |_| {}, &|| false).unwrap();
    let source = plan.source_material(&[0.12, 0.18]).unwrap().to_string();
    let found = matched(&pictures(&source, true), "ggx", Vec::new());
    for (axis, (a, b)) in plan.target_axes.iter().zip(probe.entries[0].target.iter().zip(&found.values)) {
        // A remap compares silhouettes too, where Ward's model is brightest: other renderers' filters differ there.
        let step = axis.value(1) - axis.value(0);
        assert!((a - b).abs() < 3.01 * step, "{}: {a} {b}", axis.name);
    }
}

#[test]
fn a_conductor_takes_the_hue_of_the_highlights() {
    let found = matched(
        &pictures("gltf:metallic=1,base_color=0.9/0.6/0.2,roughness=0.4", false),
        "gltf",
        vec![fix("metallic", "1")],
    );
    let colour = found.target.by_role(lookmatch_materials::Role::BaseColour).unwrap().colour().unwrap();
    assert!(off(colour, [0.9, 0.6, 0.2]) < 0.03, "{}", found.target);
    assert!((found.target.number("roughness").unwrap() - 0.4).abs() < 0.0101, "{}", found.target);
    assert_eq!(found.albedo, None);
}

#[test]
fn one_light_is_enough_and_a_known_body_is_believed() {
    let text = "ggx:diffuse=0.5/0.3/0.1,ior=1.5,roughness=0.3";
    for missing in [0, 1] {
        let mut pictures = pictures(text, true);
        (pictures.full[missing], pictures.diffuse[missing]) = (None, None);
        let found = matched(&pictures, "ggx", Vec::new());
        assert!((found.target.number("ior").unwrap() - 1.5).abs() < 0.0101, "{}", found.target);
        assert!((found.target.number("roughness").unwrap() - 0.3).abs() < 0.0101, "{}", found.target);
    }
    let pictures = Pictures { albedo: Some([0.4, 0.3, 0.2]), ..pictures(text, true) };
    let found = matched(&pictures, "ggx", Vec::new());
    let body = found.target.by_role(lookmatch_materials::Role::DiffuseReflectance).unwrap();
    assert_eq!(body.colour(), Some([0.4, 0.3, 0.2]));
    // What the user fixes stays, and is not fitted.
    let plain = self::pictures(text, false);
    let found = matched(&plain, "ggx", vec![fix("diffuse", "0.5/0.3/0.1")]);
    assert_eq!((found.albedo, &*found.values), (None, &[1.0, 1.5, 0.3][..]));
}

#[test]
fn pictures_that_do_not_fit_are_refused() {
    let options = Options { size: Some(SIZE), ..Options::default() };
    let plan = Plan::from_pictures(Endpoint::parse("ggx").unwrap(), Scene::reference(), &options).unwrap();
    let stage = CrossStage::for_pictures(&plan, &pictures("ggx", false), &[], &cache(), &|_| ()).unwrap();
    let refusal =
        |pictures: &Pictures| match_pictures(&plan, &stage, pictures, &|| false).unwrap_err().to_string();
    assert!(refusal(&Pictures::default()).contains("full picture"));
    let small = Image::new(8, 8);
    let odd = Pictures { full: [Some(small), None], ..Pictures::default() };
    assert!(refusal(&odd).contains("size"));
    let half = Pictures { full: [Some(Image::new(64, 64)), Some(Image::new(64, 64))], ..Pictures::default() };
    let half = Pictures { diffuse: [Some(Image::new(64, 64)), None], ..half };
    assert!(refusal(&half).contains("diffuse pictures"));
}
