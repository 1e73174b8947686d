//! What the lights without extent make of a lobe directly: point lights, and the environment's lamps close to where they
//! are mirrored. Evaluated, not integrated: there the basis of the rings would ring.

use std::io;

use glam::DVec3;
use lookmatch_materials::{Bsdf, Geometry};
use rayon::prelude::*;

use crate::Rgb;
use crate::field::Field;
use crate::film::{Film, SUBSAMPLES, SurfacePoint, to_local};
use crate::flat::{Flat, Reader, Writer};
use crate::irradiance::from_point;

/// Sub-pixel samples where the half vector comes close to the normal: a lobe of α = 0.01 is no wider than a pixel.
const FINE_SUBSAMPLES: u32 = 64;
/// `tan θ_h` in units of the pixel's width (as an angle of the normal) below which every sample is evaluated by itself, …
const SHARP: f64 = 4.0;
/// … and below which those of each quarter of the pixel are. Further out a lobe is all but linear within a pixel: even a
/// tail that falls with the fourth power of θ_h changes its mean by 0.3 % at most.
const CURVED: f64 = 16.0;
/// `tan²θ_h` below which a lamp is a highlight (6 degrees) and above which it is left to the rings.
const NEAR_LAMP: f64 = 0.01;
/// Shortest mean of the unit directions that are merged into one.
const STRAIGHT: f64 = 0.99;

/// A direction to evaluate a lobe in, and its irradiance over the number of samples of its pixel.
type Sample = (Geometry<f32>, Rgb);

/// Lit samples of every subject pixel.
#[derive(Clone, Debug)]
pub(crate) struct Highlights {
    /// Where the samples of each subject pixel start, and where the last ends.
    starts: Vec<u32>,
    geometries: Vec<Geometry<f32>>,
    irradiances: Vec<Rgb>,
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
        let (geometries, irradiances) = per_pixel.into_iter().flatten().unzip();
        Self { starts, geometries, irradiances }
    }

    /// Adds the radiance of all subject pixels towards the eye to three planes, one for each channel.
    pub(crate) fn add(&self, bsdf: &dyn Bsdf, planes: &mut [Vec<f32>; 3]) {
        let reflected = bsdf.specular_all(&self.geometries);
        for (k, range) in self.starts.windows(2).enumerate() {
            for i in range[0] as usize..range[1] as usize {
                for c in 0..3 {
                    planes[c][k] += reflected[i][c] * self.irradiances[i][c];
                }
            }
        }
    }

    /// Radiance of subject pixel `k` towards the eye.
    pub(crate) fn radiance(&self, k: usize, bsdf: &dyn Bsdf) -> Rgb {
        let (start, end) = (self.starts[k] as usize, self.starts[k + 1] as usize);
        let reflected = bsdf.specular_all(&self.geometries[start..end]);
        reflected
            .iter()
            .zip(&self.irradiances[start..end])
            .map(|([r, g, b], e)| Rgb::new(*r, *g, *b, 0.0) * *e)
            .sum()
    }
}

impl Flat for Highlights {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.slice(&self.starts)?;
        out.slice(&self.irradiances)?;
        out.slice(&self.geometries.iter().map(|g| [g.wi, g.wo]).collect::<Vec<_>>())?;
        let angles = |g: &Geometry<f32>| [g.cos_d, g.cos_h, g.tan2_h[0], g.tan2_h[1]];
        out.slice(&self.geometries.iter().map(angles).collect::<Vec<_>>())
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        let (starts, irradiances) = (input.vec()?, input.vec()?);
        let (directions, angles): (Vec<[[f32; 3]; 2]>, Vec<[f32; 4]>) = (input.vec()?, input.vec()?);
        let pairs = directions.into_iter().zip(angles);
        let geometries =
            pairs.map(|([wi, wo], [cos_d, cos_h, x, y])| Geometry { wi, wo, cos_d, cos_h, tan2_h: [x, y] });
        Ok(Self { starts, geometries: geometries.collect(), irradiances })
    }
}

/// True where a lamp in a unit direction is evaluated here, and not by the rings.
pub(crate) fn is_near_lamp(point: &SurfacePoint, direction: DVec3) -> bool {
    tan2_h(point, direction) < NEAR_LAMP
}

/// `tan²θ_h` of the half vector between a unit direction and the view.
fn tan2_h(point: &SurfacePoint, direction: DVec3) -> f64 {
    let h = direction + point.wo;
    let along = h.dot(point.place.normal);
    if along > 0.0 { h.length_squared() / (along * along) - 1.0 } else { f64::INFINITY }
}

fn pixel_samples(field: &Field, film: &Film, pixel: usize) -> Vec<Sample> {
    let points = film.subject_points(&field.bodies, pixel, SUBSAMPLES);
    let width = width(&points);
    let mut samples: Vec<Sample> = Vec::new();
    for light in &field.points {
        let sees = |points: &[SurfacePoint]| -> Vec<Lit> {
            let lit = |p: &SurfacePoint| {
                Lit::new(
                    p,
                    (light.0 - p.place.position).normalize(),
                    from_point(&field.bodies, *light, &p.place),
                )
            };
            points.iter().map(lit).collect()
        };
        let coarse = sees(&points);
        if nearest(&coarse) < SHARP * width {
            let fine = film.subject_points(&field.bodies, pixel, FINE_SUBSAMPLES);
            samples.extend(sees(&fine).iter().filter_map(|l| l.sample(FINE_SUBSAMPLES)));
        } else {
            samples.extend(merged(&coarse, width));
        }
    }
    samples.extend(lamp_samples(field, &points, width));
    // Along silhouettes the few points count for as much of the pixel as many cover.
    let share = film.coverage_of(&field.bodies, pixel, points.len());
    samples.iter_mut().for_each(|(_, irradiance)| *irradiance *= share);
    samples
}

/// Samples of the lamps that are nearly mirrored in a pixel.
fn lamp_samples(field: &Field, points: &[SurfacePoint], width: f64) -> Vec<Sample> {
    let mut samples = Vec::new();
    for (direction, irradiance) in field.all_lamps() {
        if !points.iter().any(|p| is_near_lamp(p, *direction)) {
            continue;
        }
        let lit = |p: &SurfacePoint| {
            let seen = is_near_lamp(p, *direction) && field.sees(&p.place, *direction);
            let cos = direction.dot(p.place.normal).max(0.0) as f32;
            Lit::new(p, *direction, if seen { *irradiance * cos } else { Rgb::ZERO })
        };
        let lit: Vec<Lit> = points.iter().map(lit).collect();
        samples.extend(merged(&lit, width));
    }
    samples
}

/// A sub-pixel point with the light that one source gives it.
struct Lit {
    /// Directions towards light and view, in the sphere's own frame.
    wi: DVec3,
    wo: DVec3,
    irradiance: Rgb,
    tan_h: f64,
}

impl Lit {
    fn new(point: &SurfacePoint, direction: DVec3, irradiance: Rgb) -> Self {
        let frame = point.frame();
        let local = |w| DVec3::from(to_local(&frame, w));
        let tan_h = tan2_h(point, direction).max(0.0).sqrt();
        Self { wi: local(direction), wo: local(point.wo), irradiance, tan_h }
    }

    /// The sample of a pixel with `count` of them; `None` in the dark.
    fn sample(&self, count: u32) -> Option<Sample> {
        let geometry = Geometry::new(self.wi.into(), self.wo.into())?;
        (self.irradiance != Rgb::ZERO).then(|| (geometry.to_f32(), self.irradiance / count as f32))
    }
}

fn nearest(lit: &[Lit]) -> f64 {
    lit.iter().map(|l| l.tan_h).fold(f64::INFINITY, f64::min)
}

/// The samples of a pixel's [`SUBSAMPLES`] points, as few as the distance from the highlight allows. Along silhouettes,
/// where points are missing and views differ, all are kept.
fn merged(lit: &[Lit], width: f64) -> Vec<Sample> {
    let distance = nearest(lit);
    if lit.len() < SUBSAMPLES as usize || distance < SHARP * width {
        return lit.iter().filter_map(|l| l.sample(SUBSAMPLES)).collect();
    }
    let parts = if distance < CURVED * width { 4 } else { 1 };
    let part_of = |i: usize| quarter(i) % parts;
    let part = |k| lit.iter().enumerate().filter(|(i, _)| part_of(*i) == k).map(|(_, l)| l).collect();
    (0..parts).flat_map(|k| merge(part(k))).collect()
}

/// The quarter of the pixel in which sub-pixel position `i` lies: the leading binary digits of its coordinates.
fn quarter(i: usize) -> usize {
    (i & 1) + 2 * (i.count_ones() as usize & 1)
}

/// One sample in the mean direction of several; all of them where their directions differ, as about the poles of a
/// sphere.
fn merge(lit: Vec<&Lit>) -> Vec<Sample> {
    let lit: Vec<&Lit> = lit.into_iter().filter(|l| l.irradiance != Rgb::ZERO).collect();
    let n = lit.len().max(1) as f64;
    let (wi, wo) = (lit.iter().map(|l| l.wi).sum::<DVec3>() / n, lit.iter().map(|l| l.wo).sum::<DVec3>() / n);
    if wi.length().min(wo.length()) < STRAIGHT {
        return lit.iter().filter_map(|l| l.sample(SUBSAMPLES)).collect();
    }
    let irradiance = lit.iter().map(|l| l.irradiance).sum();
    let mean = Lit { wi: wi.normalize(), wo: wo.normalize(), irradiance, tan_h: 0.0 };
    mean.sample(SUBSAMPLES).into_iter().collect()
}

/// Width of a pixel as an angle of the normal: the diagonal of the box of its points' normals.
fn width(points: &[SurfacePoint]) -> f64 {
    let normals = || points.iter().map(|p| p.place.normal);
    let low = normals().fold(DVec3::INFINITY, DVec3::min);
    let high = normals().fold(DVec3::NEG_INFINITY, DVec3::max);
    if points.is_empty() { 0.0 } else { (high - low).length() / std::f64::consts::SQRT_2 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::zero_two;

    #[test]
    fn quarters_of_the_pixel() {
        for i in 0..SUBSAMPLES {
            let [x, y] = zero_two(i);
            let expected = usize::from(x >= 0.5) + 2 * usize::from(y >= 0.5);
            assert_eq!(quarter(i as usize), expected, "{i}");
        }
    }
}
