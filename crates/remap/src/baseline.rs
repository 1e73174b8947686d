//! What people do without a probe: rules that copy parameters by their names.

use lookmatch_materials::fresnel::{f0_from_ior, ior_from_f0};
use lookmatch_materials::{Material, Model, Role, Value};

use crate::RemapError;
use crate::plan::carry_over;

/// A rule that turns a source material into a target material without looking at either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baseline {
    /// Same roughness; the target's reflectance at normal incidence is the source's.
    Copy,
    /// Same roughness; the target's Fresnel term is replaced by the source's constant reflectance, the rule of material
    /// distillers.
    CopyWithoutFresnel,
}

impl Baseline {
    /// Both rules.
    pub const ALL: [Self; 2] = [Self::Copy, Self::CopyWithoutFresnel];

    /// Name in tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::Copy => "copy",
            Self::CopyWithoutFresnel => "copy, no Fresnel",
        }
    }

    /// Applies the rule; `fixed` gives what it does not speak of. `None` where the target has no choice to leave the
    /// Fresnel term out.
    ///
    /// # Errors
    /// A value that the target cannot hold.
    pub fn apply(self, source: &Material, fixed: &Material) -> Result<Option<Material>, RemapError> {
        let mut target = fixed.clone();
        carry_over(source, &mut target, &[])?;
        copy_roughness(source, &mut target)?;
        let (scale, f0) = reflectance(source);
        match self {
            Self::Copy => copy_reflectance(scale, f0, &mut target)?,
            Self::CopyWithoutFresnel => {
                if !(has_choice(target.model(), "fresnel", "none") && f0.is_some()) {
                    return Ok(None);
                }
                target.set("fresnel", "none")?;
                set_by_role(&mut target, Role::SpecularReflectance, f0.unwrap_or(0.0))?;
            }
        }
        Ok(Some(target))
    }
}

fn copy_roughness(source: &Material, target: &mut Material) -> Result<(), RemapError> {
    let widths: Vec<Value> = source
        .model()
        .parameters
        .iter()
        .zip(source.values())
        .filter(|(p, _)| p.role == Role::Roughness)
        .map(|(_, v)| *v)
        .collect();
    let places: Vec<usize> = (0..target.values().len())
        .filter(|i| target.model().parameters[*i].role == Role::Roughness)
        .collect();
    for (index, value) in places.into_iter().zip(widths) {
        target.set_value(index, value)?;
    }
    Ok(())
}

/// The scale of a lobe, and its reflectance at normal incidence where it is that of a dielectric or has no Fresnel term.
fn reflectance(source: &Material) -> (f64, Option<f64>) {
    let number = |role| match source.by_role(role) {
        Some(Value::Number(v)) => Some(v),
        Some(Value::Colour([r, g, b])) => Some((r + g + b) / 3.0),
        _ => None,
    };
    let scale = number(Role::SpecularReflectance).unwrap_or(1.0);
    if number(Role::ConductorIndex).is_some() {
        return (scale, None);
    }
    (scale, Some(scale * number(Role::RefractiveIndex).map_or(1.0, f0_from_ior)))
}

fn copy_reflectance(scale: f64, f0: Option<f64>, target: &mut Material) -> Result<(), RemapError> {
    let has_index = target.by_role(Role::RefractiveIndex).is_some();
    match f0 {
        Some(f0) if has_index => {
            set_by_role(target, Role::SpecularReflectance, if f0 > 0.0 { 1.0 } else { 0.0 })?;
            // No index has F0 = 1 or 0; the closest that the target can hold.
            set_by_role(target, Role::RefractiveIndex, ior_from_f0(f0.clamp(1e-6, 0.96)))
        }
        Some(f0) if target.by_role(Role::ConductorIndex).is_none() => {
            set_by_role(target, Role::SpecularReflectance, f0)
        }
        _ => set_by_role(target, Role::SpecularReflectance, scale),
    }
}

fn set_by_role(target: &mut Material, role: Role, value: f64) -> Result<(), RemapError> {
    for parameter in target.model().parameters.iter().filter(|p| p.role == role) {
        target.set_number(parameter.name, value)?;
    }
    Ok(())
}

fn has_choice(model: &Model, name: &str, option: &str) -> bool {
    model.parameters.iter().any(|p| {
        p.name == name
            && matches!(p.kind, lookmatch_materials::Kind::Choice { options } if options.contains(&option))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apply(rule: Baseline, source: &str, target: &str) -> Option<Material> {
        rule.apply(&Material::parse(source).unwrap(), &Material::parse(target).unwrap()).unwrap()
    }

    #[test]
    fn copying_keeps_roughness_and_normal_reflectance() {
        let ward = "ward:diffuse=0.1/0.2/0.3,specular=0.04,roughness_u=0.2,roughness_v=0.3";
        let ggx = apply(Baseline::Copy, ward, "ggx").unwrap();
        assert!((ggx.number("ior").unwrap() - 1.5).abs() < 1e-9);
        assert_eq!((ggx.number("roughness_u").unwrap(), ggx.number("roughness_v").unwrap()), (0.2, 0.3));
        assert_eq!(ggx.number("diffuse").unwrap(), 0.1);
        let distilled = apply(Baseline::CopyWithoutFresnel, ward, "ggx").unwrap();
        assert_eq!(distilled.number("specular").unwrap(), 0.04);
        assert!(distilled.to_string().contains("fresnel=none"));
        let back = apply(Baseline::Copy, &ggx.to_string(), "ward").unwrap();
        assert!((back.number("specular").unwrap() - 0.04).abs() < 1e-9);
        assert!(apply(Baseline::CopyWithoutFresnel, "ggx", "ward").is_none());
    }
}
