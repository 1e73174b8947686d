//! Real renderers, installed and driven as a user does: Mitsuba, Cycles and Radiance. `cargo xtask test --all-renderers` checks
//! all others that come with lookmatch, too; `LOOKMATCH_TEST_RENDERERS` names those to be checked.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value as Json;
use tempfile::TempDir;

/// The step of the lattices that are searched.
const STEP: f64 = 0.01;

/// Renderers that the other tests use: these are checked in every run.
const FEW: &str = "mitsuba cycles radiance";

/// The renderers to be checked.
fn wanted() -> Vec<String> {
    let names = std::env::var("LOOKMATCH_TEST_RENDERERS").unwrap_or_else(|_| FEW.into());
    if names == "all" {
        let list = json(Path::new("."), &["renderers", "--json"]);
        return list.as_array().unwrap().iter().map(|r| r["name"].as_str().unwrap().to_owned()).collect();
    }
    names.split_whitespace().map(str::to_owned).collect()
}

/// The program; renderers are installed for the tests alone, so that they do not lean on what a user has.
fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookmatch"));
    let installed = std::env::var_os("LOOKMATCH_RENDERERS")
        .unwrap_or_else(|| concat!(env!("CARGO_TARGET_TMPDIR"), "/renderers").into());
    // Pictures of an earlier run would be found there, and nothing be rendered.
    let kept = folder.join("kept");
    command.current_dir(folder).env("LOOKMATCH_RENDERERS", installed).env("LOOKMATCH_CACHE", kept);
    command
}

fn lookmatch(folder: &Path, arguments: &[&str]) -> Output {
    let output = program(folder).args(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn json(folder: &Path, arguments: &[&str]) -> Json {
    serde_json::from_slice(&lookmatch(folder, arguments).stdout).unwrap()
}

fn install(name: &str) {
    lookmatch(Path::new("."), &["renderers", "install", name]);
}

/// A remap of one parameter, and its entries.
fn entries(folder: &Path, arguments: &str) -> Vec<Json> {
    let mut arguments: Vec<&str> = arguments.split_whitespace().collect();
    arguments.extend(["--size", "64", "--seed", "3", "-o", "probe.json", "--json"]);
    let report = json(folder, &arguments);
    let costs = report["renderers"].as_array().unwrap();
    assert!(!costs.is_empty() && costs.iter().all(|cost| cost["renders"].as_u64() > Some(0)), "{report}");
    let probe: Json = serde_json::from_str(&fs::read_to_string(folder.join("probe.json")).unwrap()).unwrap();
    probe["entries"].as_array().unwrap().clone()
}

fn numbers(value: &Json) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// The same formula on both sides: `expected` of the source's number comes back within a step, and what is left is noise.
fn comes_back(entries: &[Json], expected: impl Fn(f64) -> f64) {
    assert!(!entries.is_empty());
    for entry in entries {
        let (source, target) = (numbers(&entry["source"])[0], numbers(&entry["target"])[0]);
        assert!((target - expected(source)).abs() < 1.01 * STEP, "{entry}");
        let (nrmsd, floor) = (numbers(&entry["nrmsd"]), numbers(&entry["noise"]["nrmsd"]));
        assert!(nrmsd.iter().sum::<f64>() < 1.2 * floor.iter().sum::<f64>(), "{entry}");
    }
}

#[test]
#[ignore = "installs renderers"]
fn every_renderer_passes_its_check() {
    for name in wanted() {
        install(&name);
        let folder = TempDir::new().unwrap();
        lookmatch(folder.path(), &["renderers", "check", &name, "-o", "check"]);
    }
}

#[test]
#[ignore = "installs renderers"]
fn microfacets_come_back_from_mitsuba() {
    install("mitsuba");
    let folder = TempDir::new().unwrap();
    for distribution in ["ggx", "beckmann"] {
        let remap = format!(
            "remap mitsuba:roughconductor:distribution={distribution},eta=0,k=1,specular_reflectance=1 \
             {distribution}:diffuse=0,fresnel=none,specular=1,ior=1.5 --vary source.alpha=0.15:0.45:0.15 \
             --vary target.roughness=0.02:0.7:0.01 --max-samples 256"
        );
        comes_back(&entries(folder.path(), &remap), |alpha| alpha);
    }
}

#[test]
#[ignore = "installs renderers"]
fn radiances_plastic_is_wards() {
    install("radiance");
    let folder = TempDir::new().unwrap();
    let remap = "remap ward:variant=gmd,specular=0.1,diffuse=0.3 radiance:plastic:specularity=0.1 \
         --vary source.roughness=0.1:0.3:0.2 --vary target.roughness=0.02:0.5:0.01 --max-samples 64";
    comes_back(&entries(folder.path(), remap), |alpha| alpha);
}

#[test]
#[ignore = "installs renderers"]
fn microfacets_travel_between_mitsuba_and_cycles() {
    ["mitsuba", "cycles"].into_iter().for_each(install);
    let folder = TempDir::new().unwrap();
    for (theirs, ours) in [("ggx", "GGX"), ("beckmann", "BECKMANN")] {
        let mitsuba =
            format!("mitsuba:roughconductor:distribution={theirs},eta=0,k=1,specular_reflectance=1");
        let cycles = format!("cycles:glossy:distribution={ours},color=1");
        let there = format!(
            "remap {mitsuba} {cycles} --vary source.alpha=0.1:0.4:0.3 --vary target.roughness=0.1:0.85:0.01 \
             --max-samples 256"
        );
        comes_back(&entries(folder.path(), &there), f64::sqrt);
        let back = format!(
            "remap {cycles} {mitsuba} --vary source.roughness=0.3:0.7:0.4 --vary target.alpha=0.02:0.7:0.01 \
             --max-samples 256"
        );
        comes_back(&entries(folder.path(), &back), |roughness| roughness * roughness);
    }
}

/// Processes that a program started, and theirs, by what Linux says of their surroundings.
fn workers(mark: &str) -> Vec<u32> {
    let mark = format!("LOOKMATCH_TEST_MARK={mark}");
    let is_marked = |pid: &u32| {
        let surroundings = fs::read(format!("/proc/{pid}/environ")).unwrap_or_default();
        surroundings.split(|byte| *byte == 0).any(|variable| variable == mark.as_bytes())
    };
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = processes.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter(is_marked).collect()
}

fn waited(what: &str, is_there: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_there() {
        assert!(begin.elapsed() < Duration::from_secs(120), "{what}");
        sleep(Duration::from_millis(50));
    }
}

/// A remap that takes minutes, marked, on its way.
fn long_remap(folder: &Path, name: &str, mark: &str) -> std::process::Child {
    let (source, log): (&str, PathBuf) = match name {
        "radiance" => ("radiance:plastic", folder.join("log")),
        _ => ("mitsuba:plastic", folder.join("log")),
    };
    let arguments =
        ["remap", source, "ggx", "--size", "256", "--samples", "512", "-o", "probe.json", "--log"];
    let mut command = program(folder);
    command.args(arguments).arg(log).env("LOOKMATCH_TEST_MARK", mark);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

#[test]
#[cfg(target_os = "linux")]
#[ignore = "installs renderers"]
fn nothing_is_left_behind_when_the_program_is_killed() {
    for name in ["mitsuba", "radiance"] {
        install(name);
        let folder = TempDir::new().unwrap();
        let mark = format!("killed-{name}-{}", std::process::id());
        let mut program = long_remap(folder.path(), name, &mark);
        waited("no worker was started", || workers(&mark).len() > 2);
        sleep(Duration::from_secs(4));
        program.kill().unwrap();
        program.wait().unwrap();
        waited("workers were left behind", || workers(&mark).is_empty());
    }
}

#[test]
#[cfg(target_os = "linux")]
#[ignore = "installs renderers"]
fn a_renderer_that_is_killed_in_the_middle_is_started_again() {
    install("mitsuba");
    let folder = TempDir::new().unwrap();
    let mark = format!("restarted-{}", std::process::id());
    let arguments = "remap mitsuba:plastic ggx --vary source.alpha=0.1:0.3:0.1 --fix source.ior=1.5 \
         --size 128 --samples 256 --max-samples 256 -o probe.json --json";
    let mut command = program(folder.path());
    command.args(arguments.split_whitespace()).env("LOOKMATCH_TEST_MARK", &mark);
    let remap = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let worker = || {
        let is_worker = |pid: &u32| {
            let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
            String::from_utf8_lossy(&line).contains("mitsuba_worker.py")
        };
        workers(&mark).into_iter().find(is_worker)
    };
    waited("no worker was started", || worker().is_some());
    sleep(Duration::from_secs(5));
    let pid = worker().expect("the worker is at work").to_string();
    assert!(Command::new("kill").args(["-s", "KILL", &pid]).status().unwrap().success());
    let output = remap.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{message}");
    let report: Json = serde_json::from_slice(&output.stdout).unwrap();
    assert!(report["renderers"][0]["restarts"].as_u64() > Some(0), "{report}");
    assert_eq!((&report["failed"], &report["source_points"]), (&0.into(), &3.into()), "{report}");
}
