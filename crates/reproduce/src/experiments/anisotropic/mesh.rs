//! Figure 13: source and target on a mesh with tangents, by the path renderer.

use lookmatch_imaging::{Image, Mask};
use lookmatch_materials::Material;
use lookmatch_remap::Probe;
use lookmatch_rendering::{Illumination, Part, PathTracer, Scene};

use super::{Case, path};
use crate::album::{Album, Shown};
use crate::{Comparison, Setting, Watch};

/// The mesh.
const SCENE: &str = "shader-ball";
/// The colour of the body: dark, so that highlights are seen. The remap does not depend on it.
const BODY: &str = "0.03/0.05/0.1";
/// Rows of a picture that are rendered before a stop is looked for.
const ROWS: usize = 4;

/// One direction, isotropic, the other direction.
pub(super) fn comparisons(
    case: &Case,
    setting: &Setting,
    watch: &dyn Watch,
    album: &Album,
    probe: &Probe,
) -> anyhow::Result<Vec<Comparison>> {
    let (size, samples) = if setting.is_quick { (64, 8) } else { (200, 64) };
    // A lobe that is neither mirror-like nor rough.
    let last = probe.source_axes.get(3).map(|axis| axis.nearest(128.0));
    let places = path(case, probe, last);
    let chosen = [0, places.len() / 2, places.len() - 1].map(|k| places[k]);
    let scene = Scene::load(SCENE)?.for_model(probe.from.model());
    // The same seed for all pictures: the background's noise is common.
    let tracer = PathTracer::prepare(&scene, Illumination::All, size, samples, setting.seed)?;
    watch.begin("pictures of the mesh", 2 * chosen.len() * size.div_ceil(ROWS));
    let whole = Mask::uniform(size, size);
    let names = ["one direction", "isotropic", "the other direction"];
    let mut comparisons = Vec::new();
    for (k, (place, name)) in chosen.into_iter().zip(names).enumerate() {
        let entry = &probe.entries[place];
        let mut source = probe.source_material(&entry.source)?;
        // As many digits as anybody would type.
        let typed: Vec<f64> = entry.target.iter().map(|value| (1e4 * value).round() / 1e4).collect();
        let mut target = probe.target_material(&source, &typed, entry.body)?;
        [&mut source, &mut target].into_iter().try_for_each(|material| material.set("diffuse", BODY))?;
        let shown = |title, material: &Material| -> anyhow::Result<Shown> {
            Ok(Shown {
                title,
                material: material.to_string(),
                image: picture(&tracer, size, material, watch)?,
            })
        };
        let (source, target) = (shown("source", &source)?, shown("probe", &target)?);
        let title = format!("On a mesh, {name} (Figure 13)");
        comparisons.push(album.compare(&format!("mesh-{k}"), title, &source, &[target], &whole)?);
    }
    Ok(comparisons)
}

fn picture(
    tracer: &PathTracer,
    size: usize,
    material: &Material,
    watch: &dyn Watch,
) -> anyhow::Result<Image> {
    let mut pixels = Vec::with_capacity(size * size);
    let all: Vec<u32> = (0..(size * size) as u32).collect();
    for rows in all.chunks(ROWS * size) {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        pixels.extend(tracer.radiance(material, Part::Full, rows));
        watch.advance(1);
    }
    Ok(Image::from_fn(size, size, |x, y| pixels[y * size + x]))
}
