//! What the diffuse term of all subject pixels reflects: of the baked light, and of irradiance that the material adds to the
//! checkerboard.

use std::f32::consts::PI;
use std::io;

use fearless_simd::{Level, Simd, dispatch, prelude::*};
use glam::DVec3;

use crate::bounce::{Bounce, MODES, Weights};
use crate::field::Field;
use crate::film::{Film, SurfacePoint};
use crate::flat::{Flat, Reader, Writer};
use crate::irradiance::Place;
use crate::scene::Scene;
use crate::transport::Planes;
use crate::{Rgb, rgb};

/// Light that leaves one subject pixel diffusely.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DiffuseLight {
    /// Baked light, from spheres with a colour of their own.
    own: Rgb,
    /// From the others, for an albedo of 1.
    white: Rgb,
    /// Of an irradiance of the checkerboard in each mode of the interreflection: by spheres with a colour of their own, for
    /// each channel, then by the others, for an albedo of 1.
    modes: [[f32; MODES]; 4],
}

impl DiffuseLight {
    /// The light of a pixel. Point lights have hard shadows and are evaluated at each sub-pixel sample; the rest is
    /// smooth and evaluated once per sphere, at the mean of its samples.
    pub(crate) fn of_pixel(
        scene: &Scene,
        field: &Field,
        film: &Film,
        bounce: Option<&Bounce>,
        pixel: usize,
    ) -> Self {
        let (points, count) = film.points(&field.bodies, pixel);
        let mut light = Self::default();
        for (sphere, description) in scene.spheres.iter().enumerate() {
            let here: Vec<&SurfacePoint> = points.iter().filter(|p| p.sphere == sphere).collect();
            let Some(first) = here.first() else { continue };
            let normal = here.iter().map(|p| p.place.normal).sum::<DVec3>().normalize();
            let mean = Place { position: field.bodies.point(sphere, normal), normal, body: first.place.body };
            let sharp: Rgb = here.iter().map(|p| field.point_irradiance(&p.place)).sum();
            let irradiance = sharp + field.smooth_irradiance(&mean) * here.len() as f32;
            let radiance = irradiance / (count as f32 * PI);
            let share = here.len() as f32 / count as f32;
            let colour = match description.diffuse {
                Some(own) => {
                    light.own += rgb(own) * radiance;
                    rgb(own)
                }
                None => {
                    light.white += radiance;
                    Rgb::W
                }
            };
            if let Some(bounce) = bounce {
                light.add_modes(colour * share, bounce.irradiance(sphere, normal));
            }
        }
        light
    }

    /// Adds what a sphere reflects of irradiance in each mode; its albedo times its share of the pixel, for channels and for
    /// an albedo of 1.
    fn add_modes(&mut self, share: Rgb, irradiance: [f32; MODES]) {
        for (modes, share) in self.modes.iter_mut().zip(share.to_array()) {
            modes.iter_mut().zip(irradiance).for_each(|(mode, e)| *mode += share * (e / PI));
        }
    }
}

/// All subject pixels, number by number.
pub(crate) struct Returned {
    /// [`DiffuseLight::modes`]
    planes: [[Vec<f32>; MODES]; 4],
    own: Planes,
    white: Planes,
    has_own: bool,
}

impl Returned {
    pub(crate) fn new(lights: &[DiffuseLight]) -> Self {
        let plane = |value: &dyn Fn(&DiffuseLight) -> f32| -> Vec<f32> { lights.iter().map(value).collect() };
        Self::of(
            std::array::from_fn(|share| std::array::from_fn(|m| plane(&|light| light.modes[share][m]))),
            std::array::from_fn(|c| plane(&|light| light.own[c])),
            std::array::from_fn(|c| plane(&|light| light.white[c])),
        )
    }

    fn of(planes: [[Vec<f32>; MODES]; 4], own: Planes, white: Planes) -> Self {
        let has_own = planes[..3].as_flattened().iter().flatten().any(|v| *v != 0.0);
        Self { planes, own, white, has_own }
    }

    /// Adds the baked light for an albedo to planes of pixels.
    pub(crate) fn add_baked(&self, albedo: [f64; 3], planes: &mut Planes) {
        for c in 0..3 {
            let albedo = albedo[c] as f32;
            let light = self.own[c].iter().zip(&self.white[c]).map(|(own, white)| own + albedo * white);
            planes[c].iter_mut().zip(light).for_each(|(sum, v)| *sum += v);
        }
    }

    /// Adds it to planes of pixels, for an albedo and the modes' weights.
    pub(crate) fn add(&self, weights: &Weights, albedo: [f64; 3], planes: &mut Planes) {
        let level = Level::new();
        for c in 0..3 {
            let own = weights.map(|w| w[c]);
            let white = own.map(|w| w * albedo[c] as f32);
            if self.has_own {
                dispatch!(level, simd => add_modes(simd, &self.planes[c], &own, &mut planes[c]));
            }
            if white != [0.0; MODES] {
                dispatch!(level, simd => add_modes(simd, &self.planes[3], &white, &mut planes[c]));
            }
        }
    }
}

impl Flat for Returned {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        let mut all = self.planes.as_flattened().iter().chain(&self.own).chain(&self.white);
        all.try_for_each(|plane| out.slice(plane))
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        let mut planes: [[Vec<f32>; MODES]; 4] = Default::default();
        let (mut own, mut white) = (Planes::default(), Planes::default());
        for plane in planes.as_flattened_mut().iter_mut().chain(&mut own).chain(&mut white) {
            *plane = input.vec()?;
        }
        Ok(Self::of(planes, own, white))
    }
}

#[inline(always)]
fn add_modes<S: Simd>(simd: S, modes: &[Vec<f32>; MODES], weights: &[f32; MODES], plane: &mut [f32]) {
    let width = S::f32s::LEN;
    let whole = plane.len() / width * width;
    for start in (0..whole).step_by(width) {
        let lanes = start..start + width;
        let mut sum = S::f32s::from_slice(simd, &plane[lanes.clone()]);
        for (mode, weight) in modes.iter().zip(weights) {
            sum = S::f32s::from_slice(simd, &mode[lanes.clone()]).mul_add(*weight, sum);
        }
        sum.store_slice(&mut plane[lanes]);
    }
    for k in whole..plane.len() {
        plane[k] += modes.iter().zip(weights).map(|(mode, weight)| mode[k] * weight).sum::<f32>();
    }
}
