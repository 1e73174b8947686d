//! Tables of what `apply` says: at the probe's levels where values are linear between them, on finer grids where they bend.

use crate::ExportError;
use crate::function::Function;
use crate::question::{Answer, Point, Question, grid};

/// Largest error of a table between its points, in the parameter's unit: half of what exports may be off.
const TOLERANCE: f64 = 5e-4;
/// Points after which a table is fine enough.
const MAX_POINTS: usize = 8_000;

/// What is tabulated: one number of each answer.
pub(crate) struct Column<'a, F: Fn(&[Vec<f64>]) -> f64 + Sync> {
    pub(crate) question: &'a Question<'a>,
    pub(crate) name: &'a str,
    /// The inputs of the table.
    pub(crate) inputs: &'a [usize],
    /// Values of all others.
    pub(crate) rest: &'a Point,
    pub(crate) number: F,
}

impl<F: Fn(&[Vec<f64>]) -> f64 + Sync> Column<'_, F> {
    /// At the probe's levels.
    pub(crate) fn at_levels(&self, nearest: bool) -> Result<Function, ExportError> {
        let levels = self.levels();
        let values = filled(&levels, self.values(&levels)?);
        Ok(Function::table(self.name, self.inputs, levels, values, nearest))
    }

    /// As fine as it takes.
    pub(crate) fn refined(&self) -> Result<Function, ExportError> {
        let mut levels = self.levels();
        loop {
            let values = filled(&levels, self.values(&levels)?);
            let points = values.len();
            let table = Function::table(self.name, self.inputs, levels.clone(), values, false);
            let errors = self.errors(&table, &levels)?;
            let worst = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
            // The errors of several axes add up.
            let total: f64 = errors.iter().map(|e| worst(e)).sum();
            if total <= TOLERANCE || points > MAX_POINTS {
                return Ok(table);
            }
            let limit = (0.25 * worst(&errors.concat())).max(0.5 * TOLERANCE / errors.len() as f64);
            for (levels, errors) in levels.iter_mut().zip(&errors) {
                let coarse = levels.windows(2).zip(errors).filter(|(_, error)| **error > limit);
                let middles: Vec<f64> = coarse.map(|(p, _)| 0.5 * (p[0] + p[1])).collect();
                levels.extend(middles);
                levels.sort_by(f64::total_cmp);
            }
        }
    }

    fn levels(&self) -> Vec<Vec<f64>> {
        self.inputs.iter().map(|i| self.question.levels[*i].clone()).collect()
    }

    /// By axis and interval: the error half-way, at the points of the other axes.
    fn errors(&self, table: &Function, levels: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, ExportError> {
        let of_axis = |axis: usize| {
            let mut between = levels.to_vec();
            between[axis] = levels[axis].windows(2).map(|p| 0.5 * (p[0] + p[1])).collect();
            let stride: usize = between[axis + 1..].iter().map(Vec::len).product();
            let mut errors = vec![0.0; between[axis].len()];
            let exact = self.values(&between)?;
            for (place, (point, exact)) in grid(&between).iter().zip(exact).enumerate() {
                let mut inputs = vec![0.0; self.question.inputs.len()];
                self.inputs.iter().zip(point).for_each(|(i, v)| inputs[*i] = *v);
                let interval = place / stride % errors.len();
                // NaN, where the probe has no result, is no error of the table.
                errors[interval] = (table.evaluate(&inputs) - exact).abs().max(errors[interval]);
            }
            Ok(errors)
        };
        (0..levels.len()).map(of_axis).collect()
    }

    /// By point of a grid; NaN where the probe has no result.
    fn values(&self, levels: &[Vec<f64>]) -> Result<Vec<f64>, ExportError> {
        let at = |point: Vec<f64>| {
            let mut values = self.rest.clone();
            self.inputs.iter().zip(point).for_each(|(i, v)| values[*i] = [v; 3]);
            values
        };
        let points: Vec<Point> = grid(levels).into_iter().map(at).collect();
        let number = |answer: &Answer| answer.as_deref().map_or(f64::NAN, &self.number);
        Ok(self.question.ask_all(&points)?.iter().map(number).collect())
    }
}

/// Gives points without a result the value of the nearest that has one, by steps between levels.
fn filled(levels: &[Vec<f64>], values: Vec<f64>) -> Vec<f64> {
    if values.iter().all(|v| v.is_finite()) {
        return values;
    }
    let indices: Vec<Vec<f64>> = levels.iter().map(|l| (0..l.len()).map(|i| i as f64).collect()).collect();
    let places = grid(&indices);
    let steps = |a: usize, b: usize| -> f64 {
        places[a].iter().zip(&places[b]).map(|(x, y): (&f64, &f64)| (x - y).abs()).sum()
    };
    let nearest = |a: usize| {
        let found = (0..values.len()).filter(|b| values[*b].is_finite());
        found.min_by(|b, c| steps(a, *b).total_cmp(&steps(a, *c))).map_or(0.0, |b| values[b])
    };
    (0..values.len()).map(|a| if values[a].is_finite() { values[a] } else { nearest(a) }).collect()
}
