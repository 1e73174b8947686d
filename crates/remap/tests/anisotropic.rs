//! Anisotropic remaps: tangent and bitangent are treated alike, and each width leads the one of its own kind.

use lookmatch_materials::{Levels, by_name};
use lookmatch_remap::{Assignment, Options, Plan, Probe, Side, Stage, Vary, remap};

const WIDTHS: [&str; 2] = ["roughness_u", "roughness_v"];

/// Ward to GGX over 2 × 2 pairs of widths, at an index whose scale reaches what Ward reflects.
fn probe() -> Probe {
    let vary = |side, (min, max, step): (f64, f64, f64)| {
        WIDTHS.map(|name| Vary { side: Some(side), name: name.into(), levels: Levels::new(min, max, step) })
    };
    let fix = |side, name: &str, value: &str| Assignment {
        side: Some(side),
        name: name.into(),
        value: value.into(),
    };
    let options = Options {
        size: Some(24),
        mask: true,
        search: "synthesis".into(),
        vary: [vary(Side::Source, (0.1, 0.3, 0.2)), vary(Side::Target, (0.03, 0.39, 0.03))].concat(),
        fix: vec![
            fix(Side::Source, "specular", "0.2"),
            fix(Side::Target, "ior", "4.45"),
            fix(Side::Target, "specular", "0.52"),
        ],
        ..Options::default()
    };
    let plan = Plan::new(by_name("ward").unwrap(), by_name("ggx").unwrap(), &options).unwrap();
    let stage = Stage::prepare(&plan).unwrap();
    remap(&plan, &stage, None, &mut |_| {}, &|| false).unwrap()
}

#[test]
fn exchanged_directions_are_exchanged_in_the_target() {
    let probe = probe();
    let levels = |source: [usize; 2]| {
        let target = &probe.entry(&source).target;
        [0, 1].map(|k| probe.target_axes[k].nearest(target[k]))
    };
    let [narrow, across, along, wide] = [[0, 0], [0, 1], [1, 0], [1, 1]].map(levels);
    // The scene is not symmetric: a level's difference is left to it.
    assert!(across[0].abs_diff(along[1]) <= 1 && across[1].abs_diff(along[0]) <= 1, "{across:?} {along:?}");
    for isotropic in [narrow, wide] {
        assert!(isotropic[0].abs_diff(isotropic[1]) <= 1, "{isotropic:?}");
    }
    // Widths of Ward and GGX are alike: 0.1 is level 2.3, and 0.3 level 9.
    assert!(across[0] <= 4 && across[1] >= 7, "{across:?}");
    // A width that leads its twin as well would not let it fall below what the other source has.
    assert!(along[0] >= narrow[0] && across[1] >= narrow[1], "{narrow:?} {along:?} {across:?}");
}
