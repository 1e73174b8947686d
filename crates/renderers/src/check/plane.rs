//! The checkerboard with the shadow of a black ball, which throws no light onto it.

use lookmatch_imaging::{Image, srgb_decode};
use lookmatch_rendering::{Plane, Scene};

use super::closed_form::{Finish, World};
use super::compare::{self, Suspect};
use super::finding::Limit;
use super::session::{Session, ball, checkerboard};
use super::{Check, Finding};
use crate::{Light, RendererError};

pub(super) const CHECK: Check =
    Check { name: "plane", about: "the checkerboard below a black ball: albedos, checks, shadow", run };

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    if !session.has(Light::Point, finding) {
        return Ok(());
    }
    let (worn, albedo) = session.lambert([0.0; 3]);
    let mut scene = ball();
    scene.plane = Some(checkerboard());
    session.load("plane", &scene)?;
    let got = session.picture("plane", &worn)?;
    let world = World::new(&scene, None, Finish::Lambert(albedo));
    let size = session.options.size;
    let known = world.picture(size, 8);
    let around = known.smooth(|cover| cover == 0.0);
    let lit: Vec<bool> = around.iter().zip(known.image.pixels()).map(|(a, p)| *a && p[0] > 0.0).collect();
    let ratio = compare::median_ratio(&got, &known.image, &lit);
    let mut is_right = finding.measure("median ratio", ratio, Limit::between(0.99, 1.01));
    let share = compare::share_close(&got, &known.image, &around, 1.0);
    is_right &= finding.measure("share of pixels within 1 %", share, Limit::least(0.97));
    let on_ball = known.smooth(|cover| cover > 0.999);
    let share = compare::share_close(&got, &known.image, &on_ball, 1.0);
    is_right &= finding.measure("share of the black ball that is black", share, Limit::least(0.97));
    finding.show("shadow", &got, &known.image);
    if !is_right {
        let all: Vec<bool> = around.iter().zip(&on_ball).map(|(a, b)| *a || *b).collect();
        let suspects = suspects(&scene, &world, &known.image, albedo, size);
        if let Some(cause) = compare::explain(&got, &known.image, &all, &suspects) {
            finding.remark(cause);
        }
    }
    Ok(())
}

fn suspects(scene: &Scene, world: &World, expected: &Image, albedo: [f64; 3], size: usize) -> Vec<Suspect> {
    let mut suspects = compare::tones(expected);
    let mut other =
        |words: &str, world: World| suspects.push(Suspect::new(words, world.picture(size, 4).image));
    let changed = |change: &dyn Fn(&mut Plane)| {
        let mut scene = scene.clone();
        scene.plane.iter_mut().for_each(change);
        World::new(&scene, None, Finish::Lambert(albedo))
    };
    other(
        "light and dark checks are exchanged: the check at 0 < x, z < check_size is light",
        changed(&|plane| std::mem::swap(&mut plane.light, &mut plane.dark)),
    );
    let shifts = [([0.5, 0.0], "x"), ([0.0, 0.5], "z"), ([0.5, 0.5], "x and z")];
    for (check_shift, axis) in shifts {
        let words =
            format!("checks lie half a check off along {axis}: a corner of a check lies at x = z = 0");
        let mut world = world.clone();
        world.check_shift = check_shift;
        other(&words, world);
    }
    other("checks are twice as large: check_size is the side of one", changed(&|p| p.check_size *= 2.0));
    other("checks are half as large: check_size is the side of one", changed(&|p| p.check_size /= 2.0));
    other("the plane is twice as large: half_extent is half of its side", changed(&|p| p.half_extent *= 2.0));
    other("the plane is half as large: half_extent is half of its side", changed(&|p| p.half_extent /= 2.0));
    other("the plane lies at height 0", changed(&|p| p.height = 0.0));
    other("the plane is missing", {
        let scene = Scene { plane: None, ..scene.clone() };
        World::new(&scene, None, Finish::Lambert(albedo))
    });
    let mut unshaded = world.clone();
    unshaded.has_shadows = false;
    other("the ball casts no shadow", unshaded);
    let decoded = |c: [f64; 3]| c.map(|a| f64::from(srgb_decode(a as f32)));
    other(
        "the albedos of the checks are taken for sRGB and decoded: they are linear",
        changed(&|p| (p.light, p.dark) = (decoded(p.light), decoded(p.dark))),
    );
    other(
        "the ball is not black: albedos of the material have no effect",
        World::new(scene, None, Finish::Lambert([0.5; 3])),
    );
    suspects
}
