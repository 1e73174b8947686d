//! A grid on the checkerboard, dense about the points that the spheres stand over.

use glam::DVec3;

use crate::scene::Scene;

/// Distances of grid lines from the middle of a sphere, in radii.
const LINES: [f64; 14] = [0.0, 0.06, 0.13, 0.21, 0.31, 0.43, 0.58, 0.77, 1.0, 1.3, 1.7, 2.3, 3.1, 4.2];
/// Lines closer than this, in radii of the smallest sphere, are one.
const CLOSE: f64 = 0.04;

/// The lines of the grid; between its nodes, bilinear interpolation.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    x: Vec<f64>,
    z: Vec<f64>,
    height: f64,
}

impl Grid {
    /// The grid of a scene with a checkerboard of half the side `half` at `height`.
    pub(crate) fn new(scene: &Scene, height: f64, half: f64) -> Self {
        let lines = |axis: usize| {
            let around = |s: &crate::Sphere| {
                let (centre, radius) = (s.centre[axis], s.radius);
                LINES.into_iter().flat_map(move |d| [centre - radius * d, centre + radius * d])
            };
            let mut lines: Vec<f64> =
                scene.spheres.iter().flat_map(around).filter(|x| x.abs() < half).collect();
            lines.sort_by(f64::total_cmp);
            let least = scene.spheres.iter().map(|s| s.radius).fold(f64::INFINITY, f64::min) * CLOSE;
            lines.dedup_by(|a, b| *a - *b < least);
            lines.retain(|x| half - x.abs() > least);
            lines.insert(0, -half);
            lines.push(half);
            lines
        };
        Self { x: lines(0), z: lines(2), height }
    }

    pub(crate) fn len(&self) -> usize {
        self.x.len() * self.z.len()
    }

    /// The place of a node.
    pub(crate) fn point(&self, node: usize) -> DVec3 {
        DVec3::new(self.x[node % self.x.len()], self.height, self.z[node / self.x.len()])
    }

    /// The area that a node stands for.
    pub(crate) fn area(&self, node: usize) -> f64 {
        let width = |lines: &[f64], k: usize| {
            (lines[(k + 1).min(lines.len() - 1)] - lines[k.saturating_sub(1)]) / 2.0
        };
        width(&self.x, node % self.x.len()) * width(&self.z, node / self.x.len())
    }

    /// The nodes around a point, with their weights.
    pub(crate) fn around(&self, x: f64, z: f64) -> [(usize, f64); 4] {
        let locate = |lines: &[f64], v: f64| {
            let k = lines.partition_point(|l| *l <= v).clamp(1, lines.len() - 1) - 1;
            (k, ((v - lines[k]) / (lines[k + 1] - lines[k])).clamp(0.0, 1.0))
        };
        let ((i, tx), (j, tz)) = (locate(&self.x, x), locate(&self.z, z));
        let node = |di: usize, dj: usize| (j + dj) * self.x.len() + i + di;
        [
            (node(0, 0), (1.0 - tx) * (1.0 - tz)),
            (node(1, 0), tx * (1.0 - tz)),
            (node(0, 1), (1.0 - tx) * tz),
            (node(1, 1), tx * tz),
        ]
    }
}
