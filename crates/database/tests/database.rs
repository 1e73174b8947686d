//! The database by itself: keys, round trips, threads, damage.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::thread;

use lookmatch_database::{Database, Description, SceneIdentity, worker_identity};
use lookmatch_imaging::Image;
use lookmatch_renderers::{Launch, Picture};
use serde_json::{Map, Value, json};
use tempfile::TempDir;

fn scene(name: &str, size: u64, radius: f64, map: &[u8]) -> SceneIdentity {
    let message = json!({
        "size": size, "spheres": [{"centre": [0, 0, 0], "radius": radius}], "point_lights": [],
        "environment": {"width": 2, "height": 1},
    });
    SceneIdentity::new(name, message, map)
}

fn description(seed: u32) -> Description {
    Description {
        renderer: "fake".into(),
        version: "1".into(),
        worker: "w".into(),
        scene: scene("s", 4, 1.0, b"map").hash,
        light: "environment".into(),
        size: 4,
        model: "plastic".into(),
        parameters: json!({"alpha": 0.1, "colour": [0.1, 0.2, 0.3]}).as_object().unwrap().clone(),
        samples: 16,
        seed,
    }
}

/// Noise, as renderers have it: nothing about it is compressible but its size.
fn picture(seed: u32) -> Picture {
    let value = |x: usize, y: usize, c: usize| {
        let bits =
            (seed as u64 * 1_000_003 + (x * 97 + y * 13 + c) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (bits >> 40) as f32 / 1000.0
    };
    let mut image = Image::from_fn(16, 16, |x, y| [0, 1, 2].map(|c| value(x, y, c)));
    image.pixels_mut()[0] = [-0.0, f32::MIN_POSITIVE / 4.0, f32::MAX];
    Picture { image, samples: 17, cpu_s: 0.5, wall_s: 0.25, noise: Some(0.01) }
}

/// An open database, and what it told.
struct Open {
    database: Database,
    told: Arc<Mutex<Vec<String>>>,
}

impl Open {
    fn new(path: &Path) -> Self {
        let told = Arc::new(Mutex::new(Vec::new()));
        let listener = told.clone();
        let warn = move |text: &str| listener.lock().unwrap().push(text.to_owned());
        Self { database: Database::open(path, Arc::new(warn)).unwrap(), told }
    }

    fn keep(&self, seeds: impl Iterator<Item = u32>) {
        let scene = scene("s", 4, 1.0, b"map");
        seeds.for_each(|seed| self.database.keep(&scene, &description(seed), &picture(seed)));
    }

    fn found(&self, seeds: impl Iterator<Item = u32>) -> usize {
        let found = seeds.filter_map(|seed| Some((seed, self.database.find(&description(seed))?)));
        found.inspect(|(seed, found)| assert_eq!(*found, picture(*seed))).count()
    }

    fn told(&self) -> Vec<String> {
        std::mem::take(&mut self.told.lock().unwrap())
    }
}

fn folder() -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("kept/renders.sqlite");
    (folder, path)
}

#[test]
fn pictures_come_back_to_the_bit() {
    let (_folder, path) = folder();
    let open = Open::new(&path);
    open.keep(0..3);
    let found = open.database.find(&description(1)).unwrap();
    let bits = |picture: &Picture| {
        picture.image.pixels().as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(&found), bits(&picture(1)));
    assert_eq!(found, picture(1));
    assert!(open.database.find(&description(3)).is_none());
    drop(open);
    assert_eq!(Open::new(&path).found(0..9), 3, "by a later run");
}

#[test]
fn everything_that_pixels_depend_on_is_in_the_key() {
    let (_folder, path) = folder();
    let open = Open::new(&path);
    open.keep(0..1);
    type Change = fn(&mut Description);
    let changes: [Change; 11] = [
        |d| d.renderer = "fakes".into(),
        |d| d.version = "1.0".into(),
        |d| d.worker = "v".into(),
        |d| d.scene = scene("s", 4, 1.0_f64.next_up(), b"map").hash,
        |d| d.scene = scene("s", 4, 1.0, b"mop").hash,
        |d| d.size = 5,
        |d| d.model = "metal".into(),
        |d| drop(d.parameters.insert("alpha".into(), json!(0.1_f64.next_up()))),
        |d| drop(d.parameters.insert("beta".into(), json!(0))),
        |d| d.samples = 17,
        |d| d.seed = 1,
    ];
    for (k, change) in changes.iter().enumerate() {
        let mut other = description(0);
        change(&mut other);
        assert!(open.database.find(&other).is_none(), "change {k}");
    }
    // The name of a scene and the size of its pictures are no part of what it is.
    assert_eq!(scene("another", 5, 1.0, b"map").hash, description(0).scene);
    assert_eq!(open.found(0..1), 1);
}

#[test]
fn parameters_may_come_in_any_order() {
    let order = |names: [&str; 2]| {
        let parameters: Map<String, Value> =
            names.iter().map(|name| ((*name).to_owned(), json!(1))).collect();
        Description { parameters, ..description(0) }.text()
    };
    assert_eq!(order(["a", "b"]), order(["b", "a"]));
}

#[test]
fn threads_and_connections_share_a_file() {
    let (_folder, path) = folder();
    thread::scope(|scope| {
        for first in 0..4 {
            let path = &path;
            scope.spawn(move || {
                // All of them make the file, and most pictures come from two of them.
                let open = Open::new(path);
                open.keep((first * 10..).take(20));
                assert_eq!((open.found((first * 10..).take(20)), open.told()), (20, vec![]));
            });
        }
    });
    let open = Open::new(&path);
    let contents = open.database.list().unwrap();
    assert_eq!((contents.pictures, contents.groups.len()), (50, 1));
    assert_eq!(open.database.verify(&|_, _| ()).unwrap().pictures, 50);
}

#[test]
fn most_pictures_survive_a_damaged_page() {
    let (_folder, path) = folder();
    Open::new(&path).keep(0..200);
    let intact = fs::read(&path).unwrap();
    // Pages of the tables and of pictures; the first holds the names of all tables.
    for page in [2, 5, 20, intact.len() / 4096 / 2] {
        let mut bytes = intact.clone();
        bytes[page * 4096..(page + 1) * 4096].fill(0xa5);
        fs::write(&path, bytes).unwrap();
        let open = Open::new(&path);
        let verified = open.database.verify(&|_, _| ()).unwrap();
        let lost = 200 - verified.pictures;
        assert!(lost < 60 && verified.renewed.is_some(), "page {page}: {lost} lost, {:?}", verified.renewed);
        assert_eq!(open.found(0..200) as u64, verified.pictures);
        assert!(open.told().is_empty(), "what is lost is missing, no more");
        open.keep(0..200);
        assert_eq!(open.found(0..200), 200);
        let aside = path.with_extension("damaged.sqlite");
        assert!(aside.is_file() && verified.renewed.unwrap().contains(aside.to_str().unwrap()));
        drop(open);
        assert_eq!(Open::new(&path).database.verify(&|_, _| ()).unwrap().renewed, None);
    }
}

#[test]
fn nobody_replaces_a_file_that_others_use() {
    let (_folder, path) = folder();
    let other = Open::new(&path);
    other.keep(0..50);
    drop(other);
    let intact = fs::read(&path).unwrap();
    let mut bytes = intact.clone();
    bytes[2 * 4096..20 * 4096].fill(0xa5);
    fs::write(&path, bytes).unwrap();
    let (other, open) = (Open::new(&path), Open::new(&path));
    let refused = open.database.verify(&|_, _| ()).unwrap_err().to_string();
    assert!(refused.contains("damaged") && refused.contains("in use"), "{refused}");
    assert!(!path.with_extension("damaged.sqlite").exists());
    drop(other);
    assert!(open.database.verify(&|_, _| ()).unwrap().renewed.is_some());
}

#[test]
fn newer_formats_are_left_alone() {
    let (_folder, path) = folder();
    Open::new(&path).keep(0..3);
    let mut bytes = fs::read(&path).unwrap();
    // The user version in the header of the file.
    bytes[60..64].copy_from_slice(&7_u32.to_be_bytes());
    fs::write(&path, &bytes).unwrap();
    let Err(error) = Database::open(&path, Arc::new(|_: &str| ())) else { panic!("it was opened") };
    assert!(
        error.to_string().contains("format 7") && error.to_string().contains("reads format 1"),
        "{error}"
    );
    assert!(fs::read(&path).unwrap() == bytes, "it was changed");
}

#[test]
fn the_least_recently_used_go_first() {
    let (_folder, path) = folder();
    let open = Open::new(&path);
    open.keep(0..200);
    thread::sleep(std::time::Duration::from_millis(5));
    assert_eq!(open.found(0..40), 40);
    let before = open.database.list().unwrap().bytes;
    let collected = open.database.shrink(before / 2).unwrap();
    assert!(collected.removed > 50 && collected.pictures > 50, "{collected:?}");
    assert_eq!(collected.removed + collected.pictures, 200);
    let after = fs::metadata(&path).unwrap().len();
    assert!(after <= before / 2 && after == collected.bytes, "{after} of {before}");
    // Those that stay are the used ones, and the youngest.
    let oldest = 40 + collected.removed as u32;
    assert_eq!(
        (open.found(0..40), open.found(40..oldest), open.found(oldest..200) as u64),
        (40, 0, collected.pictures - 40)
    );
}

#[test]
fn workers_are_told_apart_by_what_they_are() {
    let folder = TempDir::new().unwrap();
    let script = folder.path().join("a.py");
    fs::write(&script, "one").unwrap();
    let launch = |program: &str, args: &[&Path]| Launch {
        program: program.into(),
        args: args.iter().map(|arg| OsString::from(*arg)).collect(),
        env: Vec::new(),
    };
    let of = |args: &[&Path]| worker_identity(&launch("python3", args));
    let first = of(&[&script]);
    assert_eq!(
        first,
        worker_identity(&launch("/opt/bin/python3", &[&script])),
        "the same interpreter elsewhere"
    );
    assert_ne!(first, of(&[&script, Path::new("--fast")]));
    let moved = folder.path().join("b.py");
    fs::rename(&script, &moved).unwrap();
    assert_eq!(first, of(&[&moved]), "a worker may move");
    fs::write(folder.path().join("lookmatch_worker.py"), "shared").unwrap();
    assert_ne!(first, of(&[&moved]));
    fs::remove_file(folder.path().join("lookmatch_worker.py")).unwrap();
    fs::write(&moved, "two").unwrap();
    assert_ne!(first, of(&[&moved]), "an edited one is another");

    // A program that is the worker itself.
    let program = folder.path().join("worker");
    let compiled = |text: &str| {
        fs::write(&program, text).unwrap();
        worker_identity(&launch(program.to_str().unwrap(), &[]))
    };
    assert_ne!(compiled("one"), compiled("two"));
}
