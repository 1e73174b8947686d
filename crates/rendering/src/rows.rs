//! The rows of the ring transport: which sub-pixel points share one, and in which order rows are kept.

use glam::DVec3;

use crate::field::Field;
use crate::film::{Film, SurfacePoint};
use crate::product::LANES;
use crate::rings::RingPoint;

/// Range of angles of view, in radians, that one row stands for.
const NARROW: f64 = 0.05;
/// The same in pixels with a wider range: along silhouettes, where lobes depend on the angle most.
const GRAZING: f64 = 0.02;
/// Rows of a pixel at most.
const PARTS: usize = 12;

/// A sub-pixel point with the frame whose tangent lies in the plane of its view.
#[derive(Clone, Copy)]
pub(crate) struct View {
    pub(crate) point: SurfacePoint,
    pub(crate) frame: [DVec3; 3],
    /// Of the angle of view.
    pub(crate) cosine: f64,
    pub(crate) sine: f64,
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

    /// Where light from a unit direction lies in the basis of the rings; `None` where its ring lies below the horizon.
    pub(crate) fn ring_point(&self, direction: DVec3) -> Option<RingPoint> {
        let SurfacePoint { place, wo, .. } = &self.point;
        let h = (direction + *wo).normalize();
        RingPoint::new((self.cosine, self.sine), h.dot(place.normal), wo.dot(h))
    }
}

/// The sub-pixel points of one pixel that are seen under about the same angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) pixel: u32,
    /// Which of the pixel's rows.
    part: u32,
    /// Mean angle of view, in radians.
    pub(crate) theta: f64,
    /// Share of the pixel that it covers.
    pub(crate) coverage: f32,
}

/// The rows of a picture: the first of every subject pixel, then those that some pixels have more; each part sorted by
/// angle.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    /// One for each subject pixel.
    pub(crate) main: Vec<Row>,
    /// The others.
    pub(crate) more: Vec<Row>,
}

impl Rows {
    pub(crate) fn new(field: &Field, film: &Film, pixels: &[u32]) -> Self {
        use rayon::prelude::*;
        let of_pixel = |pixel: &u32| -> Vec<Row> {
            let row = |(part, (views, coverage)): (usize, (Vec<View>, f32))| Row {
                pixel: *pixel,
                part: part as u32,
                theta: mean_angle(&views),
                coverage,
            };
            parts(field, film, *pixel).into_iter().enumerate().map(row).collect()
        };
        let rows: Vec<Vec<Row>> = pixels.par_iter().map(of_pixel).collect();
        let (mut main, mut more): (Vec<Row>, Vec<Row>) =
            rows.into_iter().flatten().partition(|row| row.part == 0);
        let by_angle =
            |a: &Row, b: &Row| a.theta.total_cmp(&b.theta).then((a.pixel, a.part).cmp(&(b.pixel, b.part)));
        main.sort_by(by_angle);
        more.sort_by(by_angle);
        Self { main, more }
    }
}

impl Row {
    /// The points that the row stands for.
    pub(crate) fn views(&self, field: &Field, film: &Film) -> Vec<View> {
        parts(field, film, self.pixel).swap_remove(self.part as usize).0
    }
}

/// The points of a pixel, in the groups that share a row, each with the share of the pixel that it covers.
fn parts(field: &Field, film: &Film, pixel: u32) -> Vec<(Vec<View>, f32)> {
    let (points, count) = film.points(&field.bodies, pixel as usize);
    let mut views: Vec<View> = points.into_iter().map(View::new).collect();
    let angles = || views.iter().map(View::angle);
    let (least, most) = (angles().fold(f64::INFINITY, f64::min), angles().fold(0.0, f64::max));
    let parts = match most - least {
        range if range <= NARROW => 1,
        range => ((range / GRAZING).ceil() as usize).min(PARTS),
    };
    views.sort_by(|a, b| a.angle().total_cmp(&b.angle()));
    let size = views.len().div_ceil(parts).max(1);
    let part = |views: &[View]| (thinned(views), views.len() as f32 / count as f32);
    if views.is_empty() { vec![(Vec::new(), 0.0)] } else { views.chunks(size).map(part).collect() }
}

/// As many of some points as there are lanes, evenly spread.
fn thinned(views: &[View]) -> Vec<View> {
    let count = views.len().min(LANES);
    (0..count).map(|k| views[k * views.len() / count]).collect()
}

fn mean_angle(views: &[View]) -> f64 {
    views.iter().map(View::angle).sum::<f64>() / views.len().max(1) as f64
}
