//! Distributions of microfacet normals, D(h), isotropic and anisotropic, and how to draw from them.

use std::f64::consts::{PI, TAU};

use crate::{Geometry, Real};

/// Shape of the distribution of microfacet normals. All satisfy `∫ D cos θ_h dω = 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Trowbridge–Reitz (1975), called GGX by Walter *et al.* (2007), eq. 33; anisotropic form of Burley (2012).
    Ggx,
    /// Beckmann–Spizzichino (1963), Walter *et al.* (2007), eq. 25.
    Beckmann,
    /// Phong-type power of the cosine, exponent `2/α² − 2`: the "Ashikhmin–Shirley" distribution of Mitsuba 0.6.
    Phong,
    /// GTR1 of Burley (2012), appendix B: tails longer than those of any other. Isotropic, α below 1: both widths are the same.
    Gtr1,
}

/// A distribution of microfacet normals with its widths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distribution {
    /// Functional form.
    pub shape: Shape,
    /// Width α along the tangent and the bitangent, above 0.
    pub alpha: [f64; 2],
}

impl Distribution {
    /// A distribution as wide along the tangent as along the bitangent.
    pub const fn isotropic(shape: Shape, alpha: f64) -> Self {
        Self { shape, alpha: [alpha; 2] }
    }

    /// True where both widths are the same.
    pub fn is_isotropic(&self) -> bool {
        self.alpha[0] == self.alpha[1]
    }

    /// Density D of normals at the half vector, in 1/sr.
    #[inline(always)]
    pub fn density<T: Real>(&self, g: &Geometry<T>) -> T {
        self.density_at(g.cos_h, g.tan2_h)
    }

    /// Density D of normals at `cos θ_h` and `tan²θ_h` along tangent and bitangent, in 1/sr.
    #[inline(always)]
    pub fn density_at<T: Real>(&self, cos_h: T, tan2_h: [T; 2]) -> T {
        let [ax, ay] = self.alpha.map(T::of);
        let cos2 = cos_h * cos_h;
        // (hx/αx)² + (hy/αy)² over hz²; multiplied, because a division costs as much as all the rest.
        let [over_x, over_y] = self.alpha.map(|a| T::of(1.0 / (a * a)));
        let slope2 = tan2_h[0] * over_x + tan2_h[1] * over_y;
        match self.shape {
            Shape::Ggx => {
                let t = cos2 * (T::one() + slope2);
                (T::of(PI) * ax * ay * t * t).recip()
            }
            Shape::Beckmann => (-slope2).exp() / (T::of(PI) * ax * ay * cos2 * cos2),
            Shape::Phong => {
                let [eu, ev] = self.exponents().map(T::of);
                let tan2 = tan2_h[0] + tan2_h[1];
                let exponent = if tan2 > T::zero() { (eu * tan2_h[0] + ev * tan2_h[1]) / tan2 } else { eu };
                // cos^e θ = (1 + tan² θ)^(−e/2), which keeps its digits near θ = 0 where cos θ rounds to 1.
                let power = (-T::of(0.5) * exponent * tan2.ln_1p()).exp();
                ((eu + T::of(2.0)) * (ev + T::of(2.0))).sqrt() * T::of(1.0 / TAU) * power
            }
            Shape::Gtr1 => {
                let alpha2 = self.alpha[0] * self.alpha[0];
                let scale = T::of((alpha2 - 1.0) / (PI * alpha2.ln()));
                // 1 + (α² − 1) cos², without the cancellation near the normal.
                scale / (cos2 * (T::of(alpha2) + tan2_h[0] + tan2_h[1]))
            }
        }
    }

    /// Phong exponents along tangent and bitangent, `max(2/α² − 2, 0)`.
    fn exponents(&self) -> [f64; 2] {
        self.alpha.map(|a| (2.0 / (a * a) - 2.0).max(0.0))
    }

    /// Draws a microfacet normal with density `D cos θ_h` from two numbers in `[0, 1)`.
    pub fn sample(&self, u: [f64; 2]) -> [f64; 3] {
        let [ax, ay] = self.alpha;
        // The azimuth of an elliptical lobe is that of a circle, stretched. For the Phong shape the stretched
        // quantity is 1/√(e + 1) (Ashikhmin & Shirley 2000, eq. 9).
        let stretch = match self.shape {
            Shape::Ggx | Shape::Beckmann | Shape::Gtr1 => [ax, ay],
            Shape::Phong => self.exponents().map(|e| (e + 2.0).powf(-0.5)),
        };
        let circle = TAU * u[1];
        let (x, y) = (stretch[0] * circle.cos(), stretch[1] * circle.sin());
        let norm = (x * x + y * y).sqrt();
        let (cos_phi, sin_phi) = (x / norm, y / norm);
        let slope2 = (cos_phi / ax).powi(2) + (sin_phi / ay).powi(2);
        let tan2 = match self.shape {
            Shape::Ggx => u[0] / (1.0 - u[0]) / slope2,
            Shape::Beckmann => -(-u[0]).ln_1p() / slope2,
            Shape::Phong => {
                let [eu, ev] = self.exponents();
                let exponent = eu * cos_phi * cos_phi + ev * sin_phi * sin_phi;
                (-2.0 * (-u[0]).ln_1p() / (exponent + 2.0)).exp_m1()
            }
            Shape::Gtr1 => {
                // Burley (2012), appendix B: cos² = (1 − α^(2 − 2u))/(1 − α²).
                let power = ax.powf(2.0 * (1.0 - u[0]));
                (power - ax * ax) / (1.0 - power)
            }
        };
        let cos = (1.0 + tan2).sqrt().recip();
        let sin = (tan2.sqrt() * cos).min(1.0);
        [sin * cos_phi, sin * sin_phi, cos]
    }
}
