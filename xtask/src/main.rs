//! `cargo xtask`: what is done to this project, as opposed to by it.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

const USAGE: &str = "\
Usage: cargo xtask COMMAND

Commands:
  test [--all-renderers]   Check format, lints, tests, documentation and real renderers; stop at the first failure.
                           MaterialX, Mitsuba, Cycles and Radiance are installed for it; with --all-renderers all that lookmatch knows
  help                     Print this text

Exit codes: 0 all is well, 1 a step failed, 2 the command line is wrong";

/// What must pass before a change goes in, quickest first.
const STEPS: [Step; 8] = [
    Step {
        name: "format",
        variable: None,
        arguments: &["fmt", "--all", "--check", "--"],
        // A macro declares these modules, so that each is named once; rustfmt does not look into macros.
        files: Some("crates/materials/src/models"),
        component: Some("rustfmt"),
        program: None,
    },
    Step {
        name: "lints",
        variable: None,
        arguments: &["clippy", "--workspace", "--all-targets", "--locked", "--", "-D", "warnings"],
        files: None,
        component: Some("clippy"),
        program: None,
    },
    Step {
        name: "tests",
        variable: None,
        arguments: &["test", "--workspace", "--locked"],
        files: None,
        component: None,
        program: None,
    },
    Step {
        name: "documentation",
        variable: Some(("RUSTDOCFLAGS", "-D warnings")),
        arguments: &["doc", "--workspace", "--no-deps", "--locked"],
        files: None,
        component: None,
        program: None,
    },
    // Mitsuba, which the test installs for itself, renders the same scene: a check that shares no code with ours.
    Step {
        name: "peer",
        variable: None,
        arguments: &["test", "--package", "lookmatch", "--test", "cli", "--locked", "--", "--ignored"],
        files: None,
        component: None,
        program: Some("python3"),
    },
    // The official MaterialX, which the test installs for itself, reads what is exported.
    Step {
        name: "exports",
        variable: None,
        arguments: &["test", "--package", "lookmatch", "--test", "export", "--locked", "--", "--ignored"],
        files: None,
        component: None,
        program: Some("python3"),
    },
    // The page of a report, on a desktop's screen and on a telephone's.
    Step {
        name: "report",
        variable: None,
        arguments: &[
            "test",
            "--package",
            "lookmatch-reproduce",
            "--test",
            "browser",
            "--locked",
            "--",
            "--ignored",
        ],
        files: None,
        component: None,
        program: Some("chromium"),
    },
    RENDERERS,
];

/// Real renderers, installed and driven; one after the other, because each uses all cores.
const RENDERERS: Step = Step {
    name: "renderers",
    variable: None,
    arguments: &[
        "test",
        "--package",
        "lookmatch",
        "--test",
        "renderers",
        "--locked",
        "--",
        "--ignored",
        "--test-threads=1",
    ],
    files: None,
    component: None,
    program: Some("python3"),
};

/// The last step with all renderers.
const ALL_RENDERERS: Step = Step { variable: Some(("LOOKMATCH_TEST_RENDERERS", "all")), ..RENDERERS };

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned()).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] | ["help" | "-h" | "--help"] => {
            println!("{USAGE}");
            ExitCode::SUCCESS
        }
        ["test"] => test(&STEPS),
        ["test", "--all-renderers"] => {
            let mut steps = STEPS;
            steps[STEPS.len() - 1] = ALL_RENDERERS;
            test(&steps)
        }
        [command @ ("test" | "help"), extra, ..] => {
            let accepted = if command == "test" { "no argument but --all-renderers" } else { "no arguments" };
            eprintln!("xtask: '{command}' takes {accepted}; found '{extra}'");
            ExitCode::from(2)
        }
        [unknown, ..] => {
            eprintln!("xtask: unknown command '{unknown}'; valid commands: test, help");
            ExitCode::from(2)
        }
    }
}

fn test(steps: &[Step]) -> ExitCode {
    match run_all(steps, Step::run) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("\nxtask: {message}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the steps in order; the error names the first that fails and how to run it alone.
fn run_all(steps: &[Step], mut run: impl FnMut(&Step) -> Result<(), String>) -> Result<(), String> {
    let start = Instant::now();
    let mut summary = Vec::new();
    for step in steps {
        eprintln!("\n=== {}: {}", step.name, step.command_line());
        let begin = Instant::now();
        let result = run(step);
        let seconds = begin.elapsed().as_secs_f64();
        result.map_err(|reason| {
            format!(
                "step '{}' failed after {seconds:.1} s: {reason}\nrun it alone: {}",
                step.name,
                step.command_line()
            )
        })?;
        eprintln!("=== {}: passed in {seconds:.1} s", step.name);
        summary.push(format!("{} {seconds:.1} s", step.name));
    }
    eprintln!("\nxtask: all passed in {:.1} s ({})", start.elapsed().as_secs_f64(), summary.join(", "));
    Ok(())
}

/// One cargo command.
struct Step {
    name: &'static str,
    /// An environment variable and its value.
    variable: Option<(&'static str, &'static str)>,
    arguments: &'static [&'static str],
    /// A folder whose files are appended to the arguments.
    files: Option<&'static str>,
    /// The rustup component that provides the subcommand, where a minimal toolchain lacks it.
    component: Option<&'static str>,
    /// A program that the step cannot do without, which is the name of its Debian package as well: where it is missing and cannot be
    /// installed, the step is left out.
    program: Option<&'static str>,
}

impl Step {
    /// The step as a person would type it.
    fn command_line(&self) -> String {
        let variable = self.variable.map(|(name, value)| format!("{name}=\"{value}\" ")).unwrap_or_default();
        let files = self.files.map(|folder| format!(" {folder}/*.rs")).unwrap_or_default();
        format!("{variable}cargo {}{files}", self.arguments.join(" "))
    }

    fn run(&self) -> Result<(), String> {
        if let Some(program) = self.program.filter(|program| !is_obtained(program)) {
            eprintln!("left out: it needs {program}, which is not installed and could not be");
            return Ok(());
        }
        self.ensure_component()?;
        let files = self.files.map_or(Ok(Vec::new()), sources).map_err(|e| e.to_string())?;
        match cargo().args(self.arguments).args(files).envs(self.variable).status() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(status.to_string()),
            Err(error) => Err(format!("cannot start cargo: {error}")),
        }
    }

    /// Installs what the subcommand needs if it is missing and rustup can.
    fn ensure_component(&self) -> Result<(), String> {
        let Some(component) = self.component else { return Ok(()) };
        let answers = || {
            let mut version = cargo();
            version.args([self.arguments[0], "--version"]).stdout(Stdio::null()).stderr(Stdio::null());
            succeeds(&mut version)
        };
        if answers() {
            return Ok(());
        }
        eprintln!("{component} is missing; trying: rustup component add {component}");
        if succeeds(Command::new("rustup").args(["component", "add", component])) && answers() {
            return Ok(());
        }
        Err(format!(
            "{component} is missing and could not be added; install it with `rustup component add {component}` \
             or, without rustup, from where Rust was installed"
        ))
    }
}

/// Whether a program is there, after an attempt to install it where it is not.
fn is_obtained(program: &str) -> bool {
    let answers = || succeeds(Command::new(program).arg("--version").stdout(Stdio::null()));
    if answers() {
        return true;
    }
    eprintln!("{program} is missing; trying: apt-get install {program}");
    let apt = |arguments: &[&str]| {
        let mut command = Command::new("apt-get");
        command.args(arguments).env("DEBIAN_FRONTEND", "noninteractive").stdout(Stdio::null());
        succeeds(&mut command)
    };
    // The lists of a fresh machine are empty; those of another may do although they cannot be renewed.
    apt(&["update", "--quiet"]);
    apt(&["install", "--quiet", "--yes", "--no-install-recommends", program]) && answers()
}

/// The Rust files of a folder of the project.
fn sources(folder: &str) -> std::io::Result<Vec<PathBuf>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let files = std::fs::read_dir(root.join(folder))?.map(|entry| Ok(entry?.path()));
    let mut files = files.collect::<std::io::Result<Vec<_>>>()?;
    files.retain(|path| path.extension().is_some_and(|extension| extension == "rs"));
    Ok(files)
}

/// The cargo that runs this program, hence the same toolchain.
fn cargo() -> Command {
    Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

fn succeeds(command: &mut Command) -> bool {
    command.status().is_ok_and(|status| status.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_is_named_and_nothing_runs_after_it() {
        let mut started = Vec::new();
        let message = run_all(&STEPS, |step| {
            started.push(step.name);
            if step.name == "lints" { Err("exit status: 101".into()) } else { Ok(()) }
        })
        .unwrap_err();
        assert_eq!(started, ["format", "lints"]);
        assert!(message.starts_with("step 'lints' failed after "), "{message}");
        let alone = "run it alone: cargo clippy --workspace --all-targets --locked -- -D warnings";
        assert!(message.ends_with(alone), "{message}");
    }

    #[test]
    fn the_command_line_shows_the_variable() {
        let documentation = STEPS.iter().find(|s| s.name == "documentation").unwrap();
        let line = documentation.command_line();
        assert_eq!(line, "RUSTDOCFLAGS=\"-D warnings\" cargo doc --workspace --no-deps --locked");
    }
}
