//! Private installations of the renderers that come with lookmatch, made on first use in the user's cache.
//!
//! ```text
//! renderers/NAME/lock                     held while something is done here
//! renderers/NAME/installed                what was installed; written last
//! renderers/NAME/environment/             a Python environment, or a folder with node_modules
//! renderers/NAME/environment/workers/     the worker's files
//! renderers/NAME/environment/native/      libraries of the system, where they could not be installed
//! ```

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use directories::ProjectDirs;
use serde_json::{Map, Value, json};
use thiserror::Error;

use crate::command::{ask, run};
use crate::recipe::{Recipe, Versions};
use crate::registry::{Bundled, SHARED};
use crate::{Launch, debian};

/// Names another folder for the installations.
const FOLDER: &str = "LOOKMATCH_RENDERERS";
/// Interpreters that may do, in this order.
const PYTHONS: [&str; 7] =
    ["python3.13", "python3.12", "python3.11", "python3.10", "python3.9", "python3", "python"];

/// Why a renderer cannot be installed or started.
#[derive(Debug, Error)]
pub enum InstallationError {
    /// There is no renderer of this name.
    #[error("there is no renderer '{name}'; those that come with lookmatch are {known}")]
    Unknown {
        /// The name.
        name: String,
        /// All names.
        known: String,
    },
    /// It is not installed.
    #[error("renderer '{name}' is not installed; run: lookmatch renderers install {name}")]
    NotInstalled {
        /// Its name.
        name: String,
    },
    /// It is installed, but for another version of lookmatch, or something has gone since.
    #[error("renderer '{name}' is to be installed anew ({reason}); run: lookmatch renderers install {name}")]
    Incomplete {
        /// Its name.
        name: String,
        /// Why.
        reason: String,
    },
    /// The block in the worker's file cannot be read.
    #[error("the worker '{file}' does not say how it is installed: {reason}")]
    Recipe {
        /// The file.
        file: String,
        /// What is wrong.
        reason: String,
    },
    /// No interpreter will do.
    #[error("{program} {needed} is needed; found {found}")]
    Interpreter {
        /// Python or Node.js.
        program: &'static str,
        /// Versions that will do.
        needed: String,
        /// What is on the PATH.
        found: String,
    },
    /// Packages of the system are missing that cannot be had without its administrator.
    #[error("the system lacks {packages}; as an administrator run: {command}")]
    System {
        /// The packages.
        packages: String,
        /// What installs them.
        command: String,
    },
    /// A program failed.
    #[error("cannot {what}: {reason} ({hint})")]
    Failed {
        /// What was to be done.
        what: String,
        /// What the program said.
        reason: String,
        /// What may help.
        hint: String,
    },
    /// A file or folder cannot be used.
    #[error("cannot {action} '{}': {source}", path.display())]
    Io {
        /// What was to be done.
        action: &'static str,
        /// To which file or folder.
        path: PathBuf,
        /// Why it cannot be.
        source: io::Error,
    },
    /// There is no home folder.
    #[error(
        "this account has no home folder; name a folder for renderers with the variable LOOKMATCH_RENDERERS"
    )]
    NoHome,
    /// The user stopped the work.
    #[error("stopped")]
    Stopped,
}

impl InstallationError {
    pub(crate) fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        Self::Io { action, path: path.to_owned(), source }
    }
}

/// Whether a renderer can be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// It can.
    Installed {
        /// Where it lies.
        folder: PathBuf,
    },
    /// Something is missing.
    Missing {
        /// What, for a list.
        what: String,
        /// What to do.
        how: String,
    },
    /// It was installed for another version of lookmatch.
    Outdated,
}

/// The folder in which renderers are installed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Installations {
    folder: PathBuf,
}

impl Installations {
    /// Those of this user: in the folder that LOOKMATCH_RENDERERS names, else in the cache.
    ///
    /// # Errors
    /// Where the account has no home folder and the variable is not set.
    pub fn of_user() -> Result<Self, InstallationError> {
        if let Some(folder) = std::env::var_os(FOLDER).filter(|folder| !folder.is_empty()) {
            return Ok(Self::within(folder));
        }
        let folders = ProjectDirs::from("", "", "lookmatch").ok_or(InstallationError::NoHome)?;
        Ok(Self::within(folders.cache_dir().join("renderers")))
    }

    /// Those in a folder.
    pub fn within(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// Whether a renderer can be used.
    ///
    /// # Errors
    /// Where its file does not say how it is installed.
    pub fn state(&self, renderer: &Bundled) -> Result<State, InstallationError> {
        let place = Place::new(&self.folder, renderer)?;
        let how = format!("lookmatch renderers install {}", renderer.name);
        let Ok(installed) = fs::read_to_string(place.list()) else {
            let what =
                if place.home().exists() { "its installation was interrupted" } else { "not installed" };
            return Ok(State::Missing { what: what.into(), how });
        };
        if installed != place.packages() {
            return Ok(State::Outdated);
        }
        if !place.is_complete() {
            let program = place.program().display().to_string();
            return Ok(State::Missing { what: format!("'{program}' does not run any longer"), how });
        }
        let lacking = debian::missing(&place.recipe.details().debian, &place.native());
        if !lacking.is_empty() {
            return Ok(State::Missing { what: format!("the system's packages {}", lacking.join(" ")), how });
        }
        Ok(State::Installed { folder: place.folder })
    }

    /// Installs a renderer, or repairs its installation; nothing is done where all is well. `observe` is told what is being
    /// done. What an interrupted installation leaves is made anew by the next one.
    ///
    /// # Errors
    /// Where the system lacks something, a package cannot be had, or the work was stopped.
    pub fn install(
        &self,
        renderer: &Bundled,
        observe: &dyn Fn(&str),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), InstallationError> {
        let place = Place::new(&self.folder, renderer)?;
        let _held = place.lock()?;
        if matches!(self.state(renderer)?, State::Installed { .. }) {
            return place.write_worker();
        }
        let interpreter = place.interpreter()?;
        if fs::read_to_string(place.list()).is_ok_and(|list| list == place.packages()) && place.is_complete()
        {
            return place.install_native(observe, stop);
        }
        fs::remove_file(place.list()).ok();
        place.make(&interpreter, observe, stop)?;
        place.install_native(observe, stop)?;
        place.write_worker()?;
        let list = place.list();
        lookmatch_imaging::write_atomically(&list, |out| out.write_all(place.packages().as_bytes()))
            .map_err(|source| InstallationError::io("write", &list, source))
    }

    /// How an installed renderer is started.
    ///
    /// # Errors
    /// Where it is not installed, or not completely; the message says what to do.
    pub fn launch(&self, renderer: &Bundled) -> Result<Launch, InstallationError> {
        let place = Place::new(&self.folder, renderer)?;
        let name = renderer.name.to_owned();
        match self.state(renderer)? {
            State::Installed { .. } => (),
            State::Missing { .. } if !place.list().exists() => {
                return Err(InstallationError::NotInstalled { name });
            }
            State::Missing { what, .. } => return Err(InstallationError::Incomplete { name, reason: what }),
            State::Outdated => {
                let reason = "it was installed for another version of lookmatch".into();
                return Err(InstallationError::Incomplete { name, reason });
            }
        }
        // The files are lookmatch's own: a newer one brings them up to date.
        place.write_worker()?;
        Ok(place.launch())
    }

    /// Removes a renderer; true where something was there.
    ///
    /// # Errors
    /// Where its files cannot be removed.
    pub fn remove(&self, renderer: &Bundled) -> Result<bool, InstallationError> {
        let place = Place::new(&self.folder, renderer)?;
        if !place.folder.exists() {
            return Ok(false);
        }
        let _held = place.lock()?;
        // The list goes first: without it, what is left does not count as installed.
        fs::remove_file(place.list()).ok();
        let removed = fs::remove_dir_all(&place.folder);
        removed.map_err(|source| InstallationError::io("remove", &place.folder, source))?;
        Ok(true)
    }
}

/// Where one renderer is installed, and from what.
struct Place<'a> {
    renderer: &'a Bundled,
    recipe: Recipe,
    folder: PathBuf,
}

impl<'a> Place<'a> {
    fn new(folder: &Path, renderer: &'a Bundled) -> Result<Self, InstallationError> {
        let recipe = Recipe::read(renderer.text)
            .map_err(|reason| InstallationError::Recipe { file: renderer.file.into(), reason })?;
        Ok(Self { renderer, recipe, folder: folder.join(renderer.name) })
    }

    fn list(&self) -> PathBuf {
        self.folder.join("installed")
    }

    fn home(&self) -> PathBuf {
        self.folder.join("environment")
    }

    fn native(&self) -> PathBuf {
        self.home().join("native")
    }

    /// The worker's file. Its name differs from that of the module that it imports.
    fn worker(&self) -> PathBuf {
        let extension = Path::new(self.renderer.file).extension().unwrap_or_default().to_string_lossy();
        self.home().join(format!("workers/{}_worker.{extension}", self.renderer.name))
    }

    /// What is installed, in the form of the list.
    fn packages(&self) -> String {
        let interpreter = self.recipe.requires_python.as_ref().or(self.recipe.requires_node.as_ref());
        let requires = interpreter.map(Versions::to_string).unwrap_or_default();
        let details = self.recipe.details();
        [&[requires], &*details.pip_options, &*self.recipe.dependencies].concat().join("\n")
    }

    /// What runs the worker.
    fn program(&self) -> PathBuf {
        if self.recipe.requires_node.is_some() {
            return "node".into();
        }
        self.home().join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" })
    }

    /// True where the interpreter still runs; an upgrade of the system may have taken it away.
    fn is_complete(&self) -> bool {
        ask(self.program().as_os_str(), &["--version"]).is_some()
    }

    /// One program at a time: a second one waits here and then finds the finished work.
    fn lock(&self) -> Result<File, InstallationError> {
        fs::create_dir_all(&self.folder)
            .map_err(|source| InstallationError::io("create folder", &self.folder, source))?;
        let path = self.folder.join("lock");
        let held = File::create(&path).and_then(|file| file.lock().map(|()| file));
        held.map_err(|source| InstallationError::io("lock", &path, source))
    }

    /// An interpreter that will do.
    fn interpreter(&self) -> Result<OsString, InstallationError> {
        match (&self.recipe.requires_python, &self.recipe.requires_node) {
            (Some(versions), _) => choose("Python", &PYTHONS, versions),
            (None, Some(versions)) => choose("Node.js", &["node"], versions),
            (None, None) => unreachable!("recipes without an interpreter are refused"),
        }
    }

    fn make(
        &self,
        interpreter: &OsStr,
        observe: &dyn Fn(&str),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), InstallationError> {
        let (packages, folder) = (self.recipe.dependencies.join(" "), self.folder.display());
        observe(&format!("installing {} ({packages}) in {folder}", self.recipe.details().title));
        if self.recipe.requires_node.is_some() {
            self.make_node(stop)
        } else {
            self.make_python(interpreter, stop)
        }
    }

    fn make_python(&self, python: &OsStr, stop: &(dyn Fn() -> bool + Sync)) -> Result<(), InstallationError> {
        let mut venv = Command::new(python);
        venv.args(["-m", "venv", "--clear"]).arg(self.home());
        run(&mut venv, "make a Python environment", debian::venv_hint(), stop)?;
        if self.recipe.dependencies.is_empty() {
            return Ok(());
        }
        let mut pip = Command::new(self.program());
        // Sources would have to be compiled, which takes what few have, and fails after minutes.
        pip.args(["-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--retries", "1"])
            .arg("--only-binary=:all:")
            .args(&self.recipe.details().pip_options)
            .args(&self.recipe.dependencies);
        let what = format!("install {} with pip", self.recipe.dependencies.join(" "));
        let hint =
            "the Python package index must be reachable this once, and have the packages for this Python";
        run(&mut pip, &what, hint, stop).map(drop)
    }

    fn make_node(&self, stop: &(dyn Fn() -> bool + Sync)) -> Result<(), InstallationError> {
        let home = self.home();
        if home.exists() {
            fs::remove_dir_all(&home).map_err(|source| InstallationError::io("remove", &home, source))?;
        }
        fs::create_dir_all(&home).map_err(|source| InstallationError::io("create folder", &home, source))?;
        let dependencies = self.recipe.dependencies.iter();
        let pinned = dependencies.filter_map(|package| package.rsplit_once('@'));
        let pinned: Map<String, Value> =
            pinned.map(|(name, version)| (name.into(), version.into())).collect();
        let manifest = json!({ "private": true, "dependencies": pinned }).to_string();
        write(&home.join("package.json"), &manifest)?;
        let mut npm = Command::new("npm");
        npm.args(["install", "--no-audit", "--no-fund", "--no-update-notifier"]).current_dir(&home);
        let what = format!("install {} with npm", self.recipe.dependencies.join(" "));
        run(&mut npm, &what, "npm must be installed, and its registry reachable this once", stop).map(drop)
    }

    fn install_native(
        &self,
        observe: &dyn Fn(&str),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), InstallationError> {
        let lacking = debian::missing(&self.recipe.details().debian, &self.native());
        if lacking.is_empty() { Ok(()) } else { debian::provide(&lacking, &self.native(), observe, stop) }
    }

    /// Writes the worker's files, unless they are there.
    fn write_worker(&self) -> Result<(), InstallationError> {
        let worker = self.worker();
        let folder = worker.parent().unwrap_or(Path::new(""));
        fs::create_dir_all(folder)
            .map_err(|source| InstallationError::io("create folder", folder, source))?;
        if self.recipe.requires_python.is_some() {
            write(&folder.join(SHARED.0), SHARED.1)?;
        }
        write(&worker, self.renderer.text)
    }

    fn launch(&self) -> Launch {
        let worker = self.worker().into_os_string();
        // Neither the variables of another Python nor the user's own packages.
        let isolated = ["-s", "-E"].map(OsString::from);
        let args = if self.recipe.requires_python.is_some() {
            [&isolated[..], &[worker]].concat()
        } else {
            vec![worker]
        };
        let mut libraries = debian::library_folders(&self.native());
        let mut env = Vec::new();
        if !libraries.is_empty() {
            libraries.extend(std::env::split_paths(&std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default()));
            env.extend(std::env::join_paths(libraries).ok().map(|paths| ("LD_LIBRARY_PATH".into(), paths)));
        }
        Launch { program: self.program(), args, env }
    }
}

/// Writes a file of ours, unless it has this content.
fn write(path: &Path, text: &str) -> Result<(), InstallationError> {
    if fs::read_to_string(path).is_ok_and(|found| found == text) {
        return Ok(());
    }
    lookmatch_imaging::write_atomically(path, |out| out.write_all(text.as_bytes()))
        .map_err(|source| InstallationError::io("write", path, source))
}

/// The first of some interpreters whose version will do; of Python, one that can make environments where there is one.
/// Names on the PATH may stand for nothing: they are asked.
fn choose(program: &'static str, names: &[&str], versions: &Versions) -> Result<OsString, InstallationError> {
    let version = |name: &str| {
        let said = ask(name.as_ref(), &["--version"])?;
        Some(said.trim().trim_start_matches("Python ").trim_start_matches('v').to_owned())
    };
    let found: Vec<_> = names.iter().filter_map(|name| Some((*name, version(name)?))).collect();
    let suitable = found.iter().filter(|(_, version)| versions.contain(version)).map(|(name, _)| *name);
    let is_whole = |name: &&str| {
        program != "Python" || ask((*name).as_ref(), &["-c", "import venv, ensurepip"]).is_some()
    };
    if let Some(name) = suitable.clone().find(is_whole).or_else(|| suitable.clone().next()) {
        return Ok(name.into());
    }
    let found: Vec<String> = found.iter().map(|(name, version)| format!("{name} {version}")).collect();
    let found = if found.is_empty() { "none on the PATH".into() } else { found.join(", ") };
    Err(InstallationError::Interpreter { program, needed: versions.to_string(), found })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpreters_are_asked_for_their_version() {
        let versions = |text: &str| Versions::try_from(text.to_owned()).unwrap();
        let message = choose("Python", &["python3"], &versions("==2.4.*")).unwrap_err().to_string();
        assert!(message.starts_with("Python ==2.4.* is needed; found "), "{message}");
        let message = choose("Node.js", &["no-such-node"], &versions(">=20")).unwrap_err().to_string();
        assert_eq!(message, "Node.js >=20 is needed; found none on the PATH");
    }
}
