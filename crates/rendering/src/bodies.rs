//! Intersections of rays with the scene's spheres and checkerboard.

use glam::DVec3;

use crate::Scene;

/// The solid things of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bodies {
    spheres: Vec<(DVec3, f64)>,
    /// Height and half extent of the checkerboard.
    plane: Option<(f64, f64)>,
}

/// Something that a ray can hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Body {
    Sphere(usize),
    Plane,
}

impl Bodies {
    pub(crate) fn new(scene: &Scene) -> Self {
        Self {
            spheres: scene.spheres.iter().map(|s| (s.centre.into(), s.radius)).collect(),
            plane: scene.plane.as_ref().map(|p| (p.height, p.half_extent)),
        }
    }

    /// Centre and radius of each sphere.
    pub(crate) fn spheres(&self) -> &[(DVec3, f64)] {
        &self.spheres
    }

    /// Height and half extent of the checkerboard.
    pub(crate) fn plane(&self) -> Option<(f64, f64)> {
        self.plane
    }

    /// The first body on a ray from `origin` along the unit vector `direction`, with its distance. A ray that starts on
    /// `from` does not see it: both kinds of bodies are convex.
    pub(crate) fn first(&self, origin: DVec3, direction: DVec3, from: Option<Body>) -> Option<(f64, Body)> {
        let mut nearest = None;
        let mut closest = f64::INFINITY;
        for (k, (centre, radius)) in self.spheres.iter().enumerate() {
            if from == Some(Body::Sphere(k)) {
                continue;
            }
            if let Some(t) = sphere_distance(origin - *centre, direction, *radius).filter(|t| *t < closest) {
                (closest, nearest) = (t, Some((t, Body::Sphere(k))));
            }
        }
        match self.plane_distance(origin, direction, from) {
            Some(t) if t < closest => Some((t, Body::Plane)),
            _ => nearest,
        }
    }

    /// True where a body lies between two points.
    pub(crate) fn occluded(&self, point: DVec3, light: DVec3, from: Option<Body>) -> bool {
        let distance = (light - point).length();
        self.first(point, (light - point) / distance, from).is_some_and(|(t, _)| t < distance)
    }

    /// True where a sphere lies between a point of the body `from` and a point of the checkerboard.
    pub(crate) fn blocked(&self, point: DVec3, on_plane: DVec3, from: Body) -> bool {
        let direction = (on_plane - point).normalize();
        matches!(self.first(point, direction, Some(from)), Some((_, Body::Sphere(_))))
    }

    /// Outward unit normal of a sphere at a point on it.
    pub(crate) fn normal(&self, sphere: usize, point: DVec3) -> DVec3 {
        let (centre, radius) = self.spheres[sphere];
        (point - centre) / radius
    }

    /// The point of a sphere in the direction of a unit vector from its centre.
    pub(crate) fn point(&self, sphere: usize, normal: DVec3) -> DVec3 {
        let (centre, radius) = self.spheres[sphere];
        centre + normal * radius
    }

    fn plane_distance(&self, origin: DVec3, direction: DVec3, from: Option<Body>) -> Option<f64> {
        let (height, half) = self.plane?;
        if from == Some(Body::Plane) || direction.y == 0.0 {
            return None;
        }
        let t = (height - origin.y) / direction.y;
        let inside = |x: f64| x.abs() <= half;
        (t > 0.0 && inside(origin.x + t * direction.x) && inside(origin.z + t * direction.z)).then_some(t)
    }
}

/// Distance along a ray to a sphere about the coordinate origin, from outside.
fn sphere_distance(origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
    let b = origin.dot(direction);
    // The distance from the axis, squared: more accurate than b² − c for a far eye (Haines et al. 2019).
    let axis2 = (origin - direction * b).length_squared();
    let discriminant = radius * radius - axis2;
    if discriminant <= 0.0 || b >= 0.0 {
        return None;
    }
    let t = -b - discriminant.sqrt();
    (t > 0.0).then_some(t)
}
