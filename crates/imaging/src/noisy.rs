//! CIELAB differences of noisy pictures.
//!
//! The mean square of a difference counts noise as if it were a difference. Two pictures of each side with independent noise do
//! without: with differences `d₁ = x + n₁` and `d₂ = x + n₂`, `E[d₁d₂] = x²`. That holds of linear values; CIELAB is not
//! linear, and where noise is as large as what it lies upon it would bend the mean. So the curve is taken from pictures
//! that are smoothed over their neighbourhood: what a difference of radiance is in CIELAB is the slope of its secant between
//! the two smooth values, and the difference itself stays as noisy, and as unbiased, as it is.

use crate::colour::{LINEAR_LIMIT, LINEAR_OFFSET, LINEAR_SLOPE, XYZ_FROM_SRGB};

/// How far smoothing reaches, in pixels to each side.
const REACH: usize = 2;
/// Secants shorter than this share of the value are tangents.
const TANGENT: f32 = 1e-3;

/// Which pixels of a picture are compared, and their neighbourhoods.
#[derive(Clone, Debug)]
pub struct Neighbourhoods {
    /// For each pixel the places of those around it, itself among them.
    places: Vec<Vec<u32>>,
}

impl Neighbourhoods {
    /// Those of some pixels of a picture, given by their indices (row by row), of pictures `width` pixels wide.
    pub fn new(pixels: &[u32], width: usize) -> Self {
        let mut place_of = std::collections::HashMap::new();
        pixels.iter().enumerate().for_each(|(place, pixel)| {
            place_of.insert(*pixel as usize, place as u32);
        });
        let around = |pixel: &u32| {
            let (x, y) = (*pixel as usize % width, *pixel as usize / width);
            let columns = x.saturating_sub(REACH)..=(x + REACH).min(width - 1);
            let rows = y.saturating_sub(REACH)..=y + REACH;
            rows.flat_map(|y| columns.clone().map(move |x| y * width + x))
                .filter_map(|pixel| place_of.get(&pixel).copied())
                .collect()
        };
        Self { places: pixels.iter().map(around).collect() }
    }

    /// Each pixel for itself, for so many pixels without noise: differences are then those of CIELAB exactly.
    pub fn none(pixels: usize) -> Self {
        Self { places: (0..pixels as u32).map(|place| vec![place]).collect() }
    }

    fn smooth(&self, plane: &[f32]) -> Vec<f32> {
        let mean = |places: &Vec<u32>| {
            places.iter().map(|place| plane[*place as usize]).sum::<f32>() / places.len() as f32
        };
        self.places.iter().map(mean).collect()
    }
}

/// A picture of which one, or two with independent noise, were rendered, prepared for comparisons.
#[derive(Clone, Debug)]
pub struct NoisyLab {
    /// XYZ relative to white.
    first: [Vec<f32>; 3],
    second: Option<[Vec<f32>; 3]>,
    /// Their mean, smoothed, …
    smooth: [Vec<f32>; 3],
    /// … and compressed as CIELAB does.
    compressed: [Vec<f32>; 3],
}

/// A sum of squares and its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The sum; it may fall below 0 where noise is all that there is.
    pub sum: f64,
    /// Its standard error; 0 without noise.
    pub error: f64,
}

impl NoisyLab {
    /// Prepares one or two pictures (more are left out): planes of linear red, green and blue of the compared pixels.
    ///
    /// # Panics
    /// Without any picture, or where planes have other lengths than there are neighbourhoods.
    pub fn new(halves: &[[Vec<f32>; 3]], around: &Neighbourhoods) -> Self {
        let first = xyz(&halves[0]);
        let second = halves.get(1).map(xyz);
        let mean = |c: usize| match &second {
            Some(second) => first[c].iter().zip(&second[c]).map(|(a, b)| (a + b) / 2.0).collect(),
            None => first[c].clone(),
        };
        let smooth = std::array::from_fn(|c| around.smooth(&mean(c)));
        let compressed =
            std::array::from_fn(|c: usize| smooth[c].iter().copied().map(compress).collect::<Vec<f32>>());
        Self { first, second, smooth, compressed }
    }

    /// L*, a* and b* of the smoothed mean, one plane after the other.
    pub fn planes(&self) -> Vec<f32> {
        let pixels = self.compressed[0].len();
        let mut planes = vec![0.0; 3 * pixels];
        for k in 0..pixels {
            let value = lab(std::array::from_fn(|c| self.compressed[c][k]));
            (0..3).for_each(|c| planes[c * pixels + k] = value[c]);
        }
        planes
    }

    /// About what noise adds to [`NoisyLab::planes`]: half the difference of the two pictures, smoothed alike; zeros of one picture.
    pub fn noise(&self, around: &Neighbourhoods) -> Vec<f32> {
        let pixels = self.compressed[0].len();
        let mut planes = vec![0.0; 3 * pixels];
        let Some(second) = &self.second else { return planes };
        let half =
            |c: usize| self.first[c].iter().zip(&second[c]).map(|(a, b)| (a - b) / 2.0).collect::<Vec<f32>>();
        let halves: [Vec<f32>; 3] = std::array::from_fn(|c| around.smooth(&half(c)));
        for k in 0..pixels {
            let tangent = |c: usize| secant([self.smooth[c][k]; 2], [self.compressed[c][k]; 2]);
            let value = lab(std::array::from_fn(|c| tangent(c) * halves[c][k]));
            (0..3).for_each(|c| planes[c * pixels + k] = value[c]);
        }
        planes
    }

    /// [`NoisyLab::planes`] of a picture between two others; `share` is that of the second.
    pub fn planes_between(&self, other: &Self, share: f32) -> Vec<f32> {
        let mixed = |c: usize| {
            let pairs = self.smooth[c].iter().zip(&other.smooth[c]);
            pairs.map(|(a, b)| compress(a + share * (b - a))).collect::<Vec<f32>>()
        };
        let compressed: [Vec<f32>; 3] = std::array::from_fn(mixed);
        let none = || std::array::from_fn(|_| Vec::new());
        Self { first: none(), second: None, smooth: none(), compressed }.planes()
    }

    /// The sum of squared ΔE*76 between two pictures without their noise, each pixel's difference times its weight.
    ///
    /// # Panics
    /// Where lengths differ.
    pub fn squared_difference(&self, other: &Self, weights: &[f32]) -> Estimate {
        let is_noisy = self.second.is_some() || other.second.is_some();
        let (a2, b2) =
            (self.second.as_ref().unwrap_or(&self.first), other.second.as_ref().unwrap_or(&other.first));
        let (mut sum, mut variance) = (0.0f64, 0.0f64);
        for (k, weight) in weights.iter().enumerate() {
            let slopes: [f32; 3] = std::array::from_fn(|c| {
                let values = [self.smooth[c][k], other.smooth[c][k]];
                secant(values, [self.compressed[c][k], other.compressed[c][k]])
            });
            let d1 = lab(std::array::from_fn(|c| slopes[c] * (self.first[c][k] - other.first[c][k])));
            let d2 = lab(std::array::from_fn(|c| slopes[c] * (a2[c][k] - b2[c][k])));
            let squared = f64::from(weight * weight);
            for c in 0..3 {
                let product = f64::from(d1[c]) * f64::from(d2[c]);
                sum += squared * product;
                if is_noisy {
                    // 2x²σ² + σ⁴, with σ² = E[(d₁ − d₂)²]/2, whose own square is 3σ⁴ on average.
                    let noise = f64::from(d1[c] - d2[c]).powi(2) / 2.0;
                    variance += squared * squared * (2.0 * product.max(0.0) * noise + noise * noise / 3.0);
                }
            }
        }
        Estimate { sum, error: variance.sqrt() }
    }
}

fn xyz([r, g, b]: &[Vec<f32>; 3]) -> [Vec<f32>; 3] {
    XYZ_FROM_SRGB.map(|row| {
        let sum = row[0] + row[1] + row[2];
        let [x, y, z] = row.map(|v| (v / sum) as f32);
        r.iter().zip(g).zip(b).map(|((r, g), b)| x * r + y * g + z * b).collect()
    })
}

fn compress(t: f32) -> f32 {
    if t > LINEAR_LIMIT as f32 { t.cbrt() } else { LINEAR_SLOPE as f32 * t + LINEAR_OFFSET as f32 }
}

fn secant([a, b]: [f32; 2], [of_a, of_b]: [f32; 2]) -> f32 {
    if (a - b).abs() > TANGENT * a.abs().max(b.abs()) && a != b {
        return (of_a - of_b) / (a - b);
    }
    let middle = (a + b) / 2.0;
    if middle > LINEAR_LIMIT as f32 { middle.powf(-2.0 / 3.0) / 3.0 } else { LINEAR_SLOPE as f32 }
}

/// L*, a*, b* of a difference in compressed X, Y, Z.
fn lab([x, y, z]: [f32; 3]) -> [f32; 3] {
    [116.0 * y, 500.0 * (x - y), 200.0 * (y - z)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{lab_planes_of, squared_distance};

    const WIDTH: usize = 24;

    /// Planes of a smooth picture, of `scale` times the brightness.
    fn picture(scale: f32) -> [Vec<f32>; 3] {
        std::array::from_fn(|c| {
            let value = |k: usize| {
                let (x, y) = ((k % WIDTH) as f32 / WIDTH as f32, (k / WIDTH) as f32 / WIDTH as f32);
                scale * (0.05 + x * y + 0.3 * c as f32 * x)
            };
            (0..WIDTH * WIDTH).map(value).collect()
        })
    }

    /// Multiplies by noise whose mean is 1: mostly dark, now and then bright, as paths are.
    fn noisy(planes: &[Vec<f32>; 3], seed: u32) -> [Vec<f32>; 3] {
        let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(12345);
        planes.clone().map(|mut plane| {
            for value in &mut plane {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                // One in sixteen is seven times as bright: (7 + 15 · 0.6) / 16 = 1.
                *value *= if state >> 28 == 0 { 7.0 } else { 0.6 };
            }
            plane
        })
    }

    fn neighbourhoods() -> Neighbourhoods {
        Neighbourhoods::new(&(0..(WIDTH * WIDTH) as u32).collect::<Vec<_>>(), WIDTH)
    }

    #[test]
    fn without_noise_it_is_the_lab_difference() {
        let around = neighbourhoods();
        let (a, b) = (picture(1.0), picture(1.3));
        let lab = |p: &[Vec<f32>; 3]| {
            let mut out = vec![0.0; 3 * WIDTH * WIDTH];
            lab_planes_of([&p[0], &p[1], &p[2]], &mut out);
            out
        };
        let exact = squared_distance(&lab(&a), &lab(&b));
        let found = NoisyLab::new(&[a], &around)
            .squared_difference(&NoisyLab::new(&[b], &around), &[1.0; WIDTH * WIDTH]);
        assert!((found.sum / exact - 1.0).abs() < 0.02, "{} {exact}", found.sum);
        assert_eq!(found.error, 0.0);
        let (a, b) = (picture(1.0), picture(1.3));
        let alone = Neighbourhoods::none(WIDTH * WIDTH);
        let found = NoisyLab::new(&[a], &alone)
            .squared_difference(&NoisyLab::new(&[b], &alone), &[1.0; WIDTH * WIDTH]);
        assert!((found.sum / exact - 1.0).abs() < 1e-4, "{} {exact}", found.sum);
    }

    #[test]
    fn noise_adds_nothing_on_average() {
        let around = neighbourhoods();
        let clean = picture(1.0);
        let weights = [1.0; WIDTH * WIDTH];
        let halves = |planes: &[Vec<f32>; 3], seed| [noisy(planes, seed), noisy(planes, seed + 1)];
        let other = NoisyLab::new(&[picture(1.1)], &around);
        let exact =
            NoisyLab::new(std::slice::from_ref(&clean), &around).squared_difference(&other, &weights).sum;
        let found: Vec<Estimate> = (0..100)
            .map(|k| NoisyLab::new(&halves(&clean, 2 * k + 1), &around).squared_difference(&other, &weights))
            .collect();
        let mean = found.iter().map(|e| e.sum).sum::<f64>() / found.len() as f64;
        let spread = (found.iter().map(|e| (e.sum - mean).powi(2)).sum::<f64>() / 99.0).sqrt();
        assert!((mean - exact).abs() < 4.0 * spread / 10.0 + 0.05 * exact, "{mean} {exact} {spread}");
        let error = found.iter().map(|e| e.error).sum::<f64>() / found.len() as f64;
        assert!(error > 0.4 * spread && error < 2.5 * spread, "{error} {spread}");
    }

    #[test]
    fn noise_is_as_long_as_what_it_adds() {
        let around = Neighbourhoods::new(&(0..(WIDTH * WIDTH) as u32).collect::<Vec<_>>(), WIDTH);
        let clean = NoisyLab::new(&[picture(1.0)], &around);
        let squared = |planes: &[f32]| planes.iter().map(|v| f64::from(v * v)).sum::<f64>();
        assert_eq!(squared(&clean.noise(&around)), 0.0);
        let (mut told, mut added) = (0.0, 0.0);
        for seed in 0..20 {
            let halves = [noisy(&picture(1.0), 2 * seed), noisy(&picture(1.0), 2 * seed + 1)];
            let lab = NoisyLab::new(&halves, &around);
            told += squared(&lab.noise(&around));
            let off: Vec<f32> = lab.planes().iter().zip(clean.planes()).map(|(a, b)| a - b).collect();
            added += squared(&off);
        }
        assert!((told / added - 1.0).abs() < 0.15, "{told} {added}");
    }
}
