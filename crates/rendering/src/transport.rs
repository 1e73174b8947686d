//! Ring transport: the light of every pixel in the basis of the rings. See [`crate::rings`].

use std::f64::consts::{PI, TAU};

use multiversion::multiversion;
use rayon::prelude::*;

use crate::Rgb;
use crate::field::Field;
use crate::film::{Film, SUBSAMPLES, SurfacePoint, to_world};
use crate::lobe_table::{AnglePosition, LobeTable};
use crate::rings::{NODES, ROW, Ring, TERMS, chebyshev, hat_position, node};

/// Rings sampled between two nodes.
const STRATA: usize = 3;
/// Samples on the smallest ring: one for each sub-pixel point.
const LEAST_SAMPLES: f64 = SUBSAMPLES as f64;
/// Width of a look-up in units of the distance between samples: neighbours overlap, so that a small bright lamp between
/// them is missed by neither.
const OVERLAP: f64 = 1.3;

/// The light of one pixel: the moments of each channel, and the angle of view.
#[derive(Clone, Debug)]
pub(crate) struct PixelLight {
    moments: [[f32; ROW]; 3],
    angle: AnglePosition,
}

impl PixelLight {
    /// Gathers the light of a pixel; the mean over all of its sub-pixel samples, those that miss the subject being 0.
    pub(crate) fn gather(field: &Field, film: &Film, pixel: usize) -> Self {
        let points: Vec<View> =
            film.subject_points(&field.bodies, pixel, SUBSAMPLES).into_iter().map(View::new).collect();
        let coverage = points.len() as f64 / f64::from(SUBSAMPLES);
        let spread = normal_spread(&points);
        let mut sums = [[Rgb::ZERO; TERMS]; NODES];
        for interval in 0..NODES - 1 {
            let width = node(interval + 1) - node(interval);
            for stratum in 0..STRATA {
                let count = interval * STRATA + stratum;
                let hat = (stratum as f64 + 0.5) / STRATA as f64;
                let ring = RingSamples {
                    theta: node(interval) + hat * width,
                    step: width / STRATA as f64,
                    count,
                    spread,
                };
                let moments = ring.moments(field, &points);
                for k in 0..TERMS {
                    sums[interval][k] += moments[k] * ((1.0 - hat) * coverage) as f32;
                    sums[interval + 1][k] += moments[k] * (hat * coverage) as f32;
                }
            }
        }
        add_lamps(field, &points, &mut sums);
        let moments = std::array::from_fn(|c| std::array::from_fn(|i| sums[i / TERMS][i % TERMS][c]));
        let theta = points.iter().map(|p| p.cosine.acos()).sum::<f64>() / points.len().max(1) as f64;
        Self { moments, angle: AnglePosition::new(theta) }
    }

    /// Radiance towards the eye through a lobe.
    pub(crate) fn radiance(&self, lobe: &LobeTable) -> Rgb {
        let [red, green, blue] = &self.moments;
        if lobe.is_grey() {
            let [r, g, b] = dot3(lobe.rows(0, self.angle), red, green, blue);
            return Rgb::new(r, g, b, 0.0);
        }
        let channel = |c: usize| dot(lobe.rows(c, self.angle), &self.moments[c]);
        Rgb::new(channel(0), channel(1), channel(2), 0.0)
    }
}

/// Adds the environment's lamps, each a single direction: `dω_i = 4 cos_d sin θ_h dθ_h dφ_h` turns its irradiance into
/// moments.
fn add_lamps(field: &Field, points: &[View], sums: &mut [[Rgb; TERMS]; NODES]) {
    for view in points {
        for (direction, irradiance) in field.lamps(view.point.place) {
            let h = (direction + view.point.wo).normalize();
            let cos_h = h.dot(view.point.place.normal).min(1.0);
            let sin_h = (1.0 - cos_h * cos_h).sqrt();
            let Some(ring) = Ring::new((view.cosine, view.sine), (cos_h, sin_h)) else { continue };
            let cos_d = view.point.wo.dot(h);
            // Within the first hat function the lobe is proportional to sin θ_h, and the quotient stays finite.
            let density = 4.0 * cos_d * sin_h.max(node(1)) * f64::from(SUBSAMPLES);
            let (interval, hat) = hat_position(sin_h.atan2(cos_h));
            for (k, t) in chebyshev(ring.position(cos_d)).into_iter().enumerate() {
                let moment = irradiance * (t / density) as f32;
                sums[interval][k] += moment * (1.0 - hat) as f32;
                sums[interval + 1][k] += moment * hat as f32;
            }
        }
    }
}

/// The light of all subject pixels, in their order.
pub(crate) fn gather_all(field: &Field, film: &Film, subjects: &[u32]) -> Vec<PixelLight> {
    subjects.par_iter().map(|pixel| PixelLight::gather(field, film, *pixel as usize)).collect()
}

/// A sub-pixel point with its frame.
struct View {
    point: SurfacePoint,
    frame: [glam::DVec3; 3],
    cosine: f64,
    sine: f64,
}

impl View {
    fn new(point: SurfacePoint) -> Self {
        let cosine = point.wo.dot(point.place.normal).clamp(1e-6, 1.0);
        Self { point, frame: point.view_frame(), cosine, sine: (1.0 - cosine * cosine).sqrt() }
    }
}

/// Samples of one ring, dealt out to the sub-pixel points in turn.
struct RingSamples {
    theta: f64,
    /// Range of θ_h that the ring stands for.
    step: f64,
    /// Running number of the ring, which decides how samples are dealt out.
    count: usize,
    /// Angle between mirrored views of neighbouring sub-pixel points.
    spread: f64,
}

impl RingSamples {
    /// `∫ L T_k(x) dφ_h · step`, averaged over the points.
    fn moments(&self, field: &Field, points: &[View]) -> [Rgb; TERMS] {
        let mut sums = [Rgb::ZERO; TERMS];
        if points.is_empty() {
            return sums;
        }
        let (sin_h, cos_h) = self.theta.sin_cos();
        // As far apart along the ring as the rings are from each other.
        let samples = (TAU * sin_h / self.step).max(LEAST_SAMPLES).round() as usize;
        // The golden ratio keeps neighbouring rings from sampling the same azimuths.
        let shift = (self.count as f64 * 0.618_033_988_749_895).fract();
        for m in 0..samples {
            // 5 is coprime to the 16 points: every ring visits all of them, each ring in another order.
            let view = &points[(m * 5 + self.count * 3) % points.len()];
            let Some(ring) = Ring::new((view.cosine, view.sine), (cos_h, sin_h)) else { continue };
            let phi = ring.half_angle * (2.0 * (m as f64 + shift) / samples as f64 - 1.0);
            let (sin_phi, cos_phi) = phi.sin_cos();
            let cos_d = view.cosine * cos_h + view.sine * sin_h * cos_phi;
            let wi = [
                2.0 * cos_d * sin_h * cos_phi - view.sine,
                2.0 * cos_d * sin_h * sin_phi,
                2.0 * cos_d * cos_h - view.cosine,
            ];
            let spacing = 2.0 * ring.half_angle / samples as f64;
            let solid_angle = 4.0 * cos_d * self.step * sin_h * spacing;
            let angle = OVERLAP * (solid_angle + self.spread * self.spread).sqrt();
            let light = field.incident(&view.point.place, to_world(&view.frame, wi), angle);
            let weighted = light * (spacing * self.step) as f32;
            for (sum, t) in sums.iter_mut().zip(chebyshev(ring.position(cos_d))) {
                *sum += weighted * t as f32;
            }
        }
        sums
    }
}

/// The angle between mirror directions of neighbouring sub-pixel points of one pixel.
fn normal_spread(points: &[View]) -> f64 {
    let n = points.len().max(1) as f64;
    let mean = points.iter().map(|p| p.point.place.normal).sum::<glam::DVec3>() / n;
    let variance = points.iter().map(|p| (p.point.place.normal - mean).length_squared()).sum::<f64>() / n;
    // A square of side s has a variance of s²/6; its mirror image is twice as wide and shared by n samples.
    (2.0 * (6.0 * variance).sqrt() / n.sqrt()).min(PI / 8.0)
}

/// Lanes of the sums: a fixed number, so that every instruction set adds in the same order.
const LANES: usize = 8;
const _: () = assert!(ROW.is_multiple_of(LANES));

/// `Σ (a + t (b − a)) m` for three channels at once.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn dot3(
    (a, b, t): (&[f32; ROW], &[f32; ROW], f32),
    red: &[f32; ROW],
    green: &[f32; ROW],
    blue: &[f32; ROW],
) -> [f32; 3] {
    let mut sums = [[0.0f32; LANES]; 3];
    for i in (0..ROW).step_by(LANES) {
        for l in 0..LANES {
            let coefficient = a[i + l] + t * (b[i + l] - a[i + l]);
            sums[0][l] += coefficient * red[i + l];
            sums[1][l] += coefficient * green[i + l];
            sums[2][l] += coefficient * blue[i + l];
        }
    }
    sums.map(|lanes| lanes.iter().sum())
}

/// `Σ (a + t (b − a)) m` for one channel.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn dot((a, b, t): (&[f32; ROW], &[f32; ROW], f32), moments: &[f32; ROW]) -> f32 {
    let mut sums = [0.0f32; LANES];
    for i in (0..ROW).step_by(LANES) {
        for l in 0..LANES {
            sums[l] += (a[i + l] + t * (b[i + l] - a[i + l])) * moments[i + l];
        }
    }
    sums.iter().sum()
}
