//! The built-in renderer: a scene prepared for one illumination, and pictures of materials in it.

use std::f32::consts::PI;

use lookmatch_imaging::{Image, Mask};
use lookmatch_materials::{Bsdf, Material, Role};
use rayon::prelude::*;

use crate::bodies::Body;
use crate::field::Field;
use crate::film::{Film, SUBSAMPLES, SurfacePoint};
use crate::gather;
use crate::highlights::Highlights;
use crate::irradiance::Place;
use crate::lobe_table::LobeTable;
use crate::scene::{Illumination, Scene};
use crate::transport::{PixelLight, gather_all};
use crate::{Rgb, SceneError, rgb};

#[cfg(test)]
mod accuracy;

/// Pixels that are rendered by one thread without a break.
const BLOCK: usize = 256;

/// Which part of a material is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Diffuse and specular.
    Full,
    /// Diffuse only, every specular reflectance set to 0.
    DiffuseOnly,
}

/// A scene prepared for one illumination and picture size.
///
/// Subject pixels are those that see a sphere; everything else is the same in every picture.
pub struct Renderer {
    field: Field,
    film: Film,
    /// What is seen beside the subjects, for every pixel.
    background: Vec<Rgb>,
    /// Indices of the subject pixels, ascending.
    subjects: Vec<u32>,
    diffuse: Vec<DiffuseLight>,
    highlights: Highlights,
    /// Prepared ring transport; without it, it is gathered anew for each picture.
    transport: Option<Vec<PixelLight>>,
    mask: Mask,
}

/// Light that leaves a subject pixel diffusely.
#[derive(Clone, Copy, Debug)]
struct DiffuseLight {
    /// From spheres with a colour of their own.
    own: Rgb,
    /// From the others, for an albedo of 1.
    white: Rgb,
}

impl Renderer {
    /// Prepares a scene for pictures of `size` × `size` pixels (1 to 8192).
    ///
    /// Spheres keep their own diffuse colours; see [`Scene::for_model`] for materials that have none.
    ///
    /// # Errors
    /// Where the scene lacks the light that is asked for, or its environment map cannot be read.
    pub fn prepare(scene: &Scene, illumination: Illumination, size: usize) -> Result<Self, SceneError> {
        scene.check_picture(illumination, size)?;
        if !scene.meshes.is_empty() {
            return Err(SceneError::NeedsPath { scene: scene.name.clone() });
        }
        let field = Field::bake(scene, illumination)?;
        let film = Film::new(&scene.camera, size);
        let (background, hits) = look(&field, &film);
        let subjects: Vec<u32> = (0..hits.len() as u32).filter(|i| hits[*i as usize]).collect();
        let diffuse = subjects.par_iter().map(|p| diffuse_light(scene, &field, &film, *p as usize)).collect();
        let highlights = Highlights::prepare(&field, &film, &subjects);
        let mask = subject_mask(scene, &film)?;
        Ok(Self { field, film, background, subjects, diffuse, highlights, transport: None, mask })
    }

    /// Keeps the ring transport for all further pictures: about 1 KB per subject pixel.
    pub fn keep_transport(mut self) -> Self {
        self.transport = Some(gather_all(&self.field, &self.film, &self.subjects));
        self
    }

    /// A picture of a material, linear RGB, row 0 on top.
    pub fn render(&self, material: &Material, part: Part) -> Image {
        self.render_batch(&[material], part).swap_remove(0)
    }

    /// Pictures of several materials, in their order: the prepared light is read once for all.
    pub fn render_batch(&self, materials: &[&Material], part: Part) -> Vec<Image> {
        let bsdfs: Vec<Box<dyn Bsdf>> = materials.iter().map(|m| m.bsdf()).collect();
        let bsdfs: Vec<&dyn Bsdf> = bsdfs.iter().map(|b| &**b).collect();
        let specular = match part {
            Part::Full => self.specular_batch(&bsdfs),
            Part::DiffuseOnly => vec![vec![[0.0; 3]; self.subjects.len()]; materials.len()],
        };
        materials.iter().zip(&specular).map(|(m, s)| self.developed(&self.diffuse_pixels(m), s)).collect()
    }

    /// The background with the subject pixels laid over it.
    fn developed(&self, diffuse: &[[f32; 3]], specular: &[[f32; 3]]) -> Image {
        let mut image = Image::new(self.film.size, self.film.size);
        for (out, b) in image.pixels_mut().iter_mut().zip(&self.background) {
            *out = [b.x, b.y, b.z];
        }
        for (k, pixel) in self.subjects.iter().enumerate() {
            let out = &mut image.pixels_mut()[*pixel as usize];
            (0..3).for_each(|c| out[c] += diffuse[k][c] + specular[k][c]);
        }
        image
    }

    /// Indices of the subject pixels in the picture, ascending.
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

    /// What the specular lobe adds to each subject pixel, linear RGB.
    pub fn specular_pixels(&self, bsdf: &dyn Bsdf) -> Vec<[f32; 3]> {
        self.specular_batch(&[bsdf]).swap_remove(0)
    }

    /// [`Renderer::specular_pixels`] of several materials at once, in their order: the prepared light is read once for all.
    pub fn specular_batch(&self, bsdfs: &[&dyn Bsdf]) -> Vec<Vec<[f32; 3]>> {
        let is_ring = |b: &&dyn Bsdf| b.sampling().is_some() && b.is_isotropic();
        let rings: Vec<usize> = (0..bsdfs.len()).filter(|i| is_ring(&bsdfs[*i])).collect();
        let mut images: Vec<Vec<[f32; 3]>> = bsdfs
            .iter()
            .map(|b| if is_ring(b) { Vec::new() } else { self.directly_integrated(*b) })
            .collect();
        let lobes: Vec<&dyn Bsdf> = rings.iter().map(|i| bsdfs[*i]).collect();
        for (i, image) in rings.into_iter().zip(self.ring_batch(&lobes)) {
            images[i] = image;
        }
        images
    }

    /// Isotropic lobes through the ring transport.
    fn ring_batch(&self, bsdfs: &[&dyn Bsdf]) -> Vec<Vec<[f32; 3]>> {
        let lobes: Vec<LobeTable> = bsdfs.par_iter().map(|b| LobeTable::new(*b)).collect();
        let count = bsdfs.len();
        if count == 0 {
            return Vec::new();
        }
        let block = |first: usize| -> Vec<Rgb> {
            let last = (first + BLOCK).min(self.subjects.len());
            let mut sums = vec![Rgb::ZERO; (last - first) * count];
            for (k, sums) in (first..last).zip(sums.chunks_mut(count)) {
                match &self.transport {
                    Some(transport) => transport[k].add_radiance(&lobes, sums),
                    None => PixelLight::gather(&self.field, &self.film, self.subjects[k] as usize)
                        .add_radiance(&lobes, sums),
                }
                sums.iter_mut().zip(bsdfs).for_each(|(sum, b)| *sum += self.highlights.radiance(k, *b));
            }
            sums
        };
        let firsts = (0..self.subjects.len()).into_par_iter().step_by(BLOCK);
        let blocks: Vec<Vec<Rgb>> = firsts.map(block).collect();
        let image = |m: usize| {
            let pixels = blocks.iter().flat_map(|sums| sums.iter().skip(m).step_by(count));
            pixels.map(|v| [v.x, v.y, v.z]).collect()
        };
        (0..count).into_par_iter().map(image).collect()
    }

    /// A lobe that is not isotropic through the direct integral; black where there is no lobe.
    fn directly_integrated(&self, bsdf: &dyn Bsdf) -> Vec<[f32; 3]> {
        if bsdf.sampling().is_none() {
            return vec![[0.0; 3]; self.subjects.len()];
        }
        self.gathered_pixels(bsdf, gather::SAMPLES)
    }

    /// What the diffuse term adds to each subject pixel, linear RGB.
    pub fn diffuse_pixels(&self, material: &Material) -> Vec<[f32; 3]> {
        let albedo = rgb(material.bsdf().diffuse());
        let radiance = |d: &DiffuseLight| {
            let sum = d.own + albedo * d.white;
            [sum.x, sum.y, sum.z]
        };
        self.diffuse.iter().map(radiance).collect()
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

impl Scene {
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

/// What every pixel sees beside the subjects, and which pixels see a subject.
fn look(field: &Field, film: &Film) -> (Vec<Rgb>, Vec<bool>) {
    let pixel = |pixel: usize| {
        let mut sum = Rgb::ZERO;
        let mut hit = false;
        for direction in film.directions(pixel, SUBSAMPLES) {
            match field.bodies.first(film.eye, direction, None) {
                Some((_, Body::Sphere(_))) => hit = true,
                _ => sum += field.background(film.eye, direction, film.sample_angle()),
            }
        }
        (sum / SUBSAMPLES as f32, hit)
    };
    (0..film.size * film.size).into_par_iter().map(pixel).unzip()
}

/// Diffuse light of one pixel. Point lights have hard shadows and are evaluated at each sub-pixel sample; the rest is
/// smooth and evaluated once per sphere, at the mean of its samples.
fn diffuse_light(scene: &Scene, field: &Field, film: &Film, pixel: usize) -> DiffuseLight {
    let points = film.subject_points(&field.bodies, pixel, SUBSAMPLES);
    let mut light = DiffuseLight { own: Rgb::ZERO, white: Rgb::ZERO };
    for (sphere, description) in scene.spheres.iter().enumerate() {
        let here: Vec<&SurfacePoint> = points.iter().filter(|p| p.sphere == sphere).collect();
        let Some(first) = here.first() else { continue };
        let normal = here.iter().map(|p| p.place.normal).sum::<glam::DVec3>().normalize();
        let mean = Place { position: field.bodies.point(sphere, normal), normal, body: first.place.body };
        let sharp: Rgb = here.iter().map(|p| field.point_irradiance(&p.place)).sum();
        let irradiance = sharp + field.smooth_irradiance(&mean) * here.len() as f32;
        let radiance = irradiance / (SUBSAMPLES as f32 * PI);
        match description.diffuse {
            Some(own) => light.own += rgb(own) * radiance,
            None => light.white += radiance,
        }
    }
    light
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
