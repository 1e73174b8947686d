//! Random points: the initial population, and replacements for children that were evaluated before.

use rand::{Rng, seq::SliceRandom};
use rand_pcg::Pcg64;

use crate::{Bounds, Memo, Point};

/// Attempts to find a point never evaluated before the search makes do with an old one.
const ATTEMPTS: u32 = 32;

/// A point uniformly distributed within `bounds`.
pub fn uniform(bounds: &Bounds, rng: &mut Pcg64) -> Point {
    let sides = bounds.low.iter().zip(&bounds.high);
    sides.map(|(&low, &high)| rng.random_range(low..=high)).collect()
}

/// `count` points uniformly distributed within `bounds`.
pub fn uniform_points(count: usize, bounds: &Bounds, rng: &mut Pcg64) -> Vec<Point> {
    (0..count).map(|_| uniform(bounds, rng)).collect()
}

/// Latin hypercube of `count` points within `bounds`: each axis is cut into `count` equal parts, each of
/// which holds one point. Axes of fewer levels get every level equally often, to within one.
pub fn stratified_points(count: usize, bounds: &Bounds, rng: &mut Pcg64) -> Vec<Point> {
    let mut points = vec![Point::with_capacity(bounds.low.len()); count];
    for (&low, &high) in bounds.low.iter().zip(&bounds.high) {
        let mut parts: Vec<usize> = (0..count).collect();
        parts.shuffle(rng);
        let levels = f64::from(high - low) + 1.0;
        for (point, part) in points.iter_mut().zip(parts) {
            let place = (part as f64 + rng.random::<f64>()) / count as f64;
            // Rounding may carry a place just below 1 to the level past the end.
            point.push(low + ((place * levels) as u32).min(high - low));
        }
    }
    points
}

/// A random point within `bounds` that is neither in `memo` nor in `taken`; `None` if a few attempts find
/// none.
pub fn unseen(memo: &Memo, taken: &[Point], bounds: &Bounds, rng: &mut Pcg64) -> Option<Point> {
    let mut draw = || uniform(bounds, rng);
    (0..ATTEMPTS).map(|_| draw()).find(|point| is_new(point, memo, taken))
}

/// A point near `centre` that is neither in `memo` nor in `taken`: every gene moves by up to a number of
/// steps that grows from 1 with the attempts.
pub fn unseen_near(
    centre: &Point,
    memo: &Memo,
    taken: &[Point],
    bounds: &Bounds,
    rng: &mut Pcg64,
) -> Option<Point> {
    let mut draw = |attempt: u32| {
        let reach = i64::from(1 + attempt / 4);
        let moved: Point = centre
            .iter()
            .map(|&i| (i64::from(i) + rng.random_range(-reach..=reach)).clamp(0, i64::from(u32::MAX)) as u32)
            .collect();
        bounds.clamp(&moved)
    };
    (0..ATTEMPTS).map(&mut draw).find(|point| is_new(point, memo, taken))
}

/// Whether `point` has been neither evaluated nor chosen for evaluation.
pub fn is_new(point: &Point, memo: &Memo, taken: &[Point]) -> bool {
    memo.get(point).is_none() && !taken.contains(point)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn a_latin_hypercube_holds_every_part_once() {
        let bounds = Bounds { low: vec![0, 5, 3], high: vec![1, 24, 3] };
        let points = stratified_points(20, &bounds, &mut Pcg64::seed_from_u64(3));
        assert_eq!(points.iter().filter(|p| p[0] == 0).count(), 10);
        let mut second: Vec<u32> = points.iter().map(|p| p[1]).collect();
        second.sort_unstable();
        assert!(second.into_iter().eq(5..=24));
        assert!(points.iter().all(|p| bounds.contains(p)));
    }
}
