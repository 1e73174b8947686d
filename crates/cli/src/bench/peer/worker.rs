//! The peer as a process: requests and answers are lines of JSON, pictures are files.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, anyhow};
use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use lookmatch_rendering::{Scene, designed_map};
use serde::Deserialize;
use serde_json::{Value as Json, json};
use tempfile::TempDir;

use super::Installation;

/// What the process runs.
const SCRIPT: &str = include_str!("mitsuba_peer.py");
/// The sampler with the least error for its time, of those that Mitsuba has.
pub(super) const SAMPLER: &str = "multijitter";

/// A running peer with a scene under its environment.
pub(super) struct Worker {
    process: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
    /// Pictures and what the process says.
    folder: TempDir,
    pub(super) version: String,
}

/// A picture by the peer.
pub(super) struct Picture {
    pub(super) image: Image,
    pub(super) cost: Cost,
}

/// What a picture cost.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) struct Cost {
    /// CPU seconds of all threads.
    pub(super) cpu_s: f64,
    pub(super) wall_s: f64,
    /// Samples per pixel that were taken.
    pub(super) samples: u32,
}

impl Worker {
    /// Starts a variant of the peer with a metal in a scene under the designed environment map.
    pub(super) fn start(
        installation: &Installation,
        variant: &str,
        (scene, size): (&Scene, usize),
        material: &Material,
    ) -> anyhow::Result<Self> {
        let folder = TempDir::with_prefix("lookmatch-peer-").context("cannot create a temporary folder")?;
        let map = folder.path().join("environment.exr");
        lookmatch_imaging::write(&map, &with_rows_between(&designed_map()), &[])?;
        let log = File::create(folder.path().join("log")).context("cannot write to a temporary folder")?;
        let mut command = Command::new(&installation.python);
        command.arg("-c").arg(SCRIPT).arg(variant);
        if let Some(llvm) = &installation.llvm {
            command.env("DRJIT_LIBLLVM_PATH", llvm);
        }
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(log);
        let mut process = command.spawn().context("cannot start the peer")?;
        let requests = process.stdin.take().context("the peer has no input")?;
        let answers = BufReader::new(process.stdout.take().context("the peer has no output")?);
        let mut worker = Self { process, requests, answers, folder, version: String::new() };
        let answer = worker.ask(&json!({
            "scene": scene, "size": size, "material": material, "light": "environment",
            "environment_map": map, "sampler": SAMPLER,
        }))?;
        worker.version = answer["version"].as_str().unwrap_or_default().to_owned();
        Ok(worker)
    }

    /// Renders a picture with some number of samples per pixel.
    pub(super) fn render(&mut self, samples: u32, seed: u32) -> anyhow::Result<Picture> {
        let output = self.folder.path().join("picture.exr");
        let answer = self.ask(&json!({ "samples": samples, "seed": seed, "output": output }))?;
        let cost = serde_json::from_value(answer).context("the peer's answer is not understood")?;
        Ok(Picture { image: lookmatch_imaging::read(&output)?, cost })
    }

    fn ask(&mut self, request: &Json) -> anyhow::Result<Json> {
        let mut answer = String::new();
        let asked = writeln!(self.requests, "{request}").and_then(|()| self.requests.flush());
        if asked.is_err() || self.answers.read_line(&mut answer).unwrap_or(0) == 0 {
            return Err(anyhow!("the peer stopped: {}", last_words(&self.folder.path().join("log"))));
        }
        serde_json::from_str(&answer).with_context(|| format!("the peer's answer is not JSON: {answer}"))
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // Nothing can be done about a process that is gone already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The last line of a log that names an error, or says anything.
fn last_words(log: &Path) -> String {
    let text =
        std::fs::read(log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let mut lines = text.lines().rev().filter(|line| !line.trim().is_empty());
    let named = lines.clone().find(|line| line.to_lowercase().contains("error"));
    named.or_else(|| lines.next()).unwrap_or("it said nothing").to_owned()
}

/// The same map for the peer's look-up, whose first and last rows lie at the poles: with rows between ours that are
/// their means, its bilinear interpolation gives what ours does.
fn with_rows_between(map: &Image) -> Image {
    let (width, height) = (map.width(), map.height());
    Image::from_fn(width, 2 * height + 1, |x, row| {
        let [upper, lower] = [row.saturating_sub(1) / 2, (row / 2).min(height - 1)];
        let (a, b) = (map.get(x, upper), map.get(x, lower));
        std::array::from_fn(|c| (a[c] + b[c]) / 2.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_between_are_means() {
        let map = Image::from_fn(1, 2, |_, y| [1.0 + y as f32; 3]);
        let rows: Vec<f32> = with_rows_between(&map).pixels().iter().map(|p| p[0]).collect();
        assert_eq!(rows, [1.0, 1.0, 1.5, 2.0, 2.0]);
    }
}
