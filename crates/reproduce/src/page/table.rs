//! Tables of numbers.

use maud::{Markup, html};

use crate::number::{beside, number};
use crate::{Cell, Table};

/// A table in a box of its own, which scrolls where the table is wider than the page.
pub(super) fn table(table: &Table, id: &str) -> Markup {
    let is_beside =
        table.rows.iter().flat_map(|row| &row.cells).any(|cell| matches!(cell, Cell::Beside { .. }));
    html! {
        section {
            h3 id=(id) { (table.title) }
            @if !table.about.is_empty() { p { (table.about) } }
            div.scroll tabindex="0" role="region" aria-labelledby=(id) {
                table {
                    @if is_beside {
                        caption { "ours / the paper's (ratio); " span.worse { "red" } " where ours is higher" }
                    }
                    thead { tr {
                        @for (k, column) in table.columns.iter().enumerate() {
                            th.number[has_numbers(table, k)] scope="col" { (column) }
                        }
                    } }
                    tbody {
                        @for row in &table.rows {
                            tr.main[row.is_main] {
                                th scope="row" { (row.name) }
                                @for value in &row.cells { (cell(value)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// True where a column's cells are numbers; the first column has the rows' names.
fn has_numbers(table: &Table, column: usize) -> bool {
    let cells = table.rows.iter().filter_map(|row| row.cells.get(column.checked_sub(1)?));
    cells.into_iter().any(|cell| matches!(cell, Cell::Number(_) | Cell::Beside { .. }))
}

fn cell(cell: &Cell) -> Markup {
    html! {
        @match cell {
            Cell::Text(text) => td.words { (text) },
            Cell::Number(value) => td.number { (number(*value)) },
            Cell::Beside { ours, paper } => {
                @let (pair, ratio) = beside(*ours, *paper);
                td.number.beside.worse[ours > paper] { span { (pair) } @if let Some(ratio) = ratio { " " span { (ratio) } } }
            }
            Cell::Empty => td {},
        }
    }
}
