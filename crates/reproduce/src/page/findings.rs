//! What had to be reached, and whether it was.

use maud::{Markup, html};

use crate::number::{duration, measured, tally, with_causes};
use crate::{Finding, Report};

/// All experiments in a table; what they miss is named right there.
pub(super) fn overview(reports: &[Report]) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label="Results of all experiments" {
            table.overview {
                thead { tr {
                    th scope="col" { "Experiment" }
                    th.number scope="col" { "Time" }
                    th.number scope="col" { "Reached" }
                    th.number scope="col" { "Missed" }
                } }
                @for report in reports {
                    @let [reached, missed] = tally([report]);
                    tbody {
                        tr {
                            th scope="row" {
                                a href=(format!("#{}", report.name)) { (report.name) }
                                " " small { (report.reproduces) }
                            }
                            td.number { (duration(report.seconds)) }
                            td.number { (reached) }
                            td.number.worse[missed > 0] { (missed) }
                        }
                        @let missed: Vec<&Finding> = report.findings.iter().filter(|finding| !finding.is_reached()).collect();
                        @for (finding, cause) in with_causes(&missed) {
                            tr.missed { td colspan="4" { (sentence(finding, cause)) } }
                        }
                    }
                }
            }
        }
    }
}

/// What an experiment had to reach.
pub(super) fn findings(findings: &[Finding]) -> Markup {
    html! {
        @if !findings.is_empty() {
            ul.findings {
                @for (finding, cause) in with_causes(&findings.iter().collect::<Vec<_>>()) {
                    @if finding.is_reached() { li.reached { (sentence(finding, cause)) } }
                    @else { li.missed { (sentence(finding, cause)) } }
                }
            }
        }
    }
}

/// A finding with its value, its bar and, where it is missed, the cause.
fn sentence(finding: &Finding, cause: Option<String>) -> Markup {
    let [value, bar] = measured(finding);
    let (mark, word) = if finding.is_reached() { ("✓", "reached: ") } else { ("✗", "missed: ") };
    html! {
        span.mark aria-hidden="true" { (mark) }
        div {
            span.hidden { (word) } (finding.name) ": " b { (value) } ", "
            @if !finding.is_reached() { "not " }
            (bar)
            @if let Some(cause) = cause { p.cause { (cause) } }
        }
    }
}
