//! The reflection part of Mitsuba 3's `principled` (after Burley 2012 and 2015), with `spec_trans = 0`.
//!
//! `f = (1 − metallic) ((base_color/π) mix(f_d, f_ss, flatness) + sheen c_sheen F_h) + D G F/(4 cos θ_i cos θ_o)
//!  + ¼ clearcoat D_c G_c F_c` with `F_h = (1 − cos θ_d)⁵`:
//!
//! * `f_d`, `f_ss`: Burley's diffuse reflection and its flattened form ([`burley`]).
//! * main lobe: anisotropic GGX, `α = roughness²`, separable masking,
//!   `F = (1 − metallic) mix(F_dielectric(eta), Schlick(tint F0), spec_tint) + metallic Schlick(base_color)`.
//! * clear coat: GTR1 of width 0.1 to 0.001, GGX masking of width 0.25, `F_c = mix(0.04, 1, F_h)`. There is no
//!   `1/(4 cos θ_i cos θ_o)`: so it is in Mitsuba.
//! * `tint = base_color/luminance` with the luminance weights 0.212671, 0.715160, 0.072169.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `base_color` | colour of the body, linear RGB | 0.5 |
//! | `roughness` | √α | 0.5 |
//! | `anisotropic` | aspect `√(1 − 0.9 anisotropic)` | 0 |
//! | `metallic` | 0 dielectric, 1 metal | 0 |
//! | `eta` | index of the dielectric; Mitsuba's `specular` is `eta = 2/(1 − √(0.08 specular)) − 1` | 1.5 |
//! | `spec_tint` | how far F0 of the dielectric takes the base's hue | 0 |
//! | `sheen`, `sheen_tint` | reflection at grazing half angles, and its hue | 0, 0 |
//! | `flatness` | share of the flattened diffuse reflection | 0 |
//! | `clearcoat`, `clearcoat_gloss` | second lobe | 0, 0 |
//!
//! Source: `src/bsdfs/principled.cpp` and `principledhelpers.h` of Mitsuba 3.9. Deviations: no transmission, so no `eta`
//! below 1; at `eta = 1` Mitsuba drops the main lobe of a metal with that of the dielectric, here the metal stays.
//!
//! Known defects: the diffuse reflection is not coupled to the lobes, so white dielectrics reflect up to 1.2 times what
//! arrives (roughness 0.3, cos θ = 0.1); the clear coat lacks the brightness at grazing angles that its denominator would give.

use std::f64::consts::FRAC_1_PI;

use crate::burley;
use crate::colour::mean;
use crate::conformance::Parameters;
use crate::distribution::{Distribution, Shape};
use crate::fresnel::{Fresnel, f0_from_ior, mix, schlick_weight};
use crate::masking::Masking;
use crate::model::{Family, Model, Values};
use crate::models::shared::*;
use crate::parameter::Role;
use crate::sampling::Technique;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "mitsuba-principled",
    title: "Mitsuba 3 principled",
    summary: "Mitsuba 3's principled BSDF without transmission.",
    reference: "Mitsuba 3.9, principled.cpp; Burley 2012; Burley 2015, Extending the Disney BRDF",
    family: Family::Production,
    largest_albedo: 2.0,
    parameters: &[
        BASE_COLOR,
        PERCEPTUAL_ROUGHNESS,
        ANISOTROPIC,
        METALLIC,
        index(
            ("eta", "η", Role::RefractiveIndex),
            INDICES,
            1.5,
            "Index of refraction of the dielectric, inside over outside.",
        ),
        unit_number(("spec_tint", "T", Role::LobeShape), 0.0, "How far F0 takes the base colour's hue."),
        SHEEN,
        unit_number(("sheen_tint", "ST", Role::SheenShape), 0.0, SHEEN_TINT_SUMMARY),
        unit_number(("flatness", "FL", Role::LobeShape), 0.0, "Share of the flattened diffuse reflection."),
        CLEARCOAT,
        unit_number(("clearcoat_gloss", "CG", Role::CoatShape), 0.0, CLEARCOAT_GLOSS_SUMMARY),
    ],
    surveyed: &["eta", "roughness"],
    searched: &["eta", "roughness"],
    linear: &["metallic", "spec_tint", "sheen", "sheen_tint", "flatness", "clearcoat"],
    build: |v| Box::new(Principled::new(&Inputs::of(v))),
    vectors: Some(("principled_mitsuba3", vector)),
    ..Model::BLANK
};

/// Luminance weights of Mitsuba 3: linear sRGB.
const LUMINANCE: [f64; 3] = [0.212671, 0.715160, 0.072169];

/// The parameters as they are written.
struct Inputs {
    base_color: [f64; 3],
    roughness: f64,
    anisotropic: f64,
    metallic: f64,
    eta: f64,
    spec_tint: f64,
    sheen: f64,
    sheen_tint: f64,
    flatness: f64,
    clearcoat: f64,
    clearcoat_gloss: f64,
}

impl Inputs {
    fn of(v: &Values) -> Self {
        Self {
            base_color: v.colour("base_color"),
            roughness: v.number("roughness"),
            anisotropic: v.number("anisotropic"),
            metallic: v.number("metallic"),
            eta: v.number("eta"),
            spec_tint: v.number("spec_tint"),
            sheen: v.number("sheen"),
            sheen_tint: v.number("sheen_tint"),
            flatness: v.number("flatness"),
            clearcoat: v.number("clearcoat"),
            clearcoat_gloss: v.number("clearcoat_gloss"),
        }
    }
}

/// Mitsuba 3's principled BSDF without transmission, ready to be evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Principled {
    /// Albedo of the diffuse reflection.
    body: [f64; 3],
    flatness: f64,
    roughness: f64,
    main: Distribution,
    /// The exact Fresnel reflectance and its weight.
    exact: Fresnel,
    exact_weight: f64,
    /// Schlick's reflectances of tint and metal together: at normal incidence and at grazing angles.
    schlick0: [f64; 3],
    schlick90: f64,
    sheen: [f64; 3],
    /// A quarter of the parameter.
    clearcoat: f64,
    coat: Distribution,
}

/// What the clear coat is masked with.
const COAT_MASKING: Distribution = Distribution::isotropic(Shape::Ggx, burley::CLEARCOAT_MASKING_ALPHA);

impl Principled {
    fn new(p: &Inputs) -> Self {
        let tint = burley::tint(p.base_color, LUMINANCE);
        let dielectric = 1.0 - p.metallic;
        let tinted = dielectric * p.spec_tint;
        Self {
            body: p.base_color.map(|c| c * dielectric),
            flatness: p.flatness,
            roughness: p.roughness,
            main: Distribution { shape: Shape::Ggx, alpha: burley::alphas(p.roughness, p.anisotropic) },
            exact: Fresnel::Dielectric { eta: p.eta },
            exact_weight: dielectric * (1.0 - p.spec_tint),
            schlick0: std::array::from_fn(|c| {
                p.metallic * p.base_color[c] + tinted * tint[c] * f0_from_ior(p.eta)
            }),
            schlick90: p.metallic + tinted,
            sheen: tint.map(|t| dielectric * p.sheen * mix(1.0, t, p.sheen_tint)),
            clearcoat: 0.25 * p.clearcoat,
            coat: Distribution::isotropic(Shape::Gtr1, burley::clearcoat_alpha(p.clearcoat_gloss)),
        }
    }
}

impl Lobe for Principled {
    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let grazing = schlick_weight(g.cos_d);
        let diffuse = T::of(FRAC_1_PI)
            * mix(
                burley::diffuse(self.roughness, g),
                burley::flattened(self.roughness, g),
                T::of(self.flatness),
            );
        let main = self.main.density(g) * Masking::Separable.visibility(&self.main, g)
            / (T::of(4.0) * g.cos_i() * g.cos_o());
        let exact = T::of(self.exact_weight) * self.exact.reflectance(g.cos_d);
        let coat = T::of(self.clearcoat)
            * self.coat.density(g)
            * Masking::Separable.visibility(&COAT_MASKING, g)
            * mix(T::of(0.04), T::one(), grazing);
        std::array::from_fn(|c| {
            let schlick = mix(T::of(self.schlick0[c]), T::of(self.schlick90), grazing);
            T::of(self.body[c]) * diffuse + T::of(self.sheen[c]) * grazing + main * (exact + schlick) + coat
        })
    }

    fn sampling(&self) -> Option<Sampling> {
        // 0.05: what Fresnel's effect adds to a reflectance, averaged over angles.
        let main = mean(self.schlick0) + self.exact_weight * self.exact.reflectance(1.0) + 0.05;
        Sampling::mixture([
            (mean(self.body) + 0.1 * mean(self.sheen), Technique::Cosine),
            (main, Technique::HalfVector(self.main)),
            (0.2 * self.clearcoat, Technique::HalfVector(self.coat)),
        ])
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    Some(Box::new(Principled::new(&Inputs {
        base_color: p.colour("base_color")?,
        roughness: p.number("roughness")?,
        anisotropic: p.number("anisotropic")?,
        metallic: p.number("metallic")?,
        eta: p.number("eta")?,
        spec_tint: p.number("spec_tint")?,
        sheen: p.number("sheen")?,
        sheen_tint: p.number("sheen_tint")?,
        flatness: p.number("flatness")?,
        clearcoat: p.number("clearcoat")?,
        clearcoat_gloss: p.number("clearcoat_gloss")?,
    })))
}
