//! Pictures of spheres that wear different materials.
//!
//! What is prepared knows one material for all spheres, so a picture is put together from theirs: each pixel of a sphere is that of
//! the picture in which all wear its material, and a point of the checkerboard gets the irradiance that each
//! material adds to it, mixed by how much of the point's sky the spheres fill. Both are exact for one sphere and for equal
//! materials, and otherwise leave out that a sphere's own colour fades with the distance from it in another way.

use glam::DVec3;
use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use rayon::prelude::*;

use super::{Part, Renderer};
use crate::bounce::{MODES, Weights};
use crate::transport::Planes;

impl Renderer {
    /// A picture in which each sphere wears a material of its own, in the order of the scene; linear RGB, row 0 on top.
    ///
    /// What one material throws onto the checkerboard is told from that of the others by the place alone, approximately
    /// (`docs/engine.md`). Spheres with a diffuse colour of their own keep it.
    ///
    /// # Panics
    /// Where there is not one material for each sphere.
    pub fn render_dressed(&self, materials: &[&Material], part: Part) -> Image {
        self.render_dressed_batch(materials, &[(0..materials.len()).collect()], part).swap_remove(0)
    }

    /// Several such pictures: `wears` has, for each of them, the number of each sphere's material. The prepared light is
    /// read once for every material, however many pictures it is in.
    ///
    /// # Panics
    /// Where a picture has not one number for each sphere, or names a material that is not there.
    pub fn render_dressed_batch(
        &self,
        materials: &[&Material],
        wears: &[Vec<usize>],
        part: Part,
    ) -> Vec<Image> {
        let (count, spheres) = (materials.len(), self.bodies.spheres().len());
        for numbers in wears {
            assert_eq!(numbers.len(), spheres, "a picture takes one material for each sphere");
            assert!(numbers.iter().all(|n| *n < count), "{numbers:?}: there are {count} materials (from 0)");
        }
        let worn_by_all = self.worn_by_all(materials, part);
        let (subjects, board) = (self.subject_shares(), self.board_shares());
        let picture = |numbers: &Vec<usize>| {
            let of_spheres: Vec<&(Planes, Weights)> = numbers.iter().map(|n| &worn_by_all[*n]).collect();
            let planes = std::array::from_fn(|c| {
                let mixed = |(k, shares): (usize, &Vec<f32>)| -> f32 {
                    shares.iter().zip(&of_spheres).map(|(share, (planes, _))| share * planes[c][k]).sum()
                };
                subjects.iter().enumerate().map(mixed).collect()
            });
            let weights = |k: usize| -> Weights {
                let sum = |m: usize, c: usize| -> f32 {
                    board[k].iter().zip(&of_spheres).map(|(share, (_, weights))| share * weights[m][c]).sum()
                };
                std::array::from_fn(|m| std::array::from_fn(|c| sum(m, c)))
            };
            self.developed(&planes, weights)
        };
        wears.par_iter().map(picture).collect()
    }

    /// For each subject pixel, the share of each sphere in what it shows of them.
    fn subject_shares(&self) -> Vec<Vec<f32>> {
        let shares = |pixel: &u32| {
            let mut shares = vec![0.0; self.bodies.spheres().len()];
            let (points, _) = self.film.points(&self.bodies, *pixel as usize);
            points.iter().for_each(|point| shares[point.sphere] += 1.0 / points.len() as f32);
            shares
        };
        self.subjects.par_iter().map(shares).collect()
    }

    /// For each pixel that sees the checkerboard, the share of each sphere in what light gets there from spheres that are
    /// equally bright.
    fn board_shares(&self) -> Vec<Vec<f32>> {
        let height = self.bodies.plane().map_or(0.0, |(height, _)| height);
        let shares = |(pixel, _): &(u32, [f32; MODES])| {
            let (x, y) = (*pixel as usize % self.film.size, *pixel as usize / self.film.size);
            let direction = self.film.direction(x as f64 + 0.5, y as f64 + 0.5);
            let along = (height - self.film.eye.y) / direction.y;
            // Some pixels see the board's edge with a corner alone: their middle may lie above the horizon.
            let along = if along.is_finite() && along > 0.0 { along } else { 0.0 };
            let point = self.film.eye + direction * along;
            let seen: Vec<f64> = self.bodies.spheres().iter().map(|s| form_factor(*s, point)).collect();
            let whole: f64 = seen.iter().sum();
            seen.iter().map(|share| (share / whole) as f32).collect()
        };
        self.board.par_iter().map(shares).collect()
    }
}

/// Of a sphere, seen from a point of a horizontal plane below its middle; up to a factor.
fn form_factor((centre, radius): (DVec3, f64), point: DVec3) -> f64 {
    let to_centre = centre - point;
    let distance = to_centre.length().max(radius);
    // Never 0, so that there are shares wherever there are spheres.
    (to_centre.y / distance).max(1e-3) * (radius / distance).powi(2)
}
