//! The materials of the benchmark: fixed lists, so that figures of different runs can be compared.

use lookmatch_materials::{Material, MaterialError};

/// Widths of the lobe from nearly a mirror to nearly matt, evenly spread in their logarithm.
const ROUGHNESS: [f64; 6] = [0.01, 0.023, 0.055, 0.13, 0.3, 0.7];

/// Metals by name, with their complex index at the wavelengths of red, green and blue.
const METALS: [[&str; 2]; 4] = [
    ["gold", GOLD],
    ["silver", "eta=0.155/0.117/0.138,k=4.828/3.122/2.147"],
    ["copper", "eta=0.200/0.924/1.102,k=3.912/2.452/2.142"],
    ["iridium", "eta=2.501/2.114/1.705,k=5.183/4.670/3.910"],
];
const GOLD: &str = "eta=0.143/0.375/1.442,k=3.983/2.386/1.603";

/// Grey, green, pale, dark.
const ALBEDOS: [&str; 4] = ["0.5", "0.1/0.3/0.1", "0.8/0.7/0.6", "0.05"];
const INDICES: [f64; 4] = [1.5, 1.3, 1.8, 1.4];
const SPECULARS: [f64; 4] = [0.05, 0.2, 0.1, 0.4];

/// A material with a name for tables.
pub(crate) struct Named {
    pub(crate) name: String,
    pub(crate) material: Material,
}

impl Named {
    /// A material from its model, the name of its other values, these values, and the width of its lobe.
    fn new(model: &str, name: &str, values: &str, roughness: f64) -> Result<Self, MaterialError> {
        let material = Material::parse(&format!("{model}:{values},roughness={roughness}"))?;
        Ok(Self { name: format!("{model}, {name}, α = {roughness}"), material })
    }
}

/// The materials whose error is measured: three kinds of plastic and three of metal, six widths each.
pub(crate) fn surveyed() -> Result<Vec<Named>, MaterialError> {
    let plastic = |model: &str, k: usize| {
        let (albedo, index) = (ALBEDOS[k % 4], INDICES[k % 4]);
        let values = format!("diffuse={albedo},ior={index}");
        Named::new(model, &format!("index {index}, albedo {albedo}"), &values, ROUGHNESS[k])
    };
    let ward = |k: usize| {
        let (albedo, specular) = (ALBEDOS[k % 4], SPECULARS[k % 4]);
        let values = format!("diffuse={albedo},specular={specular}");
        Named::new("ward", &format!("specular {specular}, albedo {albedo}"), &values, ROUGHNESS[k])
    };
    let metal = |model: &str, k: usize, which: usize| {
        let [name, index] = METALS[which % 4];
        Named::new(model, name, index, ROUGHNESS[k])
    };
    let of_width = |k: usize| {
        [
            plastic("ggx", k),
            plastic("beckmann", k),
            ward(k),
            metal("ggx-conductor", k, k),
            metal("beckmann-conductor", k, k + 1),
            metal("as", k, k + 2),
        ]
    };
    (0..ROUGHNESS.len()).flat_map(of_width).collect()
}

/// A batch of `count` materials for timing, in equal parts GGX, Beckmann, Ward and metal; each run has its own.
pub(crate) fn batch(count: usize, run: usize) -> Result<Vec<Material>, MaterialError> {
    let text = |k: usize| {
        let roughness = 0.02 + 0.5 * k as f64 / count as f64 + 1e-4 * run as f64;
        match k % 4 {
            0 => format!("ggx:ior=1.5,roughness={roughness}"),
            1 => format!("beckmann:ior=1.7,roughness={roughness}"),
            2 => format!("ward:specular=0.1,roughness={roughness}"),
            _ => format!("ggx-conductor:{GOLD},roughness={roughness}"),
        }
    };
    (0..count).map(|k| Material::parse(&text(k))).collect()
}

/// A metal and a plastic that other renderers have too, for comparisons with them.
pub(crate) fn shared() -> Result<[Named; 2], MaterialError> {
    let plastic = Named::new("ggx", "index 1.5, albedo 0.5", "diffuse=0.5,ior=1.5", 0.1)?;
    Ok([Named::new("ggx-conductor", "gold", GOLD, 0.1)?, plastic])
}

/// A batch of `count` materials that differ in the width of their lobes.
pub(crate) fn of_all_widths(material: &Material, count: usize) -> Result<Vec<Material>, MaterialError> {
    let of_width = |k: usize| {
        let mut material = material.clone();
        material.set_number("roughness", 0.02 + 0.5 * k as f64 / count as f64)?;
        Ok(material)
    };
    (0..count).map(of_width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_material_occurs_twice() {
        let surveyed: Vec<Material> = surveyed().unwrap().into_iter().map(|n| n.material).collect();
        for list in [surveyed, batch(64, 0).unwrap()] {
            assert!(list.len() >= 30);
            assert!((1..list.len()).all(|k| !list[..k].contains(&list[k])));
        }
        assert!(batch(64, 0).unwrap().iter().zip(batch(64, 1).unwrap()).all(|(a, b)| *a != b));
    }
}
