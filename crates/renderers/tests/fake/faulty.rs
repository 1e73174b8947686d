//! A renderer that draws the closed forms, with noise, and gets one thing wrong; for the tests of the check.
//!
//! `lookmatch-faulty-worker MISTAKE`; any other word is no mistake.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Read, Write};
use std::process::exit;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use glam::DVec3;
use lookmatch_imaging::{Image, srgb_encode};
use lookmatch_rendering::{Camera, Plane, PointLight, Scene, Sphere};
use serde_json::{Value, json};

#[path = "../../src/check/closed_form.rs"]
#[allow(dead_code)]
mod closed_form;

use closed_form::{Finish, Sky, Texels, World};

fn main() {
    let mistake = std::env::args().nth(1).unwrap_or_default();
    let mut worker =
        Worker { mistake, scenes: BTreeMap::new(), finish: Finish::Lambert([0.5; 3]), renders: 0 };
    for (request, data) in read_requests(worker.has("lingers")) {
        let (mut answer, data) = match worker.answer(&request, &data) {
            Ok(answer) => answer,
            Err(error) => (json!({ "error": error }), Vec::new()),
        };
        answer["id"] = request["id"].clone();
        let mut stdout = io::stdout().lock();
        writeln!(stdout, "{answer}").unwrap();
        stdout.write_all(&data).and_then(|()| stdout.flush()).unwrap();
        if request["request"] == "shutdown" {
            exit(if worker.has("exit-status") { 3 } else { 0 });
        }
    }
}

/// Requests as they come; the end of the input ends the process in the middle of a render, unless it lingers.
fn read_requests(lingers: bool) -> Receiver<(Value, Vec<u8>)> {
    let (sender, requests) = channel();
    thread::spawn(move || {
        let mut stdin = io::stdin().lock();
        let mut line = String::new();
        while stdin.read_line(&mut line).unwrap_or(0) > 0 {
            let request: Value = serde_json::from_str(&line).unwrap();
            let mut data = vec![0; request["bytes"].as_u64().unwrap_or(0) as usize];
            stdin.read_exact(&mut data).unwrap();
            sender.send((request, data)).unwrap();
            line.clear();
        }
        if lingers {
            thread::sleep(Duration::from_secs(60));
        }
        exit(0);
    });
    requests
}

struct Worker {
    mistake: String,
    scenes: BTreeMap<String, (usize, Scene, Option<Sky>)>,
    finish: Finish,
    renders: u64,
}

type Answer = Result<(Value, Vec<u8>), String>;

impl Worker {
    fn has(&self, mistake: &str) -> bool {
        self.mistake == mistake
    }

    fn answer(&mut self, request: &Value, data: &[u8]) -> Answer {
        let nothing = Ok((json!({}), Vec::new()));
        match request["request"].as_str().unwrap() {
            "hello" => Ok((self.hello(), Vec::new())),
            "scene" => {
                self.scene(request, data);
                nothing
            }
            "material" => {
                self.finish = self.material(request)?;
                nothing
            }
            "render" => self.render(request),
            "shutdown" => nothing,
            _ if self.has("accepts-anything") => nothing,
            other => Err(format!(
                "unknown request '{other}'; known are hello, scene, material, render and shutdown"
            )),
        }
    }

    fn hello(&self) -> Value {
        let range = json!({ "min": 0.0, "max": 1.0 });
        let colour = |name: &str, role: &str| json!({ "name": name, "role": role, "kind": "colour", "default": [0.5, 0.5, 0.5], "valid": range });
        let model = |parameter: Value| {
            json!({ "name": parameter["role"].as_str().unwrap().split('-').next(), "parameters": [parameter],
                "surveyed": [parameter["name"]], "searched": [parameter["name"]], "linear": [parameter["name"]] })
        };
        let mut blurred = Vec::new();
        if self.has("declared-blur") {
            blurred.push("The environment is blurred.");
        }
        json!({
            "protocol": 1, "name": "faulty", "version": "1.0", "licence": "MIT",
            "models": [model(colour("albedo", "diffuse-reflectance")), model(colour("tint", "specular-reflectance"))],
            "capabilities": {"deterministic": "exact", "seeds": true, "noise": true, "samples": "points of a pixel",
                "lights": ["point", "environment"], "threads": "all", "cancel": false, "interreflection": self.has("no-bounce")},
            "check": {"lambert": {"model": "diffuse", "values": {}, "parameter": "albedo"},
                "mirror": {"model": "specular", "values": {"tint": [1.0, 1.0, 1.0]}}},
            "approximations": blurred,
        })
    }

    fn material(&self, request: &Value) -> Result<Finish, String> {
        let colour = |name: &str| serde_json::from_value::<[f64; 3]>(request["values"][name].clone());
        let finish = match request["model"].as_str().unwrap() {
            "diffuse" => Finish::Lambert(colour("albedo").map_err(|error| error.to_string())?),
            "specular" => Finish::Mirror(colour("tint").map_err(|error| error.to_string())?),
            other => return Err(format!("model is '{other}'; expected diffuse or specular")),
        };
        if self.has("dark-nan") && matches!(finish, Finish::Mirror([0.0, ..])) {
            return Ok(Finish::Mirror([f64::NAN; 3]));
        }
        Ok(match finish {
            Finish::Mirror(tint) if self.has("squared-tint") => Finish::Mirror(tint.map(|v| v * v)),
            finish => finish,
        })
    }

    fn scene(&mut self, request: &Value, data: &[u8]) {
        if self.has("prints") {
            println!("Loading scene");
        }
        let read = |name: &str| request[name].clone();
        let spheres = request["spheres"].as_array().unwrap().iter().map(|s| Sphere {
            centre: serde_json::from_value(s["centre"].clone()).unwrap(),
            radius: s["radius"].as_f64().unwrap(),
            diffuse: None,
        });
        let mut camera: Camera = serde_json::from_value(read("camera")).unwrap();
        let mut plane: Option<Plane> = serde_json::from_value(read("plane")).unwrap();
        let mut point_lights: Vec<PointLight> = serde_json::from_value(read("point_lights")).unwrap();
        if self.has("light-times-pi") {
            point_lights
                .iter_mut()
                .for_each(|light| light.intensity = light.intensity.map(|i| i * std::f64::consts::PI));
        }
        if self.has("ignores-up") {
            camera.up = [0.0, 1.0, 0.0];
        }
        if self.has("diagonal-fov") {
            let tangent = (camera.vertical_fov.to_radians() / 2.0).tan() / 2.0_f64.sqrt();
            camera.vertical_fov = 2.0 * tangent.atan().to_degrees();
        }
        if let Some(plane) = plane.as_mut().filter(|_| self.has("exchanged-checks")) {
            std::mem::swap(&mut plane.light, &mut plane.dark);
        }
        let size = request["size"].as_u64().unwrap() as usize;
        let scene = Scene {
            name: String::new(),
            camera,
            spheres: spheres.collect(),
            meshes: Vec::new(),
            plane,
            point_lights,
            environment: None,
        };
        let width = request["environment"]["width"].as_u64();
        let texels = match self.mistake.as_str() {
            "nearest" => Texels::Nearest,
            "texel-corners" => Texels::Shifted(0.5, 0.5),
            _ => Texels::Linear,
        };
        let sky = width.map(|width| Sky::new(self.map(data, width as usize), texels));
        self.scenes.insert(request["scene"].as_str().unwrap().into(), (size, scene, sky));
    }

    fn map(&self, data: &[u8], width: usize) -> Image {
        let numbers: Vec<f32> =
            data.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        let pixels = numbers.as_chunks::<3>().0;
        let height = pixels.len() / width;
        let from = |x: usize, y: usize| match self.mistake.as_str() {
            "map-rolled" => ((x + width - width / 4) % width, y),
            "map-mirrored" => (width - 1 - x, y),
            "map-flipped" => (x, height - 1 - y),
            _ => (x, y),
        };
        let map = Image::from_fn(width, height, |x, y| {
            let (x, y) = from(x, y);
            pixels[y * width + x]
        });
        let is_blurred = self.mistake.ends_with("blur");
        let mean = |x: usize, y: usize, c: usize| {
            (0..16).map(|k| map.get((x + width + k - 8) % width, y)[c]).sum::<f32>() / 16.0
        };
        if is_blurred { Image::from_fn(width, height, |x, y| [0, 1, 2].map(|c| mean(x, y, c))) } else { map }
    }

    fn render(&mut self, request: &Value) -> Answer {
        let name = request["scene"].as_str().unwrap();
        let (size, scene, sky) =
            self.scenes.get(name).ok_or_else(|| format!("scene is '{name}', which is unknown"))?;
        let mut world = World::new(scene, sky.clone(), self.finish);
        world.has_shadows = !self.has("no-shadow");
        if self.has("bounce") {
            world = world.with_bounce();
        }
        if self.has("row-off") {
            world.view.shift = [0.0, 2.0 / *size as f64];
        }
        self.renders += 1;
        let asked = request["samples"].as_u64().unwrap();
        let samples = if self.has("ignores-samples") { 4 } else { asked };
        let seed = match self.mistake.as_str() {
            "ignores-seeds" => 1,
            "unsteady" => self.renders,
            _ => request["seed"].as_u64().unwrap(),
        };
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1);
        let picture = Image::from_fn(*size, *size, |x, y| {
            let mut point = || {
                let (x, y) = (x as f64 + random.next(), y as f64 + random.next());
                world.seen(x / *size as f64, y / *size as f64).0
            };
            let sum: DVec3 = (0..samples).map(|_| point()).sum();
            (sum / samples as f64).as_vec3().to_array().map(|v| self.encoded(v))
        });
        let last = size - 1;
        let at = |x: usize, y: usize| match self.mistake.as_str() {
            "flipped-rows" => picture.get(x, last - y),
            "mirrored-columns" => picture.get(last - x, y),
            "bgr" => [2, 1, 0].map(|c| picture.get(x, y)[c]),
            _ => picture.get(x, y),
        };
        let pixels = (0..size * size).flat_map(|index| at(index % size, index / size));
        let data: Vec<u8> = pixels.flat_map(f32::to_le_bytes).collect();
        let answer = json!({ "width": size, "height": size, "samples": asked, "cpu_s": 0.1, "wall_s": 0.1, "bytes": data.len() });
        Ok((answer, data))
    }

    fn encoded(&self, value: f32) -> f32 {
        match self.mistake.as_str() {
            "srgb" => srgb_encode(value),
            "clipped" => value.min(1.0),
            "power" => value.powf(0.8),
            _ => value,
        }
    }
}

/// Marsaglia's xorshift64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}
