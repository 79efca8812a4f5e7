//! Kinematics of the body at the end of a rod on a sheet, for contacts with obstacles.

use super::Phase;
use crate::contact::{Bodies, Closed, ContactDynamics, Grip, Moment};
use nalgebra::{Isometry3, SVector, Vector3, Vector6};
use snaprod_systems::body::{EndMotion, Frame, PointMass};
use snaprod_systems::contact::{MAX_AT_ONCE, RigidMotion};
use snaprod_systems::manifold::{Multivalued, adjugate_times};
use snaprod_systems::math::se3::{halves, join};

/// Closed contacts of the body, which act within steps.
#[derive(Clone, Copy)]
pub struct HeldContacts<'a> {
    system: &'a Bodies,
    closed: [Option<Closed>; MAX_AT_ONCE],
}

impl<'a> HeldContacts<'a> {
    /// The contacts of the one body of `system` that carry forces: no more than [`MAX_AT_ONCE`] can.
    pub(crate) fn new(system: &'a Bodies, closed: &[Closed]) -> Self {
        let mut held = closed.iter().filter(|closed| closed.grip != Grip::Idle);
        Self {
            system,
            closed: std::array::from_fn(|_| held.next().copied()),
        }
    }

    /// True if there is one.
    pub fn hold(&self) -> bool {
        self.closed[0].is_some()
    }

    /// The first time after `t` at which the motion of an obstacle is not smooth.
    pub fn next_break(&self, t: f64) -> f64 {
        self.system.next_break(t)
    }

    /// The closed contacts.
    fn closed(&self) -> Vec<Closed> {
        self.closed.iter().copied().flatten().collect()
    }

    /// Adds the contact forces to the motion of the body. None if there are none that keep the contacts.
    pub fn act<const N: usize>(
        &self,
        body: &PointMass<N>,
        y: &Phase<N>,
        pose: &SVector<f64, N>,
        action: &mut EndMotion<N>,
    ) -> Option<()> {
        let frame = frame(body, y.t);
        let mut now = moment(self.system, &frame, y, pose);
        now.accelerations[0] = outward(&frame, &action.acceleration);
        let contact = now.act(&self.closed())?;
        action.acceleration += inward(&frame, &contact.accelerations[0]);
        action.loss += contact.loss;
        action.power += contact.work;
        Some(())
    }
}

/// The frame from which the body is seen. The frame is at rest.
fn frame<const N: usize>(body: &PointMass<N>, t: f64) -> Frame<N> {
    body.support()
        .map_or_else(Frame::at_rest, |support| support.at(t))
}

fn raised<const N: usize>(v: &SVector<f64, N>) -> Vector3<f64> {
    Vector3::from_fn(|i, _| if i < N { v[i] } else { 0.0 })
}

/// A vector of the frame as the linear part of a twist in the world.
fn outward<const N: usize>(frame: &Frame<N>, v: &SVector<f64, N>) -> Vector6<f64> {
    join(&Vector3::zeros(), &raised(&frame.outward(v)))
}

fn inward<const N: usize>(frame: &Frame<N>, twist: &Vector6<f64>) -> SVector<f64, N> {
    let linear = halves(twist).1;
    frame.inward(&SVector::from_fn(|i, _| linear[i]))
}

fn moment<'a, const N: usize>(
    system: &'a Bodies,
    frame: &Frame<N>,
    y: &Phase<N>,
    pose: &SVector<f64, N>,
) -> Moment<'a> {
    let place = Isometry3::from_parts(raised(&frame.place(pose)).into(), Default::default());
    let velocity = outward(frame, &y.v);
    Moment::new(system, y.t, vec![RigidMotion::new(place, &velocity)])
}

/// A state with the losses of the last impacts.
#[derive(Debug, Clone, Copy)]
pub struct Struck<const N: usize> {
    /// The state, its chart point in the global chart.
    pub phase: Phase<N>,
    /// Kinetic energy lost in impacts.
    pub lost: f64,
    /// Work of obstacles in impacts.
    pub work: f64,
}

/// The equations of motion of the body on its rod.
pub struct SheetBody<'b, 'a, M, const N: usize> {
    /// The equilibria of the rod.
    pub manifold: &'b M,
    /// The body with its loads.
    pub body: &'b PointMass<N>,
    /// The body with its shape, and the obstacles.
    pub system: &'a Bodies,
    /// Latest time at which loads and obstacles are evaluated.
    pub until: f64,
}

impl<'a, M: Multivalued<N>, const N: usize> SheetBody<'_, 'a, M, N> {
    /// Place and velocity of the body, and the obstacles.
    pub fn at(&self, phase: &Phase<N>) -> Moment<'a> {
        let y = self.seen(phase);
        let pose = self.manifold.point(&y.q).map(|point| point.pose);
        let pose = pose.unwrap_or_else(|| SVector::repeat(f64::NAN));
        moment(self.system, &frame(self.body, y.t), &y, &pose)
    }

    /// [`SheetBody::at`] with the acceleration without contact forces.
    pub fn loaded(&self, phase: &Phase<N>) -> Moment<'a> {
        let y = self.seen(phase);
        let frame = frame(self.body, y.t);
        let Some(point) = self.manifold.point(&y.q) else {
            let nowhere = SVector::repeat(f64::NAN);
            return moment(self.system, &frame, &y, &nowhere);
        };
        let action = self.body.action(y.t, &point.pose, &y.v, &point.force);
        let mut now = moment(self.system, &frame, &y, &point.pose);
        now.accelerations[0] = outward(&frame, &action.acceleration);
        now
    }

    fn seen(&self, phase: &Phase<N>) -> Phase<N> {
        Phase {
            t: phase.t.min(self.until),
            ..*phase
        }
    }
}

impl<M: Multivalued<N>, const N: usize> ContactDynamics for SheetBody<'_, '_, M, N> {
    type State = Struck<N>;

    fn time(&self, y: &Struck<N>) -> f64 {
        y.phase.t
    }

    fn places(&self, y: &Struck<N>) -> Moment<'_> {
        self.at(&y.phase)
    }

    fn moment(&self, y: &Struck<N>) -> Moment<'_> {
        self.loaded(&y.phase)
    }

    fn add_twists(&self, y: &mut Struck<N>, changes: &[Vector6<f64>]) {
        y.phase.v += inward(&frame(self.body, y.phase.t), &changes[0]);
    }

    /// A shift is left out where the chart is singular: on a fold.
    fn shift(&self, y: &mut Struck<N>, changes: &[Vector6<f64>]) {
        let shift = inward(&frame(self.body, y.phase.t), &changes[0]);
        if let Some(point) = self.manifold.point(&y.phase.q) {
            let (det, along) = adjugate_times(&point.jacobian, &shift);
            let change = along / det;
            if change.norm() <= MOST_SHIFT {
                y.phase.q += change;
            }
        }
    }

    fn book_impact(&self, y: &mut Struck<N>, loss: f64, work: f64) {
        y.lost += loss;
        y.work += work;
    }
}

/// Largest change of the chart by which a state is put back on an obstacle.
const MOST_SHIFT: f64 = 1e-6;
