//! Mesh files: Wavefront OBJ and PLY, as they are or packed with gzip.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use flate2::read::MultiGzDecoder;
use glam::DVec3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::DefaultElement;

use super::Soup;
use super::shapes::NAMES;

/// Reads a file by its extension; errors say what is wrong with it.
pub(super) fn read(path: &Path) -> Result<Soup, String> {
    let extension = |path: &Path| path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let is_packed = extension(path) == "gz";
    let inner =
        if is_packed { extension(path.file_stem().unwrap_or_default().as_ref()) } else { extension(path) };
    let file = || File::open(path).map_err(|error| error.to_string());
    match &*inner {
        "obj" | "ply" if is_packed => decode(&inner, &mut BufReader::new(MultiGzDecoder::new(file()?))),
        "obj" | "ply" => decode(&inner, &mut BufReader::new(file()?)),
        _ => Err(format!(
            "a mesh is a file that ends in .obj or .ply, perhaps packed (.obj.gz, .ply.gz), or one of {NAMES}"
        )),
    }
}

/// Reads the content of a file by its extension, without that of a packed one.
pub(super) fn decode(extension: &str, reader: &mut impl BufRead) -> Result<Soup, String> {
    if extension == "ply" { ply(reader) } else { obj(reader) }
}

/// All groups of the file; its materials do not matter.
fn obj(reader: &mut impl BufRead) -> Result<Soup, String> {
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(reader, &options, no_materials)
        .map_err(|error| format!("no OBJ file: {error}"))?;
    let mut soup = Soup::default();
    let count: usize = models.iter().map(|m| m.mesh.positions.len() / 3).sum();
    for mesh in models.iter().map(|m| &m.mesh) {
        // `chunks_exact` below leaves triangles alone: lines and points, which are no surfaces, have other arities.
        if !mesh.face_arities.is_empty() && mesh.face_arities.iter().any(|n| *n != 3) {
            return Err("there are lines or points among the faces; expected polygons".to_owned());
        }
        let first = soup.positions.len();
        soup.positions.extend(vectors(&mesh.positions));
        soup.normals.extend(vectors(&mesh.normals));
        soup.texture.extend(mesh.texcoords.chunks_exact(2).map(|t| [t[0].into(), t[1].into()]));
        let corner = |i: &u32| first + *i as usize;
        soup.triangles
            .extend(mesh.indices.chunks_exact(3).map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])]));
    }
    // Groups without normals or texture among others that have them: neither is used.
    if soup.normals.len() != count {
        soup.normals.clear();
    }
    if soup.texture.len() != count {
        soup.texture.clear();
    }
    Ok(soup)
}

fn vectors(numbers: &[f32]) -> impl Iterator<Item = DVec3> {
    numbers.chunks_exact(3).map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()))
}

/// Elements `vertex` (x, y, z, and where there are any nx, ny, nz and u, v or s, t) and `face`.
fn ply(reader: &mut impl BufRead) -> Result<Soup, String> {
    let parser = Parser::<DefaultElement>::new();
    let file = parser.read_ply(reader).map_err(|error| format!("no PLY file: {error}"))?;
    let elements = |name: &str| file.payload.get(name).map(Vec::as_slice).unwrap_or_default();
    let mut soup = Soup::default();
    for vertex in elements("vertex") {
        let numbers = |names: &[&str]| -> Option<Vec<f64>> {
            let number = |name: &&str| vertex.get(*name)?.to_f32_lossy().map(f64::from);
            names.iter().map(number).collect()
        };
        let position = numbers(&["x", "y", "z"]).ok_or("a vertex has no x, y and z")?;
        soup.positions.push(DVec3::from_slice(&position));
        soup.normals.extend(numbers(&["nx", "ny", "nz"]).map(|n| DVec3::from_slice(&n)));
        soup.texture.extend(numbers(&["u", "v"]).or_else(|| numbers(&["s", "t"])).map(|t| [t[0], t[1]]));
    }
    for face in elements("face") {
        let list = face.get("vertex_indices").or_else(|| face.get("vertex_index"));
        let corners = list.and_then(|l| l.to_u32_list()).ok_or("a face has no vertex_indices from 0")?;
        // A fan, as for convex polygons.
        let fan = corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]].map(|i| i as usize));
        soup.triangles.extend(fan);
    }
    Ok(soup)
}
