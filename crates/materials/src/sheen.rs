//! Sheen of cloth: the "Charlie" lobe of Estevez & Kulla (2017), Production Friendly Microfacet Sheen BRDF.
//!
//! `f = D/(4 cos θ_i cos θ_o (1 + Λ(θ_i) + Λ(θ_o)))` with `D = (2 + 1/α) sin^(1/α) θ_h/(2π)`: most normals lie near the
//! horizon, like those of fibres that stand on the surface.
//!
//! Known defect: the published fit of Λ does not bound the lobe's albedo by 1. Below α = 0.07 a grazing direction reflects
//! more than arrives, three times as much at α = 0.005.

use std::f64::consts::{PI, TAU};

use crate::fresnel::mix;
use crate::{Geometry, Real};

/// Intervals of the table of directional albedos.
const INTERVALS: usize = 64;

/// The white Charlie lobe of one width, with its directional albedo.
#[derive(Clone, Debug)]
pub struct Charlie {
    /// Width: 1/α is the power of the sine.
    alpha: f64,
    /// Coefficients a to e of the fit of ln Λ, interpolated to α.
    fit: [f64; 5],
    /// Directional albedo at `cos = (k/INTERVALS)³`.
    albedo: Vec<f64>,
}

impl Charlie {
    /// The narrowest lobe; below, hardly any pair of directions above the surface sees it.
    pub const NARROWEST: f64 = 0.005;

    /// The lobe of width α from 0 to 1, [`Charlie::NARROWEST`] at least.
    pub fn new(alpha: f64) -> Self {
        let alpha = alpha.max(Self::NARROWEST);
        // The fits for α = 1 and α = 0, blended with (1 − α)².
        let wide = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
        let narrow = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
        let fit = std::array::from_fn(|k| mix(wide[k], narrow[k], (1.0 - alpha) * (1.0 - alpha)));
        let mut lobe = Self { alpha, fit, albedo: Vec::new() };
        // The albedo has no limit in the surface itself: the first node lies a little above.
        let cos = |k: usize| (k as f64 / INTERVALS as f64).powi(3).max(1e-6);
        lobe.albedo = (0..=INTERVALS).map(|k| lobe.integrate(cos(k))).collect();
        lobe
    }

    /// The BRDF, in 1/sr.
    #[inline(always)]
    pub fn brdf<T: Real>(&self, g: &Geometry<T>) -> T {
        let one = T::one();
        let tan2 = g.tan2_h[0] + g.tan2_h[1];
        let power = 1.0 / self.alpha;
        let density = T::of((2.0 + power) / TAU) * (tan2 / (one + tan2)).powf(T::of(0.5 * power));
        let masking = one + self.lambda(g.cos_i()) + self.lambda(g.cos_o());
        density / (T::of(4.0) * g.cos_i() * g.cos_o() * masking)
    }

    /// Share of the light from a direction that the lobe reflects, cut off at 1: a table of quadratures, interpolated with an
    /// error below 1.5e-3.
    #[inline(always)]
    pub fn directional_albedo<T: Real>(&self, cos: T) -> T {
        let at = cos.max(T::zero()).cbrt() * T::of(INTERVALS as f64);
        let k = at.to_usize().unwrap_or(0).min(INTERVALS - 1);
        let node = |k: usize| T::of(self.albedo[k]);
        mix(node(k), node(k + 1), at - T::of(k as f64)).min(T::one())
    }

    /// Smith's auxiliary function: the fit of Estevez & Kulla (2017), mirrored about cos = ½.
    #[inline(always)]
    fn lambda<T: Real>(&self, cos: T) -> T {
        let half = T::of(0.5);
        if cos < half {
            return self.ln_lambda(cos).exp();
        }
        let mirrored = (T::one() - cos).max(T::zero());
        (T::of(2.0) * self.ln_lambda(half) - self.ln_lambda(mirrored)).exp()
    }

    #[inline(always)]
    fn ln_lambda<T: Real>(&self, x: T) -> T {
        let [a, b, c, d, e] = self.fit.map(T::of);
        a / (T::one() + b * x.powf(c)) + d * x + e
    }

    /// The directional albedo by quadrature over all light directions.
    fn integrate(&self, cos_o: f64) -> f64 {
        const ROWS: usize = 48;
        const COLUMNS: usize = 32;
        let wo = [(1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o];
        let mut sum = 0.0;
        for row in 0..ROWS {
            // cos = t³ puts the nodes where narrow lobes are: near the horizon.
            let t = (row as f64 + 0.5) / ROWS as f64;
            let (cos_i, weight) = (t.powi(3), 3.0 * t * t / ROWS as f64);
            let sin_i = (1.0 - cos_i * cos_i).sqrt();
            for column in 0..COLUMNS {
                let phi = PI * (column as f64 + 0.5) / COLUMNS as f64;
                let wi = [sin_i * phi.cos(), sin_i * phi.sin(), cos_i];
                let f = Geometry::new(wi, wo).map_or(0.0, |g| self.brdf(&g));
                sum += f * cos_i * weight * TAU / COLUMNS as f64;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolated_albedo_is_near_the_integral() {
        for roughness in [0.0, 0.1, 0.2, 0.35, 0.5, 0.8, 1.0f64] {
            let lobe = Charlie::new(roughness * roughness);
            for k in 1..200 {
                let cos = k as f64 / 200.0;
                let (table, exact) = (lobe.directional_albedo(cos), lobe.integrate(cos).min(1.0));
                assert!((table - exact).abs() < 1.5e-3, "{roughness} at {cos}: {table} instead of {exact}");
            }
        }
    }
}
