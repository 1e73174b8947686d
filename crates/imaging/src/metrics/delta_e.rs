//! Colour differences of pixels, ΔE*76 and CIEDE2000.
//!
//! CIE 15:2004, section 8.2.1.3; Sharma, Wu and Dalal, "The CIEDE2000 color-difference formula", Color Research and Application
//! 2005, with k_L = k_C = k_H = 1. Colours are CIELAB of linear light beside a white of 1, never clipped: highlights have L* above 100,
//! where neither formula was ever tested on people. Pixels are compared one by one; neighbours and viewing distance do not matter.

use palette::Lab;
use palette::color_difference::Ciede2000;
use palette::white_point::D65;

use super::{Plane, check_pair};
use crate::colour::{delta_e76, lab_from_linear_srgb};
use crate::{Image, ImageError};

/// What both formulas take for granted, in words for tables.
pub const VIEWING: &str =
    "pixel by pixel, CIELAB of linear light under D65; radiance 1 is white, brighter light is not clipped";

/// CIEDE2000 of two CIELAB colours: 0 = equal; about 1 is just noticeable.
pub fn delta_e2000(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [a, b] = [a, b].map(|[l, a, b]| Lab::<D65, f64>::new(l, a, b));
    a.difference(b)
}

/// ΔE*76 of every pixel of two linear images.
///
/// # Errors
/// Different sizes, no pixels, pixels that are not finite.
pub fn delta_e76_map(source: &Image, target: &Image) -> Result<Plane, ImageError> {
    map(source, target, delta_e76)
}

/// CIEDE2000 of every pixel of two linear images.
///
/// # Errors
/// As [`delta_e76_map`].
pub fn delta_e2000_map(source: &Image, target: &Image) -> Result<Plane, ImageError> {
    map(source, target, delta_e2000)
}

fn map(source: &Image, target: &Image, formula: fn([f64; 3], [f64; 3]) -> f64) -> Result<Plane, ImageError> {
    check_pair(source, target, ("a colour difference", 1))?;
    let lab = |pixel: &[f32; 3]| lab_from_linear_srgb(pixel.map(f64::from));
    // Equal pixels are common (backgrounds), and cost nothing this way.
    let difference = |(a, b): (&[f32; 3], &[f32; 3])| if a == b { 0.0 } else { formula(lab(a), lab(b)) };
    let values = source.pixels().iter().zip(target.pixels()).map(difference).collect();
    Ok(Plane::new(source.width(), 0, values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_hold_the_formulas_and_are_symmetric() {
        let a = Image::from_fn(7, 3, |x, y| [0.1 * x as f32, 0.3, 2.0 * y as f32]);
        let b = Image::from_fn(7, 3, |x, y| [0.1 * x as f32 + 0.02, 0.3, 2.1 * y as f32]);
        for (map, formula) in [
            (delta_e76_map as fn(&Image, &Image) -> _, delta_e76 as fn(_, _) -> f64),
            (delta_e2000_map, delta_e2000),
        ] {
            let plane = map(&a, &b).unwrap();
            assert_eq!((plane.width(), plane.height(), plane.margin()), (7, 3, 0));
            let lab = |image: &Image| lab_from_linear_srgb(image.get(4, 2).map(f64::from));
            assert_eq!(plane.values()[2 * 7 + 4], formula(lab(&a), lab(&b)));
            let back = map(&b, &a).unwrap();
            for (there, back) in plane.values().iter().zip(back.values()) {
                assert!((there - back).abs() < 1e-9 && *there > 0.0);
            }
            assert_eq!(map(&a, &a).unwrap().mean(None).unwrap(), 0.0);
        }
    }

    #[test]
    fn highlights_are_not_clipped() {
        let [dim, bright] = [4.0, 8.0].map(|v| Image::from_fn(2, 2, |_, _| [v; 3]));
        assert!(delta_e76_map(&dim, &bright).unwrap().mean(None).unwrap() > 40.0);
        assert!(delta_e2000_map(&dim, &bright).unwrap().mean(None).unwrap() > 5.0);
    }

    #[test]
    fn faults_are_named() {
        let image = Image::new(3, 2);
        assert!(delta_e76_map(&image, &Image::new(2, 3)).is_err());
        let nan = Image::from_fn(3, 2, |x, y| if (x, y) == (2, 1) { [0.0, f32::NAN, 0.0] } else { [0.0; 3] });
        let error = delta_e2000_map(&image, &nan).unwrap_err().to_string();
        assert!(
            error.contains("NaN") && error.contains("channel G") && error.contains("x = 2, y = 1"),
            "{error}"
        );
        assert!(delta_e76_map(&Image::new(0, 0), &Image::new(0, 0)).is_err());
    }
}
