//! The peer's installation: a Python environment of its own in the user's cache, made on first use.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use anyhow::{Context, anyhow};
use directories::ProjectDirs;

use crate::commands::create_folder;
use crate::output::spinner;

/// What is installed, at the versions that the benchmark was written for.
const PACKAGES: [&str; 2] = ["mitsuba==3.9.1", "drjit==1.5.0"];
/// The oldest LLVM that can compile the peer's kernels; older ones end the process.
const OLDEST_LLVM: u32 = 17;
/// How to get one.
pub(super) const LLVM_HINT: &str = "on Debian: apt-get install libllvm19; elsewhere set DRJIT_LIBLLVM_PATH to a libLLVM of version 17 or newer";

/// An installed peer.
#[derive(Debug)]
pub(crate) struct Installation {
    pub(super) python: PathBuf,
    /// The LLVM library that it compiles with; without one it is several times slower.
    pub(super) llvm: Option<PathBuf>,
}

impl Installation {
    /// Finds the peer in a folder (the user's cache if none is given), or installs it there.
    pub(crate) fn find_or_make(folder: Option<&Path>) -> anyhow::Result<Self> {
        let folder = match folder {
            Some(folder) => folder.to_owned(),
            None => ProjectDirs::from("", "", "lookmatch")
                .context("this account has no home folder; name a folder with --peer-folder")?
                .cache_dir()
                .join("mitsuba"),
        };
        create_folder(&folder)?;
        let python = environment(&folder)?;
        let llvm = find_llvm();
        if llvm.is_none() {
            eprintln!(
                "note: there is no LLVM for Mitsuba, which is several times slower without ({LLVM_HINT})"
            );
        }
        Ok(Self { python, llvm })
    }
}

/// The interpreter of the environment in a folder, which is made unless it is there. Its list of packages is written
/// last: without it, what is there was interrupted and is made anew.
fn environment(folder: &Path) -> anyhow::Result<PathBuf> {
    // One program at a time: a second one waits here and then finds the finished work.
    let lock = folder.join("lock");
    let held = File::create(&lock).and_then(|file| file.lock().map(|()| file));
    let _held = held.with_context(|| format!("cannot lock '{}'", lock.display()))?;
    let (home, list) = (folder.join("venv"), folder.join("installed"));
    let python = home.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let packages = PACKAGES.join("\n");
    if fs::read_to_string(&list).is_ok_and(|text| text == packages) && answers(&python) {
        return Ok(python);
    }
    let progress = spinner(&format!("installing {} in {} (once)", PACKAGES.join(" "), folder.display()));
    fs::remove_file(&list).ok();
    make(&home, &python)?;
    lookmatch_imaging::write_atomically(&list, |out| out.write_all(packages.as_bytes()))?;
    progress.finish_and_clear();
    Ok(python)
}

/// True where an interpreter runs; an upgrade of the system may have taken away what it was made from.
fn answers(python: &Path) -> bool {
    Command::new(python).arg("--version").output().is_ok_and(|o| o.status.success())
}

fn make(home: &Path, python: &Path) -> anyhow::Result<()> {
    let system = ["python3", "python"].into_iter().find(|name| answers(Path::new(name)));
    let system = system.context("Mitsuba needs Python 3.9 or newer: there is no python3 on the PATH")?;
    let venv = Command::new(system).args(["-m", "venv", "--clear"]).arg(home).output();
    succeed(venv, "make a Python environment", "on Debian: apt-get install python3-venv")?;
    let pip = Command::new(python)
        .args(["-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--retries", "1"])
        .args(PACKAGES)
        .output();
    succeed(
        pip,
        "install Mitsuba with pip",
        "the Python package index must be reachable this once, and have Mitsuba for this Python",
    )
}

/// Turns a command that failed into an error with its last line and a hint.
fn succeed(output: std::io::Result<Output>, what: &str, hint: &str) -> anyhow::Result<()> {
    let output = output.with_context(|| format!("cannot {what}"))?;
    if output.status.success() {
        return Ok(());
    }
    let said = [output.stderr, output.stdout].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    let telling =
        said.lines().rev().find_map(|line| line.strip_prefix("ERROR: ").or(line.strip_prefix("Error: ")));
    let reason = telling.or(said.lines().last()).unwrap_or("no reason given").trim();
    Err(anyhow!("cannot {what}: {reason} ({hint})"))
}

/// The LLVM library that the environment names, or the newest in the usual places.
fn find_llvm() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("DRJIT_LIBLLVM_PATH") {
        return Some(path.into());
    }
    let triple = format!("/usr/lib/{}-linux-gnu", std::env::consts::ARCH);
    let mut folders: Vec<PathBuf> =
        [triple.as_str(), "/usr/lib64", "/usr/lib", "/opt/homebrew/opt/llvm/lib"].map(PathBuf::from).into();
    folders.extend(
        entries(Path::new("/usr/lib")).filter(|f| name(f).starts_with("llvm-")).map(|f| f.join("lib")),
    );
    let libraries = folders.iter().flat_map(|folder| entries(folder));
    libraries
        .filter_map(|file| Some((llvm_version(&name(&file))?, file)))
        .filter(|(version, _)| *version >= OLDEST_LLVM)
        .max()
        .map(|(_, file)| file)
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The version in names such as libLLVM-19.so, libLLVM.so.19.1 and libLLVM-14.0.6.so.1.
fn llvm_version(name: &str) -> Option<u32> {
    let rest = name.strip_prefix("libLLVM")?;
    let rest = rest.strip_prefix("-").or_else(|| rest.strip_prefix(".so."))?;
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_read_from_library_names() {
        let names =
            ["libLLVM-19.so", "libLLVM.so.19.1", "libLLVM-14.0.6.so.1", "libLLVM.so", "libLLVMCore.so.17"];
        assert_eq!(names.map(llvm_version), [Some(19), Some(19), Some(14), None, None]);
    }

    #[test]
    fn an_interpreter_that_does_not_run_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let python = folder.path().join("python");
        assert!(!answers(&python));
        fs::write(&python, "").unwrap();
        assert!(!answers(&python));
    }

    #[test]
    fn failures_quote_the_reason_and_the_way_out() {
        let output =
            Command::new("sh").args(["-c", "echo fine; echo 'ERROR: no route' >&2; exit 1"]).output();
        let message = succeed(output, "install it", "plug it in").unwrap_err().to_string();
        assert_eq!(message, "cannot install it: no route (plug it in)");
    }
}
