//! Random numbers of paths: Owen-scrambled Sobol' points, eight dimensions at a time.
//!
//! The points of a pixel are those of one sequence of eight dimensions: its area and the first three points of a path
//! take two each. Long paths need more; each further set takes the same points in another order and with other scrambles
//! ("padding", Burley 2020). Shuffles and scrambles follow from the seed, the pixel and the set alone.

/// Dimensions of the sequence.
const DIMENSIONS: usize = 8;

/// Direction numbers of all dimensions but the first, which is van der Corput's (Joe & Kuo 2008): coefficients of the
/// primitive polynomial, and as many initial numbers as its degree.
#[rustfmt::skip]
const POLYNOMIALS: [(u32, &[u32]); DIMENSIONS - 1] = [
    (0, &[1]), (1, &[1, 3]), (1, &[1, 3, 1]), (2, &[1, 1, 1]), (1, &[1, 1, 3, 3]), (4, &[1, 3, 5, 13]), (2, &[1, 1, 5, 5, 17]),
];

/// The first points of the Sobol' sequence, their bits reversed: what the scrambling works on.
#[derive(Debug)]
pub(super) struct Points {
    reversed: Vec<[u32; DIMENSIONS]>,
}

impl Points {
    /// As many points as samples, or more: a shuffle needs a power of two.
    pub(super) fn new(samples: u32) -> Self {
        let matrices = std::array::from_fn(direction_numbers);
        let count = samples.next_power_of_two();
        Self { reversed: (0..count).map(|i| matrices.map(|m| sobol(i, &m).reverse_bits())).collect() }
    }

    /// The random numbers of a pixel's path `index`.
    pub(super) fn path(&self, seed: u64, pixel: u32, index: u32) -> Sampler<'_> {
        let seed = hash(hash(seed as u32 ^ hash((seed >> 32) as u32)).wrapping_add(pixel));
        Sampler { points: &self.reversed, seed, index }
    }
}

/// The random numbers of one path.
#[derive(Clone, Copy)]
pub(super) struct Sampler<'a> {
    points: &'a [[u32; DIMENSIONS]],
    seed: u32,
    index: u32,
}

impl Sampler<'_> {
    /// The set of dimensions with a number of its own.
    pub(super) fn set(&self, number: u32) -> Set {
        let seed = hash(self.seed.wrapping_add(number.wrapping_mul(0x9e37_79b9)));
        let shuffled = scramble(self.index.reverse_bits(), seed).reverse_bits();
        Set { reversed: self.points[shuffled as usize & (self.points.len() - 1)], seed }
    }
}

/// Dimensions that are stratified together.
#[derive(Clone, Copy)]
pub(super) struct Set {
    reversed: [u32; DIMENSIONS],
    seed: u32,
}

impl Set {
    /// Two numbers in `(0, 1)` from a pair of dimensions, 0 to 3. Each stream scrambles them anew; all are stratified
    /// together with the other pairs.
    pub(super) fn pair(&self, pair: u32, stream: u32) -> [f64; 2] {
        [self.number(2 * pair, stream), self.number(2 * pair + 1, stream)]
    }

    fn number(&self, dimension: u32, stream: u32) -> f64 {
        let seed = hash(self.seed ^ (1 + dimension + DIMENSIONS as u32 * stream).wrapping_mul(0x85eb_ca6b));
        let bits = scramble(self.reversed[dimension as usize], seed).reverse_bits();
        (f64::from(bits) + 0.5) / 4_294_967_296.0
    }
}

fn direction_numbers(dimension: usize) -> [u32; 32] {
    let Some(k) = dimension.checked_sub(1) else { return std::array::from_fn(|i| 1 << (31 - i)) };
    let (coefficients, initial) = POLYNOMIALS[k];
    let degree = initial.len();
    let mut v = [0u32; 32];
    for i in 0..32 {
        v[i] = match i < degree {
            true => initial[i] << (31 - i),
            false => {
                let terms = (1..degree).filter(|j| coefficients >> (degree - 1 - j) & 1 == 1);
                terms.fold(v[i - degree] ^ (v[i - degree] >> degree), |sum, j| sum ^ v[i - j])
            }
        };
    }
    v
}

fn sobol(index: u32, matrix: &[u32; 32]) -> u32 {
    (0..32).filter(|bit| index >> bit & 1 == 1).fold(0, |sum, bit| sum ^ matrix[bit])
}

/// Owen's scramble of a number with reversed bits: every bit depends on those below it (Vegdahl's improvement of the
/// hash of Laine & Karras 2011).
fn scramble(mut reversed: u32, seed: u32) -> u32 {
    reversed ^= reversed.wrapping_mul(0x3d20_adea);
    reversed = reversed.wrapping_add(seed);
    reversed = reversed.wrapping_mul((seed >> 16) | 1);
    reversed ^= reversed.wrapping_mul(0x0552_6c56);
    reversed ^ reversed.wrapping_mul(0x53a2_2864)
}

/// A hash without structure (Ettinger's lowbias32).
fn hash(mut x: u32) -> u32 {
    x = (x ^ 0x79c6_8e4a ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Elementary intervals of each pair of dimensions hold one of 2^k points, up to the quality of Sobol's dimensions:
    /// nothing is lost by scrambling, shuffling and padding.
    #[test]
    fn sets_are_stratified() {
        let count = 256;
        let points = Points::new(count);
        for (pixel, number) in [(0, 0), (7, 1), (1_000_000, 77)] {
            let set = |i| points.path(5, pixel, i).set(number);
            for (pair, stream, most) in [(0, 0, 1), (0, 1, 1), (1, 0, 2), (1, 3, 2), (2, 0, 8), (3, 0, 16)] {
                for log in 0..=8 {
                    let (columns, rows) = (1 << log, count as usize >> log);
                    let mut counts = vec![0; columns * rows];
                    for i in 0..count {
                        let [u, v] = set(i).pair(pair, stream);
                        counts[(u * columns as f64) as usize * rows + (v * rows as f64) as usize] += 1;
                    }
                    assert!(counts.iter().all(|c| *c <= most), "{columns} x {rows}: {counts:?}");
                }
            }
        }
    }

    #[test]
    fn seeds_pixels_and_sets_are_unrelated() {
        let points = Points::new(1024);
        let numbers = |seed, pixel, set| -> Vec<f64> {
            (0..1024).map(|i| points.path(seed, pixel, i).set(set).pair(0, 0)[0] - 0.5).collect()
        };
        let one = numbers(1, 1, 1);
        for other in [numbers(2, 1, 1), numbers(1 << 40, 1, 1), numbers(1, 2, 1), numbers(1, 1, 2)] {
            let correlation = one.iter().zip(&other).map(|(a, b)| 12.0 * a * b).sum::<f64>() / 1024.0;
            assert!(correlation.abs() < 0.12, "{correlation}");
        }
    }
}
