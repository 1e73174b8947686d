//! The scene of the benchmark, prepared under both lights.

use std::time::Instant;

use cpu_time::ProcessTime;
use lookmatch_rendering::{Illumination, Renderer, Scene};
use serde::Serialize;

use crate::output::spinner;

/// A scene prepared under its point light and its environment.
pub(crate) struct Stage {
    pub(crate) scene: Scene,
    pub(crate) point: Renderer,
    pub(crate) environment: Renderer,
}

/// What preparing both lights cost.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Preparation {
    /// CPU seconds of all threads.
    pub(crate) prepare_cpu_s: f64,
    /// Seconds on the clock, on all cores.
    pub(crate) prepare_wall_s: f64,
}

impl Stage {
    /// Prepares a scene with nothing kept from before: the full cost is what is measured, so that the cache of prepared
    /// light is bypassed.
    pub(crate) fn prepare(scene: &Scene, size: usize) -> anyhow::Result<(Self, Preparation)> {
        let progress = spinner("preparing the scene");
        let (cpu, wall) = (ProcessTime::now(), Instant::now());
        let prepare = |light| Renderer::prepare(scene, light, size).map(Renderer::keep_transport);
        let point = prepare(Illumination::Point)?;
        let environment = prepare(Illumination::Environment)?;
        let preparation = Preparation {
            prepare_cpu_s: cpu.elapsed().as_secs_f64(),
            prepare_wall_s: wall.elapsed().as_secs_f64(),
        };
        progress.finish_and_clear();
        Ok((Self { scene: scene.clone(), point, environment }, preparation))
    }

    /// The renderer for a light.
    pub(crate) fn renderer(&self, light: Illumination) -> &Renderer {
        if light == Illumination::Point { &self.point } else { &self.environment }
    }

    /// About `count` pixels of the subject, evenly spread over it and its silhouette.
    pub(crate) fn pixels(&self, count: usize) -> Vec<u32> {
        let subjects = self.environment.subjects();
        subjects.iter().copied().step_by((subjects.len() / count).max(1)).collect()
    }
}
