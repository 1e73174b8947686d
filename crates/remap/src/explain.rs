//! Why a material does not look like another that it is meant to look like: every meaning of its numbers is rendered.

use lookmatch_materials::Material;
use lookmatch_materials::lint::{Given, Reading, readings};
use serde::Serialize;

use crate::{RemapError, Stage};

/// Readings that are good enough to be combined with a second one.
const COMBINED: usize = 24;
/// A simpler explanation is preferred to one whose fitness is so much lower.
const SIMPLER: f64 = 1.5;
/// A reading explains a difference if it leaves less than this share of it.
const EXPLAINS: f64 = 0.5;
/// Explanations that are told.
const TOLD: usize = 5;
/// Differences below this fitness (about what one step of a search makes) need no explanation.
const ALIKE: f64 = 0.02;

/// A material with some numbers read otherwise, and how it then looks.
#[derive(Clone, Debug, Serialize)]
pub struct Tried {
    /// The readings, none for the material as it was given.
    pub readings: Vec<Reading>,
    /// The material as text.
    pub material: String,
    /// Eq. 3 to the reference.
    pub fitness: f64,
    /// NRMSD to the reference under the environment, mean of the channels.
    pub nrmsd: f64,
}

/// What explains a difference best.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// The material as it was given; `None` where the model does not accept it.
    pub given: Option<Tried>,
    /// The best readings, the best first; none where the materials look alike already, or nothing explains the difference.
    pub explanations: Vec<Tried>,
    /// Readings that were rendered.
    pub tried: usize,
    /// True where the material looks like the reference as it is.
    pub is_alike: bool,
}

/// Renders a material as it was given and under every reading of one or two of its numbers, and compares it with the material
/// that it is meant to look like.
///
/// # Errors
/// A material of another renderer; else none on the stages of this crate: pictures of one stage can be compared.
pub fn explain(stage: &Stage, given: &Given, like: &Material) -> Result<Explanation, RemapError> {
    RemapError::check_ours(like)?;
    let trial = Trial { stage, given, like, seen: stage.appearance(like) };
    let unchanged = trial.run(vec![Vec::new()]).pop();
    let single = readings(given);
    let mut tried = trial.run(single.iter().map(|reading| vec![reading.clone()]).collect());
    // A material that is out of range has no picture until all such values are read otherwise: any reading may be part of it.
    let count = if unchanged.is_some() { COMBINED } else { single.len() };
    sort(&mut tried);
    let of_tried = tried.iter().flat_map(|t| &t.readings);
    let others = single.iter().filter(|r| tried.iter().all(|t| t.readings[0] != **r));
    let candidates: Vec<Reading> = of_tried.chain(others).take(count).cloned().collect();
    tried.extend(trial.run(pairs(&candidates)));
    sort(&mut tried);

    let count = tried.len();
    let is_alike = unchanged.as_ref().is_some_and(|t| t.fitness < ALIKE);
    let limit = unchanged.as_ref().map_or(f64::INFINITY, |t| EXPLAINS * t.fitness);
    tried.retain(|t| !is_alike && t.fitness < limit);
    prefer_simple(&mut tried);
    drop_idle(&mut tried);
    tried.truncate(TOLD);
    let mut explanations = Vec::new();
    for candidate in tried {
        explanations.push(trial.measured(candidate)?);
    }
    let given = unchanged.map(|t| trial.measured(t)).transpose()?;
    Ok(Explanation { given, explanations, tried: count, is_alike })
}

fn sort(tried: &mut [Tried]) {
    tried.sort_by(|a, b| a.fitness.total_cmp(&b.fitness));
}

/// Moves the best explanation by one reading to the front where two readings are hardly better.
fn prefer_simple(tried: &mut [Tried]) {
    let Some(best) = tried.first().map(|t| t.fitness) else { return };
    let simple = tried.iter().position(|t| t.readings.len() == 1 && t.fitness <= SIMPLER * best + ALIKE);
    if let Some(place) = simple {
        tried[..=place].rotate_right(1);
    }
}

/// Removes explanations that are a better one with an idle reading added.
fn drop_idle(tried: &mut Vec<Tried>) {
    let mut kept: Vec<Tried> = Vec::new();
    for candidate in tried.drain(..) {
        let adds = |better: &Tried| better.readings.iter().all(|r| candidate.readings.contains(r));
        if !kept.iter().any(adds) {
            kept.push(candidate);
        }
    }
    *tried = kept;
}

/// Every two readings that do not concern the same parameter.
fn pairs(readings: &[Reading]) -> Vec<Vec<Reading>> {
    let concerns =
        |a: &Reading, b: &Reading| a.values.iter().any(|(n, _)| b.values.iter().any(|(m, _)| n == m));
    let mut pairs = Vec::new();
    for (k, a) in readings.iter().enumerate() {
        let others = readings[k + 1..].iter().filter(|b| !concerns(a, b));
        pairs.extend(others.map(|b| vec![a.clone(), b.clone()]));
    }
    pairs
}

/// What every reading is tried on.
struct Trial<'a> {
    stage: &'a Stage,
    given: &'a Given,
    like: &'a Material,
    seen: crate::Appearance,
}

impl Trial<'_> {
    /// Renders and compares; readings that make no material are left out.
    fn run(&self, combinations: Vec<Vec<Reading>>) -> Vec<Tried> {
        let (mut tried, mut materials) = (Vec::new(), Vec::new());
        for readings in combinations {
            let values: Vec<(String, String)> = readings.iter().flat_map(|r| r.values.clone()).collect();
            let text = self.given.text_with(&values);
            if let Ok(material) = Material::parse(&text) {
                materials.push(material);
                tried.push(Tried { readings, material: text, fitness: 0.0, nrmsd: f64::NAN });
            }
        }
        let appearances = self.stage.appearances(&materials);
        for (tried, appearance) in tried.iter_mut().zip(&appearances) {
            tried.fitness = self.stage.fitness(&self.seen, appearance);
        }
        tried
    }

    /// With its NRMSD, which is not what is searched by.
    fn measured(&self, tried: Tried) -> Result<Tried, RemapError> {
        let [whole, _] = self.stage.nrmsd(self.like, &Material::parse(&tried.material)?)?;
        Ok(Tried { nrmsd: whole.iter().sum::<f64>() / 3.0, ..tried })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use lookmatch_rendering::TransportCache;

    use super::*;

    static STAGE: LazyLock<Stage> =
        LazyLock::new(|| Stage::reference(32, &TransportCache::off(), &|_| ()).unwrap());

    fn explained(material: &str, like: &str) -> Explanation {
        let (given, like) = (Given::parse(material).unwrap(), Material::parse(like).unwrap());
        explain(&STAGE, &given, &like).unwrap()
    }

    fn best(explanation: &Explanation) -> &Tried {
        explanation.explanations.first().unwrap()
    }

    #[test]
    fn gloss_is_told_from_roughness() {
        let found = explained("gltf:roughness=0.8,base_color=0.2", "gltf:roughness=0.2,base_color=0.2");
        assert_eq!(best(&found).material, "gltf:roughness=0.2,base_color=0.2");
        assert!(best(&found).readings[0].says.contains("gloss"));
        assert!(
            found.explanations[1..].iter().all(|t| !t.readings.contains(&best(&found).readings[0])),
            "{found:#?}"
        );
        assert!(found.given.as_ref().unwrap().nrmsd > 0.01 && best(&found).nrmsd < 1e-6);
    }

    #[test]
    fn two_mistakes_are_found_together_and_across_models() {
        let found = explained(
            "ward:roughness=0.36,specular=0.04,diffuse=0.7354/0.5371/0.3492",
            "ward:roughness=0.6,specular=0.04,diffuse=0.5/0.25/0.1",
        );
        assert_eq!(best(&found).readings.len(), 2, "{found:#?}");
        assert_eq!(best(&found).material, "ward:roughness=0.6,specular=0.04,diffuse=0.5001/0.25/0.1");
        // α = 0.2 in another model's terms.
        let found =
            explained("principled:roughness=0.2,base_color=0.3", "ggx:roughness=0.2,diffuse=0.3,ior=1.5");
        assert!(best(&found).readings.iter().any(|r| r.says.contains('α')), "{found:#?}");
    }

    #[test]
    fn what_has_no_picture_is_explained_too() {
        let found = explained(
            "ward:roughness=60,diffuse=200/100/50",
            "ward:roughness=0.1796,diffuse=0.5776/0.1274/0.0319",
        );
        assert!(found.given.is_none());
        assert_eq!(best(&found).material, "ward:roughness=0.1796,diffuse=0.5776/0.1274/0.0319");
    }

    #[test]
    fn nothing_is_made_up() {
        let same = explained("gltf:roughness=0.3", "gltf:roughness=0.3");
        assert!(same.is_alike && same.explanations.is_empty());
        let other = explained(
            "gltf:roughness=0.3,base_color=0.5/0.2/0.1",
            "gltf:roughness=0.3,base_color=0.1/0.2/0.6",
        );
        let colour_order = best(&other);
        assert_eq!(colour_order.readings[0].says, "blue, green, red");
    }
}
