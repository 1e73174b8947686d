//! A lobe in the basis of the rings, for every angle of view.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

use fearless_simd::{Level, Simd, dispatch, prelude::*};
use lookmatch_materials::{Bsdf, Geometry};

use crate::rings::{NODES, ROW, Ring, TERMS, chebyshev, node, project};

/// Tabulated angles of view from 0 to just short of π/2; between them, cubic interpolation.
const ANGLES: usize = 33;
/// The last of them, just short of π/2, where no geometry exists.
const LAST_ANGLE: f64 = FRAC_PI_2 - 1e-3;
/// They are the denser, the closer to grazing: the power by which their distance from it falls.
const GRAZING: f64 = 1.5;
/// Interpolation points on each ring.
const POINTS: usize = 4;
/// Quadrature points between two of the innermost nodes, where lobes may be narrower than their distance: as fractions of it,
/// with their weights (Gauss–Legendre), …
const INNER_GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
/// … and between the others.
const GAUSS: [(f64, f64); 2] = [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];
/// The first of the others: a degree and a half from the normal.
const OUTER: usize = 8;

/// The coefficients of one lobe at one angle of view, by basis function and channel.
pub(crate) type Coefficients = [[f32; 3]; ROW];

/// Coefficients of one lobe at every tabulated angle.
#[derive(Clone, Debug)]
pub(crate) struct LobeTable {
    angles: Vec<Coefficients>,
}

impl LobeTable {
    /// Expands the specular lobe of a BSDF; one that is not isotropic is averaged over all turns about the normal.
    pub(crate) fn new(bsdf: &dyn Bsdf) -> Self {
        let quadrature = &*QUADRATURE;
        let lobe = if !bsdf.is_isotropic() {
            averaged(bsdf, &quadrature.geometries, (0..TURNS).map(|k| move |g: &Geometry<f32>| turned(g, k)))
        } else if !bsdf.is_mirror_symmetric() {
            let both: [Motion; 2] = [|g| *g, |g| g.mirrored()];
            averaged(bsdf, &quadrature.geometries, both.into_iter())
        } else {
            bsdf.specular_all(&quadrature.geometries)
        };
        let mut products = vec![[[0.0; 3 * TERMS]; NODES]; ANGLES];
        let mut used = 0;
        for ring in &quadrature.rings {
            let (f, weights) = (&lobe[used..used + POINTS], &quadrature.weights[used..used + POINTS]);
            used += POINTS;
            let terms = ring_terms(f, weights);
            let products = &mut products[ring.angle];
            for (k, term) in terms.iter().enumerate() {
                products[ring.interval][k] += (1.0 - ring.hat) * term;
                products[ring.interval + 1][k] += ring.hat * term;
            }
        }
        let coefficients = |products: &mut [[f64; 3 * TERMS]; NODES]| -> Coefficients {
            project(products);
            std::array::from_fn(|i| std::array::from_fn(|c| products[i / TERMS][3 * (i % TERMS) + c] as f32))
        };
        Self { angles: products.iter_mut().map(coefficients).collect() }
    }

    /// Where an angle of view, in radians, lies among the tabulated ones, from 0 to the last.
    pub(crate) fn place(theta: f64) -> f64 {
        let t = 1.0 - (1.0 - theta / LAST_ANGLE).max(0.0).powf(1.0 / GRAZING);
        t.clamp(0.0, 1.0) * (ANGLES - 1) as f64
    }

    /// The coefficients at every fourth of the tabulated angles, the last among them.
    pub(crate) fn every_fourth(&self) -> impl Iterator<Item = &Coefficients> {
        self.angles.iter().step_by(4)
    }

    /// A share of what is left of the lobe without another.
    pub(crate) fn less(&self, other: Option<&Self>, share: f32) -> Self {
        let mut rest = self.clone();
        let coefficients = rest.angles.as_flattened_mut().as_flattened_mut();
        if let Some(other) = other {
            let others = other.angles.as_flattened().as_flattened();
            coefficients.iter_mut().zip(others).for_each(|(rest, other)| *rest -= other);
        }
        coefficients.iter_mut().for_each(|rest| *rest *= share);
        rest
    }

    /// All coefficients, for hashing.
    pub(crate) fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.angles.as_flattened().as_flattened())
    }

    /// Sets the coefficients at an angle of view, in radians.
    pub(crate) fn at(&self, theta: f64, out: &mut Coefficients) {
        let x = Self::place(theta);
        let first = (x as usize).saturating_sub(1).min(ANGLES - 4);
        let weights = cubic(x - first as f64).map(|w| w as f32);
        let level = Level::new();
        dispatch!(level, simd => blend(simd, &self.angles[first..first + 4], weights, out.as_flattened_mut()));
    }
}

/// The weighted sum of four rows of coefficients.
#[inline(always)]
fn blend<S: Simd>(simd: S, rows: &[Coefficients], weights: [f32; 4], out: &mut [f32]) {
    let width = S::f32s::LEN;
    for start in (0..3 * ROW).step_by(width) {
        let lanes = start..start + width;
        let mut sum = S::f32s::splat(simd, 0.0);
        for (row, weight) in rows.iter().zip(weights) {
            sum = S::f32s::from_slice(simd, &row.as_flattened()[lanes.clone()]).mul_add(weight, sum);
        }
        sum.store_slice(&mut out[lanes]);
    }
}

const _: () = assert!((3 * ROW).is_multiple_of(16), "rows fill the registers of every instruction set");

/// What a reflection is moved by.
type Motion = fn(&Geometry<f32>) -> Geometry<f32>;

/// Turns about the normal that an anisotropic lobe is averaged over.
const TURNS: usize = 8;

/// A reflection after one of them.
fn turned(geometry: &Geometry<f32>, k: usize) -> Geometry<f32> {
    let (sin, cos) = (PI * (k as f64 + 0.5) / TURNS as f64).sin_cos();
    geometry.turned(sin as f32, cos as f32)
}

/// The mean of a lobe over several motions of a reflection.
fn averaged<M: Fn(&Geometry<f32>) -> Geometry<f32>>(
    bsdf: &dyn Bsdf,
    geometries: &[Geometry<f32>],
    motions: impl ExactSizeIterator<Item = M>,
) -> Vec<[f32; 3]> {
    let mut mean = vec![[0.0; 3]; geometries.len()];
    let share = 1.0 / motions.len() as f32;
    for motion in motions {
        let moved: Vec<Geometry<f32>> = geometries.iter().map(&motion).collect();
        for (mean, f) in mean.iter_mut().zip(bsdf.specular_all(&moved)) {
            (0..3).for_each(|c| mean[c] += f[c] * share);
        }
    }
    mean
}

/// The moments of `f` on one ring with each Chebyshev polynomial, channels side by side.
fn ring_terms(f: &[[f32; 3]], weights: &[f64]) -> [f64; 3 * TERMS] {
    let mut terms = [0.0; 3 * TERMS];
    for ((f, weight), polynomials) in f.iter().zip(weights).zip(&*POLYNOMIALS) {
        let g = f.map(|f| f64::from(f) * weight);
        for k in 0..TERMS {
            for c in 0..3 {
                terms[3 * k + c] += g[c] * polynomials[k];
            }
        }
    }
    terms
}

/// Lagrange's weights of the points 0, 1, 2, 3 at `x`.
fn cubic(x: f64) -> [f64; 4] {
    let (a, b, c, d) = (x, x - 1.0, x - 2.0, x - 3.0);
    [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0]
}

/// A tabulated angle of view, in radians.
fn tabulated_angle(index: usize) -> f64 {
    LAST_ANGLE * (1.0 - (1.0 - index as f64 / (ANGLES - 1) as f64).powf(GRAZING))
}

/// A ring that lobes are evaluated on: at [`POINTS`] places.
struct SampledRing {
    angle: usize,
    interval: usize,
    /// Share of the right-hand hat function.
    hat: f64,
}

/// Where lobes are evaluated: the same for every lobe, so worked out once.
struct Quadrature {
    rings: Vec<SampledRing>,
    geometries: Vec<Geometry<f32>>,
    /// `cos θ_i · 4 cos_d · sin θ_h` times the quadrature weight, for each geometry.
    weights: Vec<f64>,
}

static QUADRATURE: LazyLock<Quadrature> = LazyLock::new(|| {
    let mut quadrature = Quadrature { rings: Vec::new(), geometries: Vec::new(), weights: Vec::new() };
    for angle in 0..ANGLES {
        let theta_o = tabulated_angle(angle);
        for interval in 0..NODES - 1 {
            let points: &[(f64, f64)] = if interval < OUTER { &INNER_GAUSS } else { &GAUSS };
            for &(hat, share) in points {
                quadrature.add_ring(SampledRing { angle, interval, hat }, theta_o, share);
            }
        }
    }
    quadrature
});

impl Quadrature {
    fn add_ring(&mut self, ring: SampledRing, theta_o: f64, share: f64) {
        let width = node(ring.interval + 1) - node(ring.interval);
        let theta_h = node(ring.interval) + ring.hat * width;
        let (view, half) = ((theta_o.cos(), theta_o.sin()), (theta_h.cos(), theta_h.sin()));
        let Some(cut) = Ring::new(view, half) else { return };
        let at = |i| {
            let cos_d = cut.cos_d(interpolation_point(i));
            let geometry = Geometry::from_half_vector(view, half, cos_d)?;
            Some((geometry.to_f32(), geometry.cos_i() * 4.0 * cos_d * half.1 * share * width))
        };
        let Some(points) = (0..POINTS).map(at).collect::<Option<Vec<_>>>() else { return };
        self.rings.push(ring);
        for (geometry, weight) in points {
            self.geometries.push(geometry);
            self.weights.push(weight);
        }
    }
}

/// Zeros of the Chebyshev polynomial of degree [`POINTS`].
fn interpolation_point(i: usize) -> f64 {
    (PI * (i as f64 + 0.5) / POINTS as f64).cos()
}

/// Chebyshev polynomials at the interpolation points, with the weights of the discrete transform.
static POLYNOMIALS: LazyLock<[[f64; TERMS]; POINTS]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let mut terms = chebyshev(interpolation_point(i)).map(|t| t * 2.0 / POINTS as f64);
        terms[0] /= 2.0;
        terms
    })
});
