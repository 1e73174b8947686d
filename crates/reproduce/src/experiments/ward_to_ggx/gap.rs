//! A probe beside the best that the target model can do for the pictures that judge it.

use lookmatch_imaging::{Image, Mask, lab_planes, nrmsd, weighted_squared_distance};
use lookmatch_materials::Material;
use lookmatch_remap::{Probe, Validator, validation_points};
use lookmatch_search::{Bounds, Lattice};
use rayon::prelude::*;

use crate::tables::{channel_mean, mean};
use crate::{Cell, Row, Setting, Table, Watch};

/// Side of the pictures, in pixels.
const SIZE: usize = 128;
/// Targets that are rendered at once.
const BATCH: usize = 64;

/// How far apart two pictures are: see [`Kind`]; then NRMSD of the whole picture in red, green and blue.
type Distances = [f64; 6];

/// The first of [`Distances`].
#[derive(Clone, Copy)]
pub(super) enum Kind {
    /// NRMSD under the radial mask, mean of the channels.
    Masked,
    /// NRMSD of the whole picture, mean of the channels.
    Whole,
    /// Root mean square of ΔE*76 under the radial mask, which is what the search looks at.
    DeltaE,
}

const KINDS: [(Kind, &str); 3] = [
    (Kind::Masked, "NRMSD, masked"),
    (Kind::Whole, "NRMSD, whole picture"),
    (Kind::DeltaE, "ΔE76, root mean square, masked"),
];

/// Means over some source points.
pub(super) struct Gap {
    pub(super) points: usize,
    targets: usize,
    /// Of the probe's targets.
    probe: Distances,
    /// Of the best targets, for each source and each kind of distance another.
    best: Distances,
    /// Of the targets that are best by [`Kind::DeltaE`]: what a search with the same metric would take if it looked at these pictures.
    led: Distances,
}

/// A picture as it is compared.
struct Shot {
    image: Image,
    lab: Vec<f32>,
}

impl Shot {
    fn of(image: Image) -> Self {
        let mut lab = vec![0.0; 3 * image.pixels().len()];
        lab_planes(image.pixels(), &mut lab);
        Self { image, lab }
    }

    fn distances(&self, target: &Shot, mask: &Mask) -> anyhow::Result<Distances> {
        let masked = channel_mean(nrmsd(&self.image, &target.image, Some(mask))?);
        let [r, g, b] = nrmsd(&self.image, &target.image, None)?;
        let weight: f64 = mask.weights().iter().map(|w| f64::from(w * w)).sum();
        let squared = weighted_squared_distance(&self.lab, &target.lab, mask.weights());
        Ok([masked, channel_mean([r, g, b]), (squared / weight).sqrt(), r, g, b])
    }
}

/// Every target of a probe's lattice beside some of its sources, in the validation scene.
pub(super) fn gap(setting: &Setting, watch: &dyn Watch, probe: &Probe, name: &str) -> anyhow::Result<Gap> {
    let validator = Validator::cached(probe, &None, SIZE, &setting.cache, &|_| ())?;
    let mask = validator.mask();
    let places = validation_points(probe, Some(if setting.is_quick { 6 } else { 24 }));
    let (mut sources, mut taken) = (Vec::new(), Vec::new());
    for place in &places {
        let entry = &probe.entries[*place];
        let source = probe.source_material(&entry.source)?;
        let target = probe.target_material(&source, &entry.target, entry.body)?;
        let [source, target] =
            [&source, &target].map(|material| Shot::of(validator.render(&[material]).swap_remove(0)));
        taken.push(source.distances(&target, mask)?);
        sources.push(source);
    }
    let targets = targets(setting, probe)?;
    watch.begin(&format!("all targets of {name} in the validation scene"), targets.len());
    // The probe's own targets count as well: a quick run looks at a part of the lattice.
    let (mut best, mut led) = (taken.clone(), taken.clone());
    for batch in targets.chunks(BATCH) {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        let images = validator.render(&batch.iter().collect::<Vec<_>>());
        let shots: Vec<Shot> = images.into_par_iter().map(Shot::of).collect();
        let rows = best.par_iter_mut().zip(&mut led).zip(&sources);
        rows.try_for_each(|((best, led), source)| -> anyhow::Result<()> {
            for shot in &shots {
                let now = source.distances(shot, mask)?;
                best.iter_mut().zip(now).for_each(|(best, now)| *best = best.min(now));
                if now[Kind::DeltaE as usize] < led[Kind::DeltaE as usize] {
                    *led = now;
                }
            }
            Ok(())
        })?;
        watch.advance(batch.len());
    }
    let means = |rows: &[Distances]| std::array::from_fn(|k| mean(rows.iter().map(|row| row[k])));
    Ok(Gap {
        points: places.len(),
        targets: targets.len(),
        probe: means(&taken),
        best: means(&best),
        led: means(&led),
    })
}

/// The targets of a probe's lattice; in a quick run those at every fourth level of each longer axis.
fn targets(setting: &Setting, probe: &Probe) -> anyhow::Result<Vec<Material>> {
    let lattice = Lattice { axes: probe.target_axes.clone() };
    let is_coarse = |values: &[f64]| {
        let mut levels = lattice.axes.iter().zip(values);
        levels.all(|(axis, value)| axis.len() <= 2 || axis.nearest(*value) % 4 == 0)
    };
    // The body is the source's, whose colour every sphere replaces.
    let any = probe.source_material(&probe.entries[0].source)?;
    let points = lattice.points(&Bounds::full(&lattice));
    let values = points.map(|point| lattice.values(&point));
    let chosen = values.filter(|values| !setting.is_quick || is_coarse(values));
    Ok(chosen.map(|values| probe.target_material(&any, &values, None)).collect::<Result<_, _>>()?)
}

impl Gap {
    /// Mean distance of the probe's targets over that of the best ones.
    pub(super) fn ratio(&self, kind: Kind) -> f64 {
        self.probe[kind as usize] / self.best[kind as usize]
    }

    /// Mean distance of the targets that are best by [`Kind::DeltaE`] over that of the best ones: what looking with that metric costs, even on
    /// the pictures that judge.
    pub(super) fn cost_of_metric(&self, kind: Kind) -> f64 {
        self.led[kind as usize] / self.best[kind as usize]
    }

    /// Mean NRMSD of the whole picture, channel by channel, of the targets that suit each channel best.
    pub(super) fn best_channels(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.best[KINDS.len() + c])
    }

    pub(super) fn table(&self, index: &str) -> Table {
        let row = |(kind, name): (Kind, &str)| Row {
            name: name.into(),
            cells: [&self.probe, &self.best, &self.led]
                .map(|means| means[kind as usize])
                .into_iter()
                .chain([self.ratio(kind)])
                .map(Cell::Number)
                .collect(),
            is_main: matches!(kind, Kind::Masked),
        };
        Table {
            title: format!("The probe beside the best that GGX can do, {index}"),
            about: format!(
                "Mean over {} source points; the best is found among {} targets, for each source and each kind of distance, on the very \
                 pictures that judge it ({SIZE} pixels a side). The search minimises the last kind, in another scene under another light; \
                 beside it, what it would take if it looked at these pictures.",
                self.points, self.targets
            ),
            columns: ["", "probe", "best possible", "best by ΔE76", "probe over best"]
                .map(str::to_owned)
                .into(),
            rows: KINDS.map(row).into(),
        }
    }
}
