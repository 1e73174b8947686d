//! Where a sphere mirrors a point light, and directions towards points about it.
//!
//! Light that a polished sphere throws onto a diffuse surface comes from a spot of the sphere too small to be met by
//! chance. The spot lies about the mirror point (Alhazen's problem): there the half vector between the light and the
//! lit point is the normal. Normals of the sphere are drawn about that of the mirror point, as wide as the lobe is
//! seen there. The density is exact whatever is approximated in choosing it.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// Steps of Newton's method: the mirror point need not be exact.
const STEPS: usize = 6;

/// A sphere's reflection of a point light as seen from a point.
pub(super) struct Glint {
    point: DVec3,
    centre: DVec3,
    radius: f64,
    /// In the plane of incidence, across it, and the normal of the mirror point.
    frame: [DVec3; 3],
    /// Slopes of normals, along the first two axes, at which the lobe has fallen to a quarter.
    widths: [f64; 2],
}

impl Glint {
    /// For a lobe of width `alpha`; `None` where the point or the light lies within the sphere, or where no reflection
    /// is seen.
    pub(super) fn new(
        point: DVec3,
        (centre, radius): (DVec3, f64),
        light: DVec3,
        alpha: f64,
    ) -> Option<Self> {
        let (a, b) = (point - centre, light - centre);
        let (a_length, b_length) = (a.length(), b.length());
        if a_length <= radius || b_length <= radius {
            return None;
        }
        let towards = a / a_length;
        let aside = b - towards * b.dot(towards);
        let sideways = aside.try_normalize().unwrap_or_else(|| towards.any_orthonormal_vector());
        let angle = b.dot(sideways).atan2(b.dot(towards));
        let (at_a, at_b) = (View { distance: a_length / radius }, View { distance: b_length / radius });
        let t = mirror_angle(&at_a, &at_b, angle);
        let (sin, cos) = t.sin_cos();
        let normal = towards * cos + sideways * sin;
        let in_plane = sideways * cos - towards * sin;
        let cos_d = at_a.incidence(t).cos();
        if cos_d <= 0.0 {
            return None;
        }
        // How fast the half vector turns against the normal, per angle of the normal.
        let along = 0.5 * (at_a.slope(t) + at_b.slope(angle - t));
        let across = 1.0 + 0.5 * (at_a.nearness(t) + at_b.nearness(angle - t)) / cos_d;
        let frame = [in_plane, normal.cross(in_plane), normal];
        Some(Self { point, centre, radius, frame, widths: [alpha / along, alpha / across] })
    }

    /// Draws a unit direction from the point towards the sphere from two numbers in `[0, 1)`; `None` where the point drawn
    /// lies on the sphere's far side.
    pub(super) fn sample(&self, [u, v]: [f64; 2]) -> Option<DVec3> {
        let slope = (u / (1.0 - u)).sqrt();
        let (sin, cos) = (TAU * v).sin_cos();
        let (x, y) = (self.widths[0] * slope * cos, self.widths[1] * slope * sin);
        let normal = (self.frame[0] * x + self.frame[1] * y + self.frame[2]).normalize();
        let direction = self.centre + normal * self.radius - self.point;
        (direction.dot(normal) < 0.0).then(|| direction.normalize())
    }

    /// Density of [`Glint::sample`] for the direction that meets the sphere at `distance`, in 1/sr.
    pub(super) fn density(&self, direction: DVec3, distance: f64) -> f64 {
        let normal = (self.point + direction * distance - self.centre) / self.radius;
        let [x, y, z] = self.frame.map(|axis| axis.dot(normal));
        let cos = -direction.dot(normal);
        if z <= 0.0 || cos <= 0.0 {
            return 0.0;
        }
        let [a, b] = self.widths;
        let fall = 1.0 + (x / (z * a)).powi(2) + (y / (z * b)).powi(2);
        let of_normals = 1.0 / (PI * a * b * fall * fall * z * z * z);
        of_normals * (distance / self.radius).powi(2) / cos
    }
}

/// A point outside of a sphere, seen from points of the sphere; lengths in radii.
struct View {
    /// From the centre.
    distance: f64,
}

impl View {
    /// Angle between the normal and the direction to the point, where the normal is at angle `t` to the point's.
    fn incidence(&self, t: f64) -> f64 {
        let (sin, cos) = t.sin_cos();
        (self.distance * sin).atan2(self.distance * cos - 1.0)
    }

    /// Derivative of [`View::incidence`].
    fn slope(&self, t: f64) -> f64 {
        self.distance * (self.distance - t.cos()) * self.nearness(t).powi(2)
    }

    /// Reciprocal distance to the point of the sphere.
    fn nearness(&self, t: f64) -> f64 {
        (1.0 + self.distance * (self.distance - 2.0 * t.cos())).sqrt().recip()
    }
}

/// The angle between the first of two views and the normal of the mirror point; `angle` lies between the two.
fn mirror_angle(a: &View, b: &View, angle: f64) -> f64 {
    let (mut low, mut high) = (0.0, angle);
    let mut t = 0.5 * angle;
    for _ in 0..STEPS {
        let excess = a.incidence(t) - b.incidence(angle - t);
        *(if excess < 0.0 { &mut low } else { &mut high }) = t;
        let step = t - excess / (a.slope(t) + b.slope(angle - t));
        t = if step > low && step < high { step } else { 0.5 * (low + high) };
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::zero_two;

    const SPHERE: (DVec3, f64) = (DVec3::new(0.2, 0.1, -0.3), 0.9);

    /// Distance to the sphere.
    fn distance(point: DVec3, direction: DVec3) -> f64 {
        let a = point - SPHERE.0;
        let b = a.dot(direction);
        -b - (b * b - a.length_squared() + SPHERE.1 * SPHERE.1).sqrt()
    }

    fn glint(alpha: f64) -> (DVec3, DVec3, Glint) {
        let (point, light) = (DVec3::new(1.5, -0.8, 0.4), DVec3::new(-3.0, 4.0, 4.0));
        (point, light, Glint::new(point, SPHERE, light, alpha).unwrap())
    }

    #[test]
    fn the_mirror_point_mirrors() {
        let (point, light, glint) = glint(0.1);
        let normal = glint.frame[2];
        let spot = SPHERE.0 + normal * SPHERE.1;
        let half = ((point - spot).normalize() + (light - spot).normalize()).normalize();
        assert!((half - normal).length() < 1e-9, "{half} {normal}");
    }

    #[test]
    fn half_vectors_fall_as_the_lobe_does() {
        // A fraction of a half of the normals lies within one width, in every azimuth.
        let (point, light, glint) = glint(0.01);
        for i in 0..64 {
            let [_, azimuth] = zero_two(i);
            let direction = glint.sample([0.5, azimuth]).unwrap();
            let spot = point + direction * distance(point, direction);
            let normal = (spot - SPHERE.0) / SPHERE.1;
            let half = ((point - spot).normalize() + (light - spot).normalize()).normalize();
            let tan = half.cross(normal).length() / half.dot(normal);
            assert!((tan / 0.01 - 1.0).abs() < 0.1, "{azimuth}: {tan}");
        }
    }

    #[test]
    fn densities_integrate_to_the_share_that_is_seen() {
        let (point, _, glint) = glint(0.5);
        let count = 1 << 14;
        let seen = (0..count).filter(|i| glint.sample(zero_two(*i)).is_some()).count();
        // Over the cone that the sphere fills.
        let to_centre = SPHERE.0 - point;
        let cos_cone = (1.0 - (SPHERE.1 / to_centre.length()).powi(2)).sqrt();
        let axis = to_centre.normalize();
        let (s, t) = axis.any_orthonormal_pair();
        let mut integral = 0.0;
        for i in 0..count {
            let [u, v] = zero_two(i);
            let cos = 1.0 - u * (1.0 - cos_cone);
            let (sin, (sin_phi, cos_phi)) = ((1.0 - cos * cos).sqrt(), (TAU * v).sin_cos());
            let w = axis * cos + s * (sin * cos_phi) + t * (sin * sin_phi);
            integral += glint.density(w, distance(point, w)) * TAU * (1.0 - cos_cone) / f64::from(count);
        }
        let seen = seen as f64 / f64::from(count);
        assert!((integral / seen - 1.0).abs() < 0.02, "{integral} {seen}");
    }
}
