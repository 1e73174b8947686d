//! `material.json`: which maps and which numbers make the target material.

use std::path::Path;

use lookmatch_materials::{Material, Value};
use lookmatch_remap::Probe;
use serde::Serialize;
use serde_json::{Map as JsonMap, Value as Json, json};

use crate::bake::Baked;
use crate::convert::{Texture, is_srgb};
use crate::encoding::Encoding;
use crate::files::Format;
use crate::udim::map_name;

/// What was made, as `material.json` says it.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// `lookmatch-material`.
    pub format: &'static str,
    /// Version of this description.
    pub version: u32,
    /// The target model.
    pub model: String,
    /// By target parameter: a number, or a map with its file name, channels, encoding and range. Parameters that are the same for
    /// all texels are numbers and have no map.
    pub parameters: JsonMap<String, Json>,
    /// UDIM tiles; empty where there are none.
    pub tiles: Vec<u32>,
    /// Width and height of each tile, or of the maps.
    pub size: Vec<[usize; 2]>,
    /// The source: its model, textures and numbers.
    pub source: Json,
    /// Largest error of interpolated carried-over values, as a share of the range that they have.
    pub interpolation_error: f64,
    /// What was taken for granted, moved or left out.
    pub notes: Vec<String>,
}

impl Report {
    /// Target parameters with a map: the map's file name (`<UDIM>` for the tile) and the parameter.
    pub fn maps(&self) -> Vec<(&str, &str)> {
        let maps =
            self.parameters.iter().filter_map(|(name, v)| Some((v["texture"].as_str()?, name.as_str())));
        maps.collect()
    }

    /// Target parameters that are the same for all texels.
    pub fn constants(&self) -> Vec<(&str, &Json)> {
        let constants = self.parameters.iter().filter(|(_, v)| !v.is_object());
        constants.map(|(name, v)| (name.as_str(), v)).collect()
    }
}

fn plain(value: &Value) -> Json {
    match value {
        Value::Number(v) => json!(v),
        Value::Colour(c) => json!(c),
        Value::List(v) => json!(v.to_vec()),
        Value::Choice(name) => json!(name),
        Value::File(file) => json!(&*file.path),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

pub(crate) fn report(
    probe: &Probe,
    base: &Material,
    baked: &Baked,
    textures: &[Texture],
    formats: &[Format],
    sizes: &[(usize, usize)],
    notes: Vec<String>,
) -> Report {
    let model = probe.to.model();
    let tiles: Vec<u32> = textures[0].tiles.keys().copied().flatten().collect();
    let mut parameters = JsonMap::new();
    for parameter in model.parameters {
        let constant = baked.constants.iter().find(|(name, _)| *name == parameter.name);
        if let Some((name, value)) = constant {
            parameters.insert((*name).to_owned(), plain(value));
        }
        let maps = baked.maps.iter().zip(formats);
        for (map, format) in maps.filter(|(map, _)| map.parameters.contains(&parameter.name)) {
            let extension = format.container.extension();
            let name = map_name(&map.name, None, extension);
            let name = if tiles.is_empty() { name } else { format!("{}.<UDIM>.{extension}", map.name) };
            let encoding =
                if is_srgb(baked, textures, map, *format) { Encoding::Srgb } else { Encoding::Linear };
            let entry = json!({
                "texture": name, "channels": map.channels, "format": format.name(), "encoding": encoding,
                "from": baked.inputs_of(map).iter().map(|i| &i.name).collect::<Vec<_>>(),
            });
            parameters.insert(parameter.name.to_owned(), entry);
        }
    }
    let mut source = JsonMap::new();
    source.insert("model".into(), base.model().name.into());
    for (parameter, value) in base.model().parameters.iter().zip(base.values()) {
        source.insert(parameter.name.into(), plain(value));
    }
    for (input, texture) in baked.inputs.iter().zip(textures) {
        for index in base.model().resolve(&input.name).unwrap_or_default() {
            let files: Vec<String> = texture.tiles.values().map(|p| file_name(p)).collect();
            let entry = json!({ "textures": files, "encoding": texture.encoding, "format": texture.header.format.name() });
            let mut entry = entry;
            if let Some(channel) = texture.channel {
                entry["channel"] = format!("{channel:?}").into();
            }
            source.insert(base.model().parameters[index].name.into(), entry);
        }
    }
    Report {
        format: "lookmatch-material",
        version: 1,
        model: model.name.to_owned(),
        parameters,
        tiles,
        size: sizes.iter().map(|(w, h)| [*w, *h]).collect(),
        source: Json::Object(source),
        interpolation_error: baked.error(),
        notes,
    }
}
