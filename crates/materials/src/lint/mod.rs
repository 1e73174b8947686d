//! What is probably wrong with the numbers of a material, and what was probably meant.
//!
//! Two ways: [`lint`] judges the numbers alone, by the rules of `RULES`; [`readings`] lists what each number could have been
//! meant as, for whoever can render and compare.
//!
//! Adding a rule takes a function and a line in `RULES`; adding a meaning takes a line in `readings.rs`.

mod colours;
mod fresnel;
mod given;
mod readings;
mod units;
mod widths;

use serde::Serialize;

pub use given::{Given, Item};
pub use readings::readings;

use crate::Material;

/// How sure a rule is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Certainty {
    /// There are materials like that, but few.
    Possible,
    /// Real materials are not like that.
    Likely,
    /// The model does not accept it.
    Certain,
}

/// What numbers may have been meant as.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reading {
    /// In words: `a power of a cosine`.
    pub says: String,
    /// The values that the model then wants: name and value as they are written.
    pub values: Vec<(String, String)>,
}

/// A trap that a material fell into, or may have.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The rule that found it.
    pub rule: &'static str,
    /// The parameter as it was named.
    pub parameter: String,
    /// Its value as it was written.
    pub value: String,
    /// How sure the rule is.
    pub certainty: Certainty,
    /// What is suspicious, and why.
    pub why: String,
    /// What was probably meant, the likeliest first; none where nothing comes to mind.
    pub fixes: Vec<Reading>,
}

/// A rule: its name, and how it judges.
struct Rule {
    name: &'static str,
    judge: fn(&Given) -> Vec<Suspicion>,
}

/// A finding of a rule whose name is still to be added.
struct Suspicion {
    parameter: String,
    value: String,
    certainty: Certainty,
    why: String,
    fixes: Vec<Reading>,
}

impl Suspicion {
    fn of(item: &Item, certainty: Certainty, why: String, fixes: Vec<Reading>) -> Self {
        Self { parameter: item.name.clone(), value: item.text.clone(), certainty, why, fixes }
    }
}

/// All rules, the surest first.
#[rustfmt::skip] // one line per rule
static RULES: &[Rule] = &[
    Rule { name: "exponent-as-roughness", judge: widths::exponent },
    Rule { name: "index-as-reflectance", judge: fresnel::index_as_reflectance },
    Rule { name: "reflectance-as-index", judge: fresnel::reflectance_as_index },
    Rule { name: "eight-bit-colour", judge: colours::eight_bit },
    Rule { name: "percent", judge: units::percent },
    Rule { name: "roughness-as-exponent", judge: widths::width_as_exponent },
    Rule { name: "reflectance-as-level", judge: fresnel::reflectance_as_level },
    Rule { name: "index-swapped", judge: fresnel::swapped },
    Rule { name: "metal-colour-encoded", judge: fresnel::metal_colour },
    Rule { name: "metal-without-colour", judge: fresnel::dark_metal },
    Rule { name: "encoded-colour", judge: colours::byte_fractions },
    Rule { name: "brighter-than-snow", judge: colours::too_bright },
    Rule { name: "darker-than-coal", judge: colours::too_dark },
    Rule { name: "gloss-or-square", judge: widths::wide },
    Rule { name: "alpha-as-roughness", judge: widths::narrow },
    // Last: for what no other rule explains.
    Rule { name: "out-of-range", judge: units::out_of_range },
];

/// Judges the numbers of a material. A parameter has one finding at most: that of the surest rule.
pub fn lint(given: &Given) -> Vec<Finding> {
    let mut findings: Vec<Finding> = Vec::new();
    for rule in RULES {
        for found in (rule.judge)(given) {
            let Suspicion { parameter, value, certainty, why, fixes } = found;
            if findings.iter().all(|f| f.parameter != parameter) {
                findings.push(Finding { rule: rule.name, parameter, value, certainty, why, fixes });
            }
        }
    }
    findings
}

/// The material with the likeliest fix of every finding; `None` where there is none, or it is still no material.
pub fn suggestion(given: &Given, findings: &[Finding]) -> Option<String> {
    let fixes = findings.iter().filter_map(|finding| finding.fixes.first());
    let values: Vec<(String, String)> = fixes.flat_map(|fix| fix.values.clone()).collect();
    if values.is_empty() {
        return None;
    }
    let text = given.text_with(&values);
    Material::parse(&text).is_ok().then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry;

    fn found(text: &str) -> Vec<Finding> {
        lint(&Given::parse(text).unwrap())
    }

    /// The one finding of a material: its rule and the value of the likeliest fix.
    fn only(text: &str) -> (&'static str, String) {
        let findings = found(text);
        let [finding] = &findings[..] else { panic!("{text}: {findings:#?}") };
        let fix = finding.fixes.first().map(|f| f.values[0].1.clone()).unwrap_or_default();
        (finding.rule, fix)
    }

    fn assert_fix(text: &str, rule: &str, expected: &str) {
        assert_eq!(only(text), (rule, expected.to_owned()), "{text}");
    }

    #[test]
    fn exponents_percents_and_bytes_in_a_roughness_field() {
        assert_fix("ward:roughness=60", "exponent-as-roughness", "0.1796");
        assert_fix("principled:roughness=60", "exponent-as-roughness", "0.4238");
        let findings = found("gltf:roughness=60");
        let says: Vec<&str> = findings[0].fixes.iter().map(|f| f.says.as_str()).collect();
        assert_eq!(says.len(), 3, "{says:?}");
        assert_eq!(findings[0].certainty, Certainty::Certain);
        assert_fix("gltf:roughness=30%", "percent", "0.3");
        assert_fix("gltf:metallic=100", "percent", "1");
        assert_fix("gltf:metallic=255", "percent", "1");
        assert_fix("phong:exponent=0.2", "roughness-as-exponent", "48");
    }

    #[test]
    fn colours_in_bytes_and_hex() {
        assert_fix("lambert:diffuse=200/100/50", "eight-bit-colour", "0.5776/0.1274/0.0319");
        assert_fix("lambert:diffuse=#c86432", "eight-bit-colour", "0.5776/0.1274/0.0319");
        // With the digits of a division by 255 they are codes all the same.
        assert_fix("lambert:diffuse=0.784314/0.392157/0.196078", "encoded-colour", "0.5776/0.1274/0.0319");
        assert!(found("lambert:diffuse=0.5776/0.1274/0.0319").is_empty());
    }

    #[test]
    fn albedos_of_snow_and_of_coal() {
        assert_fix("gltf:base_color=0.97/0.95/0.96", "brighter-than-snow", "0.9331/0.89/0.9114");
        assert!(found("gltf:base_color=0.97/0.95/0.96,metallic=1").is_empty());
        assert_fix("gltf:base_color=0.004/0.003/0.002", "darker-than-coal", "0.0507/0.0388/0.0258");
    }

    #[test]
    fn indices_and_reflectances() {
        assert_fix("ggx:ior=0.04", "reflectance-as-index", "1.5");
        assert_fix("ggx:ior=0.6667", "reflectance-as-index", "1.5");
        assert_fix("cook-torrance:f0=1.5", "index-as-reflectance", "0.04");
        assert_fix("disney:specular=0.04", "reflectance-as-level", "0.5");
        assert_fix("disney:specular=1.5", "index-as-reflectance", "0.5");
    }

    #[test]
    fn metals() {
        assert_fix(
            "ggx-conductor:eta=3.519/2.33/1.81,k=0.105/0.492/1.477",
            "index-swapped",
            "0.105/0.492/1.477",
        );
        assert_fix("ggx-conductor:eta=3.5,k=0.2", "index-swapped", "0.2");
        assert!(found("ggx-conductor:eta=0.105/0.492/1.477,k=3.519/2.33/1.81").is_empty());
        // Gold, encoded for a display.
        assert_fix("gltf:metallic=1,base_color=1/0.871/0.639", "metal-colour-encoded", "1/0.7312/0.366");
        assert!(found("gltf:metallic=1,base_color=1/0.73/0.366").is_empty());
        assert_fix("gltf:metallic=1,base_color=0.04", "metal-without-colour", "0");
    }

    #[test]
    fn widths_that_few_materials_have() {
        assert_fix("gltf:metallic=1,base_color=0.7,roughness=0.95", "gloss-or-square", "0.05");
        assert_fix("ggx:roughness=0.8", "gloss-or-square", "0.64");
        assert_fix("gltf:roughness=0.01", "alpha-as-roughness", "0.1");
        assert!(found("gltf:roughness=0.9").is_empty(), "chalk");
    }

    #[test]
    fn what_nothing_explains_is_still_told() {
        let findings = found("gltf:roughness=-0.5,metallic=1.2");
        let rules: Vec<&str> = findings.iter().map(|f| f.rule).collect();
        assert_eq!(rules, ["out-of-range", "out-of-range"]);
        assert!(findings[0].fixes.is_empty() && findings[0].why.contains("[0, 1]"), "{findings:?}");
    }

    #[test]
    fn the_suggestion_is_a_material() {
        let given =
            Given::parse(r#"{"model": "gltf", "roughness": 60, "base_color": [200, 100, 50], "ior": 0.04}"#)
                .unwrap();
        let findings = lint(&given);
        assert_eq!(findings.len(), 3);
        let text = suggestion(&given, &findings).unwrap();
        assert_eq!(text, "gltf:roughness=0.4238,base_color=0.5776/0.1274/0.0319,ior=1.5");
        let given = Given::parse("gltf:roughness=60,metallic=-1").unwrap();
        assert_eq!(suggestion(&given, &lint(&given)), None);
    }

    /// Published materials that are suspected, because they are what the rules say: the blackest and whitest there are, and a
    /// fabric fitted with a lobe wider than a diffuse one.
    const EXTREMES: [&str; 5] = [
        "ashikhmin-shirley@ngan-beige-fabric: roughness-as-exponent exponent=0.5",
        "openpbr@mit-black: darker-than-coal base_color=0.00005/0.00005/0.00005",
        "openpbr@musou-black: darker-than-coal base_color=0.006/0.006/0.006",
        "openpbr@spectralon: brighter-than-snow base_color=0.99/0.99/0.99",
        "openpbr@toothpaste: brighter-than-snow base_color=0.9325/0.9369/0.9286",
    ];

    #[test]
    fn defaults_and_published_materials_are_not_suspected() {
        let mut materials = 0;
        let mut suspected = Vec::new();
        for model in registry().iter().filter(|m| m.load.is_none()) {
            let names = (model.presets)().iter().map(|p| format!("{}@{}", model.name, p.name));
            for text in names.chain([Material::new(model).to_string()]) {
                materials += 1;
                suspected.extend(
                    found(&text)
                        .into_iter()
                        .map(|f| format!("{text}: {} {}={}", f.rule, f.parameter, f.value)),
                );
            }
        }
        assert!(materials > 700, "{materials}");
        suspected.sort();
        assert_eq!(suspected, EXTREMES, "of {materials}");
    }

    #[test]
    fn nonsense_is_refused() {
        for text in [
            "wrad:roughness=1",
            "ward:roughnes=1",
            "ward:roughness=wide",
            "ward:variant=2",
            "lambert:diffuse=1/2",
            "{",
            "ward:roughness",
            "ward:roughness=nan",
            "ward:roughness=0.1,roughness_u=0.2",
        ] {
            assert!(Given::parse(text).is_err(), "{text}");
        }
    }
}
