//! The operators and the lattice against the shared conformance vectors, to 1e-12 relative.

use lookmatch_search::{Axis, operators};
use operators::Spread;
use serde_json::Value;

const VECTORS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/conformance/vectors_public.json");

/// The vectors of one operator; none, with a notice, where the project stands alone.
fn vectors(name: &str) -> Vec<Value> {
    let Ok(text) = std::fs::read_to_string(VECTORS) else {
        eprintln!("SKIPPED: no conformance vectors at {VECTORS}");
        return vec![];
    };
    let file: Value = serde_json::from_str(&text).expect("the vectors are JSON");
    let found = file["ga"][name].as_array().cloned().unwrap_or_default();
    assert!(!found.is_empty(), "no vectors for {name}");
    found
}

fn number(vector: &Value, key: &str) -> f64 {
    vector[key].as_f64().unwrap_or_else(|| panic!("{key} is a number"))
}

fn numbers(vector: &Value, key: &str) -> Vec<f64> {
    let list = vector[key].as_array().unwrap_or_else(|| panic!("{key} is a list"));
    list.iter().map(|v| v.as_f64().expect("a number")).collect()
}

#[track_caller]
fn close(found: f64, wanted: f64) {
    assert!((found - wanted).abs() <= 1e-12 * wanted.abs().max(1e-3), "{found} is not {wanted}");
}

#[test]
fn laplace_crossover() {
    for v in vectors("laplace_crossover") {
        let n = |key| number(&v, key);
        let beta = operators::laplace_beta(n("u"), n("r"), n("a"), n("b"));
        let (y1, y2) = operators::laplace_crossover(n("x1"), n("x2"), beta);
        close(beta, n("beta"));
        close(y1, n("y1"));
        close(y2, n("y2"));
    }
}

#[test]
fn power_mutation() {
    for v in vectors("power_mutation") {
        let n = |key| number(&v, key);
        for (spread, key) in [(Spread::Range, "y_range"), (Spread::Ratio, "y_ratio")] {
            let y = operators::power_mutation(n("x"), n("xl"), n("xu"), n("s1"), n("r"), n("p"), spread);
            close(y, n(key));
        }
    }
}

#[test]
fn truncation() {
    for v in vectors("truncation") {
        assert_eq!(operators::truncate(number(&v, "x"), number(&v, "r")), number(&v, "y"));
    }
}

#[test]
fn deb_penalty() {
    for v in vectors("deb_penalty") {
        let found = operators::penalised(&numbers(&v, "f"), &numbers(&v, "violation"));
        let wanted = numbers(&v, "penalised");
        assert_eq!(found.len(), wanted.len());
        found.into_iter().zip(wanted).for_each(|(f, w)| close(f, w));
    }
}

#[test]
fn deb_tournament() {
    let populations = vectors("deb_penalty");
    for v in vectors("deb_tournament") {
        let index = |key: &str| v[key].as_u64().expect("an index") as usize;
        let population = &populations[index("population")];
        let (f, violation) = (numbers(population, "f"), numbers(population, "violation"));
        let score = |k: usize| (f[k], violation[k]);
        let (i, j) = (index("i"), index("j"));
        let winner = if operators::beats(score(j), score(i)) { j } else { i };
        assert_eq!(winner, index("winner"));
    }
}

#[test]
fn lattice() {
    for v in vectors("lattice") {
        let (lo, hi, step) = (number(&v, "lo"), number(&v, "hi"), number(&v, "step"));
        let axis = Axis::regular("x", lo, hi, step).expect("a sound range");
        assert_eq!(axis.len() as u64, v["count_inclusive"].as_u64().expect("a count"));
        let printed = Axis::paper_count(lo, hi, step) as u64;
        assert_eq!(printed, v["count_paper_formula"].as_u64().expect("a count"));
        let wanted = numbers(&v, "values");
        assert_eq!(axis.len(), wanted.len());
        axis.levels.iter().zip(wanted).for_each(|(&f, w)| close(f, w));
    }
}
