//! Every model of the catalogue: what its pictures cost, and how far they are from converged ones.

use lookmatch_materials::{Material, registry};
use lookmatch_rendering::Illumination;
use serde::Serialize;

use super::accuracy::{Difference, differences};
use super::materials::Named;
use super::timing::pair_cpu_ms;
use super::{Effort, Stage};
use crate::output::bar;

/// Materials beside the models' defaults: lobes that are not isotropic go another way, and layers cost more.
const MORE: [&str; 5] = [
    "ggx:roughness_u=0.05,roughness_v=0.3",
    "ward:roughness_u=0.1,roughness_v=0.4",
    "openpbr:coat_weight=1,fuzz_weight=0.5,base_diffuse_roughness=0.5",
    "standard-surface:coat=1,sheen=0.5",
    "gltf:clearcoat=1,sheen_color=0.5",
];

/// What was measured of one material.
#[derive(Debug, Serialize)]
pub(crate) struct Measured {
    pub(crate) material: String,
    /// True where the rings hold it; false where it is integrated directly.
    pub(crate) isotropic: bool,
    /// A picture pair (point light and environment) as one of a batch, CPU milliseconds.
    pub(crate) image_pair_cpu_ms: f64,
    /// Under the environment.
    pub(crate) environment: Difference,
}

/// Measures every model that needs no file, with its default parameters, and some more.
pub(crate) fn measure(stage: &Stage, effort: &Effort) -> anyhow::Result<Vec<Measured>> {
    let names = registry().iter().filter(|m| m.load.is_none()).map(|m| m.name).chain(MORE);
    let named = |name: &str| Ok(Named { name: name.to_owned(), material: Material::parse(name)? });
    let all = names.map(named).collect::<anyhow::Result<Vec<Named>>>()?;
    let progress = bar(all.len(), "tracing paths of every model");
    let differences = differences(stage, Illumination::Environment, &all, effort, &progress)?;
    progress.finish_and_clear();
    let measured = |(Named { name, material }, environment): (Named, Difference)| {
        let isotropic = material.bsdf().is_isotropic();
        let (batch, runs) = if isotropic { (effort.batch, effort.runs) } else { (1, 1) };
        let image_pair_cpu_ms = pair_cpu_ms(stage, &vec![material; batch], runs)?;
        Ok(Measured { material: name, isotropic, image_pair_cpu_ms, environment })
    };
    all.into_iter().zip(differences).map(measured).collect()
}
