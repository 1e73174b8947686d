//! Asking `apply`, once for each point.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use itertools::Itertools;
use lookmatch_materials::{Material, Value};
use lookmatch_remap::{Probe, RemapError, apply, apply_smoothly};
use rayon::prelude::*;

use crate::ExportError;
use crate::mapping::Input;

/// Values of the inputs; numbers have the first channel three times.
pub(crate) type Point = Vec<[f64; 3]>;
/// The numbers of each parameter of the target, none for choices and files; nothing where the probe has no result.
pub(crate) type Answer = Option<Vec<Vec<f64>>>;

/// What is asked: a probe with values for all source parameters that are no inputs.
pub(crate) struct Question<'a> {
    pub(crate) probe: &'a Probe,
    pub(crate) base: &'a Material,
    pub(crate) is_smooth: bool,
    pub(crate) inputs: &'a [Input],
    /// The probe's levels of each input; some of its range for those that are carried over.
    pub(crate) levels: &'a [Vec<f64>],
    known: Mutex<HashMap<Vec<u64>, Answer>>,
}

impl<'a> Question<'a> {
    pub(crate) fn new(
        probe: &'a Probe,
        (base, is_smooth): (&'a Material, bool),
        inputs: &'a [Input],
        levels: &'a [Vec<f64>],
    ) -> Self {
        Self { probe, base, is_smooth, inputs, levels, known: Mutex::default() }
    }

    /// The inputs' defaults.
    pub(crate) fn defaults(&self) -> Point {
        self.inputs.iter().map(|input| input.default).collect()
    }

    /// The inputs that the probe tabulates.
    pub(crate) fn axes(&self) -> Vec<usize> {
        (0..self.inputs.len()).filter(|i| self.inputs[*i].is_axis).collect()
    }

    /// The others.
    pub(crate) fn carried(&self) -> Vec<usize> {
        (0..self.inputs.len()).filter(|i| !self.inputs[*i].is_axis).collect()
    }

    /// Points all over the range, each coordinate and channel by itself: a Kronecker sequence (Roberts 2018).
    pub(crate) fn spread(&self, count: usize) -> Vec<Point> {
        let dimensions = 3 * self.inputs.len();
        // The root of x^(d+1) = x + 1.
        let root = (0..64).fold(1.5f64, |x, _| (1.0 + x).powf(1.0 / (dimensions as f64 + 1.0)));
        let share = |n: usize, d: usize| (0.5 + n as f64 * root.powi(-(d as i32 + 1))).fract();
        let coordinate = |n: usize, i: usize| {
            let [min, max] = self.inputs[i].range;
            let at =
                |c: usize| min + share(n, 3 * i + if self.inputs[i].is_colour { c } else { 0 }) * (max - min);
            std::array::from_fn(at)
        };
        (0..count).map(|n| (0..self.inputs.len()).map(|i| coordinate(n + 1, i)).collect()).collect()
    }

    pub(crate) fn ask(&self, point: &Point) -> Result<Answer, ExportError> {
        let key: Vec<u64> = point.iter().flatten().map(|v| v.to_bits()).collect();
        if let Some(answer) = self.known.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return Ok(answer.clone());
        }
        let answer = self.apply(point)?;
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(key, answer.clone());
        Ok(answer)
    }

    /// All of some points, on all cores.
    pub(crate) fn ask_all(&self, points: &[Point]) -> Result<Vec<Answer>, ExportError> {
        points.par_iter().map(|point| self.ask(point)).collect()
    }

    fn apply(&self, point: &Point) -> Result<Answer, ExportError> {
        let mut source = self.base.clone();
        for (input, value) in self.inputs.iter().zip(point) {
            if input.is_colour {
                let index = source.model().resolve(&input.name)?[0];
                source.set_value(index, Value::Colour(*value))?;
            } else {
                source.set_number(&input.name, value[0])?;
            }
        }
        let apply = if self.is_smooth { apply_smoothly } else { apply };
        match apply(self.probe, &source, false) {
            Ok(applied) => Ok(Some(applied.target.values().iter().map(Value::numbers).collect())),
            Err(RemapError::Option(_)) if self.probe.entries.iter().any(|e| e.failed.is_some()) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }
}

/// The points of a grid, the first axis slowest.
pub(crate) fn grid(levels: &[Vec<f64>]) -> Vec<Vec<f64>> {
    levels.iter().map(|levels| levels.iter().copied()).multi_cartesian_product().collect()
}
