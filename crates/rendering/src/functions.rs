//! Some functions on a square, tabulated side by side: of the checkerboard, or of the directions from a sphere's centre.

use std::io;

use rayon::prelude::*;

use crate::flat::{Flat, Reader, Writer};

/// How many.
pub(crate) const COUNT: usize = 16;
/// Points along each side.
const SIDE: usize = 128;

/// Functions on the unit square, bilinear between the points of a grid.
#[derive(Clone, Debug)]
pub(crate) struct Functions {
    values: Vec<[f32; COUNT]>,
}

impl Functions {
    /// Tabulates functions of `u, v` in `[0, 1]`.
    pub(crate) fn new(value: impl Fn(f64, f64) -> [f32; COUNT] + Sync) -> Self {
        let unit = |k: usize| k as f64 / (SIDE - 1) as f64;
        Self {
            values: (0..SIDE * SIDE).into_par_iter().map(|i| value(unit(i % SIDE), unit(i / SIDE))).collect(),
        }
    }

    /// All functions at a point.
    #[inline(always)]
    pub(crate) fn at(&self, u: f32, v: f32) -> [f32; COUNT] {
        let last = (SIDE - 1) as f32;
        let (x, y) = ((u * last).clamp(0.0, last), (v * last).clamp(0.0, last));
        let (column, row) = ((x as usize).min(SIDE - 2), (y as usize).min(SIDE - 2));
        let (tx, ty) = (x - column as f32, y - row as f32);
        let corner = |dx: usize, dy: usize| &self.values[(row + dy) * SIDE + column + dx];
        let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
        let (wa, wb, wc, wd) = ((1.0 - tx) * (1.0 - ty), tx * (1.0 - ty), (1.0 - tx) * ty, tx * ty);
        std::array::from_fn(|k| wa * a[k] + wb * b[k] + wc * c[k] + wd * d[k])
    }
}

impl Flat for Functions {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.slice(&self.values)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(Self { values: input.vec()? })
    }
}
