//! Section 6: anisotropic lobes, Lafortune to Ward and Ward to GGX, judged on a sphere and shown on a mesh with tangents.

mod best;
mod judge;
mod mesh;
mod symmetry;
mod tables;

use lookmatch_materials::fresnel::{f0_from_ior, ior_from_f0};
use lookmatch_remap::{Endpoint, Options, Pair, Plan, Probe, Stage, Strategy};
use lookmatch_search::Axis;

use crate::album::Album;
use crate::probes::found;
use crate::tables::{bar, mean};
use crate::{Bar, Report, Setting, Watch};
use judge::{Judge, Score};

/// A light that no search has seen.
const LIGHT: &str = "sunset";
/// The brightest specular reflectance of Ward plastics in the paper's Table 3.
const BRIGHTEST: f64 = 0.4;

pub(super) fn lafortune_to_ward(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    LAFORTUNE_TO_WARD.run(setting, watch)
}

pub(super) fn ward_to_ggx(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    WARD_TO_GGX.run(setting, watch)
}

/// Levels of a source parameter: of a full run, and of a quick one.
type Levels = (&'static str, [&'static [f64]; 2]);

/// Ratio of two neighbouring levels of a target's width.
const STEP: f64 = 1.14;

/// Names of classes of source points, and which of them a point belongs to.
type Classes = (&'static [&'static str], fn(&[f64]) -> usize);

/// One of the two remaps.
struct Case {
    name: &'static str,
    title: &'static str,
    /// Both models.
    models: [&'static str; 2],
    /// The source's parameters; the second and the third belong to tangent and bitangent.
    source: &'static [Levels],
    /// The target's largest scale, and the ratio of its levels.
    scales: (f64, f64),
    /// Whether the search and the judgement weigh the middle of the sphere more.
    mask: bool,
    /// Source parameters that lead a target parameter of another role, or none: see [`Pair`].
    pairs: &'static [&'static str],
    /// How two levels of anisotropy are paired along the figure: both ends and what lies between.
    path: fn(usize, usize, usize) -> bool,
    /// What the figure's horizontal axis says, and its value.
    degree: (&'static str, fn(f64, f64) -> f64),
    classes: Classes,
    /// What is particular.
    about: &'static str,
    notes: &'static [&'static str],
}

const DIRECTIONS: [&[f64]; 2] = [&[-1.0, -0.95, -0.85], &[-1.0, -0.85]];
const WIDTHS: [&[f64]; 2] = [&[0.05, 0.1, 0.2, 0.35, 0.6], &[0.08, 0.2, 0.5]];

static LAFORTUNE_TO_WARD: Case = Case {
    name: "lafortune-to-ward",
    title: "Lafortune to Ward, anisotropic",
    models: ["lafortune", "ward"],
    source: &[
        ("specular", [&[0.3], &[0.3]]),
        ("cx", DIRECTIONS),
        ("cy", DIRECTIONS),
        ("exponent", [&[32.0, 128.0, 512.0], &[128.0]]),
    ],
    // Lobes that fade are matched by a hundredth of their scale.
    scales: (0.25, 1.12),
    mask: false,
    // Anisotropy and roughness are not apart in the target: the exponent leads neither width alone.
    pairs: &["exponent"],
    path: |x, y, _| x == 0 || y == 0,
    degree: ("|C_y| − |C_x|", |x, y| x - y),
    classes: (
        &["isotropic, n ≤ 128", "isotropic, n > 128", "anisotropic, n ≤ 128", "anisotropic, n > 128"],
        |source| usize::from(source[1] != source[2]) * 2 + usize::from(source[3] > 128.0),
    ),
    about: "A single lobe without retro-reflection and off-specular peaks: C_z is 1, C_x and C_y lie between -1 and -0.85.",
    notes: &[
        "Where |C_x| or |C_y| is below C_z, a Lafortune lobe fades with the angle of incidence: by about exp(-n (1 - |C|) sin² θ) in \
         that direction. Ward's lobe has the same reflectance at all angles, so that no widths can show this: it is what fails where n \
         is large.",
    ],
};

static WARD_TO_GGX: Case = Case {
    name: "ward-to-ggx-aniso",
    title: "Ward to GGX, anisotropic",
    models: ["ward", "ggx"],
    source: &[("specular", [&[0.2], &[0.2]]), ("roughness_u", WIDTHS), ("roughness_v", WIDTHS)],
    scales: (1.0, 1.09),
    mask: true,
    pairs: &[],
    path: |u, v, count| u + v + 1 == count,
    degree: ("log₂ R_v / R_u of the source", |u, v| (v / u).log2()),
    classes: (&["isotropic", "ratio of the widths up to 2", "ratio up to 4", "ratio above 4"], |source| {
        let ratio = (source[1] / source[2]).max(source[2] / source[1]);
        [1.0, 2.0, 4.0].iter().filter(|most| ratio > **most + 1e-9).count()
    }),
    about: "The paper searches S, R_U and R_V. The index is held where its reflectance at normal incidence is 0.4, the largest of Ward's: \
            so the scale S ≤ 1 reaches all sources, and reflectances rise the least towards grazing angles, which Ward's do not at all.",
    notes: &[],
};

impl Case {
    fn run(&self, setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
        let plan = self.plan(setting)?;
        let probe = found(setting, watch, self.name, &plan)?.probe;
        let judge = Judge::new(setting, watch, &probe)?;
        let scores = judge.scores(&probe, watch)?;
        let gap = best::gap(&judge, (&probe, &plan), self, setting, watch)?;
        let symmetry = symmetry::Symmetry::of(&probe);
        let stage = Stage::cached(&plan, &setting.cache, &|_| ())?;
        let album = Album::of(setting, self.name)?;
        let own = |score: &Score| score.methods[0].nrmsd(self.mask);
        let better = tables::better_baseline(&scores.iter().collect::<Vec<_>>(), self.mask);
        let mut findings = vec![
            bar(
                format!("mean {} over that of the best target for the validation pictures", self.measure()),
                gap.ratio(),
                Bar::AtMost(1.10),
                &gap.cause(),
            ),
            bar(
                format!("mean {} over that of the better baseline", self.measure()),
                mean(scores.iter().map(own)) / better,
                Bar::AtMost(0.8),
                &gap.baseline_cause(&scores),
            ),
        ];
        findings.extend(symmetry.findings(&probe, &stage)?);
        Ok(Report {
            title: self.title.into(),
            about: format!(
                "{} source points are matched on a sphere of the reference scene, {} pixels a side{}, and judged on a sphere under the map \
                 '{LIGHT}' and a lamp, which no search has seen, {} pixels a side. {}",
                probe.entries.len(),
                probe.size,
                if self.mask { ", with the radial mask" } else { "" },
                judge.size(),
                self.about,
            ),
            findings,
            tables: vec![
                tables::overall(self, &scores),
                tables::by_class(self, &probe, &scores),
                gap.table(self),
                symmetry.table(),
            ],
            comparisons: mesh::comparisons(self, setting, watch, &album, &probe)?,
            figures: vec![tables::figure(self, &album, &probe)?, tables::maps(&album, &probe)?],
            notes: self.notes.iter().map(|note| (*note).to_owned()).collect(),
            ..Report::default()
        })
    }

    /// What is averaged.
    fn measure(&self) -> &'static str {
        if self.mask { "masked NRMSD" } else { "NRMSD" }
    }

    fn plan(&self, setting: &Setting) -> anyhow::Result<Plan> {
        let [from, to] = self.models.map(lookmatch_materials::by_name);
        let options = Options {
            seed: setting.seed,
            mask: self.mask,
            strategy: Strategy::Constrained,
            search: "synthesis".into(),
            size: Some(if setting.is_quick { 24 } else { 40 }),
            // What the search foresees is off by more than a level of the lattice is worth.
            refine: true,
            ..Options::default()
        };
        let mut plan = Plan::between(Endpoint::Model(from?), Endpoint::Model(to?), &options)?;
        let quick = usize::from(setting.is_quick);
        let listed = |(name, levels): &Levels| Axis::listed(*name, levels[quick].to_vec());
        plan.source_axes = self.source.iter().map(listed).collect::<Result<_, _>>()?;
        if plan.to.model().name == "ggx" {
            plan.to.set_number("ior", index())?;
            plan.held.push("ior".into());
        }
        // About as many as all are forecast of, in steps of the same ratio.
        let (brightest, ratio) = self.scales;
        plan.target_axes = vec![
            steps("specular", brightest, ratio, 47)?,
            steps("roughness_u", 0.67, STEP, 30)?,
            steps("roughness_v", 0.67, STEP, 30)?,
        ];
        let alone = |source: &&str| Pair { source: (*source).into(), targets: Vec::new() };
        plan.pairs = self.pairs.iter().map(alone).collect();
        Ok(plan)
    }
}

/// The index of refraction that GGX is held at.
fn index() -> f64 {
    let index = (ior_from_f0(BRIGHTEST) * 100.0).ceil() / 100.0;
    debug_assert!(f0_from_ior(index) >= BRIGHTEST);
    index
}

/// Levels of the same ratio up to a largest one.
fn steps(name: &str, largest: f64, ratio: f64, count: i32) -> anyhow::Result<Axis> {
    let level = |k: i32| (1e4 * largest / ratio.powi(k)).round() / 1e4;
    Ok(Axis::listed(name, (0..count).rev().map(level).collect())?)
}

/// Places of the probe's entries along the figure, from one direction to the other, of sources of medium brightness and, where there is a fourth
/// parameter, of one level of that.
fn path(case: &Case, probe: &Probe, last: Option<usize>) -> Vec<usize> {
    let axes = &probe.source_axes;
    let place = |k: usize, value: f64| axes[k].nearest(value);
    let is_on = |source: &[f64]| {
        let bright = place(0, source[0]) == axes[0].len() / 2;
        let wanted = last.is_none_or(|last| source.len() < 4 || place(3, source[3]) == last);
        bright && wanted && (case.path)(place(1, source[1]), place(2, source[2]), axes[1].len())
    };
    let mut places: Vec<usize> =
        (0..probe.entries.len()).filter(|k| is_on(&probe.entries[*k].source)).collect();
    let degree = |k: &usize| {
        let source = &probe.entries[*k].source;
        (case.degree.1)(source[1], source[2])
    };
    places.sort_by(|a, b| degree(a).total_cmp(&degree(b)));
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookmatch_rendering::TransportCache;

    /// A probe with no results but made-up ones: each width of the target is that of the source, or of C.
    fn probe(case: &Case, is_quick: bool) -> Probe {
        let folder = std::path::PathBuf::new();
        let setting = Setting { is_quick, seed: 1, folder, cache: TransportCache::off() };
        let plan = case.plan(&setting).unwrap();
        let text = serde_json::json!({
            "format": "lookmatch-probe", "version": 1, "program": "", "from": plan.from, "to": plan.to,
            "source_axes": plan.source_axes, "target_axes": plan.target_axes, "strategy": plan.strategy,
            "search": plan.search, "preset": null, "seed": 1, "scene": plan.scene, "size": plan.size,
            "metric": {"name": "", "space": plan.metric.space, "reduce": plan.metric.reduce, "mask": plan.mask,
                "weights": plan.metric.weights},
            "totals": {"evaluations": 0, "lattice_points": 0}, "entries": [],
        });
        let mut probe: Probe = serde_json::from_value(text).unwrap();
        let lattice = lookmatch_search::Lattice { axes: probe.source_axes.clone() };
        for point in lattice.points(&lookmatch_search::Bounds::full(&lattice)) {
            let source = lattice.values(&point);
            let width = |k: usize| if case.mask { source[k] } else { 1.0 + source[k] / 2.0 };
            let entry = serde_json::json!({"source": source, "target": [0.1, width(1), width(2)], "fitness": 0,
                "nrmsd": [0, 0, 0], "nrmsd_masked": [0, 0, 0], "evaluations": 0, "saturated": []});
            probe.entries.push(serde_json::from_value(entry).unwrap());
        }
        probe
    }

    #[test]
    fn the_path_leads_from_one_direction_through_isotropic_to_the_other() {
        for (case, is_quick) in [
            (&LAFORTUNE_TO_WARD, true),
            (&LAFORTUNE_TO_WARD, false),
            (&WARD_TO_GGX, true),
            (&WARD_TO_GGX, false),
        ] {
            let probe = probe(case, is_quick);
            let places = path(case, &probe, probe.source_axes.get(3).map(|axis| axis.nearest(128.0)));
            let widths: Vec<[f64; 2]> =
                places.iter().map(|k| [1, 2].map(|axis| probe.entries[*k].source[axis])).collect();
            let middle = widths[widths.len() / 2];
            assert!(widths.len() >= 3 && widths.len() % 2 == 1 && middle[0] == middle[1], "{widths:?}");
            for (one, other) in widths.iter().zip(widths.iter().rev()) {
                assert_eq!([one[0], one[1]], [other[1], other[0]], "{widths:?}");
            }
            let degree = |w: &[f64; 2]| (case.degree.1)(w[0], w[1]);
            assert!(widths.windows(2).all(|pair| degree(&pair[0]) < degree(&pair[1])), "{widths:?}");
        }
    }

    #[test]
    fn every_class_has_sources_and_the_law_is_seen_to_hold_and_to_break() {
        for case in [&LAFORTUNE_TO_WARD, &WARD_TO_GGX] {
            let mut probe = probe(case, false);
            let class = |entry: &lookmatch_remap::Entry| (case.classes.1)(&entry.source);
            for k in 0..case.classes.0.len() {
                assert!(probe.entries.iter().any(|entry| class(entry) == k), "{}", case.classes.0[k]);
            }
            let kept = |probe: &Probe| symmetry::Symmetry::of(probe).shares();
            assert_eq!(kept(&probe), [1.0, 1.0]);
            let odd = probe.entries.iter_mut().find(|entry| entry.source[1] < entry.source[2]).unwrap();
            odd.target[1] = 0.67;
            let [isotropic, exchanged] = kept(&probe);
            assert!(isotropic == 1.0 && exchanged < 1.0, "{exchanged}");
        }
    }
}
