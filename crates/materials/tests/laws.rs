//! Physical laws, on random parameters of every model of the catalogue.

use std::f64::consts::{PI, TAU};

use lookmatch_materials::{Bsdf, Geometry, Kind, Material, Model, Value, registry};
use proptest::prelude::*;

fn direction(cos: f64, phi: f64) -> [f64; 3] {
    let sin = (1.0 - cos * cos).sqrt();
    [sin * phi.cos(), sin * phi.sin(), cos]
}

/// A random material: each number somewhere in its plausible range, each choice at any option.
fn material(model: &'static Model, numbers: &[f64]) -> Material {
    let mut material = Material::new(model);
    for (index, (parameter, u)) in model.parameters.iter().zip(numbers.iter().cycle()).enumerate() {
        let at = |range: &lookmatch_materials::Interval| (range.min + u * (range.max - range.min)).max(0.02);
        let value = match &parameter.kind {
            Kind::Number { range, .. } => Value::Number(at(&range.plausible).max(range.plausible.min + 0.02)),
            Kind::Colour { range, .. } => {
                Value::Colour([at(&range.plausible), at(&range.plausible) * 0.8, 0.3])
            }
            Kind::Choice { options } => {
                Value::Choice(options[((u * options.len() as f64) as usize).min(options.len() - 1)])
            }
        };
        material.set_value(index, value).unwrap();
    }
    material
}

fn any_material() -> impl Strategy<Value = Material> {
    let models = registry();
    (0..models.len(), prop::collection::vec(0.0..1.0f64, 11))
        .prop_map(move |(index, numbers)| material(models[index], &numbers))
}

/// Directional albedo of the specular lobe by quadrature over the half vector, per channel.
fn specular_albedo(bsdf: &dyn Bsdf, cos_o: f64) -> [f64; 3] {
    let (n_theta, n_phi) = (400, 64);
    let wo = direction(cos_o, 0.3);
    let mut sum = [0.0; 3];
    for i in 0..n_theta {
        // θ_h = π/2 t³ puts the nodes where narrow lobes are.
        let t = (i as f64 + 0.5) / n_theta as f64;
        let (theta, jacobian) = (PI / 2.0 * t.powi(3), PI / 2.0 * 3.0 * t * t / n_theta as f64);
        for j in 0..n_phi {
            let phi = TAU * (j as f64 + 0.5) / n_phi as f64;
            let h = direction(theta.cos(), phi);
            let cos_d: f64 = (0..3).map(|k| wo[k] * h[k]).sum();
            let wi = std::array::from_fn(|k| 2.0 * cos_d * h[k] - wo[k]);
            let Some(g) = Geometry::new(wi, wo).filter(|_| cos_d > 0.0) else {
                continue;
            };
            let weight = 4.0 * cos_d * g.cos_i() * theta.sin() * jacobian * TAU / n_phi as f64;
            let f = bsdf.specular(&g);
            (0..3).for_each(|c| sum[c] += f[c] * weight);
        }
    }
    sum
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn never_negative_and_always_finite(
        m in any_material(), ci in 0.001..1.0f64, co in 0.001..1.0f64, phi in 0.0..TAU,
    ) {
        let (wi, wo) = (direction(ci, phi), direction(co, 1.0));
        let f = m.bsdf().evaluate(wi, wo);
        prop_assert!(f.iter().all(|v| v.is_finite() && *v >= 0.0), "{m}: {f:?}");
        let fast = m.bsdf().evaluate_f32(wi, wo);
        prop_assert!(fast.iter().all(|v| v.is_finite() && *v >= 0.0), "{m}: {fast:?}");
    }

    #[test]
    fn reciprocal(m in any_material(), ci in 0.01..1.0f64, co in 0.01..1.0f64, phi in 0.0..TAU) {
        prop_assume!(m.model().is_reciprocal);
        let (wi, wo) = (direction(ci, phi), direction(co, 1.0));
        let (there, back) = (m.bsdf().evaluate(wi, wo), m.bsdf().evaluate(wo, wi));
        for c in 0..3 {
            prop_assert!((there[c] - back[c]).abs() <= 1e-9 * there[c].max(back[c]), "{m}: {there:?} {back:?}");
        }
    }

    #[test]
    fn the_interface_reflects_no_more_than_arrives(m in any_material(), co in 0.03..1.0f64) {
        // Ward's older normalisations and the distribution "as" do not conserve energy; their files say by how much.
        let text = m.to_string();
        prop_assume!(!text.contains("variant=duer") && !text.contains("variant=ward") && m.model().name != "as");
        let albedo = specular_albedo(&*m.bsdf(), co);
        prop_assert!(albedo.iter().all(|a| *a <= 1.0 + 2e-3), "{m} at cos {co}: {albedo:?}");
    }

    #[test]
    fn isotropic_materials_do_not_notice_a_turn(
        m in any_material(), ci in 0.01..1.0f64, co in 0.01..1.0f64, phi in 0.0..TAU, turn in 0.0..TAU,
    ) {
        let mut m = m;
        if m.model().resolve("roughness").is_ok() {
            m.set_number("roughness", 0.3).unwrap();
        }
        prop_assert!(m.bsdf().is_isotropic());
        let a = m.bsdf().evaluate(direction(ci, phi), direction(co, 1.0));
        let b = m.bsdf().evaluate(direction(ci, phi + turn), direction(co, 1.0 + turn));
        prop_assert!((0..3).all(|c| (a[c] - b[c]).abs() <= 1e-8 * a[c].max(1e-9)), "{m}: {a:?} {b:?}");
    }

    #[test]
    fn drawn_directions_follow_their_density(m in any_material(), co in 0.2..1.0f64) {
        let Some(sampling) = m.bsdf().sampling() else { return Ok(()) };
        // E[cos_i-weighted indicator / pdf] over drawn directions must equal its integral: here the solid angle
        // of a band in cos θ_i around the mirror direction, where the density is highest.
        let wo = direction(co, 0.7);
        let mirror = [-wo[0], -wo[1], wo[2]];
        let inside = |w: &[f64; 3]| w[2] > 0.0 && (0..3).map(|k| w[k] * mirror[k]).sum::<f64>() > 0.98;
        let n = 256;
        let mut drawn = 0.0;
        for i in 0..n * n {
            let u = [(f64::from(i / n) + 0.5) / f64::from(n), (f64::from(i % n) + 0.5) / f64::from(n)];
            if inside(&sampling.sample(wo, u)) {
                drawn += 1.0 / f64::from(n * n);
            }
        }
        let mut integral = 0.0;
        for i in 0..400 {
            let t = (f64::from(i) + 0.5) / 400.0;
            let (theta, jacobian) = (PI / 2.0 * t.powi(3), PI / 2.0 * 3.0 * t * t / 400.0);
            for j in 0..256 {
                let h = direction(theta.cos(), TAU * (f64::from(j) + 0.5) / 256.0);
                let cos_d: f64 = (0..3).map(|k| wo[k] * h[k]).sum();
                let wi = std::array::from_fn(|k| 2.0 * cos_d * h[k] - wo[k]);
                if let Some(g) = Geometry::new(wi, wo).filter(|g| cos_d > 0.0 && inside(&g.wi)) {
                    integral += sampling.density(&g) * 4.0 * cos_d * theta.sin() * jacobian * TAU / 256.0;
                }
            }
        }
        prop_assert!((drawn - integral).abs() < 0.01, "{m}: drawn {drawn}, density {integral}");
    }
}
