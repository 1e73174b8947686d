//! `lookmatch scene export`: a scene as files of another renderer.

use lookmatch_rendering::{EXPORT_FORMATS, ExportFormat, Scene, export};
use serde_json::json;

use crate::Usage;
use crate::args::{SceneArgs, SceneCommand, SceneExportArgs};
use crate::output::{print, print_json};

pub(crate) fn run(args: &SceneArgs) -> anyhow::Result<()> {
    match &args.command {
        SceneCommand::Export(args) => run_export(args),
    }
}

fn run_export(args: &SceneExportArgs) -> anyhow::Result<()> {
    let format = format(&args.to)?;
    let scene = Scene::load(&args.scene)?;
    let files = export(&scene, format, args.size, &args.output)?;
    if args.json.json {
        return print_json(&json!({
            "scene": scene.name, "format": format.name, "size": args.size, "files": files,
            "pictures": ["full_point.exr", "full_environment.exr", "diffuse_point.exr", "diffuse_environment.exr"],
        }));
    }
    let list: String = files.iter().map(|file| format!("{}\n", file.display())).collect();
    print(&list)?;
    eprintln!("{} says what to render", args.output.join("README.txt").display());
    Ok(())
}

fn format(name: &str) -> anyhow::Result<&'static ExportFormat> {
    let unknown = || {
        let list: Vec<String> = EXPORT_FORMATS.iter().map(|f| format!("{} ({})", f.name, f.about)).collect();
        Usage(format!("format '{name}' is unknown; use {}", list.join("; ")))
    };
    Ok(ExportFormat::by_name(name).ok_or_else(unknown)?)
}
