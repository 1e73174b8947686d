//! Presets of OpenPBR Surface from physicallybased.info; `presets/physically_based.md` has the licence and what is left out.

use std::sync::LazyLock;

use serde::Deserialize;

use crate::model::Preset;

/// A material as the data file has it: an opaque dielectric with an index, or a metal with the tint of its reflectance at 82°.
#[derive(Deserialize)]
struct Row {
    name: String,
    color: [f64; 3],
    metalness: f64,
    roughness: f64,
    ior: Option<f64>,
    f82: Option<[f64; 3]>,
}

static PRESETS: LazyLock<Vec<Preset>> = LazyLock::new(|| {
    let rows: Vec<Row> =
        serde_json::from_str(include_str!("../presets/physically_based.json")).unwrap_or_default();
    rows.into_iter().map(Row::preset).collect()
});

/// All presets, in the names of OpenPBR 1.1.
pub(crate) fn presets() -> &'static [Preset] {
    &PRESETS
}

impl Row {
    fn preset(self) -> Preset {
        let mut values = vec![
            ("base_color", colour(self.color)),
            ("base_metalness", self.metalness.to_string()),
            ("specular_roughness", self.roughness.to_string()),
        ];
        values.extend(self.ior.map(|ior| ("specular_ior", ior.to_string())));
        values.extend(self.f82.map(|tint| ("specular_color", colour(tint))));
        Preset { name: self.name, source: "physicallybased.info, CC0 1.0", values }
    }
}

/// A colour as it is written; metals whose colour lies outside of sRGB are clipped to what OpenPBR accepts.
fn colour(rgb: [f64; 3]) -> String {
    rgb.map(|v| v.clamp(0.0, 1.0).to_string()).join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value<'a>(preset: &'a Preset, name: &str) -> Option<&'a str> {
        preset.values.iter().find(|(n, _)| *n == name).map(|(_, v)| v.as_str())
    }

    #[test]
    fn metals_have_a_tint_and_dielectrics_an_index() {
        assert_eq!(presets().len(), 60);
        for preset in presets() {
            let metal = value(preset, "base_metalness") == Some("1");
            assert_eq!(value(preset, "specular_color").is_some(), metal, "{}", preset.name);
            assert_eq!(value(preset, "specular_ior").is_some(), !metal, "{}", preset.name);
            for (name, text) in &preset.values {
                let numbers: Vec<f64> = text.split('/').map(|v| v.parse().unwrap()).collect();
                let range = if *name == "specular_ior" { 1.0..=3.0 } else { 0.0..=1.0 };
                assert!(numbers.iter().all(|v| range.contains(v)), "{}: {name} = {text}", preset.name);
            }
        }
    }

    #[test]
    fn gold_is_clipped_to_what_a_colour_may_be() {
        let gold = presets().iter().find(|p| p.name == "gold").unwrap();
        assert_eq!(value(gold, "base_color"), Some("1/0.773/0.307"));
        assert_eq!(value(gold, "specular_color"), Some("0.971/1/0.994"));
    }
}
