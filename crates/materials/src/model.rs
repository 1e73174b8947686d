//! A material model: its description and how to build its BSDF.

use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use crate::conformance::Builder;
use crate::error::nearest;
use crate::material::Value;
use crate::{Bsdf, MaterialError, Parameter};

/// A second name that sets several parameters at once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Alias {
    /// Name on the command line.
    pub name: &'static str,
    /// The parameters that it sets.
    pub parameters: &'static [&'static str],
}

/// A second name that sets several parameters to what a table says of a word: `conductor=gold`.
#[derive(Clone, Copy, Serialize)]
pub struct Named {
    /// Name on the command line.
    pub name: &'static str,
    /// The parameters that it sets.
    pub parameters: &'static [&'static str],
    /// One sentence, with the source of the values.
    pub summary: &'static str,
    /// The words that it knows.
    #[serde(skip)]
    pub words: fn() -> Vec<&'static str>,
    /// The values of a word, in the order of `parameters`.
    #[serde(skip)]
    pub look_up: fn(&str) -> Option<Vec<Value>>,
}

/// A material with a name of its own: `low-abc@chrome`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Preset {
    /// Name after the `@`.
    pub name: String,
    /// Where the values come from, with their licence.
    pub source: &'static str,
    /// Parameters as they would be written: name and value.
    pub values: Vec<(&'static str, String)>,
}

/// Where a model comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Formulas of the literature.
    Classic,
    /// What today's renderers and file formats specify.
    Production,
    /// Measured materials.
    Measured,
    /// Models of other renderers, whose formulas are not known here.
    Foreign,
}

/// Makes a BSDF of values.
pub type Build = fn(&Values) -> Box<dyn Bsdf>;

/// Reads a file of measurements; an error says what is wrong with it.
pub type Load = fn(&Path) -> Result<Arc<dyn Bsdf>, String>;

/// A family of materials.
#[derive(Serialize)]
pub struct Model {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name in tables and reports.
    pub title: &'static str,
    /// One sentence on what it is good for.
    pub summary: &'static str,
    /// Authors, year, equation; name and version of a specification.
    pub reference: &'static str,
    /// Where it comes from.
    pub family: Family,
    /// The renderer that alone can show it; `None` for ours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub renderer: Option<&'static str>,
    /// True where the lobe's reflectance grows towards grazing angles.
    pub has_fresnel: bool,
    /// True where light and viewer may be swapped.
    pub is_reciprocal: bool,
    /// The largest directional albedo of plausible materials, with formulas as they are by default and cos θ_o ≥ 0.03: 1 where
    /// no more light leaves than arrives, as it should be. A test holds it against random materials.
    pub largest_albedo: f64,
    /// Its parameters, in the order in which they are shown.
    pub parameters: &'static [Parameter],
    /// Second names.
    pub aliases: &'static [Alias],
    /// Second names with tables.
    pub named: &'static [Named],
    /// The parameters or aliases that a remap tabulates by default when the model is the source.
    pub surveyed: &'static [&'static str],
    /// The parameters or aliases that a remap searches by default when the model is the target; none where the model can
    /// only be a source.
    pub searched: &'static [&'static str],
    /// The parameters in each of which the BSDF is linear (affine) while all others stay as they are, formulas as they are by
    /// default: pictures at two of its values then tell those at all others. A test holds it against random materials.
    pub linear: &'static [&'static str],
    /// Materials with names of their own.
    #[serde(skip)]
    pub presets: fn() -> &'static [Preset],
    /// Builds the diffuse reflection, for models that have no colour of the body to tell it by: see [`crate::Material::diffuse_bsdf`].
    #[serde(skip)]
    pub diffuse_only: Option<Build>,
    /// What values must fulfil together, beyond the range of each; an error says what is wrong.
    #[serde(skip)]
    pub check: fn(&Values) -> Result<(), String>,
    /// Reads a file of measurements, for models with a parameter of that kind.
    #[serde(skip)]
    pub load: Option<Load>,
    /// What conformance vectors call the model, and how its BSDF is built from their parameters.
    #[serde(skip)]
    pub vectors: Option<(&'static str, Builder)>,
    /// Builds the BSDF of checked values.
    #[serde(skip)]
    pub build: Build,
}

impl Model {
    /// What most models have in common, to be completed: `Model { name: …, build: …, ..Model::BLANK }`.
    pub const BLANK: Self = Self {
        name: "",
        title: "",
        summary: "",
        reference: "",
        family: Family::Classic,
        renderer: None,
        has_fresnel: true,
        is_reciprocal: true,
        largest_albedo: 1.0,
        parameters: &[],
        aliases: &[],
        named: &[],
        surveyed: &[],
        searched: &[],
        linear: &[],
        presets: || &[],
        diffuse_only: None,
        check: |_| Ok(()),
        load: None,
        vectors: None,
        build: |_| Box::new(crate::models::lambert::Lambert { diffuse: [0.0; 3] }),
    };
}

impl Model {
    /// The indices of the parameters that `name` (a parameter or an alias) stands for.
    pub fn resolve(&self, name: &str) -> Result<Vec<usize>, MaterialError> {
        let position = |n: &str| self.parameters.iter().position(|p| p.name == n);
        if let Some(index) = position(name) {
            return Ok(vec![index]);
        }
        let alias = self.aliases.iter().find(|a| a.name == name).map(|a| a.parameters);
        let named = self.named.iter().find(|n| n.name == name).map(|n| n.parameters);
        if let Some(parameters) = alias.or(named) {
            return Ok(parameters.iter().filter_map(|p| position(p)).collect());
        }
        Err(MaterialError::UnknownParameter {
            model: self.name.to_owned(),
            name: name.to_owned(),
            nearest: nearest(name, self.names()),
            known: self.names().collect::<Vec<_>>().join(", "),
        })
    }

    /// The description of a parameter or of the first parameter behind an alias.
    pub fn parameter(&self, name: &str) -> Result<&'static Parameter, MaterialError> {
        self.resolve(name).map(|indices| &self.parameters[indices[0]])
    }

    /// Names of all parameters, then of all aliases and tables.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        let named = self.named.iter().map(|n| n.name);
        self.parameters.iter().map(|p| p.name).chain(self.aliases.iter().map(|a| a.name)).chain(named)
    }

    /// The named material of a model.
    ///
    /// # Errors
    /// [`MaterialError::UnknownPreset`] with the nearest name.
    pub fn preset(&self, name: &str) -> Result<&'static Preset, MaterialError> {
        let presets = (self.presets)();
        presets.iter().find(|p| p.name == name).ok_or_else(|| MaterialError::UnknownPreset {
            model: self.name.to_owned(),
            name: name.to_owned(),
            nearest: nearest(name, presets.iter().map(|p| p.name.as_str())),
            count: presets.len(),
        })
    }
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Model").field(&self.name).finish()
    }
}

/// The values of a material, by parameter name, as a model's `build` reads them.
pub struct Values<'a> {
    pub(crate) model: &'static Model,
    pub(crate) values: &'a [Value],
}

impl Values<'_> {
    fn get(&self, name: &str) -> Option<&Value> {
        self.model.parameters.iter().position(|p| p.name == name).map(|i| &self.values[i])
    }

    /// A number; NaN where the model has no such number, which its own tests catch.
    pub fn number(&self, name: &str) -> f64 {
        match self.get(name) {
            Some(Value::Number(v)) => *v,
            _ => f64::NAN,
        }
    }

    /// The numbers of a list; empty where the model has no such list, which its own tests catch.
    pub fn list(&self, name: &str) -> &[f64] {
        match self.get(name) {
            Some(Value::List(v)) => v,
            _ => &[],
        }
    }

    /// What was read from a file; `None` where no file was given.
    pub fn file(&self, name: &str) -> Option<Arc<dyn Bsdf>> {
        match self.get(name) {
            Some(Value::File(file)) => file.bsdf.clone(),
            _ => None,
        }
    }

    /// A colour; NaN where the model has no such colour, which its own tests catch.
    pub fn colour(&self, name: &str) -> [f64; 3] {
        match self.get(name) {
            Some(Value::Colour(v)) => *v,
            _ => [f64::NAN; 3],
        }
    }

    /// The name of a choice; empty where the model has no such choice.
    pub fn choice(&self, name: &str) -> &'static str {
        match self.get(name) {
            Some(Value::Choice(v)) => v,
            _ => "",
        }
    }
}
