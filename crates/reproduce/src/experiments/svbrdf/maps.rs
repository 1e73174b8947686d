//! Maps of numbers: the one that is shipped, and what it becomes through a probe.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use anyhow::Context;
use exr::prelude::read_first_flat_layer_from_file;
use lookmatch_materials::Material;
use lookmatch_remap::Probe;
use lookmatch_textures::{Format, Request, convert};

/// Roughness of polished onyx (see `assets/README.md`).
const ROUGHNESS: &[u8] = include_bytes!("../../../assets/onyx-roughness.png");

/// A map of the source's roughness: a code of 8 bits for each texel, 255 for 1.
pub(super) struct Codes {
    pub(super) width: usize,
    pub(super) height: usize,
    codes: Vec<u8>,
    /// The codes that occur, in their order.
    pub(super) levels: Vec<u8>,
}

/// What a conversion made of it, texel by texel.
pub(super) struct Converted {
    pub(super) index: Vec<f32>,
    pub(super) roughness: Vec<f32>,
}

impl Codes {
    pub(super) fn shipped() -> anyhow::Result<Self> {
        let mut reader = png::Decoder::new(Cursor::new(ROUGHNESS)).read_info()?;
        let (width, height) = (reader.info().width as usize, reader.info().height as usize);
        let mut codes = vec![0; reader.output_buffer_size().context("a map has texels")?];
        reader.next_frame(&mut codes)?;
        let mut levels = codes.clone();
        levels.sort_unstable();
        levels.dedup();
        Ok(Self { width, height, codes, levels })
    }

    /// The number of the level at texture coordinates; v runs upwards.
    pub(super) fn level(&self, [u, v]: [f64; 2]) -> usize {
        let (x, y) = ((u * self.width as f64) as usize, ((1.0 - v) * self.height as f64) as usize);
        let code = self.codes[y.min(self.height - 1) * self.width + x.min(self.width - 1)];
        self.levels.partition_point(|level| *level < code)
    }

    /// A level's roughness.
    pub(super) fn roughness(level: u8) -> f64 {
        f64::from(level) / 255.0
    }

    /// The map as numbers.
    pub(super) fn numbers(&self) -> Vec<f32> {
        self.codes.iter().map(|code| Self::roughness(*code) as f32).collect()
    }

    /// Converts the map through a probe as users do, by files in a folder.
    pub(super) fn convert(&self, probe: &Probe, base: &Material, folder: &Path) -> anyhow::Result<Converted> {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make '{}'", folder.display()))?;
        let source = folder.join("source-roughness.png");
        lookmatch_imaging::write_atomically(&source, |out| out.write_all(ROUGHNESS))?;
        let request = Request {
            probe,
            base: base.clone(),
            textures: vec![("roughness".into(), source)],
            channels: Vec::new(),
            encodings: Vec::new(),
            format: Format::parse("exr-float"),
            clamp: true,
            folder: folder.to_owned(),
            band_rows: None,
        };
        let report = convert(&request, &|_| (), &AtomicBool::new(false))?;
        let map = |parameter: &str| -> anyhow::Result<Vec<f32>> {
            let maps = report.maps();
            let found = maps.iter().find(|(_, name)| *name == parameter);
            let (file, _) = found.with_context(|| format!("the conversion has no map of '{parameter}'"))?;
            numbers(&folder.join(file))
        };
        Ok(Converted { index: map("ior")?, roughness: map("roughness_u")? })
    }

    /// For each level, the values of a map where it first occurs.
    pub(super) fn by_level(&self, map: &[f32]) -> Vec<f64> {
        let first = |level: &u8| self.codes.iter().position(|code| code == level).unwrap_or(0);
        self.levels.iter().map(|level| f64::from(map[first(level)])).collect()
    }
}

/// The first channel of an OpenEXR file.
fn numbers(path: &PathBuf) -> anyhow::Result<Vec<f32>> {
    let told = || format!("cannot read '{}'", path.display());
    let image = read_first_flat_layer_from_file(path).with_context(told)?;
    let channel = image.layer_data.channel_data.list.first().with_context(told)?;
    Ok(channel.sample_data.values_as_f32().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_map_is_told_by_its_levels() {
        let map = Codes::shipped().unwrap();
        assert_eq!((map.width, map.height, map.codes.len()), (256, 256, 256 * 256));
        assert!(map.levels.len() > 100 && map.levels.is_sorted());
        let at = |x: usize, y: usize| [(x as f64 + 0.5) / 256.0, 1.0 - (y as f64 + 0.5) / 256.0];
        for (x, y) in [(0, 0), (255, 255), (17, 203)] {
            assert_eq!(map.levels[map.level(at(x, y))], map.codes[256 * y + x]);
        }
        let roughness: Vec<f64> = map.levels.iter().map(|level| Codes::roughness(*level)).collect();
        let found = map.by_level(&map.numbers());
        assert!(roughness.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}
