//! Blender: a script that builds the scene, switches off what would change a picture, and renders.
//!
//! Z is up there: (x, y, z) becomes (x, −z, y). A point light's watts are 4π times its W/sr. Cycles' map runs the other way
//! round and starts elsewhere: looked up a quarter turn about Z further on, it is ours; our rotation adds to that.

use serde_json::json;

use super::tessellation::SEGMENTS;
use super::{ENVIRONMENT, Exported, File};
use crate::SceneError;

const SCRIPT: &str = include_str!("blender_scene.py");
/// Where the script has the numbers of the scene.
const PLACE: &str = "@SCENE@";

pub(super) fn notes(_: &Exported) -> String {
    format!(
        "`blender --background --python scene.py -- 512` renders all four pictures with 512 samples per pixel (256 if not given);
so does `python scene.py 512` with `pip install bpy`. Opened in Blender's text editor and run there, it builds the scene and
renders nothing. Written for Blender 4.2 to 5, tested with 5.0.1.
Your material goes into the function full_material of scene.py, its diffuse reflection alone into diffuse_material (no node
makes that of a body under a coat: delete the two diffuse pictures then); or give the nodes of the materials
\"subject\" (all pictures are rendered with what those two functions build).
The script switches off: denoising, adaptive sampling, clamping, glossy filtering, the light threshold, the wide pixel filter,
the view transform, and limits on bounces that a converged picture would show.
Spheres are smooth meshes of {SEGMENTS} x {} segments. A point light's power is 4 pi times its W/sr; its radius is 0.
environment.exr is read with its mapping node turned by 90 degrees about Z plus the scene's rotation: Blender's own orientation
differs from the map's.
",
        SEGMENTS / 2
    )
}

pub(super) fn write(exported: &Exported) -> Result<Vec<File>, SceneError> {
    let scene = exported.scene;
    let numbers = json!({
        "size": exported.size,
        "focal_length": exported.focal_length(),
        "camera_axes": exported.camera_axes().map(|axis| axis.to_array()),
        "eye": exported.camera().eye,
        "segments": SEGMENTS,
        "spheres": exported.subjects().iter()
            .map(|s| json!({"centre": s.sphere.centre, "radius": s.sphere.radius, "material": s.material}))
            .collect::<Vec<_>>(),
        "subjects": exported.subject_materials(),
        "plane": scene.plane,
        "point_lights": scene.point_lights,
        "environment": ENVIRONMENT,
        "rotation": exported.rotation,
    });
    Ok(vec![File::new("scene.py", SCRIPT.replace(PLACE, &format!("{numbers:#}")))])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    #[test]
    fn the_script_holds_the_scene_as_json() {
        let exported = Exported { scene: &Scene::spheres(), size: 96, rotation: 12.5 };
        let [file] = write(&exported).unwrap().try_into().unwrap_or_else(|_| panic!("one file"));
        let script = String::from_utf8(file.content).unwrap();
        let (_, rest) = script.split_once("r\"\"\"").unwrap();
        let (text, _) = rest.split_once("\"\"\"").unwrap();
        let numbers: serde_json::Value = serde_json::from_str(text).unwrap();
        assert_eq!((numbers["rotation"].as_f64(), numbers["size"].as_u64()), (Some(12.5), Some(96)));
        assert_eq!(numbers["subjects"][2][0], "subject3");
        assert_eq!(numbers["spheres"][0]["centre"][0], -2.1);
        let focal = numbers["focal_length"].as_f64().unwrap();
        assert!((2.0 * (0.5 / focal).atan().to_degrees() - 40.0).abs() < 1e-12);
        assert!(!script.contains(PLACE));
    }
}
