//! The MERL measurements (Matusik *et al.* 2003), each as the small neural network that Sztrajman *et al.* (2021, 3) fitted to it.
//!
//! With Rusinkiewicz's half vector (azimuth 0) and difference vector, `x = (sin θ_h, 0, cos θ_h, d_x, d_y, d_z)`:
//!
//! `f = max(exp(W₃ᵀ a₂ + b₃) − 1, 0)`, `a₂ = max(W₂ᵀ a₁ + b₂, 0)`, `a₁ = max(W₁ᵀ x + b₁, 0)`
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `material` | which of the 100 | alum-bronze |
//! | `part` | `whole`, or `diffuse`: a Lambert term in its place | whole |
//!
//! A measurement has no diffuse term that could be taken alone. `part=diffuse` is the brightest Lambert term that nowhere
//! exceeds the network within 60° of the normal, per channel: for the 48 materials whose diffuse albedo in the fits of Low
//! *et al.* (2012) is above 0.05, between 0.80 and 1.17 times that, 0.95 in the median.
//!
//! Known defects: the networks are fits; lobes of mirrors have a cusp on top, and what is said beyond 80° is mostly
//! extrapolated. They are reciprocal and bilaterally symmetric only about as well as they fit: with light and viewer up to 80°
//! from the normal, swapping them changes a value by 1.6 % (the median over directions of the median material; 6 % for one in
//! ten, 35 % at worst: grease-covered-steel), and mirroring the light in the plane of the viewer by 1 % (4 %; 52 %: brass). The
//! directional albedo stays below 0.61 up to 80°; at cos θ = 0.01 that of polyethylene is 1.04 and all others are below 1. Where
//! light and viewer mirror each other exactly, the half vector has no azimuth and the light's is taken.

use std::sync::{LazyLock, OnceLock};

use crate::model::{Family, Model, Preset, Values};
use crate::models::lambert::Lambert;
use crate::models::measured::{difference, lambert_below, sampling};
use crate::parameter::{Kind, Parameter, Role};
use crate::{Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "merl",
    title: "MERL (neural)",
    summary: "One of the 100 measured materials of the MERL database, as a compact neural network.",
    reference: "Matusik et al. 2003; Sztrajman et al. 2021, Neural BRDF Representation and Importance Sampling",
    family: Family::Measured,
    has_fresnel: true,
    is_reciprocal: false,
    largest_albedo: 1.05,
    parameters: &[Parameter {
        name: "material",
        symbol: "-",
        role: Role::Measurement,
        unit: "-",
        summary: "Name of the measured material.",
        kind: Kind::Choice { options: MATERIALS },
    }],
    presets: || &PRESETS,
    diffuse_only: Some(|v| Box::new(Lambert { diffuse: fit(v).lambert() })),
    build: |v| Box::new(fit(v)),
    ..Model::BLANK
};

fn fit(v: &Values) -> &'static Fit {
    let index = MATERIALS.iter().position(|m| *m == v.choice("material")).unwrap_or(0);
    &FITS[index]
}

/// The materials, in the order of their networks.
const MATERIALS: &[&str] = &[
    "alum-bronze",
    "alumina-oxide",
    "aluminium",
    "aventurnine",
    "beige-fabric",
    "black-fabric",
    "black-obsidian",
    "black-oxidized-steel",
    "black-phenolic",
    "black-soft-plastic",
    "blue-acrylic",
    "blue-fabric",
    "blue-metallic-paint",
    "blue-metallic-paint2",
    "blue-rubber",
    "brass",
    "cherry-235",
    "chrome",
    "chrome-steel",
    "colonial-maple-223",
    "color-changing-paint1",
    "color-changing-paint2",
    "color-changing-paint3",
    "dark-blue-paint",
    "dark-red-paint",
    "dark-specular-fabric",
    "delrin",
    "fruitwood-241",
    "gold-metallic-paint",
    "gold-metallic-paint2",
    "gold-metallic-paint3",
    "gold-paint",
    "gray-plastic",
    "grease-covered-steel",
    "green-acrylic",
    "green-fabric",
    "green-latex",
    "green-metallic-paint",
    "green-metallic-paint2",
    "green-plastic",
    "hematite",
    "ipswich-pine-221",
    "light-brown-fabric",
    "light-red-paint",
    "maroon-plastic",
    "natural-209",
    "neoprene-rubber",
    "nickel",
    "nylon",
    "orange-paint",
    "pearl-paint",
    "pickled-oak-260",
    "pink-fabric",
    "pink-fabric2",
    "pink-felt",
    "pink-jasper",
    "pink-plastic",
    "polyethylene",
    "polyurethane-foam",
    "pure-rubber",
    "purple-paint",
    "pvc",
    "red-fabric",
    "red-fabric2",
    "red-metallic-paint",
    "red-phenolic",
    "red-plastic",
    "red-specular-plastic",
    "silicon-nitrade",
    "silver-metallic-paint",
    "silver-metallic-paint2",
    "silver-paint",
    "special-walnut-224",
    "specular-black-phenolic",
    "specular-blue-phenolic",
    "specular-green-phenolic",
    "specular-maroon-phenolic",
    "specular-orange-phenolic",
    "specular-red-phenolic",
    "specular-violet-phenolic",
    "specular-white-phenolic",
    "specular-yellow-phenolic",
    "ss440",
    "steel",
    "teflon",
    "tungsten-carbide",
    "two-layer-gold",
    "two-layer-silver",
    "violet-acrylic",
    "violet-rubber",
    "white-acrylic",
    "white-diffuse-bball",
    "white-fabric",
    "white-fabric2",
    "white-marble",
    "white-paint",
    "yellow-matte-plastic",
    "yellow-paint",
    "yellow-phenolic",
    "yellow-plastic",
];

static PRESETS: LazyLock<Vec<Preset>> = LazyLock::new(|| {
    let preset = |name: &&str| Preset {
        name: (*name).to_owned(),
        source: "MERL BRDF database (CC-BY-SA-4.0), network of Sztrajman et al. 2021 (MIT)",
        values: vec![("material", (*name).to_owned())],
    };
    MATERIALS.iter().map(preset).collect()
});

/// Neurons of each hidden layer.
const NEURONS: usize = 21;
/// The same, filled up with neurons that are always 0, for registers of four and eight numbers.
const LANES: usize = 24;

/// One material's network. The weight of the input that is always 0, h_y, is left out.
struct Network {
    /// For sin θ_h, cos θ_h and the difference vector.
    first: [[f32; LANES]; 5],
    first_bias: [f32; LANES],
    second: [[f32; LANES]; NEURONS],
    second_bias: [f32; LANES],
    /// One row per colour channel.
    third: [[f32; LANES]; 3],
    third_bias: [f32; 3],
}

/// A network, with what follows from it alone.
struct Fit {
    network: Network,
    lambert: OnceLock<[f64; 3]>,
    sampling: OnceLock<Option<Sampling>>,
}

static FITS: LazyLock<Vec<Fit>> = LazyLock::new(|| {
    let bytes = include_bytes!("../../presets/merl_nbrdf.f32le");
    let weights: Vec<f32> = bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let fit =
        |weights| Fit { network: Network::new(weights), lambert: OnceLock::new(), sampling: OnceLock::new() };
    weights.chunks_exact(weights.len() / MATERIALS.len()).map(fit).collect()
});

impl Network {
    /// Reads W₁ (6 × 21), b₁, W₂ (21 × 21), b₂, W₃ (21 × 3), b₃.
    fn new(weights: &[f32]) -> Self {
        let (inputs, rest) = weights.split_at(6 * NEURONS);
        let (first_bias, rest) = rest.split_at(NEURONS);
        let (second, rest) = rest.split_at(NEURONS * NEURONS);
        let (second_bias, rest) = rest.split_at(NEURONS);
        let (third, third_bias) = rest.split_at(NEURONS * 3);
        let row = |all: &[f32], k: usize| widened(&all[k * NEURONS..][..NEURONS]);
        Self {
            first: [0, 2, 3, 4, 5].map(|input| row(inputs, input)),
            first_bias: widened(first_bias),
            second: std::array::from_fn(|k| row(second, k)),
            second_bias: widened(second_bias),
            third: std::array::from_fn(|c| {
                widened(&std::array::from_fn::<_, NEURONS, _>(|k| third[3 * k + c]))
            }),
            third_bias: std::array::from_fn(|c| third_bias[c]),
        }
    }

    #[inline(always)]
    fn evaluate<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let sin_h = (g.tan2_h[0] + g.tan2_h[1]).sqrt() * g.cos_h;
        let [x, y, z] = difference(g);
        let a1 = layer(&[sin_h, g.cos_h, x, y, z], &self.first, &self.first_bias);
        let a2 = layer(&a1[..NEURONS], &self.second, &self.second_bias);
        std::array::from_fn(|c| {
            let exponent = of::<T>(self.third_bias[c]) + dot(&a2, &self.third[c]);
            (exponent.exp() - T::one()).max(T::zero())
        })
    }
}

/// A hidden layer: `max(Wᵀ x + b, 0)`.
#[inline(always)]
fn layer<T: Real>(inputs: &[T], weights: &[[f32; LANES]], bias: &[f32; LANES]) -> [T; LANES] {
    let mut sums = bias.map(of::<T>);
    for (input, row) in inputs.iter().zip(weights) {
        for k in 0..LANES {
            sums[k] = sums[k] + *input * of(row[k]);
        }
    }
    sums.map(|v| if v > T::zero() { v } else { T::zero() })
}

/// A scalar product in eight sums that do not wait for each other.
#[inline(always)]
fn dot<T: Real>(a: &[T; LANES], b: &[f32; LANES]) -> T {
    let mut sums = [T::zero(); 8];
    for start in (0..LANES).step_by(8) {
        for k in 0..8 {
            sums[k] = sums[k] + a[start + k] * of(b[start + k]);
        }
    }
    sums.into_iter().fold(T::zero(), |sum, v| sum + v)
}

#[inline(always)]
fn of<T: Real>(weight: f32) -> T {
    T::of(f64::from(weight))
}

/// A row filled up with zeros.
fn widened(row: &[f32]) -> [f32; LANES] {
    std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0))
}

impl Fit {
    /// See [`lambert_below`].
    fn lambert(&self) -> [f64; 3] {
        *self.lambert.get_or_init(|| lambert_below(&|g| self.network.evaluate(g)))
    }
}

impl Lobe for &'static Fit {
    fn is_mirror_symmetric(&self) -> bool {
        false
    }

    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        self.network.evaluate(g)
    }

    fn sampling(&self) -> Option<Sampling> {
        self.sampling.get_or_init(|| sampling(&|g| self.network.evaluate(g), self.lambert())).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bsdf, Material};

    fn material(name: &str) -> Box<dyn Bsdf> {
        Material::named(&format!("merl@{name}")).unwrap().bsdf()
    }

    #[test]
    fn networks_have_their_published_values() {
        let up = [0.0, 0.0, 1.0];
        for (name, expected) in
            [("gold-metallic-paint", [0.456, 0.344, 0.126]), ("red-plastic", [0.102, 0.032, 0.022])]
        {
            let f = material(name).evaluate(up, up);
            assert!((0..3).all(|c| (f[c] - expected[c]).abs() < 5e-4), "{name}: {f:?}");
        }
    }

    fn direction(cos: f64, phi: f64) -> [f64; 3] {
        let sin = (1.0 - cos * cos).sqrt();
        [sin * phi.cos(), sin * phi.sin(), cos]
    }

    #[test]
    fn values_agree_with_a_second_program() {
        // The same networks through numpy's matrix products, in double precision.
        let cases = [
            (
                "brass",
                (0.7, 2.9),
                (0.8, 0.1),
                [0.0581246570513696, 0.05205112905740261, 0.034312066584352596],
            ),
            (
                "blue-fabric",
                (0.3, 4.0),
                (0.6, 1.0),
                [0.032159676653314095, 0.03498615593696286, 0.06174358655547052],
            ),
            (
                "chrome",
                (0.9, 3.0),
                (0.88, -0.15),
                [1.0993898025893132, 0.7954368629636983, 0.7195426431885676],
            ),
        ];
        for (name, (cos_i, phi_i), (cos_o, phi_o), expected) in cases {
            let (wi, wo) = (direction(cos_i, phi_i), direction(cos_o, phi_o));
            let (exact, fast) = (material(name).evaluate(wi, wo), material(name).evaluate_f32(wi, wo));
            for c in 0..3 {
                assert!((exact[c] - expected[c]).abs() < 1e-12 * expected[c], "{name}: {exact:?}");
                assert!((f64::from(fast[c]) - expected[c]).abs() < 2e-5 * expected[c], "{name}: {fast:?}");
            }
        }
    }

    #[test]
    fn the_diffuse_part_is_a_lambert_term() {
        let whole = Material::named("merl@red-plastic").unwrap();
        let diffuse = whole.diffuse_bsdf();
        assert!(whole.bsdf().diffuse() == [0.0; 3] && diffuse.sampling().is_none());
        let (wi, wo) = (direction(0.9, 0.0), direction(0.6, 0.5));
        let (all, part) = (whole.bsdf().evaluate(wi, wo), diffuse.evaluate(wi, wo));
        assert!((0..3).all(|c| 0.0 < part[c] && part[c] < all[c]), "{part:?} {all:?}");
    }

    #[test]
    fn every_network_is_complete() {
        assert_eq!(FITS.len(), MATERIALS.len());
        assert_eq!(include_bytes!("../../presets/merl_nbrdf.f32le").len(), 100 * 675 * 4);
    }
}
