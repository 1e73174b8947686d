//! The path-traced experiments, run quickly.

use lookmatch_rendering::TransportCache;
use lookmatch_reproduce::{Setting, Watch, by_name};

struct Silent;

impl Watch for Silent {
    fn begin(&self, _: &str, _: usize) {}
    fn advance(&self, _: usize) {}
    fn is_stopped(&self) -> bool {
        false
    }
}

#[test]
fn quick_runs_end_with_numbers_and_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let setting = Setting {
        is_quick: true,
        seed: 1,
        folder: folder.path().to_owned(),
        cache: TransportCache::new(folder.path().join("light")),
    };
    for name in ["colour-checker", "svbrdf", "scenes"] {
        let report = by_name(name).unwrap().run(&setting, &Silent).unwrap();
        assert!(!report.findings.is_empty() && !report.tables.is_empty(), "{name}");
        for finding in &report.findings {
            assert!(finding.value.is_finite() && finding.value > 0.0, "{name}: {finding:?}");
        }
        assert!(!report.comparisons.is_empty(), "{name}");
        for comparison in &report.comparisons {
            for picture in std::iter::once(&comparison.source).chain(&comparison.others) {
                assert!(folder.path().join(&picture.file).is_file(), "{name}: {}", picture.file);
            }
        }
        for figure in &report.figures {
            assert!(folder.path().join(&figure.file).is_file(), "{name}: {}", figure.file);
        }
    }
}
