//! The report of a remap: tables and pictures in a folder, to be opened in a browser.

use std::path::Path;

use lookmatch_imaging::{Image, Mask, error_map, error_scale, write as write_image, write_atomically};
use lookmatch_materials::Material;
use lookmatch_plots::draw_probe;
use lookmatch_remap::{
    Baseline, CrossStage, MethodScores, Probe, ValidationReport, Validator, validation_points,
};
use lookmatch_rendering::Illumination;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::commands::validate::{Stop, prepared, verdicts_with_progress, with_progress};
use crate::judgement::{metric_rows, validation_text, verdicts_text, viewing_lines};
use crate::output::{bar, score, table};

/// Side of the pictures in pixels.
const SIZE: usize = 300;
/// Source points that all metrics judge, as in `validate`.
const METRIC_POINTS: usize = 48;
/// Source points of the map of verdicts: enough to see where it turns, in some seconds; `validate --write` judges more.
const MAP_POINTS: usize = 140;
/// The picture of the probe.
const PLOT: &str = "probe.png";
/// Matches of other renderers that are pictured: every picture is rendered for it.
const PICTURED_ACROSS: usize = 4;
/// Where on each source axis the pictured materials lie, as shares of its length.
const PICTURED: [f64; 2] = [0.2, 0.75];

/// Validates a probe, notes the verdicts in it, and writes `index.html`, `validation.json`, `validation.txt` and the pictures.
pub(crate) fn write(probe: &mut Probe, folder: &Path, stop: Stop) -> anyhow::Result<ValidationReport> {
    let validator = prepared(probe, &None, SIZE)?;
    let validation = with_progress(&validator, &validation_points(probe, None), METRIC_POINTS, stop)?;
    let map = verdicts_with_progress(&validator, &validation_points(probe, Some(MAP_POINTS)), stop)?;
    let mut strips = Vec::new();
    for (k, place) in pictured(probe).into_iter().enumerate() {
        strips.push(strip(&validator, place, &folder.join(format!("match-{k}.png")))?);
    }
    probe.verdicts = vec![map];
    if !probe.source_axes.is_empty() {
        draw_probe(probe, &folder.join(PLOT))?;
    }
    let text = scores_table(&validation) + &validation_text(&validation) + "\n" + &verdicts_text(probe);
    let file =
        |name: &str, text: &str| write_atomically(&folder.join(name), |out| out.write_all(text.as_bytes()));
    file("validation.json", &serde_json::to_string_pretty(&validation)?)?;
    file("validation.txt", &text)?;
    file("index.html", &page(probe, &validation, &strips).into_string())?;
    eprint!("{text}");
    eprintln!("report in {}", folder.join("index.html").display());
    Ok(validation)
}

/// Writes `index.html` and the pictures of a probe of other renderers: what its entries say, and some of them side by side.
pub(crate) fn write_across(
    probe: &Probe,
    stage: &CrossStage,
    samples: u32,
    folder: &Path,
) -> anyhow::Result<()> {
    let mut places = pictured(probe);
    places.retain(|place| probe.entries[*place].failed.is_none());
    let last = places.len().saturating_sub(1);
    let count = places.len().min(PICTURED_ACROSS);
    let places = (0..count).map(|k| places[k * last / (count - 1).max(1)]);
    let progress = bar(count, "picturing");
    let mut strips = Vec::new();
    for (k, place) in places.enumerate() {
        strips.push(strip_across(probe, stage, (place, samples), &folder.join(format!("match-{k}.png")))?);
        progress.inc(1);
    }
    progress.finish_and_clear();
    let text = page_across(probe, &strips).into_string();
    write_atomically(&folder.join("index.html"), |out| out.write_all(text.as_bytes()))?;
    eprintln!("report in {}", folder.join("index.html").display());
    Ok(())
}

/// The verdict as text: a block per kind of NRMSD, a row per method.
pub(crate) fn scores_table(report: &ValidationReport) -> String {
    let mut rows = vec![
        ["NRMSD over the source points", "red", "", "", "", "green", "", "", "", "blue", "", "", ""]
            .map(str::to_owned)
            .to_vec(),
    ];
    let header = ["min", "max", "mean", "sd"];
    rows.push(std::iter::once("").chain(header).chain(header).chain(header).map(str::to_owned).collect());
    for (title, masked) in [("whole image", false), ("masked", true)] {
        for method in &report.methods {
            let mut row = vec![format!("{title}: {}", method.method)];
            row.extend(numbers(method, masked));
            rows.push(row);
        }
    }
    let verdict = match (report.probe_is_best, report.methods.len()) {
        (_, 1) => "no baseline applies to these models",
        (true, _) => "the probe beats every baseline on the mean masked NRMSD",
        (false, _) => "a baseline beats the probe on the mean masked NRMSD",
    };
    let scene = format!("scene {}, environment {}", report.scene, report.environment);
    format!("{scene}, {} source points, {} px\n{}{verdict}\n", report.points, report.size, table(&rows))
}

/// Min, max, mean and standard deviation of each channel.
fn numbers(method: &MethodScores, masked: bool) -> Vec<String> {
    let channels = if masked { &method.scores.masked } else { &method.scores.whole };
    channels.iter().flat_map(|s| [s.min, s.max, s.mean, s.sd].map(score)).collect()
}

/// Entries to picture: low and high on each axis.
fn pictured(probe: &Probe) -> Vec<usize> {
    let counts: Vec<usize> = probe.source_axes.iter().map(|a| a.len()).collect();
    let corner = |bits: usize| {
        counts.iter().enumerate().fold(0, |place, (k, n)| {
            let share = PICTURED[bits >> k & 1];
            place * n + (share * (n - 1) as f64).round() as usize
        })
    };
    let mut places: Vec<usize> = (0..1 << counts.len().min(3)).map(corner).collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// One source material with everything that should look like it.
struct Strip {
    file: String,
    source: Material,
    target: Material,
    columns: Vec<&'static str>,
    /// The difference that the error maps draw brightest, as a distance in linear RGB.
    scale: f32,
}

/// Renders source, probe and baselines beside each other, and below each its difference from the source, all on one scale.
fn strip(validator: &Validator, place: usize, path: &Path) -> anyhow::Result<Strip> {
    let (source, targets) = validator.materials(place)?;
    let titles = std::iter::once("probe").chain(Baseline::ALL.map(Baseline::title));
    let (mut columns, targets): (Vec<&str>, Vec<Material>) =
        titles.zip(targets).filter_map(|(title, target)| Some((title, target?))).unzip();
    let reference = validator.render(&[&source]).swap_remove(0);
    let images = validator.render(&targets.iter().collect::<Vec<_>>());
    let (image, scale) = sheet(&reference, &images, validator.mask())?;
    write_image(path, &image, &[])?;
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    columns.insert(0, "source");
    Ok(Strip { file, source, target: targets[0].clone(), columns, scale })
}

/// A picture with those that should look like it to its right, and below each its difference; the difference that is drawn
/// brightest, as the subjects have it.
pub(crate) fn sheet(reference: &Image, images: &[Image], subjects: &Mask) -> anyhow::Result<(Image, f32)> {
    let scales = images.iter().map(|image| Ok(error_scale(reference, image, subjects)?));
    let scale = scales.collect::<anyhow::Result<Vec<f32>>>()?.into_iter().fold(0.0, f32::max);
    let error = |image: &Image| -> anyhow::Result<Image> { Ok(error_map(reference, image, Some(scale))?.0) };
    let errors = images.iter().map(error).collect::<anyhow::Result<Vec<_>>>()?;
    let none = Image::new(reference.width(), reference.height());
    let row = |first: &Image, rest: &[Image]| {
        Image::beside(&std::iter::once(first).chain(rest).collect::<Vec<_>>())
    };
    Ok((above(&row(reference, images), &row(&none, &errors)), scale))
}

/// Renders source and match of an entry beside each other, and their difference.
fn strip_across(
    probe: &Probe,
    stage: &CrossStage,
    (place, samples): (usize, u32),
    path: &Path,
) -> anyhow::Result<Strip> {
    let entry = &probe.entries[place];
    let source = probe.source_material(&entry.source)?;
    let target = probe.target_material(&source, &entry.target, entry.body)?;
    let picture = |material| stage.picture(material, Illumination::Environment, samples);
    let [(a, _), (b, _)] = [picture(&source)?, picture(&target)?];
    let mask = probe.scene.mask(a.width())?;
    let (error, scale) = error_map(&a, &b, Some(error_scale(&a, &b, &mask)?))?;
    write_image(path, &Image::beside(&[&a, &b, &error]), &[])?;
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Strip { file, source, target, columns: vec!["source", "match", "error"], scale })
}

/// One picture above another of the same width.
fn above(upper: &Image, lower: &Image) -> Image {
    Image::from_fn(upper.width(), upper.height() + lower.height(), |x, y| {
        if y < upper.height() { upper.get(x, y) } else { lower.get(x, y - upper.height()) }
    })
}

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1500px;margin:2rem auto;padding:0 1rem;\
color:#222;background:#fafafa}table{border-collapse:collapse;font-variant-numeric:tabular-nums;display:block;\
overflow-x:auto}td,th{padding:.2rem .7rem;text-align:right;border-bottom:1px solid #ddd}td:first-child{text-align:left}\
tr.probe td{font-weight:600}img{width:100%;image-rendering:auto;display:block}figure{margin:1.5rem 0}\
.heads{display:flex}.heads span{flex:1;text-align:center;color:#555}code{background:#eee;padding:0 .3em}";

/// A document about a probe.
fn document(probe: &Probe, body: &Markup) -> Markup {
    let title = format!("{} to {}", probe.from.model().title, probe.to.model().title);
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width,initial-scale=1";
                title { (title) " - lookmatch" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (title) }
                p {
                    (probe.entries.len()) " source materials; metric " code { (probe.metric.name) }
                    @if probe.metric.mask { " with the radial mask" }
                    "; " (probe.program) ", seed " (probe.seed) "."
                }
                (body)
            }
        }
    }
}

fn page(probe: &Probe, validation: &ValidationReport, strips: &[Strip]) -> Markup {
    document(
        probe,
        &html! {
            h2 { "Under light that the search never saw" }
            p {
                "Scene " code { (validation.scene) } ", environment " code { (validation.environment) } ", "
                (validation.points) " source points. NRMSD per channel: lower is better. "
                @if validation.probe_is_best { "The probe beats every baseline on the mean masked NRMSD." }
                @else { "A baseline beats the probe on the mean masked NRMSD." }
            }
            (scores(validation))
            h2 { "Would anybody see it?" }
            p {
                "Means over " (validation.metric_points) " source points, for whole pictures and with the mask. JOD: 10 where nothing \
                 can be seen, 9 where 75 of 100 observers tell which is which. A verdict holds for the viewing conditions below."
            }
            (judged(validation))
            @if !probe.source_axes.is_empty() {
                h2 { "The probe" }
                p {
                    "What it gives for each source material, what is left, and at the bottom the verdict over the source parameters."
                }
                img src=(PLOT) alt="The probe's parameters, its error and the verdicts over the source parameters";
            }
            h2 { "Side by side" }
            p { "Below each picture, its difference from the source, on one scale." }
            (figures(strips))
        },
    )
}

fn page_across(probe: &Probe, strips: &[Strip]) -> Markup {
    document(
        probe,
        &html! {
            h2 { "Matches" }
            p {
                @for renderer in &probe.renderers { "Rendered with " (renderer.name) " " (renderer.version) ". " }
                "NRMSD of the reference scene's picture under its environment, mean of the channels, beside what noise alone \
                 makes of it. A match is decided where it is clearly better than all others that were compared."
            }
            (entries(probe))
            h2 { "Side by side" }
            p { "Under the environment of the reference scene." }
            (figures(strips))
        },
    )
}

fn figures(strips: &[Strip]) -> Markup {
    html! {
        @for strip in strips {
            figure {
                div.heads { @for column in &strip.columns { span { (column) } } }
                img src=(strip.file) alt=(format!("{} beside {}", strip.source, strip.target));
                figcaption { code { (strip.source) } " becomes " code { (strip.target) }
                    "; brightest difference " (format!("{:.3}", strip.scale)) }
            }
        }
    }
}

/// What a probe's entries say, a row each.
fn entries(probe: &Probe) -> Markup {
    let columns = probe.source_axes.len() + probe.target_axes.len();
    let mean = |channels: [f64; 3]| score(channels.iter().sum::<f64>() / 3.0);
    html! {
        table {
            tr {
                @for axis in &probe.source_axes { th { "source " (axis.name) } }
                @for axis in &probe.target_axes { th { "target " (axis.name) } }
                @for name in ["NRMSD", "noise alone", "fitness", "decided"] { th { (name) } }
            }
            @for entry in &probe.entries {
                tr {
                    @for value in &entry.source { td { (value) } }
                    @if let Some(reason) = &entry.failed {
                        td colspan=(columns - entry.source.len() + 4) { "failed: " (reason) }
                    } @else {
                        @for value in &entry.target { td { (value) } }
                        td { (mean(entry.nrmsd)) }
                        td { @if let Some(noise) = entry.noise { (mean(noise.nrmsd)) } }
                        td { (score(entry.fitness)) @if let Some(noise) = entry.noise { " ± " (score(noise.fitness)) } }
                        td { @if let Some(noise) = entry.noise { @if noise.is_decided { "yes" } @else { "no" } } }
                    }
                }
            }
        }
    }
}

/// The metrics of the eye, and how they look at the pictures.
fn judged(validation: &ValidationReport) -> Markup {
    html! {
        table {
            tr { th {} @for method in &validation.methods { th colspan="2" { (method.method) } } }
            tr { th {} @for _ in &validation.methods { th { "whole" } th { "masked" } } }
            @for row in metric_rows(validation) {
                tr { @for cell in row { td { (cell) } } }
            }
        }
        ul { @for (titles, viewing) in viewing_lines(validation.metrics) { li { (titles) ": " (viewing) } } }
    }
}

fn scores(validation: &ValidationReport) -> Markup {
    html! {
        table {
            tr { th {} @for channel in ["red", "green", "blue"] { th colspan="4" { (channel) } } }
            tr { th {} @for _ in 0..3 { @for name in ["min", "max", "mean", "σ"] { th { (name) } } } }
            @for (title, masked) in [("whole image", false), ("masked", true)] {
                @for method in &validation.methods {
                    tr.probe[method.method == "probe"] {
                        td { (title) ": " (method.method) }
                        @for number in numbers(method, masked) { td { (number) } }
                    }
                }
            }
        }
    }
}
