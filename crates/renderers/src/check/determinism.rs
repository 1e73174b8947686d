//! The same seed, the same picture: as far as the renderer says so.

use lookmatch_imaging::Image;

use super::compare;
use super::finding::Limit;
use super::session::{Session, defaults};
use super::{Check, Finding};
use crate::{Determinism, RendererError};

pub(super) const CHECK: Check = Check {
    name: "determinism",
    about: "pictures of the same and of other seeds, with another material between",
    run,
};

/// How much pictures may differ that are nearly the same: as a share of their range, or of what another seed changes.
const NEARLY: (f64, f64) = (0.01, 0.5);

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    session.load("stage", &session.stage()?)?;
    let worn = session.models.first().map_or_else(|| session.lambert([0.5; 3]).0, |model| defaults(model));
    let other = session.lambert([0.2; 3]).0;
    let samples = session.options.samples.min(16);
    let shot = |worn, seed| Ok::<Image, RendererError>(session.render("stage", worn, samples, seed)?.image);
    let first = shot(&worn, 1)?;
    let again = shot(&worn, 1)?;
    shot(&other, 1)?;
    let back = shot(&worn, 1)?;
    let reseeded = shot(&worn, 2)?;
    let range = f64::from(compare::brightest(&first)).max(f64::MIN_POSITIVE);
    let another = compare::rms(&first, &reseeded) / range;
    let nearly = NEARLY.0.max(NEARLY.1 * another);
    let differences = [("again", &again), ("after another material", &back)];
    for (when, image) in differences {
        let found = compare::rms(&first, image) / range;
        let (limit, words) = match session.hello.capabilities.deterministic {
            Determinism::Exact => (0.0, "to the bit (capabilities.deterministic is exact)"),
            Determinism::Approximate => (nearly, "nearly (capabilities.deterministic is approximate)"),
            Determinism::None => (f64::INFINITY, ""),
        };
        let limit = if limit.is_finite() { Limit::most(limit) } else { Limit::NONE };
        if !finding.measure(format!("difference {when}"), found, limit) {
            finding
                .remark(format!("the same seed gives another picture {when}; it should be the same {words}"));
        }
    }
    let capabilities = &session.hello.capabilities;
    let random = compare::rms(&first, &again) / range;
    if capabilities.seeds && capabilities.noise {
        if !finding.measure("difference of another seed", another, Limit::least(1e-6)) {
            finding.remark("another seed gives the same picture: seeds have no effect, although capabilities.seeds is true");
        }
    } else {
        finding.measure("difference of another seed", another, Limit::NONE);
        if !capabilities.seeds && random == 0.0 && another > 0.0 {
            finding.fault("another seed gives another picture, although capabilities.seeds is false");
        }
    }
    finding.show("again", &again, &first);
    Ok(())
}
