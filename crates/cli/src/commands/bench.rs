//! `lookmatch bench`: speed and accuracy on this machine.

use crate::args::{BenchArgs, PeerName};
use crate::bench::peer::Installation;
use crate::bench::{Effort, Report, document};
use crate::commands::check_output;
use crate::output::{print, print_json};

pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<()> {
    if let Some(output) = &args.output {
        check_output(output)?;
    }
    let peer = match args.peer {
        Some(PeerName::Mitsuba) => Some(Installation::find_or_make(args.peer_folder.as_deref())?),
        None => None,
    };
    let report = Report::measure(effort(args), peer.as_ref())?;
    if let Some(output) = &args.output {
        let text = document::markdown(&report);
        lookmatch_imaging::write_atomically(output, |out| out.write_all(text.as_bytes()))?;
    }
    if args.json.json { print_json(&report) } else { print(&document::plain(&report)) }
}

fn effort(args: &BenchArgs) -> Effort {
    let effort = if args.quick { Effort::QUICK } else { Effort::FULL };
    Effort { samples: args.samples.unwrap_or(effort.samples), ..effort }
}
