//! Scenes as data: camera, spheres, an optional checkerboard, point lights, an environment. Y is up, units are metres.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::SceneError;

/// A scene; its TOML form is described in `docs/scene-format.md`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Name for reports; the file's own name where none is given.
    #[serde(default)]
    pub name: String,
    /// The pinhole camera.
    pub camera: Camera,
    /// The subjects: all of them wear the material that is rendered.
    #[serde(rename = "sphere")]
    pub spheres: Vec<Sphere>,
    /// A horizontal, diffuse checkerboard.
    #[serde(default)]
    pub plane: Option<Plane>,
    /// Isotropic point lights.
    #[serde(default, rename = "point_light")]
    pub point_lights: Vec<PointLight>,
    /// Light from far away.
    #[serde(default)]
    pub environment: Option<EnvironmentLight>,
}

/// A pinhole camera with a square film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Position, in metres.
    pub eye: [f64; 3],
    /// The point in the middle of the picture.
    pub target: [f64; 3],
    /// The direction that is up in the picture.
    #[serde(default = "up")]
    pub up: [f64; 3],
    /// Vertical field of view in degrees, above 0 and below 180.
    pub vertical_fov: f64,
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

/// A sphere. Its tangent runs along its parallels (eastwards), its bitangent along its meridians (northwards).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Centre, in metres.
    pub centre: [f64; 3],
    /// Radius in metres, above 0.
    pub radius: f64,
    /// A diffuse reflectance of its own (linear RGB) instead of the material's, for materials that have one.
    #[serde(default)]
    pub diffuse: Option<[f64; 3]>,
}

/// A square, horizontal, two-coloured Lambertian checkerboard around the y axis, with a check's corner at its middle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Its y coordinate, in metres.
    pub height: f64,
    /// Half of its side, in metres.
    pub half_extent: f64,
    /// Side of a check, in metres.
    pub check_size: f64,
    /// Albedo of the light checks, linear RGB.
    pub light: [f64; 3],
    /// Albedo of the dark checks, linear RGB.
    pub dark: [f64; 3],
}

/// An isotropic point light: its irradiance falls with the square of the distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointLight {
    /// Position, in metres.
    pub position: [f64; 3],
    /// Radiant intensity in W/sr, linear RGB.
    pub intensity: [f64; 3],
}

/// A latitude-longitude map: the middle of row 0 is +Y, `u = atan2(x, −z)/2π`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentLight {
    /// `designed` (the reference map), `interior` (shipped), or the path of an .exr or .hdr file.
    pub map: String,
    /// Factor on its radiance, above 0.
    #[serde(default = "one")]
    pub scale: f64,
    /// Turn about the y axis in degrees; positive moves what is at −Z towards +X.
    #[serde(default)]
    pub rotation: f64,
}

fn one() -> f64 {
    1.0
}

impl EnvironmentLight {
    /// A map as it is, neither scaled nor turned.
    pub fn of(map: impl Into<String>) -> Self {
        Self { map: map.into(), scale: 1.0, rotation: 0.0 }
    }
}

/// Which of a scene's lights are on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Illumination {
    /// The point lights alone.
    Point,
    /// The environment alone.
    Environment,
    /// Every light that the scene has.
    All,
}

impl Illumination {
    /// True where the point lights are on.
    pub fn has_points(self) -> bool {
        self != Self::Environment
    }

    /// True where the environment is on.
    pub fn has_environment(self) -> bool {
        self != Self::Point
    }
}

impl Scene {
    /// The reference scene (Guarnera *et al.* 2018, 3.1): a sphere on a checkerboard, a point light with inverse-square
    /// fall-off, and the designed environment map.
    pub fn reference() -> Self {
        Self {
            name: "reference".into(),
            camera: Camera { eye: [0.0, 1.5, 6.0], target: [0.0, -0.1, 0.0], up: up(), vertical_fov: 28.0 },
            spheres: vec![Sphere { centre: [0.0; 3], radius: 1.0, diffuse: None }],
            plane: Some(checkerboard(4.0)),
            point_lights: vec![PointLight { position: [-3.0, 4.0, 4.0], intensity: [60.0; 3] }],
            environment: Some(EnvironmentLight::of("designed")),
        }
    }

    /// The validation scene (5.1 and 5.2): three spheres of the same radius and different diffuse colours on a
    /// checkerboard, lit by a point light and a real HDR map that no search has seen.
    pub fn spheres() -> Self {
        let sphere =
            |x: f64, z: f64, diffuse| Sphere { centre: [x, 0.0, z], radius: 1.0, diffuse: Some(diffuse) };
        Self {
            name: "spheres".into(),
            camera: Camera { eye: [0.0, 2.6, 10.5], target: [0.0, -0.2, 0.0], up: up(), vertical_fov: 36.0 },
            spheres: vec![
                sphere(-2.15, 0.25, [0.50, 0.09, 0.06]),
                sphere(0.0, -0.5, [0.10, 0.38, 0.12]),
                sphere(2.15, 0.25, [0.08, 0.14, 0.45]),
            ],
            plane: Some(checkerboard(8.0)),
            point_lights: vec![PointLight { position: [-4.0, 5.0, 5.0], intensity: [25.0; 3] }],
            // Scaled so that a white surface on the table is just white.
            environment: Some(EnvironmentLight { scale: 0.35, ..EnvironmentLight::of("interior") }),
        }
    }

    /// A built-in scene by name, or a scene file.
    ///
    /// # Errors
    /// Where the file cannot be read, has an unknown or missing field, or describes no scene.
    pub fn load(name: &str) -> Result<Self, SceneError> {
        match name {
            "reference" => Ok(Self::reference()),
            "spheres" => Ok(Self::spheres()),
            path => Self::read(Path::new(path)),
        }
    }

    fn read(path: &Path) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
        let mut scene: Self = toml::from_str(&text).map_err(|error| SceneError::Parse {
            path: path.to_owned(),
            message: error.to_string().trim_end().to_owned(),
        })?;
        if scene.name.is_empty() {
            scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        // A map is named relative to the scene file, as any asset of a scene is.
        if let Some(environment) = &mut scene.environment {
            let beside: PathBuf = path.parent().unwrap_or(Path::new("")).join(&environment.map);
            if beside.is_file() {
                environment.map = beside.to_string_lossy().into_owned();
            }
        }
        scene.check()?;
        Ok(scene)
    }

    /// Checks every field; files are checked when they are read.
    pub fn check(&self) -> Result<(), SceneError> {
        let wrong = |field: String, value: String, expected| {
            Err(SceneError::Field { scene: self.name.clone(), field, value, expected })
        };
        let all_finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
        let is_albedo = |v: &[f64; 3]| v.iter().all(|x| (0.0..=1.0).contains(x));
        let c = &self.camera;
        if !all_finite(&c.eye) || !all_finite(&c.target) || c.eye == c.target {
            return wrong(
                "camera.target".into(),
                format!("{:?}", c.target),
                "finite and not the camera's eye",
            );
        }
        let (forward, up) = (glam::DVec3::from(c.target) - glam::DVec3::from(c.eye), glam::DVec3::from(c.up));
        if !all_finite(&c.up) || forward.cross(up).length() <= 1e-9 * forward.length() {
            return wrong("camera.up".into(), format!("{:?}", c.up), "a direction across the line of sight");
        }
        if !(c.vertical_fov > 0.0 && c.vertical_fov < 180.0) {
            return wrong(
                "camera.vertical_fov".into(),
                c.vertical_fov.to_string(),
                "degrees above 0 and below 180",
            );
        }
        if self.spheres.is_empty() {
            return wrong("sphere".into(), "missing".into(), "at least one [[sphere]]");
        }
        for (k, s) in self.spheres.iter().enumerate() {
            if !(s.radius > 0.0 && s.radius.is_finite() && all_finite(&s.centre)) {
                return wrong(format!("sphere[{k}].radius"), s.radius.to_string(), "metres above 0");
            }
            if s.diffuse.is_some_and(|d| !is_albedo(&d)) {
                return wrong(
                    format!("sphere[{k}].diffuse"),
                    format!("{:?}", s.diffuse),
                    "three numbers in [0, 1]",
                );
            }
        }
        if let Some(p) = &self.plane {
            if !(p.half_extent > 0.0
                && p.check_size > 0.0
                && all_finite(&[p.height, p.half_extent, p.check_size]))
            {
                let sizes = format!("{} and {}", p.half_extent, p.check_size);
                return wrong("plane.half_extent and plane.check_size".into(), sizes, "metres above 0");
            }
            if !is_albedo(&p.light) || !is_albedo(&p.dark) {
                return wrong(
                    "plane.light and plane.dark".into(),
                    format!("{:?}", p.light),
                    "numbers in [0, 1]",
                );
            }
        }
        for (k, l) in self.point_lights.iter().enumerate() {
            if !all_finite(&l.position) || !l.intensity.iter().all(|i| *i >= 0.0 && i.is_finite()) {
                return wrong(
                    format!("point_light[{k}].intensity"),
                    format!("{:?}", l.intensity),
                    "W/sr, 0 or more",
                );
            }
        }
        match &self.environment {
            Some(e) if !(e.scale > 0.0 && e.scale.is_finite()) => {
                wrong("environment.scale".into(), e.scale.to_string(), "a factor above 0")
            }
            Some(e) if !e.rotation.is_finite() => {
                wrong("environment.rotation".into(), e.rotation.to_string(), "degrees")
            }
            _ => Ok(()),
        }
    }
}

/// The checkerboard of the built-in scenes, under unit spheres at height 0.
fn checkerboard(half_extent: f64) -> Plane {
    Plane { height: -1.0, half_extent, check_size: 0.5, light: [0.6; 3], dark: [0.15; 3] }
}
