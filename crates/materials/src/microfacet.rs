//! The microfacet lobe shared by the GGX, Beckmann and Ashikhmin–Shirley models.
//!
//! `f = k_s F D G / (4 cos θ_i cos θ_o)` (Torrance & Sparrow 1967; Walter *et al.* 2007, eq. 20), beside an
//! uncoupled Lambert term.

use crate::conformance::Parameters;
use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::masking::Masking;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// A microfacet lobe with its Lambert term.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacet {
    /// Lambertian reflectance per channel, 0 to 1.
    pub diffuse: [f64; 3],
    /// Scale of the lobe per channel, 0 to 1 where energy is to be conserved.
    pub specular: [f64; 3],
    /// Distribution of normals.
    pub distribution: Distribution,
    /// Masking and shadowing.
    pub masking: Masking,
    /// Fresnel reflectance per channel.
    pub fresnel: [Fresnel; 3],
}

impl Lobe for Microfacet {
    fn diffuse(&self) -> [f64; 3] {
        self.diffuse
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let shape = self.distribution.density(g) * self.masking.visibility(&self.distribution, g)
            / (T::of(4.0) * g.cos_i() * g.cos_o());
        let mut last = None;
        std::array::from_fn(|c| {
            // Grey materials have three equal channels: one Fresnel term serves all.
            let reflectance = match last {
                Some((fresnel, value)) if fresnel == self.fresnel[c] => value,
                _ => self.fresnel[c].reflectance(g.cos_d),
            };
            last = Some((self.fresnel[c], reflectance));
            T::of(self.specular[c]) * reflectance * shape
        })
    }

    fn sampling(&self) -> Option<Sampling> {
        (self.specular != [0.0; 3]).then(|| Sampling::half_vector(self.distribution))
    }
}

/// The BSDF of a conformance vector: any combination of terms.
pub(crate) fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let shape = match p.text("dist")? {
        "ggx" => Shape::Ggx,
        "beckmann" => Shape::Beckmann,
        "phong" => Shape::Phong,
        _ => return None,
    };
    let masking = match p.text("g")? {
        "smith_sep" => Masking::Separable,
        "smith_hc" => Masking::Correlated,
        "smith_sep_rational" => Masking::SeparableRational,
        "smith_hc_rational" => Masking::CorrelatedRational,
        "vgroove" => Masking::VGroove,
        "one" => Masking::One,
        _ => return None,
    };
    Some(Box::new(Microfacet {
        diffuse: [p.number_or("kd", 0.0)?; 3],
        specular: [p.number_or("ks", 1.0)?; 3],
        distribution: Distribution { shape, alpha: [p.number("ax")?, p.number("ay")?] },
        masking,
        fresnel: [p.fresnel()?; 3],
    }))
}
