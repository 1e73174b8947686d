//! The page, the text and the folder of a report.

mod example;

use std::cell::RefCell;

use lookmatch_reproduce::{Bar, Cell, Finding, Report, Row, Run, Table, keep, kept, page, text, write};
use tempfile::TempDir;

use example::{run, ward, write_pictures};

/// A folder with the example's pictures.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_pictures(folder.path());
    folder
}

/// Text without its HTML, blanks put together.
fn words(page: &str) -> String {
    let body = &page[page.find("<main>").unwrap()..page.find("<script>").unwrap()];
    let text: String =
        body.split('<').map(|part| part.split_once('>').map_or(part, |(_, text)| text)).collect();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn all_that_was_found_is_on_the_page() {
    let folder = folder();
    let page = page(&run(), folder.path()).unwrap();
    let words = words(&page);
    for expected in [
        "lookmatch reproduce all --quick --seed 7 -o report/",
        "lookmatch 0.1.0",
        "AMD EPYC 7B13",
        "2 bars reached",
        "1 missed",
        "3 experiments",
        "1 h 16 min in all",
        "Section 5.2, Tables 4 and 5, Figures 9 and 11",
        "mean NRMSD, red, Table 4: 0.0101, at most 0.0107",
        "share ranked first: 0.5599, not at least 0.5600",
        "0.0101 / 0.0107 (0.94×)",
        "0.0213 / 0.0107 (1.99×)",
        "9.414",
        "NRMSD0.0113JOD9.87",
        "indistinguishable",
        "slightly different",
        "noticeably different",
        "Points: the probe.",
        "Preset ranges are the paper's",
        "material-19",
        "Components",
    ] {
        assert!(words.contains(expected), "'{expected}' in {words}");
    }
    let missed = "JOD is flat where R &lt; 0.06 &lt;script&gt;";
    assert_eq!(page.matches(missed).count(), 2, "in the table of all, and where the experiment is");
    assert_eq!(page.matches("class=\"missed\"").count(), 3, "there, and where they are counted");
    // Each picture once, the figure, and nothing that is not part of the page.
    assert_eq!(page.matches("src=\"data:image/png;base64,").count(), 2 * (4 + 3));
    assert_eq!(page.matches("src=").count(), 2 * (4 + 3) + 1);
    for run in &run().reports {
        assert!(page.contains(&format!("<article id=\"{}\">", run.name)));
        assert!(page.contains(&format!("href=\"#{}\"", run.name)));
    }
}

#[test]
fn what_is_higher_than_the_papers_is_red_and_nothing_else() {
    let folder = folder();
    let row =
        |ours, paper| Row { name: "r".into(), cells: vec![Cell::Beside { ours, paper }], is_main: false };
    let marked = |ours, paper| {
        let table =
            Table { rows: vec![row(ours, paper)], columns: vec!["".into(), "".into()], ..Table::default() };
        let report = Report { name: "x".into(), tables: vec![table], ..Report::default() };
        let page = page(&Run { reports: vec![report], ..run() }, folder.path()).unwrap();
        page.contains("<td class=\"number beside worse\">")
    };
    assert!(marked(0.010_700_1, 0.0107) && marked(1.0, 0.0));
    assert!(!marked(0.0107, 0.0107) && !marked(0.0106, 0.0107));
}

#[test]
fn nothing_on_the_page_needs_a_network_or_breaks_it() {
    let folder = folder();
    let mut run = run();
    let hostile = "\"><img src=x onerror=alert(1)></script>";
    run.environment.machine = hostile.into();
    let report = &mut run.reports[0];
    (report.title, report.about) = (hostile.into(), hostile.into());
    report.notes = vec![hostile.into()];
    report.tables[0].rows[0].cells[2] = Cell::Text(hostile.into());
    report.comparisons[0].title = hostile.into();
    report.comparisons[0].others[0].title = hostile.into();
    report.findings[0].name = hostile.into();
    let page = page(&run, folder.path()).unwrap();
    assert!(!page.contains("<img src=x") && !page.contains("alert(1)></script>"));
    assert_eq!(page.matches("</script>").count(), 1);
    for forbidden in ["http://", "https://", "url(", "@import", "src=\"//"] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
    assert!(page.contains("default-src 'none'"));
}

#[test]
fn a_picture_that_is_missing_is_named() {
    let folder = folder();
    std::fs::remove_file(folder.path().join("pictures/copy-error.png")).unwrap();
    let message = format!("{:#}", page(&run(), folder.path()).unwrap_err());
    assert!(message.contains("ward-to-ggx") && message.contains("copy-error.png"), "{message}");
    let mut run = run();
    run.reports[0].figures[0].file = "pictures/roughness.tiff".into();
    run.reports[0].comparisons.clear();
    let message = format!("{:#}", page(&run, folder.path()).unwrap_err());
    assert!(message.contains("roughness.tiff") && message.contains(".png or .svg"), "{message}");
}

#[test]
fn the_text_names_what_is_missed_and_fits_a_terminal() {
    let text = text(&run());
    for line in text.lines() {
        assert!(line.chars().count() <= 100, "{line}");
        assert_eq!(line, line.trim_end());
    }
    let line = |part: &str| {
        text.lines().find(|line| line.contains(part)).unwrap_or_else(|| panic!("{part}: {text}"))
    };
    assert!(line("ward-to-ggx  ").contains("3 min 20 s"), "{text}");
    assert!(
        line("MISSED").contains("share ranked first: 0.5599, not at least 0.5600: JOD is flat"),
        "{text}"
    );
    assert_eq!(text.matches("MISSED").count(), 1);
    assert!(line("reached  mean NRMSD").ends_with("0.0101, at most 0.0107"));
    assert!(line("probe").contains("0.0101 / 0.0107 (0.94×)"));
    assert!(text.contains("2 bars reached, 1 missed"));
    // Of a long table the main rows, with all of its columns.
    assert_eq!(
        text.lines().filter(|line| line.starts_with(" material-17")).count(),
        text.matches("material-17").count()
    );
    assert!(text.contains("material-17") && !text.contains("material-3") && text.contains("19 more rows"));
    for k in 0..12 {
        assert_eq!(
            text.matches(&format!("column {k} ")).count() + text.matches(&format!("column {k}\n")).count(),
            1
        );
    }
}

#[test]
fn a_folder_has_all_three_and_the_json_reads_back() {
    let folder = folder();
    let run = run();
    write(&run, folder.path()).unwrap();
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("index.html"), page(&run, folder.path()).unwrap());
    assert_eq!(read("report.txt"), text(&run));
    assert_eq!(serde_json::from_str::<Run>(&read("report.json")).unwrap(), run);
    let gone = folder.path().join("nowhere");
    assert!(write(&run, &gone).is_err());
}

/// What is read back of the example's first experiment, and what is said about it.
fn resumed(folder: &TempDir, run: &Run) -> (Option<Report>, String) {
    let said = RefCell::new(String::new());
    let found =
        kept("ward-to-ggx", &run.environment, folder.path(), &|line| said.borrow_mut().push_str(line));
    (found, said.into_inner())
}

#[test]
fn what_is_done_is_kept_for_the_same_run_and_no_other() {
    let folder = folder();
    let run = run();
    assert_eq!(resumed(&folder, &run), (None, String::new()));
    keep(&ward(), &run.environment, folder.path()).unwrap();
    assert_eq!(resumed(&folder, &run), (Some(ward()), String::new()));
    let mut elsewhere = run.clone();
    elsewhere.environment.machine = "another".into();
    elsewhere.environment.command = "lookmatch reproduce ward-to-ggx".into();
    assert_eq!(resumed(&folder, &elsewhere).0, Some(ward()));
    type Change = fn(&mut Run);
    let changes: [(Change, &str); 3] = [
        (
            |run| run.environment.program = "lookmatch 0.2.0".into(),
            "lookmatch 0.1.0, seed 7, quick, not of lookmatch 0.2.0",
        ),
        (|run| run.environment.seed = 8, "seed 7, quick, not of lookmatch 0.1.0, seed 8"),
        (|run| run.environment.is_quick = false, "quick, not of lookmatch 0.1.0, seed 7, full"),
    ];
    for (change, why) in changes {
        let mut other = run.clone();
        change(&mut other);
        let (found, said) = resumed(&folder, &other);
        assert!(found.is_none() && said.contains(why) && said.contains("ward-to-ggx.json"), "{said}");
    }
}

#[test]
fn what_is_damaged_is_run_again() {
    let folder = folder();
    let run = run();
    let path = folder.path().join("ward-to-ggx.json");
    keep(&ward(), &run.environment, folder.path()).unwrap();
    let whole = std::fs::read_to_string(&path).unwrap();
    for damaged in ["", "{}", "null", &whole[..whole.len() / 2], &whole.replace("\"seconds\"", "\"secs\"")] {
        std::fs::write(&path, damaged).unwrap();
        let (found, said) = resumed(&folder, &run);
        assert!(found.is_none() && said.contains("damaged"), "{said}");
    }
    std::fs::write(&path, [0xff, 0xfe]).unwrap();
    assert!(resumed(&folder, &run).1.contains("ignored"));
    std::fs::write(&path, whole.replace("ward-to-ggx", "pca")).unwrap();
    assert!(resumed(&folder, &run).1.contains("of experiment 'pca'"));
    std::fs::write(&path, whole).unwrap();
    std::fs::remove_file(folder.path().join("pictures/roughness.svg")).unwrap();
    let (found, said) = resumed(&folder, &run);
    assert!(found.is_none() && said.contains("roughness.svg"), "{said}");
}

#[test]
fn a_number_that_could_not_be_measured_is_missed_in_words() {
    let folder = folder();
    let finding = Finding { name: "mean".into(), value: f64::NAN, bar: Bar::AtMost(1.0), cause: None };
    let report = Report { name: "x".into(), findings: vec![finding], ..Report::default() };
    let run = Run { reports: vec![report], ..run() };
    assert!(words(&page(&run, folder.path()).unwrap()).contains("mean: NaN, not at most 1"));
    assert!(text(&run).contains("MISSED  mean: NaN, not at most 1: the cause is not known"));
}
