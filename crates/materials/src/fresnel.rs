//! Fresnel reflectance, exact for dielectrics and conductors.

use crate::Real;

/// How a lobe's reflectance depends on the angle to the half vector, for one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fresnel {
    /// No Fresnel effect: 1 at every angle.
    None,
    /// Schlick's approximation (1994): `f0 + (1 − f0)(1 − cos)⁵`.
    Schlick {
        /// Reflectance at normal incidence, 0 to 1.
        f0: f64,
    },
    /// Exact unpolarised reflectance of a dielectric; 1 under total internal reflection.
    Dielectric {
        /// Index of refraction inside over outside, above 0.
        eta: f64,
    },
    /// Exact unpolarised reflectance of a conductor with complex index `eta + i k` relative to the outside.
    Conductor {
        /// Real part of the index.
        eta: f64,
        /// Imaginary part (extinction coefficient), 0 or more.
        k: f64,
    },
}

impl Fresnel {
    /// Reflectance at an angle whose cosine (0 to 1) is `cos`.
    #[inline(always)]
    pub fn reflectance<T: Real>(&self, cos: T) -> T {
        match *self {
            Self::None => T::one(),
            Self::Schlick { f0 } => mix(T::of(f0), T::one(), schlick_weight(cos)),
            Self::Dielectric { eta } => dielectric(cos, T::of(eta)),
            Self::Conductor { eta, k } => conductor(cos, T::of(eta), T::of(k)),
        }
    }
}

/// Weight of the reflectance at grazing angles in Schlick's approximation (1994): `(1 − cos)⁵`.
#[inline(always)]
pub fn schlick_weight<T: Real>(cos: T) -> T {
    // A cosine may round to just above 1.
    (T::one() - cos).max(T::zero()).powi(5)
}

/// `(1 − t) a + t b`: what lies between two reflectances, or two materials.
#[inline(always)]
pub fn mix<T: Real>(a: T, b: T, t: T) -> T {
    a + (b - a) * t
}

/// Fresnel's equations for a dielectric interface, unpolarised.
#[inline(always)]
fn dielectric<T: Real>(cos_i: T, eta: T) -> T {
    let sin2_t = (T::one() - cos_i * cos_i) / (eta * eta);
    if sin2_t >= T::one() {
        return T::one();
    }
    let cos_t = (T::one() - sin2_t).sqrt();
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    T::of(0.5) * (parallel * parallel + perpendicular * perpendicular)
}

/// Fresnel's equations with a complex index, unpolarised, written in reals.
///
/// `a² + b²` and `a` are the modulus and real part of `√(N² − sin²)`; see Born & Wolf, *Principles of Optics*, 14.2.
#[inline(always)]
fn conductor<T: Real>(cos: T, eta: T, k: T) -> T {
    let (two, cos2) = (T::of(2.0), cos * cos);
    let sin2 = T::one() - cos2;
    let real = eta * eta - k * k - sin2;
    let modulus = (real * real + T::of(4.0) * eta * eta * k * k).sqrt();
    // The subtraction cancels for weakly absorbing media; the clamp keeps the root real.
    let a = (T::of(0.5) * (modulus + real)).max(T::zero()).sqrt();
    let perpendicular = (modulus + cos2 - two * a * cos) / (modulus + cos2 + two * a * cos);
    let (u, v) = (cos2 * modulus + sin2 * sin2, two * a * cos * sin2);
    let parallel = perpendicular * (u - v) / (u + v);
    // Where nothing reflects (index 1), rounding may leave either a little below 0.
    (T::of(0.5) * (perpendicular + parallel)).max(T::zero())
}

/// Normal-incidence reflectance of a dielectric of relative index `ior` (above 0).
pub fn f0_from_ior(ior: f64) -> f64 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

/// The relative index (1 or more) whose normal-incidence reflectance is `f0`, in `[0, 1)`.
pub fn ior_from_f0(f0: f64) -> f64 {
    let root = f0.sqrt();
    (1.0 + root) / (1.0 - root)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn reflectance_stays_in_the_unit_interval(cos in 0.0..=1.0f64, eta in 0.05..6.0f64, k in 0.0..8.0f64) {
            for fresnel in [Fresnel::Dielectric { eta }, Fresnel::Conductor { eta, k }] {
                let f = fresnel.reflectance(cos);
                prop_assert!((-1e-12..=1.0 + 1e-12).contains(&f), "{fresnel:?} at {cos}: {f}");
            }
        }

        #[test]
        fn a_conductor_without_extinction_is_a_dielectric(cos in 0.0..=1.0f64, eta in 1.0..4.0f64) {
            let metal = Fresnel::Conductor { eta, k: 0.0 }.reflectance(cos);
            let dielectric = Fresnel::Dielectric { eta }.reflectance(cos);
            prop_assert!((metal - dielectric).abs() < 1e-9);
        }

        #[test]
        fn index_and_normal_reflectance_invert_each_other(ior in 1.0..20.0f64) {
            prop_assert!((ior_from_f0(f0_from_ior(ior)) - ior).abs() < 1e-9);
        }
    }
}
