//! Section 5.2, Figure 10: a plastic whose roughness comes from a map. The map is converted through the probe as users do it, and each texel
//! wears what its code becomes.

mod maps;

use lookmatch_imaging::{Image, Mask};
use lookmatch_materials::Material;
use lookmatch_plots::{Chart, Series, draw_charts};
use lookmatch_remap::Strategy;
use lookmatch_rendering::{EnvironmentLight, Scene, Spot};

use self::maps::{Codes, Converted};
use super::ward_to_ggx::{plan, probe_name};
use crate::album::{Album, Shown};
use crate::methods::Method;
use crate::nearest::{Reach, Values};
use crate::probes::found;
use crate::tables::{bar, mean};
use crate::twins::{Pair, Regions, Twins};
use crate::{Bar, Cell, Figure, Finding, Picture, Report, Row, Setting, Table, Watch};

const NAME: &str = "svbrdf";
/// The source without its map: dark, as onyx is.
const SOURCE: &str = "ward:specular=0.15,diffuse=0.04/0.03/0.03";
/// A map that no search has seen.
const LIGHT: &str = "city";
/// Times that the texture goes around the sphere: it is as wide as high there.
const AROUND: f64 = 2.0;
/// Parts of the surface, from smooth to rough, that best targets are sought for.
const BANDS: usize = 8;
/// How far they may be from the probe's: the ratio of the index less 1, plus 1, and that of the roughness.
const LIMITS: [[f64; 2]; 2] = [[1.0 + 1.0 / 3.0, 1.0 + 3.0], [1.0 / 3.0, 3.0]];
/// The values of the probe as such ratios.
const PROBE: Values = [2.0, 1.0];

/// The sphere with its map and what was rendered of it.
struct Ball<'a> {
    twins: Twins,
    map: &'a Codes,
    bands: &'a Bands,
    regions: Regions,
    weights: Vec<f32>,
    source: Pair,
    watch: &'a dyn Watch,
}

/// Levels of the map, put together such that each band covers about as much of what is seen.
struct Bands {
    /// For each level its band.
    of: Vec<usize>,
}

/// A method's picture and what it says.
struct Judged {
    title: &'static str,
    picture: Pair,
    /// Masked NRMSD of the sphere, and of each band.
    whole: f64,
    bands: Vec<f64>,
}

pub(super) fn run(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    let plan = plan(setting, Strategy::Constrained, None, "genetic")?;
    let probe = found(setting, watch, &probe_name("free"), &plan)?.probe;
    let map = Codes::shipped()?;
    let base = Material::parse(SOURCE)?;
    let sources = sources(&map, &base)?;
    let converted = map.convert(&probe, &base, &setting.folder.join("maps").join(NAME))?;
    let mut methods =
        vec![through_maps(&map, &converted, Method::probe("probe, converted maps", &probe, &sources)?)?];
    methods.extend(Method::baselines(&probe, &sources)?);

    let (size, samples) = if setting.is_quick { (96, 8) } else { (240, 32) };
    let bands = Bands::of(&map)?;
    watch.begin("the sphere", methods.len());
    let ball =
        Ball::prepare(&map, &bands, &sources, Size { size, samples, one_of: None }, setting.seed, watch)?;
    let mut judged = Vec::new();
    for method in &methods {
        judged.push(ball.judge(method.title, &method.targets)?);
    }
    let ratios = best(setting, watch, &map, &bands, &sources, &methods)?;
    let best = ball.judge("best possible", &bands.adjusted(&methods[0], &ratios)?)?;
    let widths: Vec<Values> = ratios.iter().map(|[_, roughness]| [PROBE[0], *roughness]).collect();
    let widths = ball.judge("", &bands.adjusted(&methods[0], &widths)?)?;
    // The search looks at other pixels: where another target is better in all of them, that is the best that is known.
    let all = || judged.iter().chain([&best, &widths]);
    let least: Vec<f64> =
        (0..BANDS).map(|band| all().map(|j| j.bands[band]).fold(f64::INFINITY, f64::min)).collect();

    let album = Album::of(setting, NAME)?;
    let shown = |title, picture: &Pair| Shown { title, material: String::new(), image: picture.image(size) };
    let mut others: Vec<Shown> = judged.iter().map(|judged| shown(judged.title, &judged.picture)).collect();
    others.push(shown(best.title, &best.picture));
    let whole = Mask::uniform(size, size);
    let title = "A sphere of onyx (Figure 10)".to_owned();
    let comparison = album.compare("sphere", title, &shown("source", &ball.source), &others, &whole)?;
    Ok(Report {
        title: "A map of roughness".into(),
        about: format!(
            "A Ward plastic ({SOURCE}) whose roughness, {:.2} to {:.2}, is a map of {} x {} texels with {} levels of 8 bits. The map becomes maps of \
             the index and of the roughness through the probe with the free index, by the same code as `lookmatch apply --texture`; each level \
             is then a material of its own. A sphere on a checkerboard under the map '{LIGHT}' and a lamp, path traced, {size} pixels a side, \
             twice with {samples} paths for each of them.",
            Codes::roughness(map.levels[0]),
            Codes::roughness(map.levels[map.levels.len() - 1]),
            map.width,
            map.height,
            map.levels.len(),
        ),
        findings: vec![gap_bar(
            &methods[0],
            &ratios,
            [&judged[0].bands, &widths.bands, &least],
            &comparison.others,
        )?],
        tables: vec![methods_table(&judged, &best, &least), bands_table(&map, &bands, &judged, &least)],
        comparisons: vec![comparison],
        figures: vec![
            maps_figure(&album, &map, &converted)?,
            curves(&album, &map, &bands, &methods[0], &ratios)?,
        ],
        notes: vec![format!(
            "Noise of the pictures (means of both): NRMSD {:.4}. It does not add to the numbers of the tables, which are roots of mean products \
             of two differences with independent noise; it is part of the NRMSD below the pictures.",
            ball.source.noise()
        )],
        ..Report::default()
    })
}

/// The bar of the gap, with what the widths alone do for it.
fn gap_bar(
    probe: &Method,
    ratios: &[Values],
    errors: [&[f64]; 3],
    pictures: &[Picture],
) -> anyhow::Result<Finding> {
    let [own, widths, least] = errors.map(average);
    let smoothest = probe.values()?[0][1];
    let jod = |picture: Option<&Picture>| picture.and_then(|picture| picture.jod).unwrap_or(f64::NAN);
    let cause = format!(
        "it is the roughness: with the probe's index and the best roughness of each band, the ratio is {:.2}; in the smoothest band, the probe \
         has a roughness of {smoothest:.3} and the best is {:.3}; the search minimises distances in CIELAB instead of NRMSD, and to the eye the \
         targets with the least NRMSD are at {:.2} JOD, the probe's at {:.2}",
        widths / least,
        smoothest * ratios[0][1],
        jod(pictures.last()),
        jod(pictures.first()),
    );
    let name = "mean masked NRMSD of the bands of roughness over that of the best targets";
    Ok(bar(name.into(), own / least, Bar::AtMost(1.10), &cause))
}

/// The source with the roughness of each level.
fn sources(map: &Codes, base: &Material) -> anyhow::Result<Vec<Material>> {
    let source = |level: &u8| {
        let mut source = base.clone();
        source.set_number("roughness", Codes::roughness(*level))?;
        Ok(source)
    };
    map.levels.iter().map(source).collect()
}

/// A method's targets with the values of the converted maps.
fn through_maps(map: &Codes, converted: &Converted, method: Method) -> anyhow::Result<Method> {
    let (index, roughness) = (map.by_level(&converted.index), map.by_level(&converted.roughness));
    let values: Vec<Values> =
        index.into_iter().zip(roughness).map(|(index, roughness)| [index, roughness]).collect();
    Ok(Method { targets: method.with_values(&values)?, ..method })
}

/// The level of the map at a point of the sphere.
fn level(map: &Codes, spot: Spot) -> usize {
    let [u, v] = spot.texture;
    map.level([(AROUND * u).fract(), v])
}

fn scene() -> anyhow::Result<Scene> {
    Ok(Scene { environment: Some(EnvironmentLight::balanced(LIGHT)?), ..Scene::reference() })
}

/// How pictures are rendered.
struct Size {
    size: usize,
    samples: u32,
    /// Where not all pixels are needed: one of how many of the sphere's.
    one_of: Option<usize>,
}

impl<'a> Ball<'a> {
    fn prepare(
        map: &'a Codes,
        bands: &'a Bands,
        sources: &[Material],
        Size { size, samples, one_of }: Size,
        seed: u64,
        watch: &'a dyn Watch,
    ) -> anyhow::Result<Self> {
        let twins = Twins::prepare(&scene()?, size, samples, seed)?;
        let twins = match one_of {
            Some(one_of) => twins.some_of_subjects(one_of),
            None => twins,
        };
        let regions = twins.regions(BANDS, |spot| Some(bands.of[level(map, spot)]));
        let weights = twins.weights();
        let source = twins.draw(sources, &|spot| level(map, spot), watch)?;
        Ok(Self { twins, map, bands, regions, weights, source, watch })
    }

    fn judge(&self, title: &'static str, targets: &[Material]) -> anyhow::Result<Judged> {
        let picture = self.twins.draw(targets, &|spot| level(self.map, spot), self.watch)?;
        self.watch.advance(1);
        let all = Regions { of: vec![Some(0); self.regions.of.len()], count: 1 };
        let nrmsd = |regions| self.source.nrmsd(&picture, regions, Some(&self.weights));
        let (whole, bands) = (nrmsd(&all)[0], nrmsd(&self.regions));
        Ok(Judged { title, picture, whole, bands })
    }
}

impl Bands {
    fn of(map: &Codes) -> anyhow::Result<Self> {
        let twins = Twins::prepare(&scene()?, 96, 1, 1)?.some_of_subjects(1);
        let seen = twins.regions(map.levels.len(), |spot| Some(level(map, spot)));
        let mut counts = vec![0usize; map.levels.len()];
        seen.of.iter().flatten().for_each(|level| counts[*level] += 1);
        let total: usize = counts.iter().sum();
        let mut below = 0;
        let band = |count: &usize| {
            below += count;
            // By the middle of what the level covers.
            ((2 * below - count) * BANDS / (2 * total).max(1)).min(BANDS - 1)
        };
        Ok(Self { of: counts.iter().map(band).collect() })
    }

    /// A method's targets, in each band by ratios as those of [`LIMITS`].
    fn adjusted(&self, method: &Method, ratios: &[Values]) -> anyhow::Result<Vec<Material>> {
        let values = method.values()?;
        let adjusted = values.iter().zip(&self.of).map(|([index, roughness], band)| {
            let [of_index, of_roughness] = ratios[*band];
            [1.0 + (index - 1.0) * (of_index - 1.0), (roughness * of_roughness).min(1.0)]
        });
        method.with_values(&adjusted.collect::<Vec<_>>())
    }

    /// The mean ratios of each band, as those of [`LIMITS`], from one method's values to another's.
    fn ratios(&self, from: &Method, to: &Method) -> anyhow::Result<Vec<Values>> {
        let (from, to) = (from.values()?, to.values()?);
        let ratio = |level: usize, k: usize| match k {
            0 => 1.0 + (to[level][0] - 1.0) / (from[level][0] - 1.0),
            _ => to[level][1] / from[level][1],
        };
        let of = |band: usize, k: usize| {
            mean((0..self.of.len()).filter(|level| self.of[*level] == band).map(|level| ratio(level, k)))
        };
        Ok((0..BANDS).map(|band| [of(band, 0), of(band, 1)]).collect())
    }

    /// The levels of a band.
    fn levels<'a>(&'a self, map: &'a Codes, band: usize) -> impl Iterator<Item = u8> + 'a {
        let all = map.levels.iter().zip(&self.of);
        all.filter(move |(_, of)| **of == band).map(|(level, _)| *level)
    }
}

/// The ratios to the probe's values that suit each band best, sought on some pixels of the same sphere with noise of their own.
fn best(
    setting: &Setting,
    watch: &dyn Watch,
    map: &Codes,
    bands: &Bands,
    sources: &[Material],
    methods: &[Method],
) -> anyhow::Result<Vec<Values>> {
    let (size, one_of, samples, levels, rounds) =
        if setting.is_quick { (96, 2, 8, 4, 6) } else { (240, 8, 32, 5, 10) };
    let reach = Reach { limits: LIMITS, levels, rounds };
    let (probe, copy) = (&methods[0], &methods[1]);
    let guesses = [vec![PROBE; BANDS], bands.ratios(probe, copy)?];
    watch.begin("the best targets of all bands", reach.pictures(guesses.len()));
    let size = Size { size, samples, one_of: Some(one_of) };
    let ball = Ball::prepare(map, bands, sources, size, setting.seed.wrapping_add(1), watch)?;
    reach.search(&guesses, watch, &mut |ratios| {
        Ok(ball.judge("", &ball.bands.adjusted(probe, ratios)?)?.bands)
    })
}

fn average(values: &[f64]) -> f64 {
    mean(values.iter().copied())
}

fn methods_table(judged: &[Judged], best: &Judged, least: &[f64]) -> Table {
    let row = |title: &str, whole: f64, bands: &[f64]| Row {
        name: title.into(),
        cells: [whole, average(bands), average(bands) / average(least)].map(Cell::Number).into(),
        is_main: title.starts_with("probe"),
    };
    let mut rows: Vec<Row> =
        judged.iter().map(|judged| row(judged.title, judged.whole, &judged.bands)).collect();
    rows.push(row(best.title, best.whole, least));
    Table {
        title: "The sphere".into(),
        about: format!(
            "Masked NRMSD of the whole picture, and of {BANDS} bands of roughness of about the same size. The best target of each band is the \
             probe's with another index and roughness, by a ratio for each that is sought on some pixels of the same \
             sphere with other noise; where a baseline is better, it is that."
        ),
        columns: ["", "whole", "mean of bands", "over the best"].map(str::to_owned).into(),
        rows,
    }
}

fn bands_table(map: &Codes, bands: &Bands, judged: &[Judged], least: &[f64]) -> Table {
    let row = |band: usize| {
        let roughness = |level: Option<u8>| level.map_or(0.0, Codes::roughness);
        let ends = [bands.levels(map, band).min(), bands.levels(map, band).max()].map(roughness);
        let numbers = judged.iter().map(|judged| judged.bands[band]).chain([least[band]]);
        Row {
            name: format!("roughness {:.3} to {:.3}", ends[0], ends[1]),
            cells: numbers.map(Cell::Number).collect(),
            is_main: false,
        }
    };
    let titles = std::iter::once("").chain(judged.iter().map(|judged| judged.title)).chain(["best possible"]);
    Table {
        title: "Masked NRMSD by roughness".into(),
        about: String::new(),
        columns: titles.map(str::to_owned).collect(),
        rows: (0..BANDS).filter(|band| bands.levels(map, *band).next().is_some()).map(row).collect(),
    }
}

/// The source's map beside those that it became.
fn maps_figure(album: &Album, map: &Codes, converted: &Converted) -> anyhow::Result<Figure> {
    let indices = || converted.index.iter().copied();
    let (least, largest) = (indices().fold(f32::MAX, f32::min), indices().fold(0.0, f32::max));
    let grey =
        |numbers: Vec<f32>| Image::from_fn(map.width, map.height, |x, y| [numbers[y * map.width + x]; 3]);
    let index = indices().map(|index| (index - least) / (largest - least).max(f32::EPSILON)).collect();
    let images = [grey(map.numbers()), grey(converted.roughness.clone()), grey(index)];
    let (path, file) = album.figure("maps.png");
    lookmatch_imaging::write(&path, &Image::beside(&images.each_ref()), &[])?;
    Ok(Figure {
        title: "The map, and what it becomes".into(),
        about: format!(
            "Roughness of the source, roughness of the target, index of the target (black for {least:.2}, white for {largest:.2})."
        ),
        file,
    })
}

/// What the levels of the map become, by the probe and by the best of each band.
fn curves(
    album: &Album,
    map: &Codes,
    bands: &Bands,
    probe: &Method,
    ratios: &[Values],
) -> anyhow::Result<Figure> {
    let best = Method { title: "", targets: bands.adjusted(probe, ratios)? };
    let methods = [("probe", probe.values()?), ("best possible", best.values()?)];
    let chart = |k: usize, name: &str| Chart {
        title: name.into(),
        x: "roughness of the source".into(),
        y: name.into(),
        series: methods
            .iter()
            .map(|(title, values)| Series {
                name: (*title).into(),
                points: map.levels.iter().zip(values).map(|(l, v)| (Codes::roughness(*l), v[k])).collect(),
            })
            .collect(),
    };
    let (path, file) = album.figure("curves.svg");
    draw_charts(
        &[chart(1, "roughness of the target"), chart(0, "index of the target")],
        2,
        (430, 330),
        &path,
    )?;
    Ok(Figure {
        title: "What the levels become".into(),
        about: "The best of each band is the probe's curve with a ratio of its own.".into(),
        file,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_about_as_much_each_and_grow_with_roughness() {
        let map = Codes::shipped().unwrap();
        let bands = Bands::of(&map).unwrap();
        assert!(bands.of.is_sorted());
        for band in 1..BANDS {
            assert!(bands.levels(&map, band).next().is_some(), "{band}: {:?}", bands.of);
        }
        let method = Method {
            title: "",
            targets: vec![Material::parse("ggx:ior=1.6,roughness=0.2").unwrap(); map.levels.len()],
        };
        let same = bands.adjusted(&method, &[PROBE; BANDS]).unwrap();
        assert!((same[0].number("ior").unwrap() - 1.6).abs() < 1e-12);
        assert_eq!(same[0].number("roughness").unwrap(), 0.2);
    }

    #[test]
    fn converted_maps_say_what_the_probe_says() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../textures/src/ward-ggx.json");
        let probe = lookmatch_remap::Probe::read(std::path::Path::new(file)).unwrap();
        let (map, base) = (Codes::shipped().unwrap(), Material::parse(SOURCE).unwrap());
        let folder = tempfile::tempdir().unwrap();
        let converted = map.convert(&probe, &base, folder.path()).unwrap();
        let sources = sources(&map, &base).unwrap();
        let method = Method::probe("", &probe, &sources).unwrap();
        let expected = method.values().unwrap();
        let found = through_maps(&map, &converted, method).unwrap().values().unwrap();
        for (found, expected) in found.iter().zip(&expected) {
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-4), "{found:?} {expected:?}");
        }
    }
}
