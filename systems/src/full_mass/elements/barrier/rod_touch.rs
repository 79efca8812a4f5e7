//! Rods that touch each other, and a rod that touches itself: gaps, forces and their derivatives.
//!
//! A surface point at x has a nearest place y(s) on another stretch of a centreline: c = x - y, c . y' = 0. With the
//! normal n = c/|c| and the mean D of the two diameters, g = |c| - D is a gap as that of an obstacle. Displacements of
//! nodes change the gap by
//! ```text
//! dg = n.(dx - dy),      d2g = (dx - dy).(1 - n n)(dx - dy)/|c| - w^2/h,
//! w = (dx - dy).y'/|c| + n.dy',      h = |y'|^2/|c| - n.y'',
//! ```
//! The term with w is the sliding of the nearest place. An end of a rod does not slide. The points of both rods push,
//! each with half of its mass.
//!
//! Friction T acts where the surfaces touch, at x - a n and y + b n. The couples -a n x T and -b n x T are part of it:
//! without them two rods would set each other turning from nothing.

use super::near_rods::{NearPoint, weighted};
use super::{Barrier, BarrierSums, Press, SurfacePoint, TouchingPoint};
use crate::full_mass::elements::system::NodeNow;
use crate::full_mass::elements::{ElementAssembly, ElementNode, GaussTable};
use crate::math::se3::{Turn, join, unit};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

/// Steps of Newton's method to the nearest place of a centreline.
const STEPS: usize = 30;
/// Longest step, and the step away from a farthest place, in halves of an element.
const LONGEST: f64 = 0.5;
const AWAY: f64 = 0.1;
/// Step after which the next one would be below rounding.
const SETTLED: f64 = 1e-9;

/// One of the two rods at a contact.
#[derive(Debug, Clone)]
pub(super) struct Side {
    pub rod: usize,
    pub element: usize,
    /// Place along the rod, in [0, 1].
    pub s: f64,
    /// Place in the element, in [-1, 1].
    pub at: f64,
    /// Weights of the nodes of the element in c = x - y.
    weights: Vec<f64>,
    /// Derivatives of w by the places of the nodes.
    slides: Vec<Vector3<f64>>,
    /// Distance from the centreline to the contact, against n.
    lever: f64,
}

/// A surface point within the width of the barrier of a centreline.
#[derive(Debug, Clone)]
pub(super) struct RodTouch {
    /// The rod of the point, and the other.
    pub sides: [Side; 2],
    /// The point, with the velocity over the surface of the other rod.
    pub at: TouchingPoint,
    /// |c|.
    pub distance: f64,
    /// h; `None` at an end of the rod.
    bend: Option<f64>,
}

/// Centreline of an element: coefficients of its polynomial in the place in [-1, 1].
struct Curve(Vec<Vector3<f64>>);

/// The place of a centreline that is nearest to a point.
struct NearestOnCurve {
    element: usize,
    at: f64,
    /// Place, first and second derivative.
    jet: [Vector3<f64>; 3],
    slides: bool,
}

impl Curve {
    fn new(table: &GaussTable, nodes: &[NodeNow]) -> Self {
        let rows = table.powers.iter();
        Self(
            rows.map(|row| weighted(row, nodes, |node| node.position))
                .collect(),
        )
    }

    fn at(&self, x: f64) -> [Vector3<f64>; 3] {
        let [mut place, mut slope, mut bend] = [Vector3::zeros(); 3];
        for c in self.0.iter().rev() {
            bend = bend * x + slope * 2.0;
            slope = slope * x + place;
            place = place * x + c;
        }
        [place, slope, bend]
    }
}

/// Values and slopes of the polynomials of an element at a place in [-1, 1].
fn basis(table: &GaussTable, x: f64) -> [Vec<f64>; 2] {
    let count = table.powers.len();
    let (mut values, mut slopes) = (vec![0.0; count], vec![0.0; count]);
    for row in table.powers.iter().rev() {
        for ((value, slope), c) in values.iter_mut().zip(&mut slopes).zip(row) {
            *slope = *slope * x + *value;
            *value = *value * x + c;
        }
    }
    [values, slopes]
}

/// Rotation of a section.
fn directors(weights: &[f64], nodes: &[NodeNow]) -> UnitQuaternion<f64> {
    let pairs = weights.iter().zip(nodes);
    unit(&pairs.fold(Turn::zeros(), |sum, (weight, node)| {
        sum + node.turn * *weight
    }))
}

impl Side {
    /// Numbers of the nodes in the rod.
    fn nodes(&self, model: &ElementAssembly) -> std::ops::Range<usize> {
        model.rods[self.rod].elements[self.element].nodes.clone()
    }

    /// From the centreline to the contact.
    fn arm(&self, n: &Vector3<f64>) -> Vector3<f64> {
        n * -self.lever
    }
}

impl RodTouch {
    /// The place where the surfaces touch.
    pub fn place(&self) -> Vector3<f64> {
        self.at.point.place + self.sides[0].arm(&self.at.normal)
    }

    /// From both centrelines to the contact.
    pub fn arms(&self) -> [Vector3<f64>; 2] {
        self.sides.each_ref().map(|side| side.arm(&self.at.normal))
    }

    /// Calls `push` with rod and node of each node, and the (couple, force) on the node.
    fn each_force(
        &self,
        model: &ElementAssembly,
        press: &Press,
        mut push: impl FnMut(usize, usize, Vector6<f64>),
    ) {
        let force = press.force(&self.at.normal);
        for side in &self.sides {
            let couple = side.arm(&self.at.normal).cross(&press.friction);
            for (node, weight) in side.nodes(model).zip(&side.weights) {
                push(side.rod, node, join(&couple, &force) * *weight);
            }
        }
    }

    /// Derivatives of minus the forces by displacements and velocities of the nodes: those of the point's element, then
    /// those of the other element.
    fn stiffness(&self, press: &Press, nodes: [&[NodeNow]; 2]) -> [DMatrix<f64>; 2] {
        let n = self.at.normal;
        let across = (Matrix3::identity() - n * n.transpose()) / self.distance;
        let [reaction, by_gap, by_rate] = press.reaction;
        let size = 6 * (nodes[0].len() + nodes[1].len());
        let [mut normal, mut slide, mut pushed] = [(); 3].map(|()| DVector::zeros(size));
        // Derivatives of c, and of the displacement of one surface on the other.
        let [mut ways, mut surfaces] = [(); 2].map(|()| DMatrix::zeros(3, size));
        let (mut speed, mut sliding) = (Vector3::zeros(), 0.0);
        let mut at = 0;
        for (side, nodes) in self.sides.iter().zip(nodes) {
            let arm = side.arm(&n);
            let couple = arm.cross(&press.friction_share);
            for ((weight, slid), node) in side.weights.iter().zip(&side.slides).zip(nodes) {
                let shift = |v: &mut DVector<f64>, part: Vector3<f64>| {
                    v.fixed_rows_mut::<3>(at + 3).copy_from(&part);
                };
                shift(&mut normal, n * *weight);
                shift(&mut slide, *slid);
                shift(&mut pushed, (n + press.friction_share) * *weight);
                let turn = couple * *weight;
                pushed.fixed_rows_mut::<3>(at).copy_from(&turn);
                let turn = arm.cross_matrix() * -weight;
                surfaces.fixed_view_mut::<3, 3>(0, at).copy_from(&turn);
                for k in 0..3 {
                    ways[(k, at + 3 + k)] = *weight;
                    surfaces[(k, at + 3 + k)] = *weight;
                }
                speed += node.velocity * *weight;
                sliding += slid.dot(&node.velocity);
                at += 6;
            }
        }
        let over = self.bend.map_or(0.0, |bend| 1.0 / bend);
        let mut by_place = &normal * by_gap + ways.tr_mul(&(across * speed * by_rate));
        by_place.axpy(-over * sliding * by_rate, &slide, 1.0);
        let mut place = -(&pushed * by_place.transpose());
        place -= ways.tr_mul(&(across * reaction * &ways));
        place.ger(reaction * over, &slide, &slide, 1.0);
        if self.at.friction > 0.0 {
            place -= surfaces.tr_mul(&(press.friction_by_place * &surfaces));
        }
        [place, &pushed * (normal * -by_rate).transpose()]
    }
}

impl ElementAssembly {
    /// Rotation of the section of a side of a touch.
    pub(super) fn directors_of(&self, nodes: &[Vec<NodeNow>], side: &Side) -> UnitQuaternion<f64> {
        let [weights, _] = basis(&self.table, side.at);
        directors(&weights, self.of_element(nodes, side.rod, side.element))
    }

    /// Distance of `x` from the place of a rod that is nearest, from a place of the rod on.
    pub(super) fn distance_to(
        &self,
        nodes: &[Vec<NodeNow>],
        x: &Vector3<f64>,
        side: &Side,
    ) -> Option<f64> {
        let own = self.of_element(nodes, side.rod, side.element);
        let curve = Curve::new(&self.table, own);
        let start = (side.rod, side.element, side.at);
        let nearest = self.nearest_on(&nodes[side.rod], x, start, &curve)?;
        Some((x - nearest.jet[0]).norm())
    }

    /// Calls `act` with the listed number of each surface point that a rod pushes, and the touch. None if a point is
    /// inside of a rod.
    pub(super) fn each_rod_touch(
        &self,
        barrier: &Barrier,
        nodes: &[Vec<NodeNow>],
        mut act: impl FnMut(usize, &RodTouch),
    ) -> Option<()> {
        let Some(near) = &barrier.near else {
            return Some(());
        };
        let mut known: Option<((usize, usize), Curve)> = None;
        let moved = 2.0 * near.moved(nodes) + barrier.given.gap;
        for (number, one) in near.points.iter().enumerate() {
            let (rod, element) = one.place.element;
            let radii = [rod, one.point.element.0].map(|rod| barrier.given.rods[rod].radius);
            if one.distance > moved + radii[0] + radii[1] {
                continue;
            }
            let curve = match known.take().filter(|(of, _)| *of == (rod, element)) {
                Some((_, curve)) => curve,
                None => Curve::new(&self.table, self.of_element(nodes, rod, element)),
            };
            let touch = self.touch(barrier, nodes, one, &curve);
            known = Some(((rod, element), curve));
            let Some(touch) = touch else { continue };
            if !(touch.at.gap > 0.0) {
                return None;
            }
            act(number, &touch);
        }
        Some(())
    }

    /// The nodes of an element.
    pub(super) fn of_element<'a>(
        &self,
        nodes: &'a [Vec<NodeNow>],
        rod: usize,
        element: usize,
    ) -> &'a [NodeNow] {
        &nodes[rod][self.rods[rod].elements[element].nodes.clone()]
    }

    /// The place of rod `rod` nearest to `x`, from a place in an element with the centreline `curve`.
    fn nearest_on(
        &self,
        nodes: &[NodeNow],
        x: &Vector3<f64>,
        (rod, mut element, mut at): (usize, usize, f64),
        curve: &Curve,
    ) -> Option<NearestOnCurve> {
        let elements = &self.rods[rod].elements;
        let mut other: Option<Curve> = None;
        let mut from: Option<usize> = None;
        for _ in 0..STEPS {
            let curve = other.as_ref().unwrap_or(curve);
            let jet = curve.at(at);
            let [y, slope, bend] = jet;
            let along = (x - y).dot(&slope);
            let curved = slope.norm_squared() - (x - y).dot(&bend);
            let step = if curved > 0.0 {
                (along / curved).clamp(-LONGEST, LONGEST)
            } else {
                AWAY.copysign(along)
            };
            let beyond = match at {
                1.0 if step > 0.0 => Some(element + 1),
                -1.0 if step < 0.0 => Some(element.wrapping_sub(1)),
                _ => None,
            };
            if let Some(neighbour) = beyond {
                // The end of the rod, or a joint of elements that is nearer than the places on both of its sides.
                if from == Some(neighbour) || neighbour >= elements.len() {
                    return Some(NearestOnCurve {
                        element,
                        at,
                        jet,
                        slides: false,
                    });
                }
                (from, element, at) = (Some(element), neighbour, -at);
                let range = elements[element].nodes.clone();
                other = Some(Curve::new(&self.table, &nodes[range]));
                continue;
            }
            let next = (at + step).clamp(-1.0, 1.0);
            if (next - at).abs() < SETTLED {
                return (curved > 0.0).then(|| NearestOnCurve {
                    element,
                    at: next,
                    jet: curve.at(next),
                    slides: true,
                });
            }
            at = next;
        }
        None
    }

    /// The touch of a listed point; None where the point is beyond the width of the barrier, or has no nearest place.
    fn touch(
        &self,
        barrier: &Barrier,
        nodes: &[Vec<NodeNow>],
        one: &NearPoint,
        curve: &Curve,
    ) -> Option<RodTouch> {
        let given = &*barrier.given;
        let ((k, e), (l, guess)) = (one.point.element, one.place.element);
        let values = &barrier.values[one.point.number];
        let own = self.of_element(nodes, k, e);
        let x = weighted(values, own, |node| node.position);
        let nearest = self.nearest_on(&nodes[l], &x, (l, guess, one.place.at), curve)?;
        let [y, slope, bend] = nearest.jet;
        let distance = (x - y).norm();
        let thick = given.rods[k].radius + given.rods[l].radius;
        if distance - thick >= given.gap {
            return None;
        }
        let (number, intervals) = (one.point.number, barrier.intervals());
        let at = 2.0 * number as f64 / intervals as f64 - 1.0;
        let place = |rod: usize, element: usize, at: f64| {
            let element = &self.rods[rod].elements[element];
            element.from + (element.to - element.from) * 0.5 * (1.0 + at)
        };
        let (s, t) = (place(k, e, at), place(l, nearest.element, nearest.at));
        if !self.may_touch(barrier, (k, s), (l, t)) {
            return None;
        }
        let n = (x - y) / distance;
        let theirs = self.of_element(nodes, l, nearest.element);
        let [weights, slopes] = basis(&self.table, nearest.at);
        let ahead = slope / distance;
        let lever = |rod: usize| given.rods[rod].radius * distance / thick;
        let slides = weights.iter().zip(&slopes);
        let slides = slides.map(|(value, slope)| n * *slope - ahead * *value);
        let sides = [
            Side {
                rod: k,
                element: e,
                s,
                at,
                slides: values.iter().map(|value| ahead * *value).collect(),
                weights: values.clone(),
                lever: lever(k),
            },
            Side {
                rod: l,
                element: nearest.element,
                s: t,
                at: nearest.at,
                slides: slides.collect(),
                weights: weights.iter().map(|value| -value).collect(),
                lever: -lever(l),
            },
        ];
        let moving = sides.iter().zip([own, theirs]);
        let velocity = moving.fold(Vector3::zeros(), |sum, (side, nodes)| {
            let spin = weighted(&side.weights, nodes, |node| node.spin);
            let shift = weighted(&side.weights, nodes, |node| node.velocity);
            sum + shift + spin.cross(&side.arm(&n))
        });
        let slipped = one.anchor.map_or(Vector3::zeros(), |anchor| {
            let (element, at) = anchor.section;
            let nodes = self.of_element(nodes, l, element);
            let [weights, _] = basis(&self.table, at);
            let there = weighted(&weights, nodes, |node| node.position)
                + directors(&weights, nodes) * anchor.at_section;
            let u = x + directors(values, own) * anchor.at_point - there;
            u - n * n.dot(&u)
        });
        let length = self.length_of_point(k, e, number, intervals);
        let mass = 0.5 * barrier.density * barrier.share(thick) * length;
        Some(RodTouch {
            sides,
            at: TouchingPoint {
                gap: distance - thick,
                normal: n,
                point: SurfacePoint {
                    place: x,
                    velocity,
                    mass,
                },
                friction: given.between(k, l).unwrap_or(0.0),
                slipped,
            },
            distance,
            bend: nearest
                .slides
                .then(|| slope.norm_squared() / distance - n.dot(&bend)),
        })
    }

    /// Adds the forces of rods on each other to those on the nodes, and the energies to the sums.
    pub(in super::super) fn push_rods(
        &self,
        nodes: &[Vec<NodeNow>],
        pushed: &mut [Vec<Vector6<f64>>],
        sums: &mut BarrierSums,
    ) -> Option<()> {
        let Some(barrier) = self.pushing() else {
            return Some(());
        };
        self.each_rod_touch(barrier, nodes, |_, touch| {
            let press = touch.at.press(barrier);
            touch.each_force(self, &press, |rod, node, wrench| {
                pushed[rod][node] += wrench
            });
            sums.add(&press);
        })
    }

    /// Adds the derivatives of minus the forces of rods on each other. `add` takes two nodes, and the blocks by
    /// displacement and velocity.
    pub(in super::super) fn stiffen_rods(
        &self,
        nodes: &[Vec<NodeNow>],
        mut add: impl FnMut([(&ElementNode, &NodeNow); 2], [Matrix6<f64>; 2]),
    ) -> Option<()> {
        let Some(barrier) = self.pushing() else {
            return Some(());
        };
        let known = self.near_elements();
        let mut sums: std::collections::BTreeMap<[(usize, usize); 2], [DMatrix<f64>; 2]> =
            std::collections::BTreeMap::new();
        self.each_rod_touch(barrier, nodes, |_, touch| {
            let press = touch.at.press(barrier);
            let pair = touch.sides.each_ref().map(|side| (side.rod, side.element));
            let [a, b] = pair;
            if a != b && known.binary_search(&[a.min(b), a.max(b)]).is_err() {
                // Newton's iteration does without: the next list couples the two.
                return;
            }
            let both = pair.map(|(rod, element)| self.of_element(nodes, rod, element));
            let found = touch.stiffness(&press, both);
            match sums.entry(pair) {
                std::collections::btree_map::Entry::Vacant(entry) => {
                    entry.insert(found);
                }
                std::collections::btree_map::Entry::Occupied(mut entry) => {
                    for (sum, part) in entry.get_mut().iter_mut().zip(found) {
                        *sum += part;
                    }
                }
            }
        })?;
        for (pair, [place, velocity]) in &sums {
            let all = pair.iter().flat_map(|(rod, element)| {
                let range = self.rods[*rod].elements[*element].nodes.clone();
                range.map(|i| (&self.rods[*rod].nodes[i], &nodes[*rod][i]))
            });
            let all: Vec<_> = all.collect();
            for (i, row) in all.iter().enumerate() {
                for (j, column) in all.iter().enumerate() {
                    let block =
                        |of: &DMatrix<f64>| of.fixed_view::<6, 6>(6 * i, 6 * j).into_owned();
                    add([*row, *column], [block(place), block(velocity)]);
                }
            }
        }
        Some(())
    }
}
