//! The direct fit of Dupuy *et al.* (2015): a GGX lobe whose width is found by power iterations, without a diffuse term, and whose
//! Fresnel term is measured.
//!
//! The widths ship with this crate (`assets/README.md`). The Fresnel term is what the material reflects over what the lobe would
//! reflect without one, channel by channel for each difference angle. Dupuy *et al.* take the mean of the ratios beside a
//! tabulated distribution; beside a GGX one the mean would be that of directions where hardly anything is reflected, so that the
//! ratio of the means, weighted as light arrives, is taken here: the lobe then reflects as much as the material at every angle.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use anyhow::Context;
use lookmatch_materials::distribution::{Distribution, Shape};
use lookmatch_materials::fresnel::Fresnel;
use lookmatch_materials::masking::Masking;
use lookmatch_materials::microfacet::Microfacet;
use lookmatch_materials::{
    Bsdf, Geometry, Interval, Kind, Levels, Lobe, Material, Model, Parameter, Range, Real, Role, Sampling,
    Scale, Value,
};

/// Name and α of each material.
const WIDTHS: &str = include_str!("../../../assets/dupuy2015-ggx.csv");
/// Cosines of the difference angle at which the Fresnel term is known: multiples of 1/STEPS.
const STEPS: usize = 16;
/// Half vectors that are summed up.
const SUMMED: usize = 400;

const UNIT: Range = Range {
    valid: Interval::closed(0.0, 1.0),
    plausible: Interval::closed(0.0, 1.0),
    scale: Scale::Linear,
    search: Levels::new(0.0, 1.0, 0.1),
    survey: Levels::new(0.0, 1.0, 0.1),
};

/// A GGX lobe with a Fresnel term given by numbers: of no use to anybody but this experiment, and in no list of models.
static MODEL: Model = Model {
    name: "ggx-measured-fresnel",
    title: "GGX, Fresnel term measured",
    parameters: &[
        Parameter {
            name: "alpha",
            symbol: "α",
            role: Role::Roughness,
            unit: "1",
            summary: "Width of the lobe.",
            kind: Kind::Number {
                range: Range { valid: Interval::open_below(0.0, 1.0), ..UNIT },
                default: 0.2,
            },
        },
        Parameter {
            name: "fresnel",
            symbol: "F",
            role: Role::LobeShape,
            unit: "1",
            summary: "Reflectance by cosine of the difference angle, all of red, of green and of blue.",
            kind: Kind::List { range: UNIT, default: &[1.0] },
        },
    ],
    build: |v| {
        let list = v.list("fresnel");
        let fresnel = std::array::from_fn(|c| {
            std::array::from_fn(|k| list.get(c * (STEPS + 1) + k).copied().unwrap_or(1.0))
        });
        Box::new(Measured { lobe: lobe(v.number("alpha")), fresnel })
    },
    ..Model::BLANK
};

/// A lobe that reflects everything.
fn lobe(alpha: f64) -> Microfacet {
    Microfacet {
        diffuse: [0.0; 3],
        specular: [1.0; 3],
        distribution: Distribution::isotropic(Shape::Ggx, alpha),
        masking: Masking::Separable,
        fresnel: [Fresnel::None; 3],
    }
}

struct Measured {
    lobe: Microfacet,
    fresnel: [[f64; STEPS + 1]; 3],
}

impl Lobe for Measured {
    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let shape = Lobe::specular(&self.lobe, g)[0];
        let place = g.cos_d * T::of(STEPS as f64);
        // Straight lines between the numbers, as a sum of hats.
        let hat = |k: usize| (T::one() - (place - T::of(k as f64)).abs()).max(T::zero());
        self.fresnel.each_ref().map(|numbers| {
            numbers.iter().enumerate().fold(T::zero(), |sum, (k, f)| sum + T::of(*f) * hat(k)) * shape
        })
    }

    fn sampling(&self) -> Option<Sampling> {
        Lobe::sampling(&self.lobe)
    }
}

/// The names and widths of all materials.
pub(super) fn widths() -> impl Iterator<Item = (&'static str, f64)> {
    let line = |line: &'static str| {
        let (name, alpha) = line.split_once(',')?;
        Some((name, alpha.trim().parse().ok()?))
    };
    WIDTHS.lines().skip(1).filter_map(line)
}

/// The direct fit of a measured material.
pub(super) fn direct(name: &str, measured: &Material) -> anyhow::Result<Material> {
    let width = widths().find(|(other, _)| *other == name);
    let (_, alpha) = width.with_context(|| format!("no width of '{name}' is known"))?;
    let mut material = Material::new(&MODEL);
    material.set_number("alpha", alpha)?;
    let numbers: Arc<[f64]> = fresnel(&*measured.bsdf(), alpha).as_flattened().into();
    material.set_value(1, Value::List(numbers))?;
    Ok(material)
}

/// What a material reflects over what a lobe would reflect without a Fresnel term, by channel and cosine of the difference angle.
fn fresnel(measured: &dyn Bsdf, alpha: f64) -> [[f64; STEPS + 1]; 3] {
    let lobe = lobe(alpha);
    let mut all = [[0.0; STEPS + 1]; 3];
    for k in 0..=STEPS {
        // At 90° there is nothing to see.
        let cos_d = (k as f64).max(0.5) / STEPS as f64;
        let sin_d = (1.0 - cos_d * cos_d).sqrt();
        let (mut seen, mut whole) = ([0.0; 3], 0.0);
        for j in 0..SUMMED {
            // Half vectors are dense where lobes are narrow; across them, light and viewer are equally steep.
            let part = (j as f64 + 0.5) / SUMMED as f64;
            let theta = part * part * part * FRAC_PI_2;
            let (sin_h, cos_h) = theta.sin_cos();
            let [wi, wo] = [1.0, -1.0].map(|side| [cos_d * sin_h, side * sin_d, cos_d * cos_h]);
            let weight = cos_d * cos_h * sin_h * part * part;
            let (f, full) = (measured.evaluate(wi, wo), lobe.evaluate(wi, wo)[0]);
            (0..3).for_each(|c| seen[c] += weight * f[c]);
            whole += weight * full;
        }
        (0..3).for_each(|c| all[c][k] = (seen[c] / whole).min(1.0));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_names_exactly_the_materials() {
        let presets = |model| {
            let presets = (lookmatch_materials::by_name(model).unwrap().presets)();
            let mut names: Vec<&str> = presets.iter().map(|preset| preset.name.as_str()).collect();
            names.sort_unstable();
            names
        };
        let mut names: Vec<&str> = widths().map(|(name, _)| name).collect();
        names.sort_unstable();
        assert_eq!(names.len(), 100);
        assert_eq!((&names, &names), (&presets("low-abc"), &presets("merl")));
        assert!(widths().all(|(_, alpha)| alpha > 0.0 && alpha < 1.0));
    }

    /// Of a material that is such a lobe, the fit is the material.
    #[test]
    fn the_fresnel_term_of_a_metal_is_found() {
        let gold = Material::parse("ggx-conductor:conductor=gold,roughness=0.18").unwrap();
        let mut fit = Material::new(&MODEL);
        fit.set_number("alpha", 0.18).unwrap();
        fit.set_value(1, Value::List(fresnel(&*gold.bsdf(), 0.18).as_flattened().into())).unwrap();
        for (wi, wo) in [([0.0, 0.6, 0.8], [0.1, -0.6, 0.63f64.sqrt()]), ([0.0, 0.0, 1.0], [0.0, 0.28, 0.96])]
        {
            let [a, b] = [&gold, &fit].map(|material| material.bsdf().evaluate(wi, wo));
            assert!((0..3).all(|c| a[c] > 0.0 && (a[c] - b[c]).abs() < 0.005 * a[c]), "{a:?} {b:?}");
        }
    }
}
