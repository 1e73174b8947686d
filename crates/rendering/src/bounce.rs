//! Interreflection: what the subjects throw onto the checkerboard, and back again, for any material.
//!
//! Let E be the irradiance of the checkerboard that a material adds to what is baked. The spheres reflect the light of the
//! scene and that of the checkerboard: `E = S + T E`, where both the source S and the operator T are linear in the
//! coefficients of the lobe (see [`crate::rings`]) and in the diffuse albedo. So both are prepared for each coefficient. S is kept on a
//! grid; T, whose results are smooth, between a few functions χ. A material then costs a system of sixteen equations.
//!
//! What the pixels see of it is prepared for a few *modes* of E: the principal components of E over some typical lobes.

use std::f64::consts::{PI, TAU};
use std::io;

use fearless_simd::{Level, Simd, dispatch, prelude::*};
use glam::DVec3;
use lookmatch_materials::Material;
use nalgebra::{DMatrix, SMatrix, SVector};
use rayon::prelude::*;

use crate::Rgb;
use crate::angles::{map_direction, map_position};
use crate::arcs::{self, Density, FUNCTION_TERMS, FunctionMoments};
use crate::bodies::Body;
use crate::field::Field;
use crate::film::SurfacePoint;
use crate::flat::{Flat, Reader, Writer};
use crate::functions::{COUNT, Functions};
use crate::grid::Grid;
use crate::irradiance::Place;
use crate::lobe_table::LobeTable;
use crate::pyramid::Pyramid;
use crate::rings::{NODES, TERMS};
use crate::rows::View;
use crate::sampling::{cosine_direction, frame, zero_two};
use crate::scene::Scene;

/// Principal components of the added irradiance.
pub(crate) const MODES: usize = 6;
/// Angles of view that the operators are tabulated for: every fourth of those of a [`LobeTable`].
const ANGLES: usize = 9;
/// Basis functions of a ring that the operators know: the first terms of every node.
const ROW: usize = NODES * FUNCTION_TERMS;
/// Coefficients of a lobe that matter here.
const LOBE: usize = ANGLES * ROW;
/// Rays from a node of the grid to each sphere, near and far from it.
const RAYS: [u32; 2] = [256, 64];
/// Of these rays, each that has a multiple of this number also looks for what comes back.
const RETURNS: u32 = 4;
/// Distance of nodes that count as far, in radii of the sphere from its middle.
const FAR: f64 = 1.8;
/// Rays from a point of a sphere to the checkerboard.
const DIFFUSE_RAYS: u32 = 256;
/// Rings around the point that mirrors a point light, and samples on each.
const GLINTS: (usize, usize) = (128, 32);

/// For each mode and channel, its share of the added irradiance; channels count by the checkerboard's albedo, relative to
/// its luminance.
pub(crate) type Weights = [[f32; 3]; MODES];

/// The interreflection of a scene under its lights, prepared for all materials.
#[derive(Clone, Debug)]
pub(crate) struct Bounce {
    /// The modes on the checkerboard, by `u, v`.
    pub(crate) modes: Functions,
    /// What the checkerboard sends of an irradiance in each mode, as irradiance of each sphere, by the normal's `u, v`.
    on_spheres: Vec<Functions>,
    /// A channel's albedo relative to the luminance of the checkerboard's.
    tint: [f32; 3],
    /// The source in each mode and channel.
    direct: Operator,
    /// The source in each function χ and channel.
    source: Operator,
    /// From function to function.
    again: Operator,
    diffuse: Diffuse,
    /// Each function χ in each mode.
    lift: [[f32; COUNT]; MODES],
}

/// The same by diffuse reflection.
#[derive(Clone, Debug)]
struct Diffuse {
    /// For an albedo of 1, of the spheres that take the material's.
    direct: Weights,
    source: [[f32; 3]; COUNT],
    again: [[f32; COUNT]; COUNT],
    /// Of the spheres with a colour of their own, for each channel.
    own: [[[f32; COUNT]; COUNT]; 3],
}

/// Rows of numbers, each for a coefficient of the lobe.
#[derive(Clone, Debug)]
struct Operator {
    rows: Vec<f32>,
}

impl Operator {
    /// Row `i` times the coefficients.
    fn apply(&self, i: usize, lobe: &[f32; LOBE]) -> f32 {
        let row = &self.rows[i * LOBE..(i + 1) * LOBE];
        let level = Level::new();
        dispatch!(level, simd => dot(simd, row, lobe))
    }

    /// All rows times the coefficients.
    fn apply_all(&self, lobe: &[f32; LOBE], out: &mut [f32]) {
        let level = Level::new();
        dispatch!(level, simd => {
            for (row, out) in self.rows.chunks_exact(LOBE).zip(out) {
                *out = dot(simd, row, lobe);
            }
        });
    }
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 32;
    let mut sums = [fearless_simd::f32x16::splat(simd, 0.0); 2];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for (k, sum) in sums.iter_mut().enumerate() {
            let lanes = 16 * k..16 * k + 16;
            let (a, b) = (&a[lanes.clone()], &b[lanes]);
            *sum = fearless_simd::f32x16::from_slice(simd, a)
                .mul_add(fearless_simd::f32x16::from_slice(simd, b), *sum);
        }
    }
    (sums[0] + sums[1]).reduce_sum()
}

const _: () = assert!(LOBE.is_multiple_of(32));

/// The coefficients of a lobe that interreflection depends on, for each channel.
pub(crate) struct BounceLobe {
    channels: Box<[[f32; LOBE]; 3]>,
    grey: bool,
}

impl BounceLobe {
    pub(crate) fn new(lobe: &LobeTable) -> Self {
        let mut channels = Box::new([[0.0; LOBE]; 3]);
        for (angle, coefficients) in lobe.every_fourth().enumerate() {
            for i in 0..ROW {
                let value = coefficients[i / FUNCTION_TERMS * TERMS + i % FUNCTION_TERMS];
                (0..3).for_each(|c| channels[c][angle * ROW + i] = value[c]);
            }
        }
        let grey = channels[0] == channels[1] && channels[1] == channels[2];
        Self { channels, grey }
    }
}

impl Bounce {
    /// Prepares the interreflection of a scene; `None` where there is no checkerboard.
    pub(crate) fn prepare(scene: &Scene, field: &Field) -> Option<Self> {
        let (height, half) = field.bodies.plane()?;
        field.board.as_ref()?;
        let preparation = Preparation::new(scene, field, Grid::new(scene, height, half), half);
        Some(preparation.finish(scene))
    }

    /// The irradiance that a material adds to the checkerboard.
    pub(crate) fn weights(&self, lobe: Option<&BounceLobe>, albedo: [f64; 3]) -> Weights {
        let mut weights = [[0.0; 3]; MODES];
        let mut again = [0.0; COUNT * COUNT];
        for c in 0..3 {
            if let Some(lobe) = lobe.filter(|lobe| c == 0 || !lobe.grey) {
                self.again.apply_all(&lobe.channels[c], &mut again);
            }
            let share = |operator: &Operator, i: usize| {
                lobe.map_or(0.0, |lobe| operator.apply(3 * i + c, &lobe.channels[c]))
            };
            let albedo = albedo[c] as f32;
            let source = |a: usize| share(&self.source, a) + albedo * self.diffuse.source[a][c];
            let source: [f32; COUNT] = std::array::from_fn(source);
            let more = self.higher_orders(&again, albedo, c, &source);
            for (m, weights) in weights.iter_mut().enumerate() {
                let lifted: f32 = self.lift[m].iter().zip(&more).map(|(l, e)| l * e).sum();
                weights[c] =
                    self.tint[c] * (share(&self.direct, m) + albedo * self.diffuse.direct[m][c] + lifted);
            }
        }
        weights
    }

    /// What the checkerboard gets back of the irradiance `source` that it got from the spheres: `(I − T)⁻¹ T source`.
    fn higher_orders(
        &self,
        again: &[f32; COUNT * COUNT],
        albedo: f32,
        c: usize,
        source: &[f32; COUNT],
    ) -> [f32; COUNT] {
        let element = |a: usize, b: usize| {
            let diffuse = albedo * self.diffuse.again[a][b] + self.diffuse.own[c][a][b];
            f64::from(self.tint[c] * (again[a * COUNT + b] + diffuse))
        };
        solved(element, source)
    }

    /// What the checkerboard sends of added irradiance to a point of a sphere, as irradiance for a weight of 1 of each mode.
    pub(crate) fn irradiance(&self, sphere: usize, normal: DVec3) -> [f32; MODES] {
        let (u, v) = map_position(normal);
        let values = self.on_spheres[sphere].at(u, v);
        std::array::from_fn(|m| values[m])
    }
}

impl Flat for Operator {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.slice(&self.rows)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(Self { rows: input.vec()? })
    }
}

impl Flat for Diffuse {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.value(&self.direct)?;
        out.value(&self.source)?;
        out.value(&self.again)?;
        out.value(&self.own)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(Self {
            direct: input.value()?,
            source: input.value()?,
            again: input.value()?,
            own: input.value()?,
        })
    }
}

impl Flat for Bounce {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        self.modes.write(out)?;
        self.on_spheres.write(out)?;
        out.value(&self.tint)?;
        [&self.direct, &self.source, &self.again].into_iter().try_for_each(|o| o.write(out))?;
        self.diffuse.write(out)?;
        out.value(&self.lift)
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(Self {
            modes: Flat::read(input)?,
            on_spheres: Flat::read(input)?,
            tint: input.value()?,
            direct: Flat::read(input)?,
            source: Flat::read(input)?,
            again: Flat::read(input)?,
            diffuse: Flat::read(input)?,
            lift: input.value()?,
        })
    }
}

/// `(I − T)⁻¹ T source`
fn solved(element: impl Fn(usize, usize) -> f64, source: &[f32; COUNT]) -> [f32; COUNT] {
    let again = SMatrix::<f64, COUNT, COUNT>::from_fn(element);
    let source = SVector::<f64, COUNT>::from_fn(|a, _| f64::from(source[a]));
    let system = SMatrix::identity() - again;
    let more = system.lu().solve(&(again * source)).unwrap_or_else(SVector::zeros);
    std::array::from_fn(|a| more[a] as f32)
}

/// What one node of the grid receives.
struct NodeLight {
    /// The source, for each channel and coefficient.
    specular: Vec<f32>,
    /// The same of diffuse spheres with an albedo of 1.
    diffuse: [f32; 3],
}

/// What one node of the grid receives of each function χ on the checkerboard.
struct NodeReturn {
    specular: Vec<f32>,
    diffuse: [f32; COUNT],
    own: [[f32; COUNT]; 3],
}

/// The work on the grid.
struct Preparation {
    grid: Grid,
    half: f64,
    tint: [f32; 3],
    /// The functions χ at each node.
    chi: Vec<[f32; COUNT]>,
    /// Importance of each node in fits.
    importance: Vec<f64>,
    /// The fit of functions on the grid by the functions χ: row by row.
    fit: DMatrix<f64>,
    nodes: Vec<NodeLight>,
    again: Operator,
    diffuse_again: [[f32; COUNT]; COUNT],
    own: [[[f32; COUNT]; COUNT]; 3],
    /// The field, for what the checkerboard sends to the spheres.
    field: Field,
}

impl Preparation {
    fn new(scene: &Scene, field: &Field, grid: Grid, half: f64) -> Self {
        let bumps = Bumps::new(scene);
        let chi: Vec<[f32; COUNT]> = (0..grid.len()).map(|g| bumps.at(grid.point(g))).collect();
        let importance: Vec<f64> =
            (0..grid.len()).map(|g| grid.area(g) * bumps.importance(grid.point(g))).collect();
        let fit = fit(&chi, &importance);
        let light = Light::new(scene, field, &bumps, half);
        let found: Vec<(NodeLight, NodeReturn)> =
            (0..grid.len()).into_par_iter().map(|g| light.node(grid.point(g), g as u32)).collect();
        let (nodes, returns): (Vec<NodeLight>, Vec<NodeReturn>) = found.into_iter().unzip();
        let mut again = vec![0.0; COUNT * COUNT * LOBE];
        again.par_chunks_mut(COUNT * LOBE).enumerate().for_each(|(a, rows)| {
            for (g, node) in returns.iter().enumerate() {
                let weight = fit[(a, g)] as f32;
                rows.iter_mut().zip(&node.specular).for_each(|(row, v)| *row += weight * v);
            }
        });
        let fitted = |a: usize, value: &dyn Fn(&NodeReturn) -> f32| -> f32 {
            returns.iter().enumerate().map(|(g, node)| fit[(a, g)] as f32 * value(node)).sum()
        };
        let square = |value: &dyn Fn(&NodeReturn, usize) -> f32| -> [[f32; COUNT]; COUNT] {
            std::array::from_fn(|a| std::array::from_fn(|b| fitted(a, &|n| value(n, b))))
        };
        let diffuse_again = square(&|n, b| n.diffuse[b]);
        let own = std::array::from_fn(|c| square(&|n, b| n.own[c][b]));
        let (tint, field) = (light.tint, light.field);
        let again = Operator { rows: again };
        Self { grid, half, tint, chi, importance, fit, nodes, again, diffuse_again, own, field }
    }

    fn finish(self, scene: &Scene) -> Bounce {
        let modes = self.modes();
        let combined = |weight: &(dyn Fn(usize, usize) -> f64 + Sync), count: usize| -> Operator {
            let mut rows = vec![0.0; count * 3 * LOBE];
            rows.par_chunks_mut(3 * LOBE).enumerate().for_each(|(m, rows)| {
                let weights: Vec<f32> = (0..self.nodes.len()).map(|g| weight(m, g) as f32).collect();
                for (node, weight) in self.nodes.iter().zip(weights) {
                    rows.iter_mut().zip(&node.specular).for_each(|(row, v)| *row += weight * v);
                }
            });
            Operator { rows }
        };
        let onto_mode = |m: usize, g: usize| modes[m][g] * self.importance[g];
        let onto_chi = |a: usize, g: usize| self.fit[(a, g)];
        let diffuse = |weight: &dyn Fn(usize) -> f64| -> [f32; 3] {
            let nodes = || self.nodes.iter().enumerate();
            std::array::from_fn(|c| nodes().map(|(g, n)| weight(g) as f32 * n.diffuse[c]).sum())
        };
        let lift =
            |m: usize, a: usize| (0..self.grid.len()).map(|g| onto_mode(m, g) as f32 * self.chi[g][a]).sum();
        let on_board = Functions::new(|u, v| self.interpolated(&modes, u, v));
        let on_spheres = (0..scene.spheres.len()).map(|s| returned(&self.field, &on_board, s)).collect();
        Bounce {
            on_spheres,
            tint: self.tint,
            direct: combined(&|m, g| onto_mode(m, g), MODES),
            source: combined(&|a, g| onto_chi(a, g), COUNT),
            diffuse: Diffuse {
                direct: std::array::from_fn(|m| diffuse(&|g| onto_mode(m, g))),
                source: std::array::from_fn(|a| diffuse(&|g| onto_chi(a, g))),
                again: self.diffuse_again,
                own: self.own,
            },
            lift: std::array::from_fn(|m| std::array::from_fn(|a| lift(m, a))),
            again: self.again,
            modes: on_board,
        }
    }

    fn interpolated(&self, modes: &[Vec<f64>], u: f64, v: f64) -> [f32; COUNT] {
        let around = self.grid.around((2.0 * u - 1.0) * self.half, (2.0 * v - 1.0) * self.half);
        std::array::from_fn(|m| {
            modes.get(m).map_or(0.0, |mode| around.iter().map(|(g, w)| mode[*g] * w).sum::<f64>() as f32)
        })
    }

    /// The principal components of the irradiance that typical lobes add, orthonormal with the nodes' importance.
    fn modes(&self) -> Vec<Vec<f64>> {
        let samples: Vec<Vec<f64>> = training().par_iter().flat_map_iter(|m| self.added(m)).collect();
        let product = |a: &[f64], b: &[f64]| -> f64 {
            a.iter().zip(b).zip(&self.importance).map(|((a, b), w)| a * b * w).sum()
        };
        let gram = DMatrix::from_fn(samples.len(), samples.len(), |i, j| product(&samples[i], &samples[j]));
        let eigen = gram.symmetric_eigen();
        let mut order: Vec<usize> = (0..samples.len()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let largest = eigen.eigenvalues[order[0]];
        let mode = |k: usize| -> Vec<f64> {
            let value = eigen.eigenvalues[order[k]];
            if value <= 1e-10 * largest {
                return vec![0.0; self.grid.len()];
            }
            let vector = eigen.eigenvectors.column(order[k]);
            let at = |g: usize| {
                samples.iter().zip(vector.iter()).map(|(s, v)| s[g] * v).sum::<f64>() / value.sqrt()
            };
            (0..self.grid.len()).map(at).collect()
        };
        (0..MODES).map(mode).collect()
    }

    /// The irradiance that a material adds at each node, for each channel.
    fn added(&self, material: &Material) -> Vec<Vec<f64>> {
        let bsdf = material.bsdf();
        let lobe = bsdf.sampling().map(|_| BounceLobe::new(&LobeTable::new(&*bsdf)));
        let added = |c: usize| -> Vec<f64> {
            let albedo = bsdf.diffuse()[c] as f32;
            let mut first: Vec<f32> = self.nodes.iter().map(|n| albedo * n.diffuse[c]).collect();
            let mut again = [0.0; COUNT * COUNT];
            if let Some(lobe) = &lobe {
                for (first, node) in first.iter_mut().zip(&self.nodes) {
                    let row = &node.specular[c * LOBE..(c + 1) * LOBE];
                    *first += row.iter().zip(&lobe.channels[c]).map(|(a, b)| a * b).sum::<f32>();
                }
                self.again.apply_all(&lobe.channels[c], &mut again);
            }
            let source = std::array::from_fn(|a| {
                first.iter().enumerate().map(|(g, e)| self.fit[(a, g)] as f32 * e).sum()
            });
            let more = solved(
                |a, b| {
                    let diffuse = albedo * self.diffuse_again[a][b] + self.own[c][a][b];
                    f64::from(self.tint[c] * (again[a * COUNT + b] + diffuse))
                },
                &source,
            );
            let higher = |g: usize| self.chi[g].iter().zip(&more).map(|(x, e)| x * e).sum::<f32>();
            first.iter().enumerate().map(|(g, e)| f64::from(e + higher(g))).collect()
        };
        (0..3).map(added).collect()
    }
}

/// Materials whose interreflection is typical: from mirrors to dull ones, metal and plastic, and a diffuse one.
fn training() -> Vec<Material> {
    let mut texts: Vec<String> = vec!["lambert:diffuse=0.5".into()];
    for roughness in [0.01, 0.04, 0.1, 0.18, 0.3, 0.45, 0.7] {
        texts.push(format!("ggx:diffuse=0,fresnel=none,roughness={roughness}"));
        texts.push(format!("ggx:diffuse=0.4,roughness={roughness}"));
    }
    for roughness in [0.1, 0.3] {
        texts.push(format!("beckmann:diffuse=0,fresnel=none,roughness={roughness}"));
        texts.push(format!("ward:diffuse=0,specular=0.5,roughness={roughness}"));
    }
    texts.iter().map(|text| Material::parse(text).expect("a material of the catalogue")).collect()
}

/// The weighted least-squares fit by the functions χ: `(XᵀWX)⁻¹ XᵀW`.
fn fit(chi: &[[f32; COUNT]], importance: &[f64]) -> DMatrix<f64> {
    let x = DMatrix::from_fn(chi.len(), COUNT, |g, a| f64::from(chi[g][a]));
    let weighted = DMatrix::from_fn(COUNT, chi.len(), |a, g| x[(g, a)] * importance[g]);
    let mut normal = &weighted * &x;
    // Functions that are 0 everywhere stay out.
    let floor = 1e-9 * normal.diagonal().max();
    (0..COUNT).for_each(|a| normal[(a, a)] += floor);
    normal.cholesky().map_or_else(|| DMatrix::zeros(COUNT, chi.len()), |c| c.solve(&weighted))
}

/// The functions χ: smooth bumps about the points that the spheres stand over.
struct Bumps {
    /// Foot of each sphere and its radius.
    feet: Vec<(DVec3, f64)>,
    /// Functions of each sphere, with or without angular ones.
    share: usize,
}

impl Bumps {
    fn new(scene: &Scene) -> Self {
        let feet: Vec<(DVec3, f64)> =
            scene.spheres.iter().take(COUNT).map(|s| (DVec3::from(s.centre), s.radius)).collect();
        Self { share: COUNT / feet.len().max(1), feet }
    }

    fn at(&self, point: DVec3) -> [f32; COUNT] {
        let mut values = [0.0; COUNT];
        for ((foot, radius), values) in self.feet.iter().zip(values.chunks_mut(self.share)) {
            let (x, z) = ((point.x - foot.x) / radius, (point.z - foot.z) / radius);
            let distance = x.hypot(z);
            let angular = if self.share >= 12 { 3 } else { 1 };
            let hats = self.share / angular;
            // Hats on a logarithmic scale up to 4 radii.
            let place = (1.0 + 4.0 * distance).ln() / 17f64.ln() * (hats - 1).max(1) as f64;
            let scale = 1.0 / (distance + 0.1);
            for k in 0..hats {
                let last = k + 1 == hats && place > k as f64;
                let hat = if last {
                    1.0 / (1.0 + place - k as f64).powi(4)
                } else {
                    (1.0 - (place - k as f64).abs()).max(0.0)
                };
                let factors = [1.0, x * scale, z * scale];
                (0..angular).for_each(|i| values[angular * k + i] = (hat * factors[i]) as f32);
            }
        }
        values
    }

    /// How much the irradiance of an area matters: the more, the closer it is to a sphere.
    fn importance(&self, point: DVec3) -> f64 {
        let near = |(foot, radius): &(DVec3, f64)| {
            let distance = (point.x - foot.x).hypot(point.z - foot.z) / radius;
            1.0 / (distance * distance + 0.05)
        };
        self.feet.iter().map(near).sum()
    }
}

/// The light of the scene as the spheres see it.
struct Light {
    field: Field,
    chi: Functions,
    tint: [f32; 3],
    /// Diffuse radiance of each sphere for an albedo of 1, by direction from its centre; `None` where it has a colour of its
    /// own, whose light is baked.
    white: Vec<Option<Pyramid>>,
    own: Vec<Option<[f64; 3]>>,
    /// What each sphere gets of each function χ on the checkerboard, as irradiance.
    returned: Vec<Functions>,
}

impl Light {
    fn new(scene: &Scene, field: &Field, bumps: &Bumps, half: f64) -> Self {
        let (lit, field) = (field, field.with_lamps_in_the_map());
        let plane = field.bodies.plane().map_or(0.0, |p| p.0);
        let chi = Functions::new(|u, v| {
            bumps.at(DVec3::new((2.0 * u - 1.0) * half, plane, (2.0 * v - 1.0) * half))
        });
        let own: Vec<Option<[f64; 3]>> = scene.spheres.iter().map(|s| s.diffuse).collect();
        let white = (0..own.len()).map(|s| own[s].is_none().then(|| lit.white_sphere(s))).collect();
        let returned = (0..own.len()).map(|s| returned(&field, &chi, s)).collect();
        let tint = field.board.as_ref().map_or([1.0; 3], |b| b.tint());
        Self { field, chi, tint, white, own, returned }
    }

    /// What arrives at a point of the checkerboard from the spheres.
    fn node(&self, point: DVec3, seed: u32) -> (NodeLight, NodeReturn) {
        let mut light = NodeLight { specular: vec![0.0; 3 * LOBE], diffuse: [0.0; 3] };
        let mut back =
            NodeReturn { specular: vec![0.0; COUNT * LOBE], diffuse: [0.0; COUNT], own: [[0.0; COUNT]; 3] };
        for sphere in 0..self.own.len() {
            for (i, direction, weight) in cone(self.field.bodies.spheres()[sphere], point, seed) {
                let back = (i % RETURNS == 0).then_some(&mut back);
                self.add_ray(sphere, point, direction, weight, &mut light, back);
            }
            for source in &self.field.points {
                self.add_glints(sphere, point, *source, &mut light);
            }
        }
        (light, back)
    }

    /// Adds what a sphere reflects along one ray from the checkerboard, as irradiance of `weight` times the radiance.
    fn add_ray(
        &self,
        sphere: usize,
        point: DVec3,
        direction: DVec3,
        weight: f64,
        light: &mut NodeLight,
        back: Option<&mut NodeReturn>,
    ) {
        let Some((distance, body)) = self.field.bodies.first(point, direction, Some(Body::Plane)) else {
            return;
        };
        if body != Body::Sphere(sphere) {
            return;
        }
        let position = point + direction * distance;
        let normal = self.field.bodies.normal(sphere, position);
        let place = Place { position, normal, body };
        let view = [View::new(SurfacePoint { place, sphere, wo: -direction })];
        let density = Density { strata: [1, 1], spread: 0.0 };
        let (moments, functions) = match &back {
            Some(_) => arcs::moments_with(&self.field, &self.chi, &view, density),
            None => (arcs::moments(&self.field, &view, density), Box::default()),
        };
        let (u, v) = map_position(normal);
        if let Some(white) = &self.white[sphere] {
            let radiance = white.sample(u, v, 1.0);
            (0..3).for_each(|c| light.diffuse[c] += weight as f32 * radiance[c]);
        }
        for (angle, share) in angle_position(view[0].angle()) {
            let share = (share * weight) as f32;
            for i in 0..ROW {
                let moment = &moments[i / FUNCTION_TERMS][i % FUNCTION_TERMS];
                (0..3).for_each(|c| light.specular[c * LOBE + angle * ROW + i] += share * moment[c]);
            }
        }
        if let Some(back) = back {
            self.add_return(sphere, (u, v), view[0].angle(), weight * f64::from(RETURNS), &functions, back);
        }
    }

    /// Adds what a sphere reflects of the functions χ.
    fn add_return(
        &self,
        sphere: usize,
        (u, v): (f32, f32),
        theta: f64,
        weight: f64,
        functions: &FunctionMoments,
        back: &mut NodeReturn,
    ) {
        for (angle, share) in angle_position(theta) {
            let share = (share * weight) as f32;
            for i in 0..ROW {
                let moment = &functions[i / FUNCTION_TERMS][i % FUNCTION_TERMS];
                (0..COUNT).for_each(|a| back.specular[a * LOBE + angle * ROW + i] += share * moment[a]);
            }
        }
        let returned = self.returned[sphere].at(u, v).map(|e| e * weight as f32 / PI as f32);
        match self.own[sphere] {
            None => (0..COUNT).for_each(|a| back.diffuse[a] += returned[a]),
            Some(albedo) => {
                (0..3)
                    .for_each(|c| (0..COUNT).for_each(|a| back.own[c][a] += albedo[c] as f32 * returned[a]));
            }
        }
    }

    /// Adds what a sphere mirrors of a point light: sampled about the point that mirrors it exactly, as densely as the nodes
    /// of the rings lie.
    fn add_glints(
        &self,
        sphere: usize,
        point: DVec3,
        (source, intensity): (DVec3, Rgb),
        light: &mut NodeLight,
    ) {
        let (centre, radius) = self.field.bodies.spheres()[sphere];
        let axis = mirror_point(centre, radius, point, source);
        let (tangent, bitangent) = frame(axis);
        let (rings, samples) = GLINTS;
        let edge = |i: usize| PI * (i as f64 / rings as f64).powf(2.5);
        for ring in 0..rings {
            let (low, high) = (edge(ring), edge(ring + 1));
            let (sin, cos) = ((low + high) / 2.0).sin_cos();
            let area = radius * radius * (low.cos() - high.cos()) * TAU / samples as f64;
            for i in 0..samples {
                let (s, c) = (TAU * (i as f64 + 0.5 * (ring % 2) as f64) / samples as f64).sin_cos();
                let normal = axis * cos + (tangent * c + bitangent * s) * sin;
                let place = Place { position: centre + normal * radius, normal, body: Body::Sphere(sphere) };
                self.add_glint(point, source, intensity, place, area, light);
            }
        }
    }

    fn add_glint(
        &self,
        point: DVec3,
        source: DVec3,
        intensity: Rgb,
        place: Place,
        area: f64,
        light: &mut NodeLight,
    ) {
        let Body::Sphere(sphere) = place.body else { return };
        let (to_source, to_point) = (source - place.position, point - place.position);
        let wo = to_point.normalize();
        let cos_o = wo.dot(place.normal);
        if to_source.dot(place.normal) <= 0.0 || cos_o <= 0.0 || wo.y >= 0.0 {
            return;
        }
        let bodies = &self.field.bodies;
        if bodies.occluded(place.position, source, Some(place.body))
            || bodies.blocked(place.position, point, place.body)
        {
            return;
        }
        let view = View::new(SurfacePoint { place, sphere, wo });
        let Some(at) = view.ring_point(to_source.normalize()) else { return };
        // The solid angle of the area, projected, times the light's irradiance there.
        let projected = -wo.y * cos_o * area / to_point.length_squared();
        let share = projected / (at.density * to_source.length_squared());
        for (angle, part) in angle_position(view.angle()) {
            for (node, hat) in at.hats {
                for (k, polynomial) in at.polynomials.iter().take(FUNCTION_TERMS).enumerate() {
                    let value = (share * part * hat * polynomial) as f32;
                    let place = angle * ROW + node * FUNCTION_TERMS + k;
                    (0..3).for_each(|c| light.specular[c * LOBE + place] += value * intensity[c]);
                }
            }
        }
    }
}

/// Directions from a point of the checkerboard that cover a sphere, each with its number and projected solid angle.
fn cone((centre, radius): (DVec3, f64), point: DVec3, seed: u32) -> impl Iterator<Item = (u32, DVec3, f64)> {
    let to_centre = centre - point;
    let distance = to_centre.length().max(radius * (1.0 + 1e-9));
    let least = (1.0 - (radius / distance).powi(2)).sqrt();
    let axis = to_centre.normalize();
    let (tangent, bitangent) = frame(axis);
    let shift = zero_two(seed);
    let rays = if distance < FAR * radius { RAYS[0] } else { RAYS[1] };
    let solid_angle = TAU * (1.0 - least) / f64::from(rays);
    (0..rays).filter_map(move |i| {
        let [u, v] = zero_two(i);
        let cos = 1.0 - (u + shift[0]).fract() * (1.0 - least);
        let sin = (1.0 - cos * cos).sqrt();
        let (s, c) = (TAU * (v + shift[1])).sin_cos();
        let direction = axis * cos + (tangent * c + bitangent * s) * sin;
        (direction.y > 0.0).then_some((i, direction, direction.y * solid_angle))
    })
}

/// The normal of the sphere at the point that mirrors `source` towards `point`: it lies between the directions to both,
/// where they are seen under equal angles.
fn mirror_point(centre: DVec3, radius: f64, point: DVec3, source: DVec3) -> DVec3 {
    let (from, to) = ((point - centre).normalize(), (source - centre).normalize());
    let cosine = |normal: DVec3, seen: DVec3| normal.dot((seen - centre - normal * radius).normalize());
    let (mut low, mut high) = (0.0, 1.0);
    let at = |t: f64| from.lerp(to, t).try_normalize().unwrap_or(DVec3::Y);
    for _ in 0..40 {
        let middle = (low + high) / 2.0;
        let normal = at(middle);
        if cosine(normal, point) > cosine(normal, source) { low = middle } else { high = middle }
    }
    at((low + high) / 2.0)
}

/// The tabulated angles around one, with their weights.
fn angle_position(theta: f64) -> [(usize, f64); 2] {
    let x = LobeTable::place(theta) / 4.0;
    let index = (x as usize).min(ANGLES - 2);
    [(index, 1.0 - (x - index as f64)), (index + 1, x - index as f64)]
}

/// What the checkerboard sends to a sphere of functions on it, taken as irradiance: as irradiance, by the normal's `u, v`.
fn returned(field: &Field, functions: &Functions, sphere: usize) -> Functions {
    Functions::new(|u, v| {
        let normal = map_direction(u, v);
        let place =
            Place { position: field.bodies.point(sphere, normal), normal, body: Body::Sphere(sphere) };
        let mut sums = [0.0; COUNT];
        for i in 0..DIFFUSE_RAYS {
            let direction = cosine_direction(i, normal);
            let width = (PI / f64::from(DIFFUSE_RAYS)).sqrt();
            if let Some((u, v, brightness)) = field.board_at(&place, direction, width) {
                let values = functions.at(u, v);
                (0..COUNT).for_each(|a| sums[a] += brightness * values[a]);
            }
        }
        sums.map(|sum| sum * PI as f32 / DIFFUSE_RAYS as f32)
    })
}
