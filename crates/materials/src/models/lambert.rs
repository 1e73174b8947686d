//! Lambert (1760): `f = k_d/π`.
//!
//! | parameter | meaning | range | default |
//! |---|---|---|---|
//! | `diffuse` | albedo, linear RGB | 0 to 1 | 0.5 |

use crate::conformance::Parameters;
use crate::model::Model;
use crate::models::shared::DIFFUSE;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "lambert",
    title: "Lambert",
    summary: "Perfectly diffuse.",
    reference: "Lambert 1760, Photometria",
    has_fresnel: false,
    is_reciprocal: true,
    parameters: &[DIFFUSE],
    surveyed: &["diffuse"],
    searched: &["diffuse"],
    linear: &["diffuse"],
    build: |v| Box::new(Lambert { diffuse: v.colour("diffuse") }),
    vectors: Some(("lambert", vector)),
    ..Model::BLANK
};

/// A Lambertian surface.
#[derive(Clone, Copy, Debug)]
pub struct Lambert {
    /// Albedo per channel, 0 to 1.
    pub diffuse: [f64; 3],
}

impl Lobe for Lambert {
    fn diffuse(&self) -> [f64; 3] {
        self.diffuse
    }
    fn specular<T: Real>(&self, _: &Geometry<T>) -> [T; 3] {
        [T::zero(); 3]
    }
    fn sampling(&self) -> Option<Sampling> {
        None
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    Some(Box::new(Lambert { diffuse: [p.number("kd")?; 3] }))
}
