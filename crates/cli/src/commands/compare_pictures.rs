//! `lookmatch compare A B`: two pictures, with their difference in numbers.

use std::path::{Path, PathBuf};

use anyhow::Context;
use lookmatch_imaging::{
    FLIP_PIXELS_PER_DEGREE, Image, ImageError, Mask, error_map, flip_map, nrmsd, read, write,
};
use serde_json::json;

use crate::Usage;
use crate::args::CompareArgs;
use crate::commands::create_folder;
use crate::judgement::Judgement;
use crate::output::{print, print_json, score, table};

pub(crate) fn run(args: &CompareArgs, [source, target]: [&PathBuf; 2]) -> anyhow::Result<()> {
    let (a, b) = (read(source)?, read(target)?);
    let mask = args.mask.as_deref().map(|text| checked_mask(text, &a)).transpose()?;
    let both = || format!("'{}' and '{}'", source.display(), target.display());
    a.check_same_size(&b).with_context(both)?;
    let whole = defined(nrmsd(&a, &b, None))?;
    let masked = mask.as_ref().map(|mask| defined(nrmsd(&a, &b, Some(mask)))).transpose()?.flatten();
    let judgement = Judgement::of(&a, &b, mask.as_ref()).with_context(both)?;
    let result = json!({
        "source": source, "target": target, "width": a.width(), "height": a.height(),
        "nrmsd": whole, "nrmsd_masked": masked,
        "metrics": judgement.metrics(), "verdict": judgement.verdict(),
        "share_choosing_correctly": judgement.share_choosing_correctly(),
    });
    if let Some(folder) = &args.output {
        write_pictures(folder, &a, &b)?;
        let text = serde_json::to_string_pretty(&result)?;
        lookmatch_imaging::write_atomically(&folder.join("result.json"), |out| {
            out.write_all(text.as_bytes())
        })?;
    }
    if args.json.json {
        return print_json(&result);
    }
    let row = |name: &str, value: Option<[f64; 3]>| {
        let cells = value.map_or(["-"; 3].map(str::to_owned), |value| value.map(score));
        std::iter::once(name.to_owned()).chain(cells).collect()
    };
    let mut rows =
        vec![["NRMSD", "red", "green", "blue"].map(str::to_owned).to_vec(), row("whole image", whole)];
    rows.extend(mask.is_some().then(|| row("masked", masked)));
    print(&format!("{}\n{}", table(&rows), judgement.text()))?;
    if let Some(folder) = &args.output {
        eprintln!("maps in {}", folder.display());
    }
    Ok(())
}

/// Where the differences lie, and all beside each other.
fn write_pictures(folder: &Path, source: &Image, target: &Image) -> anyhow::Result<()> {
    let (map, scale) = error_map(source, target, None)?;
    let flip = flip_map(source, target, FLIP_PIXELS_PER_DEGREE)?.false_colours(1.0)?;
    create_folder(folder)?;
    write(&folder.join("error.png"), &map, &[("lookmatch:scale".to_owned(), scale.to_string())])?;
    write(&folder.join("flip.png"), &flip, &[])?;
    write(&folder.join("side-by-side.png"), &Image::beside(&[source, target, &map, &flip]), &[])?;
    Ok(())
}

/// Nothing where a channel of the source is flat: there is no range to divide by.
fn defined(nrmsd: Result<[f64; 3], ImageError>) -> anyhow::Result<Option<[f64; 3]>> {
    match nrmsd {
        Err(ImageError::NoRange { .. }) => Ok(None),
        nrmsd => Ok(Some(nrmsd?)),
    }
}

/// A mask that leaves something.
fn checked_mask(text: &str, of: &Image) -> anyhow::Result<Mask> {
    let mask = mask(text, of)?;
    if mask.weights().iter().all(|weight| *weight <= 0.0) {
        return Err(ImageError::EmptyMask).with_context(|| format!("--mask {text}"));
    }
    Ok(mask)
}

/// `disc`, `CX,CY,R` or a picture.
fn mask(text: &str, of: &Image) -> anyhow::Result<Mask> {
    let (width, height) = (of.width(), of.height());
    if text == "disc" {
        let [x, y] = [width, height].map(|side| side as f64 / 2.0);
        return Ok(Mask::disc(width, height, x, y, x.min(y)));
    }
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    if let Some(numbers) = numbers {
        return match numbers[..] {
            [x, y, radius] if numbers.iter().all(|v| v.is_finite()) && radius > 0.0 => {
                Ok(Mask::disc(width, height, x, y, radius))
            }
            _ => {
                let wrong = format!(
                    "--mask {text}: a disc has a middle and a radius above 0, as in 150,150,120 (pixels)"
                );
                Err(Usage(wrong).into())
            }
        };
    }
    let picture = read(Path::new(text)).with_context(|| format!("--mask {text}"))?;
    of.check_same_size(&picture).with_context(|| format!("--mask {text}"))?;
    Ok(Mask::from_luminance(&picture))
}
