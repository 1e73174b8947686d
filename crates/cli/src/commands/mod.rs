//! One file for each command, and what several of them read from the command line.

pub(crate) mod apply;
pub(crate) mod apply_textures;
pub(crate) mod bench;
pub(crate) mod cache;
pub(crate) mod compare;
pub(crate) mod compare_pictures;
pub(crate) mod compose;
pub(crate) mod cross;
pub(crate) mod eval;
pub(crate) mod export;
pub(crate) mod fit;
pub(crate) mod inspect;
pub(crate) mod invert;
pub(crate) mod lint;
pub(crate) mod match_pictures;
pub(crate) mod models;
pub(crate) mod pairs;
pub(crate) mod remap;
pub(crate) mod render;
pub(crate) mod renderers;
pub(crate) mod scene;
pub(crate) mod validate;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use lookmatch_materials::Material;
use lookmatch_rendering::{EnvironmentLight, Illumination, Scene};

use crate::Usage;

/// A flag that Ctrl-C raises. Asked for once, by commands that end their work in order.
pub(crate) fn interruption() -> anyhow::Result<Arc<AtomicBool>> {
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = stopped.clone();
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("cannot listen for Ctrl-C")?;
    Ok(stopped)
}

/// A material from its text, its JSON, or a .json file.
pub(crate) fn material(text: &str) -> anyhow::Result<Material> {
    if text.ends_with(".json") && !text.trim_start().starts_with('{') {
        let content =
            std::fs::read_to_string(text).with_context(|| format!("cannot read material file '{text}'"))?;
        return Material::parse(&content).with_context(|| format!("material file '{text}'"));
    }
    Ok(Material::parse(text)?)
}

/// A scene under a light: `point`, `env`, `env:FILE` or `all`.
pub(crate) fn lit_scene(scene: &str, light: &str) -> anyhow::Result<(Scene, Illumination)> {
    let mut scene = Scene::load(scene)?;
    let illumination = match light.split_once(':') {
        Some(("env", file)) => {
            scene.environment = Some(EnvironmentLight::of(file));
            Illumination::Environment
        }
        None if light == "point" => Illumination::Point,
        None if light == "env" => Illumination::Environment,
        None if light == "all" => Illumination::All,
        _ => {
            return Err(Usage(format!("light '{light}' is unknown; use point, env, env:FILE or all")).into());
        }
    };
    Ok((scene, illumination))
}

/// Creates a folder with its parents.
pub(crate) fn create_folder(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot create folder '{}'", folder.display()))
}

/// Refuses a picture whose format is not one that is written, before any work is done.
pub(crate) fn check_picture(path: &Path) -> anyhow::Result<()> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if !matches!(extension.as_str(), "exr" | "png") {
        anyhow::bail!("cannot write '{}': a picture ends in .exr or .png", path.display());
    }
    check_output(path)
}

/// Refuses an output whose folder does not exist, before any work is done.
pub(crate) fn check_output(path: &Path) -> anyhow::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        anyhow::bail!("cannot write '{}': there is no folder '{}'", path.display(), folder.display());
    }
    if path.exists() && !path.is_file() {
        anyhow::bail!("cannot write '{}': it exists and is no ordinary file", path.display());
    }
    Ok(())
}
