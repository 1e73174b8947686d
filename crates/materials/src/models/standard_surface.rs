//! Autodesk Standard Surface 1.0.1, its opaque part: a mixture of a glossy diffuse body, perhaps with sheen, and a metal, under a coat.
//!
//! With F the exact Fresnel reflectance, D the GGX distribution, G the height-correlated Smith masking, and E(θ_o) the directional albedo of a lobe,
//! here integrated and not approximated:
//!
//! ```text
//! a   = r², b = √(1 − min(anisotropy, 0.98)),  α_x = min(a/b, 1),  α_y = a b
//! r'  = lerp(r, 1, coat · coat_affect_roughness · coat_roughness)
//! f_d = base/π · base_color^(1 + coat · coat_affect_color) · (A + B max(0, s)/max(cos θ_i, cos θ_o))        Oren–Nayar
//! f_h = sheen · sheen_color · f_Charlie + (1 − sheen E_h(θ_o)) f_d
//! f_s = specular · specular_color · F(n) D G/(4 cos θ_i cos θ_o) + (1 − specular E(θ_o)) f_h
//! f_m = F(n_m, k_m) D G/(4 cos θ_i cos θ_o)                                                       n_m, k_m by Gulbrandsen 2014
//! f   = coat · F(n_c) D_c G_c/(4 cos θ_i cos θ_o) + (1 − coat E_c(θ_o)) lerp(1, coat_color, coat) lerp(f_s, f_m, metalness)
//! ```
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `base`, `base_color`, `diffuse_roughness`, `metalness` | body | 1, 0.8, 0, 0 |
//! | `specular`, `specular_color`, `specular_roughness`, `specular_IOR`, `specular_anisotropy` | its interface | 1, 1, 0.2, 1.5, 0 |
//! | `sheen`, `sheen_color`, `sheen_roughness` | fibres | 0, 1, 0.3 |
//! | `coat`, `coat_color`, `coat_roughness`, `coat_anisotropy`, `coat_IOR`, `coat_affect_color`, `coat_affect_roughness` | clear coat | 0, 1, 0.1, 0, 1.5, 0, 0 |
//!
//! The layering and the parametrisation are those of MaterialX 1.39's graph (Oren–Nayar with its qualitative A and B; sheen below the specular lobe). The
//! sheen is Estevez & Kulla's (2017) distribution `(2 + 1/r) sin^(1/r) θ_h/(2π)` over `4 (cos θ_i + cos θ_o − cos θ_i cos θ_o)`, without masking.
//!
//! Deviations: transmission, subsurface, thin film, emission and the rotations of tangents are left out; α is at least 0.001. The sheen's albedo is integrated
//! where MaterialX fits it. Known defects: not reciprocal; light that bounces between microfacets is lost; the Oren–Nayar term loses energy; the sheen
//! creates it at grazing angles where it is smooth (an albedo of 1.3 at sheen_roughness 0.1 and 5.4 at 0.005; below 0.9 from 0.3 on), and leaves
//! nothing to the body there.
//!
//! Checked against the conformance vectors (no sheen); the sheen's lobe at one pair of directions against MaterialX 1.39.5's shader, written out in
//! another language, whose fit of the albedo was 0.013 off there.

use std::array::from_fn;

use crate::colour::mean;
use crate::conformance::Parameters;
use crate::distribution::Distribution;
use crate::fresnel::{Fresnel, mix};
use crate::layers::{Gloss, facets, ggx};
use crate::masking::Masking;
use crate::model::{Family, Model, Values};
use crate::models::shared::*;
use crate::oren_nayar::Qualitative;
use crate::parameter::{Kind, Role};
use crate::sheen::{Charlie, Visibility};
use crate::{Bsdf, Geometry, Lobe, Real, Sampling, Technique};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "standard-surface",
    title: "Autodesk Standard Surface",
    summary: "Layered material of Arnold and MaterialX: plastic, metal, sheen and clear coat.",
    reference: "Georgiev et al. 2019, Autodesk Standard Surface 1.0.1; MaterialX 1.39",
    family: Family::Production,
    has_fresnel: true,
    is_reciprocal: false,
    // Without sheen it stays below 1.
    largest_albedo: 2.5,
    parameters: &[
        unit_number(("base", "w_b", Role::BaseWeight), 1.0, "Scale of the body's colour."),
        unit_colour(
            ("base_color", "ρ", Role::BaseColour),
            [0.8; 3],
            "Albedo of the diffuse reflection and reflectance of the metal, linear RGB.",
        ),
        unit_number(
            ("diffuse_roughness", "σ", Role::DiffuseRoughness),
            0.0,
            "Roughness of the diffuse reflection; 0 is Lambertian.",
        ),
        unit_number(("metalness", "M", Role::Metalness), 0.0, "Share of the metal."),
        unit_number(
            ("specular", "w_s", Role::SpecularReflectance),
            1.0,
            "Scale of the specular lobe; of a metal, towards grazing angles.",
        ),
        unit_colour(
            ("specular_color", "c_s", Role::SpecularColour),
            [1.0; 3],
            "Tint of the specular lobe; of a metal, towards grazing angles.",
        ),
        perceptual_roughness(
            ("specular_roughness", "r", Role::PerceptualRoughness),
            0.2,
            "Roughness of the specular lobe; its square is α.",
        ),
        index(
            ("specular_IOR", "n", Role::RefractiveIndex),
            LAYER_INDICES,
            1.5,
            "Index of refraction of the dielectric.",
        ),
        unit_number(
            ("specular_anisotropy", "a", Role::Anisotropy),
            0.0,
            "Stretch of the specular lobe along the tangent.",
        ),
        unit_number(("sheen", "w_h", Role::Sheen), 0.0, "Weight of the layer of fibres."),
        unit_colour(("sheen_color", "c_h", Role::SheenColour), [1.0; 3], "Colour of the fibres."),
        unit_number(
            ("sheen_roughness", "r_h", Role::SheenRoughness),
            0.3,
            "Roughness of the layer of fibres.",
        ),
        unit_number(("coat", "C", Role::Coat), 0.0, "Weight of the clear coat."),
        unit_colour(("coat_color", "c_c", Role::CoatColour), [1.0; 3], "Transmittance of the coat."),
        unit_number(
            ("coat_roughness", "r_c", Role::CoatRoughness),
            0.1,
            "Roughness of the coat; its square is α.",
        ),
        unit_number(
            ("coat_anisotropy", "a_c", Role::CoatShape),
            0.0,
            "Stretch of the coat's lobe along the tangent.",
        ),
        index(("coat_IOR", "n_c", Role::CoatIndex), LAYER_INDICES, 1.5, "Index of refraction of the coat."),
        unit_number(
            ("coat_affect_color", "-", Role::CoatShape),
            0.0,
            "How much the coat saturates the diffuse colour below.",
        ),
        unit_number(
            ("coat_affect_roughness", "-", Role::CoatShape),
            0.0,
            "How much the coat's roughness roughens the lobe below.",
        ),
    ],
    surveyed: &["specular_IOR", "specular_roughness"],
    searched: &["specular_IOR", "specular_roughness"],
    linear: &["metalness", "sheen", "sheen_color", "coat_color"],
    build: |v: &Values| {
        let mut surface = StandardSurface::new(&|name| v.number(name), &|name| v.colour(name));
        let sheen = v.number("sheen");
        surface.sheen = (sheen > 0.0).then(|| {
            (sheen, v.colour("sheen_color"), Charlie::new(v.number("sheen_roughness"), Visibility::Neubelt))
        });
        Box::new(surface.with_free_lambert())
    },
    vectors: Some(("standard_surface", vector)),
    ..Model::BLANK
};

/// A surface of layers.
struct StandardSurface {
    /// Lambert's reflection, where nothing lies above it.
    lambert: [f64; 3],
    dielectric: f64,
    body: [f64; 3],
    diffuse: Qualitative,
    /// Weight, colour and lobe.
    sheen: Option<(f64, [f64; 3], Charlie)>,
    distribution: Distribution,
    /// Weight and interface.
    gloss: Option<(f64, Gloss)>,
    specular_color: [f64; 3],
    /// Weight and Fresnel terms.
    metal: Option<(f64, [Fresnel; 3])>,
    coat: Option<(f64, Option<Gloss>)>,
    /// What the coat lets through, without what it reflects.
    filter: [f64; 3],
}

impl StandardSurface {
    fn new(number: &dyn Fn(&str) -> f64, colour: &dyn Fn(&str) -> [f64; 3]) -> Self {
        let (coat, coat_roughness) = (number("coat"), number("coat_roughness"));
        let roughness =
            mix(number("specular_roughness"), 1.0, coat * number("coat_affect_roughness") * coat_roughness);
        let distribution = spread(roughness, number("specular_anisotropy"));
        let (base, base_color) = (number("base"), colour("base_color"));
        let (metalness, specular) = (number("metalness"), number("specular"));
        let specular_color = colour("specular_color");
        let gamma = 1.0 + coat * number("coat_affect_color");
        let metal = from_fn(|c| artistic_metal(base * base_color[c], specular * specular_color[c]));
        let gloss =
            (specular * (1.0 - metalness) > 0.0).then(|| Gloss::new(distribution, number("specular_IOR")));
        let coat_gloss = || Gloss::new(spread(coat_roughness, number("coat_anisotropy")), number("coat_IOR"));
        Self {
            lambert: [0.0; 3],
            dielectric: 1.0 - metalness,
            body: base_color.map(|c| base * c.powf(gamma)),
            diffuse: Qualitative::new(number("diffuse_roughness")),
            sheen: None,
            distribution,
            gloss: gloss.flatten().map(|gloss| (specular, gloss)),
            specular_color,
            metal: (metalness > 0.0).then_some((metalness, metal)),
            coat: (coat > 0.0).then(|| (coat, coat_gloss())),
            filter: colour("coat_color").map(|c| mix(1.0, c, coat)),
        }
    }

    /// Where nothing covers a smooth diffuse reflection, it is Lambert's term.
    fn with_free_lambert(mut self) -> Self {
        let uncovered = self.gloss.is_none() && self.sheen.is_none() && self.coat.is_none();
        if uncovered && self.diffuse.is_smooth() {
            self.lambert = self.body.map(|c| c * self.dielectric);
            self.dielectric = 0.0;
        }
        self
    }
}

/// α of a roughness and an anisotropy, as MaterialX's `roughness_anisotropy`.
fn spread(roughness: f64, anisotropy: f64) -> Distribution {
    let alpha = roughness * roughness;
    let aspect = (1.0 - anisotropy.min(0.98)).sqrt();
    ggx([(alpha / aspect).min(1.0), alpha * aspect])
}

/// The complex index of a metal of a reflectance at normal incidence and a tint of its edges (Gulbrandsen 2014).
fn artistic_metal(reflectance: f64, edge: f64) -> Fresnel {
    let r = reflectance.clamp(0.0, 0.99);
    let eta = mix((1.0 + r.sqrt()) / (1.0 - r.sqrt()), (1.0 - r) / (1.0 + r), edge);
    let k2 = ((eta + 1.0).powi(2) * r - (eta - 1.0).powi(2)) / (1.0 - r);
    Fresnel::Conductor { eta, k: k2.max(0.0).sqrt() }
}

impl Lobe for StandardSurface {
    fn diffuse(&self) -> [f64; 3] {
        self.lambert
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let (zero, one) = (T::zero(), T::one());
        let lobed = self.gloss.is_some() || self.metal.is_some();
        let shape = if lobed { facets(&self.distribution, Masking::Correlated, g) } else { zero };
        let mut f = [zero; 3];
        if self.dielectric > 0.0 {
            let diffuse = self.diffuse.at(g);
            f = self.body.map(|c| T::of(c) * diffuse);
            if let Some((weight, colour, charlie)) = &self.sheen {
                let weight = T::of(*weight);
                let (lobe, under) =
                    (weight * charlie.brdf(g), one - weight * charlie.directional_albedo(g.cos_o()));
                f = from_fn(|c| T::of(colour[c]) * lobe + under * f[c]);
            }
            if let Some((weight, gloss)) = &self.gloss {
                let weight = T::of(*weight);
                let specular = weight * gloss.fresnel.reflectance(g.cos_d) * shape;
                let under = one - weight * gloss.albedo.at(&g.wo);
                f = from_fn(|c| T::of(self.specular_color[c]) * specular + under * f[c]);
            }
            f = f.map(|f| T::of(self.dielectric) * f);
        }
        if let Some((weight, fresnel)) = &self.metal {
            f = from_fn(|c| f[c] + T::of(*weight) * fresnel[c].reflectance(g.cos_d) * shape);
        }
        if let Some((weight, gloss)) = &self.coat {
            let weight = T::of(*weight);
            let (specular, albedo) =
                gloss.as_ref().map_or((zero, zero), |gloss| (gloss.at(g), gloss.albedo.at(&g.wo)));
            let under = one - weight * albedo;
            f = from_fn(|c| weight * specular + under * T::of(self.filter[c]) * f[c]);
        }
        f
    }

    fn sampling(&self) -> Option<Sampling> {
        let gloss = self
            .gloss
            .as_ref()
            .map_or(0.0, |(weight, gloss)| weight * f64::from(gloss.albedo.average::<f32>()));
        let metal = self
            .metal
            .as_ref()
            .map_or(0.0, |(weight, fresnel)| weight * mean(fresnel.map(|f| f.reflectance(0.7))));
        let sheen = self.sheen.as_ref().map_or(0.0, |(weight, colour, _)| 0.2 * weight * mean(*colour));
        let specular = self.dielectric * gloss * mean(self.specular_color) + metal;
        let coat = self.coat.as_ref().and_then(|(weight, gloss)| Some((weight, gloss.as_ref()?)));
        let coat = coat.map(|(weight, gloss)| {
            (weight * f64::from(gloss.albedo.average::<f32>()), Technique::HalfVector(gloss.distribution))
        });
        let below = [
            (specular, Technique::HalfVector(self.distribution)),
            (self.dielectric * (mean(self.body) + sheen), Technique::Cosine),
        ];
        Sampling::mixture(below.into_iter().chain(coat))
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let absent_is_zero = |name: &str| name == "coat_anisotropy" || name.starts_with("sheen");
    for parameter in MODEL.parameters.iter().filter(|parameter| !absent_is_zero(parameter.name)) {
        match parameter.kind {
            Kind::Colour { .. } => _ = p.colour(parameter.name)?,
            _ => _ = p.number(parameter.name)?,
        }
    }
    let number = |name: &str| p.number(name).unwrap_or(0.0);
    let colour = |name: &str| p.colour(name).unwrap_or([0.0; 3]);
    Some(Box::new(StandardSurface::new(&number, &colour)))
}
