//! Complex indices of metals per linear RGB channel; `presets/metals.md` has their sources and licence.

use std::sync::LazyLock;

use serde::Deserialize;

/// A metal against air.
#[derive(Debug, Deserialize)]
pub(crate) struct Metal {
    /// English name.
    pub name: String,
    /// Real part of the index, above 0.
    pub eta: [f64; 3],
    /// Imaginary part, 0 or more.
    pub k: [f64; 3],
}

static METALS: LazyLock<Vec<Metal>> =
    LazyLock::new(|| serde_json::from_str(include_str!("../presets/metals.json")).unwrap_or_default());

/// The names of all metals, in alphabetical order.
pub(crate) fn names() -> Vec<&'static str> {
    METALS.iter().map(|m| m.name.as_str()).collect()
}

/// The metal of a name, in British or American spelling.
pub(crate) fn by_name(name: &str) -> Option<&'static Metal> {
    let name = if name == "aluminum" { "aluminium" } else { name };
    METALS.iter().find(|m| m.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fresnel::Fresnel;
    use crate::models::by_name as model;
    use crate::{Material, Value};

    #[test]
    fn indices_are_valid_and_reflect_what_the_spectra_do() {
        let rows: Vec<serde_json::Value> =
            serde_json::from_str(include_str!("../presets/metals.json")).unwrap();
        assert_eq!(rows.len(), names().len());
        for (metal, row) in METALS.iter().zip(&rows) {
            // Gold's colour lies outside of sRGB: clipping the spectrum's red is not what projecting n and k does.
            let tolerance = if metal.name == "gold" { 0.032 } else { 0.009 };
            for c in 0..3 {
                let (eta, k) = (metal.eta[c], metal.k[c]);
                assert!(eta > 0.0 && k >= 0.0, "{metal:?}");
                let f0 = Fresnel::Conductor { eta, k }.reflectance(1.0);
                let exact = row["f0"][c].as_f64().unwrap().min(1.0);
                assert!((f0 - exact).abs() < tolerance, "{}: {f0} for {exact}", metal.name);
            }
        }
    }

    #[test]
    fn a_metal_is_a_conductor_where_that_is_a_choice() {
        for name in ["cook-torrance", "ashikhmin-shirley", "kulla-conty"] {
            let gold = Material::parse(&format!("{name}:conductor=gold")).unwrap();
            assert!(gold.is_conductor() && gold.canonical().f0.unwrap()[2] < 0.6, "{gold}");
        }
    }

    #[test]
    fn names_set_both_parts_of_the_index() {
        for name in ["ggx-conductor", "beckmann-conductor", "as"] {
            let read = |text: &str| Material::parse(&format!("{name}:{text}"));
            assert_eq!(read("conductor=iridium").unwrap(), Material::new(model(name).unwrap()));
            assert_eq!(read("conductor=aluminum").unwrap(), read("conductor=aluminium").unwrap());
            let gold = read("conductor=gold,roughness=0.1").unwrap();
            let k = gold.model().parameters.iter().position(|p| p.name == "k").unwrap();
            assert_eq!(gold.values()[k], Value::Colour([3.519, 2.33, 1.81]));
            assert!(read("conductor=gold,k=2").unwrap_err().to_string().contains("given twice"));
            assert!(read("conductor=gould").unwrap_err().to_string().contains("did you mean 'gold'?"));
        }
    }
}
