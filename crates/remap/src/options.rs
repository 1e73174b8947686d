//! What a user may choose of a remap.

use lookmatch_materials::{Levels, Material, Model};
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

    pub(crate) fn material(&self) -> Material {
        match self {
            Self::Model(model) => Material::new(model),
            Self::Named(material) => material.clone(),
        }
    }
}
