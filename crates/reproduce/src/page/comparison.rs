//! Pictures that should look alike: one over the other with a line to wipe between them, and all of them side by side.

use std::path::Path;

use lookmatch_imaging::{Image, Verdict, error_map, srgb_encode};
use maud::{Markup, html};

use super::embedded;
use crate::number::number;
use crate::{Comparison, Picture};

/// Colours that the scale of error maps is drawn with; the browser fills in those between.
const STOPS: usize = 17;

/// A comparison; `id` is its own in the page.
///
/// Each picture is in the page once: the script takes those that it lays over each other from those side by side.
pub(super) fn comparison(comparison: &Comparison, id: &str, folder: &Path) -> anyhow::Result<Markup> {
    let has_errors = comparison.others.iter().any(|other| other.error_file.is_some());
    Ok(html! {
        section.comparison {
            h3 { (comparison.title) }
            div.sides {
                @if !comparison.others.is_empty() { (wipe(comparison, id)) }
                div.strip {
                    figure {
                        (picture(&comparison.source, folder)?)
                        div.error { @if has_errors { (scale(comparison.scale)?) } }
                        (caption(&comparison.source))
                    }
                    @for other in &comparison.others {
                        figure {
                            (picture(other, folder)?)
                            div.error { (error(other, comparison.scale, folder)?) }
                            (caption(other))
                        }
                    }
                }
            }
        }
    })
}

/// What the script needs to lay the source over one of the others; without a script it stays hidden.
fn wipe(comparison: &Comparison, id: &str) -> Markup {
    let [source, first] = [&comparison.source, &comparison.others[0]].map(|picture| &picture.title);
    html! {
        div.wipe hidden {
            fieldset {
                legend { (source) " beside" }
                @for (k, other) in comparison.others.iter().enumerate() {
                    label { input type="radio" name=(format!("{id}-wipe")) value=(k) checked[k == 0]; span { (other.title) } }
                }
            }
            div.stage {
                span.tag.left aria-hidden="true" { (source) }
                span.tag.right aria-hidden="true" { (first) }
                span.line aria-hidden="true" {}
                input type="range" min="0" max="100" value="50"
                    aria-label=(format!("{}: percent of the picture, from the left, that show the {source}", comparison.title));
            }
        }
    }
}

fn picture(picture: &Picture, folder: &Path) -> anyhow::Result<Markup> {
    let alt = format!("{}: {}", picture.title, picture.material);
    Ok(html! { img.picture src=(embedded(folder, &picture.file)?) alt=(alt) data-title=(picture.title); })
}

fn error(picture: &Picture, scale: f64, folder: &Path) -> anyhow::Result<Markup> {
    let alt = format!(
        "Error map, {}: distance from the source in linear RGB, black 0, yellow {}",
        picture.title,
        number(scale)
    );
    Ok(html! { @if let Some(file) = &picture.error_file { img src=(embedded(folder, file)?) alt=(alt); } })
}

/// What a picture is, and how far it is from the source.
fn caption(picture: &Picture) -> Markup {
    html! {
        figcaption {
            b { (picture.title) }
            code { @for part in picture.material.split_inclusive([',', ':', '/']) { (part) wbr; } }
            @if let Some(verdict) = picture.verdict { (label(verdict)) }
            @if picture.nrmsd.is_some() || picture.jod.is_some() {
                dl.scores {
                    @if let Some(nrmsd) = picture.nrmsd { div { dt { "NRMSD" } dd { (number(nrmsd)) } } }
                    @if let Some(jod) = picture.jod { div { dt { "JOD" } dd { (format!("{jod:.2}")) } } }
                }
            }
        }
    }
}

fn label(verdict: Verdict) -> Markup {
    match verdict {
        Verdict::Indistinguishable => html! { span.verdict.same { (verdict.title()) } },
        Verdict::SlightlyDifferent => html! { span.verdict.slight { (verdict.title()) } },
        Verdict::NoticeablyDifferent => html! { span.verdict.different { (verdict.title()) } },
    }
}

/// A number without the zeros that say nothing.
fn round(value: f64) -> String {
    let text = number(value);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

/// The colours of error maps with the distances that they mean.
fn scale(scale: f64) -> anyhow::Result<Markup> {
    let ticks = [0.0, 0.5, 1.0].map(|share| round(share * scale));
    Ok(html! {
        div.scale {
            p { "Distance in linear RGB" }
            div.colours style=(format!("background:linear-gradient(to right,{})", colours()?)) {}
            div.ticks { @for tick in ticks { span { (tick) } } }
        }
    })
}

/// The colours of [`error_map`] from 0 to 1, in the notation of CSS.
fn colours() -> anyhow::Result<String> {
    let last = (STOPS - 1) as f32;
    let ramp = Image::from_fn(STOPS, 1, |x, _| [x as f32 / last, 0.0, 0.0]);
    let (map, _) = error_map(&Image::new(ramp.width(), 1), &ramp, Some(1.0))?;
    let colour = |pixel: &[f32; 3]| {
        let [red, green, blue] = pixel.map(|value| (srgb_encode(value) * 255.0).round());
        format!("rgb({red},{green},{blue})")
    };
    Ok(map.pixels().iter().map(colour).collect::<Vec<_>>().join(","))
}
