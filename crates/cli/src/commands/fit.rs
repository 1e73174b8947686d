//! `lookmatch fit`: from a probe's table to smooth functions.

use lookmatch_remap::{Candidate, Fit, ParameterFit, Probe, Stage};
use serde_json::json;

use crate::args::FitArgs;
use crate::commands::check_output;
use crate::output::{bar, print, print_json, score, table};
use crate::transport::{Preparation, cache};

/// Entries that are rendered again at the end of a remap.
pub(crate) const FIT_POINTS: usize = 64;

pub(crate) fn run(args: &FitArgs) -> anyhow::Result<()> {
    if let Some(output) = &args.output {
        check_output(output)?;
    }
    let mut probe = Probe::read(&args.probe)?;
    let is_ours = [&probe.from, &probe.to].iter().all(|material| material.model().renderer.is_none());
    let stage = match args.points {
        0 => None,
        _ if !is_ours => {
            eprintln!("note: not rendered again: one of the models is another renderer's");
            None
        }
        _ => Some(stage_of(&probe)?),
    };
    fit_to(&mut probe, stage.as_ref(), args.points)?;
    if let Some(output) = &args.output {
        probe.write(output)?;
    }
    if args.json.json {
        return print_json(&json!({ "probe": args.output, "fit": probe.fit }));
    }
    print(&fit_text(&probe))
}

/// The scene that a probe was found in, with a sign of life where it takes time.
pub(crate) fn stage_of(probe: &Probe) -> anyhow::Result<Stage> {
    let preparation = Preparation::of("the reference scene");
    let stage = Stage::of_probe(probe, &cache(), &|progress| preparation.observe(progress))?;
    preparation.finish();
    Ok(stage)
}

/// Fits a probe, and judges the fit by pictures of some entries where there is a stage.
pub(crate) fn fit_to(probe: &mut Probe, stage: Option<&Stage>, points: usize) -> anyhow::Result<()> {
    let mut fit = Fit::new(probe)?;
    if let Some(stage) = stage {
        let progress = bar(points.min(probe.entries.len()), "judging the fit");
        fit.rerender(probe, stage, points, &mut || progress.inc(1))?;
        progress.finish_and_clear();
    }
    probe.fit = Some(fit);
    Ok(())
}

/// What a probe's fit is and what it leaves; nothing where there is none.
pub(crate) fn fit_text(probe: &Probe) -> String {
    let Some(fit) = &probe.fit else { return String::new() };
    let header =
        ["fit", "depends on", "form", "rms", "max", "left out", "NRMSD", ""].map(str::to_owned).to_vec();
    let mut rows = vec![header];
    for parameter in &fit.parameters {
        rows.extend(rows_of(parameter));
    }
    let mut text = table(&rows);
    text += "  rms and max: what a form leaves of the entries, in the parameter's unit; left out: of entries that it has not seen, in lattice steps\n";
    for parameter in &fit.parameters {
        text += &reasons(parameter);
    }
    if let Some(rendered) = &fit.rerendered {
        let form = |name: &str, value: Option<f64>| value.map(|v| format!(", {name} {}", score(v)));
        text += &format!(
            "  {} entries rendered again at {} px: mean{} NRMSD with the table {}, with the fit {}{}{}\n",
            rendered.points,
            rendered.size,
            if rendered.masked { " masked" } else { "" },
            score(rendered.table),
            score(rendered.fit),
            form("with closed forms", rendered.closed).unwrap_or_default(),
            form("with local regressions", rendered.local).unwrap_or_default(),
        );
    }
    text
}

/// The forms that a probe's fit uses; nothing where there is none.
pub(crate) fn fit_summary(probe: &Probe) -> String {
    let used = |parameter: &ParameterFit| {
        let row =
            rows_of(parameter).into_iter().find(|row| row.last().is_some_and(|mark| !mark.is_empty()))?;
        Some(row.into_iter().take(4).collect())
    };
    let parameters = probe.fit.iter().flat_map(|fit| &fit.parameters);
    let mut rows: Vec<Vec<String>> = parameters.filter_map(used).collect();
    if rows.is_empty() {
        return String::new();
    }
    rows.insert(0, ["fit", "depends on", "form", "rms"].map(str::to_owned).to_vec());
    table(&rows) + "  `lookmatch inspect` says how good other forms are, and why these\n"
}

/// A line for each form of a parameter, the one in use marked.
fn rows_of(parameter: &ParameterFit) -> Vec<Vec<String>> {
    let depends = match (&parameter.depends_on[..], &parameter.closed, &parameter.local) {
        ([], None, None) => "?".to_owned(),
        ([], ..) => "nothing".into(),
        (names, ..) => names.join(", "),
    };
    let used = parameter.describe();
    let row = |candidate: &Candidate| {
        let residual = &candidate.residual;
        let form = candidate.function.describe();
        let window = match (candidate.span, candidate.degree) {
            (Some(span), Some(degree)) => format!(", span {span}, degree {degree}"),
            _ => String::new(),
        };
        let mark = if form == used { "in use" } else { "" };
        vec![
            parameter.name.clone(),
            depends.clone(),
            form + &window,
            format!("{:.4}", residual.rms),
            format!("{:.4}", residual.max),
            format!("{:.2}", residual.steps),
            residual.nrmsd.map_or_else(|| "-".into(), score),
            mark.into(),
        ]
    };
    let mut rows: Vec<Vec<String>> =
        [&parameter.closed, &parameter.local].into_iter().flatten().map(row).collect();
    if parameter.function().is_none() {
        let left = parameter.table.map_or_else(String::new, |steps| format!("{steps:.2}"));
        let cells = [parameter.name.as_str(), "all", "table", "", "", left.as_str(), "", "in use"];
        rows.push(cells.map(str::to_owned).to_vec());
    }
    rows
}

/// Why a form is used, what the parameter does not depend on, and which entries counted less.
fn reasons(parameter: &ParameterFit) -> String {
    let name = &parameter.name;
    let mut text = format!("  {name}: {}\n", parameter.why);
    if parameter.alternatives.len() > 2 {
        let told = |a: &lookmatch_remap::Alternative| {
            let from = if a.depends_on.is_empty() { "nothing".into() } else { a.depends_on.join(" and ") };
            format!("{:.2} from {from}", a.steps)
        };
        let all: Vec<String> = parameter.alternatives.iter().map(told).collect();
        let depends = match &parameter.depends_on[..] {
            [] => "depends on no source parameter".to_owned(),
            [only] => format!("is a function of {only} alone"),
            several => format!("depends on {}", several.join(" and ")),
        };
        text += &format!(
            "  {name} {depends}: left-out entries are foretold to lattice steps of {}\n",
            all.join(", ")
        );
    }
    if !parameter.light.is_empty() || !parameter.outside.is_empty() {
        text += &format!(
            "  {name}: {} entries on the edge of its range or below noise counted less, {} failed or without a lobe not at all\n",
            parameter.light.len(),
            parameter.outside.len()
        );
    }
    text
}
