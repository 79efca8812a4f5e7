//! The inertia of a rod that stays on its equilibria while base and base wrench change (theory 3.9).
//!
//! Seen from a frame that moves with the base and does not turn, the section s is at r(s), R(s). While the base wrench b changes at the
//! rate b' and the base turns with Omega, the section turns and moves by (omega, v) = T(s) (b', Omega), T the tangent of the
//! initial-value problem; while b' and Omega do not change, these change by (omega_t, r_tt):
//!
//! ```text
//! omega' = R u_t,                          v' = omega x tau + R v_t,                                         tau = r'
//! omega_t' = R u_tt + omega x R u_t,       r_tt' = omega_t x tau + omega x (omega x tau) + 2 omega x R v_t + R v_tt
//! (u, v)_t = C w_t,   (u, v)_tt = C w_tt,  w = (R^T m, R^T n),   m = m(0) - r x n - w
//! ```
//!
//! The law is linear, C does not depend on w; a load along the rod is dead and does not turn along. With the velocity V of the base a
//! section has the twist Lambda (V, b', Omega), Lambda = [0, T_omega; 1, T_v]; d'Alembert's principle asks for int Lambda^T inertia.
//! All integrals are carried along the rod with its shape, T and the second derivative, by one integration.

use super::line::{Flow, LineState, Wrench, begun, first_step, over_pieces};
use super::weight::{Carried, Heavy, Weight};
use super::{Distributed, Rod};
use crate::error::{Error, Result};
use crate::math::se3::joined;
use crate::solve::dop853::State;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector6};

/// What the sections of a rod weigh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionMass {
    /// Mass of the whole rod, the same per unloaded length everywhere.
    pub mass: f64,
    /// Inertia of the sections per length about their middle, along their directors.
    pub rotary: Vector3<f64>,
}

/// How the rod moves, along the directors of its base as they are now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swaying {
    /// Rate of the base wrench in the world, in B/L and B/L^2 per time.
    pub rate: Wrench,
    /// Angular velocity of the base.
    pub spin: Vector3<f64>,
}

/// The inertia of a rod in (V, b', Omega): velocity of its base, rate of the base wrench in the world, in B/L and B/L^2, and angular
/// velocity of the base, all along the directors of the base as they are now.
#[derive(Debug, Clone, PartialEq)]
pub struct Generalized {
    /// int Lambda^T I Lambda, symmetric: twice the kinetic energy is its quadratic form.
    pub matrix: SMatrix<f64, 12, 12>,
    /// int Lambda^T (inertia) while V, b' and Omega do not change.
    pub force: SVector<f64, 12>,
    /// Where the centre of mass is, seen from the base.
    pub centre: Vector3<f64>,
    /// The angular momentum about the base while that has no velocity.
    pub momentum: Vector3<f64>,
    /// (omega_t, r_tt) of the end while V, b' and Omega do not change.
    pub second: Vector6<f64>,
    /// The second derivative of the couple m(1) there.
    pub couple: Vector3<f64>,
}

/// What is integrated along the rod, in its units.
#[derive(Debug, Clone, Copy)]
struct Along {
    line: LineState<9, Heavy<9>>,
    /// (omega_t, r_tt), and w_tt of the load.
    second: Vector6<f64>,
    taken: Vector3<f64>,
    /// int T^T I T, and int T_v.
    own: SMatrix<f64, 9, 9>,
    mixed: SMatrix<f64, 3, 9>,
    /// int r; the angular momentum.
    first: Vector3<f64>,
    momentum: Vector3<f64>,
    /// int r_tt, and int T^T of the inertia.
    base: Vector3<f64>,
    chart: SVector<f64, 9>,
}

impl State for Along {
    fn axpy(&mut self, a: f64, x: &Self) {
        self.line.axpy(a, &x.line);
        self.second += x.second * a;
        self.taken += x.taken * a;
        self.own += x.own * a;
        self.mixed += x.mixed * a;
        self.first += x.first * a;
        self.momentum += x.momentum * a;
        self.base += x.base * a;
        self.chart += x.chart * a;
    }

    /// The worst of the shape with its tangent, the second derivative and the integrals, each by its own size.
    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        fn part(error: &[f64], size: &[f64]) -> f64 {
            let size = size.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
            let sum: f64 = error.iter().map(|e| e * e).sum();
            sum / (error.len() as f64 * size * size)
        }
        (self.line.mean_square(&from.line, &to.line))
            .max(part(self.second.as_slice(), to.second.as_slice()))
            .max(part(self.chart.as_slice(), to.chart.as_slice()))
            .max(part(self.own.as_slice(), to.own.as_slice()))
    }
}

/// The rates along the rod of all that.
struct Field<'a> {
    flow: Flow<'a, 9, Heavy<9>>,
    rod: &'a Rod,
    load: &'a Weight,
    b: &'a Wrench,
    /// (b', Omega).
    rates: SVector<f64, 9>,
    rotary: Vector3<f64>,
}

fn half(x: &Vector6<f64>, row: usize) -> Vector3<f64> {
    x.fixed_rows::<3>(row).into_owned()
}

impl Field<'_> {
    /// (omega, v), and (m_t, n_t, m_tt) at a section.
    fn rates_at(&self, at: &Along) -> ([Vector3<f64>; 2], [Vector3<f64>; 3]) {
        let tangent = SMatrix::<f64, 6, 9>::from_fn(|i, j| at.line.tangent[i][j]);
        let moved: Vector6<f64> = tangent * self.rates;
        let (omega, v) = (half(&moved, 0), half(&moved, 3));
        let mut taken = [[0.0; 9]; 3];
        at.line.carried.take_columns(&mut taken);
        let taken = SMatrix::<f64, 3, 9>::from_fn(|i, j| taken[i][j]);
        let (_, n) = at.line.resultants(self.b, self.load);
        let m_rate = self.rates.fixed_rows::<3>(0);
        let n_rate = self.rates.fixed_rows::<3>(3).into_owned();
        let r = at.line.position();
        let m_t = m_rate + taken * self.rates - v.cross(&n) - r.cross(&n_rate);
        let r_tt = half(&at.second, 3);
        let m_tt = -r_tt.cross(&n) - v.cross(&n_rate) * 2.0 - at.taken;
        ([omega, v], [m_t, n_rate, m_tt])
    }

    fn write(&mut self, at: &Along, slope: &mut Along) -> Option<()> {
        self.flow.write_slope(&at.line, &mut slope.line)?;
        let (turn, r) = (at.line.rotation(), at.line.position());
        let tau = slope.line.position();
        let ([omega, v], [m_t, n_t, m_tt]) = self.rates_at(at);
        let (omega_t, r_tt) = (half(&at.second, 0), half(&at.second, 3));
        let (m, n) = at.line.resultants(self.b, self.load);
        // (R^T a)_t = R^T (a_t - omega x a), twice.
        let once = |a: &Vector3<f64>, a_t: &Vector3<f64>| turn.tr_mul(&(a_t - omega.cross(a)));
        let twice = |a: &Vector3<f64>, a_t: &Vector3<f64>, a_tt: &Vector3<f64>| {
            let turning = omega.cross(&(omega.cross(a) - a_t * 2.0));
            turn.tr_mul(&(a_tt - omega_t.cross(a) + turning))
        };
        let local = joined(&turn.tr_mul(&m), &turn.tr_mul(&n));
        let response = self.rod.law.inverse(at.line.s, &local).ok()?;
        let compliance = &*response.compliance;
        let e_t = compliance * &joined(&once(&m, &m_t), &once(&n, &n_t));
        let still = Vector3::zeros();
        let e_tt = compliance * &joined(&twice(&m, &m_t, &m_tt), &twice(&n, &n_t, &still));
        let (u_t, v_t) = (turn * half(&e_t, 0), turn * half(&e_t, 3));
        slope.second = joined(
            &(turn * half(&e_tt, 0) + omega.cross(&u_t)),
            &(omega_t.cross(&tau)
                + omega.cross(&(omega.cross(&tau) + v_t * 2.0))
                + turn * half(&e_tt, 3)),
        );
        slope.taken = r_tt.cross(&self.load.density(at.line.s));
        let tangent = SMatrix::<f64, 6, 9>::from_fn(|i, j| at.line.tangent[i][j]);
        let (t_omega, t_v) = (tangent.fixed_rows::<3>(0), tangent.fixed_rows::<3>(3));
        let rotary = turn * Matrix3::from_diagonal(&self.rotary) * turn.transpose();
        slope.own = t_omega.tr_mul(&(rotary * t_omega)) + t_v.tr_mul(&t_v);
        slope.mixed.copy_from(&t_v);
        slope.first = r;
        let spun = rotary * omega;
        slope.momentum = spun + r.cross(&v);
        slope.base = r_tt;
        slope.chart = t_omega.tr_mul(&(rotary * omega_t + omega.cross(&spun))) + t_v.tr_mul(&r_tt);
        Some(())
    }
}

impl Rod {
    /// True if its inertia on its equilibria can be had: its section law is linear.
    pub fn sways(&self) -> bool {
        self.section.is_linear()
    }

    /// The inertia of the rod on its equilibria under the base wrench `b` in B/L and B/L^2, and a dead load along it, along the directors of the
    /// base, while it moves as `motion` says. `tolerance` is that of the integration along the rod. The clamp is not used.
    ///
    /// # Errors
    /// A section law that is not linear ([`Rod::sways`]); a wrench too large to be followed.
    pub fn generalized_inertia(
        &self,
        mass: &SectionMass,
        (b, load): (&Wrench, Option<&Distributed>),
        motion: &Swaying,
        tolerance: f64,
    ) -> Result<Generalized> {
        if !self.sways() {
            return Err(Error::domain(
                "the mass of a rod is followed to first order for linear section laws alone",
            ));
        }
        let rod = match load {
            None => self.clone(),
            Some(load) => Self {
                law: self.law.clone().broken_at(&load.breaks()),
                ..self.clone()
            },
        };
        let weight = load.map_or_else(Weight::nothing, |load| Weight::new(load, &rod));
        let (clamp, [dm, dn]) = begun();
        let mut rates = SVector::<f64, 9>::zeros();
        rates.fixed_rows_mut::<6>(0).copy_from(&motion.rate);
        rates.fixed_rows_mut::<3>(6).copy_from(&motion.spin);
        let mut field = Field {
            flow: Flow::new(&rod.law, &weight, b, dm, dn),
            rod: &rod,
            load: &weight,
            b,
            rates,
            rotary: mass.rotary / (mass.mass * self.length),
        };
        let start = Along {
            line: clamp,
            second: Vector6::zeros(),
            taken: Vector3::zeros(),
            own: SMatrix::zeros(),
            mixed: SMatrix::zeros(),
            first: Vector3::zeros(),
            momentum: Vector3::zeros(),
            base: Vector3::zeros(),
            chart: SVector::zeros(),
        };
        let first = first_step(&rod.law, b, tolerance)?;
        let (end, _) = over_pieces(
            &rod.law,
            start,
            |at: &mut Along| &mut at.line.s,
            (first, tolerance),
            |at, slope| field.write(at, slope),
            |_, _| (),
        )
        .map_err(|s| {
            Error::no_convergence(format!(
                "the motion of the rod cannot be followed beyond s = {s:.6} of its length: {}",
                rod.law.told(b)
            ))
        })?;
        let couple = field.rates_at(&end).1[2];
        Ok(self.generalized(&end, mass.mass, couple))
    }

    /// The integrals in the user's units; `couple` is m(1)_tt.
    fn generalized(&self, end: &Along, mass: f64, couple: Vector3<f64>) -> Generalized {
        let length = self.length;
        let mut matrix = SMatrix::<f64, 12, 12>::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(1.0);
        matrix.fixed_view_mut::<3, 9>(0, 3).copy_from(&end.mixed);
        matrix
            .fixed_view_mut::<9, 3>(3, 0)
            .copy_from(&end.mixed.transpose());
        matrix.fixed_view_mut::<9, 9>(3, 3).copy_from(&end.own);
        let mut force = SVector::<f64, 12>::zeros();
        force.fixed_rows_mut::<3>(0).copy_from(&end.base);
        force.fixed_rows_mut::<9>(3).copy_from(&end.chart);
        // In lengths L; V is in the user's.
        let unit = mass * length * length;
        matrix *= unit;
        force *= unit;
        for i in 0..3 {
            matrix.row_mut(i).scale_mut(1.0 / length);
            matrix.column_mut(i).scale_mut(1.0 / length);
            force[i] /= length;
        }
        let mut second = end.second;
        second.fixed_rows_mut::<3>(3).scale_mut(length);
        Generalized {
            matrix,
            force,
            centre: end.first * length,
            momentum: end.momentum * unit,
            second,
            couple: couple * self.units().0,
        }
    }
}
