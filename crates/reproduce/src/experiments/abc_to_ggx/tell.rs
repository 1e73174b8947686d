//! What is told of all that.

use lookmatch_imaging::{NO_DIFFERENCE, NOTICEABLE, Verdict};
use lookmatch_materials::Material;
use lookmatch_plots::{Chart, Series, draw_charts};

use super::best::Gap;
use super::judge::{Errors, Judged};
use super::matching::{FIRST_RANGE, Remapped};
use super::{PAPERS_FAILURES, PICTURE_SIZE, is_failed};
use crate::album::Album;
use crate::tables::{bar, mean};
use crate::{Bar, Cell, Comparison, Figure, Report, Row, Setting, Table};

/// Materials for which the paper had to extend the range of the index.
const PAPERS_EXTENDED: usize = 29;
const METHODS: [&str; 3] = ["ABC fit", "remap to GGX", "direct GGX fit"];
/// The three numbers of a judgement.
const NUMBERS: [fn(&Errors) -> f64; 3] = [|e| e.nrmsd, |e| e.delta_e, |e| e.jod];

pub(super) fn report(
    setting: &Setting,
    album: &Album,
    (all, judgements, gap): (&[Remapped], &[Judged], &Gap),
    comparisons: Vec<Comparison>,
) -> anyhow::Result<Report> {
    let size = setting.size();
    let ratio = mean(gap.ours.iter().copied()) / mean(gap.best.iter().copied());
    let there = mean(gap.there.iter().copied());
    let best = mean(gap.best.iter().copied());
    let cause = format!(
        "measured: the remap's own search on the validation pictures, by Eq. 3 in CIELAB, comes to {:.2}× the best, so that {}",
        there / best,
        if there / best > 1.0 + 0.5 * (ratio - 1.0) {
            "most of the gap is between the two metrics"
        } else {
            "most of the gap is between the two scenes"
        },
    );
    let findings = vec![bar(
        "mean NRMSD of the remap over that of the best GGX for the validation pictures, both beside the ABC fit".into(),
        ratio,
        Bar::AtMost(1.10),
        &cause,
    )];
    Ok(Report {
        title: "Löw's ABC model to GGX, the MERL materials".into(),
        about: format!(
            "Löw's published fits of {} MERL materials, channel by channel: height, core, tail and index of the ABC lobe are \
             matched by specular reflectance (0 to 1), index and roughness of a GGX one; then one index and one roughness for all \
             channels, those of the least fitness summed over them, with a specular reflectance for each. Shapes are those of the \
             lattice, reflectances lie between its levels. The diffuse reflection is carried over. Judged on a sphere on a checkerboard under an interior and a \
             lamp that the search never saw, {size} pixels a side.",
            all.len(),
        ),
        findings,
        tables: vec![
            summary(judgements),
            verdicts(judgements),
            ranges(all, judgements),
            gap_table(gap),
            materials(all, judgements),
        ],
        comparisons,
        figures: vec![figure(album, judgements)?],
        notes: notes(setting, all),
        ..Report::default()
    })
}

/// How a direct fit is written.
pub(super) fn direct(material: &Material) -> String {
    let alpha = material.number("alpha").unwrap_or(f64::NAN);
    format!("GGX lobe, α = {alpha}, Fresnel term measured, nothing diffuse")
}

fn columns(titles: &[&str]) -> Vec<String> {
    titles.iter().map(|title| (*title).to_owned()).collect()
}

fn row(name: impl Into<String>, cells: Vec<Cell>) -> Row {
    Row { name: name.into(), cells, is_main: false }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

fn summary(judgements: &[Judged]) -> Table {
    let cells = |of: &dyn Fn(&Judged) -> Errors| {
        let values =
            |number: fn(&Errors) -> f64| judgements.iter().map(|j| number(&of(j))).collect::<Vec<_>>();
        NUMBERS
            .iter()
            .flat_map(|number| [mean(values(*number).into_iter()), median(values(*number))])
            .map(Cell::Number)
            .collect()
    };
    let methods = METHODS.iter().enumerate();
    let mut rows: Vec<Row> = methods
        .map(|(k, method)| Row {
            is_main: k == 1,
            ..row(format!("{method} beside the measured material"), cells(&|j| j.measured[k]))
        })
        .collect();
    rows.push(row("remap beside the ABC fit, its source", cells(&|j| j.remap)));
    let better = |number: fn(&Errors) -> f64, sign: f64| {
        let wins = judgements
            .iter()
            .filter(|j| sign * number(&j.measured[1]) < sign * number(&j.measured[2]))
            .count();
        Cell::Text(format!("{:.0} %", 100.0 * wins as f64 / judgements.len() as f64))
    };
    rows.push(row(
        "share in which the remap beats the direct fit",
        vec![
            better(NUMBERS[0], 1.0),
            Cell::Empty,
            better(NUMBERS[1], 1.0),
            Cell::Empty,
            better(NUMBERS[2], -1.0),
            Cell::Empty,
        ],
    ));
    Table {
        title: "All materials".into(),
        about: format!(
            "Over {} materials; NRMSD is the mean of the channels, and JOD are 10 where nothing is seen.",
            judgements.len()
        ),
        columns: columns(&["", "NRMSD, mean", "median", "ΔE*76, mean", "median", "JOD, mean", "median"]),
        rows,
    }
}

fn verdicts(judgements: &[Judged]) -> Table {
    let counts = |jod: &dyn Fn(&Judged) -> f64| {
        let count = |verdict: Verdict| judgements.iter().filter(|j| Verdict::of(jod(j)) == verdict).count();
        Verdict::ALL.map(|verdict| Cell::Number(count(verdict) as f64)).into()
    };
    let mut rows: Vec<Row> = (0..3)
        .map(|k| row(format!("{} beside the measured material", METHODS[k]), counts(&|j| j.measured[k].jod)))
        .collect();
    rows.push(Row { is_main: true, ..row("remap beside the ABC fit, its source", counts(&|j| j.remap.jod)) });
    Table {
        title: "Would anybody see it?".into(),
        about: "Number of materials by verdict.".into(),
        columns: std::iter::once("").chain(Verdict::ALL.map(Verdict::title)).map(str::to_owned).collect(),
        rows,
    }
}

fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

fn ranges(all: &[Remapped], judgements: &[Judged]) -> Table {
    let extended = || all.iter().filter(|remapped| remapped.is_extended);
    let failed =
        || all.iter().zip(judgements).filter(|(_, judged)| is_failed(judged)).map(|(remapped, _)| remapped);
    let text = |names: String| Cell::Text(names);
    let count = |n: usize| Cell::Number(n as f64);
    Table {
        title: "Extended ranges and failures".into(),
        about: format!(
            "The range of the index is extended from {FIRST_RANGE} to 100 where, for any channel or for all together, the best match has the highest \
             index or a specular reflectance of 1, and it is needed where the match of the whole material then has a higher index. A remap has failed where it \
             is noticeably different from its ABC fit: {NOTICEABLE} JOD or more, what half of all observers see. The paper states no criterion \
             for either."
        ),
        columns: columns(&["", "ours", "the paper", "which, ours", "which, the paper"]),
        rows: vec![
            row(
                "extended range",
                vec![
                    count(extended().count()),
                    count(PAPERS_EXTENDED),
                    text(list(extended().map(|r| r.name.as_str()))),
                    text("many metals, the specular phenolics; no list".into()),
                ],
            ),
            row(
                "failed",
                vec![
                    count(failed().count()),
                    count(PAPERS_FAILURES.len()),
                    text(list(failed().map(|r| r.name.as_str()))),
                    text(PAPERS_FAILURES.join(", ")),
                ],
            ),
        ],
    }
}

fn gap_table(gap: &Gap) -> Table {
    let of = |name: &str, values: &[f64]| {
        let ratios = values.iter().zip(&gap.best).map(|(value, best)| value / best).collect();
        let [own, best] = [values, &gap.best].map(|all| mean(all.iter().copied()));
        row(name, [own, median(values.to_vec()), own / best, median(ratios)].map(Cell::Number).into())
    };
    Table {
        title: "The remap beside the best that GGX can do".into(),
        about: format!(
            "NRMSD beside the ABC fit, at {0} × {0} pixels. The best is found on these very pictures, among {1} pairs of index and roughness, each \
             with the specular reflectances of the least squares; the other search there is the remap's, by Eq. 3.",
            gap.size, gap.shapes
        ),
        columns: columns(&["NRMSD", "mean", "median", "mean over best mean", "median ratio to the best"]),
        rows: vec![
            Row { is_main: true, ..of("remap", &gap.ours) },
            of("the same search on the validation pictures", &gap.there),
            of("best possible", &gap.best),
        ],
    }
}

fn materials(all: &[Remapped], judgements: &[Judged]) -> Table {
    let one = |(remapped, judged): (&Remapped, &Judged)| {
        let found = &remapped.found;
        let specular: Vec<String> = found.scale.iter().map(|s| format!("{s:.3}")).collect();
        let mut cells: Vec<Cell> = found.shape.iter().copied().map(Cell::Number).collect();
        cells.push(Cell::Text(specular.join(" / ")));
        for number in NUMBERS {
            cells.extend(judged.measured.iter().map(number).map(Cell::Number));
        }
        cells.extend([judged.remap.nrmsd, judged.remap.jod].map(Cell::Number));
        let is_extended = remapped.is_extended.then_some("extended");
        let has_failed = is_failed(judged).then_some("failed");
        let remarks: Vec<&str> = is_extended.into_iter().chain(has_failed).collect();
        cells.push(Cell::Text(remarks.join(", ")));
        row(remapped.name.clone(), cells)
    };
    Table {
        title: "Every material".into(),
        about: "NRMSD, ΔE and JOD of ABC fit, remap and direct fit beside the measured material; then of the remap beside the ABC fit.".into(),
        columns: columns(&[
            "material", "index", "roughness", "specular", "NRMSD, ABC", "remap", "direct", "ΔE, ABC", "remap", "direct", "JOD, ABC",
            "remap", "direct", "NRMSD, remap from ABC", "JOD", "",
        ]),
        rows: all.iter().zip(judgements).map(one).collect(),
    }
}

/// Errors of all materials, each method's in its own order.
fn figure(album: &Album, judgements: &[Judged]) -> anyhow::Result<Figure> {
    let sorted = |name: &str, of: &dyn Fn(&Judged) -> f64| {
        let mut values: Vec<f64> = judgements.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        Series {
            name: name.into(),
            points: values.into_iter().enumerate().map(|(k, v)| ((k + 1) as f64, v)).collect(),
        }
    };
    let chart = |title: &str, y: &str, number: fn(&Errors) -> f64| Chart {
        title: title.into(),
        x: "materials, each curve in its own order".into(),
        y: y.into(),
        series: (0..3).map(|k| sorted(METHODS[k], &|j| number(&j.measured[k]))).collect(),
    };
    let charts = [
        chart("beside the measured material", "NRMSD, mean of channels", |e| e.nrmsd),
        chart("beside the measured material", "difference in JOD", |e| NO_DIFFERENCE - e.jod),
    ];
    let (path, file) = album.figure("errors.svg");
    draw_charts(&charts, 2, (430, 330), &path)?;
    Ok(Figure { title: "What is left of each material".into(), about: String::new(), file })
}

fn notes(setting: &Setting, all: &[Remapped]) -> Vec<String> {
    let alone = |wanted: &dyn Fn(&Remapped) -> f64| mean(all.iter().map(wanted));
    let one = alone(&|r| r.found.fitness.iter().sum::<f64>() / 3.0);
    let each = alone(&|r| r.alone.iter().map(|c| c.fitness[0]).sum::<f64>() / 3.0);
    let needy = all.iter().filter(|r| r.alone.iter().any(|c| c.shape[0] > FIRST_RANGE + 1e-9)).count();
    vec![
        format!(
            "One index and roughness for all channels costs little: the mean fitness (Eq. 3) is {one:.3}, and {each:.3} with an index and a \
             roughness for each. Of {needy} materials at least one channel on its own has an index above {FIRST_RANGE}."
        ),
        format!(
            "Shown are pictures of {0} × {0} pixels, and the numbers below them are theirs; those of the tables are of the larger ones.",
            setting.size().min(PICTURE_SIZE)
        ),
        "The measured materials are the neural networks of Sztrajman et al. (2021), trained on the MERL database; the ABC parameters are those that Löw's \
         group published. The direct fit is a GGX lobe without a diffuse term, as Dupuy et al. (2015) have it: its width by their power iterations, \
         run on the networks with their program, and its Fresnel term measured for each channel and difference angle as the light that the material \
         reflects over the light that the lobe would reflect with a Fresnel term of 1 (at most 1, straight lines between 17 cosines). A searched index \
         or specular colour stands for nothing in it."
            .into(),
        "Bodies are black while shapes are compared: the share of the light that a lobe throws onto the board and the body reflects again is the same \
         for source and target but for their difference."
            .into(),
    ]
}
