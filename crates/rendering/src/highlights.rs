//! What the point lights make of a lobe directly: evaluated, not integrated, because a point has no extent.

use lookmatch_materials::{Bsdf, Geometry};
use rayon::prelude::*;

use crate::Rgb;
use crate::field::Field;
use crate::film::{Film, SUBSAMPLES, SurfacePoint, to_local};
use crate::irradiance::from_point;

/// Sub-pixel samples away from every highlight and silhouette, where a lobe hardly changes within a pixel.
const SMOOTH_SUBSAMPLES: u32 = 4;
/// Sub-pixel samples where the half vector comes close to the normal: a lobe of α = 0.01 is no wider than a pixel.
const FINE_SUBSAMPLES: u32 = 64;
/// `tan²θ_h` below which a pixel is near a highlight (17 degrees).
const NEAR: f64 = 0.1;

/// One lit sub-pixel sample: where it is on the lobe, and its irradiance over the number of samples of its pixel.
type Sample = (Geometry<f32>, Rgb);

/// Lit samples of every subject pixel.
#[derive(Clone, Debug)]
pub(crate) struct Highlights {
    /// Range of `samples` of each subject pixel.
    starts: Vec<u32>,
    samples: Vec<Sample>,
}

impl Highlights {
    pub(crate) fn prepare(field: &Field, film: &Film, subjects: &[u32]) -> Self {
        let per_pixel: Vec<Vec<Sample>> =
            subjects.par_iter().map(|pixel| pixel_samples(field, film, *pixel as usize)).collect();
        let mut starts = vec![0];
        starts.extend(per_pixel.iter().scan(0, |sum, samples| {
            *sum += samples.len() as u32;
            Some(*sum)
        }));
        Self { starts, samples: per_pixel.into_iter().flatten().collect() }
    }

    /// Radiance of subject pixel `k` towards the eye.
    pub(crate) fn radiance(&self, k: usize, bsdf: &dyn Bsdf) -> Rgb {
        let (start, end) = (self.starts[k] as usize, self.starts[k + 1] as usize);
        let reflected = |(geometry, irradiance): &Sample| {
            let [r, g, b] = bsdf.specular_f32(geometry);
            Rgb::new(r, g, b, 0.0) * *irradiance
        };
        self.samples[start..end].iter().map(reflected).sum()
    }
}

fn pixel_samples(field: &Field, film: &Film, pixel: usize) -> Vec<Sample> {
    if field.points.is_empty() {
        return Vec::new();
    }
    let coarse = film.subject_points(&field.bodies, pixel, SMOOTH_SUBSAMPLES);
    let is_near = |point: &SurfacePoint| {
        field
            .points
            .iter()
            .any(|(light, _)| geometry(point, *light).is_some_and(|g| g.tan2_h[0] + g.tan2_h[1] < NEAR))
    };
    let count = if coarse.iter().any(is_near) {
        FINE_SUBSAMPLES
    } else if coarse.len() < SMOOTH_SUBSAMPLES as usize {
        SUBSAMPLES
    } else {
        SMOOTH_SUBSAMPLES
    };
    let mut samples = Vec::new();
    for point in film.subject_points(&field.bodies, pixel, count) {
        for light in &field.points {
            let irradiance = from_point(&field.bodies, *light, &point.place);
            if let Some(g) = geometry(&point, light.0).filter(|_| irradiance != Rgb::ZERO) {
                samples.push((g.to_f32(), irradiance / count as f32));
            }
        }
    }
    samples
}

/// The reflection of a light at a point, in the sphere's own frame.
fn geometry(point: &SurfacePoint, light: glam::DVec3) -> Option<Geometry<f64>> {
    let frame = point.frame();
    let wi = (light - point.place.position).normalize();
    Geometry::new(to_local(&frame, wi), to_local(&frame, point.wo))
}
