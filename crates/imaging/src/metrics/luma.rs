//! Grey values as a screen shows them, for metrics that were made for 8-bit pictures.

use crate::Image;

/// Largest grey value.
pub(super) const WHITE: f64 = 255.0;

/// How such metrics see a picture, in words for tables.
macro_rules! viewing {
    ($needs:literal) => {
        concat!(
            "as on a screen: radiance 1 is white, brighter light is clipped; sRGB grey values 0 to 255, ",
            $needs
        )
    };
}
pub(super) use viewing;

/// Grey value 0 to 255 of a linear colour, not rounded: clipped to 0..1, sRGB transfer function, then the weights of Rec. 601
/// as MATLAB's `rgb2gray` has them: 0.2989, 0.5870 and 0.1140 with all digits, which sum to 1.
pub fn luma_255(rgb: [f64; 3]) -> f64 {
    let [r, g, b] = rgb.map(|v| encode(v.clamp(0.0, 1.0)));
    WHITE * (0.298936021293775 * r + 0.587043074451121 * g + 0.114020904255103 * b)
}

/// [`crate::srgb_encode`] in `f64`.
fn encode(x: f64) -> f64 {
    if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// [`luma_255`] of every pixel.
pub(super) fn luma(image: &Image) -> Vec<f64> {
    image.pixels().iter().map(|pixel| luma_255(pixel.map(f64::from))).collect()
}
