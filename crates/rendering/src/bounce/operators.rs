//! What interreflection does with a lobe: rows of numbers times its coefficients.

use std::io;

use fearless_simd::{Level, Simd, dispatch, prelude::*};
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::LOBE;
use crate::flat::{Flat, Reader, Writer};
use crate::functions::COUNT;

/// Rows of numbers, each for a coefficient of the lobe.
#[derive(Clone, Debug)]
pub(super) struct Operator {
    rows: Vec<f32>,
}

impl Operator {
    /// Weighted sums of the rows that nodes hold, as many of them one after the other as `count`: `weight(i, g)` is what node
    /// `g` counts in sum `i`.
    pub(super) fn combined(
        count: usize,
        nodes: &[&[f32]],
        weight: &(dyn Fn(usize, usize) -> f64 + Sync),
    ) -> Self {
        let len = nodes.first().map_or(0, |node| node.len());
        let mut rows = vec![0.0; count * len];
        rows.par_chunks_mut(len.max(1)).enumerate().for_each(|(i, sums)| {
            for (g, node) in nodes.iter().enumerate() {
                let weight = weight(i, g) as f32;
                sums.iter_mut().zip(*node).for_each(|(sum, v)| *sum += weight * v);
            }
        });
        Self { rows }
    }

    /// Row `i` times the coefficients.
    pub(super) fn apply(&self, i: usize, lobe: &[f32; LOBE]) -> f32 {
        let row = &self.rows[i * LOBE..(i + 1) * LOBE];
        let level = Level::new();
        dispatch!(level, simd => dot(simd, row, lobe))
    }

    /// All rows times the coefficients.
    pub(super) fn apply_all(&self, lobe: &[f32; LOBE], out: &mut [f32]) {
        let level = Level::new();
        dispatch!(level, simd => {
            for (row, out) in self.rows.chunks_exact(LOBE).zip(out) {
                *out = dot(simd, row, lobe);
            }
        });
    }
}

/// The operator T, from each function χ to each.
#[derive(Clone, Debug)]
pub(super) struct Feedback {
    /// By a lobe: row `a · COUNT + b` is what χ_a gets of χ_b.
    pub(super) specular: Operator,
    /// For an albedo of 1, by the spheres that take the material's.
    pub(super) diffuse: [[f32; COUNT]; COUNT],
    /// By the spheres with a colour of their own, for each channel.
    pub(super) own: [[[f32; COUNT]; COUNT]; 3],
    /// Each channel's albedo relative to the luminance of the checkerboard's.
    pub(super) tint: [f32; 3],
}

impl Feedback {
    /// What the checkerboard gets back, in channel `c`, of the irradiance `source` that it got from the spheres:
    /// `(I − T)⁻¹ T source`. `specular` is what [`Feedback::specular`] makes of the lobe.
    pub(super) fn higher_orders(
        &self,
        specular: &[f32; COUNT * COUNT],
        albedo: f32,
        c: usize,
        source: &[f32; COUNT],
    ) -> [f32; COUNT] {
        let element = |a: usize, b: usize| {
            let diffuse = albedo * self.diffuse[a][b] + self.own[c][a][b];
            f64::from(self.tint[c] * (specular[a * COUNT + b] + diffuse))
        };
        let again = SMatrix::<f64, COUNT, COUNT>::from_fn(element);
        let source = SVector::<f64, COUNT>::from_fn(|a, _| f64::from(source[a]));
        let system = SMatrix::identity() - again;
        let more = system.lu().solve(&(again * source)).unwrap_or_else(SVector::zeros);
        std::array::from_fn(|a| more[a] as f32)
    }
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 32;
    let mut sums = [fearless_simd::f32x16::splat(simd, 0.0); 2];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for (k, sum) in sums.iter_mut().enumerate() {
            let lanes = 16 * k..16 * k + 16;
            let (a, b) = (&a[lanes.clone()], &b[lanes]);
            *sum = fearless_simd::f32x16::from_slice(simd, a)
                .mul_add(fearless_simd::f32x16::from_slice(simd, b), *sum);
        }
    }
    (sums[0] + sums[1]).reduce_sum()
}

const _: () = assert!(LOBE.is_multiple_of(32));

impl Flat for Operator {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.slice(&self.rows)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(Self { rows: input.vec()? })
    }
}

impl Flat for Feedback {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        self.specular.write(out)?;
        out.value(&self.diffuse)?;
        out.value(&self.own)?;
        out.value(&self.tint)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(Self {
            specular: Flat::read(input)?,
            diffuse: input.value()?,
            own: input.value()?,
            tint: input.value()?,
        })
    }
}
