//! The inner loop: multilinear interpolation in a small table, texel by texel.
//!
//! A cell of the table holds the coefficients of its polynomial in the fractions, `a + b x + c y + d x y`, for four outputs
//! side by side: one texel is four vector loads and three multiply-adds, without a gather. Where texels lie in the grid is
//! found first, for a block of them: by a division where the levels of an axis are regular; where they are not, the division
//! finds one of many short bins, whose record is copied, and a comparison in registers tells on which side of the bin's level.
//! Nothing is resampled, so both are exact but for the rounding of `f32`.

use std::ops::Range;

use fearless_simd::{Level, dispatch, f32x4, prelude::*};

/// Inputs that a table may have at most.
pub const MAX_INPUTS: usize = 4;
/// Outputs that share a look-up.
const LANES: usize = 4;
/// Texels that are taken through the steps together; everything they need stays in the first-level cache.
const BLOCK: usize = 256;
/// Cells that indices in `f32` count exactly.
const MAX_CELLS: usize = 1 << 22;
/// Bins of a guide at most.
const MAX_BINS: usize = 1 << 20;

/// How an output behaves between the levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// Linear along each axis.
    Linear,
    /// The value at the nearest level of each axis, the lower of two equally near ones.
    Nearest,
}

/// A function of one to four inputs, tabulated on a grid.
#[derive(Clone, Debug)]
pub struct Lut {
    axes: Vec<Places>,
    groups: Vec<Group>,
    outputs: usize,
}

/// Up to four outputs that are looked up together.
#[derive(Clone, Debug)]
struct Group {
    between: Between,
    /// The outputs in its lanes.
    lanes: Vec<usize>,
    /// By cell: coefficients (linear) or corners (nearest), each of four lanes.
    cells: Vec<[f32; LANES]>,
}

/// What can be wrong with a table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LutError {
    /// Too many or no inputs.
    #[error("a table has 1 to {MAX_INPUTS} inputs, not {0}")]
    Inputs(usize),
    /// Levels that do not increase, or are not finite.
    #[error("the levels of input {0} do not increase")]
    Levels(usize),
    /// Levels of which some are a millionth of the whole apart.
    #[error("the levels of input {0} are too uneven: the closest must be a millionth of their range apart")]
    Uneven(usize),
    /// The number of values is not that of the grid's points.
    #[error("the grid has {expected} points; output {output} has {found} values")]
    Values {
        /// Index of the output.
        output: usize,
        /// Points of the grid.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// More cells than can be counted.
    #[error("a grid of {0} cells is too large; at most {MAX_CELLS} are accepted")]
    Cells(usize),
}

impl Lut {
    /// Tabulates outputs on the grid of some levels, increasing on each axis; an axis of one level is constant.
    ///
    /// Each output is its values in lexicographic order (the first axis slowest) and what happens between them. Values may be
    /// NaN where there is none: so are then all of the cells that touch it.
    ///
    /// # Errors
    /// Each variant of [`LutError`].
    pub fn new(levels: &[Vec<f64>], outputs: &[(Between, Vec<f64>)]) -> Result<Self, LutError> {
        if levels.is_empty() || levels.len() > MAX_INPUTS {
            return Err(LutError::Inputs(levels.len()));
        }
        let sound = |l: &Vec<f64>| {
            !l.is_empty() && l.iter().all(|v| v.is_finite()) && l.windows(2).all(|p| p[0] < p[1])
        };
        if let Some(wrong) = levels.iter().position(|l| !sound(l)) {
            return Err(LutError::Levels(wrong));
        }
        let points: usize = levels.iter().map(Vec::len).product();
        let cells: usize = levels.iter().map(|l| intervals(l)).product();
        if cells > MAX_CELLS {
            return Err(LutError::Cells(cells));
        }
        for (output, (_, values)) in outputs.iter().enumerate() {
            if values.len() != points {
                return Err(LutError::Values { output, expected: points, found: values.len() });
            }
        }
        let mut stride = cells;
        let axes = levels.iter().enumerate().map(|(axis, l)| {
            stride /= intervals(l);
            // Multiples of a power of two: as exact in `f32` as the cells' numbers.
            Places::new(l, (stride << levels.len()) as f32).ok_or(LutError::Uneven(axis))
        });
        let axes = axes.collect::<Result<_, _>>()?;
        let mut groups = Vec::new();
        for between in [Between::Linear, Between::Nearest] {
            let members: Vec<usize> = (0..outputs.len()).filter(|o| outputs[*o].0 == between).collect();
            for lanes in members.chunks(LANES) {
                let cells = tabulate(levels, outputs, lanes, between);
                groups.push(Group { between, lanes: lanes.to_vec(), cells });
            }
        }
        Ok(Self { axes, groups, outputs: outputs.len() })
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.axes.len()
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// The outputs for each texel of some planes of inputs. Inputs outside the grid count as its nearest end; NaN gives some
    /// value of the table.
    ///
    /// # Panics
    /// If there are not as many planes as inputs and outputs, or their lengths differ.
    pub fn evaluate(&self, inputs: &[&[f32]], outputs: &mut [&mut [f32]]) {
        self.evaluate_at(Level::new(), inputs, outputs);
    }

    fn evaluate_at(&self, level: Level, inputs: &[&[f32]], outputs: &mut [&mut [f32]]) {
        assert_eq!((inputs.len(), outputs.len()), (self.axes.len(), self.outputs), "planes of the table");
        let length = inputs[0].len();
        let lengths = inputs.iter().map(|p| p.len()).chain(outputs.iter().map(|p| p.len()));
        assert!(lengths.into_iter().all(|l| l == length), "planes of equal length");
        dispatch!(level, simd => match self.axes.len() {
            1 => blocks::<_, 1, 2>(simd, self, inputs, outputs),
            2 => blocks::<_, 2, 4>(simd, self, inputs, outputs),
            3 => blocks::<_, 3, 8>(simd, self, inputs, outputs),
            _ => blocks::<_, 4, 16>(simd, self, inputs, outputs),
        });
    }
}

/// Intervals between levels; one level has a single interval, of which only the lower end exists.
fn intervals(levels: &[f64]) -> usize {
    (levels.len() - 1).max(1)
}

/// What each cell holds for some outputs.
fn tabulate(
    levels: &[Vec<f64>],
    outputs: &[(Between, Vec<f64>)],
    lanes: &[usize],
    between: Between,
) -> Vec<[f32; LANES]> {
    let corners = 1 << levels.len();
    let cells: usize = levels.iter().map(|l| intervals(l)).product();
    let mut table = vec![[0.0; LANES]; cells * corners];
    for (cell, table) in table.chunks_exact_mut(corners).enumerate() {
        for (lane, output) in lanes.iter().enumerate() {
            let value = |corner| outputs[*output].1[point(levels, cell, corner)];
            let mut values: Vec<f64> = (0..corners).map(value).collect();
            if between == Between::Linear {
                // Differences along each axis turn corners into coefficients.
                for axis in 0..levels.len() {
                    for corner in (0..corners).filter(|c| c >> axis & 1 == 1) {
                        values[corner] -= values[corner & !(1 << axis)];
                    }
                }
            }
            for (corner, value) in values.iter().enumerate() {
                table[corner][lane] = *value as f32;
            }
        }
    }
    table
}

/// The point of the grid at a corner (bit `k`: the upper end of axis `k`) of a cell.
fn point(levels: &[Vec<f64>], cell: usize, corner: usize) -> usize {
    let (mut rest, mut stride, mut place) = (cell, 1, 0);
    for (axis, levels) in levels.iter().enumerate().rev() {
        let index = (rest % intervals(levels) + (corner >> axis & 1)).min(levels.len() - 1);
        place += index * stride;
        rest /= intervals(levels);
        stride *= levels.len();
    }
    place
}

/// How values of an axis become an interval and a fraction.
#[derive(Clone, Debug)]
struct Places {
    /// First and last level.
    range: [f32; 2],
    /// Intervals, or bins of the guide, per unit.
    scale: f32,
    /// The last of them.
    last: f32,
    /// What an interval adds to the place of a cell.
    stride: f32,
    /// For irregular levels.
    guide: Vec<Bin>,
}

/// A part of an axis that is short enough to have one level in it, or none, which is the last one up to its end: the level, the
/// place of the interval from it on, and one over the length of the intervals below and above.
type Bin = [f32; 4];

impl Places {
    fn new(levels: &[f64], stride: f32) -> Option<Self> {
        let (min, max) = (levels[0], levels[levels.len() - 1]);
        let count = intervals(levels);
        let step = (max - min) / count as f64;
        let is_regular =
            levels.iter().enumerate().all(|(i, v)| (v - min - i as f64 * step).abs() <= 1e-9 * step);
        let guide = if is_regular { Vec::new() } else { guide(levels, stride)? };
        let parts = if is_regular { count } else { guide.len() };
        Some(Self {
            range: [min as f32, max as f32],
            scale: if max > min { (parts as f64 / (max - min)) as f32 } else { 0.0 },
            last: (parts - 1) as f32,
            stride,
            guide,
        })
    }

    /// Writes the fractions of some values, and adds their intervals to the cells.
    #[inline(always)]
    fn find<S: Simd>(&self, simd: S, values: &[f32], fractions: &mut [f32; BLOCK], cells: &mut [f32; BLOCK]) {
        let splat = |v: f32| S::f32s::splat(simd, v);
        let (min, max, stride) = (splat(self.range[0]), splat(self.range[1]), splat(self.stride));
        let (scale, last) = (splat(self.scale), splat(self.last));
        let width = S::f32s::LEN;
        let (mut inside, mut parts, mut bins) = ([0.0; BLOCK], [0; BLOCK], [[0.0; 4]; BLOCK]);
        for first in (0..BLOCK).step_by(width) {
            let lanes = first..first + width;
            // A NaN becomes a level: it must not become an index.
            let value = S::f32s::from_slice(simd, &values[lanes.clone()]).max_precise(min).min(max);
            let position = (value - min) * scale;
            let part = position.floor().min(last);
            if self.guide.is_empty() {
                (position - part).store_slice(&mut fractions[lanes.clone()]);
                let cell = S::f32s::from_slice(simd, &cells[lanes.clone()]);
                part.mul_add(stride, cell).store_slice(&mut cells[lanes]);
            } else {
                value.store_slice(&mut inside[lanes.clone()]);
                part.to_int::<S::u32s>().store_slice(&mut parts[lanes]);
            }
        }
        if self.guide.is_empty() {
            return;
        }
        for (bin, part) in bins.iter_mut().zip(&parts) {
            *bin = self.guide[*part as usize];
        }
        for first in (0..BLOCK).step_by(width) {
            let lanes = first..first + width;
            let [level, place, below, above] = columns(simd, &bins[lanes.clone()]);
            let past = S::f32s::from_slice(simd, &inside[lanes.clone()]) - level;
            let is_below = past.simd_lt(splat(0.0));
            let fraction = is_below.select(past.mul_add(below, splat(1.0)), past * above);
            fraction.store_slice(&mut fractions[lanes.clone()]);
            let cell = S::f32s::from_slice(simd, &cells[lanes.clone()]) + place;
            (cell - is_below.select(stride, splat(0.0))).store_slice(&mut cells[lanes]);
        }
    }
}

/// Cuts an axis into bins narrower than its shortest interval; none where that would be too many.
fn guide(levels: &[f64], stride: f32) -> Option<Vec<Bin>> {
    let (min, max) = (levels[0], levels[levels.len() - 1]);
    let shortest = levels.windows(2).map(|p| p[1] - p[0]).fold(f64::INFINITY, f64::min);
    let bins = ((max - min) / shortest).ceil() as usize + 1;
    let inverse = |k: usize| levels.get(k + 1).map_or(0.0, |upper| (1.0 / (upper - levels[k])) as f32);
    let bin = |k: usize| {
        // The last interval that begins before the bin's end.
        let end = min + (max - min) * (k + 1) as f64 / bins as f64;
        let level = (levels.partition_point(|l| *l <= end).max(1) - 1).min(levels.len() - 2);
        [levels[level] as f32, level as f32 * stride, inverse(level.saturating_sub(1)), inverse(level)]
    };
    (bins <= MAX_BINS).then(|| (0..bins).map(bin).collect())
}

#[inline(always)]
fn blocks<S: Simd, const D: usize, const CORNERS: usize>(
    simd: S,
    lut: &Lut,
    inputs: &[&[f32]],
    outputs: &mut [&mut [f32]],
) {
    let length = inputs[0].len();
    let mut fractions = [[0.0; BLOCK]; D];
    let mut found = [[0.0; LANES]; BLOCK];
    for first in (0..length).step_by(BLOCK) {
        let texels = first..(first + BLOCK).min(length);
        let mut cells = [0.0; BLOCK];
        for ((axis, plane), fractions) in lut.axes.iter().zip(inputs).zip(&mut fractions) {
            let values = &plane[texels.clone()];
            if values.len() == BLOCK {
                axis.find(simd, values, fractions, &mut cells);
            } else {
                let mut padded = [axis.range[0]; BLOCK];
                padded[..values.len()].copy_from_slice(values);
                axis.find(simd, &padded, fractions, &mut cells);
            }
        }
        let cells = whole(simd, &cells);
        for group in &lut.groups {
            match group.between {
                Between::Linear => linear::<S, D, CORNERS>(simd, group, &cells, &fractions, &mut found),
                Between::Nearest => nearest::<D>(group, &cells, &fractions, &mut found),
            }
            spread(simd, &found, group, outputs, texels.clone());
        }
    }
}

/// Integers that are stored as floats.
#[inline(always)]
fn whole<S: Simd>(simd: S, cells: &[f32; BLOCK]) -> [u32; BLOCK] {
    let mut whole = [0; BLOCK];
    let width = S::f32s::LEN;
    for (from, to) in cells.chunks_exact(width).zip(whole.chunks_exact_mut(width)) {
        S::f32s::from_slice(simd, from).to_int::<S::u32s>().store_slice(to);
    }
    whole
}

/// The polynomials of the texels' cells at their fractions.
#[inline(always)]
fn linear<S: Simd, const D: usize, const CORNERS: usize>(
    simd: S,
    group: &Group,
    cells: &[u32; BLOCK],
    fractions: &[[f32; BLOCK]; D],
    found: &mut [[f32; LANES]; BLOCK],
) {
    for texel in 0..BLOCK {
        let first = cells[texel] as usize;
        let cell: &[[f32; LANES]] = &group.cells[first..first + CORNERS];
        let mut terms: [f32x4<S>; CORNERS] =
            std::array::from_fn(|corner| f32x4::from_slice(simd, &cell[corner]));
        let mut count = CORNERS;
        for fractions in fractions {
            count /= 2;
            let fraction = f32x4::splat(simd, fractions[texel]);
            for i in 0..count {
                terms[i] = terms[2 * i + 1].mul_add(fraction, terms[2 * i]);
            }
        }
        terms[0].store_slice(&mut found[texel]);
    }
}

/// The corners of the texels' cells that their fractions are nearest to.
#[inline(always)]
fn nearest<const D: usize>(
    group: &Group,
    cells: &[u32; BLOCK],
    fractions: &[[f32; BLOCK]; D],
    found: &mut [[f32; LANES]; BLOCK],
) {
    for texel in 0..BLOCK {
        let corner: usize = (0..D).map(|k| usize::from(fractions[k][texel] > 0.5) << k).sum();
        found[texel] = group.cells[cells[texel] as usize + corner];
    }
}

/// Texels of four outputs side by side into a plane for each output.
#[inline(always)]
fn spread<S: Simd>(
    simd: S,
    found: &[[f32; LANES]; BLOCK],
    group: &Group,
    outputs: &mut [&mut [f32]],
    texels: Range<usize>,
) {
    let width = S::f32s::LEN;
    for (step, found) in found[..texels.len()].chunks(width).enumerate() {
        let first = texels.start + step * width;
        if found.len() == width {
            for (plane, output) in columns(simd, found).into_iter().zip(&group.lanes) {
                plane.store_slice(&mut outputs[*output][first..first + width]);
            }
        } else {
            for (lane, output) in group.lanes.iter().enumerate() {
                for (to, found) in outputs[*output][first..].iter_mut().zip(found) {
                    *to = found[lane];
                }
            }
        }
    }
}

/// As many rows as a register has lanes, by column.
#[inline(always)]
fn columns<S: Simd>(simd: S, rows: &[[f32; 4]]) -> [S::f32s; 4] {
    let width = S::f32s::LEN;
    let load = |i: usize| S::f32s::from_slice(simd, &rows.as_flattened()[i * width..][..width]);
    // Every second lane, twice: every fourth.
    let (low, high) = (load(0).deinterleave(load(1)), load(2).deinterleave(load(3)));
    let (even, odd) = (low.0.deinterleave(high.0), low.1.deinterleave(high.1));
    [even.0, odd.0, even.1, odd.1]
}

#[cfg(test)]
#[path = "lut_tests.rs"]
mod tests;
