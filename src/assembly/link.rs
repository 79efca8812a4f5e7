//! A rod between two attachments: its chart, the wrenches on what carries it, and its tangent.

use super::{Assembly, Place};
use crate::body::Support;
use crate::error::Result;
use crate::math::se3::{halves, joined};
use crate::rod::{EndConditions, Problem, Rod, Wrench};
use nalgebra::{Isometry3, Matrix3, Matrix6, Quaternion, UnitQuaternion, Vector3, Vector6};

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
    feature = "scene",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum Joint {
    /// The directors turn with the attachment.
    #[default]
    Weld,
    /// The end is free to turn: m(1) = 0.
    Ball,
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
}

/// The end of a rod seen from its base, in the directors there.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkEnd {
    /// Pose.
    pub pose: Isometry3<f64>,
    /// Couple m(1) of the attachment on the rod.
    pub couple: Vector3<f64>,
    /// Force n.
    pub force: Vector3<f64>,
    /// Stored energy.
    pub energy: f64,
    /// d(rotation, position)/d(m(0), n).
    pub tangent: Matrix6<f64>,
    /// d m(1)/d(m(0), n) in the first rows and d r(1) below for a ball joint, `tangent` for a weld: what a motion of the
    /// attachment prescribes, by the chart in units B/L and B/L^2; singular at folds.
    pub jacobian: Matrix6<f64>,
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

    /// How its end is held.
    pub fn joint(&self) -> Joint {
        self.joint
    }

    /// The units B/L, B/L^2 of the chart.
    pub fn units(&self) -> Vector6<f64> {
        let (couple, force) = self.rod.units();
        Vector6::new(couple, couple, couple, force, force, force)
    }

    /// The end under the chart point q = (m(0), n) in units B/L, B/L^2.
    ///
    /// # Errors
    /// As [`Rod::end`].
    pub fn end(&self, q: &Wrench, tolerance: f64) -> Result<LinkEnd> {
        let units = self.units();
        let found = self.rod.end(&q.component_mul(&units), tolerance)?;
        let section = &found.section;
        let mut jacobian = found.tangent;
        if self.joint == Joint::Ball {
            // m(1) = m(0) - r(1) x n.
            let by_r = section.force.cross_matrix();
            let r = section.position.cross_matrix();
            let columns = |j: usize| found.tangent.fixed_view::<3, 3>(3, j).into_owned();
            jacobian
                .fixed_view_mut::<3, 3>(0, 0)
                .copy_from(&(Matrix3::identity() + by_r * columns(0)));
            jacobian
                .fixed_view_mut::<3, 3>(0, 3)
                .copy_from(&(by_r * columns(3) - r));
        }
        for (mut column, unit) in jacobian.column_iter_mut().zip(units.iter()) {
            column *= *unit;
        }
        Ok(LinkEnd {
            pose: section.pose(),
            couple: section.couple,
            force: section.force,
            energy: section.energy,
            tangent: found.tangent,
            jacobian,
        })
    }

    /// The rod in place at time `t`.
    ///
    /// # Errors
    /// As [`Link::end`].
    pub fn point(&self, t: f64, bodies: &[Place], q: &Wrench, tolerance: f64) -> Result<LinkPoint> {
        Ok(LinkPoint {
            base: self.from.at(t, bodies),
            tip: self.to.at(t, bodies),
            end: self.end(q, tolerance)?,
        })
    }

    /// The rod with its end held by its joint at a pose seen from the base.
    pub(super) fn held_at(&self, end: &Isometry3<f64>, tolerance: f64) -> Result<Problem> {
        let conditions = match self.joint {
            Joint::Weld => EndConditions::pose(end.translation.vector, end.rotation),
            Joint::Ball => EndConditions::ball(end.translation.vector),
        };
        Problem::new(self.rod.clone(), conditions, tolerance)
    }

    /// How many equilibria with less energy the rod could buckle away into with its ends held: its index.
    ///
    /// # Errors
    /// As [`Problem::index_at`].
    pub fn index(&self, q: &Wrench, tolerance: f64) -> Result<usize> {
        // What is held counts, not where.
        let problem = self.held_at(&Isometry3::identity(), tolerance)?;
        let count = |q: &Wrench| problem.index_at(&q.component_mul(&self.units()));
        // It is counted under the force alone first. Where that is neutral (an elastica that can turn about its force) rounding
        // decides; nearby it is not, and away from folds the index of the held rod is the same there.
        let end = self.end(q, tolerance)?;
        let loaded = (self.gap_scale() * end.jacobian)
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
    /// should not bear, in B/L) and lengths of the rod.
    pub(super) fn apart(&self, point: &LinkPoint) -> f64 {
        let gap = point.gap(self.joint);
        let (turn, length) = match self.joint {
            Joint::Weld => (1.0, self.rod.length()),
            Joint::Ball => (self.rod.units().0, self.rod.length()),
        };
        let parts = gap.iter().enumerate();
        parts.fold(0.0, |most: f64, (i, x)| {
            most.max(x.abs() / if i < 3 { turn } else { length })
        })
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
    /// should be 0, and the way between the points: [`LinkEnd::jacobian`] times the correction of the chart.
    pub fn gap(&self, wanted: &Isometry3<f64>, joint: Joint) -> Vector6<f64> {
        let apart = wanted.translation.vector - self.pose.translation.vector;
        match joint {
            Joint::Weld => {
                let turn = wanted.rotation * self.pose.rotation.inverse();
                joined(&turn.scaled_axis(), &apart)
            }
            Joint::Ball => joined(&-self.couple, &apart),
        }
    }
}

impl LinkPoint {
    /// The twist of the end attachment relative to that of the base, along the base's directors; for a ball joint 0 and the
    /// velocity: what the chart follows, jacobian . q' = drive.
    pub fn drive(&self, joint: Joint) -> Vector6<f64> {
        let back = self.base.pose.rotation.inverse();
        let (turning, moving) = (halves(&self.base.twist), halves(&self.tip.twist));
        let arm = self.tip.pose.translation.vector - self.base.pose.translation.vector;
        let v = back * (moving.1 - turning.1 - turning.0.cross(&arm));
        match joint {
            Joint::Weld => joined(&(back * (moving.0 - turning.0)), &v),
            Joint::Ball => joined(&Vector3::zeros(), &v),
        }
    }

    /// The twist that leads from the end of the rod to its attachment, along the base's directors; for a ball joint minus the
    /// couple that should be 0, and the way between the points: [`LinkEnd::jacobian`] times the correction of the chart.
    pub fn gap(&self, joint: Joint) -> Vector6<f64> {
        self.end.gap(&self.base.pose.inv_mul(&self.tip.pose), joint)
    }

    /// The wrenches of the rod on what carries its base and on what carries its end, each at its attachment, in the world.
    pub fn wrenches(&self) -> [Vector6<f64>; 2] {
        let turn = self.base.pose.rotation;
        let n = self.end.force;
        let m0 = self.end.couple + self.end.pose.translation.vector.cross(&n);
        let base = joined(&(turn * m0), &(turn * n));
        [base, joined(&(turn * -self.end.couple), &(turn * -n))]
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
