//! The diffuse reflection of any material, told from the specular one by parameters alone: what a black body takes away.
//!
//! For a Lambert term beside a lobe this is the Lambert term (Guarnera *et al.* 2018, 3.1). Where the body lies under an
//! interface or a coat, it is what gets through them: the specular reflection is then that of the layers alone. A picture
//! of a black body can be had of any renderer. A tint of the lobe that follows the body's colour goes with the body.

use crate::{Bsdf, Geometry, Material, Role, Sampling, Technique, Value};

/// A dielectric with its body's colour and with a black one: the diffuse reflection is a share of their difference.
pub struct BlackBody {
    /// The material without its metal.
    pub coloured: Material,
    /// The same with a black body.
    pub black: Material,
    /// What is not metal, 0 to 1.
    pub share: f64,
}

/// A material's body: `share (f_coloured − f_black)`.
struct Body {
    coloured: Box<dyn Bsdf>,
    black: Box<dyn Bsdf>,
    /// What is not metal.
    share: f64,
}

impl Bsdf for Body {
    fn diffuse(&self) -> [f64; 3] {
        let (coloured, black) = (self.coloured.diffuse(), self.black.diffuse());
        std::array::from_fn(|c| self.share * (coloured[c] - black[c]))
    }

    fn specular(&self, g: &Geometry<f64>) -> [f64; 3] {
        let (coloured, black) = (self.coloured.specular(g), self.black.specular(g));
        // Rounding must not make a dark body darker than black.
        std::array::from_fn(|c| (self.share * (coloured[c] - black[c])).max(0.0))
    }

    fn specular_f32(&self, g: &Geometry<f32>) -> [f32; 3] {
        self.difference(self.coloured.specular_f32(g), self.black.specular_f32(g))
    }

    fn specular_all(&self, geometries: &[Geometry<f32>]) -> Vec<[f32; 3]> {
        let pairs =
            self.coloured.specular_all(geometries).into_iter().zip(self.black.specular_all(geometries));
        pairs.map(|(coloured, black)| self.difference(coloured, black)).collect()
    }

    fn sampling(&self) -> Option<Sampling> {
        Sampling::mixture([(1.0, Technique::Cosine)])
    }

    fn is_isotropic(&self) -> bool {
        self.coloured.is_isotropic()
    }

    fn is_mirror_symmetric(&self) -> bool {
        self.coloured.is_mirror_symmetric()
    }
}

impl Body {
    fn difference(&self, coloured: [f32; 3], black: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|c| (self.share as f32 * (coloured[c] - black[c])).max(0.0))
    }
}

/// Lambert's reflection alone.
fn lambert(diffuse: [f64; 3]) -> Box<dyn Bsdf> {
    Box::new(crate::models::lambert::Lambert { diffuse })
}

impl Material {
    /// Its diffuse reflection.
    pub fn diffuse_bsdf(&self) -> Box<dyn Bsdf> {
        if let Some(separate) = self.model().diffuse_only {
            return separate(&self.as_values());
        }
        if let Some(BlackBody { coloured, black, share }) = self.black_body() {
            return Box::new(Body { coloured: coloured.bsdf(), black: black.bsdf(), share });
        }
        // Nothing couples such a term to what is above it.
        let is_lambert = self.by_role(Role::DiffuseReflectance).is_some();
        lambert(if is_lambert { self.bsdf().diffuse() } else { [0.0; 3] })
    }

    /// What tells its diffuse reflection from the rest; `None` where that is a Lambert term of its own, or nothing.
    pub fn black_body(&self) -> Option<BlackBody> {
        let has_own = self.model().diffuse_only.is_some() || self.by_role(Role::DiffuseReflectance).is_some();
        let metalness = self.by_role(Role::Metalness).and_then(|m| m.mean()).unwrap_or(0.0);
        if has_own || self.by_role(Role::BaseColour).is_none() || metalness == 1.0 {
            return None;
        }
        let coloured = self.with_role(Role::Metalness, &Value::Number(0.0));
        let black = coloured.with_role(Role::BaseColour, &Value::Colour([0.0; 3]));
        Some(BlackBody { coloured, black, share: 1.0 - metalness })
    }

    /// The material with another value of each parameter of a role.
    fn with_role(&self, role: Role, value: &Value) -> Self {
        let mut copy = self.clone();
        let places = self.model().parameters.iter().enumerate().filter(|(_, p)| p.role == role);
        places.for_each(|(index, _)| copy.replace(index, value.clone()));
        copy
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str, wi: [f64; 3], wo: [f64; 3]) -> [f64; 2] {
        let material = Material::parse(text).unwrap();
        [material.diffuse_bsdf(), material.bsdf()].map(|bsdf| bsdf.evaluate(wi, wo)[0])
    }

    #[test]
    fn a_body_is_what_black_takes_away() {
        let (wi, wo) = ([0.6, 0.0, 0.8], [0.0, 0.8, 0.6]);
        let f = |text: &str| values(text, wi, wo);
        assert_eq!(f("ward:diffuse=0.5")[0], 0.5 * std::f64::consts::FRAC_1_PI);
        assert_eq!(f("ggx-conductor")[0], 0.0);
        assert_eq!(f("gltf:metallic=1")[0], 0.0);
        let [diffuse, whole] = f("oren-nayar");
        assert!((diffuse - whole).abs() < 1e-15);
        // Under an interface the body is darker than in the open, and no lobe is left.
        let [covered, _] = f("openpbr:base_color=0.5,specular_roughness=0.05");
        assert!(covered < 0.5 * std::f64::consts::FRAC_1_PI && covered > 0.12, "{covered}");
        let [half, _] = f("gltf:metallic=0.5");
        assert!((half - 0.5 * f("gltf")[0]).abs() < 1e-15);
    }
}
