//! Fitness functions of the shape met in BRDF matching, small enough to be enumerated.
//!
//! The renders are rows of "pixels": a Gaussian or Trowbridge-Reitz lobe of some roughness over half-vector
//! angles and three angles of incidence, scaled by the Fresnel reflectance of some index of refraction, on a
//! diffuse base, in CIE lightness. Their root-mean-square difference has the curved valley of index against
//! roughness, and the plateau where the specular switch is off. A hash of the point roughens it a little.
#![allow(dead_code)]

use lookmatch_search::{Axis, Bounds, Lattice, Objective, ObjectiveError, Point, Problem};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Lightness of every pixel.
pub type Row = Vec<f64>;

/// Shape of the lobe over tan² of the half-vector angle.
#[derive(Clone, Copy)]
pub enum Lobe {
    Gaussian,
    TrowbridgeReitz,
}

fn fresnel(index: f64, cosine: f64) -> f64 {
    let g = (index * index - 1.0 + cosine * cosine).sqrt();
    let (difference, sum) = (g - cosine, g + cosine);
    let ratio = (cosine * sum - 1.0) / (cosine * difference + 1.0);
    0.5 * (difference / sum).powi(2) * (1.0 + ratio * ratio)
}

fn lobe(shape: Lobe, alpha: f64, theta: f64) -> f64 {
    let (t2, c4, a2) = (theta.tan().powi(2), theta.cos().powi(4), alpha * alpha);
    let shape = match shape {
        Lobe::Gaussian => (-t2 / a2).exp(),
        Lobe::TrowbridgeReitz => (1.0 + t2 / a2).powi(-2),
    };
    shape / (std::f64::consts::PI * a2 * c4)
}

/// The row of a material; `specular` scales the lobe.
pub fn row(shape: Lobe, specular: f64, index: f64, alpha: f64) -> Row {
    let mut row = Row::new();
    for cosine in [1.0, 0.7, 0.35] {
        let strength = specular * fresnel(index, cosine) / (4.0 * cosine);
        for k in 0..16 {
            let theta = 1.45 * (f64::from(k) / 16.0).powf(1.5);
            // Renderings saturate: the eye and tone curves do not follow the tip of a mirror-like lobe.
            let light = 0.2 + (strength * lobe(shape, alpha, theta)).min(50.0);
            row.push(116.0 * light.cbrt() - 16.0);
        }
    }
    row
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum();
    (sum / a.len() as f64).sqrt()
}

/// Uniform in 0..1, a function of the arguments alone.
fn hash(point: &Point, salt: u64) -> f64 {
    let mix = |h: u64, i: u64| (h ^ i).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
    let h = point.iter().fold(mix(salt, 77), |h, &i| mix(h, u64::from(i) + 1));
    mix(h, 3) as f64 / u64::MAX as f64
}

/// All rows of a target lattice of switch x index x roughness.
pub struct Scene {
    pub lattice: Lattice,
    rows: Vec<Row>,
}

impl Scene {
    pub fn new(index: (f64, f64, f64), alpha: (f64, f64, f64)) -> Scene {
        let axes = vec![
            Axis::listed("specular", vec![0.0, 1.0]).expect("sound levels"),
            Axis::regular("index", index.0, index.1, index.2).expect("a sound range"),
            Axis::regular("alpha", alpha.0, alpha.1, alpha.2).expect("a sound range"),
        ];
        let lattice = Lattice { axes };
        let points = lattice.points(&Bounds::full(&lattice));
        let values = points.map(|p| lattice.values(&p));
        let rows = values.map(|v| row(Lobe::TrowbridgeReitz, v[0], v[1], v[2])).collect();
        Scene { lattice, rows }
    }

    /// 2 x 43 x 35 = 3,010 points.
    pub fn coarse() -> Scene {
        Scene::new((1.01, 1.85, 0.02), (0.01, 0.69, 0.02))
    }

    /// 2 x 85 x 70 = 11,900 points.
    pub fn fine() -> Scene {
        Scene::new((1.01, 1.85, 0.01), (0.01, 0.70, 0.01))
    }

    /// 2 x 344 x 70 = 48,160 points.
    pub fn wide() -> Scene {
        Scene::new((1.01, 4.44, 0.01), (0.01, 0.70, 0.01))
    }

    pub fn problem(&self, seed: u64) -> Problem<'_> {
        Problem { lattice: &self.lattice, bounds: Bounds::full(&self.lattice), guesses: vec![], seed }
    }

    fn row_of(&self, point: &Point) -> &Row {
        let [s, i, a] = [0, 1, 2].map(|k| point[k] as usize);
        let [indices, alphas] = [1, 2].map(|k| self.lattice.axes[k].len());
        &self.rows[(s * indices + i) * alphas + a]
    }
}

/// One source to be matched.
pub struct Match<'a> {
    pub scene: &'a Scene,
    pub source: Row,
    pub rough: f64,
    pub salt: u64,
    pub calls: usize,
}

impl Match<'_> {
    pub fn fitness(&self, point: &Point) -> f64 {
        let smooth = distance(self.scene.row_of(point), &self.source);
        // With the switch off the renders are the same to the last bit: a true plateau.
        if point[0] == 0 { smooth } else { smooth + self.rough * hash(point, self.salt) }
    }

    /// The optimum by enumeration, independent of the crate's own searches.
    pub fn truth(&self) -> (f64, Point) {
        let lattice = &self.scene.lattice;
        let all = lattice.points(&Bounds::full(lattice));
        let scored = all.map(|p| (self.fitness(&p), p));
        scored.min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1))).expect("a lattice has points")
    }
}

impl Objective for Match<'_> {
    fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
        self.calls += points.len();
        Ok(points.iter().map(|p| self.fitness(p)).collect())
    }
}

/// Sources of all kinds: inside the lattice, off its levels, beyond its edges, and without any lobe.
pub fn sources(scene: &Scene, count: u64, rough: f64) -> Vec<Match<'_>> {
    let index = &scene.lattice.axes[1].levels;
    let (low, high) = (index[0], index[index.len() - 1]);
    (0..count)
        .map(|k| {
            let mut rng = Pcg64::seed_from_u64(1000 + k);
            let mut at = |a: f64, b: f64| a + (b - a) * rng.random::<f64>();
            let (index, alpha) = (at(low, high), at(0.01, 0.7));
            let shape = if k % 2 == 0 { Lobe::Gaussian } else { Lobe::TrowbridgeReitz };
            let source = match k % 10 {
                6 => row(shape, 1.0, index, at(0.7, 1.2)),
                7 => row(shape, 1.0, high + at(0.0, 0.5), alpha),
                8 => row(shape, 1.0, index, at(0.004, 0.02)),
                9 => row(shape, if k % 20 == 9 { 0.0 } else { at(0.1, 0.6) }, index, alpha),
                _ => row(shape, 1.0, index, alpha),
            };
            Match { scene, source, rough, salt: k, calls: 0 }
        })
        .collect()
}

/// How often a search found the optimum of the sources, and at what cost.
pub struct Score {
    pub runs: usize,
    pub found: usize,
    pub evaluations: Vec<usize>,
    pub misses: Vec<String>,
}

impl Score {
    pub fn of(
        search: &dyn lookmatch_search::Search,
        scene: &Scene,
        sources: &mut [Match],
        seeds: std::ops::Range<u64>,
    ) -> Score {
        let mut score = Score { runs: 0, found: 0, evaluations: vec![], misses: vec![] };
        for (k, source) in sources.iter_mut().enumerate() {
            let truth = source.truth();
            for seed in seeds.clone() {
                let outcome = search.run(&scene.problem(seed), source).expect("a sound problem");
                score.runs += 1;
                score.found += usize::from(outcome.best == truth.1);
                if outcome.best != truth.1 {
                    score.misses.push(format!(
                        "source {k} seed {seed}: {:?} {} not {:?} {}",
                        outcome.best, outcome.fitness, truth.1, truth.0
                    ));
                }
                score.evaluations.push(outcome.evaluations);
            }
        }
        score
    }

    pub fn rate(&self) -> f64 {
        self.found as f64 / self.runs as f64
    }

    pub fn mean(&self) -> f64 {
        self.evaluations.iter().sum::<usize>() as f64 / self.runs as f64
    }

    pub fn line(&self, points: usize) -> String {
        format!(
            "{:5.1} % of {} runs, {:6.1} evaluations ({:4.1} %), at most {}",
            100.0 * self.rate(),
            self.runs,
            self.mean(),
            100.0 * self.mean() / points as f64,
            self.evaluations.iter().max().unwrap_or(&0)
        )
    }
}
