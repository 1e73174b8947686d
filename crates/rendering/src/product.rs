//! The inner loop: the moments of sixteen rows times the coefficients of some lobes.
//!
//! A lane of the vector registers is a row, so nothing is ever added across lanes; a tile of lobes shares each
//! moment that is loaded. Compiled for AVX-512, AVX2 and the baseline, and chosen at run time. The order of additions is the
//! same in all of them; the last rounds each product before it is added, which leaves a relative difference of 1e-6.

use fearless_simd::{Level, dispatch, prelude::*};

use crate::arcs::FUNCTION_TERMS;
use crate::bounce::{MODES, Weights};
use crate::lobe_table::Coefficients;
use crate::rings::{NODES, ROW, TERMS};

/// Rows that are multiplied together.
pub(crate) const LANES: usize = 16;

/// One number of each row.
pub(crate) type Lanes = [f32; LANES];

/// The moments of some rows: by basis function and channel.
pub(crate) type Moments = [[Lanes; 3]; ROW];

/// Neighbouring nodes that share the means of the modes.
pub(crate) const GROUP: usize = 8;
const GROUPS: usize = NODES / GROUP;
const _: () = assert!(NODES.is_multiple_of(GROUP));

/// What the checkerboard sends to some rows.
#[derive(Clone, Debug)]
pub(crate) struct Reflected {
    /// For an irradiance of 1, by node and term.
    pub(crate) board: [[Lanes; FUNCTION_TERMS]; NODES],
    /// Mean of each mode of the added irradiance over what a group of nodes sees of the checkerboard.
    pub(crate) modes: [[Lanes; MODES]; GROUPS],
    /// The groups in which any of the rows sees the checkerboard: the others are passed over.
    pub(crate) seen: [bool; GROUPS],
}

impl Reflected {
    /// Finds out which groups see the checkerboard.
    pub(crate) fn mark_seen(&mut self) {
        let nodes = self.board.chunks_exact(GROUP);
        for (seen, nodes) in self.seen.iter_mut().zip(nodes) {
            *seen = nodes.as_flattened().as_flattened().iter().any(|moment| *moment != 0.0);
        }
    }
}

impl Default for Reflected {
    fn default() -> Self {
        Self {
            board: [[[0.0; LANES]; FUNCTION_TERMS]; NODES],
            modes: [[[0.0; LANES]; MODES]; GROUPS],
            seen: [false; GROUPS],
        }
    }
}

/// Adds what a lobe reflects of the irradiance that its material adds to the checkerboard.
pub(crate) fn add_reflected(
    reflected: &Reflected,
    lobe: &Coefficients,
    weights: &Weights,
    out: &mut [Lanes; 3],
) {
    let level = Level::new();
    dispatch!(level, simd => reflected_at(simd, reflected, lobe, weights, out));
}

#[inline(always)]
fn reflected_at<S: Simd>(
    simd: S,
    reflected: &Reflected,
    lobe: &Coefficients,
    weights: &Weights,
    out: &mut [Lanes; 3],
) {
    let width = S::f32s::LEN.min(LANES);
    for first in (0..LANES).step_by(width) {
        let lanes = first..first + width;
        let load = |values: &Lanes| S::f32s::from_slice(simd, &values[lanes.clone()]);
        let mut sums: [S::f32s; 3] = std::array::from_fn(|c| load(&out[c]));
        for group in (0..GROUPS).filter(|group| reflected.seen[*group]) {
            let mut board = [S::f32s::splat(simd, 0.0); 3];
            for j in group * GROUP..(group + 1) * GROUP {
                for k in 0..FUNCTION_TERMS {
                    let moment = load(&reflected.board[j][k]);
                    let coefficients = &lobe[j * TERMS + k];
                    (0..3).for_each(|c| {
                        board[c] = S::f32s::splat(simd, coefficients[c]).mul_add(moment, board[c])
                    });
                }
            }
            let mut added = [S::f32s::splat(simd, 0.0); 3];
            for m in 0..MODES {
                let mode = load(&reflected.modes[group][m]);
                (0..3).for_each(|c| added[c] = S::f32s::splat(simd, weights[m][c]).mul_add(mode, added[c]));
            }
            (0..3).for_each(|c| sums[c] = board[c].mul_add(added[c], sums[c]));
        }
        (0..3).for_each(|c| sums[c].store_slice(&mut out[c][lanes.clone()]));
    }
}

/// For each lobe and channel, `Σ_i c_i J_i` of each row.
pub(crate) fn products(moments: &Moments, lobes: &[Coefficients], out: &mut [[Lanes; 3]]) {
    products_at(Level::new(), moments, lobes, out);
}

fn products_at(level: Level, moments: &Moments, lobes: &[Coefficients], out: &mut [[Lanes; 3]]) {
    assert_eq!(lobes.len(), out.len(), "one result for each lobe");
    dispatch!(level, simd => tiled(simd, moments, lobes, out));
}

/// Takes as many lobes at once as the registers hold sums for.
#[inline(always)]
fn tiled<S: Simd>(simd: S, moments: &Moments, lobes: &[Coefficients], out: &mut [[Lanes; 3]]) {
    if S::f32s::LEN == LANES {
        tiles::<S, 8>(simd, moments, lobes, out)
    } else {
        tiles::<S, 4>(simd, moments, lobes, out)
    }
}

#[inline(always)]
fn tiles<S: Simd, const TILE: usize>(
    simd: S,
    moments: &Moments,
    lobes: &[Coefficients],
    out: &mut [[Lanes; 3]],
) {
    let (whole, rest) = lobes.as_chunks::<TILE>();
    let (out_whole, out_rest) = out.as_chunks_mut::<TILE>();
    for (lobes, out) in whole.iter().zip(out_whole) {
        tile(simd, moments, lobes, out);
    }
    for (lobe, out) in rest.iter().zip(out_rest) {
        tile(simd, moments, std::array::from_ref(lobe), std::array::from_mut(out));
    }
}

#[inline(always)]
fn tile<S: Simd, const TILE: usize>(
    simd: S,
    moments: &Moments,
    lobes: &[Coefficients; TILE],
    out: &mut [[Lanes; 3]; TILE],
) {
    let width = S::f32s::LEN.min(LANES);
    for first in (0..LANES).step_by(width) {
        let lanes = first..first + width;
        let mut sums = [[S::f32s::splat(simd, 0.0); 3]; TILE];
        for i in 0..ROW {
            for c in 0..3 {
                let moment = S::f32s::from_slice(simd, &moments[i][c][lanes.clone()]);
                for t in 0..TILE {
                    sums[t][c] = S::f32s::splat(simd, lobes[t][i][c]).mul_add(moment, sums[t][c]);
                }
            }
        }
        for t in 0..TILE {
            (0..3).for_each(|c| sums[t][c].store_slice(&mut out[t][c][lanes.clone()]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instruction_sets_agree() {
        let value = |i: usize| ((i * 7919 % 1000) as f32 / 500.0 - 1.0).powi(3);
        let moments: Moments = std::array::from_fn(|i| {
            std::array::from_fn(|c| std::array::from_fn(|l| value(i * 48 + c * 16 + l) + 1.0))
        });
        let lobe = |m: usize| std::array::from_fn(|i| std::array::from_fn(|c| value(m * 999 + i * 3 + c)));
        let lobes: Vec<Coefficients> = (0..11).map(lobe).collect();
        let size: f32 = (0..ROW).map(|i| (lobes[0][i][0] * moments[i][0][0]).abs()).sum();
        let at = |level: Level| {
            let mut out = vec![[[0.0; LANES]; 3]; lobes.len()];
            products_at(level, &moments, &lobes, &mut out);
            out
        };
        let best = at(Level::new());
        for level in levels() {
            for (a, b) in
                best.as_flattened().as_flattened().iter().zip(at(level).as_flattened().as_flattened())
            {
                assert!((a - b).abs() < 1e-6 * size, "{level:?}: {a} {b}");
            }
        }
        let exact = |m: usize, c: usize, l: usize| -> f64 {
            (0..ROW).map(|i| f64::from(lobes[m][i][c]) * f64::from(moments[i][c][l])).sum()
        };
        assert!((f64::from(best[9][2][5]) - exact(9, 2, 5)).abs() < 1e-6 * f64::from(size));
    }

    /// Every instruction set of this processor.
    fn levels() -> Vec<Level> {
        let level = Level::new();
        let mut levels = vec![Level::baseline()];
        levels.extend(level.as_avx2().map(Level::Avx2));
        levels.push(level);
        levels
    }
}
