//! A run with everything that a report can have, and its pictures.

use std::path::Path;

use lookmatch_imaging::Verdict;
use lookmatch_imaging::{Image, error_map, write};
use lookmatch_reproduce::{
    Bar, Cell, Comparison, Environment, Figure, Finding, Picture, Report, Row, Run, Table, pictures,
};

/// Side of the pictures in pixels.
const SIZE: usize = 96;

/// A run with three experiments; one misses a bar, one has nothing but a name.
pub fn run() -> Run {
    let environment = Environment {
        program: "lookmatch 0.1.0".into(),
        command: "lookmatch reproduce all --quick --seed 7 -o report/".into(),
        seed: 7,
        is_quick: true,
        machine: "AMD EPYC 7B13, 2 cores, Linux 6.1".into(),
    };
    let bare = Report { name: "pca".into(), title: "Components".into(), seconds: 0.4, ..Report::default() };
    Run { environment, reports: vec![ward(), iridium(), bare] }
}

/// An experiment with pictures, figures and a bar that is missed.
pub fn ward() -> Report {
    Report {
        name: "ward-to-ggx".into(),
        title: "Ward to GGX, dielectrics".into(),
        reproduces: "Section 5.2, Tables 4 and 5, Figures 9 and 11".into(),
        about: "Spheres under six maps & <no> point light.".into(),
        seconds: 200.0,
        findings: vec![
            finding("mean NRMSD, red, Table 4", 0.0101, Bar::AtMost(0.0107), None),
            finding(
                "share ranked first",
                0.5599,
                Bar::AtLeast(0.56),
                Some("JOD is flat where R < 0.06 <script>"),
            ),
        ],
        tables: vec![published(), wide()],
        comparisons: vec![comparison("city", 0.8), comparison("night", 0.1)],
        figures: vec![Figure {
            title: "Roughness over roughness".into(),
            about: "Points: the probe. Line: its fit.".into(),
            file: "pictures/roughness.svg".into(),
        }],
        notes: vec!["Preset ranges are the paper's: 1.3 to 1.85.".into()],
    }
}

fn iridium() -> Report {
    Report {
        name: "as-to-ggx".into(),
        title: "Ashikhmin–Shirley to GGX, conductors".into(),
        reproduces: "Section 5.1, Table 2".into(),
        seconds: 4400.0,
        findings: vec![finding("gap to the best", 1.0312, Bar::AtMost(1.1), None)],
        ..Report::default()
    }
}

fn finding(name: &str, value: f64, bar: Bar, cause: Option<&str>) -> Finding {
    Finding { name: name.into(), value, bar, cause: cause.map(str::to_owned) }
}

fn published() -> Table {
    let row = |name: &str, ours: f64, is_main| Row {
        name: name.into(),
        cells: vec![
            Cell::Beside { ours, paper: 0.0107 },
            Cell::Number(9.4137),
            Cell::Text("1.3 <= n <= 1.85".into()),
            Cell::Empty,
        ],
        is_main,
    };
    Table {
        title: "Table 4: NRMSD".into(),
        about: "Over 1024 source points.".into(),
        columns: ["method", "mean, red", "JOD", "range", "time"].map(str::to_owned).to_vec(),
        rows: vec![row("probe", 0.0101, true), row("copy", 0.0213, false)],
    }
}

/// A table that is wider and longer than any terminal or telephone.
fn wide() -> Table {
    let cell = |k: usize| Cell::Beside { ours: 0.01 + k as f64 * 1e-4, paper: 0.0123 };
    let row = |k: usize| Row {
        name: format!("material-{k}"),
        cells: (0..12).map(cell).collect(),
        is_main: k == 17,
    };
    Table {
        title: "All materials".into(),
        about: String::new(),
        columns: std::iter::once("material".to_owned())
            .chain((0..12).map(|k| format!("column {k}")))
            .collect(),
        rows: (0..20).map(row).collect(),
    }
}

fn comparison(map: &str, error: f64) -> Comparison {
    let picture = |title: &str, verdict: Option<Verdict>, nrmsd: f64, jod: f64| Picture {
        title: title.into(),
        material: format!("ggx:roughness=0.2,ior=1.5 \"{title}\""),
        file: format!("pictures/{title}.png"),
        error_file: verdict.map(|_| format!("pictures/{title}-error.png")),
        nrmsd: verdict.map(|_| nrmsd),
        jod: verdict.map(|_| jod),
        verdict,
    };
    Comparison {
        title: format!("Red plastic under {map}"),
        source: picture("source", None, 0.0, 10.0),
        others: vec![
            picture("probe", Some(Verdict::Indistinguishable), 0.0113, 9.871),
            picture("copy", Some(Verdict::SlightlyDifferent), 0.0287, 9.31),
            picture("no-fresnel", Some(Verdict::NoticeablyDifferent), 0.0641, 7.62),
        ],
        scale: error,
    }
}

/// Writes the pictures and the figure that [`run`] names.
pub fn write_pictures(folder: &Path) {
    let folder = pictures(folder).unwrap();
    let source = sphere(40.0, 0.6);
    write(&folder.join("source.png"), &source, &[]).unwrap();
    for (title, exponent, gain) in [("probe", 36.0, 0.6), ("copy", 20.0, 0.5), ("no-fresnel", 90.0, 1.2)] {
        let other = sphere(exponent, gain);
        write(&folder.join(format!("{title}.png")), &other, &[]).unwrap();
        let (map, _) = error_map(&source, &other, Some(0.8)).unwrap();
        write(&folder.join(format!("{title}-error.png")), &map, &[]).unwrap();
    }
    std::fs::write(folder.join("roughness.svg"), FIGURE).unwrap();
}

const FIGURE: &str = "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 300 160' width='300' height='160'>\
                      <path d='M20 10V140H290' fill='none' stroke='#333'/>\
                      <path d='M20 140C90 120 160 70 290 20' fill='none' stroke='#2b4c94' stroke-width='2'/></svg>";

/// A shaded ball with a highlight.
fn sphere(exponent: f32, gain: f32) -> Image {
    let half = SIZE as f32 / 2.0;
    Image::from_fn(SIZE, SIZE, |x, y| {
        let [u, v] = [x, y].map(|at| (at as f32 + 0.5 - half) / (0.85 * half));
        let Some(w) = Some(1.0 - u * u - v * v).filter(|square| *square > 0.0).map(f32::sqrt) else {
            return [0.05, 0.06, 0.08];
        };
        let facing = (-0.5 * u - 0.6 * v + 0.62 * w).max(0.0);
        let highlight = gain * facing.powf(exponent);
        [0.5, 0.08, 0.05].map(|body| body * (0.1 + facing) + highlight)
    })
}
