//! What is left between materials in a scene that no search has seen.

use lookmatch_imaging::{Image, delta_e76_map, jod, nrmsd};
use lookmatch_materials::Material;
use lookmatch_rendering::{Illumination, Part, Renderer, Scene};
use rayon::prelude::*;

use super::direct::direct;
use super::matching::Remapped;
use crate::tables::channel_mean;
use crate::{Setting, Watch};

/// How far a picture is from another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Errors {
    /// Mean of the channels.
    pub(super) nrmsd: f64,
    /// Mean ΔE76.
    pub(super) delta_e: f64,
    /// ColorVideoVDP, 10 where nothing is seen.
    pub(super) jod: f64,
}

impl Errors {
    fn between(source: &Image, other: &Image) -> anyhow::Result<Self> {
        Ok(Self {
            nrmsd: channel_mean(nrmsd(source, other, None)?),
            delta_e: delta_e76_map(source, other)?.mean(None)?,
            jod: jod(source, other)?,
        })
    }
}

/// What is left of one material.
pub(super) struct Judged {
    /// Beside the measured material: the published ABC fit, the remap, the direct GGX fit.
    pub(super) measured: [Errors; 3],
    /// The remap beside the ABC fit.
    pub(super) remap: Errors,
}

/// The sphere of the reference scene under the light of the validation scenes.
pub(super) fn scene() -> Scene {
    let lit = Scene::spheres();
    Scene { environment: lit.environment, point_lights: lit.point_lights, ..Scene::reference() }
}

/// That scene, prepared.
pub(super) fn renderer(setting: &Setting, size: usize) -> anyhow::Result<Renderer> {
    Ok(Renderer::cached(&scene(), Illumination::All, size, &setting.cache, &|_| ())?)
}

/// Measured material, ABC fit, remap and direct fit.
pub(super) fn four(remapped: &Remapped) -> anyhow::Result<[Material; 4]> {
    let measured = Material::named(&format!("merl@{}", remapped.name))?;
    let direct = direct(&remapped.name, &measured)?;
    Ok([measured, remapped.source.clone(), remapped.target.clone(), direct])
}

/// Renders and judges all materials.
pub(super) fn judged(
    renderer: &Renderer,
    watch: &dyn Watch,
    all: &[Remapped],
) -> anyhow::Result<Vec<Judged>> {
    watch.begin("judging materials", all.len());
    let one = |remapped: &Remapped| -> anyhow::Result<Judged> {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        let materials = four(remapped)?;
        let images = renderer.render_batch(&materials.each_ref(), Part::Full);
        let [measured, abc, ours, direct] = [0, 1, 2, 3].map(|k| &images[k]);
        let beside = |other| Errors::between(measured, other);
        let judged = Judged {
            measured: [beside(abc)?, beside(ours)?, beside(direct)?],
            remap: Errors::between(abc, ours)?,
        };
        watch.advance(1);
        Ok(judged)
    };
    all.par_iter().map(one).collect()
}
