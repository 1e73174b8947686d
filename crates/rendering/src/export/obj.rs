//! Wavefront OBJ and MTL with a camera as JSON: what every program can read.
//!
//! Traps: OBJ indices start at 1; MTL has no linear colours of its own, importers take `Kd` as linear numbers (Blender,
//! Mitsuba) or as sRGB (some viewers); neither holds lights.

use std::fmt::Write;

use serde_json::json;

use super::tessellation::{Mesh, SEGMENTS, meshes};
use super::{Exported, File, spaced};
use crate::SceneError;

pub(super) fn notes(_: &Exported) -> String {
    format!(
        "scene.obj has one object per sphere ({SEGMENTS} x {} segments, smooth normals, u eastwards, v northwards), and the
light and the dark checks as two objects, two triangles per check. scene.mtl holds their albedos as linear numbers in Kd.
Checks are Lambertian. If your renderer has true spheres, use those: camera.json has centres and radii.
camera.json: eye, target, up; both fields of view are equal because pictures are square; world_from_camera is the matrix
(rows) of a camera that looks along its -Z with +Y up; focal_length_mm is for a film of 36 mm x 36 mm.
",
        SEGMENTS / 2
    )
}

pub(super) fn write(exported: &Exported) -> Result<Vec<File>, SceneError> {
    let meshes = meshes(exported)?;
    Ok(vec![
        File::new("scene.obj", geometry(&meshes)),
        File::new("scene.mtl", materials(exported)),
        File::new("camera.json", camera(exported)),
    ])
}

fn geometry(meshes: &[Mesh]) -> String {
    let mut text = "# Y up, metres\nmtllib scene.mtl\n".to_owned();
    let mut first = 1;
    for mesh in meshes {
        text += &format!("o {}\nusemtl {}\n", mesh.name, mesh.material);
        let vertices = mesh.positions.iter().zip(&mesh.normals).zip(&mesh.texture);
        for ((position, normal), texture) in vertices {
            // Writing to a string does not fail.
            let _ = writeln!(text, "v {}\nvt {}\nvn {}", short(position), short(texture), short(normal));
        }
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| i + first);
            let _ = writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}");
        }
        first += mesh.positions.len() as u32;
    }
    text
}

/// Nine digits after the point: what single precision can hold of a metre.
fn short(numbers: &[f64]) -> String {
    let rounded: Vec<f64> = numbers.iter().map(|v| (v * 1e9).round() / 1e9 + 0.0).collect();
    spaced(&rounded)
}

fn materials(exported: &Exported) -> String {
    let mut text = "# Kd is a linear albedo\n".to_owned();
    let plane = exported.scene.plane.iter();
    let checks = plane.flat_map(|p| [("light".to_owned(), p.light), ("dark".to_owned(), p.dark)]);
    for (name, colour) in exported.subject_materials().into_iter().chain(checks) {
        text += &format!("newmtl {name}\nKd {}\nKs 0 0 0\nillum 1\n", spaced(&colour));
    }
    text
}

fn camera(exported: &Exported) -> String {
    let camera = exported.camera();
    let columns = exported.camera_to_world();
    let rows: [[f64; 4]; 4] = std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]));
    let document = json!({
        "eye": camera.eye, "target": camera.target, "up": camera.up,
        "vertical_fov_degrees": camera.vertical_fov, "horizontal_fov_degrees": camera.vertical_fov,
        "focal_length_mm": 36.0 * exported.focal_length(), "film_mm": [36.0, 36.0],
        "world_from_camera": rows, "size": exported.size,
        "spheres": exported.subjects().iter()
            .map(|s| json!({"centre": s.sphere.centre, "radius": s.sphere.radius, "material": s.material}))
            .collect::<Vec<_>>(),
        "point_lights": exported.scene.point_lights,
        "environment": {"file": super::ENVIRONMENT, "rotation_degrees": exported.rotation},
    });
    format!("{document:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    #[test]
    fn the_file_is_read_back_by_another_reader() {
        let exported = Exported { scene: &Scene::spheres(), size: 64, rotation: 0.0 };
        let meshes = meshes(&exported).unwrap();
        let text = geometry(&meshes);
        let options = tobj::LoadOptions { single_index: true, ..Default::default() };
        let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| {
            tobj::load_mtl_buf(&mut materials(&exported).as_bytes())
        })
        .unwrap();
        assert_eq!(models.len(), 5);
        for (read, written) in models.iter().zip(&meshes) {
            assert_eq!(read.mesh.indices.len(), 3 * written.triangles.len());
            let largest = read.mesh.positions.iter().skip(1).step_by(3).fold(f32::MIN, |a, b| a.max(*b));
            assert!((f64::from(largest) - written.bounds()[1].y).abs() < 1e-6);
        }
        assert_eq!(models[1].name, "sphere2");
        let materials = materials(&exported);
        assert!(
            materials.contains("newmtl subject2\nKd 0.1 0.38 0.12\n")
                && materials.contains("newmtl dark\nKd 0.15 0.15 0.15\n")
        );
    }

    #[test]
    fn the_camera_is_ours() {
        let exported = Exported { scene: &Scene::reference(), size: 64, rotation: 0.0 };
        let camera: serde_json::Value = serde_json::from_str(&camera(&exported)).unwrap();
        let focal = camera["focal_length_mm"].as_f64().unwrap();
        assert!((2.0 * (18.0 / focal).atan().to_degrees() - 28.0).abs() < 1e-12);
        let matrix = &camera["world_from_camera"];
        assert_eq!((matrix[0][0].as_f64(), matrix[2][3].as_f64()), (Some(1.0), Some(6.0)));
        // The target lies on the camera's −Z.
        let [x, y, z] = exported.camera_axes();
        let to_target = glam::DVec3::new(0.0, -1.6, -6.0);
        assert!(to_target.dot(x).abs() < 1e-12 && to_target.dot(y).abs() < 1e-12 && to_target.dot(z) < 0.0);
    }
}
