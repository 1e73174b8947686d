//! The environment map of the reference scene, designed like the paper's Figure 3.
//!
//! Upper half: white, red, green, blue and black bands with step edges, in two tiers shifted against each other so that
//! edges run in both directions; how far a step is spread on the sphere tells the roughness. Lower half: colours that
//! vary from degree to degree. Only integers and exact binary fractions decide about it: it is the same everywhere.

use lookmatch_imaging::Image;

/// Width of the map in pixels; it is half as high.
const WIDTH: usize = 1024;
/// Bands around the horizon: the five colours, four times.
const BANDS: usize = 20;
/// Side of a patch of the lower half in pixels, about 1.4 degrees.
const PATCH: usize = 4;

/// The designed map, 1024 × 512, linear RGB radiance between 0.02 and 2.5.
pub fn designed_map() -> Image {
    Image::from_fn(WIDTH, WIDTH / 2, |x, y| if y < WIDTH / 4 { band(x, y) } else { patch(x, y) })
}

fn band(x: usize, y: usize) -> [f32; 3] {
    const BRIGHT: f32 = 2.5;
    const DARK: f32 = 0.03;
    let tier = y / (WIDTH / 8);
    match (x * BANDS / WIDTH + 2 * tier) % 5 {
        0 => [BRIGHT; 3],
        1 => [BRIGHT, DARK, DARK],
        2 => [DARK, BRIGHT, DARK],
        3 => [DARK, DARK, BRIGHT],
        _ => [DARK; 3],
    }
}

/// A patch's colour: each channel a slow ramp around the horizon times fine noise.
fn patch(x: usize, y: usize) -> [f32; 3] {
    let (column, row) = ((x / PATCH) as u32, (y / PATCH) as u32);
    std::array::from_fn(|c| {
        let fine = hash(column, row, c as u32);
        let coarse = hash(column / 8, row / 8, c as u32 + 3);
        0.02 + fine * (0.25 + coarse)
    })
}

/// A hash of a cell to a multiple of 1/256 in `[0, 1)` (the mixing steps of Jarzynski & Olano 2020, pcg3d).
fn hash(x: u32, y: u32, z: u32) -> f32 {
    let mut v = [x, y, z].map(|k| k.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    for round in 0..2 {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[2]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
        if round == 0 {
            v = v.map(|k| k ^ (k >> 16));
        }
    }
    (v[0] >> 24) as f32 / 256.0
}
