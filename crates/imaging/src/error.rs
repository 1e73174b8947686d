//! Everything that can go wrong with an image, in words for the person who sees it.

use std::io;
use std::path::PathBuf;

/// Why an image could not be read, written, built or compared.
///
/// Each message names the file or field, the value found, and what would be accepted.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The prediction of what people see could not be made.
    #[error("ColorVideoVDP: {0}")]
    Prediction(#[from] colorvideovdp::Error),
    /// The operating system refused: no such file, no permission, disk full.
    #[error("cannot {action} `{}`: {source}", path.display())]
    Io {
        /// The image file.
        path: PathBuf,
        /// `read` or `write`.
        action: &'static str,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file name does not end in a format that can be read or written.
    #[error("cannot {action} `{}`: {found}; accepted are {accepted}", path.display())]
    Extension {
        /// The image file.
        path: PathBuf,
        /// `read` or `write`.
        action: &'static str,
        /// The extension as found, or that there is none.
        found: String,
        /// The accepted extensions.
        accepted: &'static str,
    },
    /// The content is truncated, corrupt, or of a kind that is not supported.
    #[error("`{}` is damaged or not supported: {reason}", path.display())]
    Undecodable {
        /// The image file.
        path: PathBuf,
        /// What the decoder found, and what it needs.
        reason: String,
    },
    /// No layer of an EXR file has full-resolution channels R, G and B.
    #[error("`{}` has the channels {found}; R, G and B are needed, each sampled at every pixel", path.display())]
    Channels {
        /// The image file.
        path: PathBuf,
        /// The channel names found, layer by layer.
        found: String,
    },
    /// A width or height that cannot be believed or handled.
    #[error("`{}` claims {width} x {height} pixels: {reason}", path.display())]
    Dimensions {
        /// The image file.
        path: PathBuf,
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A pixel is NaN or infinite.
    #[error(
        "`{}` has the value {value} in channel {channel} of pixel x = {x}, y = {y} (first of its kind, \
         counted from the top left); only finite values are accepted", path.display()
    )]
    NotFinite {
        /// The image file.
        path: PathBuf,
        /// Column, 0 at the left.
        x: usize,
        /// Row, 0 at the top.
        y: usize,
        /// `R`, `G` or `B`.
        channel: char,
        /// NaN or an infinity.
        value: f32,
    },
    /// A note (key and value stored with the picture) that the format cannot hold.
    #[error("cannot store the note `{key}` in `{}`: {reason}", path.display())]
    Note {
        /// The image file.
        path: PathBuf,
        /// The key of the note.
        key: String,
        /// What the format accepts.
        reason: String,
    },
    /// The list of pixels does not fill the image.
    #[error(
        "an image of {width} x {height} pixels was given {found} pixel values; it needs exactly \
         width x height, and at least one"
    )]
    PixelCount {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Number of pixels given.
        found: usize,
    },
    /// Two images (or an image and a mask) differ in size.
    #[error(
        "sizes differ: {width} x {height} against {other_width} x {other_height} pixels; both must be the same"
    )]
    SizeMismatch {
        /// Width of the first, in pixels.
        width: usize,
        /// Height of the first, in pixels.
        height: usize,
        /// Width of the second, in pixels.
        other_width: usize,
        /// Height of the second, in pixels.
        other_height: usize,
    },
    /// Two lists of pixels (or pixels and weights) differ in length.
    #[error("pixel counts differ: {count} against {other_count}; both must be the same and at least 1")]
    CountMismatch {
        /// Length of the first list.
        count: usize,
        /// Length of the second list.
        other_count: usize,
    },
    /// A weight of the fitness function is negative, NaN or infinite.
    #[error("the fitness weight `{name}` is {value}; it must be finite and not negative")]
    Weight {
        /// Field name in `FitnessWeights`.
        name: &'static str,
        /// The value found.
        value: f64,
    },
    /// A picture that is to be judged has a pixel that is NaN or infinite.
    #[error(
        "{value} in channel {channel} of pixel x = {x}, y = {y} (first of its kind, counted from the top left); \
         only finite values can be compared"
    )]
    Unjudgeable {
        /// Column, 0 at the left.
        x: usize,
        /// Row, 0 at the top.
        y: usize,
        /// `R`, `G` or `B`.
        channel: char,
        /// NaN or an infinity.
        value: f32,
    },
    /// A metric's neighbourhood does not fit into the picture.
    #[error("{metric} needs pictures of at least {least} x {least} pixels; given were {width} x {height}")]
    TooSmall {
        /// The metric.
        metric: &'static str,
        /// Fewest pixels a side.
        least: usize,
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
    /// A mask leaves nothing to average over.
    #[error("the mask has weight 0 at every pixel that counts; at least one must be positive")]
    EmptyMask,
    /// Two lists of numbers cannot be correlated.
    #[error(
        "{count} and {other_count} numbers cannot be correlated: both lists need the same length, at least 2, \
         and finite numbers"
    )]
    Uncorrelated {
        /// Length of the first list.
        count: usize,
        /// Length of the second list.
        other_count: usize,
    },
    /// NRMSD divides by a range that is 0 although the images differ.
    #[error(
        "NRMSD of channel {channel} is not defined: every source pixel has the value {value}, so there is no \
         range to divide by, yet the target differs; use a source image that varies"
    )]
    NoRange {
        /// `R`, `G` or `B`.
        channel: char,
        /// The one value of the source channel.
        value: f64,
    },
    /// The upper end of an error map's colour scale makes no sense.
    #[error("the scale of the error map is {value}; it must be finite and greater than 0")]
    Scale {
        /// The value found.
        value: f32,
    },
    /// Any of the above, with the name of the image (one of several) that it concerns.
    #[error("{what}: {source}")]
    In {
        /// Which image or pair of images.
        what: &'static str,
        /// What is wrong with it.
        source: Box<ImageError>,
    },
}

impl ImageError {
    /// Says which of several images the error is about.
    pub(crate) fn in_image(self, what: &'static str) -> Self {
        Self::In { what, source: Box::new(self) }
    }
}
