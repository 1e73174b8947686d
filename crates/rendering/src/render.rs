//! The renderers behind one interface, and their list. Adding one takes a file of its own and a line here.

use lookmatch_imaging::Image;
use lookmatch_materials::Material;

use crate::{Illumination, Observe, Part, PathTracer, Progress, Renderer, Scene, SceneError, TransportCache};

/// A scene prepared for one illumination and picture size, of which pictures are rendered.
pub trait Render: Send + Sync {
    /// Side of the pictures in pixels.
    fn size(&self) -> usize;

    /// A picture of a material, linear RGB, row 0 on top. The same material gives the same bits on any number of threads.
    fn render(&self, material: &Material, part: Part) -> Image;

    /// [`Render::render`], with the number of pixels that are done told now and then, from any thread. Renderers that take
    /// no time tell nothing.
    fn render_observed(&self, material: &Material, part: Part, observe: &(dyn Fn(usize) + Sync)) -> Image {
        let _ = observe;
        self.render(material, part)
    }
}

impl Render for Renderer {
    fn size(&self) -> usize {
        Renderer::size(self)
    }

    fn render(&self, material: &Material, part: Part) -> Image {
        Renderer::render(self, material, part)
    }
}

/// Prepares a scene for pictures of `size` × `size` pixels, with a number of samples per pixel and a seed for renderers
/// that take samples, and a cache for those whose preparation is worth keeping.
type Prepare = fn(
    scene: &Scene,
    illumination: Illumination,
    size: usize,
    samples: u32,
    seed: u64,
    cache: &TransportCache,
    observe: Observe,
) -> Result<Box<dyn Render>, SceneError>;

/// One renderer of the list.
#[derive(Clone, Copy, Debug)]
pub struct RendererEntry {
    /// What it is called.
    pub name: &'static str,
    /// One line for a list of renderers.
    pub about: &'static str,
    /// True where it takes samples, whose number and seed matter.
    pub is_sampled: bool,
    /// Prepares a scene.
    pub prepare: Prepare,
}

/// All renderers, the default first.
#[rustfmt::skip] // one line per renderer
pub static RENDERERS: [RendererEntry; 2] = [
    RendererEntry { name: "transport", about: "precomputed light: fast, without noise; spheres alone, one diffuse bounce", is_sampled: false, prepare: transport },
    RendererEntry { name: "path", about: "path tracing: slow, noisy, right; spheres and meshes, all bounces", is_sampled: true, prepare: path },
];

fn transport(
    scene: &Scene,
    light: Illumination,
    size: usize,
    _: u32,
    _: u64,
    cache: &TransportCache,
    observe: Observe,
) -> Result<Box<dyn Render>, SceneError> {
    if cache.keeps(size) {
        return Ok(Box::new(Renderer::cached(scene, light, size, cache, observe)?));
    }
    // A picture of a diffuse material can do without the transport, most of the work.
    observe(Progress::Preparing(0.0));
    Ok(Box::new(Renderer::prepare(scene, light, size)?))
}

fn path(
    scene: &Scene,
    light: Illumination,
    size: usize,
    samples: u32,
    seed: u64,
    _: &TransportCache,
    observe: Observe,
) -> Result<Box<dyn Render>, SceneError> {
    observe(Progress::Preparing(0.0));
    Ok(Box::new(PathTracer::prepare(scene, light, size, samples, seed)?))
}
