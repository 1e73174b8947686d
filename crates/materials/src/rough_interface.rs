//! How much light a rough dielectric interface lets through, and how much of what comes back from below it throws back again.
//!
//! Single scattering at microfacets with separable Smith masking (Walter *et al.* 2007, eq. 20, 21): what bounces between facets
//! is lost, so that transmittance and reflectance do not add up to 1. Isotropic GGX and Beckmann (by Walter's rational fit).

use std::f64::consts::PI;

use crate::distribution::{Distribution, Shape};
use crate::fresnel::{Fresnel, mix};
use crate::masking::smith_lambda;
use crate::quadrature::{Gauss, LANES, chebyshev_coefficients, chebyshev_points, clenshaw, clenshaw_lanes};

/// A rough interface with index of refraction above 1, inside over outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughInterface {
    /// Distribution of its normals: isotropic GGX or Beckmann.
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
    /// Heights of the normals.
    pub heights: usize,
    /// Azimuths of the normals, in half a turn; three times as many for [`Internal::Reflected`], where total reflection has an edge.
    pub turns: usize,
}

impl Order {
    /// For single precision. From α = 0.01 on the transmittance is 3·10⁻⁴ off (6·10⁻⁴ for the widest lobes and indices near 1;
    /// 2·10⁻³ at α = 0.001 and grazing angles), its mean 6·10⁻⁵, and [`Internal::Reflected`] 2·10⁻³.
    pub const FAST: Self = Self { directions: 16, heights: 14, turns: 8 };
    /// About 10⁻⁶, and 10⁻⁵ for [`Internal::Reflected`].
    pub const EXACT: Self = Self { directions: 48, heights: 64, turns: 32 };
}

impl RoughInterface {
    /// Share of the light from outside, at an angle of cosine `mu` above 0, that gets through.
    pub fn transmittance(&self, mu: f64, order: Order) -> f64 {
        self.transmitted(mu, &Normals::new(order))
    }

    fn transmitted(&self, mu: f64, normals: &Normals) -> f64 {
        let fresnel = Fresnel::Dielectric { eta: self.eta };
        let over_eta = 1.0 / self.eta;
        self.visible(mu, normals, |cos_d, cos_h| {
            // z of the refracted direction: −ω/η + (ω·h/η − cos θ_t) h.
            let cos_t = (1.0 - (1.0 - cos_d * cos_d) * over_eta * over_eta).sqrt();
            let down = mu * over_eta - (cos_d * over_eta - cos_t) * cos_h;
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
        let directions = Gauss::new(order.directions);
        match internal {
            // What goes out is what comes in, by reciprocity: ∫T_in μ dμ = ∫T_out μ dμ/η².
            Internal::NotTransmitted => {
                // μ = s², because T rises steeply from grazing angles.
                let transmitted =
                    directions.integrate(0.0, 1.0, |s| 4.0 * s.powi(3) * transmittance.at(s * s));
                1.0 - transmitted / (self.eta * self.eta)
            }
            Internal::Reflected => {
                let normals = Normals::new(Order { turns: 3 * order.turns, ..order });
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
        let sin2 = (1.0 - cos * cos).max(0.0);
        match self.distribution.shape {
            Shape::Ggx => ggx_seen(self.distribution.alpha[0], cos, sin2),
            _ => 1.0 / (1.0 + smith_lambda(&self.distribution, &[sin2.sqrt(), 0.0, cos], true)),
        }
    }

    /// [`Self::seen`] over that of a GGX distribution of the same width.
    fn seen_over_ggx(&self, cos: f64) -> f64 {
        if self.distribution.shape == Shape::Ggx {
            return 1.0;
        }
        // In the surface itself both are 0; their ratio has a limit.
        let cos = cos.max(1e-100);
        self.seen(cos) / ggx_seen(self.distribution.alpha[0], cos, 1.0 - cos * cos)
    }

    /// The mean of a function of `ω·h` and `cos θ_h` over the normals that are visible from a direction of cosine `mu`, times
    /// the visible share of the surface: `∫ f G1(ω) D(h) max(0, ω·h)/cos θ dh`.
    ///
    /// Visible normals of GGX are those of a sphere, stretched: they halve the angles to a spherical cap (Dupuy & Benyoub
    /// 2023). Those of Beckmann are weighted.
    #[inline(always)]
    fn visible(&self, mu: f64, normals: &Normals, f: impl Fn(f64, f64) -> f64) -> f64 {
        let sin = (1.0 - mu * mu).max(0.0).sqrt();
        let is_ggx = self.distribution.shape == Shape::Ggx;
        let share = self.seen_over_ggx(mu);
        let alpha = self.distribution.alpha[0];
        let length = (alpha * alpha * sin * sin + mu * mu).sqrt();
        let (wx, wz) = (alpha * sin / length, mu / length);
        // z from −w_z to 1 is as s², because normals at its lower end fall off like a root.
        normals.heights.integrate(0.0, 1.0, |s| {
            let z = (1.0 + wz) * s * s - wz;
            let across = (1.0 - z * z).max(0.0).sqrt();
            // The normal is (α x, α y, up) over its length.
            let up = z + wz;
            let ring = |(cos, share_of_turn): &(f64, f64)| {
                let x = across * cos + wx;
                let plane2 = across * across + wx * (wx + 2.0 * across * cos);
                let over = (alpha * alpha * plane2 + up * up).sqrt().recip();
                let slope2 = plane2 / (up * up);
                // D of Beckmann over that of GGX.
                let weight = if is_ggx { 1.0 } else { share * (-slope2).exp() * (1.0 + slope2).powi(2) };
                share_of_turn * weight * f(((sin * alpha * x + mu * up) * over).min(1.0), up * over)
            };
            2.0 * s * normals.turns.iter().map(ring).sum::<f64>()
        })
    }
}

/// Smith's G1 of GGX, of a direction above the surface.
fn ggx_seen(alpha: f64, cos: f64, sin2: f64) -> f64 {
    2.0 * cos / (cos + (cos * cos + alpha * alpha * sin2).sqrt())
}

/// Where normals are sampled.
struct Normals {
    /// Heights on the cap.
    heights: Gauss,
    /// Cosines of the azimuths in half a turn, which is enough for an even function, with weights whose sum is 1. Gauss's nodes
    /// take half as many as equal steps, because grazing directions see a crease at its ends.
    turns: Vec<(f64, f64)>,
}

impl Normals {
    fn new(order: Order) -> Self {
        let turn = |(x, weight): (f64, f64)| ((PI * x).cos(), weight);
        Self {
            heights: Gauss::new(order.heights),
            turns: Gauss::new(order.turns).on(0.0, 1.0).map(turn).collect(),
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
        let normals = Normals::new(order);
        let value = |x: f64| {
            let mu = (0.5 * (1.0 + x)).powi(2);
            interface.transmitted(mu, &normals) / interface.seen_over_ggx(mu)
        };
        let values: Vec<f64> = chebyshev_points(order.directions).map(value).collect();
        Self { interface: *interface, coefficients: chebyshev_coefficients(&values) }
    }

    /// The share that gets through at an angle of cosine `mu`, 0 to 1.
    pub fn at(&self, mu: f64) -> f64 {
        self.completed(mu, clenshaw(&self.coefficients, 2.0 * mu.sqrt() - 1.0))
    }

    /// The share, from the value of the series.
    fn completed(&self, mu: f64, series: f64) -> f64 {
        (series * self.interface.seen_over_ggx(mu)).clamp(0.0, 1.0)
    }

    /// The same as a table.
    pub fn table(&self) -> TransmittanceTable {
        let last = TransmittanceTable::INTERVALS as f64;
        let block = |first: usize| {
            let roots: [f64; LANES] = std::array::from_fn(|k| (first + k) as f64 / last);
            let series = clenshaw_lanes(&self.coefficients, roots.map(|root| 2.0 * root - 1.0));
            std::array::from_fn(|k| self.completed(roots[k] * roots[k], series[k]) as f32)
        };
        let mut values: Vec<f32> = (0..TransmittanceTable::INTERVALS)
            .step_by(LANES)
            .flat_map(|first| -> [f32; LANES] { block(first) })
            .collect();
        values.push(self.at(1.0) as f32);
        TransmittanceTable { values }
    }
}

/// A [`Transmittance`] for single precision: values at equal steps of the cosine's root, interpolated linearly. It is 10⁻⁵ off the series at
/// the most; 5·10⁻⁵ in the one interval with the step of Walter's fit of Beckmann's masking.
#[derive(Clone, Debug, PartialEq)]
pub struct TransmittanceTable {
    values: Vec<f32>,
}

impl TransmittanceTable {
    const INTERVALS: usize = 1024;

    /// The share that gets through at an angle of cosine `mu`, 0 to 1.
    #[inline(always)]
    pub fn at(&self, mu: f32) -> f32 {
        let at = mu.sqrt() * Self::INTERVALS as f32;
        let k = (at as usize).min(Self::INTERVALS - 1);
        mix(self.values[k], self.values[k + 1], at - k as f32)
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
    fn tables_follow_the_series() {
        for (shape, tolerance) in [(Shape::Ggx, 1e-5), (Shape::Beckmann, 6e-5)] {
            for alpha in [0.001, 0.01, 0.1, 0.3, 1.0] {
                let series = Transmittance::new(&interface(shape, alpha, 1.5), Order::FAST);
                let table = series.table();
                for k in 0..=5000 {
                    let mu = (f64::from(k) / 5000.0).powi(2);
                    let (found, expected) = (f64::from(table.at(mu as f32)), series.at(mu));
                    assert!(
                        (found - expected).abs() < tolerance,
                        "{shape:?} {alpha} {mu}: {found} {expected}"
                    );
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
