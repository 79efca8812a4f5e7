//! The clamp: pose, motion, and the motion of a body seen from the clamp.

use super::{EndLinear, EndMotion, History};
use crate::error::{Error, Result};
use crate::math::frame::Frame;
use nalgebra::{Isometry3, Matrix2, SMatrix, SVector, UnitQuaternion, Vector2, Vector3};

/// The clamp of a rod in a space of `N` dimensions, tilted and moving.
///
/// Its axes (the rod leaves along the first one in the plane, along d3 in space) stand in the world as
/// ```text
/// R(t) = exp(sum_k angle_k(t) A_k) R0,     c(t) = c0 + sum_k direction_k history_k(t),
/// ```
/// with A_k the cross matrices of fixed unit axes of the world, through the clamp: one axis, in the plane its normal,
/// or the three axes of the world, whose angles are then the components of a rotation vector.
///
/// A run describes rod and body as seen from the clamp, with components along its axes. In this frame the rod is that
/// of a fixed clamp. Only the body has inertial forces, which [`Frame`] accounts for.
#[derive(Debug, Clone)]
pub struct Support<const N: usize> {
    position: SVector<f64, N>,
    rotation: SMatrix<f64, N, N>,
    moves: Vec<(SVector<f64, N>, History)>,
    /// Cross matrices A_k of the axes, and the angles.
    turning: Vec<(SMatrix<f64, N, N>, History)>,
}

/// exp(X) of a cross matrix, with its angular velocity exp(-X) exp(X)' along the turned axes and the rate of that.
fn turned_with_rates<const N: usize>(x: [SMatrix<f64, N, N>; 3]) -> [SMatrix<f64, N, N>; 3] {
    let [x, x_t, x_tt] = x;
    let bracket = |a: &SMatrix<f64, N, N>, b: &SMatrix<f64, N, N>| a * b - b * a;
    let square = -0.5 * (x * x).trace();
    let square_t = -(x * x_t).trace();
    // a = sin/angle, b = (1 - cos)/angle^2, c = (angle - sin)/angle^3, with the derivatives of b and c by angle^2.
    let [a, b, c, by_b, by_c] = if square < 1e-3 {
        let s = square;
        let series = |first: [f64; 4]| first[0] - s * (first[1] - s * (first[2] - s * first[3]));
        [
            series([1.0, 1.0 / 6.0, 1.0 / 120.0, 1.0 / 5040.0]),
            series([0.5, 1.0 / 24.0, 1.0 / 720.0, 1.0 / 40320.0]),
            series([1.0 / 6.0, 1.0 / 120.0, 1.0 / 5040.0, 1.0 / 362_880.0]),
            -series([1.0 / 24.0, 1.0 / 360.0, 1.0 / 13440.0, 1.0 / 907_200.0]),
            -series([
                1.0 / 120.0,
                1.0 / 2520.0,
                1.0 / 120_960.0,
                1.0 / 9_979_200.0,
            ]),
        ]
    } else {
        let angle = square.sqrt();
        let half = (0.5 * angle).sin();
        let a = angle.sin() / angle;
        let b = 2.0 * half * half / square;
        let c = (1.0 - a) / square;
        [
            a,
            b,
            c,
            0.5 * (a - 2.0 * b) / square,
            0.5 * (b - 3.0 * c) / square,
        ]
    };
    let turn = SMatrix::identity() + x * a + x * x * b;
    let once = bracket(&x, &x_t);
    let twice = bracket(&x, &once);
    let once_t = bracket(&x, &x_tt);
    let twice_t = bracket(&x_t, &once) + bracket(&x, &once_t);
    let spin = x_t - once * b + twice * c;
    let spin_t =
        x_tt - once * (by_b * square_t) - once_t * b + twice * (by_c * square_t) + twice_t * c;
    [turn, spin, spin_t]
}

impl<const N: usize> Support<N> {
    fn standing(position: SVector<f64, N>, rotation: SMatrix<f64, N, N>) -> Result<Self> {
        if !position.iter().chain(&rotation).all(|x| x.is_finite()) {
            return Err(Error::domain(format!(
                "the clamp's position {} and rotation must be finite",
                crate::error::named(&crate::error::AXES, position.as_slice())
            )));
        }
        Ok(Self {
            position,
            rotation,
            moves: Vec::new(),
            turning: Vec::new(),
        })
    }

    /// Adds a translation direction x history(t).
    ///
    /// # Errors
    /// A direction or a number of the history that is not finite; a history without a continuous second derivative
    /// ([`History::is_smooth`]), for a jump of the clamp's velocity would be an impact.
    pub fn with_translation(
        mut self,
        direction: SVector<f64, N>,
        history: History,
    ) -> Result<Self> {
        if !direction.iter().all(|x| x.is_finite()) {
            return Err(Error::domain(format!(
                "the direction {} of the clamp's motion must be finite",
                crate::error::named(&crate::error::AXES, direction.as_slice())
            )));
        }
        self.moves.push((direction, check_smooth(history)?));
        Ok(self)
    }

    fn turned(mut self, axis: SMatrix<f64, N, N>, angle: History) -> Result<Self> {
        self.turning.push((axis, check_smooth(angle)?));
        Ok(self)
    }

    /// True if the clamp does not move.
    pub fn is_fixed(&self) -> bool {
        self.moves.is_empty() && self.turning.is_empty()
    }

    /// True if two clamps keep their relative pose at all times.
    pub fn moves_with(&self, other: &Self) -> bool {
        let about_one_point = self.turning.is_empty() || self.position == other.position;
        self.moves == other.moves && self.turning == other.turning && about_one_point
    }

    /// True if the clamp turns.
    pub fn turns(&self) -> bool {
        !self.turning.is_empty()
    }

    /// The first break of the clamp's motion after `t`; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        let histories = self.moves.iter().map(|(_, history)| history);
        histories
            .chain(self.turning.iter().map(|(_, angle)| angle))
            .map(|history| history.next_break(t))
            .fold(f64::INFINITY, f64::min)
    }

    /// The clamp fixed in the pose of time `t`.
    #[must_use]
    pub fn standing_at(&self, t: f64) -> Self {
        let frame = self.at(t);
        Self {
            position: frame.origin,
            rotation: frame.turn,
            moves: Vec::new(),
            turning: Vec::new(),
        }
    }

    /// The clamp's frame at time `t`.
    pub fn at(&self, t: f64) -> Frame<N> {
        let mut origin = self.position;
        let (mut velocity, mut acceleration) = (SVector::zeros(), SVector::zeros());
        for (direction, history) in &self.moves {
            let [place, rate, change] = history.with_rates(t);
            origin += direction * place;
            velocity += direction * rate;
            acceleration += direction * change;
        }
        let mut turn = self.rotation;
        let (mut spin, mut spin_rate) = (SMatrix::zeros(), SMatrix::zeros());
        if let [(axis, history)] = self.turning.as_slice() {
            let [angle, rate, change] = history.with_rates(t);
            // exp(angle A) = 1 + sin A + (1 - cos) A^2, which commutes with A.
            let (sin, half) = (angle.sin(), (0.5 * angle).sin());
            turn += (axis * sin + axis * axis * (2.0 * half * half)) * self.rotation;
            let along = self.rotation.transpose() * axis * self.rotation;
            (spin, spin_rate) = (along * rate, along * change);
        } else if !self.turning.is_empty() {
            let mut x = [SMatrix::zeros(); 3];
            for (axis, history) in &self.turning {
                for (x, size) in x.iter_mut().zip(history.with_rates(t)) {
                    *x += axis * size;
                }
            }
            let [by, along, change] = turned_with_rates(x);
            turn = by * self.rotation;
            let seen = |m: SMatrix<f64, N, N>| self.rotation.transpose() * m * self.rotation;
            (spin, spin_rate) = (seen(along), seen(change));
        }
        Frame {
            velocity: turn.tr_mul(&velocity),
            acceleration: turn.tr_mul(&acceleration),
            centrifugal: spin_rate + spin * spin,
            coriolis: spin * 2.0,
            turn,
            origin,
            spin,
        }
    }
}

impl Support<2> {
    /// A clamp in the plane at `position`; the rod leaves it at `angle` from the x axis, in radians.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn new(position: Vector2<f64>, angle: f64) -> Result<Self> {
        let (sin, cos) = angle.sin_cos();
        Self::standing(position, Matrix2::new(cos, -sin, sin, cos))
    }

    /// Turns the clamp by angle(t), in radians, about the normal of the plane through it.
    ///
    /// # Errors
    /// As [`Support::with_translation`].
    pub fn with_turning(self, angle: History) -> Result<Self> {
        self.turned(Matrix2::new(0.0, -1.0, 1.0, 0.0), angle)
    }

    /// Frame of the clamp at time `t`, in space.
    pub fn in_space(&self, t: f64) -> Frame<3> {
        self.at(t).in_space()
    }
}

impl Support<3> {
    /// A clamp in space: position, and rotation from its axes (d1, d2, d3) to the world's.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn new(position: Vector3<f64>, rotation: &UnitQuaternion<f64>) -> Result<Self> {
        Self::standing(position, rotation.to_rotation_matrix().into_inner())
    }

    /// Turns the clamp by angle(t), in radians, about an axis of the world through it.
    ///
    /// # Errors
    /// As [`Support::with_translation`]; an axis of no direction.
    pub fn with_turning(self, axis: &Vector3<f64>, angle: History) -> Result<Self> {
        match axis.try_normalize(f64::MIN_POSITIVE) {
            Some(axis) if axis.iter().all(|x| x.is_finite()) => {
                self.turned(axis.cross_matrix(), angle)
            }
            _ => Err(Error::domain(format!(
                "the axis {} about which the clamp turns must be finite and not zero",
                crate::error::named(&crate::error::AXES, axis.as_slice())
            ))),
        }
    }

    /// Turns the clamp by the rotation vector v(t), given by its three components along the axes of the world.
    ///
    /// # Errors
    /// As [`Support::with_translation`].
    pub fn with_rotation_vector(self, components: [History; 3]) -> Result<Self> {
        let mut each = components.into_iter().enumerate();
        each.try_fold(self, |support, (i, component)| {
            support.turned(Vector3::ith(i, 1.0).cross_matrix(), component)
        })
    }

    /// The clamp's pose at time `t`.
    pub fn pose(&self, t: f64) -> Isometry3<f64> {
        self.at(t).pose()
    }
}

fn check_smooth(history: History) -> Result<History> {
    if history.is_smooth() {
        return history.checked();
    }
    Err(Error::domain(
        "a motion of the clamp must have a continuous acceleration: use a constant rate, a sine, or a smooth table",
    ))
}

impl<const D: usize> Frame<D> {
    /// The motion of a body seen from the frame. `motion` is the motion in the world as a function of the velocity
    /// and the force of the rod in the world.
    ///
    /// The power includes that of the support: the force of the rod on the body times the velocity of the frame. For
    /// the elastic energy falls by rod . v while the body gains rod . (v + A x + d).
    #[inline]
    pub fn motion(
        &self,
        x: &SVector<f64, D>,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
        motion: impl FnOnce(&SVector<f64, D>, &SVector<f64, D>) -> EndMotion<D>,
    ) -> EndMotion<D> {
        let world = motion(&self.absolute_velocity(x, v), &self.outward(rod));
        EndMotion {
            acceleration: self.inward(&world.acceleration)
                - self.acceleration_at_constant_velocity(x, v),
            power: world.power + rod.dot(&self.velocity_of_fixed_point(x)),
            loss: world.loss,
        }
    }

    /// The derivatives of the acceleration of [`Frame::motion`] from those of the motion in the world.
    pub fn linear(&self, world: &EndLinear<D>) -> EndLinear<D> {
        let seen = |m: &SMatrix<f64, D, D>| self.turn.tr_mul(&(m * self.turn));
        let by_velocity = seen(&world.by_velocity);
        EndLinear {
            by_pose: seen(&world.by_pose) + by_velocity * self.spin - self.centrifugal,
            by_velocity: by_velocity - self.coriolis,
            by_wrench: seen(&world.by_wrench),
        }
    }
}
