//! PNG of 8 and 16 bits, by way of the `png` crate: rows in, rows out.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufReader, Seek, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use png::text_metadata::{ITXtChunk, TEXtChunk};
use png::{BitDepth, ColorType, Decoder, Info, PixelDimensions, Reader, Transformations, Unit};

use super::{Band, Bands, Container, Depth, Format, Header, Metadata, Pieces, Sheet, quantised};
use crate::TextureError;

/// An interlaced file must be decoded as a whole: 4096 x 4096 texels of 16 bits and three channels, or less.
const MAX_INTERLACED: usize = 128 << 20;

struct PngBands {
    path: PathBuf,
    reader: Reader<BufReader<File>>,
    /// Samples of a texel in the file, alpha included.
    samples: usize,
    depth: Depth,
    width: usize,
    row: Vec<u8>,
    /// The whole image, where it is interlaced.
    whole: Option<Vec<u8>>,
    next: usize,
}

/// Reads up to the first row. Palettes and fewer than 8 bits are expanded.
pub(super) fn open(path: &Path, file: BufReader<File>) -> Result<(Header, Box<dyn Bands>), TextureError> {
    let wrong = |e: png::DecodingError| TextureError::undecodable(path, truncated(&e.to_string()));
    let mut decoder = Decoder::new(file);
    decoder.set_transformations(Transformations::EXPAND);
    let reader = decoder.read_info().map_err(wrong)?;
    let (colour, bits) = reader.output_color_type();
    let info = reader.info();
    let (width, height) = (info.width as usize, info.height as usize);
    let depth = if bits == BitDepth::Sixteen { Depth::U16 } else { Depth::U8 };
    let (channels, names, has_alpha) = match colour {
        ColorType::Grayscale => (1, "Y", false),
        ColorType::GrayscaleAlpha => (1, "Y, A", true),
        ColorType::Rgba => (3, "R, G, B, A", true),
        _ => (3, "R, G, B", false),
    };
    let header = Header {
        width,
        height,
        format: Format { container: Container::Png, depth },
        channels,
        names: names.into(),
        has_alpha,
        metadata: metadata(info),
        srgb: srgb(info),
    };
    let is_interlaced = info.interlaced;
    let samples = channels + usize::from(has_alpha);
    let mut bands =
        PngBands { path: path.into(), reader, samples, depth, width, row: Vec::new(), whole: None, next: 0 };
    if is_interlaced {
        bands.decode_whole()?;
    }
    Ok((header, Box::new(bands)))
}

/// What the decoder says of a file that ends too early is not what a person would.
fn truncated(reason: &str) -> String {
    if reason.contains("nexpected e") || reason.contains("fill whole buffer") {
        return format!("it is truncated ({reason})");
    }
    format!("it is damaged or no PNG ({reason})")
}

fn metadata(info: &Info) -> Metadata {
    let mut text: Vec<(String, String)> =
        info.uncompressed_latin1_text.iter().map(|t| (t.keyword.clone(), t.text.clone())).collect();
    text.extend(
        info.compressed_latin1_text.iter().filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?))),
    );
    text.extend(info.utf8_text.iter().filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?))));
    let resolution = match info.pixel_dims {
        Some(PixelDimensions { xppu, yppu, unit: Unit::Meter }) => Some([f64::from(xppu), f64::from(yppu)]),
        _ => None,
    };
    let icc = info.icc_profile.as_ref().map(|p| p.to_vec());
    Metadata { text, resolution, icc, exr: None }
}

/// What the file says of its encoding. The crate takes an sRGB chunk for gamma as well.
fn srgb(info: &Info) -> Option<String> {
    if info.srgb.is_some() {
        return Some("its sRGB chunk says so".into());
    }
    let gamma = info.gama_chunk.map(|g| g.into_value());
    if let Some(gamma) = gamma.filter(|g| (0.4..0.5).contains(g)) {
        return Some(format!("its gAMA chunk says 1/{:.1}", 1.0 / gamma));
    }
    let profile = info.icc_profile.as_ref()?;
    super::super::encoding::icc_is_srgb(profile).then(|| "its ICC profile is sRGB's".into())
}

impl PngBands {
    fn wrong(&self, error: png::DecodingError) -> TextureError {
        TextureError::undecodable(&self.path, truncated(&error.to_string()))
    }

    fn decode_whole(&mut self) -> Result<(), TextureError> {
        let size = self.reader.output_buffer_size().unwrap_or(usize::MAX);
        if size > MAX_INTERLACED {
            let advice = "it is interlaced and too large for that; store it without interlacing";
            return Err(TextureError::undecodable(&self.path, advice));
        }
        let mut whole = vec![0; size];
        self.reader.next_frame(&mut whole).map_err(|e| self.wrong(e))?;
        self.whole = Some(whole);
        Ok(())
    }
}

impl Bands for PngBands {
    fn read(&mut self, rows: Range<usize>, planes: &mut [Vec<f32>]) -> Result<(), TextureError> {
        planes.iter_mut().for_each(Vec::clear);
        let bytes = if self.depth == Depth::U16 { 2 } else { 1 };
        self.row.resize(self.width * self.samples * bytes, 0);
        for y in rows {
            if let Some(whole) = &self.whole {
                let length = self.row.len();
                self.row.copy_from_slice(&whole[y * length..(y + 1) * length]);
            } else {
                debug_assert_eq!(y, self.next, "rows come from top to bottom");
                let mut row = std::mem::take(&mut self.row);
                let read = self.reader.read_row(&mut row);
                self.row = row;
                if read.map_err(|e| self.wrong(e))?.is_none() {
                    return Err(TextureError::undecodable(&self.path, format!("it is truncated at row {y}")));
                }
            }
            self.next = y + 1;
            for (channel, plane) in planes.iter_mut().enumerate() {
                match self.depth {
                    Depth::U8 => {
                        let codes = self.row[channel..].iter().step_by(self.samples);
                        plane.extend(codes.map(|code| f32::from(*code) / 255.0));
                    }
                    _ => {
                        let codes = self.row.as_chunks::<2>().0[channel..].iter().step_by(self.samples);
                        plane.extend(codes.map(|code| f32::from(u16::from_be_bytes(*code)) / 65535.0));
                    }
                }
            }
        }
        Ok(())
    }
}

/// Remembers what the system refused: the crate's own errors hide its kind, a full disk for one.
struct Remembering<W> {
    out: W,
    failed: Option<io::Error>,
}

impl<W: Write> Write for Remembering<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes).map_err(|error| {
            let shown = io::Error::from(error.kind());
            self.failed = Some(error);
            shown
        })
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Writes rows as they come. A file is compressed by one thread; several maps are written at once.
pub(super) fn write(
    sheet: &Sheet,
    out: impl Write + Seek + Send,
    bands: &mut dyn Iterator<Item = Arc<Band>>,
) -> io::Result<()> {
    let mut out = Remembering { out, failed: None };
    let written = write_rows(sheet, &mut out, bands);
    written.map_err(|error| out.failed.unwrap_or(error))
}

fn write_rows(sheet: &Sheet, out: impl Write, bands: &mut dyn Iterator<Item = Arc<Band>>) -> io::Result<()> {
    let mut info = Info::with_size(sheet.width as u32, sheet.height as u32);
    info.color_type = if sheet.channels == 1 { ColorType::Grayscale } else { ColorType::Rgb };
    info.bit_depth = if sheet.format.depth == Depth::U8 { BitDepth::Eight } else { BitDepth::Sixteen };
    let metadata = &sheet.metadata;
    info.icc_profile = metadata.icc.as_deref().map(Cow::Borrowed);
    if let Some([x, y]) = metadata.resolution {
        info.pixel_dims =
            Some(PixelDimensions { xppu: x.round() as u32, yppu: y.round() as u32, unit: Unit::Meter });
    }
    for (key, text) in metadata.text.iter().filter(|(key, text)| can_hold(key, text)) {
        if text.chars().all(|c| u32::from(c) < 256) {
            info.uncompressed_latin1_text.push(TEXtChunk { keyword: key.clone(), text: text.clone() });
        } else {
            info.utf8_text.push(ITXtChunk::new(key, text));
        }
    }
    let mut encoder = png::Encoder::with_info(out, info)?;
    if sheet.is_srgb && metadata.icc.is_none() {
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    }
    let mut file = encoder.write_header()?;
    let mut writer = file.stream_writer_with_size(1 << 18)?;
    let mut pieces = Pieces::new(sheet, bands);
    let mut bytes = Vec::new();
    while let Some(ready) = pieces.next(16)? {
        for piece in ready {
            bytes.clear();
            for texel in 0..piece[0].len() {
                for plane in &piece {
                    match sheet.format.depth {
                        Depth::U8 => bytes.push(quantised(plane[texel], 255.0) as u8),
                        _ => {
                            bytes.extend_from_slice(&(quantised(plane[texel], 65535.0) as u16).to_be_bytes())
                        }
                    }
                }
            }
            writer.write_all(&bytes)?;
        }
    }
    writer.finish()?;
    Ok(file.finish()?)
}

/// PNG specification, section 11.3.3: keywords have 1 to 79 Latin-1 characters, and zero ends a text.
fn can_hold(key: &str, text: &str) -> bool {
    let is_latin = key.chars().all(|c| c != '\0' && u32::from(c) < 256);
    (1..=79).contains(&key.chars().count()) && is_latin && !text.contains('\0')
}
