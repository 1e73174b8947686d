//! Packages of the system that renderers need, on Debian and what derives from it.
//!
//! The administrator's installation is asked to install them. Anyone else gets libraries (and what they need) unpacked into
//! the renderer's own folder; programs cannot be had that way, and the user is told the command.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::InstallationError;
use crate::command::{ask, is_on_path, run};

/// Names of packages that were unpacked, in their folder.
const LIST: &str = "packages";

/// Which packages are neither installed nor unpacked in a folder; none where the system does not say.
pub(crate) fn missing(packages: &[String], native: &Path) -> Vec<String> {
    if packages.is_empty() || !is_on_path("dpkg-query") {
        return Vec::new();
    }
    let format = ["-W", "-f=${db:Status-Abbrev}${binary:Package}\n"];
    let query = Command::new("dpkg-query").args(format).args(packages).output();
    let known = query.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
    // Some names come with their architecture: "libgl1:amd64".
    let installed = |line: &str| Some(line.strip_prefix("ii ")?.split(':').next()?.to_owned());
    let mut present: Vec<String> = known.lines().filter_map(installed).collect();
    present.extend(fs::read_to_string(native.join(LIST)).unwrap_or_default().lines().map(str::to_owned));
    packages.iter().filter(|package| !present.contains(package)).cloned().collect()
}

/// The command with which an administrator installs packages.
pub(crate) fn command_line(packages: &[String]) -> String {
    format!("apt-get install {}", packages.join(" "))
}

/// Installs packages that are missing.
pub(crate) fn provide(
    packages: &[String],
    native: &Path,
    observe: &dyn Fn(&str),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<(), InstallationError> {
    let (names, line) = (packages.join(" "), command_line(packages));
    if is_root() && is_on_path("apt-get") {
        observe(&format!("installing the system's packages {names}"));
        return install(packages, stop);
    }
    let are_libraries = packages.iter().all(|package| package.starts_with("lib"));
    if are_libraries && is_on_path("apt-get") && is_on_path("dpkg-deb") {
        observe(&format!("unpacking {names} into {}", native.display()));
        return unpack(packages, native, stop);
    }
    Err(InstallationError::System { packages: names, command: line })
}

fn is_root() -> bool {
    #[cfg(unix)]
    return rustix::process::geteuid().is_root();
    #[cfg(not(unix))]
    return false;
}

fn apt() -> Command {
    let mut command = Command::new("apt-get");
    command.env("DEBIAN_FRONTEND", "noninteractive").args(["-y", "-q"]);
    command
}

fn install(packages: &[String], stop: &(dyn Fn() -> bool + Sync)) -> Result<(), InstallationError> {
    let what = format!("install {}", packages.join(" "));
    let hint = format!("as an administrator: {}", command_line(packages));
    let once = || run(apt().args(["install", "--no-install-recommends"]).args(packages), &what, &hint, stop);
    // The lists of packages are brought up to date only where they have to be.
    if once().is_err() && !stop() {
        run(apt().arg("update"), "update the lists of packages", &hint, stop)?;
        once()?;
    }
    Ok(())
}

/// Downloads packages with all that they need and the system lacks, and unpacks them.
fn unpack(
    packages: &[String],
    native: &Path,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<(), InstallationError> {
    let hint = format!("as an administrator: {}", command_line(packages));
    let mut plan = apt();
    plan.args(["install", "--simulate", "--no-install-recommends"]).args(packages);
    let plan = run(&mut plan, &format!("find {}", packages.join(" ")), &hint, stop)?;
    let name = |line: &str| Some(line.strip_prefix("Inst ")?.split(' ').next()?.to_owned());
    let needed: Vec<String> = plan.lines().filter_map(name).collect();
    let folder = tempfile::tempdir()
        .map_err(|source| InstallationError::io("create", Path::new("a folder"), source))?;
    let mut download = apt();
    download.arg("download").args(&needed).current_dir(folder.path());
    run(&mut download, &format!("download {}", needed.join(" ")), &hint, stop)?;
    for file in files(folder.path()) {
        let mut command = Command::new("dpkg-deb");
        command.arg("-x").arg(&file).arg(native);
        run(&mut command, &format!("unpack '{}'", file.display()), &hint, stop)?;
    }
    let list = native.join(LIST);
    let names = [packages, &needed].concat().join("\n");
    fs::write(&list, names).map_err(|source| InstallationError::io("write", &list, source))
}

fn files(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
}

/// Folders of libraries among what was unpacked.
pub(crate) fn library_folders(native: &Path) -> Vec<PathBuf> {
    let usual = ["usr/lib", "lib"].map(|folder| native.join(folder));
    let triples = usual.iter().flat_map(|folder| files(folder)).filter(|folder| {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        folder.is_dir() && name.contains("-linux-")
    });
    let folders: Vec<PathBuf> = triples.chain(usual.iter().cloned()).collect();
    folders.into_iter().filter(|folder| folder.is_dir()).collect()
}

/// The system's Python needs a package of its own for environments.
pub(crate) fn venv_hint() -> &'static str {
    if ask("dpkg".as_ref(), &["--version"]).is_some() {
        "on Debian: apt-get install python3-venv"
    } else {
        "Python's modules venv and ensurepip are needed"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_found_missing() {
        if !is_on_path("dpkg-query") {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let names = ["dpkg", "no-such-package-1"].map(str::to_owned);
        assert_eq!(missing(&names, folder.path()), ["no-such-package-1"]);
        fs::write(folder.path().join(LIST), "no-such-package-1\nother").unwrap();
        assert!(missing(&names, folder.path()).is_empty());
    }

    #[test]
    fn library_folders_are_those_of_the_architecture_too() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("usr/lib/x86_64-linux-gnu")).unwrap();
        let found = library_folders(folder.path());
        assert_eq!(found, ["usr/lib/x86_64-linux-gnu", "usr/lib"].map(|f| folder.path().join(f)));
    }
}
