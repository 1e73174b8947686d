//! Distance correlation: how far two lists of numbers depend on each other, linearly or not.
//!
//! Székely, Rizzo and Bakirov, "Measuring and Testing Dependence by Correlation of Distances", Annals of Statistics 35(6), 2007,
//! definition 5 (the V-statistic, biased for short lists). Guarnera et al. 2018, section 4, weigh their equation 3 with it.

use crate::ImageError;

/// Distance correlation of paired numbers: 0 (independent, for long lists) to 1 (one is a linear function of the other). 0 where a list
/// is constant. Takes time in proportion to the square of the length, and room to the length.
///
/// # Errors
/// Lists of different length or of less than 2 numbers; numbers that are not finite.
pub fn distance_correlation(x: &[f64], y: &[f64]) -> Result<f64, ImageError> {
    let (count, other_count) = (x.len(), y.len());
    if count != other_count || count < 2 || !x.iter().chain(y).all(|v| v.is_finite()) {
        return Err(ImageError::Uncorrelated { count, other_count });
    }
    let (a, b) = (Distances::of(x), Distances::of(y));
    let [mut covariance, mut variance_x, mut variance_y] = [0.0; 3];
    for i in 0..count {
        for j in 0..count {
            let (a, b) = (a.centred(i, j), b.centred(i, j));
            covariance += a * b;
            variance_x += a * a;
            variance_y += b * b;
        }
    }
    let variances = (variance_x * variance_y).sqrt();
    // Rounding may leave a covariance below 0.
    Ok(if variances > 0.0 { (covariance.max(0.0) / variances).sqrt().min(1.0) } else { 0.0 })
}

/// Distances of each number from every other, and their means.
struct Distances<'a> {
    values: &'a [f64],
    /// Largest distance, by which all are divided: neither large nor small numbers leave the range of `f64`.
    scale: f64,
    /// Mean distance of each number from all.
    rows: Vec<f64>,
    /// Mean of them.
    mean: f64,
}

impl<'a> Distances<'a> {
    fn of(values: &'a [f64]) -> Self {
        let (low, high) =
            values.iter().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
        // Halves: the distance of the largest numbers is no number.
        let scale = (high / 2.0 - low / 2.0).max(f64::MIN_POSITIVE);
        let mut distances = Self { values, scale, rows: Vec::new(), mean: 0.0 };
        let n = values.len() as f64;
        let row = |i: usize| (0..values.len()).map(|j| distances.between(i, j)).sum::<f64>() / n;
        let rows: Vec<f64> = (0..values.len()).map(row).collect();
        distances.mean = rows.iter().sum::<f64>() / n;
        distances.rows = rows;
        distances
    }

    fn between(&self, i: usize, j: usize) -> f64 {
        (self.values[i] / 2.0 / self.scale - self.values[j] / 2.0 / self.scale).abs()
    }

    /// Less the means of its row and its column.
    fn centred(&self, i: usize, j: usize) -> f64 {
        self.between(i, j) - self.rows[i] - self.rows[j] + self.mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Knuth's MMIX generator.
    fn numbers(seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..200).map(|_| next()).collect()
    }

    #[test]
    fn linear_functions_have_1_and_scale_does_not_matter() {
        let x = numbers(1);
        for (slope, offset) in [(1.0, 0.0), (-3.0, 2.0), (1e-12, 0.0), (1e300, 1.0)] {
            let y: Vec<f64> = x.iter().map(|x| slope * x + offset).collect();
            assert!((distance_correlation(&x, &y).unwrap() - 1.0).abs() < 1e-9, "{slope}");
        }
        let y = numbers(5);
        let scaled: Vec<f64> = y.iter().map(|y| 7.0 - 1e6 * y).collect();
        let [plain, other] = [&y, &scaled].map(|y| distance_correlation(&x, y).unwrap());
        assert!((plain - other).abs() < 1e-9);
        assert_eq!(plain, distance_correlation(&y, &x).unwrap());
    }

    #[test]
    fn it_sees_what_a_straight_line_does_not() {
        let x: Vec<f64> = numbers(1).iter().map(|x| 2.0 * x - 1.0).collect();
        let parabola: Vec<f64> = x.iter().map(|x| x * x).collect();
        let (bent, none) =
            (distance_correlation(&x, &parabola).unwrap(), distance_correlation(&x, &numbers(2)).unwrap());
        assert!(bent > 0.4 && none < 0.2 && none > 0.0, "{bent} {none}");
        assert_eq!(distance_correlation(&x, &vec![3.0; 200]).unwrap(), 0.0);
    }

    #[test]
    fn faults_are_named() {
        let refused = |x: &[f64], y: &[f64]| distance_correlation(x, y).unwrap_err().to_string();
        assert!(refused(&[1.0, 2.0], &[1.0]).contains("2 and 1 numbers"));
        assert!(refused(&[1.0], &[1.0]).contains("at least 2"));
        assert!(refused(&[1.0, f64::NAN], &[1.0, 2.0]).contains("finite"));
    }
}
