//! What a worker gets wrong: pictures that are known in closed form, and the protocol's rules, one file each.
//!
//! A new check is a file here and its line in [`CHECKS`].

mod camera;
mod closed_form;
mod compare;
mod determinism;
mod ending;
mod finding;
mod handshake;
mod interreflection;
mod lambert;
mod linearity;
mod map;
mod noise;
mod parameters;
mod plane;
mod session;

use std::path::PathBuf;
use std::time::Duration;

use serde::Serialize;

pub use finding::{Finding, Limit, Number, Outcome, Sheet};

use crate::hello::Hello;
use crate::pool::Stop;
use crate::process::Launch;
use crate::{Cause, RendererError};
use session::Session;

/// All checks, in their order.
const CHECKS: [Check; 12] = [
    handshake::CHECK,
    // First of the pictures: it finds out how they are turned.
    camera::CHECK,
    lambert::CHECK,
    plane::CHECK,
    map::MIRROR,
    map::LAMBERT,
    interreflection::CHECK,
    linearity::CHECK,
    determinism::CHECK,
    noise::CHECK,
    parameters::CHECK,
    ending::CHECK,
];

/// Their names.
pub const CHECK_NAMES: [&str; CHECKS.len()] = {
    let mut names = [""; CHECKS.len()];
    let mut k = 0;
    while k < names.len() {
        names[k] = CHECKS[k].name;
        k += 1;
    }
    names
};

/// One check.
struct Check {
    name: &'static str,
    /// What it looks at.
    about: &'static str,
    /// Does it. An error is what the worker did wrong, too.
    run: fn(&mut Session, &mut Finding) -> Result<(), RendererError>,
}

/// How workers are checked.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckOptions {
    /// Samples per pixel.
    pub samples: u32,
    /// Side of the pictures in pixels.
    pub size: usize,
    /// How long the worker may say nothing while it works on a request.
    pub time_limit: Duration,
    /// A file that the worker's log is appended to.
    pub log: Option<PathBuf>,
    /// Only these checks; all where there are none.
    pub only: Vec<String>,
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self { samples: 64, size: 96, time_limit: Duration::from_secs(600), log: None, only: Vec::new() }
    }
}

/// What was found of a worker.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// The renderer's name and version.
    pub renderer: String,
    /// One of each check.
    pub findings: Vec<Finding>,
}

impl CheckReport {
    /// How many checks ended in a way.
    pub fn count(&self, outcome: Outcome) -> usize {
        self.findings.iter().filter(|finding| finding.outcome == outcome).count()
    }
}

/// Checks a worker. `observe` is told of every finding as it comes.
///
/// # Errors
/// Where the worker cannot be run, or the work was stopped. What the worker does wrong is a finding.
pub fn check(
    launch: &Launch,
    options: &CheckOptions,
    stop: Stop,
    observe: &dyn Fn(&Finding),
) -> Result<CheckReport, RendererError> {
    let mut findings = Vec::new();
    let mut note = |finding: Finding| {
        observe(&finding);
        findings.push(finding);
    };
    let mut session = match Session::start(launch, options, stop) {
        Ok(session) => session,
        Err(error @ (RendererError::Stopped | RendererError::Start { .. })) => return Err(error),
        Err(error) => {
            let mut finding = Finding::new(handshake::CHECK.name, handshake::CHECK.about);
            finding.fault(in_words(&error));
            note(finding);
            return Ok(CheckReport { renderer: launch.label(), findings });
        }
    };
    let is_wanted =
        |check: &&Check| options.only.is_empty() || options.only.iter().any(|name| name == check.name);
    for check in CHECKS.iter().filter(is_wanted) {
        let mut finding = Finding::new(check.name, check.about);
        match (check.run)(&mut session, &mut finding) {
            Ok(()) => (),
            Err(RendererError::Stopped) => return Err(RendererError::Stopped),
            Err(error) => finding.fault(in_words(&error)),
        }
        // The next check gets a worker that has done nothing wrong yet.
        let renewed = if finding.outcome == Outcome::Failed { session.renew() } else { Ok(()) };
        if let Err(error) = renewed {
            finding.fault(format!("it does not start again: {error}"));
            note(finding);
            break;
        }
        note(finding);
    }
    Ok(CheckReport { renderer: name_of(&session.hello), findings })
}

fn name_of(hello: &Hello) -> String {
    format!("{} {}", hello.name, hello.version)
}

/// An error with what to do about it.
fn in_words(error: &RendererError) -> String {
    let hint = match error {
        RendererError::Request(failure) => match failure.cause {
            Cause::Garbage(_) => {
                "; something besides answers is on standard output: duplicate descriptor 1 before anything else, and point it at \
                 standard error"
            }
            Cause::WrongId { .. } => "; each request is answered once, with its own id",
            _ => "",
        },
        _ => "",
    };
    format!("{error}{hint}")
}
