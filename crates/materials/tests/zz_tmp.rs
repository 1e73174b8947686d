use lookmatch_materials::conformance;
#[test]
fn survey() {
    let v: serde_json::Value = serde_json::from_str(
        &std::fs::read_to_string("/work/shared/conformance/vectors_public.json").unwrap(),
    )
    .unwrap();
    let which = std::env::var("MODEL").unwrap();
    for x in v["brdf"].as_array().unwrap() {
        if x["model"] != which.as_str() {
            continue;
        }
        let Some(b) = conformance::bsdf(&which, x["params"].as_object().unwrap()) else {
            eprintln!("none");
            continue;
        };
        let vec = |j: &serde_json::Value| -> [f64; 3] { std::array::from_fn(|k| j[k].as_f64().unwrap()) };
        let (wi, wo) = (vec(&x["wi"]), vec(&x["wo"]));
        let r: [f64; 3] = x["f"].as_f64().map_or_else(|| vec(&x["f"]), |g| [g; 3]);
        let m = r.iter().fold(0f64, |a, b| a.max(*b)).max(1e-300);
        let f = b.evaluate(wi, wo);
        let f32s = b.evaluate_f32(wi, wo);
        let e = (0..3).map(|c| (f[c] - r[c]).abs() / m).fold(0f64, f64::max);
        let e32 = (0..3).map(|c| (f32s[c] as f64 - r[c]).abs() / m).fold(0f64, f64::max);
        let p = |n: &str| x["params"][n].as_f64().unwrap_or(-1.0);
        eprintln!(
            "{:.1e} f32 {:.1e} {} M={:.2} C={:.2} r={:.2} a={:.2} dr={:.2} rc={:.2} mu={:.3} {:?} {:?}",
            e,
            e32,
            x["kind"],
            p("base_metalness").max(p("metalness")),
            p("coat_weight").max(p("coat")),
            p("specular_roughness").max(p("alpha")),
            p("specular_roughness_anisotropy").max(p("specular_anisotropy")),
            p("base_diffuse_roughness").max(p("diffuse_roughness")),
            p("coat_roughness"),
            wo[2],
            f,
            r
        );
    }
}
