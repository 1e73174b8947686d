//! Files in the format of the MERL database: written from a known reflection, and read back.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fs;
use std::path::Path;

use lookmatch_materials::{Bsdf, Material};

fn direction(cos: f64, phi: f64) -> [f64; 3] {
    let sin = (1.0 - cos * cos).sqrt();
    [sin * phi.cos(), sin * phi.sin(), cos]
}

/// Writes a reflection where the values of a MERL file lie, −1 below the horizon.
fn write(bsdf: &dyn Bsdf, path: &Path) {
    let mut bytes: Vec<u8> = [90i32, 90, 180].iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut values = Vec::new();
    for (i, j, k) in (0..90).flat_map(|i| (0..90).flat_map(move |j| (0..180).map(move |k| (i, j, k)))) {
        let (sin_h, cos_h) = (FRAC_PI_2 * (f64::from(i) / 90.0).powi(2)).sin_cos();
        let d = direction((FRAC_PI_2 * f64::from(j) / 90.0).cos(), PI * f64::from(k) / 180.0);
        let wi = [cos_h * d[0] + sin_h * d[2], d[1], cos_h * d[2] - sin_h * d[0]];
        let h = [sin_h, 0.0, cos_h];
        let wo: [f64; 3] = std::array::from_fn(|a| 2.0 * d[2] * h[a] - wi[a]);
        let above = wi[2] > 0.0 && wo[2] > 0.0;
        values.push(if above { bsdf.evaluate(wi, wo) } else { [-1.0; 3] });
    }
    for (c, scale) in [1500.0, 1500.0 / 1.15, 1500.0 / 1.66].into_iter().enumerate() {
        values.iter().for_each(|v| bytes.extend((v[c] * scale).to_le_bytes()));
    }
    fs::write(path, bytes).unwrap();
}

fn read(path: &Path) -> Result<Material, String> {
    Material::parse(&format!("merl-file:file={}", path.display())).map_err(|e| e.to_string())
}

#[test]
fn a_known_reflection_survives_being_written_and_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plastic.binary");
    let plastic = Material::parse("ggx:diffuse=0.2/0.3/0.1,roughness=0.2").unwrap().bsdf();
    write(&*plastic, &path);
    let material = read(&path).unwrap();
    let measured = material.bsdf();
    let mut worst = 0.0f64;
    for k in 1..20_000 {
        let at = |ratio: f64| (f64::from(k) * ratio).fract();
        let (wi, wo) = (
            direction(0.2 + 0.8 * at(0.8191725), TAU * at(0.6710436)),
            direction(0.2 + 0.8 * at(0.5497005), 1.0),
        );
        let (expected, exact) = (plastic.evaluate(wi, wo), measured.evaluate(wi, wo));
        let (back, fast) = (measured.evaluate(wo, wi), measured.evaluate_f32(wi, wo));
        for c in 0..3 {
            worst = worst.max((exact[c] / expected[c] - 1.0).abs());
            assert!((back[c] - exact[c]).abs() <= 1e-9 * exact[c], "{exact:?} {back:?}");
            assert!((f64::from(fast[c]) - exact[c]).abs() <= 1e-4 * exact[c], "{exact:?} {fast:?}");
        }
    }
    assert!(worst < 0.01, "off by {worst}");
    let diffuse = material.diffuse_bsdf().diffuse();
    // The plastic's highlight is nowhere quite 0.
    assert!((0..3).all(|c| (0.0..0.004).contains(&(diffuse[c] - [0.2, 0.3, 0.1][c]))), "{diffuse:?}");
    let sampling = measured.sampling().unwrap();
    assert!((0.05..0.3).contains(&sampling.width()) && measured.is_isotropic());
    assert_eq!(Material::parse(&material.to_string()).unwrap(), material);
}

#[test]
fn files_that_cannot_be_used_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.binary");
    let refusal = || read(&path).unwrap_err();
    assert!(refusal().contains("damaged.binary' as file of model 'merl-file': it cannot be read"));
    fs::write(&path, [90u8, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0, 1, 2]).unwrap();
    assert!(refusal().contains("it ends after 14 of 34992012 bytes"));
    assert!(read(folder.path()).unwrap_err().contains("it cannot be read"));
    assert!(Material::parse("merl-file").unwrap_err().to_string().contains("needs file=PATH"));
}
