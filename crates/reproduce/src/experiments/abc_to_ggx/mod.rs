//! Section 5.3: the published ABC fits of the MERL materials as GGX, channel by channel, beside the measured materials and a direct
//! GGX fit of these.

mod best;
mod direct;
mod judge;
mod matching;
mod tell;

use lookmatch_imaging::Verdict;
use lookmatch_remap::Stage;
use lookmatch_rendering::{Part, Renderer};

use crate::album::{Album, Shown};
use crate::{Comparison, Report, Setting, Watch};

use judge::{Judged, four, judged};
use matching::{Remapped, remapped};

const NAME: &str = "abc-to-ggx";
/// The materials of a quick run: those that are pictured, metals, plastics, paints and cloth.
const QUICK: [&str; 13] = [
    "alum-bronze",
    "blue-acrylic",
    "chrome",
    "gold-metallic-paint",
    "gold-metallic-paint2",
    "gold-metallic-paint3",
    "green-metallic-paint",
    "nickel",
    "purple-paint",
    "red-plastic",
    "specular-black-phenolic",
    "white-fabric",
    "yellow-phenolic",
];
/// The materials of Figure 12.
const PICTURED: [&str; 3] = ["green-metallic-paint", "purple-paint", "yellow-phenolic"];
/// Largest side of the pictures that are shown.
const PICTURE_SIZE: usize = 200;
/// Where the paper's remap fails.
const PAPERS_FAILURES: [&str; 3] = ["gold-metallic-paint", "gold-metallic-paint2", "gold-metallic-paint3"];

/// Whether a remap does not look like its source.
fn is_failed(judged: &Judged) -> bool {
    Verdict::of(judged.remap.jod) == Verdict::NoticeablyDifferent
}

pub(super) fn run(setting: &Setting, watch: &dyn Watch) -> anyhow::Result<Report> {
    let plan = matching::plan(setting)?;
    watch.begin("light of the reference scene", 0);
    let stage = Stage::cached(&plan, &setting.cache, &|_| ())?;
    let all: Vec<&str> = direct::widths().map(|(name, _)| name).collect();
    let names = if setting.is_quick { QUICK.to_vec() } else { all };
    let all = remapped(&plan, &stage, watch, &names)?;
    watch.begin("light of the validation scene", 0);
    let renderer = judge::renderer(setting, setting.size())?;
    let judgements = judged(&renderer, watch, &all)?;
    let gap = best::gap(setting, watch, &plan, &all)?;
    let album = Album::of(setting, NAME)?;
    let renderer = judge::renderer(setting, setting.size().min(PICTURE_SIZE))?;
    let comparisons = comparisons(&album, &renderer, &all, &judgements)?;
    tell::report(setting, &album, (&all, &judgements, &gap), comparisons)
}

/// The materials of Figure 12, and the worst failure.
fn comparisons(
    album: &Album,
    renderer: &Renderer,
    all: &[Remapped],
    judgements: &[Judged],
) -> anyhow::Result<Vec<Comparison>> {
    let place = |name: &&str| all.iter().position(|remapped| remapped.name == **name);
    let worst = (0..all.len()).min_by(|a, b| judgements[*a].remap.jod.total_cmp(&judgements[*b].remap.jod));
    let mut comparisons = Vec::new();
    for (k, place) in PICTURED.iter().filter_map(place).chain(worst).enumerate() {
        let remapped = &all[place];
        let materials = four(remapped)?;
        let images = renderer.render_batch(&materials.each_ref(), Part::Full);
        let titles = ["measured", "ABC fit", "remap", "direct fit"];
        let shown = titles.into_iter().zip(&materials).zip(images);
        let mut shown: Vec<Shown> = shown
            .map(|((title, material), image)| {
                let material =
                    if title == "direct fit" { tell::direct(material) } else { material.to_string() };
                Shown { title, material, image }
            })
            .collect();
        let source = shown.remove(0);
        let title = match k {
            k if k < PICTURED.len() => format!("{} (Figure 12)", remapped.name),
            _ => format!("{}: the remap that looks least like its source", remapped.name),
        };
        comparisons.push(album.compare(&format!("{k}"), title, &source, &shown, renderer.mask())?);
    }
    Ok(comparisons)
}
