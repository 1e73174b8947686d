//! Whatever a worker does, its picture is repeated once and then reported as failed, all other pictures come, and no
//! process is left behind.

#![cfg(target_os = "linux")]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use lookmatch_renderers::{Cause, Job, Launch, Picture, Pool, PoolOptions, RendererError};
use lookmatch_rendering::{Illumination, Scene};
use serde_json::{Value, json};
use tempfile::TempDir;

const WORKER: &str = env!("CARGO_BIN_EXE_lookmatch-fake-worker");

/// A pool of fake workers that take notes.
struct Studio {
    folder: TempDir,
    pool: Pool,
}

fn launch(mode: &str, folder: &Path) -> Launch {
    Launch {
        program: WORKER.into(),
        args: vec![mode.into()],
        env: vec![("FAKE_FOLDER".into(), folder.into())],
    }
}

fn options() -> PoolOptions {
    PoolOptions {
        workers: Some(1),
        start_limit: Duration::from_secs(20),
        time_limit: Duration::from_secs(2),
        ..PoolOptions::default()
    }
}

fn never() -> Arc<dyn Fn() -> bool + Send + Sync> {
    Arc::new(|| false)
}

impl Studio {
    fn new(mode: &str, options: PoolOptions) -> Self {
        Self::stoppable(mode, options, never())
    }

    fn stoppable(mode: &str, options: PoolOptions, stop: Arc<dyn Fn() -> bool + Send + Sync>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let pool = Pool::start(launch(mode, folder.path()), options, stop).unwrap();
        pool.scene("lit", &Scene::reference(), Illumination::Point, 8).unwrap();
        Self { folder, pool }
    }

    fn notes(&self, word: &str) -> Vec<String> {
        notes(self.folder.path(), word)
    }

    /// The processes of all workers that were ever started, and of what they started in their groups.
    fn alive(&self) -> Vec<u32> {
        let started = self.notes("start");
        started.iter().flat_map(|id| group(id.parse().unwrap())).collect()
    }

    fn one(&self, values: Value) -> Result<Picture, RendererError> {
        self.pool.render(&[job(values)]).remove(0)
    }

    /// Ends the pool and looks for processes that are left.
    fn close(self) {
        let started = self.notes("start");
        let Self { folder, pool } = self;
        drop(pool);
        for id in started {
            assert_eq!(group(id.parse().unwrap()), [0; 0], "left of worker {id}");
        }
        drop(folder);
    }
}

/// What follows a word in the notes of all workers.
fn notes(folder: &Path, word: &str) -> Vec<String> {
    let text = fs::read_to_string(folder.join("notes")).unwrap_or_default();
    text.lines().filter_map(|line| Some(line.strip_prefix(word)?.strip_prefix(' ')?.to_owned())).collect()
}

/// Living processes of a group.
fn group(id: u32) -> Vec<u32> {
    let members = fs::read_dir("/proc").unwrap().flatten().filter_map(|entry| {
        let process: u32 = entry.file_name().to_str()?.parse().ok()?;
        let stat = fs::read_to_string(entry.path().join("stat")).ok()?;
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        (fields[0] != "Z" && fields[2] == id.to_string()).then_some(process)
    });
    members.collect()
}

/// Waits until all processes of some groups are gone.
fn wait_for_end(workers: &[String], most: Duration) {
    let alive = || workers.iter().flat_map(|id| group(id.parse().unwrap())).collect::<Vec<_>>();
    let end = Instant::now() + most;
    while !alive().is_empty() {
        assert!(Instant::now() < end, "left: {:?}", alive());
        thread::sleep(Duration::from_millis(20));
    }
}

fn job(values: Value) -> Job {
    let Value::Object(values) = values else { panic!("values are an object") };
    Job { scene: "lit".into(), model: "fake".into(), values, samples: 4, seed: 1 }
}

fn level(result: &Result<Picture, RendererError>) -> f32 {
    result.as_ref().unwrap().image.get(3, 3)[1]
}

/// Shows that a way to fail is repeated on a fresh worker, is then an error, and harms nothing else.
fn fails_alone(mode: &str, expected: &[&str]) -> Studio {
    let studio = Studio::new("fine", options());
    let once = studio.one(json!({"mode": mode, "once": true, "level": 0.75}));
    assert_eq!(level(&once), 0.75, "{mode}: the second worker does it");
    assert_eq!(studio.notes("start").len(), 2, "{mode}: a fresh one");
    let jobs = [json!({"level": 1.0}), json!({"mode": mode}), json!({"level": 2.0}), json!({"level": 3.0})];
    let results = studio.pool.render(&jobs.map(job));
    let message = results[1].as_ref().unwrap_err().to_string();
    for part in expected.iter().chain(&["renderer 'fake'"]) {
        assert!(message.contains(part), "{mode}: '{part}' is not in: {message}");
    }
    assert_eq!([0, 2, 3].map(|k| level(&results[k])), [1.0, 2.0, 3.0], "{mode}: the others");
    let usage = studio.pool.usage();
    assert_eq!((usage.pictures, usage.failures), (4, 1), "{mode}");
    assert!(usage.restarts >= 2, "{mode}: {usage:?}");
    assert!(studio.alive().len() <= 1, "{mode}: failed workers are gone");
    studio
}

#[test]
fn pictures_come_with_their_cost() {
    let studio = Studio::new("fine", options());
    let picture = studio.one(json!({"level": 0.25})).unwrap();
    assert_eq!((picture.image.width(), picture.image.height()), (8, 8));
    assert_eq!((picture.samples, picture.cpu_s, picture.wall_s, picture.noise), (4, 0.5, 0.25, Some(0.125)));
    let usage = studio.pool.usage();
    assert_eq!((usage.pictures, usage.pixel_samples, usage.cpu_s, usage.restarts), (1, 256, 0.5, 0));
    assert_eq!(studio.pool.hello().name, "fake");
    studio.close();
}

#[test]
fn materials_and_scenes_are_sent_once() {
    let studio = Studio::new("fine", options());
    let [a, b] = [json!({"level": 1.0}), json!({"level": 2.0})];
    let results = studio.pool.render(&[a.clone(), a.clone(), b, a].map(job));
    assert!(results.iter().all(Result::is_ok));
    assert_eq!(studio.notes("material").len(), 3);
    assert_eq!(studio.notes("scene").len(), 1);
    // A scene of the same name replaces it.
    studio.pool.scene("lit", &Scene::reference(), Illumination::Point, 9).unwrap();
    assert_eq!(studio.one(json!({"level": 1.0})).unwrap().image.width(), 9);
    assert_eq!((studio.notes("scene").len(), studio.notes("material").len()), (2, 3));
    studio.close();
}

#[test]
fn fresh_workers_get_scene_and_material_again() {
    let studio = Studio::new("fine", options());
    studio.one(json!({"level": 1.0})).unwrap();
    studio.one(json!({"mode": "crash"})).unwrap_err();
    studio.one(json!({"level": 1.0})).unwrap();
    assert_eq!(studio.notes("scene").len(), 3);
    assert_eq!(studio.notes("material").len(), 4);
    studio.close();
}

#[test]
fn crashes() {
    let last_words = "its last words: loading | fatal: out of luck";
    fails_alone("crash", &["render of scene 'lit' with fake", "exit status: 3", last_words]).close();
    fails_alone("abort", &["signal: 6"]).close();
}

#[test]
fn hanging() {
    fails_alone("hang", &["said nothing for 2 s", "its last words: thinking"]).close();
}

#[test]
fn output_that_is_no_protocol() {
    fails_alone("garbage", &["'Saved: /tmp/picture.png'; expected a JSON object", "last words: saving"])
        .close();
    fails_alone("binary", &["is not the protocol"]).close();
    fails_alone("wrong-id", &["answered request 4711; expected an answer to"]).close();
}

#[test]
fn pictures_of_the_wrong_size() {
    fails_alone("wrong-size", &["7 x 7 pixels; expected 8 x 8"]).close();
    fails_alone("too-large", &["bytes is 972 where at most 768 may follow"]).close();
    fails_alone("short", &["the worker ended (exit status: 0)"]).close();
    fails_alone("no-bytes", &["bytes is 0; expected 768"]).close();
    fails_alone("no-size", &["width is missing; expected a whole number"]).close();
}

#[test]
fn pixels_that_are_no_light() {
    fails_alone("nan", &["192 of the picture's values are not finite", "column 0, row 0"]).close();
    fails_alone("black", &["the picture is black"]).close();
}

#[test]
fn refusals() {
    fails_alone("error", &["alpha is 7; expected 0 to 1"]).close();
}

#[test]
fn progress_extends_the_time_limit() {
    let studio = Studio::new("fine", options());
    assert_eq!(level(&studio.one(json!({"mode": "progress", "level": 0.5}))), 0.5);
    assert_eq!(studio.pool.usage().restarts, 0);
    studio.close();
}

#[test]
fn long_logs_do_no_harm_and_are_kept_in_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let studio = Studio::new("fine", PoolOptions { log: Some(log.clone()), ..options() });
    assert_eq!(level(&studio.one(json!({"mode": "chatter", "level": 0.5}))), 0.5);
    studio.close();
    let text = fs::read_to_string(log).unwrap();
    assert!(text.contains("] line 19999: blah"));
}

#[test]
fn leaking_workers_are_replaced() {
    let studio = Studio::new("fine", PoolOptions { memory_limit: 150 << 20, ..options() });
    let results = studio.pool.render(&[json!({"mode": "leak"}), json!({}), json!({})].map(job));
    assert!(results.iter().all(Result::is_ok));
    assert_eq!(studio.notes("start").len(), 2);
    assert_eq!(studio.pool.usage().restarts, 1);
    studio.close();
}

#[test]
fn several_workers_share_jobs_in_order() {
    let studio = Studio::new("fine", PoolOptions { workers: Some(3), ..options() });
    let mut jobs: Vec<Job> = (0..30).map(|k| job(json!({"level": k + 1}))).collect();
    jobs[7] = job(json!({"mode": "crash"}));
    jobs[8] = job(json!({"mode": "hang"}));
    let results = studio.pool.render(&jobs);
    for (k, result) in results.iter().enumerate() {
        match k {
            7 | 8 => assert!(result.is_err()),
            _ => assert_eq!(level(result), (k + 1) as f32),
        }
    }
    assert!(studio.notes("start").len() >= 3);
    assert_eq!(studio.notes("hello").len(), studio.notes("start").len());
    assert!(studio.alive().len() <= 3);
    studio.close();
}

#[test]
fn a_pool_serves_several_threads() {
    let studio = Studio::new("fine", PoolOptions { workers: Some(2), ..options() });
    thread::scope(|scope| {
        for k in 0..6 {
            let studio = &studio;
            scope.spawn(move || assert_eq!(level(&studio.one(json!({"level": k + 1}))), (k + 1) as f32));
        }
    });
    assert!(studio.notes("start").len() <= 2);
    studio.close();
}

#[test]
fn nothing_is_left_of_what_workers_start() {
    let studio = Studio::new("fine", options());
    studio.one(json!({"mode": "hang-with-children"})).unwrap_err();
    assert_eq!(studio.alive(), [0; 0]);
    let alone = studio.notes("alone");
    assert_eq!(alone.len(), 2);
    for id in alone {
        assert_eq!(group(id.split(' ').next().unwrap().parse().unwrap()), [0; 0]);
    }
    studio.close();
}

#[test]
fn workers_that_do_not_end_are_killed() {
    let studio = Studio::new("ignores-shutdown", options());
    studio.one(json!({})).unwrap();
    let begin = Instant::now();
    studio.close();
    assert!(begin.elapsed() < Duration::from_secs(2));
}

#[test]
fn workers_that_do_not_read_are_killed() {
    let folder = tempfile::tempdir().unwrap();
    let pool = Pool::start(launch("deaf", folder.path()), options(), never()).unwrap();
    // The map is larger than any pipe.
    let scene = pool.scene("sky", &Scene::reference(), Illumination::Environment, 8);
    let message = scene.unwrap_err().to_string();
    assert!(message.contains("scene 'sky': the worker said nothing for 2 s"), "{message}");
    for id in notes(folder.path(), "start") {
        assert_eq!(group(id.parse().unwrap()), [0; 0]);
    }
}

#[test]
fn nothing_is_left_after_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let launch = launch("fine", folder.path());
    let panicked = thread::spawn(move || {
        let _pool = Pool::start(launch, options(), never()).unwrap();
        panic!("as the test wants");
    });
    assert!(panicked.join().is_err());
    for id in notes(folder.path(), "start") {
        assert_eq!(group(id.parse().unwrap()), [0; 0]);
    }
}

#[test]
fn work_can_be_stopped() {
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = stopped.clone();
    let options = PoolOptions { time_limit: Duration::from_secs(600), ..options() };
    let studio = Studio::stoppable("fine", options, Arc::new(move || flag.load(Ordering::Relaxed)));
    let stop_time = thread::spawn(move || {
        thread::sleep(Duration::from_millis(300));
        stopped.store(true, Ordering::Relaxed);
        Instant::now()
    });
    let results = studio.pool.render(&[json!({}), json!({"mode": "hang"}), json!({})].map(job));
    let late = stop_time.join().unwrap().elapsed();
    assert!(results[0].is_ok());
    assert!(results[1..].iter().all(|result| matches!(result, Err(RendererError::Stopped))));
    assert!(late < Duration::from_secs(1), "{late:?}");
    assert_eq!(studio.alive(), [0; 0]);
    assert_eq!(studio.pool.usage().failures, 0);
    studio.close();
}

fn start_error(mode: &str, options: PoolOptions) -> RendererError {
    let folder = tempfile::tempdir().unwrap();
    let error = Pool::start(launch(mode, folder.path()), options, never()).err().unwrap();
    for id in notes(folder.path(), "start") {
        assert_eq!(group(id.parse().unwrap()), [0; 0]);
    }
    error
}

#[test]
fn renderers_that_do_not_start_say_why() {
    let message = |mode| start_error(mode, options()).to_string();
    let dead = message("dies-at-start");
    assert!(dead.contains("'lookmatch-fake-worker', hello: the worker ended (exit status: 7)"), "{dead}");
    assert!(dead.contains("no licence server"), "{dead}");
    let other = message("other-protocol");
    assert!(other.contains("protocol is 2; this lookmatch speaks version 1"), "{other}");
    let name = message("odd-name");
    assert!(name.contains("name is 'Fake Renderer'; expected lower case"), "{name}");
    let late =
        start_error("hangs-at-start", PoolOptions { start_limit: Duration::from_secs(1), ..options() });
    let RendererError::Request(failure) = late else { panic!("{late}") };
    assert_eq!(failure.cause, Cause::Silent { seconds: 1.0 });
    let missing = Launch { program: "/no/such/program".into(), args: Vec::new(), env: Vec::new() };
    let missing = Pool::start(missing, options(), never()).err().unwrap().to_string();
    assert!(
        missing.contains("cannot start renderer 'program': '/no/such/program': No such file"),
        "{missing}"
    );
}

#[test]
fn a_slow_start_is_waited_for() {
    let studio = Studio::new("slow-start", options());
    studio.one(json!({})).unwrap();
    studio.close();
}

#[test]
fn a_renderer_that_only_fails_is_given_up() {
    let studio = Studio::new("fine", options());
    let results = studio.pool.render(&[(); 8].map(|()| job(json!({"mode": "crash"}))));
    let is_given_up = |result: &Result<_, _>| matches!(result, Err(RendererError::GivenUp { .. }));
    assert_eq!(results.iter().map(is_given_up).collect::<Vec<_>>()[..5], [false; 5]);
    assert!(results[5..].iter().all(is_given_up));
    let message = results[7].as_ref().unwrap_err().to_string();
    assert!(
        message.contains("given up after 5 failures in a row; the last one: renderer 'fake'"),
        "{message}"
    );
    assert_eq!(studio.notes("start").len(), 10);
    studio.close();
}

#[test]
fn a_renderer_that_does_not_start_any_longer_is_given_up() {
    let studio = Studio::new("dies-later", options());
    fs::write(studio.folder.path().join("stop-starting"), "").unwrap();
    studio.one(json!({"mode": "crash"})).unwrap_err();
    let results = studio.pool.render(&[(); 4].map(|()| job(json!({}))));
    assert!(results.iter().all(Result::is_err));
    assert!(results[3].as_ref().unwrap_err().to_string().contains("exit status: 8"));
    assert_eq!(studio.notes("start").len(), 1 + 5);
    studio.close();
}

#[test]
fn what_makes_no_sense_is_not_asked_for() {
    let studio = Studio::new("fine", options());
    let message = |change: &dyn Fn(&mut Job)| {
        let mut job = job(json!({}));
        change(&mut job);
        studio.pool.render(&[job]).remove(0).unwrap_err().to_string()
    };
    assert!(message(&|j| j.scene = "dark".into()).contains("scene is 'dark'; expected lit"));
    assert!(message(&|j| j.model = "glass".into()).contains("model is 'glass'; expected fake"));
    assert!(message(&|j| j.samples = 0).contains("samples is 0; expected 1 or more"));
    assert!(message(&|j| j.seed = u32::MAX).contains("seed is 4294967295; expected 0 to 2147483647"));
    let scene =
        |name, scene: &Scene, light| studio.pool.scene(name, scene, light, 8).unwrap_err().to_string();
    let dark = scene("sky", &Scene::reference(), Illumination::Environment);
    assert!(dark.contains("it is lit by an environment; expected point lights alone"), "{dark}");
    let own = scene("three", &Scene::spheres(), Illumination::Point);
    assert!(own.contains("sphere[0].diffuse is [0.5, 0.09, 0.06]; expected no colours"), "{own}");
    let refused = scene("refused", &Scene::reference(), Illumination::Point);
    assert!(refused.contains("renderer 'fake', scene 'refused': plane: no"), "{refused}");
    assert_eq!(studio.notes("render").len(), 0);
    studio.close();
}

/// Kills a tool in the middle of a render and waits for its worker to end.
fn killed_tool_leaves_nothing(worker: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let mut tool = Command::new(WORKER)
        .arg("tool")
        .args(worker)
        .env("FAKE_FOLDER", folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let end = Instant::now() + Duration::from_secs(30);
    while notes(folder.path(), "render").is_empty() {
        assert!(Instant::now() < end, "the tool does not render");
        thread::sleep(Duration::from_millis(20));
    }
    let workers = notes(folder.path(), "start");
    assert!(!group(workers[0].parse().unwrap()).is_empty());
    tool.kill().unwrap();
    tool.wait().unwrap();
    wait_for_end(&workers, Duration::from_secs(3));
}

#[test]
fn a_killed_tool_leaves_no_worker() {
    killed_tool_leaves_nothing(&[WORKER, "fine"]);
}

/// A worker in Python whose render never comes back to the interpreter.
const PYTHON_WORKER: &str = r#"
import os, sys
sys.path.insert(0, sys.argv[1])
import lookmatch_worker as w

def note(text):
    with open(os.environ["FAKE_FOLDER"] + "/notes", "a") as notes:
        notes.write(f"{text} {os.getpid()}\n")

class Fake:
    def hello(self):
        return {"name": "fake", "version": "1", "licence": "MIT", "models": [{"name": "fake"}],
                "capabilities": {"deterministic": "exact", "seeds": False, "noise": False, "samples": "none",
                                 "lights": ["point"], "threads": "all", "cancel": False, "interreflection": False},
                "check": {"lambert": {"model": "fake", "values": {}, "parameter": "c"}, "mirror": None},
                "approximations": []}
    def scene(self, name, scene, environment):
        pass
    def material(self, model, values):
        pass
    def render(self, name, samples, seed):
        note("render")
        sum(range(10**15))

note("start")
w.serve(Fake())
"#;

#[test]
fn a_killed_tool_leaves_no_python() {
    let has_numpy = Command::new("python3").args(["-c", "import numpy"]).stderr(Stdio::null()).status();
    if !has_numpy.is_ok_and(|status| status.success()) {
        eprintln!("left out: there is no python3 with numpy");
        return;
    }
    let workers = concat!(env!("CARGO_MANIFEST_DIR"), "/workers");
    killed_tool_leaves_nothing(&["python3", "-c", PYTHON_WORKER, workers]);
}
