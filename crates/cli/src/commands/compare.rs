//! `lookmatch compare`: two materials side by side, or two pictures, with their difference in numbers.

use std::path::Path;
use std::sync::Arc;

use lookmatch_imaging::{
    FLIP_PIXELS_PER_DEGREE, Image, Mask, error_map, flip_map, nrmsd, nrmsd_of_noise, write,
};
use lookmatch_materials::Material;
use lookmatch_rendering::{Illumination, Part, Renderer, Scene};
use serde_json::json;

use crate::Usage;
use crate::args::CompareArgs;
use crate::commands::{compare_pictures, create_folder, interruption, lit_scene, material};
use crate::judgement::Judgement;
use crate::output::{print, print_json, score, spinner, table};
use crate::renderers::{Renderers, plain_scene, renderer_of};
use crate::transport::{Preparation, cache};

pub(crate) fn run(args: &CompareArgs) -> anyhow::Result<()> {
    match (&args.pictures[..], &args.source, &args.target, &args.output) {
        ([source, target], ..) => compare_pictures::run(args, [source, target]),
        (_, Some(source), Some(target), Some(output)) => materials(args, [source, target], output),
        _ => Err(Usage("compare needs two pictures, or --source, --target and --output".into()).into()),
    }
}

fn materials(args: &CompareArgs, texts: [&String; 2], output: &Path) -> anyhow::Result<()> {
    if let Some(mask) = &args.mask {
        let wrong = format!("--mask {mask} is for two pictures; scenes have masks of their own");
        return Err(Usage(wrong).into());
    }
    let (mut scene, illumination) = lit_scene(&args.scene, &args.light)?;
    let named: Vec<String> = texts.into_iter().filter_map(|text| renderer_of(text)).collect();
    if let Some(name) = named.first() {
        scene = plain_scene(scene, name)?;
    }
    // Mistakes in what can be read at once come before renderers are started.
    texts
        .into_iter()
        .filter(|text| renderer_of(text).is_none())
        .try_for_each(|text| material(text).map(drop))?;
    scene.check_picture(illumination, args.size)?;
    // Only other renderers are to end in order; our own work ends at once.
    let stopped = if named.is_empty() { Arc::default() } else { interruption()? };
    let renderers = Renderers::start(&named, &args.renderers, &stopped)?;
    let (source, target) = (material(texts[0])?, material(texts[1])?);
    let scene = scene.for_model(source.model()).for_model(target.model());
    let views = Views { args, scene: &scene, illumination, renderers: &renderers };
    let [a, b] = views.take([&source, &target])?;
    let mask = scene.mask(args.size)?;
    let (whole, masked) = (nrmsd(&a.image, &b.image, None)?, nrmsd(&a.image, &b.image, Some(&mask))?);
    let [noise, noise_masked] = [floor(&a, &b, None)?, floor(&a, &b, Some(&mask))?];
    let judgement = Judgement::of(&a.image, &b.image, Some(&mask))?;
    let (map, scale) = error_map(&a.image, &b.image, None)?;
    create_folder(output)?;
    let file = |name: &str| output.join(name);
    let notes = |material: &dyn ToString| [("lookmatch:material".to_owned(), material.to_string())];
    write(&file("source.exr"), &a.image, &notes(&source))?;
    write(&file("target.exr"), &b.image, &notes(&target))?;
    write(&file("source.png"), &a.image, &notes(&source))?;
    write(&file("target.png"), &b.image, &notes(&target))?;
    write(&file("error.png"), &map, &[])?;
    write(
        &file("flip.png"),
        &flip_map(&a.image, &b.image, FLIP_PIXELS_PER_DEGREE)?.false_colours(1.0)?,
        &[],
    )?;
    write(&file("side-by-side.png"), &Image::beside(&[&a.image, &b.image, &map]), &[])?;
    let result = json!({
        "source": source, "target": target, "scene": scene.name, "light": args.light, "size": args.size,
        "nrmsd": whole, "nrmsd_masked": masked, "error_scale": scale,
        "noise_nrmsd": noise, "noise_nrmsd_masked": noise_masked,
        "renderers": renderers.records(&[source.model(), target.model()]),
        "metrics": judgement.metrics(), "verdict": judgement.verdict(),
        "share_choosing_correctly": judgement.share_choosing_correctly(),
    });
    let text = serde_json::to_string_pretty(&result)?;
    lookmatch_imaging::write_atomically(&file("result.json"), |out| out.write_all(text.as_bytes()))?;
    if args.json.json {
        return print_json(&result);
    }
    let row = |name: &str, v: [f64; 3]| std::iter::once(name.to_owned()).chain(v.map(score)).collect();
    let mut rows = vec![["NRMSD", "red", "green", "blue"].map(str::to_owned).to_vec()];
    for (name, value, noise) in [("whole image", whole, noise), ("masked", masked, noise_masked)] {
        rows.push(row(name, value));
        rows.extend(noise.map(|noise| row(&format!("{name}, noise alone"), noise)));
    }
    print(&format!("{}\n{}", table(&rows), judgement.text()))?;
    eprintln!("pictures in {} (error map: white is {scale:.3})", output.display());
    Ok(())
}

/// A picture, and what noise makes of it: the error of each pixel, about.
struct View {
    image: Image,
    noise: Option<Image>,
}

/// How pictures of both materials are taken.
struct Views<'a> {
    args: &'a CompareArgs,
    scene: &'a Scene,
    illumination: Illumination,
    renderers: &'a Renderers,
}

impl Views<'_> {
    fn take(&self, materials: [&Material; 2]) -> anyhow::Result<[View; 2]> {
        let is_ours = |material: &&Material| material.model().renderer.is_none();
        let own = if materials.iter().any(is_ours) { Some(self.prepared()?) } else { None };
        let view = |material: &Material, seed: u32| match own.as_ref().filter(|_| is_ours(&material)) {
            Some(own) => Ok(self.here(own, material)),
            None => self.elsewhere(material, seed),
        };
        Ok([view(materials[0], 1)?, view(materials[1], 3)?])
    }

    fn prepared(&self) -> anyhow::Result<Renderer> {
        let preparation = Preparation::of("the scene");
        let observe = |progress| preparation.observe(progress);
        let renderer = Renderer::cached(self.scene, self.illumination, self.args.size, &cache(), &observe)?;
        preparation.finish();
        Ok(renderer)
    }

    fn here(&self, own: &Renderer, material: &Material) -> View {
        let progress = spinner("rendering");
        let image = own.render(material, Part::Full);
        progress.finish_and_clear();
        View { image, noise: None }
    }

    /// The mean of two halves with independent noise, of which half their difference is left; or one without noise.
    fn elsewhere(&self, material: &Material, seed: u32) -> anyhow::Result<View> {
        let place = (self.scene, self.illumination, self.args.size);
        if !self.renderers.has_noise(material)? {
            let mut shown = self.renderers.pictures(place, self.args.samples, &[(material, seed)])?;
            return Ok(View { image: shown.swap_remove(0).picture.image, noise: None });
        }
        let halves = [(material, seed), (material, seed + 1)];
        let mut halves = self.renderers.pictures(place, self.args.samples.div_ceil(2), &halves)?;
        let [b, a] = [1, 0].map(|half| halves.swap_remove(half).picture.image);
        let noise = a.zipped(&b, |a, b| (a - b) / 2.0);
        Ok(View { image: a.zipped(&b, |a, b| (a + b) / 2.0), noise: Some(noise) })
    }
}

/// NRMSD that noise alone would make between two pictures of equal materials; `None` where there is no noise.
fn floor(source: &View, target: &View, mask: Option<&Mask>) -> anyhow::Result<Option<[f64; 3]>> {
    let noises: Vec<&Image> = [&source.noise, &target.noise].into_iter().flatten().collect();
    let mut squares = [0.0; 3];
    for noise in &noises {
        let share = nrmsd_of_noise(&source.image, noise, mask)?;
        (0..3).for_each(|c| squares[c] += share[c] * share[c]);
    }
    Ok((!noises.is_empty()).then(|| squares.map(f64::sqrt)))
}
