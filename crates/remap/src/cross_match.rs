//! The search among another renderer's targets, or of ours beside another's source: candidates are pictures with noise.

use std::collections::HashMap;
use std::sync::Arc;

use lookmatch_materials::Material;
use lookmatch_search::{Axis, Lattice, Objective, ObjectiveError, Outcome, Point, Problem, Search, Survey};
use rayon::prelude::*;

use crate::carry::{Body, SourceLook};
use crate::cross::{Look, Score};
use crate::gallery::{Key, Stopped, stopped};
use crate::settle::Bowl;
use crate::strategy::{Counting, searched};
use crate::synthesis::{Rendered, Syntheses, Synthesis, is_linear};
use crate::{CrossStage, Plan, RemapError};

/// Fitness of a candidate that could not be rendered: worse than any picture can be.
const FAILED: f64 = 1e9;
/// Bowls that are looked into before a search gives up to find the bottom.
const ROUNDS: usize = 4;
/// Compared points that tell what noise adds to a distance.
const CALIBRATING: usize = 4;
/// Levels of the last step of a search among noisy candidates.
const LAST_STEP: u32 = 4;

/// The end of a search.
pub(crate) struct Settled {
    pub(crate) best: Point,
    pub(crate) is_decided: bool,
    /// Samples of the pictures that decided it.
    pub(crate) samples: u32,
}

/// What forecasts of a source's matches are made with.
pub(crate) struct Foresight<'a> {
    /// The source.
    pub(crate) seen: &'a Look,
    pub(crate) with_diffuse: bool,
    /// What its targets have in common.
    pub(crate) family: Key,
}

/// The fitness of target points against one source.
pub(crate) struct CrossMatch<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) stage: &'a CrossStage,
    pub(crate) lattice: &'a Lattice,
    pub(crate) source: SourceLook<'a>,
    /// How far a look is from the source's.
    pub(crate) score: &'a (dyn Fn(&Look) -> Score + Sync),
    /// What forecasts need, where the search asks for them.
    pub(crate) foresight: Option<Foresight<'a>>,
    /// What is known of targets.
    pub(crate) syntheses: &'a Syntheses,
    /// Points that were compared so far.
    pub(crate) scores: HashMap<Point, f64>,
    pub(crate) stop: &'a (dyn Fn() -> bool + Sync),
}

impl CrossMatch<'_> {
    fn targets(&self, points: &[Point]) -> Result<Vec<Material>, RemapError> {
        let target = |p: &Point| self.plan.target_with(&self.source, &self.lattice.values(p), self.body());
        points.iter().map(target).collect()
    }

    /// Ours are cheap, and compared with their bodies; those of others are searched without.
    fn body(&self) -> Body {
        if self.plan.to.model().renderer.is_none() { Body::Matched } else { Body::Copied }
    }

    /// Scores of points at a number of samples; those that cannot be rendered score [`FAILED`].
    fn scored(&self, points: &[Point], samples: u32) -> Result<Vec<Score>, RemapError> {
        let targets = self.targets(points)?;
        self.syntheses.count(&targets);
        let looks = self.stage.looks(&targets, false, samples);
        if let Some(foresight) = &self.foresight {
            self.learn(foresight, points, &looks);
        }
        let score = |look: Result<Arc<Look>, String>| match look {
            Ok(look) => (self.score)(&look),
            Err(_) => Score { value: FAILED, error: 0.0 },
        };
        Ok(looks.into_par_iter().map(score).collect())
    }

    /// Hands rendered targets to the synthesis of their family.
    fn learn(&self, foresight: &Foresight, points: &[Point], looks: &[Result<Arc<Look>, String>]) {
        let (stage, with_diffuse) = (self.stage, foresight.with_diffuse);
        let mut families = self.syntheses.families();
        let synthesis = families.entry(foresight.family.clone()).or_insert_with(|| {
            let mut shares = stage.own.picture_shares();
            shares.truncate(if with_diffuse { 4 } else { 2 });
            Synthesis::new(self.plan.to.model(), self.lattice, shares)
        });
        let new = points.iter().zip(looks).filter(|(point, _)| !synthesis.knows(point));
        let new: Vec<(&Point, &Look)> =
            new.filter_map(|(point, look)| Some((point, &**look.as_ref().ok()?))).collect();
        let rendered = |(point, look): &(&Point, &Look)| Rendered {
            point: (*point).clone(),
            pictures: stage.pictures(look, with_diffuse),
            noise: stage.noise(look, with_diffuse),
        };
        let rendered: Vec<Rendered> = new.iter().map(rendered).collect();
        let mix =
            |a: usize, b: usize, share: f64| stage.mixed_pictures(new[a].1, new[b].1, share, with_diffuse);
        synthesis.learn(&rendered, &mix);
    }

    /// The best point, and whether noise leaves no doubt of it.
    pub(crate) fn searched(&mut self, problem: &Problem, most: u32) -> Result<Settled, RemapError> {
        let found = self.by_method(problem)?;
        if found.fitness >= FAILED {
            let reasons = self.stage.counts().into_iter().flat_map(|(_, counts)| counts.reasons);
            return Err(RemapError::Render(
                reasons.last().unwrap_or_else(|| "no target could be rendered".into()),
            ));
        }
        self.settled(found.best, problem, most)
    }

    /// Where the search method of the plan ends.
    fn by_method(&mut self, problem: &Problem) -> Result<Outcome, RemapError> {
        if self.plan.search != "survey" {
            return searched(self.plan, problem, self);
        }
        // Single steps are lost in noise: the bowl will tell.
        let is_noisy = self.stage.archives.iter().any(|archive| archive.studio.has_noise());
        let survey = Survey { last_step: if is_noisy { LAST_STEP } else { 1 }, ..Survey::default() };
        survey.run(problem, self).map_err(RemapError::Search)
    }

    /// Renders candidates around the best with more and more samples, until it is known which is the best or the budget ends;
    /// says which it was.
    fn settled(&mut self, found: Point, problem: &Problem, most: u32) -> Result<Settled, RemapError> {
        let model = self.plan.to.model();
        let is_width = |axis: &Axis| model.parameter(&axis.name).is_ok_and(|p| p.role.is_width());
        let ratios: Vec<bool> = self.lattice.axes.iter().map(is_width).collect();
        let mut samples = self.stage.sampling.samples;
        let mut centre = found;
        let mut round = 0;
        for _ in 0..ROUNDS {
            if (self.stop)() {
                return Err(stopped());
            }
            let bowl = Bowl::around((self.lattice, &ratios), &centre, &problem.bounds, round);
            let points = bowl.candidates(self.scores.keys());
            let scores = self.scored(&points, samples)?;
            if scores.iter().all(|score| score.error == 0.0 || score.value >= FAILED) {
                // Without noise the best that was seen is the best.
                return Ok(Settled { best: centre, is_decided: true, samples });
            }
            let scored: Vec<(Point, Score)> =
                points.into_iter().zip(scores).filter(|(_, score)| score.value < FAILED).collect();
            self.scores.extend(scored.iter().map(|(point, score)| (point.clone(), score.value)));
            // A fitness is a distance; its square is what has the shape of a bowl.
            let squares = |(point, Score { value, .. }): (Point, Score)| (point, value * value.abs());
            let bottom = bowl.bottom(&scored.into_iter().map(squares).collect::<Vec<_>>());
            centre = bottom.point;
            if bottom.is_on_side {
                continue;
            }
            if bottom.is_known || samples >= most {
                return Ok(Settled { best: centre, is_decided: bottom.is_known, samples });
            }
            samples = (4 * samples).min(most);
            round += 1;
        }
        Ok(Settled { best: centre, is_decided: false, samples })
    }
}

impl Objective for CrossMatch<'_> {
    fn evaluate(&mut self, points: &[Point]) -> Result<Vec<f64>, ObjectiveError> {
        let scores = self.scored(points, self.stage.sampling.samples)?;
        if (self.stop)() {
            return Err(Box::new(Stopped));
        }
        self.scores.extend(points.iter().cloned().zip(scores.iter().map(|score| score.value)));
        Ok(scores.into_iter().map(|score| score.value).collect())
    }

    /// Pictures with noise are further apart than what they show: by as much as the best of those that were compared are.
    fn forecast(&mut self, points: &[Point]) -> Option<Vec<f64>> {
        let foresight = self.foresight.as_ref()?;
        let mut families = self.syntheses.families();
        let synthesis = families.get_mut(&foresight.family)?;
        let seen = synthesis.seen(&self.stage.pictures(foresight.seen, foresight.with_diffuse));
        let mut best: Vec<(&Point, f64)> =
            self.scores.iter().filter(|(_, v)| **v < FAILED).map(|(p, v)| (p, *v)).collect();
        best.sort_by(|a, b| a.1.total_cmp(&b.1).then_with(|| a.0.cmp(b.0)));
        best.truncate(CALIBRATING);
        let known: Vec<Point> = best.iter().map(|(point, _)| (*point).clone()).collect();
        let foreseen = synthesis.distances(&seen, &known)?;
        let excess =
            |((_, score), distance): (&(&Point, f64), &f64)| distance * distance - score * score.abs();
        let excess = best.iter().zip(&foreseen).map(excess).sum::<f64>() / best.len().max(1) as f64;
        let distances = synthesis.distances(&seen, points)?;
        Some(distances.into_iter().map(|d| (d * d - excess).abs().sqrt().copysign(d * d - excess)).collect())
    }

    fn is_linear(&self, axis: usize) -> bool {
        is_linear(self.plan.to.model(), &self.lattice.axes[axis])
    }
}

impl Counting for CrossMatch<'_> {
    fn compared(&self) -> usize {
        self.scores.len()
    }
}
