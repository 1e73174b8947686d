//! The direct integral with a fixed set of lobe samples, for anisotropic lobes (after Křivánek & Colbert 2008).
//!
//! Directions are drawn from the lobe, so two materials of different shape see different directions; the random
//! numbers behind them belong to the pixel. Each look-up is averaged over the solid angle that its sample stands for.

use glam::DVec3;
use lookmatch_materials::{Bsdf, Geometry};

use crate::Rgb;
use crate::field::Field;
use crate::film::{Film, SUBSAMPLES, SurfacePoint, to_local, to_world};
use crate::highlights::is_near_lamp;
use crate::sampling::zero_two;

/// Lobe samples of a pixel: a power of two, and a multiple of the sub-pixel samples.
pub(crate) const SAMPLES: u32 = 1024;

/// Radiance of a pixel through the specular lobe: the mean over its sub-pixel samples, those that miss being 0.
pub(crate) fn radiance(field: &Field, film: &Film, pixel: usize, bsdf: &dyn Bsdf, samples: u32) -> Rgb {
    let Some(sampling) = bsdf.sampling() else { return Rgb::ZERO };
    let points = film.subject_points(&field.bodies, pixel, SUBSAMPLES);
    let frames: Vec<_> = points.iter().map(|p| (p.frame(), to_local(&p.frame(), p.wo))).collect();
    let shift = zero_two(pixel as u32);
    let mut sum = Rgb::ZERO;
    for i in 0..samples {
        // Consecutive samples share a sub-pixel point: each block is stratified over the lobe by itself. Dealt out in turn,
        // every point would see its own sixteenth of the lobe alone, because the sequence visits sixteenths in turn too.
        let k = (i / (samples / SUBSAMPLES)) as usize;
        if k >= points.len() {
            // A share of the samples belongs to the sub-pixel positions that miss the subject.
            continue;
        }
        let (frame, wo) = &frames[k];
        let [a, b] = zero_two(i);
        let wi = sampling.sample(*wo, [(a + shift[0]).fract(), (b + shift[1]).fract()]);
        let Some(g) = Geometry::new(wi, *wo) else { continue };
        let density = sampling.density(g.wi, g.wo);
        if density <= 0.0 {
            continue;
        }
        let angle = (f64::from(samples) * density).recip().sqrt();
        let light = field.incident(&points[k].place, to_world(frame, wi), angle);
        let weight = g.cos_i() / density;
        let [r, g, b] = bsdf.specular(&g).map(|f| (f * weight) as f32);
        sum += light * Rgb::new(r, g, b, 0.0);
    }
    let sum = sum / samples as f32 + lamps(field, &points, bsdf);
    sum * film.coverage_of(&field.bodies, pixel, points.len())
}

/// What the environment's lamps add away from their highlights: evaluated directly, as point lights are.
fn lamps(field: &Field, points: &[SurfacePoint], bsdf: &dyn Bsdf) -> Rgb {
    let mut sum = Rgb::ZERO;
    for point in points {
        let frame = point.frame();
        let far = |(direction, _): &(DVec3, Rgb)| !is_near_lamp(point, *direction);
        for (direction, irradiance) in field.lamps(point.place).filter(far) {
            let (wi, wo) = (to_local(&frame, direction), to_local(&frame, point.wo));
            if let Some(g) = Geometry::new(wi, wo) {
                let [r, g, b] = bsdf.specular(&g).map(|f| (f * wi[2]) as f32);
                sum += irradiance * Rgb::new(r, g, b, 0.0);
            }
        }
    }
    sum / SUBSAMPLES as f32
}
