//! glTF 2.0 metallic-roughness with the extensions for opaque surfaces.
//!
//! With `w(c) = (1 − c)⁵`, `B = D G/(4 cos θ_i cos θ_o)` (GGX, `α = roughness²`) and `mix(a, b, t) = (1 − t) a + t b`:
//!
//! * dielectric: `F = mix(F0, specular, w(cos θ_d))`, `F0 = min(((ior − 1)/(ior + 1))² specular_color, 1) specular`;
//!   `f = (1 − max_rgb F) base_color/π + F B`
//! * metal: `f = mix(base_color, 1, w(cos θ_d)) B`
//! * `material = mix(dielectric, metal, metallic)`
//! * sheen: `sheen_color f_Charlie + material min(1 − s E(θ_i), 1 − s E(θ_o))`, `s = max_rgb sheen_color`,
//!   E the directional albedo of the Charlie lobe of `α = sheen_roughness²` ([`Charlie`])
//! * clear coat, above all: `mix(…, B(clearcoat_roughness²), clearcoat mix(0.04, 1, w(cos θ_o)))`
//!
//! | parameter | glTF | meaning | default |
//! |---|---|---|---|
//! | `base_color` | baseColorFactor | colour of the body, linear RGB | 0.5 |
//! | `metallic` | metallicFactor | 0 dielectric, 1 metal | 0 |
//! | `roughness` | roughnessFactor | √α | 0.5 |
//! | `ior` | KHR_materials_ior | index, 1 or more; 0 stands for F0 = 1 | 1.5 |
//! | `specular` | KHR_materials_specular, specularFactor | weight of the dielectric's reflection | 1 |
//! | `specular_color` | specularColorFactor | scale of the dielectric's F0 | 1 |
//! | `clearcoat`, `clearcoat_roughness` | KHR_materials_clearcoat | weight and √α of the coat | 0, 0 |
//! | `sheen_color`, `sheen_roughness` | KHR_materials_sheen | colour and √α of the sheen | 0, 0 |
//! | `anisotropy_strength` | KHR_materials_anisotropy | `α_t = mix(α, 1, strength²)`, `α_b = α` | 0 |
//! | `masking` | – | `correlated` (today's Appendix B) or `separable` (an earlier one) | correlated |
//!
//! Sources: glTF 2.0.1, Appendix B; the ratified texts of the five extensions (KhronosGroup/glTF, `extensions/2.0/Khronos`).
//!
//! Deviations: α is at least 0.001, that of the sheen at least 0.005. E comes from a quadrature of the lobe, cut off at
//! 1, not from the table that the sheen's text refers to. The visibility of the anisotropy's sample code is cut off at 1, which it passes
//! where both cosines are below a half; here it is not. `anisotropyRotation` is left out: turn the surface. The defaults
//! are those of an ordinary plastic; the format's own (1, 1, 1) mean a rough white metal.
//!
//! Checked: the core model by the public vectors; specular, sheen, clear coat and anisotropy against the Khronos
//! sample viewer's BRDF functions (`tests/vectors/make_shaders.py`). How the layers are put together follows the texts and is
//! checked only by a second writing of them there.
//!
//! Known defects: the clear coat's weight depends on the view alone, so light and viewer cannot be swapped; the coupling of
//! the diffuse reflection by cos θ_d lets white dielectrics reflect up to 1.7 times what arrives (roughness 0.1, cos θ =
//! 0.02); a narrow sheen reflects more than arrives by itself ([`crate::sheen`]); light that bounces between microfacets is
//! lost.

use std::f64::consts::FRAC_1_PI;

use crate::colour::{largest, mean};
use crate::conformance::Parameters;
use crate::distribution::Distribution;
use crate::fresnel::{f0_from_ior, mix, schlick_weight};
use crate::layers::{facets, ggx};
use crate::masking::Masking;
use crate::model::{Family, Model, Values};
use crate::models::shared::*;
use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};
use crate::sampling::Technique;
use crate::sheen::{Charlie, Visibility};
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "gltf",
    title: "glTF metallic-roughness",
    summary: "The material of glTF 2.0 files, with specular, ior, clear coat, sheen and anisotropy.",
    reference: "glTF 2.0 Appendix B; KHR_materials_specular, _ior, _clearcoat, _sheen, _anisotropy",
    family: Family::Production,
    is_reciprocal: false,
    largest_albedo: 2.0,
    parameters: &[
        BASE_COLOR,
        METALLIC,
        PERCEPTUAL_ROUGHNESS,
        index(
            ("ior", "I", Role::RefractiveIndex),
            Range { valid: Interval::closed(0.0, 100.0), ..INDICES },
            1.5,
            "Index of refraction of the dielectric, inside over outside.",
        ),
        unit_number(
            ("specular", "S", Role::SpecularReflectance),
            1.0,
            "Weight of the dielectric's reflection: 0 is diffuse only, 1 is physical.",
        ),
        SPECULAR_COLOR,
        unit_number(("clearcoat", "CC", Role::Coat), 0.0, "Weight of the clear coat."),
        unit_number(("clearcoat_roughness", "CR", Role::CoatRoughness), 0.0, COAT_ROUGHNESS_SUMMARY),
        unit_colour(("sheen_color", "SH", Role::Sheen), [0.0; 3], "Colour of the sheen, linear RGB."),
        unit_number(
            ("sheen_roughness", "SR", Role::SheenRoughness),
            0.0,
            "Roughness of the sheen; its square is the width of the lobe of fibres.",
        ),
        unit_number(
            ("anisotropy_strength", "A", Role::Anisotropy),
            0.0,
            "Widens the lobe along the tangent: α becomes mix(α, 1, strength²) there.",
        ),
        masking(&["correlated", "separable"]),
    ],
    surveyed: &["ior", "roughness"],
    searched: &["ior", "roughness"],
    linear: &["base_color", "metallic", "specular", "clearcoat"],
    check: |v| match v.number("ior") {
        ior if ior > 0.0 && ior < 1.0 => Err(format!("ior={ior}: 1 or more, or 0 for full reflectance")),
        _ => Ok(()),
    },
    build: |v| Box::new(Gltf::of(v)),
    vectors: Some(("gltf_pbr", vector)),
    ..Model::BLANK
};

const SPECULAR_COLOR: Parameter = Parameter {
    name: "specular_color",
    symbol: "SC",
    role: Role::SpecularColour,
    unit: "1",
    summary: "Scale of the dielectric's F0, linear RGB; the product is cut off at 1.",
    kind: Kind::Colour {
        range: Range {
            valid: Interval::closed(0.0, 100.0),
            plausible: Interval::closed(0.0, 1.0),
            scale: Scale::Linear,
            search: Levels::new(0.0, 1.0, 0.05),
            survey: Levels::new(0.1, 1.0, 0.1),
        },
        default: [1.0; 3],
    },
};

/// F0 of the clear coat: an index of 1.5.
const COAT_F0: f64 = 0.04;

/// The material of glTF 2.0, ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Gltf {
    /// Albedo of the diffuse reflection before its coupling.
    body: [f64; 3],
    /// The largest channel of the dielectric's F0, and its reflectance at grazing angles.
    dielectric: [f64; 2],
    /// Reflectance of dielectric and metal together, at normal incidence and at grazing angles.
    f0: [f64; 3],
    f90: f64,
    distribution: Distribution,
    masking: Masking,
    sheen: Option<Sheen>,
    clearcoat: f64,
    coat: Distribution,
}

/// The sheen and its colour.
#[derive(Clone, Debug)]
struct Sheen {
    colour: [f64; 3],
    /// The largest channel of the colour.
    strength: f64,
    lobe: Charlie,
}

impl Gltf {
    fn of(v: &Values) -> Self {
        let (base, metallic) = (v.colour("base_color"), v.number("metallic"));
        let f0 = dielectric_f0(v.number("ior"), v.colour("specular_color"), v.number("specular"));
        let alpha = v.number("roughness").powi(2);
        let strength2 = v.number("anisotropy_strength").powi(2);
        let colour = v.colour("sheen_color");
        let sheen = (colour != [0.0; 3]).then(|| Sheen {
            colour,
            strength: largest(colour),
            lobe: Charlie::new(v.number("sheen_roughness").powi(2), Visibility::Smith),
        });
        Self {
            sheen,
            clearcoat: v.number("clearcoat"),
            coat: ggx([v.number("clearcoat_roughness").powi(2); 2]),
            ..Self::core(
                (base, metallic),
                (f0, v.number("specular")),
                ggx([mix(alpha, 1.0, strength2), alpha]),
                masking_named(v.choice("masking")),
            )
        }
    }

    /// The material without sheen and clear coat, of base colour and metalness and of the dielectric's F0 and F90.
    fn core(
        (base, metallic): ([f64; 3], f64),
        (f0, f90): ([f64; 3], f64),
        distribution: Distribution,
        masking: Masking,
    ) -> Self {
        Self {
            body: base.map(|c| c * (1.0 - metallic)),
            dielectric: [largest(f0), f90],
            f0: std::array::from_fn(|c| mix(f0[c], base[c], metallic)),
            f90: mix(f90, 1.0, metallic),
            distribution,
            masking,
            sheen: None,
            clearcoat: 0.0,
            coat: distribution,
        }
    }

    /// Appendix B with the specular extension: diffuse reflection and main lobe.
    #[inline(always)]
    fn base<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let grazing = schlick_weight(g.cos_d);
        let [f0, f90] = self.dielectric.map(T::of);
        let diffuse = T::of(FRAC_1_PI) * (T::one() - mix(f0, f90, grazing));
        let shape = facets(&self.distribution, self.masking, g);
        std::array::from_fn(|c| {
            T::of(self.body[c]) * diffuse + mix(T::of(self.f0[c]), T::of(self.f90), grazing) * shape
        })
    }
}

impl Lobe for Gltf {
    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let mut f = self.base(g);
        if let Some(sheen) = &self.sheen {
            let (scale, brdf) = (sheen.scale_of_base(g), sheen.lobe.brdf(g));
            f = std::array::from_fn(|c| T::of(sheen.colour[c]) * brdf + scale * f[c]);
        }
        if self.clearcoat > 0.0 {
            let coat = facets(&self.coat, self.masking, g);
            let reflected = T::of(self.clearcoat) * mix(T::of(COAT_F0), T::one(), schlick_weight(g.cos_o()));
            f = f.map(|base| mix(base, coat, reflected));
        }
        f
    }

    fn sampling(&self) -> Option<Sampling> {
        // Reflectances averaged over angles: Fresnel's effect adds about 0.05, a sheen reflects about half of its colour.
        let sheen = self.sheen.as_ref().map_or(0.0, |s| 0.5 * mean(s.colour));
        Sampling::mixture([
            (mean(self.body) * (1.0 - self.dielectric[0]) + sheen, Technique::Cosine),
            (mean(self.f0) + 0.05 * self.f90, Technique::HalfVector(self.distribution)),
            (0.1 * self.clearcoat, Technique::HalfVector(self.coat)),
        ])
    }
}

impl Sheen {
    /// What the sheen leaves for the material beneath.
    #[inline(always)]
    fn scale_of_base<T: Real>(&self, g: &Geometry<T>) -> T {
        let albedo = |cos| self.lobe.directional_albedo(cos);
        T::one() - T::of(self.strength) * albedo(g.cos_i()).max(albedo(g.cos_o()))
    }
}

/// F0 of the dielectric: of the index, scaled and cut off.
fn dielectric_f0(ior: f64, colour: [f64; 3], specular: f64) -> [f64; 3] {
    colour.map(|c| (f0_from_ior(ior) * c).min(1.0) * specular)
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let masking = match p.text("g") {
        Some("separable") => Masking::Separable,
        Some("correlated") | None => Masking::Correlated,
        Some(_) => return None,
    };
    Some(Box::new(Gltf::core(
        (p.colour("base_color")?, p.number("metallic")?),
        (dielectric_f0(1.5, [1.0; 3], 1.0), 1.0),
        ggx([p.number("roughness")?.powi(2); 2]),
        masking,
    )))
}

#[cfg(test)]
mod tests {
    use crate::Material;

    #[test]
    fn an_index_below_one_is_refused_but_for_zero() {
        assert!(Material::parse("gltf:ior=0").is_ok());
        assert!(Material::parse("gltf:ior=0.5").unwrap_err().to_string().contains("1 or more"));
    }
}
