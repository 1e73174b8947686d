//! From textures to textures: what is asked, what comes out, and the folder that has all of it or nothing.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use lookmatch_materials::Material;
use lookmatch_remap::{Probe, RemapError};

use crate::TOLERANCE;
use crate::TextureError;
use crate::bake::{Baked, Input, Map};
use crate::encoding::{Codes, Encoding, named_srgb};
use crate::files::{self, Channel, Container, Depth, Format, Header, Metadata, Sheet};
use crate::report::{self, Report};
use crate::stream::{Job, Outside, Reading, stream};
use crate::udim::{Tiles, map_name, tiles};

/// What to make of which textures.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// The probe.
    pub probe: &'a Probe,
    /// The source material, with the values of all parameters that have no texture.
    pub base: Material,
    /// Source parameters and their textures; `<UDIM>` or 1001 in a name stands for all tiles.
    pub textures: Vec<(String, PathBuf)>,
    /// Source parameters whose textures are one channel of a packed one.
    pub channels: Vec<(String, Channel)>,
    /// Source parameters whose textures are encoded otherwise than is taken for granted.
    pub encodings: Vec<(String, Encoding)>,
    /// Format of the maps; that of the most precise texture if `None`, and floats where it cannot hold the values.
    pub format: Option<Format>,
    /// Move values outside the probe's range to its nearest end.
    pub clamp: bool,
    /// The folder for the maps and `material.json`.
    pub folder: PathBuf,
    /// Rows that are mapped together; as many as make a million texels if `None`.
    pub band_rows: Option<usize>,
}

/// What a conversion is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// A table of a target parameter that is carried over, which needs as many points as it takes.
    Table {
        /// The parameter.
        parameter: &'static str,
        /// Points that are known.
        points: usize,
    },
    /// Rows of all tiles.
    Rows {
        /// Rows that are mapped.
        done: usize,
        /// Rows in all.
        total: usize,
    },
}

/// A texture with what was found out about it.
pub(crate) struct Texture {
    pub(crate) tiles: Tiles,
    pub(crate) encoding: Encoding,
    pub(crate) header: Header,
    /// The one of its channels that is used, if it is packed.
    pub(crate) channel: Option<Channel>,
    pub(crate) codes: Codes,
    pub(crate) outside: Outside,
}

/// Maps textures through a probe. The folder has all maps afterwards, or none of them.
///
/// Two source parameters make one map of each target parameter that varies with
/// them; the others are in the report alone, which is `material.json` as well.
///
/// # Errors
/// What `apply` refuses; files that cannot be read or written; textures of another size, set of tiles or number of channels;
/// texels outside the probe's range, unless `clamp`; an end by `stop`.
pub fn convert(
    request: &Request,
    progress: &(dyn Fn(Progress) + Sync),
    stop: &AtomicBool,
) -> Result<Report, TextureError> {
    converted(request, progress, stop).map_err(|error| match error {
        TextureError::Interrupted { .. } => TextureError::Interrupted { folder: request.folder.clone() },
        other => other,
    })
}

fn converted(
    request: &Request,
    progress: &(dyn Fn(Progress) + Sync),
    stop: &AtomicBool,
) -> Result<Report, TextureError> {
    let base = base(request)?;
    let names: Vec<String> = request.textures.iter().map(|(name, _)| name.clone()).collect();
    let baked = Baked::new(request.probe, &base, &names, progress, stop)?;
    if let Some(twice) =
        baked.inputs.iter().enumerate().find(|(i, a)| baked.inputs[..*i].iter().any(|b| a.name == b.name))
    {
        return Err(TextureError::Request(format!("'{}' has two textures", twice.1.name)));
    }
    let mut notes = Vec::new();
    for (name, error) in baked.errors().filter(|(_, error)| *error > TOLERANCE) {
        notes.push(format!(
            "{name} is carried over by a table, which misses what `apply` says by up to {error:.1e} of its range"
        ));
    }
    let mut textures = open_all(request, &baked, &mut notes)?;
    let folder = Folder::new(&request.folder)?;
    let formats = formats(request, &baked, &textures, &mut notes)?;
    let numbers: Vec<Option<u32>> = textures[0].tiles.keys().copied().collect();
    let sizes = sizes(&baked, &textures)?;
    let total: usize = sizes.iter().map(|(_, height)| height).sum();
    let mut done = 0;
    let mut written = Vec::new();
    let mut missing = Outside::default();
    for (tile, (width, height)) in numbers.iter().zip(&sizes) {
        let sheets = sheets(&baked, &textures, &formats, *tile, request)?;
        let paths: Vec<PathBuf> = (baked.maps.iter().zip(&sheets))
            .map(|(map, sheet)| PathBuf::from(map_name(&map.name, *tile, sheet.format.container.extension())))
            .collect();
        folder.check(&paths, &textures)?;
        let job = Job {
            baked: &baked,
            tile: *tile,
            size: (*width, *height),
            band_rows: request.band_rows.unwrap_or_else(|| band_rows(*width)).max(1),
            maps: sheets.iter().cloned().zip(paths.iter().map(|p| folder.staged(p))).collect(),
            readings: textures.iter().map(|t| Reading::new(t, *tile)).collect(),
            clamp: request.clamp,
        };
        let found = stream(&job, &|rows| progress(Progress::Rows { done: done + rows, total }), stop)?;
        for (texture, seen) in textures.iter_mut().zip(found.inputs) {
            texture.codes = seen.codes;
            texture.outside.add(&seen.outside);
        }
        missing.add(&found.missing);
        written.extend(paths);
        done += height;
        progress(Progress::Rows { done, total });
    }
    check_domain(request, &baked, &textures, &missing, &mut notes)?;
    look_at_values(&baked, &textures, &mut notes);
    let report = report::report(request.probe, &base, &baked, &textures, &formats, &sizes, notes);
    folder.keep(&written, &report)?;
    Ok(report)
}

/// The source's other parameters, within the probe's range.
fn base(request: &Request) -> Result<Material, TextureError> {
    let mut base = request.base.clone();
    let model = base.model();
    for axis in request.probe.source_axes.iter().filter(|_| request.clamp) {
        let indices = model.resolve(&axis.name).map_err(RemapError::from)?;
        let has_texture = request.textures.iter().any(|(n, _)| model.resolve(n).is_ok_and(|i| i == indices));
        let value = base.number(&axis.name).map_err(RemapError::from)?;
        let inside = value.clamp(axis.value(0), axis.value(axis.len() - 1));
        if !has_texture && inside != value {
            base.set_number(&axis.name, inside).map_err(RemapError::from)?;
        }
    }
    Ok(base)
}

/// A million texels, in whole blocks of whatever a file is made of.
fn band_rows(width: usize) -> usize {
    ((1 << 20) / width).next_multiple_of(64).max(64)
}

/// Opens the first tile of each texture, and decides how it is encoded.
fn open_all(request: &Request, baked: &Baked, notes: &mut Vec<String>) -> Result<Vec<Texture>, TextureError> {
    let model = request.base.model();
    for (name, _) in &request.encodings {
        let known = |input: &Input| model.resolve(name).is_ok_and(|i| model.resolve(&input.name) == Ok(i));
        if !baked.inputs.iter().any(known) {
            return Err(TextureError::Request(format!("--encoding {name}: '{name}' has no texture")));
        }
    }
    let mut textures: Vec<Texture> = Vec::new();
    for (input, (_, path)) in baked.inputs.iter().zip(&request.textures) {
        let tiles = tiles(path)?;
        let first = tiles.values().next().unwrap_or(path);
        let (header, _) = files::open(first)?;
        let indices = model.resolve(&input.name).map_err(RemapError::from)?;
        let is_own = |name: &String| model.resolve(name).is_ok_and(|i| i == indices);
        let channel = request.channels.iter().find(|(name, _)| is_own(name)).map(|(_, channel)| *channel);
        check_channels(input, first, &header, channel)?;
        if header.has_alpha && channel != Some(Channel::A) {
            notes.push(format!("{}: the alpha channel of '{}' is not used", input.name, first.display()));
        }
        if path == first && tiles.len() > 1 {
            notes.push(format!(
                "{}: '{}' is one of {} tiles; all are mapped",
                input.name,
                path.display(),
                tiles.len()
            ));
        }
        let asked = request.encodings.iter().find(|(name, _)| is_own(name));
        let encoding = encoding(input, first, &header, asked.map(|(_, e)| *e), notes);
        if let Some(other) = textures.first().filter(|other| other.tiles.keys().ne(tiles.keys())) {
            let list = |tiles: &Tiles| -> String {
                let names = tiles.keys().map(|t| t.map_or("a single file".into(), |t| t.to_string()));
                names.collect::<Vec<_>>().join(", ")
            };
            return Err(TextureError::Request(format!(
                "the textures have different tiles: {} has {}, {} has {}",
                baked.inputs[0].name,
                list(&other.tiles),
                input.name,
                list(&tiles)
            )));
        }
        let (codes, outside) = (Codes::default(), Outside::default());
        textures.push(Texture { tiles, encoding, header, channel, codes, outside });
    }
    Ok(textures)
}

fn check_channels(
    input: &Input,
    path: &Path,
    header: &Header,
    channel: Option<Channel>,
) -> Result<(), TextureError> {
    let wanted = if input.is_colour { 3 } else { 1 };
    let is_there = match channel {
        Some(channel) => !input.is_colour && channel.plane(header).is_some(),
        None => header.channels == wanted,
    };
    if is_there {
        return Ok(());
    }
    let chosen = match channel {
        Some(channel) => format!("; :{channel:?} takes one channel of several, alpha of PNG and TIFF alone"),
        None if input.is_colour => String::new(),
        None => format!("; '{}:r', ':g', ':b' or ':a' takes one of several", path.display()),
    };
    let what =
        if input.is_colour { "a colour, which needs R, G and B" } else { "one number, which needs one" };
    Err(TextureError::Request(format!(
        "'{}' has {} channel{} ({}), but {} is {what}{chosen}",
        path.display(),
        header.channels,
        if header.channels == 1 { "" } else { "s" },
        header.names,
        input.name
    )))
}

/// How a texture is decoded: as asked; colours in integers as sRGB; anything else as it is.
fn encoding(
    input: &Input,
    path: &Path,
    header: &Header,
    asked: Option<Encoding>,
    notes: &mut Vec<String>,
) -> Encoding {
    let (name, file) = (&input.name, path.display());
    if let Some(asked) = asked {
        return asked;
    }
    let reason = header.srgb.clone().or_else(|| named_srgb(path));
    if input.is_colour && header.format.depth.is_integer() {
        let why = reason.unwrap_or_else(|| "it is a colour in integers".into());
        notes.push(format!(
            "{name}: '{file}' is decoded from sRGB, because {why}; --encoding {name}=linear if not"
        ));
        return Encoding::Srgb;
    }
    if let Some(reason) = reason {
        let advice = format!("its values are taken as they are; --encoding {name}=srgb decodes them");
        notes.push(format!("{name}: '{file}' looks sRGB-encoded, because {reason}; {advice}"));
    }
    Encoding::Linear
}

/// Width and height of each tile, the same for all textures.
fn sizes(baked: &Baked, textures: &[Texture]) -> Result<Vec<(usize, usize)>, TextureError> {
    let mut sizes = Vec::new();
    for tile in textures[0].tiles.keys() {
        let mut first: Option<(&Path, (usize, usize))> = None;
        for (input, texture) in baked.inputs.iter().zip(textures) {
            let path = texture.tiles[tile].as_path();
            let (header, _) = files::open(path)?;
            check_channels(input, path, &header, texture.channel)?;
            if header.channels != texture.header.channels {
                return Err(TextureError::Request(format!(
                    "'{}' has the channels {}, another tile of {} has {}; all tiles must have the same",
                    path.display(),
                    header.names,
                    input.name,
                    texture.header.names
                )));
            }
            let size = (header.width, header.height);
            match first {
                Some((other, wanted)) if wanted != size => {
                    return Err(TextureError::Request(format!(
                        "'{}' has {} x {} texels, '{}' has {} x {}; textures of one tile must have the same size",
                        other.display(),
                        wanted.0,
                        wanted.1,
                        path.display(),
                        size.0,
                        size.1
                    )));
                }
                _ => first = Some((path, size)),
            }
        }
        sizes.extend(first.map(|(_, size)| size));
    }
    Ok(sizes)
}

/// The format of each map.
fn formats(
    request: &Request,
    baked: &Baked,
    textures: &[Texture],
    notes: &mut Vec<String>,
) -> Result<Vec<Format>, TextureError> {
    let sources = textures.iter().map(|t| t.header.format);
    let precise = sources.clone().map(|f| f.depth).max().unwrap_or(Depth::F32);
    let usual = sources.into_iter().find(|f| f.depth == precise);
    let usual = request.format.or(usual).unwrap_or(Format { container: Container::Exr, depth: Depth::F32 });
    let one = |map: &Map| {
        let fits = map.range[0] >= 0.0 && map.range[1] <= 1.0;
        if fits || !usual.depth.is_integer() {
            return Ok(usual);
        }
        let found = format!("{} lies between {:.4} and {:.4}", map.name, map.range[0], map.range[1]);
        if request.format.is_some() {
            let advice = "use --format exr-half, exr-float, tiff-half or tiff-float";
            return Err(TextureError::Request(format!(
                "{found}, which {} cannot hold; {advice}",
                usual.name()
            )));
        }
        let depth = if usual.depth == Depth::U8 { Depth::F16 } else { Depth::F32 };
        let format = Format { container: Container::Exr, depth };
        notes.push(format!("{found}, which {} cannot hold: written as {}", usual.name(), format.name()));
        Ok(format)
    };
    baked.maps.iter().map(one).collect()
}

/// What is written for each map of a tile, with what the textures of that tile say of themselves.
fn sheets(
    baked: &Baked,
    textures: &[Texture],
    formats: &[Format],
    tile: Option<u32>,
    request: &Request,
) -> Result<Vec<Sheet>, TextureError> {
    let headers = textures.iter().map(|t| Ok(files::open(&t.tiles[&tile])?.0));
    let headers = headers.collect::<Result<Vec<Header>, TextureError>>()?;
    let one = |(map, format): (&Map, &Format)| {
        let (base, is_srgb) = (base_texture(baked, textures, map), is_srgb(baked, textures, map, *format));
        let mut metadata: Metadata = headers[base].metadata.clone();
        headers.iter().for_each(|other| metadata.complete(&other.metadata));
        // A profile tells how samples are encoded; it stays true only where they still are.
        let was_srgb = textures[base].encoding == Encoding::Srgb;
        if was_srgb != is_srgb || !format.depth.is_integer() {
            metadata.icc = None;
        }
        let (from, to) = (request.base.model().name, request.probe.to.model().name);
        metadata
            .note("lookmatch", &format!("{} of {to}, from textures of {from}", map.parameters.join(", ")));
        let (width, height) = (headers[0].width, headers[0].height);
        Sheet { width, height, channels: map.channels, format: *format, metadata, is_srgb }
    };
    Ok(baked.maps.iter().zip(formats).map(one).collect())
}

/// The texture whose notes a map has: the colour's that it carries over, else the first that it depends on.
fn base_texture(baked: &Baked, textures: &[Texture], map: &Map) -> usize {
    let inputs = baked.inputs_of(map);
    let chosen = inputs.iter().find(|i| i.is_colour).or(inputs.first());
    let place = chosen.and_then(|c| baked.inputs.iter().position(|i| i.name == c.name));
    place.unwrap_or(0).min(textures.len() - 1)
}

/// Whether the integers of a map are sRGB-encoded: those of colours are, if the texture's were.
pub(crate) fn is_srgb(baked: &Baked, textures: &[Texture], map: &Map, format: Format) -> bool {
    let inputs = baked.inputs.iter().zip(textures);
    let encoded = inputs.filter(|(i, t)| i.is_colour && t.encoding == Encoding::Srgb);
    let names: Vec<&str> = encoded.map(|(i, _)| i.name.as_str()).collect();
    let depends = baked.inputs_of(map).iter().any(|i| names.contains(&i.name.as_str()));
    map.channels == 3 && depends && format.depth.is_integer()
}

fn check_domain(
    request: &Request,
    baked: &Baked,
    textures: &[Texture],
    missing: &Outside,
    notes: &mut Vec<String>,
) -> Result<(), TextureError> {
    let mut wrong = Vec::new();
    for (input, texture) in baked.inputs.iter().zip(textures) {
        let outside = &texture.outside;
        if outside.invalid > 0 {
            wrong.push(format!("{}: {}", input.name, outside.invalid_text()));
        }
        if outside.count == 0 {
            continue;
        }
        let text = format!("{}: {}", input.name, outside.text(input.range));
        if request.clamp {
            notes.push(format!("{text}; moved to the nearest end"));
        } else {
            wrong.push(format!("{text}; --clamp moves them to the nearest end"));
        }
    }
    if missing.count > 0 {
        wrong.push(format!("the probe has no result for {}", missing.places_text()));
    }
    if wrong.is_empty() { Ok(()) } else { Err(TextureError::Domain(wrong.join("\n"))) }
}

fn look_at_values(baked: &Baked, textures: &[Texture], notes: &mut Vec<String>) {
    for (input, texture) in baked.inputs.iter().zip(textures) {
        let is_byte = texture.header.format.depth == Depth::U8;
        if is_byte && texture.encoding == Encoding::Linear && texture.codes.look_encoded() {
            notes.push(format!(
                "{}: the texture looks sRGB-encoded, because its values have the gaps that this leaves; they were taken as \
                 they are; --encoding {}=srgb decodes them",
                input.name, input.name
            ));
        }
    }
}

/// The folder of the maps, and the place beside them where they are written first.
struct Folder {
    path: PathBuf,
    staging: Option<tempfile::TempDir>,
    /// It did not exist.
    is_new: bool,
}

impl Folder {
    fn new(path: &Path) -> Result<Self, TextureError> {
        let is_new = !path.exists();
        std::fs::create_dir_all(path).map_err(TextureError::io(path, "create"))?;
        let mut folder = Self { path: path.into(), staging: None, is_new };
        let staging = tempfile::Builder::new().prefix(".lookmatch-").tempdir_in(path);
        folder.staging = Some(staging.map_err(TextureError::io(path, "write"))?);
        Ok(folder)
    }

    fn staged(&self, name: &Path) -> PathBuf {
        self.staging.as_ref().map_or(&*self.path, |s| s.path()).join(name)
    }

    /// Refuses maps that would replace a texture or a folder.
    fn check(&self, names: &[PathBuf], textures: &[Texture]) -> Result<(), TextureError> {
        for name in names {
            let target = self.path.join(name);
            let Ok(real) = target.canonicalize() else { continue };
            let is_source = |path: &PathBuf| path.canonicalize().is_ok_and(|p| p == real);
            if textures.iter().any(|t| t.tiles.values().any(is_source)) {
                let advice = "give another folder";
                return Err(TextureError::Request(format!(
                    "'{}' is one of the textures; {advice}",
                    target.display()
                )));
            }
            if real.is_dir() {
                return Err(TextureError::Request(format!("'{}' is a folder", target.display())));
            }
        }
        Ok(())
    }

    /// Gives everything its name.
    fn keep(mut self, names: &[PathBuf], report: &Report) -> Result<(), TextureError> {
        let text = serde_json::to_string_pretty(report).unwrap_or_default() + "\n";
        let json = Path::new("material.json");
        let staged = self.staged(json);
        std::fs::write(&staged, text).map_err(TextureError::io(&self.path.join(json), "write"))?;
        for name in names.iter().map(PathBuf::as_path).chain([json]) {
            let target = self.path.join(name);
            std::fs::rename(self.staged(name), &target).map_err(TextureError::io(&target, "write"))?;
        }
        self.is_new = false;
        Ok(())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        drop(self.staging.take());
        if self.is_new {
            // Fails where someone else has put something there, which is then theirs.
            let _ = std::fs::remove_dir(&self.path);
        }
    }
}

/// True once the user wants an end.
pub(crate) fn is_stopped(stop: &AtomicBool) -> bool {
    stop.load(Ordering::Relaxed)
}

#[cfg(test)]
#[path = "convert_tests.rs"]
mod tests;
