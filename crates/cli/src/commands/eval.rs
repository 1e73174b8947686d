//! `lookmatch eval`: BRDF values at the points of a conformance file.

use anyhow::Context;
use lookmatch_materials::conformance;
use serde::Deserialize;
use serde_json::{Map, Value as Json, json};

use crate::args::EvalArgs;
use crate::output::{print, print_json};
use crate::renderers::only_ours;

#[derive(Deserialize)]
struct Vectors {
    brdf: Vec<Vector>,
}

#[derive(Deserialize)]
struct Vector {
    id: Json,
    model: String,
    params: Map<String, Json>,
    wi: [f64; 3],
    wo: [f64; 3],
}

pub(crate) fn run(args: &EvalArgs) -> anyhow::Result<()> {
    let name = args.vectors.display();
    let text = std::fs::read_to_string(&args.vectors).with_context(|| format!("cannot read '{name}'"))?;
    let vectors: Vectors =
        serde_json::from_str(&text).with_context(|| format!("'{name}' is no file of conformance vectors"))?;
    // A model that is not known has no value; one of another renderer is no formula that could be tested.
    vectors.brdf.iter().try_for_each(|vector| only_ours("eval", &vector.model))?;
    let values: Vec<Json> = vectors.brdf.iter().map(evaluate).collect();
    if args.json.json {
        return print_json(&json!({ "brdf": values }));
    }
    let lines: Vec<String> = values.iter().map(|v| format!("{}\t{}\n", v["id"], v["f"])).collect();
    print(&lines.concat())
}

/// The value of one vector; null where the model is not known.
fn evaluate(vector: &Vector) -> Json {
    let value = conformance::bsdf(&vector.model, &vector.params).and_then(|bsdf| {
        let f = bsdf.evaluate(vector.wi, vector.wo);
        // Models of one channel have one number; what is no direction has no value.
        let value = if f[0] == f[1] && f[1] == f[2] { json!(f[0]) } else { json!(f) };
        f.iter().all(|v| v.is_finite()).then_some(value)
    });
    json!({ "id": vector.id, "f": value })
}
