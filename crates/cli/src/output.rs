//! Text for people: tables on standard output, progress on standard error.

use std::io::Write;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use lookmatch_remap::{Entry, Loss, LossClass, Noise, Probe, Strategy, SynthesisRecord, Totals};
use serde::Serialize;

/// Prints a text. A reader that went away (`| head`) is no error.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Prints one JSON document.
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    print(&(serde_json::to_string_pretty(value)? + "\n"))
}

/// Columns aligned with spaces: the first to the left, the others to the right.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (c, cell) in row.iter().enumerate() {
            let gap = if c == 0 { "" } else { "  " };
            if c == 0 {
                line += &format!("{gap}{cell:<width$}", width = widths[c]);
            } else {
                line += &format!("{gap}{cell:>width$}", width = widths[c]);
            }
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// What becomes of the source's parameters, one line each.
pub(crate) fn loss_table(losses: &[Loss]) -> String {
    let class = |loss: &Loss| match loss.class {
        LossClass::Exact => "exact",
        LossClass::Bounded => "bounded",
        LossClass::Lost => "lost",
    };
    let mut text = String::new();
    let width = losses.iter().map(|loss| loss.parameter.len()).max().unwrap_or(0);
    for loss in losses {
        text += &format!("  {:<width$}  {:<7}  {}\n", loss.parameter, class(loss), loss.reason);
    }
    if let Some([mean, worst]) = losses.iter().find_map(|loss| loss.nrmsd) {
        text +=
            &format!("  what is bounded or lost: masked NRMSD {mean:.4} on average, {worst:.4} at worst\n");
    }
    text
}

/// How many targets were rendered for how many comparisons, and how far synthesised pictures could be trusted.
pub(crate) fn renders_text(probe: &Probe) -> String {
    let Totals { evaluations, lattice_points, rendered, synthesis } = &probe.totals;
    let Some(rendered) = rendered else { return String::new() };
    let each = *rendered as f64 / probe.entries.len() as f64;
    let mut text = format!(
        "{rendered} of {lattice_points} target materials rendered ({each:.1} for each source), {evaluations} comparisons\n"
    );
    if let Some((saved, alone)) = saved(probe) {
        text += &format!(
            "starting from neighbours saved about {saved} of {alone} comparisons, those of searches like the first\n"
        );
    }
    if let Some(SynthesisRecord { components: [point, environment], held_out, mean, most, .. }) = synthesis {
        text += &format!(
            "synthesised from {point} + {environment} components; {held_out} candidates rendered after they were synthesised differ by {mean:.3} in fitness on average, 95 % by {most:.3} or less\n"
        );
    }
    text
}

/// Comparisons that a constrained strategy saved, and how many there would be if every source were searched as the first
/// was, which no neighbour led; nothing where searches share more than that.
pub(crate) fn saved(probe: &Probe) -> Option<(usize, usize)> {
    let is_led = probe.strategy == Strategy::Constrained && probe.search == "genetic";
    let alone = probe.entries.first().filter(|_| is_led)?.evaluations * probe.entries.len();
    alone.checked_sub(probe.totals.evaluations).filter(|saved| *saved > 0).map(|saved| (saved, alone))
}

/// What noise leaves unknown, and what failed.
pub(crate) fn noise_text(probe: &Probe) -> String {
    let mut text = String::new();
    let noises: Vec<_> = probe.found().filter_map(|e| e.noise.map(|noise| (e, noise))).collect();
    if !noises.is_empty() && noises.iter().any(|(_, noise)| noise.nrmsd != [0.0; 3]) {
        let mean = |value: &dyn Fn(&(&Entry, Noise)) -> [f64; 3]| {
            noises.iter().map(|n| value(n).iter().sum::<f64>() / 3.0).sum::<f64>() / noises.len() as f64
        };
        let open = noises.iter().filter(|(_, noise)| !noise.is_decided).count();
        text += &format!(
            "mean NRMSD {}, noise alone {}; {open} of {} matches are as good as a neighbour within noise\n",
            score(mean(&|(e, _)| e.nrmsd)),
            score(mean(&|(_, n)| n.nrmsd)),
            noises.len()
        );
    }
    for entry in &probe.entries {
        if let Some(reason) = &entry.failed {
            text += &format!("failed: {:?}: {reason}\n", entry.source);
        }
    }
    text
}

/// A bar for work of known length.
pub(crate) fn bar(total: usize, what: &str) -> ProgressBar {
    let template = "{msg} {wide_bar} {pos}/{len}, {eta} left";
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(total as u64).with_style(style).with_message(what.to_owned())
}

/// A spinner for work of unknown length.
pub(crate) fn spinner(what: &str) -> ProgressBar {
    let spinner = ProgressBar::new_spinner().with_message(what.to_owned());
    spinner.enable_steady_tick(Duration::from_millis(120));
    spinner
}

/// Four digits after the point, as the paper's tables have them.
pub(crate) fn score(value: f64) -> String {
    format!("{value:.4}")
}
