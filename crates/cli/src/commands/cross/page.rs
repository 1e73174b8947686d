//! The page that `lookmatch cross` writes, and its summary for a terminal.

use lookmatch_imaging::VIEWING;
use lookmatch_remap::Sampling;

use super::{FOLDER, JUDGING, Match, Outcome, Renderer, Run};
use crate::output::table;

fn title(outcome: &Outcome) -> String {
    format!("`{}` to `{}`", outcome.from, outcome.to)
}

fn row(cells: &[String]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

pub(super) fn page(run: &Run) -> String {
    let (checks, pairs): (Vec<&Outcome>, Vec<&Outcome>) =
        run.pairs.iter().partition(|outcome| outcome.is_same_model());
    let mut text = introduction(run);
    text += "\n| source to target | materials | NRMSD: copy | probe | noise | JOD: copy | probe | noise | better / equal / \
             worse | renders | s in renderers | s in our code |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    pairs.iter().for_each(|outcome| text += &row(&cells(outcome)));
    text += &round_trips(&checks);
    text += "\n## Side by side\n\nSource, copy and probe; below, their differences from the source on one scale, from black to yellow.\n";
    for (outcome, picture) in pairs.iter().filter_map(|outcome| Some((outcome, outcome.picture.as_ref()?))) {
        let Match { source, copy, probe, nrmsd, jod, .. } = &outcome.matches[picture.place];
        text += &format!(
            "\n![{source} beside copy and probe]({FOLDER}/{})\n\n`{source}`; copy `{copy}` (NRMSD {:.4}, {:.2} JOD); probe \
             `{probe}` (NRMSD {:.4}, {:.2} JOD); yellow is a difference of {:.3}.\n",
            picture.file, nrmsd.copy, jod.copy, nrmsd.probe, jod.probe, picture.scale
        );
    }
    text += "\n## Every material\n";
    run.pairs.iter().for_each(|outcome| text += &details(outcome));
    text
}

fn introduction(run: &Run) -> String {
    let mut renderers: Vec<&Renderer> = run.pairs.iter().flat_map(|outcome| &outcome.renderers).collect();
    renderers.sort_by(|a, b| a.name.cmp(&b.name));
    renderers.dedup_by(|a, b| a.name == b.name);
    let versions: Vec<String> = renderers.iter().map(|r| format!("{} {}", r.name, r.version)).collect();
    let Sampling { samples, most } = run.sampling;
    let mut text = format!(
        "# Real renderers to each other\n\nWritten by `lookmatch cross` ({}, seed {}) with {}.\n\n\
         A probe is searched in pictures of {} px with {samples} to {most} samples per pixel. It is judged under the reference scene's \
         environment in pictures of {} px with {} samples, whose noise the search never saw. *Copy* is what people do without a \
         probe: the same microfacet α, the same reflectance at normal incidence, the same colour of the body as it is written. \
         *Noise* is what two equal pictures with the noise of source and probe would have. NRMSD is that of the whole picture, \
         averaged over channels and materials. JOD is the prediction of ColorVideoVDP: 10 is no visible difference, 1 less is \
         seen by three observers of four ({VIEWING}). A probe counts as better or worse than the copy where their NRMSDs are further \
         apart than a twentieth of the noise.\n",
        run.program,
        run.seed,
        versions.join(", "),
        run.size,
        JUDGING.0,
        JUDGING.1
    );
    for renderer in renderers.iter().filter(|renderer| !renderer.approximations.is_empty()) {
        text += &format!("\n{} by its own account: {}\n", renderer.name, renderer.approximations.join(" "));
    }
    text
}

/// The columns of the first table.
fn cells(outcome: &Outcome) -> Vec<String> {
    let (nrmsd, jod) = (outcome.mean(|m| m.nrmsd), outcome.mean(|m| m.jod));
    let mut cells = vec![title(outcome), outcome.matches.len().to_string()];
    cells.extend([nrmsd.copy, nrmsd.probe, nrmsd.noise].map(|v| format!("{v:.4}")));
    cells.extend([jod.copy, jod.probe, jod.noise].map(|v| format!("{v:.2}")));
    cells.push(outcome.verdicts().map(|count| count.to_string()).join(" / "));
    cells.push(outcome.renders().to_string());
    cells.extend([outcome.waited_s(), outcome.own_s].map(|v| format!("{v:.0}")));
    cells
}

/// The same model in two renderers, there and back.
fn round_trips(checks: &[&Outcome]) -> String {
    let mut text = String::from(
        "\n## The same model in two renderers\n\nHere the right answer is known: that of the copy. The roughness is in the target's own \
         terms (Mitsuba's `alpha` is the square of Cycles' `roughness`), in steps of the lattice that was searched, with up to 4 times as many \
         samples; and the NRMSD of the probe as a multiple of the noise, which is 1 for equal materials. Undecided are those \
         matches that noise leaves no better than a neighbour's.\n\n| source to target | materials | step | steps off, at worst | NRMSD / \
         noise, mean | at worst | copy, mean | undecided |\n|---|---|---|---|---|---|---|---|\n",
    );
    for outcome in checks {
        let (Some((name, step)), Some(off)) = (&outcome.width, outcome.steps_off()) else { continue };
        let mean = outcome.mean(|m| m.nrmsd);
        text += &row(&[
            title(outcome),
            outcome.matches.len().to_string(),
            format!("`{name}` {step:.2}"),
            format!("{off:.2}"),
            format!("{:.3}", mean.probe / mean.noise),
            format!("{:.3}", outcome.noises()),
            format!("{:.3}", mean.copy / mean.noise),
            outcome.undecided.to_string(),
        ]);
    }
    text
}

/// Materials without the parameters that all of them share, and those.
fn apart<'a>(materials: &[&'a str]) -> (Vec<String>, String) {
    let parameters = |text: &'a str| -> Vec<&'a str> {
        text.rsplit_once(':').map_or(Vec::new(), |(_, list)| list.split(',').collect())
    };
    let lists: Vec<Vec<&str>> = materials.iter().map(|text| parameters(text)).collect();
    let is_shared = |parameter: &&&str| lists.iter().all(|list| list.contains(parameter));
    let shared: Vec<&str> = lists.first().into_iter().flatten().filter(is_shared).copied().collect();
    let own = |list: &Vec<&str>| {
        list.iter().filter(|p| !shared.contains(p)).copied().collect::<Vec<_>>().join(", ")
    };
    (lists.iter().map(own).collect(), shared.join(", "))
}

/// All materials of a pair, folded up.
fn details(outcome: &Outcome) -> String {
    let column = |text: fn(&Match) -> &String| {
        apart(&outcome.matches.iter().map(|m| text(m).as_str()).collect::<Vec<_>>())
    };
    let columns = [column(|m| &m.source), column(|m| &m.copy), column(|m| &m.probe)];
    let mut text = format!(
        "\n<details><summary>{} to {}: {} failed, {} undecided within noise</summary>\n",
        outcome.from, outcome.to, outcome.failed, outcome.undecided
    );
    for ((_, shared), whose) in columns.iter().zip(["sources", "copies", "probe's matches"]) {
        text += &format!("\nAll {whose} have {shared}.\n");
    }
    text += "\n| source | copy | probe | NRMSD: copy | probe | noise \
         | JOD: copy | probe | noise | on an edge |\n|---|---|---|---|---|---|---|---|---|---|\n";
    for (k, Match { saturated, nrmsd, jod, .. }) in outcome.matches.iter().enumerate() {
        let mut cells = columns.each_ref().map(|(own, _)| own[k].clone()).to_vec();
        cells.extend([nrmsd.copy, nrmsd.probe, nrmsd.noise].map(|v| format!("{v:.4}")));
        cells.extend([jod.copy, jod.probe, jod.noise].map(|v| format!("{v:.2}")));
        cells.push(saturated.join(", "));
        text += &row(&cells);
    }
    text + "\n</details>\n"
}

pub(super) fn summary(run: &Run) -> String {
    let titles = ["", "copy", "probe", "noise", "JOD", "", "", "better/same/worse", "renders", "s", "own s"];
    let mut rows = vec![titles.map(str::to_owned).to_vec()];
    for outcome in &run.pairs {
        let mut cells = cells(outcome);
        cells[0] = outcome.name.clone();
        cells.remove(1);
        rows.push(cells);
    }
    table(&rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_says_what_its_numbers_say() {
        let file = |name: &str| {
            std::fs::read_to_string(format!("{}/../../docs/results/{name}", env!("CARGO_MANIFEST_DIR")))
                .unwrap()
        };
        let run: Run = serde_json::from_str(&file("cross-renderer/cross-renderer.json")).unwrap();
        assert!(run.pairs.iter().any(Outcome::is_same_model));
        assert!(page(&run) == file("cross-renderer.md"), "write it with `lookmatch cross -o docs/results`");
    }
}
