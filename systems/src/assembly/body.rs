//! Bodies of an assembly: rigid bodies and point masses, free or in a groove.

use super::guide::Guide;
use crate::body::{EndMotion, Groove, Mass, PointMass, RigidBody};
use crate::error::{Error, Message, Quantity, Result};
use crate::math::se3::{halves, join, spin, unit};
use nalgebra::{DMatrix, Isometry3, Matrix3, Matrix6xX, UnitQuaternion, Vector3, Vector6};
use std::ops::Range;

/// Largest distance from the groove, and relative speed across the groove, of a body at the start.
const BESIDE: f64 = 1e-9;

/// A body of an assembly, free or with its reference point in a groove.
#[derive(Debug, Clone)]
pub struct Body {
    mass: Mass,
    groove: Option<Groove>,
    guide: Option<Guide>,
    /// True for a node, whose mass stands for none.
    massless: bool,
    name: Option<String>,
}

/// Pose and twist (angular velocity, velocity of the reference point) of a body in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyMotion {
    /// Pose of the body's frame; the rotation of a point mass is constant.
    pub pose: Isometry3<f64>,
    /// (angular velocity, velocity of the reference point).
    pub twist: Vector6<f64>,
}

impl BodyMotion {
    /// A body at rest: the given pose with zero twist.
    pub fn at_rest(pose: Isometry3<f64>) -> Self {
        Self {
            pose,
            twist: Vector6::zeros(),
        }
    }

    /// Pose and twist relative to `base`, along the directors of `base`.
    pub fn seen_from(&self, base: &Self) -> Self {
        let back = base.pose.rotation.inverse();
        let (turning, moving) = (halves(&base.twist), halves(&self.twist));
        let arm = self.pose.translation.vector - base.pose.translation.vector;
        let v = back * (moving.1 - turning.1 - turning.0.cross(&arm));
        Self {
            pose: base.pose.inv_mul(&self.pose),
            twist: join(&(back * (moving.0 - turning.0)), &v),
        }
    }
}

impl Body {
    /// A free body without a name.
    pub fn new(mass: Mass) -> Self {
        Self {
            mass,
            groove: None,
            guide: None,
            massless: false,
            name: None,
        }
    }

    /// A node without mass, free or carried by a joint.
    ///
    /// # Errors
    /// None: the unit mass in place of none is positive.
    pub fn node(joint: Option<Guide>) -> Result<Self> {
        let body = RigidBody::new(1.0, Matrix3::identity())?;
        Ok(Self {
            guide: joint,
            massless: true,
            ..Self::rigid(body)
        })
    }

    /// A node without mass. The node bears the loads of `body`; the mass of `body` has no effect.
    pub fn loaded_node(body: RigidBody) -> Self {
        Self {
            massless: true,
            ..Self::rigid(body)
        }
    }

    /// Confines the body to the motions that a guide on the ground leaves free.
    #[must_use]
    pub fn guided(mut self, guide: Guide) -> Self {
        self.guide = Some(guide);
        self
    }

    /// Guide of the body or node.
    pub fn guide(&self) -> Option<&Guide> {
        self.guide.as_ref()
    }

    /// True for a node without mass.
    pub fn is_massless(&self) -> bool {
        self.massless
    }

    /// Joint that carries the node; `None` for bodies, and for nodes held by rods alone.
    pub fn joint(&self) -> Option<&Guide> {
        self.guide.as_ref().filter(|guide| !guide.is_plane())
    }

    /// A rigid body.
    pub fn rigid(body: RigidBody) -> Self {
        Self::new(Mass::Rigid(body))
    }

    /// A point mass.
    pub fn point(body: PointMass<3>) -> Self {
        Self::new(Mass::Point(body))
    }

    /// Constrains the reference point to a groove of the world, without friction; a rigid body turns freely about the
    /// point.
    #[must_use]
    pub fn in_groove(mut self, groove: Groove) -> Self {
        self.groove = Some(groove);
        self
    }

    /// The body seen from clamps fixed at their poses of time `t`.
    #[must_use]
    pub fn standing_at(mut self, t: f64) -> Self {
        self.mass = self.mass.standing_at(t);
        self
    }

    /// The body at rest under the loads of time `t`, with a share of those without a potential
    /// ([`RigidBody::with_share_of_driving`]).
    ///
    /// # Errors
    /// A share that is not finite.
    pub fn with_share_of_driving(mut self, t: f64, share: f64) -> Result<Self> {
        if let Mass::Rigid(body) = self.mass {
            self.mass = Mass::Rigid(body.with_share_of_driving(t, share)?);
        }
        Ok(self)
    }

    /// Names the body for messages; the default label is its number.
    #[must_use]
    pub fn named(mut self, name: String) -> Self {
        self.name = Some(name);
        self
    }

    /// Name of the body, if given.
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Label in messages of the body at index `place` of a list.
    pub fn called(&self, place: usize) -> String {
        match &self.name {
            Some(name) if self.joint().is_some() => name.clone(),
            Some(name) => format!("body {name:?}"),
            None => format!("body {place}"),
        }
    }

    /// The mass with its loads.
    pub fn mass(&self) -> &Mass {
        &self.mass
    }

    /// Groove of the reference point.
    pub fn groove(&self) -> Option<&Groove> {
        self.groove.as_ref()
    }

    /// True for a rigid body, which has directors.
    pub fn turns(&self) -> bool {
        self.mass.turns()
    }

    /// Number of rotational velocities.
    pub(crate) fn turnings(&self) -> usize {
        match &self.guide {
            Some(guide) => guide.turnings(),
            None if self.turns() => 3,
            None => 0,
        }
    }

    /// Number of translational velocities.
    pub(crate) fn shiftings(&self) -> usize {
        match &self.guide {
            Some(guide) => guide.shiftings(),
            None if self.groove.is_some() => 1,
            None => 3,
        }
    }

    /// Number of velocities: 3 of rotation for a rigid body, plus 3 of translation, or 1 along a groove.
    pub fn freedoms(&self) -> usize {
        self.turnings() + self.shiftings()
    }

    /// Count of state components of the body: quaternion (w, x, y, z) of a rigid body, position or groove parameter,
    /// and their rates. The node of a joint has the joint's coordinates alone, another node no rates.
    pub fn numbers(&self) -> usize {
        if self.joint().is_some() {
            return self.freedoms();
        }
        self.slots()[3].end
    }

    /// Index ranges of quaternion, position (or parameter), spin and velocity within the body's part of a state.
    pub(crate) fn slots(&self) -> [Range<usize>; 4] {
        let (turnings, shiftings) = (self.turnings(), self.shiftings());
        let mut next = 0;
        let quaternion = turnings + usize::from(self.turns());
        let [spin, velocity] = if self.massless {
            [0, 0]
        } else {
            [turnings, shiftings]
        };
        [quaternion, shiftings, spin, velocity].map(|size| {
            next += size;
            next - size..next
        })
    }

    /// Reads pose and twist from the body's part of a state.
    pub fn read(&self, state: &[f64]) -> BodyMotion {
        let [quaternion, position, spin, velocity] = self.slots().map(|slots| &state[slots]);
        let turn = match quaternion {
            [w, x, y, z] => unit(&[*w, *x, *y, *z].into()),
            _ => UnitQuaternion::identity(),
        };
        let vector = |x: &[f64]| match x {
            [] => Vector3::zeros(),
            x => Vector3::from_column_slice(x),
        };
        let spin = vector(spin);
        let (r, v) = match &self.groove {
            None => (Vector3::from_column_slice(position), vector(velocity)),
            Some(groove) => {
                let [x, along, _] = groove.at(position[0]);
                (x, along * velocity[0])
            }
        };
        BodyMotion {
            pose: Isometry3::from_parts(r.into(), turn),
            twist: join(&spin, &v),
        }
    }

    /// Writes pose and twist into the body's part of a state; in a groove, the nearest point and the speed along it.
    pub fn write(&self, place: &BodyMotion, state: &mut [f64]) {
        let [quaternion, position, spin, velocity] = self.slots();
        let r = &place.pose.translation.vector;
        let (omega, v) = halves(&place.twist);
        if self.turns() {
            let p = place.pose.rotation.quaternion();
            state[quaternion].copy_from_slice(&[p.w, p.i, p.j, p.k]);
            state[spin.clone()].copy_from_slice(&omega.as_slice()[..spin.len()]);
        }
        match &self.groove {
            None => {
                state[position].copy_from_slice(r.as_slice());
                state[velocity.clone()].copy_from_slice(&v.as_slice()[..velocity.len()]);
            }
            Some(groove) => {
                let phi = groove.nearest(r);
                let along = groove.at(phi)[1];
                state[position].copy_from_slice(&[phi]);
                state[velocity].copy_from_slice(&[along.dot(&v) / along.norm_squared()]);
            }
        }
    }

    /// Distance of `place` from the groove, speed away from the groove, and unit tangent of the groove there; zeros
    /// for a free body.
    pub fn beside_groove(&self, place: &BodyMotion) -> (f64, f64, Vector3<f64>) {
        let Some(groove) = &self.groove else {
            return (0.0, 0.0, Vector3::zeros());
        };
        let (r, v) = (place.pose.translation.vector, halves(&place.twist).1);
        let [x, along, _] = groove.at(groove.nearest(&r));
        let along = along.normalize();
        ((x - r).norm(), (v - along * along.dot(&v)).norm(), along)
    }

    /// Checks that bodies in grooves start on them, with velocities along them.
    ///
    /// # Errors
    /// A body off its groove, or with a velocity across it.
    pub fn start_in_grooves(carriers: &[Self], places: &[BodyMotion]) -> Result<()> {
        for (body, (carrier, place)) in carriers.iter().zip(places).enumerate() {
            let (beside, leaving, along) = carrier.beside_groove(place);
            let speed = halves(&place.twist).1.norm();
            if !(beside <= BESIDE && leaving <= BESIDE * (1.0 + speed)) {
                let starts = Message::from(Self::told(carriers, body)).words(" starts ");
                let place = if beside <= BESIDE {
                    starts.words("in")
                } else {
                    starts.size(beside, Quantity::Length).words(" beside")
                };
                let told = (place.words(" its groove and would leave it at the speed "))
                    .size(leaving, Quantity::Velocity)
                    .words(": start it in the groove, with a velocity along it, a multiple of ")
                    .list(along.as_slice(), |_| Quantity::Ratio);
                return Err(Error::domain(told));
            }
        }
        Ok(())
    }

    /// Checks that no body has left its groove past an end, where nothing constrains it.
    ///
    /// # Errors
    /// A body past an end of its groove.
    pub fn within_ends(carriers: &[Self], places: &[BodyMotion]) -> Result<()> {
        for (body, (carrier, place)) in carriers.iter().zip(places).enumerate() {
            let (r, groove) = (&place.pose.translation.vector, carrier.groove.as_ref());
            let Some(way) = groove.and_then(|groove| groove.way_out(groove.nearest(r))) else {
                continue;
            };
            if !(carrier.beside_groove(place).0 <= BESIDE) {
                let end = if way < 0.0 { "first" } else { "last" };
                return Err(Error::no_convergence(format!(
                    "{} is pushed out over the {end} point of its groove, beyond which nothing holds it; make the groove longer, close it, or \
                     lower the loads along it",
                    Self::told(carriers, body)
                )));
            }
        }
        Ok(())
    }

    /// Label of a body in messages, by number.
    fn told(carriers: &[Self], body: usize) -> String {
        match carriers {
            [Self { name: None, .. }] => "the body".to_owned(),
            _ => carriers[body].called(body),
        }
    }

    /// True if the body stands at an end of its groove and leaves it: by moving outward, or from rest under an
    /// outward acceleration above `least`.
    pub(crate) fn leaves_groove(&self, state: &[f64], slope: &[f64], least: f64) -> bool {
        let [_, position, _, velocity] = self.slots();
        let groove = self.groove.as_ref();
        let way = groove.and_then(|groove| groove.way_out(state[position.start]));
        way.is_some_and(|way| {
            let (speed, pushed) = (state[velocity.start], slope[velocity.start]);
            way * speed > 0.0 || speed == 0.0 && way * pushed > least
        })
    }

    /// Groove parameter and its rate, from the body's part of a state.
    pub(crate) fn parameter(&self, state: &[f64]) -> Option<[f64; 2]> {
        let [_, phi, _, rate] = self.slots();
        (self.groove.as_ref()).map(|_| [state[phi.start], state[rate.start]])
    }

    /// True if the body has no groove.
    pub(super) fn is_free(&self) -> bool {
        self.groove.is_none()
    }

    /// Writes the rates of the body's part `state` of a state at time `t` into `out`, times `rate`. `wrench` is that
    /// of its rods about the reference point in the world. Returns the power of time-dependent loads and the loss by
    /// drag.
    pub fn write_rates(
        &self,
        t: f64,
        state: &[f64],
        wrench: &Vector6<f64>,
        rate: f64,
        out: &mut [f64],
    ) -> (f64, f64) {
        let place = self.read(state);
        let [quaternion, position, spinning, velocity] = self.slots();
        let mut motion = self.free_motion(t, &place, wrench);
        match &self.groove {
            None => {
                for (i, j) in position.zip(velocity) {
                    out[i] = state[j] * rate;
                    out[j] = motion.acceleration[3 + i - quaternion.end] * rate;
                }
            }
            Some(groove) => {
                let (phi, speed) = (state[position.start], state[velocity.start]);
                let held = self.held(&groove.at(phi), speed, &place.pose, &motion);
                motion.acceleration = held.acceleration;
                out[position.start] = speed * rate;
                out[velocity.start] = held.along * rate;
            }
        }
        if self.turns() {
            let p = nalgebra::Vector4::from_column_slice(&state[quaternion.clone()]);
            let omega = Vector3::from_column_slice(&state[spinning.clone()]);
            // p_t = p (body omega)/2: the body's angular velocity along its own axes is the world's, rotated back.
            let turned = unit(&p).inverse() * omega;
            out[quaternion].copy_from_slice((spin(&p, &turned) * rate).as_slice());
            let angular = motion.acceleration.fixed_rows::<3>(0) * rate;
            out[spinning].copy_from_slice(angular.as_slice());
        }
        (motion.power, motion.loss)
    }

    /// Constraint force of the groove under the wrench of the rods.
    pub fn groove_force(
        &self,
        t: f64,
        place: &BodyMotion,
        wrench: &Vector6<f64>,
    ) -> Option<Vector3<f64>> {
        let groove = self.groove.as_ref()?;
        let jet = groove.at(groove.nearest(&place.pose.translation.vector));
        let v = halves(&place.twist).1;
        let speed = jet[1].dot(&v) / jet[1].norm_squared();
        let motion = self.free_motion(t, place, wrench);
        Some(self.held(&jet, speed, &place.pose, &motion).force)
    }

    /// Motion of the body under the wrench of the rods about the reference point in the world.
    pub fn motion(&self, t: f64, place: &BodyMotion, wrench: &Vector6<f64>) -> EndMotion<6> {
        match self.groove_force(t, place, wrench) {
            None => self.free_motion(t, place, wrench),
            Some(force) => {
                let held = wrench + join(&Vector3::zeros(), &force);
                self.free_motion(t, place, &held)
            }
        }
    }

    /// Motion without the groove's constraint.
    fn free_motion(&self, t: f64, place: &BodyMotion, wrench: &Vector6<f64>) -> EndMotion<6> {
        self.mass.motion(t, &place.pose, &place.twist, wrench)
    }

    /// Constraint of the groove on the unconstrained motion `free`, theory 3.5. `jet` is x, x_phi, x_phiphi, `speed`
    /// phi'.
    fn held(
        &self,
        jet: &[Vector3<f64>; 3],
        speed: f64,
        pose: &Isometry3<f64>,
        free: &EndMotion<6>,
    ) -> GrooveReaction {
        let [_, along, bend] = jet;
        let (spin, v) = halves(&free.acceleration);
        let missing = v - bend * (speed * speed);
        let [give, turn] = self.mass.by_impulse(&pose.rotation);
        // Positive definite.
        let weight = give.try_inverse().unwrap_or_default();
        let weighted = weight * along;
        let phi = weighted.dot(&missing) / weighted.dot(along);
        let force = weight * (along * phi - missing);
        GrooveReaction {
            along: phi,
            force,
            acceleration: join(
                &(spin + turn * force),
                &(along * phi + bend * (speed * speed)),
            ),
        }
    }

    /// Twists of the reference point per unit of the body's own velocities; in a groove the last is the speed along
    /// the groove. Those of a guided body are [`Guide::twists`].
    pub(super) fn free_twists(&self, pose: &Isometry3<f64>) -> Matrix6xX<f64> {
        let turnings = self.turnings();
        let mut twists = Matrix6xX::zeros(self.freedoms());
        for i in 0..turnings {
            twists[(i, i)] = 1.0;
        }
        match self.tangent(pose) {
            None => {
                for i in 0..3 {
                    twists[(3 + i, turnings + i)] = 1.0;
                }
            }
            Some((tangent, _)) => twists
                .fixed_view_mut::<3, 1>(3, turnings)
                .copy_from(&tangent),
        }
        twists
    }

    /// Unit tangent of the groove, and its derivative by arclength.
    pub(super) fn tangent(&self, pose: &Isometry3<f64>) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let groove = self.groove.as_ref()?;
        let [_, along, bend] = groove.at(groove.nearest(&pose.translation.vector));
        let tangent = along.normalize();
        let across = bend - tangent * tangent.dot(&bend);
        Some((tangent, across / along.norm_squared()))
    }

    /// The pose as far as the body can take it: without a turn for a point mass, in the groove, in the plane.
    pub(crate) fn confined(&self, mut pose: Isometry3<f64>) -> Isometry3<f64> {
        if !self.turns() {
            pose.rotation = UnitQuaternion::identity();
        }
        if let Some(groove) = &self.groove {
            pose.translation.vector = groove.at(groove.nearest(&pose.translation.vector))[0];
        }
        match self.guide().filter(|guide| guide.is_plane()) {
            Some(plane) => {
                let frame = plane.frame(0.0, &[]);
                plane.pose(&frame, &plane.coordinates(&frame, &pose))
            }
            None => pose,
        }
    }

    /// Length along a groove from one pose to another: difference of the parameters times |x_phi| at the first.
    pub(super) fn slid(&self, from: &Isometry3<f64>, to: &Isometry3<f64>) -> Option<f64> {
        let groove = self.groove.as_ref()?;
        let [a, b] = [from, to].map(|pose| groove.nearest(&pose.translation.vector));
        Some(groove.shorter_way(a, b) * groove.at(a)[1].norm())
    }

    /// |x_phi| of the groove at a pose over that at another; 1 of a free body.
    pub(super) fn stretch(&self, from: &Isometry3<f64>, to: &Isometry3<f64>) -> f64 {
        let Some(groove) = &self.groove else {
            return 1.0;
        };
        let [a, b] =
            [from, to].map(|pose| groove.at(groove.nearest(&pose.translation.vector))[1].norm());
        b / a
    }

    /// Mass matrix, and minus the stiffness and the damping of the loads, in the body's own velocities; `wrench` is
    /// that of the rods, `own` are the twists per unit of these velocities. None for a body without inertia.
    pub(super) fn linear_own(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        wrench: &Vector6<f64>,
        own: &Matrix6xX<f64>,
    ) -> Option<[DMatrix<f64>; 3]> {
        let mut wrench = *wrench;
        let force = halves(&(wrench + self.load(t, pose))).1;
        if let Some((tangent, _)) = self.tangent(pose) {
            // The groove bears all force across its tangent; the remaining force vanishes at an equilibrium.
            let borne = tangent * tangent.dot(&force) - force;
            wrench += join(&Vector3::zeros(), &borne);
        }
        let [by_pose, by_velocity, by_wrench] = self.mass.linear_at_rest(t, pose, &wrench);
        let mass = if self.massless {
            by_wrench * 0.0
        } else {
            by_wrench.try_inverse()?
        };
        let own = own.rows(6 - mass.nrows(), mass.nrows());
        let mut projected =
            [&mass, &(&mass * by_pose), &(&mass * by_velocity)].map(|m| own.transpose() * m * own);
        if let Some((_, bend)) = self.tangent(pose) {
            let last = self.turnings();
            projected[1][(last, last)] += bend.dot(&force);
        }
        Some(projected)
    }

    /// Wrench of the loads about the reference point, for a body at rest.
    pub fn load(&self, t: f64, pose: &Isometry3<f64>) -> Vector6<f64> {
        self.mass.load(t, pose)
    }

    /// True if a load at time `t` turns with the body.
    pub fn is_followed(&self, t: f64) -> bool {
        self.mass.is_followed(t)
    }

    /// True if the loads at time `t`, held as they are then, have a potential.
    pub fn is_conservative(&self, t: f64) -> bool {
        self.mass.is_conservative(t)
    }

    /// Kinetic energy.
    pub fn kinetic(&self, t: f64, place: &BodyMotion) -> f64 {
        self.mass.kinetic(t, &place.pose, &place.twist)
    }

    /// Potential of the constant forces.
    pub fn potential(&self, t: f64, pose: &Isometry3<f64>) -> f64 {
        self.mass.potential(t, pose)
    }

    /// The first break of the loads after `t`.
    pub fn next_break(&self, t: f64) -> f64 {
        self.mass.next_break(t)
    }

    /// The pose displaced by the body's own velocities: rotated about the reference point, then shifted, in a groove
    /// by its parameter.
    pub fn moved(&self, pose: &Isometry3<f64>, own: &[f64]) -> Isometry3<f64> {
        let mut moved = *pose;
        let (turn, shift) = own.split_at(self.turnings());
        match &self.groove {
            None => moved.translation.vector += Vector3::from_column_slice(shift),
            Some(groove) => {
                let phi = groove.nearest(&pose.translation.vector);
                let further = phi + shift[0] / groove.at(phi)[1].norm();
                moved.translation.vector = groove.at(further)[0];
            }
        }
        if self.turns() {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(turn));
            moved.rotation = turn * moved.rotation;
            moved.rotation.renormalize();
        }
        moved
    }
}

/// Effect of a groove on the motion.
struct GrooveReaction {
    /// phi''.
    along: f64,
    /// The force of the groove.
    force: Vector3<f64>,
    /// (angular acceleration, acceleration of the reference point).
    acceleration: Vector6<f64>,
}
