//! What GSM and Eq. 3 take, of pictures as large as the paper's.

use std::hint::black_box;
use std::time::Instant;

use lookmatch_imaging::{Fitness, Image, ProbeImages, ProbePixels, gsm_map, lab_planes, squared_distance};

use crate::{Cell, Row, Table};

/// Side of the pictures in pixels.
const SIDE: usize = 512;
/// Times that each is measured.
const RUNS: usize = 9;

pub(super) fn table() -> anyhow::Result<Table> {
    let (a, b) = (picture(0.9), picture(1.1));
    let images = |image: &Image| ProbeImages {
        diffuse_point: image.clone(),
        diffuse_environment: image.clone(),
        full_point: image.clone(),
        full_environment: image.clone(),
    };
    let [all_a, all_b] = [&a, &b].map(|image| ProbePixels::from(&images(image)));
    let gsm = median(|| drop(black_box(gsm_map(&a, &b))));
    let exact = median(|| drop(black_box(Fitness::default().evaluate_pixels(&all_a, &all_b, None))));
    let planes = |image: &Image| {
        let mut planes = vec![0.0; 3 * image.pixels().len()];
        lab_planes(image.pixels(), &mut planes);
        planes
    };
    let converted = median(|| {
        black_box(squared_distance(&planes(&a), &planes(&b)));
    });
    let (planes_a, planes_b) = (planes(&a), planes(&b));
    let distance = median(|| {
        black_box(squared_distance(&planes_a, &planes_b));
    });
    let row = |name: &str, seconds: f64, paper: &str| Row {
        name: name.into(),
        cells: vec![Cell::Text(format!("{:.2} ms", 1e3 * seconds)), Cell::Text(paper.into())],
        is_main: false,
    };
    Ok(Table {
        title: format!("Run time at {SIDE} x {SIDE} pixels"),
        about: "The median of some runs on one core. A search converts each picture to CIELAB once, and compares it many times.".into(),
        columns: ["", "here", "the paper"].map(str::to_owned).into(),
        rows: vec![
            row("GSM of a pair of pictures", gsm, "0.23 s"),
            row("Eq. 3 in f64, all four pairs of pictures with conversion", exact, ""),
            row("Eq. 3, one pair, with conversion", converted, "0.07 s"),
            row("Eq. 3, one pair, as a search compares them", distance, ""),
        ],
    })
}

/// A bright blot on waves.
fn picture(gain: f32) -> Image {
    Image::from_fn(SIDE, SIDE, |x, y| {
        let [x, y] = [x, y].map(|v| v as f32 / SIDE as f32 - 0.5);
        let wave = 0.3 + 0.2 * (40.0 * x).sin() * (25.0 * y).cos();
        let blot = 4.0 * (-60.0 * gain * (x * x + y * y)).exp();
        [wave * gain + blot, wave + blot, 0.8 * wave + blot]
    })
}

/// The median of the seconds that something takes.
fn median(mut work: impl FnMut()) -> f64 {
    let mut seconds: Vec<f64> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[RUNS / 2]
}
