//! What a check finds.

use std::fmt;

use lookmatch_imaging::{Image, error_map};
use serde::Serialize;

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// All is as it should be.
    Passed,
    /// Something is wrong.
    Failed,
    /// Not as it should be, in a way that the renderer says itself.
    Approximate,
    /// It does not apply to this renderer.
    Skipped,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Passed => "ok",
            Self::Failed => "wrong",
            Self::Approximate => "approximate",
            Self::Skipped => "skipped",
        })
    }
}

/// What a number may be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// At least this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// At most this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
}

impl Limit {
    /// Anything.
    pub(crate) const NONE: Self = Self { min: None, max: None };

    pub(crate) const fn least(min: f64) -> Self {
        Self { min: Some(min), max: None }
    }

    pub(crate) const fn most(max: f64) -> Self {
        Self { min: None, max: Some(max) }
    }

    pub(crate) const fn between(min: f64, max: f64) -> Self {
        Self { min: Some(min), max: Some(max) }
    }

    fn holds(&self, value: f64) -> bool {
        !value.is_nan() && self.min.is_none_or(|min| value >= min) && self.max.is_none_or(|max| value <= max)
    }
}

/// Something that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Number {
    /// What.
    pub name: String,
    /// Its value; `null` in JSON where it is no number.
    pub value: f64,
    /// What it may be.
    pub limit: Limit,
}

impl Number {
    /// Whether it is what it may be.
    pub fn is_within(&self) -> bool {
        self.limit.holds(self.value)
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.name, short(self.value))?;
        match self.limit {
            Limit { min: None, max: None } => Ok(()),
            Limit { min: Some(min), max: None } => write!(f, " (at least {})", short(min)),
            Limit { min: None, max: Some(max) } => write!(f, " (at most {})", short(max)),
            Limit { min: Some(min), max: Some(max) } => write!(f, " ({} to {})", short(min), short(max)),
        }
    }
}

/// Five digits after the point at most, without zeros at the end.
pub(crate) fn short(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-4 {
        return format!("{value:.1e}");
    }
    let text = format!("{value:.*}", if value.abs() < 1.0 { 5 } else { 4 });
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A picture of the worker, the expected one and their difference, side by side.
#[derive(Clone, PartialEq, Serialize)]
pub struct Sheet {
    /// What is seen: the name of a file, without its extension.
    pub name: String,
    /// The three pictures, to be looked at: scaled so that the brightest expected pixel is white.
    #[serde(skip)]
    pub image: Image,
}

impl fmt::Debug for Sheet {
    /// Without its pixels.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Sheet").field(&self.name).finish()
    }
}

/// What a check found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The check.
    pub check: &'static str,
    /// What it looks at.
    pub about: &'static str,
    /// How it ended.
    pub outcome: Outcome,
    /// What was measured.
    pub numbers: Vec<Number>,
    /// What is wrong and what the likely cause is; why it was skipped.
    pub remarks: Vec<String>,
    /// Pictures of it.
    pub pictures: Vec<Sheet>,
}

impl Finding {
    pub(crate) fn new(check: &'static str, about: &'static str) -> Self {
        let outcome = Outcome::Passed;
        Self { check, about, outcome, numbers: Vec::new(), remarks: Vec::new(), pictures: Vec::new() }
    }

    /// Notes a number; one that is not what it may be is a fault. Says whether it is.
    pub(crate) fn measure(&mut self, name: impl Into<String>, value: f64, limit: Limit) -> bool {
        let number = Number { name: name.into(), value, limit };
        let is_within = number.is_within();
        self.numbers.push(number);
        if !is_within {
            self.outcome = Outcome::Failed;
        }
        is_within
    }

    /// Something is wrong, in words.
    pub(crate) fn fault(&mut self, what: impl Into<String>) {
        self.outcome = Outcome::Failed;
        self.remark(what);
    }

    /// Something to know.
    pub(crate) fn remark(&mut self, what: impl Into<String>) {
        let what = what.into();
        if !self.remarks.contains(&what) {
            self.remarks.push(what);
        }
    }

    /// It does not apply.
    pub(crate) fn skip(&mut self, why: impl Into<String>) {
        self.outcome = Outcome::Skipped;
        self.remark(why);
    }

    /// What was found wrong is what the renderer says of itself.
    pub(crate) fn excuse(&mut self, sentence: &str) {
        if self.outcome == Outcome::Failed {
            self.outcome = Outcome::Approximate;
            self.remark(format!("it says so itself: {sentence}"));
        }
    }

    /// Keeps pictures of what came and what was expected.
    pub(crate) fn show(&mut self, name: &str, got: &Image, expected: &Image) {
        let brightest = expected.pixels().iter().flatten().fold(0.0_f32, |a, b| a.max(*b));
        let scale = if brightest > 0.0 { 1.0 / brightest } else { 1.0 };
        let seen = |image: &Image| {
            Image::from_fn(image.width(), image.height(), |x, y| image.get(x, y).map(|v| scale * v))
        };
        let (got, expected) = (seen(got), seen(expected));
        // A tenth of the brightest pixel is yellow: faults are seen, rounding is not.
        let Ok((difference, _)) = error_map(&got, &expected, Some(0.1)) else { return };
        let name = format!("{}-{name}", self.check);
        self.pictures.push(Sheet { name, image: Image::beside(&[&got, &expected, &difference]) });
    }
}
