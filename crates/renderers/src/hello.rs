//! What a renderer says of itself.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::Cause;

/// The version of the protocol that is spoken here.
pub const PROTOCOL: u32 = 1;

/// The answer to `hello`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// Version of the protocol.
    pub protocol: u32,
    /// What the renderer is called: lower case letters, digits and hyphens.
    pub name: String,
    /// Version of the renderer.
    pub version: String,
    /// Licence of the renderer, an SPDX expression.
    pub licence: String,
    /// Its material models, described as ours are.
    pub models: Vec<Value>,
    /// What it can do.
    pub capabilities: Capabilities,
    /// Materials whose pictures are known without rendering.
    pub check: Check,
    /// What it does not do as path tracing would, in sentences.
    pub approximations: Vec<String>,
}

/// What a renderer can do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capabilities {
    /// Whether the same seed gives the same picture.
    pub deterministic: Determinism,
    /// Whether the seed has an effect.
    pub seeds: bool,
    /// False for a rasteriser: more samples only smooth edges.
    pub noise: bool,
    /// What a sample is, in a sentence.
    pub samples: String,
    /// What may light a scene.
    pub lights: Vec<Light>,
    /// Whether one worker uses all cores.
    pub threads: Threads,
    /// Whether `cancel` is heard during a render.
    pub cancel: bool,
    /// Whether spheres and plane light each other.
    pub interreflection: bool,
}

/// Whether the same seed gives the same picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Determinism {
    /// To the bit.
    Exact,
    /// Nearly.
    Approximate,
    /// Not at all.
    None,
}

/// What may light a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Light {
    /// Point lights.
    Point,
    /// A map.
    Environment,
}

/// How many cores one worker uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Threads {
    /// All: one worker is enough.
    All,
    /// One: as many workers as cores are started.
    One,
}

/// Materials whose pictures are known without rendering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// A Lambert ball.
    pub lambert: Lambert,
    /// A ball that reflects everything like a mirror, where the renderer has one.
    pub mirror: Option<Mirror>,
}

/// A material that is a Lambert reflection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lambert {
    /// Its model.
    pub model: String,
    /// All parameters but the albedo.
    pub values: Map<String, Value>,
    /// The colour that is the albedo.
    pub parameter: String,
}

/// A material that is a mirror.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mirror {
    /// Its model.
    pub model: String,
    /// All parameters.
    pub values: Map<String, Value>,
}

impl Hello {
    /// Reads and checks an answer. The version comes first: the fields of others may be different ones.
    pub(crate) fn read(mut answer: Map<String, Value>) -> Result<Self, Cause> {
        answer.remove("id");
        let protocol = answer.get("protocol").unwrap_or(&Value::Null);
        if *protocol != PROTOCOL {
            let wrong = format!("protocol is {protocol}; this lookmatch speaks version {PROTOCOL}");
            return Err(Cause::Answer(wrong));
        }
        let hello: Self = serde_json::from_value(Value::Object(answer))
            .map_err(|error| Cause::Answer(format!("{error}; docs/renderer-protocol.md lists the fields")))?;
        hello.check_fields().map_err(Cause::Answer)?;
        Ok(hello)
    }

    fn check_fields(&self) -> Result<(), String> {
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if self.name.is_empty() || !self.name.chars().all(is_plain) {
            return Err(format!("name is '{}'; expected lower case letters, digits and hyphens", self.name));
        }
        if self.models.is_empty() {
            return Err("models is []; expected one material model at least".into());
        }
        if self.model_names().count() != self.models.len() {
            return Err("models holds one without a name; expected a string 'name' in each".into());
        }
        if self.capabilities.lights.is_empty() {
            return Err("capabilities.lights is []; expected point, environment or both".into());
        }
        Ok(())
    }

    /// Names of the models.
    pub fn model_names(&self) -> impl Iterator<Item = &str> {
        self.models.iter().filter_map(|model| model.get("name")?.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn answer() -> Map<String, Value> {
        let answer = json!({
            "id": 0, "protocol": 1, "name": "fake", "version": "1", "licence": "MIT",
            "models": [{"name": "matte"}],
            "capabilities": {"deterministic": "exact", "seeds": true, "noise": true, "samples": "paths",
                "lights": ["point"], "threads": "one", "cancel": false, "interreflection": true},
            "check": {"lambert": {"model": "matte", "values": {}, "parameter": "colour"}, "mirror": null},
            "approximations": [],
        });
        answer.as_object().unwrap().clone()
    }

    fn message(change: impl FnOnce(&mut Map<String, Value>)) -> String {
        let mut answer = answer();
        change(&mut answer);
        Hello::read(answer).unwrap_err().to_string()
    }

    #[test]
    fn answers_are_read() {
        let hello = Hello::read(answer()).unwrap();
        assert_eq!(hello.model_names().collect::<Vec<_>>(), ["matte"]);
        assert_eq!(hello.capabilities.threads, Threads::One);
        assert!(hello.check.mirror.is_none());
    }

    #[test]
    fn messages_name_field_value_and_expectation() {
        let other = message(|a| drop(a.insert("protocol".into(), json!(2))));
        assert!(other.contains("protocol is 2; this lookmatch speaks version 1"), "{other}");
        let none = message(|a| drop(a.remove("protocol")));
        assert!(none.contains("protocol is null"), "{none}");
        let name = message(|a| drop(a.insert("name".into(), json!("My Renderer"))));
        assert!(name.contains("name is 'My Renderer'; expected lower case"), "{name}");
        let field = message(|a| drop(a.remove("licence")));
        assert!(field.contains("missing field `licence`"), "{field}");
        let models = message(|a| drop(a.insert("models".into(), json!([{}]))));
        assert!(models.contains("without a name"), "{models}");
    }
}
