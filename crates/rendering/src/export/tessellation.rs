//! Spheres and checks as triangles, for formats that have neither.
//!
//! Triangles run counter-clockwise as seen from outside. Texture coordinate u grows eastwards, along the tangent of
//! `docs/scene-format.md`, from a seam at −Z; v grows northwards. So anisotropic materials lie as in our own pictures.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::{Exported, refusal};
use crate::{Plane, SceneError, Sphere};

/// Segments around a sphere; half as many from pole to pole. The silhouette then lies within 8e-5 radii of the circle:
/// a hundredth of a pixel in a picture of 300 × 300.
pub(super) const SEGMENTS: usize = 256;
/// Checks along one side of the board at most.
const MOST_CHECKS: usize = 1000;

/// Triangles with one material.
pub(super) struct Mesh {
    pub(super) name: String,
    pub(super) material: String,
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) normals: Vec<[f64; 3]>,
    pub(super) texture: Vec<[f64; 2]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn empty(name: &str, material: &str) -> Self {
        let (name, material) = (name.to_owned(), material.to_owned());
        Self {
            name,
            material,
            positions: Vec::new(),
            normals: Vec::new(),
            texture: Vec::new(),
            triangles: Vec::new(),
        }
    }

    fn vertex(&mut self, position: [f64; 3], normal: [f64; 3], texture: [f64; 2]) {
        self.positions.push(position);
        self.normals.push(normal);
        self.texture.push(texture);
    }

    /// The corners of the box that holds it.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        let positions = || self.positions.iter().copied().map(DVec3::from);
        [positions().fold(DVec3::INFINITY, DVec3::min), positions().fold(DVec3::NEG_INFINITY, DVec3::max)]
    }
}

/// Everything in a scene: its spheres, then the light checks, then the dark ones.
pub(super) fn meshes(exported: &Exported) -> Result<Vec<Mesh>, SceneError> {
    let subjects = exported.subjects();
    let mut meshes: Vec<Mesh> = subjects
        .iter()
        .enumerate()
        .map(|(k, subject)| sphere(subject.sphere, &format!("sphere{}", k + 1), &subject.material))
        .collect();
    if let Some(plane) = &exported.scene.plane {
        let too_many = || refusal(exported.scene, "the checkerboard has too many checks to be written");
        meshes.extend(checks(plane).ok_or_else(too_many)?);
    }
    Ok(meshes)
}

/// A sphere with smooth normals. Each pole has a vertex per triangle, so that u is right in its middle.
fn sphere(sphere: &Sphere, name: &str, material: &str) -> Mesh {
    let (rows, columns) = (SEGMENTS / 2, SEGMENTS);
    let mut mesh = Mesh::empty(name, material);
    for row in 0..=rows {
        let is_pole = row == 0 || row == rows;
        for column in 0..=columns {
            let u = (column as f64 + if is_pole { 0.5 } else { 0.0 }) / columns as f64;
            let v = row as f64 / rows as f64;
            let normal = direction(u, v);
            let position = DVec3::from(sphere.centre) + sphere.radius * normal;
            mesh.vertex(position.into(), normal.into(), [u, v]);
        }
    }
    let vertex = |row: usize, column: usize| (row * (columns + 1) + column) as u32;
    for row in 0..rows {
        for column in 0..columns {
            let [west, east] = [column, column + 1];
            let [a, b, c, d] =
                [vertex(row, west), vertex(row, east), vertex(row + 1, east), vertex(row + 1, west)];
            if row > 0 {
                mesh.triangles.push([a, b, if row + 1 == rows { d } else { c }]);
            }
            if row + 1 < rows {
                mesh.triangles.push([a, c, d]);
            }
        }
    }
    mesh
}

/// The direction at texture coordinates: v from the south pole to the north pole, u eastwards from −Z.
fn direction(u: f64, v: f64) -> DVec3 {
    let (longitude, latitude) = (TAU * (u - 0.5), PI * (v - 0.5));
    // Exactly on the axis, so that poles are points.
    let ring = if v == 0.0 || v == 1.0 { 0.0 } else { latitude.cos() };
    DVec3::new(ring * longitude.sin(), latitude.sin(), ring * longitude.cos())
}

/// The light and the dark checks, those at the edge cut where the board ends; `None` for too many.
fn checks(plane: &Plane) -> Option<[Mesh; 2]> {
    let lines = lines(plane)?;
    let mut meshes = [Mesh::empty("checks_light", "light"), Mesh::empty("checks_dark", "dark")];
    for x in lines.windows(2) {
        for z in lines.windows(2) {
            let check = |side: &[f64]| ((side[0] + side[1]) / 2.0 / plane.check_size).floor() as i64;
            let mesh = &mut meshes[(check(x) + check(z)).rem_euclid(2) as usize];
            let first = mesh.positions.len() as u32;
            for (x, z, texture) in [
                (x[0], z[1], [0.0, 0.0]),
                (x[1], z[1], [1.0, 0.0]),
                (x[1], z[0], [1.0, 1.0]),
                (x[0], z[0], [0.0, 1.0]),
            ] {
                mesh.vertex([x, plane.height, z], [0.0, 1.0, 0.0], texture);
            }
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    Some(meshes)
}

/// Where checks begin and end along one axis.
fn lines(plane: &Plane) -> Option<Vec<f64>> {
    // A line within rounding of the edge is the edge.
    let last = (plane.half_extent / plane.check_size * (1.0 - 1e-9)).floor();
    if last > MOST_CHECKS as f64 / 2.0 {
        return None;
    }
    let inner = (-(last as i64)..=last as i64).map(|k| k as f64 * plane.check_size);
    Some([-plane.half_extent].into_iter().chain(inner).chain([plane.half_extent]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    /// Twice the area of a triangle, as a vector along its outside.
    fn area(mesh: &Mesh, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|i| DVec3::from(mesh.positions[i as usize]));
        (b - a).cross(c - a)
    }

    fn total(mesh: &Mesh) -> f64 {
        mesh.triangles.iter().map(|t| area(mesh, *t).length() / 2.0).sum()
    }

    #[test]
    fn a_sphere_is_closed_and_faces_outwards() {
        let ball = Sphere { centre: [1.0, -2.0, 3.0], radius: 2.0, diffuse: None };
        let mesh = sphere(&ball, "s", "m");
        let quads = SEGMENTS * (SEGMENTS / 2 - 2);
        assert_eq!(mesh.triangles.len(), 2 * quads + 2 * SEGMENTS);
        let mut volume = 0.0;
        for triangle in &mesh.triangles {
            let normal = area(&mesh, *triangle);
            let [a, ..] = triangle.map(|i| DVec3::from(mesh.positions[i as usize]));
            assert!(normal.length() > 0.0, "a triangle without an area");
            assert!(normal.dot(a - DVec3::from(ball.centre)) > 0.0, "it faces inwards");
            volume += normal.dot(a - DVec3::from(ball.centre)) / 6.0;
        }
        let exact = 4.0 / 3.0 * PI * 8.0;
        assert!((0.999..1.0).contains(&(volume / exact)), "{volume}");
        assert_eq!(mesh.bounds()[1].y, 0.0);
    }

    #[test]
    fn texture_coordinates_grow_along_tangent_and_bitangent() {
        let ball = Sphere { centre: [0.0; 3], radius: 1.0, diffuse: None };
        let mesh = sphere(&ball, "s", "m");
        for triangle in mesh.triangles.iter().skip(SEGMENTS).take(4 * SEGMENTS) {
            let [p, q, r] = triangle.map(|i| DVec3::from(mesh.positions[i as usize]));
            let [a, b, c] = triangle.map(|i| glam::DVec2::from(mesh.texture[i as usize]));
            let (du, dv) = (b - a, c - a);
            let tangent = (q - p) * dv.y - (r - p) * du.y;
            let east = DVec3::Y.cross(mesh.normals[triangle[0] as usize].into());
            assert!(tangent.dot(east) * du.perp_dot(dv) > 0.0);
        }
    }

    #[test]
    fn the_checks_areas_are_those_of_the_board() {
        let board = Scene::reference().plane.unwrap();
        let [light, dark] = checks(&board).unwrap();
        assert_eq!((light.triangles.len(), dark.triangles.len()), (256, 256));
        assert!((total(&light) - 32.0).abs() < 1e-12 && (total(&dark) - 32.0).abs() < 1e-12);
        // The check at 0 < x, z < check_size is light, and every triangle is of the albedo of its middle.
        for (mesh, albedo) in [(&light, board.light), (&dark, board.dark)] {
            for triangle in &mesh.triangles {
                let middle =
                    triangle.map(|i| DVec3::from(mesh.positions[i as usize])).iter().sum::<DVec3>() / 3.0;
                assert_eq!(board.albedo(middle), albedo);
                assert!(area(mesh, *triangle).y > 0.0);
            }
        }
    }

    #[test]
    fn checks_at_the_edge_are_cut() {
        let board = Plane { half_extent: 1.3, check_size: 0.5, ..Scene::reference().plane.unwrap() };
        let meshes = checks(&board).unwrap();
        let area: f64 = meshes.iter().map(total).sum();
        assert!((area - 2.6 * 2.6).abs() < 1e-12, "{area}");
        assert_eq!(meshes.iter().map(|m| m.triangles.len()).sum::<usize>(), 2 * 36);
        let bounds = meshes[0].bounds();
        assert_eq!((bounds[0].x, bounds[1].z), (-1.3, 1.3));
        assert!(checks(&Plane { check_size: 1e-4, ..board }).is_none());
    }
}
