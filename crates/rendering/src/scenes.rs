//! The scenes that need no file.

use crate::environment::BALANCE;
use crate::scene::up;
use crate::{Camera, EnvironmentLight, Mesh, Plane, PointLight, Scene, Sphere};

/// A name and what it makes.
type BuiltIn = (&'static str, fn() -> Scene);

/// Scenes by name.
pub(crate) const BUILT_IN: [BuiltIn; 6] = [
    ("reference", Scene::reference),
    ("spheres", Scene::spheres),
    ("blobs", Scene::blobs),
    ("checker-wall", Scene::checker_wall),
    ("spot", Scene::spot),
    ("shader-ball", Scene::shader_ball),
];

/// The names of [`BUILT_IN`], for messages.
pub(crate) fn names() -> String {
    BUILT_IN.map(|(name, _)| name).join(", ")
}

impl Scene {
    /// The reference scene (Guarnera *et al.* 2018, 3.1): a sphere on a checkerboard, a point light with inverse-square
    /// fall-off, and the designed environment map.
    pub fn reference() -> Self {
        Self {
            name: "reference".into(),
            camera: Camera { eye: [0.0, 1.5, 6.0], target: [0.0, -0.1, 0.0], up: up(), vertical_fov: 28.0 },
            spheres: vec![Sphere { centre: [0.0; 3], radius: 1.0, diffuse: None }],
            meshes: Vec::new(),
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
            camera: Camera { eye: [0.0, 2.3, 9.0], target: [0.0, -0.1, 0.0], up: up(), vertical_fov: 40.0 },
            spheres: vec![
                sphere(-2.1, 0.0, [0.50, 0.09, 0.06]),
                sphere(0.0, 0.0, [0.10, 0.38, 0.12]),
                sphere(2.1, 0.0, [0.08, 0.14, 0.45]),
            ],
            meshes: Vec::new(),
            plane: Some(checkerboard(8.0)),
            point_lights: vec![PointLight { position: [-4.0, 5.0, 5.0], intensity: [25.0; 3] }],
            environment: Some(EnvironmentLight { scale: BALANCE.1, ..EnvironmentLight::of(BALANCE.0) }),
        }
    }

    /// Three uneven bodies on a checkerboard, for the path renderer: shapes of many curvatures tell reflectances apart better
    /// than spheres do (Vangorp *et al.* 2007).
    pub fn blobs() -> Self {
        let blob = |seed: u32, x: f64, y: f64| mesh(&format!("blob:{seed}"), [x, y, 0.0], 0.85);
        // As high as lets them rest on the board.
        let meshes = vec![blob(1, -2.1, -0.158), blob(12, 0.0, -0.069), blob(7, 2.1, 0.042)];
        Self { meshes, name: "blobs".into(), spheres: Vec::new(), ..Self::spheres() }
    }

    /// A wall that faces the camera, for the path renderer: by its texture coordinates it wears a chart of materials.
    pub fn checker_wall() -> Self {
        Self {
            name: "checker-wall".into(),
            camera: Camera { eye: [0.0, 0.0, 6.0], target: [0.0; 3], up: up(), vertical_fov: 36.0 },
            meshes: vec![mesh("square", [0.0; 3], 3.6)],
            plane: None,
            // Soft light from all around, of about the same colour everywhere.
            environment: Some(EnvironmentLight { scale: 2.9, ..EnvironmentLight::of("studio") }),
            ..Self::blobs()
        }
    }

    /// A cow on a checkerboard, for the path renderer.
    pub fn spot() -> Self {
        Self {
            name: "spot".into(),
            camera: Camera { eye: [0.0, 1.2, 6.0], target: [0.0, 0.0, 0.0], up: up(), vertical_fov: 28.0 },
            meshes: vec![Mesh { rotation: 130.0, ..mesh("spot", [0.0, 0.03, 0.0], 1.4) }],
            ..Self::blobs()
        }
    }

    /// The standard shader ball on a checkerboard, for the path renderer.
    pub fn shader_ball() -> Self {
        Self {
            name: "shader-ball".into(),
            camera: Camera { eye: [1.2, 2.6, 6.0], target: [0.0, 0.15, 0.0], up: up(), vertical_fov: 28.0 },
            meshes: vec![mesh("shader-ball", [0.0, -1.115, 0.0], 0.3)],
            ..Self::blobs()
        }
    }
}

fn mesh(file: &str, centre: [f64; 3], scale: f64) -> Mesh {
    Mesh { file: file.into(), centre, scale, rotation: 0.0, diffuse: None }
}

/// The checkerboard of the built-in scenes, under unit spheres at height 0.
fn checkerboard(half_extent: f64) -> Plane {
    Plane { height: -1.0, half_extent, check_size: 0.5, light: [0.6; 3], dark: [0.15; 3] }
}
