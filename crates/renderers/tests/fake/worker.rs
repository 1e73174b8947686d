//! A renderer that misbehaves as it is told to; for the tests of the pool.
//!
//! Its one model, `fake`, has the values `mode` (what it does instead of rendering), `once` (only the first of all workers
//! does it) and `level` (the colour of its pictures). `lookmatch-fake-worker MODE` misbehaves from the start. The variable
//! FAKE_FOLDER names a folder in which it notes what happens.
//!
//! `lookmatch-fake-worker tool PROGRAM ARGUMENTS` is a tool that renders on such a worker without end, to be killed.

use std::fs::{self, OpenOptions};
use std::io::{self, BufRead, Read, Write};
use std::path::PathBuf;
use std::process::{Command, exit};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread::{self, sleep};
use std::time::Duration;

use lookmatch_renderers::{Job, Launch, Pool, PoolOptions};
use lookmatch_rendering::{Illumination, Scene};
use serde_json::{Value, json};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first().map_or("fine", String::as_str) {
        "tool" => tool(&arguments[1], &arguments[2..]),
        mode => worker(mode),
    }
}

fn folder() -> PathBuf {
    std::env::var_os("FAKE_FOLDER").map_or_else(std::env::temp_dir, PathBuf::from)
}

/// Notes something in a file that all workers share.
fn note(text: &str) {
    let notes = OpenOptions::new().create(true).append(true).open(folder().join("notes"));
    notes.unwrap().write_all(format!("{text} {}\n", std::process::id()).as_bytes()).unwrap();
}

fn worker(start: &str) {
    note("start");
    match start {
        "dies-at-start" => {
            eprintln!("no licence server");
            exit(7)
        }
        "dies-later" if fs::exists(folder().join("stop-starting")).unwrap() => exit(8),
        "hangs-at-start" => sleep(Duration::from_secs(3600)),
        "slow-start" => sleep(Duration::from_millis(2500)),
        _ => (),
    }
    let requests = read_requests(start);
    let (mut size, mut material) = (0, Value::Null);
    for request in requests {
        let id = request["id"].clone();
        note(request["request"].as_str().unwrap());
        match request["request"].as_str().unwrap() {
            "hello" => say(&hello(start, &id), &[]),
            "scene" if request["scene"] == "refused" => say(&json!({"id": id, "error": "plane: no"}), &[]),
            "scene" => {
                size = request["size"].as_u64().unwrap();
                say(&json!({"id": id}), &[]);
            }
            "material" => {
                material = request["values"].clone();
                say(&json!({"id": id}), &[]);
            }
            "render" => render(&id, size, &material),
            "shutdown" if start != "ignores-shutdown" => {
                say(&json!({"id": id}), &[]);
                exit(0)
            }
            _ => sleep(Duration::from_secs(3600)),
        }
    }
    if start == "ignores-shutdown" {
        sleep(Duration::from_secs(3600));
    }
}

/// Requests as they come; the end of the input ends the process in the middle of a render.
fn read_requests(start: &str) -> Receiver<Value> {
    let (ignores_end, is_deaf) = (start == "ignores-shutdown", start == "deaf");
    let (sender, requests) = channel();
    thread::spawn(move || {
        let mut stdin = io::stdin().lock();
        let mut line = String::new();
        while stdin.read_line(&mut line).unwrap_or(0) > 0 {
            let request: Value = serde_json::from_str(&line).unwrap();
            let bytes = request["bytes"].as_u64().unwrap_or(0);
            io::copy(&mut stdin.by_ref().take(bytes), &mut io::sink()).unwrap();
            sender.send(request).unwrap();
            line.clear();
            if is_deaf {
                break;
            }
        }
        if !ignores_end && !is_deaf {
            exit(0);
        }
        sleep(Duration::from_secs(3600));
    });
    requests
}

fn say(message: &Value, data: &[u8]) {
    let mut stdout = io::stdout().lock();
    writeln!(stdout, "{message}").unwrap();
    stdout.write_all(data).unwrap();
    stdout.flush().unwrap();
}

fn hello(start: &str, id: &Value) -> Value {
    json!({
        "id": id,
        "protocol": if start == "other-protocol" { 2 } else { 1 },
        "name": if start == "odd-name" { "Fake Renderer" } else { "fake" },
        "version": "1.0", "licence": "MIT",
        "models": [{"name": "fake"}],
        "capabilities": {"deterministic": "exact", "seeds": false, "noise": false, "samples": "nothing",
            "lights": if start == "deaf" { json!(["environment"]) } else { json!(["point"]) }, "threads": "all", "cancel": false, "interreflection": false},
        "check": {"lambert": {"model": "fake", "values": {}, "parameter": "colour"}, "mirror": null},
        "approximations": ["it does not render"],
    })
}

fn render(id: &Value, size: u64, material: &Value) {
    let level = material["level"].as_f64().unwrap_or(0.5) as f32;
    let mut mode = material["mode"].as_str().unwrap_or("fine");
    if material["once"] == true && fs::create_dir(folder().join("done")).is_err() {
        mode = "fine";
    }
    let picture = |size: u64, level: f32| {
        let answer = json!({"id": id, "width": size, "height": size, "samples": 4, "cpu_s": 0.5, "wall_s": 0.25,
            "noise": 0.125, "bytes": 12 * size * size});
        say(&answer, &level.to_le_bytes().repeat(3 * (size * size) as usize));
    };
    match mode {
        "crash" => {
            eprintln!("loading\nfatal: out of luck");
            exit(3)
        }
        "abort" => std::process::abort(),
        "hang" => {
            eprintln!("thinking");
            sleep(Duration::from_secs(3600));
        }
        "hang-with-children" => {
            // One in the group of the worker, and one in a group of its own, as browsers are.
            let mut beside = Command::new("sleep").arg("3600").spawn().unwrap();
            let mut alone = Command::new("sleep");
            std::os::unix::process::CommandExt::process_group(&mut alone, 0);
            let mut alone = alone.arg("3600").spawn().unwrap();
            note(&format!("alone {}", alone.id()));
            beside.wait().and(alone.wait()).unwrap();
        }
        "garbage" => {
            eprintln!("saving");
            println!("Saved: /tmp/picture.png");
            sleep(Duration::from_secs(3600));
        }
        "binary" => io::stdout().write_all(&[0xff; 1 << 16]).unwrap(),
        "wrong-id" => say(&json!({"id": 4711}), &[]),
        "no-size" => say(&json!({"id": id}), &[]),
        "wrong-size" => picture(size - 1, level),
        "too-large" => picture(size + 1, level),
        "short" => {
            say(&json!({"id": id, "width": size, "height": size, "bytes": 12 * size * size}), b"half");
            exit(0)
        }
        "no-bytes" => {
            let answer =
                json!({"id": id, "width": size, "height": size, "samples": 1, "cpu_s": 0, "wall_s": 0});
            say(&answer, &[]);
        }
        "nan" => picture(size, f32::NAN),
        "black" => picture(size, 0.0),
        "error" => say(&json!({"id": id, "error": "alpha is 7; expected 0 to 1"}), &[]),
        "leak" => {
            std::mem::forget(std::hint::black_box(vec![1_u8; 200 << 20]));
            picture(size, level);
        }
        "progress" => {
            for k in 0..10 {
                sleep(Duration::from_millis(300));
                say(&json!({"id": id, "progress": f64::from(k) / 10.0}), &[]);
            }
            picture(size, level);
        }
        "chatter" => {
            for line in 0..20_000 {
                eprintln!("line {line}: {}", "blah ".repeat(20));
            }
            eprint!("{}", "x".repeat(1 << 20));
            picture(size, level);
        }
        _ => {
            sleep(Duration::from_millis(20));
            picture(size, level);
        }
    }
}

/// Renders on a worker that hangs.
fn tool(program: &str, arguments: &[String]) {
    let launch =
        Launch { program: program.into(), args: arguments.iter().map(Into::into).collect(), env: Vec::new() };
    let pool = Pool::start(launch, PoolOptions::default(), Arc::new(|| false)).unwrap();
    pool.scene("lit", &Scene::reference(), Illumination::Point, 8).unwrap();
    let Value::Object(values) = json!({"mode": "hang"}) else { unreachable!() };
    let job = Job { scene: "lit".into(), model: "fake".into(), values, samples: 1, seed: 0 };
    println!("{:?}", pool.render(&[job]));
}
