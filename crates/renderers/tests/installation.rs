//! Installations of renderers: what is said where something is missing, and what an interrupted one leaves.

#![cfg(target_os = "linux")]

use std::fs;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use lookmatch_renderers::{BUNDLED, Bundled, InstallationError, Installations, Pool, PoolOptions, State};

/// A renderer that installs nothing but an environment, and ends at once with its variables as last words.
fn bundled(requires: &str, dependencies: &str) -> Bundled {
    let text = format!(
        "# /// script\n# requires-python = \"{requires}\"\n# dependencies = {dependencies}\n# [tool.lookmatch]\n\
         # title = \"Fake\"\n# licence = \"MIT\"\n# about = \"nothing\"\n# pip-options = [\"--no-index\"]\n# ///\n\
         import sys\nsys.exit('at ' + sys.prefix)\n"
    );
    Bundled { name: "fake", file: "fake.py", text: text.leak() }
}

fn has_python() -> bool {
    let venv = Command::new("python3").args(["-c", "import venv, ensurepip"]).stderr(Stdio::null()).status();
    venv.is_ok_and(|status| status.success())
}

fn silent(_: &str) {}

fn never() -> bool {
    false
}

#[test]
fn renderers_are_installed_repaired_and_removed() {
    if !has_python() {
        eprintln!("left out: there is no python3 with venv");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (installations, fake) = (Installations::within(folder.path()), bundled(">=3.8", "[]"));
    let message = installations.launch(&fake).unwrap_err().to_string();
    assert_eq!(message, "renderer 'fake' is not installed; run: lookmatch renderers install fake");
    let State::Missing { what, how } = installations.state(&fake).unwrap() else { panic!() };
    assert_eq!((what.as_str(), how.as_str()), ("not installed", "lookmatch renderers install fake"));

    installations.install(&fake, &silent, &never).unwrap();
    let home = folder.path().join("fake");
    assert_eq!(installations.state(&fake).unwrap(), State::Installed { folder: home.clone() });
    let launch = installations.launch(&fake).unwrap();
    assert!(home.join("environment/workers/lookmatch_worker.py").is_file());
    let died = Pool::start(launch, PoolOptions::default(), Arc::new(never)).err().unwrap().to_string();
    assert!(died.contains(&format!("its last words: at {}", home.join("environment").display())), "{died}");

    // A newer worker is taken without a new installation, other packages are not.
    let newer = Bundled { text: format!("{}# newer\n", fake.text).leak(), ..fake };
    installations.launch(&newer).unwrap();
    assert!(
        fs::read_to_string(home.join("environment/workers/fake_worker.py")).unwrap().ends_with("# newer\n")
    );
    let other = bundled(">=3.9", "[]");
    assert_eq!(installations.state(&other).unwrap(), State::Outdated);
    assert!(installations.launch(&other).unwrap_err().to_string().contains("another version of lookmatch"));

    // What an interruption leaves.
    fs::remove_file(home.join("installed")).unwrap();
    fs::remove_file(home.join("environment/bin/python")).unwrap();
    let State::Missing { what, .. } = installations.state(&fake).unwrap() else { panic!() };
    assert_eq!(what, "its installation was interrupted");
    installations.install(&fake, &silent, &never).unwrap();
    assert!(matches!(installations.state(&fake).unwrap(), State::Installed { .. }));

    // What an upgrade of the system leaves.
    fs::remove_file(home.join("environment/bin/python")).unwrap();
    let gone = installations.launch(&fake).unwrap_err().to_string();
    assert!(gone.contains("does not run any longer"), "{gone}");
    installations.install(&fake, &silent, &never).unwrap();
    installations.launch(&fake).unwrap();

    assert!(installations.remove(&fake).unwrap());
    assert!(!home.exists());
    assert!(!installations.remove(&fake).unwrap());
}

#[test]
fn what_cannot_be_had_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let installations = Installations::within(folder.path());
    let message = |fake: &Bundled| installations.install(fake, &silent, &never).unwrap_err().to_string();
    let old = message(&bundled("==2.4.*", "[]"));
    assert!(old.starts_with("Python ==2.4.* is needed; found "), "{old}");
    if has_python() {
        let none = message(&bundled(">=3.8", "[\"no-such-package==1.0\"]"));
        assert!(none.contains("cannot install no-such-package==1.0 with pip: "), "{none}");
        assert!(none.contains("the Python package index must be reachable"), "{none}");
        let stopped = installations.install(&bundled(">=3.8", "[]"), &silent, &|| true).unwrap_err();
        assert!(matches!(stopped, InstallationError::Stopped), "{stopped}");
    }
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let message = Installations::within(&file).install(&bundled(">=3.8", "[]"), &silent, &never).unwrap_err();
    assert!(message.to_string().starts_with("cannot create folder '"), "{message}");
}

/// Installs what RENDERER names, or everything, in the user's folder, and asks each what it is. Downloads a lot.
#[test]
#[ignore = "downloads renderers"]
fn renderers_install_and_start() {
    let wanted = std::env::var("RENDERER").ok();
    let installations = Installations::of_user().unwrap();
    for renderer in BUNDLED.iter().filter(|r| wanted.as_ref().is_none_or(|name| name == r.name)) {
        installations.install(renderer, &|text| eprintln!("{}: {text}", renderer.name), &never).unwrap();
        let launch = installations.launch(renderer).unwrap();
        let options = PoolOptions { time_limit: Duration::from_secs(120), ..PoolOptions::default() };
        let pool = Pool::start(launch, options, Arc::new(never)).unwrap();
        assert_eq!(pool.hello().name, renderer.name);
        eprintln!(
            "{} {}: {:?}",
            renderer.name,
            pool.hello().version,
            pool.hello().model_names().collect::<Vec<_>>()
        );
    }
}
