//! A rigid body welded to the rod's end: AMV (2.15)-(2.17).

use super::load_function::{LoadSlopes, first_break_of};
use super::{
    BodyState, BodyWrench, EndBody, EndLinear, EndMotion, Frame, History, LoadFunction, PointMass,
    Support, TimeLoad, check_drag, check_vector, first_break, sum_at,
};
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use nalgebra::{Isometry3, Matrix3, Matrix6, Rotation3, Vector3, Vector6};

/// A rigid body welded to the end of a rod in space, with the loads on it besides the rod.
///
/// With r1, R1 the end of the rod, n1, m1 its wrench, c the centre of mass from the end (fixed in the directors) and
/// J the inertia about it:
/// ```text
/// mass (r1 + R1 c)'' = -n1 + forces,       (R1 J R1^T omega)' = -m1 + R1 c x n1 + couples       AMV (2.15), (2.16).
/// ```
/// Forces act at the centre of mass. V = (omega, r1') and wrenches (m, n) are in the world frame; on a clamp that is
/// tilted or moves ([`RigidBody::with_support`]) those of the rod are seen from the clamp.
#[derive(Debug, Clone)]
pub struct RigidBody {
    /// The centre of mass as a point mass.
    centre: PointMass<3>,
    offset: Vector3<f64>,
    inertia: Matrix3<f64>,
    inverse_inertia: Matrix3<f64>,
    rotor: Vector3<f64>,
    couple: Vector3<f64>,
    couples: Vec<TimeLoad<3>>,
    /// Loads along the directors.
    follower_forces: Vec<TimeLoad<3>>,
    follower_couples: Vec<TimeLoad<3>>,
    functions: Vec<LoadFunction>,
    rotational_drag: f64,
    support: Option<Box<Support<3>>>,
}

impl RigidBody {
    /// A free body with its centre of mass at the end of the rod; `inertia` is about the centre of mass, in components
    /// along the directors of the end.
    ///
    /// # Errors
    /// A mass that is not positive and finite; an inertia that is not finite, symmetric and positive definite.
    pub fn new(mass: f64, inertia: Matrix3<f64>) -> Result<Self> {
        let centre = PointMass::new(mass)?;
        let scale = inertia.amax();
        let skew = (inertia - inertia.transpose()).amax();
        let symmetric = (inertia + inertia.transpose()) * 0.5;
        let inverse_inertia = symmetric
            .cholesky()
            .filter(|_| scale < f64::INFINITY && skew <= 1e-12 * scale)
            .map(|factors| factors.inverse())
            .filter(|inverse| inverse.iter().all(|x| x.is_finite()))
            .ok_or_else(|| {
                Error::domain(format!(
                    "inertia must be finite, symmetric and positive definite; its diagonal is {}",
                    crate::error::named(&crate::error::AXES, inertia.diagonal().as_slice())
                ))
            })?;
        Ok(Self {
            centre,
            offset: Vector3::zeros(),
            inertia: symmetric,
            inverse_inertia,
            rotor: Vector3::zeros(),
            couple: Vector3::zeros(),
            couples: Vec::new(),
            follower_forces: Vec::new(),
            follower_couples: Vec::new(),
            functions: Vec::new(),
            rotational_drag: 0.0,
            support: None,
        })
    }

    /// Sets the centre of mass: its position from the end of the rod, in components along the directors of the end.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn with_centre(mut self, offset: Vector3<f64>) -> Result<Self> {
        self.offset = check_vector("centre", offset)?;
        Ok(self)
    }

    /// Adds a symmetric rotor that spins at a constant rate: `momentum` is its angular momentum relative to the body,
    /// in components along the directors. The couples then change R1 J R1^T omega + R1 h.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn with_rotor(mut self, momentum: Vector3<f64>) -> Result<Self> {
        self.rotor = check_vector("rotor", momentum)?;
        Ok(self)
    }

    /// Adds gravity, an acceleration in the world frame.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn with_gravity(mut self, gravity: Vector3<f64>) -> Result<Self> {
        self.centre = self.centre.with_gravity(gravity)?;
        Ok(self)
    }

    /// Adds a constant force at the centre of mass, in the world frame.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn with_dead_force(mut self, force: Vector3<f64>) -> Result<Self> {
        self.centre = self.centre.with_dead_force(force)?;
        Ok(self)
    }

    /// Adds a constant couple, in the world frame. It has no potential: its work counts as power.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn with_dead_couple(mut self, couple: Vector3<f64>) -> Result<Self> {
        self.couple += check_vector("couple", couple)?;
        Ok(self)
    }

    /// Sets a linear drag: force -drag times the velocity of the centre of mass.
    ///
    /// # Errors
    /// A drag that is negative or not finite.
    pub fn with_drag(mut self, drag: f64) -> Result<Self> {
        self.centre = self.centre.with_drag(drag)?;
        Ok(self)
    }

    /// Sets a linear drag on rotation: couple -drag omega.
    ///
    /// # Errors
    /// A drag that is negative or not finite.
    pub fn with_rotational_drag(mut self, drag: f64) -> Result<Self> {
        self.rotational_drag = check_drag("rotational drag", drag)?;
        Ok(self)
    }

    /// Adds a force in time at the centre of mass, in the world frame.
    #[must_use]
    pub fn with_force(mut self, force: TimeLoad<3>) -> Self {
        self.centre = self.centre.with_force(force);
        self
    }

    /// Adds a couple in time, in the world frame.
    #[must_use]
    pub fn with_couple(mut self, couple: TimeLoad<3>) -> Self {
        self.couples.push(couple);
        self
    }

    /// Adds a force in time at the centre of mass that turns with the body, along its directors. It has no potential.
    #[must_use]
    pub fn with_follower_force(mut self, force: TimeLoad<3>) -> Self {
        self.follower_forces.push(force);
        self
    }

    /// Adds a follower couple in time, along the directors of the body.
    #[must_use]
    pub fn with_follower_couple(mut self, couple: TimeLoad<3>) -> Self {
        self.follower_couples.push(couple);
        self
    }

    /// Adds a load as a function of time and of the motion of the body, in the world. Only motions feel the function;
    /// [`RigidBody::load`] is without it.
    #[must_use]
    pub fn with_function(mut self, load: LoadFunction) -> Self {
        self.functions.push(load);
        self
    }

    /// True if a load is a function of the motion.
    pub fn has_functions(&self) -> bool {
        !self.functions.is_empty()
    }

    /// Clamps the rod in `support`, as [`PointMass::with_support`].
    #[must_use]
    pub fn with_support(mut self, support: Support<3>) -> Self {
        self.support = Some(Box::new(support));
        self
    }

    /// The body with its clamp fixed in the pose of time `t`.
    #[must_use]
    pub fn standing_at(mut self, t: f64) -> Self {
        self.support = self.support.map(|support| Box::new(support.standing_at(t)));
        self
    }

    /// The clamp, if it is not fixed at the origin along the axes of the world.
    pub fn support(&self) -> Option<&Support<3>> {
        self.support.as_deref()
    }

    /// The mass.
    pub fn mass(&self) -> f64 {
        self.centre.mass()
    }

    /// Vectors from the centre of mass to the middles of three faces of the homogeneous box with this mass and
    /// inertia, in components along the directors: orthogonal columns, each as long as half an edge. An inertia that
    /// no solid has (one moment beyond the sum of the others) gives an edge of length 0.
    pub fn equal_box(&self) -> Matrix3<f64> {
        let axes = self.inertia.symmetric_eigen();
        let total = axes.eigenvalues.sum();
        // J1 = m (b^2 + c^2)/3 with the half edges a, b, c.
        let half = axes
            .eigenvalues
            .map(|j| (1.5 * (total - 2.0 * j) / self.mass()).max(0.0).sqrt());
        axes.eigenvectors * Matrix3::from_diagonal(&half)
    }

    /// The inertia about the centre of mass, in components along the directors.
    pub fn inertia(&self) -> &Matrix3<f64> {
        &self.inertia
    }

    /// The inverse inertia about the centre of mass, in components along the directors.
    pub fn inverse_inertia(&self) -> &Matrix3<f64> {
        &self.inverse_inertia
    }

    /// The centre of mass from the end of the rod, in components along the directors.
    pub fn offset(&self) -> &Vector3<f64> {
        &self.offset
    }

    /// The centre of mass with its loads, as a point mass.
    pub fn centre(&self) -> &PointMass<3> {
        &self.centre
    }

    /// The constant couple, in the world frame.
    pub fn couple(&self) -> &Vector3<f64> {
        &self.couple
    }

    /// The angular momentum of the rotor relative to the body, along the directors.
    pub fn rotor(&self) -> &Vector3<f64> {
        &self.rotor
    }

    /// The drag on rotation.
    pub fn rotational_drag(&self) -> f64 {
        self.rotational_drag
    }

    /// True if a load without a potential can do work.
    pub fn is_driven(&self) -> bool {
        self.centre.is_driven()
            || self.couple != Vector3::zeros()
            || !self.couples.is_empty()
            || !self.follower_forces.is_empty()
            || !self.follower_couples.is_empty()
            || self.has_functions()
            || self.support.as_ref().is_some_and(|s| !s.is_fixed())
    }

    /// True if drag dissipates.
    pub fn is_damped(&self) -> bool {
        self.centre.is_damped() || self.rotational_drag > 0.0
    }

    /// True if a force or couple turns with the body at time `t`.
    pub fn is_followed(&self, t: f64) -> bool {
        [&self.follower_forces, &self.follower_couples]
            .iter()
            .any(|loads| sum_at(loads, t) != Vector3::zeros())
    }

    /// True if the loads at time `t`, frozen in time, have a potential: forces in the world do, couples and loads
    /// that turn with the body do not.
    pub fn is_conservative(&self, t: f64) -> bool {
        !self.is_followed(t) && self.couple + sum_at(&self.couples, t) == Vector3::zeros()
    }

    /// The body at rest under the loads of time `t`, with a share of those without a potential: couples, and loads that
    /// turn with the body.
    ///
    /// # Errors
    /// A share that is not finite.
    pub fn with_share_of_driving(mut self, t: f64, share: f64) -> Result<Self> {
        let constant = |load| TimeLoad::new(load, History::Constant(1.0));
        self.couple = (self.couple + sum_at(&self.couples, t)) * share;
        self.couples.clear();
        for loads in [&mut self.follower_forces, &mut self.follower_couples] {
            *loads = vec![constant(sum_at(loads, t) * share)?];
        }
        Ok(self)
    }

    /// The wrench of the loads at rest about the end, in the world frame, without functions.
    pub fn load(&self, t: f64, pose: &Isometry3<f64>) -> Vector6<f64> {
        let turn = pose.rotation;
        let force = self.centre.load(t) + turn * sum_at(&self.follower_forces, t);
        let lever = turn * self.offset;
        let couple = self.couple_at(t, &turn.to_rotation_matrix());
        join(&(lever.cross(&force) + couple), &force)
    }

    /// Derivatives of the load's couple and force by a turn of the body about the end.
    pub fn load_by_turn(&self, t: f64, pose: &Isometry3<f64>) -> [Matrix3<f64>; 2] {
        let turn = pose.rotation;
        let lever = (turn * self.offset).cross_matrix();
        let following = (turn * sum_at(&self.follower_forces, t)).cross_matrix();
        let couple = (turn * sum_at(&self.follower_couples, t)).cross_matrix();
        // d(c x f) = (phi x c) x f + c x (phi x f_following).
        let force = self.centre.load(t).cross_matrix() + following;
        [force * lever - lever * following - couple, -following]
    }

    /// The body at a pose and velocity of the end.
    fn place_at(&self, pose: &Isometry3<f64>, v: &Vector6<f64>) -> PlacedBody {
        let r = pose.rotation.to_rotation_matrix();
        let turned = |a: &Matrix3<f64>| r.matrix() * a * r.matrix().transpose();
        let (omega, v) = halves(v);
        let c = r * self.offset;
        PlacedBody {
            turn: r,
            c,
            inertia: turned(&self.inertia),
            inverse: turned(&self.inverse_inertia),
            rotor: r * self.rotor,
            omega,
            centre: v + omega.cross(&c),
        }
    }

    /// The angular acceleration at time `t` under the wrench (m, n) of the rod.
    fn spin(&self, t: f64, at: &PlacedBody, m: &Vector3<f64>, n: &Vector3<f64>) -> Vector3<f64> {
        at.inverse
            * (m - at.c.cross(n) + self.couple_at(t, &at.turn)
                - at.omega * self.rotational_drag
                - at.omega.cross(&(at.inertia * at.omega + at.rotor)))
    }
}

/// A body seen from its clamp at one moment: the clamp's frame, the pose of the end in the world, and the place of
/// the end in the frame.
struct BodyFromClamp {
    frame: Frame<6>,
    pose: Isometry3<f64>,
    place: Vector6<f64>,
}

/// The body at a pose and velocity, in the world frame.
struct PlacedBody {
    turn: Rotation3<f64>,
    /// From the end to the centre of mass.
    c: Vector3<f64>,
    inertia: Matrix3<f64>,
    inverse: Matrix3<f64>,
    rotor: Vector3<f64>,
    omega: Vector3<f64>,
    /// Velocity of the centre of mass.
    centre: Vector3<f64>,
}

fn blocks(rows: [[Matrix3<f64>; 2]; 2]) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| rows[i / 3][j / 3][(i % 3, j % 3)])
}

impl RigidBody {
    /// The couples on the body with this orientation.
    fn couple_at(&self, t: f64, turn: &Rotation3<f64>) -> Vector3<f64> {
        self.couple + sum_at(&self.couples, t) + turn * sum_at(&self.follower_couples, t)
    }

    /// The body seen from its clamp; None if the clamp's frame is the world's.
    fn seen_from_clamp(&self, t: f64, pose: &Isometry3<f64>) -> Option<BodyFromClamp> {
        let frame = self.support.as_ref()?.at(t);
        Some(BodyFromClamp {
            frame: frame.of_poses(),
            pose: frame.pose() * pose,
            place: join(&Vector3::zeros(), &pose.translation.vector),
        })
    }

    fn free_motion(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &Vector6<f64>,
        rod: &Vector6<f64>,
    ) -> EndMotion<6> {
        let at = self.place_at(pose, v);
        let (m, n) = halves(rod);
        let own = BodyWrench::sum(&self.functions, &BodyState::of_body(t, pose, v));
        let spin = self.spin(t, &at, &(m + own.couple), &n);
        let following = at.turn * sum_at(&self.follower_forces, t) + own.force;
        let action = self.centre.free_action(t, &at.centre, &(n + following));
        let end = action.acceleration - spin.cross(&at.c) - at.omega.cross(&at.omega.cross(&at.c));
        EndMotion {
            acceleration: join(&spin, &end),
            power: action.power
                + following.dot(&at.centre)
                + (self.couple_at(t, &at.turn) + own.couple).dot(&at.omega),
            loss: action.loss + self.rotational_drag * at.omega.norm_squared(),
        }
    }

    fn free_linear(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &Vector6<f64>,
        rod: &Vector6<f64>,
    ) -> EndLinear<6> {
        let at = self.place_at(pose, v);
        let (m, n) = halves(rod);
        let state = BodyState::of_body(t, pose, v);
        let own = BodyWrench::sum(&self.functions, &state);
        let spin = self.spin(t, &at, &(m + own.couple), &n);
        let (c, omega, inertia) = (at.c.cross_matrix(), at.omega.cross_matrix(), &at.inertia);
        let identity = Matrix3::identity();
        let slowing = self.centre.drag / self.mass();

        // d(J x) by a turn dphi: dphi x (J x) - J (dphi x x).
        let turned = |x: &Vector3<f64>| inertia * x.cross_matrix() - (inertia * x).cross_matrix();
        let rotor = at.rotor.cross_matrix();
        let following = (at.turn * sum_at(&self.follower_forces, t)).cross_matrix();
        let couple = (at.turn * sum_at(&self.follower_couples, t)).cross_matrix();
        let spin_by_turn = at.inverse
            * (-n.cross_matrix() * c
                - couple
                - omega * (turned(&at.omega) - rotor)
                - turned(&spin));
        let spin_by_omega = at.inverse
            * ((inertia * at.omega).cross_matrix() + rotor
                - omega * inertia
                - identity * self.rotational_drag);
        // The end: centre'' - spin x c - omega x (omega x c), with dc = dphi x c.
        let end_by_turn = c * spin_by_turn
            + (spin.cross_matrix() + omega * omega + omega * slowing) * c
            - following / self.mass();
        let end_by_omega =
            c * spin_by_omega + at.omega.cross(&at.c).cross_matrix() + omega * c + c * slowing;
        let zero = Matrix3::zeros();
        let mut linear = EndLinear {
            by_pose: blocks([[spin_by_turn, zero], [end_by_turn, zero]]),
            by_velocity: blocks([[spin_by_omega, zero], [end_by_omega, -identity * slowing]]),
            by_wrench: blocks([
                [at.inverse, -at.inverse * c],
                [c * at.inverse, identity / self.mass() - c * at.inverse * c],
            ]),
        };
        if self.has_functions() {
            let slopes = LoadSlopes::of(&self.functions, &state);
            // A force at the centre of mass does not spin the body; a couple moves the end by the spin.
            let by_load = blocks([[at.inverse, zero], [c * at.inverse, identity / self.mass()]]);
            linear.by_pose += by_load * slopes.by_pose;
            linear.by_velocity += by_load * slopes.by_velocity;
        }
        linear
    }

    fn free_kinetic(&self, pose: &Isometry3<f64>, v: &Vector6<f64>) -> f64 {
        let at = self.place_at(pose, v);
        self.centre.kinetic(0.0, &at.c, &at.centre) + 0.5 * at.omega.dot(&(at.inertia * at.omega))
    }

    fn free_potential(&self, pose: &Isometry3<f64>) -> f64 {
        let centre = pose.translation.vector + pose.rotation * self.offset;
        self.centre.potential(0.0, &centre)
    }
}

impl EndBody<6> for RigidBody {
    type Pose = Isometry3<f64>;

    fn motion(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &Vector6<f64>,
        rod: &Vector6<f64>,
    ) -> EndMotion<6> {
        match self.seen_from_clamp(t, pose) {
            None => self.free_motion(t, pose, v, rod),
            Some(at) => {
                let world = |v: &_, rod: &_| self.free_motion(t, &at.pose, v, rod);
                at.frame.motion(&at.place, v, rod, world)
            }
        }
    }

    fn linearised(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &Vector6<f64>,
        rod: &Vector6<f64>,
    ) -> EndLinear<6> {
        match self.seen_from_clamp(t, pose) {
            None => self.free_linear(t, pose, v, rod),
            Some(at) => {
                let (v, rod) = (
                    at.frame.absolute_velocity(&at.place, v),
                    at.frame.outward(rod),
                );
                at.frame.linear(&self.free_linear(t, &at.pose, &v, &rod))
            }
        }
    }

    fn kinetic(&self, t: f64, pose: &Isometry3<f64>, v: &Vector6<f64>) -> f64 {
        match self.seen_from_clamp(t, pose) {
            None => self.free_kinetic(pose, v),
            Some(at) => self.free_kinetic(&at.pose, &at.frame.absolute_velocity(&at.place, v)),
        }
    }

    fn potential(&self, t: f64, pose: &Isometry3<f64>) -> f64 {
        match self.seen_from_clamp(t, pose) {
            None => self.free_potential(pose),
            Some(at) => self.free_potential(&at.pose),
        }
    }

    fn next_break(&self, t: f64) -> f64 {
        let clamp = self.support.as_ref();
        let clamp = clamp.map_or(f64::INFINITY, |support| support.next_break(t));
        self.centre
            .next_break(t)
            .min(first_break(&self.couples, t))
            .min(first_break(&self.follower_forces, t))
            .min(first_break(&self.follower_couples, t))
            .min(first_break_of(&self.functions, t))
            .min(clamp)
    }
}
