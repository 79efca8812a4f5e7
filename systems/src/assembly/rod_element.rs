//! A rod between two attachments: its chart, the wrenches on what carries it, and its tangent.

use super::axial_slider::Give;
use super::distributed_load::{Along, Borne};
use super::taut::Seen;
use super::{Assembly, Place};
use crate::body::Support;
use crate::error::Result;
use crate::math::se3::{halves, joined};
use crate::rod::{EndConditions, Problem, Rod, Taut, Trace, Wrench};
use crate::solve::warm_start::Warm;
use nalgebra::{Isometry3, Matrix6, Quaternion, SMatrix, UnitQuaternion, Vector3, Vector6};
use std::borrow::Cow;
use std::sync::Arc;

/// Rotations (or couples) of a rod's end by unit couples at its base, at a given force: less is neutral.
const NEUTRAL: f64 = 1e-7;
/// How far aside the index of a rod is counted that is neutral under its force.
const ASIDE: f64 = 1e-6;

/// What an end of a rod is attached to.
#[derive(Debug, Clone)]
pub enum On {
    /// The ground; the place is in the world.
    Ground,
    /// A support that moves; the place is in its frame.
    Support(Box<Support<3>>),
    /// The body of this number; the place is in its frame.
    Body(usize),
}

/// How the end of a rod is held by its attachment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum Joint {
    /// The directors turn with the attachment.
    #[default]
    Weld,
    /// The end is free to turn: m(1) = 0.
    Ball,
    /// Both ends are free to turn: m(0) = m(1) = 0, the force is along the chord ([`Link::pinned`]).
    Pins,
}

/// Where an end of a rod is attached: point and directors in the frame of what carries it.
#[derive(Debug, Clone)]
pub struct Attachment {
    /// What carries it.
    pub on: On,
    /// Its place there.
    pub place: Isometry3<f64>,
}

impl Attachment {
    /// An attachment to the ground.
    pub fn ground(place: Isometry3<f64>) -> Self {
        Self {
            on: On::Ground,
            place,
        }
    }

    /// An attachment to a support that moves, in its frame.
    pub fn support(support: Support<3>) -> Self {
        Self {
            on: On::Support(Box::new(support)),
            place: Isometry3::identity(),
        }
    }

    /// An attachment to a body.
    pub fn body(number: usize, place: Isometry3<f64>) -> Self {
        Self {
            on: On::Body(number),
            place,
        }
    }

    /// The body that carries it.
    pub(super) fn carried_by(&self) -> Option<usize> {
        match self.on {
            On::Body(body) => Some(body),
            On::Ground | On::Support(_) => None,
        }
    }

    /// Distance from the origin of the frame that it is in.
    pub(super) fn lever(&self) -> f64 {
        self.place.translation.vector.norm()
    }

    /// Pose and twist in the world.
    pub(super) fn at(&self, t: f64, bodies: &[Place]) -> Place {
        match &self.on {
            On::Ground => Place::at_rest(self.place),
            On::Support(support) => {
                let frame = support.at(t);
                let lever = joined(&Vector3::zeros(), &self.place.translation.vector);
                Place {
                    pose: frame.pose() * self.place,
                    twist: frame.of_poses().absolute(&lever, &Vector6::zeros()),
                }
            }
            On::Body(body) => {
                let Place { pose, twist } = bodies[*body];
                let (omega, v) = halves(&twist);
                let lever = pose.rotation * self.place.translation.vector;
                Place {
                    pose: pose * self.place,
                    twist: joined(&omega, &(v + omega.cross(&lever))),
                }
            }
        }
    }

    /// A wrench on the attachment as one about the reference point of the body, `lever` away.
    pub(super) fn moved(&self, bodies: &[Place], wrench: &Vector6<f64>) -> Vector6<f64> {
        let On::Body(body) = self.on else {
            return *wrench;
        };
        let lever = bodies[body].pose.rotation * self.place.translation.vector;
        let (m, n) = halves(wrench);
        joined(&(m + lever.cross(&n)), &n)
    }
}

/// A rod with its attachments. The rod's own clamp is not used: it begins at `from`.
#[derive(Debug, Clone)]
pub struct Link {
    pub(super) rod: Rod,
    pub(super) from: Attachment,
    pub(super) to: Attachment,
    pub(super) joint: Joint,
    /// What its chart stands for, and the taut rod that was found last.
    pub(super) seen: Seen,
    pub(super) warm: Warm<Taut>,
    /// Beside the end of a taut rod, in B/L^3.
    pub(super) spring: f64,
    /// Between the end of a rod that cannot stretch and its attachment, and how far that may give way, in lengths of the rod.
    pub(super) give: Option<Give>,
    pub(super) unseen: f64,
    /// True while a motion feels its mass.
    pub(super) felt: bool,
    pub(super) diameter: Option<f64>,
    /// What it bears along it.
    pub(super) load: Option<Borne>,
    /// True if its ends keep their [`LinkEnd::trace`].
    pub(super) keeps_trace: bool,
    /// True if the clamp turns from which it is seen, so that traces tell of turns of the base though it stands there.
    pub(super) clamp_turns: bool,
}

/// The end of a rod seen from its base, in the directors there.
///
/// Charts are in units B/L and B/L^2. That of a taut rod is told apart by [`LinkEnd::slack`]: its force counts, its end is held as the
/// attachment says (turned, or without couple), and the couple m(0) follows from both.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkEnd {
    /// Pose.
    pub pose: Isometry3<f64>,
    /// Couple m(0) at the base.
    pub base_couple: Vector3<f64>,
    /// Couple m(1) of the attachment on the rod.
    pub couple: Vector3<f64>,
    /// Force n(0): all along the rod, if nothing loads it there.
    pub force: Vector3<f64>,
    /// What a load along the rod adds.
    pub(super) along: Option<Along>,
    /// Stored energy.
    pub energy: f64,
    /// d(rotation, position) by the chart.
    pub tangent: Matrix6<f64>,
    /// d(m(0), n, m(1)) by the chart.
    pub resultants: SMatrix<f64, 9, 6>,
    /// Length over couple, by which couples stand beside lengths in the equations of a rod between ball joints.
    pub(super) per_couple: f64,
    /// The same by the turn of the attachment, if a taut rod is welded to it and turns along.
    pub(super) turned: Option<SMatrix<f64, 9, 3>>,
    /// What a motion of the attachment prescribes, by the chart; singular at folds. The rows are those of `tangent`; of a ball joint the
    /// first are d m(1); of a taut rod they are d m(0) less what the force makes of it.
    pub jacobian: Matrix6<f64>,
    /// What the twist of the attachment prescribes: jacobian . q' = drive . twist.
    pub(super) drive: Matrix6<f64>,
    /// Of a rod between two ball joints the direction of its chord, along the directors of its base.
    pub(super) chord: Option<Vector3<f64>>,
    /// The rod, if it is taut.
    pub(super) taut: Option<Arc<Taut>>,
    /// How the end was found, for a rod whose mass is known ([`super::Assembly::with_light_rods`]) and that its base wrench charts.
    pub(super) trace: Option<Arc<Trace>>,
    /// By how much m(0) of a taut rod differs from the couple of its chart; None for a rod that its base wrench charts.
    pub slack: Option<Vector3<f64>>,
}

/// A rod of an assembly in place.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkPoint {
    /// Base attachment.
    pub base: Place,
    /// End attachment.
    pub tip: Place,
    /// The end of the rod itself, from the base.
    pub end: LinkEnd,
    /// The angular velocity about its chord with which a rod with mass spins between two ball joints.
    pub spin: f64,
}

impl Link {
    /// A rod from one attachment to another, which holds it by `joint`. At the first it is welded: a rod with a ball joint at
    /// one side begins at the other ([`Link::reversed`]).
    pub fn new(rod: Rod, from: Attachment, to: Attachment, joint: Joint) -> Self {
        let rod = rod.with_clamp(Vector3::zeros(), nalgebra::UnitQuaternion::identity());
        Self {
            rod,
            from,
            to,
            joint,
            seen: Seen::default(),
            warm: Warm::default(),
            spring: 0.0,
            give: None,
            unseen: 0.0,
            felt: false,
            diameter: None,
            load: None,
            keeps_trace: false,
            clamp_turns: false,
        }
    }

    /// A rod from one attachment, which holds it by `joint`, to another, to which it is welded: the same as [`Link::new`] for
    /// the rod begun at its other end, the attachments' directors turned by pi about their d1 ([`Rod::reversed`]).
    ///
    /// # Errors
    /// As [`Rod::reversed`].
    pub fn reversed(rod: &Rod, from: Attachment, to: Attachment, joint: Joint) -> Result<Self> {
        let turned = |mut site: Attachment| {
            // Exactly half a turn.
            let half = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
            site.place.rotation *= half;
            site
        };
        Ok(Self::new(rod.reversed()?, turned(to), turned(from), joint))
    }

    /// The rod.
    pub fn rod(&self) -> &Rod {
        &self.rod
    }

    /// Where it begins.
    pub fn from(&self) -> &Attachment {
        &self.from
    }

    /// Where it ends.
    pub fn to(&self) -> &Attachment {
        &self.to
    }

    /// The attachment of its end seen from that of its base, at time `t`.
    pub fn end_place(&self, t: f64, bodies: &[Place]) -> Place {
        self.to.at(t, bodies).seen_from(&self.from.at(t, bodies))
    }

    /// The rod alone: from the ground at the origin to a body at its end, without a load along it. Its equilibria are those that it has between its
    /// attachments where they stand so to each other.
    pub fn alone(&self) -> Self {
        let [origin, end] = [Attachment::ground, |place| Attachment::body(0, place)]
            .map(|on: fn(Isometry3<f64>) -> Attachment| on(Isometry3::identity()));
        Self::new(self.rod.clone(), origin, end, self.joint)
    }

    /// How its end is held.
    pub fn joint(&self) -> Joint {
        self.joint
    }

    /// The units B/L, B/L^2 of the chart.
    pub fn units(&self) -> Vector6<f64> {
        let (couple, force) = self.rod.units();
        Vector6::new(couple, couple, couple, force, force, force)
    }

    /// The end under the chart point q = (m(0), n) in units B/L, B/L^2, from the base wrench alone: [`Link::held`] for taut rods.
    ///
    /// # Errors
    /// As [`Rod::end`].
    pub fn end(&self, q: &Wrench, tolerance: f64) -> Result<LinkEnd> {
        let tolerance = self.finer(tolerance);
        let end = match self.load {
            Some(_) => self.loaded_end(q, tolerance),
            None => self.unloaded_end(q, tolerance),
        };
        Ok(self.sprung(end?))
    }

    fn unloaded_end(&self, q: &Wrench, tolerance: f64) -> Result<LinkEnd> {
        let units = self.units();
        let base = q.component_mul(&units);
        let (found, trace) = match self.keeps_trace {
            false => (self.rod.end(&base, tolerance)?, None),
            true => {
                let turns = self.base_turns() || self.clamp_turns;
                let (found, trace) = self.rod.traced_end(&base, turns, tolerance)?;
                (found, Some(Arc::new(trace)))
            }
        };
        let section = &found.section;
        let change = Matrix6::from_diagonal(&units);
        let tangent = found.tangent * change;
        // m(1) = m(0) - r(1) x n.
        let lever = section.position.cross_matrix() * change.fixed_rows::<3>(3);
        let couple = change.fixed_rows::<3>(0)
            + section.force.cross_matrix() * tangent.fixed_rows::<3>(3)
            - lever;
        let mut resultants = SMatrix::<f64, 9, 6>::zeros();
        resultants.fixed_rows_mut::<6>(0).copy_from(&change);
        resultants.fixed_rows_mut::<3>(6).copy_from(&couple);
        let (mut jacobian, mut drive) = (tangent, Matrix6::identity());
        let mut chord = None;
        match self.joint {
            Joint::Weld => {}
            Joint::Ball => {
                jacobian.fixed_rows_mut::<3>(0).copy_from(&couple);
                drive.fixed_rows_mut::<3>(0).fill(0.0);
            }
            Joint::Pins => {
                let along = section
                    .position
                    .try_normalize(f64::MIN_POSITIVE)
                    .unwrap_or_else(Vector3::z);
                chord = Some(along);
                (jacobian, drive) = self.pins(&tangent, &couple, section, &along);
                // The base turns with the chord, and the force with it.
                let force = along * along.transpose() * change.fixed_rows::<3>(3);
                resultants.fixed_rows_mut::<3>(3).copy_from(&force);
            }
        }
        Ok(LinkEnd {
            pose: section.pose(),
            base_couple: halves(q).0 * units[0],
            couple: section.couple,
            force: section.force,
            along: None,
            energy: section.energy,
            tangent,
            resultants,
            per_couple: self.rod.length() / units[0],
            turned: None,
            jacobian,
            drive,
            chord,
            slack: None,
            taut: None,
            trace,
        })
    }

    /// The rod in place at time `t`.
    ///
    /// # Errors
    /// As [`Link::end`].
    pub fn point(&self, t: f64, bodies: &[Place], q: &Wrench, tolerance: f64) -> Result<LinkPoint> {
        let (base, tip) = (self.from.at(t, bodies), self.to.at(t, bodies));
        let seen = self.facing(&base.pose.rotation);
        let end = seen.held(q, &base.pose.inv_mul(&tip.pose), tolerance)?;
        if let (Some(found), Cow::Owned(_)) = (&end.taut, &seen) {
            self.warm.keep(found);
        }
        Ok(self.placed(t, bodies, end))
    }

    /// An end that is known between its attachments at time `t`; the base of a rod between ball joints is turned along its chord.
    pub(super) fn placed(&self, t: f64, bodies: &[Place], end: LinkEnd) -> LinkPoint {
        let (base, tip) = (self.from.at(t, bodies), self.to.at(t, bodies));
        let spin = 0.0;
        let mut point = LinkPoint {
            base,
            tip,
            end,
            spin,
        };
        point.align();
        point
    }

    /// A rod between two ball joints: a spring along its chord, whose force charts it (theory 3.3).
    pub fn pinned(rod: Rod, from: Attachment, to: Attachment) -> Self {
        Self::new(rod, from, to, Joint::Pins)
    }

    /// The rod with its end held by its joint at a pose seen from the base.
    pub(super) fn held_at(&self, end: &Isometry3<f64>, tolerance: f64) -> Result<Problem> {
        let conditions = match self.joint {
            Joint::Weld => EndConditions::pose(end.translation.vector, end.rotation),
            // As if the base were held too.
            Joint::Ball | Joint::Pins => EndConditions::ball(end.translation.vector),
        };
        self.bearing(conditions, tolerance)
    }

    /// How many equilibria with less energy the rod could buckle away into with its end held as it is: its index.
    ///
    /// # Errors
    /// As [`Problem::index_at`]; as [`Rod::taut`].
    pub fn index(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<usize> {
        if self.is_taut(q, held) {
            return self.rod.taut_index(&*self.pulled(q, held, tolerance)?);
        }
        // What is held counts, not where.
        if self.joint == Joint::Pins {
            return self.pinned_index(q, held, tolerance);
        }
        let problem = self.held_at(&Isometry3::identity(), tolerance)?;
        let count = |q: &Wrench| problem.index_at(&q.component_mul(&self.units()));
        // It is counted under the force alone first. Where that is neutral (an elastica that can turn about its force) rounding
        // decides; nearby it is not, and away from folds the index of the held rod is the same there.
        let end = self.end(q, tolerance)?;
        let loaded = (self.gap_scale(&end) * end.jacobian)
            .fixed_view::<3, 3>(0, 0)
            .into_owned();
        if loaded.singular_values().min() < NEUTRAL && self.regular(&end).is_some() {
            let aside = Wrench::new(0.6, -0.8, 0.3, 0.7, 0.4, -0.5) * (ASIDE * (1.0 + q.norm()));
            if let (Ok(a), Ok(b)) = (count(&(q + aside)), count(&(q - aside)))
                && a == b
            {
                return Ok(a);
            }
        }
        count(q)
    }

    /// How far the end is from its attachment: the largest component of the gap, in radians (for a ball joint the couple it
    /// should not bear, in B/L) and lengths of the rod. The couple of a taut rod's chart does not count.
    pub(super) fn apart(&self, point: &LinkPoint) -> f64 {
        let gap = self.gap_scale(&point.end) * point.gap(self.joint);
        if point.end.slack.is_none() {
            return gap.amax();
        }
        // A spring beside the end holds it the better by so much.
        let string = point.end.pose.translation.vector.norm() / point.end.force.norm();
        let spring = self.spring * self.units()[3] / self.rod.length();
        gap.rows(3, 3).amax() * (1.0 + spring * string)
    }

    pub(super) fn next_break(&self, t: f64) -> f64 {
        let ends = [&self.from, &self.to].map(|site| match &site.on {
            On::Support(support) => support.next_break(t),
            _ => f64::INFINITY,
        });
        ends[0].min(ends[1])
    }
}

impl LinkEnd {
    /// The twist that leads from here to the pose `wanted`, both seen from the base; for a ball joint minus the couple that
    /// should be 0, and the way between the points; for a taut rod its slack, and the way: [`LinkEnd::jacobian`] times the
    /// correction of the chart.
    pub fn gap(&self, wanted: &Isometry3<f64>, joint: Joint) -> Vector6<f64> {
        let apart = wanted.translation.vector - self.pose.translation.vector;
        match (self.slack, joint) {
            (Some(slack), _) => joined(&slack, &apart),
            (None, Joint::Weld) => {
                let turn = wanted.rotation * self.pose.rotation.inverse();
                joined(&turn.scaled_axis(), &apart)
            }
            (None, Joint::Ball) => joined(&-self.couple, &apart),
            (None, Joint::Pins) => {
                let (length, along) = (self.pose.translation.vector.norm(), self.along());
                let missing = wanted.translation.vector.norm() - length;
                joined(
                    &-self.base_couple,
                    &(along * missing - self.couple * self.per_couple),
                )
            }
        }
    }
}

impl LinkPoint {
    /// The twist of the end attachment relative to that of the base, along the base's directors.
    pub fn relative_twist(&self) -> Vector6<f64> {
        self.tip.seen_from(&self.base).twist
    }

    /// What the chart follows: jacobian . q' = drive.
    pub fn drive(&self) -> Vector6<f64> {
        let drive = self.end.drive * self.relative_twist();
        match &self.end.along {
            None => drive,
            Some(along) => drive - along.prescribed * self.base_spin(),
        }
    }

    /// The spin of the base along its own directors.
    pub(super) fn base_spin(&self) -> Vector3<f64> {
        self.base.pose.rotation.inverse() * halves(&self.base.twist).0
    }

    /// From the end of the rod to its attachment: [`LinkEnd::gap`].
    pub fn gap(&self, joint: Joint) -> Vector6<f64> {
        self.end.gap(&self.held(), joint)
    }

    /// The end attachment seen from the base.
    pub fn held(&self) -> Isometry3<f64> {
        self.base.pose.inv_mul(&self.tip.pose)
    }

    /// The wrenches of the rod on what carries its base and on what carries its end, each at its attachment, in the world.
    pub fn wrenches(&self) -> [Vector6<f64>; 2] {
        let turn = self.base.pose.rotation;
        let n = self.end.force;
        let base = joined(&(turn * self.end.base_couple), &(turn * n));
        let tip = turn * -self.end.tip_force();
        [base, joined(&(turn * -self.end.couple), &tip)]
    }

    /// The potential of the load along the rod, in the world.
    pub fn potential(&self) -> f64 {
        self.end.along.as_ref().map_or(0.0, |along| {
            let total = self.base.pose.rotation * along.total;
            along.potential - total.dot(&self.base.pose.translation.vector)
        })
    }
}

impl Assembly {
    /// All rods in place.
    ///
    /// # Errors
    /// As [`Link::end`], with the rod's number.
    pub fn points(
        &self,
        t: f64,
        bodies: &[Place],
        charts: &[Wrench],
        tolerance: f64,
    ) -> Result<Vec<LinkPoint>> {
        let links = self.links.iter().zip(charts).enumerate();
        links
            .map(|(k, (link, q))| {
                link.point(t, bodies, q, tolerance)
                    .map_err(|why| why.context(self.rod_name(k)))
            })
            .collect()
    }

    /// What the rods do to every body, about its reference point in the world.
    pub fn wrenches(&self, bodies: &[Place], points: &[LinkPoint]) -> Vec<Vector6<f64>> {
        let mut sums = vec![Vector6::zeros(); bodies.len()];
        for (link, point) in self.links.iter().zip(points) {
            for (site, wrench) in [&link.from, &link.to].into_iter().zip(point.wrenches()) {
                if let On::Body(body) = site.on {
                    sums[body] += site.moved(bodies, &wrench);
                }
            }
        }
        sums
    }

    /// Power of the supports that move, on the rods.
    pub fn support_power(&self, points: &[LinkPoint]) -> f64 {
        let mut power = 0.0;
        for (link, point) in self.links.iter().zip(points) {
            let ends = [(&link.from, &point.base), (&link.to, &point.tip)];
            for ((site, place), wrench) in ends.into_iter().zip(point.wrenches()) {
                if let On::Support(_) = site.on {
                    power -= wrench.dot(&place.twist);
                }
            }
        }
        power
    }
}
