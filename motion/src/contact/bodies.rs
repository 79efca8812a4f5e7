//! Bodies with shapes, obstacles, and the properties of their surfaces, as data.

use super::sheet_list::SheetList;
use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};
use snaprod_systems::body::Mass;
use snaprod_systems::contact::{
    ContactPair, Gap, MovingObstacle, PlacedShape, RigidMotion, SurfacePair,
};
use snaprod_systems::error::{Error, Result};
use std::sync::Arc;

/// Depth beyond which an obstacle is over the base of a rod.
const OVER: f64 = 1e-9;
/// Times at which moving obstacles are looked for at the bases of rods.
const LOOKS: u32 = 1000;

/// The partner in a contact of a body. Bodies and obstacles are numbered in the order in which they were added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Partner {
    /// The body of this number. An event names the body of the larger number as the partner.
    Body(usize),
    /// The obstacle of this number.
    Obstacle(usize),
}

/// A possible contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ContactId {
    /// The body.
    pub body: usize,
    /// The partner.
    pub partner: Partner,
    /// The number of the place of the pair of shapes: the end of a capsule, the corner of a box.
    pub place: usize,
}

/// Wrenches (couple, force) at the reference points of the bodies, in the world, as a function of time and of the
/// bodies' poses and velocities.
pub type Forces = Arc<dyn Fn(f64, &[RigidMotion], &mut [Vector6<f64>]) + Send + Sync>;

/// A body: mass, loads and shape.
#[derive(Debug, Clone)]
pub(super) struct Body {
    pub mass: Mass,
    pub shape: PlacedShape,
}

/// One possible contact: gap function and surfaces.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub id: ContactId,
    pub pair: ContactPair,
    pub surface: SurfacePair,
}

/// Bodies without rods, with obstacles and the properties of all surfaces.
#[derive(Clone)]
pub struct Bodies {
    pub(super) bodies: Vec<Body>,
    pub(crate) obstacles: Vec<MovingObstacle>,
    pub(super) candidates: Vec<Candidate>,
    pub(super) forces: Option<Forces>,
    /// Pairs without a closed form of the contact, as far as the user has not left them out.
    refused: Vec<(usize, Partner, Error)>,
    /// Rods that pass through obstacles, both by number.
    rods_apart: Vec<(usize, usize)>,
    default: SurfacePair,
    names: Vec<String>,
    obstacle_names: Vec<String>,
    /// Sheets of a rod that touches the obstacles, made in runs.
    pub(crate) sheets: SheetList,
}

impl Bodies {
    /// No bodies yet. `surface` holds for all pairs that [`Bodies::set_surface`] does not name.
    pub fn new(surface: SurfacePair) -> Self {
        Self {
            bodies: Vec::new(),
            obstacles: Vec::new(),
            candidates: Vec::new(),
            forces: None,
            refused: Vec::new(),
            rods_apart: Vec::new(),
            default: surface,
            names: Vec::new(),
            obstacle_names: Vec::new(),
            sheets: SheetList::default(),
        }
    }

    /// Adds a body with its loads and its shape, and returns its number. It can touch all bodies and obstacles.
    ///
    /// # Errors
    /// A mass seen from a clamp.
    pub fn add_body(&mut self, mass: Mass, shape: impl Into<PlacedShape>) -> Result<usize> {
        if mass.support().is_some() {
            return Err(Error::domain(
                "a body with contact is seen from the world: it has no support",
            ));
        }
        let (number, shape) = (self.bodies.len(), shape.into());
        for other in 0..number {
            let pairs = ContactPair::of_bodies(&self.bodies[other].shape, &shape);
            self.add_pairs(other, Partner::Body(number), pairs);
        }
        for k in 0..self.obstacles.len() {
            let pairs = ContactPair::of_obstacle(&shape, self.obstacles[k].obstacle());
            self.add_pairs(number, Partner::Obstacle(k), pairs);
        }
        self.bodies.push(Body { mass, shape });
        Ok(number)
    }

    /// Adds an obstacle, fixed or moving, and returns its number. All bodies can touch the obstacle.
    pub fn add_obstacle(&mut self, obstacle: impl Into<MovingObstacle>) -> usize {
        let (number, obstacle) = (self.obstacles.len(), obstacle.into());
        for k in 0..self.bodies.len() {
            let pairs = ContactPair::of_obstacle(&self.bodies[k].shape, obstacle.obstacle());
            self.add_pairs(k, Partner::Obstacle(number), pairs);
        }
        self.obstacles.push(obstacle);
        number
    }

    /// Adds the possible contacts of a pair, or its refusal.
    fn add_pairs(&mut self, body: usize, partner: Partner, pairs: Result<Vec<ContactPair>>) {
        let pairs = match pairs {
            Ok(pairs) => pairs,
            Err(why) => return self.refused.push((body, partner, why)),
        };
        for (place, pair) in pairs.into_iter().enumerate() {
            self.candidates.push(Candidate {
                id: ContactId {
                    body,
                    partner,
                    place,
                },
                pair,
                surface: self.default,
            });
        }
    }

    /// The coefficient of friction of the bodies with an obstacle; the largest, if there are several.
    pub(crate) fn friction_of(&self, obstacle: usize) -> f64 {
        let own = |candidate: &&Candidate| candidate.id.partner == Partner::Obstacle(obstacle);
        let frictions = self.candidates.iter().filter(own);
        frictions.fold(0.0, |most, candidate| {
            candidate.surface.friction().max(most)
        })
    }

    /// True if two pairs are the same, in either order of two bodies.
    fn is_same(one: (usize, Partner), other: (usize, Partner)) -> bool {
        let turned = match other {
            (body, Partner::Body(b)) => one == (b, Partner::Body(body)),
            _ => false,
        };
        one == other || turned
    }

    fn check_pair(&self, body: usize, partner: Partner) -> Result<()> {
        let there = match partner {
            Partner::Body(other) => other < self.bodies.len() && other != body,
            Partner::Obstacle(k) => k < self.obstacles.len(),
        };
        if there && body < self.bodies.len() {
            return Ok(());
        }
        Err(Error::domain(format!(
            "the pair of body {body} and {partner:?} does not exist: there are {} bodies and {} obstacles",
            self.bodies.len(),
            self.obstacles.len()
        )))
    }

    /// Sets the surfaces of one pair.
    ///
    /// # Errors
    /// A pair that does not exist.
    pub fn set_surface(
        &mut self,
        body: usize,
        partner: Partner,
        surface: SurfacePair,
    ) -> Result<()> {
        self.check_pair(body, partner)?;
        for candidate in &mut self.candidates {
            if Self::is_same((candidate.id.body, candidate.id.partner), (body, partner)) {
                candidate.surface = surface;
            }
        }
        Ok(())
    }

    /// Leaves a pair out: the two pass through each other.
    ///
    /// # Errors
    /// A pair that does not exist.
    pub fn leave_out(&mut self, body: usize, partner: Partner) -> Result<()> {
        self.check_pair(body, partner)?;
        let pair = (body, partner);
        (self.candidates).retain(|c| !Self::is_same((c.id.body, c.id.partner), pair));
        (self.refused).retain(|(body, partner, _)| !Self::is_same((*body, *partner), pair));
        Ok(())
    }

    /// Lets a rod, by its number in an assembly, pass through an obstacle.
    pub fn leave_out_rod(&mut self, rod: usize, obstacle: usize) {
        self.rods_apart.push((rod, obstacle));
    }

    /// The distances of a rod from the obstacles that the rod touches, at time `t`: the number of each obstacle, with
    /// the gap as a function of a place in the world.
    pub(crate) fn gaps_of_rod(
        &self,
        rod: usize,
        t: f64,
    ) -> impl Iterator<Item = (usize, impl Fn(&Vector3<f64>) -> Gap + '_)> + '_ {
        let all = self.obstacles.iter().enumerate();
        let touched = all.filter(move |(k, _)| !self.rods_apart.contains(&(rod, *k)));
        touched.map(move |(k, obstacle)| {
            let frame = obstacle.motion(t).0;
            let gap = move |x: &Vector3<f64>| {
                let gap = obstacle.obstacle().gap(&frame.seen(x));
                Gap {
                    normal: frame.pose.rotation * gap.normal,
                    ..gap
                }
            };
            (k, gap)
        })
    }

    /// The first of many times up to `duration` at which an obstacle has moved over the base of a rod, which is outside
    /// of the obstacle at the start: the number of the obstacle, and the time.
    pub fn moves_over(
        &self,
        rod: usize,
        base: &Vector3<f64>,
        duration: f64,
    ) -> Option<(usize, f64)> {
        let inside = |t: f64, number: usize| {
            let mut gaps = self.gaps_of_rod(rod, t);
            gaps.any(|(k, gap)| k == number && gap(base).value < -OVER)
        };
        let moving =
            (0..self.obstacles.len()).filter(|k| self.obstacles[*k].moves() && !inside(0.0, *k));
        let first = moving.filter_map(|k| {
            let mut times = (1..=LOOKS).map(|i| duration * f64::from(i) / f64::from(LOOKS));
            times.find(|t| inside(*t, k)).map(|t| (k, t))
        });
        first.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The name of a body in messages.
    pub(super) fn body_name(&self, k: usize) -> String {
        match self.names.get(k) {
            Some(name) => name.clone(),
            None => format!("body {k}"),
        }
    }

    /// The name of a partner in messages.
    pub(super) fn partner_name(&self, partner: Partner) -> String {
        match partner {
            Partner::Body(k) => self.body_name(k),
            Partner::Obstacle(k) => self.obstacle_name(k),
        }
    }

    /// The name of an obstacle in messages.
    pub(crate) fn obstacle_name(&self, k: usize) -> String {
        match self.obstacle_names.get(k) {
            Some(name) => format!("{name:?}"),
            None => format!("obstacle {k}"),
        }
    }

    /// Sets the names of bodies and obstacles in messages, in the order in which they were added.
    pub fn set_names(&mut self, bodies: Vec<String>, obstacles: Vec<String>) {
        (self.names, self.obstacle_names) = (bodies, obstacles);
    }

    /// Refuses pairs without a closed form that the user has not left out.
    pub(super) fn check(&self) -> Result<()> {
        let Some((body, partner, why)) = self.refused.first() else {
            return Ok(());
        };
        let [one, other] = [self.body_name(*body), self.partner_name(*partner)];
        Err(why.clone().context(format!("{one} and {other}")))
    }

    /// Adds forces beyond the loads of the bodies. Their work counts as work of loads.
    pub fn set_forces(&mut self, forces: Forces) {
        self.forces = Some(forces);
    }

    /// True if an obstacle moves.
    pub(crate) fn moves(&self) -> bool {
        self.obstacles.iter().any(MovingObstacle::moves)
    }

    /// Number of bodies.
    pub fn len(&self) -> usize {
        self.bodies.len()
    }

    /// True if there is no body.
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// The possible contacts.
    pub fn contacts(&self) -> impl Iterator<Item = ContactId> {
        self.candidates.iter().map(|candidate| candidate.id)
    }

    /// The first time after `t` at which a load or the motion of an obstacle is not smooth.
    pub(crate) fn next_break(&self, t: f64) -> f64 {
        let loads = self.bodies.iter().map(|body| body.mass.next_break(t));
        let moves = self.obstacles.iter().map(|obstacle| obstacle.next_break(t));
        loads.chain(moves).fold(f64::INFINITY, f64::min)
    }
}

/// Numbers of a state: time and five sums, then those of each body.
pub(super) const SUMS: usize = 6;
/// Numbers of one body: quaternion (w, x, y, z), place, twist.
pub(super) const PER_BODY: usize = 13;
/// Place in a state of the work of loads, the losses to drag and to friction, the work of obstacles, and the loss in
/// impacts.
pub(super) const WORK: usize = 1;
pub(super) const DRAG: usize = 2;
pub(super) const FRICTION: usize = 3;
pub(super) const OBSTACLES: usize = 4;
pub(super) const IMPACTS: usize = 5;

/// The part of a state, or of a slope, that belongs to body `k`.
pub(super) fn place_of(k: usize) -> usize {
    SUMS + PER_BODY * k
}

/// The motion of a body from its numbers.
pub(super) fn read_motion(numbers: &[f64]) -> RigidMotion {
    let turn = nalgebra::Quaternion::new(numbers[0], numbers[1], numbers[2], numbers[3]);
    let vector = |i: usize| Vector3::new(numbers[i], numbers[i + 1], numbers[i + 2]);
    RigidMotion {
        pose: Isometry3::from_parts(vector(4).into(), UnitQuaternion::new_normalize(turn)),
        spin: vector(7),
        velocity: vector(10),
    }
}

/// Writes the numbers of a body.
pub(super) fn write_motion(motion: &RigidMotion, numbers: &mut [f64]) {
    let q = motion.pose.rotation.quaternion();
    numbers[..4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
    numbers[4..7].copy_from_slice(motion.pose.translation.vector.as_slice());
    numbers[7..10].copy_from_slice(motion.spin.as_slice());
    numbers[10..13].copy_from_slice(motion.velocity.as_slice());
}
