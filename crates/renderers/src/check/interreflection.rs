//! The part of a dark ball that no light reaches but by way of the checkerboard.

use lookmatch_imaging::Image;

use super::closed_form::{Finish, World};
use super::compare;
use super::finding::Limit;
use super::session::{Session, ball, checkerboard};
use super::{Check, Finding};
use crate::{Light, RendererError};

pub(super) const CHECK: Check = Check {
    name: "interreflection",
    about: "the side of a ball that is lit by the checkerboard alone, as far as the renderer says so",
    run,
};

/// Dark, so that what goes to and fro once more is little.
const ALBEDO: [f64; 3] = [0.2; 3];

fn run(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    if !session.has(Light::Point, finding) {
        return Ok(());
    }
    let (worn, albedo) = session.lambert(ALBEDO);
    let mut scene = ball();
    scene.plane = Some(checkerboard());
    session.load("interreflection", &scene)?;
    let got = session.picture("interreflection", &worn)?;
    let world = World::new(&scene, None, Finish::Lambert(albedo));
    let direct = world.picture(session.options.size, 4);
    let known = world.with_bounce().picture(session.options.size, 2);
    let inside = known.smooth(|cover| cover > 0.999).into_iter().zip(direct.image.pixels());
    let dark: Vec<bool> = inside.map(|(is_inside, p)| is_inside && *p == [0.0; 3]).collect();
    // Noise is large where light is little: sums have less of it than any pixel.
    let ratio = sum(&got, &dark) / sum(&known.image, &dark);
    finding.show("ball", &got, &known.image);
    let is_declared = session.hello.capabilities.interreflection;
    let limit = if is_declared { Limit::between(0.92, 1.15) } else { Limit::most(0.01) };
    if finding.measure("light from the checkerboard over one bounce of it", ratio, limit) {
        return Ok(());
    }
    finding.remark(match is_declared {
        true if ratio < 0.01 => {
            "the checkerboard does not light the ball, although capabilities.interreflection is true"
                .to_owned()
        }
        true => compare::factor_in_words(ratio),
        false => {
            "the checkerboard lights the ball, although capabilities.interreflection is false".to_owned()
        }
    });
    Ok(())
}

/// All light of chosen pixels.
fn sum(image: &Image, chosen: &[bool]) -> f64 {
    let pixels = image.pixels().iter().zip(chosen).filter(|(_, chosen)| **chosen);
    pixels.flat_map(|(p, _)| p).map(|v| f64::from(*v)).sum()
}
