//! The angles of one reflection, worked out once for all lobes.

use crate::Real;

/// The geometry of a pair of directions in the local frame (`z` = normal, `x` = tangent).
///
/// All cosines are positive: light and viewer are above the surface. Narrow lobes depend on `tan²θ_h`, which is
/// therefore stored as such: rounding it to `f32` costs a relative 6e-8, where rounding directions would cost an
/// absolute one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry<T> {
    /// Unit direction towards the light.
    pub wi: [T; 3],
    /// Unit direction towards the viewer.
    pub wo: [T; 3],
    /// Cosine between the half vector and either direction, `wi·h = wo·h`.
    pub cos_d: T,
    /// Cosine of the half vector's polar angle, `h.z`.
    pub cos_h: T,
    /// `tan²θ_h cos²φ_h` and `tan²θ_h sin²φ_h`.
    pub tan2_h: [T; 2],
}

impl Geometry<f64> {
    /// The geometry of two unit directions; `None` where either lies on or below the surface, where every BRDF is 0.
    pub fn new(wi: [f64; 3], wo: [f64; 3]) -> Option<Self> {
        if !(wi[2] > 0.0 && wo[2] > 0.0) {
            return None;
        }
        let h = [wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]];
        let length = (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]).sqrt();
        let (tx, ty) = (h[0] / h[2], h[1] / h[2]);
        Some(Self { wi, wo, cos_d: 0.5 * length, cos_h: h[2] / length, tan2_h: [tx * tx, ty * ty] })
    }

    /// The geometry of a view direction in the x-z plane at angle `θ_o` with a half vector at `θ_h` and cosine
    /// `cos_d` to the view: how the ring transport walks around an isotropic lobe.
    ///
    /// `cos_h` and `sin_h` belong to `θ_h` in `[0, π/2)`, `cos_o` and `sin_o` to `θ_o`. `None` where the light
    /// would be below the surface.
    pub fn from_half_vector(
        (cos_o, sin_o): (f64, f64),
        (cos_h, sin_h): (f64, f64),
        cos_d: f64,
    ) -> Option<Self> {
        let cos_i = 2.0 * cos_d * cos_h - cos_o;
        if cos_i <= 0.0 || cos_o <= 0.0 || cos_d <= 0.0 {
            return None;
        }
        // wo·h = cos_o cos_h + sin_o sin_h cos φ gives the azimuth; where either sine vanishes it has no meaning.
        let denominator = sin_o * sin_h;
        let cos_phi =
            if denominator > 1e-12 { ((cos_d - cos_o * cos_h) / denominator).clamp(-1.0, 1.0) } else { 1.0 };
        let sin_phi = (1.0 - cos_phi * cos_phi).sqrt();
        let h = [sin_h * cos_phi, sin_h * sin_phi, cos_h];
        let wi = [2.0 * cos_d * h[0] - sin_o, 2.0 * cos_d * h[1], cos_i];
        let tan2 = (sin_h / cos_h).powi(2);
        let tan2_h = [tan2 * cos_phi * cos_phi, tan2 * sin_phi * sin_phi];
        Some(Self { wi, wo: [sin_o, 0.0, cos_o], cos_d, cos_h, tan2_h })
    }

    /// Rounds to single precision, after the cancellations have been done in double.
    pub fn to_f32(&self) -> Geometry<f32> {
        Geometry {
            wi: self.wi.map(|v| v as f32),
            wo: self.wo.map(|v| v as f32),
            cos_d: self.cos_d as f32,
            cos_h: self.cos_h as f32,
            tan2_h: self.tan2_h.map(|v| v as f32),
        }
    }
}

impl<T: Real> Geometry<T> {
    /// The mirror image of the reflection in the x-z plane.
    pub fn mirrored(&self) -> Self {
        let mirror = |[x, y, z]: [T; 3]| [x, -y, z];
        Self { wi: mirror(self.wi), wo: mirror(self.wo), ..*self }
    }

    /// The same reflection with both directions turned about the normal by an angle.
    pub fn turned(&self, sin: T, cos: T) -> Self {
        let turn = |w: [T; 3]| [cos * w[0] - sin * w[1], sin * w[0] + cos * w[1], w[2]];
        let (wi, wo) = (turn(self.wi), turn(self.wo));
        let [x, y] = [wi[0] + wo[0], wi[1] + wo[1]];
        let (across, tan2) = (x * x + y * y, self.tan2_h[0] + self.tan2_h[1]);
        // tan²θ_h stays what it is; only its parts along the axes change.
        let part = |v: T| if across > T::zero() { tan2 * (v * v) / across } else { T::zero() };
        Self { wi, wo, tan2_h: [part(x), part(y)], ..*self }
    }

    /// Cosine of the light's polar angle.
    pub fn cos_i(&self) -> T {
        self.wi[2]
    }

    /// Cosine of the viewer's polar angle.
    pub fn cos_o(&self) -> T {
        self.wo[2]
    }

    /// `1 − cos θ_h`, with all its digits where the cosine rounds to 1.
    #[inline(always)]
    pub fn versine_h(&self) -> T {
        let tan2 = self.tan2_h[0] + self.tan2_h[1];
        tan2 * self.cos_h * self.cos_h / (T::one() + self.cos_h)
    }

    /// `1 − cos` of the angle between the view and the light's mirror image, with all its digits near the mirror direction.
    #[inline(always)]
    pub fn versine_mirror(&self) -> T {
        // Half the squared distance between (−x_i, −y_i, z_i) and the view; |H_xy| = 2 cos_d cos_h tan θ_h.
        let (across, along) = (self.cos_d * self.cos_h, self.wi[2] - self.wo[2]);
        let tan2 = self.tan2_h[0] + self.tan2_h[1];
        T::of(2.0) * across * across * tan2 + T::of(0.5) * along * along
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn direction(cos: f64, phi: f64) -> [f64; 3] {
        let sin = (1.0 - cos * cos).sqrt();
        [sin * phi.cos(), sin * phi.sin(), cos]
    }

    proptest! {
        #[test]
        fn half_vector_form_agrees_with_directions(ci in 0.01..1.0f64, co in 0.01..0.999f64, phi in 0.0..3.1f64) {
            let g = Geometry::new(direction(ci, phi), direction(co, 0.0)).unwrap();
            let sines = |c: f64| (c, (1.0 - c * c).sqrt());
            let r = Geometry::from_half_vector(sines(co), sines(g.cos_h), g.cos_d).unwrap();
            prop_assert!((r.cos_i() - ci).abs() < 1e-12);
            let tan2 = |g: &Geometry<f64>| g.tan2_h[0] + g.tan2_h[1];
            prop_assert!((tan2(&r) - tan2(&g)).abs() <= 1e-9 * (1.0 + tan2(&g)));
            prop_assert!((r.wi[0] * r.wo[0] + r.wi[2] * r.wo[2] - (2.0 * g.cos_d * g.cos_d - 1.0)).abs() < 1e-9);
        }
    }

    #[test]
    fn below_the_surface_there_is_no_geometry() {
        assert!(Geometry::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]).is_none());
        assert!(Geometry::new([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]).is_none());
    }
}
