//! Ways to get target materials: a probe, and what people do without one.

use lookmatch_materials::Material;
use lookmatch_remap::{Baseline, Probe, apply};

use crate::nearest::Values;

/// A way to get targets, and what it made of some sources.
pub(crate) struct Method {
    /// `probe`, `copy`.
    pub(crate) title: &'static str,
    /// One for each source.
    pub(crate) targets: Vec<Material>,
}

impl Method {
    /// What a probe makes of some sources, interpolated as users get it.
    pub(crate) fn probe(title: &'static str, probe: &Probe, sources: &[Material]) -> anyhow::Result<Self> {
        let target = |source: &Material| apply(probe, source, true).map(|applied| applied.target);
        Ok(Self { title, targets: sources.iter().map(target).collect::<Result<_, _>>()? })
    }

    /// What the baselines make of them; those that do not apply are left out.
    pub(crate) fn baselines(probe: &Probe, sources: &[Material]) -> anyhow::Result<Vec<Self>> {
        let mut methods = Vec::new();
        for rule in Baseline::ALL {
            let targets = sources.iter().map(|source| rule.apply(source, &probe.to));
            let targets: Option<Vec<Material>> = targets.collect::<Result<_, _>>()?;
            methods.extend(targets.map(|targets| Self { title: rule.title(), targets }));
        }
        Ok(methods)
    }

    /// Index and roughness of its targets.
    pub(crate) fn values(&self) -> anyhow::Result<Vec<Values>> {
        let of = |target: &Material| Ok([target.number("ior")?, target.number("roughness")?]);
        self.targets.iter().map(of).collect()
    }

    /// Its targets with another index and roughness each.
    pub(crate) fn with_values(&self, values: &[Values]) -> anyhow::Result<Vec<Material>> {
        let with = |(target, [index, roughness]): (&Material, &Values)| {
            let mut target = target.clone();
            target.set_number("ior", *index)?;
            target.set_number("roughness", *roughness)?;
            Ok(target)
        };
        self.targets.iter().zip(values).map(with).collect()
    }
}
