//! Pictures of a run: written beside its report, and judged.

use std::path::PathBuf;

use anyhow::Context;
use lookmatch_imaging::{Image, Mask, Verdict, error_map, error_scale, jod, nrmsd, write};

use crate::tables::channel_mean;
use crate::{Comparison, Picture, Setting};

/// The pictures of one experiment.
pub(crate) struct Album {
    folder: PathBuf,
    name: &'static str,
}

/// A picture that is to be shown.
pub(crate) struct Shown<'a> {
    /// `source`, `probe`, `copy`.
    pub(crate) title: &'a str,
    /// The material, as it would be typed.
    pub(crate) material: String,
    pub(crate) image: Image,
}

impl Album {
    pub(crate) fn of(setting: &Setting, name: &'static str) -> anyhow::Result<Self> {
        Ok(Self { folder: crate::pictures(&setting.folder)?, name })
    }

    /// The path of a figure, and what a report calls it.
    pub(crate) fn figure(&self, file: &str) -> (PathBuf, String) {
        let file = format!("{}-{file}", self.name);
        (self.folder.join(&file), format!("pictures/{file}"))
    }

    /// Writes a source and those that should look like it, and judges them; `subjects` tells where differences set the scale of the
    /// error maps.
    pub(crate) fn compare(
        &self,
        key: &str,
        title: String,
        source: &Shown,
        others: &[Shown],
        subjects: &Mask,
    ) -> anyhow::Result<Comparison> {
        let scales = others.iter().map(|other| error_scale(&source.image, &other.image, subjects));
        let scale = scales.collect::<Result<Vec<f32>, _>>()?.into_iter().fold(0.0, f32::max);
        let others: Vec<Picture> = others
            .iter()
            .map(|other| self.judged(key, source, other, scale))
            .collect::<anyhow::Result<_>>()?;
        let source = self.picture(key, source)?;
        Ok(Comparison { title, source, others, scale: f64::from(scale) })
    }

    fn judged(&self, key: &str, source: &Shown, other: &Shown, scale: f32) -> anyhow::Result<Picture> {
        let picture = self.picture(key, other)?;
        let (map, _) = error_map(&source.image, &other.image, Some(scale))?;
        let error_file = self.write(&format!("{key}-{}-error", slug(other.title)), &map)?;
        let jod = jod(&source.image, &other.image)?;
        let nrmsd = channel_mean(nrmsd(&source.image, &other.image, None)?);
        Ok(Picture {
            error_file: Some(error_file),
            nrmsd: Some(nrmsd),
            jod: Some(jod),
            verdict: Some(Verdict::of(jod)),
            ..picture
        })
    }

    fn picture(&self, key: &str, shown: &Shown) -> anyhow::Result<Picture> {
        Ok(Picture {
            title: shown.title.into(),
            material: shown.material.clone(),
            file: self.write(&format!("{key}-{}", slug(shown.title)), &shown.image)?,
            error_file: None,
            nrmsd: None,
            jod: None,
            verdict: None,
        })
    }

    fn write(&self, key: &str, image: &Image) -> anyhow::Result<String> {
        let (path, name) = self.figure(&format!("{key}.png"));
        write(&path, image, &[]).with_context(|| format!("cannot write '{}'", path.display()))?;
        Ok(name)
    }
}

/// A title as part of a file's name.
fn slug(title: &str) -> String {
    title.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}
