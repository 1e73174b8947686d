//! Gathers the moments of one row: samples on rings of half vectors, sixteen at a time. See [`crate::rings`].

use std::f32::consts::{FRAC_1_SQRT_2, PI};
use std::sync::LazyLock;

use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, prelude::*, u32x16};
use glam::DVec3;

use crate::Rgb;
use crate::angles::lanes::{half_turns, sin_cos, turns};
use crate::bodies::Body;
use crate::environment::EnvironmentMap;
use crate::field::Field;
use crate::film::SurfacePoint;
use crate::functions::{self, Functions};
use crate::irradiance::Place;
use crate::product::{LANES, Lanes};
use crate::rings::{NODES, Ring, TERMS, node};
use crate::rows::View;
use crate::sampling::cosine_direction;

/// Width of a look-up in units of the distance between samples: neighbours overlap, so that a small bright light between
/// them is missed by neither.
const OVERLAP: f32 = 1.5;
/// The first of the outer intervals between nodes: 30° from the normal.
const OUTER: usize = 20;
/// Terms that are kept of the moments of functions on the checkerboard.
pub(crate) const FUNCTION_TERMS: usize = 2;

/// Light of a row by basis function: red, green, blue, and what the checkerboard would send if its irradiance were 1
/// everywhere (its albedo's luminance over π).
pub(crate) type Moments = [[[f32; 4]; TERMS]; NODES];

/// For some functions on the checkerboard: what it would send if its irradiance were the function.
pub(crate) type FunctionMoments = [[[f32; functions::COUNT]; FUNCTION_TERMS]; NODES];

/// How densely the rings are sampled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Density {
    /// Rings between two nodes: the inner ones and, beyond [`OUTER`], those that are longest by far and matter to wide lobes
    /// alone.
    pub(crate) strata: [usize; 2],
    /// Angle between mirrored views of neighbouring points of the row, in radians.
    pub(crate) spread: f32,
}

/// The moments of the light at some points of one row, averaged over them.
pub(crate) fn moments(field: &Field, points: &[View], density: Density) -> Moments {
    let mut moments = [[[0.0; 4]; TERMS]; NODES];
    let level = Level::new();
    dispatch!(level, simd => Gatherer::new(simd, field, points, density, None).gather(|j, sums, _| {
        moments[j] = *sums;
    }));
    moments
}

/// The same, beside the moments of functions on the checkerboard.
pub(crate) fn moments_with(
    field: &Field,
    functions: &Functions,
    points: &[View],
    density: Density,
) -> (Moments, Box<FunctionMoments>) {
    let mut moments = [[[0.0; 4]; TERMS]; NODES];
    let mut of_functions = Box::new([[[0.0; functions::COUNT]; FUNCTION_TERMS]; NODES]);
    let level = Level::new();
    dispatch!(level, simd => Gatherer::new(simd, field, points, density, Some(functions)).gather(|j, sums, more| {
        moments[j] = *sums;
        of_functions[j] = *more;
    }));
    (moments, of_functions)
}

/// Directions of the irradiance at one point.
const HEMISPHERE: usize = 2048;

/// Irradiance at a place from the other bodies: red, green, blue, and the fourth channel of [`Moments`].
pub(crate) fn from_bodies(field: &Field, place: &Place) -> [f32; 4] {
    let level = Level::new();
    dispatch!(level, simd => hemisphere(simd, field, place))
}

/// Directions with density `cos θ/π` about the z axis, sixteen in a row for each coordinate.
static COSINE_DIRECTIONS: LazyLock<Vec<[Lanes; 3]>> = LazyLock::new(|| {
    let directions: Vec<DVec3> = (0..HEMISPHERE as u32).map(|i| cosine_direction(i, DVec3::Z)).collect();
    let lanes = |chunk: &[DVec3]| std::array::from_fn(|k| std::array::from_fn(|l| chunk[l][k] as f32));
    directions.chunks_exact(LANES).map(lanes).collect()
});

#[inline(always)]
fn hemisphere<S: Simd>(simd: S, field: &Field, place: &Place) -> [f32; 4] {
    // Turned from place to place, so that neighbours do not share what the samples miss.
    let seed = place.position * 997.0;
    let angle = (seed.x.sin() + seed.y.sin() + seed.z.sin()) * 50.0;
    let tangent = place.normal.any_orthonormal_vector();
    let tangent = tangent * angle.cos() + place.normal.cross(tangent) * angle.sin();
    let frame = [tangent, place.normal.cross(tangent), place.normal];
    let view = View {
        point: SurfacePoint { place: *place, sphere: 0, wo: place.normal },
        frame,
        cosine: 1.0,
        sine: 0.0,
    };
    let points = [view];
    let density = Density { strata: [1, 1], spread: 0.0 };
    let gatherer = Gatherer { sky: None, ..Gatherer::new(simd, field, &points, density, None) };
    // Each direction stands for an equal share of the projected hemisphere.
    let width = OVERLAP * (PI / HEMISPHERE as f32).sqrt();
    let mut sums = [f32x16::splat(simd, 0.0); 4];
    let mut hits = [Hits::default(), Hits::default()];
    for (round, [x, y, z]) in COSINE_DIRECTIONS.iter().enumerate() {
        let local =
            [f32x16::load_array(simd, *x), f32x16::load_array(simd, *y), f32x16::load_array(simd, *z)];
        let width = f32x16::splat(simd, width) / local[2].max(0.05).sqrt();
        gatherer.look(gatherer.to_world(local), width, local[2].simd_gt(0.0), &mut hits[round % 2]);
        for c in 0..4 {
            sums[c] += f32x16::load_array(simd, hits[(round + 1) % 2].light[c]);
        }
    }
    for c in 0..4 {
        sums[c] += f32x16::load_array(simd, hits[(COSINE_DIRECTIONS.len() + 1) % 2].light[c]);
    }
    let mut irradiance = [0.0; 4];
    for c in 0..4 {
        irradiance[c] = total(sums[c]) * (PI / HEMISPHERE as f32);
    }
    irradiance
}

/// The sum of all lanes, in pairs.
#[inline(always)]
fn total<S: Simd>(lanes: f32x16<S>) -> f32 {
    let mut sums = lanes.to_array();
    for half in [8, 4, 2, 1] {
        for l in 0..half {
            sums[l] += sums[l + half];
        }
    }
    sums[0]
}

/// Three coordinates in lanes.
#[derive(Clone, Copy)]
struct Vec3<S: Simd>([f32x16<S>; 3]);

impl<S: Simd> Vec3<S> {
    #[inline(always)]
    fn of(simd: S, points: &[View], value: impl Fn(&View) -> DVec3) -> Self {
        let lane = |axis: usize| {
            let lanes: Lanes = std::array::from_fn(|l| value(&points[l % points.len()])[axis] as f32);
            f32x16::load_array(simd, lanes)
        };
        Self([lane(0), lane(1), lane(2)])
    }

    #[inline(always)]
    fn dot(self, other: Self) -> f32x16<S> {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        a.mul_add(x, b.mul_add(y, c * z))
    }

    /// `self + t · direction`
    #[inline(always)]
    fn along(self, t: f32x16<S>, direction: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, direction.0);
        Self([t.mul_add(x, a), t.mul_add(y, b), t.mul_add(z, c)])
    }
}

/// The points of a row, one in each lane (fewer of them repeat), and what they see.
struct Gatherer<'a, S: Simd> {
    simd: S,
    field: &'a Field,
    sky: Option<&'a EnvironmentMap>,
    functions: Option<&'a Functions>,
    points: &'a [View],
    density: Density,
    position: Vec3<S>,
    frame: [Vec3<S>; 3],
    cosine: f32x16<S>,
    sine: f32x16<S>,
    /// Mean angle of view: the rings are cut for it.
    mean: (f64, f64),
}

/// One ring of samples.
struct Samples {
    sin_h: f32,
    cos_h: f32,
    /// Middle and half of the range of `cos_d`.
    middle: f32,
    swing: f32,
    /// Azimuth of the first sample and distance to the next, in radians.
    first: f32,
    spacing: f32,
    count: usize,
    /// Range of θ_h that the ring stands for.
    step: f32,
    /// Share of the right-hand hat function.
    hat: f32,
    /// Which lane comes first.
    turn: usize,
}

impl<'a, S: Simd> Gatherer<'a, S> {
    #[inline(always)]
    fn new(
        simd: S,
        field: &'a Field,
        points: &'a [View],
        density: Density,
        functions: Option<&'a Functions>,
    ) -> Self {
        let theta = points.iter().map(View::angle).sum::<f64>() / points.len() as f64;
        let number = |value: &dyn Fn(&View) -> f64| {
            let lanes: Lanes = std::array::from_fn(|l| value(&points[l % points.len()]) as f32);
            f32x16::load_array(simd, lanes)
        };
        Self {
            simd,
            field,
            sky: field.environment.as_ref(),
            functions,
            points,
            density,
            position: Vec3::of(simd, points, |v| v.point.place.position),
            frame: std::array::from_fn(|axis| Vec3::of(simd, points, |v| v.frame[axis])),
            cosine: number(&|v| v.cosine),
            sine: number(&|v| v.sine),
            mean: (theta.cos(), theta.sin()),
        }
    }

    /// Walks all rings; hands over, for each node, its moments and those of the functions.
    #[inline(always)]
    fn gather(
        &mut self,
        mut found: impl FnMut(usize, &[[f32; 4]; TERMS], &[[f32; functions::COUNT]; FUNCTION_TERMS]),
    ) {
        if self.points.is_empty() {
            return;
        }
        let (mut left, mut right) = (Sums::new(self.simd), Sums::new(self.simd));
        for interval in 0..NODES - 1 {
            let strata = self.density.strata[usize::from(interval >= OUTER)];
            for stratum in 0..strata {
                if let Some(samples) = self.ring(interval, stratum, strata) {
                    self.add_ring(&samples, &mut left, &mut right);
                }
            }
            found(interval, &left.totals(), &left.functions);
            left = right;
            right = Sums::new(self.simd);
        }
        found(NODES - 1, &left.totals(), &left.functions);
    }

    /// The samples of a ring; `None` where it lies below the horizon.
    #[inline(always)]
    fn ring(&self, interval: usize, stratum: usize, strata: usize) -> Option<Samples> {
        let hat = (stratum as f64 + 0.5) / strata as f64;
        let width = node(interval + 1) - node(interval);
        let (theta, step) = (node(interval) + hat * width, width / strata as f64);
        let (sin_h, cos_h) = theta.sin_cos();
        let ring = Ring::new(self.mean, (cos_h, sin_h))?;
        let number = interval * strata + stratum;
        // As far apart along the ring as the rings are from each other, and at least one for each lane.
        let wanted = 2.0 * ring.half_angle * sin_h / step;
        let count = (wanted / LANES as f64).round().max(1.0) as usize * LANES;
        let spacing = 2.0 * ring.half_angle / count as f64;
        // The golden ratio keeps neighbouring rings from sampling the same azimuths.
        let shift = (number as f64 * 0.618_033_988_749_895).fract();
        let (low, high) = (ring.cos_d(-1.0), ring.cos_d(1.0));
        Some(Samples {
            sin_h: sin_h as f32,
            cos_h: cos_h as f32,
            middle: ((low + high) / 2.0) as f32,
            swing: ((high - low) / 2.0).max(1e-9) as f32,
            first: (shift * spacing - ring.half_angle) as f32,
            spacing: spacing as f32,
            count,
            step: step as f32,
            hat: hat as f32,
            turn: 3 * number,
        })
    }

    /// Adds the samples of a ring to the two hat functions that it lies under.
    #[inline(always)]
    fn add_ring(&self, ring: &Samples, left: &mut Sums<S>, right: &mut Sums<S>) {
        let simd = self.simd;
        let mut order = [0.0; LANES];
        for (l, place) in order.iter_mut().enumerate() {
            *place = ((5 * l + ring.turn) % LANES) as f32;
        }
        let order = f32x16::load_array(simd, order);
        let mut sums = Sums::new(simd);
        // Samples are added one round late: what was just stored lane by lane cannot be loaded as a whole at once.
        let mut hits = [Hits::default(), Hits::default()];
        let mut last = f32x16::splat(simd, 0.0);
        for (round, start) in (0..ring.count).step_by(LANES).enumerate() {
            let azimuth = (order + start as f32).mul_add(ring.spacing, ring.first);
            let (sin_phi, cos_phi) = sin_cos(azimuth);
            let cos_d = (self.sine * ring.sin_h).mul_add(cos_phi, self.cosine * ring.cos_h);
            let (along, across) = (cos_d * (2.0 * ring.sin_h), cos_d * (2.0 * ring.cos_h) - self.cosine);
            let local = [along * cos_phi - self.sine, along * sin_phi, across];
            let direction = self.to_world(local);
            let lit = across.simd_gt(0.0) & cos_d.simd_gt(0.0);
            let solid_angle = cos_d * (4.0 * OVERLAP * OVERLAP * ring.step * ring.sin_h * ring.spacing);
            let width = (solid_angle.max(0.0) + self.density.spread * self.density.spread).sqrt();
            let x = ((cos_d - ring.middle) * ring.swing.recip()).max(-1.0).min(1.0);
            self.look(direction, width, lit, &mut hits[round % 2]);
            sums.add_samples(&hits[(round + 1) % 2], last, self.functions);
            last = x;
        }
        sums.add_samples(&hits[(ring.count / LANES + 1) % 2], last, self.functions);
        let weight = ring.spacing * ring.step;
        left.add(&sums, weight * (1.0 - ring.hat));
        right.add(&sums, weight * ring.hat);
    }

    #[inline(always)]
    fn to_world(&self, [x, y, z]: [f32x16<S>; 3]) -> Vec3<S> {
        // Written out: a closure would not be compiled for the instruction set.
        let [[tx, ty, tz], [bx, by, bz], [nx, ny, nz]] = [self.frame[0].0, self.frame[1].0, self.frame[2].0];
        Vec3([
            x.mul_add(tx, y.mul_add(bx, z * nx)),
            x.mul_add(ty, y.mul_add(by, z * ny)),
            x.mul_add(tz, y.mul_add(bz, z * nz)),
        ])
    }

    /// What arrives from some directions, averaged over `width` radians; black where not `lit`.
    #[inline(always)]
    fn look(&self, direction: Vec3<S>, width: f32x16<S>, lit: mask32x16<S>, hits: &mut Hits) {
        let simd = self.simd;
        let sphere_distance = self.nearest_sphere(direction);
        hits.light = [[0.0; LANES]; 4];
        let lit = lit.to_bitmask();
        let mut on_plane = 0;
        let (mut u, mut v, mut level) =
            (f32x16::splat(simd, 0.0), f32x16::splat(simd, 0.0), u32x16::splat(simd, 0));
        if let Some(sky) = self.sky {
            let [x, y, z] = direction.0;
            let turned = turns(x, -z) - sky.rotation;
            u = turned.simd_lt(0.0).select(turned + 1.0, turned);
            v = half_turns(y);
            level = level_of(width * (sky.dimmed.height() as f32 / PI));
        }
        if let (Some(board), Some((height, half))) = (&self.field.board, self.field.bodies.plane()) {
            let [dx, dy, dz] = direction.0;
            let distance = (f32x16::splat(simd, height as f32) - self.position.0[1]) / dy;
            let (px, pz) =
                (distance.mul_add(dx, self.position.0[0]), distance.mul_add(dz, self.position.0[2]));
            let inside = px.abs().max(pz.abs()).simd_le(half as f32);
            let hit = inside & distance.simd_gt(self.least_distance()) & distance.simd_lt(sphere_distance);
            on_plane = hit.to_bitmask() & lit;
            if on_plane != 0 {
                // The footprint is stretched along the ray at grazing angles; a square of equal area stands for it.
                let footprint = width * distance / dy.abs().sqrt().max(0.05);
                let scale = 0.5 / half as f32;
                let (pu, pv) = (px.mul_add(scale, f32x16::splat(simd, 0.5)), pz.mul_add(scale, 0.5));
                u = hit.select(pu, u);
                v = hit.select(pv, v);
                level = hit.select(level_of(footprint * (board.texels() as f32 * scale)), level);
            }
        }
        let on_sphere = sphere_distance.simd_lt(f32::MAX).to_bitmask();
        let (u, v, level) = (u.to_array(), v.to_array(), level.to_array());
        for lane in 0..LANES {
            if lit >> lane & 1 == 0 {
                continue;
            }
            let light = if on_plane >> lane & 1 == 1 {
                self.field
                    .board
                    .as_ref()
                    .map_or(Rgb::ZERO, |b| b.radiance.at_level(u[lane], v[lane], level[lane]))
            } else if on_sphere >> lane & 1 == 1 {
                self.sphere_radiance(&direction, lane)
            } else {
                self.sky.map_or(Rgb::ZERO, |e| e.dimmed.at_level(u[lane], v[lane], level[lane]))
            };
            (0..4).for_each(|c| hits.light[c][lane] = light[c]);
        }
        hits.on_plane = on_plane;
        (hits.u, hits.v) = (u, v);
    }

    /// Distance of the checkerboard below which a ray starts from it.
    fn least_distance(&self) -> f32 {
        if self.points[0].point.place.body == Body::Plane { f32::INFINITY } else { 0.0 }
    }

    /// Distance to the nearest sphere in each lane; [`f32::MAX`] where there is none.
    #[inline(always)]
    fn nearest_sphere(&self, direction: Vec3<S>) -> f32x16<S> {
        let mut nearest = f32x16::splat(self.simd, f32::MAX);
        let own = usize::from(matches!(self.points[0].point.place.body, Body::Sphere(_)));
        if self.field.bodies.spheres().len() <= own {
            // The only sphere is the one that the rays start from.
            return nearest;
        }
        for (centre, radius) in self.field.bodies.spheres() {
            let [x, y, z] = self.position.0;
            let from_centre = Vec3([x - centre.x as f32, y - centre.y as f32, z - centre.z as f32]);
            let along = from_centre.dot(direction);
            let axis = from_centre.along(-along, direction);
            let discriminant = -axis.dot(axis) + (radius * radius) as f32;
            let distance = -along - discriminant.max(0.0).sqrt();
            // A ray that leaves its own sphere has `along` near its radius: above 0.
            let hit = discriminant.simd_gt(0.0)
                & along.simd_lt(0.0)
                & distance.simd_gt(0.0)
                & distance.simd_lt(nearest);
            nearest = hit.select(distance, nearest);
        }
        nearest
    }

    /// Radiance of the sphere that a lane's ray meets.
    fn sphere_radiance(&self, direction: &Vec3<S>, lane: usize) -> Rgb {
        let place: Place = self.points[lane % self.points.len()].point.place;
        let [x, y, z] = direction.0.map(|axis| f64::from(axis[lane]));
        self.field.body_radiance(&place, DVec3::new(x, y, z).normalize(), 0.0).unwrap_or(Rgb::ZERO)
    }
}

/// Sums over samples: of light for each polynomial and channel, of functions for each polynomial and function.
#[derive(Clone, Copy)]
struct Sums<S: Simd> {
    light: [[f32x16<S>; 4]; TERMS],
    functions: [[f32; functions::COUNT]; FUNCTION_TERMS],
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self {
            light: [[f32x16::splat(simd, 0.0); 4]; TERMS],
            functions: [[0.0; functions::COUNT]; FUNCTION_TERMS],
        }
    }

    /// Adds sixteen samples at the positions `x` of their ring.
    #[inline(always)]
    fn add_samples(&mut self, hits: &Hits, x: f32x16<S>, functions: Option<&Functions>) {
        let mut polynomials = [x; TERMS];
        polynomials[0] = f32x16::splat(x.token(), 1.0);
        for k in 2..TERMS {
            polynomials[k] = (x * 2.0).mul_sub(polynomials[k - 1], polynomials[k - 2]);
        }
        for c in 0..4 {
            let light = f32x16::load_array(x.token(), hits.light[c]);
            for k in 0..TERMS {
                self.light[k][c] = polynomials[k].mul_add(light, self.light[k][c]);
            }
        }
        if let Some(functions) = functions {
            add_functions(functions, hits, &x.to_array(), &mut self.functions);
        }
    }

    /// Adds `weight` times other sums.
    #[inline(always)]
    fn add(&mut self, other: &Self, weight: f32) {
        for k in 0..TERMS {
            for c in 0..4 {
                self.light[k][c] = other.light[k][c].mul_add(weight, self.light[k][c]);
            }
        }
        for k in 0..FUNCTION_TERMS {
            for a in 0..functions::COUNT {
                self.functions[k][a] += weight * other.functions[k][a];
            }
        }
    }

    #[inline(always)]
    fn totals(&self) -> [[f32; 4]; TERMS] {
        let mut totals = [[0.0; 4]; TERMS];
        for k in 0..TERMS {
            for c in 0..4 {
                totals[k][c] = total(self.light[k][c]);
            }
        }
        totals
    }
}

/// What sixteen rays met.
#[derive(Default)]
struct Hits {
    /// Red, green, blue, and the albedo's luminance over π.
    light: [Lanes; 4],
    /// Bits of the lanes that met the checkerboard, and where on it.
    on_plane: u64,
    u: Lanes,
    v: Lanes,
}

#[inline(always)]
fn add_functions(
    functions: &Functions,
    hits: &Hits,
    x: &Lanes,
    sums: &mut [[f32; functions::COUNT]; FUNCTION_TERMS],
) {
    for lane in 0..LANES {
        if hits.on_plane >> lane & 1 == 0 {
            continue;
        }
        let values = functions.at(hits.u[lane], hits.v[lane]);
        let albedo = hits.light[3][lane];
        for (sum, polynomial) in sums.iter_mut().zip([1.0, x[lane]]) {
            for (sum, value) in sum.iter_mut().zip(values) {
                *sum += albedo * polynomial * value;
            }
        }
    }
}

/// The level of a pyramid whose texels are closest to a footprint of `texels` of the finest one.
#[inline(always)]
fn level_of<S: Simd>(texels: f32x16<S>) -> u32x16<S> {
    // The exponent of the number, rounded on the scale of the logarithm.
    let bits = (texels * (2.0 * FRAC_1_SQRT_2)).max(1.0).to_bits();
    (bits >> 23) - 127
}
