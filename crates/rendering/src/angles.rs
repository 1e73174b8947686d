//! Angles of a direction for texture look-ups: polynomials, accurate to 7e-5 rad, a hundredth of a texel of a 1024 map;
//! for one number, and for sixteen at a time ([`lanes`]).

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

/// A minimax polynomial of `atan(a)/a` on [0, 1] in `a²`, 1e-5 rad at most.
const ATAN: [f32; 6] = [0.999_977_26, -0.332_623_47, 0.193_543_46, -0.116_432_87, 0.052_653_32, -0.011_721_2];
/// A polynomial of `acos(a)/√(1 − a)` on [0, 1] in `a` (Abramowitz & Stegun 1964, 4.4.45).
const ACOS: [f32; 4] = [1.570_728_8, -0.212_114_4, 0.074_261_0, -0.018_729_3];

/// The value of a polynomial, the constant term first.
fn polynomial(coefficients: &[f32], x: f32) -> f32 {
    coefficients.iter().rev().copied().reduce(|sum, c| c + x * sum).unwrap_or_default()
}

/// Where a unit direction lies on a latitude-longitude map: `u = atan2(x, −z)/2π`, `v = acos(y)/π`.
pub(crate) fn map_position(direction: DVec3) -> (f32, f32) {
    let d = direction.as_vec3();
    (turns(d.x, -d.z), half_turns(d.y))
}

/// The unit direction at a position of a latitude-longitude map.
pub(crate) fn map_direction(u: f64, v: f64) -> DVec3 {
    use std::f64::consts::{PI, TAU};
    let ((sin, cos), (sin_phi, cos_phi)) = ((PI * v).sin_cos(), (TAU * u).sin_cos());
    DVec3::new(sin * sin_phi, cos, -sin * cos_phi)
}

/// `atan2(y, x)/2π`, wrapped to `[0, 1)`; 0 where both are 0.
pub(crate) fn turns(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let large = ax.max(ay);
    if large == 0.0 {
        return 0.0;
    }
    let a = ax.min(ay) / large;
    let mut angle = a * polynomial(&ATAN, a * a);
    if ay > ax {
        angle = FRAC_PI_2 - angle;
    }
    if x < 0.0 {
        angle = PI - angle;
    }
    if y < 0.0 {
        angle = TAU - angle;
    }
    let turns = angle * (1.0 / TAU);
    if turns >= 1.0 { 0.0 } else { turns }
}

/// `acos(x)/π` for `x` in `[−1, 1]`.
pub(crate) fn half_turns(x: f32) -> f32 {
    let a = x.abs().min(1.0);
    let angle = (1.0 - a).sqrt() * polynomial(&ACOS, a);
    (if x < 0.0 { PI - angle } else { angle }) * (1.0 / PI)
}

/// The same of sixteen numbers at a time.
pub(crate) mod lanes {
    use std::f32::consts::{FRAC_PI_2, PI, TAU};

    use fearless_simd::{Simd, f32x16, prelude::*};

    use super::{ACOS, ATAN};

    /// Series of `sin(a)/a − 1`, without its factor `a²`, and of `cos a`, both in `a²`.
    const SINE: [f32; 4] = [-1.666_666_7e-1, 8.333_333e-3, -1.984_127e-4, 2.755_731_9e-6];
    const COSINE: [f32; 5] = [1.0, -0.5, 4.166_666_6e-2, -1.388_888_9e-3, 2.480_158_7e-5];

    /// The value of a polynomial, the constant term first.
    // A loop: a closure would not be compiled for the instruction set.
    #[inline(always)]
    fn polynomial<S: Simd, const N: usize>(coefficients: &[f32; N], x: f32x16<S>) -> f32x16<S> {
        let mut sum = f32x16::splat(x.token(), coefficients[N - 1]);
        for k in (0..N - 1).rev() {
            sum = x.mul_add(sum, coefficients[k]);
        }
        sum
    }

    /// Sine and cosine of angles in `[−π, π]`, to 1e-6.
    #[inline(always)]
    pub(crate) fn sin_cos<S: Simd>(angle: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        // Of a quarter of the angle, by its series; then doubled twice.
        let a = angle * 0.25;
        let s = a * a;
        let sine = (s * polynomial(&SINE, s)).mul_add(a, a);
        let cosine = polynomial(&COSINE, s);
        let double = |(s, c): (f32x16<S>, f32x16<S>)| (s * c * 2.0, (s * s).mul_add(-2.0, 1.0));
        double(double((sine, cosine)))
    }

    /// `atan2(y, x)/2π` in `[0, 1]`.
    #[inline(always)]
    pub(crate) fn turns<S: Simd>(y: f32x16<S>, x: f32x16<S>) -> f32x16<S> {
        let (ax, ay) = (x.abs(), y.abs());
        let a = ax.min(ay) / ax.max(ay).max(f32::MIN_POSITIVE);
        let angle = polynomial(&ATAN, a * a) * a;
        let angle = ay.simd_gt(ax).select(FRAC_PI_2 - angle, angle);
        let angle = x.simd_lt(0.0).select(PI - angle, angle);
        let angle = y.simd_lt(0.0).select(TAU - angle, angle);
        angle * (1.0 / TAU)
    }

    /// `acos(x)/π` for `x` in `[−1, 1]`.
    #[inline(always)]
    pub(crate) fn half_turns<S: Simd>(x: f32x16<S>) -> f32x16<S> {
        let a = x.abs().min(1.0);
        let angle = (1.0 - a).sqrt() * polynomial(&ACOS, a);
        x.simd_lt(0.0).select(PI - angle, angle) * (1.0 / PI)
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch, f32x16, prelude::*};

    use super::*;

    #[test]
    fn polynomials_follow_the_functions() {
        for i in 0..10_000 {
            let a = (i as f32 / 10_000.0 - 0.5) * TAU;
            let exact = a.sin().atan2(a.cos()).rem_euclid(TAU) / TAU;
            let error = (turns(a.sin(), a.cos()) - exact).abs();
            assert!(error.min(1.0 - error) < 1e-5, "{a}: {error}");
            let x = i as f32 / 5_000.0 - 1.0;
            assert!((half_turns(x) - x.acos() / PI).abs() < 3e-5, "{x}");
        }
        assert_eq!(turns(0.0, 0.0), 0.0);
    }

    /// [`lanes`] of sixteen times two numbers: sine and cosine of the first, turns of both, half turns of the second.
    fn in_lanes(y: [f32; 16], x: [f32; 16]) -> [[f32; 16]; 4] {
        let mut found = [[0.0; 16]; 4];
        dispatch!(Level::new(), simd => {
            let (y, x) = (f32x16::load_array(simd, y), f32x16::load_array(simd, x));
            let (sine, cosine) = lanes::sin_cos(y);
            found = [sine, cosine, lanes::turns(y, x), lanes::half_turns(x)].map(|v| v.to_array());
        });
        found
    }

    #[test]
    fn lanes_agree_with_single_numbers() {
        for block in 0..1_000 {
            let number = |l: usize, step: usize| ((16 * block + l) * step % 16_001) as f32 / 8_000.5 - 1.0;
            let y: [f32; 16] = std::array::from_fn(|l| PI * number(l, 1));
            let x: [f32; 16] = std::array::from_fn(|l| number(l, 7_919));
            let [sine, cosine, turn, half_turn] = in_lanes(y, x);
            for l in 0..16 {
                assert!((sine[l] - y[l].sin()).abs().max((cosine[l] - y[l].cos()).abs()) < 1e-6, "{}", y[l]);
                let off = (turn[l] - turns(y[l], x[l])).abs();
                assert!(off.min(1.0 - off) < 2e-7, "{} {}", y[l], x[l]);
                assert!((half_turn[l] - half_turns(x[l])).abs() < 2e-7, "{}", x[l]);
            }
        }
        let [_, _, turn, _] = in_lanes([0.0; 16], [0.0; 16]);
        assert_eq!(turn, [turns(0.0, 0.0); 16]);
    }
}
