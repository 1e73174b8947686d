//! Ring transport: the light of every pixel in the basis of the rings. See [`crate::rings`].

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::Rgb;
use crate::field::Field;
use crate::film::{Film, SUBSAMPLES, SurfacePoint, to_world};
use crate::highlights::is_near_lamp;
use crate::lobe_table::LobeTable;
use crate::product::{self, LANES, Lanes, Moments};
use crate::rings::{NODES, ROW, Ring, TERMS, chebyshev, hat_position, node};
use crate::rows::{Row, Rows};

/// Samples on the smallest ring: one for each sub-pixel point.
const LEAST_SAMPLES: f64 = SUBSAMPLES as f64;
/// Width of a look-up in units of the distance between samples: neighbours overlap, so that a small bright lamp between
/// them is missed by neither.
const OVERLAP: f64 = 1.3;
/// Largest difference of the angles of view in a bundle, in radians; angles are rounded to multiples of it, so that
/// neighbouring bundles share coefficients.
const ANGLE_STEP: f64 = 1e-3;
/// Rings sampled between two nodes. The outer intervals (θ_h above 0.3) have the longest rings by far and matter to wide
/// lobes alone: 2 there cost a third less in all, and at most 15 % more distance from the direct integral at α ≥ 0.4.
fn strata(interval: usize) -> usize {
    if interval < NODES / 2 { 3 } else { 2 }
}

/// The light that reaches all subject pixels, in the basis of the rings.
#[derive(Clone, Debug)]
pub(crate) struct Transport {
    /// The rows of [`Rows::main`], in their order.
    main: Vec<Bundle>,
    /// Those of [`Rows::more`].
    more: Vec<Bundle>,
    /// For each row of `more`, the place of its pixel in `main`.
    places: Vec<u32>,
}

/// Rows of about the same angle of view, one in each lane.
#[derive(Clone, Debug)]
struct Bundle {
    theta: f64,
    /// Lanes in use.
    len: usize,
    moments: Box<Moments>,
}

/// Bundles that are worked on by one thread without a break.
const BLOCK: usize = 32;

impl Transport {
    /// Gathers the light of all rows.
    pub(crate) fn gather(field: &Field, film: &Film, rows: &Rows) -> Self {
        let gather = |rows: &[Row]| -> Vec<Bundle> {
            bundled(rows).into_par_iter().map(|rows| Bundle::gather(field, film, rows)).collect()
        };
        let place: HashMap<u32, u32> = rows.main.iter().zip(0..).map(|(row, k)| (row.pixel, k)).collect();
        Self {
            main: gather(&rows.main),
            more: gather(&rows.more),
            places: rows.more.iter().map(|row| place[&row.pixel]).collect(),
        }
    }

    /// The radiance of all rows' pixels through some lobes: for each lobe three planes, one for each channel.
    pub(crate) fn radiance(&self, lobes: &[LobeTable]) -> Vec<[Vec<f32>; 3]> {
        let mut images = planes(&self.main, lobes);
        let more = planes(&self.more, lobes);
        images.par_iter_mut().zip(more).for_each(|(image, more)| {
            for c in 0..3 {
                self.places.iter().zip(&more[c]).for_each(|(place, v)| image[c][*place as usize] += v);
            }
        });
        images
    }
}

/// Sorted rows in runs of at most [`LANES`] that are seen under about the same angle.
fn bundled(rows: &[Row]) -> Vec<&[Row]> {
    let mut bundles = Vec::new();
    let mut rest = rows;
    while let Some(first) = rest.first() {
        let near = |row: &&Row| row.theta - first.theta <= ANGLE_STEP;
        let (bundle, after) = rest.split_at(rest.iter().take(LANES).take_while(near).count());
        bundles.push(bundle);
        rest = after;
    }
    bundles
}

/// The products of all bundles with all lobes.
fn planes(bundles: &[Bundle], lobes: &[LobeTable]) -> Vec<[Vec<f32>; 3]> {
    let blocks: Vec<Vec<[Lanes; 3]>> =
        bundles.par_chunks(BLOCK).map(|bundles| block(bundles, lobes)).collect();
    let plane = |m: usize, c: usize| -> Vec<f32> {
        let products = blocks.iter().flat_map(|block| block.iter().skip(m).step_by(lobes.len()));
        let mut plane = Vec::with_capacity(bundles.len() * LANES);
        bundles.iter().zip(products).for_each(|(b, p)| plane.extend_from_slice(&p[c][..b.len]));
        plane
    };
    (0..lobes.len()).into_par_iter().map(|m| std::array::from_fn(|c| plane(m, c))).collect()
}

/// The products of some bundles with all lobes, lobe by lobe for each bundle.
fn block(bundles: &[Bundle], lobes: &[LobeTable]) -> Vec<[Lanes; 3]> {
    let mut products = vec![[[0.0; LANES]; 3]; bundles.len() * lobes.len()];
    let mut coefficients = Vec::new();
    let mut theta = f64::NAN;
    for (bundle, out) in bundles.iter().zip(products.chunks_mut(lobes.len().max(1))) {
        if bundle.theta != theta {
            theta = bundle.theta;
            coefficients.clear();
            coefficients.extend(lobes.iter().map(|lobe| lobe.at(theta)));
        }
        product::products(&bundle.moments, &coefficients, out);
    }
    products
}

impl Bundle {
    fn gather(field: &Field, film: &Film, rows: &[Row]) -> Self {
        let mut moments = Box::new([[[0.0; LANES]; 3]; ROW]);
        for (lane, row) in rows.iter().enumerate() {
            let sums = gather_row(field, &row.views(field, film));
            for (i, sum) in sums.as_flattened().iter().enumerate() {
                (0..3).for_each(|c| moments[i][c][lane] = sum[c]);
            }
        }
        let mean = rows.iter().map(|row| row.theta).sum::<f64>() / rows.len() as f64;
        Self { theta: (mean / ANGLE_STEP).round() * ANGLE_STEP, len: rows.len(), moments }
    }
}

/// The moments of some of the [`SUBSAMPLES`] points of a pixel.
fn gather_row(field: &Field, points: &[View]) -> [[Rgb; TERMS]; NODES] {
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
    sums
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

/// A sub-pixel point with its frame.
pub(crate) struct View {
    point: SurfacePoint,
    frame: [DVec3; 3],
    cosine: f64,
    sine: f64,
}

impl View {
    pub(crate) fn new(point: SurfacePoint) -> Self {
        let cosine = point.wo.dot(point.place.normal).clamp(1e-6, 1.0);
        Self { point, frame: point.view_frame(), cosine, sine: (1.0 - cosine * cosine).sqrt() }
    }

    /// Angle of view in radians.
    pub(crate) fn angle(&self) -> f64 {
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
