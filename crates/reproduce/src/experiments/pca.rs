//! Section 4: pictures that are synthesised from principal components instead of rendered, by their number.

use lookmatch_imaging::Mask;
use lookmatch_plots::{Chart, Series, draw_charts};
use lookmatch_remap::{
    Endpoint, Options, PictureError, Plan, Preset, Stage, SynthesisQuality, SynthesisStudy, study_synthesis,
};

use crate::album::{Album, Shown};
use crate::tables::{bar, mean};
use crate::{Bar, Cell, Comparison, Figure, Finding, Report, Row, Setting, Table, Watch};

/// Most components that are tried.
const MOST: usize = 20;
/// Those of the tables.
const TOLD: [usize; 5] = [1, 2, 5, 10, 20];
/// The number that suffices, says the paper.
const ENOUGH: usize = 10;
/// How much worse than the best a target may be that synthesised pictures choose: less than tells two fits apart.
const EXCESS: f64 = 0.01;

/// A remap of the paper.
struct Case {
    from: &'static str,
    to: &'static str,
    /// What its pictures differ by.
    by: &'static str,
    /// Sides of the pictures, in full and quick runs.
    sizes: [usize; 2],
    /// Levels of each source axis, in full and quick runs.
    sources: [usize; 2],
}

const CASES: [Case; 2] = [
    Case { from: "as", to: "ggx-conductor", by: "roughness", sizes: [300, 128], sources: [35, 12] },
    Case { from: "ward", to: "ggx", by: "index and roughness", sizes: [128, 64], sources: [8, 4] },
];

/// A case and what was found.
type Found<'a> = (&'a Case, SynthesisStudy);

pub(super) fn run(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    let studied = |case| -> anyhow::Result<Found> { Ok((case, studied(setting, watch, case)?)) };
    let found: Vec<Found> = CASES.iter().map(studied).collect::<anyhow::Result<_>>()?;
    let album = Album::of(setting, "pca")?;
    Ok(Report {
        title: "Principal components".into(),
        about: format!(
            "Every second level of each parameter of the target is rendered in the reference scene under both lights, and the other pictures \
             are synthesised: as sums of the first principal components, with loadings that are interpolated over the parameters. Then \
             they are rendered as well, and compared. {}",
            found.iter().map(lattice).collect::<Vec<_>>().join(" ")
        ),
        findings: found.iter().flat_map(findings).collect(),
        tables: found.iter().map(table).collect(),
        comparisons: found.iter().map(|found| comparison(&album, found)).collect::<anyhow::Result<_>>()?,
        figures: vec![figure(&album, &found)?],
        notes: vec![
            "Components are made twice: of complete pictures in linear RGB, of which NRMSD is taken (the root mean square over the sphere's pixels \
             and all channels, over the range of the rendered picture), and of specular pictures in CIELAB, with which a search compares. What \
             the best match leaves is the same number between a source and the target that suits it best. Components with less than 1e-12 of the \
             variance are rounding, and are left out: errors may stay where they are from some number on."
                .into(),
            "The program itself does not stop at a number: it takes as many components as leave less than 0.01 in fitness, and renders every \
             candidate before it wins."
                .into(),
        ],
        ..Report::default()
    })
}

/// One case, from its plan on.
fn studied(setting: &Setting, watch: &dyn Watch, case: &Case) -> anyhow::Result<SynthesisStudy> {
    let [source, target] = [case.from, case.to].map(lookmatch_materials::by_name);
    let size = case.sizes[usize::from(setting.is_quick)];
    let options = Options {
        seed: setting.seed,
        mask: case.from == "ward",
        preset: Some(Preset::Paper),
        size: Some(size),
        ..Options::default()
    };
    let plan = Plan::between(Endpoint::Model(source?), Endpoint::Model(target?), &options)?;
    watch.begin(&format!("light of {} to {}", case.from, case.to), 0);
    let stage = Stage::cached(&plan, &setting.cache, &|_| ())?;
    let sources = spread(&plan, case.sources[usize::from(setting.is_quick)]);
    let targets: usize =
        plan.target_axes.iter().filter(|axis| axis.len() > 2).map(|axis| axis.len()).product();
    watch.begin(&format!("synthesising {}", case.to), targets);
    Ok(study_synthesis(&plan, &stage, &sources, MOST, &|steps| watch.advance(steps), &|| watch.is_stopped())?)
}

/// Source points at about so many levels of each axis, evenly spread.
fn spread(plan: &Plan, levels: usize) -> Vec<Vec<f64>> {
    let mut points = vec![Vec::new()];
    for axis in &plan.source_axes {
        let last = axis.len() - 1;
        let count = levels.min(axis.len());
        // The ends of an axis are of no more worth than any other level.
        let level = |k: usize| axis.value(((2 * k + 1) * last).div_ceil(2 * count).min(last));
        let longer = |point: &Vec<f64>| {
            let longer = |k: usize| point.iter().copied().chain([level(k)]).collect();
            (0..count).map(longer).collect::<Vec<Vec<f64>>>()
        };
        points = points.iter().flat_map(longer).collect();
    }
    points
}

fn name(case: &Case) -> String {
    format!("{} to {}", case.from, case.to)
}

fn lattice((case, study): &Found) -> String {
    format!(
        "{}, by {}: {} pictures rendered, {} between them.",
        name(case),
        case.by,
        study.rendered,
        study.between
    )
}

/// The mean of both lights.
fn both(error: &PictureError) -> f64 {
    mean(error.nrmsd.into_iter())
}

fn findings((case, study): &Found) -> Vec<Finding> {
    let enough = &study.qualities[ENOUGH - 1];
    let shape = "loadings between the rendered levels, not the number of components";
    let narrow = format!(
        "{}: with {MOST} components it is {:.4}, and of the rendered pictures themselves {ENOUGH} leave {:.4} in NRMSD",
        shape,
        both(&study.qualities[MOST - 1].synthesised),
        both(&enough.kept)
    );
    vec![
        bar(
            format!(
                "{}: NRMSD of synthesised pictures over that of the best matches, {ENOUGH} components",
                name(case)
            ),
            both(&enough.synthesised) / both(&study.best),
            Bar::AtMost(1.0),
            &narrow,
        ),
        bar(
            format!(
                "{}: fitness of the targets that synthesised pictures choose, above the lowest, {ENOUGH} components",
                name(case)
            ),
            enough.excess,
            Bar::AtMost(EXCESS),
            &format!("with {MOST} components it is {:.4}", study.qualities[MOST - 1].excess),
        ),
    ]
}

fn table(found: &Found) -> Table {
    let (case, study) = found;
    let row = |quality: &SynthesisQuality| Row {
        name: quality.components.to_string(),
        cells: vec![
            Cell::Number(both(&quality.kept)),
            Cell::Number(both(&quality.synthesised)),
            Cell::Number(quality.kept.fitness),
            Cell::Number(quality.synthesised.fitness),
            Cell::Text(format!("{:.0} %", 100.0 * quality.same_target)),
            Cell::Text(format!("{:.2} %", 100.0 * quality.excess)),
        ],
        is_main: quality.components == ENOUGH,
    };
    let told = TOLD.iter().filter_map(|count| study.qualities.get(count - 1));
    let left = Row {
        name: "left by the best match".into(),
        cells: vec![
            Cell::Empty,
            Cell::Number(both(&study.best)),
            Cell::Empty,
            Cell::Number(study.best.fitness),
            Cell::Empty,
            Cell::Empty,
        ],
        is_main: false,
    };
    let columns = [
        "components",
        "NRMSD, rendered ones rebuilt",
        "synthesised ones",
        "fitness, rebuilt",
        "synthesised",
        "same target",
        "excess fitness",
    ];
    Table {
        title: format!("{}, by {}", name(case), case.by),
        about: "Means over pictures and both lights. Rebuilt: rendered pictures as sums of components; synthesised: those between, from \
                interpolated loadings. To the right, what becomes of a search among synthesised pictures."
            .into(),
        columns: columns.map(str::to_owned).into(),
        rows: told.map(row).chain([left]).collect(),
    }
}

fn comparison(album: &Album, (case, study): &Found) -> anyhow::Result<Comparison> {
    let example = &study.example;
    let shown = |title, image: &lookmatch_imaging::Image| Shown {
        title,
        material: example.target.to_string(),
        image: image.clone(),
    };
    let titles: Vec<String> = example.synthesised.iter().map(|(k, _)| format!("{k} components")).collect();
    let others: Vec<Shown> =
        titles.iter().zip(&example.synthesised).map(|(title, (_, image))| shown(title, image)).collect();
    let (width, height) = (example.rendered.width(), example.rendered.height());
    let title = format!("{}: the picture that {ENOUGH} components show worst", name(case));
    let source = shown("rendered", &example.rendered);
    album.compare(case.to, title, &source, &others, &Mask::uniform(width, height))
}

fn figure(album: &Album, found: &[Found]) -> anyhow::Result<Figure> {
    let charts: Vec<Chart> = found.iter().flat_map(charts).collect();
    let (path, file) = album.figure("components.svg");
    draw_charts(&charts, 3, (340, 280), &path)?;
    Ok(Figure {
        title: "Error over the number of components".into(),
        about: "Errors as powers of ten.".into(),
        file,
    })
}

fn charts((case, study): &Found) -> [Chart; 3] {
    let over = |name: &str, value: &dyn Fn(&SynthesisQuality) -> f64| Series {
        name: name.into(),
        points: study.qualities.iter().map(|q| (q.components as f64, value(q))).collect(),
    };
    let chart = |what: &str, y: &str, series| Chart {
        title: format!("{}: {what}", name(case)),
        x: "components".into(),
        y: y.into(),
        series,
    };
    let errors = |of: fn(&PictureError) -> f64| {
        let left = of(&study.best).log10();
        vec![
            over("rebuilt", &|q| of(&q.kept).log10()),
            over("synthesised", &|q| of(&q.synthesised).log10()),
            over("left by the best match", &|_| left),
        ]
    };
    [
        chart("NRMSD", "log10 NRMSD", errors(both)),
        chart("fitness", "log10 fitness", errors(|error| error.fitness)),
        chart(
            "search",
            "percent",
            vec![
                over("same target", &|q| 100.0 * q.same_target),
                over("excess fitness", &|q| 100.0 * q.excess),
            ],
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn source_points_spread_over_all_axes() {
        let [ward, ggx] = ["ward", "ggx"].map(|name| lookmatch_materials::by_name(name).unwrap());
        let plan = Plan::new(ward, ggx, &Options::default()).unwrap();
        let points = spread(&plan, 4);
        assert_eq!(points.len(), 16);
        for (k, axis) in plan.source_axes.iter().enumerate() {
            let mut values: Vec<f64> = points.iter().map(|point| point[k]).collect();
            values.sort_by(f64::total_cmp);
            values.dedup();
            assert_eq!(values.len(), 4, "{values:?}");
            assert!(values.iter().all(|value| axis.index_of(*value).is_some()), "{values:?}");
        }
    }
}
