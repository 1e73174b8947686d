//! Scenes as data: camera, spheres and meshes, an optional checkerboard, point lights, an environment. Y is up, units are metres.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::{SceneError, scenes};

/// A scene; its TOML form is described in `docs/scene-format.md`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Name for reports; the file's own name where none is given.
    #[serde(default)]
    pub name: String,
    /// The pinhole camera.
    pub camera: Camera,
    /// Subjects: all of them wear the material that is rendered.
    #[serde(default, rename = "sphere", skip_serializing_if = "Vec::is_empty")]
    pub spheres: Vec<Sphere>,
    /// Further subjects, for the path renderer alone.
    #[serde(default, rename = "mesh", skip_serializing_if = "Vec::is_empty")]
    pub meshes: Vec<Mesh>,
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
    #[serde(deserialize_with = "vector")]
    pub eye: [f64; 3],
    /// The point in the middle of the picture.
    #[serde(deserialize_with = "vector")]
    pub target: [f64; 3],
    /// The direction that is up in the picture.
    #[serde(default = "up", deserialize_with = "vector")]
    pub up: [f64; 3],
    /// Vertical field of view in degrees, above 0 and below 180.
    pub vertical_fov: f64,
}

/// Exactly three numbers: left alone, longer arrays would be cut without a word.
fn vector<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<[f64; 3], D::Error> {
    let numbers = Vec::<f64>::deserialize(deserializer)?;
    let count = numbers.len();
    numbers.try_into().map_err(|_| serde::de::Error::invalid_length(count, &"three numbers"))
}

#[derive(Deserialize)]
struct Vector(#[serde(deserialize_with = "vector")] [f64; 3]);

fn optional_vector<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<[f64; 3]>, D::Error> {
    let Some(Vector(v)) = Option::<Vector>::deserialize(deserializer)? else { return Ok(None) };
    Ok(Some(v))
}

pub(crate) fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

/// A sphere. Its tangent runs along its parallels (eastwards), its bitangent along its meridians (northwards).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Centre, in metres.
    #[serde(deserialize_with = "vector")]
    pub centre: [f64; 3],
    /// Radius in metres, above 0.
    pub radius: f64,
    /// A diffuse reflectance of its own (linear RGB) instead of the material's, for materials that have one.
    #[serde(default, deserialize_with = "optional_vector")]
    pub diffuse: Option<[f64; 3]>,
}

/// A triangle mesh. Its tangent runs along growing texture coordinate u where the file has texture coordinates, else
/// eastwards as that of a sphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Path of an .obj or .ply file, packed (.obj.gz, .ply.gz) or not; or a shape that needs none: `blob:SEED`, `square`,
    /// `spot`, `shader-ball`.
    pub file: String,
    /// Where the origin of the file's coordinates lies, in metres.
    #[serde(deserialize_with = "vector")]
    pub centre: [f64; 3],
    /// Metres per unit of the file, above 0.
    #[serde(default = "one")]
    pub scale: f64,
    /// Turn about the y axis in degrees; positive moves what is at −Z towards +X.
    #[serde(default)]
    pub rotation: f64,
    /// A diffuse reflectance of its own (linear RGB) instead of the material's, for materials that have one.
    #[serde(default, deserialize_with = "optional_vector")]
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
    #[serde(deserialize_with = "vector")]
    pub light: [f64; 3],
    /// Albedo of the dark checks, linear RGB.
    #[serde(deserialize_with = "vector")]
    pub dark: [f64; 3],
}

/// An isotropic point light: its irradiance falls with the square of the distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointLight {
    /// Position, in metres.
    #[serde(deserialize_with = "vector")]
    pub position: [f64; 3],
    /// Radiant intensity in W/sr, linear RGB.
    #[serde(deserialize_with = "vector")]
    pub intensity: [f64; 3],
}

/// A latitude-longitude map: the middle of row 0 is +Y, `u = atan2(x, −z)/2π`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentLight {
    /// The path of an .exr or .hdr file, or one of [`EnvironmentLight::names`]: `designed` (the reference map), `interior`,
    /// `city`, `forest`, `night`, `studio`, `sunset`.
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
    /// A built-in scene by name, or a scene file.
    ///
    /// # Errors
    /// Where the file cannot be read, has an unknown or missing field, or describes no scene.
    pub fn load(name: &str) -> Result<Self, SceneError> {
        match scenes::BUILT_IN.iter().find(|(built_in, _)| *built_in == name) {
            Some((_, scene)) => Ok(scene()),
            None => Self::read(Path::new(name)),
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
        // Maps and meshes are named relative to the scene file, as any asset of a scene is.
        let maps = scene.environment.iter_mut().map(|e| &mut e.map);
        for file in maps.chain(scene.meshes.iter_mut().map(|m| &mut m.file)) {
            let beside: PathBuf = path.parent().unwrap_or(Path::new("")).join(&*file);
            if beside.is_file() {
                *file = beside.to_string_lossy().into_owned();
            }
        }
        scene.check()?;
        Ok(scene)
    }

    /// Checks every field; files are checked when they are read.
    pub fn check(&self) -> Result<(), SceneError> {
        self.faults().into_iter().find(|fault| !fault.passes).map_or(Ok(()), |fault| {
            let Fault { field, value, expected, .. } = fault;
            Err(SceneError::Field { scene: self.name.clone(), field, value, expected })
        })
    }

    /// Checks that a picture can be rendered: every field, the size in pixels, and that there is light.
    ///
    /// # Errors
    /// The first field that is wrong, or what is missing.
    pub fn check_picture(&self, illumination: Illumination, size: usize) -> Result<(), SceneError> {
        self.check()?;
        if !(1..=8192).contains(&size) {
            return Err(SceneError::Size { size });
        }
        let missing = |light| Err(SceneError::NoLight { scene: self.name.clone(), light });
        let (no_point, no_environment) = (self.point_lights.is_empty(), self.environment.is_none());
        match illumination {
            Illumination::Point if no_point => missing("point light"),
            Illumination::Environment if no_environment => missing("environment"),
            Illumination::All if no_point && no_environment => missing("light"),
            _ => Ok(()),
        }
    }

    /// Everything that could be wrong with the fields, in their order.
    fn faults(&self) -> Vec<Fault> {
        let mut faults = self.camera.faults();
        let has_subject = !(self.spheres.is_empty() && self.meshes.is_empty());
        faults.push(Fault::new("sphere", "missing", has_subject, "at least one [[sphere]] or [[mesh]]"));
        faults.extend(self.spheres.iter().enumerate().flat_map(|(k, s)| s.faults(k)));
        faults.extend(self.meshes.iter().enumerate().flat_map(|(k, m)| m.faults(k)));
        faults.extend(self.overlaps());
        faults.extend(self.plane.iter().flat_map(Plane::faults));
        faults.extend(self.point_lights.iter().enumerate().flat_map(|(k, l)| l.faults(k)));
        faults.extend(self.environment.iter().flat_map(EnvironmentLight::faults));
        faults
    }
}

impl Scene {
    /// Spheres that swallow the camera or each other: rays are traced from outside all of them.
    fn overlaps(&self) -> Vec<Fault> {
        let distance = |a: [f64; 3], b: [f64; 3]| glam::DVec3::from(a).distance(b.into());
        let mut faults = Vec::new();
        for (k, sphere) in self.spheres.iter().enumerate() {
            let field = format!("sphere[{k}].centre");
            let value = format!("{:?}", sphere.centre);
            let outside = distance(self.camera.eye, sphere.centre) > sphere.radius;
            faults.push(Fault::new(&field, &value, outside, "a place whose sphere does not hold the camera"));
            for other in &self.spheres[..k] {
                // Spheres that touch are told apart from overlapping ones by more than rounding.
                let apart =
                    distance(other.centre, sphere.centre) > (other.radius + sphere.radius) * (1.0 - 1e-9);
                faults.push(Fault::new(&field, &value, apart, "a place apart from the other spheres"));
            }
        }
        faults
    }
}

/// A possible fault: a field, its value, whether that passes, and what would.
struct Fault {
    field: String,
    value: String,
    passes: bool,
    expected: &'static str,
}

impl Fault {
    fn new(field: impl Into<String>, value: impl ToString, passes: bool, expected: &'static str) -> Self {
        Self { field: field.into(), value: value.to_string(), passes, expected }
    }

    fn point(field: impl Into<String>, v: [f64; 3]) -> Self {
        Self::new(field, format!("{v:?}"), v.iter().all(|x| x.is_finite()), "three finite numbers")
    }

    fn length(field: impl Into<String>, v: f64) -> Self {
        Self::new(field, v, v > 0.0 && v.is_finite(), "metres above 0")
    }

    fn albedo(field: impl Into<String>, v: [f64; 3]) -> Self {
        let passes = v.iter().all(|x| (0.0..=1.0).contains(x));
        Self::new(field, format!("{v:?}"), passes, "three numbers in [0, 1]")
    }
}

impl Camera {
    fn faults(&self) -> Vec<Fault> {
        let forward = glam::DVec3::from(self.target) - glam::DVec3::from(self.eye);
        let across = forward.cross(self.up.into()).length() > 1e-9 * forward.length();
        let (target, up) = (format!("{:?}", self.target), format!("{:?}", self.up));
        let has_angle = self.vertical_fov > 0.0 && self.vertical_fov < 180.0;
        vec![
            Fault::point("camera.eye", self.eye),
            Fault::point("camera.target", self.target),
            Fault::new(
                "camera.target",
                target,
                self.eye != self.target,
                "a point that is not the camera's eye",
            ),
            Fault::point("camera.up", self.up),
            Fault::new("camera.up", up, across, "a direction across the line of sight"),
            Fault::new("camera.vertical_fov", self.vertical_fov, has_angle, "degrees above 0 and below 180"),
        ]
    }
}

impl Sphere {
    fn faults(&self, k: usize) -> Vec<Fault> {
        let mut faults = vec![
            Fault::point(format!("sphere[{k}].centre"), self.centre),
            Fault::length(format!("sphere[{k}].radius"), self.radius),
        ];
        faults.extend(self.diffuse.map(|d| Fault::albedo(format!("sphere[{k}].diffuse"), d)));
        faults
    }
}

impl Mesh {
    fn faults(&self, k: usize) -> Vec<Fault> {
        let is_factor = self.scale > 0.0 && self.scale.is_finite();
        let is_angle = self.rotation.is_finite();
        let mut faults = vec![
            Fault::point(format!("mesh[{k}].centre"), self.centre),
            Fault::new(format!("mesh[{k}].scale"), self.scale, is_factor, "a factor above 0"),
            Fault::new(format!("mesh[{k}].rotation"), self.rotation, is_angle, "degrees"),
        ];
        faults.extend(self.diffuse.map(|d| Fault::albedo(format!("mesh[{k}].diffuse"), d)));
        faults
    }
}

impl Plane {
    /// Albedo of the check at a point.
    pub(crate) fn albedo(&self, point: glam::DVec3) -> [f64; 3] {
        let check = |x: f64| (x / self.check_size).floor() as i64;
        if (check(point.x) + check(point.z)).rem_euclid(2) == 0 { self.light } else { self.dark }
    }

    fn faults(&self) -> Vec<Fault> {
        vec![
            Fault::new("plane.height", self.height, self.height.is_finite(), "metres"),
            Fault::length("plane.half_extent", self.half_extent),
            Fault::length("plane.check_size", self.check_size),
            Fault::albedo("plane.light", self.light),
            Fault::albedo("plane.dark", self.dark),
        ]
    }
}

impl PointLight {
    fn faults(&self, k: usize) -> Vec<Fault> {
        let passes = self.intensity.iter().all(|i| *i >= 0.0 && i.is_finite());
        let intensity = format!("{:?}", self.intensity);
        vec![
            Fault::point(format!("point_light[{k}].position"), self.position),
            Fault::new(format!("point_light[{k}].intensity"), intensity, passes, "W/sr, 0 or more"),
        ]
    }
}

impl EnvironmentLight {
    fn faults(&self) -> Vec<Fault> {
        let is_factor = self.scale > 0.0 && self.scale.is_finite();
        vec![
            Fault::new("environment.scale", self.scale, is_factor, "a factor above 0"),
            Fault::new("environment.rotation", self.rotation, self.rotation.is_finite(), "degrees"),
        ]
    }
}
