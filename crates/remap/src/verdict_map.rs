//! Would anybody see it? The verdict at the source points of a probe, as its file keeps it.

use lookmatch_imaging::{JOD_MODEL_VERSION, NO_DIFFERENCE, VIEWING, Verdict, jod};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{Probe, RemapError, Validator, Verdicts};

/// Verdicts over the source points of a probe, under one light: of what the probe gives, and of what people do without it.
///
/// They hold for whole pictures of one scene, one size and one way of looking at them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerdictMap {
    /// Name of the scene.
    pub scene: String,
    /// Its environment map.
    pub environment: String,
    /// Side of the pictures in pixels.
    pub size: usize,
    /// What tells the JOD, with its version.
    pub metric: String,
    /// How it looks at the pictures.
    pub viewing: String,
    /// Places of the entries that were judged, ascending.
    pub entries: Vec<usize>,
    /// The probe first, then the baselines that apply.
    pub methods: Vec<MethodVerdicts>,
}

/// The verdicts on one way to get a target material, at each of [`VerdictMap::entries`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodVerdicts {
    /// `probe`, or the title of a baseline.
    pub method: String,
    /// Quality of the target's picture beside the source's: 10 where nothing can be seen, less by 1 where 75 % choose correctly.
    pub jod: Vec<f64>,
    /// What people say to that.
    pub verdict: Vec<Verdict>,
}

impl MethodVerdicts {
    /// At how many points they say what.
    pub fn counts(&self) -> Verdicts {
        Verdicts::of(&self.jod)
    }

    /// Arithmetic mean of the JOD.
    pub fn mean(&self) -> f64 {
        self.jod.iter().sum::<f64>() / self.jod.len() as f64
    }

    /// The point that is seen most, among the judged ones, and its JOD.
    pub fn worst(&self) -> Option<(usize, f64)> {
        self.jod.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn check(&self, points: usize) -> Result<(), String> {
        let Self { method, jod, verdict } = self;
        if [jod.len(), verdict.len()] != [points; 2] {
            return Err(format!(
                "'{method}' has {} JOD and {} verdicts where {points} entries were judged",
                jod.len(),
                verdict.len()
            ));
        }
        match jod
            .iter()
            .zip(verdict)
            .find(|(jod, verdict)| **jod > NO_DIFFERENCE || Verdict::of(**jod) != **verdict)
        {
            Some((jod, verdict)) => Err(format!(
                "'{method}' has {jod} JOD, at most {NO_DIFFERENCE}, and the verdict '{}', which contradict each other",
                verdict.title()
            )),
            None => Ok(()),
        }
    }
}

impl VerdictMap {
    /// What must hold beyond the types, in the file of a probe.
    pub(crate) fn check(&self, probe: &Probe) -> Result<(), String> {
        let is_found = |place: &usize| probe.entries.get(*place).is_some_and(|entry| entry.failed.is_none());
        if let Some(place) = self.entries.iter().find(|place| !is_found(place)) {
            return Err(format!("it speaks of entry {place}, which is not there or has no result"));
        }
        if self.entries.is_empty() || !self.entries.is_sorted_by(|a, b| a < b) {
            return Err("its 'entries' are not places in ascending order, one or more".into());
        }
        if self.methods.first().is_none_or(|first| first.method != Validator::PROBE) {
            return Err(format!("the first of its 'methods' is not '{}'", Validator::PROBE));
        }
        self.methods.iter().try_for_each(|method| method.check(self.entries.len()))
    }
}

impl Validator<'_> {
    /// The verdict on the probe's targets and on each baseline that applies everywhere, at some of the entries, in ascending order;
    /// `observe` is told of each finished one.
    ///
    /// A pair of 300 × 300 pixels takes 35 ms of one core.
    ///
    /// # Errors
    /// Where a material cannot be made, pictures are too small to be judged, or [`RemapError::Stopped`] where `stop` says so.
    pub fn verdicts(
        &self,
        places: &[usize],
        observe: &(dyn Fn() + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<VerdictMap, RemapError> {
        let row = |place: &usize| {
            let row = if stop() { Err(RemapError::Stopped) } else { self.jods(*place) };
            observe();
            row
        };
        let rows = places.par_iter().map(row).collect::<Result<Vec<_>, RemapError>>()?;
        let methods = Validator::methods().enumerate().filter_map(|(k, method)| {
            let jod: Vec<f64> = rows.iter().map(|row| row[k]).collect::<Option<_>>()?;
            let verdict = jod.iter().map(|jod| Verdict::of(*jod)).collect();
            Some(MethodVerdicts { method: method.into(), jod, verdict })
        });
        Ok(VerdictMap {
            scene: self.scene().name.clone(),
            environment: self.environment(),
            size: self.size(),
            metric: format!("ColorVideoVDP {JOD_MODEL_VERSION}"),
            viewing: VIEWING.into(),
            entries: places.to_vec(),
            methods: methods.collect(),
        })
    }

    /// JOD of the probe's target and of those of the baselines.
    fn jods(&self, place: usize) -> Result<Vec<Option<f64>>, RemapError> {
        let (source, targets) = self.materials(place)?;
        let materials: Vec<_> = std::iter::once(&source).chain(targets.iter().flatten()).collect();
        let mut images = self.render(&materials).into_iter();
        let Some(reference) = images.next() else { return Ok(Vec::new()) };
        targets
            .iter()
            .map(|target| {
                target.as_ref().and_then(|_| images.next()).map(|image| Ok(jod(&reference, &image)?))
            })
            .map(Option::transpose)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use lookmatch_materials::{Levels, by_name};

    use super::*;
    use crate::{Options, Plan, Side, Stage, Vary, remap, validation_points};

    fn probe() -> Probe {
        let vary = |side, name: &str, levels| Vary { side: Some(side), name: name.into(), levels };
        let vary = vec![
            vary(Side::Source, "specular", Levels::new(0.04, 0.08, 0.04)),
            vary(Side::Source, "roughness", Levels::new(0.1, 0.3, 0.1)),
            vary(Side::Target, "ior", Levels::new(1.4, 1.8, 0.1)),
            vary(Side::Target, "roughness", Levels::new(0.1, 0.3, 0.05)),
        ];
        let options = Options { size: Some(16), vary, ..Options::default() };
        let plan = Plan::new(by_name("ward").unwrap(), by_name("ggx").unwrap(), &options).unwrap();
        remap(&plan, &Stage::prepare(&plan).unwrap(), None, &mut |_| {}, &|| false).unwrap()
    }

    /// Four points, judged by hand.
    fn map() -> VerdictMap {
        let jod = [9.9, 9.5, 8.0, 10.0];
        let method = |method: &str| MethodVerdicts {
            method: method.into(),
            jod: jod.into(),
            verdict: jod.map(Verdict::of).into(),
        };
        VerdictMap {
            scene: "spheres".into(),
            environment: "interior".into(),
            size: 32,
            metric: "a metric".into(),
            viewing: "from afar".into(),
            entries: vec![0, 2, 3, 5],
            methods: vec![method("probe"), method("copy")],
        }
    }

    #[test]
    fn a_map_says_what_validation_says_and_survives_the_file() {
        let mut probe = probe();
        let validator = Validator::prepare(&probe, &None, 32).unwrap();
        let points = validation_points(&probe, Some(4));
        let map = validator.verdicts(&points, &|| (), &|| false).unwrap();
        let stopped = validator.verdicts(&points, &|| (), &|| true);
        assert!(matches!(stopped, Err(RemapError::Stopped)), "{stopped:?}");
        let report = validator.validate(&points, 4, &|| ()).unwrap();
        assert_eq!((&map.entries, map.methods.len()), (&points, report.methods.len()));
        for (judged, scores) in map.methods.iter().zip(&report.methods) {
            let jod = scores.metrics.iter().find(|metric| metric.name == "jod").unwrap().whole.unwrap();
            assert_eq!((&judged.method, judged.counts()), (&scores.method, scores.verdicts.unwrap()));
            assert!((judged.mean() - jod.mean).abs() < 1e-12, "{judged:?} {jod:?}");
            assert_eq!(judged.worst().unwrap().1, jod.min);
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.json");
        probe.write(&path).unwrap();
        assert!(!std::fs::read_to_string(&path).unwrap().contains("verdicts"), "as older programs write it");
        assert!(Probe::read(&path).unwrap().verdicts.is_empty());
        probe.verdicts = vec![map];
        probe.write(&path).unwrap();
        assert_eq!(Probe::read(&path).unwrap(), probe);
    }

    #[test]
    fn maps_that_contradict_themselves_or_the_probe_are_refused() {
        let probe = probe();
        let good = map();
        good.check(&probe).unwrap();
        assert_eq!(good.methods[0].worst(), Some((2, 8.0)));
        let refused = |change: &dyn Fn(&mut VerdictMap), word: &str| {
            let mut map = good.clone();
            change(&mut map);
            let message = map.check(&probe).unwrap_err();
            assert!(message.contains(word), "no '{word}' in: {message}");
        };
        refused(&|map| map.entries[3] = 6, "entry 6");
        refused(&|map| map.entries.swap(0, 1), "ascending");
        refused(&|map| map.entries[1] = map.entries[0], "ascending");
        refused(&|map| map.entries.clear(), "ascending");
        refused(&|map| map.methods.clear(), "'probe'");
        refused(&|map| drop(map.methods.remove(0)), "'probe'");
        refused(&|map| map.methods[1].jod.truncate(3), "3 JOD and 4 verdicts");
        refused(&|map| map.methods[0].jod[2] = 11.0, "11 JOD");
        refused(&|map| map.methods[0].jod[2] = 9.5, "contradict");
    }
}
