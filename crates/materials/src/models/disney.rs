//! Disney's principled BRDF (Burley 2012).
//!
//! `f = (1 − metallic) ((base_color/π) mix(f_d, f_ss, subsurface) + sheen c_sheen F_h) + D_s G_s F_s/(4 cos θ_i cos θ_o)
//!  + ¼ clearcoat D_r G_r F_r/(4 cos θ_i cos θ_o)` with `F_h = (1 − cos θ_d)⁵`:
//!
//! * `f_d`, `f_ss`: Burley's diffuse reflection and its flattened form ([`burley`]).
//! * main lobe: anisotropic GGX, `α = roughness²`, `F_s = mix(c₀, 1, F_h)`,
//!   `c₀ = mix(0.08 specular mix(1, tint, specular_tint), base_color, metallic)`.
//! * clear coat: GTR1 of width 0.1 to 0.001, GGX masking of width 0.25, `F_r = mix(0.04, 1, F_h)`.
//! * `tint = base_color/luminance` with the luminance weights 0.3, 0.6, 0.1; `c_sheen = mix(1, tint, sheen_tint)`.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `base_color` | colour of the body, linear RGB | 0.5 |
//! | `metallic` | 0 dielectric, 1 metal | 0 |
//! | `subsurface` | 0 diffuse, 1 flattened | 0 |
//! | `specular` | F0 of the dielectric over 0.08 | 0.5 |
//! | `roughness` | √α | 0.5 |
//! | `specular_tint` | how far F0 of the dielectric takes the base's hue | 0 |
//! | `anisotropic` | aspect `√(1 − 0.9 anisotropic)` | 0 |
//! | `sheen`, `sheen_tint` | reflection at grazing half angles, and its hue | 0, 0.5 |
//! | `clearcoat`, `clearcoat_gloss` | second lobe | 0, 1 |
//! | `variant` | masking of the main lobe: `2014` or `2012` | 2014 |
//!
//! `variant`: `2012` is the course notes' isotropic masking of width `(½ + roughness/2)²`; `2014` masks with the lobe's own
//! widths, as Heitz (2014) derived and as the reference code (wdas/brdf, `disney.brdf`) has done since. `2014` is the default
//! because it is what renderers implement, and because only there do distribution and masking belong together.
//!
//! Deviation: `base_color` is linear, where `disney.brdf` raises it to the power 2.2. The defaults are those of `disney.brdf`,
//! but for `base_color`.
//!
//! Known defects: the diffuse reflection is not coupled to the lobes, so white dielectrics reflect up to 1.2 (roughness
//! 0.3) and 1.56 times (roughness 1) what arrives at cos θ = 0.02. `specular = 0` leaves the reflection at grazing half
//! angles, and so does the material's diffuse part alone.

use std::f64::consts::FRAC_1_PI;

use crate::burley;
use crate::colour::mean;
use crate::conformance::Parameters;
use crate::distribution::{Distribution, Shape};
use crate::fresnel::{mix, schlick_weight};
use crate::masking::Masking;
use crate::model::{Family, Model, Values};
use crate::models::shared::*;
use crate::parameter::{Kind, Parameter, Role};
use crate::sampling::Technique;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "disney",
    title: "Disney principled (2012)",
    summary: "Burley's principled BRDF: what artists' materials of films and games descend from.",
    reference: "Burley 2012, Physically Based Shading at Disney; wdas/brdf disney.brdf",
    family: Family::Production,
    largest_albedo: 2.0,
    parameters: &[
        BASE_COLOR,
        METALLIC,
        unit_number(("subsurface", "SS", Role::LobeShape), 0.0, "Share of the flattened diffuse reflection."),
        unit_number(("specular", "S", Role::SpecularLevel), 0.5, "F0 of the dielectric: 0.08 times it."),
        PERCEPTUAL_ROUGHNESS,
        unit_number(("specular_tint", "T", Role::LobeShape), 0.0, "How far F0 takes the base colour's hue."),
        ANISOTROPIC,
        SHEEN,
        unit_number(("sheen_tint", "ST", Role::SheenShape), 0.5, SHEEN_TINT_SUMMARY),
        CLEARCOAT,
        unit_number(("clearcoat_gloss", "CG", Role::CoatShape), 1.0, CLEARCOAT_GLOSS_SUMMARY),
        Parameter {
            name: "variant",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "Masking of the main lobe: 2014 (its own widths) or 2012 (the course notes).",
            kind: Kind::Choice { options: &["2014", "2012"] },
        },
    ],
    surveyed: &["specular", "roughness"],
    searched: &["specular", "roughness"],
    linear: &["metallic", "subsurface", "specular", "specular_tint", "sheen", "sheen_tint", "clearcoat"],
    build: |v| Box::new(Disney::new(&Inputs::of(v))),
    vectors: Some(("disney2012", vector)),
    ..Model::BLANK
};

/// Luminance weights of `disney.brdf`.
const LUMINANCE: [f64; 3] = [0.3, 0.6, 0.1];

/// The parameters as they are written.
struct Inputs {
    base_color: [f64; 3],
    metallic: f64,
    subsurface: f64,
    specular: f64,
    roughness: f64,
    specular_tint: f64,
    anisotropic: f64,
    sheen: f64,
    sheen_tint: f64,
    clearcoat: f64,
    clearcoat_gloss: f64,
    notes_of_2012: bool,
}

impl Inputs {
    fn of(v: &Values) -> Self {
        Self {
            base_color: v.colour("base_color"),
            metallic: v.number("metallic"),
            subsurface: v.number("subsurface"),
            specular: v.number("specular"),
            roughness: v.number("roughness"),
            specular_tint: v.number("specular_tint"),
            anisotropic: v.number("anisotropic"),
            sheen: v.number("sheen"),
            sheen_tint: v.number("sheen_tint"),
            clearcoat: v.number("clearcoat"),
            clearcoat_gloss: v.number("clearcoat_gloss"),
            notes_of_2012: v.choice("variant") == "2012",
        }
    }
}

/// Disney's principled BRDF, ready to be evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Disney {
    /// Albedo of the diffuse reflection.
    body: [f64; 3],
    subsurface: f64,
    roughness: f64,
    /// Reflectance of the main lobe at normal incidence, c₀.
    f0: [f64; 3],
    main: Distribution,
    /// Width that the main lobe is masked with.
    main_masking: Distribution,
    sheen: [f64; 3],
    /// A quarter of the parameter.
    clearcoat: f64,
    coat: Distribution,
}

/// What the clear coat is masked with.
const COAT_MASKING: Distribution = Distribution::isotropic(Shape::Ggx, burley::CLEARCOAT_MASKING_ALPHA);

impl Disney {
    fn new(p: &Inputs) -> Self {
        let tint = burley::tint(p.base_color, LUMINANCE);
        let dielectric = |c: usize| 0.08 * p.specular * mix(1.0, tint[c], p.specular_tint);
        let main = Distribution { shape: Shape::Ggx, alpha: burley::alphas(p.roughness, p.anisotropic) };
        let notes = Distribution::isotropic(Shape::Ggx, (0.5 + 0.5 * p.roughness).powi(2));
        Self {
            body: p.base_color.map(|c| c * (1.0 - p.metallic)),
            subsurface: p.subsurface,
            roughness: p.roughness,
            f0: std::array::from_fn(|c| mix(dielectric(c), p.base_color[c], p.metallic)),
            main,
            main_masking: if p.notes_of_2012 { notes } else { main },
            sheen: tint.map(|t| (1.0 - p.metallic) * p.sheen * mix(1.0, t, p.sheen_tint)),
            clearcoat: 0.25 * p.clearcoat,
            coat: Distribution::isotropic(Shape::Gtr1, burley::clearcoat_alpha(p.clearcoat_gloss)),
        }
    }
}

impl Lobe for Disney {
    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let grazing = schlick_weight(g.cos_d);
        let denominator = (T::of(4.0) * g.cos_i() * g.cos_o()).recip();
        let diffuse = T::of(FRAC_1_PI)
            * mix(
                burley::diffuse(self.roughness, g),
                burley::flattened(self.roughness, g),
                T::of(self.subsurface),
            );
        let main = self.main.density(g) * Masking::Separable.visibility(&self.main_masking, g) * denominator;
        let coat = T::of(self.clearcoat)
            * self.coat.density(g)
            * Masking::Separable.visibility(&COAT_MASKING, g)
            * denominator
            * mix(T::of(0.04), T::one(), grazing);
        std::array::from_fn(|c| {
            T::of(self.body[c]) * diffuse
                + T::of(self.sheen[c]) * grazing
                + main * mix(T::of(self.f0[c]), T::one(), grazing)
                + coat
        })
    }

    fn sampling(&self) -> Option<Sampling> {
        // 0.05: what Fresnel's effect adds to a reflectance, averaged over angles.
        Sampling::mixture([
            (mean(self.body) + 0.1 * mean(self.sheen), Technique::Cosine),
            (mean(self.f0) + 0.05, Technique::HalfVector(self.main)),
            (0.1 * self.clearcoat, Technique::HalfVector(self.coat)),
        ])
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    Some(Box::new(Disney::new(&Inputs {
        base_color: p.colour("base_color")?,
        metallic: p.number("metallic")?,
        subsurface: p.number("subsurface")?,
        specular: p.number("specular")?,
        roughness: p.number("roughness")?,
        specular_tint: p.number("specular_tint")?,
        anisotropic: p.number("anisotropic")?,
        sheen: p.number("sheen")?,
        sheen_tint: p.number("sheen_tint")?,
        clearcoat: p.number("clearcoat")?,
        clearcoat_gloss: p.number("clearcoat_gloss")?,
        notes_of_2012: match p.text("variant")? {
            "2012" => true,
            "2014" => false,
            _ => return None,
        },
    })))
}
