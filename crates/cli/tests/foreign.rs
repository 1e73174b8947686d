//! Materials of other renderers at the command line, with a renderer of two models in Python.

mod support;

use std::path::Path;
use std::process::Command;

use serde_json::Value as Json;
use tempfile::TempDir;

use support::{json, lookmatch, refused};

/// The renderer of `worker.py` as an argument of `--start`; `None` without Python.
fn fake_renderer() -> Option<String> {
    let has_python = Command::new("python3").arg("--version").output().is_ok_and(|o| o.status.success());
    if !has_python {
        eprintln!("skipped: there is no python3");
    }
    let worker = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/worker.py");
    has_python.then(|| format!("fake=python3 '{}'", worker.display()))
}

#[test]
fn materials_of_other_renderers_are_rendered_and_compared() {
    let Some(fake) = fake_renderer() else { return };
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    let start = ["--start", &*fake, "--size", "16"];
    let render = |material: &'static str, more: &[&'static str]| {
        let base = ["render", "spheres", "-m", material, "--samples", "4", "-o", "o.exr"];
        [&base[..], &start, more].concat()
    };
    let summary = json(of, &render("fake:plastic:colour=0.5/0.25/0", &["--json"]));
    let known = [&summary["renderer"], &summary["version"], &summary["samples"], &summary["seed"]];
    assert_eq!(known, [&Json::from("fake"), &"1.0".into(), &5.into(), &1.into()]);
    let body = render("fake:plastic:colour=0.5/0.25/0", &["--diffuse-only"]);
    let output = lookmatch(of, &body);
    assert!(output.status.success() && String::from_utf8_lossy(&output.stderr).contains("own colours"));
    let pixel = lookmatch_imaging::read(&of.join("o.exr")).unwrap().get(8, 8);
    // The same noise lies on the black body, and goes with it.
    assert!((0..3).all(|c| (pixel[c] - [0.25, 0.125, 0.0][c]).abs() < 1e-6), "{pixel:?}");
    std::fs::remove_file(of.join("o.exr")).unwrap();

    let pair = [
        "compare",
        "--source",
        "fake:plastic",
        "--scene",
        "reference",
        "--light",
        "point",
        "-o",
        "pair",
        "--json",
    ];
    let same = json(of, &[&pair[..], &start, &["--target", "fake:plastic"]].concat());
    for (whole, noise) in [("nrmsd", "noise_nrmsd"), ("nrmsd_masked", "noise_nrmsd_masked")] {
        let ratio = same[whole][0].as_f64().unwrap() / same[noise][0].as_f64().unwrap();
        assert!((0.6..1.6).contains(&ratio), "equal materials differ by noise alone: {ratio}");
    }
    let ours = json(of, &[&pair[..], &start, &["--target", "ggx"]].concat());
    assert!(ours["nrmsd"][0].as_f64().unwrap() > 3.0 * ours["noise_nrmsd"][0].as_f64().unwrap());
    assert!(of.join("pair/side-by-side.png").is_file());

    let listed = lookmatch(of, &["models", "fake:", "--start", &fake]);
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    assert!(listed.contains("fake:plastic") && listed.contains("fake:metal"), "{listed}");
    refused(of, &render("fake:plastic", &["--renderer", "path"]), 2, &["--renderer path", "fake renders"]);
    refused(of, &render("fake:plastik", &[]), 2, &["did you mean 'fake:plastic'?"]);
    refused(of, &render("fake:metal", &["--diffuse-only"]), 2, &["no diffuse reflection"]);
    refused(of, &render("fake:plastic", &["--seed", "3000000000"]), 2, &["3000000000", "2147483647"]);
    refused(of, &["render", "spheres", "-m", "fake:plastic", "-o", "o.exr"], 2, &["'fake'", "mitsuba"]);
    let mesh = "name = 'm'\n[camera]\neye = [0, 0, 6]\ntarget = [0, 0, 0]\nvertical_fov = 28\n[[mesh]]\nfile = 'm.obj'\n\
                centre = [0, 0, 0]\n[[point_light]]\nposition = [0, 4, 4]\nintensity = [9, 9, 9]\n";
    std::fs::write(of.join("mesh.toml"), mesh).unwrap();
    let mut on_mesh = render("fake:plastic", &[]);
    on_mesh[1] = "mesh.toml";
    refused(of, &on_mesh, 2, &["fake", "spheres alone", "m.obj"]);
    assert!(!of.join("o.exr").exists());
}

#[test]
fn probes_of_other_renderers_are_read_without_them() {
    let Some(fake) = fake_renderer() else { return };
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    let job =
        ["remap", "ward", "fake:plastic", "--vary", "source.roughness=0.1:0.3:0.1", "--fix", "specular=0.1"];
    let how = ["--size", "16", "--start", &*fake, "--report", "report", "-o", "p.json"];
    json(of, &[&job[..], &how, &["--json"]].concat());
    let report = std::fs::read_to_string(of.join("report/index.html")).unwrap();
    assert!(
        report.contains("noise alone")
            && report.contains("fake 1.0")
            && of.join("report/match-0.png").is_file()
    );

    let applied = json(of, &["apply", "p.json", "specular=0.1", "roughness=0.2", "--json"]);
    assert_eq!(applied["target"]["model"], "fake:plastic");
    let inspected = json(of, &["inspect", "p.json", "--json"]);
    assert_eq!((&inspected["renderers"][0]["name"], &inspected["failed"]), (&"fake".into(), &0.into()));
    refused(of, &["validate", "p.json"], 2, &["target is fake:plastic", "only fake can render"]);

    // An entry that could not be rendered is told, and nothing is made of it.
    let mut probe: Json = serde_json::from_str(&std::fs::read_to_string(of.join("p.json")).unwrap()).unwrap();
    probe["entries"][1]["target"] = serde_json::json!([]);
    probe["entries"][1]["failed"] = "out of luck".into();
    std::fs::write(of.join("failed.json"), probe.to_string()).unwrap();
    assert_eq!(json(of, &["inspect", "failed.json", "--json"])["failed"], 1);
    let text = lookmatch(of, &["inspect", "failed.json"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("out of luck"));
    refused(of, &["apply", "failed.json", "specular=0.1", "roughness=0.2"], 2, &["out of luck"]);
}

#[test]
fn materials_of_other_renderers_are_refused_where_formulas_are_needed() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    let refused = |arguments: &[&str], command: &str| {
        refused(of, arguments, 2, &[command, "cycles:principled", "only cycles can render"]);
    };
    refused(&["lint", "cycles:principled:roughness=60"], "lint:");
    refused(&["lint", "ggx", "--like", "cycles:principled"], "lint:");
    refused(&["pairs", "ggx", "cycles:principled", "-o", "pairs"], "pairs:");
    let vector = r#"{"id": 1, "model": "cycles:principled", "params": {}, "wi": [0,0,1], "wo": [0,0,1]}"#;
    std::fs::write(of.join("v.json"), format!(r#"{{"brdf": [{vector}]}}"#)).unwrap();
    refused(&["eval", "v.json"], "eval:");
}
