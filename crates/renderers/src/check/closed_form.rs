//! Pictures that are known without rendering: Lambert or mirror spheres on a checkerboard under point lights and a map.
//!
//! All conventions are those of `docs/renderer-protocol.md`. Light takes no second bounce unless asked for, a mirror excepted:
//! scenes are chosen so that there is none. Pictures are compared with these, so nothing here is shared with a renderer.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use lookmatch_imaging::Image;
use lookmatch_rendering::{Camera, Plane, PointLight, Scene};

/// What the spheres are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Finish {
    /// Its albedo.
    Lambert([f64; 3]),
    /// Its reflectance.
    Mirror([f64; 3]),
}

/// A pinhole camera; the fields after the axes bend what it sees away from what it should.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    eye: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    tangent: f64,
    /// How far the picture lies to the right of and below its place, in halves of its side.
    pub(crate) shift: [f64; 2],
    /// How much more than it should the picture holds.
    pub(crate) zoom: f64,
    /// By how many radians the picture is turned clockwise.
    pub(crate) roll: f64,
}

impl View {
    pub(crate) fn new(camera: &Camera) -> Self {
        let eye = DVec3::from(camera.eye);
        let forward = (DVec3::from(camera.target) - eye).normalize();
        let right = forward.cross(camera.up.into()).normalize();
        let tangent = (camera.vertical_fov.to_radians() / 2.0).tan();
        Self { eye, forward, right, up: right.cross(forward), tangent, shift: [0.0; 2], zoom: 1.0, roll: 0.0 }
    }

    /// The direction through a point of the picture, both −1 to 1, rightwards and downwards.
    fn direction(&self, x: f64, y: f64) -> DVec3 {
        let (x, y) = (x - self.shift[0], y - self.shift[1]);
        let (sin, cos) = self.roll.sin_cos();
        let (x, y) = (self.zoom * (cos * x + sin * y), self.zoom * (cos * y - sin * x));
        (self.forward + self.tangent * (x * self.right - y * self.up)).normalize()
    }
}

/// How a map is read between its texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Texels {
    /// Linearly, between their middles.
    Linear,
    /// Each has one colour all over.
    Nearest,
    /// Linearly, but so many texels too far right and down.
    Shifted(f64, f64),
    /// Linearly, but the middles of the first and of the last row are the poles.
    Stretched,
}

/// A latitude-longitude map.
#[derive(Clone, Debug)]
pub(crate) struct Sky {
    map: Image,
    texels: Texels,
    /// Directions to patches of the map times their solid angles, and their mean radiance.
    patches: Vec<(DVec3, DVec3)>,
}

impl Sky {
    /// Patches of the map, across, that stand for its irradiance.
    const PATCHES: usize = 64;

    pub(crate) fn new(map: Image, texels: Texels) -> Self {
        let side = (map.width() / Self::PATCHES).max(1);
        let mut patches = Vec::new();
        for top in (0..map.height()).step_by(side) {
            for left in (0..map.width()).step_by(side) {
                let (mut direction, mut light, mut angles) = (DVec3::ZERO, DVec3::ZERO, 0.0);
                for y in top..(top + side).min(map.height()) {
                    let (latitude, height) =
                        (PI * (y as f64 + 0.5) / map.height() as f64, map.height() as f64);
                    let angle = latitude.sin() * (PI / height) * (TAU / map.width() as f64);
                    for x in left..(left + side).min(map.width()) {
                        let longitude = TAU * (x as f64 + 0.5) / map.width() as f64;
                        direction += angle * toward(longitude, latitude);
                        light += angle * colour(map.get(x, y));
                        angles += angle;
                    }
                }
                patches.push((direction, light / angles));
            }
        }
        patches.retain(|(_, light)| *light != DVec3::ZERO);
        Self { map, texels, patches }
    }

    /// Radiance from a unit direction.
    fn radiance(&self, direction: DVec3) -> DVec3 {
        let (width, height) = (self.map.width(), self.map.height());
        let mut u = (direction.x.atan2(-direction.z) / TAU).rem_euclid(1.0) * width as f64;
        let mut v = direction.y.clamp(-1.0, 1.0).acos() / PI * height as f64;
        let texel = |x: f64, y: f64| {
            let column = (x as i64).rem_euclid(width as i64) as usize;
            colour(self.map.get(column, (y.max(0.0) as usize).min(height - 1)))
        };
        match self.texels {
            Texels::Linear => (),
            Texels::Nearest => return texel(u.floor(), v.floor()),
            Texels::Shifted(right, down) => (u, v) = (u - right, v - down),
            Texels::Stretched => v = 0.5 + v * (height - 1) as f64 / height as f64,
        }
        let (x, y) = ((u - 0.5).floor(), (v - 0.5).floor());
        let (part_x, part_y) = (u - 0.5 - x, v - 0.5 - y);
        let row = |y: f64| texel(x, y).lerp(texel(x + 1.0, y), part_x);
        row(y).lerp(row(y + 1.0), part_y)
    }

    /// Irradiance on a surface that nothing shades.
    fn irradiance(&self, normal: DVec3) -> DVec3 {
        self.patches.iter().map(|(direction, light)| normal.dot(*direction).max(0.0) * *light).sum()
    }
}

/// The direction of a point of a map, in radians from the left edge and from the top.
fn toward(longitude: f64, latitude: f64) -> DVec3 {
    DVec3::new(latitude.sin() * longitude.sin(), latitude.cos(), -latitude.sin() * longitude.cos())
}

fn colour(c: [f32; 3]) -> DVec3 {
    DVec3::from(c.map(f64::from))
}

/// A scene with everything that its picture needs.
#[derive(Clone, Debug)]
pub(crate) struct World {
    pub(crate) view: View,
    spheres: Vec<(DVec3, f64)>,
    plane: Option<Plane>,
    lights: Vec<PointLight>,
    sky: Option<Sky>,
    finish: Finish,
    /// How far the checks lie from their place, in sides of a check along x and z.
    pub(crate) check_shift: [f64; 2],
    pub(crate) has_shadows: bool,
    /// Parts of the checkerboard that light the spheres, where they do.
    glow: Vec<Patch>,
}

/// A part of the checkerboard: where it is, and the radiance that leaves it, times its area.
#[derive(Clone, Copy, Debug)]
struct Patch {
    place: DVec3,
    light: DVec3,
}

/// What a ray meets.
struct Hit {
    point: DVec3,
    normal: DVec3,
    is_subject: bool,
}

/// A known picture.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    pub(crate) image: Image,
    /// How much the radiance differs within a pixel, at most.
    pub(crate) spread: Vec<f32>,
    /// Share of each pixel that shows a sphere.
    pub(crate) cover: Vec<f32>,
}

impl World {
    /// A scene; the map of its environment is given as it is.
    pub(crate) fn new(scene: &Scene, sky: Option<Sky>, finish: Finish) -> Self {
        Self {
            view: View::new(&scene.camera),
            spheres: scene.spheres.iter().map(|s| (s.centre.into(), s.radius)).collect(),
            plane: scene.plane.clone(),
            lights: scene.point_lights.clone(),
            sky,
            finish,
            check_shift: [0.0; 2],
            has_shadows: true,
            glow: Vec::new(),
        }
    }

    /// The same where the checkerboard, lit by the lights alone, lights the spheres: one bounce.
    pub(crate) fn with_bounce(mut self) -> Self {
        /// Parts across.
        const PARTS: usize = 80;
        let Some(plane) = &self.plane else { return self };
        let side = 2.0 * plane.half_extent / PARTS as f64;
        let along = |k: usize| (k as f64 + 0.5) * side - plane.half_extent;
        let patch = |k: usize| {
            let place = DVec3::new(along(k % PARTS), plane.height, along(k / PARTS));
            let light = self.checkerboard(&Hit { point: place, normal: DVec3::Y, is_subject: false });
            Patch { place, light: side * side * light }
        };
        self.glow = (0..PARTS * PARTS).map(patch).filter(|patch| patch.light != DVec3::ZERO).collect();
        self
    }

    /// The picture, each pixel the mean of `k` by `k` points.
    pub(crate) fn picture(&self, size: usize, k: usize) -> Known {
        let mut known = Known {
            image: Image::new(size, size),
            spread: vec![0.0; size * size],
            cover: vec![0.0; size * size],
        };
        let share = 1.0 / (k * k) as f64;
        for index in 0..size * size {
            let (mut sum, mut subject) = (DVec3::ZERO, 0.0);
            let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for part in 0..k * k {
                let x = (index % size) as f64 + ((part % k) as f64 + 0.5) / k as f64;
                let y = (index / size) as f64 + ((part / k) as f64 + 0.5) / k as f64;
                let (radiance, is_subject) = self.seen(x / size as f64, y / size as f64);
                sum += radiance;
                (least, most) = (least.min(radiance), most.max(radiance));
                subject += f64::from(u8::from(is_subject));
            }
            known.image.pixels_mut()[index] = (share * sum).as_vec3().to_array();
            known.spread[index] = (most - least).max_element() as f32;
            known.cover[index] = (share * subject) as f32;
        }
        known
    }

    /// Radiance at a point of the picture, 0 to 1 from its left and its top, and whether a sphere is there.
    pub(crate) fn seen(&self, x: f64, y: f64) -> (DVec3, bool) {
        let direction = self.view.direction(2.0 * x - 1.0, 2.0 * y - 1.0);
        let Some(hit) = self.hit(self.view.eye, direction) else { return (self.sky(direction), false) };
        match self.finish {
            _ if !hit.is_subject => (self.checkerboard(&hit), false),
            Finish::Lambert(albedo) => {
                let bounced: DVec3 = self.glow.iter().map(|patch| patch.irradiance(&hit)).sum();
                (DVec3::from(albedo) / PI * (self.irradiance(&hit) + bounced), true)
            }
            Finish::Mirror(reflectance) => {
                let mirrored = direction - 2.0 * direction.dot(hit.normal) * hit.normal;
                let light = match self.hit(hit.point, mirrored) {
                    None => self.sky(mirrored),
                    Some(other) if other.is_subject => DVec3::ZERO,
                    Some(other) => self.checkerboard(&other),
                };
                (DVec3::from(reflectance) * light, true)
            }
        }
    }

    fn sky(&self, direction: DVec3) -> DVec3 {
        self.sky.as_ref().map_or(DVec3::ZERO, |sky| sky.radiance(direction))
    }

    /// The nearest surface along a ray.
    fn hit(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let spheres =
            self.spheres.iter().filter_map(|sphere| Some((distance(sphere, origin, direction)?, sphere)));
        let sphere = spheres.min_by(|a, b| a.0.total_cmp(&b.0));
        let plane = self.plane.as_ref().and_then(|plane| {
            let t = (plane.height - origin.y) / direction.y;
            let point = origin + t * direction;
            let is_inside = point.x.abs() <= plane.half_extent && point.z.abs() <= plane.half_extent;
            // It is seen from above alone.
            (direction.y < 0.0 && t > 1e-9 && is_inside).then_some((t, point))
        });
        match (sphere, plane) {
            (Some((t, _)), Some((other, point))) if other < t => Some((point, None)),
            (Some((t, sphere)), _) => Some((origin + t * direction, Some(sphere))),
            (None, plane) => plane.map(|(_, point)| (point, None)),
        }
        .map(|(point, sphere)| Hit {
            point,
            normal: sphere.map_or(DVec3::Y, |(centre, radius)| (point - centre) / radius),
            is_subject: sphere.is_some(),
        })
    }

    fn checkerboard(&self, hit: &Hit) -> DVec3 {
        let Some(plane) = &self.plane else { return DVec3::ZERO };
        let check = |x: f64, shift: f64| (x / plane.check_size - shift).floor() as i64;
        let sum = check(hit.point.x, self.check_shift[0]) + check(hit.point.z, self.check_shift[1]);
        let albedo = if sum.rem_euclid(2) == 0 { plane.light } else { plane.dark };
        DVec3::from(albedo) / PI * self.irradiance(hit)
    }

    /// Irradiance at a surface: of the point lights that it sees, and of the whole map.
    fn irradiance(&self, hit: &Hit) -> DVec3 {
        let of = |light: &PointLight| {
            let to = DVec3::from(light.position) - hit.point;
            let cosine = hit.normal.dot(to) / to.length();
            if cosine <= 0.0 || self.has_shadows && self.is_shaded(hit.point, to) {
                return DVec3::ZERO;
            }
            DVec3::from(light.intensity) * (cosine / to.length_squared())
        };
        let lamps: DVec3 = self.lights.iter().map(of).sum();
        lamps + self.sky.as_ref().map_or(DVec3::ZERO, |sky| sky.irradiance(hit.normal))
    }

    /// Whether a sphere is in the way to a light.
    fn is_shaded(&self, point: DVec3, to: DVec3) -> bool {
        let (direction, length) = (to.normalize(), to.length());
        self.spheres.iter().filter_map(|sphere| distance(sphere, point, direction)).any(|t| t < length)
    }
}

impl Patch {
    /// Irradiance on a sphere, which is in the way of nothing that its surface faces.
    fn irradiance(&self, hit: &Hit) -> DVec3 {
        let to = self.place - hit.point;
        let cosines = hit.normal.dot(to).max(0.0) * -to.y.min(0.0);
        cosines / to.length_squared().powi(2) * self.light
    }
}

/// Distance along a ray to a sphere, from outside.
fn distance((centre, radius): &(DVec3, f64), origin: DVec3, direction: DVec3) -> Option<f64> {
    let to = *centre - origin;
    let along = to.dot(direction);
    let root = along * along - to.length_squared() + radius * radius;
    let t = along - root.max(0.0).sqrt();
    (root > 0.0 && t > 1e-6).then_some(t)
}
