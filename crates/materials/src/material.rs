//! A model with a value for each parameter, as text, as JSON, and as a BSDF.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Map, Value as Json};

use crate::colour::mean;
use crate::error::nearest;
use crate::model::Named;
use crate::{Bsdf, Kind, MaterialError, Model, Role, Values, by_name};

/// The value of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// One number.
    Number(f64),
    /// Linear RGB.
    Colour([f64; 3]),
    /// A number for each lobe.
    List(Arc<[f64]>),
    /// The name of a formula.
    Choice(&'static str),
    /// A file of measurements.
    File(MeasuredFile),
}

impl Value {
    /// The number, the first of a list, or the mean of a colour; `None` for a choice or a file.
    pub fn mean(&self) -> Option<f64> {
        match self {
            Self::Number(v) => Some(*v),
            Self::List(v) => v.first().copied(),
            Self::Colour(c) => Some(mean(*c)),
            Self::Choice(_) | Self::File(_) => None,
        }
    }

    /// A colour, or a number as grey; `None` for a choice or a file.
    pub fn colour(&self) -> Option<[f64; 3]> {
        match self {
            Self::Colour(c) => Some(*c),
            other => other.mean().map(|v| [v; 3]),
        }
    }

    /// The number, the channels of a colour, or all of a list; empty for a choice or a file.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Number(v) => vec![*v],
            Self::Colour(c) => c.to_vec(),
            Self::List(v) => v.to_vec(),
            Self::Choice(_) | Self::File(_) => Vec::new(),
        }
    }

    /// What the value consists of, as numbers that tell it from all others of its parameter.
    pub fn bits(&self) -> Vec<u64> {
        let text = |text: &str| text.bytes().map(u64::from).collect();
        match self {
            Self::Number(v) => vec![v.to_bits()],
            Self::Colour(c) => c.map(f64::to_bits).to_vec(),
            Self::List(v) => v.iter().map(|v| v.to_bits()).collect(),
            Self::Choice(name) => text(name),
            Self::File(file) => text(&file.path),
        }
    }
}

/// A file of measurements and what was read from it.
#[derive(Clone)]
pub struct MeasuredFile {
    /// The file, as it was given; empty where none was.
    pub path: Arc<str>,
    /// Its material; `None` where no file was given.
    pub(crate) bsdf: Option<Arc<dyn Bsdf>>,
}

impl PartialEq for MeasuredFile {
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path
    }
}

impl std::fmt::Debug for MeasuredFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.path.fmt(f)
    }
}

/// A material: a model and the values of all its parameters, each within its range.
#[derive(Clone, Debug)]
pub struct Material {
    model: &'static Model,
    values: Vec<Value>,
}

impl PartialEq for Material {
    fn eq(&self, other: &Self) -> bool {
        self.model.name == other.model.name && self.values == other.values
    }
}

impl Material {
    /// The model with every parameter at its default.
    pub fn new(model: &'static Model) -> Self {
        let default = |kind: &Kind| match kind {
            Kind::Number { default, .. } => Value::Number(*default),
            Kind::Colour { default, .. } => Value::Colour(*default),
            Kind::List { default, .. } => Value::List((*default).into()),
            Kind::Choice { options } => Value::Choice(options[0]),
            Kind::File { .. } => Value::File(MeasuredFile { path: "".into(), bsdf: None }),
        };
        Self { model, values: model.parameters.iter().map(|p| default(&p.kind)).collect() }
    }

    /// Reads `MODEL[@PRESET][:NAME=VALUE,…]` or a JSON object with a `model` field. Parameters that are not named keep the
    /// preset's values or their defaults; a colour is `0.1/0.3/0.1` (JSON: an array) or one number for grey.
    pub fn parse(text: &str) -> Result<Self, MaterialError> {
        let text = text.trim();
        if text.starts_with('{') {
            let json = serde_json::from_str(text).map_err(|e| syntax(text, e.to_string()))?;
            return Self::from_json(&json);
        }
        let (name, list) = split_name(text);
        let mut assignment = Assignment::new(Self::named(name)?);
        for item in list.split(',').map(str::trim).filter(|item| !item.is_empty()) {
            let (name, value) =
                item.split_once('=').ok_or_else(|| syntax(text, format!("'{item}' is not NAME=VALUE")))?;
            assignment.set(name.trim(), value.trim())?;
        }
        assignment.material.checked()
    }

    /// The material that `MODEL` or `MODEL@PRESET` stands for; files of measurements may still be missing.
    pub fn named(text: &str) -> Result<Self, MaterialError> {
        let (model, preset) = match text.split_once('@') {
            Some((model, preset)) => (by_name(model)?, Some(preset)),
            None => (by_name(text)?, None),
        };
        let mut material = Self::new(model);
        for (name, value) in preset.map(|p| model.preset(p)).transpose()?.iter().flat_map(|p| &p.values) {
            material.set(name, value)?;
        }
        Ok(material)
    }

    /// The material, once its values are known to go together.
    ///
    /// # Errors
    /// [`MaterialError::NoFile`] and [`MaterialError::Inconsistent`].
    pub fn checked(self) -> Result<Self, MaterialError> {
        for (parameter, value) in self.model.parameters.iter().zip(&self.values) {
            if let (Kind::File { content }, Value::File(MeasuredFile { bsdf: None, .. })) =
                (parameter.kind, value)
            {
                let (model, name) = (self.model.name.to_owned(), parameter.name.to_owned());
                return Err(MaterialError::NoFile { model, name, content: content.to_owned() });
            }
        }
        let together = (self.model.check)(&self.as_values());
        let model = || self.model.name.to_owned();
        together.map_err(|reason| MaterialError::Inconsistent { model: model(), reason })?;
        Ok(self)
    }

    /// Reads `{"model": "ward", "diffuse": [0.1, 0.3, 0.1], "roughness": 0.2}`.
    pub fn from_json(json: &Json) -> Result<Self, MaterialError> {
        let text = || json.to_string();
        let object = json.as_object().ok_or_else(|| syntax(&text(), "not a JSON object".into()))?;
        let name = object
            .get("model")
            .and_then(Json::as_str)
            .ok_or_else(|| syntax(&text(), "the field 'model' is missing".into()))?;
        let mut assignment = Assignment::new(Self::named(name)?);
        for (name, value) in object.iter().filter(|(name, _)| *name != "model") {
            let value = match value {
                Json::String(s) => s.clone(),
                Json::Array(a) => a.iter().map(Json::to_string).collect::<Vec<_>>().join("/"),
                other => other.to_string(),
            };
            assignment.set(name, &value)?;
        }
        assignment.material.checked()
    }

    /// The JSON form, every parameter named.
    pub fn to_json(&self) -> Json {
        let mut object = Map::new();
        object.insert("model".into(), self.model.name.into());
        for (parameter, value) in self.model.parameters.iter().zip(&self.values) {
            let json = match value {
                Value::Number(v) => Json::from(*v),
                Value::Colour(c) => Json::from(c.to_vec()),
                Value::List(v) => Json::from(v.to_vec()),
                Value::Choice(name) => Json::from(*name),
                Value::File(file) => Json::from(&*file.path),
            };
            object.insert(parameter.name.into(), json);
        }
        Json::Object(object)
    }

    /// Its model.
    pub fn model(&self) -> &'static Model {
        self.model
    }

    /// Its values, in the order of the model's parameters.
    pub fn values(&self) -> &[Value] {
        &self.values
    }

    /// Sets a parameter (or all behind an alias) to a value written as text.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), MaterialError> {
        let indices = self.model.resolve(name)?;
        if let Some(named) = self.model.named.iter().find(|n| n.name == name) {
            let values = (named.look_up)(text).ok_or_else(|| unknown_word(self.model, named, text))?;
            return indices
                .into_iter()
                .zip(values)
                .try_for_each(|(index, value)| self.set_value(index, value));
        }
        for index in indices {
            self.values[index] = self.check(index, parse_value(self.model, index, text)?)?;
        }
        Ok(())
    }

    /// Sets a parameter (or all behind an alias) to a number; a colour becomes grey, a list gets one lobe.
    pub fn set_number(&mut self, name: &str, value: f64) -> Result<(), MaterialError> {
        for index in self.model.resolve(name)? {
            let parsed = match self.model.parameters[index].kind {
                Kind::Number { .. } => Value::Number(value),
                Kind::Colour { .. } => Value::Colour([value; 3]),
                Kind::List { .. } => Value::List([value].into()),
                Kind::Choice { .. } | Kind::File { .. } => {
                    return Err(bad_value(self.model, index, &value.to_string()));
                }
            };
            self.values[index] = self.check(index, parsed)?;
        }
        Ok(())
    }

    /// Sets the parameter at `index` in the model's list to a value of its kind.
    pub fn set_value(&mut self, index: usize, value: Value) -> Result<(), MaterialError> {
        self.values[index] = self.check(index, value)?;
        Ok(())
    }

    /// The number behind a name: the first channel of a colour, the first of a list, the first parameter of an alias.
    pub fn number(&self, name: &str) -> Result<f64, MaterialError> {
        let index = self.model.resolve(name)?[0];
        match &self.values[index] {
            Value::Number(v) => Ok(*v),
            Value::Colour(c) => Ok(c[0]),
            Value::List(v) if !v.is_empty() => Ok(v[0]),
            other => Err(bad_value(self.model, index, &show(other, None))),
        }
    }

    /// The value of the first parameter with a role.
    pub fn by_role(&self, role: Role) -> Option<Value> {
        self.model.parameters.iter().position(|p| p.role == role).map(|i| self.values[i].clone())
    }

    /// Builds its BSDF.
    pub fn bsdf(&self) -> Box<dyn Bsdf> {
        (self.model.build)(&self.as_values())
    }

    pub(crate) fn as_values(&self) -> Values<'_> {
        Values { model: self.model, values: &self.values }
    }

    /// Replaces a value by one that is known to be of its kind and within its range.
    pub(crate) fn replace(&mut self, index: usize, value: Value) {
        self.values[index] = value;
    }

    fn check(&self, index: usize, value: Value) -> Result<Value, MaterialError> {
        let parameter = &self.model.parameters[index];
        let numbers: &[f64] = match &value {
            Value::Number(v) => std::slice::from_ref(v),
            Value::Colour(c) => c,
            Value::List(v) => v,
            Value::Choice(_) | Value::File(_) => &[],
        };
        match parameter.range() {
            Some(range) if !numbers.iter().all(|v| range.valid.contains(*v)) => {
                Err(MaterialError::OutOfRange {
                    model: self.model.name.into(),
                    name: parameter.name.into(),
                    value: show(&value, None),
                    range: range.valid.to_string(),
                })
            }
            _ => Ok(value),
        }
    }
}

/// The text that [`Material::parse`] reads. A precision rounds numbers to that many significant digits, for people: `{:.4}`.
impl std::fmt::Display for Material {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.model.name)?;
        for (k, (parameter, value)) in self.model.parameters.iter().zip(&self.values).enumerate() {
            write!(f, "{}{}={}", if k == 0 { ':' } else { ',' }, parameter.name, show(value, f.precision()))?;
        }
        Ok(())
    }
}

impl serde::Serialize for Material {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}

impl<'de> serde::Deserialize<'de> for Material {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let json = Json::deserialize(deserializer)?;
        Self::from_json(&json).map_err(serde::de::Error::custom)
    }
}

/// Splits `MODEL:NAME=VALUE,…` into the model's name, which may have a colon of its own (`mitsuba:roughplastic`), and the list.
pub fn split_name(text: &str) -> (&str, &str) {
    let head = text.split('=').next().unwrap_or(text);
    let (name, list) = match head.rfind(':') {
        Some(colon) if head.len() < text.len() => (&text[..colon], &text[colon + 1..]),
        // Without values: what follows a model of ours is meant to be some, and is refused as such.
        _ => match text.split_once(':') {
            Some((name, list)) if by_name(name).is_ok() || list.is_empty() => (name, list),
            _ => (text, ""),
        },
    };
    (name.trim(), list)
}

/// A material being written down, with the parameters that were named so far.
struct Assignment {
    material: Material,
    named: Vec<usize>,
}

impl Assignment {
    fn new(material: Material) -> Self {
        Self { material, named: Vec::new() }
    }

    fn set(&mut self, name: &str, text: &str) -> Result<(), MaterialError> {
        let model = self.material.model;
        let indices = model.resolve(name)?;
        if indices.iter().any(|i| self.named.contains(i)) {
            return Err(MaterialError::Repeated { model: model.name.into(), name: name.into() });
        }
        self.named.extend(indices);
        self.material.set(name, text)
    }
}

fn parse_value(model: &'static Model, index: usize, text: &str) -> Result<Value, MaterialError> {
    let numbers = || text.split('/').map(|part| part.trim().parse::<f64>().ok()).collect::<Option<Vec<_>>>();
    let parsed = match &model.parameters[index].kind {
        Kind::Number { .. } => match numbers().as_deref() {
            Some([v]) => Some(Value::Number(*v)),
            _ => None,
        },
        Kind::Colour { .. } => match numbers().as_deref() {
            Some([v]) => Some(Value::Colour([*v; 3])),
            Some([r, g, b]) => Some(Value::Colour([*r, *g, *b])),
            _ => None,
        },
        Kind::List { .. } => numbers().map(|v| Value::List(v.into())),
        Kind::Choice { options } => options.iter().find(|o| **o == text).map(|o| Value::Choice(o)),
        Kind::File { .. } => return load(model, index, text),
    };
    parsed.ok_or_else(|| bad_value(model, index, text))
}

/// Reads a file of measurements.
fn load(model: &'static Model, index: usize, path: &str) -> Result<Value, MaterialError> {
    let loaded = match model.load {
        Some(load) => load(Path::new(path)),
        None => Err("the model reads no files".to_owned()),
    };
    let bsdf = loaded.map_err(|reason| MaterialError::BadFile {
        model: model.name.to_owned(),
        name: model.parameters[index].name.to_owned(),
        path: path.to_owned(),
        reason,
    })?;
    Ok(Value::File(MeasuredFile { path: path.into(), bsdf: Some(bsdf) }))
}

fn unknown_word(model: &Model, named: &Named, word: &str) -> MaterialError {
    let words = (named.words)();
    let hint =
        nearest(word, words.iter().copied()).map(|n| format!(" (did you mean '{n}'?)")).unwrap_or_default();
    let (model, name) = (model.name.to_owned(), named.name.to_owned());
    let expected = format!("one of {}{hint}", words.join(", "));
    MaterialError::BadValue { model, name, value: word.to_owned(), expected }
}

fn bad_value(model: &'static Model, index: usize, value: &str) -> MaterialError {
    let parameter = &model.parameters[index];
    let expected = match &parameter.kind {
        Kind::Number { range, .. } => format!("a number in {}", range.valid),
        Kind::Colour { range, .. } => format!("a number or R/G/B, each in {}", range.valid),
        Kind::List { range, .. } => format!("a number for each lobe, A/B/..., each in {}", range.valid),
        Kind::Choice { options } => {
            let hint = nearest(value, options.iter().copied());
            let hint = hint.map(|n| format!(" (did you mean '{n}'?)")).unwrap_or_default();
            format!("one of {}{hint}", options.join(", "))
        }
        Kind::File { content } => content.to_string(),
    };
    let (model, name) = (model.name.to_owned(), parameter.name.to_owned());
    MaterialError::BadValue { model, name, value: value.to_owned(), expected }
}

fn syntax(text: &str, reason: String) -> MaterialError {
    MaterialError::Syntax { text: text.to_owned(), reason }
}

fn show(value: &Value, digits: Option<usize>) -> String {
    let number = |v: &f64| match digits {
        Some(digits) => {
            format!("{v:.0$e}", digits.saturating_sub(1)).parse::<f64>().unwrap_or(*v).to_string()
        }
        None => v.to_string(),
    };
    match value {
        Value::Number(v) => number(v),
        Value::Colour([r, g, b]) if r == g && g == b => number(r),
        Value::Colour(v) => v.iter().map(number).collect::<Vec<_>>().join("/"),
        Value::List(v) => v.iter().map(number).collect::<Vec<_>>().join("/"),
        Value::Choice(name) => (*name).to_owned(),
        Value::File(file) => file.path.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry;

    #[test]
    fn text_and_json_are_the_same_material() {
        let text = Material::parse("ward:diffuse=0.1/0.3/0.1,specular=0.1,roughness=0.2").unwrap();
        let json =
            Material::parse(r#"{"model":"ward","diffuse":[0.1,0.3,0.1],"specular":0.1,"roughness":0.2}"#)
                .unwrap();
        assert_eq!(text, json);
        assert_eq!(text.number("roughness_v").unwrap(), 0.2);
    }

    #[test]
    fn every_model_survives_a_round_trip() {
        for model in registry().iter().filter(|m| m.load.is_none()) {
            let material = Material::new(model);
            assert_eq!(Material::parse(&material.to_string()).unwrap(), material);
            assert_eq!(Material::from_json(&material.to_json()).unwrap(), material);
            assert!(material.values().iter().enumerate().all(|(i, v)| material.check(i, v.clone()).is_ok()));
        }
    }

    #[test]
    fn a_precision_is_a_number_of_significant_digits() {
        let material = Material::parse("ward:specular=0.16000000000000003,diffuse=0.123456/0.5/1").unwrap();
        let text = format!("{material:.4}");
        assert!(text.contains("diffuse=0.1235/0.5/1") && text.contains("specular=0.16,"), "{text}");
    }

    #[test]
    fn errors_name_what_would_be_accepted() {
        let message = |text: &str| Material::parse(text).unwrap_err().to_string();
        assert!(message("wrad:specular=0.1").contains("did you mean 'ward'?"));
        assert!(message("ward:roughnes=0.1").contains("did you mean 'roughness'?"));
        assert!(message("ward:specular=2").contains("outside its range [0, 1]"));
        assert!(message("ward:specular=NaN").contains("outside its range"));
        assert!(message("ward:specular=much").contains("a number or R/G/B"));
        assert!(message("ward:variant=gmb").contains("one of gmd, duer, ward"));
        assert!(message("ward:roughness=0.1,roughness_u=0.2").contains("given twice"));
        assert!(message("ward:roughness").contains("not NAME=VALUE"));
        assert!(message("").contains("unknown material model ''"));
        assert!(message("{\"model\":").contains("cannot read material"));
    }
}
