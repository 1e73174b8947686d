//! The list of experiments. Adding one takes a file of its own and a line here.

mod abc_to_ggx;
mod agreement;
mod anisotropic;
mod colour_checker;
mod conductors;
mod metric_weights;
mod pca;
mod psychometric;
mod scenes;
mod svbrdf;
mod ward_to_ggx;

use crate::Experiment;

/// All experiments, in the paper's order.
#[rustfmt::skip] // one line per experiment
static EXPERIMENTS: &[Experiment] = &[
    Experiment { name: "metric-weights", reproduces: "Section 4, the weights of Eq. 3", about: "weights of the metric, such that it agrees with gradient similarity", run: metric_weights::run },
    Experiment { name: "pca", reproduces: "Section 4, synthesis of renderings", about: "how many principal components synthesised pictures need", run: pca::run },
    Experiment { name: "as-to-beckmann", reproduces: "Section 5.1, Table 2 (left), Figures 7 and 8", about: "metals, by roughness: Ashikhmin-Shirley to Cook-Torrance", run: conductors::to_beckmann },
    Experiment { name: "as-to-ggx", reproduces: "Section 5.1, Table 2 (right), Figures 7 and 8", about: "metals, by roughness: Ashikhmin-Shirley to GGX", run: conductors::to_ggx },
    Experiment { name: "ward-to-ggx", reproduces: "Section 5.2, Tables 4 and 5, Figures 9 and 11", about: "plastics: Ward to GGX, constrained and unconstrained", run: ward_to_ggx::run },
    Experiment { name: "colour-checker", reproduces: "Section 5.2, Figure 1", about: "a chart of plastics: Ward to GGX, patch by patch", run: colour_checker::run },
    Experiment { name: "svbrdf", reproduces: "Section 5.2, Figure 10", about: "a map of roughness: Ward to GGX, texel by texel", run: svbrdf::run },
    Experiment { name: "scenes", reproduces: "Section 5, validation scenes", about: "spheres and meshes under real maps: Ward to GGX beside what people do", run: scenes::run },
    Experiment { name: "abc-to-ggx", reproduces: "Section 5.3, Figure 12", about: "the MERL materials: Löw's ABC fits to GGX, channel by channel", run: abc_to_ggx::run },
    Experiment { name: "lafortune-to-ward", reproduces: "Section 6.1, Figure 13", about: "anisotropic cosine lobes: Lafortune to Ward", run: anisotropic::lafortune_to_ward },
    Experiment { name: "ward-to-ggx-aniso", reproduces: "Section 6.2, Figure 13", about: "anisotropic plastics: Ward to GGX", run: anisotropic::ward_to_ggx },
    Experiment { name: "agreement", reproduces: "Section 7.1, user studies 1 and 2", about: "where people see a difference, and where the verdict says so", run: agreement::run },
    Experiment { name: "psychometric", reproduces: "Section 7.2, experiment 1, Figure 16", about: "neighbours of the probe's result, ranked by what is seen", run: psychometric::run },
];

/// All experiments, in the paper's order.
pub fn experiments() -> &'static [Experiment] {
    EXPERIMENTS
}

/// The experiment of a name.
pub fn by_name(name: &str) -> Option<&'static Experiment> {
    EXPERIMENTS.iter().find(|experiment| experiment.name == name)
}
