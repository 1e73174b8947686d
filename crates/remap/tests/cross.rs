//! Remaps with a renderer of which only pictures are known: a stand-in that renders our own GGX with noise, and fails when told.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use lookmatch_imaging::Image;
use lookmatch_materials::{Description, Levels, Material, by_name};
use lookmatch_remap::{
    Assignment, CrossStage, Options, Plan, Probe, RemapError, RendererRecord, Sampling, Shot, Side, Studio,
    Vary, apply, remap_across,
};
use lookmatch_rendering::{Illumination, Part, Renderer, Scene, TransportCache};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::json;

/// Relative noise of one sample.
const NOISE: f32 = 0.4;

/// The light of the small scene takes seconds to prepare, and is the same in all tests.
fn cache() -> TransportCache {
    TransportCache::new(concat!(env!("CARGO_TARGET_TMPDIR"), "/transport"))
}

struct StandIn {
    models: Vec<Description>,
    scenes: Mutex<HashMap<String, Arc<Renderer>>>,
    /// Roughness from which on renders fail.
    fails_from: f64,
    renders: AtomicUsize,
    seeds: Mutex<Vec<u32>>,
}

impl StandIn {
    fn new(fails_from: f64) -> Arc<Self> {
        let interval = |min: f64, max: f64| json!({"min": min, "max": max});
        let description = json!({
            "name": "plastic",
            "parameters": [
                {"name": "kd", "role": "base-colour", "kind": "colour", "default": [0.5, 0.5, 0.5], "valid": interval(0.0, 1.0)},
                {"name": "index", "role": "refractive-index", "kind": "number", "default": 1.5, "valid": interval(1.01, 3.0)},
                {"name": "alpha", "role": "roughness", "kind": "number", "default": 0.2, "valid": interval(0.01, 1.0)},
            ],
            "surveyed": ["alpha"], "searched": ["alpha"],
        });
        let models = vec![serde_json::from_value(description).unwrap()];
        Arc::new(Self {
            models,
            scenes: Mutex::default(),
            fails_from,
            renders: AtomicUsize::new(0),
            seeds: Mutex::default(),
        })
    }

    fn record(&self) -> RendererRecord {
        RendererRecord { name: "stand-in".into(), version: "1".into(), models: self.models.clone() }
    }
}

impl Studio for StandIn {
    fn name(&self) -> &str {
        "stand-in"
    }

    fn has_noise(&self) -> bool {
        true
    }

    fn set_scene(&self, name: &str, scene: &Scene, light: Illumination, size: usize) -> Result<(), String> {
        let renderer = Renderer::cached(scene, light, size, &cache(), &|_| ()).map_err(|e| e.to_string())?;
        self.scenes.lock().unwrap().insert(name.into(), Arc::new(renderer));
        Ok(())
    }

    fn render(&self, shots: &[Shot]) -> Vec<Result<Image, String>> {
        let shot = |shot: &Shot| {
            self.renders.fetch_add(1, Ordering::Relaxed);
            self.seeds.lock().unwrap().push(shot.seed);
            let [index, alpha] = ["index", "alpha"].map(|name| shot.material.number(name).unwrap());
            if alpha >= self.fails_from {
                return Err(format!("no picture of alpha {alpha}"));
            }
            // Its body is darker than what is written: as under an interface.
            let kd = shot.material.number("kd").unwrap();
            let ours = format!("ggx:diffuse={},ior={index},roughness={alpha}", 0.8 * kd);
            let renderer = self.scenes.lock().unwrap()[shot.scene].clone();
            let mut image = renderer.render(&Material::parse(&ours).unwrap(), Part::Full);
            let mut random = Pcg64Mcg::seed_from_u64(shot.seed.into());
            let amplitude = NOISE / (shot.samples as f32).sqrt();
            for value in image.pixels_mut().as_flattened_mut() {
                *value *= 1.0 + amplitude * random.random_range(-1.7..1.7);
            }
            Ok(image)
        };
        shots.iter().map(shot).collect()
    }
}

fn vary(side: Side, name: &str, (min, max, step): (f64, f64, f64)) -> Vary {
    Vary { side: Some(side), name: name.into(), levels: Levels::new(min, max, step) }
}

fn run(from: &str, to: &str, studio: &Arc<StandIn>, vary: Vec<Vary>) -> Result<Probe, RemapError> {
    studio.models[0].adopt("stand-in").unwrap();
    let sampling = Sampling { samples: 16, most: 256 };
    let renderers = vec![studio.record()];
    // Ours has an index and a switch of its own: roughness alone is at stake.
    let side = if from == "ggx" { Side::Source } else { Side::Target };
    let hold =
        |(name, value): (&str, &str)| Assignment { side: Some(side), name: name.into(), value: value.into() };
    let fix = [("ior", "1.5"), ("specular", "1")].map(hold).into();
    let options = Options { size: Some(32), fix, vary, sampling, renderers, ..Options::default() };
    let plan = Plan::new(by_name(from).unwrap(), by_name(to).unwrap(), &options).unwrap();
    let studios: [Arc<dyn Studio>; 1] = [studio.clone()];
    let stage = CrossStage::cached(&plan, &studios, &cache(), &|_| ()).unwrap();
    remap_across(&plan, &stage, None, &mut |_| {}, &|| false)
}

const ROUGHNESSES: (f64, f64, f64) = (0.1, 0.5, 0.1);
const LATTICE: (f64, f64, f64) = (0.02, 0.8, 0.01);

#[test]
fn parameters_come_back_from_pictures_alone() {
    let studio = StandIn::new(2.0);
    let axes =
        |from: &str, to: &str| vec![vary(Side::Source, from, ROUGHNESSES), vary(Side::Target, to, LATTICE)];
    let there = run("ggx", "stand-in:plastic", &studio, axes("roughness", "alpha")).unwrap();
    let back = run("stand-in:plastic", "ggx", &studio, axes("alpha", "roughness")).unwrap();
    for probe in [&there, &back] {
        assert_eq!(probe.entries.len(), 5);
        for entry in &probe.entries {
            assert!((entry.source[0] - entry.target[0]).abs() < 0.0101, "{entry:?}");
            let noise = entry.noise.unwrap();
            let within = |c: usize| entry.nrmsd[c] < 1.2 * noise.nrmsd[c];
            assert!((0..3).all(within), "{entry:?}");
            assert!(noise.fitness > 0.0);
        }
    }
    // The stand-in's body is four fifths as bright as its colour says.
    let gain = |probe: &Probe| probe.entries.iter().map(|e| e.body.unwrap()[1]).sum::<f64>() / 5.0;
    assert!((gain(&there) - 1.25).abs() < 0.03, "{}", gain(&there));
    assert!((gain(&back) - 0.8).abs() < 0.03, "{}", gain(&back));
}

#[test]
fn a_probe_can_be_read_and_applied_without_the_renderer() {
    let studio = StandIn::new(2.0);
    let axes = vec![vary(Side::Source, "roughness", (0.2, 0.3, 0.1)), vary(Side::Target, "alpha", LATTICE)];
    let probe = run("ggx", "stand-in:plastic", &studio, axes).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("probe.json");
    probe.write(&path).unwrap();
    let read = Probe::read(&path).unwrap();
    assert_eq!(read, probe);
    let source = Material::parse("ggx:diffuse=0.4/0.2/0.1,roughness=0.25").unwrap();
    let target = apply(&read, &source, false).unwrap().target;
    assert!((target.number("kd").unwrap() - 0.5).abs() < 0.02, "{target}");
    assert!((target.number("alpha").unwrap() - 0.25).abs() < 0.02, "{target}");
}

#[test]
fn what_cannot_be_rendered_is_marked_and_the_rest_goes_on() {
    // Some targets fail: the search goes around them.
    let studio = StandIn::new(0.6);
    let axes = vec![vary(Side::Source, "roughness", ROUGHNESSES), vary(Side::Target, "alpha", LATTICE)];
    let probe = run("ggx", "stand-in:plastic", &studio, axes).unwrap();
    assert!(probe.entries.iter().all(|e| e.failed.is_none() && e.target[0] < 0.6));
    // Some sources fail: their entries say why.
    let studio = StandIn::new(0.35);
    let axes = vec![vary(Side::Source, "alpha", ROUGHNESSES), vary(Side::Target, "roughness", LATTICE)];
    let probe = run("stand-in:plastic", "ggx", &studio, axes).unwrap();
    let failed: Vec<bool> = probe.entries.iter().map(|e| e.failed.is_some()).collect();
    assert_eq!(failed, [false, false, false, true, true]);
    assert!(probe.entries[4].failed.as_ref().unwrap().contains("no picture of alpha"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("probe.json");
    probe.write(&path).unwrap();
    assert_eq!(Probe::read(&path).unwrap(), probe);
    let outside = Material::parse("stand-in:plastic:alpha=0.45").unwrap();
    let error = apply(&probe, &outside, false).unwrap_err().to_string();
    assert!(error.contains("no result at [0.4]"), "{error}");
    // All fail: so does the remap.
    let studio = StandIn::new(0.0);
    let axes = vec![vary(Side::Source, "alpha", ROUGHNESSES), vary(Side::Target, "roughness", LATTICE)];
    let error = run("stand-in:plastic", "ggx", &studio, axes).unwrap_err();
    assert!(matches!(error, RemapError::Render(_)), "{error}");
}

#[test]
fn known_pictures_are_added_to_and_not_rendered_again() {
    let studio = StandIn::new(2.0);
    let axes =
        vec![vary(Side::Source, "roughness", ROUGHNESSES), vary(Side::Target, "alpha", (0.1, 0.5, 0.1))];
    let probe = run("ggx", "stand-in:plastic", &studio, axes).unwrap();
    // Five targets that five sources compare with and up to three bodies of each match: two lights, two halves, three batches.
    let renders = studio.renders.load(Ordering::Relaxed);
    assert!(probe.totals.evaluations >= 5 * 3 && renders <= (5 + 5 * 3) * 2 * 2 * 3, "{renders}");
    let mut seeds = studio.seeds.lock().unwrap().clone();
    seeds.sort_unstable();
    seeds.dedup();
    assert!(seeds.len() >= 2, "{seeds:?}");
}
