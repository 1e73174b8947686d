//! Interreflection: what the subjects throw onto the checkerboard, and back again, for any material.
//!
//! Let E be the irradiance of the checkerboard that a material adds to what is baked. The spheres reflect the light of the
//! scene and that of the checkerboard: `E = S + T E`, where both the source S and the operator T are linear in the
//! coefficients of the lobe (see [`crate::rings`]) and in the diffuse albedo. So both are prepared for each coefficient. S is
//! kept on a grid; T, whose results are smooth, between a few functions χ. A material then costs a system of sixteen
//! equations.
//!
//! What the pixels see of it is prepared for a few *modes* of E: the principal components of E over some typical lobes.
//!
//! Here is what a picture needs; `light` samples what the spheres throw onto the checkerboard, and `preparation` makes
//! operators of it.

use std::io;

use glam::DVec3;

use crate::angles::map_position;
use crate::arcs::FUNCTION_TERMS;
use crate::field::Field;
use crate::flat::{Flat, Reader, Writer};
use crate::functions::{COUNT, Functions};
use crate::grid::Grid;
use crate::lobe_table::LobeTable;
use crate::rings::{NODES, TERMS};
use crate::scene::Scene;

use operators::{Feedback, Operator};
use preparation::Preparation;

mod bumps;
mod light;
mod operators;
mod preparation;

/// Principal components of the added irradiance.
pub(crate) const MODES: usize = 6;
/// Angles of view that the operators are tabulated for: every fourth of those of a [`LobeTable`].
const ANGLES: usize = 9;
/// Basis functions of a ring that the operators know: the first terms of every node.
const ROW: usize = NODES * FUNCTION_TERMS;
/// Coefficients of a lobe that matter here.
const LOBE: usize = ANGLES * ROW;

/// For each mode and channel, its share of the added irradiance; channels count by the checkerboard's albedo, relative to
/// its luminance.
pub(crate) type Weights = [[f32; 3]; MODES];

/// The interreflection of a scene under its lights, prepared for all materials.
#[derive(Clone, Debug)]
pub(crate) struct Bounce {
    /// The modes on the checkerboard, by `u, v`.
    pub(crate) modes: Functions,
    /// What the checkerboard sends of an irradiance in each mode, as irradiance of each sphere, by the normal's `u, v`.
    on_spheres: Vec<Functions>,
    /// The source in each mode and channel.
    direct: Operator,
    /// The source in each function χ and channel.
    source: Operator,
    diffuse: Diffuse,
    feedback: Feedback,
    /// Each function χ in each mode.
    lift: [[f32; COUNT]; MODES],
}

/// The source by diffuse reflection, for an albedo of 1 of the spheres that take the material's.
#[derive(Clone, Debug)]
struct Diffuse {
    direct: Weights,
    source: [[f32; 3]; COUNT],
}

/// The coefficients of a lobe that interreflection depends on, for each channel.
pub(crate) struct BounceLobe {
    channels: Box<[[f32; LOBE]; 3]>,
    grey: bool,
}

impl BounceLobe {
    pub(crate) fn new(lobe: &LobeTable) -> Self {
        let mut channels = Box::new([[0.0; LOBE]; 3]);
        for (angle, coefficients) in lobe.every_fourth().enumerate() {
            for i in 0..ROW {
                let value = coefficients[i / FUNCTION_TERMS * TERMS + i % FUNCTION_TERMS];
                (0..3).for_each(|c| channels[c][angle * ROW + i] = value[c]);
            }
        }
        let grey = channels[0] == channels[1] && channels[1] == channels[2];
        Self { channels, grey }
    }
}

impl Bounce {
    /// Prepares the interreflection of a scene; `None` where there is no checkerboard.
    pub(crate) fn prepare(scene: &Scene, field: &Field) -> Option<Self> {
        let (height, half) = field.bodies.plane()?;
        field.board.as_ref()?;
        let preparation = Preparation::new(scene, field, Grid::new(scene, height, half), half);
        Some(preparation.finish(scene))
    }

    /// The irradiance that a material adds to the checkerboard.
    pub(crate) fn weights(&self, lobe: Option<&BounceLobe>, albedo: [f64; 3]) -> Weights {
        let mut weights = [[0.0; 3]; MODES];
        let mut again = [0.0; COUNT * COUNT];
        for c in 0..3 {
            if let Some(lobe) = lobe.filter(|lobe| c == 0 || !lobe.grey) {
                self.feedback.specular.apply_all(&lobe.channels[c], &mut again);
            }
            let share = |operator: &Operator, i: usize| {
                lobe.map_or(0.0, |lobe| operator.apply(3 * i + c, &lobe.channels[c]))
            };
            let albedo = albedo[c] as f32;
            let source = |a: usize| share(&self.source, a) + albedo * self.diffuse.source[a][c];
            let source: [f32; COUNT] = std::array::from_fn(source);
            let more = self.feedback.higher_orders(&again, albedo, c, &source);
            for (m, weights) in weights.iter_mut().enumerate() {
                let lifted: f32 = self.lift[m].iter().zip(&more).map(|(l, e)| l * e).sum();
                weights[c] = self.feedback.tint[c]
                    * (share(&self.direct, m) + albedo * self.diffuse.direct[m][c] + lifted);
            }
        }
        weights
    }

    /// What the checkerboard sends of added irradiance to a point of a sphere, as irradiance for a weight of 1 of each mode.
    pub(crate) fn irradiance(&self, sphere: usize, normal: DVec3) -> [f32; MODES] {
        let (u, v) = map_position(normal);
        let values = self.on_spheres[sphere].at(u, v);
        std::array::from_fn(|m| values[m])
    }
}

impl Flat for Diffuse {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.value(&self.direct)?;
        out.value(&self.source)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(Self { direct: input.value()?, source: input.value()? })
    }
}

impl Flat for Bounce {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        self.modes.write(out)?;
        self.on_spheres.write(out)?;
        self.direct.write(out)?;
        self.source.write(out)?;
        self.diffuse.write(out)?;
        self.feedback.write(out)?;
        out.value(&self.lift)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(Self {
            modes: Flat::read(input)?,
            on_spheres: Flat::read(input)?,
            direct: Flat::read(input)?,
            source: Flat::read(input)?,
            diffuse: Flat::read(input)?,
            feedback: Flat::read(input)?,
            lift: input.value()?,
        })
    }
}
