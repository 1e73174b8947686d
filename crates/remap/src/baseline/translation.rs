//! MaterialX's published translations between material models.
//!
//! Source: MaterialX 1.39, `libraries/bxdf/translation/`: `standard_surface_to_usd.mtlx`, `standard_surface_to_gltf_pbr.mtlx`,
//! `standard_surface_to_open_pbr.mtlx` and `open_pbr_to_standard_surface.mtlx` (Apache-2.0, Academy Software Foundation). Each function
//! here is one of these graphs, written as formulas; what a graph computes for inputs that our models lack (transmission, subsurface,
//! thin film, emission, opacity, dispersion, the rotation of tangents, normals) is left out, at values at which it changes nothing.
//! Parameters that a graph has no output for (`coat_affect_color`, `masking`, `energy_compensation`, `variant`) stay as they are.

use lookmatch_materials::{Material, Value};

use crate::RemapError;

/// What a graph gives: names of target parameters with their values.
type Outputs = Vec<(&'static str, Value)>;
type Colour = [f64; 3];

/// The published translation of a material; `fixed` gives the target's parameters that it does not speak of. `None` where there is no
/// graph between the models.
///
/// # Errors
/// A value that the target cannot hold.
pub(super) fn translate(source: &Material, fixed: &Material) -> Result<Option<Material>, RemapError> {
    let graph = match (source.model().name, fixed.model().name) {
        ("standard-surface", "usd-preview-surface") => standard_surface_to_usd,
        ("standard-surface", "gltf") => standard_surface_to_gltf,
        ("standard-surface", "openpbr") => standard_surface_to_openpbr,
        ("openpbr", "standard-surface") => openpbr_to_standard_surface,
        _ => return Ok(None),
    };
    let mut target = fixed.clone();
    for (name, value) in graph(&Inputs(source))? {
        for index in target.model().resolve(name)? {
            target.set_value(index, value.clone())?;
        }
    }
    // The graph's target is a node whose workflow is that of metalness.
    if fixed.model().name == "usd-preview-surface" {
        target.set("use_specular_workflow", "0")?;
    }
    Ok(Some(target))
}

/// `standard_surface_to_usd.mtlx`: the weight and the colour of the specular lobe, and sheen, are dropped.
fn standard_surface_to_usd(s: &Inputs) -> Result<Outputs, RemapError> {
    let (coat, coat_color) = (s.number("coat")?, s.colour("coat_color")?);
    let base = scaled(s.colour("base_color")?, s.number("base")?);
    Ok(vec![
        ("diffuse_color", Value::Colour(product(base, attenuation(coat_color, coat)))),
        ("metallic", s.same("metalness")?),
        ("roughness", s.same("specular_roughness")?),
        ("ior", s.same("specular_IOR")?),
        ("clearcoat", Value::Number(mean(scaled(coat_color, coat)))),
        ("clearcoat_roughness", s.same("coat_roughness")?),
    ])
}

/// `standard_surface_to_gltf_pbr.mtlx`: the coat's index and stretch, and the roughness of the body, are dropped. A black coat is
/// taken for one without a colour.
fn standard_surface_to_gltf(s: &Inputs) -> Result<Outputs, RemapError> {
    let (coat, coat_color) = (s.number("coat")?, s.colour("coat_color")?);
    let base = scaled(s.colour("base_color")?, s.number("base")?);
    let (base_color, clearcoat) = match coat_color.iter().sum::<f64>() == 0.0 {
        true => (base, coat),
        false => (product(base, attenuation(coat_color, coat)), mean(scaled(coat_color, coat))),
    };
    let [wide, narrow] = anisotropic(s.number("specular_roughness")?, s.number("specular_anisotropy")?);
    let strength = if narrow < 1.0 { ((wide - narrow) / (1.0 - narrow)).sqrt() } else { 0.0 };
    let sheen = s.number("sheen")?;
    let sheen_roughness = if sheen > 0.0 { s.number("sheen_roughness")? } else { 0.0 };
    Ok(vec![
        ("base_color", Value::Colour(base_color)),
        ("metallic", s.same("metalness")?),
        ("roughness", Value::Number(narrow.sqrt())),
        ("anisotropy_strength", Value::Number(strength)),
        ("ior", s.same("specular_IOR")?),
        ("specular", s.same("specular")?),
        ("specular_color", s.same("specular_color")?),
        ("clearcoat", Value::Number(clearcoat)),
        ("clearcoat_roughness", s.same("coat_roughness")?),
        ("sheen_color", Value::Colour(scaled(s.colour("sheen_color")?, sheen))),
        ("sheen_roughness", Value::Number(sheen_roughness.sqrt())),
    ])
}

/// `standard_surface_to_open_pbr.mtlx`: a metal loses its coat, whose colour its base keeps; a black specular colour becomes white.
fn standard_surface_to_openpbr(s: &Inputs) -> Result<Outputs, RemapError> {
    let (coat, metalness) = (s.number("coat")?, s.number("metalness")?);
    let base = product(s.colour("base_color")?, attenuation(s.colour("coat_color")?, coat));
    let specular_color = s.colour("specular_color")?;
    let is_black = specular_color.iter().sum::<f64>() == 0.0;
    Ok(vec![
        ("base_weight", s.same("base")?),
        ("base_color", Value::Colour(base)),
        ("base_diffuse_roughness", s.same("diffuse_roughness")?),
        ("base_metalness", Value::Number(metalness)),
        ("specular_weight", if metalness > 0.0 { Value::Number(1.0) } else { s.same("specular")? }),
        ("specular_color", Value::Colour(if is_black { [1.0; 3] } else { specular_color })),
        ("specular_roughness", s.same("specular_roughness")?),
        ("specular_ior", s.same("specular_IOR")?),
        ("specular_roughness_anisotropy", s.same("specular_anisotropy")?),
        ("fuzz_weight", s.same("sheen")?),
        ("fuzz_color", s.same("sheen_color")?),
        ("fuzz_roughness", Value::Number(s.number("sheen_roughness")?.powf(0.4))),
        ("coat_weight", Value::Number(if coat * metalness > 0.0 { 0.0 } else { coat })),
        ("coat_color", s.same("coat_color")?),
        ("coat_roughness", s.same("coat_roughness")?),
        ("coat_roughness_anisotropy", s.same("coat_anisotropy")?),
        ("coat_ior", s.same("coat_IOR")?),
        ("coat_darkening", s.same("coat_affect_roughness")?),
    ])
}

/// `open_pbr_to_standard_surface.mtlx`: what reflections inside the coat darken is taken into the base's colour; the lobe under a coat
/// gets the coat's roughness.
fn openpbr_to_standard_surface(s: &Inputs) -> Result<Outputs, RemapError> {
    let (coat, base_color) = (s.number("coat_weight")?, s.colour("base_color")?);
    let darkening = base_darkening(
        s.number("coat_ior")?,
        // The albedo of the base, with a metal's scaled by the weight of the specular lobe.
        scaled(base_color, mix(1.0, s.number("specular_weight")?, s.number("base_metalness")?)),
    );
    let darkening = attenuation(darkening, coat * s.number("coat_darkening")?);
    let roughness = mix(s.number("specular_roughness")?, s.number("coat_roughness")?, coat);
    Ok(vec![
        ("base", s.same("base_weight")?),
        ("base_color", Value::Colour(product(base_color, darkening))),
        ("diffuse_roughness", s.same("base_diffuse_roughness")?),
        ("metalness", s.same("base_metalness")?),
        ("specular", s.same("specular_weight")?),
        ("specular_color", s.same("specular_color")?),
        ("specular_roughness", Value::Number(roughness)),
        ("specular_IOR", s.same("specular_ior")?),
        ("specular_anisotropy", s.same("specular_roughness_anisotropy")?),
        ("sheen", s.same("fuzz_weight")?),
        ("sheen_color", s.same("fuzz_color")?),
        ("sheen_roughness", Value::Number(s.number("fuzz_roughness")?.powf(2.5))),
        ("coat", Value::Number(coat)),
        ("coat_color", s.same("coat_color")?),
        ("coat_roughness", s.same("coat_roughness")?),
        ("coat_anisotropy", s.same("coat_roughness_anisotropy")?),
        ("coat_IOR", s.same("coat_ior")?),
        ("coat_affect_roughness", Value::Number(1.0)),
    ])
}

/// `(1 − K)/(1 − E K)` with `K = 1 − (1 − F0)/n²`: what is left of light that bounces between a base of albedo E and a coat of index n.
fn base_darkening(coat_ior: f64, albedo: Colour) -> Colour {
    let f0 = ((coat_ior - 1.0) / (coat_ior + 1.0)).powi(2);
    let k = 1.0 - (1.0 - f0) / (coat_ior * coat_ior);
    albedo.map(|e| (1.0 - k) / (1.0 - e * k))
}

/// α along and across the tangent (the node `roughness_anisotropy` of MaterialX's physically based library).
fn anisotropic(roughness: f64, anisotropy: f64) -> [f64; 2] {
    let (alpha, aspect) = (roughness * roughness, (1.0 - anisotropy.clamp(0.0, 0.98)).sqrt());
    [(alpha / aspect).min(1.0), alpha * aspect]
}

/// What a layer of a colour and a weight lets through.
fn attenuation(colour: Colour, weight: f64) -> Colour {
    colour.map(|c| mix(1.0, c, weight))
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    (1.0 - share) * a + share * b
}

fn scaled(colour: Colour, weight: f64) -> Colour {
    colour.map(|c| c * weight)
}

fn product(a: Colour, b: Colour) -> Colour {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

fn mean(colour: Colour) -> f64 {
    colour.iter().sum::<f64>() / 3.0
}

/// The source's parameters by name.
struct Inputs<'a>(&'a Material);

impl Inputs<'_> {
    fn same(&self, name: &str) -> Result<Value, RemapError> {
        Ok(self.0.values()[self.0.model().resolve(name)?[0]].clone())
    }

    fn number(&self, name: &str) -> Result<f64, RemapError> {
        Ok(self.0.number(name)?)
    }

    fn colour(&self, name: &str) -> Result<Colour, RemapError> {
        let value = self.same(name)?;
        Ok(value.colour().unwrap_or([self.number(name)?; 3]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn translated(source: &str, target: &str) -> Option<Material> {
        translate(&Material::parse(source).unwrap(), &Material::parse(target).unwrap()).unwrap()
    }

    /// Checks every value that is named, one number for each channel.
    fn expect(source: &str, target: &str, values: &[(&str, &[f64])]) {
        let target = translated(source, target).unwrap();
        for (name, wanted) in values {
            let index = target.model().resolve(name).unwrap()[0];
            let found = target.values()[index].numbers();
            let is_near = found.iter().zip(*wanted).all(|(a, b)| (a - b).abs() < 1e-4);
            assert!(found.len() == wanted.len() && is_near, "{name}: {found:?}, not {wanted:?}, in {target}");
        }
    }

    /// A coloured coat of weight 0.5 over a coloured body: it lets through (0.9, 0.75, 0.6).
    const COATED: &str = "standard-surface:base=0.5,base_color=0.8/0.4/0.2,diffuse_roughness=0.3,specular=0.7,\
        specular_color=1/0.9/0.8,specular_roughness=0.4,specular_IOR=1.6,specular_anisotropy=0.36,sheen=0.5,\
        sheen_color=0.2/0.4/0.6,sheen_roughness=0.25,coat=0.5,coat_color=0.8/0.5/0.2,coat_roughness=0.15,coat_anisotropy=0.1,\
        coat_IOR=1.4,coat_affect_roughness=0.6";

    #[test]
    fn standard_surface_to_usd_is_the_graph() {
        let more: &[(&str, &[f64])] = &[
            ("diffuse_color", &[0.36, 0.15, 0.06]),
            ("metallic", &[0.0]),
            ("roughness", &[0.4]),
            ("ior", &[1.6]),
            ("clearcoat", &[0.25]),
            ("clearcoat_roughness", &[0.15]),
        ];
        expect(COATED, "usd-preview-surface:use_specular_workflow=1", more);
        let target = translated(COATED, "usd-preview-surface:use_specular_workflow=1,variant=storm").unwrap();
        let text = target.to_string();
        assert!(!text.contains("use_specular_workflow=1") && text.contains("variant=storm"), "{text}");
    }

    #[test]
    fn standard_surface_to_gltf_is_the_graph() {
        // α = 0.16, aspect = 0.8: 0.2 along, 0.128 across; strength √(0.072/0.872).
        let more: &[(&str, &[f64])] = &[
            ("base_color", &[0.36, 0.15, 0.06]),
            ("roughness", &[0.35777]),
            ("anisotropy_strength", &[0.28735]),
            ("ior", &[1.6]),
            ("specular", &[0.7]),
            ("specular_color", &[1.0, 0.9, 0.8]),
            ("clearcoat", &[0.25]),
            ("clearcoat_roughness", &[0.15]),
            ("sheen_color", &[0.1, 0.2, 0.3]),
            ("sheen_roughness", &[0.5]),
        ];
        expect(COATED, "gltf", more);
        let black = "standard-surface:base_color=0.8/0.4/0.2,specular_roughness=1,coat=0.6,coat_color=0/0/0";
        let more: &[(&str, &[f64])] = &[
            ("base_color", &[0.8, 0.4, 0.2]),
            ("clearcoat", &[0.6]),
            ("roughness", &[1.0]),
            ("anisotropy_strength", &[0.0]),
            ("sheen_roughness", &[0.0]),
        ];
        expect(black, "gltf:sheen_roughness=0.3", more);
    }

    #[test]
    fn standard_surface_to_openpbr_is_the_graph() {
        let more: &[(&str, &[f64])] = &[
            ("base_weight", &[0.5]),
            ("base_color", &[0.72, 0.3, 0.12]),
            ("base_diffuse_roughness", &[0.3]),
            ("base_metalness", &[0.0]),
            ("specular_weight", &[0.7]),
            ("specular_color", &[1.0, 0.9, 0.8]),
            ("specular_roughness", &[0.4]),
            ("specular_ior", &[1.6]),
            ("specular_roughness_anisotropy", &[0.36]),
            ("fuzz_weight", &[0.5]),
            ("fuzz_color", &[0.2, 0.4, 0.6]),
            // 0.25^0.4 = 2^-0.8
            ("fuzz_roughness", &[0.57435]),
            ("coat_weight", &[0.5]),
            ("coat_color", &[0.8, 0.5, 0.2]),
            ("coat_roughness", &[0.15]),
            ("coat_roughness_anisotropy", &[0.1]),
            ("coat_ior", &[1.4]),
            ("coat_darkening", &[0.6]),
        ];
        expect(COATED, "openpbr", more);
        let metal = "standard-surface:base_color=0.8/0.8/0.8,metalness=0.5,specular=0.2,specular_color=0/0/0,coat=1,coat_color=0.5/1/1";
        let more: &[(&str, &[f64])] = &[
            ("base_color", &[0.4, 0.8, 0.8]),
            ("base_metalness", &[0.5]),
            ("specular_weight", &[1.0]),
            ("specular_color", &[1.0, 1.0, 1.0]),
            ("coat_weight", &[0.0]),
        ];
        expect(metal, "openpbr", more);
    }

    #[test]
    fn openpbr_to_standard_surface_is_the_graph() {
        // Index 1.5: F0 = 0.04, K = 1 − 0.96/2.25 = 0.573333. A half metal of weight 0.5 has an albedo of 0.75 times its colour: darkened to
        // 0.426667/(1 − 0.6 · 0.573333) = 0.650407 where that is 0.6, half of it with a coat of weight 0.5.
        let source = "openpbr:base_weight=0.9,base_color=0.8/0.4/0,base_diffuse_roughness=0.2,base_metalness=0.5,\
            specular_weight=0.5,specular_color=1/0.5/0.5,specular_roughness=0.3,specular_roughness_anisotropy=0.4,specular_ior=1.7,\
            coat_weight=0.5,coat_color=0.9/0.8/0.7,coat_roughness=0.1,coat_roughness_anisotropy=0.2,coat_ior=1.5,fuzz_weight=0.3,\
            fuzz_color=0.1/0.2/0.3,fuzz_roughness=0.25";
        let more: &[(&str, &[f64])] = &[
            ("base", &[0.9]),
            ("base_color", &[0.8 * 0.825203, 0.4 * 0.757649, 0.0]),
            ("diffuse_roughness", &[0.2]),
            ("metalness", &[0.5]),
            ("specular", &[0.5]),
            ("specular_color", &[1.0, 0.5, 0.5]),
            ("specular_roughness", &[0.2]),
            ("specular_IOR", &[1.7]),
            ("specular_anisotropy", &[0.4]),
            ("sheen", &[0.3]),
            ("sheen_color", &[0.1, 0.2, 0.3]),
            // 0.25^2.5 = 2^-5
            ("sheen_roughness", &[0.03125]),
            ("coat", &[0.5]),
            ("coat_color", &[0.9, 0.8, 0.7]),
            ("coat_roughness", &[0.1]),
            ("coat_anisotropy", &[0.2]),
            ("coat_IOR", &[1.5]),
            ("coat_affect_roughness", &[1.0]),
        ];
        expect(source, "standard-surface:coat_affect_color=0.3", more);
        let target = translated(source, "standard-surface:coat_affect_color=0.3").unwrap();
        assert_eq!(target.number("coat_affect_color").unwrap(), 0.3, "no graph speaks of it");
        // Without darkening, or without a coat, the colour stays.
        for more in ["coat_weight=0", "coat_weight=1,coat_darkening=0"] {
            expect(
                &format!("openpbr:{more},base_color=0.8/0.4/0.2"),
                "standard-surface",
                &[("base_color", &[0.8, 0.4, 0.2])],
            );
        }
    }

    #[test]
    fn other_pairs_have_none() {
        for (source, target) in [
            ("ward", "ggx"),
            ("gltf", "standard-surface"),
            ("usd-preview-surface", "standard-surface"),
            ("openpbr", "gltf"),
            ("standard-surface", "standard-surface"),
            ("standard-surface", "disney"),
        ] {
            assert!(translated(source, target).is_none(), "{source} to {target}");
        }
    }
}
