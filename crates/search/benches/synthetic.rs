//! Success rates and costs of the presets on synthetic matches:
//! `cargo bench -p lookmatch-search`, half a minute.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Scene, Score, sources};
use lookmatch_search::registry;

fn main() {
    let scenes =
        [("2 x 43 x 35", Scene::coarse()), ("2 x 85 x 70", Scene::fine()), ("2 x 344 x 70", Scene::wide())];
    for (label, scene) in &scenes {
        for rough in [0.0, 0.02] {
            println!("{label}, roughness {rough}");
            for entry in registry().iter().filter(|e| e.name != "exhaustive") {
                let mut matches = sources(scene, 100, rough);
                let score = Score::of((entry.make)().as_ref(), scene, &mut matches, 100..105);
                println!("  {:22} {}", entry.name, score.line(scene.lattice.len()));
            }
        }
    }
}
