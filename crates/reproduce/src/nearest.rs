//! The best that a target model can do for each of several regions of a picture: a direct search on the very pictures that judge.
//!
//! Each picture that is rendered shows a candidate in every region, so that the search takes as many pictures for many regions as for
//! one. First a lattice over the whole range, then a compass about the best of each region, whose steps halve where nothing better is found
//! (Kolda, Lewis and Torczon 2003). Steps are ratios: of the index less 1, and of the roughness.

use crate::Watch;

/// Index of refraction and roughness of a target.
pub(crate) type Values = [f64; 2];

/// How far a search goes.
pub(crate) struct Reach {
    /// Least and largest index and roughness.
    pub(crate) limits: [[f64; 2]; 2],
    /// Levels of the lattice along either.
    pub(crate) levels: usize,
    /// Rounds of the compass.
    pub(crate) rounds: usize,
}

/// The errors of all regions where each of them shows its values.
pub(crate) type Errors<'a> = dyn FnMut(&[Values]) -> anyhow::Result<Vec<f64>> + 'a;

/// The best of one region so far.
struct Best {
    /// Logarithms.
    place: [f64; 2],
    error: f64,
    step: [f64; 2],
}

impl Reach {
    /// Pictures that a search takes from so many guesses.
    pub(crate) fn pictures(&self, guesses: usize) -> usize {
        guesses + self.levels * self.levels + 4 * self.rounds
    }

    /// The values that suit each region best. `guesses` has values of all regions.
    ///
    /// # Errors
    /// Those of `errors`, a stop from outside.
    pub(crate) fn search(
        &self,
        guesses: &[Vec<Values>],
        watch: &dyn Watch,
        errors: &mut Errors,
    ) -> anyhow::Result<Vec<Values>> {
        let count = guesses.first().map_or(0, Vec::len);
        let [low, high] = [0, 1].map(|end| logarithms(self.limits.map(|ends| ends[end])));
        let spacing = [0, 1].map(|k| (high[k] - low[k]) / self.levels as f64);
        let mut best: Vec<Best> = (0..count)
            .map(|_| Best { place: low, error: f64::INFINITY, step: spacing.map(|s| s / 2.0) })
            .collect();
        let mut look = |best: &mut Vec<Best>, places: &[[f64; 2]]| -> anyhow::Result<Vec<bool>> {
            anyhow::ensure!(!watch.is_stopped(), "stopped");
            let inside = |p: &[f64; 2]| std::array::from_fn(|k| p[k].clamp(low[k], high[k]));
            let places: Vec<[f64; 2]> = places.iter().map(inside).collect();
            let found = errors(&places.iter().map(|place| values(*place)).collect::<Vec<_>>())?;
            let better = best.iter_mut().zip(places).zip(found).map(|((best, place), error)| {
                let is_better = error < best.error;
                if is_better {
                    (best.place, best.error) = (place, error);
                }
                is_better
            });
            Ok(better.collect())
        };
        for guess in guesses {
            look(&mut best, &guess.iter().map(|values| logarithms(*values)).collect::<Vec<_>>())?;
        }
        for (i, j) in (0..self.levels).flat_map(|i| (0..self.levels).map(move |j| (i, j))) {
            let at = |k: usize, level: usize| low[k] + (level as f64 + 0.5) * spacing[k];
            look(&mut best, &vec![[at(0, i), at(1, j)]; count])?;
        }
        for _ in 0..self.rounds {
            let mut has_moved = vec![false; count];
            for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
                let beside = |best: &Best| {
                    let mut place = best.place;
                    place[axis] += sign * best.step[axis];
                    place
                };
                let places: Vec<[f64; 2]> = best.iter().map(beside).collect();
                let moved = look(&mut best, &places)?;
                has_moved.iter_mut().zip(moved).for_each(|(any, now)| *any |= now);
            }
            let still = best.iter_mut().zip(has_moved).filter(|(_, moved)| !moved);
            still.for_each(|(best, _)| best.step = best.step.map(|step| step / 2.0));
        }
        Ok(best.iter().map(|best| values(best.place)).collect())
    }
}

fn logarithms([index, roughness]: Values) -> [f64; 2] {
    [(index - 1.0).ln(), roughness.ln()]
}

fn values([index, roughness]: [f64; 2]) -> Values {
    [1.0 + index.exp(), roughness.exp()]
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Silent;

    impl Watch for Silent {
        fn begin(&self, _: &str, _: usize) {}
        fn advance(&self, _: usize) {}
        fn is_stopped(&self) -> bool {
            false
        }
    }

    #[test]
    fn every_region_finds_its_own_best() {
        let wanted = [[1.5, 0.2], [2.4, 0.02], [1.05, 0.9]];
        let reach = Reach { limits: [[1.01, 4.0], [0.005, 1.0]], levels: 5, rounds: 12 };
        let mut pictures = 0;
        let mut errors = |tried: &[Values]| {
            pictures += 1;
            let off = |(a, b): (&Values, &Values)| {
                let (a, b) = (logarithms(*a), logarithms(*b));
                (a[0] - b[0]).powi(2) + 3.0 * (a[1] - b[1]).powi(2) + 0.5 * (a[0] - b[0]) * (a[1] - b[1])
            };
            Ok(tried.iter().zip(&wanted).map(off).collect())
        };
        let guesses = vec![vec![[1.5, 0.3]; 3]];
        let found = reach.search(&guesses, &Silent, &mut errors).unwrap();
        for (found, wanted) in found.iter().zip(&wanted) {
            assert!((found[0] / wanted[0] - 1.0).abs() < 0.02, "{found:?} {wanted:?}");
            assert!((found[1] / wanted[1] - 1.0).abs() < 0.03, "{found:?} {wanted:?}");
        }
        assert_eq!(pictures, reach.pictures(1));
    }
}
