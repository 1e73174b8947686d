//! Directional albedo of a rough interface: how much of the light from (or towards) one direction a GGX lobe reflects.
//!
//! `E(ω) = ∫ F D G/(4 cos θ_i cos θ_o) cos θ_i dω_i`. With the half vector's slope `x (α_x cos ψ, α_y sin ψ)` as variable,
//! ψ counted from the direction's own azimuth, `D cos θ_h dω_h = x/(π (1 + x²)²) dx dψ` has no peak left, whatever the width;
//! and the light stands above the surface exactly for `tan θ_h < q + √(1 + q²)`, `q = tan θ_o cos(φ_h − φ_o)`. Between these
//! limits the integrand is analytic, so that Gauss–Legendre quadrature converges fast.
//!
//! An [`Albedo`] is a Chebyshev interpolant over `ln(1 + μ/s)`, s a fraction of α, and, where the lobe is anisotropic, over the azimuth.
//! Single precision uses a small one that is built at once (0.1 ms; 0.6 ms where anisotropic); double precision a finer one, built when it is first
//! asked for (3 ms; up to 1 s where strongly anisotropic). Largest errors against a still finer quadrature, for cosines from 0.001 to 1:
//!
//! | lobe | single precision | double precision |
//! |---|---|---|
//! | round, α from 0.01 to 1 | 5e-4 (beyond μ = 0.02: 2e-4) | 2e-7 |
//! | round, α = 0.001 | 5e-4 (beyond μ = 0.02: 1e-4) | 7e-8 |
//! | five times longer than wide | 5e-4 | 4e-6, with a dielectric's Fresnel term 2e-7 |
//! | ten times longer than wide | 5e-3 | 1e-5, with a dielectric's Fresnel term 1e-6 |
//!
//! Still longer lobes are not resolved: at a ratio of 1000 single precision may be 0.2 off.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::OnceLock;

use crate::Real;
use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::masking::{Masking, smith_lambda};
use crate::quadrature::{Gauss, chebyshev_coefficients, chebyshev_points, clenshaw};

/// A GGX lobe without its scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Width α along tangent and bitangent, above 0.
    pub alpha: [f64; 2],
    /// [`Masking::Correlated`] or [`Masking::Separable`].
    pub masking: Masking,
    /// Reflectance of a facet.
    pub fresnel: Fresnel,
}

/// How finely an integral is taken.
struct Rule {
    /// Nodes of a part of the azimuth and of a part of the slope.
    azimuth: Gauss,
    slope: Gauss,
    /// How much smaller each part is than its neighbour, towards `ψ = π/2` and towards infinite slopes.
    grading: f64,
}

impl Rule {
    /// About 1e-4 off. What a perfect reflector loses is small, and asked for itself: it gets more nodes.
    fn fast(interface: &Interface) -> Self {
        let nodes = if interface.fresnel == Fresnel::None { 12 } else { 8 };
        let azimuth = Gauss::new(6 + interface.aspect().min(4.0) as usize);
        Self { azimuth, slope: Gauss::new(nodes), grading: f64::INFINITY }
    }

    /// About 1e-8 off. The slope of an elongated lobe turns quickly with the azimuth, which takes more nodes.
    fn exact(interface: &Interface) -> Self {
        let azimuth = 4.0 + 6.0 * interface.aspect().min(12.0);
        Self { azimuth: Gauss::new(azimuth as usize), slope: Gauss::new(10), grading: 2.5 }
    }
}

impl Interface {
    /// The albedo by quadrature, for a direction above the surface; about 1e-9 off.
    pub fn integrate(&self, w: [f64; 3]) -> f64 {
        self.integral(w, &Rule::exact(self))
    }

    /// How many times longer than wide the lobe is.
    fn aspect(&self) -> f64 {
        let ratio = self.alpha[0] / self.alpha[1];
        ratio.max(1.0 / ratio)
    }

    fn distribution(&self) -> Distribution {
        Distribution { shape: Shape::Ggx, alpha: self.alpha }
    }

    fn is_isotropic(&self) -> bool {
        self.alpha[0] == self.alpha[1]
    }

    fn integral(&self, w: [f64; 3], rule: &Rule) -> f64 {
        let [ax, ay] = self.alpha;
        let around = (w[0] * w[0] + w[1] * w[1]).sqrt();
        let (cos_phi, sin_phi) = if around > 0.0 { (w[0] / around, w[1] / around) } else { (1.0, 0.0) };
        // Width as seen from the direction, and the direction's azimuth on the stretched surface.
        let width = (ax * cos_phi).hypot(ay * sin_phi);
        let (along, across) = (ax * cos_phi / width, ay * sin_phi / width);
        let lambda = smith_lambda(&self.distribution(), &w, false);
        // Where the light can come from changes within this much of ψ = π/2.
        let turning = w[2] / (w[2] + width * around);
        let mut sum = 0.0;
        for (distance, weight) in graded(&rule.azimuth, FRAC_PI_2, turning, rule.grading) {
            let (near, far) = distance.sin_cos();
            for (cos, sin) in [(near, far), (-near, far), (near, -far), (-near, -far)] {
                if sin < 0.0 && self.is_isotropic() {
                    continue;
                }
                let slope = [ax * (cos * along - sin * across), ay * (sin * along + cos * across)];
                sum += weight * self.ray(w, slope, lambda, rule);
            }
        }
        sum / if self.is_isotropic() { PI } else { 2.0 * PI }
    }

    /// The integral over all half vectors with slope `x s`, from x = 0 to where the light sets.
    fn ray(&self, w: [f64; 3], s: [f64; 2], lambda: f64, rule: &Rule) -> f64 {
        let length = s[0].hypot(s[1]);
        let towards = (s[0] * w[0] + s[1] * w[1]) / w[2];
        let q = towards / length;
        // q + √(1 + q²) without cancellation.
        let root = (1.0 + q * q).sqrt();
        let end = if q < 0.0 { 1.0 / (root - q) } else { root + q } / length;
        let at = |x: f64, weight: f64| {
            let tan2 = x * x * length * length;
            let cos2_h = 1.0 / (1.0 + tan2);
            // cos_d/(cos θ_o cos θ_h)
            let stretch = 1.0 + x * towards;
            let twice = 2.0 * w[2] * stretch * cos2_h;
            let wi = [twice * x * s[0] - w[0], twice * x * s[1] - w[1], twice - w[2]];
            // Rounding may set the light at the very end.
            let wi = [wi[0], wi[1], wi[2].max(f64::MIN_POSITIVE)];
            let lambda_i = smith_lambda(&self.distribution(), &wi, false);
            let masking = match self.masking {
                Masking::Separable => 1.0 / ((1.0 + lambda) * (1.0 + lambda_i)),
                _ => 1.0 / (1.0 + lambda + lambda_i),
            };
            let facet = self.fresnel.reflectance(w[2] * stretch * cos2_h.sqrt());
            weight * facet * masking * stretch
        };
        // 2x/(1 + x²)² dx, beyond x = 1 in the variable 1/x, where it looks the same.
        let density = |x: f64| 2.0 * x / ((1.0 + x * x) * (1.0 + x * x));
        let middle = end.min(1.0);
        let core: f64 = rule.slope.on(0.0, middle).map(|(x, weight)| at(x, weight * density(x))).sum();
        if end <= 1.0 {
            return core;
        }
        let first = 1.0 / end;
        let tail = graded(&rule.slope, 1.0 - first, first.min(0.5), rule.grading);
        core + tail.map(|(y, weight)| at(1.0 / (first + y), weight * density(first + y))).sum::<f64>()
    }
}

/// Nodes with weights on `[0, to]`, dense towards 0: quadrature in the square root, in parts that shrink until the innermost is as
/// small as `finest` (in units of `to`).
fn graded(gauss: &Gauss, to: f64, finest: f64, grading: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
    let parts =
        if grading.is_finite() { 1 + (-0.5 * finest.ln() / grading.ln()).ceil().max(0.0) as i32 } else { 1 };
    let part = move |k: i32| {
        let outer = grading.powi(-k);
        let inner = if k + 1 == parts { 0.0 } else { outer / grading };
        gauss.on(inner, outer).map(move |(t, weight)| (to * t * t, 2.0 * to * t * weight))
    };
    (0..parts).flat_map(part)
}

/// Albedo as a polynomial: `Σ c_kj T_k(u) T_j(v)` with `(u + 1)/2 = ln(1 + μ/s)/ln(1 + 1/s)`, and `v = cos 2φ` after the azimuth φ has
/// been stretched halfway towards a round lobe.
struct Expansion<C> {
    /// 1/s, where s is a fraction of the lobe's mean width, and 2/ln(1 + 1/s).
    inverse: f64,
    scale: f64,
    /// What the squares of x and y are multiplied by.
    stretch: [f64; 2],
    /// Coefficients of one j after the other.
    coefficients: Vec<C>,
    /// How many there are of each j.
    degree: usize,
}

/// How many points an interpolant takes along μ and around, and how many times smaller than α the cosines are that it resolves.
struct Grid {
    polar: usize,
    around: usize,
    fineness: f64,
}

impl<C: Copy + Into<f64>> Expansion<C> {
    fn new(interface: &Interface, rule: Rule, grid: Grid, round: fn(f64) -> C) -> Self {
        let stretch = interface.alpha;
        let inverse = grid.fineness / (stretch[0] * stretch[1]).sqrt();
        let logarithm = inverse.ln_1p();
        let (polar, around) = (grid.polar, if interface.is_isotropic() { 1 } else { grid.around });
        let row = |v: f64| -> Vec<f64> {
            let (x, y) = (((1.0 + v) / stretch[0]).sqrt(), ((1.0 - v) / stretch[1]).sqrt());
            let (cos_phi, sin_phi) = (x / x.hypot(y), y / x.hypot(y));
            let value = |u: f64| {
                let mu = (0.5 * (u + 1.0) * logarithm).exp_m1() / inverse;
                let sin = (1.0 - mu * mu).max(0.0).sqrt();
                interface.integral([sin * cos_phi, sin * sin_phi, mu], &rule)
            };
            chebyshev_coefficients(&chebyshev_points(polar).map(value).collect::<Vec<_>>())
        };
        let rows: Vec<Vec<f64>> = chebyshev_points(around).map(row).collect();
        let mut coefficients = vec![0.0; polar * around];
        for k in 0..polar {
            let column: Vec<f64> = rows.iter().map(|row| row[k]).collect();
            for (j, c) in chebyshev_coefficients(&column).into_iter().enumerate() {
                coefficients[j * polar + k] = c;
            }
        }
        let coefficients = coefficients.into_iter().map(round).collect();
        Self { inverse, scale: 2.0 / logarithm, stretch, coefficients, degree: polar }
    }

    #[inline(always)]
    fn at<T: Real>(&self, w: &[T; 3]) -> T {
        let u = self.u(w[2]);
        let mut rows = self.coefficients.chunks_exact(self.degree).map(|row| clenshaw(row, u));
        let first = rows.next().unwrap_or_else(T::zero);
        if self.coefficients.len() == self.degree {
            return first;
        }
        let [x2, y2] = [T::of(self.stretch[0]) * w[0] * w[0], T::of(self.stretch[1]) * w[1] * w[1]];
        let around = x2 + y2;
        let v = if around > T::zero() { (x2 - y2) / around } else { T::one() };
        // T_j by its recurrence.
        let (mut before, mut polynomial, mut sum) = (T::one(), v, first);
        for row in rows {
            sum = sum + row * polynomial;
            (before, polynomial) = (polynomial, T::of(2.0) * v * polynomial - before);
        }
        sum
    }

    #[inline(always)]
    fn u<T: Real>(&self, mu: T) -> T {
        (T::one() + T::of(self.inverse) * mu).ln() * T::of(self.scale) - T::one()
    }

    /// `2 ∫ E μ dμ`, averaged over the azimuth.
    fn average(&self) -> f64 {
        // ∫ T_j(cos 2φ) dφ = 0 for j > 0.
        let row = &self.coefficients[..self.degree];
        let gauss = Gauss::new(self.degree);
        // In the variable u, where the polynomial is as smooth as anywhere.
        let at = |u: f64| {
            let growth = ((u + 1.0) / self.scale).exp();
            let (mu, jacobian) = ((growth - 1.0) / self.inverse, growth / (self.inverse * self.scale));
            2.0 * mu * jacobian * clenshaw(row, u)
        };
        gauss.on(-1.0, 1.0).map(|(u, weight)| weight * at(u)).sum()
    }
}

/// The albedo of an interface from all directions.
pub struct Albedo {
    interface: Interface,
    fast: Expansion<f32>,
    fast_average: f64,
    exact: OnceLock<(Expansion<f64>, f64)>,
}

impl Albedo {
    /// Tabulates an interface.
    pub fn new(interface: Interface) -> Self {
        // The narrower the lobe, the more decades of cosines are of interest.
        let narrow = interface.alpha[0] * interface.alpha[1] < 0.05 * 0.05;
        let grid = Grid { polar: if narrow { 28 } else { 16 }, around: 5, fineness: 3.0 };
        let fast = Expansion::new(&interface, Rule::fast(&interface), grid, |c| c as f32);
        let fast_average = fast.average();
        Self { interface, fast, fast_average, exact: OnceLock::new() }
    }

    /// Reflected share of the light from a direction above the surface.
    #[inline(always)]
    pub fn at<T: Real>(&self, w: &[T; 3]) -> T {
        let albedo = if T::IS_DOUBLE { self.exact().0.at(w) } else { self.fast.at(w) };
        albedo.max(T::zero()).min(T::one())
    }

    /// Reflected share of light from everywhere, `∫ E cos θ dω/π`.
    #[inline(always)]
    pub fn average<T: Real>(&self) -> T {
        T::of(if T::IS_DOUBLE { self.exact().1 } else { self.fast_average })
    }

    fn exact(&self) -> &(Expansion<f64>, f64) {
        self.exact.get_or_init(|| {
            let around = 7 + 2 * self.interface.aspect().min(12.0) as usize;
            let grid = Grid { polar: 64, around, fineness: 100.0 };
            let expansion = Expansion::new(&self.interface, Rule::exact(&self.interface), grid, |c| c);
            let average = expansion.average();
            (expansion, average)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;

    fn direction(mu: f64, phi: f64) -> [f64; 3] {
        let sin = (1.0 - mu * mu).sqrt();
        [sin * phi.cos(), sin * phi.sin(), mu]
    }

    /// Largest errors of the two tables over directions whose cosines reach from 1 down to 0.001.
    fn errors(interface: Interface) -> [f64; 2] {
        let albedo = Albedo::new(interface);
        let azimuth = 40.0 * interface.aspect().min(2.0);
        let finest = Rule { azimuth: Gauss::new(azimuth as usize), slope: Gauss::new(24), grading: 2.0 };
        let mut worst = [0.0f64; 2];
        for i in 0..30 {
            let w = direction(10f64.powf(-0.1 * f64::from(i)), 0.37 * f64::from(i));
            let reference = interface.integral(w, &finest);
            let found = [f64::from(albedo.at(&w.map(|v| v as f32))), albedo.at(&w)];
            (0..2).for_each(|k| worst[k] = worst[k].max((found[k] - reference).abs()));
        }
        worst
    }

    #[test]
    fn tables_are_as_exact_as_they_say() {
        for fresnel in [Fresnel::None, Fresnel::Dielectric { eta: 1.05 }, Fresnel::Dielectric { eta: 1.8 }] {
            for masking in [Masking::Correlated, Masking::Separable] {
                for alpha in [0.001, 0.01, 0.05, 0.2, 0.5, 1.0] {
                    let interface = Interface { alpha: [alpha; 2], masking, fresnel };
                    let [fast, exact] = errors(interface);
                    assert!(fast < 1.2e-3 && exact < 3e-7, "{interface:?}: {fast:.1e}, {exact:.1e}");
                }
            }
            let interface = Interface { alpha: [0.3, 0.15], masking: Masking::Correlated, fresnel };
            let [fast, exact] = errors(interface);
            assert!(fast < 5e-4 && exact < 3e-7, "{interface:?}: {fast:.1e}, {exact:.1e}");
        }
    }

    #[test]
    fn quadrature_agrees_with_a_sum_over_light_directions() {
        let fresnel = Fresnel::Dielectric { eta: 1.5 };
        let interface = Interface { alpha: [0.7, 0.3], masking: Masking::Correlated, fresnel };
        let distribution = interface.distribution();
        for wo in [direction(0.9, 0.4), direction(0.3, 1.2)] {
            let n = 1000;
            let mut sum = 0.0;
            for k in 0..n * n {
                let cos = ((k / n) as f64 + 0.5) / n as f64;
                let wi = direction(cos, 2.0 * PI * ((k % n) as f64 + 0.5) / n as f64);
                let g = Geometry::new(wi, wo).unwrap();
                let facets = distribution.density(&g) * interface.masking.visibility(&distribution, &g);
                sum += fresnel.reflectance(g.cos_d) * facets / (4.0 * wo[2]) * 2.0 * PI / (n * n) as f64;
            }
            let albedo = interface.integrate(wo);
            assert!((albedo - sum).abs() < 1e-5 * sum, "{albedo} instead of {sum}");
        }
    }

    #[test]
    fn a_rough_reflector_has_its_closed_form() {
        let interface = Interface { alpha: [1.0; 2], masking: Masking::Correlated, fresnel: Fresnel::None };
        assert!((interface.integrate([0.0, 0.0, 1.0]) - (1.0 - 2f64.ln())).abs() < 1e-9);
    }
}
