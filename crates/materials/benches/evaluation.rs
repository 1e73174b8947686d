//! What one evaluation costs, and building a BSDF, for every model of the catalogue: `cargo bench -p lookmatch-materials --bench evaluation` writes
//! `docs/results/evaluation.md` to standard output. One thread, single precision, whole tables of geometries as the renderer
//! evaluates them; the fastest of several runs.
//!
//! The floor is a bare GGX lobe, the least that a microfacet model can cost, measured in the same run.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use lookmatch_materials::distribution::{Distribution, Shape};
use lookmatch_materials::fresnel::Fresnel;
use lookmatch_materials::masking::Masking;
use lookmatch_materials::microfacet::Microfacet;
use lookmatch_materials::{Bsdf, Geometry, Material, registry};

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

/// Seconds of the fastest of some runs.
fn fastest(runs: usize, mut work: impl FnMut()) -> f64 {
    let seconds = (0..runs).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    seconds.fold(f64::INFINITY, f64::min)
}

/// Nanoseconds of one evaluation.
fn evaluation(bsdf: &dyn Bsdf, geometries: &[Geometry<f32>]) -> f64 {
    // What is built at the first evaluation is part of building.
    drop(black_box(bsdf.specular_all(geometries)));
    1e9 * fastest(15, || drop(black_box(bsdf.specular_all(black_box(geometries))))) / geometries.len() as f64
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

/// Materials with what only costs time where it is used, beside each model as it is by default.
const MORE: [&str; 7] = [
    "gltf:clearcoat=1,sheen_color=0.5",
    "disney:sheen=1,clearcoat=1",
    "openpbr:coat_weight=1",
    "openpbr:fuzz_weight=0.5,coat_weight=1,base_diffuse_roughness=0.5",
    "standard-surface:coat=1,sheen=0.5",
    "principled:coat_weight=1,sheen_weight=0.5",
    "lafortune:weight=0.1/0.2/0.3,exponent=10/50/200",
];

fn main() {
    let geometries = geometries();
    let floor = evaluation(&bare_ggx(), &geometries);
    println!("# What one evaluation costs\n");
    println!(
        "Written by `cargo bench -p lookmatch-materials --bench evaluation`: one thread, single precision, {} geometries at once, fastest",
        geometries.len()
    );
    println!(
        "of 15 runs. Each model with its default parameters, then some with more layers. The floor is a bare GGX lobe"
    );
    println!(
        "(D/(4 cos cos), no masking, no Fresnel term) in the same run: {floor:.1} ns. Building includes all that the first evaluation works out.\n"
    );
    println!("| material | ns per evaluation | times the floor | building, µs |\n|---|---|---|---|");
    let models = registry().iter().filter(|m| m.load.is_none()).map(|m| m.name);
    for text in models.chain(MORE) {
        let material = Material::parse(text).expect("a material of the catalogue");
        let bsdf = material.bsdf();
        let each = evaluation(&*bsdf, &geometries);
        let build = fastest(15, || drop(black_box(material.bsdf().specular_all(&geometries[..1]))));
        println!("| `{text}` | {each:.1} | {:.1} | {:.1} |", each / floor, 1e6 * build);
    }
}
