//! USD as text: UsdGeom meshes, UsdLux lights behind a variant, UsdPreviewSurface materials.
//!
//! A `SphereLight` has a radiance, not an intensity. With `normalize` the number is divided by the sphere's surface, 4πr², and a
//! sphere of radiance L sends πr²L in every direction: so `intensity` is four times the W/sr, for any radius. `treatAsPoint`
//! asks for a true point. A `DomeLight`'s latitude-longitude map is that of the OpenEXR documentation (longitude 0 in the
//! middle at +Z, longitude π/2 at +X a quarter from the left): ours. Our rotation is a turn about Y of the opposite sign.
//! Apertures are in tenths of the stage's unit, and only their ratio to the focal length counts.

use std::fmt::Write;

use super::tessellation::{Mesh, SEGMENTS, meshes};
use super::{ENVIRONMENT, Exported, File, hue_and_strength, listed};
use crate::{PointLight, SceneError};

/// Of the spheres that stand for point lights where a renderer has none, in metres.
const LIGHT_RADIUS: f64 = 0.005;
/// Height and width of the film, in tenths of a metre.
const APERTURE: f64 = 0.36;

pub(super) fn notes(_: &Exported) -> String {
    format!(
        "scene.usda: set the variant \"light\" of /World/Lights to point or environment. Your material goes where
/World/Materials/subject stands (a UsdPreviewSurface). Checks are Lambertian: their UsdPreviewSurface has no specular
reflectance; where your renderer still shows a sheen at grazing angles, give them its own diffuse material.
Spheres are meshes of {SEGMENTS} x {} segments without subdivision, with normals and st (s eastwards, t northwards).
Point lights are SphereLights with treatAsPoint, normalize and intensity = 4 x W/sr, after UsdLux: intensity / (4 pi r^2) is
the radiance of a sphere whose radiant intensity is pi r^2 times that. Renderers differ here; check with the grey card above.
The map has the DomeLight's own orientation (that of the OpenEXR documentation), turned by the scene's rotation.
",
        SEGMENTS / 2
    )
}

pub(super) fn write(exported: &Exported) -> Result<Vec<File>, SceneError> {
    let mut text =
        "#usda 1.0\n(\n    defaultPrim = \"World\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n\
                    def Xform \"World\"\n{\n"
            .to_owned();
    text += &camera(exported);
    for mesh in meshes(exported)? {
        text += &geometry(&mesh);
    }
    text += &lights(exported);
    text += &materials(exported);
    text += "}\n";
    Ok(vec![File::new("scene.usda", text)])
}

fn camera(exported: &Exported) -> String {
    let rows = exported.camera_to_world().map(|row| format!("({})", listed(&row))).join(", ");
    let length = APERTURE * exported.focal_length();
    format!(
        "    def Camera \"Camera\"
    {{
        float2 clippingRange = (0.001, 10000)
        float focalLength = {length}
        float horizontalAperture = {APERTURE}
        float verticalAperture = {APERTURE}
        matrix4d xformOp:transform = ( {rows} )
        uniform token[] xformOpOrder = [\"xformOp:transform\"]
    }}

"
    )
}

fn geometry(mesh: &Mesh) -> String {
    let [low, high] = mesh.bounds();
    let triples = |of: &[[f64; 3]]| tuples(of.iter().map(|v| v.as_slice()));
    let mut text = format!(
        "    def Mesh \"{}\" (
        prepend apiSchemas = [\"MaterialBindingAPI\"]
    )
    {{
        uniform token subdivisionScheme = \"none\"
        rel material:binding = </World/Materials/{}>
        float3[] extent = [({}), ({})]
        point3f[] points = [{}]
        normal3f[] normals = [{}] (
            interpolation = \"vertex\"
        )
        texCoord2f[] primvars:st = [{}] (
            interpolation = \"vertex\"
        )
",
        mesh.name,
        mesh.material,
        listed(&low.to_array()),
        listed(&high.to_array()),
        triples(&mesh.positions),
        triples(&mesh.normals),
        tuples(mesh.texture.iter().map(|v| v.as_slice())),
    );
    let counts = vec!["3"; mesh.triangles.len()].join(", ");
    let indices = mesh.triangles.as_flattened().iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    text += &format!(
        "        int[] faceVertexCounts = [{counts}]\n        int[] faceVertexIndices = [{indices}]\n    }}\n\n"
    );
    text
}

/// Vectors in single precision, which is what the arrays hold.
fn tuples<'a>(vectors: impl Iterator<Item = &'a [f64]>) -> String {
    let mut text = String::new();
    for vector in vectors {
        let numbers: Vec<String> = vector.iter().map(|v| (*v as f32).to_string()).collect();
        let comma = if text.is_empty() { "" } else { ", " };
        // Writing to a string does not fail.
        let _ = write!(text, "{comma}({})", numbers.join(", "));
    }
    text
}

fn lights(exported: &Exported) -> String {
    let points: String = exported.scene.point_lights.iter().enumerate().map(point_light).collect();
    let turn = match exported.rotation {
        0.0 => String::new(),
        degrees => format!(
            "                    float xformOp:rotateY = {}
                    uniform token[] xformOpOrder = [\"xformOp:rotateY\"]\n",
            -degrees
        ),
    };
    format!(
        "    def Scope \"Lights\" (
        prepend variantSets = \"light\"
        variants = {{
            string light = \"point\"
        }}
    )
    {{
        variantSet \"light\" = {{
            \"environment\" {{
                def DomeLight \"Environment\"
                {{
                    float inputs:intensity = 1
                    asset inputs:texture:file = @./{ENVIRONMENT}@
                    token inputs:texture:format = \"latlong\"
{turn}                }}
            }}
            \"point\" {{
{points}            }}
        }}
    }}

"
    )
}

fn point_light((k, light): (usize, &PointLight)) -> String {
    let (hue, strength) = hue_and_strength(light.intensity);
    format!(
        "                def SphereLight \"Point{}\"
                {{
                    float inputs:radius = {LIGHT_RADIUS}
                    bool treatAsPoint = 1
                    bool inputs:normalize = 1
                    float inputs:intensity = {}
                    color3f inputs:color = ({})
                    double3 xformOp:translate = ({})
                    uniform token[] xformOpOrder = [\"xformOp:translate\"]
                }}
",
        k + 1,
        4.0 * strength,
        listed(&hue),
        listed(&light.position),
    )
}

fn materials(exported: &Exported) -> String {
    let mut text = "    def Scope \"Materials\"\n    {\n".to_owned();
    for (name, colour) in exported.subject_materials() {
        text += &material(&name, colour, "float inputs:roughness = 0.5");
    }
    if let Some(plane) = &exported.scene.plane {
        for (name, colour) in [("light", plane.light), ("dark", plane.dark)] {
            let lambert = "float inputs:roughness = 1
                int inputs:useSpecularWorkflow = 1
                color3f inputs:specularColor = (0, 0, 0)";
            text += &material(name, colour, lambert);
        }
    }
    text + "    }\n"
}

fn material(name: &str, colour: [f64; 3], inputs: &str) -> String {
    format!(
        "        def Material \"{name}\"
        {{
            token outputs:surface.connect = </World/Materials/{name}/Surface.outputs:surface>

            def Shader \"Surface\"
            {{
                uniform token info:id = \"UsdPreviewSurface\"
                color3f inputs:diffuseColor = ({})
                {inputs}
                token outputs:surface
            }}
        }}

",
        listed(&colour)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    #[test]
    fn the_stage_says_what_the_scene_does() {
        let mut scene = Scene::reference();
        scene.point_lights[0].intensity = [60.0, 30.0, 15.0];
        let [file] = write(&Exported { scene: &scene, size: 48, rotation: 30.0 })
            .unwrap()
            .try_into()
            .unwrap_or_else(|_| panic!("one file"));
        let text = String::from_utf8(file.content).unwrap();
        for expected in [
            "upAxis = \"Y\"",
            "inputs:intensity = 240",
            "inputs:color = (1, 0.5, 0.25)",
            "float xformOp:rotateY = -30",
            "inputs:diffuseColor = (0.15, 0.15, 0.15)",
            "extent = [(-4, -1, -4), (4, -1, 4)]",
        ] {
            assert!(text.contains(expected), "no {expected}");
        }
        let number = |name: &str| -> f64 {
            let (_, rest) = text.split_once(name).unwrap();
            rest.lines().next().unwrap().trim().parse().unwrap()
        };
        let ratio = number("float verticalAperture = ") / number("float focalLength = ");
        assert!((2.0 * (ratio / 2.0).atan().to_degrees() - 28.0).abs() < 1e-12);
        assert_eq!(text.matches('{').count(), text.matches('}').count());
    }
}
