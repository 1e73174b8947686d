//! A lobe in the basis of the rings, for every angle of view.

use std::f64::consts::FRAC_PI_2;
use std::sync::OnceLock;

use lookmatch_materials::{Bsdf, Geometry};

use crate::rings::{NODES, ROW, Ring, TERMS, chebyshev, node, project};

/// Tabulated angles of view from 0 to just short of π/2.
const ANGLES: usize = 65;
/// Interpolation points on each ring.
const POINTS: usize = 5;
/// Quadrature points between two nodes.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Coefficients of one lobe: for each channel (one if grey) and angle of view, [`ROW`] numbers.
#[derive(Clone, Debug)]
pub(crate) struct LobeTable {
    values: Vec<[f32; ROW]>,
    channels: usize,
}

/// Where an angle of view lies between two tabulated ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnglePosition {
    index: u32,
    fraction: f32,
}

impl AnglePosition {
    /// The position of a view at `theta` radians.
    pub(crate) fn new(theta: f64) -> Self {
        let x = (theta / spacing()).clamp(0.0, (ANGLES - 1) as f64);
        let index = (x as usize).min(ANGLES - 2);
        Self { index: index as u32, fraction: (x - index as f64) as f32 }
    }
}

impl LobeTable {
    /// Expands the specular lobe of an isotropic BSDF.
    pub(crate) fn new(bsdf: &dyn Bsdf) -> Self {
        let lobe: Vec<[f32; 3]> = geometries().iter().map(|p| bsdf.specular_f32(&p.geometry)).collect();
        let grey = lobe.iter().all(|[r, g, b]| r == g && g == b);
        let channels = if grey { 1 } else { 3 };
        let mut products = vec![[0.0; ROW]; channels * ANGLES];
        for (point, f) in geometries().iter().zip(&lobe) {
            for c in 0..channels {
                let products = &mut products[c * ANGLES + point.angle];
                let g = f64::from(f[c]) * point.weight;
                for k in 0..TERMS {
                    let term = g * point.terms[k];
                    products[point.interval * TERMS + k] += (1.0 - point.hat) * term;
                    products[(point.interval + 1) * TERMS + k] += point.hat * term;
                }
            }
        }
        products.iter_mut().for_each(project);
        Self { values: products.iter().map(|row| row.map(|p| p as f32)).collect(), channels }
    }

    /// The two tabulated rows around an angle of view for a channel, and where the angle lies between them.
    pub(crate) fn rows(&self, channel: usize, at: AnglePosition) -> (&[f32; ROW], &[f32; ROW], f32) {
        let start = channel.min(self.channels - 1) * ANGLES + at.index as usize;
        (&self.values[start], &self.values[start + 1], at.fraction)
    }

    /// True where all channels share one table.
    pub(crate) fn is_grey(&self) -> bool {
        self.channels == 1
    }
}

/// Distance between tabulated angles; the last lies 1e-3 short of grazing, where no geometry exists.
fn spacing() -> f64 {
    (FRAC_PI_2 - 1e-3) / (ANGLES - 1) as f64
}

/// One evaluation of a lobe: the same for every lobe, so worked out once.
struct Point {
    geometry: Geometry<f32>,
    angle: usize,
    interval: usize,
    /// Share of the right-hand hat function.
    hat: f64,
    /// `cos θ_i · 4 cos_d · sin θ_h` times the quadrature weights.
    weight: f64,
    /// Chebyshev polynomials with their interpolation weights.
    terms: [f64; TERMS],
}

fn geometries() -> &'static [Point] {
    static POINTS_OF_ALL: OnceLock<Vec<Point>> = OnceLock::new();
    POINTS_OF_ALL.get_or_init(|| (0..ANGLES).flat_map(points_of_angle).collect())
}

fn points_of_angle(angle: usize) -> Vec<Point> {
    let theta_o = angle as f64 * spacing();
    let view = (theta_o.cos(), theta_o.sin());
    let mut points = Vec::new();
    for interval in 0..NODES - 1 {
        let width = node(interval + 1) - node(interval);
        for (hat, share) in GAUSS {
            let theta_h = node(interval) + hat * width;
            let half = (theta_h.cos(), theta_h.sin());
            let Some(ring) = Ring::new(view, half) else { continue };
            for i in 0..POINTS {
                let x = (std::f64::consts::PI * (i as f64 + 0.5) / POINTS as f64).cos();
                let cos_d = ring.cos_d(x);
                let Some(geometry) = Geometry::from_half_vector(view, half, cos_d) else { continue };
                let weight = geometry.cos_i() * 4.0 * cos_d * half.1 * share * width;
                let mut terms = chebyshev(x).map(|t| t * 2.0 / POINTS as f64);
                terms[0] /= 2.0;
                points.push(Point { geometry: geometry.to_f32(), angle, interval, hat, weight, terms });
            }
        }
    }
    points
}
