//! What one evaluation costs, for every model of the catalogue with its default parameters: criterion's times are those of one
//! geometry in single precision. Beside them a bare GGX lobe, the least that a microfacet model can cost, and Lambert, which has
//! nothing to evaluate.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use lookmatch_materials::distribution::{Distribution, Shape};
use lookmatch_materials::fresnel::Fresnel;
use lookmatch_materials::masking::Masking;
use lookmatch_materials::microfacet::Microfacet;
use lookmatch_materials::{Bsdf, Geometry, Kind, Material, Model, registry};

fn direction(cos: f64, turn: f64) -> [f64; 3] {
    let sin = (1.0 - cos * cos).sqrt();
    [sin * (TAU * turn).cos(), sin * (TAU * turn).sin(), cos]
}

/// Pairs of directions spread over both hemispheres, and as many near the mirror direction, in turn.
fn geometries() -> Vec<Geometry<f32>> {
    let of_pair = |k: u32| {
        // Multiples of irrational numbers fill the unit cube evenly.
        let at = |ratio: f64| (f64::from(k) * ratio).fract();
        let (a, b, c) = (at(0.819_172_513), at(0.671_043_607), at(0.549_700_478));
        let wo = direction(0.05 + 0.95 * a, b);
        let apart = if k.is_multiple_of(2) { c } else { 0.5 + 0.1 * (c - 0.5) };
        let cos_i = if k.is_multiple_of(2) { 0.05 + 0.95 * at(0.450_265_3) } else { wo[2] };
        Geometry::new(direction(cos_i, b + apart), wo)
    };
    (1..=9000).filter_map(of_pair).map(|g| g.to_f32()).collect()
}

/// The time of `evaluations` evaluations, measured on whole tables.
fn time(bsdf: &dyn Bsdf, geometries: &[Geometry<f32>], evaluations: u64) -> Duration {
    let tables = evaluations.div_ceil(geometries.len() as u64);
    let start = Instant::now();
    for _ in 0..tables {
        black_box(bsdf.specular_all(black_box(geometries)));
    }
    start.elapsed().mul_f64(evaluations as f64 / (tables * geometries.len() as u64) as f64)
}

fn bare_ggx() -> Microfacet {
    Microfacet {
        diffuse: [0.0; 3],
        specular: [1.0; 3],
        distribution: Distribution { shape: Shape::Ggx, alpha: [0.2; 2] },
        masking: Masking::One,
        fresnel: [Fresnel::None; 3],
    }
}

fn needs_a_file(model: &Model) -> bool {
    model.parameters.iter().any(|p| matches!(p.kind, Kind::File { .. }))
}

fn evaluation(criterion: &mut Criterion) {
    let geometries = geometries();
    let mut group = criterion.benchmark_group("evaluation");
    group.sample_size(20).measurement_time(Duration::from_secs(1)).warm_up_time(Duration::from_millis(300));
    let mut add = |name: &str, bsdf: &dyn Bsdf| {
        group.bench_function(name, |bencher| bencher.iter_custom(|n| time(bsdf, &geometries, n)));
    };
    add("bare GGX lobe", &bare_ggx());
    for model in registry().iter().filter(|m| !needs_a_file(m)) {
        add(model.name, &*Material::new(model).bsdf());
    }
}

criterion_group!(benches, evaluation);
criterion_main!(benches);
