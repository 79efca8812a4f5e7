//! Surface points near other stretches of rods: a list that serves until rods have moved, and the anchors of friction.

use super::rod_touch::RodTouch;
use super::{BULGE, Barrier, Missed};
use crate::full_mass::elements::sample::lagrange;
use crate::full_mass::elements::system::NodeNow;
use crate::full_mass::elements::{Carrier, ElementAssembly, ElementMoment, ElementNode};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Points of a piece of a rod in the search for neighbours.
const PIECE: usize = 16;
/// Distance of the points of a coarse choice, as a part of the margin; most points for one of them.
const COARSE: f64 = 8.0;
const STRIDE: usize = 16;
/// Distance beyond the barrier up to which Newton's matrix couples elements, over the mean of two diameters.
const COUPLED: f64 = 2.0;
/// Place in an element, in [-1, 1], from which on the next element is coupled too.
const NEXT: f64 = 0.6;
/// Distance beyond the barrier up to which points are listed at least, over the thinnest diameter.
const MARGIN: f64 = 0.25;
/// Way for which a list is made, over the way expected in a step.
const AHEAD: f64 = 1.5;
/// Largest way of two touching rods on each other in one step, over the mean of their diameters: on a way of twice the
/// mean one rod may pass through the other.
const PASSING: f64 = 1.5;
/// Stretch of two rods with ends on one holder that touch there, over the mean of their diameters, along which the two
/// are not looked for.
const JOINED: f64 = 4.0;
/// Way in one step that is too long where rods are near each other, in lengths of the shortest rod.
const FAR: f64 = 0.2;
/// Gap, over the width of the barrier, below which places between points are looked at.
const DEEP: f64 = 0.1;
/// Sum of the distances along both rods, in lengths of the rods, up to which two touches are one.
const SAME: f64 = 0.01;
/// Places looked at for each point.
const BETWEEN: usize = 4;

/// Surface points near other stretches of rods, at a moment.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct NearRods {
    pub(super) points: Vec<NearPoint>,
    /// Pairs of elements with nodes on which the two rods may push, as (rod, element), in order.
    pairs: Vec<[(usize, usize); 2]>,
    /// Distance beyond the barrier up to which points are listed.
    margin: f64,
    /// Places of the nodes at the moment.
    places: Vec<Vec<Vector3<f64>>>,
}

/// A surface point, by rod and element, and its number in the element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PointOnRod {
    pub element: (usize, usize),
    pub number: usize,
}

/// A place of a centreline, by rod and element, and the place in the element, in [-1, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlaceOnRod {
    pub element: (usize, usize),
    pub at: f64,
}

/// A surface point near a place of another stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NearPoint {
    pub point: PointOnRod,
    pub place: PlaceOnRod,
    /// Lower bound of the distance of the two at the moment.
    pub distance: f64,
    pub anchor: Option<RodAnchor>,
}

/// Places on two surfaces that lie on each other where friction is zero, seen from the directors of their sections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RodAnchor {
    /// From the surface point.
    pub at_point: Vector3<f64>,
    /// Element of the other rod, and place in the element, in [-1, 1].
    pub section: (usize, f64),
    /// From this section.
    pub at_section: Vector3<f64>,
}

/// Displacement at a touch of two places, each by rod and place along the rod, in [0, 1].
struct Slip {
    place: [(usize, f64); 2],
    u: Vector3<f64>,
}

/// A place of a rod in the search for neighbours.
#[derive(Debug, Clone, Copy)]
struct Sample {
    element: usize,
    /// Number of the surface point in the element.
    number: usize,
    place: Vector3<f64>,
}

/// A piece of a rod in the search for neighbours.
struct Piece {
    /// Numbers of its samples in a list.
    samples: std::ops::Range<usize>,
    centre: Vector3<f64>,
    radius: f64,
}

/// Pieces of samples that follow each other.
fn pieces_of(samples: &[Sample]) -> Vec<Piece> {
    let starts = (0..samples.len()).step_by(PIECE);
    let pieces = starts.map(|i| Piece::new(i..(i + PIECE).min(samples.len()), samples));
    pieces.collect()
}

/// Sum of vectors of nodes with weights.
pub(super) fn weighted(
    weights: &[f64],
    nodes: &[NodeNow],
    of: impl Fn(&NodeNow) -> Vector3<f64>,
) -> Vector3<f64> {
    let pairs = weights.iter().zip(nodes);
    pairs.fold(Vector3::zeros(), |sum, (weight, node)| {
        sum + of(node) * *weight
    })
}

/// Length of the control polygon of the path of a point between two moments, which is no shorter than the path.
fn way_of([from, to]: [Vector3<f64>; 2], [before, after]: [Vector3<f64>; 2], span: f64) -> f64 {
    let (out, back) = (before * (span / 3.0), after * (span / 3.0));
    out.norm() + (to - back - from - out).norm() + back.norm()
}

impl Piece {
    fn new(range: std::ops::Range<usize>, samples: &[Sample]) -> Self {
        let own = &samples[range.clone()];
        let centre = own.iter().map(|one| one.place).sum::<Vector3<f64>>() / own.len() as f64;
        let far = |most: f64, one: &Sample| most.max((one.place - centre).norm());
        Self {
            samples: range,
            centre,
            radius: own.iter().fold(0.0, far),
        }
    }
}

impl NearRods {
    /// A bound of the way of the points of rods since the moment.
    pub(super) fn moved(&self, nodes: &[Vec<NodeNow>]) -> f64 {
        let pairs = nodes.iter().flatten().zip(self.places.iter().flatten());
        let ways = pairs.map(|(node, listed)| (node.position - listed).norm());
        BULGE * ways.fold(0.0, f64::max)
    }
}

impl ElementAssembly {
    /// True if rods touch each other.
    pub fn rods_meet(&self) -> bool {
        let barrier = self.barrier.as_ref();
        barrier.is_some_and(|barrier| barrier.given.rods_meet())
    }

    /// Pairs of elements that Newton's matrix couples, in order.
    pub(in super::super) fn near_elements(&self) -> &[[(usize, usize); 2]] {
        let near = self.barrier.as_ref().and_then(|b| b.near.as_deref());
        near.map_or(&[], |near| &near.pairs)
    }

    /// True if places s of rod k and t of rod l may touch: neighbours along one rod do not, nor do stretches next to
    /// ends that touch on one holder.
    pub(super) fn may_touch(
        &self,
        barrier: &Barrier,
        (k, s): (usize, f64),
        (l, t): (usize, f64),
    ) -> bool {
        let given = &*barrier.given;
        let thick = given.rods[k].radius + given.rods[l].radius;
        let [length, other] = [k, l].map(|rod| self.rods[rod].law().length());
        // A rod bent to its own radius comes back to itself on a half circle.
        if k == l && (s - t).abs() * length < FRAC_PI_2 * thick {
            return false;
        }
        let from_ends = |at: f64, length: f64| [at * length, (1.0 - at) * length];
        let near = |way: f64| way < JOINED * thick;
        for (i, way) in from_ends(s, length).into_iter().enumerate() {
            for (j, back) in from_ends(t, other).into_iter().enumerate() {
                if near(way) && near(back) && barrier.are_joined((k, i), (l, j)) {
                    return false;
                }
            }
        }
        true
    }

    /// Ends of rods that touch on one holder, as pairs of (rod, 0 or 1).
    pub(in super::super) fn joined_ends(&self, barrier: &Barrier) -> Vec<[(usize, usize); 2]> {
        let grounds = self.grounds(0.0);
        let end = |k: usize, i: usize| -> Option<&ElementNode> {
            let nodes = &self.rods[k].nodes;
            if i == 0 { nodes.first() } else { nodes.last() }
        };
        let all: Vec<(usize, usize)> = (0..self.rods.len())
            .flat_map(|k| [(k, 0), (k, 1)])
            .collect();
        let place = |node: &ElementNode| match node.shift {
            Carrier::Site(site) => (Some(site), node.place.translation.vector),
            Carrier::Ground(i) => (None, (grounds[i].pose() * node.place).translation.vector),
        };
        let mut found = Vec::new();
        for (i, a) in all.iter().enumerate() {
            for b in &all[i + 1..] {
                let (Some(one), Some(other)) = (end(a.0, a.1), end(b.0, b.1)) else {
                    continue;
                };
                let ((on, x), (by, y)) = (place(one), place(other));
                let radii = [a.0, b.0].map(|k| barrier.given.rods[k].radius);
                if on == by && (x - y).norm() < radii[0] + radii[1] + barrier.given.gap {
                    found.push([*a, *b]);
                }
            }
        }
        found
    }

    pub(super) fn length_of_shortest(&self) -> f64 {
        let lengths = self.rods.iter().map(|rod| rod.law().length());
        lengths.fold(f64::INFINITY, f64::min)
    }

    /// Surface points of a rod; two elements share a point.
    fn points_of_rod(&self, barrier: &Barrier, nodes: &[Vec<NodeNow>], k: usize) -> Vec<Sample> {
        let elements = 0..self.rods[k].elements.len();
        let points = elements.flat_map(|element| {
            let nodes = self.of_element(nodes, k, element);
            let values = barrier.values.iter().enumerate();
            values.map(move |(number, values)| Sample {
                element,
                number,
                place: weighted(values, nodes, |node| node.position),
            })
        });
        points.collect()
    }

    /// The assembly with a list of the points that are near other stretches of rods, for ways of at most `way` from the
    /// moment on.
    #[must_use]
    pub fn with_near_rods(mut self, at: &ElementMoment, way: f64) -> Self {
        let Some(barrier) = self
            .barrier
            .clone()
            .filter(|barrier| barrier.given.rods_meet())
        else {
            return self;
        };
        let margin = (MARGIN * barrier.given.thinnest_pair()).max(2.0 * BULGE * AHEAD * way);
        let near = self.near_points(&barrier, at, margin);
        let same = self.near_elements() == near.pairs;
        let slips = if barrier.given.rods_rub() {
            self.slips(&barrier, at, |touch| touch.at.slipped)
        } else {
            Vec::new()
        };
        let mut barrier = barrier;
        barrier.near = Some(Arc::new(near));
        if !slips.is_empty() {
            barrier.near = Some(Arc::new(self.with_slips(&barrier, at, &slips)));
        }
        self.barrier = Some(barrier);
        if !same {
            self.renew_pattern();
        }
        self
    }

    /// True if the list of points near other rods serves for ways of at most `way` from the moment on.
    pub fn knows_near_rods(&self, at: &ElementMoment, way: f64) -> bool {
        let near = self.barrier.as_ref().and_then(|b| b.near.as_deref());
        near.is_some_and(|near| 2.0 * (near.moved(&at.nodes) + BULGE * way) <= near.margin)
    }

    /// True if the same points are listed as in another assembly on the same elements.
    pub fn has_near_rods_of(&self, other: &Self) -> bool {
        let [own, other] =
            [self, other].map(|of| of.barrier.as_ref().and_then(|b| b.near.as_deref()));
        let list = |near: Option<&NearRods>| -> Vec<PointOnRod> {
            near.iter()
                .flat_map(|near| near.points.iter().map(|one| one.point))
                .collect()
        };
        list(own) == list(other)
    }

    /// Speed of the fastest node.
    pub fn fastest(&self, at: &ElementMoment) -> f64 {
        let nodes = at.nodes.iter().flatten();
        nodes.fold(0.0, |most, node| node.velocity.norm().max(most))
    }

    fn near_points(&self, barrier: &Barrier, at: &ElementMoment, margin: f64) -> NearRods {
        let given = &*barrier.given;
        let intervals = barrier.intervals();
        let points: Vec<Vec<Sample>> = (0..self.rods.len())
            .map(|k| self.points_of_rod(barrier, &at.nodes, k))
            .collect();
        let chord = |samples: &[Sample]| {
            let pairs = samples.windows(2);
            pairs.fold(0.0_f64, |most, pair| {
                (pair[1].place - pair[0].place).norm().max(most)
            })
        };
        let spacing = points
            .iter()
            .map(|points| chord(points))
            .fold(0.0, f64::max);
        // Of the other rod a coarse choice of points serves, each place once.
        let stride = ((margin / (COARSE * spacing)) as usize).clamp(1, STRIDE);
        let others: Vec<Vec<Sample>> = (points.iter())
            .map(|points| {
                let last = points.len() - 1;
                let each = points.iter().enumerate();
                let chosen = each.filter(|(i, one)| {
                    let along = one.element * intervals + one.number;
                    (one.number > 0 || *i == 0) && (along.is_multiple_of(stride) || *i == last)
                });
                chosen.map(|(_, one)| *one).collect()
            })
            .collect();
        let spacing = others
            .iter()
            .map(|points| chord(points))
            .fold(0.0, f64::max);
        let mut near = NearRods {
            margin,
            places: (at.nodes.iter())
                .map(|nodes| nodes.iter().map(|node| node.position).collect())
                .collect(),
            ..NearRods::default()
        };
        let at_places = |one: &Sample| 2.0 * one.number as f64 / intervals as f64 - 1.0;
        let along = |rod: usize, one: &Sample| {
            let element = &self.rods[rod].elements[one.element];
            element.from + (element.to - element.from) * 0.5 * (1.0 + at_places(one))
        };
        let pieces: Vec<Vec<Piece>> = others.iter().map(|points| pieces_of(points)).collect();
        for (k, points) in points.iter().enumerate() {
            for piece in pieces_of(points) {
                for (l, others) in others.iter().enumerate() {
                    if given.between(k, l).is_none() {
                        continue;
                    }
                    let thick = given.rods[k].radius + given.rods[l].radius;
                    let reach = thick + given.gap + margin + spacing;
                    let close = pieces[l].iter().filter(|other| {
                        let away = (piece.centre - other.centre).norm();
                        away <= piece.radius + other.radius + reach
                    });
                    let close: Vec<usize> = close.flat_map(|other| other.samples.clone()).collect();
                    for one in &points[piece.samples.clone()] {
                        let square = |j: usize| (one.place - others[j].place).norm_squared();
                        let seen = close.iter().map(|j| (*j, square(*j)));
                        let seen: Vec<(usize, f64)> = seen.collect();
                        for (i, (j, least)) in seen.iter().enumerate() {
                            let other = &others[*j];
                            let beside = |at: Option<usize>, neighbour: usize| {
                                let near = at.and_then(|at| seen.get(at));
                                let near = near.filter(|(j, _)| *j == neighbour);
                                near.map_or(f64::INFINITY, |(_, square)| *square)
                            };
                            let nearest = *least < reach * reach
                                && *least < beside(i.checked_sub(1), j.wrapping_sub(1))
                                && *least <= beside(Some(i + 1), j + 1);
                            let s = (along(k, one), along(l, other));
                            if !nearest || !self.may_touch(barrier, (k, s.0), (l, s.1)) {
                                continue;
                            }
                            let distance = (least.sqrt() - spacing).max(0.0);
                            let found = NearPoint {
                                point: PointOnRod {
                                    element: (k, one.element),
                                    number: one.number,
                                },
                                place: PlaceOnRod {
                                    element: (l, other.element),
                                    at: at_places(other),
                                },
                                distance,
                                anchor: None,
                            };
                            near.points.push(found);
                            if distance < thick + given.gap + margin.min(COUPLED * thick) {
                                self.couple(&found, &mut near.pairs);
                            }
                        }
                    }
                }
            }
        }
        near.pairs.sort_unstable();
        near.pairs.dedup();
        near.points
            .sort_by_key(|one| (one.place.element, one.point.element, one.point.number));
        near
    }

    /// Adds the elements that a near point couples: next to a joint of elements the nearest place may slide across.
    fn couple(&self, found: &NearPoint, pairs: &mut Vec<[(usize, usize); 2]>) {
        let (own, (rod, element)) = (found.point.element, found.place.element);
        let last = self.rods[rod].elements.len() - 1;
        let mut add = |element: usize| {
            let other = (rod, element);
            pairs.push([own.min(other), own.max(other)]);
        };
        add(element);
        if found.place.at > NEXT && element < last {
            add(element + 1);
        }
        if found.place.at < -NEXT && element > 0 {
            add(element - 1);
        }
    }

    /// A passage or place of rods that a step between two moments missed.
    pub(super) fn missed_at_rods(
        &self,
        barrier: &Barrier,
        [before, after]: [&ElementMoment; 2],
    ) -> Option<Missed> {
        let near = barrier.near.as_deref()?;
        let span = after.t - before.t;
        let (mut longest, mut farthest) = (0.0_f64, 0.0_f64);
        let [from, to] = [before, after].map(|at| at.nodes.iter().flatten());
        let listed = near.places.iter().flatten();
        for ((a, b), listed) in from.zip(to).zip(listed) {
            let way = way_of([a.position, b.position], [a.velocity, b.velocity], span);
            longest = longest.max(way);
            farthest = farthest.max((a.position - listed).norm() + way);
        }
        if longest > FAR * self.length_of_shortest() && !near.points.is_empty() {
            return Some(Missed::Obstacle);
        }
        if 2.0 * BULGE * farthest > near.margin {
            return Some(Missed::Near { way: farthest });
        }
        let mut missed = None;
        let given = &*barrier.given;
        for one in &near.points {
            let ((k, e), (l, f)) = (one.point.element, one.place.element);
            let thick = given.rods[k].radius + given.rods[l].radius;
            let [x, y] = [before, after].map(|at| {
                let own = self.of_element(&at.nodes, k, e);
                let theirs = self.of_element(&at.nodes, l, f);
                let there = lagrange(&self.table.nodes, 0.5 * (1.0 + one.place.at));
                let c = |of: fn(&NodeNow) -> Vector3<f64>| {
                    weighted(&barrier.values[one.point.number], own, of)
                        - weighted(&there, theirs, of)
                };
                [c(|node| node.position), c(|node| node.velocity)]
            });
            let way = way_of([x[0], y[0]], [x[1], y[1]], span);
            let apart = x[0].norm().min(y[0].norm()) - thick;
            if way > PASSING * thick && apart < way {
                missed = Some(Missed::Obstacle);
            }
        }
        if missed.is_some() {
            return missed;
        }
        let mut deep = false;
        let inside = self.each_rod_touch(barrier, &after.nodes, |number, touch| {
            if touch.at.gap < DEEP * given.gap {
                deep |= self.is_inside_between(barrier, after, &near.points[number], touch);
            }
        });
        (inside.is_none() || deep).then_some(Missed::Between)
    }

    /// Least gap between rods within the width of the barrier; infinite where no rods touch.
    pub fn least_gap_of_rods(&self, at: &ElementMoment) -> f64 {
        let mut least = f64::INFINITY;
        if let Some(barrier) = &self.barrier {
            let seen = self.each_rod_touch(barrier, &at.nodes, |_, touch| {
                least = least.min(touch.at.gap);
            });
            if seen.is_none() {
                return f64::NEG_INFINITY;
            }
        }
        least
    }

    /// True if a place between a surface point and the next is inside of the other rod.
    fn is_inside_between(
        &self,
        barrier: &Barrier,
        at: &ElementMoment,
        one: &NearPoint,
        touch: &RodTouch,
    ) -> bool {
        let [own, other] = &touch.sides;
        let thick = barrier.given.rods[own.rod].radius + barrier.given.rods[other.rod].radius;
        let own = self.of_element(&at.nodes, own.rod, own.element);
        let step = 1.0 / (barrier.intervals() * BETWEEN) as f64;
        let here = one.point.number * BETWEEN;
        let places = here.saturating_sub(BETWEEN)..=(here + BETWEEN);
        places.into_iter().any(|i| {
            let x = i as f64 * step;
            if x > 1.0 {
                return false;
            }
            let values = lagrange(&self.table.nodes, x);
            let x = weighted(&values, own, |node| node.position);
            self.distance_to(&at.nodes, &x, other)
                .is_some_and(|distance| !(distance > thick))
        })
    }

    /// The list with the anchors of the rods' points after a step to a moment.
    pub(super) fn anchored_rods(&self, barrier: &Barrier, at: &ElementMoment) -> NearRods {
        let slips = self.slips(barrier, at, |touch| touch.at.held(barrier));
        self.with_slips(barrier, at, &slips)
    }

    /// The list with the anchors of the list of another mesh, in whose state `before` rods have the same places.
    pub(super) fn anchored_rods_as(
        &self,
        barrier: &Barrier,
        at: &ElementMoment,
        (from, old): (&Self, &Barrier),
        before: &ElementMoment,
    ) -> NearRods {
        let slips = from.slips(old, before, |touch| touch.at.slipped);
        self.with_slips(barrier, at, &slips)
    }

    /// Displacements from the anchors at all touches, with the places of both rods.
    fn slips(
        &self,
        barrier: &Barrier,
        at: &ElementMoment,
        of: impl Fn(&RodTouch) -> Vector3<f64>,
    ) -> Vec<Slip> {
        let mut slips = Vec::new();
        let _ = self.each_rod_touch(barrier, &at.nodes, |_, touch| {
            let place = touch.sides.each_ref().map(|side| (side.rod, side.s));
            let u = of(touch);
            slips.push(Slip { place, u });
        });
        slips
    }

    fn with_slips(&self, barrier: &Barrier, at: &ElementMoment, slips: &[Slip]) -> NearRods {
        let mut near = barrier.near.as_deref().cloned().unwrap_or_default();
        near.points.iter_mut().for_each(|one| one.anchor = None);
        let mut anchors = Vec::new();
        let _ = self.each_rod_touch(barrier, &at.nodes, |number, touch| {
            let place = touch.sides.each_ref().map(|side| (side.rod, side.s));
            let far = |slip: &Slip| -> f64 {
                let pairs = place.iter().zip(&slip.place);
                pairs
                    .map(|((rod, s), (other, t))| if rod == other { (s - t).abs() } else { 1.0 })
                    .sum()
            };
            let nearest = slips.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
            let near = nearest.filter(|slip| far(slip) < SAME);
            let u = near.map_or(Vector3::zeros(), |slip| slip.u);
            let n = touch.at.normal;
            anchors.push((number, self.rod_anchor(at, touch, &(u - n * n.dot(&u)))));
        });
        for (number, anchor) in anchors {
            near.points[number].anchor = Some(anchor);
        }
        near
    }

    /// The anchor at which the surfaces of a touch are displaced by `u`.
    fn rod_anchor(&self, at: &ElementMoment, touch: &RodTouch, u: &Vector3<f64>) -> RodAnchor {
        let [own, other] = &touch.sides;
        let seen = |side, v: Vector3<f64>| self.directors_of(&at.nodes, side).inverse() * v;
        let [arm, back] = touch.arms();
        RodAnchor {
            at_point: seen(own, arm),
            section: (other.element, other.at),
            at_section: seen(other, back - u),
        }
    }
}
