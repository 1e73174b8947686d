//! The project's reference vectors for colour and metrics (`vectors_public.json`, schema in its README, sections 7 and 11).
//!
//! They lie beside the repository, not in it. Where they are missing, the tests say so and pass.

use lookmatch_imaging::{
    Fitness, Image, MEAN, Mask, ProbeImages, ProbePixels, Reduce, Space, delta_e76, delta_e2000, disc_weight,
    distance_correlation, gsm_of_greys, lab_from_linear_srgb, luma_255, nrmsd, nrmsd_pixels,
};
use serde_json::Value;
use std::io::Write;

const VECTORS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/conformance/vectors_public.json");

/// What f64 allows; the vectors were computed in f64 by another implementation.
const EXACT: f64 = 1e-9;
/// What images and masks of f32 allow: pixels rounded to 6e-8, amplified where colours nearly cancel.
const SINGLE: f64 = 1e-6;

/// The list `metrics.<name>`, or nothing (and a visible remark) where there are no vectors.
fn vectors(name: &str) -> Vec<Value> {
    let Ok(text) = std::fs::read_to_string(VECTORS) else {
        // Not `eprintln!`, which the test runner keeps to itself when a test passes.
        let _ = writeln!(std::io::stderr(), "SKIPPED metrics.{name}: no reference vectors at {VECTORS}");
        return Vec::new();
    };
    let all: Value = serde_json::from_str(&text).unwrap();
    let list = all["metrics"][name].as_array().unwrap().clone();
    assert!(!list.is_empty(), "metrics.{name} is empty");
    list
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn triple(value: &Value) -> [f64; 3] {
    [number(&value[0]), number(&value[1]), number(&value[2])]
}

/// Pixels of `[row][column][channel]`.
fn pixels(value: &Value) -> Vec<[f64; 3]> {
    let rows = value.as_array().unwrap().iter();
    rows.flat_map(|row| row.as_array().unwrap().iter().map(triple)).collect()
}

fn image(value: &Value) -> Image {
    let height = value.as_array().unwrap().len();
    let pixels: Vec<[f32; 3]> = pixels(value).into_iter().map(|pixel| pixel.map(|v| v as f32)).collect();
    Image::from_pixels(pixels.len() / height, height, pixels).unwrap()
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    let scale = expected.iter().fold(0.0_f64, |scale, value| scale.max(value.abs()));
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() <= tolerance * scale + 1e-12, "{what}: {found:?}, not {expected:?}");
    }
}

#[test]
fn lab() {
    for vector in vectors("lab") {
        let found = lab_from_linear_srgb(triple(&vector["rgb"]));
        assert_close(&found, &triple(&vector["lab"]), EXACT, "lab");
    }
}

#[test]
fn delta_e() {
    for vector in vectors("delta_e") {
        let found = delta_e76(triple(&vector["lab1"]), triple(&vector["lab2"]));
        assert_close(&[found], &[number(&vector["de76"])], EXACT, "ΔE76");
        let found = delta_e2000(triple(&vector["lab1"]), triple(&vector["lab2"]));
        assert_close(&[found], &[number(&vector["de2000"])], EXACT, "CIEDE2000");
    }
}

#[test]
fn mask() {
    for vector in vectors("mask") {
        let [cx, cy, r] = ["cx", "cy", "r"].map(|key| number(&vector[key]));
        let [width, height] = ["w", "h"].map(|key| vector[key].as_u64().unwrap() as usize);
        let disc = Mask::disc(width, height, cx, cy, r);
        for y in 0..height {
            for x in 0..width {
                let expected = [number(&vector["weight"][y][x])];
                let exact = disc_weight(x as f64 + 0.5, y as f64 + 0.5, cx, cy, r);
                assert_close(&[exact], &expected, EXACT, "disc_weight");
                let single = f64::from(disc.weights()[y * width + x]);
                assert_close(&[single], &expected, 1e-7, "Mask::disc");
            }
        }
    }
}

#[test]
fn nrmsd_of_channels() {
    for vector in vectors("nrmsd") {
        let (source, target) = (&vector["source"], &vector["target"]);
        let expected = triple(&vector["nrmsd"]);
        let exact = nrmsd_pixels(&pixels(source), &pixels(target), None).unwrap();
        assert_close(&exact, &expected, EXACT, "nrmsd_pixels");
        let single = nrmsd(&image(source), &image(target), None).unwrap();
        assert_close(&single, &expected, SINGLE, "nrmsd");
    }
}

#[test]
fn luma() {
    for vector in vectors("luma_255") {
        assert_close(&[luma_255(triple(&vector["rgb"]))], &[number(&vector["y"])], EXACT, "luma_255");
    }
}

#[test]
fn correlation_of_distances() {
    for vector in vectors("distance_correlation") {
        let list = |name: &str| vector[name].as_array().unwrap().iter().map(number).collect::<Vec<f64>>();
        let found = distance_correlation(&list("x"), &list("y")).unwrap();
        assert_close(&[found], &[number(&vector["dcor"])], EXACT, "distance correlation");
    }
}

#[test]
fn gradient_similarity() {
    for vector in vectors("gsm") {
        let rows = |name: &str| -> Vec<f64> {
            vector[name]
                .as_array()
                .unwrap()
                .iter()
                .flat_map(|row| row.as_array().unwrap())
                .map(number)
                .collect()
        };
        let (reference, distorted) = (rows("reference"), rows("distorted"));
        let width = vector["reference"][0].as_array().unwrap().len();
        for (key, divisor) in [("gsm", MEAN), ("gsm_divisor16", 16.0), ("gsm_divisor1", 1.0)] {
            let found = gsm_of_greys(&reference, &distorted, width, divisor).unwrap();
            assert_close(&[found], &[number(&vector[key])], EXACT, key);
        }
    }
}

fn probe_pixels(value: &Value) -> ProbePixels {
    ProbePixels {
        diffuse_point: pixels(&value["diffuse_pl"]),
        diffuse_environment: pixels(&value["diffuse_em"]),
        full_point: pixels(&value["full_pl"]),
        full_environment: pixels(&value["full_em"]),
    }
}

fn probe_images(value: &Value) -> ProbeImages {
    ProbeImages {
        diffuse_point: image(&value["diffuse_pl"]),
        diffuse_environment: image(&value["diffuse_em"]),
        full_point: image(&value["full_pl"]),
        full_environment: image(&value["full_em"]),
    }
}

/// The reading of equation 3 that a key such as `lab/rms/masked` stands for, and whether it is masked.
fn reading(key: &str) -> (Fitness, bool) {
    let parts: Vec<&str> = key.split('/').collect();
    let space: Space = serde_json::from_value(parts[0].into()).unwrap();
    let reduce: Reduce = serde_json::from_value(parts[1].into()).unwrap();
    (Fitness { space, reduce, ..Fitness::default() }, parts.get(2) == Some(&"masked"))
}

#[test]
fn fitness_in_all_readings() {
    for vector in vectors("fitness") {
        let (source, target) = (&vector["source"], &vector["target"]);
        let [cx, cy, r] = ["cx", "cy", "r"].map(|key| number(&vector["mask"][key]));
        let exact = [probe_pixels(source), probe_pixels(target)];
        let single = [probe_images(source), probe_images(target)];
        let (width, height) = (single[0].full_point.width(), single[0].full_point.height());
        let weights: Vec<f64> = (0..width * height)
            .map(|i| ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5))
            .map(|(x, y)| disc_weight(x, y, cx, cy, r))
            .collect();
        let disc = Mask::disc(width, height, cx, cy, r);
        let values = vector["values"].as_object().unwrap();
        assert_eq!(values.len(), 12);
        for (key, expected) in values {
            let (fitness, masked) = reading(key);
            let weights = masked.then_some(&weights[..]);
            let found = fitness.evaluate_pixels(&exact[0], &exact[1], weights).unwrap();
            assert_close(&[found], &[number(expected)], EXACT, key);
            let found = fitness.evaluate(&single[0], &single[1], masked.then_some(&disc)).unwrap();
            assert_close(&[found], &[number(expected)], SINGLE, key);
        }
    }
}
