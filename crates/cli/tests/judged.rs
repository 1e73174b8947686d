//! Would anybody see it? What `compare` and `validate` say of pictures.

mod support;

use lookmatch_imaging::{Image, write};
use serde_json::Value as Json;
use tempfile::TempDir;

use support::{json, lookmatch, refused};

const NAMES: [&str; 11] = [
    "delta_e_76_mean",
    "delta_e_76_p95",
    "delta_e_76_max",
    "delta_e_2000_mean",
    "delta_e_2000_p95",
    "delta_e_2000_max",
    "gsm",
    "ssim",
    "flip",
    "hdr_flip",
    "jod",
];

/// A ball of some brightness before a wall whose left half differs as well.
fn ball(gain: f32, wall: f32) -> Image {
    Image::from_fn(64, 64, |x, y| {
        let r = (x as f32 - 32.0).hypot(y as f32 - 32.0);
        if r < 16.0 { [0.6 * gain, 0.3 * gain, 0.1] } else { [if x < 8 { wall } else { 0.2 }; 3] }
    })
}

fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    let kept = |name: &str, image: &Image| write(&folder.path().join(name), image, &[]).unwrap();
    kept("a.exr", &ball(1.0, 0.2));
    kept("near.exr", &ball(1.003, 0.2));
    kept("far.exr", &ball(1.5, 0.2));
    kept("wall.exr", &ball(1.0, 0.8));
    kept("flat.exr", &Image::from_fn(64, 64, |_, _| [0.5; 3]));
    kept("tiny.exr", &Image::from_fn(3, 3, |x, _| [x as f32; 3]));
    kept("right.exr", &Image::from_fn(64, 64, |x, _| [if x < 16 { 0.0 } else { 1.0 }; 3]));
    folder
}

fn number(judged: &Json, name: &str, kind: &str) -> f64 {
    let metric = judged["metrics"].as_array().unwrap().iter().find(|metric| metric["name"] == name).unwrap();
    metric[kind].as_f64().unwrap_or_else(|| panic!("{name}: {metric}"))
}

#[test]
fn two_pictures_are_judged() {
    let folder = folder();
    let judged = |target: &str| json(folder.path(), &["compare", "a.exr", target, "--json"]);
    let [equal, near, far] = ["a.exr", "near.exr", "far.exr"].map(judged);
    let names: Vec<&str> =
        equal["metrics"].as_array().unwrap().iter().map(|m| m["name"].as_str().unwrap()).collect();
    assert_eq!(names, NAMES);
    for metric in equal["metrics"].as_array().unwrap() {
        assert!(["unit", "viewing", "better", "title"].iter().all(|key| metric[key].is_string()), "{metric}");
        let best = match metric["name"].as_str().unwrap() {
            "jod" => 10.0,
            "gsm" | "ssim" => 1.0,
            _ => 0.0,
        };
        assert!(
            (metric["whole"].as_f64().unwrap() - best).abs() < 1e-6 && metric["masked"].is_null(),
            "{metric}"
        );
    }
    assert_eq!(
        [&equal, &near, &far].map(|j| j["verdict"].as_str().unwrap()),
        ["indistinguishable", "indistinguishable", "noticeably different"]
    );
    assert_eq!(equal["share_choosing_correctly"], 0.5);
    assert!(far["share_choosing_correctly"].as_f64().unwrap() >= 0.75);
    assert!(far["nrmsd"][0].as_f64().unwrap() > near["nrmsd"][0].as_f64().unwrap());
    let text = lookmatch(folder.path(), &["compare", "a.exr", "far.exr"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    for word in [
        "NRMSD",
        "ΔE2000, 95 %",
        "HDR-FLIP",
        "75 pixels per degree",
        "67 pixels",
        "verdict: noticeably different",
    ] {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
}

#[test]
fn masks_decide_what_counts() {
    let folder = folder();
    for mask in ["disc", "32,32,20", "right.exr"] {
        let judged = json(folder.path(), &["compare", "a.exr", "wall.exr", "--mask", mask, "--json"]);
        for (name, most) in [("delta_e_76_mean", 1.0), ("flip", 0.03)] {
            let [whole, masked] = ["whole", "masked"].map(|kind| number(&judged, name, kind));
            assert!(masked < most && masked < 0.5 * whole, "{mask}, {name}: {whole}, {masked}");
        }
        assert!(number(&judged, "jod", "masked") > number(&judged, "jod", "whole"), "{mask}");
        assert!(judged["nrmsd_masked"][0].as_f64().unwrap() < judged["nrmsd"][0].as_f64().unwrap());
    }
}

#[test]
fn maps_are_written_and_small_or_flat_pictures_have_what_they_can() {
    let folder = folder();
    json(folder.path(), &["compare", "a.exr", "far.exr", "-o", "maps", "--json"]);
    for file in ["error.png", "flip.png", "side-by-side.png", "result.json"] {
        assert!(folder.path().join("maps").join(file).is_file(), "{file}");
    }
    let tiny = json(folder.path(), &["compare", "tiny.exr", "tiny.exr", "--json"]);
    assert!(tiny["verdict"].is_null() && tiny["metrics"][7]["whole"].is_null());
    assert_eq!(number(&tiny, "flip", "whole"), 0.0);
    let flat = json(folder.path(), &["compare", "flat.exr", "a.exr", "--json"]);
    assert!(flat["nrmsd"].is_null() && number(&flat, "delta_e_76_mean", "whole") > 1.0);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = folder();
    let of = folder.path();
    refused(of, &["compare", "a.exr", "tiny.exr"], 1, &["a.exr", "tiny.exr", "64 x 64", "3 x 3"]);
    refused(of, &["compare", "a.exr", "none.exr"], 1, &["none.exr"]);
    refused(of, &["compare", "a.exr"], 2, &["TARGET"]);
    refused(of, &["compare", "a.exr", "far.exr", "--source", "ward"], 2, &["--source"]);
    refused(of, &["compare"], 2, &["--source"]);
    refused(of, &["compare", "--source", "ward", "--target", "ggx"], 2, &["--output"]);
    let masked = ["compare", "--source", "ward", "--target", "ggx", "-o", "out", "--mask", "disc"];
    refused(of, &masked, 2, &["--mask disc", "two pictures"]);
    refused(of, &["compare", "a.exr", "far.exr", "--mask", "1,2"], 2, &["150,150,120"]);
    refused(of, &["compare", "a.exr", "far.exr", "--mask", "tiny.exr"], 1, &["--mask tiny.exr", "3 x 3"]);
    refused(of, &["compare", "a.exr", "far.exr", "--mask", "500,500,3"], 1, &["mask"]);
    refused(of, &["validate", "p.json", "--metric-points", "some"], 2, &["all"]);
}

#[test]
fn materials_and_probes_are_judged_by_the_same_metrics() {
    let folder = folder();
    let of = folder.path();
    let pair =
        ["compare", "--source", "ggx:roughness=0.1", "--target", "ggx:roughness=0.4", "--light", "point"];
    let pair = [&pair[..], &["--scene", "reference", "--size", "48", "-o", "pair", "--json"]].concat();
    let judged = json(of, &pair);
    assert_eq!(judged["metrics"].as_array().unwrap().len(), NAMES.len());
    assert!(judged["verdict"].is_string() && judged["nrmsd_masked"].is_array());
    assert!(of.join("pair/flip.png").is_file());

    let remap =
        ["remap", "ward", "ggx", "--vary", "specular=0.04:0.08:0.04", "--vary", "roughness=0.1:0.3:0.1"];
    json(of, &[&remap[..], &["--size", "24", "-o", "p.json", "--json"]].concat());
    let validate =
        |more: &[&str]| json(of, &[&["validate", "p.json", "--size", "32", "--json"], more].concat());
    let judged = &validate(&["--metric-points", "4"])[0];
    assert_eq!((judged["points"].as_u64(), judged["metric_points"].as_u64()), (Some(6), Some(4)));
    assert_eq!(judged["metrics"].as_array().unwrap().len(), 7);
    for method in judged["methods"].as_array().unwrap() {
        let names: Vec<&str> =
            method["metrics"].as_array().unwrap().iter().map(|m| m["name"].as_str().unwrap()).collect();
        assert_eq!(names, NAMES);
        for metric in method["metrics"].as_array().unwrap() {
            assert!(metric["whole"]["mean"].is_number() && metric["masked"]["mean"].is_number(), "{metric}");
        }
        let verdicts = method["verdicts"].as_object().unwrap();
        assert_eq!(verdicts.values().map(|count| count.as_u64().unwrap()).sum::<u64>(), 4);
        assert!(method["whole"][0]["mean"].is_number(), "NRMSD is still there");
    }
    let text = lookmatch(of, &["validate", "p.json", "--size", "32", "--points", "3"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    for word in
        ["means over 3 source points", "ColorVideoVDP", "points indistinguishable", "pixels per degree"]
    {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
}
