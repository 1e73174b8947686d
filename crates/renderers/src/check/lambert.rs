//! A Lambert ball alone under a point light.

use lookmatch_imaging::{Image, srgb_decode, srgb_encode};
use lookmatch_rendering::Scene;

use super::closed_form::{Finish, Known, World};
use super::compare::{self, Suspect};
use super::finding::{Limit, short};
use super::session::{Session, ball};
use super::{Check, Finding};
use crate::{Light, RendererError};

pub(super) const CHECK: Check =
    Check { name: "lambert", about: "a Lambert ball alone under a point light, up to radiances of 3", run };

const ALBEDO: [f64; 3] = [0.7, 0.5, 0.3];

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    if !session.has(Light::Point, finding) {
        return Ok(());
    }
    let (worn, albedo) = session.lambert(ALBEDO);
    let scene = bright();
    session.load("lambert", &scene)?;
    let got = session.picture("lambert", &worn)?;
    let known = known(session, &scene, albedo);
    let chosen = known.subject();
    let ratio = compare::median_ratio(&got, &known.image, &chosen);
    let mut is_right = finding.measure("median ratio", ratio, Limit::between(0.99, 1.01));
    let share = compare::share_close(&got, &known.image, &chosen, 1.0);
    is_right &= finding.measure("share of pixels within 1 %", share, Limit::least(0.95));
    let exponent = compare::exponent(&got, &known.image, &chosen);
    is_right &= finding.measure("exponent", exponent, Limit::between(0.98, 1.02));
    finding.show("ball", &got, &known.image);
    if !is_right {
        let suspects = suspects(session, &scene, albedo, &known.image);
        let cause = compare::explain(&got, &known.image, &chosen, &suspects);
        finding.remark(cause.unwrap_or_else(|| {
            format!(
                "pixels go with the power {} of what they should be: encoded, a tone curve, another fall-off with distance, \
                 or no Lambert material",
                short(exponent)
            )
        }));
    }
    Ok(())
}

/// Bright enough for a clipped picture to be found out.
fn bright() -> Scene {
    let mut scene = ball();
    scene.point_lights[0].intensity = [500.0, 400.0, 300.0];
    scene
}

fn known(session: &Session, scene: &Scene, albedo: [f64; 3]) -> Known {
    World::new(scene, None, Finish::Lambert(albedo)).picture(session.options.size, 8)
}

fn suspects(session: &Session, scene: &Scene, albedo: [f64; 3], expected: &Image) -> Vec<Suspect> {
    let mut suspects = compare::tones(expected);
    let mut other = |words: &str, scene: &Scene, albedo: [f64; 3]| {
        suspects.push(Suspect::new(words, known(session, scene, albedo).image));
    };
    let each = |change: fn(f32) -> f32| albedo.map(|a| f64::from(change(a as f32)));
    other("colours of materials are taken for sRGB and decoded: they are linear", scene, each(srgb_decode));
    other("colours of materials are sRGB-encoded: they are linear", scene, each(srgb_encode));
    other("albedos are squared: set twice or multiplied by themselves", scene, each(|a| a * a));
    other("albedos have no effect", scene, [1.0; 3]);
    let mut squared = scene.clone();
    squared.point_lights[0].intensity = scene.point_lights[0].intensity.map(|i| i * i / 400.0);
    other(
        "the light's intensity is squared: its colour and its strength are both set to it",
        &squared,
        albedo,
    );
    let mut far = scene.clone();
    let direction = glam::DVec3::from(scene.point_lights[0].position);
    far.point_lights[0].position = (1e4 * direction).into();
    far.point_lights[0].intensity = scene.point_lights[0].intensity.map(|i| 1e8 * i);
    other(
        "light does not fall off with the square of the distance, or comes from one direction",
        &far,
        albedo,
    );
    let mut mirrored = scene.clone();
    mirrored.point_lights[0].position[0] *= -1.0;
    other("the light is on the other side (x is mirrored)", &mirrored, albedo);
    let mut behind = scene.clone();
    behind.point_lights[0].position[2] *= -1.0;
    other("the light is on the other side (z is mirrored: the frame is left-handed)", &behind, albedo);
    suspects
}
