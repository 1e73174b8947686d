//! A worker ends when it is told to, and when nobody is left to tell it anything.

use std::thread::sleep;
use std::time::{Duration, Instant};

use lookmatch_rendering::Illumination;
use serde_json::json;

use super::finding::Limit;
use super::session::Session;
use super::{Check, Finding};
use crate::RendererError;
use crate::pool::Job;
use crate::scene::SceneData;
use crate::worker::Worker;

pub(super) const CHECK: Check = Check {
    name: "ending",
    about: "shutdown, the end of the input, and nothing but answers on standard output",
    run,
};

/// Seconds that it may take.
const LIMIT: f64 = 5.0;
/// Samples of a render that is left in the middle.
const LONG: u32 = 2048;

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    let mut worker = at_work(session)?;
    worker.request(&json!({ "request": "shutdown" }), &*session.stop)?;
    match timed(&mut worker, "after shutdown", finding) {
        Some(status) if !is_success(&status) => {
            finding.fault(format!("it ends with '{status}' after shutdown; expected exit status 0"));
        }
        _ => (),
    }
    if let Some(what) = worker.garbage() {
        finding.fault(format!("after its last answer it prints {what}"));
    }
    let mut worker = at_work(session)?;
    worker.leave();
    timed(&mut worker, "after the end of its input", finding);
    let mut worker = at_work(session)?;
    worker.begin_render("ending", LONG);
    // Long enough for it to be at work.
    sleep(Duration::from_millis(300));
    worker.leave();
    timed(&mut worker, "after the end of its input during a render", finding);
    Ok(())
}

fn is_success(status: &str) -> bool {
    status.ends_with(": 0")
}

/// A worker that has rendered something.
fn at_work(session: &Session) -> Result<Worker, RendererError> {
    let (mut worker, hello) = Worker::start(session.launch, &session.pool_options(), &*session.stop)?;
    let scene = SceneData::new(("ending", 1), &session.stage()?, Illumination::All, 64, &hello)?;
    let (worn, _) = session.lambert([0.5; 3]);
    let job = Job { scene: "ending".into(), model: worn.model, values: worn.values, samples: 1, seed: 1 };
    worker.render(&job, &scene, &*session.stop)?;
    Ok(worker)
}

/// Waits for the end; how it ended.
fn timed(worker: &mut Worker, when: &str, finding: &mut Finding) -> Option<String> {
    let begin = Instant::now();
    let status = worker.ending(Duration::from_secs_f64(LIMIT));
    let seconds = if status.is_some() { begin.elapsed().as_secs_f64() } else { f64::INFINITY };
    if !finding.measure(format!("seconds {when}"), seconds, Limit::most(LIMIT)) {
        finding.remark(format!(
            "it goes on {when}: read standard input on a thread of its own, and exit where that ends"
        ));
    }
    status
}
