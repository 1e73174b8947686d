//! Angles of a direction for texture look-ups: polynomials, accurate to 7e-5 rad, a hundredth of a texel of a 1024 map.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

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
    let s = a * a;
    // A minimax polynomial of atan on [0, 1], 1e-5 rad at most.
    let series = 0.193_543_46 + s * (-0.116_432_87 + s * (0.052_653_32 - s * 0.011_721_2));
    let mut angle = a * (0.999_977_26 + s * (-0.332_623_47 + s * series));
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

/// `acos(x)/π` for `x` in `[−1, 1]` (Abramowitz & Stegun 1964, 4.4.45).
pub(crate) fn half_turns(x: f32) -> f32 {
    let a = x.abs().min(1.0);
    let angle = (1.0 - a).sqrt() * (1.570_728_8 + a * (-0.212_114_4 + a * (0.074_261_0 - a * 0.018_729_3)));
    (if x < 0.0 { PI - angle } else { angle }) * (1.0 / PI)
}

#[cfg(test)]
mod tests {
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
}
