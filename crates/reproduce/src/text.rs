//! A run as plain text, for terminals.

use comfy_table::{CellAlignment, ContentArrangement, Table as Layout, presets};

use crate::number::{beside, duration, measured, number, tally, with_causes};
use crate::{Cell, Finding, Report, Row, Run, Table};

/// Columns of the terminal.
const WIDTH: usize = 100;
/// Rows of a table; of longer ones the page has the rest.
const MOST_ROWS: usize = 12;

/// A summary of a run of at most 100 columns: experiments with what they reach and miss, and their tables.
pub fn text(run: &Run) -> String {
    let environment = &run.environment;
    let [reached, missed] = tally(&run.reports);
    let mut text = format!(
        "{}, seed {}, {}\n{}\n\n",
        environment.program, environment.seed, environment.machine, environment.command
    );
    text += &overview(&run.reports);
    text += &format!("\n{reached} bars reached, {missed} missed\n");
    for report in &run.reports {
        text += &format!("\n{}\n", heading(report));
        text += &findings(&report.findings);
        for table in &report.tables {
            text += &format!("\n{}\n", table.title);
            text += &self::table(table);
        }
    }
    text
}

/// An experiment per line.
fn overview(reports: &[Report]) -> String {
    let mut layout = layout();
    layout.set_header(["experiment", "reproduces", "time", "reached", "missed"]);
    for report in reports {
        let [reached, missed] = tally([report]).map(|count| count.to_string());
        layout.add_row([
            report.name.clone(),
            report.reproduces.clone(),
            duration(report.seconds),
            reached,
            missed,
        ]);
    }
    to_the_right(&mut layout, 2);
    printed(&layout)
}

fn heading(report: &Report) -> String {
    let line = format!("{}: {}", report.name, report.title);
    format!("{line}\n{}", "-".repeat(line.chars().count().min(WIDTH)))
}

/// What is missed, with value, bar and cause; what is reached, in a line each.
fn findings(findings: &[Finding]) -> String {
    let mut layout = layout();
    for (finding, cause) in with_causes(&findings.iter().collect::<Vec<_>>()) {
        let [value, bar] = measured(finding);
        let mut line =
            format!("{}: {value}, {}{bar}", finding.name, if finding.is_reached() { "" } else { "not " });
        if let Some(cause) = cause {
            line += &format!(": {cause}");
        }
        layout.add_row([if finding.is_reached() { "reached" } else { "MISSED" }, &line]);
    }
    printed(&layout)
}

/// As many columns beside each other as a terminal has room for, then the next below them.
fn table(table: &Table) -> String {
    let (rows, left_out) = shown(&table.rows);
    let mut text = String::new();
    let mut begin = 0;
    let columns = table.columns.len().saturating_sub(1);
    while begin < columns.max(1) {
        // Fewer columns until they fit; one that does not is wrapped.
        let fits = (begin + 1..=columns).rev().find(|end| natural_width(table, &rows, begin..*end) <= WIDTH);
        let end = fits.unwrap_or(begin + 1);
        if begin > 0 {
            text.push('\n');
        }
        text += &printed(&block(table, &rows, begin..end));
        begin = end;
    }
    if left_out > 0 {
        text += &format!("{left_out} more rows in index.html\n");
    }
    text
}

/// Rows that a terminal shows of a table, and how many it leaves out: the main ones of a long table, or its first.
fn shown(rows: &[Row]) -> (Vec<&Row>, usize) {
    let mut chosen: Vec<&Row> = rows.iter().collect();
    if rows.len() > MOST_ROWS && rows.iter().any(|row| row.is_main) {
        chosen.retain(|row| row.is_main);
    }
    chosen.truncate(MOST_ROWS);
    let left_out = rows.len() - chosen.len();
    (chosen, left_out)
}

/// Some columns of a table, after the names of its rows.
fn block(table: &Table, rows: &[&Row], columns: std::ops::Range<usize>) -> Layout {
    let mut layout = layout();
    let column = |k: usize| table.columns.get(k).cloned().unwrap_or_default();
    layout.set_header(std::iter::once(column(0)).chain(columns.clone().map(|k| column(k + 1))));
    for row in rows {
        let cells = columns.clone().map(|k| row.cells.get(k).map_or(String::new(), cell));
        layout.add_row(std::iter::once(row.name.clone()).chain(cells));
    }
    to_the_right(&mut layout, 1);
    layout
}

fn natural_width(table: &Table, rows: &[&Row], columns: std::ops::Range<usize>) -> usize {
    let mut layout = block(table, rows, columns);
    layout.set_content_arrangement(ContentArrangement::Disabled);
    layout.lines().map(|line| line.chars().count()).max().unwrap_or(0)
}

fn cell(cell: &Cell) -> String {
    match cell {
        Cell::Text(text) => text.clone(),
        Cell::Number(value) => number(*value),
        Cell::Beside { ours, paper } => {
            let (pair, ratio) = beside(*ours, *paper);
            format!("{pair} {}", ratio.unwrap_or_default())
        }
        Cell::Empty => String::new(),
    }
}

/// Columns with nothing but space between them.
fn layout() -> Layout {
    let mut layout = Layout::new();
    layout.load_style(presets::NOTHING).set_width(WIDTH as u16);
    layout.set_content_arrangement(ContentArrangement::Dynamic);
    layout
}

/// Aligns all columns from one on to the right.
fn to_the_right(layout: &mut Layout, first: usize) {
    for column in layout.column_iter_mut().skip(first) {
        column.set_cell_alignment(CellAlignment::Right);
    }
}

fn printed(layout: &Layout) -> String {
    layout.lines().map(|line| line.trim_end().to_owned() + "\n").collect()
}
