//! Makes the operators of the interreflection, of light that was sampled at the nodes of a grid on the checkerboard.

use lookmatch_materials::Material;
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::bumps::{Bumps, fit};
use super::light::{Light, NodeLight, NodeReturn, returned};
use super::operators::{Feedback, Operator};
use super::{Bounce, BounceLobe, Diffuse, LOBE, MODES};
use crate::field::Field;
use crate::functions::{COUNT, Functions};
use crate::grid::Grid;
use crate::lobe_table::LobeTable;
use crate::scene::Scene;

/// The work on the grid.
pub(super) struct Preparation {
    grid: Grid,
    half: f64,
    /// The functions χ at each node.
    chi: Vec<[f32; COUNT]>,
    /// Importance of each node in fits.
    importance: Vec<f64>,
    /// The fit of functions on the grid by the functions χ: row by row.
    fit: DMatrix<f64>,
    nodes: Vec<NodeLight>,
    feedback: Feedback,
    /// The field, for what the checkerboard sends to the spheres.
    field: Field,
}

impl Preparation {
    pub(super) fn new(scene: &Scene, field: &Field, grid: Grid, half: f64) -> Self {
        let bumps = Bumps::new(scene);
        let chi: Vec<[f32; COUNT]> = (0..grid.len()).map(|g| bumps.at(grid.point(g))).collect();
        let importance: Vec<f64> =
            (0..grid.len()).map(|g| grid.area(g) * bumps.importance(grid.point(g))).collect();
        let fit = fit(&chi, &importance);
        let light = Light::new(scene, field, &bumps, half);
        let found: Vec<(NodeLight, NodeReturn)> =
            (0..grid.len()).into_par_iter().map(|g| light.node(grid.point(g), g as u32)).collect();
        let (nodes, returns): (Vec<NodeLight>, Vec<NodeReturn>) = found.into_iter().unzip();
        let feedback = feedback(&fit, &returns, light.tint);
        Self { grid, half, chi, importance, fit, nodes, feedback, field: light.field }
    }

    pub(super) fn finish(self, scene: &Scene) -> Bounce {
        let modes = self.modes();
        let nodes: Vec<&[f32]> = self.nodes.iter().map(|node| &*node.specular).collect();
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
            direct: Operator::combined(MODES, &nodes, &onto_mode),
            source: Operator::combined(COUNT, &nodes, &onto_chi),
            diffuse: Diffuse {
                direct: std::array::from_fn(|m| diffuse(&|g| onto_mode(m, g))),
                source: std::array::from_fn(|a| diffuse(&|g| onto_chi(a, g))),
            },
            lift: std::array::from_fn(|m| std::array::from_fn(|a| lift(m, a))),
            feedback: self.feedback,
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
                self.feedback.specular.apply_all(&lobe.channels[c], &mut again);
            }
            let source = std::array::from_fn(|a| {
                first.iter().enumerate().map(|(g, e)| self.fit[(a, g)] as f32 * e).sum()
            });
            let more = self.feedback.higher_orders(&again, albedo, c, &source);
            let higher = |g: usize| self.chi[g].iter().zip(&more).map(|(x, e)| x * e).sum::<f32>();
            first.iter().enumerate().map(|(g, e)| f64::from(e + higher(g))).collect()
        };
        (0..3).map(added).collect()
    }
}

/// What the functions χ get of each other: what the nodes received of them, fitted.
fn feedback(fit: &DMatrix<f64>, returns: &[NodeReturn], tint: [f32; 3]) -> Feedback {
    let nodes: Vec<&[f32]> = returns.iter().map(|node| &*node.specular).collect();
    let fitted = |a: usize, value: &dyn Fn(&NodeReturn) -> f32| -> f32 {
        returns.iter().enumerate().map(|(g, node)| fit[(a, g)] as f32 * value(node)).sum()
    };
    let square = |value: &dyn Fn(&NodeReturn, usize) -> f32| -> [[f32; COUNT]; COUNT] {
        std::array::from_fn(|a| std::array::from_fn(|b| fitted(a, &|n| value(n, b))))
    };
    Feedback {
        specular: Operator::combined(COUNT, &nodes, &|a, g| fit[(a, g)]),
        diffuse: square(&|n, b| n.diffuse[b]),
        own: std::array::from_fn(|c| square(&|n, b| n.own[c][b])),
        tint,
    }
}

/// Materials whose interreflection is typical.
fn training() -> Vec<Material> {
    // A text that is no material is left out, which a test excludes.
    training_texts().iter().filter_map(|text| Material::parse(text).ok()).collect()
}

/// From mirrors to dull ones, metal and plastic, and a diffuse one.
fn training_texts() -> Vec<String> {
    let mut texts: Vec<String> = vec!["lambert:diffuse=0.5".into()];
    for roughness in [0.01, 0.04, 0.1, 0.18, 0.3, 0.45, 0.7] {
        texts.push(format!("ggx:diffuse=0,fresnel=none,roughness={roughness}"));
        texts.push(format!("ggx:diffuse=0.4,roughness={roughness}"));
    }
    for roughness in [0.1, 0.3] {
        texts.push(format!("beckmann:diffuse=0,fresnel=none,roughness={roughness}"));
        texts.push(format!("ward:diffuse=0,specular=0.5,roughness={roughness}"));
    }
    texts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_texts_are_materials() {
        assert_eq!(training().len(), 19);
        assert_eq!(training_texts().len(), 19);
    }
}
