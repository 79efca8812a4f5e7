//! Rods with mass, one or several, between bodies, the ground and moving supports.
//!
//! Bodies have their poses, rods their strains, counted from the attachment of the base; a base on a ball joint has
//! a rotation of its own, a joint with axes its angles and shifts. A far end is tied to its attachment by a constraint,
//! whose multiplier is the wrench at the end. Let z be the velocities of the bodies (and of the free bases and the
//! joints) and q_k the strains. D'Alembert's principle and the constraints, differentiated twice, are
//! ```text
//! rod k:    J_k^T w_k + weights (dW/de + D) - E_k^T l_k = 0,
//! bodies:   masses - loads + sum_k S_k^T (wrench on the base of rod k) + sum_k P_k^T l_k = 0,
//! ends:     acceleration of the end of rod k - acceleration of its attachment = 0,
//! ```
//! linear in (z', q'', l): index 1. Here w_k are masses times accelerations minus loads of the pieces of a rod. S_k
//! and P_k are the motions of its attachments per z, E_k those of its end per strain rate.
//!
//! A rod with a free end may carry a body of its own there: the last mass of the rod, without velocities or
//! multipliers. A single rod on its clamp is an assembly of one such rod, seen from the clamp.
//!
//! * [`HeavyAssembly`]: bodies, rods, the balance above. [`HeavyLink`]: a rod with its ties.
//! * `attachment_kinematics`: attachments, their motion and its derivatives. `joint_axes`: the freedoms of joints.
//! * `block_elimination`: derivatives of the balance, block by block, and their elimination rod by rod.
//! * `system`: the differential equations. `statics`: equilibria near a state; ends brought back to their attachments.
//!   `downhill`: stable equilibria of rods with free ends. `following`: rates tangent to the equilibria.
//!   `vibrations`: small motions about an equilibrium.

mod attachment_kinematics;
mod block_elimination;
mod downhill;
mod following;
mod joint_axes;
mod statics;
mod system;
mod vibrations;

use super::obstacles::ObstaclesOfRods;
use super::rod::{Balance, HeavyRod, RodState, RodSupport};
use crate::assembly::{AttachedTo, Attachment, Body, BodyMotion, FreeAxis, Joint, Tube};
use crate::body::{EndMotion, RigidBody};
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use crate::viscoelastic::grid::Grid;
use attachment_kinematics::{BodyNow, Seat};
pub use downhill::EITHER_SIDE;
use nalgebra::{DVector, Isometry3, Matrix3, UnitQuaternion, Vector3, Vector6};
use std::ops::Range;
use std::sync::Arc;
pub use system::INTEGRALS;

/// Mass of the body that stands for a free base, in units in which the mass of a rod is about 1: below the rounding of
/// that of the rod.
const FREE_BASE: f64 = 1e-30;

/// Tie of a rod's end: attachment and joint.
#[derive(Debug, Clone)]
pub struct Tie {
    /// The attachment.
    pub on: Attachment,
    /// Joint of the rod to what the axes carry; without axes, to the attachment.
    pub joint: Joint,
    /// Freedoms of a joint with axes, from the attachment to the rod.
    pub axes: Vec<FreeAxis>,
}

/// A rod with mass and its ties.
#[derive(Debug, Clone)]
pub struct HeavyLink {
    /// The rod.
    pub rod: HeavyRod,
    /// Tie of the base, s = 0.
    pub from: Tie,
    /// Tie of the end; None for a free end, which may carry a body of the rod's own.
    pub to: Option<Tie>,
}

/// Bodies and rods with mass.
#[derive(Debug, Clone)]
pub struct HeavyAssembly {
    /// The bodies.
    pub carriers: Vec<Body>,
    /// The rods.
    pub links: Vec<HeavyLink>,
    names: Vec<String>,
    obstacles: Option<Arc<ObstaclesOfRods>>,
    layout: AssemblyLayout,
}

/// Layout of a state: index ranges of all parts.
#[derive(Debug, Clone)]
struct AssemblyLayout {
    /// Poses and velocities of the bodies.
    bodies: Vec<Range<usize>>,
    /// First velocity of each body among all velocities, and of each base on a ball joint.
    velocities: Vec<usize>,
    turning: Vec<Option<usize>>,
    /// Quaternion and spin of each base on a ball joint.
    turns: Vec<Range<usize>>,
    /// Coordinates and rates of the joints with axes at base and end of each rod; and their first velocity, if any.
    joints: Vec<[Range<usize>; 2]>,
    sliding: Vec<[Option<usize>; 2]>,
    /// Number of velocities of bodies, bases and joints.
    free: usize,
    strains: Vec<Range<usize>>,
    rates: Vec<Range<usize>>,
    /// Dashpots of Maxwell branches.
    dashpots: Vec<Range<usize>>,
    time: usize,
    /// Second derivatives of the strains, and multipliers, within the unknowns.
    second: Vec<Range<usize>>,
    wrenches: Vec<Range<usize>>,
    /// Number of accelerations and multipliers.
    unknowns: usize,
}

/// A state unpacked.
#[derive(Debug, Clone)]
pub struct HeavyState {
    /// Time.
    pub t: f64,
    bodies: Vec<BodyNow>,
    /// Attachments of the rods, at base and end.
    seats: Vec<(Seat, Option<Seat>)>,
    /// The rods.
    pub rods: Vec<RodState>,
}

/// The balance of an assembly.
#[derive(Debug, Clone)]
pub struct HeavyBalance {
    /// Residual: bodies and free bases, rods, ends; zero in a motion.
    pub residual: DVector<f64>,
    /// Balance of each rod.
    pub rods: Vec<Balance>,
    /// (couple, force) that the bodies require.
    wrenches: Vec<Vector6<f64>>,
    /// Power of friction, of loads without potential and supports, of drag.
    pub powers: [f64; 3],
}

impl Tie {
    /// A weld or ball joint.
    pub fn new(on: Attachment, joint: Joint) -> Self {
        Self {
            on,
            joint,
            axes: Vec::new(),
        }
    }

    fn rows(&self) -> Range<usize> {
        self.joint.held()
    }

    fn turns(&self) -> bool {
        self.joint.turns()
    }

    /// True if the end moves by itself, or with a body.
    fn moves(&self) -> bool {
        self.turns() || !self.axes.is_empty() || matches!(self.on.on, AttachedTo::Body(_))
    }

    /// True if the rod turns about an axis or freely.
    pub(in crate::full_mass) fn is_turning(&self) -> bool {
        self.turns() || self.axes.iter().any(|axis| axis.turns)
    }
}

impl HeavyLink {
    /// Ties of both ends.
    pub fn ties(&self) -> impl Iterator<Item = &Tie> {
        std::iter::once(&self.from).chain(&self.to)
    }

    /// Tie of the base (0) or of the end (1); `None` for a free end.
    fn tie(&self, end: usize) -> Option<&Tie> {
        self.ties().nth(end)
    }
}

impl HeavyAssembly {
    /// A single rod on its clamp, with its body, if any, at the free end.
    ///
    /// # Errors
    /// None that is known of.
    pub fn of_rod(rod: HeavyRod) -> Result<Self> {
        let from = Tie::new(Attachment::ground(Isometry3::identity()), Joint::Weld);
        let to = None;
        Self::new(Vec::new(), vec![HeavyLink { rod, from, to }])
    }

    /// A single rod that nothing holds, with its body, if any, at the end. The first and only body of the list stands
    /// for the base.
    ///
    /// # Errors
    /// None that is known of.
    pub fn of_free_rod(rod: HeavyRod) -> Result<Self> {
        let inertia = Matrix3::from_diagonal_element(FREE_BASE);
        let base = Body::rigid(RigidBody::new(FREE_BASE, inertia)?).named("base".to_owned());
        let from = Tie::new(Attachment::body(0, Isometry3::identity()), Joint::Weld);
        let to = None;
        Self::new(vec![base], vec![HeavyLink { rod, from, to }])
    }

    /// An assembly; bodies are numbered by their position in the list.
    ///
    /// # Errors
    /// Neither body nor rod; a rod on a body that is not in the list, or welded to a point mass, or with both ends on
    /// one body; a rod with a body of its own on an end with a tie.
    pub fn new(carriers: Vec<Body>, links: Vec<HeavyLink>) -> Result<Self> {
        if carriers.is_empty() && links.is_empty() {
            return Err(Error::domain("an assembly has one body or rod at least"));
        }
        for (k, link) in links.iter().enumerate() {
            if link.rod.given.body.is_some() && link.to.is_some() {
                return Err(Error::domain(format!(
                    "rod {k} has a body of its own at an end with a tie; list the body apart"
                )));
            }
            for tie in link.ties() {
                let AttachedTo::Body(body) = tie.on.on else {
                    continue;
                };
                let carrier = carriers.get(body).ok_or_else(|| {
                    Error::domain(format!(
                        "rod {k} is attached to body {body}; there are {}",
                        carriers.len()
                    ))
                })?;
                let aside = tie.on.place.translation.vector != Vector3::zeros();
                if !carrier.turns() && (!tie.turns() || aside) {
                    return Err(Error::domain(format!(
                        "rod {k} is attached to the point mass {body}: only an end on a ball joint at the point itself can be; \
                         give the body an inertia, or use a ball joint"
                    )));
                }
            }
            if let (AttachedTo::Body(a), Some(AttachedTo::Body(b))) =
                (&link.from.on.on, link.to.as_ref().map(|tie| &tie.on.on))
                && a == b
            {
                return Err(Error::domain(format!(
                    "rod {k} begins and ends on body {a}"
                )));
            }
        }
        let links = links.into_iter().map(|link| HeavyLink {
            rod: if link.from.is_turning() {
                link.rod.on_hinge()
            } else if link.from.moves() {
                link.rod
            } else {
                link.rod.clamped()
            },
            ..link
        });
        let links: Vec<HeavyLink> = links.collect();
        Ok(Self {
            layout: AssemblyLayout::new(&carriers, &links),
            carriers,
            links,
            names: Vec::new(),
            obstacles: None,
        })
    }

    /// Names the rods, for messages.
    #[must_use]
    pub fn with_names(mut self, rods: Vec<String>) -> Self {
        self.names = rods;
        self
    }

    /// Lets rods and bodies touch obstacles.
    #[must_use]
    pub fn among(mut self, obstacles: ObstaclesOfRods) -> Self {
        self.obstacles = Some(Arc::new(obstacles));
        self
    }

    /// The obstacles that rods and bodies touch.
    pub fn obstacles(&self) -> Option<&Arc<ObstaclesOfRods>> {
        self.obstacles.as_ref()
    }

    /// Label of a rod in messages.
    pub fn rod_name(&self, rod: usize) -> String {
        match (self.names.get(rod), self.links.len()) {
            (Some(name), _) => format!("rod {name:?}"),
            (None, 1) => "the rod".to_owned(),
            (None, _) => format!("rod {rod}"),
        }
    }

    /// The assembly with other numbers of nodes on the elements of the rods.
    ///
    /// # Errors
    /// As [`HeavyRod::new`].
    pub fn with_nodes(&self, counts: &[Vec<usize>]) -> Result<Self> {
        let links = self.links.iter().zip(counts).map(|(link, counts)| {
            let given = link.rod.given.clone();
            let grid = Grid::new(&given.breaks(), counts);
            Ok(HeavyLink {
                rod: HeavyRod::new(given, grid)?,
                ..link.clone()
            })
        });
        let next = Self::new(self.carriers.clone(), links.collect::<Result<_>>()?)?;
        Ok(Self {
            obstacles: self.obstacles.clone(),
            ..next.with_names(self.names.clone())
        })
    }

    /// Index of time in a state; dissipated energy, work and loss to drag follow.
    pub fn time(&self) -> usize {
        self.layout.time
    }

    /// Number of all accelerations and multipliers, which follow the integrals in a state.
    pub fn unknowns(&self) -> usize {
        self.layout.unknowns
    }

    /// State at time 0 from poses and twists of the bodies, rotations in the world of the bases on ball joints,
    /// strains and rates. Maxwell branches carry no load. Joints with axes are at their coordinates 0, at rest
    /// ([`HeavyAssembly::with_joints_at`]).
    pub fn state(
        &self,
        bodies: &[BodyMotion],
        bases: &[UnitQuaternion<f64>],
        strains: &[Vec<f64>],
        rates: &[Vec<f64>],
    ) -> DVector<f64> {
        let layout = &self.layout;
        let mut y = DVector::zeros(layout.time + INTEGRALS + layout.unknowns);
        let slots = y.as_mut_slice();
        for ((carrier, place), range) in self.carriers.iter().zip(bodies).zip(&layout.bodies) {
            carrier.write(place, &mut slots[range.clone()]);
        }
        for (k, link) in self.links.iter().enumerate() {
            slots[layout.strains[k].clone()].copy_from_slice(&strains[k]);
            slots[layout.rates[k].clone()].copy_from_slice(&rates[k]);
            let relaxed = link.rod.memory.relaxed(&strains[k]);
            slots[layout.dashpots[k].clone()].copy_from_slice(&relaxed);
            if link.from.turns() {
                let p = bases[k].quaternion();
                let start = layout.turns[k].start;
                slots[start..start + 4].copy_from_slice(&[p.w, p.i, p.j, p.k]);
            }
        }
        y
    }

    /// The state with the coordinates of all joints with axes: rod by rod, the base before the end, axis by axis.
    #[must_use]
    pub fn with_joints_at(&self, mut y: DVector<f64>, coordinates: &[f64]) -> DVector<f64> {
        let ranges = self.layout.joints.iter().flatten();
        let slots = ranges.flat_map(|range| range.start..range.start + range.len() / 2);
        for (slot, x) in slots.zip(coordinates) {
            y[slot] = *x;
        }
        y
    }

    /// Coordinates of all joints with axes in a state, in the order of [`HeavyAssembly::with_joints_at`].
    pub fn joints_at(&self, y: &DVector<f64>) -> Vec<f64> {
        let ranges = self.layout.joints.iter().flatten();
        let slots = ranges.flat_map(|range| range.start..range.start + range.len() / 2);
        slots.map(|slot| y[slot]).collect()
    }

    /// Relaxes the Maxwell branches at the strains `at` (coordinates, rod by rod), or at the rod's own strains if None.
    #[must_use]
    pub fn relaxed(&self, mut y: DVector<f64>, at: &[Option<Vec<f64>>]) -> DVector<f64> {
        for (k, (link, range)) in self.links.iter().zip(&self.layout.dashpots).enumerate() {
            let own = || self.strains(&y, k).to_vec();
            let at = at.get(k).cloned().flatten().unwrap_or_else(own);
            let relaxed = link.rod.memory.relaxed(&at);
            y.as_mut_slice()[range.clone()].copy_from_slice(&relaxed);
        }
        y
    }

    /// Strains of rod `k` in a state.
    pub fn strains<'y>(&self, y: &'y DVector<f64>, k: usize) -> &'y [f64] {
        &y.as_slice()[self.layout.strains[k].clone()]
    }

    /// Indices in a state of bodies and free bases.
    fn places_slots(&self) -> Range<usize> {
        let rods = self.layout.strains.first();
        0..rods.map_or(self.layout.time, |q| q.start)
    }

    /// A state interpolated from the same assembly with other nodes: all but strains, rates and dashpots are copied.
    /// Accelerations and multipliers are left 0.
    pub fn carried(&self, from: &Self, y: &DVector<f64>) -> Option<DVector<f64>> {
        let at = from.at(y)?;
        let mut state = DVector::zeros(self.layout.time + INTEGRALS + self.layout.unknowns);
        let slots = state.as_mut_slice();
        let bodies = self.places_slots();
        slots[bodies.clone()].copy_from_slice(&y.as_slice()[bodies]);
        for (k, (link, moving)) in self.links.iter().zip(&at.rods).enumerate() {
            let old = &from.links[k].rod.sections.grid;
            let grid = &link.rod.sections.grid;
            let [q, w] = [&moving.strains, &moving.rates]
                .map(|field| link.rod.coordinates(&old.carried(field, grid)));
            slots[self.layout.strains[k].clone()].copy_from_slice(&q);
            slots[self.layout.rates[k].clone()].copy_from_slice(&w);
            let dashpots = from.links[k].rod.dashpots(moving);
            let dashpots = dashpots.iter().map(|field| old.carried(field, grid));
            let z: Vec<f64> = dashpots.flat_map(|z| link.rod.coordinates(&z)).collect();
            slots[self.layout.dashpots[k].clone()].copy_from_slice(&z);
        }
        let (from, to) = (from.layout.time, self.layout.time);
        slots[to..to + INTEGRALS].copy_from_slice(&y.as_slice()[from..from + INTEGRALS]);
        Some(state)
    }

    /// Accelerations and multipliers in a state.
    pub fn second<'y>(&self, y: &'y DVector<f64>) -> &'y [f64] {
        &y.as_slice()[self.layout.time + INTEGRALS..]
    }

    /// Evaluates a state; None where strains are too large for a curve.
    pub fn at(&self, y: &DVector<f64>) -> Option<HeavyState> {
        let (layout, numbers) = (&self.layout, y.as_slice());
        let t = y[layout.time];
        let bodies = self.carriers.iter().zip(&layout.bodies);
        let bodies: Vec<BodyNow> = bodies
            .map(|(carrier, range)| BodyNow::new(carrier, &numbers[range.clone()]))
            .collect();
        let mut seats = Vec::with_capacity(self.links.len());
        let mut rods = Vec::with_capacity(self.links.len());
        for (k, link) in self.links.iter().enumerate() {
            let turn = layout.turning[k].map(|z| (z, &numbers[layout.turns[k].clone()]));
            let [base, end] = [0, 1].map(|end| self.axes(k, end, numbers));
            let from = self.seat(t, &link.from.on, (base, turn), &bodies);
            let to = link.to.as_ref();
            let to = to.map(|tie| self.seat(t, &tie.on, (end, None), &bodies));
            let [q, w] = [&layout.strains[k], &layout.rates[k]].map(|r| &numbers[r.clone()]);
            let moving = link.rod.moving_from(&from.pose, &from.twist, q, w)?;
            let dashpots = &numbers[layout.dashpots[k].clone()];
            let moving = link.rod.seen_at(t, moving)?;
            rods.push(link.rod.remembering(moving, q, dashpots));
            seats.push((from, to));
        }
        Some(HeavyState {
            t,
            bodies,
            seats,
            rods,
        })
    }

    /// The wrench of the attachment on the end of rod `k`.
    pub fn end_wrench(&self, k: usize, unknowns: &[f64]) -> Vector6<f64> {
        let mut wrench = Vector6::zeros();
        if let Some(tie) = &self.links[k].to {
            let part = &unknowns[self.layout.wrenches[k].clone()];
            wrench.as_mut_slice()[tie.rows()].copy_from_slice(part);
        }
        wrench
    }

    /// Balance at given accelerations and multipliers; None outside the domain of a law.
    pub fn balance(&self, at: &HeavyState, unknowns: &[f64]) -> Option<HeavyBalance> {
        let layout = &self.layout;
        let mut residual = DVector::zeros(layout.unknowns);
        let mut free = DVector::zeros(layout.free);
        let faster = DVector::from_column_slice(&unknowns[..layout.free]);
        let mut powers = [0.0; 3];
        let mut rods = Vec::with_capacity(self.links.len());
        for (k, (link, (from, to))) in self.links.iter().zip(&at.seats).enumerate() {
            let held = RodSupport {
                base: from.acceleration(&faster),
                end: self.end_wrench(k, unknowns),
            };
            let second = &unknowns[layout.second[k].clone()];
            let balance = link.rod.balance_held(at.t, &at.rods[k], second, &held)?;
            residual
                .rows_mut(layout.second[k].start, balance.residual.len())
                .copy_from(&balance.residual);
            free += from.by.tr_mul(&balance.base);
            powers[0] += balance.powers[0];
            powers[1] += balance.powers[1] + balance.base.dot(&from.driven);
            powers[2] += balance.powers[2];
            if let (Some(seat), Some(tie)) = (to, &link.to) {
                free += seat.by.tr_mul(&held.end);
                powers[1] += held.end.dot(&seat.driven);
                let apart = balance.change.end() - seat.acceleration(&faster);
                let rows = tie.rows();
                residual
                    .rows_mut(layout.wrenches[k].start, rows.len())
                    .copy_from(&apart.rows(rows.start, rows.len()));
            }
            rods.push(balance);
        }
        for axis in at.all_axes() {
            let law = &axis.axis.law;
            free[axis.velocity] -= law.at(axis.at) - law.damping * axis.rate;
            powers[0] += law.damping * axis.rate * axis.rate;
        }
        let mut wrenches = Vec::with_capacity(self.carriers.len());
        for ((carrier, body), start) in self.carriers.iter().zip(&at.bodies).zip(&layout.velocities)
        {
            let mass = carrier.mass();
            let own = faster.rows(*start, body.own.ncols());
            let acceleration = &body.own * own + body.bias;
            let BodyMotion { pose, twist } = &body.place;
            let wrench = mass.wrench(at.t, pose, twist, &acceleration)?;
            let mut part = free.rows_mut(*start, body.own.ncols());
            part += body.own.tr_mul(&wrench);
            let EndMotion { power, loss, .. } = mass.motion(at.t, pose, twist, &wrench);
            powers[1] += power;
            powers[2] += loss;
            wrenches.push(wrench);
        }
        residual.rows_mut(0, layout.free).copy_from(&free);
        residual
            .iter()
            .all(|x| x.is_finite())
            .then_some(HeavyBalance {
                residual,
                rods,
                wrenches,
                powers,
            })
    }

    /// Kinetic energy of the bodies and of the rods, stored energy, potential; and, at the nodes of every rod,
    /// dissipation per length and time.
    pub fn energies(&self, at: &HeavyState) -> Option<([f64; 4], Vec<Vec<f64>>)> {
        let mut sums = [0.0; 4];
        for (carrier, body) in self.carriers.iter().zip(&at.bodies) {
            let mass = carrier.mass();
            let BodyMotion { pose, twist } = &body.place;
            sums[0] += mass.kinetic(at.t, pose, twist);
            sums[3] += mass.potential(at.t, pose);
        }
        let mut lost = Vec::with_capacity(self.links.len());
        for (link, moving) in self.links.iter().zip(&at.rods) {
            let (energy, density) = link.rod.stored(moving)?;
            let [body, rod] = link.rod.kinetic(at.t, moving);
            sums[0] += body;
            sums[1] += rod;
            sums[2] += energy;
            sums[3] += link.rod.potential(at.t, moving);
            lost.push(density);
        }
        sums[3] += at.joint_potential();
        Some((sums, lost))
    }

    /// For each groove with ends: body, groove parameter with its rate, and the bounds of the parameter.
    pub fn along_grooves(&self, y: &DVector<f64>) -> Vec<(usize, [f64; 2], [f64; 2])> {
        let bodies = self.carriers.iter().zip(&self.layout.bodies).enumerate();
        let ended = bodies.filter_map(|(body, (carrier, range))| {
            let ends = carrier.groove()?.ends()?;
            let phi = carrier.parameter(&y.as_slice()[range.clone()])?;
            Some((body, phi, ends))
        });
        ended.collect()
    }

    /// Motions of the sections of rod `k` at places in [0, 1], in growing order.
    pub fn motions_of(&self, at: &HeavyState, k: usize, places: &[f64]) -> Vec<BodyMotion> {
        let base = &at.seats[k].0;
        self.links[k]
            .rod
            .motions(&at.rods[k], base.pose, base.twist, places)
    }

    /// Centrelines of the rods with a contact diameter in a state.
    pub fn tubes<'a>(&'a self, at: &'a HeavyState) -> Vec<Tube<'a>> {
        let rods = self.links.iter().zip(&at.rods).enumerate();
        let tubes = rods.filter_map(|(k, (link, moving))| {
            let held = link.ties().map(|tie| &tie.on.on);
            link.rod.tube(moving, k, held.collect())
        });
        tubes.collect()
    }

    /// Forces of the grooves on the bodies in a balance, None for a body without groove: required wrench less that of
    /// the rods.
    pub fn groove_forces(
        &self,
        balance: &HeavyBalance,
        unknowns: &[f64],
    ) -> Vec<Option<Vector3<f64>>> {
        let mut forces: Vec<Vector3<f64>> = balance.wrenches.iter().map(|w| halves(w).1).collect();
        for (k, (link, rod)) in self.links.iter().zip(&balance.rods).enumerate() {
            if let AttachedTo::Body(body) = link.from.on.on {
                forces[body] += halves(&rod.base).1;
            }
            if let Some(AttachedTo::Body(body)) = link.to.as_ref().map(|tie| &tie.on.on) {
                forces[*body] += halves(&self.end_wrench(k, unknowns)).1;
            }
        }
        let bodies = self.carriers.iter().zip(forces);
        let forces = bodies.map(|(carrier, force)| carrier.groove().map(|_| force));
        forces.collect()
    }

    /// First time after `t` at which a load, or the motion of a clamp or a support, is not smooth.
    pub fn next_break(&self, t: f64) -> f64 {
        let bodies = self.carriers.iter().map(|carrier| carrier.next_break(t));
        let rods = self.links.iter().map(|link| link.rod.next_break(t));
        let supports = self.ties().map(|tie| match &tie.on.on {
            AttachedTo::Support(support) => support.next_break(t),
            _ => f64::INFINITY,
        });
        (bodies.chain(rods).chain(supports)).fold(f64::INFINITY, f64::min)
    }

    /// Ties of all rods.
    fn ties(&self) -> impl Iterator<Item = &Tie> {
        self.links.iter().flat_map(HeavyLink::ties)
    }

    /// Number of strains, and of velocities of bodies and bases.
    fn freedoms(&self) -> usize {
        self.unknowns() - self.multipliers()
    }

    /// Number of multipliers.
    pub fn multipliers(&self) -> usize {
        self.layout.wrenches.iter().map(Range::len).sum()
    }

    /// All bodies: listed bodies first, then bodies of rods.
    pub fn bodies(&self) -> Vec<Body> {
        let own = self
            .links
            .iter()
            .filter_map(|link| link.rod.given.body.clone());
        let alone = self.carriers.is_empty();
        let own = own.map(|mass| {
            let body = Body::new(mass);
            if alone {
                body
            } else {
                body.named("end".to_owned())
            }
        });
        self.carriers.iter().cloned().chain(own).collect()
    }

    /// Places of all bodies, as [`HeavyAssembly::bodies`].
    pub fn places_of_bodies(&self, at: &HeavyState) -> Vec<BodyMotion> {
        let rods = self.links.iter().zip(&at.rods);
        let own = rods.filter(|(link, _)| link.rod.given.body.is_some());
        let own = own.map(|(_, rod)| rod.end());
        at.places().into_iter().chain(own).collect()
    }
}

impl HeavyState {
    /// Places of the bodies.
    pub fn places(&self) -> Vec<BodyMotion> {
        self.bodies.iter().map(|body| body.place).collect()
    }

    /// Pose of the base of a rod.
    pub fn base(&self, rod: usize) -> Isometry3<f64> {
        self.seats[rod].0.pose
    }

    /// Gap from the end of a rod to its attachment (rotation vector, shift), and rate of the gap. None for a free
    /// end.
    fn apart(&self, k: usize) -> Option<[Vector6<f64>; 2]> {
        let seat = self.seats[k].1.as_ref()?;
        let end = self.rods[k].shape.end();
        let turn = (seat.pose.rotation * end.rotation.inverse()).scaled_axis();
        let shift = seat.pose.translation.vector - end.translation.vector;
        Some([join(&turn, &shift), seat.twist - self.rods[k].flow.end()])
    }
}

impl AssemblyLayout {
    fn new(carriers: &[Body], links: &[HeavyLink]) -> Self {
        let mut next = 0;
        let mut range = |size: usize| {
            next += size;
            next - size..next
        };
        let bodies = carriers.iter().map(|carrier| range(carrier.numbers()));
        let bodies = bodies.collect();
        let spare = |link: &HeavyLink, size: usize| if link.from.turns() { size } else { 0 };
        let turns = links.iter().map(|link| range(spare(link, 7))).collect();
        let free_axes = |link: &HeavyLink, end| link.tie(end).map_or(0, |tie| tie.axes.len());
        let joints = links
            .iter()
            .map(|link| [0, 1].map(|end| range(2 * free_axes(link, end))));
        let joints = joints.collect();
        let strains = links.iter().map(|link| range(link.rod.size())).collect();
        let rates = links.iter().map(|link| range(link.rod.size())).collect();
        let dashpots = links.iter().map(|link| range(link.rod.memory.numbers()));
        let dashpots = dashpots.collect();
        let time = next;
        let mut free = 0;
        let velocities = carriers.iter().map(|carrier| {
            free += carrier.freedoms();
            free - carrier.freedoms()
        });
        let velocities = velocities.collect();
        let turning = links.iter().map(|link| {
            free += spare(link, 3);
            link.from.turns().then(|| free - 3)
        });
        let turning = turning.collect();
        let sliding = links.iter().map(|link| {
            [0, 1].map(|end| {
                let axes = free_axes(link, end);
                free += axes;
                (axes > 0).then(|| free - axes)
            })
        });
        let sliding = sliding.collect();
        let mut next = free;
        let mut range = |size: usize| {
            next += size;
            next - size..next
        };
        let second = links.iter().map(|link| range(link.rod.size())).collect();
        let held = |link: &HeavyLink| link.to.as_ref().map_or(0, |tie| tie.rows().len());
        let wrenches = links.iter().map(|link| range(held(link))).collect();
        Self {
            bodies,
            velocities,
            turning,
            turns,
            joints,
            sliding,
            free,
            strains,
            rates,
            dashpots,
            time,
            second,
            wrenches,
            unknowns: next,
        }
    }
}
