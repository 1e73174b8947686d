//! Where a noisy search ends: at the bottom of a bowl that is fitted to many candidates.
//!
//! One candidate's score says little where noise is larger than what a step of the lattice changes. But the scores near
//! the best form a bowl, and all of them together tell where its bottom is: a quadratic in the parameters, fitted by least squares
//! (the response surface of Box and Wilson 1951). Its own standard error says whether more samples are needed.

use std::cmp::Ordering;

use lookmatch_search::{Bounds, Lattice, Point, spread};
use nalgebra::{DMatrix, DVector};

/// Levels to each side of the best that belong to the bowl at first, and in the end.
const REACH: [u32; 2] = [12, 6];
/// Candidates per coefficient of the fit.
const CANDIDATES: usize = 3;
/// The bottom is known when its standard error is less than this many levels.
const KNOWN: f64 = 0.3;
/// Lattice points of a bowl that are looked at one by one; of larger ones, only its candidates.
const LOOKED_AT: u64 = 20_000;

/// The part of the lattice around a point.
pub(crate) struct Bowl<'a> {
    lattice: &'a Lattice,
    centre: Point,
    /// Itself.
    bounds: Bounds,
    /// What lies around it.
    within: Bounds,
    /// Axes along which it has a shape: not those of switches.
    axes: Vec<usize>,
    /// Axes of the lattice on which equal ratios look equally different: the widths of lobes. In their logarithms the bowl has
    /// sides that are alike.
    ratios: &'a [bool],
    /// True where it is as narrow as it gets: the bottom of a wider one, whose sides are not alike, is off to the flatter side.
    is_narrow: bool,
}

/// The bottom of a bowl.
pub(crate) struct Bottom {
    pub(crate) point: Point,
    pub(crate) is_known: bool,
    /// True where it lies on a side of the bowl, and may be deeper behind it.
    pub(crate) is_on_side: bool,
}

impl<'a> Bowl<'a> {
    /// The bowl around a point, within bounds, in the given round of narrowing.
    pub(crate) fn around(
        (lattice, ratios): (&'a Lattice, &'a [bool]),
        centre: &Point,
        within: &Bounds,
        round: u32,
    ) -> Self {
        let reach = (REACH[0] >> round).max(REACH[1]);
        let is_free = |axis: &usize| lattice.axes[*axis].len() > 2 && within.low[*axis] < within.high[*axis];
        let axes: Vec<usize> = (0..centre.len()).filter(is_free).collect();
        let mut bounds = Bounds { low: centre.clone(), high: centre.clone() };
        for axis in &axes {
            bounds.low[*axis] = within.low[*axis].max(centre[*axis].saturating_sub(reach));
            bounds.high[*axis] = within.high[*axis].min(centre[*axis] + reach);
        }
        Self {
            lattice,
            centre: centre.clone(),
            bounds,
            within: within.clone(),
            axes,
            ratios,
            is_narrow: reach == REACH[1],
        }
    }

    /// The candidates to look at, spread evenly over the bowl: known ones where they lie within a level of where one is wanted.
    pub(crate) fn candidates<'p>(&self, known: impl Iterator<Item = &'p Point>) -> Vec<Point> {
        let wanted = CANDIDATES * self.coefficients();
        let mut known: Vec<Point> = known.filter(|point| self.contains(point)).cloned().collect();
        known.sort_unstable();
        let mut points = vec![self.centre.clone()];
        for k in 1..8 * wanted as u32 {
            if points.len() >= wanted {
                break;
            }
            let point = spread(&self.bounds, k);
            let near = known.iter().filter(|other| distance(other, &point) <= 1 && !points.contains(other));
            let point = near.min_by_key(|other| distance(other, &point)).unwrap_or(&point).clone();
            if !points.contains(&point) {
                points.push(point);
            }
        }
        points
    }

    /// Where a quadratic through the scores of candidates is least.
    pub(crate) fn bottom(&self, candidates: &[(Point, f64)]) -> Bottom {
        let rows: Vec<Vec<f64>> = candidates.iter().map(|(point, _)| self.terms(point)).collect();
        let design = DMatrix::from_fn(rows.len(), self.coefficients(), |r, c| rows[r][c]);
        let scores = DVector::from_iterator(candidates.len(), candidates.iter().map(|(_, score)| *score));
        let best = || {
            let least = candidates.iter().min_by(|a, b| a.1.total_cmp(&b.1).then_with(|| a.0.cmp(&b.0)));
            least.map_or_else(|| self.centre.clone(), |(point, _)| point.clone())
        };
        let freedom = candidates.len().saturating_sub(self.coefficients());
        let inverse = (design.transpose() * &design).try_inverse().filter(|_| freedom > 0);
        let Some(inverse) = inverse else {
            return Bottom { point: best(), is_known: false, is_on_side: false };
        };
        let fit = &inverse * design.transpose() * &scores;
        let residual = (&scores - &design * &fit).norm_squared() / freedom as f64;
        // Along its own axis the bottom of a x² + b x lies at −b/2a, and is as uncertain as b.
        let error = |k: usize| {
            let (slope, curve) = (1 + k, 1 + self.axes.len() + k);
            let error = (residual * inverse[(slope, slope)]).sqrt();
            let bottom = error / (2.0 * fit[curve] * self.level(self.axes[k]));
            if fit[curve] > 0.0 { bottom } else { f64::INFINITY }
        };
        // Along an axis that shows nothing, what the search found is as good as anything.
        let is_told = |k: usize| error(k) * self.level(self.axes[k]) < 1.0;
        let untold: Vec<usize> =
            (0..self.axes.len()).filter(|k| !is_told(*k)).map(|k| self.axes[k]).collect();
        let stays = |point: &Point| untold.iter().all(|axis| point[*axis] == self.centre[*axis]);
        let value = |point: &Point| self.terms(point).iter().zip(fit.iter()).map(|(t, c)| t * c).sum::<f64>();
        let least = self.points(candidates).into_iter().filter(stays).min_by(|a, b| {
            let order = value(a).total_cmp(&value(b));
            order.then_with(|| a.cmp(b))
        });
        let point = least.unwrap_or_else(best);
        let is_on_side = self.is_on_side(&point);
        let is_known =
            self.is_narrow && !is_on_side && self.largest_error(&fit, &(inverse * residual)) < KNOWN;
        Bottom { point, is_known, is_on_side }
    }

    /// The standard error of the bottom in levels, along the axis where it is largest, from the coefficients and their covariance.
    ///
    /// The bottom of b·x + xᵀH x/2 lies at −H⁻¹b; its covariance is H⁻¹ Cov(b) H⁻¹. So a valley across the axes, a rougher lobe that is
    /// as much brighter, is as long as it is, however steep its sides.
    fn largest_error(&self, fit: &DVector<f64>, covariance: &DMatrix<f64>) -> f64 {
        let count = self.axes.len();
        let product = |i: usize, j: usize| fit[1 + 2 * count + i * (i - 1) / 2 + j];
        let curvature = DMatrix::from_fn(count, count, |i, j| match i.cmp(&j) {
            Ordering::Equal => 2.0 * fit[1 + count + i],
            Ordering::Greater => product(i, j),
            Ordering::Less => product(j, i),
        });
        let Some(solved) = curvature.cholesky() else { return f64::INFINITY };
        let slopes = covariance.view((1, 1), (count, count)).into_owned();
        let across = solved.solve(&slopes).transpose();
        let places = solved.solve(&across);
        let levels = (0..count).map(|k| places[(k, k)].sqrt() / self.level(self.axes[k]));
        levels.fold(0.0, f64::max)
    }

    /// 1, x, x², and products.
    fn terms(&self, point: &Point) -> Vec<f64> {
        let x: Vec<f64> = self.axes.iter().map(|axis| self.coordinate(*axis, point[*axis])).collect();
        let mut terms = vec![1.0];
        terms.extend(&x);
        terms.extend(x.iter().map(|x| x * x));
        terms.extend((0..x.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| x[i] * x[j]));
        terms
    }

    /// Where an index lies along an axis: 0 in the middle of the bowl, 1 on its farther side.
    fn coordinate(&self, axis: usize, index: u32) -> f64 {
        let sides = [self.bounds.low[axis], self.bounds.high[axis]].map(|side| self.offset(axis, side).abs());
        self.offset(axis, index) / sides[0].max(sides[1])
    }

    fn offset(&self, axis: usize, index: u32) -> f64 {
        let level = |index: u32| self.lattice.axes[axis].value(index as usize);
        let [here, centre] = [index, self.centre[axis]].map(level);
        if self.ratios[axis] && here > 0.0 && centre > 0.0 {
            return (here / centre).ln();
        }
        f64::from(index) - f64::from(self.centre[axis])
    }

    /// How far one level next to the middle goes along an axis.
    fn level(&self, axis: usize) -> f64 {
        let centre = self.centre[axis];
        let next = if centre < self.bounds.high[axis] { centre + 1 } else { centre.saturating_sub(1) };
        self.coordinate(axis, next).abs()
    }

    fn coefficients(&self) -> usize {
        let axes = self.axes.len();
        1 + 2 * axes + axes * axes.saturating_sub(1) / 2
    }

    fn contains(&self, point: &Point) -> bool {
        (0..point.len()).all(|axis| (self.bounds.low[axis]..=self.bounds.high[axis]).contains(&point[axis]))
    }

    /// True where a point lies on a side of the bowl, and the lattice goes on behind it.
    fn is_on_side(&self, point: &Point) -> bool {
        self.axes.iter().any(|axis| {
            let (low, high, index) = (self.bounds.low[*axis], self.bounds.high[*axis], point[*axis]);
            index == low && low > self.within.low[*axis] || index == high && high < self.within.high[*axis]
        })
    }

    fn points(&self, candidates: &[(Point, f64)]) -> Vec<Point> {
        let count = |axis: &usize| u64::from(self.bounds.high[*axis] - self.bounds.low[*axis] + 1);
        if self.axes.iter().map(count).product::<u64>() > LOOKED_AT {
            return candidates.iter().map(|(point, _)| point.clone()).collect();
        }
        self.lattice.points(&self.bounds).collect()
    }
}

/// Levels between two points along the axis where they are farthest apart.
fn distance(a: &Point, b: &Point) -> u32 {
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookmatch_search::Axis;

    fn lattice() -> Lattice {
        let axis = |name: &str, max| Axis::regular(name, 0.0, max, 1.0).unwrap();
        Lattice { axes: vec![axis("switch", 1.0), axis("a", 60.0), axis("b", 60.0)] }
    }

    /// A tilted bowl with noise, a hundred times what a step changes at its bottom.
    fn score(point: &Point, noise: f64) -> f64 {
        let [a, b] = [f64::from(point[1]) - 31.0, f64::from(point[2]) - 22.0];
        let random = (point[1] * 7919 + point[2] * 104_729 + 13) % 1009;
        0.01 * (a * a + a * b + 2.0 * b * b) + noise * (f64::from(random) / 1009.0 - 0.5)
    }

    fn found(noise: f64, round: u32) -> Bottom {
        let lattice = lattice();
        let whole = Bounds::full(&lattice);
        let bowl = Bowl::around((&lattice, &[false; 3]), &vec![1, 27, 26], &whole, round);
        let candidates = bowl.candidates(std::iter::empty());
        assert_eq!(candidates.len(), 18);
        let reach = if round == 0 { 12 } else { 6 };
        assert!(
            candidates.iter().all(|p| p[0] == 1 && p[1].abs_diff(27) <= reach && p[2].abs_diff(26) <= reach)
        );
        let scored: Vec<(Point, f64)> =
            candidates.into_iter().map(|p| (p.clone(), score(&p, noise))).collect();
        bowl.bottom(&scored)
    }

    #[test]
    fn the_bottom_is_found_through_noise() {
        let [wide, narrow] = [found(0.0, 0), found(0.0, 1)];
        assert_eq!((wide.point, wide.is_known), (vec![1, 31, 22], false));
        assert_eq!((narrow.point, narrow.is_known), (vec![1, 31, 22], true));
        let noisy = found(1.0, 0);
        let off = noisy.point.iter().zip([1, 31, 22]).map(|(a, b)| a.abs_diff(b)).max().unwrap();
        assert!(off <= 2 && !noisy.is_known, "{:?}", noisy.point);
        assert!(!found(100.0, 1).is_known);
    }

    #[test]
    fn a_valley_across_the_axes_is_as_long_as_it_is() {
        let lattice = lattice();
        let bowl = Bowl::around((&lattice, &[false; 3]), &vec![1, 30, 30], &Bounds::full(&lattice), 1);
        let bottom = |length: f64| {
            let valley = |p: &Point| {
                let [a, b] = [f64::from(p[1]) - 30.0, f64::from(p[2]) - 30.0];
                let noise = f64::from((p[1] * 7919 + p[2] * 104_729 + 13) % 1009) / 1009.0 - 0.5;
                (a - b).powi(2) + (a + b).powi(2) / length.powi(2) + noise
            };
            let scored: Vec<(Point, f64)> =
                bowl.candidates(std::iter::empty()).into_iter().map(|p| (p.clone(), valley(&p))).collect();
            bowl.bottom(&scored)
        };
        assert!(bottom(1.0).is_known && !bottom(30.0).is_known);
    }

    #[test]
    fn known_points_stand_in_for_their_neighbours() {
        let lattice = lattice();
        let bowl = Bowl::around((&lattice, &[false; 3]), &vec![1, 5, 5], &Bounds::full(&lattice), 1);
        let wanted = bowl.candidates(std::iter::empty());
        let beside = vec![1, wanted[3][1] + 1, wanted[3][2]];
        let known = [beside.clone(), vec![0, 5, 5], vec![1, 40, 5]];
        let candidates = bowl.candidates(known.iter());
        assert!(candidates.contains(&beside), "it stands in for its neighbour");
        assert!(candidates.iter().all(|p| *p != known[1] && *p != known[2]), "they are not in the bowl");
    }
}
