//! Distances of a planar elastic rod from obstacles: a cheap lower bound, and the least distance along the rod.

use super::Phase;
use super::contacts::{GapBy, RodBound, RodTouch};
use crate::contact::Bodies;
use nalgebra::{Vector2, Vector3};
use snaprod_systems::body::{Frame, PointMass};
use snaprod_systems::elastica::{Elastica, Equilibrium};
use snaprod_systems::manifold::EquilibriumManifold;

/// Places along the chord of the rod.
const ALONG_CHORD: usize = 8;
/// Number of intervals of the rod, and of further intervals per lambda.
const INTERVALS: [f64; 2] = [16.0, 2.0];
/// Most intervals.
const MOST_INTERVALS: f64 = 400.0;
/// Bisections of the place that is nearest to an obstacle.
const BISECTIONS: usize = 50;

impl RodTouch {
    /// Nothing is near.
    pub(super) const FAR: Self = Self {
        bound: RodBound::Touch,
        rod: 0,
        obstacle: 0,
        s: 0.0,
        gap: f64::INFINITY,
    };

    /// Takes a place with a distance from an obstacle, if the distance is less than before.
    fn take(&mut self, obstacle: usize, s: f64, gap: f64) {
        if gap < self.gap {
            *self = Self {
                obstacle,
                s,
                gap,
                ..Self::FAR
            };
        }
    }
}

/// The frame of the clamp.
pub(super) fn frame(body: &PointMass<2>, t: f64) -> Frame<2> {
    body.support()
        .map_or_else(Frame::at_rest, |support| support.at(t))
}

/// A lower bound of the distance of the rod from the obstacles: all of its places lie in an ellipse about the chord.
pub(super) fn within_reach(bodies: &Bodies, body: &PointMass<2>, at: &Phase<2>) -> RodTouch {
    let frame = frame(body, at.t);
    let end = Elastica.point(&at.q).map(|point| point.pose);
    let end = end.unwrap_or_else(Vector2::zeros);
    let chord = end.norm();
    let beside = 0.5 * (1.0 - chord * chord).max(0.0).sqrt() + 0.5 * (1.0 - chord);
    let half = 0.5 * chord / ALONG_CHORD as f64;
    let mut least = RodTouch::FAR;
    for (obstacle, distance) in bodies.gaps_of_rod(0, at.t) {
        for i in 0..=ALONG_CHORD {
            let s = i as f64 / ALONG_CHORD as f64;
            let gap = distance(&frame.place(&(end * s)).push(0.0)).value;
            least.take(obstacle, s, gap - beside - half);
        }
    }
    least
}

/// The place of the rod that is nearest to an obstacle, between its ends. At the ends themselves other things hold the
/// rod: the clamp and the body. `by` chooses the obstacles.
pub(super) fn nearest_place(
    bodies: &Bodies,
    body: &PointMass<2>,
    at: &Phase<2>,
    by: GapBy,
) -> RodTouch {
    let frame = frame(body, at.t);
    let mut least = RodTouch::FAR;
    let Ok(rod) = Equilibrium::new(at.q[0], at.q[1]) else {
        return least;
    };
    let count = (INTERVALS[0] + INTERVALS[1] * rod.lambda).min(MOST_INTERVALS) as usize;
    let place = |i: usize| i as f64 / count as f64;
    // Place and tangent in the world.
    let section = |s: f64| {
        let section = rod.section(s).ok()?;
        let (sin, cos) = section.theta.sin_cos();
        let x = frame.place(&Vector2::new(section.x, section.y));
        Some((x, frame.outward(&Vector2::new(cos, sin))))
    };
    let sections: Vec<_> = (0..=count).map(|i| section(place(i))).collect();
    for (obstacle, distance) in bodies.gaps_of_rod(0, at.t) {
        if !by.looks_at(RodBound::Touch, obstacle) {
            continue;
        }
        // Distance, and its rate along the rod.
        let seen = |section: &Option<(Vector2<f64>, Vector2<f64>)>| {
            let (x, along) = section.as_ref()?;
            let gap = distance(&x.push(0.0));
            let along: Vector3<f64> = along.push(0.0);
            Some((gap.value, gap.normal.dot(&along)))
        };
        let values: Vec<_> = sections.iter().map(seen).collect();
        for (i, pair) in values.windows(2).enumerate() {
            let [Some((gap, falls)), Some((_, rises))] = *pair else {
                continue;
            };
            if i > 0 {
                least.take(obstacle, place(i), gap);
            }
            if falls >= 0.0 || rises <= 0.0 {
                continue;
            }
            let mut ends = [place(i), place(i + 1)];
            for _ in 0..BISECTIONS {
                let s = 0.5 * (ends[0] + ends[1]);
                match seen(&section(s)) {
                    Some((_, rate)) if rate < 0.0 => ends[0] = s,
                    _ => ends[1] = s,
                }
            }
            if let Some((gap, _)) = seen(&section(ends[1])) {
                least.take(obstacle, ends[1], gap);
            }
        }
    }
    least
}
