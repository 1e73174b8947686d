//! The list of experiments. Adding one takes a file of its own and a line here.

mod agreement;
mod conductors;
mod psychometric;
mod ward_to_ggx;

use crate::Experiment;

/// All experiments, in the paper's order.
#[rustfmt::skip] // one line per experiment
static EXPERIMENTS: [Experiment; 5] = [
    Experiment { name: "as-to-beckmann", reproduces: "Section 5.1, Table 2 (left), Figures 7 and 8", about: "metals, by roughness: Ashikhmin-Shirley to Cook-Torrance", run: conductors::to_beckmann },
    Experiment { name: "as-to-ggx", reproduces: "Section 5.1, Table 2 (right), Figures 7 and 8", about: "metals, by roughness: Ashikhmin-Shirley to GGX", run: conductors::to_ggx },
    Experiment { name: "ward-to-ggx", reproduces: "Section 5.2, Tables 4 and 5, Figures 9 and 11", about: "plastics: Ward to GGX, constrained and unconstrained", run: ward_to_ggx::run },
    Experiment { name: "agreement", reproduces: "Section 7.1, user studies 1 and 2", about: "where people see a difference, and where the verdict says so", run: agreement::run },
    Experiment { name: "psychometric", reproduces: "Section 7.2, experiment 1, Figure 16", about: "neighbours of the probe's result, ranked by what is seen", run: psychometric::run },
];

/// All experiments, in the paper's order.
pub fn experiments() -> &'static [Experiment] {
    &EXPERIMENTS
}

/// The experiment of a name.
pub fn by_name(name: &str) -> Option<&'static Experiment> {
    EXPERIMENTS.iter().find(|experiment| experiment.name == name)
}
