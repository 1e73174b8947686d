//! `lookmatch apply --texture`, as users run it.

mod support;

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use support::{json, lookmatch, program, refused};

/// A quick remap of Ward to GGX, tabulated over specular 0.02 to 0.4 and roughness 0.01 to 0.69.
const PROBE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../textures/src/ward-ggx.json");

fn write_png(path: &Path, size: u32, channels: usize, code: impl Fn(usize) -> u8) {
    let mut encoder = png::Encoder::new(File::create(path).unwrap(), size, size);
    encoder.set_color(match channels {
        1 => png::ColorType::Grayscale,
        3 => png::ColorType::Rgb,
        _ => png::ColorType::Rgba,
    });
    encoder.add_text_chunk("Author".into(), "A. Turner".into()).unwrap();
    let codes: Vec<u8> = (0..size as usize * size as usize * channels).map(code).collect();
    encoder.write_header().unwrap().write_image_data(&codes).unwrap();
}

fn read_png(path: &Path) -> (Vec<u8>, png::Info<'static>) {
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    (bytes, reader.info().clone())
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect()
}

#[test]
fn maps_are_named_by_target_parameters_and_the_rest_are_numbers() {
    let folder = tempfile::tempdir().unwrap();
    write_png(&folder.path().join("r.png"), 16, 1, |_| 102);
    write_png(&folder.path().join("d.png"), 16, 3, |i| [200, 100, 50][i % 3]);
    let arguments = [
        "apply",
        PROBE,
        "--texture",
        "roughness=r.png",
        "--texture",
        "diffuse=d.png",
        "--fix",
        "specular=0.2",
        "-o",
        "out",
    ];
    let report = json(folder.path(), &[&arguments[..], &["--json"]].concat());
    let stored: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("out/material.json")).unwrap()).unwrap();
    assert_eq!(report, stored);
    let parameters = &report["parameters"];
    assert_eq!(parameters["roughness_u"]["texture"], "roughness.png");
    assert_eq!(parameters["ior"]["texture"], "ior.exr");
    assert_eq!(parameters["specular"], serde_json::json!([1.0, 1.0, 1.0]));
    assert_eq!(parameters["masking"], "separable");
    // The same as one material through the same probe.
    let one = json(folder.path(), &["apply", PROBE, "specular=0.2", "roughness=0.4", "--json"]);
    let expected = one["target"]["roughness_u"].as_f64().unwrap();
    let (codes, info) = read_png(&folder.path().join("out/roughness.png"));
    assert!(
        codes.iter().all(|c| (f64::from(*c) / 255.0 - expected).abs() <= 0.5 / 255.0),
        "{} {expected}",
        codes[0]
    );
    assert_eq!(info.uncompressed_latin1_text[0].text, "A. Turner");
    let (codes, info) = read_png(&folder.path().join("out/diffuse.png"));
    assert_eq!(codes[..3], [200, 100, 50]);
    assert!(info.srgb.is_some());
    let output = lookmatch(folder.path(), &arguments);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for words in ["out/roughness.png", "out/ior.exr", "out/diffuse.png", "the same everywhere"] {
        assert!(text.contains(words), "no '{words}' in {text}");
    }
    assert!(String::from_utf8_lossy(&output.stderr).contains("decoded from sRGB"));
}

#[test]
fn channels_of_packed_textures_are_chosen_by_letter() {
    let folder = tempfile::tempdir().unwrap();
    write_png(&folder.path().join("packed.png"), 8, 4, |i| [0, 102, 51, 153][i % 4]);
    let map = |textures: &[&str]| {
        let mut arguments = vec!["apply", PROBE, "-o", "out", "--json"];
        textures.iter().for_each(|texture| arguments.extend(["--texture", texture]));
        json(folder.path(), &arguments);
        read_png(&folder.path().join("out/roughness.png")).0[0]
    };
    let expected = |roughness: &str| {
        let one = json(
            folder.path(),
            &["apply", PROBE, "specular=0.2", &format!("roughness={roughness}"), "--json"],
        );
        (255.0 * one["target"]["roughness_u"].as_f64().unwrap()).round() as u8
    };
    let [green, alpha] =
        ["g", "A"].map(|channel| map(&[&format!("roughness=packed.png:{channel}"), "specular=packed.png:b"]));
    assert_eq!([green, alpha], ["0.4", "0.6"].map(expected));
    assert_ne!(green, alpha);
    let arguments =
        ["apply", PROBE, "-o", "out", "--fix", "specular=0.2", "--texture", "roughness=packed.png"];
    refused(folder.path(), &arguments, 2, &["packed.png", "3 channels", "packed.png:r", ":a"]);
}

#[test]
fn faults_are_told_once_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_png(&at("r.png"), 32, 1, |i| if i == 70 { 255 } else { 90 });
    write_png(&at("rgb.png"), 32, 3, |_| 90);
    write_png(&at("other.png"), 16, 1, |_| 50);
    let whole = fs::read(at("rgb.png")).unwrap();
    fs::write(at("cut.png"), &whole[..whole.len() - 40]).unwrap();
    let run = |texture: &[&str], code: i32, words: &[&str]| {
        let arguments = [&["apply", PROBE, "-o", "out"][..], texture].concat();
        refused(folder.path(), &arguments, code, words);
        assert!(!at("out").exists(), "{texture:?} left something");
    };
    let fix = ["--fix", "specular=0.2"];
    let with = |texture: &'static str| [&["--texture", texture][..], &fix].concat();
    run(&with("roughness=r.png"), 1, &["1 of 1024 values", "x = 6, y = 2", "[0.01, 0.69]", "--clamp"]);
    run(&with("roughness=rgb.png"), 2, &["rgb.png", "3 channels"]);
    run(&with("roughness=none.png"), 1, &["none.png"]);
    run(&with("diffuse=cut.png"), 2, &["roughness", "--texture roughness=FILE"]);
    run(
        &["--texture", "diffuse=cut.png", "--fix", "specular=0.2", "roughness=0.3"],
        1,
        &["cut.png", "truncated"],
    );
    run(&["--texture", "roughness=r.png", "--texture", "specular=other.png"], 2, &["32 x 32", "16 x 16"]);
    run(
        &["--texture", "roughness=r.png", "--fix", "roughness=0.2", "specular=0.2"],
        2,
        &["roughness", "both"],
    );
    run(&["--texture", "roughness"], 2, &["NAME=FILE"]);
    run(&[&with("roughness=r.png")[..], &["--format", "jpeg"]].concat(), 2, &["jpeg", "exr-half"]);
    run(
        &[&with("roughness=r.png")[..], &["--encoding", "roughness=gamma"]].concat(),
        2,
        &["gamma", "linear"],
    );
    // A texture as long as it should be, and one that ends too early.
    let made =
        [&["apply", PROBE, "-o", "made", "--format", "exr-half"][..], &with("roughness=r.png"), &["--clamp"]];
    let output = lookmatch(folder.path(), &made.concat());
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{told}");
    for words in ["1 of 1024 values", "x = 6, y = 2", "moved to the nearest end"] {
        assert!(told.contains(words), "no '{words}' in {told}");
    }
    let whole = fs::read(at("made/roughness.exr")).unwrap();
    fs::write(at("cut.exr"), &whole[..whole.len() - 100]).unwrap();
    run(&with("roughness=cut.exr"), 1, &["cut.exr", "truncated"]);
    // What textures do not go through is refused, not left out.
    for unsupported in [&["--smooth"][..], &["--then", PROBE]] {
        let arguments = [&with("roughness=r.png")[..], unsupported].concat();
        run(&arguments, 2, &[unsupported[0], "--texture", "cannot be used with"]);
    }
    refused(
        folder.path(),
        &["apply", PROBE, "-o", "out", "specular=0.2", "roughness=0.3"],
        2,
        &["--texture"],
    );
}

/// A file that may not grow any further is as good as a full disk.
#[cfg(unix)]
#[test]
fn a_disk_that_is_full_is_told_and_nothing_is_left() {
    let folder = tempfile::tempdir().unwrap();
    write_png(&folder.path().join("r.png"), 512, 1, |i| {
        20 + ((i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as u8 % 101
    });
    let script = format!(
        "trap '' XFSZ; ulimit -f 40; exec {} apply {PROBE} --texture roughness=r.png --fix specular=0.2 -o out",
        env!("CARGO_BIN_EXE_lookmatch")
    );
    let output =
        std::process::Command::new("sh").args(["-c", &script]).current_dir(folder.path()).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(
        message.contains("cannot write '") && message.contains("out/") && message.contains("large"),
        "{message}"
    );
    assert_eq!(entries(folder.path()).len(), 1, "{:?}", entries(folder.path()));
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_nothing_half_written() {
    let folder = tempfile::tempdir().unwrap();
    write_png(&folder.path().join("r.png"), 6144, 1, |i| 20 + ((i / 7) % 101) as u8);
    let out = folder.path().join("out");
    let mut command = program(folder.path());
    command.args(["apply", PROBE, "--texture", "roughness=r.png", "--fix", "specular=0.2", "-o", "out"]);
    let child =
        command.stderr(std::process::Stdio::piped()).stdout(std::process::Stdio::piped()).spawn().unwrap();
    // Its work has begun once there is something in the folder.
    while !out.is_dir() || entries(&out).is_empty() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("interrupted") && message.contains("nothing was written"), "{message}");
    assert!(!out.exists());
}
