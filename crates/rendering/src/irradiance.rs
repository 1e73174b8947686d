//! Irradiance at a point from each kind of light, in W/m².

use std::f64::consts::PI;

use glam::DVec3;

use crate::Rgb;
use crate::bodies::{Bodies, Body};
use crate::environment::EnvironmentMap;
use crate::field::Field;
use crate::sampling::cosine_direction;

/// Rays towards other bodies.
const BODY_SAMPLES: u32 = 256;

/// A point of a body with its outward unit normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) position: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) body: Body,
}

/// From one point light of intensity `intensity` W/sr: `I cos θ/d²`, 0 in shadow.
pub(crate) fn from_point(bodies: &Bodies, (light, intensity): (DVec3, Rgb), place: &Place) -> Rgb {
    let to_light = light - place.position;
    let distance2 = to_light.length_squared();
    let cos = to_light.dot(place.normal) / distance2.sqrt();
    if cos <= 0.0 || bodies.occluded(place.position, light, Some(place.body)) {
        return Rgb::ZERO;
    }
    intensity * (cos / distance2) as f32
}

/// From the environment, behind the bodies.
pub(crate) fn from_environment(bodies: &Bodies, environment: &EnvironmentMap, place: &Place) -> Rgb {
    let mut sum = Rgb::ZERO;
    for (direction, power) in &environment.lights {
        let cos = direction.dot(place.normal);
        if cos > 0.0 && bodies.first(place.position, *direction, Some(place.body)).is_none() {
            sum += *power * cos as f32;
        }
    }
    sum
}

/// From the diffuse radiance of the other bodies.
pub(crate) fn from_bodies(field: &Field, place: &Place) -> Rgb {
    let mut sum = Rgb::ZERO;
    for i in 0..BODY_SAMPLES {
        let direction = cosine_direction(i, place.normal);
        // Each ray stands for an equal share of the projected hemisphere, about this wide.
        let width = (PI / f64::from(BODY_SAMPLES)).sqrt();
        sum += field.body_radiance(place, direction, width).unwrap_or(Rgb::ZERO);
    }
    sum * (PI / f64::from(BODY_SAMPLES)) as f32
}
