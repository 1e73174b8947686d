//! A run as one page of HTML that needs nothing but itself: pictures, style and script are part of it.

mod comparison;
mod findings;
mod table;

use std::path::Path;

use anyhow::{Context, bail};
use base64::prelude::{BASE64_STANDARD, Engine};
use lookmatch_imaging::VIEWING;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::number::{duration, tally};
use crate::{Environment, Figure, Report, Run};

const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = include_str!("page/page.js");
/// The browser itself keeps the page from loading anything.
const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";
const PAPER: &str = "Guarnera et al. 2018, Perceptually Validated Cross-Renderer Analytical BRDF Parameter Remapping \
                     (doi:10.1109/TVCG.2018.2886877)";

/// Makes one self-contained page of a run; pictures are read from the folder where the report lies.
///
/// # Errors
/// A picture or a figure that cannot be read or is neither PNG nor SVG; the message names it.
pub fn page(run: &Run, folder: &Path) -> anyhow::Result<String> {
    let articles = run.reports.iter().map(|report| {
        article(report, folder)
            .with_context(|| format!("cannot make the page of experiment '{}'", report.name))
    });
    let articles = articles.collect::<anyhow::Result<Vec<Markup>>>()?;
    let document = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "The paper, reproduced - " (run.environment.program) }
                link rel="icon" href="data:,";
                style { (PreEscaped(STYLE)) }
            }
            body {
                a.skip href="#results" { "Skip to the results" }
                (contents(run))
                main {
                    (header(run))
                    section #results {
                        h2 { "Results" }
                        (findings::overview(&run.reports))
                        (legend())
                    }
                    @for article in &articles { (article) }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    Ok(document.into_string())
}

/// What the run was, at a glance, and what runs it again.
fn header(run: &Run) -> Markup {
    let [reached, missed] = tally(&run.reports);
    let seconds = run.reports.iter().map(|report| report.seconds).sum();
    let one = |count: usize, name: &str| if count == 1 { name.to_owned() } else { format!("{name}s") };
    html! {
        header {
            h1 { "The paper, reproduced" }
            p.lede { "Experiments of " (PAPER) ", with what was measured here beside what was published." }
            ul.tally {
                li.reached { strong { (reached) } " " (one(reached, "bar")) " reached" }
                li.missed[missed > 0] { strong { (missed) } " missed" }
                li { strong { (run.reports.len()) } " " (one(run.reports.len(), "experiment")) }
                li { strong { (duration(seconds)) } " in all" }
            }
            (environment(&run.environment))
        }
    }
}

fn environment(environment: &Environment) -> Markup {
    let size = if environment.is_quick { "quick: fewer materials, smaller pictures" } else { "full" };
    html! {
        dl.environment {
            div.wide { dt { "Run it again" } dd { code { (environment.command) } } }
            div { dt { "Program" } dd { (environment.program) } }
            div { dt { "Seed" } dd { (environment.seed) } }
            div { dt { "Run" } dd { (size) } }
            div { dt { "Machine" } dd { (environment.machine) } }
        }
    }
}

/// The table of contents.
fn contents(run: &Run) -> Markup {
    html! {
        nav aria-label="Contents" {
            p { a href="#results" { "Results" } }
            ol {
                @for report in &run.reports {
                    @let [_, missed] = tally([report]);
                    li {
                        a href=(format!("#{}", report.name)) {
                            (report.name)
                            @if missed > 0 { " " span.count title="missed" { (missed) span.hidden { " missed" } } }
                        }
                    }
                }
            }
        }
    }
}

fn legend() -> Markup {
    html! {
        details {
            summary { "How to read this page" }
            ul {
                li { "Tables show " b { "ours / the paper's (ratio)" } "; lower is better, and "
                    span.worse { "red" } " where ours is higher." }
                li { "NRMSD is the root mean square of the differences of linear pixels, divided by the range of the source's, \
                      averaged over red, green and blue: 0 where nothing differs." }
                li { "JOD is what ColorVideoVDP predicts: 10 where nothing can be seen; where two pictures are 1 apart, three of \
                      four observers choose the better. Looked at on: " (VIEWING) "." }
                li { "Error maps show the distance of each pixel from the source's in linear RGB, from black for none to yellow for \
                      the scale's end and beyond." }
            }
        }
    }
}

/// All of an experiment.
fn article(report: &Report, folder: &Path) -> anyhow::Result<Markup> {
    let numbered =
        |(k, comparison)| comparison::comparison(comparison, &format!("{}-{k}", report.name), folder);
    let comparisons = report.comparisons.iter().enumerate().map(numbered);
    let comparisons = comparisons.collect::<anyhow::Result<Vec<Markup>>>()?;
    let figures = report.figures.iter().map(|drawn| figure(drawn, folder));
    let figures = figures.collect::<anyhow::Result<Vec<Markup>>>()?;
    Ok(html! {
        article id=(report.name) {
            header {
                h2 { a.anchor href=(format!("#{}", report.name)) { (report.title) } }
                p.meta { code { (report.name) } span { (report.reproduces) } span { (duration(report.seconds)) } }
            }
            @if !report.about.is_empty() { p.about { (report.about) } }
            (findings::findings(&report.findings))
            @for (k, table) in report.tables.iter().enumerate() {
                (table::table(table, &format!("{}-table-{k}", report.name)))
            }
            @for figure in &figures { (figure) }
            @for comparison in &comparisons { (comparison) }
            @if !report.notes.is_empty() {
                section.notes {
                    h3 { "Notes" }
                    @for note in &report.notes { p { (note) } }
                }
            }
        }
    })
}

fn figure(figure: &Figure, folder: &Path) -> anyhow::Result<Markup> {
    Ok(html! {
        section {
            h3 { (figure.title) }
            figure.drawn {
                div.scroll tabindex="0" role="region" aria-label=(figure.title) {
                    img src=(embedded(folder, &figure.file)?) alt=(figure.title);
                }
                @if !figure.about.is_empty() { figcaption { (figure.about) } }
            }
        }
    })
}

/// A file as part of the page.
fn embedded(folder: &Path, file: &str) -> anyhow::Result<String> {
    let path = folder.join(file);
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let kind = match extension.as_str() {
        "png" => "image/png",
        "svg" => "image/svg+xml",
        _ => bail!("cannot show '{}': pictures end in .png or .svg", path.display()),
    };
    let bytes = std::fs::read(&path).with_context(|| format!("cannot read picture '{}'", path.display()))?;
    Ok(format!("data:{kind};base64,{}", BASE64_STANDARD.encode(bytes)))
}
