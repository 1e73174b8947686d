use super::*;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Multilinear interpolation as the books have it, in `f64`.
fn reference(levels: &[Vec<f64>], values: &[f64], between: Between, at: &[f64]) -> f64 {
    let places: Vec<(usize, f64)> = levels
        .iter()
        .zip(at)
        .map(|(levels, at)| {
            if levels.len() == 1 {
                return (0, 0.0);
            }
            let at = at.clamp(levels[0], levels[levels.len() - 1]);
            let index = levels.partition_point(|l| *l <= at).clamp(1, levels.len() - 1) - 1;
            (index, (at - levels[index]) / (levels[index + 1] - levels[index]))
        })
        .collect();
    let mut sum = 0.0;
    let (mut best, mut heaviest) = (0.0, 0.0);
    for corner in 0..1usize << levels.len() {
        let (mut weight, mut place) = (1.0, 0);
        for (k, (index, fraction)) in places.iter().enumerate() {
            let upper = corner >> k & 1;
            weight *= if upper == 1 { *fraction } else { 1.0 - fraction };
            place = place * levels[k].len() + (index + upper).min(levels[k].len() - 1);
        }
        sum += weight * values[place];
        if weight > heaviest {
            (best, heaviest) = (values[place], weight);
        }
    }
    if between == Between::Linear { sum } else { best }
}

fn random_levels(rng: &mut Pcg64Mcg, is_regular: bool) -> Vec<f64> {
    let count = rng.random_range(1..9);
    let mut level = rng.random_range(-1.0..1.0);
    let step = rng.random_range(0.01..0.4);
    let next = |_| {
        level += if is_regular { step } else { rng.random_range(0.001..0.5) };
        level
    };
    (0..count).map(next).collect()
}

fn levels_of_this_processor() -> Vec<Level> {
    let best = Level::new();
    let mut levels = vec![Level::baseline(), best];
    levels.extend(best.as_avx2().map(Level::Avx2));
    levels
}

#[test]
fn tables_of_any_shape_equal_the_books_on_every_instruction_set() {
    let rng = &mut Pcg64Mcg::seed_from_u64(7);
    for case in 0..120 {
        let levels: Vec<Vec<f64>> =
            (0..1 + case % MAX_INPUTS).map(|k| random_levels(rng, (case + k) % 3 != 0)).collect();
        let points = levels.iter().map(Vec::len).product();
        let kinds = [Between::Linear, Between::Nearest, Between::Linear, Between::Linear, Between::Linear];
        let outputs: Vec<(Between, Vec<f64>)> = (0..1 + case % 7)
            .map(|o| (kinds[o % 5], (0..points).map(|_| rng.random_range(-2.0..5.0)).collect()))
            .collect();
        let lut = Lut::new(&levels, &outputs).unwrap();
        assert_eq!((lut.inputs(), lut.outputs()), (levels.len(), outputs.len()));
        // Neither a multiple of a block nor of a register, and beyond the ends of the grid.
        let inputs: Vec<Vec<f32>> =
            levels.iter().map(|_| (0..613).map(|_| rng.random_range(-1.5..5.0)).collect()).collect();
        let planes: Vec<&[f32]> = inputs.iter().map(Vec::as_slice).collect();
        for level in levels_of_this_processor() {
            let mut found = vec![vec![f32::NAN; 613]; outputs.len()];
            lut.evaluate_at(level, &planes, &mut found.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
            for texel in 0..613 {
                let at: Vec<f64> = inputs.iter().map(|p| f64::from(p[texel])).collect();
                for ((between, values), found) in outputs.iter().zip(&found) {
                    let expected = reference(&levels, values, *between, &at);
                    let error = (f64::from(found[texel]) - expected).abs();
                    // Half of a level's distance is undecided within rounding.
                    let is_tie = *between == Between::Nearest && error > 0.0 && near_tie(&levels, &at);
                    assert!(
                        error < 7e-4 || is_tie,
                        "{level:?} {between:?} {at:?}: {} {expected}",
                        found[texel]
                    );
                }
            }
        }
    }
}

fn near_tie(levels: &[Vec<f64>], at: &[f64]) -> bool {
    levels.iter().zip(at).any(|(levels, at)| {
        levels.windows(2).any(|p| (at - 0.5 * (p[0] + p[1])).abs() < 1e-3 * (p[1] - p[0]))
    })
}

/// Regular or not, what is interpolated is what the grid says: nothing is resampled.
#[test]
fn interpolation_is_exact_to_a_millionth_of_the_range() {
    let rng = &mut Pcg64Mcg::seed_from_u64(3);
    for levels in [
        vec![
            (0..20).map(|i| 0.02 * f64::from(i + 1)).collect(),
            (0..35).map(|i| 0.02 * f64::from(i) + 0.01).collect(),
        ],
        vec![vec![0.02, 0.12, 0.22, 0.3, 0.4], vec![0.01, 0.19, 0.35, 0.53, 0.69]],
        vec![vec![0.0, 0.001, 0.6, 1.0], vec![0.01, 0.0101, 0.7]],
    ] {
        let points = levels.iter().map(Vec::len).product();
        let values: Vec<f64> = (0..points).map(|_| rng.random_range(0.0..1.0)).collect();
        let lut = Lut::new(&levels, &[(Between::Linear, values.clone())]).unwrap();
        for _ in 0..2000 {
            let at: Vec<f32> =
                levels.iter().map(|l: &Vec<f64>| rng.random_range(l[0]..l[l.len() - 1]) as f32).collect();
            let mut found = [0.0];
            lut.evaluate(&[&at[..1], &at[1..]], &mut [&mut found]);
            let at: Vec<f64> = at.iter().map(|v| f64::from(*v)).collect();
            let expected = reference(&levels, &values, Between::Linear, &at);
            // A step of 0.0001 at 0.01 is known to 1e-5 of itself in single precision.
            let steepest = levels
                .iter()
                .flat_map(|l| l.windows(2).map(|p| p[0].abs() / (p[1] - p[0])))
                .fold(1.0, f64::max);
            assert!(
                (f64::from(found[0]) - expected).abs() < 1e-6 * steepest.max(1.0),
                "{at:?} {} {expected}",
                found[0]
            );
        }
    }
}

#[test]
fn missing_values_stay_within_their_cells() {
    let lut =
        Lut::new(&[vec![0.0, 1.0, 2.0, 3.0]], &[(Between::Linear, vec![f64::NAN, 1.0, 2.0, 3.0])]).unwrap();
    let mut found = [0.0; 3];
    lut.evaluate(&[&[0.5, 1.5, f32::NAN]], &mut [&mut found]);
    assert!(found[0].is_nan());
    assert_eq!(found[1], 1.5);
}

#[test]
fn unsound_tables_are_refused() {
    let linear = |v: &[f64]| vec![(Between::Linear, v.to_vec())];
    assert_eq!(Lut::new(&[], &[]).unwrap_err(), LutError::Inputs(0));
    assert_eq!(Lut::new(&[vec![1.0, 1.0]], &linear(&[0.0; 2])).unwrap_err(), LutError::Levels(0));
    let wrong = Lut::new(&[vec![0.0, 1.0]], &linear(&[0.0; 3])).unwrap_err();
    assert_eq!(wrong, LutError::Values { output: 0, expected: 2, found: 3 });
    let long: Vec<f64> = (0..5000).map(f64::from).collect();
    assert!(matches!(Lut::new(&[long.clone(), long], &[]), Err(LutError::Cells(_))));
}
