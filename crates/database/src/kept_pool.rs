//! The workers of a renderer, and the database that is asked first.

use std::collections::BTreeMap;
use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use lookmatch_renderers::{Hello, Job, Launch, Picture, Pool, RendererError, Usage};
use lookmatch_rendering::{Illumination, Scene};

use crate::{Database, Description, SceneIdentity, worker_identity};

/// A [`Pool`] whose pictures are kept.
pub struct KeptPool {
    pool: Pool,
    worker: String,
    database: Option<Arc<Database>>,
    scenes: Mutex<BTreeMap<String, Arc<SceneIdentity>>>,
}

/// A picture that was asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// The picture; what it cost was paid when it was rendered.
    pub picture: Picture,
    /// True where it was not rendered now.
    pub is_found: bool,
}

impl KeptPool {
    /// Workers that were started by a command. Without a database, nothing is kept.
    pub fn new(pool: Pool, launch: &Launch, database: Option<Arc<Database>>) -> Self {
        Self { pool, worker: worker_identity(launch), database, scenes: Mutex::default() }
    }

    /// What the renderer said of itself.
    pub fn hello(&self) -> &Hello {
        self.pool.hello()
    }

    /// What was rendered so far.
    pub fn usage(&self) -> Usage {
        self.pool.usage()
    }

    /// As [`Pool::scene`].
    ///
    /// # Errors
    /// As [`Pool::scene`].
    pub fn scene(
        &self,
        name: &str,
        scene: &Scene,
        light: Illumination,
        size: usize,
    ) -> Result<(), RendererError> {
        self.pool.scene(name, scene, light, size)?;
        if let Some((message, map)) = self.pool.told(name) {
            let identity = SceneIdentity::new(name, message, &map);
            self.scenes
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .insert(name.into(), Arc::new(identity));
        }
        Ok(())
    }

    /// Pictures in the order of the jobs, found or rendered as by [`Pool::render`]. Each is kept as soon as it is there.
    pub fn render(&self, jobs: &[Job]) -> Vec<Result<Shown, RendererError>> {
        let Some(database) = &self.database else {
            let fresh = |picture| Shown { picture, is_found: false };
            return self.pool.render(jobs).into_iter().map(|result| result.map(fresh)).collect();
        };
        // Two programs that need the same pictures at once would otherwise render each of them at the same moment.
        let mut order: Vec<usize> = (0..jobs.len()).collect();
        let program = RandomState::new();
        order.sort_by_key(|k| program.hash_one(k));
        let next = AtomicUsize::new(0);
        let work = || {
            let indices = std::iter::from_fn(|| order.get(next.fetch_add(1, Ordering::Relaxed)).copied());
            indices.map(|k| (k, self.render_one(database, &jobs[k]))).collect::<Vec<_>>()
        };
        // One more than there are workers, so that none of them is idle while a picture is stored.
        let threads = (self.pool.workers() + 1).min(jobs.len());
        let mut results: Vec<_> = thread::scope(|scope| {
            let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            let joined =
                threads.into_iter().map(|t| t.join().unwrap_or_else(|p| std::panic::resume_unwind(p)));
            joined.flatten().collect()
        });
        results.sort_by_key(|(k, _)| *k);
        results.into_iter().map(|(_, result)| result).collect()
    }

    fn render_one(&self, database: &Database, job: &Job) -> Result<Shown, RendererError> {
        let scene = self.scenes.lock().unwrap_or_else(PoisonError::into_inner).get(&job.scene).cloned();
        let described = scene.map(|scene| {
            let description = Description::new(self.hello(), &self.worker, &scene, job);
            (scene, description)
        });
        if let Some(picture) = described.as_ref().and_then(|(_, description)| database.find(description)) {
            return Ok(Shown { picture, is_found: true });
        }
        let picture = self.pool.render(std::slice::from_ref(job)).swap_remove(0)?;
        if let Some((scene, description)) = &described {
            database.keep(scene, description, &picture);
        }
        Ok(Shown { picture, is_found: false })
    }
}
