//! The benchmark: sources beside a spread of targets, each pair with the norms of Eq. 3 and its gradient similarity.

use std::collections::HashSet;

use lookmatch_imaging::{FitnessTerms, FitnessWeights, Image, distance_correlation, gsm_map};
use lookmatch_materials::{Material, Value};
use lookmatch_remap::{Appearance, Endpoint, Options, Plan, Stage};
use lookmatch_rendering::{Illumination, Part, Renderer, Scene};
use lookmatch_search::{Axis, Bounds, Lattice, spread};
use rayon::prelude::*;

use crate::tables::mean;
use crate::{Setting, Watch};

/// Pairs of models, and whether they have bodies.
const PAIRS: [(&str, &str, bool); 6] = [
    ("as", "beckmann-conductor", false),
    ("as", "ggx-conductor", false),
    ("ward", "ggx", true),
    ("low-abc", "ggx", true),
    ("lafortune", "ward", true),
    ("ward", "rough-plastic", true),
];
/// Body colours of targets, as shares of those that a search gives them.
const BODIES: (f64, f64) = (0.5, 1.5);
/// Levels between them.
const BODY_STEP: f64 = 0.05;
/// Light is prepared in this order.
const LIGHTS: [Illumination; 2] = [Illumination::Point, Illumination::Environment];

/// Two models, with the benchmark's items between them.
pub(super) struct Pair {
    /// `ward to ggx`.
    pub(super) name: String,
    pub(super) items: Vec<Item>,
}

/// One source beside all targets of its pair.
#[derive(Clone)]
pub(super) struct Item {
    /// The norms of Eq. 3.
    terms: Vec<FitnessTerms>,
    /// GSM of the complete pictures, by light.
    gsm: [Vec<f64>; 2],
}

/// Of which complete pictures GSM is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Light {
    /// The mean of both lights.
    Both,
    Point,
    Environment,
}

impl Item {
    /// The distance correlation of Eq. 3 and GSM over the targets.
    pub(super) fn correlation(&self, weights: &FitnessWeights, light: Light) -> anyhow::Result<f64> {
        let fitness: Vec<f64> = self.terms.iter().map(|terms| weights.sum(terms)).collect();
        let [point, environment] = &self.gsm;
        Ok(match light {
            Light::Point => distance_correlation(&fitness, point)?,
            Light::Environment => distance_correlation(&fitness, environment)?,
            Light::Both => {
                let both: Vec<f64> = point.iter().zip(environment).map(|(a, b)| (a + b) / 2.0).collect();
                distance_correlation(&fitness, &both)?
            }
        })
    }

    /// Targets beside the source.
    pub(super) fn targets(&self) -> usize {
        self.terms.len()
    }
}

/// The distance correlation of every item, in their order.
pub(super) fn correlations(
    items: &[&Item],
    weights: &FitnessWeights,
    light: Light,
) -> anyhow::Result<Vec<f64>> {
    items.par_iter().map(|item| item.correlation(weights, light)).collect()
}

/// Their mean.
pub(super) fn mean_correlation(items: &[&Item], weights: &FitnessWeights) -> anyhow::Result<f64> {
    Ok(mean(correlations(items, weights, Light::Both)?.into_iter()))
}

/// The reference scene as Eq. 3 sees it, and its complete pictures.
pub(super) struct Benchmark {
    stage: Stage,
    views: [Renderer; 2],
    sources: u32,
    targets: u32,
    is_quick: bool,
}

/// A material as it is seen.
struct Seen {
    appearance: Appearance,
    /// Complete pictures by light.
    pictures: [Image; 2],
}

impl Benchmark {
    pub(super) fn prepare(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Self> {
        watch.begin("light of the reference scene", 0);
        let (size, cache) = (setting.size(), &setting.cache);
        let view = |light| Renderer::cached(&Scene::reference(), light, size, cache, &|_| ());
        let (sources, targets) = if setting.is_quick { (5, 30) } else { (12, 80) };
        Ok(Self {
            stage: Stage::reference(size, cache, &|_| ())?,
            views: [view(LIGHTS[0])?, view(LIGHTS[1])?],
            sources,
            targets,
            is_quick: setting.is_quick,
        })
    }

    /// All pairs of models; with `is_bodied`, the targets of plastics differ in their bodies as well.
    pub(super) fn pairs(&self, watch: &dyn Watch, is_bodied: bool) -> anyhow::Result<Vec<Pair>> {
        let wanted = PAIRS.iter().filter(|(_, _, has_body)| is_bodied || *has_body);
        let wanted: Vec<_> = wanted.collect();
        watch.begin("pairs of renderings", wanted.len() * self.sources as usize);
        wanted
            .into_iter()
            .map(|(from, to, has_body)| self.pair(watch, from, to, is_bodied && *has_body))
            .collect()
    }

    fn pair(&self, watch: &dyn Watch, from: &str, to: &str, is_bodied: bool) -> anyhow::Result<Pair> {
        let [source, target] = [from, to].map(lookmatch_materials::by_name);
        let options = Options { quick: self.is_quick, ..Options::default() };
        let plan = Plan::between(Endpoint::Model(source?), Endpoint::Model(target?), &options)?;
        let sources: Vec<Material> = points(&plan.source_axes, self.sources)
            .iter()
            .map(|values| plan.source_material(values))
            .collect::<Result<_, _>>()?;
        let mut axes = plan.target_axes.clone();
        if is_bodied {
            axes.push(Axis::regular("body", BODIES.0, BODIES.1, BODY_STEP)?);
        }
        let targets: Vec<Material> = points(&axes, self.targets)
            .iter()
            .map(|values| {
                let mut target = plan.target_material(&sources[0], &values[..plan.target_axes.len()])?;
                if is_bodied {
                    darken(&mut target, values[plan.target_axes.len()])?;
                }
                Ok(target)
            })
            .collect::<anyhow::Result<_>>()?;
        let (sources, targets) = (self.seen(&sources), self.seen(&targets));
        let items = sources.iter().map(|source| {
            let item = self.item(watch, source, &targets)?;
            watch.advance(1);
            Ok(item)
        });
        Ok(Pair { name: format!("{from} to {to}"), items: items.collect::<anyhow::Result<_>>()? })
    }

    fn seen(&self, materials: &[Material]) -> Vec<Seen> {
        let refs: Vec<&Material> = materials.iter().collect();
        let [point, environment] = self.views.each_ref().map(|view| view.render_batch(&refs, Part::Full));
        let pictures = point.into_iter().zip(environment);
        let appearances = self.stage.appearances(materials).into_iter();
        appearances.zip(pictures).map(|(appearance, (a, b))| Seen { appearance, pictures: [a, b] }).collect()
    }

    fn item(&self, watch: &dyn Watch, source: &Seen, targets: &[Seen]) -> anyhow::Result<Item> {
        let one = |target: &Seen| -> anyhow::Result<(FitnessTerms, [f64; 2])> {
            anyhow::ensure!(!watch.is_stopped(), "stopped");
            let gsm = |light: usize| -> anyhow::Result<f64> {
                Ok(gsm_map(&source.pictures[light], &target.pictures[light])?.mean(None)?)
            };
            Ok((self.stage.terms(&source.appearance, &target.appearance), [gsm(0)?, gsm(1)?]))
        };
        let all: Vec<_> = targets.par_iter().map(one).collect::<anyhow::Result<_>>()?;
        let gsm = |light: usize| all.iter().map(|(_, gsm)| gsm[light]).collect();
        Ok(Item { terms: all.iter().map(|(terms, _)| *terms).collect(), gsm: [gsm(0), gsm(1)] })
    }
}

/// Points that fill a lattice evenly, each once; switches stay on.
fn points(axes: &[Axis], count: u32) -> Vec<Vec<f64>> {
    let lattice = Lattice { axes: axes.to_vec() };
    let mut bounds = Bounds::full(&lattice);
    for (low, axis) in bounds.low.iter_mut().zip(axes) {
        if axis.len() <= 2 {
            *low = axis.len() as u32 - 1;
        }
    }
    let mut taken = HashSet::new();
    let all = (0..count).map(|k| spread(&bounds, k)).filter(|point| taken.insert(point.clone()));
    all.map(|point| lattice.values(&point)).collect()
}

/// Multiplies the colour of a material's body.
fn darken(material: &mut Material, share: f64) -> anyhow::Result<()> {
    let body = material.model().parameters.iter().position(|parameter| parameter.role.is_body());
    let Some(body) = body else { return Ok(()) };
    if let Some(colour) = material.values()[body].colour() {
        material.set_value(body, Value::Colour(colour.map(|v| (v * share).min(1.0))))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_fill_the_lattice_with_their_switches_on() {
        let axis = |name: &str, max: f64, step: f64| Axis::regular(name, 0.0, max, step).unwrap();
        let axes = [axis("specular", 1.0, 1.0), axis("roughness", 1.0, 0.01)];
        let points = points(&axes, 60);
        assert!(points.len() > 50 && points.iter().all(|point| point[0] == 1.0), "{}", points.len());
        let in_tenth = |tenth: f64| points.iter().any(|point| (point[1] - tenth).abs() <= 0.05);
        assert!((0..10).all(|k| in_tenth(0.05 + 0.1 * f64::from(k))), "{points:?}");
    }

    #[test]
    fn bodies_are_darkened_and_metals_have_none() {
        let mut plastic = Material::parse("ggx:diffuse=0.8/0.4/0.2").unwrap();
        darken(&mut plastic, 0.5).unwrap();
        assert_eq!(plastic.to_string(), Material::parse("ggx:diffuse=0.4/0.2/0.1").unwrap().to_string());
        let mut metal = Material::parse("ggx-conductor").unwrap();
        darken(&mut metal, 0.5).unwrap();
        assert_eq!(metal.to_string(), Material::parse("ggx-conductor").unwrap().to_string());
    }

    #[test]
    fn a_fitness_in_step_with_gsm_is_correlated_in_full() {
        let term = |k: u32| FitnessTerms { specular_environment: f64::from(k), ..FitnessTerms::default() };
        let gsm = || (0..20).map(|k| 1.0 - 0.01 * f64::from(k)).collect();
        let item = Item { terms: (0..20).map(term).collect(), gsm: [gsm(), gsm()] };
        let of = |weights| item.correlation(&weights, Light::Both).unwrap();
        assert!((of(FitnessWeights::default()) - 1.0).abs() < 1e-9);
        assert_eq!(of(FitnessWeights::of(1.0, 0.0, 0.0)), 0.0, "diffuse pictures say nothing");
    }
}
