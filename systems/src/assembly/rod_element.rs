//! Rods between two attachments: chart, wrenches on the attachments, tangent.

use super::axial_slider::EndSlider;
use super::distributed_load::{LoadOnRod, LoadTerms};
use super::taut::ChartKind;
use super::{Assembly, BodyMotion};
use crate::body::Support;
use crate::error::Result;
use crate::math::se3::{halves, joined};
use crate::rod::{EndConditions, Problem, Rod, Taut, Trace, Wrench};
use crate::solve::warm_start::WarmStart;
use nalgebra::{Isometry3, Matrix6, Quaternion, SMatrix, UnitQuaternion, Vector3, Vector6};
use std::borrow::Cow;
use std::sync::Arc;

/// Relative rotation (or couple) of the rod's end per unit base couple, at fixed force, below which the rod counts as
/// neutral.
const NEUTRAL: f64 = 1e-7;
/// Change of the chart, relative to 1 + |q|, at which the index is counted instead if the rod is neutral under its
/// force.
const ASIDE: f64 = 1e-6;

/// Carrier of an attachment.
#[derive(Debug, Clone)]
pub enum AttachedTo {
    /// The ground; the pose is in the world.
    Ground,
    /// A moving support; the pose is in the support's frame.
    Support(Box<Support<3>>),
    /// A body, by number; the pose is in the body's frame.
    Body(usize),
}

/// Joint between the end of a rod and its attachment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum Joint {
    /// The directors of the rod's end turn with the attachment.
    #[default]
    Weld,
    /// The end is free to turn: m(1) = 0.
    Ball,
    /// Both ends are free to turn: m(0) = m(1) = 0, the force is along the chord ([`Link::pinned`]).
    Pins,
}

/// Attachment of a rod's end: point and directors in the frame of the carrier.
#[derive(Debug, Clone)]
pub struct Attachment {
    /// Carrier: ground, support or body.
    pub on: AttachedTo,
    /// Pose in the carrier's frame.
    pub place: Isometry3<f64>,
}

impl Attachment {
    /// An attachment to the ground.
    pub fn ground(place: Isometry3<f64>) -> Self {
        Self {
            on: AttachedTo::Ground,
            place,
        }
    }

    /// An attachment to a moving support, in the support's frame.
    pub fn support(support: Support<3>) -> Self {
        Self {
            on: AttachedTo::Support(Box::new(support)),
            place: Isometry3::identity(),
        }
    }

    /// An attachment to a body.
    pub fn body(number: usize, place: Isometry3<f64>) -> Self {
        Self {
            on: AttachedTo::Body(number),
            place,
        }
    }

    /// Number of the carrying body, if any.
    pub(super) fn carried_by(&self) -> Option<usize> {
        match self.on {
            AttachedTo::Body(body) => Some(body),
            AttachedTo::Ground | AttachedTo::Support(_) => None,
        }
    }

    /// Distance from the origin of the carrier's frame.
    pub(super) fn lever(&self) -> f64 {
        self.place.translation.vector.norm()
    }

    /// Pose and twist in the world.
    pub(super) fn at(&self, t: f64, bodies: &[BodyMotion]) -> BodyMotion {
        match &self.on {
            AttachedTo::Ground => BodyMotion::at_rest(self.place),
            AttachedTo::Support(support) => {
                let frame = support.at(t);
                let lever = joined(&Vector3::zeros(), &self.place.translation.vector);
                BodyMotion {
                    pose: frame.pose() * self.place,
                    twist: frame.of_poses().absolute(&lever, &Vector6::zeros()),
                }
            }
            AttachedTo::Body(body) => {
                let BodyMotion { pose, twist } = bodies[*body];
                let (omega, v) = halves(&twist);
                let lever = pose.rotation * self.place.translation.vector;
                BodyMotion {
                    pose: pose * self.place,
                    twist: joined(&omega, &(v + omega.cross(&lever))),
                }
            }
        }
    }

    /// Moves a wrench on the attachment to the reference point of its body.
    pub(super) fn moved(&self, bodies: &[BodyMotion], wrench: &Vector6<f64>) -> Vector6<f64> {
        let AttachedTo::Body(body) = self.on else {
            return *wrench;
        };
        let lever = bodies[body].pose.rotation * self.place.translation.vector;
        let (m, n) = halves(wrench);
        joined(&(m + lever.cross(&n)), &n)
    }
}

/// A rod with its attachments. The rod's own clamp is not used: the rod begins at `from`.
#[derive(Debug, Clone)]
pub struct Link {
    pub(super) rod: Rod,
    pub(super) from: Attachment,
    pub(super) to: Attachment,
    pub(super) joint: Joint,
    /// Chart kind; the taut solution found last is cached beside it.
    pub(super) seen: ChartKind,
    pub(super) warm: WarmStart<Taut>,
    /// Stiffness of the spring beside the end of a taut rod, in B/L^3.
    pub(super) spring: f64,
    /// Slider between the end of an inextensible rod and its attachment, and the bound of its travel, in rod lengths.
    pub(super) give: Option<EndSlider>,
    pub(super) unseen: f64,
    /// True while the motion includes the rod's inertia.
    pub(super) felt: bool,
    pub(super) diameter: Option<f64>,
    /// Distributed load along the rod.
    pub(super) load: Option<LoadOnRod>,
    /// True if the ends keep their [`LinkEnd::trace`].
    pub(super) keeps_trace: bool,
    /// True if bodies are seen from a clamp that turns: traces then include turns of the base, although the base
    /// looks fixed.
    pub(super) clamp_turns: bool,
}

/// End of a rod relative to its base, in the directors of the base.
///
/// Charts are in units B/L and B/L^2. [`LinkEnd::slack`] marks a taut rod: its chart is the force alone, its end is
/// held as the attachment says (turned, or without couple), and the couple m(0) follows from both.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkEnd {
    /// Pose.
    pub pose: Isometry3<f64>,
    /// Couple m(0) at the base.
    pub base_couple: Vector3<f64>,
    /// Couple m(1) of the attachment on the rod.
    pub couple: Vector3<f64>,
    /// Force n(0); constant along the rod if no load acts along it.
    pub force: Vector3<f64>,
    /// Contribution of a load along the rod.
    pub(super) along: Option<LoadTerms>,
    /// Stored energy.
    pub energy: f64,
    /// d(rotation, position) by the chart.
    pub tangent: Matrix6<f64>,
    /// d(m(0), n, m(1)) by the chart.
    pub resultants: SMatrix<f64, 9, 6>,
    /// Length over couple: scale of couples beside lengths in the equations of a rod between ball joints.
    pub(super) per_couple: f64,
    /// Derivative of the resultants by the turn of the attachment, for a taut rod welded to it.
    pub(super) turned: Option<SMatrix<f64, 9, 3>>,
    /// Jacobian J of the constraint at the attachment by the chart; singular at folds. The rows are those of
    /// `tangent`. For a ball joint the first are d m(1). For a taut rod they are d m(0) less its part due to the
    /// force.
    pub jacobian: Matrix6<f64>,
    /// Right-hand side by the twist of the attachment: jacobian . q' = drive . twist.
    pub(super) drive: Matrix6<f64>,
    /// Direction of the chord of a rod between two ball joints, along the directors of its base.
    pub(super) chord: Option<Vector3<f64>>,
    /// The rod, if it is taut.
    pub(super) taut: Option<Arc<Taut>>,
    /// Record of the integration to the end, for a rod of known mass ([`super::Assembly::with_light_rods`]) in
    /// base-wrench chart.
    pub(super) trace: Option<Arc<Trace>>,
    /// Difference of m(0) of a taut rod from the couple of its chart; None in base-wrench chart.
    pub slack: Option<Vector3<f64>>,
}

/// A rod of an assembly, evaluated between its attachments.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkPoint {
    /// Base attachment.
    pub base: BodyMotion,
    /// End attachment.
    pub tip: BodyMotion,
    /// End of the rod, relative to the base.
    pub end: LinkEnd,
    /// Angular velocity about the chord, for a rod with mass between two ball joints.
    pub spin: f64,
}

impl Link {
    /// A rod from one attachment, to which it is welded, to another, which holds it by `joint`. A rod with a ball
    /// joint at one side begins at the other ([`Link::reversed`]).
    pub fn new(rod: Rod, from: Attachment, to: Attachment, joint: Joint) -> Self {
        let rod = rod.with_clamp(Vector3::zeros(), nalgebra::UnitQuaternion::identity());
        Self {
            rod,
            from,
            to,
            joint,
            seen: ChartKind::default(),
            warm: WarmStart::default(),
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

    /// A rod from one attachment, which holds it by `joint`, to another, to which it is welded. Equals [`Link::new`]
    /// of the rod begun at its other end, with the attachments' directors turned by pi about their d1
    /// ([`Rod::reversed`]).
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

    /// Attachment at the base.
    pub fn from(&self) -> &Attachment {
        &self.from
    }

    /// Attachment at the end.
    pub fn to(&self) -> &Attachment {
        &self.to
    }

    /// End attachment relative to the base attachment, at time `t`.
    pub fn end_place(&self, t: f64, bodies: &[BodyMotion]) -> BodyMotion {
        self.to.at(t, bodies).seen_from(&self.from.at(t, bodies))
    }

    /// The rod alone, from the ground at the origin to a free body, without a load along the rod. Equilibria depend
    /// only on the relative pose of the attachments, so they are the same.
    pub fn alone(&self) -> Self {
        let [origin, end] = [Attachment::ground, |place| Attachment::body(0, place)]
            .map(|on: fn(Isometry3<f64>) -> Attachment| on(Isometry3::identity()));
        Self::new(self.rod.clone(), origin, end, self.joint)
    }

    /// Joint at the end.
    pub fn joint(&self) -> Joint {
        self.joint
    }

    /// The units B/L, B/L^2 of the chart.
    pub fn units(&self) -> Vector6<f64> {
        let (couple, force) = self.rod.units();
        Vector6::new(couple, couple, couple, force, force, force)
    }

    /// End of the rod at the chart point q = (m(0), n), in units B/L, B/L^2, by integration from the base; for taut
    /// rods see [`Link::held`].
    ///
    /// # Errors
    /// As [`Rod::end`].
    pub fn end(&self, q: &Wrench, tolerance: f64) -> Result<LinkEnd> {
        let tolerance = self.finer(tolerance);
        let end = match self.load {
            Some(_) => self.loaded_end(q, tolerance),
            None => self.unloaded_end(q, tolerance),
        };
        Ok(self.with_slider(end?))
    }

    fn unloaded_end(&self, q: &Wrench, tolerance: f64) -> Result<LinkEnd> {
        let units = self.units();
        let base = q.component_mul(&units);
        let (found, trace) = if !self.keeps_trace {
            (self.rod.end(&base, tolerance)?, None)
        } else {
            let turns = self.base_turns() || self.clamp_turns;
            let (found, trace) = self.rod.traced_end(&base, turns, tolerance)?;
            (found, Some(Arc::new(trace)))
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
                // The base turns with the chord, and the force turns with it.
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

    /// The rod between its attachments at time `t`.
    ///
    /// # Errors
    /// As [`Link::end`].
    pub fn point(
        &self,
        t: f64,
        bodies: &[BodyMotion],
        q: &Wrench,
        tolerance: f64,
    ) -> Result<LinkPoint> {
        let (base, tip) = (self.from.at(t, bodies), self.to.at(t, bodies));
        let seen = self.with_base_rotation(&base.pose.rotation);
        let end = seen.held(q, &base.pose.inv_mul(&tip.pose), tolerance)?;
        if let (Some(found), Cow::Owned(_)) = (&end.taut, &seen) {
            self.warm.keep(found);
        }
        Ok(self.placed(t, bodies, end))
    }

    /// A known end placed between its attachments at time `t`; the base of a rod between ball joints is turned along
    /// its chord.
    pub(super) fn placed(&self, t: f64, bodies: &[BodyMotion], end: LinkEnd) -> LinkPoint {
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

    /// A rod between two ball joints: a spring along its chord, charted by its force (theory 3.3).
    pub fn pinned(rod: Rod, from: Attachment, to: Attachment) -> Self {
        Self::new(rod, from, to, Joint::Pins)
    }

    /// Equilibrium problem of the rod with its end held by its joint at a pose relative to the base.
    pub(super) fn held_at(&self, end: &Isometry3<f64>, tolerance: f64) -> Result<Problem> {
        let conditions = match self.joint {
            Joint::Weld => EndConditions::pose(end.translation.vector, end.rotation),
            // As if the base were clamped too.
            Joint::Ball | Joint::Pins => EndConditions::ball(end.translation.vector),
        };
        self.bearing(conditions, tolerance)
    }

    /// Morse index of the rod with its end held as it is: number of directions in which it could buckle to less
    /// energy.
    ///
    /// # Errors
    /// As [`Problem::index_at`]; as [`Rod::taut`].
    pub fn index(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<usize> {
        if self.is_taut(q, held) {
            return self.rod.taut_index(&*self.solve_taut(q, held, tolerance)?);
        }
        // The index depends on which components are held, not on the pose.
        if self.joint == Joint::Pins {
            return self.pinned_index(q, held, tolerance);
        }
        let problem = self.held_at(&Isometry3::identity(), tolerance)?;
        let count = |q: &Wrench| problem.index_at(&q.component_mul(&self.units()));
        // Count first with dead force. If the rod is neutral under that force (an elastica free to turn about its
        // force), rounding decides the count; nearby it does not, and away from folds the index of the held rod is
        // the same there.
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

    /// Largest component of the gap between end and attachment, in radians and rod lengths. For a ball joint the
    /// couple that the joint cannot bear counts, in B/L. The couple of a taut rod's chart does not count.
    pub(super) fn apart(&self, point: &LinkPoint) -> f64 {
        let gap = self.gap_scale(&point.end) * point.gap(self.joint);
        if point.end.slack.is_none() {
            return gap.amax();
        }
        // A spring beside the end makes the gap smaller by this factor at the same error of the force.
        let string = point.end.pose.translation.vector.norm() / point.end.force.norm();
        let spring = self.spring * self.units()[3] / self.rod.length();
        gap.rows(3, 3).amax() * (1.0 + spring * string)
    }

    pub(super) fn next_break(&self, t: f64) -> f64 {
        let ends = [&self.from, &self.to].map(|site| match &site.on {
            AttachedTo::Support(support) => support.next_break(t),
            _ => f64::INFINITY,
        });
        ends[0].min(ends[1])
    }
}

impl LinkEnd {
    /// Twist from this end to the pose `wanted`, both relative to the base: [`LinkEnd::jacobian`] times the
    /// correction of the chart. For a ball joint: minus the couple (which should be 0) and the distance vector of the
    /// points. For a taut rod: its slack and the distance vector.
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
    /// Twist of the end attachment relative to the base attachment, along the base's directors.
    pub fn relative_twist(&self) -> Vector6<f64> {
        self.tip.seen_from(&self.base).twist
    }

    /// Right-hand side of the chart's equation of motion: jacobian . q' = drive.
    pub fn drive(&self) -> Vector6<f64> {
        let drive = self.end.drive * self.relative_twist();
        match &self.end.along {
            None => drive,
            Some(along) => drive - along.prescribed * self.base_spin(),
        }
    }

    /// Spin of the base along its own directors.
    pub(super) fn base_spin(&self) -> Vector3<f64> {
        self.base.pose.rotation.inverse() * halves(&self.base.twist).0
    }

    /// Gap from the end of the rod to its attachment: [`LinkEnd::gap`].
    pub fn gap(&self, joint: Joint) -> Vector6<f64> {
        self.end.gap(&self.held(), joint)
    }

    /// Pose of the end attachment relative to the base.
    pub fn held(&self) -> Isometry3<f64> {
        self.base.pose.inv_mul(&self.tip.pose)
    }

    /// Wrenches of the rod on the carriers of its base and of its end, each at its attachment, in the world.
    pub fn wrenches(&self) -> [Vector6<f64>; 2] {
        let turn = self.base.pose.rotation;
        let n = self.end.force;
        let base = joined(&(turn * self.end.base_couple), &(turn * n));
        let tip = turn * -self.end.tip_force();
        [base, joined(&(turn * -self.end.couple), &tip)]
    }

    /// Potential of the load along the rod, in the world.
    pub fn potential(&self) -> f64 {
        self.end.along.as_ref().map_or(0.0, |along| {
            let total = self.base.pose.rotation * along.total;
            along.potential - total.dot(&self.base.pose.translation.vector)
        })
    }
}

impl Assembly {
    /// All rods between their attachments.
    ///
    /// # Errors
    /// As [`Link::end`], with the rod's number.
    pub fn points(
        &self,
        t: f64,
        bodies: &[BodyMotion],
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

    /// Sum of the rods' wrenches on every body, about its reference point in the world.
    pub fn wrenches(&self, bodies: &[BodyMotion], points: &[LinkPoint]) -> Vec<Vector6<f64>> {
        let mut sums = vec![Vector6::zeros(); bodies.len()];
        for (link, point) in self.links.iter().zip(points) {
            for (site, wrench) in [&link.from, &link.to].into_iter().zip(point.wrenches()) {
                if let AttachedTo::Body(body) = site.on {
                    sums[body] += site.moved(bodies, &wrench);
                }
            }
        }
        sums
    }

    /// Power of the moving supports on the rods.
    pub fn support_power(&self, points: &[LinkPoint]) -> f64 {
        let mut power = 0.0;
        for (link, point) in self.links.iter().zip(points) {
            let ends = [(&link.from, &point.base), (&link.to, &point.tip)];
            for ((site, place), wrench) in ends.into_iter().zip(point.wrenches()) {
                if let AttachedTo::Support(_) = site.on {
                    power -= wrench.dot(&place.twist);
                }
            }
        }
        power
    }
}
