//! `lookmatch models`: the catalogue.

use lookmatch_materials::{Kind, Model, Parameter, registry};

use crate::args::ModelsArgs;
use crate::output::{print, print_json, table};

pub(crate) fn run(args: &ModelsArgs) -> anyhow::Result<()> {
    if args.json.json {
        return print_json(&registry());
    }
    let text: Vec<String> = registry().iter().map(|m| describe(m)).collect();
    print(&text.join("\n"))
}

fn describe(model: &Model) -> String {
    let mut text = format!("{}  {}\n  {}\n  {}\n", model.name, model.title, model.summary, model.reference);
    let rows: Vec<Vec<String>> = model.parameters.iter().map(row).collect();
    for line in table(&rows).lines() {
        text += &format!("    {line}\n");
    }
    for alias in model.aliases {
        text += &format!("    {} sets {}\n", alias.name, alias.parameters.join(" and "));
    }
    text
}

fn row(parameter: &Parameter) -> Vec<String> {
    let grey = |c: [f64; 3]| {
        if c[0] == c[1] && c[1] == c[2] { c[0].to_string() } else { c.map(|v| v.to_string()).join("/") }
    };
    let list = |v: &[f64]| v.iter().map(f64::to_string).collect::<Vec<_>>().join("/");
    let (values, default) = match &parameter.kind {
        Kind::Number { range, default } => (format!("in {}", range.valid), default.to_string()),
        Kind::Colour { range, default } => (format!("RGB in {}", range.valid), grey(*default)),
        Kind::List { range, default } => (format!("one per lobe in {}", range.valid), list(default)),
        Kind::Choice { options } => (options.join(" | "), options[0].to_owned()),
        Kind::File { content } => (content.to_string(), "none".to_owned()),
    };
    vec![parameter.name.to_owned(), parameter.role.title().to_owned(), values, format!("default {default}")]
}
