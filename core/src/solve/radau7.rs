//! Radau IIA with seven stages (order 13): the tableau, and dense output by the collocation polynomial.
//!
//! Hairer, Wanner: *Solving Ordinary Differential Equations II*, 2nd ed., Secs. VI.5, VII.4. A stiff mechanical
//! system is close to one with constraints (index 3). Whatever the order, the velocities across the constraints then
//! have errors of h^s for s stages, and the forces of h^(s-1). Hence many stages. The stage equations are solved by
//! modules that know the system; this module holds the parts common to all systems.

use super::gauss::Reversible;
use super::lagrange::lagrange;
use std::sync::OnceLock;

/// Number of stages.
pub const S: usize = 7;
/// Nodes of the stages; the last is the end of the step.
pub const NODES: [f64; S] = [
    0.029_316_427_159_784_893,
    0.148_078_599_668_484_3,
    0.336_984_690_281_154_3,
    0.558_671_518_771_550_2,
    0.769_233_862_030_054_5,
    0.926_945_671_319_741_1,
    1.0,
];
/// The real eigenvalue of the tableau's matrix.
pub const GAMMA: f64 = 0.111_896_465_300_035_08;

/// The tableau with derived constants.
#[derive(Debug)]
pub struct Tableau {
    /// A: integrals of the stages' polynomials up to the nodes.
    pub once: [[f64; S]; S],
    /// A^2: the double integrals.
    pub twice: [[f64; S]; S],
    /// Values at the start of the step of the polynomials through the stages.
    pub start: [f64; S],
}

/// Values at `x` of the polynomials through the stages.
pub fn through_stages(x: f64) -> [f64; S] {
    lagrange(&NODES, x)
}

/// The tableau, computed once.
pub fn tableau() -> &'static Tableau {
    static TABLEAU: OnceLock<Tableau> = OnceLock::new();
    TABLEAU.get_or_init(|| {
        // Gauss's rule with four points is exact for the degree 6 of the polynomials.
        let rule = [
            (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
            (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
        ];
        let row = |c: f64| {
            let mut sums = [0.0; S];
            for (x, weight) in rule.iter().flat_map(|(x, w)| [(-x, w), (*x, w)]) {
                for (sum, value) in sums.iter_mut().zip(through_stages(0.5 * c * (1.0 + x))) {
                    *sum += 0.5 * c * weight * value;
                }
            }
            sums
        };
        let once = NODES.map(row);
        let product = |i: usize, j: usize| (0..S).map(|k| once[i][k] * once[k][j]).sum();
        let twice = std::array::from_fn(|i| std::array::from_fn(|j| product(i, j)));
        Tableau {
            once,
            twice,
            start: through_stages(0.0),
        }
    })
}

/// One accepted step: the polynomial through its start and its stages. In the limit of great stiffness it is as
/// accurate inside as at its end, so no better interpolant is needed.
#[derive(Debug, Clone)]
pub struct RadauStep<Y> {
    /// State at the start.
    pub from: Y,
    /// State at the end.
    pub to: Y,
    /// Length.
    pub h: f64,
    stages: Box<[Y; S]>,
    /// Slopes at the start and at the end.
    slopes: Box<[Y; 2]>,
}

impl<Y: Reversible> RadauStep<Y> {
    /// A step of length `h` from the states at the stages and the slopes at both ends.
    pub fn new(from: Y, h: f64, stages: [Y; S], slopes: [Y; 2]) -> Self {
        Self {
            from,
            to: stages[S - 1].clone(),
            h,
            stages: Box::new(stages),
            slopes: Box::new(slopes),
        }
    }

    /// The slopes at the start and at the end.
    pub fn stage_slopes(&self) -> &[Y] {
        &*self.slopes
    }

    /// Slope at the end.
    pub fn end_slope(&self) -> &Y {
        &self.slopes[1]
    }

    /// The state at the fraction `x` in [0, 1] of the step.
    pub fn at(&self, x: f64) -> Y {
        let mut nodes = [0.0; S + 1];
        nodes[1..].copy_from_slice(&NODES);
        let weights = lagrange(&nodes, x);
        let mut state = self.from.clone();
        state.axpy(weights[0] - 1.0, &self.from);
        for (weight, stage) in weights[1..].iter().zip(self.stages.iter()) {
            state.axpy(*weight, stage);
        }
        state
    }

    /// The part of the step up to the length `h`, on the same polynomial.
    pub fn part(&self, mut f: impl FnMut(&Y) -> Option<Y>, h: f64) -> Option<Self> {
        let stages = NODES.map(|c| self.at(c * h / self.h));
        let end = f(&stages[S - 1])?;
        let slopes = [self.slopes[0].clone(), end];
        Some(Self::new(self.from.clone(), h, stages, slopes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a wrong digit of a node: the end integrates polynomials up to the degree 2 s - 2 exactly, unlike all
    /// other nodes with c_s = 1. Determinant and trace of A belong to the given eigenvalue.
    #[test]
    fn quadrature_is_that_of_radau() {
        let weights = tableau().once[S - 1];
        for power in 0..2 * S - 1 {
            let sum: f64 = (0..S)
                .map(|i| weights[i] * NODES[i].powi(power as i32))
                .sum();
            let want = 1.0 / (power + 1) as f64;
            assert!((sum - want).abs() < 1e-15, "{power}: {sum}");
        }
        let a = nalgebra::SMatrix::<f64, S, S>::from_fn(|i, j| tableau().once[i][j]);
        let shifted = a - nalgebra::SMatrix::<f64, S, S>::identity() * GAMMA;
        let values = shifted.singular_values();
        assert!(values.min() < 1e-14 * values.max(), "{values}");
    }
}
