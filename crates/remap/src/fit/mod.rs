//! From a table to smooth functions: each target parameter by local regression over the source parameters, and by a closed form
//! where one is adequate (Guarnera *et al.* 2018, 3.4 and 3.5).
//!
//! What is adequate is told by entries that are left out ([`choose`]), and where both models are our own by pictures ([`rerender`]).
//! Where no smooth relation holds the table stays.

mod choose;
mod data;
mod form;
mod regression;
mod rerender;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub use form::{Function, Input, Shape, Term};
pub use rerender::Rerendered;

use crate::{Probe, RemapError};

/// The smooth form of a probe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// One for each target axis, in their order.
    pub parameters: Vec<ParameterFit>,
    /// What pictures say of it, where some were made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rerendered: Option<Rerendered>,
}

/// What gives the value of a target parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FitForm {
    /// [`ParameterFit::closed`].
    Closed,
    /// [`ParameterFit::local`].
    Local,
    /// The entries, interpolated.
    Table,
}

/// The smooth forms of one target parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterFit {
    /// Name of the target axis.
    pub name: String,
    /// The source axes that it depends on: the fewest that foretell it about as well as all do.
    pub depends_on: Vec<String>,
    /// What is used.
    pub form: FitForm,
    /// Why.
    pub why: String,
    /// Median distance of the lattice's levels; of their logarithms where the parameter is fitted by its logarithm.
    pub lattice_step: f64,
    /// The simplest closed form that foretells left-out entries about as well as the best one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closed: Option<Candidate>,
    /// The local regression.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub local: Option<Candidate>,
    /// What the table foretells of left-out entries from their neighbours, in lattice steps, root mean square.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<f64>,
    /// How well it can be foretold from each choice of source axes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alternatives: Vec<Alternative>,
    /// Places of entries that carried less weight: on the edge of the range, or below noise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub light: Vec<usize>,
    /// Places of entries that carried none, which are outside the domain of the functions: failed, or with a lobe that is
    /// switched off.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outside: Vec<usize>,
}

/// A function and what it leaves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// The function.
    pub function: Function,
    /// Share of the entries that a local regression looks at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub span: Option<f64>,
    /// Degree of its local polynomials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degree: Option<u32>,
    /// What it leaves.
    pub residual: Residual,
}

/// Differences between a function and the entries.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Residual {
    /// Weighted root mean square, in the parameter's unit.
    pub rms: f64,
    /// Largest, in the parameter's unit.
    pub max: f64,
    /// Weighted root mean square at entries that were left out, in lattice steps.
    pub steps: f64,
    /// Mean masked NRMSD to the source where this parameter is the function's and all others are the entry's own; the table's is
    /// in [`Rerendered`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nrmsd: Option<f64>,
}

/// How well a parameter can be foretold from some source axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alternative {
    /// The source axes.
    pub depends_on: Vec<String>,
    /// Weighted root mean square at left-out entries, in lattice steps, of the best form.
    pub steps: f64,
}

impl Fit {
    /// Fits every target parameter of a probe, from its numbers alone. [`Fit::rerender`] judges it by pictures.
    ///
    /// # Errors
    /// Only for a probe that names parameters which its models lack.
    pub fn new(probe: &Probe) -> Result<Self, RemapError> {
        let fit = |k: usize| Ok(choose::fit(&data::Data::new(probe, k)?));
        let parameters = (0..probe.target_axes.len()).map(fit).collect::<Result<Vec<_>, RemapError>>()?;
        Ok(Self { parameters, rerendered: None })
    }

    /// Target values for values of all source axes: `None` for those that the table gives.
    pub fn evaluate(&self, probe: &Probe, source: &[f64]) -> Vec<Option<f64>> {
        self.parameters.iter().map(|p| Some(p.function()?.at(probe, source))).collect()
    }

    pub(crate) fn check(&self, probe: &Probe) -> Result<(), String> {
        let is_known = |name: &String| probe.source_axes.iter().any(|axis| axis.name == *name);
        let names = self.parameters.iter().map(|p| &p.name);
        if names.ne(probe.target_axes.iter().map(|axis| &axis.name)) {
            return Err("the field 'fit' is of other target axes".into());
        }
        for parameter in &self.parameters {
            for Candidate { function, .. } in [&parameter.closed, &parameter.local].into_iter().flatten() {
                let wrong = |why: String| format!("fit of {}: {why}", parameter.name);
                function.check().map_err(wrong)?;
                if let Some(input) = function.inputs.iter().find(|input| !is_known(&input.name)) {
                    return Err(wrong(format!("there is no source axis '{}'", input.name)));
                }
            }
            let has_form = parameter.form == FitForm::Table || parameter.function().is_some();
            let is_placed = |places: &[usize]| places.iter().all(|p| *p < probe.entries.len());
            if !has_form || !is_placed(&parameter.light) || !is_placed(&parameter.outside) {
                return Err(format!(
                    "fit of {}: it lacks its form, or speaks of entries that are not there",
                    parameter.name
                ));
            }
        }
        Ok(())
    }
}

impl ParameterFit {
    /// The function in use; `None` where the table is.
    pub fn function(&self) -> Option<&Function> {
        self.candidate().map(|candidate| &candidate.function)
    }

    /// The form in use with what it leaves; `None` where the table is used.
    pub fn candidate(&self) -> Option<&Candidate> {
        match self.form {
            FitForm::Closed => self.closed.as_ref(),
            FitForm::Local => self.local.as_ref(),
            FitForm::Table => None,
        }
    }

    /// What gives its values, in words.
    pub fn describe(&self) -> String {
        self.function().map_or_else(|| "table".into(), Function::describe)
    }
}

impl Function {
    /// The target parameter for values of all source axes of a probe.
    pub fn at(&self, probe: &Probe, source: &[f64]) -> f64 {
        let value = |input: &Input| {
            let axis = probe.source_axes.iter().position(|axis| axis.name == input.name);
            axis.map_or(f64::NAN, |k| source[k])
        };
        self.evaluate(&self.inputs.iter().map(value).collect::<Vec<f64>>())
    }
}
