//! The image type.

use crate::ImageError;

/// A linear RGB image (Rec. 709 / sRGB primaries, D65 white), row 0 on top, row-major.
///
/// Values are scene-referred and unbounded: they may exceed 1 and may be negative (difference images, wide-gamut
/// renderings). Pixel (x, y) lies at index `y * width + x`.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A black image; width and height in pixels.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[0.0; 3]; width * height] }
    }

    /// An image made of given pixels, row by row from the top left.
    ///
    /// # Errors
    /// [`ImageError::PixelCount`] unless there are exactly `width * height` pixels, and at least one.
    pub fn from_pixels(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Result<Self, ImageError> {
        if pixels.is_empty() || width.checked_mul(height) != Some(pixels.len()) {
            return Err(ImageError::PixelCount { width, height, found: pixels.len() });
        }
        Ok(Self { width, height, pixels })
    }

    /// An image whose pixel at column `x`, row `y` is `colour(x, y)`.
    pub fn from_fn(width: usize, height: usize, mut colour: impl FnMut(usize, usize) -> [f32; 3]) -> Self {
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            pixels.extend((0..width).map(|x| colour(x, y)));
        }
        Self { width, height, pixels }
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row from the top left.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// All pixels, to be changed in place.
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// The pixel at column `x` and row `y`, both counted from 0 at the top left.
    ///
    /// # Panics
    /// If the position lies outside the image, like indexing a slice.
    pub fn get(&self, x: usize, y: usize) -> [f32; 3] {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) lies outside the image");
        self.pixels[y * self.width + x]
    }

    /// What becomes of each value and the other image's at the same pixel and channel.
    ///
    /// # Panics
    /// If the sizes differ, like indexing a slice.
    pub fn zipped(&self, other: &Image, combined: impl Fn(f32, f32) -> f32) -> Image {
        let sizes = [(self.width, self.height), (other.width, other.height)];
        assert_eq!(sizes[0], sizes[1], "images of one size");
        let pixel = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| combined(a[c], b[c]));
        let pixels = self.pixels.iter().zip(&other.pixels).map(pixel).collect();
        Self { pixels, ..*self }
    }

    /// Checks that two images can be compared pixel by pixel.
    ///
    /// # Errors
    /// [`ImageError::SizeMismatch`] with both sizes.
    pub fn check_same_size(&self, other: &Image) -> Result<(), ImageError> {
        self.check_size(other.width, other.height)
    }

    /// Checks the size of this image against another one's width and height.
    pub(crate) fn check_size(&self, other_width: usize, other_height: usize) -> Result<(), ImageError> {
        if (self.width, self.height) == (other_width, other_height) {
            return Ok(());
        }
        Err(ImageError::SizeMismatch { width: self.width, height: self.height, other_width, other_height })
    }

    /// The images side by side from left to right, aligned at the top; room below lower ones stays black.
    pub fn beside(images: &[&Image]) -> Image {
        let width = images.iter().map(|image| image.width).sum();
        let height = images.iter().map(|image| image.height).max().unwrap_or(0);
        let mut joined = Image::new(width, height);
        let mut left = 0;
        for image in images.iter().filter(|image| image.width > 0) {
            for (y, row) in image.pixels.chunks_exact(image.width).enumerate() {
                let start = y * width + left;
                joined.pixels[start..start + image.width].copy_from_slice(row);
            }
            left += image.width;
        }
        joined
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixel_lists_must_fill_the_image() {
        assert!(Image::from_pixels(2, 2, vec![[0.0; 3]; 4]).is_ok());
        assert!(Image::from_pixels(2, 2, vec![[0.0; 3]; 3]).is_err());
        assert!(Image::from_pixels(0, 5, vec![]).is_err());
        assert!(Image::from_pixels(usize::MAX, 2, vec![[0.0; 3]]).is_err());
    }

    #[test]
    fn beside_aligns_at_the_top_and_pads_with_black() {
        let tall = Image::from_fn(1, 2, |_, y| [y as f32 + 1.0; 3]);
        let wide = Image::from_fn(2, 1, |x, _| [x as f32 + 5.0; 3]);
        let joined = Image::beside(&[&tall, &wide]);
        let reds: Vec<f32> = joined.pixels().iter().map(|p| p[0]).collect();
        assert_eq!(reds, [1.0, 5.0, 6.0, 2.0, 0.0, 0.0]);
        assert_eq!((joined.width(), joined.height()), (3, 2));
    }

    #[test]
    fn zipped_pairs_equal_pixels_and_channels() {
        let a = Image::from_fn(2, 3, |x, y| [x as f32, y as f32, 1.0]);
        let b = Image::from_fn(2, 3, |x, y| [10.0, x as f32, y as f32]);
        let difference = a.zipped(&b, |a, b| a - b);
        assert_eq!((difference.width(), difference.height()), (2, 3));
        assert_eq!(difference.get(1, 2), [-9.0, 1.0, -1.0]);
    }

    #[test]
    #[should_panic(expected = "images of one size")]
    fn zipped_never_cuts_the_larger_image() {
        Image::new(2, 3).zipped(&Image::new(3, 2), |a, _| a);
    }

    #[test]
    fn sizes_in_the_message() {
        let error = Image::new(3, 2).check_same_size(&Image::new(2, 3)).unwrap_err();
        assert!(error.to_string().contains("3 x 2 against 2 x 3"), "{error}");
    }
}
