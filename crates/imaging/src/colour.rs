//! Exact colour conversion in `f64`.
//!
//! Nothing is clamped: HDR values give L* far above 100 and negative ones take the linear branch. (Colour
//! libraries made for displays clip here, which would make every highlight look the same.)

/// Linear sRGB to CIE XYZ with D65 white: the primaries of IEC 61966-2-1, rounded to 7 digits
/// (Lindbloom, "RGB/XYZ Matrices").
pub(crate) const XYZ_FROM_SRGB: [[f64; 3]; 3] =
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]];

/// CIE 15: below this ratio to white, CIELAB replaces the cube root by a straight line. (6/29)³.
pub(crate) const LINEAR_LIMIT: f64 = 216.0 / 24389.0;
/// Slope of that line, (29/6)²/3.
pub(crate) const LINEAR_SLOPE: f64 = 841.0 / 108.0;
/// Its value at 0, 4/29.
pub(crate) const LINEAR_OFFSET: f64 = 4.0 / 29.0;

/// CIELAB of a linear sRGB colour: L* (0 black, 100 white, more for HDR), a* (green to red), b* (blue to yellow).
///
/// Any finite input is accepted. The white point is the sum of each row of the matrix, so (1, 1, 1) gives
/// (100, 0, 0) exactly but for rounding. CIE 15:2004, equations 8.3 to 8.11.
pub fn lab_from_linear_srgb(rgb: [f64; 3]) -> [f64; 3] {
    let [fx, fy, fz] = XYZ_FROM_SRGB.map(|row| {
        let value = row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2];
        compress(value / (row[0] + row[1] + row[2]))
    });
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// CIELAB's f(t), t being relative to white.
fn compress(t: f64) -> f64 {
    if t > LINEAR_LIMIT { t.cbrt() } else { LINEAR_SLOPE * t + LINEAR_OFFSET }
}

/// ΔE*76, the Euclidean distance of two CIELAB colours (CIE 1976). 0 = equal; about 2.3 is just noticeable.
pub fn delta_e76(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// Relative luminance Y of a linear sRGB colour; (1, 1, 1) gives 1.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    let [r, g, b] = XYZ_FROM_SRGB[1];
    (r * f64::from(rgb[0]) + g * f64::from(rgb[1]) + b * f64::from(rgb[2])) as f32
}

/// The sRGB transfer function (IEC 61966-2-1): linear light to signal, 0 to 0 and 1 to 1.
///
/// Values outside 0..1 continue the curve (negative ones the straight part); clip them for display.
pub fn srgb_encode(x: f32) -> f32 {
    if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`srgb_encode`]: signal to linear light.
pub fn srgb_decode(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palette::white_point::D65;
    use palette::{Lab, LinSrgb, convert::FromColorUnclamped};

    /// palette's own matrix has other last digits: they agree to a few parts in 10⁴ of a Lab unit at L* = 100.
    #[test]
    fn agrees_with_palette_also_outside_the_display_range() {
        for scale in [0.001, 0.02, 0.5, 1.0, 40.0, 5000.0] {
            for rgb in [[1.0, 1.0, 1.0], [1.0, 0.3, 0.1], [0.0, 0.9, 0.2], [0.1, 0.0, 1.0]] {
                let rgb = rgb.map(|v: f64| v * scale);
                let oracle: Lab<D65, f64> = Lab::from_color_unclamped(LinSrgb::new(rgb[0], rgb[1], rgb[2]));
                let ours = lab_from_linear_srgb(rgb);
                let difference = delta_e76(ours, [oracle.l, oracle.a, oracle.b]);
                assert!(difference < 5e-4 * ours[0].max(1.0), "{rgb:?}: {ours:?}, {oracle:?}");
            }
        }
    }

    #[test]
    fn white_is_100_and_grey_5_is_not_clipped() {
        assert!(delta_e76(lab_from_linear_srgb([1.0; 3]), [100.0, 0.0, 0.0]) < 1e-12);
        assert!((lab_from_linear_srgb([5.0; 3])[0] - 182.357).abs() < 1e-3);
    }

    #[test]
    fn the_two_branches_meet() {
        assert!((compress(LINEAR_LIMIT) - compress(LINEAR_LIMIT * (1.0 + 1e-12))).abs() < 1e-9);
    }

    #[test]
    fn transfer_function_inverts() {
        for i in 0..=1000 {
            let x = i as f32 / 1000.0;
            assert!((srgb_decode(srgb_encode(x)) - x).abs() < 2e-6, "{x}");
        }
        assert_eq!(srgb_encode(0.0), 0.0);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-6);
        assert!((luminance([1.0; 3]) - 1.0).abs() < 1e-6);
    }
}
