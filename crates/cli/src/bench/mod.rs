//! What `lookmatch bench` measures: speed and accuracy on this machine, alone or beside another renderer.
//!
//! Speed is CPU time, not wall time, so that other load on the machine matters little; the fastest of several runs
//! counts. Accuracy is the difference from converged pictures.

pub(crate) mod accuracy;
pub(crate) mod catalogue;
pub(crate) mod document;
pub(crate) mod machine;
mod materials;
pub(crate) mod peer;
mod stage;
mod timing;

use serde::Serialize;

use accuracy::Accuracy;
use lookmatch_renderers::Launch;
use lookmatch_rendering::Scene;
use machine::Machine;
use peer::PeerReport;
use stage::{Preparation, Stage};
use timing::Timing;

/// How much is measured.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Effort {
    /// Side of the pictures in pixels.
    pub(crate) size: usize,
    /// Pixels of the subject whose error is measured, about; evenly spread.
    pub(crate) pixels: usize,
    /// Paths per pixel of each of the two converged pictures.
    pub(crate) samples: u32,
    /// New materials in one batch.
    pub(crate) batch: usize,
    /// Repetitions of each timing; the fastest counts.
    pub(crate) runs: usize,
    /// Samples per pixel of the peer's pictures.
    pub(crate) peer_samples: [u32; 3],
    /// Samples per pixel of each of the peer's two best pictures.
    pub(crate) peer_converged: u32,
}

impl Effort {
    /// What published figures need: minutes.
    pub(crate) const FULL: Self = Self {
        size: 300,
        pixels: 100,
        samples: 6144,
        batch: 64,
        runs: 5,
        peer_samples: [16, 64, 256],
        peer_converged: 1024,
    };

    /// Enough to see that everything works: seconds.
    pub(crate) const QUICK: Self = Self {
        size: 32,
        pixels: 12,
        samples: 16,
        batch: 8,
        runs: 2,
        peer_samples: [4, 9, 16],
        peer_converged: 256,
    };
}

/// Everything that was measured in one run.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    #[serde(flatten)]
    pub(crate) timing: Timing,
    #[serde(flatten)]
    pub(crate) preparation: Preparation,
    #[serde(flatten)]
    pub(crate) accuracy: Accuracy,
    /// Every model of the catalogue.
    pub(crate) models: Vec<catalogue::Measured>,
    /// CPU time that the peer needs for a picture with our error, over ours in a batch: of the materials that were compared,
    /// the one with the least.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) equal_error_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) peer: Option<PeerReport>,
    pub(crate) effort: Effort,
    pub(crate) machine: Machine,
    pub(crate) version: &'static str,
    pub(crate) scene: Scene,
}

impl Report {
    /// Measures everything; `peer` is how the renderer to compare with is started.
    pub(crate) fn measure(effort: Effort, peer: Option<&Launch>) -> anyhow::Result<Self> {
        let scene = Scene::reference();
        let (stage, preparation) = Stage::prepare(&scene, effort.size)?;
        let timing = Timing::measure(&stage, &effort)?;
        let accuracy = Accuracy::measure(&stage, &effort)?;
        let models = catalogue::measure(&stage, &effort)?;
        let peer = peer.map(|p| PeerReport::measure(p, &stage, &effort)).transpose()?;
        Ok(Self {
            timing,
            preparation,
            accuracy,
            models,
            equal_error_ratio: peer.as_ref().map(PeerReport::equal_error_ratio),
            peer,
            effort,
            machine: Machine::this(),
            version: env!("CARGO_PKG_VERSION"),
            scene,
        })
    }
}
