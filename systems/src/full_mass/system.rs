//! Differential equations of a rod with mass, for explicit and implicit steps.
//!
//! State: strains q, their rates w, the dashpots z of Maxwell branches. Time, energy lost to friction, work of the
//! loads without potential and loss to drag follow. Last come the second derivatives a of the strains, which implicit
//! steps keep as unknowns:
//! ```text
//! q' = w,   w' = a,   0 = G(q, w, a, t),         G = M(q) a + ...
//! ```
//! Passes along the rod evaluate the balance G. Only the matrix of Newton's iteration needs M:
//! sigma^2 M + sigma dG/dw + dG/dq. The stiff parts in it (rates k^2/sqrt(eps), friction k^4/eps at mode k) are of the
//! size of the stiffness of the rod. Explicit steps solve for a by Cholesky factors of M.

use super::maxwell_nodes::Memory;
use super::rod::{Derivatives, HeavyRod, RodState};
use crate::solve::lu::Lu;
use crate::solve::system::{Factor, Linearised, Scalar, System};
use nalgebra::{DMatrix, DVector};

/// Number of integrals over time in a state: time itself, energy dissipated, work, loss to drag.
pub const INTEGRALS: usize = 4;

impl HeavyRod {
    /// Index of time in a state; dissipated energy, work and loss to drag follow.
    pub fn time(&self) -> usize {
        2 * self.size() + self.memory.numbers()
    }

    /// State at time 0 of these coordinates and rates, with unloaded Maxwell branches.
    pub fn state(&self, q: &[f64], w: &[f64]) -> DVector<f64> {
        let m = self.size();
        let mut y = DVector::zeros(self.time() + INTEGRALS + m);
        y.as_mut_slice()[..m].copy_from_slice(q);
        y.as_mut_slice()[m..2 * m].copy_from_slice(w);
        y.as_mut_slice()[2 * m..self.time()].copy_from_slice(&self.memory.relaxed(q));
        y
    }

    /// Evaluates the strains and velocities of a state.
    pub fn at(&self, y: &DVector<f64>) -> Option<RodState> {
        let m = self.size();
        let (q, w) = (&y.as_slice()[..m], &y.as_slice()[m..2 * m]);
        Some(self.remembering(self.moving(q, w)?, q, &y.as_slice()[2 * m..self.time()]))
    }

    /// Second derivatives of the strains that balance a state.
    pub fn accelerations(&self, t: f64, at: &RodState) -> Option<DVector<f64>> {
        let none = vec![0.0; self.size()];
        let rest = self.balance(t, at, &none)?.residual;
        let (mass, _) = self.mass_matrix(t, at)?;
        Some(-mass.cholesky()?.solve(&rest))
    }

    fn second<'y>(&self, y: &'y DVector<f64>) -> &'y [f64] {
        &y.as_slice()[self.time() + INTEGRALS..]
    }
}

impl System for HeavyRod {
    type Linearised = HeavyLinear;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let at = self.at(y)?;
        let a = self.accelerations(y[self.time()], &at)?;
        self.write(y, &at, a.as_slice(), out)?;
        out.rows_mut(self.time() + INTEGRALS, self.size()).fill(0.0);
        Some(())
    }

    fn algebraic(&self) -> usize {
        self.size()
    }

    fn balance(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let at = self.at(y)?;
        self.write(y, &at, self.second(y), out)
    }

    fn settle(&self, y: &mut DVector<f64>) -> Option<()> {
        let at = self.at(y)?;
        let a = self.accelerations(y[self.time()], &at)?;
        let first = self.time() + INTEGRALS;
        y.rows_mut(first, self.size()).copy_from(&a);
        Some(())
    }

    fn linearised(&self, y: &DVector<f64>) -> Option<HeavyLinear> {
        let at = self.at(y)?;
        let t = y[self.time()];
        let a = self.accelerations(t, &at)?;
        let balance = HeavyRod::balance(self, t, &at, a.as_slice())?;
        let derivatives = self.derivatives(t, &at, &balance)?;
        Some(HeavyLinear {
            derivatives,
            memory: self.memory.clone(),
        })
    }

    /// Error norm: strains in the mean over the rod relative to 1 + their size; rates likewise; energies.
    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64 {
        let part = |i: usize| (error[i] / (1.0 + from[i].abs().max(to[i].abs()))).powi(2);
        let (m, count) = (self.size(), self.given.law.active().len());
        let mut sum = 0.0;
        for (node, weight) in self.sections.grid.weights().iter().enumerate() {
            for i in node * count..(node + 1) * count {
                sum += weight * (part(i) + part(m + i)) / count as f64;
            }
        }
        let time = self.time();
        sum += self.memory.mean_square(|i| part(2 * m + i));
        sum += (time + 1..time + INTEGRALS).map(part).sum::<f64>();
        sum / 3.0
    }
}

impl HeavyRod {
    /// Writes the rates of all components of a state, and the balance at the indices of the second derivatives.
    fn write(
        &self,
        y: &DVector<f64>,
        at: &RodState,
        a: &[f64],
        out: &mut DVector<f64>,
    ) -> Option<()> {
        let (m, time) = (self.size(), self.time());
        let balance = HeavyRod::balance(self, y[time], at, a)?;
        let slots = out.as_mut_slice();
        slots[..m].copy_from_slice(&y.as_slice()[m..2 * m]);
        slots[m..2 * m].copy_from_slice(a);
        let (q, z) = (&y.as_slice()[..m], &y.as_slice()[2 * m..time]);
        self.memory.rates(q, z, &mut slots[2 * m..time]);
        slots[time] = 1.0;
        slots[time + 1..time + INTEGRALS].copy_from_slice(&balance.powers);
        slots[time + INTEGRALS..].copy_from_slice(balance.residual.as_slice());
        slots.iter().all(|x| x.is_finite()).then_some(())
    }
}

/// Jacobian of a rod with mass.
#[derive(Debug, Clone)]
pub struct HeavyLinear {
    derivatives: Derivatives,
    memory: Memory,
}

/// LU factors of sigma^2 M + sigma dG/dw + dG/dq.
#[derive(Debug)]
pub struct HeavyFactor<T> {
    derivatives: Derivatives,
    memory: Memory,
    sigma: T,
    lu: Lu,
    scale: Vec<f64>,
}

impl Linearised for HeavyLinear {
    type Factor<T: Scalar> = HeavyFactor<T>;

    fn shifted<T: Scalar>(&self, sigma: T) -> Option<HeavyFactor<T>> {
        let d = &self.derivatives;
        let m = d.mass.nrows();
        let real = T::from_real;
        let square = sigma * sigma;
        let mut matrix = DMatrix::from_fn(m, m, |i, j| {
            square * real(d.mass[(i, j)])
                + sigma * real(d.by_rate[(i, j)])
                + real(d.by_strain[(i, j)])
        });
        self.memory.stiffen(sigma, &mut matrix);
        // Rows and columns are scaled to a diagonal of size 1, since weights of nodes and stiffnesses of strains
        // differ in size.
        let scale: Vec<f64> = (0..m)
            .map(|i| 1.0 / matrix[(i, i)].modulus().sqrt())
            .collect();
        if !scale.iter().all(|x| x.is_finite()) {
            return None;
        }
        for j in 0..m {
            for i in 0..m {
                matrix[(i, j)] *= real(scale[i] * scale[j]);
            }
        }
        Some(HeavyFactor {
            derivatives: d.clone(),
            memory: self.memory.clone(),
            sigma,
            lu: Lu::new(&matrix)?,
            scale,
        })
    }

    /// Product for (q, w, z) alone; the second derivatives are dependent.
    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        let d = &self.derivatives;
        let m = d.mass.nrows();
        let mut out = DVector::zeros(x.len());
        let (q, w) = (x.rows(0, m), x.rows(m, m));
        out.rows_mut(0, m).copy_from(&w);
        let mut push = &d.by_strain * q + &d.by_rate * w;
        let (q, z) = (
            q.as_slice(),
            &x.as_slice()[2 * m..2 * m + self.memory.numbers()],
        );
        self.memory.push(q, z, push.as_mut_slice());
        let moved = &mut out.as_mut_slice()[2 * m..2 * m + z.len()];
        self.memory.rates(q, z, moved);
        match d.mass.clone().cholesky() {
            Some(factors) => out.rows_mut(m, m).copy_from(&-factors.solve(&push)),
            None => out.fill(f64::INFINITY),
        }
        out
    }
}

impl<T: Scalar> Factor<T> for HeavyFactor<T> {
    /// With b_a on the right of the balance, eliminating dq = (dw + b_q)/sigma and da = sigma dw - b_w leaves:
    /// (sigma^2 M + sigma G_w + G_q) dw/sigma = -b_a - G_q b_q/sigma + M b_w. Maxwell branches add to this
    /// (`memory`).
    ///
    /// A solution for dq would lose digits of dw: the smallest eigenvalues of M are near rounding, and b_q dominates.
    fn solve(&self, b: &mut DVector<T>) -> bool {
        let d = &self.derivatives;
        let m = d.mass.nrows();
        let real = T::from_real;
        let (q, w) = (b.rows(0, m).into_owned(), b.rows(m, m).into_owned());
        let over = T::one() / self.sigma;
        let mut right = DVector::<T>::zeros(m);
        for j in 0..m {
            let (x, y) = (-q[j] * over, w[j]);
            for i in 0..m {
                right[i] += x * real(d.by_strain[(i, j)]) + y * real(d.mass[(i, j)]);
            }
        }
        let time = 2 * m + self.memory.numbers();
        let first = time + INTEGRALS;
        let dashpots = &b.as_slice()[2 * m..time];
        let springs = (q.as_slice(), dashpots);
        self.memory
            .eliminate(self.sigma, springs, right.as_mut_slice());
        for i in 0..m {
            right[i] = (right[i] - b[first + i]) * real(self.scale[i]);
        }
        if !self.lu.solve(&mut right) {
            return false;
        }
        for i in 0..m {
            let dw = right[i] * real(self.scale[i]) * self.sigma;
            b[i] = (dw + q[i]) * over;
            b[m + i] = dw;
            b[first + i] = dw * self.sigma - w[i];
        }
        let moved = b.rows(0, m).into_owned();
        let dashpots = &mut b.as_mut_slice()[2 * m..time];
        self.memory.follow(self.sigma, &moved, dashpots);
        for i in time..first {
            b[i] /= self.sigma;
        }
        b.iter().all(|x| x.is_finite())
    }
}
