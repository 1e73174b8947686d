//! Diffuse reflection of rough surfaces made of Lambertian facets: the four usual forms of Oren & Nayar's model, for all materials
//! that contain one. The formulas and their sources stand at the head of [`crate::models::oren_nayar`].

use std::f64::consts::{FRAC_1_PI, PI};

use crate::{Geometry, Real};

/// Oren & Nayar's qualitative model (1994, eq. 30), white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Qualitative {
    a: f64,
    b: f64,
}

impl Qualitative {
    /// A surface of facets whose angles have a standard deviation, in radians.
    pub(crate) fn new(sigma: f64) -> Self {
        let s2 = sigma * sigma;
        Self { a: 1.0 - 0.5 * s2 / (s2 + 0.33), b: 0.45 * s2 / (s2 + 0.09) }
    }

    /// True where it is Lambert's reflection.
    pub(crate) fn is_smooth(&self) -> bool {
        self.b == 0.0
    }

    /// The BRDF, in 1/sr.
    #[inline(always)]
    pub(crate) fn at<T: Real>(&self, g: &Geometry<T>) -> T {
        // cos φ sin α tan β = (x_i x_o + y_i y_o)/max(cos θ_i, cos θ_o).
        let swing = dot_xy(g).max(T::zero()) / g.cos_i().max(g.cos_o());
        T::of(FRAC_1_PI * self.a) + T::of(FRAC_1_PI * self.b) * swing
    }
}

/// Oren & Nayar's functional approximation (1994), with a second bounce.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Full {
    /// Factors of C₁, C₂, C₃.
    first: [f64; 3],
    second: f64,
}

impl Full {
    /// A surface of facets whose angles have a standard deviation, in radians.
    pub(crate) fn new(sigma: f64) -> Self {
        let s2 = sigma * sigma;
        let c3 = 0.125 * s2 / (s2 + 0.09) * (4.0 / (PI * PI)).powi(2);
        Self {
            first: [1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09), c3],
            second: 0.17 * FRAC_1_PI * s2 / (s2 + 0.13),
        }
    }

    /// The BRDF with facets of a colour, in 1/sr.
    #[inline(always)]
    pub(crate) fn at<T: Real>(&self, g: &Geometry<T>, colour: [f64; 3]) -> [T; 3] {
        let [c1, c2, c3] = self.first.map(T::of);
        let (one, s) = (T::one(), dot_xy(g));
        let (sin_i, sin_o) = (sine(&g.wi), sine(&g.wo));
        let (angle_i, angle_o) = (sin_i.atan2(g.cos_i()), sin_o.atan2(g.cos_o()));
        let (alpha, beta) = (angle_i.max(angle_o), angle_i.min(angle_o));
        let sines = sin_i * sin_o;
        // At the pole there is no azimuth; what it multiplies vanishes there.
        let cos_phi = if sines > T::zero() { (s / sines).max(-one).min(one) } else { T::zero() };
        let turn = T::of(2.0 / PI) * beta;
        let bent = if s < T::zero() { one - turn.powi(3) / sin_i.max(sin_o) } else { one };
        let c2 = c2 * bent * s / g.cos_i().max(g.cos_o());
        let c3 = c3 * (alpha * beta).powi(2);
        let tan_half = (sin_i + sin_o) / (g.cos_i() + g.cos_o());
        let first = (c1 + c2 + (one - cos_phi.abs()) * c3 * tan_half) * T::of(FRAC_1_PI);
        let second = (one - cos_phi * turn * turn) * T::of(self.second);
        colour.map(|c| (T::of(c) * (first + T::of(c) * second)).max(T::zero()))
    }
}

/// Fujii's form, white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fujii {
    /// Roughness r, 0 to 1.
    roughness: f64,
    /// `1/(π + (π/2 − 2/3) r)`.
    scale: f64,
}

impl Fujii {
    /// A surface of a roughness from 0 to 1.
    pub(crate) fn new(roughness: f64) -> Self {
        Self { roughness, scale: FRAC_1_PI / (1.0 + C1 * roughness) }
    }

    /// The BRDF, in 1/sr.
    #[inline(always)]
    pub(crate) fn at<T: Real>(&self, g: &Geometry<T>) -> T {
        T::of(self.scale) * swung(g, self.roughness)
    }
}

/// ½ − 2/(3π) and ⅔ − 28/(15π): what directional and mean albedo of Fujii's form are made of.
const C1: f64 = 0.5 - 2.0 / (3.0 * PI);
const C2: f64 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// Fujii's form with the light of all further bounces (Portsmouth, Kutz & Hill 2025, *EON: A practical energy-preserving rough
/// diffuse BRDF*), with the exact directional albedo E:
///
/// `f = ρ/π · A (1 + r s/t) + ρ_ms/π · (1 − E(θ_i)) (1 − E(θ_o))/(1 − Ē)` with `A = 1/(1 + (½ − 2/(3π)) r)` and
/// `ρ_ms = ρ² Ē/(1 − ρ (1 − Ē))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Eon {
    /// Roughness r, 0 to 1.
    roughness: f64,
    /// Factor of the light scattered once, per channel.
    single: [f64; 3],
    /// Factor of the light scattered more often, per channel.
    multiple: [f64; 3],
}

impl Eon {
    /// A reflection of a colour, 0 to 1 per channel, with a roughness from 0 to 1, times a weight.
    pub(crate) fn new(weight: f64, colour: [f64; 3], roughness: f64) -> Self {
        let a = 1.0 / (1.0 + C1 * roughness);
        let lost = a * roughness * (C1 - C2);
        let again = |rho: f64| rho * rho * (1.0 - lost) / (1.0 - rho * lost);
        Self {
            roughness,
            single: colour.map(|rho| weight * FRAC_1_PI * rho * a),
            // 1 − E and 1 − Ē have the factor A r in common.
            multiple: colour.map(|rho| weight * FRAC_1_PI * again(rho) * a * roughness / (C1 - C2)),
        }
    }

    /// The BRDF, in 1/sr.
    #[inline(always)]
    pub(crate) fn at<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        if self.roughness == 0.0 {
            return self.single.map(T::of);
        }
        let single = swung(g, self.roughness);
        let multiple = missing(g.cos_i()) * missing(g.cos_o());
        std::array::from_fn(|c| T::of(self.single[c]) * single + T::of(self.multiple[c]) * multiple)
    }
}

/// `1 + r s/t`.
#[inline(always)]
fn swung<T: Real>(g: &Geometry<T>, roughness: f64) -> T {
    let s = dot_xy(g);
    let t = if s > T::zero() { g.cos_i().max(g.cos_o()) } else { T::one() };
    T::one() + T::of(roughness) * s / t
}

/// `(1 − E(θ))/(A r)`: what single scattering loses, over the roughness.
#[inline(always)]
fn missing<T: Real>(cos: T) -> T {
    let (one, cos) = (T::one(), cos.min(T::one()));
    let sin = (one - cos * cos).sqrt();
    // (tan θ)(1 − sin³ θ) without the cancellation at grazing angles.
    let rest = sin * cos * (one + sin + sin * sin) / (one + sin);
    let g = sin * (cos.acos() - sin * cos) + T::of(2.0 / 3.0) * (rest - sin);
    (T::of(C1) - T::of(FRAC_1_PI) * g).max(T::zero())
}

#[inline(always)]
fn dot_xy<T: Real>(g: &Geometry<T>) -> T {
    g.wi[0] * g.wo[0] + g.wi[1] * g.wo[1]
}

#[inline(always)]
fn sine<T: Real>(w: &[T; 3]) -> T {
    (w[0] * w[0] + w[1] * w[1]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_white_surface_reflects_everything() {
        for roughness in [0.0, 0.3, 1.0] {
            let eon = Eon::new(1.0, [1.0; 3], roughness);
            for mu in [0.05f64, 0.4, 1.0] {
                let wo = [(1.0 - mu * mu).sqrt(), 0.0, mu];
                let (rings, turns) = (400, 64);
                let mut albedo = 0.0;
                for k in 0..rings * turns {
                    let sin2 = ((k / turns) as f64 + 0.5) / rings as f64;
                    let phi = 2.0 * PI * ((k % turns) as f64 + 0.5) / turns as f64;
                    let wi = [sin2.sqrt() * phi.cos(), sin2.sqrt() * phi.sin(), (1.0 - sin2).sqrt()];
                    albedo += PI / (rings * turns) as f64 * eon.at(&Geometry::new(wi, wo).unwrap())[0];
                }
                assert!((albedo - 1.0).abs() < 2e-4, "{roughness} at {mu}: {albedo}");
            }
        }
    }
}
