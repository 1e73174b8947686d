//! What people do without a probe: rules that copy parameters by their names, and published translations.

mod translation;

use lookmatch_materials::{Material, Model, Role};

use crate::RemapError;
use crate::carry::{Body, SourceLook, carry_over};

/// A rule that turns a source material into a target material without looking at either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baseline {
    /// Same width of the lobe, in the microfacet α; the target's reflectance at normal incidence is the source's.
    Copy,
    /// Same width; the target's Fresnel term is replaced by the source's constant reflectance, the rule of material
    /// distillers.
    CopyWithoutFresnel,
    /// MaterialX's published translation, where there is one between the models.
    Translation,
}

impl Baseline {
    /// All rules.
    pub const ALL: [Self; 3] = [Self::Copy, Self::CopyWithoutFresnel, Self::Translation];

    /// Name in tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::Copy => "copy",
            Self::CopyWithoutFresnel => "copy, no Fresnel",
            Self::Translation => "MaterialX translation",
        }
    }

    /// Applies the rule; `fixed` gives what it does not speak of. `None` where the target has no choice to leave the
    /// Fresnel term out, and where no translation was published.
    ///
    /// # Errors
    /// A value that the target cannot hold.
    pub fn apply(self, source: &Material, fixed: &Material) -> Result<Option<Material>, RemapError> {
        match self {
            Self::Copy => copy(source, fixed).map(Some),
            Self::CopyWithoutFresnel => copy_without_fresnel(source, fixed),
            Self::Translation => translation::translate(source, fixed),
        }
    }
}

/// The target with the source's body, layers and width of the lobe.
fn with_width(source: &Material, fixed: &Material) -> Result<Material, RemapError> {
    let mut target = fixed.clone();
    carry_over(&SourceLook::new(source), &mut target, (&[], &[]), Body::Copied)?;
    if let Some(alpha) = source.canonical().alpha {
        target.set_alpha(alpha)?;
    }
    Ok(target)
}

fn copy(source: &Material, fixed: &Material) -> Result<Material, RemapError> {
    let mut target = with_width(source, fixed)?;
    let look = source.canonical();
    if !target.is_conductor() {
        look.f0.map_or(Ok(()), |f0| target.set_f0(f0))?;
    } else if look.index.is_some() {
        // Both have a complex index, which was carried over: what is left is the scale of the lobe.
        let scale = source.by_role(Role::SpecularReflectance).and_then(|v| v.mean());
        target.set_role(Role::SpecularReflectance, [scale.unwrap_or(1.0); 3])?;
    } else {
        // The index stays as it is: the scale makes up for it.
        target.set_role(Role::SpecularReflectance, [1.0; 3])?;
        if let Some((wanted, own)) = look.f0.zip(target.canonical().f0) {
            let scale = std::array::from_fn(|c| wanted[c] / own[c].max(1e-9));
            target.set_role(Role::SpecularReflectance, scale)?;
        }
    }
    Ok(target)
}

fn copy_without_fresnel(source: &Material, fixed: &Material) -> Result<Option<Material>, RemapError> {
    let look = source.canonical();
    let f0 = look.f0.filter(|_| look.index.is_none());
    let (true, Some(f0)) = (has_choice(fixed.model(), "fresnel", "none"), f0) else { return Ok(None) };
    let mut target = with_width(source, fixed)?;
    target.set("fresnel", "none")?;
    target.set_role(Role::SpecularReflectance, f0)?;
    Ok(Some(target))
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
        let metal = apply(Baseline::Copy, ward, "ggx-conductor").unwrap();
        assert!((metal.canonical().f0.unwrap()[0] - 0.04).abs() < 1e-9, "{metal}");
    }
}
