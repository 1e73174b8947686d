//! Twice the light is twice the picture, and nothing is clipped.

use lookmatch_imaging::Image;
use lookmatch_rendering::Scene;

use super::compare;
use super::finding::Limit;
use super::session::{Session, Worn, ball, marked_map};
use super::{Check, Finding};
use crate::{Light, RendererError};

pub(super) const CHECK: Check =
    Check { name: "linearity", about: "twice the light, a thousand times the light, twice the albedo", run };

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
