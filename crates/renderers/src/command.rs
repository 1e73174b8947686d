//! Programs that an installation runs: one at a time, in a group of their own that ends when the work is stopped.

use std::ffi::OsStr;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use crate::InstallationError;

/// Runs a program to its end; its output where it succeeds. `hint` is what to do where it does not.
pub(crate) fn run(
    command: &mut Command,
    what: &str,
    hint: &str,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<String, InstallationError> {
    let failed = |reason: String| InstallationError::Failed { what: what.into(), reason, hint: hint.into() };
    let (is_success, said) = output(command, stop).map_err(|error| failed(error.to_string()))?;
    if stop() {
        return Err(InstallationError::Stopped);
    }
    if is_success { Ok(said) } else { Err(failed(telling_line(&said))) }
}

/// Runs a program that says something quickly; its output where it succeeds.
pub(crate) fn ask(program: &OsStr, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).stdin(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Whether a program succeeded, and all that it said.
fn output(command: &mut Command, stop: &(dyn Fn() -> bool + Sync)) -> io::Result<(bool, String)> {
    // A file takes any amount without anyone reading along.
    let mut said = tempfile::tempfile()?;
    command.stdin(Stdio::null()).stdout(said.try_clone()?).stderr(said.try_clone()?);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut child = command.spawn()?;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if stop() {
            #[cfg(unix)]
            let _ = rustix::process::kill_process_group(
                rustix::process::Pid::from_child(&child),
                rustix::process::Signal::KILL,
            );
            child.kill().ok();
            break child.wait()?;
        }
        sleep(Duration::from_millis(50));
    };
    let mut bytes = Vec::new();
    said.seek(SeekFrom::Start(0))?;
    said.read_to_end(&mut bytes)?;
    Ok((status.success(), String::from_utf8_lossy(&bytes).into_owned()))
}

/// The last line that names an error, or the last one of all.
fn telling_line(said: &str) -> String {
    let marks = ["ERROR: ", "Error: ", "E: ", "npm error ", "dpkg-deb: error: "];
    let named = |line: &str| marks.iter().find_map(|mark| line.strip_prefix(mark).map(str::to_owned));
    let telling = said.lines().rev().find_map(named);
    let last = || said.lines().rev().find(|line| !line.trim().is_empty()).map(str::to_owned);
    telling.or_else(last).unwrap_or("no reason given".into()).trim().to_owned()
}

/// True where a program of this name is on the PATH.
pub(crate) fn is_on_path(name: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| Path::new(&folder).join(name).is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str, stop: bool) -> Result<String, InstallationError> {
        run(Command::new("sh").args(["-c", script]), "install it", "plug it in", &|| stop)
    }

    #[test]
    fn failures_quote_the_reason_and_the_way_out() {
        let message = |script| shell(script, false).unwrap_err().to_string();
        let quoted = message("echo fine; echo 'ERROR: no route' >&2; echo bye; exit 1");
        assert_eq!(quoted, "cannot install it: no route (plug it in)");
        assert_eq!(message("echo odd; exit 1"), "cannot install it: odd (plug it in)");
        assert_eq!(shell("echo yes", false).unwrap(), "yes\n");
    }

    #[test]
    fn programs_are_stopped() {
        let begin = std::time::Instant::now();
        assert!(matches!(shell("sleep 60; echo", true), Err(InstallationError::Stopped)));
        assert!(begin.elapsed() < Duration::from_secs(2));
    }
}
