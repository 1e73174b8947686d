//! Section 7.1: where people see a difference. The paper's observers saw one for roughnesses up to 0.06 or specular reflectances from
//! 0.35 on, with an index up to 1.85, and none elsewhere; the verdict is asked the same.

use lookmatch_imaging::{NO_DIFFERENCE, Verdict, jod};
use lookmatch_plots::{Chart, Series, draw_charts};
use lookmatch_remap::{Preset, Probe, Strategy, Validator};
use rayon::prelude::*;

use super::ward_to_ggx::{plan, probe_name};
use crate::album::Album;
use crate::probes::found;
use crate::tables::mean;
use crate::{Cell, Figure, Report, Row, Setting, Table, Watch};

/// Roughness up to which the observers saw differences.
const SMOOTH: f64 = 0.06;
/// Specular reflectance from which on they did.
const BRIGHT: f64 = 0.35;
/// Specular reflectances that are drawn.
const DRAWN: [f64; 4] = [0.06, 0.16, 0.26, 0.36];

/// A source point and what would be seen of its match, in JOD.
struct Point {
    specular: f64,
    roughness: f64,
    jod: f64,
}

impl Point {
    /// Whether the paper's observers saw a difference there.
    fn was_seen(&self) -> bool {
        self.roughness <= SMOOTH || self.specular >= BRIGHT
    }

    fn verdict(&self) -> Verdict {
        Verdict::of(self.jod)
    }
}

pub(super) fn run(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    let judged = |name: &str, preset| -> anyhow::Result<Vec<Point>> {
        let plan = plan(setting, Strategy::Constrained, preset, "genetic")?;
        points(setting, watch, &found(setting, watch, &probe_name(name), &plan)?.probe)
    };
    let limited = judged("constrained", Some(Preset::Paper))?;
    let free = judged("free", None)?;
    let album = Album::of(setting, "agreement")?;
    let (path, file) = album.figure("jod.svg");
    let charts = [chart("index up to 1.85", &limited), chart("free index", &free)];
    draw_charts(&charts, 2, (430, 330), &path)?;
    Ok(Report {
        title: "Where people see a difference".into(),
        about: format!(
            "{} Ward plastics and their GGX matches on three spheres, {} pixels a side, looked at by ColorVideoVDP. The paper's observers saw \
             differences for roughnesses up to {SMOOTH} or specular reflectances from {BRIGHT} on, and none elsewhere.",
            limited.len(),
            setting.size()
        ),
        tables: vec![
            confusion("Agreement where any visible difference counts", &limited, Verdict::SlightlyDifferent),
            confusion("Agreement where only noticeable differences count", &limited, Verdict::NoticeablyDifferent),
            regions(&limited, &free),
        ],
        figures: vec![Figure {
            title: "What is seen, over the roughness of the source".into(),
            about: "Below 9.75 some see a difference, below 9 half of the observers.".into(),
            file,
        }],
        notes: vec![
            "The observers judged other spheres under another light, side by side for five seconds, and their partition is that of a test over \
             groups of pictures: no prediction can agree with it entirely."
                .into(),
        ],
        ..Report::default()
    })
}

/// What would be seen of all matches of a probe.
fn points(setting: &Setting, watch: &dyn Watch, probe: &Probe) -> anyhow::Result<Vec<Point>> {
    watch.begin("light of the spheres", 0);
    let validator = Validator::cached(probe, &None, setting.size(), &setting.cache, &|_| ())?;
    watch.begin("looking", probe.entries.len());
    let look = |place: usize| -> anyhow::Result<Point> {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        let (source, targets) = validator.materials(place)?;
        let Some(Some(target)) = targets.first() else {
            anyhow::bail!("the probe has no target for {source}")
        };
        let images = validator.render(&[&source, target]);
        let values = &probe.entries[place].source;
        watch.advance(1);
        Ok(Point { specular: values[0], roughness: values[1], jod: jod(&images[0], &images[1])? })
    };
    (0..probe.entries.len()).into_par_iter().map(look).collect()
}

/// How often the verdict, from `least` on, says what the observers said.
fn confusion(title: &str, points: &[Point], least: Verdict) -> Table {
    let count = |seen: bool, predicted: bool| {
        points.iter().filter(|p| p.was_seen() == seen && (p.verdict() >= least) == predicted).count()
    };
    let row = |name: &str, seen: bool| {
        let counts = [count(seen, true), count(seen, false)];
        Row { name: name.into(), cells: counts.map(|n| Cell::Text(n.to_string())).into(), is_main: false }
    };
    let right = count(true, true) + count(false, false);
    Table {
        title: title.into(),
        about: format!(
            "Index up to 1.85. The verdict agrees with the observers at {right} of {} source points ({:.0} %).",
            points.len(),
            100.0 * right as f64 / points.len() as f64
        ),
        columns: ["", "a difference is predicted", "none is"].map(str::to_owned).into(),
        rows: vec![row("observers saw one", true), row("observers saw none", false)],
    }
}

/// What becomes of the two regions when the index is not limited.
fn regions(limited: &[Point], free: &[Point]) -> Table {
    let row = |name: &str, points: &[Point], seen: bool| {
        let inside: Vec<&Point> = points.iter().filter(|p| p.was_seen() == seen).collect();
        let share = |verdict: Verdict| {
            let count = inside.iter().filter(|p| p.verdict() == verdict).count();
            Cell::Text(format!("{:.0} %", 100.0 * count as f64 / inside.len().max(1) as f64))
        };
        let off = mean(inside.iter().map(|p| NO_DIFFERENCE - p.jod));
        let cells = std::iter::once(Cell::Number(off)).chain(Verdict::ALL.map(share)).collect();
        Row { name: name.into(), cells, is_main: false }
    };
    let titles = std::iter::once("").chain(["JOD below 10"]).chain(Verdict::ALL.map(Verdict::title));
    Table {
        title: "With and without the limit of the index".into(),
        about: "Where the observers saw differences, and where they saw none.".into(),
        columns: titles.map(str::to_owned).collect(),
        rows: vec![
            row("seen, index up to 1.85", limited, true),
            row("seen, free index", free, true),
            row("not seen, index up to 1.85", limited, false),
            row("not seen, free index", free, false),
        ],
    }
}

/// JOD over the roughness for some reflectances.
fn chart(title: &str, points: &[Point]) -> Chart {
    let series = |wanted: &f64| {
        let off = |p: &&Point| (p.specular - wanted).abs();
        let nearest = points.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map_or(*wanted, |p| p.specular);
        let row = points.iter().filter(|p| p.specular == nearest);
        Series { name: format!("specular {nearest}"), points: row.map(|p| (p.roughness, p.jod)).collect() }
    };
    Chart {
        title: title.into(),
        x: "roughness".into(),
        y: "JOD".into(),
        series: DRAWN.iter().map(series).collect(),
    }
}
