//! A worker that does everything right passes; every mistake is found where it belongs, and named.

use std::sync::Arc;

use lookmatch_renderers::{CheckOptions, CheckReport, Finding, Launch, Outcome, check};

fn examined(mistake: &str, only: &[&str]) -> CheckReport {
    let launch = Launch {
        program: env!("CARGO_BIN_EXE_lookmatch-faulty-worker").into(),
        args: vec![mistake.into()],
        env: Vec::new(),
    };
    let options = CheckOptions {
        samples: 36,
        size: 48,
        only: only.iter().map(|name| (*name).to_owned()).collect(),
        ..CheckOptions::default()
    };
    check(&launch, &options, Arc::new(|| false), &|_| ()).unwrap()
}

/// A mistake fails a check with some words.
#[track_caller]
fn is_named(mistake: &str, check: &str, words: &str) -> Finding {
    let finding = examined(mistake, &[check]).findings.remove(0);
    let remarks = finding.remarks.join("; ");
    assert_eq!(finding.outcome, Outcome::Failed, "{mistake}: {:?}", finding.numbers);
    assert!(remarks.contains(words), "{mistake}: '{words}' is not in: {remarks}, {:?}", finding.numbers);
    finding
}

#[test]
fn a_right_worker_passes() {
    let report = examined("right", &[]);
    assert_eq!(report.renderer, "faulty 1.0");
    for finding in &report.findings {
        let Finding { check, numbers, remarks, .. } = finding;
        assert_eq!(finding.outcome, Outcome::Passed, "{check}: {numbers:?}, {remarks:?}");
    }
    assert_eq!(report.findings.len(), 12);
    let sheets: Vec<&str> =
        report.findings.iter().flat_map(|f| &f.pictures).map(|p| p.name.as_str()).collect();
    assert!(
        ["lambert-ball", "plane-shadow", "camera-balls", "mirror-ball"].iter().all(|n| sheets.contains(n)),
        "{sheets:?}"
    );
    let sheet = &report.findings[1].pictures[0].image;
    assert_eq!((sheet.width(), sheet.height()), (3 * 48, 48), "got, expected, difference");
}

#[test]
fn mistakes_of_the_picture_are_named() {
    is_named("flipped-rows", "camera", "rows are flipped");
    is_named("mirrored-columns", "camera", "columns are mirrored");
    is_named("row-off", "camera", "too low: rows are counted");
    is_named("ignores-up", "camera", "`up` is not heeded");
    is_named("diagonal-fov", "camera", "measured over the diagonal");
    is_named("srgb", "lambert", "sRGB-encoded");
    is_named("clipped", "lambert", "clipped at 1");
    is_named("clipped", "linearity", "bright light of a lamp is lost");
    is_named("squared-tint", "linearity", "specular says that it is linear in tint, and is not");
    is_named("power", "lambert", "the power 0.8");
    is_named("bgr", "lambert", "BGR");
}

#[test]
fn turned_pictures_are_put_right_for_other_checks() {
    let report = examined("flipped-rows", &["camera", "lambert", "plane", "mirror"]);
    let failed: Vec<&str> =
        report.findings.iter().filter(|f| f.outcome == Outcome::Failed).map(|f| f.check).collect();
    assert_eq!(failed, ["camera"]);
}

#[test]
fn mistakes_of_the_light_are_named() {
    is_named("light-times-pi", "lambert", "a factor of π");
    is_named("light-times-pi", "plane", "a factor of π");
    is_named("exchanged-checks", "plane", "light and dark checks are exchanged");
    is_named("no-shadow", "plane", "casts no shadow");
    is_named("map-rolled", "mirror", "the map is turned by 90 degrees");
    is_named("map-rolled", "map", "the map is turned by 90 degrees");
    is_named("map-mirrored", "mirror", "the map is mirrored");
    is_named("map-flipped", "mirror", "upside down");
    is_named("map-flipped", "map", "upside down");
    is_named("blur", "mirror", "not quite the same");
    is_named("bounce", "interreflection", "although capabilities.interreflection is false");
    is_named("no-bounce", "interreflection", "although capabilities.interreflection is true");
}

#[test]
fn what_a_renderer_admits_is_no_mistake() {
    let finding = examined("declared-blur", &["mirror"]).findings.remove(0);
    assert_eq!(finding.outcome, Outcome::Approximate, "{:?}", finding.numbers);
    assert!(finding.remarks.iter().any(|remark| remark.contains("The environment is blurred.")));
}

#[test]
fn texels_may_be_read_in_two_ways() {
    let mirror = |mistake| examined(mistake, &["mirror"]).findings.remove(0);
    let nearest = mirror("nearest");
    assert_eq!((nearest.outcome, nearest.remarks.len()), (Outcome::Passed, 0), "{nearest:?}");
    let corners = mirror("texel-corners");
    let remarks = corners.remarks.join("; ");
    assert!(remarks.contains("rows and columns of the map lie half a texel off"), "{corners:?}");
}

#[test]
fn mistakes_of_the_protocol_are_named() {
    is_named("accepts-anything", "handshake", "an unknown request is answered with");
    is_named("prints", "handshake", "Loading scene");
    is_named("prints", "ending", "standard output");
    is_named("ignores-seeds", "determinism", "seeds have no effect");
    is_named("unsteady", "determinism", "the same seed gives another picture");
    is_named("ignores-samples", "noise", "more samples do not take noise away");
    is_named("dark-nan", "parameters", "specular at tint = 0");
    is_named("lingers", "ending", "it goes on after the end of its input");
    is_named("exit-status", "ending", "exit status: 3");
}

#[test]
fn other_mistakes_leave_the_camera_alone() {
    for mistake in ["light-times-pi", "srgb", "bgr"] {
        let finding = examined(mistake, &["camera"]).findings.remove(0);
        assert_eq!(finding.outcome, Outcome::Passed, "{mistake}: {:?}", finding.numbers);
    }
}
