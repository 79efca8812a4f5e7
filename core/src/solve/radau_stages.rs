//! Stages of Radau IIA of orders 5, 9 and 13: tableaux, collocation polynomials, and the simplified Newton iteration
//! (Hairer, Wanner: *Solving Ordinary Differential Equations II*, 2nd ed., Sec. IV.8; the same: *Stiff differential
//! equations solved by Radau methods*, J. Comput. Appl. Math. 111 (1999) 93-111).

use super::lagrange::{lagrange_from_zero, slope_of_lagrange_from_zero};
use super::radau_lines::{Advance, Residuals};
use super::radau7::NODES;
use super::system::{AnyLinearised, AnySystem, Factor};
use crate::math::registers::wide;
use nalgebra::{Complex, DMatrix, DVector};
use std::sync::OnceLock;

const SQRT6: f64 = 2.449_489_742_783_178;
/// Nodes c of the methods with three and five stages (for seven see [`super::radau7`]); the last is the end of the
/// step.
const THREE: [f64; 3] = [(4.0 - SQRT6) / 10.0, (4.0 + SQRT6) / 10.0, 1.0];
const FIVE: [f64; 5] = [
    0.057_104_196_114_517_68,
    0.276_843_013_638_123_8,
    0.583_590_432_368_916_8,
    0.860_240_135_656_219_4,
    1.0,
];

/// The order 2 s - 1 of the method with s stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// Three stages.
    Five,
    /// Five stages.
    Nine,
    /// Seven stages.
    Thirteen,
}

/// Tolerance below which order 9 is cheaper: its steps cost two to three times as much, but are fewer by more.
const FINE: f64 = 1e-8;

impl Order {
    /// The cheapest order for errors of steps of this size.
    pub(super) fn for_tolerance(tolerance: f64) -> Self {
        if tolerance <= FINE {
            Self::Nine
        } else {
            Self::Five
        }
    }

    /// The order of the method with the given number of stages.
    pub(super) fn of_stages(stages: usize) -> Self {
        match stages {
            0..5 => Self::Five,
            5..7 => Self::Nine,
            _ => Self::Thirteen,
        }
    }

    /// The tableau of the method of this order.
    pub(super) fn tableau(self) -> &'static Tableau {
        static TABLEAUX: OnceLock<[Tableau; 3]> = OnceLock::new();
        let all = TABLEAUX.get_or_init(|| [&THREE[..], &FIVE, &NODES].map(Tableau::new));
        &all[self as usize]
    }
}

/// A method of s stages: nodes c, and the matrix A of the integrals up to the nodes, as A^-1 = T Lambda T^-1. Lambda
/// has the real eigenvalue `gamma` of A^-1, then for each pair alpha +- i beta the block
/// \[alpha, -beta; beta, alpha\].
#[derive(Debug)]
pub(super) struct Tableau {
    nodes: &'static [f64],
    pub(super) gamma: f64,
    pub(super) pairs: Vec<Complex<f64>>,
    pub(super) t: DMatrix<f64>,
    pub(super) t_inverse: DMatrix<f64>,
    /// Weights of the stages z_i in the slopes at the start and at the end of the collocation polynomial, times the
    /// step.
    start: Vec<f64>,
    end: Vec<f64>,
}

impl Tableau {
    fn new(nodes: &'static [f64]) -> Self {
        // With z_i = y(c_i) - y(0), A^-1 maps the z to the slopes of the polynomial through 0 and the z.
        let s = nodes.len();
        let inverse =
            DMatrix::from_fn(s, s, |i, j| slope_of_lagrange_from_zero(nodes, j, nodes[i]));
        let mut t = DMatrix::zeros(s, s);
        let (mut gamma, mut pairs) = (0.0, Vec::new());
        let mut column = 1;
        for value in inverse.complex_eigenvalues().iter() {
            if value.im < -1e-3 {
                continue;
            }
            let (value, vector) = eigenpair(&inverse, *value);
            if value.im > 1e-3 {
                t.set_column(column, &vector.map(|x| x.re));
                t.set_column(column + 1, &vector.map(|x| -x.im));
                pairs.push(value);
                column += 2;
            } else {
                t.set_column(0, &vector.map(|x| x.re));
                gamma = value.re;
            }
        }
        // T is constant, and regular by the test below.
        let t_inverse = t.clone().try_inverse().unwrap_or_default();
        let slope = |x: f64| {
            (0..s)
                .map(|j| slope_of_lagrange_from_zero(nodes, j, x))
                .collect()
        };
        Self {
            nodes,
            gamma,
            pairs,
            t,
            t_inverse,
            start: slope(0.0),
            end: slope(1.0),
        }
    }

    /// Number of stages.
    pub(super) fn stages(&self) -> usize {
        self.nodes.len()
    }

    /// The nodes c; the last is 1.
    pub(super) fn nodes(&self) -> &'static [f64] {
        self.nodes
    }

    /// y - y0 of the collocation polynomial of the stages `z` at the fraction `x` of the step.
    pub(super) fn polynomial(&self, x: f64, z: &[DVector<f64>]) -> DVector<f64> {
        let weights = (0..self.stages()).map(|j| lagrange_from_zero(self.nodes, j, x));
        combination(weights, z)
    }

    /// Slope of the collocation polynomial at the end of a step of length `h`, where the polynomial satisfies the
    /// equations.
    pub(super) fn end_slope(&self, h: f64, z: &[DVector<f64>]) -> DVector<f64> {
        combination(self.end.iter().map(|w| w / h), z)
    }
}

/// Eigenvalue near `near` and its eigenvector, 1 at the end, by inverse iteration.
fn eigenpair(matrix: &DMatrix<f64>, near: Complex<f64>) -> (Complex<f64>, DVector<Complex<f64>>) {
    let s = matrix.nrows();
    let matrix = matrix.map(Complex::from);
    let off = near * (1.0 + 1e-7);
    let shifted = (&matrix - DMatrix::from_diagonal_element(s, s, off)).lu();
    let mut vector = DVector::from_element(s, Complex::from(1.0));
    for _ in 0..4 {
        vector = shifted.solve(&vector).unwrap_or(vector);
        vector /= vector[s - 1];
    }
    ((&matrix * &vector)[s - 1], vector)
}

/// Least error after an increment, relative to the increment: quadratures whose rows of the Jacobian are zero lag one
/// iteration behind.
const LAG: f64 = 0.05;

/// Differences z_i = y(t + c_i h) - y(t) of the stages.
pub(super) type Stages = Vec<DVector<f64>>;

/// sum_i a_i z_i.
fn combination(a: impl IntoIterator<Item = f64>, z: &[DVector<f64>]) -> DVector<f64> {
    let mut sum = DVector::zeros(z[0].len());
    combine(a, z, &mut sum);
    sum
}

fn combine(a: impl IntoIterator<Item = f64>, z: &[DVector<f64>], sum: &mut DVector<f64>) {
    sum.fill(0.0);
    for (a, z) in a.into_iter().zip(z) {
        sum.axpy(a, z, 1.0);
    }
}

/// Factorised matrices of the transformed stages for one step size.
pub(super) struct Factors {
    /// The step size.
    pub(super) h: f64,
    /// The method.
    pub(super) order: Order,
    rounding: f64,
    real: Box<dyn Factor<f64>>,
    complex: Vec<Box<dyn Factor<Complex<f64>>>>,
}

impl Factors {
    pub(super) fn new(jacobian: &dyn AnyLinearised, order: Order, h: f64) -> Option<Self> {
        let tableau = order.tableau();
        let pairs = tableau.pairs.iter();
        Some(Self {
            h,
            order,
            rounding: jacobian.rounding(h),
            real: jacobian.real(tableau.gamma / h)?,
            complex: pairs
                .map(|pair| jacobian.complex(pair / h))
                .collect::<Option<_>>()?,
        })
    }

    /// (gamma / h - J)^-1 (slope - u'), with the slope u' at the start of the collocation polynomial: the error of an
    /// embedded method of order s, damped where the system is stiff. The last `algebraic` components have no
    /// derivative.
    pub(super) fn error(
        &self,
        slope: &DVector<f64>,
        z: &[DVector<f64>],
        algebraic: usize,
    ) -> Option<DVector<f64>> {
        let weights = self.order.tableau().start.iter();
        let mut error = combination(weights.map(|w| -w / self.h), z);
        let differential = error.len() - algebraic;
        error.rows_mut(differential, algebraic).fill(0.0);
        error += slope;
        self.real.solve(&mut error).then_some(error)
    }
}

/// Outcome of a solution of the stages.
pub(super) enum Outcome {
    /// Solved.
    Solved,
    /// Convergence is too slow or absent; a step shorter by the factor may converge.
    Slow(f64),
    /// A stage left the domain of the slope in the iteration of this number, from 0.
    Outside(i32),
}

/// The simplified Newton iteration, with statistics of its convergence.
#[derive(Debug, Clone)]
pub(super) struct Newton {
    /// Bound of the remaining error of the stages.
    goal: f64,
    /// Level of rounding: smaller increments need not shrink.
    floor: f64,
    /// theta / (1 - theta) of the last solution: error after an increment by its size.
    remainder: f64,
    /// Contraction per iteration in the last solution; 0 if it took one iteration.
    pub(super) contraction: f64,
    /// Iterations of the last solution.
    pub(super) iterations: u64,
    room: StageWorkspace,
}

/// Work space of the stages, kept from one solution to the next.
#[derive(Debug, Clone)]
struct StageWorkspace {
    states: Stages,
    slopes: Stages,
    /// W = T^-1 Z, stored separately as in the book, and its increments.
    transformed: Stages,
    increments: Stages,
    /// Root mean square over the stages of the change by an increment.
    change: DVector<f64>,
    pair: DVector<Complex<f64>>,
}

impl StageWorkspace {
    /// Work space for the given number of stages of n components.
    fn new(stages: usize, n: usize) -> Self {
        let all = vec![DVector::zeros(n); stages];
        Self {
            states: all.clone(),
            slopes: all.clone(),
            transformed: all.clone(),
            increments: all,
            change: DVector::zeros(n),
            pair: DVector::zeros(n),
        }
    }
}

impl Newton {
    /// `goal` and `floor` are in units of the root of [`AnySystem::mean_square`].
    pub(super) fn new(goal: f64, floor: f64) -> Self {
        Self {
            goal,
            floor,
            remainder: 1.0,
            contraction: 0.0,
            iterations: 0,
            room: StageWorkspace::new(0, 0),
        }
    }

    /// Raises the rounding level: a sample inside an accepted step must not fail for rounding.
    pub(super) fn loosen(&mut self) {
        self.floor *= 100.0;
    }

    /// Most iterations of a solution.
    pub(super) const fn max_iterations(order: Order) -> i32 {
        match order {
            Order::Five => 8,
            Order::Nine => 13,
            Order::Thirteen => 18,
        }
    }

    /// Solves z = h A F(y + z) from the guess in `z`. Convergence is judged by increments of y, never by residuals of
    /// the slope: rounding alone may make these large in a stiff system.
    pub(super) fn solve(
        &mut self,
        system: &dyn AnySystem,
        y: &DVector<f64>,
        factors: &Factors,
        z: &mut [DVector<f64>],
        evaluations: &mut u64,
    ) -> Outcome {
        let n = y.len();
        let h = factors.h;
        let tableau = factors.order.tableau();
        let (stages, most) = (tableau.stages(), Self::max_iterations(factors.order));
        // Increments up to the tolerance, ten times the floor, may count as rounding; if rounding is larger, a
        // shorter step must reduce it.
        let floor = self.floor.max(factors.rounding.min(10.0 * self.floor));
        if self.room.pair.len() != n || self.room.states.len() != stages {
            self.room = StageWorkspace::new(stages, n);
        }
        let StageWorkspace {
            states,
            slopes,
            transformed: w,
            increments,
            change,
            pair,
        } = &mut self.room;
        let (mut last, mut last_ratio) = (0.0, 0.0);
        // From a zero guess the first iteration moves the time of the stages, and a load in time acts only from the
        // next on.
        let blind = z.iter().all(|z| z.amax() == 0.0);
        let mut first = 0;
        self.remainder = self.remainder.powf(0.8);
        self.contraction = 0.0;
        self.iterations = 0;
        let differential = n - system.algebraic();
        for i in 0..stages {
            combine(tableau.t_inverse.row(i).iter().copied(), z, &mut w[i]);
            states[i].copy_from(y);
            states[i] += &z[i];
        }
        for k in 0..most {
            *evaluations += stages as u64;
            if system.balances(states, slopes).is_none() {
                return Outcome::Outside(k);
            }
            wide(Residuals {
                tableau,
                h,
                differential,
                slopes,
                w,
                to: increments,
            });
            if !factors.real.solve(&mut increments[0]) {
                return Outcome::Slow(0.5);
            }
            for (m, factor) in factors.complex.iter().enumerate() {
                let (re, im) = (2 * m + 1, 2 * m + 2);
                let (first, second) = increments.split_at_mut(im);
                let (re, im) = (first[re].as_mut_slice(), second[0].as_mut_slice());
                for ((pair, re), im) in pair.as_mut_slice().iter_mut().zip(&*re).zip(&*im) {
                    *pair = Complex::new(*re, *im);
                }
                if !factor.solve(pair) {
                    return Outcome::Slow(0.5);
                }
                for ((pair, re), im) in pair.as_slice().iter().zip(re).zip(im) {
                    (*re, *im) = (pair.re, pair.im);
                }
            }
            wide(Advance {
                t: &tableau.t,
                increments,
                y,
                w,
                z,
                states,
                change,
            });
            self.iterations += 1;
            let size = system.increment_square(change, y, h).sqrt();
            if !size.is_finite() {
                return Outcome::Slow(0.3);
            }
            if k > first {
                let ratio = size / last;
                if size <= floor && ratio > 0.3 {
                    return Outcome::Solved;
                }
                let theta: f64 = if k == first + 1 {
                    ratio
                } else {
                    (ratio * last_ratio).sqrt()
                };
                if !(theta < 0.99) {
                    return Outcome::Slow(0.5);
                }
                // Ratios of increments at the level of rounding are meaningless.
                if size > floor || k == first + 1 {
                    self.contraction = theta;
                }
                self.remainder = (theta / (1.0 - theta)).max(LAG);
                let left = most - 1 - k;
                let excess = self.remainder * size * theta.powi(left) / self.goal;
                if excess > 1.0 && size > floor {
                    let power = -1.0 / f64::from(4 + left);
                    return Outcome::Slow(0.8 * excess.clamp(1e-4, 1e4).powf(power));
                }
                last_ratio = ratio;
            }
            if self.remainder * size <= self.goal {
                if !(blind && k == 0) {
                    return Outcome::Solved;
                }
                first = 1;
            }
            last = size;
        }
        if last <= floor {
            Outcome::Solved
        } else {
            Outcome::Slow(0.5)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a wrong digit of a node or a wrong transformation: nodes are those of Radau, P_s = P_(s-1), A
    /// integrates c^p up to each node, and T block-diagonalises A^-1.
    #[test]
    fn transformations_are_those_of_the_tableaux() {
        for (order, bound) in [
            (Order::Five, 1e-14),
            (Order::Nine, 1e-13),
            (Order::Thirteen, 1e-12),
        ] {
            let tableau = order.tableau();
            let (c, s) = (tableau.nodes, tableau.stages());
            for c in c {
                let (x, mut before, mut last) = (2.0 * c - 1.0, 1.0, 2.0 * c - 1.0);
                for n in 1..s {
                    let n = n as f64;
                    (before, last) = (last, ((2.0 * n + 1.0) * x * last - n * before) / (n + 1.0));
                }
                assert!((last - before).abs() < 1e-14, "{order:?}: {c}");
            }
            let v = DMatrix::from_fn(s, s, |i, j| c[i].powi(j as i32));
            let b = DMatrix::from_fn(s, s, |i, j| c[i].powi(j as i32 + 1) / (j + 1) as f64);
            let a = b * v.try_inverse().unwrap();
            let mut blocks = DMatrix::zeros(s, s);
            blocks[(0, 0)] = tableau.gamma;
            for (m, pair) in tableau.pairs.iter().enumerate() {
                let (i, j) = (2 * m + 1, 2 * m + 2);
                (blocks[(i, i)], blocks[(i, j)]) = (pair.re, -pair.im);
                (blocks[(j, i)], blocks[(j, j)]) = (pair.im, pair.re);
            }
            let identity = DMatrix::identity(s, s);
            assert!(
                (&tableau.t * &tableau.t_inverse - &identity).amax() < bound,
                "{order:?}"
            );
            let back = &tableau.t * blocks * &tableau.t_inverse * a;
            let off = (back - identity).amax();
            assert!(off < 10.0 * bound, "{order:?}: {off:e}");
        }
    }
}
