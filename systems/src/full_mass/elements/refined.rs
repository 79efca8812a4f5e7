//! States of rods on finer meshes.
//!
//! Strains of an element are bounded at its Gauss points alone. Halves with the polynomials of the element would have
//! Gauss points elsewhere, where stiff strains store an energy that the element does not have. The nodes of the halves
//! therefore follow from the polynomials (u, v) through the Gauss points of the element: rotations by integration of
//! R' = R u^, positions by r' = R v at the Gauss points of the halves. Velocities keep the polynomials of the element:
//! spins of slender sections, and the rates of strain that follow from spins, are not resolved.

use super::strain_at_point::Point;
use super::system::{NodeNow, point};
use super::{ElementAssembly, ElementMoment, ElementRod, INTEGRALS, RodElement};
use crate::assembly::BodyMotion;
use crate::math::se3::{
    Turn, conjugate, exponential, frame, halves, inverse_left_jacobian, left_jacobian, product,
    unit,
};
use crate::section::Strain;
use nalgebra::{DMatrix, DVector, Isometry3, Vector3};

/// Steps of integration between two nodes. With two terms of Magnus the error of a step is of fifth order.
const STEPS: usize = 4;
/// sqrt(3)/12, the factor of the commutator.
const MAGNUS: f64 = 0.144_337_567_297_406_43;

/// Position and rotation of a section.
#[derive(Clone, Copy)]
struct SectionPlace {
    position: Vector3<f64>,
    turn: Turn,
}

impl SectionPlace {
    /// The place `inner`, seen from `from`, carried to this place.
    fn carrying(&self, from: &Self, inner: &Self) -> Self {
        let turn = product(&self.turn, &conjugate(&from.turn));
        Self {
            position: self.position + frame(&turn) * (inner.position - from.position),
            turn: product(&turn, &inner.turn),
        }
    }
}

impl ElementAssembly {
    /// The state `y` of the coarser mesh `from`, on the finer mesh of `self`.
    pub fn carried(&self, from: &Self, y: &DVector<f64>) -> Option<DVector<f64>> {
        let at = from.moment(y)?;
        let rods = (0..self.rods.len()).map(|k| self.motions_from(from, &at, k));
        let mut state = self.state(&from.motions(&at), &rods.collect::<Vec<_>>());
        let (old, new) = (from.time(), self.time());
        for i in 0..INTEGRALS {
            state[new + i] = y[old + i];
        }
        Some(state)
    }

    /// Motions of the nodes of rod `k`, from a state on the mesh of `from`.
    fn motions_from(&self, from: &Self, at: &ElementMoment, k: usize) -> Vec<BodyMotion> {
        let nodes = &at.nodes[k];
        if self.rods[k].places == from.rods[k].places {
            return nodes.iter().map(NodeNow::motion).collect();
        }
        let made = self.places_from(from, nodes, k);
        let motions = made.iter().zip(&self.rods[k].places);
        motions
            .map(|(place, s)| BodyMotion {
                pose: Isometry3::from_parts(place.position.into(), unit(&place.turn)),
                twist: from.twist_at(at, k, *s),
            })
            .collect()
    }

    /// Places of the nodes of rod `k`, from the `nodes` on the mesh of `from`.
    fn places_from(&self, from: &Self, nodes: &[NodeNow], k: usize) -> Vec<SectionPlace> {
        let (rod, old) = (&self.rods[k], &from.rods[k]);
        let place = |node: &NodeNow| SectionPlace {
            position: node.position,
            turn: node.turn,
        };
        let mut made = vec![place(&nodes[0])];
        for element in &old.elements {
            let inside = made.len()..rod.places.partition_point(|s| *s <= element.to + 1e-12);
            let (first, base) = (place(&nodes[element.nodes.start]), made[made.len() - 1]);
            if inside.len() + 1 == element.nodes.len() {
                let rest = nodes[element.nodes.clone()].iter().skip(1);
                made.extend(rest.map(|node| base.carrying(&first, &place(node))));
                continue;
            }
            let over = 1.0 / old.length(element);
            let own = &nodes[element.nodes.clone()];
            let table = &*from.table;
            let strains: Vec<Strain> = (table.values.iter().zip(&table.slopes))
                .map(|(values, slopes)| Point::strain(&point(own, values, slopes, over)))
                .collect();
            let strain = |s: f64| {
                let x = (s - element.from) / (element.to - element.from);
                let values = super::sample::lagrange(&table.points, x);
                strains
                    .iter()
                    .zip(values)
                    .fold(Strain::zeros(), |sum, (e, value)| sum + e * value)
            };
            let halves = rod
                .elements
                .iter()
                .filter(|half| inside.contains(&(half.nodes.start + 1)));
            for half in halves {
                let base = made[made.len() - 1];
                made.extend(self.places_in_half(base, half, rod, &strain));
            }
        }
        if old.is_held {
            close(&mut made, &place(&nodes[nodes.len() - 1]), &rod.places);
        }
        made
    }
}

impl ElementAssembly {
    /// Places of the nodes of an element after the first, which is `base`, with the strains given at arclengths in
    /// parts of the rod. Rotations at the nodes are integrated. Positions have the given v at the Gauss points.
    fn places_in_half(
        &self,
        base: SectionPlace,
        half: &RodElement,
        rod: &ElementRod,
        strain: &dyn Fn(f64) -> Strain,
    ) -> Vec<SectionPlace> {
        let length = rod.law().length();
        let mut made = vec![base];
        for i in half.nodes.clone().skip(1) {
            let (from, to) = (rod.places[i - 1], rod.places[i]);
            let h = (to - from) / STEPS as f64;
            let aside = h * 3.0_f64.sqrt() / 6.0;
            let mut turn = made[made.len() - 1].turn;
            for step in 0..STEPS {
                let middle = from + (step as f64 + 0.5) * h;
                let [one, two] = [middle - aside, middle + aside].map(|s| halves(&strain(s)).0);
                let h = h * length;
                let bent = (one + two) * (0.5 * h) + one.cross(&two) * (h * h * MAGNUS);
                turn = product(&turn, &exponential(&bent));
            }
            made.push(SectionPlace { turn, ..base });
        }
        let table = &*self.table;
        let degree = made.len() - 1;
        let slopes = DMatrix::from_fn(table.points.len(), degree, |g, i| table.slopes[g][i + 1]);
        let mut tangents = DMatrix::zeros(table.points.len(), 3);
        for (g, x) in table.points.iter().enumerate() {
            let turn = made.iter().zip(&table.values[g]);
            let turn = turn.fold(Turn::zeros(), |sum, (place, value)| {
                sum + place.turn * *value
            });
            let v = halves(&strain(half.from + (half.to - half.from) * x)).1;
            let tangent = frame(&(turn / turn.norm())) * v * rod.length(half);
            tangents.set_row(g, &tangent.transpose());
        }
        // Positions less that of the first node, whose polynomial has the tangents at the Gauss points.
        if let Some(offsets) = slopes.lu().solve(&tangents) {
            for (place, offset) in made[1..].iter_mut().zip(offsets.row_iter()) {
                place.position += offset.transpose();
            }
        }
        made.split_off(1)
    }
}

/// Moves the last place to `end`, and the others by a screw that grows along the rod.
fn close(made: &mut [SectionPlace], end: &SectionPlace, places: &[f64]) {
    let last = made[made.len() - 1];
    let angle = unit(&product(&end.turn, &conjugate(&last.turn))).scaled_axis();
    let shift = end.position - last.position;
    // Translation of the screw for which the end of the rod moves by the shift.
    let arm = last.position - made[0].position;
    let turned = frame(&exponential(&angle)) * arm - arm;
    let along = inverse_left_jacobian(&angle) * (shift - turned);
    let base = made[0].position;
    for (place, s) in made.iter_mut().zip(places) {
        let part = angle * *s;
        let arm = place.position - base;
        let turn = exponential(&part);
        place.position = base + frame(&turn) * arm + left_jacobian(&part) * along * *s;
        place.turn = product(&turn, &place.turn);
    }
}
