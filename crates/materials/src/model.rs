//! A material model: its description and how to build its BSDF.

use serde::Serialize;

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

/// A family of materials.
#[derive(Serialize)]
pub struct Model {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name in tables and reports.
    pub title: &'static str,
    /// One sentence on what it is good for.
    pub summary: &'static str,
    /// Authors, year, equation.
    pub reference: &'static str,
    /// True where the lobe's reflectance grows towards grazing angles.
    pub has_fresnel: bool,
    /// True where light and viewer may be swapped.
    pub is_reciprocal: bool,
    /// True where no more light leaves than arrives, for every valid set of parameters.
    pub conserves_energy: bool,
    /// Its parameters, in the order in which they are shown.
    pub parameters: &'static [Parameter],
    /// Second names.
    pub aliases: &'static [Alias],
    /// The parameters or aliases that a remap tabulates by default when the model is the source.
    pub surveyed: &'static [&'static str],
    /// The parameters or aliases that a remap searches by default when the model is the target.
    pub searched: &'static [&'static str],
    /// Builds the BSDF of checked values.
    #[serde(skip)]
    pub build: fn(&Values) -> Box<dyn Bsdf>,
}

impl Model {
    /// The indices of the parameters that `name` (a parameter or an alias) stands for.
    pub fn resolve(&self, name: &str) -> Result<Vec<usize>, MaterialError> {
        let position = |n: &str| self.parameters.iter().position(|p| p.name == n);
        if let Some(index) = position(name) {
            return Ok(vec![index]);
        }
        if let Some(alias) = self.aliases.iter().find(|a| a.name == name) {
            return Ok(alias.parameters.iter().filter_map(|p| position(p)).collect());
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

    /// Names of all parameters, then of all aliases.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.parameters.iter().map(|p| p.name).chain(self.aliases.iter().map(|a| a.name))
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
