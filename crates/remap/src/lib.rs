//! BRDF Difference Probes: what to search ([`Plan`]), how ([`remap()`]), the result ([`Probe`]), and how good it is
//! ([`Validator`]).
//!
//! A probe maps the parameters of a source model to those of a target model, such that renderings of a reference
//! scene look alike (Guarnera *et al.* 2018). The program never looks at either model's formula to find it: it compares
//! pictures.

mod apply;
mod baseline;
mod carry;
mod channels;
mod compose;
mod cross;
mod cross_match;
mod draft;
mod error;
mod explain;
mod fit;
mod from_pictures;
mod gallery;
mod inverse;
mod journal;
mod losses;
mod options;
mod pairing;
mod pairs;
mod picture_checks;
mod plan;
mod probe;
mod projection;
mod refine;
mod settle;
mod stage;
mod strategy;
mod studio;
mod synthesis;
mod table;
mod validate;
mod verdict_map;

pub use lookmatch_search::Axis;

pub use apply::{Applied, apply, apply_smoothly};
pub use baseline::Baseline;
pub use channels::{ChannelMatch, ChannelTable};
pub use compose::{compose, measure};
pub use cross::CrossStage;
pub use error::RemapError;
pub use explain::{Explanation, Tried, explain};
pub use fit::{
    Alternative, Candidate, Fit, FitForm, Function, Input, ParameterFit, Rerendered, Residual, Shape, Term,
};
pub use from_pictures::{PictureMatch, Pictures, match_pictures};
pub use inverse::{Reach, invert};
pub use journal::journal_path;
pub use losses::{Loss, LossClass, losses};
pub use options::{Assignment, Endpoint, Options, Pair, Preset, Side, Strategy, Vary};
pub use pairs::{PairScore, score_pair};
pub use picture_checks::{PictureCheck, Suspicion, check_pictures};
pub use plan::Plan;
pub use probe::{Derived, DerivedKind, Entry, Flag, Metric, Noise, Probe, RoundTrip, Totals};
pub use stage::{Appearance, Stage};
pub use strategy::{Event, remap, remap_across};
pub use studio::{Counts, RendererRecord, Sampling, Shot, Studio};
pub use synthesis::{
    PictureError, SynthesisExample, SynthesisQuality, SynthesisRecord, SynthesisStudy, study_synthesis,
};
pub use validate::{
    Lighting, MethodScores, MetricScores, Scores, Statistics, ValidationReport, Validator, Verdicts,
    validation_points,
};
pub use verdict_map::{MethodVerdicts, VerdictMap};
