//! Models of other renderers: described by them (`docs/renderer-protocol.md`), and known by what they say of their
//! parameters alone. What their formulas are, nobody here knows.

use std::sync::{PoisonError, RwLock};

use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

use crate::{Family, Interval, Kind, Levels, MaterialError, Model, Parameter, Range, Role, Scale};

/// A model as another renderer describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// Name within the renderer.
    pub name: String,
    /// Name in tables and reports.
    #[serde(default)]
    pub title: String,
    /// One sentence.
    #[serde(default)]
    pub summary: String,
    /// What it implements.
    #[serde(default)]
    pub reference: String,
    /// Whether its reflectance grows towards grazing angles.
    #[serde(default = "yes")]
    pub has_fresnel: bool,
    /// Its parameters.
    pub parameters: Vec<ParameterDescription>,
    /// What a remap tabulates.
    pub surveyed: Vec<String>,
    /// What a remap searches.
    pub searched: Vec<String>,
    /// In what pictures are linear, as [`Model::linear`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub linear: Vec<String>,
}

/// A parameter as another renderer describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterDescription {
    name: String,
    role: Role,
    #[serde(default)]
    symbol: String,
    #[serde(default)]
    unit: String,
    #[serde(default)]
    summary: String,
    kind: KindName,
    default: Json,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    options: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    valid: Option<Interval>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    search: Option<Levels>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    survey: Option<Levels>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum KindName {
    Number,
    Colour,
    Choice,
}

fn yes() -> bool {
    true
}

/// Models that were described so far, with their descriptions. They live as long as the program, as ours do.
static ADOPTED: RwLock<Vec<(&Model, Description)>> = RwLock::new(Vec::new());

/// The model of another renderer, `RENDERER:MODEL`, if it was described.
pub(crate) fn adopted(name: &str) -> Option<&'static Model> {
    // A panic elsewhere leaves nothing half-written in this list.
    let known = ADOPTED.read().unwrap_or_else(PoisonError::into_inner);
    // The latest description counts: an update of the renderer may have changed it.
    known.iter().rev().find(|(model, _)| model.name == name).map(|(model, _)| *model)
}

/// Names of the models of a renderer that were described.
pub(crate) fn names_of(renderer: &str) -> Vec<&'static str> {
    let known = ADOPTED.read().unwrap_or_else(PoisonError::into_inner);
    known.iter().filter(|(model, _)| model.renderer == Some(renderer)).map(|(model, _)| model.name).collect()
}

impl Description {
    /// Makes it a model that is known by the name `RENDERER:MODEL` from now on.
    ///
    /// # Errors
    /// [`MaterialError::BadDescription`] where it contradicts itself.
    pub fn adopt(&self, renderer: &str) -> Result<&'static Model, MaterialError> {
        let name = format!("{renderer}:{}", self.name);
        let mut known = ADOPTED.write().unwrap_or_else(PoisonError::into_inner);
        if let Some((model, _)) = known.iter().rev().find(|(model, _)| model.name == name)
            && known.iter().any(|(other, description)| std::ptr::eq(*other, *model) && description == self)
        {
            return Ok(model);
        }
        let wrong = |reason: String| MaterialError::BadDescription { model: name.clone(), reason };
        let model = self.checked(renderer, &name).map_err(wrong)?;
        known.push((model, self.clone()));
        Ok(model)
    }

    fn checked(&self, renderer: &str, name: &str) -> Result<&'static Model, String> {
        let parameters = self.parameters.iter().map(ParameterDescription::checked);
        let parameters: Vec<Parameter> = parameters.collect::<Result<_, String>>()?;
        let bodies = parameters.iter().filter(|p| p.role.is_body()).count();
        if bodies > 1 {
            return Err(format!("{bodies} parameters have the role of the body's colour; one may"));
        }
        for (k, parameter) in parameters.iter().enumerate() {
            if parameters[..k].iter().any(|other| other.name == parameter.name) {
                return Err(format!("parameter '{}' is described twice", parameter.name));
            }
        }
        for named in self.surveyed.iter().chain(&self.searched).chain(&self.linear) {
            let found = parameters.iter().find(|p| p.name == named);
            if found.is_none_or(|p| p.range().is_none()) {
                return Err(format!(
                    "'{named}', to be surveyed, searched or linear, is no number or colour of it"
                ));
            }
        }
        let texts =
            |list: &[String]| -> &'static [&'static str] { leaked(list.iter().map(|t| text(t)).collect()) };
        Ok(Box::leak(Box::new(Model {
            name: text(name),
            title: text(if self.title.is_empty() { name } else { &self.title }),
            summary: text(&self.summary),
            reference: text(&self.reference),
            family: Family::Foreign,
            renderer: Some(text(renderer)),
            has_fresnel: self.has_fresnel,
            parameters: leaked(parameters),
            surveyed: texts(&self.surveyed),
            searched: texts(&self.searched),
            linear: texts(&self.linear),
            ..Model::BLANK
        })))
    }
}

impl ParameterDescription {
    fn checked(&self) -> Result<Parameter, String> {
        let wrong = |what: &str| format!("parameter '{}': {what}", self.name);
        let kind = match self.kind {
            KindName::Choice => {
                if self.options.first().is_none_or(|first| self.default.as_str() != Some(first)) {
                    return Err(wrong("a choice has options, the default first"));
                }
                Kind::Choice { options: leaked(self.options.iter().map(|o| text(o)).collect()) }
            }
            KindName::Number => {
                let default = self.default.as_f64().ok_or_else(|| wrong("the default is no number"))?;
                Kind::Number { range: self.range(&[default])?, default }
            }
            KindName::Colour => {
                let default = serde_json::from_value::<[f64; 3]>(self.default.clone());
                let default = default.map_err(|_| wrong("the default of a colour is three numbers"))?;
                Kind::Colour { range: self.range(&default)?, default }
            }
        };
        let unit = if self.unit.is_empty() { "1" } else { &self.unit };
        Ok(Parameter {
            name: text(&self.name),
            symbol: text(&self.symbol),
            role: self.role,
            unit: text(unit),
            summary: text(&self.summary),
            kind,
        })
    }

    fn range(&self, default: &[f64]) -> Result<Range, String> {
        let wrong = |what: &str| format!("parameter '{}': {what}", self.name);
        let valid = self.valid.ok_or_else(|| wrong("'valid' is missing"))?;
        if !(valid.min < valid.max && valid.min.is_finite() && valid.max.is_finite()) {
            return Err(wrong("'valid' is no interval"));
        }
        if !default.iter().all(|v| valid.contains(*v)) {
            return Err(wrong("the default lies outside of 'valid'"));
        }
        let steps = |given: Option<Levels>, count: f64| {
            let step = (valid.max - valid.min) / count;
            let min = if valid.open { valid.min + step } else { valid.min };
            let levels = given.unwrap_or(Levels::new(min, valid.max, step));
            let sound = levels.step > 0.0 && levels.min <= levels.max;
            if !sound || ![levels.min, levels.max].iter().all(|v| valid.contains(*v)) {
                return Err(wrong("its levels do not lie within 'valid'"));
            }
            Ok(levels)
        };
        let (search, survey) = (steps(self.search, 50.0)?, steps(self.survey, 20.0)?);
        let plausible = Interval::closed(search.min, search.max);
        Ok(Range { valid, plausible, scale: Scale::Linear, search, survey })
    }
}

fn text(text: &str) -> &'static str {
    String::from(text).leak()
}

fn leaked<T>(list: Vec<T>) -> &'static [T] {
    list.leak()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;
    use serde_json::json;

    fn described(parameters: Json, searched: &[&str]) -> Result<&'static Model, MaterialError> {
        let description = json!({
            "name": "plastic", "parameters": parameters, "surveyed": [], "searched": searched
        });
        serde_json::from_value::<Description>(description).unwrap().adopt("elsewhere")
    }

    #[test]
    fn an_adopted_model_is_written_like_any_other() {
        let alpha = json!({"name": "alpha", "role": "roughness", "kind": "number", "default": 0.1,
            "valid": {"min": 0.0, "max": 1.0, "open": true}});
        let colour = json!({"name": "color", "role": "base-colour", "kind": "colour", "default": [0.5, 0.5, 0.5],
            "valid": {"min": 0.0, "max": 1.0}});
        let shape = json!({"name": "distribution", "role": "variant", "kind": "choice", "default": "ggx",
            "options": ["ggx", "beckmann"]});
        let model = described(json!([alpha, colour, shape]), &["alpha"]).unwrap();
        assert_eq!(model.renderer, Some("elsewhere"));
        let written = "elsewhere:plastic:alpha=0.3,color=0.1/0.2/0.3,distribution=beckmann";
        let material = Material::parse(written).unwrap();
        assert_eq!(material.to_string(), written);
        assert_eq!(Material::from_json(&material.to_json()).unwrap(), material);
        assert_eq!(Material::parse("elsewhere:plastic").unwrap().number("alpha").unwrap(), 0.1);
        let error = Material::parse("elsewhere:plastic:alpha=0").unwrap_err().to_string();
        assert!(error.contains("elsewhere:plastic") && error.contains("]0, 1]"), "{error}");
        let unknown = Material::parse("elsewhere:plastik:alpha=0.1").unwrap_err().to_string();
        assert!(unknown.contains("did you mean 'elsewhere:plastic'"), "{unknown}");
    }

    #[test]
    fn descriptions_that_contradict_themselves_are_refused() {
        let alpha = |more: Json| {
            let mut alpha = json!({"name": "alpha", "role": "roughness", "kind": "number", "default": 0.1,
                "valid": {"min": 0.0, "max": 1.0}});
            alpha.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
            alpha
        };
        let refused = |parameters: Json, searched: &[&str], why: &str| {
            let error = described(parameters, searched).unwrap_err().to_string();
            assert!(error.contains("elsewhere:plastic") && error.contains(why), "{error}");
        };
        refused(json!([alpha(json!({"default": 2.0}))]), &[], "default lies outside");
        refused(json!([alpha(json!({"default": "x"}))]), &[], "no number");
        refused(json!([alpha(json!({"valid": {"min": 1.0, "max": 0.0}}))]), &[], "no interval");
        refused(json!([alpha(json!({"search": {"min": 0.0, "max": 3.0, "step": 0.1}}))]), &[], "levels");
        refused(json!([alpha(json!({})), alpha(json!({}))]), &[], "twice");
        refused(json!([alpha(json!({}))]), &["beta"], "'beta'");
    }
}
