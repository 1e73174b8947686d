//! Everything that a path can meet: spheres, meshes, the checkerboard.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::wardrobe::Spot;
use crate::SceneError;
use crate::bodies::{Bodies, Body};
use crate::mesh::{MeshHit, TriangleMesh};
use crate::scene::{Plane, Scene};

/// The bodies of a scene.
pub(super) struct World {
    bodies: Bodies,
    meshes: Vec<TriangleMesh>,
    plane: Option<Plane>,
    /// Centre and radius of each sphere.
    pub(super) spheres: Vec<(DVec3, f64)>,
    /// Diffuse reflectances that replace the material's.
    sphere_diffuse: Vec<Option<DVec3>>,
    mesh_diffuse: Vec<Option<DVec3>>,
}

/// What a point lies on. Rays that start there do not meet it again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Surface {
    Sphere(usize),
    Plane,
    /// Mesh and triangle.
    Mesh(usize, u32),
}

/// A point that a ray meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encounter {
    pub(super) position: DVec3,
    pub(super) surface: Surface,
    /// Tangent, bitangent and normal for shading.
    pub(super) frame: [DVec3; 3],
    /// Normal of the surface itself: nothing that lies below it gives light.
    pub(super) geometric: DVec3,
    /// Texture coordinates of a mesh; those of spheres are worked out where they are asked for.
    texture: [f64; 2],
}

impl World {
    pub(super) fn new(scene: &Scene) -> Result<Self, SceneError> {
        Ok(Self {
            bodies: Bodies::new(scene),
            meshes: scene.meshes.iter().map(TriangleMesh::load).collect::<Result<_, _>>()?,
            plane: scene.plane.clone(),
            spheres: scene.spheres.iter().map(|s| (s.centre.into(), s.radius)).collect(),
            sphere_diffuse: scene.spheres.iter().map(|s| s.diffuse.map(DVec3::from)).collect(),
            mesh_diffuse: scene.meshes.iter().map(|m| m.diffuse.map(DVec3::from)).collect(),
        })
    }

    /// The first point on a ray from `origin` along the unit vector `direction`.
    pub(super) fn first(&self, origin: DVec3, direction: DVec3, from: Option<Surface>) -> Option<Encounter> {
        let body = self.bodies.first(origin, direction, from.and_then(Surface::body));
        let mut closest = body.map_or(f64::INFINITY, |(distance, _)| distance);
        let mut met = None;
        for (k, mesh) in self.meshes.iter().enumerate() {
            if let Some(hit) = mesh.first(origin, direction, triangle(from, k), closest) {
                closest = hit.distance;
                met = Some((k, hit));
            }
        }
        let position = origin + direction * closest;
        match (met, body) {
            (Some((k, hit)), _) => Some(self.on_mesh((k, hit), position, direction)),
            (None, Some((_, Body::Sphere(k)))) => {
                let normal = self.bodies.normal(k, position);
                let frame = frame(normal, DVec3::ZERO);
                let surface = Surface::Sphere(k);
                Some(Encounter { position, surface, frame, geometric: normal, texture: [0.0; 2] })
            }
            (None, Some((_, Body::Plane))) => {
                // It is lit from above, also where it is seen from below.
                let frame = [DVec3::Z, DVec3::X, DVec3::Y];
                let surface = Surface::Plane;
                Some(Encounter { position, surface, frame, geometric: DVec3::Y, texture: [0.0; 2] })
            }
            (None, None) => None,
        }
    }

    /// True where something lies between a point and what is `distance` away in the direction of a unit vector.
    pub(super) fn hides(&self, origin: DVec3, direction: DVec3, from: Surface, distance: f64) -> bool {
        let body = self.bodies.first(origin, direction, from.body());
        body.is_some_and(|(t, _)| t < distance)
            || (self.meshes.iter().enumerate())
                .any(|(k, m)| m.first(origin, direction, triangle(Some(from), k), distance).is_some())
    }

    /// Diffuse reflectance at a point of a body that wears a material with a given one.
    pub(super) fn diffuse(&self, encounter: &Encounter, material: DVec3) -> DVec3 {
        match encounter.surface {
            Surface::Sphere(k) => self.sphere_diffuse[k].unwrap_or(material),
            Surface::Mesh(k, _) => self.mesh_diffuse[k].unwrap_or(material),
            Surface::Plane => {
                self.plane.as_ref().map_or(DVec3::ZERO, |p| p.albedo(encounter.position).into())
            }
        }
    }

    /// The spot of a subject that a point lies on; `None` on the checkerboard.
    pub(super) fn spot(&self, encounter: &Encounter) -> Option<Spot> {
        let (subject, [u, v]) = match encounter.surface {
            Surface::Sphere(k) => (k, sphere_texture(encounter.geometric)),
            Surface::Mesh(k, _) => (self.spheres.len() + k, encounter.texture),
            Surface::Plane => return None,
        };
        Some(Spot { subject, texture: [wrapped(u), wrapped(v)] })
    }

    /// Both sides of a mesh are surfaces: normals are turned towards where the ray comes from.
    fn on_mesh(&self, (k, hit): (usize, MeshHit), position: DVec3, direction: DVec3) -> Encounter {
        let point = self.meshes[k].at(&hit);
        let side = -direction.dot(point.geometric).signum();
        let geometric = point.geometric * side;
        let smooth = point.normal * point.normal.dot(geometric).signum();
        // A smooth normal that is seen from behind, as happens along silhouettes, would be black.
        let normal = if smooth.dot(direction) < 0.0 { smooth } else { geometric };
        let frame = frame(normal, point.tangent);
        let surface = Surface::Mesh(k, hit.triangle);
        Encounter { position, surface, frame, geometric, texture: point.texture }
    }
}

impl Surface {
    fn body(self) -> Option<Body> {
        match self {
            Self::Sphere(k) => Some(Body::Sphere(k)),
            Self::Plane => Some(Body::Plane),
            Self::Mesh(..) => None,
        }
    }
}

/// The triangle of mesh `k` that a ray starts on.
fn triangle(from: Option<Surface>, k: usize) -> Option<u32> {
    match from {
        Some(Surface::Mesh(mesh, triangle)) if mesh == k => Some(triangle),
        _ => None,
    }
}

/// A right-handed frame about a normal with its tangent near a given one, else eastwards.
fn frame(normal: DVec3, tangent: DVec3) -> [DVec3; 3] {
    let across = |t: DVec3| (t - normal * t.dot(normal)).try_normalize();
    let tangent = across(tangent).or_else(|| across(DVec3::Y.cross(normal))).unwrap_or(DVec3::X);
    [tangent, normal.cross(tangent), normal]
}

/// As [`Spot::texture`] says.
fn sphere_texture(normal: DVec3) -> [f64; 2] {
    [(-normal.x).atan2(-normal.z) / TAU, 1.0 - normal.y.clamp(-1.0, 1.0).acos() / PI]
}

/// Repeats a texture; the remainder of something just below 0 rounds to 1.
fn wrapped(x: f64) -> f64 {
    let rest = x.rem_euclid(1.0);
    if rest < 1.0 { rest } else { 0.0 }
}
