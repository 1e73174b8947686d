//! What is suspicious about given pictures: told from their background, which no material changes.
//!
//! The background of a picture and that of ours show the same checkerboard under the same light. Where one is the other turned
//! over, times a factor, or raised to a power, the picture was written in another way than is meant.

use lookmatch_imaging::{Image, luminance};
use lookmatch_materials::Material;
use lookmatch_rendering::Part;
use serde::Serialize;

use crate::from_pictures::Pictures;
use crate::{CrossStage, Plan, RemapError};

/// Something suspicious about a picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Suspicion {
    /// Rows in the reverse order fit better.
    UpsideDown,
    /// Columns in the reverse order fit better.
    Mirrored,
    /// All values lie within 0 and 1, and many at 1.
    Clipped {
        /// Share of the values that are 1.
        share: f64,
    },
    /// The background is ours to a power.
    Curved {
        /// The power.
        exponent: f64,
    },
    /// The background is ours times a factor.
    Exposed {
        /// The factor.
        factor: f64,
    },
    /// The background is another one.
    Different {
        /// Root mean square difference to ours, as a share of the mean.
        share: f64,
    },
}

/// What the background of a picture says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureCheck {
    /// `full` or `diffuse`.
    pub part: &'static str,
    /// 0 for the point light, 1 for the environment.
    pub light: usize,
    /// Root mean square difference of the background to ours, as a share of its mean: noise, another filter, another scene.
    pub background: Option<f64>,
    /// Noise of a pixel of the checkerboard, as a share of its brightness.
    pub noise: Option<f64>,
    /// What is suspicious.
    pub suspicions: Vec<Suspicion>,
}

/// Share of the values that may be exactly 1 by chance.
const AT_ONE: f64 = 1e-3;
/// A turned picture that fits so much better is no coincidence.
const TURNED: f64 = 0.5;
/// Pixels of a block whose means are compared: single ones are noisy.
const BLOCK: usize = 4;
/// Blocks that make a comparison.
const BLOCKS: usize = 16;
/// Darker than this share of the mean nothing is compared: noise and the haze of filters rule there.
const DARK: f64 = 0.02;
/// Exponents so near to 1 are 1.
const LINEAR: f64 = 0.06;
/// Factors so near to 1 are 1: a metal throws some light onto the checkerboard, which our background lacks.
const UNEXPOSED: f64 = 0.1;
/// A diffuse picture with a background darker than this share of ours is the difference of two pictures, and has none.
const SUBTRACTED: f64 = 0.1;
/// Differences above this share of the mean have reasons that are none of those above.
const LARGE: f64 = 0.15;
/// A power or a factor explains a difference if it leaves less than this share of it.
const EXPLAINED: f64 = 0.5;

/// Looks at all pictures of a source.
///
/// # Errors
/// None with a stage that was prepared for the plan.
pub fn check_pictures(
    plan: &Plan,
    stage: &CrossStage,
    pictures: &Pictures,
) -> Result<Vec<PictureCheck>, RemapError> {
    let grey = Material::parse("lambert:diffuse=0.3")?;
    let ours = [0, 1].map(|light| stage.own.views()[light].render(&grey, Part::Full));
    let coverage = plan.scene.coverage(plan.size);
    let mut checks = Vec::new();
    for (part, images) in [("full", &pictures.full), ("diffuse", &pictures.diffuse)] {
        for (light, image) in images.iter().enumerate() {
            let Some(image) = image else { continue };
            let pairs = Pairs::of(image, &ours[light], &coverage);
            let mut suspicions: Vec<Suspicion> = clipped(image).into_iter().collect();
            let is_difference = part == "diffuse" && pairs.factor().abs() < SUBTRACTED;
            let (mut background, mut noise) = (None, None);
            if pairs.0.len() >= BLOCKS && !is_difference {
                background = Some(pairs.difference(1.0, 1.0));
                noise = noise_of(image, &ours[light], &coverage);
                suspicions.extend(told_by_background(image, &ours[light], &coverage));
            }
            checks.push(PictureCheck { part, light, background, noise, suspicions });
        }
    }
    Ok(checks)
}

fn clipped(image: &Image) -> Option<Suspicion> {
    let values = image.pixels().as_flattened();
    let share = values.iter().filter(|v| **v == 1.0).count() as f64 / values.len() as f64;
    let is_clipped = share > AT_ONE && values.iter().all(|v| (0.0..=1.0).contains(v));
    is_clipped.then_some(Suspicion::Clipped { share })
}

fn told_by_background(image: &Image, ours: &Image, coverage: &[f32]) -> Option<Suspicion> {
    let blocks = |image: &Image| Pairs::of(image, ours, coverage);
    let pairs = blocks(image);
    let difference = pairs.difference(1.0, 1.0);
    // A turned picture may be exposed as well: what matters is the pattern.
    let pattern = |pairs: &Pairs| pairs.difference(pairs.factor(), 1.0);
    let as_is = pattern(&pairs);
    let last = image.width() - 1;
    let upside_down = Image::from_fn(last + 1, last + 1, |x, y| image.get(x, last - y));
    let mirrored = Image::from_fn(last + 1, last + 1, |x, y| image.get(last - x, y));
    let turned = [(upside_down, Suspicion::UpsideDown), (mirrored, Suspicion::Mirrored)];
    let turned = turned.map(|(image, suspicion)| (pattern(&blocks(&image)), suspicion));
    let best = turned.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let is_turned = |turned: &(f64, Suspicion)| turned.0 < TURNED * as_is && as_is > LARGE;
    if let Some((_, suspicion)) = best.filter(is_turned) {
        return Some(suspicion);
    }
    let (factor, exponent) = pairs.power();
    if (exponent - 1.0).abs() > LINEAR && pairs.difference(factor, exponent) < EXPLAINED * as_is {
        return Some(Suspicion::Curved { exponent });
    }
    if (pairs.factor() - 1.0).abs() > UNEXPOSED && as_is < EXPLAINED * difference {
        return Some(Suspicion::Exposed { factor: pairs.factor() });
    }
    (difference > LARGE).then_some(Suspicion::Different { share: difference })
}

/// The noise of a picture's background: how much its ratio to ours jumps from pixel to pixel. The sky, which has none, and the
/// edges of checks, where filters differ, are the lower and upper parts of all jumps.
fn noise_of(image: &Image, ours: &Image, coverage: &[f32]) -> Option<f64> {
    let light = |image: &Image, pixel: usize| f64::from(luminance(image.pixels()[pixel]));
    let background: Vec<usize> = (0..coverage.len()).filter(|k| coverage[*k] == 0.0).collect();
    let mean = background.iter().map(|k| light(ours, *k)).sum::<f64>() / background.len().max(1) as f64;
    let ratio = |pixel: usize| {
        let is_seen = coverage[pixel] == 0.0 && light(ours, pixel) > DARK * mean;
        is_seen.then(|| light(image, pixel) / light(ours, pixel))
    };
    let in_rows = background.iter().filter(|k| (*k + 1) % image.width() != 0);
    let mut jumps: Vec<f64> = in_rows.filter_map(|k| Some((ratio(k + 1)? - ratio(*k)?).abs())).collect();
    jumps.sort_by(f64::total_cmp);
    let jump = *jumps.get(jumps.len() * 4 / 5)?;
    // Four fifths of a normal distribution lie within 1.28 σ, and the difference of two values is √2 times as wide.
    Some(jump / (1.2816 * std::f64::consts::SQRT_2))
}

/// Luminances of blocks of the background: ours, theirs.
struct Pairs(Vec<[f64; 2]>);

impl Pairs {
    fn of(image: &Image, ours: &Image, coverage: &[f32]) -> Self {
        let size = image.width();
        let mut pairs = Vec::new();
        for (y, x) in (0..size / BLOCK).flat_map(|y| (0..size / BLOCK).map(move |x| (y * BLOCK, x * BLOCK))) {
            let pixels = (0..BLOCK * BLOCK).map(|k| (y + k / BLOCK) * size + x + k % BLOCK);
            if pixels.clone().any(|pixel| coverage[pixel] > 0.0) {
                continue;
            }
            let mean = |image: &Image| {
                let sum: f32 = pixels.clone().map(|pixel| luminance(image.pixels()[pixel])).sum();
                f64::from(sum) / (BLOCK * BLOCK) as f64
            };
            pairs.push([mean(ours), mean(image)]);
        }
        let mean = pairs.iter().map(|[ours, _]| ours).sum::<f64>() / pairs.len().max(1) as f64;
        pairs.retain(|[ours, _]| *ours > DARK * mean);
        Self(pairs)
    }

    /// The factor that fits best: the median of the ratios.
    fn factor(&self) -> f64 {
        let mut ratios: Vec<f64> = self.0.iter().map(|[ours, theirs]| theirs / ours).collect();
        ratios.sort_by(f64::total_cmp);
        ratios.get(ratios.len() / 2).copied().unwrap_or(1.0)
    }

    /// Factor and exponent of the power law that fits best, by least squares of logarithms.
    fn power(&self) -> (f64, f64) {
        let logs: Vec<[f64; 2]> =
            self.0.iter().filter(|pair| pair[1] > 0.0).map(|pair| pair.map(f64::ln)).collect();
        let count = logs.len().max(1) as f64;
        let mean = |k: usize| logs.iter().map(|log| log[k]).sum::<f64>() / count;
        let (x, y) = (mean(0), mean(1));
        let spread = logs.iter().map(|log| (log[0] - x).powi(2)).sum::<f64>();
        let slope = logs.iter().map(|log| (log[0] - x) * (log[1] - y)).sum::<f64>() / spread.max(1e-12);
        ((y - slope * x).exp(), slope)
    }

    /// Root mean square of what a law leaves unexplained, as a share of what it foretells on average.
    fn difference(&self, factor: f64, exponent: f64) -> f64 {
        let foretold = |ours: f64| factor * ours.powf(exponent);
        let squares: f64 =
            self.0.iter().map(|[ours, theirs]| (theirs - foretold(*ours)).powi(2)).sum::<f64>();
        let count = self.0.len() as f64;
        let mean = self.0.iter().map(|[ours, _]| foretold(*ours)).sum::<f64>() / count;
        (squares / count).sqrt() / mean.abs().max(1e-12)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 32;

    /// A floor of checks under a bright sky, brighter to the left, with a subject in the middle.
    fn picture() -> Image {
        Image::from_fn(SIZE, SIZE, |x, y| {
            let check = if (x / 4 + y / 4) % 2 == 0 { 0.2 } else { 0.8 };
            let value = if y < SIZE / 3 { 1.5 } else { check * (1.0 - x as f32 / 64.0) };
            [value; 3]
        })
    }

    fn suspicions(image: &Image) -> Vec<Suspicion> {
        let middle = |k: usize| (k % SIZE).abs_diff(SIZE / 2) < 5 && (k / SIZE).abs_diff(SIZE / 2) < 5;
        let coverage: Vec<f32> = (0..SIZE * SIZE).map(|k| if middle(k) { 1.0 } else { 0.0 }).collect();
        clipped(image).into_iter().chain(told_by_background(image, &picture(), &coverage)).collect()
    }

    fn changed(change: impl Fn(f32) -> f32) -> Image {
        let mut image = picture();
        image.pixels_mut().as_flattened_mut().iter_mut().for_each(|v| *v = change(*v));
        image
    }

    #[test]
    fn what_was_done_to_a_picture_is_told_from_its_background() {
        assert_eq!(suspicions(&picture()), []);
        assert_eq!(suspicions(&changed(|v| 1.01 * v)), []);
        let [Suspicion::Exposed { factor }] = suspicions(&changed(|v| 0.25 * v))[..] else { panic!() };
        assert!((factor - 0.25).abs() < 1e-6);
        let [Suspicion::Curved { exponent }] = suspicions(&changed(|v| 1.2 * v.powf(0.45)))[..] else {
            panic!()
        };
        assert!((exponent - 0.45).abs() < 0.02);
        let [Suspicion::Clipped { share }, ..] = suspicions(&changed(|v| v.min(1.0)))[..] else { panic!() };
        assert!((share - 0.3125).abs() < 1e-9, "{share}");
        let turned = |image: Image, x: bool| {
            let last = SIZE - 1;
            Image::from_fn(SIZE, SIZE, |i, j| if x { image.get(last - i, j) } else { image.get(i, last - j) })
        };
        assert_eq!(suspicions(&turned(picture(), false)), [Suspicion::UpsideDown]);
        assert_eq!(suspicions(&turned(changed(|v| 3.0 * v), false)), [Suspicion::UpsideDown]);
        assert_eq!(suspicions(&turned(picture(), true)), [Suspicion::Mirrored]);
        let other = Image::from_fn(SIZE, SIZE, |x, y| [0.2 + ((x / 4 * 5 + y / 4 * 3) % 7) as f32 / 4.0; 3]);
        assert!(matches!(suspicions(&other)[..], [Suspicion::Different { .. }]));
    }
}
