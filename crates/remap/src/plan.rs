//! What a remap does, in full: models, lattices, scene, metric, strategy, search and seed.

use lookmatch_imaging::Fitness;
use lookmatch_materials::fresnel::ior_from_f0;
use lookmatch_materials::{Levels, Material, Model, Range, Role, Scale};
use lookmatch_rendering::Scene;
use lookmatch_search::Axis;
use serde::{Deserialize, Serialize};

use crate::RemapError;
use crate::carry::{Body, SourceLook, carry_over, metal};
use crate::studio::{RendererRecord, Sampling};

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
    /// Name of the search method, or `auto`: `genetic`, and `survey` where targets are dear.
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
    /// Samples of the pictures of other renderers.
    pub sampling: Sampling,
    /// The renderers that are at hand.
    pub renderers: Vec<RendererRecord>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            strategy: Strategy::Constrained,
            search: AUTO.into(),
            vary: Vec::new(),
            fix: Vec::new(),
            preset: None,
            seed: 1,
            mask: false,
            quick: false,
            size: None,
            sampling: Sampling::default(),
            renderers: Vec::new(),
        }
    }
}

/// One end of a remap.
#[derive(Clone, Debug)]
pub enum Endpoint {
    /// A model: as a source, tabulated over some of its parameters.
    Model(&'static Model),
    /// A named material, `low-abc@chrome`.
    Named(Material),
}

impl Endpoint {
    /// Reads `MODEL` or `MODEL@PRESET`.
    ///
    /// # Errors
    /// An unknown name.
    pub fn parse(text: &str) -> Result<Self, RemapError> {
        let material = Material::named(text)?;
        Ok(if text.contains('@') { Self::Named(material) } else { Self::Model(material.model()) })
    }

    /// Its model.
    pub fn model(&self) -> &'static Model {
        match self {
            Self::Model(model) => model,
            Self::Named(material) => material.model(),
        }
    }

    fn material(&self) -> Material {
        match self {
            Self::Model(model) => Material::new(model),
            Self::Named(material) => material.clone(),
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
    /// Target parameters that the user fixed: they take nothing over from the source.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub held: Vec<String>,
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
    /// Samples of the pictures of other renderers, where there are some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Sampling>,
    /// Those renderers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub renderers: Vec<RendererRecord>,
}

/// The search that suits the target.
const AUTO: &str = "auto";

/// Sides of the reference pictures that can be compared: smaller ones show no highlight.
const SIZES: std::ops::RangeInclusive<usize> = 16..=2048;

/// Up to here an index of refraction is widened in equal steps: it stands for a reflectance of 0.4.
const EQUAL_STEPS: f64 = 4.45;

/// Step of the scale of a conductor that is to look like something else.
const SCALE_STEP: f64 = 0.02;

/// Levels of a source axis in a quick remap, at most.
const QUICK_LEVELS: usize = 5;

impl Plan {
    /// Works out the lattices of a remap from one model to another.
    ///
    /// # Errors
    /// An option that names a parameter of neither model, or a lattice outside a parameter's range.
    pub fn new(from: &'static Model, to: &'static Model, options: &Options) -> Result<Self, RemapError> {
        Self::between(Endpoint::Model(from), Endpoint::Model(to), options)
    }

    /// [`Plan::new`] between models or named materials: a named source is one material, and a named target gives the values
    /// that are not searched.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn between(from: Endpoint, to: Endpoint, options: &Options) -> Result<Self, RemapError> {
        let search = match (options.search.as_str(), to.model().renderer) {
            (AUTO, None) => "genetic",
            (AUTO, Some(_)) => "survey",
            (name, _) => name,
        };
        lookmatch_search::by_name(search).map_err(|e| RemapError::Option(e.to_string()))?;
        let surveyed = if let Endpoint::Model(model) = from { model.surveyed } else { &[] };
        let mut source = Draft::new(from.material(), surveyed, |r| r.survey)?;
        let mut target = Draft::new(to.material(), to.model().searched, |r| r.search)?;
        let (from, to) = (from.model(), to.model());
        check_names(options, from, to)?;
        for vary in &options.vary {
            let draft = pick(vary.side, &vary.name, &mut source, &mut target)?;
            draft.vary(&vary.name, vary.levels)?;
            draft.given.push(vary.name.clone());
        }
        for fix in &options.fix {
            pick(fix.side, &fix.name, &mut source, &mut target)?.fix(&fix.name, &fix.value)?;
        }
        let from_material = source.fixed.clone().checked()?;
        target.suit(&from_material)?;
        if target.axes.is_empty() {
            let why = if to.searched.is_empty() {
                "has no parameters to search: it can only be a source"
            } else {
                "is fixed in every parameter"
            };
            return Err(RemapError::Option(format!("the target model {} {why}", to.name)));
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
        let is_foreign = from.renderer.is_some() || to.renderer.is_some();
        let takes_part = |record: &&RendererRecord| {
            [from, to].iter().any(|model| model.renderer == Some(record.name.as_str()))
        };
        Ok(Self {
            sampling: is_foreign.then_some(options.sampling),
            renderers: options.renderers.iter().filter(takes_part).cloned().collect(),
            from: source.fixed,
            to: target.fixed,
            source_axes: source.axes,
            target_axes: target.axes,
            strategy: options.strategy,
            search: search.to_owned(),
            held: target.held.iter().map(|name| (*name).to_owned()).collect(),
            preset: options.preset,
            seed: options.seed,
            metric: Fitness::default(),
            mask: options.mask,
            scene: Scene::reference(),
            size: options.size.unwrap_or(match (is_foreign, options.quick) {
                // Pictures of other renderers take seconds, and as many times longer as they have pixels.
                (true, true) => 64,
                (true, false) | (false, true) => 128,
                (false, false) => 300,
            }),
        })
    }

    /// The source material at the given values of the source axes.
    pub fn source_material(&self, values: &[f64]) -> Result<Material, RemapError> {
        material(&self.from, &self.source_axes, values)
    }

    /// The target material at the given values of the target axes, beside a source: what is not searched is taken over from it.
    pub fn target_material(&self, source: &Material, values: &[f64]) -> Result<Material, RemapError> {
        self.target_beside(&SourceLook::new(source), values)
    }

    /// [`Plan::target_material`] beside a source that is asked for more than once.
    pub(crate) fn target_beside(&self, source: &SourceLook, values: &[f64]) -> Result<Material, RemapError> {
        self.target_with(source, values, Body::Matched)
    }

    /// [`Plan::target_beside`] with a choice of what becomes of the body's colour.
    pub(crate) fn target_with(
        &self,
        source: &SourceLook,
        values: &[f64],
        body: Body,
    ) -> Result<Material, RemapError> {
        let mut target = material(&self.to, &self.target_axes, values)?;
        carry_over(source, &mut target, (&self.target_axes, &self.held), body)?;
        Ok(target)
    }

    /// Names of the renderers whose models it speaks of, ours left out.
    pub fn renderers_needed(&self) -> Vec<&'static str> {
        let mut names: Vec<&str> =
            [&self.from, &self.to].into_iter().filter_map(|material| material.model().renderer).collect();
        names.dedup();
        names
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
    /// Parameters that the user fixed.
    held: Vec<&'static str>,
}

impl Draft {
    fn new(fixed: Material, names: &[&str], levels: fn(&Range) -> Levels) -> Result<Self, RemapError> {
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
    fn vary(&mut self, name: &str, levels: Levels) -> Result<(), RemapError> {
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

    fn fix(&mut self, name: &str, value: &str) -> Result<(), RemapError> {
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
    fn suit(&mut self, source: &Material) -> Result<(), RemapError> {
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

    /// An anisotropic source has an anisotropic target: searches how much longer the lobe is one way than the other, and the
    /// parameters behind an alias (`roughness_u` and `roughness_v` behind `roughness`) one by one.
    fn follow(&mut self, source: &Draft) -> Result<(), RemapError> {
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
            if needed > range.search.max {
                *axis = widened(&axis.name, range, needed)?;
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

/// The highest reflectance at normal incidence that a side can have, in any channel; `None` where its parameters do not
/// tell.
fn highest_f0(draft: &Draft) -> Result<Option<f64>, RemapError> {
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
    fn what_the_user_fixes_takes_nothing_over() {
        let fix = Assignment { side: Some(Side::Target), name: "diffuse".into(), value: "0.2".into() };
        let plan = plan("ward", "ggx", &Options { fix: vec![fix], ..Options::default() });
        let source = Material::parse("ward:diffuse=0.7").unwrap();
        assert_eq!(plan.target_material(&source, &[1.0, 1.5, 0.2]).unwrap().number("diffuse").unwrap(), 0.2);
    }

    #[test]
    fn layers_metals_and_bodies_are_carried_over() {
        let target = |from: &str, to: &str| {
            let source = Material::parse(from).unwrap();
            let model = |m: &Material| m.model();
            let to = Material::parse(to).unwrap();
            let plan = Plan::new(model(&source), model(&to), &Options::default()).unwrap();
            let values: Vec<f64> = plan.target_axes.iter().map(|a| a.value(a.len() / 2)).collect();
            plan.target_material(&source, &values).unwrap()
        };
        let coated = target("openpbr:coat_weight=0.5,coat_roughness=0.3,base_color=0.2/0.4/0.6", "gltf");
        assert_eq!(
            (coated.number("clearcoat").unwrap(), coated.number("clearcoat_roughness").unwrap()),
            (0.5, 0.3)
        );
        let gold = target("ggx-conductor:conductor=gold", "usd-preview-surface");
        assert_eq!(gold.number("metallic").unwrap(), 1.0);
        assert!(gold.by_role(Role::BaseColour).unwrap().colour().unwrap()[2] < 0.5, "{gold}");
        // Under an interface a body must be brighter to look the same.
        let plastic = target("ggx:diffuse=0.5", "rough-plastic");
        assert!(
            (plastic.diffuse_albedo()[0] - 0.5).abs() < 2e-3 && plastic.canonical().body[0] > 0.51,
            "{plastic}"
        );
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
