//! What the renderer says of itself, and how it takes requests that make no sense.

use lookmatch_materials::{Kind, Model};
use lookmatch_rendering::Illumination;
use serde_json::{Map, Value, json};

use super::session::{Session, ball};
use super::{Check, Finding};
use crate::pool::Job;
use crate::scene::SceneData;
use crate::worker::Worker;
use crate::{Cause, RendererError};

pub(super) const CHECK: Check = Check {
    name: "handshake",
    about: "hello, descriptions of models, and requests that must be refused",
    run,
};

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    for why in &session.misdescribed {
        finding.fault(why.clone());
    }
    let lambert = &session.hello.check.lambert;
    let mut values = lambert.values.clone();
    values.insert(lambert.parameter.clone(), json!([0.5, 0.5, 0.5]));
    check_material(session.model(&lambert.model), "check.lambert", &values, finding);
    let parameter =
        session.model(&lambert.model).and_then(|m| m.parameters.iter().find(|p| p.name == lambert.parameter));
    if parameter.is_none_or(|p| !matches!(p.kind, Kind::Colour { .. })) {
        finding.fault(format!(
            "check.lambert.parameter is '{}'; expected a colour of its model",
            lambert.parameter
        ));
    }
    if let Some(mirror) = &session.hello.check.mirror {
        check_material(session.model(&mirror.model), "check.mirror", &mirror.values, finding);
    }
    let (mut worker, _) = Worker::start(session.launch, &session.pool_options(), &*session.stop)?;
    let small = SceneData::new(("small", 1), &small(session)?, Illumination::All, 16, &session.hello)?;
    let (worn, _) = session.lambert([0.5; 3]);
    let job = |scene: &str| Job {
        scene: scene.into(),
        model: worn.model.clone(),
        values: worn.values.clone(),
        samples: 4,
        seed: 1,
    };
    worker.load(&small, &*session.stop)?;
    let before = worker.render(&job("small"), &small, &*session.stop)?;
    let refused = [
        ("an unknown request", json!({ "request": "no-such-request" })),
        (
            "a picture of an unknown scene",
            json!({ "request": "render", "scene": "no such scene", "samples": 1, "seed": 1 }),
        ),
        ("an unknown model", json!({ "request": "material", "model": "no-such-model", "values": {} })),
    ];
    for (what, body) in refused {
        expect_refusal(&mut worker, what, &body, session, finding)?;
    }
    let comment = json!({ "request": "material", "model": worn.model, "values": worn.values, "comment": "an unknown field" });
    if let Err(error) = worker.request(&comment, &*session.stop) {
        finding.fault(format!("unknown fields of a request are to be ignored, but: {error}"));
    }
    let after = worker.render(&job("small"), &small, &*session.stop)?;
    let change = super::compare::rms(&before.image, &after.image);
    if change > 0.05 * f64::from(super::compare::brightest(&before.image)) {
        finding.fault("its picture is another one after requests that it refused: an error must leave everything as it was");
    }
    Ok(())
}

/// A ball under the first light that the renderer has.
fn small(session: &Session) -> Result<lookmatch_rendering::Scene, RendererError> {
    let mut scene = ball();
    if !session.hello.capabilities.lights.contains(&crate::Light::Point) {
        scene.point_lights.clear();
        scene.environment = Some(session.map("marked", &super::session::marked_map())?);
    }
    Ok(scene)
}

/// A material of the field `check` must name a model and every parameter of it.
fn check_material(model: Option<&Model>, field: &str, values: &Map<String, Value>, finding: &mut Finding) {
    let Some(model) = model else {
        finding.fault(format!("{field}.model is none of its models"));
        return;
    };
    for parameter in model.parameters.iter().filter(|p| !values.contains_key(p.name)) {
        finding.fault(format!("{field}.values lacks '{}'; expected all parameters", parameter.name));
    }
    for name in values.keys().filter(|name| !model.parameters.iter().any(|p| p.name == name.as_str())) {
        finding.fault(format!("{field} names '{name}', which is no parameter of {}", model.name));
    }
}

/// Sends what must be answered with an error.
fn expect_refusal(
    worker: &mut Worker,
    what: &str,
    body: &Value,
    session: &Session,
    finding: &mut Finding,
) -> Result<(), RendererError> {
    match worker.request(body, &*session.stop) {
        Ok(answer) => {
            finding.fault(format!("{what} is answered with {}; expected an error", Value::Object(answer)))
        }
        Err(RendererError::Request(failure)) if matches!(failure.cause, Cause::Refused(_)) => (),
        Err(error) => return Err(error),
    }
    Ok(())
}
