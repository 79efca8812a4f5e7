//! A rod with mass and the body at its end, if any: balance, energies, linearisation.
//!
//! The base follows its attachment ([`RodSupport`]). All vectors are along the axes of the frame of the assembly. The
//! derivatives have six more rows and columns for a base that moves with bodies, or turns by itself.

use super::frames::{Accelerations, Curve, Flow, PoseDerivatives, Sections, Shape, Triple};
use super::law::{Answer, Law};
use super::mass::{add_mass, parts};
use super::maxwell_nodes::Memory;
use super::turning_load::{TurningLoad, at_place};
use crate::assembly::{AttachedTo, BodyMotion, Tube};
use crate::body::{EndMotion, Mass, MassLinear, PointMass, RigidBody};
use crate::error::{Error, Result};
use crate::math::product::Matrix;
use crate::math::se3::{Turn, halves, join, spin as spin_of, unit};
use crate::rod::{DistributedLoad, LoadsWithoutPotential};
use crate::section::{MassAlong, Strain};
use crate::viscoelastic::grid::{FEWEST, Grid};
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector1, Vector3,
    Vector6,
};
use std::sync::Arc;

/// Description of a rod with mass, independent of the nodes of [`HeavyRod`].
#[derive(Debug, Clone)]
pub struct RodDescription {
    /// The section, in the units of the rod.
    pub law: Law,
    /// Kinematics, in the plane or in space.
    pub curve: Curve,
    /// Mass of the whole rod, over that of the body.
    pub mass: f64,
    /// Rotary inertia per length about the middle of the sections, along their directors, its mean along the rod. None:
    /// none in the plane, that of slender sections in space.
    pub rotary: Option<Matrix3<f64>>,
    /// Variation of mass and rotary inertia along the rod; None if they are even.
    pub along: Option<MassAlong>,
    /// A point of mass 1 under gravity, on the clamp of the rod; scaled, it represents each piece of the rod.
    pub grain: PointMass<3>,
    /// Dead force per length, in the world.
    pub distributed: Option<DistributedLoad>,
    /// Couples along the rod, and loads that turn with the sections; in space only.
    pub turning: Option<LoadsWithoutPotential>,
    /// The body at an end without attachment, if any.
    pub body: Option<Mass>,
    /// Contact diameter; None if contacts are ignored.
    pub diameter: Option<f64>,
}

/// A rod with mass at given nodes.
#[derive(Debug, Clone)]
pub struct HeavyRod {
    /// Description of the rod.
    pub given: RodDescription,
    /// Kinematics at the nodes.
    pub sections: Sections,
    /// Masses at the sections, the body last.
    masses: Vec<Mass>,
    /// Unloaded strains at the nodes.
    unloaded: Vec<Strain>,
    /// Maxwell branches.
    pub(super) memory: Memory,
    hinge: Option<Hinge>,
    /// True if derivatives have columns of the base.
    moving_base: bool,
}

/// A base on a ball joint. Its rotation adds a field that vanishes at all nodes: phi = P_n(2 s - 1). Gauss' rule
/// leaves out the integral c^2/(2 n + 1) of phi^2, of the part c P_n of phi. Here c is the rotation of the base minus
/// the extrapolation from the nodes.
#[derive(Debug, Clone)]
struct Hinge {
    /// Rotary inertia of that field.
    inertia: f64,
    /// Values at the base of fields that are 1 at one node.
    weights: Vec<f64>,
}

impl Hinge {
    /// c, from the rotation of the base and those at the nodes.
    fn part(&self, base: Vector3<f64>, nodes: &[Vector3<f64>]) -> Vector3<f64> {
        let pairs = self.weights.iter().zip(nodes);
        pairs.fold(base, |part, (weight, x)| part - x * *weight)
    }

    /// Derivatives of c, by columns; those from `base` on rotate the base.
    fn rows(&self, of: &Triple, base: Option<usize>) -> [DMatrix<f64>; 3] {
        let weights = DMatrix::from_row_slice(1, self.weights.len(), &self.weights);
        std::array::from_fn(|k| {
            let mut row = -(&weights * of[k].rows(0, self.weights.len()));
            if let Some(base) = base {
                row[base + k] += 1.0;
            }
            row
        })
    }
}

/// State of the rod: strains, rates, poses and velocities.
#[derive(Debug, Clone)]
pub struct RodState {
    /// All six strains at the nodes.
    pub strains: Vec<Strain>,
    /// All six strain rates at the nodes.
    pub rates: Vec<Strain>,
    /// Poses.
    pub shape: Shape,
    /// Velocities.
    pub flow: Flow,
    /// Angular velocity of the base.
    spin: Vector3<f64>,
    /// Strains of the springs of Maxwell branches, node by node; empty if they carry no load.
    springs: Vec<Strain>,
    /// Law of the moment, where it varies in time.
    law: Option<Arc<Law>>,
}

/// Support of a rod. By default the base is fixed and the end is free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodSupport {
    /// Acceleration of the base (angular first).
    pub base: Vector6<f64>,
    /// (couple, force) on an end without a body of its own.
    pub end: Vector6<f64>,
}

impl Default for RodSupport {
    fn default() -> Self {
        Self {
            base: Vector6::zeros(),
            end: Vector6::zeros(),
        }
    }
}

/// Balance of the rod at given second derivatives of the strains.
#[derive(Debug, Clone)]
pub struct Balance {
    /// J^T (masses - loads) + weights (resultants): zero in a motion.
    pub residual: DVector<f64>,
    /// (couple, force) of the rod on the masses at the sections.
    pub wrenches: Vec<Vector6<f64>>,
    /// Couple of the base's additional rotation field (`Hinge`).
    turned: Vector3<f64>,
    /// (couple, force) that holds the base.
    pub base: Vector6<f64>,
    /// Accelerations of the sections.
    pub change: Accelerations,
    /// Powers: of friction, of loads without potential, of drag.
    pub powers: [f64; 3],
}

/// Derivatives of the residual.
#[derive(Debug, Clone)]
pub struct Derivatives {
    /// By the strains, without Maxwell branches.
    pub by_strain: DMatrix<f64>,
    /// By the rates.
    pub by_rate: DMatrix<f64>,
    /// By the second derivatives: the mass matrix.
    pub mass: DMatrix<f64>,
    /// Derivatives of the acceleration of the end by strains, rates and second derivatives.
    pub end: [DMatrix<f64>; 3],
}

impl RodState {
    /// Pose and twist of the end.
    pub fn end(&self) -> BodyMotion {
        BodyMotion {
            pose: self.shape.end(),
            twist: self.flow.end(),
        }
    }
}

/// Radius of gyration of slender sections at nodes, over the length. Rotary inertia then lowers the fourth frequency of
/// a cantilever by 5e-11.
const SLENDER: f64 = 1e-6;

impl RodDescription {
    /// Rotary inertia per length at a node at s.
    pub(super) fn rotary_at_nodes(&self, s: f64) -> Option<Matrix3<f64>> {
        let slender = || {
            let bending = self.mass * self.law.length() * SLENDER.powi(2);
            Matrix3::from_diagonal(&Vector3::new(bending, bending, 2.0 * bending))
        };
        match self.curve {
            Curve::Plane => self.rotary_at(s),
            Curve::Space => self.rotary_at(s).or_else(|| Some(slender())),
        }
    }

    /// Points in (0, 1) at which the law or the load is not smooth.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.law.breaks();
        breaks.extend(self.loads().flat_map(DistributedLoad::breaks));
        breaks.sort_by(f64::total_cmp);
        breaks.dedup_by(|a, b| *a - *b < 1e-12);
        breaks
    }

    /// All loads along the rod.
    fn loads(&self) -> impl Iterator<Item = &DistributedLoad> {
        let turning = self.turning.iter();
        let turning = turning
            .flat_map(|loads| [&loads.follower_force, &loads.couple, &loads.follower_couple]);
        self.distributed.iter().chain(turning)
    }

    /// True if a load acts on a single place of the rod, which nodes of elements alone can carry.
    pub fn has_point_loads(&self) -> bool {
        self.loads().any(|load| load.points().next().is_some())
    }

    /// Dead force at the single place s.
    pub(super) fn force_at_place(&self, s: f64) -> Vector3<f64> {
        let load = self.distributed.as_ref();
        load.map_or(Vector3::zeros(), |load| at_place(load, s)) * self.law.length()
    }

    /// Loads without a potential on the pieces (s, part of the rod) of a node at `place`, with those at the place
    /// itself.
    pub(super) fn turning_on(&self, pieces: &[(f64, f64)], place: f64) -> Option<TurningLoad> {
        let (loads, length) = (self.turning.as_ref()?, self.law.length());
        let pieces: Vec<_> = pieces.iter().map(|(s, part)| (*s, part * length)).collect();
        Some(TurningLoad::on_pieces(loads, &pieces).with_place(loads, place, length))
    }

    /// Mass per length at s, over its mean.
    pub(super) fn density(&self, s: f64) -> f64 {
        self.along
            .as_ref()
            .map_or(1.0, |along| along.density().at(s))
    }

    /// Rotary inertia per length at s, if any.
    pub(super) fn rotary_at(&self, s: f64) -> Option<Matrix3<f64>> {
        let mean = self.rotary?;
        Some(match &self.along {
            Some(along) => mean * Matrix3::from_diagonal(&along.rotary(s)),
            None => mean,
        })
    }

    /// Mass of a piece of the rod at s, of the part `weight` of the rod, and the dead force on it.
    fn weight_of_piece(&self, s: f64, weight: f64) -> (f64, Vector3<f64>) {
        let mass = self.mass * self.density(s) * weight;
        let force = self.distributed.as_ref();
        let force = force.map_or(Vector3::zeros(), |load| load.density(s));
        let force = force * (self.law.length() * weight);
        (mass, self.grain.constant() * mass + force)
    }

    /// A piece of the rod: the sum of its parts (s, part of the rod). Sections of a rod without rotary inertia have the
    /// given radius of gyration.
    ///
    /// # Errors
    /// A mass or an inertia that is not positive, a force that is not finite.
    pub(super) fn piece(&self, parts: &[(f64, f64)], radius: f64) -> Result<RigidBody> {
        let length = self.law.length();
        let (mut mass, mut force, mut inertia) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for (s, weight) in parts {
            let (mass_of, force_of) = self.weight_of_piece(*s, *weight);
            (mass, force) = (mass + mass_of, force + force_of);
            inertia += match self.rotary_at(*s) {
                Some(rotary) => rotary * (length * weight),
                None => Matrix3::identity() * (mass_of * radius * radius),
            };
        }
        let piece = RigidBody::new(mass, inertia)?.with_dead_force(force)?;
        Ok(match self.grain.support() {
            Some(support) => piece.with_support(support.clone()),
            None => piece,
        })
    }
}

impl HeavyRod {
    /// The rod at the nodes of `grid`.
    ///
    /// # Errors
    /// A mass, gravity or load that is not finite, a mass or an inertia that is not positive.
    pub fn new(given: RodDescription, grid: Grid) -> Result<Self> {
        if !(given.mass > 0.0 && given.mass.is_finite()) {
            return Err(Error::domain(format!(
                "the mass of the rod over that of the body, {}, must be finite and > 0",
                given.mass
            )));
        }
        let piece = |(s, weight): (&f64, &f64)| -> Result<Mass> {
            Ok(match given.rotary_at_nodes(*s) {
                None => {
                    let (mass, weight_of) = given.weight_of_piece(*s, *weight);
                    Mass::Point(held(PointMass::new(mass)?, weight_of, &given.grain)?)
                }
                Some(_) => {
                    let radius = SLENDER * given.law.length();
                    let parts = [(*s, *weight)];
                    let piece = given.piece(&parts, radius)?;
                    Mass::Rigid(match given.turning_on(&parts, *s) {
                        Some(load) => load.on(piece)?,
                        None => piece,
                    })
                }
            })
        };
        let pieces = grid.nodes().iter().zip(grid.weights()).map(piece);
        let mut masses = pieces.collect::<Result<Vec<_>>>()?;
        masses.extend(given.body.clone());
        let sections = Sections::new(grid, given.law.active(), given.curve, given.law.length());
        let nodes = sections.grid.nodes().iter();
        let unloaded = nodes
            .map(|s| given.law.unloaded(*s))
            .collect::<Result<_>>()?;
        Ok(Self {
            unloaded,
            memory: Memory::new(&given.law, sections.weights()),
            given,
            sections,
            masses,
            hinge: None,
            moving_base: true,
        })
    }

    /// The rod at the fewest nodes, which a run replaces.
    ///
    /// # Errors
    /// As [`HeavyRod::new`].
    pub fn coarse(given: RodDescription) -> Result<Self> {
        let breaks = given.breaks();
        let grid = Grid::new(&breaks, &vec![FEWEST; breaks.len() + 1]);
        Self::new(given, grid)
    }

    /// The rod with a base that does not move by itself: derivatives have no columns of the base.
    #[must_use]
    pub fn clamped(mut self) -> Self {
        self.moving_base = false;
        self
    }

    /// The rod on a clamp fixed at the clamp's pose of time `t`: an equilibrium has no inertial forces.
    pub(super) fn standing_at(&self, t: f64) -> Self {
        let stand = |mass: &Mass| mass.clone().standing_at(t);
        let mut standing = self.clone();
        standing.masses = self.masses.iter().map(stand).collect();
        standing.given.grain = standing.given.grain.standing_at(t);
        standing.given.body = self.given.body.as_ref().map(stand);
        standing
    }

    /// The rod with its base on a ball joint.
    #[must_use]
    pub fn on_hinge(mut self) -> Self {
        let grid = &self.sections.grid;
        let nodes = grid.counts()[0];
        let weights = (0..nodes).map(|i| {
            let mut unit = vec![Vector1::new(0.0); grid.len()];
            unit[i].x = 1.0;
            grid.at(&unit, 0.0).x
        });
        let element = grid.elements()[0].to() * self.given.law.length();
        let inertia = self.given.rotary_at_nodes(0.0);
        let inertia = inertia.map_or(0.0, |j| j.trace() / 3.0);
        self.hinge = Some(Hinge {
            inertia: inertia * element / (2 * nodes + 1) as f64,
            weights: weights.collect(),
        });
        self
    }

    /// Motions of the sections at places in [0, 1], of a base with this pose and twist.
    pub(super) fn motions(
        &self,
        at: &RodState,
        base: Isometry3<f64>,
        twist: Vector6<f64>,
        places: &[f64],
    ) -> Vec<BodyMotion> {
        let base = self.given.curve.base(&base);
        let (grid, length) = (&self.sections.grid, self.given.law.length());
        let nodes = 0..grid.len();
        let turned = |i: usize, v: Vector3<f64>| at.shape.directors[i] * v * length;
        let (spin, velocity) = halves(&twist);
        let strain = |i: usize| halves(&at.strains[i]);
        let rate = |i: usize| halves(&at.rates[i]);
        let bends: Vec<_> = nodes.clone().map(|i| turned(i, rate(i).0)).collect();
        let tangents: Vec<_> = nodes.clone().map(|i| turned(i, strain(i).1)).collect();
        let faster = nodes
            .clone()
            .map(|i| at.flow.spins[i].cross(&tangents[i]) + turned(i, rate(i).1));
        let faster: Vec<_> = faster.collect();
        // p' = p u/2 of the quaternions, of one sign along the rod.
        let first = base.rotation.quaternion();
        let first = Turn::new(first.w, first.i, first.j, first.k);
        let mut before = first;
        let turnings = nodes.map(|i| {
            let frame = Rotation3::from_matrix_unchecked(at.shape.directors[i]);
            let p = UnitQuaternion::from_rotation_matrix(&frame);
            let p = Turn::new(p.w, p.i, p.j, p.k);
            let p = if p.dot(&before) < 0.0 { -p } else { p };
            before = p;
            spin_of(&p, &strain(i).0) * length
        });
        let turnings: Vec<Turn> = turnings.collect();
        let motion = |s: &f64| BodyMotion {
            pose: Isometry3::from_parts(
                (base.translation.vector + grid.integral_at(&tangents, *s)).into(),
                unit(&(first + grid.integral_at(&turnings, *s))),
            ),
            twist: join(
                &(spin + grid.integral_at(&bends, *s)),
                &(velocity + grid.integral_at(&faster, *s)),
            ),
        };
        places.iter().map(motion).collect()
    }

    /// Resultants (couple, force) along the directors at the nodes in a balance.
    pub fn resultants(&self, at: &RodState, balance: &Balance) -> Vec<Vector6<f64>> {
        let couples = self.couples(&balance.wrenches, &balance.turned);
        let forces: Vec<Vector3<f64>> = parts(&balance.wrenches, 3);
        self.sections.resultants(&at.shape, &couples, &forces)
    }

    /// Centreline of this rod, number `rod`, with its ends held as given, if it has a contact diameter.
    pub fn tube<'a>(
        &'a self,
        at: &'a RodState,
        rod: usize,
        held: Vec<&'a AttachedTo>,
    ) -> Option<Tube<'a>> {
        let exact = move |s: f64| Some(self.sections.centreline(&at.shape, s));
        Tube::new(
            rod,
            self.given.diameter?,
            held,
            self.given.law.length(),
            exact,
        )
    }

    /// Number of coordinates.
    pub fn size(&self) -> usize {
        self.sections.size()
    }

    /// 1/sqrt(weight) for each coordinate: norms become means over the rod.
    pub(super) fn norm_weights(&self) -> DVector<f64> {
        let count = self.given.law.active().len();
        let weights = self.sections.grid.weights();
        DVector::from_fn(self.size(), |i, _| 1.0 / weights[i / count].sqrt())
    }

    /// Twists of the end by strains, then by a moving base; six rows.
    pub(super) fn end(&self, at: &RodState) -> DMatrix<f64> {
        self.sections.turned(&at.shape, self.moving_base).end()
    }

    /// All strains at the nodes, from coordinates.
    pub fn strains(&self, q: &[f64]) -> Vec<Strain> {
        let law = &self.given.law;
        let nodes = q.chunks_exact(law.active().len());
        nodes
            .zip(&self.unloaded)
            .map(|(e, rest)| law.all(rest, e))
            .collect()
    }

    /// All rates at the nodes.
    pub fn rates(&self, w: &[f64]) -> Vec<Strain> {
        let law = &self.given.law;
        w.chunks_exact(law.active().len())
            .map(|e| law.rates(e))
            .collect()
    }

    /// The coordinates of strains (or rates) at the nodes.
    pub fn coordinates(&self, strains: &[Strain]) -> Vec<f64> {
        let active = self.given.law.active();
        let each = strains.iter();
        each.flat_map(|e| active.iter().map(|k| e[*k])).collect()
    }

    /// Evaluates coordinates and rates; None if the strains are too large for a curve.
    pub fn moving(&self, q: &[f64], w: &[f64]) -> Option<RodState> {
        self.moving_from(&Isometry3::identity(), &Vector6::zeros(), q, w)
    }

    /// Evaluates coordinates and rates with the base at a pose and a twist.
    pub fn moving_from(
        &self,
        base: &Isometry3<f64>,
        twist: &Vector6<f64>,
        q: &[f64],
        w: &[f64],
    ) -> Option<RodState> {
        let (strains, rates) = (self.strains(q), self.rates(w));
        let shape = self.sections.shape(base, &strains)?;
        let flow = self.sections.flow(&shape, twist, &rates);
        Some(RodState {
            strains,
            rates,
            shape,
            flow,
            spin: twist.fixed_rows::<3>(0).into_owned(),
            springs: Vec::new(),
            law: None,
        })
    }

    /// The state at the time `t`, with the section law of that time. None where the law is not defined.
    pub fn seen_at(&self, t: f64, at: RodState) -> Option<RodState> {
        let law = &self.given.law;
        if !law.varies_in_time() {
            return Some(at);
        }
        Some(RodState {
            law: Some(Arc::new(law.seen_at(t)?.into_owned())),
            ..at
        })
    }

    /// Section law of a state.
    pub(super) fn law<'a>(&'a self, at: &'a RodState) -> &'a Law {
        at.law.as_deref().unwrap_or(&self.given.law)
    }

    /// The state with the dashpots of the Maxwell branches at the strains `z`.
    #[must_use]
    pub fn remembering(&self, at: RodState, q: &[f64], z: &[f64]) -> RodState {
        RodState {
            springs: self.memory.springs(q, z),
            ..at
        }
    }

    /// Dashpot strains of each Maxwell branch at the nodes.
    pub fn dashpots(&self, at: &RodState) -> Vec<Vec<Strain>> {
        let branches = self.given.law.branches().len();
        let of = |k: usize| {
            let springs = at.springs.iter().skip(k).step_by(branches);
            let pairs = at.strains.iter().zip(springs);
            pairs.map(|(e, spring)| e - spring).collect()
        };
        (0..branches).map(of).collect()
    }

    /// The balance at time `t`, with the second derivatives `a` of the coordinates; None outside the law's domain.
    pub fn balance(&self, t: f64, at: &RodState, a: &[f64]) -> Option<Balance> {
        self.balance_held(t, at, a, &RodSupport::default())
    }

    /// The balance of a rod with a moving base and an end wrench.
    pub fn balance_held(
        &self,
        t: f64,
        at: &RodState,
        a: &[f64],
        held: &RodSupport,
    ) -> Option<Balance> {
        let second = self.rates(a);
        let sections = &self.sections;
        let change = sections.change(&at.shape, &at.flow, &held.base, &second);
        let mut powers = [0.0; 3];
        let mut wrenches = Vec::with_capacity(self.masses.len());
        for (i, mass) in self.masses.iter().enumerate() {
            let (pose, v) = self.seen(at, i);
            let acceleration = join(&change.spins[i], &change.accelerations[i]);
            let wrench = mass.wrench(t, &pose, &v, &acceleration)?;
            let EndMotion { power, loss, .. } = mass.motion(t, &pose, &v, &wrench);
            powers[1] += power;
            powers[2] += loss;
            wrenches.push(wrench);
        }
        if self.given.body.is_none() {
            wrenches.push(-held.end);
        }
        let mut turned = Vector3::zeros();
        if let Some(hinge) = &self.hinge {
            let base = held.base.fixed_rows::<3>(0).into_owned();
            turned = hinge.part(base, &change.spins) * hinge.inertia;
        }
        let couples = self.couples(&wrenches, &turned);
        let forces: Vec<Vector3<f64>> = parts(&wrenches, 3);
        let mut residual = sections.gathered(&at.shape, &couples, &forces);
        let active = self.given.law.active();
        let count = active.len();
        let nodes = sections.grid.nodes().iter();
        for (j, (s, weight)) in nodes.zip(sections.weights()).enumerate() {
            let answer = self.answer(j, *s, at)?;
            powers[0] += weight * answer.loss;
            powers[1] += weight * answer.power;
            let all = answer.elastic + answer.friction;
            for (a, k) in active.iter().enumerate() {
                residual[j * count + a] += weight * all[*k];
            }
        }
        let residual = DVector::from_vec(residual);
        residual.iter().all(|x| x.is_finite()).then(|| Balance {
            base: sections.on_base(&at.shape, &couples, &forces) + join(&turned, &Vector3::zeros()),
            residual,
            wrenches,
            turned,
            change,
            powers,
        })
    }

    /// Response of the section at a node.
    fn answer(&self, node: usize, s: f64, at: &RodState) -> Option<Answer> {
        let branches = at.springs.len() / at.strains.len();
        let springs = &at.springs[node * branches..(node + 1) * branches];
        let law = self.law(at);
        law.answer(s, &at.strains[node], &at.rates[node], springs)
    }

    fn seen(&self, at: &RodState, i: usize) -> (Isometry3<f64>, Vector6<f64>) {
        let pose = if self.masses[i].turns() {
            at.shape.pose(i)
        } else {
            Isometry3::from_parts(at.shape.positions[i].into(), UnitQuaternion::identity())
        };
        (pose, join(&at.flow.spins[i], &at.flow.velocities[i]))
    }

    /// The mass matrix M, with J; six more rows and columns for a moving base.
    pub fn mass_matrix(&self, t: f64, at: &RodState) -> Option<(DMatrix<f64>, PoseDerivatives)> {
        let turned = self.sections.turned(&at.shape, self.moving_base);
        let none = Vector6::zeros();
        let linear = self.masses(t, at, &vec![none; self.masses.len()])?;
        let mut mass = self.gathered_twice(
            &linear,
            |m| &m.by_acceleration,
            [&turned.phi, &turned.r],
            [&turned.phi, &turned.r],
        );
        self.add_hinge(&turned, [(&mut mass, &turned.phi, true)]);
        Some((mass, turned))
    }

    /// Derivatives of the residual of `balance`; None outside the law's domain.
    pub fn derivatives(&self, t: f64, at: &RodState, balance: &Balance) -> Option<Derivatives> {
        let turned = self.sections.turned(&at.shape, self.moving_base);
        let carried = self
            .sections
            .carried(&at.shape, &at.flow, &balance.change, &turned);
        let linear = self.masses(t, at, &balance.wrenches)?;
        let twist = [&turned.phi, &turned.r];
        let of = |m: [&Triple; 2], which: fn(&MassLinear) -> &Matrix6<f64>| {
            self.gathered_twice(&linear, which, twist, m)
        };
        let inertia: fn(&MassLinear) -> &Matrix6<f64> = |m| &m.by_acceleration;
        let drag: fn(&MassLinear) -> &Matrix6<f64> = |m| &m.by_velocity;
        let place: fn(&MassLinear) -> &Matrix6<f64> = |m| &m.by_pose;
        let mut stiffness = of(carried.by_strain.each_ref(), inertia);
        stiffness += of(carried.velocity.each_ref(), drag);
        stiffness += of(twist, place);
        stiffness += self.sections.geometric(
            &at.shape,
            &turned,
            &self.couples(&balance.wrenches, &balance.turned),
            &parts(&balance.wrenches, 3),
        );
        let mut damping = of(carried.by_rate.each_ref(), inertia);
        damping += of(twist, drag);
        let mut mass = of(twist, inertia);
        let changes = [
            (&mut stiffness, &carried.by_strain[0], false),
            (&mut damping, &carried.by_rate[0], false),
            (&mut mass, &turned.phi, true),
        ];
        self.add_hinge(&turned, changes);
        self.add_section(at, &mut stiffness, &mut damping)?;
        let [end_by_strain, end_by_rate] = carried.end();
        Some(Derivatives {
            by_strain: stiffness,
            by_rate: damping,
            mass,
            end: [end_by_strain, end_by_rate, turned.end()],
        })
    }

    /// Couples at the sections; `turned` is that of the base's additional rotation field.
    fn couples(&self, wrenches: &[Vector6<f64>], turned: &Vector3<f64>) -> Vec<Vector3<f64>> {
        let mut couples = parts(wrenches, 0);
        let weights = self.hinge.iter().flat_map(|hinge| &hinge.weights);
        for (couple, weight) in couples.iter_mut().zip(weights) {
            *couple -= turned * *weight;
        }
        couples
    }

    /// Adds the terms of the base's additional rotation field to matrices. Each comes with the rotations of its
    /// sections, and with a flag whether the base rotates along.
    fn add_hinge<const K: usize>(
        &self,
        turned: &PoseDerivatives,
        changes: [(&mut DMatrix<f64>, &Triple, bool); K],
    ) {
        let Some(hinge) = &self.hinge else { return };
        let left = hinge.rows(&turned.phi, Some(self.size()));
        for (matrix, by, base) in changes {
            let right = hinge.rows(by, base.then(|| self.size()));
            for (left, right) in left.iter().zip(&right) {
                matrix.gemm_tr(hinge.inertia, left, right, 1.0);
            }
        }
    }

    /// Adds the response of the sections' law.
    pub(super) fn add_section(
        &self,
        at: &RodState,
        stiffness: &mut DMatrix<f64>,
        damping: &mut DMatrix<f64>,
    ) -> Option<()> {
        let active = self.given.law.active();
        let count = active.len();
        let nodes = self.sections.grid.nodes().iter();
        for (j, (s, weight)) in nodes.zip(self.sections.weights()).enumerate() {
            let section = self.law(at).stiffness(*s, &at.strains[j], &at.rates[j])?;
            for (a, k) in active.iter().enumerate() {
                for (b, l) in active.iter().enumerate() {
                    let place = (j * count + a, j * count + b);
                    stiffness[place] += weight * section.by_strain[(*k, *l)];
                    damping[place] += weight * section.by_rate[(*k, *l)];
                }
            }
        }
        Some(())
    }

    fn masses(&self, t: f64, at: &RodState, wrenches: &[Vector6<f64>]) -> Option<Vec<MassLinear>> {
        let each = self.masses.iter().zip(wrenches).enumerate();
        each.map(|(i, (mass, wrench))| {
            let (pose, v) = self.seen(at, i);
            mass.linear(t, &pose, &v, wrench)
        })
        .collect()
    }

    /// sum_i left_i^T matrix_i right_i over the sections.
    fn gathered_twice(
        &self,
        linear: &[MassLinear],
        which: impl Fn(&MassLinear) -> &Matrix6<f64>,
        left: [&Triple; 2],
        right: [&Triple; 2],
    ) -> DMatrix<f64> {
        let columns = left[0][0].ncols();
        let mut out = DMatrix::zeros(columns, columns);
        let last = self.sections.grid.len();
        for k in 0..6 {
            // The pieces of the rod by one product of matrices for each component on the left.
            let mut pushed: Option<DMatrix<f64>> = None;
            for l in 0..6 {
                let factors: Vec<f64> = linear[..last].iter().map(|m| which(m)[(k, l)]).collect();
                if factors.iter().all(|x| *x == 0.0) {
                    continue;
                }
                let mut scaled = right[l / 3][l % 3].rows(0, last).into_owned();
                for mut column in scaled.column_iter_mut() {
                    for (x, factor) in column.iter_mut().zip(&factors) {
                        *x *= *factor;
                    }
                }
                pushed = Some(match pushed {
                    Some(sum) => sum + scaled,
                    None => scaled,
                });
            }
            if let Some(pushed) = pushed {
                let turned = left[k / 3][k % 3].rows(0, last).transpose();
                let [product] = Matrix::new(&turned).times_all([&pushed]);
                out += product;
            }
        }
        if let Some(body) = linear.get(last) {
            add_mass(&mut out, last, which(body), left, right);
        }
        out
    }

    /// Kinetic energy of the body and of the rod.
    pub fn kinetic(&self, t: f64, at: &RodState) -> [f64; 2] {
        let each = self.masses.iter().enumerate();
        let energies: Vec<f64> = each
            .map(|(i, mass)| {
                let (pose, v) = self.seen(at, i);
                mass.kinetic(t, &pose, &v)
            })
            .collect();
        let (rod, body) = energies.split_at(self.sections.grid.len());
        let hinge = self.hinge.as_ref().map_or(0.0, |hinge| {
            0.5 * hinge.inertia * hinge.part(at.spin, &at.flow.spins).norm_squared()
        });
        [body.iter().sum(), rod.iter().sum::<f64>() + hinge]
    }

    /// Potential of gravity and constant loads, on body and rod.
    pub fn potential(&self, t: f64, at: &RodState) -> f64 {
        let each = self.masses.iter().enumerate();
        each.map(|(i, mass)| mass.potential(t, &self.seen(at, i).0))
            .sum()
    }

    /// Stored energy, and dissipation per length and time at the nodes.
    pub fn stored(&self, at: &RodState) -> Option<(f64, Vec<f64>)> {
        let grid = &self.sections.grid;
        let mut energy = 0.0;
        let mut lost = Vec::with_capacity(grid.len());
        for (j, (s, weight)) in grid.nodes().iter().zip(self.sections.weights()).enumerate() {
            let answer = self.answer(j, *s, at)?;
            energy += weight * answer.energy;
            lost.push(answer.loss);
        }
        Some((energy, lost))
    }

    /// First time after `t` at which a load or the motion of the clamp is not smooth.
    pub fn next_break(&self, t: f64) -> f64 {
        let grain = self.given.grain.next_break(t);
        let grain = grain.min(self.given.law.next_break(t));
        (self.given.body.as_ref()).map_or(grain, |body| body.next_break(t).min(grain))
    }
}

fn held(body: PointMass<3>, force: Vector3<f64>, grain: &PointMass<3>) -> Result<PointMass<3>> {
    let body = body.with_dead_force(force)?;
    Ok(match grain.support() {
        Some(support) => body.with_support(support.clone()),
        None => body,
    })
}
