//! Matrix products against sums written out, and against themselves compiled for another instruction set.

use super::*;
use proptest::prelude::*;

fn exact(a: &[f32], b: &[f32], term: impl Fn(f64, f64) -> f64) -> f64 {
    a.iter().zip(b).map(|(a, b)| term(f64::from(*a), f64::from(*b))).sum()
}

/// Vectors that are a common part of length about `common` plus a part of their own of length about `own`.
fn vectors(count: usize, length: usize, (common, own): (f32, f32), state: &mut u64) -> Vec<Vec<f32>> {
    let mut uniform = || {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    };
    let shared: Vec<f32> = (0..length).map(|_| common * uniform()).collect();
    (0..count).map(|_| shared.iter().map(|s| s + own * uniform()).collect()).collect()
}

fn slices(vectors: &[Vec<f32>]) -> Vec<&[f32]> {
    vectors.iter().map(Vec::as_slice).collect()
}

proptest! {
    #[test]
    fn products_and_distances_equal_their_definition(
        rows in 0_usize..14, columns in 0_usize..35, length in 0_usize..200, closeness in 0..6, mut seed: u64
    ) {
        let mut all = vectors(rows + columns, length, (100.0, 100.0 * 0.1f32.powi(closeness)), &mut seed);
        let b = all.split_off(rows);
        let packed = Columns::new(length, &b);
        let (products, distances) = (packed.products(&slices(&all)), packed.squared_distances(&slices(&all)));
        prop_assert_eq!((products.len(), distances.len()), (rows * columns, rows * columns));
        for (i, a) in all.iter().enumerate() {
            for (k, b) in b.iter().enumerate() {
                let place = i * columns + k;
                let bound = (exact(a, a, |x, y| x * y) * exact(b, b, |x, y| x * y)).sqrt();
                let product = exact(a, b, |x, y| x * y);
                prop_assert!((products[place] - product).abs() <= Columns::PRODUCT_ERROR * bound);
                prop_assert!((inner_product(a, b) - product).abs() <= 1e-13 * bound);
                let distance = exact(a, b, |x, y| (x - y) * (x - y));
                prop_assert!((distances[place] - distance).abs() <= Columns::DISTANCE_ERROR * distance, "{} {distance}", distances[place]);
            }
        }
    }
}

#[test]
fn equal_vectors_have_distance_zero() {
    let rows = vectors(3, 1000, (1e4, 0.0), &mut 5);
    assert_eq!(Columns::new(1000, &rows).squared_distances(&slices(&rows)), [0.0; 9]);
}

/// The body called directly is compiled for the baseline instruction set, the other for what this machine has.
#[test]
fn every_instruction_set_gives_the_same_bits() {
    let rows = vectors(ROWS, 1003, (0.0, 50.0), &mut 3);
    let packed = Columns::new(1003, &vectors(LANES, 1003, (10.0, 50.0), &mut 4));
    let tile_rows: [&[f32]; ROWS] = std::array::from_fn(|r| rows[r].as_slice());
    let mut sums = [[0.0; LANES]; ROWS];
    tile(&tile_rows, packed.panel(0), &mut sums);
    assert_eq!(sums.as_flattened(), packed.products(&slices(&rows)));
    assert_eq!(direct(&rows[0], packed.panel(0)), direct_dispatched(&rows[0], packed.panel(0)));
    assert_eq!(inner(&rows[0], &rows[1]).to_bits(), inner_product(&rows[0], &rows[1]).to_bits());
}
