//! `lookmatch models`: the catalogue, from the models' own descriptions.

use lookmatch_materials::{Family, Kind, Model, Named, Parameter, Preset, by_name, registry};
use serde_json::json;

use crate::args::ModelsArgs;
use crate::commands::interruption;
use crate::output::{print, print_json, table};
use crate::renderers::{Renderers, renderer_of};

pub(crate) fn run(args: &ModelsArgs) -> anyhow::Result<()> {
    if args.markdown {
        return print(&markdown());
    }
    let models = match &args.model {
        Some(name) => named(args, name)?,
        None => registry().to_vec(),
    };
    if args.json.json {
        let models: Vec<_> = models.iter().map(|m| json!({ "model": m, "presets": (m.presets)() })).collect();
        let flat = models.into_iter().map(|mut entry| {
            let mut model = entry["model"].take();
            model["presets"] = entry["presets"].take();
            model
        });
        return print_json(&flat.collect::<Vec<_>>());
    }
    let all: Vec<String> = models.iter().map(|m| describe(m)).collect();
    let presets = args.model.as_ref().map_or(String::new(), |_| preset_list(models[0]));
    print(&(all.join("\n") + &presets))
}

/// The model of a name, or all of another renderer: `mitsuba:`. Other renderers are started, and say themselves what they have.
fn named(args: &ModelsArgs, name: &str) -> anyhow::Result<Vec<&'static Model>> {
    let Some(renderer) = renderer_of(name).or(name.strip_suffix(':').map(str::to_owned)) else {
        return Ok(vec![by_name(name)?]);
    };
    let renderers = Renderers::start(&[renderer], &args.renderers, &interruption()?)?;
    if name.ends_with(':') { renderers.models() } else { Ok(vec![by_name(name)?]) }
}

fn describe(model: &Model) -> String {
    let mut text = format!("{}  {}\n", model.name, model.title);
    for line in [model.summary, model.reference].into_iter().filter(|line| !line.is_empty()) {
        text += &format!("  {line}\n");
    }
    let rows: Vec<Vec<String>> = model.parameters.iter().map(row).collect();
    for line in table(&rows).lines() {
        text += &format!("    {line}\n");
    }
    for alias in model.aliases {
        text += &format!("    {} sets {}\n", alias.name, alias.parameters.join(" and "));
    }
    for named in model.named {
        text +=
            &format!("    {}=NAME sets {}: {}\n", named.name, named.parameters.join(" and "), words(named));
    }
    text += &format!("    {}\n", roles(model));
    if let Some((count, example)) = presets(model) {
        text += &format!("    {count} presets, for instance {}@{example}\n", model.name);
    }
    text
}

fn row(parameter: &Parameter) -> Vec<String> {
    let (values, default) = values(parameter);
    vec![parameter.name.to_owned(), parameter.role.title().to_owned(), values, format!("default {default}")]
}

/// Accepted values and the default, in words.
fn values(parameter: &Parameter) -> (String, String) {
    let grey = |c: [f64; 3]| {
        if c[0] == c[1] && c[1] == c[2] { c[0].to_string() } else { c.map(|v| v.to_string()).join("/") }
    };
    let list = |v: &[f64]| v.iter().map(f64::to_string).collect::<Vec<_>>().join("/");
    match &parameter.kind {
        Kind::Number { range, default } => (format!("in {}", range.valid), default.to_string()),
        Kind::Colour { range, default } => (format!("RGB in {}", range.valid), grey(*default)),
        Kind::List { range, default } => (format!("one per lobe in {}", range.valid), list(default)),
        Kind::Choice { options } if options.len() > MANY => {
            (format!("one of {}: {}, ...", options.len(), options[..2].join(", ")), options[0].to_owned())
        }
        Kind::Choice { options } => (options.join(" | "), options[0].to_owned()),
        Kind::File { content } => (format!("a file: {content}"), "none".to_owned()),
    }
}

/// Choices that are not all printed.
const MANY: usize = 12;

fn words(named: &Named) -> String {
    (named.words)().join(", ")
}

/// What the model is good for in a remap.
fn roles(model: &Model) -> String {
    let source = match model.surveyed {
        [] => "as a source it is one material".to_owned(),
        axes => format!("as a source it is tabulated over {}", axes.join(" and ")),
    };
    let target = match model.searched {
        [] => "it is no target".to_owned(),
        axes => format!("as a target it is searched over {}", axes.join(", ")),
    };
    let linear = match model.linear {
        [] => String::new(),
        names => format!("; it is linear in {}", names.join(", ")),
    };
    format!("{source}; {target}{linear}")
}

/// How many presets a model has, and the first of them.
fn presets(model: &Model) -> Option<(usize, &'static str)> {
    let presets = (model.presets)();
    presets.first().map(|first| (presets.len(), first.name.as_str()))
}

fn preset_list(model: &Model) -> String {
    let line = |preset: &Preset| {
        let values: Vec<String> =
            preset.values.iter().map(|(name, value)| format!("{name}={value}")).collect();
        format!("  {}@{}  {}\n", model.name, preset.name, values.join(","))
    };
    (model.presets)().iter().map(line).collect()
}

/// The catalogue as a page.
fn markdown() -> String {
    let mut text = String::from(HEAD);
    for model in registry() {
        text += &format!(
            "| [`{}`](#{}) | {} | {} | {} | {} | {} |\n",
            model.name,
            model.name,
            model.title,
            if model.is_reciprocal { "yes" } else { "no" },
            model.largest_albedo,
            codes(model.surveyed, "one material"),
            codes(model.searched, "no target"),
        );
    }
    for (family, title) in [
        (Family::Classic, "Models of the literature"),
        (Family::Production, "Models of today's pipelines"),
        (Family::Measured, "Measured materials"),
    ] {
        text += &format!("\n## {title}\n");
        registry().iter().filter(|m| m.family == family).for_each(|m| text += &page(m));
    }
    text
}

const HEAD: &str = "\
# Models

Written by `lookmatch models --markdown`; a test keeps it current. Ranges are what is accepted; *plausible* is where real
materials lie. Colours are linear RGB; one number stands for grey. A material is written
`MODEL[@PRESET][:NAME=VALUE,...]`, for instance `ward:specular=0.1,roughness=0.2`.

*Albedo at most* is the largest directional albedo over plausible parameters, with formulas as they are by default: 1 where no
more light leaves than arrives. Most others add a specular lobe to an uncoupled diffuse term, and exceed 1 where both are bright;
each model's own file says more. Tests hold these figures against random materials.

| model | | reciprocal | albedo at most | as a source: tabulated over | as a target: searched over |
|---|---|---|---|---|---|
";

fn codes(names: &[&str], none: &str) -> String {
    let codes: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    if codes.is_empty() { none.to_owned() } else { codes.join(", ") }
}

fn page(model: &Model) -> String {
    let mut text =
        format!("\n### {}\n\n**{}.** {} *{}.*\n\n", model.name, model.title, model.summary, model.reference);
    text += "| parameter | | role | values | plausible | default | |\n|---|---|---|---|---|---|---|\n";
    for parameter in model.parameters {
        let (values, default) = values(parameter);
        let plausible = parameter.range().map_or(String::new(), |range| range.plausible.to_string());
        text += &format!(
            "| `{}` | {} | {} | {} | {plausible} | {default} | {} |\n",
            parameter.name,
            parameter.symbol,
            parameter.role.title(),
            values.replace('|', "\\|"),
            parameter.summary,
        );
    }
    let aliases =
        model.aliases.iter().map(|alias| format!("`{}` sets {}.", alias.name, codes(alias.parameters, "")));
    let named = model.named.iter().map(|n| {
        format!("`{}` sets {} by name: {}. {}", n.name, codes(n.parameters, ""), words(n), n.summary)
    });
    let presets = presets(model).map(|(count, example)| {
        let mut sources: Vec<&str> = (model.presets)().iter().map(|p| p.source).collect();
        sources.dedup();
        format!("{count} presets, for instance `{}@{example}`: {}", model.name, sources.join("; "))
    });
    let notes: Vec<String> = aliases.chain(named).chain(presets).collect();
    if !notes.is_empty() {
        text += &format!("\n{}\n", notes.join("\n"));
    }
    text
}
