//! The validation scenes: spheres and meshes under real maps, none of which any search has seen.

use lookmatch_imaging::{Image, Mask, NO_DIFFERENCE, Verdict, jod, nrmsd};
use lookmatch_materials::Material;
use lookmatch_remap::{Probe, Strategy};
use lookmatch_rendering::{EnvironmentLight, Illumination, Part, Renderer, Scene};

use super::ward_to_ggx::{plan, probe_name};
use crate::album::{Album, Shown};
use crate::methods::Method;
use crate::probes::found;
use crate::tables::{bar, channel_mean, mean};
use crate::twins::{Regions, Twins};
use crate::{Bar, Cell, Comparison, Finding, Report, Row, Setting, Table, Watch};

const NAME: &str = "scenes";
const SCENES: [&str; 4] = ["spheres", "blobs", "spot", "shader-ball"];
const MAPS: [&str; 6] = ["interior", "city", "forest", "night", "studio", "sunset"];
/// Of those, what a quick run looks at.
const QUICK_SCENES: [&str; 2] = ["spheres", "spot"];
const QUICK_MAPS: [&str; 2] = ["city", "sunset"];
/// The map of the pictures that are shown.
const SHOWN_MAP: &str = "sunset";
/// What is matched, and which of them is shown.
const SOURCES: [(&str, &str); 3] = [
    ("glossy and dark", "ward:specular=0.06,roughness=0.06,diffuse=0.03/0.03/0.04"),
    ("bright", "ward:specular=0.3,roughness=0.15,diffuse=0.5/0.25/0.08"),
    ("rough", "ward:specular=0.2,roughness=0.45,diffuse=0.12/0.25/0.3"),
];
const SHOWN_SOURCE: usize = 1;

/// How near a method's picture comes to the source's.
#[derive(Clone, Copy)]
struct Nearness {
    /// Masked, mean of the channels, without noise.
    nrmsd: f64,
    jod: f64,
}

/// A scene under a map, judged.
struct Judged {
    scene: &'static str,
    map: &'static str,
    /// By source and method.
    near: Vec<Vec<Nearness>>,
}

/// A source and what all methods make of it.
struct Case {
    source: Material,
    targets: Vec<Material>,
}

/// Sides of the pictures in pixels, and paths for each of their pixels.
struct Effort {
    /// Of the noise-free renderer.
    exact: usize,
    /// Of the path tracer, twice.
    traced: (usize, u32),
    /// The same of those that are shown.
    shown: (usize, u32),
}

pub(super) fn run(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    let plan = plan(setting, Strategy::Constrained, None, "genetic")?;
    let probe = found(setting, watch, &probe_name("free"), &plan)?.probe;
    let (titles, cases) = cases(&probe)?;
    let effort = match setting.is_quick {
        true => Effort { exact: 48, traced: (48, 4), shown: (96, 4) },
        false => Effort { exact: 160, traced: (96, 16), shown: (160, 16) },
    };
    let (scenes, maps): (&[&str], &[&str]) =
        if setting.is_quick { (&QUICK_SCENES, &QUICK_MAPS) } else { (&SCENES, &MAPS) };
    watch.begin("scenes under maps", scenes.len() * maps.len());
    let mut all = Vec::new();
    for (scene, map) in scenes.iter().flat_map(|scene| maps.iter().map(move |map| (*scene, *map))) {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        let lit = lit(scene, map)?;
        let near = match lit.meshes.is_empty() {
            true => exactly(&lit, &cases, effort.exact, setting)?,
            false => traced(&lit, &cases, effort.traced, setting, watch)?,
        };
        all.push(Judged { scene, map, near });
        watch.advance(1);
    }
    watch.begin("pictures of the scenes", scenes.len());
    let album = Album::of(setting, NAME)?;
    let mut comparisons = Vec::new();
    for scene in scenes {
        comparisons.push(comparison(
            &album,
            scene,
            (&titles, &cases[SHOWN_SOURCE]),
            &effort,
            setting,
            watch,
        )?);
        watch.advance(1);
    }
    Ok(Report {
        title: "Scenes under real maps".into(),
        about: format!(
            "Three Ward plastics (glossy and dark, bright, rough) and their GGX matches with a free index, in {} scenes under {} real maps and a \
             lamp. Maps are scaled to be equally bright from above. Spheres are rendered without noise, {} pixels a side; meshes are path \
             traced, {} pixels a side, twice with {} paths for each of them, and all pictures share their seeds.",
            scenes.len(),
            maps.len(),
            effort.exact,
            effort.traced.0,
            effort.traced.1,
        ),
        findings: vec![better_than_baselines(&all, &titles)],
        tables: vec![methods_table(&all, &titles), by_source(&all, &titles), by_scene(&all, &titles)],
        comparisons,
        notes: vec![
            "Masks fall with the sine of the angle between normal and view, which is the radial mask on spheres. NRMSD of path-traced pictures is \
             a root of mean products of two differences with independent noise: noise does not add to it, but it is part of what JOD see."
                .into(),
        ],
        ..Report::default()
    })
}

/// The sources with what all methods make of them, and the methods' names.
fn cases(probe: &Probe) -> anyhow::Result<(Vec<&'static str>, Vec<Case>)> {
    let sources = SOURCES.map(|(_, source)| Material::parse(source));
    let sources: Vec<Material> = sources.into_iter().collect::<Result<_, _>>()?;
    let mut methods = vec![Method::probe("probe", probe, &sources)?];
    methods.extend(Method::baselines(probe, &sources)?);
    let case = |(k, source): (usize, &Material)| Case {
        source: source.clone(),
        targets: methods.iter().map(|method| method.targets[k].clone()).collect(),
    };
    Ok((methods.iter().map(|method| method.title).collect(), sources.iter().enumerate().map(case).collect()))
}

/// A scene under a map.
fn lit(scene: &str, map: &str) -> anyhow::Result<Scene> {
    Ok(Scene { environment: Some(EnvironmentLight::balanced(map)?), ..Scene::load(scene)? })
}

/// Without noise: spheres alone.
fn exactly(
    scene: &Scene,
    cases: &[Case],
    size: usize,
    setting: &Setting,
) -> anyhow::Result<Vec<Vec<Nearness>>> {
    let renderer = Renderer::cached(scene, Illumination::All, size, &setting.cache, &|_| ())?;
    let near = |case: &Case| {
        let source = renderer.render(&case.source, Part::Full);
        let targets = renderer.render_batch(&case.targets.iter().collect::<Vec<_>>(), Part::Full);
        let near = |target: &Image| -> anyhow::Result<Nearness> {
            let nrmsd = channel_mean(nrmsd(&source, target, Some(renderer.mask()))?);
            Ok(Nearness { nrmsd, jod: jod(&source, target)? })
        };
        targets.iter().map(near).collect()
    };
    cases.iter().map(near).collect()
}

/// By the path tracer.
fn traced(
    scene: &Scene,
    cases: &[Case],
    (size, samples): (usize, u32),
    setting: &Setting,
    watch: &dyn Watch,
) -> anyhow::Result<Vec<Vec<Nearness>>> {
    let twins = Twins::prepare(scene, size, samples, setting.seed)?;
    let (whole, weights) = (Regions { of: vec![Some(0); size * size], count: 1 }, twins.weights());
    let near = |case: &Case| {
        let source = twins.draw(std::slice::from_ref(&case.source), &|_| 0, watch)?;
        let shown = source.image(size);
        let near = |target: &Material| -> anyhow::Result<Nearness> {
            let target = twins.draw(std::slice::from_ref(target), &|_| 0, watch)?;
            let nrmsd = source.nrmsd(&target, &whole, Some(&weights))[0];
            Ok(Nearness { nrmsd, jod: jod(&shown, &target.image(size))? })
        };
        case.targets.iter().map(near).collect()
    };
    cases.iter().map(near).collect()
}

/// Pictures of one source in a scene.
fn comparison(
    album: &Album,
    name: &str,
    (titles, case): (&[&'static str], &Case),
    effort: &Effort,
    setting: &Setting,
    watch: &dyn Watch,
) -> anyhow::Result<Comparison> {
    let scene = lit(name, SHOWN_MAP)?;
    let materials: Vec<&Material> = std::iter::once(&case.source).chain(&case.targets).collect();
    let images: Vec<Image> = if scene.meshes.is_empty() {
        let renderer = Renderer::cached(&scene, Illumination::All, effort.exact, &setting.cache, &|_| ())?;
        renderer.render_batch(&materials, Part::Full)
    } else {
        let (size, samples) = effort.shown;
        let twins = Twins::prepare(&scene, size, samples, setting.seed)?;
        let image = |material: &&Material| -> anyhow::Result<Image> {
            Ok(twins.draw(std::slice::from_ref(*material), &|_| 0, watch)?.image(size))
        };
        materials.iter().map(image).collect::<anyhow::Result<_>>()?
    };
    let size = images[0].width();
    let titles = std::iter::once("source").chain(titles.iter().copied());
    let mut shown: Vec<Shown> = titles
        .zip(materials)
        .zip(images)
        .map(|((title, material), image)| Shown { title, material: material.to_string(), image })
        .collect();
    let others = shown.split_off(1);
    let title = format!("{name} under the map {SHOWN_MAP}, {}", SOURCES[SHOWN_SOURCE].0);
    album.compare(name, title, &shown[0], &others, &Mask::uniform(size, size))
}

/// Over some of what was judged: the mean of a number of a method.
fn over<'a>(
    all: impl Iterator<Item = &'a Judged>,
    sources: &[usize],
    method: usize,
    number: fn(&Nearness) -> f64,
) -> f64 {
    mean(all.flat_map(|judged| sources.iter().map(move |k| number(&judged.near[*k][method]))))
}

const EVERY: [usize; SOURCES.len()] = [0, 1, 2];

/// The lowest mean of the baselines.
fn better_baseline<'a>(
    all: impl Iterator<Item = &'a Judged> + Clone,
    sources: &[usize],
    titles: &[&str],
) -> f64 {
    let means = (1..titles.len()).map(|method| over(all.clone(), sources, method, |near| near.nrmsd));
    means.fold(f64::INFINITY, f64::min)
}

fn better_than_baselines(all: &[Judged], titles: &[&str]) -> Finding {
    let ratio = |judged: &[&Judged], sources: &[usize]| {
        let probe = over(judged.iter().copied(), sources, 0, |near| near.nrmsd);
        probe / better_baseline(judged.iter().copied(), sources, titles)
    };
    let judged: Vec<&Judged> = all.iter().collect();
    let of = |(k, (name, _)): (usize, &(&str, &str))| format!("{name} {:.2}", ratio(&judged, &[k]));
    let cause = format!(
        "by material, the ratio is: {}",
        SOURCES.iter().enumerate().map(of).collect::<Vec<_>>().join(", ")
    );
    let name = "mean masked NRMSD over that of the better baseline, all scenes and maps";
    bar(name.into(), ratio(&judged, &EVERY), Bar::AtMost(0.8), &cause)
}

fn methods_table(all: &[Judged], titles: &[&'static str]) -> Table {
    let row = |(method, title): (usize, &&str)| {
        let jods = all.iter().flat_map(|judged| judged.near.iter().map(move |near| near[method].jod));
        let count = |verdict: Verdict| {
            Cell::Text(jods.clone().filter(|jod| Verdict::of(*jod) == verdict).count().to_string())
        };
        let numbers = [
            over(all.iter(), &EVERY, method, |near| near.nrmsd),
            over(all.iter(), &EVERY, method, |near| NO_DIFFERENCE - near.jod),
        ];
        let cells = numbers.map(Cell::Number).into_iter().chain(Verdict::ALL.map(count)).collect();
        Row { name: (*title).into(), cells, is_main: method == 0 }
    };
    let columns = ["", "masked NRMSD", "JOD below 10"].into_iter().chain(Verdict::ALL.map(Verdict::title));
    Table {
        title: "Over all scenes, maps and materials".into(),
        about: "Means, and at how many of them people would say what.".into(),
        columns: columns.map(str::to_owned).collect(),
        rows: titles.iter().enumerate().map(row).collect(),
    }
}

fn by_source(all: &[Judged], titles: &[&str]) -> Table {
    let row = |(k, (name, material)): (usize, &(&str, &str))| {
        let probe = over(all.iter(), &[k], 0, |near| near.nrmsd);
        let baseline = better_baseline(all.iter(), &[k], titles);
        let jod = over(all.iter(), &[k], 0, |near| near.jod);
        let cells = std::iter::once(Cell::Text((*material).into()))
            .chain([probe, baseline, probe / baseline, jod].map(Cell::Number));
        Row { name: (*name).into(), cells: cells.collect(), is_main: false }
    };
    Table {
        title: "By material".into(),
        about: "Masked NRMSD, mean over scenes and maps.".into(),
        columns: ["", "material", "probe", "better baseline", "ratio", "mean JOD of the probe"]
            .map(str::to_owned)
            .into(),
        rows: SOURCES.iter().enumerate().map(row).collect(),
    }
}

/// A row for each scene under each map, and their means.
fn by_scene(all: &[Judged], titles: &[&str]) -> Table {
    let row = |name: String, some: &[&Judged], is_main: bool| {
        let some = some.iter().copied();
        let probe = over(some.clone(), &EVERY, 0, |near| near.nrmsd);
        let baseline = better_baseline(some.clone(), &EVERY, titles);
        let jods = some.flat_map(|judged| judged.near.iter().map(|near| near[0].jod));
        let least = jods.clone().fold(NO_DIFFERENCE, f64::min);
        let mut cells: Vec<Cell> =
            [probe, baseline, probe / baseline, mean(jods), least].map(Cell::Number).into();
        cells.push(Cell::Text(Verdict::of(least).title().into()));
        Row { name, cells, is_main }
    };
    let mut rows = Vec::new();
    for group in all.chunk_by(|a, b| a.scene == b.scene) {
        let lines =
            group.iter().map(|judged| row(format!("{}, {}", judged.scene, judged.map), &[judged], false));
        rows.extend(lines);
        let whole: Vec<&Judged> = group.iter().collect();
        rows.push(row(format!("{}, mean", group[0].scene), &whole, true));
    }
    Table {
        title: "By scene and map".into(),
        about: "Masked NRMSD, mean over the three materials; JOD of the probe, their mean and the lowest, with its verdict.".into(),
        columns: ["", "probe", "better baseline", "ratio", "mean JOD", "lowest JOD", "verdict"]
            .map(str::to_owned)
            .into(),
        rows,
    }
}
