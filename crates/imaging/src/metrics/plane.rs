//! A metric's value at every pixel, and what is made of it: one number, or a picture.

use super::exact_weights;
use crate::false_colour::colour;
use crate::{Image, ImageError, Mask};

/// A number for every pixel of a pair of pictures, or of their inner part where a neighbourhood fits.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    width: usize,
    height: usize,
    margin: usize,
    values: Vec<f64>,
}

impl Plane {
    /// Values row by row from the top left, of pictures that have `margin` pixels more on each side.
    pub(super) fn new(width: usize, margin: usize, values: Vec<f64>) -> Self {
        debug_assert!(width > 0 && values.len().is_multiple_of(width));
        Self { width, height: values.len() / width, margin, values }
    }

    /// Columns that have a value.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows that have a value.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Pixels along each edge of the pictures that have no value.
    pub fn margin(&self) -> usize {
        self.margin
    }

    /// All values, row by row from the top left.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Mean of the values, weighted with a mask of the pictures' size: `Σ w v / Σ w`.
    ///
    /// # Errors
    /// A mask of another size, or without weight.
    pub fn mean(&self, mask: Option<&Mask>) -> Result<f64, ImageError> {
        let Some(weights) = self.weights(mask)? else {
            return Ok(self.values.iter().sum::<f64>() / self.values.len() as f64);
        };
        let weighted: f64 = self.values.iter().zip(&weights).map(|(value, weight)| value * weight).sum();
        Ok(weighted / weights.iter().sum::<f64>())
    }

    /// The smallest value that a share of all weight does not exceed (nearest rank; 1 is the largest value). Without a mask all
    /// pixels weigh the same; pixels of weight 0 never count.
    ///
    /// # Errors
    /// As [`Plane::mean`].
    pub fn quantile(&self, share: f64, mask: Option<&Mask>) -> Result<f64, ImageError> {
        let weights = self.weights(mask)?;
        let weight = |i: usize| weights.as_ref().map_or(1.0, |weights| weights[i]);
        let mut order: Vec<usize> = (0..self.values.len()).filter(|&i| weight(i) > 0.0).collect();
        order.sort_by(|&a, &b| self.values[a].total_cmp(&self.values[b]));
        let wanted = share * order.iter().map(|&i| weight(i)).sum::<f64>();
        let mut reached = 0.0;
        let place = order.iter().position(|&i| {
            reached += weight(i);
            reached >= wanted
        });
        // Rounding may leave the last sum just below the whole.
        let place = place.unwrap_or(order.len() - 1);
        Ok(self.values[order[place]])
    }

    /// The values in false colours like those of [`crate::error_map`], black at 0 and bright yellow at `scale` and above; pixels
    /// without a value are black. A linear image of the pictures' size: written as PNG it has the map's own colours.
    ///
    /// # Errors
    /// A scale that is not finite and positive.
    pub fn false_colours(&self, scale: f64) -> Result<Image, ImageError> {
        if !(scale.is_finite() && scale > 0.0) {
            return Err(ImageError::Scale { value: scale as f32 });
        }
        let [width, height] = [self.width, self.height].map(|side| side + 2 * self.margin);
        let inside = |x: usize, side: usize| x.checked_sub(self.margin).filter(|x| *x < side);
        Ok(Image::from_fn(width, height, |x, y| match (inside(x, self.width), inside(y, self.height)) {
            (Some(x), Some(y)) => colour((self.values[y * self.width + x] / scale).clamp(0.0, 1.0)),
            _ => colour(0.0),
        }))
    }

    /// Weights of the pixels that have a value.
    fn weights(&self, mask: Option<&Mask>) -> Result<Option<Vec<f64>>, ImageError> {
        let [width, height] = [self.width, self.height].map(|side| side + 2 * self.margin);
        let Some(all) = exact_weights(mask, &Image::new(width, height))? else { return Ok(None) };
        let rows = all.chunks_exact(width).skip(self.margin).take(self.height);
        let weights: Vec<f64> = rows.flat_map(|row| &row[self.margin..][..self.width]).copied().collect();
        if weights.iter().all(|weight| *weight <= 0.0) {
            return Err(ImageError::EmptyMask);
        }
        Ok(Some(weights))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0 to 99 on 10 × 10 pixels.
    fn ramp() -> Plane {
        Plane::new(10, 0, (0..100).map(f64::from).collect())
    }

    #[test]
    fn a_uniform_mask_is_no_mask() {
        let uniform = Mask::uniform(10, 10);
        for mask in [None, Some(&uniform)] {
            assert_eq!(ramp().mean(mask).unwrap(), 49.5);
            assert_eq!(ramp().quantile(0.95, mask).unwrap(), 94.0);
            assert_eq!(ramp().quantile(1.0, mask).unwrap(), 99.0);
        }
    }

    #[test]
    fn only_what_is_masked_in_counts() {
        let one = Mask::disc(10, 10, 3.5, 2.5, 0.5);
        assert_eq!(ramp().mean(Some(&one)).unwrap(), 23.0);
        assert_eq!(ramp().quantile(1.0, Some(&one)).unwrap(), 23.0);
        // Weights 1 in the middle, 1 - sqrt(1 / 1.4) = 0.15 above, below, left and right of it.
        let few = Mask::disc(10, 10, 3.5, 2.5, 1.4);
        let mean = ramp().mean(Some(&few)).unwrap();
        assert!((mean - 23.0).abs() < 1e-9, "{mean}");
        assert_eq!(ramp().quantile(1.0, Some(&few)).unwrap(), 33.0);
        assert_eq!(ramp().quantile(0.5, Some(&few)).unwrap(), 23.0);
    }

    #[test]
    fn a_margin_has_no_value_and_no_weight() {
        let inner = Plane::new(2, 1, vec![1.0, 2.0, 3.0, 4.0]);
        assert_eq!(inner.mean(Some(&Mask::uniform(4, 4))).unwrap(), 2.5);
        assert!(matches!(inner.mean(Some(&Mask::disc(4, 4, 0.5, 0.5, 0.4))), Err(ImageError::EmptyMask)));
        assert!(inner.mean(Some(&Mask::uniform(2, 2))).is_err(), "a mask has the pictures' size");
        let picture = inner.false_colours(4.0).unwrap();
        assert_eq!((picture.width(), picture.height()), (4, 4));
        assert_eq!(picture.get(0, 0), colour(0.0));
        assert_eq!(picture.get(2, 2), colour(1.0));
        assert!(inner.false_colours(0.0).is_err());
    }
}
