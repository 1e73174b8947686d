//! Every model at its defaults and at both ends of what a remap would search.

use lookmatch_materials::{Kind, Model, Role};
use serde_json::{Value, json};

use super::finding::Limit;
use super::session::{Session, Worn, defaults, own_name};
use super::{Check, Finding};
use crate::{Light, RendererError};

pub(super) const CHECK: Check = Check {
    name: "parameters",
    about: "every model at its defaults and at the ends of every searched range",
    run,
};

const SAMPLES: u32 = 4;

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    session.load("stage", &session.stage()?)?;
    let on_ball = ball_pixels(session.options.size);
    let models = session.models.clone();
    let mut pictures = 0;
    for model in models {
        for (what, worn, must_shine) in variants(model) {
            let name = format!("{} at {what}", own_name(model));
            let picture = match session.render("stage", &worn, SAMPLES, 1) {
                Ok(picture) => picture,
                Err(error @ (RendererError::Stopped | RendererError::GivenUp { .. })) => return Err(error),
                Err(error) => {
                    finding.fault(format!("{name}: {error}"));
                    continue;
                }
            };
            pictures += 1;
            let light = on_ball.iter().flat_map(|index| picture.image.pixels()[*index]);
            let (least, most) = light.fold((f32::INFINITY, 0.0_f32), |(l, m), v| (l.min(v), m.max(v)));
            if must_shine && shines(session) && most <= 0.0 {
                finding.fault(format!("{name}: the ball is black"));
            }
            if least < -1e-3 * most {
                finding.fault(format!("{name}: the ball's radiance is negative ({least})"));
            }
        }
    }
    finding.measure("pictures", f64::from(pictures), Limit::least(1.0));
    Ok(())
}

/// Whether a smooth ball sees light, from a map or from the checkerboard.
fn shines(session: &Session) -> bool {
    let capabilities = &session.hello.capabilities;
    capabilities.interreflection || capabilities.lights.contains(&Light::Environment)
}

/// Pixels in the middle of the ball.
fn ball_pixels(size: usize) -> Vec<usize> {
    let middle = size / 2;
    let span = middle - size / 8..middle + size / 8;
    span.clone().flat_map(|y| span.clone().map(move |x| y * size + x)).collect()
}

/// What is tried of a model, in words; whether the ball must reflect anything.
fn variants(model: &'static Model) -> Vec<(String, Worn, bool)> {
    let usual = defaults(model);
    let mut variants = vec![("its defaults".to_owned(), usual.clone(), true)];
    for parameter in model.parameters.iter().filter(|p| model.searched.contains(&p.name)) {
        let Some(range) = parameter.range() else { continue };
        for end in [range.search.min, range.search.max] {
            let value: Value = if matches!(parameter.kind, Kind::Colour { .. }) {
                json!([end, end, end])
            } else {
                json!(end)
            };
            let mut worn = usual.clone();
            worn.values.insert(parameter.name.into(), value);
            // What scales light may take all of it away.
            let must_shine = parameter.role.is_width() || parameter.role == Role::RefractiveIndex;
            variants.push((format!("{} = {end}", parameter.name), worn, must_shine));
        }
    }
    variants
}
