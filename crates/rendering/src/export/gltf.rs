//! glTF 2.0: binary triangles, a camera, and point lights by KHR_lights_punctual; it has no environment.
//!
//! A light's intensity there is in candela, lm/sr. Renderers take the number as it is, so the W/sr are written as they are;
//! importers that turn lumens into watts (Blender: divide by 683 unless "unitless" is chosen) must be told not to. Colours
//! are linear. Texture coordinates grow downwards. A rough dielectric still reflects 4 % there: the checks are Lambertian
//! by KHR_materials_specular.

use serde_json::{Value, json};

use super::tessellation::{Mesh, SEGMENTS, meshes};
use super::{Exported, File, hue_and_strength};
use crate::SceneError;

/// The binary file's name.
const BUFFER: &str = "scene.bin";
/// Component types and buffer targets of the specification.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

pub(super) fn notes(_: &Exported) -> String {
    format!(
        "scene.gltf has no environment, because glTF has none: load environment.exr in your renderer, in the orientation above.
The point light's intensity is the number of W/sr, in glTF's candela (lm/sr), with its hue in the colour: three.js and
most viewers take it as it is. Blender's importer turns lumens into watts unless its lighting mode is \"Unitless\".
Your material goes where \"subject\" stands. The checks are Lambertian: metallic 0, roughness 1, and no specular reflection
by KHR_materials_specular; a viewer without that extension shows a faint sheen.
Spheres are meshes of {SEGMENTS} x {} segments with normals and texture coordinates (u eastwards).
",
        SEGMENTS / 2
    )
}

pub(super) fn write(exported: &Exported) -> Result<Vec<File>, SceneError> {
    let meshes = meshes(exported)?;
    let mut buffer = Buffer::default();
    let materials = materials(exported);
    let index_of = |name: &str| materials.iter().position(|m| m["name"] == name);
    let described: Vec<Value> =
        meshes.iter().map(|mesh| buffer.mesh(mesh, index_of(&mesh.material))).collect();

    let mut nodes: Vec<Value> =
        meshes.iter().enumerate().map(|(k, mesh)| json!({"name": mesh.name, "mesh": k})).collect();
    nodes.push(json!({"name": "camera", "camera": 0, "matrix": exported.camera_to_world().as_flattened()}));
    let lights = exported.scene.point_lights.iter().enumerate();
    nodes.extend(lights.map(|(k, light)| {
        json!({
            "name": format!("point{}", k + 1), "translation": light.position,
            "extensions": {"KHR_lights_punctual": {"light": k}},
        })
    }));
    let document = json!({
        "asset": {"version": "2.0", "generator": "lookmatch"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_specular"],
        "scene": 0,
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
        "cameras": [{"type": "perspective", "perspective": {
            "yfov": exported.camera().vertical_fov.to_radians(), "aspectRatio": 1.0, "znear": 0.001, "zfar": 10000.0,
        }}],
        "extensions": {"KHR_lights_punctual": {"lights": lights_of(exported)}},
        "materials": materials,
        "meshes": described,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"uri": BUFFER, "byteLength": buffer.bytes.len()}],
    });
    Ok(vec![File::new("scene.gltf", format!("{document:#}\n")), File::new(BUFFER, buffer.bytes)])
}

fn lights_of(exported: &Exported) -> Vec<Value> {
    let light = |light: &crate::PointLight| {
        let (hue, strength) = hue_and_strength(light.intensity);
        json!({"type": "point", "color": hue, "intensity": strength})
    };
    exported.scene.point_lights.iter().map(light).collect()
}

fn materials(exported: &Exported) -> Vec<Value> {
    let subjects = exported.subject_materials().into_iter().map(|(name, [r, g, b])| {
        json!({"name": name, "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5,
        }})
    });
    let checks = exported.scene.plane.iter().flat_map(|p| [("light", p.light), ("dark", p.dark)]);
    let checks = checks.map(|(name, [r, g, b])| {
        json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0,
            },
            "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}},
        })
    });
    subjects.chain(checks).collect()
}

/// The binary file and what describes it. All data are four bytes wide, so that everything is aligned.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    fn mesh(&mut self, mesh: &Mesh, material: Option<usize>) -> Value {
        let texture: Vec<[f64; 2]> = mesh.texture.iter().map(|[u, v]| [*u, 1.0 - v]).collect();
        let position = self.floats(&mesh.positions, "VEC3", true);
        let attributes = json!({
            "POSITION": position,
            "NORMAL": self.floats(&mesh.normals, "VEC3", false),
            "TEXCOORD_0": self.floats(&texture, "VEC2", false),
        });
        let view =
            self.view(mesh.triangles.as_flattened().iter().map(|i| i.to_le_bytes()), ELEMENT_ARRAY_BUFFER);
        let count = 3 * mesh.triangles.len();
        let indices = self.accessor(
            json!({"bufferView": view, "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR"}),
        );
        json!({
            "name": mesh.name,
            "primitives": [{"attributes": attributes, "indices": indices, "material": material}],
        })
    }

    fn floats<const N: usize>(&mut self, vectors: &[[f64; N]], kind: &str, bounded: bool) -> usize {
        let values = vectors.as_flattened().iter().map(|v| (*v as f32).to_le_bytes());
        let view = self.view(values, ARRAY_BUFFER);
        let mut accessor =
            json!({"bufferView": view, "componentType": FLOAT, "count": vectors.len(), "type": kind});
        if bounded {
            // Of the single-precision numbers, exactly: validators compare.
            let extreme = |c: usize, pick: fn(f32, f32) -> f32| {
                vectors.iter().map(|v| v[c] as f32).reduce(pick).unwrap_or_default()
            };
            accessor["min"] = json!((0..N).map(|c| extreme(c, f32::min)).collect::<Vec<_>>());
            accessor["max"] = json!((0..N).map(|c| extreme(c, f32::max)).collect::<Vec<_>>());
        }
        self.accessor(accessor)
    }

    fn view(&mut self, words: impl Iterator<Item = [u8; 4]>, target: u32) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(words.flatten());
        let length = self.bytes.len() - offset;
        self.views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": length, "target": target}));
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    fn written(scene: &Scene) -> (Value, Vec<u8>) {
        let files = write(&Exported { scene, size: 48, rotation: 0.0 }).unwrap();
        (serde_json::from_slice(&files[0].content).unwrap(), files[1].content.clone())
    }

    #[test]
    fn accessors_lie_within_the_buffer_and_hold_what_they_say() {
        let (document, bytes) = written(&Scene::spheres());
        let list = |name: &str| document[name].as_array().unwrap().clone();
        assert_eq!(document["buffers"][0]["byteLength"], bytes.len());
        let mut end = 0;
        for view in list("bufferViews") {
            assert_eq!(view["byteOffset"], end, "views follow each other");
            end += view["byteLength"].as_u64().unwrap();
        }
        assert_eq!(end, bytes.len() as u64);
        for mesh in list("meshes") {
            let primitive = &mesh["primitives"][0];
            assert!(primitive["material"].as_u64().unwrap() < list("materials").len() as u64);
            let accessor = |k: &Value| &document["accessors"][k.as_u64().unwrap() as usize];
            let (positions, indices) =
                (accessor(&primitive["attributes"]["POSITION"]), accessor(&primitive["indices"]));
            let words = |accessor: &Value| -> Vec<[u8; 4]> {
                let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
                let [offset, length] =
                    ["byteOffset", "byteLength"].map(|n| view[n].as_u64().unwrap() as usize);
                bytes[offset..offset + length].chunks(4).map(|b| b.try_into().unwrap()).collect()
            };
            let count = positions["count"].as_u64().unwrap();
            let indices: Vec<u32> = words(indices).into_iter().map(u32::from_le_bytes).collect();
            assert!(indices.iter().all(|i| u64::from(*i) < count));
            let heights: Vec<f32> =
                words(positions).into_iter().skip(1).step_by(3).map(f32::from_le_bytes).collect();
            assert_eq!(heights.len() as u64, count);
            assert_eq!(heights.iter().copied().reduce(f32::min).map(f64::from), positions["min"][1].as_f64());
            assert_eq!(heights.iter().copied().reduce(f32::max).map(f64::from), positions["max"][1].as_f64());
        }
    }

    #[test]
    fn lights_and_camera_are_converted() {
        let mut scene = Scene::reference();
        scene.point_lights[0].intensity = [10.0, 40.0, 20.0];
        let (document, _) = written(&scene);
        let light = &document["extensions"]["KHR_lights_punctual"]["lights"][0];
        assert_eq!((&light["intensity"], &light["color"]), (&json!(40.0), &json!([0.25, 1.0, 0.5])));
        let yfov = document["cameras"][0]["perspective"]["yfov"].as_f64().unwrap();
        assert!((yfov.to_degrees() - 28.0).abs() < 1e-12);
        let camera = document["nodes"].as_array().unwrap().iter().find(|n| n["name"] == "camera").unwrap();
        assert_eq!(
            camera["matrix"].as_array().unwrap()[12..],
            [json!(0.0), json!(1.5), json!(6.0), json!(1.0)]
        );
    }
}
