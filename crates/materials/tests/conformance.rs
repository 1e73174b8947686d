//! The public conformance vectors, where they lie beside the project.

use std::path::Path;

use lookmatch_materials::distribution::{Distribution, Shape};
use lookmatch_materials::fresnel::Fresnel;
use lookmatch_materials::masking::smith_lambda;
use lookmatch_materials::{Geometry, conformance};
use serde_json::Value as Json;

/// The vectors; `None`, said aloud, where the project was cloned without them.
fn vectors() -> Option<Json> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/conformance/vectors_public.json");
    match std::fs::read_to_string(&path) {
        Ok(text) => Some(serde_json::from_str(&text).unwrap()),
        Err(_) => {
            eprintln!("SKIPPED: {} is not there", path.display());
            None
        }
    }
}

fn vec3(json: &Json) -> [f64; 3] {
    std::array::from_fn(|k| json[k].as_f64().unwrap())
}

fn assert_close(value: f64, reference: f64, rtol: f64, what: &Json) {
    let error = (value - reference).abs();
    assert!(error <= rtol * reference.abs() + 1e-12, "{value} instead of {reference}: {what}");
}

#[test]
fn brdf_vectors_hold_in_both_precisions() {
    let Some(vectors) = vectors() else { return };
    let mut checked = std::collections::BTreeMap::new();
    for v in vectors["brdf"].as_array().unwrap() {
        let model = v["model"].as_str().unwrap();
        let Some(bsdf) = conformance::bsdf(model, v["params"].as_object().unwrap()) else {
            continue;
        };
        let (wi, wo, reference) = (vec3(&v["wi"]), vec3(&v["wo"]), v["f"].as_f64().unwrap());
        assert_close(bsdf.evaluate(wi, wo)[0], reference, 1e-9, v);
        let fast = f64::from(bsdf.evaluate_f32(wi, wo)[0]);
        // Far out in a Gaussian tail f underflows in single precision: nothing that a picture could show.
        assert!((fast - reference).abs() <= 1e-4 * reference + 1e-12, "{fast} instead of {reference}: {v}");
        *checked.entry(model.to_owned()).or_insert(0) += 1;
    }
    let counts: Vec<_> = checked.iter().map(|(m, n)| (m.as_str(), *n)).collect();
    assert_eq!(counts, [("lambert", 54), ("microfacet", 182), ("ward", 104)]);
}

#[test]
fn fresnel_vectors_hold() {
    let Some(vectors) = vectors() else { return };
    for v in vectors["components"]["fresnel"].as_array().unwrap() {
        let number = |name: &str| v[name].as_f64().unwrap();
        let fresnel = match v["type"].as_str().unwrap() {
            "schlick" => Fresnel::Schlick { f0: number("f0") },
            "dielectric" => Fresnel::Dielectric { eta: number("eta") },
            "conductor" => Fresnel::Conductor { eta: number("eta"), k: number("k") },
            _ => continue,
        };
        assert_close(fresnel.reflectance(number("cos")), number("F"), 1e-9, v);
    }
}

#[test]
fn distribution_and_masking_vectors_hold() {
    let Some(vectors) = vectors() else { return };
    let shape = |v: &Json| match v["type"].as_str().unwrap() {
        "ggx" => Shape::Ggx,
        "phong_alpha" => Shape::Phong,
        _ => Shape::Beckmann,
    };
    let alpha = |v: &Json| [v["ax"].as_f64().unwrap(), v["ay"].as_f64().unwrap()];
    for v in vectors["components"]["ndf"].as_array().unwrap() {
        let h = vec3(&v["h"]);
        // Light and viewer both on the half vector: only the half vector matters to D.
        let g = Geometry::new(h, h).unwrap();
        let distribution = Distribution { shape: shape(v), alpha: alpha(v) };
        assert_close(distribution.density(&g), v["D"].as_f64().unwrap(), 1e-9, v);
    }
    for v in vectors["components"]["masking"].as_array().unwrap() {
        let distribution = Distribution { shape: shape(v), alpha: alpha(v) };
        let rational = v["type"].as_str().unwrap().ends_with("rational");
        let g1 = 1.0 / (1.0 + smith_lambda(&distribution, &vec3(&v["v"]), rational));
        assert_close(g1, v["G1"].as_f64().unwrap(), 1e-9, v);
    }
}
