//! The microfacet ABC model of Löw *et al.* (2012), *BRDF Models for Accurate and Efficient Rendering of Glossy Surfaces*,
//! eq. 15, beside a Lambert term: the model of which the MERL materials have published fits.
//!
//! `f = k_d/π + F(cos_d) G S/(N cos θ_i cos θ_o)` with `S = A/(1 + B (1 − cos θ_h))^C`, the exact dielectric Fresnel reflectance,
//! and the V-groove `G = min(1, 2 cos θ_h cos θ_o/cos_d, 2 cos θ_h cos θ_i/cos_d)` of Cook & Torrance.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the Lambert term, k_d | 0.5 |
//! | `a` | height of the lobe, A, per channel; not normalised | 50 |
//! | `b` | narrowness of its core, B, about `2/α²` | 2000 |
//! | `c` | fall of its tail, C: 2 is about GGX's, less is longer | 1.5 |
//! | `ior` | index of refraction; fits have up to 99.9996 | 1.5 |
//! | `norm` | N: `pi` (π; what the published fits need) or `none` (1; what eq. 15 prints) | pi |
//!
//! Presets: Löw's fits of all 100 MERL materials (logarithmic metric E2), by the materials' names.
//!
//! Known defects: A is not tied to B and C, so that parameters can reflect more light than arrives. Some fits use the index as
//! a free parameter: 99.99 stands for a mirror, not for a substance.

use std::f64::consts::PI;

use crate::conformance::Parameters;
use crate::distribution::{Distribution, Shape};
use crate::fresnel::Fresnel;
use crate::masking::v_groove;
use crate::model::Model;
use crate::models::shared::*;
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};
use crate::presets;
use crate::sampling::Technique;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "low-abc",
    title: "Löw ABC (microfacet)",
    summary: "Microfacets with a freely falling tail above a Lambert term; has fits of all MERL materials.",
    reference: "Löw et al. 2012, eq. 15",
    largest_albedo: 1e4,
    parameters: &[
        DIFFUSE,
        A,
        B,
        C,
        IOR,
        Parameter {
            name: "norm",
            symbol: "N",
            role: Role::Variant,
            unit: "-",
            summary: "Divisor of the lobe: pi (the published fits) or none (as eq. 15 prints it).",
            kind: Kind::Choice { options: &["pi", "none"] },
        },
    ],
    surveyed: &["ior", "b"],
    searched: &["a", "b"],
    linear: &["diffuse", "a"],
    presets: presets::low_abc,
    build: |v| {
        Box::new(LowAbc {
            diffuse: v.colour("diffuse"),
            height: v.colour("a").map(|a| if v.choice("norm") == "none" { a } else { a / PI }),
            core: v.number("b"),
            tail: v.number("c"),
            fresnel: Fresnel::Dielectric { eta: v.number("ior") },
        })
    },
    vectors: Some(("low_microfacet", vector)),
    ..Model::BLANK
};

/// Height of an ABC lobe.
pub(super) const A: Parameter = Parameter {
    name: "a",
    symbol: "A",
    role: Role::LobeHeight,
    unit: "1",
    summary: "Height of the lobe, per channel; not normalised.",
    kind: Kind::Colour {
        range: Range {
            valid: Interval::closed(0.0, 1e6),
            plausible: Interval::closed(0.05, 6000.0),
            scale: Scale::Logarithmic,
            search: Levels::new(0.05, 6000.0, 1.2),
            survey: Levels::new(0.1, 6000.0, 2.0),
        },
        default: [50.0; 3],
    },
};

/// Narrowness of an ABC lobe.
pub(super) const B: Parameter = Parameter {
    name: "b",
    symbol: "B",
    role: Role::Exponent,
    unit: "1",
    summary: "Narrowness of the lobe's core.",
    kind: Kind::Number {
        range: Range {
            valid: Interval::open_below(0.0, 1e8),
            plausible: Interval::closed(5.0, 1e7),
            scale: Scale::Logarithmic,
            search: Levels::new(5.0, 1e6, 1.2),
            // With the default height, these reflect a few parts in a thousand to half of the light.
            survey: Levels::new(100.0, 1e5, 1.5),
        },
        default: 2000.0,
    },
};

/// Tail of an ABC lobe.
pub(super) const C: Parameter = Parameter {
    name: "c",
    symbol: "C",
    role: Role::LobeShape,
    unit: "1",
    summary: "Fall of the lobe's tail; less is longer.",
    kind: Kind::Number {
        range: Range {
            valid: Interval::open_below(0.0, 20.0),
            plausible: Interval::closed(0.01, 3.0),
            scale: Scale::Linear,
            search: Levels::new(0.1, 3.0, 0.1),
            survey: Levels::new(0.5, 2.5, 0.5),
        },
        default: 1.5,
    },
};

/// Löw's microfacet lobe with a Lambert term.
#[derive(Clone, Copy, Debug)]
pub struct LowAbc {
    /// Albedo of the Lambert term per channel.
    pub diffuse: [f64; 3],
    /// A over its divisor per channel.
    pub height: [f64; 3],
    /// B, above 0.
    pub core: f64,
    /// C, above 0.
    pub tail: f64,
    /// Fresnel reflectance.
    pub fresnel: Fresnel,
}

impl Lobe for LowAbc {
    fn diffuse(&self) -> [f64; 3] {
        self.diffuse
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let shape = abc(g.versine_h(), self.core, self.tail);
        let lobe = self.fresnel.reflectance(g.cos_d) * v_groove(g) * shape / (g.cos_i() * g.cos_o());
        self.height.map(|a| T::of(a) * lobe)
    }

    fn sampling(&self) -> Option<Sampling> {
        if self.height == [0.0; 3] { None } else { rings(self.core, self.tail) }
    }
}

/// `1/(1 + B x)^C`.
#[inline(always)]
pub(super) fn abc<T: Real>(x: T, core: f64, tail: f64) -> T {
    (-T::of(tail) * (T::of(core) * x).ln_1p()).exp()
}

/// Draws from a lobe `1/(1 + B (1 − cos θ_h))^C` as from GGX lobes of growing width, each with the share of the light that
/// the lobe scatters between its width and the last one's: a tail falls off too slowly for one of them.
pub(super) fn rings(core: f64, tail: f64) -> Option<Sampling> {
    let narrowest = (2.0 / core).sqrt().min(1.0);
    let widths = std::iter::successors(Some(narrowest), |w| (*w < 1.0).then_some((3.0 * w).min(1.0)));
    // ∫ du/(1 + B u)^C from 0 to u = 1 − cos θ_h.
    let within = |u: f64| match 1.0 - tail {
        rest if rest.abs() < 1e-6 => (core * u).ln_1p(),
        rest => (rest * (core * u).ln_1p()).exp_m1() / rest,
    };
    let total = within(1.0);
    let mut last = 0.0;
    Sampling::mixture(widths.filter_map(|alpha| {
        let so_far = if alpha < 1.0 { within(1.0 - (1.0 + alpha * alpha).sqrt().recip()) } else { total };
        // A ring with hardly any light goes with the next one, lest a core that no one sees decides the width of the lobe.
        let share = (so_far - last) / total;
        if share < 0.02 && alpha < 1.0 {
            return None;
        }
        last = so_far;
        let distribution = Distribution { shape: Shape::Ggx, alpha: [alpha; 2] };
        Some((share.max(1e-3), Technique::HalfVector(distribution)))
    }))
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let divisor = match p.text("norm").unwrap_or("pi") {
        "pi" => PI,
        "none" => 1.0,
        _ => return None,
    };
    Some(Box::new(LowAbc {
        diffuse: [p.number_or("kd", 0.0)?; 3],
        height: [p.number("A")? / divisor; 3],
        core: p.number("B")?,
        tail: p.number("C")?,
        fresnel: Fresnel::Dielectric { eta: p.number("eta")? },
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;

    #[test]
    fn the_two_divisors_differ_by_pi() {
        let value = |norm: &str| {
            let text = format!("low-abc:diffuse=0,norm={norm}");
            Material::parse(&text).unwrap().bsdf().evaluate([0.6, 0.0, 0.8], [-0.5, 0.1, 0.74f64.sqrt()])[0]
        };
        assert!((value("none") / value("pi") - PI).abs() < 1e-12);
    }

    #[test]
    fn the_shares_of_the_rings_are_a_whole() {
        for (core, tail) in [(2.0, 0.5), (11.2, 0.02), (8e6, 1.0), (2e5, 2.7)] {
            let sum: f64 = rings(core, tail).unwrap().parts().iter().map(|(share, _)| share).sum();
            assert!((sum - 1.0).abs() < 1e-12);
        }
    }
}
