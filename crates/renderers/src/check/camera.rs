//! Where things lie in the picture: two balls before a camera that looks from the side and is tilted.

use std::f64::consts::FRAC_PI_2;

use glam::{DMat4, DVec4};
use lookmatch_imaging::{Image, luminance};
use lookmatch_rendering::{Camera, PointLight, Scene};

use super::closed_form::{Finish, View, World};
use super::compare;
use super::finding::{Limit, short};
use super::session::{Session, Turn, ball, sphere, turned};
use super::{Check, Finding};
use crate::{Light, RendererError};

pub(super) const CHECK: Check = Check {
    name: "camera",
    about: "two balls before a tilted camera: orientation, place and field of view",
    run,
};

/// Dark, so that they do not light each other, and bright lights.
const ALBEDO: [f64; 3] = [0.2; 3];
const UP: [f64; 3] = [0.25, 1.0, 0.1];

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    if !session.has(Light::Point, finding) {
        return Ok(());
    }
    let (worn, albedo) = session.lambert(ALBEDO);
    let scene = scene();
    session.load("camera", &scene)?;
    let got = session.picture("camera", &worn)?;
    let world = World::new(&scene, None, Finish::Lambert(albedo));
    let size = session.options.size;
    let expected = world.picture(size, 8).image;
    finding.show("balls", &got, &expected);
    let everywhere = vec![true; size * size];
    let likeness = |seen: &Image| compare::likeness(&got, seen, &everywhere);
    let mistakes = mistakes(&scene, &world, &expected, albedo);
    let honest = likeness(&expected);
    let best = mistakes
        .iter()
        .map(|(words, seen, turn)| (likeness(seen), words, turn))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((likeness, words, turn)) = best
        && likeness > honest + 0.01
        && likeness > 0.9
    {
        finding.measure("likeness", honest, Limit::least(0.99));
        finding.remark(words.clone());
        if let Some(turn) = turn.filter(|turn| turned(&turned(&expected, *turn), *turn) == expected) {
            finding.remark("pictures are put right for the checks that follow");
            session.turn = Some(turn);
        }
        return Ok(());
    }
    let fit = Fit::new(&world, &got);
    measure(&fit, scene.camera.vertical_fov, size, finding);
    Ok(())
}

fn scene() -> Scene {
    Scene {
        camera: Camera { eye: [1.6, 1.7, 5.4], target: [0.15, -0.1, 0.1], up: UP, vertical_fov: 30.0 },
        spheres: vec![sphere([-0.6, 0.15, 0.0], 0.8), sphere([1.1, -0.55, 0.4], 0.4)],
        // One light for the shading, and one from the front, so that the whole outline is seen.
        point_lights: vec![
            PointLight { position: [-3.0, 4.0, 4.0], intensity: [60.0; 3] },
            PointLight { position: [1.6, 1.7, 5.4], intensity: [40.0; 3] },
        ],
        ..ball()
    }
}

/// What else could be in the picture.
fn mistakes(
    scene: &Scene,
    world: &World,
    expected: &Image,
    albedo: [f64; 3],
) -> Vec<(String, Image, Option<Turn>)> {
    let size = expected.width();
    let other = |words: &str, change: &dyn Fn(&mut Scene)| {
        let mut scene = scene.clone();
        change(&mut scene);
        let world = World::new(&scene, None, Finish::Lambert(albedo));
        (words.to_owned(), world.picture(size, 4).image)
    };
    let upright =
        other("the camera's `up` is not heeded: it is the y axis", &|s| s.camera.up = [0.0, 1.0, 0.0]);
    let single = other("only the first sphere is seen", &|s| s.spheres.truncate(1));
    let unshaded = {
        let mut world = world.clone();
        world.has_shadows = false;
        ("one ball casts no shadow on the other".to_owned(), world.picture(size, 4).image)
    };
    let others = [upright, single, unshaded].map(|(words, seen)| (words, seen, None));
    let turns = TURNS.map(|(words, turn)| (words.to_owned(), turned(expected, turn), Some(turn)));
    turns.into_iter().chain(others).collect()
}

/// Ways in which a picture may be turned. All but the quarter turns are their own inverse.
const TURNS: [(&str, Turn); 7] = [
    ("rows are flipped: row 0 is the top of the picture", |x, y, last| (x, last - y)),
    ("columns are mirrored: the first pixel of a row is its left end", |x, y, last| (last - x, y)),
    ("the picture is turned by 180 degrees: rows are flipped and columns mirrored", |x, y, last| {
        (last - x, last - y)
    }),
    ("rows and columns are exchanged: pixels come row by row", |x, y, _| (y, x)),
    ("rows and columns are exchanged, and both are reversed", |x, y, last| (last - y, last - x)),
    ("the picture is turned by 90 degrees", |x, y, last| (y, last - x)),
    ("the picture is turned by 90 degrees", |x, y, last| (last - y, x)),
];

fn measure(fit: &Fit, fov: f64, size: usize, finding: &mut Finding) {
    let half = size as f64 / 2.0;
    let [right, down] = fit.view.shift.map(|s| s * half);
    let is_placed = finding.measure("pixels too far right", right, Limit::between(-0.1, 0.1))
        & finding.measure("pixels too low", down, Limit::between(-0.1, 0.1));
    if !is_placed {
        let words = |shift: f64, positive: &str, negative: &str, kind: &str| {
            let side = if shift > 0.0 { positive } else { negative };
            let reason = match shift.abs() {
                s if (s - 0.5).abs() < 0.12 => "a corner of a pixel is taken for its middle".to_owned(),
                s if (s - s.round()).abs() < 0.12 => format!("{kind} are counted from another one"),
                _ => "the middle of the film lies elsewhere".to_owned(),
            };
            format!("the picture lies {} pixels too {side}: {reason}", short(shift.abs()))
        };
        if right.abs() > 0.1 {
            finding.remark(words(right, "far right", "far left", "columns"));
        }
        if down.abs() > 0.1 {
            finding.remark(words(down, "low", "high", "rows"));
        }
    }
    let tangent = (fov.to_radians() / 2.0).tan();
    let found = 2.0 * (fit.view.zoom * tangent).atan().to_degrees();
    if !finding.measure("degrees of the field of view", found, Limit::between(0.997 * fov, 1.003 * fov)) {
        let known = [
            (2.0 * (tangent / 2.0_f64.sqrt()).atan().to_degrees(), "it is measured over the diagonal"),
            (fov / 2.0, "half of it is used"),
            (2.0 * fov, "it is taken for half of the angle"),
            (2.0 * (tangent * 4.0 / 3.0).atan().to_degrees(), "the film has an aspect of 4:3"),
            (2.0 * (tangent * 3.0 / 4.0).atan().to_degrees(), "the film has an aspect of 4:3"),
            (2.0 * (tangent * 16.0 / 9.0).atan().to_degrees(), "the film has an aspect of 16:9"),
            (2.0 * (tangent * 9.0 / 16.0).atan().to_degrees(), "the film has an aspect of 16:9"),
        ];
        let reason = known.iter().find(|(value, _)| (found / value - 1.0).abs() < 0.02);
        let reason = reason.map_or("it goes from the lower to the upper edge", |(_, words)| words);
        finding.remark(format!("the field of view is {} instead of {fov} degrees: {reason}", short(found)));
    }
    let roll = fit.view.roll.to_degrees();
    if !finding.measure("degrees of roll", roll, Limit::between(-0.3, 0.3)) {
        finding.remark(format!("the picture is turned by {} degrees clockwise", short(roll)));
    }
    let is_explained = fit.residual <= 0.05;
    finding.measure("what remains unexplained", fit.residual, Limit::most(0.05));
    if !is_explained && is_placed {
        finding.remark("no place and no orientation of the camera explains the picture");
    }
}

/// The view that explains a picture best, by Gauss-Newton steps; exposure and encoding are left free, as others look at them.
struct Fit {
    view: View,
    /// Root mean square of what remains, over the picture's range.
    residual: f64,
}

impl Fit {
    const STEPS: usize = 5;
    /// Points of a pixel, across.
    const POINTS: usize = 4;

    fn new(world: &World, got: &Image) -> Self {
        let size = got.width();
        let pixel = 2.0 / size as f64;
        let got: Vec<f64> = grey(got);
        let mut at = DVec4::ZERO;
        let seen = |at: DVec4| {
            let mut world = world.clone();
            world.view = bent(world.view, at, pixel);
            encoded(grey(&world.picture(size, Self::POINTS).image), &got)
        };
        for _ in 0..Self::STEPS {
            let now = seen(at);
            let slopes = [DVec4::X, DVec4::Y, DVec4::Z, DVec4::W].map(|axis| {
                let (more, less) = (seen(at + 0.5 * axis), seen(at - 0.5 * axis));
                more.iter().zip(less).map(|(more, less)| more - less).collect::<Vec<f64>>()
            });
            let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let miss: Vec<f64> = got.iter().zip(&now).map(|(got, now)| got - now).collect();
            let column = |k: usize| DVec4::from_array([0, 1, 2, 3].map(|j| product(&slopes[j], &slopes[k])));
            let matrix = DMat4::from_cols(column(0), column(1), column(2), column(3));
            let right = DVec4::from_array([0, 1, 2, 3].map(|j| product(&slopes[j], &miss)));
            let step = matrix.inverse() * right;
            if !step.is_finite() {
                break;
            }
            at = (at + step.clamp(DVec4::splat(-4.0), DVec4::splat(4.0)))
                .clamp(DVec4::splat(-0.5 * size as f64), DVec4::splat(0.5 * size as f64));
        }
        let now = seen(at);
        let miss = got.iter().zip(&now).map(|(got, now)| (got - now).powi(2)).sum::<f64>() / got.len() as f64;
        let range = got.iter().fold(0.0_f64, |a, b| a.max(*b)).max(f64::MIN_POSITIVE);
        Self { view: bent(world.view, at, pixel), residual: miss.sqrt() / range }
    }
}

/// A view that is bent by four numbers, each of which moves the edge of the picture by so many pixels.
fn bent(mut view: View, at: DVec4, pixel: f64) -> View {
    view.shift = [at.x * pixel, at.y * pixel];
    view.zoom = (1.0 + at.z * pixel).max(0.1);
    view.roll = (at.w * pixel).clamp(-FRAC_PI_2, FRAC_PI_2);
    view
}

fn grey(image: &Image) -> Vec<f64> {
    image.pixels().iter().map(|p| luminance(*p).max(0.0).into()).collect()
}

/// Values in the exposure and with the exponent of others.
fn encoded(values: Vec<f64>, like: &[f64]) -> Vec<f64> {
    let dark = 0.1 * values.iter().fold(0.0_f64, |a, b| a.max(*b));
    let logs: Vec<(f64, f64)> = values
        .iter()
        .zip(like)
        .filter(|(v, l)| **v > dark && **l > 0.0)
        .map(|(v, l)| (v.ln(), l.ln()))
        .collect();
    let count = logs.len().max(1) as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |(x, y), l| (x + l.0 / count, y + l.1 / count));
    let (xy, xx) =
        logs.iter().fold((0.0, 0.0), |(xy, xx), l| (xy + (l.0 - x) * (l.1 - y), xx + (l.0 - x).powi(2)));
    let exponent = if xx > 0.0 { (xy / xx).clamp(0.2, 5.0) } else { 1.0 };
    values.into_iter().map(|v| (y + exponent * (v.max(1e-12).ln() - x)).exp()).collect()
}
