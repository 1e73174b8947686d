//! Success rates and costs: `cargo test -p lookmatch-search --test measure -- --ignored --nocapture`.
mod common;
use common::{Scene, Score, sources};
use lookmatch_search::*;

#[test]
#[ignore = "measurement"]
fn tune() {
    let base = GeneticSettings::lookmatch();
    let mut variants: Vec<(String, GeneticSettings)> = vec![
        ("guarnera".into(), GeneticSettings::guarnera2018()),
        ("deep".into(), GeneticSettings::deep2009()),
        ("base".into(), base.clone()),
    ];
    for pop in [30, 40] { for stall in [1, 2, 3] { for (starts, radius) in [(2, 3), (3, 3), (4, 2)] { for (size, pm, b) in [(2, 0.005, 0.35), (3, 0.005, 0.35), (2, 0.1, 0.35), (2, 0.005, 0.6), (3, 0.1, 0.5)] {
        variants.push((format!("pop {pop} stall {stall} starts {starts} radius {radius} tournament {size} pm {pm} b {b}"), GeneticSettings {
            population_min: pop, population_max: pop, stall_generations: stall, polish_starts: starts, polish_radius: radius, tournament_size: size, mutation_probability: pm, laplace_b: b, ..base.clone() }));
    }}}}
    for (name, scene) in [("coarse", Scene::coarse()), ("fine", Scene::fine()), ("wide", Scene::wide())] {
        for rough in [0.01] {
            println!("== {name} rough {rough}");
            for (label, settings) in &variants {
                let score = Score::of(&Genetic::new(settings.clone()), &scene, &mut sources(&scene, 60, rough), 5);
                println!("{label:70} {}", score.line(scene.lattice.len()));
                if label == "base" { for m in score.misses.iter().take(12) { println!("     {m}"); } }
            }
        }
    }
}
