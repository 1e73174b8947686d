//! What becomes of each of the source's parameters in the target model: kept exactly, matched with an error that was
//! measured, or lost.

use lookmatch_materials::{Material, Parameter, Role};
use lookmatch_search::Axis;
use serde::Serialize;

use crate::{Probe, RemapError};

/// How well the target honours one parameter of the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LossClass {
    /// The target has the same parameter, and it is handed over as it is.
    Exact,
    /// The target has other means, and the search found how close they come.
    Bounded,
    /// The target has nothing that could show it.
    Lost,
}

/// What becomes of one parameter of the source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Loss {
    /// Its name.
    pub parameter: &'static str,
    /// How well it is honoured.
    pub class: LossClass,
    /// In one clause, why.
    pub reason: String,
    /// Mean and largest NRMSD over all source points and channels, masked: what the matches look like with this
    /// parameter and all others; `None` where it is handed over exactly.
    pub nrmsd: Option<[f64; 2]>,
}

/// What becomes of every parameter of a probe's source that varies or that shows.
///
/// # Errors
/// Where an axis of the probe is no parameter of its model.
pub fn losses(probe: &Probe) -> Result<Vec<Loss>, RemapError> {
    let sides = Sides::new(probe)?;
    let measured = measured(probe);
    let model = probe.from.model();
    let mut losses = Vec::new();
    for (index, parameter) in model.parameters.iter().enumerate() {
        let varies = sides.varied.contains(&index);
        if !varies && !probe.from.shows(parameter.role) {
            continue;
        }
        let (class, reason) = sides.class(probe, parameter, varies);
        let nrmsd = (class != LossClass::Exact).then_some(measured);
        losses.push(Loss { parameter: parameter.name, class, reason, nrmsd });
    }
    Ok(losses)
}

/// Which parameters the axes of both sides stand for.
struct Sides {
    /// Indices of source parameters on axes.
    varied: Vec<usize>,
    /// Roles of target parameters on axes.
    searched: Vec<Role>,
}

impl Sides {
    fn new(probe: &Probe) -> Result<Self, RemapError> {
        let indices = |material: &Material, axes: &[Axis]| -> Result<Vec<usize>, RemapError> {
            let each = axes.iter().map(|axis| material.model().resolve(&axis.name));
            Ok(each.collect::<Result<Vec<_>, _>>()?.concat())
        };
        let searched = indices(&probe.to, &probe.target_axes)?;
        let searched = searched.into_iter().map(|i| probe.to.model().parameters[i].role).collect();
        Ok(Self { varied: indices(&probe.from, &probe.source_axes)?, searched })
    }

    fn class(&self, probe: &Probe, parameter: &Parameter, varies: bool) -> (LossClass, String) {
        let to = probe.to.model();
        if std::ptr::eq(probe.from.model(), to) && !varies {
            return (LossClass::Exact, "both sides are the same model".into());
        }
        let has = |role: Role| to.parameters.iter().any(|p| p.role == role);
        let role = parameter.role;
        if is_handed_over(role) && has(role) && !self.searched.contains(&role) {
            return (LossClass::Exact, format!("{} takes it over", to.name));
        }
        if role == Role::Roughness && self.is_second_width(probe, parameter) && !self.is_anisotropic() {
            return (LossClass::Lost, format!("the lobe of {} is isotropic", to.name));
        }
        if role.is_layer() && has(role) {
            return (LossClass::Bounded, format!("{} takes it over, in a layer of its own kind", to.name));
        }
        let same = self.searched.iter().find(|target| **target == role);
        let follower = same.or_else(|| self.searched.iter().find(|target| role.trend(**target).is_some()));
        if let Some(follower) = follower {
            return (LossClass::Bounded, format!("matched by the {} of {}", follower.title(), to.name));
        }
        let stand_ins: &[Role] = match role {
            Role::DiffuseReflectance | Role::BaseColour | Role::BaseWeight | Role::Metalness => {
                &[Role::DiffuseReflectance, Role::BaseColour]
            }
            Role::ConductorIndex | Role::Extinction | Role::SpecularColour => {
                &[Role::SpecularReflectance, Role::NormalReflectance, Role::RefractiveIndex, Role::BaseColour]
            }
            Role::LobeShape | Role::Measurement | Role::Variant => {
                &[Role::Roughness, Role::PerceptualRoughness, Role::Glossiness, Role::Exponent]
            }
            Role::Anisotropy if self.is_anisotropic() => &[Role::Roughness, Role::Anisotropy],
            _ => &[],
        };
        match stand_ins.iter().find(|stand_in| has(**stand_in)) {
            Some(stand_in) => {
                (LossClass::Bounded, format!("{} has {} to stand in for it", to.name, stand_in.title()))
            }
            None if has(role) => {
                (LossClass::Lost, format!("the {} of {} was not searched", role.title(), to.name))
            }
            None => (LossClass::Lost, format!("{} has no {}", to.name, role.title())),
        }
    }

    /// True where the target's lobe may be longer one way than the other.
    fn is_anisotropic(&self) -> bool {
        let widths = self.searched.iter().filter(|role| role.is_width()).count();
        widths > 1 || self.searched.contains(&Role::Anisotropy)
    }

    /// True for the second of two widths that differ.
    fn is_second_width(&self, probe: &Probe, parameter: &Parameter) -> bool {
        let model = probe.from.model();
        let widths: Vec<usize> =
            (0..model.parameters.len()).filter(|i| model.parameters[*i].role.is_width()).collect();
        let [first, second] = widths[..] else { return false };
        let values = probe.from.values();
        let differ =
            values[first] != values[second] || self.varied.contains(&first) != self.varied.contains(&second);
        let tied = probe.source_axes.iter().any(|axis| model.resolve(&axis.name).is_ok_and(|i| i.len() > 1));
        std::ptr::eq(&model.parameters[second], parameter) && differ && !tied
    }
}

/// True for what [`crate::carry::carry_over`] copies without a change.
fn is_handed_over(role: Role) -> bool {
    matches!(role, Role::DiffuseReflectance | Role::ConductorIndex | Role::Extinction)
}

/// Mean and largest masked NRMSD of a probe.
fn measured(probe: &Probe) -> [f64; 2] {
    let all = || probe.found().flat_map(|entry| entry.nrmsd_masked);
    let count = all().count().max(1) as f64;
    [all().sum::<f64>() / count, all().fold(0.0, f64::max)]
}
