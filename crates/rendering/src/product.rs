//! The inner loop: the moments of sixteen rows times the coefficients of some lobes.
//!
//! A lane of the vector registers is a row, so nothing is ever added across lanes; a tile of lobes shares each
//! moment that is loaded. Compiled for AVX-512, AVX2 and the baseline, and chosen at run time. The order of additions is the
//! same in all of them; the last rounds each product before it is added, which leaves a relative difference of 1e-6.

use multiversion::multiversion;
use multiversion::target::target_cfg_f;

use crate::lobe_table::Coefficients;
use crate::rings::ROW;

/// Rows that are multiplied together.
pub(crate) const LANES: usize = 16;

/// One number of each row.
pub(crate) type Lanes = [f32; LANES];

/// The moments of some rows: by basis function and channel.
pub(crate) type Moments = [[Lanes; 3]; ROW];

/// For each lobe and channel, `Σ_i c_i J_i` of each row.
pub(crate) fn products(moments: &Moments, lobes: &[Coefficients], out: &mut [[Lanes; 3]]) {
    assert_eq!(lobes.len(), out.len(), "one result for each lobe");
    dispatched(moments, lobes, out);
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn dispatched(moments: &Moments, lobes: &[Coefficients], out: &mut [[Lanes; 3]]) {
    // As many sums as fit the registers.
    if target_cfg_f!(target_feature = "avx512f") {
        tiled::<8, true>(moments, lobes, out);
    } else if target_cfg_f!(target_feature = "fma") {
        tiled::<2, true>(moments, lobes, out);
    } else {
        tiled::<1, false>(moments, lobes, out);
    }
}

#[inline(always)]
fn tiled<const TILE: usize, const FUSED: bool>(
    moments: &Moments,
    lobes: &[Coefficients],
    out: &mut [[Lanes; 3]],
) {
    let (tiles, rest) = lobes.as_chunks::<TILE>();
    let (out_tiles, out_rest) = out.as_chunks_mut::<TILE>();
    for (lobes, out) in tiles.iter().zip(out_tiles) {
        *out = tile::<TILE, FUSED>(moments, lobes);
    }
    for (lobe, out) in rest.iter().zip(out_rest) {
        *out = tile::<1, FUSED>(moments, std::array::from_ref(lobe))[0];
    }
}

#[inline(always)]
fn tile<const TILE: usize, const FUSED: bool>(
    moments: &Moments,
    lobes: &[Coefficients; TILE],
) -> [[Lanes; 3]; TILE] {
    let mut sums = [[[0.0; LANES]; 3]; TILE];
    for i in 0..ROW {
        for t in 0..TILE {
            for c in 0..3 {
                let coefficient = lobes[t][i][c];
                for l in 0..LANES {
                    let (sum, moment) = (&mut sums[t][c][l], moments[i][c][l]);
                    *sum =
                        if FUSED { coefficient.mul_add(moment, *sum) } else { *sum + coefficient * moment };
                }
            }
        }
    }
    sums
}
