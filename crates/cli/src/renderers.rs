//! Other renderers at the command line: which ones a command needs, their start, and their pictures.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Context;
use lookmatch_database::{Database, KeptPool, Shown};
use lookmatch_imaging::Image;
use lookmatch_materials::{Description, Material, Model, by_name, split_name};
use lookmatch_remap::{RendererRecord, Shot, Studio};
use lookmatch_renderers::{
    Bundled, Hello, Installations, Job, Launch, Pool, PoolOptions, RendererError, Stop,
};
use lookmatch_rendering::{Illumination, Scene};

use crate::Usage;
use crate::args::RendererArgs;
use crate::output::spinner;
use crate::transport::renders;

/// The renderer that a material's text names, `RENDERER:MODEL…`; `None` for ours.
pub(crate) fn renderer_of(text: &str) -> Option<String> {
    let json = match text.trim_start().starts_with('{') {
        true => Some(text.to_owned()),
        false if text.ends_with(".json") => std::fs::read_to_string(text).ok(),
        false => None,
    };
    let name = match json {
        Some(json) => {
            serde_json::from_str::<serde_json::Value>(&json).ok()?.get("model")?.as_str()?.to_owned()
        }
        None => split_name(text).0.to_owned(),
    };
    let (renderer, _) = name.split_once(':')?;
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    (renderer.chars().all(is_plain) && by_name(renderer).is_err()).then(|| renderer.to_owned())
}

/// Refuses a material of another renderer, for commands that have to know its formula.
pub(crate) fn only_ours(command: &str, text: &str) -> anyhow::Result<()> {
    let Some(renderer) = renderer_of(text) else { return Ok(()) };
    let ours = "give a material of our own models (`lookmatch models`)";
    Err(Usage(format!(
        "{command}: '{text}' is a material of {renderer}, which only {renderer} can render; {ours}"
    ))
    .into())
}

/// A scene as other renderers see it: all of its spheres wear the material.
pub(crate) fn plain_scene(mut scene: Scene, renderer: &str) -> anyhow::Result<Scene> {
    if let Some(mesh) = scene.meshes.first() {
        return Err(Usage(format!(
            "{renderer} is given scenes of spheres alone; scene '{}' has the mesh '{}'",
            scene.name, mesh.file
        ))
        .into());
    }
    if scene.spheres.iter().any(|sphere| sphere.diffuse.is_some()) {
        eprintln!(
            "note: the scene's own colours of spheres are left out; {renderer} knows those of the material alone"
        );
    }
    scene.spheres.iter_mut().for_each(|sphere| sphere.diffuse = None);
    Ok(scene)
}

/// How a renderer is started: as the user says, or as it was installed.
pub(crate) fn launch(name: &str, commands: &[(String, String)]) -> anyhow::Result<Launch> {
    match commands.iter().find(|(given, _)| given == name) {
        Some((_, command)) => launch_command(command),
        None => Ok(Installations::of_user()?.launch(Bundled::find(name)?)?),
    }
}

/// A command line as a shell would split it.
pub(crate) fn launch_command(command: &str) -> anyhow::Result<Launch> {
    let words = shlex::split(command).filter(|words| !words.is_empty());
    let mut words = words
        .ok_or_else(|| Usage(format!("'{command}' is no command; quotes must be closed")))?
        .into_iter()
        .map(OsString::from);
    let program = words.next().map(PathBuf::from).unwrap_or_default();
    Ok(Launch { program, args: words.collect(), env: Vec::new() })
}

/// Renderers at work.
pub(crate) struct Renderers {
    list: Vec<Arc<Hired>>,
}

/// One of them.
struct Hired {
    name: String,
    pool: KeptPool,
    models: Vec<Description>,
}

impl Renderers {
    /// Starts the renderers of some names, and makes their models known.
    pub(crate) fn start(
        names: &[String],
        args: &RendererArgs,
        stopped: &Arc<AtomicBool>,
    ) -> anyhow::Result<Self> {
        let mut list: Vec<Arc<Hired>> = Vec::new();
        let database = if names.is_empty() { None } else { database() };
        for name in names {
            if list.iter().any(|hired| hired.name == *name) {
                continue;
            }
            let launch = launch(name, &args.start)?;
            let progress = spinner(&format!("starting {name}"));
            let flag = stopped.clone();
            let stop: Stop = Arc::new(move || flag.load(Ordering::Relaxed));
            let options = PoolOptions {
                workers: args.workers,
                time_limit: Duration::from_secs(args.time_limit),
                log: args.log.clone(),
                ..PoolOptions::default()
            };
            let pool = Pool::start(launch.clone(), options, stop)?;
            let hired = Hired::start(name, KeptPool::new(pool, &launch, database.clone()))?;
            progress.finish_and_clear();
            list.push(Arc::new(hired));
        }
        Ok(Self { list })
    }

    /// For remaps.
    pub(crate) fn studios(&self) -> Vec<Arc<dyn Studio>> {
        self.list.iter().map(|hired| hired.clone() as Arc<dyn Studio>).collect()
    }

    /// What a probe keeps of them: the models that it speaks of.
    pub(crate) fn records(&self, models: &[&Model]) -> Vec<RendererRecord> {
        let record = |hired: &Arc<Hired>| {
            let is_used =
                |d: &&Description| models.iter().any(|m| m.name == format!("{}:{}", hired.name, d.name));
            RendererRecord {
                name: hired.name.clone(),
                version: hired.pool.hello().version.clone(),
                models: hired.models.iter().filter(is_used).cloned().collect(),
            }
        };
        self.list.iter().map(record).collect()
    }

    /// All models of theirs.
    pub(crate) fn models(&self) -> anyhow::Result<Vec<&'static Model>> {
        let of = |hired: &Arc<Hired>| hired.models.iter().map(|m| m.adopt(&hired.name)).collect::<Vec<_>>();
        Ok(self.list.iter().flat_map(of).collect::<Result<_, _>>()?)
    }

    /// What they say of themselves.
    pub(crate) fn hellos(&self) -> impl Iterator<Item = &Hello> {
        self.list.iter().map(|hired| hired.pool.hello())
    }

    /// Pictures of materials of one of them, each with its own seed; found, or rendered now.
    pub(crate) fn pictures(
        &self,
        (scene, light, size): (&Scene, Illumination, usize),
        samples: u32,
        materials: &[(&Material, u32)],
    ) -> anyhow::Result<Vec<Shown>> {
        let hired = self.of(materials[0].0)?;
        hired.set_scene("picture", scene, light, size).map_err(anyhow::Error::msg)?;
        let shots =
            materials.iter().map(|&(material, seed)| Shot { scene: "picture", material, samples, seed });
        let progress = spinner(&format!("rendering with {}", hired.name));
        let shown = hired.shown(&shots.collect::<Vec<_>>());
        progress.finish_and_clear();
        Ok(shown.into_iter().collect::<Result<_, _>>()?)
    }

    /// Whether pictures of a material of theirs have noise.
    pub(crate) fn has_noise(&self, material: &Material) -> anyhow::Result<bool> {
        Ok(self.of(material)?.has_noise())
    }

    fn of(&self, material: &Material) -> anyhow::Result<&Hired> {
        let name = material.model().renderer.context("the material is not one of another renderer")?;
        let hired = self.list.iter().find(|hired| hired.name == name);
        Ok(hired.with_context(|| format!("the renderer '{name}' has not been started"))?)
    }

    /// Seconds that their processors worked, and pictures that had to be repeated.
    pub(crate) fn usage(&self) -> Vec<(String, lookmatch_renderers::Usage)> {
        self.list.iter().map(|hired| (hired.name.clone(), hired.pool.usage())).collect()
    }
}

impl Hired {
    fn start(name: &str, pool: KeptPool) -> anyhow::Result<Self> {
        let read = |model: &serde_json::Value| {
            let description: Description = serde_json::from_value(model.clone()).with_context(|| {
                format!("{name} describes a model in a way that is not understood: {model}")
            })?;
            description.adopt(name)?;
            anyhow::Ok(description)
        };
        let models = pool.hello().models.iter().map(read).collect::<anyhow::Result<_>>()?;
        Ok(Self { name: name.to_owned(), pool, models })
    }

    /// Pictures, found or rendered.
    fn shown(&self, shots: &[Shot]) -> Vec<Result<Shown, RendererError>> {
        let job = |shot: &Shot| {
            let mut values = shot.material.to_json().as_object().cloned().unwrap_or_default();
            values.remove("model");
            let model = shot.material.model().name;
            Job {
                scene: shot.scene.to_owned(),
                model: model.split_once(':').map_or(model, |(_, model)| model).to_owned(),
                values,
                samples: shot.samples,
                seed: shot.seed,
            }
        };
        self.pool.render(&shots.iter().map(job).collect::<Vec<_>>())
    }
}

impl Studio for Hired {
    fn name(&self) -> &str {
        &self.name
    }

    fn has_noise(&self) -> bool {
        self.pool.hello().capabilities.noise
    }

    fn set_scene(&self, name: &str, scene: &Scene, light: Illumination, size: usize) -> Result<(), String> {
        self.pool.scene(name, scene, light, size).map_err(|e| e.to_string())
    }

    fn render(&self, shots: &[Shot]) -> Vec<Result<Image, String>> {
        self.take(shots).into_iter().map(|result| result.map(|(image, _)| image)).collect()
    }

    fn take(&self, shots: &[Shot]) -> Vec<Result<(Image, bool), String>> {
        let image = |shown: Shown| (shown.picture.image, shown.is_found);
        self.shown(shots).into_iter().map(|shown| shown.map(image).map_err(|e| e.to_string())).collect()
    }
}

/// The render database, unless it is turned off or cannot be used.
fn database() -> Option<Arc<Database>> {
    let path = renders()?;
    let warn = |text: &str| eprintln!("warning: {text}");
    match Database::open(&path, Arc::new(warn)) {
        Ok(database) => Some(Arc::new(database)),
        Err(error) => {
            warn(&format!("pictures are not kept: {error}"));
            None
        }
    }
}
