//! `lookmatch compose`: two probes as one.

use lookmatch_remap::{Probe, compose};
use serde_json::json;

use crate::args::ComposeArgs;
use crate::commands::check_output;
use crate::commands::invert::{derived_text, domain, measured};
use crate::output::{print, print_json};

pub(crate) fn run(args: &ComposeArgs) -> anyhow::Result<()> {
    check_output(&args.output)?;
    let mut probe = compose(&Probe::read(&args.first)?, &Probe::read(&args.second)?, args.clamp)?;
    measured(&mut probe)?;
    probe.write(&args.output)?;
    if args.json.json {
        return print_json(&json!({
            "probe": args.output, "from": probe.from, "to": probe.to, "domain": domain(&probe),
            "entries": probe.entries.len(), "failed": probe.entries.len() - probe.found().count(),
            "derived": probe.derived,
        }));
    }
    print(&derived_text(&probe))
}
