//! Ring transport: the light of every pixel in the basis of the rings. See [`crate::rings`].

use std::collections::HashMap;
use std::f64::consts::PI;
use std::io;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::Rgb;
use crate::arcs::{self, Density, FUNCTION_TERMS};
use crate::bounce::{Bounce, MODES, Weights};
use crate::field::Field;
use crate::film::Film;
use crate::flat::{Flat, Reader, Writer};
use crate::highlights::is_near_lamp;
use crate::lobe_table::LobeTable;
use crate::product::{self, GROUP, LANES, Lanes, Moments, Reflected};
use crate::rings::ROW;
use crate::rows::{Row, Rows, View};

/// Largest difference of the angles of view in a bundle, in radians, in a picture of 300 pixels; angles are rounded to
/// multiples of it, so that neighbouring bundles share coefficients. Pixels of small pictures span more of them, and would
/// not fill their bundles.
const ANGLE_STEP: f64 = 1e-3;

fn angle_step(film: &Film) -> f64 {
    ANGLE_STEP * (300.0 / film.size as f64).max(1.0)
}

/// Rings sampled between two nodes, inner and outer ones.
const STRATA: [usize; 2] = [7, 4];

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
    /// What comes from the checkerboard, for an irradiance of 1 and for that of each mode of the interreflection.
    reflected: Option<Box<Reflected>>,
}

/// Pictures of the subject pixels: planes of linear red, green and blue.
pub type Planes = [Vec<f32>; 3];

/// A lobe on its way to a picture.
pub(crate) struct Lobe<'a> {
    pub(crate) table: &'a LobeTable,
    /// What its material adds to the irradiance of the checkerboard.
    pub(crate) weights: Weights,
    /// False where the rings cannot hold the lobe itself, but only its mean, for interreflection.
    pub(crate) is_isotropic: bool,
}

/// Bundles that are worked on by one thread without a break.
const BLOCK: usize = 32;

impl Transport {
    /// Gathers the light of all rows; `observe` is told now and then which share of them is done.
    pub(crate) fn gather(
        field: &Field,
        film: &Film,
        rows: &Rows,
        bounce: Option<&Bounce>,
        observe: &(dyn Fn(f64) + Sync),
    ) -> Self {
        let (done, total) = (AtomicUsize::new(0), rows.main.len() + rows.more.len());
        let bundle = |rows: &[Row]| {
            let bundle = Bundle::gather(field, film, rows, bounce);
            let before = done.fetch_add(rows.len(), Ordering::Relaxed);
            observe((before + rows.len()) as f64 / total as f64);
            bundle
        };
        let gather = |rows: &[Row]| -> Vec<Bundle> {
            bundled(rows, angle_step(film)).into_par_iter().map(bundle).collect()
        };
        let place: HashMap<u32, u32> = rows.main.iter().zip(0..).map(|(row, k)| (row.pixel, k)).collect();
        Self {
            main: gather(&rows.main),
            more: gather(&rows.more),
            places: rows.more.iter().map(|row| place[&row.pixel]).collect(),
        }
    }

    /// The radiance of all rows' pixels through some lobes, each with the irradiance that its material adds to the
    /// checkerboard: for each lobe three planes, one for each channel.
    pub(crate) fn radiance(&self, lobes: &[&Lobe]) -> Vec<Planes> {
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
fn bundled(rows: &[Row], step: f64) -> Vec<&[Row]> {
    let mut bundles = Vec::new();
    let mut rest = rows;
    while let Some(first) = rest.first() {
        let near = |row: &&Row| row.theta - first.theta <= step;
        let (bundle, after) = rest.split_at(rest.iter().take(LANES).take_while(near).count());
        bundles.push(bundle);
        rest = after;
    }
    bundles
}

/// The products of all bundles with all lobes.
fn planes(bundles: &[Bundle], lobes: &[&Lobe]) -> Vec<Planes> {
    let blocks: Vec<Vec<[Lanes; 3]>> =
        bundles.par_chunks(BLOCK).map(|bundles| block(bundles, lobes)).collect();
    let plane = |m: usize, c: usize| -> Vec<f32> {
        let products = blocks.iter().flat_map(|block| block.iter().skip(m).step_by(lobes.len()));
        let mut plane = Vec::with_capacity(bundles.len() * LANES);
        for (bundle, product) in bundles.iter().zip(products) {
            // Most bundles are full: a copy of known size.
            match bundle.len {
                LANES => plane.extend_from_slice(&product[c]),
                len => plane.extend_from_slice(&product[c][..len]),
            }
        }
        plane
    };
    (0..lobes.len()).into_par_iter().map(|m| std::array::from_fn(|c| plane(m, c))).collect()
}

/// The products of some bundles with all lobes, lobe by lobe for each bundle.
fn block(bundles: &[Bundle], lobes: &[&Lobe]) -> Vec<[Lanes; 3]> {
    let mut products = vec![[[0.0; LANES]; 3]; bundles.len() * lobes.len()];
    let mut coefficients = vec![[[0.0; 3]; ROW]; lobes.len()];
    let mut theta = f64::NAN;
    for (bundle, out) in bundles.iter().zip(products.chunks_mut(lobes.len().max(1))) {
        if bundle.theta != theta {
            theta = bundle.theta;
            lobes.iter().zip(&mut coefficients).for_each(|(lobe, out)| lobe.table.at(theta, out));
        }
        product::products(&bundle.moments, &coefficients, out);
        for ((coefficients, lobe), out) in coefficients.iter().zip(lobes).zip(out) {
            if !lobe.is_isotropic {
                *out = [[0.0; LANES]; 3];
            }
            if let Some(reflected) = &bundle.reflected {
                product::add_reflected(reflected, coefficients, &lobe.weights, out);
            }
        }
    }
    products
}

impl Bundle {
    fn gather(field: &Field, film: &Film, rows: &[Row], bounce: Option<&Bounce>) -> Self {
        let mut moments = Box::new([[[0.0; LANES]; 3]; ROW]);
        let mut reflected = bounce.map(|_| Box::new(Reflected::default()));
        for (lane, row) in rows.iter().enumerate() {
            let views = row.views(field, film);
            let sums = gather_row(field, &views, row.coverage);
            if let (Some(bounce), Some(reflected)) = (bounce, &mut reflected) {
                reflected.set(lane, &sums, field, bounce, &views);
            }
            for (i, sum) in sums.as_flattened().iter().enumerate() {
                (0..3).for_each(|c| moments[i][c][lane] = sum[c]);
            }
        }
        reflected.iter_mut().for_each(|reflected| reflected.mark_seen());
        let mean = rows.iter().map(|row| row.theta).sum::<f64>() / rows.len() as f64;
        let step = angle_step(film);
        Self { theta: (mean / step).round() * step, len: rows.len(), moments, reflected }
    }
}

/// Rings between two nodes for the modes of the interreflection: only their means over the checkerboard are needed.
const MODE_STRATA: [usize; 2] = [2, 2];

impl Reflected {
    /// Sets the lane of a row whose moments are known.
    fn set(&mut self, lane: usize, moments: &arcs::Moments, field: &Field, bounce: &Bounce, points: &[View]) {
        for (board, moments) in self.board.iter_mut().zip(moments) {
            (0..FUNCTION_TERMS).for_each(|k| board[k][lane] = moments[k][3]);
        }
        let density = Density { strata: MODE_STRATA, spread: normal_spread(points) as f32 };
        let (whole, modes) = arcs::moments_with(field, &bounce.modes, points, density);
        for (group, modes_of_group) in self.modes.iter_mut().enumerate() {
            let nodes = group * GROUP..(group + 1) * GROUP;
            let board: f32 = nodes.clone().map(|j| whole[j][0][3]).sum();
            for m in 0..MODES {
                let mode: f32 = nodes.clone().map(|j| modes[j][0][m]).sum();
                modes_of_group[m][lane] = if board > 0.0 { mode / board } else { 0.0 };
            }
        }
    }
}

/// The moments of some points that cover a share of a pixel.
fn gather_row(field: &Field, points: &[View], coverage: f32) -> arcs::Moments {
    let density = Density { strata: STRATA, spread: normal_spread(points) as f32 };
    let mut moments = arcs::moments(field, points, density);
    moments.as_flattened_mut().as_flattened_mut().iter_mut().for_each(|m| *m *= coverage);
    add_lamps(field, points, coverage, &mut moments);
    moments
}

/// Adds the environment's lamps, but for those that are evaluated as highlights.
fn add_lamps(field: &Field, points: &[View], coverage: f32, moments: &mut arcs::Moments) {
    for view in points {
        let far = |(direction, _): &(DVec3, Rgb)| !is_near_lamp(&view.point, *direction);
        for (direction, irradiance) in field.lamps(view.point.place).filter(far) {
            let Some(at) = view.ring_point(direction) else { continue };
            let density = at.density * points.len() as f64 / f64::from(coverage);
            for (k, t) in at.polynomials.into_iter().enumerate() {
                let moment = irradiance * (t / density) as f32;
                for (node, hat) in at.hats {
                    (0..3).for_each(|c| moments[node][k][c] += moment[c] * hat as f32);
                }
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

impl Flat for Transport {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        self.main.write(out)?;
        self.more.write(out)?;
        out.slice(&self.places)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(Self { main: Flat::read(input)?, more: Flat::read(input)?, places: input.vec()? })
    }
}

impl Flat for Bundle {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.value(&self.theta)?;
        out.value(&(self.len as u64))?;
        out.value(&*self.moments)?;
        self.reflected.write(out)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        let (theta, len) = (input.value()?, input.value::<u64>()?);
        Ok(Self {
            theta,
            len: LANES.min(len as usize),
            moments: Box::new(input.value()?),
            reflected: Flat::read(input)?,
        })
    }
}

impl Flat for Box<Reflected> {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.value(&self.board)?;
        out.value(&self.modes)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        let mut reflected =
            Self::new(Reflected { board: input.value()?, modes: input.value()?, ..Reflected::default() });
        reflected.mark_seen();
        Ok(reflected)
    }
}
