//! What a target takes over from its source: all that neither the search nor the user sets.

use std::sync::OnceLock;

use lookmatch_materials::{Canonical, Material, Role, Value, hue};
use lookmatch_search::Axis;

use crate::RemapError;

/// A source material with what its targets take over from it, worked out once for all of them.
pub(crate) struct SourceLook<'a> {
    material: &'a Material,
    look: Canonical,
    /// Albedo of its diffuse reflection.
    albedo: OnceLock<[f64; 3]>,
    is_rounded: bool,
}

/// Steps of an albedo from 0 to 1 that targets are given while they are searched.
const ALBEDOS: f64 = 64.0;

impl<'a> SourceLook<'a> {
    pub(crate) fn new(material: &'a Material) -> Self {
        Self { material, look: material.canonical(), albedo: OnceLock::new(), is_rounded: false }
    }

    /// With a rounded albedo: the targets of many sources then have the same few bodies, and need not be rendered for each. A
    /// body a little too bright or too dark is so in all targets of a source alike.
    pub(crate) fn rounded(material: &'a Material) -> Self {
        Self::new(material).rounded_albedo()
    }

    /// With the albedo of its body as it was measured, for materials whose formulas are not known.
    pub(crate) fn measured(material: &'a Material, albedo: [f64; 3]) -> Self {
        let known = OnceLock::new();
        known.get_or_init(|| albedo);
        Self { albedo: known, ..Self::new(material) }
    }

    /// A body of Lambert's as pictures show it, with the hue of the highlights. A target that is nothing but metal takes
    /// that hue for its base colour.
    pub(crate) fn pictured(body: &'a Material, tint: [f64; 3], is_metal: bool) -> Self {
        let mut source = Self::new(body);
        source.look.f0 = Some(tint);
        if is_metal {
            source.look.body = tint;
        }
        source
    }

    /// The material itself.
    pub(crate) fn material(&self) -> &'a Material {
        self.material
    }

    /// With its albedo rounded, if it is not looked up yet or known from a measurement.
    pub(crate) fn rounded_albedo(mut self) -> Self {
        self.is_rounded = true;
        if let Some(albedo) = self.albedo.take() {
            self.albedo.get_or_init(|| albedo.map(rounded));
        }
        self
    }

    fn albedo(&self) -> [f64; 3] {
        let round = |v: f64| if self.is_rounded { rounded(v) } else { v };
        *self.albedo.get_or_init(|| self.material.diffuse_albedo().map(round))
    }
}

fn rounded(albedo: f64) -> f64 {
    (albedo * ALBEDOS).round() / ALBEDOS
}

/// How the colour of the body is carried over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Body {
    /// As it is written.
    Copied,
    /// Such that the diffuse reflections have the same albedo.
    Matched,
    /// As it is written, times a factor that pictures gave.
    Scaled([f64; 3]),
}

/// Sets what the search and the user leave alone to what the source has of it: a conductor's index, the colour of the body, the hue of
/// the specular reflection; a metal's colour and metalness where the target has one.
pub(crate) fn carry_over(
    source: &SourceLook,
    target: &mut Material,
    (searched, held): (&[Axis], &[String]),
    body: Body,
) -> Result<(), RemapError> {
    let model = target.model();
    let indices = |names: &mut dyn Iterator<Item = &String>| -> Result<Vec<usize>, RemapError> {
        Ok(names.map(|name| model.resolve(name)).collect::<Result<Vec<_>, _>>()?.concat())
    };
    let searched = indices(&mut searched.iter().map(|axis| &axis.name))?;
    let held = indices(&mut held.iter())?;
    let is_searched = |index: usize| searched.contains(&index);
    let is_free = |index: usize| !is_searched(index) && !held.contains(&index);
    let look = &source.look;
    let metal = metal(look, target);
    for (index, parameter) in target.model().parameters.iter().enumerate() {
        match (parameter.role, look.index) {
            (Role::ConductorIndex, Some([eta, _])) if is_free(index) => {
                target.set_value(index, Value::Colour(eta))?;
            }
            (Role::Extinction, Some([_, k])) if is_free(index) => {
                target.set_value(index, Value::Colour(k))?
            }
            // Layers that the source does not show stay as the target has them.
            (role, _) if role.is_layer() && is_free(index) && source.material.shows(role) => {
                if let Some(value) = source.material.by_role(role) {
                    target.set_role(role, value.colour().unwrap_or([0.0; 3]))?;
                }
            }
            // A searched colour is one number: it takes the hue of the source's.
            (Role::DiffuseReflectance | Role::BaseColour, _) if is_searched(index) => {
                target.set_value(index, tinted(&target.values()[index], hue(look.body)))?;
            }
            (Role::SpecularReflectance | Role::NormalReflectance | Role::LobeHeight, _)
                if is_searched(index) =>
            {
                target.set_value(index, tinted(&target.values()[index], look.tint()))?;
            }
            _ => {}
        }
    }
    let of_role = |wanted: fn(Role) -> bool| target.model().parameters.iter().position(|p| wanted(p.role));
    let is_metalness_free = of_role(|role| role == Role::Metalness).is_some_and(is_free);
    match of_role(Role::is_body).filter(|index| is_free(*index)) {
        Some(index) => match metal.filter(|_| is_metalness_free) {
            Some((metalness, colour)) => {
                target.set_role(Role::Metalness, [metalness; 3])?;
                Ok(target.set_role(Role::BaseColour, colour)?)
            }
            None => colour_body(source, target, target.model().parameters[index].role, body),
        },
        None => Ok(()),
    }
}

/// Gives the target the source's colour of the body, once all else is set.
fn colour_body(source: &SourceLook, target: &mut Material, role: Role, body: Body) -> Result<(), RemapError> {
    if let Body::Scaled(gain) = body {
        let scaled = std::array::from_fn(|c| source.look.body[c] * gain[c]);
        return Ok(target.set_role(role, scaled)?);
    }
    // Two Lambert terms are the same thing, and so are the bodies of one model.
    let same = source.material.by_role(role).and_then(|v| v.colour());
    let is_same_model = std::ptr::eq(source.material.model(), target.model());
    match same {
        Some(colour) if is_same_model || role == Role::DiffuseReflectance => {
            return Ok(target.set_role(role, colour)?);
        }
        _ if body == Body::Copied => return Ok(target.set_role(role, source.look.body)?),
        _ => {}
    }
    Ok(target.set_diffuse_albedo(role, source.albedo())?)
}

/// A colour multiplied by a hue; any other value as it is.
fn tinted(value: &Value, hue: [f64; 3]) -> Value {
    match value {
        Value::Colour(scale) => Value::Colour(std::array::from_fn(|c| scale[c] * hue[c])),
        other => other.clone(),
    }
}

/// Metalness and base colour that a target takes over, where it can be a metal and is not yet, and the source is one.
pub(crate) fn metal(look: &Canonical, target: &Material) -> Option<(f64, [f64; 3])> {
    let is_dielectric = target.by_role(Role::Metalness).is_some_and(|m| m.mean() == Some(0.0));
    if !is_dielectric || look.metalness == 0.0 {
        return None;
    }
    Some((look.metalness, look.base.or(look.f0)?))
}
