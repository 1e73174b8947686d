//! One worker: requests and answers, with a time limit and a way to stop.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use lookmatch_imaging::Image;
use serde_json::{Map, Value, json};

use crate::error::HELLO;
use crate::hello::{Hello, PROTOCOL};
use crate::pool::{Job, PoolOptions};
use crate::process::{Event, Launch, Process};
use crate::scene::SceneData;
use crate::{Cause, Failure, RendererError};

/// How often a wait looks whether the work was stopped.
const GLANCE: Duration = Duration::from_millis(50);
/// How long a worker may take to end by itself.
const GRACE: Duration = Duration::from_millis(500);

/// How often its memory is looked at.
const WEIGHING: Duration = Duration::from_secs(1);

/// A picture by a renderer.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The picture.
    pub image: Image,
    /// Samples per pixel that were taken.
    pub samples: u32,
    /// CPU seconds of all threads.
    pub cpu_s: f64,
    /// Seconds by the clock.
    pub wall_s: f64,
    /// The renderer's own estimate of a pixel's root mean square error.
    pub noise: Option<f64>,
}

/// A request that did not succeed: the work was stopped, or there is a cause.
enum Unanswered {
    Stopped,
    Because(Cause),
}

impl From<Cause> for Unanswered {
    fn from(cause: Cause) -> Self {
        Self::Because(cause)
    }
}

/// A message of the worker with the bytes after it.
type Answer = (Map<String, Value>, Vec<u8>);

/// What stops all waits.
type Watch<'a> = &'a (dyn Fn() -> bool + Sync);

/// A worker that has said hello.
pub(crate) struct Worker {
    process: Process,
    label: String,
    requests: u64,
    /// Whether a request was sent that is not answered.
    is_busy: bool,
    time_limit: Duration,
    /// Revisions of the scenes that it holds.
    scenes: BTreeMap<String, u64>,
    material: Option<(String, Map<String, Value>)>,
    /// When its memory was last looked at.
    weighed: Option<Instant>,
}

impl Worker {
    /// Starts a worker and asks what it is.
    pub(crate) fn start(
        launch: &Launch,
        options: &PoolOptions,
        stop: Watch<'_>,
    ) -> Result<(Self, Hello), RendererError> {
        let label = launch.label();
        let process =
            Process::start(launch, options.log.as_deref()).map_err(|error| RendererError::Start {
                renderer: label.clone(),
                reason: describe_start(&launch.program, options.log.as_deref(), &error),
            })?;
        let mut worker = Self {
            process,
            label,
            requests: 0,
            is_busy: false,
            time_limit: options.start_limit,
            scenes: BTreeMap::new(),
            material: None,
            weighed: None,
        };
        let body = json!({ "request": HELLO, "protocol": PROTOCOL });
        let answer = worker.ask(&body, None, 0, stop).and_then(|(answer, _)| Ok(Hello::read(answer)?));
        let hello = answer.map_err(|unanswered| worker.failure(HELLO, unanswered))?;
        worker.time_limit = options.time_limit;
        worker.label.clone_from(&hello.name);
        Ok((worker, hello))
    }

    /// Gives it a scene, unless it has it.
    pub(crate) fn load(&mut self, scene: &SceneData, stop: Watch<'_>) -> Result<(), RendererError> {
        if self.scenes.get(&scene.name) == Some(&scene.revision) {
            return Ok(());
        }
        let mut body = scene.message.clone();
        body.insert("request".into(), "scene".into());
        self.ask(&Value::Object(body), Some(&scene.data), 0, stop)
            .map_err(|unanswered| self.failure(&format!("scene '{}'", scene.name), unanswered))?;
        self.scenes.insert(scene.name.clone(), scene.revision);
        Ok(())
    }

    /// Renders a picture.
    pub(crate) fn render(
        &mut self,
        job: &Job,
        scene: &SceneData,
        stop: Watch<'_>,
    ) -> Result<Picture, RendererError> {
        self.load(scene, stop)?;
        self.wear(job, stop)?;
        let body = json!({
            "request": "render", "scene": job.scene, "samples": job.samples, "seed": job.seed,
        });
        let most = 12 * scene.size * scene.size;
        let picture =
            self.ask(&body, None, most, stop).and_then(|(answer, data)| Ok(picture(&answer, &data, scene)?));
        picture.map_err(|unanswered| self.failure(&describe(job), unanswered))
    }

    /// Sets the material, unless it is the present one.
    fn wear(&mut self, job: &Job, stop: Watch<'_>) -> Result<(), RendererError> {
        let is_worn = |(model, values): &(String, Map<_, _>)| *model == job.model && *values == job.values;
        if self.material.as_ref().is_some_and(is_worn) {
            return Ok(());
        }
        let body = json!({ "request": "material", "model": job.model, "values": job.values });
        self.ask(&body, None, 0, stop).map_err(|unanswered| {
            let material = format!("material {} {}", job.model, Value::Object(job.values.clone()));
            self.failure(&material, unanswered)
        })?;
        self.material = Some((job.model.clone(), job.values.clone()));
        Ok(())
    }

    /// Sends a request and waits for its answer, after which up to `most_bytes` may follow.
    fn ask(
        &mut self,
        body: &Value,
        data: Option<&Arc<[u8]>>,
        most_bytes: usize,
        stop: Watch<'_>,
    ) -> Result<Answer, Unanswered> {
        let id = self.requests;
        self.requests += 1;
        let mut body = body.clone();
        body["id"] = id.into();
        let data = data.filter(|data| !data.is_empty()).cloned().unwrap_or_default();
        if !data.is_empty() {
            body["bytes"] = data.len().into();
        }
        self.is_busy = true;
        self.process.send(format!("{body}\n").into_bytes(), data, most_bytes);
        let mut end = Instant::now() + self.time_limit;
        loop {
            if stop() {
                return Err(Unanswered::Stopped);
            }
            match self.process.receive(GLANCE) {
                Some(Event::Message(answer, _)) if is_progress(&answer, id) => {
                    end = Instant::now() + self.time_limit;
                }
                Some(Event::Message(answer, data)) => {
                    self.is_busy = false;
                    return Ok((checked(answer, id)?, data));
                }
                Some(Event::Garbage(what)) => return Err(Cause::Garbage(what).into()),
                Some(Event::Ended) => return Err(Cause::Died(self.end()).into()),
                None if Instant::now() > end => {
                    return Err(Cause::Silent { seconds: self.time_limit.as_secs_f64() }.into());
                }
                None => (),
            }
        }
    }

    /// How a worker ended whose output did.
    fn end(&mut self) -> String {
        let by_itself = self.process.wait(GRACE);
        // Before it is reaped: afterwards nobody knows that it has ended, and its last words are still on their way.
        self.process.last_words();
        let status = self.process.kill();
        if by_itself { status } else { "it closed its output".into() }
    }

    fn failure(&self, request: &str, unanswered: Unanswered) -> RendererError {
        let Unanswered::Because(cause) = unanswered else { return RendererError::Stopped };
        let last_words = self.process.last_words();
        Box::new(Failure { renderer: self.label.clone(), request: request.into(), cause, last_words }).into()
    }

    /// True where it holds more memory than a limit, in bytes. Looking takes milliseconds: not after every picture.
    pub(crate) fn outgrows(&mut self, limit: u64) -> bool {
        if self.weighed.is_some_and(|then| then.elapsed() < WEIGHING) {
            return false;
        }
        self.weighed = Some(Instant::now());
        self.process.resident() > limit
    }

    /// The answer to a request of any kind; nothing may follow it.
    pub(crate) fn request(
        &mut self,
        body: &Value,
        stop: Watch<'_>,
    ) -> Result<Map<String, Value>, RendererError> {
        let name = body["request"].as_str().unwrap_or_default().to_owned();
        let answer = self.ask(body, None, 0, stop);
        answer.map(|(answer, _)| answer).map_err(|unanswered| self.failure(&name, unanswered))
    }

    /// Starts a render and does not wait for it.
    pub(crate) fn begin_render(&mut self, scene: &str, samples: u32) {
        let body = json!({
            "id": self.requests, "request": "render", "scene": scene, "samples": samples, "seed": 1,
        });
        self.requests += 1;
        self.is_busy = true;
        self.process.send(format!("{body}\n").into_bytes(), Arc::default(), usize::MAX);
    }

    /// Closes its input.
    pub(crate) fn leave(&mut self) {
        self.process.close_input();
    }

    /// How it ends, if it does so by itself within a time.
    pub(crate) fn ending(&mut self, within: Duration) -> Option<String> {
        self.process.wait(within).then(|| self.process.kill())
    }

    /// What it printed besides answers, if it did.
    pub(crate) fn garbage(&mut self) -> Option<String> {
        loop {
            match self.process.receive(GLANCE)? {
                Event::Garbage(what) => return Some(what),
                Event::Ended => return None,
                Event::Message(..) => (),
            }
        }
    }

    /// Asks it to end, without waiting for that.
    pub(crate) fn dismiss(&mut self) {
        let line = format!("{}\n", json!({ "id": self.requests, "request": "shutdown" }));
        self.process.send(line.into_bytes(), Arc::default(), 0);
        self.process.close_input();
    }
}

impl Drop for Worker {
    /// A worker between two requests ends by itself; one that does not is killed, with all that it started.
    fn drop(&mut self) {
        if !self.is_busy {
            self.dismiss();
            self.process.wait(GRACE);
        }
    }
}

/// Why a worker could not be run: its program or its log.
fn describe_start(program: &Path, log: Option<&Path>, error: &std::io::Error) -> String {
    let unwritable =
        log.filter(|log| std::fs::OpenOptions::new().create(true).append(true).open(log).is_err());
    match unwritable {
        Some(log) => format!("its log '{}' cannot be written: {error}", log.display()),
        None => format!("'{}': {error}", program.display()),
    }
}

/// A picture in the words of a message.
fn describe(job: &Job) -> String {
    let values = Value::Object(job.values.clone());
    let Job { scene, model, samples, seed, .. } = job;
    format!("render of scene '{scene}' with {model} {values}, {samples} samples, seed {seed}")
}

fn is_progress(answer: &Map<String, Value>, id: u64) -> bool {
    answer.contains_key("progress") && answer.get("id").and_then(Value::as_u64) == Some(id)
}

/// An answer to the request of this identity that is no error.
fn checked(answer: Map<String, Value>, id: u64) -> Result<Map<String, Value>, Cause> {
    let found = answer.get("id").unwrap_or(&Value::Null);
    if found.as_u64() != Some(id) {
        return Err(Cause::WrongId { expected: id, found: found.to_string() });
    }
    match answer.get("error") {
        None => Ok(answer),
        Some(Value::String(text)) => Err(Cause::Refused(text.clone())),
        Some(other) => Err(Cause::Refused(other.to_string())),
    }
}

/// The picture in an answer.
fn picture(answer: &Map<String, Value>, data: &[u8], scene: &SceneData) -> Result<Picture, Cause> {
    let size = scene.size;
    let (width, height) = (whole(answer, "width")?, whole(answer, "height")?);
    if (width, height) != (size as u64, size as u64) {
        return Err(Cause::Size { width, height, size });
    }
    let samples = whole(answer, "samples")?;
    let samples = u32::try_from(samples).ok().filter(|n| *n > 0);
    let samples = samples.ok_or_else(|| odd(answer, "samples", "a whole number of 1 or more"))?;
    let (cpu_s, wall_s) = (seconds(answer, "cpu_s")?, seconds(answer, "wall_s")?);
    let noise = match answer.get("noise") {
        None | Some(Value::Null) => None,
        Some(_) => Some(seconds(answer, "noise")?),
    };
    Ok(Picture { image: image(data, scene)?, samples, cpu_s, wall_s, noise })
}

/// The image that a picture's bytes are.
fn image(data: &[u8], scene: &SceneData) -> Result<Image, Cause> {
    let size = scene.size;
    let (numbers, rest) = data.as_chunks::<4>();
    let numbers: Vec<f32> = numbers.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let (pixels, odd) = numbers.as_chunks::<3>();
    if pixels.len() != size * size || !odd.is_empty() || !rest.is_empty() {
        let expected = 12 * size * size;
        return Err(Cause::Answer(format!(
            "bytes is {}; expected {expected} of {size} x {size} pixels",
            data.len()
        )));
    }
    if let Some(first) = numbers.iter().position(|value| !value.is_finite()) {
        let count = numbers.iter().filter(|value| !value.is_finite()).count();
        return Err(Cause::NotFinite { count, x: first / 3 % size, y: first / 3 / size });
    }
    if scene.is_lit && numbers.iter().all(|value| *value == 0.0) {
        return Err(Cause::Black);
    }
    Image::from_pixels(size, size, pixels.to_vec()).map_err(|error| Cause::Answer(error.to_string()))
}

fn whole(answer: &Map<String, Value>, field: &str) -> Result<u64, Cause> {
    answer.get(field).and_then(Value::as_u64).ok_or_else(|| odd(answer, field, "a whole number"))
}

fn seconds(answer: &Map<String, Value>, field: &str) -> Result<f64, Cause> {
    let number = answer.get(field).and_then(Value::as_f64).filter(|s| s.is_finite() && *s >= 0.0);
    number.ok_or_else(|| odd(answer, field, "a number of 0 or more"))
}

fn odd(answer: &Map<String, Value>, field: &str, expected: &str) -> Cause {
    let found = answer.get(field).map_or("missing".into(), Value::to_string);
    Cause::Answer(format!("{field} is {found}; expected {expected}"))
}
