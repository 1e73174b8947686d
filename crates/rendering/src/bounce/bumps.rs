//! The functions χ between which interreflection is worked out.

use glam::DVec3;
use nalgebra::DMatrix;

use crate::functions::COUNT;
use crate::scene::Scene;

/// The functions χ: smooth bumps about the points that the spheres stand over.
pub(super) struct Bumps {
    /// Foot of each sphere and its radius.
    feet: Vec<(DVec3, f64)>,
    /// Functions of each sphere, with or without angular ones.
    share: usize,
}

impl Bumps {
    pub(super) fn new(scene: &Scene) -> Self {
        let feet: Vec<(DVec3, f64)> =
            scene.spheres.iter().take(COUNT).map(|s| (DVec3::from(s.centre), s.radius)).collect();
        Self { share: COUNT / feet.len().max(1), feet }
    }

    pub(super) fn at(&self, point: DVec3) -> [f32; COUNT] {
        let mut values = [0.0; COUNT];
        for ((foot, radius), values) in self.feet.iter().zip(values.chunks_mut(self.share)) {
            let (x, z) = ((point.x - foot.x) / radius, (point.z - foot.z) / radius);
            let distance = x.hypot(z);
            let angular = if self.share >= 12 { 3 } else { 1 };
            let hats = self.share / angular;
            // Hats on a logarithmic scale up to 4 radii.
            let place = (1.0 + 4.0 * distance).ln() / 17f64.ln() * (hats - 1).max(1) as f64;
            let scale = 1.0 / (distance + 0.1);
            for k in 0..hats {
                let last = k + 1 == hats && place > k as f64;
                let hat = if last {
                    1.0 / (1.0 + place - k as f64).powi(4)
                } else {
                    (1.0 - (place - k as f64).abs()).max(0.0)
                };
                let factors = [1.0, x * scale, z * scale];
                (0..angular).for_each(|i| values[angular * k + i] = (hat * factors[i]) as f32);
            }
        }
        values
    }

    /// How much the irradiance of an area matters: the more, the closer it is to a sphere.
    pub(super) fn importance(&self, point: DVec3) -> f64 {
        let near = |(foot, radius): &(DVec3, f64)| {
            let distance = (point.x - foot.x).hypot(point.z - foot.z) / radius;
            1.0 / (distance * distance + 0.05)
        };
        self.feet.iter().map(near).sum()
    }
}

/// The weighted least-squares fit by the functions χ: `(XᵀWX)⁻¹ XᵀW`.
pub(super) fn fit(chi: &[[f32; COUNT]], importance: &[f64]) -> DMatrix<f64> {
    let x = DMatrix::from_fn(chi.len(), COUNT, |g, a| f64::from(chi[g][a]));
    let weighted = DMatrix::from_fn(COUNT, chi.len(), |a, g| x[(g, a)] * importance[g]);
    let mut normal = &weighted * &x;
    // Functions that are 0 everywhere stay out.
    let floor = 1e-9 * normal.diagonal().max();
    (0..COUNT).for_each(|a| normal[(a, a)] += floor);
    normal.cholesky().map_or_else(|| DMatrix::zeros(COUNT, chi.len()), |c| c.solve(&weighted))
}
