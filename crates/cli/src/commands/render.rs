//! `lookmatch render`: a picture of a material.

use std::time::Instant;

use lookmatch_imaging::write;
use lookmatch_rendering::{Part, RENDERERS, RendererEntry};
use serde_json::json;

use crate::Usage;
use crate::args::RenderArgs;
use crate::commands::{check_picture, lit_scene, material};
use crate::output::{bar, print_json};
use crate::transport::{Preparation, cache};

pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let entry = renderer(&args.renderer)?;
    let material = material(&args.material)?;
    let (scene, illumination) = lit_scene(&args.scene, &args.light)?;
    check_picture(&args.output)?;
    let started = Instant::now();
    let scene = scene.for_model(material.model());
    let preparation = Preparation::of("the scene");
    let observe = |progress| preparation.observe(progress);
    let renderer =
        (entry.prepare)(&scene, illumination, args.size, args.samples, args.seed, &cache(), &observe)?;
    let transport = preparation.finish();
    let progress = bar(args.size * args.size, "rendering");
    let part = if args.diffuse_only { Part::DiffuseOnly } else { Part::Full };
    let image = renderer.render_observed(&material, part, &|done| progress.set_position(done as u64));
    progress.finish_and_clear();
    let notes = [("lookmatch:material".to_owned(), material.to_string())];
    write(&args.output, &image, &notes)?;
    let seconds = started.elapsed().as_secs_f64();
    eprintln!("{} in {seconds:.1} s", args.output.display());
    if args.json.json {
        let summary = json!({
            "output": args.output, "scene": scene.name, "light": args.light, "size": args.size,
            "part": if args.diffuse_only { "diffuse" } else { "full" }, "material": material,
            "renderer": entry.name, "samples": entry.is_sampled.then_some(args.samples),
            "seed": entry.is_sampled.then_some(args.seed), "seconds": seconds,
            "transport": (!entry.is_sampled).then_some(transport),
        });
        return print_json(&summary);
    }
    Ok(())
}

fn renderer(name: &str) -> anyhow::Result<&'static RendererEntry> {
    let unknown = || {
        let list: Vec<String> = RENDERERS.iter().map(|r| format!("{} ({})", r.name, r.about)).collect();
        Usage(format!("renderer '{name}' is unknown; use {}", list.join(" or ")))
    };
    Ok(RENDERERS.iter().find(|r| r.name == name).ok_or_else(unknown)?)
}
