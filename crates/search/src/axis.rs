//! One searched dimension: the levels a parameter may take.

use serde::{Deserialize, Serialize};

use crate::LatticeError;

/// Guard of the level count: `(0.7 - 0.1) / 0.1` is 5.999… in binary floating point, and must still count as
/// 6 steps.
const COUNT_SLACK: f64 = 1e-9;

/// More levels than this on one axis are taken for a mistyped step.
const MAX_LEVELS: f64 = 1e7;

/// One searched dimension: the regular (or listed) levels of a parameter, in the parameter's own unit.
///
/// Axes made by [`Axis::regular`], [`Axis::listed`] or deserialisation have at least one level, all finite
/// and strictly increasing; a search checks this again before it starts, because the fields are public.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Axis {
    /// Name of the parameter, as the target model calls it.
    pub name: String,
    /// The levels, strictly increasing and finite, one or more.
    pub levels: Vec<f64>,
}

/// What is read from a file before its levels have been checked.
#[derive(Deserialize)]
struct Unchecked {
    name: String,
    levels: Vec<f64>,
}

impl TryFrom<Unchecked> for Axis {
    type Error = LatticeError;

    fn try_from(raw: Unchecked) -> Result<Axis, LatticeError> {
        Axis::listed(raw.name, raw.levels)
    }
}

impl Axis {
    /// Levels `min, min + step, …` up to and including `max` where a whole number of steps reaches it.
    ///
    /// The count is `floor((max - min) / step + 1e-9) + 1`. Each level is the product `min + k * step`, not
    /// an accumulated sum, rounded to 12 significant digits so that 0.07 prints as 0.07.
    ///
    /// # Errors
    /// [`LatticeError::Range`] unless `min <= max`, `step > 0`, all are finite and the count is at most ten
    /// million.
    pub fn regular(name: impl Into<String>, min: f64, max: f64, step: f64) -> Result<Axis, LatticeError> {
        let name = name.into();
        let steps = ((max - min) / step + COUNT_SLACK).floor();
        let sound = min.is_finite() && max.is_finite() && step.is_finite() && step > 0.0;
        if !sound || !(0.0..MAX_LEVELS).contains(&steps) {
            return Err(LatticeError::Range { name, min, max, step });
        }
        let levels = (0..=steps as u32).map(|k| round_12(min + f64::from(k) * step)).collect();
        Axis::listed(name, levels)
    }

    /// An axis of the given levels, for a parameter that is switched or sampled unevenly.
    ///
    /// # Errors
    /// [`LatticeError::Levels`] unless there is at least one level and all are finite and strictly
    /// increasing.
    pub fn listed(name: impl Into<String>, levels: Vec<f64>) -> Result<Axis, LatticeError> {
        let axis = Axis { name: name.into(), levels };
        axis.check()?;
        Ok(axis)
    }

    /// Whether the levels are as the type promises.
    ///
    /// # Errors
    /// [`LatticeError::Levels`], naming the axis.
    pub fn check(&self) -> Result<(), LatticeError> {
        let increasing = self.levels.windows(2).all(|pair| pair[0] < pair[1]);
        let finite = self.levels.iter().all(|level| level.is_finite());
        let countable = !self.levels.is_empty() && self.levels.len() <= u32::MAX as usize;
        if increasing && finite && countable {
            Ok(())
        } else {
            Err(LatticeError::Levels { name: self.name.clone() })
        }
    }

    /// Number of levels.
    pub fn len(&self) -> usize {
        self.levels.len()
    }

    /// Whether there is no level at all, which no checked axis is.
    pub fn is_empty(&self) -> bool {
        self.levels.is_empty()
    }

    /// The level at index `i`, counted from 0; NaN past the end, which a renderer or a fitness will refuse,
    /// rather than a level nobody asked for.
    pub fn value(&self, i: usize) -> f64 {
        self.levels.get(i).copied().unwrap_or(f64::NAN)
    }

    /// Index of the level nearest to `value`; the lower of two equally near ones; values outside the range
    /// give the first or last level, NaN the first.
    pub fn nearest(&self, value: f64) -> usize {
        let above = self.levels.partition_point(|&level| level < value);
        if above == 0 {
            return 0;
        }
        match self.levels.get(above) {
            Some(&level) if level - value < value - self.levels[above - 1] => above,
            _ => above - 1,
        }
    }

    /// Index of the level that equals `value` to within 1e-9 of the distance to the next level (of the level
    /// itself where there is but one).
    pub fn index_of(&self, value: f64) -> Option<usize> {
        let i = self.nearest(value);
        let level = *self.levels.get(i)?;
        let neighbour = self.levels.get(i + 1).or_else(|| self.levels.get(i.wrapping_sub(1)));
        let step = neighbour.map_or(level.abs().max(1.0), |other| (other - level).abs());
        ((level - value).abs() <= 1e-9 * step).then_some(i)
    }

    /// The number of levels as Guarnera et al. 2018, section 3.3, print it: `floor((max - min) / step)`,
    /// which drops the last level.
    ///
    /// [`Axis::regular`] has one level more. Kept for comparisons with the article; 0 for ranges that
    /// `regular` would refuse.
    pub fn paper_count(min: f64, max: f64, step: f64) -> usize {
        let steps = ((max - min) / step + COUNT_SLACK).floor();
        if steps.is_finite() && steps > 0.0 { steps as usize } else { 0 }
    }
}

/// `x` rounded to 12 significant decimal digits: through text, because no power of ten is exact below one.
fn round_12(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_print_as_typed() {
        let axis = Axis::regular("alpha", 0.01, 0.7, 0.01).expect("a sound range");
        assert_eq!(axis.len(), 70);
        assert_eq!(axis.value(6).to_string(), "0.07");
        assert_eq!(axis.value(69), 0.7);
        assert!(axis.value(70).is_nan());
    }

    #[test]
    fn a_step_that_does_not_divide_the_range_stops_short() {
        let axis = Axis::regular("alpha", 0.01, 0.7, 0.02).expect("a sound range");
        assert_eq!((axis.len(), axis.value(34)), (35, 0.69));
        assert_eq!(Axis::paper_count(0.01, 0.7, 0.02), 34);
    }

    #[test]
    fn unsound_ranges_are_refused() {
        for (min, max, step) in [
            (1.0, 0.0, 0.1),
            (0.0, 1.0, 0.0),
            (0.0, 1.0, -0.1),
            (0.0, f64::NAN, 0.1),
            (0.0, f64::INFINITY, 0.1),
            (0.0, 1.0, 1e-300),
        ] {
            assert!(Axis::regular("x", min, max, step).is_err(), "{min} {max} {step}");
        }
        assert!(Axis::listed("x", vec![]).is_err());
        assert!(Axis::listed("x", vec![0.0, 0.0]).is_err());
        assert!(Axis::listed("x", vec![0.0, f64::NAN]).is_err());
    }

    #[test]
    fn nearest_and_exact_levels() {
        let axis = Axis::listed("x", vec![0.0, 1.0, 10.0]).expect("sound levels");
        let found: Vec<usize> = [-5.0, 0.5, 0.51, 5.5, 5.6, 99.0, f64::NAN].map(|v| axis.nearest(v)).to_vec();
        assert_eq!(found, [0, 0, 1, 1, 2, 2, 0]);
        assert_eq!(axis.index_of(1.0 + 1e-10), Some(1));
        assert_eq!(axis.index_of(1.1), None);
        assert_eq!(Axis::listed("x", vec![3.0]).expect("one level").index_of(3.0), Some(0));
    }

    #[test]
    fn files_are_checked_as_they_are_read() {
        let good = r#"{"name":"x","levels":[0.0,1.0]}"#;
        let axis: Axis = serde_json::from_str(good).expect("sound levels");
        assert_eq!(serde_json::to_string(&axis).expect("plain data"), good);
        assert!(serde_json::from_str::<Axis>(r#"{"name":"x","levels":[1.0,0.0]}"#).is_err());
    }
}
