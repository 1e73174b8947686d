//! Fits of tables whose truth is known, and what is made of them backwards and one after the other.

use lookmatch_materials::{Material, Role, by_name};
use lookmatch_search::Axis;

use super::{Fit, FitForm, Function, Shape};
use crate::{
    Entry, Flag, Options, Plan, Probe, RemapError, Strategy, apply, apply_smoothly, compose, invert,
};

/// A probe whose target values are functions of its source's specular reflectance and roughness, rounded to the lattice.
fn probe(from: &str, to: &str, strategy: Strategy, truth: &dyn Fn(f64, f64) -> Vec<f64>) -> Probe {
    let options = Options { strategy, mask: true, ..Options::default() };
    let plan = Plan::new(by_name(from).unwrap(), by_name(to).unwrap(), &options).unwrap();
    let [a, b] = &plan.source_axes[..] else { panic!("two axes") };
    let snapped = |(axis, v): (&Axis, f64)| axis.value(axis.nearest(v));
    let entry = |s: f64, r: f64| {
        let target: Vec<f64> = plan.target_axes.iter().zip(truth(s, r)).map(snapped).collect();
        Entry { target, failed: None, fitness: 0.1, ..Entry::failed(vec![s, r], String::new()) }
    };
    let entries = a.levels.iter().flat_map(|s| b.levels.iter().map(move |r| (*s, *r)));
    let mut probe = Probe::new(&plan, entries.map(|(s, r)| entry(s, r)).collect(), 1);
    for entry in &mut probe.entries {
        let on_edge = |(axis, v): (&Axis, &f64)| *v == axis.value(0) || *v == axis.value(axis.len() - 1);
        let edges = plan.target_axes.iter().zip(&entry.target).filter(|pair| on_edge(*pair));
        entry.saturated = edges.map(|(axis, _)| axis.name.clone()).collect();
    }
    probe
}

fn ward_to_as(truth: &dyn Fn(f64, f64) -> Vec<f64>) -> Probe {
    probe("ward", "as", Strategy::Constrained, truth)
}

/// Numbers between −1 and 1 without a pattern, the same every time (the finaliser of SplitMix64).
fn noise(s: f64, r: f64) -> f64 {
    let seed = (s * 1e4).round() as u64 * 1_000_003 + (r * 1e4).round() as u64;
    let z = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn function<'a>(fit: &'a Fit, name: &str) -> &'a Function {
    let parameter = fit.parameters.iter().find(|p| p.name == name).unwrap();
    parameter.function().unwrap_or_else(|| panic!("{name} stays a table: {}", parameter.why))
}

#[test]
fn known_functions_come_back_with_what_they_depend_on() {
    let probe = ward_to_as(&|s, r| vec![1.3 * s * (1.0 - 0.4 * r), 0.05 + 0.9 * r]);
    let fit = Fit::new(&probe).unwrap();
    let [specular, roughness] = &fit.parameters[..] else { panic!("two parameters") };
    assert_eq!(specular.depends_on, ["specular", "roughness"]);
    assert_eq!(roughness.depends_on, ["roughness"]);
    for (parameter, degree) in [(specular, 2), (roughness, 1)] {
        assert_eq!(parameter.form, FitForm::Closed, "{}", parameter.why);
        let candidate = parameter.closed.as_ref().unwrap();
        assert!(
            matches!(candidate.function.shape, Shape::Polynomial { degree: d, .. } if d == degree),
            "{candidate:?}"
        );
        assert!(candidate.residual.steps < 0.4 && candidate.residual.rms > 0.0, "{:?}", candidate.residual);
        let local = parameter.local.as_ref().unwrap();
        assert!(local.residual.steps < 0.4, "{:?}", local.residual);
    }
    for (s, r) in [(0.05, 0.1), (0.33, 0.62), (0.21, 0.35)] {
        let values = fit.evaluate(&probe, &[s, r]);
        assert!((values[0].unwrap() - 1.3 * s * (1.0 - 0.4 * r)).abs() < 5e-3, "{values:?}");
        assert!((values[1].unwrap() - 0.05 - 0.9 * r).abs() < 2e-3, "{values:?}");
    }
}

#[test]
fn a_fit_does_not_follow_noise() {
    let clean = |r: f64| 0.1 + 0.7 * r - 0.2 * r * r;
    let probe = probe("ward", "as", Strategy::Unconstrained, &|s, r| vec![s, clean(r) + 0.03 * noise(s, r)]);
    let fit = Fit::new(&probe).unwrap();
    let parameter = &fit.parameters[1];
    assert_eq!(parameter.depends_on, ["roughness"], "{:?}", parameter.alternatives);
    for form in [&parameter.closed, &parameter.local] {
        let function = &form.as_ref().unwrap().function;
        for k in 0..=60 {
            let r = 0.01 + 0.68 * f64::from(k) / 60.0;
            let off = function.at(&probe, &[0.2, r]) - clean(r);
            assert!(off.abs() < 0.01, "{}: {off} at {r}, a third of the noise", function.describe());
        }
    }
    assert!(parameter.closed.as_ref().unwrap().function.coefficients() <= 6);
}

#[test]
fn tables_without_a_smooth_relation_stay() {
    let probe = probe("ward", "as", Strategy::Unconstrained, &|s, r| vec![s, 0.35 + 0.3 * noise(s, r)]);
    let fit = Fit::new(&probe).unwrap();
    let parameter = &fit.parameters[1];
    assert_eq!(parameter.form, FitForm::Table);
    assert!(parameter.why.contains("no smooth relation"), "{}", parameter.why);
    assert_eq!(fit.evaluate(&probe, &[0.1, 0.1])[1], None);
    let probe = Probe { fit: Some(fit), ..probe };
    let ward = Material::parse("ward:specular=0.1,roughness=0.11").unwrap();
    let (smooth, table) =
        (apply_smoothly(&probe, &ward, false).unwrap(), apply(&probe, &ward, false).unwrap());
    assert_eq!(smooth.target.number("roughness").unwrap(), table.target.number("roughness").unwrap());
    assert_eq!(smooth.forms[1], ["roughness".to_owned(), "table".to_owned()]);
    assert!(smooth.forms[0][1].contains("polynomial") && table.forms[0][1] == "table");
}

#[test]
fn what_must_rise_does_where_the_strategy_says_so() {
    let steps = |r: f64| 0.05 + 0.6 * r + 0.04 * (20.0 * r).sin();
    let rising = |probe: &Probe| {
        let fit = Fit::new(probe).unwrap();
        let function = function(&fit, "roughness");
        let values: Vec<f64> =
            (0..=400).map(|k| function.at(probe, &[0.2, 0.01 + 0.68 * f64::from(k) / 400.0])).collect();
        values.windows(2).all(|w| w[1] >= w[0] - 1e-9)
    };
    assert!(rising(&ward_to_as(&|s, r| vec![s, steps(r)])));
    assert!(!rising(&probe("ward", "as", Strategy::Unconstrained, &|s, r| vec![s, steps(r)])));
}

#[test]
fn unsure_entries_count_less_or_not_at_all() {
    let mut probe = ward_to_as(&|s, r| vec![s, 0.02 + 0.9 * r]);
    for (place, entry) in probe.entries.iter_mut().enumerate() {
        match place % 5 {
            0 => *entry = Entry::failed(entry.source.clone(), "no picture".into()),
            // As a search leaves it that found no lobe.
            1 if entry.source[0] < 0.1 => entry.target = vec![0.0, 0.01],
            _ => {}
        }
    }
    let fit = Fit::new(&probe).unwrap();
    let roughness = &fit.parameters[1];
    let off = |place: &usize| probe.entries[*place].target == [0.0, 0.01];
    assert_eq!(roughness.outside.len(), 140 + (0..700).filter(off).count());
    assert!((function(&fit, "roughness").at(&probe, &[0.04, 0.3]) - 0.29).abs() < 3e-3);
    let (failed, silent) = (0, (0..700).find(off).unwrap());
    let probe = Probe { fit: Some(fit), ..probe };
    assert!(probe.flags(failed).contains(&Flag::Failed) && probe.flags(failed).contains(&Flag::OutsideFit));
    assert!(probe.flags(silent).contains(&Flag::OutsideFit) && !probe.flags(silent).contains(&Flag::Failed));
    // Functions reach over what failed.
    let ward = Material::parse("ward:specular=0.2,roughness=0.31").unwrap();
    assert!(apply_smoothly(&probe, &ward, false).is_ok());
}

#[test]
fn probes_keep_their_fit_and_do_without() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.json");
    let mut probe = ward_to_as(&|s, r| vec![1.3 * s * (1.0 - 0.4 * r), 0.05 + 0.9 * r]);
    probe.write(&path).unwrap();
    assert!(!std::fs::read_to_string(&path).unwrap().contains("\"fit\""));
    assert_eq!(Probe::read(&path).unwrap(), probe);
    probe.fit = Some(Fit::new(&probe).unwrap());
    probe.write(&path).unwrap();
    assert_eq!(Probe::read(&path).unwrap(), probe);
    probe.fit.as_mut().unwrap().parameters[0].closed.as_mut().unwrap().function.inputs[0].name =
        "gloss".into();
    probe.write(&path).unwrap();
    let error = Probe::read(&path).unwrap_err().to_string();
    assert!(error.contains("'gloss'") && error.contains("specular"), "{error}");
}

#[test]
fn the_inverse_of_a_bijection_leads_back() {
    let mut there = ward_to_as(&|s, r| vec![1.3 * s * (1.0 - 0.4 * r), 0.05 + 0.9 * r]);
    there.fit = Some(Fit::new(&there).unwrap());
    let back = invert(&there).unwrap();
    assert_eq!((back.from.model().name, back.to.model().name), ("as", "ward"));
    let [specular, roughness] = &back.source_axes[..] else { panic!("two axes") };
    assert!(
        (roughness.value(0) - 0.059).abs() < 3e-3
            && (roughness.value(roughness.len() - 1) - 0.671).abs() < 3e-3
    );
    assert!(specular.value(specular.len() - 1) < 0.53);
    for trip in &back.derived.as_ref().unwrap().round_trip {
        assert!(trip.entries == 700 && trip.mean < 1e-3 && trip.max < 1e-2, "{trip:?}");
    }
    for (s, r) in [(0.1, 0.2), (0.3, 0.5), (0.05, 0.6)] {
        let ward = Material::parse(&format!("ward:specular={s},roughness={r}")).unwrap();
        let target = apply_smoothly(&there, &ward, false).unwrap().target;
        let home = apply(&back, &target, false).unwrap().target;
        assert!((home.by_role(Role::SpecularReflectance).unwrap().colour().unwrap()[0] - s).abs() < 2e-3);
        assert!((home.number("roughness_u").unwrap() - r).abs() < 2e-3, "{home}");
    }
    // A corner that no source reaches: the brightest lobe is a narrow one.
    let unreachable = &back.derived.as_ref().unwrap().unreachable;
    let (middle, corner) = (back.source_axes[1].len() * 11 / 2, back.entries.len() - 1);
    assert!(unreachable.contains(&corner) && !unreachable.contains(&middle), "{unreachable:?}");
    assert_eq!(back.entries[corner].saturated, ["specular"]);
    let far = Material::parse("as:specular=0.9,roughness=0.3").unwrap();
    assert!(matches!(apply(&back, &far, false), Err(RemapError::OutsideProbe { .. })));
    assert_eq!(apply(&back, &far, true).unwrap().clamped, ["specular"]);
}

#[test]
fn what_leaves_no_trace_cannot_be_inverted() {
    let flat = ward_to_as(&|_, r| vec![0.2, 0.05 + 0.9 * r]);
    let error = invert(&flat).unwrap_err();
    assert!(error.is_usage() && error.to_string().contains("too few to tell 2"), "{error}");
}

#[test]
fn a_composition_is_one_probe_after_the_other() {
    let mut first = ward_to_as(&|s, r| vec![1.3 * s * (1.0 - 0.4 * r), 0.05 + 0.9 * r]);
    first.entries[3].saturated = vec!["roughness".into()];
    first.fit = Some(Fit::new(&first).unwrap());
    let second = invert(&first).unwrap();
    let both = compose(&first, &second, false).unwrap();
    assert_eq!((both.from.model().name, both.to.model().name), ("ward", "ward"));
    for place in [0, 3, 100, 400, 699] {
        let entry = &both.entries[place];
        let source = both.source_material(&entry.source).unwrap();
        let twice = apply(&second, &apply_smoothly(&first, &source, false).unwrap().target, false).unwrap();
        let once = apply(&both, &source, false).unwrap();
        // Bodies go straight from A to C, and A-S has none.
        let specular = |m: &Material| m.by_role(Role::SpecularReflectance).unwrap().colour().unwrap()[0];
        assert_eq!(specular(&once.target), specular(&twice.target), "at {:?}", entry.source);
        assert_eq!(once.target.number("roughness").unwrap(), twice.target.number("roughness").unwrap());
        assert!((entry.target[0] - entry.source[0]).abs() < 1e-2, "there and back: {entry:?}");
    }
    assert!(both.entries[3].saturated.contains(&"roughness of as".to_owned()));
    assert!(both.entries.iter().all(|entry| (entry.fitness - 0.2).abs() < 1e-9), "errors add up");
}

#[test]
fn a_composition_takes_what_its_second_probe_can() {
    let first = ward_to_as(&|s, r| vec![s, r]);
    // From A-S of a specular reflectance up to 0.2.
    let mut second = invert(&first).unwrap();
    let half = second.source_axes[0].levels.iter().filter(|v| **v <= 0.21).count();
    let rest = second.source_axes[1].len();
    second.source_axes[0].levels.truncate(half);
    second.entries.truncate(half * rest);
    let both = compose(&first, &second, false).unwrap();
    let levels = &both.source_axes[0];
    assert!(levels.value(levels.len() - 1) <= 0.21 && levels.len() == 10, "{levels:?}");
    let clamped = compose(&first, &second, true).unwrap();
    assert_eq!(clamped.source_axes, first.source_axes);
    assert!(clamped.entries[699].saturated.contains(&"specular of as".to_owned()));
    let error = compose(&second, &second, false).unwrap_err();
    assert!(
        error.is_usage() && error.to_string().contains("leads to ward, the second one starts from as"),
        "{error}"
    );
    let other = second.from.clone();
    second.from.set("eta", "1.1").unwrap();
    assert_ne!(other, second.from);
    let ggx = probe("ward", "ggx", Strategy::Constrained, &|s, r| vec![1.0, 1.0 + s, r]);
    let error = compose(&ggx, &second, true).unwrap_err();
    assert!(error.to_string().contains("leads to ggx"), "{error}");
}
