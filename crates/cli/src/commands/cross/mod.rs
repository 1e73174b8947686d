//! `lookmatch cross`: probes between real renderers beside copied parameters, as a page with tables and pictures.
//!
//! The probes are searched with few samples in small pictures. They are judged in larger ones whose noise the search never saw.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::Context;
use lookmatch_imaging::{Image, jod, nrmsd, write as write_image, write_atomically};
use lookmatch_materials::Material;
use lookmatch_remap::{
    Baseline, CrossStage, Entry, Event, Options, Plan, Probe, Sampling, Side, remap_across,
};
use lookmatch_rendering::Illumination;
use serde::{Deserialize, Serialize};

use crate::Usage;
use crate::args::{CrossArgs, vary};
use crate::commands::{create_folder, interruption, remap};
use crate::output::{bar, print, print_json};
use crate::renderers::{Renderers, renderer_of};
use crate::report::sheet;
use crate::transport::{Preparation, cache};

mod page;

use page::{page, summary};

/// One remap of the page.
struct Pair {
    name: &'static str,
    from: &'static str,
    to: &'static str,
    /// Lattices as `remap --vary` has them: twelve sources, or four of a round trip.
    vary: &'static [&'static str],
    kind: Kind,
}

enum Kind {
    /// Models that differ; the material at this place is pictured.
    Models { pictured: Option<usize> },
    /// The same model in two renderers: the target's parameters are known.
    SameModel,
}

const PAIRS: &[Pair] = &[
    Pair {
        name: "roughplastic-principled",
        from: "mitsuba:roughplastic:diffuse_reflectance=0.6/0.25/0.1",
        to: "cycles:principled",
        vary: &["source.int_ior=1.3:1.9:0.3", "source.alpha=0.1:0.55:0.15"],
        kind: Kind::Models { pictured: Some(10) },
    },
    Pair {
        name: "principled-physical",
        from: "cycles:principled:base_color=0.1/0.25/0.6",
        to: "threejs:physical",
        vary: &["source.ior=1.3:1.9:0.3", "source.roughness=0.3:0.75:0.15"],
        kind: Kind::Models { pictured: Some(9) },
    },
    Pair {
        name: "plastic-roughplastic",
        from: "radiance:plastic:color=0.15/0.4/0.2",
        to: "mitsuba:roughplastic",
        vary: &["source.specularity=0.03:0.13:0.05", "source.roughness=0.1:0.4:0.1"],
        kind: Kind::Models { pictured: Some(9) },
    },
    Pair {
        name: "glossy2-principled",
        from: "luxcore:glossy2:kd=0.2/0.3/0.45",
        to: "mitsuba:principled",
        vary: &["source.ks=0.03:0.13:0.05", "source.uroughness=0.1:0.4:0.1"],
        kind: Kind::Models { pictured: None },
    },
    Pair {
        name: "physical-roughplastic",
        from: "threejs:physical:color=0.5/0.4/0.15",
        to: "mitsuba:roughplastic",
        vary: &["source.ior=1.3:1.9:0.3", "source.roughness=0.3:0.75:0.15"],
        kind: Kind::Models { pictured: None },
    },
    Pair {
        name: "ggx-mitsuba-cycles",
        from: "mitsuba:roughconductor:specular_reflectance=0.8",
        to: "cycles:glossy",
        vary: &["source.alpha=0.1:0.4:0.1", "target.color=0.7:0.9:0.02"],
        kind: Kind::SameModel,
    },
    Pair {
        name: "ggx-cycles-mitsuba",
        from: "cycles:glossy:color=0.8",
        to: "mitsuba:roughconductor",
        vary: &["source.roughness=0.3:0.6:0.1", "target.specular_reflectance=0.7:0.9:0.02"],
        kind: Kind::SameModel,
    },
    Pair {
        name: "beckmann-mitsuba-cycles",
        from: "mitsuba:roughconductor:specular_reflectance=0.8,distribution=beckmann",
        to: "cycles:glossy:distribution=BECKMANN",
        vary: &["source.alpha=0.1:0.4:0.1", "target.color=0.7:0.9:0.02"],
        kind: Kind::SameModel,
    },
    Pair {
        name: "beckmann-cycles-mitsuba",
        from: "cycles:glossy:color=0.8,distribution=BECKMANN",
        to: "mitsuba:roughconductor:distribution=beckmann",
        vary: &["source.roughness=0.3:0.6:0.1", "target.specular_reflectance=0.7:0.9:0.02"],
        kind: Kind::SameModel,
    },
];

/// Times as many samples where the target's parameters are known.
const FINER: u32 = 4;

/// Significant digits of parameters on the page.
const DIGITS: usize = 4;

/// Folder of the pictures and of the numbers, beside the page.
const FOLDER: &str = "cross-renderer";
/// Sides in pixels and samples of the pictures that judge, and of those for people.
const JUDGING: (usize, u32) = (96, 64);
const PICTURES: (usize, u32) = (192, 256);

/// All that is known: what decides the outcome, and the pairs that are done.
#[derive(Serialize, Deserialize)]
struct Run {
    program: String,
    size: usize,
    sampling: Sampling,
    seed: u64,
    pairs: Vec<Outcome>,
}

/// What came of a pair.
#[derive(Serialize, Deserialize)]
struct Outcome {
    name: String,
    from: String,
    to: String,
    renderers: Vec<Renderer>,
    /// Source points without a match.
    failed: usize,
    /// Matches that noise left undecided.
    undecided: usize,
    /// Seconds of the search, those spent waiting for renderers left out.
    own_s: f64,
    /// The target parameter that decides the width of the lobe, and the step of its lattice.
    width: Option<(String, f64)>,
    matches: Vec<Match>,
    picture: Option<Picture>,
}

#[derive(Serialize, Deserialize)]
struct Renderer {
    name: String,
    version: String,
    renders: usize,
    /// Seconds that the search waited for it.
    waited_s: f64,
    approximations: Vec<String>,
}

/// One material, its copy and its match.
#[derive(Serialize, Deserialize)]
struct Match {
    source: String,
    copy: String,
    probe: String,
    /// Target parameters on the edge of their range.
    saturated: Vec<String>,
    /// The value that decides the width of the lobe: of the copy and of the probe.
    width: Option<[f64; 2]>,
    nrmsd: Seen,
    jod: Seen,
}

/// Copy and probe beside the source, and what the noise of source and probe alone would make of two equal pictures.
#[derive(Serialize, Deserialize, Clone, Copy)]
struct Seen {
    copy: f64,
    probe: f64,
    noise: f64,
}

#[derive(Serialize, Deserialize)]
struct Picture {
    file: String,
    place: usize,
    /// The brightest difference of its error maps.
    scale: f32,
}

pub(crate) fn run(args: &CrossArgs) -> anyhow::Result<()> {
    let wanted = wanted(&args.pairs)?;
    let folder = args.output.join(FOLDER);
    create_folder(&folder)?;
    let stopped = interruption()?;
    let mut run = resumed(args, &folder);
    for pair in wanted {
        if run.pairs.iter().any(|outcome| outcome.name == pair.name) {
            continue;
        }
        let outcome = measured(pair, args, &folder, &stopped).with_context(|| pair.name.to_owned())?;
        let Seen { copy, probe, noise } = outcome.mean(|m| m.nrmsd);
        eprintln!("{}: NRMSD {copy:.4} of the copy, {probe:.4} of the probe, {noise:.4} of noise", pair.name);
        run.pairs.push(outcome);
        run.pairs.sort_by_key(|outcome| PAIRS.iter().position(|pair| pair.name == outcome.name));
        save(&folder, &run)?;
        write(&args.output.join("cross-renderer.md"), &page(&run))?;
    }
    write(&args.output.join("cross-renderer.md"), &page(&run))?;
    if args.json.json { print_json(&run) } else { print(&summary(&run)) }
}

/// The pairs of some names, or all.
fn wanted(names: &[String]) -> anyhow::Result<Vec<&'static Pair>> {
    let find = |name: &String| {
        let known = || PAIRS.iter().map(|pair| pair.name).collect::<Vec<_>>().join(", ");
        let found = PAIRS.iter().find(|pair| pair.name == name);
        Ok(found.ok_or_else(|| Usage(format!("pair '{name}' is unknown; there are {}", known())))?)
    };
    match names {
        [] => Ok(PAIRS.iter().collect()),
        names => names.iter().map(find).collect(),
    }
}

fn sampling(args: &CrossArgs) -> Sampling {
    Sampling { samples: args.samples, most: args.max_samples.max(args.samples) }
}

/// What an earlier run with the same options left.
fn resumed(args: &CrossArgs, folder: &Path) -> Run {
    let program = concat!("lookmatch ", env!("CARGO_PKG_VERSION")).to_owned();
    let new = Run { program, size: args.size, sampling: sampling(args), seed: args.seed, pairs: Vec::new() };
    let text = std::fs::read_to_string(folder.join("cross-renderer.json")).unwrap_or_default();
    let key = |run: &Run| (run.program.clone(), run.size, run.sampling, run.seed);
    serde_json::from_str::<Run>(&text).ok().filter(|old| key(old) == key(&new)).unwrap_or(new)
}

fn save(folder: &Path, run: &Run) -> anyhow::Result<()> {
    write(&folder.join("cross-renderer.json"), &(serde_json::to_string_pretty(run)? + "\n"))
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(write_atomically(path, |out| out.write_all(text.as_bytes()))?)
}

/// Searches a pair, judges it, and pictures it.
fn measured(
    pair: &Pair,
    args: &CrossArgs,
    folder: &Path,
    stopped: &Arc<AtomicBool>,
) -> anyhow::Result<Outcome> {
    let names: Vec<String> = [pair.from, pair.to].into_iter().filter_map(renderer_of).collect();
    let renderers = Renderers::start(&names, &args.renderers, stopped)?;
    let plan = plan(pair, args, &renderers)?;
    let stage = stage(&plan, &renderers)?;
    let progress = bar(plan.source_axes.iter().map(|axis| axis.len()).product(), pair.name);
    let mut observe = |event: Event| {
        if let Event::Point { done, .. } = event {
            progress.set_position(done as u64);
        }
    };
    let begun = Instant::now();
    let probe = remap_across(&plan, &stage, None, &mut observe, &|| stopped.load(Ordering::Relaxed))?;
    let seconds = begun.elapsed().as_secs_f64();
    progress.finish_and_clear();
    let counts = stage.counts();
    let waited: f64 = counts.iter().map(|(_, counts)| counts.waited.as_secs_f64()).sum();
    drop(stage);
    let used = |hello: &lookmatch_renderers::Hello| {
        let counts = counts.iter().find(|(name, _)| *name == hello.name).map(|(_, counts)| counts.clone());
        let counts = counts.unwrap_or_default();
        Renderer {
            name: hello.name.clone(),
            version: hello.version.clone(),
            // As many as it needs, whoever rendered them.
            renders: counts.renders + counts.found,
            waited_s: counts.waited.as_secs_f64(),
            approximations: hello.approximations.clone(),
        }
    };
    let judge = Judge::new(&plan, &probe, &renderers, JUDGING)?;
    let width = plan.target_axes.iter().find(|axis| judge.is_width(&axis.name));
    let width = width.map(|axis| (axis.name.clone(), axis.value(1) - axis.value(0)));
    let progress = bar(probe.found().count(), "judging");
    let judged = |entry| {
        anyhow::ensure!(!stopped.load(Ordering::Relaxed), "stopped; the same command goes on");
        progress.inc(1);
        judge.judged(entry, width.as_ref().map(|(name, _)| name.as_str()))
    };
    let matches = probe.found().map(judged).collect::<anyhow::Result<_>>()?;
    progress.finish_and_clear();
    drop(judge);
    let picture = match pair.kind {
        Kind::Models { pictured: Some(place) } => {
            let file = format!("{}.png", pair.name);
            let judge = Judge::new(&plan, &probe, &renderers, PICTURES)?;
            let scale = judge.pictured(place, &folder.join(&file))?;
            Some(Picture { file, place, scale })
        }
        _ => None,
    };
    Ok(Outcome {
        name: pair.name.into(),
        from: pair.from.into(),
        to: pair.to.into(),
        renderers: renderers.hellos().map(used).collect(),
        failed: probe.entries.len() - probe.found().count(),
        undecided: probe.found().filter(|e| e.noise.is_some_and(|noise| !noise.is_decided)).count(),
        own_s: seconds - waited,
        width,
        matches,
        picture,
    })
}

fn plan(pair: &Pair, args: &CrossArgs, renderers: &Renderers) -> anyhow::Result<Plan> {
    let (from, mut fix) = remap::endpoint(pair.from, Side::Source)?;
    let (to, of_target) = remap::endpoint(pair.to, Side::Target)?;
    fix.extend(of_target);
    let lattice = |text: &&str| vary(text).map_err(anyhow::Error::msg);
    // Where steps of the lattice are counted, noise must not decide them.
    let finer = if matches!(pair.kind, Kind::SameModel) { FINER } else { 1 };
    let Sampling { samples, most } = sampling(args);
    let options = Options {
        vary: pair.vary.iter().map(lattice).collect::<anyhow::Result<_>>()?,
        fix,
        seed: args.seed,
        size: Some(args.size),
        sampling: Sampling { samples, most: finer * most },
        renderers: renderers.records(&[from.model(), to.model()]),
        ..Options::default()
    };
    Ok(Plan::between(from, to, &options)?)
}

fn stage(plan: &Plan, renderers: &Renderers) -> anyhow::Result<CrossStage> {
    let preparation = Preparation::of("the reference scene");
    let stage = CrossStage::cached(plan, &renderers.studios(), &cache(), &|p| preparation.observe(p))?;
    preparation.finish();
    Ok(stage)
}

/// Looks at a probe's matches in pictures of another size and with other noise than the search had.
struct Judge<'a> {
    plan: Plan,
    probe: &'a Probe,
    stage: CrossStage,
    samples: u32,
}

impl<'a> Judge<'a> {
    fn new(
        plan: &Plan,
        probe: &'a Probe,
        renderers: &Renderers,
        (size, samples): (usize, u32),
    ) -> anyhow::Result<Self> {
        let plan = Plan { size, seed: plan.seed + 1, ..plan.clone() };
        let stage = stage(&plan, renderers)?;
        Ok(Self { plan, probe, stage, samples })
    }

    fn is_width(&self, name: &str) -> bool {
        self.plan.to.model().parameter(name).is_ok_and(|parameter| parameter.role.is_width())
    }

    /// Source, copy and probe.
    fn materials(&self, entry: &Entry) -> anyhow::Result<[Material; 3]> {
        let source = self.probe.source_material(&entry.source)?;
        let copy = Baseline::Copy.apply(&source, &self.plan.to)?.context("parameters cannot be copied")?;
        let probe = self.probe.target_material(&source, &entry.target, entry.body)?;
        Ok([source, copy, probe])
    }

    /// A picture, and an image of its noise.
    fn picture(&self, material: &Material) -> anyhow::Result<(Image, Option<Image>)> {
        Ok(self.stage.picture(material, Illumination::Environment, self.samples)?)
    }

    fn judged(&self, entry: &Entry, width: Option<&str>) -> anyhow::Result<Match> {
        let materials = self.materials(entry)?;
        let [source, copy, probe] = &materials;
        let [(seen, noise), (copied, _), (matched, noise_of_match)] =
            [self.picture(source)?, self.picture(copy)?, self.picture(probe)?];
        let noises = [noise, noise_of_match].into_iter().flatten();
        let noisy = noises.fold(seen.clone(), |image, noise| image.zipped(&noise, |a, b| a + b));
        let mean = |image: &Image| Ok(nrmsd(&seen, image, None)?.iter().sum::<f64>() / 3.0);
        let each = |measure: &dyn Fn(&Image) -> anyhow::Result<f64>| -> anyhow::Result<Seen> {
            Ok(Seen { copy: measure(&copied)?, probe: measure(&matched)?, noise: measure(&noisy)? })
        };
        let number = |name: &str| Ok::<_, anyhow::Error>([copy.number(name)?, probe.number(name)?]);
        Ok(Match {
            nrmsd: each(&mean)?,
            jod: each(&|image| Ok(jod(&seen, image)?))?,
            source: format!("{source:.DIGITS$}"),
            copy: format!("{copy:.DIGITS$}"),
            probe: format!("{probe:.DIGITS$}"),
            saturated: entry.saturated.clone(),
            width: width.map(number).transpose()?,
        })
    }

    /// Writes source, copy and probe side by side, with error maps; the answer is their scale.
    fn pictured(&self, place: usize, path: &Path) -> anyhow::Result<f32> {
        let entry = self.probe.found().nth(place).context("the pictured material has no match")?;
        let [source, copy, probe] = self.materials(entry)?;
        let images = [self.picture(&copy)?.0, self.picture(&probe)?.0];
        let (image, scale) =
            sheet(&self.picture(&source)?.0, &images, &self.plan.scene.mask(self.plan.size)?)?;
        write_image(path, &image, &[])?;
        Ok(scale)
    }
}

/// Differences of NRMSD below this share of the noise are none.
const TOLERANCE: f64 = 0.05;

impl Outcome {
    fn is_same_model(&self) -> bool {
        let pair = PAIRS.iter().find(|pair| pair.name == self.name);
        pair.is_some_and(|pair| matches!(pair.kind, Kind::SameModel))
    }

    /// Means over the materials.
    fn mean(&self, seen: fn(&Match) -> Seen) -> Seen {
        let mean = |value: fn(Seen) -> f64| {
            self.matches.iter().map(|m| value(seen(m))).sum::<f64>() / self.matches.len() as f64
        };
        Seen { copy: mean(|s| s.copy), probe: mean(|s| s.probe), noise: mean(|s| s.noise) }
    }

    /// Materials whose probe is better than, as good as, and worse than their copy.
    fn verdicts(&self) -> [usize; 3] {
        let mut counts = [0; 3];
        for Match { nrmsd: Seen { copy, probe, noise }, .. } in &self.matches {
            let margin = TOLERANCE * noise;
            counts[if probe + margin < *copy { 0 } else { 1 + usize::from(*probe > copy + margin) }] += 1;
        }
        counts
    }

    fn renders(&self) -> usize {
        self.renderers.iter().map(|renderer| renderer.renders).sum()
    }

    fn waited_s(&self) -> f64 {
        self.renderers.iter().map(|renderer| renderer.waited_s).sum()
    }

    /// How far widths are from those of the copy, in steps of the lattice, at worst.
    fn steps_off(&self) -> Option<f64> {
        let step = self.width.as_ref()?.1;
        let widths = self.matches.iter().filter_map(|m| m.width);
        Some(widths.map(|[exact, found]| (found - exact).abs() / step).fold(0.0, f64::max))
    }

    /// The largest NRMSD of a probe as a multiple of its noise.
    fn noises(&self) -> f64 {
        self.matches.iter().map(|m| m.nrmsd.probe / m.nrmsd.noise).fold(0.0, f64::max)
    }
}
