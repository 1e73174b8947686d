//! Physical laws, on random parameters of every model of the catalogue.

use std::f64::consts::{PI, TAU};

use lookmatch_materials::{Bsdf, Geometry, Kind, Material, Model, Role, Value, registry};
use proptest::prelude::*;

fn direction(cos: f64, phi: f64) -> [f64; 3] {
    let sin = (1.0 - cos * cos).sqrt();
    [sin * phi.cos(), sin * phi.sin(), cos]
}

/// A random material: each number somewhere in its plausible range, each choice at any option.
fn material(model: &'static Model, numbers: &[f64]) -> Material {
    let mut material = Material::new(model);
    for (index, (parameter, u)) in model.parameters.iter().zip(numbers.iter().cycle()).enumerate() {
        let at = |range: &lookmatch_materials::Interval| {
            (range.min + u * (range.max - range.min)).max(range.min + 0.02)
        };
        let value = match &parameter.kind {
            Kind::Number { range, .. } => Value::Number(at(&range.plausible)),
            Kind::Colour { range, .. } => {
                Value::Colour([at(&range.plausible), at(&range.plausible) * 0.8, 0.3])
            }
            Kind::Choice { options } => {
                Value::Choice(options[((u * options.len() as f64) as usize).min(options.len() - 1)])
            }
            Kind::List { range, .. } => Value::List([at(&range.plausible)].into()),
            Kind::File { .. } => continue,
        };
        material.set_value(index, value).unwrap();
    }
    material
}

fn any_material() -> impl Strategy<Value = Material> {
    let models = registry();
    (0..models.len(), prop::collection::vec(0.0..1.0f64, 29))
        .prop_filter("needs a file", move |(index, _)| models[*index].load.is_none())
        .prop_map(move |(index, numbers)| material(models[index], &numbers))
}

/// A material with every choice of a formula as it is by default.
fn by_default_formulas(mut material: Material) -> Material {
    for (index, parameter) in material.model().parameters.iter().enumerate() {
        if let (Kind::Choice { options }, Role::Variant) = (&parameter.kind, parameter.role) {
            material.set_value(index, Value::Choice(options[0])).unwrap();
        }
    }
    material
}

/// Directional albedo by quadrature over the half vector, the largest channel.
fn albedo(bsdf: &dyn Bsdf, cos_o: f64) -> f64 {
    let (n_theta, n_phi) = (160, 48);
    let wo = direction(cos_o, 0.3);
    let (mut geometries, mut weights) = (Vec::new(), Vec::new());
    for i in 0..n_theta {
        // θ_h = π/2 t³ puts the nodes where narrow lobes are.
        let t = (i as f64 + 0.5) / n_theta as f64;
        let (theta, jacobian) = (PI / 2.0 * t.powi(3), PI / 2.0 * 3.0 * t * t / n_theta as f64);
        for j in 0..n_phi {
            let h = direction(theta.cos(), TAU * (j as f64 + 0.5) / n_phi as f64);
            let cos_d: f64 = (0..3).map(|k| wo[k] * h[k]).sum();
            let wi = std::array::from_fn(|k| 2.0 * cos_d * h[k] - wo[k]);
            let Some(g) = Geometry::new(wi, wo).filter(|_| cos_d > 0.0) else {
                continue;
            };
            weights.push(4.0 * cos_d * g.cos_i() * theta.sin() * jacobian * TAU / n_phi as f64);
            geometries.push(g.to_f32());
        }
    }
    let mut sum = bsdf.diffuse();
    for (f, weight) in bsdf.specular_all(&geometries).into_iter().zip(weights) {
        (0..3).for_each(|c| sum[c] += f64::from(f[c]) * weight);
    }
    sum.into_iter().fold(0.0, f64::max)
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

    /// Energy: what a model says that it reflects at most. 1 is the law of energy, which not all models keep.
    #[test]
    fn no_more_is_reflected_than_the_model_says(m in any_material(), co in 0.03..1.0f64) {
        let m = by_default_formulas(m);
        let (found, most) = (albedo(&*m.bsdf(), co), m.model().largest_albedo);
        prop_assert!(found <= most * (1.0 + 1e-3), "{m} at cos {co}: {found}, {most} allowed");
    }

    #[test]
    fn isotropic_materials_do_not_notice_a_turn(
        m in any_material(), ci in 0.01..1.0f64, co in 0.01..1.0f64, phi in 0.0..TAU, turn in 0.0..TAU,
    ) {
        let mut m = m;
        for alias in m.model().aliases {
            m.set_number(alias.name, m.number(alias.name).unwrap()).unwrap();
        }
        for parameter in m.model().parameters.iter().filter(|p| p.role == Role::Anisotropy || p.name.contains("anisotrop")) {
            m.set_number(parameter.name, 0.0).unwrap();
        }
        prop_assert!(m.bsdf().is_isotropic());
        let a = m.bsdf().evaluate(direction(ci, phi), direction(co, 1.0));
        let b = m.bsdf().evaluate(direction(ci, phi + turn), direction(co, 1.0 + turn));
        prop_assert!((0..3).all(|c| (a[c] - b[c]).abs() <= 1e-8 * a[c].max(1e-9)), "{m}: {a:?} {b:?}");
    }
}

/// The albedo of everything, the Lambert term included, per channel.
/// What a white surface of layers absorbs is what its formula loses; these lose nothing.
#[test]
fn white_layers_reflect_everything() {
    for text in [
        "openpbr:base_color=1",
        "openpbr:base_color=1,specular_ior=2.5,specular_roughness=0.9",
        "openpbr:base_color=1,specular_roughness=0.5,specular_roughness_anisotropy=0.6",
        "openpbr:base_color=1,base_diffuse_roughness=1,specular_roughness=0.4,energy_compensation=turquin",
        "openpbr:base_color=1,coat_weight=0.7,coat_roughness=0.4,specular_roughness=0.4",
        "openpbr:base_color=1,fuzz_weight=0.6,fuzz_roughness=0.4",
        "standard-surface:base_color=1,specular=0.8,coat=0.5,coat_roughness=0.5,specular_roughness=0.5",
        "standard-surface:base_color=1,specular=0.6,sheen=0.7",
        "principled:base_color=1",
        "principled:base_color=1,distribution=ggx,specular_ior_level=0",
        "principled:base_color=1,metallic=1,roughness=0.9",
        "principled:base_color=1,coat_weight=1,coat_roughness=0.4,sheen_weight=0.5,roughness=0.7,diffuse_roughness=1",
        "kulla-conty:diffuse=0,f0=1,roughness=0.8",
        "kulla-conty:diffuse=0,f0=1,roughness=0.3,masking=separable",
    ] {
        let bsdf = Material::parse(text).unwrap().bsdf();
        for cos_o in [0.1, 0.4, 0.95] {
            let found = albedo(&*bsdf, cos_o);
            assert!((found - 1.0).abs() < 3e-3, "{text} at cos {cos_o}: {found}");
        }
    }
}

/// χ² of drawn directions against the density, on a grid over the whole sphere of directions: what Mitsuba's tests do with
/// every BSDF. The density's integral over all cells is 1, and cells get as many directions as it foretells.
#[test]
fn drawn_directions_follow_their_density() {
    let mut number = numbers(1);
    for model in registry().iter().filter(|m| m.load.is_none()) {
        for _ in 0..3 {
            let numbers: Vec<f64> = (0..29).map(|_| number()).collect();
            let material = material(model, &numbers);
            let Some(sampling) = material.bsdf().sampling() else { continue };
            let wo = direction(0.2 + 0.8 * number(), TAU * number());
            let (integral, chi2, cells) = chi_squared(&sampling, wo, &mut number);
            assert!((integral - 1.0).abs() < 5e-3, "{material}: density integrates to {integral}");
            // The statistic has mean `cells` and variance 2 `cells`; one in 10⁷ lies beyond five deviations.
            let bound = cells as f64 + 5.5 * (2.0 * cells as f64).sqrt();
            assert!(chi2 < bound, "{material} from {wo:?}: χ² = {chi2:.0} over {cells} cells");
        }
    }
}

/// Numbers in `[0, 1)`, always the same ones, so that no test fails by chance: Steele, Lea & Flood (2014), SplitMix.
fn numbers(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The integral of a density, χ² of 200,000 draws, and the number of cells.
fn chi_squared(
    sampling: &lookmatch_materials::Sampling,
    wo: [f64; 3],
    number: &mut dyn FnMut() -> f64,
) -> (f64, f64, usize) {
    const DRAWS: usize = 200_000;
    let (rows, columns) = (24, 48);
    let mut drawn = vec![0.0; rows * columns];
    for _ in 0..DRAWS {
        let [x, y, z] = sampling.sample(wo, [number(), number()]);
        let row = (((1.0 - z) / 2.0 * rows as f64) as usize).min(rows - 1);
        let column = ((y.atan2(x).rem_euclid(TAU) / TAU * columns as f64) as usize).min(columns - 1);
        drawn[row * columns + column] += 1.0;
    }
    let density = |z: f64, phi: f64| sampling.density(direction(z.clamp(-1.0, 1.0), phi), wo);
    let expected: Vec<f64> = (0..rows * columns)
        .map(|k| {
            let (row, column) = ((k / columns) as f64, (k % columns) as f64);
            let z = |t: f64| 1.0 - 2.0 * (row + t) / rows as f64;
            let phi = |t: f64| TAU * (column + t) / columns as f64;
            let area = 2.0 / rows as f64 * TAU / columns as f64;
            area * integrate(&|s, t| density(z(s), phi(t)), [0.0, 1.0, 0.0, 1.0], 0)
        })
        .collect();
    let (mut chi2, mut cells, mut rest) = (0.0, 0, (0.0, 0.0));
    for (drawn, expected) in drawn.iter().zip(&expected) {
        let expected = expected * DRAWS as f64;
        if expected < 10.0 {
            rest = (rest.0 + drawn, rest.1 + expected);
            continue;
        }
        chi2 += (drawn - expected).powi(2) / expected;
        cells += 1;
    }
    if rest.1 > 10.0 {
        chi2 += (rest.0 - rest.1).powi(2) / rest.1;
        cells += 1;
    }
    (expected.iter().sum(), chi2, cells)
}

/// The integral of `f` over `[s0, s1] × [t0, t1]`, cut until its parts agree.
fn integrate(f: &dyn Fn(f64, f64) -> f64, [s0, s1, t0, t1]: [f64; 4], depth: usize) -> f64 {
    let rule = |n: usize, area: [f64; 4]| -> f64 {
        let [s0, s1, t0, t1] = area;
        let at = |k: usize, a: f64, b: f64| a + (b - a) * (k as f64 + 0.5) / n as f64;
        let sum: f64 = (0..n * n).map(|k| f(at(k / n, s0, s1), at(k % n, t0, t1))).sum();
        sum * (s1 - s0) * (t1 - t0) / (n * n) as f64
    };
    let area = [s0, s1, t0, t1];
    let (coarse, fine) = (rule(3, area), rule(4, area));
    // Far below the noise of the draws in a cell.
    if depth > 9 || depth > 2 && (coarse - fine).abs() < 3e-4 * fine + 1e-6 {
        return fine;
    }
    let (s, t) = (0.5 * (s0 + s1), 0.5 * (t0 + t1));
    [[s0, s, t0, t], [s, s1, t0, t], [s0, s, t, t1], [s, s1, t, t1]]
        .into_iter()
        .map(|part| integrate(f, part, depth + 1))
        .sum()
}

/// Energy again, with parameters near the ends of their ranges, where albedos are largest.
#[test]
fn extreme_materials_reflect_no_more_than_the_model_says() {
    for model in registry().iter().filter(|m| m.load.is_none()) {
        let mut number = numbers(7);
        for _ in 0..150 {
            let near_low: Vec<f64> = model.parameters.iter().map(|_| number().powi(3)).collect();
            let near_ends: Vec<f64> =
                near_low.iter().map(|v| if number() < 0.5 { 1.0 - v } else { *v }).collect();
            let material = by_default_formulas(material(model, &near_ends));
            let cos = 0.03 + 0.97 * number().powi(2);
            let (found, most) = (albedo(&*material.bsdf(), cos), model.largest_albedo);
            assert!(found <= most * (1.0 + 1e-3), "{material} at cos {cos}: {found}, {most} allowed");
        }
    }
}

/// Two values of a parameter and the one halfway between them.
fn halfway(parameter: &lookmatch_materials::Parameter, u: f64, v: f64) -> Option<[Value; 3]> {
    let number = |range: &lookmatch_materials::Range| {
        let (min, max) = (range.plausible.min.max(0.02), range.plausible.max);
        let (low, high) = (min + 0.4 * u * (max - min), max - 0.4 * v * (max - min));
        [low, high, (low + high) / 2.0]
    };
    match &parameter.kind {
        Kind::Number { range, .. } => Some(number(range).map(Value::Number)),
        Kind::List { range, .. } => Some(number(range).map(|v| Value::List([v].into()))),
        Kind::Colour { .. } => {
            let (low, high) = ([0.1 * u, 0.3, 0.9], [0.9, 0.8 * v, 0.2]);
            Some([low, high, std::array::from_fn(|c| (low[c] + high[c]) / 2.0)].map(Value::Colour))
        }
        Kind::Choice { .. } | Kind::File { .. } => None,
    }
}

/// Whether the BSDF halfway between two values of a parameter is halfway between their BSDFs, and whether it changes at all.
fn is_linear(model: &'static Model, index: usize, draw: &mut dyn FnMut() -> f64) -> [bool; 2] {
    let (mut linear, mut changes) = (true, false);
    for round in 0..4 {
        if !linear {
            break;
        }
        let numbers: Vec<f64> = (0..29).map(|_| draw()).collect();
        // Random lobes may be too narrow, or turned away, to be met by chance.
        let material =
            if round == 0 { Material::new(model) } else { by_default_formulas(material(model, &numbers)) };
        let Some(values) = halfway(&model.parameters[index], draw(), draw()) else { return [false; 2] };
        let bsdf = |value: Value| {
            let mut changed = material.clone();
            changed.set_value(index, value).unwrap();
            changed.bsdf()
        };
        let bsdfs = values.map(bsdf);
        for _ in 0..6 {
            // Near the mirror direction, where every lobe has something to say.
            let (cos, phi) = (0.1 + 0.85 * draw(), TAU * draw());
            let wi =
                direction((cos + 0.1 * (draw() - 0.5)).clamp(0.05, 1.0), phi + PI + 0.2 * (draw() - 0.5));
            let Some(g) = Geometry::new(wi, direction(cos, phi)) else { continue };
            for part in [
                |b: &dyn Bsdf, _: &Geometry<f64>| b.diffuse(),
                |b: &dyn Bsdf, g: &Geometry<f64>| b.specular(g),
            ] {
                let [a, b, m] = [0, 1, 2].map(|k| part(&*bsdfs[k], &g));
                let largest = a.iter().chain(&b).fold(0.0f64, |most, v| most.max(*v));
                linear &= (0..3).all(|c| (m[c] - (a[c] + b[c]) / 2.0).abs() <= 1e-9 * largest);
                changes |= (0..3).any(|c| (a[c] - b[c]).abs() > 1e-6 * largest);
            }
        }
    }
    [linear, changes]
}

#[test]
fn models_are_linear_in_what_they_declare_and_search_nothing_linear_unaware() {
    let mut numbers = (0..).map(|k| (0.5 + 0.618_033_988_75 * f64::from(k)).fract());
    let mut draw = || numbers.next().unwrap();
    let mut declared = 0;
    for model in registry().iter().filter(|model| model.load.is_none()) {
        let index = |name: &&str| model.parameters.iter().position(|p| p.name == *name);
        for name in model.linear {
            let found = is_linear(model, index(name).expect("a parameter"), &mut draw);
            assert_eq!(found, [true; 2], "{} in {name}", model.name);
            declared += 1;
        }
        for name in model.searched.iter().filter(|name| !model.linear.contains(name)) {
            let is_used = index(name).is_some_and(|index| is_linear(model, index, &mut draw) == [true; 2]);
            assert!(!is_used, "{} is linear in {name}, and does not say so", model.name);
        }
    }
    assert!(declared > 20, "{declared}");
}
