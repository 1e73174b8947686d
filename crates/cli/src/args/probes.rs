//! Arguments of the commands that make something of a probe.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use lookmatch_export::formats;

use super::Json;

#[derive(Args)]
pub(crate) struct ApplyArgs {
    /// The probe file
    pub(crate) probe: PathBuf,
    /// Source parameters: NAME=VALUE; none where the probe's source is a single material
    #[arg(value_name = "NAME=VALUE")]
    pub(crate) values: Vec<String>,
    /// Move values outside the probe's range to its nearest end
    #[arg(long)]
    pub(crate) clamp: bool,
    /// Take values from the probe's fit, where it has one, instead of interpolating in its table
    #[arg(long, conflicts_with = "texture")]
    pub(crate) smooth: bool,
    /// Send the result through another probe; may be repeated
    #[arg(long, value_name = "PROBE", conflicts_with = "texture")]
    pub(crate) then: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) textures: TextureArgs,
    #[command(flatten)]
    pub(crate) json: Json,
}

/// Maps of source parameters, instead of one value for each.
#[derive(Args)]
pub(crate) struct TextureArgs {
    /// A source parameter's texture: .png, .tif or .exr; `<UDIM>` or 1001 in its name for all tiles; :r, :g, :b or :a after it for
    /// one channel of several. May be repeated
    #[arg(long, value_name = "NAME=FILE[:CHANNEL]", requires = "output")]
    pub(crate) texture: Vec<String>,
    /// A source parameter that is the same for all texels; as NAME=VALUE alone
    #[arg(long, value_name = "NAME=VALUE")]
    pub(crate) fix: Vec<String>,
    /// How a texture is encoded: linear or srgb, instead of what is taken for granted
    #[arg(long, value_name = "NAME=ENCODING", requires = "texture")]
    pub(crate) encoding: Vec<String>,
    /// Format of the maps, instead of the textures': png8, png16, tiff8, tiff16, tiff-half, tiff-float, exr-half, exr-float
    #[arg(long, requires = "texture")]
    pub(crate) format: Option<String>,
    /// Folder for the maps of the target's parameters and material.json; made if it does not exist
    #[arg(short, long, value_name = "FOLDER", requires = "texture")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Args)]
pub(crate) struct InspectArgs {
    /// The probe file
    pub(crate) probe: PathBuf,
    /// Draw each target parameter over the source parameters, and a map of the error (.png, .svg)
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct FitArgs {
    /// The probe file
    pub(crate) probe: PathBuf,
    /// The probe with its fit; only the report without it
    #[arg(short, long)]
    pub(crate) output: Option<PathBuf>,
    /// Entries that are rendered again to judge the fit, evenly spread; 0 for none
    #[arg(long, default_value_t = 64)]
    pub(crate) points: usize,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct InvertArgs {
    /// The probe file
    pub(crate) probe: PathBuf,
    /// The probe that leads back
    #[arg(short, long)]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct ComposeArgs {
    /// The probe from A to B
    pub(crate) first: PathBuf,
    /// The probe from B to C
    pub(crate) second: PathBuf,
    /// Move what the second probe cannot take to the nearest value that it can
    #[arg(long)]
    pub(crate) clamp: bool,
    /// The probe from A to C
    #[arg(short, long)]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

#[derive(Args)]
pub(crate) struct ExportArgs {
    /// The probe file
    pub(crate) probe: PathBuf,
    /// The language
    #[arg(long, value_name = "FORMAT", value_parser = export_formats())]
    pub(crate) to: String,
    /// Functions of the probe's fit, where it has some, instead of its table: shorter, and equal to `apply --smooth`
    #[arg(long)]
    pub(crate) smooth: bool,
    /// Give a source parameter a value instead of making it an input; may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    pub(crate) fix: Vec<String>,
    /// The file; where a .cube file cannot hold all parameters, more of them beside it
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) json: Json,
}

fn export_formats() -> PossibleValuesParser {
    formats()
        .iter()
        .map(|format| PossibleValue::new(format.name()).help(format.summary()))
        .collect::<Vec<_>>()
        .into()
}
