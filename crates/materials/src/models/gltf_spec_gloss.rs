//! The specular-glossiness material of glTF 2.0 (archived).
//!
//! `f = (1 − F) c/π + F D G/(4 cos θ_i cos θ_o)` per channel, with `c = diffuse (1 − max_rgb specular)`,
//! `F = mix(specular, 1, (1 − cos θ_d)⁵)` and GGX of `α = (1 − glossiness)²`.
//!
//! | parameter | glTF | meaning | default |
//! |---|---|---|---|
//! | `diffuse` | diffuseFactor | colour of the diffuse reflection, linear RGB | 0.5 |
//! | `specular` | specularFactor | F0, linear RGB | 0.04 |
//! | `glossiness` | glossinessFactor | 1 − √α | 0.5 |
//! | `masking` | – | `correlated` (today's Appendix B) or `separable` (an earlier one) | correlated |
//!
//! Source: KHR_materials_pbrSpecularGlossiness, archived, ratified; superseded by KHR_materials_specular. Its text defines c,
//! F0 and α and refers to Appendix B of glTF 2.0 for the BRDF.
//!
//! Deviations: α is at least 0.001. The factor `1 − F` of the diffuse reflection is per channel, as in Appendix B when the
//! extension was written, not of the largest channel as in KHR_materials_specular. The defaults are those of an ordinary
//! plastic; the format's own (1, 1, 1) mean a white mirror.
//!
//! Checked: D, V and F against the Khronos sample viewer's BRDF functions (`tests/vectors/make_shaders.py`). How they are put together
//! follows the text of the extension and is checked only by a second writing of it there, not independently.
//!
//! Known defects: `specular = 0` leaves the reflection at grazing half angles, and so does the material's diffuse part
//! alone; white dielectrics reflect up to 1.3 times what arrives (glossiness 0.7, cos θ = 0.02), although the diffuse
//! reflection loses energy to the lobe twice, in c and in `1 − F`.

use std::f64::consts::FRAC_1_PI;

use crate::colour::{largest, mean};
use crate::distribution::Distribution;
use crate::fresnel::{mix, schlick_weight};
use crate::layers::{facets, ggx};
use crate::masking::Masking;
use crate::model::{Family, Model, Values};
use crate::models::shared::*;
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};
use crate::sampling::Technique;
use crate::{Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "gltf-spec-gloss",
    title: "glTF specular-glossiness",
    summary: "The archived specular-glossiness material of glTF 2.0 files.",
    reference: "glTF 2.0, KHR_materials_pbrSpecularGlossiness (archived); Appendix B",
    family: Family::Production,
    largest_albedo: 1.6,
    parameters: &[
        unit_colour(
            ("diffuse", "D", Role::BaseColour),
            [0.5; 3],
            "Colour of the diffuse reflection, linear RGB; the specular colour takes its share of it.",
        ),
        SPECULAR,
        GLOSSINESS,
        masking(&["correlated", "separable"]),
    ],
    surveyed: &["specular", "glossiness"],
    searched: &["specular", "glossiness"],
    linear: &["diffuse"],
    build: |v| {
        Box::new(SpecularGlossiness {
            body: body(v),
            f0: v.colour("specular"),
            distribution: ggx([(1.0 - v.number("glossiness")).powi(2); 2]),
            masking: masking_named(v.choice("masking")),
        })
    },
    ..Model::BLANK
};

const SPECULAR: Parameter = Parameter {
    name: "specular",
    symbol: "S",
    role: Role::NormalReflectance,
    unit: "1",
    summary: "Reflectance at normal incidence, linear RGB.",
    kind: Kind::Colour {
        range: Range {
            valid: Interval::closed(0.0, 1.0),
            plausible: Interval::closed(0.0, 0.4),
            scale: Scale::Linear,
            search: Levels::new(0.0, 0.40, 0.01),
            survey: Levels::new(0.02, 0.40, 0.02),
        },
        default: [0.04; 3],
    },
};

const GLOSSINESS: Parameter = Parameter {
    name: "glossiness",
    symbol: "G",
    role: Role::Glossiness,
    unit: "1",
    summary: "One minus the roughness; the microfacet α is the square of the rest.",
    kind: Kind::Number {
        range: Range {
            valid: Interval::closed(0.0, 1.0),
            plausible: Interval::closed(0.16, 0.9),
            scale: Scale::Linear,
            search: Levels::new(0.16, 0.90, 0.01),
            survey: Levels::new(0.175, 0.90, 0.025),
        },
        default: 0.5,
    },
};

/// c, the albedo of the diffuse reflection before its coupling.
fn body(v: &Values) -> [f64; 3] {
    let rest = 1.0 - largest(v.colour("specular"));
    v.colour("diffuse").map(|c| c * rest)
}

/// The specular-glossiness material, ready to be evaluated.
#[derive(Clone, Copy, Debug)]
pub struct SpecularGlossiness {
    body: [f64; 3],
    f0: [f64; 3],
    distribution: Distribution,
    masking: Masking,
}

impl Lobe for SpecularGlossiness {
    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let grazing = schlick_weight(g.cos_d);
        let shape = facets(&self.distribution, self.masking, g);
        std::array::from_fn(|c| {
            let reflectance = mix(T::of(self.f0[c]), T::one(), grazing);
            mix(T::of(self.body[c] * FRAC_1_PI), shape, reflectance)
        })
    }

    fn sampling(&self) -> Option<Sampling> {
        // 0.05: what Fresnel's effect adds to a reflectance, averaged over angles.
        Sampling::mixture([
            (mean(self.body), Technique::Cosine),
            (mean(self.f0) + 0.05, Technique::HalfVector(self.distribution)),
        ])
    }
}
