//! Numbers and times as people read them.

use crate::Report;
use crate::report::{Bar, Finding};

/// Most digits after the point where two numbers have to be told apart.
const MOST_DIGITS: usize = 8;

/// A number with about four digits, those of NRMSD as the paper's tables have them; whole numbers are whole.
pub(crate) fn number(value: f64) -> String {
    with_digits(value, digits(value))
}

/// Two numbers, with as many digits as it takes to see that they differ.
pub(crate) fn apart(a: f64, b: f64) -> [String; 2] {
    let enough = digits(a).max(digits(b));
    let mut pairs =
        (enough..=MOST_DIGITS).map(|digits| (digits, [a, b].map(|value| format!("{value:.digits$}"))));
    match pairs.find(|(_, [a, b])| a != b) {
        _ if a == b || !a.is_finite() => [a, b].map(number),
        Some((digits, _)) if digits == enough => [a, b].map(number),
        Some((_, pair)) => pair,
        None => [a, b].map(|value| format!("{value:e}")),
    }
}

/// What was measured, and what it should be: "0.0123", "at most 0.0107".
pub(crate) fn measured(finding: &Finding) -> [String; 2] {
    let (words, bar) = match finding.bar {
        Bar::AtMost(most) => ("at most", most),
        Bar::AtLeast(least) => ("at least", least),
    };
    let [value, bar] = apart(finding.value, bar);
    [value, format!("{words} {bar}")]
}

/// Findings with what is to be said of their cause: where several that are missed one after another share one, the last of them tells it.
pub(crate) fn with_causes<'a>(findings: &[&'a Finding]) -> Vec<(&'a Finding, Option<String>)> {
    let is_shared = |a: &&Finding, b: &&Finding| !a.is_reached() && !b.is_reached() && a.cause == b.cause;
    let told = |group: &[&'a Finding]| {
        let cause = group[0].cause.as_deref().unwrap_or("the cause is not known");
        let cause = match group.len() {
            1 => cause.to_owned(),
            count => format!("these {count}: {cause}"),
        };
        let last = group.len() - 1;
        let one = |(k, finding): (usize, &&'a Finding)| {
            (*finding, (k == last && !finding.is_reached()).then(|| cause.clone()))
        };
        group.iter().enumerate().map(one).collect::<Vec<_>>()
    };
    findings.chunk_by(is_shared).flat_map(told).collect()
}

/// Ours beside the paper's, and their ratio where there is one: "0.0101 / 0.0107", "(0.94×)".
pub(crate) fn beside(ours: f64, paper: f64) -> (String, Option<String>) {
    let ratio = ours / paper;
    let short = format!("{ratio:.2}");
    // A ratio that is just above one must not look like one.
    let ratio_text = if short == "1.00" && ratio != 1.0 { apart(ratio, 1.0)[0].clone() } else { short };
    (apart(ours, paper).join(" / "), ratio.is_finite().then(|| format!("({ratio_text}×)")))
}

/// "8.2 s", "3 min 20 s", "1 h 12 min".
pub(crate) fn duration(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// How many bars are reached, and how many are not.
pub(crate) fn tally<'a>(reports: impl IntoIterator<Item = &'a Report>) -> [usize; 2] {
    let findings: Vec<&Finding> = reports.into_iter().flat_map(|report| &report.findings).collect();
    let reached = findings.iter().filter(|finding| finding.is_reached()).count();
    [reached, findings.len() - reached]
}

/// Digits after the point.
fn digits(value: f64) -> usize {
    match value.abs() {
        v if v.fract() == 0.0 && v < 1e6 => 0,
        v if v < 1.0 => 4,
        v if v < 10.0 => 3,
        v if v < 100.0 => 2,
        v if v < 1000.0 => 1,
        _ => 0,
    }
}

fn with_digits(value: f64, digits: usize) -> String {
    let size = value.abs();
    if value != 0.0 && !(1e-3..1e6).contains(&size) && value.is_finite() {
        return format!("{value:.2e}");
    }
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_say_something() {
        let numbers = [0.0107, 0.5, 9.4137, 29.0, 12.345, 123.456, 43210.7, 0.000123, 0.0, f64::NAN];
        let expected = ["0.0107", "0.5000", "9.414", "29", "12.35", "123.5", "43211", "1.23e-4", "0", "NaN"];
        assert_eq!(numbers.map(number), expected);
    }

    #[test]
    fn a_number_that_misses_its_bar_never_looks_like_it() {
        assert_eq!(apart(0.010_74, 0.0107), ["0.01074", "0.01070"]);
        assert_eq!(apart(0.5, 0.5), ["0.5000", "0.5000"]);
        assert_eq!(apart(1e-9, 1.001e-9), ["1e-9", "1.001e-9"]);
        let both = |ours, paper| {
            let (pair, ratio) = beside(ours, paper);
            format!("{pair} {}", ratio.unwrap_or_default())
        };
        assert_eq!(both(0.0101, 0.0107), "0.0101 / 0.0107 (0.94×)");
        assert_eq!(both(0.010_701, 0.0107), "0.010701 / 0.010700 (1.0001×)");
        assert_eq!(both(0.0107, 0.0), "0.0107 / 0 ");
        let finding = Finding { name: "share".into(), value: 0.559_99, bar: Bar::AtLeast(0.56), cause: None };
        assert_eq!(measured(&finding), ["0.55999", "at least 0.56000"]);
    }

    #[test]
    fn a_cause_that_several_share_is_told_once() {
        let finding = |value, cause: &str| Finding {
            name: "share".into(),
            value,
            bar: Bar::AtLeast(0.5),
            cause: (!cause.is_empty()).then(|| cause.into()),
        };
        let all =
            [finding(0.1, "a"), finding(0.2, "a"), finding(0.9, "a"), finding(0.3, "a"), finding(0.4, "")];
        let told: Vec<Option<String>> =
            with_causes(&all.iter().collect::<Vec<_>>()).into_iter().map(|(_, cause)| cause).collect();
        let expected = [None, Some("these 2: a"), None, Some("a"), Some("the cause is not known")];
        assert_eq!(told, expected.map(|cause| cause.map(str::to_owned)));
    }

    #[test]
    fn times_are_read_at_a_glance() {
        assert_eq!(
            [0.04, 59.6, 200.0, 4320.0].map(duration),
            ["0.0 s", "1 min 0 s", "3 min 20 s", "1 h 12 min"]
        );
    }
}
