//! What a renderer needs to know of a material: its Lambert term, everything else, and how to draw directions from it.

use std::f64::consts::PI;

use crate::{Geometry, Real, Sampling};

/// The scattering of an opaque surface, ρ = ρ_d + ρ_s (Guarnera *et al.* 2018, eq. 1), per linear RGB channel.
pub trait Bsdf: Send + Sync {
    /// Reflectance of the Lambert term, 0 to 1 per channel: it is `diffuse/π`.
    fn diffuse(&self) -> [f64; 3];

    /// Everything but the Lambert term, in 1/sr, without the cosine, in double precision: the specular lobes, and a diffuse
    /// reflection that is not Lambert's.
    fn specular(&self, g: &Geometry<f64>) -> [f64; 3];

    /// The same in single precision: what the renderer uses.
    fn specular_f32(&self, g: &Geometry<f32>) -> [f32; 3];

    /// [`Bsdf::specular_f32`] of many geometries, in their order: one call for a whole table.
    fn specular_all(&self, geometries: &[Geometry<f32>]) -> Vec<[f32; 3]>;

    /// How to draw directions from everything but the Lambert term; `None` where there is nothing else.
    fn sampling(&self) -> Option<Sampling>;

    /// True where turning the surface about its normal changes nothing.
    fn is_isotropic(&self) -> bool {
        self.sampling().is_none_or(|s| s.is_isotropic())
    }

    /// True where the mirror image of an isotropic reflection in the plane of the normal and the view reflects alike: of all
    /// models, not of all measurements.
    fn is_mirror_symmetric(&self) -> bool {
        true
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
    /// See [`Bsdf::is_mirror_symmetric`].
    fn is_mirror_symmetric(&self) -> bool {
        true
    }

    /// See [`Bsdf::diffuse`].
    fn diffuse(&self) -> [f64; 3];
    /// See [`Bsdf::specular`].
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
    fn is_mirror_symmetric(&self) -> bool {
        Lobe::is_mirror_symmetric(self)
    }
}
