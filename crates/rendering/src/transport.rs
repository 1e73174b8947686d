//! Ring transport: the light of every pixel in the basis of the rings. See [`crate::rings`].

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use multiversion::multiversion;
use rayon::prelude::*;

use crate::Rgb;
use crate::field::Field;
use crate::film::{Film, SUBSAMPLES, SurfacePoint, to_world};
use crate::highlights::is_near_lamp;
use crate::lobe_table::{AnglePosition, LobeTable};
use crate::rings::{NODES, ROW, Ring, TERMS, chebyshev, hat_position, node};

/// Samples on the smallest ring: one for each sub-pixel point.
const LEAST_SAMPLES: f64 = SUBSAMPLES as f64;
/// Width of a look-up in units of the distance between samples: neighbours overlap, so that a small bright lamp between
/// them is missed by neither.
const OVERLAP: f64 = 1.3;
/// Range of angles of view, in radians, that one angle stands for: two steps of the table of lobes.
const NARROW: f64 = 0.05;
/// Sub-pixel points that share an angle of view in pixels with a wider range.
const GROUP: usize = 4;

/// Rings sampled between two nodes. The outer intervals (θ_h above 0.3) have the longest rings by far and matter to wide
/// lobes alone: 2 there cost a third less in all, and at most 15 % more distance from the direct integral at α ≥ 0.4.
fn strata(interval: usize) -> usize {
    if interval < NODES / 2 { 3 } else { 2 }
}

/// The light of one pixel, by angle of view.
#[derive(Clone, Debug)]
pub(crate) struct PixelLight {
    main: ViewLight,
    /// Further angles, where one angle cannot stand for the whole pixel: along the silhouette.
    more: Box<[ViewLight]>,
}

/// The light of the sub-pixel points that are seen under about the same angle: the moments of each channel.
#[derive(Clone, Debug)]
struct ViewLight {
    moments: [[f32; ROW]; 3],
    angle: AnglePosition,
}

impl PixelLight {
    /// Gathers the light of a pixel; the mean over all of its sub-pixel samples, those that miss the subject being 0.
    pub(crate) fn gather(field: &Field, film: &Film, pixel: usize) -> Self {
        let mut views: Vec<View> =
            film.subject_points(&field.bodies, pixel, SUBSAMPLES).into_iter().map(View::new).collect();
        let angles =
            |v: &[View]| v.iter().map(View::angle).fold((PI, 0.0f64), |(a, b), t| (a.min(t), b.max(t)));
        let (least, most) = angles(&views);
        if most - least <= NARROW {
            return Self { main: ViewLight::gather(field, &views), more: Box::default() };
        }
        views.sort_by(|a, b| a.angle().total_cmp(&b.angle()));
        let mut lights = views.chunks(GROUP).map(|group| ViewLight::gather(field, group));
        let main = lights.next().unwrap_or_else(|| ViewLight::gather(field, &[]));
        Self { main, more: lights.collect() }
    }

    /// Adds the radiance towards the eye through each of some lobes.
    pub(crate) fn add_radiance(&self, lobes: &[LobeTable], sums: &mut [Rgb]) {
        add_radiance(&self.main, lobes, sums);
        self.more.iter().for_each(|light| add_radiance(light, lobes, sums));
    }
}

impl ViewLight {
    /// Gathers the light of some of the [`SUBSAMPLES`] points of a pixel.
    fn gather(field: &Field, points: &[View]) -> Self {
        let coverage = points.len() as f64 / f64::from(SUBSAMPLES);
        let spread = normal_spread(points);
        let mut sums = [[Rgb::ZERO; TERMS]; NODES];
        for interval in 0..NODES - 1 {
            let width = node(interval + 1) - node(interval);
            let strata = strata(interval);
            for stratum in 0..strata {
                let count = interval * 3 + stratum;
                let hat = (stratum as f64 + 0.5) / strata as f64;
                let ring = RingSamples {
                    theta: node(interval) + hat * width,
                    step: width / strata as f64,
                    count,
                    spread,
                };
                let moments = ring.moments(field, points);
                for k in 0..TERMS {
                    sums[interval][k] += moments[k] * ((1.0 - hat) * coverage) as f32;
                    sums[interval + 1][k] += moments[k] * (hat * coverage) as f32;
                }
            }
        }
        add_lamps(field, points, &mut sums);
        let moments = std::array::from_fn(|c| std::array::from_fn(|i| sums[i / TERMS][i % TERMS][c]));
        let theta = points.iter().map(View::angle).sum::<f64>() / points.len().max(1) as f64;
        Self { moments, angle: AnglePosition::new(theta) }
    }
}

/// Adds the environment's lamps, each a single direction, but for those that are evaluated as highlights: `dω_i = 4 cos_d sin θ_h dθ_h dφ_h` turns its irradiance into
/// moments.
fn add_lamps(field: &Field, points: &[View], sums: &mut [[Rgb; TERMS]; NODES]) {
    for view in points {
        let far = |(direction, _): &(DVec3, Rgb)| !is_near_lamp(&view.point, *direction);
        for (direction, irradiance) in field.lamps(view.point.place).filter(far) {
            let h = (direction + view.point.wo).normalize();
            let cos_h = h.dot(view.point.place.normal).min(1.0);
            let sin_h = (1.0 - cos_h * cos_h).sqrt();
            let Some(ring) = Ring::new((view.cosine, view.sine), (cos_h, sin_h)) else { continue };
            let cos_d = view.point.wo.dot(h);
            let density = 4.0 * cos_d * sin_h * f64::from(SUBSAMPLES);
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
    frame: [DVec3; 3],
    cosine: f64,
    sine: f64,
}

impl View {
    fn new(point: SurfacePoint) -> Self {
        let cosine = point.wo.dot(point.place.normal).clamp(1e-6, 1.0);
        Self { point, frame: point.view_frame(), cosine, sine: (1.0 - cosine * cosine).sqrt() }
    }

    /// Angle of view in radians.
    fn angle(&self) -> f64 {
        self.cosine.acos()
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
        let (sin_h, cos_h) = self.theta.sin_cos();
        // As far apart along the ring as the rings are from each other.
        let samples = (TAU * sin_h / self.step).max(LEAST_SAMPLES).round() as usize;
        // A prime above their number is coprime to it: every ring visits all points, each ring in another order.
        for first in 0..points.len().min(samples) {
            let view = &points[(first * 37 + self.count * 3) % points.len()];
            if let Some(ring) = Ring::new((view.cosine, view.sine), (cos_h, sin_h)) {
                self.add_samples(field, view, &ring, (first, points.len(), samples), &mut sums);
            }
        }
        sums
    }

    /// Adds one point's share of the samples of a ring: the `first` and every `stride`-th from it of all `samples`.
    fn add_samples(
        &self,
        field: &Field,
        view: &View,
        ring: &Ring,
        (first, stride, samples): (usize, usize, usize),
        sums: &mut [Rgb; TERMS],
    ) {
        let (sin_h, cos_h) = self.theta.sin_cos();
        let spacing = 2.0 * ring.half_angle / samples as f64;
        // The golden ratio keeps neighbouring rings from sampling the same azimuths.
        let shift = (self.count as f64 * 0.618_033_988_749_895).fract();
        let weight = (spacing * self.step) as f32;
        // From sample to sample by rotation, which is cheaper than a sine and a cosine each.
        let turn = DVec2::from_angle(spacing * stride as f64);
        let mut azimuth = DVec2::from_angle(spacing * (first as f64 + shift) - ring.half_angle);
        for _ in (first..samples).step_by(stride) {
            let (cos_phi, sin_phi) = (azimuth.x, azimuth.y);
            azimuth = turn.rotate(azimuth);
            let cos_d = view.cosine * cos_h + view.sine * sin_h * cos_phi;
            let wi = [
                2.0 * cos_d * sin_h * cos_phi - view.sine,
                2.0 * cos_d * sin_h * sin_phi,
                2.0 * cos_d * cos_h - view.cosine,
            ];
            let solid_angle = 4.0 * cos_d * self.step * sin_h * spacing;
            let angle = (OVERLAP * OVERLAP * solid_angle + self.spread * self.spread).sqrt();
            let light = field.incident(&view.point.place, to_world(&view.frame, wi), angle) * weight;
            for (sum, t) in sums.iter_mut().zip(chebyshev(ring.position(cos_d))) {
                *sum += light * t as f32;
            }
        }
    }
}

/// The angle between mirror directions of neighbouring sub-pixel points of one pixel.
fn normal_spread(points: &[View]) -> f64 {
    let n = points.len().max(1) as f64;
    let mean = points.iter().map(|p| p.point.place.normal).sum::<DVec3>() / n;
    let variance = points.iter().map(|p| (p.point.place.normal - mean).length_squared()).sum::<f64>() / n;
    // A square of side s has a variance of s²/6; its mirror image is twice as wide and shared by n samples. Half of that
    // width: a wider filter blurs small pictures more than the points alias.
    ((6.0 * variance).sqrt() / n.sqrt()).min(PI / 16.0)
}

/// Lanes of the sums: a fixed number, so that all instruction sets add in the same order.
const LANES: usize = 8;
const _: () = assert!(ROW.is_multiple_of(LANES));

/// Adds `Σ c_jk J_jk` of one view of a pixel for each lobe: the moments stay in the first cache while the lobes pass by.
fn add_radiance(light: &ViewLight, lobes: &[LobeTable], sums: &mut [Rgb]) {
    for (lobe, sum) in lobes.iter().zip(sums) {
        let [red, green, blue] = &light.moments;
        let [r, g, b] = if lobe.is_grey() {
            let (low, high, t) = lobe.rows(0, light.angle);
            blended_dots(low, high, t, [red, green, blue])
        } else {
            std::array::from_fn(|c| {
                let (low, high, t) = lobe.rows(c, light.angle);
                blended_dots(low, high, t, [&light.moments[c]])[0]
            })
        };
        *sum += Rgb::new(r, g, b, 0.0);
    }
}

/// `Σ (a + t (b − a)) m` for each of some moments.
fn blended_dots<const N: usize>(
    a: &[f32; ROW],
    b: &[f32; ROW],
    t: f32,
    moments: [&[f32; ROW]; N],
) -> [f32; N] {
    let mut coefficients = [0.0; ROW];
    blend(a, b, t, &mut coefficients);
    moments.map(|m| dot(&coefficients, m))
}

#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn blend(a: &[f32; ROW], b: &[f32; ROW], t: f32, out: &mut [f32; ROW]) {
    for i in 0..ROW {
        out[i] = a[i] + t * (b[i] - a[i]);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn dot(a: &[f32; ROW], b: &[f32; ROW]) -> f32 {
    let mut sums = [0.0f32; LANES];
    for (a, b) in a.as_chunks::<LANES>().0.iter().zip(b.as_chunks::<LANES>().0) {
        for l in 0..LANES {
            sums[l] += a[l] * b[l];
        }
    }
    // Hides from the optimiser how the lanes are added up: it would split them into pairs from the start.
    let sums = std::hint::black_box(sums);
    total(&sums)
}

/// The sum of all lanes, in pairs: a chain of additions would take longer than all that comes before it.
#[inline(always)]
fn total(l: &[f32; LANES]) -> f32 {
    ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]))
}
