//! A nonlinear law in which total compression costs infinite energy: AMV (2.7), (2.26).
//!
//! With half-widths h1, h2 of the section along d1 and d2 the fibres of an elliptic section keep their orientation if
//! the strains lie in the cone
//! ```text
//! v3 > V,   V^2 = h2^2 u1^2 + h1^2 u2^2      (the fibre at (x1, x2) is stretched by v3 + u1 x2 - u2 x1),
//! ```
//! which is (2.7). The stored energy is that of a linear law plus the barrier of the cone, less its tangent at rest:
//! ```text
//! W = 1/2 (e - rest).K (e - rest) + beta [phi(e) - phi(rest) - phi'(rest).(e - rest)],   phi = -log(v3^2 - V^2).
//! ```
//! phi is convex, so W is strictly convex, zero with zero slope at rest, at least quadratic far out and infinite at
//! the boundary of the cone: (2.21), (2.24), (2.26). For a straight rod the bracket is -log(v3^2 - V^2) + 2 (v3 - 1).
//! Curvature at rest does not change the cone (the strains are counted from the straight prism, whose fibres it
//! bounds) but must lie inside it, V(rest) < 1. Linearised at a straight rest the stiffness is K + beta diag(2 h2^2,
//! 2 h1^2, 0, 0, 0, 2).
//!
//! With q = v3^2 - V^2, J = diag(h2^2, h1^2, 0, 0, 0, -1): q = -e.J e, phi' = 2 J e/q, phi'' = 2 J/q + 4 (J e)(J
//! e)^T/q^2. Under large couples q is a small difference of large squares. The inverse law therefore works with rho =
//! sqrt(q) in place of v3: v3 = sqrt(rho^2 + V^2) keeps every digit, and dw/d(u, v1, v2, rho) has no squares of 1/q.
//! Newton's iteration starts from the solution of an equivalent scalar equation and only removes its rounding.

use super::newton::{LawPoint, Potential, invert};
use super::{Free, Inverse, Linear, Resultant, SectionLaw, Strain, linear};
use crate::error::{Error, Result, check_finite, check_positive};
use crate::solve::roots::chandrupatla;
use nalgebra::{Matrix3, Matrix6, Matrix6x3, Vector3, Vector6};

/// A barrier against total compression, v3 > V = sqrt(h2^2 u1^2 + h1^2 u2^2).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct BarrierTerm {
    /// Strength > 0: of an energy per length, a force; of friction, the increase of the axial viscosity of the
    /// straight unstretched rod, force times time.
    pub strength: f64,
    /// Half widths h1, h2 > 0 of the cross-section along d1 and d2.
    pub half_widths: [f64; 2],
}

impl BarrierTerm {
    pub(super) fn new(half_widths: [f64; 2], strength: f64) -> Result<Self> {
        check_positive("half_widths[0]", half_widths[0])?;
        check_positive("half_widths[1]", half_widths[1])?;
        check_positive("barrier strength", strength)?;
        Ok(Self {
            strength,
            half_widths,
        })
    }

    /// V(u1, u2): the stretch v3 at which some fibre is totally compressed.
    pub(super) fn compression_limit(&self, e: &Strain) -> f64 {
        let [h1, h2] = self.half_widths;
        (h2 * e[0]).hypot(h1 * e[1])
    }

    /// V, or an error unless v3 > V.
    pub(super) fn checked_limit(&self, e: &Strain) -> Result<f64> {
        let compressed = self.compression_limit(e);
        if !(compressed < e[5]) {
            return Err(Error::domain(format!(
                "total compression: v3 = {} must be > sqrt(h2^2 u1^2 + h1^2 u2^2) = {compressed}",
                e[5]
            )));
        }
        Ok(compressed)
    }
}

/// A linear law and the barrier against total compression (see the module's head, in short):
/// W = 1/2 (e - rest).K (e - rest) + beta times the logarithmic barrier of v3 > sqrt(h2^2 u1^2 + h1^2 u2^2).
///
/// Shear may be rigid; stretch may not, since an inextensible rod cannot be compressed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Barrier {
    base: Linear,
    term: BarrierTerm,
    /// The diagonal of J, (h2^2, h1^2, 0, 0, 0, -1), with q = -e.J e (see the module's head).
    cone: Vector6<f64>,
    /// q at rest.
    q_rest: f64,
    start: Decoupled,
}

impl Barrier {
    /// The law `base` with a barrier of `strength` beta (a force) for a section of `half_widths` h1, h2 along d1, d2.
    ///
    /// # Errors
    /// Half-widths or a strength not finite and > 0; a base that is rigid in v3, or with a rest curvature outside the
    /// cone.
    pub fn new(base: Linear, half_widths: [f64; 2], strength: f64) -> Result<Self> {
        let term = BarrierTerm::new(half_widths, strength)?;
        if base.is_rigid()[5] {
            return Err(Error::domain(
                "a law that is rigid in v3 cannot have a barrier against total compression: \
                 give an axial stiffness, or use the linear law alone",
            ));
        }
        let [h1, h2] = half_widths;
        let cone = Vector6::new(h2 * h2, h1 * h1, 0.0, 0.0, 0.0, -1.0);
        let rest = base.rest();
        let compressed = term.compression_limit(rest);
        if !(compressed < 1.0) {
            return Err(Error::domain(format!(
                "the rest curvature [{}, {}] is too large for the half-widths {half_widths:?}: \
                 sqrt(h2^2 u1^2 + h1^2 u2^2) = {compressed} must be < 1",
                rest[0], rest[1]
            )));
        }
        let q_rest = (1.0 - compressed) * (1.0 + compressed);
        let slope_at_rest = cone.component_mul(rest) * (2.0 * strength / q_rest);
        Ok(Self {
            base,
            term,
            cone,
            q_rest,
            start: Decoupled::new(&base, &cone, &slope_at_rest, strength)?,
        })
    }

    /// Residuals of the Newton iterates of the inverse law, relative to their terms: the convergence history.
    ///
    /// # Errors
    /// As [`SectionLaw::inverse`].
    pub fn convergence(&self, w: &Resultant) -> Result<Vec<f64>> {
        let mut residuals = Vec::new();
        self.invert(w, |residual| residuals.push(residual))?;
        Ok(residuals)
    }

    /// rho = sqrt(v3^2 - V^2).
    fn depth(&self, e: &Strain) -> Result<f64> {
        check_finite("the strains", e.as_slice())?;
        let compressed = self.term.checked_limit(e)?;
        Ok((e[5] - compressed).sqrt() * (e[5] + compressed).sqrt())
    }

    /// Slope of the barrier per unit of strength, 2 (J e/q - J rest/q_rest).
    fn push(&self, e: &Strain, rho: f64) -> Resultant {
        let inner = e / rho / rho - self.base.rest() / self.q_rest;
        2.0 * self.cone.component_mul(&inner)
    }

    fn energy_at(&self, e: &Strain, rho: f64) -> f64 {
        let deviation = e - self.base.rest();
        let pushed = self.cone.component_mul(&deviation);
        let root = self.q_rest.sqrt();
        let z = (rho / root - 1.0) * (rho / root + 1.0);
        let bent = deviation.dot(&pushed) / self.q_rest;
        // Two forms of the same number: near rest the terms of first order are cancelled analytically.
        let barrier = if z.abs() + bent.abs() < 0.1 {
            (z - z.ln_1p()) + bent
        } else {
            -2.0 * (rho / root).ln() - 2.0 * self.base.rest().dot(&pushed) / self.q_rest
        };
        0.5 * deviation.dot(&(self.base.stiffness() * deviation)) + self.term.strength * barrier
    }

    fn resultants_at(&self, e: &Strain, rho: f64) -> Resultant {
        self.base.stiffness() * (e - self.base.rest()) + self.term.strength * self.push(e, rho)
    }

    fn tangent_at(&self, e: &Strain, rho: f64) -> Matrix6<f64> {
        let slope = self.cone.component_mul(e) * (2.0 / rho / rho);
        let flat = Matrix6::from_diagonal(&(self.cone * (2.0 / rho / rho)));
        self.base.stiffness() + self.term.strength * (flat + slope * slope.transpose())
    }

    fn invert(&self, w: &Resultant, seen: impl FnMut(f64)) -> Result<Inverse> {
        let linear = self.base.rest() + self.base.compliance() * w;
        let start = self.start.coordinates(&linear).ok_or_else(|| {
            Error::domain(format!(
                "the resultants {} must be finite, and so must be their strains",
                crate::error::named(&crate::error::RESULTANTS, w.as_slice())
            ))
        })?;
        invert(self, start, w, seen)
    }
}

/// The inverse law as one scalar equation, from which Newton's iteration starts.
///
/// Given a = (u1, u2, v3) the other strains follow linearly. The remaining energy is 1/2 (a - m).C_a^-1 (a - m) with
/// m the strains of the linear law and C_a its compliance. A congruence a = T y makes this 1/2 |y - T^-1 m|^2 and J
/// into diag(l1, l2, -l3), l > 0. With p = 1/q and c = T^-1 m + beta T^T phi'(rest) the inverse law reads
/// ```text
/// y1 (1 + 2 beta p l1) = c1,   y2 (1 + 2 beta p l2) = c2,   y3 (1 - 2 beta p l3) = c3,   p q(y) = 1.
/// ```
/// The third gives p(y3), which is positive for y3 > max(c3, 0); then y1(y3), y2(y3). p q - 1 is negative at the
/// lower end and positive far out, and by convexity has one zero with q > 0.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Decoupled {
    /// T, from y to (u1, u2, v3).
    to_strain: Matrix3<f64>,
    from_strain: Matrix3<f64>,
    /// (l1, l2, -l3).
    cone: Vector3<f64>,
    /// beta T^T phi'(rest).
    at_rest: Vector3<f64>,
    strength: f64,
    /// d(other strains)/d(u1, u2, v3) at fixed resultants of the others.
    others: Matrix6x3<f64>,
}

/// Indices of u1, u2, v3.
const CONE: [usize; 3] = [0, 1, 5];

impl Decoupled {
    fn new(
        base: &Linear,
        cone: &Vector6<f64>,
        slope_at_rest: &Vector6<f64>,
        strength: f64,
    ) -> Result<Self> {
        let compliance = base.compliance().matrix();
        let block = Matrix3::from_fn(|i, j| compliance[(CONE[i], CONE[j])]);
        let flat = Matrix3::from_diagonal(&Vector3::from_fn(|i, _| cone[CONE[i]]));
        let build = || {
            let root = block.cholesky()?;
            let lower = root.l();
            let eigen =
                (lower.transpose() * flat * lower).try_symmetric_eigen(f64::EPSILON, 1000)?;
            let k = eigen.eigenvalues.imin();
            let (mut vectors, mut values) = (eigen.eigenvectors, eigen.eigenvalues);
            vectors.swap_columns(k, 2);
            values.swap_rows(k, 2);
            let mut to_strain = lower * vectors;
            if to_strain[(2, 2)] < 0.0 {
                to_strain.column_mut(2).neg_mut();
            }
            let from_strain = to_strain.transpose() * root.inverse();
            let across = Matrix6x3::from_fn(|i, j| {
                if CONE.contains(&i) {
                    0.0
                } else {
                    compliance[(i, CONE[j])]
                }
            });
            let fine = values[0] > 0.0 && values[1] > 0.0 && values[2] < 0.0;
            fine.then_some(Self {
                to_strain,
                from_strain,
                cone: values,
                at_rest: to_strain.transpose() * Vector3::from_fn(|i, _| slope_at_rest[CONE[i]]),
                strength,
                others: across * root.inverse(),
            })
        };
        build().ok_or_else(|| {
            Error::domain(
                "half-widths and stiffnesses are too far apart in size: to rounding the cone is flat",
            )
        })
    }

    /// (u1, u2, u3, v1, v2, rho) for the strains `linear` of the law without barrier; None if not finite.
    fn coordinates(&self, linear: &Strain) -> Option<Vector6<f64>> {
        let m = Vector3::from_fn(|i, _| linear[CONE[i]]);
        let c = self.from_strain * m + self.at_rest;
        if !c.iter().all(|x| x.is_finite()) {
            return None;
        }
        let low = c[2].max(0.0);
        // y and 2 beta p at y3 = low + gap; y3 - c3 is gap + above.
        let above = low - c[2];
        let at = |gap: f64| {
            let y3 = low + gap;
            let push = (gap + above) / (y3 * -self.cone[2]);
            let side = |k: usize| c[k] / (1.0 + push * self.cone[k]);
            (Vector3::new(side(0), side(1), y3), push)
        };
        let off = |log: f64| {
            let (y, push) = at(log.exp());
            let scale = (0.5 * push / self.strength).sqrt();
            // sqrt(p q) = 1, in factors that do not overflow.
            let out = y[2] * (-self.cone[2]).sqrt();
            let side = (y[0] * self.cone[0].sqrt()).hypot(y[1] * self.cone[1].sqrt());
            if side < out {
                let got = scale * (out - side).sqrt() * (out + side).sqrt();
                (got - 1.0) / (got + 1.0)
            } else {
                -1.0
            }
        };
        let (mut left, mut right) = (0.0, 0.0);
        while off(left) > 0.0 && left > -700.0 {
            left -= 4.0;
        }
        while off(right) < 0.0 && right < 700.0 {
            right += 4.0;
        }
        let log = chandrupatla(off, (left, off(left)), (right, off(right)), 0.0)?;
        let (y, push) = at(log.exp());
        let cone = self.to_strain * y;
        let mut x = linear + self.others * (cone - m);
        x[0] = cone[0];
        x[1] = cone[1];
        x[5] = (2.0 * self.strength / push).sqrt();
        x.iter().all(|entry| entry.is_finite()).then_some(x)
    }
}

impl Potential for Barrier {
    fn rigid(&self) -> [bool; 6] {
        self.base.is_rigid()
    }

    fn at(&self, x: &Vector6<f64>) -> Result<Option<LawPoint>> {
        let rho = x[5];
        if !(0.0 < rho) || !x.iter().all(|entry| entry.is_finite()) {
            return Ok(None);
        }
        let mut e = *x;
        e[5] = rho.hypot(self.term.compression_limit(x));
        let mut frame = Matrix6::identity();
        frame[(5, 0)] = self.cone[0] * e[0] / e[5];
        frame[(5, 1)] = self.cone[1] * e[1] / e[5];
        frame[(5, 5)] = rho / e[5];
        let at_fixed_q = self.base.stiffness()
            + Matrix6::from_diagonal(&(self.cone * (2.0 * self.term.strength / rho / rho)));
        let mut slope = at_fixed_q * frame;
        let by_rho = self.cone.component_mul(&e) * (4.0 * self.term.strength / rho / rho / rho);
        slope.set_column(5, &(slope.column(5) - by_rho));
        Ok(Some(LawPoint {
            strain: e,
            energy: self.energy_at(&e, rho),
            resultants: self.resultants_at(&e, rho),
            frame,
            slope,
        }))
    }
}

impl SectionLaw for Barrier {
    fn energy(&self, _s: f64, e: &Strain) -> Result<f64> {
        let rho = self.depth(e)?;
        linear::check_constraints(self.base.is_rigid(), self.base.rest(), e)?;
        let mut e = *e;
        for k in (0..5).filter(|k| self.base.is_rigid()[*k]) {
            e[k] = self.base.rest()[k];
        }
        Ok(self.energy_at(&e, rho))
    }

    fn resultants(&self, _s: f64, e: &Strain) -> Result<Resultant> {
        linear::check_unconstrained(self.base.is_rigid())?;
        Ok(self.resultants_at(e, self.depth(e)?))
    }

    fn tangent(&self, _s: f64, e: &Strain) -> Result<Matrix6<f64>> {
        linear::check_unconstrained(self.base.is_rigid())?;
        Ok(self.tangent_at(e, self.depth(e)?))
    }

    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        let rho = self.depth(e)?;
        Ok(Free::new(
            self.energy(s, e)?,
            self.resultants_at(e, rho),
            self.tangent_at(e, rho),
            self.base.is_rigid(),
        ))
    }

    fn rigid(&self) -> [bool; 6] {
        self.base.is_rigid()
    }

    fn inverse(&self, _s: f64, w: &Resultant) -> Result<Inverse> {
        self.invert(w, |_| ())
    }

    fn is_uniform(&self) -> bool {
        true
    }

    fn unloaded(&self, _s: f64) -> Result<Strain> {
        Ok(*self.base.rest())
    }

    /// Unchanged by the barrier, which contains u1, u2, v3 in even powers only.
    fn planar_about(&self) -> [bool; 2] {
        self.base.planar_about()
    }
}
