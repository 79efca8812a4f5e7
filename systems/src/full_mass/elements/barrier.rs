//! Contact of rods in elements through a barrier: with fixed obstacles, as round bodies, and with each other.
//!
//! Within the width d of an obstacle, at the gap g = x d, a surface of mass m per point has the potential
//! ```text
//! B = m a d b(x),      b = -(1 - x)^2 ln x      (Li et al., Incremental Potential Contact, 2020),
//! ```
//! which is infinite at x = 0: no surface enters an obstacle. At a round obstacle m is larger (`Barrier::share`).
//! With the pressure P = -dB/dg the reaction is
//! ```text
//! R = P max(0, 1 - tau g'),      loss = P g' - R g' >= 0.
//! ```
//! A continuum has no restitution. The mass of a point gives up its speed into the obstacle, and leaves the obstacle at
//! 1/tau at most. The loss goes to zero with the distance of the points. The reaction never pulls.
//!
//! Friction has an anchor for each point, the place where the point sticks. With u from the anchor to the point along
//! the surface
//! ```text
//! T = -mu R phi(|u|/delta) u/|u|,      phi(y) = y (2 - y) for y < 1, else 1.
//! ```
//! After a step an anchor farther than delta follows to the distance delta. What sticks holds as long as delta is above
//! the errors of the steps: under a given load u stays as it is.

mod anchors;
mod contacts;
mod near_rods;
mod passages;
mod rod_touch;

pub use contacts::{BarrierContact, Touched, Touching};
pub(super) use near_rods::NearRods;
pub use passages::{Missed, NearestPlace};

use super::ElementNode;
use super::system::NodeNow;
use super::{Carrier, ElementAssembly, ElementMoment, ElementRod};
use crate::contact::Gap;
use crate::error::{Error, Message, Quantity, Result};
use crate::full_mass::obstacles::{BallOnBody, Bearer, ObstaclesOfRods, RoundSurface};
use crate::math::se3::Turn;
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3, Vector6};
use std::sync::Arc;

/// Intervals between the points of an element at the start, over the degree of its polynomials.
const DENSE: usize = 2;
/// Most intervals of an element.
const DENSEST: usize = 16384;
/// Part of a rod for which a free end stands where the end alone hits.
const END: f64 = 0.1;
/// Largest dip of a rod between two points at a round obstacle, over the width of the barrier.
const SAG: f64 = 0.01;
/// Largest dip between two points at another rod. Points are added where rods come nearer.
const SAG_OF_RODS: f64 = 0.05;
/// Largest speed of release, over the speed that the barrier stops.
const RELEASE: f64 = 1e-2;
/// Least energy that the barrier stops, over bending stiffness and length.
const LEAST_ENERGY: f64 = 1e-4;
/// Energy of a beam over that of its bending stiffness, by the square of the displacement of its middle, in lengths.
const HELD_BEAM: f64 = 100.0;
/// Bound of a polynomial of an element by its values at the nodes.
const BULGE: f64 = 2.0;

/// The barrier of an assembly in elements.
#[derive(Debug, Clone)]
pub(super) struct Barrier {
    given: Arc<ObstaclesOfRods>,
    /// Values of the polynomials of an element at its points: rows are points.
    values: Arc<Vec<Vec<f64>>>,
    /// Mass of a point of a rod per length.
    density: f64,
    /// Length of all rods.
    length: f64,
    pub strength: BarrierStrength,
    /// Anchors of all points, by obstacles; empty without friction, and before the first step.
    anchors: Arc<Vec<Vector3<f64>>>,
    /// Points of rods near other rods; `None` until they are looked for.
    near: Option<Arc<NearRods>>,
    /// Ends of rods that touch on one holder, each as rod and 0 or 1.
    pub joined: Vec<[(usize, usize); 2]>,
}

/// The strength by which a barrier pushes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarrierStrength {
    /// Acceleration a.
    pub push: f64,
    /// Time tau, the inverse of the largest speed of release.
    pub settling: f64,
}

/// A point of a surface at one moment.
#[derive(Debug, Clone, Copy)]
struct SurfacePoint {
    place: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Mass that the point stands for.
    mass: f64,
}

/// A point within the width of an obstacle, or of another rod.
#[derive(Debug, Clone, Copy)]
struct TouchingPoint {
    gap: f64,
    /// Unit normal, from what is touched.
    normal: Vector3<f64>,
    /// The point, with its velocity over the touched surface.
    point: SurfacePoint,
    /// Coefficient of friction.
    friction: f64,
    /// Displacement from the anchor along the surface.
    slipped: Vector3<f64>,
}

/// Forces and energies at a touching point.
#[derive(Debug, Clone, Copy)]
struct Press {
    /// Reaction R, its derivatives by the gap at constant rate and by the rate.
    reaction: [f64; 3],
    friction: Vector3<f64>,
    /// Derivative of the friction by the place at constant reaction.
    friction_by_place: Matrix3<f64>,
    /// Friction over the reaction.
    friction_share: Vector3<f64>,
    energy: f64,
    /// Loss at closing, and to friction.
    losses: [f64; 2],
}

/// Sums of a barrier over an assembly at one moment.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BarrierSums {
    pub energy: f64,
    /// Losses at closing and to friction.
    pub losses: [f64; 2],
}

/// b, b' and b'' at x.
fn barrier(x: f64) -> [f64; 3] {
    let (away, ln) = (1.0 - x, x.ln());
    [
        -away * away * ln,
        2.0 * away * ln - away * away / x,
        -2.0 * ln + 4.0 * away / x + (away / x).powi(2),
    ]
}

impl BarrierStrength {
    /// Reaction, energy, and loss at closing of a mass at the gap `g` < `width` that changes at `rate`.
    fn press(&self, mass: f64, width: f64, g: f64, rate: f64) -> ([f64; 3], f64, f64) {
        let [b, slope, bend] = barrier(g / width);
        let scale = mass * self.push;
        let pressure = -scale * slope;
        let share = (1.0 - self.settling * rate).max(0.0);
        let by_rate = if share > 0.0 {
            -self.settling * pressure
        } else {
            0.0
        };
        let by_gap = -scale * bend / width * share;
        let reaction = pressure * share;
        let loss = (pressure - reaction) * rate;
        ([reaction, by_gap, by_rate], scale * width * b, loss)
    }
}

impl TouchingPoint {
    /// A point at an obstacle, with the place to which friction pulls the point.
    fn at_obstacle(gap: &Gap, point: SurfacePoint, friction: f64, anchor: Vector3<f64>) -> Self {
        let (n, u) = (gap.normal, point.place - anchor);
        Self {
            gap: gap.value,
            normal: n,
            point,
            friction,
            slipped: u - n * n.dot(&u),
        }
    }

    /// The touch, seen from the other surface.
    fn turned(mut self) -> Self {
        self.normal = -self.normal;
        self.point.velocity = -self.point.velocity;
        self.slipped = -self.slipped;
        self
    }

    /// The displacement from the anchor after the anchor has followed.
    fn held(&self, barrier: &Barrier) -> Vector3<f64> {
        let delta = barrier.given.stick;
        self.slipped * (delta / self.slipped.norm().max(delta))
    }

    fn press(&self, barrier: &Barrier) -> Press {
        let (n, v) = (self.normal, self.point.velocity);
        let (width, delta) = (barrier.given.gap, barrier.given.stick);
        let (reaction, energy, closing) =
            (barrier.strength).press(self.point.mass, width, self.gap, n.dot(&v));
        let mut press = Press {
            reaction,
            friction: Vector3::zeros(),
            friction_by_place: Matrix3::zeros(),
            friction_share: Vector3::zeros(),
            energy,
            losses: [closing, 0.0],
        };
        if self.friction > 0.0 {
            let u = self.slipped;
            let y = u.norm() / delta;
            // phi/y and phi'.
            let (over, slope) = if y < 1.0 {
                (2.0 - y, 2.0 * (1.0 - y))
            } else {
                (1.0 / y, 0.0)
            };
            let along = u.try_normalize(0.0).unwrap_or_default();
            let across = Matrix3::identity() - n * n.transpose() - along * along.transpose();
            press.friction_share = u * (-self.friction * over / delta);
            press.friction = press.friction_share * reaction[0];
            press.friction_by_place = (along * along.transpose() * slope + across * over)
                * (-self.friction * reaction[0] / delta);
            press.losses[1] = -press.friction.dot(&v);
        }
        press
    }
}

impl Press {
    fn force(&self, normal: &Vector3<f64>) -> Vector3<f64> {
        normal * self.reaction[0] + self.friction
    }

    /// Derivatives of minus the force of an obstacle by place and velocity; `bend` is that of the normal by place.
    fn stiffness(&self, at: &TouchingPoint, bend: &Matrix3<f64>) -> [Matrix3<f64>; 2] {
        let n = at.normal;
        let [reaction, by_gap, by_rate] = self.reaction;
        // The rate n . v of the gap changes by v . H with the place.
        let by_place = n * by_gap + bend * at.point.velocity * by_rate;
        let push = n + self.friction_share;
        [
            -(push * by_place.transpose() + bend * reaction + self.friction_by_place),
            -(push * n.transpose() * by_rate),
        ]
    }
}

impl Barrier {
    /// The barrier of an assembly whose polynomials have `nodes` on [0, 1]. `mass` and `length` are the sums over the
    /// assembly, `longest` is the length of the longest element. No obstacle fits between two points.
    ///
    /// # Errors
    /// An obstacle that is too thin for the points of a rod.
    pub fn new(
        given: Arc<ObstaclesOfRods>,
        nodes: &[f64],
        (mass, length): (f64, f64),
        longest: f64,
    ) -> Result<Self> {
        let thinnest = given.thinnest();
        // Between two points at the distance h a rod comes nearer to an obstacle of radius r by h^2/(8 r). A hard touch
        // takes points to some hundredths of the width of the barrier.
        let spacing_at =
            |radius: f64, sag: f64| radius.min((8.0 * radius * sag * given.gap).sqrt());
        let spacing = spacing_at(thinnest, SAG).min(spacing_at(given.thinnest_pair(), SAG_OF_RODS));
        let thinnest = thinnest.min(given.thinnest_pair());
        let intervals = (longest / spacing)
            .ceil()
            .max((DENSE * (nodes.len() - 1)) as f64);
        if !(intervals <= DENSEST as f64) {
            let least = longest / DENSEST as f64;
            let message = Message::from(
                "an obstacle or another rod is too thin for the rod: the two radii together are ",
            )
            .number(thinnest, Quantity::Length)
            .words(", and must be ")
            .number(least, Quantity::Length)
            .words(" at least; give the rod a contact_diameter, or make the obstacle thicker");
            return Err(Error::domain(message));
        }
        let mut made = Self {
            given,
            values: Arc::new(Vec::new()),
            density: mass / length,
            length,
            strength: BarrierStrength {
                push: 0.0,
                settling: 0.0,
            },
            anchors: Arc::new(Vec::new()),
            near: None,
            joined: Vec::new(),
        };
        made.spread(nodes, intervals as usize);
        Ok(made)
    }

    /// Sets the number of intervals of an element.
    fn spread(&mut self, nodes: &[f64], intervals: usize) {
        let at = |j: usize| super::sample::lagrange(nodes, j as f64 / intervals as f64);
        self.values = Arc::new((0..=intervals).map(at).collect());
        self.anchors = Arc::new(Vec::new());
        self.near = None;
    }

    /// Mass for which a point of a rod stands at an obstacle of a radius, over the mass of the point. A rod touches a
    /// round obstacle along some sqrt(8 r d) alone, and this part stops all of the rod.
    fn share(&self, radius: f64) -> f64 {
        (self.length / (8.0 * radius * self.given.gap).sqrt()).max(1.0)
    }

    /// True for two ends that touch on one holder.
    fn are_joined(&self, a: (usize, usize), b: (usize, usize)) -> bool {
        self.joined.contains(&[a, b]) || self.joined.contains(&[b, a])
    }

    fn intervals(&self) -> usize {
        self.values.len() - 1
    }
}

/// Point `values` of an element.
fn point_of(nodes: &[NodeNow], values: &[f64], mass: f64) -> SurfacePoint {
    let mut point = SurfacePoint {
        place: Vector3::zeros(),
        velocity: Vector3::zeros(),
        mass,
    };
    for (node, value) in nodes.iter().zip(values) {
        point.place += node.position * *value;
        point.velocity += node.velocity * *value;
    }
    point
}

impl ElementAssembly {
    /// Length of a rod for which point `j` of an element stands. A free end that hits stops a part of the rod.
    fn length_of_point(&self, k: usize, element: usize, j: usize, intervals: usize) -> f64 {
        let rod = &self.rods[k];
        let half = if j == 0 || j == intervals { 0.5 } else { 1.0 };
        let length = half * rod.length(&rod.elements[element]) / intervals as f64;
        let at_start = element == 0 && j == 0;
        let at_end = element + 1 == rod.elements.len() && j == intervals;
        if at_start || at_end {
            length.max(END * rod.law().length())
        } else {
            length
        }
    }

    /// The barrier, once it has a strength.
    fn pushing(&self) -> Option<&Barrier> {
        let barrier = self.barrier.as_ref();
        barrier.filter(|barrier| barrier.strength.push > 0.0)
    }

    /// Number of the first surface point of an element; those of bodies follow all rods.
    fn first_point(&self, barrier: &Barrier, k: usize, element: usize) -> usize {
        let before: usize = self.rods[..k].iter().map(|rod| rod.elements.len()).sum();
        (before + element) * barrier.values.len()
    }

    /// Calls `act` with the points of an element that obstacles push: the number of the point in the element, the
    /// number of the obstacle, and the point. None if a point is inside of an obstacle.
    fn each_touching(
        &self,
        barrier: &Barrier,
        (k, number): (usize, usize),
        nodes: &[NodeNow],
        mut act: impl FnMut(usize, usize, &TouchingPoint, &Matrix3<f64>),
    ) -> Option<()> {
        let (given, rod) = (&*barrier.given, &self.rods[k]);
        if given.obstacles.is_empty() {
            return Some(());
        }
        let (element, surface) = (&rod.elements[number], &given.rods[k]);
        let start = nodes[0].position;
        let far = |most: f64, node: &NodeNow| most.max((node.position - start).norm());
        let reach = BULGE * nodes.iter().fold(0.0, far) + given.gap;
        let intervals = barrier.intervals();
        for (obstacle, friction) in surface.friction.iter().enumerate() {
            let Some(friction) = *friction else { continue };
            let shape = &given.obstacles[obstacle];
            if shape.gap(&start).value - surface.radius > reach {
                continue;
            }
            let share = barrier.share(shape.least_radius() + surface.radius);
            for (j, values) in barrier.values.iter().enumerate() {
                let x = j as f64 / intervals as f64;
                if rod.is_at_ground(element.from + (element.to - element.from) * x, surface) {
                    continue;
                }
                let mass = barrier.density * share * self.length_of_point(k, number, j, intervals);
                let point = point_of(nodes, values, mass);
                let gap = shape.gap(&point.place).less(surface.radius);
                if gap.value >= given.gap {
                    continue;
                }
                if !(gap.value > 0.0) {
                    return None;
                }
                let numbered = self.first_point(barrier, k, number) + j;
                let anchor = barrier.anchors.get(numbered).copied();
                let anchor = anchor.unwrap_or(point.place);
                let touching = TouchingPoint::at_obstacle(&gap, point, friction, anchor);
                act(j, obstacle, &touching, &gap.hessian);
            }
        }
        Some(())
    }

    /// Calls `act` with the points of balls that obstacles push: the numbers of the ball and of the obstacle, and the
    /// point. None if a ball is inside of an obstacle.
    fn each_touching_ball(
        &self,
        barrier: &Barrier,
        balls: &[NodeNow],
        mut act: impl FnMut(usize, usize, &TouchingPoint, &Matrix3<f64>),
    ) -> Option<()> {
        let given = &*barrier.given;
        let first = self.first_point(barrier, self.rods.len(), 0);
        for (k, (ball, now)) in given.balls.iter().zip(balls).enumerate() {
            for (obstacle, friction) in ball.surface.friction.iter().enumerate() {
                let Some(friction) = *friction else { continue };
                let shape = &given.obstacles[obstacle];
                let gap = shape.gap(&now.position).less(ball.surface.radius);
                if gap.value >= given.gap {
                    continue;
                }
                if !(gap.value > 0.0) {
                    return None;
                }
                let anchor = barrier.anchors.get(first + k).copied();
                let point = SurfacePoint {
                    place: now.position,
                    velocity: now.velocity,
                    mass: ball.mass,
                };
                let anchor = anchor.unwrap_or(now.position);
                let touching = TouchingPoint::at_obstacle(&gap, point, friction, anchor);
                act(k, obstacle, &touching, &gap.hessian);
            }
        }
        Some(())
    }

    /// The nodes that carry the balls.
    pub(super) fn ball_nodes(&self) -> Vec<ElementNode> {
        let balls = self.barrier.iter().flat_map(|barrier| &barrier.given.balls);
        let node = |ball: &BallOnBody| {
            let site = match ball.on {
                Bearer::Listed(body) => Carrier::Site(body),
                Bearer::EndOf(rod) => {
                    (self.rods[rod].nodes.last()).map_or(Carrier::Site(0), |node| node.turn)
                }
            };
            ElementNode {
                shift: site,
                turn: site,
                place: Isometry3::from_parts(ball.centre.into(), UnitQuaternion::identity()),
                rotation: Turn::new(1.0, 0.0, 0.0, 0.0),
            }
        };
        balls.map(node).collect()
    }

    /// Calls `push` with the number of each ball that an obstacle pushes and the force, and adds to the sums.
    pub(super) fn push_balls(
        &self,
        balls: &[NodeNow],
        sums: &mut BarrierSums,
        mut push: impl FnMut(usize, Vector3<f64>),
    ) -> Option<()> {
        let Some(barrier) = self.pushing() else {
            return Some(());
        };
        self.each_touching_ball(barrier, balls, |k, _, touching, _| {
            let press = touching.press(barrier);
            push(k, press.force(&touching.normal));
            sums.add(&press);
        })
    }

    /// Calls `add` with the number of each ball that an obstacle pushes, the force on the ball, and the derivatives of
    /// minus the force by place and velocity.
    pub(super) fn stiffen_balls(
        &self,
        balls: &[NodeNow],
        mut add: impl FnMut(usize, Vector3<f64>, [Matrix3<f64>; 2]),
    ) -> Option<()> {
        let Some(barrier) = self.pushing() else {
            return Some(());
        };
        self.each_touching_ball(barrier, balls, |k, _, touching, bend| {
            let press = touching.press(barrier);
            add(
                k,
                press.force(&touching.normal),
                press.stiffness(touching, bend),
            );
        })
    }

    /// Adds the forces of the obstacles on an element to those on its nodes, and the energies to the sums.
    pub(super) fn push_element(
        &self,
        (k, number): (usize, usize),
        now: &[NodeNow],
        pushed: &mut [Vector6<f64>],
        sums: &mut BarrierSums,
    ) -> Option<()> {
        let Some(barrier) = self.pushing() else {
            return Some(());
        };
        let range = self.rods[k].elements[number].nodes.clone();
        let out = &mut pushed[range.clone()];
        self.each_touching(barrier, (k, number), &now[range], |j, _, touching, _| {
            let press = touching.press(barrier);
            let force = press.force(&touching.normal);
            for (out, value) in out.iter_mut().zip(&barrier.values[j]) {
                let mut part = out.fixed_rows_mut::<3>(3);
                part += force * *value;
            }
            sums.add(&press);
        })
    }

    /// Adds the derivatives of minus the forces of the obstacles on an element, 3 x 3 blocks of pairs of nodes. `add`
    /// takes the nodes in the element, the block by place and that by velocity.
    pub(super) fn stiffen_element(
        &self,
        (k, number): (usize, usize),
        now: &[NodeNow],
        mut add: impl FnMut(usize, usize, [Matrix3<f64>; 2]),
    ) -> Option<()> {
        let Some(barrier) = self.pushing() else {
            return Some(());
        };
        let range = self.rods[k].elements[number].nodes.clone();
        self.each_touching(barrier, (k, number), &now[range], |j, _, touching, bend| {
            let blocks = touching.press(barrier).stiffness(touching, bend);
            let values = &barrier.values[j];
            for (a, left) in values.iter().enumerate() {
                for (b, right) in values.iter().enumerate() {
                    add(a, b, blocks.map(|block| block * (left * right)));
                }
            }
        })
    }
}

impl BarrierSums {
    fn add(&mut self, press: &Press) {
        self.energy += press.energy;
        for (sum, loss) in self.losses.iter_mut().zip(press.losses) {
            *sum += loss;
        }
    }
}

impl ElementRod {
    /// True for a section that something on the ground holds: as far along the rod as its diameter.
    fn is_at_ground(&self, s: f64, surface: &RoundSurface) -> bool {
        let near = 2.0 * surface.radius / self.law().length() + 1e-12;
        let on_ground = |node: Option<&ElementNode>| {
            node.is_some_and(|node| matches!(node.shift, Carrier::Ground(_)))
        };
        (s <= near && on_ground(self.nodes.first()))
            || (1.0 - s <= near && on_ground(self.nodes.last()))
    }
}

impl ElementMoment {
    /// Energy of the barrier of obstacles.
    pub fn barrier(&self) -> f64 {
        self.barrier
    }
}

impl ElementAssembly {
    /// The strength of the barrier of a motion from a moment under the loads at `times`. The barrier stops surfaces at
    /// the speed that the mean body reaches by the loads along the rods, or by all energy of the start.
    pub fn barrier_strength(&self, at: &ElementMoment, times: &[f64]) -> Option<BarrierStrength> {
        let barrier = self.barrier.as_ref()?;
        let lengths = || self.rods.iter().map(|rod| rod.law().length());
        let longest = lengths().fold(0.0, f64::max);
        let mass = barrier.density * lengths().sum::<f64>();
        let [kinetic, rods, stored, _] = self.energies(at);
        let least = LEAST_ENERGY * self.stiffest_bending() / longest;
        let fall = self.largest_load(at, times) * longest;
        let driven = self.driven_energy(times);
        let speed = (2.0 * (fall + kinetic + rods + stored + driven + least) / mass).sqrt();
        let release = RELEASE * speed;
        Some(BarrierStrength {
            push: speed * release / barrier.given.gap,
            settling: 1.0 / release,
        })
    }

    /// Size of the energy that the motions of clamps put into rods: that of a beam whose middle is held, or, of a turn,
    /// that of a rod bent by half a turn at most.
    fn driven_energy(&self, times: &[f64]) -> f64 {
        let Some(first) = times.first() else {
            return 0.0;
        };
        let shortest = self.length_of_shortest();
        let start = self.grounds(*first);
        let (mut shift, mut turn) = (0.0_f64, 0.0_f64);
        for t in times {
            for (from, to) in start.iter().zip(self.grounds(*t)) {
                let way = from.pose().inverse() * to.pose();
                shift = shift.max(way.translation.vector.norm() / shortest);
                turn = turn.max(way.rotation.angle());
            }
        }
        let size = HELD_BEAM * shift.min(1.0).powi(2) + 0.5 * turn * turn;
        size * self.stiffest_bending() / shortest
    }

    /// Sets the strength of the barrier.
    #[must_use]
    pub fn with_barrier_strength(mut self, strength: Option<BarrierStrength>) -> Self {
        if let (Some(barrier), Some(strength)) = (&mut self.barrier, strength) {
            barrier.strength = strength;
        }
        self
    }

    /// The strength of the barrier.
    pub fn strength(&self) -> Option<BarrierStrength> {
        Some(self.barrier.as_ref()?.strength)
    }

    fn stiffest_bending(&self) -> f64 {
        let each = self
            .rods
            .iter()
            .filter_map(|rod| super::bending(rod.law()).ok());
        each.fold(0.0, f64::max)
    }

    /// All surface points, in the order of their anchors: points of rods, then balls.
    fn surface_points(&self, barrier: &Barrier, at: &ElementMoment) -> Vec<SurfacePoint> {
        let rods = self.rods.iter().zip(&at.nodes);
        let elements = rods.flat_map(|(rod, now)| {
            let nodes = rod.elements.iter();
            nodes.map(|element| &now[element.nodes.clone()])
        });
        let points = elements.flat_map(|nodes| {
            let values = barrier.values.iter();
            values.map(|values| point_of(nodes, values, 0.0))
        });
        let balls = at.balls.iter().map(|now| SurfacePoint {
            place: now.position,
            velocity: now.velocity,
            mass: 0.0,
        });
        points.chain(balls).collect()
    }

    /// Places of all surface points.
    fn surface_places(&self, barrier: &Barrier, at: &ElementMoment) -> Vec<Vector3<f64>> {
        let points = self.surface_points(barrier, at);
        points.iter().map(|point| point.place).collect()
    }
}
