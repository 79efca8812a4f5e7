//! Equilibria to which a rod falls: the chain at rest ([`Chain`]) as the guess, collocated from both ends.

use super::interval::{FrameAndCouple, RodUnderForce};
use super::{Shape, Solved, Spring, Tip};
use crate::error::Result;
use crate::math::se3::join;
use crate::rod::descent::{Chain, FALLS, Lean};
use crate::rod::equilibrium::{Equilibrium, Route};
use crate::rod::{Path, Plane, Problem};
use crate::solve::warm_start::WarmStart;
use nalgebra::Vector3;
use std::sync::Arc;

/// Largest turn of the sections in an interval of the first mesh, in radians, and its longest interval.
const TURN: f64 = 0.8;
const LONGEST: f64 = 0.2;
/// First and least step of a couple that grows, over the whole couple.
const FIRST_SHARE: f64 = 0.25;
const LEAST_SHARE: f64 = 1.0 / 256.0;

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
            FrameAndCouple { turn, m }
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
    /// The stable equilibrium that the rod falls to from its unloaded shape. A couple on a free end has no potential:
    /// the rod falls without the couple, which then grows. `None` for loads that turn with the rod, and if the fall
    /// does not end.
    pub(in crate::rod) fn solve_by_descent(&self) -> Option<Result<Equilibrium>> {
        let plane = match self.path {
            Path::Auto | Path::Spatial => None,
            Path::Planar => Some(self.plane(None).ok()?),
            Path::ClosedForm => return None,
        };
        if self.is_followed() {
            return None;
        }
        if !self.is_conservative() {
            return self.solve_by_growing_couple(plane);
        }
        let fallen = |lean| self.fallen(lean, plane);
        let first = fallen(FALLS[0]);
        if plane.is_some() || matches!(&first, Some(Ok(found)) if found.index == 0) {
            return first;
        }
        let kept = self.at_rest.last();
        match (fallen(FALLS[1]), first) {
            (Some(Ok(second)), _) if second.index == 0 => Some(Ok(second)),
            // The base wrench leads to the equilibrium kept last.
            (_, Some(Ok(first))) => {
                kept.iter().for_each(|kept| self.at_rest.keep(kept));
                Some(Ok(first))
            }
            (second, first) => first.or(second),
        }
    }

    /// The equilibrium to which the rod falls from its unloaded shape; `None` if the fall does not end.
    fn fallen(&self, lean: Lean, plane: Option<Plane>) -> Option<Result<Equilibrium>> {
        let chain = self.descended(plane.map(|plane| plane.normal()), lean)?;
        let there = self.rod_under_force(chain.base_force);
        let layers = there.layered_places(self.tolerance, LONGEST).ok()?;
        Some(self.at_rest(chain.shape(layers, self.tolerance), plane))
    }

    /// Equilibria to which a rod under a load along it falls from tilts every way, in space and in the plane. Each
    /// comes with the problem whose base wrench leads to it.
    pub(in crate::rod) fn fallen_every_way(
        &self,
        plane: Option<&Plane>,
    ) -> Vec<(Self, Equilibrium)> {
        if self.weight.is_none() {
            return Vec::new();
        }
        let planes = std::iter::once(None).chain(plane.map(|plane| Some(*plane)));
        let falls = planes.flat_map(|plane| FALLS[0].every_way().map(move |lean| (lean, plane)));
        let found = falls.filter_map(|(lean, plane)| {
            let there = self.clone();
            let found = there.fallen(lean, plane)?.ok()?;
            Some((there, found))
        });
        found.collect()
    }

    /// The equilibrium that begins without the couple on the end and follows as the couple grows.
    fn solve_by_growing_couple(&self, plane: Option<Plane>) -> Option<Result<Equilibrium>> {
        let with_couple = |share: f64| Self {
            couple: self.couple * share,
            at_rest: WarmStart::default(),
            ..self.clone()
        };
        let quiet = with_couple(0.0);
        if let Err(why) = quiet.solve_by_descent()? {
            return Some(Err(why));
        }
        let mut shape = quiet.at_rest.last()?.shape.clone();
        let (mut share, mut step) = (0.0, FIRST_SHARE);
        loop {
            let next = f64::min(share + step, 1.0);
            let there = with_couple(next);
            match there.at_rest(shape.clone(), plane) {
                Ok(found) => {
                    let last = there.at_rest.last()?;
                    if next == 1.0 {
                        self.remember(&last);
                        return Some(Ok(found));
                    }
                    shape = last.shape.clone();
                    (share, step) = (next, 2.0 * step);
                }
                Err(_) if step > LEAST_SHARE => step *= 0.5,
                Err(why) => return Some(Err(why)),
            }
        }
    }

    fn at_rest(&self, shape: Shape, plane: Option<Plane>) -> Result<Equilibrium> {
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
            symmetry: self.symmetry(&join(&shape.nodes[0].m, &shape.n), plane.as_ref()),
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
                return self.find_force(&m, shape.n, Some(shape), false, plane);
            }
        };
        route.iterations = found.iterations;
        self.remember(&found);
        let off = if held[0] {
            (found.position - place).norm()
        } else {
            0.0
        };
        self.told(&found, &spring, off, route, plane)
    }

    /// Keeps an equilibrium: the base wrench then leads to the sections.
    pub(in crate::rod) fn remember(&self, found: &Solved) {
        self.at_rest.keep(&Arc::new(found.clone()));
    }
}
