//! Pictures beside known ones: how far apart, and what mistake would explain it.

use std::f64::consts::PI;

use lookmatch_imaging::{Image, luminance, srgb_decode, srgb_encode};

use super::closed_form::Known;
use super::finding::short;

/// Pixels are close within this share of their brightest channel.
const CLOSE: f32 = 0.01;
/// What is darker than this share of the brightest pixel is compared with that instead.
const DARK: f32 = 0.02;
/// Pixels whose radiance differs by more than this share of it within are not compared: noise would tell more than they do.
const SMOOTH: f32 = 0.06;
/// A mistake explains a picture if this share of its pixels is as it would make them.
const EXPLAINED: f64 = 0.9;

/// The brightest value.
pub(crate) fn brightest(image: &Image) -> f32 {
    image.pixels().iter().flatten().fold(0.0, |a, b| a.max(*b))
}

fn largest(pixel: [f32; 3]) -> f32 {
    pixel[0].max(pixel[1]).max(pixel[2])
}

impl Known {
    /// Pixels of even radiance that a choice by the share of the subject in them takes.
    pub(crate) fn smooth(&self, takes: impl Fn(f32) -> bool) -> Vec<bool> {
        self.even(SMOOTH, takes)
    }

    /// Those whose radiance differs within by a share of it at most.
    pub(crate) fn even(&self, most: f32, takes: impl Fn(f32) -> bool) -> Vec<bool> {
        let dark = DARK * brightest(&self.image);
        let pixels = self.image.pixels().iter().zip(&self.spread).zip(&self.cover);
        pixels.map(|((p, spread), cover)| takes(*cover) && *spread <= most * largest(*p).max(dark)).collect()
    }

    /// Those of the spheres.
    pub(crate) fn subject(&self) -> Vec<bool> {
        self.smooth(|cover| cover > 0.999)
    }
}

/// Two pictures averaged over squares of pixels that are all chosen, so that noise counts for less; which squares are.
pub(crate) fn coarse(got: &Image, expected: &Image, chosen: &[bool]) -> (Image, Image, Vec<bool>) {
    const SIDE: usize = 3;
    let (width, height) = (got.width() / SIDE, got.height() / SIDE);
    let within =
        |x: usize, y: usize| (0..SIDE * SIDE).map(move |k| (SIDE * x + k % SIDE, SIDE * y + k / SIDE));
    let averaged = |image: &Image| {
        let share = 1.0 / (SIDE * SIDE) as f32;
        let sum = |x, y, c: usize| within(x, y).map(|(x, y)| share * image.get(x, y)[c]).sum();
        Image::from_fn(width, height, |x, y| [sum(x, y, 0), sum(x, y, 1), sum(x, y, 2)])
    };
    let squares =
        (0..width * height).map(|k| within(k % width, k / width).all(|(x, y)| chosen[y * got.width() + x]));
    (averaged(got), averaged(expected), squares.collect())
}

/// The share of chosen pixels that are close to what is expected, within a multiple of 1 %.
pub(crate) fn share_close(got: &Image, expected: &Image, chosen: &[bool], times: f32) -> f64 {
    let dark = DARK * brightest(expected);
    let is_close = |(g, e): (&[f32; 3], &[f32; 3])| {
        (0..3).all(|c| (g[c] - e[c]).abs() <= times * CLOSE * largest(*e).max(dark))
    };
    let pairs = got.pixels().iter().zip(expected.pixels()).zip(chosen).filter(|(_, chosen)| **chosen);
    mean(pairs.map(|(pair, _)| f64::from(u8::from(is_close(pair)))))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
    if count == 0 { f64::NAN } else { sum / f64::from(count) }
}

/// The middle value; NaN of none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Values beside expected ones, of chosen pixels that are not dark.
pub(crate) fn pairs(got: &Image, expected: &Image, chosen: &[bool]) -> Vec<(f64, f64)> {
    let dark = DARK * brightest(expected);
    let pixels = got.pixels().iter().zip(expected.pixels()).zip(chosen).filter(|(_, chosen)| **chosen);
    let values = pixels.flat_map(|((g, e), _)| (0..3).map(|c| (g[c], e[c])));
    values.filter(|(_, e)| *e > dark).map(|(g, e)| (f64::from(g), f64::from(e))).collect()
}

/// The median of what came over what was expected.
pub(crate) fn median_ratio(got: &Image, expected: &Image, chosen: &[bool]) -> f64 {
    median(pairs(got, expected, chosen).into_iter().map(|(g, e)| g / e).collect())
}

/// The power of what was expected that came: 1 for a linear picture.
pub(crate) fn exponent(got: &Image, expected: &Image, chosen: &[bool]) -> f64 {
    let logs: Vec<(f64, f64)> = pairs(got, expected, chosen)
        .iter()
        .filter(|(g, _)| *g > 0.0)
        .map(|(g, e)| (e.ln(), g.ln()))
        .collect();
    let (x, y) = (mean(logs.iter().map(|l| l.0)), mean(logs.iter().map(|l| l.1)));
    let (xy, xx) =
        logs.iter().fold((0.0, 0.0), |(xy, xx), l| (xy + (l.0 - x) * (l.1 - y), xx + (l.0 - x).powi(2)));
    xy / xx
}

/// Root mean square of the difference of two pictures.
pub(crate) fn rms(a: &Image, b: &Image) -> f64 {
    let pixels = a.pixels().iter().flatten().zip(b.pixels().iter().flatten());
    mean(pixels.map(|(a, b)| f64::from(a - b).powi(2))).sqrt()
}

/// How alike two pictures are whatever their exposure: 1 for proportional ones.
pub(crate) fn likeness(got: &Image, expected: &Image, chosen: &[bool]) -> f64 {
    let mut sums = [0.0; 3];
    for ((g, e), _) in got.pixels().iter().zip(expected.pixels()).zip(chosen).filter(|(_, chosen)| **chosen) {
        for c in 0..3 {
            let (g, e) = (f64::from(g[c]), f64::from(e[c]));
            sums = [sums[0] + g * e, sums[1] + g * g, sums[2] + e * e];
        }
    }
    sums[0] / (sums[1] * sums[2]).sqrt().max(f64::MIN_POSITIVE)
}

/// A mistake, and the picture that it makes.
pub(crate) struct Suspect {
    pub(crate) words: String,
    pub(crate) picture: Image,
}

impl Suspect {
    pub(crate) fn new(words: impl Into<String>, picture: Image) -> Self {
        Self { words: words.into(), picture }
    }
}

/// A picture changed pixel by pixel.
pub(crate) fn mapped(image: &Image, change: impl Fn([f32; 3]) -> [f32; 3]) -> Image {
    Image::from_fn(image.width(), image.height(), |x, y| change(image.get(x, y)))
}

/// Mistakes that change pixels whatever they show.
pub(crate) fn tones(expected: &Image) -> Vec<Suspect> {
    let value =
        |words: &str, change: fn(f32) -> f32| Suspect::new(words, mapped(expected, |p| p.map(change)));
    vec![
        value("pixels are clipped at 1", |v| v.min(1.0)),
        value("pixels are sRGB-encoded; linear radiance is expected", srgb_encode),
        value("pixels are sRGB-encoded and clipped; linear radiance is expected", |v| {
            srgb_encode(v.min(1.0))
        }),
        value("pixels are gamma-encoded (power 1/2.2); linear radiance is expected", |v| v.powf(1.0 / 2.2)),
        value("pixels are sRGB-decoded: they are linear already", srgb_decode),
        value("a tone curve is applied (Reinhard's, x / (1 + x))", |v| v / (1.0 + v)),
        value("a tone curve is applied (1 − exp(−x))", |v| 1.0 - (-v).exp()),
        Suspect::new(
            "red and blue are exchanged: channels are read or written as BGR",
            mapped(expected, |p| [p[2], p[1], p[0]]),
        ),
        Suspect::new("colours are lost: the picture is grey", mapped(expected, |p| [luminance(p); 3])),
    ]
}

/// The mistake that explains a picture, if one does: as it is, or in another exposure.
pub(crate) fn explain(
    got: &Image,
    expected: &Image,
    chosen: &[bool],
    suspects: &[Suspect],
) -> Option<String> {
    let share = |picture: &Image| share_close(got, picture, chosen, 2.0);
    let honest = share(expected);
    let best = suspects.iter().map(|s| (share(&s.picture), s)).max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((found, suspect)) = best
        && found >= EXPLAINED
        && found > honest + 0.02
    {
        return Some(suspect.words.clone());
    }
    let scaled = |picture: &Image| {
        let factor = median_ratio(got, picture, chosen);
        let bright = mapped(picture, |p| p.map(|v| v * factor as f32));
        (if factor.is_finite() { share(&bright) } else { 0.0 }, factor)
    };
    let (found, factor) = scaled(expected);
    if found >= EXPLAINED && (factor - 1.0).abs() > 0.005 {
        return Some(factor_in_words(factor));
    }
    let best = suspects.iter().map(|s| (scaled(&s.picture), s)).max_by(|a, b| a.0.0.total_cmp(&b.0.0));
    let ((found, factor), suspect) = best?;
    // A dark picture would be explained by anything times 0.
    (found >= EXPLAINED && found > honest + 0.02 && factor > 1e-6)
        .then(|| format!("{}, and {}", suspect.words, factor_in_words(factor)))
}

/// What a factor comes from, where it is a known one.
pub(crate) fn factor_in_words(factor: f64) -> String {
    let known = [
        (PI, "π: an albedo that is not divided by π, or a light's strength multiplied by it"),
        (1.0 / PI, "1/π: a division by π too many"),
        (4.0 * PI, "4π: a light of I W/sr is given 4π I although the renderer takes W/sr"),
        (
            1.0 / (4.0 * PI),
            "1/4π: the renderer takes a light's power in W, which is 4π times its intensity in W/sr",
        ),
        (2.0 * PI, "2π: a hemisphere too many"),
        (1.0 / (2.0 * PI), "1/2π: a hemisphere too few"),
        (2.0, "2: something is counted twice"),
        (0.5, "1/2: something is halved"),
        (683.0, "683: lumens in place of watts"),
        (1.0 / 683.0, "1/683: watts in place of lumens"),
        (100.0, "100: centimetres in place of metres, or percent"),
        (1e4, "10⁴: centimetres in place of metres"),
        (1e-4, "10⁻⁴: centimetres in place of metres"),
    ];
    let found = known.iter().find(|(value, _)| (factor / value - 1.0).abs() < 0.015);
    let word = if factor > 1.0 { "bright" } else { "dark" };
    match found {
        Some((_, words)) => format!("it is too {word} by a factor of {words}"),
        None if factor == 0.0 => "it is black".into(),
        None => format!("it is too {word} by a factor of {}", short(factor)),
    }
}
