//! Dead loads along a rod: its weight, or any force per length (theory 3.8).
//!
//! With f the force per unloaded length, n' = -f and m' = -r' x n give
//!
//! ```text
//! n(s) = n(0) - int_0^s f,   m(s) = m(0) - r x n(s) - w(s),   w' = r x f,   w(0) = 0.
//! ```
//!
//! n(s) is known beforehand; w is carried along the rod, and in the tangent dw' = rho x f. A rod without load carries `()`,
//! which is nothing: its integration is the same to the last bit as if there were no loads along rods.

use super::Rod;
use crate::error::{Error, Result};
use nalgebra::{Rotation3, Vector3};

/// A dead load along a rod: force per unloaded length in the world, a polynomial in s/L.
#[derive(Debug, Clone, PartialEq)]
pub struct Distributed {
    coefficients: Vec<Vector3<f64>>,
}

impl Distributed {
    /// The same all along the rod, such as the weight of a uniform one.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn constant(force: Vector3<f64>) -> Result<Self> {
        Self::polynomial(vec![force])
    }

    /// f = c_0 + c_1 x + c_2 x^2 + ..., x = s/L, the base at 0.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn polynomial(coefficients: Vec<Vector3<f64>>) -> Result<Self> {
        if !coefficients.iter().flatten().all(|x| x.is_finite()) {
            return Err(Error::domain(
                "the components of a load along the rod must be finite",
            ));
        }
        Ok(Self { coefficients })
    }

    /// The whole force on a rod of this length.
    pub fn total(&self, length: f64) -> Vector3<f64> {
        gathered(&self.coefficients, 1.0) * length
    }
}

/// sum c_k s^k.
fn density(coefficients: &[Vector3<f64>], s: f64) -> Vector3<f64> {
    let rest = coefficients.iter().rev();
    rest.fold(Vector3::zeros(), |sum, c| sum * s + c)
}

/// Its integral from 0 to s.
fn gathered(coefficients: &[Vector3<f64>], s: f64) -> Vector3<f64> {
    let rest = coefficients.iter().enumerate().rev();
    s * rest.fold(Vector3::zeros(), |sum, (k, c)| sum * s + c / (k + 1) as f64)
}

/// The load in the clamp's frame and the numerics' units: B/L^3.
#[derive(Debug, Clone)]
pub(super) struct Weight {
    coefficients: Vec<Vector3<f64>>,
    /// Potential in the world of a rod that shrinks to its clamp, in B/L.
    ground: f64,
}

impl Weight {
    pub(super) fn new(load: &Distributed, rod: &Rod) -> Self {
        let (couple, force) = rod.units();
        let turn = rod.clamp.rotation.inverse();
        let scale = rod.length / force;
        let ground = -load.total(rod.length).dot(&rod.clamp.translation.vector) / couple;
        Self {
            coefficients: load.coefficients.iter().map(|c| turn * c * scale).collect(),
            ground,
        }
    }

    /// A part of it.
    pub(super) fn times(&self, part: f64) -> Self {
        Self {
            coefficients: self.coefficients.iter().map(|c| c * part).collect(),
            ground: self.ground * part,
        }
    }

    /// Turned about the clamp.
    pub(super) fn turned(&self, turn: &Rotation3<f64>) -> Self {
        Self {
            coefficients: self.coefficients.iter().map(|c| turn * c).collect(),
            ground: self.ground,
        }
    }

    /// Vectors that span its directions.
    pub(super) fn directions(&self) -> &[Vector3<f64>] {
        &self.coefficients
    }

    /// int_0^s f.
    #[inline]
    pub(super) fn gathered(&self, s: f64) -> Vector3<f64> {
        gathered(&self.coefficients, s)
    }

    /// f(s).
    #[inline]
    pub(super) fn density(&self, s: f64) -> Vector3<f64> {
        density(&self.coefficients, s)
    }

    /// f all along the rod.
    pub(super) fn total(&self) -> Vector3<f64> {
        self.gathered(1.0)
    }

    /// The mean of sqrt|n| along the rod whose end bears `force`: the logarithm of how much an error at the clamp grows under a
    /// pull, for a compliance of 1.
    pub(super) fn mean_root(&self, force: &Vector3<f64>) -> f64 {
        const PARTS: usize = 64;
        let whole = force + self.total();
        let at = |k: usize| {
            let s = (k as f64 + 0.5) / PARTS as f64;
            (whole - self.gathered(s)).norm().sqrt()
        };
        (0..PARTS).map(at).sum::<f64>() / PARTS as f64
    }

    /// The potential of the load: `work` is int f.r ds, in B/L.
    pub(super) fn potential(&self, work: f64) -> f64 {
        self.ground - work
    }
}

/// What a rod carries along beside frame and centreline.
pub(super) trait Carried<const K: usize>: Copy + std::fmt::Debug {
    /// The load that it comes from.
    type Load;
    /// At the clamp.
    const NOTHING: Self;
    /// self += a x.
    fn axpy(&mut self, a: f64, x: &Self);
    /// Adds the errors of the shape, and of the tangent, squared and relative to the size between `from` and `to`.
    fn add_errors(&self, from: &Self, to: &Self, shape: &mut f64, tangent: &mut f64);
    /// n(s).
    fn force(load: &Self::Load, base: &[f64; 3], s: f64) -> [f64; 3];
    /// Takes w from m.
    fn take_couple(&self, m: &mut [f64; 3]);
    /// Takes dw from dm, by columns.
    fn take_columns(&self, dm: &mut [[f64; K]; 3]);
    /// Along the rod, at s, r and rho.
    fn slope(load: &Self::Load, s: f64, r: &[f64; 3], rho: &[[f64; K]; 3]) -> Self;
    /// The columns of the tangent.
    fn columns(&mut self) -> &mut [[f64; K]];
    /// int f.r ds from the clamp to here.
    fn work(&self) -> f64;
}

impl<const K: usize> Carried<K> for () {
    type Load = ();
    const NOTHING: Self = ();

    #[inline(always)]
    fn axpy(&mut self, _: f64, (): &Self) {}

    #[inline(always)]
    fn add_errors(&self, (): &Self, (): &Self, _: &mut f64, _: &mut f64) {}

    #[inline(always)]
    fn force((): &(), base: &[f64; 3], _: f64) -> [f64; 3] {
        *base
    }

    #[inline(always)]
    fn take_couple(&self, _: &mut [f64; 3]) {}

    #[inline(always)]
    fn take_columns(&self, _: &mut [[f64; K]; 3]) {}

    #[inline(always)]
    fn slope((): &(), _: f64, _: &[f64; 3], _: &[[f64; K]; 3]) -> Self {}

    #[inline(always)]
    fn columns(&mut self) -> &mut [[f64; K]] {
        &mut []
    }

    fn work(&self) -> f64 {
        0.0
    }
}

/// w with its tangent, and the work of the load.
#[derive(Debug, Clone, Copy)]
pub(super) struct Heavy<const K: usize> {
    w: [f64; 3],
    dw: [[f64; K]; 3],
    work: f64,
}

impl<const K: usize> Carried<K> for Heavy<K> {
    type Load = Weight;
    const NOTHING: Self = Self {
        w: [0.0; 3],
        dw: [[0.0; K]; 3],
        work: 0.0,
    };

    #[inline]
    fn axpy(&mut self, a: f64, x: &Self) {
        self.work += a * x.work;
        for i in 0..3 {
            self.w[i] += a * x.w[i];
            for j in 0..K {
                self.dw[i][j] += a * x.dw[i][j];
            }
        }
    }

    #[inline]
    fn add_errors(&self, from: &Self, to: &Self, shape: &mut f64, tangent: &mut f64) {
        let size = |w: &[f64; 3]| w.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
        let scale = size(&from.w).max(size(&to.w));
        *shape += (self.work / (1.0 + to.work.abs())).powi(2);
        for i in 0..3 {
            *shape += (self.w[i] / scale).powi(2);
            for j in 0..K {
                let scale = 1.0 + from.dw[i][j].abs().max(to.dw[i][j].abs());
                *tangent += (self.dw[i][j] / scale).powi(2);
            }
        }
    }

    #[inline]
    fn force(load: &Weight, base: &[f64; 3], s: f64) -> [f64; 3] {
        let gone = load.gathered(s);
        [base[0] - gone.x, base[1] - gone.y, base[2] - gone.z]
    }

    #[inline]
    fn take_couple(&self, m: &mut [f64; 3]) {
        for (m, w) in m.iter_mut().zip(&self.w) {
            *m -= w;
        }
    }

    #[inline]
    fn take_columns(&self, dm: &mut [[f64; K]; 3]) {
        for (row, taken) in dm.iter_mut().zip(&self.dw) {
            for (m, w) in row.iter_mut().zip(taken) {
                *m -= w;
            }
        }
    }

    #[inline]
    fn slope(load: &Weight, s: f64, r: &[f64; 3], rho: &[[f64; K]; 3]) -> Self {
        let f = load.density(s);
        let r = Vector3::from(*r);
        let mut dw = [[0.0; K]; 3];
        for j in 0..K {
            dw[0][j] = rho[1][j] * f.z - rho[2][j] * f.y;
            dw[1][j] = rho[2][j] * f.x - rho[0][j] * f.z;
            dw[2][j] = rho[0][j] * f.y - rho[1][j] * f.x;
        }
        Self {
            w: r.cross(&f).into(),
            dw,
            work: f.dot(&r),
        }
    }

    fn columns(&mut self) -> &mut [[f64; K]] {
        &mut self.dw
    }

    fn work(&self) -> f64 {
        self.work
    }
}
