//! The search among another renderer's targets, or of ours beside another's source: candidates are pictures with noise.

use std::collections::HashMap;
use std::sync::Arc;

use lookmatch_materials::Material;
use lookmatch_search::{Axis, Lattice, Objective, ObjectiveError, Outcome, Point, Problem, Search, Survey};
use rayon::prelude::*;

use crate::carry::{Body, SourceLook};
use crate::cross::{Look, Score};
use crate::gallery::{Stopped, stopped};
use crate::settle::Bowl;
use crate::strategy::{Counting, searched};
use crate::{CrossStage, Plan, RemapError};

/// Fitness of a candidate that could not be rendered: worse than any picture can be.
const FAILED: f64 = 1e9;
/// Bowls that are looked into before a search gives up to find the bottom.
const ROUNDS: usize = 4;
/// Levels of the last step of a search among noisy candidates.
const LAST_STEP: u32 = 4;

/// The end of a search.
pub(crate) struct Settled {
    pub(crate) best: Point,
    pub(crate) is_decided: bool,
    /// Samples of the pictures that decided it.
    pub(crate) samples: u32,
}

/// The fitness of target points against one source.
pub(crate) struct CrossMatch<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) stage: &'a CrossStage,
    pub(crate) lattice: &'a Lattice,
    pub(crate) source: SourceLook<'a>,
    /// How far a look is from the source's.
    pub(crate) score: &'a (dyn Fn(&Look) -> Score + Sync),
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
        let looks = self.stage.looks(&self.targets(points)?, false, samples);
        let score = |look: Result<Arc<Look>, String>| match look {
            Ok(look) => (self.score)(&look),
            Err(_) => Score { value: FAILED, error: 0.0 },
        };
        Ok(looks.into_par_iter().map(score).collect())
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
}

impl Counting for CrossMatch<'_> {
    fn compared(&self) -> usize {
        self.scores.len()
    }
}
