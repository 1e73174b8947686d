//! The best that the target model can do at all: a search on the very pictures that judge. Beside it the same search as the remap's, by
//! its metric, but in the scene that judges.

use std::collections::HashMap;

use anyhow::Context;
use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use lookmatch_remap::{Entry, Plan, Probe, Stage, Strategy, remap, validation_points};
use lookmatch_search::{Axis, Bounds, Lattice, Objective, ObjectiveError, Point, Problem, Search, Survey};

use super::Case;
use super::judge::{Judge, Nearness, Score, pair};
use super::tables::better_baseline;
use crate::tables::mean;
use crate::{Cell, Row, Setting, Table, Watch};

/// The probe beside the best.
pub(super) struct Gap {
    /// Places of the source points in the probe.
    places: Vec<usize>,
    mask: bool,
    /// Widths of the lobe that were rendered, for all points together.
    lobes: usize,
    /// For each point: how near the targets of [`METHODS`] come.
    found: Vec<[Nearness; 4]>,
}

const METHODS: [&str; 4] = [
    "probe",
    "the same search in the scene that judges",
    "the probe's widths, the best scale for these pictures",
    "best possible",
];
/// Places of [`METHODS`].
const THERE: usize = 1;
const BEST: usize = 3;

/// Searches some source points' best targets.
pub(super) fn gap(
    judge: &Judge,
    (probe, plan): (&Probe, &Plan),
    case: &Case,
    setting: &Setting,
    watch: &dyn Watch,
) -> anyhow::Result<Gap> {
    let places = validation_points(probe, Some(if setting.is_quick { 2 } else { 8 }));
    watch.begin("best targets for these pictures", places.len());
    let there = Plan { scene: judge.scene.clone(), strategy: Strategy::Unconstrained, ..plan.clone() };
    let stage = Stage::cached(&there, &setting.cache, &|_| ())?;
    let mut lobes = Lobes::new(judge, probe, case.mask, watch)?;
    let mut found = Vec::new();
    for place in &places {
        let entry = &probe.entries[*place];
        let (source, target) = pair(probe, entry)?;
        let shown = judge.picture(&source);
        let near = |material: &Material| judge.nearness(&shown, &judge.picture(material));
        let of = |values: &[f64]| near(&probe.target_material(&source, values, entry.body)?);
        let own = near(&target)?;
        let there = of(&searched(&there, &stage, entry, watch)?)?;
        let (best, scaled) = lobes.search(&shown, entry, setting.seed)?;
        // The search mixes pictures; what it found is rendered.
        let nearer = |a: Nearness, b: Nearness| if b.nrmsd(case.mask) < a.nrmsd(case.mask) { b } else { a };
        let scaled = nearer(own, of(&scaled)?);
        found.push([own, there, scaled, nearer(nearer(scaled, there), of(&best)?)]);
        watch.advance(1);
    }
    Ok(Gap { places, mask: case.mask, lobes: lobes.known.len(), found })
}

/// What a plan finds for the source of an entry.
fn searched(plan: &Plan, stage: &Stage, entry: &Entry, watch: &dyn Watch) -> anyhow::Result<Vec<f64>> {
    let one = |(axis, value): (&Axis, &f64)| Axis::listed(axis.name.clone(), vec![*value]);
    let source_axes = plan.source_axes.iter().zip(&entry.source).map(one).collect::<Result<_, _>>()?;
    let plan = Plan { source_axes, ..plan.clone() };
    let probe = remap(&plan, stage, None, &mut |_| {}, &|| watch.is_stopped())?;
    let entry = probe.entries.into_iter().next().context("a remap without a source")?;
    Ok(entry.target)
}

/// Pictures of the lobes of the target at all widths: rendered once, at the largest scale, for all sources.
struct Lobes<'a> {
    judge: &'a Judge,
    probe: &'a Probe,
    watch: &'a dyn Watch,
    /// Weights of the pixels.
    weights: Vec<f32>,
    /// What is seen without a lobe.
    dark: Image,
    known: HashMap<Point, Vec<[f32; 3]>>,
}

impl<'a> Lobes<'a> {
    fn new(judge: &'a Judge, probe: &'a Probe, mask: bool, watch: &'a dyn Watch) -> anyhow::Result<Self> {
        let mut values: Vec<f64> = probe.target_axes.iter().map(|axis| axis.value(0)).collect();
        values[0] = 0.0;
        let any = probe.source_material(&probe.entries[0].source)?;
        let dark = judge.picture(&probe.target_material(&any, &values, None)?);
        let weights = judge.renderer.mask().weights();
        let weights = if mask { weights.to_vec() } else { vec![1.0; weights.len()] };
        Ok(Self { judge, probe, watch, weights, dark, known: HashMap::new() })
    }

    /// The values of the target that suits a picture best, and of the entry's widths with the scale that does.
    fn search(&mut self, shown: &Image, entry: &Entry, seed: u64) -> anyhow::Result<(Vec<f64>, Vec<f64>)> {
        let lattice = Lattice { axes: self.probe.target_axes[1..].to_vec() };
        let own = lattice.nearest(&entry.target[1..]);
        let bounds = Bounds::full(&lattice);
        let problem = Problem { lattice: &lattice, bounds, guesses: vec![own.clone()], seed };
        let mut fit = Fit { lobes: self, shown };
        let best = Survey::default().run(&problem, &mut fit)?.best;
        let mut values = |point: &Point| -> anyhow::Result<Vec<f64>> {
            let (_, scale) = fit.best_scale(point)?;
            Ok(std::iter::once(scale).chain(lattice.values(point)).collect())
        };
        Ok((values(&best)?, values(&own)?))
    }

    /// What a lobe adds to each pixel at the largest scale.
    fn lobe(&mut self, point: &Point) -> anyhow::Result<&[[f32; 3]]> {
        if !self.known.contains_key(point) {
            anyhow::ensure!(!self.watch.is_stopped(), "stopped");
            let axes = &self.probe.target_axes;
            let level = |(axis, k): (&Axis, &u32)| axis.value(*k as usize);
            let largest = axes[0].value(axes[0].len() - 1);
            let values: Vec<f64> =
                std::iter::once(largest).chain(axes[1..].iter().zip(point).map(level)).collect();
            let any = self.probe.source_material(&self.probe.entries[0].source)?;
            let picture = self.judge.picture(&self.probe.target_material(&any, &values, None)?);
            let pixels = picture.pixels().iter().zip(self.dark.pixels());
            let added = pixels.map(|(a, b)| std::array::from_fn(|c| a[c] - b[c])).collect();
            self.known.insert(point.clone(), added);
        }
        Ok(&self.known[point])
    }
}

/// Lobes beside a picture. Pictures are linear in the scale of the lobe, but for the little that goes to the checkerboard and back.
struct Fit<'a, 'b> {
    lobes: &'a mut Lobes<'b>,
    shown: &'a Image,
}

impl Fit<'_, '_> {
    /// NRMSD, mean of the channels, with the level of the scale that makes it least.
    fn best_scale(&mut self, point: &Point) -> anyhow::Result<(f64, f64)> {
        let axis = self.lobes.probe.target_axes[0].clone();
        let largest = axis.value(axis.len() - 1);
        let sums = self.sums(point)?;
        let ranges = ranges(self.shown);
        let error = |scale: &f64| {
            let s = scale / largest;
            let square = |c: usize| (sums[c][0] + s * (sums[c][1] + s * sums[c][2])).max(0.0);
            mean((0..3).map(|c| square(c).sqrt() / ranges[c]))
        };
        let scored = axis.levels.iter().map(|scale| (error(scale), *scale));
        Ok(scored.fold((f64::INFINITY, 0.0), |best, now| if now.0 < best.0 { now } else { best }))
    }

    /// By channel, the mean square of the difference as a polynomial in the share of the largest scale.
    fn sums(&mut self, point: &Point) -> anyhow::Result<[[f64; 3]; 3]> {
        let shown = self.shown;
        self.lobes.lobe(point)?;
        let (lobe, lobes) = (&self.lobes.known[point], &*self.lobes);
        let mut sums = [[0.0; 3]; 3];
        for (k, weight) in lobes.weights.iter().enumerate() {
            for (c, sums) in sums.iter_mut().enumerate() {
                let of = |pixels: &[[f32; 3]]| f64::from(weight * pixels[k][c]);
                let (left, added) = (of(lobes.dark.pixels()) - of(shown.pixels()), of(lobe));
                let terms = [left * left, 2.0 * left * added, added * added];
                (0..3).for_each(|k| sums[k] += terms[k] / lobes.weights.len() as f64);
            }
        }
        Ok(sums)
    }
}

impl Objective for Fit<'_, '_> {
    fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
        let error = |point: &Point| self.best_scale(point).map(|(error, _)| error);
        points.iter().map(error).collect::<anyhow::Result<_>>().map_err(|e| e.to_string().into())
    }
}

/// Of each channel of a picture, from its darkest to its brightest pixel.
fn ranges(image: &Image) -> [f64; 3] {
    let ends = |c: usize| {
        let values = image.pixels().iter().map(|pixel| f64::from(pixel[c]));
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    std::array::from_fn(|c| ends(c).1 - ends(c).0)
}

impl Gap {
    fn mean(&self, method: usize) -> f64 {
        mean(self.found.iter().map(|found| found[method].nrmsd(self.mask)))
    }

    fn jod(&self, method: usize) -> f64 {
        mean(self.found.iter().map(|found| found[method].jod))
    }

    /// A method's mean over that of the best.
    fn over_best(&self, method: usize) -> f64 {
        self.mean(method) / self.mean(BEST)
    }

    pub(super) fn ratio(&self) -> f64 {
        self.over_best(0)
    }

    /// What the distance to the best is made of.
    pub(super) fn cause(&self) -> String {
        let there = self.over_best(THERE);
        let between = if there > 1.0 + 0.5 * (self.ratio() - 1.0) { "metrics" } else { "scenes" };
        format!(
            "measured: the same search, by Eq. 3 in CIELAB but on the scene that judges, comes to {there:.2} times the best, so that most of \
             the gap is between the two {between}; the targets that are best by NRMSD have a mean JOD of {:.2}, those of the probe {:.2}",
            self.jod(BEST),
            self.jod(0)
        )
    }

    /// What the distance to the better baseline is made of.
    pub(super) fn baseline_cause(&self, scores: &[Score]) -> String {
        let scores: Vec<&Score> = self.places.iter().map(|place| &scores[*place]).collect();
        let better = better_baseline(&scores, self.mask);
        format!(
            "measured at {} source points: the probe is at {:.2} times the better baseline there, the same search on the scene that judges at \
             {:.2}, and the best that the model can do at {:.2}",
            scores.len(),
            self.mean(0) / better,
            self.mean(THERE) / better,
            self.mean(BEST) / better,
        )
    }

    pub(super) fn table(&self, case: &Case) -> Table {
        let row = |(k, name): (usize, &&str)| Row {
            name: (*name).into(),
            cells: [self.mean(k), self.over_best(k), self.jod(k)].map(Cell::Number).into(),
            is_main: k == 0,
        };
        Table {
            title: format!("The probe beside the best that {} can do", case.models[1]),
            about: format!(
                "Mean over {} source points. The best target of each is searched on the very pictures that judge it: widths by survey and compass \
                 on the lattice of the remap ({} of them rendered), and for each of them every level of the scale, along which pictures are mixed. \
                 The same search in the scene that judges compares by Eq. 3.",
                self.places.len(),
                self.lobes
            ),
            columns: ["", &format!("mean {}", case.measure()), "over the best", "mean JOD"]
                .map(str::to_owned)
                .into(),
            rows: METHODS.iter().enumerate().map(row).collect(),
        }
    }
}
