//! OpenEXR by way of the block interface of the `exr` crate: scan lines or tiles, in whatever order the file has them.
//!
//! The crate's iterators follow the file, not the image. So every band opens the file anew and picks the blocks that it needs by
//! the offset table; they are decompressed on all cores. Names are imported one by one, because the crate's prelude replaces
//! `Result`.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Seek, Write};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use exr::block::chunk::Chunk;
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::compression::Compression;
use exr::error::Error;
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, ChannelDescription, LineOrder, SampleType, Text};
use exr::meta::header::{Header as ExrHeader, ImageAttributes, LayerAttributes, standard_names};
use exr::meta::{BlockDescription, MetaData};
use half::f16;
use rayon::prelude::*;

use super::{Band, Bands, Container, Depth, Format, Header, Metadata, Pieces, Sheet};
use crate::TextureError;

/// Rows of a block with the compression that files are written with.
const BLOCK_ROWS: usize = 16;

struct ExrBands {
    path: PathBuf,
    layer: usize,
    /// Indices of the channels in the file, in the order in which they are handed out.
    channels: Vec<usize>,
    width: usize,
    height: usize,
    block_rows: usize,
    /// Rows that are decoded and not handed out, by channel.
    pending: Band,
    /// The row after them.
    decoded: usize,
}

/// Reads the header, and chooses the first layer with a single channel or with R, G and B.
pub(super) fn open(path: &Path, file: BufReader<File>) -> Result<(Header, Box<dyn Bands>), TextureError> {
    let wrong = |reason: String| TextureError::undecodable(path, reason);
    let meta = MetaData::read_from_buffered(file, false).map_err(|e| wrong(truncated(&e)))?;
    let found = meta.headers.iter().enumerate().find_map(|(layer, h)| Some((layer, h, texture_channels(h)?)));
    let Some((layer, header, (channels, names, has_alpha))) = found else {
        let found: Vec<String> = meta.headers.iter().map(|h| channel_names(h).join(", ")).collect();
        return Err(wrong(format!(
            "it has the channels {}; one channel, or R, G and B, are accepted, each sampled at every texel",
            found.join(" / ")
        )));
    };
    let samples = channels.iter().map(|c| header.channels.list[*c].sample_type);
    let depth = if samples.clone().all(|s| s == SampleType::F16) { Depth::F16 } else { Depth::F32 };
    let Vec2(width, height) = header.layer_size;
    let metadata = metadata(header);
    let named = metadata.text.iter().find(|(key, _)| key.to_lowercase().contains("colorspace"));
    let srgb = named.filter(|(_, v)| v.to_lowercase().contains("srgb"));
    let srgb = srgb.map(|(key, value)| format!("its attribute {key} says {value}"));
    let bands = ExrBands {
        path: path.into(),
        layer,
        width,
        height,
        block_rows: header.max_block_pixel_size().height(),
        pending: vec![Vec::new(); channels.len()],
        decoded: 0,
        channels,
    };
    let header = Header {
        width,
        height,
        format: Format { container: Container::Exr, depth },
        channels: bands.channels.len(),
        names,
        has_alpha,
        metadata,
        srgb,
    };
    Ok((header, Box::new(bands)))
}

fn channel_names(header: &ExrHeader) -> Vec<String> {
    header.channels.list.iter().map(|c| c.name.to_string()).collect()
}

/// R, G and B, or the one channel beside alpha; with their names, and whether there is an alpha.
fn texture_channels(header: &ExrHeader) -> Option<(Vec<usize>, String, bool)> {
    let names = channel_names(header);
    let last = |name: &String| name.rsplit('.').next().unwrap_or(name).to_owned();
    let index = |wanted: &str| names.iter().position(|name| last(name) == wanted);
    let others: Vec<usize> = (0..names.len()).filter(|i| last(&names[*i]) != "A").collect();
    let chosen = match (index("R"), index("G"), index("B")) {
        (Some(r), Some(g), Some(b)) => vec![r, g, b],
        _ if others.len() == 1 => others,
        _ => return None,
    };
    let is_full = |c: &usize| header.channels.list[*c].sampling == Vec2(1, 1);
    let sound = !header.deep && chosen.iter().all(is_full);
    let shown = chosen.iter().map(|c| names[*c].clone()).collect::<Vec<_>>().join(", ");
    sound.then(|| (chosen, shown, index("A").is_some()))
}

/// What the crate says of a file that ends too early is not what a person would.
fn truncated(error: &Error) -> String {
    let reason = error.to_string();
    if reason.contains("missing bytes") || reason.contains("offset table") || reason.contains("chunk") {
        return format!("it is truncated or damaged ({reason})");
    }
    format!("it is damaged or not supported ({reason})")
}

fn metadata(header: &ExrHeader) -> Metadata {
    let own = &header.own_attributes;
    let mut text: Vec<(String, String)> = (own.other.iter().chain(&header.shared_attributes.other))
        .filter_map(|(key, value)| match value {
            AttributeValue::Text(text) => Some((key.to_string(), text.to_string())),
            _ => None,
        })
        .collect();
    // A hash map has them in any order.
    text.sort();
    for (key, value) in [("Comment", &own.comments), ("Author", &own.owner), ("Software", &own.software_name)]
    {
        text.extend(value.as_ref().map(|value| (key.to_owned(), value.to_string())));
    }
    let per_metre = |inch: f32| f64::from(inch) / 0.0254;
    let aspect = f64::from(header.shared_attributes.pixel_aspect);
    let resolution = own.horizontal_density.map(|d| [per_metre(d), per_metre(d) * aspect]);
    let exr = Some(Box::new((header.shared_attributes.clone(), own.clone())));
    Metadata { text, resolution, icc: None, exr }
}

impl ExrBands {
    /// Decodes the blocks of some rows, which start at a block and end at one.
    fn decode(&self, rows: Range<usize>) -> Result<Band, TextureError> {
        // Release 1.74.2 of the crate panics on some damaged B44 files.
        let decoded = catch_unwind(AssertUnwindSafe(|| self.decode_blocks(rows)));
        let wrong = |reason: String| TextureError::undecodable(&self.path, reason);
        decoded
            .map_err(|_| wrong("it is damaged: its texels make no sense".into()))?
            .map_err(|error| wrong(truncated(&error)))
    }

    fn decode_blocks(&self, rows: Range<usize>) -> Result<Band, Error> {
        let file = BufReader::with_capacity(1 << 18, File::open(&self.path)?);
        let reader = exr::block::read(file, false)?.filter_chunks(true, |_, tile, block| {
            let top = block.pixel_position.y();
            block.layer == self.layer
                && tile.is_largest_resolution_level()
                && top < rows.end
                && top + block.pixel_size.height() > rows.start
        })?;
        use exr::block::reader::ChunksReader;
        let meta = reader.meta_data().clone();
        let chunks: Vec<Chunk> = reader.collect::<Result<_, _>>()?;
        let blocks: Vec<UncompressedBlock> = chunks
            .into_par_iter()
            .map(|chunk| UncompressedBlock::decompress_chunk(chunk, &meta, true))
            .collect::<Result<_, _>>()?;
        // What no block fills would stay NaN, and is noticed.
        let mut planes = vec![vec![f32::NAN; rows.len() * self.width]; self.channels.len()];
        let list = &meta.headers[self.layer].channels;
        for block in &blocks {
            for line in block.lines(list) {
                let Some(plane) = self.channels.iter().position(|c| *c == line.location.channel) else {
                    continue;
                };
                let Vec2(x, y) = line.location.position;
                if !rows.contains(&y) {
                    continue;
                }
                let first = (y - rows.start) * self.width + x;
                let to = &mut planes[plane][first..first + line.location.sample_count];
                samples(list.list[line.location.channel].sample_type, line.value, to);
            }
        }
        Ok(planes)
    }
}

/// Decodes samples in the machine's byte order.
fn samples(kind: SampleType, bytes: &[u8], to: &mut [f32]) {
    match kind {
        SampleType::F16 => {
            let halves = bytes.as_chunks::<2>().0.iter();
            to.iter_mut().zip(halves).for_each(|(to, b)| *to = f16::from_ne_bytes(*b).to_f32());
        }
        SampleType::F32 => {
            let floats = bytes.as_chunks::<4>().0.iter();
            to.iter_mut().zip(floats).for_each(|(to, b)| *to = f32::from_ne_bytes(*b));
        }
        SampleType::U32 => {
            let integers = bytes.as_chunks::<4>().0.iter();
            to.iter_mut().zip(integers).for_each(|(to, b)| *to = u32::from_ne_bytes(*b) as f32);
        }
    }
}

impl Bands for ExrBands {
    fn read(&mut self, rows: Range<usize>, planes: &mut [Vec<f32>]) -> Result<(), TextureError> {
        if rows.end > self.decoded {
            let end = rows.end.next_multiple_of(self.block_rows).min(self.height);
            let band = self.decode(self.decoded..end)?;
            self.pending.iter_mut().zip(band).for_each(|(to, from)| to.extend(from));
            self.decoded = end;
        }
        for (plane, pending) in planes.iter_mut().zip(&mut self.pending) {
            plane.clear();
            plane.extend(pending.drain(..rows.len() * self.width));
        }
        Ok(())
    }
}

/// Writes scan lines with lossless compression of sixteen rows each, on all cores.
pub(super) fn write(
    sheet: &Sheet,
    out: impl Write + Seek + Send,
    bands: &mut dyn Iterator<Item = Arc<Band>>,
) -> io::Result<()> {
    let out = BufWriter::with_capacity(1 << 20, out);
    let header = header(sheet);
    let order = channel_order(sheet);
    let kind = header.channels.list[0].sample_type;
    let mut failed = None;
    let written = exr::block::write(out, [header].into_iter().collect(), true, |meta, writer| {
        let mut pieces = Pieces::new(sheet, bands);
        let mut done = 0;
        while let Some(ready) = pieces.next(BLOCK_ROWS).map_err(|e| keep(&mut failed, e))? {
            let block = |(i, piece): (usize, &Band)| {
                let rows = piece[0].len() / sheet.width;
                let index = BlockIndex {
                    layer: 0,
                    pixel_position: Vec2(0, (done + i) * BLOCK_ROWS),
                    pixel_size: Vec2(sheet.width, rows),
                    level: Vec2(0, 0),
                };
                let data = block_bytes(piece, &order, rows, sheet.width, kind);
                UncompressedBlock { index, data }.compress_to_chunk(&meta.headers)
            };
            let chunks: Vec<_> = ready.par_iter().enumerate().map(block).collect::<Result<_, _>>()?;
            for chunk in chunks {
                writer.write_chunk(done, chunk)?;
                done += 1;
            }
        }
        Ok(())
    });
    match (written, failed) {
        (_, Some(error)) => Err(error),
        (Err(Error::Io(error)), None) => Err(error),
        (Err(error), None) => Err(io::Error::other(error.to_string())),
        (Ok(()), None) => Ok(()),
    }
}

fn keep(place: &mut Option<io::Error>, error: io::Error) -> Error {
    *place = Some(error);
    Error::Aborted
}

/// EXR files have channels in alphabetical order: B, G, R.
fn channel_order(sheet: &Sheet) -> Vec<usize> {
    (0..sheet.channels).rev().collect()
}

/// The rows of a block: for each row, the samples of each channel, in the machine's byte order.
fn block_bytes(piece: &Band, order: &[usize], rows: usize, width: usize, kind: SampleType) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(rows * width * order.len() * 4);
    for row in 0..rows {
        for channel in order {
            let line = &piece[*channel][row * width..(row + 1) * width];
            match kind {
                SampleType::F16 => line.iter().for_each(|v| bytes.extend(f16::from_f32(*v).to_ne_bytes())),
                _ => line.iter().for_each(|v| bytes.extend(v.to_ne_bytes())),
            }
        }
    }
    bytes
}

fn header(sheet: &Sheet) -> ExrHeader {
    let kind = if sheet.format.depth == Depth::F16 { SampleType::F16 } else { SampleType::F32 };
    let names: &[&str] = if sheet.channels == 1 { &["Y"] } else { &["B", "G", "R"] };
    let channel = |name: &&str| ChannelDescription::new(*name, kind, true);
    let size = Vec2(sheet.width, sheet.height);
    let (mut shared, mut own) = match &sheet.metadata.exr {
        Some(kept) => (**kept).clone(),
        None => (ImageAttributes::with_size(size), LayerAttributes::default()),
    };
    if sheet.metadata.exr.is_none() {
        for (key, value) in &sheet.metadata.text {
            note(&mut own, key, value);
        }
        own.horizontal_density = sheet.metadata.resolution.map(|[x, _]| (x * 0.0254) as f32);
        if let Some([x, y]) = sheet.metadata.resolution.filter(|[x, y]| *x > 0.0 && *y > 0.0) {
            shared.pixel_aspect = (y / x) as f32;
        }
    }
    // Only of use to those who look at the map that it was made of.
    own.preview = None;
    // What the crate would refuse as given twice.
    shared.other.retain(|key, _| !own.other.contains_key(key));
    ExrHeader::new(
        Text::new_or_none("texture").unwrap_or_default(),
        size,
        names.iter().map(channel).collect(),
    )
    .with_encoding(Compression::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing)
    .with_shared_attributes(shared)
    .with_attributes(own)
}

fn note(own: &mut LayerAttributes, key: &str, value: &str) {
    let text = Text::from_slice_unchecked(value.as_bytes());
    match key {
        "Comment" => own.comments = Some(text),
        "Author" => own.owner = Some(text),
        "Software" => own.software_name = Some(text),
        _ if key.is_empty() || key.len() > 255 || standard_names::ALL.contains(&key.as_bytes()) => {}
        _ => {
            own.other.insert(Text::from_slice_unchecked(key.as_bytes()), AttributeValue::Text(text));
        }
    }
}

impl Metadata {
    /// Adds a note, for whatever format.
    pub(crate) fn note(&mut self, key: &str, value: &str) {
        self.text.retain(|(k, _)| k != key);
        self.text.push((key.to_owned(), value.to_owned()));
        if let Some(exr) = &mut self.exr {
            exr.0.other.retain(|k, _| !k.eq(key));
            note(&mut exr.1, key, value);
        }
    }
}
