//! Probes in other languages: each export is run, and compared with what `apply` gives.

mod support;

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value as Json;
use tempfile::TempDir;

use support::{json, refused};

/// What exports may be off, in units of the parameter.
const TOLERANCE: f64 = 1e-3;

/// A folder where light that one command prepares is kept for the next.
fn lit_folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    std::fs::create_dir(folder.path().join("light")).unwrap();
    folder
}

fn read(folder: &Path, name: &str) -> Json {
    serde_json::from_str(&std::fs::read_to_string(folder.join(name)).unwrap()).unwrap()
}

/// A probe of some source points from tiny pictures.
fn remap(folder: &Path, models: [&str; 2], more: &[&str], output: &str) {
    let [from, to] = models;
    let size = if more.is_empty() { "32" } else { "16" };
    let quick = ["remap", from, to, "--quick", "--mask", "--size", size, "-o", output, "--json"];
    json(folder, &[&quick, more].concat());
}

/// Values of the inputs of an export: one number for each, three for a colour.
type Point = Vec<(String, Vec<f64>)>;

/// Points of a probe: some that are tabulated, some between them, the ends, with bodies grey, coloured and black.
fn points(probe: &Json, colour: Option<&str>) -> Vec<Point> {
    let axes = probe["source_axes"].as_array().unwrap();
    let colours = [[0.5, 0.5, 0.5], [0.7, 0.31, 0.04], [0.0, 0.0, 0.0], [0.9, 1.0, 0.2], [0.03, 0.1, 0.6]];
    let at = |n: usize| {
        let value = |(k, axis): (usize, &Json)| {
            let levels: Vec<f64> =
                axis["levels"].as_array().unwrap().iter().map(|l| l.as_f64().unwrap()).collect();
            let last = levels.len() - 1;
            let value = match n {
                0 => levels[0],
                1 => levels[last],
                n if n % 3 == 0 => levels[(n * (2 * k + 3) + k) % levels.len()],
                n => {
                    let at = (n as f64 * [0.618_034, 0.754_878, 0.819_173][k]).fract() * last as f64;
                    let low = at.floor();
                    levels[low as usize] + (at - low) * (levels[low as usize + 1] - levels[low as usize])
                }
            };
            (axis["name"].as_str().unwrap().to_owned(), vec![value])
        };
        let mut point: Point = axes.iter().enumerate().map(value).collect();
        point.extend(colour.map(|name| (name.to_owned(), colours[n % colours.len()].to_vec())));
        point
    };
    (0..32).map(at).collect()
}

/// What `apply` gives: each numeric parameter of the target.
fn expected(folder: &Path, probe: &str, points: &[Point], more: &[&str]) -> Vec<Vec<(String, Vec<f64>)>> {
    let text = |(name, values): &(String, Vec<f64>)| {
        format!("{name}={}", values.iter().map(f64::to_string).collect::<Vec<_>>().join("/"))
    };
    let of_point = |point: &Point| {
        let values: Vec<String> = point.iter().map(text).collect();
        let values: Vec<&str> = values.iter().map(String::as_str).collect();
        let applied = json(folder, &[&["apply", probe, "--json"], &values[..], more].concat());
        let numbers = |value: &Json| match value {
            Json::Number(v) => Some(vec![v.as_f64()?]),
            Json::Array(v) => v.iter().map(Json::as_f64).collect(),
            _ => None,
        };
        let target = applied["target"].as_object().unwrap().iter();
        target.filter_map(|(name, v)| Some((name.clone(), numbers(v)?))).collect()
    };
    points.iter().map(of_point).collect()
}

/// Values of a JSON list of objects that hold what `expected` says, perhaps under longer names.
fn compare(what: &str, found: &Json, expected: &[Vec<(String, Vec<f64>)>], points: &[Point], prefix: &str) {
    let found = found.as_array().unwrap();
    assert_eq!(found.len(), expected.len());
    for ((found, expected), point) in found.iter().zip(expected).zip(points) {
        assert!(expected.len() > 1, "{what}: there is something to compare");
        for (name, values) in expected {
            let found = &found[format!("{prefix}{name}")];
            for (c, value) in values.iter().enumerate() {
                let number = found.as_f64().or_else(|| found[c].as_f64()).unwrap_or(f64::NAN);
                // Rounding to single precision counts relatively.
                let allowed = TOLERANCE.max(2e-6 * value.abs());
                assert!(
                    (number - value).abs() <= allowed,
                    "{what}, {name} at {point:?}: {number}, not {value}"
                );
            }
        }
    }
}

/// Points as a JSON list of objects.
fn as_json(points: &[Point]) -> String {
    let value =
        |values: &[f64]| if let [one] = values { Json::from(*one) } else { Json::from(values.to_vec()) };
    let point = |point: &Point| {
        point.iter().map(|(name, v)| (name.clone(), value(v))).collect::<serde_json::Map<_, _>>()
    };
    Json::from(points.iter().map(|p| Json::Object(point(p))).collect::<Vec<_>>()).to_string()
}

/// Runs a program with text on its standard input, and returns what it prints.
fn pipe(command: &mut Command, text: &str) -> String {
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

const RUN_PYTHON: &str = "\
import importlib, json, sys
module = importlib.import_module(sys.argv[1])
function = getattr(module, sys.argv[2])
print(json.dumps([function(**point) for point in json.load(sys.stdin)]))";

fn run_python(folder: &Path, module: &str, function: &str, points: &[Point]) -> Json {
    let mut python = Command::new("python3");
    python.current_dir(folder).args(["-c", RUN_PYTHON, module, function]).env("PYTHONDONTWRITEBYTECODE", "1");
    serde_json::from_str(&pipe(&mut python, &as_json(points))).unwrap()
}

/// A shader that is a whole one, for compilers.
fn compile_glsl(text: &str) {
    let whole = format!("#version 450\n{text}\nvoid main() {{}}\n");
    let mut frontend = naga::front::glsl::Frontend::default();
    let options = naga::front::glsl::Options::from(naga::ShaderStage::Fragment);
    let module = frontend.parse(&options, &whole).unwrap_or_else(|e| panic!("{e:?}\n{text}"));
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    validator.validate(&module).unwrap_or_else(|e| panic!("{e:?}\n{text}"));
    assert!(module.functions.len() > 1);
}

/// What GLSL has and C has not; vectors are those of GCC and Clang.
const GLSL_IN_C: &str = "\
#include <math.h>
#include <stdio.h>
typedef float vec3 __attribute__((vector_size(16)));
#define vec3(x, y, z) ((vec3){x, y, z, 0})
#define mix(a, b, t) ((a) * (1.0f - (t)) + (b) * (t))
#define clamp(v, a, b) fminf(fmaxf(v, a), b)
#define max fmaxf
#define exp expf
#define log logf
";

/// Runs GLSL as C: with another prelude and other brackets around arrays it is one.
fn run_glsl(
    folder: &Path,
    text: &str,
    function: &str,
    outputs: &[(String, Vec<f64>)],
    points: &[Point],
) -> Json {
    let structure = text.lines().find_map(|line| line.strip_prefix("struct ")).unwrap();
    let mut source = format!("{GLSL_IN_C}typedef struct {structure} {structure};\n");
    let mut is_array = false;
    for line in text.lines() {
        let start = line.starts_with("const float ").then(|| line.find("= float[")).flatten();
        is_array |= start.is_some();
        let line = start.map_or(line.to_owned(), |at| format!("{}= {{", &line[..at]));
        let ends = is_array && line.ends_with(");");
        source += &if ends { line.replace(");", "};\n") } else { line + "\n" };
        is_array &= !ends;
    }
    let argument = |(_, values): &(String, Vec<f64>)| {
        let values = values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
        if values.contains(',') { format!("vec3({values})") } else { values }
    };
    source += "int main(void) {\n  printf(\"[\");\n";
    for (n, point) in points.iter().enumerate() {
        let arguments = point.iter().map(argument).collect::<Vec<_>>().join(", ");
        let (mut format, mut values) = (Vec::new(), String::new());
        for (name, numbers) in outputs {
            let is_colour = numbers.len() == 3;
            let element =
                |c: usize| if is_colour { format!(", r.{name}[{c}]") } else { format!(", r.{name}") };
            format.push(format!("\\\"{name}\\\": {}", if is_colour { "[%.9g, %.9g, %.9g]" } else { "%.9g" }));
            (0..numbers.len()).for_each(|c| values += &element(c));
        }
        let comma = if n == 0 { "" } else { "," };
        source += &format!("  {{ {structure} r = {function}({arguments}); ");
        source += &format!("printf(\"{comma}{{{}}}\\n\"{values}); }}\n", format.join(", "));
    }
    source += "  printf(\"]\");\n  return 0;\n}\n";
    std::fs::write(folder.join("glsl.c"), source).unwrap();
    // The compiler that Rust links with.
    pipe(Command::new("cc").current_dir(folder).args(["-Wno-psabi", "-o", "glsl", "glsl.c", "-lm"]), "");
    serde_json::from_str(&pipe(&mut Command::new(folder.join("glsl")), "")).unwrap()
}

/// From the table and from the fit.
fn exports_agree(folder: &Path, probe: &str, colour: Option<&str>) {
    run_both(folder, probe, colour, &[]);
    run_both(folder, probe, colour, &["--smooth"]);
}

/// Runs an export as Python and as GLSL, whose text it returns.
fn run_both(folder: &Path, probe: &str, colour: Option<&str>, more: &[&str]) -> String {
    let points = points(&read(folder, probe), colour);
    let expected = expected(folder, probe, &points, more);
    let export = |format: &str, file: &str| {
        let arguments = [&["export", probe, "--to", format, "-o", file, "--json"], more].concat();
        let report = json(folder, &arguments);
        for output in report["outputs"].as_array().unwrap() {
            assert!(output["error"].as_f64().unwrap() < TOLERANCE, "{probe}, {format}: {output}");
        }
        assert_eq!(report["notes"].as_array().unwrap().len(), 0, "{report}");
        std::fs::read_to_string(folder.join(file)).unwrap()
    };
    let module = probe.trim_end_matches(".json");
    let text = export("python", &format!("{module}.py"));
    let function = text.lines().find_map(|l| l.strip_prefix("def ")?.split_once("(*")).unwrap().0.to_owned();
    compare("python", &run_python(folder, module, &function, &points), &expected, &points, "");
    let text = export("glsl", "probe.glsl");
    compile_glsl(&text);
    compare("glsl", &run_glsl(folder, &text, &function, &expected[0], &points), &expected, &points, "");
    text
}

#[test]
fn exports_say_what_apply_says() {
    let folder = lit_folder();
    let of = folder.path();
    remap(of, ["ward", "ggx"], &[], "plain.json");
    exports_agree(of, "plain.json", Some("diffuse"));
    // A logarithmic axis; a conductor, whose index is carried over, and no body.
    remap(of, ["ashikhmin-shirley", "beckmann-conductor"], &[], "conductor.json");
    exports_agree(of, "conductor.json", None);
    // A body under an interface, and a colour that is multiplied.
    remap(of, ["ward", "standard-surface"], &[], "interface.json");
    exports_agree(of, "interface.json", Some("diffuse"));
}

#[test]
fn switches_hues_and_bodies_that_bend_are_exported() {
    let folder = lit_folder();
    let of = folder.path();
    // A switch takes the nearest point's value.
    remap(of, ["ward", "ggx"], &[], "switch.json");
    let mut probe = read(of, "switch.json");
    let entries = probe["entries"].as_array_mut().unwrap();
    let entries = entries.iter_mut().enumerate().filter(|(n, _)| n % 3 == 0);
    entries.for_each(|(_, entry)| entry["target"][0] = 0.0.into());
    probe.as_object_mut().unwrap().remove("fit");
    std::fs::write(of.join("switch.json"), probe.to_string()).unwrap();
    run_both(of, "switch.json", Some("diffuse"), &[]);
    // A searched colour has the hue of the source's, which may be black.
    remap(of, ["ward", "ggx"], &["--vary", "target.diffuse=0.2:0.6:0.2"], "hue.json");
    assert!(run_both(of, "hue.json", Some("diffuse"), &[]).contains("_hue("));
    // The body of a plastic is no multiple of what is seen of it.
    remap(of, ["ward", "rough-plastic"], &[], "bent.json");
    run_both(of, "bent.json", Some("diffuse"), &[]);
}

/// Rows of a look-up table, and its head.
struct Cube {
    size: usize,
    domain: [Vec<f64>; 2],
    rows: Vec<Vec<f64>>,
    comments: String,
}

impl Cube {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let numbers =
            |line: &str| line.split_whitespace().filter_map(|w| w.parse().ok()).collect::<Vec<f64>>();
        let of = |word: &str| numbers(text.lines().find(|line| line.starts_with(word)).unwrap());
        assert_eq!(text.lines().filter(|line| line.starts_with("TITLE \"")).count(), 1);
        let rows =
            text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())).map(numbers).collect();
        let size = of(if text.contains("LUT_1D_SIZE") { "LUT_1D_SIZE" } else { "LUT_3D_SIZE" })[0] as usize;
        let comments = text.lines().filter(|line| line.starts_with('#')).collect::<Vec<_>>().join("\n");
        Self { size, domain: [of("DOMAIN_MIN"), of("DOMAIN_MAX")], rows, comments }
    }

    /// Linear interpolation along each of some axes, as readers do it.
    fn at(&self, point: &[f64], channel: usize) -> f64 {
        let place = |(k, v): (usize, &f64)| {
            let x =
                (v - self.domain[0][k]) / (self.domain[1][k] - self.domain[0][k]) * (self.size - 1) as f64;
            let low = x.floor().clamp(0.0, (self.size - 2) as f64);
            (low as usize, x - low)
        };
        let places: Vec<(usize, f64)> = point.iter().enumerate().map(place).collect();
        let corner = |corner: usize| {
            let (mut row, mut weight, mut stride) = (0, 1.0, 1);
            for (k, (low, t)) in places.iter().enumerate() {
                let side = corner >> k & 1;
                row += (low + side) * stride;
                stride *= self.size;
                weight *= if side == 1 { *t } else { 1.0 - t };
            }
            weight * self.rows[row][channel]
        };
        (0..1usize << point.len()).map(corner).sum()
    }

    /// The parameter that a channel holds: name, least value, span.
    fn channel(&self, channel: &str) -> Option<(String, f64, f64)> {
        let line = self.comments.lines().rev().find_map(|l| l.strip_prefix(&format!("#   {channel}: ")))?;
        let (name, rest) = line.split_once(" = (")?;
        let (min, rest) = rest.split_once(" + ")?;
        let span = rest.split_once(" * ")?.0;
        Some((name.to_owned(), min.parse().ok()?, span.parse().ok()?))
    }
}

#[test]
fn look_up_tables_are_read_as_apply_says() {
    let folder = lit_folder();
    let of = folder.path();
    remap(of, ["ward", "ggx"], &[], "plane.json");
    let report = json(of, &["export", "plane.json", "--to", "cube-lut", "-o", "plane.cube", "--json"]);
    assert_eq!(report["inputs"], serde_json::json!(["specular", "roughness"]));
    let cube = Cube::read(&of.join("plane.cube"));
    assert_eq!(cube.rows.len(), cube.size.pow(3), "a cube although the third axis is ignored");
    assert!(cube.comments.contains("blue: ignored"));
    let points = points(&read(of, "plane.json"), None);
    let expected = expected(of, "plane.json", &points, &[]);
    let (name, min, span) = cube.channel("green").unwrap();
    for (point, expected) in points.iter().zip(&expected) {
        let place: Vec<f64> = point.iter().map(|(_, v)| v[0]).chain([0.3]).collect();
        let found = min + span * cube.at(&place, 1);
        let (_, value) = expected.iter().find(|(n, _)| *n == name).unwrap();
        assert!((found - value[0]).abs() <= TOLERANCE, "{name} at {place:?}: {found}, not {value:?}");
    }
    // One axis is left where the other is fixed, and then the table is one-dimensional.
    let fix =
        ["export", "plane.json", "--to", "cube-lut", "--fix", "specular=0.1", "-o", "line.cube", "--json"];
    json(of, &fix);
    let cube = Cube::read(&of.join("line.cube"));
    assert_eq!(cube.rows.len(), cube.size);
    let (name, min, span) = cube.channel("green").unwrap();
    let applied = json(of, &["apply", "plane.json", "specular=0.1", "roughness=0.3", "--json"]);
    let found = min + span * cube.at(&[0.3], 1);
    assert!((found - applied["target"][&name].as_f64().unwrap()).abs() <= TOLERANCE);
    let both = [
        "export",
        "plane.json",
        "--to",
        "cube-lut",
        "--fix",
        "specular=0.1",
        "--fix",
        "roughness=0.2",
        "-o",
        "x.cube",
    ];
    refused(of, &both, 2, &["one to three axes", "has 0"]);
}

#[test]
fn csv_holds_the_entries_with_their_flags() {
    let folder = lit_folder();
    let of = folder.path();
    remap(of, ["ward", "ggx"], &[], "probe.json");
    let mut probe = read(of, "probe.json");
    let entry = &mut probe["entries"][7];
    entry["target"] = Json::Array(Vec::new());
    entry["failed"] = "no light, \"at all\"".into();
    probe.as_object_mut().unwrap().remove("fit");
    std::fs::write(of.join("holes.json"), probe.to_string()).unwrap();
    json(of, &["export", "holes.json", "--to", "csv", "-o", "probe.csv", "--json"]);
    let mut reader = csv::Reader::from_path(of.join("probe.csv")).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(
        header[..5],
        ["source.specular", "source.roughness", "target.specular", "target.ior", "target.roughness"]
    );
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let entries = probe["entries"].as_array().unwrap();
    assert_eq!(rows.len(), entries.len());
    let column =
        |row: &csv::StringRecord, name: &str| row[header.iter().position(|h| h == name).unwrap()].to_owned();
    for (row, entry) in rows.iter().zip(entries) {
        assert_eq!(row[0].parse::<f64>().unwrap(), entry["source"][0].as_f64().unwrap());
        if entry["failed"].is_null() {
            assert_eq!(row[4].parse::<f64>().unwrap(), entry["target"][2].as_f64().unwrap());
            assert_eq!(column(row, "fitness").parse::<f64>().unwrap(), entry["fitness"].as_f64().unwrap());
        }
        let is_saturated = !entry["saturated"].as_array().unwrap().is_empty();
        assert_eq!(column(row, "flags").contains("saturated"), is_saturated, "{entry}");
    }
    assert_eq!((&rows[7][4], column(&rows[7], "fitness").as_str()), ("", ""));
    assert!(column(&rows[7], "flags").starts_with("failed"));
    assert_eq!(column(&rows[7], "failed"), "no light, \"at all\"");

    // Where an entry is missing the nearest is used, and said so; all else is as it was.
    let report = json(of, &["export", "holes.json", "--to", "python", "-o", "holes.py", "--json"]);
    assert!(report["notes"][0].as_str().unwrap().contains("1 entry has no result"), "{report}");
    assert!(std::fs::read_to_string(of.join("holes.py")).unwrap().contains("# Note: 1 entry has no result"));
}

#[test]
fn a_python_module_minds_its_range_and_has_a_command_line() {
    let folder = lit_folder();
    let of = folder.path();
    remap(of, ["ward", "ggx"], &[], "probe.json");
    json(of, &["export", "probe.json", "--to", "python", "-o", "ward_ggx.py", "--json"]);
    let run = |arguments: &[&str]| {
        Command::new("python3").current_dir(of).arg("ward_ggx.py").args(arguments).output().unwrap()
    };
    let inside = run(&["specular=0.1", "roughness=0.2", "diffuse=0.1/0.2/0.3"]);
    let target: Json = serde_json::from_slice(&inside.stdout).unwrap();
    assert_eq!(target["diffuse"], serde_json::json!([0.1, 0.2, 0.3]));
    let outside = run(&["specular=0.9", "roughness=0.2"]);
    let message = String::from_utf8_lossy(&outside.stderr).into_owned();
    assert!(!outside.status.success() && message.contains("specular = 0.9 is outside"), "{message}");
    let clamped: Json =
        serde_json::from_slice(&run(&["specular=0.9", "roughness=0.2", "--clamp"]).stdout).unwrap();
    let applied = json(of, &["apply", "probe.json", "specular=0.9", "roughness=0.2", "--clamp", "--json"]);
    assert!((clamped["ior"].as_f64().unwrap() - applied["target"]["ior"].as_f64().unwrap()).abs() < 1e-9);
    for (arguments, words) in [
        (&["roughness=0.2"][..], "specular"),
        (&["specular=x", "roughness=0.2"], "x"),
        (&["specular=nan", "roughness=0.2"], "nan"),
        (&["specular=0.1", "roughness=0.2", "shine=1"], "shine"),
    ] {
        let output = run(arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && message.contains(words), "{arguments:?}: {message}");
        assert!(!message.contains("Traceback"), "{message}");
    }
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let folder = lit_folder();
    let of = folder.path();
    remap(of, ["ward", "ggx"], &[], "probe.json");
    let export = |format: &'static str, more: &[&'static str]| {
        [&["export", "probe.json", "--to", format, "-o", "x.out"], more].concat()
    };
    refused(of, &export("hlsl", &[]), 2, &["hlsl", "materialx", "cube-lut"]);
    refused(of, &export("glsl", &["--fix", "shine=1"]), 2, &["shine"]);
    refused(of, &export("glsl", &["--fix", "roughness"]), 2, &["roughness", "NAME=VALUE"]);
    refused(of, &export("glsl", &["--fix", "roughness=5"]), 2, &["roughness"]);
    refused(of, &export("glsl", &["--fix", "roughness_u=0.2"]), 2, &["roughness", "all of it"]);
    refused(of, &export("glsl", &["--fix", "roughness=0.2", "--smooth"]), 2, &["--smooth", "roughness"]);
    refused(of, &export("csv", &["--smooth"]), 2, &["csv", "--smooth"]);
    refused(of, &["export", "none.json", "--to", "glsl", "-o", "x.out"], 1, &["none.json"]);
    refused(of, &["export", "probe.json", "--to", "glsl", "-o", "none/x.out"], 1, &["none"]);
    assert!(!of.join("x.out").exists());
    // A device that is always full.
    #[cfg(target_os = "linux")]
    refused(of, &["export", "probe.json", "--to", "glsl", "-o", "/dev/full"], 1, &["/dev/full"]);
}

/// Compiles OSL with what there is: `oslc`, or the compiler of an installed Cycles. Says so where there is neither.
fn compile_osl(folder: &Path, file: &str) {
    let report = |output: Output| {
        let text = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
        assert!(output.status.success(), "{file}: {text}");
    };
    if let Ok(output) = Command::new("oslc").current_dir(folder).arg(file).output() {
        return report(output);
    }
    let installed = std::env::var_os("LOOKMATCH_RENDERERS")
        .unwrap_or_else(|| concat!(env!("CARGO_TARGET_TMPDIR"), "/renderers").into());
    let python = Path::new(&installed).join("cycles/environment/bin/python");
    if !python.exists() {
        eprintln!("{file} is not compiled: there is neither oslc nor an installed Cycles");
        return;
    }
    let code =
        "import sys, bpy, _cycles; sys.exit(not _cycles.osl_compile(sys.argv[1], sys.argv[1] + '.oso'))";
    report(Command::new(python).current_dir(folder).args(["-c", code, file]).output().unwrap());
}

#[test]
fn osl_has_a_port_for_each_parameter_and_compiles() {
    let folder = lit_folder();
    let of = folder.path();
    remap(of, ["ward", "ggx"], &[], "probe.json");
    for more in [&[][..], &["--smooth"]] {
        json(of, &[&["export", "probe.json", "--to", "osl", "-o", "probe.osl", "--json"], more].concat());
        let text = std::fs::read_to_string(of.join("probe.osl")).unwrap();
        let (_, ports) = text.split_once("shader ward_to_ggx(").unwrap();
        let ports = ports.split_once("\n)").map_or(ports, |(ports, _)| ports);
        for port in [
            "float roughness =",
            "color diffuse =",
            "output float ggx_roughness_u =",
            "output color ggx_diffuse =",
        ] {
            assert!(ports.contains(port), "no '{port}' in {text}");
        }
        assert_eq!(text.matches('{').count(), text.matches('}').count());
        compile_osl(of, "probe.osl");
    }
}

/// A Python environment with the official library, which is kept between runs.
fn materialx() -> std::path::PathBuf {
    let home = Path::new(env!("CARGO_TARGET_TMPDIR")).join("materialx");
    let python = home.join("bin/python");
    let has_library =
        || Command::new(&python).args(["-c", "import MaterialX"]).output().is_ok_and(|o| o.status.success());
    if !has_library() {
        let venv = Command::new("python3").args(["-m", "venv", "--clear"]).arg(&home).status().unwrap();
        assert!(venv.success(), "on Debian: apt-get install python3-venv");
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "MaterialX==1.39.5"];
        assert!(Command::new(&python).args(install).status().unwrap().success());
    }
    assert!(has_library());
    python
}

#[test]
#[ignore = "installs MaterialX from the Python package index"]
fn materialx_documents_are_valid_and_agree() {
    let python = materialx();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/export_materialx.py");
    let folder = lit_folder();
    let of = folder.path();
    let three = [
        ["--vary", "source.specular=0.5:1:0.5"],
        ["--vary", "source.f0=0.1:0.5:0.2"],
        ["--vary", "source.exponent=10:210:100"],
    ];
    let three = three.concat();
    for (models, more, colour, shader) in [
        (["ward", "ggx"], &[][..], Some("diffuse"), None),
        // A searched colour, of which nothing but its hue depends on the source.
        (["ward", "ggx"], &["--vary", "target.diffuse=0.2:0.6:0.2"], Some("diffuse"), None),
        (["ashikhmin-shirley", "ggx"], &three, Some("diffuse"), None),
        (["ashikhmin-shirley", "beckmann-conductor"], &[], None, None),
        (["ward", "standard-surface"], &[], Some("diffuse"), Some("standard_surface")),
        (["ward", "gltf"], &[], Some("diffuse"), Some("gltf_pbr")),
        (["ward", "usd-preview-surface"], &[], Some("diffuse"), Some("UsdPreviewSurface")),
        (["ggx", "openpbr"], &[], Some("diffuse"), Some("open_pbr_surface")),
    ] {
        remap(of, models, more, "probe.json");
        let points = points(&read(of, "probe.json"), colour);
        for more in [&[][..], &["--smooth"]] {
            let arguments = ["export", "probe.json", "--to", "materialx", "-o", "probe.mtlx", "--json"];
            let report = json(of, &[&arguments, more].concat());
            let expected = expected(of, "probe.json", &points, more);
            let mut check = Command::new(&python);
            check.current_dir(of).args([script, "probe.mtlx"]);
            let found: Json = serde_json::from_str(&pipe(&mut check, &as_json(&points))).unwrap();
            let first = report["outputs"][0]["name"].as_str().unwrap();
            let prefix = first.strip_suffix(expected[0][0].0.as_str()).unwrap();
            compare(&format!("{models:?}"), &found, &expected, &points, prefix);
            let text = std::fs::read_to_string(of.join("probe.mtlx")).unwrap();
            assert_eq!(text.contains("<surfacematerial"), shader.is_some());
            assert!(shader.is_none_or(|shader| text.contains(&format!("<{shader} name=\"surface\""))));
        }
    }
}
