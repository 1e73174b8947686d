//! What the diffuse term of all subject pixels reflects: of the baked light, and of irradiance that the material adds to the
//! checkerboard.

use std::io;

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use crate::bounce::{MODES, Weights};
use crate::flat::{Flat, Reader, Writer};
use crate::transport::Planes;

/// One subject pixel: its baked light from spheres with a colour of their own and, for an albedo of 1, from others; the shares
/// of it that they cover; and what it gets of irradiance of the checkerboard in each mode.
pub(crate) struct ReturnedLight {
    pub(crate) own: [f32; 3],
    pub(crate) white: [f32; 3],
    pub(crate) own_share: [f32; 3],
    pub(crate) white_share: f32,
    pub(crate) modes: [f32; MODES],
}

/// All subject pixels, number by number.
pub(crate) struct Returned {
    /// Modes times shares: of spheres with a colour of their own by channel, then of the others.
    planes: [[Vec<f32>; MODES]; 4],
    own: Planes,
    white: Planes,
    has_own: bool,
}

impl Returned {
    pub(crate) fn new(lights: impl Iterator<Item = ReturnedLight> + Clone) -> Self {
        let plane = |share: usize, m: usize| -> Vec<f32> {
            let share = |l: &ReturnedLight| if share < 3 { l.own_share[share] } else { l.white_share };
            lights.clone().map(|l| share(&l) * l.modes[m]).collect()
        };
        Self::of(
            std::array::from_fn(|share| std::array::from_fn(|m| plane(share, m))),
            std::array::from_fn(|c| lights.clone().map(|l| l.own[c]).collect()),
            std::array::from_fn(|c| lights.clone().map(|l| l.white[c]).collect()),
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
