//! The command line.

use std::path::PathBuf;

use bytesize::ByteSize;
use clap::{Args, Parser, Subcommand, ValueEnum};
use lookmatch_materials::Levels;
use lookmatch_remap::{Assignment, Pair, Side, Vary};

mod probes;

pub(crate) use probes::*;

/// Finds the parameters of one material model that look like those of another.
#[derive(Parser)]
#[command(version, about, max_term_width = 100)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// List the material models and their parameters
    Models(ModelsArgs),
    /// Evaluate BRDFs at the points of a conformance file
    Eval(EvalArgs),
    /// Render a material in a scene
    Render(RenderArgs),
    /// List other renderers, install, remove or check them
    Renderers(RenderersArgs),
    /// Find the probe that maps one model to another
    Remap(RemapArgs),
    /// Map every model to every other, and compare each probe with copied parameters
    Pairs(PairsArgs),
    /// Map models of real renderers to each other, and judge each probe beside copied parameters
    Cross(CrossArgs),
    /// Map one material through a probe
    Apply(ApplyArgs),
    /// Say what is in a probe, or draw it
    Inspect(InspectArgs),
    /// Turn a probe's table into smooth functions, and say what they leave
    Fit(FitArgs),
    /// Turn a probe round: from its target to its source
    Invert(InvertArgs),
    /// Make one probe of two: A to B, then B to C
    Compose(ComposeArgs),
    /// Write a probe as a shader, a node graph, a look-up table or a script
    Export(ExportArgs),
    /// Measure the difference of two materials, rendered side by side, or of two pictures, and say whether anybody would see it
    Compare(CompareArgs),
    /// Judge a probe in a scene that its search never saw
    Validate(ValidateArgs),
    /// Run the paper's experiments, and write a report with its figures beside ours
    Reproduce(ReproduceArgs),
    /// Measure speed and accuracy on this machine, alone or beside another renderer
    Bench(BenchArgs),
    /// List, verify or shrink the database of other renderers' pictures
    Cache(CacheArgs),
    /// Write a scene for another renderer
    Scene(SceneArgs),
    /// Find mistakes in a material's numbers: gloss for roughness, sRGB for linear, F0 for an index, ...
    Lint(LintArgs),
    /// Find the parameters of a model that look like pictures of the reference scene, by whatever renderer
    Match(MatchArgs),
}

#[derive(Args)]
pub(crate) struct Json {
    /// Print one JSON document to standard output
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct RenderersArgs {
    #[command(subcommand)]
    pub(crate) command: Option<RenderersCommand>,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Subcommand)]
pub(crate) enum RenderersCommand {
    /// Install renderers, each into a private environment of its own
    Install {
        /// Names from the list
        #[arg(required = true, value_name = "NAME")]
        names: Vec<String>,
    },
    /// Remove installed renderers
    Remove {
        /// Names from the list
        #[arg(required = true, value_name = "NAME")]
        names: Vec<String>,
    },
    /// Say what a renderer gets wrong, with pictures: for authors of workers
    Check(CheckArgs),
}

#[derive(Args)]
pub(crate) struct CheckArgs {
    /// An installed renderer, or a worker's command line: anything with a space or a path
    #[arg(value_name = "NAME|COMMAND")]
    pub(crate) renderer: String,
    /// Folder for pictures (what came, what was expected, their difference), report.txt and result.json
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Samples per pixel
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(4..))]
    pub(crate) samples: u32,
    /// Side of the pictures in pixels
    #[arg(long, default_value_t = 96, value_parser = clap::value_parser!(u32).range(32..=1024))]
    pub(crate) size: u32,
    /// Only these checks, separated by commas
    #[arg(long, value_name = "CHECK", value_delimiter = ',')]
    pub(crate) only: Vec<String>,
    /// Seconds that the worker may stay silent
    #[arg(long, value_name = "SECONDS", default_value_t = 600, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) time_limit: u64,
    /// A file that the worker's own messages are appended to
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) json: Json,
}

/// How other renderers are run, for commands that name models of theirs: RENDERER:MODEL.
#[derive(Args)]
pub(crate) struct RendererArgs {
    /// Start a renderer by a command of your own instead of the installed one; any name will do
    #[arg(long, value_name = "NAME=COMMAND", value_parser = renderer_command)]
    pub(crate) start: Vec<(String, String)>,
    /// Worker processes per renderer; one where it uses all cores itself, else as many as there are cores
    #[arg(long, value_name = "NUMBER")]
    pub(crate) workers: Option<usize>,
    /// Seconds that a renderer may stay silent before it is started anew
    #[arg(long, value_name = "SECONDS", default_value_t = 600, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) time_limit: u64,
    /// A file that the renderers' own messages are appended to
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<PathBuf>,
}

#[derive(Args)]
pub(crate) struct ModelsArgs {
    /// Only this model, with its presets; RENDERER:MODEL for one of another renderer, RENDERER: for all of them
    pub(crate) model: Option<String>,
    /// Print the catalogue as Markdown: docs/models.md
    #[arg(long, conflicts_with_all = ["json", "model"])]
    pub(crate) markdown: bool,
    #[command(flatten)]
    pub(crate) renderers: RendererArgs,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct EvalArgs {
    /// File of vectors: an object with a list `brdf` of {id, model, params, wi, wo}
    pub(crate) vectors: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct RenderArgs {
    /// reference, spheres, blobs, checker-wall, spot, shader-ball, or a scene file (.toml)
    pub(crate) scene: String,
    /// MODEL:NAME=VALUE,..., JSON, or a .json file
    #[arg(short, long)]
    pub(crate) material: String,
    /// point, env, env:FILE (.exr, .hdr), or all
    #[arg(short, long, default_value = "all")]
    pub(crate) light: String,
    /// Side of the picture in pixels
    #[arg(short, long, default_value_t = 300)]
    pub(crate) size: usize,
    /// Leave the specular lobe out; of RENDERER:MODEL, show what a black body takes away
    #[arg(long)]
    pub(crate) diffuse_only: bool,
    /// transport (fast, without noise, spheres alone; the default) or path (slow, exact, spheres and meshes)
    #[arg(long)]
    pub(crate) renderer: Option<String>,
    /// Samples per pixel of the path renderer, or of another renderer
    #[arg(long, default_value_t = 256)]
    pub(crate) samples: u32,
    /// Seed of the path renderer, or of another renderer: other seeds give other noise
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) renderers: RendererArgs,
    /// The picture: .exr (linear, exact) or .png (8 bit sRGB)
    #[arg(short, long)]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum StrategyName {
    /// Corresponding parameters grow together; searches start from their neighbours' results
    Constrained,
    /// Every source point on its own
    Unconstrained,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum PresetName {
    /// The paper's plausible ranges (index of refraction up to 1.85)
    Paper,
}

#[derive(Args)]
pub(crate) struct RemapArgs {
    /// Source model, with fixed values if wanted: ward, ward:variant=duer; or one material: low-abc@chrome
    pub(crate) from: String,
    /// Target model, with fixed values if wanted: ggx, ggx:masking=correlated
    pub(crate) to: String,
    /// How the results of neighbouring source points are used
    #[arg(long, value_enum, default_value = "constrained")]
    pub(crate) strategy: StrategyName,
    /// synthesis (fewest renders), survey, genetic, cma-es, exhaustive, synthesis-half-rate, genetic-guarnera2018,
    /// genetic-deep2009, or auto: genetic, and survey where the target is a model of another renderer
    #[arg(long, default_value = "auto")]
    pub(crate) search: String,
    /// Lattice of a parameter; without `source.` or `target.` before the name, the source's if it has one
    #[arg(long, value_name = "NAME=MIN:MAX:STEP", value_parser = vary)]
    pub(crate) vary: Vec<Vary>,
    /// Hold a parameter at a value; the name as in --vary
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    pub(crate) fix: Vec<Assignment>,
    /// Which target parameters follow a source parameter in a constrained remap, instead of those that roles pair with it:
    /// roughness=roughness, gloss=-roughness (it falls), specular=ior,specular, or specular= (nothing follows)
    #[arg(long, value_name = "SOURCE=TARGET", value_parser = pair)]
    pub(crate) pair: Vec<Pair>,
    /// Polish each result between the levels of the lattice; it never ends worse
    #[arg(long)]
    pub(crate) refine: bool,
    /// Target ranges, instead of those that the source needs
    #[arg(long, value_enum)]
    pub(crate) preset: Option<PresetName>,
    /// Seed of all random decisions
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Weight the middle of the sphere more than its silhouette (for models with and without Fresnel effect)
    #[arg(long)]
    pub(crate) mask: bool,
    /// Side of the reference pictures in pixels; 300, or 128 with --quick
    #[arg(long)]
    pub(crate) size: Option<usize>,
    /// Few source points and small pictures: a probe in seconds
    #[arg(long)]
    pub(crate) quick: bool,
    /// Samples per pixel of other renderers' pictures
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) samples: u32,
    /// Samples per pixel up to which they are refined where noise leaves open what is best; four times --samples, but with
    /// --quick no more than these
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) max_samples: Option<u32>,
    #[command(flatten)]
    pub(crate) renderers: RendererArgs,
    /// Write tables and side-by-side pictures to this folder; where both models are our own, validate, and note in the probe what
    /// anybody would see
    #[arg(long, value_name = "FOLDER")]
    pub(crate) report: Option<PathBuf>,
    /// The probe file
    #[arg(short, long)]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct PairsArgs {
    /// Only these models, as sources and as targets; all if not given
    #[arg(value_name = "MODEL")]
    pub(crate) models: Vec<String>,
    /// Side of the reference pictures in pixels
    #[arg(long, default_value_t = 64)]
    pub(crate) size: usize,
    /// Seed of all random decisions
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Weight the middle of the sphere more than its silhouette
    #[arg(long)]
    pub(crate) mask: bool,
    /// Folder for pairs.md, pairs.svg and pairs.json; a run that was stopped goes on from the last
    #[arg(short, long)]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct CrossArgs {
    /// Only these pairs; all if not given, for which mitsuba, cycles, luxcore, radiance and threejs must be installed
    #[arg(value_name = "PAIR")]
    pub(crate) pairs: Vec<String>,
    /// Side of the pictures of the search in pixels
    #[arg(long, default_value_t = 64)]
    pub(crate) size: usize,
    /// Samples per pixel of the pictures of the search
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) samples: u32,
    /// Samples per pixel up to which they are refined where noise leaves open what is best
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) max_samples: u32,
    /// Seed of all random decisions
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) renderers: RendererArgs,
    /// Folder for cross-renderer.md and its pictures; a run that was stopped goes on from the last pair
    #[arg(short, long)]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct CompareArgs {
    /// Two pictures (.exr, .hdr) instead of materials: what it should look like, and what should look like it
    #[arg(num_args = 2, value_names = ["SOURCE", "TARGET"], conflicts_with_all = ["source", "target", "scene", "light", "size", "samples"])]
    pub(crate) pictures: Vec<PathBuf>,
    /// What counts of the pictures: disc (the largest in their middle), CX,CY,R (a disc, in pixels), or a picture (.exr, .hdr; white counts
    /// in full). Discs fade outwards, as the paper's mask does
    #[arg(long)]
    pub(crate) mask: Option<String>,
    /// The material to look like
    #[arg(long, required_unless_present = "pictures")]
    pub(crate) source: Option<String>,
    /// The material that should look like it
    #[arg(long, required_unless_present = "pictures")]
    pub(crate) target: Option<String>,
    /// reference, spheres, or a scene file (.toml)
    #[arg(long, default_value = "spheres")]
    pub(crate) scene: String,
    /// point, env, env:FILE (.exr, .hdr), or all
    #[arg(long, default_value = "all")]
    pub(crate) light: String,
    /// Side of the pictures in pixels
    #[arg(long, default_value_t = 300)]
    pub(crate) size: usize,
    /// Samples per pixel of other renderers' pictures, in two halves that tell their noise
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) samples: u32,
    #[command(flatten)]
    pub(crate) renderers: RendererArgs,
    /// Folder for the pictures and the numbers
    #[arg(short, long, required_unless_present = "pictures")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct ReproduceArgs {
    /// An experiment, or all; without one, they are listed
    pub(crate) name: Option<String>,
    /// Everything small: fewer materials, smaller pictures
    #[arg(long)]
    pub(crate) quick: bool,
    /// Seed of all random decisions
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Folder of the report; a run that was stopped goes on where it was
    #[arg(short, long, default_value = "report")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct ValidateArgs {
    /// The probe file
    pub(crate) probe: PathBuf,
    /// Environment map instead of the shipped one (.exr, .hdr); may be repeated
    #[arg(long, value_name = "FILE")]
    pub(crate) light: Vec<String>,
    /// Number of source points, evenly spread; all of the probe's if not given
    #[arg(long)]
    pub(crate) points: Option<usize>,
    /// Number of them, evenly spread, that are also judged by the metrics of the eye, which take a quarter of a second a pair: a
    /// number, or all
    #[arg(long, value_name = "COUNT", default_value = "48", value_parser = metric_points)]
    pub(crate) metric_points: usize,
    /// Write the verdict (would anybody see it?) at the source points into the probe, instead of those that it has: at up to 400 of
    /// them, evenly spread, or at all that --points gives; `inspect --plot` draws it
    #[arg(long)]
    pub(crate) write: bool,
    /// Side of the pictures in pixels
    #[arg(long, default_value_t = 300)]
    pub(crate) size: usize,
    /// Also write the result as JSON
    #[arg(short, long)]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum PeerName {
    /// Mitsuba 3, from the Python package index
    Mitsuba,
}

#[derive(Args)]
pub(crate) struct BenchArgs {
    /// Also measure another renderer at equal error; it is installed on first use
    #[arg(long, value_enum)]
    pub(crate) peer: Option<PeerName>,
    /// Folder for renderers that the peer is installed in, instead of that of `lookmatch renderers`
    #[arg(long, value_name = "FOLDER", requires = "peer")]
    pub(crate) peer_folder: Option<PathBuf>,
    /// Paths per pixel of each of the two converged pictures that errors are measured against
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) samples: Option<u32>,
    /// Tiny pictures and few paths: shows in seconds that everything works; its figures mean nothing
    #[arg(long)]
    pub(crate) quick: bool,
    /// Also write the tables to this file, as Markdown
    #[arg(short, long)]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) json: Json,
}

fn renderer_command(text: &str) -> Result<(String, String), String> {
    let (name, command) = text.split_once('=').ok_or("expected NAME=COMMAND")?;
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if name.is_empty() || !name.chars().all(is_plain) {
        return Err(format!("the name '{name}' may have lower case letters, digits and hyphens"));
    }
    Ok((name.to_owned(), command.to_owned()))
}

fn metric_points(text: &str) -> Result<usize, String> {
    match text {
        "all" => Ok(usize::MAX),
        _ => text.parse().map_err(|_| "expected a number of points, 0 for none, or all".to_owned()),
    }
}

/// Splits `source.name` or `target.name` from its side.
fn side(name: &str) -> (Option<Side>, String) {
    match name.split_once('.') {
        Some(("source", rest)) => (Some(Side::Source), rest.to_owned()),
        Some(("target", rest)) => (Some(Side::Target), rest.to_owned()),
        _ => (None, name.to_owned()),
    }
}

/// Reads `NAME=MIN:MAX:STEP`.
pub(crate) fn vary(text: &str) -> Result<Vary, String> {
    let wrong = || "expected NAME=MIN:MAX:STEP with three numbers".to_owned();
    let (name, lattice) = text.split_once('=').ok_or_else(wrong)?;
    let numbers: Vec<f64> =
        lattice.split(':').map(|n| n.trim().parse().map_err(|_| wrong())).collect::<Result<_, _>>()?;
    let [min, max, step] = numbers[..] else { return Err(wrong()) };
    let (side, name) = side(name.trim());
    Ok(Vary { side, name, levels: Levels::new(min, max, step) })
}

/// Reads `SOURCE=TARGET,TARGET`.
fn pair(text: &str) -> Result<Pair, String> {
    let (source, targets) = text.split_once('=').ok_or("expected SOURCE=TARGET")?;
    let targets = targets.split(',').map(str::trim).filter(|name| !name.is_empty());
    Ok(Pair { source: source.trim().to_owned(), targets: targets.map(str::to_owned).collect() })
}

fn assignment(text: &str) -> Result<Assignment, String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let (side, name) = side(name.trim());
    Ok(Assignment { side, name, value: value.trim().to_owned() })
}

#[derive(Args)]
pub(crate) struct CacheArgs {
    #[command(subcommand)]
    pub(crate) command: CacheCommand,
}

#[derive(Subcommand)]
pub(crate) enum CacheCommand {
    /// Say what is kept, by renderer and scene
    List {
        #[command(flatten)]
        json: Json,
    },
    /// Check every picture; damaged ones are removed, and rendered again when they are needed
    Verify {
        #[command(flatten)]
        json: Json,
    },
    /// Remove the pictures that were not used for longest
    Gc {
        /// Bytes that the database may have: 500MB, 2GiB
        #[arg(long, value_name = "SIZE", value_parser = byte_size)]
        max_size: ByteSize,
        #[command(flatten)]
        json: Json,
    },
}

fn byte_size(text: &str) -> Result<ByteSize, String> {
    text.parse().map_err(|_| "expected bytes with or without a unit: 500MB, 1.5GiB, 1000000".to_owned())
}

#[derive(Args)]
pub(crate) struct SceneArgs {
    #[command(subcommand)]
    pub(crate) command: SceneCommand,
}

#[derive(Subcommand)]
pub(crate) enum SceneCommand {
    /// Write a scene so that any renderer can make the pictures that `match` reads
    Export(SceneExportArgs),
}

#[derive(Args)]
pub(crate) struct SceneExportArgs {
    /// reference, spheres, or a scene file (.toml)
    #[arg(default_value = "reference")]
    pub(crate) scene: String,
    /// obj+exr, mitsuba, blender, usd or gltf
    #[arg(long, value_name = "FORMAT")]
    pub(crate) to: String,
    /// Side of the pictures in pixels
    #[arg(long, default_value_t = 300)]
    pub(crate) size: usize,
    /// Folder for the files; made if it does not exist
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct LintArgs {
    /// MODEL:NAME=VALUE,..., JSON, or a .json file; values may be out of range
    pub(crate) material: String,
    /// A material that it is meant to look like: what explains the difference is rendered
    #[arg(long, value_name = "MATERIAL")]
    pub(crate) like: Option<String>,
    /// Side of the pictures that are compared, in pixels
    #[arg(long, default_value_t = 64, requires = "like")]
    pub(crate) size: usize,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct MatchArgs {
    /// Folder with full_point.exr, full_environment.exr, and perhaps diffuse_point.exr, diffuse_environment.exr, material.json
    pub(crate) images: PathBuf,
    /// The model to search, with fixed values if wanted: ggx, gltf:metallic=1, mitsuba:roughplastic
    #[arg(long, value_name = "MODEL")]
    pub(crate) to: String,
    /// Lattice of one of its parameters
    #[arg(long, value_name = "NAME=MIN:MAX:STEP", value_parser = vary)]
    pub(crate) vary: Vec<Vary>,
    /// Hold one of its parameters at a value
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    pub(crate) fix: Vec<Assignment>,
    /// Weight the middle of the sphere more than its silhouette
    #[arg(long)]
    pub(crate) mask: bool,
    /// Seed of all random decisions
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Samples per pixel of another renderer's pictures
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) samples: u32,
    /// Samples per pixel up to which they are refined where noise leaves open what is best
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) max_samples: u32,
    #[command(flatten)]
    pub(crate) renderers: RendererArgs,
    /// Folder for result.json and the pictures; made if it does not exist
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}
