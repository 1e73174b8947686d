//! The light that the spheres throw onto the checkerboard, sampled from points of it.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::bumps::Bumps;
use super::{ANGLES, LOBE, ROW};
use crate::Rgb;
use crate::angles::{map_direction, map_position};
use crate::arcs::{self, Density, FUNCTION_TERMS, FunctionMoments};
use crate::bodies::Body;
use crate::field::Field;
use crate::film::SurfacePoint;
use crate::functions::{COUNT, Functions};
use crate::irradiance::Place;
use crate::lobe_table::LobeTable;
use crate::pyramid::Pyramid;
use crate::rows::View;
use crate::sampling::{cosine_direction, frame, zero_two};
use crate::scene::Scene;

/// Rays from a node of the grid to each sphere, near and far from it.
const RAYS: [u32; 2] = [256, 64];
/// Of these rays, each that has a multiple of this number also looks for what comes back.
const RETURNS: u32 = 4;
/// Distance of nodes that count as far, in radii of the sphere from its middle.
const FAR: f64 = 1.8;
/// Rays from a point of a sphere to the checkerboard.
const DIFFUSE_RAYS: u32 = 256;
/// Rings around the point that mirrors a point light, and samples on each.
const GLINTS: (usize, usize) = (128, 32);

/// What one node of the grid receives.
pub(super) struct NodeLight {
    /// The source, for each channel and coefficient.
    pub(super) specular: Vec<f32>,
    /// The same of diffuse spheres with an albedo of 1.
    pub(super) diffuse: [f32; 3],
}

/// What one node of the grid receives of each function χ on the checkerboard.
pub(super) struct NodeReturn {
    pub(super) specular: Vec<f32>,
    pub(super) diffuse: [f32; COUNT],
    pub(super) own: [[f32; COUNT]; 3],
}

/// The light of the scene as the spheres see it.
pub(super) struct Light {
    pub(super) field: Field,
    chi: Functions,
    pub(super) tint: [f32; 3],
    /// Diffuse radiance of each sphere for an albedo of 1, by direction from its centre; `None` where it has a colour of its
    /// own, whose light is baked.
    white: Vec<Option<Pyramid>>,
    own: Vec<Option<[f64; 3]>>,
    /// What each sphere gets of each function χ on the checkerboard, as irradiance.
    returned: Vec<Functions>,
}

impl Light {
    pub(super) fn new(scene: &Scene, field: &Field, bumps: &Bumps, half: f64) -> Self {
        let (lit, field) = (field, field.with_lamps_in_the_map());
        let plane = field.bodies.plane().map_or(0.0, |p| p.0);
        let chi = Functions::new(|u, v| {
            bumps.at(DVec3::new((2.0 * u - 1.0) * half, plane, (2.0 * v - 1.0) * half))
        });
        let own: Vec<Option<[f64; 3]>> = scene.spheres.iter().map(|s| s.diffuse).collect();
        let white = (0..own.len()).map(|s| own[s].is_none().then(|| lit.white_sphere(s))).collect();
        let returned = (0..own.len()).map(|s| returned(&field, &chi, s)).collect();
        let tint = field.board.as_ref().map_or([1.0; 3], |b| b.tint());
        Self { field, chi, tint, white, own, returned }
    }

    /// What arrives at a point of the checkerboard from the spheres.
    pub(super) fn node(&self, point: DVec3, seed: u32) -> (NodeLight, NodeReturn) {
        let mut light = NodeLight { specular: vec![0.0; 3 * LOBE], diffuse: [0.0; 3] };
        let mut back =
            NodeReturn { specular: vec![0.0; COUNT * LOBE], diffuse: [0.0; COUNT], own: [[0.0; COUNT]; 3] };
        for sphere in 0..self.own.len() {
            for (i, direction, weight) in cone(self.field.bodies.spheres()[sphere], point, seed) {
                let back = (i % RETURNS == 0).then_some(&mut back);
                self.add_ray(sphere, point, direction, weight, &mut light, back);
            }
            for source in &self.field.points {
                self.add_glints(sphere, point, *source, &mut light);
            }
        }
        (light, back)
    }

    /// Adds what a sphere reflects along one ray from the checkerboard, as irradiance of `weight` times the radiance.
    fn add_ray(
        &self,
        sphere: usize,
        point: DVec3,
        direction: DVec3,
        weight: f64,
        light: &mut NodeLight,
        back: Option<&mut NodeReturn>,
    ) {
        let Some((distance, body)) = self.field.bodies.first(point, direction, Some(Body::Plane)) else {
            return;
        };
        if body != Body::Sphere(sphere) {
            return;
        }
        let position = point + direction * distance;
        let normal = self.field.bodies.normal(sphere, position);
        let place = Place { position, normal, body };
        let view = [View::new(SurfacePoint { place, sphere, wo: -direction })];
        let density = Density { strata: [1, 1], spread: 0.0 };
        let (moments, functions) = match &back {
            Some(_) => arcs::moments_with(&self.field, &self.chi, &view, density),
            None => (arcs::moments(&self.field, &view, density), Box::default()),
        };
        let (u, v) = map_position(normal);
        if let Some(white) = &self.white[sphere] {
            let radiance = white.sample(u, v, 1.0);
            (0..3).for_each(|c| light.diffuse[c] += weight as f32 * radiance[c]);
        }
        for (angle, share) in angle_position(view[0].angle()) {
            let share = (share * weight) as f32;
            for i in 0..ROW {
                let moment = &moments[i / FUNCTION_TERMS][i % FUNCTION_TERMS];
                (0..3).for_each(|c| light.specular[c * LOBE + angle * ROW + i] += share * moment[c]);
            }
        }
        if let Some(back) = back {
            self.add_return(sphere, (u, v), view[0].angle(), weight * f64::from(RETURNS), &functions, back);
        }
    }

    /// Adds what a sphere reflects of the functions χ.
    fn add_return(
        &self,
        sphere: usize,
        (u, v): (f32, f32),
        theta: f64,
        weight: f64,
        functions: &FunctionMoments,
        back: &mut NodeReturn,
    ) {
        for (angle, share) in angle_position(theta) {
            let share = (share * weight) as f32;
            for i in 0..ROW {
                let moment = &functions[i / FUNCTION_TERMS][i % FUNCTION_TERMS];
                (0..COUNT).for_each(|a| back.specular[a * LOBE + angle * ROW + i] += share * moment[a]);
            }
        }
        let returned = self.returned[sphere].at(u, v).map(|e| e * weight as f32 / PI as f32);
        match self.own[sphere] {
            None => (0..COUNT).for_each(|a| back.diffuse[a] += returned[a]),
            Some(albedo) => {
                (0..3)
                    .for_each(|c| (0..COUNT).for_each(|a| back.own[c][a] += albedo[c] as f32 * returned[a]));
            }
        }
    }

    /// Adds what a sphere mirrors of a point light: sampled about the point that mirrors it exactly, as densely as the nodes
    /// of the rings lie.
    fn add_glints(
        &self,
        sphere: usize,
        point: DVec3,
        (source, intensity): (DVec3, Rgb),
        light: &mut NodeLight,
    ) {
        let (centre, radius) = self.field.bodies.spheres()[sphere];
        let axis = mirror_point(centre, radius, point, source);
        let (tangent, bitangent) = frame(axis);
        let (rings, samples) = GLINTS;
        let edge = |i: usize| PI * (i as f64 / rings as f64).powf(2.5);
        for ring in 0..rings {
            let (low, high) = (edge(ring), edge(ring + 1));
            let (sin, cos) = ((low + high) / 2.0).sin_cos();
            let area = radius * radius * (low.cos() - high.cos()) * TAU / samples as f64;
            for i in 0..samples {
                let (s, c) = (TAU * (i as f64 + 0.5 * (ring % 2) as f64) / samples as f64).sin_cos();
                let normal = axis * cos + (tangent * c + bitangent * s) * sin;
                let place = Place { position: centre + normal * radius, normal, body: Body::Sphere(sphere) };
                self.add_glint(point, source, intensity, place, area, light);
            }
        }
    }

    fn add_glint(
        &self,
        point: DVec3,
        source: DVec3,
        intensity: Rgb,
        place: Place,
        area: f64,
        light: &mut NodeLight,
    ) {
        let Body::Sphere(sphere) = place.body else { return };
        let (to_source, to_point) = (source - place.position, point - place.position);
        let wo = to_point.normalize();
        let cos_o = wo.dot(place.normal);
        if to_source.dot(place.normal) <= 0.0 || cos_o <= 0.0 || wo.y >= 0.0 {
            return;
        }
        let bodies = &self.field.bodies;
        if bodies.occluded(place.position, source, Some(place.body))
            || bodies.blocked(place.position, point, place.body)
        {
            return;
        }
        let view = View::new(SurfacePoint { place, sphere, wo });
        let Some(at) = view.ring_point(to_source.normalize()) else { return };
        // The solid angle of the area, projected, times the light's irradiance there.
        let projected = -wo.y * cos_o * area / to_point.length_squared();
        let share = projected / (at.density * to_source.length_squared());
        for (angle, part) in angle_position(view.angle()) {
            for (node, hat) in at.hats {
                for (k, polynomial) in at.polynomials.iter().take(FUNCTION_TERMS).enumerate() {
                    let value = (share * part * hat * polynomial) as f32;
                    let place = angle * ROW + node * FUNCTION_TERMS + k;
                    (0..3).for_each(|c| light.specular[c * LOBE + place] += value * intensity[c]);
                }
            }
        }
    }
}

/// Directions from a point of the checkerboard that cover a sphere, each with its number and projected solid angle.
fn cone((centre, radius): (DVec3, f64), point: DVec3, seed: u32) -> impl Iterator<Item = (u32, DVec3, f64)> {
    let to_centre = centre - point;
    let distance = to_centre.length().max(radius * (1.0 + 1e-9));
    let least = (1.0 - (radius / distance).powi(2)).sqrt();
    let axis = to_centre.normalize();
    let (tangent, bitangent) = frame(axis);
    let shift = zero_two(seed);
    let rays = if distance < FAR * radius { RAYS[0] } else { RAYS[1] };
    let solid_angle = TAU * (1.0 - least) / f64::from(rays);
    (0..rays).filter_map(move |i| {
        let [u, v] = zero_two(i);
        let cos = 1.0 - (u + shift[0]).fract() * (1.0 - least);
        let sin = (1.0 - cos * cos).sqrt();
        let (s, c) = (TAU * (v + shift[1])).sin_cos();
        let direction = axis * cos + (tangent * c + bitangent * s) * sin;
        (direction.y > 0.0).then_some((i, direction, direction.y * solid_angle))
    })
}

/// The normal of the sphere at the point that mirrors `source` towards `point`: it lies between the directions to both,
/// where they are seen under equal angles.
fn mirror_point(centre: DVec3, radius: f64, point: DVec3, source: DVec3) -> DVec3 {
    let (from, to) = ((point - centre).normalize(), (source - centre).normalize());
    let cosine = |normal: DVec3, seen: DVec3| normal.dot((seen - centre - normal * radius).normalize());
    let (mut low, mut high) = (0.0, 1.0);
    let at = |t: f64| from.lerp(to, t).try_normalize().unwrap_or(DVec3::Y);
    for _ in 0..40 {
        let middle = (low + high) / 2.0;
        let normal = at(middle);
        if cosine(normal, point) > cosine(normal, source) { low = middle } else { high = middle }
    }
    at((low + high) / 2.0)
}

/// The tabulated angles around one, with their weights.
fn angle_position(theta: f64) -> [(usize, f64); 2] {
    let x = LobeTable::place(theta) / 4.0;
    let index = (x as usize).min(ANGLES - 2);
    [(index, 1.0 - (x - index as f64)), (index + 1, x - index as f64)]
}

/// What the checkerboard sends to a sphere of functions on it, taken as irradiance: as irradiance, by the normal's `u, v`.
pub(super) fn returned(field: &Field, functions: &Functions, sphere: usize) -> Functions {
    Functions::new(|u, v| {
        let normal = map_direction(u, v);
        let place =
            Place { position: field.bodies.point(sphere, normal), normal, body: Body::Sphere(sphere) };
        let mut sums = [0.0; COUNT];
        for i in 0..DIFFUSE_RAYS {
            let direction = cosine_direction(i, normal);
            let width = (PI / f64::from(DIFFUSE_RAYS)).sqrt();
            if let Some((u, v, brightness)) = field.board_at(&place, direction, width) {
                let values = functions.at(u, v);
                (0..COUNT).for_each(|a| sums[a] += brightness * values[a]);
            }
        }
        sums.map(|sum| sum * PI as f32 / DIFFUSE_RAYS as f32)
    })
}
