//! How many components synthesised pictures need (Guarnera *et al.* 2018, section 4: "the first 10").
//!
//! Every second level of a target's lattice is rendered, and all other pictures are synthesised from these. Then they are rendered
//! as well, and compared. Pictures are decomposed twice: in linear RGB, where NRMSD is taken, and in CIELAB, where a search compares.

use lookmatch_imaging::{Columns, Image};
use lookmatch_materials::Material;
use lookmatch_rendering::Planes;
use lookmatch_search::{Bounds, Lattice, Point};
use rayon::prelude::*;

use crate::gallery::stopped;
use crate::{Plan, RemapError, Stage};

use super::{Components, Coordinate, LabPictures, Loadings, Stratum};

/// Materials that are rendered at once.
const BATCH: usize = 60;
/// Pictures that components are made from, at most.
const SAMPLES: usize = 96;
/// Both lights.
const LIGHTS: usize = 2;
/// Components of the pictures that are shown.
const SHOWN: [usize; 3] = [10, 5, 2];

/// How far pictures are from rendered ones, as means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PictureError {
    /// NRMSD of complete pictures under the point light and under the environment: the root mean square over all channels of the
    /// subject's pixels, over the range of the rendered picture there.
    pub nrmsd: [f64; LIGHTS],
    /// The specular part of Eq. 3.
    pub fitness: f64,
}

/// What some number of components are good for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SynthesisQuality {
    /// That number, for each kind of picture.
    pub components: usize,
    /// Pictures of the half lattice as sums of components.
    pub kept: PictureError,
    /// Pictures of the other points, by interpolated loadings.
    pub synthesised: PictureError,
    /// Share of the sources whose best target by synthesised pictures is that by rendered ones.
    pub same_target: f64,
    /// How much higher the fitness of the target is that synthesised pictures choose, as a share of the lowest; a mean over sources.
    pub excess: f64,
}

/// A rendered picture beside synthesised ones: linear RGB, the subject on black.
#[derive(Clone, Debug, PartialEq)]
pub struct SynthesisExample {
    /// What is shown.
    pub target: Material,
    /// Rendered under the environment.
    pub rendered: Image,
    /// With so many components.
    pub synthesised: Vec<(usize, Image)>,
}

/// What a study of a plan's targets found.
#[derive(Clone, Debug, PartialEq)]
pub struct SynthesisStudy {
    /// Targets of the half lattice.
    pub rendered: usize,
    /// Targets between them.
    pub between: usize,
    /// From one component on.
    pub qualities: Vec<SynthesisQuality>,
    /// What the best targets leave of their sources.
    pub best: PictureError,
    /// The target that ten components show worst under the environment.
    pub example: SynthesisExample,
}

/// Compares pictures synthesised with 1 to `most` components (at most 96) with rendered ones, and which targets either finds for some
/// source points. Axes of two levels are held at their last. `observe` is told of targets that are done, twice for those of the half lattice.
///
/// # Errors
/// Values that make no material; a stop.
pub fn study_synthesis(
    plan: &Plan,
    stage: &Stage,
    sources: &[Vec<f64>],
    most: usize,
    observe: &dyn Fn(usize),
    stop: &dyn Fn() -> bool,
) -> Result<SynthesisStudy, RemapError> {
    let sources: Vec<Material> =
        sources.iter().map(|values| plan.source_material(values)).collect::<Result<_, _>>()?;
    let no_source = || RemapError::Option("a study needs a source point".into());
    let study = Study { plan, stage, source: sources.first().ok_or_else(no_source)?, stop };
    let lattice = Lattice { axes: plan.target_axes.clone() };
    let (half, all) = (points(&lattice, 2), points(&lattice, 1));
    let mut basis = study.basis(&lattice, &half, most)?;
    let kept = study.learn(&mut basis, &lattice, &half, most, observe)?;
    let sought = Sought::new(&basis, study.views(&sources)?);
    let mut tally = Tally::new(most, sources.len());
    for batch in all.chunks(BATCH) {
        let views = study.views(&study.targets(&lattice, batch)?)?;
        let foreseen = basis.foreseen(batch);
        tally.add(&basis, &sought, &half, batch, &views, &foreseen);
        observe(batch.len());
    }
    let best = study.best(&lattice, &sought, &tally)?;
    let example = study.example(&basis, &lattice, &tally)?;
    let qualities = (1..=most).map(|k| tally.quality(k, &kept[k - 1])).collect();
    Ok(SynthesisStudy { rendered: half.len(), between: all.len() - half.len(), qualities, best, example })
}

/// Every `step`-th level of each axis, and its last.
fn points(lattice: &Lattice, step: usize) -> Vec<Point> {
    let mut bounds = Bounds::full(lattice);
    bounds.low.iter_mut().zip(&lattice.axes).filter(|(_, axis)| axis.len() <= 2).for_each(|(low, axis)| {
        *low = axis.len() as u32 - 1;
    });
    let is_taken = |point: &Point| {
        let axes = point.iter().zip(&bounds.high);
        axes.clone().all(|(index, high)| (*index as usize).is_multiple_of(step) || index == high)
    };
    lattice.points(&bounds).filter(is_taken).collect()
}

/// What is looked at.
struct Study<'a> {
    plan: &'a Plan,
    stage: &'a Stage,
    /// What targets take their bodies from.
    source: &'a Material,
    stop: &'a dyn Fn() -> bool,
}

/// A material as it is rendered.
struct View {
    /// Complete pictures by light, linear: all of red, of green, of blue.
    linear: [Vec<f32>; LIGHTS],
    /// In CIELAB, weighted: specular and diffuse ones by light.
    lab: LabPictures,
}

impl View {
    /// Kinds of pictures that are decomposed: linear ones by light, specular ones in CIELAB by light.
    fn kind(&self, kind: usize) -> &[f32] {
        if kind < LIGHTS { &self.linear[kind] } else { &self.lab[kind - LIGHTS] }
    }
}

/// Kinds of pictures that are decomposed.
const KINDS: usize = 2 * LIGHTS;

impl Study<'_> {
    fn targets(&self, lattice: &Lattice, points: &[Point]) -> Result<Vec<Material>, RemapError> {
        points.iter().map(|point| self.plan.target_material(self.source, &lattice.values(point))).collect()
    }

    fn views(&self, materials: &[Material]) -> Result<Vec<View>, RemapError> {
        if (self.stop)() {
            return Err(stopped());
        }
        let view = |planes: [[Planes; 2]; 2]| {
            let complete = |light: usize| -> Vec<f32> {
                let (specular, diffuse) = (planes[0][light].iter(), planes[1][light].iter());
                specular.flatten().zip(diffuse.flatten()).map(|(a, b)| a + b).collect()
            };
            let linear = [complete(0), complete(1)];
            View { linear, lab: self.stage.mixed_pictures([&planes, &planes], 0.0) }
        };
        Ok(self.stage.linear_planes(materials).into_par_iter().map(view).collect())
    }

    /// Components of pictures spread over the half lattice.
    fn basis(&self, lattice: &Lattice, half: &[Point], most: usize) -> Result<Basis, RemapError> {
        let stride = half.len().div_ceil(SAMPLES).max(1);
        let sampled: Vec<Point> = half.iter().step_by(stride).cloned().collect();
        let views = self.views(&self.targets(lattice, &sampled)?)?;
        let components = |kind: usize| {
            let samples: Vec<&[f32]> = views.iter().map(|view| view.kind(kind)).collect();
            Components::of(&samples, 0.0).first(most)
        };
        let model = self.plan.to.model();
        Ok(Basis {
            components: (0..KINDS).into_par_iter().map(components).collect(),
            axes: lattice.axes.iter().map(|axis| Coordinate::of(model, axis)).collect(),
            shares: self.stage.picture_shares(),
            strata: [Stratum::default(), Stratum::default()],
        })
    }

    /// Loadings of the half lattice, and what each number of components leaves of its pictures.
    fn learn(
        &self,
        basis: &mut Basis,
        lattice: &Lattice,
        half: &[Point],
        most: usize,
        observe: &dyn Fn(usize),
    ) -> Result<Vec<PictureError>, RemapError> {
        let mut errors = vec![PictureError::default(); most];
        for batch in half.chunks(BATCH) {
            let views = self.views(&self.targets(lattice, batch)?)?;
            let loadings: Vec<[Loadings; KINDS]> =
                views.par_iter().map(|view| basis.loadings(view)).collect();
            for ((point, view), loadings) in batch.iter().zip(&views).zip(loadings) {
                for (k, sum) in errors.iter_mut().enumerate() {
                    let left = loadings.each_ref().map(|l| tail(l, k + 1).sqrt());
                    add(sum, &basis.error(view, &left), 1.0 / half.len() as f64);
                }
                basis.add(point, loadings);
            }
            observe(batch.len());
        }
        basis.strata.iter_mut().enumerate().for_each(|(k, stratum)| {
            let lengths: Vec<usize> =
                basis.components[k * LIGHTS..][..LIGHTS].iter().map(Components::len).collect();
            stratum.is_stale = true;
            stratum.prepare(&lengths);
        });
        Ok(errors)
    }

    /// What the best targets leave.
    fn best(&self, lattice: &Lattice, sought: &Sought, tally: &Tally) -> Result<PictureError, RemapError> {
        let mut sum = PictureError::default();
        let count = tally.lowest.len() as f64;
        for (k, (fitness, point)) in tally.lowest.iter().enumerate() {
            let target = self.views(&self.targets(lattice, std::slice::from_ref(point))?)?;
            let nrmsd = [0, 1].map(|light| {
                let (a, b) = (&sought.views[k].linear[light], &target[0].linear[light]);
                let squared: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
                (squared / a.len() as f64).sqrt() / range(a)
            });
            add(&mut sum, &PictureError { nrmsd, fitness: *fitness }, 1.0 / count);
        }
        Ok(sum)
    }

    fn example(
        &self,
        basis: &Basis,
        lattice: &Lattice,
        tally: &Tally,
    ) -> Result<SynthesisExample, RemapError> {
        let worst = tally.worst.1.clone();
        let target = self.targets(lattice, std::slice::from_ref(&worst))?.swap_remove(0);
        let view = self.views(std::slice::from_ref(&target))?.swap_remove(0);
        let foreseen = basis.foreseen(&[worst]).swap_remove(0);
        let shown = |k: usize| {
            let values = &foreseen[1];
            (k, self.image(&basis.components[1].picture(&values[..k.min(values.len())])))
        };
        Ok(SynthesisExample {
            target,
            rendered: self.image(&view.linear[1]),
            synthesised: SHOWN.map(shown).into(),
        })
    }

    /// The subject's pixels, on black.
    fn image(&self, planes: &[f32]) -> Image {
        let view = self.stage.views()[1];
        let mut image = Image::new(view.size(), view.size());
        let count = view.subjects().len();
        for (k, pixel) in view.subjects().iter().enumerate() {
            image.pixels_mut()[*pixel as usize] = std::array::from_fn(|c| planes[c * count + k]);
        }
        image
    }
}

/// Components of all kinds of pictures, and their loadings over the parameters.
struct Basis {
    components: Vec<Components>,
    axes: Vec<Coordinate>,
    /// Of specular and diffuse pictures by light, in fitness.
    shares: Vec<f64>,
    /// Of linear pictures and of those in CIELAB.
    strata: [Stratum; 2],
}

impl Basis {
    fn loadings(&self, view: &View) -> [Loadings; KINDS] {
        std::array::from_fn(|kind| self.components[kind].loadings(view.kind(kind)))
    }

    fn place(&self, point: &Point) -> Vec<f64> {
        let axes = self.axes.iter().zip(point).filter(|(axis, _)| !axis.is_switch);
        axes.map(|(axis, index)| axis.values[*index as usize]).collect()
    }

    fn add(&mut self, point: &Point, loadings: [Loadings; KINDS]) {
        let place = self.place(point);
        let values = loadings.map(|l| l.values);
        for (stratum, values) in self.strata.iter_mut().zip(values.chunks(LIGHTS)) {
            stratum.points.push(place.clone());
            stratum.loadings.push(values.to_vec());
        }
    }

    /// Interpolated loadings of all kinds.
    fn foreseen(&self, points: &[Point]) -> Vec<[Vec<f64>; KINDS]> {
        let places: Vec<Vec<f64>> = points.iter().map(|point| self.place(point)).collect();
        let [linear, lab] = self.strata.each_ref().map(|stratum| stratum.loadings_at(&places));
        let split = |joined: &[f64], first: usize, light: usize| {
            let from = if light == 0 { 0 } else { self.components[first].len() };
            joined[from..][..self.components[first + light].len()].to_vec()
        };
        let of = |(linear, lab): (&Vec<f64>, &Vec<f64>)| {
            [split(linear, 0, 0), split(linear, 0, 1), split(lab, LIGHTS, 0), split(lab, LIGHTS, 1)]
        };
        linear.iter().zip(&lab).map(of).collect()
    }

    /// Errors of a view's pictures, given how long the differences are.
    fn error(&self, view: &View, lengths: &[f64; KINDS]) -> PictureError {
        let nrmsd = |light: usize| {
            let picture = &view.linear[light];
            lengths[light] / (picture.len() as f64).sqrt() / range(picture)
        };
        let fitness = (0..LIGHTS).map(|light| self.shares[light] * lengths[LIGHTS + light]).sum();
        PictureError { nrmsd: [nrmsd(0), nrmsd(1)], fitness }
    }
}

/// Squared length of what the first components leave of a picture.
fn tail(loadings: &Loadings, components: usize) -> f64 {
    loadings.values.iter().skip(components).map(|v| v * v).sum::<f64>() + loadings.rest
}

/// Squared distance of a picture and a synthesised one of the first components.
fn squared(loadings: &Loadings, foreseen: &[f64], components: usize) -> f64 {
    let first = loadings.values.iter().zip(foreseen).take(components);
    first.map(|(a, b)| (a - b) * (a - b)).sum::<f64>() + tail(loadings, components)
}

fn range(picture: &[f32]) -> f64 {
    let (low, high) =
        picture.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    f64::from(high - low).max(f64::MIN_POSITIVE)
}

fn add(sum: &mut PictureError, other: &PictureError, share: f64) {
    sum.nrmsd.iter_mut().zip(other.nrmsd).for_each(|(sum, v)| *sum += share * v);
    sum.fitness += share * other.fitness;
}

/// The sources.
struct Sought {
    views: Vec<View>,
    /// In CIELAB, by light.
    loadings: Vec<[Loadings; KINDS]>,
    /// Their pictures in CIELAB, kind by kind.
    columns: Vec<Columns>,
}

impl Sought {
    fn new(basis: &Basis, views: Vec<View>) -> Self {
        let columns = |kind: usize| {
            let pictures: Vec<&[f32]> = views.iter().map(|view| &*view.lab[kind]).collect();
            Columns::new(pictures.first().map_or(0, |picture| picture.len()), &pictures)
        };
        let columns = (0..2 * LIGHTS).map(columns).collect();
        let loadings = views.iter().map(|view| basis.loadings(view)).collect();
        Self { views, loadings, columns }
    }

    /// Fitness of targets, for each of them to each source: the specular part and the diffuse one.
    fn fitness(&self, shares: &[f64], targets: &[View]) -> Vec<Vec<[f64; 2]>> {
        let of = |target: &View| {
            let mut sums = vec![[0.0; 2]; self.views.len()];
            for (kind, (columns, share)) in self.columns.iter().zip(shares).enumerate() {
                let distances = columns.squared_distances(&[&target.lab[kind]]);
                let parts = sums.iter_mut().zip(distances);
                parts.for_each(|(sum, squared)| sum[kind / LIGHTS] += share * squared.max(0.0).sqrt());
            }
            sums
        };
        targets.par_iter().map(of).collect()
    }
}

/// What is summed up over all targets.
struct Tally {
    most: usize,
    between: usize,
    synthesised: Vec<PictureError>,
    /// Lowest rendered fitness of each source, and where.
    lowest: Vec<(f64, Point)>,
    /// Lowest synthesised fitness for each number of components and source, the rendered fitness there, and where.
    chosen: Vec<Vec<(f64, f64, Point)>>,
    /// NRMSD under the environment of the picture that is shown, and which it is.
    worst: (f64, Point),
}

impl Tally {
    fn new(most: usize, sources: usize) -> Self {
        let none = (f64::INFINITY, f64::INFINITY, Point::new());
        Self {
            most,
            between: 0,
            synthesised: vec![PictureError::default(); most],
            lowest: vec![(f64::INFINITY, Point::new()); sources],
            chosen: vec![vec![none; sources]; most],
            worst: (f64::NEG_INFINITY, Point::new()),
        }
    }

    /// Targets with their pictures and what was foreseen of these.
    fn add(
        &mut self,
        basis: &Basis,
        sought: &Sought,
        half: &[Point],
        points: &[Point],
        views: &[View],
        foreseen: &[[Vec<f64>; KINDS]],
    ) {
        let loadings: Vec<[Loadings; KINDS]> = views.par_iter().map(|view| basis.loadings(view)).collect();
        let fitness = sought.fitness(&basis.shares, views);
        for (k, point) in points.iter().enumerate() {
            if half.binary_search(point).is_err() {
                self.compare(basis, point, &views[k], &loadings[k], &foreseen[k]);
            }
            for (source, [specular, diffuse]) in fitness[k].iter().enumerate() {
                let rendered = specular + diffuse;
                if rendered < self.lowest[source].0 {
                    self.lowest[source] = (rendered, point.clone());
                }
                for components in 1..=self.most {
                    let lengths = [0, 1].map(|light| {
                        let kind = LIGHTS + light;
                        let seen = &sought.loadings[source][kind];
                        basis.shares[light] * squared(seen, &foreseen[k][kind], components).sqrt()
                    });
                    let forecast = lengths[0] + lengths[1] + diffuse;
                    let chosen = &mut self.chosen[components - 1][source];
                    if forecast < chosen.0 {
                        *chosen = (forecast, rendered, point.clone());
                    }
                }
            }
        }
    }

    /// A rendered target beside what was foreseen of it.
    fn compare(
        &mut self,
        basis: &Basis,
        point: &Point,
        view: &View,
        loadings: &[Loadings; KINDS],
        foreseen: &[Vec<f64>; KINDS],
    ) {
        self.between += 1;
        for (k, sum) in self.synthesised.iter_mut().enumerate() {
            let lengths: [f64; KINDS] =
                std::array::from_fn(|kind| squared(&loadings[kind], &foreseen[kind], k + 1).sqrt());
            let error = basis.error(view, &lengths);
            add(sum, &error, 1.0);
            if k + 1 == SHOWN[0].min(self.most) && error.nrmsd[1] > self.worst.0 {
                self.worst = (error.nrmsd[1], point.clone());
            }
        }
    }

    fn quality(&self, components: usize, kept: &PictureError) -> SynthesisQuality {
        let mut synthesised = PictureError::default();
        add(&mut synthesised, &self.synthesised[components - 1], 1.0 / self.between.max(1) as f64);
        let pairs = || self.lowest.iter().zip(&self.chosen[components - 1]);
        let count = self.lowest.len() as f64;
        let same = pairs().filter(|((_, a), (_, _, b))| a == b).count() as f64 / count;
        let excess = pairs().map(|((lowest, _), (_, found, _))| found / lowest - 1.0).sum::<f64>() / count;
        SynthesisQuality { components, kept: *kept, synthesised, same_target: same, excess }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Options;
    use lookmatch_materials::by_name;

    fn studied(stop: bool) -> Result<SynthesisStudy, RemapError> {
        let options = Options { size: Some(32), ..Options::default() };
        let plan = Plan::new(by_name("as").unwrap(), by_name("ggx-conductor").unwrap(), &options).unwrap();
        let stage = Stage::prepare(&plan).unwrap();
        study_synthesis(&plan, &stage, &[vec![0.1], vec![0.3], vec![0.5]], 12, &|_| (), &|| stop)
    }

    #[test]
    fn more_components_leave_less_and_find_the_same() {
        let study = studied(false).unwrap();
        assert!(study.rendered > 20 && study.between > 20, "{} {}", study.rendered, study.between);
        for pair in study.qualities.windows(2) {
            assert!(pair[1].kept.fitness <= pair[0].kept.fitness, "{pair:?}");
            assert!(pair[1].kept.nrmsd[0] <= pair[0].kept.nrmsd[0], "{pair:?}");
        }
        let (one, many) = (&study.qualities[0], &study.qualities[11]);
        assert!(many.synthesised.fitness < 0.1 * one.synthesised.fitness, "{study:?}");
        assert!(many.synthesised.fitness < study.best.fitness && many.synthesised.fitness > 0.0);
        assert!((many.same_target, many.excess) == (1.0, 0.0) && one.excess > 0.0, "{:?}", study.qualities);
        let distance = |image: &Image| -> f64 {
            let pixels =
                image.pixels().as_flattened().iter().zip(study.example.rendered.pixels().as_flattened());
            pixels.map(|(a, b)| f64::from(a - b).powi(2)).sum()
        };
        let [ten, five, two] = [0, 1, 2].map(|k| distance(&study.example.synthesised[k].1));
        assert!(0.0 < ten && ten < five && five < two, "{ten} {five} {two}");
    }

    #[test]
    fn a_stop_ends_it() {
        assert!(studied(true).is_err());
    }
}
