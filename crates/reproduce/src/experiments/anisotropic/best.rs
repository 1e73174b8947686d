//! The best that the target model can do at all: a search on the very pictures that judge.

use std::collections::HashMap;

use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use lookmatch_remap::{Entry, Probe, validation_points};
use lookmatch_search::{Axis, Bounds, Lattice, Objective, ObjectiveError, Point, Problem, Search, Survey};

use super::Case;
use super::judge::{Judge, pair};
use crate::tables::mean;
use crate::{Cell, Row, Setting, Table, Watch};

/// The probe beside the best.
pub(super) struct Gap {
    points: usize,
    /// Widths of the lobe that were rendered, for all points together.
    lobes: usize,
    /// For each point: the NRMSD of the probe's target, of the best one, and of the probe's with the best scale.
    errors: Vec<[f64; 3]>,
}

/// Searches some source points' best targets.
pub(super) fn gap(
    judge: &Judge,
    probe: &Probe,
    case: &Case,
    setting: &Setting,
    watch: &dyn Watch,
) -> anyhow::Result<Gap> {
    let places = validation_points(probe, Some(if setting.is_quick { 3 } else { 12 }));
    watch.begin("best targets for these pictures", places.len());
    let mut lobes = Lobes::new(judge, probe, case.mask, watch)?;
    let mut errors = Vec::new();
    for place in &places {
        let entry = &probe.entries[*place];
        let (source, target) = pair(probe, entry)?;
        let shown = judge.picture(&source);
        let near = |material: &Material| -> anyhow::Result<f64> {
            Ok(judge.nearness(&shown, &judge.picture(material))?.nrmsd(case.mask))
        };
        let own = near(&target)?;
        let (best, scaled) = lobes.search(&shown, entry, setting.seed)?;
        let material = |values: &[f64]| probe.target_material(&source, values, entry.body);
        // The search mixes pictures; what it found is rendered.
        errors.push([own, near(&material(&best)?)?.min(own), near(&material(&scaled)?)?.min(own)]);
        watch.advance(1);
    }
    Ok(Gap { points: places.len(), lobes: lobes.known.len(), errors })
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
    fn mean(&self, k: usize) -> f64 {
        mean(self.errors.iter().map(|errors| errors[k]))
    }

    pub(super) fn ratio(&self) -> f64 {
        self.mean(0) / self.mean(1)
    }

    /// What the distance to the best is made of.
    pub(super) fn cause(&self) -> String {
        format!(
            "the metric and the light of the search are not those of the validation: with the scale that suits these pictures and the \
             probe's widths, the ratio is {:.2}",
            self.mean(2) / self.mean(1)
        )
    }

    pub(super) fn table(&self, case: &Case) -> Table {
        let row = |name: &str, k: usize| Row {
            name: name.into(),
            cells: vec![Cell::Number(self.mean(k)), Cell::Number(self.mean(k) / self.mean(1))],
            is_main: k == 0,
        };
        Table {
            title: format!("The probe beside the best that {} can do", case.models[1]),
            about: format!(
                "Mean over {} source points. The best target of each is searched on the very pictures that judge it: widths by survey and compass \
                 on the lattice of the remap ({} of them rendered), and for each of them every level of the scale, along which pictures are mixed.",
                self.points, self.lobes
            ),
            columns: vec!["".into(), format!("mean {}", case.measure()), "over the best".into()],
            rows: vec![
                row("probe", 0),
                row("the probe's widths, the best scale for these pictures", 2),
                row("best possible", 1),
            ],
        }
    }
}
