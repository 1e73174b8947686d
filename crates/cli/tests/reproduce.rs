//! The paper's experiments through the command line.

mod support;

use std::fs;

use serde_json::Value as Json;
use support::{json, refused};

#[test]
fn an_experiment_ends_in_a_report_and_is_not_run_twice() {
    let folder = tempfile::tempdir().unwrap();
    let of = folder.path();
    fs::create_dir(of.join("light")).unwrap();
    let arguments = ["reproduce", "as-to-beckmann", "--quick", "-o", "report", "--json"];
    let run = json(of, &arguments);
    assert_eq!(run["environment"]["is_quick"], true);
    let report = &run["reports"][0];
    assert_eq!(report["name"], "as-to-beckmann");
    // Table 2: at or below the paper's mean in every channel, and near the best that the target can do.
    for (finding, most) in report["findings"].as_array().unwrap().iter().zip([0.0107, 0.0103, 0.0100, 1.10]) {
        assert!(finding["value"].as_f64().unwrap() <= most, "{finding}");
        assert_eq!(finding["bar"]["at_most"], most);
    }
    let page = fs::read_to_string(of.join("report/index.html")).unwrap();
    assert!(page.contains("Table 2") && page.contains("data:image/png;base64,"));
    assert!(fs::read_to_string(of.join("report/report.txt")).unwrap().contains("as-to-beckmann"));
    for comparison in report["comparisons"].as_array().unwrap() {
        let file = comparison["source"]["file"].as_str().unwrap();
        assert!(of.join("report").join(file).is_file(), "{file}");
    }
    // Everything is found again, the time that it took included.
    let again: Json = json(of, &arguments);
    assert_eq!(again, run);
}

#[test]
fn an_unknown_experiment_is_refused_with_those_that_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["reproduce", "ward-to-gxx"];
    refused(folder.path(), &arguments, 2, &["'ward-to-gxx'", "as-to-beckmann", "ward-to-ggx", "all"]);
    assert!(!folder.path().join("report").exists());
}
