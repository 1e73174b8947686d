//! Where prepared light and other renderers' pictures are kept between runs, and what is said while light is prepared.

use std::env;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use directories::ProjectDirs;
use indicatif::ProgressBar;
use lookmatch_rendering::{Progress, TransportCache};

use crate::output::spinner;

/// The environment variable that names the folder, or turns it off.
const VARIABLE: &str = "LOOKMATCH_CACHE";

/// The folder that the user names, or that of the platform. Without either, nothing is kept.
pub(crate) fn cache() -> TransportCache {
    match env::var_os(VARIABLE) {
        Some(value) if value == "off" => TransportCache::off(),
        Some(folder) if !folder.is_empty() => TransportCache::new(folder),
        _ => ProjectDirs::from("", "", "lookmatch").map_or_else(TransportCache::off, |folders| {
            TransportCache::new(folders.cache_dir().join("transport"))
        }),
    }
}

/// The render database in the same place: in the folder that the user names, or beside that of prepared light.
pub(crate) fn renders() -> Option<PathBuf> {
    let folder = match env::var_os(VARIABLE) {
        Some(value) if value == "off" => return None,
        Some(folder) if !folder.is_empty() => PathBuf::from(folder),
        _ => ProjectDirs::from("", "", "lookmatch")?.cache_dir().to_owned(),
    };
    Some(folder.join("renders.sqlite"))
}

/// Shows the preparation of a scene, and nothing where it is kept from before.
pub(crate) struct Preparation<'a> {
    /// Whose light it is: `the reference scene`.
    scene: &'a str,
    bar: OnceLock<ProgressBar>,
    loaded: AtomicBool,
}

impl<'a> Preparation<'a> {
    pub(crate) fn of(scene: &'a str) -> Self {
        Self { scene, bar: OnceLock::new(), loaded: AtomicBool::new(false) }
    }

    /// Shows what happens.
    pub(crate) fn observe(&self, progress: Progress) {
        match progress {
            Progress::Waiting => self.show(format!("waiting for another run to prepare {}", self.scene)),
            Progress::Preparing(0.0) => self.show(format!("preparing {}", self.scene)),
            Progress::Preparing(share) => {
                self.show(format!("preparing the light of {}, once: {:.0} %", self.scene, 100.0 * share));
            }
            Progress::Warning(text) => match self.bar.get() {
                Some(bar) => bar.suspend(|| eprintln!("warning: {text}")),
                None => eprintln!("warning: {text}"),
            },
            Progress::Prepared => {}
            Progress::Loaded => self.loaded.store(true, Ordering::Relaxed),
        }
    }

    /// Removes what is shown. The answer is `built` or `cached`.
    pub(crate) fn finish(self) -> &'static str {
        if let Some(bar) = self.bar.get() {
            bar.finish_and_clear();
        }
        if self.loaded.into_inner() { "cached" } else { "built" }
    }

    fn show(&self, text: String) {
        self.bar.get_or_init(|| spinner("")).set_message(text);
    }
}
