//! Guides: the motions that a joint leaves to what it carries, about axes and along directions of its own.
//!
//! A joint of free axes carries a node, to which an end of a rod is welded. The node turns about the joint's axes and
//! slides along its directions; these coordinates are unknowns of the assembly, as the poses of bodies are. The
//! balance of a coordinate is the couple about its axis, or the force along it, less the joint's law. A hinge has one
//! axis, a universal joint two: the first stays with the carrier, the second with the rod. A body that stays in a
//! plane has a guide of two directions and one axis.

use super::attachment::Attachment;
use super::body::BodyMotion;
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use nalgebra::{Isometry3, Matrix6xX, UnitQuaternion, UnitVector3, Vector3, Vector6};
use std::f64::consts::{PI, TAU};

/// Largest cosine of the angle between two axes that count as perpendicular.
const ACROSS: f64 = 1e-9;

/// Couple or force of a joint in one of its coordinates y: couple - stiffness (y - rest) - damping y'.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointLaw {
    /// Constant couple about the axis, or force along the direction, on what the joint carries.
    pub couple: f64,
    /// Stiffness >= 0 of a spring in the joint.
    pub stiffness: f64,
    /// Coordinate at which the spring is unloaded.
    pub rest: f64,
    /// Viscous friction >= 0: couple per rate of the angle, or force per rate of the shift.
    pub damping: f64,
}

/// A freedom of a joint: a turn about an axis, or a slide along a direction, with its law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeAxis {
    /// True for a turn.
    pub turns: bool,
    /// Axis or direction, along the directors that the freedoms before leave.
    pub along: UnitVector3<f64>,
    /// Law of the coordinate.
    pub law: JointLaw,
}

impl JointLaw {
    /// Couple or force at rest on what the joint carries.
    pub(crate) fn at(&self, y: f64) -> f64 {
        self.couple - self.stiffness * (y - self.rest)
    }

    /// Potential of [`JointLaw::at`].
    pub(crate) fn potential(&self, y: f64) -> f64 {
        let apart = y - self.rest;
        0.5 * self.stiffness * apart * apart - self.couple * y
    }
}

/// Derivatives of the action of a wrench in the coordinates of a joint, by turns of the joint's axes.
pub(super) struct TurnedAction {
    /// For each coordinate, by a spin of the carrier.
    pub by_spin: Vec<Vector3<f64>>,
    /// For the second axis of a universal joint, by the angle about the first axis.
    pub second_by_first: f64,
}

/// Axes and directions along which a joint leaves a node, or a plane a body, free. Coordinates count turns first.
#[derive(Debug, Clone)]
pub struct Guide {
    on: Attachment,
    turns: Vec<UnitVector3<f64>>,
    slides: Vec<UnitVector3<f64>>,
    laws: Vec<JointLaw>,
    kind: GuideKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum GuideKind {
    /// A joint that carries a node.
    Axes,
    /// A ball joint that carries a node: the node turns freely, by spins about the axes of the world.
    Ball,
    /// A plane that confines a body.
    Plane,
}

impl Guide {
    /// A guide at the place `on`, with axes and directions along the directors there.
    ///
    /// # Errors
    /// More than two axes; axes, or directions, that are not perpendicular to each other; another number of laws than
    /// of both; a law that is not finite, or with a negative stiffness.
    pub fn new(
        on: Attachment,
        turns: Vec<UnitVector3<f64>>,
        slides: Vec<UnitVector3<f64>>,
        laws: Vec<JointLaw>,
    ) -> Result<Self> {
        let oblique = |axes: &[UnitVector3<f64>]| {
            let pairs = axes.iter().enumerate();
            pairs
                .flat_map(|(i, a)| axes[..i].iter().map(move |b| a.dot(b).abs()))
                .any(|c| c > ACROSS)
        };
        if turns.len() > 2 || oblique(&turns) || oblique(&slides) {
            return Err(Error::domain(
                "the axes of a joint must be perpendicular to each other, and two at most",
            ));
        }
        if laws.len() != turns.len() + slides.len() {
            return Err(Error::domain("a joint has one law for each free axis"));
        }
        for law in &laws {
            let JointLaw {
                couple,
                stiffness,
                rest,
                damping,
            } = *law;
            let finite = [couple, stiffness, rest, damping]
                .iter()
                .all(|x| x.is_finite());
            if !(finite && stiffness >= 0.0 && damping >= 0.0) {
                return Err(Error::domain(
                    "couple, stiffness, rest and damping of a joint must be finite, stiffness and damping >= 0",
                ));
            }
        }
        Ok(Self {
            on,
            turns,
            slides,
            laws,
            kind: GuideKind::Axes,
        })
    }

    /// A plane through the reference point of a body: the body turns about the normal alone.
    pub fn plane(normal: UnitVector3<f64>, point: Vector3<f64>, turns: bool) -> Self {
        let least = normal.iamin();
        let first = UnitVector3::new_normalize(normal.cross(&Vector3::ith(least, 1.0)));
        let second = UnitVector3::new_normalize(normal.cross(&first));
        Self {
            on: Attachment::ground(Isometry3::translation(point.x, point.y, point.z)),
            turns: if turns { vec![normal] } else { Vec::new() },
            slides: vec![first, second],
            laws: vec![JointLaw::default(); 2 + usize::from(turns)],
            kind: GuideKind::Plane,
        }
    }

    /// A ball joint: the node keeps its place on the carrier and turns freely.
    pub fn ball(on: Attachment) -> Self {
        Self {
            on,
            turns: Vec::new(),
            slides: Vec::new(),
            laws: Vec::new(),
            kind: GuideKind::Ball,
        }
    }

    /// True for a ball joint.
    pub fn is_ball(&self) -> bool {
        self.kind == GuideKind::Ball
    }

    /// True for a plane, false for a joint.
    pub fn is_plane(&self) -> bool {
        self.kind == GuideKind::Plane
    }

    /// True if the rod of the joint turns freely as on a ball joint: about all axes, or in a plane about one.
    pub fn turns_freely(&self, in_plane: bool) -> bool {
        let turns = self.is_ball() || (in_plane && self.turns.len() == 1);
        let idle = |law: &JointLaw| law.couple == 0.0 && law.stiffness == 0.0;
        turns && self.slides.is_empty() && !self.is_plane() && self.laws.iter().all(idle)
    }

    /// Attachment of the joint.
    pub fn on(&self) -> &Attachment {
        &self.on
    }

    /// Freedoms of a joint with axes, from the carrier to the node: slides, then turns.
    pub fn free_axes(&self) -> Vec<FreeAxis> {
        let (turns, slides) = self.laws.split_at(self.turns.len());
        let axes = |turns: bool, along: &[UnitVector3<f64>], laws: &[JointLaw]| {
            let pairs = along.iter().zip(laws);
            let axes = pairs.map(|(along, law)| FreeAxis {
                turns,
                along: *along,
                law: *law,
            });
            axes.collect::<Vec<_>>()
        };
        let mut all = axes(false, &self.slides, slides);
        all.extend(axes(true, &self.turns, turns));
        all
    }

    /// Coordinates of the freedoms, in the order of [`Guide::free_axes`], of the node at a pose at time 0.
    pub fn along_axes(&self, bodies: &[BodyMotion], node: &Isometry3<f64>) -> Vec<f64> {
        let mut y = self.coordinates(&self.frame(0.0, bodies), node);
        y.rotate_left(self.turns.len());
        y
    }

    /// Coordinates and rates at time `t` of what the joint carries, turns first. Angles are in (-pi, pi].
    pub fn coordinates_and_rates(
        &self,
        t: f64,
        bodies: &[BodyMotion],
        carried: &BodyMotion,
    ) -> Vec<[f64; 2]> {
        let frame = self.on.at(t, bodies);
        let [(spin, velocity), (own_spin, own_velocity)] =
            [&frame, carried].map(|motion| halves(&motion.twist));
        let arm = carried.pose.translation.vector - frame.pose.translation.vector;
        let relative = join(
            &(own_spin - spin),
            &(own_velocity - velocity - spin.cross(&arm)),
        );
        let rates = self.twists(&frame.pose, &carried.pose).tr_mul(&relative);
        let each = self.coordinates(&frame.pose, &carried.pose).into_iter();
        each.zip(&rates).map(|(y, rate)| [y, *rate]).collect()
    }

    /// Number of axes.
    pub fn turnings(&self) -> usize {
        if self.is_ball() { 3 } else { self.turns.len() }
    }

    /// Number of directions.
    pub fn shiftings(&self) -> usize {
        self.slides.len()
    }

    /// The body that carries the joint.
    pub fn parent(&self) -> Option<usize> {
        self.on.carried_by()
    }

    /// Pose of the node at the coordinates 0.
    pub fn unturned(&self, bodies: &[BodyMotion]) -> Isometry3<f64> {
        self.frame(0.0, bodies)
    }

    /// Pose of the frame of the joint.
    pub(crate) fn frame(&self, t: f64, bodies: &[BodyMotion]) -> Isometry3<f64> {
        self.on.at(t, bodies).pose
    }

    /// Pose at the coordinates `y`.
    pub(crate) fn pose(&self, frame: &Isometry3<f64>, y: &[f64]) -> Isometry3<f64> {
        let (turned, slid) = y.split_at(self.turns.len());
        let mut own = Isometry3::identity();
        for (axis, y) in self.slides.iter().zip(slid) {
            own.translation.vector += axis.into_inner() * *y;
        }
        for (axis, y) in self.turns.iter().zip(turned) {
            own.rotation *= UnitQuaternion::from_axis_angle(axis, *y);
        }
        let mut pose = frame * own;
        pose.rotation.renormalize();
        pose
    }

    /// Coordinates of a pose; what the joint does not leave free is left out. Angles are in (-pi, pi].
    pub(crate) fn coordinates(&self, frame: &Isometry3<f64>, pose: &Isometry3<f64>) -> Vec<f64> {
        let own = frame.inv_mul(pose);
        let mut y = match self.turns.as_slice() {
            [axis] => vec![2.0 * own.rotation.imag().dot(axis).atan2(own.rotation.w)],
            // The second axis turns about the first, and the first, seen from the node, about the second.
            [a, b] => {
                let (b_turned, a_seen) = (
                    own.rotation * b.into_inner(),
                    own.rotation.inverse() * a.into_inner(),
                );
                vec![
                    a.dot(&b.cross(&b_turned)).atan2(b.dot(&b_turned)),
                    -b.dot(&a.cross(&a_seen)).atan2(a.dot(&a_seen)),
                ]
            }
            _ => Vec::new(),
        };
        y.iter_mut().for_each(|y| *y = nearest_turn(*y));
        y.extend(
            self.slides
                .iter()
                .map(|axis| axis.dot(&own.translation.vector)),
        );
        y
    }

    /// The node, or body, displaced by changes of its coordinates, as the frame moves.
    pub(super) fn moved(
        &self,
        (frame, pose): (&Isometry3<f64>, &Isometry3<f64>),
        later: &Isometry3<f64>,
        by: &[f64],
    ) -> Isometry3<f64> {
        if self.is_ball() {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(by));
            let mut turned = turn * pose.rotation;
            turned.renormalize();
            return Isometry3::from_parts(later.translation, turned);
        }
        let y = self.coordinates(frame, pose);
        let y: Vec<f64> = y.iter().zip(by).map(|(y, by)| y + by).collect();
        self.pose(later, &y)
    }

    /// Differences of the coordinates of two poses, each in its frame; those of angles in (-pi, pi].
    pub(super) fn between(
        &self,
        (frame, from): (&Isometry3<f64>, &Isometry3<f64>),
        (later, to): (&Isometry3<f64>, &Isometry3<f64>),
    ) -> Vec<f64> {
        if self.is_ball() {
            let turn = to.rotation * from.rotation.inverse();
            return turn.scaled_axis().iter().copied().collect();
        }
        let (a, b) = (self.coordinates(frame, from), self.coordinates(later, to));
        let each = a.iter().zip(&b).enumerate();
        each.map(|(i, (a, b))| {
            if i < self.turns.len() {
                nearest_turn(b - a)
            } else {
                b - a
            }
        })
        .collect()
    }

    /// Axes of the turns in the world: the last one turns with the node, one before it with the carrier.
    fn axes(&self, frame: &Isometry3<f64>, pose: &Isometry3<f64>) -> Vec<Vector3<f64>> {
        if self.is_ball() {
            return (0..3).map(|i| Vector3::ith(i, 1.0)).collect();
        }
        let last = self.turns.len().saturating_sub(1);
        let each = self.turns.iter().enumerate();
        each.map(|(i, axis)| {
            if i == last {
                pose.rotation * axis.into_inner()
            } else {
                frame.rotation * axis.into_inner()
            }
        })
        .collect()
    }

    fn directions<'a>(
        &'a self,
        frame: &'a Isometry3<f64>,
    ) -> impl Iterator<Item = Vector3<f64>> + 'a {
        self.slides
            .iter()
            .map(|axis| frame.rotation * axis.into_inner())
    }

    /// Twists of the node per unit of the rates of the coordinates, with the carrier at rest.
    pub(super) fn twists(&self, frame: &Isometry3<f64>, pose: &Isometry3<f64>) -> Matrix6xX<f64> {
        let turns = self
            .axes(frame, pose)
            .into_iter()
            .map(|axis| join(&axis, &Vector3::zeros()));
        let slides = self
            .directions(frame)
            .map(|along| join(&Vector3::zeros(), &along));
        Matrix6xX::from_columns(&turns.chain(slides).collect::<Vec<Vector6<f64>>>())
    }

    /// Couples and forces of the laws in the coordinates.
    pub(super) fn actions(&self, frame: &Isometry3<f64>, pose: &Isometry3<f64>) -> Vec<f64> {
        if self.is_ball() {
            return vec![0.0; 3];
        }
        let y = self.coordinates(frame, pose);
        self.laws.iter().zip(y).map(|(law, y)| law.at(y)).collect()
    }

    /// Laws by coordinate.
    pub(super) fn laws(&self) -> &[JointLaw] {
        &self.laws
    }

    /// Stiffness of the laws by coordinate.
    pub(super) fn stiffnesses(&self) -> impl Iterator<Item = f64> + '_ {
        self.laws.iter().map(|law| law.stiffness)
    }

    /// Potential of the laws.
    pub(crate) fn potential(&self, frame: &Isometry3<f64>, pose: &Isometry3<f64>) -> f64 {
        let y = self.coordinates(frame, pose);
        self.laws
            .iter()
            .zip(y)
            .map(|(law, y)| law.potential(y))
            .sum()
    }

    /// Derivatives of the action of a fixed wrench on the node as the axes turn.
    pub(super) fn turned_action(
        &self,
        frame: &Isometry3<f64>,
        pose: &Isometry3<f64>,
        wrench: &Vector6<f64>,
    ) -> TurnedAction {
        if self.is_ball() {
            return TurnedAction {
                by_spin: vec![Vector3::zeros(); 3],
                second_by_first: 0.0,
            };
        }
        let (m, n) = halves(wrench);
        let axes = self.axes(frame, pose);
        let second_by_first = match axes.as_slice() {
            [a, b] => b.cross(&m).dot(a),
            _ => 0.0,
        };
        let turns = axes.iter().map(|axis| axis.cross(&m)).collect::<Vec<_>>();
        let slides = self.directions(frame).map(|along| along.cross(&n));
        TurnedAction {
            by_spin: turns.into_iter().chain(slides).collect(),
            second_by_first,
        }
    }

    /// Changes of the force's couple about the carrier as the node slides: (coordinate, direction x force).
    pub(super) fn slid(
        &self,
        frame: &Isometry3<f64>,
        n: &Vector3<f64>,
    ) -> Vec<(usize, Vector3<f64>)> {
        let first = self.turns.len();
        self.directions(frame)
            .enumerate()
            .map(|(i, along)| (first + i, along.cross(n)))
            .collect()
    }
}

/// The angle less full turns, in (-pi, pi].
fn nearest_turn(angle: f64) -> f64 {
    let rest = angle.rem_euclid(TAU);
    if rest > PI { rest - TAU } else { rest }
}
