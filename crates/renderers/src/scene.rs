//! Scenes as the protocol sends them.

use std::sync::Arc;

use lookmatch_imaging::Image;
use lookmatch_rendering::{EnvironmentMap, Illumination, Scene};
use serde_json::{Map, Value, json};

use crate::RendererError;
use crate::hello::{Hello, Light};

/// The widest map that the protocol allows.
const WIDEST_MAP: usize = 4096;

/// A scene that is ready to be sent.
#[derive(Debug)]
pub(crate) struct SceneData {
    pub(crate) name: String,
    /// Tells it from others of the same name.
    pub(crate) revision: u64,
    /// Side of its pictures in pixels.
    pub(crate) size: usize,
    /// Whether something is seen in it whatever the material: then a black picture is a fault.
    pub(crate) is_lit: bool,
    pub(crate) message: Map<String, Value>,
    /// The map's pixels.
    pub(crate) data: Arc<[u8]>,
}

impl SceneData {
    /// Prepares a scene for a renderer.
    pub(crate) fn new(
        (name, revision): (&str, u64),
        scene: &Scene,
        light: Illumination,
        size: usize,
        hello: &Hello,
    ) -> Result<Self, RendererError> {
        scene.check_picture(light, size)?;
        check_suitable(scene, light, hello).map_err(|reason| RendererError::Unsuitable {
            renderer: hello.name.clone(),
            scene: name.into(),
            reason,
        })?;
        let map = scene.environment.as_ref().filter(|_| light.has_environment());
        let map = map.map(|map| EnvironmentMap::image(map, WIDEST_MAP)).transpose()?;
        let points = if light.has_points() { scene.point_lights.as_slice() } else { &[] };
        let spheres = scene.spheres.iter().map(|s| json!({ "centre": s.centre, "radius": s.radius }));
        let message = json!({
            "scene": name,
            "size": size,
            "camera": scene.camera,
            "spheres": spheres.collect::<Vec<_>>(),
            "plane": scene.plane,
            "point_lights": points,
            "environment": map.as_ref().map(|map| json!({ "width": map.width(), "height": map.height() })),
        });
        let Value::Object(message) = message else { unreachable!("it is an object") };
        let shines = |v: &[f64; 3]| v.iter().any(|x| *x > 0.0);
        // A black ball under a point light is black by right; a checkerboard and a sky are not.
        let is_lit = map.as_ref().is_some_and(|map| map.pixels().iter().flatten().any(|v| *v > 0.0))
            || points.iter().any(|p| shines(&p.intensity))
                && scene.plane.as_ref().is_some_and(|plane| shines(&plane.light) && shines(&plane.dark));
        let data = map.map(|map| bytes(&map)).unwrap_or_default();
        Ok(Self { name: name.into(), revision, size, is_lit, message, data: data.into() })
    }
}

/// Refuses what the protocol, or this renderer, does not have.
fn check_suitable(scene: &Scene, light: Illumination, hello: &Hello) -> Result<(), String> {
    if let Some(mesh) = scene.meshes.first() {
        return Err(format!("mesh[0] is '{}'; expected spheres alone", mesh.file));
    }
    if let Some((k, diffuse)) = scene.spheres.iter().enumerate().find_map(|(k, s)| Some((k, s.diffuse?))) {
        return Err(format!(
            "sphere[{k}].diffuse is {diffuse:?}; expected no colours of their own: all spheres wear the material"
        ));
    }
    let can = |light| hello.capabilities.lights.contains(&light);
    if light.has_points() && !scene.point_lights.is_empty() && !can(Light::Point) {
        return Err("it is lit by point lights; expected an environment alone".into());
    }
    if light.has_environment() && scene.environment.is_some() && !can(Light::Environment) {
        return Err("it is lit by an environment; expected point lights alone".into());
    }
    Ok(())
}

fn bytes(image: &Image) -> Vec<u8> {
    image.pixels().iter().flatten().flat_map(|value| value.to_le_bytes()).collect()
}
