//! What can be wrong with a material's description.

use thiserror::Error;

/// A material that cannot be understood; the message names what was given and what would be accepted.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MaterialError {
    /// No model of that name.
    #[error("unknown material model '{name}'{}; known models: {known}", hint(.nearest))]
    UnknownModel {
        /// As given.
        name: String,
        /// The closest known name.
        nearest: Option<String>,
        /// All known names.
        known: String,
    },
    /// A model as another renderer describes it, which cannot be so.
    #[error("the description of model '{model}' is wrong: {reason}")]
    BadDescription {
        /// Name of the model.
        model: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The model has no parameter of that name.
    #[error("model '{model}' has no parameter '{name}'{}; its parameters: {known}", hint(.nearest))]
    UnknownParameter {
        /// Name of the model.
        model: String,
        /// As given.
        name: String,
        /// The closest known name.
        nearest: Option<String>,
        /// All parameters and aliases of the model.
        known: String,
    },
    /// The model has no named material of that name.
    #[error("model '{model}' has no preset '{name}'{}; `lookmatch models {model}` lists its {count}", hint(.nearest))]
    UnknownPreset {
        /// Name of the model.
        model: String,
        /// As given.
        name: String,
        /// The closest known name.
        nearest: Option<String>,
        /// How many the model has.
        count: usize,
    },
    /// Values that do not go together.
    #[error("parameters of model '{model}' do not go together: {reason}")]
    Inconsistent {
        /// Name of the model.
        model: String,
        /// What is wrong.
        reason: String,
    },
    /// A file that is needed and not given.
    #[error("model '{model}' needs {name}=PATH: {content}")]
    NoFile {
        /// Name of the model.
        model: String,
        /// Name of the parameter.
        name: String,
        /// What the file has to hold.
        content: String,
    },
    /// A file that cannot be used.
    #[error("cannot use '{path}' as {name} of model '{model}': {reason}")]
    BadFile {
        /// Name of the model.
        model: String,
        /// Name of the parameter.
        name: String,
        /// The file.
        path: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A value outside of what the model is defined for.
    #[error("parameter '{name}' of model '{model}' is {value}, outside its range {range}")]
    OutOfRange {
        /// Name of the model.
        model: String,
        /// Name of the parameter.
        name: String,
        /// The offending value.
        value: String,
        /// The accepted interval.
        range: String,
    },
    /// A value that is not of the parameter's kind.
    #[error("parameter '{name}' of model '{model}' is '{value}'; expected {expected}")]
    BadValue {
        /// Name of the model.
        model: String,
        /// Name of the parameter.
        name: String,
        /// The offending value.
        value: String,
        /// What would be accepted.
        expected: String,
    },
    /// A parameter given twice, also through an alias.
    #[error("parameter '{name}' of model '{model}' is given twice")]
    Repeated {
        /// Name of the model.
        model: String,
        /// Name of the parameter.
        name: String,
    },
    /// Text that is not a material at all.
    #[error(
        "cannot read material '{text}': {reason}; write MODEL:NAME=VALUE,... (ward:specular=0.1,roughness=0.2) or JSON"
    )]
    Syntax {
        /// As given.
        text: String,
        /// What is wrong with it.
        reason: String,
    },
}

impl MaterialError {
    /// True where the request makes no sense; false where a file that it names cannot be used.
    pub fn is_usage(&self) -> bool {
        !matches!(self, Self::BadFile { .. } | Self::BadDescription { .. })
    }
}

fn hint(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|n| format!(", did you mean '{n}'?")).unwrap_or_default()
}

/// The candidate closest to `name` by edit distance, if any is reasonably close.
pub(crate) fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<String> {
    candidates
        .map(|c| (strsim::jaro_winkler(&name.to_lowercase(), c), c))
        .filter(|(similarity, _)| *similarity > 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, c)| c.to_owned())
}
