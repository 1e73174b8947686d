//! What a remap does, in full: models, lattices, scene, metric, strategy, search and seed.

use lookmatch_imaging::Fitness;
use lookmatch_materials::fresnel::{f0_from_ior, ior_from_f0};
use lookmatch_materials::{Levels, Material, Model, Role};
use lookmatch_rendering::Scene;
use lookmatch_search::Axis;
use serde::{Deserialize, Serialize};

use crate::RemapError;

/// How the results of neighbouring source points are used (Guarnera *et al.* 2018, 3.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Strategy {
    /// Corresponding parameters grow together, and each search starts from its neighbours' results.
    Constrained,
    /// Every source point is searched on its own.
    Unconstrained,
}

/// A named set of target ranges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// The plausible ranges of the paper's Table 3 (index of refraction up to 1.85), whatever the source needs.
    Paper,
}

/// One of the two models of a remap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The model that is remapped.
    Source,
    /// The model that is searched.
    Target,
}

/// A parameter to tabulate or search on a lattice of its own; without a side, the source's if it has one.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    /// Which model.
    pub side: Option<Side>,
    /// Parameter or alias.
    pub name: String,
    /// The lattice.
    pub levels: Levels,
}

/// A parameter held at a value; without a side, the source's if it has one.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    /// Which model.
    pub side: Option<Side>,
    /// Parameter or alias.
    pub name: String,
    /// The value as it is written in a material.
    pub value: String,
}

/// What a user may choose.
#[derive(Clone, Debug)]
pub struct Options {
    /// How neighbours are used.
    pub strategy: Strategy,
    /// Name of the search method.
    pub search: String,
    /// Lattices that replace the default ones.
    pub vary: Vec<Vary>,
    /// Parameters held at values.
    pub fix: Vec<Assignment>,
    /// Target ranges.
    pub preset: Option<Preset>,
    /// Seed of every random decision.
    pub seed: u64,
    /// Weight the sphere's middle more than its silhouette.
    pub mask: bool,
    /// A coarse source lattice and small pictures: seconds instead of a minute.
    pub quick: bool,
    /// Side of the pictures in pixels, where it is not to be the usual one.
    pub size: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            strategy: Strategy::Constrained,
            search: "genetic".into(),
            vary: Vec::new(),
            fix: Vec::new(),
            preset: None,
            seed: 1,
            mask: false,
            quick: false,
            size: None,
        }
    }
}

/// A remap, fully determined: two equal plans give equal probes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// The source model with the values of its parameters that do not vary.
    pub from: Material,
    /// The target model with the values of its parameters that are not searched.
    pub to: Material,
    /// Source parameters and their levels, the slowest first.
    pub source_axes: Vec<Axis>,
    /// Target parameters and their levels.
    pub target_axes: Vec<Axis>,
    /// How neighbours are used.
    pub strategy: Strategy,
    /// Name of the search method.
    pub search: String,
    /// Target ranges.
    pub preset: Option<Preset>,
    /// Seed of every random decision.
    pub seed: u64,
    /// The metric, Eq. 3 of the paper.
    pub metric: Fitness,
    /// True where the sphere's middle weighs more than its silhouette.
    pub mask: bool,
    /// The reference scene.
    pub scene: Scene,
    /// Side of its pictures in pixels.
    pub size: usize,
}

/// Sides of the reference pictures that can be compared: smaller ones show no highlight.
const SIZES: std::ops::RangeInclusive<usize> = 16..=2048;

/// Levels of a source axis in a quick remap, at most.
const QUICK_LEVELS: usize = 6;

impl Plan {
    /// Works out the lattices of a remap from one model to another.
    ///
    /// # Errors
    /// An option that names a parameter of neither model, or a lattice outside a parameter's range.
    pub fn new(from: &'static Model, to: &'static Model, options: &Options) -> Result<Self, RemapError> {
        lookmatch_search::by_name(&options.search).map_err(|e| RemapError::Option(e.to_string()))?;
        let mut source = Draft::new(from, from.surveyed, |r| r.survey)?;
        let mut target = Draft::new(to, to.searched, |r| r.search)?;
        check_names(options, from, to)?;
        for vary in &options.vary {
            let draft = pick(vary.side, &vary.name, &mut source, &mut target)?;
            draft.vary(&vary.name, vary.levels)?;
            draft.given.push(vary.name.clone());
        }
        for fix in &options.fix {
            pick(fix.side, &fix.name, &mut source, &mut target)?.fix(&fix.name, &fix.value)?;
        }
        if source.axes.is_empty() || target.axes.is_empty() {
            return Err(RemapError::Option(format!(
                "every parameter of {} is fixed; leave one to vary",
                if source.axes.is_empty() { from.name } else { to.name }
            )));
        }
        if options.size.is_some_and(|size| !SIZES.contains(&size)) {
            let (least, most) = (SIZES.start(), SIZES.end());
            return Err(RemapError::Option(format!(
                "reference pictures have {least} to {most} pixels a side"
            )));
        }
        target.follow(&source)?;
        if options.preset != Some(Preset::Paper) {
            target.widen(highest_f0(&source)?)?;
        }
        if options.quick {
            source.axes.iter_mut().for_each(|axis| *axis = thinned(axis));
        }
        Ok(Self {
            from: source.fixed,
            to: target.fixed,
            source_axes: source.axes,
            target_axes: target.axes,
            strategy: options.strategy,
            search: options.search.clone(),
            preset: options.preset,
            seed: options.seed,
            metric: Fitness::default(),
            mask: options.mask,
            scene: Scene::reference(),
            size: options.size.unwrap_or(if options.quick { 128 } else { 300 }),
        })
    }

    /// The source material at the given values of the source axes.
    pub fn source_material(&self, values: &[f64]) -> Result<Material, RemapError> {
        material(&self.from, &self.source_axes, values)
    }

    /// The target material at the given values of the target axes, beside a source: parameters that are not searched
    /// take the source's value of the same role (a diffuse colour, a conductor's index).
    pub fn target_material(&self, source: &Material, values: &[f64]) -> Result<Material, RemapError> {
        let mut target = material(&self.to, &self.target_axes, values)?;
        carry_over(source, &mut target, &self.target_axes)?;
        Ok(target)
    }
}

/// A material with the parameters of some axes set.
pub(crate) fn material(fixed: &Material, axes: &[Axis], values: &[f64]) -> Result<Material, RemapError> {
    let mut material = fixed.clone();
    for (axis, value) in axes.iter().zip(values) {
        material.set_number(&axis.name, *value)?;
    }
    Ok(material)
}

/// Copies what both models have and the search leaves alone.
pub(crate) fn carry_over(
    source: &Material,
    target: &mut Material,
    searched: &[Axis],
) -> Result<(), RemapError> {
    let taken: Vec<usize> =
        searched.iter().map(|a| target.model().resolve(&a.name)).collect::<Result<Vec<_>, _>>()?.concat();
    for (index, parameter) in target.model().parameters.iter().enumerate() {
        let shared = [Role::DiffuseReflectance, Role::ConductorIndex, Role::Extinction];
        if !shared.contains(&parameter.role) || taken.contains(&index) {
            continue;
        }
        if let Some(value) = source.by_role(parameter.role) {
            target.set_value(index, value)?;
        }
    }
    Ok(())
}

/// Refuses two options that speak of the same parameter of the same model.
fn check_names(options: &Options, from: &Model, to: &Model) -> Result<(), RemapError> {
    let mut taken: Vec<(&str, usize, &str)> = Vec::new();
    let varied = options.vary.iter().map(|v| (v.side, v.name.as_str()));
    let fixed = options.fix.iter().map(|f| (f.side, f.name.as_str()));
    for (side, name) in varied.chain(fixed) {
        let in_source = side != Some(Side::Target) && (side.is_some() || from.resolve(name).is_ok());
        let (label, model) = if in_source { ("source", from) } else { ("target", to) };
        for index in model.resolve(name)? {
            if let Some((_, _, other)) = taken.iter().find(|(l, i, _)| *l == label && *i == index) {
                return Err(RemapError::Option(format!(
                    "'{other}' and '{name}' both set {} of the {label} model {}; give one of them",
                    model.parameters[index].name, model.name
                )));
            }
            taken.push((label, index, name));
        }
    }
    Ok(())
}

/// A model on its way to becoming one side of a plan.
struct Draft {
    fixed: Material,
    axes: Vec<Axis>,
    /// Axes whose lattice the user gave.
    given: Vec<String>,
}

impl Draft {
    fn new(
        model: &'static Model,
        names: &[&str],
        levels: impl Fn(&lookmatch_materials::Range) -> Levels,
    ) -> Result<Self, RemapError> {
        let mut draft = Self { fixed: Material::new(model), axes: Vec::new(), given: Vec::new() };
        for name in names {
            if let Some(range) = model.parameter(name)?.range() {
                draft.vary(name, levels(range))?;
            }
        }
        Ok(draft)
    }

    /// Puts a parameter on a lattice, in the place of an axis that shares a parameter with it.
    fn vary(&mut self, name: &str, levels: Levels) -> Result<(), RemapError> {
        let axis = Axis::regular(name, levels.min, levels.max, levels.step)?;
        for value in [axis.value(0), axis.value(axis.len() - 1)] {
            self.fixed.clone().set_number(name, value)?;
        }
        let place = self.release(name)?.min(self.axes.len());
        self.axes.insert(place, axis);
        Ok(())
    }

    fn fix(&mut self, name: &str, value: &str) -> Result<(), RemapError> {
        self.fixed.set(name, value)?;
        self.release(name)?;
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

    /// Searches the parameters behind an alias (`roughness_u` and `roughness_v` behind `roughness`) one by one where the
    /// source does not tie them: an anisotropic source has an anisotropic target.
    fn follow(&mut self, source: &Draft) -> Result<(), RemapError> {
        let model = self.fixed.model();
        for alias in model.aliases {
            let is_tied =
                self.axes.iter().any(|a| a.name == alias.name) && !self.given.iter().any(|n| n == alias.name);
            if !is_tied || source.ties(alias.parameters)? {
                continue;
            }
            for name in alias.parameters {
                if let Some(range) = model.parameter(name)?.range() {
                    self.vary(name, range.search)?;
                }
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
    fn widen(&mut self, f0: Option<f64>) -> Result<(), RemapError> {
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
            let Levels { min, max, step } = range.search;
            if needed > max {
                let steps = ((needed - min) / step - 1e-9).ceil();
                *axis = Axis::regular(&axis.name, min, (min + steps * step).min(range.valid.max), step)?;
            }
        }
        Ok(())
    }
}

/// The side that an option speaks of.
fn pick<'a>(
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

/// The highest reflectance at normal incidence that a side can have, for models with one.
fn highest_f0(draft: &Draft) -> Result<Option<f64>, RemapError> {
    let model = draft.fixed.model();
    let highest = |role: Role| -> Result<Option<f64>, RemapError> {
        for (index, parameter) in model.parameters.iter().enumerate() {
            if parameter.role == role {
                let axis =
                    draft.axes.iter().find(|a| model.resolve(&a.name).is_ok_and(|i| i.contains(&index)));
                return Ok(Some(match axis {
                    Some(axis) => axis.value(axis.len() - 1),
                    None => draft.fixed.number(parameter.name)?,
                }));
            }
        }
        Ok(None)
    };
    if highest(Role::ConductorIndex)?.is_some() {
        return Ok(None);
    }
    let scale = highest(Role::SpecularReflectance)?;
    Ok(match (scale, highest(Role::RefractiveIndex)?) {
        (Some(scale), Some(ior)) => Some(scale * f0_from_ior(ior)),
        (scale, None) => scale,
        (None, Some(ior)) => Some(f0_from_ior(ior)),
    })
}

/// At most [`QUICK_LEVELS`] levels of an axis, both ends among them.
fn thinned(axis: &Axis) -> Axis {
    let last = axis.len() - 1;
    if axis.len() <= QUICK_LEVELS {
        return axis.clone();
    }
    let level = |k: usize| axis.value((k * last + (QUICK_LEVELS - 1) / 2) / (QUICK_LEVELS - 1));
    Axis { name: axis.name.clone(), levels: (0..QUICK_LEVELS).map(level).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookmatch_materials::by_name;

    fn plan(from: &str, to: &str, options: &Options) -> Plan {
        Plan::new(by_name(from).unwrap(), by_name(to).unwrap(), options).unwrap()
    }

    #[test]
    fn the_main_job_has_the_papers_lattices() {
        let free = plan("ward", "ggx", &Options::default());
        let counts = |axes: &[Axis]| axes.iter().map(|a| (a.name.clone(), a.len())).collect::<Vec<_>>();
        assert_eq!(counts(&free.source_axes), [("specular".into(), 20), ("roughness".into(), 35)]);
        let ior = &free.target_axes[1];
        assert_eq!((ior.value(0), ior.value(ior.len() - 1)), (1.01, 4.45), "0.4 needs an index of 4.44");
        let paper = plan("ward", "ggx", &Options { preset: Some(Preset::Paper), ..Options::default() });
        assert_eq!(
            counts(&paper.target_axes),
            [("specular".into(), 2), ("ior".into(), 85), ("roughness".into(), 70)]
        );
    }

    #[test]
    fn options_replace_lattices_and_fix_values() {
        let vary = |name: &str, min, max, step| Vary {
            side: None,
            name: name.into(),
            levels: Levels::new(min, max, step),
        };
        let fix = Assignment { side: None, name: "specular".into(), value: "0.1".into() };
        let options = Options {
            vary: vec![vary("roughness_u", 0.1, 0.3, 0.1), vary("ior", 1.3, 1.6, 0.1)],
            fix: vec![fix],
            ..Options::default()
        };
        let plan = plan("ward", "ggx", &options);
        assert_eq!(plan.source_axes.len(), 1);
        assert_eq!(plan.source_axes[0].levels, [0.1, 0.2, 0.3]);
        assert_eq!(plan.from.number("specular").unwrap(), 0.1);
        assert_eq!(plan.target_axes[1].levels, [1.3, 1.4, 1.5, 1.6]);
    }

    #[test]
    fn an_anisotropic_source_has_an_anisotropic_target() {
        let names = |plan: &Plan| plan.target_axes.iter().map(|a| a.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&plan("ward", "ggx", &Options::default())), ["specular", "ior", "roughness"]);
        let brushed = Assignment { side: None, name: "roughness_u".into(), value: "0.05".into() };
        let options = Options { fix: vec![brushed], ..Options::default() };
        assert_eq!(names(&plan("ward", "ggx", &options)), ["specular", "ior", "roughness_u", "roughness_v"]);
    }

    #[test]
    fn shared_roles_are_carried_over() {
        let plan = plan("as", "beckmann-conductor", &Options::default());
        let mut gold = plan.source_material(&[0.2]).unwrap();
        gold.set("eta", "0.13/0.44/1.44").unwrap();
        let target = plan.target_material(&gold, &[0.3]).unwrap();
        assert_eq!(target.by_role(Role::ConductorIndex), gold.by_role(Role::ConductorIndex));
        assert_eq!(target.number("roughness").unwrap(), 0.3);
    }

    #[test]
    fn unknown_names_are_refused_with_a_hint() {
        let fix = Assignment { side: None, name: "roughnes".into(), value: "0.1".into() };
        let options = Options { fix: vec![fix], ..Options::default() };
        let error = Plan::new(by_name("ward").unwrap(), by_name("ggx").unwrap(), &options).unwrap_err();
        assert!(error.is_usage() && error.to_string().contains("did you mean 'roughness'?"), "{error}");
    }
}
