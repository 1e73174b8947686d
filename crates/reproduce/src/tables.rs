//! Tables and bars that several experiments share.

use lookmatch_remap::Statistics;

use crate::{Bar, Cell, Finding, Row, Table};

/// Minimum, maximum, mean and standard deviation for red, green and blue, as the paper's tables have them.
pub(crate) type Published = [[f64; 3]; 4];

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// NRMSD over the source points beside what was published.
pub(crate) fn nrmsd_table(
    title: &str,
    about: &str,
    ours: &[Statistics; 3],
    paper: Option<&Published>,
) -> Table {
    let values = |pick: fn(&Statistics) -> f64| ours.each_ref().map(pick);
    let rows = [
        ("min", values(|s| s.min)),
        ("max", values(|s| s.max)),
        ("mean", values(|s| s.mean)),
        ("σ", values(|s| s.sd)),
    ];
    let cell = |row: usize, c: usize, ours: f64| match paper {
        Some(paper) => Cell::Beside { ours, paper: paper[row][c] },
        None => Cell::Number(ours),
    };
    let rows = rows.into_iter().enumerate().map(|(row, (name, ours))| Row {
        name: name.into(),
        cells: (0..3).map(|c| cell(row, c, ours[c])).collect(),
        is_main: name == "mean",
    });
    let columns = std::iter::once("NRMSD").chain(CHANNELS).map(str::to_owned).collect();
    Table { title: title.into(), about: about.into(), columns, rows: rows.collect() }
}

/// One bar per channel: a mean at or below the published one.
pub(crate) fn nrmsd_bars(
    table: &str,
    ours: &[Statistics; 3],
    paper: &Published,
    cause: &str,
) -> Vec<Finding> {
    (0..3)
        .map(|c| {
            bar(
                format!("{table}: mean NRMSD, {}", CHANNELS[c]),
                ours[c].mean,
                Bar::AtMost(paper[2][c]),
                cause,
            )
        })
        .collect()
}

/// A finding with the cause to be told where it is missed.
pub(crate) fn bar(name: String, value: f64, bar: Bar, cause: &str) -> Finding {
    let mut finding = Finding { name, value, bar, cause: None };
    if !finding.is_reached() && !cause.is_empty() {
        finding.cause = Some(cause.into());
    }
    finding
}

/// The mean of red, green and blue.
pub(crate) fn channel_mean(channels: [f64; 3]) -> f64 {
    mean(channels.into_iter())
}

/// The mean of numbers.
pub(crate) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), v| (sum + v, count + 1));
    sum / count.max(1) as f64
}
