//! What a renderer needs to know of a material: its diffuse reflectance, its specular lobe, where the lobe lies.

use std::f64::consts::PI;

use crate::distribution::Distribution;
use crate::{Geometry, Real};

/// The scattering of an opaque surface, ρ = ρ_d + ρ_s (Guarnera *et al.* 2018, eq. 1), per linear RGB channel.
pub trait Bsdf: Send + Sync {
    /// Lambertian reflectance, 0 to 1 per channel: the diffuse term is `diffuse/π`.
    fn diffuse(&self) -> [f64; 3];

    /// Specular BRDF in 1/sr, without the cosine, in double precision.
    fn specular(&self, g: &Geometry<f64>) -> [f64; 3];

    /// The same in single precision: what the renderer uses.
    fn specular_f32(&self, g: &Geometry<f32>) -> [f32; 3];

    /// [`Bsdf::specular_f32`] of many geometries, in their order: one call for a whole table.
    fn specular_all(&self, geometries: &[Geometry<f32>]) -> Vec<[f32; 3]>;

    /// Where the specular lobe lies; `None` where there is no lobe at all.
    fn sampling(&self) -> Option<Sampling>;

    /// True where turning the surface about its normal changes nothing.
    fn is_isotropic(&self) -> bool {
        self.sampling().is_none_or(|s| s.distribution.is_isotropic())
    }

    /// The whole BRDF for two unit directions, in 1/sr; 0 where either lies below the surface.
    fn evaluate(&self, wi: [f64; 3], wo: [f64; 3]) -> [f64; 3] {
        let Some(g) = Geometry::new(wi, wo) else {
            return [0.0; 3];
        };
        let (diffuse, specular) = (self.diffuse(), self.specular(&g));
        std::array::from_fn(|c| diffuse[c] / PI + specular[c])
    }

    /// [`Bsdf::evaluate`] through the single-precision path.
    fn evaluate_f32(&self, wi: [f64; 3], wo: [f64; 3]) -> [f32; 3] {
        let Some(g) = Geometry::new(wi, wo) else {
            return [0.0; 3];
        };
        let (diffuse, specular) = (self.diffuse(), self.specular_f32(&g.to_f32()));
        std::array::from_fn(|c| (diffuse[c] / PI) as f32 + specular[c])
    }
}

/// A lobe written once for both precisions. Implementing it gives a [`Bsdf`].
pub trait Lobe: Send + Sync {
    /// See [`Bsdf::diffuse`].
    fn diffuse(&self) -> [f64; 3];
    /// Specular BRDF in 1/sr per channel.
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3];
    /// See [`Bsdf::sampling`].
    fn sampling(&self) -> Option<Sampling>;
}

impl<L: Lobe> Bsdf for L {
    fn diffuse(&self) -> [f64; 3] {
        Lobe::diffuse(self)
    }
    fn specular(&self, g: &Geometry<f64>) -> [f64; 3] {
        Lobe::specular(self, g)
    }
    fn specular_f32(&self, g: &Geometry<f32>) -> [f32; 3] {
        Lobe::specular(self, g)
    }
    fn specular_all(&self, geometries: &[Geometry<f32>]) -> Vec<[f32; 3]> {
        geometries.iter().map(|g| Lobe::specular(self, g)).collect()
    }
    fn sampling(&self) -> Option<Sampling> {
        Lobe::sampling(self)
    }
}

/// Importance sampling of a half-vector lobe: normals are drawn from `distribution` and the view is reflected in them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Distribution that the normals are drawn from, with density `D cos θ_h`.
    pub distribution: Distribution,
}

impl Sampling {
    /// Draws a light direction for a view direction from two numbers in `[0, 1)`. The result may lie below the surface.
    pub fn sample(&self, wo: [f64; 3], u: [f64; 2]) -> [f64; 3] {
        let h = self.distribution.sample(u);
        let cos_d = wo[0] * h[0] + wo[1] * h[1] + wo[2] * h[2];
        std::array::from_fn(|k| 2.0 * cos_d * h[k] - wo[k])
    }

    /// Probability density of [`Sampling::sample`], in 1/sr.
    pub fn density(&self, g: &Geometry<f64>) -> f64 {
        self.distribution.density(g) * g.cos_h / (4.0 * g.cos_d)
    }
}
