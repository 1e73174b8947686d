//! Section 5.2, Figure 1: a colour checker whose patches are Ward plastics, from bright to dark highlights and from rough to smooth.

use anyhow::Context;
use lookmatch_imaging::{Mask, nrmsd};
use lookmatch_materials::Material;
use lookmatch_remap::{Preset, Probe, Strategy, Validator};
use lookmatch_rendering::{Scene, Spot};

use super::ward_to_ggx::{plan, probe_name};
use crate::album::{Album, Shown};
use crate::methods::Method;
use crate::nearest::{Reach, Values};
use crate::probes::found;
use crate::tables::{bar, channel_mean, mean};
use crate::twins::{Pair, Regions, Twins};
use crate::{Bar, Cell, Finding, Report, Row, Setting, Table, Watch};

const NAME: &str = "colour-checker";
/// Linear sRGB of the patches, row by row from the top left (see `assets/README.md`).
const COLOURS: &str = include_str!("../../assets/colour-checker.csv");
/// From the top row to the bottom one.
const SPECULAR: [f64; 4] = [0.35, 0.25, 0.15, 0.05];
/// From the left column to the right one.
const ROUGHNESS: [f64; 6] = [0.51, 0.41, 0.31, 0.21, 0.11, 0.01];
const PATCHES: usize = SPECULAR.len() * ROUGHNESS.len();
/// Share of a patch's width and height that the frame takes on either side.
const FRAME: f64 = 0.04;
/// What the frame is made of.
const FRAME_MATERIAL: &str = "lambert:diffuse=0.03";
/// Side of the pictures of spheres, in pixels.
const SPHERES: usize = 128;
/// Index and roughness of which the best targets are sought.
const LIMITS: [[f64; 2]; 2] = [[1.01, 10.0], [0.003, 1.0]];

/// The chart's scene with what was rendered of it.
struct Chart<'a> {
    twins: Twins,
    /// Pixels by patch; the frame's are in none.
    patches: Regions,
    source: Pair,
    watch: &'a dyn Watch,
}

/// A method's picture and what it says of each patch.
struct Judged {
    title: &'static str,
    picture: Pair,
    /// By patch.
    nrmsd: Vec<f64>,
}

pub(super) fn run(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    let probe = |name: &str, preset| {
        found(setting, watch, &probe_name(name), &plan(setting, Strategy::Constrained, preset, "genetic")?)
    };
    let (free, limited) = (probe("free", None)?.probe, probe("constrained", Some(Preset::Paper))?.probe);
    let sources = sources()?;
    let mut methods = vec![
        Method::probe("probe", &free, &sources)?,
        Method::probe("probe, index up to 1.85", &limited, &sources)?,
    ];
    methods.extend(Method::baselines(&free, &sources)?);

    let (size, samples) = if setting.is_quick { (120, 8) } else { (setting.size(), 32) };
    watch.begin("the chart", methods.len());
    let chart = Chart::prepare(&Scene::checker_wall(), &sources, size, samples, setting.seed, watch)?;
    let mut judged = Vec::new();
    for method in &methods {
        judged.push(chart.judge(method.title, &method.targets)?);
    }
    let targets = best(setting, watch, &sources, &methods)?;
    let best = chart.judge("best possible", &targets)?;
    // The search looks at smaller pictures: where another target is better in these, that is the best that is known.
    let all = || judged.iter().chain([&best]);
    let least: Vec<f64> =
        (0..PATCHES).map(|patch| all().map(|j| j.nrmsd[patch]).fold(f64::INFINITY, f64::min)).collect();
    let on_spheres = on_spheres(setting, &free, &sources, [&methods[0].targets, &targets])?;
    let gap = Gap { probe: judged[0].nrmsd.clone(), best: least, on_spheres };

    let album = Album::of(setting, NAME)?;
    let shown = |title, picture: &Pair| Shown { title, material: String::new(), image: picture.image(size) };
    let mut others: Vec<Shown> = judged.iter().map(|judged| shown(judged.title, &judged.picture)).collect();
    others.push(shown(best.title, &best.picture));
    let whole = Mask::uniform(size, size);
    let title = "The chart (Figure 1)".to_owned();
    let comparison = album.compare("chart", title, &shown("source", &chart.source), &others, &whole)?;
    Ok(Report {
        title: "A colour checker".into(),
        about: format!(
            "24 Ward plastics with the diffuse colours of the ColorChecker: specular reflectance falls from {} in the top row to {} in the bottom \
             one, roughness from {} in the left column to {} in the right one. The wall stands in the light of a studio and of a lamp that the \
             search never saw; it is path traced, {size} pixels a side, twice with {samples} paths for each of them. All pictures share their \
             seeds.",
            SPECULAR[0], SPECULAR[3], ROUGHNESS[0], ROUGHNESS[5]
        ),
        findings: vec![gap.finding()],
        tables: vec![methods_table(&judged, &best, &gap), patches_table(&judged, &gap)],
        comparisons: vec![comparison],
        notes: vec![format!(
            "Noise of the pictures (means of both): NRMSD {:.4} of the whole source. It does not add to the numbers of patches, which are roots \
             of mean products of two differences with independent noise; it is part of the NRMSD below the pictures.",
            chart.source.noise()
        )],
        ..Report::default()
    })
}

/// The patches' materials, row by row from the top left.
fn sources() -> anyhow::Result<Vec<Material>> {
    let mut sources = Vec::new();
    for (k, line) in COLOURS.lines().skip(1).take(PATCHES).enumerate() {
        let (_, colour) = line.split_once(',').context("a patch has a name and a colour")?;
        let (specular, roughness) = (SPECULAR[k / ROUGHNESS.len()], ROUGHNESS[k % ROUGHNESS.len()]);
        let colour = colour.replace(',', "/");
        sources.push(Material::parse(&format!(
            "ward:specular={specular},roughness={roughness},diffuse={colour}"
        ))?);
    }
    Ok(sources)
}

/// The patch at a point of the wall, or [`PATCHES`] for the frame.
fn patch(spot: Spot) -> usize {
    let place = |t: f64, count: usize| {
        let (k, within) = ((t * count as f64) as usize, (t * count as f64).fract());
        (FRAME..=1.0 - FRAME).contains(&within).then_some(k.min(count - 1))
    };
    // Rows are counted from the top, texture coordinates from below.
    let [u, v] = spot.texture;
    match (place(u, ROUGHNESS.len()), place(v, SPECULAR.len())) {
        (Some(column), Some(row)) => (SPECULAR.len() - 1 - row) * ROUGHNESS.len() + column,
        _ => PATCHES,
    }
}

impl<'a> Chart<'a> {
    fn prepare(
        scene: &Scene,
        sources: &[Material],
        size: usize,
        samples: u32,
        seed: u64,
        watch: &'a dyn Watch,
    ) -> anyhow::Result<Self> {
        let twins = Twins::prepare(scene, size, samples, seed)?;
        let patches = twins.regions(PATCHES, |spot| Some(patch(spot)).filter(|patch| *patch < PATCHES));
        let source = draw(&twins, sources, watch)?;
        Ok(Self { twins, patches, source, watch })
    }

    fn judge(&self, title: &'static str, targets: &[Material]) -> anyhow::Result<Judged> {
        let picture = draw(&self.twins, targets, self.watch)?;
        self.watch.advance(1);
        let nrmsd = self.source.nrmsd(&picture, &self.patches, None);
        Ok(Judged { title, picture, nrmsd })
    }
}

fn draw(twins: &Twins, materials: &[Material], watch: &dyn Watch) -> anyhow::Result<Pair> {
    let mut worn = materials.to_vec();
    worn.push(Material::parse(FRAME_MATERIAL)?);
    twins.draw(&worn, &patch, watch)
}

/// The targets that suit each patch best, sought on smaller pictures with noise of their own.
fn best(
    setting: &Setting,
    watch: &dyn Watch,
    sources: &[Material],
    methods: &[Method],
) -> anyhow::Result<Vec<Material>> {
    let (size, samples, levels, rounds) = if setting.is_quick { (48, 8, 4, 6) } else { (96, 32, 6, 14) };
    let reach = Reach { limits: LIMITS, levels, rounds };
    let seed = setting.seed.wrapping_add(1);
    let chart = Chart::prepare(&Scene::checker_wall(), sources, size, samples, seed, watch)?;
    let guesses: Vec<Vec<Values>> = methods[..2].iter().map(Method::values).collect::<anyhow::Result<_>>()?;
    watch.begin("the best targets of all patches", reach.pictures(guesses.len()));
    let best = reach.search(&guesses, watch, &mut |values| {
        Ok(chart.judge("", &methods[0].with_values(values)?)?.nrmsd)
    })?;
    methods[0].with_values(&best)
}

/// Mean masked NRMSD of two sets of targets on the spheres of the validation scene, where every side of a plastic is seen.
fn on_spheres(
    setting: &Setting,
    probe: &Probe,
    sources: &[Material],
    targets: [&[Material]; 2],
) -> anyhow::Result<[f64; 2]> {
    let validator = Validator::cached(probe, &None, SPHERES, &setting.cache, &|_| ())?;
    let mut means = [0.0; 2];
    for (k, source) in sources.iter().enumerate() {
        let images = validator.render(&[source, &targets[0][k], &targets[1][k]]);
        for (mean, image) in means.iter_mut().zip(&images[1..]) {
            *mean += channel_mean(nrmsd(&images[0], image, Some(validator.mask()))?) / PATCHES as f64;
        }
    }
    Ok(means)
}

/// The probe beside the best, by patch.
struct Gap {
    probe: Vec<f64>,
    best: Vec<f64>,
    /// Mean NRMSD on spheres: of the probe's targets, and of those that suit the patches best.
    on_spheres: [f64; 2],
}

impl Gap {
    fn finding(&self) -> Finding {
        let name = "mean NRMSD of the patches over that of the best target of each, free index";
        let [probe, best] = self.on_spheres;
        let cause = format!(
            "a patch of a plane shows one side of its plastic, to which index and roughness can be bent: on spheres, which show every side, the \
             targets that suit the patches best have a mean masked NRMSD of {best:.4}, those of the probe {probe:.4}"
        );
        bar(name.into(), average(&self.probe) / average(&self.best), Bar::AtMost(1.10), &cause)
    }
}

fn average(values: &[f64]) -> f64 {
    mean(values.iter().copied())
}

fn methods_table(judged: &[Judged], best: &Judged, gap: &Gap) -> Table {
    let row = |title: &str, nrmsd: &[f64]| Row {
        name: title.into(),
        cells: vec![
            Cell::Number(average(nrmsd)),
            Cell::Number(nrmsd.iter().copied().fold(0.0, f64::max)),
            Cell::Number(average(nrmsd) / average(&gap.best)),
        ],
        is_main: title == "probe",
    };
    let mut rows: Vec<Row> = judged.iter().map(|judged| row(judged.title, &judged.nrmsd)).collect();
    rows.push(row(best.title, &gap.best));
    Table {
        title: "Patches".into(),
        about: "NRMSD of each patch, over the range of the whole picture. The best target of each patch is sought over index and roughness on \
                pictures of the same chart with other noise."
            .into(),
        columns: ["", "mean", "largest", "over the best"].map(str::to_owned).into(),
        rows,
    }
}

/// The grid of patches: probe, better baseline, best possible.
fn patches_table(judged: &[Judged], gap: &Gap) -> Table {
    let baseline = |k: usize| judged[2..].iter().map(|j| j.nrmsd[k]).fold(f64::INFINITY, f64::min);
    let rows = SPECULAR.iter().enumerate().flat_map(|(row, specular)| {
        let line = |name: &str, value: &dyn Fn(usize) -> f64, is_main| Row {
            name: format!("specular {specular}, {name}"),
            cells: (0..ROUGHNESS.len()).map(|c| Cell::Number(value(row * ROUGHNESS.len() + c))).collect(),
            is_main,
        };
        [
            line("probe", &|k| gap.probe[k], true),
            line("better baseline", &baseline, false),
            line("best possible", &|k| gap.best[k], false),
        ]
    });
    let columns = std::iter::once(String::new()).chain(ROUGHNESS.map(|r| format!("roughness {r}")));
    Table {
        title: "NRMSD by patch".into(),
        about: "As the chart lies: specular reflectance falls downwards, roughness to the right. Of the baselines, the one that suits the patch \
                better."
            .into(),
        columns: columns.collect(),
        rows: rows.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chart_is_that_of_figure_1() {
        let at = |u: f64, v: f64| patch(Spot { subject: 0, texture: [u, v] });
        let sources = sources().unwrap();
        assert_eq!(sources.len(), PATCHES);
        // Top left: the brightest and roughest, with the first colour; bottom right: the darkest and smoothest, black.
        let of = |k: usize| ["specular", "roughness", "diffuse"].map(|name| sources[k].number(name).unwrap());
        assert_eq!(of(at(0.08, 0.9)), [0.35, 0.51, 0.173683]);
        assert_eq!(of(at(0.92, 0.1)), [0.05, 0.01, 0.031354]);
        assert_eq!(at(0.25, 0.6), 7);
        assert_eq!([at(0.001, 0.5), at(0.5, 0.9), at(0.1, 0.75), at(0.999, 0.999)], [PATCHES; 4]);
    }
}
