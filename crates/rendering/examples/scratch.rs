use lookmatch_materials::*;
use lookmatch_rendering::*;
use std::path::Path;
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let scene = Scene::load(&args[1]).unwrap();
    let ill = match args[2].as_str() {
        "point" => Illumination::Point,
        "env" => Illumination::Environment,
        _ => Illumination::All,
    };
    let m = Material::parse(&args[3]).unwrap();
    let t = Instant::now();
    let r = Renderer::prepare(&scene, ill, 300).unwrap();
    println!("prepare {:?} subjects {}", t.elapsed(), r.subjects().len());
    let t = Instant::now();
    let im = r.render(&m, Part::Full);
    println!("stream {:?}", t.elapsed());
    let t = Instant::now();
    let r = r.keep_transport();
    println!("transport {:?}", t.elapsed());
    for _ in 0..3 {
        let t = Instant::now();
        let im2 = r.render(&m, Part::Full);
        println!("render {:?} same {}", t.elapsed(), im == im2);
    }
    lookmatch_imaging::write(Path::new(&args[4]), &im, &[]).unwrap();
}
