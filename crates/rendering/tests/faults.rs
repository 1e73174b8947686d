//! Every fault of a scene names the file or field, the value, and what would be accepted.

use std::path::Path;

use lookmatch_imaging::Image;
use lookmatch_rendering::{EnvironmentLight, EnvironmentMap, Illumination, Renderer, Scene, SceneError};

const GOOD: &str = "[camera]
eye = [0, 0, 6]
target = [0, 0, 0]
vertical_fov = 28
[[sphere]]
centre = [0, 0, 0]
radius = 1
[plane]
height = -1
half_extent = 4
check_size = 0.5
light = [0.6, 0.6, 0.6]
dark = [0.1, 0.1, 0.1]
[[point_light]]
position = [0, 4, 4]
intensity = [9, 9, 9]
[environment]
map = 'designed'
scale = 1
rotation = 0
";

fn load(folder: &Path, text: &str) -> Result<Scene, SceneError> {
    let file = folder.join("kitchen.toml");
    std::fs::write(&file, text).unwrap();
    Scene::load(file.to_str().unwrap())
}

/// Checks that a scene with one piece of text replaced fails with a message that contains all of `parts`.
#[track_caller]
fn fails(from: &str, to: &str, parts: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    assert!(GOOD.contains(from), "{from}");
    let message = load(folder.path(), &GOOD.replacen(from, to, 1)).unwrap_err().to_string();
    assert!(parts.iter().all(|part| message.contains(part)), "{message}");
}

#[test]
fn vectors_have_three_numbers() {
    fails("eye = [0, 0, 6]", "eye = [0, 0, 6, 1]", &["length 4", "three numbers", "eye"]);
    fails("radius = 1", "radius = 1\ndiffuse = [0.5, 0.5]", &["length 2", "three numbers"]);
}

#[test]
fn spheres_hold_neither_each_other_nor_the_camera() {
    fails("radius = 1", "radius = 7", &["sphere[0].centre", "does not hold the camera"]);
    let twin = "radius = 1\n[[sphere]]\ncentre = [1, 0, 0]\nradius = 1";
    fails("radius = 1", twin, &["sphere[1].centre", "apart from the other spheres"]);
}

const BUILT_IN: [&str; 6] = ["reference", "spheres", "blobs", "checker-wall", "spot", "shader-ball"];

#[test]
fn maps_are_files_or_names() {
    for name in EnvironmentLight::names() {
        assert!(EnvironmentMap::load(&EnvironmentLight::of(name)).is_ok(), "{name}");
    }
    let message = EnvironmentMap::load(&EnvironmentLight::of("citty")).unwrap_err().to_string();
    assert!(
        message.contains("'citty'") && message.contains(".exr") && message.contains("city, forest"),
        "{message}"
    );
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("black.exr");
    lookmatch_imaging::write(&file, &Image::new(16, 8), &[]).unwrap();
    let message = EnvironmentLight::balanced(file.to_str().unwrap()).unwrap_err().to_string();
    assert!(message.contains("black.exr") && message.contains("no light from above"), "{message}");
}

#[test]
fn a_good_scene_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let scene = load(folder.path(), GOOD).unwrap();
    assert_eq!(scene.name, "kitchen");
    assert_eq!(scene.camera.up, [0.0, 1.0, 0.0]);
}

#[test]
fn built_in_scenes_survive_their_own_format() {
    let folder = tempfile::tempdir().unwrap();
    for name in BUILT_IN {
        let scene = Scene::load(name).unwrap();
        assert_eq!(scene.name, name);
        assert_eq!(load(folder.path(), &toml::to_string(&scene).unwrap()).unwrap(), scene);
    }
}

#[test]
fn files() {
    let message = Scene::load("/nowhere/kitchen.toml").unwrap_err().to_string();
    assert!(message.contains("cannot read scene '/nowhere/kitchen.toml'"), "{message}");
    assert!(BUILT_IN.iter().all(|name| message.contains(name)), "names what is built in: {message}");
    fails("[camera]", "[camera", &["kitchen.toml", "line 1"]);
    fails("vertical_fov = 28", "vertical_fov = wide", &["kitchen.toml", "line 4"]);
    fails("radius", "raduis", &["kitchen.toml", "raduis", "radius"]);
    fails("vertical_fov = 28\n", "", &["kitchen.toml", "missing field `vertical_fov`"]);
    fails("eye = [0, 0, 6]", "eye = [0, 0]", &["kitchen.toml", "line 2"]);
}

#[test]
fn fields() {
    fails("vertical_fov = 28", "vertical_fov = 0", &["kitchen", "camera.vertical_fov", "is 0", "below 180"]);
    fails("vertical_fov = 28", "vertical_fov = nan", &["camera.vertical_fov", "NaN"]);
    fails(
        "target = [0, 0, 0]",
        "target = [0, 0, 6]",
        &["camera.target", "[0.0, 0.0, 6.0]", "not the camera's eye"],
    );
    fails("eye = [0, 0, 6]", "eye = [0, nan, 6]", &["camera.eye", "NaN"]);
    fails("vertical_fov", "up = [0, 0, 1]\nvertical_fov", &["camera.up", "[0.0, 0.0, 1.0]", "across"]);
    fails("radius = 1", "radius = -1", &["sphere[0].radius", "is -1", "above 0"]);
    fails("centre = [0, 0, 0]", "centre = [0, inf, 0]", &["sphere[0].centre", "inf"]);
    fails(
        "radius = 1",
        "radius = 1\ndiffuse = [0, 2, 0]",
        &["sphere[0].diffuse", "[0.0, 2.0, 0.0]", "[0, 1]"],
    );
    fails("height = -1", "height = nan", &["plane.height", "NaN"]);
    fails("half_extent = 4", "half_extent = 0", &["plane.half_extent", "0", "above 0"]);
    fails("check_size = 0.5", "check_size = -0.5", &["plane.check_size", "-0.5"]);
    fails("light = [0.6, 0.6, 0.6]", "light = [0.6, 0.6, -0.6]", &["plane.light", "-0.6", "[0, 1]"]);
    fails("dark = [0.1, 0.1, 0.1]", "dark = [0.1, 7, 0.1]", &["plane.dark", "7"]);
    fails("position = [0, 4, 4]", "position = [0, nan, 4]", &["point_light[0].position", "NaN"]);
    fails("intensity = [9, 9, 9]", "intensity = [9, -9, 9]", &["point_light[0].intensity", "-9", "W/sr"]);
    fails("scale = 1", "scale = 0", &["environment.scale", "is 0", "above 0"]);
    fails("rotation = 0", "rotation = inf", &["environment.rotation", "inf", "degrees"]);
    let spheres = &GOOD[GOOD.find("[[sphere]]").unwrap()..GOOD.find("[plane]").unwrap()];
    fails(spheres, "", &["kitchen", "sphere"]);
    let mut scene = Scene::reference();
    scene.spheres.clear();
    let message = scene.check().unwrap_err().to_string();
    assert!(message.contains("'reference'") && message.contains("at least one [[sphere]]"), "{message}");
}

#[test]
fn lights() {
    let mut scene = Scene::reference();
    let message = |scene: &Scene, illumination, size| match Renderer::prepare(scene, illumination, size) {
        Ok(_) => panic!("accepted"),
        Err(error) => error.to_string(),
    };
    assert!(message(&scene, Illumination::Point, 0).contains("0 x 0"));
    assert!(message(&scene, Illumination::Point, 8193).contains("1 to 8192"));
    scene.environment = Some(EnvironmentLight::of("/nowhere/sky.exr"));
    assert!(message(&scene, Illumination::Environment, 8).contains("/nowhere/sky.exr"));
    let folder = tempfile::tempdir().unwrap();
    let square = folder.path().join("square.exr");
    lookmatch_imaging::write(&square, &Image::new(8, 8), &[]).unwrap();
    scene.environment = Some(EnvironmentLight::of(square.to_str().unwrap()));
    let text = message(&scene, Illumination::All, 8);
    assert!(
        text.contains("square.exr") && text.contains("8 x 8") && text.contains("twice as wide"),
        "{text}"
    );
    scene.environment = None;
    scene.point_lights.clear();
    assert!(message(&scene, Illumination::Point, 8).contains("'reference' has no point light"));
    assert!(message(&scene, Illumination::Environment, 8).contains("has no environment"));
    assert!(message(&scene, Illumination::All, 8).contains("has no light"));
    scene.spheres[0].radius = f64::NAN;
    assert!(message(&scene, Illumination::All, 8).contains("sphere[0].radius is NaN"));
}

#[test]
fn a_map_that_does_not_fit_is_named_even_where_another_error_is_near() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sky.exr"), b"not an image").unwrap();
    let scene = load(folder.path(), &GOOD.replace("'designed'", "'sky.exr'")).unwrap();
    match Renderer::prepare(&scene, Illumination::Environment, 8) {
        Ok(_) => panic!("accepted"),
        Err(error) => assert!(error.to_string().contains("sky.exr"), "{error}"),
    }
}

#[test]
fn the_documented_example_is_the_reference_scene() {
    let text = include_str!("../../../docs/scene-format.md");
    let example = text.split("```toml").nth(1).unwrap().split("```").next().unwrap();
    assert_eq!(load(tempfile::tempdir().unwrap().path(), example).unwrap(), Scene::reference());
}
