//! UDIM: a texture in tiles, numbered 1001 + u + 10 v, one file each.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::TextureError;

/// The files of a texture: one without a number, or one for each tile.
pub(crate) type Tiles = BTreeMap<Option<u32>, PathBuf>;

/// How tiles are asked for: as MaterialX and Arnold write it, and as Houdini does.
const TOKENS: [&str; 2] = ["<UDIM>", "%(UDIM)d"];

/// The files that a name stands for: `r.<UDIM>.exr` and `r.1001.exr` for all tiles that there are, any other name for itself.
///
/// # Errors
/// A folder that cannot be read, or no tile in it.
pub(crate) fn tiles(path: &Path) -> Result<Tiles, TextureError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let Some((before, after)) = split(&name) else {
        return Ok(Tiles::from([(None, path.to_owned())]));
    };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut found = Tiles::new();
    for entry in std::fs::read_dir(folder).map_err(TextureError::io(folder, "read"))? {
        let entry = entry.map_err(TextureError::io(folder, "read"))?;
        let file = entry.file_name().to_string_lossy().into_owned();
        let number = file.strip_prefix(before).and_then(|rest| rest.strip_suffix(after));
        if let Some(tile) = number.and_then(tile) {
            found.insert(Some(tile), path.with_file_name(&file));
        }
    }
    if found.is_empty() {
        let reason = "no such tile; files with a number from 1001 to 1999 in its place are looked for";
        return Err(TextureError::Request(format!("cannot find texture '{}': {reason}", path.display())));
    }
    Ok(found)
}

/// What comes before and after the number.
fn split(name: &str) -> Option<(&str, &str)> {
    if let Some(token) = TOKENS.iter().find(|token| name.contains(**token)) {
        return name.split_once(token);
    }
    let is_apart = |c: Option<char>| c.is_some_and(|c| !c.is_ascii_alphanumeric());
    let (before, after) = name.rsplit_once("1001")?;
    (is_apart(before.chars().next_back()) && is_apart(after.chars().next())).then_some((before, after))
}

fn tile(text: &str) -> Option<u32> {
    let number = text.parse().ok().filter(|n| (1001..=1999).contains(n))?;
    (text.len() == 4).then_some(number)
}

/// The name of a map: `roughness.exr`, `roughness.1001.exr`.
pub(crate) fn map_name(parameter: &str, tile: Option<u32>, extension: &str) -> String {
    match tile {
        Some(tile) => format!("{parameter}.{tile}.{extension}"),
        None => format!("{parameter}.{extension}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_found_by_token_and_by_the_first_number() {
        let folder = tempfile::tempdir().unwrap();
        for name in [
            "r.1001.exr",
            "r.1002.exr",
            "r.1011.exr",
            "r.0999.exr",
            "r.10010.exr",
            "s.1003.exr",
            "r.1004.png",
        ] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let numbers = |name: &str| -> Vec<Option<u32>> {
            tiles(&folder.path().join(name)).unwrap().into_keys().collect()
        };
        let all = [Some(1001), Some(1002), Some(1011)];
        assert_eq!(numbers("r.<UDIM>.exr"), all);
        assert_eq!(numbers("r.%(UDIM)d.exr"), all);
        assert_eq!(numbers("r.1001.exr"), all);
        // Any other number is that tile alone, without its number; 1001 within a word is none.
        assert_eq!(numbers("r.1002.exr"), [None]);
        assert_eq!(numbers("wood1001x.exr"), [None]);
        assert!(tiles(&folder.path().join("q.<UDIM>.exr")).is_err());
        assert_eq!(map_name("ior", Some(1011), "exr"), "ior.1011.exr");
    }
}
