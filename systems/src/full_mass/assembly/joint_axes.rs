//! Freedoms of joints: turns about axes and slides along directions, between an attachment and the end of a rod.
//!
//! An attachment moves with the spin w, the velocity v, and the accelerations alpha and A. A turn by y about the axis a
//! and a slide by y along the direction e, both carried by the attachment, add (l = e y)
//! ```text
//! turn:   w + a y',                      alpha + w x a y' + a y'',
//! slide:  v + w x l + e y',              A + alpha x l + w x (w x l) + 2 w x e y' + e y''.
//! ```
//! The freedoms of a joint follow each other. The last one carries the end of the rod.

use super::attachment_kinematics::{Seat, SeatLinear};
use super::{HeavyAssembly, HeavyState};
use crate::assembly::FreeAxis;
use crate::math::se3::{halves, join};
use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

/// A freedom of a joint at one moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct AxisNow {
    /// Axis and law.
    pub axis: FreeAxis,
    /// Index of its rate among the velocities.
    pub velocity: usize,
    /// Coordinate.
    pub at: f64,
    /// Rate of the coordinate.
    pub rate: f64,
}

impl AxisNow {
    /// True for a turn.
    pub fn turns(&self) -> bool {
        self.axis.turns
    }

    /// Axis or direction in the world; `before` is the attachment without this freedom.
    pub fn along(&self, before: &Seat) -> Vector3<f64> {
        before.pose.rotation * self.axis.along.into_inner()
    }
}

impl Seat {
    /// The attachment with one freedom more.
    pub fn freed(self, axis: AxisNow) -> Self {
        let along = axis.along(&self);
        let mut seat = self.clone();
        let spin = halves(&self.twist).0;
        let z = axis.velocity;
        if axis.turns() {
            seat.pose.rotation *= UnitQuaternion::from_axis_angle(&axis.axis.along, axis.at);
            seat.pose.rotation.renormalize();
            seat.twist += join(&(along * axis.rate), &Vector3::zeros());
            seat.bias += join(&(spin.cross(&along) * axis.rate), &Vector3::zeros());
            seat.by.fixed_view_mut::<3, 1>(0, z).copy_from(&along);
        } else {
            let shift = along * axis.at;
            let lever = |of: &Vector3<f64>| join(&Vector3::zeros(), &of.cross(&shift));
            seat.pose.translation.vector += shift;
            seat.twist += lever(&spin) + join(&Vector3::zeros(), &(along * axis.rate));
            seat.driven += lever(&halves(&self.driven).0);
            let drawn = spin.cross(&(spin.cross(&shift) + along * (2.0 * axis.rate)));
            seat.bias += lever(&halves(&self.bias).0) + join(&Vector3::zeros(), &drawn);
            let carried = shift.cross_matrix() * self.by.fixed_rows::<3>(0);
            let mut rows = seat.by.fixed_rows_mut::<3>(3);
            rows -= carried;
            seat.by.fixed_view_mut::<3, 1>(3, z).copy_from(&along);
        }
        seat.freed.push((axis, self));
        seat
    }
}

impl SeatLinear {
    /// Adds a freedom: the derivatives of twist and acceleration as in the head of this file.
    pub fn free(&mut self, axis: &AxisNow, before: &Seat, faster: &DVector<f64>) {
        let Self {
            twist_by_place: twist,
            by_place: place,
            by_velocity: velocity,
        } = self;
        let along = axis.along(before);
        let z = axis.velocity;
        let spin = halves(&before.twist).0.cross_matrix();
        let spins = before.by.fixed_rows::<3>(0).into_owned();
        let top = |m: &DMatrix<f64>| m.fixed_rows::<3>(0).into_owned();
        let add = |to: &mut DMatrix<f64>, row: usize, block| {
            let mut rows = to.fixed_rows_mut::<3>(row);
            rows += block;
        };
        let add_column = |to: &mut DMatrix<f64>, row: usize, v: Vector3<f64>| {
            let mut column = to.fixed_view_mut::<3, 1>(row, z);
            column += v;
        };
        // Change of the axis as the attachment turns.
        let turned = -along.cross_matrix() * &spins;
        let (rate, second) = (axis.rate, faster[z]);
        if axis.turns() {
            let by_twist = -along.cross_matrix() * top(twist);
            add(
                place,
                0,
                &turned * second + (by_twist + spin * &turned) * rate,
            );
            add(velocity, 0, &turned * rate);
            add_column(velocity, 0, spin * along);
            add(twist, 0, turned * rate);
            return;
        }
        let shift = along * axis.at;
        let (arm, alpha) = (shift.cross_matrix(), halves(&before.acceleration(faster)).0);
        let drawn = (spin * shift).cross_matrix() + spin * arm;
        let mut shifted = -arm * &spins;
        let mut column = shifted.fixed_view_mut::<3, 1>(0, z);
        column += along;
        let spun = top(twist);
        let centripetal = (alpha.cross_matrix() + spin * spin) * &shifted - drawn * &spun;
        let coriolis = (spin * &turned - along.cross_matrix() * &spun) * (2.0 * rate);
        let carried = -arm * top(place);
        add(
            place,
            3,
            centripetal + coriolis + &turned * second + carried,
        );
        let by_rate = -(drawn + along.cross_matrix() * (2.0 * rate)) * &spins;
        let carried = -arm * top(velocity);
        add(velocity, 3, by_rate + carried);
        add_column(velocity, 3, spin * along * 2.0);
        add(twist, 3, spin * &shifted - arm * spun + turned * rate);
    }

    /// Leaves out the rotation, which is the base's own.
    pub fn turn_alone(&mut self) {
        for m in [
            &mut self.twist_by_place,
            &mut self.by_place,
            &mut self.by_velocity,
        ] {
            m.rows_mut(0, 3).fill(0.0);
        }
    }
}

impl HeavyAssembly {
    /// Freedoms of the joint of rod `k` at its base (0) or end (1), from the numbers of a state.
    pub(super) fn axes(&self, k: usize, end: usize, numbers: &[f64]) -> Vec<AxisNow> {
        let (Some(tie), Some(first)) = (self.links[k].tie(end), self.layout.sliding[k][end]) else {
            return Vec::new();
        };
        let own = &numbers[self.layout.joints[k][end].clone()];
        let (at, rates) = own.split_at(tie.axes.len());
        let each = tie.axes.iter().zip(at.iter().zip(rates)).enumerate();
        let axes = each.map(|(i, (axis, (at, rate)))| AxisNow {
            axis: *axis,
            velocity: first + i,
            at: *at,
            rate: *rate,
        });
        axes.collect()
    }

    /// True if an axis of a joint has friction.
    pub fn has_friction_in_joints(&self) -> bool {
        let mut axes = self.ties().flat_map(|tie| &tie.axes);
        axes.any(|axis| axis.law.damping > 0.0)
    }

    /// True if a joint has axes of its own.
    pub fn has_joint_axes(&self) -> bool {
        self.ties().any(|tie| !tie.axes.is_empty())
    }
}

impl HeavyState {
    /// Freedoms of all joints.
    pub(super) fn all_axes(&self) -> impl Iterator<Item = &AxisNow> {
        let seats = self.seats.iter();
        let seats = seats.flat_map(|(from, to)| std::iter::once(from).chain(to));
        seats.flat_map(|seat| seat.freed.iter().map(|(axis, _)| axis))
    }

    /// Potential of the laws of all joints.
    pub(super) fn joint_potential(&self) -> f64 {
        self.all_axes()
            .map(|axis| axis.axis.law.potential(axis.at))
            .sum()
    }
}
