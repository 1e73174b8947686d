//! Whether a search finds something else with other weights.

use lookmatch_imaging::{FitnessWeights, Image, gsm_map, nrmsd};
use lookmatch_remap::{Endpoint, Options, Plan, Probe, Validator};
use rayon::prelude::*;

use super::NAME;
use crate::album::{Album, Shown};
use crate::probes::found;
use crate::tables::{channel_mean, mean};
use crate::{Cell, Comparison, Row, Setting, Table, Watch};

/// Pairs of models that are matched with both weights.
const PAIRS: [(&str, &str); 2] = [("as", "ggx-conductor"), ("ward", "ggx")];

/// What came of it.
pub(super) struct Outcome {
    pub(super) table: Table,
    pub(super) comparisons: Vec<Comparison>,
}

/// NRMSD, masked NRMSD and GSM of each source point's match.
type Judged = Vec<[f64; 3]>;

pub(super) fn outcome(
    setting: &Setting,
    watch: &dyn Watch,
    ours: &FitnessWeights,
) -> anyhow::Result<Outcome> {
    let album = Album::of(setting, NAME)?;
    let (mut rows, mut comparisons) = (Vec::new(), Vec::new());
    for (from, to) in PAIRS {
        let probe = |kind: &str, weights: FitnessWeights| -> anyhow::Result<Probe> {
            let mut plan = plan(setting, from, to)?;
            plan.metric.weights = weights;
            Ok(found(setting, watch, &format!("{NAME}-{from}-{to}-{kind}"), &plan)?.probe)
        };
        let probes = [probe("paper", FitnessWeights::default())?, probe("ours", *ours)?];
        let pairs = probes[0].entries.iter().zip(&probes[1].entries);
        let others: Vec<bool> = pairs.map(|(a, b)| a.target != b.target).collect();
        watch.begin("light of the spheres", 0);
        let validators = [
            Validator::cached(&probes[0], &None, setting.size(), &setting.cache, &|_| ())?,
            Validator::cached(&probes[1], &None, setting.size(), &setting.cache, &|_| ())?,
        ];
        watch.begin("validating", 2 * others.len());
        let judged = [judged(&probes[0], &validators[0], watch)?, judged(&probes[1], &validators[1], watch)?];
        for (name, judged) in ["the paper's", "ours"].iter().zip(&judged) {
            let means = [0, 1, 2].map(|k| mean(judged.iter().map(|values| values[k])));
            let changed = others.iter().filter(|is_other| **is_other).count();
            let changed = Cell::Text(format!("{changed} of {}", others.len()));
            let cells = means.map(Cell::Number).into_iter().chain([changed]).collect();
            rows.push(Row { name: format!("{from} to {to}, {name}"), cells, is_main: *name == "ours" });
        }
        comparisons.extend(comparison(&album, &probes, &validators[0], &judged)?);
    }
    let table = Table {
        title: "What a search finds with them".into(),
        about: "Constrained remaps, plastics on the quick lattice of sources and with the radial mask; means over all source points in the validation scene (three \
                spheres under an interior). GSM is 1 for equal pictures."
            .into(),
        columns: ["remap, weights", "NRMSD", "masked NRMSD", "GSM", "points with another target"]
            .map(str::to_owned)
            .into(),
        rows,
    };
    Ok(Outcome { table, comparisons })
}

fn plan(setting: &Setting, from: &str, to: &str) -> anyhow::Result<Plan> {
    let [source, target] = [from, to].map(lookmatch_materials::by_name);
    let options = Options {
        seed: setting.seed,
        // A plane of the paper's size takes minutes.
        quick: setting.is_quick || from == "ward",
        size: Some(setting.size()),
        mask: from == "ward",
        ..Options::default()
    };
    Ok(Plan::between(Endpoint::Model(source?), Endpoint::Model(target?), &options)?)
}

/// The source and the match of an entry, as the validation scene shows them.
fn pictures(probe: &Probe, validator: &Validator, place: usize) -> anyhow::Result<[(String, Image); 2]> {
    let entry = &probe.entries[place];
    let source = probe.source_material(&entry.source)?;
    let target = probe.target_material(&source, &entry.target, entry.body)?;
    let mut images = validator.render(&[&source, &target]).into_iter();
    let mut next = |material: String| (material, images.next().unwrap_or_else(|| Image::new(1, 1)));
    Ok([next(source.to_string()), next(target.to_string())])
}

fn judged(probe: &Probe, validator: &Validator, watch: &dyn Watch) -> anyhow::Result<Judged> {
    let one = |place: usize| -> anyhow::Result<[f64; 3]> {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        let [(_, source), (_, target)] = pictures(probe, validator, place)?;
        let of = |mask| nrmsd(&source, &target, mask).map(channel_mean);
        let values = [of(None)?, of(Some(validator.mask()))?, gsm_map(&source, &target)?.mean(None)?];
        watch.advance(1);
        Ok(values)
    };
    (0..probe.entries.len()).into_par_iter().map(one).collect()
}

/// The point at which the two matches are furthest apart, if they are at all.
fn comparison(
    album: &Album,
    probes: &[Probe; 2],
    validator: &Validator,
    judged: &[Judged; 2],
) -> anyhow::Result<Option<Comparison>> {
    let apart = |place: &usize| (judged[0][*place][0] - judged[1][*place][0]).abs();
    let places = (0..judged[0].len()).filter(|place| apart(place) > 0.0);
    let Some(place) = places.max_by(|a, b| apart(a).total_cmp(&apart(b))) else { return Ok(None) };
    let [(source, image), paper] = pictures(&probes[0], validator, place)?;
    let [_, ours] = pictures(&probes[1], validator, place)?;
    let shown = |title, (material, image)| Shown { title, material, image };
    let title = format!("Where the weights matter most: {source}");
    let source = shown("source", (source, image));
    let others = [shown("our weights", ours), shown("the paper's weights", paper)];
    let key = format!("{}-{}", probes[0].from.model().name, probes[0].to.model().name);
    Ok(Some(album.compare(&key, title, &source, &others, validator.mask())?))
}
