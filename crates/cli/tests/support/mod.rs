//! How the tests run the program.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value as Json;

/// The program in a folder. No test sees light that another one prepared: it is kept in the folder's `light`, or nowhere if there
/// is none.
pub fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookmatch"));
    let light = folder.join("light");
    let cache = if light.is_dir() { light.into_os_string() } else { "off".into() };
    command.current_dir(folder).env("LOOKMATCH_CACHE", cache);
    command
}

pub fn lookmatch(folder: &Path, arguments: &[&str]) -> Output {
    program(folder).args(arguments).output().unwrap()
}

/// Runs a command that must succeed and print one JSON document.
pub fn json(folder: &Path, arguments: &[&str]) -> Json {
    let output = lookmatch(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Runs a command that must fail with an exit code and one message that holds all of some words.
pub fn refused(folder: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let output = lookmatch(folder, arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {message}");
    assert!(!message.contains("panicked"), "{arguments:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{arguments:?}: no '{word}' in: {message}");
    }
    assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
}
