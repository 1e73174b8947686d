//! Per-pixel weights that favour the middle of a sphere over its silhouette.

use crate::{Image, ImageError, luminance};

/// Weight of every pixel of an image, 0 to 1, row 0 on top, row-major.
///
/// Fresnel effects that one material model knows and another does not show at grazing angles, so the silhouette
/// of a sphere would dominate the fitness; the mask plays it down (Guarnera et al. 2018, section 3.2).
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    width: usize,
    height: usize,
    weights: Vec<f32>,
}

/// Weight of the point (`x`, `y`): `1 - sqrt(|p - C| / r)` within the disc, 0 outside. All lengths in pixels.
///
/// Guarnera, Guarnera, Toscani, Glencross, Li, Hardeberg and Gegenfurtner 2018, section 3.2 (not numbered there). A radius that is not positive gives 0
/// everywhere.
pub fn disc_weight(x: f64, y: f64, centre_x: f64, centre_y: f64, radius: f64) -> f64 {
    let distance = (x - centre_x).hypot(y - centre_y);
    if distance < radius { 1.0 - (distance / radius).sqrt() } else { 0.0 }
}

impl Mask {
    /// [`disc_weight`] at the middle of every pixel: the pixel in column x and row y is the point
    /// (x + 0.5, y + 0.5). Centre and radius in pixels.
    pub fn disc(width: usize, height: usize, cx: f64, cy: f64, r: f64) -> Mask {
        let weight = |x: usize, y: usize| disc_weight(x as f64 + 0.5, y as f64 + 0.5, cx, cy, r) as f32;
        let rows = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Mask { width, height, weights: rows.map(|(x, y)| weight(x, y)).collect() }
    }

    /// The luminance of a picture's pixels, clipped to 0..1: white counts in full, black not at all.
    pub fn from_luminance(image: &Image) -> Mask {
        let weights = image.pixels().iter().map(|pixel| luminance(*pixel).clamp(0.0, 1.0)).collect();
        Mask { width: image.width(), height: image.height(), weights }
    }

    /// Weight 1 everywhere: the same as no mask.
    pub fn uniform(width: usize, height: usize) -> Mask {
        Mask { width, height, weights: vec![1.0; width * height] }
    }

    /// The larger weight of two masks at every pixel: a mask for several spheres.
    ///
    /// # Errors
    /// [`ImageError::SizeMismatch`] if the sizes differ.
    pub fn union(&self, other: &Mask) -> Result<Mask, ImageError> {
        if (self.width, self.height) != (other.width, other.height) {
            return Err(ImageError::SizeMismatch {
                width: self.width,
                height: self.height,
                other_width: other.width,
                other_height: other.height,
            });
        }
        let weights = self.weights.iter().zip(&other.weights).map(|(a, b)| a.max(*b)).collect();
        Ok(Mask { weights, ..*self })
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All weights, row by row from the top left.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn union_takes_the_larger_weight() {
        let left = Mask::disc(4, 2, 1.0, 1.0, 1.5);
        let right = Mask::disc(4, 2, 3.0, 1.0, 1.5);
        let both = left.union(&right).unwrap();
        for i in 0..8 {
            assert_eq!(both.weights()[i], left.weights()[i].max(right.weights()[i]));
        }
        assert!(left.union(&Mask::uniform(2, 4)).is_err());
        assert_eq!(left.union(&Mask::uniform(4, 2)).unwrap(), Mask::uniform(4, 2));
    }

    #[test]
    fn pictures_are_masks() {
        let picture = Image::from_fn(2, 2, |x, y| [x as f32 + 0.5 * y as f32 - 0.25; 3]);
        let mask = Mask::from_luminance(&picture);
        for (found, expected) in mask.weights().iter().zip([0.0, 0.75, 0.25, 1.0]) {
            assert!((found - expected).abs() < 1e-6);
        }
    }

    #[test]
    fn a_disc_without_radius_is_empty() {
        for radius in [0.0, -1.0, f64::NAN] {
            assert!(Mask::disc(3, 3, 1.5, 1.5, radius).weights().iter().all(|&w| w == 0.0));
        }
    }
}
