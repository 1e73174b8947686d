//! Few renders and polished results, as a user asks for them.

mod support;

use tempfile::TempDir;

use support::{json, lookmatch, refused};

const REMAP: [&str; 9] = ["remap", "ward", "ggx", "--quick", "--mask", "--size", "32", "-o", "probe.json"];

#[test]
fn a_remap_says_what_it_rendered_and_inspect_repeats_it() {
    let folder = TempDir::new().unwrap();
    let of = folder.path();
    std::fs::create_dir(of.join("light")).unwrap();
    let with = |more: &[&'static str]| -> Vec<&'static str> { REMAP.iter().chain(more).copied().collect() };
    let few = json(of, &with(&["--search", "synthesis", "--json"]));
    let many = json(of, &with(&["--json"]));
    let rendered = |summary: &serde_json::Value| summary["rendered"].as_u64().unwrap();
    assert!(10 * rendered(&few) < rendered(&many), "{few} {many}");
    assert!(few["mean_fitness"].as_f64().unwrap() < 1.01 * many["mean_fitness"].as_f64().unwrap());
    assert!(few["synthesis"]["held_out"].as_u64().unwrap() > 0 && few["saved"].is_null(), "{few}");
    assert!(many["synthesis"].is_null() && many["saved"].as_u64().unwrap() > 0, "{many}");

    let polished = json(of, &with(&["--refine", "--pair", "roughness=roughness", "--json"]));
    assert!(polished["mean_fitness"].as_f64() < many["mean_fitness"].as_f64(), "{polished} {many}");
    let text = String::from_utf8(lookmatch(of, &["inspect", "probe.json"]).stdout).unwrap();
    for said in ["target materials rendered", "roughness followed roughness", "between the levels"] {
        assert!(text.contains(said), "no '{said}' in {text}");
    }
    refused(of, &with(&["--pair", "gloss=roughness"]), 2, &["'gloss'", "specular, roughness"]);
    refused(of, &with(&["--pair", "roughness"]), 2, &["SOURCE=TARGET"]);
    refused(of, &with(&["--search", "synthesys"]), 2, &["did you mean \"synthesis\"?"]);
}
