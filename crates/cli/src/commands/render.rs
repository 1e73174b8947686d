//! `lookmatch render`: a picture of a material.

use std::time::Instant;

use lookmatch_imaging::write;
use lookmatch_rendering::{Part, Renderer};
use serde_json::json;

use crate::args::RenderArgs;
use crate::commands::{check_picture, lit_scene, material};
use crate::output::{print_json, spinner};

pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let material = material(&args.material)?;
    let (scene, illumination) = lit_scene(&args.scene, &args.light)?;
    check_picture(&args.output)?;
    let started = Instant::now();
    let progress = spinner("rendering");
    let renderer = Renderer::prepare(&scene.for_model(material.model()), illumination, args.size)?;
    let part = if args.diffuse_only { Part::DiffuseOnly } else { Part::Full };
    let image = renderer.render(&material, part);
    progress.finish_and_clear();
    let notes = [("lookmatch:material".to_owned(), material.to_string())];
    write(&args.output, &image, &notes)?;
    let seconds = started.elapsed().as_secs_f64();
    eprintln!("{} in {seconds:.1} s", args.output.display());
    if args.json.json {
        let summary = json!({
            "output": args.output, "scene": scene.name, "light": args.light, "size": args.size,
            "part": if args.diffuse_only { "diffuse" } else { "full" }, "material": material, "seconds": seconds,
        });
        return print_json(&summary);
    }
    Ok(())
}
