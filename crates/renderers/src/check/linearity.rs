//! Twice the light is twice the picture, and nothing is clipped.

use lookmatch_imaging::Image;
use lookmatch_materials::Kind;
use lookmatch_rendering::Scene;
use serde_json::json;

use super::compare;
use super::finding::Limit;
use super::session::{Session, Worn, ball, defaults, marked_map, own_name};
use super::{Check, Finding};
use crate::{Light, RendererError};

pub(super) const CHECK: Check = Check {
    name: "linearity",
    about: "twice the light, a thousand times the light, twice the albedo; what models declare",
    run,
};

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    let has = |light| session.hello.capabilities.lights.contains(&light);
    let (grey, dark) = (session.lambert([0.5; 3]).0, session.lambert([0.25; 3]).0);
    if has(Light::Point) {
        let once = lamp(session, "once", 1.0, &grey)?;
        ratio("lamp", 2.0, &lamp(session, "twice", 2.0, &grey)?, &once, finding);
        ratio("lamp", 1e4, &lamp(session, "bright", 1e4, &grey)?, &once, finding);
        let darker = lamp(session, "once", 1.0, &dark)?;
        let found = quotient(&once, &darker);
        if !finding.measure("twice the albedo", found, Limit::between(1.98, 2.02)) {
            finding.remark("albedos are not linear: decoded, clipped, or there is more than a Lambert term");
        }
    }
    if has(Light::Environment) {
        let once = sky(session, "sky", 1.0, &grey)?;
        ratio("map", 2.0, &sky(session, "twice", 2.0, &grey)?, &once, finding);
        ratio("map", 1e3, &sky(session, "bright", 1e3, &grey)?, &once, finding);
    }
    declared(session, finding)
}

/// Halfway between two values of a parameter that a model says it is linear in, the picture is halfway between theirs.
fn declared(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    let light = session.hello.capabilities.lights.contains(&Light::Environment);
    for model in session.models.clone() {
        for parameter in model.parameters.iter().filter(|p| model.linear.contains(&p.name)) {
            let Some(range) = parameter.range() else { continue };
            let (low, high) = (range.search.min, range.search.max);
            let shown = |value: f64| {
                let mut worn = defaults(model);
                let is_colour = matches!(parameter.kind, Kind::Colour { .. });
                let value = if is_colour { json!([value, value, value]) } else { json!(value) };
                worn.values.insert(parameter.name.into(), value);
                if light { sky(session, "sky", 1.0, &worn) } else { lamp(session, "once", 1.0, &worn) }
            };
            let (low, high, middle) = (shown(low)?, shown(high)?, shown((low + high) / 2.0)?);
            let halfway = low.zipped(&high, |a, b| (a + b) / 2.0);
            let name = |what| format!("{} halfway in {}: {what}", own_name(model), parameter.name);
            let (ratio, off) = (quotient(&middle, &halfway), off_halfway(&low, &middle, &high));
            // The median is that of the body, the other is that of the highlight where one changes.
            let is_body_linear = finding.measure(name("ratio"), ratio, Limit::between(0.97, 1.03));
            let is_change_linear = finding.measure(name("off"), off, Limit::between(-0.03, 0.03));
            if !is_body_linear || !is_change_linear {
                finding.remark(format!(
                    "{} says that it is linear in {}, and is not",
                    own_name(model),
                    parameter.name
                ));
            }
        }
    }
    Ok(())
}

fn lamp(session: &Session, name: &str, strength: f64, worn: &Worn) -> Result<Image, RendererError> {
    let mut scene = ball();
    scene.point_lights[0].intensity = scene.point_lights[0].intensity.map(|i| strength * i);
    picture(session, name, &scene, worn)
}

fn sky(session: &Session, name: &str, strength: f32, worn: &Worn) -> Result<Image, RendererError> {
    let mut scene = ball();
    scene.point_lights.clear();
    let map = compare::mapped(&marked_map(), |p| p.map(|v| strength * v));
    scene.environment = Some(session.map(name, &map)?);
    picture(session, name, &scene, worn)
}

fn picture(session: &Session, name: &str, scene: &Scene, worn: &Worn) -> Result<Image, RendererError> {
    session.load(&format!("linearity {name}"), scene)?;
    session.picture(&format!("linearity {name}"), worn)
}

/// The median of bright values over those of another picture.
fn quotient(more: &Image, less: &Image) -> f64 {
    compare::median_ratio(more, less, &vec![true; less.pixels().len()])
}

/// How far a picture is from halfway between two others, as a share of their change: 0 for linear parameters, -0.25 for a square.
/// Noise has no part in it, because it does not depend on the sign of the change.
fn off_halfway(low: &Image, middle: &Image, high: &Image) -> f64 {
    let pixels = low.pixels().as_flattened().iter().zip(middle.pixels().as_flattened());
    let triples =
        pixels.zip(high.pixels().as_flattened()).map(|((l, m), h)| [l, m, h].map(|v| f64::from(*v)));
    let (off, change) = triples.fold((0.0, 0.0), |(off, change), [low, middle, high]| {
        (off + (middle - (low + high) / 2.0) * (high - low), change + (high - low).powi(2))
    });
    // What shows nothing changes evenly.
    if change == 0.0 { 0.0 } else { off / change }
}

fn ratio(what: &str, strength: f64, more: &Image, less: &Image, finding: &mut Finding) {
    let found = quotient(more, less) / strength;
    let name = format!("{strength} times the {what}: ratio over {strength}");
    if !finding.measure(name, found, Limit::between(0.99, 1.01)) {
        finding.remark(match strength > 100.0 {
            true => {
                format!("bright light of a {what} is lost: clipped, clamped, or stored with too few digits")
            }
            false => format!(
                "pictures are not linear in the strength of a {what}: encoded, clipped, exposed by themselves"
            ),
        });
    }
}
