//! Light that is kept on disk: the same to the bit, built once, and never trusted blindly.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, SystemTime};

use lookmatch_imaging::Image;
use lookmatch_materials::Material;
use lookmatch_rendering::{EnvironmentLight, Illumination, Part, Progress, Renderer, Scene, TransportCache};
use rayon::prelude::*;
use tempfile::TempDir;

const SIZE: usize = 16;

/// A renderer, and what was told while it was made.
fn made(
    scene: &Scene,
    light: Illumination,
    size: usize,
    cache: &TransportCache,
) -> (Renderer, Vec<Progress>) {
    let told = Mutex::new(Vec::new());
    let renderer =
        Renderer::cached(scene, light, size, cache, &|event| told.lock().unwrap().push(event)).unwrap();
    (renderer, told.into_inner().unwrap())
}

/// True where the light was prepared; false where it was read.
fn is_built(scene: &Scene, light: Illumination, size: usize, cache: &TransportCache) -> bool {
    let (_, told) = made(scene, light, size, cache);
    assert_ne!(told.contains(&Progress::Prepared), told.contains(&Progress::Loaded), "{told:?}");
    told.contains(&Progress::Prepared)
}

fn pictures(renderer: &Renderer) -> Vec<Image> {
    let texts = ["ggx:roughness=0.1", "ward:roughness_u=0.1,roughness_v=0.3", "lambert:diffuse=0.2/0.4/0.6"];
    let picture = |text: &str| renderer.render(&Material::parse(text).unwrap(), Part::Full);
    texts.into_iter().map(picture).collect()
}

fn kept(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

fn warnings(told: &[Progress]) -> Vec<&String> {
    told.iter().filter_map(|p| if let Progress::Warning(text) = p { Some(text) } else { None }).collect()
}

/// A sphere in empty space: little to prepare.
fn bare() -> Scene {
    Scene { plane: None, ..Scene::reference() }
}

#[test]
fn kept_light_gives_the_same_bits() {
    let folder = TempDir::new().unwrap();
    let cache = TransportCache::new(folder.path().join("made/when/needed"));
    let mut coloured = Scene::reference();
    coloured.spheres[0].diffuse = Some([0.5, 0.3, 0.1]);
    for (scene, light) in [(coloured, Illumination::All), (bare(), Illumination::Environment)] {
        let expected = Renderer::prepare(&scene, light, SIZE).unwrap().keep_transport();
        let expected = (pictures(&expected), expected.subjects().to_vec(), expected.mask().clone());
        let (built, told) = made(&scene, light, SIZE, &cache);
        assert_eq!(told.last(), Some(&Progress::Prepared));
        let shares: Vec<f64> = told
            .iter()
            .filter_map(|p| if let Progress::Preparing(s) = p { Some(*s) } else { None })
            .collect();
        assert!(shares[0] == 0.0 && shares.contains(&1.0) && shares.iter().all(|s| (0.0..=1.0).contains(s)));
        let (read, told) = made(&scene, light, SIZE, &cache);
        assert_eq!(told, [Progress::Loaded]);
        // What is kept already is not gathered again.
        for renderer in [built, read.keep_transport()] {
            let found = (pictures(&renderer), renderer.subjects().to_vec(), renderer.mask().clone());
            assert!(found == expected, "{} {light:?}", scene.name);
        }
    }
}

/// The light that an anisotropic lobe looks up is baked by whichever thread comes first, while all others wait.
#[test]
fn kept_light_is_baked_from_any_thread() {
    let folder = TempDir::new().unwrap();
    let cache = TransportCache::new(folder.path());
    let brushed = Material::parse("ward:roughness_u=0.1,roughness_v=0.3").unwrap();
    let scene = Scene { camera: Scene::spheres().camera, ..Scene::reference() };
    let (built, _) = made(&scene, Illumination::Point, SIZE, &cache);
    let expected = built.render(&brushed, Part::Full);
    for _ in 0..4 {
        let (read, told) = made(&scene, Illumination::Point, SIZE, &cache);
        assert_eq!(told, [Progress::Loaded]);
        let pictures: Vec<Image> =
            (0..16).into_par_iter().map(|_| read.render(&brushed, Part::Full)).collect();
        assert!(pictures.iter().all(|picture| *picture == expected));
    }
}

#[test]
fn damage_anywhere_is_found_and_mended() {
    let folder = TempDir::new().unwrap();
    let (scene, cache) = (bare(), TransportCache::new(folder.path()));
    let (renderer, _) = made(&scene, Illumination::Point, SIZE, &cache);
    let expected = pictures(&renderer);
    let [file] = kept(folder.path()).try_into().unwrap();
    let good = fs::read(&file).unwrap();
    let flipped = |place: usize| {
        let mut bytes = good.clone();
        bytes[place] ^= 0x10;
        bytes
    };
    let places = [0, 9, 20, 44, 51, good.len() / 3, good.len() / 2, good.len() - 40, good.len() - 1];
    let mut damaged: Vec<Vec<u8>> = places.into_iter().map(flipped).collect();
    damaged.extend([0, 7, 60, good.len() / 2, good.len() - 1].map(|len| good[..len].to_vec()));
    damaged.push([&good[..], b"more"].concat());
    damaged.push(b"a file of something else".to_vec());
    for bytes in damaged {
        fs::write(&file, &bytes).unwrap();
        let (renderer, told) = made(&scene, Illumination::Point, SIZE, &cache);
        let [warning] = warnings(&told)[..] else { panic!("{told:?}") };
        assert!(warning.contains(file.to_str().unwrap()) && !warning.contains('\n'), "{warning}");
        assert_eq!(told.last(), Some(&Progress::Prepared));
        assert_eq!(pictures(&renderer), expected);
        assert_eq!(fs::read(&file).unwrap(), good, "written again");
    }
    // Whole, but of something else.
    let (_, _) = made(&scene, Illumination::Environment, SIZE, &cache);
    let other = kept(folder.path()).into_iter().find(|f| *f != file).unwrap();
    fs::copy(&other, &file).unwrap();
    assert_eq!(warnings(&made(&scene, Illumination::Point, SIZE, &cache).1).len(), 1);
}

#[test]
fn a_file_belongs_to_what_the_light_depends_on() {
    let folder = TempDir::new().unwrap();
    let cache = TransportCache::new(folder.path().join("cache"));
    let map = |name: &str, value: f32| -> Scene {
        let path = folder.path().join(name);
        let image = Image::from_fn(8, 4, |x, y| [value, x as f32, y as f32]);
        lookmatch_imaging::write(&path, &image, &[]).unwrap();
        let light = EnvironmentLight::of(path.to_str().unwrap());
        Scene { environment: Some(light), ..bare() }
    };
    let point = |scene: &Scene| is_built(scene, Illumination::Point, SIZE, &cache);
    let environment = |scene: &Scene| is_built(scene, Illumination::Environment, SIZE, &cache);

    assert!(point(&bare()));
    let mut moved = bare();
    moved.spheres[0].radius = 1.0 - 1e-15;
    assert!(point(&moved), "another scene");
    assert!(is_built(&bare(), Illumination::Point, SIZE + 1, &cache), "another size");
    assert!(environment(&bare()), "another light");
    assert!(is_built(&bare(), Illumination::All, SIZE, &cache), "both lights");
    assert!(environment(&Scene { environment: Some(EnvironmentLight::of("interior")), ..bare() }));

    assert!(environment(&map("a.exr", 1.0)));
    assert!(!environment(&map("b.exr", 1.0)), "the same map of another name");
    assert!(environment(&map("a.exr", 2.0)), "another map of the same name");
    assert!(!point(&map("c.exr", 3.0)), "a map that is not lit");
    assert!(!point(&Scene { name: "called otherwise".into(), ..bare() }));
    assert!(!environment(&map("A.EXR", 2.0)), "the same map of a name in capitals");
}

#[test]
fn a_map_that_is_gone_is_missed_at_once_or_never() {
    let folder = TempDir::new().unwrap();
    let cache = TransportCache::new(folder.path().join("cache"));
    let map = folder.path().join("map.exr");
    lookmatch_imaging::write(&map, &Image::from_fn(8, 4, |x, y| [1.0, x as f32, y as f32]), &[]).unwrap();
    let scene = Scene { environment: Some(EnvironmentLight::of(map.to_str().unwrap())), ..bare() };
    let (built, _) = made(&scene, Illumination::Environment, SIZE, &cache);
    let (read, told) = made(&scene, Illumination::Environment, SIZE, &cache);
    assert_eq!(told, [Progress::Loaded]);
    fs::remove_file(&map).unwrap();
    // Kept light does without the map, anisotropic lobes too, whose light is baked only now; …
    assert!(pictures(&read) == pictures(&built));
    // … but it is found by the map's content.
    match Renderer::cached(&scene, Illumination::Environment, SIZE, &cache, &|_| ()) {
        Ok(_) => panic!("accepted"),
        Err(error) => assert!(error.to_string().contains("map.exr"), "{error}"),
    }
}

#[test]
fn several_at_once_build_once() {
    let folder = TempDir::new().unwrap();
    let cache = TransportCache::new(folder.path());
    let build = || is_built(&bare(), Illumination::Point, 48, &cache);
    let builds: Vec<bool> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..3).map(|_| scope.spawn(build)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(builds.iter().filter(|built| **built).count(), 1);
    assert_eq!(kept(folder.path()).len(), 1, "no lock and nothing half-written is left");
}

#[test]
fn a_folder_that_cannot_be_used_is_warned_of() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let (renderer, told) = made(&bare(), Illumination::Point, SIZE, &TransportCache::new(&file));
    assert!(matches!(warnings(&told)[..], [text] if text.contains(file.to_str().unwrap())), "{told:?}");
    assert_eq!(told.last(), Some(&Progress::Prepared));
    // A folder where the file should be can neither be read nor replaced.
    let cache = TransportCache::new(folder.path().join("cache"));
    made(&bare(), Illumination::Point, SIZE, &cache);
    let [file] = kept(&folder.path().join("cache")).try_into().unwrap();
    fs::remove_file(&file).unwrap();
    fs::create_dir(&file).unwrap();
    let (again, told) = made(&bare(), Illumination::Point, SIZE, &cache);
    assert!(told.contains(&Progress::Prepared) && warnings(&told).len() == 2, "{told:?}");
    assert_eq!(pictures(&again), pictures(&renderer));
    let expected = Renderer::prepare(&bare(), Illumination::Point, SIZE).unwrap();
    assert_eq!(pictures(&renderer), pictures(&expected));
}

#[test]
fn light_is_kept_of_ordinary_pictures_alone() {
    let folder = TempDir::new().unwrap();
    assert!(TransportCache::new(folder.path()).keeps(512) && !TransportCache::new(folder.path()).keeps(513));
    assert!(!TransportCache::off().keeps(16));
    assert!(is_built(&bare(), Illumination::Point, SIZE, &TransportCache::off()));
}

#[test]
fn what_was_not_used_for_longest_goes_first() {
    let folder = TempDir::new().unwrap();
    let cache = TransportCache::new(folder.path());
    let build = |size: usize, cache: &TransportCache| is_built(&bare(), Illumination::Point, size, cache);
    assert!(build(16, &cache) && build(17, &cache) && build(18, &cache));
    let long_ago = SystemTime::now() - Duration::from_secs(7200);
    for file in kept(folder.path()) {
        fs::File::open(file).unwrap().set_modified(long_ago).unwrap();
    }
    let abandoned = folder.path().join(".lookmatch-x.tmp");
    fs::write(&abandoned, "").unwrap();
    fs::File::open(&abandoned).unwrap().set_modified(long_ago).unwrap();
    fs::write(folder.path().join("not ours.txt"), "").unwrap();
    assert!(!build(17, &cache), "reading counts as use");
    let size = kept(folder.path()).iter().map(|file| fs::metadata(file).unwrap().len()).sum::<u64>();
    assert!(build(19, &cache.clone().limited(size)), "one more than fits");
    assert!(!abandoned.exists() && folder.path().join("not ours.txt").exists());
    assert!(!build(17, &cache) && !build(19, &cache));
    assert_eq!(kept(folder.path()).len(), 3, "the two that nobody used are gone");
}
