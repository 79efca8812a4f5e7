//! Places nearest to obstacles, and what a step may have missed: obstacles between points, and on the way of points.

use super::contacts::Touching;
use super::{BULGE, DENSEST, point_of};
use crate::contact::Obstacle;
use crate::full_mass::elements::sample::lagrange;
use crate::full_mass::elements::{ElementAssembly, ElementMoment};
use nalgebra::Vector3;

/// Points looked at for each point of an element that is pushed.
const BETWEEN: usize = 4;
/// Halvings of the way of a point that are looked at.
const CUTS: u32 = 12;

/// The place where a rod or ball is nearest to an obstacle, or deepest inside of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestPlace {
    /// Gap between the surfaces.
    pub gap: f64,
    /// The rod or the body. The stretch of a rod is the one place.
    pub of: Touching,
    /// The obstacle.
    pub obstacle: usize,
}

/// The kind of touch that a step missed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Missed {
    /// A place of a rod between the points that obstacles push is inside of one.
    Between,
    /// A point may have passed through an obstacle, or through a rod.
    Obstacle,
    /// Points moved farther than the list of rods that are near each other is good for.
    Near {
        /// The way of the points.
        way: f64,
    },
}

/// True if an obstacle lies on the way along a Bezier curve of degree 3. A gap changes by no more than the way.
fn is_blocked(gap: &impl Fn(&Vector3<f64>) -> f64, curve: &[Vector3<f64>; 4], cuts: u32) -> bool {
    let way: f64 = curve
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm())
        .sum();
    let ends = [gap(&curve[0]), gap(&curve[3])];
    if way < ends[0] + ends[1] {
        return false;
    }
    if cuts == 0 || !(ends[0] > 0.0 && ends[1] > 0.0) {
        return true;
    }
    // De Casteljau's halves.
    let middle = |a: &Vector3<f64>, b: &Vector3<f64>| (a + b) * 0.5;
    let [a, b, c, d] = curve;
    let (ab, bc, cd) = (middle(a, b), middle(b, c), middle(c, d));
    let (abc, bcd) = (middle(&ab, &bc), middle(&bc, &cd));
    let halfway = middle(&abc, &bcd);
    is_blocked(gap, &[*a, ab, abc, halfway], cuts - 1)
        || is_blocked(gap, &[halfway, bcd, cd, *d], cuts - 1)
}

impl ElementAssembly {
    /// The places where the rods are nearest to the obstacles, looked for at `finer` times as many points as push.
    pub fn nearest_place(&self, at: &ElementMoment, finer: usize) -> Option<NearestPlace> {
        let barrier = self.barrier.as_ref()?;
        let given = &*barrier.given;
        let count = barrier.intervals() * finer;
        let values: Vec<Vec<f64>> = (0..=count)
            .map(|j| lagrange(&self.table.nodes, j as f64 / count as f64))
            .collect();
        let mut nearest: Option<NearestPlace> = None;
        for (k, rod) in self.rods.iter().enumerate() {
            let surface = &given.rods[k];
            for element in &rod.elements {
                let nodes = &at.nodes[k][element.nodes.clone()];
                let start = nodes[0].position;
                let reach = (nodes.iter()).fold(0.0_f64, |most, node| {
                    most.max((node.position - start).norm())
                });
                let gap = |x: &Vector3<f64>| {
                    let each = given.obstacles.iter().zip(&surface.friction);
                    let touched = each.filter(|(_, friction)| friction.is_some());
                    touched.fold(f64::INFINITY, |least, (shape, _)| {
                        shape.gap(x).value.min(least)
                    })
                };
                let least = nearest.map_or(f64::INFINITY, |nearest| nearest.gap);
                if gap(&start) - surface.radius - BULGE * reach > least {
                    continue;
                }
                for (j, values) in values.iter().enumerate() {
                    let x = j as f64 / count as f64;
                    let s = element.from + (element.to - element.from) * x;
                    if rod.is_at_ground(s, surface) {
                        continue;
                    }
                    let place = point_of(nodes, values, 0.0).place;
                    for (obstacle, shape) in given.obstacles.iter().enumerate() {
                        if surface.friction[obstacle].is_none() {
                            continue;
                        }
                        let gap = shape.gap(&place).value - surface.radius;
                        if nearest.is_none_or(|nearest| gap < nearest.gap) {
                            let s = s * rod.law().length();
                            let of = Touching::Rod {
                                rod: k,
                                stretch: [s; 2],
                                centre: s,
                            };
                            nearest = Some(NearestPlace { gap, of, obstacle });
                        }
                    }
                }
            }
        }
        for (ball, now) in given.balls.iter().zip(&at.balls) {
            for (obstacle, shape) in given.obstacles.iter().enumerate() {
                let gap = shape.gap(&now.position).value - ball.surface.radius;
                let touches = ball.surface.friction[obstacle].is_some();
                if touches && nearest.is_none_or(|nearest| gap < nearest.gap) {
                    let of = Touching::Body(ball.on);
                    nearest = Some(NearestPlace { gap, of, obstacle });
                }
            }
        }
        nearest
    }

    /// A passage or place that a step between two moments missed.
    pub fn missed(&self, before: &ElementMoment, after: &ElementMoment) -> Option<Missed> {
        let barrier = self.barrier.as_ref()?;
        if let Some(missed) = self.missed_at_rods(barrier, [before, after]) {
            return Some(missed);
        }
        if barrier.given.obstacles.is_empty() {
            return None;
        }
        let nearest = self.nearest_place(after, BETWEEN);
        if nearest.is_some_and(|nearest| !(nearest.gap > 0.0)) {
            return Some(Missed::Between);
        }
        let given = &*barrier.given;
        let [from, to] = [before, after].map(|at| self.surface_points(barrier, at));
        let rods = self.rods.iter().zip(&given.rods);
        let rods = rods.flat_map(|(rod, surface)| {
            let points = rod.elements.len() * barrier.values.len();
            std::iter::repeat_n(surface, points)
        });
        let surfaces = rods.chain(given.balls.iter().map(|ball| &ball.surface));
        let span = after.t - before.t;
        for (surface, (a, b)) in surfaces.zip(from.iter().zip(&to)) {
            for (shape, friction) in given.obstacles.iter().zip(&surface.friction) {
                // The outside of these is convex.
                let open = matches!(shape, Obstacle::Plane { .. })
                    || matches!(
                        shape,
                        Obstacle::Cylinder { inside: true, .. }
                            | Obstacle::Sphere { inside: true, .. }
                    );
                if open || friction.is_none() {
                    continue;
                }
                let gap = |x: &Vector3<f64>| shape.gap(x).value - surface.radius;
                let third = span / 3.0;
                let chord = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|x| a.place.lerp(&b.place, x));
                let path = [
                    a.place,
                    a.place + a.velocity * third,
                    b.place - b.velocity * third,
                    b.place,
                ];
                if is_blocked(&gap, &chord, CUTS) && is_blocked(&gap, &path, CUTS) {
                    return Some(Missed::Obstacle);
                }
            }
        }
        None
    }

    /// The assembly with `factor` times as many points on each element; None where there are as many as there may be.
    pub fn with_denser_points(mut self, factor: usize) -> Option<Self> {
        let nodes = self.table.nodes.clone();
        let barrier = self.barrier.as_mut()?;
        let intervals = barrier.intervals() * factor;
        if intervals > DENSEST {
            return None;
        }
        barrier.spread(&nodes, intervals);
        Some(self)
    }
}
