//! Section 7.2, experiment 1: is a neighbour of the probe's result nearer to the source? The ranking is that of ColorVideoVDP.

use lookmatch_imaging::{Image, jod};
use lookmatch_materials::{Levels, Material};
use lookmatch_plots::{Chart, Series, draw_charts};
use lookmatch_remap::{Endpoint, Options, Plan, Probe, Side, Vary, apply};
use lookmatch_rendering::{EnvironmentLight, Illumination, Part, Renderer, Scene};
use rayon::prelude::*;

use crate::album::Album;
use crate::probes::found;
use crate::tables::bar;
use crate::{Bar, Cell, Figure, Report, Row, Setting, Table, Watch};

/// The paper's 25 points.
const SPECULAR: [f64; 5] = [0.065, 0.13, 0.195, 0.26, 0.325];
const ROUGHNESS: [f64; 5] = [0.01, 0.05, 0.13, 0.29, 0.61];
/// The colour of their bodies.
const BODY: &str = "0.1/0.3/0.1";
/// Neighbours to each side.
const REACH: i32 = 4;
/// A light that no search has seen.
const LIGHT: &str = "sunset";
/// Share of the points at which the paper's observers preferred the probe's result, in both directions.
const PREFERRED: f64 = 0.56;

/// A direction in which neighbours lie.
struct Direction {
    /// In tables.
    name: &'static str,
    /// Parameters of the target that change together.
    parameters: &'static [&'static str],
    /// What a neighbour is away from the next.
    step: f64,
    /// Least value.
    least: f64,
    /// The paper's share for the neighbour below the probe's result.
    below: f64,
}

const DIRECTIONS: [Direction; 2] = [
    Direction { name: "index", parameters: &["ior"], step: 0.05, least: 1.01, below: 0.375 },
    Direction {
        name: "roughness",
        parameters: &["roughness_u", "roughness_v"],
        step: 0.02,
        least: 0.005,
        below: 0.28,
    },
];

/// The neighbours of a point and how near to the source they look.
type Ranking = Vec<(i32, f64)>;

pub(super) fn run(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    let probe = found(setting, watch, "psychometric", &plan(setting)?)?.probe;
    watch.begin("light of the sphere", 0);
    let scene = Scene { environment: Some(EnvironmentLight::balanced(LIGHT)?), ..Scene::reference() };
    let renderer = Renderer::cached(&scene, Illumination::All, setting.size(), &setting.cache, &|_| ())?;
    let points: Vec<(f64, f64)> = SPECULAR.iter().flat_map(|s| ROUGHNESS.map(|r| (*s, r))).collect();
    watch.begin("ranking neighbours", points.len());
    let rank = |point: &(f64, f64)| -> anyhow::Result<[Ranking; 2]> {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        let rankings = [
            ranking(&probe, &renderer, *point, &DIRECTIONS[0])?,
            ranking(&probe, &renderer, *point, &DIRECTIONS[1])?,
        ];
        watch.advance(1);
        Ok(rankings)
    };
    let rankings: Vec<[Ranking; 2]> = points.par_iter().map(rank).collect::<anyhow::Result<_>>()?;
    let album = Album::of(setting, "psychometric")?;
    let mut figures = Vec::new();
    for (k, direction) in DIRECTIONS.iter().enumerate() {
        let charts: Vec<Chart> = points.iter().zip(&rankings).map(|(p, all)| chart(*p, &all[k])).collect();
        let (path, file) = album.figure(&format!("{}.svg", direction.name));
        draw_charts(&charts, ROUGHNESS.len(), (230, 190), &path)?;
        figures.push(Figure {
            title: format!("Neighbours along the {} (Figure 16)", direction.name),
            about: "Rank of each neighbour, the nearest first; 0 is the probe's result. Roughness grows to the right, specular reflectance \
                    downwards."
                .into(),
            file,
        });
    }
    let firsts = |k: usize, wanted: &dyn Fn(i32) -> bool| {
        let count = rankings.iter().filter(|all| wanted(first(&all[k]))).count();
        count as f64 / rankings.len() as f64
    };
    let findings = DIRECTIONS.iter().enumerate().map(|(k, direction)| {
        let name = format!("share of points at which the probe's own {} is ranked first", direction.name);
        bar(
            name,
            firsts(k, &|id| id == 0),
            Bar::AtLeast(PREFERRED),
            "the search sets silhouettes aside by its mask, the ranking sees them; and the smallest difference between noise-free pictures ranks",
        )
    });
    let row = |(k, direction): (usize, &Direction)| {
        let share = |wanted: &dyn Fn(i32) -> bool| Cell::Text(format!("{:.0} %", 100.0 * firsts(k, wanted)));
        Row {
            name: format!("{}, steps of {}", direction.name, direction.step),
            cells: vec![
                share(&|id| id == 0),
                Cell::Text(format!("{:.0} %", 100.0 * PREFERRED)),
                share(&|id| id == -1),
                Cell::Text(format!("{:.1} %", 100.0 * direction.below)),
                share(&|id| id < -1),
                share(&|id| id > 0),
            ],
            is_main: false,
        }
    };
    let columns =
        ["direction", "probe first", "the paper", "-1 first", "the paper", "+1 first", "others first"];
    Ok(Report {
        title: "Perceptual experiment 1, simulated".into(),
        about: format!(
            "For the paper's 25 Ward plastics (bodies {BODY}), the probe's GGX match and its four neighbours to each side, first in index and then \
             in roughness, are ranked by their JOD beside the source: a sphere under the map '{LIGHT}' and a lamp, {} pixels a side.",
            setting.size()
        ),
        findings: findings.collect(),
        tables: vec![Table {
            title: "Which of the nine looks most like the source".into(),
            about: "Shares of the 25 points.".into(),
            columns: columns.map(str::to_owned).into(),
            rows: DIRECTIONS.iter().enumerate().map(row).collect(),
        }],
        figures,
        notes: vec![
            "The paper's steps are in its supplement, which is not at hand; its objects are blobs of random shapes, so that nobody compares pixel by \
             pixel. Here pictures of one sphere without noise are compared, where the smallest difference counts. The free range of the index is used."
                .into(),
        ],
        ..Report::default()
    })
}

/// The constrained remap of a lattice that has the 25 points, with a free index.
fn plan(setting: &Setting) -> anyhow::Result<Plan> {
    let [ward, ggx] = ["ward", "ggx"].map(lookmatch_materials::by_name);
    let vary = |name: &str, min, max, step| Vary {
        side: Some(Side::Source),
        name: name.into(),
        levels: Levels { min, max, step },
    };
    let options = Options {
        seed: setting.seed,
        mask: true,
        size: Some(setting.size()),
        vary: vec![vary("specular", 0.065, 0.325, 0.065), vary("roughness", 0.01, 0.61, 0.04)],
        ..Options::default()
    };
    Ok(Plan::between(Endpoint::Model(ward?), Endpoint::Model(ggx?), &options)?)
}

/// The result of the probe and its neighbours in a direction, with their JOD; those below the least value are left out.
fn ranking(
    probe: &Probe,
    renderer: &Renderer,
    (specular, roughness): (f64, f64),
    direction: &Direction,
) -> anyhow::Result<Ranking> {
    let source = Material::parse(&format!("ward:specular={specular},roughness={roughness},diffuse={BODY}"))?;
    let target = apply(probe, &source, true)?.target;
    let own = target.number(direction.parameters[0])?;
    let neighbour = |id: i32| -> anyhow::Result<Option<(i32, Material)>> {
        let value = own + f64::from(id) * direction.step;
        if id != 0 && value < direction.least {
            return Ok(None);
        }
        let mut material = target.clone();
        // Both widths of the lobe.
        direction.parameters.iter().try_for_each(|name| material.set_number(name, value))?;
        Ok(Some((id, material)))
    };
    let neighbours: Vec<(i32, Material)> =
        (-REACH..=REACH).filter_map(|id| neighbour(id).transpose()).collect::<anyhow::Result<_>>()?;
    let materials: Vec<&Material> =
        std::iter::once(&source).chain(neighbours.iter().map(|(_, material)| material)).collect();
    let images: Vec<Image> = renderer.render_batch(&materials, Part::Full);
    neighbours.iter().zip(&images[1..]).map(|((id, _), image)| Ok((*id, jod(&images[0], image)?))).collect()
}

/// Which neighbour looks most like the source; the probe's result where none looks better.
fn first(ranking: &Ranking) -> i32 {
    let better =
        |a: &&(i32, f64), b: &&(i32, f64)| a.1.total_cmp(&b.1).then_with(|| b.0.abs().cmp(&a.0.abs()));
    ranking.iter().max_by(better).map_or(0, |(id, _)| *id)
}

/// Ranks over the neighbours: a V about the probe's result, if it is right.
fn chart((specular, roughness): (f64, f64), ranking: &Ranking) -> Chart {
    let rank = |jod: f64| 1.0 + ranking.iter().filter(|(_, other)| *other > jod).count() as f64;
    let points = ranking.iter().map(|(id, jod)| (f64::from(*id), rank(*jod))).collect();
    Chart {
        title: format!("S {specular}, R {roughness}"),
        x: "neighbour".into(),
        y: "rank".into(),
        series: vec![Series { name: String::new(), points }],
    }
}
