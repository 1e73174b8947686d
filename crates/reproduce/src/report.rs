//! What an experiment found, without any layout: what a page, a terminal and a machine are told.

use lookmatch_imaging::Verdict;
use serde::{Deserialize, Serialize};

/// All experiments of one run: what becomes one page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// What is needed to run them again.
    pub environment: Environment,
    /// In the order in which they were run.
    pub reports: Vec<Report>,
}

/// Where and how experiments were run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// Name and version of this program.
    pub program: String,
    /// The command that runs the same again.
    pub command: String,
    /// Seed of every random decision.
    pub seed: u64,
    /// True where everything was small.
    pub is_quick: bool,
    /// Processor, cores, operating system.
    pub machine: String,
}

/// What one experiment found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the experiment, `ward-to-ggx`.
    pub name: String,
    /// A headline.
    pub title: String,
    /// What it reproduces: "Section 5.2, Tables 4 and 5, Figures 9 and 11".
    pub reproduces: String,
    /// What was done, in a few sentences: scene, light, lattice.
    pub about: String,
    /// Time that it took, in seconds.
    pub seconds: f64,
    /// What had to be reached, and whether it was.
    pub findings: Vec<Finding>,
    /// Numbers, ours beside the paper's.
    pub tables: Vec<Table>,
    /// Pictures side by side.
    pub comparisons: Vec<Comparison>,
    /// Drawn figures.
    pub figures: Vec<Figure>,
    /// What a reader should know beside that, a paragraph each.
    pub notes: Vec<String>,
}

/// A number that has to reach a bar.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What it is: "mean NRMSD, red, Table 2".
    pub name: String,
    /// What was measured.
    pub value: f64,
    /// What it should be.
    pub bar: Bar,
    /// Why it is missed, where it is.
    pub cause: Option<String>,
}

/// What a number should be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bar {
    /// This or less.
    AtMost(f64),
    /// This or more.
    AtLeast(f64),
}

impl Finding {
    /// Whether the bar is reached.
    pub fn is_reached(&self) -> bool {
        match self.bar {
            Bar::AtMost(most) => self.value <= most,
            Bar::AtLeast(least) => self.value >= least,
        }
    }
}

/// A table of numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Above it.
    pub title: String,
    /// What it shows, in a sentence; may be empty.
    pub about: String,
    /// Titles of the columns, the first that of the rows' names.
    pub columns: Vec<String>,
    /// Its rows.
    pub rows: Vec<Row>,
}

/// A row of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// What it is about.
    pub name: String,
    /// One for each further column.
    pub cells: Vec<Cell>,
    /// True for rows to be seen first: the probe's, among baselines.
    pub is_main: bool,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number of ours alone.
    Number(f64),
    /// Ours beside the paper's; lower is better. Shown with their ratio, in red where ours is higher.
    Beside {
        /// Measured here.
        ours: f64,
        /// Published.
        paper: f64,
    },
    /// There is none.
    Empty,
}

/// Pictures that should look alike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Above it.
    pub title: String,
    /// What they should look like.
    pub source: Picture,
    /// Probe first, then baselines.
    pub others: Vec<Picture>,
    /// What the error maps draw brightest: a distance in linear RGB.
    pub scale: f64,
}

/// One picture and what it says beside the source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// `source`, `probe`, `copy`.
    pub title: String,
    /// The material, as it would be typed.
    pub material: String,
    /// A PNG file, as its path from the report's folder: `pictures/NAME.png`.
    pub file: String,
    /// Its error map in false colour, a PNG file there as well; none of the source.
    pub error_file: Option<String>,
    /// Mean NRMSD of the channels beside the source.
    pub nrmsd: Option<f64>,
    /// Just-objectionable differences of ColorVideoVDP, 10 where nothing is seen.
    pub jod: Option<f64>,
    /// What people would say.
    pub verdict: Option<Verdict>,
}

/// A drawn figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Above it.
    pub title: String,
    /// Below it; may be empty.
    pub about: String,
    /// An SVG or PNG file, as its path from the report's folder: `pictures/NAME.svg`.
    pub file: String,
}
