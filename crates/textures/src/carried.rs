//! Tables of what a target takes over from its source in another form: the colour of a body under an interface, say.
//!
//! Each point of such a table is asked of `apply`. Its grid is made finer where it bends, until the largest error found between its
//! points is below [`TOLERANCE`] of the parameter's range, or the points are too many.
//!
//! The colour of a body is in proportion to the source's up to its limit, where the source is brighter than the target can be. No
//! grid follows that edge. So the proportion is tabulated instead, of a dark source ([`Proportion`]): one input less, and smooth.

use std::collections::HashMap;

use lookmatch_materials::{Material, Value};
use lookmatch_remap::RemapError;
use rayon::prelude::*;

use crate::TextureError;
use crate::bake::{Question, points, range};
use crate::lut::{Between, Lut};

/// Largest error of a table of carried-over values, as a share of the range that they have.
pub const TOLERANCE: f64 = 1e-4;
/// Points that are asked for such a table, after which the error stays as it is, and is told.
const MAX_POINTS: usize = 8_000;
/// Points that are asked before the next word of progress.
const ASKED: usize = 256;
/// Colours of dark sources, the brightest first, and one whose targets must be in proportion to theirs.
const REFERENCES: [f64; 3] = [0.5, 0.25, 0.125];
const TESTED: [f64; 3] = [0.05, 0.3, 0.8];

/// What the values of a table are multiplied by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Factor {
    /// Nothing.
    One,
    /// A channel of the source's colour.
    Fixed(f64),
    /// A coloured input, by index.
    Input(usize),
}

/// One channel of a target parameter.
#[derive(Clone, Debug)]
pub(crate) struct CarriedTable {
    lut: Lut,
    pub(crate) factor: Factor,
    /// What the parameter may be.
    limits: [f64; 2],
    /// Smallest and largest value.
    pub(crate) range: [f64; 2],
    /// Largest error found, as a share of the range.
    pub(crate) error: f64,
}

impl CarriedTable {
    /// A table that is fine enough.
    pub(crate) fn new(known: &mut Known, channel: usize, factor: Factor) -> Result<Self, TextureError> {
        let input = |i: &usize| &known.question.inputs[*i];
        let mut levels: Vec<Vec<f64>> = known.inputs.iter().map(|i| input(i).levels.clone()).collect();
        let factors = match factor {
            Factor::One => [1.0; 2],
            Factor::Fixed(factor) => [factor; 2],
            Factor::Input(i) => input(&i).range,
        };
        let limits = known.question.limits(known.index);
        loop {
            let values = known.grid(&levels, channel)?;
            let [least, most] = range(&values);
            let range = [least * factors[0], most * factors[1]].map(|v| v.clamp(limits[0], limits[1]));
            let lut = Lut::new(&levels, &[(Between::Linear, values)]);
            let lut = lut.map_err(|e| TextureError::Request(e.to_string()))?;
            let mut table = Self { lut, factor, limits, range, error: 0.0 };
            // By axis and interval: the error half-way, at the points of the other axes.
            let mut errors: Vec<Vec<f64>> = Vec::new();
            for axis in 0..levels.len() {
                let mut between = levels.clone();
                between[axis] = levels[axis].windows(2).map(|p| 0.5 * (p[0] + p[1])).collect();
                let exact = known.grid(&between, channel)?;
                let found = table.interval_errors(&between, axis, &exact, factors[1]).into_iter();
                errors.push(found.map(|e| e / (range[1] - range[0]).max(1e-6)).collect());
            }
            let worst = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
            // The errors of several axes add up.
            table.error = errors.iter().map(|e| worst(e)).sum();
            if table.error <= TOLERANCE || known.values.len() > MAX_POINTS {
                return Ok(table);
            }
            let limit = (0.25 * worst(&errors.concat())).max(TOLERANCE / levels.len() as f64);
            for (levels, errors) in levels.iter_mut().zip(&errors) {
                let coarse = levels.windows(2).zip(errors).filter(|(_, error)| **error > limit);
                let middles: Vec<f64> = coarse.map(|(p, _)| 0.5 * (p[0] + p[1])).collect();
                levels.extend(middles);
                levels.sort_by(f64::total_cmp);
            }
        }
    }

    /// The values for some planes of the table's inputs; `factors` where the factor is an input.
    pub(crate) fn evaluate(&self, inputs: &[&[f32]], factors: &[f32], values: &mut [f32]) {
        self.lut.evaluate(inputs, &mut [&mut *values]);
        let [min, max] = self.limits.map(|limit| limit as f32);
        // What the probe has no result for stays NaN.
        match self.factor {
            Factor::One => {}
            Factor::Fixed(factor) => {
                values.iter_mut().for_each(|v| *v = (*v * factor as f32).clamp(min, max));
            }
            Factor::Input(_) => {
                values.iter_mut().zip(factors).for_each(|(v, factor)| *v = (*v * factor).clamp(min, max));
            }
        }
    }

    /// By level of an axis, the largest difference from what is exact on a grid, times a factor as large as it may be.
    fn interval_errors(&self, levels: &[Vec<f64>], axis: usize, exact: &[f64], largest: f64) -> Vec<f64> {
        let points = points(levels);
        let plane = |k: usize| points.iter().map(|p| p[k] as f32).collect();
        let planes: Vec<Vec<f32>> = (0..levels.len()).map(plane).collect();
        let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
        let mut found = vec![0.0; exact.len()];
        self.lut.evaluate(&planes, &mut [&mut found]);
        let mut errors = vec![0.0; levels[axis].len()];
        let stride: usize = levels[axis + 1..].iter().map(Vec::len).product();
        for (point, (found, exact)) in found.iter().zip(exact).enumerate() {
            let interval = point / stride % levels[axis].len();
            // A larger factor would lead beyond the limit, where nothing is seen.
            let factor = if self.factor == Factor::One { 1.0 } else { largest.min(self.limits[1] / exact) };
            // NaN, where the probe has no result, is no error of the table.
            errors[interval] = (factor * (f64::from(*found) - exact).abs()).max(errors[interval]);
        }
        errors
    }
}

/// A source whose body is dark enough for all targets, where a target's colour is in proportion to it.
pub(crate) struct Proportion {
    /// The source with that body.
    pub(crate) base: Material,
    /// Each channel of the body's colour.
    pub(crate) reference: f64,
    /// What the colour of the target's body is multiplied by, for each channel.
    pub(crate) factors: Vec<Factor>,
}

impl Proportion {
    /// Looks whether a target parameter, by index, is in proportion to a colour of the source: that of one of the `inputs`, or of the
    /// body.
    ///
    /// # Errors
    /// What `apply` refuses.
    pub(crate) fn of(
        question: &Question,
        index: usize,
        inputs: &[usize],
        middle: &[f64],
    ) -> Result<Option<Self>, TextureError> {
        let model = question.base.model();
        let (colours, others): (Vec<usize>, Vec<usize>) =
            inputs.iter().partition(|i| question.inputs[**i].is_colour);
        let place = match colours[..] {
            [] => model.parameters.iter().position(|parameter| parameter.role.is_body()),
            [one] => model.resolve(&question.inputs[one].name).map_err(RemapError::from)?.first().copied(),
            _ => None,
        };
        let Some((place, Value::Colour(own))) = place.map(|place| (place, &question.base.values()[place]))
        else {
            return Ok(None);
        };
        let (tested, factors) = match colours[..] {
            [one] => (TESTED, vec![Factor::Input(one)]),
            _ => (*own, own.map(Factor::Fixed).to_vec()),
        };
        let ends: Vec<Vec<f64>> = others
            .iter()
            .map(|i| question.inputs[*i].range)
            .map(|[a, b]| vec![a, 0.5 * (a + b), b])
            .collect();
        if others.is_empty() {
            return Ok(None);
        }
        // The middle of the probe has a result, whatever failed elsewhere.
        let mut points = points(&ends);
        points.push(others.iter().map(|i| middle[*i]).collect());
        let body = |point: &[f64], colour: [f64; 3]| -> Result<Option<Vec<f64>>, TextureError> {
            let mut values = middle.to_vec();
            others.iter().zip(point).for_each(|(input, value)| values[*input] = *value);
            let mut source = question.source(&values)?;
            source.set_value(place, Value::Colour(colour)).map_err(RemapError::from)?;
            Ok(question.target(&source)?.map(|target| target[index].numbers()))
        };
        let limit = question.limits(index)[1];
        let is_one = |point: &Vec<f64>, reference: f64| -> Result<bool, TextureError> {
            let (Some(dark), Some(found)) = (body(point, [reference; 3])?, body(point, tested)?) else {
                return Ok(true);
            };
            let expected = |c: usize| (tested[c] * dark[0] / reference).min(limit);
            let is_same = |c: usize| (found[c] - expected(c)).abs() <= TOLERANCE;
            Ok(dark.len() == 3 && found.len() == 3 && dark.iter().all(|v| *v < limit) && (0..3).all(is_same))
        };
        for reference in REFERENCES {
            let is_proportional =
                points.par_iter().map(|p| is_one(p, reference)).collect::<Result<Vec<_>, _>>()?;
            if is_proportional.into_iter().all(|is_one| is_one) {
                let mut base = question.base.clone();
                base.set_value(place, Value::Colour([reference; 3])).map_err(RemapError::from)?;
                return Ok(Some(Self { base, reference, factors }));
            }
        }
        Ok(None)
    }
}

/// What was asked already about one parameter: each answer may be integrals over the hemisphere.
pub(crate) struct Known<'a> {
    question: &'a Question<'a>,
    index: usize,
    inputs: &'a [usize],
    middle: &'a [f64],
    /// What answers are divided by.
    divisor: f64,
    /// All channels; NaN where the probe has no result.
    values: HashMap<Vec<u64>, [f64; 3]>,
}

impl<'a> Known<'a> {
    /// Nothing is known yet of a parameter, by index, which depends on some of the question's inputs.
    pub(crate) fn new(question: &'a Question, index: usize, inputs: &'a [usize], middle: &'a [f64]) -> Self {
        Self { question, index, inputs, middle, divisor: 1.0, values: HashMap::new() }
    }

    /// With answers divided by a number.
    pub(crate) fn over(self, divisor: f64) -> Self {
        Self { divisor, ..self }
    }

    /// Whether channels differ anywhere.
    pub(crate) fn has_hues(&self) -> bool {
        self.values.values().any(|v| v.iter().any(|channel| (channel - v[0]).abs() > 1e-9))
    }

    /// The parameter on a grid; NaN where the probe has no result.
    fn grid(&mut self, levels: &[Vec<f64>], channel: usize) -> Result<Vec<f64>, TextureError> {
        let points: Vec<Vec<f64>> = points(levels);
        let key = |point: &Vec<f64>| -> Vec<u64> { point.iter().map(|v| v.to_bits()).collect() };
        let missing: Vec<&Vec<f64>> = points.iter().filter(|p| !self.values.contains_key(&key(p))).collect();
        for part in missing.chunks(ASKED) {
            let asked = part.par_iter().map(|point| Ok((key(point), self.ask(point)?)));
            let found: Vec<(Vec<u64>, [f64; 3])> = asked.collect::<Result<_, TextureError>>()?;
            self.values.extend(found);
            self.question.tell(self.index, self.values.len());
        }
        Ok(points.iter().map(|p| self.values[&key(p)][channel]).collect())
    }

    fn ask(&self, point: &[f64]) -> Result<[f64; 3], TextureError> {
        let mut values = self.middle.to_vec();
        self.inputs.iter().zip(point).for_each(|(input, value)| values[*input] = *value);
        let target = self.question.target(&self.question.source(&values)?)?;
        let found = target.map_or_else(Vec::new, |target| target[self.index].numbers());
        let channel = |c: usize| found.get(c).or(found.first()).map_or(f64::NAN, |v| v / self.divisor);
        Ok(std::array::from_fn(channel))
    }
}
