//! Lafortune *et al.* (1997), *Non-Linear Approximation of Reflectance Functions*: a sum of generalised cosine lobes, beside a
//! Lambert term.
//!
//! `f = k_d/π + k_s Σ w N max(0, c_x x_i x_o + c_y y_i y_o + c_z z_i z_o)ⁿ`
//!
//! | `norm` | N | for |
//! |---|---|---|
//! | `phong` | `(n + 2)/(2π)` | a Phong lobe of albedo w at (−1, −1, 1), the default |
//! | `peak` | `(n + 2)/(2π max(|c_x|, |c_y|, |c_z|)ⁿ)` | fits of Ngan *et al.* (2005) |
//! | `none` | 1 | the article's own form, where c carries the scale |
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `diffuse` | albedo of the Lambert term, k_d | 0.5 |
//! | `specular` | colour and scale of all lobes, k_s | 0.1 |
//! | `weight` | w of each lobe | 1 |
//! | `cx`, `cy`, `cz` | direction of each lobe: (−1, −1, 1) mirrors, (1, 1, 1) sends light back; `cxy` sets the first two | −1, −1, 1 |
//! | `exponent` | n of each lobe | 100 |
//! | `norm` | see above | phong |
//!
//! `weight`, `cx`, `cy`, `cz` and `exponent` take one number for all lobes or one for each: `cz=1/0.9,exponent=10/300` are two.
//! Lobes share one colour: fits with a direction and an exponent of each channel's own are not representable.
//!
//! Presets: `ngan-NAME` (Ngan *et al.* 2005, one lobe, `peak`).
//!
//! Known defects: lobes are pinched towards grazing angles, as Phong's. Single precision loses `n · 10⁻⁷` of a lobe that does
//! not point about the mirror direction.

use std::f64::consts::TAU;

use serde_json::Value as Json;

use crate::conformance::Parameters;
use crate::model::{Alias, Model, Values};
use crate::models::phong::power_of_cosine;
use crate::models::shared::*;
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};
use crate::presets;
use crate::sampling::Technique;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "lafortune",
    title: "Lafortune",
    summary: "Any number of generalised cosine lobes: off-specular, retro-reflecting or anisotropic.",
    reference: "Lafortune et al. 1997; Ngan et al. 2005 (norm peak)",
    has_fresnel: false,
    largest_albedo: 1.4,
    parameters: &[
        DIFFUSE,
        Parameter {
            summary: "Colour and scale of all lobes, linear RGB.",
            kind: match SPECULAR.kind {
                Kind::Colour { range, default } => {
                    Kind::Colour { range: Range { valid: Interval::closed(0.0, 10.0), ..range }, default }
                }
                other => other,
            },
            ..SPECULAR
        },
        Parameter {
            name: "weight",
            symbol: "w",
            role: Role::LobeShape,
            unit: "1",
            summary: "Weight of each lobe.",
            kind: Kind::List {
                range: Range {
                    valid: Interval::closed(0.0, 1000.0),
                    plausible: Interval::closed(0.0, 1.0),
                    scale: Scale::Linear,
                    search: Levels::new(0.0, 1.0, 0.05),
                    survey: Levels::new(0.1, 1.0, 0.1),
                },
                default: &[1.0],
            },
        },
        direction("cx", "c_x", "Factor of the product of x components; -1 mirrors, 1 sends back.", &[-1.0]),
        direction("cy", "c_y", "Factor of the product of y components; -1 mirrors, 1 sends back.", &[-1.0]),
        direction(
            "cz",
            "c_z",
            "Factor of the product of z components; less than |cx| leans to grazing angles.",
            &[1.0],
        ),
        Parameter {
            name: "exponent",
            symbol: "n",
            role: Role::Exponent,
            unit: "1",
            summary: "Power of each lobe.",
            kind: Kind::List { range: EXPONENTS, default: &[100.0] },
        },
        Parameter {
            name: "norm",
            symbol: "N",
            role: Role::Variant,
            unit: "-",
            summary: "Normalisation of each lobe: phong, peak (over its largest value too) or none.",
            kind: Kind::Choice { options: &["phong", "peak", "none"] },
        },
    ],
    aliases: &[Alias { name: "cxy", parameters: &["cx", "cy"] }],
    surveyed: &["specular", "exponent"],
    searched: &["specular", "exponent"],
    linear: &["diffuse", "specular", "weight"],
    presets: presets::lafortune,
    check,
    build: |v| {
        Box::new(Lafortune { diffuse: v.colour("diffuse"), specular: v.colour("specular"), lobes: lobes(v) })
    },
    vectors: Some(("lafortune", vector)),
    ..Model::BLANK
};

const fn direction(
    name: &'static str,
    symbol: &'static str,
    summary: &'static str,
    default: &'static [f64],
) -> Parameter {
    Parameter {
        name,
        symbol,
        role: Role::LobeShape,
        unit: "1",
        summary,
        kind: Kind::List {
            range: Range {
                valid: Interval::closed(-10.0, 10.0),
                plausible: Interval::closed(-1.0, 1.0),
                scale: Scale::Linear,
                search: Levels::new(-1.0, 1.0, 0.05),
                survey: Levels::new(-1.0, 1.0, 0.1),
            },
            default,
        },
    }
}

/// The parameters with a number for each lobe.
const LISTS: [&str; 5] = ["weight", "cx", "cy", "cz", "exponent"];

/// The largest value that a lobe may have: beyond, single precision overflows.
const LARGEST: f64 = 1e30;

fn count(v: &Values) -> usize {
    LISTS.iter().map(|name| v.list(name).len()).max().unwrap_or(0)
}

/// One number serves all lobes.
fn entry(list: &[f64], lobe: usize) -> f64 {
    list.get(lobe).or(list.first()).copied().unwrap_or(0.0)
}

fn lobes(v: &Values) -> Vec<Cosine> {
    let norm = norm(v.choice("norm")).unwrap_or(Norm::Phong);
    let number = |name: &str, k| entry(v.list(name), k);
    (0..count(v))
        .map(|k| {
            let c = ["cx", "cy", "cz"].map(|name| number(name, k));
            Cosine::new(number("weight", k), c, number("exponent", k), norm)
        })
        .collect()
}

fn check(v: &Values) -> Result<(), String> {
    let count = count(v);
    for name in LISTS {
        let given = v.list(name).len();
        if given != 1 && given != count {
            return Err(format!("{name} has {given} numbers for {count} lobes; give 1 or {count}"));
        }
    }
    match lobes(v).iter().position(|lobe| lobe.scale.is_nan() || lobe.scale > LARGEST) {
        Some(k) => {
            Err(format!("lobe {} reaches values beyond {LARGEST:e}; norm=peak keeps it finite", k + 1))
        }
        None => Ok(()),
    }
}

/// What a lobe's power is multiplied with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Norm {
    /// Nothing.
    None,
    /// `(n + 2)/(2π)`.
    Phong,
    /// The same over the largest value of the power.
    Peak,
}

fn norm(name: &str) -> Option<Norm> {
    match name {
        "none" => Some(Norm::None),
        "phong" => Some(Norm::Phong),
        "peak" => Some(Norm::Peak),
        _ => None,
    }
}

/// A generalised cosine lobe.
#[derive(Clone, Copy, Debug)]
pub struct Cosine {
    /// Largest value of the lobe.
    scale: f64,
    /// Direction over its largest component: the base of the power is 1 at most.
    c: [f64; 3],
    exponent: f64,
}

impl Cosine {
    /// A lobe of a weight, a direction and an exponent of 0 or more.
    pub fn new(weight: f64, c: [f64; 3], exponent: f64, norm: Norm) -> Self {
        let largest = c.into_iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let unit = if largest > 0.0 { largest } else { 1.0 };
        let normalised = weight * (exponent + 2.0) / TAU;
        let scale = match norm {
            Norm::None => weight * unit.powf(exponent),
            Norm::Phong => normalised * unit.powf(exponent),
            Norm::Peak => normalised,
        };
        Self { scale, c: c.map(|v| v / unit), exponent }
    }

    #[inline(always)]
    fn value<T: Real>(&self, g: &Geometry<T>) -> T {
        // The base of the power is c_z (1 − v) + (c_x + c_z) x_i x_o + (c_y + c_z) y_i y_o, with the versine v to the mirror
        // direction: near a mirror lobe nothing cancels.
        let [cx, cy, cz] = self.c;
        let across = T::of(cx + cz) * g.wi[0] * g.wo[0] + T::of(cy + cz) * g.wi[1] * g.wo[1];
        let versine = T::of(1.0 - cz) + T::of(cz) * g.versine_mirror() - across;
        T::of(self.scale) * power_of_cosine(versine, self.exponent)
    }

    /// Light that the lobe reflects at most.
    fn albedo(&self) -> f64 {
        self.scale * TAU / (self.exponent + 2.0)
    }
}

/// Lafortune's lobes with a Lambert term.
#[derive(Clone, Debug)]
pub struct Lafortune {
    /// Albedo of the Lambert term per channel.
    pub diffuse: [f64; 3],
    /// Scale of all lobes per channel.
    pub specular: [f64; 3],
    /// The lobes.
    pub lobes: Vec<Cosine>,
}

impl Lobe for Lafortune {
    fn diffuse(&self) -> [f64; 3] {
        self.diffuse
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let sum = self.lobes.iter().fold(T::zero(), |sum, lobe| sum + lobe.value(g));
        self.specular.map(|s| T::of(s) * sum)
    }

    fn sampling(&self) -> Option<Sampling> {
        let scale: f64 = self.specular.into_iter().sum();
        Sampling::mixture(
            self.lobes.iter().map(|lobe| {
                (scale * lobe.albedo(), Technique::Power { scale: lobe.c, exponent: lobe.exponent })
            }),
        )
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let norm = norm(p.text("norm").unwrap_or("none"))?;
    let lobe = |json: &Json| {
        let number = |name: &str| json.get(name)?.as_f64();
        let c = [number("cx")?, number("cy")?, number("cz")?];
        Some(Cosine::new(number("s")?, c, number("n")?, norm))
    };
    Some(Box::new(Lafortune {
        diffuse: [p.number_or("kd", 0.0)?; 3],
        specular: [1.0; 3],
        lobes: p.array("lobes")?.iter().map(lobe).collect::<Option<_>>()?,
    }))
}

#[cfg(test)]
mod tests {
    use crate::Material;

    fn value(text: &str) -> f64 {
        let (wi, wo) = ([0.6, 0.0, 0.8], [-0.5, 0.1, 0.74f64.sqrt()]);
        Material::parse(text).unwrap().bsdf().evaluate(wi, wo)[1]
    }

    #[test]
    fn the_default_lobe_is_phongs() {
        let phong = value("phong:specular=0.3,exponent=40");
        assert!((value("lafortune:specular=0.3,exponent=40") / phong - 1.0).abs() < 1e-12);
    }

    #[test]
    fn lobes_add_up_and_one_number_serves_all() {
        let (a, b) =
            (value("lafortune:diffuse=0,exponent=10"), value("lafortune:diffuse=0,exponent=30,cz=0.9"));
        let both = value("lafortune:diffuse=0,exponent=10/30,cz=1/0.9");
        assert!((both - a - b).abs() < 1e-12 * both);
    }

    #[test]
    fn lobes_that_do_not_go_together_are_refused() {
        let message = |text: &str| Material::parse(text).unwrap_err().to_string();
        assert!(message("lafortune:exponent=1/2,cz=1/1/1").contains("exponent has 2 numbers for 3 lobes"));
        assert!(message("lafortune:cz=2,exponent=20000").contains("lobe 1 reaches values beyond"));
        assert!(Material::parse("lafortune:cz=2,exponent=20000,norm=peak").is_ok());
    }
}
