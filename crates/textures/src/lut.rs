//! The inner loop: multilinear interpolation in a small table, texel by texel.
//!
//! A cell of the table holds the coefficients of its polynomial in the fractions, `a + b x + c y + d x y`, for four outputs
//! side by side: one texel is four vector loads and three multiply-adds, without a gather. Where texels lie in the grid is
//! found first, for a block of them: one vector operation per axis with regular levels; a look-up in a guide, which tells the
//! interval to start from, for axes with irregular ones. Both are exact but for the rounding of `f32`.

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
const MAX_BINS: usize = 4096;

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
    cells: Vec<f32>,
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
        let axes = levels.iter().map(|l| {
            stride /= intervals(l);
            Places::new(l, stride as f32)
        });
        let axes = axes.collect();
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
) -> Vec<f32> {
    let corners = 1 << levels.len();
    let cells: usize = levels.iter().map(|l| intervals(l)).product();
    let mut table = vec![0.0; cells * corners * LANES];
    for (cell, table) in table.chunks_exact_mut(corners * LANES).enumerate() {
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
                table[corner * LANES + lane] = *value as f32;
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
    /// Intervals or bins per unit.
    scale: f32,
    /// The last interval or bin.
    last: f32,
    /// What an interval adds to the index of a cell.
    stride: f32,
    /// For irregular levels.
    guide: Option<Guide>,
}

/// The intervals of irregular levels, and where to start looking for a value's.
#[derive(Clone, Debug)]
struct Guide {
    /// By bin, the interval of its lower end.
    first: Vec<u32>,
    /// By interval: its lower end, one over its length, its upper end.
    intervals: Vec<[f32; 3]>,
}

impl Places {
    fn new(levels: &[f64], stride: f32) -> Self {
        let (min, max) = (levels[0], levels[levels.len() - 1]);
        let range = [min as f32, max as f32];
        let count = intervals(levels);
        let step = (max - min) / count as f64;
        let is_regular =
            levels.iter().enumerate().all(|(i, v)| (v - min - i as f64 * step).abs() <= 1e-9 * step);
        let scale = |count: usize| if max > min { (count as f64 / (max - min)) as f32 } else { 0.0 };
        if is_regular {
            let last = (count - 1) as f32;
            return Self { range, scale: scale(count), last, stride, guide: None };
        }
        let smallest = levels.windows(2).map(|p| p[1] - p[0]).fold(f64::INFINITY, f64::min);
        let bins = (((max - min) / smallest).ceil() as usize).clamp(count, MAX_BINS);
        let lower = |bin: usize| min + (max - min) * bin as f64 / bins as f64;
        // One bin early: rounding may put a value into the bin above its own.
        let first = (0..bins).map(|bin| {
            let below = levels.partition_point(|level| *level <= lower(bin.saturating_sub(1)));
            (below.max(1) - 1).min(count - 1) as u32
        });
        let interval = |p: &[f64]| [p[0] as f32, (1.0 / (p[1] - p[0])) as f32, p[1] as f32];
        let guide = Guide { first: first.collect(), intervals: levels.windows(2).map(interval).collect() };
        Self { range, scale: scale(bins), last: (bins - 1) as f32, stride, guide: Some(guide) }
    }

    /// Writes the fractions of some values, and adds their intervals to the cells.
    #[inline(always)]
    fn find<S: Simd>(&self, simd: S, values: &[f32], fractions: &mut [f32; BLOCK], cells: &mut [f32; BLOCK]) {
        let splat = |v: f32| S::f32s::splat(simd, v);
        let width = S::f32s::LEN;
        let mut padded = [self.range[0]; BLOCK];
        padded[..values.len()].copy_from_slice(values);
        let (min, max, scale) = (splat(self.range[0]), splat(self.range[1]), splat(self.scale));
        let (last, stride) = (splat(self.last), splat(self.stride));
        for first in (0..BLOCK).step_by(width) {
            let lanes = first..first + width;
            let value = S::f32s::from_slice(simd, &padded[lanes.clone()]).max(min).min(max);
            let position = (value - min) * scale;
            let interval = position.floor().min(last);
            if self.guide.is_none() {
                (position - interval).store_slice(&mut fractions[lanes.clone()]);
                let cell = S::f32s::from_slice(simd, &cells[lanes.clone()]);
                interval.mul_add(stride, cell).store_slice(&mut cells[lanes]);
            } else {
                value.store_slice(&mut padded[lanes.clone()]);
                interval.store_slice(&mut fractions[lanes]);
            }
        }
        let Some(guide) = &self.guide else { return };
        let last = guide.intervals.len() - 1;
        for ((value, fraction), cell) in padded.iter().zip(fractions).zip(cells) {
            // A NaN casts to 0, and no bin lies past the last.
            let mut index = guide.first[(*fraction as usize).min(guide.first.len() - 1)] as usize;
            while index < last && *value >= guide.intervals[index][2] {
                index += 1;
            }
            let [lower, inverse, _] = guide.intervals[index];
            *fraction = (value - lower) * inverse;
            *cell += index as f32 * self.stride;
        }
    }
}

#[inline(always)]
fn blocks<S: Simd, const D: usize, const CORNERS: usize>(
    simd: S,
    lut: &Lut,
    inputs: &[&[f32]],
    outputs: &mut [&mut [f32]],
) {
    let length = inputs[0].len();
    for first in (0..length).step_by(BLOCK) {
        let texels = first..(first + BLOCK).min(length);
        let mut cells = [0.0; BLOCK];
        let mut fractions = [[0.0; BLOCK]; D];
        for ((axis, plane), fractions) in lut.axes.iter().zip(inputs).zip(&mut fractions) {
            axis.find(simd, &plane[texels.clone()], fractions, &mut cells);
        }
        for group in &lut.groups {
            let mut found = [0.0; BLOCK * LANES];
            match group.between {
                Between::Linear => linear::<S, D, CORNERS>(simd, group, &cells, &fractions, &mut found),
                Between::Nearest => nearest::<D, CORNERS>(group, &cells, &fractions, &mut found),
            }
            let planes = planes_of(simd, &found);
            for (lane, output) in group.lanes.iter().enumerate() {
                outputs[*output][texels.clone()].copy_from_slice(&planes[lane][..texels.len()]);
            }
        }
    }
}

/// The polynomials of the texels' cells at their fractions.
#[inline(always)]
fn linear<S: Simd, const D: usize, const CORNERS: usize>(
    simd: S,
    group: &Group,
    cells: &[f32; BLOCK],
    fractions: &[[f32; BLOCK]; D],
    found: &mut [f32; BLOCK * LANES],
) {
    let (table, _) = group.cells.as_chunks::<LANES>();
    for (texel, found) in found.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let first = cells[texel] as usize * CORNERS;
        let cell: &[[f32; LANES]] = &table[first..first + CORNERS];
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
        terms[0].store_slice(found);
    }
}

/// The corners of the texels' cells that their fractions are nearest to.
#[inline(always)]
fn nearest<const D: usize, const CORNERS: usize>(
    group: &Group,
    cells: &[f32; BLOCK],
    fractions: &[[f32; BLOCK]; D],
    found: &mut [f32; BLOCK * LANES],
) {
    let (table, _) = group.cells.as_chunks::<LANES>();
    for (texel, found) in found.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let corner: usize = (0..D).map(|k| usize::from(fractions[k][texel] > 0.5) << k).sum();
        *found = table[cells[texel] as usize * CORNERS + corner];
    }
}

/// Texels of four outputs side by side as a plane for each output.
#[inline(always)]
fn planes_of<S: Simd>(simd: S, texels: &[f32; BLOCK * LANES]) -> [[f32; BLOCK]; LANES] {
    let mut planes = [[0.0; BLOCK]; LANES];
    for (four, texels) in texels.as_chunks::<16>().0.iter().enumerate() {
        let vectors = f32x4::load_four_interleaved(simd, texels);
        for (plane, vector) in planes.iter_mut().zip(vectors) {
            vector.store_slice(&mut plane[4 * four..4 * four + 4]);
        }
    }
    planes
}

#[cfg(test)]
#[path = "lut_tests.rs"]
mod tests;
