//! The diffuse reflection of any material, told from the specular one by parameters alone: what a black body takes away.
//!
//! For a Lambert term beside a lobe this is the Lambert term (Guarnera *et al.* 2018, 3.1). Where the body lies under an
//! interface or a coat, it is what gets through them: the specular reflection is then that of the layers alone. A picture
//! of a black body can be had of any renderer. A tint of the lobe that follows the body's colour goes with the body.

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use crate::quadrature::Gauss;
use crate::{Bsdf, Geometry, Material, MaterialError, Role, Sampling, Technique, Value};

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

/// Cosines of light and viewer, and azimuths between them in a half turn.
const COSINES: usize = 4;
const TURNS: usize = 6;

/// Light and viewer all over the hemisphere, with weights `2 cos θ_i cos θ_o dω_i dμ_o`: an integral over them is what is
/// reflected of uniform light.
static HEMISPHERE: LazyLock<Vec<(Geometry<f32>, f64)>> = LazyLock::new(|| {
    let mut pairs = Vec::new();
    let gauss = Gauss::new(COSINES);
    for (cos_i, weight_i) in gauss.on(0.0, 1.0) {
        for (cos_o, weight_o) in gauss.on(0.0, 1.0) {
            for turn in 0..TURNS {
                let direction = |cos: f64, phi: f64| {
                    let sin = (1.0 - cos * cos).sqrt();
                    [sin * phi.cos(), sin * phi.sin(), cos]
                };
                let phi = PI * (turn as f64 + 0.5) / TURNS as f64;
                let weight = 2.0 * cos_i * cos_o * weight_i * weight_o * TAU / TURNS as f64;
                let geometry = Geometry::new(direction(cos_i, phi), direction(cos_o, 0.0));
                pairs.extend(geometry.map(|g| (g.to_f32(), weight)));
            }
        }
    }
    pairs
});

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

    /// The materials whose pictures tell the diffuse reflection where nothing is known of the formulas: as [`Material::black_body`],
    /// and for a Lambert term as well. `None` where there is no body to be seen.
    pub fn blackened(&self) -> Option<BlackBody> {
        if self.by_role(Role::DiffuseReflectance).is_some() {
            let black = self.with_role(Role::DiffuseReflectance, &Value::Colour([0.0; 3]));
            return Some(BlackBody { coloured: self.clone(), black, share: 1.0 });
        }
        self.black_body()
    }

    /// The share of uniform light that the diffuse reflection sends back, per channel: what a furnace would show. Good to
    /// some thousandths.
    pub fn diffuse_albedo(&self) -> [f64; 3] {
        let bsdf = self.diffuse_bsdf();
        let mut albedo = bsdf.diffuse();
        if bsdf.sampling().is_none() {
            return albedo;
        }
        let geometries: Vec<Geometry<f32>> = HEMISPHERE.iter().map(|(g, _)| *g).collect();
        for (f, (_, weight)) in bsdf.specular_all(&geometries).into_iter().zip(&*HEMISPHERE) {
            (0..3).for_each(|c| albedo[c] += f64::from(f[c]) * weight);
        }
        albedo
    }

    /// Sets the body's colour to what gives the diffuse reflection an albedo, as far as the model's range goes.
    ///
    /// # Errors
    /// None for the models of the catalogue.
    pub fn set_diffuse_albedo(&mut self, role: Role, wanted: [f64; 3]) -> Result<(), MaterialError> {
        let mut colour = wanted;
        self.set_role(role, colour)?;
        // The albedo is nearly proportional to the colour: what two steps leave cannot be seen.
        for _ in 0..2 {
            let albedo = self.diffuse_albedo();
            if (0..3).all(|c| (wanted[c] - albedo[c]).abs() < 2e-4) {
                break;
            }
            let scaled =
                |c: usize| if albedo[c] > 0.0 { colour[c] * wanted[c] / albedo[c] } else { colour[c] };
            colour = std::array::from_fn(|c| scaled(c).min(1.0));
            self.set_role(role, colour)?;
        }
        Ok(())
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
    fn diffuse_albedos_can_be_measured_and_set() {
        let albedo = |text: &str| Material::parse(text).unwrap().diffuse_albedo()[0];
        assert_eq!(albedo("ggx:diffuse=0.3"), 0.3);
        // EON reflects all of a white furnace.
        assert!((albedo("oren-nayar:variant=eon,diffuse=1,roughness=0.8") - 1.0).abs() < 5e-3);
        for text in ["rough-plastic:alpha=0.3", "ashikhmin-shirley:f0=0.3", "disney:roughness=0.3", "openpbr"]
        {
            let mut material = Material::parse(text).unwrap();
            let role = [Role::DiffuseReflectance, Role::BaseColour];
            let role = role.into_iter().find(|role| material.by_role(*role).is_some()).unwrap();
            material.set_diffuse_albedo(role, [0.1, 0.2, 0.3]).unwrap();
            let found = material.diffuse_albedo();
            assert!((0..3).all(|c| (found[c] - 0.1 * (c + 1) as f64).abs() < 1e-3), "{material}: {found:?}");
        }
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
