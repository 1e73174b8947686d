//! All that prepared light depends on, and its key.

use std::borrow::Cow;
use std::panic::resume_unwind;
use std::path::Path;

use blake3::{Hash, Hasher};
use fearless_simd::Level;
use rayon::ThreadPoolBuilder;

use crate::SceneError;
use crate::environment::EnvironmentMap;
use crate::field::Field;
use crate::flat::FORMAT_VERSION;
use crate::scene::{Illumination, Scene};

/// To be raised with every change of the renderer that changes a bit of what it prepares: files that an older program
/// kept are then left alone, and built again.
const ALGORITHM_VERSION: u32 = 5;

/// A scene, its lights and a picture size, with the content of the environment map.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    pub(crate) scene: Scene,
    illumination: Illumination,
    pub(crate) size: usize,
    /// The file of the map, read once: what is baked is what the key was made of.
    map: Cow<'static, [u8]>,
}

impl Source {
    /// Checks a scene and reads its map.
    pub(crate) fn new(scene: &Scene, illumination: Illumination, size: usize) -> Result<Self, SceneError> {
        scene.check_picture(illumination, size)?;
        if !scene.meshes.is_empty() {
            return Err(SceneError::NeedsPath { scene: scene.name.clone() });
        }
        let light = scene.environment.as_ref().filter(|_| illumination.has_environment());
        let map = light.map_or(Ok(Cow::default()), EnvironmentMap::content)?;
        Ok(Self { scene: scene.clone(), illumination, size, map })
    }

    /// Lights every body of the scene.
    pub(crate) fn bake(&self) -> Result<Field, SceneError> {
        Field::bake(&self.scene, self.illumination, &self.map)
    }

    /// [`Source::bake`] in threads of its own, for a caller that others may wait for: a thread of the common pool that waits
    /// for its share of the work takes up other jobs meanwhile, and must not take up one that waits for the light.
    pub(crate) fn bake_apart(&self) -> Result<Field, SceneError> {
        let Ok(pool) = ThreadPoolBuilder::new().build() else { return self.bake() };
        std::thread::scope(|scope| {
            // The caller waits for a thread of no pool, and so idly.
            let waiting = std::thread::Builder::new().spawn_scoped(scope, || pool.install(|| self.bake()));
            waiting.map_or_else(
                |_| self.bake(),
                |thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)),
            )
        })
    }

    /// Equal for sources whose prepared light is the same to the bit, and for no others.
    pub(crate) fn key(&self) -> Hash {
        // Prints every field, and numbers to the last bit.
        let scene = format!("{:?}", self.relevant());
        let lights = format!("{:?}", self.illumination);
        // Instruction sets round differently, and numbers are kept as the processor holds them.
        let machine = format!("{} {:?}", std::env::consts::ARCH, Level::new());
        let mut hasher = Hasher::new();
        for version in [FORMAT_VERSION, ALGORITHM_VERSION] {
            hasher.update(&version.to_le_bytes());
        }
        hasher.update(&(self.size as u64).to_le_bytes());
        for part in [env!("CARGO_PKG_VERSION").as_bytes(), machine.as_bytes(), lights.as_bytes()] {
            add(&mut hasher, part);
        }
        add(&mut hasher, scene.as_bytes());
        add(&mut hasher, &self.map);
        hasher.finalize()
    }

    /// The scene without what leaves no trace in the light: its name, lights that are off, and where the map lies.
    fn relevant(&self) -> Scene {
        let mut scene = Scene { name: String::new(), ..self.scene.clone() };
        if !self.illumination.has_points() {
            scene.point_lights.clear();
        }
        scene.environment = scene.environment.filter(|_| self.illumination.has_environment());
        if let Some(light) = &mut scene.environment
            && let Some(extension) = Path::new(&light.map).extension()
        {
            // It tells the format of the content; a name of its own, because a file that is called no more than `.exr` has none.
            light.map = format!("map.{}", extension.to_string_lossy().to_lowercase());
        }
        scene
    }
}

/// Adds a part and where it ends.
fn add(hasher: &mut Hasher, part: &[u8]) {
    hasher.update(&(part.len() as u64).to_le_bytes()).update_rayon(part);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EnvironmentLight;

    fn source(map: &str) -> Source {
        let environment = Some(EnvironmentLight::of(map));
        let scene = Scene { environment, ..Scene::reference() };
        Source { scene, illumination: Illumination::Environment, size: 8, map: Cow::Borrowed(b"content") }
    }

    #[test]
    fn only_maps_of_one_format_share_a_key() {
        let key = |map: &str| source(map).key();
        assert_eq!(key("a.exr"), key("elsewhere/b.EXR"));
        let others = ["a.hdr", ".exr", "exr", "a", "designed", "interior"].map(key);
        assert!(others.iter().all(|other| *other != key("a.exr")));
        let turned = |turn: f64| {
            let mut source = source("a.exr");
            source.scene.environment =
                Some(EnvironmentLight { rotation: turn, ..EnvironmentLight::of("a.exr") });
            source.key()
        };
        assert_ne!(turned(30.0), turned(30.0_f64.next_up()), "every bit of a number counts");
    }

    #[test]
    fn light_is_baked_apart_as_in_place() {
        let lit = Source::new(&Scene::reference(), Illumination::Environment, 8).unwrap();
        let foot = glam::DVec3::new(0.3, -1.0, 0.2);
        let seen = |field: Field| field.board.unwrap().exact(foot, crate::Rgb::ZERO);
        assert_eq!(seen(lit.bake_apart().unwrap()), seen(lit.bake().unwrap()));
        assert!(source("broken.exr").bake_apart().unwrap_err().to_string().contains("broken.exr"));
    }
}
