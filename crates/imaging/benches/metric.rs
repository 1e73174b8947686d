//! What a comparison of two materials costs (four pairs of 300 x 300 images), beside copying the same bytes.

use criterion::{Criterion, criterion_group, criterion_main};
use lookmatch_imaging::{Columns, Image, METRICS, Mask, distance_correlation, lab_planes, squared_distance};
use std::hint::black_box;

const SIZE: usize = 300;
const IMAGES: usize = 8;

fn image(seed: usize) -> Image {
    Image::from_fn(SIZE, SIZE, |x, y| {
        let value = ((x * 7 + y * 13 + seed * 31) % 257) as f32 / 64.0;
        [value, value * 0.7 + 0.01, value * value]
    })
}

fn compare(images: &[Image], planes: &mut [Vec<f32>]) -> f64 {
    for (image, planes) in images.iter().zip(planes.iter_mut()) {
        lab_planes(image.pixels(), planes);
    }
    planes.chunks_exact(2).map(|pair| squared_distance(&pair[0], &pair[1])).sum()
}

fn metric(criterion: &mut Criterion) {
    let images: Vec<Image> = (0..IMAGES).map(image).collect();
    let mut planes = vec![vec![0.0; 3 * SIZE * SIZE]; IMAGES];
    let mut copies = images.clone();
    criterion.bench_function("lab_planes and squared_distance, 4 pairs of 300x300", |bencher| {
        bencher.iter(|| black_box(compare(black_box(&images), &mut planes)));
    });
    criterion.bench_function("squared_distance alone, 4 pairs of 300x300", |bencher| {
        bencher.iter(|| {
            let pairs = black_box(&planes).chunks_exact(2);
            black_box(pairs.map(|pair| squared_distance(&pair[0], &pair[1])).sum::<f64>())
        });
    });
    criterion.bench_function("memcpy of the same bytes", |bencher| {
        bencher.iter(|| {
            for (image, copy) in black_box(&images).iter().zip(&mut copies) {
                copy.pixels_mut().copy_from_slice(image.pixels());
            }
            black_box(&mut copies);
        });
    });
}

/// 128 pixels of 64 images: a block of what an exhaustive search projects.
fn products(criterion: &mut Criterion) {
    const LENGTH: usize = 3 * 128;
    let vector = |k: usize| -> Vec<f32> { (0..LENGTH).map(|i| ((i * 7 + k * 31) % 257) as f32).collect() };
    let columns = Columns::new(LENGTH, &(0..48).map(vector).collect::<Vec<_>>());
    let rows: Vec<Vec<f32>> = (0..64).map(|k| vector(k + 50)).collect();
    let rows: Vec<&[f32]> = rows.iter().map(Vec::as_slice).collect();
    criterion.bench_function("products of 64 rows of 384 values with 48 columns", |bencher| {
        bencher.iter(|| black_box(columns.products(black_box(&rows))));
    });
}

/// Every metric of a pair of pictures of a ball with a highlight of 50, whole and masked.
fn pictures(criterion: &mut Criterion) {
    let ball = |gain: f32| {
        Image::from_fn(SIZE, SIZE, |x, y| {
            let r = (x as f32 - 150.0).hypot(y as f32 - 150.0);
            let checker = if (x / 20 + y / 20) % 2 == 0 { 0.6 } else { 0.2 };
            match r {
                ..6.0 => [50.0 * gain; 3],
                ..120.0 => [gain * (1.0 - r / 150.0), 0.3 * gain, 0.2],
                _ => [checker; 3],
            }
        })
    };
    let (source, target) = (ball(1.0), ball(1.1));
    let mask = Mask::disc(SIZE, SIZE, 150.0, 150.0, 120.0);
    for metric in METRICS {
        for (title, mask) in [("whole", None), ("whole and masked", Some(&mask))] {
            criterion.bench_function(&format!("{} of a pair of 300x300, {title}", metric.name), |bencher| {
                bencher.iter(|| metric.read(black_box(&source), black_box(&target), mask).unwrap());
            });
        }
    }
    let numbers = |k: usize| (0..1000).map(|i| ((i * k) % 997) as f64).collect::<Vec<f64>>();
    let (x, y) = (numbers(31), numbers(57));
    criterion.bench_function("distance correlation of 1000 numbers", |bencher| {
        bencher.iter(|| distance_correlation(black_box(&x), black_box(&y)).unwrap());
    });
}

criterion_group! {
    name = of_pictures;
    config = Criterion::default().sample_size(10);
    targets = pictures
}
criterion_group!(benches, metric, products);
criterion_main!(benches, of_pictures);
