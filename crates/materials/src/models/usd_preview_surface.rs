//! UsdPreviewSurface, the material that USD files are exchanged with.
//!
//! `f = (1 − F) d/π + F D G/(4 cos θ_i cos θ_o) + clearcoat F_c D_c G_c/(4 cos θ_i cos θ_o)` per channel, with
//! `F = mix(F0, F90, (1 − cos θ_d)⁵)`, `R = ((1 − ior)/(1 + ior))²` and
//!
//! | | metalness workflow | specular workflow |
//! |---|---|---|
//! | d | `diffuse_color (1 − metallic)` | `diffuse_color` |
//! | F90 | `c = mix(1, diffuse_color, metallic)` | 1 |
//! | F0 | `mix(R c, c, metallic)` | `specular_color` |
//!
//! `D` is GGX of `α = roughness²`, `G = Π cos/(cos (1 − α/2) + α/2)` (Schlick 1994), `F_c = mix(R, 1, (1 − cos θ_d)⁵)`.
//!
//! | parameter | specification | meaning | default |
//! |---|---|---|---|
//! | `diffuse_color` | diffuseColor | colour of the body, linear RGB | 0.18 |
//! | `use_specular_workflow` | useSpecularWorkflow | 0 metalness, 1 specular | 0 |
//! | `specular_color` | specularColor | F0 in the specular workflow | 0 |
//! | `metallic` | metallic | 0 dielectric, 1 metal, in the metalness workflow | 0 |
//! | `roughness` | roughness | √α | 0.5 |
//! | `clearcoat`, `clearcoat_roughness` | clearcoat, clearcoatRoughness | weight and √α of the second lobe | 0, 0.01 |
//! | `ior` | ior | index of the dielectric and of the clear coat | 1.5 |
//! | `variant` | – | `exact` or `storm` | exact |
//!
//! Source: UsdPreviewSurface Specification 2.5 (2.6 adds an input for opacity). It defines F0 and F90, Schlick's Fresnel
//! term between them, the mixing of metals, and that roughness is squared "before use with a GGX or Beckmann lobe". On all
//! else it is silent, and the reference renderer decides: Storm, `previewSurface.glslfx` of OpenUSD. From there are GGX,
//! Schlick's masking, the factor `1 − F` per channel, and that the clear coat is added without darkening what it covers.
//! (MaterialX's graph of the same name has Smith masking, compensated energy and albedo scaling, which are its own.)
//!
//! `storm` is Storm's code to the letter: π is 3.1415, and 0.001 is added to the numerator of D and to the denominator
//! `4 cos θ_i cos θ_o`. That makes D's integral `1 + 0.001/α²`, and lobes of roughness below 0.3 too bright. `exact`
//! leaves these guards out.
//!
//! Deviations: α is at least 0.001 (a roughness of 0.03; Storm: a roughness of 0.001). Opacity, emission and occlusion are left
//! out.
//!
//! Checked against Storm's code, with and without its guards (`tests/vectors/make_shaders.py`).
//!
//! Known defects: white dielectrics reflect up to 1.24 times what arrives (roughness 0.3, cos θ = 0.02), with a clear coat
//! 2.1 times; `storm` up to 6 times (roughness 0.1, black). F90 is 1, so a `specular_color` of 0 leaves the reflection at
//! grazing half angles, and so does the material's diffuse part alone.

use std::f64::consts::PI;

use crate::colour::mean;
use crate::distribution::Distribution;
use crate::fresnel::{f0_from_ior, mix, schlick_weight};
use crate::layers::ggx;
use crate::model::{Family, Model, Values};
use crate::models::shared::*;
use crate::parameter::{Kind, Parameter, Role};
use crate::sampling::Technique;
use crate::{Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "usd-preview-surface",
    title: "UsdPreviewSurface",
    summary: "The material that USD files are exchanged with, as Storm renders it.",
    reference: "UsdPreviewSurface Specification 2.5; OpenUSD previewSurface.glslfx",
    family: Family::Production,
    largest_albedo: 2.5,
    parameters: &[
        unit_colour(
            ("diffuse_color", "D", Role::BaseColour),
            [0.18; 3],
            "Colour of the diffuse reflection and of the metal, linear RGB.",
        ),
        Parameter {
            name: "use_specular_workflow",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "0: F0 comes from ior and metallic; 1: F0 is specular_color.",
            kind: Kind::Choice { options: &["0", "1"] },
        },
        unit_colour(
            ("specular_color", "SC", Role::NormalReflectance),
            [0.0; 3],
            "Reflectance at normal incidence in the specular workflow, linear RGB.",
        ),
        METALLIC,
        PERCEPTUAL_ROUGHNESS,
        unit_number(("clearcoat", "CC", Role::Coat), 0.0, "Weight of the second lobe."),
        unit_number(("clearcoat_roughness", "CR", Role::CoatRoughness), 0.01, COAT_ROUGHNESS_SUMMARY),
        index(
            ("ior", "I", Role::RefractiveIndex),
            INDICES,
            1.5,
            "Index of refraction of the dielectric, inside over outside.",
        ),
        Parameter {
            name: "variant",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "exact, or storm: with the guards against division by 0 of Storm's code.",
            kind: Kind::Choice { options: &["exact", "storm"] },
        },
    ],
    surveyed: &["ior", "roughness"],
    searched: &["ior", "roughness"],
    linear: &["clearcoat"],
    build: |v| Box::new(PreviewSurface::of(v)),
    ..Model::BLANK
};

/// The workflow in which F0 is a parameter.
fn is_specular(v: &Values) -> bool {
    v.choice("use_specular_workflow") == "1"
}

/// d, the albedo of the diffuse reflection before its coupling.
fn body(v: &Values) -> [f64; 3] {
    let dielectric = if is_specular(v) { 1.0 } else { 1.0 - v.number("metallic") };
    v.colour("diffuse_color").map(|c| c * dielectric)
}

/// UsdPreviewSurface, ready to be evaluated.
#[derive(Clone, Copy, Debug)]
pub struct PreviewSurface {
    body: [f64; 3],
    f0: [f64; 3],
    f90: [f64; 3],
    main: Distribution,
    clearcoat: f64,
    coat_f0: f64,
    coat: Distribution,
    guards: Guards,
}

/// What Storm puts into its formulas so as not to divide by 0.
#[derive(Clone, Copy, Debug)]
struct Guards {
    epsilon: f64,
    pi: f64,
}

#[expect(clippy::approx_constant, reason = "so it stands in Storm's code")]
const STORM: Guards = Guards { epsilon: 0.001, pi: 3.1415 };

const NO_GUARDS: Guards = Guards { epsilon: 0.0, pi: PI };

impl PreviewSurface {
    fn of(v: &Values) -> Self {
        let (colour, metallic) = (v.colour("diffuse_color"), v.number("metallic"));
        let r = f0_from_ior(v.number("ior"));
        let edge = colour.map(|c| mix(1.0, c, metallic));
        let (f0, f90) = match is_specular(v) {
            true => (v.colour("specular_color"), [1.0; 3]),
            false => (edge.map(|e| mix(r * e, e, metallic)), edge),
        };
        Self {
            body: body(v),
            f0,
            f90,
            main: ggx([v.number("roughness").powi(2); 2]),
            clearcoat: v.number("clearcoat"),
            coat_f0: r,
            coat: ggx([v.number("clearcoat_roughness").powi(2); 2]),
            guards: match v.choice("variant") {
                "storm" => STORM,
                _ => NO_GUARDS,
            },
        }
    }

    /// A lobe of microfacets that reflect everything: `D G/(4 cos θ_i cos θ_o)`.
    #[inline(always)]
    fn microfacets<T: Real>(&self, distribution: &Distribution, g: &Geometry<T>) -> T {
        let alpha = distribution.alpha[0];
        let excess = 1.0 + self.guards.epsilon / (alpha * alpha);
        let density = distribution.density(g) * T::of(excess * PI / self.guards.pi);
        let half = T::of(0.5 * alpha);
        let g1 = |cos: T| cos / mix(cos, T::one(), half);
        let denominator = T::of(4.0) * g.cos_i() * g.cos_o() + T::of(self.guards.epsilon);
        density * g1(g.cos_i()) * g1(g.cos_o()) / denominator
    }
}

impl Lobe for PreviewSurface {
    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let grazing = schlick_weight(g.cos_d);
        let main = self.microfacets(&self.main, g);
        let coat = if self.clearcoat > 0.0 {
            let reflectance = mix(T::of(self.coat_f0), T::one(), grazing);
            T::of(self.clearcoat) * reflectance * self.microfacets(&self.coat, g)
        } else {
            T::zero()
        };
        let lambert = self.body.map(|d| T::of(d / self.guards.pi));
        std::array::from_fn(|c| {
            let reflectance = mix(T::of(self.f0[c]), T::of(self.f90[c]), grazing);
            mix(lambert[c], main, reflectance) + coat
        })
    }

    fn sampling(&self) -> Option<Sampling> {
        // 0.05: what Fresnel's effect adds to a reflectance, averaged over angles.
        Sampling::mixture([
            (mean(self.body), Technique::Cosine),
            (mean(self.f0) + 0.05 * mean(self.f90), Technique::HalfVector(self.main)),
            (self.clearcoat * (self.coat_f0 + 0.05), Technique::HalfVector(self.coat)),
        ])
    }
}
