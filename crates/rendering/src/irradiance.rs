//! Irradiance at a point from each kind of light, in W/m².

use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, prelude::*};
use glam::DVec3;

use crate::Rgb;
use crate::bodies::{Bodies, Body};
use crate::product::{LANES, Lanes};

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

/// Lights in every direction that stand for an environment map, sixteen in a row: directions and irradiance on a surface
/// that faces them.
#[derive(Clone, Debug)]
pub(crate) struct SkyLights {
    direction: Vec<[Lanes; 3]>,
    power: Vec<[Lanes; 3]>,
}

impl SkyLights {
    pub(crate) fn new(lights: &[(DVec3, Rgb)]) -> Self {
        let lanes = |value: &dyn Fn(&(DVec3, Rgb), usize) -> f32| -> Vec<[Lanes; 3]> {
            let row = |chunk: &[(DVec3, Rgb)]| {
                std::array::from_fn(|k| {
                    std::array::from_fn(|l| chunk.get(l).map_or(0.0, |light| value(light, k)))
                })
            };
            lights.chunks(LANES).map(row).collect()
        };
        Self { direction: lanes(&|light, k| light.0[k] as f32), power: lanes(&|light, k| light.1[k]) }
    }

    /// Irradiance at a place, behind the bodies.
    pub(crate) fn irradiance(&self, bodies: &Bodies, place: &Place) -> Rgb {
        let level = Level::new();
        dispatch!(level, simd => self.irradiance_at(simd, bodies, place))
    }

    #[inline(always)]
    fn irradiance_at<S: Simd>(&self, simd: S, bodies: &Bodies, place: &Place) -> Rgb {
        let mut sums = [f32x16::splat(simd, 0.0); 3];
        for (direction, power) in self.direction.iter().zip(&self.power) {
            let direction = direction.map(|axis| f32x16::load_array(simd, axis));
            let cos = dot(direction, place.normal).max(0.0);
            let open = bodies.open(simd, direction, place);
            let lit = open.select(cos, f32x16::splat(simd, 0.0));
            (0..3).for_each(|c| sums[c] = lit.mul_add(f32x16::load_array(simd, power[c]), sums[c]));
        }
        let [r, g, b] = sums.map(|lanes| lanes.reduce_sum());
        Rgb::new(r, g, b, 0.0)
    }
}

/// The product of directions in lanes with one vector.
#[inline(always)]
fn dot<S: Simd>(direction: [f32x16<S>; 3], v: DVec3) -> f32x16<S> {
    let [x, y, z] = direction;
    x.mul_add(v.x as f32, y.mul_add(v.y as f32, z * v.z as f32))
}

impl Bodies {
    /// The directions from a place that meet no body.
    #[inline(always)]
    fn open<S: Simd>(&self, simd: S, direction: [f32x16<S>; 3], place: &Place) -> mask32x16<S> {
        let mut hidden = mask32x16::splat(simd, false);
        for (k, (centre, radius)) in self.spheres().iter().enumerate() {
            if place.body == Body::Sphere(k) {
                continue;
            }
            let from_centre = place.position - *centre;
            let along = dot(direction, from_centre);
            // Squared distance of the ray's line from the centre.
            let axis = along.mul_add(-along, from_centre.length_squared() as f32);
            hidden |= along.simd_lt(0.0) & axis.simd_lt((radius * radius) as f32);
        }
        if let Some((height, half)) = self.plane().filter(|_| place.body != Body::Plane) {
            let [x, y, z] = direction;
            let distance = f32x16::splat(simd, (height - place.position.y) as f32) / y;
            let reach = |axis: f32x16<S>, start: f64| distance.mul_add(axis, start as f32).abs();
            let inside = reach(x, place.position.x).max(reach(z, place.position.z)).simd_le(half as f32);
            hidden |= inside & distance.simd_gt(0.0);
        }
        !hidden
    }
}
