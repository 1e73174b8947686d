//! Tables as nodes: values times weights of linear interpolation, four at a time.

use super::graph::{Arg, Graph};
use super::number;

/// What is counted in fours.
const WIDTH: usize = 4;

fn vector(values: [f64; WIDTH]) -> Arg {
    Arg::value(values.map(number).join(", "))
}

/// Four numbers from a place on, 0 beyond the end.
fn four(values: &[f64], first: usize) -> [f64; WIDTH] {
    std::array::from_fn(|k| values.get(first + k).copied().unwrap_or(0.0))
}

impl Graph {
    /// The node that gives a table's value, the last argument being the fastest.
    pub(super) fn table(
        &mut self,
        name: &str,
        places: &[String],
        levels: &[Vec<f64>],
        values: &[f64],
        nearest: bool,
    ) -> String {
        let weights: Vec<Vec<String>> =
            places.iter().zip(levels).map(|(place, levels)| self.weights(place, levels, nearest)).collect();
        self.contracted(name, &weights, levels, values)
    }

    /// Weights of the levels of an argument in fours, 0 beyond the last.
    fn weights(&mut self, place: &str, levels: &[f64], nearest: bool) -> Vec<String> {
        let place4 =
            self.add("convert", "vector4", &format!("{place}_four"), &[("in", "float", Arg::node(place))]);
        let fours = levels.len().div_ceil(WIDTH);
        let mut weights = Vec::new();
        for group in 0..fours {
            let name = format!("{place}_weights_{group}");
            // Level k counts where the line to it is climbed and that to the next is not.
            let [reached, passed] = [0, 1].map(|next| {
                let first = WIDTH * group + next;
                let name = format!("{name}_{}", ["reached", "passed"][next]);
                if nearest {
                    self.steps(&name, place, levels, first)
                } else {
                    self.lines(&name, &place4, levels, first)
                }
            });
            let inputs = [("in1", "vector4", Arg::node(&reached)), ("in2", "vector4", Arg::node(&passed))];
            weights.push(self.add("subtract", "vector4", &name, &inputs));
        }
        weights
    }

    /// For each of four levels: how much of the way from the level before has been made.
    fn lines(&mut self, name: &str, place4: &str, levels: &[f64], first: usize) -> String {
        let last = levels[levels.len() - 1];
        let span = last - levels[0];
        let ends = |k: usize| match first + k {
            // Before the first level nothing is, behind the last nothing either.
            0 => [levels[0] - span, levels[0]],
            k if k < levels.len() => [levels[k - 1], levels[k]],
            _ => [last, last + span],
        };
        let [low, high] = [0, 1].map(|side| vector(std::array::from_fn(|k| ends(k)[side])));
        let inputs =
            [("in", "vector4", Arg::node(place4)), ("inlow", "vector4", low), ("inhigh", "vector4", high)];
        let line = self.add("remap", "vector4", &format!("{name}_line"), &inputs);
        self.add("clamp", "vector4", name, &[("in", "vector4", Arg::node(&line))])
    }

    /// For each of four levels: 1 where it is nearer than the one before.
    fn steps(&mut self, name: &str, place: &str, levels: &[f64], first: usize) -> String {
        let mut inputs = Vec::new();
        for (k, input) in ["in1", "in2", "in3", "in4"].into_iter().enumerate() {
            let arg = match first + k {
                0 => Arg::value("1".into()),
                level if level < levels.len() => {
                    let middle = 0.5 * (levels[level - 1] + levels[level]);
                    let step = [
                        ("value1", "float", Arg::node(place)),
                        ("value2", "float", Arg::value(number(middle))),
                        ("in1", "float", Arg::value("1".into())),
                        ("in2", "float", Arg::value("0".into())),
                    ];
                    Arg::node(&self.add("ifgreater", "float", &format!("{place}_beyond_{level}"), &step))
                }
                _ => Arg::value("0".into()),
            };
            inputs.push((input, "float", arg));
        }
        self.add("combine4", "vector4", name, &inputs)
    }

    /// The sum over all points of value times weights.
    fn contracted(
        &mut self,
        name: &str,
        weights: &[Vec<String>],
        levels: &[Vec<f64>],
        values: &[f64],
    ) -> String {
        match weights {
            // What depends on nothing.
            [] => {
                let value = [("value", "float", Arg::value(number(values[0])))];
                return self.add("constant", "float", &format!("{name}_total"), &value);
            }
            [columns] => return self.row(name, columns, values),
            _ => {}
        }
        let stride: usize = levels[1..].iter().map(Vec::len).product();
        let fours: Vec<String> = (0..weights[0].len())
            .map(|group| {
                let name = format!("{name}_rows_{group}");
                let rows: Vec<&[f64]> = values.chunks(stride).skip(WIDTH * group).take(WIDTH).collect();
                if let [_, columns] = weights {
                    return self.four_rows(&name, columns, &rows);
                }
                let inputs: Vec<_> = (["in1", "in2", "in3", "in4"].into_iter().enumerate())
                    .map(|(k, input)| {
                        let inner = rows.get(k).map(|row| {
                            self.contracted(&format!("{name}_{k}"), &weights[1..], &levels[1..], row)
                        });
                        (
                            input,
                            "float",
                            inner.map_or_else(|| Arg::value("0".into()), |node| Arg::node(&node)),
                        )
                    })
                    .collect();
                self.add("combine4", "vector4", &name, &inputs)
            })
            .collect();
        let products: Vec<String> = (fours.iter().zip(&weights[0]).enumerate())
            .map(|(group, (four, weights))| {
                let inputs = [("in1", "vector4", Arg::node(four)), ("in2", "vector4", Arg::node(weights))];
                self.add("dotproduct", "float", &format!("{name}_part_{group}"), &inputs)
            })
            .collect();
        self.total(&format!("{name}_total"), "float", products)
    }

    /// The sum of a row of values times weights.
    fn row(&mut self, name: &str, columns: &[String], values: &[f64]) -> String {
        let products: Vec<String> = (columns.iter().enumerate())
            .map(|(group, weights)| {
                let row = vector(four(values, WIDTH * group));
                let inputs = [("in1", "vector4", Arg::node(weights)), ("in2", "vector4", row)];
                self.add("dotproduct", "float", &format!("{name}_part_{group}"), &inputs)
            })
            .collect();
        self.total(&format!("{name}_total"), "float", products)
    }

    /// The same for four rows at a time. Vectors are rows: `out = in · matrix`.
    fn four_rows(&mut self, name: &str, columns: &[String], rows: &[&[f64]]) -> String {
        let products: Vec<String> = (columns.iter().enumerate())
            .map(|(group, weights)| {
                let value = |column: usize, row: usize| {
                    rows.get(row).and_then(|row| row.get(WIDTH * group + column)).copied().unwrap_or(0.0)
                };
                let numbers: Vec<String> =
                    (0..WIDTH * WIDTH).map(|k| number(value(k / WIDTH, k % WIDTH))).collect();
                let inputs = [
                    ("in", "vector4", Arg::node(weights)),
                    ("mat", "matrix44", Arg::value(numbers.join(", "))),
                ];
                self.add("transformmatrix", "vector4", &format!("{name}_part_{group}"), &inputs)
            })
            .collect();
        self.total(name, "vector4", products)
    }

    fn total(&mut self, name: &str, kind: &str, parts: Vec<String>) -> String {
        let mut parts = parts.into_iter().enumerate();
        let (_, first) = parts.next().unwrap_or_default();
        parts.fold(first, |sum, (k, part)| {
            let inputs = [("in1", kind, Arg::node(&sum)), ("in2", kind, Arg::node(&part))];
            self.add("add", kind, &format!("{name}_{k}"), &inputs)
        })
    }
}
