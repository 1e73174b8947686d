//! Minnaert (1941), *The reciprocity principle in lunar photometry*: a diffuse surface that is brighter or darker towards its
//! edge than Lambert's.
//!
//! `f = k_d (k + 1)/(2π) (cos θ_i cos θ_o)^(k − 1)`
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `albedo` | reflectance at normal incidence, k_d, linear RGB | 0.5 |
//! | `k` | limb darkening: 1 is Lambert's law, more is darker towards the edge | 1.2 |
//!
//! Known defect: below k = 1 the directional albedo grows without bound towards grazing angles, so such values are refused.

use std::f64::consts::TAU;

use lookmatch_materials::{
    Geometry, Interval, Kind, Levels, Lobe, Material, Model, Parameter, Range, Real, Role, Sampling, Scale,
    Technique,
};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "minnaert",
    title: "Minnaert",
    summary: "Diffuse surface that darkens towards its edge, as the moon does not and some planets do.",
    reference: "Minnaert 1941",
    has_fresnel: false,
    is_reciprocal: true,
    parameters: &[
        Parameter {
            name: "albedo",
            symbol: "k_d",
            // The diffuse reflection is not Lambert's: a scene cannot replace its colour.
            role: Role::BaseColour,
            unit: "1",
            summary: "Reflectance at normal incidence, linear RGB.",
            kind: Kind::Colour { range: ALBEDO, default: [0.5; 3] },
        },
        Parameter {
            name: "k",
            symbol: "k",
            role: Role::DiffuseRoughness,
            unit: "1",
            summary: "Limb darkening; 1 is Lambert's law.",
            kind: Kind::Number { range: DARKENING, default: 1.2 },
        },
    ],
    surveyed: &["albedo", "k"],
    searched: &["albedo", "k"],
    build: |v| Box::new(Minnaert { albedo: v.colour("albedo"), k: v.number("k") }),
    ..Model::BLANK
};

const ALBEDO: Range = Range {
    valid: Interval::closed(0.0, 1.0),
    plausible: Interval::closed(0.0, 1.0),
    scale: Scale::Linear,
    search: Levels::new(0.0, 1.0, 0.02),
    survey: Levels::new(0.1, 1.0, 0.1),
};

const DARKENING: Range = Range {
    valid: Interval::closed(1.0, 4.0),
    plausible: Interval::closed(1.0, 2.0),
    scale: Scale::Linear,
    search: Levels::new(1.0, 2.0, 0.02),
    survey: Levels::new(1.0, 2.0, 0.2),
};

/// Minnaert's surface.
#[derive(Clone, Copy, Debug)]
pub struct Minnaert {
    /// Reflectance at normal incidence per channel.
    pub albedo: [f64; 3],
    /// Limb darkening, 1 or more.
    pub k: f64,
}

impl Lobe for Minnaert {
    fn diffuse(&self) -> [f64; 3] {
        // Nothing of it is exactly Lambert's.
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let shape = T::of((self.k + 1.0) / TAU) * (g.cos_i() * g.cos_o()).powf(T::of(self.k - 1.0));
        self.albedo.map(|albedo| T::of(albedo) * shape)
    }

    fn sampling(&self) -> Option<Sampling> {
        Sampling::mixture([(1.0, Technique::Cosine)])
    }
}

fn main() -> Result<(), lookmatch_materials::MaterialError> {
    let mut moon = Material::new(&MODEL);
    moon.set("albedo", "0.12/0.11/0.10")?;
    moon.set("k", "1.4")?;
    println!("{moon}");
    let (up, aside) = ([0.0, 0.0, 1.0], [0.6, 0.0, 0.8]);
    let (there, back) = (moon.bsdf().evaluate(up, aside), moon.bsdf().evaluate(aside, up));
    assert!((0..3).all(|c| (there[c] - back[c]).abs() < 1e-12), "light and viewer may be swapped");
    println!("f at 37 degrees: {there:?} per steradian");
    println!("{}", moon.set("k", "0.5").unwrap_err());
    Ok(())
}
