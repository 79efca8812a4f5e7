//! One spectral element: polynomials through Legendre-Gauss-Lobatto nodes, diagonal mass, DOP853. For smooth motions.

use super::{Bar, BarMotion, End, EndState, Extremes, Law1d, Ledger, Snapshot};
use nalgebra::{DMatrix, DVector};
use snaprod_core::error::{Cause, Error, Result, Stuck};
use snaprod_core::math::gauss::{Rule, legendre};
use snaprod_core::solve::dop853::{Dop853, Step};

/// A bar in motion by one spectral element.
pub struct Spectral {
    element: SpectralElement,
    integrator: Dop853<DVector<f64>>,
    step: Step<DVector<f64>>,
    /// The bar's own units of the states, relative to which errors count: metal in metres would otherwise demand
    /// digits below rounding.
    units: DVector<f64>,
    extremes: [Extremes; 2],
    /// Energy and momentum at the start.
    first: [f64; 2],
}

/// The element: the state is (positions, velocities, work, impulse, time).
struct SpectralElement {
    bar: Bar,
    /// Material coordinates of the nodes.
    x: Vec<f64>,
    /// Weights of the quadrature over X.
    weights: Vec<f64>,
    /// d/dX at the nodes, and its transpose for the forces.
    derivative: DMatrix<f64>,
    /// Masses at the nodes, with those of the ends.
    masses: Vec<f64>,
}

/// Largest number of nodes of an element: more would make the steps too short.
const MOST: usize = 128;

impl Spectral {
    /// The bar with this number of nodes. The tolerance bounds the error of a step relative to the states and to the
    /// bar's own units: its length, the speed of waves at stretch 1, its mass.
    ///
    /// # Errors
    /// Fewer nodes than 3 or more than 128; a start outside the reach of the law.
    pub fn new(bar: &Bar, nodes: usize, tolerance: f64) -> Result<Self> {
        if !(3..=MOST).contains(&nodes) {
            return Err(Error::domain(format!(
                "cells = {nodes} of a bar: a spectral element has 3 to {MOST} nodes; for motions that are not smooth use \
                 scheme = \"finite-volume\""
            )));
        }
        let element = SpectralElement::new(bar, nodes);
        let (stretch, velocity) = bar.sampled(element.x.iter().copied())?;
        // Places from the stretch between the nodes, by quadrature.
        let rule = Rule::new(nodes);
        let mut state = DVector::zeros(2 * nodes + 3);
        for i in 1..nodes {
            let (a, b) = (element.x[i - 1], element.x[i]);
            let at = |t: &f64| bar.at_start(a + (b - a) * t)[0];
            let terms = rule.nodes.iter().zip(&rule.weights);
            state[i] = state[i - 1] + (b - a) * terms.map(|(t, w)| w * at(t)).sum::<f64>();
        }
        for (i, v) in velocity.iter().enumerate() {
            let held = (i == 0 && bar.ends[0] == End::Wall)
                || (i == nodes - 1 && bar.ends[1] == End::Wall);
            state[nodes + i] = if held { 0.0 } else { *v };
        }
        let mut slope = state.clone();
        element.slope(&state, f64::INFINITY, &mut slope);
        let fastest = stretch
            .iter()
            .map(|lam| bar.material.speed(*lam))
            .fold(0.0, f64::max);
        let h = 0.1 * element.x[1] / fastest;
        let integrator = Dop853::new(state, slope, h, tolerance);
        let step = integrator.blank();
        let (length, speed) = (bar.length, bar.material.speed(1.0));
        let momentum = bar.mass() * speed;
        let mut units = DVector::from_element(2 * nodes + 3, length);
        units.rows_mut(nodes, nodes).fill(speed);
        let sums = [momentum * speed, momentum, length / speed];
        units.rows_mut(2 * nodes, 3).copy_from_slice(&sums);
        let mut spectral = Self {
            element,
            integrator,
            step,
            units,
            extremes: [Extremes::new(0.0, 0.0); 2],
            first: [0.0; 2],
        };
        spectral.extremes = spectral
            .snapshot()
            .ends
            .map(|end| Extremes::new(0.0, end.stress));
        let ledger = spectral.ledger();
        spectral.first = [ledger.kinetic + ledger.strain, ledger.momentum];
        Ok(spectral)
    }

    fn state(&self) -> &DVector<f64> {
        self.integrator.state()
    }

    fn see(&mut self) {
        let (t, ends) = (self.time(), self.snapshot().ends);
        for (extremes, end) in self.extremes.iter_mut().zip(ends) {
            extremes.see(t, end.stress);
        }
    }
}

impl SpectralElement {
    fn new(bar: &Bar, count: usize) -> Self {
        let (nodes, weights) = lobatto(count);
        let n = count - 1;
        let half = 0.5 * bar.length;
        // P_n at the nodes gives the derivative of the Lagrange polynomials in closed form.
        let p: Vec<f64> = nodes.iter().map(|x| legendre(*x, count)[n]).collect();
        let mut derivative = DMatrix::from_fn(count, count, |i, j| {
            if i == j {
                0.0
            } else {
                p[i] / (p[j] * (nodes[i] - nodes[j])) / half
            }
        });
        for i in 0..count {
            // Rows sum to zero, also in rounding: a uniform shift has no stretch.
            derivative[(i, i)] = -derivative.row(i).sum();
        }
        let weights: Vec<f64> = weights.iter().map(|w| w * half).collect();
        let mut masses: Vec<f64> = (weights.iter())
            .map(|w| w * bar.area * bar.material.density())
            .collect();
        for (end, node) in bar.ends.iter().zip([0, n]) {
            if let End::Mass { mass, .. } = end {
                masses[node] += mass;
            }
        }
        Self {
            bar: bar.clone(),
            x: nodes.iter().map(|x| half * (1.0 + x)).collect(),
            weights,
            derivative,
            masses,
        }
    }

    /// The slope of a state, with loads evaluated before the time `stop` of their break; None outside the law.
    fn slope(&self, state: &DVector<f64>, stop: f64, out: &mut DVector<f64>) -> Option<()> {
        let n = self.x.len();
        let t = state[2 * n + 2].min(stop.next_down());
        let mut stress = &self.derivative * state.rows(0, n);
        for (stretch, weight) in stress.iter_mut().zip(&self.weights) {
            self.bar.material.check(*stretch).ok()?;
            *stretch = -self.bar.area * weight * self.bar.material.stress(*stretch);
        }
        let mut force = self.derivative.tr_mul(&stress);
        let mut outer = [0.0; 2];
        let (mut work, mut impulse) = (0.0, 0.0);
        for (side, node) in [0, n - 1].into_iter().enumerate() {
            let end = &self.bar.ends[side];
            outer[side] = match end {
                End::Wall => -force[node],
                _ => end.force(t),
            };
            force[node] += outer[side];
            work += outer[side] * state[n + node];
            impulse += outer[side];
        }
        for i in 0..n {
            out[i] = state[n + i];
            out[n + i] = force[i] / self.masses[i];
        }
        out[2 * n] = work;
        out[2 * n + 1] = impulse;
        out[2 * n + 2] = 1.0;
        Some(())
    }
}

impl BarMotion for Spectral {
    fn time(&self) -> f64 {
        self.state()[2 * self.element.x.len() + 2]
    }

    fn go(&mut self, until: f64, steps: usize) -> Result<(), Stuck> {
        for _ in 0..steps {
            let t = self.time();
            if t >= until {
                break;
            }
            let stop = self.element.bar.next_break(t);
            let left = until.min(stop) - t;
            let Self {
                element,
                integrator,
                step,
                units,
                ..
            } = self;
            let slope = |y: &DVector<f64>, out: &mut DVector<f64>| element.slope(y, stop, out);
            let mean_square = |error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>| {
                let scales = units.iter().zip(from.iter().zip(to));
                let scales = scales.map(|(unit, (a, b))| unit + a.abs().max(b.abs()));
                let terms = error
                    .iter()
                    .zip(scales)
                    .map(|(e, scale)| (e / scale).powi(2));
                terms.sum::<f64>() / error.len() as f64
            };
            if integrator
                .step_measured(slope, mean_square, left, step)
                .is_err()
            {
                if let Some(stuck) = element.bar.overloaded(t) {
                    return Err(stuck);
                }
                let tolerance = 1e-13;
                let cause = Cause::StepCollapsed {
                    next: integrator.next_step(),
                    tolerance,
                };
                let remedy =
                    "the motion is no longer smooth on these nodes: use scheme = \"finite-volume\"";
                return Err(Stuck::new(t, cause, remedy));
            }
            if step.h >= left {
                let mut state = integrator.state().clone();
                let last = state.len() - 1;
                state[last] = until.min(stop);
                let mut slope = state.clone();
                let next = element.bar.next_break(state[last]);
                if element.slope(&state, next, &mut slope).is_none() {
                    let remedy = "the bar has left the reach of its law: lower the loads";
                    return Err(Stuck::new(t, Cause::EdgeOfDomain, remedy));
                }
                let h = integrator.next_step();
                integrator.restart(state, slope, h);
            }
            self.see();
        }
        Ok(())
    }

    fn snapshot(&self) -> Snapshot {
        let (n, state) = (self.element.x.len(), self.state());
        let stretch: Vec<f64> = (&self.element.derivative * state.rows(0, n))
            .iter()
            .copied()
            .collect();
        let stress: Vec<f64> = stretch
            .iter()
            .map(|lam| self.element.bar.material.stress(*lam))
            .collect();
        Snapshot {
            time: self.time(),
            x: self.element.x.clone(),
            ends: [0, n - 1].map(|i| EndState {
                position: state[i],
                velocity: state[n + i],
                stress: stress[i],
            }),
            velocity: state.rows(n, n).iter().copied().collect(),
            stretch,
            stress,
        }
    }

    fn ledger(&self) -> Ledger {
        let (n, state) = (self.element.x.len(), self.state());
        let now = self.snapshot();
        let material = &self.element.bar.material;
        let terms = self.element.masses.iter().zip(&now.velocity);
        let kinetic: f64 = terms.clone().map(|(m, v)| 0.5 * m * v * v).sum();
        let momentum: f64 = terms.map(|(m, v)| m * v).sum();
        let strained = self.element.weights.iter().zip(&now.stretch);
        let strain = self.element.bar.area
            * strained
                .map(|(w, lam)| w * material.energy(*lam))
                .sum::<f64>();
        Ledger {
            kinetic,
            strain,
            work: state[2 * n],
            lost: self.first[0] + state[2 * n] - kinetic - strain,
            dissipated: 0.0,
            momentum: momentum - self.first[1],
            impulse: state[2 * n + 1],
        }
    }

    fn extremes(&self) -> [Extremes; 2] {
        self.extremes
    }
}

/// Nodes and weights on [-1, 1] of the rule with both ends: the zeros of (1 - x^2) P_n'(x).
fn lobatto(count: usize) -> (Vec<f64>, Vec<f64>) {
    let n = count - 1;
    let of = n as f64;
    let nodes: Vec<f64> = (0..count)
        .map(|i| {
            let mut x = -(std::f64::consts::PI * i as f64 / of).cos();
            // (1 - x^2) P_n' = n (P_(n-1) - x P_n), of which the derivative is -n (n + 1) P_n.
            for _ in 0..20 {
                let p = legendre(x, count);
                x -= (x * p[n] - p[n - 1]) / ((of + 1.0) * p[n]);
            }
            match i {
                0 => -1.0,
                i if i == n => 1.0,
                _ => x,
            }
        })
        .collect();
    let weight = |x: &f64| 2.0 / (of * (of + 1.0) * legendre(*x, count)[n].powi(2));
    let weights = nodes.iter().map(weight).collect();
    (nodes, weights)
}
