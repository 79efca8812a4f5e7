//! A rod between two attachments as data: its chart, its end, its place between the attachments.

use super::attachment::{Attachment, Joint};
use super::body::BodyMotion;
use super::rod_in_time::DriveAtChart;
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use crate::rod::{
    DistributedLoad, LoadPower, LoadsWithoutPotential, Rod, SectionMass, Taut, Trace, Wrench,
};
use crate::section::LawInTime;
use crate::solve::warm_start::WarmStart;
use nalgebra::{
    FullPivLU, Isometry3, Matrix3, Matrix6, Quaternion, SMatrix, U6, UnitQuaternion, Vector3,
    Vector6,
};
use std::sync::Arc;

/// Relative pivot of a rod's Jacobian below which the held ends leave some wrench undetermined.
const SINGULAR: f64 = 1e-13;

/// A rod with its attachments. The rod's own clamp is not used: the rod begins at `from`.
#[derive(Debug, Clone)]
pub struct Link {
    pub(super) rod: Rod,
    pub(super) from: Attachment,
    pub(super) to: Attachment,
    /// Joints at base and end. A ball joint at the base has one at the end beside it.
    pub(super) joints: [Joint; 2],
    pub(super) chart: RodChart,
    /// Solution of the taut rod found last.
    pub(super) last_taut: WarmStart<Taut>,
    /// Bound of the travel of a slider, in rod lengths; 0 for a rod that stretches.
    pub(super) unseen: f64,
    /// Mass to first order, if known.
    pub(super) mass: Option<LightRod>,
    /// True if bodies are seen from a clamp that turns: traces then include turns of the base, although the base
    /// looks fixed.
    pub(super) clamp_turns: bool,
    pub(super) diameter: Option<f64>,
    pub(super) load: Option<LoadOnRod>,
    /// Loads along the rod without a potential.
    pub(super) turning: Option<TurningLoads>,
    /// Section law in time, if it varies; the field `rod` has the law of t = 0.
    pub(super) in_time: Option<Arc<LawInTime>>,
    /// Director, 0 or 1, about which the rod of a planar assembly bends.
    pub(super) bent_about: Option<usize>,
}

/// Chart of a rod, and the tie between end and attachment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RodChart {
    /// The pull decides between base wrench and force.
    ByPull {
        /// Slider at the end of a slack rod.
        slider: Option<EndSlider>,
        /// Stiffness of the spring beside the end of a taut rod, in B/L^3.
        spring: f64,
    },
    /// The base wrench (m(0), n(0)).
    BaseWrench,
    /// The base wrench of a rod whose end sits on a slider.
    OnSlider(EndSlider),
    /// The force n(0) of a taut rod.
    Taut {
        /// Stiffness of the spring beside the end, in B/L^3.
        spring: f64,
    },
}

impl Default for RodChart {
    fn default() -> Self {
        Self::ByPull {
            slider: None,
            spring: 0.0,
        }
    }
}

impl RodChart {
    /// Slider at the end of a slack rod.
    pub fn slider(&self) -> Option<EndSlider> {
        match self {
            Self::ByPull { slider, .. } => *slider,
            Self::OnSlider(slider) => Some(*slider),
            Self::BaseWrench | Self::Taut { .. } => None,
        }
    }

    /// Stiffness of the spring beside the end of a taut rod, in B/L^3.
    pub fn spring(&self) -> f64 {
        match self {
            Self::ByPull { spring, .. } | Self::Taut { spring } => *spring,
            Self::BaseWrench | Self::OnSlider(_) => 0.0,
        }
    }

    /// True if the force charts the rod at any pull.
    pub fn is_taut(&self) -> bool {
        matches!(self, Self::Taut { .. })
    }

    /// The pull decides; slider and spring stay.
    #[must_use]
    pub fn by_pull(&self) -> Self {
        Self::ByPull {
            slider: self.slider(),
            spring: self.spring(),
        }
    }
}

/// A slider with a spring between the end of a rod and its attachment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndSlider {
    /// c, in L^3/B; 0 if only the axial force is to be kept while the end is brought back.
    pub compliance: f64,
    /// e, along the directors of the base, of length 1.
    pub along: Vector3<f64>,
}

/// Mass properties of a rod treated to first order.
#[derive(Debug, Clone, PartialEq)]
pub struct LightRod {
    /// Mass and rotary inertia of the sections. The weight is a load along the rod ([`Link::with_distributed`]).
    pub sections: SectionMass,
    /// True while the motion includes the rod's inertia.
    pub followed: bool,
}

/// A load along a rod: in the world, and along the present directors of its base.
#[derive(Debug, Clone)]
pub(super) struct LoadOnRod {
    pub world: DistributedLoad,
    pub seen: DistributedLoad,
}

/// Loads along a rod without a potential: their couples in the world, and along the present directors of its base.
#[derive(Debug, Clone)]
pub(super) struct TurningLoads {
    pub world: LoadsWithoutPotential,
    pub seen: LoadsWithoutPotential,
}

impl TurningLoads {
    /// The loads on a rod with this base.
    pub(super) fn on(world: &LoadsWithoutPotential, base: &UnitQuaternion<f64>) -> Self {
        Self {
            seen: LoadsWithoutPotential {
                couple: seen_from(&world.couple, base),
                ..world.clone()
            },
            world: world.clone(),
        }
    }
}

/// End of a rod relative to its base, in the directors of the base. Charts are in units B/L and B/L^2.
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
    /// Jacobian J of the constraint at the attachment by the chart; singular at folds. Its rows depend on the kind of
    /// the end.
    pub jacobian: Matrix6<f64>,
    /// Right-hand side by the twist of the attachment: jacobian . q' = drive . twist.
    pub(super) drive: Matrix6<f64>,
    /// Kind of the chart and of the constraint.
    pub(super) kind: EndKind,
}

/// Kind of the chart of an evaluated rod, and of the constraint at its attachment.
// Boxing a variant would cost an allocation at every evaluation of every rod.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub(super) enum EndKind {
    /// Base wrench, end on a weld: rows of the Jacobian are rotation and position.
    Welded {
        /// Record of the integration, for a rod of known mass.
        trace: Option<Arc<Trace>>,
    },
    /// Base wrench, end on a ball joint: rows are m(1) and position.
    OnBall {
        /// Record of the integration, for a rod of known mass.
        trace: Option<Arc<Trace>>,
    },
    /// Both ends on ball joints: rows are m(0), and the chord with m(1) in lengths.
    Pinned {
        /// Direction of the chord, along the directors of the base.
        chord: Vector3<f64>,
        /// Length over couple: scale of couples beside lengths.
        per_couple: f64,
        /// Record of the integration, for a rod of known mass.
        trace: Option<Arc<Trace>>,
    },
    /// Force of a taut rod: its end is held as the attachment says (turned, or without couple), and m(0) follows from
    /// both. Rows are m(0) less its part due to the force, and position.
    Taut {
        /// The rod.
        rod: Arc<Taut>,
        /// Difference of m(0) from the couple of the chart.
        slack: Vector3<f64>,
        /// Derivative of the resultants by the turn of the attachment, if the rod is welded to it.
        turned: Option<SMatrix<f64, 9, 3>>,
        /// Force of the chart by a displacement of the attachment, which moves the far end of the spring beside the
        /// end.
        pulled: f64,
    },
}

/// Contributions of a load along a rod to its end, along the directors of the base.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadTerms {
    /// int f ds.
    pub total: Vector3<f64>,
    /// int f ds of the dead load alone.
    pub dead: Vector3<f64>,
    /// -int f.r ds of the dead load.
    pub potential: f64,
    /// d(rotation, position, m(1)) by a turn of the base; 0 for a fixed base.
    pub turned: SMatrix<f64, 9, 3>,
    /// d n(1) by a turn of the base at the same n(0), both seen from the base.
    pub force_turned: Matrix3<f64>,
    /// d(n(1) - n(0)) by the chart: of loads that turn with the rod.
    pub taken: SMatrix<f64, 3, 6>,
    /// Power of loads without a potential, by the chart and by a turn of the base.
    pub power: Option<LoadPower>,
    /// d(m(0), n(0)) by a turn of the base, for a taut rod.
    pub base: SMatrix<f64, 6, 3>,
    /// Derivative of the prescribed quantities, the rows of [`LinkEnd::jacobian`], by a turn of the base.
    pub prescribed: SMatrix<f64, 6, 3>,
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
    /// Effect of a section law that varies in time.
    pub(super) driven: Option<DriveAtChart>,
}

impl Link {
    /// A rod from one attachment, to which it is welded, to another, which holds it by `joint`. A rod with a ball
    /// joint at one side begins at the other ([`Link::reversed`]).
    pub fn new(rod: Rod, from: Attachment, to: Attachment, joint: Joint) -> Self {
        Self::with_joints(rod, from, to, [Joint::Weld, joint])
    }

    /// A rod between two ball joints: a spring along its chord, charted by its force (theory 3.3).
    pub fn pinned(rod: Rod, from: Attachment, to: Attachment) -> Self {
        Self::with_joints(rod, from, to, [Joint::Ball; 2])
    }

    fn with_joints(rod: Rod, from: Attachment, to: Attachment, joints: [Joint; 2]) -> Self {
        Self {
            rod: rod.with_clamp(Vector3::zeros(), UnitQuaternion::identity()),
            from,
            to,
            joints,
            chart: RodChart::default(),
            last_taut: WarmStart::default(),
            unseen: 0.0,
            mass: None,
            clamp_turns: false,
            diameter: None,
            load: None,
            turning: None,
            in_time: None,
            bent_about: None,
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

    /// The rod alone, from the ground at the origin to a free body, without a load along the rod. Equilibria depend
    /// only on the relative pose of the attachments, so they are the same.
    pub fn alone(&self) -> Self {
        let [origin, end] = [Attachment::ground, |place| Attachment::body(0, place)]
            .map(|on: fn(Isometry3<f64>) -> Attachment| on(Isometry3::identity()));
        Self::with_joints(self.rod.clone(), origin, end, self.joints)
    }

    /// Confines the rod of a planar assembly to bending about one director of its base, 0 or 1, which is along the
    /// normal. The rod itself must be stiff against all other strains.
    #[must_use]
    pub fn bent_about(mut self, director: Option<usize>) -> Self {
        self.bent_about = director;
        self
    }

    /// Components of the chart, and of the gap, that vanish in a planar assembly.
    pub(super) fn out_of_plane(&self) -> impl Iterator<Item = usize> {
        let held = self.bent_about.map(|k| [1 - k, 2, 3 + k]);
        held.into_iter().flatten()
    }

    /// Gives the rod a contact diameter: a run stops at self-contact or contact with another such rod.
    #[must_use]
    pub fn with_diameter(mut self, diameter: f64) -> Self {
        self.diameter = Some(diameter).filter(|d| *d > 0.0);
        self
    }

    /// Puts a dead load along the rod, counted from this link's base ([`DistributedLoad::reversed`] counts from the
    /// other end).
    ///
    /// # Errors
    /// A rod between two ball joints.
    pub fn with_distributed(mut self, load: DistributedLoad) -> Result<Self> {
        if self.is_pinned() {
            return Err(Error::domain(
                "a rod between two ball joints has its force along its chord, and bears no load along it: weld one of its ends, or leave out \
                 its weight",
            ));
        }
        self.load = Some(LoadOnRod {
            seen: seen_from(&load, &self.first_base()),
            world: load,
        });
        Ok(self)
    }

    /// Puts loads without a potential along the rod, counted from this link's base. The rod keeps its chart by the base
    /// wrench at every pull.
    ///
    /// # Errors
    /// A rod between two ball joints.
    pub fn with_turning(mut self, loads: &LoadsWithoutPotential) -> Result<Self> {
        if self.is_pinned() {
            return Err(Error::domain(
                "a rod between two ball joints has its force along its chord, and bears no load along it: weld one of its ends",
            ));
        }
        self.turning = Some(TurningLoads::on(loads, &self.first_base()));
        Ok(self)
    }

    /// Rotation of the base before the first evaluation. An evaluation adds the rotation of the body.
    fn first_base(&self) -> UnitQuaternion<f64> {
        let base = match self.from.carried_by() {
            Some(_) => self.from.place,
            None => self.from.at(0.0, &[]).pose,
        };
        base.rotation
    }

    /// Loads along the rod without a potential, their couples in the world.
    pub fn turning(&self) -> Option<&LoadsWithoutPotential> {
        self.turning.as_ref().map(|loads| &loads.world)
    }

    /// True if loads along the rod have no potential.
    pub fn has_turning(&self) -> bool {
        self.turning.is_some()
    }

    /// True if any load acts along the rod.
    pub fn is_loaded(&self) -> bool {
        self.load.is_some() || self.has_turning()
    }

    /// Director, 0 or 1, about which the rod of a planar assembly bends; `None` in space.
    pub fn bending_director(&self) -> Option<usize> {
        self.bent_about
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

    /// Joint at the end.
    pub fn joint(&self) -> Joint {
        self.joints[1]
    }

    /// Joints at base and end.
    pub fn joints(&self) -> [Joint; 2] {
        self.joints
    }

    /// True if both ends turn freely: m(0) = m(1) = 0, and the force is along the chord.
    pub fn is_pinned(&self) -> bool {
        self.joints[0].turns()
    }

    /// Chart of the rod.
    pub fn chart(&self) -> RodChart {
        self.chart
    }

    /// Sets the chart of the rod; by default the pull decides.
    pub fn set_chart(&mut self, chart: RodChart) {
        self.chart = chart;
    }

    /// A copy with a chart by pull, for a search from afar.
    #[must_use]
    pub fn with_chart_by_pull(&self) -> Self {
        let mut link = self.clone();
        link.chart = self.chart.by_pull();
        link
    }

    /// Contact diameter; None if contacts of the rod are ignored.
    pub fn diameter(&self) -> Option<f64> {
        self.diameter
    }

    /// Mass of the rod to first order, if known.
    pub fn mass(&self) -> Option<&LightRod> {
        self.mass.as_ref()
    }

    /// True while the motion includes the rod's inertia.
    pub(super) fn is_followed(&self) -> bool {
        self.mass.as_ref().is_some_and(|mass| mass.followed)
    }

    /// Load along the rod, in the world.
    pub fn distributed(&self) -> Option<&DistributedLoad> {
        self.load.as_ref().map(|load| &load.world)
    }

    /// Load along the rod, along the directors of the base.
    pub(super) fn borne(&self) -> Option<&DistributedLoad> {
        self.load.as_ref().map(|load| &load.seen)
    }

    /// The units B/L, B/L^2 of the chart.
    pub fn units(&self) -> Vector6<f64> {
        let (couple, force) = self.rod.units();
        Vector6::new(couple, couple, couple, force, force, force)
    }

    /// End attachment relative to the base attachment, at time `t`.
    pub fn end_place(&self, t: f64, bodies: &[BodyMotion]) -> BodyMotion {
        self.to.at(t, bodies).seen_from(&self.from.at(t, bodies))
    }

    /// Bodies at both ends, with the levers from their reference points in the world.
    pub(super) fn levers(&self, bodies: &[BodyMotion]) -> [Option<(usize, Vector3<f64>)>; 2] {
        [&self.from, &self.to].map(|site| site.lever(bodies))
    }

    /// First time after `t` at which the motion of a support, or the section law, is not smooth.
    pub(super) fn next_break(&self, t: f64) -> f64 {
        let ends = self.from.next_break(t).min(self.to.next_break(t));
        let law = self.in_time.as_ref();
        ends.min(law.map_or(f64::INFINITY, |law| law.next_break(t)))
    }

    /// Scales of gaps: radians, rod lengths, and B/L for the couples of a ball joint or a taut rod.
    pub(super) fn gap_scale(&self, end: &LinkEnd) -> Matrix6<f64> {
        let length = 1.0 / self.rod.length();
        let first = match end.kind {
            EndKind::Welded { .. } => 1.0,
            _ => 1.0 / self.units()[0],
        };
        Matrix6::from_diagonal(&Vector6::new(first, first, first, length, length, length))
    }

    /// LU factors of the Jacobian in units of [`Link::gap_scale`]; None if it is singular: at a fold, and for a
    /// straight inextensible rod.
    pub(super) fn regular(&self, end: &LinkEnd) -> Option<FullPivLU<f64, U6, U6>> {
        let factors = (self.gap_scale(end) * end.jacobian).full_piv_lu();
        let pivots = factors.u().diagonal().abs();
        (pivots.min() > SINGULAR * pivots.max()).then_some(factors)
    }

    /// Largest component of the gap between end and attachment, in radians and rod lengths. For a ball joint the
    /// couple that the joint cannot bear counts, in B/L. The couple of a taut rod's chart does not count.
    pub(super) fn apart(&self, point: &LinkPoint) -> f64 {
        let gap = self.gap_scale(&point.end) * point.gap();
        if !point.end.is_taut() {
            return gap.amax();
        }
        // A spring beside the end makes the gap smaller by this factor at the same error of the force.
        let string = point.end.pose.translation.vector.norm() / point.end.force.norm();
        let spring = self.chart.spring() * self.units()[3] / self.rod.length();
        gap.rows(3, 3).amax() * (1.0 + spring * string)
    }
}

/// A load of the world along the directors of a base.
pub(super) fn seen_from(load: &DistributedLoad, base: &UnitQuaternion<f64>) -> DistributedLoad {
    let back = base.inverse().to_rotation_matrix();
    load.mapped(|f| back * f)
}

impl LinkEnd {
    /// True if the rod is charted by its force.
    pub fn is_taut(&self) -> bool {
        matches!(self.kind, EndKind::Taut { .. })
    }

    /// The rod, if it is taut.
    pub(super) fn taut(&self) -> Option<&Arc<Taut>> {
        match &self.kind {
            EndKind::Taut { rod, .. } => Some(rod),
            _ => None,
        }
    }

    /// Force of the chart of a taut rod by a displacement of its attachment; 0 without a spring beside its end.
    pub(super) fn pulled(&self) -> f64 {
        match &self.kind {
            EndKind::Taut { pulled, .. } => *pulled,
            _ => 0.0,
        }
    }

    /// Direction of the chord of a rod between two ball joints, along the directors of its base.
    pub(super) fn chord(&self) -> Option<&Vector3<f64>> {
        match &self.kind {
            EndKind::Pinned { chord, .. } => Some(chord),
            _ => None,
        }
    }

    /// Record of the integration, for a rod of known mass in base-wrench chart.
    pub(super) fn trace(&self) -> Option<&Arc<Trace>> {
        match &self.kind {
            EndKind::Welded { trace }
            | EndKind::OnBall { trace }
            | EndKind::Pinned { trace, .. } => trace.as_ref(),
            EndKind::Taut { .. } => None,
        }
    }

    /// Stored energy plus the potential of a load along the rod, as seen from the base.
    pub fn whole_energy(&self) -> f64 {
        self.energy + self.along.as_ref().map_or(0.0, |along| along.potential)
    }

    /// Force n(1) of the attachment on the rod.
    pub fn tip_force(&self) -> Vector3<f64> {
        match &self.along {
            None => self.force,
            Some(along) => self.force - along.total,
        }
    }

    /// Twist from this end to the pose `wanted`, both relative to the base: [`LinkEnd::jacobian`] times the
    /// correction of the chart. For a ball joint: minus the couple (which should be 0) and the distance vector of the
    /// points. For a taut rod: its slack and the distance vector.
    pub fn gap(&self, wanted: &Isometry3<f64>) -> Vector6<f64> {
        let apart = wanted.translation.vector - self.pose.translation.vector;
        match &self.kind {
            EndKind::Taut { slack, .. } => join(slack, &apart),
            EndKind::Welded { .. } => {
                let turn = wanted.rotation * self.pose.rotation.inverse();
                join(&turn.scaled_axis(), &apart)
            }
            EndKind::OnBall { .. } => join(&-self.couple, &apart),
            EndKind::Pinned {
                chord, per_couple, ..
            } => {
                let length = self.pose.translation.vector.norm();
                let missing = wanted.translation.vector.norm() - length;
                join(
                    &-self.base_couple,
                    &(chord * missing - self.couple * *per_couple),
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
        let mut drive = self.end.drive * self.relative_twist();
        if let Some(driven) = &self.driven {
            drive -= driven.rates;
        }
        match &self.end.along {
            None => drive,
            Some(along) => drive - along.prescribed * self.base_spin(),
        }
    }

    /// Power, times `pace`, of the loads along the rod that have no potential; `rates` are those of the chart times
    /// `pace`.
    pub(super) fn load_power(&self, rates: &Wrench, pace: f64) -> f64 {
        let Some(along) = &self.end.along else {
            return 0.0;
        };
        along.power.map_or(0.0, |power| {
            let velocity = self.base.pose.rotation.inverse() * halves(&self.base.twist).1;
            let carried = (along.total - along.dead).dot(&velocity);
            let turned = (power.by_turn * self.base_spin()).x;
            (power.by_wrench * rates).x + (turned + carried) * pace
        })
    }

    /// Spin of the base along its own directors.
    pub(super) fn base_spin(&self) -> Vector3<f64> {
        self.base.pose.rotation.inverse() * halves(&self.base.twist).0
    }

    /// Gap from the end of the rod to its attachment: [`LinkEnd::gap`].
    pub fn gap(&self) -> Vector6<f64> {
        self.end.gap(&self.held())
    }

    /// Pose of the end attachment relative to the base.
    pub fn held(&self) -> Isometry3<f64> {
        self.base.pose.inv_mul(&self.tip.pose)
    }

    /// Wrenches of the rod on the carriers of its base and of its end, each at its attachment, in the world.
    pub fn wrenches(&self) -> [Vector6<f64>; 2] {
        let turn = self.base.pose.rotation;
        let n = self.end.force;
        let base = join(&(turn * self.end.base_couple), &(turn * n));
        let tip = turn * -self.end.tip_force();
        [base, join(&(turn * -self.end.couple), &tip)]
    }

    /// Potential of the dead load along the rod, in the world.
    pub fn potential(&self) -> f64 {
        self.end.along.as_ref().map_or(0.0, |along| {
            let total = self.base.pose.rotation * along.dead;
            along.potential - total.dot(&self.base.pose.translation.vector)
        })
    }
}
