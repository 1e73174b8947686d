//! How good a probe is where no search has looked: another scene, other light, beside what people do without it.

use lookmatch_imaging::{Image, Mask, nrmsd};
use lookmatch_materials::Material;
use lookmatch_rendering::{EnvironmentLight, Illumination, Observe, Part, Renderer, Scene, TransportCache};
use rayon::prelude::*;
use serde::Serialize;

use crate::{Baseline, Probe, RemapError, apply};

/// Environment maps to validate under; `None` is the scene's own.
pub type Lighting = Option<String>;

/// Minimum, maximum, mean and standard deviation of one number over the source points.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation of the sample (n − 1); 0 for one point.
    pub sd: f64,
}

impl Statistics {
    /// Of at least one value.
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let n = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / n;
        let variance = values.clone().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        let (min, max) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        Self { min, max, mean, sd: variance.sqrt() }
    }
}

/// NRMSD per channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scores {
    /// Whole image, as in the paper's Tables 2 and 4.
    pub whole: [Statistics; 3],
    /// With the radial mask on each sphere.
    pub masked: [Statistics; 3],
}

/// One way to get a target material, judged.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodScores {
    /// `probe`, `copy` or `copy, no Fresnel`.
    pub method: String,
    /// Its scores.
    #[serde(flatten)]
    pub scores: Scores,
}

/// The verdict on a probe under one environment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ValidationReport {
    /// Name of the scene.
    pub scene: String,
    /// Its environment map.
    pub environment: String,
    /// Side of the pictures in pixels.
    pub size: usize,
    /// Source points that were rendered.
    pub points: usize,
    /// The probe first, then the baselines that apply.
    pub methods: Vec<MethodScores>,
    /// True where the probe has the lowest mean masked NRMSD, averaged over channels.
    pub probe_is_best: bool,
}

/// Source points to validate at: all of them, or `count` evenly spread ones.
pub fn validation_points(probe: &Probe, count: Option<usize>) -> Vec<usize> {
    let total = probe.entries.len();
    let count = count.unwrap_or(total).clamp(1, total);
    if count == total {
        return (0..total).collect();
    }
    // Steps of the golden ratio along the table spread evenly over both axes, where equal steps would fall on
    // few columns.
    let step = |k: usize| ((k as f64 + 0.5) * 0.618_033_988_749_895).fract();
    let mut points = Vec::with_capacity(count);
    for point in (0..).map(|k| (step(k) * total as f64) as usize) {
        if !points.contains(&point) {
            points.push(point);
        }
        if points.len() == count {
            break;
        }
    }
    points.sort_unstable();
    points
}

/// The three-sphere scene under one light, prepared for the models of a probe.
pub struct Validator<'a> {
    probe: &'a Probe,
    scene: Scene,
    renderer: Renderer,
}

impl<'a> Validator<'a> {
    /// Prepares the scene for pictures of `size` × `size` pixels.
    ///
    /// # Errors
    /// Where the environment map cannot be read, or a model is one of another renderer.
    pub fn prepare(probe: &'a Probe, lighting: &Lighting, size: usize) -> Result<Self, RemapError> {
        Self::cached(probe, lighting, size, &TransportCache::off(), &|_| ())
    }

    /// [`Validator::prepare`] with light that is kept in a cache; see [`Renderer::cached`].
    ///
    /// # Errors
    /// As [`Validator::prepare`].
    pub fn cached(
        probe: &'a Probe,
        lighting: &Lighting,
        size: usize,
        cache: &TransportCache,
        observe: Observe,
    ) -> Result<Self, RemapError> {
        [&probe.from, &probe.to].into_iter().try_for_each(RemapError::check_ours)?;
        let mut scene = Scene::spheres().for_model(probe.from.model()).for_model(probe.to.model());
        if let Some(map) = lighting {
            scene.environment = Some(EnvironmentLight::of(map));
        }
        let renderer = Renderer::cached(&scene, Illumination::All, size, cache, observe)?;
        Ok(Self { probe, scene, renderer })
    }

    /// Scores the probe at some of its entries, beside the baselines; `observe` is told of each finished entry.
    ///
    /// # Errors
    /// Where a material cannot be made.
    pub fn validate(
        &self,
        points: &[usize],
        observe: &(dyn Fn() + Sync),
    ) -> Result<ValidationReport, RemapError> {
        let row = |place: &usize| {
            let row = self.score(*place);
            observe();
            row
        };
        let rows = points.par_iter().map(row).collect::<Result<Vec<_>, RemapError>>()?;
        let names = std::iter::once("probe").chain(Baseline::ALL.map(Baseline::title));
        let methods: Vec<MethodScores> = names
            .enumerate()
            .filter_map(|(k, name)| {
                let scores: Option<Vec<_>> = rows.iter().map(|row| row[k]).collect();
                Some(MethodScores { method: name.into(), scores: summarise(&scores?) })
            })
            .collect();
        let mean = |m: &MethodScores| m.scores.masked.iter().map(|s| s.mean).sum::<f64>();
        let probe_is_best = methods[1..].iter().all(|m| mean(&methods[0]) < mean(m));
        let environment = self.scene.environment.as_ref().map(|e| e.map.clone()).unwrap_or_default();
        let (scene, size, points) = (self.scene.name.clone(), self.renderer.size(), points.len());
        Ok(ValidationReport { scene, environment, size, points, methods, probe_is_best })
    }

    /// The source material of an entry, what the probe makes of it, and what each baseline that applies does.
    ///
    /// # Errors
    /// Where a material cannot be made.
    pub fn materials(&self, place: usize) -> Result<(Material, Vec<Option<Material>>), RemapError> {
        let source = self.probe.source_material(&self.probe.entries[place].source)?;
        let mut targets = vec![Some(apply(self.probe, &source, false)?.target)];
        for rule in Baseline::ALL {
            targets.push(rule.apply(&source, &self.probe.to)?);
        }
        Ok((source, targets))
    }

    /// The radial mask of the scene's spheres.
    pub fn mask(&self) -> &Mask {
        self.renderer.mask()
    }

    /// Pictures of some materials in the scene, in their order.
    pub fn render(&self, materials: &[&Material]) -> Vec<Image> {
        self.renderer.render_batch(materials, Part::Full)
    }

    /// Scores of the probe and of each baseline that applies.
    fn score(&self, place: usize) -> Result<Vec<Option<Score>>, RemapError> {
        let (source, targets) = self.materials(place)?;
        let materials: Vec<&Material> = std::iter::once(&source).chain(targets.iter().flatten()).collect();
        let mut images = self.render(&materials).into_iter();
        let Some(reference) = images.next() else { return Ok(Vec::new()) };
        let score = |image: Image| -> Result<Score, RemapError> {
            let masked = nrmsd(&reference, &image, Some(self.renderer.mask()))?;
            Ok([nrmsd(&reference, &image, None)?, masked])
        };
        targets
            .iter()
            .map(|target| target.as_ref().and_then(|_| images.next()).map(score).transpose())
            .collect()
    }
}

/// NRMSD whole and masked.
type Score = [[f64; 3]; 2];

fn summarise(scores: &[Score]) -> Scores {
    let channel =
        |kind: usize| std::array::from_fn(|c| Statistics::of(scores.iter().map(move |score| score[kind][c])));
    Scores { whole: channel(0), masked: channel(1) }
}
