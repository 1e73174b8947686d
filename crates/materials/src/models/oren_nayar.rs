//! Oren–Nayar: diffuse reflection of a rough surface made of Lambertian facets, in its four usual forms.
//!
//! With α the larger and β the smaller of the two polar angles, φ the difference of azimuths, `s = ω_i·ω_o − cos θ_i cos θ_o`,
//! and `t = max(cos θ_i, cos θ_o)` where s > 0, else 1:
//!
//! | variant | f | roughness | source |
//! |---|---|---|---|
//! | `qualitative` | `ρ/π (A + B max(0, cos φ) sin α tan β)` | `sigma` | Oren & Nayar 1994, qualitative model |
//! | `full` | `ρ/π (C₁ + cos φ C₂ tan β + (1 − |cos φ|) C₃ tan((α + β)/2))`, and a second bounce | `sigma` | the same, functional approximation |
//! | `fujii` | `ρ (1 + r s/t)/(π + (π/2 − 2/3) r)` | `roughness` | Fujii, *A tiny improvement of Oren–Nayar* |
//! | `eon` | the same with light of all further bounces | `roughness` | Portsmouth *et al.* 2025, *EON* |
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the facets, ρ | 0.5 |
//! | `sigma` | standard deviation of the facets' angles, radians; read by `qualitative` and `full` | 0.35 (20°) |
//! | `roughness` | r, 0 to 1; read by `fujii` and `eon` | 0.5 |
//! | `variant` | the form | qualitative |
//!
//! Both are Lambert's at 0. `qualitative` is the default because renderers mean it by this name; `eon` is the one to prefer
//! where energy matters: a white surface reflects all light at every roughness.
//!
//! Deviations: `full` is not let below 0, which it reaches at opposite grazing angles from σ = 0.67 on. Directional albedos of
//! `eon` are the exact ones, not their polynomial approximation.
//!
//! Known defects: `qualitative` and `full` darken with σ (at normal incidence to 0.70 and 0.84 of ρ = 1 for σ = 0.7) and exceed an
//! albedo of 1 at grazing angles, by 1 % and 4 % at most; `qualitative` has an edge where cos φ changes its sign.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use crate::conformance::Parameters;
use crate::model::Model;
use crate::models::shared::DIFFUSE;
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};
use crate::sampling::Technique;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "oren-nayar",
    title: "Oren–Nayar",
    summary: "Diffuse reflection of rough surfaces: plaster, clay, cloth, the moon.",
    reference: "Oren & Nayar 1994; Fujii; Portsmouth et al. 2025",
    has_fresnel: false,
    largest_albedo: 1.05,
    parameters: &[
        Parameter { role: Role::BaseColour, summary: "Albedo of the facets, linear RGB.", ..DIFFUSE },
        Parameter {
            name: "sigma",
            symbol: "σ",
            role: Role::DiffuseRoughness,
            unit: "rad",
            summary: "Standard deviation of the facets' angles, for the variants qualitative and full.",
            kind: Kind::Number {
                range: Range {
                    valid: Interval::closed(0.0, FRAC_PI_2),
                    plausible: Interval::closed(0.0, 0.8),
                    scale: Scale::Linear,
                    search: Levels::new(0.0, 1.0, 0.02),
                    survey: Levels::new(0.0, 0.8, 0.05),
                },
                default: 0.35,
            },
        },
        Parameter {
            name: "roughness",
            symbol: "r",
            role: Role::DiffuseRoughness,
            unit: "1",
            summary: "Roughness from 0 to 1, for the variants fujii and eon.",
            kind: Kind::Number {
                range: Range {
                    valid: Interval::closed(0.0, 1.0),
                    plausible: Interval::closed(0.0, 1.0),
                    scale: Scale::Linear,
                    search: Levels::new(0.0, 1.0, 0.02),
                    survey: Levels::new(0.0, 1.0, 0.05),
                },
                default: 0.5,
            },
        },
        Parameter {
            name: "variant",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "Form: qualitative and full (read sigma), fujii and eon (read roughness).",
            kind: Kind::Choice { options: &["qualitative", "full", "fujii", "eon"] },
        },
    ],
    surveyed: &["diffuse", "sigma"],
    searched: &["diffuse", "sigma"],
    build: |v| {
        let variant = variant(v.choice("variant")).unwrap_or(Variant::Qualitative);
        let roughness = v.number(if variant.reads_sigma() { "sigma" } else { "roughness" });
        Box::new(OrenNayar::new(v.colour("diffuse"), variant, roughness))
    },
    vectors: Some(("oren_nayar", vector)),
    ..Model::BLANK
};

/// Which form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// The article's simplified form.
    Qualitative,
    /// The article's functional approximation, with interreflection.
    Full,
    /// Fujii's reformulation.
    Fujii,
    /// The energy-preserving form.
    Eon,
}

impl Variant {
    fn reads_sigma(self) -> bool {
        matches!(self, Self::Qualitative | Self::Full)
    }
}

fn variant(name: &str) -> Option<Variant> {
    match name {
        "qualitative" => Some(Variant::Qualitative),
        "full" => Some(Variant::Full),
        "fujii" => Some(Variant::Fujii),
        "eon" => Some(Variant::Eon),
        _ => None,
    }
}

/// A rough surface of Lambertian facets.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    /// Albedo of the facets per channel.
    colour: [f64; 3],
    form: Form,
}

/// A form with what it makes of the roughness.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// A and B.
    Qualitative { a: f64, b: f64 },
    /// Factors of C₁, C₂, C₃ and of the second bounce.
    Full { c1: f64, c2: f64, c3: f64, second: f64 },
    /// r, `1/(π + (π/2 − 2/3) r)`, and further bounces.
    Fujii { r: f64, scale: f64, further: Option<Further> },
}

/// What EON adds to Fujii's form.
#[derive(Clone, Copy, Debug)]
struct Further {
    /// Light of further bounces per channel, over `(1 − E(ω_i))(1 − E(ω_o))`.
    scale: [f64; 3],
}

impl OrenNayar {
    /// A surface of a colour, with σ in radians or r, as the form has it.
    pub fn new(colour: [f64; 3], variant: Variant, roughness: f64) -> Self {
        let (r, s2) = (roughness, roughness * roughness);
        let c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
        let form = match variant {
            Variant::Qualitative => Form::Qualitative { a: c1, b: 0.45 * s2 / (s2 + 0.09) },
            Variant::Full => Form::Full {
                c1,
                c2: 0.45 * s2 / (s2 + 0.09),
                c3: 0.125 * s2 / (s2 + 0.09) * (4.0 / (PI * PI)).powi(2),
                second: 0.17 * FRAC_1_PI * s2 / (s2 + 0.13),
            },
            Variant::Fujii => Form::Fujii { r, scale: FRAC_1_PI * smooth_albedo(r), further: None },
            Variant::Eon => {
                let further = Further::new(colour, r);
                Form::Fujii { r, scale: FRAC_1_PI * smooth_albedo(r), further }
            }
        };
        Self { colour, form }
    }

    #[inline(always)]
    fn full<T: Real>(&self, g: &Geometry<T>, [c1, c2, c3]: [f64; 3], second: f64) -> [T; 3] {
        let (one, s) = (T::one(), dot_xy(g));
        let (sin_i, sin_o) = (sine(&g.wi), sine(&g.wo));
        let (angle_i, angle_o) = (sin_i.atan2(g.cos_i()), sin_o.atan2(g.cos_o()));
        let (alpha, beta) = (angle_i.max(angle_o), angle_i.min(angle_o));
        let sines = sin_i * sin_o;
        // At the pole there is no azimuth; what it multiplies vanishes there.
        let cos_phi = if sines > T::zero() { (s / sines).max(-one).min(one) } else { T::zero() };
        let turn = T::of(2.0 / PI) * beta;
        let bent = if s < T::zero() { one - turn.powi(3) / sin_i.max(sin_o) } else { one };
        let c2 = T::of(c2) * bent * s / g.cos_i().max(g.cos_o());
        let c3 = T::of(c3) * (alpha * beta).powi(2);
        let tan_half = (sin_i + sin_o) / (g.cos_i() + g.cos_o());
        let first = (T::of(c1) + c2 + (one - cos_phi.abs()) * c3 * tan_half) * T::of(FRAC_1_PI);
        let second = (one - cos_phi * turn * turn) * T::of(second);
        self.colour.map(|c| (T::of(c) * (first + T::of(c) * second)).max(T::zero()))
    }
}

impl Further {
    /// `None` for a smooth surface, which has no second bounce and no rest to share out.
    fn new(colour: [f64; 3], r: f64) -> Option<Self> {
        let mean = mean_albedo(r);
        let scale = colour.map(|c| c * c * mean / (1.0 - c * (1.0 - mean)) * FRAC_1_PI / (1.0 - mean));
        (mean < 1.0).then_some(Self { scale })
    }
}

#[inline(always)]
fn dot_xy<T: Real>(g: &Geometry<T>) -> T {
    g.wi[0] * g.wo[0] + g.wi[1] * g.wo[1]
}

#[inline(always)]
fn sine<T: Real>(w: &[T; 3]) -> T {
    (w[0] * w[0] + w[1] * w[1]).sqrt()
}

/// Directional albedo of Fujii's form with white facets.
#[inline(always)]
fn albedo<T: Real>(w: &[T; 3], r: f64, smooth: f64) -> T {
    let (sin, cos, one) = (sine(w), w[2], T::one());
    // (tan θ)(1 − sin³ θ) without the cancellation at grazing angles.
    let rest = sin * cos * (one + sin + sin * sin) / (one + sin);
    let g = sin * (sin.atan2(cos) - sin * cos) + T::of(2.0 / 3.0) * (rest - sin);
    T::of(smooth) * (one + T::of(r * FRAC_1_PI) * g)
}

/// The same at normal incidence.
fn smooth_albedo(r: f64) -> f64 {
    1.0 / (1.0 + (0.5 - 2.0 / (3.0 * PI)) * r)
}

/// The mean over all directions, weighted with the cosine.
fn mean_albedo(r: f64) -> f64 {
    smooth_albedo(r) * (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * PI)) * r)
}

impl Lobe for OrenNayar {
    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        // cos φ sin α tan β = (x_i x_o + y_i y_o)/max(cos θ_i, cos θ_o), here as in the full form.
        let swing = |s: T| s / g.cos_i().max(g.cos_o());
        let s = dot_xy(g);
        match self.form {
            Form::Qualitative { a, b } => {
                let shape = T::of(a) + T::of(b) * swing(s.max(T::zero()));
                self.colour.map(|c| T::of(c * FRAC_1_PI) * shape)
            }
            Form::Full { c1, c2, c3, second } => self.full(g, [c1, c2, c3], second),
            Form::Fujii { r, scale, further } => {
                let s_over_t = if s > T::zero() { swing(s) } else { s };
                let single = T::of(scale) * (T::one() + T::of(r) * s_over_t);
                let lost = |w: &[T; 3]| T::one() - albedo(w, r, scale * PI);
                let rest = further.map(|f| (f.scale, lost(&g.wi) * lost(&g.wo)));
                std::array::from_fn(|c| {
                    let more = rest.map_or(T::zero(), |(scale, rest)| T::of(scale[c]) * rest);
                    T::of(self.colour[c]) * single + more
                })
            }
        }
    }

    fn sampling(&self) -> Option<Sampling> {
        Sampling::mixture([(self.colour.into_iter().sum(), Technique::Cosine)])
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let variant = variant(p.text("variant")?)?;
    let roughness = p.number(if variant.reads_sigma() { "sigma" } else { "r" })?;
    Some(Box::new(OrenNayar::new([p.number("kd")?; 3], variant, roughness)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lobe(variant: Variant, roughness: f64) -> OrenNayar {
        OrenNayar::new([1.0; 3], variant, roughness)
    }

    #[test]
    fn a_smooth_surface_is_lamberts() {
        for variant in [Variant::Qualitative, Variant::Full, Variant::Fujii, Variant::Eon] {
            let f = lobe(variant, 0.0).evaluate([0.6, 0.0, 0.8], [-0.5, 0.1, 0.74f64.sqrt()]);
            assert!((f[0] - FRAC_1_PI).abs() < 1e-12, "{variant:?}: {f:?}");
        }
    }

    #[test]
    fn a_white_eon_surface_reflects_everything() {
        for (r, cos_o) in [(0.2, 0.9), (1.0, 0.5), (1.0, 0.05)] {
            let lobe = lobe(Variant::Eon, r);
            let wo = [f64::sqrt(1.0 - cos_o * cos_o), 0.0, cos_o];
            let n = 400;
            let mut albedo = 0.0;
            for k in 0..n * n {
                let u = (f64::from(k / n) + 0.5) / f64::from(n);
                let (sin, phi) = (u.sqrt(), PI * (f64::from(k % n) + 0.5) / f64::from(n));
                let wi = [sin * phi.cos(), sin * phi.sin(), (1.0 - u).sqrt()];
                albedo += PI * lobe.evaluate(wi, wo)[0] / f64::from(n * n);
            }
            assert!((albedo - 1.0).abs() < 5e-4, "r = {r}, cos = {cos_o}: {albedo}");
        }
    }
}
