//! Materials with names of their own: each is accepted by its model and reflects light.

use lookmatch_materials::{Material, registry};

fn reflected(text: &str) -> [f64; 3] {
    Material::parse(text).unwrap().bsdf().evaluate([0.6, 0.0, 0.8], [-0.5, 0.1, 0.74f64.sqrt()])
}

#[test]
fn every_preset_of_every_model_is_a_material() {
    let direction = |cos: f64, sign: f64| [sign * (1.0 - cos * cos).sqrt(), 0.0, cos];
    for model in registry() {
        for preset in (model.presets)() {
            let text = format!("{}@{}", model.name, preset.name);
            let bsdf = Material::parse(&text).unwrap_or_else(|e| panic!("{text}: {e}")).bsdf();
            for (cos_i, cos_o) in [(1.0, 1.0), (0.7, 0.7), (0.5, 0.9), (0.002, 0.002), (0.002, 0.8)] {
                let (wi, wo) = (direction(cos_i, 1.0), direction(cos_o, -1.0));
                let (f, fast) = (bsdf.evaluate(wi, wo), bsdf.evaluate_f32(wi, wo));
                assert!(f.iter().all(|v| v.is_finite() && *v >= 0.0), "{text}: {f:?}");
                assert!(fast.iter().all(|v| v.is_finite() && *v >= 0.0), "{text}: {fast:?}");
            }
            let mirror = bsdf.evaluate(direction(0.7, 1.0), direction(0.7, -1.0));
            assert!(mirror.iter().all(|v| *v > 0.0), "{text}: {mirror:?}");
        }
    }
}

#[test]
fn names_of_presets_are_unique_and_counted() {
    let counts = [
        ("low-abc", 100),
        ("low-smooth", 100),
        ("ward", 172),
        ("blinn-phong", 86),
        ("lafortune", 86),
        ("cook-torrance", 186),
        ("ashikhmin-shirley", 186),
    ];
    for (name, count) in counts {
        let presets = (lookmatch_materials::by_name(name).unwrap().presets)();
        let names: std::collections::BTreeSet<&str> = presets.iter().map(|p| p.name.as_str()).collect();
        assert_eq!((presets.len(), names.len()), (count, count), "{name}");
    }
}

#[test]
fn a_preset_is_where_other_values_start_from() {
    let material = Material::parse("low-abc@chrome:diffuse=0").unwrap();
    assert_eq!(material.number("ior").unwrap(), 99.999413);
    assert_eq!(material.number("diffuse").unwrap(), 0.0);
    let message = Material::parse("low-abc@crome").unwrap_err().to_string();
    assert!(message.contains("did you mean 'chrome'?"), "{message}");
}

/// Ngan's and Löw's fits are of the same measurements: a wrong constant or colour scale would show.
#[test]
fn fits_of_different_authors_agree_on_average() {
    let ward = lookmatch_materials::by_name("ward").unwrap();
    let names: Vec<&str> =
        (ward.presets)().iter().filter_map(|p| p.name.strip_prefix("ngan-duer-")).collect();
    let prefixes = [
        "ward@ngan-",
        "ward@ngan-duer-",
        "blinn-phong@ngan-",
        "lafortune@ngan-",
        "cook-torrance@ngan-",
        "cook-torrance@low-",
        "ashikhmin-shirley@ngan-",
        "ashikhmin-shirley@low-",
        "low-smooth@",
    ];
    for prefix in prefixes {
        // Decades between the two, and how much more of them in green and blue than in red.
        let decades: Vec<[f64; 3]> = names
            .iter()
            .map(|name| {
                let fit = reflected(&format!("{prefix}{name}"));
                let reference = reflected(&format!("low-abc@{name}"));
                std::array::from_fn(|c| (fit[c] / reference[c]).log10())
            })
            .collect();
        let whole = median(decades.iter().map(|d| d[0]));
        let colour = [1, 2].map(|c| median(decades.iter().map(|d| d[c] - d[0])));
        eprintln!("{prefix}: {whole} {colour:?}");
        assert!(whole.abs() < 0.15, "{prefix}: {whole}");
        assert!(colour.iter().all(|c| c.abs() < 0.03), "{prefix}: {colour:?}");
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
