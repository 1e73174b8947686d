//! Pictures that judge: a sphere under a light that no search has seen.

use lookmatch_imaging::{Image, jod, nrmsd};
use lookmatch_materials::Material;
use lookmatch_remap::{Baseline, Entry, Probe};
use lookmatch_rendering::{EnvironmentLight, Illumination, Part, Renderer, Scene};

use super::LIGHT;
use crate::tables::channel_mean;
use crate::{Setting, Watch};

/// The sphere, prepared.
pub(super) struct Judge {
    pub(super) scene: Scene,
    pub(super) renderer: Renderer,
}

/// How near a picture comes to the source's.
#[derive(Clone, Copy)]
pub(super) struct Nearness {
    /// Means of the channels: whole pictures, and with the radial mask.
    pub(super) nrmsd: [f64; 2],
    pub(super) jod: f64,
}

impl Nearness {
    pub(super) fn nrmsd(&self, masked: bool) -> f64 {
        self.nrmsd[usize::from(masked)]
    }
}

/// What became of a source point.
pub(super) struct Score {
    /// The probe's target, then those of the baselines that apply.
    pub(super) methods: Vec<Nearness>,
}

/// Names of what [`Score::methods`] holds.
pub(super) fn method_names() -> impl Iterator<Item = &'static str> {
    std::iter::once("probe").chain(Baseline::ALL.map(Baseline::title))
}

impl Judge {
    pub(super) fn new(setting: &Setting, watch: &dyn Watch, probe: &Probe) -> anyhow::Result<Self> {
        // Every pixel of an anisotropic lobe is a thousand directions.
        let size = if setting.is_quick { 48 } else { 80 };
        watch.begin("light of the sphere", 0);
        let scene = Scene { environment: Some(EnvironmentLight::balanced(LIGHT)?), ..Scene::reference() };
        let scene = scene.for_model(probe.from.model());
        let renderer = Renderer::cached(&scene, Illumination::All, size, &setting.cache, &|_| ())?;
        Ok(Self { scene, renderer })
    }

    pub(super) fn size(&self) -> usize {
        self.renderer.size()
    }

    pub(super) fn picture(&self, material: &Material) -> Image {
        self.renderer.render(material, Part::Full)
    }

    /// How near all entries' targets and the baselines' come.
    pub(super) fn scores(&self, probe: &Probe, watch: &dyn Watch) -> anyhow::Result<Vec<Score>> {
        watch.begin("judging", probe.entries.len());
        let score = |entry: &Entry| {
            let (source, target) = pair(probe, entry)?;
            let mut targets = vec![target];
            for rule in Baseline::ALL {
                targets.extend(rule.apply(&source, &probe.to)?);
            }
            let shown = self.picture(&source);
            let mut methods = Vec::new();
            for target in &targets {
                anyhow::ensure!(!watch.is_stopped(), "stopped");
                methods.push(self.nearness(&shown, &self.picture(target))?);
            }
            watch.advance(1);
            Ok(Score { methods })
        };
        probe.entries.iter().map(score).collect()
    }

    pub(super) fn nearness(&self, source: &Image, target: &Image) -> anyhow::Result<Nearness> {
        let of = |mask| nrmsd(source, target, mask).map(channel_mean);
        Ok(Nearness { nrmsd: [of(None)?, of(Some(self.renderer.mask()))?], jod: jod(source, target)? })
    }
}

/// The materials of an entry: the source and what the probe makes of it.
pub(super) fn pair(probe: &Probe, entry: &Entry) -> anyhow::Result<(Material, Material)> {
    let source = probe.source_material(&entry.source)?;
    let target = probe.target_material(&source, &entry.target, entry.body)?;
    Ok((source, target))
}
