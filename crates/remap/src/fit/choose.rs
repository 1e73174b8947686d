//! Which function of which source parameters: by what each foretells of entries that it has not seen.

use rayon::prelude::*;

use super::data::Data;
use super::form::{Function, Shape};
use super::regression::{Samples, Window, loess, make_monotone, pchip_slopes, polynomial, powers};
use super::{Alternative, Candidate, FitForm, ParameterFit, Residual};

/// A form is adequate if what it foretells of left-out entries is off by no more lattice steps than this, root mean square;
const BOUND: f64 = 2.0;
/// or, where the table itself foretells them no better, by no more than this share of the values found.
const SHARE: f64 = 0.02;
/// A parameter does not depend on what improves the prediction by less than this factor, nor on what improves it by less than
/// twice where it is right to so many lattice steps without.
const BETTER: f64 = 1.1;
const INDEPENDENT: f64 = 1.0;
/// Root mean square that rounding to the lattice leaves, in lattice steps: 1/√12.
const ROUNDING: f64 = 0.29;
/// Of two closed forms the simpler one is taken unless the other is better by these lattice steps: less than the rounding to the
/// lattice leaves.
const SIMPLER: f64 = 0.1;
/// Highest total degree of a polynomial, and most of its terms.
const DEGREE: u32 = 6;
const TERMS: usize = 28;
/// Most knots of a spline.
const KNOTS: usize = 12;
/// Shares of the entries that a local regression looks at.
const SPANS: [f64; 8] = [0.05, 0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0];
/// Entries left out at once: one each up to this number of them, in as many groups above.
const FOLDS: usize = 10;
const SINGLY: usize = 60;
/// Left-out entries at most, spread over all: a local regression costs as much as there are entries, for each.
const MOST: usize = 400;
/// Fewer entries between others than this cannot tell a smooth relation from another.
const LEAST: usize = 3;
/// Nodes of a tabulated local regression along each of one or two inputs, at least.
const NODES: usize = 33;
/// Places along each input where a polynomial must be monotone.
const CHECKED: usize = 25;

/// A way to make a function of samples.
#[derive(Clone, Copy, PartialEq)]
enum Recipe {
    Polynomial(u32),
    Spline(usize, Window),
    Local(Window),
}

/// A recipe with what cross-validation says of it: the root mean square, in fitted units.
#[derive(Clone, Copy)]
struct Scored {
    recipe: Recipe,
    score: f64,
    size: usize,
}

/// Some of the source parameters.
struct Subset<'a> {
    data: &'a Data,
    axes: Vec<usize>,
    samples: Samples,
    /// Entries to leave out, in groups.
    folds: &'a [Vec<usize>],
}

/// Fits one target parameter.
pub(crate) fn fit(data: &Data) -> ParameterFit {
    let mut fit = ParameterFit {
        name: data.name.clone(),
        depends_on: Vec::new(),
        form: FitForm::Table,
        why: String::new(),
        lattice_step: data.step,
        closed: None,
        local: None,
        table: None,
        alternatives: Vec::new(),
        light: data.light.clone(),
        outside: data.outside.clone(),
    };
    let y = &data.samples.y;
    if y.is_empty() {
        fit.why = "no entry tells it".into();
        return fit;
    }
    if y.iter().all(|v| v == &y[0]) {
        let subset = Subset::new(data, &[], &[]);
        fit.closed = subset.candidate(&Scored { recipe: Recipe::Polynomial(0), score: 0.0, size: 1 });
        fit.form = FitForm::Closed;
        fit.why = "the same at all source points".into();
        return fit;
    }
    let folds = folds(data);
    if data.target_levels <= 2 {
        fit.why = "a switch: the nearest entry decides".into();
    } else if folds.iter().map(Vec::len).sum::<usize>() < LEAST {
        fit.why =
            format!("fewer than {LEAST} entries have others on all sides, too few to tell a smooth relation");
    } else {
        choose(data, &folds, &mut fit);
    }
    fit
}

fn choose(data: &Data, folds: &[Vec<usize>], fit: &mut ParameterFit) {
    let scored: Vec<(Subset, Vec<Scored>)> = subsets(data.inputs.len())
        .iter()
        .map(|axes| {
            let subset = Subset::new(data, axes, folds);
            let scored = subset.score_all();
            (subset, scored)
        })
        .collect();
    let least = |scored: &[Scored]| scored.iter().map(|s| s.score).fold(f64::INFINITY, f64::min);
    let best = scored.iter().map(|(_, scored)| least(scored)).fold(f64::INFINITY, f64::min);
    let step = data.step;
    let enough = (BETTER * best).max((2.0 * best).clamp(ROUNDING * step, INDEPENDENT * step));
    fit.alternatives = scored.iter().map(|(s, scored)| s.alternative(least(scored))).collect();
    let simplest = scored.iter().filter(|(_, scored)| least(scored) <= enough);
    let size = |(subset, _): &&(Subset, Vec<Scored>)| subset.axes.len();
    let order = |a: &&(Subset, Vec<Scored>), b: &&(Subset, Vec<Scored>)| {
        size(a).cmp(&size(b)).then(least(&a.1).total_cmp(&least(&b.1)))
    };
    let Some((subset, scored)) = simplest.min_by(order) else { return };
    fit.depends_on = subset.names();
    let (local, closed): (Vec<Scored>, Vec<Scored>) =
        scored.iter().partition(|s| matches!(s.recipe, Recipe::Local(_)));
    let lowest = |of: &[Scored]| of.iter().copied().min_by(|a, b| a.score.total_cmp(&b.score));
    fit.local = lowest(&local).and_then(|s| subset.candidate(&s));
    // The simplest of the good ones that can be made, else the next.
    let good = SIMPLER * data.step + least(&closed);
    // Nor is anything good that a monotone one cannot come near.
    let fair = (2.0 * least(&closed)).max(BOUND * data.step);
    let mut closed: Vec<Scored> = closed.into_iter().filter(|s| s.score <= fair).collect();
    closed.sort_by(|a, b| (a.score > good).cmp(&(b.score > good)).then(a.size.cmp(&b.size)));
    fit.closed = closed.iter().find_map(|s| subset.candidate(s));
    let table = table_score(data, folds);
    fit.table = Some(table);
    decide(data, fit);
}

/// Takes the closed form if it is adequate, else the local regression, else the table.
fn decide(data: &Data, fit: &mut ParameterFit) {
    let (least, most) =
        data.samples.y.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(*y), b.max(*y)));
    let is_adequate = |candidate: &&Candidate| {
        let score = candidate.residual.steps * data.step;
        let is_as_good = fit.table.is_some_and(|table| score <= table * data.step);
        score <= BOUND * data.step || is_as_good && score <= SHARE * (most - least)
    };
    let best = [&fit.closed, &fit.local]
        .into_iter()
        .flatten()
        .map(|c| c.residual.steps)
        .fold(f64::INFINITY, f64::min);
    let told = |c: &Candidate| format!("foretells left-out entries to {:.2} lattice steps", c.residual.steps);
    (fit.form, fit.why) = match (
        fit.closed.as_ref().filter(is_adequate),
        fit.local.as_ref().filter(is_adequate),
    ) {
        (Some(closed), _) => (FitForm::Closed, told(closed)),
        (None, Some(local)) => (FitForm::Local, format!("{}; no closed form is as good", told(local))),
        (None, None) => (
            FitForm::Table,
            format!(
                "no smooth relation: the best form foretells left-out entries to {best:.1} lattice steps, more than {BOUND}; the table to {:.1}",
                fit.table.unwrap_or(f64::NAN)
            ),
        ),
    };
}

/// All subsets of some axes, without the last two kinds where there are many: none, single ones, pairs, and all.
fn subsets(axes: usize) -> Vec<Vec<usize>> {
    let all =
        (0..1usize << axes.min(16)).map(|bits| (0..axes).filter(|k| bits >> k & 1 == 1).collect::<Vec<_>>());
    let mut some: Vec<Vec<usize>> = all.filter(|s| axes <= 4 || s.len() <= 2 || s.len() == axes).collect();
    some.sort_by_key(Vec::len);
    some
}

/// Groups of entries to leave out: those between others along every axis, because no form is asked for more than the table holds.
fn folds(data: &Data) -> Vec<Vec<usize>> {
    let is_between = |u: &Vec<f64>| {
        u.iter().zip(&data.levels).all(|(u, levels)| levels.len() <= 2 || u.abs() < 1.0 - 1e-9)
    };
    if data.levels.iter().all(|levels| levels.len() <= 2) {
        return Vec::new();
    }
    let inner: Vec<usize> = (0..data.samples.len()).filter(|k| is_between(&data.samples.u[*k])).collect();
    let golden = |k: usize| ((k as f64 + 0.5) * 0.618_033_988_749_895).fract();
    let share = MOST as f64 / inner.len().max(1) as f64;
    let inner: Vec<usize> = inner.into_iter().filter(|k| golden(k * 7) < share).collect();
    if inner.len() <= SINGLY {
        return inner.into_iter().map(|k| vec![k]).collect();
    }
    let fold =
        |f: usize| inner.iter().copied().filter(|k| (golden(*k) * FOLDS as f64) as usize == f).collect();
    (0..FOLDS).map(fold).filter(|fold: &Vec<usize>| !fold.is_empty()).collect()
}

impl<'a> Subset<'a> {
    fn new(data: &'a Data, axes: &[usize], folds: &'a [Vec<usize>]) -> Self {
        let mut samples = data.samples.clone();
        samples.u.iter_mut().for_each(|u| *u = axes.iter().map(|k| u[*k]).collect());
        Self { data, axes: axes.to_vec(), samples, folds }
    }

    fn names(&self) -> Vec<String> {
        self.axes.iter().map(|k| self.data.inputs[*k].name.clone()).collect()
    }

    fn alternative(&self, score: f64) -> Alternative {
        Alternative { depends_on: self.names(), steps: score / self.data.step }
    }

    /// Every recipe with its score.
    fn score_all(&self) -> Vec<Scored> {
        let mut all: Vec<Scored> =
            (0..=DEGREE).filter_map(|degree| self.score(Recipe::Polynomial(degree))).collect();
        all.dedup_by_key(|s| s.size);
        if self.axes.is_empty() {
            all.truncate(1);
            return all;
        }
        let windows: Vec<Window> =
            SPANS.iter().flat_map(|span| [1, 2].map(|degree| Window { span: *span, degree })).collect();
        let local: Vec<Scored> =
            windows.par_iter().filter_map(|window| self.score(Recipe::Local(*window))).collect();
        let best = local.iter().min_by(|a, b| a.score.total_cmp(&b.score)).map(|s| s.recipe);
        if let (Some(Recipe::Local(window)), [axis]) = (best, &self.axes[..]) {
            let knots = 3..=self.data.levels[*axis].len().min(KNOTS);
            all.extend(knots.filter_map(|knots| self.score(Recipe::Spline(knots, window))));
        }
        all.extend(local);
        all
    }

    /// What a recipe foretells of the entries that are left out; `None` where there are too few of the others.
    fn score(&self, recipe: Recipe) -> Option<Scored> {
        let (mut sum, mut weights) = (0.0, 0.0);
        for fold in self.folds {
            let rest = self.samples.subset(|k| !fold.contains(&k));
            let shape = match recipe {
                Recipe::Local(_) => None,
                _ => Some(self.shape(recipe, &rest)?),
            };
            for k in fold {
                let u = &self.samples.u[*k];
                let foretold = match (&shape, recipe) {
                    (None, Recipe::Local(window)) => loess(&rest, window, u),
                    (Some(shape), _) => shape.evaluate(u),
                    _ => return None,
                };
                sum += self.samples.w[*k] * (foretold - self.samples.y[*k]).powi(2);
                weights += self.samples.w[*k];
            }
        }
        let size = match recipe {
            Recipe::Polynomial(degree) => self.powers(degree).len(),
            Recipe::Spline(knots, _) => knots,
            Recipe::Local(_) => self.samples.len(),
        };
        Some(Scored { recipe, score: (sum / weights).sqrt(), size })
    }

    fn powers(&self, degree: u32) -> Vec<Vec<u32>> {
        let highest: Vec<u32> = self.axes.iter().map(|k| self.data.levels[*k].len() as u32 - 1).collect();
        powers(self.axes.len(), degree, &highest)
    }

    /// The shape that a recipe makes of samples, before it is made monotone; `None` where they are too few.
    fn shape(&self, recipe: Recipe, samples: &Samples) -> Option<Shape> {
        match recipe {
            Recipe::Polynomial(degree) => {
                let powers = self.powers(degree);
                let is_fed = powers.len() <= TERMS && 2 * powers.len() <= samples.len() + 1;
                is_fed.then(|| polynomial(samples, &powers, degree))
            }
            Recipe::Spline(count, window) => {
                let knots: Vec<f64> = (0..count).map(|k| 2.0 * k as f64 / (count - 1) as f64 - 1.0).collect();
                let mut values: Vec<f64> = knots.iter().map(|u| loess(samples, window, &[*u])).collect();
                self.tame(&mut values, &[count]);
                let slopes = pchip_slopes(&knots, &values);
                Some(Shape::Spline { knots, values, slopes })
            }
            Recipe::Local(window) => {
                let nodes: Vec<Vec<f64>> = self.axes.iter().map(|k| self.nodes(*k)).collect();
                let counts: Vec<usize> = nodes.iter().map(Vec::len).collect();
                let at = |mut place: usize| -> Vec<f64> {
                    let mut at = vec![0.0; nodes.len()];
                    for k in (0..nodes.len()).rev() {
                        at[k] = nodes[k][place % counts[k]];
                        place /= counts[k];
                    }
                    at
                };
                let count: usize = counts.iter().product();
                let value = |place: usize| loess(samples, window, &at(place));
                let mut values: Vec<f64> = (0..count).into_par_iter().map(value).collect();
                self.tame(&mut values, &counts);
                values.iter_mut().for_each(|v| *v = (*v * 1e9).round() / 1e9);
                Some(Shape::Grid { nodes, values })
            }
        }
    }

    /// Makes values on a grid follow the axes as they must.
    fn tame(&self, values: &mut [f64], counts: &[usize]) {
        for (k, axis) in self.axes.iter().enumerate().filter(|(_, axis)| self.data.signs[**axis] != 0.0) {
            make_monotone(values, counts, k, self.data.signs[*axis]);
        }
    }

    /// Levels of an axis, with others between them where there are few axes.
    fn nodes(&self, axis: usize) -> Vec<f64> {
        let levels = &self.data.levels[axis];
        let parts = if self.axes.len() <= 2 && levels.len() > 1 {
            NODES.div_ceil(levels.len() - 1).max(1)
        } else {
            1
        };
        let between = |w: &[f64]| -> Vec<f64> {
            (0..parts).map(|p| w[0] + (w[1] - w[0]) * p as f64 / parts as f64).collect()
        };
        let mut nodes: Vec<f64> = levels.windows(2).flat_map(between).collect();
        nodes.extend(levels.last());
        nodes
    }

    /// The function that a recipe makes of all samples, with what it leaves; `None` where it does not follow the axes as it must.
    fn candidate(&self, scored: &Scored) -> Option<Candidate> {
        let shape = self.shape(scored.recipe, &self.samples)?;
        if !self.is_monotone(&shape) {
            return None;
        }
        let data = self.data;
        let function = Function {
            inputs: self.axes.iter().map(|k| data.inputs[*k].clone()).collect(),
            shape,
            min: data.min,
            max: data.max,
            logarithmic: data.is_logarithmic,
        };
        let (span, degree) = match scored.recipe {
            Recipe::Local(window) => (Some(window.span), Some(window.degree)),
            _ => (None, None),
        };
        let residual = self.residual(&function, scored.score);
        Some(Candidate { function, span, degree, residual })
    }

    fn is_monotone(&self, shape: &Shape) -> bool {
        let Shape::Polynomial { .. } = shape else { return true };
        let n = self.axes.len();
        let level = |k: usize| 2.0 * k as f64 / (CHECKED - 1) as f64 - 1.0;
        let strides: Vec<usize> = (0..n).map(|k| CHECKED.pow((n - 1 - k) as u32)).collect();
        let at = |place: usize| strides.iter().map(|s| level(place / s % CHECKED)).collect::<Vec<f64>>();
        if n > 3 || self.axes.iter().all(|k| self.data.signs[*k] == 0.0) {
            // More inputs are not checked: their polynomials are not taken where something must be monotone.
            return self.axes.iter().all(|k| self.data.signs[*k] == 0.0);
        }
        let values: Vec<f64> = (0..CHECKED.pow(n as u32)).map(|place| shape.evaluate(&at(place))).collect();
        let follows = |k: usize| {
            let (sign, stride) = (self.data.signs[self.axes[k]], strides[k]);
            let last = |place: usize| place / stride % CHECKED == CHECKED - 1;
            (0..values.len())
                .filter(|place| !last(*place))
                .all(|place| sign * (values[place + stride] - values[place]) >= -1e-9)
        };
        (0..n).all(follows)
    }

    /// What a function leaves at the entries, in the parameter's unit.
    fn residual(&self, function: &Function, score: f64) -> Residual {
        let data = self.data;
        let (mut sum, mut weights, mut max) = (0.0, 0.0, 0.0f64);
        for (u, (y, w)) in self.samples.u.iter().zip(self.samples.y.iter().zip(&self.samples.w)) {
            let left = (data.in_units(function.shape.evaluate(u)) - data.in_units(*y)).abs();
            (sum, weights, max) = (sum + w * left * left, weights + w, max.max(left));
        }
        Residual { rms: (sum / weights).sqrt(), max, steps: score / data.step, nrmsd: None }
    }
}

/// What the table foretells of the entries that are left out: the mean of what lies between their neighbours along each axis, in
/// lattice steps.
fn table_score(data: &Data, folds: &[Vec<usize>]) -> f64 {
    let strides: Vec<usize> =
        (0..data.levels.len()).map(|k| data.levels[k + 1..].iter().map(Vec::len).product()).collect();
    let value = |place: usize| data.places.binary_search(&place).ok().map(|k| data.samples.y[k]);
    let foretold = |place: usize| -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0.0);
        for (levels, stride) in data.levels.iter().zip(&strides) {
            let i = place / stride % levels.len();
            if i == 0 || i + 1 >= levels.len() {
                continue;
            }
            if let (Some(low), Some(high)) = (value(place - stride), value(place + stride)) {
                let share = (levels[i] - levels[i - 1]) / (levels[i + 1] - levels[i - 1]);
                sum += low + share * (high - low);
                count += 1.0;
            }
        }
        (count > 0.0).then_some(sum / count)
    };
    let (mut sum, mut weights) = (0.0, 0.0);
    for k in folds.iter().flatten() {
        if let Some(foretold) = foretold(data.places[*k]) {
            sum += data.samples.w[*k] * (foretold - data.samples.y[*k]).powi(2);
            weights += data.samples.w[*k];
        }
    }
    if weights > 0.0 { (sum / weights).sqrt() / data.step } else { f64::MAX }
}
