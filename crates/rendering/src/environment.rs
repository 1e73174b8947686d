//! Light from far away: a latitude-longitude map, filtered look-ups, its lamps, and the lights that stand for it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::io::ErrorKind::NotFound;
use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::DVec3;
use lookmatch_imaging::{Image, ImageError};

use crate::angles::{map_direction, map_position};
use crate::irradiance::SkyLights;
use crate::pyramid::Pyramid;
use crate::scene::EnvironmentLight;
use crate::{Rgb, SceneError, designed_map};

/// Maps that ship with the program (CC0, see `assets/README.md`).
#[rustfmt::skip] // one line per map
const SHIPPED: [(&str, &[u8]); 6] = [
    ("interior", include_bytes!("../assets/interior.exr")),
    ("city", include_bytes!("../assets/city.exr")),
    ("forest", include_bytes!("../assets/forest.exr")),
    ("night", include_bytes!("../assets/night.exr")),
    ("studio", include_bytes!("../assets/studio.exr")),
    ("sunset", include_bytes!("../assets/sunset.exr")),
];

/// The map that others are balanced to, and its scale such that a white surface on a table is just white.
pub(crate) const BALANCE: (&str, f64) = ("interior", 0.35);

/// The map is cut in two this often to give the lights of irradiance: 8192 of them.
const LIGHT_CUTS: u32 = 13;

/// A texel brighter than this many times the mean radiance is a lamp.
const LAMP: f64 = 30.0;
/// Lamps at most; where more texels are bright, they are gathered in tiles.
const MOST_LAMPS: usize = 128;

/// A map that is ready to give light.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    /// The map as it is.
    pyramid: Pyramid,
    /// The map without what its lamps exceed the limit by: free of peaks that fall between samples.
    pub(crate) dimmed: Pyramid,
    /// Direction of each lamp and its irradiance on a surface that faces it: what `dimmed` lacks.
    pub(crate) lamps: Vec<(DVec3, Rgb)>,
    /// Rotation in turns.
    pub(crate) rotation: f32,
    /// All of the map's light.
    pub(crate) lights: SkyLights,
}

impl EnvironmentMap {
    /// Reads the map that a scene names.
    ///
    /// # Errors
    /// Where the file cannot be read as an image, or is not twice as wide as high.
    pub fn load(light: &EnvironmentLight) -> Result<Self, SceneError> {
        Self::decode(light, &Self::content(light)?)
    }

    /// The content of the file that a light names; empty for a map that is computed.
    pub(crate) fn content(light: &EnvironmentLight) -> Result<Cow<'static, [u8]>, SceneError> {
        let path = match light.map.as_str() {
            "designed" => return Ok(Cow::Borrowed(&[])),
            name => PathBuf::from(name),
        };
        if let Some((_, bytes)) = SHIPPED.iter().find(|(name, _)| *name == light.map) {
            return Ok(Cow::Borrowed(bytes));
        }
        let bytes = std::fs::read(&path).map_err(|source| match source.kind() {
            // Perhaps a name was meant.
            NotFound => {
                SceneError::NoMap { map: light.map.clone(), names: EnvironmentLight::names().join(", ") }
            }
            _ => ImageError::Io { path, action: "read", source }.into(),
        })?;
        Ok(Cow::Owned(bytes))
    }

    /// The map of a light from its [`EnvironmentMap::content`].
    pub(crate) fn decode(light: &EnvironmentLight, content: &[u8]) -> Result<Self, SceneError> {
        Ok(Self::new(&decode_image(light, content)?, light.scale, light.rotation))
    }

    /// The map that a scene names as other renderers are given it: scaled, turned, nothing negative, and averaged down to
    /// `most` columns where it has more. A turn by a part of a texel interpolates between columns.
    ///
    /// # Errors
    /// Where the file cannot be read as an image, or is not twice as wide as high.
    pub fn image(light: &EnvironmentLight, most: usize) -> Result<Image, SceneError> {
        let image = decode_image(light, &Self::content(light)?)?;
        let (width, height) = (image.width(), image.height());
        let texels = scaled(&image, light.scale);
        let pyramid = Pyramid::new(width, height, texels, true, |v| (PI * v).sin());
        let (width, height, texels) = pyramid.level_within(most);
        let shift = (light.rotation / 360.0).rem_euclid(1.0) * width as f64;
        let (whole, part) = (shift.floor(), shift.fract() as f32);
        let turned = |x: usize, y: usize| {
            let column = |x: usize| texels[y * width + x % width];
            // Two turns more than the shift, so that nothing is below 0.
            let right = x + 2 * width - whole as usize;
            column(right).lerp(column(right - 1), part)
        };
        Ok(Image::from_fn(width, height, |x, y| turned(x, y).truncate().to_array()))
    }

    /// Prepares a 2:1 image. Negative values, which compression leaves in some published maps, count as 0.
    pub(crate) fn new(image: &Image, scale: f64, rotation: f64) -> Self {
        let texels = scaled(image, scale);
        let (width, height) = (image.width(), image.height());
        let rotation = (rotation / 360.0).rem_euclid(1.0);
        let grid = Grid { width, height, rotation };
        let lights = SkyLights::new(&cut_lights(&grid, &texels));
        let (dimmed, lamps) = take_lamps(&grid, &texels);
        let pyramid = |texels| Pyramid::new(width, height, texels, true, |v| (PI * v).sin());
        let (pyramid, dimmed) = (pyramid(texels), pyramid(dimmed));
        Self { pyramid, dimmed, lamps, rotation: rotation as f32, lights }
    }

    /// Radiance from a unit direction, averaged over about `angle` radians.
    pub(crate) fn radiance(&self, direction: DVec3, angle: f64) -> Rgb {
        self.look_up(&self.pyramid, direction, angle)
    }

    /// The same without the lamps.
    pub(crate) fn dimmed_radiance(&self, direction: DVec3, angle: f64) -> Rgb {
        self.look_up(&self.dimmed, direction, angle)
    }

    /// Leaves the lamps in the map, to be met by look-ups.
    pub(crate) fn keep_lamps(&mut self) {
        self.dimmed = self.pyramid.clone();
        self.lamps.clear();
    }

    /// Rows of the map, and its rotation in turns.
    pub(crate) fn grid(&self) -> (usize, f64) {
        (self.pyramid.height(), self.rotation.into())
    }

    fn look_up(&self, pyramid: &Pyramid, direction: DVec3, angle: f64) -> Rgb {
        let (mut u, v) = map_position(direction);
        u -= self.rotation;
        if u < 0.0 {
            u += 1.0;
        }
        let texels = angle as f32 * pyramid.height() as f32 / PI as f32;
        pyramid.sample(u, v, texels)
    }
}

impl EnvironmentLight {
    /// The maps that need no file: the designed one, and those that ship with the program.
    pub fn names() -> Vec<&'static str> {
        std::iter::once("designed").chain(SHIPPED.iter().map(|(name, _)| *name)).collect()
    }

    /// A map, scaled such that a white, horizontal surface is as bright (in luminance) as under the built-in validation
    /// scenes' light, the map `interior` at a scale of 0.35: just white.
    ///
    /// # Errors
    /// Where the map cannot be read, or gives no light from above.
    pub fn balanced(map: impl Into<String>) -> Result<Self, SceneError> {
        let light = Self::of(map);
        let (balance, scale) = BALANCE;
        let wanted = scale * upper_irradiance(&Self::of(balance))?;
        let scale = wanted / upper_irradiance(&light)?;
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(SceneError::DarkMap { map: light.map });
        }
        Ok(Self { scale, ..light })
    }
}

/// Luminance of the irradiance of a horizontal surface that nothing shades.
fn upper_irradiance(light: &EnvironmentLight) -> Result<f64, SceneError> {
    let image = decode_image(light, &EnvironmentMap::content(light)?)?;
    let (width, height) = (image.width(), image.height());
    let grid = Grid { width, height, rotation: 0.0 };
    // ∫ cos θ dω over a row is π (cos² θ₀ − cos² θ₁); the equator may lie within one.
    let power = |(i, texel): (usize, &Rgb)| {
        let [upper, lower] = [i / width, i / width + 1].map(|row| grid.edge(row).max(0.0));
        luminance(*texel) * PI * (upper * upper - lower * lower) / width as f64
    };
    Ok(scaled(&image, 1.0).iter().enumerate().map(power).sum())
}

/// The image of a light from its [`EnvironmentMap::content`].
pub(crate) fn decode_image(light: &EnvironmentLight, content: &[u8]) -> Result<Image, SceneError> {
    let image = match light.map.as_str() {
        "designed" => designed_map(),
        name if SHIPPED.iter().any(|(shipped, _)| *shipped == name) => {
            lookmatch_imaging::decode(&Path::new(name).with_extension("exr"), content)?
        }
        path => lookmatch_imaging::decode(Path::new(path), content)?,
    };
    if image.width() != 2 * image.height() {
        let (width, height) = (image.width(), image.height());
        return Err(SceneError::Aspect { map: light.map.clone(), width, height });
    }
    Ok(image)
}

/// An image's pixels times a factor; negative ones count as 0.
fn scaled(image: &Image, scale: f64) -> Vec<Rgb> {
    let texel = |p: &[f32; 3]| Rgb::new(p[0], p[1], p[2], 0.0).max(Rgb::ZERO) * scale as f32;
    image.pixels().iter().map(texel).collect()
}

/// The texels of a latitude-longitude map as directions.
struct Grid {
    width: usize,
    height: usize,
    /// In turns.
    rotation: f64,
}

impl Grid {
    /// Cosine of the polar angle at the upper edge of a row.
    fn edge(&self, row: usize) -> f64 {
        (PI * row as f64 / self.height as f64).cos()
    }

    /// Solid angle of a texel of a row, in sr.
    fn solid_angle(&self, row: usize) -> f64 {
        (self.edge(row) - self.edge(row + 1)) * TAU / self.width as f64
    }

    /// The direction at a fraction of a texel, such that equal areas have equal solid angles.
    fn direction(&self, (x, fx): (usize, f64), (y, fy): (usize, f64)) -> DVec3 {
        let cos = self.edge(y) + fy * (self.edge(y + 1) - self.edge(y));
        map_direction((x as f64 + fx) / self.width as f64 + self.rotation, cos.acos() / PI)
    }

    /// Mean luminance over all directions.
    fn mean(&self, texels: &[Rgb]) -> f64 {
        let power = |(i, t): (usize, &Rgb)| luminance(*t) * self.solid_angle(i / self.width);
        texels.iter().enumerate().map(power).sum::<f64>() / (4.0 * PI)
    }
}

fn luminance(c: Rgb) -> f64 {
    f64::from(lookmatch_imaging::luminance([c.x, c.y, c.z]))
}

/// Splits a map into one without peaks and the lamps that it lost.
fn take_lamps(grid: &Grid, texels: &[Rgb]) -> (Vec<Rgb>, Vec<(DVec3, Rgb)>) {
    // A black map has no lamps; the smallest positive limit keeps their share from being 0/0.
    let limit = (LAMP * grid.mean(texels)).max(f64::MIN_POSITIVE);
    let excess = |t: Rgb| t * (1.0 - limit / luminance(t).max(limit)) as f32;
    let dimmed = texels.iter().map(|t| *t - excess(*t)).collect();
    let bright: Vec<usize> = (0..texels.len()).filter(|i| excess(texels[*i]) != Rgb::ZERO).collect();
    let tiled = |side: usize| {
        let mut tiles: BTreeMap<(usize, usize), (DVec3, Rgb)> = BTreeMap::new();
        for i in &bright {
            let (x, y) = (i % grid.width, i / grid.width);
            let power = excess(texels[*i]) * grid.solid_angle(y) as f32;
            let tile = tiles.entry((y / side, x / side)).or_default();
            tile.0 += grid.direction((x, 0.5), (y, 0.5)) * luminance(power);
            tile.1 += power;
        }
        tiles
    };
    let sides = (0..).map(|k| 1 << k);
    let tiles = sides.map(tiled).find(|tiles| tiles.len() <= MOST_LAMPS).unwrap_or_default();
    (dimmed, tiles.into_values().map(|(direction, power)| (direction.normalize(), power)).collect())
}

/// A rectangle of texels.
type Region = (Range<usize>, Range<usize>);

/// Cuts the map into regions of about equal brightness times solid angle (the median cut of Debevec 2005): each is a
/// light of exactly its power, in the direction of its centroid.
fn cut_lights(grid: &Grid, texels: &[Rgb]) -> Vec<(DVec3, Rgb)> {
    // A floor of a tenth of the mean keeps dark regions from growing over half of the sky.
    let floor = 0.1 * grid.mean(texels) + 1e-9;
    let angles: Vec<f64> = (0..grid.height).map(|y| grid.solid_angle(y)).collect();
    let weight = |x: usize, y: usize| (luminance(texels[y * grid.width + x]) + floor) * angles[y];
    let mut regions: Vec<Region> = vec![(0..grid.width, 0..grid.height)];
    for _ in 0..LIGHT_CUTS {
        regions = regions.into_iter().flat_map(|r| halves(grid, r, weight)).collect();
    }
    let light = |(columns, rows): Region| {
        let (mut centroid, mut total, mut power) = (DVec3::ZERO, 0.0, Rgb::ZERO);
        for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
            let texel = texels[y * grid.width + x];
            let weight = (luminance(texel) + 1e-9) * angles[y];
            centroid += grid.direction((x, 0.5), (y, 0.5)) * weight;
            total += weight;
            power += texel * angles[y] as f32;
        }
        // The mean of cos θ over a region is its centroid's, which lies within the unit sphere.
        (centroid.normalize(), power * (centroid.length() / total) as f32)
    };
    regions.into_iter().map(light).collect()
}

/// Cuts a region across its longer side into two of about the same weight; a single texel remains.
fn halves(grid: &Grid, (columns, rows): Region, weight: impl Fn(usize, usize) -> f64) -> Vec<Region> {
    let middle = (rows.start + rows.end) as f64 / (2 * grid.height) as f64;
    let width = columns.len() as f64 * TAU / grid.width as f64 * (PI * middle).sin();
    let height = rows.len() as f64 * PI / grid.height as f64;
    if columns.len() > 1 && (width >= height || rows.len() == 1) {
        let cut = median(columns.clone(), |x| rows.clone().map(|y| weight(x, y)).sum());
        vec![(columns.start..cut, rows.clone()), (cut..columns.end, rows)]
    } else if rows.len() > 1 {
        let cut = median(rows.clone(), |y| columns.clone().map(|x| weight(x, y)).sum());
        vec![(columns.clone(), rows.start..cut), (columns, cut..rows.end)]
    } else {
        vec![(columns, rows)]
    }
}

/// Where to cut a range so that both parts weigh about the same; neither is empty.
fn median(range: Range<usize>, weight: impl Fn(usize) -> f64) -> usize {
    let weights: Vec<f64> = range.clone().map(weight).collect();
    let half = weights.iter().sum::<f64>() / 2.0;
    let mut sum = 0.0;
    let before = weights.iter().take_while(|w| {
        sum += **w;
        sum - **w / 2.0 < half
    });
    (range.start + before.count()).clamp(range.start + 1, range.end - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::{Bodies, Body};
    use crate::irradiance::Place;

    #[test]
    fn orientation_is_canonical() {
        let image = Image::from_fn(64, 32, |x, y| [x as f32, y as f32, 0.0]);
        let map = EnvironmentMap::new(&image, 1.0, 0.0);
        let column = |d: DVec3| map.radiance(d, 0.0).x;
        assert!((column(DVec3::X) - 15.5).abs() < 0.01, "+X is a quarter turn");
        assert!((column(DVec3::Z) - 31.5).abs() < 0.01, "+Z is half a turn");
        assert!(map.radiance(DVec3::Y, 0.0).y < 0.01, "+Y is the first row");
        let turned = EnvironmentMap::new(&image, 2.0, 90.0);
        assert!((turned.radiance(DVec3::Z, 0.0).x - 2.0 * 15.5).abs() < 0.02, "what was at +X is at +Z");
    }

    #[test]
    fn images_for_other_renderers_are_scaled_turned_and_small() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("map.exr");
        let columns = Image::from_fn(8, 4, |x, _| [x as f32, 0.0, -1.0]);
        lookmatch_imaging::write(&file, &columns, &[]).unwrap();
        let map = file.to_string_lossy();
        let image = |rotation, most| {
            let light = EnvironmentLight { scale: 2.0, rotation, ..EnvironmentLight::of(map.clone()) };
            EnvironmentMap::image(&light, most).unwrap()
        };
        let first_row = |image: &Image| (0..image.width()).map(|x| image.get(x, 0)[0]).collect::<Vec<_>>();
        assert_eq!(first_row(&image(0.0, 8)), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0]);
        // A quarter of a turn is two columns: what was at the left edge, −Z, is at +X.
        assert_eq!(first_row(&image(90.0, 8)), [12.0, 14.0, 0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(first_row(&image(-22.5, 8))[..3], [1.0, 3.0, 5.0]);
        let halved = first_row(&image(0.0, 4));
        assert!(halved.iter().zip([1.0, 5.0, 9.0, 13.0]).all(|(a, b)| (a - b).abs() < 1e-5), "{halved:?}");
        assert_eq!(image(0.0, 8).get(3, 1), [6.0, 0.0, 0.0]);
    }

    #[test]
    fn a_black_map_gives_no_light() {
        let map = EnvironmentMap::new(&Image::new(16, 8), 1.0, 0.0);
        assert!(map.lamps.is_empty());
        let up = Place { position: DVec3::ZERO, normal: DVec3::Y, body: Body::Plane };
        assert_eq!(map.lights.irradiance(&Bodies::default(), &up), Rgb::ZERO);
        assert_eq!(map.dimmed_radiance(DVec3::X, 0.1), Rgb::ZERO);
    }

    #[test]
    fn lamps_carry_what_the_dimmed_map_lacks() {
        let lamp = |x: usize, y: usize| if x == 20 && (9..11).contains(&y) { 5000.0 } else { 1.0 };
        let map = EnvironmentMap::new(&Image::from_fn(64, 32, |x, y| [lamp(x, y); 3]), 1.0, 0.0);
        assert_eq!(map.lamps.len(), 2);
        let towards = map.lamps[0].0;
        let (whole, dimmed) = (map.radiance(towards, 0.0).x, map.dimmed_radiance(towards, 0.0).x);
        assert!(whole > 4000.0 && dimmed < 500.0, "{whole} {dimmed}");
        let designed = EnvironmentMap::new(&designed_map(), 1.0, 0.0);
        assert!(designed.lamps.is_empty(), "the designed map has no peaks");
    }

    #[test]
    fn lights_integrate_the_map() {
        let map = EnvironmentMap::new(&designed_map(), 1.0, 30.0);
        let up = Place { position: DVec3::ZERO, normal: DVec3::Y, body: Body::Plane };
        let upper = map.lights.irradiance(&Bodies::default(), &up);
        // Every channel is bright in 2 of 5 bands of equal size: E = π (2·2.5 + 3·0.03)/5.
        let exact = std::f32::consts::PI * (2.0 * 2.5 + 3.0 * 0.03) / 5.0;
        assert!((upper / exact - Rgb::new(1.0, 1.0, 1.0, 0.0)).abs().max_element() < 0.01, "{upper} {exact}");
    }
}
