//! Images as a few coordinates: a linear map that never lengthens a difference.
//!
//! Pictures of related materials lie close to a space of few dimensions. The distance of two of them in that space is
//! never larger than the true one and hardly smaller: a bound that costs a thousandth of it.

use std::ops::Range;

use lookmatch_imaging::{Columns, inner_product, weighted_squared_distance};
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
    blocks: Vec<Block>,
    /// Largest factor by which the map lengthens a vector: 1 but for rounding.
    stretch: f64,
}

/// What some pixels add to the coordinates; all planes one after the other.
struct Block {
    pixels: Range<usize>,
    weights: Vec<f32>,
    /// The mean of the samples, which is subtracted first: what is short has little rounding.
    middle: Vec<f32>,
    /// Directions of the coordinates, weighted.
    directions: Columns,
}

/// Writes the three planes of a range of pixels of an image.
type Planes<'a> = dyn Fn(usize, Range<usize>, &mut [f32]) + Sync + 'a;

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
        let weights = weights.map_or_else(|| vec![1.0; pixels], <[f32]>::to_vec);
        let middle = mean(samples);
        let centred = |sample: &&[f32]| -> Vec<f32> {
            let weights = weights.iter().cycle();
            sample.iter().zip(&middle).zip(weights).map(|((v, m), w)| (v - m) * w).collect()
        };
        let centred: Vec<Vec<f32>> = samples.par_iter().map(centred).collect();
        let basis = basis(&centred, tolerance);
        let block = |first: usize| {
            let pixels = first..(first + BLOCK).min(weights.len());
            let planes = |whole: &[f32]| {
                whole.chunks_exact(weights.len()).flat_map(|p| p[pixels.clone()].to_vec()).collect()
            };
            let weights = weights[pixels.clone()].to_vec();
            let weighted = |direction: &Vec<f32>| -> Vec<f32> {
                let part: Vec<f32> = planes(direction);
                part.iter().zip(weights.iter().cycle()).map(|(v, w)| v * w).collect()
            };
            let directions: Vec<Vec<f32>> = basis.iter().map(weighted).collect();
            let directions = Columns::new(3 * pixels.len(), &directions);
            Block { middle: planes(&middle), weights, directions, pixels: pixels.clone() }
        };
        let blocks = (0..pixels).into_par_iter().step_by(BLOCK).map(block).collect();
        Self { blocks, stretch: stretch(&basis) }
    }

    /// Number of coordinates.
    pub(crate) fn len(&self) -> usize {
        self.blocks[0].directions.len()
    }

    /// Projects `count` images.
    pub(crate) fn project(&self, count: usize, planes: &Planes) -> Sketches {
        let run = |blocks: &[Block]| self.project_run(count, planes, blocks);
        let parts: Vec<(Vec<f64>, Vec<f64>)> = self.blocks.par_chunks(RUN).map(run).collect();
        let (mut sums, mut squares) = (vec![0.0; count * self.len()], vec![0.0; count]);
        for (products, lengths) in parts {
            add(&mut sums, &products);
            add(&mut squares, &lengths);
        }
        // Each coordinate is off by the error of a product, and by the rounding of a difference and of a sum.
        let unit = (Columns::PRODUCT_ERROR + 2.0 * ROUNDING) * (self.len() as f64).sqrt();
        Sketches {
            coordinates: sums.into_iter().map(|c| c as f32).collect(),
            slack: squares.into_iter().map(|square| unit * square.sqrt()).collect(),
        }
    }

    /// The sums of some blocks, and the squared lengths of what was projected.
    fn project_run(&self, count: usize, planes: &Planes, blocks: &[Block]) -> (Vec<f64>, Vec<f64>) {
        let (mut sums, mut squares) = (vec![0.0; count * self.len()], vec![0.0; count]);
        let mut buffer = vec![0.0; count * 3 * BLOCK];
        for Block { pixels, weights, middle, directions } in blocks {
            let buffer = &mut buffer[..count * middle.len()];
            for (image, part) in buffer.chunks_exact_mut(middle.len()).enumerate() {
                planes(image, pixels.clone(), part);
                squares[image] += weighted_squared_distance(part, middle, weights);
                part.iter_mut().zip(middle).for_each(|(v, m)| *v -= m);
            }
            let rows: Vec<&[f32]> = buffer.chunks_exact(middle.len()).collect();
            add(&mut sums, &directions.products(&rows));
        }
        (sums, squares)
    }

    /// A lower bound of the distance of two images, given the squared distance of their coordinates, before slack.
    pub(crate) fn least_distance(&self, squared: f64) -> f64 {
        // The root halves the error of the square; the other half is more than the rounding of a fitness.
        squared.sqrt() * (1.0 - Columns::DISTANCE_ERROR) / self.stretch
    }
}

fn add(sums: &mut [f64], values: &[f64]) {
    sums.iter_mut().zip(values).for_each(|(sum, v)| *sum += v);
}

fn mean(samples: &[&[f32]]) -> Vec<f32> {
    let mut sums = vec![0.0; samples[0].len()];
    samples.iter().for_each(|sample| sums.iter_mut().zip(*sample).for_each(|(sum, v)| *sum += f64::from(*v)));
    sums.iter().map(|sum| (sum / samples.len() as f64) as f32).collect()
}

/// Most by which the products with some directions, times weights, lengthen a vector.
fn stretch(basis: &[Vec<f32>]) -> f64 {
    // The norm of a symmetric matrix is at most its largest sum of magnitudes along a row (Gershgorin).
    let row = |i: usize| basis.iter().map(|b| inner_product(&basis[i], b).abs()).sum::<f64>();
    let norm = (0..basis.len()).into_par_iter().map(row).reduce(|| 0.0, f64::max);
    // Weighting rounds every value of every direction once more.
    norm.sqrt().max(1.0) + ROUNDING * (basis.len() as f64).sqrt()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Pictures that are smooth in two parameters, with some grain of their own.
    fn picture(pixels: usize, k: usize, grain: f32) -> Vec<f32> {
        let (a, b) = ((k as f32 * 0.618).fract(), (k as f32 * 0.414).fract());
        let value = |i: usize| {
            let x = i as f32 / pixels as f32;
            let noise = ((i * 7919 + k * 104_729) % 1009) as f32 / 1009.0;
            100.0 * a * (-(x - b).powi(2) / (0.02 + 0.1 * a)).exp() + grain * noise
        };
        (0..3 * pixels).map(value).collect()
    }

    #[test]
    fn projected_distances_are_lower_bounds_and_close() {
        for (pixels, grain) in [(7, 0.1), (1000, 0.0), (2000, 0.1), (700, 5.0)] {
            let weights: Vec<f32> = (0..pixels).map(|i| (i % 10) as f32 / 9.0).collect();
            let samples: Vec<Vec<f32>> = (0..50).map(|k| picture(pixels, k, grain)).collect();
            let slices: Vec<&[f32]> = samples.iter().map(Vec::as_slice).collect();
            let projection = Projection::fit(&slices, Some(&weights), 0.1);
            let pictures: Vec<Vec<f32>> = (0..40).map(|k| picture(pixels, 30 + k, grain)).collect();
            let copy = |image: usize, range: Range<usize>, out: &mut [f32]| {
                let planes = pictures[image].chunks_exact(pixels).zip(out.chunks_exact_mut(range.len()));
                planes.for_each(|(plane, out)| out.copy_from_slice(&plane[range.clone()]));
            };
            let sketches = projection.project(pictures.len(), &copy);
            let rows = sketches.rows(projection.len());
            let squared = Columns::new(projection.len(), &rows).squared_distances(&rows);
            for (pair, squared) in squared.into_iter().enumerate() {
                let (i, k) = (pair / pictures.len(), pair % pictures.len());
                let exact = weighted_squared_distance(&pictures[i], &pictures[k], &weights).sqrt();
                let least = projection.least_distance(squared) - sketches.slack[i] - sketches.slack[k];
                assert!(least <= exact, "{least} {exact}");
                let close = 0.9 * exact - 0.1 - 2.0 * f64::from(grain) * (pixels as f64).sqrt();
                assert!(least >= close, "{least} {exact}");
            }
        }
    }

    #[test]
    fn equal_samples_make_a_sound_projection() {
        let samples = [[0.0f32; 30]; 3];
        let projection = Projection::fit(&samples.each_ref().map(|s| s.as_slice()), None, 0.0);
        let sketches = projection.project(1, &|_, range, out| {
            assert_eq!(range, 0..10);
            out.fill(1.0);
        });
        assert!(sketches.coordinates.iter().all(|v| v.is_finite()) && sketches.slack[0].is_finite());
    }
}
