//! The list of experiments. Adding one takes a file of its own and a line here.

use crate::Experiment;

/// All experiments, in the paper's order.
#[rustfmt::skip] // one line per experiment
static EXPERIMENTS: [Experiment; 0] = [
];

/// All experiments, in the paper's order.
pub fn experiments() -> &'static [Experiment] {
    &EXPERIMENTS
}

/// The experiment of a name.
pub fn by_name(name: &str) -> Option<&'static Experiment> {
    EXPERIMENTS.iter().find(|experiment| experiment.name == name)
}
