//! `README.txt`: what to render, whatever the renderer.

use super::{ExportFormat, Exported};

/// The text for one format.
pub(super) fn text(format: &ExportFormat, exported: &Exported) -> String {
    let (size, scene) = (exported.size, exported.scene);
    let materials: Vec<String> = exported.subject_materials().into_iter().map(|(name, _)| name).collect();
    let mut lights = String::new();
    for light in &scene.point_lights {
        let ([x, y, z], [r, g, b]) = (light.position, light.intensity);
        lights += &format!("  point light at ({x}, {y}, {z}) m, isotropic, {r} {g} {b} W/sr (R G B)\n");
    }
    format!(
        "Scene '{}' for {}, exported by lookmatch.

Render four square pictures of {size} x {size} pixels into this folder:
  full_point.exr           your material under the point light(s) alone
  full_environment.exr     your material under environment.exr alone
  diffuse_point.exr        optional: the diffuse reflection alone, under the same two lights: what a black
  diffuse_environment.exr  body takes away. Where a body lies under an interface (plastic, paint), that is
                           not the material without its highlight: render it again with a black body and
                           subtract; or leave these two out
then run
  lookmatch match FOLDER --to MODEL

Your material goes where {} stands. What known parameters it has may be told in material.json:
  {{\"name\": \"my paint\", \"diffuse\": [0.5, 0.2, 0.1], \"roughness\": 0.3}}

Pictures are linear float RGB (Rec. 709 primaries), row 0 on top: no tone mapping, no sRGB curve, no exposure,
no clamping, no denoiser. Use a box filter one pixel wide: a pixel is the mean over its area. Use as many
samples as make the noise invisible; noise that is left counts as a difference.

Units: metres, Y up, right-handed. W/sr is radiant intensity: a surface at distance d that faces the light receives
I / d^2 W/m^2, and a white Lambertian one then has the radiance I / (pi d^2). The number matters, not the name: a picture
is right if a grey card of albedo 0.5, 1 m from a light of 1 W/sr, has the pixel value 0.159.
{lights}  environment.exr: latitude-longitude radiance, in W/(m^2 sr). u = atan2(x, -z) / 2 pi from the left edge, v = acos(y) / pi
  from the top: row 0 is +Y, left and right edges are -Z, a quarter of the width is +X, the middle is +Z. {}
The environment is seen behind the scene in the environment's pictures; in the point light's the background is black.

{}",
        scene.name,
        format.name,
        materials.join(", "),
        rotation(exported),
        (format.notes)(exported)
    )
}

fn rotation(exported: &Exported) -> String {
    match exported.rotation {
        0.0 => "It is not\n  rotated.".to_owned(),
        degrees => {
            format!("It is turned\n  about Y by {degrees} degrees: positive moves what is at -Z towards +X.")
        }
    }
}
