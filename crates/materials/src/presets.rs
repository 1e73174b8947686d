//! Published fits of measured materials: named parameters of the models. Their origins, licences and conventions are in
//! `presets/README.md`.

use std::sync::LazyLock;

use crate::Preset;

const LOW: &str = "Löw et al. 2012 (MERL, metric E2), from bsdfbenchmark/bbm, BSD-3-Clause";
const LOW_ABC: &str = "Löw et al. 2012 (MERL, metric E2), from jdupuy/dj_brdf, public domain";
const NGAN: &str = "Ngan et al. 2005 (MERL), from bsdfbenchmark/bbm, BSD-3-Clause";

/// A table of fits of one model: a line of parameter names, then a line for each material.
struct Table {
    csv: &'static str,
    /// What stands before each name.
    prefix: &'static str,
    source: &'static str,
    /// Parameters that all fits share.
    shared: &'static [(&'static str, &'static str)],
}

impl Table {
    fn presets(&self) -> impl Iterator<Item = Preset> {
        let mut lines = self.csv.lines().map(|line| line.split(','));
        let names: Vec<&'static str> = lines.next().into_iter().flatten().skip(1).collect();
        lines.map(move |mut cells| {
            let name = format!("{}{}", self.prefix, cells.next().unwrap_or_default());
            let own = names.iter().copied().zip(cells.map(str::to_owned));
            let shared = self.shared.iter().map(|(name, value)| (*name, (*value).to_owned()));
            Preset { name, source: self.source, values: own.chain(shared).collect() }
        })
    }
}

/// A function that reads some tables once.
macro_rules! presets {
    ($(#[$doc:meta])* $name:ident: $(($file:literal, $prefix:literal, $source:expr, $shared:expr)),+ $(,)?) => {
        $(#[$doc])*
        pub(crate) fn $name() -> &'static [Preset] {
            static PRESETS: LazyLock<Vec<Preset>> = LazyLock::new(|| {
                let tables = [$(Table {
                    csv: include_str!(concat!("../presets/", $file)),
                    prefix: $prefix,
                    source: $source,
                    shared: $shared,
                }),+];
                tables.iter().flat_map(Table::presets).collect()
            });
            &PRESETS
        }
    };
}

presets!(
    /// Löw's microfacet model.
    low_abc: ("low2012-abc.csv", "", LOW_ABC, &[])
);
presets!(
    /// Löw's model of a smooth surface.
    low_smooth: ("low2012-smooth.csv", "", LOW, &[])
);
presets!(
    /// Ward's lobe in the two forms of Ngan et al.
    ward:
    ("ngan2005-ward.csv", "ngan-", NGAN, &[("variant", "ward")]),
    ("ngan2005-ward-duer.csv", "ngan-duer-", NGAN, &[("variant", "duer")]),
);
presets!(
    /// Blinn-Phong.
    blinn_phong: ("ngan2005-blinn-phong.csv", "ngan-", NGAN, &[("variant", "rtr")])
);
presets!(
    /// Lafortune's model with one lobe.
    lafortune: ("ngan2005-lafortune.csv", "ngan-", NGAN, &[("norm", "peak")])
);
presets!(
    /// Cook-Torrance in the forms of Ngan et al. and of Löw et al.
    cook_torrance:
    ("ngan2005-cook-torrance.csv", "ngan-", NGAN, &[("fresnel", "schlick"), ("variant", "pi")]),
    ("low2012-cook-torrance.csv", "low-", LOW, &[("fresnel", "dielectric"), ("variant", "1982")]),
);
presets!(
    /// Ashikhmin-Shirley in the forms of Ngan et al. and of Löw et al.
    ashikhmin_shirley:
    ("ngan2005-ashikhmin-shirley.csv", "ngan-", NGAN, &[("fresnel", "schlick"), ("coupling", "lambert")]),
    ("low2012-ashikhmin-shirley.csv", "low-", LOW, &[("fresnel", "dielectric"), ("coupling", "lambert")]),
);
