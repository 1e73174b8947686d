//! Several workers of one renderer, and what becomes of a picture when one of them fails.

use std::collections::{BTreeMap, VecDeque};
use std::ops::{Deref, DerefMut};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use lookmatch_rendering::{Illumination, Scene};
use serde_json::{Map, Value};

use crate::RendererError;
use crate::hello::{Hello, Threads};
use crate::process::{Launch, lock};
use crate::scene::SceneData;
use crate::worker::{Picture, Worker};

/// After this many failures in a row, no more workers are started.
const MOST_FAILURES: u32 = 5;

/// Says whether the work is to be stopped; asked about twenty times a second while a worker is waited for.
pub type Stop = Arc<dyn Fn() -> bool + Send + Sync>;

/// How workers are run.
#[derive(Clone, Debug, PartialEq)]
pub struct PoolOptions {
    /// How many; by default one where one uses all cores, else as many as there are cores.
    pub workers: Option<usize>,
    /// How long a worker may take to start and say hello.
    pub start_limit: Duration,
    /// How long a worker may say nothing while it works on a request.
    pub time_limit: Duration,
    /// A worker that holds more than this many bytes of memory, with all that it started, is replaced between two
    /// pictures: renderers leak. The default is five times what the largest that comes with lookmatch needs.
    pub memory_limit: u64,
    /// A file that the workers' logs are appended to.
    pub log: Option<PathBuf>,
}

impl Default for PoolOptions {
    fn default() -> Self {
        Self {
            workers: None,
            start_limit: Duration::from_secs(120),
            time_limit: Duration::from_secs(600),
            memory_limit: 8 << 30,
            log: None,
        }
    }
}

/// A picture to be rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Name of a scene that the pool was given.
    pub scene: String,
    /// A model of the renderer.
    pub model: String,
    /// All of the model's parameters.
    pub values: Map<String, Value>,
    /// Samples per pixel, 1 or more.
    pub samples: u32,
    /// 0 to 2³¹ − 1.
    pub seed: u32,
}

/// What was done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Usage {
    /// Pictures that came.
    pub pictures: u64,
    /// Samples of all pixels of these pictures.
    pub pixel_samples: u64,
    /// CPU seconds that they took.
    pub cpu_s: f64,
    /// Seconds that they took by the clock, those of workers side by side added up.
    pub wall_s: f64,
    /// Workers that were started in place of others.
    pub restarts: u64,
    /// Pictures that failed, even on a second worker.
    pub failures: u64,
}

/// Several workers of one renderer. Dropping it ends them.
pub struct Pool {
    launch: Launch,
    options: PoolOptions,
    stop: Stop,
    hello: Hello,
    scenes: Mutex<BTreeMap<String, Arc<SceneData>>>,
    seats: Mutex<VecDeque<Seat>>,
    seat_freed: Condvar,
    seat_count: usize,
    record: Mutex<Record>,
}

/// A place for a worker, which is started when it is needed.
#[derive(Default)]
struct Seat {
    worker: Option<Worker>,
    /// Whether a worker has sat here before.
    was_taken: bool,
}

#[derive(Default)]
struct Record {
    usage: Usage,
    scenes: u64,
    failures_in_a_row: u32,
    /// The last failure, once there were too many.
    given_up: Option<String>,
}

impl Pool {
    /// Starts a first worker; the others follow when there is work for them.
    ///
    /// # Errors
    /// Where it cannot be started, or its answer to `hello` is not understood.
    pub fn start(launch: Launch, options: PoolOptions, stop: Stop) -> Result<Self, RendererError> {
        let (worker, hello) = Worker::start(&launch, &options, &*stop)?;
        let cores = || thread::available_parallelism().map_or(1, usize::from);
        let usual = || if hello.capabilities.threads == Threads::All { 1 } else { cores() };
        let seat_count = options.workers.unwrap_or_else(usual).max(1);
        let mut seats: VecDeque<Seat> = (1..seat_count).map(|_| Seat::default()).collect();
        seats.push_back(Seat { worker: Some(worker), was_taken: true });
        Ok(Self {
            launch,
            options,
            stop,
            hello,
            scenes: Mutex::default(),
            seats: Mutex::new(seats),
            seat_freed: Condvar::new(),
            seat_count,
            record: Mutex::default(),
        })
    }

    /// What the renderer said of itself.
    pub fn hello(&self) -> &Hello {
        &self.hello
    }

    /// How many workers there may be at a time.
    pub fn workers(&self) -> usize {
        self.seat_count
    }

    /// What was done so far.
    pub fn usage(&self) -> Usage {
        lock(&self.record).usage
    }

    /// Gives a scene a name, in place of what had it before. One worker gets it at once, so that a scene that the renderer
    /// cannot do is known early; the others get it before their first picture of it.
    ///
    /// # Errors
    /// Where the scene is none, is not for this renderer, or was refused by it.
    pub fn scene(
        &self,
        name: &str,
        scene: &Scene,
        light: Illumination,
        size: usize,
    ) -> Result<(), RendererError> {
        let revision = {
            let mut record = lock(&self.record);
            record.scenes += 1;
            record.scenes
        };
        let data = Arc::new(SceneData::new((name, revision), scene, light, size, &self.hello)?);
        let mut seat = self.take_seat()?;
        self.repeated(&mut seat, |worker| worker.load(&data, &*self.stop))?;
        lock(&self.scenes).insert(name.into(), data);
        Ok(())
    }

    /// What workers are told of a scene, but for its name: the message, a JSON object, and the bytes of its map.
    pub fn told(&self, scene: &str) -> Option<(Value, Arc<[u8]>)> {
        let data = lock(&self.scenes).get(scene).cloned()?;
        let mut message = data.message.clone();
        message.remove("scene");
        Some((message.into(), data.data.clone()))
    }

    /// Renders pictures, the results in the order of the jobs. One that fails is repeated on a fresh worker, and only then
    /// an error, which no other job suffers from; unless too many fail in a row.
    pub fn render(&self, jobs: &[Job]) -> Vec<Result<Picture, RendererError>> {
        let next = AtomicUsize::new(0);
        let work = || {
            let indices = std::iter::from_fn(|| Some(next.fetch_add(1, Ordering::Relaxed)));
            let indices = indices.take_while(|k| *k < jobs.len());
            indices.map(|k| (k, self.render_one(&jobs[k]))).collect::<Vec<_>>()
        };
        let mut results: Vec<_> = thread::scope(|scope| {
            let threads: Vec<_> = (0..self.seat_count.min(jobs.len())).map(|_| scope.spawn(work)).collect();
            let joined =
                threads.into_iter().map(|t| t.join().unwrap_or_else(|p| std::panic::resume_unwind(p)));
            joined.flatten().collect()
        });
        results.sort_by_key(|(k, _)| *k);
        results.into_iter().map(|(_, result)| result).collect()
    }

    fn render_one(&self, job: &Job) -> Result<Picture, RendererError> {
        let scene = self.check(job)?;
        let mut seat = self.take_seat()?;
        let result = self.repeated(&mut seat, |worker| worker.render(job, &scene, &*self.stop));
        let usage = &mut lock(&self.record).usage;
        match &result {
            Ok(picture) => {
                usage.pictures += 1;
                usage.pixel_samples += u64::from(picture.samples) * picture.image.pixels().len() as u64;
                usage.cpu_s += picture.cpu_s;
                usage.wall_s += picture.wall_s;
                let limit = self.options.memory_limit;
                // A worker that leaks is replaced before it takes the machine down.
                seat.worker.take_if(|worker| worker.outgrows(limit));
            }
            Err(RendererError::Request(_) | RendererError::Start { .. }) => usage.failures += 1,
            Err(_) => (),
        }
        result
    }

    /// The scene of a job that can be asked for.
    fn check(&self, job: &Job) -> Result<Arc<SceneData>, RendererError> {
        let wrong = |field, value: String, expected: String| RendererError::Job {
            renderer: self.hello.name.clone(),
            field,
            value,
            expected,
        };
        let scenes = lock(&self.scenes);
        let names = || scenes.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        let scene = scenes.get(&job.scene);
        let scene = scene.ok_or_else(|| wrong("scene", format!("'{}'", job.scene), names()))?;
        if !self.hello.model_names().any(|name| name == job.model) {
            let known = self.hello.model_names().collect::<Vec<_>>().join(", ");
            return Err(wrong("model", format!("'{}'", job.model), known));
        }
        if job.samples == 0 {
            return Err(wrong("samples", "0".into(), "1 or more".into()));
        }
        if job.seed > i32::MAX as u32 {
            return Err(wrong("seed", job.seed.to_string(), "0 to 2147483647".into()));
        }
        Ok(scene.clone())
    }

    /// Does something with the worker of a seat; where that fails, once more with a fresh one.
    fn repeated<T>(
        &self,
        seat: &mut Seat,
        work: impl Fn(&mut Worker) -> Result<T, RendererError>,
    ) -> Result<T, RendererError> {
        let result = match self.once(seat, &work) {
            Err(error) if error.is_worth_repeating() => {
                seat.worker = None;
                self.once(seat, &work)
            }
            result => result,
        };
        match &result {
            Ok(_) => lock(&self.record).failures_in_a_row = 0,
            // Failed starts have been counted.
            Err(error) if error.ends_worker() && !error.is_start() => self.count_failure(error),
            Err(_) => (),
        }
        result
    }

    fn once<T>(
        &self,
        seat: &mut Seat,
        work: impl Fn(&mut Worker) -> Result<T, RendererError>,
    ) -> Result<T, RendererError> {
        self.check_hope()?;
        let mut worker = match seat.worker.take() {
            Some(worker) => worker,
            None => self.start_worker(seat)?,
        };
        let result = work(&mut worker);
        let is_over = |error: &RendererError| error.ends_worker() || matches!(error, RendererError::Stopped);
        if !result.as_ref().is_err_and(is_over) {
            seat.worker = Some(worker);
        }
        result
    }

    fn start_worker(&self, seat: &mut Seat) -> Result<Worker, RendererError> {
        if std::mem::replace(&mut seat.was_taken, true) {
            lock(&self.record).usage.restarts += 1;
        }
        match Worker::start(&self.launch, &self.options, &*self.stop) {
            Ok((worker, _)) => Ok(worker),
            Err(error) => {
                if error.ends_worker() {
                    self.count_failure(&error);
                }
                Err(error)
            }
        }
    }

    /// Refuses further work after too many failures: a renderer that cannot work here would be started for ever.
    fn check_hope(&self) -> Result<(), RendererError> {
        match lock(&self.record).given_up.clone() {
            None => Ok(()),
            Some(last) => {
                let renderer = self.hello.name.clone();
                Err(RendererError::GivenUp { renderer, failures: MOST_FAILURES, last })
            }
        }
    }

    fn count_failure(&self, error: &RendererError) {
        let mut record = lock(&self.record);
        record.failures_in_a_row += 1;
        if record.failures_in_a_row >= MOST_FAILURES {
            record.given_up.get_or_insert_with(|| error.to_string());
        }
    }

    /// Waits for a free seat, one with a worker where there is one.
    fn take_seat(&self) -> Result<Taken<'_>, RendererError> {
        let mut seats = lock(&self.seats);
        loop {
            if (self.stop)() {
                return Err(RendererError::Stopped);
            }
            if let Some(seat) = seats.pop_back() {
                return Ok(Taken { pool: self, seat });
            }
            let waited = self.seat_freed.wait_timeout(seats, Duration::from_millis(50));
            seats = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        // All at once, so that they do not wait for each other.
        let seats = self.seats.get_mut().unwrap_or_else(PoisonError::into_inner);
        seats.iter_mut().flat_map(|seat| &mut seat.worker).for_each(Worker::dismiss);
    }
}

/// A seat in use; dropping it frees the seat, even in a panic.
struct Taken<'a> {
    pool: &'a Pool,
    seat: Seat,
}

impl Deref for Taken<'_> {
    type Target = Seat;

    fn deref(&self) -> &Seat {
        &self.seat
    }
}

impl DerefMut for Taken<'_> {
    fn deref_mut(&mut self) -> &mut Seat {
        &mut self.seat
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        let seat = std::mem::take(&mut self.seat);
        let mut seats = lock(&self.pool.seats);
        // Running workers are taken first.
        if seat.worker.is_some() {
            seats.push_back(seat)
        } else {
            seats.push_front(seat)
        }
        self.pool.seat_freed.notify_one();
    }
}
