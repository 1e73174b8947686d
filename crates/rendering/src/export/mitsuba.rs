//! Mitsuba 3: analytic spheres, a procedural checkerboard, and small files that the scene includes by name, because XML has
//! no conditions: `-D light=environment -D material=diffuse`.
//!
//! Its map convention and its intensities are ours. Our rotation moves −Z towards +X, a right-handed turn about Y the other
//! way, so its sign changes. Spheres have their poles along Z there and are turned. The sampler is multijitter: five times
//! less variance at 64 samples than the default.

use super::{ENVIRONMENT, Exported, File, listed};
use crate::{Camera, Plane, SceneError};

/// Renders the four pictures through Mitsuba's Python interface.
const SCRIPT: &str = include_str!("mitsuba_render.py");

pub(super) fn notes(exported: &Exported) -> String {
    format!(
        "With `pip install mitsuba` (tested with 3.9.1), `python render.py` renders all four pictures; `python render.py 1024` takes
1024 samples per pixel. By hand: `mitsuba -m scalar_rgb -D light=environment -D material=full -D spp=256 -o full_environment.exr
scene.xml`; light is point or environment, material is full or diffuse.
Your material goes into material-full.xml, in place of the bsdf with the id \"subject\"; its diffuse reflection alone
into material-diffuse.xml (no bsdf makes that of a body under a coat: delete the two diffuse pictures then). Nothing else needs
editing.
Spheres are analytic, the checkerboard is procedural; intensities are W/sr as they are; the map has Mitsuba's own orientation{}.
",
        if exported.rotation == 0.0 { "" } else { ", turned by the scene's rotation" }
    )
}

pub(super) fn write(exported: &Exported) -> Result<Vec<File>, SceneError> {
    Ok(vec![
        File::new("scene.xml", scene(exported)),
        File::new("light-point.xml", document(&point_lights(exported))),
        File::new("light-environment.xml", document(&environment(exported))),
        File::new("material-full.xml", document(&materials(exported, "Edit here: your material."))),
        File::new(
            "material-diffuse.xml",
            document(&materials(exported, "Edit here: the diffuse reflection of your material alone.")),
        ),
        File::new("render.py", SCRIPT),
    ])
}

fn document(content: &str) -> String {
    format!("<scene version=\"3.0.0\">\n{content}</scene>\n")
}

fn scene(exported: &Exported) -> String {
    let mut content = r#"  <default name="light" value="point"/>
  <default name="material" value="full"/>
  <default name="spp" value="256"/>

  <integrator type="path"/>
"#
    .to_owned();
    content += &sensor(exported.camera(), exported.size);
    content +=
        "  <include filename=\"light-$light.xml\"/>\n  <include filename=\"material-$material.xml\"/>\n\n";
    for subject in exported.subjects() {
        content += &format!(
            r#"  <shape type="sphere">
    <transform name="to_world">
      <scale value="{}"/>
      <rotate x="1" angle="-90"/>
      <translate value="{}"/>
    </transform>
    <ref id="{}"/>
  </shape>
"#,
            subject.sphere.radius,
            listed(&subject.sphere.centre),
            subject.material
        );
    }
    content += &exported.scene.plane.as_ref().map(board).unwrap_or_default();
    document(&content)
}

fn sensor(camera: &Camera, size: usize) -> String {
    format!(
        r#"  <sensor type="perspective">
    <string name="fov_axis" value="y"/>
    <float name="fov" value="{}"/>
    <float name="near_clip" value="0.001"/>
    <transform name="to_world">
      <lookat origin="{}" target="{}" up="{}"/>
    </transform>
    <sampler type="multijitter">
      <integer name="sample_count" value="$spp"/>
    </sampler>
    <film type="hdrfilm">
      <integer name="width" value="{size}"/>
      <integer name="height" value="{size}"/>
      <string name="pixel_format" value="rgb"/>
      <string name="component_format" value="float32"/>
      <rfilter type="box"/>
    </film>
  </sensor>
"#,
        camera.vertical_fov,
        listed(&camera.eye),
        listed(&camera.target),
        listed(&camera.up),
    )
}

/// The texture's own checks are half a unit wide, light where both coordinates lie in the same half.
fn board(plane: &Plane) -> String {
    let periods = plane.half_extent / plane.check_size;
    let (half, middle) = (plane.half_extent, periods / 2.0);
    format!(
        r#"  <shape type="rectangle">
    <transform name="to_world">
      <scale x="{half}" y="{half}"/>
      <rotate x="1" angle="-90"/>
      <translate y="{}"/>
    </transform>
    <bsdf type="diffuse">
      <texture type="checkerboard" name="reflectance">
        <rgb name="color0" value="{}"/>
        <rgb name="color1" value="{}"/>
        <transform name="to_uv">
          <scale x="{periods}" y="-{periods}"/>
          <translate x="-{middle}" y="{middle}"/>
        </transform>
      </texture>
    </bsdf>
  </shape>
"#,
        plane.height,
        listed(&plane.light),
        listed(&plane.dark),
    )
}

fn point_lights(exported: &Exported) -> String {
    let light = |light: &crate::PointLight| {
        let (position, intensity) = (listed(&light.position), listed(&light.intensity));
        format!(
            "  <emitter type=\"point\">\n    <point name=\"position\" value=\"{position}\"/>\n    <rgb name=\"intensity\" \
             value=\"{intensity}\"/>\n  </emitter>\n"
        )
    };
    exported.scene.point_lights.iter().map(light).collect()
}

fn environment(exported: &Exported) -> String {
    let turn = match exported.rotation {
        0.0 => String::new(),
        degrees => format!(
            "    <transform name=\"to_world\">\n      <rotate y=\"1\" angle=\"{}\"/>\n    </transform>\n",
            -degrees
        ),
    };
    format!(
        "  <emitter type=\"envmap\">\n    <string name=\"filename\" value=\"{ENVIRONMENT}\"/>\n{turn}  </emitter>\n"
    )
}

fn materials(exported: &Exported, comment: &str) -> String {
    let mut text = format!("  <!-- {comment} -->\n");
    for (name, colour) in exported.subject_materials() {
        text += &format!(
            "  <bsdf type=\"diffuse\" id=\"{name}\">\n    <rgb name=\"reflectance\" value=\"{}\"/>\n  </bsdf>\n",
            listed(&colour)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Scene, Sphere};

    fn files(scene: &Scene, rotation: f64) -> String {
        let files = write(&Exported { scene, size: 48, rotation }).unwrap();
        files.into_iter().map(|f| String::from_utf8(f.content).unwrap()).collect()
    }

    #[test]
    fn the_files_say_what_the_scene_does() {
        let text = files(&Scene::reference(), 30.0);
        for expected in [
            "<string name=\"fov_axis\" value=\"y\"/>\n    <float name=\"fov\" value=\"28\"/>",
            "origin=\"0, 1.5, 6\" target=\"0, -0.1, 0\"",
            "<rgb name=\"intensity\" value=\"60, 60, 60\"/>",
            "<scale x=\"8\" y=\"-8\"/>",
            "<translate x=\"-4\" y=\"4\"/>",
            "<rotate y=\"1\" angle=\"-30\"/>",
            "<integer name=\"width\" value=\"48\"/>",
        ] {
            assert!(text.contains(expected), "no {expected} in\n{text}");
        }
        assert_eq!(text.matches("id=\"subject\"").count(), 3, "two materials and one reference");
    }

    #[test]
    fn subjects_of_their_own_colour_have_materials_of_their_own() {
        let mut scene = Scene::spheres();
        scene.spheres.push(Sphere { centre: [0.0, 3.0, 0.0], radius: 0.5, diffuse: None });
        scene.plane = None;
        let text = files(&scene, 0.0);
        for name in ["subject", "subject1", "subject2", "subject3"] {
            assert!(text.contains(&format!("<ref id=\"{name}\"/>")), "{name}");
            assert!(text.contains(&format!("<bsdf type=\"diffuse\" id=\"{name}\">")), "{name}");
        }
        assert!(
            text.contains("value=\"0.5, 0.09, 0.06\"")
                && !text.contains("rectangle")
                && !text.contains("rotate y")
        );
    }
}
