//! What the metrics say of two pictures, as text and as JSON.

use lookmatch_imaging::{
    Better, Image, METRICS, Mask, Metric, NO_DIFFERENCE, Reading, Verdict, read_metrics,
    share_choosing_correctly,
};
use lookmatch_remap::{MethodVerdicts, MetricScores, Probe, Statistics, ValidationReport, VerdictMap};
use serde_json::{Value as Json, json};

use crate::output::{score, spinner, table};

/// Columns that a line of prose may take.
const LINE: usize = 110;

/// The readings of all metrics for a pair of pictures.
pub(crate) struct Judgement {
    readings: Vec<Reading>,
    is_masked: bool,
}

impl Judgement {
    /// Judges a target beside its source.
    pub(crate) fn of(source: &Image, target: &Image, mask: Option<&Mask>) -> anyhow::Result<Self> {
        let progress = spinner("judging");
        let readings = read_metrics(&METRICS.iter().collect::<Vec<_>>(), source, target, mask)?;
        progress.finish_and_clear();
        Ok(Self { readings, is_masked: mask.is_some() })
    }

    /// All numbers, each with what it counts and how it looks at pictures.
    pub(crate) fn metrics(&self) -> Vec<Json> {
        let described = |reading: &Reading| {
            let Metric { unit, better, viewing, .. } = METRICS.iter().find(|m| m.name == reading.metric)?;
            let Reading { name, title, whole, masked, .. } = reading;
            Some(json!({
                "name": name, "title": title, "unit": unit, "better": better, "viewing": viewing,
                "whole": whole, "masked": masked,
            }))
        };
        self.readings.iter().filter_map(described).collect()
    }

    /// What people would say to the whole pictures; nothing where they are too small to be looked at.
    pub(crate) fn verdict(&self) -> Option<Verdict> {
        self.jod().map(Verdict::of)
    }

    /// Share of observers who tell the pictures apart, 0.5 where they guess.
    pub(crate) fn share_choosing_correctly(&self) -> Option<f64> {
        self.jod().map(|jod| share_choosing_correctly((NO_DIFFERENCE - jod).max(0.0)))
    }

    /// A table of the numbers, the viewing conditions and the verdict.
    pub(crate) fn text(&self) -> String {
        let header = ["metric", "whole image", "masked", "better"];
        let row = |cells: [String; 4]| {
            let [name, whole, masked, better] = cells;
            if self.is_masked { vec![name, whole, masked, better] } else { vec![name, whole, better] }
        };
        let mut rows = vec![row(header.map(str::to_owned))];
        for reading in &self.readings {
            let better = METRICS.iter().find(|m| m.name == reading.metric).map_or("", better);
            rows.push(row([
                reading.title.clone(),
                number(reading.whole),
                number(reading.masked),
                better.into(),
            ]));
        }
        format!("{}{}{}", table(&rows), viewing_text(METRICS), self.verdict_text())
    }

    fn verdict_text(&self) -> String {
        match (self.jod(), self.verdict(), self.share_choosing_correctly()) {
            (Some(jod), Some(verdict), Some(share)) => format!(
                "verdict: {} ({jod:.2} JOD: {:.0} of 100 observers tell which is which, 50 of them by guessing)\n",
                verdict.title(),
                100.0 * share
            ),
            _ => "verdict: none, the pictures are too small to be looked at\n".to_owned(),
        }
    }

    fn jod(&self) -> Option<f64> {
        self.readings.iter().find(|reading| reading.name == "jod")?.whole
    }
}

/// What the metrics say of a probe and its baselines: means over the source points, and verdicts.
pub(crate) fn validation_text(report: &ValidationReport) -> String {
    if report.metric_points == 0 {
        return String::new();
    }
    let mut rows =
        vec![vec![format!("means over {} source points", report.metric_points)], vec![String::new()]];
    for method in &report.methods {
        rows[0].extend([method.method.clone(), String::new()]);
        rows[1].extend(["whole", "masked"].map(str::to_owned));
    }
    rows.extend(metric_rows(report));
    format!("\n{}{}", table(&rows), viewing_text(report.metrics))
}

/// A row for each number of a metric and for each verdict: its name, then for each method what whole and masked pictures have.
pub(crate) fn metric_rows(report: &ValidationReport) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    let mean = |statistics: &Option<Statistics>| number(statistics.map(|s| s.mean));
    let first = report.methods.first().map_or(&[][..], |method| &method.metrics);
    for (k, MetricScores { title, .. }) in first.iter().enumerate() {
        let of = report.methods.iter().map(|method| &method.metrics[k]);
        let cells = of.flat_map(|metric| [mean(&metric.whole), mean(&metric.masked)]);
        rows.push(std::iter::once(title.clone()).chain(cells).collect());
    }
    for verdict in Verdict::ALL {
        let of = |method: &lookmatch_remap::MethodScores| {
            [method.verdicts.map_or("-".to_owned(), |v| v.count(verdict).to_string()), String::new()]
        };
        let cells = report.methods.iter().flat_map(of);
        rows.push(std::iter::once(format!("points {}", verdict.title())).chain(cells).collect());
    }
    rows
}

/// What people would say over the source points of a probe, where it says so: a table for each light.
pub(crate) fn verdicts_text(probe: &Probe) -> String {
    let tables = probe.verdicts.iter().map(|map| {
        let header = Verdict::ALL.map(Verdict::title).into_iter().chain(["mean JOD", "lowest", "at"]);
        let mut rows = vec![std::iter::once("").chain(header).map(str::to_owned).collect::<Vec<_>>()];
        for method in &map.methods {
            let counts = Verdict::ALL.map(|verdict| method.counts().count(verdict).to_string());
            let mut row = vec![format!("  {}", method.method)];
            row.extend(counts);
            row.push(format!("{:.2}", method.mean()));
            if let Some((place, jod)) = method.worst() {
                row.extend([format!("{jod:.2}"), point_text(probe, map.entries[place])]);
            }
            rows.push(row);
        }
        let VerdictMap { scene, environment, size, metric, viewing, entries, .. } = map;
        format!(
            "would anybody see it? At {} of {} source points, scene {scene}, environment {environment}, {size} px\n{}{}",
            entries.len(),
            probe.entries.len(),
            table(&rows),
            wrapped(&format!("{metric}: {viewing}")),
        )
    });
    tables.collect::<Vec<_>>().join("\n")
}

/// Values of the source axes of an entry.
fn point_text(probe: &Probe, entry: usize) -> String {
    let values = probe.source_axes.iter().zip(&probe.entries[entry].source);
    values.map(|(axis, value)| format!("{}={value}", axis.name)).collect::<Vec<_>>().join(",")
}

/// The same for machines.
pub(crate) fn verdicts_json(probe: &Probe) -> Vec<Json> {
    let method = |map: &VerdictMap, method: &MethodVerdicts| {
        let worst = method.worst();
        json!({
            "method": method.method, "counts": method.counts(), "mean_jod": method.mean(),
            "lowest_jod": worst.map(|worst| worst.1),
            "lowest_at": worst.map(|worst| &probe.entries[map.entries[worst.0]].source),
            "jod": method.jod, "verdict": method.verdict,
        })
    };
    let told = |map: &VerdictMap| {
        let VerdictMap { scene, environment, size, metric, viewing, entries, methods } = map;
        json!({
            "scene": scene, "environment": environment, "size": size, "metric": metric, "viewing": viewing,
            "sources": entries.iter().map(|place| &probe.entries[*place].source).collect::<Vec<_>>(),
            "methods": methods.iter().map(|m| method(map, m)).collect::<Vec<_>>(),
        })
    };
    probe.verdicts.iter().map(told).collect()
}

/// How each metric looks at pictures, in lines.
fn viewing_text(metrics: &[Metric]) -> String {
    viewing_lines(metrics).iter().map(|(titles, viewing)| wrapped(&format!("{titles}: {viewing}"))).collect()
}

/// How each metric looks at pictures, after their names; those that look alike come together.
pub(crate) fn viewing_lines(metrics: &[Metric]) -> Vec<(String, &'static str)> {
    let mut seen: Vec<(String, &str)> = Vec::new();
    for metric in metrics {
        match seen.iter_mut().find(|(_, viewing)| *viewing == metric.viewing) {
            Some((titles, _)) => *titles += &format!(", {}", metric.title),
            None => seen.push((metric.title.to_owned(), metric.viewing)),
        }
    }
    seen
}

/// A paragraph broken at spaces, its further lines indented.
fn wrapped(text: &str) -> String {
    let (mut lines, mut length) = (String::new(), 0);
    for word in text.split_whitespace() {
        let count = word.chars().count();
        if length > 0 && length + 1 + count > LINE {
            lines += "\n ";
            length = 1;
        }
        if length > 0 {
            lines.push(' ');
        }
        lines += word;
        length += 1 + count;
    }
    lines + "\n"
}

fn better(metric: &Metric) -> &'static str {
    match metric.better {
        Better::Higher => "higher",
        Better::Lower => "lower",
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), score)
}
