//! The remap: {A, B, C, I} of each channel to {S, I, R}, and one index and roughness for all channels.

use lookmatch_materials::{Levels, Material};
use lookmatch_remap::{
    Axis, ChannelMatch, ChannelTable, Endpoint, Event, Options, Plan, Preset, Side, Stage, Strategy, Vary,
};
use rayon::prelude::*;

use crate::{Setting, Watch};

/// The highest index at first.
pub(super) const FIRST_RANGE: f64 = 2.1;
/// The highest index of the extended range: that of the highest source.
const HIGHEST: f64 = 100.0;
/// A scale from which on it is taken for the end of its range.
const FULL: f64 = 0.995;

/// A material of the database and its remap.
pub(super) struct Remapped {
    pub(super) name: String,
    /// The published fit.
    pub(super) source: Material,
    /// The same look as GGX.
    pub(super) target: Material,
    /// Index and roughness for all channels, specular reflectance and fitness of each.
    pub(super) found: ChannelMatch,
    /// Each channel on its own.
    pub(super) alone: [ChannelMatch; 3],
    /// True where the first range of the index does not do: the best match there is at its end, and that of all has a higher index.
    pub(super) is_extended: bool,
}

/// The plan of all of them: a lattice of the index that goes on beyond its first range in equal ratios.
pub(super) fn plan(setting: &Setting) -> anyhow::Result<Plan> {
    let [abc, ggx] = ["low-abc", "ggx"].map(lookmatch_materials::by_name);
    let step = if setting.is_quick { 3.0 } else { 1.0 };
    let vary = |name: &str, min, max, step| Vary {
        side: Some(Side::Target),
        name: name.into(),
        levels: Levels { min, max, step },
    };
    let options = Options {
        seed: setting.seed,
        size: Some(setting.size()),
        strategy: Strategy::Unconstrained,
        preset: Some(Preset::Paper),
        vary: vec![vary("ior", 1.01, FIRST_RANGE, 0.01 * step), vary("roughness", 0.01, 0.70, 0.01 * step)],
        ..Options::default()
    };
    let mut plan = Plan::between(Endpoint::Model(abc?), Endpoint::Model(ggx?), &options)?;
    let index = &mut plan.target_axes[1];
    let mut levels = index.levels.clone();
    let ratio = 1.0 + 0.08 * step;
    while let Some(last) = levels.last().copied().filter(|last| *last < HIGHEST) {
        levels.push(((last * ratio * 1e3).round() / 1e3).min(HIGHEST));
    }
    *index = Axis::listed("ior", levels)?;
    Ok(plan)
}

/// The remap of some materials, all of them compared with the same rendered shapes.
pub(super) fn remapped(
    plan: &Plan,
    stage: &Stage,
    watch: &dyn Watch,
    names: &[&str],
) -> anyhow::Result<Vec<Remapped>> {
    let source = |name: &&str| Material::named(&format!("low-abc@{name}"));
    let sources: Vec<Material> = names.iter().map(source).collect::<Result<_, _>>()?;
    let shapes = plan.target_axes[1].len() * plan.target_axes[2].len();
    watch.begin("shapes of GGX lobes", shapes);
    let mut done = 0;
    let mut observe = |event: Event| {
        if let Event::Compared { done: now, .. } = event {
            watch.advance(now - done);
            done = now;
        }
    };
    let table = ChannelTable::fill(plan, stage, &sources, &mut observe, &|| watch.is_stopped())?;
    watch.begin("matching materials", sources.len());
    let one = |(k, source): (usize, &Material)| -> anyhow::Result<Remapped> {
        anyhow::ensure!(!watch.is_stopped(), "stopped");
        let remapped = matched(plan, &table, k, names[k], source)?;
        watch.advance(1);
        Ok(remapped)
    };
    sources.par_iter().enumerate().map(one).collect()
}

fn matched(
    plan: &Plan,
    table: &ChannelTable,
    place: usize,
    name: &str,
    source: &Material,
) -> anyhow::Result<Remapped> {
    let narrow = |shape: &[f64]| shape[0] <= FIRST_RANGE + 1e-9;
    let (mut alone, mut found) = table.best(place, &narrow)?;
    let end =
        plan.target_axes[1].levels.iter().copied().filter(|level| narrow(&[*level])).fold(0.0, f64::max);
    if alone.iter().chain([&found]).any(|found| is_at_end(found, end)) {
        (alone, found) = table.best(place, &|_| true)?;
    }
    let is_extended = !narrow(&found.shape);
    let target = material(plan, source, &found)?;
    Ok(Remapped { name: name.into(), source: source.clone(), target, found, alone, is_extended })
}

/// Whether a match needs more than its range of the index: all of it, or all that the lobe can reflect.
fn is_at_end(found: &ChannelMatch, end: f64) -> bool {
    found.shape[0] >= end - 1e-9 || found.scale.iter().any(|scale| *scale >= FULL)
}

/// The target of a match: with the source's diffuse reflection.
fn material(plan: &Plan, source: &Material, found: &ChannelMatch) -> anyhow::Result<Material> {
    let values = [1.0, found.shape[0], found.shape[1]];
    let mut target = plan.target_material(source, &values)?;
    let scale: Vec<String> = found.scale.iter().map(|s| format!("{s:.6}")).collect();
    target.set("specular", &scale.join("/"))?;
    Ok(target.checked()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookmatch_rendering::TransportCache;

    /// A small plan, and its materials' remaps.
    fn remaps(sources: &[Material]) -> Vec<Remapped> {
        let folder = std::path::PathBuf::new();
        let mut plan =
            plan(&Setting { is_quick: true, seed: 1, folder, cache: TransportCache::off() }).unwrap();
        plan.size = 64;
        let stage = Stage::prepare(&plan).unwrap();
        plan.target_axes[1]
            .levels
            .retain(|level| *level > FIRST_RANGE || (level * 100.0).round() as i32 % 6 == 1);
        plan.target_axes[1].levels.push(1.5);
        plan.target_axes[1].levels.sort_by(f64::total_cmp);
        plan.target_axes[2].levels = vec![0.01, 0.05, 0.1, 0.15, 0.2];
        let table = ChannelTable::fill(&plan, &stage, sources, &mut |_| (), &|| false).unwrap();
        let one = |(k, source): (usize, &Material)| matched(&plan, &table, k, "", source).unwrap();
        sources.iter().enumerate().map(one).collect()
    }

    #[test]
    fn known_matches_are_found_and_metals_alone_need_an_extended_range() {
        let named = |name| Material::named(name).unwrap();
        // With C = 2 and B = 2/α² the distribution is nearly that of GGX, whose height 1/(πα²) is A/π · 4: S = 1/2, 1/4 and 1/8.
        let like =
            Material::parse("low-abc:diffuse=0.1/0.2/0.3,a=12.5/6.25/3.125,b=200,c=2,ior=1.5").unwrap();
        let found = remaps(&[like, named("low-abc@chrome"), named("low-abc@yellow-phenolic")]);
        let [like, chrome, phenolic] = &found[..] else { panic!("three remaps") };
        assert!((like.found.shape[0] - 1.5).abs() < 0.1 && like.found.shape[1] == 0.1, "{:?}", like.found);
        for (c, scale) in [0.5, 0.25, 0.125].into_iter().enumerate() {
            assert!((like.found.scale[c] / scale - 1.0).abs() < 0.2, "{:?}", like.found);
        }
        let left = |remapped: &Remapped| remapped.found.fitness.iter().sum::<f64>();
        assert!(left(like) < 0.5 * left(phenolic), "{} {}", left(like), left(phenolic));
        assert_eq!(like.target.number("roughness_u").unwrap(), 0.1);
        assert_eq!(like.target.diffuse_albedo(), [0.1, 0.2, 0.3]);
        assert!(chrome.is_extended && !phenolic.is_extended && !like.is_extended);
    }
}
