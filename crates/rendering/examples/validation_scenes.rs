//! Pictures of the built-in scenes that take meshes, and of spheres that wear three metals:
//! `cargo run --release --example validation_scenes -- FOLDER [SIZE] [SAMPLES] [SCENE]`.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use lookmatch_rendering::{Illumination, Part, PathTracer, Scene, Spot, Wears};

const GOLD: &str = "ggx-conductor:eta=0.143/0.375/1.442,k=3.983/2.386/1.603,roughness=0.2";
const SILVER: &str = "ggx-conductor:eta=0.155/0.117/0.138,k=4.828/3.122/2.147,roughness=0.2";
const COPPER: &str = "ggx-conductor:eta=0.200/0.924/1.102,k=3.912/2.452/2.142,roughness=0.2";
/// Linear albedos of the patches of a colour checker, about, row by row from the top.
const PATCHES: [[f64; 3]; 24] = [
    [0.17, 0.08, 0.05],
    [0.56, 0.30, 0.22],
    [0.11, 0.19, 0.34],
    [0.10, 0.15, 0.05],
    [0.23, 0.21, 0.43],
    [0.13, 0.51, 0.41],
    [0.71, 0.20, 0.02],
    [0.06, 0.10, 0.38],
    [0.56, 0.08, 0.12],
    [0.11, 0.04, 0.14],
    [0.34, 0.50, 0.04],
    [0.78, 0.36, 0.02],
    [0.02, 0.05, 0.29],
    [0.05, 0.29, 0.06],
    [0.45, 0.03, 0.04],
    [0.84, 0.57, 0.01],
    [0.50, 0.08, 0.30],
    [0.01, 0.23, 0.37],
    [0.88, 0.88, 0.86],
    [0.59, 0.59, 0.58],
    [0.36, 0.36, 0.36],
    [0.19, 0.19, 0.19],
    [0.09, 0.09, 0.09],
    [0.03, 0.03, 0.03],
];

/// A picture's name, its scene, the materials, and who wears them.
type Entry<'a> = (&'a str, &'a str, Vec<String>, Wears<'a>);

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = Path::new(arguments.first().ok_or("expected a folder for the pictures")?);
    let number = |k: usize, default| arguments.get(k).map_or(Ok(default), |text| text.parse::<u32>());
    let (size, samples) = (number(1, 300)? as usize, number(2, 64)?);
    let plastic = "ggx:diffuse=0.5/0.1/0.06,roughness=0.15".to_owned();
    let metals = [GOLD, SILVER, COPPER].map(str::to_owned).to_vec();
    let patch = |[r, g, b]: &[f64; 3]| format!("ggx:diffuse={r}/{g}/{b},roughness=0.25");
    let chart: Vec<String> = PATCHES.iter().map(patch).collect();
    let by_patch = |spot: Spot| {
        let [column, row] = [(spot.texture[0] * 6.0) as usize, ((1.0 - spot.texture[1]) * 4.0) as usize];
        row.min(3) * 6 + column
    };
    let by_subject = |spot: Spot| spot.subject;
    let pictures: [Entry; 8] = [
        ("metals", "spheres", metals.clone(), &by_subject),
        ("blobs", "blobs", vec![plastic.clone()], &|_| 0),
        ("blobs-metals", "blobs", metals, &by_subject),
        ("checker-wall", "checker-wall", chart, &by_patch),
        ("spot", "spot", vec![plastic.clone()], &|_| 0),
        ("spot-gold", "spot", vec![GOLD.to_owned()], &|_| 0),
        ("shader-ball", "shader-ball", vec![plastic], &|_| 0),
        ("shader-ball-gold", "shader-ball", vec![GOLD.to_owned()], &|_| 0),
    ];
    for (name, scene, materials, wears) in pictures {
        if arguments.get(3).is_some_and(|wanted| !name.starts_with(wanted.as_str())) {
            continue;
        }
        let start = Instant::now();
        let materials = materials.iter().map(|m| Material::parse(m)).collect::<Result<Vec<_>, _>>()?;
        let scene = Scene::load(scene)?.for_model(materials[0].model());
        let tracer = PathTracer::prepare(&scene, Illumination::All, size, samples, 1)?;
        let picture: Image = tracer.render_dressed(&materials, wears, Part::Full);
        lookmatch_imaging::write(&folder.join(name).with_extension("png"), &picture, &[])?;
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
    Ok(())
}
