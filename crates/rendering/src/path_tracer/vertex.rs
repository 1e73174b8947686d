//! One point of a path: how it scatters light, and in which directions the path goes on.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;
use lookmatch_materials::Geometry;

use super::glint::Glint;
use super::wardrobe::{Ball, Lobe};
use super::world::{Encounter, Surface};
use crate::film::{to_local, to_world};

/// Share of the spheres among the directions that leave a diffuse point.
const SPHERES: f64 = 0.5;
/// Share of the reflected lights among the directions towards a sphere with a lobe.
const GLINTS: f64 = 0.5;

/// Spheres, and lights that they reflect in narrow lobes: what directions are aimed at.
#[derive(Clone, Copy)]
pub(super) struct Targets<'a> {
    pub(super) spheres: &'a [Ball],
    /// Places of what is small and bright.
    pub(super) lights: &'a [DVec3],
}

/// A point where light is scattered towards a viewer.
///
/// Directions are drawn from a mixture: the specular lobe, the cosine of the Lambert term, and the spheres that light
/// a diffuse point by their highlights. All densities are of the whole mixture, in 1/sr.
pub(super) struct Vertex<'a> {
    pub(super) at: Encounter,
    targets: Targets<'a>,
    /// Towards the viewer, in the local frame.
    wo: [f64; 3],
    diffuse: DVec3,
    /// `None` where there is no lobe.
    lobe: Option<&'a Lobe>,
    shares: Shares,
    /// About the share of light that is reflected.
    pub(super) albedo: f64,
}

/// How often each part of the mixture is drawn; their sum is 1.
#[derive(Clone, Copy)]
struct Shares {
    lobe: f64,
    cosine: f64,
    spheres: f64,
}

/// Light from one direction.
pub(super) struct Scattering {
    /// BRDF times cosine, in 1/sr.
    pub(super) value: DVec3,
    /// Density of the direction.
    pub(super) density: f64,
}

impl<'a> Vertex<'a> {
    /// A point with a diffuse reflectance and perhaps a lobe, seen from the direction of a unit vector.
    pub(super) fn new(
        at: Encounter,
        to_viewer: DVec3,
        diffuse: DVec3,
        lobe: Option<&'a Lobe>,
        targets: Targets<'a>,
    ) -> Self {
        // The checkerboard looks the same from everywhere.
        let is_board = at.surface == Surface::Plane;
        let wo = if is_board { [0.0, 0.0, 1.0] } else { to_local(&at.frame, to_viewer) };
        let shares = Shares { lobe: 0.0, cosine: 1.0, spheres: 0.0 };
        let mut vertex = Self { at, targets, wo, diffuse, lobe, shares, albedo: 0.0 };
        let reflectance = vertex.lobe.map_or(0.0, |l| vertex.mirror_reflectance(l));
        vertex.shares = vertex.fair_shares(reflectance);
        vertex.albedo = reflectance + diffuse.max_element();
        vertex
    }

    fn fair_shares(&self, reflectance: f64) -> Shares {
        let diffuse = self.diffuse.element_sum() / 3.0;
        let lobe = match (self.lobe, diffuse > 0.0) {
            (None, _) => 0.0,
            // Wide lobes are not quite where their samples are, which may lie below the surface.
            (Some(lobe), false) => 1.0 - 0.5 * lobe.alpha.min(1.0),
            (Some(_), true) => (reflectance / (reflectance + diffuse)).clamp(0.1, 0.9),
        };
        let spheres = if self.visible_spheres().count() > 0 { SPHERES } else { 0.0 };
        Shares { lobe, cosine: (1.0 - lobe) * (1.0 - spheres), spheres: (1.0 - lobe) * spheres }
    }

    /// About the albedo of the lobe: the weight of its sample in the mirror direction.
    fn mirror_reflectance(&self, lobe: &Lobe) -> f64 {
        let [x, y, z] = self.wo;
        let Some(g) = Geometry::new([-x, -y, z], self.wo) else { return 0.0 };
        let value: f64 = lobe.bsdf.specular(&g).iter().sum();
        (value / 3.0 * g.cos_i() / lobe.sampling.density(g.wi, g.wo)).clamp(1e-3, 1.0)
    }

    /// BRDF times cosine for a unit direction, with its density; `None` where no light is scattered.
    pub(super) fn scatter(&self, direction: DVec3) -> Option<Scattering> {
        if direction.dot(self.at.geometric) <= 0.0 {
            return None;
        }
        let g = Geometry::new(to_local(&self.at.frame, direction), self.wo)?;
        let cos = g.cos_i();
        let mut value = self.diffuse * (cos * FRAC_1_PI);
        let mut density = self.shares.cosine * cos * FRAC_1_PI;
        if let Some(lobe) = &self.lobe {
            value += DVec3::from(lobe.bsdf.specular(&g)) * cos;
            density += self.shares.lobe * lobe.sampling.density(g.wi, g.wo);
        }
        if self.shares.spheres > 0.0 {
            density += self.shares.spheres * self.sphere_density(direction);
        }
        (value.max_element() > 0.0 && density > 0.0).then_some(Scattering { value, density })
    }

    /// BRDF times cosine for a unit direction alone.
    pub(super) fn value(&self, direction: DVec3) -> DVec3 {
        if direction.dot(self.at.geometric) <= 0.0 {
            return DVec3::ZERO;
        }
        let Some(g) = Geometry::new(to_local(&self.at.frame, direction), self.wo) else { return DVec3::ZERO };
        let specular = self.lobe.map_or(DVec3::ZERO, |lobe| lobe.bsdf.specular(&g).into());
        (self.diffuse * FRAC_1_PI + specular) * g.cos_i()
    }

    /// Draws a unit direction from two numbers in `[0, 1)`; `None` where the draw is lost.
    pub(super) fn sample(&self, [u, v]: [f64; 2]) -> Option<DVec3> {
        let Shares { lobe, cosine, spheres } = self.shares;
        if let Some(l) = self.lobe.filter(|_| u < lobe) {
            let local = l.sampling.sample(self.wo, [u / lobe, v]);
            return (local[2] > 0.0).then(|| to_world(&self.at.frame, local));
        }
        let rest = u - lobe;
        if rest < cosine || spheres == 0.0 {
            return Some(to_world(&self.at.frame, cosine_direction([(rest / cosine).min(1.0), v])));
        }
        self.sample_spheres([((rest - cosine) / spheres).min(1.0 - f64::EPSILON), v])
    }

    /// Spheres that rise above the horizon, from outside.
    fn visible_spheres(&self) -> impl Iterator<Item = Ball> {
        let own = match self.at.surface {
            Surface::Sphere(k) => k,
            _ => usize::MAX,
        };
        let has_diffuse = self.diffuse != DVec3::ZERO;
        self.targets.spheres.iter().enumerate().filter_map(move |(k, ball)| {
            let to_centre = ball.centre - self.at.position;
            let rises = to_centre.dot(self.at.frame[2]) > -ball.radius;
            let outside = to_centre.length_squared() > ball.radius * ball.radius;
            (has_diffuse && k != own && rises && outside).then_some(*ball)
        })
    }

    /// The highlights that a sphere throws here, and their share of the directions towards it.
    fn glints(&self, Ball { centre, radius, alpha }: Ball) -> (f64, impl Iterator<Item = Option<Glint>>) {
        let share = if alpha > 0.0 && !self.targets.lights.is_empty() { GLINTS } else { 0.0 };
        let position = self.at.position;
        (share, self.targets.lights.iter().map(move |l| Glint::new(position, (centre, radius), *l, alpha)))
    }

    fn sample_spheres(&self, [u, v]: [f64; 2]) -> Option<DVec3> {
        let (k, u) = pick(u, self.visible_spheres().count());
        let sphere = self.visible_spheres().nth(k)?;
        let (share, mut glints) = self.glints(sphere);
        if u >= share {
            return Some(Cone::new(self.at.position, sphere).sample([(u - share) / (1.0 - share), v]));
        }
        let (k, u) = pick(u / share, self.targets.lights.len());
        glints.nth(k)??.sample([u, v])
    }

    fn sphere_density(&self, direction: DVec3) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for sphere in self.visible_spheres() {
            count += 1;
            let cone = Cone::new(self.at.position, sphere);
            let Some(distance) = cone.meets(direction) else { continue };
            let (share, glints) = self.glints(sphere);
            sum += (1.0 - share) * cone.density();
            if share > 0.0 {
                let glints = glints.map(|g| g.map_or(0.0, |g| g.density(direction, distance)));
                sum += share * glints.sum::<f64>() / self.targets.lights.len() as f64;
            }
        }
        sum / f64::from(count.max(1))
    }
}

/// The directions in which a sphere is seen, all alike.
struct Cone {
    to_centre: DVec3,
    radius2: f64,
    /// 1 − cos of the sphere's angular radius.
    height: f64,
}

impl Cone {
    fn new(point: DVec3, Ball { centre, radius, .. }: Ball) -> Self {
        let to_centre = centre - point;
        let sin2 = radius * radius / to_centre.length_squared();
        Self { to_centre, radius2: radius * radius, height: sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt()) }
    }

    fn sample(&self, [u, v]: [f64; 2]) -> DVec3 {
        let axis = self.to_centre.normalize();
        let (s, t) = axis.any_orthonormal_pair();
        let fall = u * self.height;
        let sin = (fall * (2.0 - fall)).sqrt();
        let (sin_phi, cos_phi) = (TAU * v).sin_cos();
        axis * (1.0 - fall) + s * (sin * cos_phi) + t * (sin * sin_phi)
    }

    fn density(&self) -> f64 {
        1.0 / (TAU * self.height)
    }

    /// Distance to the sphere.
    fn meets(&self, direction: DVec3) -> Option<f64> {
        let along = self.to_centre.dot(direction);
        let half2 = self.radius2 - (self.to_centre - direction * along).length_squared();
        (along > 0.0 && half2 > 0.0).then(|| along - half2.sqrt())
    }
}

/// One of `n` things by a number in `[0, 1)`, and a number that is left.
fn pick(u: f64, n: usize) -> (usize, f64) {
    let scaled = u * n as f64;
    let k = (scaled as usize).min(n.saturating_sub(1));
    (k, scaled - k as f64)
}

/// A local direction with density `cos θ/π`.
fn cosine_direction([u, v]: [f64; 2]) -> [f64; 3] {
    let (sin_phi, cos_phi) = (TAU * v).sin_cos();
    let sin = u.sqrt();
    [sin * cos_phi, sin * sin_phi, (1.0 - u).sqrt()]
}
