//! The environment: a mirror ball and a Lambert ball alone under a map that looks different from every side.

use lookmatch_imaging::Image;

use super::closed_form::{Finish, Known, Sky, Texels, World};
use super::compare::{self, Suspect};
use super::finding::{Limit, short};
use super::session::{Session, Worn, ball, marked_map};
use super::{Check, Finding};
use crate::{Light, RendererError};

pub(super) const MIRROR: Check = Check {
    name: "mirror",
    about: "a mirror ball alone under a marked map, and the map behind it",
    run: run_mirror,
};

pub(super) const LAMBERT: Check =
    Check { name: "map", about: "a Lambert ball alone under a marked map: its irradiance", run: run_lambert };

/// Words by which renderers speak of their environments.
const WORDS: [&str; 5] = ["environment", "map", "mirror", "reflection", "prefiltered"];

fn run_mirror(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    if !session.has(Light::Environment, finding) {
        return Ok(());
    }
    let Some(worn) = session.mirror() else {
        finding.skip("it has no mirror (check.mirror is null)");
        return Ok(());
    };
    let got = picture(session, "mirror", &worn)?;
    let known = |map: Image, texels| known(session, Sky::new(map, texels), Finish::Mirror([1.0; 3]));
    let linear = known(marked_map(), Texels::Linear);
    let nearest = known(marked_map(), Texels::Nearest);
    finding.show("ball", &got, &linear.image);
    let mut is_right = true;
    for (what, takes) in [("ball", (|c| c > 0.999) as fn(f32) -> bool), ("background", |c| c == 0.0)] {
        let chosen = linear.smooth(takes);
        let share = |expected: &Known| compare::share_close(&got, &expected.image, &chosen, 1.0);
        let name = format!("share of the {what} within 1 %");
        let is_close = finding.measure(name, share(&linear).max(share(&nearest)), Limit::least(0.97));
        let ratio = compare::median_ratio(&got, &linear.image, &chosen);
        let name = format!("median ratio of the {what}");
        if !(finding.measure(name, ratio, Limit::between(0.99, 1.01)) && is_close) {
            is_right = false;
            name_mistake(&got, &linear.image, &chosen, what, finding, &|map| {
                known(map, Texels::Linear).image
            });
        }
    }
    if !is_right {
        excuse(session, finding);
    }
    name_texels(&got, [&linear, &nearest], finding, &|texels| known(marked_map(), texels).image);
    Ok(())
}

/// Says where the middles of texels lie, where it is not where they should be. That is too little to be a fault.
fn name_texels(got: &Image, right: [&Known; 2], finding: &mut Finding, picture: &dyn Fn(Texels) -> Image) {
    // Where colours change tells most, but where they do so within a pixel there is noise.
    let whole: Vec<bool> = right[0].even(0.4, |cover| cover == 0.0 || cover > 0.999);
    let share = |picture: &Image| compare::share_close(got, picture, &whole, 3.0);
    let honest = share(&right[0].image).max(share(&right[1].image));
    let words = "a texel off: a corner of a texel is taken for its middle";
    let others = [
        (
            Texels::Stretched,
            "rows of the map are spread so that the middles of the first and the last are the poles"
                .to_owned(),
        ),
        (Texels::Shifted(0.5, 0.0), format!("columns of the map lie half {words}")),
        (Texels::Shifted(-0.5, 0.0), format!("columns of the map lie half {words}")),
        (Texels::Shifted(0.0, 0.5), format!("rows of the map lie half {words}")),
        (Texels::Shifted(0.0, -0.5), format!("rows of the map lie half {words}")),
        (Texels::Shifted(0.5, 0.5), format!("rows and columns of the map lie half {words}")),
        (Texels::Shifted(-0.5, -0.5), format!("rows and columns of the map lie half {words}")),
    ];
    let found = others.into_iter().map(|(texels, words)| (share(&picture(texels)), words));
    if let Some((share, words)) = found.max_by(|a, b| a.0.total_cmp(&b.0))
        && 1.0 - share < 0.5 * (1.0 - honest)
        && share > 0.85
    {
        let percent = |share: f64| short(100.0 * share);
        finding.remark(format!(
            "{words} ({} instead of {} % of pixels within 3 %)",
            percent(share),
            percent(honest)
        ));
    }
}

fn run_lambert(session: &mut Session, finding: &mut Finding) -> Result<(), RendererError> {
    if !session.has(Light::Environment, finding) {
        return Ok(());
    }
    let (worn, albedo) = session.lambert([0.5; 3]);
    let got = picture(session, "map", &worn)?;
    let known = |map: Image| known(session, Sky::new(map, Texels::Linear), Finish::Lambert(albedo));
    let expected = known(marked_map());
    finding.show("ball", &got, &expected.image);
    // Noise of single pixels would hide what is looked for.
    let within = expected.subject();
    let (got, coarse, chosen) = compare::coarse(&got, &expected.image, &within);
    let ratio = compare::median_ratio(&got, &coarse, &chosen);
    let mut is_right = finding.measure("median ratio", ratio, Limit::between(0.98, 1.02));
    let likeness = compare::likeness(&got, &coarse, &chosen);
    is_right &= finding.measure("likeness", likeness, Limit::least(0.995));
    if !is_right {
        let picture = |map| {
            let seen = known(map).image;
            compare::coarse(&seen, &seen, &within).0
        };
        name_mistake(&got, &coarse, &chosen, "ball", finding, &picture);
        excuse(session, finding);
    }
    Ok(())
}

fn picture(session: &Session, name: &str, worn: &Worn) -> Result<Image, RendererError> {
    let mut scene = ball();
    scene.point_lights.clear();
    scene.environment = Some(session.map("marked", &marked_map())?);
    session.load(name, &scene)?;
    session.picture(name, worn)
}

fn known(session: &Session, sky: Sky, finish: Finish) -> Known {
    let mut scene = ball();
    scene.point_lights.clear();
    let points = if matches!(finish, Finish::Mirror(_)) { 8 } else { 4 };
    World::new(&scene, Some(sky), finish).picture(session.options.size, points)
}

/// Says which way the map is turned, or what else is wrong.
fn name_mistake(
    got: &Image,
    expected: &Image,
    chosen: &[bool],
    what: &str,
    finding: &mut Finding,
    picture: &dyn Fn(Image) -> Image,
) {
    let map = marked_map();
    let honest = compare::likeness(got, expected, chosen);
    let turns = turns().into_iter().map(|(words, turn)| (words, picture(turned(&map, turn))));
    let turns: Vec<(String, Image)> = turns.collect();
    let likeness = turns.iter().map(|(words, seen)| (compare::likeness(got, seen, chosen), words));
    let best = likeness.max_by(|a, b| a.0.total_cmp(&b.0));
    finding.measure(format!("likeness of the {what}"), honest, Limit::NONE);
    if let Some((likeness, words)) = best
        && 1.0 - likeness < 0.5 * (1.0 - honest)
        && likeness > 0.8
    {
        finding.fault(format!("{what}: {words}"));
        return;
    }
    let mut suspects = compare::tones(expected);
    suspects.push(Suspect::new("the map has no effect", Image::new(expected.width(), expected.height())));
    match compare::explain(got, expected, chosen, &suspects) {
        Some(cause) => finding.fault(format!("{what}: {cause}")),
        None if honest > 0.8 => {
            finding.fault(format!("{what}: the map lies as it should, but is not quite the same"))
        }
        None => finding.fault(format!("{what}: no turn of the map explains it")),
    }
}

/// What is wrong may be admitted; a turned or missing map is not.
fn excuse(session: &Session, finding: &mut Finding) {
    let likeness = finding.numbers.iter().filter(|n| n.name.starts_with("likeness"));
    let is_oriented = likeness.fold(1.0_f64, |a, n| a.min(n.value)) > 0.8
        && !finding
            .remarks
            .iter()
            .any(|remark| remark.contains("the map is") || remark.contains("factor of"));
    if let Some(sentence) = session.admitted(&WORDS).filter(|_| is_oriented) {
        finding.excuse(sentence);
    }
}

/// How a map can lie: turned by quarters about the y axis, mirrored before that, flipped.
#[derive(Clone, Copy)]
struct Turn {
    quarters: usize,
    is_mirrored: bool,
    is_flipped: bool,
}

/// All but the right one, in words.
fn turns() -> Vec<(String, Turn)> {
    let mut turns = Vec::new();
    for code in 1..16 {
        let turn = Turn { quarters: code % 4, is_mirrored: code & 4 != 0, is_flipped: code & 8 != 0 };
        let mut words = Vec::new();
        if turn.is_mirrored {
            words.push("mirrored (u runs the other way)".to_owned());
        }
        if turn.is_flipped {
            words.push("upside down (v is flipped: row 0 is +Y)".to_owned());
        }
        if turn.quarters > 0 {
            words.push(format!("turned by {} degrees about the y axis", 90 * turn.quarters));
        }
        turns.push((format!("the map is {}", words.join(" and ")), turn));
    }
    turns
}

/// What is at −Z moves towards +X by so many quarters.
fn turned(map: &Image, turn: Turn) -> Image {
    let (width, height) = (map.width(), map.height());
    Image::from_fn(width, height, |x, y| {
        let x = (x + width - turn.quarters * width / 4) % width;
        let x = if turn.is_mirrored { width - 1 - x } else { x };
        map.get(x, if turn.is_flipped { height - 1 - y } else { y })
    })
}
