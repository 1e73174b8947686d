//! Blinn–Phong: a power of the half vector's cosine, in its four usual normalisations, beside a Lambert term.
//!
//! With `D = (n + 2)/(2π) cosⁿ θ_h`, which satisfies `∫ D cos θ_h dω = 1`:
//!
//! | variant | f | source |
//! |---|---|---|
//! | `exact` | `k_s (n + 2)(n + 4)/(8π (2^(−n/2) + n)) cosⁿ θ_h` | Giesen 2009, *Phong and Blinn-Phong normalization factors* |
//! | `rtr` | `k_s (n + 8)/(8π) cosⁿ θ_h` | Akenine-Möller *et al.* 2008, *Real-Time Rendering*, 3rd ed., 7.6 |
//! | `ndf` | `k_s D/(4 cos θ_i cos θ_o)` | D as a microfacet distribution, no masking |
//! | `vgroove` | `k_s D G/(4 cos θ_i cos θ_o)` | the same with the masking of Torrance & Sparrow (1967), which Blinn (1977) took |
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the Lambert term, k_d | 0.5 |
//! | `specular` | reflectance of the lobe, k_s | 0.1 |
//! | `exponent` | n; about four times that of a Phong lobe of the same width | 100 |
//! | `variant` | normalisation | exact |
//!
//! `exact` is the default because there `specular` is the reflectance at normal incidence itself, for every exponent, and no
//! light is created at other angles. `rtr` is its simpler approximation: within 0.2 % from n = 1000 on, but up to 7.5 % too
//! bright below.
//!
//! Presets `ngan-NAME` are Ngan *et al.*'s fits (2005), stated for `k_s (n + 2)/(2π) cosⁿ θ_h`, as `rtr` with their k_s times
//! `4 (n + 2)/(n + 8)`.
//!
//! Known defects: no Fresnel effect. `exact` and `rtr` lose the square of the cosine towards grazing angles; `ndf` creates
//! energy there without bound.

use crate::conformance::Parameters;
use crate::distribution::{Distribution, Shape};
use crate::masking::v_groove;
use crate::model::Model;
use crate::models::shared::*;
use crate::parameter::{Kind, Parameter, Role};
use crate::presets;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "blinn-phong",
    title: "Blinn-Phong",
    summary: "Power of the half vector's cosine without Fresnel effect; exactly normalised by default.",
    reference: "Blinn 1977; Giesen 2009; Akenine-Möller et al. 2008",
    has_fresnel: false,
    // The default variant's lobe alone stays below 1; the others' do not.
    largest_albedo: 1.4,
    parameters: &[
        DIFFUSE,
        SPECULAR,
        exponent("exponent", "n", "Power of the cosine between the half vector and the normal."),
        Parameter {
            name: "variant",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "Normalisation: exact, rtr (its approximation), ndf or vgroove (microfacets).",
            kind: Kind::Choice { options: &["exact", "rtr", "ndf", "vgroove"] },
        },
    ],
    surveyed: &["specular", "exponent"],
    searched: &["specular", "exponent"],
    linear: &["diffuse", "specular"],
    presets: presets::blinn_phong,
    build: |v| {
        let variant = variant(v.choice("variant")).unwrap_or(Variant::Exact);
        Box::new(BlinnPhong::new(v.colour("diffuse"), v.colour("specular"), v.number("exponent"), variant))
    },
    vectors: Some(("blinn_phong", vector)),
    ..Model::BLANK
};

/// Which normalisation of the lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// Albedo k_s at normal incidence.
    Exact,
    /// The approximation of *Real-Time Rendering*.
    RealTimeRendering,
    /// Microfacets without masking.
    Unmasked,
    /// Microfacets in V-grooves.
    VGroove,
}

fn variant(name: &str) -> Option<Variant> {
    match name {
        "exact" => Some(Variant::Exact),
        "rtr" => Some(Variant::RealTimeRendering),
        "ndf" => Some(Variant::Unmasked),
        "vgroove" => Some(Variant::VGroove),
        _ => None,
    }
}

/// Blinn's lobe with a Lambert term.
#[derive(Clone, Copy, Debug)]
pub struct BlinnPhong {
    diffuse: [f64; 3],
    /// Scale of D per channel.
    scale: [f64; 3],
    distribution: Distribution,
    variant: Variant,
}

impl BlinnPhong {
    /// A lobe of reflectance `specular` with an exponent of 0 or more.
    pub fn new(diffuse: [f64; 3], specular: [f64; 3], exponent: f64, variant: Variant) -> Self {
        let n = exponent;
        let over_d = match variant {
            Variant::Exact => (n + 4.0) / (4.0 * ((-n / 2.0).exp2() + n)),
            Variant::RealTimeRendering => (n + 8.0) / (4.0 * (n + 2.0)),
            Variant::Unmasked | Variant::VGroove => 0.25,
        };
        let alpha = (2.0 / (n + 2.0)).sqrt();
        Self {
            diffuse,
            scale: specular.map(|s| s * over_d),
            distribution: Distribution { shape: Shape::Phong, alpha: [alpha; 2] },
            variant,
        }
    }
}

impl Lobe for BlinnPhong {
    fn diffuse(&self) -> [f64; 3] {
        self.diffuse
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let density = self.distribution.density(g);
        let lobe = match self.variant {
            Variant::Exact | Variant::RealTimeRendering => density,
            Variant::Unmasked => density / (g.cos_i() * g.cos_o()),
            Variant::VGroove => density * v_groove(g) / (g.cos_i() * g.cos_o()),
        };
        self.scale.map(|s| T::of(s) * lobe)
    }

    fn sampling(&self) -> Option<Sampling> {
        (self.scale != [0.0; 3]).then(|| Sampling::half_vector(self.distribution))
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let diffuse = [p.number_or("kd", 0.0)?; 3];
    Some(Box::new(BlinnPhong::new(
        diffuse,
        [p.number("ks")?; 3],
        p.number("n")?,
        variant(p.text("variant")?)?,
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// Albedo at normal incidence, where the half vector has half the light's angle.
    fn albedo(variant: Variant, n: f64) -> f64 {
        let lobe = BlinnPhong::new([0.0; 3], [1.0; 3], n, variant);
        let nodes = 4000;
        (0..nodes)
            .map(|k| {
                let t = (f64::from(k) + 0.5) / f64::from(nodes);
                let cos = 1.0 - t.powi(4);
                let f = lobe.evaluate([(1.0 - cos * cos).sqrt(), 0.0, cos], [0.0, 0.0, 1.0]);
                TAU * f[0] * cos * 4.0 * t.powi(3) / f64::from(nodes)
            })
            .sum()
    }

    #[test]
    fn the_exact_albedo_at_normal_incidence_is_one_and_the_usual_one_is_near() {
        for n in [0.0, 1.0, 10.0, 1000.0] {
            let (exact, usual) = (albedo(Variant::Exact, n), albedo(Variant::RealTimeRendering, n));
            assert!((exact - 1.0).abs() < 1e-5, "n = {n}: {exact}");
            assert!((0.99..1.08).contains(&usual), "n = {n}: {usual}");
        }
    }

    #[test]
    fn microfacet_variants_meet_at_normal_incidence() {
        let value = |variant| {
            BlinnPhong::new([0.0; 3], [1.0; 3], 50.0, variant).evaluate([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])[0]
        };
        assert_eq!(value(Variant::Unmasked), value(Variant::VGroove));
        assert!((value(Variant::Unmasked) - 52.0 / (8.0 * PI)).abs() < 1e-12);
    }
}
