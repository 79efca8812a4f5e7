//! Equations of motion at one moment: free accelerations, closed contacts and their forces.

use super::bodies::{Bodies, Candidate, Partner};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3x6, Matrix6, Vector2, Vector3, Vector6};
use snaprod_systems::contact::{
    Accelerated, Complementarity, ContactSolution, Face, Mode, OneContact, RigidMotion, Touch,
};
use snaprod_systems::math::se3::{halves, join};

/// A closed contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Closed {
    pub candidate: usize,
    pub grip: Grip,
    /// The face on which a point moves, if the obstacle has sharp edges: forces are those on the plane of the face.
    pub face: Option<Face>,
}

/// The state of a closed contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Grip {
    /// The contact carries no force: others hold the surfaces together.
    Idle,
    /// No relative motion.
    Stick,
    /// Slip; the direction, in the world, is that of the slip velocity when it was last looked at.
    Slip(Vector3<f64>),
}

/// A contact at one moment, with the velocities of its place as rows.
#[derive(Debug, Clone)]
pub(crate) struct ContactRow {
    pub candidate: usize,
    pub touch: Touch,
    /// The slip velocity in the world.
    pub slip: Vector3<f64>,
    /// Axes of the contact as columns: normal, two tangents.
    pub axes: Matrix3<f64>,
    /// The bodies with the sign of their part in the slip velocity.
    parts: Vec<SlipPart>,
}

/// The part of a body in the slip velocity of a contact.
#[derive(Debug, Clone)]
struct SlipPart {
    body: usize,
    sign: f64,
    rows: Matrix3x6<f64>,
}

impl ContactRow {
    /// The tangential part of the slip velocity, in the world.
    pub fn tangential(&self) -> Vector3<f64> {
        let n = self.touch.normal;
        self.slip - n * n.dot(&self.slip)
    }

    /// The slip velocity along the axes.
    pub fn seen(&self) -> Vector3<f64> {
        self.axes.tr_mul(&self.slip)
    }

    /// The bodies of the contact.
    pub fn bodies(&self) -> impl Iterator<Item = usize> {
        self.parts.iter().map(|part| part.body)
    }
}

/// Bodies and obstacles at one moment.
pub(crate) struct Moment<'a> {
    pub system: &'a Bodies,
    pub motions: Vec<RigidMotion>,
    obstacles: Vec<(RigidMotion, Vector6<f64>)>,
    /// Accelerations without contact forces.
    pub accelerations: Vec<Vector6<f64>>,
    inverses: Vec<Matrix6<f64>>,
}

/// Bounds of the acceleration of a body.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct AccelerationBound {
    linear: f64,
    angular: f64,
}

impl AccelerationBound {
    /// The bound of a body that does not turn.
    pub fn linear(linear: f64) -> Self {
        Self {
            linear,
            angular: 0.0,
        }
    }

    /// The size of an acceleration.
    pub fn of(acceleration: &Vector6<f64>) -> Self {
        let (angular, linear) = halves(acceleration);
        Self {
            linear: linear.norm(),
            angular: angular.norm(),
        }
    }

    /// The bounds of two moments together.
    pub fn max(self, other: Self) -> Self {
        Self {
            linear: self.linear.max(other.linear),
            angular: self.angular.max(other.angular),
        }
    }
}

/// The slip velocity below which the direction of slip is the remembered one.
const STILL: f64 = 1e-10;

impl<'a> Moment<'a> {
    /// Bodies with these poses and velocities at time `t`. The bodies have no accelerations yet.
    pub fn new(system: &'a Bodies, t: f64, motions: Vec<RigidMotion>) -> Self {
        Self {
            system,
            obstacles: system.obstacles.iter().map(|o| o.motion(t)).collect(),
            accelerations: vec![Vector6::zeros(); motions.len()],
            motions,
            inverses: Vec::new(),
        }
    }

    /// Kinetic and potential energy.
    pub fn energies(&self, t: f64) -> [f64; 2] {
        let mut energies = [0.0; 2];
        for (body, motion) in self.system.bodies.iter().zip(&self.motions) {
            let twist = join(&motion.spin, &motion.velocity);
            energies[0] += body.mass.kinetic(t, &motion.pose, &twist);
            energies[1] += body.mass.potential(t, &motion.pose);
        }
        energies
    }

    /// The two frames of a candidate, each with its acceleration.
    fn frames(&self, candidate: &Candidate) -> [Accelerated<'_>; 2] {
        let body = |k: usize| Accelerated {
            motion: &self.motions[k],
            acceleration: &self.accelerations[k],
        };
        let partner = match candidate.id.partner {
            Partner::Body(k) => body(k),
            Partner::Obstacle(k) => Accelerated {
                motion: &self.obstacles[k].0,
                acceleration: &self.obstacles[k].1,
            },
        };
        [body(candidate.id.body), partner]
    }

    /// The geometry of a candidate, and its slip velocity.
    pub fn touch(&self, number: usize) -> (Touch, Vector3<f64>) {
        let candidate = &self.system.candidates[number];
        let [a, b] = self.frames(candidate);
        let touch = candidate.pair.touch(a.motion, b.motion);
        let slip = touch.slip(a.motion, b.motion);
        (touch, slip)
    }

    /// The geometry of a closed contact, and its slip velocity.
    pub fn touch_of(&self, closed: &Closed) -> (Touch, Vector3<f64>) {
        let Some(face) = &closed.face else {
            return self.touch(closed.candidate);
        };
        let candidate = &self.system.candidates[closed.candidate];
        let [a, b] = self.frames(candidate);
        let touch = candidate.pair.touch_on(face, a.motion, b.motion);
        let slip = touch.slip(a.motion, b.motion);
        (touch, slip)
    }

    /// The face on which the point of a candidate touches an obstacle with sharp edges.
    pub fn face(&self, number: usize) -> Option<Face> {
        let candidate = &self.system.candidates[number];
        let [a, b] = self.frames(candidate);
        candidate.pair.face(a.motion, b.motion)
    }

    /// A bound of -gap'' near this moment for a candidate, by speeds and by `bounds` of the bodies' accelerations.
    /// Curvature of convex surfaces only adds to gap''.
    pub fn largest_fall(&self, number: usize, bounds: &[AccelerationBound]) -> f64 {
        let candidate = &self.system.candidates[number];
        let [a, b] = self.frames(candidate);
        let touch = candidate.pair.touch(a.motion, b.motion);
        let slip = touch.slip(a.motion, b.motion);
        let of = |side: Accelerated<'_>, bound: &AccelerationBound| {
            let lever = side.motion.lever(&touch.point).norm();
            bound.linear + (bound.angular + side.motion.spin.norm_squared()) * lever
        };
        let partner = match candidate.id.partner {
            Partner::Body(k) => bounds[k],
            Partner::Obstacle(_) => AccelerationBound::of(b.acceleration),
        };
        of(a, &bounds[candidate.id.body])
            + of(b, &partner)
            + 2.0 * b.motion.spin.norm() * slip.norm()
            + touch.normal_rate.dot(&slip).abs()
    }

    /// The contact of a candidate with its rows. The first tangent lies along `along`.
    pub fn row(&self, number: usize, along: Option<&Vector3<f64>>) -> ContactRow {
        self.row_at(number, self.touch(number), along)
    }

    /// The row of a candidate with this geometry and slip velocity.
    fn row_at(
        &self,
        number: usize,
        (touch, slip): (Touch, Vector3<f64>),
        along: Option<&Vector3<f64>>,
    ) -> ContactRow {
        let candidate = &self.system.candidates[number];
        let [a, b] = self.frames(candidate);
        let axes = touch.axes(along.unwrap_or(&slip));
        let mut parts = vec![SlipPart {
            body: candidate.id.body,
            sign: 1.0,
            rows: touch.rows(a.motion, &axes),
        }];
        if let Partner::Body(k) = candidate.id.partner {
            parts.push(SlipPart {
                body: k,
                sign: -1.0,
                rows: touch.rows(b.motion, &axes),
            });
        }
        ContactRow {
            candidate: number,
            touch,
            slip,
            axes,
            parts,
        }
    }

    /// The second rates along the axes of a contact: of the gap, and of the tangential slip.
    pub fn second_rates(&self, row: &ContactRow) -> Vector3<f64> {
        let [a, b] = self.frames(&self.system.candidates[row.candidate]);
        let rate = row.axes.tr_mul(&row.touch.slip_rate(a, b));
        rate + Vector3::x() * row.touch.normal_rate.dot(&row.slip)
    }

    /// The velocity of the partner of a contact at its place, if the partner is an obstacle; else 0.
    pub fn obstacle_velocity(&self, row: &ContactRow) -> Vector3<f64> {
        match self.system.candidates[row.candidate].id.partner {
            Partner::Obstacle(k) => self.obstacles[k].0.velocity_at(&row.touch.point),
            Partner::Body(_) => Vector3::zeros(),
        }
    }

    fn fill_inverses(&mut self) {
        if self.inverses.is_empty() {
            let each = self.system.bodies.iter().zip(&self.motions);
            self.inverses = each
                .map(|(body, motion)| body.mass.inverse_matrix(&motion.pose.rotation))
                .collect();
        }
    }

    /// The problem of contact forces or impulses: `free` is the motion without them, along the axes.
    pub fn problem(
        &mut self,
        rows: &[ContactRow],
        free: impl Iterator<Item = Vector3<f64>>,
        contacts: Vec<OneContact>,
    ) -> Complementarity {
        self.fill_inverses();
        let size = 3 * rows.len();
        let mut inverse_mass = DMatrix::zeros(size, size);
        for (i, one) in rows.iter().enumerate() {
            for (j, other) in rows.iter().enumerate() {
                for part in &one.parts {
                    for with in other.parts.iter().filter(|with| with.body == part.body) {
                        let block = part.rows * self.inverses[part.body] * with.rows.transpose();
                        let mut view = inverse_mass.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                        view += block * (part.sign * with.sign);
                    }
                }
            }
        }
        let mut motion = DVector::zeros(size);
        for (i, free) in free.enumerate() {
            motion.fixed_rows_mut::<3>(3 * i).copy_from(&free);
        }
        Complementarity {
            inverse_mass,
            free: motion,
            contacts,
        }
    }

    /// Wrenches (couple, force) of contact forces at the reference points of the bodies, in the world.
    fn wrenches(&self, rows: &[ContactRow], forces: &DVector<f64>) -> Vec<Vector6<f64>> {
        let mut wrenches = vec![Vector6::zeros(); self.motions.len()];
        for (i, row) in rows.iter().enumerate() {
            let force: Vector3<f64> = forces.fixed_rows::<3>(3 * i).into_owned();
            for part in &row.parts {
                wrenches[part.body] += part.rows.tr_mul(&force) * part.sign;
            }
        }
        wrenches
    }

    /// Changes of the bodies' twists by impulses at contacts, or of their accelerations by forces.
    pub fn changes(&mut self, rows: &[ContactRow], forces: &DVector<f64>) -> Vec<Vector6<f64>> {
        self.fill_inverses();
        let wrenches = self.wrenches(rows, forces);
        let each = self.inverses.iter().zip(&wrenches);
        each.map(|(inverse, wrench)| inverse * wrench).collect()
    }

    /// Closed contacts with a force, as rows. The first tangent of a row lies along the slip.
    pub fn held_rows(&self, closed: &[Closed]) -> Vec<ContactRow> {
        let held = closed.iter().filter(|closed| closed.grip != Grip::Idle);
        held.map(|closed| {
            let Grip::Slip(remembered) = closed.grip else {
                return self.row_at(closed.candidate, self.touch_of(closed), None);
            };
            let (touch, whole) = self.touch_of(closed);
            let slip = whole - touch.normal * touch.normal.dot(&whole);
            // The direction does not turn round within a step: the slip comes to rest at an event.
            let along = if slip.dot(&remembered) > STILL {
                slip
            } else {
                remembered
            };
            self.row_at(closed.candidate, (touch, whole), Some(&along))
        })
        .collect()
    }

    /// Contact forces that keep the grips of the closed contacts; None without a solution.
    pub fn forces(&mut self, closed: &[Closed]) -> Option<(Vec<ContactRow>, ContactSolution)> {
        let rows = self.held_rows(closed);
        let held = closed.iter().filter(|closed| closed.grip != Grip::Idle);
        let modes: Vec<Mode> = held
            .map(|closed| match closed.grip {
                Grip::Slip(_) => Mode::Slip(Vector2::x()),
                _ => Mode::Stick,
            })
            .collect();
        let contacts = self.contacts(&rows, |_| Some(Vector2::x()));
        let free: Vec<_> = rows.iter().map(|row| self.second_rates(row)).collect();
        let problem = self.problem(&rows, free.into_iter(), contacts);
        let solution = problem.in_modes(&modes)?;
        Some((rows, solution))
    }

    /// The contacts of rows for a problem without restitution.
    pub fn contacts(
        &self,
        rows: &[ContactRow],
        slips_along: impl Fn(&ContactRow) -> Option<Vector2<f64>>,
    ) -> Vec<OneContact> {
        rows.iter()
            .map(|row| OneContact {
                friction: self.system.candidates[row.candidate].surface.friction(),
                least: 0.0,
                slips_along: slips_along(row),
            })
            .collect()
    }

    /// The parts of closed contacts in a slope; None without a solution.
    pub fn act(&mut self, closed: &[Closed]) -> Option<ContactAction> {
        let mut action = ContactAction {
            accelerations: vec![Vector6::zeros(); self.motions.len()],
            wrenches: vec![Vector6::zeros(); self.motions.len()],
            loss: 0.0,
            work: 0.0,
        };
        if closed.iter().all(|closed| closed.grip == Grip::Idle) {
            return Some(action);
        }
        let (rows, solution) = self.forces(closed)?;
        for (i, row) in rows.iter().enumerate() {
            let force: Vector3<f64> = solution.forces.fixed_rows::<3>(3 * i).into_owned();
            let slip = row.seen();
            action.loss -= force.y * slip.y + force.z * slip.z;
            action.work += (row.axes * force).dot(&self.obstacle_velocity(row));
        }
        action.accelerations = self.changes(&rows, &solution.forces);
        action.wrenches = self.wrenches(&rows, &solution.forces);
        Some(action)
    }
}

/// The parts of closed contacts in the rates of a motion.
pub(crate) struct ContactAction {
    /// Accelerations of the bodies by the contact forces.
    pub accelerations: Vec<Vector6<f64>>,
    /// Wrenches (couple, force) at the reference points of the bodies, in the world.
    pub wrenches: Vec<Vector6<f64>>,
    /// Power lost to friction.
    pub loss: f64,
    /// Power of the obstacles on the bodies.
    pub work: f64,
}
