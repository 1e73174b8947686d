//! Every metric of two pictures, as data that commands print.

use rayon::prelude::*;
use serde::Serialize;

use super::{Plane, delta_e, flip, gsm, jod, ssim};
use crate::{Image, ImageError, Mask};

/// Which values of a metric are good.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// The larger, the more alike.
    Higher,
    /// The smaller, the more alike.
    Lower,
}

/// What is told of a metric's values at all pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Statistic {
    Mean,
    /// What 95 % of the pixels do not exceed.
    Most,
    Max,
}

impl PartialEq for Metric {
    /// Names are unique.
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// How a metric comes to its numbers, and what a mask does to it.
#[derive(Debug)]
enum Measure {
    /// By way of a value at every pixel. What is told of them is weighted with the mask; a neighbourhood sees beyond it.
    Map(fn(&Image, &Image) -> Result<Plane, ImageError>, &'static [Statistic]),
    /// At once. The mask fades differences, in linear light: the target is `source + w (target - source)`.
    Whole(fn(&Image, &Image) -> Result<f64, ImageError>),
}

/// A metric of two pictures: of a source, and of a target that should look like it.
#[derive(Debug, Serialize)]
pub struct Metric {
    /// As in JSON: lower case letters, digits and `_`.
    pub name: &'static str,
    /// As in tables.
    pub title: &'static str,
    /// What its numbers count, and what equal pictures have.
    pub unit: &'static str,
    /// Which values are good.
    pub better: Better,
    /// How the pictures are looked at.
    pub viewing: &'static str,
    #[serde(skip)]
    measure: Measure,
}

/// A number of a metric.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reading {
    /// Name of its metric in [`METRICS`].
    #[serde(skip)]
    pub metric: &'static str,
    /// The metric's name; where it has several numbers, with `_mean`, `_p95` (what 95 % of the pixels do not exceed) or `_max`.
    pub name: String,
    /// As in tables.
    pub title: String,
    /// Of the whole pictures; nothing where they are too small for it.
    pub whole: Option<f64>,
    /// With the mask; nothing without one, or where the mask leaves nothing.
    pub masked: Option<f64>,
}

const SPREAD: &[Statistic] = &[Statistic::Mean, Statistic::Most, Statistic::Max];
const MEAN: &[Statistic] = &[Statistic::Mean];

/// Every metric of two pictures but NRMSD, which has a number for each channel.
#[rustfmt::skip]
pub const METRICS: &[Metric] = &[
    Metric { name: "delta_e_76", title: "ΔE*76", unit: "CIELAB distance, 0 where equal", better: Better::Lower, viewing: delta_e::VIEWING, measure: Measure::Map(delta_e::delta_e76_map, SPREAD) },
    Metric { name: "delta_e_2000", title: "ΔE2000", unit: "CIEDE2000, 0 where equal", better: Better::Lower, viewing: delta_e::VIEWING, measure: Measure::Map(delta_e::delta_e2000_map, SPREAD) },
    Metric { name: "gsm", title: "GSM", unit: "similarity, 1 where equal", better: Better::Higher, viewing: gsm::VIEWING, measure: Measure::Map(gsm::gsm_map, MEAN) },
    Metric { name: "ssim", title: "SSIM", unit: "similarity, 1 where equal", better: Better::Higher, viewing: ssim::VIEWING, measure: Measure::Map(ssim::ssim_map, MEAN) },
    Metric { name: "flip", title: "FLIP", unit: "difference 0 to 1, 0 where equal", better: Better::Lower, viewing: flip::VIEWING, measure: Measure::Map(|a, b| flip::flip_map(a, b, flip::PIXELS_PER_DEGREE), MEAN) },
    Metric { name: "hdr_flip", title: "HDR-FLIP", unit: "difference 0 to 1, 0 where equal", better: Better::Lower, viewing: flip::HDR_VIEWING, measure: Measure::Map(|a, b| flip::hdr_flip_map(a, b, flip::PIXELS_PER_DEGREE), MEAN) },
    Metric { name: "jod", title: "ColorVideoVDP", unit: "JOD, 10 where equal", better: Better::Higher, viewing: jod::VIEWING, measure: Measure::Whole(jod::jod) },
];

impl Metric {
    /// Its numbers for a pair of linear pictures, whole and with a mask of their size.
    ///
    /// # Errors
    /// Different sizes, no pixels, pixels that are not finite. Pictures that are merely too small are none.
    pub fn read(
        &self,
        source: &Image,
        target: &Image,
        mask: Option<&Mask>,
    ) -> Result<Vec<Reading>, ImageError> {
        match &self.measure {
            Measure::Map(map, statistics) => {
                let map = available(map(source, target))?;
                let told = |statistic: &Statistic| -> Result<Reading, ImageError> {
                    let of = |mask| map.as_ref().map(|map| statistic.of(map, mask));
                    let masked = mask.and_then(|mask| of(Some(mask))).map(available).transpose()?.flatten();
                    let (name, title) = self.named(*statistic, statistics.len());
                    Ok(Reading { metric: self.name, name, title, whole: of(None).transpose()?, masked })
                };
                statistics.iter().map(told).collect()
            }
            Measure::Whole(compute) => {
                let whole = available(compute(source, target))?;
                let of = |mask| available(compute(source, &faded(source, target, mask)?));
                let masked = mask.map(of).transpose()?.flatten();
                Ok(vec![Reading {
                    metric: self.name,
                    name: self.name.into(),
                    title: self.title.into(),
                    whole,
                    masked,
                }])
            }
        }
    }

    /// Name and title of one of its numbers.
    fn named(&self, statistic: Statistic, count: usize) -> (String, String) {
        let (name, title) = match statistic {
            _ if count == 1 => return (self.name.into(), self.title.into()),
            Statistic::Mean => ("mean", "mean"),
            Statistic::Most => ("p95", "95 %"),
            Statistic::Max => ("max", "max"),
        };
        (format!("{}_{name}", self.name), format!("{}, {title}", self.title))
    }
}

impl Statistic {
    fn of(self, map: &Plane, mask: Option<&Mask>) -> Result<f64, ImageError> {
        match self {
            Self::Mean => map.mean(mask),
            Self::Most => map.quantile(0.95, mask),
            Self::Max => map.quantile(1.0, mask),
        }
    }
}

/// The numbers of some metrics in their order, worked out on all cores.
///
/// # Errors
/// As [`Metric::read`], and a mask of another size.
pub fn read_metrics(
    metrics: &[&Metric],
    source: &Image,
    target: &Image,
    mask: Option<&Mask>,
) -> Result<Vec<Reading>, ImageError> {
    let readings: Vec<Vec<Reading>> =
        metrics.par_iter().map(|metric| metric.read(source, target, mask)).collect::<Result<_, _>>()?;
    Ok(readings.into_iter().flatten().collect())
}

/// Nothing where a picture or what a mask leaves of it is too small.
fn available<T>(value: Result<T, ImageError>) -> Result<Option<T>, ImageError> {
    match value {
        Err(ImageError::TooSmall { .. } | ImageError::EmptyMask) => Ok(None),
        value => value.map(Some),
    }
}

/// The target where the mask is 1, the source where it is 0.
fn faded(source: &Image, target: &Image, mask: &Mask) -> Result<Image, ImageError> {
    source.check_same_size(target)?;
    source.check_size(mask.width(), mask.height()).map_err(|error| error.in_image("image and mask"))?;
    let pixels = source.pixels().iter().zip(target.pixels()).zip(mask.weights());
    let faded = pixels.map(|((a, b), w)| std::array::from_fn(|c| (1.0 - w) * a[c] + w * b[c]));
    Image::from_pixels(source.width(), source.height(), faded.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<&'static Metric> {
        METRICS.iter().collect()
    }

    fn ball(gain: f32, rim: f32) -> Image {
        Image::from_fn(48, 40, |x, y| {
            let r = (x as f32 + 0.5 - 24.0).hypot(y as f32 + 0.5 - 20.0);
            if r < 8.0 {
                [0.6 * gain, 0.3, 0.1]
            } else if r < 16.0 {
                [0.2, 0.4 * rim, 0.3]
            } else {
                [0.1; 3]
            }
        })
    }

    fn read(a: &Image, b: &Image, mask: Option<&Mask>) -> Vec<Reading> {
        read_metrics(&all(), a, b, mask).unwrap()
    }

    #[test]
    fn every_metric_has_its_best_value_for_equal_pictures_and_a_worse_one_for_others() {
        let source = ball(1.0, 1.0);
        let (equal, near, far) = (
            read(&source, &source, None),
            read(&source, &ball(1.1, 1.0), None),
            read(&source, &ball(1.6, 1.0), None),
        );
        assert_eq!(equal.len(), 11);
        let mut place = 0;
        for metric in METRICS {
            let sign = if metric.better == Better::Lower { 1.0 } else { -1.0 };
            let best = if metric.name == "jod" {
                10.0
            } else if sign > 0.0 {
                0.0
            } else {
                1.0
            };
            for _ in metric.read(&source, &source, None).unwrap() {
                let [equal, near, far] = [&equal, &near, &far].map(|readings| readings[place].whole.unwrap());
                assert!((equal - best).abs() < 1e-6, "{}: {equal}", metric.name);
                assert!(
                    sign * near > sign * best && sign * far >= sign * near,
                    "{}: {near}, {far}",
                    metric.name
                );
                place += 1;
            }
        }
    }

    #[test]
    fn a_mask_hides_what_it_leaves_out() {
        let source = ball(1.0, 1.0);
        let inner = Mask::disc(48, 40, 24.0, 20.0, 4.0);
        let hidden = read(&source, &ball(1.0, 1.5), Some(&inner));
        let shown = read(&source, &ball(1.5, 1.0), Some(&inner));
        for (hidden, shown) in hidden.iter().zip(&shown) {
            let best = match hidden.name.as_str() {
                "jod" => 10.0,
                "gsm" | "ssim" => 1.0,
                _ => 0.0,
            };
            let off = |value: Option<f64>| (value.unwrap() - best).abs();
            // Neighbourhoods reach a little beyond the mask.
            assert!(off(hidden.masked) < 0.5 * off(hidden.whole), "{hidden:?}");
            assert!(off(shown.masked) > 0.02 * off(shown.whole), "{shown:?}");
            assert!(off(hidden.whole) > 1e-4 && off(shown.whole) > 1e-4, "{hidden:?}, {shown:?}");
        }
    }

    #[test]
    fn a_uniform_mask_changes_nothing() {
        let uniform = Mask::uniform(48, 40);
        for reading in read(&ball(1.0, 1.0), &ball(1.2, 0.9), Some(&uniform)) {
            let (whole, masked) = (reading.whole.unwrap(), reading.masked.unwrap());
            assert!((whole - masked).abs() < 1e-6, "{reading:?}");
        }
    }

    #[test]
    fn small_pictures_have_the_numbers_that_they_can_have() {
        let small = Image::from_fn(6, 6, |x, y| [x as f32 / 6.0, y as f32 / 6.0, 0.1]);
        let readings = read(&small, &small, Some(&Mask::disc(6, 6, 0.5, 0.5, 0.5)));
        let of = |name: &str| readings.iter().find(|reading| reading.name == name).unwrap();
        assert_eq!((of("ssim").whole, of("gsm").whole), (None, Some(1.0)));
        assert_eq!((of("gsm").masked, of("flip").masked), (None, Some(0.0)), "no block lies in the corner");
    }

    #[test]
    fn faults_are_errors_of_every_metric() {
        let image = ball(1.0, 1.0);
        let nan = Image::from_fn(48, 40, |x, _| [if x == 30 { f32::NAN } else { 0.2 }; 3]);
        for metric in METRICS {
            let error = metric.read(&image, &nan, None).unwrap_err().to_string();
            assert!(error.contains("NaN") && error.contains("x = 30"), "{}: {error}", metric.name);
            assert!(metric.read(&image, &Image::new(40, 48), None).is_err(), "{}", metric.name);
            assert!(metric.read(&image, &image, Some(&Mask::uniform(40, 48))).is_err(), "{}", metric.name);
        }
    }

    #[test]
    fn what_is_printed_says_what_it_is() {
        let mut names: Vec<String> =
            read(&ball(1.0, 1.0), &ball(1.0, 1.0), None).into_iter().map(|r| r.name).collect();
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count);
        for metric in METRICS {
            assert!(!metric.viewing.is_empty() && !metric.unit.is_empty());
            let json = serde_json::to_value(metric).unwrap();
            assert_eq!(json["name"], metric.name);
            assert!(json["better"] == "lower" || json["better"] == "higher");
        }
    }
}
