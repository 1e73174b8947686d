//! The best parameters of a model for given pictures of the reference scene, by whatever renderer.
//!
//! The pictures are all that is known: no parameters, and how noisy they are. So noise counts as a difference, and it lifts
//! the fitness of all candidates alike.
//!
//! With diffuse pictures the comparison is equation 3, and the diffuse level tells the albedo of the body. Without them full
//! pictures are compared, and each candidate gets the albedo that suits it best: its picture is `specular + a · unit` in linear
//! radiance, where the unit is its own diffuse reflection, or for models of other renderers that of our Lambert body; the
//! best `a` of each channel is a linear least-squares problem.

use std::collections::HashMap;

use lookmatch_imaging::{Image, NoisyLab, nrmsd, nrmsd_of_noise};
use lookmatch_materials::{Material, Role, Value, hue};
use lookmatch_rendering::Planes;
use lookmatch_search::{Bounds, Lattice, Point, Problem, SearchError};

use crate::carry::SourceLook;
use crate::cross::{ByLight, Look, Score};
use crate::cross_match::{CrossMatch, Settled};
use crate::gallery::Stopped;
use crate::stage::LIGHTS;
use crate::{CrossStage, Plan, RemapError};

/// Pictures of a source, by light: point, environment. Those of a light are there or not; diffuse ones for all lights or none.
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    /// The material as it is.
    pub full: [Option<Image>; 2],
    /// Its diffuse reflection alone.
    pub diffuse: [Option<Image>; 2],
    /// Albedo of its diffuse reflection, where it is known.
    pub albedo: Option<[f64; 3]>,
}

/// The material that looks most like some pictures.
#[derive(Clone, Debug)]
pub struct PictureMatch {
    /// The material.
    pub target: Material,
    /// Values of the searched parameters, in the order of the plan's target axes.
    pub values: Vec<f64>,
    /// Equation 3; where there are no diffuse pictures, the same norm of full pictures.
    pub fitness: f64,
    /// NRMSD per channel of the full pictures, whole image: without and with the mask.
    pub nrmsd: [[f64; 3]; 2],
    /// What the noise of the target's picture alone makes of it, without the mask; 0 for our own models.
    pub noise: [f64; 3],
    /// Full pictures of the target, by light, where the source has one.
    pub pictures: [Option<Image>; 2],
    /// Albedo of the body, where the target has one that is not fixed.
    pub albedo: Option<[f64; 3]>,
    /// Hue of the highlights beside those of the target, where it takes one.
    pub tint: Option<[f64; 3]>,
    /// Different candidates that were compared.
    pub compared: usize,
    /// Searched parameters that ended on the edge of their range.
    pub saturated: Vec<String>,
    /// False where candidates are told apart by noise alone.
    pub is_decided: bool,
}

/// Searches until body and hue stay as they are, at most.
const ROUNDS: usize = 4;
/// Changes of albedo and hue that are none.
const UNCHANGED: f64 = 2e-3;
/// A body that is not known at first.
const GREY: f64 = 0.5;
/// The darkest body that is measured by: a black one would stay black.
const DARKEST: f64 = 0.02;
/// Hues with all channels above this are white: the lights' own colours make as much of a lobe of another shape.
const WHITE: f64 = 0.95;

impl Pictures {
    /// Side of the pictures in pixels; 0 without any.
    pub fn size(&self) -> usize {
        self.full.iter().flatten().next().map_or(0, Image::width)
    }

    /// True where the parts can be told apart.
    pub fn has_diffuse(&self) -> bool {
        self.diffuse.iter().any(Option::is_some)
    }

    /// The light that means are taken under.
    fn main_light(&self) -> usize {
        usize::from(self.full[1].is_some())
    }

    fn check(&self, plan: &Plan) -> Result<(), RemapError> {
        let wrong = |text: &str| Err(RemapError::Option(text.into()));
        if self.full.iter().all(Option::is_none) {
            return wrong("a match needs a full picture under one light at least");
        }
        if self.has_diffuse() && (0..2).any(|l| self.full[l].is_some() != self.diffuse[l].is_some()) {
            return wrong("diffuse pictures are needed for all lights that have a full one, or for none");
        }
        let is_fit = |image: &Image| (image.width(), image.height()) == (plan.size, plan.size);
        if !self.full.iter().chain(&self.diffuse).flatten().all(is_fit) {
            return wrong("pictures must have the plan's size");
        }
        Ok(())
    }
}

/// Finds the target of a plan ([`Plan::from_pictures`]) that looks most like some pictures; `stop` is asked often and ends
/// the work early.
///
/// # Errors
/// Pictures that do not fit each other or the plan; targets that cannot be rendered; [`RemapError::Interrupted`].
pub fn match_pictures(
    plan: &Plan,
    stage: &CrossStage,
    pictures: &Pictures,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<PictureMatch, RemapError> {
    pictures.check(plan)?;
    Matching::new(plan, stage, pictures, stop)?.run().map_err(|error| match error {
        RemapError::Search(SearchError::Objective(e)) if e.is::<Stopped>() => {
            RemapError::Interrupted { done: 0, total: 1 }
        }
        other => other,
    })
}

/// What is believed of the source.
#[derive(Clone, Copy, Debug)]
struct Belief {
    albedo: [f64; 3],
    tint: [f64; 3],
}

impl Belief {
    fn is_near(&self, other: &Self) -> bool {
        let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|c| (a[c] - b[c]).abs() < UNCHANGED);
        near(self.albedo, other.albedo) && near(self.tint, other.tint)
    }
}

/// One match on its way.
struct Matching<'a> {
    plan: &'a Plan,
    stage: &'a CrossStage,
    pictures: &'a Pictures,
    lattice: Lattice,
    /// Full pictures on the subject's pixels.
    full: ByLight<Planes>,
    /// What is beyond the diffuse pictures, where there are some, or nothing else to be seen.
    specular: Option<ByLight<Planes>>,
    /// The source as the metric sees it: its parts, or the whole in place of the specular one.
    seen: Look,
    /// Of equation 3, by part and light; 0 for what is not there.
    weights: [ByLight<f64>; 2],
    has_body: bool,
    /// True where the body's colour is neither fixed nor searched.
    is_body_free: bool,
    takes_tint: bool,
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> Matching<'a> {
    fn new(
        plan: &'a Plan,
        stage: &'a CrossStage,
        pictures: &'a Pictures,
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> Result<Self, RemapError> {
        let planes = |images: &[Option<Image>; 2]| [0, 1].map(|l| on_subject(stage, images[l].as_ref()));
        let full = planes(&pictures.full);
        let has_body = has_body(&plan.to);
        let is_split = pictures.has_diffuse();
        let body = is_split.then(|| planes(&pictures.diffuse));
        let specular = match &body {
            Some(body) => Some([0, 1].map(|l| sum(&full[l], &body[l], [-1.0; 3]))),
            None => (!has_body).then(|| full.clone()),
        };
        let seen = match (body, &specular) {
            (Some(body), Some(specular)) => {
                let level = stage.level(std::slice::from_ref(&body[pictures.main_light()]));
                Look::pictured(stage, specular.clone(), Some((body, level)))
            }
            _ => Look::pictured(stage, full.clone(), None),
        };
        Ok(Self {
            plan,
            stage,
            pictures,
            lattice: Lattice { axes: plan.target_axes.clone() },
            full,
            specular,
            seen,
            weights: weights(stage.own.part_weights(), pictures),
            has_body,
            is_body_free: is_body_free(plan)?,
            takes_tint: takes_tint(plan)?,
            stop,
        })
    }

    fn run(&self) -> Result<PictureMatch, RemapError> {
        let mut belief = Belief { albedo: self.first_albedo()?, tint: [1.0; 3] };
        let mut found: Option<(Point, bool)> = None;
        let mut compared = 0;
        for _ in 0..ROUNDS {
            let round = Round::new(self, belief)?;
            let (best, is_decided, count) = round.searched(found.take().map(|(point, _)| point))?;
            compared += count;
            let next = round.revised(&best)?;
            found = Some((best, is_decided));
            let is_final = next.is_near(&belief);
            belief = next;
            if is_final {
                break;
            }
        }
        let (best, is_decided) = found.unwrap_or_default();
        self.finished(&best, &belief, is_decided, compared)
    }

    /// The albedo that is known, that diffuse pictures show, or a guess.
    fn first_albedo(&self) -> Result<[f64; 3], RemapError> {
        if !self.is_body_free {
            return Ok(self.plan.to.canonical().body);
        }
        if let Some(known) = self.pictures.albedo {
            return Ok(known);
        }
        let Some(wanted) = self.seen.diffuse.as_ref().map(|diffuse| diffuse.level) else {
            return Ok([GREY; 3]);
        };
        // The checkerboard sends back what a bright body sends it: brightness is not quite proportional to the albedo.
        let mut albedo = [GREY; 3];
        for _ in 0..3 {
            let unit = lambert_planes(self.stage, albedo)?;
            let level = self.stage.level(&unit[self.pictures.main_light()]);
            albedo = std::array::from_fn(|c| (albedo[c] * wanted[c] / level[c]).clamp(1e-6, 1.0));
        }
        Ok(albedo.map(short))
    }

    /// True where a candidate's albedo follows from full pictures.
    fn fits_albedo(&self) -> bool {
        self.is_body_free && self.pictures.albedo.is_none() && !self.pictures.has_diffuse()
    }

    fn finished(
        &self,
        best: &Point,
        belief: &Belief,
        is_decided: bool,
        compared: usize,
    ) -> Result<PictureMatch, RemapError> {
        let Self { plan, stage, pictures, .. } = self;
        let values = self.lattice.values(best);
        let body = lambert(belief.albedo)?;
        let source = SourceLook::pictured(&body, belief.tint, !self.has_body);
        let level = stage.look(&body, true, 0)?.level();
        let (target, _) = stage.with_body(plan, &source, &values, (level, stage.sampling.most))?;
        let samples = stage.sampling.most;
        let look = stage.look(&target, true, samples)?;
        let fitness = match pictures.has_diffuse() {
            true => stage.weighted_score(&self.seen, &look, true, self.weights),
            false => self.whole_score(&look, None, [1.0; 3]),
        };
        let (mut shown, mut noises) = ([None, None], [None, None]);
        for light in (0..2).filter(|l| pictures.full[*l].is_some()) {
            let (picture, noise) = stage.picture(&target, LIGHTS[light], samples)?;
            (shown[light], noises[light]) = (Some(picture), noise);
        }
        let main = pictures.main_light();
        let (a, b) = pictures.full[main].as_ref().zip(shown[main].as_ref()).ok_or_else(lost)?;
        let noise = noises[main].as_ref().map_or(Ok([0.0; 3]), |noise| nrmsd_of_noise(a, noise, None))?;
        let mask = stage.own.views()[1].mask();
        Ok(PictureMatch {
            nrmsd: [nrmsd(a, b, None)?, nrmsd(a, b, Some(mask))?],
            fitness: fitness.value.max(0.0),
            noise,
            target,
            values,
            pictures: shown,
            albedo: self.is_body_free.then_some(belief.albedo),
            tint: (self.takes_tint && self.specular.is_some()).then_some(belief.tint),
            compared,
            saturated: crate::strategy::on_edge(&self.lattice, best),
            is_decided,
        })
    }

    /// The distance of full pictures: of a look with its diffuse part, or a unit in its place, so many times as bright.
    fn whole_score(&self, look: &Look, unit: Option<&ByLight<Vec<Planes>>>, gain: [f64; 3]) -> Score {
        let Some(linear) = &look.linear else { return Score { value: f64::MAX, error: 0.0 } };
        let body = unit.or(linear.diffuse.as_ref());
        let whole = |light: usize| {
            let halves = linear.specular[light].iter().enumerate();
            let whole = |(k, specular): (usize, &Planes)| match body {
                Some(body) => sum(specular, &body[light][k.min(body[light].len() - 1)], gain),
                None => specular.clone(),
            };
            NoisyLab::new(&halves.map(whole).collect::<Vec<_>>(), &self.stage.around)
        };
        let whole = Look::compared([whole(0), whole(1)]);
        self.stage.weighted_score(&self.seen, &whole, false, self.weights)
    }
}

/// One search, while the body is believed to be of some colour.
struct Round<'a> {
    matching: &'a Matching<'a>,
    belief: Belief,
    body: Material,
    /// Pictures of our own Lambert body, for targets whose bodies are not rendered.
    unit: Option<ByLight<Vec<Planes>>>,
}

impl<'a> Round<'a> {
    fn new(matching: &'a Matching<'a>, belief: Belief) -> Result<Self, RemapError> {
        let shown = belief.albedo.map(|v| if matching.fits_albedo() { v.max(DARKEST) } else { v });
        let is_foreign = matching.plan.to.model().renderer.is_some();
        let needs_unit = is_foreign && matching.has_body && !matching.pictures.has_diffuse();
        let unit = needs_unit.then(|| lambert_planes(matching.stage, shown)).transpose()?;
        Ok(Self { matching, belief: Belief { albedo: shown, ..belief }, body: lambert(shown)?, unit })
    }

    fn source(&self) -> SourceLook<'_> {
        SourceLook::pictured(&self.body, self.belief.tint, !self.matching.has_body)
    }

    fn score(&self, look: &Look) -> Score {
        let Matching { stage, plan, seen, weights, pictures, .. } = self.matching;
        if pictures.has_diffuse() {
            let with_diffuse = plan.to.model().renderer.is_none();
            return stage.weighted_score(seen, look, with_diffuse, *weights);
        }
        self.matching.whole_score(look, self.unit.as_ref(), self.gain(look))
    }

    /// The best point, whether it is the best beyond noise, and how many were compared.
    fn searched(&self, guess: Option<Point>) -> Result<(Point, bool, usize), RemapError> {
        let Matching { stage, plan, lattice, stop, .. } = self.matching;
        let guesses = guess.into_iter().collect();
        let problem = Problem { lattice, bounds: Bounds::full(lattice), guesses, seed: plan.seed };
        let mut objective = CrossMatch {
            plan,
            stage,
            lattice,
            source: self.source(),
            score: &|look| self.score(look),
            foresight: None,
            scores: HashMap::new(),
            stop,
        };
        let Settled { best, is_decided, .. } = objective.searched(&problem, stage.sampling.most)?;
        Ok((best, is_decided, objective.scores.len()))
    }

    /// How many times as bright as believed the body is beside a candidate's highlights.
    fn gain(&self, look: &Look) -> [f64; 3] {
        let matching = self.matching;
        let linear = look.linear.as_ref().filter(|_| matching.fits_albedo());
        let Some((linear, body)) = linear.and_then(|l| Some((l, self.unit.as_ref().or(l.diffuse.as_ref())?)))
        else {
            return [1.0; 3];
        };
        std::array::from_fn(|c| {
            let (mut along, mut norm) = (0.0, 0.0);
            for light in (0..2).filter(|l| matching.weights[0][*l] > 0.0) {
                let halves = &linear.specular[light];
                for (k, weight) in matching.stage.weights.iter().enumerate() {
                    let specular = halves.iter().map(|half| half[c][k]).sum::<f32>() / halves.len() as f32;
                    let unit = f64::from(body[light][0][c][k]);
                    let weight = matching.weights[0][light] * f64::from(weight * weight);
                    along += weight * unit * f64::from(matching.full[light][c][k] - specular);
                    norm += weight * unit * unit;
                }
            }
            if norm > 0.0 { (along / norm).clamp(0.0, 1.0 / self.belief.albedo[c]) } else { 1.0 }
        })
    }

    /// What the best candidate says of the source.
    fn revised(&self, best: &Point) -> Result<Belief, RemapError> {
        let Matching { stage, plan, lattice, specular, pictures, .. } = self.matching;
        let body = match plan.to.model().renderer {
            None => crate::carry::Body::Matched,
            Some(_) => crate::carry::Body::Copied,
        };
        let target = plan.target_with(&self.source(), &lattice.values(best), body)?;
        let look = stage.look(&target, false, stage.sampling.most)?;
        let gain = self.gain(&look);
        let albedo = std::array::from_fn(|c| short((self.belief.albedo[c] * gain[c]).clamp(0.0, 1.0)));
        let mut tint = self.belief.tint;
        if let (Some(wanted), Some(linear), true) = (specular, &look.linear, self.matching.takes_tint) {
            let light = pictures.main_light();
            let (wanted, found) =
                (stage.level(std::slice::from_ref(&wanted[light])), stage.level(&linear.specular[light]));
            if (0..3).all(|c| wanted[c] > 0.0 && found[c] > 0.0) {
                tint = hue(std::array::from_fn(|c| tint[c] * wanted[c] / found[c])).map(short);
                if tint.iter().all(|v| *v > WHITE) {
                    tint = [1.0; 3];
                }
            }
        }
        Ok(Belief { albedo, tint })
    }
}

/// Five digits after the point: more are noise, and long to read.
fn short(value: f64) -> f64 {
    (value * 1e5).round() / 1e5
}

fn lambert(albedo: [f64; 3]) -> Result<Material, RemapError> {
    let mut material = Material::parse("lambert")?;
    material.set_role(Role::DiffuseReflectance, albedo)?;
    Ok(material)
}

/// Pictures of a Lambert body in our renderer.
fn lambert_planes(stage: &CrossStage, albedo: [f64; 3]) -> Result<ByLight<Vec<Planes>>, RemapError> {
    let look = stage.look(&lambert(albedo)?, true, 0)?;
    look.linear.as_ref().and_then(|linear| linear.diffuse.clone()).ok_or_else(lost)
}

fn lost() -> RemapError {
    RemapError::Option("the stage keeps no pictures: see CrossStage::for_pictures".into())
}

/// True where a body can be seen: not in a metal.
fn has_body(target: &Material) -> bool {
    let is_metal = target.by_role(Role::Metalness).is_some_and(|m| m.mean() == Some(1.0));
    !is_metal && target.model().parameters.iter().any(|parameter| parameter.role.is_body())
}

/// True where the body takes the colour that pictures show.
fn is_body_free(plan: &Plan) -> Result<bool, RemapError> {
    let model = plan.to.model();
    let mut set = plan.held.clone();
    for axis in &plan.target_axes {
        set.extend(
            model.resolve(&axis.name)?.into_iter().map(|index| model.parameters[index].name.to_owned()),
        );
    }
    let is_free = |name: &str| !set.iter().any(|other| other == name);
    Ok(has_body(&plan.to) && model.parameters.iter().any(|p| p.role.is_body() && is_free(p.name)))
}

/// True where a searched colour takes the hue of the highlights.
fn takes_tint(plan: &Plan) -> Result<bool, RemapError> {
    let is_metal = !has_body(&plan.to);
    let model = plan.to.model();
    for axis in &plan.target_axes {
        for index in model.resolve(&axis.name)? {
            let takes = match model.parameters[index].role {
                Role::SpecularReflectance | Role::NormalReflectance | Role::LobeHeight => true,
                role => is_metal && role.is_body(),
            };
            if takes && matches!(plan.to.values()[index], Value::Colour(_)) {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// Weights of equation 3 for the pictures that there are: lights that are missing leave their share to the others, and full
/// pictures have the share of both parts.
fn weights([specular, diffuse]: [ByLight<f64>; 2], pictures: &Pictures) -> [ByLight<f64>; 2] {
    let present = |weights: ByLight<f64>| {
        let kept = [0, 1].map(|l| if pictures.full[l].is_some() { weights[l] } else { 0.0 });
        let scale = weights.iter().sum::<f64>() / kept.iter().sum::<f64>();
        kept.map(|weight| weight * scale)
    };
    match pictures.has_diffuse() {
        true => [present(specular), present(diffuse)],
        false => [present([0, 1].map(|l| specular[l] + diffuse[l])), [0.0; 2]],
    }
}

/// A picture's subject pixels; black without one.
fn on_subject(stage: &CrossStage, image: Option<&Image>) -> Planes {
    let subjects = stage.own.views()[0].subjects();
    let value = |pixel: &u32, c: usize| image.map_or(0.0, |image| image.pixels()[*pixel as usize][c]);
    std::array::from_fn(|c| subjects.iter().map(|pixel| value(pixel, c)).collect())
}

/// `a + gain · b`.
fn sum(a: &Planes, b: &Planes, gain: [f64; 3]) -> Planes {
    std::array::from_fn(|c| a[c].iter().zip(&b[c]).map(|(a, b)| a + gain[c] as f32 * b).collect())
}
