//! Blender's Principled BSDF, version 2 (Blender 4.0 and later), its opaque part, as Cycles evaluates it: sheen above coat above a mixture of metal and of a
//! glossy diffuse dielectric.
//!
//! Every layer adds its lobe and leaves `1 − max(albedo)` of the weight w to the layers below, the albedo being that of the view direction θ_o:
//!
//! ```text
//! sheen     w · sheen_weight · sheen_tint · R(θ_o) · LTC                    Zeltner, Burley & Chiang 2022
//! coat      w · coat_weight · F(coat_ior) g · D G/(4 cos θ_i cos θ_o)          then w · lerp(1, coat_tint^(1/cos θ_t), coat_weight)
//! metal     w · metallic · F82(base_color, specular_tint) g · D G/(4 cos θ_i cos θ_o)     then w · (1 − metallic)
//! specular  w · lerp(f0 · specular_tint, 1, s) g · D G/(4 cos θ_i cos θ_o)            s = (F(η) − F0(η))/(1 − F0(η))
//! diffuse   w · f_EON(base_color, diffuse_roughness)
//! f0 = 2 · specular_ior_level · F0(ior), η the index of that f0
//! α_x = roughness²/b, α_y = roughness² b, b = √(1 − 0.9 anisotropic)
//! g = 1 + F_ms (1 − E)/E, F_ms = F̄ Ē/(1 − F̄ (1 − Ē))                     1 for `distribution=ggx`, but for the coat
//! ```
//!
//! with D the GGX distribution, G the height-correlated Smith masking (`1/(1 + Λ_i + Λ_o)`), and E the albedo of an isotropic perfect reflector of
//! `α = √(α_x α_y)`. The specular layer's albedo is `g E · lerp(f0 · specular_tint, 1, s̄)`, s̄ being s averaged over the lobe; `g E` counts as 1 for
//! `distribution=ggx`.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `base_color`, `metallic`, `roughness`, `ior`, `diffuse_roughness` | body | 0.8, 0, 0.5, 1.5, 0 |
//! | `specular_ior_level`, `specular_tint`, `anisotropic` | specular lobe | 0.5, 1, 0 |
//! | `coat_weight`, `coat_roughness`, `coat_ior`, `coat_tint` | clear coat | 0, 0.03, 1.5, 1 |
//! | `sheen_weight`, `sheen_roughness`, `sheen_tint` | fibres | 0, 0.5, 1 |
//! | `distribution` | `multiscatter_ggx` or `ggx` | multiscatter_ggx |
//!
//! Written after the sources of Cycles 4.x (svm/closure.h, bsdf_microfacet.h, bsdf_util.h, bsdf_sheen.h, bsdf_oren_nayar.h); `diffuse_roughness` is Blender 4.3's.
//! Deviations: transmission, subsurface, thin film, emission, alpha, rotation of the tangent and bent normals are left out; E, Ē and s̄ are integrated
//! where Cycles interpolates tables of 32² and 16³; the sheen is a fit of the article's tables (see `fuzz.rs`); α is at least 0.001, where Cycles takes lobes of
//! `α_x α_y < 5e-7` for mirrors. Not compared with renderings
//! of Blender; white surfaces reflect all light, as its layering means them to. Known defects: not reciprocal; strongly anisotropic lobes gain light,
//! because g is that of a round lobe.

use std::array::from_fn;

use crate::albedo::Albedo;
use crate::colour::mean;
use crate::distribution::Distribution;
use crate::fresnel::{Fresnel, f0_from_ior, ior_from_f0, mix};
use crate::fuzz::Fuzz;
use crate::layers::{F82, albedo, facets, ggx};
use crate::masking::Masking;
use crate::model::{Family, Model, Values};
use crate::models::shared::*;
use crate::oren_nayar::Eon;
use crate::parameter::{Kind, Parameter, Role};
use crate::{Geometry, Lobe, Real, Sampling, Technique};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "principled",
    title: "Principled BSDF (Blender)",
    summary: "Layered material of Blender 4: plastic, metal, clear coat and sheen.",
    reference: "Blender 4.x, Cycles, Principled BSDF v2",
    family: Family::Production,
    has_fresnel: true,
    is_reciprocal: false,
    // Isotropic lobes stay below 1.
    largest_albedo: 1.1,
    parameters: &[
        unit_colour(
            ("base_color", "ρ", Role::BaseColour),
            [0.8; 3],
            "Albedo of the diffuse reflection and reflectance of the metal, linear RGB.",
        ),
        unit_number(("metallic", "M", Role::Metalness), 0.0, "Share of the metal."),
        perceptual_roughness(
            ("roughness", "r", Role::PerceptualRoughness),
            0.5,
            "Roughness of the specular lobe; its square is α.",
        ),
        index(
            ("ior", "n", Role::RefractiveIndex),
            LAYER_INDICES,
            1.5,
            "Index of refraction of the dielectric.",
        ),
        unit_number(
            ("diffuse_roughness", "σ", Role::DiffuseRoughness),
            0.0,
            "Roughness of the diffuse reflection; 0 is Lambertian.",
        ),
        unit_number(
            ("specular_ior_level", "l", Role::SpecularLevel),
            0.5,
            "Reflectance at normal incidence, as a multiple of twice that of the index: 0.5 leaves it as it is.",
        ),
        unit_colour(
            ("specular_tint", "c_s", Role::SpecularColour),
            [1.0; 3],
            "Tint of the reflectance at normal incidence; of a metal, towards grazing angles.",
        ),
        unit_number(
            ("anisotropic", "a", Role::Anisotropy),
            0.0,
            "Stretch of the specular lobe along the tangent.",
        ),
        unit_number(("coat_weight", "C", Role::Coat), 0.0, "Weight of the clear coat."),
        unit_number(
            ("coat_roughness", "r_c", Role::CoatRoughness),
            0.03,
            "Roughness of the coat; its square is α.",
        ),
        index(("coat_ior", "n_c", Role::CoatIndex), LAYER_INDICES, 1.5, "Index of refraction of the coat."),
        unit_colour(
            ("coat_tint", "c_c", Role::CoatColour),
            [1.0; 3],
            "Transmittance of the coat at normal incidence.",
        ),
        unit_number(("sheen_weight", "w_h", Role::Sheen), 0.0, "Weight of the layer of fibres."),
        unit_number(
            ("sheen_roughness", "r_h", Role::SheenRoughness),
            0.5,
            "Roughness of the layer of fibres.",
        ),
        unit_colour(("sheen_tint", "c_h", Role::SheenColour), [1.0; 3], "Colour of the fibres."),
        Parameter {
            name: "distribution",
            symbol: "-",
            role: Role::Variant,
            unit: "-",
            summary: "Whether light that bounces between microfacets is made up for: multiscatter_ggx, or ggx.",
            kind: Kind::Choice { options: &["multiscatter_ggx", "ggx"] },
        },
    ],
    surveyed: &["ior", "roughness"],
    searched: &["ior", "roughness"],
    linear: &["metallic", "sheen_weight"],
    build: |v: &Values| Box::new(Principled::new(v)),
    ..Model::BLANK
};

/// A surface of layers.
struct Principled {
    /// Lambert's reflection, where nothing lies above it.
    lambert: [f64; 3],
    sheen: Option<(f64, [f64; 3], Fuzz)>,
    coat: Option<Coat>,
    distribution: Distribution,
    /// Albedo of a perfect reflector as wide as the base's lobes, with its average.
    white: Option<(Albedo, f64)>,
    /// Weight, reflectances, and F_ms where lost light is made up for.
    metal: Option<(f64, [F82; 3], [f64; 3])>,
    /// Weight of what is not metal.
    dielectric: f64,
    interface: Option<Dielectric>,
    diffuse: Option<Eon>,
    base_color: [f64; 3],
}

/// The clear coat.
struct Coat {
    weight: f64,
    ior: f64,
    /// The logarithm of its colour; `None` where it is white.
    tint: Option<[f64; 3]>,
    distribution: Distribution,
    white: Albedo,
    interface: Option<Dielectric>,
}

/// An interface whose reflectance is lifted from that of an index to a tinted one.
struct Dielectric {
    fresnel: Fresnel,
    /// Albedo of the untinted interface.
    albedo: Albedo,
    /// F0 of the index, and the one that takes its place.
    f0: f64,
    tinted: [f64; 3],
    /// F_ms per channel; `None` where lost light is not made up for.
    multiple: Option<[f64; 3]>,
}

impl Dielectric {
    fn new(distribution: &Distribution, eta: f64, tint: [f64; 3], average: Option<f64>) -> Self {
        let (fresnel, f0) = (Fresnel::Dielectric { eta }, f0_from_ior(eta));
        let tinted = tint.map(|t| f0 * t);
        // Kulla & Conty's fit of the average reflectance.
        let share = (((eta - 1.0) / (4.08567 + 1.00071 * eta) - f0) / (1.0 - f0)).clamp(0.0, 1.0);
        let multiple = average.map(|average| tinted.map(|f0| repeated(mix(f0, 1.0, share), average)));
        Self { fresnel, albedo: albedo(&round(distribution), fresnel), f0, tinted, multiple }
    }

    /// How far a reflectance of the index lies between F0 and 1.
    #[inline(always)]
    fn share<T: Real>(&self, reflectance: T) -> T {
        ((reflectance - T::of(self.f0)) * T::of(1.0 / (1.0 - self.f0))).max(T::zero()).min(T::one())
    }

    /// The factors of the lobe, and the albedo of the whole, from the albedo of a perfect reflector.
    #[inline(always)]
    fn at<T: Real>(&self, g: &Geometry<T>, white: T) -> ([T; 3], T) {
        let one = T::one();
        let missing = (one - white) / white;
        let here = self.share(self.fresnel.reflectance(g.cos_d));
        let everywhere = self.share(self.albedo.at(&g.wo) / white);
        let lifted = |c: usize, share: T| {
            let f0 = T::of(self.tinted[c]);
            f0 + (one - f0) * share
        };
        let gain = |c: usize| self.multiple.map_or(one, |multiple| one + T::of(multiple[c]) * missing);
        let kept = |c: usize| if self.multiple.is_some() { gain(c) * white } else { one };
        let albedo = |c: usize| kept(c) * lifted(c, everywhere);
        (from_fn(|c| gain(c) * lifted(c, here)), albedo(0).max(albedo(1)).max(albedo(2)).min(one))
    }
}

/// F_ms: the colour of light that bounces between facets of an average reflectance, over that reflectance.
fn repeated(reflectance: f64, average: f64) -> f64 {
    reflectance * average / (1.0 - reflectance * (1.0 - average))
}

/// The isotropic distribution that stands for a stretched one in tables.
fn round(distribution: &Distribution) -> Distribution {
    let alpha = (distribution.alpha[0] * distribution.alpha[1]).sqrt();
    ggx([alpha; 2])
}

impl Principled {
    fn new(v: &Values) -> Self {
        let (metallic, base_color) = (v.number("metallic"), v.colour("base_color"));
        let compensated = v.choice("distribution") == "multiscatter_ggx";
        let alpha = v.number("roughness").powi(2);
        let aspect = (1.0 - 0.9 * v.number("anisotropic")).sqrt();
        let distribution = ggx([alpha / aspect, alpha * aspect]);
        let eta = lifted_index(v.number("ior"), v.number("specular_ior_level"));
        let glossy = metallic < 1.0 && eta != 1.0;
        let white = (glossy || compensated && metallic > 0.0).then(|| {
            let white = albedo(&round(&distribution), Fresnel::None);
            let average = f64::from(white.average::<f32>());
            (white, average)
        });
        let average = white.as_ref().filter(|_| compensated).map(|(_, average)| *average);
        let tint = v.colour("specular_tint");
        let metal: [F82; 3] = from_fn(|c| F82::new(base_color[c], tint[c]));
        let multiple = metal.map(|f82| average.map_or(0.0, |average| repeated(f82.average(), average)));
        let sheen_weight = v.number("sheen_weight");
        let sheen = (sheen_weight > 0.0)
            .then(|| (sheen_weight, v.colour("sheen_tint"), Fuzz::new(v.number("sheen_roughness"))));
        let coat = (v.number("coat_weight") > 0.0).then(|| Coat::new(v));
        let diffuse_roughness = v.number("diffuse_roughness");
        // Where nothing covers a smooth diffuse reflection, it is Lambert's term.
        let free = !glossy && sheen.is_none() && coat.is_none() && diffuse_roughness == 0.0;
        Self {
            lambert: if free { base_color.map(|c| c * (1.0 - metallic)) } else { [0.0; 3] },
            sheen,
            coat,
            distribution,
            metal: (metallic > 0.0).then_some((metallic, metal, multiple)),
            dielectric: 1.0 - metallic,
            interface: glossy.then(|| Dielectric::new(&distribution, eta, tint, average)),
            white,
            diffuse: (!free && metallic < 1.0).then(|| Eon::new(1.0, base_color, diffuse_roughness)),
            base_color,
        }
    }
}

/// The index whose reflectance at normal incidence is `2 level` times that of an index.
fn lifted_index(ior: f64, level: f64) -> f64 {
    if level == 0.5 { ior } else { ior_from_f0((2.0 * level * f0_from_ior(ior)).min(0.99)) }
}

impl Coat {
    fn new(v: &Values) -> Self {
        let distribution = ggx([v.number("coat_roughness").powi(2); 2]);
        let (ior, tint) = (v.number("coat_ior"), v.colour("coat_tint"));
        let white = albedo(&distribution, Fresnel::None);
        let average = Some(f64::from(white.average::<f32>()));
        Self {
            weight: v.number("coat_weight"),
            ior,
            tint: (tint != [1.0; 3]).then(|| tint.map(f64::ln)),
            distribution,
            white,
            interface: (ior != 1.0).then(|| Dielectric::new(&distribution, ior, [1.0; 3], average)),
        }
    }

    /// The coat's lobe, and what it leaves to the layers below.
    #[inline(always)]
    fn at<T: Real>(&self, g: &Geometry<T>) -> (T, [T; 3]) {
        let (one, weight) = (T::one(), T::of(self.weight));
        let (lobe, albedo) = self.interface.as_ref().map_or((T::zero(), T::zero()), |interface| {
            let (lobe, albedo) = interface.at(g, self.white.at(&g.wo));
            (lobe[0] * facets(&self.distribution, Masking::Correlated, g), albedo)
        });
        let under = one - weight * albedo;
        let cos2_t = one - (one - g.cos_o() * g.cos_o()) * T::of(1.0 / (self.ior * self.ior));
        let depth = cos2_t.max(T::of(1e-12)).sqrt().recip();
        let filter =
            self.tint.map(|logarithm| logarithm.map(|l| one + weight * ((T::of(l) * depth).exp() - one)));
        (weight * lobe, filter.map_or([under; 3], |filter| filter.map(|f| f * under)))
    }
}

impl Lobe for Principled {
    fn diffuse(&self) -> [f64; 3] {
        self.lambert
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let (zero, one) = (T::zero(), T::one());
        let (mut f, mut weight) = ([zero; 3], [one; 3]);
        if let Some((share, tint, fuzz)) = &self.sheen {
            let albedo = T::of(*share) * fuzz.albedo(g.cos_o());
            let lobe = albedo * fuzz.at(g);
            let most = tint.iter().fold(0.0, |most: f64, t| most.max(*t));
            f = tint.map(|t| T::of(t) * lobe);
            weight = [one - T::of(most) * albedo; 3];
        }
        if let Some(coat) = &self.coat {
            let (lobe, under) = coat.at(g);
            f = from_fn(|c| f[c] + weight[c] * lobe);
            weight = from_fn(|c| weight[c] * under[c]);
        }
        let lobed = self.metal.is_some() || self.interface.is_some();
        let shape = if lobed { facets(&self.distribution, Masking::Correlated, g) } else { zero };
        let white = self.white.as_ref().map_or(one, |(white, _)| white.at(&g.wo));
        if let Some((share, fresnel, multiple)) = &self.metal {
            let missing = (one - white) / white;
            let lobe = |c: usize| fresnel[c].at(g.cos_d) * (one + T::of(multiple[c]) * missing);
            f = from_fn(|c| f[c] + weight[c] * T::of(*share) * lobe(c) * shape);
        }
        weight = weight.map(|w| w * T::of(self.dielectric));
        if let Some(interface) = &self.interface {
            let (lobe, albedo) = interface.at(g, white);
            f = from_fn(|c| f[c] + weight[c] * lobe[c] * shape);
            weight = weight.map(|w| w * (one - albedo));
        }
        if let Some(diffuse) = &self.diffuse {
            let diffuse = diffuse.at(g);
            f = from_fn(|c| f[c] + weight[c] * diffuse[c]);
        }
        f
    }

    fn sampling(&self) -> Option<Sampling> {
        let interface = self.interface.as_ref().map_or(0.0, |i| f64::from(i.albedo.average::<f32>()));
        let metal = self.metal.as_ref().map_or(0.0, |(share, f, _)| share * mean(f.map(|f| f.average())));
        let sheen = self.sheen.as_ref().map_or(0.0, |(share, tint, _)| 0.2 * share * mean(*tint));
        let body = if self.diffuse.is_some() { self.dielectric * mean(self.base_color) } else { 0.0 };
        let coat = self.coat.as_ref().and_then(|coat| Some((coat, coat.interface.as_ref()?)));
        let coat = coat.map(|(coat, interface)| {
            let albedo = f64::from(interface.albedo.average::<f32>());
            (coat.weight * albedo, Technique::HalfVector(coat.distribution))
        });
        let below = [
            (self.dielectric * interface + metal, Technique::HalfVector(self.distribution)),
            (body + sheen, Technique::Cosine),
        ];
        Sampling::mixture(below.into_iter().chain(coat))
    }
}
