//! Smooth functions as plain data: what a probe file keeps, and what exports can print.

use serde::{Deserialize, Serialize};

/// One source parameter as a function reads it: mapped to `u` between −1 and 1, by its logarithm where that is its scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Name of the source axis.
    pub name: String,
    /// The value at `u` = −1, in the parameter's unit.
    pub min: f64,
    /// The value at `u` = 1.
    pub max: f64,
    /// True where `u` is linear in the logarithm of the value.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub logarithmic: bool,
}

impl Input {
    /// `u` of a value; values outside the range are moved to its nearest end.
    pub fn normalised(&self, value: f64) -> f64 {
        let scaled = |v: f64| if self.logarithmic { v.ln() } else { v };
        let value = value.clamp(self.min, self.max);
        if self.max <= self.min {
            return 0.0;
        }
        let share = (scaled(value) - scaled(self.min)) / (scaled(self.max) - scaled(self.min));
        2.0 * share - 1.0
    }
}

/// One term of a polynomial: `coefficient · Π uᵢ^powersᵢ`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// One power for each input.
    pub powers: Vec<u32>,
    /// Its factor.
    pub coefficient: f64,
}

/// The shapes that a function can have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Shape {
    /// A sum of terms up to a total degree; a constant has none but the first.
    Polynomial {
        /// Highest sum of powers.
        degree: u32,
        /// The terms.
        terms: Vec<Term>,
    },
    /// A cubic Hermite spline of one input.
    Spline {
        /// Places in `u`, ascending from −1 to 1.
        knots: Vec<f64>,
        /// Values at the knots.
        values: Vec<f64>,
        /// Derivatives by `u` at the knots.
        slopes: Vec<f64>,
    },
    /// Values of a local regression on a grid, between which it is interpolated linearly along each input.
    Grid {
        /// For each input the places in `u`, ascending from −1 to 1.
        nodes: Vec<Vec<f64>>,
        /// One value for each node, the last input the fastest.
        values: Vec<f64>,
    },
}

/// A target parameter as a smooth function of source parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Function {
    /// The source parameters that it reads; none for a constant.
    pub inputs: Vec<Input>,
    /// Its shape in the inputs' `u`.
    #[serde(flatten)]
    pub shape: Shape,
    /// Results are moved into the range that was searched: its lower end,
    pub min: f64,
    /// and its upper end.
    pub max: f64,
    /// True where the shape gives the logarithm of the result.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub logarithmic: bool,
}

impl Function {
    /// The target parameter, for values of the inputs in their order and in their own units.
    pub fn evaluate(&self, values: &[f64]) -> f64 {
        let u: Vec<f64> = self.inputs.iter().zip(values).map(|(input, v)| input.normalised(*v)).collect();
        let result = self.shape.evaluate(&u);
        (if self.logarithmic { result.exp() } else { result }).clamp(self.min, self.max)
    }

    /// Numbers that were fitted.
    pub fn coefficients(&self) -> usize {
        match &self.shape {
            Shape::Polynomial { terms, .. } => terms.len(),
            Shape::Spline { knots, .. } => knots.len(),
            Shape::Grid { values, .. } => values.len(),
        }
    }

    /// What it is, in words.
    pub fn describe(&self) -> String {
        match &self.shape {
            Shape::Polynomial { degree: 0, .. } => "constant".into(),
            Shape::Polynomial { degree, terms } => {
                format!("polynomial of degree {degree} ({} terms)", terms.len())
            }
            Shape::Spline { knots, .. } => format!("cubic spline with {} knots", knots.len()),
            Shape::Grid { .. } => "local regression".into(),
        }
    }

    /// What must hold beyond the types.
    pub(crate) fn check(&self) -> Result<(), String> {
        let n = self.inputs.len();
        let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
        let ascending = |v: &[f64]| !v.is_empty() && finite(v) && v.windows(2).all(|w| w[0] < w[1]);
        let range =
            |min: f64, max: f64, is_log: bool| min <= max && (!is_log || min > 0.0) && max.is_finite();
        let is_shaped = match &self.shape {
            Shape::Polynomial { terms, .. } => {
                terms.iter().all(|t| t.powers.len() == n && t.coefficient.is_finite())
            }
            Shape::Spline { knots, values, slopes } => {
                let same = knots.len() == values.len() && knots.len() == slopes.len();
                n == 1 && same && knots.len() > 1 && ascending(knots) && finite(values) && finite(slopes)
            }
            Shape::Grid { nodes, values } => {
                let count: usize = nodes.iter().map(Vec::len).product();
                nodes.len() == n
                    && count == values.len()
                    && nodes.iter().all(|v| ascending(v))
                    && finite(values)
            }
        };
        let is_ranged = self.inputs.iter().all(|i| range(i.min, i.max, i.logarithmic))
            && range(self.min, self.max, false);
        if is_shaped && is_ranged { Ok(()) } else { Err("a function's numbers do not fit its shape".into()) }
    }
}

impl Shape {
    /// The value at a place in `u`.
    pub(crate) fn evaluate(&self, u: &[f64]) -> f64 {
        match self {
            Self::Polynomial { terms, .. } => {
                terms.iter().map(|t| t.coefficient * monomial(&t.powers, u)).sum()
            }
            Self::Spline { knots, values, slopes } => hermite(knots, values, slopes, u[0]),
            Self::Grid { nodes, values } => multilinear(nodes, values, u),
        }
    }
}

pub(crate) fn monomial(powers: &[u32], u: &[f64]) -> f64 {
    powers.iter().zip(u).map(|(power, u)| u.powi(*power as i32)).product()
}

/// The interval of ascending places that holds `u`, and where in it, 0 to 1.
fn place(places: &[f64], u: f64) -> (usize, f64) {
    if places.len() < 2 {
        return (0, 0.0);
    }
    let k = places.partition_point(|p| *p <= u).clamp(1, places.len() - 1) - 1;
    (k, ((u - places[k]) / (places[k + 1] - places[k])).clamp(0.0, 1.0))
}

fn hermite(knots: &[f64], values: &[f64], slopes: &[f64], u: f64) -> f64 {
    let (k, t) = place(knots, u);
    let h = knots[k + 1] - knots[k];
    let s = 1.0 - t;
    s * s * (1.0 + 2.0 * t) * values[k]
        + t * t * (1.0 + 2.0 * s) * values[k + 1]
        + h * t * s * (s * slopes[k] - t * slopes[k + 1])
}

fn multilinear(nodes: &[Vec<f64>], values: &[f64], u: &[f64]) -> f64 {
    let places: Vec<(usize, f64)> = nodes.iter().zip(u).map(|(nodes, u)| place(nodes, *u)).collect();
    let mut sum = 0.0;
    for corner in 0..1usize << nodes.len() {
        let (mut index, mut weight) = (0, 1.0);
        for (k, (low, t)) in places.iter().enumerate() {
            let side = corner >> k & 1;
            weight *= if side == 1 { *t } else { 1.0 - t };
            index = index * nodes[k].len() + (low + side).min(nodes[k].len() - 1);
        }
        if weight > 0.0 {
            sum += weight * values[index];
        }
    }
    sum
}
