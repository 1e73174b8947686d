//! What the parameters of a material say, in terms that all models share: how one model's values are read for another.

use crate::colour::{hue, mean};
use crate::fresnel::{Fresnel, f0_from_ior, ior_from_f0};
use crate::{Material, MaterialError, Role, Value};

/// The look of a material as its parameters foretell it, without rendering: exact for some models, a rule of thumb for
/// others. It is where a match starts, and what people copy who have no match.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Canonical {
    /// Albedo of the diffuse reflection, linear RGB.
    pub body: [f64; 3],
    /// Colour of the body and of the metal, where one parameter decides both.
    pub base: Option<[f64; 3]>,
    /// Specular reflectance at normal incidence, linear RGB; `None` where the model has no parameter that decides it.
    pub f0: Option<[f64; 3]>,
    /// The complex index of a conductor: η and k per channel.
    pub index: Option<[[f64; 3]; 2]>,
    /// Microfacet α along tangent and bitangent; `None` where the model has no width.
    pub alpha: Option<[f64; 2]>,
    /// Share of the metal, 0 to 1.
    pub metalness: f64,
}

impl Canonical {
    /// The hue of the specular reflection: its reflectance divided by that of the brightest channel.
    pub fn tint(&self) -> [f64; 3] {
        hue(self.f0.unwrap_or([1.0; 3]))
    }
}

impl Material {
    /// What the parameters say in shared terms.
    pub fn canonical(&self) -> Canonical {
        let metalness = self.mean(Role::Metalness).unwrap_or(0.0);
        let index = self.colour(Role::ConductorIndex).zip(self.colour(Role::Extinction));
        let index = index.filter(|_| self.is_conductor()).map(|(eta, k)| [eta, k]);
        let is_metal = index.is_some();
        let base =
            self.colour(Role::BaseColour).map(|c| c.map(|v| v * self.mean(Role::BaseWeight).unwrap_or(1.0)));
        let body = match (self.colour(Role::DiffuseReflectance), base) {
            (Some(diffuse), _) => diffuse,
            (None, Some(base)) => base.map(|v| v * (1.0 - metalness)),
            (None, None) if is_metal => [0.0; 3],
            // Measured materials and the like: what their diffuse reflection is, if it is Lambert's.
            (None, None) => self.diffuse_bsdf().diffuse(),
        };
        let f0 = self.dielectric_f0(index).map(|dielectric| {
            std::array::from_fn(|c| {
                let metal = base.map_or(dielectric[c], |base| base[c]);
                dielectric[c] + metalness * (metal - dielectric[c])
            })
        });
        Canonical {
            body,
            base,
            f0,
            index,
            alpha: self.alpha(),
            metalness: if is_metal { 1.0 } else { metalness },
        }
    }

    /// True where turning the surface about its normal changes nothing.
    pub fn is_isotropic(&self) -> bool {
        if self.model().renderer.is_none() {
            return self.bsdf().is_isotropic();
        }
        let is_stretched = self.mean(Role::Anisotropy).is_some_and(|a| a != 0.0);
        !is_stretched && self.alpha().is_none_or(|[u, v]| u == v)
    }

    /// True where the complex index is the one that counts: where the model has no choice, or it fell on the conductor.
    pub fn is_conductor(&self) -> bool {
        let choices = self.model().parameters.iter().zip(self.values()).filter(|(p, _)| p.name == "fresnel");
        self.by_role(Role::ConductorIndex).is_some()
            && choices.into_iter().all(|(_, choice)| *choice == Value::Choice("conductor"))
    }

    /// Reflectance at normal incidence of all but the metal of a base colour.
    fn dielectric_f0(&self, index: Option<[[f64; 3]; 2]>) -> Option<[f64; 3]> {
        let scale = self.colour(Role::SpecularReflectance);
        let hue =
            self.colour(Role::LobeHeight).map(|height| if height == [0.0; 3] { height } else { hue(height) });
        let tint = self.colour(Role::SpecularColour).or(hue).unwrap_or([1.0; 3]);
        let scaled = |f0: [f64; 3]| {
            let scale = scale.unwrap_or([1.0; 3]);
            Some(std::array::from_fn(|c| scale[c] * tint[c] * f0[c]))
        };
        if let Some([eta, k]) = index {
            let at_normal = |c: usize| Fresnel::Conductor { eta: eta[c], k: k[c] }.reflectance(1.0);
            return scaled(std::array::from_fn(at_normal));
        }
        if let Some(f0) = self.colour(Role::NormalReflectance) {
            return scaled(f0);
        }
        if let Some(level) = self.mean(Role::SpecularLevel) {
            // Of 0.08, which is twice the reflectance of an index of 1.5; beside an index, of twice that index's.
            let f0 = self.mean(Role::RefractiveIndex).map_or(0.04, f0_from_ior);
            return scaled([2.0 * level * f0; 3]);
        }
        match self.mean(Role::RefractiveIndex) {
            Some(ior) => scaled([f0_from_ior(ior); 3]),
            None => scale,
        }
    }

    /// Microfacet α along both axes; one parameter serves both.
    fn alpha(&self) -> Option<[f64; 2]> {
        let widths = self.model().parameters.iter().zip(self.values());
        let mut widths = widths.filter_map(|(p, v)| p.role.alpha(v.mean()?));
        let first = widths.next()?;
        Some([first, widths.next().unwrap_or(first)])
    }

    /// True where a parameter of a role can be seen: where it does not have the value that leaves its effect out, and is no
    /// part of a layer that is not there.
    pub fn shows(&self, role: Role) -> bool {
        let Some(value) = self.by_role(role) else { return false };
        let has = |layer| self.colour(layer).is_some_and(|weight| weight != [0.0; 3]);
        match role {
            Role::Anisotropy | Role::Coat | Role::Sheen | Role::Metalness | Role::DiffuseRoughness => {
                value.colour() != Some([0.0; 3])
            }
            Role::SpecularColour | Role::BaseWeight => value.colour() != Some([1.0; 3]),
            Role::CoatColour | Role::CoatRoughness | Role::CoatIndex | Role::CoatShape => has(Role::Coat),
            Role::SheenColour | Role::SheenRoughness | Role::SheenShape => has(Role::Sheen),
            Role::Variant => false,
            _ => true,
        }
    }

    /// Sets parameters to what comes closest to a width: every parameter that decides one, within its range.
    ///
    /// # Errors
    /// None for the models of the catalogue.
    pub fn set_alpha(&mut self, alpha: [f64; 2]) -> Result<(), MaterialError> {
        let parameters = self.model().parameters.iter().enumerate();
        let widths: Vec<usize> = parameters.filter(|(_, p)| p.role.is_width()).map(|(i, _)| i).collect();
        for (i, alpha) in widths.into_iter().zip([alpha[0], alpha[1]]) {
            if let Some(value) = self.model().parameters[i].role.from_alpha(alpha) {
                self.set_clamped(i, [value; 3])?;
            }
        }
        Ok(())
    }

    /// Sets parameters to what comes closest to a specular reflectance at normal incidence, in the model's own terms.
    ///
    /// # Errors
    /// None for the models of the catalogue.
    pub fn set_f0(&mut self, f0: [f64; 3]) -> Result<(), MaterialError> {
        let mean = mean(f0);
        let some = if mean > 0.0 { 1.0 } else { 0.0 };
        let has = |role| self.by_role(role).is_some();
        if has(Role::NormalReflectance) {
            return self.set_role(Role::NormalReflectance, f0);
        }
        if has(Role::SpecularLevel) && !has(Role::RefractiveIndex) {
            return self.set_role(Role::SpecularLevel, [mean / 0.08; 3]);
        }
        if has(Role::RefractiveIndex) {
            self.set_role(Role::SpecularReflectance, [some; 3])?;
            self.set_role(Role::SpecularLevel, [some / 2.0; 3])?;
            // No index has F0 = 1 or 0; the closest that a model can hold.
            return self.set_role(Role::RefractiveIndex, [ior_from_f0(mean.clamp(1e-6, 0.96)); 3]);
        }
        if self.is_conductor() {
            return Ok(());
        }
        self.set_role(Role::SpecularReflectance, f0)
    }

    /// Sets every parameter of a role, within its range: colours as they are, numbers to the mean.
    ///
    /// # Errors
    /// None for the models of the catalogue.
    pub fn set_role(&mut self, role: Role, colour: [f64; 3]) -> Result<(), MaterialError> {
        let parameters = self.model().parameters.iter().enumerate();
        let places: Vec<usize> = parameters.filter(|(_, p)| p.role == role).map(|(i, _)| i).collect();
        places.into_iter().try_for_each(|i| self.set_clamped(i, colour))
    }

    fn set_clamped(&mut self, index: usize, colour: [f64; 3]) -> Result<(), MaterialError> {
        let parameter = &self.model().parameters[index];
        let Some(range) = parameter.range() else { return Ok(()) };
        let value = match self.values()[index] {
            Value::Colour(_) => Value::Colour(colour.map(|v| range.valid.nearest(v))),
            Value::List(_) => Value::List([range.valid.nearest(mean(colour))].into()),
            _ => Value::Number(range.valid.nearest(mean(colour))),
        };
        self.set_value(index, value)
    }

    fn mean(&self, role: Role) -> Option<f64> {
        self.by_role(role)?.mean()
    }

    fn colour(&self, role: Role) -> Option<[f64; 3]> {
        self.by_role(role)?.colour()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn canonical(text: &str) -> Canonical {
        Material::parse(text).unwrap().canonical()
    }

    #[test]
    fn plastics_metals_and_lobes_without_fresnel() {
        let plastic = canonical("ggx:diffuse=0.2,ior=1.5,roughness=0.3");
        assert!((plastic.f0.unwrap()[0] - 0.04).abs() < 1e-12 && plastic.alpha == Some([0.3; 2]));
        let gold = canonical("ggx-conductor:eta=0.143/0.375/1.442,k=3.983/2.386/1.603");
        assert!(gold.f0.unwrap()[0] > 0.9 && gold.body == [0.0; 3] && gold.metalness == 1.0);
        assert!(gold.tint()[0] == 1.0 && gold.tint()[2] < 0.5);
        assert_eq!(canonical("ward:specular=0.1/0.2/0.3").f0, Some([0.1, 0.2, 0.3]));
        assert_eq!(canonical("lambert").f0, None);
    }

    #[test]
    fn setting_is_the_inverse_of_reading() {
        let mut ggx = Material::parse("ggx").unwrap();
        ggx.set_f0([0.1; 3]).unwrap();
        ggx.set_alpha([0.1, 0.4]).unwrap();
        let read = ggx.canonical();
        assert!((read.f0.unwrap()[1] - 0.1).abs() < 1e-12 && read.alpha == Some([0.1, 0.4]));
    }
    #[test]
    fn a_level_beside_an_index_scales_what_the_index_says() {
        let f0 = |text: &str| canonical(text).f0.unwrap()[0];
        assert!(
            (f0("principled:ior=1.5") - 0.04).abs() < 1e-12
                && (f0("disney:specular=0.5") - 0.04).abs() < 1e-12
        );
        assert!((f0("principled:ior=2") - 1.0 / 9.0).abs() < 1e-12);
        assert!((f0("principled:ior=2,specular_ior_level=0.25") - 1.0 / 18.0).abs() < 1e-12);
        let mut glass = Material::parse("principled:specular_ior_level=0.1").unwrap();
        glass.set_f0([1.0 / 9.0; 3]).unwrap();
        assert!((glass.number("ior").unwrap() - 2.0).abs() < 1e-9 && f0(&glass.to_string()) > 0.11);
    }
}
