//! Path-traced pictures in pairs of independent noise.
//!
//! The mean square of a difference counts noise as if it were a difference. With differences `d₁ = x + n₁` and `d₂ = x + n₂` of pictures
//! with independent noise, the mean of `d₁ d₂` is `x²`: noise adds nothing to it. Pictures that are compared share their seeds, so that
//! most of their noise is the same and cancels in the first place.

use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use lookmatch_rendering::{Illumination, Part, PathTracer, Scene, Spot, Wears};

use crate::Watch;
use crate::tables::mean;

/// Pixels that are rendered before a stop is looked for.
const BATCH: usize = 4096;

/// A scene, prepared twice with seeds of its own.
pub(crate) struct Twins {
    tracers: [PathTracer; 2],
    /// What is rendered, row by row from the top left.
    pixels: Vec<u32>,
}

/// What some pixels show, twice with independent noise.
pub(crate) struct Pair([Vec<[f32; 3]>; 2]);

/// Which pixels belong together.
pub(crate) struct Regions {
    /// For each pixel, the number of its region, if it is in one.
    pub(crate) of: Vec<Option<usize>>,
    /// How many there are.
    pub(crate) count: usize,
}

impl Twins {
    /// For pictures of `size` × `size` pixels with twice `samples` paths for each.
    pub(crate) fn prepare(scene: &Scene, size: usize, samples: u32, seed: u64) -> anyhow::Result<Self> {
        let tracer = |seed| PathTracer::prepare(scene, Illumination::All, size, samples, seed);
        let pixels = (0..(size * size) as u32).collect();
        Ok(Self { tracers: [tracer(seed)?, tracer(!seed)?], pixels })
    }

    /// Only one of so many of the pixels whose middle shows a subject.
    pub(crate) fn some_of_subjects(mut self, one_of: usize) -> Self {
        let spots = self.tracers[0].spots();
        self.pixels.retain(|pixel| spots[*pixel as usize].is_some());
        self.pixels = self.pixels.into_iter().step_by(one_of).collect();
        self
    }

    /// Its pixels by what their middles show of the subjects.
    pub(crate) fn regions(&self, count: usize, of: impl Fn(Spot) -> Option<usize>) -> Regions {
        let spots = self.tracers[0].spots();
        let region = |pixel: &u32| spots[*pixel as usize].and_then(&of);
        Regions { of: self.pixels.iter().map(region).collect(), count }
    }

    /// Weights of its pixels that fall towards silhouettes.
    pub(crate) fn weights(&self) -> Vec<f32> {
        let mask = self.tracers[0].mask();
        self.pixels.iter().map(|pixel| mask.weights()[*pixel as usize]).collect()
    }

    /// Pictures of subjects that wear some materials.
    pub(crate) fn draw(
        &self,
        materials: &[Material],
        wears: Wears,
        watch: &dyn Watch,
    ) -> anyhow::Result<Pair> {
        let one = |tracer: &PathTracer| -> anyhow::Result<Vec<[f32; 3]>> {
            let mut all = Vec::with_capacity(self.pixels.len());
            for batch in self.pixels.chunks(BATCH) {
                anyhow::ensure!(!watch.is_stopped(), "stopped");
                all.extend(tracer.radiance_dressed(materials, wears, Part::Full, batch));
            }
            Ok(all)
        };
        let [first, second] = [0, 1].map(|k| one(&self.tracers[k]));
        Ok(Pair([first?, second?]))
    }
}

impl Pair {
    /// The mean of both, as a square picture of all pixels.
    pub(crate) fn image(&self, size: usize) -> Image {
        let at = |half: usize, pixel: usize, c: usize| self.0[half][pixel][c];
        let value = |pixel: usize, c: usize| (at(0, pixel, c) + at(1, pixel, c)) / 2.0;
        Image::from_fn(size, size, |x, y| std::array::from_fn(|c| value(y * size + x, c)))
    }

    /// NRMSD of the noise in the mean of both: that of a picture beside itself with other noise, over √2.
    pub(crate) fn noise(&self) -> f64 {
        let ranges = self.ranges();
        let [first, second] = &self.0;
        let half = |c: usize| first.iter().zip(second).map(move |(a, b)| f64::from(a[c] - b[c]) / 2.0);
        mean((0..3).map(|c| mean(half(c).map(|d| d * d)).sqrt() / ranges[c]))
    }

    /// NRMSD of each region beside another picture, mean of the channels, without what noise adds; differences are multiplied by the
    /// weights of their pixels. The range is that of this whole picture.
    pub(crate) fn nrmsd(&self, other: &Self, regions: &Regions, weights: Option<&[f32]>) -> Vec<f64> {
        let ranges = self.ranges();
        let (mut sums, mut counts) = (vec![[0.0; 3]; regions.count], vec![0usize; regions.count]);
        for (k, region) in regions.of.iter().enumerate() {
            let Some(region) = *region else { continue };
            let weight = weights.map_or(1.0, |weights| f64::from(weights[k]));
            let off = |half: usize, c: usize| weight * f64::from(self.0[half][k][c] - other.0[half][k][c]);
            (0..3).for_each(|c| sums[region][c] += off(0, c) * off(1, c));
            counts[region] += 1;
        }
        let root = |sum: f64, count: usize| (sum / count.max(1) as f64).max(0.0).sqrt();
        let regions = sums.iter().zip(counts);
        regions.map(|(sum, count)| mean((0..3).map(|c| root(sum[c], count) / ranges[c]))).collect()
    }

    /// Of each channel, from its darkest to its brightest pixel.
    fn ranges(&self) -> [f64; 3] {
        let [first, second] = &self.0;
        std::array::from_fn(|c| {
            let values = first.iter().zip(second).map(|(a, b)| f64::from(a[c] + b[c]) / 2.0);
            let ends =
                values.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)));
            ends.1 - ends.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp from 0 to 1, with noise that differs from half to half.
    fn pair(gain: f32, noise: f32) -> Pair {
        let half = |k: usize| {
            // Mixed well: halves whose noise is related would not do.
            let hash = |p: usize| {
                let x = (p * 2 + k) as u32;
                let mixed = (0x7feb_352d_u32.wrapping_mul(x) >> 7 ^ x).wrapping_mul(0x846c_a68b);
                (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d) >> 16
            };
            let value = |p: usize| gain * p as f32 / 9999.0 + noise * (hash(p) as f32 / 32767.5 - 1.0);
            (0..10_000).map(|p| [value(p); 3]).collect()
        };
        Pair([half(0), half(1)])
    }

    #[test]
    fn noise_adds_nothing_to_differences() {
        let regions = Regions { of: (0..10_000).map(|p| Some(p / 5000)).collect(), count: 2 };
        let clean = pair(1.0, 0.0).nrmsd(&pair(1.1, 0.0), &regions, None);
        // √(mean (0.1 x)²) over both halves of the ramp.
        assert!((clean[0] - 0.0289).abs() < 1e-3 && (clean[1] - 0.0764).abs() < 1e-3, "{clean:?}");
        let source = pair(1.0, 0.0);
        let noisy = source.nrmsd(&pair(1.1, 0.05), &regions, None);
        assert!((noisy[1] / clean[1] - 1.0).abs() < 0.03, "{noisy:?} {clean:?}");
        // Even numbers of a width of 0.1 have a deviation of 0.1/√12, the mean of two less by √2.
        assert!((pair(1.0, 0.05).noise() - 0.0204).abs() < 0.002, "{}", pair(1.0, 0.05).noise());
    }
}
