//! The public conformance vectors, where they lie beside the project.

use std::path::Path;

use lookmatch_materials::albedo::{Albedo, Interface};
use lookmatch_materials::distribution::{Distribution, Shape};
use lookmatch_materials::fresnel::Fresnel;
use lookmatch_materials::masking::{Masking, smith_lambda};
use lookmatch_materials::rough_interface::{Internal, Order, RoughInterface, Transmittance};
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

/// One number or three.
fn channels(json: &Json) -> [f64; 3] {
    json.as_f64().map_or_else(|| vec3(json), |grey| [grey; 3])
}

/// Models that need integrals hold to this in double precision, closed forms to 1e-9, but where references are less exact
/// themselves: the diffuse reflection of `roughplastic` to 4e-5, and one vector of `kulla_conty` (α = 0.998, light at grazing
/// incidence) to 7.9e-6, as finer quadratures show.
const INTEGRALS: f64 = 1e-6;
const LESS_EXACT: [(&str, f64); 2] = [("roughplastic", 1e-4), ("kulla_conty", 1e-5)];

#[test]
fn brdf_vectors_hold_in_both_precisions() {
    let Some(vectors) = vectors() else { return };
    let mut failures = std::collections::BTreeMap::new();
    for v in vectors["brdf"].as_array().unwrap() {
        if let Err(message) = check(v) {
            failures.entry(v["model"].to_string()).or_insert_with(Vec::new).push(message);
        }
    }
    for (model, messages) in &failures {
        eprintln!("{model}: {} fail, for instance {}", messages.len(), messages[0]);
    }
    assert!(failures.is_empty());
}

fn check(v: &Json) -> Result<(), String> {
    let bsdf = conformance::bsdf(v["model"].as_str().unwrap(), v["params"].as_object().unwrap());
    let bsdf = bsdf.ok_or_else(|| format!("no model for {v}"))?;
    let (wi, wo, reference) = (vec3(&v["wi"]), vec3(&v["wo"]), channels(&v["f"]));
    let largest = reference.into_iter().fold(0.0, f64::max);
    let close = |found: f64, c: usize, tolerance: f64, what: &str| {
        let error = (found - reference[c]).abs();
        let message =
            || format!("{what}: {found} instead of {}, {:.1e} off: {v}", reference[c], error / largest);
        if error <= tolerance * largest + 1e-12 { Ok(()) } else { Err(message()) }
    };
    let less_exact = LESS_EXACT.into_iter().find(|(model, _)| v["model"] == *model);
    let tolerance = match v["rtol"].as_f64() {
        Some(1e-9) => 1e-9,
        _ => less_exact.map_or(INTEGRALS, |(_, tolerance)| tolerance),
    };
    let (exact, fast) = (bsdf.evaluate(wi, wo), bsdf.evaluate_f32(wi, wo));
    for c in 0..3 {
        close(exact[c], c, tolerance, "f64")?;
        // Far out in a Gaussian tail f underflows in single precision: nothing that a picture could show.
        close(f64::from(fast[c]), c, 1e-3, "f32")?;
    }
    Ok(())
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

#[test]
fn rough_interface_vectors_hold() {
    let Some(vectors) = vectors() else { return };
    for v in vectors["components"]["rough_interface"].as_array().unwrap() {
        let number = |name: &str| v[name].as_f64().unwrap();
        let shape = if v["dist"] == "ggx" { Shape::Ggx } else { Shape::Beckmann };
        let distribution = Distribution { shape, alpha: [number("alpha"); 2] };
        let interface = RoughInterface { distribution, eta: number("eta") };
        // The reference values of the two integrals over all directions are themselves about 2e-5 off.
        for (order, direct, integrated, reflected) in
            [(Order::EXACT, 3e-6, 5e-5, 2e-4), (Order::FAST, 3e-4, 3e-4, 2e-3)]
        {
            if v["mu"].is_number() {
                assert_close(interface.transmittance(number("mu"), order), number("T"), direct, v);
                continue;
            }
            let transmittance = Transmittance::new(&interface, order);
            let inside = |internal| interface.internal_reflectance(internal, &transmittance, order);
            assert_close(inside(Internal::NotTransmitted), number("Fdr_mitsuba06"), integrated, v);
            assert_close(inside(Internal::Reflected), number("Fdr_mitsuba3"), reflected, v);
        }
    }
}

#[test]
fn albedo_vectors_hold() {
    let Some(vectors) = vectors() else { return };
    for v in vectors["components"]["albedo"].as_array().unwrap() {
        let masking = if v["g"] == "smith_sep" { Masking::Separable } else { Masking::Correlated };
        let alpha = [v["alpha"].as_f64().unwrap(); 2];
        let albedo = Albedo::new(Interface { alpha, masking, fresnel: Fresnel::None });
        if let Some(average) = v["E_avg"].as_f64() {
            assert_close(albedo.average(), average, 1e-6, v);
            assert_close(albedo.average::<f32>().into(), average, 3e-4, v);
            continue;
        }
        let mu = v["mu"].as_f64().unwrap();
        let w = [(1.0 - mu * mu).sqrt(), 0.0, mu];
        assert_close(albedo.at(&w), v["E"].as_f64().unwrap(), 1e-6, v);
        assert_close(albedo.at(&w.map(|v| v as f32)).into(), v["E"].as_f64().unwrap(), 5e-4, v);
    }
}
