//! A number as a function of source parameters: tables, polynomials and splines.

use lookmatch_remap::Term;

/// A source parameter as a function reads it.
#[derive(Clone, Debug, PartialEq)]
pub struct Argument {
    /// Which input of the mapping. Where that is a colour, the function is evaluated for each channel.
    pub input: usize,
    /// `None` where it is read in its own unit; else it is mapped to −1…1 first.
    pub scale: Option<Scale>,
}

/// How a value is mapped to `u` between −1 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The value at −1.
    pub min: f64,
    /// The value at 1.
    pub max: f64,
    /// True where `u` is linear in the logarithm.
    pub logarithmic: bool,
}

impl Scale {
    /// Factor and summand: `u = factor · v + summand`, of the value or of its logarithm.
    pub fn line(&self) -> [f64; 2] {
        let scaled = |v: f64| if self.logarithmic { v.ln() } else { v };
        let (low, high) = (scaled(self.min), scaled(self.max));
        if high <= low {
            return [0.0, 0.0];
        }
        [2.0 / (high - low), -(high + low) / (high - low)]
    }

    fn normalised(&self, value: f64) -> f64 {
        let value = value.clamp(self.min, self.max);
        let [factor, summand] = self.line();
        factor * if self.logarithmic { value.ln() } else { value } + summand
    }
}

/// The shapes that functions have.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Values on a grid.
    Table {
        /// For each argument its levels, two or more, ascending.
        levels: Vec<Vec<f64>>,
        /// One value for each point, the last argument the fastest.
        values: Vec<f64>,
        /// True for switches, which take the value of the nearest point; else values are interpolated linearly along each
        /// argument.
        nearest: bool,
    },
    /// A sum of products of powers.
    Polynomial {
        /// Its terms.
        terms: Vec<Term>,
    },
    /// A cubic Hermite spline of one argument.
    Spline {
        /// Places, ascending.
        knots: Vec<f64>,
        /// Values at the knots.
        values: Vec<f64>,
        /// Derivatives at the knots.
        slopes: Vec<f64>,
    },
}

/// A number as a function of source parameters. Arguments outside their range are moved to its nearest end.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// The target parameter that it gives, or gives a factor of.
    pub name: String,
    /// What it reads.
    pub arguments: Vec<Argument>,
    /// Its shape in the arguments.
    pub shape: Shape,
    /// True where the shape gives the logarithm.
    pub logarithmic: bool,
    /// Where results are moved to; `None` for tables, whose values are within.
    pub range: Option<[f64; 2]>,
}

impl Function {
    /// A table, without the arguments that it does not depend on.
    pub(crate) fn table(
        name: &str,
        inputs: &[usize],
        levels: Vec<Vec<f64>>,
        values: Vec<f64>,
        nearest: bool,
    ) -> Self {
        let arguments = inputs.iter().map(|input| Argument { input: *input, scale: None }).collect();
        let shape = Shape::Table { levels, values, nearest };
        Self { name: name.into(), arguments, shape, logarithmic: false, range: None }.simplified()
    }

    /// Without the arguments that it does not depend on.
    pub(crate) fn simplified(mut self) -> Self {
        for axis in (0..self.arguments.len()).rev() {
            self.drop_if_constant(axis);
        }
        self
    }

    fn drop_if_constant(&mut self, axis: usize) {
        if let Shape::Polynomial { terms } = &mut self.shape {
            if terms.iter().all(|t| t.powers[axis] == 0) {
                terms.iter_mut().for_each(|t| _ = t.powers.remove(axis));
                self.arguments.remove(axis);
            }
            return;
        }
        let Shape::Table { levels, values, .. } = &mut self.shape else { return };
        let stride: usize = levels[axis + 1..].iter().map(Vec::len).product();
        let count = levels[axis].len();
        let first = |place: usize| place - place / stride % count * stride;
        if (0..values.len()).all(|place| values[place] == values[first(place)]) {
            *values = (0..values.len()).filter(|place| first(*place) == *place).map(|p| values[p]).collect();
            levels.remove(axis);
            self.arguments.remove(axis);
        }
    }

    /// The value everywhere, where that is one.
    pub(crate) fn constant(&self) -> Option<f64> {
        self.arguments.is_empty().then(|| self.at(&[]))
    }

    /// The value for values of all inputs.
    pub(crate) fn evaluate(&self, inputs: &[f64]) -> f64 {
        let place = |a: &Argument| a.scale.map_or(inputs[a.input], |scale| scale.normalised(inputs[a.input]));
        self.at(&self.arguments.iter().map(place).collect::<Vec<f64>>())
    }

    /// The value at places of the arguments, as the shape reads them.
    fn at(&self, places: &[f64]) -> f64 {
        let value = match &self.shape {
            Shape::Table { levels, values, nearest } => interpolated(levels, values, *nearest, places),
            Shape::Polynomial { terms } => terms
                .iter()
                .map(|t| t.powers.iter().zip(places).fold(t.coefficient, |p, (n, x)| p * x.powi(*n as i32)))
                .sum(),
            Shape::Spline { knots, values, slopes } => hermite(knots, values, slopes, places[0]),
        };
        let value = if self.logarithmic { value.exp() } else { value };
        self.range.map_or(value, |[min, max]| value.clamp(min, max))
    }

    /// What it is, in words.
    pub fn describe(&self) -> String {
        match &self.shape {
            Shape::Table { levels, nearest, .. } => {
                let sizes: Vec<String> = levels.iter().map(|l| l.len().to_string()).collect();
                let rule = if *nearest { "the nearest point counts" } else { "linear in between" };
                format!("table of {} points, {rule}", sizes.join(" x "))
            }
            Shape::Polynomial { terms } => format!("polynomial of {} terms", terms.len()),
            Shape::Spline { knots, .. } => format!("cubic spline of {} knots", knots.len()),
        }
    }
}

/// The interval that holds a value, and where in it, 0 to 1.
fn place(levels: &[f64], value: f64) -> (usize, f64) {
    let k = levels.partition_point(|level| *level <= value).clamp(1, levels.len() - 1) - 1;
    (k, ((value - levels[k]) / (levels[k + 1] - levels[k])).clamp(0.0, 1.0))
}

fn interpolated(levels: &[Vec<f64>], values: &[f64], nearest: bool, places: &[f64]) -> f64 {
    let found: Vec<(usize, f64)> = levels.iter().zip(places).map(|(l, v)| place(l, *v)).collect();
    let share = |t: f64| if nearest { f64::from(t > 0.5) } else { t };
    let mut sum = 0.0;
    for corner in 0..1usize << levels.len() {
        let (mut index, mut weight) = (0, 1.0);
        for (k, (low, t)) in found.iter().enumerate() {
            let side = corner >> k & 1;
            weight *= if side == 1 { share(*t) } else { 1.0 - share(*t) };
            index = index * levels[k].len() + low + side;
        }
        sum += weight * values[index];
    }
    sum
}

fn hermite(knots: &[f64], values: &[f64], slopes: &[f64], u: f64) -> f64 {
    let (k, t) = place(knots, u);
    let [a, b, c] = cubic(knots, values, slopes, k);
    values[k] + t * (a + t * (b + t * c))
}

/// Coefficients of `t`, `t²` and `t³` between a knot and the next, `t` from 0 to 1: what is added to the value at the knot.
pub(crate) fn cubic(knots: &[f64], values: &[f64], slopes: &[f64], k: usize) -> [f64; 3] {
    let h = knots[k + 1] - knots[k];
    let (rise, from, to) = (values[k + 1] - values[k], h * slopes[k], h * slopes[k + 1]);
    [from, 3.0 * rise - 2.0 * from - to, from + to - 2.0 * rise]
}
