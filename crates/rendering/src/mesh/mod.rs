//! Triangle meshes: their files, shapes that need none, and the first triangle that a ray meets.

mod files;
mod shapes;

use std::collections::HashMap;

use glam::{DMat3, DVec2, DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{Ray, RayHit};

use crate::{Mesh, SceneError};

/// A mesh in its place in a scene.
pub(crate) struct TriangleMesh {
    /// In the order of the hierarchy's leaves, relative to `centre`.
    triangles: Vec<Triangle>,
    /// Single precision, and only of boxes: which triangle is met, and where, is decided in double precision.
    hierarchy: Bvh2,
    /// The sphere that holds all triangles.
    centre: DVec3,
    radius: f64,
}

struct Triangle {
    corner: DVec3,
    /// From the first corner to the others.
    edges: [DVec3; 2],
    /// Smooth normals at the corners, where the file has them.
    normals: Option<[DVec3; 3]>,
    /// Along growing texture coordinate u; 0 where the file has none.
    tangent: DVec3,
    /// Texture coordinates at the corners; 0 where the file has none.
    texture: [DVec2; 3],
}

/// Where a ray meets a mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshHit {
    pub(crate) distance: f64,
    pub(crate) triangle: u32,
    /// Weights of the second and third corner.
    weights: [f64; 2],
}

/// The surface about a point of a mesh; unit vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshPoint {
    /// Normal of the triangle.
    pub(crate) geometric: DVec3,
    /// Smooth normal, the triangle's where there is none.
    pub(crate) normal: DVec3,
    /// Not perpendicular to the normal, nor of unit length; 0 where there is none.
    pub(crate) tangent: DVec3,
    /// Texture coordinates, as they are in the file; 0 where there are none.
    pub(crate) texture: [f64; 2],
}

/// What a file holds: corners with what belongs to each, and triangles of them.
#[derive(Default)]
struct Soup {
    positions: Vec<DVec3>,
    /// None, or one of each corner.
    normals: Vec<DVec3>,
    /// None, or one of each corner.
    texture: Vec<[f64; 2]>,
    triangles: Vec<[usize; 3]>,
}

impl TriangleMesh {
    /// Reads or makes a mesh and puts it in its place.
    ///
    /// # Errors
    /// Where the file cannot be read, or holds no triangle with an area.
    pub(crate) fn load(mesh: &Mesh) -> Result<Self, SceneError> {
        let fault = |message| SceneError::Mesh { path: mesh.file.clone().into(), message };
        let shape = shapes::named(&mesh.file).unwrap_or_else(|| files::read(mesh.file.as_ref()));
        let mut soup = shape.map_err(fault)?;
        soup.check().map_err(fault)?;
        soup.place(mesh);
        Self::new(&soup).ok_or_else(|| fault("no triangle has an area".to_owned()))
    }

    fn new(soup: &Soup) -> Option<Self> {
        let low = soup.positions.iter().fold(DVec3::INFINITY, |a, b| a.min(*b));
        let high = soup.positions.iter().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b));
        let (centre, radius) = ((low + high) / 2.0, (high - low).length() / 2.0);
        let triangles = soup.triangles.iter().filter_map(|t| soup.triangle(*t, centre));
        let mut triangles: Vec<Option<Triangle>> = triangles.map(Some).collect();
        if triangles.is_empty() {
            return None;
        }
        let boxes: Vec<Aabb> = triangles.iter().flatten().map(|t| t.bounds(radius)).collect();
        let hierarchy = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Default::default());
        let order = hierarchy.primitive_indices.iter();
        let triangles = order.filter_map(|i| triangles[*i as usize].take()).collect();
        Some(Self { triangles, hierarchy, centre, radius })
    }

    /// The first triangle on a ray from `origin` along the unit vector `direction`, nearer than `limit`. A ray that
    /// starts on triangle `from` does not meet it again.
    pub(crate) fn first(
        &self,
        origin: DVec3,
        direction: DVec3,
        from: Option<u32>,
        limit: f64,
    ) -> Option<MeshHit> {
        // Rays start anew where they enter the sphere about the mesh: single precision suffices within.
        let to_centre = self.centre - origin;
        let along = to_centre.dot(direction);
        let axis2 = (to_centre - direction * along).length_squared();
        let half2 = self.radius * self.radius - axis2;
        let start = (along - half2.max(0.0).sqrt()).max(0.0);
        if half2 < 0.0 || start > limit || along + half2.sqrt() < 0.0 {
            return None;
        }
        let origin = direction * start - to_centre;
        let mut nearest = None;
        let mut closest = limit - start;
        let least = 1e-10 * self.radius;
        let ray = Ray::new(single(origin), single(direction), 0.0, closest as f32);
        self.hierarchy.ray_traverse(ray, &mut RayHit::none(), |_, index| {
            let hit = self.triangles[index].meet(origin, direction);
            match hit.filter(|h| h.0 > least && h.0 < closest && from != Some(index as u32)) {
                Some((distance, weights)) => {
                    closest = distance;
                    nearest = Some(MeshHit { distance: start + distance, triangle: index as u32, weights });
                    // Rounded up, so that nothing nearer is passed over.
                    (distance * (1.0 + 1e-6)) as f32
                }
                None => f32::INFINITY,
            }
        });
        nearest
    }

    /// The surface about a point.
    pub(crate) fn at(&self, hit: &MeshHit) -> MeshPoint {
        let triangle = &self.triangles[hit.triangle as usize];
        let geometric = triangle.normal();
        let [v, w] = hit.weights;
        let smooth = triangle.normals.map(|[a, b, c]| a * (1.0 - v - w) + b * v + c * w);
        let normal = smooth.and_then(DVec3::try_normalize).unwrap_or(geometric);
        let [a, b, c] = triangle.texture;
        let texture = (a * (1.0 - v - w) + b * v + c * w).to_array();
        MeshPoint { geometric, normal, tangent: triangle.tangent, texture }
    }
}

impl Triangle {
    fn normal(&self) -> DVec3 {
        self.edges[0].cross(self.edges[1]).normalize()
    }

    /// Distance along a ray, and the weights of the second and third corner (Möller & Trumbore 1997).
    fn meet(&self, origin: DVec3, direction: DVec3) -> Option<(f64, [f64; 2])> {
        let across = direction.cross(self.edges[1]);
        let inverse = self.edges[0].dot(across).recip();
        let to_origin = origin - self.corner;
        let v = to_origin.dot(across) * inverse;
        let turned = to_origin.cross(self.edges[0]);
        let w = direction.dot(turned) * inverse;
        let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0;
        inside.then(|| (self.edges[1].dot(turned) * inverse, [v, w]))
    }

    /// A box with some room for the rounding of rays and boxes to single precision.
    fn bounds(&self, radius: f64) -> Aabb {
        let corners = [self.corner, self.corner + self.edges[0], self.corner + self.edges[1]];
        let room = Vec3A::splat(4e-6 * radius as f32);
        let [a, b, c] = corners.map(single);
        Aabb::new(a.min(b).min(c) - room, a.max(b).max(c) + room)
    }
}

fn single(v: DVec3) -> Vec3A {
    v.as_vec3().into()
}

impl Soup {
    fn check(&self) -> Result<(), String> {
        let count = self.positions.len();
        if let Some(i) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(format!("vertex {i} is {}; expected three finite numbers", self.positions[i]));
        }
        if let Some(i) = self.normals.iter().position(|p| !p.is_finite()) {
            return Err(format!("normal {i} is {}; expected three finite numbers", self.normals[i]));
        }
        if let Some(i) = self.triangles.iter().flatten().find(|i| **i >= count) {
            return Err(format!("a face names vertex {i}, but there are {count} vertices (from 0)"));
        }
        if self.triangles.is_empty() {
            return Err("there are no faces; expected at least one triangle".to_owned());
        }
        Ok(())
    }

    /// With a normal at each corner: the mean over the triangles about it, weighted by area. Corners at the same place share
    /// theirs, also where the texture is cut apart.
    fn smoothed(mut self) -> Self {
        let place = |p: DVec3| p.to_array().map(f64::to_bits);
        let mut sums: HashMap<[u64; 3], DVec3> = HashMap::new();
        for corners in &self.triangles {
            let [a, b, c] = corners.map(|i| self.positions[i]);
            for p in [a, b, c] {
                *sums.entry(place(p)).or_default() += (b - a).cross(c - a);
            }
        }
        let normal = |p: &DVec3| sums.get(&place(*p)).copied().unwrap_or_default().normalize_or(DVec3::Y);
        self.normals = self.positions.iter().map(normal).collect();
        self
    }

    /// Scales, turns and moves.
    fn place(&mut self, mesh: &Mesh) {
        // Positive angles move what is at −Z towards +X, as those of an environment do.
        let rotation = DMat3::from_rotation_y(-mesh.rotation.to_radians());
        let centre = DVec3::from(mesh.centre);
        self.positions.iter_mut().for_each(|p| *p = centre + rotation * *p * mesh.scale);
        self.normals.iter_mut().for_each(|n| *n = rotation * *n);
    }

    /// `None` where it has no area.
    fn triangle(&self, corners: [usize; 3], centre: DVec3) -> Option<Triangle> {
        let [a, b, c] = corners.map(|i| self.positions[i] - centre);
        let edges = [b - a, c - a];
        edges[0].cross(edges[1]).try_normalize()?;
        let normals = (!self.normals.is_empty()).then(|| corners.map(|i| self.normals[i]));
        let texture = corners.map(|i| self.texture.get(i).copied().unwrap_or_default().into());
        Some(Triangle { corner: a, edges, normals, tangent: self.tangent(corners, edges), texture })
    }

    /// How the position changes with texture coordinate u, up to length.
    fn tangent(&self, corners: [usize; 3], edges: [DVec3; 2]) -> DVec3 {
        if self.texture.is_empty() {
            return DVec3::ZERO;
        }
        let [a, b, c] = corners.map(|i| self.texture[i]);
        let (b, c) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let area = b[0] * c[1] - c[0] * b[1];
        let tangent = (edges[0] * c[1] - edges[1] * b[1]) * area.signum();
        tangent.try_normalize().unwrap_or(DVec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles of a square, 1 m before the origin.
    fn square() -> TriangleMesh {
        let positions = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let soup = Soup {
            positions: positions.map(|(x, y)| DVec3::new(x, y, -1.0)).into(),
            texture: positions.map(|(x, y)| [x, y]).into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Soup::default()
        };
        TriangleMesh::new(&soup).unwrap()
    }

    #[test]
    fn rays_meet_the_first_triangle() {
        let mesh = square();
        let target = DVec3::new(0.3, -0.4, -1.0);
        for from in [DVec3::ZERO, target * 0.999, DVec3::new(5.0, 3.0, 900.0), DVec3::new(0.0, 0.0, -7.0)] {
            let direction = (target - from).normalize();
            let hit = mesh.first(from, direction, None, f64::INFINITY).unwrap();
            assert!((from + direction * hit.distance - target).length() < 1e-12 * (1.0 + hit.distance));
            let point = mesh.at(&hit);
            assert!((point.geometric - DVec3::Z).length() < 1e-12 && point.normal == point.geometric);
            assert!((point.tangent - DVec3::X).length() < 1e-12, "{}", point.tangent);
            assert!(mesh.first(from, direction, Some(hit.triangle), f64::INFINITY).is_none());
            assert!(mesh.first(from, direction, None, hit.distance * 0.99).is_none());
            assert!(mesh.first(from, -direction, None, f64::INFINITY).is_none());
        }
    }
}
