//! What models of measured materials share: Rusinkiewicz's coordinates, a stand-in for the diffuse reflection, and how to draw
//! directions from what has no formula.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use crate::colour::mean;
use crate::distribution::{Distribution, Shape};
use crate::{Geometry, Real, Sampling, Technique};

/// A BRDF per channel, in double precision.
pub(super) type Measurement<'a> = &'a dyn Fn(&Geometry<f64>) -> [f64; 3];

/// The light's direction in the frame of the half vector: Rusinkiewicz's difference vector
/// `(sin θ_d cos φ_d, sin θ_d sin φ_d, cos θ_d)` (1998, 3.1).
#[inline(always)]
pub(super) fn difference<T: Real>(g: &Geometry<T>) -> [T; 3] {
    let [wx, wy, wz] = g.wi;
    let tan2 = g.tan2_h[0] + g.tan2_h[1];
    // The half vector has no azimuth at the pole: the light's own is one that turns with the surface.
    if tan2 <= T::zero() {
        return [(wx * wx + wy * wy).sqrt(), T::zero(), wz];
    }
    // Signs from the directions, sizes from tan²θ_h, which keeps its digits where wi + wo cancels.
    let along = |tan2_axis: T, sum: T| (tan2_axis / tan2).sqrt().copysign(sum);
    let (cos_phi, sin_phi) = (along(g.tan2_h[0], wx + g.wo[0]), along(g.tan2_h[1], wy + g.wo[1]));
    let sin_h = tan2.sqrt() * g.cos_h;
    let x = g.cos_h * (cos_phi * wx + sin_phi * wy) - sin_h * wz;
    [x, cos_phi * wy - sin_phi * wx, g.cos_d]
}

fn direction(cos: f64, phi: f64) -> [f64; 3] {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    [sin * phi.cos(), sin * phi.sin(), cos]
}

/// The albedo of the brightest Lambert term that stays below a measurement: π times its least value over all pairs of
/// directions within 60° of the normal, on a lattice of 5° and, in azimuth, 15°.
pub(super) fn lambert_below(measured: Measurement) -> [f64; 3] {
    let mut least = [f64::INFINITY; 3];
    let angles = || (0..=12).map(|k| f64::from(5 * k).to_radians().cos());
    for (cos_i, cos_o) in angles().flat_map(|i| angles().map(move |o| (i, o))) {
        for step in 0..24 {
            let wi = direction(cos_i, f64::from(15 * step).to_radians());
            let f = Geometry::new(wi, direction(cos_o, 0.0)).map_or([0.0; 3], |g| measured(&g));
            least = std::array::from_fn(|c| least[c].min(f[c]));
        }
    }
    least.map(|f| (PI * f).clamp(0.0, 1.0))
}

/// A cosine and GGX lobes about as wide as the highlight of a measurement, in shares of the light that a Lambert term of albedo
/// `lambert` and the rest reflect.
pub(super) fn sampling(measured: Measurement, lambert: [f64; 3]) -> Option<Sampling> {
    let all = albedo(&|g| mean(measured(g)), 0.8);
    // The floor: what is wide is never left to the tails of narrow lobes.
    let diffuse = (mean(lambert) / all.max(f64::MIN_POSITIVE)).clamp(0.2, 1.0);
    // Measured highlights have a narrow core and wide skirts: one lobe for each.
    let [core, skirt] = tangents(&|g| mean(measured(g)), [0.25, 0.75]).map(|tan| {
        Technique::HalfVector(Distribution { shape: Shape::Ggx, alpha: [tan.clamp(NARROWEST, 1.0); 2] })
    });
    let share = 0.5 * (1.0 - diffuse);
    Sampling::mixture([(diffuse, Technique::Cosine), (share, core), (share, skirt)])
}

/// The least α that directions are drawn with, a ninth of a degree.
const NARROWEST: f64 = 0.002;

/// The tangents of the angles θ_h within which given shares of a highlight's normals lie, seen from where the light comes from:
/// there `D ∝ f cos²θ`. GGX has the share tan²θ/(α² + tan²θ). What the reflection is at 45° is taken for diffuse.
fn tangents(f: &dyn Fn(&Geometry<f64>) -> f64, shares: [f64; 2]) -> [f64; 2] {
    const NODES: usize = 256;
    let back = |theta: f64| {
        let w = [theta.sin(), 0.0, theta.cos()];
        Geometry::new(w, w).map_or(0.0, |g| f(&g))
    };
    // θ_h = π/4 t³ puts the nodes where narrow lobes are.
    let theta = |k: usize| FRAC_PI_4 * ((k as f64 + 0.5) / NODES as f64).powi(3);
    let diffuse = back(FRAC_PI_4);
    let mut sum = 0.0;
    let sums: [f64; NODES] = std::array::from_fn(|k| {
        let (sin, cos) = theta(k).sin_cos();
        sum += (back(theta(k)) - diffuse).max(0.0) * cos.powi(3) * sin * (k as f64 + 0.5).powi(2);
        sum
    });
    // Without any highlight the widest lobe is as good as any.
    let angle = |share: f64| theta(sums.partition_point(|s| *s <= share * sum).min(NODES - 1));
    shares.map(|share| angle(share).tan())
}

/// Directional albedo by quadrature over the half vector.
fn albedo(f: &dyn Fn(&Geometry<f64>) -> f64, cos_o: f64) -> f64 {
    let (rows, columns) = (64, 16);
    let wo = direction(cos_o, 0.0);
    let mut sum = 0.0;
    for row in 0..rows {
        // θ_h = π/2 t³ puts the nodes where narrow lobes are.
        let t = (row as f64 + 0.5) / rows as f64;
        let (theta, jacobian) = (FRAC_PI_2 * t.powi(3), FRAC_PI_2 * 3.0 * t * t / rows as f64);
        for column in 0..columns {
            let h = direction(theta.cos(), TAU * (column as f64 + 0.5) / columns as f64);
            let cos_d: f64 = (0..3).map(|k| wo[k] * h[k]).sum();
            let wi = std::array::from_fn(|k| 2.0 * cos_d * h[k] - wo[k]);
            let Some(g) = Geometry::new(wi, wo).filter(|_| cos_d > 0.0) else { continue };
            sum += f(&g) * 4.0 * cos_d * g.cos_i() * theta.sin() * jacobian * TAU / columns as f64;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;
    use crate::fresnel::Fresnel;
    use crate::masking::Masking;
    use crate::microfacet::Microfacet;

    fn plastic(alpha: f64) -> Microfacet {
        Microfacet {
            diffuse: [0.0; 3],
            specular: [1.0; 3],
            distribution: Distribution { shape: Shape::Ggx, alpha: [alpha; 2] },
            masking: Masking::One,
            fresnel: [Fresnel::Schlick { f0: 0.04 }; 3],
        }
    }

    #[test]
    fn width_of_a_known_lobe_is_found() {
        for alpha in [0.01, 0.05, 0.1] {
            let lobe = plastic(alpha);
            let [tan, _] = tangents(&|g| Lobe::specular(&lobe, g)[0], [0.5, 0.75]);
            assert!((tan / alpha - 1.0).abs() < 0.1, "{alpha}: {tan}");
        }
    }

    #[test]
    fn lambert_term_below_a_plastic_is_about_its_own() {
        let lobe = plastic(0.1);
        let albedo = lambert_below(&|g| Lobe::specular(&lobe, g).map(|f| f + 0.3 / PI));
        assert!(albedo.iter().all(|a| (0.3..0.305).contains(a)), "{albedo:?}");
    }

    #[test]
    fn difference_vector_is_the_light_in_the_frame_of_the_half_vector() {
        let (wi, wo) = (direction(0.4, 2.0), direction(0.7, 0.3));
        let d = difference(&Geometry::new(wi, wo).unwrap());
        let swapped = difference(&Geometry::new(wo, wi).unwrap());
        assert!((d.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((0..2).all(|k| (d[k] + swapped[k]).abs() < 1e-12) && (d[2] - swapped[2]).abs() < 1e-12);
        // In the plane of incidence the half vector leans by 10° where light and viewer are at 50° and −30°.
        let tilt = |degrees: f64| [degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()];
        let [x, y, _] = difference(&Geometry::new(tilt(50.0), tilt(-30.0)).unwrap());
        assert!((x - 40f64.to_radians().sin()).abs() < 1e-12 && y.abs() < 1e-12);
    }
}
