//! FLIP: the difference that people see when they flip between two pictures, of each pixel from 0 to 1.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating Images", HPG
//! 2020; for high dynamic range Andersson, Nilsson, Shirley and Akenine-Möller, "Visualizing Errors in Rendered High Dynamic Range
//! Images", Eurographics 2021. Both pictures are blurred as the eye's contrast sensitivity does at a distance, compared in a
//! perceptually uniform space (HyAB distance of Hunt-adjusted CIELAB), and differences are amplified where edges and points differ.
//! Agrees with the authors' program to a few 1e-6 (`tests/references.rs`).

use std::f32::consts::PI;

use rayon::prelude::*;

use super::filter::{separable, with_edges};
use super::{Plane, check_pair};
use crate::lab::cube_root;
use crate::{Image, ImageError};

/// Pixels per degree of the authors' default, which published figures have: a 4K monitor of 0.7 m width seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// How [`flip_map`] sees pictures, in words for tables.
pub const VIEWING: &str = "the authors' default: 4K monitor 0.7 m wide from 0.7 m, 67 pixels per degree, flipped in place; \
                           radiance 1 is white, brighter light is clipped";

/// How [`hdr_flip_map`] does.
pub const HDR_VIEWING: &str = "as FLIP, 67 pixels per degree, at exposures from where the source's brightest to where its median pixel \
                               reaches 0.85 of white through the ACES tone curve; each pixel's worst";

/// Differences are raised to this power.
const COLOUR_EXPONENT: f32 = 0.7;
/// Colour differences up to this share of the largest ...
const COLOUR_KNEE: f32 = 0.4;
/// ... are spread over this share of the scale.
const KNEE_VALUE: f32 = 0.95;
/// Width of the edges and points that are looked for, in degrees.
const FEATURE_WIDTH: f32 = 0.082;
/// What a picture's brightest pixels become at the lowest exposure, and its median at the highest.
const EXPOSED: f32 = 0.85;
/// Brighter light is white at any exposure; its square still fits an `f32`.
const GLARING: f32 = 1e15;
/// Numerator and denominator of the ACES tone curve (Narkowicz), each a polynomial from x² down, with its exposure taken out.
const ACES: [[f32; 3]; 2] = [[0.36 * 2.51, 0.6 * 0.03, 0.0], [0.36 * 2.43, 0.6 * 0.59, 0.14]];

/// Linear sRGB to XYZ and back, as FLIP has them.
const XYZ_FROM_RGB: [[f32; 3]; 3] = [
    [10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0],
    [2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0],
    [1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0],
];
#[expect(clippy::excessive_precision, reason = "digits as published")]
const RGB_FROM_XYZ: [[f32; 3]; 3] = [
    [3.241003275, -1.537398934, -0.498615861],
    [-0.969224334, 1.875930071, 0.041554224],
    [0.055639423, -0.204011202, 1.057148933],
];
#[expect(clippy::excessive_precision, reason = "digits as published")]
const WHITE: [f32; 3] = [0.950428545, 1.0, 1.088900371];

/// FLIP of every pixel of two linear images on a display, 0 (no difference) to 1. Light is clipped to 0..1; `pixels_per_degree` says how
/// large a pixel is seen, see [`PIXELS_PER_DEGREE`].
///
/// # Errors
/// Different sizes, no pixels, pixels that are not finite.
///
/// # Panics
/// Where `pixels_per_degree` is not positive.
pub fn flip_map(source: &Image, target: &Image, pixels_per_degree: f32) -> Result<Plane, ImageError> {
    check_pair(source, target, ("FLIP", 1))?;
    let eye = Eye::at(pixels_per_degree);
    let shown = |image: &Image| opponent(image, |v| v.clamp(0.0, 1.0));
    Ok(plane(source, &eye.differences(&shown(source), &shown(target), source.width())))
}

/// HDR-FLIP of every pixel of two linear images, 0 to 1: the largest [`flip_map`] over all exposures at which the source can be
/// looked at, a stop or less apart. The tone curve is ACES, and exposures come from the source alone: the metric is not symmetric.
///
/// The authors' program needs a median above 0; where half of a source or more is black, we take the median of the rest.
///
/// # Errors
/// As [`flip_map`].
///
/// # Panics
/// As [`flip_map`].
pub fn hdr_flip_map(source: &Image, target: &Image, pixels_per_degree: f32) -> Result<Plane, ImageError> {
    check_pair(source, target, ("HDR-FLIP", 1))?;
    let eye = Eye::at(pixels_per_degree);
    let at = |stops: &f32| {
        let factor = stops.exp2();
        let shown =
            |image: &Image| opponent(image, |v| aces((v * factor).clamp(0.0, GLARING)).clamp(0.0, 1.0));
        eye.differences(&shown(source), &shown(target), source.width())
    };
    let maps: Vec<Vec<f32>> = exposures(source).par_iter().map(at).collect();
    let worst = (0..maps[0].len()).map(|i| maps.iter().fold(0.0, |worst: f32, map| worst.max(map[i])));
    Ok(plane(source, &worst.collect::<Vec<_>>()))
}

fn plane(source: &Image, values: &[f32]) -> Plane {
    Plane::new(source.width(), 0, values.iter().copied().map(f64::from).collect())
}

/// Exposures in stops: from the one that shows the brightest pixel to the one that shows the median.
fn exposures(source: &Image) -> Vec<f32> {
    let mut light: Vec<f32> =
        source.pixels().iter().map(|p| luminance(p.map(|v| v.clamp(0.0, GLARING)))).collect();
    light.sort_by(f32::total_cmp);
    let brightest = light[light.len() - 1];
    if brightest <= 0.0 {
        return vec![0.0];
    }
    let mut median = light[light.len() / 2];
    if median <= 0.0 {
        light.retain(|light| *light > 0.0);
        median = light[light.len() / 2];
    }
    // Where the tone curve reaches EXPOSED: the larger root of a quadratic.
    let [a, b, c] = std::array::from_fn(|i| ACES[0][i] - EXPOSED * ACES[1][i]);
    let reached = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let [first, last] = [brightest, median].map(|light| (reached / light).log2());
    let count = (last - first).ceil().max(2.0) as usize;
    (0..count).map(|i| first + (last - first) * i as f32 / (count - 1) as f32).collect()
}

fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

fn aces(x: f32) -> f32 {
    let [above, below] = ACES.map(|[a, b, c]| (a * x + b) * x + c);
    above / below
}

/// Planes of YCxCz, CIELAB's axes without its cube root, in which blurring adds light as the eye does.
type Opponent = [Vec<f32>; 3];

/// An image, made displayable value by value, as opponent colours.
fn opponent(image: &Image, shown: impl Fn(f32) -> f32) -> Opponent {
    let mut planes: Opponent = std::array::from_fn(|_| Vec::with_capacity(image.pixels().len()));
    for pixel in image.pixels() {
        let [x, y, z] = relative(pixel.map(&shown));
        let values = [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)];
        planes.iter_mut().zip(values).for_each(|(plane, value)| plane.push(value));
    }
    planes
}

/// XYZ of a linear colour, relative to white.
fn relative(rgb: [f32; 3]) -> [f32; 3] {
    let xyz = times(&XYZ_FROM_RGB, rgb);
    std::array::from_fn(|c| xyz[c] / WHITE[c])
}

fn times(matrix: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| matrix[i][0] * v[0] + matrix[i][1] * v[1] + matrix[i][2] * v[2])
}

/// CIELAB of a blurred colour, clipped to what displays show, with chroma that fades in the dark (Hunt).
fn hunt_lab([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let xyz = [(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]];
    hunt_lab_of_rgb(times(&RGB_FROM_XYZ, xyz).map(|v| v.clamp(0.0, 1.0)))
}

fn hunt_lab_of_rgb(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let root = |t: f32| cube_root(t).iter().sum();
    let compress =
        |t: f32| if t > DELTA * DELTA * DELTA { root(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = relative(rgb).map(compress);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// City block distance in lightness, Euclidean in chroma.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + ((a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

/// An eye at a distance from a screen.
struct Eye {
    /// Blur of lightness, of red against green, and the two of yellow against blue, which are added.
    blurs: [Vec<f32>; 4],
    /// A Gaussian and its first two derivatives: what finds edges and points.
    feature: [Vec<f32>; 3],
    /// The largest colour difference, of green and blue, raised to its power.
    largest: f32,
}

impl Eye {
    fn at(pixels_per_degree: f32) -> Self {
        assert!(pixels_per_degree > 0.0, "{pixels_per_degree} pixels per degree");
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(hunt_lab_of_rgb);
        let largest = hyab(green, blue).powf(COLOUR_EXPONENT);
        Self { blurs: blurs(pixels_per_degree), feature: feature(pixels_per_degree), largest }
    }

    fn differences(&self, source: &Opponent, target: &Opponent, width: usize) -> Vec<f32> {
        let seen = |planes: &Opponent| (self.blurred(planes, width), self.features(&planes[0], width));
        let ((a, fa), (b, fb)) = rayon::join(|| seen(source), || seen(target));
        let feature = |(a, b): ([f32; 2], [f32; 2])| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        let value = |i: usize| {
            let pixel = |planes: &Opponent| hunt_lab(std::array::from_fn(|c| planes[c][i]));
            let colour = self.colour_difference(pixel(&a), pixel(&b));
            if colour == 0.0 {
                return 0.0;
            }
            // The exponent of features is 1/2.
            let feature = (feature((fa[i], fb[i])) / 2.0_f32.sqrt()).sqrt();
            colour.powf(1.0 - feature)
        };
        (0..source[0].len()).into_par_iter().with_min_len(4096).map(value).collect()
    }

    /// 0 to 1.
    fn colour_difference(&self, a: [f32; 3], b: [f32; 3]) -> f32 {
        if a == b {
            return 0.0;
        }
        let (difference, knee) = (hyab(a, b).powf(COLOUR_EXPONENT), COLOUR_KNEE * self.largest);
        if difference < knee {
            KNEE_VALUE * difference / knee
        } else {
            KNEE_VALUE + (difference - knee) / (self.largest - knee) * (1.0 - KNEE_VALUE)
        }
    }

    /// What contrast sensitivity leaves of a picture.
    fn blurred(&self, planes: &Opponent, width: usize) -> Opponent {
        let margin = self.blurs[0].len() / 2;
        let [lightness, red_green, yellow_blue] = [0, 1, 2].map(|c| with_edges(&planes[c], width, margin));
        let blur =
            |plane: &[f32], k: usize| separable(plane, width + 2 * margin, &self.blurs[k], &self.blurs[k]);
        let mut last = blur(&yellow_blue, 2);
        last.iter_mut().zip(blur(&yellow_blue, 3)).for_each(|(sum, value)| *sum += value);
        [blur(&lightness, 0), blur(&red_green, 1), last]
    }

    /// Strength of the edge and of the point at every pixel.
    fn features(&self, lightness: &[f32], width: usize) -> Vec<[f32; 2]> {
        let [gaussian, first, second] = &self.feature;
        let margin = gaussian.len() / 2;
        let normalised: Vec<f32> = lightness.iter().map(|y| (y + 16.0) / 116.0).collect();
        let padded = with_edges(&normalised, width, margin);
        let strength = |derivative: &[f32]| {
            let across = separable(&padded, width + 2 * margin, derivative, gaussian);
            let down = separable(&padded, width + 2 * margin, gaussian, derivative);
            across.into_iter().zip(down).map(|(a, b)| (a * a + b * b).sqrt()).collect::<Vec<f32>>()
        };
        strength(first).into_iter().zip(strength(second)).map(|(edge, point)| [edge, point]).collect()
    }
}

/// Contrast sensitivity as Gaussians: `a √(π/b) exp(-π² x² / b)` in two dimensions, x in degrees.
fn blurs(pixels_per_degree: f32) -> [Vec<f32>; 4] {
    /// Each channel's a and b; the last two rows are those of yellow against blue.
    const SENSITIVITY: [[f32; 2]; 4] = [[1.0, 0.0047], [1.0, 0.0053], [34.1, 0.04], [13.5, 0.025]];
    const WIDEST: f32 = 0.04;
    let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
    let mut kernels = SENSITIVITY.map(|[a, b]| {
        let weight = |i: i32| {
            let x = i as f32 / pixels_per_degree;
            (a * (PI / b).sqrt()).sqrt() * (-PI * PI * x * x / b).exp()
        };
        (-radius..=radius).map(weight).collect::<Vec<f32>>()
    });
    // Along both axes together, each channel's weights sum to 1.
    let sums: [f32; 4] = std::array::from_fn(|k| kernels[k].iter().sum());
    let pair = sums[2].hypot(sums[3]);
    for (kernel, sum) in kernels.iter_mut().zip([sums[0], sums[1], pair, pair]) {
        kernel.iter_mut().for_each(|weight| *weight /= sum);
    }
    kernels
}

/// A Gaussian of sum 1, and its derivatives, whose positive and negative weights sum to 1 each.
fn feature(pixels_per_degree: f32) -> [Vec<f32>; 3] {
    let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let radius = (3.0 * sigma).ceil() as i32;
    let along = |formula: &dyn Fn(f32) -> f32| -> Vec<f32> {
        (-radius..=radius)
            .map(|i| formula(i as f32) * (-(i * i) as f32 / (2.0 * sigma * sigma)).exp())
            .collect()
    };
    let mut kernels = [along(&|_| 1.0), along(&|x| -x), along(&|x| x * x / (sigma * sigma) - 1.0)];
    for kernel in &mut kernels {
        let sum = |sign: f32| kernel.iter().map(|w| (sign * w).max(0.0)).sum::<f32>();
        let (positive, negative) = (sum(1.0), sum(-1.0));
        kernel
            .iter_mut()
            .for_each(|w| *w /= if *w > 0.0 { positive } else { negative.max(f32::MIN_POSITIVE) });
    }
    kernels
}

#[cfg(test)]
mod tests {
    use super::*;

    type Map = fn(&Image, &Image, f32) -> Result<Plane, ImageError>;
    const MAPS: [Map; 2] = [flip_map, hdr_flip_map];

    fn ball(gain: f32) -> Image {
        Image::from_fn(40, 32, |x, y| {
            let r = (x as f32 - 20.0).hypot(y as f32 - 16.0);
            if r < 3.0 {
                [20.0 * gain; 3]
            } else if r < 12.0 {
                [0.5 * gain, 0.2, 0.1]
            } else {
                [0.05; 3]
            }
        })
    }

    fn mean(map: usize, a: &Image, b: &Image) -> f64 {
        MAPS[map](a, b, PIXELS_PER_DEGREE).unwrap().mean(None).unwrap()
    }

    #[test]
    fn equal_pictures_have_0_and_larger_differences_more() {
        for map in [0, 1] {
            assert_eq!(mean(map, &ball(1.0), &ball(1.0)), 0.0);
            let values = [1.02, 1.1, 1.5].map(|gain| mean(map, &ball(1.0), &ball(gain)));
            assert!(0.0 < values[0] && values[0] < values[1] && values[1] < values[2], "{values:?}");
            let worst =
                MAPS[map](&ball(1.0), &ball(5.0), PIXELS_PER_DEGREE).unwrap().quantile(1.0, None).unwrap();
            assert!((0.3..=1.0).contains(&worst), "{worst}");
        }
        assert_eq!(mean(0, &ball(1.0), &ball(1.3)), mean(0, &ball(1.3), &ball(1.0)), "FLIP is symmetric");
    }

    #[test]
    fn only_high_dynamic_range_tells_highlights_apart_and_knows_no_unit() {
        let lit = |light: f32| Image::from_fn(32, 32, |x, _| if x < 8 { [light; 3] } else { [0.4; 3] });
        assert_eq!(mean(0, &lit(2.0), &lit(8.0)), 0.0);
        assert!(mean(1, &lit(2.0), &lit(8.0)) > 0.01);
        let times = |image: Image, factor: f32| image.zipped(&image, |v, _| factor * v);
        let scaled = mean(1, &times(ball(1.0), 64.0), &times(ball(1.2), 64.0));
        assert!((scaled - mean(1, &ball(1.0), &ball(1.2))).abs() < 1e-6);
    }

    #[test]
    fn whatever_is_finite_has_a_finite_difference() {
        let half_black = Image::from_fn(20, 10, |x, _| [(x > 12) as u8 as f32 * 3.0; 3]);
        let black = Image::new(20, 10);
        let huge = Image::from_fn(20, 10, |x, y| if x > y { [f32::MAX; 3] } else { [-1.0, 1e-30, 0.2] });
        for a in [&half_black, &black, &huge] {
            for b in [&half_black, &black, &huge] {
                for map in MAPS {
                    let plane = map(a, b, PIXELS_PER_DEGREE).unwrap();
                    assert!(plane.values().iter().all(|v| (0.0..=1.0 + 1e-6).contains(v)));
                }
            }
        }
        assert_eq!(exposures(&half_black).len(), 2);
    }

    #[test]
    fn faults_are_named() {
        for map in MAPS {
            assert!(map(&ball(1.0), &Image::new(32, 40), PIXELS_PER_DEGREE).is_err());
            let nan = Image::from_fn(40, 32, |_, _| [f32::NAN; 3]);
            let error = map(&ball(1.0), &nan, PIXELS_PER_DEGREE).unwrap_err().to_string();
            assert!(error.contains("target") && error.contains("NaN"), "{error}");
        }
    }
}
