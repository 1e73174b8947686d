//! What a remap does, in full: models, lattices, scene, metric, strategy, search and seed.

use lookmatch_imaging::Fitness;
use lookmatch_materials::{Material, Model};
use lookmatch_rendering::Scene;
use lookmatch_search::Axis;
use serde::{Deserialize, Serialize};

use crate::RemapError;
use crate::carry::{Body, SourceLook, carry_over};
use crate::draft::{Draft, highest_f0, pick, thinned};
use crate::options::{AUTO, Endpoint, Options, Pair, Preset, Side, Strategy};
use crate::studio::{RendererRecord, Sampling};

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
    /// Which target parameters follow which source parameters, where roles do not decide.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<Pair>,
    /// True where results are polished between the levels of the lattice.
    #[serde(default)]
    pub refine: bool,
    /// Samples of the pictures of other renderers, where there are some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Sampling>,
    /// Those renderers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub renderers: Vec<RendererRecord>,
}

/// Sides of the reference pictures that can be compared: smaller ones show no highlight.
const SIZES: std::ops::RangeInclusive<usize> = 16..=2048;

/// The brightest reflectance at normal incidence that pictures are expected to show: that of silver is 0.97.
const PICTURED_F0: f64 = 0.9;

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
        Self::drafted(from, to, options, false)
    }

    /// The match of pictures: the source stands for what they show, the body's colour aside, and the target's ranges are wide
    /// enough for metals, since no parameters tell how bright the highlights can be. A target that is a metal is searched for its
    /// brightness.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn from_pictures(to: Endpoint, scene: Scene, options: &Options) -> Result<Self, RemapError> {
        let from = Endpoint::Named(Material::parse("lambert")?);
        let plan = Self::drafted(from, to, options, true)?;
        let scene = scene.for_model(plan.to.model());
        Ok(Self { scene, strategy: Strategy::Unconstrained, ..plan })
    }

    fn drafted(
        from: Endpoint,
        to: Endpoint,
        options: &Options,
        is_pictured: bool,
    ) -> Result<Self, RemapError> {
        let search = match (options.search.as_str(), to.model().renderer) {
            (AUTO, None) => "genetic",
            (AUTO, Some(_)) => "survey",
            (name, _) => name,
        };
        lookmatch_search::by_name(search).map_err(|e| RemapError::Option(e.to_string()))?;
        let surveyed = if let Endpoint::Model(model) = from { model.surveyed } else { &[] };
        let mut source = Draft::new(from.material(), surveyed, |r| r.survey)?;
        let mut target = Draft::new(to.material(), to.model().searched, |r| r.search)?;
        let is_named = matches!(to, Endpoint::Named(_));
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
        if is_pictured {
            target.suit_pictures(is_named)?;
        }
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
            target.widen(if is_pictured { Some(PICTURED_F0) } else { highest_f0(&source)? })?;
        }
        if options.quick {
            source.axes.iter_mut().for_each(|axis| *axis = thinned(axis));
        }
        options.pairs.iter().try_for_each(|pair| pair.check(&source.axes, &target.axes))?;
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
            pairs: options.pairs.clone(),
            refine: options.refine,
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

#[cfg(test)]
mod tests {
    use super::*;
    use lookmatch_materials::{Levels, Role, by_name};

    use crate::options::{Assignment, Vary};

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
