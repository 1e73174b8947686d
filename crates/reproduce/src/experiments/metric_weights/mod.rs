//! Section 4: the weights of Eq. 3, such that it agrees with the gradient similarity of the pictures.

mod benchmark;
mod outcome;
mod run_time;

use lookmatch_imaging::FitnessWeights;
use lookmatch_plots::{Chart, Series, draw_charts};
use lookmatch_remap::Statistics;
use lookmatch_search::{Axis, Bounds, Lattice, ObjectiveFn, Point, Problem, by_name};

use crate::album::Album;
use crate::tables::bar;
use crate::{Bar, Cell, Figure, Finding, Report, Row, Setting, Table, Watch};
use benchmark::{Benchmark, Item, Light, Pair, correlations, mean_correlation};

const NAME: &str = "metric-weights";
/// Mean and largest distance correlation over the paper's benchmark.
const PAPER: [f64; 2] = [0.783, 0.943];
/// Distance of the weights that are tried.
const STEP: f64 = 0.025;
/// The paper's w_D, α and γ.
const PAPER_WEIGHTS: [f64; 3] = [0.25, 0.025, 0.025];
/// The three numbers that make all weights.
const NAMES: [&str; 3] = ["w_D", "α", "γ"];

pub(super) fn run(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    let benchmark = Benchmark::prepare(setting, watch)?;
    let pairs = benchmark.pairs(watch, true)?;
    let carried = benchmark.pairs(watch, false)?;
    let all: Vec<&Item> = pairs.iter().flat_map(|pair| &pair.items).collect();
    let targets = all.iter().map(|item| item.targets()).sum::<usize>() / all.len().max(1);

    watch.begin("searching weights", 2);
    let ours = best(&all, setting.seed)?;
    watch.advance(1);
    let [even, odd] = [0, 1].map(|k| all.iter().copied().skip(k).step_by(2).collect::<Vec<_>>());
    let half = best(&even, setting.seed)?;
    watch.advance(1);
    let unseen = mean_correlation(&odd, &weights(&half))?;

    let over_all = |numbers: &[f64; 3], light| -> anyhow::Result<Statistics> {
        Ok(Statistics::of(correlations(&all, &weights(numbers), light)?.into_iter()))
    };
    let [paper_found, our_found] = [over_all(&PAPER_WEIGHTS, Light::Both)?, over_all(&ours, Light::Both)?];
    let outcome = outcome::outcome(setting, watch, &weights(&ours))?;
    watch.begin("run time", 0);
    let run_time = run_time::table()?;
    let album = Album::of(setting, NAME)?;
    Ok(Report {
        title: "The weights of Eq. 3".into(),
        about: format!(
            "The distance correlation (Székely et al. 2007) of Eq. 3 and the gradient similarity GSM (Liu et al. 2012), over pairs of \
             renderings of the reference scene, {} pixels a side: {} sources of {} pairs of models, each beside {targets} targets that fill \
             the target's lattice evenly; the bodies of plastics vary by half to both sides, since weights of diffuse pictures could not be \
             told otherwise. GSM is taken of the complete pictures as a screen shows them, and its mean over both lights.",
            setting.size(),
            all.len(),
            pairs.len(),
        ),
        findings: findings(&paper_found, &our_found, unseen, &cause(&pairs, &carried)?),
        tables: vec![
            summary(&[("the paper's", PAPER_WEIGHTS, paper_found), ("ours", ours, our_found)]),
            by_pair(&pairs, &carried, &ours)?,
            by_light(&all, &ours)?,
            halves(&even, &odd, &half, &ours)?,
            outcome.table,
            run_time,
        ],
        comparisons: outcome.comparisons,
        figures: vec![figure(&album, &all, &ours)?],
        notes: vec![
            "The paper does not publish its benchmark. \"An average of 0.783, and up to 0.943 over the benchmark\" is read as one distance \
             correlation for each source over its targets, and then the mean and the largest of them."
                .into(),
            "What is searched in a remap does not change the diffuse picture of its targets, whose bodies are carried over from the source: \
             of the three numbers only γ has a part in its outcome, and w_D through what the fitness of a match says."
                .into(),
        ],
        ..Report::default()
    })
}

/// All weights of three numbers.
fn weights([diffuse, diffuse_point, specular_point]: &[f64; 3]) -> FitnessWeights {
    FitnessWeights::of(*diffuse, *diffuse_point, *specular_point)
}

/// The numbers with the highest mean correlation.
fn best(items: &[&Item], seed: u64) -> anyhow::Result<[f64; 3]> {
    let axes = NAMES.map(|name| Axis::regular(name, 0.0, 1.0, STEP));
    let lattice = Lattice { axes: axes.into_iter().collect::<Result<_, _>>()? };
    let numbers = |point: &Point| std::array::from_fn(|k| lattice.axes[k].value(point[k] as usize));
    let guesses = vec![lattice.nearest(&PAPER_WEIGHTS)];
    let problem = Problem { lattice: &lattice, bounds: Bounds::full(&lattice), guesses, seed };
    let mut objective = ObjectiveFn(|point: &Point| {
        // What cannot be correlated is no good.
        1.0 - mean_correlation(items, &weights(&numbers(point))).unwrap_or(0.0)
    });
    Ok(numbers(&by_name("cma-es")?.run(&problem, &mut objective)?.best))
}

/// Why bars may be missed: how much of the correlation the bodies of the benchmark take.
fn cause(pairs: &[Pair], carried: &[Pair]) -> anyhow::Result<String> {
    let varies = |pair: &&Pair| carried.iter().any(|other| other.name == pair.name);
    let metals = pairs.iter().filter(|pair| !varies(pair));
    let items: Vec<&Item> = metals.chain(carried).flat_map(|pair| &pair.items).collect();
    Ok(format!(
        "the paper's benchmark is not published; in ours it is the bodies of plastics, which differ: with the source's body on all targets, \
         the paper's weights have a mean of {:.3}",
        mean_correlation(&items, &weights(&PAPER_WEIGHTS))?
    ))
}

fn findings(paper: &Statistics, ours: &Statistics, unseen: f64, cause: &str) -> Vec<Finding> {
    let of = |name: &str, value: f64, least: f64| bar(name.into(), value, Bar::AtLeast(least), cause);
    vec![
        of("mean distance correlation, the paper's weights", paper.mean, PAPER[0]),
        of("largest distance correlation, the paper's weights", paper.max, PAPER[1]),
        of("mean distance correlation, our weights", ours.mean, PAPER[0]),
        of("largest distance correlation, our weights", ours.max, PAPER[1]),
        of("mean distance correlation on sources that our weights were not found on", unseen, PAPER[0]),
    ]
}

/// A number of the paper's beside ours, where more is better.
fn beside(value: f64, paper: f64) -> Cell {
    Cell::Text(format!("{value:.3} ({:+.0} % of {paper})", 100.0 * (value / paper - 1.0)))
}

fn summary(found: &[(&str, [f64; 3], Statistics)]) -> Table {
    let row = |(name, numbers, found): &(&str, [f64; 3], Statistics)| Row {
        name: (*name).into(),
        cells: numbers
            .iter()
            .map(|number| Cell::Text(format!("{number:.3}")))
            .chain([beside(found.mean, PAPER[0]), beside(found.max, PAPER[1])])
            .chain([found.min, found.sd].map(Cell::Number))
            .collect(),
        is_main: *name == "ours",
    };
    Table {
        title: "Distance correlation of Eq. 3 and GSM".into(),
        about: "Over all sources of the benchmark; w_S = 1 - w_D, β = 1 - α, δ = 1 - γ. In brackets, how far it is from the paper's figure for \
                its own benchmark."
            .into(),
        columns: ["weights", "w_D", "α", "γ", "mean", "largest", "least", "σ"].map(str::to_owned).into(),
        rows: found.iter().map(row).collect(),
    }
}

/// The means of each pair, and of plastics whose bodies are carried over.
fn by_pair(pairs: &[Pair], carried: &[Pair], ours: &[f64; 3]) -> anyhow::Result<Table> {
    let row = |pair: &Pair, what: &str| -> anyhow::Result<Row> {
        let items: Vec<&Item> = pair.items.iter().collect();
        let own = |numbers: &[f64; 3]| correlations(&items, &weights(numbers), Light::Both);
        let mut cells = vec![Cell::Text(items.len().to_string())];
        for numbers in [&PAPER_WEIGHTS, ours] {
            let found = Statistics::of(own(numbers)?.into_iter());
            cells.extend([found.mean, found.max].map(Cell::Number));
        }
        Ok(Row { name: format!("{}{what}", pair.name), cells, is_main: false })
    };
    let mut rows = pairs.iter().map(|pair| row(pair, "")).collect::<anyhow::Result<Vec<_>>>()?;
    for pair in carried {
        rows.push(row(pair, ", bodies carried over")?);
    }
    Ok(Table {
        title: "By pair of models".into(),
        about: "Below, the same plastics with targets that have the source's body, as a search compares them; they are not part of the \
                benchmark."
            .into(),
        columns: ["pair", "sources", "paper's weights, mean", "largest", "our weights, mean", "largest"]
            .map(str::to_owned)
            .into(),
        rows,
    })
}

/// What becomes of the correlation with GSM of other pictures.
fn by_light(items: &[&Item], ours: &[f64; 3]) -> anyhow::Result<Table> {
    let lights =
        [("mean of both", Light::Both), ("point light", Light::Point), ("environment", Light::Environment)];
    let row = |(name, light): (&str, Light)| -> anyhow::Result<Row> {
        let mut cells = Vec::new();
        for numbers in [&PAPER_WEIGHTS, ours] {
            let found = Statistics::of(correlations(items, &weights(numbers), light)?.into_iter());
            cells.extend([found.mean, found.max].map(Cell::Number));
        }
        Ok(Row { name: name.into(), cells, is_main: light == Light::Both })
    };
    Ok(Table {
        title: "By what GSM sees".into(),
        about: "The paper does not say under which light the pictures were that GSM compared.".into(),
        columns: ["GSM of", "paper's weights, mean", "largest", "our weights, mean", "largest"]
            .map(str::to_owned)
            .into(),
        rows: lights.into_iter().map(row).collect::<anyhow::Result<_>>()?,
    })
}

/// Whether weights that were found on some sources suit others.
fn halves(even: &[&Item], odd: &[&Item], half: &[f64; 3], ours: &[f64; 3]) -> anyhow::Result<Table> {
    let row = |name: &str, numbers: &[f64; 3]| -> anyhow::Result<Row> {
        let weights = weights(numbers);
        let shown = numbers.iter().map(|number| Cell::Text(format!("{number:.3}")));
        let found = [mean_correlation(even, &weights)?, mean_correlation(odd, &weights)?];
        let cells = shown.chain(found.map(Cell::Number)).collect();
        Ok(Row { name: name.into(), cells, is_main: false })
    };
    Ok(Table {
        title: "On sources that the weights were not found on".into(),
        about: "Weights found on every second source of the benchmark; mean distance correlation there and on the others.".into(),
        columns: ["weights", "w_D", "α", "γ", "where they were found", "elsewhere"].map(str::to_owned).into(),
        rows: vec![
            row("found on every second", half)?,
            row("found on all", ours)?,
            row("the paper's", &PAPER_WEIGHTS)?,
        ],
    })
}

/// The correlation over each of the three numbers, the other two being the paper's or ours.
fn figure(album: &Album, items: &[&Item], ours: &[f64; 3]) -> anyhow::Result<Figure> {
    // With 1 there is no term left that metals have.
    let levels: Vec<f64> = (0..40).map(|k| f64::from(k) * STEP).collect();
    let over = |axis: usize, name: &str, numbers: &[f64; 3]| -> anyhow::Result<Series> {
        let at = |level: &f64| -> anyhow::Result<(f64, f64)> {
            let mut numbers = *numbers;
            numbers[axis] = *level;
            Ok((*level, mean_correlation(items, &weights(&numbers))?))
        };
        Ok(Series { name: name.into(), points: levels.iter().map(at).collect::<anyhow::Result<_>>()? })
    };
    let chart = |axis: usize| -> anyhow::Result<Chart> {
        Ok(Chart {
            title: format!("over {}", NAMES[axis]),
            x: NAMES[axis].into(),
            y: "mean distance correlation".into(),
            series: vec![over(axis, "others the paper's", &PAPER_WEIGHTS)?, over(axis, "others ours", ours)?],
        })
    };
    let charts = [chart(0)?, chart(1)?, chart(2)?];
    let (path, file) = album.figure("weights.svg");
    draw_charts(&charts, 3, (330, 280), &path)?;
    Ok(Figure {
        title: "The correlation over each weight".into(),
        about: "The paper's are w_D 0.25, α 0.025 and γ 0.025.".into(),
        file,
    })
}
