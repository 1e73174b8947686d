//! What a user does at the command line, and what the program says when it cannot be done.

mod support;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use serde_json::Value as Json;
use tempfile::TempDir;

use support::{json, lookmatch, program, refused};

/// A probe of 2 × 3 source points from tiny pictures.
const REMAP: &[&str] = &[
    "remap",
    "ward",
    "ggx",
    "--vary",
    "specular=0.04:0.08:0.04",
    "--vary",
    "roughness=0.1:0.3:0.1",
    "--size",
    "32",
];

fn with<'a>(arguments: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [arguments, more].concat()
}

#[test]
fn the_catalogue_describes_every_parameter() {
    let folder = TempDir::new().unwrap();
    let models = json(folder.path(), &["models", "--json"]);
    let ward = models.as_array().unwrap().iter().find(|m| m["name"] == "ward").unwrap();
    let roughness = &ward["parameters"].as_array().unwrap()[2];
    assert_eq!(
        (roughness["name"].as_str(), roughness["role"].as_str()),
        (Some("roughness_u"), Some("roughness"))
    );
    assert_eq!(roughness["range"]["search"]["step"], 0.01);
    let text = lookmatch(folder.path(), &["models"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("roughness sets roughness_u and roughness_v"));
}

#[test]
fn vectors_are_evaluated_and_unknown_models_are_null() {
    let folder = TempDir::new().unwrap();
    let up = "[0,0,1]";
    let vectors = format!(
        r#"{{"brdf":[{{"id":7,"model":"lambert","params":{{"kd":0.5}},"wi":{up},"wo":{up}}},
            {{"id":"x","model":"velvet","params":{{}},"wi":{up},"wo":{up}}}]}}"#
    );
    std::fs::write(folder.path().join("v.json"), vectors).unwrap();
    let values = json(folder.path(), &["eval", "v.json", "--json"]);
    assert!((values["brdf"][0]["f"].as_f64().unwrap() - 0.5 / std::f64::consts::PI).abs() < 1e-15);
    assert_eq!(values["brdf"][1], serde_json::json!({"id": "x", "f": null}));
    std::fs::write(folder.path().join("bad.json"), "{\"brdf\": 3}").unwrap();
    refused(folder.path(), &["eval", "bad.json", "--json"], 1, &["bad.json"]);
}

#[test]
fn a_picture_is_the_same_on_any_number_of_threads() {
    let folder = TempDir::new().unwrap();
    for (threads, name) in [("1", "one.exr"), ("3", "three.exr")] {
        let status = program(folder.path())
            .env("RAYON_NUM_THREADS", threads)
            .args(["render", "reference", "--material", "ggx:ior=1.6,roughness=0.1", "--light", "env"])
            .args(["--size", "24", "-o", name])
            .status()
            .unwrap();
        assert!(status.success());
    }
    let image = |name: &str| lookmatch_imaging::read(&folder.path().join(name)).unwrap();
    assert_eq!(image("one.exr"), image("three.exr"));
    assert!(image("one.exr").pixels().iter().flatten().any(|v| *v > 0.1));
}

#[test]
fn a_picture_is_traced() {
    let folder = TempDir::new().unwrap();
    let render = |more: &[&'static str]| {
        let base =
            ["render", "reference", "-m", "ggx:roughness=0.1", "-l", "point", "--size", "16", "-o", "o.exr"];
        with(&base, more)
    };
    let summary =
        json(folder.path(), &render(&["--renderer", "path", "--samples", "16", "--seed", "7", "--json"]));
    assert_eq!((&summary["renderer"], &summary["samples"]), (&"path".into(), &16.into()));
    let traced = lookmatch_imaging::read(&folder.path().join("o.exr")).unwrap();
    let summary = json(folder.path(), &render(&["--json"]));
    assert_eq!((&summary["renderer"], &summary["samples"]), (&"transport".into(), &Json::Null));
    let precomputed = lookmatch_imaging::read(&folder.path().join("o.exr")).unwrap();
    let sum = |image: &lookmatch_imaging::Image| image.pixels().iter().flatten().sum::<f32>();
    assert!((sum(&traced) / sum(&precomputed) - 1.0).abs() < 0.1, "{} {}", sum(&traced), sum(&precomputed));
    std::fs::remove_file(folder.path().join("o.exr")).unwrap();
    refused(folder.path(), &render(&["--renderer", "raster"]), 2, &["'raster'", "transport", "path"]);
    refused(folder.path(), &render(&["--renderer", "path", "--samples", "0"]), 1, &["0 samples", "1048576"]);
    assert!(!folder.path().join("o.exr").exists());
}

#[test]
fn light_is_prepared_once_and_kept() {
    let folder = TempDir::new().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = program(folder.path());
        command
            .env("LOOKMATCH_CACHE", folder.path().join("kept"))
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command.spawn().unwrap()
    };
    let render = |output: &str| {
        let material = ["render", "reference", "-m", "ggx:roughness=0.1", "-l", "point", "--size", "16"];
        run(&[&material[..], &["-o", output, "--json"]].concat())
    };
    let transport = |child: Child| {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success());
        let summary: Json = serde_json::from_slice(&output.stdout).unwrap();
        (summary["transport"].as_str().unwrap().to_owned(), String::from_utf8(output.stderr).unwrap())
    };
    let read = |name: &str| lookmatch_imaging::read(&folder.path().join(name)).unwrap();
    let both = [render("a.exr"), render("b.exr")].map(|child| transport(child).0);
    assert!(
        both == ["built", "cached"] || both == ["cached", "built"],
        "of two at once, one builds: {both:?}"
    );
    assert_eq!(read("a.exr"), read("b.exr"));

    let [file] = kept(&folder.path().join("kept")).try_into().unwrap();
    let mut bytes = std::fs::read(&file).unwrap();
    bytes[1000] ^= 1;
    std::fs::write(&file, bytes).unwrap();
    let (how, told) = transport(render("c.exr"));
    assert!(how == "built" && told.contains("warning") && told.contains(file.to_str().unwrap()), "{told}");
    assert_eq!(transport(render("c.exr")).0, "cached");
    assert_eq!(read("a.exr"), read("c.exr"));

    // A comparison needs the same light.
    let pair = ["compare", "--source", "ggx", "--target", "ggx:ior=1.6", "--scene", "reference"];
    let pair = [&pair[..], &["--light", "point", "--size", "16", "-o", "pair"]].concat();
    assert!(run(&pair).wait().unwrap().success());
    assert_eq!(kept(&folder.path().join("kept")), [file]);
}

fn kept(folder: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn a_probe_is_found_applied_inspected_and_judged() {
    let folder = TempDir::new().unwrap();
    let made = json(folder.path(), &with(REMAP, &["--mask", "--report", "report", "-o", "p.json", "--json"]));
    assert_eq!(made["source_points"], 6);
    assert!(!folder.path().join("p.json.partial").exists(), "finished work leaves no state behind");
    for file in ["index.html", "validation.json", "validation.txt", "match-0.png"] {
        assert!(folder.path().join("report").join(file).is_file(), "{file} is missing in the report");
    }

    let applied = json(folder.path(), &["apply", "p.json", "specular=0.06", "roughness=0.15", "--json"]);
    let ior = applied["target"]["ior"].as_f64().unwrap();
    assert!((1.4..2.0).contains(&ior), "F0 = 0.06 is an index near 1.65, not {ior}");
    assert!((applied["target"]["roughness_u"].as_f64().unwrap() - 0.15).abs() < 0.05);
    let coloured = &["apply", "p.json", "specular=0.04", "roughness=0.1", "diffuse=0.1/0.2/0.3", "--json"];
    assert_eq!(json(folder.path(), coloured)["target"]["diffuse"], serde_json::json!([0.1, 0.2, 0.3]));

    refused(
        folder.path(),
        &["apply", "p.json", "specular=0.06", "roughness=0.5"],
        2,
        &["roughness = 0.5", "[0.1, 0.3]", "--clamp"],
    );
    let clamped =
        json(folder.path(), &["apply", "p.json", "specular=0.06", "roughness=0.5", "--clamp", "--json"]);
    assert_eq!(clamped["clamped"], serde_json::json!(["roughness"]));
    refused(folder.path(), &["apply", "p.json", "specular=0.06"], 2, &["roughness=0.1 to 0.3"]);
    refused(
        folder.path(),
        &["apply", "p.json", "specula=0.06", "roughness=0.1"],
        2,
        &["did you mean 'specular'?"],
    );

    let inspected = json(folder.path(), &["inspect", "p.json", "--json"]);
    assert_eq!((inspected["entries"].as_u64(), inspected["metric"]["mask"].as_bool()), (Some(6), Some(true)));
    let judged = json(folder.path(), &["validate", "p.json", "--points", "2", "--size", "48", "--json"]);
    let methods: Vec<&str> =
        judged[0]["methods"].as_array().unwrap().iter().map(|m| m["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["probe", "copy", "copy, no Fresnel"]);
    assert_eq!(judged[0]["points"], 2);
}

#[test]
fn equal_models_map_onto_themselves() {
    let folder = TempDir::new().unwrap();
    let jobs: [&[&str]; 2] = [
        &["remap", "ggx", "ggx", "--vary", "ior=1.3:1.9:0.3", "--vary", "roughness=0.05:0.45:0.2"],
        &["remap", "ward", "ward", "--vary", "specular=0.05:0.25:0.1", "--vary", "roughness=0.05:0.45:0.2"],
    ];
    for job in jobs {
        for strategy in ["constrained", "unconstrained"] {
            json(
                folder.path(),
                &with(job, &["--size", "24", "--strategy", strategy, "-o", "same.json", "--json"]),
            );
            let probe: Json =
                serde_json::from_str(&std::fs::read_to_string(folder.path().join("same.json")).unwrap())
                    .unwrap();
            for entry in probe["entries"].as_array().unwrap() {
                let target = entry["target"].as_array().unwrap();
                assert_eq!(entry["fitness"], 0.0, "{entry}");
                // GGX has its switch before the two searched values.
                assert_eq!(entry["source"].as_array().unwrap()[..], target[target.len() - 2..], "{entry}");
            }
        }
    }
}

#[test]
fn an_interrupted_remap_goes_on_where_it_stopped() {
    let folder = TempDir::new().unwrap();
    let job = [
        "remap",
        "ward",
        "ggx",
        "--size",
        "32",
        "--vary",
        "specular=0.02:0.4:0.02",
        "--fix",
        "roughness=0.2",
    ];
    let mut child =
        program(folder.path()).args(with(&job, &["-o", "p.json"])).stderr(Stdio::null()).spawn().unwrap();
    let state = folder.path().join("p.json.partial");
    let lines = || std::fs::read_to_string(&state).map_or(0, |text| text.lines().count());
    while lines() < 3 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let code = child.wait().unwrap().code();
    // On a fast machine the work may be over before the signal arrives.
    if code != Some(0) {
        assert_eq!(code, Some(1));
        assert!(lines() >= 3 && !folder.path().join("p.json").exists());
        let resumed = lookmatch(folder.path(), &with(&job, &["-o", "p.json"]));
        assert!(resumed.status.success());
    }
    json(folder.path(), &with(&job, &["-o", "whole.json", "--json"]));
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("p.json"), read("whole.json"));
}

#[test]
fn bad_requests_are_refused_with_what_would_be_accepted() {
    let folder = TempDir::new().unwrap();
    let render = |more: &[&'static str]| with(&["render", "reference", "--size", "8", "-o", "out.exr"], more);
    let of = folder.path();
    refused(of, &render(&["--material", "wrad"]), 2, &["did you mean 'ward'?"]);
    refused(of, &render(&["--material", "ward:roughness=2"]), 2, &["roughness_u", "[0.001, 1]"]);
    refused(of, &render(&["--material", "ward:specular=nan"]), 2, &["specular", "[0, 1]"]);
    refused(of, &render(&["--material", "missing.json"]), 1, &["missing.json"]);
    refused(of, &render(&["--material", "ward", "--light", "sun"]), 2, &["point, env, env:FILE or all"]);
    refused(of, &render(&["--material", "ward", "--light", "env:none.exr"]), 1, &["none.exr"]);
    refused(
        of,
        &["render", "reference", "--material", "ward", "--size", "0", "-o", "out.exr"],
        1,
        &["1 to 8192"],
    );
    refused(
        of,
        &["render", "reference", "--material", "ward", "--size", "8", "-o", "out.jpg"],
        1,
        &[".exr or .png"],
    );
    refused(of, &["render", "reference", "--material", "ward", "-o", "no/out.exr"], 1, &["no folder"]);
    refused(of, &["render", "scene.toml", "--material", "ward", "-o", "out.exr"], 1, &["scene.toml"]);
    refused(of, &["remap", "ward", "ggx", "--vary", "ior=1.5", "-o", "p.json"], 2, &["NAME=MIN:MAX:STEP"]);
    refused(
        of,
        &["remap", "ward", "ggx", "--vary", "roughness=0.5:0.1:0.1", "-o", "p.json"],
        2,
        &["roughness"],
    );
    refused(
        of,
        &["remap", "ward", "ggx", "--vary", "roughness=0:0.5:0.1", "-o", "p.json"],
        2,
        &["[0.001, 1]"],
    );
    refused(of, &["remap", "ward", "ggx", "--fix", "ro=0.1", "-o", "p.json"], 2, &["parameter 'ro'"]);
    refused(of, &["remap", "ward", "ggx", "--search", "exaustive", "-o", "p.json"], 2, &["exhaustive"]);
    refused(of, &["remap", "ward", "ggx", "--size", "1", "-o", "p.json"], 2, &["16 to 2048"]);
    let both = [
        "remap",
        "ward",
        "ggx",
        "--vary",
        "roughness=0.1:0.3:0.1",
        "--fix",
        "roughness_u=0.1",
        "-o",
        "p.json",
    ];
    refused(of, &both, 2, &["'roughness' and 'roughness_u' both set roughness_u"]);
    refused(
        of,
        &["compare", "--source", "ward", "--target", "ggx", "--size", "0", "-o", "pair"],
        1,
        &["1 to 8192"],
    );
    refused(of, &["apply", "none.json", "specular=0.1"], 1, &["none.json"]);
    let left: Vec<_> = std::fs::read_dir(of).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(left.is_empty(), "failures left {left:?} behind");
}

#[test]
fn damaged_pictures_are_refused() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    let map = lookmatch_imaging::Image::from_fn(8, 4, |x, y| [x as f32, y as f32, 1.0]);
    lookmatch_imaging::write(&of.join("map.exr"), &map, &[]).unwrap();
    let render = |light: &'static str| {
        ["render", "reference", "--material", "ward", "--size", "8", "--light", light, "-o", "o.exr"]
    };
    assert!(lookmatch(of, &render("env:map.exr")).status.success());
    let bytes = std::fs::read(of.join("map.exr")).unwrap();
    std::fs::write(of.join("cut.exr"), &bytes[..bytes.len() / 2]).unwrap();
    refused(of, &render("env:cut.exr"), 1, &["cut.exr"]);
    let square = lookmatch_imaging::Image::new(4, 4);
    lookmatch_imaging::write(&of.join("square.exr"), &square, &[]).unwrap();
    refused(of, &render("env:square.exr"), 1, &["square.exr", "4 x 4", "twice as wide"]);
    std::fs::write(of.join("text.hdr"), "not a picture").unwrap();
    refused(of, &render("env:text.hdr"), 1, &["text.hdr"]);
}

#[test]
fn damaged_probes_are_refused() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    let tiny =
        ["remap", "ward", "ggx", "--size", "16", "--vary", "specular=0.1:0.1:0.1", "--fix", "roughness=0.2"];
    json(of, &with(&tiny, &["-o", "p.json", "--json"]));
    let good: Json = serde_json::from_str(&std::fs::read_to_string(of.join("p.json")).unwrap()).unwrap();
    let damaged = |change: &dyn Fn(&mut Json), words: &[&str]| {
        let mut probe = good.clone();
        change(&mut probe);
        std::fs::write(of.join("bad.json"), probe.to_string()).unwrap();
        refused(of, &["inspect", "bad.json"], 1, &[&["bad.json"], words].concat());
    };
    damaged(&|p| p["version"] = 2.into(), &["version is 2", "up to 1"]);
    damaged(&|p| p["format"] = "recipe".into(), &["lookmatch-probe"]);
    damaged(&|p| drop(p.as_object_mut().unwrap().remove("entries")), &["missing field", "entries"]);
    damaged(&|p| drop(p.as_object_mut().unwrap().remove("preset")), &["missing field", "preset"]);
    damaged(&|p| p["entries"] = serde_json::json!([]), &["0 entries", "1 points"]);
    damaged(&|p| p["from"]["model"] = "wrad".into(), &["did you mean 'ward'?"]);
    damaged(&|p| p["entries"][0]["target"][1] = 0.5.into(), &["ior", "outside its range"]);
    damaged(&|p| p["entries"][0]["source"][0] = 0.3.into(), &["entry 0", "out of order"]);
    damaged(&|p| p["entries"][0]["target"][0] = 0.5.into(), &["entry 0", "off the target axes"]);
    damaged(&|p| p["entries"][0]["fitness"] = Json::Null, &["fitness"]);
    std::fs::write(of.join("cut.json"), "{\"format\": \"lookmatch-probe\"").unwrap();
    refused(of, &["apply", "cut.json", "specular=0.1"], 1, &["cut.json", "not JSON"]);
}

/// Keys of the benchmark's document that scripts rely on.
const FIGURES: [&str; 8] = [
    "image_pair_cpu_ms",
    "single_pair_cpu_ms",
    "prepare_cpu_s",
    "metric_ms",
    "metric_cached_ms",
    "mean_delta_e",
    "worst_delta_e",
    "noise_delta_e",
];

/// Checks that figures are there, finite and above 0.
fn has_figures(report: &Json, figures: &[&str]) {
    for key in figures {
        assert!(report[key].as_f64().is_some_and(|v| v.is_finite() && v > 0.0), "{key}: {}", report[key]);
    }
}

#[test]
fn the_benchmark_measures_what_it_promises() {
    let folder = TempDir::new().unwrap();
    let report = json(folder.path(), &["bench", "--quick", "--json", "-o", "performance.md"]);
    has_figures(&report, &FIGURES);
    let materials = report["materials"].as_array().unwrap();
    assert!(materials.len() >= 30);
    assert!(materials.iter().all(|m| m["environment"]["mean_delta_e"].as_f64().unwrap() > 0.0));
    assert_eq!(report["effort"]["samples"], 16);
    assert!(report.get("peer").is_none());
    let document = std::fs::read_to_string(folder.path().join("performance.md")).unwrap();
    assert!(document.contains("| ggx-conductor, gold, α = 0.3 |"), "{document}");
}

/// Installs Mitsuba from the Python package index: `cargo xtask test` runs it, and so does `cargo test -- --ignored`.
#[test]
#[ignore = "installs a renderer"]
fn the_benchmark_compares_with_mitsuba() {
    let folder = TempDir::new().unwrap();
    let command = ["bench", "--quick", "--samples", "64", "--peer", "mitsuba", "--json"];
    let report = json(folder.path(), &command);
    has_figures(&report, &FIGURES);
    has_figures(&report, &["equal_error_ratio"]);
    let comparisons = report["peer"]["comparisons"].as_array().unwrap();
    assert_eq!(comparisons.len(), 2);
    for comparison in comparisons {
        has_figures(comparison, &["equal_error_cpu_s", "equal_error_ratio_single", "image_cpu_ms"]);
        // Two path tracers that share nothing but the scene.
        let brightness = comparison["bias"]["brightness"].as_f64().unwrap();
        assert!(
            brightness.abs() < 0.03,
            "{}: Mitsuba's pictures are {brightness} brighter",
            comparison["name"]
        );
    }
}

#[test]
fn bad_benchmarks_are_refused() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    refused(of, &["bench", "--peer", "blender"], 2, &["blender", "mitsuba"]);
    refused(of, &["bench", "--samples", "0"], 2, &["--samples", "0"]);
    refused(of, &["bench", "--peer-folder", "here"], 2, &["--peer"]);
    refused(of, &["bench", "--quick", "-o", "no/performance.md"], 1, &["no folder"]);
    std::fs::write(of.join("file"), "").unwrap();
    refused(of, &["bench", "--quick", "--peer", "mitsuba", "--peer-folder", "file/x"], 1, &["file/x"]);
    let output = program(of)
        .env("PATH", "")
        .args(["bench", "--quick", "--peer", "mitsuba", "--peer-folder", "peer"])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && message.contains("found none on the PATH"), "{message}");
}

#[test]
fn the_page_of_the_catalogue_is_current() {
    let folder = TempDir::new().unwrap();
    let page = lookmatch(folder.path(), &["models", "--markdown"]);
    let kept = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/models.md")).unwrap();
    assert!(page.stdout == kept, "run: cargo run --release -- models --markdown > docs/models.md");
}

#[test]
fn named_materials_are_sources_of_their_own() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    for (source, lost) in [("low-abc@gold-metallic-paint", false), ("merl@red-plastic", false)] {
        let made = json(of, &["remap", source, "ggx", "--quick", "--size", "24", "-o", "p.json", "--json"]);
        assert_eq!(made["source_points"], 1, "{source}");
        let is_lost = |loss: &Json| loss["class"] == "lost";
        assert_eq!(made["losses"].as_array().unwrap().iter().any(is_lost), lost, "{source}");
        let applied = json(of, &["apply", "p.json", "--json"]);
        assert_eq!(applied["target"]["model"], "ggx");
    }
    let listed = lookmatch(of, &["models", "low-abc"]);
    assert!(String::from_utf8_lossy(&listed.stdout).contains("low-abc@chrome "));
    refused(of, &["remap", "low-abc@chromee", "ggx", "-o", "p.json"], 2, &["did you mean 'chrome'?"]);
    refused(of, &["remap", "ggx", "merl", "-o", "p.json"], 2, &["merl", "only be a source"]);
}

#[test]
fn what_a_target_cannot_show_is_said() {
    let folder = TempDir::new().unwrap();
    let job = |from: &'static str, to: &'static str| {
        let made =
            json(folder.path(), &["remap", from, to, "--quick", "--size", "16", "-o", "p.json", "--json"]);
        let losses = made["losses"].as_array().unwrap().clone();
        move |parameter: &str| {
            let loss = losses.iter().find(|loss| loss["parameter"] == parameter);
            loss.map(|loss| (loss["class"].as_str().unwrap().to_owned(), loss["nrmsd"].is_array()))
        }
    };
    let brushed = job("ward:roughness_u=0.1,roughness_v=0.4,specular=0.1", "phong");
    assert_eq!(brushed("roughness_v"), Some(("lost".into(), true)));
    assert_eq!(brushed("diffuse"), Some(("exact".into(), false)));
    assert_eq!(brushed("specular"), Some(("bounded".into(), true)));
    let coated =
        job("openpbr:coat_weight=0.5,fuzz_weight=0.3,specular_ior=1.5,specular_roughness=0.4", "gltf");
    assert_eq!(coated("coat_weight"), Some(("bounded".into(), true)));
    assert_eq!(coated("coat_darkening"), Some(("lost".into(), true)));
    assert_eq!(coated("base_diffuse_roughness"), None, "what does not show is not told");
    let plain = job("openpbr:coat_weight=0.5,specular_ior=1.5,specular_roughness=0.4", "ggx");
    assert_eq!(plain("coat_weight"), Some(("lost".into(), true)));
}

#[test]
fn pairs_are_scored_and_a_stopped_run_goes_on() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    let job = ["pairs", "ward", "lambert", "merl", "gltf", "--size", "16", "-o", "pairs", "--json"];
    let run = json(of, &job);
    let pairs = run["pairs"].as_array().unwrap();
    // Every ordered pair of different models, but none to measured materials.
    assert_eq!(pairs.len(), 9);
    let finite =
        |pair: &Json| ["probe", "copy", "probe_masked", "copy_masked"].iter().all(|k| pair[k].is_number());
    assert!(pairs.iter().all(finite), "{run}");
    let svg = std::fs::read_to_string(of.join("pairs/pairs.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.matches("<title>").count() == 18);
    assert!(std::fs::read_to_string(of.join("pairs/pairs.md")).unwrap().contains("| **merl** |"));
    // What is known is not worked out again.
    let kept = of.join("pairs/pairs.json");
    let text = std::fs::read_to_string(&kept).unwrap();
    std::fs::write(&kept, text.replacen("\"points\": 25", "\"points\": 37", 1)).unwrap();
    let again = json(of, &job);
    assert_eq!(again["pairs"].as_array().unwrap().iter().filter(|pair| pair["points"] == 37).count(), 1);
    refused(of, &["pairs", "merl", "-o", "pairs"], 2, &["none of the models can be a target"]);
    refused(of, &["pairs", "ward", "merl-file", "-o", "pairs"], 2, &["merl-file", "needs a file"]);
    refused(
        of,
        &["cross", "ward-ggx", "-o", "cross"],
        2,
        &["ward-ggx", "there are roughplastic-principled,"],
    );
}

#[test]
fn measurements_that_cannot_be_read_are_refused() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    std::fs::write(of.join("short.binary"), [90u8, 0, 0, 0, 90]).unwrap();
    let render =
        |material: &'static str| ["render", "reference", "--size", "8", "-o", "a.png", "-m", material];
    refused(of, &render("merl-file"), 2, &["file=PATH", "90 x 90 x 180"]);
    refused(of, &render("merl-file:file=none.binary"), 1, &["none.binary"]);
    refused(of, &render("merl-file:file=short.binary"), 1, &["short.binary"]);
    refused(of, &render("ggx-conductor:conductor=gld"), 2, &["did you mean 'gold'?"]);
    refused(of, &render("lafortune:weight=1/2,exponent=1/2/3"), 2, &["weight has 2 numbers for 3 lobes"]);
    refused(of, &render("merl:material=red-plastik"), 2, &["did you mean 'red-plastic'?"]);
}

#[test]
fn a_scene_is_exported_for_every_renderer() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    for (format, file) in [
        ("obj+exr", "scene.obj"),
        ("mitsuba", "scene.xml"),
        ("blender", "scene.py"),
        ("usd", "scene.usda"),
        ("gltf", "scene.bin"),
    ] {
        let made =
            json(of, &["scene", "export", "spheres", "--to", format, "--size", "48", "-o", "out", "--json"]);
        assert_eq!((made["scene"].as_str(), made["format"].as_str()), (Some("spheres"), Some(format)));
        let files: Vec<&str> =
            made["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
        for name in [file, "README.txt", "environment.exr"] {
            assert!(files.iter().any(|f| f.ends_with(name)), "no {name} in {files:?}");
        }
        assert!(files.iter().all(|f| of.join(f).is_file()));
    }
    refused(of, &["scene", "export", "--to", "pov", "-o", "out"], 2, &["'pov'", "obj+exr", "blender"]);
    refused(
        of,
        &["scene", "export", "none.toml", "--to", "usd", "-o", "out"],
        1,
        &["none.toml", "reference"],
    );
    refused(of, &["scene", "export", "--to", "usd", "--size", "0", "-o", "out"], 1, &["1 to 8192"]);
    std::fs::write(of.join("file"), "").unwrap();
    refused(of, &["scene", "export", "--to", "usd", "-o", "file"], 1, &["cannot write 'file'"]);
}

#[test]
fn mistakes_in_numbers_are_explained() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    let found = json(of, &["lint", "gltf:roughness=60,base_color=200/100/50", "--json"]);
    let rules: Vec<&str> =
        found["findings"].as_array().unwrap().iter().map(|f| f["rule"].as_str().unwrap()).collect();
    assert_eq!(rules, ["exponent-as-roughness", "eight-bit-colour"]);
    assert_eq!(found["suggestion"], "gltf:roughness=0.4238,base_color=0.5776/0.1274/0.0319");
    let text = lookmatch(of, &["lint", "ggx:ior=0.04"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("fix: ior=1.5") && text.contains("suggested: ggx:ior=1.5"), "{text}");
    let clean = lookmatch(of, &["lint", "ggx"]);
    assert!(clean.status.success() && String::from_utf8_lossy(&clean.stdout).contains("nothing suspicious"));

    let like =
        json(of, &["lint", "ward:roughness=0.8", "--like", "ward:roughness=0.2", "--size", "24", "--json"]);
    assert_eq!(like["explanation"]["explanations"][0]["material"], "ward:roughness=0.2");
    refused(of, &["lint", "wrad:roughness=60"], 2, &["did you mean 'ward'?"]);
    refused(of, &["lint", "ward:roughness=wide"], 2, &["a number in"]);
    refused(of, &["lint", "ward", "--like", "ward:roughness=60"], 2, &["outside its range"]);
    refused(of, &["lint", "ward", "--like", "ward", "--size", "4"], 2, &["16..=1024"]);
    refused(of, &["lint", "none.json"], 1, &["none.json"]);
}
