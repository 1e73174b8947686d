//! Settings of the genetic algorithm and their named presets.

use serde::{Deserialize, Serialize};

use crate::{SearchError, operators::Spread};

/// How the parents of a generation are drawn; in each tournament the best individual wins by Deb's
/// feasibility rules.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tournament {
    /// Every tournament draws its members at random (Guarnera et al. 2018, section 3.3).
    Random,
    /// The population is shuffled and split into tournaments, as often as a tournament has members, so that
    /// each individual enters that many tournaments (Deep et al. 2009).
    Rounds,
}

/// How children come from their parents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Breeding {
    /// Every child may be crossed, and then each of its genes may mutate (Deep et al. 2009).
    CrossThenMutate,
    /// A child either is crossed or, being the copy of a single parent, has every gene mutated ("either by
    /// crossing over … or by applying small mutations to the DNA of a single parent", Guarnera et al. 2018,
    /// section 3.3; MATLAB's `ga`). The mutation probability is not used.
    CrossOrMutate,
}

/// What happens to a child with a gene outside the bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutOfBounds {
    /// It lives on, never evaluated, as infeasible with the sum of its bound violations (in lattice steps).
    Penalise,
    /// Genes outside are drawn anew, uniformly within the bounds.
    Resample,
    /// Genes outside move to the bound.
    Clamp,
}

/// What happens to a child that has been evaluated before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Duplicates {
    /// It stays: evaluations are saved, diversity is not.
    Keep,
    /// It makes room for a random point never evaluated.
    Random,
    /// It makes room for a point never evaluated near by: each gene moves by a random number of steps, the
    /// farther the more attempts fail.
    Near,
}

/// How the initial population is drawn; starting guesses are placed first in any case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// Uniformly at random.
    Uniform,
    /// Near the guesses: points never evaluated, a step or a few away from one of them in turn; without guesses,
    /// uniformly.
    Near,
    /// Latin hypercube: along every axis one individual in each of as many equal parts as there are
    /// individuals.
    Stratified,
}

/// What the change of the best fitness is divided by before it is compared with the stall tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StallDivisor {
    /// `max(1, |best|)`, as MATLAB's `ga`: absolute for fitness below 1, so the fitness must be scaled to
    /// suit.
    AtLeastOne,
    /// `|best|`: the same stop whatever the fitness is multiplied by.
    Magnitude,
}

/// Settings of [`Genetic`](crate::Genetic). The default is [`GeneticSettings::lookmatch`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GeneticSettings {
    /// Individuals per searched axis, before the two limits below; axes of a single level do not count.
    pub population_per_axis: usize,
    /// Fewest individuals, 2 or more.
    pub population_min: usize,
    /// Most individuals.
    pub population_max: usize,
    /// Part of the population that survives unchanged, 0..=1, rounded up.
    pub elite_fraction: f64,
    /// How children come from their parents.
    pub breeding: Breeding,
    /// Probability p_c that two parents are crossed rather than copied, 0..=1.
    pub crossover_probability: f64,
    /// Probability p_m that a gene mutates, 0..=1.
    pub mutation_probability: f64,
    /// Location a of the Laplace crossover.
    pub laplace_a: f64,
    /// Scale b of the Laplace crossover, above 0.
    pub laplace_b: f64,
    /// Exponent p of the power mutation, above 0; the larger the smaller the steps.
    pub mutation_power: f64,
    /// How power mutation measures a gene's place.
    pub mutation_spread: Spread,
    /// Members of a tournament, 1 or more.
    pub tournament_size: usize,
    /// How tournaments are drawn.
    pub tournament: Tournament,
    /// What happens to children outside the bounds.
    pub out_of_bounds: OutOfBounds,
    /// What happens to children evaluated before.
    pub duplicates: Duplicates,
    /// How the initial population is drawn.
    pub start: Start,
    /// The search stops when the best fitness has changed by no more than `stall_tolerance` over this many
    /// generations, 1 or more.
    pub stall_generations: usize,
    /// Largest relative change that counts as none.
    pub stall_tolerance: f64,
    /// What the change is relative to.
    pub stall_divisor: StallDivisor,
    /// Upper limit of generations per searched axis.
    pub max_generations_per_axis: usize,
    /// From how many of the best distinct basins a lattice descent starts after the last generation; 0 for
    /// none.
    pub polish_starts: usize,
    /// Distance in lattice steps within which the descent looks for a better point before it ends, 1 or more.
    pub polish_radius: u32,
}

impl Default for GeneticSettings {
    fn default() -> GeneticSettings {
        GeneticSettings::lookmatch()
    }
}

impl GeneticSettings {
    /// Guarnera et al. 2018, section 3.3, where the article is silent MATLAB's `ga` with integer constraints,
    /// which its text follows: population min(max(10 n, 40), 100), elite 5 %, binary tournaments, children
    /// outside the bounds penalised, stop after 50 generations that change the best fitness by no more than
    /// 1e-6.
    pub fn guarnera2018() -> GeneticSettings {
        GeneticSettings {
            population_per_axis: 10,
            population_min: 40,
            population_max: 100,
            elite_fraction: 0.05,
            breeding: Breeding::CrossOrMutate,
            crossover_probability: 0.8,
            mutation_probability: 0.005,
            laplace_a: 0.0,
            laplace_b: 0.35,
            mutation_power: 4.0,
            mutation_spread: Spread::Range,
            tournament_size: 2,
            tournament: Tournament::Random,
            out_of_bounds: OutOfBounds::Penalise,
            duplicates: Duplicates::Keep,
            start: Start::Uniform,
            stall_generations: 50,
            stall_tolerance: 1e-6,
            stall_divisor: StallDivisor::AtLeastOne,
            max_generations_per_axis: 100,
            polish_starts: 0,
            polish_radius: 1,
        }
    }

    /// MI-LXPM as Deep et al. 2009 describe it: 10 n individuals, three-way tournaments in rounds, complete
    /// replacement without elite. It runs to the limit of generations, because their stopping rule needs the
    /// known optimum.
    pub fn deep2009() -> GeneticSettings {
        GeneticSettings {
            population_min: 2,
            // No limit in practice; files cannot hold usize::MAX.
            population_max: 1_000_000,
            stall_generations: 1_000_000,
            elite_fraction: 0.0,
            breeding: Breeding::CrossThenMutate,
            tournament_size: 3,
            tournament: Tournament::Rounds,
            ..GeneticSettings::guarnera2018()
        }
    }

    /// The default, tuned for few distinct points where the fitness compares pictures: smooth, curved narrow
    /// valleys, plateaus behind a switch.
    ///
    /// Against [`GeneticSettings::guarnera2018`]: a Latin hypercube to start from; three-way tournaments,
    /// wider crossover (b = 0.5) and mutation after it (p_m = 0.1); children outside the bounds move to them;
    /// children seen before make room for new points near by; an early stop, relative to the fitness itself;
    /// then descents from the three best basins. On synthetic matches it was not tuned on (`benches/synthetic.rs`
    /// with other sources) it found the optimum in 99.4 to 100 % of runs, the published settings in 97 to
    /// 99.4 %, for 9 % more evaluations on 3,010 points, 10 % fewer on 11,900 and 16 % fewer on 48,160.
    pub fn lookmatch() -> GeneticSettings {
        GeneticSettings {
            breeding: Breeding::CrossThenMutate,
            mutation_probability: 0.1,
            laplace_b: 0.5,
            tournament_size: 3,
            duplicates: Duplicates::Near,
            out_of_bounds: OutOfBounds::Clamp,
            start: Start::Stratified,
            stall_generations: 4,
            stall_divisor: StallDivisor::Magnitude,
            polish_starts: 3,
            polish_radius: 3,
            ..GeneticSettings::guarnera2018()
        }
    }

    /// For a search that goes on from a neighbour's result, given as a guess: a handful of individuals around the
    /// guesses, then one descent. It finds the bottom of the basin that the guesses lie in, for a small part of what
    /// [`GeneticSettings::lookmatch`] costs.
    pub fn continued() -> GeneticSettings {
        GeneticSettings {
            population_per_axis: 2,
            population_min: 6,
            start: Start::Near,
            stall_generations: 1,
            polish_starts: 1,
            polish_radius: 2,
            ..GeneticSettings::lookmatch()
        }
    }

    /// Individuals for a search over `axes` axes.
    pub fn population(&self, axes: usize) -> usize {
        let wanted = self.population_per_axis.saturating_mul(axes);
        wanted.max(self.population_min).min(self.population_max).max(2)
    }

    /// Whether every field lies in its range.
    ///
    /// # Errors
    /// [`SearchError::Setting`], naming the first field that does not.
    pub fn check(&self) -> Result<(), SearchError> {
        let part = |x: f64| (0.0..=1.0).contains(&x);
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let rules = [
            ("elite_fraction", part(self.elite_fraction), "in 0..=1"),
            ("crossover_probability", part(self.crossover_probability), "in 0..=1"),
            ("mutation_probability", part(self.mutation_probability), "in 0..=1"),
            ("laplace_a", self.laplace_a.is_finite(), "finite"),
            ("laplace_b", positive(self.laplace_b), "above 0"),
            ("mutation_power", positive(self.mutation_power), "above 0"),
            ("tournament_size", self.tournament_size >= 1, "1 or more"),
            ("population_min", self.population_min >= 2, "2 or more"),
            ("population_max", self.population_max >= 2, "2 or more"),
            ("stall_generations", self.stall_generations >= 1, "1 or more"),
            ("stall_tolerance", self.stall_tolerance >= 0.0, "0 or more"),
            ("polish_radius", (1..=8).contains(&self.polish_radius), "in 1..=8"),
        ];
        match rules.into_iter().find(|(_, sound, _)| !sound) {
            Some((setting, _, allowed)) => Err(SearchError::Setting { setting, allowed }),
            None => Ok(()),
        }
    }
}
