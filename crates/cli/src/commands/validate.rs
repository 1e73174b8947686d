//! `lookmatch validate`: how good a probe is where its search never looked.

use lookmatch_remap::{Lighting, Probe, ValidationReport, Validator, VerdictMap, validation_points};

use crate::Usage;
use crate::args::ValidateArgs;
use crate::commands::check_output;
use crate::judgement::{validation_text, verdicts_text};
use crate::output::{bar, print, print_json};
use crate::report::scores_table;
use crate::transport::{Preparation, cache};

/// Entries that people would look at for the probe's map of verdicts: 35 ms of a core for each method and entry.
const MAP_POINTS: usize = 400;

pub(crate) fn run(args: &ValidateArgs) -> anyhow::Result<()> {
    if args.points == Some(0) {
        return Err(Usage("--points is 0; give 1 or more".into()).into());
    }
    let mut probe = Probe::read(&args.probe)?;
    check_models(&probe)?;
    if let Some(output) = &args.output {
        check_output(output)?;
    }
    let lights: Vec<Lighting> = match args.light.as_slice() {
        [] => vec![None],
        files => files.iter().cloned().map(Some).collect(),
    };
    let points = validation_points(&probe, args.points);
    anyhow::ensure!(!points.is_empty(), "validate: no entry of '{}' has a result", args.probe.display());
    let mapped = validation_points(&probe, Some(args.points.unwrap_or(MAP_POINTS)));
    let (mut reports, mut maps) = (Vec::new(), Vec::new());
    for light in &lights {
        let validator = prepared(&probe, light, args.size)?;
        reports.push(with_progress(&validator, &points, args.metric_points, &|| false)?);
        if args.write {
            maps.push(verdicts_with_progress(&validator, &mapped, &|| false)?);
        }
    }
    if args.write {
        probe.verdicts = maps;
        probe.write(&args.probe)?;
    }
    if let Some(output) = &args.output {
        let text = serde_json::to_string_pretty(&reports)?;
        lookmatch_imaging::write_atomically(output, |out| out.write_all(text.as_bytes()))?;
    }
    if args.json.json {
        return print_json(&reports);
    }
    let mut text: Vec<String> =
        reports.iter().map(|report| scores_table(report) + &validation_text(report)).collect();
    if args.write {
        text.push(verdicts_text(&probe));
    }
    print(&text.join("\n"))
}

/// Refuses probes of models that we cannot render.
fn check_models(probe: &Probe) -> anyhow::Result<()> {
    for (side, material) in [("source", &probe.from), ("target", &probe.to)] {
        let model = material.model();
        if let Some(renderer) = model.renderer {
            let instead =
                "`lookmatch inspect` has the NRMSD of its entries, `lookmatch compare` renders single ones";
            let wrong = format!(
                "validate: the probe's {side} is {}, which only {renderer} can render; {instead}",
                model.name
            );
            return Err(Usage(wrong).into());
        }
    }
    Ok(())
}

/// Prepares the validation scene under a light, with a sign of life where it takes time.
pub(crate) fn prepared<'a>(probe: &'a Probe, light: &Lighting, size: usize) -> anyhow::Result<Validator<'a>> {
    let preparation = Preparation::of("the validation scene");
    let observe = |progress| preparation.observe(progress);
    let validator = Validator::cached(probe, light, size, &cache(), &observe)?;
    preparation.finish();
    Ok(validator)
}

/// Says when work should end.
pub(crate) type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Validates at some entries, at some of them by all metrics, with a progress bar.
pub(crate) fn with_progress(
    validator: &Validator,
    points: &[usize],
    metric_points: usize,
    stop: Stop,
) -> anyhow::Result<ValidationReport> {
    let progress = bar(points.len(), "validating");
    let report = validator.validate_until(points, metric_points, &|| progress.inc(1), stop)?;
    progress.finish_and_clear();
    Ok(report)
}

/// What people would say at some entries, with a progress bar.
pub(crate) fn verdicts_with_progress(
    validator: &Validator,
    points: &[usize],
    stop: Stop,
) -> anyhow::Result<VerdictMap> {
    let progress = bar(points.len(), "looking");
    let map = validator.verdicts(points, &|| progress.inc(1), stop)?;
    progress.finish_and_clear();
    Ok(map)
}
