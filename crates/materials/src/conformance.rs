//! BRDFs as the conformance vectors describe them: a model name and its parameters in the vectors' own terms.
//!
//! These are not catalogue materials: the vectors use raw widths and every combination of terms.

use serde_json::{Map, Value as Json};

use crate::fresnel::Fresnel;
use crate::{Bsdf, microfacet, registry};

/// Builds the BSDF of a vector; `None` where a variant or a term is not implemented, or a parameter is missing.
pub type Builder = fn(&Parameters) -> Option<Box<dyn Bsdf>>;

/// Builds the BSDF of a vector; `None` where the model, a variant or a term is not implemented, or a parameter is missing.
pub fn bsdf(model: &str, parameters: &Map<String, Json>) -> Option<Box<dyn Bsdf>> {
    // Vectors of bare microfacet lobes combine terms that no model of the catalogue does.
    let bare: (&str, Builder) = ("microfacet", microfacet::vector);
    let mut all = registry().iter().filter_map(|m| m.vectors).chain([bare]);
    let (_, build) = all.find(|(name, _)| *name == model)?;
    build(&Parameters(parameters))
}

/// Typed access to a vector's parameters.
pub struct Parameters<'a>(&'a Map<String, Json>);

impl Parameters<'_> {
    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        self.0.get(name)?.as_f64()
    }

    /// A parameter that may be absent, but not something other than a number.
    pub(crate) fn number_or(&self, name: &str, default: f64) -> Option<f64> {
        self.0.get(name).map_or(Some(default), Json::as_f64)
    }

    /// A colour, or a number for grey.
    pub(crate) fn colour(&self, name: &str) -> Option<[f64; 3]> {
        match self.0.get(name)? {
            Json::Array(channels) if channels.len() == 3 => {
                let channel = |c: usize| channels[c].as_f64();
                Some([channel(0)?, channel(1)?, channel(2)?])
            }
            grey => grey.as_f64().map(|v| [v; 3]),
        }
    }

    /// A yes or no, no where it is absent.
    pub(crate) fn flag(&self, name: &str) -> Option<bool> {
        self.0.get(name).map_or(Some(false), Json::as_bool)
    }

    pub(crate) fn array(&self, name: &str) -> Option<&[Json]> {
        self.0.get(name)?.as_array().map(Vec::as_slice)
    }

    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        self.0.get(name)?.as_str()
    }

    pub(crate) fn fresnel(&self) -> Option<Fresnel> {
        match self.0.get("fresnel").map_or(Some("none"), Json::as_str)? {
            "none" => Some(Fresnel::None),
            "schlick" => Some(Fresnel::Schlick { f0: self.number("f0")? }),
            "dielectric" => Some(Fresnel::Dielectric { eta: self.number("eta")? }),
            "conductor" => Some(Fresnel::Conductor { eta: self.number("eta")?, k: self.number("k")? }),
            _ => None,
        }
    }
}
