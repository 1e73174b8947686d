//! Sheen of cloth: the "Charlie" distribution of Estevez & Kulla (2017), *Production Friendly Microfacet Sheen BRDF*.
//!
//! `f = D V` with `D = (2 + 1/α) sin^(1/α) θ_h/(2π)`: most normals lie near the horizon, like those of fibres that stand on the
//! surface. There are two [`Visibility`] terms V.
//!
//! Known defect: neither V bounds the lobe's albedo by 1. With the article's own, a grazing direction reflects more than arrives
//! below α = 0.07, three times as much at α = 0.005; with the other, 1.3 times as much at α = 0.1 and 5.4 times at 0.005.

use std::f64::consts::PI;
use std::sync::LazyLock;

use crate::fresnel::mix;
use crate::quadrature::Gauss;
use crate::{Geometry, Real};

/// Intervals of the table of directional albedos, and how many of them lie between two quadratures.
const INTERVALS: usize = 256;
const REFINEMENT: usize = 4;

/// What masking makes of the denominator of microfacet models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// `1/(4 cos θ_i cos θ_o (1 + Λ(θ_i) + Λ(θ_o)))` with the article's fit of Λ, as glTF has it.
    Smith,
    /// `1/(4 (cos θ_i + cos θ_o − cos θ_i cos θ_o))` of Neubelt & Pettineo (2013), as MaterialX has it.
    Neubelt,
}

/// The white Charlie lobe of one width, with its directional albedo.
#[derive(Clone, Debug)]
pub struct Charlie {
    visibility: Visibility,
    /// Half the power of the sine, 1/(2α).
    half_power: f64,
    /// (2 + 1/α)/(8π): that of the distribution, with the 4 of the denominator.
    scale: f64,
    /// Coefficients a to e of the fit of ln Λ, interpolated to α.
    fit: [f64; 5],
    /// Directional albedo at `cos = (k/INTERVALS)³`.
    albedo: Vec<f64>,
}

impl Charlie {
    /// The narrowest lobe; below, hardly any pair of directions above the surface sees it.
    pub const NARROWEST: f64 = 0.005;

    /// The lobe of width α from 0 to 1, [`Charlie::NARROWEST`] at least.
    pub fn new(alpha: f64, visibility: Visibility) -> Self {
        let alpha = alpha.max(Self::NARROWEST);
        // The fits for α = 1 and α = 0, blended with (1 − α)².
        let wide = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
        let narrow = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
        let fit = std::array::from_fn(|k| mix(wide[k], narrow[k], (1.0 - alpha) * (1.0 - alpha)));
        let (half_power, scale) = (0.5 / alpha, (2.0 + 1.0 / alpha) / (8.0 * PI));
        let mut lobe = Self { visibility, half_power, scale, fit, albedo: Vec::new() };
        lobe.albedo = lobe.tabulated(&RAYS);
        lobe
    }

    /// The BRDF, in 1/sr.
    #[inline(always)]
    pub fn brdf<T: Real>(&self, g: &Geometry<T>) -> T {
        let tan2 = g.tan2_h[0] + g.tan2_h[1];
        let density = T::of(self.scale) * (tan2 / (T::one() + tan2)).powf(T::of(self.half_power));
        density
            / self.denominator([g.cos_i(), g.cos_o()], || [self.lambda(g.cos_i()), self.lambda(g.cos_o())])
    }

    /// Share of the light from a direction that the lobe reflects, cut off at 1: a table with an error below 2e-4.
    #[inline(always)]
    pub fn directional_albedo<T: Real>(&self, cos: T) -> T {
        let at = cos.max(T::zero()).cbrt() * T::of(INTERVALS as f64);
        let k = at.to_usize().unwrap_or(0).min(INTERVALS - 1);
        let node = |k: usize| T::of(self.albedo[k]);
        mix(node(k), node(k + 1), at - T::of(k as f64)).min(T::one())
    }

    /// `1/(4 V)` from two cosines and what gives their Λ.
    #[inline(always)]
    fn denominator<T: Real>(&self, [ci, co]: [T; 2], lambda: impl Fn() -> [T; 2]) -> T {
        match self.visibility {
            Visibility::Smith => {
                let [i, o] = lambda();
                ci * co * (T::one() + i + o)
            }
            Visibility::Neubelt => ci + co - ci * co,
        }
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

    /// The albedo at all nodes of the table: by quadrature at every fourth, by cubic interpolation between them.
    fn tabulated(&self, rays: &Rays) -> Vec<f64> {
        let lambdas: Vec<f64> = rays.lights.iter().map(|(cos, _)| self.lambda(*cos)).collect();
        let coarse: Vec<f64> = rays.views.iter().map(|view| self.integral(rays, &lambdas, view)).collect();
        let last = coarse.len() - 1;
        let between = |k: usize| {
            // The four nodes about the interval, or nearest to it at an end.
            let first = (k / REFINEMENT).saturating_sub(1).min(last - 3);
            lagrange(&coarse[first..first + 4], k as f64 / REFINEMENT as f64 - first as f64)
        };
        (0..=INTERVALS).map(between).collect()
    }

    /// The directional albedo of a view.
    fn integral(&self, rays: &Rays, lambdas: &[f64], view: &View) -> f64 {
        let lambda_o = self.lambda(view.cos);
        let rings = view.rings.chunks_exact(rays.turns.len());
        let mut sum = 0.0;
        for (((cos_i, weight), lambda_i), ring) in rays.lights.iter().zip(lambdas).zip(rings) {
            let ring = ring.iter().zip(&rays.turns);
            let sines: f64 =
                ring.map(|(ln_sin2, (_, weight))| weight * (self.half_power * ln_sin2).exp()).sum();
            sum += weight * sines / self.denominator([*cos_i, view.cos], || [*lambda_i, lambda_o]);
        }
        self.scale * sum
    }
}

/// The directions of the quadratures. Only a power of `sin θ_h` depends on the material: its logarithm is worked out once for all.
static RAYS: LazyLock<Rays> = LazyLock::new(|| Rays::new(INTERVALS / REFINEMENT, 20, 16));

struct Rays {
    /// Cosines of the light, with weights `cos θ_i d cos θ_i`.
    lights: Vec<(f64, f64)>,
    views: Vec<View>,
    /// Cosines of the azimuths of the light in half a turn, with weights `2 dφ_i`.
    turns: Vec<(f64, f64)>,
}

struct View {
    cos: f64,
    /// `ln sin² θ_h` for the rings of all lights.
    rings: Vec<f64>,
}

impl Rays {
    fn new(views: usize, rings: usize, turns: usize) -> Self {
        // cos = t³ puts the nodes where narrow lobes are: near the horizon.
        let light = |(t, weight): (f64, f64)| (t.powi(3), 3.0 * t.powi(5) * weight);
        let lights: Vec<(f64, f64)> = Gauss::new(rings).on(0.0, 1.0).map(light).collect();
        // The ends of the half turn are nodes' limits: where the half vector is the normal, narrow lobes have a crease.
        let turn = |(phi, weight): (f64, f64)| (phi.cos(), 2.0 * weight);
        let turns: Vec<(f64, f64)> = Gauss::new(turns).on(0.0, PI).map(turn).collect();
        let view = |k: usize| {
            // The albedo has no limit in the surface itself: the first node lies a little above.
            let cos = (k as f64 / views as f64).powi(3).max(1e-6);
            let ring =
                |light: &(f64, f64)| turns.iter().map(|t| ln_sin2_h(light.0, cos, t.0)).collect::<Vec<_>>();
            View { cos, rings: lights.iter().flat_map(ring).collect() }
        };
        Self { views: (0..=views).map(view).collect(), lights, turns }
    }
}

/// `ln sin² θ_h` of the half vector of two directions, from the cosines of their polar angles and of the azimuth between them.
fn ln_sin2_h(cos_i: f64, cos_o: f64, cos_phi: f64) -> f64 {
    let (sin2_i, sin2_o) = (1.0 - cos_i * cos_i, 1.0 - cos_o * cos_o);
    let across = (sin2_i * sin2_o).sqrt() * cos_phi;
    let plane2 = (sin2_i + sin2_o + 2.0 * across).max(0.0);
    (plane2 / (plane2 + (cos_i + cos_o).powi(2))).ln()
}

/// The cubic through values at 0, 1, 2, 3.
fn lagrange(values: &[f64], x: f64) -> f64 {
    let weights = [
        -(x - 1.0) * (x - 2.0) * (x - 3.0) / 6.0,
        x * (x - 2.0) * (x - 3.0) / 2.0,
        -x * (x - 1.0) * (x - 3.0) / 2.0,
        x * (x - 1.0) * (x - 2.0) / 6.0,
    ];
    values.iter().zip(weights).map(|(v, w)| v * w).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolated_albedo_is_near_the_integral() {
        let fine = Rays::new(37, 100, 100);
        for visibility in [Visibility::Smith, Visibility::Neubelt] {
            for roughness in [0.0, 0.1, 0.2, 0.35, 0.5, 0.8, 1.0f64] {
                let lobe = Charlie::new(roughness * roughness, visibility);
                let lambdas: Vec<f64> = fine.lights.iter().map(|(cos, _)| lobe.lambda(*cos)).collect();
                for view in fine.views.iter().filter(|view| view.cos > 0.004) {
                    let exact = lobe.integral(&fine, &lambdas, view).min(1.0);
                    let table = lobe.directional_albedo(view.cos);
                    let what = format!("{visibility:?}, {roughness} at {}", view.cos);
                    assert!((table - exact).abs() < 2e-4, "{what}: {table} instead of {exact}");
                }
            }
        }
    }

    #[test]
    fn the_integral_is_that_of_the_brdf() {
        let (lobe, n) = (Charlie::new(0.3, Visibility::Smith), 300);
        let wo = [0.8, 0.0, 0.6];
        let mut sum = 0.0;
        for k in 0..n * n {
            let cos = (f64::from(k / n) + 0.5) / f64::from(n);
            let (phi, sin) = (PI * (f64::from(k % n) + 0.5) / f64::from(n), (1.0 - cos * cos).sqrt());
            let g = Geometry::new([sin * phi.cos(), sin * phi.sin(), cos], wo).unwrap();
            sum += lobe.brdf(&g) * cos * 2.0 * PI / f64::from(n * n);
        }
        assert!((sum - lobe.directional_albedo(0.6)).abs() < 2e-4, "{sum}");
    }
}
