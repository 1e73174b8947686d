//! A material measured as those of the MERL database (Matusik *et al.* 2003), from its `.binary` file.
//!
//! `f(θ_h, θ_d, φ_d)`, interpolated linearly in `√θ_h`, θ_d and φ_d between the 90 × 90 × 180 values of the file; φ_d has the
//! period π, because swapping light and viewer adds π to it.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | `file` | path of the file | – |
//! | `part` | `whole`, or `diffuse`: a Lambert term in its place, see `merl` | whole |
//!
//! A file has three little-endian `i32`, the sizes 90, 90, 180, and then all red, all green and all blue values as `f64`, φ_d
//! fastest and θ_h slowest; 1500, 1500/1.15 and 1500/1.66 of them are 1/sr. Value k of n lies at `θ_h = π/2 (k/n)²`,
//! `θ_d = π/2 k/n` and `φ_d = π k/n`, as in the readers of Fichet and of Sztrajman *et al.* (2021); the database's own takes the
//! value below without interpolating. Negative values and what is not finite were not measured: they take the value at the next
//! smaller θ_d, or the next smaller θ_h where there is none.
//!
//! Known defects: nothing makes a measurement conserve energy or bilaterally symmetric; beyond 80° it is mostly extrapolated, by
//! its authors or here. Where light and viewer mirror each other exactly, the half vector has no azimuth and the light's is taken.

use std::f64::consts::{FRAC_1_PI, FRAC_2_PI};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use crate::model::{Family, Model, Values};
use crate::models::lambert::Lambert;
use crate::models::measured::{difference, lambert_below, sampling};
use crate::parameter::{Kind, Parameter, Role};
use crate::{Bsdf, Geometry, Lobe, Real, Sampling};

/// The description of the model.
pub static MODEL: Model = Model {
    name: "merl-file",
    title: "MERL file",
    summary: "A measured material from a .binary file in the format of the MERL database.",
    reference: "Matusik et al. 2003, A Data-Driven Reflectance Model; Rusinkiewicz 1998",
    family: Family::Measured,
    has_fresnel: true,
    is_reciprocal: true,
    parameters: &[Parameter {
        name: "file",
        symbol: "-",
        role: Role::Measurement,
        unit: "-",
        summary: "The measurement, in the format of the MERL database.",
        kind: Kind::File {
            content: "a .binary file in the format of the MERL database (90 x 90 x 180 values)",
        },
    }],
    diffuse_only: Some(diffuse),
    load: Some(load),
    build,
    ..Model::BLANK
};

const THETA_H: usize = 90;
const THETA_D: usize = 90;
const PHI_D: usize = 180;
const COUNT: usize = THETA_H * THETA_D * PHI_D;
const HEADER: usize = 12;
const LENGTH: usize = HEADER + 3 * 8 * COUNT;

/// What the values of each channel are multiplied with.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

fn build(v: &Values) -> Box<dyn Bsdf> {
    match v.file("file") {
        None => Box::new(Lambert { diffuse: [0.0; 3] }),
        Some(table) => Box::new(Shared(table)),
    }
}

fn diffuse(v: &Values) -> Box<dyn Bsdf> {
    let below = |table: Arc<dyn Bsdf>| lambert_below(&|g| table.specular(g));
    Box::new(Lambert { diffuse: v.file("file").map_or([0.0; 3], below) })
}

fn load(path: &Path) -> Result<Arc<dyn Bsdf>, String> {
    let mut bytes = Vec::new();
    // One byte more than wanted tells a file that is too long, however long it is.
    let read = File::open(path).and_then(|file| file.take(LENGTH as u64 + 1).read_to_end(&mut bytes));
    read.map_err(|error| format!("it cannot be read: {error}"))?;
    Ok(Arc::new(Table::new(measured_values(&bytes)?)))
}

/// The values of a file, per channel, with those that were not measured filled in.
fn measured_values(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let Some((header, rest)) = bytes.split_at_checked(HEADER) else {
        return Err(format!("it has {} bytes, fewer than the header of a MERL file", bytes.len()));
    };
    let sizes: Vec<i32> = header.as_chunks().0.iter().map(|b| i32::from_le_bytes(*b)).collect();
    if sizes != [THETA_H as i32, THETA_D as i32, PHI_D as i32] {
        let sizes: Vec<String> = sizes.iter().map(i32::to_string).collect();
        return Err(format!("its header says {} values; a MERL file has 90 x 90 x 180", sizes.join(" x ")));
    }
    match bytes.len() {
        LENGTH => {}
        length if length < LENGTH => return Err(format!("it ends after {length} of {LENGTH} bytes")),
        _ => return Err(format!("it is longer than the {LENGTH} bytes of a MERL file")),
    }
    let raw = rest.as_chunks().0;
    let value = |k: usize| {
        let value: [f64; 3] = std::array::from_fn(|c| f64::from_le_bytes(raw[c * COUNT + k]) * SCALE[c]);
        value.iter().all(|v| (0.0..f64::from(f32::MAX)).contains(v)).then_some(value.map(|v| v as f32))
    };
    let mut values: Vec<[f32; 3]> = Vec::with_capacity(COUNT);
    let mut measured = 0;
    for k in 0..COUNT {
        let own = value(k);
        measured += usize::from(own.is_some());
        let before = if (k / PHI_D).is_multiple_of(THETA_D) { THETA_D * PHI_D } else { PHI_D };
        let filled = || k.checked_sub(before).map_or([0.0; 3], |before| values[before]);
        let value = own.unwrap_or_else(filled);
        values.push(value);
    }
    if measured == 0 {
        Err("all its values are negative: nothing was measured".to_owned())
    } else {
        Ok(values)
    }
}

/// A measurement, φ_d fastest and θ_h slowest.
struct Table {
    values: Vec<[f32; 3]>,
    sampling: Option<Sampling>,
}

impl Table {
    fn new(values: Vec<[f32; 3]>) -> Self {
        let mut table = Self { values, sampling: None };
        let measured = |g: &Geometry<f64>| Lobe::specular(&table, g);
        table.sampling = sampling(&measured, lambert_below(&measured));
        table
    }
}

/// The values on both sides of a position on an axis of `count` values, and the share of the second.
#[inline(always)]
fn neighbours<T: Real>(position: T, count: usize) -> (usize, usize, T) {
    let below = position.floor();
    let first = below.to_usize().unwrap_or(0).min(count - 1);
    (first, (first + 1).min(count - 1), position - below)
}

impl Lobe for Table {
    fn is_mirror_symmetric(&self) -> bool {
        false
    }

    fn diffuse(&self) -> [f64; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn specular<T: Real>(&self, g: &Geometry<T>) -> [T; 3] {
        let [x, y, z] = difference(g);
        let theta_h = (g.tan2_h[0] + g.tan2_h[1]).sqrt().atan();
        let theta_d = (x * x + y * y).sqrt().atan2(z);
        // Swapping light and viewer turns both signs.
        let phi_d = if y < T::zero() { (-y).atan2(-x) } else { y.atan2(x) };
        let at = |part: T, count: usize| T::of(count as f64) * part;
        let h = neighbours(at((theta_h * T::of(FRAC_2_PI)).sqrt(), THETA_H), THETA_H);
        let d = neighbours(at(theta_d * T::of(FRAC_2_PI), THETA_D), THETA_D);
        let phi = at(phi_d * T::of(FRAC_1_PI), PHI_D);
        let first = phi.floor().to_usize().unwrap_or(0);
        let p = (first % PHI_D, (first + 1) % PHI_D, phi - phi.floor());
        let mix = |a: [T; 3], b: [T; 3], t: T| std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t);
        let along_phi = |h: usize, d: usize| {
            let row = &self.values[(h * THETA_D + d) * PHI_D..][..PHI_D];
            let value = |k: usize| row[k].map(|v| T::of(f64::from(v)));
            mix(value(p.0), value(p.1), p.2)
        };
        let along_d = |h: usize| mix(along_phi(h, d.0), along_phi(h, d.1), d.2);
        mix(along_d(h.0), along_d(h.1), h.2)
    }

    fn sampling(&self) -> Option<Sampling> {
        self.sampling.clone()
    }
}

/// A measurement that several materials have in common.
struct Shared(Arc<dyn Bsdf>);

impl Bsdf for Shared {
    fn diffuse(&self) -> [f64; 3] {
        self.0.diffuse()
    }
    fn specular(&self, g: &Geometry<f64>) -> [f64; 3] {
        self.0.specular(g)
    }
    fn specular_f32(&self, g: &Geometry<f32>) -> [f32; 3] {
        self.0.specular_f32(g)
    }
    fn specular_all(&self, geometries: &[Geometry<f32>]) -> Vec<[f32; 3]> {
        self.0.specular_all(geometries)
    }
    fn sampling(&self) -> Option<Sampling> {
        self.0.sampling()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn header(sizes: [i32; 3]) -> Vec<u8> {
        sizes.iter().flat_map(|s| s.to_le_bytes()).collect()
    }

    fn refusal(bytes: &[u8]) -> String {
        measured_values(bytes).unwrap_err()
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said() {
        assert!(refusal(b"MERL").contains("4 bytes, fewer than the header"));
        assert!(
            refusal(&header([90, 90, 360])).contains("90 x 90 x 360 values; a MERL file has 90 x 90 x 180")
        );
        let mut bytes = header([90, 90, 180]);
        assert!(refusal(&bytes).contains("ends after 12 of 34992012 bytes"));
        bytes.resize(LENGTH - 1, 0);
        assert!(refusal(&bytes).contains("ends after 34992011 of"));
        bytes.resize(LENGTH + 1, 0);
        assert!(refusal(&bytes).contains("longer than"));
        bytes.truncate(HEADER);
        (0..3 * COUNT).for_each(|_| bytes.extend((-1.0f64).to_le_bytes()));
        assert!(refusal(&bytes).contains("nothing was measured"));
    }

    #[test]
    fn what_was_not_measured_is_filled_in() {
        let mut bytes = header([90, 90, 180]);
        // Values are the index of θ_d; 3 and everything from 50 is missing, as NaN, infinite or negative.
        for k in 0..3 * COUNT {
            let theta_d = k / PHI_D % THETA_D;
            let missing = [-1.0, f64::NAN, f64::INFINITY][k % 3];
            let value = if theta_d == 3 || theta_d >= 50 { missing } else { theta_d as f64 };
            bytes.extend(value.to_le_bytes());
        }
        let values = measured_values(&bytes).unwrap();
        let red = |theta_d: usize| (values[(7 * THETA_D + theta_d) * PHI_D + 5][0] * 1500.0).round();
        assert_eq!([0, 2, 3, 4, 49, 50, 89].map(red), [0.0, 2.0, 2.0, 4.0, 49.0, 49.0, 49.0]);
    }

    proptest! {
        #[test]
        fn no_file_makes_the_reader_panic(mut bytes in prop::collection::vec(any::<u8>(), 0..64), like in any::<bool>()) {
            if like && bytes.len() >= HEADER {
                bytes[..HEADER].copy_from_slice(&header([90, 90, 180]));
            }
            prop_assert!(measured_values(&bytes).is_err());
        }
    }
}
