//! The measurements as tables: aligned for a terminal, Markdown for a document.

use super::Report;
use super::accuracy::MaterialError;
use super::peer::{Comparison, PeerReport, Variant};
use crate::output::table;

/// A table with its heading, and a remark below it.
struct Section {
    title: &'static str,
    rows: Vec<Vec<String>>,
    remark: String,
}

/// The report for a terminal.
pub(crate) fn plain(report: &Report) -> String {
    let section = |s: Section| format!("{}\n{}{}", s.title, table(&s.rows), remark(&s.remark));
    sections(report).into_iter().map(section).collect::<Vec<_>>().join("\n")
}

fn remark(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("\n{text}\n") }
}

/// The report as a document.
pub(crate) fn markdown(report: &Report) -> String {
    let command = if report.peer.is_some() { " --peer mitsuba" } else { "" };
    let mut text = format!(
        "# Performance\n\nMade by `cargo run --release -- bench{command} --output docs/results/performance.md`, which \
         measures everything anew on the machine that it runs on and installs what it needs. Do not edit.\n"
    );
    for section in sections(report) {
        let rows: Vec<String> =
            section.rows.iter().map(|cells| format!("| {} |", cells.join(" | "))).collect();
        let rule = format!("|---|{}", "---:|".repeat(section.rows[0].len() - 1));
        text += &format!("\n## {}\n\n{}\n{rule}\n{}\n", section.title, rows[0], rows[1..].join("\n"));
        text += &remark(&section.remark);
    }
    text
}

fn sections(report: &Report) -> Vec<Section> {
    let mut sections = vec![summary(report)];
    sections.extend(report.peer.iter().flat_map(|peer| [peer_runs(peer), peer_summary(peer)]));
    sections.push(errors(report));
    sections.push(catalogue(report));
    sections.push(conditions(report));
    sections
}

fn rows<const N: usize>(header: [&str; N], body: impl IntoIterator<Item = [String; N]>) -> Vec<Vec<String>> {
    std::iter::once(header.map(str::to_owned)).chain(body).map(Vec::from).collect()
}

fn summary(report: &Report) -> Section {
    let (t, a) = (&report.timing, &report.accuracy);
    let row = |what: &str, value: String| [what.to_owned(), value];
    let body = [
        row("picture pair (point light, environment), one of a batch", ms(t.image_pair_cpu_ms)),
        row("picture pair on its own", ms(t.single_pair_cpu_ms)),
        row("metric: four pairs of pictures, CIELAB of both sides", ms(t.metric_ms)),
        row("metric: the same with the CIELAB of one side kept", ms(t.metric_cached_ms)),
        row(
            "preparing the scene under both lights",
            format!("{:.1} CPU s", report.preparation.prepare_cpu_s),
        ),
        row("mean ΔE*76 from converged pictures", delta_e(a.mean_delta_e)),
        row("… of the worst material", delta_e(a.worst_delta_e)),
        row("… root mean square, free of the converged pictures' noise", delta_e(a.rms_delta_e)),
        row("… of the converged pictures' noise alone", delta_e(a.noise_delta_e)),
    ];
    let remark = format!(
        "CPU time per picture of {0} × {0} pixels on one thread, from parameters to linear RGB of all the subject's \
         pixels, the light of the scene prepared; the fastest of {1} runs. A batch has {2} new materials. Preparing \
         is the CPU time of all threads, with nothing kept from before.",
        report.effort.size, report.effort.runs, report.effort.batch
    );
    Section { title: "Speed and accuracy", rows: rows(["", "measured"], body), remark }
}

fn errors(report: &Report) -> Section {
    let body = report.accuracy.materials.iter().map(|m: &MaterialError| {
        let [point, environment] = [&m.point, &m.environment];
        [
            m.name.clone(),
            delta_e(point.mean_delta_e),
            delta_e(point.noise_delta_e),
            delta_e(environment.mean_delta_e),
            delta_e(environment.noise_delta_e),
            percent(environment.relative_rmse),
        ]
    });
    let header = ["material", "point ΔE", "noise", "environment ΔE", "noise", "relative RMSE"];
    let remark = format!(
        "Mean ΔE*76 between our pictures and converged ones, the mean of two path traced pictures with {} paths per \
         pixel each and different random numbers; their own noise is given beside it and is part of the figures. \
         Measured on {} pixels spread evenly over the sphere, its silhouette included; full light transport on the \
         converged side.",
        report.effort.samples, report.effort.pixels
    );
    Section { title: "Errors by material", rows: rows(header, body), remark }
}

fn catalogue(report: &Report) -> Section {
    let body = report.models.iter().map(|m| {
        [
            format!("`{}`", m.material),
            if m.isotropic { "rings" } else { "direct integral" }.to_owned(),
            ms(m.image_pair_cpu_ms),
            delta_e(m.environment.mean_delta_e),
            delta_e(m.environment.noise_delta_e),
        ]
    });
    let header = ["material", "path", "picture pair, one of a batch", "environment ΔE", "noise"];
    let remark = "Every model with its default parameters, then some that cost more. Whatever is isotropic goes through the \
                  rings, be it a lobe or a diffuse reflection that is not Lambert's; what is not is integrated directly, \
                  and in single pictures."
        .to_owned();
    Section { title: "Every model", rows: rows(header, body), remark }
}

fn peer_runs(peer: &PeerReport) -> Section {
    let body =
        peer.comparisons.iter().flat_map(|c| c.runs.iter().map(move |run| (c, run))).map(|(c, run)| {
            [
                c.name.clone(),
                run.samples.to_string(),
                format!("{:.2}", run.cpu_s),
                format!("{:.2}", run.wall_s),
                percent(run.relative_rmse),
                delta_e(run.mean_delta_e),
            ]
        });
    let variant = |v: &Variant| format!("{} {:.2} CPU s at {} samples", v.name, v.cpu_s, v.samples);
    let variants: Vec<String> = peer.variants.iter().map(variant).collect();
    let remark = format!(
        "{} {}, variant {} (tried: {}), sampler {}, path integrator with all bounces, box filter, pictures under the \
         environment. CPU time is that of all threads for the faster of two pictures; compilation falls to the other. The \
         error is noise alone, as seen between the two. {} pictures were rendered.",
        peer.name,
        peer.version,
        peer.variant,
        variants.join(", "),
        peer.sampler,
        peer.images
    );
    let header = ["material", "samples per pixel", "CPU s", "wall s", "relative RMSE", "mean ΔE"];
    Section { title: "The peer", rows: rows(header, body), remark }
}

/// A line of the table at equal error: what it says, and how to find it.
type Line = (&'static str, fn(&Comparison) -> String);

const AT_EQUAL_ERROR: [Line; 14] = [
    ("our relative RMSE, the converged picture's noise included", |c| percent(c.ours.relative_rmse)),
    ("… of that noise alone", |c| percent(c.ours.relative_noise)),
    ("our mean ΔE", |c| delta_e(c.ours.mean_delta_e)),
    ("our CPU time, one of a batch", |c| ms(c.cost.image_cpu_ms)),
    ("our CPU time, on its own", |c| ms(c.cost.single_image_cpu_ms)),
    ("the peer's error falls with its samples to the power of", |c| format!("{:.2}", c.equal.exponent)),
    ("the peer's samples per pixel for our RMSE", |c| format!("{:.0}", c.equal.equal_error_samples)),
    ("the peer's CPU time for our RMSE", |c| format!("{:.0} s", c.equal.equal_error_cpu_s)),
    ("ratio at equal RMSE, one of a batch", |c| ratio(c.equal.equal_error_ratio)),
    ("ratio at equal RMSE, on its own", |c| ratio(c.equal.equal_error_ratio_single)),
    ("ratio at equal RMSE with the measured power", |c| ratio(c.equal.equal_error_ratio_measured_exponent)),
    ("ratio at equal mean ΔE, one of a batch", |c| ratio(c.equal.equal_delta_e_ratio)),
    ("bias in brightness", |c| format!("{:+.3} %", 100.0 * c.bias.brightness)),
    ("bias, root mean square ΔE (that of chance)", |c| {
        format!("{} ({})", delta_e(c.bias.rms_delta_e), delta_e(c.bias_threshold))
    }),
];

fn peer_summary(peer: &PeerReport) -> Section {
    let cells = |name: &str, value: fn(&Comparison) -> String| -> Vec<String> {
        std::iter::once(name.to_owned()).chain(peer.comparisons.iter().map(value)).collect()
    };
    let header = cells("", |c| c.name.clone());
    let body = AT_EQUAL_ERROR.iter().map(|(name, value)| cells(name, *value));
    let remark = "The ratio is the peer's CPU time for a picture with our error over our CPU time for it. Errors below those \
                  of the table above are extrapolated with the square root of the number of samples (or with the \
                  measured power, as if the gain of stratified samples lasted for ever). The peer's error is its noise \
                  alone: what separates its converged pictures from our path tracer's (bias) is not held against it."
        .to_owned();
    Section { title: "At equal error", rows: std::iter::once(header).chain(body).collect(), remark }
}

fn conditions(report: &Report) -> Section {
    let m = &report.machine;
    let row = |what: &str, value: String| [what.to_owned(), value];
    let scene = &report.scene;
    let mut body = vec![
        row("processor", m.cpu.clone()),
        row("cores", m.cores.to_string()),
        row("instruction set", m.instruction_set.to_owned()),
        row("system", m.system.clone()),
        row("lookmatch", report.version.to_owned()),
        row(
            "scene",
            format!(
                "{} ({} sphere, checkerboard, point light, environment map)",
                scene.name,
                scene.spheres.len()
            ),
        ),
        row("picture", format!("{0} × {0} pixels", report.effort.size)),
        row("materials", report.accuracy.materials.len().to_string()),
    ];
    if let Some(peer) = &report.peer {
        body.push(row("peer", format!("{} {}", peer.name, peer.version)));
        body.push(row("LLVM of the peer", peer.llvm.clone().unwrap_or_else(|| "none".into())));
    }
    Section { title: "Conditions", rows: rows(["", ""], body), remark: String::new() }
}

fn ms(value: f64) -> String {
    format!("{value:.3} ms")
}

fn delta_e(value: f64) -> String {
    format!("{value:.3}")
}

fn percent(value: f64) -> String {
    format!("{:.3} %", 100.0 * value)
}

/// Two digits are more than an extrapolation holds.
fn ratio(value: f64) -> String {
    format!("{value:.1e}")
}
