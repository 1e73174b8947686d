//! One tile: a thread for each file, and bands of rows between them.
//!
//! Readers decode a band ahead, writers encode a band behind, and the bands between are mapped on all cores. A few bands are in
//! memory at any time, whatever the size of the textures.

use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Scope, ScopedJoinHandle};

use rayon::prelude::*;

use crate::TextureError;
use crate::bake::Baked;
use crate::convert::{Texture, is_stopped};
use crate::encoding::{self, Codes, Encoding};
use crate::files::{self, Band, Depth, Sheet};

/// Texels that a core maps at a time.
const CHUNK: usize = 1 << 15;
/// Places that a message names.
const NAMED: usize = 3;

/// What is read.
pub(crate) struct Reading {
    path: PathBuf,
    depth: Depth,
    encoding: Encoding,
    channels: usize,
    /// The plane that is used, if not all of them are.
    plane: Option<usize>,
    codes: Codes,
}

impl Reading {
    pub(crate) fn new(texture: &Texture, tile: Option<u32>) -> Self {
        let plane = texture.channel.and_then(|channel| channel.plane(&texture.header));
        Self {
            path: texture.tiles[&tile].clone(),
            depth: texture.header.format.depth,
            encoding: texture.encoding,
            channels: texture.header.channels.max(plane.map_or(0, |plane| plane + 1)),
            plane,
            codes: texture.codes.clone(),
        }
    }
}

/// A tile that is to be mapped.
pub(crate) struct Job<'a> {
    pub(crate) baked: &'a Baked,
    pub(crate) tile: Option<u32>,
    pub(crate) size: (usize, usize),
    pub(crate) band_rows: usize,
    /// The maps and where they are written.
    pub(crate) maps: Vec<(Sheet, PathBuf)>,
    pub(crate) readings: Vec<Reading>,
    pub(crate) clamp: bool,
}

/// Texels that cannot be mapped.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outside {
    /// Finite ones.
    pub(crate) count: usize,
    /// NaN and infinite ones.
    pub(crate) invalid: usize,
    texels: usize,
    least: f32,
    most: f32,
    first: Vec<String>,
    first_invalid: Vec<String>,
}

impl Outside {
    fn note(&mut self, value: f32, place: impl FnOnce() -> String) {
        if !value.is_finite() {
            self.invalid += 1;
            if self.first_invalid.len() < NAMED {
                self.first_invalid.push(place());
            }
            return;
        }
        (self.least, self.most) =
            if self.count == 0 { (value, value) } else { (self.least.min(value), self.most.max(value)) };
        self.count += 1;
        if self.first.len() < NAMED {
            self.first.push(place());
        }
    }

    /// With those of another tile.
    pub(crate) fn add(&mut self, other: &Self) {
        if other.count > 0 {
            let is_first = self.count == 0;
            self.least = if is_first { other.least } else { self.least.min(other.least) };
            self.most = if is_first { other.most } else { self.most.max(other.most) };
        }
        self.count += other.count;
        self.invalid += other.invalid;
        self.texels += other.texels;
        self.first.extend(other.first.iter().cloned());
        self.first.truncate(NAMED);
        self.first_invalid.extend(other.first_invalid.iter().cloned());
        self.first_invalid.truncate(NAMED);
    }

    pub(crate) fn text(&self, range: [f64; 2]) -> String {
        format!(
            "{} of {} values ({} to {}) lie outside the probe's range [{}, {}], first at {}",
            self.count,
            self.texels,
            self.least,
            self.most,
            range[0],
            range[1],
            self.first.join("; ")
        )
    }

    pub(crate) fn invalid_text(&self) -> String {
        format!(
            "{} of {} values are not finite, first at {}; no range has room for them",
            self.invalid,
            self.texels,
            self.first_invalid.join("; ")
        )
    }

    pub(crate) fn places_text(&self) -> String {
        format!("{} texels, first at {}", self.count, self.first.join("; "))
    }
}

/// What was seen in a texture.
#[derive(Default)]
pub(crate) struct Seen {
    pub(crate) codes: Codes,
    pub(crate) outside: Outside,
}

/// What was seen in a tile.
#[derive(Default)]
pub(crate) struct Found {
    pub(crate) inputs: Vec<Seen>,
    /// Texels for which the probe has no result.
    pub(crate) missing: Outside,
}

type Rows = Result<(Band, Codes), TextureError>;
type Writer<'s> = (SyncSender<Arc<Band>>, ScopedJoinHandle<'s, Result<(), TextureError>>);

/// Maps a tile. Once a texel lies outside the probe's range, the rest is only looked at: all of them are to be told.
pub(crate) fn stream(job: &Job, progress: &dyn Fn(usize), stop: &AtomicBool) -> Result<Found, TextureError> {
    std::thread::scope(|scope| {
        let readers: Vec<Receiver<Rows>> =
            job.readings.iter().map(|reading| reader(scope, reading, job)).collect();
        let mut writers: Option<Vec<Writer>> =
            Some(job.maps.iter().map(|(sheet, path)| writer(scope, sheet, path)).collect());
        let mut found = Found {
            inputs: job.readings.iter().map(|_| Seen::default()).collect(),
            missing: Outside::default(),
        };
        let height = job.size.1;
        for first in (0..height).step_by(job.band_rows) {
            if is_stopped(stop) {
                return Err(TextureError::interrupted());
            }
            let bands = next_bands(&readers, &mut found, job, first)?;
            let is_doomed =
                found.inputs.iter().any(|i| i.outside.invalid > 0 || (i.outside.count > 0 && !job.clamp));
            if is_doomed {
                writers = None;
            }
            if let Some(writers) = &mut writers {
                let maps = mapped(job, &bands);
                found.missing.texels += maps.first().map_or(0, |m| m[0].len());
                for map in &maps {
                    note_missing(&mut found.missing, job, first, map);
                }
                let sent = writers.iter().zip(maps).all(|((to, _), map)| to.send(Arc::new(map)).is_ok());
                if !sent {
                    break;
                }
            }
            progress((first + job.band_rows).min(height));
        }
        finish(writers.unwrap_or_default()).map(|()| found)
    })
}

/// Waits for the last rows. Where one map fails, the others are given up: its error counts, not theirs.
fn finish(writers: Vec<Writer>) -> Result<(), TextureError> {
    let (ends, threads): (Vec<_>, Vec<_>) = writers.into_iter().unzip();
    drop(ends);
    let failed = || Err(TextureError::Request("a map could not be written: its encoder failed".into()));
    let results = threads.into_iter().map(|thread| thread.join().unwrap_or_else(|_| failed()));
    let mut errors: Vec<TextureError> = results.filter_map(Result::err).collect();
    let own = errors.iter().position(|error| !error.is_given_up()).unwrap_or(0);
    if errors.is_empty() { Ok(()) } else { Err(errors.swap_remove(own)) }
}

/// Starts to read a texture; bands end with the last row or the first error.
fn reader<'s>(scope: &'s Scope<'s, '_>, reading: &'s Reading, job: &Job) -> Receiver<Rows> {
    let (to, from) = sync_channel(1);
    let (height, step) = (job.size.1, job.band_rows);
    scope.spawn(move || {
        let mut bands = match files::open(&reading.path) {
            Ok((_, bands)) => bands,
            Err(error) => return drop(to.send(Err(error))),
        };
        let mut codes = reading.codes.clone();
        for first in (0..height).step_by(step) {
            let mut planes = vec![Vec::new(); reading.channels];
            if let Err(error) = bands.read(first..(first + step).min(height), &mut planes) {
                return drop(to.send(Err(error)));
            }
            if let Some(plane) = reading.plane {
                planes = vec![planes.swap_remove(plane)];
            }
            for plane in &mut planes {
                let is_byte = reading.depth == Depth::U8;
                if is_byte {
                    codes.add(plane);
                }
                if reading.encoding == Encoding::Srgb {
                    encoding::decode(plane, is_byte);
                }
            }
            // Whoever listened has stopped.
            if to.send(Ok((planes, codes.clone()))).is_err() {
                return;
            }
        }
    });
    from
}

/// Starts to write a map of the bands that come.
fn writer<'s>(scope: &'s Scope<'s, '_>, sheet: &'s Sheet, path: &'s PathBuf) -> Writer<'s> {
    let (to, from) = sync_channel::<Arc<Band>>(1);
    let thread = scope.spawn(move || {
        let name = path.file_name().unwrap_or_default();
        // The final name, not the one in the place beside it.
        let shown = path.parent().and_then(|p| p.parent()).map_or(path.clone(), |folder| folder.join(name));
        let file = File::create(path).map_err(TextureError::io(&shown, "create"))?;
        let written = files::write(sheet, &file, &mut from.iter()).and_then(|()| file.sync_all());
        written.map_err(TextureError::io(&shown, "write"))
    });
    (to, thread)
}

/// The next rows of all textures, looked through for values outside the probe's range.
fn next_bands(
    readers: &[Receiver<Rows>],
    found: &mut Found,
    job: &Job,
    first: usize,
) -> Result<Vec<Band>, TextureError> {
    let mut bands = Vec::new();
    for (i, from) in readers.iter().enumerate() {
        let path = &job.readings[i].path;
        let band = from.recv().unwrap_or_else(|_| Err(TextureError::undecodable(path, "its decoder failed")));
        let (planes, codes) = band?;
        let (input, seen) = (&job.baked.inputs[i], &mut found.inputs[i]);
        seen.codes = codes;
        let [min, max] = input.range;
        let depth = job.readings[i].depth;
        let range = [(min - depth.rounding(min)) as f32, (max + depth.rounding(max)) as f32];
        for (channel, plane) in planes.iter().enumerate() {
            seen.outside.texels += plane.len();
            // NaN is in no range.
            let outside = |v: f32| !(range[0]..=range[1]).contains(&v);
            if !plane.iter().fold(false, |any, v| any | outside(*v)) {
                continue;
            }
            for (texel, value) in plane.iter().enumerate().filter(|(_, v)| outside(**v)) {
                let name = if input.is_colour { ["R", "G", "B"][channel] } else { "" };
                seen.outside.note(*value, || place(job, first, texel, name, Some(*value)));
            }
        }
        bands.push(planes);
    }
    Ok(bands)
}

/// `x = 3, y = 7 of tile 1001 (0.812)`.
fn place(job: &Job, first: usize, texel: usize, channel: &str, value: Option<f32>) -> String {
    let (x, y) = (texel % job.size.0, first + texel / job.size.0);
    let tile = job.tile.map_or(String::new(), |tile| format!(" of tile {tile}"));
    let value = value
        .map_or(String::new(), |v| format!(" ({channel}{}{v})", if channel.is_empty() { "" } else { " " }));
    format!("x = {x}, y = {y}{tile}{value}")
}

fn note_missing(missing: &mut Outside, job: &Job, first: usize, map: &Band) {
    for (texel, _) in map[0].iter().enumerate().filter(|(_, v)| v.is_nan()) {
        missing.note(0.0, || place(job, first, texel, "", None));
    }
}

/// The maps of some rows.
fn mapped(job: &Job, bands: &[Band]) -> Vec<Band> {
    let texels = bands[0][0].len();
    let mut maps: Vec<Band> =
        job.maps.iter().map(|(sheet, _)| vec![vec![0.0; texels]; sheet.channels]).collect();
    // By chunk, the part of each plane of each map.
    let mut chunks: Vec<Vec<Vec<&mut [f32]>>> = Vec::new();
    chunks.resize_with(texels.div_ceil(CHUNK), Vec::new);
    for map in &mut maps {
        chunks.iter_mut().for_each(|chunk| chunk.push(Vec::new()));
        for plane in map {
            for (chunk, part) in chunks.iter_mut().zip(plane.chunks_mut(CHUNK)) {
                if let Some(map) = chunk.last_mut() {
                    map.push(part);
                }
            }
        }
    }
    chunks.into_par_iter().enumerate().for_each(|(i, mut outputs)| {
        let texels = i * CHUNK..((i + 1) * CHUNK).min(texels);
        let inputs: Vec<Vec<&[f32]>> =
            bands.iter().map(|band| band.iter().map(|plane| &plane[texels.clone()]).collect()).collect();
        job.baked.evaluate(&inputs, &mut outputs);
        for ((sheet, _), planes) in job.maps.iter().zip(&mut outputs) {
            if sheet.is_srgb {
                planes.iter_mut().for_each(|plane| encoding::encode(plane));
            }
        }
    });
    maps
}
