//! SSIM, FLIP and HDR-FLIP against the programs that define them, on pictures made by formula.
//!
//! The reference values come from scikit-image 0.26.0 (`structural_similarity` of grey values 0 to 255, `gaussian_weights=True, sigma=1.5,
//! use_sample_covariance=False, data_range=255`) and flip-evaluator 1.7, the FLIP authors' own (`evaluate(..., "LDR", inputsRGB=False)` of
//! pictures clipped to 0..1 and `evaluate(..., "HDR")`, `applyMagma=False`), run on the same formulas in `float32`.

use lookmatch_imaging::{FLIP_PIXELS_PER_DEGREE, Image, Plane, flip_map, hdr_flip_map, ssim_map};

/// Largest difference from a mean of FLIP. Both work in `f32`, and where nothing but rounding is left of edges, as in flat pictures, its
/// square root is seen: 3e-5 there, a few 1e-6 elsewhere.
const FLIP_TOLERANCE: f64 = 5e-5;
/// Largest difference from a mean of SSIM: pictures are `f32`, everything else is `f64`.
const SSIM_TOLERANCE: f64 = 1e-8;

/// A hash of integers, 0 to 1023/1024, exact in `f32`.
fn noise(x: i64, y: i64, c: i64, seed: i64) -> f64 {
    const MASK: i64 = 0xffff_ffff;
    let mut h = (x * 73856093 + y * 19349663 + c * 83492791 + seed * 2654435761) & MASK;
    h = ((h ^ (h >> 13)).wrapping_mul(1274126177)) & MASK;
    h ^= h >> 16;
    (h & 1023) as f64 / 1024.0
}

/// Two pictures of a kind, the second a little different.
fn pair(kind: &str, width: usize, height: usize) -> [Image; 2] {
    [0, 1].map(|seed| {
        Image::from_fn(width, height, |x, y| {
            let place = [x as i64, y as i64];
            [0, 1, 2].map(|c| value(kind, place, c, [width as i64, height as i64], seed) as f32)
        })
    })
}

fn value(kind: &str, [x, y]: [i64; 2], c: usize, [w, h]: [i64; 2], seed: i64) -> f64 {
    let s = seed as f64;
    let (u, v) = (2 * x - w, 2 * y - h);
    let (d2, side) = (u * u + v * v, w.min(h));
    match kind {
        "flat" => [0.25, 0.5, 0.125][c] + s * [0.03125, 0.0, 0.015625][c],
        "noise" => noise(x, y, c as i64, seed),
        "disc" if d2 < (side - 8 - 2 * seed).pow(2) => [0.75, 0.375, 0.125][c] - 0.0625 * s,
        "disc" => [0.0625, 0.5][((x / 8 + y / 8) % 2) as usize],
        "highlight" if d2 >= (side - 6).pow(2) => [0.03125, 0.0625, 0.125][c],
        "highlight" => {
            let r = side - 6;
            let shade = 0.125 + 0.75 * (1.0 - d2 as f64 / (r * r) as f64);
            let (p, q) = (u + r / 3 - 2 * seed, v + r / 3);
            let spot = match p * p + q * q {
                ..36 => 50.0,
                near if near < 100 + 40 * seed => 4.0,
                _ => 0.0,
            };
            shade * [0.8, 0.4, 0.3][c] * (1.0 + 0.0625 * s) + spot + 0.03125 * noise(x, y, c as i64, seed)
        }
        _ => unreachable!("{kind}"),
    }
}

/// Kind, width, height; then SSIM, FLIP at 67.02 and at 75 pixels per degree, HDR-FLIP.
#[rustfmt::skip]
const REFERENCES: [(&str, usize, usize, [f64; 4]); 6] = [
    ("flat", 64, 64, [0.999841204, 0.1295454, 0.1295462, 0.1438010]),
    ("noise", 64, 64, [0.022425333, 0.3969885, 0.3712294, 0.3500131]),
    ("disc", 100, 80, [0.922953051, 0.1619083, 0.1616511, 0.2513120]),
    ("disc", 64, 64, [0.870290716, 0.2025539, 0.2012559, 0.2995397]),
    ("highlight", 100, 80, [0.949845988, 0.0688723, 0.0693726, 0.0760175]),
    ("highlight", 64, 64, [0.932147439, 0.0867654, 0.0875243, 0.0995597]),
];

#[track_caller]
fn assert_near(plane: &Plane, expected: f64, tolerance: f64, what: &str) {
    let found = plane.mean(None).unwrap();
    println!("{what}: {found:.9}, off by {:.1e}", found - expected);
    assert!((found - expected).abs() <= tolerance, "{what}: {found:.9}, not {expected:.9}");
}

#[test]
fn ssim_is_that_of_scikit_image() {
    for (kind, width, height, [expected, ..]) in REFERENCES {
        let [a, b] = pair(kind, width, height);
        assert_near(&ssim_map(&a, &b).unwrap(), expected, SSIM_TOLERANCE, kind);
    }
}

#[test]
fn flip_is_that_of_its_authors() {
    for (kind, width, height, [_, default, closer, _]) in REFERENCES {
        let [a, b] = pair(kind, width, height);
        assert_near(&flip_map(&a, &b, FLIP_PIXELS_PER_DEGREE).unwrap(), default, FLIP_TOLERANCE, kind);
        assert_near(&flip_map(&a, &b, 75.0).unwrap(), closer, FLIP_TOLERANCE, kind);
    }
}

/// Largest values of the maps, and one in the middle of things.
#[test]
fn flip_maps_are_those_of_its_authors() {
    let [a, b] = pair("highlight", 100, 80);
    let map = hdr_flip_map(&a, &b, FLIP_PIXELS_PER_DEGREE).unwrap();
    assert!((map.quantile(1.0, None).unwrap() - 0.872090).abs() < 1e-4);
    assert!((map.values()[80 / 3 * 100 + 25] - 0.107686).abs() < 1e-4);
    let map = flip_map(&a, &b, FLIP_PIXELS_PER_DEGREE).unwrap();
    assert!((map.quantile(1.0, None).unwrap() - 0.772244).abs() < 1e-4);
}

#[test]
fn hdr_flip_is_that_of_its_authors() {
    for (kind, width, height, [_, _, _, expected]) in REFERENCES {
        let [a, b] = pair(kind, width, height);
        assert_near(&hdr_flip_map(&a, &b, FLIP_PIXELS_PER_DEGREE).unwrap(), expected, FLIP_TOLERANCE, kind);
    }
}
