//! Noise falls with the number of samples.

use std::f64::consts::SQRT_2;

use lookmatch_imaging::Image;

use super::compare;
use super::finding::Limit;
use super::session::{Session, defaults};
use super::{Check, Finding};
use crate::{Determinism, RendererError};

pub(super) const CHECK: Check =
    Check { name: "noise", about: "noise at 16 and 64 samples per pixel, and stray pixels", run };

const FEW: u32 = 16;
const MANY: u32 = 64;

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    let capabilities = &session.hello.capabilities;
    session.load("stage", &session.stage()?)?;
    let worn = session.models.first().map_or_else(|| session.lambert([0.5; 3]).0, |model| defaults(model));
    if !(capabilities.seeds || capabilities.deterministic == Determinism::None) {
        if capabilities.noise {
            finding.skip("pictures of two seeds cannot be compared: capabilities.seeds is false");
        } else {
            let picture = session.render("stage", &worn, FEW, 1)?;
            finding.measure("samples taken of 16", picture.samples.into(), Limit::between(8.0, 32.0));
            finding.remark("it has no noise, it says");
        }
        return Ok(());
    }
    let pair = |samples| {
        let first = session.render("stage", &worn, samples, 1)?;
        let second = session.render("stage", &worn, samples, 2)?;
        Ok::<_, RendererError>((compare::rms(&first.image, &second.image) / SQRT_2, first, second))
    };
    let (few, first, second) = pair(FEW)?;
    let (many, finer, _) = pair(MANY)?;
    finding.measure("samples taken of 16", first.samples.into(), Limit::between(8.0, 32.0));
    finding.measure("samples taken of 64", finer.samples.into(), Limit::between(32.0, 128.0));
    let range = f64::from(compare::brightest(&finer.image)).max(f64::MIN_POSITIVE);
    finding.measure("noise at 16 over the range", few / range, Limit::NONE);
    finding.measure("noise at 64 over the range", many / range, Limit::NONE);
    if !capabilities.noise {
        if few > 1e-3 * range {
            finding.fault("pictures of two seeds differ, although capabilities.noise is false");
        }
        return Ok(());
    }
    if many == 0.0 {
        finding.remark("no noise was found: two seeds gave the same picture");
    } else if !finding.measure("noise at 16 over noise at 64", few / many, Limit::least(1.6)) {
        finding.remark(
            "more samples do not take noise away: they are not heeded, or two seeds share their samples",
        );
    }
    let stray = stray(&first.image, &second.image, &finer.image);
    if !finding.measure("share of stray pixels", stray, Limit::most(0.002)) {
        finding.remark(
            "single pixels are far too bright (fireflies): light is met by chance that should be aimed at",
        );
    }
    finding.show("16", &first.image, &finer.image);
    Ok(())
}

/// Share of pixels that differ by three times what almost all of the picture stays below.
fn stray(a: &Image, b: &Image, usual: &Image) -> f64 {
    let mut values: Vec<f32> = usual.pixels().iter().map(|p| p[1]).collect();
    values.sort_by(f32::total_cmp);
    let limit = 3.0 * values[values.len() * 99 / 100];
    let pairs = a.pixels().iter().zip(b.pixels());
    pairs.filter(|(a, b)| (a[1] - b[1]).abs() > limit).count() as f64 / values.len() as f64
}
