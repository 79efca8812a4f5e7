//! The fast viscous layer: where a rod settles when its end is held and it leaves an equilibrium.
//!
//! With a small viscosity the jump is the gradient flow of the bending energy at fixed r(1)
//! (theory 2.6): u = theta', u_T = q . n - u, q(s) = J (r(1) - r(s)), J(a, b) = (-b, a), with n such
//! that r(1) stays. The spectrum of the flow lies in [-1, small]: explicit steps serve.

use super::equilibrium::Equilibrium;
use super::model::Elastica;
use crate::error::{Error, Result};
use crate::manifold::{EquilibriumManifold, invert_near};
use crate::solve::dop853::Dop853;
use gauss_quad::GaussLegendre;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// Gauss nodes for u. 48 resolve every stable rod with lam < 20 to 1e-9; the landing is polished in
/// the chart afterwards.
const NODES: usize = 48;
type Field = SVector<f64, NODES>;

/// Departure from the fold along its kernel, in chart units: far enough to leave the slow centre
/// manifold's bottom soon, near enough that the quadratic error does not matter.
const DEPARTURE: f64 = 5e-3;
/// Local error per step; the landing itself is polished.
const TOLERANCE: f64 = 1e-7;
/// The flow has arrived when |u_T| is below this and the chart confirms.
const ARRIVED: f64 = 1e-5;
/// Longest layer served, in units of its own time.
const LONGEST: f64 = 1e5;

/// Settles from the equilibrium `q` = (p, w), leaving it in the chart direction `leaving`.
///
/// # Errors
/// A flow that has not come to rest after 1e5 of its time units, or that rests outside the chart.
pub fn settle(q: &Vector2<f64>, leaving: &Vector2<f64>) -> Result<Vector2<f64>> {
    let start = Equilibrium::new(q[0], q[1])?;
    let beyond = q + leaving * (DEPARTURE / leaving.norm());
    let departed = Equilibrium::new(beyond[0], beyond[1])?;
    let held = Vector2::new(start.x, start.y);
    let rod = Rod::new(held);
    let mut u = Field::zeros();
    for (value, &s) in u.iter_mut().zip(rod.s.iter()) {
        *value = departed.section(s)?.curvature;
    }
    let mut flow = Dop853::new(u, rod.rate(&u).0, 0.1, TOLERANCE);
    let mut time = 0.0;
    while time < LONGEST {
        let step = flow
            .step(|u| Some(rod.rate(u).0), 50.0)
            .map_err(|_| Error::no_convergence("the viscous layer stalled"))?;
        time += step.h;
        if flow.slope().amax() < ARRIVED
            && let Some(landed) = rod.arrive(flow.state())
            && Elastica.index(&landed)? == 0
        {
            return Ok(landed);
        }
    }
    Err(Error::no_convergence(format!(
        "the viscous layer from (p, w) = ({}, {}) has not settled after {time:.0} of its time units; \
         the rod may rest on an unstable equilibrium: start from a slightly different pose, or choose another landing rule",
        q[0], q[1]
    )))
}

/// The discretised rod, end held.
struct Rod {
    held: Vector2<f64>,
    s: Field,
    weights: Field,
    /// (integrate f)_i = int_0^{s_i} f.
    integrate: SMatrix<f64, NODES, NODES>,
}

impl Rod {
    fn new(held: Vector2<f64>) -> Self {
        let rule = GaussLegendre::new(NODES.try_into().expect("NODES is not zero"));
        let mut pairs: Vec<_> = rule.as_node_weight_pairs().to_vec();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let s = Field::from_fn(|i, _| 0.5 * (1.0 + pairs[i].0));
        let weights = Field::from_fn(|i, _| 0.5 * pairs[i].1);
        // f = sum_k (2k+1)/2 <f, P_k> P_k and int_{-1}^x P_k = (P_{k+1} - P_{k-1})/(2k+1).
        let legendre = |x: f64| {
            let mut values = [0.0; NODES + 1];
            (values[0], values[1]) = (1.0, x);
            for k in 1..NODES {
                let n = k as f64;
                values[k + 1] = ((2.0 * n + 1.0) * x * values[k] - n * values[k - 1]) / (n + 1.0);
            }
            values
        };
        let table: Vec<_> = pairs.iter().map(|&(x, _)| legendre(x)).collect();
        let integrate = SMatrix::from_fn(|i, j| {
            let sum: f64 = (1..NODES)
                .map(|k| (table[i][k + 1] - table[i][k - 1]) * table[j][k])
                .sum();
            0.5 * weights[j] * (1.0 + pairs[i].0 + sum)
        });
        Self {
            held,
            s,
            weights,
            integrate,
        }
    }

    /// (u_T, n): the flow and the resultant that holds the end.
    fn rate(&self, u: &Field) -> (Field, Vector2<f64>) {
        let theta = self.integrate * u;
        let (cos, sin) = (theta.map(f64::cos), theta.map(f64::sin));
        let tip = Vector2::new(self.weights.dot(&cos), self.weights.dot(&sin));
        // q = J (r(1) - r(s)).
        let q_x = (self.integrate * sin).map(|y| y - tip[1]);
        let q_y = (self.integrate * cos).map(|x| tip[0] - x);
        let mean = |a: &Field, b: &Field| (0..NODES).map(|i| self.weights[i] * a[i] * b[i]).sum();
        let xx: f64 = mean(&q_x, &q_x);
        let xy: f64 = mean(&q_x, &q_y);
        let yy: f64 = mean(&q_y, &q_y);
        // r_T(1) = int q u_T = held - tip: the end is drawn back to where it is held.
        let demand = Vector2::new(mean(&q_x, u), mean(&q_y, u)) + (self.held - tip);
        let n = Matrix2::new(xx, xy, xy, yy)
            .try_inverse()
            .map_or_else(Vector2::zeros, |inverse| inverse * demand);
        (q_x * n[0] + q_y * n[1] - u, n)
    }

    /// The chart point of a shape at rest, polished so that its end is where it is held; None if the
    /// shape is not yet near an equilibrium.
    fn arrive(&self, u: &Field) -> Option<Vector2<f64>> {
        let (_, n) = self.rate(u);
        let lam = n.norm().sqrt();
        let alpha = (-n[1]).atan2(-n[0]);
        let theta1 = self.weights.dot(u);
        let half = 0.5 * (theta1 - alpha);
        let p = (half.sin() / half.cos().abs()).asinh();
        let guess = super::chart::amplitude(p, lam).ok()?;
        let landed = invert_near(&Elastica, &self.held, &Vector2::new(p, guess), 1e-15).ok()?;
        let there = Equilibrium::new(landed.q[0], landed.q[1]).ok()?;
        // The polish must not have wandered off to another equilibrium.
        let mut distance = 0.0;
        for i in 0..NODES {
            let gap = there.section(self.s[i]).ok()?.curvature - u[i];
            distance += self.weights[i] * gap * gap;
        }
        (distance.sqrt() < 1e-2 * (1.0 + u.norm())).then_some(landed.q)
    }
}
