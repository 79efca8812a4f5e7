//! Strains at a point of an element from the interpolated position and quaternion, with first and second derivatives.
//!
//! The nodes of an element have positions r_i and unit quaternions p_i. Both are interpolated by polynomials, and the
//! quaternion p(s) has any norm: R = R(p). With n = |p|^2 the strains are
//! ```text
//! u = 2 Im(p* p')/n,      v = Im(p* r' p)/n.
//! ```
//! A turn or a shift of all nodes changes neither. The power of the resultants (m, f) is that of
//! N = 2 <p', p m> + <r' p, p f> over n, which is quadratic in p and p': all derivatives are short.

use crate::math::se3::{Turn, conjugate, halves, join, product};
use crate::section::Strain;
use nalgebra::{Matrix3x4, Matrix4, SMatrix, Vector3};

/// p, p', r' at a point, or their rates.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    pub turn: Turn,
    pub turn_along: Turn,
    pub tangent: Vector3<f64>,
}

/// Derivative of the power by p, p' and r'.
pub type Gradient = Point;

/// Second derivatives by (p, p', r').
pub type Hessian = SMatrix<f64, 11, 11>;

fn pure(v: &Vector3<f64>) -> Turn {
    Turn::new(0.0, v.x, v.y, v.z)
}

fn vector(p: &Turn) -> Vector3<f64> {
    Vector3::new(p[1], p[2], p[3])
}

/// f -> a o f.
fn left(a: &Turn) -> Matrix4<f64> {
    let [w, x, y, z] = [a[0], a[1], a[2], a[3]];
    #[rustfmt::skip]
    let matrix = Matrix4::new(
        w, -x, -y, -z,
        x,  w, -z,  y,
        y,  z,  w, -x,
        z, -y,  x,  w,
    );
    matrix
}

/// f -> f o a.
fn right(a: &Turn) -> Matrix4<f64> {
    let [w, x, y, z] = [a[0], a[1], a[2], a[3]];
    #[rustfmt::skip]
    let matrix = Matrix4::new(
        w, -x, -y, -z,
        x,  w,  z, -y,
        y, -z,  w,  x,
        z,  y, -x,  w,
    );
    matrix
}

impl Point {
    pub fn zero() -> Self {
        Self {
            turn: Turn::zeros(),
            turn_along: Turn::zeros(),
            tangent: Vector3::zeros(),
        }
    }

    /// (u, v).
    pub fn strain(&self) -> Strain {
        let over = 1.0 / self.turn.norm_squared();
        let back = conjugate(&self.turn);
        let u = vector(&product(&back, &self.turn_along)) * (2.0 * over);
        let v = product(&product(&back, &pure(&self.tangent)), &self.turn);
        join(&u, &(vector(&v) * over))
    }

    /// Rate of the strain for rates of p, p' and r'.
    pub fn strain_rate(&self, rate: &Self, strain: &Strain) -> Strain {
        let over = 1.0 / self.turn.norm_squared();
        let growth = 2.0 * self.turn.dot(&rate.turn) * over;
        let (back, back_rate) = (conjugate(&self.turn), conjugate(&rate.turn));
        let u = product(&back_rate, &self.turn_along) + product(&back, &rate.turn_along);
        let along = pure(&self.tangent);
        let v = product(&product(&back_rate, &along), &self.turn)
            + product(&product(&back, &pure(&rate.tangent)), &self.turn)
            + product(&product(&back, &along), &rate.turn);
        join(&(vector(&u) * (2.0 * over)), &(vector(&v) * over)) - strain * growth
    }

    /// Derivative of resultants . strain by p, p' and r'.
    pub fn gradient(&self, resultants: &Strain, strain: &Strain) -> Gradient {
        let over = 1.0 / self.turn.norm_squared();
        let (m, f) = halves(resultants);
        let (m, f) = (pure(&m), pure(&f));
        let force = product(&self.turn, &f);
        let power = resultants.dot(strain);
        let by_turn = product(&self.turn_along, &m) + product(&pure(&self.tangent), &force);
        Gradient {
            turn: (by_turn + self.turn * power) * (-2.0 * over),
            turn_along: product(&self.turn, &m) * (2.0 * over),
            tangent: vector(&product(&force, &conjugate(&self.turn))) * over,
        }
    }

    /// Second derivatives of resultants . strain at fixed resultants, and those of the strain first: rows of strains.
    pub fn second(&self, resultants: &Strain, strain: &Strain) -> (SMatrix<f64, 6, 11>, Hessian) {
        let mut first = SMatrix::<f64, 6, 11>::zeros();
        for k in 0..6 {
            let mut unit = Strain::zeros();
            unit[k] = 1.0;
            let row = self.gradient(&unit, strain);
            for i in 0..4 {
                first[(k, i)] = row.turn[i];
                first[(k, 4 + i)] = row.turn_along[i];
            }
            for i in 0..3 {
                first[(k, 8 + i)] = row.tangent[i];
            }
        }
        let over = 1.0 / self.turn.norm_squared();
        let (m, f) = halves(resultants);
        let (m, f) = (pure(&m), pure(&f));
        let power = resultants.dot(strain);
        let gradient = self.gradient(resultants, strain);
        let p = &self.turn;
        // Of N/n: the derivatives of N over n, less those of n.
        let mut own = left(&pure(&self.tangent)) * right(&f) * (-2.0 * over);
        own -= Matrix4::identity() * (2.0 * power * over);
        let cross = gradient.turn * p.transpose() * (2.0 * over);
        own -= cross + cross.transpose();
        let along = right(&m) * (2.0 * over) - gradient.turn_along * p.transpose() * (2.0 * over);
        // d Im(p f p*) = 2 Im(dp f p*).
        let moved = right(&product(&f, &conjugate(p))) * (2.0 * over);
        let tangent: Matrix3x4<f64> =
            moved.fixed_rows::<3>(1).into_owned() - gradient.tangent * p.transpose() * (2.0 * over);
        let mut second = Hessian::zeros();
        second.fixed_view_mut::<4, 4>(0, 0).copy_from(&own);
        second.fixed_view_mut::<4, 4>(4, 0).copy_from(&along);
        second
            .fixed_view_mut::<4, 4>(0, 4)
            .copy_from(&along.transpose());
        second.fixed_view_mut::<3, 4>(8, 0).copy_from(&tangent);
        second
            .fixed_view_mut::<4, 3>(0, 8)
            .copy_from(&tangent.transpose());
        (first, second)
    }
}
