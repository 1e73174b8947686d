//! Importance sampling: directions drawn about as often as a lobe scatters light there.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use crate::distribution::Distribution;

/// One way of drawing a light direction for a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Technique {
    /// Normals are drawn with density `D cos θ_h`, and the view is reflected in them.
    HalfVector(Distribution),
    /// Density `cos θ_i/π`.
    Cosine,
    /// Density `(n + 1)/(2π) cosⁿ` about the direction `(x ω_x, y ω_y, z ω_z)` of the view ω: Lafortune *et al.* (1997).
    Power {
        /// Scale of the view along tangent, bitangent and normal; the mirror direction is (−1, −1, 1).
        scale: [f64; 3],
        /// The power n, 0 or more.
        exponent: f64,
    },
}

/// A mixture of techniques. What it draws may lie below the surface; its density integrates to 1 over the whole sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampling {
    /// Techniques with their shares, above 0; their sum is 1.
    parts: Vec<(f64, Technique)>,
}

impl Sampling {
    /// A mixture with shares in the proportion of some weights; `None` where none is above 0.
    pub fn mixture(parts: impl IntoIterator<Item = (f64, Technique)>) -> Option<Self> {
        let mut parts: Vec<(f64, Technique)> =
            parts.into_iter().filter(|(weight, _)| *weight > 0.0).collect();
        let sum: f64 = parts.iter().map(|(weight, _)| weight).sum();
        parts.iter_mut().for_each(|(weight, _)| *weight /= sum);
        (!parts.is_empty()).then_some(Self { parts })
    }

    /// Normals drawn from one distribution.
    pub fn half_vector(distribution: Distribution) -> Self {
        Self { parts: vec![(1.0, Technique::HalfVector(distribution))] }
    }

    /// The techniques and their shares.
    pub fn parts(&self) -> &[(f64, Technique)] {
        &self.parts
    }

    /// True where turning the surface about its normal changes nothing.
    pub fn is_isotropic(&self) -> bool {
        self.parts.iter().all(|(_, technique)| technique.is_isotropic())
    }

    /// Width α of the narrowest technique, 1 at most.
    pub fn width(&self) -> f64 {
        self.parts.iter().map(|(_, technique)| technique.width()).fold(1.0, f64::min)
    }

    /// Draws a light direction for a view direction from two numbers in `[0, 1)`. The result may lie below the surface.
    pub fn sample(&self, wo: [f64; 3], [mut u, v]: [f64; 2]) -> [f64; 3] {
        let mut chosen = self.parts[self.parts.len() - 1];
        for part in &self.parts {
            if u < part.0 {
                chosen = *part;
                break;
            }
            u -= part.0;
        }
        chosen.1.sample(wo, [(u / chosen.0).clamp(0.0, 1.0 - f64::EPSILON), v])
    }

    /// Probability density of [`Sampling::sample`] for unit directions, in 1/sr.
    pub fn density(&self, wi: [f64; 3], wo: [f64; 3]) -> f64 {
        self.parts.iter().map(|(share, technique)| share * technique.density(wi, wo)).sum()
    }
}

impl Technique {
    fn is_isotropic(&self) -> bool {
        match self {
            Self::HalfVector(distribution) => distribution.is_isotropic(),
            Self::Cosine => true,
            Self::Power { scale, .. } => scale[0] == scale[1],
        }
    }

    fn width(&self) -> f64 {
        match self {
            Self::HalfVector(distribution) => 0.5 * (distribution.alpha[0] + distribution.alpha[1]),
            Self::Cosine => 1.0,
            Self::Power { exponent, .. } => (2.0 / (exponent + 2.0)).sqrt(),
        }
    }

    fn sample(&self, wo: [f64; 3], u: [f64; 2]) -> [f64; 3] {
        match self {
            Self::HalfVector(distribution) => {
                let h = distribution.sample(u);
                let cos_d = dot(wo, h);
                std::array::from_fn(|k| 2.0 * cos_d * h[k] - wo[k])
            }
            Self::Cosine => about([0.0, 0.0, 1.0], u[0].sqrt(), u[1]),
            Self::Power { scale, exponent } => {
                about(axis(scale, wo), u[0].powf(1.0 / (exponent + 1.0)), u[1])
            }
        }
    }

    fn density(&self, wi: [f64; 3], wo: [f64; 3]) -> f64 {
        match self {
            Self::HalfVector(distribution) => half_vector_density(distribution, wi, wo),
            Self::Cosine => wi[2].max(0.0) * FRAC_1_PI,
            Self::Power { scale, exponent } => {
                (exponent + 1.0) / TAU * dot(axis(scale, wo), wi).max(0.0).powf(*exponent)
            }
        }
    }
}

/// Density of a view's reflections in normals of a distribution: `D cos θ_h/(4 |ω_o·h|)`.
fn half_vector_density(distribution: &Distribution, wi: [f64; 3], wo: [f64; 3]) -> f64 {
    let sum: [f64; 3] = std::array::from_fn(|k| wi[k] + wo[k]);
    let length = dot(sum, sum).sqrt();
    let cos_h = sum[2].abs() / length;
    if length == 0.0 || cos_h == 0.0 {
        return 0.0;
    }
    let tan2_h = [(sum[0] / sum[2]).powi(2), (sum[1] / sum[2]).powi(2)];
    distribution.density_at(cos_h, tan2_h) * cos_h / (2.0 * length)
}

/// The axis of a generalised cosine lobe; the normal where it has none.
fn axis(scale: &[f64; 3], wo: [f64; 3]) -> [f64; 3] {
    let scaled: [f64; 3] = std::array::from_fn(|k| scale[k] * wo[k]);
    let length = dot(scaled, scaled).sqrt();
    if length > 0.0 { scaled.map(|v| v / length) } else { [0.0, 0.0, 1.0] }
}

/// The direction at an angle of a given cosine about a unit axis, at a share of the whole turn.
fn about(axis: [f64; 3], cos: f64, turn: f64) -> [f64; 3] {
    // Duff et al. (2017), Building an Orthonormal Basis, Revisited.
    let [x, y, z] = axis;
    let sign = 1.0f64.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    let s = [1.0 + sign * x * x * a, sign * b, -sign * x];
    let t = [b, sign + y * y * a, -y];
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (2.0 * PI * turn).sin_cos();
    std::array::from_fn(|k| sin * (cos_phi * s[k] + sin_phi * t[k]) + cos * axis[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
