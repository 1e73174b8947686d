//! The render database, with a renderer in Python that writes down what it renders. Python's own SQLite looks into the file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::Mutex;
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value as Json;
use tempfile::TempDir;

/// A folder with a renderer and a database of its own.
struct Place {
    folder: TempDir,
}

impl Place {
    /// `None` without Python.
    fn new() -> Option<Self> {
        let has_python = Command::new("python3").arg("--version").output().is_ok_and(|o| o.status.success());
        if !has_python {
            eprintln!("skipped: there is no python3");
            return None;
        }
        let place = Self { folder: TempDir::new().unwrap() };
        place.write_worker(0.0, &[]);
        place.light();
        Some(place)
    }

    /// Light that all tests share, so that it is prepared once.
    fn light(&self) {
        static SHARED: Mutex<()> = Mutex::new(());
        let shared = Path::new(env!("CARGO_TARGET_TMPDIR")).join("light");
        {
            let _one_at_a_time = SHARED.lock();
            costs(self.remap("light.json", "1").env("LOOKMATCH_CACHE", &shared).output().unwrap());
        }
        fs::create_dir(self.path("kept")).unwrap();
        for file in fs::read_dir(shared).unwrap().map(|file| file.unwrap().path()) {
            if file.extension().is_some_and(|extension| extension == "transport") {
                fs::copy(&file, self.path("kept").join(file.file_name().unwrap())).unwrap();
            }
        }
        fs::remove_file(self.path("renders.log")).ok();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The worker of the other tests, which takes some seconds for a render; in its text, some is replaced.
    fn write_worker(&self, seconds: f64, replaced: &[(&str, &str)]) {
        let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/worker.py")).unwrap();
        let render = "    elif request[\"request\"] == \"render\":\n";
        let more = format!(
            "{render}        import time; time.sleep({seconds}); print('x', file=open('renders.log', 'a'))\n"
        );
        let replaced = [&[(render, &*more)], replaced].concat();
        let text = replaced.iter().fold(text, |text, (old, new)| {
            assert!(text.contains(old), "{old}");
            text.replace(old, new)
        });
        fs::write(self.path("worker.py"), text).unwrap();
    }

    /// How many pictures were rendered so far, as the renderer has it.
    fn rendered(&self) -> usize {
        fs::read_to_string(self.path("renders.log")).map_or(0, |log| log.lines().count())
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lookmatch"));
        command.current_dir(self.folder.path()).env("LOOKMATCH_CACHE", self.path("kept")).args(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn remap(&self, output: &str, seed: &str) -> Command {
        let job = [
            "remap",
            "ward",
            "fake:plastic",
            "--vary",
            "source.roughness=0.1:0.3:0.1",
            "--fix",
            "specular=0.1",
        ];
        let how =
            ["--size", "16", "--start", "fake=python3 worker.py", "--json", "--seed", seed, "-o", output];
        self.command(&[&job[..], &how].concat())
    }

    /// A single picture by a renderer of some name: what is told of it, and the messages.
    fn rendering(&self, output: &str, name: &str, cache: &Path) -> (Json, String) {
        let start = format!("{name}=python3 worker.py");
        let material = format!("{name}:plastic:colour=0.5/0.25/0,alpha=0.125");
        let picture =
            ["render", "reference", "-m", &material, "--size", "16", "--samples", "4", "--seed", "7"];
        let how = ["--json", "--start", &start, "-o", output];
        let output =
            self.command(&[&picture[..], &how].concat()).env("LOOKMATCH_CACHE", cache).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        (serde_json::from_slice(&output.stdout).unwrap(), stderr(&output))
    }

    /// A remap that must succeed: what it tells of the renderer, and its messages.
    fn done(&self, mut command: Command) -> (Json, String) {
        costs(command.output().unwrap())
    }

    fn cache(&self, arguments: &[&str]) -> Output {
        self.command(&[&["cache"], arguments].concat()).output().unwrap()
    }

    fn cache_json(&self, arguments: &[&str]) -> Json {
        let output = self.cache(&[arguments, &["--json"]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn pictures(&self) -> u64 {
        self.cache_json(&["list"])["pictures"].as_u64().unwrap()
    }

    /// What Python's SQLite answers: the first column of all rows.
    fn sql(&self, sql: &str) -> Vec<Json> {
        let code = "import json, sqlite3, sys\nc = sqlite3.connect(sys.argv[1])\n\
                    rows = [r[0] for r in c.execute(sys.argv[2])]\nc.commit()\nprint(json.dumps(rows))";
        let output =
            Command::new("python3").args(["-c", code]).arg(self.database()).arg(sql).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn database(&self) -> PathBuf {
        self.path("kept/renders.sqlite")
    }

    fn probe(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn costs(output: Output) -> (Json, String) {
    let message = stderr(&output);
    assert!(output.status.success(), "{message}");
    let report: Json = serde_json::from_slice(&output.stdout).unwrap();
    (report["renderers"][0].clone(), message)
}

fn count(costs: &Json, what: &str) -> u64 {
    costs[what].as_u64().unwrap()
}

fn finished(child: Child) -> (Json, String) {
    costs(child.wait_with_output().unwrap())
}

#[test]
fn a_second_remap_renders_nothing() {
    let Some(place) = Place::new() else { return };
    let (first, _) = place.done(place.remap("a.json", "1"));
    let rendered = place.rendered();
    assert!(
        rendered > 10 && count(&first, "renders") == rendered as u64 && count(&first, "found") == 0,
        "{first}"
    );
    let (second, told) = place.done(place.remap("b.json", "1"));
    assert_eq!((count(&second, "renders"), count(&second, "found")), (0, rendered as u64), "{told}");
    assert!(told.contains("0 renders") && told.contains(&format!("{rendered} found")), "{told}");
    assert_eq!(place.rendered(), rendered);
    assert_eq!(place.probe("a.json"), place.probe("b.json"));

    // Another seed is other noise, and another picture.
    let (third, _) = place.done(place.remap("c.json", "2"));
    assert_eq!((count(&third, "found"), count(&third, "renders") > 10), (0, true), "{third}");
    assert_eq!(place.pictures(), count(&first, "renders") + count(&third, "renders"));
}

#[test]
fn single_pictures_are_found_and_readable_by_public_tools() {
    let Some(place) = Place::new() else { return };
    let first = place.rendering("a.exr", "fake", &place.path("kept")).0;
    // The same renderer by another name.
    let second = place.rendering("b.exr", "other", &place.path("kept")).0;
    assert_eq!((&first["is_found"], &second["is_found"]), (&false.into(), &true.into()));
    assert_eq!((&first["samples"], &second["samples"]), (&5.into(), &5.into()));
    let read = |name: &str| lookmatch_imaging::read(&place.path(name)).unwrap();
    assert_eq!(read("a.exr"), read("b.exr"));
    assert_eq!(place.rendered(), 1);

    let row = "SELECT json_array(renderer, version, model, parameters || '', light, size, samples, seed, created <= last_used, bytes > 300) FROM renders";
    let row: Json = serde_json::from_str(place.sql(row)[0].as_str().unwrap()).unwrap();
    let parameters: Json = serde_json::from_str(row[3].as_str().unwrap()).unwrap();
    assert_eq!(parameters, serde_json::json!({"alpha": 0.125, "colour": [0.5, 0.25, 0.0]}));
    let rest = serde_json::json!(["fake", "1.0", "plastic", row[3], "point, environment", 16, 4, 7, 1, 1]);
    assert_eq!(row, rest);
    assert_eq!(place.sql("SELECT lower(hex(substr(exr, 1, 4))) FROM pictures"), ["762f3101"], "an EXR file");
    let listed = place.cache_json(&["list"]);
    let group = &listed["groups"][0];
    assert_eq!(
        (&group["renderer"], &group["pictures"], &group["size"]),
        (&"fake".into(), &1.into(), &16.into())
    );
    assert_eq!(group["cpu_s"], 0.5, "what finding it saves");
    let text = String::from_utf8(place.cache(&["list"]).stdout).unwrap();
    assert!(text.contains("fake 1.0") && text.contains("1 pictures"), "{text}");
}

#[test]
fn other_versions_and_edited_workers_render_anew() {
    let Some(place) = Place::new() else { return };
    let (first, _) = place.done(place.remap("a.json", "1"));
    place.write_worker(0.0, &[("\"version\": \"1.0\"", "\"version\": \"1.1\"")]);
    let (newer, _) = place.done(place.remap("b.json", "1"));
    assert_eq!((count(&newer, "found"), &newer["renders"]), (0, &first["renders"]));
    // The author changed the picture, and forgot the version.
    place.write_worker(0.0, &[("gauss(0.0, 0.01)", "gauss(0.0, 0.011)")]);
    let (edited, _) = place.done(place.remap("c.json", "1"));
    assert_eq!(count(&edited, "found"), 0);
    place.write_worker(0.0, &[]);
    let (again, _) = place.done(place.remap("d.json", "1"));
    assert_eq!(count(&again, "renders"), 0, "all versions are kept");
    let listed = place.cache_json(&["list"]);
    let mut versions: Vec<&str> =
        listed["groups"].as_array().unwrap().iter().map(|group| group["version"].as_str().unwrap()).collect();
    versions.sort_unstable();
    versions.dedup();
    assert_eq!(versions, ["1.0", "1.1"]);
}

#[test]
fn two_programs_share_one_database() {
    let Some(place) = Place::new() else { return };
    place.write_worker(0.002, &[]);
    // Both make the file at once, too.
    let both = ["a.json", "b.json"].map(|output| place.remap(output, "1").spawn().unwrap());
    let [a, b] = both.map(finished);
    for (costs, told) in [&a, &b] {
        assert!(!told.contains("warning"), "{told}");
        assert_eq!(count(costs, "failed"), 0);
    }
    assert_eq!(place.probe("a.json"), place.probe("b.json"));
    let needed = count(&a.0, "renders") + count(&a.0, "found");
    assert_eq!(count(&b.0, "renders") + count(&b.0, "found"), needed);
    assert_eq!(place.pictures(), needed, "each picture is kept once");
    assert_eq!(place.cache_json(&["verify"])["pictures"], needed);
    assert_eq!(count(&place.done(place.remap("c.json", "1")).0, "renders"), 0);
}

#[test]
fn a_killed_program_loses_the_render_in_flight() {
    let Some(place) = Place::new() else { return };
    place.write_worker(0.02, &[]);
    let mut child = place.remap("a.json", "1").spawn().unwrap();
    let begin = Instant::now();
    while place.rendered() < 12 {
        assert!(begin.elapsed() < Duration::from_secs(120), "nothing was rendered");
        sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let rendered = place.rendered() as u64;
    fs::remove_file(place.path("a.json.partial")).ok();
    let (costs, told) = place.done(place.remap("a.json", "1"));
    assert!(!told.contains("warning"), "{told}");
    // One may have been on its way to the file, and one at work.
    let found = count(&costs, "found");
    assert!(found + 2 >= rendered && found >= 10, "{found} of {rendered}");
    assert!(count(&costs, "renders") > 0, "it was killed before it was done");
    assert_eq!(place.pictures(), found + count(&costs, "renders"));
}

#[test]
fn damaged_pictures_are_told_and_rendered_again() {
    let Some(place) = Place::new() else { return };
    let (first, _) = place.done(place.remap("a.json", "1"));
    let needed = count(&first, "renders");
    // One has a wrong byte, one lies under another's key, one is gone. Ids follow the order in which pictures arrived, which is another
    // every time, and some pictures are equal; descriptions lie in one order.
    let id = |k: usize| format!("(SELECT id FROM renders ORDER BY description LIMIT 1 OFFSET {k})");
    let damaged = "substr(exr, 1, 400) || x'5a5a' || substr(exr, 403)";
    place.sql(&format!("UPDATE pictures SET exr = {damaged} WHERE id = {}", id(3)));
    place.sql(&format!(
        "UPDATE pictures SET exr = (SELECT exr FROM pictures WHERE id = {}) WHERE id = {}",
        id(6),
        id(5)
    ));
    place.sql(&format!("DELETE FROM pictures WHERE id = {}", id(7)));
    let (second, told) = place.done(place.remap("b.json", "1"));
    let lines: Vec<&str> = told.lines().filter(|line| line.contains("damaged picture")).collect();
    assert_eq!(lines.len(), 3, "{told}");
    assert!(
        lines.iter().all(|line| line.starts_with("warning: ") && line.contains("fake:plastic")),
        "{told}"
    );
    assert_eq!((count(&second, "renders"), count(&second, "found")), (3, needed - 3));
    assert_eq!(place.probe("a.json"), place.probe("b.json"));
    let (third, told) = place.done(place.remap("c.json", "1"));
    assert_eq!((count(&third, "renders"), told.contains("warning")), (0, false), "{told}");

    // Found by looking for it.
    let changed = "replace(description, '\"model\":\"plastic\"', '\"model\":\"plastiC\"')";
    place.sql(&format!("UPDATE renders SET description = {changed} WHERE id = {}", id(20)));
    let output = place.cache(&["verify", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let verified: Json = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&verified["pictures"], verified["damaged"].as_array().unwrap().len()),
        (&(needed - 1).into(), 1)
    );
    assert!(stderr(&output).contains("plastiC"), "{}", stderr(&output));
    assert_eq!(place.cache_json(&["verify"])["damaged"], serde_json::json!([]));
    assert_eq!(count(&place.done(place.remap("d.json", "1")).0, "renders"), 1);
}

#[test]
fn a_damaged_file_is_set_aside_and_what_is_intact_saved() {
    let Some(place) = Place::new() else { return };
    let (first, _) = place.done(place.remap("a.json", "1"));
    let needed = count(&first, "renders");
    let intact = fs::read(place.database()).unwrap();
    let page = 4096;
    for damage in ["header", "middle", "end", "text"] {
        let mut bytes = intact.clone();
        match damage {
            "header" => bytes[..64].fill(0x33),
            "middle" => bytes[7 * page..12 * page].fill(0xa5),
            "end" => bytes.truncate(intact.len() / 2 + 100),
            _ => bytes = b"no database at all".repeat(1000),
        }
        fs::write(place.database(), bytes).unwrap();
        let (costs, told) = place.done(place.remap("b.json", "1"));
        assert_eq!(told.lines().filter(|line| line.starts_with("warning: ")).count(), 1, "{damage}: {told}");
        assert!(told.contains("renders.sqlite") && told.contains("damaged"), "{damage}: {told}");
        assert_eq!(place.probe("a.json"), place.probe("b.json"), "{damage}");
        assert_eq!(count(&costs, "renders") + count(&costs, "found"), needed, "{damage}");
        let (again, told) = place.done(place.remap("b.json", "1"));
        assert_eq!((count(&again, "renders"), told.contains("warning")), (0, false), "{damage}: {told}");
        assert_eq!(place.cache_json(&["verify"])["pictures"], needed, "{damage}");
    }
}

#[test]
fn the_most_recently_used_pictures_stay() {
    let Some(place) = Place::new() else { return };
    let old = place.done(place.remap("a.json", "1")).0;
    place.done(place.remap("b.json", "2"));
    assert_eq!(count(&place.done(place.remap("a.json", "1")).0, "renders"), 0, "used once more");
    let bytes = place.cache_json(&["list"])["bytes"].as_u64().unwrap();
    let most = bytes * 3 / 4;
    let collected = place.cache_json(&["gc", "--max-size", &format!("{most}B")]);
    let (removed, left) = (collected["removed"].as_u64().unwrap(), collected["pictures"].as_u64().unwrap());
    assert!(removed > 0 && left >= count(&old, "renders"), "{collected}");
    let on_disk: u64 = ["renders.sqlite", "renders.sqlite-wal"]
        .iter()
        .filter_map(|name| Some(fs::metadata(place.path("kept").join(name)).ok()?.len()))
        .sum();
    assert!(on_disk <= most && on_disk > most / 2, "{on_disk} of {most}");
    assert_eq!(count(&place.done(place.remap("a.json", "1")).0, "renders"), 0);
    assert_eq!(count(&place.done(place.remap("b.json", "2")).0, "renders"), removed);

    let all = place.pictures();
    assert_eq!(place.cache_json(&["gc", "--max-size", "2GiB"])["removed"], 0);
    assert_eq!(place.cache_json(&["gc", "--max-size", "0"])["removed"], all);
    assert_eq!(place.pictures(), 0);
    for wrong in ["much", "-1MB", "5 apples"] {
        let output = place.cache(&["gc", &format!("--max-size={wrong}")]);
        let told = stderr(&output);
        assert!(output.status.code() == Some(2) && told.contains(wrong) && told.contains("500MB"), "{told}");
    }
}

#[test]
fn nothing_is_kept_where_the_user_wants_nothing_kept() {
    let Some(place) = Place::new() else { return };
    for _ in 0..2 {
        let (picture, told) = place.rendering("a.exr", "fake", Path::new("off"));
        assert!(picture["is_found"] == false && !told.contains("warning"), "{picture} {told}");
    }
    assert_eq!(place.rendered(), 2);
    let output = place.command(&["cache", "list"]).env("LOOKMATCH_CACHE", "off").output().unwrap();
    assert!(
        output.status.code() == Some(2) && stderr(&output).contains("LOOKMATCH_CACHE"),
        "{}",
        stderr(&output)
    );
    // Looking at what is not there makes nothing.
    assert_eq!(place.pictures(), 0);
    assert!(!place.database().exists() && !place.path("off").exists());
}

/// Folders that cannot be used: below a file, of a system that takes no files, read-only, and one whose database is a folder.
#[test]
fn a_folder_that_cannot_be_used_is_no_failure() {
    let Some(place) = Place::new() else { return };
    fs::write(place.path("file"), "").unwrap();
    fs::create_dir_all(place.path("odd/renders.sqlite")).unwrap();
    let mut folders = vec![place.path("file/kept"), place.path("odd")];
    if cfg!(target_os = "linux") {
        folders.push(Path::new("/proc/lookmatch").to_owned());
    }
    let locked = place.path("locked");
    fs::create_dir(&locked).unwrap();
    let mut permissions = fs::metadata(&locked).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&locked, permissions).unwrap();
    // Those who may do everything can write there all the same.
    if fs::write(locked.join("try"), "").is_err() {
        folders.push(locked);
    }
    for (made, folder) in folders.iter().enumerate() {
        let (picture, told) = place.rendering("a.exr", "fake", folder);
        assert_eq!((&picture["is_found"], place.rendered()), (&false.into(), made + 1));
        let lines = told.lines().filter(|line| line.starts_with("warning: pictures are not kept: "));
        assert_eq!(lines.count(), 1, "{told}");
        assert!(told.contains(folder.join("renders.sqlite").to_str().unwrap()), "{told}");
    }
}
