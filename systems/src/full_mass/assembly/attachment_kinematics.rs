//! Kinematics of attachments: pose, motion with the bodies, and derivatives.

use super::joint_axes::AxisNow;
use super::{AttachedTo, HeavyAssembly};
use crate::assembly::{Attachment, Body, BodyMotion};
use crate::math::se3::{halves, join, unit};
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Matrix6xX, UnitQuaternion, Vector3, Vector4, Vector6,
};

/// A body at one moment.
#[derive(Debug, Clone)]
pub(super) struct BodyNow {
    /// Pose and twist.
    pub place: BodyMotion,
    /// Twists per unit of the body's own velocities, in a groove per rate of the parameter.
    pub own: Matrix6xX<f64>,
    /// Acceleration at constant own velocities.
    pub bias: Vector6<f64>,
    /// In a groove: second derivative of the position by the parameter, and rate of the parameter.
    pub bend: Option<(Vector3<f64>, f64)>,
}

/// An attachment at one moment.
#[derive(Debug, Clone)]
pub(super) struct Seat {
    /// Pose in the world.
    pub pose: Isometry3<f64>,
    /// (angular velocity, velocity).
    pub twist: Vector6<f64>,
    /// Twist as a matrix on the velocities of bodies and bases.
    pub by: DMatrix<f64>,
    /// Acceleration at constant velocities of bodies and bases.
    pub(super) bias: Vector6<f64>,
    /// Twist prescribed by a support, for the power of the support.
    pub driven: Vector6<f64>,
    /// Number of the body, and lever from its reference point.
    on: Option<(usize, Vector3<f64>)>,
    /// Freedoms of the joint, each with the attachment before the freedom acts.
    pub freed: Vec<(AxisNow, Self)>,
    /// True for a base on a ball joint, which turns freely.
    spins: bool,
}

/// Derivatives of twist and acceleration of an attachment by displacements along the velocities, and of the
/// acceleration by the velocities.
pub(super) struct SeatLinear {
    pub twist_by_place: DMatrix<f64>,
    pub by_place: DMatrix<f64>,
    pub by_velocity: DMatrix<f64>,
}

impl BodyNow {
    /// A body from its numbers in a state.
    pub fn new(carrier: &Body, numbers: &[f64]) -> Self {
        let place = carrier.read(numbers);
        let turnings = carrier.turnings();
        let mut own = Matrix6xX::zeros(carrier.freedoms());
        for i in 0..turnings {
            own[(i, i)] = 1.0;
        }
        let (mut bias, mut bend) = (Vector6::zeros(), None);
        match carrier.groove() {
            None => {
                for i in 0..3 {
                    own[(3 + i, turnings + i)] = 1.0;
                }
            }
            Some(groove) => {
                let [_, position, _, velocity] = carrier.slots();
                let [_, along, second] = groove.at(numbers[position.start]);
                let speed = numbers[velocity.start];
                own.fixed_view_mut::<3, 1>(3, turnings).copy_from(&along);
                bias = join(&Vector3::zeros(), &(second * speed * speed));
                bend = Some((second, speed));
            }
        }
        Self {
            place,
            own,
            bias,
            bend,
        }
    }
}

/// Twists of a point at `lever` from the reference point.
fn moved(twists: &Matrix6xX<f64>, lever: &Vector3<f64>) -> Matrix6xX<f64> {
    let mut moved = twists.clone();
    for mut column in moved.column_iter_mut() {
        let spin = column.fixed_rows::<3>(0).into_owned();
        let mut shift = column.fixed_rows_mut::<3>(3);
        shift += spin.cross(lever);
    }
    moved
}

impl HeavyAssembly {
    /// An attachment with the freedoms of its joint. `turn`, for a base on a ball joint: index of its spin among the
    /// velocities, quaternion and spin.
    pub(super) fn seat(
        &self,
        t: f64,
        site: &Attachment,
        (axes, turn): (Vec<AxisNow>, Option<(usize, &[f64])>),
        bodies: &[BodyNow],
    ) -> Seat {
        let mut by = DMatrix::zeros(6, self.layout.free);
        let mut seat = match &site.on {
            AttachedTo::Ground => Seat {
                pose: site.place,
                twist: Vector6::zeros(),
                bias: Vector6::zeros(),
                driven: Vector6::zeros(),
                by,
                on: None,
                freed: Vec::new(),
                spins: false,
            },
            AttachedTo::Support(support) => {
                let frame = support.at(t);
                let lever = join(&Vector3::zeros(), &site.place.translation.vector);
                let twist = frame
                    .of_poses()
                    .absolute_velocity(&lever, &Vector6::zeros());
                Seat {
                    pose: frame.pose() * site.place,
                    twist,
                    bias: frame.of_poses().acceleration_of_fixed_point(&lever),
                    driven: twist,
                    by,
                    on: None,
                    freed: Vec::new(),
                    spins: false,
                }
            }
            AttachedTo::Body(number) => {
                let body = &bodies[*number];
                let BodyMotion { pose, twist } = &body.place;
                let lever = pose.rotation * site.place.translation.vector;
                let omega = halves(twist).0;
                by.columns_mut(self.layout.velocities[*number], body.own.ncols())
                    .copy_from(&moved(&body.own, &lever));
                let drawn = omega.cross(&omega.cross(&lever));
                Seat {
                    pose: pose * site.place,
                    twist: twist + join(&Vector3::zeros(), &omega.cross(&lever)),
                    bias: body.bias + join(&Vector3::zeros(), &drawn),
                    driven: Vector6::zeros(),
                    by,
                    on: Some((*number, lever)),
                    freed: Vec::new(),
                    spins: false,
                }
            }
        };
        for axis in axes {
            seat = seat.freed(axis);
        }
        if let Some((start, numbers)) = turn {
            seat.spins = true;
            let p = Vector4::from_column_slice(&numbers[..4]);
            seat.pose.rotation = unit(&p);
            seat.by.rows_mut(0, 3).fill(0.0);
            seat.by
                .fixed_view_mut::<3, 3>(0, start)
                .fill_with_identity();
            let none = Vector3::zeros();
            seat.bias.fixed_rows_mut::<3>(0).copy_from(&none);
            seat.driven.fixed_rows_mut::<3>(0).copy_from(&none);
            let spin = Vector3::from_column_slice(&numbers[4..7]);
            seat.twist.fixed_rows_mut::<3>(0).copy_from(&spin);
        }
        seat
    }

    /// The reference point of a body as an attachment.
    pub(super) fn body_seat(&self, number: usize, body: &BodyNow) -> Seat {
        let mut by = DMatrix::zeros(6, self.layout.free);
        by.columns_mut(self.layout.velocities[number], body.own.ncols())
            .copy_from(&body.own);
        Seat {
            pose: body.place.pose,
            twist: body.place.twist,
            by,
            bias: body.bias,
            driven: Vector6::zeros(),
            on: Some((number, Vector3::zeros())),
            freed: Vec::new(),
            spins: false,
        }
    }

    /// Derivatives of twist and acceleration of an attachment; `faster` are the accelerations of bodies and bases.
    pub(super) fn seat_linear(
        &self,
        seat: &Seat,
        bodies: &[BodyNow],
        faster: &DVector<f64>,
    ) -> SeatLinear {
        let none = || DMatrix::zeros(6, self.layout.free);
        let (mut twist, mut place, mut velocity) = (none(), none(), none());
        if let Some((number, lever)) = &seat.on {
            let body = &bodies[*number];
            let start = self.layout.velocities[*number];
            let own = body.own.ncols();
            let last = start + own - 1;
            if self.carriers[*number].turns() {
                let own = &body.own * faster.rows(start, own);
                let alpha = Vector3::new(own[0], own[1], own[2]).cross_matrix();
                let spin = halves(&body.place.twist).0;
                let (omega, arm) = (spin.cross_matrix(), lever.cross_matrix());
                let put = |into: &mut DMatrix<f64>, block: Matrix3<f64>| {
                    into.fixed_view_mut::<3, 3>(3, start).copy_from(&block);
                };
                put(&mut twist, -omega * arm);
                put(&mut place, -(alpha + omega * omega) * arm);
                put(
                    &mut velocity,
                    -(spin.cross(lever)).cross_matrix() - omega * arm,
                );
            }
            if let Some((bend, speed)) = &body.bend {
                let put = |into: &mut DMatrix<f64>, v: Vector3<f64>| {
                    into.fixed_view_mut::<3, 1>(3, last).copy_from(&v);
                };
                put(&mut twist, bend * *speed);
                put(&mut place, bend * faster[last]);
                put(&mut velocity, bend * (2.0 * speed));
            }
        }
        let mut linear = SeatLinear {
            twist_by_place: twist,
            by_place: place,
            by_velocity: velocity,
        };
        for (axis, before) in &seat.freed {
            linear.free(axis, before, faster);
        }
        if seat.spins {
            linear.turn_alone();
        }
        linear
    }

    /// Adds the derivative by displacements of the generalised force of a constant wrench at an attachment.
    pub(super) fn add_lever(
        &self,
        out: &mut DMatrix<f64>,
        seat: &Seat,
        bodies: &[BodyNow],
        wrench: &Vector6<f64>,
    ) {
        let (couple, force) = halves(wrench);
        for (axis, before) in &seat.freed {
            // d(a.m) = (phi x a).m, d(e.n) = (phi x e).n for the turn phi of the axis.
            let acts = if axis.turns() { couple } else { force };
            let turned = axis.along(before).cross(&acts).transpose() * before.by.fixed_rows::<3>(0);
            let mut row = out.row_mut(axis.velocity);
            row += turned;
        }
        let Some((number, _)) = &seat.on else {
            return;
        };
        let start = self.layout.velocities[*number];
        if self.carriers[*number].turns() {
            // d(arm x n) = d(arm) x n.
            let mut arm = seat.by.fixed_rows::<3>(3).into_owned();
            let own = bodies[*number].own.fixed_rows::<3>(3);
            let mut moved = arm.columns_mut(start, own.ncols());
            moved -= own;
            let mut block = out.fixed_rows_mut::<3>(start);
            block -= force.cross_matrix() * arm;
        }
        if let Some((bend, _)) = &bodies[*number].bend {
            let last = start + bodies[*number].own.ncols() - 1;
            out[(last, last)] += bend.dot(&force);
        }
    }
}

impl Seat {
    /// Acceleration of the attachment from those of bodies and bases.
    pub fn acceleration(&self, faster: &DVector<f64>) -> Vector6<f64> {
        &self.by * faster + self.bias
    }
}

/// Quaternion rotated by a rotation vector.
pub(super) fn turned(p: &[f64], by: &[f64]) -> [f64; 4] {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(by));
    let p = (turn * unit(&Vector4::from_column_slice(p))).into_inner();
    [p.w, p.i, p.j, p.k]
}
