//! What the pixels show of the subjects, without any light.

use glam::DVec3;
use lookmatch_imaging::{Image, Mask};

use super::PathTracer;
use super::wardrobe::Spot;
use super::world::Encounter;

impl PathTracer {
    /// What the middle of each pixel shows of the subjects, row by row from the top left; `None` where it shows anything else.
    pub fn spots(&self) -> Vec<Option<Spot>> {
        let spot = |(_, at): (DVec3, Encounter)| self.world.spot(&at);
        (0..self.pixel_count()).map(|pixel| self.middle(pixel).and_then(spot)).collect()
    }

    /// Weights that fall towards the silhouettes of the subjects; 0 elsewhere.
    ///
    /// `1 − √(sin θ)` with the angle θ between the normal in the middle of the pixel and the view: on a sphere far away, that is the
    /// radial mask of [`crate::Renderer::mask`].
    pub fn mask(&self) -> Mask {
        let weight = |(view, at): (DVec3, Encounter)| match self.world.spot(&at) {
            Some(_) => 1.0 - view.cross(at.frame[2]).length().min(1.0).sqrt() as f32,
            None => 0.0,
        };
        let weights = |pixel| self.middle(pixel).map_or(0.0, weight);
        let size = self.film.size;
        Mask::from_luminance(&Image::from_fn(size, size, |x, y| [weights(y * size + x); 3]))
    }

    fn pixel_count(&self) -> usize {
        self.film.size * self.film.size
    }

    /// The direction through the middle of a pixel, and what it meets.
    fn middle(&self, pixel: usize) -> Option<(DVec3, Encounter)> {
        let (x, y) = (pixel % self.film.size, pixel / self.film.size);
        let direction = self.film.direction(x as f64 + 0.5, y as f64 + 0.5);
        Some((direction, self.world.first(self.film.eye, direction, None)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Illumination, Scene};

    fn tracer(scene: &Scene, size: usize) -> PathTracer {
        PathTracer::prepare(scene, Illumination::Point, size, 1, 1).unwrap()
    }

    #[test]
    fn the_mask_of_spheres_is_nearly_the_radial_one() {
        let scene = Scene::reference();
        let (found, radial) = (tracer(&scene, 64).mask(), scene.mask(64).unwrap());
        let off = found.weights().iter().zip(radial.weights()).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f32::max) < 0.1);
        assert!(found.weights().iter().filter(|w| **w > 0.0).count() > 500);
    }

    #[test]
    fn pixels_know_where_on_a_subject_they_look() {
        let spots = tracer(&Scene::checker_wall(), 20).spots();
        let at = |x: usize, y: usize| spots[20 * y + x].map(|spot| spot.texture);
        let [u, v] = at(14, 3).unwrap();
        assert!(u > 0.6 && u < 0.8 && v > 0.8 && v < 0.9, "{u} {v}");
        assert_eq!(at(0, 0), None);
    }
}
