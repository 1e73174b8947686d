//! BRDFs as the conformance vectors describe them: a model name and its parameters in the vectors' own terms.
//!
//! These are not catalogue materials: the vectors use raw widths and every combination of terms.

use serde_json::{Map, Value as Json};

use crate::Bsdf;
use crate::fresnel::Fresnel;
use crate::microfacet;
use crate::models::{kulla_conty, lambert, openpbr, standard_surface, ward};

/// Builds the BSDF of a vector; `None` where a variant or a term is not implemented, or a parameter is missing.
type Builder = fn(&Parameters) -> Option<Box<dyn Bsdf>>;

/// The models that vectors know.
const BUILDERS: &[(&str, Builder)] = &[
    ("lambert", lambert::vector),
    ("ward", ward::vector),
    ("microfacet", microfacet::vector),
    ("kulla_conty", kulla_conty::vector),
    ("openpbr", openpbr::vector),
    ("standard_surface", standard_surface::vector),
];

/// Builds the BSDF of a vector; `None` where the model, a variant or a term is not implemented, or a parameter is missing.
pub fn bsdf(model: &str, parameters: &Map<String, Json>) -> Option<Box<dyn Bsdf>> {
    let (_, build) = BUILDERS.iter().find(|(name, _)| *name == model)?;
    build(&Parameters(parameters))
}

/// Typed access to a vector's parameters.
pub(crate) struct Parameters<'a>(&'a Map<String, Json>);

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
