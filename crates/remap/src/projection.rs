//! Images as a few coordinates: a linear map that never lengthens a difference.
//!
//! Pictures of related materials lie close to a space of few dimensions. The distance of two of them in that space is
//! never larger than the true one and hardly smaller: a bound that costs a thousandth of it.

use std::ops::Range;

use lookmatch_imaging::{Columns, inner_product};
use rayon::prelude::*;

/// Pixels that are multiplied with the basis together: their part of it fits the first cache.
const BLOCK: usize = 128;
/// Blocks that one thread works through without a break.
const RUN: usize = 8;
/// Most coordinates of an image.
const COORDINATES: usize = 64;
/// Half a unit in the last place of 1 as `f32`.
const ROUNDING: f64 = 1.0 / (1u64 << 24) as f64;

/// Maps three planes of an image, weighted per pixel, to coordinates.
pub(crate) struct Projection {
    pixels: usize,
    /// Directions of the coordinates with the pixels' weights, block by block of the pixels of all three planes.
    blocks: Vec<Columns>,
    /// Largest factor by which the map lengthens a vector: 1 but for rounding.
    stretch: f64,
}

/// Writes the three planes of a range of pixels of an image, and returns the square of their weighted length.
type Planes<'a> = dyn Fn(usize, Range<usize>, &mut [f32]) -> f64 + Sync + 'a;

/// The coordinates of some images.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sketches {
    /// A row for each image.
    pub(crate) coordinates: Vec<f32>,
    /// Most by which rounding may have moved each image.
    pub(crate) slack: Vec<f64>,
}

impl Sketches {
    /// The coordinates of each image, of which there are `length`.
    pub(crate) fn rows(&self, length: usize) -> Vec<&[f32]> {
        self.coordinates.chunks_exact(length).collect()
    }

    /// Adds further images.
    pub(crate) fn extend(&mut self, more: Self) {
        self.coordinates.extend(more.coordinates);
        self.slack.extend(more.slack);
    }
}

impl Projection {
    /// Finds directions that leave at most `tolerance` of the length of each of some images (three planes each), or as
    /// little as [`COORDINATES`] directions can.
    pub(crate) fn fit(samples: &[&[f32]], weights: Option<&[f32]>, tolerance: f64) -> Self {
        let pixels = samples[0].len() / 3;
        let weight = |i: usize| weights.map_or(1.0, |w| w[i % pixels]);
        let weighted =
            |s: &&[f32]| -> Vec<f32> { s.iter().enumerate().map(|(i, v)| v * weight(i)).collect() };
        let weighted: Vec<Vec<f32>> = samples.par_iter().map(weighted).collect();
        let basis = basis(&weighted, tolerance);
        let pack = |block: Range<usize>| {
            let part = |direction: &Vec<f32>| -> Vec<f32> {
                let planes = direction.chunks_exact(pixels);
                planes.flat_map(|p| block.clone().map(|i| p[i] * weight(i))).collect()
            };
            Columns::new(3 * block.len(), &basis.iter().map(part).collect::<Vec<_>>())
        };
        let blocks = blocks(pixels).into_par_iter().map(pack).collect();
        // The norm of a symmetric matrix is at most its largest sum of magnitudes along a row (Gershgorin).
        let row = |i: usize| basis.iter().map(|b| inner_product(&basis[i], b).abs()).sum::<f64>();
        let norm = (0..basis.len()).into_par_iter().map(row).reduce(|| 0.0, f64::max);
        // Weighting rounds every value of every direction once more.
        let rounding = ROUNDING * (basis.len() as f64).sqrt();
        Self { pixels, blocks, stretch: norm.sqrt().max(1.0) + rounding }
    }

    /// Number of coordinates.
    pub(crate) fn len(&self) -> usize {
        self.blocks[0].len()
    }

    /// Projects `count` images.
    pub(crate) fn project(&self, count: usize, planes: &Planes) -> Sketches {
        let parts: Vec<(Vec<f64>, Vec<f64>)> = (blocks(self.pixels).par_chunks(RUN))
            .zip(self.blocks.par_chunks(RUN))
            .map(|(ranges, blocks)| self.project_run(count, planes, ranges, blocks))
            .collect();
        let (mut sums, mut squares) = (vec![0.0; count * self.len()], vec![0.0; count]);
        for (products, lengths) in parts {
            add(&mut sums, &products);
            add(&mut squares, &lengths);
        }
        // Each coordinate is off by the error of a product and by the rounding of a value, weighted before, and of a sum.
        let unit = (Columns::PRODUCT_ERROR + 2.0 * ROUNDING) * (self.len() as f64).sqrt();
        Sketches {
            coordinates: sums.into_iter().map(|c| c as f32).collect(),
            slack: squares.into_iter().map(|square| unit * square.sqrt()).collect(),
        }
    }

    fn project_run(
        &self,
        count: usize,
        planes: &Planes,
        ranges: &[Range<usize>],
        blocks: &[Columns],
    ) -> (Vec<f64>, Vec<f64>) {
        let (mut sums, mut squares) = (vec![0.0; count * self.len()], vec![0.0; count]);
        let mut buffer = vec![0.0; count * 3 * BLOCK];
        for (range, block) in ranges.iter().zip(blocks) {
            let buffer = &mut buffer[..count * 3 * range.len()];
            for (image, planes_out) in buffer.chunks_exact_mut(3 * range.len()).enumerate() {
                squares[image] += planes(image, range.clone(), planes_out);
            }
            let rows: Vec<&[f32]> = buffer.chunks_exact(3 * range.len()).collect();
            add(&mut sums, &block.products(&rows));
        }
        (sums, squares)
    }

    /// A lower bound of the distance of two images, given the squared distance of their coordinates, before slack.
    pub(crate) fn least_distance(&self, squared: f64) -> f64 {
        // `Columns::squared_distances` is exact to 1e-4.
        squared.sqrt() * (1.0 - 1e-4) / self.stretch
    }
}

fn add(sums: &mut [f64], values: &[f64]) {
    sums.iter_mut().zip(values).for_each(|(sum, v)| *sum += v);
}

fn blocks(pixels: usize) -> Vec<Range<usize>> {
    (0..pixels).step_by(BLOCK).map(|first| first..(first + BLOCK).min(pixels)).collect()
}

/// Orthonormal directions such that no sample keeps more than `tolerance` of its length beside them: samples
/// themselves, each time the one that is worst off, made orthonormal.
fn basis(samples: &[Vec<f32>], tolerance: f64) -> Vec<Vec<f32>> {
    let (chosen, factor) = pivots(&gram(samples), tolerance);
    let length = samples[0].len();
    let solve = |first: usize| -> Vec<Vec<f64>> {
        let range = first..(first + 3 * BLOCK).min(length);
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(chosen.len());
        for (k, sample) in chosen.iter().enumerate() {
            let mut row: Vec<f64> = samples[*sample][range.clone()].iter().map(|v| f64::from(*v)).collect();
            for (earlier, share) in rows.iter().zip(&factor[k]) {
                row.iter_mut().zip(earlier).for_each(|(v, e)| *v -= share * e);
            }
            row.iter_mut().for_each(|v| *v /= factor[k][k]);
            rows.push(row);
        }
        rows
    };
    let parts: Vec<Vec<Vec<f64>>> = (0..length).into_par_iter().step_by(3 * BLOCK).map(solve).collect();
    let direction = |k: usize| parts.iter().flat_map(|rows| rows[k].iter().map(|v| *v as f32)).collect();
    (0..chosen.len()).map(direction).collect()
}

/// All inner products.
fn gram(vectors: &[Vec<f32>]) -> Vec<Vec<f64>> {
    const PART: usize = 1024;
    let count = vectors.len();
    let part = |first: usize| -> Vec<f64> {
        let range = first..(first + PART).min(vectors[0].len());
        let row = |i: usize| {
            let range = range.clone();
            (0..=i).map(move |k| inner_product(&vectors[i][range.clone()], &vectors[k][range.clone()]))
        };
        (0..count).flat_map(row).collect()
    };
    let parts: Vec<Vec<f64>> = (0..vectors[0].len()).into_par_iter().step_by(PART).map(part).collect();
    let mut sums = vec![0.0; count * (count + 1) / 2];
    parts.iter().for_each(|part| add(&mut sums, part));
    let at = |i: usize, k: usize| sums[i.max(k) * (i.max(k) + 1) / 2 + i.min(k)];
    (0..count).map(|i| (0..count).map(|k| at(i, k)).collect()).collect()
}

/// Cholesky's factorisation with pivots: which vectors, and the rows of the factor for them.
fn pivots(gram: &[Vec<f64>], tolerance: f64) -> (Vec<usize>, Vec<Vec<f64>>) {
    let mut left: Vec<f64> = (0..gram.len()).map(|i| gram[i][i]).collect();
    let mut rows: Vec<Vec<f64>> = vec![Vec::new(); gram.len()];
    // Below this, what is left is rounding.
    let least = left.iter().fold(tolerance * tolerance, |least, v| least.max(1e-12 * v));
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < COORDINATES {
        let worst = (0..gram.len()).fold(0, |worst, i| if left[i] > left[worst] { i } else { worst });
        if left[worst] <= least && !chosen.is_empty() {
            break;
        }
        let pivot = left[worst].max(f64::MIN_POSITIVE).sqrt();
        let row = rows[worst].clone();
        for i in 0..gram.len() {
            let known: f64 = rows[i].iter().zip(&row).map(|(a, b)| a * b).sum();
            let entry = (gram[worst][i] - known) / pivot;
            rows[i].push(entry);
            left[i] -= entry * entry;
        }
        rows[worst][chosen.len()] = pivot;
        left[worst] = 0.0;
        chosen.push(worst);
    }
    let factor = chosen.iter().map(|i| rows[*i].clone()).collect();
    (chosen, factor)
}
