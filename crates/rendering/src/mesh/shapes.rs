//! Meshes that need no file: shapes that are computed, and those that ship with the program (see `assets/README.md`).

use std::f64::consts::{PI, TAU};
use std::io::BufReader;

use flate2::read::GzDecoder;
use glam::DVec3;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use super::{Soup, files};

/// What [`crate::Mesh::file`] may be beside a path.
pub(crate) const NAMES: &str = "blob:SEED, square, spot, shader-ball";

/// Keenan Crane's cow.
const SPOT: &[u8] = include_bytes!("../../assets/spot.obj.gz");
/// The outer surface of the standard shader ball.
const SHADER_BALL: &[u8] = include_bytes!("../../assets/shader_ball.ply.gz");

/// The shape of a name; `None` where it names none, and so a file.
pub(super) fn named(name: &str) -> Option<Result<Soup, String>> {
    if let Some(seed) = name.strip_prefix("blob:") {
        return Some(blob_of(seed));
    }
    match name {
        "square" => Some(Ok(square())),
        "spot" => Some(packed("obj", SPOT).map(Soup::smoothed)),
        "shader-ball" => Some(packed("ply", SHADER_BALL)),
        _ => None,
    }
}

fn packed(extension: &str, bytes: &'static [u8]) -> Result<Soup, String> {
    files::decode(extension, &mut BufReader::new(GzDecoder::new(bytes)))
}

/// A square of side 1 about the origin that faces +z; u runs along x and v along y, from 0 to 1.
fn square() -> Soup {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    Soup {
        positions: corners.map(|[u, v]| DVec3::new(u - 0.5, v - 0.5, 0.0)).into(),
        texture: corners.into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Soup::default()
    }
}

fn blob_of(seed: &str) -> Result<Soup, String> {
    let number = seed.parse().map_err(|_| {
        format!("the seed of the blob is '{seed}'; expected a whole number from 0 to {}", u64::MAX)
    })?;
    Ok(blob(number))
}

/// Degrees of the harmonics of a blob: dents down to about a fifth of its outline. Shapes of many curvatures are those on
/// which people tell reflectances apart best (Vangorp *et al.* 2007).
const DEGREES: std::ops::RangeInclusive<usize> = 2..=6;
/// Standard deviation of the logarithm of a blob's radius, about.
const RELIEF: f64 = 0.17;
/// Segments around a blob, and half as many from pole to pole: 36480 triangles.
const SEGMENTS: usize = 192;

/// A ball whose radius is about 1 and uneven.
fn blob(seed: u64) -> Soup {
    let relief = Relief::new(seed);
    let rows = SEGMENTS / 2;
    let mut soup = Soup::default();
    for (row, column) in (0..=rows).flat_map(|row| (0..=SEGMENTS).map(move |column| (row, column))) {
        // As the texture of a sphere: u eastwards from a seam at −Z, v northwards.
        let [u, v] = [column as f64 / SEGMENTS as f64, row as f64 / rows as f64];
        let ((sin, cos), (sin_u, cos_u)) = ((PI * v).sin_cos(), (TAU * u).sin_cos());
        let direction = DVec3::new(-sin * sin_u, -cos, -sin * cos_u);
        let (radius, normal) = relief.at(direction);
        soup.positions.push(direction * radius);
        soup.normals.push(normal);
        soup.texture.push([u, v]);
    }
    let corner = |row: usize, column: usize| row * (SEGMENTS + 1) + column;
    for (row, column) in (0..rows).flat_map(|row| (0..SEGMENTS).map(move |column| (row, column))) {
        let [a, b] = [corner(row, column), corner(row, column + 1)];
        let [c, d] = [corner(row + 1, column + 1), corner(row + 1, column)];
        // At each pole, one of the two has no area.
        soup.triangles.extend((row > 0).then_some([a, b, c]));
        soup.triangles.extend((row + 1 < rows).then_some([a, c, d]));
    }
    soup
}

/// The radius of a blob, `exp Σ g P_l(d · n)` in the direction n, with random directions d, as many of each degree l as it has
/// harmonics. By the addition theorem that is a random sum of the real spherical harmonics of these degrees, alike
/// in all directions. The weights g fall with the degree as 1/l.
struct Relief {
    /// Degree l, direction d and weight g.
    parts: Vec<(usize, DVec3, f64)>,
}

impl Relief {
    fn new(seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut even = move || 2.0 * random.random::<f64>() - 1.0;
        // Each degree then has the variance of its amplitude: a Legendre polynomial's is 1/(2l + 1), that of even numbers 1/3.
        let amplitude = |l: usize| (l as f64).recip();
        let whole = DEGREES.map(|l| amplitude(l).powi(2)).sum::<f64>().sqrt();
        let degrees = DEGREES.flat_map(|l| std::iter::repeat_n(l, 2 * l + 1));
        let part = |l: usize| {
            let (y, turn, weight) = (even(), even(), even());
            let ((sin, cos), ring) = ((PI * turn).sin_cos(), (1.0 - y * y).sqrt());
            (l, DVec3::new(ring * sin, y, ring * cos), RELIEF * amplitude(l) / whole * 3_f64.sqrt() * weight)
        };
        Self { parts: degrees.map(part).collect() }
    }

    /// Radius and normal in a direction.
    fn at(&self, direction: DVec3) -> (f64, DVec3) {
        let (mut height, mut slope) = (0.0, DVec3::ZERO);
        for (degree, axis, weight) in &self.parts {
            let x = axis.dot(direction);
            let (value, derivative) = legendre(*degree, x);
            height += weight * value;
            slope += (*axis - direction * x) * (weight * derivative);
        }
        (height.exp(), (direction - slope).normalize())
    }
}

/// The Legendre polynomial of a degree above 0, and its derivative.
fn legendre(degree: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = ((1.0, 0.0), (x, 1.0));
    for l in 1..degree {
        let odd = (2 * l + 1) as f64;
        let next = (odd * x * value.0 - l as f64 * before.0) / (l + 1) as f64;
        (before, value) = (value, (next, before.1 + odd * value.0));
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn soup(name: &str) -> Soup {
        named(name).expect("a name").unwrap_or_else(|fault| panic!("{name}: {fault}"))
    }

    #[test]
    fn every_shape_is_whole() {
        for (name, least) in [("blob:1", 20_000), ("square", 2), ("spot", 5_000), ("shader-ball", 40_000)] {
            let soup = soup(name);
            soup.check().unwrap();
            assert!(soup.triangles.len() >= least, "{name}: {}", soup.triangles.len());
            assert_eq!(soup.texture.len(), soup.positions.len(), "{name}");
            assert!(soup.texture.iter().flatten().all(|t| (-0.06..=1.01).contains(t)), "{name}");
            // Normals lie on the side from which triangles run counter-clockwise.
            let outside = |t: &&[usize; 3]| {
                let [a, b, c] = t.map(|i| soup.positions[i]);
                soup.normals.is_empty() || (b - a).cross(c - a).dot(soup.normals[t[0]]) > 0.0
            };
            let share = soup.triangles.iter().filter(outside).count() as f64 / soup.triangles.len() as f64;
            assert!(share > 0.99, "{name}: {share}");
        }
    }

    #[test]
    fn blobs_are_uneven_balls() {
        let mut radii = Vec::new();
        for seed in 0..8 {
            let soup = blob(seed);
            let length: Vec<f64> = soup.positions.iter().map(|p| p.length()).collect();
            // Rows are evenly spaced: those at the poles are short.
            let weight = |k: usize| (PI * (k / (SEGMENTS + 1)) as f64 / (SEGMENTS / 2) as f64).sin();
            let whole: f64 = (0..length.len()).map(weight).sum();
            let mean = (0..length.len()).map(|k| weight(k) * length[k]).sum::<f64>() / whole;
            let least = length.iter().copied().fold(f64::INFINITY, f64::min);
            let most = length.iter().copied().fold(0.0, f64::max);
            assert!((mean - 1.0).abs() < 0.05, "{seed}: {mean}");
            assert!(least > 0.4 && most < 2.0 && most > 1.2 * least, "{seed}: {least} {most}");
            radii.push(length);
        }
        assert_eq!(radii[3], blob(3).positions.iter().map(|p| p.length()).collect::<Vec<_>>());
        assert!((1..8).all(|k| radii[k] != radii[0]), "every seed has its own shape");
    }

    #[test]
    fn normals_of_blobs_are_those_of_their_surface() {
        let relief = Relief::new(7);
        for direction in [DVec3::new(0.3, 0.5, -0.8), DVec3::Y, DVec3::new(-0.9, -0.1, 0.2)] {
            let direction = direction.normalize();
            let point = |d: DVec3| d.normalize() * relief.at(d.normalize()).0;
            let (s, t) = direction.any_orthonormal_pair();
            let along = |axis: DVec3| point(direction + axis * 1e-5) - point(direction - axis * 1e-5);
            let expected = along(s).cross(along(t)).normalize();
            let normal = relief.at(direction).1;
            assert!((normal - expected).length() < 1e-8, "{normal} {expected}");
        }
    }

    #[test]
    fn legendre_polynomials() {
        // P₄ = (35 x⁴ − 30 x² + 3)/8.
        let x = 0.3_f64;
        let (value, derivative) = legendre(4, x);
        assert!((value - (35.0 * x.powi(4) - 30.0 * x * x + 3.0) / 8.0).abs() < 1e-15);
        assert!((derivative - (140.0 * x.powi(3) - 60.0 * x) / 8.0).abs() < 1e-14);
    }
}
