//! `lookmatch bench`: speed and accuracy on this machine.

use std::path::Path;

use lookmatch_renderers::{Bundled, Installations, Launch};

use crate::args::{BenchArgs, PeerName};
use crate::bench::peer::PEER;
use crate::bench::{Effort, Report, document};
use crate::commands::check_output;
use crate::output::{print, print_json, spinner};

pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<()> {
    if let Some(output) = &args.output {
        check_output(output)?;
    }
    let peer = match args.peer {
        Some(PeerName::Mitsuba) => Some(installed(args.peer_folder.as_deref())?),
        None => None,
    };
    let report = Report::measure(effort(args), peer.as_ref())?;
    if let Some(output) = &args.output {
        let text = document::markdown(&report);
        lookmatch_imaging::write_atomically(output, |out| out.write_all(text.as_bytes()))?;
    }
    if args.json.json { print_json(&report) } else { print(&document::plain(&report)) }
}

/// How the peer is started, which is installed unless it is there.
fn installed(folder: Option<&Path>) -> anyhow::Result<Launch> {
    let installations =
        folder.map_or_else(Installations::of_user, |folder| Ok(Installations::within(folder)))?;
    let peer = Bundled::find(PEER)?;
    let progress = spinner(&format!("installing {PEER} (once)"));
    installations.install(peer, &|what| progress.set_message(format!("{PEER}: {what}")), &|| false)?;
    progress.finish_and_clear();
    Ok(installations.launch(peer)?)
}

fn effort(args: &BenchArgs) -> Effort {
    let effort = if args.quick { Effort::QUICK } else { Effort::FULL };
    Effort { samples: args.samples.unwrap_or(effort.samples), ..effort }
}
