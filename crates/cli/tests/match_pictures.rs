//! `lookmatch match` from a user's seat: what it prints and writes, and what it says of pictures that cannot be matched.

use std::path::Path;
use std::process::{Command, Output};

use lookmatch_imaging::{Image, read, write};
use serde_json::Value as Json;
use tempfile::TempDir;

const SIZE: &str = "32";

fn lookmatch(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookmatch"));
    let cache = concat!(env!("CARGO_TARGET_TMPDIR"), "/transport");
    command.current_dir(folder).env("LOOKMATCH_CACHE", cache).args(arguments).output().unwrap()
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder `in` with the four pictures of a material.
fn pictures(material: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    std::fs::create_dir(folder.path().join("in")).unwrap();
    for (light, name) in [("point", "point"), ("env", "environment")] {
        for (part, more) in [("full", None), ("diffuse", Some("--diffuse-only"))] {
            let file = format!("in/{part}_{name}.exr");
            let mut arguments =
                vec!["render", "reference", "-m", material, "-l", light, "-s", SIZE, "-o", &file];
            arguments.extend(more);
            let output = lookmatch(folder.path(), &arguments);
            assert!(output.status.success(), "{}", message(&output));
        }
    }
    folder
}

const MATCH: &[&str] = &["match", "in", "--to", "ggx", "-o", "out"];

fn refused(folder: &TempDir, code: i32, words: &[&str]) {
    let output = lookmatch(folder.path(), MATCH);
    let message = message(&output);
    assert_eq!(output.status.code(), Some(code), "{message}");
    for word in words {
        assert!(message.contains(word), "no '{word}' in: {message}");
    }
    assert!(output.stdout.is_empty());
}

fn change(folder: &TempDir, name: &str, change: impl Fn(&Image) -> Image) {
    let path = folder.path().join("in").join(name);
    let image = change(&read(&path).unwrap());
    write(&path, &image, &[]).unwrap();
}

fn remove(folder: &TempDir, name: &str) {
    std::fs::remove_file(folder.path().join("in").join(name)).unwrap();
}

fn material_json(folder: &TempDir, text: &str) {
    std::fs::write(folder.path().join("in/material.json"), text).unwrap();
}

fn scaled(factor: f32) -> impl Fn(&Image) -> Image {
    move |image| Image::from_fn(image.width(), image.height(), |x, y| image.get(x, y).map(|v| factor * v))
}

#[test]
fn a_material_comes_back_with_its_pictures() {
    let folder = pictures("ggx:diffuse=0.5/0.3/0.1,ior=1.6,roughness=0.3");
    material_json(&folder, r#"{"name": "my paint", "roughness": 0.3}"#);
    let output = lookmatch(folder.path(), &[MATCH, &["--json"]].concat());
    assert!(output.status.success(), "{}", message(&output));
    assert!(message(&output).contains("my paint"), "{}", message(&output));
    let result: Json = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["searched"]["ior"], 1.6);
    assert_eq!(result["searched"]["roughness"], 0.3);
    assert!(result["nrmsd"][0].as_f64().unwrap() < 1e-3);
    let names = ["result.json", "side-by-side_point.png", "side-by-side_environment.exr", "match_point.exr"];
    assert!(names.iter().all(|name| folder.path().join("out").join(name).is_file()));
    // The text alone is what a script reads; without diffuse pictures and a light it says so.
    for name in ["diffuse_point.exr", "diffuse_environment.exr", "full_point.exr"] {
        remove(&folder, name);
    }
    let output = lookmatch(folder.path(), &[MATCH, &["--fix", "ior=1.6"]].concat());
    assert!(output.status.success(), "{}", message(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        text.starts_with("ggx:diffuse=") && text.contains("ior=1.6") && text.lines().count() == 1,
        "{text}"
    );
    for words in ["no full_point.exr", "no diffuse pictures"] {
        assert!(message(&output).contains(words), "{}", message(&output));
    }
    let output = lookmatch(folder.path(), &[MATCH, &["--fix", "source.ior=1.6"]].concat());
    assert_eq!(output.status.code(), Some(2), "{}", message(&output));
}

#[test]
fn pictures_that_cannot_be_matched_are_refused() {
    let folder = TempDir::new().unwrap();
    refused(&folder, 1, &["no folder 'in'"]);
    let folder = pictures("ggx");
    material_json(&folder, r#"{"rougness": 0.3}"#);
    refused(&folder, 1, &["'rougness' is unknown", "base_color", "material.json"]);
    material_json(&folder, r#"{"diffuse": [0.5, 2]}"#);
    refused(&folder, 1, &["[0.5,2]", "three"]);
    material_json(&folder, r#"{"scene": "spheres"}"#);
    refused(&folder, 1, &["colours of their own"]);
    remove(&folder, "material.json");
    change(&folder, "full_environment.exr", |image| Image::from_fn(32, 32, |x, y| image.get(x, 31 - y)));
    refused(&folder, 1, &["full_environment.exr is upside down"]);
    change(&folder, "full_environment.exr", |_| Image::new(32, 32));
    refused(&folder, 1, &["full_environment.exr", "is black"]);
    change(&folder, "full_environment.exr", |_| Image::from_fn(48, 48, |_, _| [0.5; 3]));
    refused(&folder, 1, &["48", "one size"]);
    change(&folder, "full_environment.exr", |_| Image::from_fn(48, 32, |_, _| [0.5; 3]));
    refused(&folder, 1, &["48 x 32", "square"]);
    std::fs::write(folder.path().join("in/full_environment.exr"), "P6 no EXR at all").unwrap();
    refused(&folder, 1, &["full_environment.exr", "damaged or not supported"]);
    remove(&folder, "full_environment.exr");
    refused(&folder, 1, &["diffuse_environment.exr' is there", "full_environment.exr"]);
    remove(&folder, "diffuse_environment.exr");
    remove(&folder, "diffuse_point.exr");
    std::fs::rename(folder.path().join("in/full_point.exr"), folder.path().join("in/beauty.exr")).unwrap();
    refused(&folder, 1, &["neither full_point.exr nor full_environment.exr", "beauty.exr"]);
}

#[test]
fn suspicious_pictures_are_warned_of() {
    let folder = pictures("ggx:diffuse=0.4,roughness=0.4");
    change(&folder, "full_point.exr", scaled(2.0));
    change(&folder, "diffuse_environment.exr", |image| {
        Image::from_fn(32, 32, |x, y| image.get(x, y).map(|v| v.min(1.0)))
    });
    change(&folder, "full_environment.exr", |image| {
        Image::from_fn(32, 32, |x, y| image.get(x, y).map(|v| v.powf(0.45)))
    });
    let output = lookmatch(folder.path(), MATCH);
    assert!(output.status.success(), "{}", message(&output));
    let message = message(&output);
    for words in [
        "full_point.exr: its background is 2.0",
        "diffuse_environment.exr: has no value above 1",
        "full_environment.exr: its background is ours to the power of 0.4",
    ] {
        assert!(message.contains(words), "no '{words}' in: {message}");
    }
}
