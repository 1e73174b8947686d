//! Directions drawn from an environment map in proportion to its radiance.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec4Swizzles};

use crate::EnvironmentMap;
use crate::angles::map_direction;

/// Lamps whose reflections are searched for, at most; those within an angle of a brighter one (in radians) count as part
/// of it.
const MOST_SPOTS: usize = 4;
const SPOT: f64 = 0.15;
/// So far, in metres, that a direction is a place.
const FAR: f64 = 1e6;

/// An environment with a density of directions: constant over each texel, in proportion to the mean of the map there.
#[derive(Debug)]
pub(super) struct Sky {
    map: EnvironmentMap,
    /// In turns.
    rotation: f64,
    height: usize,
    /// Share of the rows up to each one's lower edge.
    rows: Vec<f64>,
    /// For each row, share of its texels up to each one's right edge.
    columns: Vec<f64>,
}

impl Sky {
    pub(super) fn new(map: EnvironmentMap) -> Self {
        let (height, rotation) = map.grid();
        let mut sky = Self { map, rotation, height, rows: Vec::new(), columns: Vec::new() };
        let width = sky.width();
        let brightness: Vec<f64> =
            (0..width * height).map(|i| sky.brightness(i % width, i / width)).collect();
        for y in 0..height {
            let mut row: Vec<f64> =
                (0..width).map(|x| spread(&brightness, (width, height), (x, y))).collect();
            let total = accumulate(&mut row);
            sky.columns.extend(row);
            sky.rows.push(total * sky.solid_angle(y));
        }
        accumulate(&mut sky.rows);
        sky
    }

    /// Radiance from a unit direction.
    pub(super) fn radiance(&self, direction: DVec3) -> DVec3 {
        self.map.radiance(direction, 0.0).xyz().as_dvec3()
    }

    /// Places far away in the directions of the brightest lamps of the map, one for each spot.
    pub(super) fn spots(&self) -> Vec<DVec3> {
        let power = |lamp: &&(DVec3, crate::Rgb)| lamp.1.element_sum();
        let mut lamps: Vec<_> = self.map.lamps.iter().collect();
        lamps.sort_by(|a, b| power(b).total_cmp(&power(a)));
        let mut spots: Vec<DVec3> = Vec::new();
        for (direction, _) in lamps {
            if spots.len() < MOST_SPOTS && spots.iter().all(|s| s.dot(*direction) < SPOT.cos()) {
                spots.push(*direction);
            }
        }
        spots.into_iter().map(|direction| direction * FAR).collect()
    }

    /// Draws a unit direction from two numbers in `[0, 1)`; with its density in 1/sr.
    pub(super) fn sample(&self, [u, v]: [f64; 2]) -> (DVec3, f64) {
        let (y, fy) = invert(&self.rows, v);
        let (x, fx) = invert(self.row(y), u);
        // Equal areas of a texel get equal solid angles.
        let cos = self.edge(y) + fy * (self.edge(y + 1) - self.edge(y));
        let direction = map_direction((x as f64 + fx) / self.width() as f64 + self.rotation, cos.acos() / PI);
        (direction, self.texel_density(x, y))
    }

    /// Density of [`Sky::sample`], in 1/sr.
    pub(super) fn density(&self, w: DVec3) -> f64 {
        let u = (w.x.atan2(-w.z) / TAU - self.rotation).rem_euclid(1.0);
        let v = w.y.clamp(-1.0, 1.0).acos() / PI;
        let texel = |t: f64, n: usize| ((t * n as f64) as usize).min(n - 1);
        self.texel_density(texel(u, self.width()), texel(v, self.height))
    }

    fn texel_density(&self, x: usize, y: usize) -> f64 {
        share(&self.rows, y) * share(self.row(y), x) / self.solid_angle(y)
    }

    fn width(&self) -> usize {
        2 * self.height
    }

    fn row(&self, y: usize) -> &[f64] {
        &self.columns[y * self.width()..(y + 1) * self.width()]
    }

    /// Cosine of the polar angle at the upper edge of a row.
    fn edge(&self, row: usize) -> f64 {
        (PI * row as f64 / self.height as f64).cos()
    }

    /// Of one texel of a row, in sr.
    fn solid_angle(&self, row: usize) -> f64 {
        (self.edge(row) - self.edge(row + 1)) * TAU / self.width() as f64
    }

    /// Sum of the channels in the middle of a texel. Luminance would starve blue light, which is worth as much here.
    fn brightness(&self, x: usize, y: usize) -> f64 {
        let at = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
        self.radiance(map_direction(at(x, self.width()) + self.rotation, at(y, self.height))).element_sum()
    }
}

/// The mean over a texel of what is interpolated between its neighbours: where any of them is bright, it is not 0.
fn spread(brightness: &[f64], (width, height): (usize, usize), (x, y): (usize, usize)) -> f64 {
    const SHARES: [f64; 3] = [0.125, 0.75, 0.125];
    let row = |k: usize| (y + k).clamp(1, height) - 1;
    let column = |k: usize| (x + k + width - 1) % width;
    let row_mean = |k| (0..3).map(|j| SHARES[j] * brightness[row(k) * width + column(j)]).sum::<f64>();
    (0..3).map(|k| SHARES[k] * row_mean(k)).sum()
}

/// Turns weights into shares up to and with each; even ones where all weights are 0. Returns the sum of the weights.
fn accumulate(weights: &mut [f64]) -> f64 {
    let total: f64 = weights.iter().sum();
    let (count, mut sum) = (weights.len() as f64, 0.0);
    for (k, weight) in weights.iter_mut().enumerate() {
        sum += *weight;
        *weight = if total > 0.0 { sum / total } else { (k + 1) as f64 / count };
    }
    if let Some(last) = weights.last_mut() {
        *last = 1.0;
    }
    total
}

/// The interval that holds a number, and where in it the number lies.
fn invert(shares: &[f64], u: f64) -> (usize, f64) {
    let k = shares.partition_point(|s| *s <= u).min(shares.len() - 1);
    let start = if k == 0 { 0.0 } else { shares[k - 1] };
    (k, (u - start) / (shares[k] - start))
}

fn share(shares: &[f64], k: usize) -> f64 {
    shares[k] - if k == 0 { 0.0 } else { shares[k - 1] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::zero_two;
    use lookmatch_imaging::Image;

    fn lamp() -> Sky {
        let lamp = |x: usize, y: usize| if (x, y) == (20, 3) { 900.0 } else { 0.0 };
        Sky::new(EnvironmentMap::new(&Image::from_fn(64, 32, |x, y| [lamp(x, y); 3]), 1.0, 33.0))
    }

    #[test]
    fn samples_have_the_density_that_is_told() {
        let sky = lamp();
        for i in 0..1000 {
            let (direction, density) = sky.sample(zero_two(i));
            assert!((direction.length() - 1.0).abs() < 1e-12);
            assert!((sky.density(direction) / density - 1.0).abs() < 1e-9, "{direction} {density}");
        }
    }

    #[test]
    fn densities_integrate_to_one_and_cover_all_light() {
        let sky = lamp();
        let count = 1 << 16;
        let uniform = |i| {
            let [u, v] = zero_two(i);
            map_direction(u, (1.0 - 2.0 * v).acos() / PI)
        };
        let densities = (0..count).map(|i| (sky.density(uniform(i)), sky.radiance(uniform(i))));
        let mut integral = 0.0;
        for (density, radiance) in densities {
            integral += density * 4.0 * PI / f64::from(count);
            assert!(density > 0.0 || radiance == DVec3::ZERO);
        }
        assert!((integral - 1.0).abs() < 0.01, "{integral}");
    }

    #[test]
    fn a_black_sky_has_an_even_density() {
        let sky = Sky::new(EnvironmentMap::new(&Image::new(16, 8), 1.0, 0.0));
        let (direction, density) = sky.sample([0.3, 0.7]);
        assert!(direction.is_finite() && density > 0.0);
    }
}
