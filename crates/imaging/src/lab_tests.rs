//! The fast path against the exact one, and against itself compiled for another instruction set.

use super::*;
use crate::lab_from_linear_srgb;
use proptest::prelude::*;

/// Small reproducible generator (Knuth's MMIX constants); values in 0..1.
fn uniform(state: &mut u64) -> f32 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 40) as f32 / (1u64 << 24) as f32
}

/// Colours spread evenly over the logarithm from 10⁻⁶ to `top`, some channels between -0.1 and 0.
fn colours(count: usize, top: f32) -> Vec<[f32; 3]> {
    let mut state = 7;
    let mut channel = || match uniform(&mut state) {
        sign if sign < 0.1 => -0.1 * uniform(&mut state),
        _ => top * (1e-6 / top).powf(uniform(&mut state)),
    };
    (0..count).map(|_| [channel(), channel(), channel()]).collect()
}

/// Greys and near greys: fx - fy cancels, which shows every rounding of the cube root.
fn greys(count: usize, top: f32) -> Vec<[f32; 3]> {
    let mut state = 11;
    (0..count)
        .map(|_| {
            let value = top * uniform(&mut state);
            [value, value * (1.0 + 0.1 * uniform(&mut state)), value]
        })
        .collect()
}

/// Largest difference of any Lab component from the exact conversion.
fn worst(pixels: &[[f32; 3]]) -> f64 {
    let mut planes = vec![0.0; 3 * pixels.len()];
    lab_planes(pixels, &mut planes);
    let mut worst = 0.0_f64;
    for (i, pixel) in pixels.iter().enumerate() {
        let exact = lab_from_linear_srgb(pixel.map(f64::from));
        for c in 0..3 {
            let fast = f64::from(planes[c * pixels.len() + i]);
            worst = worst.max((fast - exact[c]).abs());
        }
    }
    worst
}

#[test]
fn agrees_with_the_exact_conversion() {
    for (top, allowed) in [(1.0, 1e-4), (100.0, 4e-4), (1e4, 1.5e-3)] {
        let found = worst(&colours(1_000_003, top)).max(worst(&greys(1_000_003, top)));
        println!("channel values up to {top}: largest Lab difference {found:.2e}");
        assert!(found <= allowed, "up to {top}: {found}");
    }
}

#[test]
fn cube_root_is_accurate() {
    let mut worst = 0.0_f64;
    let mut x = 0.008_f32;
    while x < 2e4 {
        let exact = f64::from(x).cbrt();
        worst = worst.max((cube_root(x).map(f64::from).iter().sum::<f64>() - exact).abs() / exact);
        x *= 1.000_01;
    }
    println!("largest relative error of the cube root {worst:.2e}");
    assert!(worst < 6e-8);
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// The body called directly is compiled for the baseline instruction set, the other for what this machine has.
#[test]
fn every_instruction_set_gives_the_same_bits() {
    let pixels = colours(10_007, 1e4);
    let (mut baseline, mut dispatched) = (vec![0.0; 3 * 10_007], vec![0.0; 3 * 10_007]);
    planes(&pixels, &mut baseline);
    lab_planes(&pixels, &mut dispatched);
    assert_eq!(bits(&baseline), bits(&dispatched));
    let other: Vec<f32> = baseline.iter().map(|value| value * 1.01 + 0.3).collect();
    assert_eq!(distance(&baseline, &other).to_bits(), squared_distance(&baseline, &other).to_bits());
    let weights: Vec<f32> = pixels.iter().map(|pixel| pixel[0].clamp(0.0, 1.0)).collect();
    let plain = (0..3)
        .map(|c| c * weights.len()..(c + 1) * weights.len())
        .map(|plane| weighted_distance(&baseline[plane.clone()], &other[plane], &weights));
    assert_eq!(
        plain.sum::<f64>().to_bits(),
        weighted_squared_distance(&baseline, &other, &weights).to_bits()
    );
}

proptest! {
    #[test]
    fn distances_equal_their_definition(count in 0_usize..3000, seed: u64) {
        let mut state = seed;
        let mut values = || (0..3 * count).map(|_| 100.0 * uniform(&mut state)).collect::<Vec<_>>();
        let (a, b, w) = (values(), values(), values());
        let exact: f64 = a.iter().zip(&b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        prop_assert!((squared_distance(&a, &b) - exact).abs() <= 1e-6 * exact);
        let w = &w[..count];
        let exact: f64 = a.iter().zip(&b).zip(w.iter().cycle())
            .map(|((a, b), w)| f64::from(w * (a - b)).powi(2)).sum();
        prop_assert!((weighted_squared_distance(&a, &b, w) - exact).abs() <= 1e-6 * exact);
    }
}

#[test]
fn planes_and_pixels_give_the_same_bits() {
    let pixels: Vec<[f32; 3]> =
        (0..1003).map(|i| [i as f32 * 0.01, (i % 17) as f32, (i % 5) as f32 * 0.2]).collect();
    let plane = |c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<f32>>();
    let (mut a, mut b) = (vec![0.0; 3009], vec![0.0; 3009]);
    lab_planes(&pixels, &mut a);
    lab_planes_of([&plane(0), &plane(1), &plane(2)], &mut b);
    assert!(a == b);
}
