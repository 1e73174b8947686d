//! Reference values that were made for this project, where the public conformance vectors say nothing. Each file of
//! `tests/vectors` has its script beside it, which says what was run.

use lookmatch_materials::Material;
use serde_json::Value as Json;

/// Single precision must hold to this, relative to the largest channel, as for the public vectors.
const SINGLE: f64 = 1e-3;

#[test]
fn materials_agree_with_the_shaders_of_their_formats_viewers() {
    let vectors: Json = serde_json::from_str(include_str!("vectors/shaders.json")).unwrap();
    let mut worst = std::collections::BTreeMap::new();
    for v in vectors["brdf"].as_array().unwrap() {
        let mut json = v["params"].clone();
        json["model"] = v["model"].clone();
        let bsdf = Material::from_json(&json).unwrap().bsdf();
        let (wi, wo, reference) = (vec3(&v["wi"]), vec3(&v["wo"]), vec3(&v["f"]));
        let largest = reference.into_iter().fold(0.0, f64::max);
        let error =
            |found: [f64; 3]| (0..3).map(|c| (found[c] - reference[c]).abs()).fold(0.0, f64::max) / largest;
        let double = error(bsdf.evaluate(wi, wo));
        let single = error(bsdf.evaluate_f32(wi, wo).map(f64::from));
        let rtol = v["rtol"].as_f64().unwrap();
        assert!(double <= rtol, "{double:.1e} in double precision: {v}");
        assert!(single <= SINGLE.max(rtol), "{single:.1e} in single precision: {v}");
        let entry = worst.entry(format!("{} {}", v["model"], v["case"])).or_insert([0.0f64; 2]);
        *entry = [entry[0].max(double), entry[1].max(single)];
    }
    for (case, [double, single]) in worst {
        println!("{case}: {double:.1e}, in single precision {single:.1e}");
    }
}

fn vec3(json: &Json) -> [f64; 3] {
    std::array::from_fn(|k| json[k].as_f64().unwrap())
}
