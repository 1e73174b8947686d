//! A renderer under examination: scenes, materials and pictures for the checks.

use lookmatch_imaging::Image;
use lookmatch_materials::{Description, Kind, Model};
use lookmatch_rendering::{Camera, EnvironmentLight, Illumination, Plane, PointLight, Scene, Sphere};
use serde_json::{Map, Value, json};
use tempfile::TempDir;

use super::CheckOptions;
use super::finding::Finding;
use crate::RendererError;
use crate::hello::{Hello, Light};
use crate::pool::{Job, Pool, PoolOptions, Stop};
use crate::process::Launch;
use crate::worker::Picture;

/// A material in the words of the protocol.
#[derive(Clone, Debug)]
pub(crate) struct Worn {
    pub(crate) model: String,
    pub(crate) values: Map<String, Value>,
}

/// A renderer under examination.
pub(crate) struct Session<'a> {
    pub(crate) launch: &'a Launch,
    pub(crate) options: &'a CheckOptions,
    pub(crate) stop: Stop,
    pub(crate) hello: Hello,
    /// Models whose descriptions are understood.
    pub(crate) models: Vec<&'static Model>,
    /// Why others are not.
    pub(crate) misdescribed: Vec<String>,
    /// Where each pixel comes from, by its column, its row and the last one, where the camera was found to be turned: other
    /// checks get pictures that are put right, so that they do not find the same again.
    pub(crate) turn: Option<Turn>,
    pool: Pool,
    folder: TempDir,
}

/// A turn of pictures that is its own inverse.
pub(crate) type Turn = fn(usize, usize, usize) -> (usize, usize);

impl<'a> Session<'a> {
    pub(crate) fn start(
        launch: &'a Launch,
        options: &'a CheckOptions,
        stop: Stop,
    ) -> Result<Self, RendererError> {
        let pool = Pool::start(launch.clone(), pool_options(options), stop.clone())?;
        let hello = pool.hello().clone();
        let (mut models, mut misdescribed) = (Vec::new(), Vec::new());
        for described in &hello.models {
            match adopted(described, &hello.name) {
                Ok(model) => models.push(model),
                Err(why) => misdescribed.push(why),
            }
        }
        let folder = tempfile::tempdir().map_err(|error| RendererError::Start {
            renderer: hello.name.clone(),
            reason: format!("no folder for maps can be made: {error}"),
        })?;
        Ok(Self { launch, options, stop, hello, models, misdescribed, turn: None, pool, folder })
    }

    /// A fresh worker, where the last one was given up.
    pub(crate) fn renew(&mut self) -> Result<(), RendererError> {
        self.pool = Pool::start(self.launch.clone(), pool_options(self.options), self.stop.clone())?;
        Ok(())
    }

    pub(crate) fn pool_options(&self) -> PoolOptions {
        pool_options(self.options)
    }

    /// Whether a check that needs a light applies; notes it where not.
    pub(crate) fn has(&self, light: Light, finding: &mut Finding) -> bool {
        let has = self.hello.capabilities.lights.contains(&light);
        if !has {
            finding.skip(match light {
                Light::Point => "it has no point lights",
                Light::Environment => "it has no environment",
            });
        }
        has
    }

    /// Gives the renderer a scene under all lights that the scene has.
    pub(crate) fn load(&self, name: &str, scene: &Scene) -> Result<(), RendererError> {
        self.pool.scene(name, scene, Illumination::All, self.options.size)
    }

    /// A picture at the usual number of samples.
    pub(crate) fn picture(&self, scene: &str, worn: &Worn) -> Result<Image, RendererError> {
        Ok(self.render(scene, worn, self.options.samples, 1)?.image)
    }

    pub(crate) fn render(
        &self,
        scene: &str,
        worn: &Worn,
        samples: u32,
        seed: u32,
    ) -> Result<Picture, RendererError> {
        let job = Job {
            scene: scene.into(),
            model: worn.model.clone(),
            values: worn.values.clone(),
            samples,
            seed,
        };
        let mut picture = self.pool.render(&[job]).swap_remove(0)?;
        if let Some(turn) = self.turn {
            picture.image = turned(&picture.image, turn);
        }
        Ok(picture)
    }

    /// The Lambert material of an albedo, or of the nearest that it can have.
    pub(crate) fn lambert(&self, albedo: [f64; 3]) -> (Worn, [f64; 3]) {
        let check = &self.hello.check.lambert;
        let kind = self
            .model(&check.model)
            .and_then(|model| model.parameters.iter().find(|p| p.name == check.parameter));
        let albedo = match kind.and_then(|p| p.range()) {
            Some(range) => albedo.map(|a| range.valid.nearest(a)),
            None => albedo,
        };
        let mut values = check.values.clone();
        values.insert(check.parameter.clone(), json!(albedo));
        (Worn { model: check.model.clone(), values }, albedo)
    }

    pub(crate) fn mirror(&self) -> Option<Worn> {
        let mirror = self.hello.check.mirror.as_ref()?;
        Some(Worn { model: mirror.model.clone(), values: mirror.values.clone() })
    }

    /// A model by its name within the renderer.
    pub(crate) fn model(&self, name: &str) -> Option<&'static Model> {
        self.models.iter().find(|model| own_name(model) == name).copied()
    }

    /// The first sentence about what it does not do that has one of some words.
    pub(crate) fn admitted(&self, words: &[&str]) -> Option<&str> {
        let sentences = self.hello.approximations.iter();
        let mut fitting = sentences.filter(|s| words.iter().any(|word| s.to_lowercase().contains(word)));
        fitting.next().map(String::as_str)
    }

    /// Writes a map for scenes to name.
    pub(crate) fn map(&self, name: &str, map: &Image) -> Result<EnvironmentLight, RendererError> {
        let path = self.folder.path().join(format!("{name}.exr"));
        lookmatch_imaging::write(&path, map, &[])
            .map_err(|error| RendererError::Scene(lookmatch_rendering::SceneError::from(error)))?;
        Ok(EnvironmentLight::of(path.to_string_lossy()))
    }

    /// The scene of checks that look at no closed form: everything in it, under every light that the renderer has.
    pub(crate) fn stage(&self) -> Result<Scene, RendererError> {
        let can = |light| self.hello.capabilities.lights.contains(&light);
        let mut scene = ball();
        scene.plane = Some(checkerboard());
        if !can(Light::Point) {
            scene.point_lights.clear();
        }
        if can(Light::Environment) {
            scene.environment = Some(self.map("marked", &marked_map())?);
        }
        Ok(scene)
    }
}

/// A picture whose pixels come from elsewhere.
pub(crate) fn turned(image: &Image, turn: Turn) -> Image {
    Image::from_fn(image.width(), image.height(), |x, y| {
        let (x, y) = turn(x, y, image.width() - 1);
        image.get(x, y)
    })
}

fn pool_options(options: &CheckOptions) -> PoolOptions {
    PoolOptions {
        workers: Some(1),
        time_limit: options.time_limit,
        log: options.log.clone(),
        ..PoolOptions::default()
    }
}

fn adopted(described: &Value, renderer: &str) -> Result<&'static Model, String> {
    let name = &described["name"];
    let description: Description =
        serde_json::from_value(described.clone()).map_err(|error| format!("model {name}: {error}"))?;
    description.adopt(renderer).map_err(|error| error.to_string())
}

/// A model's name within its renderer.
pub(crate) fn own_name(model: &Model) -> &'static str {
    model.name.split_once(':').map_or(model.name, |(_, name)| name)
}

/// The values of a model's parameters where none are given.
pub(crate) fn defaults(model: &Model) -> Worn {
    let value = |kind: &Kind| match kind {
        Kind::Number { default, .. } => json!(default),
        Kind::Colour { default, .. } => json!(default),
        Kind::List { default, .. } => json!(default),
        Kind::Choice { options } => json!(options[0]),
        Kind::File { .. } => Value::Null,
    };
    let values = model.parameters.iter().map(|p| (p.name.to_owned(), value(&p.kind))).collect();
    Worn { model: own_name(model).to_owned(), values }
}

/// A ball alone under a point light. The light has a colour, so that exchanged channels are seen.
pub(crate) fn ball() -> Scene {
    Scene {
        name: "ball".into(),
        camera: Camera {
            eye: [0.0, 1.5, 6.0],
            target: [0.0, -0.1, 0.0],
            up: [0.0, 1.0, 0.0],
            vertical_fov: 28.0,
        },
        spheres: vec![sphere([0.0; 3], 1.0)],
        meshes: Vec::new(),
        plane: None,
        point_lights: vec![PointLight { position: [-3.0, 4.0, 4.0], intensity: [60.0, 45.0, 30.0] }],
        environment: None,
    }
}

pub(crate) fn sphere(centre: [f64; 3], radius: f64) -> Sphere {
    Sphere { centre, radius, diffuse: None }
}

pub(crate) fn checkerboard() -> Plane {
    Plane { height: -1.0, half_extent: 2.0, check_size: 0.5, light: [0.6, 0.5, 0.4], dark: [0.1, 0.15, 0.2] }
}

/// A map that looks different from every side: white, red, green and blue quarters around the horizon from the left edge,
/// dark above and darker below, where it is checked, with one bright patch in the upper left corner.
pub(crate) fn marked_map() -> Image {
    let (width, height) = (256, 128);
    let quarters = [[1.0, 1.0, 1.0], [1.0, 0.1, 0.1], [0.1, 1.0, 0.1], [0.1, 0.1, 1.0_f32]];
    Image::from_fn(width, height, |x, y| {
        let scale = match (8 * y / height, 16 * x / width) {
            (0 | 1, 0 | 1) => return [3.0, 2.0, 0.5],
            (0 | 1, _) => 0.1,
            (2 | 3, _) => 1.0,
            (4, _) => 0.5,
            (row, column) if (row + column) % 2 == 0 => 0.12,
            _ => 0.3,
        };
        quarters[4 * x / width].map(|c| scale * c)
    })
}
