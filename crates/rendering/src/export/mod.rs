//! Scenes as files of other renderers, so that anybody's renderer can make the pictures that a match reads.
//!
//! Conventions: our own (`docs/scene-format.md`): Y up, metres, linear Rec. 709, intensities in W/sr, and a
//! latitude-longitude map of radiance whose middle of row 0 is +Y. Each format's file says at its top what it needs instead,
//! and does it. The map is always written as `environment.exr`, with the scene's scale in its texels and without its
//! rotation, which would blur it: where a format has a rotation it is set there, and `README.txt` names it where not.
//!
//! Adding a format takes a file and a line in [`EXPORT_FORMATS`].

mod blender;
mod gltf;
mod mitsuba;
mod obj;
mod readme;
mod tessellation;
mod usd;

use std::path::{Path, PathBuf};

use glam::DVec3;
use lookmatch_imaging::{Image, write, write_atomically};

use crate::{Camera, EnvironmentMap, Illumination, Scene, SceneError, Sphere};

/// The map's file beside the scene.
const ENVIRONMENT: &str = "environment.exr";

/// Writes one format.
type Writer = fn(&Exported) -> Result<Vec<File>, SceneError>;

/// One format of the list.
#[derive(Clone, Copy, Debug)]
pub struct ExportFormat {
    /// What it is called.
    pub name: &'static str,
    /// One line for a list of formats.
    pub about: &'static str,
    /// What a user has to know beyond what all formats share, for `README.txt`.
    notes: fn(&Exported) -> String,
    write: Writer,
}

/// All formats.
#[rustfmt::skip] // one line per format
pub static EXPORT_FORMATS: [ExportFormat; 5] = [
    ExportFormat { name: "obj+exr", about: "triangles, camera.json, and the map: for any renderer", notes: obj::notes, write: obj::write },
    ExportFormat { name: "mitsuba", about: "Mitsuba 3: XML, and a script that renders", notes: mitsuba::notes, write: mitsuba::write },
    ExportFormat { name: "blender", about: "Blender 4.2 to 5 (Cycles): a script that builds and renders", notes: blender::notes, write: blender::write },
    ExportFormat { name: "usd", about: "UsdGeom, UsdLux and UsdPreviewSurface, as text", notes: usd::notes, write: usd::write },
    ExportFormat { name: "gltf", about: "glTF 2.0 with KHR_lights_punctual; the map lies beside it", notes: gltf::notes, write: gltf::write },
];

impl ExportFormat {
    /// The format of a name.
    pub fn by_name(name: &str) -> Option<&'static Self> {
        EXPORT_FORMATS.iter().find(|format| format.name == name)
    }
}

/// A scene about to be written.
struct Exported<'a> {
    scene: &'a Scene,
    /// Side of the pictures in pixels.
    size: usize,
    /// The environment's rotation in degrees.
    rotation: f64,
}

/// A file of a format: name and content.
struct File {
    name: &'static str,
    content: Vec<u8>,
}

impl File {
    fn new(name: &'static str, content: impl Into<Vec<u8>>) -> Self {
        Self { name, content: content.into() }
    }
}

/// Writes a scene for another renderer into a folder, which is made if it does not exist: the format's own files, the
/// environment map, and a `README.txt` that says what to render. Returns the files that were written.
///
/// # Errors
/// A scene without both kinds of light, with meshes, or with more checks than can be written; a map that cannot be read; a
/// folder or file that cannot be written.
pub fn export(
    scene: &Scene,
    format: &ExportFormat,
    size: usize,
    folder: &Path,
) -> Result<Vec<PathBuf>, SceneError> {
    scene.check_picture(Illumination::Point, size)?;
    scene.check_picture(Illumination::Environment, size)?;
    if !scene.meshes.is_empty() {
        return Err(refusal(scene, "meshes are not exported: give the renderer their own files"));
    }
    let rotation = scene.environment.as_ref().map_or(0.0, |light| light.rotation);
    let exported = Exported { scene, size, rotation };
    let mut files = (format.write)(&exported)?;
    files.push(File::new("README.txt", readme::text(format, &exported)));
    let map = environment(scene)?;

    let unwritable = |path: &Path| {
        let path = path.to_owned();
        |source| SceneError::Write { path, source }
    };
    std::fs::create_dir_all(folder).map_err(unwritable(folder))?;
    let mut paths = Vec::new();
    for file in &files {
        let path = folder.join(file.name);
        write_atomically(&path, |out| out.write_all(&file.content)).map_err(unwritable(&path))?;
        paths.push(path);
    }
    let path = folder.join(ENVIRONMENT);
    write(&path, &map, &[])?;
    paths.push(path);
    Ok(paths)
}

fn refusal(scene: &Scene, message: &str) -> SceneError {
    SceneError::Export { scene: scene.name.clone(), message: message.to_owned() }
}

/// The scene's map as it gives light: scaled, and without the negative values that count as 0.
fn environment(scene: &Scene) -> Result<Image, SceneError> {
    let Some(light) = &scene.environment else {
        return Err(SceneError::NoLight { scene: scene.name.clone(), light: "environment" });
    };
    let mut image = crate::environment::decode_image(light, &EnvironmentMap::content(light)?)?;
    for pixel in image.pixels_mut() {
        *pixel = pixel.map(|v| v.max(0.0) * light.scale as f32);
    }
    Ok(image)
}

impl Exported<'_> {
    fn camera(&self) -> &Camera {
        &self.scene.camera
    }

    /// Right, up and backward unit vectors of the camera: the columns of its rotation where it looks along −Z.
    fn camera_axes(&self) -> [DVec3; 3] {
        let camera = self.camera();
        let forward = (DVec3::from(camera.target) - DVec3::from(camera.eye)).normalize();
        let right = forward.cross(camera.up.into()).normalize();
        [right, right.cross(forward), -forward]
    }

    /// The camera's matrix from its own coordinates to the world's, column by column.
    fn camera_to_world(&self) -> [[f64; 4]; 4] {
        let [x, y, z] = self.camera_axes().map(|axis| axis.extend(0.0).to_array());
        [x, y, z, DVec3::from(self.camera().eye).extend(1.0).to_array()]
    }

    /// Focal length over the height of the film.
    fn focal_length(&self) -> f64 {
        0.5 / (self.camera().vertical_fov.to_radians() / 2.0).tan()
    }

    /// The spheres with the names of their materials: one for all, or one for each colour that the scene sets.
    fn subjects(&self) -> Vec<Subject<'_>> {
        let subject = |(k, sphere): (usize, &'_ Sphere)| match sphere.diffuse {
            None => "subject".to_owned(),
            Some(_) => format!("subject{}", k + 1),
        };
        let spheres = self.scene.spheres.iter().enumerate();
        let names: Vec<String> = spheres.map(subject).collect();
        names
            .into_iter()
            .zip(&self.scene.spheres)
            .map(|(material, sphere)| Subject { material, sphere })
            .collect()
    }

    /// Materials of the subjects, each once, with the colour of their body until the user gives them another.
    fn subject_materials(&self) -> Vec<(String, [f64; 3])> {
        let mut materials: Vec<(String, [f64; 3])> = Vec::new();
        for Subject { material, sphere } in self.subjects() {
            if materials.iter().all(|(known, _)| *known != material) {
                materials.push((material, sphere.diffuse.unwrap_or([0.5; 3])));
            }
        }
        materials
    }
}

/// A sphere and the name of its material.
struct Subject<'a> {
    material: String,
    sphere: &'a Sphere,
}

/// A colour of largest channel 1, and the factor that it is short of: how most formats want a light's.
fn hue_and_strength(intensity: [f64; 3]) -> ([f64; 3], f64) {
    let strength = intensity.into_iter().fold(0.0, f64::max);
    (lookmatch_materials::hue(intensity), strength)
}

/// Numbers with spaces between them.
fn spaced(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

/// Numbers with commas between them.
fn listed(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EnvironmentLight, Mesh};

    #[test]
    fn every_format_has_its_files_a_map_and_a_readme() {
        for format in &EXPORT_FORMATS {
            let folder = tempfile::tempdir().unwrap();
            let folder = folder.path().join("new/folder");
            let mut scene = Scene::reference();
            scene.environment =
                Some(EnvironmentLight { scale: 2.0, rotation: 45.0, ..EnvironmentLight::of("designed") });
            let paths = export(&scene, format, 96, &folder).unwrap();
            assert!(paths.len() >= 3 && paths.iter().all(|p| p.is_file()), "{paths:?}");
            let map = lookmatch_imaging::read(&folder.join(ENVIRONMENT)).unwrap();
            assert_eq!(map.get(0, 0), [5.0; 3], "scaled, not turned");
            let readme = std::fs::read_to_string(folder.join("README.txt")).unwrap();
            for word in
                ["96 x 96", "full_point.exr", "diffuse_environment.exr", "W/sr", "subject", "45", "match"]
            {
                assert!(readme.contains(word), "{}: no {word} in\n{readme}", format.name);
            }
        }
    }

    #[test]
    fn what_cannot_be_exported_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |scene: &Scene, folder: &Path| {
            let format = ExportFormat::by_name("mitsuba").unwrap();
            export(scene, format, 64, folder).unwrap_err().to_string()
        };
        let mut scene = Scene::reference();
        let mesh = Mesh { file: "a.obj".into(), centre: [0.0; 3], scale: 1.0, rotation: 0.0, diffuse: None };
        scene.meshes.push(mesh);
        assert!(refused(&scene, folder.path()).contains("meshes"));
        let dark = Scene { point_lights: Vec::new(), ..Scene::reference() };
        assert!(refused(&dark, folder.path()).contains("no point light"));
        let occupied = folder.path().join("file");
        std::fs::write(&occupied, "").unwrap();
        assert!(refused(&Scene::reference(), &occupied).contains("cannot write"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing was left behind");
        assert!(ExportFormat::by_name("pov").is_none());
    }
}
