//! Joints with axes between the end of a rod in elements and its attachment.
//!
//! Such an end has a rotation of its own, and a position of its own where the joint slides. Stiff springs hold what the
//! joint does not leave free. Of axes, a is along the attachment, b and c along the end; d is the shift, e a direction:
//! ```text
//! one axis:      V = k |a - c|^2/2       the same axis seen from both
//! two axes:      V = k (a . b)^2/2       the first along the attachment, the second along the end
//! slides:        V = k |d - e (e . d)|^2/2
//! ```
//! A hinge across the plane of a motion needs no spring: there the freedoms are exact.

use super::system::NodeNow;
use super::{ElementNode, GIVE};
use crate::assembly::FreeAxis;
use crate::math::difference::derivative;
use crate::math::se3::{conjugate, exponential, frame, join, product};
use nalgebra::{Matrix6, Vector3, Vector6};

/// Step of the differences, in radians and lengths of the rod.
const STEP: f64 = 1e-3;

/// A joint with axes at an end of a rod.
#[derive(Debug, Clone)]
pub(super) struct AxisJoint {
    /// The place of the joint on the attachment.
    pub holder: ElementNode,
    /// Rod and node that the joint carries.
    pub rod: usize,
    pub node: usize,
    turns: Vec<FreeAxis>,
    slides: Vec<FreeAxis>,
    /// Springs of rotations and of positions.
    springs: [f64; 2],
    length: f64,
}

/// Wrenches, energy and loss of a joint at one moment.
#[derive(Debug, Clone)]
pub(super) struct JointAction {
    /// (couple, force) on the holder and on the end of the rod.
    pub wrenches: [Vector6<f64>; 2],
    /// Energy of the springs that hold, potential of the laws of the axes, loss to friction, power of constant couples.
    pub held: f64,
    /// Largest give of the springs, in radians and lengths of the rod.
    pub give: f64,
    pub potential: f64,
    pub loss: f64,
    pub power: f64,
}

/// Derivatives of minus the wrenches by displacements and velocities, for pairs of holder (0) and end (1).
pub(super) struct JointStiffness {
    pub place: [[Matrix6<f64>; 2]; 2],
    pub velocity: [[Matrix6<f64>; 2]; 2],
}

impl AxisJoint {
    /// The joint of the axes `axes` on `holder`. `bending` is the bending stiffness of the rod, `length` its length.
    pub fn new(
        holder: ElementNode,
        (rod, node): (usize, usize),
        axes: &[FreeAxis],
        (bending, length): (f64, f64),
    ) -> Self {
        let (turns, slides) = axes.iter().partition(|axis| axis.turns);
        Self {
            holder,
            rod,
            node,
            turns,
            slides,
            springs: [1, 3].map(|power| bending / (GIVE * length.powi(power))),
            length,
        }
    }

    /// Makes the springs stiffer.
    pub fn stiffen(&mut self, factor: f64) {
        self.springs.iter_mut().for_each(|spring| *spring *= factor);
    }

    /// Wrenches and energies of the joint, from the motions of holder and end.
    pub fn action(&self, [holder, end]: [&NodeNow; 2]) -> JointAction {
        let mut action = JointAction {
            wrenches: [Vector6::zeros(); 2],
            held: 0.0,
            give: 0.0,
            potential: 0.0,
            loss: 0.0,
            power: 0.0,
        };
        let directors = [holder, end].map(|node| frame(&node.turn));
        let relative = product(&conjugate(&holder.turn), &end.turn);
        let spin = end.spin - holder.spin;
        let [turning, shifting] = self.springs;
        let mut couple = Vector3::zeros();
        let along = |i: usize, axis: usize| directors[i] * self.turns[axis].along.into_inner();
        let vector = Vector3::new(relative[1], relative[2], relative[3]);
        // Angles and axes of the turns; the couples that hold the axes together.
        let mut angles: [(f64, Vector3<f64>); 2] = [(0.0, Vector3::zeros()); 2];
        match self.turns.as_slice() {
            [] => {}
            [axis] => {
                let (a, c) = (along(0, 0), along(1, 0));
                action.give = (a - c).norm();
                action.held += 0.5 * turning * (a - c).norm_squared();
                couple += c.cross(&a) * turning;
                angles[0] = (2.0 * axis.along.dot(&vector).atan2(relative[0]), c);
            }
            _ => {
                let (a, b) = (along(0, 0), along(1, 1));
                let oblique = a.dot(&b);
                action.give = oblique.abs();
                action.held += 0.5 * turning * oblique * oblique;
                couple -= b.cross(&a) * (turning * oblique);
                let (a_end, b_holder) = (along(1, 0), along(0, 1));
                angles[0] = (a.dot(&b_holder.cross(&b)).atan2(b_holder.dot(&b)), a);
                angles[1] = (-b.dot(&a_end.cross(&a)).atan2(a_end.dot(&a)), b);
            }
        }
        for (axis, (angle, along)) in self.turns.iter().zip(angles) {
            let (law, rate) = (axis.law, along.dot(&spin));
            // Angles start again after half a turn: what a constant couple does is work.
            let apart = nearest(angle - law.rest);
            couple += along * (law.couple - law.stiffness * apart - law.damping * rate);
            action.potential += 0.5 * law.stiffness * apart * apart;
            action.loss += law.damping * rate * rate;
            action.power += law.couple * rate;
        }
        let mut force = Vector3::zeros();
        let apart = end.position - holder.position;
        if !self.slides.is_empty() {
            let moving = end.velocity - holder.velocity - holder.spin.cross(&apart);
            let mut beside = apart;
            for axis in &self.slides {
                let along = directors[0] * axis.along.into_inner();
                let (law, shift, rate) = (axis.law, along.dot(&apart), along.dot(&moving));
                beside -= along * shift;
                force += along * (law.at(shift) - law.damping * rate);
                action.potential += law.potential(shift);
                action.loss += law.damping * rate * rate;
            }
            action.give = action.give.max(beside.norm() / self.length);
            action.held += 0.5 * shifting * beside.norm_squared();
            force -= beside * shifting;
        }
        action.wrenches = [
            join(&(-couple - apart.cross(&force)), &-force),
            join(&couple, &force),
        ];
        action
    }

    /// Derivatives of minus the wrenches.
    pub fn stiffness(&self, nodes: [&NodeNow; 2]) -> Option<JointStiffness> {
        let none = [[Matrix6::zeros(); 2]; 2];
        let mut found = JointStiffness {
            place: none,
            velocity: none,
        };
        let wrenches = |at: [&NodeNow; 2]| -> nalgebra::SVector<f64, 12> {
            let [holder, end] = self.action(at).wrenches;
            nalgebra::SVector::from_iterator(holder.iter().chain(&end).copied())
        };
        for (j, own) in nodes.into_iter().enumerate() {
            for k in 0..6 {
                let with = |changed: &NodeNow| match j {
                    0 => wrenches([changed, nodes[1]]),
                    _ => wrenches([nodes[0], changed]),
                };
                let unit = if k < 3 { STEP } else { STEP * self.length };
                let by_place = derivative(unit, |h| {
                    Some(with(&displaced(own, k, -h)) - with(&displaced(own, k, h)))
                })?;
                // The wrenches are linear in the velocities.
                let by_velocity = (with(&faster(own, k, -1.0)) - with(&faster(own, k, 1.0))) * 0.5;
                for i in 0..2 {
                    let column = by_place.fixed_rows::<6>(6 * i);
                    found.place[i][j].column_mut(k).copy_from(&column);
                    let column = by_velocity.fixed_rows::<6>(6 * i);
                    found.velocity[i][j].column_mut(k).copy_from(&column);
                }
            }
        }
        Some(found)
    }
}

/// The node turned about, or moved along, an axis of the world.
fn displaced(node: &NodeNow, k: usize, by: f64) -> NodeNow {
    let mut moved = *node;
    if k < 3 {
        moved.turn = product(&exponential(&Vector3::ith(k, by)), &node.turn);
    } else {
        moved.position[k - 3] += by;
    }
    moved
}

/// The node with a component of its twist changed.
fn faster(node: &NodeNow, k: usize, by: f64) -> NodeNow {
    let mut moved = *node;
    if k < 3 {
        moved.spin[k] += by;
    } else {
        moved.velocity[k - 3] += by;
    }
    moved
}

/// The angle less full turns.
fn nearest(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}
