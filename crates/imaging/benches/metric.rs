//! What a comparison of two materials costs (four pairs of 300 x 300 images), beside copying the same bytes.

use criterion::{Criterion, criterion_group, criterion_main};
use lookmatch_imaging::{Columns, Image, lab_planes, squared_distance};
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

criterion_group!(benches, metric, products);
criterion_main!(benches);
