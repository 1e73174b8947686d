//! From tables to smooth functions, inverses, chains and pictures of probes, as a user makes them.

mod support;

use std::path::Path;

use serde_json::Value as Json;
use tempfile::TempDir;

use support::{json, lookmatch, refused};

/// A folder where light that one command prepares is kept for the next.
fn lit_folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    std::fs::create_dir(folder.path().join("light")).unwrap();
    folder
}

/// A probe of 5 × 5 source points from tiny pictures.
fn remap(folder: &Path, from: &str, to: &str, output: &str) -> Json {
    json(folder, &["remap", from, to, "--quick", "--mask", "--size", "32", "-o", output, "--json"])
}

fn read(folder: &Path, name: &str) -> Json {
    serde_json::from_str(&std::fs::read_to_string(folder.join(name)).unwrap()).unwrap()
}

/// A probe without what a remap fits to it, as older programs wrote them.
fn strip(folder: &Path, name: &str, output: &str) {
    let mut probe = read(folder, name);
    assert!(probe.as_object_mut().unwrap().remove("fit").is_some(), "a remap fits its probe");
    std::fs::write(folder.join(output), probe.to_string()).unwrap();
}

#[test]
fn a_probe_is_fitted_inverted_and_composed() {
    let folder = lit_folder();
    let of = folder.path();
    remap(of, "ward", "ggx", "ab.json");
    let fit = &read(of, "ab.json")["fit"];
    let roughness = &fit["parameters"][2];
    assert_eq!(roughness["depends_on"], serde_json::json!(["roughness"]), "{roughness}");
    assert_eq!(fit["parameters"][0]["closed"]["function"]["degree"], 0, "a lobe that is always on");
    let rendered = &fit["rerendered"];
    assert_eq!(rendered["points"], 25);
    let [table, smooth] = ["table", "fit"].map(|name| rendered[name].as_f64().unwrap());
    assert!(table > 0.0 && smooth < 1.5 * table + 1e-3, "{rendered}");

    strip(of, "ab.json", "old.json");
    let values = ["specular=0.1", "roughness=0.25", "--json"];
    let apply = |probe: &str, more: &[&str]| json(of, &[&["apply", probe], &values[..], more].concat());
    let old = apply("old.json", &[]);
    assert_eq!(old["forms"]["roughness"], "table");
    assert_eq!(old["target"], apply("ab.json", &[])["target"]);
    let new = apply("ab.json", &["--smooth"]);
    assert!(new["forms"]["roughness"].as_str().unwrap().contains("polynomial"), "{new}");
    let number = |applied: &Json, name: &str| applied["target"][name].as_f64().unwrap();
    assert!((number(&new, "roughness_u") - number(&old, "roughness_u")).abs() < 0.03);
    let told = lookmatch(of, &["apply", "ab.json", "specular=0.1", "roughness=0.25", "--smooth"]);
    assert!(
        String::from_utf8_lossy(&told.stderr).contains("roughness: polynomial"),
        "says which form gave it"
    );

    // What a remap fits is what `fit` fits.
    json(of, &["fit", "old.json", "-o", "again.json", "--json"]);
    assert_eq!(read(of, "again.json")["fit"], read(of, "ab.json")["fit"]);
    let text = String::from_utf8(lookmatch(of, &["inspect", "again.json"]).stdout).unwrap();
    assert!(text.contains("roughness is a function of roughness alone"), "{text}");
    assert!(text.contains("25 entries rendered again at 32 px"), "{text}");

    let inverse = json(of, &["invert", "ab.json", "-o", "ba.json", "--json"]);
    for trip in inverse["derived"]["round_trip"].as_array().unwrap() {
        assert!(trip["mean"].as_f64().unwrap() < 0.01 && trip["entries"] == 25, "{trip}");
    }
    assert_eq!(inverse["derived"]["measured"], true);
    let chain = apply("ab.json", &["--smooth", "--then", "ba.json"]);
    let home = chain["target"]["specular"][0].as_f64().unwrap();
    assert!((home - 0.1).abs() < 0.01 && (number(&chain, "roughness_u") - 0.25).abs() < 0.01, "{chain}");
    refused(of, &["apply", "ba.json", "ior=9", "roughness=0.2"], 2, &["ior = 9", "--clamp"]);

    let both = json(of, &["compose", "ab.json", "ba.json", "-o", "aa.json", "--json"]);
    assert_eq!((&both["derived"]["kind"], &both["failed"]), (&"composition".into(), &0.into()));
    let once = json(of, &["apply", "aa.json", "specular=0.12", "roughness=0.35", "--json"]);
    let twice =
        ["apply", "ab.json", "specular=0.12", "roughness=0.35", "--smooth", "--then", "ba.json", "--json"];
    assert_eq!(once["target"], json(of, &twice)["target"]);
    refused(of, &["compose", "ab.json", "ab.json", "-o", "x.json"], 2, &["leads to ggx", "starts from ward"]);
    let wrong = ["apply", "ab.json", "specular=0.12", "roughness=0.35", "--then", "ab.json"];
    refused(of, &wrong, 2, &["ward", "ggx"]);
    refused(of, &["invert", "none.json", "-o", "x.json"], 1, &["none.json"]);
    assert!(!of.join("x.json").exists());
}

/// The pixels of a PNG, with its size.
fn pixels(path: &Path) -> (u32, u32, Vec<u8>) {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (info.width, info.height, pixels)
}

#[test]
fn probes_are_drawn() {
    let folder = lit_folder();
    let of = folder.path();
    remap(of, "ward", "as", "plane.json");
    remap(of, "as", "beckmann-conductor", "line.json");
    let fixed = ["--vary", "specular=0.04:0.08:0.04", "--vary", "roughness_u=0.1:0.2:0.1"];
    let more = ["--vary", "roughness_v=0.1:0.3:0.1", "--size", "16", "-o", "space.json", "--json"];
    json(of, &[&["remap", "ward", "ggx", "--mask"], &fixed[..], &more].concat());
    for name in ["plane", "line", "space"] {
        let (probe, png, svg) = (format!("{name}.json"), format!("{name}.png"), format!("{name}.svg"));
        json(of, &["inspect", &probe, "--plot", &png, "--json"]);
        let (width, height, pixels) = pixels(&of.join(&png));
        assert!(width > 1000 && height > 500);
        let mut colours: Vec<&[u8]> = pixels.chunks(3).collect();
        colours.sort_unstable();
        colours.dedup();
        assert!(colours.len() > 20, "{name}: more than paper and ink");
        assert!(lookmatch(of, &["inspect", &probe, "--plot", &svg]).status.success());
        let text = std::fs::read_to_string(of.join(&svg)).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{name}");
        for word in ["NRMSD", "roughness", "[1]"] {
            assert!(text.contains(word), "{name}: no '{word}'");
        }
    }
    refused(of, &["inspect", "line.json", "--plot", "x.jpg"], 2, &["x.jpg", ".png or .svg"]);
    refused(of, &["inspect", "line.json", "--plot", "none/x.png"], 1, &["none"]);
}
