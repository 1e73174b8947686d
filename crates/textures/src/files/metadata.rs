//! What a file says beside its texels, and how much of it another format can hold.

use exr::meta::header::{ImageAttributes, LayerAttributes};

/// Notes, resolution and profile of a texture.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Metadata {
    /// Notes: PNG keywords and their texts; TIFF's have the keywords of PNG.
    pub(crate) text: Vec<(String, String)>,
    /// Texels per metre, in x and y.
    pub(crate) resolution: Option<[f64; 2]>,
    /// ICC profile.
    pub(crate) icc: Option<Vec<u8>>,
    /// All that an EXR file says, windows included.
    pub(crate) exr: Option<Box<(ImageAttributes, LayerAttributes)>>,
}

impl Metadata {
    /// With what other maps say that this one does not.
    pub(crate) fn complete(&mut self, other: &Self) {
        for (key, value) in &other.text {
            if !self.text.iter().any(|(k, _)| k == key) {
                self.text.push((key.clone(), value.clone()));
            }
        }
        self.resolution = self.resolution.or(other.resolution);
        self.exr = self.exr.take().or_else(|| other.exr.clone());
    }
}
