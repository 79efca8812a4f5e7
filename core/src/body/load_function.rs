//! Loads on a body as functions of time and of the motion of the body.

use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use nalgebra::{Isometry3, Matrix6, SVector, UnitQuaternion, Vector3, Vector6};
use std::fmt;
use std::sync::Arc;

/// A body at one moment, as a load sees the body, in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyState {
    /// Time.
    pub t: f64,
    /// Pose of the body frame, whose origin is the end of the rod. A point mass is not turned.
    pub pose: Isometry3<f64>,
    /// Velocity of the origin of the frame.
    pub velocity: Vector3<f64>,
    /// Angular velocity; 0 for a point mass.
    pub angular_velocity: Vector3<f64>,
}

/// A force at the centre of mass of a body and a couple on the body, along the axes of the world.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BodyWrench {
    /// Force.
    pub force: Vector3<f64>,
    /// Couple; 0 for a point mass, which bears none: a couple on a point mass ends a run.
    pub couple: Vector3<f64>,
}

/// Derivatives of a load, as rows (couple, force).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoadSlopes {
    /// By a twist (dphi, dr) of the body.
    pub by_pose: Matrix6<f64>,
    /// By the velocity (omega, r').
    pub by_velocity: Matrix6<f64>,
}

/// A load on a body as a function of time and of the motion of the body.
///
/// A run evaluates the function inside the stages of its steps: order and tolerance of the method hold for the function
/// as for the loads of a scene. Times come in no order, and states that no motion reaches are asked for as well. The
/// function must be smooth between its breaks, at which steps end. The work of the load counts as power. A value that
/// is not finite shortens a step, and ends a run that gets no further. A function that fails for good should fail from
/// then on at all times: the run then ends at once.
#[derive(Clone)]
pub struct LoadFunction {
    f: Arc<dyn Fn(&BodyState) -> BodyWrench + Send + Sync>,
    next_break: Arc<dyn Fn(f64) -> f64 + Send + Sync>,
}

/// Step of differences, in units of the motion; the error of a difference is about 1e-10.
const STEP: f64 = 6e-6;

impl LoadFunction {
    /// A function that is smooth at all times.
    pub fn smooth(f: impl Fn(&BodyState) -> BodyWrench + Send + Sync + 'static) -> Self {
        Self::with_breaks(f, |_| f64::INFINITY)
    }

    /// A function that is smooth between these times. At each of them a step ends, so that a jump lies inside no step.
    ///
    /// # Errors
    /// Times that are not finite or do not grow.
    pub fn piecewise(
        f: impl Fn(&BodyState) -> BodyWrench + Send + Sync + 'static,
        breaks: Vec<f64>,
    ) -> Result<Self> {
        let grow = breaks.is_sorted_by(|a, b| a < b);
        if !(grow && breaks.iter().all(|t| t.is_finite())) {
            return Err(Error::domain(format!(
                "the times {breaks:?} of a function's jumps must be finite, each later than the one before"
            )));
        }
        Ok(Self::with_breaks(f, move |t| {
            let next = breaks.partition_point(|s| *s <= t);
            breaks.get(next).copied().unwrap_or(f64::INFINITY)
        }))
    }

    /// A function with a rule for its breaks: the first one after a time, or infinity.
    pub fn with_breaks(
        f: impl Fn(&BodyState) -> BodyWrench + Send + Sync + 'static,
        next_break: impl Fn(f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        Self {
            f: Arc::new(f),
            next_break: Arc::new(next_break),
        }
    }

    /// The load at a state.
    pub fn at(&self, state: &BodyState) -> BodyWrench {
        (self.f)(state)
    }

    /// The first break after `t`; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        (self.next_break)(t)
    }

    /// The function for a motion as seen from a frame at rest in this pose.
    #[must_use]
    pub fn seen_from(&self, frame: &Isometry3<f64>) -> Self {
        if *frame == Isometry3::identity() {
            return self.clone();
        }
        let (frame, back) = (*frame, frame.rotation.inverse());
        let (f, next_break) = (self.f.clone(), self.next_break.clone());
        let seen = move |state: &BodyState| {
            let load = f(&BodyState {
                t: state.t,
                pose: frame * state.pose,
                velocity: frame.rotation * state.velocity,
                angular_velocity: frame.rotation * state.angular_velocity,
            });
            BodyWrench {
                force: back * load.force,
                couple: back * load.couple,
            }
        };
        Self {
            f: Arc::new(seen),
            next_break,
        }
    }
}

impl PartialEq for LoadFunction {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.f, &other.f) && Arc::ptr_eq(&self.next_break, &other.next_break)
    }
}

impl fmt::Debug for LoadFunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LoadFunction")
    }
}

impl BodyState {
    /// A point at `place` with a velocity; components beyond those given are 0.
    pub(super) fn of_point(t: f64, place: &[f64], velocity: &[f64]) -> Self {
        let lifted = |v: &[f64]| Vector3::from_fn(|i, _| v.get(i).copied().unwrap_or(0.0));
        Self {
            t,
            pose: Isometry3::from_parts(lifted(place).into(), UnitQuaternion::identity()),
            velocity: lifted(velocity),
            angular_velocity: Vector3::zeros(),
        }
    }

    /// A body at a pose with the velocity (omega, r').
    pub(super) fn of_body(t: f64, pose: &Isometry3<f64>, v: &Vector6<f64>) -> Self {
        let (angular_velocity, velocity) = halves(v);
        Self {
            t,
            pose: *pose,
            velocity,
            angular_velocity,
        }
    }

    /// The state after a small twist (dphi, dr) and a change of the velocity (omega, r').
    fn changed(&self, twist: &Vector6<f64>, velocity: &Vector6<f64>) -> Self {
        let ((turn, shift), (spin, speed)) = (halves(twist), halves(velocity));
        let mut pose = self.pose;
        pose.rotation = UnitQuaternion::from_scaled_axis(turn) * pose.rotation;
        pose.translation.vector += shift;
        Self {
            t: self.t,
            pose,
            velocity: self.velocity + speed,
            angular_velocity: self.angular_velocity + spin,
        }
    }
}

impl BodyWrench {
    /// The force on a point mass of `N` dimensions. A couple, or a force out of the plane, is not finite: nothing bears
    /// them.
    pub(super) fn on_point<const N: usize>(&self) -> SVector<f64, N> {
        let beyond = self.force.iter().skip(N).chain(&self.couple);
        if beyond.into_iter().any(|x| *x != 0.0) {
            return SVector::repeat(f64::NAN);
        }
        SVector::from_fn(|i, _| self.force[i])
    }

    /// The sum of functions at a state.
    pub(super) fn sum(functions: &[LoadFunction], state: &BodyState) -> Self {
        let each = functions.iter().map(|function| function.at(state));
        each.fold(Self::default(), |sum, load| Self {
            force: sum.force + load.force,
            couple: sum.couple + load.couple,
        })
    }
}

impl LoadSlopes {
    /// Derivatives of the sum of functions at a state, by central differences.
    pub(super) fn of(functions: &[LoadFunction], state: &BodyState) -> Self {
        let still = Vector6::zeros();
        let along = |k: usize, moved: &dyn Fn(&Vector6<f64>) -> BodyState| {
            let one = |step: f64| {
                let mut way = still;
                way[k] = step;
                let load = BodyWrench::sum(functions, &moved(&way));
                join(&load.couple, &load.force)
            };
            (one(STEP) - one(-STEP)) / (2.0 * STEP)
        };
        let columns = |moved: &dyn Fn(&Vector6<f64>) -> BodyState| {
            Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|k| along(k, moved)))
        };
        Self {
            by_pose: columns(&|way| state.changed(way, &still)),
            by_velocity: columns(&|way| state.changed(&still, way)),
        }
    }
}

/// The first break of functions after `t`.
pub(super) fn first_break_of(functions: &[LoadFunction], t: f64) -> f64 {
    let breaks = functions.iter().map(|function| function.next_break(t));
    breaks.fold(f64::INFINITY, f64::min)
}
