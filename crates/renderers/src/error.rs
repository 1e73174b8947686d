//! What can go wrong with a renderer.

use lookmatch_rendering::SceneError;
use thiserror::Error;

/// The request that starts everything.
pub(crate) const HELLO: &str = "hello";

/// Why a renderer did not do what it was asked for.
#[derive(Debug, Error)]
pub enum RendererError {
    /// The program of a worker cannot be run.
    #[error("cannot start renderer '{renderer}': {reason}")]
    Start {
        /// What was to be run.
        renderer: String,
        /// The system's reason.
        reason: String,
    },
    /// A request failed.
    #[error(transparent)]
    Request(#[from] Box<Failure>),
    /// A scene that this renderer is not given.
    #[error("renderer '{renderer}' cannot be given scene '{scene}': {reason}")]
    Unsuitable {
        /// The renderer.
        renderer: String,
        /// Name of the scene.
        scene: String,
        /// The field, its value, and what would be accepted.
        reason: String,
    },
    /// A scene that is none.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A picture that cannot be asked for.
    #[error("renderer '{renderer}' cannot render this: {field} is {value}; expected {expected}")]
    Job {
        /// The renderer.
        renderer: String,
        /// The field of the job.
        field: &'static str,
        /// Its value.
        value: String,
        /// What would be accepted.
        expected: String,
    },
    /// Too many failures in a row: no more workers are started.
    #[error("renderer '{renderer}' is given up after {failures} failures in a row; the last one: {last}")]
    GivenUp {
        /// The renderer.
        renderer: String,
        /// How many.
        failures: u32,
        /// Message of the last one.
        last: String,
    },
    /// The user stopped the work.
    #[error("stopped")]
    Stopped,
}

/// A request that failed.
#[derive(Clone, Debug, Error)]
#[error("renderer '{renderer}', {request}: {cause}{}", quote(last_words))]
pub struct Failure {
    /// The renderer's name, or what was run where it has not said its name.
    pub renderer: String,
    /// What was asked for.
    pub request: String,
    /// What was wrong.
    pub cause: Cause,
    /// What the worker last wrote to its log; may be empty.
    pub last_words: String,
}

fn quote(last_words: &str) -> String {
    if last_words.is_empty() { String::new() } else { format!(" (its last words: {last_words})") }
}

/// Why a request failed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Cause {
    /// The process ended; holds how.
    #[error("the worker ended ({0})")]
    Died(String),
    /// Neither an answer nor a sign of progress came in time.
    #[error("the worker said nothing for {seconds} s, which is the time limit")]
    Silent {
        /// The limit.
        seconds: f64,
    },
    /// Something that is no message; holds what.
    #[error("the worker's output is not the protocol: {0}")]
    Garbage(String),
    /// An answer to another request.
    #[error("the worker answered request {found}; expected an answer to {expected}")]
    WrongId {
        /// Identity of the request.
        expected: u64,
        /// Identity in the answer, as JSON.
        found: String,
    },
    /// The worker answered with an error; holds its text.
    #[error("{0}")]
    Refused(String),
    /// A field of an answer is missing or makes no sense; holds the field, the value and what was expected.
    #[error("the worker's answer is not understood: {0}")]
    Answer(String),
    /// A picture of the wrong size.
    #[error("the picture is {width} x {height} pixels; expected {size} x {size}")]
    Size {
        /// Its width.
        width: u64,
        /// Its height.
        height: u64,
        /// Both, of the scene.
        size: usize,
    },
    /// Pixels that are no numbers.
    #[error("{count} of the picture's values are not finite, the first one at column {x}, row {y}")]
    NotFinite {
        /// How many values.
        count: usize,
        /// Where the first one lies.
        x: usize,
        /// Its row from the top.
        y: usize,
    },
    /// A picture without any light.
    #[error("the picture is black, although the scene is lit")]
    Black,
}

impl Cause {
    /// True where the worker cannot be used any longer.
    pub(crate) fn ends_worker(&self) -> bool {
        !matches!(self, Self::Refused(_) | Self::NotFinite { .. } | Self::Black)
    }
}

impl RendererError {
    /// True where a worker or its start came to grief, so that too many in a row mean that there is no use in going on.
    pub(crate) fn ends_worker(&self) -> bool {
        match self {
            Self::Start { .. } => true,
            Self::Request(failure) => failure.cause.ends_worker(),
            _ => false,
        }
    }

    /// True where a worker did not even say what it is.
    pub(crate) fn is_start(&self) -> bool {
        match self {
            Self::Start { .. } => true,
            Self::Request(failure) => failure.request == HELLO,
            _ => false,
        }
    }

    /// True where a fresh worker may do better.
    pub(crate) fn is_worth_repeating(&self) -> bool {
        matches!(self, Self::Start { .. } | Self::Request(_))
    }
}
