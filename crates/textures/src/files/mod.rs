//! Texture files, read and written in bands of rows: 8K x 8K texels never are in memory at once.

mod exr;
mod metadata;
mod png;
mod tiff;

use std::fs::File;
use std::io::{self, BufReader, Seek, Write};
use std::ops::Range;
use std::path::Path;

pub(crate) use metadata::Metadata;

use crate::TextureError;

/// The largest texture that is read, in texels: 65536 x 16384.
const MAX_TEXELS: usize = 1 << 30;

/// A file format by its extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// Portable Network Graphics.
    Png,
    /// Tagged Image File Format.
    Tiff,
    /// OpenEXR.
    Exr,
}

impl Container {
    /// The format of a file.
    ///
    /// # Errors
    /// Another extension than .png, .tif, .tiff and .exr.
    pub fn of(path: &Path) -> Result<Self, TextureError> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "png" => Ok(Self::Png),
            "tif" | "tiff" => Ok(Self::Tiff),
            "exr" => Ok(Self::Exr),
            _ => Err(TextureError::Request(format!(
                "cannot use texture '{}': a texture ends in .png, .tif, .tiff or .exr",
                path.display()
            ))),
        }
    }

    /// The extension that files are written with.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Tiff => "tif",
            Self::Exr => "exr",
        }
    }
}

/// How a sample is stored, the least precise (between 0 and 1) first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Depth {
    /// 8-bit integer, 255 for 1.
    U8,
    /// Half float.
    F16,
    /// 16-bit integer, 65535 for 1.
    U16,
    /// Single float.
    F32,
}

impl Depth {
    /// True for samples between 0 and 1 only.
    pub fn is_integer(self) -> bool {
        matches!(self, Self::U8 | Self::U16)
    }

    /// Half a step at a value: what rounding may have moved it by.
    pub(crate) fn rounding(self, value: f64) -> f64 {
        match self {
            Self::U8 => 0.5 / 255.0,
            Self::U16 => 0.5 / 65535.0,
            Self::F16 => value.abs() / 2048.0,
            Self::F32 => value.abs() / 16_777_216.0,
        }
    }
}

/// A file format with its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// The container.
    pub container: Container,
    /// Its samples.
    pub depth: Depth,
}

impl Format {
    /// What `--format` accepts.
    pub const NAMES: [&'static str; 9] =
        ["exr-half", "exr-float", "png8", "png16", "tiff8", "tiff16", "tiff-half", "tiff-float", "exr"];

    /// The format of a name.
    pub fn parse(name: &str) -> Option<Self> {
        use Container::{Exr, Png, Tiff};
        use Depth::{F16, F32, U8, U16};
        let (container, depth) = match name {
            "exr-half" => (Exr, F16),
            "exr-float" | "exr" => (Exr, F32),
            "png8" => (Png, U8),
            "png16" | "png" => (Png, U16),
            "tiff8" => (Tiff, U8),
            "tiff16" => (Tiff, U16),
            "tiff-half" => (Tiff, F16),
            "tiff-float" | "tiff" => (Tiff, F32),
            _ => return None,
        };
        Some(Self { container, depth })
    }

    /// Its name: `png16`.
    pub fn name(self) -> &'static str {
        match (self.container, self.depth) {
            (Container::Png, Depth::U8) => "png8",
            (Container::Png, _) => "png16",
            (Container::Tiff, Depth::U8) => "tiff8",
            (Container::Tiff, Depth::U16) => "tiff16",
            (Container::Tiff, Depth::F16) => "tiff-half",
            (Container::Tiff, Depth::F32) => "tiff-float",
            (Container::Exr, Depth::F32) => "exr-float",
            (Container::Exr, _) => "exr-half",
        }
    }
}

/// A channel of a packed texture, which holds several parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha, of PNG and TIFF files.
    A,
}

impl Channel {
    /// The channel of a letter, of either case.
    pub fn parse(name: &str) -> Option<Self> {
        let all = [("r", Self::R), ("g", Self::G), ("b", Self::B), ("a", Self::A)];
        all.into_iter().find(|(letter, _)| name.eq_ignore_ascii_case(letter)).map(|(_, channel)| channel)
    }

    /// Its plane in a file; `None` where the file does not have it.
    pub(crate) fn plane(self, header: &Header) -> Option<usize> {
        let is_packed = header.channels == 3;
        match self {
            Self::R => is_packed.then_some(0),
            Self::G => is_packed.then_some(1),
            Self::B => is_packed.then_some(2),
            Self::A => {
                (header.has_alpha && header.format.container != Container::Exr).then_some(header.channels)
            }
        }
    }
}

/// What a file says before its texels.
#[derive(Clone, Debug)]
pub(crate) struct Header {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) format: Format,
    /// 1 or 3, alpha not counted.
    pub(crate) channels: usize,
    /// What the file calls its channels, for messages.
    pub(crate) names: String,
    pub(crate) has_alpha: bool,
    pub(crate) metadata: Metadata,
    /// Why the file is taken for sRGB-encoded, by what it says itself.
    pub(crate) srgb: Option<String>,
}

/// Reads bands of rows, each once and from top to bottom.
pub(crate) trait Bands: Send {
    /// Fills one plane for each channel with some rows, one more for the alpha of PNG and TIFF; integers become 0 to 1, nothing is
    /// decoded.
    fn read(&mut self, rows: Range<usize>, planes: &mut [Vec<f32>]) -> Result<(), TextureError>;
}

/// Opens a texture.
pub(crate) fn open(path: &Path) -> Result<(Header, Box<dyn Bands>), TextureError> {
    let container = Container::of(path)?;
    if path.is_dir() {
        return Err(TextureError::undecodable(path, "it is a folder"));
    }
    let file = BufReader::with_capacity(1 << 18, File::open(path).map_err(TextureError::io(path, "read"))?);
    let (header, bands): (Header, Box<dyn Bands>) = match container {
        Container::Png => png::open(path, file)?,
        Container::Tiff => tiff::open(path, file)?,
        Container::Exr => exr::open(path, file)?,
    };
    let (width, height) = (header.width, header.height);
    if width == 0 || height == 0 || width.saturating_mul(height) > MAX_TEXELS {
        let limit = format!("1 to {MAX_TEXELS} texels are accepted");
        return Err(TextureError::undecodable(path, format!("it claims {width} x {height} texels; {limit}")));
    }
    Ok((header, bands))
}

/// A map that is to be written.
#[derive(Clone, Debug)]
pub(crate) struct Sheet {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// 1 or 3.
    pub(crate) channels: usize,
    pub(crate) format: Format,
    pub(crate) metadata: Metadata,
    /// Integers are sRGB-encoded: said in the file, where it can say so.
    pub(crate) is_srgb: bool,
}

/// Rows of a map: a plane for each channel.
pub(crate) type Band = Vec<Vec<f32>>;

/// Writes a map of the rows that come; the bands together must have all of them.
pub(crate) fn write(
    sheet: &Sheet,
    out: impl Write + Seek + Send,
    bands: &mut dyn Iterator<Item = std::sync::Arc<Band>>,
) -> io::Result<()> {
    match sheet.format.container {
        Container::Png => png::write(sheet, out, bands),
        Container::Tiff => tiff::write(sheet, out, bands),
        Container::Exr => exr::write(sheet, out, bands),
    }
}

/// An end of the bands before the last row: the one who makes them has stopped.
pub(crate) fn stopped() -> io::Error {
    io::Error::new(io::ErrorKind::Interrupted, "the map was given up")
}

/// Cuts bands of any height into pieces of a fixed one, which encoders work on.
pub(crate) struct Pieces<'a> {
    bands: &'a mut dyn Iterator<Item = std::sync::Arc<Band>>,
    pending: Band,
    width: usize,
    /// Rows that have not been handed out.
    rows: usize,
}

impl<'a> Pieces<'a> {
    pub(crate) fn new(sheet: &Sheet, bands: &'a mut dyn Iterator<Item = std::sync::Arc<Band>>) -> Self {
        let pending = vec![Vec::new(); sheet.channels];
        Self { bands, pending, width: sheet.width, rows: sheet.height }
    }

    /// As many whole pieces of `height` rows as have come, at least one; the image's last may be lower. `None` at its end.
    pub(crate) fn next(&mut self, height: usize) -> io::Result<Option<Vec<Band>>> {
        if self.rows == 0 {
            return Ok(None);
        }
        let wanted = height.min(self.rows);
        while self.pending[0].len() < wanted * self.width {
            let band = self.bands.next().ok_or_else(stopped)?;
            self.pending.iter_mut().zip(band.iter()).for_each(|(to, from)| to.extend_from_slice(from));
        }
        let mut ready = self.pending[0].len() / self.width;
        if ready < self.rows {
            ready -= ready % height;
        }
        self.rows -= ready;
        let taken: Band =
            self.pending.iter_mut().map(|plane| plane.drain(..ready * self.width).collect()).collect();
        let count = ready.div_ceil(height);
        let piece = |i: usize| {
            let part = |plane: &Vec<f32>| {
                plane[i * height * self.width..((i + 1) * height).min(ready) * self.width].to_vec()
            };
            taken.iter().map(part).collect()
        };
        Ok(Some((0..count).map(piece).collect()))
    }
}

/// A value as an integer, rounded to the nearest.
pub(crate) fn quantised(value: f32, largest: f32) -> f32 {
    (value.clamp(0.0, 1.0) * largest).round()
}

#[cfg(test)]
mod tests;
