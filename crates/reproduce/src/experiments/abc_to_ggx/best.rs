//! The best that GGX can do for the pictures that judge: every index and roughness of the lattice, each with the specular
//! reflectances that suit best. Beside it the same search as the remap's, by its metric, but on those pictures.

use lookmatch_imaging::{Columns, Image, inner_product, nrmsd};
use lookmatch_materials::Material;
use lookmatch_remap::{Plan, Stage};
use lookmatch_rendering::{Part, Renderer};
use rayon::prelude::*;

use super::judge::{renderer, scene};
use super::matching::{Remapped, remapped};
use crate::tables::channel_mean;
use crate::{Setting, Watch};

/// Side of the pictures.
const SIZE: usize = 128;
/// Lobes that are rendered at once.
const BATCH: usize = 48;

/// NRMSD beside the ABC fits, mean of the channels.
pub(super) struct Gap {
    pub(super) size: usize,
    pub(super) shapes: usize,
    /// Of the remap, by material.
    pub(super) ours: Vec<f64>,
    /// Of a remap by the same metric in the validation scene, by material.
    pub(super) there: Vec<f64>,
    /// Of the best GGX, by material.
    pub(super) best: Vec<f64>,
}

/// What a source's lobe adds to its picture, and how its channels are normalised.
struct Lobe {
    /// The picture of the source and of its body alone.
    whole: Image,
    planes: [Vec<f32>; 3],
    /// Squared lengths of the planes.
    squares: [f64; 3],
    /// NRMSD of a difference of length 1, by channel.
    units: [f64; 3],
}

/// The best target that was met.
#[derive(Clone, Copy)]
struct Best {
    nrmsd: f64,
    specular: [f64; 3],
    shape: [f64; 2],
}

pub(super) fn gap(
    setting: &Setting,
    watch: &dyn Watch,
    plan: &Plan,
    all: &[Remapped],
) -> anyhow::Result<Gap> {
    let renderer = renderer(setting, SIZE)?;
    let there = remapped_there(setting, watch, plan, all)?;
    let lobes: Vec<Lobe> =
        all.iter().map(|remapped| lobe(&renderer, &remapped.source)).collect::<Result<_, _>>()?;
    let [index, roughness] = [&plan.target_axes[1].levels, &plan.target_axes[2].levels];
    let shapes: Vec<[f64; 2]> = index.iter().flat_map(|i| roughness.iter().map(|r| [*i, *r])).collect();
    watch.begin("all lobes in the validation scene", shapes.len());
    let none = Best { nrmsd: f64::INFINITY, specular: [0.0; 3], shape: [0.0; 2] };
    let mut best = vec![none; lobes.len()];
    let black = renderer.render(&Material::parse("ggx:diffuse=0,specular=0")?, Part::Full);
    for batch in shapes.chunks(BATCH) {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        let material = |[i, r]: &[f64; 2]| Material::parse(&format!("ggx:diffuse=0,ior={i},roughness={r}"));
        let materials: Vec<Material> = batch.iter().map(material).collect::<Result<_, _>>()?;
        let images = renderer.render_batch(&materials.iter().collect::<Vec<_>>(), Part::Full);
        improve(&mut best, &lobes, batch, &images, &black);
        watch.advance(batch.len());
    }
    let beside = |lobe: &Lobe, target: &Material| -> anyhow::Result<f64> {
        Ok(channel_mean(nrmsd(&lobe.whole, &renderer.render(target, Part::Full), None)?))
    };
    let (mut ours, mut searched, mut bests) = (Vec::new(), Vec::new(), Vec::new());
    for (((remapped, there), lobe), best) in all.iter().zip(&there).zip(&lobes).zip(best) {
        let own = beside(lobe, &remapped.target)?;
        searched.push(beside(lobe, &there.target)?);
        // The lobe's share of the light that the board returns to the body is left out above, and not here.
        let found = beside(lobe, &dressed(&remapped.target, &best)?)?;
        ours.push(own);
        bests.push(found.min(own));
    }
    Ok(Gap { size: SIZE, shapes: shapes.len(), ours, there: searched, best: bests })
}

/// The remap of the same materials with the validation scene for a reference scene.
fn remapped_there(
    setting: &Setting,
    watch: &dyn Watch,
    plan: &Plan,
    all: &[Remapped],
) -> anyhow::Result<Vec<Remapped>> {
    let plan = Plan { scene: scene(), size: SIZE, ..plan.clone() };
    watch.begin("light of the validation scene, one by one", 0);
    let stage = Stage::cached(&plan, &setting.cache, &|_| ())?;
    let names: Vec<&str> = all.iter().map(|remapped| remapped.name.as_str()).collect();
    remapped(&plan, &stage, watch, &names)
}

/// A remap's target with another lobe.
fn dressed(target: &Material, best: &Best) -> anyhow::Result<Material> {
    let mut target = target.clone();
    target.set_number("ior", best.shape[0])?;
    target.set_number("roughness", best.shape[1])?;
    target.set("specular", &best.specular.map(|s| s.to_string()).join("/"))?;
    Ok(target)
}

fn lobe(renderer: &Renderer, source: &Material) -> anyhow::Result<Lobe> {
    let mut body = source.clone();
    body.set("a", "0")?;
    let mut images = renderer.render_batch(&[source, &body], Part::Full);
    let (body, whole) = (images.swap_remove(1), images.swap_remove(0));
    let planes = added(&whole, &body);
    let squares = planes.each_ref().map(|plane| inner_product(plane, plane));
    let units = std::array::from_fn(|c| {
        let values = whole.pixels().iter().map(|pixel| f64::from(pixel[c]));
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
        1.0 / ((planes[c].len() as f64).sqrt() * (high - low))
    });
    Ok(Lobe { whole, planes, squares, units })
}

/// What a picture has more than another, channel by channel.
fn added(whole: &Image, less: &Image) -> [Vec<f32>; 3] {
    let pixels = || whole.pixels().iter().zip(less.pixels());
    std::array::from_fn(|c| pixels().map(|(a, b)| a[c] - b[c]).collect())
}

/// Compares lobes of GGX at their best reflectance with all sources.
fn improve(best: &mut [Best], lobes: &[Lobe], shapes: &[[f64; 2]], images: &[Image], black: &Image) {
    let planes: Vec<[Vec<f32>; 3]> = images.par_iter().map(|image| added(image, black)).collect();
    let columns: [Columns; 3] = std::array::from_fn(|c| {
        let channel: Vec<&[f32]> = planes.iter().map(|planes| planes[c].as_slice()).collect();
        Columns::new(channel[0].len(), &channel)
    });
    let squares: Vec<[f64; 3]> =
        planes.iter().map(|planes| planes.each_ref().map(|plane| inner_product(plane, plane))).collect();
    best.par_chunks_mut(6).zip(lobes.par_chunks(6)).for_each(|(best, lobes)| {
        let products: [Vec<f64>; 3] = std::array::from_fn(|c| {
            columns[c].products(&lobes.iter().map(|lobe| lobe.planes[c].as_slice()).collect::<Vec<_>>())
        });
        for (row, (best, lobe)) in best.iter_mut().zip(lobes).enumerate() {
            for (k, shape) in shapes.iter().enumerate() {
                let product = |c: usize| products[c][row * shapes.len() + k];
                let specular = std::array::from_fn(|c| (product(c) / squares[k][c]).clamp(0.0, 1.0));
                let left = |c: usize| {
                    let s: f64 = specular[c];
                    let square = lobe.squares[c] - s * (2.0 * product(c) - s * squares[k][c]);
                    square.max(0.0).sqrt() * lobe.units[c]
                };
                let nrmsd = channel_mean([0, 1, 2].map(left));
                if nrmsd < best.nrmsd {
                    *best = Best { nrmsd, specular, shape: *shape };
                }
            }
        }
    });
}
