//! The radiance that arrives at any point from any direction, with the subjects' own highlights left out.

use std::f32::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use crate::angles::{map_direction, map_position};
use crate::arcs;
use crate::bodies::{Bodies, Body};
use crate::environment::EnvironmentMap;
use crate::irradiance::{Place, from_point};
use crate::plane::Board;
use crate::pyramid::Pyramid;
use crate::scene::{Illumination, Scene};
use crate::{Rgb, SceneError, rgb};

/// Rows of the texture of a sphere's diffuse radiance.
const SPHERE_ROWS: usize = 48;

/// All light of a scene under one illumination.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) bodies: Bodies,
    pub(crate) points: Vec<(DVec3, Rgb)>,
    pub(crate) environment: Option<EnvironmentMap>,
    pub(crate) board: Option<Board>,
    /// Diffuse radiance of the spheres that have a colour of their own, by direction from the centre.
    spheres: Vec<Option<Pyramid>>,
}

impl Field {
    /// Lights every body of the scene: directly, then once more by the light that the other bodies throw back. `map` is the
    /// content of its environment map.
    pub(crate) fn bake(scene: &Scene, illumination: Illumination, map: &[u8]) -> Result<Self, SceneError> {
        let environment = match &scene.environment {
            Some(light) if illumination.has_environment() => Some(EnvironmentMap::decode(light, map)?),
            _ => None,
        };
        let points = match illumination.has_points() {
            true => scene.point_lights.iter().map(|l| (l.position.into(), rgb(l.intensity))).collect(),
            false => Vec::new(),
        };
        let spheres = vec![None; scene.spheres.len()];
        let dark = Self { bodies: Bodies::new(scene), points, environment, board: None, spheres };
        let direct = dark.lit(scene);
        let has_bounce = scene.spheres.iter().any(|s| s.diffuse.is_some());
        Ok(if has_bounce { direct.lit(scene) } else { direct })
    }

    /// The same scene with bodies that reflect what arrives in this field.
    fn lit(&self, scene: &Scene) -> Self {
        let sharp = |place: &Place| self.point_irradiance(place);
        let board = scene.plane.as_ref().map(|plane| {
            let place = |p| Place { position: p, normal: DVec3::Y, body: Body::Plane };
            Board::new(plane, |p| self.smooth_irradiance(&place(p)), |p| sharp(&place(p)))
        });
        let texture = |(k, sphere): (usize, &crate::Sphere)| {
            let albedo = rgb(sphere.diffuse?);
            Some(self.sphere_texture(k, albedo, |place| self.smooth_irradiance(place) + sharp(place)))
        };
        let spheres = scene.spheres.iter().enumerate().map(texture).collect();
        Self { board, spheres, ..self.clone() }
    }

    /// Irradiance from the point lights alone.
    pub(crate) fn point_irradiance(&self, place: &Place) -> Rgb {
        self.points.iter().map(|light| from_point(&self.bodies, *light, place)).sum()
    }

    /// Irradiance from everything but the point lights.
    pub(crate) fn smooth_irradiance(&self, place: &Place) -> Rgb {
        let sky = self.environment.as_ref().map_or(Rgb::ZERO, |e| e.lights.irradiance(&self.bodies, place));
        if self.board.is_none() && self.spheres.iter().all(Option::is_none) {
            return sky;
        }
        let [r, g, b, _] = arcs::from_bodies(self, place);
        sky + Rgb::new(r, g, b, 0.0)
    }

    /// Radiance that arrives at a place from a unit direction, averaged over about `angle` radians. Point lights have
    /// no extent and are never met; the environment's lamps are left to [`Field::lamps`].
    pub(crate) fn incident(&self, place: &Place, direction: DVec3, angle: f64) -> Rgb {
        self.body_radiance(place, direction, angle).unwrap_or_else(|| {
            self.environment.as_ref().map_or(Rgb::ZERO, |e| e.dimmed_radiance(direction, angle))
        })
    }

    /// The environment's lamps: direction and irradiance on a surface that faces them.
    pub(crate) fn all_lamps(&self) -> &[(DVec3, Rgb)] {
        self.environment.as_ref().map_or(&[], |e| &e.lamps)
    }

    /// The lamps that are seen from a place.
    pub(crate) fn lamps(&self, place: Place) -> impl Iterator<Item = (DVec3, Rgb)> {
        self.all_lamps().iter().copied().filter(move |(direction, _)| self.sees(&place, *direction))
    }

    /// True where no body hides a direction from a place.
    pub(crate) fn sees(&self, place: &Place, direction: DVec3) -> bool {
        direction.dot(place.normal) > 0.0
            && self.bodies.first(place.position, direction, Some(place.body)).is_none()
    }

    /// Radiance of the body that is met in a direction; `None` where there is none.
    pub(crate) fn body_radiance(&self, place: &Place, direction: DVec3, angle: f64) -> Option<Rgb> {
        let (distance, body) = self.bodies.first(place.position, direction, Some(place.body))?;
        let point = place.position + direction * distance;
        Some(match body {
            Body::Plane => {
                // The footprint is stretched along the ray at grazing angles; a square of equal area stands for it.
                let width = angle * distance / direction.y.abs().sqrt().max(0.05);
                self.board.as_ref().map_or(Rgb::ZERO, |b| b.radiance_over(point, width))
            }
            Body::Sphere(k) => self.spheres[k].as_ref().map_or(Rgb::ZERO, |texture| {
                let (u, v) = map_position(self.bodies.normal(k, point));
                texture.sample(u, v, 1.0)
            }),
        })
    }

    /// Where a ray meets the checkerboard, and the luminance of its albedo over π averaged over about `angle` radians.
    pub(crate) fn board_at(&self, place: &Place, direction: DVec3, angle: f64) -> Option<(f32, f32, f32)> {
        let (distance, body) = self.bodies.first(place.position, direction, Some(place.body))?;
        let board = self.board.as_ref().filter(|_| body == Body::Plane)?;
        let width = angle * distance / direction.y.abs().sqrt().max(0.05);
        Some(board.brightness_over(place.position + direction * distance, width))
    }

    /// The same for a ray from the camera, exactly.
    pub(crate) fn board_from(&self, eye: DVec3, direction: DVec3) -> Option<(f32, f32, f32)> {
        let (distance, body) = self.bodies.first(eye, direction, None)?;
        let board = self.board.as_ref().filter(|_| body == Body::Plane)?;
        Some(board.brightness_exactly(eye + direction * distance))
    }

    /// The same light with the environment's lamps left in its map.
    pub(crate) fn with_lamps_in_the_map(&self) -> Self {
        let mut field = self.clone();
        if let Some(environment) = &mut field.environment {
            environment.keep_lamps();
        }
        field
    }

    /// The diffuse radiance of a sphere with an albedo of 1, by direction from its centre.
    pub(crate) fn white_sphere(&self, sphere: usize) -> Pyramid {
        self.sphere_texture(sphere, Rgb::ONE, |place| {
            self.smooth_irradiance(place) + self.point_irradiance(place)
        })
    }

    /// The diffuse radiance of a sphere for an irradiance.
    fn sphere_texture(
        &self,
        sphere: usize,
        albedo: Rgb,
        irradiance: impl Fn(&Place) -> Rgb + Sync,
    ) -> Pyramid {
        let (columns, rows) = (2 * SPHERE_ROWS, SPHERE_ROWS);
        let texel = |i: usize| {
            let unit = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
            let normal = map_direction(unit(i % columns, columns), unit(i / columns, rows));
            let place =
                Place { position: self.bodies.point(sphere, normal), normal, body: Body::Sphere(sphere) };
            albedo * irradiance(&place) / PI
        };
        let texels = (0..columns * rows).into_par_iter().map(texel).collect();
        Pyramid::new(columns, rows, texels, true, |v| (std::f64::consts::PI * v).sin())
    }

    /// What the camera sees along a ray that meets no sphere.
    pub(crate) fn background(&self, eye: DVec3, direction: DVec3, angle: f64) -> Rgb {
        match (self.bodies.first(eye, direction, None), &self.board) {
            (Some((distance, Body::Plane)), Some(board)) => {
                let place =
                    Place { position: eye + direction * distance, normal: DVec3::Y, body: Body::Plane };
                board.exact(place.position, self.point_irradiance(&place))
            }
            _ => self.environment.as_ref().map_or(Rgb::ZERO, |e| e.radiance(direction, angle)),
        }
    }
}
