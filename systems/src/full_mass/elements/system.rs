//! Differential equations of rods in elements.
//!
//! State: position and quaternion of every site, then (angular velocity, velocity) of every site; time, energy lost
//! to friction, work, loss to drag, losses at closing and to friction at obstacles. The axes are those of the frame of
//! the assembly. Masses are those of single sites, so that accelerations follow from forces site by site.

use super::axis_joint::JointAction;
use super::barrier::BarrierSums;
use super::linear::ElementLinear;
use super::strain_at_point::Point;
use super::{Carrier, ElementAssembly, ElementNode, ElementRod, Freedoms, RodElement};
use crate::assembly::BodyMotion;
use crate::body::{EndMotion, Mass};
use crate::full_mass::law::Answer;
use crate::math::se3::{Turn, conjugate, halves, join, product, unit};
use crate::section::Strain;
use crate::solve::system::System;
use nalgebra::{DVector, Isometry3, Matrix4x3, Matrix6, Vector3, Vector6};

/// Number of integrals over time in a state: time itself, energy dissipated, work, loss to drag, losses at closing and
/// to friction at obstacles.
pub const INTEGRALS: usize = 6;
/// Numbers of the place of a site, and of its twist.
pub(super) const PLACE: usize = 7;
pub(super) const TWIST: usize = 6;
/// Weight of rotations beside places in the norm of errors.
const ROTATIONS: f64 = 0.3;
/// Weight of work and losses, relative to 1 + their size.
const WORK: f64 = 0.03;
/// Least time by which velocities are weighted in Newton's iteration, in units of the motion. Over the 2e4 steps of a
/// bent rod let go the energy stays within a few tolerances.
const HELD: f64 = 2e-3;

/// A node at one moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeNow {
    pub position: Vector3<f64>,
    pub turn: Turn,
    pub velocity: Vector3<f64>,
    pub spin: Vector3<f64>,
    /// From the carrier of the position to the node.
    pub lever: Vector3<f64>,
}

/// Motion of a carrier: position, quaternion, (angular velocity, velocity).
#[derive(Debug, Clone, Copy)]
pub(super) struct Moving {
    position: Vector3<f64>,
    turn: Turn,
    spin: Vector3<f64>,
    velocity: Vector3<f64>,
}

/// A state of rods in elements with its forces.
#[derive(Debug, Clone)]
pub struct ElementMoment {
    /// Time.
    pub t: f64,
    pub(super) sites: Vec<Moving>,
    pub(super) nodes: Vec<Vec<NodeNow>>,
    /// (couple, force) of the strains, and of loads that turn with them, on the nodes of each rod.
    pub(super) forces: Vec<Vec<Vector6<f64>>>,
    /// (couple, force) of the nodes on each site.
    pub(super) on_sites: Vec<Vector6<f64>>,
    /// Accelerations of the sites.
    pub(super) accelerations: Vec<Vector6<f64>>,
    /// Power of friction, of loads without potential and supports, of drag; losses at closing and to friction at
    /// obstacles.
    powers: [f64; 5],
    /// Places of the joints on their holders, and the wrenches of the joints.
    pub(super) joints: Vec<(NodeNow, JointAction)>,
    /// Energy of the strains, and loss per length at the Gauss points of each rod.
    pub(super) elastic: f64,
    /// Energy of the barrier of obstacles.
    pub(super) barrier: f64,
    /// Balls on bodies, as far as there are obstacles.
    pub(super) balls: Vec<NodeNow>,
    pub(super) lost: Vec<Vec<f64>>,
}

/// Rates of change of a quaternion by spins in the world.
pub(super) fn by_spin(p: &Turn) -> Matrix4x3<f64> {
    let column = |axis: Vector3<f64>| product(&Turn::new(0.0, axis.x, axis.y, axis.z), p) * 0.5;
    Matrix4x3::from_columns(&[
        column(Vector3::x()),
        column(Vector3::y()),
        column(Vector3::z()),
    ])
}

fn isometry(position: &Vector3<f64>, turn: &Turn) -> Isometry3<f64> {
    Isometry3::from_parts((*position).into(), unit(turn))
}

fn turn_of(pose: &Isometry3<f64>) -> Turn {
    let p = pose.rotation.quaternion();
    Turn::new(p.w, p.i, p.j, p.k)
}

fn rotated(p: &Turn, v: &Vector3<f64>) -> Vector3<f64> {
    let x = product(&product(p, &Turn::new(0.0, v.x, v.y, v.z)), &conjugate(p));
    Vector3::new(x[1], x[2], x[3])
}

impl Moving {
    pub fn pose(&self) -> Isometry3<f64> {
        isometry(&self.position, &self.turn)
    }

    pub fn twist(&self) -> Vector6<f64> {
        join(&self.spin, &self.velocity)
    }
}

impl NodeNow {
    pub fn motion(&self) -> BodyMotion {
        BodyMotion {
            pose: isometry(&self.position, &self.turn),
            twist: join(&self.spin, &self.velocity),
        }
    }
}

/// Point of an element from its nodes, by values and slopes of the polynomials.
pub(super) fn point(nodes: &[NodeNow], values: &[f64], slopes: &[f64], over: f64) -> Point {
    let mut at = Point::zero();
    for ((node, value), slope) in nodes.iter().zip(values).zip(slopes) {
        let slope = slope * over;
        at.turn += node.turn * *value;
        at.turn_along += node.turn * slope;
        at.tangent += node.position * slope;
    }
    at
}

/// Rate of [`point`].
pub(super) fn point_rate(
    nodes: &[NodeNow],
    turns: &[Turn],
    values: &[f64],
    slopes: &[f64],
    over: f64,
) -> Point {
    let mut at = Point::zero();
    for (((node, turn), value), slope) in nodes.iter().zip(turns).zip(values).zip(slopes) {
        let slope = slope * over;
        at.turn += turn * *value;
        at.turn_along += turn * slope;
        at.tangent += node.velocity * slope;
    }
    at
}

impl ElementRod {
    /// Energy and resultants at a point, with the springs of rigid strains.
    pub(super) fn answer(&self, s: f64, e: &Strain, rate: &Strain) -> Option<Answer> {
        let (held, held_rate) = self.admitted(s, e, rate)?;
        let mut answer = self.law().answer(s, &held, &held_rate, &[])?;
        for (k, spring) in &self.springs {
            let give = e[*k] - held[*k];
            answer.elastic[*k] = spring * give;
            answer.energy += 0.5 * spring * give * give;
        }
        Some(answer)
    }

    /// Strains and strain rates with rigid strains at their values in the unloaded rod, as the section law demands.
    pub(super) fn admitted(&self, s: f64, e: &Strain, rate: &Strain) -> Option<(Strain, Strain)> {
        let (mut e, mut rate) = (*e, *rate);
        if !self.springs.is_empty() {
            let rest = self.law().unloaded(s).ok()?;
            for (k, _) in &self.springs {
                e[*k] = rest[*k];
                rate[*k] = 0.0;
            }
        }
        Some((e, rate))
    }
}

impl ElementAssembly {
    /// Index of time in a state.
    pub fn time(&self) -> usize {
        (PLACE + TWIST) * self.sites.len()
    }

    /// Index of each coordinate of a place in a state, with the index of the velocity of this coordinate.
    pub fn places_and_speeds(&self) -> impl Iterator<Item = (usize, usize)> {
        let count = self.sites.len();
        let site = move |i| (0..3).map(move |k| (PLACE * i + k, PLACE * count + TWIST * i + 3 + k));
        (0..count).flat_map(site)
    }

    /// Sets the spin of site `i` in a state to that of its rotation, whose coordinates change at `rate` of their index.
    pub fn set_spin(&self, i: usize, y: &mut DVector<f64>, rate: impl Fn(usize) -> f64) {
        let turn = PLACE * i + 3;
        let p: Turn = y.fixed_rows::<4>(turn).into_owned();
        let turning = Turn::from_fn(|k, _| rate(turn + k));
        let spin = product(&turning, &conjugate(&p)) * (2.0 / p.norm_squared());
        y.fixed_rows_mut::<3>(self.spin_of(i))
            .copy_from(&spin.fixed_rows::<3>(1));
    }

    /// Index of the spin of site `i` in a state.
    pub fn spin_of(&self, i: usize) -> usize {
        PLACE * self.sites.len() + TWIST * i
    }

    /// A state at time 0 from motions of the listed bodies, and of all nodes of every rod.
    pub fn state(&self, bodies: &[BodyMotion], rods: &[Vec<BodyMotion>]) -> DVector<f64> {
        let mut y = DVector::zeros(self.time() + INTEGRALS);
        for (i, motion) in self.of_nodes(bodies, rods).iter().enumerate() {
            y.fixed_rows_mut::<3>(PLACE * i)
                .copy_from(&motion.pose.translation.vector);
            y.fixed_rows_mut::<4>(PLACE * i + 3)
                .copy_from(&turn_of(&motion.pose));
            y.fixed_rows_mut::<6>(PLACE * self.sites.len() + TWIST * i)
                .copy_from(&motion.twist);
        }
        y
    }

    fn moving(&self, y: &DVector<f64>, i: usize) -> Moving {
        let p: Turn = y.fixed_rows::<4>(PLACE * i + 3).into_owned();
        let v = PLACE * self.sites.len() + TWIST * i;
        Moving {
            position: y.fixed_rows::<3>(PLACE * i).into_owned(),
            turn: p / p.norm(),
            spin: y.fixed_rows::<3>(v).into_owned(),
            velocity: y.fixed_rows::<3>(v + 3).into_owned(),
        }
    }

    pub(super) fn grounds(&self, t: f64) -> Vec<Moving> {
        let grounds = self.grounds.iter();
        grounds
            .map(|ground| match &ground.support {
                None => Moving {
                    position: Vector3::zeros(),
                    turn: Turn::new(1.0, 0.0, 0.0, 0.0),
                    spin: Vector3::zeros(),
                    velocity: Vector3::zeros(),
                },
                Some(support) => {
                    let frame = support.at(t);
                    let pose = frame.pose();
                    let none = Vector6::zeros();
                    let twist = frame.of_poses().absolute_velocity(&none, &none);
                    let (spin, velocity) = halves(&twist);
                    Moving {
                        position: pose.translation.vector,
                        turn: turn_of(&pose),
                        spin,
                        velocity,
                    }
                }
            })
            .collect()
    }

    fn node_now(&self, node: &ElementNode, sites: &[Moving], grounds: &[Moving]) -> NodeNow {
        let of = |carrier: Carrier| match carrier {
            Carrier::Site(i) => &sites[i],
            Carrier::Ground(i) => &grounds[i],
        };
        let (shift, turn) = (of(node.shift), of(node.turn));
        let place = &node.place.translation.vector;
        let lever = if *place == Vector3::zeros() {
            *place
        } else {
            rotated(&shift.turn, place)
        };
        NodeNow {
            position: shift.position + lever,
            turn: node.turned(&turn.turn),
            velocity: shift.velocity + shift.spin.cross(&lever),
            spin: turn.spin,
            lever,
        }
    }

    /// Adds the (couple, force) on a node to its sites.
    fn add_to_sites(
        &self,
        node: &ElementNode,
        now: &NodeNow,
        wrench: &Vector6<f64>,
        out: &mut [Vector6<f64>],
    ) {
        let (couple, force) = halves(wrench);
        if let Carrier::Site(site) = node.turn {
            out[site] += join(&couple, &Vector3::zeros());
        }
        if let Carrier::Site(site) = node.shift {
            out[site] += join(&now.lever.cross(&force), &force);
        }
    }

    /// Evaluates a state; None outside the domain of a law.
    pub fn moment(&self, y: &DVector<f64>) -> Option<ElementMoment> {
        let t = y[self.time()];
        let sites: Vec<Moving> = (0..self.sites.len()).map(|i| self.moving(y, i)).collect();
        let grounds = self.grounds(t);
        let mut nodes = Vec::with_capacity(self.rods.len());
        let mut forces = Vec::with_capacity(self.rods.len());
        let mut on_sites = vec![Vector6::zeros(); self.sites.len()];
        let mut powers = [0.0; 5];
        let mut sums = BarrierSums::default();
        let mut elastic = 0.0;
        let mut all_lost = Vec::with_capacity(self.rods.len());
        for (k, rod) in self.rods.iter().enumerate() {
            let mut now: Vec<NodeNow> = rod
                .nodes
                .iter()
                .map(|node| self.node_now(node, &sites, &grounds))
                .collect();
            align_ends(&mut now);
            let mut pushed = vec![Vector6::zeros(); now.len()];
            let mut lost = Vec::new();
            let seen = rod.seen_at(t)?;
            for (number, element) in rod.elements.iter().enumerate() {
                self.push_element((k, number), &now, &mut pushed, &mut sums)?;
                let [energy, loss, power] =
                    self.pull(&seen, element, &now, &mut pushed, &mut lost)?;
                elastic += energy;
                powers[0] += loss;
                powers[1] += power;
            }
            for ((now, load), pushed) in now.iter().zip(&rod.turning).zip(&mut pushed) {
                let wrench = load.wrench(&now.turn);
                *pushed += wrench;
                powers[1] += wrench.dot(&join(&now.spin, &now.velocity));
            }
            nodes.push(now);
            forces.push(pushed);
            all_lost.push(lost);
        }
        self.push_rods(&nodes, &mut forces, &mut sums)?;
        for ((rod, now), pushed) in self.rods.iter().zip(&nodes).zip(&forces) {
            for ((node, now), wrench) in rod.nodes.iter().zip(now).zip(pushed) {
                self.add_to_sites(node, now, wrench, &mut on_sites);
                powers[1] += power_of_supports(node, now, wrench);
            }
        }
        for hold in &self.holds {
            let (gradient, energy) = hold.pull(&sites);
            elastic += energy;
            on_sites[hold.site] -= gradient.fixed_rows::<6>(0);
            if let Some(carrier) = hold.carrier() {
                on_sites[carrier] -= gradient.fixed_rows::<6>(6);
            }
        }
        let mut joints = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let holder = self.node_now(&joint.holder, &sites, &grounds);
            let (end, end_now) = (
                &self.rods[joint.rod].nodes[joint.node],
                &nodes[joint.rod][joint.node],
            );
            let action = joint.action([&holder, end_now]);
            let both = [(&joint.holder, &holder), (end, end_now)];
            for ((node, now), wrench) in both.into_iter().zip(&action.wrenches) {
                self.add_to_sites(node, now, wrench, &mut on_sites);
                powers[1] += power_of_supports(node, now, wrench);
            }
            elastic += action.held;
            powers[0] += action.loss;
            powers[1] += action.power;
            joints.push((holder, action));
        }
        let on_balls = self.ball_nodes();
        let balls: Vec<NodeNow> = (on_balls.iter())
            .map(|node| self.node_now(node, &sites, &grounds))
            .collect();
        self.push_balls(&balls, &mut sums, |k, force| {
            let wrench = join(&Vector3::zeros(), &force);
            self.add_to_sites(&on_balls[k], &balls[k], &wrench, &mut on_sites);
        })?;
        powers[3..].copy_from_slice(&sums.losses);
        let mut accelerations = Vec::with_capacity(sites.len());
        for (i, site) in self.sites.iter().enumerate() {
            let (acceleration, power, loss) =
                accelerated(t, &site.masses, &sites[i], &on_sites[i])?;
            powers[1] += power;
            powers[2] += loss;
            accelerations.push(self.freed(i, acceleration));
        }
        Some(ElementMoment {
            t,
            sites,
            nodes,
            forces,
            on_sites,
            accelerations,
            powers,
            joints,
            elastic,
            barrier: sums.energy,
            balls,
            lost: all_lost,
        })
    }

    /// A twist or acceleration of site `i`, with its held components set to 0.
    pub(super) fn freed(&self, i: usize, mut twist: Vector6<f64>) -> Vector6<f64> {
        let site = &self.sites[i];
        for k in 0..6 {
            if !self.is_free(k) || !(if k < 3 { site.turns } else { site.shifts }) {
                twist[k] = 0.0;
            }
        }
        twist
    }

    /// True for a component of twists that the freedoms leave.
    pub(super) fn is_free(&self, k: usize) -> bool {
        match self.freedoms {
            Freedoms::Space => true,
            Freedoms::Plane(axis) => (k < 3) == (k % 3 == axis),
        }
    }

    /// Adds the forces of an element to those on the nodes; energy, loss, and power of what changes the law.
    fn pull(
        &self,
        rod: &ElementRod,
        element: &RodElement,
        now: &[NodeNow],
        pushed: &mut [Vector6<f64>],
        lost: &mut Vec<f64>,
    ) -> Option<[f64; 3]> {
        let nodes = &now[element.nodes.clone()];
        let out = &mut pushed[element.nodes.clone()];
        let length = rod.length(element);
        let over = 1.0 / length;
        let damped = rod.law().is_damped();
        let turns: Vec<Turn> = if damped {
            let turning = |node: &NodeNow| by_spin(&node.turn) * node.spin;
            nodes.iter().map(turning).collect()
        } else {
            Vec::new()
        };
        let table = &*self.table;
        let [mut energy, mut loss, mut power] = [0.0; 3];
        for (g, x) in table.points.iter().enumerate() {
            let (values, slopes) = (&table.values[g], &table.slopes[g]);
            let at = point(nodes, values, slopes, over);
            let e = at.strain();
            let rate = if damped {
                at.strain_rate(&point_rate(nodes, &turns, values, slopes, over), &e)
            } else {
                Strain::zeros()
            };
            let s = element.from + (element.to - element.from) * x;
            let answer = rod.answer(s, &e, &rate)?;
            let weight = table.weights[g] * length;
            energy += weight * answer.energy;
            loss += weight * answer.loss;
            power += weight * answer.power;
            lost.push(answer.loss);
            let pull = at.gradient(&((answer.elastic + answer.friction) * weight), &e);
            for (i, out) in out.iter_mut().enumerate() {
                let slope = slopes[i] * over;
                let by_turn = pull.turn * values[i] + pull.turn_along * slope;
                let couple = product(&by_turn, &conjugate(&nodes[i].turn)) * 0.5;
                for k in 0..3 {
                    out[k] -= couple[1 + k];
                    out[3 + k] -= slope * pull.tangent[k];
                }
            }
        }
        energy.is_finite().then_some([energy, loss, power])
    }

    /// Kinetic energy of the bodies and of the rods, stored energy with that of barriers, potential. Pieces of rods on
    /// supports count apart.
    pub fn energies(&self, at: &ElementMoment) -> [f64; 4] {
        let in_joints = at.joints.iter().map(|(_, action)| action.potential);
        let mut sums = [0.0, 0.0, at.elastic + at.barrier, in_joints.sum()];
        for (i, (site, moving)) in self.sites.iter().zip(&at.sites).enumerate() {
            let (pose, mut twist) = (moving.pose(), moving.twist());
            if !site.shifts {
                // The mass of a base on a ball joint stays in its place.
                twist.fixed_rows_mut::<3>(3).fill(0.0);
            }
            for (k, mass) in site.masses.iter().enumerate() {
                // A listed body comes before the pieces of rods on it, the body of a rod after its last piece.
                let of_rod = (i < self.bodies) == (k > 0);
                sums[usize::from(of_rod)] += mass.kinetic(at.t, &pose, &twist);
                if site.shifts {
                    sums[3] += mass.potential(at.t, &pose);
                }
            }
        }
        sums
    }

    /// Kinetic and potential energy of the pieces of rods on the ground and on supports, which have them by the work
    /// of the supports.
    pub fn riding(&self, t: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (ground, at) in self.grounds.iter().zip(self.grounds(t)) {
            let pose = at.pose() * ground.place;
            let lever = pose.translation.vector - at.position;
            let twist = join(&at.spin, &(at.velocity + at.spin.cross(&lever)));
            if let Some(riding) = &ground.riding {
                sums[0] += riding.kinetic(t, &pose, &twist);
                sums[1] += riding.potential(t, &pose);
            }
        }
        sums
    }
}

/// Gives quaternions at the ends of a rod the sign of those next to them: both signs are one rotation, and polynomials
/// need one sign. The quaternion of a clamp that turns jumps to the other sign.
fn align_ends(nodes: &mut [NodeNow]) {
    let last = nodes.len() - 1;
    for (end, next) in [(0, 1), (last, last - 1)] {
        if nodes[end].turn.dot(&nodes[next].turn) < 0.0 {
            nodes[end].turn = -nodes[end].turn;
        }
    }
}

/// Power of the supports that hold a node against a wrench.
fn power_of_supports(node: &ElementNode, now: &NodeNow, wrench: &Vector6<f64>) -> f64 {
    let (couple, force) = halves(wrench);
    let on_ground = |carrier: Carrier| carrier.site().is_none();
    let mut power = 0.0;
    if on_ground(node.turn) {
        power -= couple.dot(&now.spin);
    }
    if on_ground(node.shift) {
        power -= force.dot(&now.velocity);
    }
    power
}

/// Acceleration of a site under the wrench of the rods, with the powers of its loads and drag.
pub(super) fn accelerated(
    t: f64,
    masses: &[Mass],
    moving: &Moving,
    wrench: &Vector6<f64>,
) -> Option<(Vector6<f64>, f64, f64)> {
    let (pose, twist) = (moving.pose(), moving.twist());
    if let [Mass::Rigid(_)] | [Mass::Point(_)] = masses {
        let EndMotion {
            acceleration,
            power,
            loss,
        } = masses[0].motion(t, &pose, &twist, wrench);
        return Some((acceleration, power, loss));
    }
    // Each mass needs M (a - a0), with its acceleration a0 without rods.
    let none = Vector6::zeros();
    let each: Vec<(Matrix6<f64>, Vector6<f64>)> = masses
        .iter()
        .map(|mass| {
            let free = mass.motion(t, &pose, &twist, &none).acceleration;
            (mass.matrix(&pose.rotation), free)
        })
        .collect();
    let mut matrix = Matrix6::zeros();
    let mut push = *wrench;
    for (mass, free) in &each {
        matrix += mass;
        push += mass * free;
    }
    for k in 0..3 {
        // A point mass does not turn.
        if matrix[(k, k)] == 0.0 {
            matrix[(k, k)] = 1.0;
            push[k] = 0.0;
        }
    }
    let acceleration = matrix.cholesky()?.solve(&push);
    let (mut power, mut loss) = (0.0, 0.0);
    for (mass, (matrix, free)) in masses.iter().zip(&each) {
        let share = matrix * (acceleration - free);
        let motion = mass.motion(t, &pose, &twist, &share);
        power += motion.power;
        loss += motion.loss;
    }
    Some((acceleration, power, loss))
}

impl System for ElementAssembly {
    type Linearised = ElementLinear;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let at = self.moment(y)?;
        let count = self.sites.len();
        for (i, moving) in at.sites.iter().enumerate() {
            let twist = self.freed(i, moving.twist());
            let (spin, velocity) = halves(&twist);
            out.fixed_rows_mut::<3>(PLACE * i).copy_from(&velocity);
            let p: Turn = y.fixed_rows::<4>(PLACE * i + 3).into_owned();
            out.fixed_rows_mut::<4>(PLACE * i + 3)
                .copy_from(&(by_spin(&p) * spin));
            out.fixed_rows_mut::<6>(PLACE * count + TWIST * i)
                .copy_from(&at.accelerations[i]);
        }
        let time = self.time();
        out[time] = 1.0;
        out.as_mut_slice()[time + 1..time + INTEGRALS].copy_from_slice(&at.powers);
        out.iter().all(|x| x.is_finite()).then_some(())
    }

    fn linearised(&self, y: &DVector<f64>) -> Option<ElementLinear> {
        ElementLinear::new(self, y)
    }

    /// Error norm: velocities count by what they move in one step. Those of waves that the step does not resolve are
    /// fast and move nothing.
    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64 {
        let time = self.time();
        let integral = |i: usize| WORK * error[i] / (1.0 + from[i].abs().max(to[i].abs()));
        let integrals = (time + 1..time + INTEGRALS).map(|i| integral(i).powi(2));
        self.square_of_motion(error, to[time] - from[time]) + integrals.sum::<f64>()
    }

    /// Velocities count by what they move in a time of their own where steps are shorter. Errors of Newton's iteration
    /// are energy for ever, and would add up over many short steps.
    fn increment_square(&self, increment: &DVector<f64>, at: &DVector<f64>, h: f64) -> f64 {
        let time = self.time();
        let integral = |i: usize| WORK * increment[i] / (1.0 + at[i].abs());
        let integrals = (time + 1..time + INTEGRALS).map(|i| integral(i).powi(2));
        self.square_of_motion(increment, h.max(HELD)) + integrals.sum::<f64>()
    }
}

impl ElementAssembly {
    /// Size of a change of places and rotations, in the mean over all sites.
    pub(super) fn size_of_motion(&self, change: &DVector<f64>) -> f64 {
        self.square_of_motion(change, 0.0).sqrt()
    }

    /// Places in the mean over all sites, in units of length, with rotations of less weight; velocities by what they
    /// move in the time `h`.
    fn square_of_motion(&self, error: &DVector<f64>, h: f64) -> f64 {
        let count = self.sites.len();
        let mut sum = 0.0;
        for i in 0..count {
            let place = PLACE * i;
            let twist = PLACE * count + TWIST * i;
            for k in 0..3 {
                sum += error[place + k].powi(2) + (h * error[twist + 3 + k]).powi(2);
                sum += (ROTATIONS * h * error[twist + k]).powi(2);
            }
            for k in 3..7 {
                sum += (2.0 * ROTATIONS * error[place + k]).powi(2);
            }
        }
        sum / count.max(1) as f64
    }
}
