//! Integer genetic algorithm MI-LXPM: Laplace crossover, power mutation, truncation, tournaments by
//! feasibility.
//!
//! Requirements: none on the fitness; best where it is smooth and has few basins. Whole generations are
//! evaluated at once.
//! Parameters: [`GeneticSettings`], each field with its range; presets `lookmatch` (default), `guarnera2018`,
//! `deep2009`.
//! References: K. Deep, K. P. Singh, M. L. Kansal and C. Mohan, Appl. Math. Comput. 212 (2009); D. Guarnera,
//! G. C. Guarnera, M. Toscani, M. Glencross, B. Li, J. Y. Hardeberg and K. R. Gegenfurtner, "Perceptually
//! validated cross-renderer analytical BRDF parameter remapping", IEEE TVCG (2018), section 3.3; K. Deb,
//! Comput. Methods Appl. Mech. Eng. 186 (2000).
//! Known defects: no guarantee to find the optimum. The two published presets copy the articles' text, not
//! their code, which is not available: see the settings for each point on which the literature disagrees.

use rand::{Rng, SeedableRng, seq::SliceRandom};
use rand_pcg::Pcg64;

use crate::{
    Bounds, Breeding, Duplicates, Exhaustive, GeneticSettings, Memo, Objective, OutOfBounds, Outcome, Point,
    Problem, Search, SearchError, StallDivisor, Start, Tournament,
    individual::{Individual, feasible_point, genes, violation},
    operators, polish, sampling,
};

/// The integer genetic algorithm with its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Genetic {
    name: &'static str,
    /// The settings, checked when a run starts.
    pub settings: GeneticSettings,
}

impl Genetic {
    /// The algorithm with settings of one's own, under the name "genetic".
    pub fn new(settings: GeneticSettings) -> Genetic {
        Genetic { name: "genetic", settings }
    }

    /// The preset [`GeneticSettings::guarnera2018`].
    pub fn guarnera2018() -> Genetic {
        Genetic { name: "genetic-guarnera2018", settings: GeneticSettings::guarnera2018() }
    }

    /// The preset [`GeneticSettings::deep2009`].
    pub fn deep2009() -> Genetic {
        Genetic { name: "genetic-deep2009", settings: GeneticSettings::deep2009() }
    }
}

impl Default for Genetic {
    fn default() -> Genetic {
        Genetic::new(GeneticSettings::default())
    }
}

impl Search for Genetic {
    fn name(&self) -> &'static str {
        self.name
    }

    fn run(&self, problem: &Problem, objective: &mut dyn Objective) -> Result<Outcome, SearchError> {
        self.settings.check()?;
        problem.check()?;
        let bounds = &problem.bounds;
        let axes = (0..bounds.low.len()).filter(|&k| bounds.low[k] < bounds.high[k]).count();
        let size = self.settings.population(axes);
        if bounds.len() <= size {
            // The initial population would cost as much as the answer.
            return Exhaustive::default().run(problem, objective);
        }
        let run = Run {
            settings: &self.settings,
            bounds,
            size,
            memo: Memo::new(problem.lattice, objective),
            rng: Pcg64::seed_from_u64(problem.seed),
        };
        run.finish(&problem.guesses, axes)
    }
}

/// The state of one run.
struct Run<'a> {
    settings: &'a GeneticSettings,
    bounds: &'a Bounds,
    size: usize,
    memo: Memo<'a>,
    rng: Pcg64,
}

impl Run<'_> {
    fn finish(mut self, guesses: &[Point], axes: usize) -> Result<Outcome, SearchError> {
        let generations = self.evolve(guesses, axes)?;
        for start in self.basins() {
            let radius = self.settings.polish_radius;
            polish::descend(&mut self.memo, self.bounds, &start, radius)?;
        }
        let (fitness, best) = self.memo.best().ok_or(SearchError::NothingEvaluated)?;
        Ok(Outcome { best: best.clone(), fitness, evaluations: self.memo.evaluations(), generations })
    }

    /// Breeds generations until the best fitness stalls; returns their number.
    fn evolve(&mut self, guesses: &[Point], axes: usize) -> Result<usize, SearchError> {
        let first = self.initial(guesses);
        let mut population = self.evaluated(first)?;
        let mut history = vec![self.best_fitness()];
        let limit = self.settings.max_generations_per_axis.saturating_mul(axes);
        while history.len() <= limit && !self.stalled(&history) && self.memo.evaluations() < self.bounds.len()
        {
            population = self.next_generation(population)?;
            history.push(self.best_fitness());
        }
        Ok(history.len() - 1)
    }

    fn best_fitness(&self) -> f64 {
        self.memo.best().map_or(f64::INFINITY, |(fitness, _)| fitness)
    }

    fn stalled(&self, history: &[f64]) -> bool {
        let now = history.len() - 1;
        let Some(then) = now.checked_sub(self.settings.stall_generations) else {
            return false;
        };
        let best = history[now].abs();
        let divisor = match self.settings.stall_divisor {
            StallDivisor::AtLeastOne => best.max(1.0),
            StallDivisor::Magnitude => best,
        };
        history[then] - history[now] <= self.settings.stall_tolerance * divisor
    }

    /// Guesses first, then the drawn points, as many as the population holds.
    fn initial(&mut self, guesses: &[Point]) -> Vec<Vec<f64>> {
        let mut points: Vec<Point> = guesses.iter().map(|guess| self.bounds.clamp(guess)).collect();
        points.truncate(self.size);
        let missing = self.size - points.len();
        if self.settings.start == Start::Near && !points.is_empty() {
            let starts = points.len();
            for k in 0..missing {
                let start = points[k % starts].clone();
                // In a corner of the bounds there may be nothing new near by: then the start stands in twice.
                let near = sampling::unseen_near(&start, &self.memo, &points, self.bounds, &mut self.rng);
                points.push(near.unwrap_or(start));
            }
            return points.iter().map(genes).collect();
        }
        points.extend(match self.settings.start {
            Start::Uniform | Start::Near => sampling::uniform_points(missing, self.bounds, &mut self.rng),
            Start::Stratified => sampling::stratified_points(missing, self.bounds, &mut self.rng),
        });
        points.iter().map(genes).collect()
    }

    fn next_generation(&mut self, mut population: Vec<Individual>) -> Result<Vec<Individual>, SearchError> {
        population.sort_by(Individual::order);
        let elite = (self.settings.elite_fraction * self.size as f64).ceil() as usize;
        let elite = elite.min(self.size);
        let parents = self.parents(&population, self.size - elite);
        let children = self.children(&population, &parents);
        population.truncate(elite);
        population.extend(self.evaluated(children)?);
        Ok(population)
    }

    /// Indices of the tournament winners.
    fn parents(&mut self, population: &[Individual], count: usize) -> Vec<usize> {
        let members = self.settings.tournament_size.min(self.size);
        let winner = |group: &[usize]| {
            let best = group.iter().copied().reduce(|a, b| {
                if operators::beats(population[b].score(), population[a].score()) { b } else { a }
            });
            best.unwrap_or(0)
        };
        let mut winners = Vec::with_capacity(count);
        let mut ring: Vec<usize> = (0..self.size).collect();
        while winners.len() < count {
            match self.settings.tournament {
                Tournament::Random => {
                    let draw = |_| self.rng.random_range(0..self.size as u64) as usize;
                    let group: Vec<usize> = (0..members).map(draw).collect();
                    winners.push(winner(&group));
                }
                Tournament::Rounds => {
                    ring.shuffle(&mut self.rng);
                    winners.extend(ring.chunks_exact(members).map(winner));
                }
            }
        }
        winners.truncate(count);
        winners
    }

    /// One child per parent: crossed in pairs, mutated, truncated, brought within bounds and made new, as the
    /// settings say.
    fn children(&mut self, population: &[Individual], parents: &[usize]) -> Vec<Vec<f64>> {
        let mut children = Vec::with_capacity(parents.len() + 1);
        for pair in parents.chunks(2) {
            let (a, b) = (&population[pair[0]].genes, &population[pair[pair.len() - 1]].genes);
            let cross = self.rng.random::<f64>() < self.settings.crossover_probability;
            let (mut first, mut second) = if cross { self.crossed(a, b) } else { (a.clone(), b.clone()) };
            let probability = match self.settings.breeding {
                Breeding::CrossThenMutate => self.settings.mutation_probability,
                Breeding::CrossOrMutate => f64::from(u8::from(!cross)),
            };
            self.mutate(&mut first, probability);
            self.mutate(&mut second, probability);
            children.extend([first, second]);
        }
        children.truncate(parents.len());
        for child in &mut children {
            self.truncate(child);
            self.confine(child);
        }
        self.renew(&mut children);
        children
    }

    fn crossed(&mut self, a: &[f64], b: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut gene = |(&x1, &x2): (&f64, &f64)| {
            // 1 - U lies in (0, 1]: its logarithm is finite.
            let u = 1.0 - self.rng.random::<f64>();
            let r = self.rng.random::<f64>();
            let beta = operators::laplace_beta(u, r, self.settings.laplace_a, self.settings.laplace_b);
            operators::laplace_crossover(x1, x2, beta)
        };
        a.iter().zip(b).map(&mut gene).unzip()
    }

    fn mutate(&mut self, child: &mut [f64], probability: f64) {
        for (k, gene) in child.iter_mut().enumerate() {
            if self.rng.random::<f64>() < probability {
                let (low, high) = (f64::from(self.bounds.low[k]), f64::from(self.bounds.high[k]));
                let (s, r) = (self.rng.random(), self.rng.random());
                let (p, spread) = (self.settings.mutation_power, self.settings.mutation_spread);
                *gene = operators::power_mutation(*gene, low, high, s, r, p, spread);
            }
        }
    }

    fn truncate(&mut self, child: &mut [f64]) {
        for gene in child {
            *gene = operators::truncate(*gene, self.rng.random());
        }
    }

    fn confine(&mut self, child: &mut [f64]) {
        for (k, gene) in child.iter_mut().enumerate() {
            let (low, high) = (self.bounds.low[k], self.bounds.high[k]);
            let outside = *gene < f64::from(low) || *gene > f64::from(high);
            match self.settings.out_of_bounds {
                OutOfBounds::Resample if outside => *gene = f64::from(self.rng.random_range(low..=high)),
                OutOfBounds::Clamp => *gene = gene.clamp(f64::from(low), f64::from(high)),
                _ => {}
            }
        }
    }

    /// Replaces children evaluated before, or twins, by new points.
    fn renew(&mut self, children: &mut [Vec<f64>]) {
        if self.settings.duplicates == Duplicates::Keep {
            return;
        }
        let mut taken: Vec<Point> = Vec::with_capacity(children.len());
        for child in children {
            let Some(mut point) = feasible_point(child, self.bounds) else {
                continue;
            };
            if !sampling::is_new(&point, &self.memo, &taken) {
                point = self.replacement(&point, &taken).unwrap_or(point);
                *child = genes(&point);
            }
            taken.push(point);
        }
    }

    fn replacement(&mut self, point: &Point, taken: &[Point]) -> Option<Point> {
        match self.settings.duplicates {
            Duplicates::Keep => None,
            Duplicates::Random => sampling::unseen(&self.memo, taken, self.bounds, &mut self.rng),
            Duplicates::Near => sampling::unseen_near(point, &self.memo, taken, self.bounds, &mut self.rng),
        }
    }

    /// Individuals of the given genes; those within bounds are evaluated, in one batch.
    fn evaluated(&mut self, genes: Vec<Vec<f64>>) -> Result<Vec<Individual>, SearchError> {
        let points: Vec<Option<Point>> = genes.iter().map(|g| feasible_point(g, self.bounds)).collect();
        let batch: Vec<Point> = points.iter().flatten().cloned().collect();
        let mut values = self.memo.evaluate(&batch)?.into_iter();
        let individuals = genes.into_iter().zip(points).map(|(genes, point)| {
            let fitness = point.and_then(|_| values.next());
            Individual {
                violation: violation(&genes, self.bounds),
                fitness: fitness.unwrap_or(f64::INFINITY),
                genes,
            }
        });
        Ok(individuals.collect())
    }

    /// Where descents start: the best point, then the next best ones that are not its neighbours or each
    /// other's.
    fn basins(&self) -> Vec<Point> {
        let mut starts: Vec<Point> = Vec::new();
        for (_, point) in self.memo.ranking() {
            if starts.len() >= self.settings.polish_starts {
                break;
            }
            if starts.iter().all(|start| self.far(start, &point)) {
                starts.push(point);
            }
        }
        starts
    }

    /// Whether two points lie in different tenths of some axis, and several steps apart.
    fn far(&self, a: &Point, b: &Point) -> bool {
        (0..a.len()).any(|k| {
            let levels = self.bounds.high[k] - self.bounds.low[k];
            a[k].abs_diff(b[k]) > (levels / 10).max(2)
        })
    }
}
