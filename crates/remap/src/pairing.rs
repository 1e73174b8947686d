//! The constrained strategy (Guarnera *et al.* 2018, 3.4): which target parameters follow which source parameters, and how a
//! source point is led by its neighbours.

use lookmatch_materials::{Material, Role, Trend};
use lookmatch_search::{Axis, Bounds, Lattice, Point, Problem};

use crate::refine::Led;
use crate::{Plan, RemapError, Strategy};

/// Which target axes follow which source axes, by the roles of their parameters.
pub(crate) struct Pairing {
    /// For each source axis, the target axes that follow it, and how.
    targets: Vec<Vec<(usize, Trend)>>,
    /// For each source axis, target axes that switch the lobe on or off.
    switches: Vec<Vec<usize>>,
    /// Levels of the source's axes.
    levels: Vec<Vec<f64>>,
}

impl Pairing {
    pub(crate) fn new(plan: &Plan) -> Result<Self, RemapError> {
        let roles = |material: &Material, axes: &[Axis]| {
            axes.iter()
                .map(|a| material.model().parameter(&a.name).map(|p| p.role))
                .collect::<Result<Vec<Role>, _>>()
        };
        let (from, to) = (roles(&plan.from, &plan.source_axes)?, roles(&plan.to, &plan.target_axes)?);
        let is_switch =
            |k: usize| to[k] == Role::SpecularReflectance && plan.target_axes[k].levels == [0.0, 1.0];
        // Of several source axes with one role, as `roughness_u` and `roughness_v`, each leads the one of its own name alone.
        let is_twin = |role: &Role| from.iter().filter(|other| *other == role).count() > 1;
        let followers = |role: &Role, name: &str| -> Vec<(usize, Trend)> {
            let own = plan.target_axes.iter().position(|axis| is_twin(role) && axis.name == name);
            let places = own.map_or(0..to.len(), |k| k..k + 1);
            places.filter_map(|k| Some((k, role.trend(to[k])?))).collect()
        };
        let chosen = |source: &str| plan.pairs.iter().find(|pair| pair.source == source);
        let split = |switch: bool| -> Vec<Vec<(usize, Trend)>> {
            let of = |(role, axis): (&Role, &Axis)| {
                let followers = match chosen(&axis.name) {
                    Some(pair) => pair.followers(&plan.target_axes, |k| role.trend(to[k])),
                    None => followers(role, &axis.name),
                };
                followers.into_iter().filter(|(k, _)| is_switch(*k) == switch).collect()
            };
            from.iter().zip(&plan.source_axes).map(of).collect()
        };
        let places = |axes: Vec<(usize, Trend)>| axes.into_iter().map(|(k, _)| k).collect();
        Ok(Self {
            targets: split(false),
            switches: split(true).into_iter().map(places).collect(),
            levels: plan.source_axes.iter().map(|a| a.levels.clone()).collect(),
        })
    }

    /// The target axes that follow others, and how; none where each source point is on its own.
    pub(crate) fn trends(&self, strategy: Strategy) -> Vec<(usize, Trend)> {
        let followers = self.targets.iter().flatten().copied();
        if strategy == Strategy::Constrained { followers.collect() } else { Vec::new() }
    }

    /// The target values of the neighbours with one smaller source parameter, along the axes that follow it.
    pub(crate) fn led_values<'f>(
        &self,
        indices: &[u32],
        target: &dyn Fn(&[u32]) -> Option<&'f Vec<f64>>,
    ) -> Led {
        let mut led = Led::new();
        for axis in (0..indices.len()).filter(|axis| indices[*axis] > 0) {
            let mut smaller = indices.to_vec();
            smaller[axis] -= 1;
            let Some(values) = target(&smaller).filter(|values| !values.is_empty()) else { continue };
            led.extend(self.targets[axis].iter().map(|(k, trend)| (*k, *trend, values[*k])));
        }
        led
    }

    /// A source point on its own.
    pub(crate) fn alone<'a>(&self, lattice: &'a Lattice, seed: u64) -> Problem<'a> {
        Problem { lattice, bounds: Bounds::full(lattice), guesses: Vec::new(), seed }
    }

    /// A source point led by its neighbours with one smaller source parameter: target parameters that rise with it may not
    /// be smaller than theirs, those that fall not larger, and the search starts where they ended (Guarnera *et al.* 2018, 3.4).
    pub(crate) fn led<'a, 'f>(
        &self,
        lattice: &'a Lattice,
        seed: u64,
        indices: &[u32],
        result: &dyn Fn(&[u32]) -> Option<&'f Point>,
    ) -> Problem<'a> {
        let mut problem = self.alone(lattice, seed);
        let mut neighbours = Vec::new();
        for axis in 0..indices.len() {
            // "Setting the specular reflectance respectively to null or any non-null positive value" (5.2).
            if self.levels[axis][indices[axis] as usize] > 0.0 {
                self.switches[axis].iter().for_each(|k| problem.bounds.low[*k] = 1);
            }
            let mut smaller = indices.to_vec();
            if indices[axis] == 0 {
                continue;
            }
            smaller[axis] -= 1;
            if let Some(neighbour) = result(&smaller) {
                for (k, trend) in &self.targets[axis] {
                    let Bounds { low, high } = &mut problem.bounds;
                    match trend {
                        Trend::Rising => low[*k] = low[*k].max(neighbour[*k]),
                        Trend::Falling => high[*k] = high[*k].min(neighbour[*k]),
                    }
                }
                neighbours.push((axis, neighbour));
            }
        }
        problem.guesses = guesses(&problem.bounds, indices, &neighbours, result);
        problem
    }
}

/// Starting points: the neighbours, each carried on along its axis by its last step, and all carried on at once.
fn guesses<'f>(
    bounds: &Bounds,
    indices: &[u32],
    neighbours: &[(usize, &Point)],
    result: &dyn Fn(&[u32]) -> Option<&'f Point>,
) -> Vec<Point> {
    let mut guesses: Vec<Point> = Vec::new();
    let mut add = |point: Point| {
        let point = bounds.clamp(&point);
        if !guesses.contains(&point) {
            guesses.push(point);
        }
    };
    // On a plane through the three neighbours a, b and their common neighbour c the next point is a + b − c.
    if let [(first, a), (second, b)] = neighbours {
        let mut common = indices.to_vec();
        common[*first] -= 1;
        common[*second] -= 1;
        if let Some(c) = result(&common) {
            add(combine(a, b, c));
        }
    }
    for (axis, neighbour) in neighbours.iter().rev() {
        let mut before = indices.to_vec();
        before[*axis] = before[*axis].saturating_sub(2);
        if let Some(previous) = result(&before).filter(|_| indices[*axis] >= 2) {
            add(combine(neighbour, neighbour, previous));
        }
        add((*neighbour).clone());
    }
    guesses
}

/// `a + b − c`, no index below 0.
fn combine(a: &Point, b: &Point, c: &Point) -> Point {
    a.iter().zip(b).zip(c).map(|((a, b), c)| (a + b).saturating_sub(*c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Options;
    use lookmatch_materials::by_name;

    #[test]
    fn twins_lead_their_own_kind_alone() {
        let plan = |from: &str, to: &str, twins: bool| {
            let (from, to) = (by_name(from).unwrap(), by_name(to).unwrap());
            let mut plan = Plan::new(from, to, &Options::default()).unwrap();
            let both = |axes: &mut Vec<Axis>| {
                axes.retain(|axis| axis.name != "roughness");
                axes.extend(
                    ["roughness_u", "roughness_v"].map(|name| Axis::regular(name, 0.1, 0.5, 0.1).unwrap()),
                );
            };
            both(&mut plan.target_axes);
            if twins {
                both(&mut plan.source_axes);
            }
            Pairing::new(&plan).unwrap().targets
        };
        let places = |followers: &[(usize, Trend)]| followers.iter().map(|(k, _)| *k).collect::<Vec<_>>();
        // Targets: specular, index, both widths.
        let brushed = plan("ward", "ggx", true);
        assert_eq!([places(&brushed[1]), places(&brushed[2])], [[2], [3]]);
        let tied = plan("ward", "ggx", false);
        assert_eq!(places(&tied[1]), [2, 3], "one width leads both");
        let exponent = plan("phong", "ggx", false);
        assert!(exponent[1].contains(&(2, Trend::Falling)) && exponent[1].contains(&(3, Trend::Falling)));
    }
}
