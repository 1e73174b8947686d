//! The built-in renderer: a scene prepared for one illumination, and pictures of materials in it.

use std::io;
use std::sync::LazyLock;

use glam::DVec3;
use lookmatch_imaging::{Image, Mask, luminance};
use lookmatch_materials::{Bsdf, Material, Role};
use rayon::prelude::*;

use crate::bodies::{Bodies, Body};
use crate::bounce::{Bounce, MODES, Weights};
use crate::cache::{Observe, Progress, TransportCache};
use crate::field::Field;
use crate::film::{EDGE_SUBSAMPLES, Film, SUBSAMPLES};
use crate::flat::{Flat, Reader, Writer};
use crate::gather;
use crate::highlights::Highlights;
use crate::lobes::{Expanded, Lobes, SplitLobes};
use crate::returned::{DiffuseLight, Returned};
use crate::rows::Rows;
use crate::scene::{Illumination, Scene};
use crate::source::Source;
use crate::transport::{Lobe, Planes, Transport};
use crate::{Rgb, SceneError};

#[cfg(test)]
mod accuracy;
mod dressed;

/// Which part of a material is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Diffuse and specular.
    Full,
    /// The diffuse reflection alone: see [`Material::diffuse_bsdf`].
    DiffuseOnly,
}

/// What subject pixels show of some materials, as planes of linear red, green and blue.
pub struct SplitPlanes {
    /// For each material, what its picture has beyond the diffuse one.
    pub specular: Vec<Planes>,
    /// Pictures of the diffuse reflections that differ, with what is behind the subjects at their silhouettes: see [`SplitLobes::diffuse_place`].
    pub diffuse: Vec<Planes>,
}

/// The light of the scene. Where the transport was read, it is baked when it is first needed: only lobes that are not
/// isotropic look it up.
type LazyField = LazyLock<Field, Box<dyn FnOnce() -> Field + Send + Sync>>;

/// The share of preparing a scene that is done when gathering its transport starts, about.
const PREPARED: f64 = 0.2;

/// A scene prepared for one illumination and picture size.
///
/// Subject pixels are those that see a sphere; everything else is the same in every picture.
pub struct Renderer {
    field: LazyField,
    bodies: Bodies,
    film: Film,
    /// What is seen beside the subjects, for every pixel.
    background: Vec<Rgb>,
    /// Indices of the subject pixels, by angle of view.
    subjects: Vec<u32>,
    /// Empty where the transport was read: it is made of them.
    rows: Rows,
    returned: Returned,
    /// The interreflection between subjects and checkerboard, …
    bounce: Option<Bounce>,
    /// … and, for pixels that see the checkerboard, what it sends there of an irradiance in each mode.
    board: Vec<(u32, [f32; MODES])>,
    highlights: Highlights,
    /// Prepared ring transport; without it, it is gathered anew for each picture.
    transport: Option<Transport>,
    mask: Mask,
}

impl Renderer {
    /// Prepares a scene for pictures of `size` × `size` pixels (1 to 8192).
    ///
    /// Spheres keep their own diffuse colours; see [`Scene::for_model`] for materials that have none.
    ///
    /// # Errors
    /// Where the scene lacks the light that is asked for, or its environment map cannot be read.
    pub fn prepare(scene: &Scene, illumination: Illumination, size: usize) -> Result<Self, SceneError> {
        Self::prepare_source(&Source::new(scene, illumination, size)?)
    }

    /// [`Renderer::prepare`] and [`Renderer::keep_transport`], or the same read from a cache. `observe` is told what happens.
    /// Jobs of one thread pool must not call this at the same time: they might wait for each other for ever.
    ///
    /// # Errors
    /// As [`Renderer::prepare`]: a cache that does not work is only warned of.
    pub fn cached(
        scene: &Scene,
        illumination: Illumination,
        size: usize,
        cache: &TransportCache,
        observe: Observe,
    ) -> Result<Self, SceneError> {
        cache.renderer(&Source::new(scene, illumination, size)?, observe)
    }

    /// Prepares a scene and its transport.
    pub(crate) fn build(source: &Source, observe: Observe) -> Result<Self, SceneError> {
        observe(Progress::Preparing(0.0));
        let renderer = Self::prepare_source(source)?;
        let share = |share| observe(Progress::Preparing(PREPARED + (1.0 - PREPARED) * share));
        share(0.0);
        Ok(renderer.keep_transport_observed(&share))
    }

    fn prepare_source(source: &Source) -> Result<Self, SceneError> {
        let (scene, field) = (&source.scene, source.bake()?);
        let film = Film::new(&scene.camera, source.size);
        let (background, hits) = look(&field, &film);
        let pixels: Vec<u32> = (0..hits.len() as u32).filter(|i| hits[*i as usize]).collect();
        let rows = Rows::new(&field, &film, &pixels);
        let subjects: Vec<u32> = rows.main.iter().map(|row| row.pixel).collect();
        let bounce = Bounce::prepare(scene, &field);
        let diffuse: Vec<DiffuseLight> = subjects
            .par_iter()
            .map(|pixel| DiffuseLight::of_pixel(scene, &field, &film, bounce.as_ref(), *pixel as usize))
            .collect();
        let board = bounce.as_ref().map_or(Vec::new(), |bounce| seen_modes(&field, &film, bounce));
        let highlights = Highlights::prepare(&field, &film, &subjects);
        let mask = subject_mask(scene, &film)?;
        Ok(Self {
            bodies: field.bodies.clone(),
            field: LazyLock::new(Box::new(|| field)),
            film,
            background,
            subjects,
            rows,
            returned: Returned::new(&diffuse),
            bounce,
            board,
            highlights,
            transport: None,
            mask,
        })
    }

    /// Keeps the ring transport for all further pictures: about 2 KB per subject pixel.
    pub fn keep_transport(self) -> Self {
        self.keep_transport_observed(&|_| ())
    }

    fn keep_transport_observed(mut self, observe: &(dyn Fn(f64) + Sync)) -> Self {
        if self.transport.is_none() {
            self.transport = Some(self.gathered(observe));
        }
        self
    }

    fn gathered(&self, observe: &(dyn Fn(f64) + Sync)) -> Transport {
        Transport::gather(&self.field, &self.film, &self.rows, self.bounce.as_ref(), observe)
    }

    /// A picture of a material, linear RGB, row 0 on top.
    pub fn render(&self, material: &Material, part: Part) -> Image {
        self.render_batch(&[material], part).swap_remove(0)
    }

    /// Pictures of several materials, in their order: the prepared light is read once for all.
    pub fn render_batch(&self, materials: &[&Material], part: Part) -> Vec<Image> {
        let worn_by_all = self.worn_by_all(materials, part);
        worn_by_all.iter().map(|(planes, weights)| self.developed(planes, |_| *weights)).collect()
    }

    /// What the subject pixels show of some materials, and what each adds to the checkerboard.
    fn worn_by_all(&self, materials: &[&Material], part: Part) -> Vec<(Planes, Weights)> {
        let bsdf = |m: &&Material| match part {
            Part::Full => m.bsdf(),
            Part::DiffuseOnly => m.diffuse_bsdf(),
        };
        let lobes = Lobes::new(materials.iter().map(bsdf).collect());
        let planes = self.subject_planes(&lobes);
        let materials = lobes.bsdfs.iter().zip(&lobes.expanded);
        let weights = materials.map(|(bsdf, expanded)| self.weights(&**bsdf, expanded.as_deref()));
        planes.into_iter().zip(weights).collect()
    }

    /// The irradiance that a material adds to the checkerboard, with or without its lobe.
    fn weights(&self, bsdf: &dyn Bsdf, lobe: Option<&Expanded>) -> Weights {
        let weights = |bounce: &Bounce| bounce.weights(lobe.map(|l| &l.bounce), bsdf.diffuse());
        self.bounce.as_ref().map_or([[0.0; 3]; MODES], weights)
    }

    /// The background with the subject pixels laid over it, and what is added to the checkerboard in each of the pixels that
    /// see it.
    fn developed(&self, planes: &Planes, weights: impl Fn(usize) -> Weights) -> Image {
        let mut image = Image::new(self.film.size, self.film.size);
        for (out, b) in image.pixels_mut().iter_mut().zip(&self.background) {
            *out = [b.x, b.y, b.z];
        }
        for (k, pixel) in self.subjects.iter().enumerate() {
            let out = &mut image.pixels_mut()[*pixel as usize];
            (0..3).for_each(|c| out[c] += planes[c][k]);
        }
        for (k, (pixel, modes)) in self.board.iter().enumerate() {
            let weights = weights(k);
            let out = &mut image.pixels_mut()[*pixel as usize];
            (0..3).for_each(|c| out[c] += modes.iter().zip(&weights).map(|(m, w)| m * w[c]).sum::<f32>());
        }
        image
    }

    /// Indices of the subject pixels in the picture, in the order of everything that is given for them: by angle of view.
    pub fn subjects(&self) -> &[u32] {
        &self.subjects
    }

    /// Side of the picture in pixels.
    pub fn size(&self) -> usize {
        self.film.size
    }

    /// Weights that fall from the middle of each sphere to its edge (Guarnera *et al.* 2018, 3.2); 0 elsewhere.
    pub fn mask(&self) -> &Mask {
        &self.mask
    }

    /// What each subject pixel shows of some materials, split into diffuse and specular reflection: the prepared light is
    /// read once for all.
    pub fn split_planes(&self, lobes: &SplitLobes) -> SplitPlanes {
        let mut diffuse = self.subject_planes(&lobes.diffuse);
        let mut specular = self.planes(&lobes.whole, &|material| !lobes.is_plain[material]);
        specular.par_iter_mut().enumerate().filter(|(k, _)| !lobes.is_plain[*k]).for_each(|(k, planes)| {
            subtract(planes, &diffuse[lobes.diffuse_place(k)]);
        });
        diffuse.par_iter_mut().for_each(|planes| self.add_background(planes));
        SplitPlanes { specular, diffuse }
    }

    /// Adds what is seen beside the subjects in the pixels that they share with it.
    fn add_background(&self, planes: &mut Planes) {
        for (k, pixel) in self.subjects.iter().enumerate() {
            let background = self.background[*pixel as usize];
            (0..3).for_each(|c| planes[c][k] += background[c]);
        }
    }

    /// All that each subject pixel shows of some materials, for each as planes of linear red, green and blue.
    pub fn subject_planes(&self, lobes: &Lobes) -> Vec<Planes> {
        self.planes(lobes, &|_| true)
    }

    /// The planes of some materials: everything, or only what the lobes add to the Lambert term.
    fn planes(&self, lobes: &Lobes, is_whole: &(dyn Fn(usize) -> bool + Sync)) -> Vec<Planes> {
        let materials = lobes.bsdfs.par_iter().zip(&lobes.expanded);
        let waiting: Vec<Option<Lobe>> =
            materials.map(|(bsdf, expanded)| Some(self.lobe(&**bsdf, expanded.as_deref()?))).collect();
        let mut lit = self.lit(&waiting.iter().flatten().collect::<Vec<_>>()).into_iter();
        let lit: Vec<Option<(&Lobe, Planes)>> =
            waiting.iter().map(|lobe| lobe.as_ref().and_then(|lobe| Some((lobe, lit.next()?)))).collect();
        let materials = lobes.bsdfs.par_iter().zip(lit).enumerate();
        materials.map(|(k, (bsdf, lit))| self.finished(&**bsdf, lit, is_whole(k))).collect()
    }

    /// What the rings made of a lobe, with all that they do not hold.
    fn finished(&self, bsdf: &dyn Bsdf, lit: Option<(&Lobe, Planes)>, is_whole: bool) -> Planes {
        let without = self.weights(bsdf, None);
        let (mut planes, weights) = match lit {
            Some((lobe, mut image)) => {
                self.add_lights(bsdf, &mut image);
                (image, if is_whole { lobe.weights } else { difference(&lobe.weights, &without) })
            }
            None if is_whole => (self.black(), without),
            None => return self.black(),
        };
        if is_whole {
            self.returned.add_baked(bsdf.diffuse(), &mut planes);
        }
        self.returned.add(&weights, bsdf.diffuse(), &mut planes);
        planes
    }

    fn black(&self) -> Planes {
        std::array::from_fn(|_| vec![0.0; self.subjects.len()])
    }

    fn lobe<'a>(&self, bsdf: &dyn Bsdf, expanded: &'a Expanded) -> Lobe<'a> {
        let weights = self.weights(bsdf, Some(expanded));
        Lobe { weights, table: &expanded.table, is_isotropic: bsdf.is_isotropic() }
    }

    /// What the prepared light makes of lobes.
    fn lit(&self, lobes: &[&Lobe]) -> Vec<Planes> {
        match &self.transport {
            _ if lobes.is_empty() => Vec::new(),
            Some(transport) => transport.radiance(lobes),
            None => self.gathered(&|_| ()).radiance(lobes),
        }
    }

    /// Adds what the rings leave out of a lobe: small lights, or all of a lobe that is not isotropic.
    fn add_lights(&self, bsdf: &dyn Bsdf, planes: &mut Planes) {
        if bsdf.is_isotropic() { self.highlights.add(bsdf, planes) } else { self.add_directly(bsdf, planes) }
    }

    /// Adds a lobe that is not isotropic through the direct integral.
    fn add_directly(&self, bsdf: &dyn Bsdf, image: &mut Planes) {
        for (k, pixel) in self.gathered_pixels(bsdf, gather::SAMPLES).into_iter().enumerate() {
            (0..3).for_each(|c| image[c][k] += pixel[c]);
        }
    }

    /// The direct integral of a lobe with a chosen number of samples: slow, and independent of the ring transport.
    fn gathered_pixels(&self, bsdf: &dyn Bsdf, samples: u32) -> Vec<[f32; 3]> {
        let pixel = |(k, pixel): (usize, &u32)| {
            let lobe = gather::radiance(&self.field, &self.film, *pixel as usize, bsdf, samples);
            let sum = lobe + self.highlights.radiance(k, bsdf);
            [sum.x, sum.y, sum.z]
        };
        self.subjects.par_iter().enumerate().map(pixel).collect()
    }
}

impl Renderer {
    /// Writes what costs time to prepare.
    pub(crate) fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.slice(&self.background)?;
        out.slice(&self.subjects)?;
        self.returned.write(out)?;
        self.bounce.write(out)?;
        let (pixels, modes): (Vec<u32>, Vec<[f32; MODES]>) = self.board.iter().copied().unzip();
        out.slice(&pixels)?;
        out.slice(&modes)?;
        self.highlights.write(out)?;
        self.transport.write(out)
    }

    /// Reads what was written for the same source.
    pub(crate) fn read(source: &Source, input: &mut Reader) -> io::Result<Self> {
        let film = Film::new(&source.scene.camera, source.size);
        let mask = subject_mask(&source.scene, &film).map_err(io::Error::other)?;
        let bodies = Bodies::new(&source.scene);
        let source = source.clone();
        // The file of the map may be gone by now: its content was read with the source, and baked before under the same key.
        let bake = move || source.bake_apart().expect("the same content was baked before");
        Ok(Self {
            bodies,
            field: LazyLock::new(Box::new(bake)),
            film,
            background: input.vec()?,
            subjects: input.vec()?,
            rows: Rows::default(),
            returned: Flat::read(input)?,
            bounce: Flat::read(input)?,
            board: input.vec()?.into_iter().zip(input.vec()?).collect(),
            highlights: Flat::read(input)?,
            transport: Flat::read(input)?,
            mask,
        })
    }
}

impl Scene {
    /// The share of each pixel of a picture that shows a sphere, 0 to 1, row 0 on top.
    pub fn coverage(&self, size: usize) -> Vec<f32> {
        let (film, bodies) = (Film::new(&self.camera, size), Bodies::new(self));
        let share = |pixel: usize| {
            let (points, count) = film.points(&bodies, pixel);
            points.len() as f32 / count as f32
        };
        (0..size * size).into_par_iter().map(share).collect()
    }

    /// The radial mask of its spheres in pictures of a size: see [`Renderer::mask`].
    ///
    /// # Errors
    /// A size that no picture has.
    pub fn mask(&self, size: usize) -> Result<Mask, SceneError> {
        subject_mask(self, &Film::new(&self.camera, size))
    }

    /// The scene as materials of a model see it: without diffuse colours of the subjects where the model has no diffuse
    /// reflectance.
    pub fn for_model(&self, model: &lookmatch_materials::Model) -> Self {
        let mut scene = self.clone();
        if !model.parameters.iter().any(|p| p.role == Role::DiffuseReflectance) {
            scene.spheres.iter_mut().for_each(|s| s.diffuse = None);
            scene.meshes.iter_mut().for_each(|m| m.diffuse = None);
        }
        scene
    }
}

fn subtract(planes: &mut Planes, others: &Planes) {
    for (plane, other) in planes.iter_mut().zip(others) {
        plane.iter_mut().zip(other).for_each(|(value, other)| *value -= other);
    }
}

fn difference(a: &Weights, b: &Weights) -> Weights {
    std::array::from_fn(|m| std::array::from_fn(|c| a[m][c] - b[m][c]))
}

/// What pixels see of the checkerboard for an irradiance in each mode.
fn seen_modes(field: &Field, film: &Film, bounce: &Bounce) -> Vec<(u32, [f32; MODES])> {
    let pixel = |pixel: u32| {
        let (directions, share) = beside_subjects(field, film, pixel as usize);
        let mut sums = [0.0; MODES];
        for direction in directions {
            if let Some((u, v, brightness)) = field.board_from(film.eye, direction) {
                let values = bounce.modes.at(u, v);
                (0..MODES).for_each(|m| sums[m] += share * brightness * values[m]);
            }
        }
        (sums != [0.0; MODES]).then_some((pixel, sums))
    };
    (0..(film.size * film.size) as u32).into_par_iter().filter_map(pixel).collect()
}

/// What every pixel sees beside the subjects, and which pixels see a subject.
fn look(field: &Field, film: &Film) -> (Vec<Rgb>, Vec<bool>) {
    let pixel = |pixel: usize| {
        let (directions, share) = beside_subjects(field, film, pixel);
        let radiance = |d: DVec3| field.background(film.eye, d, film.sample_angle());
        let sees_subject = !film.subject_points(&field.bodies, pixel, SUBSAMPLES).is_empty();
        (directions.into_iter().map(radiance).sum::<Rgb>() * share, sees_subject)
    };
    (0..film.size * film.size).into_par_iter().map(pixel).unzip()
}

/// The directions through a pixel's sub-pixel positions that meet no subject, and the share of the pixel that each stands for.
fn beside_subjects(field: &Field, film: &Film, pixel: usize) -> (Vec<DVec3>, f32) {
    let (points, count) = film.points(&field.bodies, pixel);
    let count = if points.is_empty() && is_edge(field, film, pixel) { EDGE_SUBSAMPLES } else { count };
    let is_beside = |d: &DVec3| !matches!(field.bodies.first(film.eye, *d, None), Some((_, Body::Sphere(_))));
    let directions: Vec<DVec3> = film.directions(pixel, count).filter(is_beside).collect();
    // Subjects that the first positions missed have no pixel: what is beside them fills it.
    let parts = if points.is_empty() { directions.len() as u32 } else { count };
    (directions, 1.0 / parts.max(1) as f32)
}

/// Luminances on the checkerboard lie on two sides of an edge where one is more than this multiple of the other.
const EDGE_CONTRAST: f32 = 1.02;

/// Whether an edge of the checkerboard, of its squares or of a shadow crosses a pixel.
fn is_edge(field: &Field, film: &Film, pixel: usize) -> bool {
    let on_board = |d| match field.bodies.first(film.eye, d, None) {
        Some((_, Body::Plane)) => Some(luminance(field.background(film.eye, d, 0.0).truncate().to_array())),
        _ => None,
    };
    let seen: Vec<Option<f32>> = film.directions(pixel, SUBSAMPLES).map(on_board).collect();
    let on_board = || seen.iter().flatten().copied();
    let (least, most) = (on_board().fold(f32::MAX, f32::min), on_board().fold(0.0, f32::max));
    let number = on_board().count();
    (number > 0 && number < seen.len()) || most > EDGE_CONTRAST * least
}

/// The radial mask of every sphere.
fn subject_mask(scene: &Scene, film: &Film) -> Result<Mask, SceneError> {
    let mut mask = Mask::disc(film.size, film.size, 0.0, 0.0, 0.0);
    for sphere in &scene.spheres {
        if let Some([x, y, radius]) = film.disc(sphere.centre.into(), sphere.radius) {
            mask = mask.union(&Mask::disc(film.size, film.size, x, y, radius))?;
        }
    }
    Ok(mask)
}
