//! One side of a plan in the making: which parameters vary, on which lattices, and which are held.

use lookmatch_materials::fresnel::ior_from_f0;
use lookmatch_materials::{Levels, Material, Range, Role, Scale};
use lookmatch_search::Axis;

use crate::RemapError;
use crate::carry::metal;
use crate::options::Side;

/// Up to here an index of refraction is widened in equal steps: it stands for a reflectance of 0.4.
const EQUAL_STEPS: f64 = 4.45;

/// η and k of a metal without colour that reflects 0.965 of what falls on it: about as much as silver.
const BRIGHT_METAL: [f64; 2] = [0.15, 4.0];

/// Step of the scale of a conductor that is to look like something else.
const SCALE_STEP: f64 = 0.02;

/// Levels of a source axis in a quick remap, at most.
const QUICK_LEVELS: usize = 5;

/// A model on its way to becoming one side of a plan.
pub(crate) struct Draft {
    pub(crate) fixed: Material,
    pub(crate) axes: Vec<Axis>,
    /// Axes whose lattice the user gave.
    pub(crate) given: Vec<String>,
    /// Parameters that the user fixed.
    pub(crate) held: Vec<&'static str>,
}

impl Draft {
    pub(crate) fn new(
        fixed: Material,
        names: &[&str],
        levels: fn(&Range) -> Levels,
    ) -> Result<Self, RemapError> {
        let mut draft = Self { fixed, axes: Vec::new(), given: Vec::new(), held: Vec::new() };
        names.iter().try_for_each(|name| draft.vary_by_default(name, levels))?;
        Ok(draft)
    }

    /// Puts a parameter on a lattice that its description gives.
    fn vary_by_default(&mut self, name: &str, levels: fn(&Range) -> Levels) -> Result<(), RemapError> {
        let Some(range) = self.fixed.model().parameter(name)?.range() else { return Ok(()) };
        let axis = match range.scale {
            Scale::Linear => Axis::regular(name, levels(range).min, levels(range).max, levels(range).step)?,
            Scale::Logarithmic => geometric(name, levels(range))?,
        };
        self.insert(axis)
    }

    /// Puts a parameter on a regular lattice.
    pub(crate) fn vary(&mut self, name: &str, levels: Levels) -> Result<(), RemapError> {
        self.insert(Axis::regular(name, levels.min, levels.max, levels.step)?)
    }

    /// Adds an axis, in the place of one that shares a parameter with it.
    fn insert(&mut self, axis: Axis) -> Result<(), RemapError> {
        let name = &axis.name.clone();
        for value in [axis.value(0), axis.value(axis.len() - 1)] {
            self.fixed.clone().set_number(name, value)?;
        }
        let place = self.release(name)?.min(self.axes.len());
        self.axes.insert(place, axis);
        Ok(())
    }

    pub(crate) fn fix(&mut self, name: &str, value: &str) -> Result<(), RemapError> {
        self.fixed.set(name, value)?;
        self.release(name)?;
        let model = self.fixed.model();
        self.held.extend(model.resolve(name)?.into_iter().map(|i| model.parameters[i].name));
        Ok(())
    }

    /// Removes the axes that share a parameter with a name; returns where the first was, or the end.
    fn release(&mut self, name: &str) -> Result<usize, RemapError> {
        let model = self.fixed.model();
        let indices = model.resolve(name)?;
        let overlaps = |axis: &Axis| {
            model.resolve(&axis.name).is_ok_and(|other| other.iter().any(|i| indices.contains(i)))
        };
        let place = self.axes.iter().position(overlaps).unwrap_or(self.axes.len());
        self.axes.retain(|axis| !overlaps(axis));
        Ok(place)
    }

    /// Searches what matters beside a source: of a target that becomes a metal, nothing of the dielectric; of a target that
    /// is a conductor, its scale, unless its index can be the source's.
    pub(crate) fn suit(&mut self, source: &Material) -> Result<(), RemapError> {
        let model = self.fixed.model();
        // Mostly metal: what decides the reflectance of the dielectric is hardly seen.
        if metal(&source.canonical(), &self.fixed).is_some_and(|(metalness, _)| metalness > 0.5) {
            let given = &self.given;
            let role = |axis: &Axis| model.parameter(&axis.name).map(|p| p.role);
            self.axes
                .retain(|axis| given.contains(&axis.name) || !role(axis).is_ok_and(Role::is_reflectance));
        }
        let is_conductor = self.fixed.is_conductor();
        let scale = model.parameters.iter().find(|p| p.role == Role::SpecularReflectance);
        if let Some(scale) = scale.filter(|_| is_conductor && source.canonical().index.is_none()) {
            let is_set = self.axes.iter().any(|a| a.name == scale.name) || self.held.contains(&scale.name);
            if !is_set {
                let axis = Axis::regular(scale.name, 0.0, 1.0, SCALE_STEP)?;
                self.axes.insert(0, axis);
            }
        }
        Ok(())
    }

    /// Pictures of a metal tell its colour, which no parameter does. A conductor starts as bright as any, so that its scale
    /// reaches all metals.
    pub(crate) fn suit_pictures(&mut self, is_named: bool) -> Result<(), RemapError> {
        let model = self.fixed.model();
        if self.fixed.is_conductor() && !is_named {
            for (role, value) in
                [(Role::ConductorIndex, BRIGHT_METAL[0]), (Role::Extinction, BRIGHT_METAL[1])]
            {
                let is_set = |name: &'static str| {
                    self.held.contains(&name) || self.given.iter().any(|given| given == name)
                };
                if !model.parameters.iter().any(|p| p.role == role && is_set(p.name)) {
                    self.fixed.set_role(role, [value; 3])?;
                }
            }
        }
        let is_metal = self.fixed.by_role(Role::Metalness).is_some_and(|m| m.mean() == Some(1.0));
        let base = model.parameters.iter().find(|p| p.role == Role::BaseColour).filter(|_| is_metal);
        let Some(base) = base else { return Ok(()) };
        let given = &self.given;
        let role = |axis: &Axis| model.parameter(&axis.name).map(|p| p.role);
        self.axes.retain(|axis| given.contains(&axis.name) || !role(axis).is_ok_and(Role::is_reflectance));
        let is_set = self.axes.iter().any(|a| a.name == base.name) || self.held.contains(&base.name);
        if !is_set {
            self.insert(Axis::regular(base.name, 0.0, 1.0, SCALE_STEP)?)?;
        }
        Ok(())
    }

    /// An anisotropic source has an anisotropic target: searches how much longer the lobe is one way than the other, and the
    /// parameters behind an alias (`roughness_u` and `roughness_v` behind `roughness`) one by one.
    pub(crate) fn follow(&mut self, source: &Draft) -> Result<(), RemapError> {
        let model = self.fixed.model();
        let is_brushed = !source.fixed.is_isotropic();
        let anisotropy = model.parameters.iter().find(|p| p.role == Role::Anisotropy);
        if let Some(parameter) = anisotropy.filter(|p| is_brushed && !self.held.contains(&p.name)) {
            self.vary_by_default(parameter.name, |range| range.search)?;
        }
        for alias in model.aliases {
            let is_tied =
                self.axes.iter().any(|a| a.name == alias.name) && !self.given.iter().any(|n| n == alias.name);
            if !is_tied || !is_brushed && source.ties(alias.parameters)? {
                continue;
            }
            for name in alias.parameters {
                self.vary_by_default(name, |range| range.search)?;
            }
        }
        Ok(())
    }

    /// True where some parameters always have the same value; also where there are none of that name.
    fn ties(&self, names: &[&str]) -> Result<bool, RemapError> {
        let model = self.fixed.model();
        if names.iter().any(|name| model.resolve(name).is_err()) {
            return Ok(true);
        }
        let values = names.iter().map(|name| self.fixed.number(name)).collect::<Result<Vec<f64>, _>>()?;
        let varies_alone = self.axes.iter().any(|axis| names.contains(&axis.name.as_str()));
        Ok(!varies_alone && values.iter().all(|v| *v == values[0]))
    }

    /// Extends the lattice of an index of refraction, or of a specular reflectance without Fresnel effect, to the normal
    /// reflectance that the source reaches, unless the user gave that lattice.
    pub(crate) fn widen(&mut self, f0: Option<f64>) -> Result<(), RemapError> {
        let Some(f0) = f0 else { return Ok(()) };
        let model = self.fixed.model();
        for axis in &mut self.axes {
            let parameter = model.parameter(&axis.name)?;
            let needed = match parameter.role {
                Role::RefractiveIndex => ior_from_f0(f0.min(0.98)),
                Role::SpecularReflectance if !model.has_fresnel => f0,
                _ => continue,
            };
            let Some(range) = parameter.range().filter(|_| !self.given.contains(&axis.name)) else {
                continue;
            };
            if needed > range.search.max {
                *axis = widened(&axis.name, range, needed)?;
            }
        }
        Ok(())
    }
}

/// The side that an option speaks of.
pub(crate) fn pick<'a>(
    side: Option<Side>,
    name: &str,
    source: &'a mut Draft,
    target: &'a mut Draft,
) -> Result<&'a mut Draft, RemapError> {
    let has = |draft: &Draft| draft.fixed.model().resolve(name).is_ok();
    match side {
        Some(Side::Source) => Ok(source),
        Some(Side::Target) => Ok(target),
        None if has(source) => Ok(source),
        None if has(target) => Ok(target),
        None => {
            // Neither has it: the target's message would do as well.
            source.fixed.model().resolve(name)?;
            Ok(source)
        }
    }
}

/// The highest reflectance at normal incidence that a side can have, in any channel; `None` where its parameters do not
/// tell.
pub(crate) fn highest_f0(draft: &Draft) -> Result<Option<f64>, RemapError> {
    let mut brightest = draft.fixed.clone();
    for axis in &draft.axes {
        brightest.set_number(&axis.name, axis.value(axis.len() - 1))?;
    }
    let f0 = brightest.canonical().f0;
    Ok(f0.map(|f0| f0.into_iter().fold(0.0, f64::max)))
}

/// The levels of a range, carried on to at least `needed`: in equal steps at first, then in equal ratios.
fn widened(name: &str, range: &Range, needed: f64) -> Result<Axis, RemapError> {
    let Levels { min, step, .. } = range.search;
    let steps = |to: f64| ((to - min) / step - 1e-9).ceil();
    let regular = needed.min(EQUAL_STEPS).min(range.valid.max);
    let mut levels = Axis::regular(name, min, min + steps(regular) * step, step)?.levels;
    levels.retain(|level| *level <= range.valid.max);
    while levels.last().is_some_and(|last| *last < needed.min(range.valid.max)) {
        let next = levels[levels.len() - 1] * (1.0 + step);
        levels.push(((next * 1e3).round() / 1e3).min(range.valid.max));
    }
    Ok(Axis::listed(name, levels)?)
}

/// Levels of equal ratios.
fn geometric(name: &str, Levels { min, max, step }: Levels) -> Result<Axis, RemapError> {
    let count = ((max / min).ln() / step.ln() + 1e-9).floor() as i32;
    let round = |v: f64| {
        // Four digits tell levels apart and are short to read.
        let digit = 10f64.powi(v.abs().log10().floor() as i32 - 3);
        (v / digit).round() * digit
    };
    let rounded = |v: f64| (round(v) * 1e9).round() / 1e9;
    Ok(Axis::listed(name, (0..=count).map(|k| rounded(min * step.powi(k))).collect())?)
}

/// At most [`QUICK_LEVELS`] levels of an axis, both ends among them.
pub(crate) fn thinned(axis: &Axis) -> Axis {
    let last = axis.len() - 1;
    if axis.len() <= QUICK_LEVELS {
        return axis.clone();
    }
    let level = |k: usize| axis.value((k * last + (QUICK_LEVELS - 1) / 2) / (QUICK_LEVELS - 1));
    Axis { name: axis.name.clone(), levels: (0..QUICK_LEVELS).map(level).collect() }
}
