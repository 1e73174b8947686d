//! TIFF by way of the `tiff` crate: strips or tiles in, strips out.
//!
//! The crate's image encoder compresses whole images only, not strips that come one by one. So strips are compressed here, on all
//! cores, and the crate writes them and the directory.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Seek, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use half::f16;
use rayon::prelude::*;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::{Rational, TiffEncoder};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, ResolutionUnit, Tag};

use super::{Band, Bands, Container, Depth, Format, Header, Metadata, Pieces, Sheet, quantised};
use crate::TextureError;

/// The largest strip or tile that is decoded, in bytes.
const MAX_CHUNK: usize = 512 << 20;
/// Rows of a strip that is written.
const STRIP_ROWS: usize = 16;
/// Tags that are notes, and what PNG calls them.
const NOTES: [(Tag, &str); 5] = [
    (Tag::ImageDescription, "Description"),
    (Tag::Software, "Software"),
    (Tag::DateTime, "Creation Time"),
    (Tag::Artist, "Author"),
    (Tag::Copyright, "Copyright"),
];

struct TiffBands {
    path: PathBuf,
    decoder: Decoder<BufReader<File>>,
    samples: usize,
    width: usize,
    height: usize,
    /// The decoded strip or tiles of some rows.
    chunks: Vec<DecodingResult>,
    rows: Range<usize>,
}

/// Reads the first image's directory.
pub(super) fn open(path: &Path, file: BufReader<File>) -> Result<(Header, Box<dyn Bands>), TextureError> {
    let wrong = |e: tiff::TiffError| TextureError::undecodable(path, truncated(&e));
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_CHUNK;
    limits.intermediate_buffer_size = MAX_CHUNK;
    let mut decoder = Decoder::new(file).map_err(wrong)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(wrong)?;
    let colour = decoder.colortype().map_err(wrong)?;
    let refused = |what: String| {
        let accepted = "grey or RGB of 8 or 16 bits, half or single floats are accepted";
        TextureError::undecodable(path, format!("it is {what}; {accepted}"))
    };
    let (channels, has_alpha, bits) = match colour {
        ColorType::Gray(bits) => (1, false, bits),
        ColorType::GrayA(bits) => (1, true, bits),
        ColorType::RGB(bits) => (3, false, bits),
        ColorType::RGBA(bits) => (3, true, bits),
        ColorType::Multiband { bit_depth, num_samples: 2 } => (1, true, bit_depth),
        other => return Err(refused(format!("{other:?}"))),
    };
    let planar = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(wrong)?;
    if planar == Some(2) && channels > 1 {
        return Err(refused("stored in a plane for each channel".into()));
    }
    let is_float = matches!(
        decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(wrong)?.as_deref(),
        Some([3, ..])
    );
    let depth = match (bits, is_float) {
        (8, false) => Depth::U8,
        (16, false) => Depth::U16,
        (16, true) => Depth::F16,
        (32, true) => Depth::F32,
        (bits, _) => return Err(refused(format!("{colour:?} of {bits} bits"))),
    };
    let metadata = metadata(&mut decoder);
    let srgb = metadata.icc.as_deref().filter(|p| crate::encoding::icc_is_srgb(p));
    let srgb = srgb.map(|_| "its ICC profile is sRGB's".to_owned());
    let (width, height) = (width as usize, height as usize);
    let header = Header {
        width,
        height,
        format: Format { container: Container::Tiff, depth },
        channels,
        names: format!("{colour:?}"),
        has_alpha,
        metadata,
        srgb,
    };
    let samples = channels + usize::from(has_alpha);
    let bands =
        TiffBands { path: path.into(), decoder, samples, width, height, chunks: Vec::new(), rows: 0..0 };
    Ok((header, Box::new(bands)))
}

fn truncated(error: &tiff::TiffError) -> String {
    match error {
        tiff::TiffError::IoError(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
            format!("it is truncated ({e})")
        }
        tiff::TiffError::LimitsExceeded => {
            "a strip or tile of it is larger than 512 MiB; store it in smaller ones".into()
        }
        other => format!("it is damaged or not supported ({other})"),
    }
}

fn metadata(decoder: &mut Decoder<BufReader<File>>) -> Metadata {
    let mut find = |tag| decoder.find_tag(tag).ok().flatten();
    let text =
        NOTES.iter().filter_map(|(tag, key)| Some(((*key).to_owned(), find(*tag)?.into_string().ok()?)));
    let text = text.collect();
    let icc = find(Tag::IccProfile).and_then(|v| v.into_u8_vec().ok());
    let unit = find(Tag::ResolutionUnit).and_then(|v| v.into_u16().ok()).unwrap_or(2);
    let per_metre = match unit {
        2 => Some(1.0 / 0.0254),
        3 => Some(100.0),
        _ => None,
    };
    let mut density = |tag| match find(tag)? {
        tiff::decoder::ifd::Value::Rational(n, d) if d != 0 => Some(f64::from(n) / f64::from(d)),
        _ => None,
    };
    let both = density(Tag::XResolution).zip(density(Tag::YResolution));
    let resolution = both.zip(per_metre).map(|((x, y), unit)| [x * unit, y * unit]);
    Metadata { text, resolution, icc, exr: None }
}

impl TiffBands {
    /// Decodes the next row of strips or tiles. Only that one is held: some files have all rows in one strip.
    fn decode_next(&mut self) -> Result<(), TextureError> {
        let (chunk_width, chunk_height) = self.decoder.chunk_dimensions();
        let across = self.width.div_ceil(chunk_width as usize);
        let first = self.rows.end / chunk_height as usize * across;
        self.chunks.clear();
        for index in first..first + across {
            let chunk = self.decoder.read_chunk(index as u32);
            self.chunks.push(chunk.map_err(|e| TextureError::undecodable(&self.path, truncated(&e)))?);
        }
        self.rows = self.rows.end..(self.rows.end + chunk_height as usize).min(self.height);
        Ok(())
    }

    /// A row of one channel.
    fn copy(&self, y: usize, channel: usize, plane: &mut Vec<f32>) -> Result<(), TextureError> {
        let chunk_width = self.decoder.chunk_dimensions().0 as usize;
        for (column, chunk) in self.chunks.iter().enumerate() {
            let wide = chunk_width.min(self.width - column * chunk_width);
            let first = (y - self.rows.start) * wide * self.samples;
            let samples = first + channel..first + wide * self.samples;
            let missing = || TextureError::undecodable(&self.path, format!("it is truncated at row {y}"));
            macro_rules! extend {
                ($values:expr, $convert:expr) => {{
                    let values = $values.get(samples).ok_or_else(missing)?;
                    plane.extend(values.iter().step_by(self.samples).map($convert));
                }};
            }
            match chunk {
                DecodingResult::U8(v) => extend!(v, |v| f32::from(*v) / 255.0),
                DecodingResult::U16(v) => extend!(v, |v| f32::from(*v) / 65535.0),
                DecodingResult::F16(v) => extend!(v, |v| v.to_f32()),
                DecodingResult::F32(v) => extend!(v, |v| *v),
                _ => return Err(TextureError::undecodable(&self.path, "its samples are of several kinds")),
            }
        }
        Ok(())
    }
}

impl Bands for TiffBands {
    fn read(&mut self, rows: Range<usize>, planes: &mut [Vec<f32>]) -> Result<(), TextureError> {
        planes.iter_mut().for_each(Vec::clear);
        for y in rows {
            while y >= self.rows.end {
                self.decode_next()?;
            }
            for (channel, plane) in planes.iter_mut().enumerate() {
                self.copy(y, channel, plane)?;
            }
        }
        Ok(())
    }
}

/// Writes strips with Deflate.
pub(super) fn write(
    sheet: &Sheet,
    out: impl Write + Seek + Send,
    bands: &mut dyn Iterator<Item = Arc<Band>>,
) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 20, out);
    write_strips(sheet, &mut out, bands).map_err(|error| match error {
        tiff::TiffError::IoError(error) => error,
        other => io::Error::other(other.to_string()),
    })?;
    out.flush()
}

fn write_strips(
    sheet: &Sheet,
    out: impl Write + Seek,
    bands: &mut dyn Iterator<Item = Arc<Band>>,
) -> tiff::TiffResult<()> {
    let mut encoder = TiffEncoder::new(out)?;
    let mut directory = encoder.image_directory()?;
    let (mut offsets, mut lengths) = (Vec::new(), Vec::new());
    let mut pieces = Pieces::new(sheet, bands);
    while let Some(ready) = pieces.next(STRIP_ROWS)? {
        let strips: Vec<Vec<u8>> =
            ready.par_iter().map(|piece| deflated(&strip(sheet, piece))).collect::<io::Result<_>>()?;
        for strip in strips {
            let offset = directory.write_data(&strip[..])?;
            // A classic TIFF ends at 4 GiB; the crate's own writer would wrap around here.
            offsets.push(u32::try_from(offset)?);
            lengths.push(u32::try_from(strip.len())?);
        }
    }
    let (bits, kind): (u16, u16) = match sheet.format.depth {
        Depth::U8 => (8, 1),
        Depth::U16 => (16, 1),
        Depth::F16 => (16, 3),
        Depth::F32 => (32, 3),
    };
    let photometric = match sheet.channels {
        1 => PhotometricInterpretation::BlackIsZero,
        _ => PhotometricInterpretation::RGB,
    };
    directory.write_tag(Tag::ImageWidth, sheet.width as u32)?;
    directory.write_tag(Tag::ImageLength, sheet.height as u32)?;
    directory.write_tag(Tag::BitsPerSample, &vec![bits; sheet.channels][..])?;
    directory.write_tag(Tag::SampleFormat, &vec![kind; sheet.channels][..])?;
    directory.write_tag(Tag::SamplesPerPixel, sheet.channels as u16)?;
    directory.write_tag(Tag::Compression, CompressionMethod::Deflate)?;
    directory.write_tag(Tag::PhotometricInterpretation, photometric)?;
    directory.write_tag(Tag::RowsPerStrip, STRIP_ROWS as u32)?;
    directory.write_tag(Tag::StripOffsets, &offsets[..])?;
    directory.write_tag(Tag::StripByteCounts, &lengths[..])?;
    if let Some(density) = sheet.metadata.resolution {
        let rational = |v: f64| Rational { n: (v * 0.0254 * 1000.0).round() as u32, d: 1000 };
        directory.write_tag(Tag::XResolution, rational(density[0]))?;
        directory.write_tag(Tag::YResolution, rational(density[1]))?;
        directory.write_tag(Tag::ResolutionUnit, ResolutionUnit::Inch)?;
    }
    if let Some(icc) = &sheet.metadata.icc {
        directory.write_tag(Tag::IccProfile, &icc[..])?;
    }
    for (tag, text) in notes(&sheet.metadata) {
        directory.write_tag(tag, text.as_str())?;
    }
    directory.finish()
}

/// Notes by tag. Those without one are lines of the description. TIFF texts are ASCII by the standard.
fn notes(metadata: &Metadata) -> Vec<(Tag, String)> {
    let ascii = |text: &str| text.chars().map(|c| if c.is_ascii() && c != '\0' { c } else { '?' }).collect();
    let mut notes: Vec<(Tag, String)> = Vec::new();
    let mut description: Vec<String> = Vec::new();
    for (key, text) in &metadata.text {
        match NOTES.iter().find(|(_, name)| name == key) {
            Some((Tag::ImageDescription, _)) => description.insert(0, ascii(text)),
            Some((tag, _)) => notes.push((*tag, ascii(text))),
            None => description.push(ascii(&format!("{key}: {text}"))),
        }
    }
    if !description.is_empty() {
        notes.push((Tag::ImageDescription, description.join("\n")));
    }
    notes
}

/// The samples of a strip, texel by texel, in the machine's byte order: that of the file.
fn strip(sheet: &Sheet, piece: &Band) -> Vec<u8> {
    let texels = piece[0].len();
    let mut bytes = Vec::with_capacity(texels * sheet.channels * 4);
    for texel in 0..texels {
        for plane in piece {
            let value = plane[texel];
            match sheet.format.depth {
                Depth::U8 => bytes.push(quantised(value, 255.0) as u8),
                Depth::U16 => bytes.extend((quantised(value, 65535.0) as u16).to_ne_bytes()),
                Depth::F16 => bytes.extend(f16::from_f32(value).to_ne_bytes()),
                Depth::F32 => bytes.extend(value.to_ne_bytes()),
            }
        }
    }
    bytes
}

fn deflated(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(bytes.len() / 2), Compression::default());
    encoder.write_all(bytes)?;
    encoder.finish()
}
