//! Equilibria to which a rod falls: the chain at rest ([`Chain`]) as the guess, collocated from both ends.

use super::interval::{RodUnderForce, Section};
use super::{Shape, Solved, Spring, Tip};
use crate::error::Result;
use crate::math::se3::join;
use crate::rod::descent::Chain;
use crate::rod::equilibrium::{Equilibrium, Route};
use crate::rod::{Path, Problem};
use nalgebra::Vector3;
use std::sync::Arc;

/// Largest turn of the sections in an interval of the first mesh, in radians, and its longest interval.
const TURN: f64 = 0.8;
const LONGEST: f64 = 0.2;

impl Chain {
    /// The chain as the guess of frames and couples of a rod. The mesh is fine where sections turn, and at the places
    /// `layers` of the layers at both ends.
    fn shape(&self, layers: Vec<f64>, tolerance: f64) -> Shape {
        let mut places = layers;
        let lengths = places.windows(2).map(|pair| pair[1] - pair[0]);
        let shortest = lengths.fold(LONGEST, f64::min);
        for place in self.mesh(TURN, LONGEST) {
            let after = places.partition_point(|other| *other < place);
            let is_near =
                |k: usize| (places.get(k)).is_some_and(|other| (other - place).abs() < shortest);
            if !(is_near(after) || (after > 0 && is_near(after - 1))) {
                places.insert(after, place);
            }
        }
        let section = |s: f64| {
            let (turn, m) = self.section(s);
            Section { turn, m }
        };
        Shape::from_sections(places, self.base_force, tolerance, section)
    }
}

impl RodUnderForce<'_> {
    /// The shape to which a heavy rod falls from its unloaded shape, with its end free to move under the force there.
    /// `None` for a rod without a load along it, for a loaded tip, and if the fall does not end.
    pub(super) fn resting_shape(&self, tip: &Tip, tolerance: f64) -> Option<Shape> {
        let turned = match tip {
            Tip::Turned(directors) => Some(*directors),
            Tip::Loaded { couple, .. } if *couple == Vector3::zeros() => None,
            Tip::Loaded { .. } => return None,
        };
        let chain = Chain::at_rest_under(self.law, self.weight?, self.force(1.0), turned)?;
        let layers = self.layered_places(tolerance, LONGEST).ok()?;
        Some(chain.shape(layers, tolerance))
    }
}

impl Problem {
    /// The stable equilibrium that the rod falls to from its unloaded shape; `None` for loads without a potential and
    /// if the fall does not end.
    pub(in crate::rod) fn solve_by_descent(&self) -> Option<Result<Equilibrium>> {
        if !matches!(self.path, Path::Auto | Path::Spatial) {
            return None;
        }
        let chain = self.descended()?;
        let there = self.rod_under_force(chain.base_force);
        let layers = there.layered_places(self.tolerance, LONGEST).ok()?;
        let shape = chain.shape(layers, self.tolerance);
        Some(self.at_rest(shape))
    }

    fn at_rest(&self, shape: Shape) -> Result<Equilibrium> {
        let (held, tip) = (self.is_held(), self.tip());
        let mut route = Route {
            imperfect: true,
            ..Route::start()
        };
        let place: Vector3<f64> = (0..3)
            .filter(|i| held[*i])
            .map(|i| self.axes[i] * self.targets[i])
            .sum();
        let there = RodUnderForce {
            symmetry: self.symmetry(&join(&shape.nodes[0].m, &shape.n), None),
            ..self.rod_under_force(shape.n)
        };
        let (found, spring) = match held {
            [true, true, true] => there.rest(shape, &tip, place, self.tolerance)?,
            [false, false, false] => (
                there.refine_until_accurate(shape, &tip, &Spring::NONE, self.tolerance)?,
                Spring::NONE,
            ),
            _ => {
                let m = shape.nodes[0].m;
                return self.find_force(&m, shape.n, Some(shape), false, None);
            }
        };
        route.iterations = found.iterations;
        self.remember(&found);
        let off = if held[0] {
            (found.position - place).norm()
        } else {
            0.0
        };
        self.told(&found, &spring, off, route, None)
    }

    /// Keeps an equilibrium: the base wrench then leads to the sections.
    pub(in crate::rod) fn remember(&self, found: &Solved) {
        self.at_rest.keep(&Arc::new(found.clone()));
    }
}
