//! The stages of Radau IIA of order 5: tableau, collocation polynomial, and the simplified Newton iteration that solves
//! them (Hairer, Wanner: *Solving Ordinary Differential Equations II*, 2nd ed., Sec. IV.8).

use super::system::{AnyLinearised, AnySystem, Factor};
use nalgebra::{Complex, DVector};

const SQRT6: f64 = 2.449_489_742_783_178;
/// Nodes c of the stages; the last is the end of the step.
pub(super) const NODES: [f64; 3] = [(4.0 - SQRT6) / 10.0, (4.0 + SQRT6) / 10.0, 1.0];
/// Eigenvalues of the inverse of the tableau's matrix A: GAMMA and ALPHA +- i BETA.
const GAMMA: f64 = 3.637_834_252_744_496;
const ALPHA: f64 = 2.681_082_873_627_752_3;
const BETA: f64 = 3.050_430_199_247_410_5;
/// A^-1 = T diag(GAMMA, [ALPHA, -BETA; BETA, ALPHA]) T^-1.
const T: [[f64; 3]; 3] = [
    [
        0.091_232_394_870_892_94,
        -0.141_255_295_020_954_2,
        -0.030_029_194_105_147_42,
    ],
    [
        0.241_717_932_707_107,
        0.204_129_352_293_799_93,
        0.382_942_112_757_261_9,
    ],
    [0.966_048_182_615_093, 1.0, 0.0],
];
const T_INVERSE: [[f64; 3]; 3] = [
    [
        4.325_579_890_063_155,
        0.339_199_251_815_809_87,
        0.541_770_539_935_874_9,
    ],
    [
        -4.178_718_591_551_905,
        -0.327_682_820_761_062_4,
        0.476_623_554_500_550_45,
    ],
    [
        -0.502_872_634_945_786_9,
        2.571_926_949_855_605,
        -0.596_039_204_828_224_9,
    ],
];
/// Weights of the stages in the error estimate, times GAMMA.
const ERROR: [f64; 3] = [
    -(13.0 + 7.0 * SQRT6) / 3.0,
    (-13.0 + 7.0 * SQRT6) / 3.0,
    -1.0 / 3.0,
];

/// The error after an increment is never taken to be less than this part of it: quadratures whose rows of the Jacobian
/// are zero follow one iteration behind.
const LAG: f64 = 0.05;
/// Most iterations of one solution of the stages.
const ITERATIONS: i32 = 8;

/// Differences z_i = y(t + c_i h) - y(t) of the three stages.
pub(super) type Stages = [DVector<f64>; 3];

/// Weights of z_1, z_2, z_3 in the collocation polynomial's y - y0 at the fraction `x` of the step.
pub(super) fn collocation(x: f64) -> [f64; 3] {
    let [c1, c2, c3] = NODES;
    [
        x * (x - c2) * (x - c3) / (c1 * (c1 - c2) * (c1 - c3)),
        x * (x - c1) * (x - c3) / (c2 * (c2 - c1) * (c2 - c3)),
        x * (x - c1) * (x - c2) / (c3 * (c3 - c1) * (c3 - c2)),
    ]
}

/// sum_i a_i z_i.
pub(super) fn combined(a: [f64; 3], z: &Stages) -> DVector<f64> {
    let mut sum = &z[0] * a[0];
    sum.axpy(a[1], &z[1], 1.0);
    sum.axpy(a[2], &z[2], 1.0);
    sum
}

/// The two matrices of the transformed stages for one step size.
pub(super) struct Factors {
    /// The step size.
    pub(super) h: f64,
    rounding: f64,
    real: Box<dyn Factor<f64>>,
    complex: Box<dyn Factor<Complex<f64>>>,
}

impl Factors {
    pub(super) fn new(jacobian: &dyn AnyLinearised, h: f64) -> Option<Self> {
        Some(Self {
            h,
            rounding: jacobian.rounding(h),
            real: jacobian.real(GAMMA / h)?,
            complex: jacobian.complex(Complex::new(ALPHA, BETA) / h)?,
        })
    }

    /// (GAMMA / h - J)^-1 (slope + sum_i e_i z_i / h): the error estimate, damped where the system is stiff.
    /// The last `algebraic` components have no derivative.
    pub(super) fn error(
        &self,
        slope: &DVector<f64>,
        z: &Stages,
        algebraic: usize,
    ) -> Option<DVector<f64>> {
        let mut error = combined(ERROR.map(|e| e / self.h), z);
        let differential = error.len() - algebraic;
        error.rows_mut(differential, algebraic).fill(0.0);
        error += slope;
        self.real.solve(&mut error).then_some(error)
    }
}

/// How a solution of the stages ended.
pub(super) enum Outcome {
    /// Solved.
    Solved,
    /// It does not converge or would take too long; a step shorter by the factor might.
    Slow(f64),
    /// A stage left the domain of the slope in the iteration of that number, from 0.
    Outside(i32),
}

/// The simplified Newton iteration, with what it learnt of its speed.
#[derive(Debug, Clone)]
pub(super) struct Newton {
    /// Bound of the remaining error of the stages.
    goal: f64,
    /// Increments below this which no longer shrink are rounding.
    floor: f64,
    /// theta / (1 - theta) of the last solution: error after an increment by its size.
    remainder: f64,
    /// Contraction per iteration seen in the last solution; 0 if it took one iteration.
    pub(super) contraction: f64,
    /// Iterations of the last solution.
    pub(super) iterations: u64,
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
        }
    }

    /// Takes larger increments for rounding: a sample inside a step that was accepted must not fail for rounding.
    pub(super) fn loosen(&mut self) {
        self.floor *= 100.0;
    }

    /// Most iterations of a solution.
    pub(super) const fn most() -> f64 {
        ITERATIONS as f64
    }

    /// Solves z = h A F(y + z) from the guess in `z`. Convergence is judged by increments of y, never by residuals of
    /// the slope: those may be large by rounding alone where the system is stiff.
    pub(super) fn solve(
        &mut self,
        system: &dyn AnySystem,
        y: &DVector<f64>,
        factors: &Factors,
        z: &mut Stages,
        evaluations: &mut u64,
    ) -> Outcome {
        let n = y.len();
        let h = factors.h;
        // Increments are taken for rounding up to the tolerance at most; where rounding is larger, a shorter step must reduce it.
        let floor = self.floor.max(factors.rounding.min(10.0 * self.floor));
        let mut slopes: Stages = std::array::from_fn(|_| DVector::zeros(n));
        let mut at = DVector::zeros(n);
        let (mut last, mut last_ratio) = (0.0, 0.0);
        // From no guess at all the first iteration moves the time of the stages, and nothing sees a load in time before the next.
        let blind = z.iter().all(|z| z.amax() == 0.0);
        let mut first = 0;
        self.remainder = self.remainder.powf(0.8);
        self.contraction = 0.0;
        self.iterations = 0;
        // W = T^-1 Z is kept apart, as in the book: Z = T W.
        let mut w: Stages = T_INVERSE.map(|row| combined(row, z));
        let mut pair = DVector::<Complex<f64>>::zeros(n);
        for k in 0..ITERATIONS {
            for (z, slope) in z.iter().zip(&mut slopes) {
                at.copy_from(y);
                at += z;
                *evaluations += 1;
                if system.balance(&at, slope).is_none() {
                    return Outcome::Outside(k);
                }
            }
            let mut real = combined(T_INVERSE[0], &slopes);
            let differential = n - system.algebraic();
            for i in 0..differential {
                real[i] -= GAMMA / h * w[0][i];
            }
            for i in 0..n {
                let f = [0, 1, 2].map(|j| slopes[j][i]);
                let dot = |row: [f64; 3]| row[0] * f[0] + row[1] * f[1] + row[2] * f[2];
                pair[i] = Complex::new(dot(T_INVERSE[1]), dot(T_INVERSE[2]));
                if i < differential {
                    pair[i] -= Complex::new(ALPHA, BETA) / h * Complex::new(w[1][i], w[2][i]);
                }
            }
            if !(factors.real.solve(&mut real) && factors.complex.solve(&mut pair)) {
                return Outcome::Slow(0.5);
            }
            let increment = [real, pair.map(|x| x.re), pair.map(|x| x.im)];
            let mut square = 0.0;
            for i in 0..3 {
                w[i] += &increment[i];
                let change = combined(T[i], &increment);
                square += system.mean_square(&change, y, y) / 3.0;
            }
            for i in 0..3 {
                z[i] = combined(T[i], &w);
            }
            self.iterations += 1;
            let size = square.sqrt();
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
                // Ratios of increments at the level of rounding say nothing.
                if size > floor || k == first + 1 {
                    self.contraction = theta;
                }
                self.remainder = (theta / (1.0 - theta)).max(LAG);
                let left = ITERATIONS - 1 - k;
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
    use nalgebra::Matrix3;

    /// Catches a wrong digit of the tableau: A integrates 1, c, c^2 up to each node, and T block-diagonalises A^-1.
    #[test]
    fn transformation_is_that_of_the_tableau() {
        let powers = |p: i32| NODES.map(|c| c.powi(p));
        let [v, b]: [Matrix3<f64>; 2] = [0, 1].map(|shift| {
            Matrix3::from_fn(|i, j| {
                let p = j as i32 + shift;
                powers(p)[i] / if shift == 1 { f64::from(p) } else { 1.0 }
            })
        });
        let a = b * v.try_inverse().unwrap();
        let t = Matrix3::from_fn(|i, j| T[i][j]);
        let t_inverse = Matrix3::from_fn(|i, j| T_INVERSE[i][j]);
        let blocks = Matrix3::new(GAMMA, 0.0, 0.0, 0.0, ALPHA, -BETA, 0.0, BETA, ALPHA);
        assert!((t * t_inverse - Matrix3::identity()).amax() < 1e-14);
        assert!((t * blocks * t_inverse * a - Matrix3::identity()).amax() < 1e-13);
    }
}
