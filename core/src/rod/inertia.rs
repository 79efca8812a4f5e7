//! The inertia of a rod that stays on its equilibria while base and base wrench change (theory 3.9).
//!
//! Seen from the base the section s is at r(s; b), R(s; b), b the base wrench. While b changes at the rate b', it turns and moves by
//! (omega, v) = T(s) b', T the tangent of the initial-value problem, and with b'' = 0 these change by (omega_t, r_tt), the second
//! derivative along b':
//!
//! ```text
//! omega' = R u_t,                          v' = omega x tau + R v_t,                                         tau = r'
//! omega_t' = R u_tt + omega x R u_t,       r_tt' = omega_t x tau + omega x (omega x tau) + 2 omega x R v_t + R v_tt
//! (u, v)_t = C w_t,   (u, v)_tt = C w_tt,  w = (R^T m, R^T n),   m = m(0) - r x n
//! ```
//!
//! The law is linear, C does not depend on w. With the twist (Omega, V) of the base every section has the twist
//! Lambda (Omega, V, b'), Lambda = [1, 0, T_omega; -r x, 1, T_v]; d'Alembert's principle asks for int Lambda^T (inertia - weight).
//! All integrals are carried along the rod with its shape, T and the second derivative, by one integration.

use super::Rod;
use super::line::{Flow, LineState, Wrench, first_step, over_pieces, unit_columns};
use super::scaled_law::ScaledLaw;
use crate::error::{Error, Result};
use crate::math::se3::joined;
use crate::solve::dop853::State;
use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};

/// What the sections of a rod weigh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionMass {
    /// Mass of the whole rod, the same per unloaded length everywhere.
    pub mass: f64,
    /// Inertia of the sections per length about their middle, along their directors.
    pub rotary: Vector3<f64>,
}

/// How the rod moves, in the directors of its base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swaying {
    /// Rate of the base wrench, in B/L and B/L^2 per time.
    pub rate: Wrench,
    /// Angular velocity of the base.
    pub spin: Vector3<f64>,
    /// Acceleration of gravity.
    pub gravity: Vector3<f64>,
}

/// The inertia of a rod in (Omega, V, b'): angular velocity and velocity of its base in the directors there, and the rate of the
/// base wrench in B/L and B/L^2.
#[derive(Debug, Clone, PartialEq)]
pub struct Generalized {
    /// int Lambda^T I Lambda, symmetric: twice the kinetic energy is its quadratic form.
    pub matrix: SMatrix<f64, 12, 12>,
    /// int Lambda^T (inertia - weight) while (Omega, V, b') do not change along the directors of the base, the frame turning
    /// with Omega but for V, whose acceleration is that of the base itself.
    pub force: SVector<f64, 12>,
    /// Where the centre of mass is, seen from the base.
    pub centre: Vector3<f64>,
    /// (omega_t, r_tt) of the end at b'' = 0, seen from the base.
    pub second: Vector6<f64>,
    /// The second derivative of the couple m(1) there.
    pub couple: Vector3<f64>,
    /// (omega, r_t) of the end.
    pub first: Vector6<f64>,
}

/// What is integrated along the rod, in units of the rod.
#[derive(Debug, Clone, Copy)]
struct Along {
    line: LineState<6>,
    /// (omega_t, r_tt).
    second: Vector6<f64>,
    /// int T^T I T, and int [1, r x; 0, 1] I T.
    own: Matrix6<f64>,
    mixed: Matrix6<f64>,
    /// int r, int r r^T, int R I R^T.
    first: Vector3<f64>,
    square: Matrix3<f64>,
    rotary: Matrix3<f64>,
    /// int [1, r x; 0, 1] f and int T^T f of inertia less weight.
    base: Vector6<f64>,
    chart: Vector6<f64>,
}

impl State for Along {
    fn axpy(&mut self, a: f64, x: &Self) {
        self.line.axpy(a, &x.line);
        self.second += x.second * a;
        self.own += x.own * a;
        self.mixed += x.mixed * a;
        self.first += x.first * a;
        self.square += x.square * a;
        self.rotary += x.rotary * a;
        self.base += x.base * a;
        self.chart += x.chart * a;
    }

    /// The worst of the shape with its tangent, the second derivative and the integrals, each by its own size.
    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        let part = |error: f64, size: f64| error / (1.0 + size).powi(2);
        let of = |error: &Vector6<f64>, size: &Vector6<f64>| {
            part(error.norm_squared() / 6.0, size.amax())
        };
        (self.line.mean_square(&from.line, &to.line))
            .max(of(&self.second, &to.second))
            .max(of(&self.base, &to.base))
            .max(of(&self.chart, &to.chart))
            .max(part(self.own.norm_squared() / 36.0, to.own.amax()))
            .max(part(self.mixed.norm_squared() / 36.0, to.mixed.amax()))
    }
}

/// The rates along the rod of all that.
struct Field<'a> {
    law: &'a ScaledLaw,
    flow: Flow<'a, 6>,
    b: &'a Wrench,
    rate: &'a Wrench,
    spin: Vector3<f64>,
    gravity: Vector3<f64>,
    rotary: Vector3<f64>,
}

impl Field<'_> {
    fn write(&mut self, at: &Along, slope: &mut Along) -> Option<()> {
        self.flow.write_slope(&at.line, &mut slope.line)?;
        let (turn, r) = (at.line.rotation(), at.line.position());
        let tau = slope.line.position();
        let tangent = Matrix6::from_fn(|i, j| at.line.tangent[i][j]);
        let half = |x: &Vector6<f64>, k: usize| x.fixed_rows::<3>(k).into_owned();
        let moved = tangent * self.rate;
        let (omega, v) = (half(&moved, 0), half(&moved, 3));
        let (omega2, r2) = (half(&at.second, 0), half(&at.second, 3));
        let (m, n) = at.line.resultants(self.b, &());
        let (m_rate, n_rate) = (half(self.rate, 0), half(self.rate, 3));
        let m_t = m_rate - v.cross(&n) - r.cross(&n_rate);
        let m_tt = -r2.cross(&n) - v.cross(&n_rate) * 2.0;
        // (R^T a)_t = R^T (a_t - omega x a), twice.
        let once = |a: &Vector3<f64>, a_t: &Vector3<f64>| turn.tr_mul(&(a_t - omega.cross(a)));
        let twice = |a: &Vector3<f64>, a_t: &Vector3<f64>, a_tt: &Vector3<f64>| {
            let turning = omega.cross(&(omega.cross(a) - a_t * 2.0));
            turn.tr_mul(&(a_tt - omega2.cross(a) + turning))
        };
        let local = joined(&turn.tr_mul(&m), &turn.tr_mul(&n));
        let response = self.law.inverse(at.line.s, &local).ok()?;
        let compliance = &*response.compliance;
        let e_t = compliance * &joined(&once(&m, &m_t), &once(&n, &n_rate));
        let e_tt = compliance
            * &joined(
                &twice(&m, &m_t, &m_tt),
                &twice(&n, &n_rate, &Vector3::zeros()),
            );
        let (u_t, v_t) = (turn * half(&e_t, 0), turn * half(&e_t, 3));
        slope.second = joined(
            &(turn * half(&e_tt, 0) + omega.cross(&u_t)),
            &(omega2.cross(&tau)
                + omega.cross(&(omega.cross(&tau) + v_t * 2.0))
                + turn * half(&e_tt, 3)),
        );
        let rotary = turn * Matrix3::from_diagonal(&self.rotary) * turn.transpose();
        let (t_omega, t_v) = (tangent.fixed_rows::<3>(0), tangent.fixed_rows::<3>(3));
        let turned = rotary * t_omega;
        slope.own = t_omega.tr_mul(&turned) + t_v.tr_mul(&t_v);
        let lever = turned + r.cross_matrix() * t_v;
        slope.mixed.fixed_rows_mut::<3>(0).copy_from(&lever);
        slope.mixed.fixed_rows_mut::<3>(3).copy_from(&t_v);
        slope.first = r;
        slope.square = r * r.transpose();
        slope.rotary = rotary;
        let whole = self.spin + omega;
        let couple = rotary * (omega2 + self.spin.cross(&omega)) + whole.cross(&(rotary * whole));
        let swung = self.spin.cross(&(self.spin.cross(&r) + v * 2.0));
        let force = r2 + swung - self.gravity;
        slope.base = joined(&(couple + r.cross(&force)), &force);
        slope.chart = t_omega.tr_mul(&couple) + t_v.tr_mul(&force);
        Some(())
    }
}

impl Rod {
    /// True if its inertia on its equilibria can be had: its section law is linear.
    pub fn sways(&self) -> bool {
        self.section.is_linear()
    }

    /// The inertia of the rod on its equilibria under the base wrench `b` in B/L and B/L^2 along the directors of the base, while it
    /// moves as `motion` says. `tolerance` is that of the integration along the rod.
    ///
    /// # Errors
    /// A section law that is not linear ([`Rod::sways`]); a wrench too large to be followed.
    pub fn generalized_inertia(
        &self,
        mass: &SectionMass,
        b: &Wrench,
        motion: &Swaying,
        tolerance: f64,
    ) -> Result<Generalized> {
        if !self.sways() {
            return Err(Error::domain(
                "the mass of a rod is followed to first order for linear section laws alone",
            ));
        }
        let length = self.length;
        let [dm, dn] = unit_columns();
        let mut field = Field {
            law: &self.law,
            flow: Flow::new(&self.law, &(), b, dm, dn),
            b,
            rate: &motion.rate,
            spin: motion.spin,
            gravity: motion.gravity / length,
            rotary: mass.rotary / (mass.mass * length),
        };
        let start = Along {
            line: LineState::clamp(),
            second: Vector6::zeros(),
            own: Matrix6::zeros(),
            mixed: Matrix6::zeros(),
            first: Vector3::zeros(),
            square: Matrix3::zeros(),
            rotary: Matrix3::zeros(),
            base: Vector6::zeros(),
            chart: Vector6::zeros(),
        };
        let first = first_step(&self.law, b, tolerance)?;
        let (end, _) = over_pieces(
            &self.law,
            start,
            |at: &mut Along| &mut at.line.s,
            (first, tolerance),
            |at, slope| field.write(at, slope),
            |_, _| (),
        )
        .map_err(|s| {
            Error::no_convergence(format!(
                "the motion of the rod cannot be followed beyond s = {s:.6} of its length: {}",
                self.law.told(b)
            ))
        })?;
        Ok(self.generalized(&end, mass.mass, b, &motion.rate))
    }

    /// The integrals in the user's units.
    fn generalized(&self, end: &Along, mass: f64, b: &Wrench, rate: &Wrench) -> Generalized {
        let length = self.length;
        let lever = end.first.cross_matrix();
        let mut matrix = SMatrix::<f64, 12, 12>::zeros();
        let mut put = |at: (usize, usize), block: &Matrix3<f64>| {
            matrix.fixed_view_mut::<3, 3>(at.0, at.1).copy_from(block);
        };
        put(
            (0, 0),
            &(end.rotary + Matrix3::identity() * end.square.trace() - end.square),
        );
        put((0, 3), &lever);
        put((3, 0), &-lever);
        put((3, 3), &Matrix3::identity());
        matrix.fixed_view_mut::<6, 6>(0, 6).copy_from(&end.mixed);
        matrix
            .fixed_view_mut::<6, 6>(6, 0)
            .copy_from(&end.mixed.transpose());
        matrix.fixed_view_mut::<6, 6>(6, 6).copy_from(&end.own);
        let mut force = SVector::<f64, 12>::zeros();
        force.fixed_rows_mut::<6>(0).copy_from(&end.base);
        force.fixed_rows_mut::<6>(6).copy_from(&end.chart);
        // In lengths L; V is in the user's.
        matrix *= mass * length * length;
        force *= mass * length * length;
        for i in 3..6 {
            matrix.row_mut(i).scale_mut(1.0 / length);
            matrix.column_mut(i).scale_mut(1.0 / length);
            force[i] /= length;
        }
        let tangent = Matrix6::from_fn(|i, j| end.line.tangent[i][j]);
        let scaled = |twist: Vector6<f64>| {
            let mut twist = twist;
            twist.fixed_rows_mut::<3>(3).scale_mut(length);
            twist
        };
        let moved = tangent * rate;
        let half = |x: &Vector6<f64>| x.fixed_rows::<3>(3).into_owned();
        let couple = -half(&end.second).cross(&half(b)) - half(&moved).cross(&half(rate)) * 2.0;
        Generalized {
            matrix,
            force,
            centre: end.first * length,
            second: scaled(end.second),
            couple: couple * self.units().0,
            first: scaled(moved),
        }
    }
}
