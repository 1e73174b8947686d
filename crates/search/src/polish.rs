//! Lattice descent: from a starting point to the best point of its basin.
//!
//! Looks at the next levels along each axis, then at the diagonals; moves to the best better point, on in the
//! same direction with steps that double while they pay; ends when no point within the radius is better. A
//! pattern search after R. Hooke and T. A. Jeeves, "Direct search solution of numerical and statistical
//! problems", J. ACM 8 (1961).
//!
//! Requirements: a fitness with some slope; flat parts are crossed only towards lower indices, by the tie
//! rule.
//! Parameters: `radius` of the last look-around in lattice steps.
//! Known defects: stops in a local minimum that is wider than the radius. Axes of two levels are switched
//! alone, never in a diagonal.

use crate::{Bounds, Memo, Point, SearchError};

/// Diagonals over more axes than this are taken pairwise, because all of them would be 3^n - 1.
const FULL_DIAGONALS: usize = 4;

/// Descends from `start`, an evaluated or new point within `bounds`; the best point is then found in `memo`.
///
/// # Errors
/// Those of [`Memo::evaluate`].
pub fn descend(memo: &mut Memo, bounds: &Bounds, start: &Point, radius: u32) -> Result<Point, SearchError> {
    let mut here = start.clone();
    memo.evaluate(std::slice::from_ref(&here))?;
    while let Some(next) = improve(memo, bounds, &here, radius)? {
        here = advance(memo, bounds, &here, next)?;
    }
    Ok(here)
}

/// The best better point around `here`, cheapest neighbourhoods first.
fn improve(
    memo: &mut Memo,
    bounds: &Bounds,
    here: &Point,
    radius: u32,
) -> Result<Option<Point>, SearchError> {
    let axial = axial(here, bounds);
    if let Some(point) = best_of(memo, &axial, here)? {
        return Ok(Some(point));
    }
    if let Some(point) = best_of(memo, &floors(memo, &axial, here, bounds), here)? {
        return Ok(Some(point));
    }
    for reach in 1..=radius {
        let ring = ring(here, bounds, reach);
        if let Some(point) = best_of(memo, &ring, here)? {
            return Ok(Some(point));
        }
    }
    Ok(None)
}

/// Goes on from `next` in the direction that led there from `here`, with doubling steps, while that pays.
fn advance(memo: &mut Memo, bounds: &Bounds, here: &Point, next: Point) -> Result<Point, SearchError> {
    let direction: Vec<i64> = next.iter().zip(here).map(|(&b, &a)| i64::from(b) - i64::from(a)).collect();
    let mut best = next;
    let mut step = 1;
    loop {
        let ahead = shifted(&best, &direction, step, bounds);
        match best_of(memo, &[ahead], &best)? {
            Some(point) => best = point,
            None => return Ok(best),
        }
        step *= 2;
    }
}

/// The best of `points` if it beats `here` by fitness or, at a tie, by coming first.
fn best_of(memo: &mut Memo, points: &[Point], here: &Point) -> Result<Option<Point>, SearchError> {
    let values = memo.evaluate(points)?;
    let Some(mut best) = memo.get(here).map(|fitness| (fitness, here)) else {
        return Ok(None);
    };
    for (fitness, point) in values.into_iter().zip(points) {
        if fitness < best.0 || (fitness == best.0 && point < best.1) {
            best = (fitness, point);
        }
    }
    Ok((best.1 != here).then(|| best.1.clone()))
}

/// `here` with one axis one level up or down.
fn axial(here: &Point, bounds: &Bounds) -> Vec<Point> {
    let mut points = Vec::new();
    for k in 0..here.len() {
        if here[k] > bounds.low[k] {
            points.push(with(here, k, here[k] - 1));
        }
        if here[k] < bounds.high[k] {
            points.push(with(here, k, here[k] + 1));
        }
    }
    points
}

/// On a plateau, where some of `tied` have the fitness of `here`: the points with one axis at its lowest
/// level, so that the first point of a plateau is found in a jump per axis. Plateaus are common: with a
/// specular switch off, nothing else of the lobe matters.
fn floors(memo: &Memo, tied: &[Point], here: &Point, bounds: &Bounds) -> Vec<Point> {
    let level = memo.get(here);
    if !tied.iter().any(|point| memo.get(point) == level) {
        return Vec::new();
    }
    (0..here.len()).map(|k| with(here, k, bounds.low[k])).collect()
}

/// All points at a Chebyshev distance of exactly `reach`, over the axes with more than two levels.
fn ring(here: &Point, bounds: &Bounds, reach: u32) -> Vec<Point> {
    let wide: Vec<usize> = (0..here.len()).filter(|&k| bounds.high[k] - bounds.low[k] > 1).collect();
    if wide.len() <= FULL_DIAGONALS {
        return shell(here, bounds, &wide, reach);
    }
    let mut points = Vec::new();
    for (n, &first) in wide.iter().enumerate() {
        for &second in &wide[n + 1..] {
            points.extend(shell(here, bounds, &[first, second], reach));
        }
    }
    points
}

/// All points at a Chebyshev distance of exactly `reach` from `here` that differ only along `axes`.
fn shell(here: &Point, bounds: &Bounds, axes: &[usize], reach: u32) -> Vec<Point> {
    let mut cube = Bounds { low: here.clone(), high: here.clone() };
    for &k in axes {
        cube.low[k] = here[k].saturating_sub(reach).max(bounds.low[k]);
        cube.high[k] = here[k].saturating_add(reach).min(bounds.high[k]);
    }
    let distance = |p: &Point| p.iter().zip(here).map(|(&a, &b)| a.abs_diff(b)).max();
    cube.points().filter(|p| distance(p) == Some(reach)).collect()
}

fn with(point: &Point, axis: usize, index: u32) -> Point {
    let mut moved = point.clone();
    moved[axis] = index;
    moved
}

fn shifted(point: &Point, direction: &[i64], step: i64, bounds: &Bounds) -> Point {
    let moved: Point = point
        .iter()
        .zip(direction)
        .map(|(&i, &d)| {
            i64::from(i).saturating_add(d.saturating_mul(step)).clamp(0, i64::from(u32::MAX)) as u32
        })
        .collect();
    bounds.clamp(&moved)
}
