//! How good a probe is where no search has looked: another scene, other light, beside what people do without it.

use lookmatch_imaging::{Image, METRICS, Mask, Metric, Reading, Verdict, nrmsd, read_metrics};
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
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
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

/// A number of a metric other than NRMSD over the source points.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricScores {
    /// As [`Reading::name`].
    pub name: String,
    /// As [`Reading::title`].
    pub title: String,
    /// Whole image; nothing where pictures are too small for the metric.
    pub whole: Option<Statistics>,
    /// With the radial mask on each sphere.
    pub masked: Option<Statistics>,
}

/// At how many source points people would say what about whole pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verdicts {
    /// [`Verdict::Indistinguishable`].
    pub indistinguishable: usize,
    /// [`Verdict::SlightlyDifferent`].
    #[serde(rename = "slightly different")]
    pub slightly_different: usize,
    /// [`Verdict::NoticeablyDifferent`].
    #[serde(rename = "noticeably different")]
    pub noticeably_different: usize,
}

impl Verdicts {
    /// On pictures of some qualities, in JOD.
    pub(crate) fn of(jods: &[f64]) -> Self {
        let count = |verdict: Verdict| jods.iter().filter(|jod| Verdict::of(**jod) == verdict).count();
        Self {
            indistinguishable: count(Verdict::Indistinguishable),
            slightly_different: count(Verdict::SlightlyDifferent),
            noticeably_different: count(Verdict::NoticeablyDifferent),
        }
    }

    /// The number of points with a verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        match verdict {
            Verdict::Indistinguishable => self.indistinguishable,
            Verdict::SlightlyDifferent => self.slightly_different,
            Verdict::NoticeablyDifferent => self.noticeably_different,
        }
    }
}

/// One way to get a target material, judged.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodScores {
    /// One of [`Validator::methods`].
    pub method: String,
    /// Its scores.
    #[serde(flatten)]
    pub scores: Scores,
    /// The other metrics, at [`ValidationReport::metric_points`].
    pub metrics: Vec<MetricScores>,
    /// What people would say, at the same points; nothing where there is none.
    pub verdicts: Option<Verdicts>,
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
    /// How many of them, evenly spread, were judged by all metrics; the others by NRMSD alone.
    pub metric_points: usize,
    /// Those metrics; none where they judged nowhere.
    pub metrics: &'static [Metric],
    /// The probe first, then the baselines that apply.
    pub methods: Vec<MethodScores>,
    /// True where the probe has the lowest mean masked NRMSD, averaged over channels.
    pub probe_is_best: bool,
}

/// Source points to validate at: all of them, or `count` evenly spread ones. Those whose entries failed have nothing to validate.
pub fn validation_points(probe: &Probe, count: Option<usize>) -> Vec<usize> {
    let found = (0..probe.entries.len()).filter(|place| probe.entries[*place].failed.is_none());
    let found: Vec<usize> = found.collect();
    spread(found.len(), count.unwrap_or(usize::MAX).max(1)).into_iter().map(|k| found[k]).collect()
}

/// Some places of a list, evenly spread, in their order.
fn spread(total: usize, count: usize) -> Vec<usize> {
    if count >= total {
        return (0..total).collect();
    }
    // Steps of the golden ratio along the table spread evenly over both axes, where equal steps would fall on
    // few columns.
    let step = |k: usize| ((k as f64 + 0.5) * 0.618_033_988_749_895).fract();
    let mut points = Vec::with_capacity(count);
    if count == 0 {
        return points;
    }
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
    /// What a probe is called beside the baselines.
    pub const PROBE: &'static str = "probe";

    /// The names of all that is judged: the probe, then the baselines.
    pub fn methods() -> impl Iterator<Item = &'static str> {
        std::iter::once(Self::PROBE).chain(Baseline::ALL.map(Baseline::title))
    }

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
    /// NRMSD costs next to nothing, the other metrics a quarter of a second for each pair of 300 × 300 pixels: they judge at most
    /// `metric_points` of the entries, evenly spread.
    ///
    /// # Errors
    /// Where a material cannot be made.
    pub fn validate(
        &self,
        points: &[usize],
        metric_points: usize,
        observe: &(dyn Fn() + Sync),
    ) -> Result<ValidationReport, RemapError> {
        self.validate_until(points, metric_points, observe, &|| false)
    }

    /// [`Validator::validate`] unless `stop` says that it should end.
    ///
    /// # Errors
    /// As there, and [`RemapError::Stopped`].
    pub fn validate_until(
        &self,
        points: &[usize],
        metric_points: usize,
        observe: &(dyn Fn() + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<ValidationReport, RemapError> {
        let judged = spread(points.len(), metric_points);
        let row = |(k, place): (usize, &usize)| {
            if stop() {
                return Err(RemapError::Stopped);
            }
            let row = self.score(*place, judged.binary_search(&k).is_ok());
            observe();
            row
        };
        let rows = points.par_iter().enumerate().map(row).collect::<Result<Vec<_>, RemapError>>()?;
        let methods: Vec<MethodScores> = Self::methods()
            .enumerate()
            .filter_map(|(k, name)| {
                let scores: Option<Vec<&Score>> = rows.iter().map(|row| row[k].as_ref()).collect();
                Some(method_scores(name, &scores?))
            })
            .collect();
        let mean = |m: &MethodScores| m.scores.masked.iter().map(|s| s.mean).sum::<f64>();
        let probe_is_best = methods[1..].iter().all(|m| mean(&methods[0]) < mean(m));
        let (scene, environment) = (self.scene().name.clone(), self.environment());
        let (size, points) = (self.size(), points.len());
        let metric_points = judged.len();
        let metrics = if judged.is_empty() { &[] } else { METRICS };
        Ok(ValidationReport {
            scene,
            environment,
            size,
            points,
            metric_points,
            metrics,
            methods,
            probe_is_best,
        })
    }

    /// The source material of an entry, and what [`Validator::methods`] make of it; nothing where a baseline does not apply.
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

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The map that lights it; empty where none does.
    pub fn environment(&self) -> String {
        self.scene.environment.as_ref().map(|e| e.map.clone()).unwrap_or_default()
    }

    /// Side of the pictures in pixels.
    pub fn size(&self) -> usize {
        self.renderer.size()
    }

    /// The radial mask of the scene's spheres.
    pub fn mask(&self) -> &Mask {
        self.renderer.mask()
    }

    /// Pictures of some materials in the scene, in their order.
    pub fn render(&self, materials: &[&Material]) -> Vec<Image> {
        self.renderer.render_batch(materials, Part::Full)
    }

    /// Scores of the probe and of each baseline that applies, by NRMSD or by all metrics.
    fn score(&self, place: usize, by_all: bool) -> Result<Vec<Option<Score>>, RemapError> {
        let (source, targets) = self.materials(place)?;
        let materials: Vec<&Material> = std::iter::once(&source).chain(targets.iter().flatten()).collect();
        let mut images = self.render(&materials).into_iter();
        let Some(reference) = images.next() else { return Ok(Vec::new()) };
        let metrics: Vec<&Metric> = METRICS.iter().filter(|_| by_all).collect();
        let score = |image: Image| -> Result<Score, RemapError> {
            let mask = Some(self.renderer.mask());
            Ok(Score {
                nrmsd: [nrmsd(&reference, &image, None)?, nrmsd(&reference, &image, mask)?],
                readings: read_metrics(&metrics, &reference, &image, mask)?,
            })
        };
        targets
            .iter()
            .map(|target| target.as_ref().and_then(|_| images.next()).map(score).transpose())
            .collect()
    }
}

/// A picture, judged.
struct Score {
    /// Whole and masked.
    nrmsd: [[f64; 3]; 2],
    /// Empty where NRMSD alone was asked for.
    readings: Vec<Reading>,
}

fn method_scores(name: &str, scores: &[&Score]) -> MethodScores {
    let channel = |kind: usize| {
        std::array::from_fn(|c| Statistics::of(scores.iter().map(move |score| score.nrmsd[kind][c])))
    };
    let judged: Vec<&[Reading]> =
        scores.iter().map(|score| &score.readings[..]).filter(|readings| !readings.is_empty()).collect();
    let metrics = judged.first().map_or(Vec::new(), |first| {
        (0..first.len())
            .map(|k| metric_scores(&judged.iter().map(|readings| &readings[k]).collect::<Vec<_>>()))
            .collect()
    });
    MethodScores {
        method: name.into(),
        scores: Scores { whole: channel(0), masked: channel(1) },
        metrics,
        verdicts: verdicts(&judged),
    }
}

/// One number over the points.
fn metric_scores(readings: &[&Reading]) -> MetricScores {
    let over = |value: fn(&Reading) -> Option<f64>| {
        let values: Option<Vec<f64>> = readings.iter().map(|reading| value(reading)).collect();
        values.map(|values| Statistics::of(values.iter().copied()))
    };
    let Reading { name, title, .. } = readings[0].clone();
    MetricScores { name, title, whole: over(|reading| reading.whole), masked: over(|reading| reading.masked) }
}

fn verdicts(judged: &[&[Reading]]) -> Option<Verdicts> {
    let jod = |readings: &&[Reading]| readings.iter().find(|reading| reading.name == "jod")?.whole;
    let jods: Vec<f64> = judged.iter().filter_map(jod).collect();
    (!jods.is_empty()).then(|| Verdicts::of(&jods))
}
