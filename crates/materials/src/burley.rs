//! What the principled models of Burley (2012, 2015) have in common: the diffuse reflection that knows of roughness, its
//! flattened form, the tint of a colour, and the widths of the lobes.

use crate::fresnel::{mix, schlick_weight};
use crate::{Geometry, Real};

/// The diffuse reflection of Burley (2012), section 5.3, without `colour/π`: darker towards grazing angles where the surface is
/// smooth, brighter in retro-reflection where it is rough.
#[inline(always)]
pub fn diffuse<T: Real>(roughness: f64, g: &Geometry<T>) -> T {
    let retro = T::of(2.0 * roughness) * g.cos_d * g.cos_d;
    grazing(T::of(0.5) + retro, g)
}

/// The flattened diffuse reflection after Hanrahan & Krueger (1993), without `colour/π`: what Burley (2012) calls
/// subsurface and Mitsuba flatness.
#[inline(always)]
pub fn flattened<T: Real>(roughness: f64, g: &Geometry<T>) -> T {
    let retro = T::of(roughness) * g.cos_d * g.cos_d;
    let half = T::of(0.5);
    // 1.25: set by Burley so that the albedo stays about that of the diffuse reflection.
    T::of(1.25) * (grazing(retro, g) * ((g.cos_i() + g.cos_o()).recip() - half) + half)
}

/// 1 at normal incidence, `f90` at grazing angles, for light and view.
#[inline(always)]
fn grazing<T: Real>(f90: T, g: &Geometry<T>) -> T {
    let along = |cos: T| mix(T::one(), f90, schlick_weight(cos));
    along(g.cos_i()) * along(g.cos_o())
}

/// A colour's hue and saturation alone: the colour over its luminance; white for black.
pub fn tint(colour: [f64; 3], luminance_weights: [f64; 3]) -> [f64; 3] {
    let luminance: f64 = colour.iter().zip(luminance_weights).map(|(c, w)| c * w).sum();
    if luminance > 0.0 { colour.map(|c| c / luminance) } else { [1.0; 3] }
}

/// Widths of the main lobe along tangent and bitangent: `α = roughness²` and the aspect `√(1 − 0.9 anisotropic)`.
pub fn alphas(roughness: f64, anisotropic: f64) -> [f64; 2] {
    let aspect = (1.0 - 0.9 * anisotropic).sqrt();
    let alpha = roughness * roughness;
    [(alpha / aspect).max(0.001), (alpha * aspect).max(0.001)]
}

/// Width of the clear coat: 0.1 to 0.001 as its gloss goes from 0 to 1.
pub fn clearcoat_alpha(gloss: f64) -> f64 {
    mix(0.1, 0.001, gloss)
}

/// Width of the clear coat's masking, whatever its gloss.
pub const CLEARCOAT_MASKING_ALPHA: f64 = 0.25;
