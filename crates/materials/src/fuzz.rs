//! A layer of fibres: Zeltner, Burley & Chiang 2022, *Practical multiple-scattering sheen using linearly transformed cosines*.
//!
//! `f = R(θ_o) (a/|M⁻¹ω_i|²)²/π` with `M⁻¹ω = (a x + b z, a y, z)` in the frame where the view lies in the x-z plane; R is the layer's
//! directional albedo. The article tabulates a, b and R over cos θ_o and roughness. Here they are the rational and Gaussian fits that MaterialX
//! 1.39 evaluates for its `sheen_bsdf` in mode `zeltner` (mx_microfacet_sheen.glsl, Apache-2.0), which the reference graph of OpenPBR uses; how far
//! they are from the tables was not measured. Not reciprocal.

use std::f64::consts::{FRAC_1_PI, TAU};

use crate::{Geometry, Real};

/// The layer, of weight 1 and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fuzz {
    /// Mean, width and floor of the Gaussian that the albedo is as a function of the cosine.
    mean: f64,
    width: f64,
    floor: f64,
    roughness: f64,
}

impl Fuzz {
    /// A layer of a roughness from 0 to 1, of which less than 0.01 counts as 0.01.
    pub(crate) fn new(roughness: f64) -> Self {
        let y = roughness.clamp(0.01, 1.0);
        Self {
            mean: y * (-0.193854 + y * (-1.14885 + y * (1.7932 - 0.95943 * y * y))) / (0.046391 + y),
            width: y * (0.0206607 + 1.58491 * y) / (0.0379424 + y * (1.32227 + y)),
            floor: y * (0.000654023 + y * (-0.0207818 + 0.119681 * y)) / (1.26264 + y * (y - 1.92021)),
            roughness: y,
        }
    }

    /// Directional albedo R of a view direction.
    #[inline(always)]
    pub(crate) fn albedo<T: Real>(&self, cos_o: T) -> T {
        let deviation = (cos_o - T::of(self.mean)) * T::of(1.0 / self.width);
        let peak = T::of(1.0 / (self.width * TAU.sqrt()));
        (peak * (T::of(-0.5) * deviation * deviation).exp() + T::of(self.floor)).max(T::zero()).min(T::one())
    }

    /// The BRDF over its albedo R, in 1/sr.
    #[inline(always)]
    pub(crate) fn at<T: Real>(&self, g: &Geometry<T>) -> T {
        let (one, x, y) = (T::one(), g.cos_o(), self.roughness);
        let a = (T::of(2.58126 * y) * x + T::of(0.813703 * y * y))
            / (one + T::of(0.310327) * x * x + T::of(2.60994 * y) * x);
        let b = (one - x).max(T::zero()).sqrt() * T::of((y - 1.0) * y.powi(3))
            / (T::of(0.0000254053 + 1.34174 * y * y) + T::of(1.71228 - 1.71506 * y) * x);
        // Only the light's part along the view's azimuth matters beyond its polar angle.
        let around = (g.wo[0] * g.wo[0] + g.wo[1] * g.wo[1]).sqrt();
        let along =
            if around > T::zero() { (g.wi[0] * g.wo[0] + g.wi[1] * g.wo[1]) / around } else { g.wi[0] };
        let across2 = (one - g.cos_i() * g.cos_i() - along * along).max(T::zero());
        let shifted = a * along + b * g.cos_i();
        let length2 = shifted * shifted + a * a * across2 + g.cos_i() * g.cos_i();
        T::of(FRAC_1_PI) * (a / length2).powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lobe_reflects_as_much_as_its_albedo_says() {
        for roughness in [0.1, 0.5, 1.0] {
            let fuzz = Fuzz::new(roughness);
            for mu in [0.1f64, 0.5, 1.0] {
                let wo = [(1.0 - mu * mu).sqrt() * 0.6, (1.0 - mu * mu).sqrt() * 0.8, mu];
                let n = 800;
                let sum: f64 = (0..n * n)
                    .map(|k| {
                        // Thin fibres scatter along the surface: cubes put nodes there.
                        let t = ((k / n) as f64 + 0.5) / n as f64;
                        let (cos, phi) = (t.powi(3), TAU * ((k % n) as f64 + 0.5) / n as f64);
                        let sin = (1.0 - cos * cos).sqrt();
                        let g = Geometry::new([sin * phi.cos(), sin * phi.sin(), cos], wo);
                        g.map_or(0.0, |g| fuzz.at(&g)) * cos * 3.0 * t * t * TAU / (n * n) as f64
                    })
                    .sum();
                assert!((sum - 1.0).abs() < 5e-3, "{roughness} at {mu}: {sum}");
            }
        }
    }
}
