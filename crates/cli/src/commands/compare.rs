//! `lookmatch compare`: two materials side by side, with their difference in numbers.

use lookmatch_imaging::{Image, error_map, nrmsd, write};
use lookmatch_rendering::{Part, Renderer};
use serde_json::json;

use crate::args::CompareArgs;
use crate::commands::{create_folder, lit_scene, material};
use crate::output::{print, print_json, score, spinner, table};
use crate::transport::{Preparation, cache};

pub(crate) fn run(args: &CompareArgs) -> anyhow::Result<()> {
    let (source, target) = (material(&args.source)?, material(&args.target)?);
    let (scene, illumination) = lit_scene(&args.scene, &args.light)?;
    let scene = scene.for_model(source.model()).for_model(target.model());
    let preparation = Preparation::of("the scene");
    let observe = |progress| preparation.observe(progress);
    let renderer = Renderer::cached(&scene, illumination, args.size, &cache(), &observe)?;
    preparation.finish();
    let progress = spinner("rendering");
    let (a, b) = (renderer.render(&source, Part::Full), renderer.render(&target, Part::Full));
    progress.finish_and_clear();
    let (whole, masked) = (nrmsd(&a, &b, None)?, nrmsd(&a, &b, Some(renderer.mask()))?);
    let (map, scale) = error_map(&a, &b, None)?;
    create_folder(&args.output)?;
    let file = |name: &str| args.output.join(name);
    let notes = |material: &dyn ToString| [("lookmatch:material".to_owned(), material.to_string())];
    write(&file("source.exr"), &a, &notes(&source))?;
    write(&file("target.exr"), &b, &notes(&target))?;
    write(&file("source.png"), &a, &notes(&source))?;
    write(&file("target.png"), &b, &notes(&target))?;
    write(&file("error.png"), &map, &[])?;
    write(&file("side-by-side.png"), &Image::beside(&[&a, &b, &map]), &[])?;
    let result = json!({
        "source": source, "target": target, "scene": scene.name, "light": args.light, "size": args.size,
        "nrmsd": whole, "nrmsd_masked": masked, "error_scale": scale,
    });
    let text = serde_json::to_string_pretty(&result)?;
    lookmatch_imaging::write_atomically(&file("result.json"), |out| out.write_all(text.as_bytes()))?;
    if args.json.json {
        return print_json(&result);
    }
    let row = |name: &str, v: [f64; 3]| std::iter::once(name.to_owned()).chain(v.map(score)).collect();
    let header = ["NRMSD", "red", "green", "blue"].map(str::to_owned).to_vec();
    print(&table(&[header, row("whole image", whole), row("masked", masked)]))?;
    eprintln!("pictures in {} (error map: white is {scale:.3})", args.output.display());
    Ok(())
}
