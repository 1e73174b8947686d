//! The checkerboard as a source of light: its albedo, its irradiance, and its radiance as a texture.

use std::f32::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use crate::pyramid::Pyramid;
use crate::scene::Plane;
use crate::{Rgb, rgb};

/// Texels of the radiance texture along each side.
const TEXELS: usize = 1024;
/// Points of the smooth irradiance along each side.
const GRID: usize = 192;

/// A checkerboard whose irradiance is known.
#[derive(Clone, Debug)]
pub(crate) struct Board {
    plane: Plane,
    /// Irradiance that varies smoothly: everything but the point lights.
    smooth: Pyramid,
    /// Outgoing radiance, all lights.
    radiance: Pyramid,
}

impl Board {
    /// Tabulates the light on a checkerboard. `smooth` and `sharp` give the irradiance at a point of it: the first is
    /// interpolated between grid points, the second (point lights with their hard shadows) is evaluated per texel.
    pub(crate) fn new(
        plane: &Plane,
        smooth: impl Fn(DVec3) -> Rgb + Sync,
        sharp: impl Fn(DVec3) -> Rgb + Sync,
    ) -> Self {
        let grid = tabulate(plane, GRID, smooth);
        let mut board = Self {
            plane: plane.clone(),
            smooth: grid,
            radiance: Pyramid::new(1, 1, vec![Rgb::ZERO], false, |_| 1.0),
        };
        let step = 2.0 * plane.half_extent / TEXELS as f64;
        let quarter = |sx: f64, sz: f64| DVec3::new(sx * step / 4.0, 0.0, sz * step / 4.0);
        let corners = [quarter(-1.0, -1.0), quarter(1.0, -1.0), quarter(-1.0, 1.0), quarter(1.0, 1.0)];
        board.radiance = tabulate(plane, TEXELS, |p| {
            corners.iter().map(|c| board.exact(p + *c, sharp(p + *c))).sum::<Rgb>() / 4.0
        });
        board
    }

    /// Radiance of a point for a given irradiance from the point lights.
    pub(crate) fn exact(&self, point: DVec3, sharp: Rgb) -> Rgb {
        let (u, v) = self.position(point);
        rgb(self.plane.albedo(point)) * (self.smooth.sample(u, v, 1.0) + sharp) / PI
    }

    /// Radiance averaged over a footprint of `width` metres.
    pub(crate) fn radiance(&self, point: DVec3, width: f64) -> Rgb {
        let (u, v) = self.position(point);
        let texels = width * TEXELS as f64 / (2.0 * self.plane.half_extent);
        self.radiance.sample(u, v, texels as f32)
    }

    fn position(&self, point: DVec3) -> (f32, f32) {
        let unit = |x: f64| ((x / self.plane.half_extent + 1.0) / 2.0) as f32;
        (unit(point.x), unit(point.z))
    }
}

/// A square texture over a plane.
fn tabulate(plane: &Plane, side: usize, value: impl Fn(DVec3) -> Rgb + Sync) -> Pyramid {
    let at = |k: usize| ((k as f64 + 0.5) / side as f64 * 2.0 - 1.0) * plane.half_extent;
    let texels = (0..side * side)
        .into_par_iter()
        .map(|i| value(DVec3::new(at(i % side), plane.height, at(i / side))))
        .collect();
    Pyramid::new(side, side, texels, false, |_| 1.0)
}
