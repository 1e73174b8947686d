//! The camera's film: rays through sub-pixel positions and what of the subjects they meet.

use glam::DVec3;

use crate::bodies::{Bodies, Body};
use crate::irradiance::Place;
use crate::sampling::zero_two;
use crate::scene::Camera;

/// Sub-pixel samples of every pixel.
pub(crate) const SUBSAMPLES: u32 = 16;

/// Sub-pixel samples of pixels that see more than one thing.
pub(crate) const EDGE_SUBSAMPLES: u32 = 256;

/// A pinhole camera with a square film.
#[derive(Clone, Debug)]
pub(crate) struct Film {
    pub(crate) eye: DVec3,
    forward: DVec3,
    /// Half of the film's width and height, at unit distance.
    right: DVec3,
    up: DVec3,
    pub(crate) size: usize,
}

/// A visible point of a subject.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint {
    pub(crate) place: Place,
    pub(crate) sphere: usize,
    /// Unit direction towards the eye.
    pub(crate) wo: DVec3,
}

impl Film {
    pub(crate) fn new(camera: &Camera, size: usize) -> Self {
        let eye = DVec3::from(camera.eye);
        let forward = (DVec3::from(camera.target) - eye).normalize();
        let right = forward.cross(camera.up.into()).normalize();
        let half = (camera.vertical_fov.to_radians() / 2.0).tan();
        Self { eye, forward, right: right * half, up: right.cross(forward) * half, size }
    }

    /// Unit direction through a position on the film, in pixels from the top left corner.
    pub(crate) fn direction(&self, x: f64, y: f64) -> DVec3 {
        let scale = 2.0 / self.size as f64;
        (self.forward + self.right * (x * scale - 1.0) + self.up * (1.0 - y * scale)).normalize()
    }

    /// The image of a sphere as a disc: centre and radius in pixels from the top left corner; `None` where it does not
    /// lie wholly before the camera.
    ///
    /// The image is an ellipse with the semi-axes `sin α cos α/q` and `sin α/√q` about `tan β cos² β/q`, where α is the
    /// sphere's angular radius, β the angle of its centre to the line of sight and `q = cos² β − sin² α`. The disc has
    /// the ellipse's centre and area.
    pub(crate) fn disc(&self, centre: DVec3, radius: f64) -> Option<[f64; 3]> {
        let to_centre = centre - self.eye;
        let (depth, distance) = (to_centre.dot(self.forward), to_centre.length());
        let (sin_a, cos2_b) = (radius / distance, (depth / distance).powi(2));
        let q = cos2_b - sin_a * sin_a;
        if depth <= 0.0 || q <= 0.0 {
            return None;
        }
        let half = self.size as f64 / 2.0;
        let on_film = |axis: DVec3| to_centre.dot(axis) / (depth * axis.length_squared()) * cos2_b / q;
        let mean_axis = sin_a * (1.0 - sin_a * sin_a).powf(0.25) / q.powf(0.75);
        let radius = mean_axis / self.up.length() * half;
        Some([half * (1.0 + on_film(self.right)), half * (1.0 - on_film(self.up)), radius])
    }

    /// Directions through the first `count` sub-pixel positions of a pixel (row by row from the top left).
    pub(crate) fn directions(&self, pixel: usize, count: u32) -> impl Iterator<Item = DVec3> {
        let (x, y) = ((pixel % self.size) as f64, (pixel / self.size) as f64);
        // The sequence starts at the lower edge of each of its cells; from their middles the mean is the pixel's middle.
        let middle = 0.5 / f64::from(count);
        (0..count).map(move |i| {
            let [dx, dy] = zero_two(i);
            self.direction(x + dx + middle, y + dy + middle)
        })
    }

    /// The points of subjects seen through the first `count` sub-pixel positions of a pixel; those that see none are
    /// left out.
    pub(crate) fn subject_points(&self, bodies: &Bodies, pixel: usize, count: u32) -> Vec<SurfacePoint> {
        self.directions(pixel, count).filter_map(|d| self.subject_point(bodies, d)).collect()
    }

    /// The points of subjects seen in a pixel, and the number of positions that were looked through: more of them where
    /// the pixel shows other things too.
    pub(crate) fn points(&self, bodies: &Bodies, pixel: usize) -> (Vec<SurfacePoint>, u32) {
        let points = self.subject_points(bodies, pixel, SUBSAMPLES);
        let is_whole =
            points.len() == SUBSAMPLES as usize && points.iter().all(|p| p.sphere == points[0].sphere);
        if is_whole || points.is_empty() {
            return (points, SUBSAMPLES);
        }
        (self.subject_points(bodies, pixel, EDGE_SUBSAMPLES), EDGE_SUBSAMPLES)
    }

    /// By how much the `count` points of a pixel's first [`SUBSAMPLES`] positions under- or overestimate its coverage.
    pub(crate) fn coverage_of(&self, bodies: &Bodies, pixel: usize, count: usize) -> f32 {
        let (points, positions) = self.points(bodies, pixel);
        let exact = points.len() as f32 / positions as f32;
        exact * SUBSAMPLES as f32 / count.max(1) as f32
    }

    fn subject_point(&self, bodies: &Bodies, direction: DVec3) -> Option<SurfacePoint> {
        let (distance, Body::Sphere(sphere)) = bodies.first(self.eye, direction, None)? else { return None };
        let position = self.eye + direction * distance;
        let normal = bodies.normal(sphere, position);
        let place = Place { position, normal, body: Body::Sphere(sphere) };
        Some(SurfacePoint { place, sphere, wo: -direction })
    }

    /// Angle that a sub-pixel sample stands for, in radians.
    pub(crate) fn sample_angle(&self) -> f64 {
        2.0 * self.up.length() / self.size as f64 / f64::from(SUBSAMPLES).sqrt()
    }
}

impl SurfacePoint {
    /// The local frame of the sphere: tangent eastwards along the parallel, bitangent, normal.
    pub(crate) fn frame(&self) -> [DVec3; 3] {
        let normal = self.place.normal;
        let tangent = DVec3::Y.cross(normal).try_normalize().unwrap_or(DVec3::X);
        [tangent, normal.cross(tangent), normal]
    }

    /// The frame whose tangent lies in the plane of the view: all that an isotropic lobe needs.
    pub(crate) fn view_frame(&self) -> [DVec3; 3] {
        let normal = self.place.normal;
        let tangent = (self.wo - normal * self.wo.dot(normal))
            .try_normalize()
            .unwrap_or_else(|| normal.any_orthonormal_vector());
        [tangent, normal.cross(tangent), normal]
    }
}

/// Coordinates of a direction in a frame.
pub(crate) fn to_local(frame: &[DVec3; 3], w: DVec3) -> [f64; 3] {
    frame.map(|axis| axis.dot(w))
}

/// The direction with given coordinates in a frame.
pub(crate) fn to_world(frame: &[DVec3; 3], w: [f64; 3]) -> DVec3 {
    frame[0] * w[0] + frame[1] * w[1] + frame[2] * w[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    #[test]
    fn a_disc_has_the_centre_and_area_of_the_image() {
        let mut scene = Scene::spheres();
        scene.spheres.truncate(1);
        let (bodies, film) = (Bodies::new(&scene), Film::new(&scene.camera, 120));
        let (mut area, mut moments) = (0.0, [0.0; 2]);
        for pixel in 0..120 * 120 {
            let share = film.subject_points(&bodies, pixel, SUBSAMPLES).len() as f64 / f64::from(SUBSAMPLES);
            area += share;
            moments[0] += share * ((pixel % 120) as f64 + 0.5);
            moments[1] += share * ((pixel / 120) as f64 + 0.5);
        }
        let [x, y, radius] = film.disc(DVec3::from(scene.spheres[0].centre), 1.0).unwrap();
        assert!((moments[0] / area - x).abs() < 0.02 && (moments[1] / area - y).abs() < 0.02, "{x} {y}");
        assert!((std::f64::consts::PI * radius * radius / area - 1.0).abs() < 2e-3, "{radius}");
    }
}
