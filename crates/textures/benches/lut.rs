//! A map from two parameters to three in memory, on one core, beside copying the same bytes.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lookmatch_textures::{Between, Lut};

/// A row of bands: 20 MiB with its outputs, more than the caches that a core has for itself.
const TEXELS: usize = 1 << 20;

fn planes(count: usize) -> Vec<Vec<f32>> {
    let value = |seed: usize, i: usize| ((i * 7919 + seed * 104_729) % 65_536) as f32 / 65_536.0;
    (0..count).map(|k| (0..TEXELS).map(|i| 0.01 + 0.68 * value(k, i)).collect()).collect()
}

fn table(levels: [Vec<f64>; 2]) -> Lut {
    let points = levels[0].len() * levels[1].len();
    let output =
        |k: usize| (Between::Linear, (0..points).map(|i| ((i * 31 + k * 17) % 100) as f64).collect());
    Lut::new(&levels, &[output(1), output(2), output(3)]).expect("a sound table")
}

fn lut(criterion: &mut Criterion) {
    let inputs = planes(2);
    let inputs: Vec<&[f32]> = inputs.iter().map(Vec::as_slice).collect();
    let mut outputs = planes(3);
    let level = |count: u32, bend: f64| {
        move |i: u32| {
            let x = f64::from(i) / f64::from(count - 1);
            0.01 + 0.68 * (x + bend * x * (1.0 - x))
        }
    };
    let axes = |bend| [(0..20).map(level(20, bend)).collect(), (0..35).map(level(35, bend)).collect()];
    let mut group = criterion.benchmark_group("2 to 3 parameters, 1 Mi texels");
    group.throughput(Throughput::Elements(TEXELS as u64));
    for (name, lut) in [("regular levels", table(axes(0.0))), ("irregular levels", table(axes(0.5)))] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let mut planes: Vec<&mut [f32]> = outputs.iter_mut().map(Vec::as_mut_slice).collect();
                lut.evaluate(black_box(&inputs), &mut planes);
                black_box(planes);
            });
        });
    }
    // As many bytes are read and written: 2.5 of 5 planes each.
    let from = planes(5);
    let mut to = planes(5);
    group.bench_function("memcpy of the same bytes", |bencher| {
        bencher.iter(|| {
            for (to, from) in to.iter_mut().zip(black_box(&from)) {
                to[..TEXELS / 2].copy_from_slice(&from[..TEXELS / 2]);
            }
            black_box(&mut to);
        });
    });
    group.finish();
}

criterion_group!(benches, lut);
criterion_main!(benches);
