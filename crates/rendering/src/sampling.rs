//! Deterministic sample points.

use std::f64::consts::TAU;

use glam::DVec3;

/// Point `i` of a (0, 2)-sequence in the unit square: any 2^k consecutive points from a multiple of 2^k are stratified
/// (van der Corput and Sobol', Kollig & Keller 2002).
pub(crate) fn zero_two(i: u32) -> [f64; 2] {
    let mut sobol = 0u32;
    let (mut bits, mut direction) = (i, 1u32 << 31);
    while bits != 0 {
        if bits & 1 != 0 {
            sobol ^= direction;
        }
        bits >>= 1;
        direction ^= direction >> 1;
    }
    let unit = |v: u32| (f64::from(v) + 0.5) / 4_294_967_296.0;
    [unit(i.reverse_bits()), unit(sobol)]
}

/// Two vectors that complete a unit normal to a right-handed frame (Duff *et al.* 2017).
pub(crate) fn frame(n: DVec3) -> (DVec3, DVec3) {
    n.any_orthonormal_pair()
}

/// Direction `i` of `n`, distributed with density `cos θ/π` about a unit normal.
pub(crate) fn cosine_direction(i: u32, normal: DVec3) -> DVec3 {
    let [u, v] = zero_two(i);
    let (t, b) = frame(normal);
    let (sin, cos) = (u.sqrt(), (1.0 - u).sqrt());
    let (sin_phi, cos_phi) = (TAU * v).sin_cos();
    t * (sin * cos_phi) + b * (sin * sin_phi) + normal * cos
}
