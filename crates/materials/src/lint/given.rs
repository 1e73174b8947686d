//! A material as it was written, with values that the model would refuse.

use serde_json::Value as Json;

use crate::{Kind, Material, MaterialError, Model, Parameter};

/// A material to be judged: what was written, and what of it the model accepts.
#[derive(Clone, Debug)]
pub struct Given {
    /// `MODEL` or `MODEL@PRESET`.
    base: String,
    /// What was written, the preset's values first.
    pub items: Vec<Item>,
    /// The model with what it accepts of that; the rest are defaults.
    pub material: Material,
}

/// A value as it was written.
#[derive(Clone, Debug)]
pub struct Item {
    /// The parameter or alias.
    pub name: String,
    /// The value.
    pub text: String,
    /// The parameter; the first behind an alias.
    pub parameter: &'static Parameter,
    /// Its numbers: one, or one for each channel or lobe; none for words.
    pub numbers: Vec<f64>,
    /// True where it was written in percent.
    pub is_percent: bool,
    /// True where the model accepts it.
    pub fits: bool,
    /// True where the preset says so, and not the user.
    is_preset: bool,
}

impl Given {
    /// Reads what [`Material::parse`] reads, but for ranges: numbers may lie outside, be in percent, or be `#rrggbb`.
    ///
    /// # Errors
    /// Unknown models, presets and parameters, and values that are not even numbers.
    pub fn parse(text: &str) -> Result<Self, MaterialError> {
        let text = text.trim();
        let syntax = |reason: String| MaterialError::Syntax { text: text.to_owned(), reason };
        if text.starts_with('{') {
            let json: Json = serde_json::from_str(text).map_err(|e| syntax(e.to_string()))?;
            let base = json.get("model").and_then(Json::as_str);
            let base = base.ok_or_else(|| syntax("the field 'model' is missing".into()))?;
            let fields = json.as_object().into_iter().flatten().filter(|(name, _)| *name != "model");
            let fields: Vec<(String, String)> =
                fields.map(|(name, value)| (name.clone(), plain(value))).collect();
            return Self::new(base, &fields);
        }
        let (base, list) = text.split_once(':').unwrap_or((text, ""));
        let pair = |item: &str| match item.split_once('=') {
            Some((name, value)) => Ok((name.trim().to_owned(), value.trim().to_owned())),
            None => Err(syntax(format!("'{item}' is not NAME=VALUE"))),
        };
        let items = list.split(',').map(str::trim).filter(|item| !item.is_empty());
        Self::new(base.trim(), &items.map(pair).collect::<Result<Vec<_>, _>>()?)
    }

    fn new(base: &str, values: &[(String, String)]) -> Result<Self, MaterialError> {
        let mut material = Material::named(base)?;
        let model = material.model();
        let preset = base.split_once('@').map(|(_, preset)| model.preset(preset)).transpose()?;
        let mut items = Vec::new();
        for (name, text) in preset.into_iter().flat_map(|p| &p.values) {
            items.push(Item { is_preset: true, ..Item::read(&mut material, name, text)? });
        }
        let mut named: Vec<usize> = Vec::new();
        for (name, text) in values {
            let replaced = model.resolve(name)?;
            if replaced.iter().any(|index| named.contains(index)) {
                return Err(MaterialError::Repeated { model: model.name.into(), name: name.clone() });
            }
            named.extend(&replaced);
            items.retain(|item: &Item| {
                !(item.is_preset && model.resolve(&item.name).is_ok_and(|i| i == replaced))
            });
            items.push(Item::read(&mut material, name, text)?);
        }
        Ok(Self { base: base.to_owned(), items, material })
    }

    /// The model.
    pub fn model(&self) -> &'static Model {
        self.material.model()
    }

    /// The material as text, with some values replaced or added.
    pub fn text_with(&self, values: &[(String, String)]) -> String {
        let replaced = |name: &str| values.iter().find(|(n, _)| n == name).map(|(_, value)| value.clone());
        let kept = self.items.iter().filter(|item| !item.is_preset);
        let mut list: Vec<String> = kept
            .map(|item| {
                format!("{}={}", item.name, replaced(&item.name).unwrap_or_else(|| item.text.clone()))
            })
            .collect();
        let is_written = |name: &str| self.items.iter().any(|item| !item.is_preset && item.name == name);
        let added = values.iter().filter(|(name, _)| !is_written(name));
        list.extend(added.map(|(name, value)| format!("{name}={value}")));
        if list.is_empty() { self.base.clone() } else { format!("{}:{}", self.base, list.join(",")) }
    }

    /// True where it is a metal.
    pub(super) fn is_metal(&self) -> bool {
        self.material.canonical().metalness > 0.5
    }
}

impl Item {
    /// Reads a value, and sets it where the model accepts it.
    fn read(material: &mut Material, name: &str, text: &str) -> Result<Self, MaterialError> {
        let model = material.model();
        let parameter = model.parameter(name)?;
        let is_word = model.named.iter().any(|n| n.name == name)
            || matches!(parameter.kind, Kind::Choice { .. } | Kind::File { .. });
        let blank = Self {
            name: name.to_owned(),
            text: text.to_owned(),
            parameter,
            numbers: Vec::new(),
            is_percent: false,
            fits: true,
            is_preset: false,
        };
        if is_word {
            material.set(name, text)?;
            return Ok(blank);
        }
        let unusual =
            hexadecimal(text).map(|codes| (codes, false)).or_else(|| percents(text).map(|v| (v, true)));
        if let Some((numbers, is_percent)) = unusual.filter(|(v, _)| counts(parameter, v.len())) {
            return Ok(Self { numbers, is_percent, fits: false, ..blank });
        }
        let numbers: Vec<f64> = text.split('/').filter_map(|part| part.trim().parse().ok()).collect();
        let fits = match material.set(name, text) {
            Err(MaterialError::OutOfRange { .. }) if numbers.iter().all(|v| v.is_finite()) => false,
            other => other.map(|()| true)?,
        };
        Ok(Self { numbers, fits, ..blank })
    }

    /// True for linear RGB.
    pub(super) fn is_colour(&self) -> bool {
        matches!(self.parameter.kind, Kind::Colour { .. })
    }

    /// The numbers as a colour; one number is grey.
    pub(super) fn colour(&self) -> Option<[f64; 3]> {
        match self.numbers[..] {
            [v] => Some([v; 3]),
            [r, g, b] => Some([r, g, b]),
            _ => None,
        }
    }

    pub(super) fn largest(&self) -> f64 {
        self.numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    pub(super) fn least(&self) -> f64 {
        self.numbers.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// A field of JSON as it would be written on the command line.
fn plain(value: &Json) -> String {
    match value {
        Json::String(text) => text.clone(),
        Json::Array(values) => values.iter().map(plain).collect::<Vec<_>>().join("/"),
        other => other.to_string(),
    }
}

/// True where a parameter takes so many numbers.
fn counts(parameter: &Parameter, count: usize) -> bool {
    match parameter.kind {
        Kind::Number { .. } => count == 1,
        Kind::Colour { .. } => count == 1 || count == 3,
        _ => count > 0,
    }
}

/// The codes of `#rrggbb`.
fn hexadecimal(text: &str) -> Option<Vec<f64>> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii())?;
    let code = |k: usize| u8::from_str_radix(&digits[2 * k..2 * k + 2], 16).ok().map(f64::from);
    (0..3).map(code).collect()
}

/// The numbers before percent signs, all or none.
fn percents(text: &str) -> Option<Vec<f64>> {
    let number = |part: &str| part.trim().strip_suffix('%')?.trim().parse().ok();
    text.split('/').map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_given_back() {
        for text in ["gltf", "gltf:roughness=60,base_color=200/100/50", "openpbr@gold:base_color=2"] {
            assert_eq!(Given::parse(text).unwrap().text_with(&[]), text);
        }
        let given = Given::parse("openpbr@gold:base_color=2").unwrap();
        assert_eq!(
            given.items.iter().filter(|i| i.name == "base_color").count(),
            1,
            "the user's replaces the preset's"
        );
        let fix = [("specular_roughness".to_owned(), "0.1".to_owned())];
        assert_eq!(given.text_with(&fix), "openpbr@gold:base_color=2,specular_roughness=0.1");
    }

    #[test]
    fn unusual_numbers_are_read() {
        let given = Given::parse("gltf:base_color=#ff8000,roughness=30 %,metallic=7").unwrap();
        let numbers: Vec<&[f64]> = given.items.iter().map(|i| &i.numbers[..]).collect();
        assert_eq!(numbers, [&[255.0, 128.0, 0.0][..], &[30.0], &[7.0]]);
        assert!(given.items.iter().all(|i| !i.fits) && given.items[1].is_percent);
        assert_eq!(given.material, Material::new(given.model()));
    }
}
