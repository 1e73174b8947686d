//! Mitsuba's `roughplastic`: a rough dielectric interface above a diffuse base, coupled through what the interface lets in and
//! out.
//!
//! `f = k_s F D G/(4 cos θ_i cos θ_o) + k_d T(cos θ_i) T(cos θ_o)/(π η² (1 − k_d F_dr))`
//!
//! with separable Smith masking (Beckmann's by Walter's rational fit), the share T that the rough interface transmits from
//! outside, and its diffuse reflectance F_dr from inside.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse_reflectance` | albedo of the base, k_d | 0.5 |
//! | `specular_reflectance` | scale of the lobe, k_s; 1 is physical | 1 |
//! | `ior` (`int_ior`) | index of refraction, inside over outside; for Mitsuba's default air divide `int_ior` by 1.000277 | 1.5 |
//! | `alpha` | width of the lobe, α | 0.1 |
//! | `distribution` | `beckmann` or `ggx` | beckmann |
//! | `nonlinear` | `true`: light that bounces below the interface takes the base's colour each time; `false`: `1 − F_dr` in place of `1 − k_d F_dr` | false |
//! | `internal` | F_dr: `mitsuba06`, all that is not transmitted, or `mitsuba3`, what is reflected | mitsuba06 |
//!
//! Source: Mitsuba 0.6 and 3, `roughplastic`, with its parameters' names and defaults but for the index, which is 1.49 there. The
//! paper's plastics are this with `ggx` and `mitsuba06`.
//!
//! Deviations: T and F_dr are integrated for each material, where Mitsuba 0.6 reads tables (up to 0.7 % off) and Mitsuba 3
//! averages over 64 nodes (F_dr 1.5 % low). In single precision T is a table of a short series: f is 5·10⁻⁴ off at the most on the conformance
//! vectors, 1 % at α = 0.001 and a cosine of 0.003; F_dr of `mitsuba3` is up to 2·10⁻³ off.
//!
//! Known defects: `mitsuba06` counts light that is lost between microfacets as reflected, so that the two readings of F_dr differ
//! by 0.60 and 0.42 at α = 0.3 (GGX, 1.5): the base is up to 44 % brighter in one.

use std::f64::consts::PI;
use std::sync::OnceLock;

use crate::conformance::Parameters;
use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::masking::Masking;
use crate::microfacet::Microfacet;
use crate::model::{Alias, Model};
use crate::models::shared::*;
use crate::parameter::{Kind, Parameter, Role};
use crate::rough_interface::{Internal, Order, RoughInterface, Transmittance, TransmittanceTable};
use crate::sampling::Technique;
use crate::{Bsdf, Geometry, Lobe, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "rough-plastic",
    title: "Rough plastic (Mitsuba)",
    summary: "Rough dielectric above a diffuse base, coupled: what the interface reflects does not reach the base.",
    reference: "Mitsuba 0.6 and 3, roughplastic; Walter et al. 2007",
    family: crate::Family::Production,
    parameters: &[
        Parameter {
            name: "diffuse_reflectance",
            role: Role::BaseColour,
            summary: "Albedo of the base below the interface, linear RGB.",
            ..DIFFUSE
        },
        Parameter { name: "specular_reflectance", ..SPECULAR_SWITCH },
        IOR,
        Parameter {
            name: "alpha",
            symbol: "α",
            summary: "Width of the lobe; the microfacet α, not squared.",
            kind: match ROUGHNESS_U.kind {
                Kind::Number { range, .. } => Kind::Number { range, default: 0.1 },
                other => other,
            },
            ..ROUGHNESS_U
        },
        choice("distribution", "D", "Distribution of microfacet normals.", &["beckmann", "ggx"]),
        choice(
            "nonlinear",
            "-",
            "Whether light between base and interface takes the base's colour at each bounce.",
            &["false", "true"],
        ),
        choice(
            "internal",
            "F_dr",
            "Diffuse reflectance from inside: all not transmitted (mitsuba06) or what is reflected (mitsuba3).",
            &["mitsuba06", "mitsuba3"],
        ),
    ],
    aliases: &[Alias { name: "int_ior", parameters: &["ior"] }],
    surveyed: &["ior", "alpha"],
    searched: &["specular_reflectance", "ior", "alpha"],
    linear: &["diffuse_reflectance", "specular_reflectance"],
    build: |v| {
        let plastic = RoughPlastic::new(
            interface(
                shape(v.choice("distribution")).unwrap_or(Shape::Beckmann),
                v.number("alpha"),
                v.number("ior"),
            ),
            v.colour("diffuse_reflectance"),
            v.colour("specular_reflectance"),
            v.choice("nonlinear") == "true",
            internal(v.choice("internal")).unwrap_or(Internal::NotTransmitted),
        );
        Box::new(plastic)
    },
    vectors: Some(("roughplastic", vector)),
    ..Model::BLANK
};

const fn choice(
    name: &'static str,
    symbol: &'static str,
    summary: &'static str,
    options: &'static [&'static str],
) -> Parameter {
    Parameter { name, symbol, role: Role::Variant, unit: "-", summary, kind: Kind::Choice { options } }
}

fn shape(name: &str) -> Option<Shape> {
    match name {
        "beckmann" => Some(Shape::Beckmann),
        "ggx" => Some(Shape::Ggx),
        _ => None,
    }
}

fn internal(name: &str) -> Option<Internal> {
    match name {
        "mitsuba06" => Some(Internal::NotTransmitted),
        "mitsuba3" => Some(Internal::Reflected),
        _ => None,
    }
}

fn interface(shape: Shape, alpha: f64, eta: f64) -> RoughInterface {
    RoughInterface { distribution: Distribution { shape, alpha: [alpha; 2] }, eta }
}

/// A rough interface above a diffuse base.
#[derive(Debug)]
pub struct RoughPlastic {
    interface: RoughInterface,
    lobe: Microfacet,
    diffuse: [f64; 3],
    nonlinear: bool,
    internal: Internal,
    fast: Base,
    /// The transmittance of `fast`.
    table: TransmittanceTable,
    /// Needed only where someone asks for double precision; a hundred times the work.
    exact: OnceLock<Base>,
}

/// The diffuse reflection: `scale T(cos θ_i) T(cos θ_o)`.
#[derive(Debug)]
struct Base {
    transmittance: Transmittance,
    scale: [f64; 3],
}

impl RoughPlastic {
    /// The plastic of an interface, with k_d and k_s.
    pub fn new(
        interface: RoughInterface,
        diffuse: [f64; 3],
        specular: [f64; 3],
        nonlinear: bool,
        internal: Internal,
    ) -> Self {
        let distribution = interface.distribution;
        let lobe = Microfacet {
            diffuse: [0.0; 3],
            specular,
            distribution,
            masking: if distribution.shape == Shape::Ggx {
                Masking::Separable
            } else {
                Masking::SeparableRational
            },
            fresnel: [Fresnel::Dielectric { eta: interface.eta }; 3],
        };
        let fast = Base::new(&interface, diffuse, nonlinear, internal, Order::FAST);
        let table = fast.transmittance.table();
        Self { interface, lobe, diffuse, nonlinear, internal, fast, table, exact: OnceLock::new() }
    }

    /// The diffuse reflection in single precision.
    #[inline(always)]
    fn base(&self, g: &Geometry<f32>) -> [f32; 3] {
        let through = self.table.at(g.cos_i()) * self.table.at(g.cos_o());
        self.fast.scale.map(|scale| scale as f32 * through)
    }

    fn exact(&self) -> &Base {
        self.exact.get_or_init(|| {
            Base::new(&self.interface, self.diffuse, self.nonlinear, self.internal, Order::EXACT)
        })
    }
}

impl Base {
    fn new(
        interface: &RoughInterface,
        diffuse: [f64; 3],
        nonlinear: bool,
        internal: Internal,
        order: Order,
    ) -> Self {
        let transmittance = Transmittance::new(interface, order);
        let reflected = interface.internal_reflectance(internal, &transmittance, order);
        let scale = diffuse.map(|kd| {
            let bounced = if nonlinear { kd * reflected } else { reflected };
            kd / (PI * interface.eta * interface.eta * (1.0 - bounced))
        });
        Self { transmittance, scale }
    }
}

impl Bsdf for RoughPlastic {
    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    fn specular(&self, g: &Geometry<f64>) -> [f64; 3] {
        let (lobe, base) = (Lobe::specular(&self.lobe, g), self.exact());
        let through = base.transmittance.at(g.cos_i()) * base.transmittance.at(g.cos_o());
        std::array::from_fn(|c| lobe[c] + base.scale[c] * through)
    }

    fn specular_f32(&self, g: &Geometry<f32>) -> [f32; 3] {
        let (lobe, base) = (Lobe::specular(&self.lobe, g), self.base(g));
        std::array::from_fn(|c| lobe[c] + base[c])
    }

    fn specular_all(&self, geometries: &[Geometry<f32>]) -> Vec<[f32; 3]> {
        // Two simple loops are faster than one.
        let mut all = Bsdf::specular_all(&self.lobe, geometries);
        for (f, g) in all.iter_mut().zip(geometries) {
            let base = self.base(g);
            (0..3).for_each(|c| f[c] += base[c]);
        }
        all
    }

    fn sampling(&self) -> Option<Sampling> {
        let at_normal = self.lobe.fresnel[0].reflectance(1.0f64);
        let lobe = self.lobe.specular.into_iter().sum::<f64>() * at_normal;
        let through = self.fast.transmittance.at(1.0).powi(2);
        let base = self.fast.scale.into_iter().sum::<f64>() * PI * through;
        Sampling::mixture([(lobe, Technique::HalfVector(self.lobe.distribution)), (base, Technique::Cosine)])
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    Some(Box::new(RoughPlastic::new(
        interface(shape(p.text("dist")?)?, p.number("alpha")?, p.number("eta")?),
        [p.number("kd")?; 3],
        [p.number_or("ks", 1.0)?; 3],
        p.flag("nonlinear")?,
        internal(p.text("internal").unwrap_or("mitsuba06"))?,
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;

    /// Directional albedo of the base, by the midpoint rule in cos² θ.
    fn base_albedo(text: &str, cos_o: f64) -> f64 {
        let bsdf = Material::parse(text).unwrap().bsdf();
        let wo = [(1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o];
        let n = 500;
        (0..n)
            .map(|k| {
                let u = (f64::from(k) + 0.5) / f64::from(n);
                PI * bsdf.evaluate([0.0, (1.0 - u).sqrt(), u.sqrt()], wo)[0] / f64::from(n)
            })
            .sum()
    }

    #[test]
    fn a_white_base_returns_what_the_interface_lets_in() {
        for distribution in ["ggx", "beckmann"] {
            for cos_o in [0.1, 0.6, 1.0] {
                let text = format!(
                    "rough-plastic:distribution={distribution},alpha=0.3,diffuse_reflectance=1,specular_reflectance=0"
                );
                let shape = shape(distribution).unwrap();
                let through = interface(shape, 0.3, 1.5).transmittance(cos_o, Order::EXACT);
                let albedo = base_albedo(&text, cos_o);
                assert!((albedo - through).abs() < 1e-3, "{distribution} {cos_o}: {albedo} {through}");
                assert!(base_albedo(&format!("{text},internal=mitsuba3"), cos_o) < through);
            }
        }
    }
}
