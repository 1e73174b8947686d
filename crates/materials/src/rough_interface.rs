//! How much light a rough dielectric interface lets through, and how much of what comes back from below it throws back again.
//!
//! Single scattering at microfacets with separable Smith masking (Walter *et al.* 2007, eq. 20, 21): what bounces between facets
//! is lost, so that transmittance and reflectance do not add up to 1. Isotropic GGX and Beckmann (by Walter's rational fit).

use std::f64::consts::PI;

use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::masking::smith_lambda;

/// A rough interface with index of refraction above 1, inside over outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughInterface {
    /// Distribution of its normals, isotropic.
    pub distribution: Distribution,
    /// Index of refraction, inside over outside.
    pub eta: f64,
}

/// What is taken for the diffuse reflectance of the interface from inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Internal {
    /// All that is not transmitted: `1 − 2∫T_in μ dμ`, as Mitsuba 0.6 has it.
    NotTransmitted,
    /// What is reflected: `2∫R_in μ dμ`, as Mitsuba 3 has it.
    Reflected,
}

/// How finely directions and normals are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Order {
    /// Cosines of the direction.
    pub directions: usize,
    /// Normals along each of two coordinates.
    pub normals: usize,
}

impl Order {
    /// For single precision: about 10⁻⁴, and 10⁻³ for [`Internal::Reflected`].
    pub const FAST: Self = Self { directions: 16, normals: 16 };
    /// About 10⁻⁶, and 10⁻⁵ for [`Internal::Reflected`].
    pub const EXACT: Self = Self { directions: 48, normals: 64 };
}

impl RoughInterface {
    /// Share of the light from outside, at an angle of cosine `mu` above 0, that gets through.
    pub fn transmittance(&self, mu: f64, order: Order) -> f64 {
        self.transmitted(mu, &Normals::new(order.normals))
    }

    fn transmitted(&self, mu: f64, normals: &Normals) -> f64 {
        let fresnel = Fresnel::Dielectric { eta: self.eta };
        self.visible(mu, normals, |cos_d, cos_h| {
            // z of the refracted direction: −ω/η + (ω·h/η − cos θ_t) h.
            let cos_t = (1.0 - (1.0 - cos_d * cos_d) / (self.eta * self.eta)).sqrt();
            let down = mu / self.eta - (cos_d / self.eta - cos_t) * cos_h;
            (1.0 - fresnel.reflectance(cos_d)) * self.seen(down)
        })
    }

    /// Share of the light from inside, at an angle of cosine `mu` above 0, that is reflected back.
    fn reflected_inside(&self, mu: f64, normals: &Normals) -> f64 {
        let fresnel = Fresnel::Dielectric { eta: 1.0 / self.eta };
        self.visible(mu, normals, |cos_d, cos_h| {
            fresnel.reflectance(cos_d) * self.seen(2.0 * cos_d * cos_h - mu)
        })
    }

    /// Share of diffuse light from inside that is thrown back, beside the interface's transmittance from outside.
    pub fn internal_reflectance(
        &self,
        internal: Internal,
        transmittance: &Transmittance,
        order: Order,
    ) -> f64 {
        let directions = Rule::gauss_legendre(order.directions);
        match internal {
            // What goes out is what comes in, by reciprocity: ∫T_in μ dμ = ∫T_out μ dμ/η².
            Internal::NotTransmitted => {
                // μ = s², because T rises steeply from grazing angles.
                let transmitted =
                    directions.integrate(0.0, 1.0, |s| 4.0 * s.powi(3) * transmittance.at(s * s));
                1.0 - transmitted / (self.eta * self.eta)
            }
            Internal::Reflected => {
                let normals = Normals::new(order.normals);
                let part = |mu: f64| 2.0 * mu * self.reflected_inside(mu, &normals);
                // A smooth interface reflects everything up to the critical angle, and falls like a root from there.
                let critical = (1.0 - 1.0 / (self.eta * self.eta)).sqrt();
                let rest = 1.0 - critical;
                directions.integrate(0.0, critical, part)
                    + directions.integrate(0.0, 1.0, |s| 2.0 * s * rest * part(critical + rest * s * s))
            }
        }
    }

    /// Smith's G1 of a direction's cosine; 0 below the surface.
    fn seen(&self, cos: f64) -> f64 {
        if cos <= 0.0 {
            return 0.0;
        }
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        1.0 / (1.0 + smith_lambda(&self.distribution, &[sin, 0.0, cos], true))
    }

    /// [`Self::seen`] over that of a GGX distribution of the same width.
    fn seen_over_ggx(&self, cos: f64) -> f64 {
        let ggx = Distribution { shape: Shape::Ggx, ..self.distribution };
        if ggx == self.distribution {
            1.0
        } else {
            self.seen(cos) / Self { distribution: ggx, ..*self }.seen(cos)
        }
    }

    /// The mean of a function of `ω·h` and `cos θ_h` over the normals that are visible from a direction of cosine `mu`, times
    /// the visible share of the surface: `∫ f G1(ω) D(h) max(0, ω·h)/cos θ dh`.
    ///
    /// Visible normals of GGX are those of a sphere, stretched: they halve the angles to a spherical cap (Dupuy & Benyoub
    /// 2023). Those of other distributions are weighted.
    fn visible(&self, mu: f64, normals: &Normals, f: impl Fn(f64, f64) -> f64) -> f64 {
        let sin = (1.0 - mu * mu).max(0.0).sqrt();
        let ggx = Distribution { shape: Shape::Ggx, ..self.distribution };
        let share = self.seen_over_ggx(mu);
        let alpha = ggx.alpha[0];
        let length = (alpha * alpha * sin * sin + mu * mu).sqrt();
        let (wx, wz) = (alpha * sin / length, mu / length);
        // z from −w_z to 1 is as s², because normals at its lower end fall off like a root.
        normals.heights.integrate(0.0, 1.0, |s| {
            let z = (1.0 + wz) * s * s - wz;
            let across = (1.0 - z * z).max(0.0).sqrt();
            let ring = |(cos, sine): &(f64, f64)| {
                let h = [alpha * (across * cos + wx), alpha * across * sine, z + wz];
                let over = (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]).sqrt().recip();
                let cos_h = h[2] * over;
                let weight = if self.distribution == ggx {
                    1.0
                } else {
                    let tan2 = [(h[0] / h[2]).powi(2), (h[1] / h[2]).powi(2)];
                    share * self.distribution.density_at(cos_h, tan2) / ggx.density_at(cos_h, tan2)
                };
                weight * f(((sin * h[0] + mu * h[2]) * over).min(1.0), cos_h)
            };
            2.0 * s * normals.turns.iter().map(ring).sum::<f64>() / normals.turns.len() as f64
        })
    }
}

/// Where normals are sampled.
struct Normals {
    /// Heights on the cap.
    heights: Rule,
    /// Cosines and sines of half a turn about it: what a function that is even in the azimuth needs.
    turns: Vec<(f64, f64)>,
}

impl Normals {
    fn new(n: usize) -> Self {
        let turn = |k: usize| (PI * (k as f64 + 0.5) / n as f64).sin_cos();
        Self {
            heights: Rule::gauss_legendre(n),
            turns: (0..n).map(turn).map(|(sin, cos)| (cos, sin)).collect(),
        }
    }
}

/// The transmittance from outside at every angle: a Chebyshev series in the root of the cosine, times what Walter's fit makes of
/// the visibility, which has a seam.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmittance {
    interface: RoughInterface,
    coefficients: Vec<f64>,
}

impl Transmittance {
    /// Samples an interface.
    pub fn new(interface: &RoughInterface, order: Order) -> Self {
        let n = order.directions;
        let angle = |k: usize| PI * (k as f64 + 0.5) / n as f64;
        let normals = Normals::new(order.normals);
        let value = |k: usize| {
            let mu = (0.5 * (1.0 + angle(k).cos())).powi(2);
            interface.transmitted(mu, &normals) / interface.seen_over_ggx(mu)
        };
        let values: Vec<f64> = (0..n).map(value).collect();
        let coefficient = |j: usize| {
            let sum: f64 = (0..n).map(|k| values[k] * (j as f64 * angle(k)).cos()).sum();
            sum * if j == 0 { 1.0 } else { 2.0 } / n as f64
        };
        Self { interface: *interface, coefficients: (0..n).map(coefficient).collect() }
    }

    /// The share that gets through at an angle of cosine `mu`, 0 to 1.
    pub fn at(&self, mu: f64) -> f64 {
        let series = clenshaw(&self.coefficients, 2.0 * mu.sqrt() - 1.0);
        (series * self.interface.seen_over_ggx(mu)).clamp(0.0, 1.0)
    }
}

/// A Chebyshev series at `x`, from −1 to 1.
fn clenshaw(coefficients: &[f64], x: f64) -> f64 {
    let (mut a, mut b) = (0.0, 0.0);
    for c in coefficients.iter().skip(1).rev() {
        (a, b) = (2.0 * x * a - b + c, a);
    }
    x * a - b + coefficients.first().unwrap_or(&0.0)
}

/// Gauss–Legendre nodes and weights on [0, 1].
struct Rule(Vec<(f64, f64)>);

impl Rule {
    fn gauss_legendre(n: usize) -> Self {
        let node = |k: usize| {
            // Newton's method from Tricomi's estimate; the derivative gives the weight.
            let mut x = (PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut last, mut value) = (1.0, x);
                for j in 2..=n {
                    let j = j as f64;
                    (last, value) = (value, ((2.0 * j - 1.0) * x * value - (j - 1.0) * last) / j);
                }
                slope = n as f64 * (x * value - last) / (x * x - 1.0);
                let step = value / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        };
        Self((0..n).map(node).collect())
    }

    fn integrate(&self, from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
        let width = to - from;
        self.0.iter().map(|(x, w)| w * f(from + width * x)).sum::<f64>() * width
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(shape: Shape, alpha: f64, eta: f64) -> RoughInterface {
        RoughInterface { distribution: Distribution { shape, alpha: [alpha; 2] }, eta }
    }

    #[test]
    fn a_smooth_interface_transmits_what_it_does_not_reflect() {
        for shape in [Shape::Ggx, Shape::Beckmann] {
            let smooth = interface(shape, 0.001, 1.5);
            for mu in [0.1, 0.5, 1.0] {
                let expected = 1.0 - Fresnel::Dielectric { eta: 1.5 }.reflectance(mu);
                let found = smooth.transmittance(mu, Order::EXACT);
                assert!((found - expected).abs() < 2e-4, "{shape:?} {mu}: {found} {expected}");
            }
            // Twice the mean of Fresnel's reflectance from inside, for an index of 1.5.
            let transmittance = Transmittance::new(&smooth, Order::EXACT);
            for internal in [Internal::NotTransmitted, Internal::Reflected] {
                let reflected = smooth.internal_reflectance(internal, &transmittance, Order::EXACT);
                assert!((reflected - 0.596).abs() < 1e-3, "{internal:?}: {reflected}");
            }
        }
    }

    #[test]
    fn the_series_follows_the_integral() {
        for (shape, alpha, eta) in
            [(Shape::Ggx, 0.05, 1.3), (Shape::Ggx, 0.6, 1.8), (Shape::Beckmann, 0.3, 1.5)]
        {
            let interface = interface(shape, alpha, eta);
            for (order, tolerance) in [(Order::EXACT, 1e-5), (Order::FAST, 1e-3)] {
                let series = Transmittance::new(&interface, order);
                for mu in [0.01, 0.1, 0.4, 0.9] {
                    let (found, expected) = (series.at(mu), interface.transmittance(mu, Order::EXACT));
                    assert!((found - expected).abs() < tolerance, "{interface:?} {mu}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn the_two_readings_of_the_internal_reflectance_differ() {
        let interface = interface(Shape::Ggx, 0.3, 1.5);
        let transmittance = Transmittance::new(&interface, Order::EXACT);
        let reflected = |internal| interface.internal_reflectance(internal, &transmittance, Order::EXACT);
        assert!((reflected(Internal::NotTransmitted) - 0.597).abs() < 5e-4);
        assert!((reflected(Internal::Reflected) - 0.421).abs() < 5e-4);
    }
}
