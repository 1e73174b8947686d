//! Section 7.2, experiment 1: is a neighbour of the probe's result nearer to the source? The ranking is that of ColorVideoVDP, on a
//! sphere without noise, and on a blob as the paper's, with noise that is the same for all.

use lookmatch_imaging::{Image, Mask, jod};
use lookmatch_materials::{Levels, Material};
use lookmatch_plots::{Chart, Series, draw_charts};
use lookmatch_remap::{Endpoint, Options, Plan, Probe, Side, Vary, apply};
use lookmatch_rendering::{
    EnvironmentLight, Illumination, Part, PathTracer, PointLight, Render, Renderer, Scene,
};
use rayon::prelude::*;

use crate::album::{Album, Shown};
use crate::probes::found;
use crate::tables::bar;
use crate::{Bar, Cell, Comparison, Figure, Report, Row, Setting, Table, Watch};

/// The paper's 25 points.
const SPECULAR: [f64; 5] = [0.065, 0.13, 0.195, 0.26, 0.325];
const ROUGHNESS: [f64; 5] = [0.01, 0.05, 0.13, 0.29, 0.61];
/// The colour of their bodies.
const BODY: &str = "0.1/0.3/0.1";
/// Neighbours to each side.
const REACH: i32 = 4;
/// A light that no search has seen.
const LIGHT: &str = "sunset";
/// Side of the blob's pictures in pixels.
const BLOB: usize = 128;
/// Paths for each pixel that tell which of them show it.
const OUTLINE: u32 = 16;
/// Points of which a quick run shows blobs.
const QUICK_BLOBS: usize = 2;
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

/// The rankings of some points, in both directions.
struct Ranked {
    /// What the pictures show.
    body: &'static str,
    points: Vec<(f64, f64)>,
    rankings: Vec<[Ranking; 2]>,
}

/// Pictures of some materials.
type Draw<'a> = dyn Fn(&[&Material]) -> anyhow::Result<Vec<Image>> + Sync + 'a;

pub(super) fn run(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    let probe = found(setting, watch, "psychometric", &plan(setting)?)?.probe;
    watch.begin("light of the sphere", 0);
    let scene = Scene { environment: Some(EnvironmentLight::balanced(LIGHT)?), ..Scene::reference() };
    let renderer = Renderer::cached(&scene, Illumination::All, setting.size(), &setting.cache, &|_| ())?;
    let points: Vec<(f64, f64)> = SPECULAR.iter().flat_map(|s| ROUGHNESS.map(|r| (*s, r))).collect();
    let sphere = ranked(&probe, watch, "sphere", points.clone(), &|materials| {
        Ok(renderer.render_batch(materials, Part::Full))
    })?;
    watch.begin("the blob's surroundings", 0);
    let blob = Blob::prepare(scene, setting)?;
    let draw = |materials: &[&Material]| {
        let one = |material: &&Material| {
            anyhow::ensure!(!watch.is_stopped(), "stopped");
            Ok(blob.draw(material))
        };
        materials.iter().map(one).collect()
    };
    let shown = if setting.is_quick { some(&points, QUICK_BLOBS) } else { points };
    let blobs = ranked(&probe, watch, "blob", shown, &draw)?;
    let album = Album::of(setting, "psychometric")?;
    let mut figures = figures(&album, &sphere)?;
    if !setting.is_quick {
        figures.extend(self::figures(&album, &blobs)?);
    }
    let findings = DIRECTIONS.iter().enumerate().map(|(k, direction)| {
        let name = format!("share of points at which the probe's own {} is ranked first", direction.name);
        bar(
            name,
            sphere.first(k, &|id| id == 0),
            Bar::AtLeast(PREFERRED),
            "the search sets silhouettes aside by its mask, the ranking sees them; and the smallest difference between noise-free pictures ranks",
        )
    });
    Ok(Report {
        title: "Perceptual experiment 1, simulated".into(),
        about: format!(
            "For the paper's 25 Ward plastics (bodies {BODY}), the probe's GGX match and its four neighbours to each side, first in index and then \
             in roughness, are ranked by their JOD beside the source: a sphere under the map '{LIGHT}' and a lamp, {} pixels a side. For {} of them \
             the same is done with a blob in the sphere's place, path traced with {} paths for each of {} pixels a side, the seed of all \
             pictures being one, and so is what surrounds the blob.",
            setting.size(),
            blobs.points.len(),
            paths(setting),
            BLOB,
        ),
        findings: findings.collect(),
        tables: vec![table(&[sphere, blobs])],
        comparisons: vec![comparison(&album, &probe, &draw)?],
        figures,
        notes: vec![
            "The paper's steps are in its supplement, which is not at hand. Its observers saw blobs whose shapes differed from picture to picture, so \
             that nobody could compare pixel by pixel; here all pictures of a ranking show one shape, where the smallest difference counts. The \
             free range of the index is used."
                .into(),
        ],
        ..Report::default()
    })
}

/// Paths for each pixel of a blob.
fn paths(setting: &Setting) -> u32 {
    if setting.is_quick { 16 } else { 32 }
}

/// The scene with a blob in the sphere's place. What surrounds the blob is rendered once, beside one source.
struct Blob {
    tracer: PathTracer,
    /// The blob's pixels.
    pixels: Vec<u32>,
    surroundings: Image,
}

impl Blob {
    fn prepare(scene: Scene, setting: &Setting) -> anyhow::Result<Self> {
        let blobs = Scene::blobs().meshes.into_iter().filter(|mesh| mesh.centre[0] == 0.0);
        let scene = Scene { spheres: Vec::new(), meshes: blobs.collect(), ..scene };
        let tracer = PathTracer::prepare(&scene, Illumination::All, BLOB, paths(setting), setting.seed)?;
        // With nothing else there, a lamp at the eye lights all that is seen.
        let lamp = PointLight { position: scene.camera.eye, intensity: [1.0; 3] };
        let alone = Scene { plane: None, environment: None, point_lights: vec![lamp], ..scene };
        let alone = PathTracer::prepare(&alone, Illumination::Point, BLOB, OUTLINE, setting.seed)?
            .render(&Material::parse("lambert")?, Part::Full);
        let lit = alone.pixels().iter().enumerate().filter(|(_, pixel)| pixel[0] > 0.0);
        let pixels = lit.map(|(k, _)| k as u32).collect();
        let surroundings = tracer.render(&source((SPECULAR[2], ROUGHNESS[2]))?, Part::Full);
        Ok(Self { tracer, pixels, surroundings })
    }

    fn draw(&self, material: &Material) -> Image {
        let mut image = self.surroundings.clone();
        let seen = self.tracer.radiance(material, Part::Full, &self.pixels);
        self.pixels.iter().zip(seen).for_each(|(pixel, seen)| image.pixels_mut()[*pixel as usize] = seen);
        image
    }
}

/// Some points of a list, evenly spread.
fn some(points: &[(f64, f64)], count: usize) -> Vec<(f64, f64)> {
    (0..count).map(|k| points[(2 * k + 1) * points.len() / (2 * count)]).collect()
}

/// Ranks the neighbours of some points.
fn ranked(
    probe: &Probe,
    watch: &dyn Watch,
    body: &'static str,
    points: Vec<(f64, f64)>,
    draw: &Draw,
) -> anyhow::Result<Ranked> {
    watch.begin(&format!("ranking neighbours, {body}"), points.len());
    let rank = |point: &(f64, f64)| -> anyhow::Result<[Ranking; 2]> {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        let rankings = rankings(probe, draw, *point)?;
        watch.advance(1);
        Ok(rankings)
    };
    let rankings: Vec<[Ranking; 2]> = points.par_iter().map(rank).collect::<anyhow::Result<_>>()?;
    Ok(Ranked { body, points, rankings })
}

impl Ranked {
    /// The share of points at which a neighbour that is wanted comes first in a direction.
    fn first(&self, direction: usize, wanted: &dyn Fn(i32) -> bool) -> f64 {
        let count = self.rankings.iter().filter(|all| wanted(first(&all[direction]))).count();
        count as f64 / self.rankings.len() as f64
    }

    fn row(&self, k: usize) -> Row {
        let direction = &DIRECTIONS[k];
        let share =
            |wanted: &dyn Fn(i32) -> bool| Cell::Text(format!("{:.0} %", 100.0 * self.first(k, wanted)));
        Row {
            name: format!("{}, {} in steps of {}", self.body, direction.name, direction.step),
            cells: vec![
                Cell::Text(self.points.len().to_string()),
                share(&|id| id == 0),
                Cell::Text(format!("{:.0} %", 100.0 * PREFERRED)),
                share(&|id| id == -1),
                Cell::Text(format!("{:.1} %", 100.0 * direction.below)),
                share(&|id| id == 1),
                share(&|id| id.abs() > 1),
                share(&|id| id.abs() <= 1),
            ],
            is_main: false,
        }
    }
}

fn table(all: &[Ranked]) -> Table {
    let columns = [
        "direction",
        "points",
        "probe first",
        "the paper",
        "-1 first",
        "the paper",
        "+1 first",
        "others first",
        "probe or next to it",
    ];
    Table {
        title: "Which of the nine looks most like the source".into(),
        about: "Shares of the points.".into(),
        columns: columns.map(str::to_owned).into(),
        rows: all.iter().flat_map(|ranked| [ranked.row(0), ranked.row(1)]).collect(),
    }
}

/// The V-shaped plots of both directions.
fn figures(album: &Album, ranked: &Ranked) -> anyhow::Result<Vec<Figure>> {
    let figure = |(k, direction): (usize, &Direction)| {
        let charts: Vec<Chart> =
            ranked.points.iter().zip(&ranked.rankings).map(|(p, all)| chart(*p, &all[k])).collect();
        let (path, file) = album.figure(&format!("{}-{}.svg", ranked.body, direction.name));
        draw_charts(&charts, ROUGHNESS.len(), (230, 190), &path)?;
        Ok(Figure {
            title: format!("Neighbours along the {}, {} (Figure 16)", direction.name, ranked.body),
            about: "Rank of each neighbour, the nearest first; 0 is the probe's result. Roughness grows to the right, specular reflectance \
                    downwards."
                .into(),
            file,
        })
    };
    DIRECTIONS.iter().enumerate().map(figure).collect()
}

/// The blob of a source, of the probe's result and of two neighbours below (Figure 16 (e)).
fn comparison(album: &Album, probe: &Probe, draw: &Draw) -> anyhow::Result<Comparison> {
    let point = (SPECULAR[2], ROUGHNESS[2]);
    let source = source(point)?;
    let target = apply(probe, &source, true)?.target;
    let mut materials = vec![source, target.clone()];
    for id in [-1, -2] {
        materials.extend(neighbour(&target, id, &DIRECTIONS[0])?);
    }
    let images = draw(&materials.iter().collect::<Vec<_>>())?;
    let titles = ["source", "probe", "neighbour -1", "neighbour -2"];
    let mut shown: Vec<Shown> = titles
        .into_iter()
        .zip(&materials)
        .zip(images)
        .map(|((title, material), image)| Shown { title, material: material.to_string(), image })
        .collect();
    let others = shown.split_off(1);
    let title = format!("Specular reflectance {}, roughness {} (Figure 16 e)", point.0, point.1);
    album.compare("blob", title, &shown[0], &others, &Mask::uniform(BLOB, BLOB))
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

/// One of the paper's points.
fn source((specular, roughness): (f64, f64)) -> anyhow::Result<Material> {
    Ok(Material::parse(&format!("ward:specular={specular},roughness={roughness},diffuse={BODY}"))?)
}

/// A neighbour of a target in a direction, if there is one.
fn neighbour(target: &Material, id: i32, direction: &Direction) -> anyhow::Result<Option<Material>> {
    let value = target.number(direction.parameters[0])? + f64::from(id) * direction.step;
    if value < direction.least {
        return Ok(None);
    }
    let mut material = target.clone();
    // Both widths of the lobe.
    direction.parameters.iter().try_for_each(|name| material.set_number(name, value))?;
    Ok(Some(material))
}

/// The result of the probe and its neighbours in both directions, with their JOD; those below the least value are left out.
fn rankings(probe: &Probe, draw: &Draw, point: (f64, f64)) -> anyhow::Result<[Ranking; 2]> {
    let source = source(point)?;
    let target = apply(probe, &source, true)?.target;
    // The probe's result stands in both.
    let mut shown = vec![(0, 0, target.clone())];
    for (k, direction) in DIRECTIONS.iter().enumerate() {
        for id in (-REACH..=REACH).filter(|id| *id != 0) {
            shown.extend(neighbour(&target, id, direction)?.map(|material| (k, id, material)));
        }
    }
    let materials: Vec<&Material> =
        std::iter::once(&source).chain(shown.iter().map(|(_, _, material)| material)).collect();
    let images = draw(&materials)?;
    let mut rankings = [Vec::new(), Vec::new()];
    for ((k, id, _), image) in shown.iter().zip(&images[1..]) {
        let seen = (*id, jod(&images[0], image)?);
        rankings
            .iter_mut()
            .enumerate()
            .filter(|(other, _)| *id == 0 || other == k)
            .for_each(|(_, r)| r.push(seen));
    }
    rankings.iter_mut().for_each(|ranking| ranking.sort_by_key(|(id, _)| *id));
    Ok(rankings)
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
