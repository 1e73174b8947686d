//! `lookmatch lint`: what is probably wrong with a material's numbers.

use anyhow::Context;
use lookmatch_materials::lint::{Certainty, Finding, Given, Reading, lint, suggestion};
use lookmatch_remap::{Explanation, Stage, Tried, explain};
use serde_json::json;

use crate::Usage;
use crate::args::LintArgs;
use crate::commands::material;
use crate::output::{print, print_json, score};
use crate::renderers::only_ours;
use crate::transport::{Preparation, cache};

/// Sides of pictures that can be compared: smaller ones show no highlight.
const SIZES: std::ops::RangeInclusive<usize> = 16..=1024;

pub(crate) fn run(args: &LintArgs) -> anyhow::Result<()> {
    if !SIZES.contains(&args.size) {
        return Err(
            Usage(format!("pictures of {} pixels cannot be compared; use {SIZES:?}", args.size)).into()
        );
    }
    args.like.iter().chain([&args.material]).try_for_each(|text| only_ours("lint", text))?;
    let given = given(&args.material)?;
    let like = args.like.as_deref().map(material).transpose()?;
    let findings = lint(&given);
    let suggested = suggestion(&given, &findings);
    let explanation = match &like {
        Some(like) => {
            let preparation = Preparation::of("the reference scene");
            let observe = |progress| preparation.observe(progress);
            let stage = Stage::reference(args.size, &cache(), &observe)?;
            preparation.finish();
            Some(explain(&stage, &given, like)?)
        }
        None => None,
    };
    if args.json.json {
        return print_json(&json!({
            "material": given.text_with(&[]), "findings": findings, "suggestion": suggested,
            "like": like, "explanation": explanation,
        }));
    }
    let mut text: String = findings.iter().map(finding).collect();
    if let Some(suggested) = suggested {
        text += &format!("suggested: {suggested}\n");
    }
    if findings.is_empty() {
        text += "nothing suspicious in the numbers\n";
    }
    text += &explanation.iter().map(explained).collect::<String>();
    print(&text)
}

/// A material as it was written: text, JSON, or a .json file.
fn given(text: &str) -> anyhow::Result<Given> {
    if text.ends_with(".json") && !text.trim_start().starts_with('{') {
        let content =
            std::fs::read_to_string(text).with_context(|| format!("cannot read material file '{text}'"))?;
        return Given::parse(&content).with_context(|| format!("material file '{text}'"));
    }
    Ok(Given::parse(text)?)
}

fn finding(finding: &Finding) -> String {
    let certainty = match finding.certainty {
        Certainty::Certain => "wrong",
        Certainty::Likely => "probably wrong",
        Certainty::Possible => "perhaps wrong",
    };
    let Finding { rule, parameter, value, why, fixes, .. } = finding;
    let mut text = format!("{parameter} = {value}: {certainty} ({rule})\n  {why}\n");
    for (k, fix) in fixes.iter().enumerate() {
        let lead = if k == 0 { "fix:" } else { "or:" };
        text += &format!("  {lead:<4} {} ({})\n", assignments(fix), fix.says);
    }
    text
}

fn assignments(reading: &Reading) -> String {
    let pair = |(name, value): &(String, String)| format!("{name}={value}");
    reading.values.iter().map(pair).collect::<Vec<_>>().join(",")
}

fn explained(explanation: &Explanation) -> String {
    let measures = |t: &Tried| format!("NRMSD {}, fitness {}", score(t.nrmsd), score(t.fitness));
    let mut text = match &explanation.given {
        Some(given) => format!("as given, the difference is {}\n", measures(given)),
        None => "as given, it cannot be rendered\n".to_owned(),
    };
    if explanation.is_alike {
        return text + "it looks like the reference\n";
    }
    let Some(best) = explanation.explanations.first() else {
        return text
            + &format!("none of {} other readings of its numbers explains that\n", explanation.tried);
    };
    for tried in &explanation.explanations {
        let reading = |r: &Reading| format!("{} ({})", assignments(r), r.says);
        let readings: Vec<String> = tried.readings.iter().map(reading).collect();
        text += &format!("  with {}: {}\n", readings.join(" and "), measures(tried));
    }
    text + &format!("suggested by the pictures: {}\n", best.material)
}
