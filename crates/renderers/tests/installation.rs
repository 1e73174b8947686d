//! Installations of renderers: what is said where something is missing, and what an interrupted one leaves.

#![cfg(target_os = "linux")]

use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use glam::DVec3;
use lookmatch_imaging::Image;
use lookmatch_renderers::{
    BUNDLED, Bundled, InstallationError, Installations, Job, Light, Pool, PoolOptions, State,
};
use lookmatch_rendering::{EnvironmentLight, Illumination, Scene};

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

/// A smooth map whose channels tell east from west, front from back, and up from down.
fn sky(u: f64, v: f64) -> [f64; 3] {
    let (sin, cos) = (TAU * u).sin_cos();
    [1.0 + 0.5 * sin, 1.0 + 0.5 * cos, 1.0 + 0.5 * (PI * v).cos()]
}

/// A ball under that map, twice as bright and turned by a quarter: what was at the left edge is at +X.
fn ball(folder: &Path) -> Scene {
    let (map, width, height) = (folder.join("sky.exr"), 256, 128);
    let texel = |x: usize, y: usize| {
        let at = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
        sky(at(x, width), at(y, height)).map(|v| v as f32)
    };
    lookmatch_imaging::write(&map, &Image::from_fn(width, height, texel), &[]).unwrap();
    let light = EnvironmentLight { map: map.to_str().unwrap().into(), scale: 2.0, rotation: 90.0 };
    Scene { plane: None, environment: Some(light), ..Scene::reference() }
}

/// What is seen of the map past the ball, at the middle of a pixel.
fn background(scene: &Scene, size: usize, x: usize, y: usize) -> [f64; 3] {
    let camera = &scene.camera;
    let [eye, target, up] = [camera.eye, camera.target, camera.up].map(DVec3::from);
    let forward = (target - eye).normalize();
    let right = forward.cross(up).normalize();
    let film =
        |k: usize| ((2 * k + 1) as f64 / size as f64 - 1.0) * (camera.vertical_fov.to_radians() / 2.0).tan();
    let ray = (forward + right * film(x) - right.cross(forward) * film(y)).normalize();
    sky(ray.x.atan2(-ray.z) / TAU - 0.25, ray.y.acos() / PI).map(|v| 2.0 * v)
}

/// Renders on an installed renderer, and compares what is seen past the ball with the map.
fn check_background(pool: &Pool, name: &str) {
    if !pool.hello().capabilities.lights.contains(&Light::Environment) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (scene, size) = (ball(folder.path()), 32);
    pool.scene("ball", &scene, Illumination::Environment, size).unwrap();
    let check = &pool.hello().check.lambert;
    let mut values = check.values.clone();
    values.insert(check.parameter.clone(), serde_json::json!([0.5, 0.5, 0.5]));
    let job = Job { scene: "ball".into(), model: check.model.clone(), values, samples: 16, seed: 1 };
    let picture = pool.render(&[job]).remove(0).unwrap();
    for (x, y) in [(0, 0), (size - 1, 0), (0, size - 1), (size - 1, size - 1), (size / 2, 0)] {
        let (found, expected) = (picture.image.get(x, y), background(&scene, size, x, y));
        let is_close = (0..3).all(|c| (f64::from(found[c]) / expected[c] - 1.0).abs() < 0.02);
        assert!(is_close, "{name}: {found:?} at {x}, {y}; expected {expected:?}");
    }
    eprintln!("{name}: {:?}", pool.usage());
}

/// Installs what RENDERER names, or everything, in the user's folder, and lets each render a picture. Downloads a lot.
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
        check_background(&pool, renderer.name);
    }
}

/// Libraries that the system lacks are unpacked for who cannot install them. Downloads one.
#[test]
#[ignore = "downloads a package; does nothing for an administrator"]
fn libraries_are_unpacked() {
    let text = bundled(">=3.8", "[]").text.replace("# pip", "# debian = [\"libmikmod3\"]\n# pip");
    let fake = Bundled { name: "fake", file: "fake.py", text: text.leak() };
    let folder = tempfile::tempdir().unwrap();
    let installations = Installations::within(folder.path());
    installations.install(&fake, &|text| eprintln!("{text}"), &never).unwrap();
    assert!(matches!(installations.state(&fake).unwrap(), State::Installed { .. }));
    let launch = installations.launch(&fake).unwrap();
    let (_, paths) = launch.env.iter().find(|(name, _)| name == "LD_LIBRARY_PATH").unwrap();
    let libraries =
        std::env::split_paths(paths).flat_map(|folder| fs::read_dir(folder).into_iter().flatten());
    assert!(libraries.flatten().any(|file| file.file_name().to_string_lossy().starts_with("libmikmod")));
}
