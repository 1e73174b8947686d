//! Genetic operators of MI-LXPM as pure functions of their random draws, so that they can be checked against
//! published formulas.
//!
//! Sources: K. Deep, K. P. Singh, M. L. Kansal and C. Mohan, "A real coded genetic algorithm for solving
//! integer and mixed integer optimization problems", Appl. Math. Comput. 212 (2009) (Laplace crossover, power
//! mutation, truncation); K. Deb, "An efficient constraint handling method for genetic algorithms", Comput.
//! Methods Appl. Mech. Eng. 186 (2000) (feasibility rules, parameter-free penalty).
//!
//! Genes are `f64`: whole numbers in this crate, but nothing here needs that.

use serde::{Deserialize, Serialize};

/// How power mutation measures a gene's place `t` between its bounds. The literature disagrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Spread {
    /// `t = (x - low) / (high - low)`, in 0..1.
    Range,
    /// `t = (x - low) / (high - x)`, in 0..∞, as some implementations of Deep et al. 2009 have it.
    Ratio,
}

/// Spread factor β of Laplace crossover: `a - b ln u` if `r <= 1/2`, else `a + b ln u`. `u` in (0, 1], `r` in
/// [0, 1).
pub fn laplace_beta(u: f64, r: f64, a: f64, b: f64) -> f64 {
    if r <= 0.5 { a - b * u.ln() } else { a + b * u.ln() }
}

/// Laplace crossover of one gene: both parents move by `beta |x1 - x2|`.
pub fn laplace_crossover(x1: f64, x2: f64, beta: f64) -> (f64, f64) {
    let shift = beta * (x1 - x2).abs();
    (x1 + shift, x2 + shift)
}

/// Power mutation of one gene: with `s = s1^p`, moves down by `s (x - low)` if `t < r`, else up by `s (high -
/// x)`.
///
/// `s1`, `r` in [0, 1); `p` > 0 (4 for integers, 10 for reals); never leaves `low..=high`.
pub fn power_mutation(x: f64, low: f64, high: f64, s1: f64, r: f64, p: f64, spread: Spread) -> f64 {
    let s = s1.powf(p);
    let span = match spread {
        Spread::Range => high - low,
        Spread::Ratio => high - x,
    };
    // At the upper bound the ratio is x/0: infinite, so that r never exceeds it. A domain of one level (0/0)
    // cannot move at all.
    let t = if span > 0.0 { (x - low) / span } else { f64::INFINITY };
    if t < r { x - s * (x - low) } else { x + s * (high - x) }
}

/// Truncation to a whole number: floor if `r < 1/2`, else floor + 1; whole numbers stay.
pub fn truncate(x: f64, r: f64) -> f64 {
    let floor = x.floor();
    if x == floor || r < 0.5 { floor } else { floor + 1.0 }
}

/// Deb's parameter-free penalty: feasible individuals (violation 0) keep their fitness, others get the worst
/// feasible fitness (0 if none is feasible) plus their violation. Slices of equal length, lower is better; an
/// infeasible one's own fitness is not read.
pub fn penalised(fitness: &[f64], violation: &[f64]) -> Vec<f64> {
    let individuals = || fitness.iter().zip(violation);
    let feasible = individuals().filter(|(_, v)| **v <= 0.0).map(|(f, _)| *f);
    let worst = feasible.reduce(f64::max).unwrap_or(0.0);
    individuals().map(|(&f, &v)| if v <= 0.0 { f } else { worst + v }).collect()
}

/// Whether `(fitness, violation)` of `a` beats that of `b` by Deb's rules: feasible beats infeasible, then
/// lower fitness, then lower violation.
pub fn beats(a: (f64, f64), b: (f64, f64)) -> bool {
    match (a.1 <= 0.0, b.1 <= 0.0) {
        (true, true) => a.0 < b.0,
        (false, false) => a.1 < b.1,
        (feasible, _) => feasible,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn truncation_goes_either_way() {
        assert_eq!(truncate(-1.3, 0.2), -2.0);
        assert_eq!(truncate(-1.3, 0.7), -1.0);
        assert_eq!(truncate(3.0, 0.9), 3.0);
    }

    #[test]
    fn mutation_of_a_single_level_stays() {
        for spread in [Spread::Range, Spread::Ratio] {
            assert_eq!(power_mutation(4.0, 4.0, 4.0, 0.9, 0.9, 4.0, spread), 4.0);
        }
    }

    #[test]
    fn feasible_beats_infeasible() {
        assert!(beats((9.0, 0.0), (1.0, 0.5)));
        assert!(!beats((1.0, 0.5), (9.0, 0.0)));
        assert!(beats((9.0, 0.1), (1.0, 0.5)));
        assert!(!beats((1.0, 0.0), (1.0, 0.0)));
    }
}
