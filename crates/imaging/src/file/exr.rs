//! OpenEXR by way of the `exr` crate, whose names are imported one by one: its prelude replaces `Result`.

use super::{check_dimensions, undecodable};
use crate::{Image, ImageError};
use exr::image::read::image::ReadLayers;
use exr::image::read::layers::ReadChannels;
use exr::image::read::read;
use exr::image::write::WritableImage;
use exr::image::{Encoding, Image as ExrImage, Layer, SpecificChannels};
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::{Header, LayerAttributes, standard_names};
use std::io::Cursor;
use std::panic::catch_unwind;
use std::path::Path;

/// Deflate packs at most 1032 bytes into one, and a pixel has at least three halves; the others pack less.
const MAX_PIXELS_PER_BYTE: usize = 1032 / 6;

/// Decodes the first layer with R, G and B.
///
/// Release 1.74.2 of the crate panics on some damaged B44 files where overflow checks are on (found by our damage
/// tests), so a panic counts as damage. The panic's own message still goes to standard error.
pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<Image, ImageError> {
    catch_unwind(|| decode_layer(path, bytes))
        .unwrap_or_else(|_| Err(undecodable(path, "its pixel data make no sense")))
}

fn decode_layer(path: &Path, bytes: &[u8]) -> Result<Image, ImageError> {
    let meta =
        MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| undecodable(path, error))?;
    let Some(header) = meta.headers.iter().find(|header| has_rgb(header)) else {
        let layers: Vec<String> = meta.headers.iter().map(channel_names).collect();
        return Err(ImageError::Channels { path: path.into(), found: layers.join(" / ") });
    };
    let Vec2(width, height) = header.layer_size;
    check_dimensions(path, width, height, bytes.len().saturating_mul(MAX_PIXELS_PER_BYTE))?;
    let layer = read()
        .no_deep_data()
        .largest_resolution_level()
        // Starting from NaN reveals pixels that a damaged file leaves out.
        .rgb_channels(
            |size, _| (size.width(), vec![[f32::NAN; 3]; size.area()]),
            |(width, pixels), Vec2(x, y), (r, g, b)| pixels[y * *width + x] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| undecodable(path, error))?
        .layer_data;
    let (width, pixels) = layer.channel_data.pixels;
    Image::from_pixels(width, layer.size.height(), pixels)
}

fn has_rgb(header: &Header) -> bool {
    ["R", "G", "B"].iter().all(|name| {
        let mut channels = header.channels.list.iter();
        channels.any(|channel| channel.name.eq(name) && channel.sampling == Vec2(1, 1))
    })
}

fn channel_names(header: &Header) -> String {
    let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    names.join(", ")
}

/// Encodes as 32-bit float with ZIP compression, which loses nothing.
pub(super) fn encode(path: &Path, image: &Image, notes: &[(String, String)]) -> Result<Vec<u8>, ImageError> {
    let mut attributes = LayerAttributes::default();
    for (key, value) in notes {
        let name = attribute_name(path, key)?;
        // OpenEXR strings are UTF-8 by convention; the crate's own constructor accepts Latin-1 only.
        let text = Text::from_slice_unchecked(value.as_bytes());
        attributes.other.insert(name, AttributeValue::Text(text));
    }
    let colour = |Vec2(x, y): Vec2<usize>| {
        let [r, g, b] = image.get(x, y);
        (r, g, b)
    };
    let layer = Layer::new(
        (image.width(), image.height()),
        attributes,
        Encoding::SMALL_LOSSLESS,
        SpecificChannels::rgb(colour),
    );
    let mut bytes = Cursor::new(Vec::new());
    ExrImage::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).map_err(|error| {
        ImageError::Io { path: path.into(), action: "write", source: std::io::Error::other(error) }
    })?;
    Ok(bytes.into_inner())
}

fn attribute_name(path: &Path, key: &str) -> Result<Text, ImageError> {
    let reason = if key.is_empty() || key.len() > 255 || key.contains('\0') {
        "an attribute name has 1 to 255 bytes, none of them zero"
    } else if standard_names::ALL.contains(&key.as_bytes()) {
        "OpenEXR gives this attribute a meaning of its own; choose another name"
    } else {
        return Ok(Text::from_slice_unchecked(key.as_bytes()));
    };
    Err(ImageError::Note { path: path.into(), key: key.into(), reason: reason.into() })
}
