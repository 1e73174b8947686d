//! How well people tell two pictures apart, as ColorVideoVDP predicts it.
//!
//! In just-objectionable differences: 10 where nothing can be seen; where two pictures are 1 JOD apart, three of four observers choose
//! the one with more. Mantiuk, Hanji, Ashraf, Asano and Chapiro, *ColorVideoVDP*, SIGGRAPH 2024; the crate `colorvideovdp` has its
//! base model 0.5.7 and agrees with the authors' program to 1e-5 JOD.
//!
//! A prediction belongs to a screen and a distance, and says nothing without them: see [`VIEWING`].

use colorvideovdp::{Color, Cvvdp, DisplayModel, Image as Frame, Options};

use crate::{Image, ImageError, srgb_encode};

/// How the pictures are looked at, in words for tables.
pub const VIEWING: &str = "30-inch 4K monitor of 200 cd/m², contrast 1000, in an office of 250 lux, from twice its height: 75 pixels \
                           per degree; radiance 1 is its white, brighter light is clipped";

/// Version of the authors' model.
pub const MODEL_VERSION: &str = Cvvdp::MODEL_VERSION;

/// The monitor of [`VIEWING`] among those of the authors.
const MONITOR: &str = "standard_4k";

/// Predicts the quality of a picture beside the one that it should look like; both are linear.
///
/// # Errors
/// Different sizes; pictures of less than 4 pixels a side, or with pixels that are not finite.
pub fn jod(source: &Image, picture: &Image) -> Result<f64, ImageError> {
    super::check_pair(source, picture, ("ColorVideoVDP", 4))?;
    let metric = Cvvdp::new(DisplayModel::from_name(MONITOR)?, Options::default())?;
    let prediction = metric.predict_image(&frame(picture)?, &frame(source)?, Color::Srgb)?;
    Ok(f64::from(prediction.jod))
}

/// As it is sent to the screen.
fn frame(image: &Image) -> Result<Frame, ImageError> {
    let values = image.pixels().as_flattened().iter().map(|v| srgb_encode(v.clamp(0.0, 1.0))).collect();
    Ok(Frame::new(image.width(), image.height(), 3, values)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_more_is_seen_more_and_what_is_clipped_is_not() {
        let ball = |gain: f32| {
            Image::from_fn(64, 64, |x, y| {
                let r = ((x as f32 - 32.0).powi(2) + (y as f32 - 32.0).powi(2)).sqrt();
                [gain * if r < 20.0 { 0.5 } else { 0.1 }, 0.2, if r < 3.0 { 5.0 * gain } else { 0.1 }]
            })
        };
        let seen = |gain: f32| jod(&ball(1.0), &ball(gain)).unwrap();
        assert!(seen(1.0) > 9.999);
        assert!(seen(1.5) < seen(1.2) && seen(1.2) < seen(1.05) && seen(1.5) < 9.9, "{}", seen(1.5));
        let [dim, bright] = [1.5, 9.0].map(|v| Image::from_fn(16, 16, |_, _| [v; 3]));
        assert!(jod(&dim, &bright).unwrap() > 9.999);
        assert!(jod(&dim, &Image::new(16, 17)).is_err());
    }
}
