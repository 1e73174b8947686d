use std::fs;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use lookmatch_materials::Value;
use lookmatch_remap::{Axis, apply};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::files::Band;

/// A quick remap of Ward to GGX: 5 x 5 points, both axes irregular, a switch among the targets.
fn probe() -> Probe {
    Probe::read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src/ward-ggx.json"))).unwrap()
}

/// The same probe with axes of regular levels, and a switch that does change.
fn switching() -> Probe {
    let mut probe = probe();
    probe.source_axes[0] = Axis::regular("specular", 0.0, 0.4, 0.1).unwrap();
    probe.source_axes[1] = Axis::regular("roughness", 0.1, 0.9, 0.2).unwrap();
    for (i, entry) in probe.entries.iter_mut().enumerate() {
        entry.source = vec![probe.source_axes[0].value(i / 5), probe.source_axes[1].value(i % 5)];
        entry.target[0] = f64::from(u8::from((i * 7) % 3 == 0));
    }
    probe
}

fn store(path: &Path, format: &str, width: usize, planes: Band) {
    let format = Format::parse(format).unwrap();
    let sheet = Sheet {
        width,
        height: planes[0].len() / width,
        channels: planes.len(),
        format,
        metadata: Metadata { text: vec![("Author".into(), "A. Turner".into())], ..Metadata::default() },
        is_srgb: false,
    };
    files::write(&sheet, fs::File::create(path).unwrap(), &mut std::iter::once(Arc::new(planes))).unwrap();
}

fn load(path: &Path) -> (Header, Band) {
    let (header, mut bands) = files::open(path).unwrap();
    let mut planes = vec![Vec::new(); header.channels];
    bands.read(0..header.height, &mut planes).unwrap();
    (header, planes)
}

/// Values within a range, its ends among them.
fn random(seed: u64, texels: usize, range: [f64; 2]) -> Vec<f32> {
    let rng = &mut Pcg64Mcg::seed_from_u64(seed);
    let mut plane: Vec<f32> = (0..texels).map(|_| rng.random_range(range[0]..=range[1]) as f32).collect();
    (plane[0], plane[1]) = (range[0] as f32, range[1] as f32);
    plane
}

fn request<'a>(probe: &'a Probe, textures: &[(&str, PathBuf)], folder: &Path) -> Request<'a> {
    Request {
        probe,
        base: probe.from.clone(),
        textures: textures.iter().map(|(n, p)| ((*n).to_owned(), p.clone())).collect(),
        channels: Vec::new(),
        encodings: Vec::new(),
        format: None,
        clamp: false,
        folder: folder.join("out"),
        band_rows: None,
    }
}

fn run(request: &Request) -> Result<Report, TextureError> {
    convert(request, &|_| {}, &AtomicBool::new(false))
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// What `apply` says of the texel whose source values are these.
fn applied(probe: &Probe, values: &[(&str, Value)], parameter: &str) -> Vec<f64> {
    let mut source = probe.from.clone();
    for (name, value) in values {
        match value {
            Value::Number(v) => source.set_number(name, *v).unwrap(),
            colour => source.set_value(source.model().resolve(name).unwrap()[0], colour.clone()).unwrap(),
        }
    }
    let target = apply(probe, &source, true).unwrap().target;
    match &target.values()[target.model().resolve(parameter).unwrap()[0]] {
        Value::Number(v) => vec![*v],
        Value::Colour(c) => c.to_vec(),
        other => panic!("{parameter} is {other:?}"),
    }
}

/// Half of what the format can tell apart, and what single precision leaves of a table.
fn tolerance(format: Format, value: f64) -> f64 {
    format.depth.rounding(value) + 4e-6 * value.abs().max(1.0)
}

#[test]
fn every_texel_equals_apply_in_every_format() {
    let probe = probe();
    let folder = tempfile::tempdir().unwrap();
    let (width, height) = (61, 33);
    let ranges = [[0.02, 0.4], [0.01, 0.69]];
    for (format, output) in [
        ("exr-float", "exr-float"),
        ("exr-half", "exr-half"),
        ("tiff-float", "tiff-float"),
        ("tiff-half", "tiff-half"),
        ("tiff16", "exr-float"),
        ("png16", "exr-float"),
        ("png8", "exr-half"),
    ] {
        let extension = Format::parse(format).unwrap().container.extension();
        let paths = ["specular", "roughness"].map(|n| folder.path().join(format!("{n}.{extension}")));
        for (i, path) in paths.iter().enumerate() {
            store(path, format, width, vec![random(i as u64, width * height, ranges[i])]);
        }
        let textures = [("specular", paths[0].clone()), ("roughness", paths[1].clone())];
        let report = run(&request(&probe, &textures, folder.path())).unwrap();
        assert_eq!(report.parameters["specular"], serde_json::json!([1.0, 1.0, 1.0]));
        assert_eq!(report.parameters["ior"]["format"], output, "{format}");
        assert_eq!(report.parameters["roughness_v"]["texture"], format!("roughness.{extension}"));
        let [specular, roughness] = paths.map(|p| load(&p).1.remove(0));
        for name in ["ior", "roughness"] {
            let written = if name == "ior" { output } else { format };
            let written = Format::parse(written).unwrap();
            let path = folder.path().join(format!("out/{name}.{}", written.container.extension()));
            let (header, planes) = load(&path);
            assert_eq!(header.format, written);
            assert!(header.metadata.text.contains(&("Author".into(), "A. Turner".into())), "{format}");
            for texel in 0..width * height {
                let source = [
                    ("specular", Value::Number(f64::from(specular[texel]))),
                    ("roughness", Value::Number(f64::from(roughness[texel]))),
                ];
                let expected = applied(&probe, &source, name)[0];
                let found = f64::from(planes[0][texel]);
                let error = (found - expected).abs();
                assert!(
                    error <= tolerance(written, expected),
                    "{format} {name}: {found} {expected} {source:?}"
                );
            }
        }
        fs::remove_dir_all(folder.path().join("out")).unwrap();
    }
}

#[test]
fn switches_and_carried_colours_equal_apply_too() {
    let probe = switching();
    let folder = tempfile::tempdir().unwrap();
    let texels = 40 * 40;
    let paths = ["s.exr", "r.exr", "d.exr"].map(|n| folder.path().join(n));
    store(&paths[0], "exr-float", 40, vec![random(1, texels, [0.0, 0.4])]);
    store(&paths[1], "exr-float", 40, vec![random(2, texels, [0.1, 0.9])]);
    store(&paths[2], "exr-float", 40, (3..6).map(|seed| random(seed, texels, [0.0, 0.9])).collect());
    let names = ["specular", "roughness", "diffuse"];
    let textures: Vec<(&str, PathBuf)> = names.into_iter().zip(paths.clone()).collect();
    let report = run(&request(&probe, &textures, folder.path())).unwrap();
    assert!(report.interpolation_error <= crate::TOLERANCE);
    let sources = paths.map(|p| load(&p).1);
    let mut switched = [0, 0];
    for name in ["specular", "ior", "diffuse"] {
        let (_, planes) = load(&folder.path().join(format!("out/{name}.exr")));
        for texel in 0..texels {
            let colour = [0, 1, 2].map(|c| f64::from(sources[2][c][texel]));
            let source = [
                ("specular", Value::Number(f64::from(sources[0][0][texel]))),
                ("roughness", Value::Number(f64::from(sources[1][0][texel]))),
                ("diffuse", Value::Colour(colour)),
            ];
            let expected = applied(&probe, &source, name);
            for (plane, expected) in planes.iter().zip(expected) {
                assert!((f64::from(plane[texel]) - expected).abs() < 1e-5, "{name} {source:?}");
                if name == "specular" {
                    switched[usize::from(expected > 0.5)] += 1;
                }
            }
        }
    }
    assert!(switched.iter().all(|count| *count > 100), "both levels occur: {switched:?}");
}

/// A target whose body lies under an interface: its colour depends on all that was searched, and on the source's colour.
fn covered() -> Probe {
    let mut probe = probe();
    probe.to = Material::parse("gltf").unwrap();
    probe.target_axes.remove(0);
    for entry in &mut probe.entries {
        entry.target.remove(0);
    }
    probe
}

/// The colours of bodies in a map, beside what `apply` says of them.
fn bodies(probe: &Probe, textures: &[(&str, PathBuf)], base: &str) -> (Report, Vec<[f64; 2]>) {
    let folder = tempfile::tempdir().unwrap();
    let mut request = request(probe, textures, folder.path());
    request.base = Material::parse(base).unwrap();
    let report = run(&request).unwrap();
    let (_, planes) = load(&folder.path().join("out/base_color.exr"));
    assert_eq!(planes.len(), 3);
    let sources: Vec<(&str, Band)> = textures.iter().map(|(name, path)| (*name, load(path).1)).collect();
    let texel = |texel: usize| {
        let value = |(name, planes): &(&'static str, Band)| {
            let at = |c: usize| f64::from(planes[c][texel]);
            (*name, if planes.len() == 1 { Value::Number(at(0)) } else { Value::Colour([0, 1, 2].map(at)) })
        };
        let mut values: Vec<(&str, Value)> = Vec::new();
        if !sources.iter().any(|(name, _)| *name == "diffuse") {
            let index = request.base.model().resolve("diffuse").unwrap()[0];
            values.push(("diffuse", request.base.values()[index].clone()));
        }
        for source in &sources {
            let name = ["specular", "roughness", "diffuse"].into_iter().find(|name| *name == source.0);
            values.push(value(&(name.unwrap(), source.1.clone())));
        }
        let expected = applied(probe, &values, "base_color");
        (0..3).map(|c| [f64::from(planes[c][texel]), expected[c]]).collect::<Vec<_>>()
    };
    (report, (0..planes[0].len()).flat_map(texel).collect())
}

#[test]
fn bodies_under_an_interface_are_carried_over_up_to_the_limit_of_their_colour() {
    let probe = covered();
    let folder = tempfile::tempdir().unwrap();
    let texels = 24 * 24;
    let paths = ["s.exr", "r.exr", "d.exr"].map(|n| folder.path().join(n));
    store(&paths[0], "exr-float", 24, vec![random(1, texels, [0.02, 0.4])]);
    store(&paths[1], "exr-float", 24, vec![random(2, texels, [0.01, 0.69])]);
    store(&paths[2], "exr-float", 24, (3..6).map(|seed| random(seed, texels, [0.0, 1.0])).collect());
    let textures =
        [("specular", paths[0].clone()), ("roughness", paths[1].clone()), ("diffuse", paths[2].clone())];
    // The colour in a texture, and two that are the same for all texels: the source is too bright for the target here and there.
    for (textures, base, bright) in [
        (&textures[..], "ward", 200..1500),
        (&textures[..2], "ward:diffuse=0.65/0.65/0.05", 1..400),
        (&textures[..2], "ward:diffuse=0.1/0.65/0.65", 1..400),
        (&textures[..2], "ward:diffuse=0.9/0.8/0.1", 600..1500),
    ] {
        let (report, colours) = bodies(&probe, textures, base);
        assert!(report.interpolation_error <= crate::TOLERANCE, "{base}: {}", report.interpolation_error);
        assert!(report.notes.iter().all(|note| !note.contains("misses")), "{:?}", report.notes);
        let count = colours.iter().filter(|[_, expected]| *expected == 1.0).count();
        assert!(bright.contains(&count), "{base}: {count} colours at the limit");
        let worst = colours.iter().map(|[found, expected]| (found - expected).abs()).fold(0.0, f64::max);
        assert!(worst <= crate::TOLERANCE, "{base}: {worst}");
    }
}

#[test]
fn the_making_of_a_table_is_told_and_can_be_stopped() {
    let probe = covered();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.exr");
    store(&path, "exr-float", 8, vec![random(1, 64, [0.02, 0.4])]);
    let request = request(&probe, &[("specular", path)], folder.path());
    let stop = AtomicBool::new(false);
    let first = |at: Progress| {
        assert!(matches!(at, Progress::Table { parameter: "base_color", points: 1.. }), "{at:?}");
        stop.store(true, Ordering::Relaxed);
    };
    let error = convert(&request, &first, &stop).unwrap_err();
    assert!(stop.load(Ordering::Relaxed), "progress was told");
    assert!(
        matches!(error, TextureError::Interrupted { .. }) && error.to_string().contains("out"),
        "{error}"
    );
    assert!(!request.folder.exists());
}

#[test]
fn bands_and_threads_do_not_show_in_the_bytes() {
    let probe = probe();
    let folder = tempfile::tempdir().unwrap();
    let paths = ["s.png", "r.tif"].map(|n| folder.path().join(n));
    store(&paths[0], "png16", 70, vec![random(1, 70 * 90, [0.02, 0.4])]);
    store(&paths[1], "tiff-half", 70, vec![random(2, 70 * 90, [0.01, 0.69])]);
    let textures = [("specular", paths[0].clone()), ("roughness", paths[1].clone())];
    let mut first: Option<Vec<Vec<u8>>> = None;
    for (rows, threads) in [(None, 1), (Some(1), 1), (Some(7), 3), (Some(64), 2), (Some(90), 4)] {
        for format in ["exr-half", "tiff-float"] {
            let mut request = request(&probe, &textures, folder.path());
            request.band_rows = rows;
            request.format = Format::parse(format);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run(&request)).unwrap();
        }
        let out = folder.path().join("out");
        assert_eq!(names(&out), ["ior.exr", "ior.tif", "material.json", "roughness.exr", "roughness.tif"]);
        let bytes: Vec<Vec<u8>> = names(&out).iter().map(|n| fs::read(out.join(n)).unwrap()).collect();
        match &first {
            Some(first) => assert!(*first == bytes, "bands of {rows:?}, {threads} threads"),
            None => first = Some(bytes),
        }
    }
}

#[test]
fn tiles_are_mapped_each_with_its_own_size() {
    let probe = probe();
    let folder = tempfile::tempdir().unwrap();
    for (tile, width) in [(1001, 16), (1002, 32), (1011, 8)] {
        for (name, range) in [("s", [0.02, 0.4]), ("r", [0.01, 0.69])] {
            let path = folder.path().join(format!("{name}.{tile}.exr"));
            store(&path, "exr-half", width, vec![random(tile, width * 16, range)]);
        }
    }
    let textures =
        [("specular", folder.path().join("s.<UDIM>.exr")), ("roughness", folder.path().join("r.1001.exr"))];
    let report = run(&request(&probe, &textures, folder.path())).unwrap();
    assert_eq!(report.tiles, [1001, 1002, 1011]);
    assert_eq!(report.size, [[16, 16], [32, 16], [8, 16]]);
    assert_eq!(report.parameters["ior"]["texture"], "ior.<UDIM>.exr");
    assert_eq!(load(&folder.path().join("out/ior.1002.exr")).0.width, 32);
    fs::remove_file(folder.path().join("s.1002.exr")).unwrap();
    let error = run(&request(&probe, &textures, folder.path())).unwrap_err().to_string();
    assert!(error.contains("different tiles") && error.contains("1001, 1011"), "{error}");
}

#[test]
fn values_outside_are_counted_and_named_and_nothing_is_written() {
    let probe = probe();
    let folder = tempfile::tempdir().unwrap();
    let mut plane = random(1, 400, [0.01, 0.69]);
    (plane[47], plane[399]) = (0.9, -0.5);
    for tile in [1001, 1002] {
        let inside = random(2, 400, [0.01, 0.69]);
        let plane = if tile == 1002 { plane.clone() } else { inside };
        store(&folder.path().join(format!("r.{tile}.exr")), "exr-float", 20, vec![plane]);
    }
    let textures = [("roughness", folder.path().join("r.<UDIM>.exr"))];
    let mut request = request(&probe, &textures, folder.path());
    request.band_rows = Some(4);
    let error = run(&request).unwrap_err();
    assert!(!error.is_usage());
    let error = error.to_string();
    for words in
        ["2 of 800 values", "[0.01, 0.69]", "x = 7, y = 2 of tile 1002 (0.9)", "x = 19, y = 19", "--clamp"]
    {
        assert!(error.contains(words), "no '{words}' in {error}");
    }
    assert!(!folder.path().join("out").exists());
    request.clamp = true;
    let report = run(&request).unwrap();
    assert!(report.notes.iter().any(|n| n.contains("2 of 800 values")), "{:?}", report.notes);
    let (_, found) = load(&folder.path().join("out/roughness.1002.exr"));
    let expected = applied(&probe, &[("roughness", Value::Number(0.69))], "roughness")[0];
    assert!((f64::from(found[0][47]) - expected).abs() < 1e-6);
    // What is not a number cannot be moved anywhere.
    plane[3] = f32::NAN;
    store(&folder.path().join("r.1002.exr"), "exr-float", 20, vec![plane]);
    let error = run(&request).unwrap_err().to_string();
    assert!(error.contains("1 of 800 values are not finite") && error.contains("x = 3, y = 0"), "{error}");
    assert!(names(&folder.path().join("out")).iter().all(|n| !n.starts_with('.')));
}

#[test]
fn faults_leave_the_folder_as_it_was() {
    let probe = probe();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.exr");
    store(&path, "exr-half", 64, vec![random(1, 64 * 64, [0.01, 0.69])]);
    let textures = [("roughness", path.clone())];
    let mut request = request(&probe, &textures, folder.path());
    request.band_rows = Some(16);
    run(&request).unwrap();
    let before: Vec<Vec<u8>> =
        names(&request.folder).iter().map(|n| fs::read(request.folder.join(n)).unwrap()).collect();
    let unchanged = |what: &str| {
        let out = folder.path().join("out");
        assert_eq!(names(&out), ["ior.exr", "material.json", "roughness.exr"], "{what}");
        let after: Vec<Vec<u8>> = names(&out).iter().map(|n| fs::read(out.join(n)).unwrap()).collect();
        assert!(before == after, "{what}");
    };
    let stop = AtomicBool::new(false);
    let late = |at: Progress| {
        stop.store(matches!(at, Progress::Rows { done, .. } if done >= 32), Ordering::Relaxed);
    };
    let error = convert(&request, &late, &stop).unwrap_err();
    assert!(matches!(error, TextureError::Interrupted { .. }), "{error}");
    assert!(error.to_string().contains("out"), "{error}");
    unchanged("an end by the user");
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
    let error = run(&request).unwrap_err().to_string();
    assert!(error.contains("r.exr") && error.contains("truncated"), "{error}");
    unchanged("a truncated texture");
    fs::write(&path, &whole).unwrap();
    let mut onto_itself = request.clone();
    onto_itself.textures[0].1 = request.folder.join("roughness.exr");
    let error = run(&onto_itself).unwrap_err().to_string();
    assert!(error.contains("one of the textures") || error.contains("outside"), "{error}");
    unchanged("a map onto its own texture");
}

#[test]
fn a_channel_of_a_packed_texture_is_as_good_as_a_texture_of_its_own() {
    let probe = probe();
    let folder = tempfile::tempdir().unwrap();
    let [unused, roughness, specular] =
        [[0.0, 1.0], [0.01, 0.69], [0.02, 0.4]].map(|range| random(7, 32 * 32, range));
    for extension in ["png", "tif", "exr"] {
        let path = |name: &str| folder.path().join(format!("{name}.{extension}"));
        let format = ["png16", "tiff16", "exr-half"].into_iter().find(|f| f.starts_with(extension)).unwrap();
        store(&path("r"), format, 32, vec![roughness.clone()]);
        store(&path("s"), format, 32, vec![specular.clone()]);
        store(&path("orm"), format, 32, vec![unused.clone(), roughness.clone(), specular.clone()]);
        let apart = [("roughness", path("r")), ("specular", path("s"))];
        let together = [("roughness", path("orm")), ("specular", path("orm"))];
        let mut maps = Vec::new();
        for (textures, channels) in
            [(apart, vec![]), (together, vec![("roughness", Channel::G), ("specular", Channel::B)])]
        {
            let mut request = request(&probe, &textures, folder.path());
            request.channels =
                channels.into_iter().map(|(name, channel)| (name.to_owned(), channel)).collect();
            run(&request).unwrap();
            let found = names(&request.folder).into_iter().filter(|name| name != "material.json");
            maps.push(found.map(|name| load(&request.folder.join(name)).1).collect::<Vec<Band>>());
            fs::remove_dir_all(&request.folder).unwrap();
        }
        assert!(maps[0].len() == 2 && maps[0] == maps[1], "{extension}");
        let wrong = |name: &str, file: PathBuf, channel: Channel| {
            let textures = [(name, file)];
            let mut request = request(&probe, &textures, folder.path());
            request.channels = vec![(name.to_owned(), channel)];
            let error = run(&request).unwrap_err();
            assert!(error.is_usage() && error.to_string().contains("one channel of several"), "{error}");
        };
        wrong("roughness", path("r"), Channel::G);
        wrong("roughness", path("orm"), Channel::A);
        wrong("diffuse", path("orm"), Channel::R);
    }
}

#[test]
fn requests_that_make_no_sense_are_refused() {
    let probe = probe();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    store(&path("grey.png"), "png8", 8, vec![vec![0.25; 64]]);
    store(&path("small.png"), "png8", 4, vec![vec![0.25; 16]]);
    store(&path("rgb.png"), "png8", 8, vec![vec![0.25; 64]; 3]);
    let refused = |textures: &[(&str, PathBuf)], format: Option<&str>, words: &[&str]| {
        let mut request = request(&probe, textures, folder.path());
        request.format = format.and_then(Format::parse);
        let error = run(&request).unwrap_err();
        assert!(error.is_usage(), "{error}");
        for word in words {
            assert!(error.to_string().contains(word), "no '{word}' in {error}");
        }
        assert!(!folder.path().join("out").exists(), "{error}");
    };
    refused(&[("roughness", path("rgb.png"))], None, &["rgb.png", "3 channels", "R, G, B", "roughness"]);
    refused(&[("diffuse", path("grey.png"))], None, &["grey.png", "1 channel", "diffuse", "R, G and B"]);
    let sizes = [("roughness", path("grey.png")), ("specular", path("small.png"))];
    refused(&sizes, None, &["8 x 8", "4 x 4", "same size"]);
    refused(&[("roughness", path("grey.png"))], Some("png8"), &["ior", "png8 cannot hold", "exr-half"]);
    refused(&[("roughness_u", path("grey.png"))], None, &["'roughness'", "roughness_u"]);
    refused(&[("rough", path("grey.png"))], None, &["rough"]);
    refused(&[("roughness", path("grey.jpg"))], None, &["grey.jpg", ".png"]);
    refused(&[("variant", path("grey.png"))], None, &["variant"]);
    let twice = [("roughness", path("grey.png")), ("roughness", path("grey.png"))];
    refused(&twice, None, &["two textures"]);
}

#[test]
fn encodings_are_asked_told_and_kept() {
    let probe = probe();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.png");
    let linear: Vec<f32> = (0..256).map(|i| 0.02 + i as f32 / 255.0 * 0.6).collect();
    let encoded: Vec<f32> = linear.iter().map(|v| lookmatch_imaging::srgb_encode(*v)).collect();
    store(&path, "png8", 16, vec![encoded.iter().map(|v| (v * 255.0).round() / 255.0).collect()]);
    let colour = folder.path().join("d.png");
    store(&colour, "png8", 16, vec![linear.clone(); 3]);
    let textures = [("roughness", path), ("diffuse", colour.clone())];
    let mut request = request(&probe, &textures, folder.path());
    request.encodings = vec![("roughness".into(), Encoding::Srgb)];
    request.format = None;
    let report = run(&request).unwrap();
    assert!(
        report.notes.iter().any(|n| n.contains("diffuse") && n.contains("decoded from sRGB")),
        "{:?}",
        report.notes
    );
    assert_eq!(report.parameters["diffuse"]["encoding"], "srgb");
    assert_eq!(report.parameters["roughness_u"]["encoding"], "linear");
    // A colour that nothing changes keeps its codes.
    assert_eq!(load(&folder.path().join("out/diffuse.png")).1, load(&colour).1);
    assert!(load(&folder.path().join("out/diffuse.png")).0.srgb.is_some());
    let (_, found) = load(&folder.path().join("out/roughness.png"));
    let expected = applied(&probe, &[("roughness", Value::Number(f64::from(linear[100])))], "roughness")[0];
    assert!((f64::from(found[0][100]) - expected).abs() < 0.01, "{} {expected}", found[0][100]);
    // Linear codes that went through sRGB in 8 bits leave gaps, which are told.
    let plane: Vec<f32> = (3..160u8).map(|c| lookmatch_imaging::srgb_encode(f32::from(c) / 255.0)).collect();
    store(&folder.path().join("g.png"), "png8", 157, vec![plane]);
    request.textures = vec![("roughness".into(), folder.path().join("g.png"))];
    request.encodings.clear();
    request.clamp = true;
    let report = run(&request).unwrap();
    assert!(
        report.notes.iter().any(|n| n.contains("gaps") && n.contains("--encoding roughness=srgb")),
        "{:?}",
        report.notes
    );
}
