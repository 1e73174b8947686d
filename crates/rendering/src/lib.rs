//! Scenes of spheres and meshes on a checkerboard, and two renderers of them behind one interface ([`Render`]): a fast,
//! noise-free one for searches ([`Renderer`], spheres alone) and a slow, exact one ([`PathTracer`]).
//!
//! # The noise-free renderer
//!
//! Nothing in such a scene changes from picture to picture but the material of the spheres. So the light that reaches
//! each visible point is prepared once ([`Renderer::prepare`]) and each further picture is a short weighted sum per pixel.
//! A [`TransportCache`] keeps it for the next program ([`Renderer::cached`]).
//! All sampling decisions belong to the scene: two pictures differ only by their material, the same material gives
//! the same bits, on any number of threads.
//!
//! What is transported: all direct light, hard shadows of point lights, all interreflection between each sphere and the
//! checkerboard, and (where they have a diffuse colour of their own) one diffuse bounce between spheres. What is left out:
//! the highlights of one sphere seen in another. `docs/engine.md` has the measured errors.

mod angles;
mod arcs;
mod bodies;
mod bounce;
mod cache;
mod designed_map;
mod environment;
mod error;
mod export;
mod field;
mod film;
mod flat;
mod functions;
mod gather;
mod grid;
mod highlights;
mod irradiance;
mod lobe_table;
mod lobes;
mod mesh;
mod path_tracer;
mod plane;
mod product;
mod pyramid;
mod render;
mod renderer;
mod returned;
mod rings;
mod rows;
mod sampling;
mod scene;
mod scenes;
mod source;
mod transport;

pub use cache::{Observe, Progress, TransportCache};
pub use designed_map::designed_map;
pub use environment::EnvironmentMap;
pub use error::SceneError;
pub use export::{EXPORT_FORMATS, ExportFormat, export};
pub use lobes::{DiffuseKey, Lobes, SplitLobes};
pub use path_tracer::{PathTracer, Spot, Wears};
pub use render::{RENDERERS, Render, RendererEntry};
pub use renderer::{Part, Renderer, SplitPlanes};
pub use scene::{Camera, EnvironmentLight, Illumination, Mesh, Plane, PointLight, Scene, Sphere};
pub use transport::Planes;

/// A linear RGB value in the first three lanes.
pub(crate) type Rgb = glam::Vec4;

/// Linear RGB from three numbers.
pub(crate) fn rgb(c: [f64; 3]) -> Rgb {
    Rgb::new(c[0] as f32, c[1] as f32, c[2] as f32, 0.0)
}
