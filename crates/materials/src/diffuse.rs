//! Rough diffuse reflection that keeps its energy: EON.
//!
//! Portsmouth, Kutz & Hill 2025, *EON: A practical energy-preserving rough diffuse BRDF*, with the exact directional albedo:
//!
//! `f = ρ/π · A (1 + r s/t) + ρ_ms/π · (1 − E(θ_i)) (1 − E(θ_o))/(1 − Ē)`, with `s = ω_i·ω_o − cos θ_i cos θ_o`, `t = max(cos θ_i, cos θ_o)`
//! where s > 0 and 1 elsewhere, `A = 1/(1 + (½ − 2/(3π)) r)`, and `ρ_ms = ρ² Ē/(1 − ρ (1 − Ē))`. With r = 0 it is Lambert's.

use std::f64::consts::{FRAC_1_PI, PI};

use crate::{Geometry, Real};

const C1: f64 = 0.5 - 2.0 / (3.0 * PI);
const C2: f64 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// A rough diffuse reflection.
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
        let s = g.wi[0] * g.wo[0] + g.wi[1] * g.wo[1];
        let t = if s > T::zero() { g.cos_i().max(g.cos_o()) } else { T::one() };
        let single = T::one() + T::of(self.roughness) * s / t;
        let multiple = missing(g.cos_i()) * missing(g.cos_o());
        std::array::from_fn(|c| T::of(self.single[c]) * single + T::of(self.multiple[c]) * multiple)
    }
}

/// `(1 − E(θ))/(A r)`: what single scattering loses, over the roughness.
#[inline(always)]
fn missing<T: Real>(cos: T) -> T {
    let (one, third) = (T::one(), T::of(2.0 / 3.0));
    let sin = (one - cos * cos).max(T::zero()).sqrt();
    let g = sin * (cos.min(one).acos() - sin * cos) + third * ((sin / cos) * (one - sin * sin * sin) - sin);
    (T::of(C1) - T::of(FRAC_1_PI) * g).max(T::zero())
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
