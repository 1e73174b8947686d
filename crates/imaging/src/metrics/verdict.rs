//! Would anybody see it? A sentence for a difference in JOD.
//!
//! JOD are scaled such that of two pictures 1 apart, 75 % of observers who must choose take the better one (Perez-Ortiz et al., "From
//! Pairwise Comparisons and Rating to a Unified Quality Scale", 2020; Mantiuk et al. 2024). With Thurstone's normal distribution of
//! what is seen, d JOD are chosen correctly by `P(d) = Φ(d Φ⁻¹(0.75))`; of these, `2 P - 1` have seen the difference and the others have
//! guessed well.

use serde::{Deserialize, Serialize};

/// JOD of pictures between which nothing can be seen.
pub const NO_DIFFERENCE: f64 = 10.0;
/// Differences below this are indistinguishable: 56.7 % choose correctly, so that one of seven or eight observers sees anything; some 150
/// trials are needed before such a difference is likely to be told from a coin (5 %, one-sided).
pub const INDISTINGUISHABLE: f64 = 0.25;
/// Differences from here on are noticeable: 75 % choose correctly, so that half of the observers see it. The unit of the scale.
pub const NOTICEABLE: f64 = 1.0;

/// What people say to a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Verdict {
    /// Hardly anybody sees it: less than [`INDISTINGUISHABLE`].
    #[serde(rename = "indistinguishable")]
    Indistinguishable,
    /// Some see it.
    #[serde(rename = "slightly different")]
    SlightlyDifferent,
    /// At least half of all observers see it: [`NOTICEABLE`] or more.
    #[serde(rename = "noticeably different")]
    NoticeablyDifferent,
}

impl Verdict {
    /// All of them, from equal to different.
    pub const ALL: [Self; 3] = [Self::Indistinguishable, Self::SlightlyDifferent, Self::NoticeablyDifferent];

    /// The verdict on pictures of a quality, in JOD, beside each other.
    pub fn of(jod: f64) -> Self {
        match NO_DIFFERENCE - jod {
            d if d < INDISTINGUISHABLE => Self::Indistinguishable,
            d if d < NOTICEABLE => Self::SlightlyDifferent,
            _ => Self::NoticeablyDifferent,
        }
    }

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Indistinguishable => "indistinguishable",
            Self::SlightlyDifferent => "slightly different",
            Self::NoticeablyDifferent => "noticeably different",
        }
    }
}

/// Share of observers who choose the better one of two pictures that differ by some JOD (not negative): 0.5 where they guess, 0.75 at 1
/// JOD, 1 where everybody sees it.
pub fn share_choosing_correctly(difference: f64) -> f64 {
    /// Φ⁻¹(0.75).
    const SCALE: f64 = 0.674_489_750_196_081_7;
    0.5 * libm::erfc(-difference * SCALE * std::f64::consts::FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_those_that_were_derived() {
        let share = share_choosing_correctly;
        assert_eq!(share(0.0), 0.5);
        assert!((share(NOTICEABLE) - 0.75).abs() < 1e-12);
        assert!((share(INDISTINGUISHABLE) - 0.5669).abs() < 1e-4, "{}", share(INDISTINGUISHABLE));
        // Φ(2 · 0.67449), from a table of the normal distribution.
        assert!((share(2.0) - 0.9113).abs() < 1e-4);
        assert!(share(10.0) < 1.0 && share(60.0) == 1.0);
    }

    #[test]
    fn verdicts_follow_the_difference() {
        let of = |difference: f64| Verdict::of(NO_DIFFERENCE - difference);
        assert_eq!(of(0.0), Verdict::Indistinguishable);
        assert_eq!(of(0.249), Verdict::Indistinguishable);
        assert_eq!(of(0.25), Verdict::SlightlyDifferent);
        assert_eq!(of(0.99), Verdict::SlightlyDifferent);
        assert_eq!(of(1.0), Verdict::NoticeablyDifferent);
        assert_eq!(of(30.0), Verdict::NoticeablyDifferent);
        for verdict in Verdict::ALL {
            assert_eq!(serde_json::to_value(verdict).unwrap(), verdict.title());
        }
    }
}
