//! `lookmatch render`: a picture of a material.

use std::time::Instant;

use lookmatch_database::Shown;
use lookmatch_imaging::{Image, write};
use lookmatch_materials::{BlackBody, Material};
use lookmatch_rendering::{Part, RENDERERS, RendererEntry};
use serde_json::json;

use crate::Usage;
use crate::args::RenderArgs;
use crate::commands::{check_picture, interruption, lit_scene, material};
use crate::output::{bar, print_json};
use crate::renderers::{Renderers, plain_scene, renderer_of};
use crate::transport::{Preparation, cache};

pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    match renderer_of(&args.material) {
        Some(name) => run_elsewhere(args, name),
        None => run_here(args),
    }
}

fn run_here(args: &RenderArgs) -> anyhow::Result<()> {
    let entry = renderer(args.renderer.as_deref().unwrap_or(RENDERERS[0].name))?;
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

/// A picture by another renderer, the one that the material names.
fn run_elsewhere(args: &RenderArgs, name: String) -> anyhow::Result<()> {
    if let Some(ours) = &args.renderer {
        let wrong = format!("--renderer {ours} is for our own models; {name} renders '{}'", args.material);
        return Err(Usage(wrong).into());
    }
    let seed = u32::try_from(args.seed).ok().filter(|seed| *seed <= i32::MAX as u32);
    let seed =
        seed.ok_or_else(|| Usage(format!("--seed is {}; {name} takes 0 to {}", args.seed, i32::MAX)))?;
    let (scene, illumination) = lit_scene(&args.scene, &args.light)?;
    let scene = plain_scene(scene, &name)?;
    scene.check_picture(illumination, args.size)?;
    check_picture(&args.output)?;
    let started = Instant::now();
    let renderers = Renderers::start(&[name], &args.renderers, &interruption()?)?;
    let material = material(&args.material)?;
    let take = |materials: &[&Material]| {
        let shots: Vec<_> = materials.iter().map(|material| (*material, seed)).collect();
        renderers.pictures((&scene, illumination, args.size), args.samples, &shots)
    };
    let (image, shown) = match args.diffuse_only {
        true => body_alone(&material, take)?,
        false => {
            let shown = take(&[&material])?;
            (shown[0].picture.image.clone(), shown)
        }
    };
    let is_found = shown.iter().all(|shown| shown.is_found);
    let (name, usage) = renderers.usage().swap_remove(0);
    let version = renderers.records(&[]).swap_remove(0).version;
    let notes = [
        ("lookmatch:material".to_owned(), material.to_string()),
        ("lookmatch:renderer".to_owned(), format!("{name} {version}")),
    ];
    write(&args.output, &image, &notes)?;
    let seconds = started.elapsed().as_secs_f64();
    let how = if is_found { ", rendered earlier" } else { "" };
    eprintln!("{} in {seconds:.1} s by {name} {version}{how}", args.output.display());
    if args.json.json {
        let summary = json!({
            "output": args.output, "scene": scene.name, "light": args.light, "size": args.size,
            "part": if args.diffuse_only { "diffuse" } else { "full" }, "material": material,
            "renderer": name, "version": version, "seed": seed, "seconds": seconds, "cpu_s": usage.cpu_s,
            // As many as it took: some round.
            "samples": shown[0].picture.samples, "is_found": is_found,
        });
        return print_json(&summary);
    }
    Ok(())
}

/// What a black body takes away, under the same noise.
fn body_alone(
    material: &Material,
    take: impl FnOnce(&[&Material]) -> anyhow::Result<Vec<Shown>>,
) -> anyhow::Result<(Image, Vec<Shown>)> {
    let BlackBody { coloured, black, share } = material.blackened().ok_or_else(|| {
        Usage(format!("{material} has no diffuse reflection that --diffuse-only could show"))
    })?;
    let shown = take(&[&coloured, &black])?;
    let [coloured, black] = [0, 1].map(|i: usize| &shown[i].picture.image);
    Ok((coloured.zipped(black, |all, lobe| share as f32 * (all - lobe)), shown))
}

fn renderer(name: &str) -> anyhow::Result<&'static RendererEntry> {
    let unknown = || {
        let list: Vec<String> = RENDERERS.iter().map(|r| format!("{} ({})", r.name, r.about)).collect();
        Usage(format!("renderer '{name}' is unknown; use {}", list.join(" or ")))
    };
    Ok(RENDERERS.iter().find(|r| r.name == name).ok_or_else(unknown)?)
}
