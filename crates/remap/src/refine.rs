//! Between the levels: a polish that starts where a search on a lattice ended.
//!
//! Around the best point lies a finer lattice, up to the neighbouring levels; a pattern search descends on it. It starts at the
//! point itself, so that nothing gets worse. A constrained strategy keeps its promise: values that rise with a source
//! parameter do not fall below those of the neighbours, and later points do not fall below them.

use lookmatch_materials::Trend;
use lookmatch_search::{Axis, Bounds, Lattice, Point, Problem, Search, Survey};

use crate::RemapError;
use crate::strategy::Counting;

/// Steps between two levels.
const STEPS: usize = 32;

/// How target values of one axis may move, beside those of neighbours: how they follow, and the neighbours' values.
pub(crate) type Led = Vec<(usize, Trend, f64)>;

/// The finer lattice around a point, and the point's place on it.
pub(crate) fn around(lattice: &Lattice, best: &Point, led: &Led) -> (Lattice, Point) {
    let mut centre = Point::new();
    let axis = |(k, axis): (usize, &Axis)| {
        let index = best[k] as usize;
        let value = axis.value(index);
        // Of a switch there is nothing between.
        if axis.len() <= 2 {
            centre.push(0);
            return Axis { name: axis.name.clone(), levels: vec![value] };
        }
        let (mut low, mut high) =
            (axis.value(index.saturating_sub(1)), axis.value((index + 1).min(axis.len() - 1)));
        for (_, trend, neighbour) in led.iter().filter(|(axis, ..)| *axis == k) {
            match trend {
                Trend::Rising => low = low.max(*neighbour).min(value),
                Trend::Falling => high = high.min(*neighbour).max(value),
            }
        }
        let below = (1..=STEPS).rev().map(|k| value + (low - value) * k as f64 / STEPS as f64);
        let above = (1..=STEPS).map(|k| value + (high - value) * k as f64 / STEPS as f64);
        let below: Vec<f64> = below.filter(|v| *v < value).collect();
        centre.push(below.len() as u32);
        let levels = below.into_iter().chain([value]).chain(above.filter(|v| *v > value)).collect();
        Axis { name: axis.name.clone(), levels }
    };
    (Lattice { axes: lattice.axes.iter().enumerate().map(axis).collect() }, centre)
}

/// The best values on a finer lattice and their fitness, found from its centre.
pub(crate) fn descend<O: Counting>(
    lattice: &Lattice,
    centre: Point,
    seed: u64,
    objective: &mut O,
) -> Result<(Vec<f64>, f64), RemapError> {
    let problem = Problem { lattice, bounds: Bounds::full(lattice), guesses: vec![centre], seed };
    let compass = Survey { density: 0, last_step: 1 };
    let outcome = compass.run(&problem, objective).map_err(RemapError::Search)?;
    Ok((lattice.values(&outcome.best), outcome.fitness))
}

/// The lattice point that stands for refined values where neighbours follow: the next level in the direction in which later
/// points may go on, else the nearest.
pub(crate) fn standing(lattice: &Lattice, values: &[f64], trends: &[(usize, Trend)]) -> Point {
    let index = |(k, (axis, value)): (usize, (&Axis, &f64))| {
        let trend = trends.iter().find(|(axis, _)| *axis == k).map(|(_, trend)| *trend);
        let above = axis.levels.partition_point(|level| level < value).min(axis.len() - 1);
        let below = axis.levels.partition_point(|level| level <= value).saturating_sub(1);
        (match trend {
            Some(Trend::Rising) => above,
            Some(Trend::Falling) => below,
            None => axis.nearest(*value),
        }) as u32
    };
    lattice.axes.iter().zip(values).enumerate().map(index).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookmatch_search::{Objective, ObjectiveError};

    struct Bowl<'a>(&'a Lattice, usize);

    impl Objective for Bowl<'_> {
        fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
            self.1 += points.len();
            let height = |p: &Point| {
                let v = self.0.values(p);
                (v[1] - 0.4321).powi(2) + 3.0 * (v[2] - 1.2345 + 0.5 * (v[1] - 0.4321)).powi(2)
            };
            Ok(points.iter().map(height).collect())
        }
    }

    impl Counting for Bowl<'_> {
        fn compared(&self) -> usize {
            self.1
        }
    }

    fn lattice() -> Lattice {
        let regular = |name, max| Axis::regular(name, 0.0, max, 0.1).unwrap();
        Lattice {
            axes: vec![Axis::listed("s", vec![0.0, 1.0]).unwrap(), regular("x", 1.0), regular("y", 2.0)],
        }
    }

    #[test]
    fn the_bottom_between_levels_is_found() {
        let lattice = lattice();
        let (fine, centre) = around(&lattice, &vec![1, 4, 12], &Led::new());
        assert_eq!(fine.values(&centre), lattice.values(&vec![1, 4, 12]));
        let (values, _) = descend(&fine, centre, 1, &mut Bowl(&fine, 0)).unwrap();
        assert!(values[0] == 1.0 && (values[1] - 0.4321).abs() < 0.005, "{values:?}");
        assert!((values[2] - 1.2345).abs() < 0.005, "{values:?}");
    }

    #[test]
    fn neighbours_bound_what_rises_and_falls() {
        let lattice = lattice();
        let led = vec![(1, Trend::Rising, 0.37), (2, Trend::Falling, 1.2)];
        let (fine, centre) = around(&lattice, &vec![1, 4, 12], &led);
        let ends = |k: usize| (fine.axes[k].value(0), fine.axes[k].value(fine.axes[k].len() - 1));
        assert!(ends(1).0 >= 0.37 - 1e-12 && ends(2).1 <= 1.2 + 1e-12, "{:?} {:?}", ends(1), ends(2));
        assert_eq!(fine.values(&centre), lattice.values(&vec![1, 4, 12]));
        let trends = [(1, Trend::Rising), (2, Trend::Falling)];
        assert_eq!(standing(&lattice, &[1.0, 0.41, 1.19], &trends), vec![1, 5, 11]);
        assert_eq!(standing(&lattice, &[1.0, 0.4, 1.2], &trends), vec![1, 4, 12]);
    }
}
