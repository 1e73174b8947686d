//! What can be wrong with a scene.

use std::path::PathBuf;

use lookmatch_imaging::ImageError;
use thiserror::Error;

/// A scene that cannot be rendered; the message names the file or field, the value, and what would be accepted.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The scene file cannot be read.
    #[error(
        "cannot read scene '{}': {source}; expected a scene file, or a built-in scene: {}",
        path.display(), crate::scenes::names()
    )]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The scene file is not a scene.
    #[error("scene '{}': {message}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, column and reason.
        message: String,
    },
    /// A field has a value that makes no scene.
    #[error("scene '{scene}': {field} is {value}; expected {expected}")]
    Field {
        /// Name of the scene.
        scene: String,
        /// Path of the field.
        field: String,
        /// The offending value.
        value: String,
        /// What would be accepted.
        expected: &'static str,
    },
    /// The scene has no light of the kind that was asked for.
    #[error("scene '{scene}' has no {light}")]
    NoLight {
        /// Name of the scene.
        scene: String,
        /// The missing kind.
        light: &'static str,
    },
    /// The environment map cannot be used.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The environment map is neither a file nor a name.
    #[error(
        "cannot read environment map '{map}': there is no such file; expected an .exr or .hdr file, or one of {names}"
    )]
    NoMap {
        /// Name or path of the map.
        map: String,
        /// What needs no file.
        names: String,
    },
    /// The environment map cannot be balanced.
    #[error(
        "environment map '{map}' gives no light from above; expected a map with some, to be balanced to others"
    )]
    DarkMap {
        /// Name or path of the map.
        map: String,
    },
    /// The environment map does not cover the sphere of directions.
    #[error(
        "environment map '{map}' is {width} x {height} pixels; a latitude-longitude map is twice as wide as high"
    )]
    Aspect {
        /// Name or path of the map.
        map: String,
        /// Its width in pixels.
        width: usize,
        /// Its height in pixels.
        height: usize,
    },
    /// A picture of no pixels, or of more than fit.
    #[error("a picture of {size} x {size} pixels cannot be rendered; the size is 1 to 8192")]
    Size {
        /// The side asked for.
        size: usize,
    },
    /// A mesh cannot be used.
    #[error("mesh '{}': {message}", path.display())]
    Mesh {
        /// Its file.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
    },
    /// The scene has meshes, but the renderer knows spheres alone.
    #[error(
        "scene '{scene}' has meshes; the renderer 'transport' takes spheres alone, the renderer 'path' takes both"
    )]
    NeedsPath {
        /// Name of the scene.
        scene: String,
    },
    /// No samples in a pixel, or more than fit.
    #[error("{samples} samples per pixel cannot be taken; 1 to 1048576 can")]
    Samples {
        /// The number asked for.
        samples: u32,
    },
    /// The scene cannot be written for another renderer.
    #[error("scene '{scene}' cannot be exported: {message}")]
    Export {
        /// Name of the scene.
        scene: String,
        /// What is wrong with it.
        message: String,
    },
    /// A file or folder cannot be written.
    #[error("cannot write '{}': {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}
