//! What a user may choose of a remap.

use lookmatch_materials::{Levels, Material, Model, Trend};
use lookmatch_search::Axis;
use serde::{Deserialize, Serialize};

use crate::RemapError;
use crate::studio::{RendererRecord, Sampling};

/// The search that suits the target.
pub(crate) const AUTO: &str = "auto";

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

/// Which target parameters follow a source parameter in a constrained remap, instead of those with a role that corresponds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pair {
    /// An axis of the source.
    pub source: String,
    /// Axes of the target, those that fall while it rises with a `-` before the name; none where nothing follows it.
    pub targets: Vec<String>,
}

impl Pair {
    /// Places of the axes that follow, and how: as a name says, or else as the roles do, or rising.
    pub(crate) fn followers(
        &self,
        axes: &[Axis],
        trend: impl Fn(usize) -> Option<Trend>,
    ) -> Vec<(usize, Trend)> {
        let follower = |name: &String| {
            let bare = name.strip_prefix('-').unwrap_or(name);
            let place = axes.iter().position(|axis| axis.name == bare)?;
            let falling = name.starts_with('-').then_some(Trend::Falling);
            Some((place, falling.or_else(|| trend(place)).unwrap_or(Trend::Rising)))
        };
        self.targets.iter().filter_map(follower).collect()
    }

    /// Refuses what is no axis.
    pub(crate) fn check(&self, source: &[Axis], target: &[Axis]) -> Result<(), RemapError> {
        let known = |axes: &[Axis]| axes.iter().map(|axis| axis.name.as_str()).collect::<Vec<_>>().join(", ");
        let wrong = |side: &str, name: &str, axes: &[Axis]| {
            let shown = format!("'{name}' in --pair is none of the {side}'s axes ({})", known(axes));
            RemapError::Option(shown)
        };
        let has = |axes: &[Axis], name: &str| axes.iter().any(|axis| axis.name == name);
        if !has(source, &self.source) {
            return Err(wrong("source", &self.source, source));
        }
        let bare = |name: &String| name.strip_prefix('-').unwrap_or(name).to_owned();
        match self.targets.iter().map(bare).find(|name| !has(target, name)) {
            Some(name) => Err(wrong("target", &name, target)),
            None => Ok(()),
        }
    }
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
    /// Which target parameters follow which source parameters, where roles are not to decide.
    pub pairs: Vec<Pair>,
    /// Polish each result between the levels of the lattice.
    pub refine: bool,
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
            pairs: Vec::new(),
            refine: false,
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

    pub(crate) fn material(&self) -> Material {
        match self {
            Self::Model(model) => Material::new(model),
            Self::Named(material) => material.clone(),
        }
    }
}
