//! All that the pixels of a picture depend on.

use std::ffi::OsStr;
use std::fs::File;
use std::path::Path;

use blake3::{Hash, Hasher};
use lookmatch_renderers::{Hello, Job, Launch};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

/// All that the pixels of a picture depend on. Two of them are equal to the bit of every number, or have other keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// The renderer's own name: the same one, whatever a user calls it.
    pub renderer: String,
    /// Its version, as it says.
    pub version: String,
    /// [`worker_identity`].
    pub worker: String,
    /// [`SceneIdentity::hash`].
    pub scene: String,
    /// The lights that are on, for people: they are part of the scene.
    pub light: String,
    /// Side of the picture in pixels.
    pub size: u64,
    /// The material's model.
    pub model: String,
    /// All of its parameters.
    pub parameters: Map<String, Value>,
    /// Samples per pixel that were asked for.
    pub samples: u32,
    /// Other seeds, other noise.
    pub seed: u32,
}

impl Description {
    /// That of a job for a renderer.
    pub fn new(hello: &Hello, worker: &str, scene: &SceneIdentity, job: &Job) -> Self {
        Self {
            renderer: hello.name.clone(),
            version: hello.version.clone(),
            worker: worker.to_owned(),
            scene: scene.hash.clone(),
            light: scene.light.clone(),
            size: scene.size,
            model: job.model.clone(),
            parameters: job.values.clone(),
            samples: job.samples,
            seed: job.seed,
        }
    }

    /// JSON, names in the order of the alphabet, numbers to the last bit.
    pub fn text(&self) -> String {
        let mut text = json!(self);
        text.sort_all_objects();
        text.to_string()
    }

    /// For a message to people.
    pub(crate) fn title(&self) -> String {
        let Self { renderer, model, size, samples, seed, .. } = self;
        format!("{renderer}:{model}, {size} px, {samples} samples, seed {seed}")
    }
}

/// A scene as workers are told it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneIdentity {
    /// What it is called; no part of its hash.
    pub name: String,
    /// BLAKE3 of its content, in hexadecimal digits.
    pub hash: String,
    /// JSON, with the BLAKE3 of the map's pixels.
    pub content: String,
    /// `point`, `environment` or `point, environment`.
    pub light: String,
    /// Side of its pictures in pixels; no part of its hash.
    pub size: u64,
}

impl SceneIdentity {
    /// From the message to workers ([`lookmatch_renderers::Pool::told`]) and the pixels of the map.
    pub fn new(name: &str, mut message: Value, map: &[u8]) -> Self {
        let size = message["size"].as_u64().unwrap_or(0);
        message.as_object_mut().and_then(|fields| fields.remove("size"));
        let mut lights = Vec::new();
        if message["point_lights"].as_array().is_some_and(|points| !points.is_empty()) {
            lights.push("point");
        }
        if let Some(Value::Object(environment)) = message.get_mut("environment") {
            lights.push("environment");
            environment.insert("pixels".into(), blake3::hash(map).to_hex().as_str().into());
        }
        message.sort_all_objects();
        let content = message.to_string();
        let hash = blake3::hash(content.as_bytes()).to_hex().to_string();
        Self { name: name.into(), hash, content, light: lights.join(", "), size }
    }
}

/// What workers in Python share, beside their own file.
const SHARED: &str = "lookmatch_worker.py";

/// Tells a worker from others that call themselves the same: the BLAKE3 of its command, in hexadecimal digits.
///
/// Of an argument that is a file counts the content, not the path, and that of a `lookmatch_worker.py` beside it: an installed
/// worker may move, and an edited one is another. The program counts by its content where no argument is a file, else by its
/// name: a new interpreter makes no new pictures. A worker that reads further files of its own says so by its version.
pub fn worker_identity(launch: &Launch) -> String {
    let mut hasher = Hasher::new();
    let mut add = |kind: &str, part: &[u8]| {
        hasher.update(kind.as_bytes()).update(&(part.len() as u64).to_le_bytes()).update(part);
    };
    let mut has_file = false;
    for argument in &launch.args {
        let path = Path::new(argument);
        match content(path) {
            None => add("text", argument.as_encoded_bytes()),
            Some(hash) => {
                has_file = true;
                add("file", hash.as_bytes());
                let shared = content(&path.with_file_name(SHARED));
                shared.iter().for_each(|hash| add("beside", hash.as_bytes()));
            }
        }
    }
    match content(&launch.program).filter(|_| !has_file) {
        Some(hash) => add("program", hash.as_bytes()),
        None => add("program", launch.program.file_name().unwrap_or(OsStr::new("")).as_encoded_bytes()),
    }
    hasher.finalize().to_hex().to_string()
}

/// The hash of a file's content; `None` where there is no file that can be read.
fn content(path: &Path) -> Option<Hash> {
    let file = File::open(path).ok().filter(|_| path.is_file())?;
    let mut hasher = Hasher::new();
    hasher.update_reader(file).ok()?;
    Some(hasher.finalize())
}
