//! `lookmatch match`: from pictures of the reference scene, by whatever renderer, to the parameters of a model.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

use anyhow::{Context, bail};
use lookmatch_imaging::{Image, error_map, read, write, write_atomically};
use lookmatch_remap::{
    Assignment, CrossStage, Options, PictureCheck, PictureMatch, Pictures, Plan, Sampling, Side, Suspicion,
    Vary, check_pictures, match_pictures,
};
use lookmatch_rendering::Scene;
use serde_json::{Value as Json, json};

use crate::Usage;
use crate::args::MatchArgs;
use crate::commands::remap::endpoint;
use crate::commands::{create_folder, interruption};
use crate::output::{print, print_json, score, spinner, table};
use crate::renderers::{Renderers, renderer_of};
use crate::transport::{Preparation, cache};

/// Lights in the order of everything that is given for them.
const LIGHTS: [&str; 2] = ["point", "environment"];
/// Sides of pictures that can be compared: smaller ones show no highlight.
const SIZES: std::ops::RangeInclusive<usize> = 16..=2048;
/// What material.json may say: what is used, …
const USED: [&str; 4] = ["name", "diffuse", "base_color", "scene"];
/// … and what is kept for the record.
const KEPT: [&str; 8] =
    ["model", "renderer", "parameters", "roughness", "specular", "ior", "metallic", "notes"];

pub(crate) fn run(args: &MatchArgs) -> anyhow::Result<()> {
    let stopped = interruption()?;
    let facts = Facts::read(&args.images)?;
    let pictures = Pictures { albedo: facts.albedo, ..read_pictures(&args.images)? };
    let named: Vec<String> = renderer_of(&args.to).into_iter().collect();
    let renderers = Renderers::start(&named, &args.renderers, &stopped)?;
    let (to, mut fix) = endpoint(&args.to, Side::Target)?;
    fix.extend(args.fix.iter().map(of_target).collect::<Result<Vec<_>, Usage>>()?);
    let vary = args.vary.iter().map(|vary| {
        check_side(vary.side, &vary.name)?;
        Ok(Vary { side: Some(Side::Target), ..vary.clone() })
    });
    let options = Options {
        vary: vary.collect::<Result<_, Usage>>()?,
        fix,
        seed: args.seed,
        mask: args.mask,
        size: Some(pictures.size()),
        sampling: Sampling { samples: args.samples, most: args.max_samples.max(args.samples) },
        renderers: renderers.records(&[to.model()]),
        ..Options::default()
    };
    let plan = Plan::from_pictures(to, facts.scene.clone(), &options)?;
    create_folder(&args.output)?;
    let started = Instant::now();
    let preparation = Preparation::of("the reference scene");
    let observe = |progress| preparation.observe(progress);
    let stage = CrossStage::for_pictures(&plan, &pictures, &renderers.studios(), &cache(), &observe)?;
    preparation.finish();
    let checks = check_pictures(&plan, &stage, &pictures)?;
    refuse_turned(&checks)?;
    checks.iter().for_each(warn);
    let progress = spinner("matching");
    let found = match_pictures(&plan, &stage, &pictures, &|| stopped.load(Ordering::Relaxed));
    progress.finish_and_clear();
    let found = found?;
    let scales = write_pictures(&args.output, &pictures, &found)?;
    let used = used(&pictures);
    let renderings: Vec<Json> = stage
        .counts()
        .into_iter()
        .map(|(name, counts)| json!({"name": name, "renders": counts.renders, "found": counts.found, "failed": counts.failed}))
        .collect();
    let parameters: BTreeMap<&str, f64> =
        plan.target_axes.iter().map(|axis| axis.name.as_str()).zip(found.values.iter().copied()).collect();
    let result = json!({
        "source": facts.json, "images": args.images, "target": found.target, "spec": found.target.to_string(),
        "searched": parameters, "saturated": found.saturated, "fitness": found.fitness,
        "fitness_of": if pictures.has_diffuse() { "diffuse and specular pictures" } else { "full pictures" },
        "nrmsd": found.nrmsd[0], "nrmsd_of_noise": found.noise, "nrmsd_masked": found.nrmsd[1], "nrmsd_light": LIGHTS[main_light(&pictures)],
        "albedo": found.albedo, "tint": found.tint, "compared": found.compared,
        "is_decided": found.is_decided, "used": used, "checks": checks.iter().map(check_json).collect::<Vec<_>>(),
        "error_scales": scales, "scene": plan.scene.name, "size": plan.size, "mask": plan.mask,
        "seed": plan.seed, "renderers": renderings, "seconds": started.elapsed().as_secs_f64(),
    });
    let text = serde_json::to_string_pretty(&result)?;
    write_atomically(&args.output.join("result.json"), |out| out.write_all(text.as_bytes()))?;
    eprint!("{}", summary(&facts, &pictures, &found, &used));
    eprintln!(
        "{:.1} s; pictures and result.json in {}",
        started.elapsed().as_secs_f64(),
        args.output.display()
    );
    match args.json.json {
        true => print_json(&result),
        false => print(&format!("{}\n", found.target)),
    }
}

fn check_side(side: Option<Side>, name: &str) -> Result<(), Usage> {
    match side {
        Some(Side::Source) => {
            Err(Usage(format!("'source.{name}': pictures have no parameters; only the target's can be set")))
        }
        _ => Ok(()),
    }
}

fn of_target(fix: &Assignment) -> Result<Assignment, Usage> {
    check_side(fix.side, &fix.name)?;
    Ok(Assignment { side: Some(Side::Target), ..fix.clone() })
}

/// What material.json says.
struct Facts {
    json: Json,
    name: String,
    albedo: Option<[f64; 3]>,
    scene: Scene,
}

impl Facts {
    fn read(folder: &Path) -> anyhow::Result<Self> {
        if !folder.is_dir() {
            bail!("there is no folder '{}'", folder.display());
        }
        let path = folder.join("material.json");
        let json = match path.is_file() {
            true => {
                let text = std::fs::read_to_string(&path)
                    .with_context(|| format!("cannot read '{}'", path.display()))?;
                serde_json::from_str(&text).with_context(|| format!("'{}' is no JSON", path.display()))?
            }
            false => json!({}),
        };
        Self::of(json, folder).with_context(|| format!("'{}'", path.display()))
    }

    fn of(json: Json, folder: &Path) -> anyhow::Result<Self> {
        let fields = json.as_object().context("expected an object, as {\"diffuse\": [0.5, 0.2, 0.1]}")?;
        if let Some(unknown) = fields.keys().find(|key| !USED.iter().chain(&KEPT).any(|known| known == key)) {
            let (used, kept) = (USED.join(", "), KEPT.join(", "));
            bail!("'{unknown}' is unknown; used are {used}; kept for the record are {kept}");
        }
        let text = |key: &str| match fields.get(key) {
            None => Ok(None),
            Some(Json::String(text)) => Ok(Some(text.clone())),
            Some(other) => bail!("'{key}' is {other}; a text is expected"),
        };
        let albedo = match [fields.get("diffuse"), fields.get("base_color")] {
            [Some(_), Some(_)] => bail!("'diffuse' and 'base_color' say the same; give one of them"),
            [diffuse, base] => diffuse.or(base).map(colour).transpose()?,
        };
        let scene = match text("scene")? {
            None => Scene::reference(),
            Some(name) => {
                let beside = folder.join(&name);
                let name = if beside.is_file() { beside.to_string_lossy().into_owned() } else { name };
                let scene = Scene::load(&name)?;
                if scene.spheres.iter().any(|sphere| sphere.diffuse.is_some()) {
                    bail!("scene '{name}' has spheres with colours of their own; all must wear the material");
                }
                scene
            }
        };
        let name = text("name")?.unwrap_or_else(|| folder.display().to_string());
        Ok(Self { name, albedo, scene, json })
    }
}

fn colour(value: &Json) -> anyhow::Result<[f64; 3]> {
    let wrong = || format!("the colour is {value}; a number or three, each 0 to 1, linear, are expected");
    let numbers: Vec<f64> = match value {
        Json::Array(list) => list.iter().filter_map(Json::as_f64).collect(),
        other => vec![other.as_f64().with_context(wrong)?; 3],
    };
    let colour: [f64; 3] = numbers.try_into().ok().with_context(wrong)?;
    if !colour.iter().all(|v| (0.0..=1.0).contains(v)) {
        bail!(wrong());
    }
    Ok(colour)
}

/// The pictures of a folder, checked against each other.
fn read_pictures(folder: &Path) -> anyhow::Result<Pictures> {
    let [full, diffuse] =
        ["full", "diffuse"].map(|part| LIGHTS.map(|light| picture_path(folder, part, light)));
    let is_there = |paths: &[PathBuf; 2]| [paths[0].is_file(), paths[1].is_file()];
    let (has_full, has_diffuse) = (is_there(&full), is_there(&diffuse));
    if has_full == [false; 2] {
        bail!(
            "'{}' has neither full_point.exr nor full_environment.exr; {}",
            folder.display(),
            listing(folder)
        );
    }
    for light in 0..2 {
        if has_diffuse[light] && !has_full[light] {
            bail!("'{}' is there, but '{}' is not", diffuse[light].display(), full[light].display());
        }
        if has_diffuse != [false; 2] && has_full[light] && !has_diffuse[light] {
            bail!("'{}' is missing: give diffuse pictures for all lights, or none", diffuse[light].display());
        }
    }
    let read_there = |paths: &[PathBuf; 2], there: [bool; 2]| -> anyhow::Result<[Option<Image>; 2]> {
        let one = |k: usize| there[k].then(|| read_picture(&paths[k])).transpose();
        Ok([one(0)?, one(1)?])
    };
    let pictures = Pictures {
        full: read_there(&full, has_full)?,
        diffuse: read_there(&diffuse, has_diffuse)?,
        albedo: None,
    };
    let paths = full.iter().chain(&diffuse);
    let mut sizes =
        paths.zip(pictures.full.iter().chain(&pictures.diffuse)).filter_map(|(p, i)| Some((p, i.as_ref()?)));
    if let Some((first, image)) = sizes.next() {
        for (path, other) in sizes {
            if image.width() != other.width() {
                bail!(
                    "'{}' has {} pixels a side and '{}' {}: all pictures must have one size",
                    first.display(),
                    image.width(),
                    path.display(),
                    other.width()
                );
            }
        }
    }
    Ok(pictures)
}

fn picture_path(folder: &Path, part: &str, light: &str) -> PathBuf {
    folder.join(format!("{part}_{light}.exr"))
}

fn read_picture(path: &Path) -> anyhow::Result<Image> {
    let image = read(path)?;
    let (width, height) = (image.width(), image.height());
    if width != height {
        bail!("'{}' has {width} x {height} pixels; the scene's pictures are square", path.display());
    }
    if !SIZES.contains(&width) {
        bail!("'{}' has {width} pixels a side; {SIZES:?} can be compared", path.display());
    }
    if image.pixels().as_flattened().iter().all(|v| *v <= 0.0) {
        bail!("'{}' is black", path.display());
    }
    Ok(image)
}

/// What a folder has instead.
fn listing(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    let rest = names.len().saturating_sub(8);
    names.truncate(8);
    match (names.is_empty(), rest) {
        (true, _) => "it is empty".into(),
        (_, 0) => format!("it has {}", names.join(", ")),
        (_, rest) => format!("it has {} and {rest} more", names.join(", ")),
    }
}

fn file_of(check: &PictureCheck) -> String {
    format!("{}_{}.exr", check.part, LIGHTS[check.light])
}

/// Refuses pictures whose pixels lie elsewhere.
fn refuse_turned(checks: &[PictureCheck]) -> anyhow::Result<()> {
    for check in checks {
        let file = file_of(check);
        if check.suspicions.contains(&Suspicion::UpsideDown) {
            bail!(
                "{file} is upside down: its checkerboard fits ours with the rows reversed; row 0 is on top"
            );
        }
        if check.suspicions.contains(&Suspicion::Mirrored) {
            bail!("{file} is mirrored: its checkerboard fits ours with the columns reversed");
        }
    }
    Ok(())
}

fn warn(check: &PictureCheck) {
    let see = "README.txt of `lookmatch scene export` says what is expected";
    for suspicion in &check.suspicions {
        let text = match suspicion {
            Suspicion::Clipped { share } => format!(
                "has no value above 1 and {:.1} % exactly 1: it looks clipped or tone-mapped; {see}",
                100.0 * share
            ),
            Suspicion::Curved { exponent } => format!(
                "its background is ours to the power of {exponent:.2}: it looks gamma-encoded, not linear; {see}"
            ),
            Suspicion::Exposed { factor } => format!(
                "its background is {factor:.3} times as bright as ours: it looks exposed, or the light has \
                 another unit; {see}"
            ),
            Suspicion::Different { share } => {
                format!("its background differs from ours by {:.0} %: another scene? {see}", 100.0 * share)
            }
            Suspicion::UpsideDown | Suspicion::Mirrored => continue,
        };
        eprintln!("warning: {}: {text}", file_of(check));
    }
}

fn check_json(check: &PictureCheck) -> Json {
    json!({"file": file_of(check), "background": check.background, "noise": check.noise, "suspicions": check.suspicions})
}

fn main_light(pictures: &Pictures) -> usize {
    usize::from(pictures.full[1].is_some())
}

/// What the match rests on, in words.
fn used(pictures: &Pictures) -> Vec<String> {
    let mut used = Vec::new();
    for (part, images) in [("full", &pictures.full), ("diffuse", &pictures.diffuse)] {
        let there = LIGHTS.iter().zip(images).filter(|(_, image)| image.is_some());
        used.extend(there.map(|(light, _)| format!("{part}_{light}.exr")));
    }
    if pictures.albedo.is_some() {
        used.push("the body's colour from material.json".into());
    }
    used
}

/// Source, match and error map of each light; the answer is what the brightest error stands for.
fn write_pictures(
    folder: &Path,
    pictures: &Pictures,
    found: &PictureMatch,
) -> anyhow::Result<BTreeMap<&'static str, f32>> {
    let notes = [("lookmatch:material".to_owned(), found.target.to_string())];
    let mut scales = BTreeMap::new();
    for (k, light) in LIGHTS.into_iter().enumerate() {
        let Some((source, target)) = pictures.full[k].as_ref().zip(found.pictures[k].as_ref()) else {
            continue;
        };
        let (map, scale) = error_map(source, target, None)?;
        let strip = Image::beside(&[source, target, &map]);
        write(&folder.join(format!("match_{light}.exr")), target, &notes)?;
        write(&folder.join(format!("side-by-side_{light}.exr")), &strip, &notes)?;
        write(&folder.join(format!("side-by-side_{light}.png")), &strip, &notes)?;
        scales.insert(light, scale);
    }
    Ok(scales)
}

/// The numbers, for people.
fn summary(facts: &Facts, pictures: &Pictures, found: &PictureMatch, used: &[String]) -> String {
    let row = |name: String, v: [f64; 3]| std::iter::once(name).chain(v.map(score)).collect();
    let header = ["NRMSD", "red", "green", "blue"].map(str::to_owned).to_vec();
    let light = LIGHTS[main_light(pictures)];
    let [whole, masked] = found.nrmsd;
    let mut text = format!("{}: from {}\n", facts.name, used.join(", "));
    let named_rows = [
        header,
        row(format!("full_{light}.exr, whole image"), whole),
        row(format!("full_{light}.exr, masked"), masked),
    ];
    let noise = (found.noise != [0.0; 3]).then(|| row("noise of the match alone".into(), found.noise));
    let rows: Vec<Vec<String>> = named_rows.into_iter().chain(noise).collect();
    for (k, light) in LIGHTS.iter().enumerate().filter(|(k, _)| pictures.full[*k].is_none()) {
        text += &format!("note: no full_{light}.exr: {} alone decides\n", LIGHTS[1 - k]);
    }
    if !pictures.has_diffuse() {
        let body = match (found.albedo, pictures.albedo) {
            (None, _) => "the target has no body of a free colour",
            (Some(_), Some(_)) => "the body's colour is the given one",
            (Some(_), None) => "the body's colour was fitted",
        };
        text += &format!("note: no diffuse pictures: full pictures were compared; {body}\n");
    }
    text += &table(&rows);
    text += &format!("fitness {}, {} candidates\n", score(found.fitness), found.compared);
    if let Some(albedo) = found.albedo {
        text += &format!("albedo of the body {}\n", albedo.map(score).join(" "));
    }
    if let Some(tint) = found.tint.filter(|tint| *tint != [1.0; 3]) {
        text += &format!("hue of the highlights {}\n", tint.map(score).join(" "));
    }
    for name in &found.saturated {
        text += &format!("note: {name} sits on the edge of the range that was searched; see --vary\n");
    }
    if !found.is_decided {
        text += "note: neighbouring candidates are as good within noise; see --max-samples\n";
    }
    text
}
