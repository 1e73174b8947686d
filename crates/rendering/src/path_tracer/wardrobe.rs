//! What the subjects wear: one material all over, or several, chosen point by point.

use glam::DVec3;
use lookmatch_materials::{Bsdf, Material, Sampling};

use super::world::{Encounter, Surface, World};
use crate::Part;

/// A point on a subject: what decides about the material there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Number of the subject: spheres first, then meshes, both in the order of the scene.
    pub subject: usize,
    /// Texture coordinates u and v, at least 0 and below 1.
    ///
    /// Of a sphere, u runs eastwards along the tangent from a seam at −Z (+Z is 1/2), and v along the bitangent from 0 at
    /// the lower pole to 1 at the upper one, evenly in angle. Of a mesh, they are those of its file, repeated beyond 0
    /// and 1; without any they are 0.
    pub texture: [f64; 2],
}

/// The number of the material that is worn at a point; the same for the same point whenever it is asked for.
pub type Wears<'a> = &'a (dyn Fn(Spot) -> usize + Sync);

/// A material, ready for paths.
pub(super) struct Coat {
    pub(super) diffuse: DVec3,
    pub(super) lobe: Option<Lobe>,
}

/// What a material has beside its Lambert term.
pub(super) struct Lobe {
    pub(super) bsdf: Box<dyn Bsdf>,
    pub(super) sampling: Sampling,
    /// Width of its narrowest part.
    pub(super) alpha: f64,
}

/// A sphere that throws highlights.
#[derive(Clone, Copy)]
pub(super) struct Ball {
    pub(super) centre: DVec3,
    pub(super) radius: f64,
    /// Width of the narrowest lobe that it wears; 0 where it has none.
    pub(super) alpha: f64,
}

/// The materials of a picture, and who wears them.
pub(super) struct Wardrobe<'a> {
    coats: Vec<Coat>,
    wears: Wears<'a>,
    pub(super) balls: Vec<Ball>,
}

/// Columns and rows of points at which a sphere is asked for its narrowest lobe.
const ASKED: [usize; 2] = [16, 8];

impl<'a> Wardrobe<'a> {
    pub(super) fn new(materials: &[Material], wears: Wears<'a>, part: Part, world: &World) -> Self {
        let coats = materials.iter().map(|material| Coat::new(material, part)).collect();
        let mut wardrobe = Self { coats, wears, balls: Vec::new() };
        let ball = |(k, (centre, radius)): (usize, &(DVec3, f64))| Ball {
            centre: *centre,
            radius: *radius,
            alpha: wardrobe.narrowest(k),
        };
        wardrobe.balls = world.spheres.iter().enumerate().map(ball).collect();
        wardrobe
    }

    /// What is worn at a point; nothing on the checkerboard.
    pub(super) fn coat(&self, world: &World, at: &Encounter) -> Option<&Coat> {
        match &*self.coats {
            [coat] => (at.surface != Surface::Plane).then_some(coat),
            _ => world.spot(at).map(|spot| self.chosen(spot)),
        }
    }

    fn chosen(&self, spot: Spot) -> &Coat {
        let (number, count) = ((self.wears)(spot), self.coats.len());
        assert!(number < count, "{spot:?} wears material {number}, but there are {count} (from 0)");
        &self.coats[number]
    }

    /// Directions are aimed at reflections in a sphere before it is known where it is met: one width must do for all of it.
    fn narrowest(&self, sphere: usize) -> f64 {
        let [columns, rows] = ASKED;
        let spot = |k: usize| {
            let place = |k: usize, count: usize| (k as f64 + 0.5) / count as f64;
            Spot { subject: sphere, texture: [place(k % columns, columns), place(k / columns, rows)] }
        };
        let coats: Vec<&Coat> = match &*self.coats {
            [coat] => vec![coat],
            _ => (0..columns * rows).map(|k| self.chosen(spot(k))).collect(),
        };
        let alphas = coats.iter().filter_map(|coat| Some(coat.lobe.as_ref()?.alpha)).filter(|a| *a > 0.0);
        alphas.min_by(f64::total_cmp).unwrap_or(0.0)
    }
}

impl Coat {
    fn new(material: &Material, part: Part) -> Self {
        let bsdf = match part {
            Part::Full => material.bsdf(),
            Part::DiffuseOnly => material.diffuse_bsdf(),
        };
        let diffuse = bsdf.diffuse().into();
        let lobe = bsdf.sampling().map(|sampling| Lobe { alpha: sampling.width(), sampling, bsdf });
        Self { diffuse, lobe }
    }
}
