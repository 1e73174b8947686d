//! OpenPBR Surface 1.1, its opaque part: a mixture of a glossy diffuse dielectric and a metal, under a coat, under fuzz.
//!
//! From the bottom up, with F the exact dielectric reflectance, D the GGX distribution, G the height-correlated Smith masking, and
//! E(θ_o) the directional albedo of a lobe, here integrated and not approximated:
//!
//! ```text
//! α_x = r² √(2/(1 + (1 − a)²)),  α_y = (1 − a) α_x                        r roughness, a anisotropy
//! r'  = lerp(r, min(1, r⁴ + 2 r_c⁴)^¼, C)                                  roughness under a coat of weight C
//! η   = lerp(n, max(n/n_c, n_c/n), C),  ε = √(ξ F0(η)),  η' = (1 + ε)/(1 − ε)   specular weight ξ
//! f_d = c_s F(η') D G/(4 cos θ_i cos θ_o) + (1 − c_s E(θ_o)) f_EON           specular colour c_s
//! f_m = ξ F82(ρ, c_s) D G/(4 cos θ_i cos θ_o)                             ρ = base weight × base colour
//! f_b = lerp(f_d, f_m, metalness)
//! f_c = C F(n_c) D_c G_c/(4 cos θ_i cos θ_o) + lerp(1, T (1 − E_c(θ_o)), C) lerp(1, Δ, C δ) f_b
//! T   = coat_color^((1/μ_i + 1/μ_o)/2)                                    μ: cosines refracted into the coat
//! Δ   = (1 − K)/(1 − E_b K)                                               darkening by reflection inside the coat
//! f   = w c_f f_fuzz + (1 − w R(θ_o)) f_c                                 fuzz of weight w and colour c_f
//! ```
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `base_weight`, `base_color`, `base_diffuse_roughness`, `base_metalness` | body | 1, 0.8, 0, 0 |
//! | `specular_weight`, `specular_color`, `specular_roughness`, `specular_roughness_anisotropy`, `specular_ior` | its interface | 1, 1, 0.3, 0, 1.5 |
//! | `coat_weight`, `coat_color`, `coat_roughness`, `coat_roughness_anisotropy`, `coat_ior`, `coat_darkening` | clear coat | 0, 1, 0, 0, 1.6, 1 |
//! | `fuzz_weight`, `fuzz_color`, `fuzz_roughness` | fibres or dust | 0, 1, 0.5 |
//! | `energy_compensation` | `none`, or `turquin`: what the specification recommends | none |
//!
//! `turquin` multiplies the base's lobes by `1 + F0 (1 − E₁)/E₁`, E₁ being the albedo of a perfect reflector (Turquin 2019, eq. 16).
//!
//! Deviations: transmission, subsurface, thin film and emission are left out. α is at least 0.001, where the specification lets it be 0;
//! indices are at least 1, and a coat above a denser base reflects like the same pair upside down (as in MaterialX). K = lerp(F(θ_o), 1 − (1 − F̄)/n_c², r_b)
//! with the integrated average reflectance F̄ and the base's roughness `r_b = lerp(lerp(1, r, F0(η')), r, metalness)`; E_b is the base's colour, of a
//! metal times ξ. The fuzz is MaterialX's fit (see `fuzz.rs`). F82 is not let below 0. The compensation leaves the coat as it is.
//! Known defects: not reciprocal (every layer takes the light of the view direction from the one below); light that bounces between microfacets is lost
//! unless compensated. Renderers differ in the layering by 2 to 3 %.
//!
//! Checked against the conformance vectors (no fuzz, no compensation); the fuzz at one pair of directions against MaterialX 1.39.5's shader, written out
//! in another language. The compensation has no check beyond that white surfaces reflect all light.

use std::array::from_fn;

use crate::albedo::Albedo;
use crate::colour::mean;
use crate::conformance::Parameters;
use crate::distribution::Distribution;
use crate::fresnel::{Fresnel, f0_from_ior, mix};
use crate::fuzz::Fuzz;
use crate::layers::{F82, Gloss, albedo, facets, ggx};
use crate::masking::Masking;
use crate::model::{Family, Model, Values};
use crate::models::shared::*;
use crate::oren_nayar::Eon;
use crate::parameter::{Kind, Parameter, Role};
use crate::physically_based;
use crate::quadrature::Gauss;
use crate::{Bsdf, Geometry, Lobe, Real, Sampling, Technique};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "openpbr",
    title: "OpenPBR Surface",
    summary: "Layered material of the Academy Software Foundation: plastic, metal, clear coat and fuzz.",
    reference: "OpenPBR Surface 1.1 (ASWF 2024)",
    family: Family::Production,
    has_fresnel: true,
    is_reciprocal: false,
    parameters: &[
        unit_number(("base_weight", "w_b", Role::BaseWeight), 1.0, "Scale of the body's colour."),
        unit_colour(
            ("base_color", "ρ", Role::BaseColour),
            [0.8; 3],
            "Albedo of the diffuse reflection and reflectance of the metal, linear RGB.",
        ),
        unit_number(
            ("base_diffuse_roughness", "σ", Role::DiffuseRoughness),
            0.0,
            "Roughness of the diffuse reflection; 0 is Lambertian.",
        ),
        unit_number(("base_metalness", "M", Role::Metalness), 0.0, "Share of the metal."),
        unit_number(
            ("specular_weight", "ξ", Role::SpecularReflectance),
            1.0,
            "Scale of the reflectance at normal incidence, and of the metal.",
        ),
        unit_colour(
            ("specular_color", "c_s", Role::SpecularColour),
            [1.0; 3],
            "Tint of the specular lobe; of a metal, towards grazing angles.",
        ),
        perceptual_roughness(
            ("specular_roughness", "r", Role::PerceptualRoughness),
            0.3,
            "Roughness of the specular lobe; its square is α.",
        ),
        unit_number(
            ("specular_roughness_anisotropy", "a", Role::Anisotropy),
            0.0,
            "Stretch of the specular lobe along the tangent.",
        ),
        index(
            ("specular_ior", "n", Role::RefractiveIndex),
            LAYER_INDICES,
            1.5,
            "Index of refraction of the dielectric.",
        ),
        unit_number(("coat_weight", "C", Role::Coat), 0.0, "Presence of the clear coat."),
        unit_colour(
            ("coat_color", "c_c", Role::CoatColour),
            [1.0; 3],
            "Transmittance of the coat at normal incidence, in and out.",
        ),
        unit_number(
            ("coat_roughness", "r_c", Role::CoatRoughness),
            0.0,
            "Roughness of the coat; its square is α.",
        ),
        unit_number(
            ("coat_roughness_anisotropy", "a_c", Role::CoatShape),
            0.0,
            "Stretch of the coat's lobe along the tangent.",
        ),
        index(("coat_ior", "n_c", Role::CoatIndex), LAYER_INDICES, 1.6, "Index of refraction of the coat."),
        unit_number(
            ("coat_darkening", "δ", Role::CoatShape),
            1.0,
            "How much reflections inside the coat darken the base.",
        ),
        unit_number(("fuzz_weight", "w_f", Role::Sheen), 0.0, "Presence of the layer of fibres."),
        unit_colour(("fuzz_color", "c_f", Role::SheenColour), [1.0; 3], "Colour of the fibres."),
        unit_number(
            ("fuzz_roughness", "r_f", Role::SheenRoughness),
            0.5,
            "Roughness of the layer of fibres.",
        ),
        Parameter {
            name: "energy_compensation",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "Whether light that bounces between microfacets is made up for: none, or turquin.",
            kind: Kind::Choice { options: &["none", "turquin"] },
        },
    ],
    surveyed: &["specular_ior", "specular_roughness"],
    searched: &["specular_ior", "specular_roughness"],
    linear: &["coat_darkening", "fuzz_weight", "fuzz_color"],
    build: |v: &Values| {
        let compensated = v.choice("energy_compensation") == "turquin";
        let mut pbr = Openpbr::new(&|name| v.number(name), &|name| v.colour(name), compensated);
        pbr.fuzz =
            FuzzLayer::new(v.number("fuzz_weight"), v.colour("fuzz_color"), v.number("fuzz_roughness"));
        Box::new(pbr.with_free_lambert())
    },
    presets: physically_based::presets,
    vectors: Some(("openpbr", vector)),
    ..Model::BLANK
};

/// A surface of layers.
struct Openpbr {
    /// Lambert's reflection, where nothing lies above it.
    lambert: [f64; 3],
    base: Base,
    coat: Option<Coat>,
    fuzz: Option<FuzzLayer>,
}

/// The mixture of dielectric and metal.
struct Base {
    distribution: Distribution,
    /// Weight and diffuse reflection of the dielectric, if any.
    dielectric: Option<(f64, Eon)>,
    /// Albedo ρ of the diffuse reflection.
    colour: [f64; 3],
    roughness: f64,
    /// The interface above the diffuse reflection, with its tint and its reflectance at normal incidence.
    gloss: Option<Gloss>,
    specular_color: [f64; 3],
    f0: f64,
    /// Weight and reflectances of the metal, if any, and its reflectance at normal incidence.
    metal: Option<(f64, [F82; 3], [f64; 3])>,
    /// Albedo of a perfect reflector, where lost light is to be made up for.
    white: Option<Albedo>,
}

/// The clear coat.
struct Coat {
    weight: f64,
    gloss: Option<Gloss>,
    ior: f64,
    /// Half the logarithm of its colour; `None` where it is white.
    absorption: Option<[f64; 3]>,
    darkening: f64,
    /// K is the sum of the first and, times the reflectance at the view direction, the second.
    inside: [f64; 2],
    /// E_b.
    base: [f64; 3],
}

/// The layer of fibres.
struct FuzzLayer {
    weight: f64,
    colour: [f64; 3],
    fuzz: Fuzz,
}

impl FuzzLayer {
    fn new(weight: f64, colour: [f64; 3], roughness: f64) -> Option<Self> {
        (weight > 0.0).then(|| Self { weight, colour, fuzz: Fuzz::new(roughness) })
    }
}

impl Openpbr {
    fn new(number: &dyn Fn(&str) -> f64, colour: &dyn Fn(&str) -> [f64; 3], compensated: bool) -> Self {
        let (coat_weight, coat_ior) = (number("coat_weight"), number("coat_ior"));
        let (roughness, coat_roughness) = (number("specular_roughness"), number("coat_roughness"));
        let blurred = (roughness.powi(4) + 2.0 * coat_roughness.powi(4)).min(1.0).powf(0.25);
        let distribution =
            spread(mix(roughness, blurred, coat_weight), number("specular_roughness_anisotropy"));
        let (weight, metalness) = (number("specular_weight"), number("base_metalness"));
        let ior = number("specular_ior");
        let eta = modulated(mix(ior, (ior / coat_ior).max(coat_ior / ior), coat_weight), weight);
        let base_weight = number("base_weight");
        let rho = colour("base_color").map(|c| c * base_weight);
        let specular_color = colour("specular_color");
        let metal = (metalness * weight > 0.0)
            .then(|| (metalness * weight, from_fn(|c| F82::new(rho[c], specular_color[c])), rho));
        let diffuse_roughness = number("base_diffuse_roughness");
        let base = Base {
            distribution,
            dielectric: (metalness < 1.0)
                .then(|| (1.0 - metalness, Eon::new(base_weight, colour("base_color"), diffuse_roughness))),
            colour: rho,
            roughness: diffuse_roughness,
            gloss: if metalness < 1.0 { Gloss::new(distribution, eta) } else { None },
            specular_color,
            f0: f0_from_ior(eta),
            metal,
            white: compensated.then(|| albedo(&distribution, Fresnel::None)),
        };
        let coat = (coat_weight > 0.0).then(|| {
            let coat_color = colour("coat_color");
            let average = 1.0 - (1.0 - average_reflectance(coat_ior)) / (coat_ior * coat_ior);
            // A diffuse body scatters everywhere; its interface and a metal, as far as they are rough.
            let scattering = mix(mix(1.0, roughness, f0_from_ior(eta)), roughness, metalness);
            Coat {
                weight: coat_weight,
                gloss: Gloss::new(spread(coat_roughness, number("coat_roughness_anisotropy")), coat_ior),
                ior: coat_ior,
                absorption: (coat_color != [1.0; 3]).then(|| coat_color.map(|c| 0.5 * c.ln())),
                darkening: coat_weight * number("coat_darkening"),
                inside: [average * scattering, 1.0 - scattering],
                base: rho.map(|c| mix(c, weight * c, metalness)),
            }
        });
        Self { lambert: [0.0; 3], base, coat, fuzz: None }
    }

    /// Where nothing covers a smooth diffuse reflection, it is Lambert's term.
    fn with_free_lambert(mut self) -> Self {
        let uncovered = self.base.gloss.is_none() && self.coat.is_none() && self.fuzz.is_none();
        if let (true, Some((weight, _))) = (uncovered && self.base.roughness == 0.0, &self.base.dielectric) {
            self.lambert = self.base.colour.map(|c| c * weight);
            self.base.dielectric = None;
        }
        self
    }
}

/// α of a roughness and an anisotropy.
fn spread(roughness: f64, anisotropy: f64) -> Distribution {
    let across = 1.0 - anisotropy;
    let along = roughness * roughness * (2.0 / (1.0 + across * across)).sqrt();
    ggx([along, along * across])
}

/// The index whose reflectance at normal incidence is `weight` times that of `eta`.
fn modulated(eta: f64, weight: f64) -> f64 {
    let epsilon = (eta - 1.0).signum() * (weight * f0_from_ior(eta)).min(0.99999).sqrt();
    (1.0 + epsilon) / (1.0 - epsilon)
}

/// Reflectance of a smooth dielectric for light from everywhere, `2 ∫ F c dc`.
fn average_reflectance(eta: f64) -> f64 {
    let fresnel = Fresnel::Dielectric { eta };
    Gauss::new(48).on(0.0, 1.0).map(|(c, weight)| 2.0 * c * weight * fresnel.reflectance(c)).sum()
}

impl Base {
    #[inline(always)]
    fn at<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let one = T::one();
        let (gloss, metal) = (self.gloss.as_ref(), self.metal.as_ref());
        let shape = if gloss.is_some() || metal.is_some() {
            facets(&self.distribution, Masking::Correlated, g)
        } else {
            T::zero()
        };
        // (1 − E₁)/E₁, the light that a single reflection loses over that which it returns.
        let missing = self.white.as_ref().map_or(T::zero(), |white| white.at(&g.wo).recip() - one);
        let mut f = [T::zero(); 3];
        if let Some((weight, diffuse)) = &self.dielectric {
            let gain = one + T::of(self.f0) * missing;
            let (specular, albedo) = gloss.map_or((T::zero(), T::zero()), |gloss| {
                (gloss.fresnel.reflectance(g.cos_d) * shape * gain, (gloss.albedo.at(&g.wo) * gain).min(one))
            });
            let diffuse = diffuse.at(g);
            for (c, f) in f.iter_mut().enumerate() {
                let colour = T::of(self.specular_color[c]);
                *f = T::of(*weight) * (colour * specular + (one - colour * albedo) * diffuse[c]);
            }
        }
        if let Some((weight, fresnel, f0)) = metal {
            for (c, f) in f.iter_mut().enumerate() {
                let gain = one + T::of(f0[c]) * missing;
                *f = *f + T::of(*weight) * fresnel[c].at(g.cos_d) * gain * shape;
            }
        }
        f
    }
}

impl Coat {
    #[inline(always)]
    fn above<T: Real>(&self, base: [T; 3], g: &Geometry<T>) -> [T; 3] {
        let (one, weight) = (T::one(), T::of(self.weight));
        let (specular, albedo) =
            self.gloss.as_ref().map_or((T::zero(), T::zero()), |gloss| (gloss.at(g), gloss.albedo.at(&g.wo)));
        let reflectance = Fresnel::Dielectric { eta: self.ior }.reflectance(g.cos_o());
        let inside = T::of(self.inside[0]) + T::of(self.inside[1]) * reflectance;
        let over_ior2 = T::of(1.0 / (self.ior * self.ior));
        let path = |cos: T| (one - (one - cos * cos) * over_ior2).max(T::of(1e-12)).sqrt().recip();
        let length = path(g.cos_i()) + path(g.cos_o());
        from_fn(|c| {
            let transmittance = self.absorption.map_or(one, |logarithm| (T::of(logarithm[c]) * length).exp());
            let darkened = (one - inside) / (one - T::of(self.base[c]) * inside);
            let under = one + weight * (transmittance * (one - albedo) - one);
            let under = under * (one + T::of(self.darkening) * (darkened - one));
            weight * specular + under * base[c]
        })
    }
}

impl FuzzLayer {
    #[inline(always)]
    fn above<T: Real>(&self, base: [T; 3], g: &Geometry<T>) -> [T; 3] {
        let reflected = T::of(self.weight) * self.fuzz.albedo(g.cos_o());
        let lobe = reflected * self.fuzz.at(g);
        from_fn(|c| T::of(self.colour[c]) * lobe + (T::one() - reflected) * base[c])
    }
}

impl Lobe for Openpbr {
    fn diffuse(&self) -> [f64; 3] {
        self.lambert
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let mut f = self.base.at(g);
        if let Some(coat) = &self.coat {
            f = coat.above(f, g);
        }
        if let Some(fuzz) = &self.fuzz {
            f = fuzz.above(f, g);
        }
        f
    }

    fn sampling(&self) -> Option<Sampling> {
        let base = &self.base;
        let dielectric = base.dielectric.as_ref().map_or(0.0, |(weight, _)| *weight);
        let gloss = base.gloss.as_ref().map_or(0.0, |gloss| gloss.albedo.average::<f32>().into());
        let metal = base.metal.as_ref().map_or(0.0, |(weight, f, _)| weight * mean(f.map(|f| f.average())));
        let specular = dielectric * gloss * mean(base.specular_color) + metal;
        let coat = self.coat.as_ref().and_then(|coat| Some((coat.weight, coat.gloss.as_ref()?)));
        let fuzz = self.fuzz.as_ref().map_or(0.0, |fuzz| 0.2 * fuzz.weight * mean(fuzz.colour));
        let coat = coat.map(|(weight, gloss)| {
            (weight * f64::from(gloss.albedo.average::<f32>()), Technique::HalfVector(gloss.distribution))
        });
        let below = [
            (specular, Technique::HalfVector(base.distribution)),
            (dielectric * mean(base.colour) + fuzz, Technique::Cosine),
        ];
        Sampling::mixture(below.into_iter().chain(coat))
    }
}

/// The BSDF of a conformance vector.
fn vector(p: &Parameters) -> Option<Box<dyn Bsdf>> {
    let names = MODEL.parameters.iter().filter(|parameter| !parameter.name.starts_with("fuzz"));
    for parameter in names {
        match parameter.kind {
            Kind::Number { .. } => _ = p.number(parameter.name)?,
            Kind::Colour { .. } => _ = p.colour(parameter.name)?,
            _ => {}
        }
    }
    let number = |name: &str| p.number(name).unwrap_or(f64::NAN);
    let colour = |name: &str| p.colour(name).unwrap_or([f64::NAN; 3]);
    let mut pbr = Openpbr::new(&number, &colour, false);
    // The vectors follow F82 to its negative values.
    pbr.base.metal = pbr.base.metal.map(|(weight, f, f0)| (weight, f.map(F82::unclamped), f0));
    Some(Box::new(pbr))
}
